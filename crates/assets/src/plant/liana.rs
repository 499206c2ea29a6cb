//! Lianas: honeysuckle that winds up a stem, and clematis that hangs from a crown.

use std::f32::consts::TAU;

use glam::{IVec2, Vec2, Vec3};
use nemoral_scene::{Card, MaterialId, Prototype};
use nemoral_seed::{Draw, Rng};

use super::climber::Bark;
use super::shape::{Shape, around};
use crate::materials::LianaMaterials;
use crate::textures::noise::at::fbm;
use crate::tree::FoliageCard;

/// The angle on either side of its middle that a veil of clematis covers, radians.
const VEIL_RAD: f32 = 1.15;
/// The highest that the lowest leaves of a crown may be for clematis to hang there, metres; it
/// climbs to twice that.
const HIGHEST_M: f32 = 14.0;
/// The share of a veil's area that leaves must be drawn over for it to look closed.
const OVERLAP: f32 = 1.1;
/// The least and the most cards of a veil.
const VEIL_CARDS: [f32; 2] = [120.0, 650.0];

/// Honeysuckle that winds up to `top_m`, leafy from a quarter of that, with shoots that hang from
/// its upper half. It turns clockwise as it climbs, seen from above (Darwin 1865, On the movements
/// and habits of climbing plants, lists *Lonicera* among those that follow the sun).
pub(crate) fn honeysuckle(
    bark: &Bark,
    top_m: f32,
    of: &LianaMaterials,
    rng: &mut impl Rng,
) -> Shape {
    let mut shape = Shape::default();
    for _ in 0..1 + u32::from(rng.chance(0.4)) {
        let top_m = top_m * rng.range_f32(0.75, 1.0);
        let foot_radius_m = rng.range_f32(0.006, 0.011);
        let radius_at = |z: f32| foot_radius_m * (1.0 - 0.65 * z / top_m);
        let path = winding(bark, top_m, &radius_at, rng);
        if path.len() < 8 {
            continue;
        }
        let points: Vec<Vec3> = path.iter().map(|(at, _)| *at).collect();
        let radii: Vec<f32> = points.iter().map(|p| radius_at(p.z.max(0.0))).collect();
        shape.tube(&points, &radii, 5, of.twiner);
        leaves_along(&mut shape, &path, top_m, of, rng);
    }
    shape
}

/// A line around a stem, from within the ground, with the way out of the bark at each point.
fn winding(
    bark: &Bark,
    top_m: f32,
    radius_at: &impl Fn(f32) -> f32,
    rng: &mut impl Rng,
) -> Vec<(Vec3, Vec3)> {
    const STEPS_PER_TURN: f32 = 11.0;
    let start = rng.range_f32(0.0, TAU);
    let rise_m = rng.range_f32(0.35, 0.75);
    let loose = rng.range_f32(0.0, TAU);
    let mut path: Vec<(Vec3, Vec3)> = Vec::new();
    let mut z = 0.02;
    while z < top_m {
        let turns = z / rise_m;
        let angle = start - TAU * turns + 0.3 * libm::sinf(0.8 * TAU * turns + loose);
        let Some(at) = bark.cross_section(z).and_then(|s| s.surface(angle)) else {
            break;
        };
        let out = around(angle);
        path.push((at.extend(z) + out * (0.8 * radius_at(z)), out));
        z += rise_m / STEPS_PER_TURN;
    }
    if let Some(&(at, out)) = path.first() {
        path.insert(0, (at + out * 0.10 - Vec3::Z * 0.30, out));
    }
    path
}

fn leaves_along(
    shape: &mut Shape,
    path: &[(Vec3, Vec3)],
    top_m: f32,
    of: &LianaMaterials,
    rng: &mut impl Rng,
) {
    for &(at, out) in path {
        let share = at.z / top_m;
        let leafy = ((share - 0.15) / 0.45).clamp(0.0, 1.0);
        for _ in 0..2 {
            if !rng.chance(f64::from(leafy)) {
                continue;
            }
            let across = out.cross(Vec3::Z) * rng.range_f32(-1.0, 1.0);
            let up = Vec3::Z * rng.range_f32(-0.7, 0.6);
            let along = out * rng.range_f32(0.35, 0.9) + across + up;
            let flat = out.cross(along) + Vec3::Z * rng.range_f32(-0.3, 0.3);
            let image = rng.choose(&of.honeysuckle);
            shape.card(image, at, along, flat, rng.range_f32(0.65, 1.1));
        }
        if share > 0.45 && rng.chance(0.26) {
            let length_m = rng.range_f32(0.3, 1.1).min(0.8 * at.z);
            let from = at + out * 0.02;
            let hanging = (out * rng.range_f32(0.10, 0.28), length_m);
            strand(shape, from, hanging, (&of.honeysuckle, of.twiner), rng);
        }
    }
}

/// A thin stem that reaches out by `out` and then hangs `length_m`, with leaves all along.
fn strand(
    shape: &mut Shape,
    from: Vec3,
    (out, length_m): (Vec3, f32),
    (leaves, wood): (&[FoliageCard], MaterialId),
    rng: &mut impl Rng,
) {
    const STEP_M: f32 = 0.10;
    let steps = (length_m / STEP_M).ceil().max(2.0) as usize;
    let sway = [rng.range_f32(0.0, TAU), rng.range_f32(0.0, TAU)];
    let points: Vec<Vec3> = (0..=steps)
        .map(|i| {
            let t = i as f32 / steps as f32;
            let wave = |k: usize| 0.05 * length_m.min(1.0) * libm::sinf(4.0 * t + sway[k]);
            // At first outwards, then down.
            let reach = out * (1.0 - (1.0 - t) * (1.0 - t));
            let side = Vec3::new(wave(0) - 0.05 * libm::sinf(sway[0]), wave(1), 0.0) * t;
            from + reach + side - Vec3::Z * (length_m * t * (0.4 + 0.6 * t))
        })
        .collect();
    let radii: Vec<f32> = (0..=steps)
        .map(|i| 0.0026 - 0.0012 * i as f32 / steps as f32)
        .collect();
    shape.tube(&points, &radii, 3, wood);
    for &at in points.iter().skip(1) {
        let way = around(rng.range_f32(0.0, TAU));
        let along = way * rng.range_f32(0.3, 0.8) - Vec3::Z * rng.range_f32(0.3, 1.0);
        let across = way.cross(Vec3::Z) + Vec3::Z * rng.range_f32(-0.4, 0.4);
        let image = rng.choose(leaves);
        shape.card(image, at, along, across, rng.range_f32(0.5, 0.9));
    }
}

/// The leaves of a crown that clematis has reached, seen from the stem.
struct ClimbedCrown {
    /// Outer leaves, the lowest first.
    outer: Vec<Vec3>,
    /// Leaves nearer to the stem, the lowest first.
    inner: Vec<Vec3>,
    /// The heights of its lowest and highest leaves, metres.
    range_m: [f32; 2],
    /// The area that the outer ones are spread over, m².
    area_m2: f32,
}

impl ClimbedCrown {
    /// The leaves on the side where the crown reaches lowest and farthest.
    fn of(tree: &Prototype, rng: &mut impl Rng) -> Option<Self> {
        const SLICE_M: f32 = 0.5;
        let middle = |c: &Card| c.corner + 0.5 * c.edge_u + 0.5 * c.edge_v;
        let mut twigs: Vec<Vec3> = tree.cards().iter().map(middle).collect();
        twigs.sort_by(|a, b| a.z.total_cmp(&b.z));
        let low = twigs.get(twigs.len() / 20)?.z;
        let high = twigs.last()?.z;
        if twigs.len() < 60 || low > HIGHEST_M {
            return None;
        }
        let lowest = &twigs[..twigs.len() / 4];
        let towards: Vec2 = lowest.iter().map(|p| p.truncate()).sum();
        let side = libm::atan2f(towards.y, towards.x) + rng.range_f32(-0.5, 0.5);
        let top = (low + (high - low) * rng.range_f32(0.35, 0.7)).min(low + 6.0);
        let facing = around(side);
        let cos = libm::cosf(VEIL_RAD);
        twigs.retain(|p| {
            let flat = p.truncate();
            (low..top).contains(&p.z) && flat.dot(facing.truncate()) > cos * flat.length()
        });
        let slice = |z: f32| ((z - low) / SLICE_M) as usize;
        let mut widest = vec![0.0_f32; slice(top) + 1];
        for p in &twigs {
            let of = &mut widest[slice(p.z)];
            *of = of.max(p.truncate().length());
        }
        let share = |p: &Vec3| p.truncate().length() / widest[slice(p.z)].max(0.1);
        let outer: Vec<Vec3> = twigs.iter().copied().filter(|p| share(p) > 0.66).collect();
        let inner = twigs.iter().copied().filter(|p| share(p) < 0.55).collect();
        let arcs = widest.iter().map(|r| 2.0 * VEIL_RAD * r * SLICE_M);
        (outer.len() > 20).then(|| Self {
            area_m2: arcs.sum(),
            range_m: [low, top],
            outer,
            inner,
        })
    }
}

/// Clematis in a crown: a veil over its outer leaves on one side, shoots that hang from the veil's
/// lower half, and ropes that hang from within to the ground. Nothing where leaves begin too high.
pub(crate) fn clematis(
    tree: &Prototype,
    foot_radius_m: f32,
    of: &LianaMaterials,
    rng: &mut impl Rng,
) -> Shape {
    let mut shape = Shape::default();
    let Some(crown) = ClimbedCrown::of(tree, rng) else {
        return shape;
    };
    veil(&mut shape, &crown, of, rng);
    let [low, top] = crown.range_m;
    let lower = crown
        .outer
        .partition_point(|p| p.z < low + 0.5 * (top - low));
    for _ in 0..10 + rng.below(12) {
        let Some(&from) = crown.outer.get(rng.below(lower.max(1) as u32) as usize) else {
            break;
        };
        let long = 0.4 + 2.2 * rng.unit_f32() * rng.unit_f32();
        let out = from.truncate().extend(0.0).normalize_or(Vec3::X) * rng.range_f32(0.0, 0.2);
        let hanging = (out, long.min(from.z - 0.2).max(0.2));
        strand(&mut shape, from, hanging, (&of.clematis, of.rope), rng);
    }
    let bearers = if crown.inner.len() < 4 {
        &crown.outer
    } else {
        &crown.inner
    };
    let lowest = (bearers.len() / 3).max(1) as u32;
    for _ in 0..2 + rng.below(4) {
        rope(
            &mut shape,
            bearers[rng.below(lowest) as usize],
            foot_radius_m,
            of,
            rng,
        );
    }
    shape
}

/// Shoots that lie over the outer leaves, in tongues.
fn veil(shape: &mut Shape, crown: &ClimbedCrown, of: &LianaMaterials, rng: &mut impl Rng) {
    let image = &of.clematis[0];
    let card_m2 = image.width_m * image.height_m * image.opaque_fraction;
    let count = (OVERLAP * crown.area_m2 / card_m2).clamp(VEIL_CARDS[0], VEIL_CARDS[1]);
    let seed = rng.below(u32::MAX);
    let [low, top] = crown.range_m;
    for _ in 0..count as u32 {
        let at = *rng.choose(&crown.outer);
        let turn = (libm::atan2f(at.y, at.x) / TAU).rem_euclid(1.0);
        let p = Vec2::new(turn, (0.11 * at.z).rem_euclid(1.0));
        let tongues = fbm(p, IVec2::new(9, 5), 3, 0.55, seed);
        // Thickest at half its height: it creeps upwards, and its foot is in the shade.
        let share = (at.z - low) / (top - low).max(0.1);
        let dense = 0.75 + tongues - 1.1 * (share - 0.45).abs();
        if !rng.chance(f64::from(dense.clamp(0.0, 1.0))) {
            continue;
        }
        let out = at.truncate().extend(0.0).normalize_or(Vec3::X);
        let across = out.cross(Vec3::Z) * rng.range_f32(-0.8, 0.8);
        let along = out * rng.range_f32(0.1, 0.6) - Vec3::Z * rng.range_f32(0.1, 0.9) + across;
        let foot = at + out * rng.range_f32(-0.05, 0.12) + Vec3::Z * rng.range_f32(0.0, 0.12);
        let flat = out.cross(Vec3::Z) + Vec3::Z * rng.range_f32(-0.5, 0.5);
        shape.card(
            rng.choose(&of.clematis),
            foot,
            along,
            flat,
            rng.range_f32(0.75, 1.15),
        );
    }
}

/// A stem as thick as a rope that hangs from a crown into the ground, alone or with another wound
/// around it.
fn rope(
    shape: &mut Shape,
    bearer: Vec3,
    foot_radius_m: f32,
    of: &LianaMaterials,
    rng: &mut impl Rng,
) {
    const POINTS: u32 = 26;
    const TURNS_PER_M: f32 = 0.5;
    let shares = || (0..POINTS).map(|i| i as f32 / (POINTS - 1) as f32);
    let flat = bearer.truncate();
    let away = foot_radius_m + rng.range_f32(0.15, 0.7);
    let turn = libm::atan2f(flat.y, flat.x) + rng.range_f32(-0.7, 0.7);
    let foot = around(turn) * away;
    let lean = Vec3::new(rng.range_f32(-0.9, 0.9), rng.range_f32(-0.9, 0.9), 0.0);
    let control = [
        foot - Vec3::Z * 0.5,
        foot + lean + Vec3::Z * (0.3 * bearer.z),
        (foot + lean)
            .truncate()
            .lerp(flat, 0.45)
            .extend(0.72 * bearer.z),
        bearer,
    ];
    let wave = [rng.range_f32(0.0, TAU), rng.range_f32(0.0, TAU)];
    let middle = |t: f32| {
        let s = 1.0 - t;
        let [a, b, c, d] = control;
        let sway = Vec3::new(
            libm::sinf(7.0 * t + wave[0]) - libm::sinf(wave[0]),
            libm::sinf(6.0 * t + wave[1]) - libm::sinf(wave[1]),
            0.0,
        );
        a * (s * s * s)
            + b * (3.0 * s * s * t)
            + c * (3.0 * s * t * t)
            + d * (t * t * t)
            + sway * (0.5 * t * s)
    };
    let radius_m = 0.009 + 0.020 * rng.unit_f32() * rng.unit_f32();
    let radii: Vec<f32> = shares().map(|t| radius_m * (1.0 - 0.55 * t)).collect();
    // Two that are wound around each other lie on opposite sides of the middle.
    let (stems, off_m) = if rng.chance(0.35) {
        (2, 0.9 * radius_m)
    } else {
        (1, 0.0)
    };
    let turn = rng.range_f32(0.0, TAU);
    for stem in 0..stems {
        let phase = turn + TAU * stem as f32 / stems as f32;
        let winding = TURNS_PER_M * bearer.z * TAU;
        let points: Vec<Vec3> = shares()
            .map(|t| middle(t) + around(phase + winding * t) * off_m)
            .collect();
        shape.tube(&points, &radii, 6, of.rope);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant::climber::tests::leaning_stem;
    use nemoral_seed::Key;

    #[test]
    fn honeysuckle_winds_clockwise_on_the_bark() {
        let lean = |z: f32| Vec2::new(0.1 * z, 0.05 * z);
        let bark = leaning_stem(0.12, 6.0, lean);
        for seed in 0..20 {
            let mut rng = Key::world(seed).rng();
            let path = winding(&bark, 5.0, &|_| 0.01, &mut rng);
            assert!(path[0].0.z < -0.2 && path[path.len() - 1].0.z > 4.8);
            // Of a stem 1 cm thick whose middle is 8 mm off the bark, a part is in it.
            for (at, _) in &path[1..] {
                let away = (at.truncate() - lean(at.z)).length() - 0.12;
                assert!((0.006..0.010).contains(&away), "{away}");
            }
            let turned: f32 = path[1..]
                .windows(2)
                .map(|pair| {
                    let [a, b] = [0, 1].map(|i| pair[i].0.truncate() - lean(pair[i].0.z));
                    a.perp_dot(b).atan2(a.dot(b))
                })
                .sum();
            // A turn in 0.35 to 0.75 m, seen from above.
            assert!((-15.0 * TAU..-6.0 * TAU).contains(&turned), "{turned}");
        }
    }
}
