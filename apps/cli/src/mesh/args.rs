//! The arguments of `stylet mesh`.

use clap::{Args, Subcommand, ValueEnum};
use std::path::PathBuf;
use stylet_mesh::Rule;

/// `stylet mesh`
#[derive(Args, Debug)]
pub struct MeshArgs {
    /// What to do; the help if left out.
    #[command(subcommand)]
    pub command: Option<MeshCommand>,
}

/// The commands of `stylet mesh`.
#[derive(Subcommand, Debug)]
pub enum MeshCommand {
    /// Fill a box with triangles or tetrahedra.
    Box(BoxArgs),
    /// Fill organs with tetrahedra: from shapes, or from contours on slices.
    Generate(GenerateArgs),
    /// Bisect the simplices at a point, along a segment, or everywhere, down to a size.
    Refine(RefineArgs),
    /// Refine, take the refinement back, and tell whether the start mesh returns.
    Coarsen(CoarsenArgs),
    /// Angles, aspect ratios and faults of a mesh: tables, histograms, a picture; repair.
    Quality(QualityArgs),
    /// Read a mesh in one format and write it in another.
    Convert(ConvertArgs),
    /// Push a needle's tip along a path, remeshing around it, and pull it out again.
    Remesh(RemeshArgs),
}

/// What every command has.
#[derive(Args, Debug)]
pub struct OutputArgs {
    /// Print one JSON object, and nothing else.
    #[arg(long)]
    pub json: bool,
    /// No progress on standard error.
    #[arg(long)]
    pub quiet: bool,
}

const BOX_EXAMPLES: &str = "\
Examples:
  stylet mesh box --lower 0,0 --upper 0.1,0.1 --cells 8,8 --out slab.vtu
  stylet mesh box --lower 0,0,0 --upper 1,1,1 --cells 7,7,7 --out cube.vtu

Each of the parts is divided into 2 triangles or 6 tetrahedra (Kuhn 1960).";

/// `stylet mesh box`
#[derive(Args, Debug)]
#[command(after_help = BOX_EXAMPLES)]
pub struct BoxArgs {
    /// The corner with the smallest coordinates: 2 or 3 numbers.
    #[arg(long, value_name = "X,Y[,Z]", allow_hyphen_values = true)]
    pub lower: String,
    /// The corner with the greatest coordinates.
    #[arg(long, value_name = "X,Y[,Z]", allow_hyphen_values = true)]
    pub upper: String,
    /// Number of parts along each axis.
    #[arg(long, value_name = "I,J[,K]", allow_hyphen_values = true)]
    pub cells: String,
    /// Write the mesh to this file, in the format of its extension.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Draw the mesh.
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,
    /// JSON, progress.
    #[command(flatten)]
    pub output: OutputArgs,
}

/// Where to refine, and how far.
#[derive(Args, Debug)]
pub struct FeatureArgs {
    /// The start mesh: kuhn2, kuhn3 or kuhn4 (the unit square, cube, hypercube), several parts a side as in kuhn3:7x7x7,
    /// or a mesh file.
    #[arg(long, value_name = "MESH")]
    pub start: String,
    /// Refine the simplices that touch this point: as many numbers as the mesh has dimensions.
    #[arg(long, value_name = "X,Y,…", allow_hyphen_values = true, conflicts_with_all = ["segment", "uniform"])]
    pub point: Option<String>,
    /// Refine the simplices that touch the segment between these two points.
    #[arg(long, value_name = "X,Y,…,X,Y,…", allow_hyphen_values = true, conflicts_with = "uniform")]
    pub segment: Option<String>,
    /// Bisect until no longest edge of these simplices exceeds this; without point and segment, until none does.
    #[arg(long, value_name = "H", value_parser = length, allow_hyphen_values = true, conflicts_with = "uniform")]
    #[arg(required_unless_present = "uniform")]
    pub size: Option<f64>,
    /// N rounds, in each of which every simplex is bisected.
    #[arg(long, value_name = "N", value_parser = rounds, allow_hyphen_values = true)]
    pub uniform: Option<u32>,
    /// Which edge of a start simplex is bisected first.
    #[arg(long, value_enum, default_value_t = RuleArg::LongestEdge)]
    pub rule: RuleArg,
}

/// Which edge comes first.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub enum RuleArg {
    /// The longest, as in most meshers.
    LongestEdge,
    /// By the colouring of Diening, Gehring and Storn (2025), which has a proved bound of the closure.
    Colouring,
}

impl RuleArg {
    /// The rule.
    pub fn rule(self) -> Rule {
        match self {
            Self::LongestEdge => Rule::LongestEdge,
            Self::Colouring => Rule::Colouring,
        }
    }

    /// As it is written on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::LongestEdge => "longest-edge",
            Self::Colouring => "colouring",
        }
    }
}

const REFINE_EXAMPLES: &str = "\
Examples:
  stylet mesh refine --start kuhn2 --point 0.3141,0.2718 --size 1e-6
  stylet mesh refine --start kuhn3 --segment=-0.01,0.431,0.527,0.713,0.489,0.561 --size 0.0078125 --plot needle.svg
  stylet mesh refine --start kuhn4 --uniform 12 --json
  stylet mesh refine --start kuhn3:4x4x4 --size 0.1 --out fine.vtu
  stylet mesh refine --start tissue.msh --point 0.03,0.02,0.05 --size 1e-3 --rule colouring --out fine.msh

Marked are the simplices that touch the feature (its boundary counts) and whose longest edge exceeds the size,
until there are none. Lengths are in the units of the mesh. JSON: leaves, vertices, bisections (of cells), marks
(bisections that were asked for; the others keep the mesh conforming), shapes (similarity classes), min_angle_deg,
max_angle_deg, seconds (of refinement alone), bytes (of the arrays of the mesh).
Of a file, regions, boundary tags (the regions of facets on the boundary) and their names go on to --out.";

/// `stylet mesh refine`
#[derive(Args, Debug)]
#[command(after_help = REFINE_EXAMPLES)]
pub struct RefineArgs {
    /// Where.
    #[command(flatten)]
    pub feature: FeatureArgs,
    /// Write the mesh to this file, in the format of its extension.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Draw the mesh; in 3D cut open at the feature.
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,
    /// JSON, progress.
    #[command(flatten)]
    pub output: OutputArgs,
}

const COARSEN_EXAMPLES: &str = "\
Examples:
  stylet mesh coarsen --start kuhn3 --segment=-0.01,0.431,0.527,0.713,0.489,0.561 --size 0.0078125
  stylet mesh coarsen --start kuhn2 --size 0.01 --keep-point 0.5,0.5
  stylet mesh coarsen --start kuhn3 --uniform 12 --keep-segment=0,0,0,1,1,1 --keep-size 0.2 --plot kept.svg --json

What is kept is the smallest refinement of the start mesh in which the simplices that touch the kept feature and whose
longest edge exceeds --keep-size are bisected as far as they were. JSON: leaves_refined, leaves, vertices_removed,
seconds_refine, seconds_coarsen, and restored: whether ids, vertex sets and positions are those of the start mesh.";

/// `stylet mesh coarsen`
#[derive(Args, Debug)]
#[command(after_help = COARSEN_EXAMPLES)]
pub struct CoarsenArgs {
    /// Where to refine at first.
    #[command(flatten)]
    pub feature: FeatureArgs,
    /// Keep the refinement of the simplices that touch this point.
    #[arg(long, value_name = "X,Y,…", allow_hyphen_values = true, conflicts_with = "keep_segment")]
    pub keep_point: Option<String>,
    /// Keep the refinement of the simplices that touch this segment.
    #[arg(long, value_name = "X,Y,…,X,Y,…", allow_hyphen_values = true)]
    pub keep_segment: Option<String>,
    /// Keep bisections of simplices with a longest edge above this, at the kept point or segment, or, without one,
    /// everywhere [default: that of --size].
    #[arg(long, value_name = "H", value_parser = length, allow_hyphen_values = true)]
    pub keep_size: Option<f64>,
    /// Write the coarsened mesh to this file, in the format of its extension.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Draw the coarsened mesh.
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,
    /// JSON, progress.
    #[command(flatten)]
    pub output: OutputArgs,
}

const QUALITY_EXAMPLES: &str = "\
Examples:
  stylet mesh quality tissue.msh                       table, histogram of angles, faults by their ids
  stylet mesh quality tissue.msh --plot tissue.svg     histograms beside the mesh, cut open
  stylet mesh quality tissue.msh --repair sound.vtu    without what cannot be a cell, wound alike
  stylet mesh quality kuhn3:4x4x4 --json

Angles are dihedral in 3D, at the vertices in 2D. Quality q is volume over rms edge^D, 1 for regular simplices.
Aspect ratio: longest edge over diameter of the inscribed sphere. Radius-edge: circumradius over shortest edge.
Exit code 0 whatever is found: faults are what was asked for.";

/// `stylet mesh quality`
#[derive(Args, Debug)]
#[command(after_help = QUALITY_EXAMPLES)]
pub struct QualityArgs {
    /// A mesh file, or kuhn2, kuhn3, kuhn4 (several parts a side as in kuhn3:7x7x7).
    #[arg(value_name = "MESH")]
    pub mesh: String,
    /// Draw histograms and, beside them, the mesh, in 3D cut open.
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,
    /// What the colours of the picture mean.
    #[arg(long, value_enum, default_value_t = ColourArg::Quality)]
    pub colour: ColourArg,
    /// Write the mesh, repaired, to this file, and say what was repaired.
    #[arg(long, value_name = "FILE")]
    pub repair: Option<PathBuf>,
    /// Merge vertices closer to each other than this when repairing; 0 merges those in one place.
    #[arg(long, value_name = "DISTANCE", value_parser = distance, allow_hyphen_values = true, requires = "repair")]
    pub merge: Option<f64>,
    /// JSON, progress.
    #[command(flatten)]
    pub output: OutputArgs,
}

/// Across which axis a picture is cut.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub enum CutArg {
    /// The first axis.
    X,
    /// The second axis.
    Y,
    /// The third axis.
    Z,
}

impl CutArg {
    /// Towards the half that is taken away, which is the viewer's.
    pub fn normal(self) -> [f64; 3] {
        match self {
            Self::X => [1.0, 0.0, 0.0],
            Self::Y => [0.0, -1.0, 0.0],
            Self::Z => [0.0, 0.0, 1.0],
        }
    }
}

/// What colours mean.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub enum ColourArg {
    /// Quality q of each cell.
    Quality,
    /// Its region.
    Region,
}

const CONVERT_EXAMPLES: &str = "\
Examples:
  stylet mesh convert tissue.msh tissue.vtu
  stylet mesh convert scan.stl scan.msh --format msh22
  stylet mesh convert tissue.node tissue.msh --json

Regions, their names, and fields are kept where the format holds them; what is left out is told.
Formats: msh22, msh22-binary, msh41, msh41-binary (.msh), vtu (.vtu), vtk, vtk-binary (.vtk), tetgen (.node with .ele,
.face, .edge beside it), stl, stl-binary (.stl).";

/// `stylet mesh convert`
#[derive(Args, Debug)]
#[command(after_help = CONVERT_EXAMPLES)]
pub struct ConvertArgs {
    /// The file to read; its content tells the format.
    #[arg(value_name = "IN")]
    pub from: PathBuf,
    /// The file to write, in the format of its extension unless --format says another.
    #[arg(value_name = "OUT")]
    pub to: PathBuf,
    /// The format to write.
    #[arg(long, value_name = "NAME")]
    pub format: Option<String>,
    /// JSON, progress.
    #[command(flatten)]
    pub output: OutputArgs,
}

const REMESH_EXAMPLES: &str = "\
Examples:
  stylet mesh remesh --mesh kuhn3:7x7x7 --path curved --seed 3 --cycles 10
  stylet mesh remesh --mesh kuhn2:16x16 --path path.txt --plot deepest.svg
  stylet mesh remesh --mesh tissue.msh --path path.txt --step 0.5e-3 --out angles.csv

A path is a text file with the positions of the tip, one a line, as numbers with commas or blanks between them; what
follows a # is a comment. It begins outside the mesh. The paths straight, curved and random enter the box around the
mesh through its upper side (greatest y in 2D, z in 3D), cycle after cycle with another seed.
Columns of the CSV: cycle, step, motion (in or out), depth (steps from the first position), min_angle_deg and
max_angle_deg of the whole mesh, operations (snaps, splits, splits undone), microseconds.
Extreme angles of the report are those beyond depth 20. Ctrl-C ends after the cycle at hand, a second one at once.";

/// `stylet mesh remesh`
#[derive(Args, Debug)]
#[command(after_help = REMESH_EXAMPLES)]
pub struct RemeshArgs {
    /// A mesh file, or kuhn2 or kuhn3 (several parts a side as in kuhn3:7x7x7).
    #[arg(long, value_name = "MESH")]
    pub mesh: String,
    /// straight, curved or random, or a file with the positions of the tip, from outside the mesh inwards; a file named
    /// straight is reached as ./straight.
    #[arg(long, value_name = "PATH", default_value = "straight")]
    pub path: String,
    /// Which of the straight, curved or random paths comes first.
    #[arg(long, value_name = "N", value_parser = seed, allow_hyphen_values = true, default_value = "0")]
    pub seed: u64,
    /// Length of a step along the path [default: 0.2 mean edges].
    #[arg(long, value_name = "H", value_parser = length, allow_hyphen_values = true)]
    pub step: Option<f64>,
    /// How many times to go in and out.
    #[arg(long, value_name = "N", value_parser = rounds, allow_hyphen_values = true, default_value = "1")]
    pub cycles: u32,
    /// Write a row for each step to this file, or to steps.csv in this folder.
    #[arg(long, value_name = "FILE.csv|DIR")]
    pub out: Option<PathBuf>,
    /// Draw the mesh with the needle at its deepest in the first cycle; in 3D cut open.
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,
    /// JSON, progress.
    #[command(flatten)]
    pub output: OutputArgs,
}

fn length(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|x| *x > 0.0 && x.is_finite());
    number.ok_or_else(|| "a length greater than 0".to_owned())
}

fn distance(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|x| *x >= 0.0 && x.is_finite());
    number.ok_or_else(|| "a length, at least 0".to_owned())
}

fn rounds(text: &str) -> Result<u32, String> {
    const MOST: u32 = 1_000_000;
    let number = text.parse().ok().filter(|n| (1..=MOST).contains(n));
    number.ok_or_else(|| format!("a whole number from 1 to {MOST}"))
}

fn seed(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| format!("a whole number from 0 to {}", u64::MAX))
}

const GENERATE_EXAMPLES: &str = "\
Examples:
  stylet mesh generate --shape ellipsoid --plot ellipsoid.svg
  stylet mesh generate --shape prostate --out prostate.msh --scene prostate.toml
  stylet run prostate.toml
  stylet mesh generate --contours study.dcm --organs urethra,prostate,rectum --size 0.004 --out study.msh

Scenes of shapes that come with the program: prostate, two-cylinders, gel-block, ellipsoid. --show NAME prints one as a start
of your own; --schema explains every key.";

/// `stylet mesh generate`
#[derive(Args, Debug)]
#[command(after_help = GENERATE_EXAMPLES)]
pub struct GenerateArgs {
    /// A scene of shapes: a file, or the name of one that comes with the program.
    #[arg(long, value_name = "FILE|NAME", required_unless_present_any = ["contours", "show", "schema"])]
    #[arg(conflicts_with = "contours")]
    pub shape: Option<String>,
    /// Contours of organs on parallel slices: a DICOM RT structure set, or JSON.
    #[arg(long, value_name = "FILE")]
    pub contours: Option<PathBuf>,
    /// Organs of the contours that are meshed, those that take precedence first; all of them if left out.
    #[arg(long, value_name = "NAME,NAME,…", requires = "contours")]
    pub organs: Option<String>,
    /// Edge of the lattice's cubes at borders, m; that of the scene, or 1/16 of the organs' extent, if left out. Other
    /// sizes of a scene grow with it.
    #[arg(long, value_name = "H", value_parser = length, allow_hyphen_values = true)]
    pub size: Option<f64>,
    /// Edge of the largest cubes, m.
    #[arg(long, value_name = "H", value_parser = length, allow_hyphen_values = true)]
    pub coarsest: Option<f64>,
    /// Distance of the box from the organs, m; twice the size if left out.
    #[arg(long, value_name = "D", value_parser = length, allow_hyphen_values = true, requires = "contours")]
    pub margin: Option<f64>,
    /// Mesh the organs alone, not what is around them.
    #[arg(long, requires = "contours")]
    pub bare: bool,
    /// Leave out points of contours that are closer than this to their neighbours, m.
    #[arg(long, value_name = "D", value_parser = length, allow_hyphen_values = true, requires = "contours")]
    pub cull: Option<f64>,
    /// Organs whose nodes the scene holds, besides those that the shapes say.
    #[arg(long, value_name = "NAME,NAME,…", requires = "scene")]
    pub fixed: Option<String>,
    /// Leave the mesh as it was stuffed.
    #[arg(long)]
    pub straight: bool,
    /// Sweeps of smoothing and edge removal at most.
    #[arg(long, value_name = "N", conflicts_with = "straight")]
    pub sweeps: Option<usize>,
    /// Print the text of a scene that comes with the program, and do nothing else.
    #[arg(long, value_name = "NAME", conflicts_with_all = ["shape", "contours"])]
    pub show: Option<String>,
    /// Print every key of a scene of shapes, and do nothing else.
    #[arg(long, conflicts_with_all = ["shape", "contours", "show"])]
    pub schema: bool,
    /// Write the mesh to this file, in the format of its extension; regions by name where the format has names.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Write a scene for `stylet run`: the mesh under its weight, with the materials of the shapes.
    #[arg(long, value_name = "FILE.toml", requires = "out")]
    pub scene: Option<PathBuf>,
    /// Draw the mesh cut open, with histograms.
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,
    /// Across which axis the picture is cut, in the middle.
    #[arg(long, value_enum, default_value_t = CutArg::Y)]
    pub cut: CutArg,
    /// What the colours of the picture mean.
    #[arg(long, value_enum, default_value_t = ColourArg::Region)]
    pub colour: ColourArg,
    /// JSON, progress.
    #[command(flatten)]
    pub output: OutputArgs,
}
