//! This crate composes forest stands: what covers the ground, how much light reaches it, which low
//! plants grow there, and how copies of one tree are told apart.
//!
//! Everything here is a function of positions, keys and a few ports; the crate knows neither how
//! sites are sampled, nor what plants look like, nor how rays are cast.
//!
//! - [`FloorComposition`]: patches of leaf litter, needle litter and moss with given shares, from
//!   any smooth [`ScalarField`].
//! - [`SkyViewFactor`]: the share of the sky that is seen past the crowns, measured with any
//!   [`RayCaster`](nemoral_scene::RayCaster).
//! - [`GroundOcclusion`]: the share of the light that what stands on the ground leaves to it.
//! - [`InstanceVariation`]: turns and sizes such that no two copies of a tree within 30 m look
//!   alike.
//! - [`Undergrowth`]: the chance of a patch of low plants, and which grows there, by the light.
//! - [`Communities`]: swards and thickets that close over the ground, by light, moisture and slope.
//! - [`GroundConditions`]: how wet, sunny and deep the ground of a place is, from any
//!   [`Surface`](nemoral_scene::Surface); [`outcrop_chance`]: how readily rock crops out of it.
//! - [`Seedlings`]: the chance of a tree seedling.
//! - [`LowPlant`]: a patch or seedling as one of several shapes on the slope of its ground.
//! - [`Litter`]: where what the trees shed lies, and how deep; [`GroundPlane`]: the plane that a
//!   patch of it is laid on.
//! - [`fallen_stems`] and [`settle`]: where stems lie; [`LyingStem`]: how gravity lays one on the
//!   ground.
//! - [`SceneObjects`]: what has an id in a chunk, numbered and stood on the ground; [`StandLayer`]
//!   names the woody layers.
//! - [`convex_hull`] and [`area_around_m2`]: the ground that given trees stand on.
//!
//! All lengths are metres; world positions are x east, y north, z up.
//!
//! ```
//! use nemoral_scene::glam::DVec2;
//! use nemoral_seed::Key;
//! use nemoral_stand::{FloorComposition, InstanceVariation};
//!
//! // Half of the floor is leaf litter. Any smooth field decides where.
//! let waves = |p: DVec2| 0.5 + 0.5 * (p.x * 0.4).sin() * (p.y * 0.3).cos();
//! let floor = FloorComposition::new([2.0, 1.0, 1.0], waves)?;
//! println!("{:?}", floor.cover(DVec2::new(12.0, 3.0), 0.0));
//!
//! // Two copies of a tree side by side are turned or sized differently.
//! let variation = InstanceVariation::new(Key::world(7));
//! let mut rng = Key::world(7).item(1).rng();
//! let a = variation.trees.at(DVec2::new(0.0, 0.0), &mut rng);
//! let b = variation.trees.at(DVec2::new(3.0, 0.0), &mut rng);
//! assert!(a != b);
//! # Ok::<(), nemoral_scene::ParamError>(())
//! ```

mod communities;
mod convex_hull;
mod error;
mod fallen_stems;
mod field;
mod floor_composition;
mod ground_conditions;
mod ground_occlusion;
mod ground_plane;
mod history;
mod instance_variation;
mod layer;
mod litter;
mod low_plants;
mod lying_stem;
mod occluders;
mod outcrops;
mod quantiles;
mod scene_objects;
mod seedlings;
mod sky_view_factor;
mod undergrowth;

#[doc = include_str!("../README.md")]
#[cfg(doctest)]
struct Readme;

pub use communities::{
    COMMUNITY_FIELD, Communities, CommunityCover, CommunityParams, CommunitySite, SWARD_FIELD,
};
pub use convex_hull::{area_around_m2, convex_hull};
pub use error::Error;
pub use fallen_stems::{FallenStem, StemKind, StemScale, fallen_stems, mean_volume_m3, settle};
pub use field::{FieldParams, ScalarField};
pub use floor_composition::{FLOOR_FIELD, FloorComposition, FloorCover};
pub use ground_conditions::{GroundConditions, Hemisphere};
pub use ground_occlusion::{GroundOcclusion, OCCLUSION_MARGIN_M};
pub use ground_plane::GroundPlane;
pub use history::{BROWSING_FIELD, SUCCESSION_FIELD, SiteHistory, VegetationHistory};
pub use instance_variation::{
    InstanceVariation, Variation, VariationPattern, grown_scale, sapling_scale,
};
pub use layer::StandLayer;
pub use litter::{Litter, LitterSite, LitterSurface};
pub use low_plants::{LOW_PLANT_VARIATION, LowPlant};
pub use lying_stem::{LyingPose, LyingStem, StemSupport, roll_rad};
pub use occluders::{occluders_of_objects, occluders_of_plants};
pub use outcrops::{
    OUTCROP_CELL_M, least_soil_effect_of_outcrops, most_outcropping_rocks, outcrop_chance,
};
pub use scene_objects::{
    LyingPlacement, MeasuredSize, OBJECT_VARIATION, ObjectSite, ObjectSize, SceneObject,
    SceneObjects,
};
pub use seedlings::Seedlings;
pub use sky_view_factor::{REACH_M, SkyViewArea, SkyViewFactor};
pub use undergrowth::{
    CLUMP_FIELD, FERN_FIELD, PATCH_JITTER, PATCH_SCALE, PatchKind, PatchSite, Undergrowth,
    UndergrowthParams,
};
