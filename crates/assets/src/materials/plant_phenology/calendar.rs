//! The days on which low plants and climbers turn, die down, grow and flower.

use glam::Vec3;

use super::{PlantPhenology, Strokes};
use crate::cards::sward::STRAW;
use crate::materials::foliage::DEAD_FROND;
use crate::materials::optics::{self, LeafOptics};

const DEAD_LEAF: LeafOptics = LeafOptics {
    albedo: Vec3::new(0.170, 0.102, 0.074),
    transmittance: Vec3::new(0.077, 0.030, 0.013),
    laser: optics::CURED.laser,
};
/// Leaves of bramble in winter, between green and red.
const BRONZE: LeafOptics = LeafOptics {
    albedo: Vec3::new(0.135, 0.070, 0.040),
    transmittance: Vec3::new(0.110, 0.050, 0.010),
    laser: optics::HERB.laser,
};
/// As leaves of bilberry turn, PROSPECT-D.
const RED: LeafOptics = LeafOptics {
    albedo: Vec3::new(0.247, 0.077, 0.045),
    transmittance: Vec3::new(0.241, 0.053, 0.010),
    laser: optics::HERB.laser,
};
const DEAD_BLADE: LeafOptics = LeafOptics {
    albedo: STRAW,
    transmittance: Vec3::new(0.105, 0.080, 0.030),
    laser: optics::CURED.laser,
};

const fn of_twigs(dead: LeafOptics, days: &'static [(f64, f32, f32)]) -> PlantPhenology {
    PlantPhenology {
        days,
        dead,
        strokes: Strokes::Twigs,
        flowers: &[],
    }
}

const fn of_stems(dead: LeafOptics, days: &'static [(f64, f32, f32)]) -> PlantPhenology {
    PlantPhenology {
        days,
        dead,
        strokes: Strokes::Stems,
        flowers: &[],
    }
}

const fn of_blades(days: &'static [(f64, f32, f32)]) -> PlantPhenology {
    PlantPhenology {
        days,
        dead: DEAD_BLADE,
        strokes: Strokes::Blades,
        flowers: &[],
    }
}

/// Evergreen shrubs, of which flowers alone come and go.
const fn in_flower(flowers: &'static [(f64, f32)]) -> PlantPhenology {
    PlantPhenology {
        flowers,
        ..of_twigs(DEAD_LEAF, &[(0.0, 0.0, 1.0), (366.0, 0.0, 1.0)])
    }
}

/// Bracken: up from the end of April, grown in June, rusty from October.
pub(in crate::materials) const BRACKEN: PlantPhenology = of_stems(
    DEAD_FROND,
    &[
        (0.0, 1.0, 0.7),
        (125.0, 1.0, 0.45),
        (140.0, 0.5, 0.5),
        (165.0, 0.0, 1.0),
        (245.0, 0.0, 1.0),
        (275.0, 0.6, 1.0),
        (290.0, 1.0, 1.0),
        (330.0, 1.0, 0.85),
        (366.0, 1.0, 0.7),
    ],
);
/// Male fern, some of whose fronds stay green over the new year.
pub(in crate::materials) const MALE_FERN: PlantPhenology = of_stems(
    DEAD_FROND,
    &[
        (0.0, 0.8, 0.9),
        (110.0, 1.0, 0.7),
        (135.0, 0.2, 0.7),
        (160.0, 0.0, 1.0),
        (300.0, 0.0, 1.0),
        (345.0, 0.6, 1.0),
        (366.0, 0.8, 0.9),
    ],
);
/// Rosettes, which are half green in winter.
pub(in crate::materials) const ROSETTE: PlantPhenology = of_stems(
    DEAD_LEAF,
    &[
        (0.0, 0.5, 0.6),
        (75.0, 0.4, 0.6),
        (110.0, 0.0, 1.0),
        (290.0, 0.0, 1.0),
        (340.0, 0.5, 0.6),
        (366.0, 0.5, 0.6),
    ],
);
/// Herbs that die down in autumn, and nettles.
pub(in crate::materials) const TALL_HERB: PlantPhenology = of_stems(
    DEAD_LEAF,
    &[
        (0.0, 1.0, 0.25),
        (95.0, 1.0, 0.1),
        (105.0, 0.0, 0.2),
        (140.0, 0.0, 1.0),
        (275.0, 0.0, 1.0),
        (315.0, 0.9, 0.5),
        (340.0, 1.0, 0.25),
        (366.0, 1.0, 0.25),
    ],
);
/// Wood-sorrel and clover.
pub(in crate::materials) const TREFOIL: PlantPhenology = of_stems(
    DEAD_LEAF,
    &[
        (0.0, 0.3, 0.4),
        (90.0, 0.0, 0.6),
        (115.0, 0.0, 1.0),
        (300.0, 0.0, 1.0),
        (335.0, 0.3, 0.4),
        (366.0, 0.3, 0.4),
    ],
);
/// Grass, two fifths of whose blades are straw in winter.
pub(in crate::materials) const GRASS: PlantPhenology = of_blades(&[
    (0.0, 0.4, 1.0),
    (80.0, 0.45, 1.0),
    (115.0, 0.0, 1.0),
    (285.0, 0.0, 1.0),
    (330.0, 0.35, 1.0),
    (366.0, 0.4, 1.0),
]);
/// Reed, dead above the ground from November to May.
pub(in crate::materials) const REED: PlantPhenology = of_blades(&[
    (0.0, 1.0, 0.8),
    (120.0, 1.0, 0.6),
    (145.0, 0.3, 0.9),
    (165.0, 0.0, 1.0),
    (260.0, 0.0, 1.0),
    (310.0, 1.0, 1.0),
    (366.0, 1.0, 0.8),
]);
/// Bramble, which keeps half of its leaves, some of them red.
pub(in crate::materials) const BRAMBLE: PlantPhenology = of_twigs(
    BRONZE,
    &[
        (0.0, 0.35, 0.55),
        (90.0, 0.4, 0.5),
        (115.0, 0.1, 0.7),
        (140.0, 0.0, 1.0),
        (260.0, 0.0, 1.0),
        (300.0, 0.25, 0.9),
        (340.0, 0.35, 0.65),
        (366.0, 0.35, 0.55),
    ],
);
/// Bilberry, red in September and bare in winter.
pub(in crate::materials) const BILBERRY: PlantPhenology = of_twigs(
    RED,
    &[
        (0.0, 0.0, 0.0),
        (112.0, 0.0, 0.0),
        (140.0, 0.0, 1.0),
        (235.0, 0.0, 1.0),
        (262.0, 0.7, 1.0),
        (280.0, 0.9, 0.6),
        (300.0, 1.0, 0.0),
        (366.0, 0.0, 0.0),
    ],
);
/// Clematis and honeysuckle.
pub(in crate::materials) const LIANA: PlantPhenology = of_twigs(
    DEAD_LEAF,
    &[
        (0.0, 1.0, 0.03),
        (75.0, 0.0, 0.0),
        (115.0, 0.0, 1.0),
        (280.0, 0.0, 1.0),
        (300.0, 0.5, 0.8),
        (325.0, 1.0, 0.1),
        (366.0, 1.0, 0.03),
    ],
);

/// Gorse, yellow from February to May; some of it flowers later.
pub(in crate::materials) const GORSE: PlantPhenology = in_flower(&[
    (0.0, 0.0),
    (35.0, 0.0),
    (55.0, 1.0),
    (125.0, 1.0),
    (150.0, 0.1),
    (366.0, 0.0),
]);
/// Heather, which flowers in August and September and is rusty until spring.
pub(in crate::materials) const HEATHER: PlantPhenology = in_flower(&[
    (0.0, 0.0),
    (200.0, 0.0),
    (220.0, 1.0),
    (260.0, 1.0),
    (280.0, 0.0),
    (366.0, 0.0),
]);

/// The phenology of all plants that die down or lose leaves.
pub(super) const ALL: [PlantPhenology; 10] = [
    BRACKEN, MALE_FERN, ROSETTE, TALL_HERB, TREFOIL, GRASS, REED, BRAMBLE, BILBERRY, LIANA,
];
