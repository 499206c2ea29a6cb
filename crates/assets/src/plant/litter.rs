//! Patches of litter: what the trees of a stand shed, as it lies on level ground.
//!
//! Nothing reaches below the ground but the undersides of what is round, and nothing lies higher
//! than what lies below it can carry.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use nemoral_scene::MaterialId;
use nemoral_seed::{Draw, Key};

use super::floor::{fruit, twig};
use super::rock::{RockPlan, cobble_m, rock};
use super::shape::{Shape, around};
use crate::materials::LitterMaterials;
use crate::tree::{FoliageCard, LitterBark, LitterLook};

/// The share of the leaves of a patch that are of its own species; the others are of any species of
/// the stand.
const OWN: f64 = 0.72;
/// How high leaves lie over each other where litter is deepest, metres.
const PILE_M: f32 = 0.026;
/// The share of leaves that are bent, rather than flat.
const BENT: f64 = 0.45;
/// Twigs on a square metre.
const TWIGS_PER_M2: f32 = 2.6;
/// The share of pieces of bark that are from the foot of a stem, or show their inner side.
const LOWER_BARK: f64 = 0.6;
/// Leaves longer than this lie flatter, metres.
const LONG_LEAF_M: f32 = 0.1;
/// Stones over 5 cm on a square metre.
const STONES_PER_M2: f32 = 0.22;

/// What a species sheds, and what that is made of.
#[derive(Clone, Copy)]
pub(crate) struct SpeciesLitter<'a> {
    pub(crate) look: LitterLook,
    pub(crate) materials: &'a LitterMaterials,
}

/// What patch to make.
pub(crate) struct LitterPlan<'a> {
    pub(crate) radius_m: f32,
    /// How deep the litter is, 0..1.
    pub(crate) depth: f32,
    /// The amounts of leaves, of twigs, bark and fruits, and of stones, relative to the usual ones.
    pub(crate) amounts: [f32; 3],
    /// The species of the stand, and how much each sheds.
    pub(crate) stand: &'a [SpeciesLitter<'a>],
    pub(crate) shares: &'a [f64],
    /// The number of the patch's own species.
    pub(crate) own: usize,
    pub(crate) fruit: MaterialId,
    pub(crate) stone: MaterialId,
}

/// A patch of litter about the origin.
pub(crate) fn litter(plan: &LitterPlan<'_>, key: Key) -> Shape {
    let mut shape = Shape::default();
    let SpeciesLitter { look, materials } = plan.stand[plan.own];
    let area_m2 = 0.5 * TAU * plan.radius_m * plan.radius_m;
    let [leaves, wood, stones] = plan.amounts;
    let mut rng = key.rng();
    let rng = &mut rng;
    let deep = 0.2 + 1.6 * plan.depth;
    let count = |per_m2: f32, rng: &mut _| {
        let mean = f64::from(per_m2 * area_m2);
        mean as u32 + u32::from(Draw::chance(rng, mean.fract()))
    };
    let clumps: Vec<Vec2> = (0..4).map(|_| within(plan.radius_m, rng)).collect();
    let leaf_count = count(look.leaves_per_m2 as f32 * deep * leaves, rng).max(1);
    for _ in 0..leaf_count {
        let at = strewn(plan.radius_m, &clumps, rng);
        let of = if rng.chance(OWN) {
            plan.own
        } else {
            rng.weighted(plan.shares).unwrap_or(plan.own)
        };
        let pieces = &plan.stand[of].materials.leaves;
        let pieces = rng.choose(pieces);
        let middle = 1.0 - (at.length() / plan.radius_m).powi(2);
        let level = 0.002 + PILE_M * plan.depth * middle.max(0.0) * rng.unit_f32();
        match &pieces[..] {
            [foot, tip] => leaf(&mut shape, [foot, tip], at.extend(level), rng),
            [mat] => lay_mat(&mut shape, mat, at.extend(level), rng),
            _ => {}
        }
    }
    for _ in 0..count(TWIGS_PER_M2 * wood, rng) {
        // A twig is up to half a metre long.
        let at = within((plan.radius_m - 0.25).max(0.1), rng);
        twig(&mut shape, at, materials.twig, rng);
    }
    if let Some(of) = look.bark {
        for _ in 0..count(of.per_m2 as f32 * wood, rng) {
            let bark = materials.barks[usize::from(rng.chance(LOWER_BARK))];
            strip(&mut shape, plan.radius_m, &of, bark, rng);
        }
    }
    if let Some(of) = look.fruit {
        for _ in 0..count(of.per_m2 as f32 * wood, rng) {
            let at = within(plan.radius_m - 0.06, rng);
            fruit(&mut shape, at, &of, plan.fruit, rng);
        }
    }
    for i in 0..count(STONES_PER_M2 * stones, rng) {
        let at = within(plan.radius_m - 0.08, rng);
        stone(&mut shape, at, plan.stone, key.item(u64::from(i)));
    }
    shape
}

/// A point of a disc.
fn within(radius_m: f32, rng: &mut impl Draw) -> Vec2 {
    around(rng.range_f32(0.0, TAU)).truncate() * (radius_m * rng.unit_f32().sqrt())
}

/// A point where a leaf lies: a third of them in clumps, as wind sweeps them together, and fewer
/// towards the rim, where the next patch has some.
fn strewn(radius_m: f32, clumps: &[Vec2], rng: &mut impl Draw) -> Vec2 {
    for _ in 0..4 {
        let at = if rng.chance(0.34) {
            let middle = *rng.choose(clumps);
            middle + Vec2::new(rng.normal() as f32, rng.normal() as f32) * 0.1
        } else {
            within(radius_m, rng)
        };
        let share = at.length() / radius_m;
        let rim = ((share - 0.72) / 0.28).clamp(0.0, 1.0);
        if share < 0.97 && !rng.chance(f64::from(0.75 * rim)) {
            return at;
        }
    }
    within(0.7 * radius_m, rng)
}

/// A leaf whose lowest corner is at a place: flat and tilted, or bent up or down, and rolled to one
/// side.
fn leaf(shape: &mut Shape, [foot, tip]: [&FoliageCard; 2], at: Vec3, rng: &mut impl Draw) {
    let forward = around(rng.range_f32(0.0, TAU));
    let level = Vec3::new(-forward.y, forward.x, 0.0);
    let roll = rng.normal() as f32 * 0.22;
    let (sin, cos) = (libm::sinf(roll), libm::cosf(roll));
    let across = level * cos + Vec3::Z * sin;
    let up = Vec3::Z * cos - level * sin;
    let flat = (LONG_LEAF_M / (foot.height_m + tip.height_m)).min(1.0);
    let tilt = rng.normal() as f32 * 0.16 * flat;
    let bend = if rng.chance(BENT) {
        rng.range_f32(-0.95, 0.95) * flat
    } else {
        0.0
    };
    let along = |angle: f32| forward * libm::cosf(angle) + up * libm::sinf(angle);
    let scale = rng.range_f32(0.8, 1.12);
    let first = shape.cards.len();
    let (low, high) = (along(tilt - 0.5 * bend), along(tilt + 0.5 * bend));
    let joint = low * (foot.height_m * scale);
    // About its middle.
    let base = Vec3::new(at.x, at.y, 0.0) - joint.with_z(0.0);
    shape.card(foot, base, low, across, scale);
    shape.card(tip, base + joint, high, across, scale);
    rest(shape, first, at.z);
}

/// A mat of needles that lies nearly flat.
fn lay_mat(shape: &mut Shape, mat: &FoliageCard, at: Vec3, rng: &mut impl Draw) {
    let forward = around(rng.range_f32(0.0, TAU));
    let level = Vec3::new(-forward.y, forward.x, 0.0);
    let along = forward + Vec3::Z * (rng.normal() as f32 * 0.035);
    let across = level + Vec3::Z * (rng.normal() as f32 * 0.035);
    let scale = rng.range_f32(0.75, 1.1);
    let first = shape.cards.len();
    let base = Vec3::new(at.x, at.y, 0.0) - along.with_z(0.0) * (0.5 * mat.height_m * scale);
    shape.card(mat, base, along, across, scale);
    rest(shape, first, at.z);
}

/// Lifts the cards from a number on, so that their lowest corner is at a height.
fn rest(shape: &mut Shape, first: usize, height_m: f32) {
    let cards = &mut shape.cards[first..];
    let corners = cards.iter().flat_map(nemoral_scene::Card::corners);
    let lowest = corners.fold(f32::INFINITY, |low, p| low.min(p.z));
    for card in cards {
        card.corner.z += height_m - lowest;
    }
}

/// A piece of bark: a ribbon rolled in along its length, that lies on its edges or on its back.
fn strip(
    shape: &mut Shape,
    radius_m: f32,
    of: &LitterBark,
    material: MaterialId,
    rng: &mut impl Draw,
) {
    const ACROSS: u32 = 4;
    let [least, most] = of.length_m.map(|l| l as f32);
    let share = rng.unit_f32();
    let length = (least + (most - least) * share * share).min(1.6 * radius_m);
    let [narrow, broad] = of.width_m.map(|w| w as f32);
    let width = (narrow + (broad - narrow) * rng.unit_f32()).min(0.6 * length);
    // The angle through which the ribbon is rolled; dry ribbons are nearly tubes.
    let rolled = rng.range_f32(0.3, 1.0) * (0.8 + 2.6 * length).min(3.4);
    let is_on_edges = rng.chance(0.6);
    let curve_m = width / rolled;
    let along = 3 + (length / 0.11) as u32;
    let mut heading = rng.range_f32(0.0, TAU);
    let turn = rng.range_f32(-0.5, 0.5) / along as f32;
    let at = within(radius_m - 0.5 * length, rng);
    let start = at - around(heading).truncate() * (0.5 * length);
    let mut middle = start;
    let first = shape.mesh.positions.len() as u32;
    let shift = Vec2::new(rng.unit_f32(), rng.unit_f32());
    for i in 0..=along {
        let t = i as f32 / along as f32;
        let forward = around(heading);
        let level = Vec3::new(-forward.y, forward.x, 0.0);
        // Torn off: narrower at both ends.
        let taper = (6.0 * t).min(6.0 * (1.0 - t)).clamp(0.25, 1.0);
        for k in 0..=ACROSS {
            let angle = rolled * taper * (k as f32 / ACROSS as f32 - 0.5);
            let (sin, cos) = (libm::sinf(angle), libm::cosf(angle));
            let half = libm::cosf(0.5 * rolled * taper);
            let height = if is_on_edges { cos - half } else { 1.0 - cos };
            let out = if is_on_edges {
                level * sin + Vec3::Z * cos
            } else {
                Vec3::Z * cos - level * sin
            };
            let p = middle.extend(0.003) + level * (curve_m * sin) + Vec3::Z * (curve_m * height);
            let uv = shift + Vec2::new(width * k as f32 / ACROSS as f32, 0.5 * length * t);
            shape.push(p, out, uv);
        }
        middle += forward.truncate() * (length / along as f32);
        heading += turn + rng.range_f32(-0.06, 0.06);
    }
    let columns = ACROSS + 1;
    for i in 0..along {
        for k in 0..ACROSS {
            let a = first + i * columns + k;
            let (b, c, d) = (a + 1, a + columns, a + columns + 1);
            shape.triangle([a, d, b], material);
            shape.triangle([a, c, d], material);
        }
    }
}

/// A stone, a third of it in the ground.
fn stone(shape: &mut Shape, at: Vec2, material: MaterialId, key: Key) {
    let mut rng = key.rng();
    let radius_m = cobble_m(&mut rng);
    let plan = RockPlan {
        radius_m,
        subdivisions: 1 + u32::from(radius_m > 0.08),
        sunk: rng.range_f32(0.25, 0.5),
        roughness: 0.06,
        material,
        tile_m: 0.5,
    };
    shape.add(&rock(&plan, key.item(0)), Vec2::X, at.extend(0.0));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tree::FruitLook;
    use proptest::prelude::*;

    fn image(height_m: f32) -> FoliageCard {
        FoliageCard {
            material: MaterialId(1),
            width_m: 0.6 * height_m,
            height_m,
            opaque_fraction: 0.5,
        }
    }

    /// Two numbers of a range, the smaller one first.
    fn pair(low: f64, high: f64) -> impl Strategy<Value = [f64; 2]> {
        (low..=high, low..=high).prop_map(|(a, b)| [a.min(b), a.max(b)])
    }

    fn look() -> impl Strategy<Value = LitterLook> {
        let fruit = (pair(0.005, 0.4), pair(0.05, 1.5), 0.0..=0.5, 0.0..=20.0).prop_map(
            |(length_m, width_ratio, scales, per_m2)| FruitLook {
                length_m,
                width_ratio,
                scales,
                per_m2,
            },
        );
        let bark = (pair(0.01, 1.4), pair(0.005, 0.2), 0.0..=20.0).prop_map(
            |(length_m, width_m, per_m2)| LitterBark {
                length_m,
                width_m,
                per_m2,
            },
        );
        let (fruit, bark) = (prop::option::of(fruit), prop::option::of(bark));
        (1.0..=200.0, fruit, bark).prop_map(|(leaves_per_m2, fruit, bark)| LitterLook {
            albedo: [0.1; 3],
            leaves_per_m2,
            fruit,
            bark,
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        /// Whatever a species file may say, a patch is of a size that can be kept in memory, lies
        /// about its middle, and neither hangs in the air nor is buried.
        #[test]
        fn patches_of_any_species_lie_on_the_ground(
            look in look(), leaf_m in 0.01_f32..0.6,
            is_mat in any::<bool>(), is_wide in any::<bool>(),
            depth in 0.0_f32..=1.0, leaves in 0.1_f32..=2.0, wood in 0.0_f32..=4.0,
            stones in 0.0_f32..=10.0, item in any::<u64>(),
        ) {
            let half = image(0.5 * leaf_m);
            let pieces = if is_mat { vec![image(leaf_m)] } else { vec![half, half] };
            let materials = LitterMaterials {
                leaves: vec![pieces],
                twig: MaterialId(2),
                barks: [MaterialId(3); 2],
            };
            let stand = [SpeciesLitter { look, materials: &materials }];
            let radius_m = if is_wide { 0.8 } else { 0.42 };
            let plan = LitterPlan {
                radius_m,
                depth,
                amounts: [leaves, wood, stones],
                stand: &stand,
                shares: &[1.0],
                own: 0,
                fruit: MaterialId(4),
                stone: MaterialId(5),
            };
            let shape = litter(&plan, Key::world(3).item(item));
            prop_assert!(shape.cards.len() <= 3000, "{} cards", shape.cards.len());
            let triangles = shape.mesh.triangles.len();
            prop_assert!(triangles <= 80_000, "{triangles} triangles");
            let corners = shape.cards.iter().flat_map(nemoral_scene::Card::corners);
            let longest = leaf_m.max(0.5);
            for p in corners.chain(shape.mesh.positions.iter().copied()) {
                prop_assert!(p.is_finite());
                prop_assert!(p.truncate().length() < radius_m + longest, "{p}");
                prop_assert!(p.z > -0.2 && p.z < 0.6, "{p}");
            }
            let low = shape.cards.iter().flat_map(nemoral_scene::Card::corners);
            prop_assert!(low.fold(f32::INFINITY, |low, p| low.min(p.z)) > 0.0);
        }
    }
}
