//! Tree seedlings: plants of a stand's own species that are lower than 0.3 m.

use std::f32::consts::{PI, TAU};

use glam::Vec3;
use nemoral_scene::MaterialId;
use nemoral_seed::{Draw, Rng};

use super::shape::{Shape, around, leaning};
use super::undergrowth::{SUNK_M, arched};
use crate::materials::SeedlingMaterials;
use crate::tree::{FoliageCard, LeafKind, LeafLook};

/// Their least and greatest height, metres: those of seedlings of one to about four years. Placed
/// instances are scaled by up to a tenth either way.
pub(crate) const HEIGHT_M: [f32; 2] = [0.08, 0.26];

/// The least distance of leaves from the ground, metres. A blade that almost touches the ground
/// would be one object to a camera and another one to a LiDAR that measures to two centimetres.
const CLEAR_M: f32 = 0.05;

/// How a broadleaf's leaves stand on its stem.
struct Habit {
    /// The share of the stem's length that is bare at its foot.
    from: f32,
    /// The angle from a leaf to the next around the stem, radians.
    turn: f32,
    /// How far the stem bends over at its tip, radians.
    nod: f32,
}

impl Habit {
    fn of(look: &LeafLook) -> Self {
        match look.kind {
            // Crowded at the end, as on an oak's twigs.
            LeafKind::LeafRosettes => Self {
                from: 0.72,
                turn: 2.4,
                nod: 0.15,
            },
            // In two rows on a stem that leans over, as a beech's: one level plane of leaves.
            LeafKind::LeafSpray if look.distichous => Self {
                from: 0.36,
                turn: PI,
                nod: 0.75,
            },
            _ => Self {
                from: 0.34,
                turn: 2.4,
                nod: 0.25,
            },
        }
    }
}

/// A seedling of a species; `rank` 0..1 runs from the smallest to the tallest.
pub(crate) fn seedling(
    rank: f32,
    look: &LeafLook,
    materials: &SeedlingMaterials,
    rng: &mut impl Rng,
) -> Shape {
    let [low, high] = HEIGHT_M;
    let height_m = low + (high - low) * rank;
    match look.kind {
        LeafKind::NeedleTuft => conifer(height_m, &PINE, materials, rng),
        LeafKind::NeedleSpray => conifer(height_m, &SPRUCE, materials, rng),
        LeafKind::LeafSpray | LeafKind::LeafRosettes | LeafKind::HangingLeaves => {
            broadleaf(height_m, &Habit::of(look), materials, rng)
        }
    }
}

/// A seedling's stem, and what springs from it.
struct Growing {
    shape: Shape,
    line: [Vec3; STEM_POINTS],
}

const STEM_POINTS: usize = 5;

impl Growing {
    /// A stem whose tip is `height_m` high, and leans over by `nod` radians.
    fn stem(height_m: f32, azimuth: f32, nod: f32, material: MaterialId) -> Self {
        let foot = Vec3::new(0.0, 0.0, -SUNK_M);
        let line = arched(foot, azimuth, 1.0, 0.0, nod, STEM_POINTS);
        let size = (height_m + SUNK_M) / (line[STEM_POINTS - 1].z - foot.z);
        let line = std::array::from_fn(|i| foot + size * (line[i] - foot));
        let radius_m = 0.0007 + 0.006 * height_m;
        let radii: [f32; STEM_POINTS] = std::array::from_fn(|i| radius_m * (1.0 - 0.12 * i as f32));
        let mut shape = Shape::default();
        shape.tube(&line, &radii, 4, material);
        Self { shape, line }
    }

    /// The point of the stem at a height, or its tip.
    fn at(&self, height_m: f32) -> Vec3 {
        let above = self.line.iter().skip(1).position(|p| p.z >= height_m);
        let Some(below) = above else {
            return self.line[STEM_POINTS - 1];
        };
        let (a, b) = (self.line[below], self.line[below + 1]);
        a.lerp(b, ((height_m - a.z) / (b.z - a.z)).clamp(0.0, 1.0))
    }

    /// Hangs an image on the stem: higher than asked for if it would come too near to the ground,
    /// lower if it would rise above the greatest height of seedlings.
    fn card(&mut self, image: &FoliageCard, height_m: f32, along: Vec3, across: Vec3, size: f32) {
        let shape = &mut self.shape;
        shape.card(image, Vec3::ZERO, along, across, size);
        let Some(mut card) = shape.cards.pop() else {
            return;
        };
        let corners = card.corners().map(|c| c.z);
        let lowest_m = corners.into_iter().fold(0.0, f32::min);
        let highest_m = corners.into_iter().fold(0.0, f32::max);
        let height_m = height_m.min(HEIGHT_M[1] - highest_m);
        card.corner += self.at(height_m.max(CLEAR_M - lowest_m));
        self.shape.cards.push(card);
    }
}

/// Four to ten leaves, nearly level.
fn broadleaf(
    height_m: f32,
    habit: &Habit,
    materials: &SeedlingMaterials,
    rng: &mut impl Rng,
) -> Shape {
    let heading = rng.range_f32(0.0, TAU);
    let nod = habit.nod * rng.range_f32(0.6, 1.3);
    // The uppermost leaves rise above the tip.
    let stem_m = 0.88 * height_m;
    let mut growing = Growing::stem(stem_m, heading, nod, materials.stem);
    let age = (height_m - HEIGHT_M[0]) / (HEIGHT_M[1] - HEIGHT_M[0]);
    let leaves = 4 + (4.9 * age) as u32 + rng.below(3);
    let vigour = (0.48 + 0.34 * age) * rng.range_f32(0.9, 1.1);
    for i in 0..leaves {
        let up = (i as f32 + 0.9) / leaves as f32;
        let at_m = stem_m * (habit.from + (1.0 - habit.from) * up.min(1.0));
        // Two rows stand left and right of the way that the stem leans.
        let azimuth = heading + 0.5 * PI + habit.turn * i as f32 + rng.range_f32(-0.35, 0.35);
        let tilt = rng.range_f32(1.25, 1.60) - 0.12 * up;
        let image = rng.choose(&materials.leaves);
        // Leaves are in proportion to the stem, however large those of a tree of the species are.
        let most = (0.45 * height_m + 0.02) / image.height_m;
        let size = (vigour * rng.range_f32(0.85, 1.15)).min(most);
        let along = leaning(azimuth, tilt);
        let across = along.cross(Vec3::Z) + 0.2 * rng.range_f32(-1.0, 1.0) * Vec3::Z;
        growing.card(image, at_m, along, across, size);
    }
    growing.shape
}

/// A conifer's side shoots.
struct Whorls {
    /// How far off the vertical they grow, radians, least and most.
    tilt: [f32; 2],
    /// Their length over that of the stem above them.
    length: f32,
}

/// A pine's rise.
const PINE: Whorls = Whorls {
    tilt: [0.55, 0.90],
    length: 0.70,
};

/// A spruce's or fir's spread.
const SPRUCE: Whorls = Whorls {
    tilt: [1.00, 1.35],
    length: 0.90,
};

/// A leader and whorls of side shoots below it.
fn conifer(
    height_m: f32,
    form: &Whorls,
    materials: &SeedlingMaterials,
    rng: &mut impl Rng,
) -> Shape {
    let heading = rng.range_f32(0.0, TAU);
    let nod = rng.range_f32(0.0, 0.2);
    let mut growing = Growing::stem(0.85 * height_m, heading, nod, materials.stem);
    let mut shoot = |at_m: f32, along: Vec3, across: Vec3, length_m: f32| {
        let off = |card: &FoliageCard| (card.height_m - length_m).abs();
        let images = materials.leaves.iter();
        if let Some(nearest) = images.min_by(|a, b| off(a).total_cmp(&off(b))) {
            growing.card(nearest, at_m, along, across, length_m / nearest.height_m);
        }
    };
    // The leader is seen from all sides: two images at right angles.
    let bare_m = (0.36 * height_m).max(CLEAR_M);
    let along = leaning(heading, nod);
    let side = around(rng.range_f32(0.0, TAU));
    for across in [side, side.cross(along)] {
        shoot(bare_m, along, across, height_m - bare_m);
    }
    let whorls = (((height_m - 0.02) / 0.07) as u32).clamp(1, 2);
    for whorl in 0..whorls {
        let share = 0.32 + 0.26 * whorl as f32;
        let shoots = 3 + rng.below(3);
        let turn = rng.range_f32(0.0, TAU);
        for k in 0..shoots {
            let azimuth = turn + TAU * (k as f32 + rng.range_f32(-0.2, 0.2)) / shoots as f32;
            let along = leaning(azimuth, rng.range_f32(form.tilt[0], form.tilt[1]));
            let length_m = form.length * (1.0 - share) * height_m * rng.range_f32(0.8, 1.2);
            let across = along.cross(Vec3::Z);
            shoot(share * height_m, along, across, length_m.max(0.025));
        }
    }
    growing.shape
}

#[cfg(test)]
mod tests {
    use nemoral_seed::Key;
    use proptest::prelude::*;

    use super::*;
    use crate::tree::Species;

    /// Images as large as a species' leaves or shoots, and one that is as large as any can be.
    fn materials(look: &LeafLook) -> SeedlingMaterials {
        let long = look.length_m[1] as f32;
        let card = |height_m: f32, ratio: f32| FoliageCard {
            material: MaterialId(0),
            width_m: ratio * height_m,
            height_m,
            opaque_fraction: 0.5,
        };
        let leaves = match look.kind {
            LeafKind::NeedleTuft | LeafKind::NeedleSpray => {
                vec![card(0.06, 1.0), card(0.09, 0.7), card(0.14, 0.5)]
            }
            _ => vec![card(long, 0.3), card(1.4 * long, 0.9), card(0.6, 1.5)],
        };
        SeedlingMaterials {
            leaves,
            stem: MaterialId(1),
        }
    }

    proptest! {
        /// Seedlings of any species, size and key, placed a tenth smaller or larger.
        #[test]
        fn each_is_a_seedling_and_keeps_its_leaves_off_the_ground(
            which in 0..9_usize, rank in 0.0_f32..=1.0, seed: u64,
        ) {
            let look = &Species::all()[which].leaves;
            let shape = seedling(rank, look, &materials(look), &mut Key::world(seed).rng());
            let bounds = shape.bounds();
            prop_assert!(0.9 * bounds.max.z > 0.05 && 1.1 * bounds.max.z < 0.3, "{bounds:?}");
            prop_assert!(bounds.min.z < -0.5 * SUNK_M, "it floats: {bounds:?}");
            prop_assert!((4..=12).contains(&shape.cards.len()), "{} cards", shape.cards.len());
            for card in &shape.cards {
                let lowest_m = card.corners().map(|c| c.z).into_iter().fold(1.0, f32::min);
                prop_assert!(0.9 * lowest_m >= 0.04, "{lowest_m}");
            }
        }
    }
}
