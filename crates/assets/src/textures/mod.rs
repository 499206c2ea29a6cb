//! Textures, baked at start from a key.

pub(crate) mod bark;
pub(crate) mod canvas;
pub(crate) mod fallen;
pub(crate) mod ground;
pub(crate) mod mineral;
pub(crate) mod noise;
pub(crate) mod snow;
pub(crate) mod tile;
pub(crate) mod trail;
