//! Makes the study that ships in `apps/anatomy/data`: a prostate with urethra, rectum and pubic bone, as DICOM and as JSON.
//!
//! ```sh
//! cargo run --release -p stylet-anatomy --example synthetic_study -- apps/anatomy/data [SEED]
//! ```

use std::{error::Error, fs, path::Path};
use stylet_anatomy::{Study, json, rt, synthetic};
use stylet_mesh::generate::contours::ContourSettings;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let folder = Path::new(arguments.first().ok_or("usage: synthetic_study FOLDER [SEED]")?);
    let seed = arguments.get(1).map_or(Ok(1), |text| text.parse())?;
    let study = Study { drawings: synthetic::study(seed), notes: Vec::new() };
    fs::create_dir_all(folder)?;
    fs::write(folder.join("synthetic.json"), json::write(&study.drawings)?)?;
    fs::write(folder.join("synthetic.dcm"), rt::write(&study.drawings, "Synthetic study")?)?;
    let (set, repairs) = study.check(&ContourSettings::default())?;
    for organ in set.organs() {
        println!("{:12} {:3} slices {:8.2} mL", organ.name(), organ.slices().len(), organ.volume() * 1e6);
    }
    repairs.iter().for_each(|repair| println!("{repair}"));
    Ok(())
}
