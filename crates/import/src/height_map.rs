//! Height maps: a grid of posts with heights.

use crate::stem_map::REACH_M;
use crate::{HeightPngSidecar, ImportError};

/// The most posts of a height map, 4096 × 4096.
pub const MAX_POSTS: usize = 1 << 24;
/// The least and the greatest height, metres: from below all land (-430 m) and well above -9999,
/// which most programs write where there is no data, to above all of it.
const HEIGHTS_M: [f64; 2] = [-1_000.0, 10_000.0];
/// The least and the largest distance between posts, metres.
const SPACINGS_M: [f64; 2] = [0.02, 1000.0];

/// A grid of heights, row by row from the north, each row from the west.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightMap {
    /// Posts in a row, at least 2.
    pub columns: usize,
    /// Rows, at least 2.
    pub rows: usize,
    /// Easting of the first column, metres.
    pub west_m: f64,
    /// Northing of the first row, metres.
    pub north_m: f64,
    /// Distance between posts, metres, along both axes.
    pub spacing_m: f64,
    /// Heights, metres; NaN where there is no data.
    pub heights_m: Vec<f32>,
    /// The EPSG code of its projected coordinates, if the file has one: a PNG has none.
    pub epsg: Option<u16>,
}

impl HeightMap {
    /// Reads a height map: a [PNG](Self::from_png) with its sidecar, or a
    /// [GeoTIFF](Self::from_tiff), which needs none.
    ///
    /// # Errors
    /// As those two, and if a PNG has no sidecar.
    pub fn read(bytes: &[u8], sidecar: Option<&HeightPngSidecar>) -> Result<Self, ImportError> {
        if !Self::needs_sidecar(bytes) {
            return Self::from_tiff(bytes);
        }
        let sidecar = sidecar.ok_or_else(|| {
            let message = "needs a sidecar, a file that says where it lies and how high";
            ImportError::file(message)
        })?;
        Self::from_png(bytes, sidecar)
    }

    /// Whether the bytes are those of a PNG, which does not say itself where it lies.
    #[must_use]
    pub fn needs_sidecar(bytes: &[u8]) -> bool {
        bytes.starts_with(b"\x89PNG")
    }

    /// Checks the size of a grid before memory is asked for it.
    pub(crate) fn check_size(columns: u64, rows: u64) -> Result<[usize; 2], ImportError> {
        let most = MAX_POSTS as u64;
        if columns >= 2 && rows >= 2 && columns.checked_mul(rows).is_some_and(|n| n <= most) {
            return Ok([columns as usize, rows as usize]);
        }
        Err(ImportError::file(format!(
            "has {columns} × {rows} posts: must be at least 2 × 2 and {most} together"
        )))
    }

    pub(crate) fn check_spacing(spacing_m: f64) -> Result<(), ImportError> {
        let [least, most] = SPACINGS_M;
        if (least..=most).contains(&spacing_m) {
            return Ok(());
        }
        Err(ImportError::file(format!(
            "has posts {spacing_m:?} apart: must be {least} to {most} metres; degrees are not \
             allowed"
        )))
    }

    /// Checks place and heights of a finished map.
    pub(crate) fn checked(self) -> Result<Self, ImportError> {
        Self::check_spacing(self.spacing_m)?;
        for (name, m) in [("west", self.west_m), ("north", self.north_m)] {
            if !(-REACH_M..=REACH_M).contains(&m) {
                let message = format!("has its {name} edge at {m}: must be within {REACH_M} m");
                return Err(ImportError::file(message));
            }
        }
        let [low, high] = HEIGHTS_M;
        let is_wrong = |h: &&f32| !h.is_nan() && !(low..=high).contains(&f64::from(**h));
        if let Some(h) = self.heights_m.iter().find(is_wrong) {
            return Err(ImportError::file(format!(
                "has a height of {h}: must be {low} to {high} m, or the value for no data, which \
                 a GeoTIFF says as GDAL_NODATA and a sidecar as no_data"
            )));
        }
        if self.heights_m.iter().all(|h| h.is_nan()) {
            return Err(ImportError::file("has no data at any post"));
        }
        Ok(self)
    }

    /// Easting and northing of a post.
    #[must_use]
    pub fn post_m(&self, column: usize, row: usize) -> [f64; 2] {
        [
            self.west_m + column as f64 * self.spacing_m,
            self.north_m - row as f64 * self.spacing_m,
        ]
    }

    /// The height of a post; `None` where there is no data.
    #[must_use]
    pub fn height_m(&self, column: usize, row: usize) -> Option<f32> {
        let height = self.heights_m[row * self.columns + column];
        (!height.is_nan()).then_some(height)
    }
}
