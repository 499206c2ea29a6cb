//! Measures of realism that need no photographs: the pattern of stems, the gaps between leaves, the
//! distribution of light over a picture, the diameter of a stem in a scan. All of them are
//! independent of the crates under test.
//!
//! It also has the worlds ([`World`], [`store`], [`grown`]) that tests of the pipeline share.

mod asked;
mod canopy;
mod circle;
mod classes;
mod cover;
mod diameters;
mod ground;
mod grown;
mod heights;
mod layer_cover;
mod leaf_area;
mod picture;
mod plot;
mod profile;
mod published;
pub mod ranges;
mod relations;
mod stems;
mod survey;
mod visibility;
mod world;

pub use asked::{asked_diameters, asked_shapes};
pub use canopy::{Canopy, Gaps, HINGE_DEG, LeafField, Standing};
pub use circle::{Circle, circle};
pub use classes::ClassCounts;
pub use cover::{LOW_PLANTS, LowCover};
pub use diameters::{STATIONS, ScannedDiameters, ScannedStem};
pub use ground::ground_repetition;
pub use grown::grown;
pub use heights::{HeightScatter, stand_diameters};
pub use layer_cover::{COVER_LAYERS, LayerCover};
pub use leaf_area::Voxels;
pub use picture::{
    Colour, Tones, amplitude_slope, colour, isotropy, luminance, luminance_of_light, spectrum,
    tones,
};
pub use plot::{Plot, Series};
pub use profile::{Layers, layers, plant_area_density};
pub use published::published_height_m;
pub use relations::Relations;
pub use stems::{
    clark_evans, distribution_distance, mark_correlation, pair_correlation, row_power, weibull_fit,
};
pub use survey::{Copied, CopyKind, Survey};
pub use visibility::{SIGHT_M, StemVisibility, law_per_m};
pub use world::{STANDS, World, config, store};
