//! The inventory of a world: what is known of its objects.

use glam::DVec3;

use crate::ObjectId;

/// What an object is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum ObjectKind {
    /// A tree, alive or dead.
    Tree,
    /// A stump.
    Stump,
    /// A shrub.
    Shrub,
    /// A rock.
    Rock,
}

impl ObjectKind {
    /// Every kind.
    pub const ALL: &'static [Self] = &[Self::Tree, Self::Stump, Self::Shrub, Self::Rock];

    /// The name used in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tree => "tree",
            Self::Stump => "stump",
            Self::Shrub => "shrub",
            Self::Rock => "rock",
        }
    }
}

/// A row of `instances.csv`.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectRecord {
    /// The true id.
    pub object: ObjectId,
    /// Its kind.
    pub kind: ObjectKind,
    /// Species or variety, `snake_case`.
    pub species: String,
    /// World position of its foot, metres.
    pub position_m: DVec3,
    /// Radius it occupies at the ground, metres.
    pub radius_m: f64,
    /// Height above its foot, metres.
    pub height_m: f64,
}

/// A row of `trees.csv`: what a forester would measure on the tree that was grown.
#[derive(Clone, Debug, PartialEq)]
pub struct TreeRecord {
    /// The true id.
    pub object: ObjectId,
    /// Species, `snake_case`.
    pub species: String,
    /// World position of the stem's foot, metres.
    pub position_m: DVec3,
    /// Diameter at breast height (1.3 m), over bark, metres.
    pub dbh_m: f64,
    /// Height, metres.
    pub height_m: f64,
    /// Height of the crown's base, metres: 98 % of the foliage is above it. For a dead tree it is
    /// the tree's height.
    pub crown_base_m: f64,
    /// Mean crown radius, metres.
    pub crown_radius_m: f64,
    /// One-sided leaf area, m².
    pub leaf_area_m2: f64,
    /// Stem volume, m³.
    pub stem_volume_m3: f64,
    /// Lean of the stem from the vertical, radians.
    pub lean_rad: f64,
    /// Its age class: `sapling`, `young`, `middle` or `mature`.
    pub age_class: String,
    /// Whether it is alive.
    pub alive: bool,
}
