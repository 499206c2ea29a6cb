//! The engine, [`nemoral_plan`], at the coordinates of a forest: once for the world, for a chunk,
//! or for a frame.

use nemoral_scene::ChunkCoord;
use nemoral_seed::Key;

pub use nemoral_plan::{
    Cache, Coordinate, Encode, Encoder, Fingerprint, GraphFormat, Hasher, Kept, KeyEncoder, Node,
    Stage,
};

use crate::Error;
pub use crate::at::At;

/// The types of a forest's plans. The context of every stage is the world's key.
#[derive(Clone, Copy, Debug)]
pub enum Forest {}

impl nemoral_plan::PlanTypes for Forest {
    type At = At;
    type Context = Key;
    type Error = Error;

    fn hash_context(world: &Key, hasher: &mut Hasher) {
        hasher.write_bytes(&world.to_bytes());
    }
}

impl Coordinate<Forest> for ChunkCoord {
    fn erase(self) -> At {
        At::Chunk(self)
    }

    fn restore(at: At) -> Option<Self> {
        if let At::Chunk(c) = at { Some(c) } else { None }
    }
}

/// A frame's number.
impl Coordinate<Forest> for u64 {
    fn erase(self) -> At {
        At::Frame(self)
    }

    fn restore(at: At) -> Option<Self> {
        if let At::Frame(i) = at { Some(i) } else { None }
    }
}

/// The graphs of a world.
pub type Plan = nemoral_plan::Plan<Forest>;

/// A plan with a store and threads.
pub type Runner<'a> = nemoral_plan::Runner<'a, Forest>;

/// A store of a forest's values.
pub type Store = nemoral_plan::Store<Forest>;

/// The values that a stage runs on: one for each of its inputs, in their order.
pub type Values<'a, S> = nemoral_plan::Values<'a, Forest, S>;

/// The edge to a node that is computed once for the world.
pub type OfWorld<T> = nemoral_plan::Global<T>;

/// The edge to a chunk node, at chunks that the stage names while it runs.
pub type AnyChunk<T> = nemoral_plan::Anywhere<ChunkCoord, T>;

/// The edge to a frame node, at frames that the stage names while it runs.
pub type AnyFrame<T> = nemoral_plan::Anywhere<u64, T>;

/// A chunk node that can be asked for at any chunk.
pub type Demand<'a, T> = nemoral_plan::Demand<'a, Forest, ChunkCoord, T>;
