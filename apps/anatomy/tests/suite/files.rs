//! Files read back, files refused, and the study that ships.

use dicom_core::{DataElement, Tag, VR, value::DataSetSequence};
use dicom_dictionary_std::{tags, uids};
use dicom_object::{DefaultDicomObject, FileMetaTableBuilder, InMemDicomObject, OpenFileOptions, file::ReadPreamble};
use proptest::prelude::*;
use std::{fs, path::PathBuf};
use stylet_anatomy::{Problem, ReadError, StudyError, WriteError, json, read, rt, synthetic};
use stylet_mesh::generate::{
    contours::{ContourSet, ContourSettings, Drawing, PlanarContour, Repair},
    implicit::Implicit,
};

fn shipped(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("data").join(name)
}

#[test]
fn the_generator_makes_the_shipped_files_byte_for_byte() {
    let drawings = synthetic::study(1);
    assert!(json::write(&drawings).unwrap() == fs::read(shipped("synthetic.json")).unwrap());
    assert!(rt::write(&drawings, "Synthetic study").unwrap() == fs::read(shipped("synthetic.dcm")).unwrap());
}

#[test]
fn both_shipped_files_hold_the_same_organs() {
    let (from_dicom, from_json) = (read(&shipped("synthetic.dcm")).unwrap(), read(&shipped("synthetic.json")).unwrap());
    assert_eq!(from_dicom, from_json);
    assert_eq!(from_json.drawings, synthetic::study(1));
    let (set, repairs) = from_json.check(&ContourSettings::default()).unwrap();
    assert!(repairs.iter().all(|repair| matches!(repair, Repair::DuplicatePoints { .. })) && !repairs.is_empty());
    let names: Vec<&str> = set.organs().iter().map(|organ| organ.name()).collect();
    assert_eq!(names, ["urethra", "prostate", "rectum", "pubic bone"]);
    assert_eq!(set.organs().iter().map(|organ| organ.slices().len()).collect::<Vec<_>>(), [14, 9, 15, 9]);
    let rami: Vec<usize> = set.organs()[3].slices().iter().map(|slice| slice.parts.len()).collect();
    assert_eq!(rami, [2, 2, 2, 2, 1, 1, 1, 1, 1], "two rami join in the symphysis");
}

/// The solids that meshes are made of hold what their contours do by Cavalieri's rule, within the 3 % asked of meshes.
#[test]
fn solids_of_the_shipped_study_have_the_volumes_of_their_contours() {
    const N: usize = 72;
    let (set, _) = read(&shipped("synthetic.json")).unwrap().check(&ContourSettings::default()).unwrap();
    for (organ, solid) in set.organs().iter().zip(set.solids()) {
        let [low, high] = solid.bounds().unwrap();
        let step: [f64; 3] = std::array::from_fn(|k| (high[k] - low[k]) / N as f64);
        let sample = |i: usize| {
            let at = [i % N, i / N % N, i / N / N];
            std::array::from_fn(|k| low[k] + (at[k] as f64 + 0.5) * step[k])
        };
        let inside = (0..N * N * N).filter(|&i| solid.distance(&sample(i)) < 0.0).count();
        let ratio = inside as f64 * step.iter().product::<f64>() / organ.volume();
        assert!((ratio - 1.0).abs() < 0.03, "{}: {ratio}", organ.name());
    }
}

#[test]
fn a_selection_sets_the_precedence() {
    let study = read(&shipped("synthetic.dcm")).unwrap();
    let chosen = study.select(&["rectum", "prostate"]).unwrap();
    assert_eq!(chosen.drawings.iter().map(|d| d.name.as_str()).collect::<Vec<_>>(), ["rectum", "prostate"]);
    let has = ["urethra", "prostate", "rectum", "pubic bone"].map(String::from).to_vec();
    assert_eq!(study.select(&["bladder"]).unwrap_err(), StudyError::Unknown { name: "bladder".into(), has });
}

fn drawings() -> impl Strategy<Value = Vec<Drawing>> {
    let coordinate = || -0.5_f64..0.5;
    let contour = (coordinate(), any::<bool>(), proptest::collection::vec((coordinate(), coordinate()), 1..9));
    let contour = contour.prop_map(|(z, open, points)| PlanarContour {
        points: points.into_iter().map(|(x, y)| [x, y, z]).collect(),
        open,
    });
    let drawing = ("[a-zµ\"][a-z ]{0,20}[a-z]", proptest::collection::vec(contour, 1..5));
    let drawing = drawing.prop_map(|(name, contours)| Drawing { name, contours });
    proptest::collection::vec(drawing, 1..4)
}

proptest! {
    /// Both forms keep nanometres, and what they made once stays the same to the bit.
    #[test]
    fn both_forms_read_back_the_same(drawings in drawings()) {
        let once = json::read(&json::write(&drawings).unwrap()).unwrap().drawings;
        let numbers = |set: &[Drawing]| -> Vec<f64> {
            set.iter().flat_map(|d| &d.contours).flat_map(|c| &c.points).flatten().copied().collect()
        };
        prop_assert!(numbers(&drawings).iter().zip(numbers(&once)).all(|(a, b)| (a - b).abs() < 0.6e-9));
        prop_assert_eq!(&json::read(&json::write(&once).unwrap()).unwrap().drawings, &once);
        prop_assert_eq!(&rt::read(&rt::write(&drawings, "set").unwrap()).unwrap().drawings, &once);
    }

    /// Checked organs make drawings that make the same organs.
    #[test]
    fn checked_sets_read_back_the_same(seed: u64) {
        let (set, _) = ContourSet::new(&synthetic::study(seed), &ContourSettings::default()).unwrap();
        let drawings: Vec<Drawing> = set.organs().iter().map(|organ| organ.drawing()).collect();
        for study in [json::read(&json::write(&drawings).unwrap()), rt::read(&rt::write(&drawings, "set").unwrap())] {
            let (back, repairs) = study.unwrap().check(&ContourSettings::default()).unwrap();
            prop_assert_eq!(&back, &set);
            prop_assert_eq!(repairs, vec![]);
        }
    }

    /// A file with bytes changed is read or refused, never worse.
    #[test]
    fn broken_files_are_errors(changes in proptest::collection::vec((0_usize..4_000, any::<u8>()), 1..4)) {
        for (mut bytes, read) in [(small_dicom(), rt::read as fn(&[u8]) -> _), (json::write(&small()).unwrap(), json::read)] {
            let n = bytes.len();
            changes.iter().for_each(|(at, byte)| bytes[at % n] = *byte);
            if let Err(problem) = read(&bytes) {
                prop_assert!(!problem.to_string().is_empty());
            }
        }
    }
}

/// A file cut short is refused, or only lacks what comes after the contours: never read with fewer.
#[test]
fn files_cut_short_do_not_lose_contours() {
    for (bytes, read) in [(small_dicom(), rt::read as fn(&[u8]) -> _), (json::write(&small()).unwrap(), json::read)] {
        for cut in 0..bytes.len() {
            assert!(!read(&bytes[..cut]).is_ok_and(|study| study.drawings != small()), "cut at {cut}");
        }
    }
    let cut = &small_dicom()[..small_dicom().len() - 8];
    let message = rt::read(cut).unwrap_err().to_string();
    assert!(message.ends_with("the file ends within 1 open sequences and items: it was cut short"), "{message}");
}

/// An element that claims more than there is, and sequences without end, are refused before room is made for them.
#[test]
fn lengths_are_checked_first() {
    let good = small_dicom();
    let at = good.windows(4).position(|w| w == [0x06, 0x30, 0x20, 0x00]).unwrap();
    let mut long = good.clone();
    long[at + 8..at + 12].copy_from_slice(&0x7fff_ffff_u32.to_le_bytes());
    let message = rt::read(&long).unwrap_err().to_string();
    assert!(message.contains("element (3006,0020)") && message.contains("claims 2147483647 bytes"), "{message}");
    let mut deep = good[..at].to_vec();
    for _ in 0..100_000 {
        deep.extend([
            0x06, 0x30, 0x20, 0x00, b'S', b'Q', 0, 0, 0xff, 0xff, 0xff, 0xff, 0xfe, 0xff, 0, 0xe0, 0xff, 0xff, 0xff,
            0xff,
        ]);
    }
    let message = rt::read(&deep).unwrap_err().to_string();
    assert!(message.contains("expected at most 32 sequences within each other"), "{message}");
    let mut other = good;
    let syntax = other.windows(19).position(|w| w == b"1.2.840.10008.1.2.1").unwrap();
    other[syntax + 18] = b'2';
    let message = rt::read(&other).unwrap_err().to_string();
    assert!(message.contains("transfer syntax \"1.2.840.10008.1.2.2\""), "{message}");
}

fn small() -> Vec<Drawing> {
    let square = |z: f64| vec![[0.0, 0.0, z], [0.01, 0.0, z], [0.01, 0.01, z], [0.0, 0.01, z]];
    let contours = vec![PlanarContour::closed(square(0.0)), PlanarContour::closed(square(0.005))];
    vec![Drawing { name: "cube".into(), contours }]
}

fn small_dicom() -> Vec<u8> {
    rt::write(&small(), "small").unwrap()
}

/// What is wrong with the small set after a change.
fn refused(change: impl FnOnce(&mut DefaultDicomObject)) -> String {
    let mut file = OpenFileOptions::new().read_preamble(ReadPreamble::Always).from_reader(&small_dicom()[..]).unwrap();
    change(&mut file);
    let mut bytes = Vec::new();
    file.write_all(&mut bytes).unwrap();
    rt::read(&bytes).unwrap_err().to_string()
}

/// The same after a change of the first item of nested sequences.
fn refused_in(path: &[Tag], change: impl FnOnce(&mut InMemDicomObject)) -> String {
    fn descend(object: &mut InMemDicomObject, path: &[Tag], change: impl FnOnce(&mut InMemDicomObject)) {
        let Some((tag, rest)) = path.split_first() else { return change(object) };
        let mut items = object.get(*tag).unwrap().items().unwrap().to_vec();
        descend(&mut items[0], rest, change);
        object.put(DataElement::new(*tag, VR::SQ, DataSetSequence::from(items)));
    }
    refused(|file| descend(file, path, change))
}

#[test]
fn implicit_vr_is_read_too() {
    let file = OpenFileOptions::new().read_preamble(ReadPreamble::Always).from_reader(&small_dicom()[..]).unwrap();
    let meta = FileMetaTableBuilder::new().transfer_syntax(uids::IMPLICIT_VR_LITTLE_ENDIAN);
    let mut bytes = Vec::new();
    file.into_inner().with_meta(meta).unwrap().write_all(&mut bytes).unwrap();
    assert_eq!(rt::read(&bytes).unwrap().drawings, small());
}

fn set(tag: Tag, vr: VR, text: &str) -> impl FnOnce(&mut InMemDicomObject) {
    let text = text.to_owned();
    move |object| {
        object.put(DataElement::new(tag, vr, dicom_core::PrimitiveValue::from(text)));
    }
}

#[test]
fn structure_sets_are_refused_with_place_and_reason() {
    let contour = [tags::ROI_CONTOUR_SEQUENCE, tags::CONTOUR_SEQUENCE];
    let of = |tag: Tag| move |object: &mut InMemDicomObject| assert!(object.remove_element(tag));
    let here = "ROI 1 (\"cube\"), contour 0";
    let data = "0\\0\\0\\10\\0\\0\\10\\10\\0\\0\\10";
    let mut cases = vec![
        (
            refused(|file| drop(file.put_str(tags::SOP_CLASS_UID, VR::UI, "1.2.840.10008.5.1.4.1.1.2"))),
            "SOP class 1.2.840.10008.5.1.4.1.1.2, expected RT Structure Set Storage (1.2.840.10008.5.1.4.1.1.481.3)"
                .into(),
        ),
        (
            refused(|file| of(tags::STRUCTURE_SET_ROI_SEQUENCE)(file)),
            "structure set: Structure Set ROI Sequence (3006,0020) is missing or empty".into(),
        ),
        (
            refused(|file| of(tags::ROI_CONTOUR_SEQUENCE)(file)),
            "structure set: ROI Contour Sequence (3006,0039) is missing or empty".into(),
        ),
        (
            refused_in(&contour[..1], of(tags::CONTOUR_SEQUENCE)),
            "no contour in any of its 1 ROIs, expected closed planar contours".into(),
        ),
        (
            refused_in(&contour[..1], set(tags::REFERENCED_ROI_NUMBER, VR::IS, "7")),
            "ROI 7 stands 0 times in Structure Set ROI Sequence (3006,0020), expected once".into(),
        ),
        (
            refused_in(&[tags::STRUCTURE_SET_ROI_SEQUENCE], set(tags::ROI_NUMBER, VR::IS, "one")),
            "structure set, item 0: ROI Number (3006,0022) is \"one\", expected a whole number".into(),
        ),
        (
            refused_in(&[tags::STRUCTURE_SET_ROI_SEQUENCE], of(tags::ROI_NAME)),
            "ROI 1: ROI Name (3006,0026) is missing or empty".into(),
        ),
    ];
    type Change = Box<dyn FnOnce(&mut InMemDicomObject)>;
    let in_contour: [(&str, Change); 6] = [
        (": Contour Data (3006,0050) is missing or empty", Box::new(of(tags::CONTOUR_DATA))),
        (": Contour Geometric Type (3006,0042) is missing or empty", Box::new(of(tags::CONTOUR_GEOMETRIC_TYPE))),
        (
            ": Contour Geometric Type (3006,0042) is \"OPEN_NONPLANAR\", expected CLOSED_PLANAR",
            Box::new(set(tags::CONTOUR_GEOMETRIC_TYPE, VR::CS, "OPEN_NONPLANAR")),
        ),
        (
            ": Contour Data (3006,0050) is 11 numbers, expected three for each point",
            Box::new(set(tags::CONTOUR_DATA, VR::DS, data)),
        ),
        (
            ": Number of Contour Points (3006,0046) is 5, expected 4, the points in Contour Data (3006,0050)",
            Box::new(set(tags::NUMBER_OF_CONTOUR_POINTS, VR::IS, "5")),
        ),
        (
            " lies in the coronal plane y = 2 mm, expected an axial plane (z = const)",
            Box::new(set(tags::CONTOUR_DATA, VR::DS, "0\\2\\0\\9\\2\\0\\9\\2\\8\\0\\2\\8")),
        ),
    ];
    for (message, change) in in_contour {
        cases.push((refused_in(&contour, change), format!("{here}{message}")));
    }
    for (found, expected) in cases {
        assert_eq!(found, expected);
    }
    let words = refused_in(&contour, set(tags::CONTOUR_DATA, VR::DS, "0\\0\\zero"));
    assert!(words.starts_with(&format!("{here}: Contour Data (3006,0050) is ")), "{words}");
}

#[test]
fn points_are_noted_and_open_contours_reach_the_check() {
    let marked = |kind: &str| {
        let mut drawings = small();
        drawings.push(Drawing { name: "marker".into(), contours: vec![drawings[0].contours[0].clone()] });
        let mut file = OpenFileOptions::new().from_reader(&rt::write(&drawings, "small").unwrap()[..]).unwrap();
        let mut rois = file.get(tags::ROI_CONTOUR_SEQUENCE).unwrap().items().unwrap().to_vec();
        let mut contours = rois[1].get(tags::CONTOUR_SEQUENCE).unwrap().items().unwrap().to_vec();
        set(tags::CONTOUR_GEOMETRIC_TYPE, VR::CS, kind)(&mut contours[0]);
        rois[1].put(DataElement::new(tags::CONTOUR_SEQUENCE, VR::SQ, DataSetSequence::from(contours)));
        file.put(DataElement::new(tags::ROI_CONTOUR_SEQUENCE, VR::SQ, DataSetSequence::from(rois)));
        let mut bytes = Vec::new();
        file.write_all(&mut bytes).unwrap();
        rt::read(&bytes).unwrap()
    };
    let study = marked("POINT");
    assert_eq!(study.drawings, small());
    assert_eq!(study.notes.len(), 2, "{:?}", study.notes);
    assert_eq!(study.notes[0], "ROI 2 (\"marker\"): left out 1 items of type POINT");
    let open = marked("OPEN_PLANAR").check(&ContourSettings::default()).unwrap_err();
    assert!(open.to_string().starts_with("organ \"marker\", contour 0 is open: 0.01 m between its ends"), "{open}");
}

#[test]
fn json_is_refused_with_place_and_reason() {
    let small = String::from_utf8(json::write(&small()).unwrap()).unwrap();
    let refused = |from: &str, to: &str| {
        assert!(small.contains(from));
        json::read(small.replacen(from, to, 1).as_bytes()).unwrap_err()
    };
    let schema = |key, found: &str, expected| Problem::Schema { key, found: found.into(), expected };
    assert_eq!(refused("stylet-contours", "contours"), schema("format", "contours", "stylet-contours"));
    assert_eq!(refused("\"version\": 1", "\"version\": 2"), schema("version", "2", "1"));
    for (from, to, says) in [
        ("\"mm\"", "\"inch\"", "unknown variant `inch`, expected `mm` or `m` at line 4"),
        ("\"z\"", "\"height\"", "unknown field `height`, expected one of `z`, `open`, `points` at line 7"),
        ("[0.0,0.0]", "[0.0]", "invalid length 1, expected an array of length 2 at line 7"),
        ("[0.0,0.0]", "[0.0,1e999]", "number out of range at line 7"),
        ("[0.0,0.0]", "[0.0,null]", "invalid type: null, expected f64 at line 7"),
    ] {
        let message = refused(from, to).to_string();
        assert!(message.starts_with(&format!("not contours as JSON: {says}")), "{message}");
    }
    // Other units: a metre is a metre.
    let metres = json::read(small.replace("\"mm\"", "\"m\"").as_bytes()).unwrap();
    assert_eq!(metres.drawings[0].contours[1].points[2], [10.0, 10.0, 5.0]);
}

#[test]
fn other_files_are_refused_by_name() {
    let path = std::env::temp_dir().join(format!("stylet-anatomy-{}.txt", std::process::id()));
    fs::write(&path, "solid\n").unwrap();
    let message = read(&path).unwrap_err().to_string();
    fs::remove_file(&path).unwrap();
    let expected = r#"starts with "solid\n", expected a DICOM file ("DICM" after 128 bytes) or JSON ("{")"#;
    assert_eq!(message, format!("{}: {expected}", path.display()));
    assert!(matches!(read(&path), Err(ReadError::System { .. })));
    let broken = rt::read(&[[0; 128].as_slice(), b"DICM", &[1; 40]].concat()).unwrap_err();
    assert!(matches!(broken, Problem::Dicom(_)), "{broken}");
}

#[test]
fn writers_refuse_what_they_cannot_hold() {
    let mut drawings = small();
    drawings[0].name = "a\\b".into();
    assert!(matches!(rt::write(&drawings, "set"), Err(WriteError::Name { .. })));
    let mut drawings = small();
    drawings[0].contours[1].points[0][1] = f64::NAN;
    assert!(matches!(rt::write(&drawings, "set"), Err(WriteError::Coordinate { contour: 1, .. })));
    assert!(matches!(json::write(&drawings), Err(WriteError::Coordinate { contour: 1, .. })));
    let mut drawings = small();
    drawings[0].contours[0].points[0][2] = 0.001;
    assert!(matches!(json::write(&drawings), Err(WriteError::NotPlanar { contour: 0, .. })));
}
