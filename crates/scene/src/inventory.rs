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
    /// A log on the ground.
    Log,
    /// The root plate of a thrown tree.
    RootPlate,
}

impl ObjectKind {
    /// Every kind.
    pub const ALL: &'static [Self] = &[
        Self::Tree,
        Self::Stump,
        Self::Shrub,
        Self::Rock,
        Self::Log,
        Self::RootPlate,
    ];

    /// The name used in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tree => "tree",
            Self::Stump => "stump",
            Self::Shrub => "shrub",
            Self::Rock => "rock",
            Self::Log => "log",
            Self::RootPlate => "root_plate",
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
    /// Stem volume over bark from the ground to the tip, or to where the stem forks, m³.
    pub stem_volume_m3: f64,
    /// Volume of all wood over bark above the ground, m³; `None` if that is not known, as of a
    /// user's model.
    pub wood_volume_m3: Option<f64>,
    /// That of the wood that is at least 7 cm thick, m³.
    pub merchantable_volume_m3: Option<f64>,
    /// Lean of the stem from the vertical, radians.
    pub lean_rad: f64,
    /// Its age class: `sapling`, `young`, `middle` or `mature`.
    pub age_class: String,
    /// Whether it is alive.
    pub alive: bool,
    /// What the stem map that it stands in calls it; empty for other trees.
    pub field_id: String,
}

/// How far a log has decayed, in the five stages of Maser, Anderson, Cromack, Williams and Martin
/// 1979 ("Dead and down woody material", in Thomas, *Wildlife habitats in managed forests*).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum DecayStage {
    /// Its bark is whole; it is round, and rests on a few points.
    Fresh,
    /// Its bark comes off; it is round still, and the first moss grows on it.
    Loosening,
    /// Little bark is left, moss covers its upper side, and it lies on the ground all along.
    Bare,
    /// Its wood is soft and falls apart; it is flattened and partly sunk.
    Soft,
    /// It is a low mound of rotten wood under moss and litter.
    Rotten,
}

impl DecayStage {
    /// Every stage, the fresh one first.
    pub const ALL: [Self; 5] = [
        Self::Fresh,
        Self::Loosening,
        Self::Bare,
        Self::Soft,
        Self::Rotten,
    ];

    /// Its place in [`ALL`](Self::ALL).
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }

    /// Its number as foresters count: 1 (fresh) to 5 (rotten).
    #[must_use]
    pub const fn number(self) -> u8 {
        self as u8 + 1
    }

    /// The stage of this number, 1 to 5.
    #[must_use]
    pub const fn from_number(number: u8) -> Option<Self> {
        match number {
            1..=5 => Some(Self::ALL[number as usize - 1]),
            _ => None,
        }
    }
}

/// A row of `deadwood.csv`: what a forester would measure on a log, or on a root plate.
#[derive(Clone, Debug, PartialEq)]
pub struct DeadwoodRecord {
    /// The true id.
    pub object: ObjectId,
    /// [`ObjectKind::Log`] or [`ObjectKind::RootPlate`].
    pub kind: ObjectKind,
    /// Species, `snake_case`.
    pub species: String,
    /// World position of the middle of a log's axis, or of a root plate, metres.
    pub position_m: DVec3,
    /// The direction from a log's thick end to its thin end, degrees clockwise from north, 0..360;
    /// of a root plate, that of the stem which it belonged to.
    pub azimuth_deg: f64,
    /// Length of a log, thickness of a root plate, metres.
    pub length_m: f64,
    /// Diameters at the thick and the thin end, metres; of a root plate, its own, twice. A
    /// flattened log has that of a circle with the same area.
    pub diameter_m: [f64; 2],
    /// Stage of decay.
    pub decay: DecayStage,
    /// Volume of wood, m³; 0 for a root plate, which inventories do not count.
    pub volume_m3: f64,
    /// Whether a stem lies with its root plate: the tree was thrown.
    pub is_thrown: bool,
}
