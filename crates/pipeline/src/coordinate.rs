//! The coordinates of a forest's plans.

use nemoral_plan::{AnyCoordinate, Hasher};
use nemoral_scene::ChunkCoord;

/// The coordinate of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ForestCoordinate {
    /// The world: the node is computed once.
    World,
    /// A chunk.
    Chunk(ChunkCoord),
    /// A frame.
    Frame(u64),
}

impl AnyCoordinate for ForestCoordinate {
    const GLOBAL: Self = Self::World;

    fn hash(self, hasher: &mut Hasher) {
        match self {
            Self::World => {}
            Self::Chunk(c) => {
                hasher.write_i64(i64::from(c.x));
                hasher.write_i64(i64::from(c.y));
            }
            Self::Frame(i) => hasher.write_u64(i),
        }
    }
}
