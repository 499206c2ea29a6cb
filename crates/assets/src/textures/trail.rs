//! Trail surfaces, on tiles of 2 m: each has a surface, a rut and a strip between ruts.

use glam::{IVec2, Vec2, Vec3};
use nemoral_scene::{Optics, TrailSurfaceKind as Kind};
use nemoral_seed::{Draw, Key};

use super::canvas::{Canvas, Stroke};
use super::fallen::{FallenFoliage, direction};
use super::ground::{Debris, strew};
use super::noise::{fbm, gradient, ridged, scramble, smoothstep, unit, value, warp, worley};
use super::tile::{Texels, Tile};
use crate::lanes::{F32x16, U32x16, Vec2x16, Vec3x16, rgb};

/// Texels along a side.
pub(crate) const TRAIL_TEXELS: usize = 512;
/// Metres along a side.
pub(crate) const TRAIL_M: f32 = 2.0;

/// The tiles of one kind of trail.
pub(crate) struct TrailTiles {
    pub(crate) surface: Tile,
    pub(crate) rut: Tile,
    pub(crate) strip: Tile,
}

/// Mean albedo of the surface.
fn mean_albedo(kind: Kind) -> Vec3 {
    match kind {
        Kind::Gravel => Vec3::new(0.222, 0.206, 0.184),
        Kind::DryEarth => Vec3::new(0.222, 0.165, 0.118),
        Kind::Mud => Vec3::new(0.078, 0.062, 0.048),
        Kind::Grassy => Vec3::new(0.082, 0.106, 0.038),
        Kind::LeafLitter => Vec3::new(0.125, 0.084, 0.058),
        Kind::Needles => Vec3::new(0.150, 0.088, 0.054),
        Kind::Sand => Vec3::new(0.330, 0.268, 0.190),
        Kind::Rock => Vec3::new(0.232, 0.220, 0.195),
    }
}

/// Mean albedo of a rut.
fn rut_albedo(kind: Kind) -> Vec3 {
    match kind {
        Kind::Gravel => Vec3::new(0.180, 0.163, 0.140),
        Kind::DryEarth => Vec3::new(0.185, 0.135, 0.095),
        Kind::Mud => Vec3::new(0.064, 0.051, 0.040),
        Kind::Grassy => Vec3::new(0.110, 0.092, 0.055),
        Kind::LeafLitter => Vec3::new(0.092, 0.065, 0.046),
        Kind::Needles => Vec3::new(0.110, 0.072, 0.048),
        Kind::Sand => Vec3::new(0.270, 0.215, 0.150),
        Kind::Rock => Vec3::new(0.190, 0.172, 0.145),
    }
}

/// Roughness, and the optics at lasers' wavelengths.
pub(crate) fn surface_optics(kind: Kind) -> (f32, Optics) {
    match kind {
        Kind::Gravel => (0.85, Optics::ROCK),
        Kind::DryEarth => (0.95, Optics::DRY_SOIL),
        // Moist and churned: what shines are the puddles.
        Kind::Mud => (0.65, Optics::WET_SOIL),
        Kind::Grassy => (0.80, Optics::GRASS_GROUND),
        Kind::LeafLitter | Kind::Needles => (0.92, Optics::LITTER),
        Kind::Sand => (0.95, Optics::SAND),
        Kind::Rock => (0.80, Optics::ROCK),
    }
}

/// Pieces per m² that lie on the surface.
fn debris(kind: Kind) -> Debris {
    let (leaves, leaf_scale, needles, twigs, grass) = match kind {
        Kind::Gravel => (4.0, 0.7, 10.0, 0.5, 2.0),
        Kind::DryEarth => (7.0, 0.7, 25.0, 1.0, 3.0),
        Kind::Mud => (6.0, 0.8, 8.0, 0.5, 0.0),
        Kind::Grassy => (12.0, 0.8, 20.0, 2.0, 2600.0),
        Kind::LeafLitter => (520.0, 0.72, 160.0, 10.0, 2.0),
        Kind::Needles => (16.0, 0.7, 2200.0, 14.0, 1.0),
        Kind::Sand => (3.0, 0.7, 14.0, 0.5, 0.0),
        Kind::Rock => (7.0, 0.7, 40.0, 0.5, 6.0),
    };
    Debris {
        leaves,
        leaf_scale,
        needles,
        twigs,
        grass,
    }
}

/// The fine soil in a rut.
fn soil(kind: Kind) -> Vec3x16 {
    match kind {
        Kind::Mud => WET_EARTH,
        _ => EARTH,
    }
}

fn base(kind: Kind, p: Vec2x16, seed: u32) -> Texels {
    match kind {
        Kind::Gravel => gravel(p, seed),
        Kind::DryEarth => earth(p, seed),
        Kind::Mud => mud(p, seed),
        Kind::Sand => sand(p, seed),
        Kind::Rock => bedrock(p, seed),
        Kind::Grassy | Kind::LeafLitter | Kind::Needles => {
            let mut t = earth(p, seed);
            t.albedo *= 0.5;
            t
        }
    }
}

/// Bakes surface, rut and strip.
pub(crate) fn bake(kind: Kind, fallen: &FallenFoliage, key: Key) -> TrailTiles {
    let seed = key.to_u64() as u32;
    let base = Tile::bake(TRAIL_TEXELS, TRAIL_TEXELS, |p| base(kind, p, seed));
    let mut surface = strew(base.clone(), TRAIL_M, debris(kind), fallen, key.item(0));
    surface.darken_hollows(4, 0.010, 0.9);
    let surface = surface.with_luminance_of(mean_albedo(kind));
    // Ruts: what lay on top is pressed into fine soil.
    let fine_soil = soil(kind);
    let mut rut = surface.recolour(|p, t| {
        let pressed = smoothstep(-0.35, 0.25, fbm(p, IVec2::splat(9), 4, 0.55, seed ^ 0x301));
        let soil = fine_soil * (0.80 + 0.20 * gradient(p, IVec2::splat(110), seed ^ 0x302));
        // The print of tyre blocks, half worn away.
        t.albedo.lerp(soil, 0.65 * pressed)
            * (1.0 + 0.05 * gradient(p, IVec2::splat(30), seed ^ 0x303))
    });
    for t in &mut rut.texels {
        t.height *= 0.4;
    }
    let rut = rut.with_luminance_of(rut_albedo(kind));
    TrailTiles {
        strip: strip(kind, &surface, fallen, (seed, key.item(1))),
        surface,
        rut,
    }
}

/// The strip between ruts: nobody drives there, so fallen leaves rot to humus, and seedlings of
/// grass stand between the mats that are plants in relief.
fn strip(kind: Kind, surface: &Tile, fallen: &FallenFoliage, (seed, key): (u32, Key)) -> Tile {
    let green = match kind {
        Kind::Grassy => 1.0,
        Kind::Gravel | Kind::DryEarth | Kind::Mud => 0.8,
        Kind::Sand => 0.5,
        Kind::LeafLitter | Kind::Needles | Kind::Rock => 0.25,
    };
    let ground = surface.recolour(|p, t| {
        let rotten = smoothstep(-0.5, 0.4, fbm(p, IVec2::splat(5), 4, 0.55, seed ^ 0x401));
        let overgrown = smoothstep(-0.1, 0.45, fbm(p, IVec2::splat(4), 4, 0.6, seed ^ 0x402));
        let humus = t.albedo * rgb(0.70, 0.66, 0.62);
        let sprouts = rgb(0.078, 0.096, 0.036) * (0.8 + 0.4 * value(p, SPROUTS, seed ^ 0x403));
        let soil = t.albedo.lerp(humus, 0.5 + 0.5 * rotten);
        soil.lerp(sprouts, 0.55 * green * overgrown)
    });
    let litter = Debris {
        leaves: 24.0,
        leaf_scale: 0.7,
        needles: 60.0,
        twigs: 4.0,
        grass: 0.0,
    };
    let litter = match kind {
        Kind::Grassy => Debris {
            leaves: 0.0,
            needles: 0.0,
            ..litter
        },
        Kind::LeafLitter => Debris {
            leaves: 260.0,
            ..litter
        },
        Kind::Needles => Debris {
            needles: 900.0,
            ..litter
        },
        _ => litter,
    };
    let ground = strew(ground, TRAIL_M, litter, fallen, key.item(0));
    let mut strip = seedlings_of_grass(ground, 260.0 * green, key.item(1));
    strip.darken_hollows(4, 0.02, 0.6);
    strip
}

/// The grain of what sprouts, cells along a side.
const SPROUTS: IVec2 = IVec2::splat(170);

/// Small tufts of fine blades, seen from above: some `per_m2`, in groups.
fn seedlings_of_grass(tile: Tile, per_m2: f32, key: Key) -> Tile {
    let mut rng = key.rng();
    let mut canvas = Canvas::over(tile, Vec2::splat(TRAIL_M));
    let mut middle = Vec2::ZERO;
    for _ in 0..(per_m2 * TRAIL_M * TRAIL_M) as u32 {
        if rng.chance(0.15) {
            middle = Vec2::new(rng.range_f32(0.0, TRAIL_M), rng.range_f32(0.0, TRAIL_M));
        }
        let apart = 0.14 * rng.unit_f32().sqrt();
        let foot = middle + apart * direction(&mut rng);
        let dry = rng.unit_f32();
        let colour = GRASS.lerp(CURED_GRASS, dry * dry * dry) * rng.range_f32(0.65, 1.1);
        for _ in 0..5 + rng.below(6) {
            let along = direction(&mut rng) * rng.range_f32(0.008, 0.034);
            let bend = along.perp() * rng.range_f32(-0.3, 0.3);
            canvas.stroke(&Stroke {
                points: Stroke::bowed(foot, along, bend),
                width_m: [0.003, 0.001],
                colour: [colour * 0.5, colour],
                level: 0.015,
            });
        }
    }
    canvas.into_tile().0
}

/// Colours of living blades, and of dead ones.
const GRASS: Vec3 = Vec3::new(0.085, 0.125, 0.036);
const CURED_GRASS: Vec3 = Vec3::new(0.22, 0.17, 0.085);

/// Rounded stones of one size: (height of the dome, hash), 0 between them.
fn stones(p: Vec2x16, per_side: i32, share: f32, seed: u32) -> (F32x16, U32x16) {
    let w = worley(p, IVec2::splat(per_side), 0.9, seed);
    let radius = 0.34 + 0.26 * unit(w.id ^ 0x3333);
    let flat = 0.75 * w.f1 + 0.25 * (w.offset.x.abs() + w.offset.y.abs());
    let inside = (1.0 - flat / radius.min(0.5 * w.f2 + 0.1)).max(0.0);
    let there = unit(w.id).lt(share) & inside.gt(0.0);
    let none = U32x16::splat(0);
    (
        there.select(inside.sqrt(), 0.0),
        there.select_word(w.id, none),
    )
}

fn gravel(p: Vec2x16, seed: u32) -> Texels {
    let q = warp(p, IVec2::splat(12), (0.008, 0.008), seed);
    let mut fines = earth(p, seed ^ 0x100);
    fines.albedo *= 0.85;
    let mut best = fines;
    for (k, (per_side, share, height)) in [(170, 0.95, 0.005), (84, 0.75, 0.011), (44, 0.32, 0.020)]
        .into_iter()
        .enumerate()
    {
        let (dome, id) = stones(q, per_side, share, seed ^ (k as u32 * 77));
        let top = height * dome;
        let tone = 0.6 + 0.75 * unit(id ^ 0x99);
        let hue = unit(id ^ 0x4242);
        let grey = rgb(0.215, 0.205, 0.190).lerp(rgb(0.235, 0.195, 0.150), hue * hue);
        let colour = grey * tone * (0.7 + 0.3 * dome);
        let covers = dome.gt(0.0) & top.gt(best.height);
        best = Texels {
            albedo: covers.select_colour(colour, best.albedo),
            height: covers.select(top, best.height),
        };
    }
    best
}

/// Dry, trodden soil.
const EARTH: Vec3x16 = rgb(0.225, 0.165, 0.115);
/// The same, wet.
const WET_EARTH: Vec3x16 = rgb(0.100, 0.077, 0.057);

/// Trodden soil with crumbs and small stones.
fn earth(p: Vec2x16, seed: u32) -> Texels {
    let broad = fbm(p, IVec2::splat(4), 4, 0.55, seed);
    let crumbs = fbm(p, IVec2::splat(60), 3, 0.65, seed ^ 0x10);
    let cracks = smoothstep(0.90, 0.99, ridged(p, IVec2::splat(11), 2, 0.5, seed ^ 0x20));
    let (dome, id) = stones(p, 90, 0.09, seed ^ 0x30);
    let soil = EARTH * (1.0 + 0.25 * broad + 0.22 * crumbs) * (1.0 - 0.3 * cracks);
    let pebble = rgb(0.22, 0.20, 0.175) * (0.7 + 0.6 * unit(id ^ 1));
    Texels {
        albedo: soil.lerp(pebble, dome.gt(0.0).indicator() * 0.8),
        height: 0.003 * crumbs + 0.003 * broad + 0.010 * dome - 0.003 * cracks,
    }
}

fn mud(p: Vec2x16, seed: u32) -> Texels {
    let q = warp(p, IVec2::splat(5), (0.05, 0.05), seed);
    let relief = fbm(q, IVec2::splat(5), 5, 0.52, seed ^ 0x10);
    let clods = worley(q, IVec2::splat(26), 1.0, seed ^ 0x20);
    let fine = gradient(p, IVec2::splat(120), seed ^ 0x30);
    let water = smoothstep(-0.20, -0.30, relief);
    let wet = WET_EARTH * (1.0 + 0.35 * relief + 0.10 * fine + 0.25 * (0.5 - clods.f1));
    // What stands highest dries first.
    let crust = rgb(0.165, 0.130, 0.098) * (1.0 + 0.15 * fine);
    let dry = 0.8 * smoothstep(0.08, 0.38, relief + 0.12 * fine);
    // A film of turbid water: smooth and a little greyer.
    let film = rgb(0.080, 0.066, 0.053);
    Texels {
        albedo: wet.lerp(crust, dry).lerp(film, water),
        height: (0.03 * relief + 0.008 * (0.6 - clods.f1)).max(-0.008)
            + 0.001 * fine * (1.0 - water),
    }
}

fn sand(p: Vec2x16, seed: u32) -> Texels {
    let q = warp(p, IVec2::splat(3), (0.06, 0.06), seed);
    let dunes = fbm(q, IVec2::splat(6), 3, 0.5, seed ^ 0x10);
    let ripples = fbm(q, IVec2::new(10, 22), 2, 0.5, seed ^ 0x20);
    let grains = value(p, IVec2::splat(256), seed ^ 0x30);
    let (dome, id) = stones(p, 100, 0.02, seed ^ 0x40);
    let tone = 1.0 + 0.12 * dunes + 0.10 * ripples + 0.16 * (grains - 0.5);
    let stone = rgb(0.24, 0.22, 0.19) * (0.6 + 0.7 * unit(id ^ 1));
    Texels {
        albedo: (rgb(0.34, 0.275, 0.195) * tone).lerp(stone, dome.gt(0.0).indicator()),
        height: 0.010 * dunes + 0.006 * ripples + 0.008 * dome,
    }
}

/// Worn rock: humps and steps, a few joints, soil in the hollows.
fn bedrock(p: Vec2x16, seed: u32) -> Texels {
    let q = warp(p, IVec2::splat(3), (0.10, 0.10), seed);
    let relief = fbm(q, IVec2::new(4, 6), 6, 0.55, seed ^ 0x20);
    // Steps where beds have broken away.
    let beds = 3.5 * fbm(q, IVec2::new(3, 5), 3, 0.5, seed ^ 0x21);
    let step = beds - beds.floor();
    let bed = unit(scramble(beds.floor().to_u32() ^ seed));
    let edge = 1.0 - smoothstep(0.0, 0.10, step);
    let crack = smoothstep(
        0.955,
        0.995,
        ridged(q, IVec2::new(3, 2), 2, 0.35, seed ^ 0x22),
    );
    let grains = value(p, IVec2::splat(220), seed ^ 0x30);
    let rock = rgb(0.255, 0.235, 0.205)
        * (0.85 + 0.3 * bed)
        * (1.0 + 0.35 * relief + 0.25 * (grains - 0.5))
        * (1.0 - 0.35 * edge);
    let soil = earth(p, seed ^ 0x40).albedo * 0.65;
    let hollow = smoothstep(
        -0.10,
        -0.30,
        relief + 0.12 * gradient(p, IVec2::splat(28), seed ^ 0x41),
    );
    Texels {
        albedo: rock.lerp(soil, (0.9 * hollow).max(0.8 * crack)),
        height: 0.018 * relief + 0.006 * smoothstep(0.0, 0.10, step) - 0.02 * crack,
    }
}
