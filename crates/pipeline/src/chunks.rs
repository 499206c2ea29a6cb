//! The chunk manager (paper, IV-A), which decides which chunks are active, kept and deleted.

use nemoral_scene::ChunkCoord;
use nemoral_scene::glam::DVec2;

use crate::Error;
use crate::config::Chunks;
use crate::plan::{ForestCoordinate, Stage, Store};
use crate::stages::annotations::UncoveredGeometryStage;
use crate::stages::balance::ChoiceStage;
use crate::stages::ground_occlusion::GroundOcclusionStage;
use crate::stages::litter::{LitterGeometryStage, LitterStage};
use crate::stages::object_geometry::ObjectGeometryStage;
use crate::stages::sky_view_factor::{GroundSkyViewStage, SkyViewStage};
use crate::stages::undergrowth::{SeedlingStage, UndergrowthStage};
use crate::stages::undergrowth_geometry::UndergrowthGeometryStage;

/// What the chunk manager does with a chunk (paper, Fig. 2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChunkState {
    /// Visible.
    Active,
    /// Not visible, but kept, as the robot may come back.
    Disabled,
    /// Freed. If the robot comes back, the same chunk is made again.
    Deleted,
}

/// The chunks that a rectangle touches, in order of (x, y). It is refused by its name if they are
/// more than `most`.
pub(crate) fn chunks_of(
    (low_m, high_m): (DVec2, DVec2),
    size_m: f64,
    (name, most): (&str, i64),
) -> Result<Vec<ChunkCoord>, Error> {
    let first = ChunkCoord::containing(low_m, size_m);
    let last = ChunkCoord::containing(high_m, size_m);
    let side = |first: i32, last: i32| (i64::from(last) - i64::from(first) + 1).max(0);
    let count = side(first.x, last.x).saturating_mul(side(first.y, last.y));
    if count > most {
        return Err(Error::request(format!(
            "{name}: it touches {count} chunks of {size_m} m; must be at most {most}: ask for its \
             parts"
        )));
    }
    let column = |x| (first.y..=last.y).map(move |y| ChunkCoord::new(x, y));
    Ok((first.x..=last.x).flat_map(column).collect())
}

/// Decides by the robot's position what is visible and what is kept. It is only the eviction policy
/// of the plan's [`Store`]: the content of a chunk never depends on it.
#[derive(Clone, Debug)]
pub struct ChunkManager {
    chunks: Chunks,
}

impl ChunkManager {
    /// The manager of a config.
    #[must_use]
    pub fn new(chunks: Chunks) -> Self {
        Self { chunks }
    }

    /// The state of a chunk's trees and ground for a robot at a world position.
    #[must_use]
    pub fn state(&self, chunk: ChunkCoord, robot_m: DVec2) -> ChunkState {
        let distance = chunk.distance_m(robot_m, self.chunks.size_m);
        if distance <= self.chunks.visible_radius_m {
            ChunkState::Active
        } else if distance <= self.chunks.delete_radius_m {
            ChunkState::Disabled
        } else {
            ChunkState::Deleted
        }
    }

    /// Frees what is out of reach of a robot at a world position. Undergrowth, which is visible
    /// less far, is kept to a proportionally shorter distance. Placements, which are needed beyond
    /// the visible radius and are small, are kept for the surrounding chunks, too. Of frames, those
    /// in `coming` are kept.
    pub fn evict(&self, store: &Store, robot_m: DVec2, coming: &[u64]) {
        let c = &self.chunks;
        let spare = c.delete_radius_m - c.visible_radius_m;
        store.retain(|stage, at| match at {
            ForestCoordinate::World => true,
            // Where a frame is taken is found once, and is little.
            ForestCoordinate::Frame(frame) => stage == ChoiceStage::ID || coming.contains(&frame),
            ForestCoordinate::Chunk(chunk) => {
                let distance = chunk.distance_m(robot_m, c.size_m);
                let limit = match stage {
                    UndergrowthGeometryStage::ID
                    | GroundOcclusionStage::ID
                    | UndergrowthStage::ID
                    | SeedlingStage::ID => c.undergrowth_radius_m + spare,
                    LitterGeometryStage::ID | LitterStage::ID => {
                        c.litter_radius_m.min(c.undergrowth_radius_m) + spare
                    }
                    ObjectGeometryStage::ID
                    | UncoveredGeometryStage::ID
                    | GroundSkyViewStage::ID
                    | SkyViewStage::ID => c.delete_radius_m,
                    _ => c.delete_radius_m + 2.0 * c.size_m,
                };
                distance <= limit
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_three_states_of_figure_2() {
        let mut chunks = Chunks::default();
        (chunks.visible_radius_m, chunks.delete_radius_m) = (100.0, 200.0);
        let manager = ChunkManager::new(chunks);
        let robot = DVec2::new(25.0, 25.0);
        let state = |x| manager.state(ChunkCoord::new(x, 0), robot);
        // Chunk x begins 50 x - 25 m from the robot.
        assert_eq!(
            [0, 2, 3, 4, 5].map(state),
            [
                ChunkState::Active,
                ChunkState::Active,
                ChunkState::Disabled,
                ChunkState::Disabled,
                ChunkState::Deleted,
            ]
        );
    }
}
