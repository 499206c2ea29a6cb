//! The command line.

use std::path::PathBuf;
use std::str::FromStr;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Parser, Subcommand, ValueEnum};

use nemoral_convert::{ClassMapping, FormatName};
use nemoral_dataset::Crop;
use nemoral_pipeline::BackendChoice;

use crate::frames::{Frames, Shard};

/// The meaning of the program's exit codes.
const EXIT_CODES: &str = "\
Exit codes:
  0  done
  1  failed while running, was interrupted (SIGINT, SIGTERM), or `check` found something wrong
  2  the request was wrong: nothing was done, or a finished data set cannot have a further format";

/// Grows virtual forests and records them with virtual cameras and LiDAR, perfectly labelled.
#[derive(Debug, Parser)]
#[command(name = "nemoral", version, max_term_width = 100, after_help = EXIT_CODES)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Records a data set.
    Generate(Generate),
    /// Records a data set of your own plot, from its stem map.
    ///
    /// The trees of the stem map stand where they do, in a forest like them.
    ///
    /// All other options are those of `generate`, and change what the files suggest.
    Plot(Plot),
    /// Makes a contact sheet of one frame: colour, classes, instances, depth, scan.
    Preview(Preview),
    /// Opens a forest in your browser, to walk through it and to change it.
    View(View),
    /// Shows, starts, checks and explains configs.
    #[command(subcommand)]
    Config(ConfigCommand),
    /// Prints the plan as a graph, and what a run will need.
    Plan(Plan),
    /// Checks a data set: structure, sizes, checksums, ids, and the agreement of its sensors.
    Check(Folder),
    /// Counts what a data set holds.
    Stats(Folder),
    /// Makes one HTML page that shows a data set: frames, scans, inventory, map, warnings.
    Report(Report),
    /// Joins shards into one data set.
    Merge(Merge),
    /// Joins all scans of a sequence into one registered, labelled cloud.
    Cloud(Cloud),
    /// Writes a data set in another format, for readers that do not know ours.
    #[command(after_help = list_of_formats())]
    Convert(Convert),
    /// Grows one tree and writes it as glTF.
    Tree(Tree),
    /// Writes a part of a forest for other programs.
    Export(Export),
    /// Writes what a forest inventory should find: trees, measures per hectare, maps.
    ///
    /// These are tables, GeoTIFFs of ground and canopy, crowns and stems as GeoJSON.
    Inventory(Inventory),
    /// Writes what an inertial measurement unit on the robot measures along its drive.
    ///
    /// The layout is that of the EuRoC MAV data set: samples, the unit's errors, true states.
    Imu(Imu),
    /// Prints a script by which a shell completes commands and options.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
    /// Prints the manual page of the program, or of one of its commands.
    Man {
        /// The command.
        command: Option<String>,
    },
}

/// The world, and how it differs from the preset.
#[derive(Args, Clone, Debug)]
pub(crate) struct World {
    /// A TOML file over the preset.
    pub(crate) config: Option<PathBuf>,
    /// What to start from: see `nemoral config presets`.
    #[arg(long, short, value_name = "NAME")]
    pub(crate) preset: Option<String>,
    /// Sets one key, such as `terrain.octaves=4`; may be given often.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) settings: Vec<String>,
    /// The world's seed, from which those of further sequences are drawn.
    #[arg(
        long,
        value_name = "N",
        allow_negative_numbers = true,
        value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64)
    )]
    pub(crate) seed: Option<u64>,
    /// Number of sequences, each a drive through a world of its own.
    #[arg(long, value_name = "N")]
    pub(crate) sequences: Option<u32>,
    /// Threads to use; all cores if not given.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(crate) threads: Option<u32>,
}

/// Where grown plants are stored, so that the next run need not grow them again.
#[derive(Args, Clone, Debug)]
pub(crate) struct CacheArgs {
    /// The folder that stores grown trees between runs; the user's cache folder if not given.
    #[arg(long, value_name = "DIR", env = "NEMORAL_CACHE")]
    pub(crate) cache: Option<PathBuf>,
    /// Neither reads nor writes the cache.
    #[arg(long)]
    pub(crate) no_cache: bool,
}

/// A forest of which one sequence is asked for.
#[derive(Args, Clone, Debug)]
pub(crate) struct SequenceArgs {
    #[command(flatten)]
    pub(crate) world: World,
    #[command(flatten)]
    pub(crate) cache_args: CacheArgs,
    /// Which sequence.
    #[arg(long, value_name = "K", default_value_t = 0)]
    pub(crate) sequence: u32,
}

/// How a long command tells how far it is.
#[derive(Args, Clone, Copy, Debug)]
pub(crate) struct ProgressArgs {
    /// How progress is reported.
    #[arg(long, value_enum, default_value_t = Progress::Auto)]
    pub(crate) progress: Progress,
    /// Prints nothing but errors.
    #[arg(long, short, conflicts_with = "progress")]
    pub(crate) quiet: bool,
}

#[derive(Args, Debug)]
pub(crate) struct Cloud {
    /// The data set.
    pub(crate) dir: PathBuf,
    /// The cloud: PLY, or LAZ if its name ends in .laz.
    #[arg(long, short, value_name = "FILE", default_value = "cloud.ply")]
    pub(crate) out: PathBuf,
    /// Keeps a plot, E,N,RADIUS, or a rectangle, W,S,E,N, metres.
    #[arg(long, value_name = "NUMBERS", allow_hyphen_values = true)]
    pub(crate) crop: Option<Crop>,
    /// Keeps these classes or fine semantics: Trunks,leaf.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub(crate) only_class: Vec<String>,
    /// Writes the plot's trees, and what the cloud shows of each, as CSV.
    #[arg(long, value_name = "FILE")]
    pub(crate) trees: Option<PathBuf>,
    /// Writes where the scanners were at each frame, as CSV.
    #[arg(long, value_name = "FILE")]
    pub(crate) trajectory: Option<PathBuf>,
    /// Writes LAZ in square tiles of this side, metres.
    #[arg(long, value_name = "M")]
    pub(crate) tile: Option<f64>,
    /// Replaces the tiles of an earlier cloud of this name.
    #[arg(long, requires = "tile")]
    pub(crate) overwrite: bool,
    /// The classes of LAZ, a built-in table or a file.
    #[arg(long, value_name = "NAME|FILE")]
    pub(crate) ontology: Option<String>,
    /// Keeps one point in each cube of this side, metres.
    #[arg(long, value_name = "M")]
    pub(crate) voxel: Option<f64>,
    /// Leaves out mixed and mirrored returns and false alarms.
    #[arg(long)]
    pub(crate) pure: bool,
    /// Registers scans by poses_estimated.txt instead of the true poses.
    #[arg(long)]
    pub(crate) estimated_poses: bool,
    /// Registers scans by your own poses, in the form of poses.txt.
    #[arg(long, value_name = "FILE", conflicts_with = "estimated_poses")]
    pub(crate) poses: Option<PathBuf>,
    /// Which sequence, if there are several.
    #[arg(long, value_name = "K")]
    pub(crate) sequence: Option<u32>,
}

#[derive(Args, Debug)]
pub(crate) struct Convert {
    /// The data set.
    pub(crate) dir: PathBuf,
    /// The format, one of those below.
    #[arg(long, value_name = "FORMAT", value_parser = formats(), hide_possible_values = true)]
    pub(crate) to: FormatName,
    /// The output folder.
    #[arg(long, short, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// The classes to write, a built-in table or a TOML file.
    #[arg(long, value_name = "NAME|FILE")]
    pub(crate) ontology: Option<String>,
    /// Leaves out objects with fewer visible pixels in a picture; of coco and yolo alone.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) min_px: u32,
    /// Continues a conversion that was interrupted.
    #[arg(long, conflicts_with = "overwrite")]
    pub(crate) resume: bool,
    /// Replaces the conversion in the output folder, and no files of others.
    #[arg(long)]
    pub(crate) overwrite: bool,
    #[command(flatten)]
    pub(crate) progress_args: ProgressArgs,
}

#[derive(Args, Debug)]
pub(crate) struct Tree {
    /// A built-in species, or a species' TOML file.
    pub(crate) species: String,
    /// Diameter at breast height, metres; that of a mature tree if not given.
    #[arg(long, value_name = "M")]
    pub(crate) dbh: Option<f64>,
    /// Which tree of that diameter.
    #[arg(
        long,
        value_name = "N",
        default_value_t = 0,
        value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64)
    )]
    pub(crate) seed: u64,
    /// A standing dead tree.
    #[arg(long)]
    pub(crate) dead: bool,
    /// The file, whose name ends in .glb.
    #[arg(long, short, value_name = "FILE", default_value = "tree.glb")]
    pub(crate) out: PathBuf,
}

#[derive(Args, Debug)]
pub(crate) struct Export {
    #[command(flatten)]
    pub(crate) of: SequenceArgs,
    /// What is visible at this frame, with its cameras.
    #[arg(long, value_name = "K", default_value_t = 0, conflicts_with = "region")]
    pub(crate) frame: u64,
    /// A rectangle of the world, west, south, east, north, metres.
    #[arg(long, value_name = "X0,Y0,X1,Y1", allow_hyphen_values = true)]
    pub(crate) region: Option<Region>,
    /// The format.
    #[arg(long, value_enum, value_name = "FORMAT")]
    pub(crate) to: ExportFormat,
    /// Writes each instance by itself, not by `EXT_mesh_gpu_instancing` or a `PointInstancer`.
    #[arg(long)]
    pub(crate) plain_nodes: bool,
    /// Distance between the posts of a height map, metres; 0.5 if not given.
    #[arg(long, value_name = "M")]
    pub(crate) spacing: Option<f64>,
    /// The file, or the folder, which must be empty.
    #[arg(long, short, value_name = "PATH")]
    pub(crate) out: PathBuf,
}

#[derive(Args, Debug)]
pub(crate) struct Inventory {
    #[command(flatten)]
    pub(crate) of: SequenceArgs,
    /// West, south, east, north, metres; else around all `--plot`, or a hectare at the start.
    #[arg(long, value_name = "X0,Y0,X1,Y1", allow_hyphen_values = true)]
    pub(crate) region: Option<Region>,
    /// Side of the maps' cells, metres; the region must be whole cells.
    #[arg(long, value_name = "M", default_value_t = 0.5)]
    pub(crate) cell: f64,
    /// Vertical rays a side of a cell, 1 to 32.
    #[arg(long, value_name = "N", default_value_t = 5)]
    pub(crate) rays: usize,
    /// Thickness of the profile's layers, 0.1 to 100 m.
    #[arg(long, value_name = "M", default_value_t = 1.0)]
    pub(crate) layer: f64,
    /// Thinner trees do not count per hectare, metres, 0 to 2.
    #[arg(long, value_name = "M", default_value_t = 0.07)]
    pub(crate) min_dbh: f64,
    /// Logs whose thick end is thinner do not count per hectare, metres, 0 to 2.
    #[arg(long, value_name = "M", default_value_t = 0.1)]
    pub(crate) min_deadwood_diameter: f64,
    /// Side of square plots that the region is cut into for `plots.csv`, 1 to 1000 m.
    #[arg(long, value_name = "M")]
    pub(crate) plots: Option<f64>,
    /// A plot for `plots.csv`, E,N,RADIUS, or a rectangle, W,S,E,N, metres; may be given often.
    #[arg(
        long,
        value_name = "NUMBERS",
        allow_hyphen_values = true,
        conflicts_with = "plots",
        value_parser = plot_at
    )]
    pub(crate) plot: Vec<Crop>,
    /// The folder, which must be empty.
    #[arg(long, short, value_name = "DIR")]
    pub(crate) out: PathBuf,
}

#[derive(Args, Debug)]
pub(crate) struct Imu {
    #[command(flatten)]
    pub(crate) of: SequenceArgs,
    /// The folder, which must be empty.
    #[arg(long, short, value_name = "DIR")]
    pub(crate) out: PathBuf,
}

/// A format that a part of a forest is written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ExportFormat {
    /// glTF 2.0 in one binary file.
    Glb,
    /// OpenUSD as text in a folder, with labels for Isaac Sim.
    Usd,
    /// A Gazebo world in a folder: visuals, and collisions apart.
    Sdf,
    /// The ground alone: a 16-bit PNG, and a TOML file that says what its levels are.
    Heightmap,
}

/// `--region X0,Y0,X1,Y1`, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Region(pub(crate) [f64; 4]);

impl FromStr for Region {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Result<Vec<f64>, _> = text.split(',').map(|n| n.trim().parse()).collect();
        match numbers.as_deref() {
            Ok(&[x0, y0, x1, y1]) => Ok(Self([x0, y0, x1, y1])),
            _ => Err("must be four numbers, X0,Y0,X1,Y1, in metres".to_owned()),
        }
    }
}

/// `--plot NUMBERS`, which is read as `cloud --crop` is.
fn plot_at(text: &str) -> Result<Crop, String> {
    text.parse::<Crop>().map_err(|error| match error {
        nemoral_dataset::Error::Invalid { value, allowed, .. } => {
            format!("plot = {value}: must be {allowed}")
        }
        other => other.to_string(),
    })
}

/// What the help says about formats.
fn list_of_formats() -> String {
    let list = |title: &str, names: &[&str], in_a_line: usize| {
        let lines: Vec<_> = names
            .chunks(in_a_line)
            .map(|some| some.join(", "))
            .collect();
        let next_line = format!(",\n{}", " ".repeat(title.len()));
        format!("{title}{}", lines.join(&next_line))
    };
    let tables: Vec<_> = ClassMapping::built_in().collect();
    let formats = list("Formats: ", &FormatName::ALL.map(FormatName::name), 10);
    format!("{formats}\n{}", list("Tables of classes: ", &tables, 5))
}

/// The formats by name.
fn formats() -> impl TypedValueParser<Value = FormatName> {
    let names = PossibleValuesParser::new(FormatName::ALL.map(FormatName::name));
    names.try_map(|name| name.parse::<FormatName>())
}

#[derive(Args, Debug)]
pub(crate) struct Generate {
    #[command(flatten)]
    pub(crate) world: World,
    /// `N` frames, or those of each sequence to make: `A..B` (without B), or a list of such.
    #[arg(long, value_name = "N|A..B|LIST")]
    pub(crate) frames: Option<Frames>,
    /// The output folder.
    #[arg(long, short, value_name = "DIR", default_value = "nemoral-out")]
    pub(crate) out: PathBuf,
    /// Other formats to write, too, each into DIR-FORMAT: see `nemoral convert --help`.
    ///
    /// Shards write none; `merge` does.
    #[arg(
        long,
        value_name = "FORMAT,..",
        value_delimiter = ',',
        value_parser = formats(),
        hide_possible_values = true
    )]
    pub(crate) formats: Vec<FormatName>,
    /// Which renderer takes the pictures.
    #[arg(long, value_enum, default_value_t = Backend::Auto)]
    pub(crate) backend: Backend,
    /// The most memory of a GPU that a renderer uses.
    ///
    /// Cameras that differ in look, samples or radiance have a renderer each.
    #[arg(
        long,
        value_name = "MIB",
        default_value_t = 4096,
        value_parser = clap::value_parser!(u32).range(128..=1_048_576)
    )]
    pub(crate) gpu_memory: u32,
    /// Makes the Ith of N equal parts of the frames, I from 0; `merge` joins them.
    #[arg(long, value_name = "I/N")]
    pub(crate) shard: Option<Shard>,
    /// Continues a data set that was interrupted.
    #[arg(long, conflicts_with = "overwrite")]
    pub(crate) resume: bool,
    /// Replaces the data set in the folder.
    #[arg(long)]
    pub(crate) overwrite: bool,
    #[command(flatten)]
    pub(crate) cache_args: CacheArgs,
    #[command(flatten)]
    pub(crate) progress_args: ProgressArgs,
}

#[derive(Args, Debug)]
pub(crate) struct Plot {
    /// The stem map: CSV with x_m, y_m and, if known, species, dbh_cm, height_m, alive.
    pub(crate) stems: PathBuf,
    /// The height map of its ground: GeoTIFF, or 16-bit PNG with its sidecar (.json, .toml).
    #[arg(long, value_name = "FILE")]
    pub(crate) terrain: Option<PathBuf>,
    /// Its trails: GeoJSON with LineStrings, or CSV with trail, x_m, y_m.
    #[arg(long, value_name = "FILE")]
    pub(crate) trails: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) generate: Generate,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Progress {
    /// A bar if standard error is a terminal, else lines.
    Auto,
    /// Lines on standard error, at most one a second.
    Lines,
    /// A JSON object a line on standard output for each note and frame, and at the end.
    Json,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Backend {
    /// A hardware GPU if a suitable one is found, else the CPU.
    Auto,
    /// Casts rays on the CPU; works everywhere.
    Cpu,
    /// Draws on a GPU, or on software that emulates one.
    Gpu,
}

impl From<Backend> for BackendChoice {
    fn from(backend: Backend) -> Self {
        match backend {
            Backend::Auto => Self::Auto,
            Backend::Cpu => Self::Cpu,
            Backend::Gpu => Self::Gpu,
        }
    }
}

#[derive(Args, Debug)]
pub(crate) struct Preview {
    #[command(flatten)]
    pub(crate) world: World,
    #[command(flatten)]
    pub(crate) cache_args: CacheArgs,
    /// Which frame.
    #[arg(long, value_name = "K", default_value_t = 0)]
    pub(crate) frame: u64,
    /// Which sequence.
    #[arg(long, value_name = "K", default_value_t = 0)]
    pub(crate) sequence: u32,
    /// Which renderer takes the picture.
    #[arg(long, value_enum, default_value_t = Backend::Auto)]
    pub(crate) backend: Backend,
    /// The picture, a PNG.
    #[arg(long, short, value_name = "FILE", default_value = "preview.png")]
    pub(crate) out: PathBuf,
}

#[derive(Args, Debug)]
pub(crate) struct View {
    #[command(flatten)]
    pub(crate) of: SequenceArgs,
    /// Which renderer takes the pictures.
    #[arg(long, value_enum, default_value_t = Backend::Auto)]
    pub(crate) backend: Backend,
    /// The port on this machine, which others cannot reach; 0 for any free one.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) port: u16,
    /// Opens the page in your browser.
    #[arg(long)]
    pub(crate) open: bool,
}

#[derive(Debug, Subcommand)]
pub(crate) enum ConfigCommand {
    /// Lists the presets.
    Presets,
    /// Prints a commented config to start from.
    Init(World),
    /// Prints the config that a run would use, every key.
    Show {
        #[command(flatten)]
        world: World,
        /// Which sequence.
        #[arg(long, value_name = "K", default_value_t = 0)]
        sequence: u32,
    },
    /// Checks a config for everything that `generate` would refuse before its first frame.
    Check {
        #[command(flatten)]
        world: World,
        #[command(flatten)]
        cache_args: CacheArgs,
    },
    /// Prints the JSON schema, for editors that complete TOML.
    Schema,
    /// Prints the reference page, Markdown.
    Reference,
}

#[derive(Args, Debug)]
pub(crate) struct Plan {
    #[command(flatten)]
    pub(crate) world: World,
    #[command(flatten)]
    pub(crate) cache_args: CacheArgs,
    /// How the graph is written.
    #[arg(long, value_enum, default_value_t = Graph::Mermaid)]
    pub(crate) format: Graph,
    /// Lists each stage with its key instead of the graph.
    #[arg(long)]
    pub(crate) explain: bool,
    /// Lists the sequences, with what is drawn for each, instead of the graph.
    #[arg(long, conflicts_with = "explain")]
    pub(crate) list: bool,
    /// Which sequence.
    #[arg(long, value_name = "K", default_value_t = 0)]
    pub(crate) sequence: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Graph {
    /// Mermaid, which GitHub renders.
    Mermaid,
    /// Graphviz.
    Dot,
}

#[derive(Args, Debug)]
pub(crate) struct Folder {
    /// The data set.
    pub(crate) dir: PathBuf,
}

#[derive(Args, Debug)]
pub(crate) struct Report {
    /// The data set.
    pub(crate) dir: PathBuf,
    /// The page, which opens from disk in any browser.
    #[arg(long, short, value_name = "FILE", default_value = "report.html")]
    pub(crate) out: PathBuf,
}

#[derive(Args, Debug)]
pub(crate) struct Merge {
    /// The shards.
    #[arg(required = true)]
    pub(crate) shards: Vec<PathBuf>,
    /// The output folder.
    #[arg(long, short, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Merges what there is, though the shards lack frames of a sequence.
    #[arg(long)]
    pub(crate) partial: bool,
    /// Continues a merge that was interrupted.
    #[arg(long, conflicts_with = "overwrite")]
    pub(crate) resume: bool,
    /// Replaces the data set in the output folder, and no files of others.
    #[arg(long)]
    pub(crate) overwrite: bool,
    #[command(flatten)]
    pub(crate) progress_args: ProgressArgs,
}
