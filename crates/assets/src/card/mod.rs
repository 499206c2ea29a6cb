//! Pictures of twigs, leaves and blades with one-bit masks.

pub(crate) mod seedlings;
pub(crate) mod sketch;
pub(crate) mod trees;
pub(crate) mod understory;
