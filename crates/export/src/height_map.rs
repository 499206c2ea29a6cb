//! Height maps: 16-bit PNG, with a file beside it that says what its levels are.

use std::io::Write;
use std::path::{Path, PathBuf};

use nemoral_files::{PendingFile, is_same};
use nemoral_scene::ParamError;
use nemoral_scene::glam::DVec2;

use crate::{Error, check_apart, check_name, picture};

/// Heights at the posts of a grid.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightGrid {
    /// World position of the south-west post, metres.
    pub south_west_m: DVec2,
    /// Distance between neighbouring posts, metres.
    pub spacing_m: f64,
    /// Posts from west to east.
    pub columns: usize,
    /// Posts from south to north.
    pub rows: usize,
    /// Heights above the world's zero, metres: rows from south to north, each from west to east.
    pub heights_m: Vec<f64>,
}

/// Which heights a height map's levels stand for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeightScale {
    /// The height of level 0, metres.
    pub lowest_m: f64,
    /// The height of one level, metres.
    pub metres_per_level: f64,
}

/// The least height of a level, metres; a flat ground has no range to divide.
const LEAST_LEVEL_M: f64 = 1e-6;

impl HeightGrid {
    fn check(&self) -> Result<(), ParamError> {
        let is_whole = self.columns.checked_mul(self.rows) == Some(self.heights_m.len())
            && self.heights_m.iter().all(|h| h.is_finite());
        ParamError::check_positive("spacing_m", self.spacing_m)?;
        let sides = format!("{} x {}", self.columns, self.rows);
        let most = 1..=65_535;
        let fits = most.contains(&self.columns) && most.contains(&self.rows) && is_whole;
        ParamError::check(
            fits,
            "posts",
            sides,
            "1 to 65535 by 1 to 65535, with a finite height each",
        )
    }

    /// What the levels of its height map stand for: 65,536 between the lowest and the highest post.
    #[must_use]
    pub fn height_scale(&self) -> HeightScale {
        let low = self.heights_m.iter().copied().fold(f64::INFINITY, f64::min);
        let high = (self.heights_m.iter().copied()).fold(f64::NEG_INFINITY, f64::max);
        HeightScale {
            lowest_m: low,
            metres_per_level: ((high - low) / 65_535.0).max(LEAST_LEVEL_M),
        }
    }
}

/// How the text beside a height map begins, by which it is known.
const HEAD: &str = "# The height map beside this file:";

/// More than the text beside a height map has.
const MOST_TEXT_BYTES: u64 = 1 << 16;

/// The file beside a height map that says what its levels stand for.
fn levels_path(map: &Path) -> PathBuf {
    map.with_extension("toml")
}

/// Whether a file is the text that [`write_height_map`] writes beside a map.
fn is_of_map(levels: &Path) -> bool {
    nemoral_files::read_text(levels, MOST_TEXT_BYTES).is_ok_and(|text| text.starts_with(HEAD))
}

/// Refuses a name for a height map that does not end in `.png`, that is one of `others`, which are
/// files that stay, or whose `.toml` file is one of them or is there and was not written by
/// [`write_height_map`].
///
/// # Errors
/// [`Error::Name`], [`Error::NotOfMap`], [`Error::Input`].
pub fn check_height_map(path: &Path, others: &[&Path]) -> Result<(), Error> {
    check_name(path, "png")?;
    let levels = levels_path(path);
    check_apart(path, others)?;
    let is_other = others.iter().any(|other| is_same(other, &levels));
    if is_other || (levels.exists() && !is_of_map(&levels)) {
        return Err(Error::NotOfMap { path: levels });
    }
    Ok(())
}

/// Writes a height map to `path`, whose name ends in `.png`, and what its levels stand for to a
/// file of the same name that ends in `.toml`. Both appear when they are whole, the map last. The
/// result is their size in bytes.
///
/// North is up: the first row of the picture is the northernmost. A post's height is within half a
/// level of the grid's.
///
/// # Errors
/// If the grid has no posts, too many, or other than `heights_m` has; as [`check_height_map`]; if a
/// file cannot be written.
pub fn write_height_map(grid: &HeightGrid, path: &Path) -> Result<u64, Error> {
    check_height_map(path, &[])?;
    grid.check()?;
    let scale = grid.height_scale();
    let mut samples = Vec::with_capacity(grid.heights_m.len() * 2);
    for row in grid.heights_m.chunks(grid.columns).rev() {
        for height in row {
            let level = (height - scale.lowest_m) / scale.metres_per_level;
            samples.extend((level.round() as u16).to_be_bytes());
        }
    }
    let size = (grid.columns, grid.rows);
    let file = picture::encode(
        size,
        png::ColorType::Grayscale,
        png::BitDepth::Sixteen,
        &samples,
    );
    let text = sidecar(grid, scale);
    // The map is on the disk, though not under its name, before the other file appears.
    let mut map = PendingFile::create(path)?;
    map.write_all(&file)
        .map_err(nemoral_files::Error::io(path))?;
    nemoral_files::write(&levels_path(path), text.as_bytes())?;
    map.commit()?;
    Ok((text.len() + file.len()) as u64)
}

fn sidecar(grid: &HeightGrid, scale: HeightScale) -> String {
    let HeightGrid {
        south_west_m,
        spacing_m,
        columns,
        rows,
        ..
    } = grid;
    let north_m = south_west_m.y + (*rows - 1) as f64 * spacing_m;
    format!(
        "{HEAD} 16-bit levels at the posts of a grid, the first row\n\
         # in the north. Height of a post = lowest_m + metres_per_level * level.\n\
         columns = {columns}\n\
         rows = {rows}\n\
         # Distance between neighbouring posts, metres.\n\
         spacing_m = {spacing_m:?}\n\
         # World position of the first post, that of the first row and column: x east, y north,\n\
         # metres.\n\
         west_m = {:?}\n\
         north_m = {north_m:?}\n\
         # Height of level 0 above the world's zero, metres.\n\
         lowest_m = {:?}\n\
         metres_per_level = {:?}\n",
        south_west_m.x, scale.lowest_m, scale.metres_per_level
    )
}
