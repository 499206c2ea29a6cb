//! The engine, [`nemoral_plan`], at the coordinates of a forest: once for the world, for a chunk,
//! or for a frame.

use nemoral_scene::ChunkCoord;
use nemoral_seed::Key;

pub use nemoral_plan::{
    Cache, CacheCodec, Coordinate, Encode, Encoder, Fingerprint, GraphFormat, Hasher, KeyEncoder,
    Node, Stage,
};

use crate::Error;
pub use crate::coordinate::ForestCoordinate;

/// The types of a forest's plans. The context of every stage is the world's key.
#[derive(Clone, Copy, Debug)]
pub enum ForestTypes {}

impl nemoral_plan::PlanTypes for ForestTypes {
    type At = ForestCoordinate;
    type Context = Key;
    type Error = Error;

    fn hash_context(world: &Key, hasher: &mut Hasher) {
        hasher.write_bytes(&world.to_bytes());
    }
}

impl Coordinate<ForestTypes> for ChunkCoord {
    fn erase(self) -> ForestCoordinate {
        ForestCoordinate::Chunk(self)
    }

    fn restore(at: ForestCoordinate) -> Option<Self> {
        if let ForestCoordinate::Chunk(c) = at {
            Some(c)
        } else {
            None
        }
    }
}

/// A frame's number.
impl Coordinate<ForestTypes> for u64 {
    fn erase(self) -> ForestCoordinate {
        ForestCoordinate::Frame(self)
    }

    fn restore(at: ForestCoordinate) -> Option<Self> {
        if let ForestCoordinate::Frame(i) = at {
            Some(i)
        } else {
            None
        }
    }
}

/// The graphs of a world.
pub type Plan = nemoral_plan::Plan<ForestTypes>;

/// A plan with a store and threads.
pub type Runner<'a> = nemoral_plan::Runner<'a, ForestTypes>;

/// A store of a forest's values.
pub type Store = nemoral_plan::Store<ForestTypes>;

/// The values that a stage runs on: one for each of its inputs, in their order.
pub type Values<'a, S> = nemoral_plan::Values<'a, ForestTypes, S>;

/// The edge to a node that is computed once for the world.
pub type WorldEdge<T> = nemoral_plan::GlobalEdge<T>;

/// The edge to a chunk node, at chunks that the stage names while it runs.
pub type AnyChunkEdge<T> = nemoral_plan::DynamicEdge<ChunkCoord, T>;

/// The edge to a frame node, at frames that the stage names while it runs.
pub type AnyFrameEdge<T> = nemoral_plan::DynamicEdge<u64, T>;

/// A chunk node that can be asked for at any chunk.
pub type Demand<'a, T> = nemoral_plan::Demand<'a, ForestTypes, ChunkCoord, T>;
