//! A sequence's scans as one LAZ file, or as tiles.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use nemoral_dataset::{Cloud, CloudPoint, SiteSpec};
use nemoral_files::{EntryKind, Folder, InnerPath, PendingFile};
use nemoral_scene::ObjectId;
use nemoral_scene::glam::DVec3;

use crate::formats::laz::{
    Laz, LazPoint, LazWriter, START_BYTES, STEP_M, TreeNumbers, crs_note, is_own, place_m,
};
use crate::labels::Labels;
use crate::{ClassMapping, Error};

/// The most tiles of a cloud, as each is an open file.
const TILES_MAX: usize = 500;
/// Allowed sides of tiles, metres.
const TILE_M: std::ops::RangeInclusive<f64> = 1.0..=1e5;

/// How a cloud is written as LAZ.
#[derive(Clone, Debug, Default)]
pub struct LazCloudParams {
    /// Side of a tile, metres, 1 to 100,000: tiles are `OUT_X_Y.laz`, with the tile's south-western
    /// corner in whole tiles from the origin of the file's coordinates. `None` for one file.
    pub tile_m: Option<f64>,
    /// Whether the tiles of an earlier cloud of this name are replaced, all of them, as those of
    /// another crop would stay among the new ones. If not, they are refused.
    pub overwrite: bool,
    /// The classes of `classification`; ASPRS's if there is none.
    pub ontology: Option<ClassMapping>,
}

/// A file that was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LazTile {
    /// Its name.
    pub path: PathBuf,
    /// Its points.
    pub points: u64,
}

/// Writes a cloud as LAS 1.4, compressed, with the dimensions that the format `laz` has; `gps_time`
/// is seconds after the start of the sequence plus [`Cloud::las_time_shift_s`], `point_source_id`
/// the number from 1 of the flight line or, without lines, of the scan (station k of one scanner is
/// k + 1). Coordinates are those of the site, or of an invented world, relative to a whole metre
/// near the first point of a file.
///
/// Trees whose foot is outside of the part of the world that is kept have the class
/// [`ClassMapping::outside`], if the table has one, and are no trees: their `treeID` is 0.
///
/// Each file appears when it is whole, after all points have been written. A file `OUT` is
/// replaced.
///
/// # Errors
/// As [`Cloud::check_name`] with `laz`, [`Cloud::all_trees`] and [`Cloud::for_each`];
/// [`Error::Unsuitable`] for a tile's side out of range or too many tiles; [`Error::TileExists`]
/// and [`Error::ForeignTile`] for tiles that are there already; [`Error::Ontology`] for a table
/// that does not fit.
pub fn laz_cloud(
    cloud: &Cloud,
    out: &Path,
    params: &LazCloudParams,
) -> Result<Vec<LazTile>, Error> {
    cloud.check_name(out, "laz")?;
    let unsuitable = |reason| Error::Unsuitable {
        format: "laz",
        reason,
    };
    if let Some(side) = params.tile_m.filter(|side| !TILE_M.contains(side)) {
        let (low, high) = (TILE_M.start(), TILE_M.end());
        let reason = format!("tile_m = {side}: must be {low} to {high} m");
        return Err(unsuitable(reason));
    }
    let earlier = match params.tile_m {
        Some(_) => earlier_tiles(out, params.overwrite)?,
        None => Vec::new(),
    };
    let laz = Laz {
        ontology: params.ontology.clone(),
    };
    let truth = Truth::new(cloud, laz.labels(cloud.ontology())?)?;
    let site = cloud.site();
    let mut tiles: BTreeMap<Option<[i64; 2]>, Tile> = BTreeMap::new();
    let failed = |e: io::Error| Error::from(nemoral_files::Error::io(out)(e));
    cloud.for_each(|point: &CloudPoint| -> Result<(), Error> {
        let number = params.tile_m.map(|side| {
            // In whole steps, as coordinates are in the file, so that none is in the next tile.
            let steps = (place_m(site, point.world_m).truncate() / STEP_M).round();
            let tile = (steps / (side / STEP_M).round()).floor();
            [tile.x as i64, tile.y as i64]
        });
        if !tiles.contains_key(&number) {
            if tiles.len() == TILES_MAX {
                let reason = format!("more than {TILES_MAX} tiles: make them larger, or crop");
                return Err(unsuitable(reason));
            }
            let scratch = nemoral_files::scratch_beside(out)?;
            let tile = Tile::new(scratch, site, point.world_m).map_err(failed)?;
            tiles.insert(number, tile);
        }
        let tile = tiles.get_mut(&number).expect("it is there");
        tile.put(point, &truth).map_err(failed)
    })?;
    if tiles.is_empty() {
        // A cloud without points is a file without points.
        let scratch = nemoral_files::scratch_beside(out)?;
        let tile = Tile::new(scratch, site, DVec3::ZERO).map_err(failed)?;
        tiles.insert(None, tile);
    }
    let mut written = Vec::new();
    let numbers: BTreeSet<[i64; 2]> = tiles.keys().copied().flatten().collect();
    for (number, tile) in tiles {
        let path = match number {
            None => out.to_owned(),
            Some(number) => out.with_file_name(tile_name(out, number)),
        };
        cloud.check_name(&path, "laz")?;
        let points = tile.points;
        tile.finish(&path)?;
        written.push(LazTile { path, points });
    }
    for (number, name) in earlier {
        if !numbers.contains(&number) {
            folder_of(out).remove_file(&name)?;
        }
    }
    Ok(written)
}

fn folder_of(out: &Path) -> Folder {
    let above = out.parent().filter(|p| !p.as_os_str().is_empty());
    Folder::new(above.unwrap_or(Path::new(".")))
}

/// The name of a tile, by its number.
fn tile_name(out: &Path, [x, y]: [i64; 2]) -> String {
    let stem = out.file_stem().unwrap_or_default().to_string_lossy();
    format!("{stem}_{x}_{y}.laz")
}

/// The number of the tile that has this name; `None` if no tile has it.
fn tile_number(out: &Path, name: &str) -> Option<[i64; 2]> {
    let stem = out.file_stem()?.to_string_lossy();
    let numbers = name.strip_prefix(&*stem)?.strip_prefix('_')?;
    let (x, y) = numbers.strip_suffix(".laz")?.split_once('_')?;
    let number = [x.parse().ok()?, y.parse().ok()?];
    // Numbers can be written in several ways, and tiles have one of these.
    (tile_name(out, number) == name).then_some(number)
}

/// The tiles of an earlier cloud of this name, if they may be replaced.
fn earlier_tiles(out: &Path, overwrite: bool) -> Result<Vec<([i64; 2], InnerPath)>, Error> {
    let folder = folder_of(out);
    let mut tiles = Vec::new();
    for entry in folder.entries()? {
        let Some(number) = tile_number(out, &entry.name) else {
            continue;
        };
        let path = out.with_file_name(&entry.name);
        if !overwrite {
            return Err(Error::TileExists { path });
        }
        let name = InnerPath::new(entry.name)?;
        if entry.kind != EntryKind::File || !is_own(&start_of(&folder, &name)?) {
            return Err(Error::ForeignTile { path });
        }
        tiles.push((number, name));
    }
    Ok(tiles)
}

/// The first bytes of a file, which say who wrote it.
fn start_of(folder: &Folder, name: &InnerPath) -> Result<Vec<u8>, Error> {
    let mut start = Vec::new();
    let mut file = folder.open(name, u64::MAX)?.take(START_BYTES as u64);
    let path = name.below(folder.root());
    let read = file.read_to_end(&mut start);
    read.map_err(nemoral_files::Error::io(&path))?;
    Ok(start)
}

/// What the user should know of a cloud as LAZ, a sentence without a full stop: that no file says
/// which coordinates it has. `None` if files say it, or the world is invented.
#[must_use]
pub fn laz_note(cloud: &Cloud) -> Option<String> {
    cloud.site().and_then(crs_note)
}

/// What the points of a cloud are.
struct Truth {
    labels: Labels,
    trees: TreeNumbers,
    /// The trees that have the class of those outside. It is only asked for single ids, so its
    /// order does not matter.
    outside: HashSet<ObjectId>,
    time_shift_s: f64,
}

impl Truth {
    fn new(cloud: &Cloud, labels: Labels) -> Result<Self, Error> {
        let trees = cloud.all_trees()?;
        let outside = trees.iter().filter(|tree| {
            let is_inside = cloud.is_within(tree.position_m);
            labels.outside.is_some() && !is_inside
        });
        Ok(Self {
            outside: outside.map(|tree| tree.object).collect(),
            trees: TreeNumbers::new(&trees),
            labels,
            time_shift_s: cloud.las_time_shift_s(),
        })
    }

    /// The class of a point and the number of its tree.
    fn class_and_tree(&self, point: &CloudPoint) -> (u8, u32) {
        let of = &point.recorded.point;
        match self.labels.outside {
            Some(class) if self.outside.contains(&of.object) => (class as u8, 0),
            _ => {
                let class = self.labels.id_of_semantic(of.semantic);
                (class as u8, self.trees.of(of.object))
            }
        }
    }
}

/// A file that is being written under no name.
struct Tile {
    writer: LazWriter<BufWriter<File>>,
    points: u64,
}

impl Tile {
    fn new(scratch: File, site: Option<&SiteSpec>, near_m: DVec3) -> io::Result<Self> {
        let writer = LazWriter::new(BufWriter::new(scratch), site, near_m)?;
        Ok(Self { writer, points: 0 })
    }

    fn put(&mut self, point: &CloudPoint, truth: &Truth) -> io::Result<()> {
        self.points += 1;
        let (class, tree) = truth.class_and_tree(point);
        self.writer.put(&LazPoint {
            recorded: &point.recorded,
            world_m: point.world_m,
            from_scanner_m: point.from_scanner_m,
            left_m: point.left_m,
            source: point.source_id(),
            time_s: point.time_s,
            time_shift_s: truth.time_shift_s,
            lidar: point.lidar,
            class,
            tree,
        })
    }

    fn finish(self, path: &Path) -> Result<(), Error> {
        let mut file = PendingFile::create(path)?;
        let copy = || -> io::Result<()> {
            let body = self.writer.finish()?;
            let mut body = body.into_inner().map_err(io::IntoInnerError::into_error)?;
            body.seek(SeekFrom::Start(0))?;
            io::copy(&mut BufReader::new(body), &mut file).map(drop)
        };
        copy().map_err(nemoral_files::Error::io(path))?;
        Ok(file.commit_synced()?)
    }
}
