//! Images of twigs, leaves and blades with one-bit masks, for the quads ("cards") that foliage is
//! made of.

pub(crate) mod card_raster;
pub(crate) mod climbers;
pub(crate) mod foliage;
pub(crate) mod lianas;
pub(crate) mod litter;
pub(crate) mod reed;
pub(crate) mod seasons;
pub(crate) mod seedlings;
pub(crate) mod sward;
pub(crate) mod understory;
