//! This crate composes forest stands: what covers the ground, how much light reaches it, which low
//! plants grow there, and how copies of one tree are told apart.
//!
//! Everything here is a function of positions, keys and a few ports; the crate knows neither how
//! sites are sampled, nor what plants look like, nor how rays are cast.
//!
//! - [`FloorComposition`]: patches of leaf litter, needle litter and moss with given shares, from
//!   any smooth [`Field`].
//! - [`SkyViewFactor`]: the share of the sky that is seen past the crowns, measured with any
//!   [`RayCaster`](nemoral_scene::RayCaster).
//! - [`InstanceVariation`]: turns and sizes such that no two copies of a tree within 30 m look
//!   alike.
//!
//! All lengths are metres; world positions are x east, y north, z up.

mod field;
mod floor_composition;
mod instance_variation;
mod sky_view_factor;

#[doc = include_str!("../README.md")]
#[cfg(doctest)]
struct ReadmeDoctests;

pub use field::{Field, FieldParams};
pub use floor_composition::{FLOOR_FIELD, FloorComposition, FloorCover};
pub use instance_variation::{
    InstanceVariation, Variation, VariationPattern, grown_scale, sapling_scale,
};
pub use sky_view_factor::{REACH_M, SkyViewArea, SkyViewFactor};
