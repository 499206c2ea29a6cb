//! Light in a forest: what reaches a place, and what a surface there sends on.

pub(crate) mod hex_tiling;
pub(crate) mod lighting;
pub(crate) mod shading;
