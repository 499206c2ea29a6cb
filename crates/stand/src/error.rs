//! The error of this crate.

use nemoral_scene::ChunkCoord;

/// An error of this crate.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// There are no ids for the objects: there are too many, or the chunk is too far from the
    /// world's origin.
    #[error("{objects} objects in chunk {chunk}: a chunk holds at most 65,535, within ±2,097,151")]
    NoObjectId {
        /// The number of objects of the chunk.
        objects: usize,
        /// The chunk.
        chunk: ChunkCoord,
    },
}
