//! The ground's heights on a grid.

use std::collections::BTreeMap;
use std::sync::Arc;

use nemoral_export::HeightGrid;
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, Surface};
use rayon::prelude::*;

use super::ExportArea;
use super::area::Rectangle;
use crate::plan::Runner;
use crate::pool::in_pool;
use crate::world::chunk_ground::ChunkGround;
use crate::{Error, Recorder};

/// The most posts of a height map.
const MOST_POSTS: f64 = 1e8;

/// The ground of a rectangle.
#[derive(Debug)]
pub(crate) struct RegionGround {
    rectangle: Rectangle,
    size_m: f64,
    chunks: BTreeMap<ChunkCoord, Arc<ChunkGround>>,
}

impl RegionGround {
    /// The ground at a place in the rectangle, or at the nearest one, as grids may end beyond the
    /// border by a millionth of a cell.
    pub(crate) fn height_m(&self, place_m: DVec2) -> f64 {
        let place_m = place_m.clamp(self.rectangle.low_m, self.rectangle.high_m);
        self.chunks[&ChunkCoord::containing(place_m, self.size_m)].height_m(place_m)
    }
}

impl Recorder {
    /// The ground of the chunks that a rectangle touches.
    pub(crate) fn ground_of(
        &self,
        runner: &Runner<'_>,
        rectangle: Rectangle,
    ) -> Result<RegionGround, Error> {
        let size_m = self.sequence().config.chunks.size_m;
        let mut chunks = BTreeMap::new();
        for chunk in rectangle.chunks(size_m)? {
            chunks.insert(chunk, runner.get(self.forest().ground, chunk)?);
        }
        Ok(RegionGround {
            rectangle,
            size_m,
            chunks,
        })
    }

    /// The ground at the posts of a grid: of a region, from its south-west corner on; of a frame,
    /// in the square around the robot that what is visible fills. No plants are grown for it,
    /// unless trees that were thrown have left pits.
    ///
    /// # Errors
    /// If the frame is beyond the sequence, the region has no area or too many chunks, the spacing
    /// is not from 0.01 to 100 m or leaves too many posts, or the ground cannot be made.
    pub fn export_heights(&self, area: ExportArea, spacing_m: f64) -> Result<HeightGrid, Error> {
        if !(0.01..=100.0).contains(&spacing_m) {
            return Err(Error::request(format!(
                "spacing = {spacing_m}: must be 0.01..=100 m"
            )));
        }
        let chunks = &self.sequence().config.chunks;
        let rectangle = match area {
            ExportArea::Region { low_m, high_m } => self.rectangle(low_m, high_m)?,
            ExportArea::Frame(frame) => {
                let middle_m = self.pose(frame)?.world_from_body().translation_m.truncate();
                let radius_m = DVec2::splat(chunks.visible_radius_m);
                Rectangle::new(middle_m - radius_m, middle_m + radius_m)?
            }
        };
        // A span of 0.3 m has four posts at 0.1 m, though it is not quite three spacings.
        let spans = ((rectangle.high_m - rectangle.low_m) / spacing_m + 1e-6).floor();
        let posts = (spans.x + 1.0) * (spans.y + 1.0);
        if posts > MOST_POSTS || spans.max_element() >= 65_535.0 {
            return Err(Error::request(format!(
                "spacing = {spacing_m}: leads to {} x {} posts; must be at most 65535 a side and \
                 1e8 in all",
                spans.x + 1.0,
                spans.y + 1.0
            )));
        }
        let (columns, rows) = (spans.x as usize + 1, spans.y as usize + 1);
        let ground = self.ground_of(&self.runner(), rectangle)?;
        let south_west_m = rectangle.low_m;
        let row = |row: usize| -> Vec<f64> {
            let height = |column: usize| {
                let place_m = south_west_m + DVec2::new(column as f64, row as f64) * spacing_m;
                ground.height_m(place_m)
            };
            (0..columns).map(height).collect()
        };
        let heights_m = in_pool(|| (0..rows).into_par_iter().flat_map_iter(row).collect());
        self.stay_near(rectangle.middle_m());
        Ok(HeightGrid {
            south_west_m,
            spacing_m,
            columns,
            rows,
            heights_m,
        })
    }
}
