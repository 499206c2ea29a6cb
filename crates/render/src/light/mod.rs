//! Light in a forest: the light that reaches a place, and what a surface reflects and transmits of
//! it.

pub(crate) mod hex_tiling;
pub(crate) mod lamp;
pub(crate) mod lamp_glow;
pub(crate) mod lighting;
pub(crate) mod ripples;
pub(crate) mod shading;
