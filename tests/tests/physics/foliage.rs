//! Rays through foliage obey physics: gap fractions and free paths of random leaves have their
//! closed forms, and each card of the library lets through what its mask leaves open.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use nemoral_assets::{AssetParams, Library, Species, StandSpecies};
use nemoral_raycast::RayScene;
use nemoral_scene::glam::{DVec3, Vec3};
use nemoral_scene::{Card, MaterialId, Mesh, Prototype, Ray, RayCaster};
use nemoral_seed::{Draw, Key, PhiloxRng};
use nemoral_tests::foliage::{
    Inclination, LeafKind, any_direction, gap_fraction, kolmogorov_smirnov, periodic,
};
use rayon::prelude::*;

/// The zenith angle at which the projection of leaves hardly depends on their inclination.
const HINGE_DEG: f64 = 57.5;
const SEEDS: u64 = 8;
const RAYS: usize = 8_000;

fn ray(origin: DVec3, direction: DVec3) -> Ray {
    Ray::new(origin.as_vec3(), direction.as_vec3())
}

/// The gap fraction of a slab along a zenith angle, as the mean over all seeds.
fn slab(leaf: &LeafKind, inclination: Inclination, index: f64, zenith_deg: f64) -> f64 {
    const SIDE_M: f64 = 6.0;
    const HEIGHT_M: f64 = 3.0;
    let leaves = (index * SIDE_M * SIDE_M / leaf.area_m2()).round() as usize;
    let (sin, cos) = zenith_deg.to_radians().sin_cos();
    let gaps = (0..SEEDS).into_par_iter().map(|seed| {
        let mut rng = Key::world(seed).rng();
        let size = DVec3::new(SIDE_M, SIDE_M, HEIGHT_M);
        let tile = leaf.tile(size, leaves, inclination, &mut rng);
        // A ray that leaves its tile sideways enters a copy of it.
        let forest = periodic(&tile, SIDE_M, [1, 1, 0]);
        let rays: Vec<Ray> = (0..RAYS)
            .map(|_| {
                let azimuth = rng.range_f64(0.0, TAU);
                let down = DVec3::new(sin * azimuth.cos(), sin * azimuth.sin(), -cos);
                let [x, y] = [0; 2].map(|_| SIDE_M * rng.unit_f64());
                let middle = DVec3::new(x, y, 0.5 * HEIGHT_M);
                ray(middle - down * (0.5 * HEIGHT_M + 1.0) / cos, down)
            })
            .collect();
        gap_fraction(&forest, &rays)
    });
    gaps.sum::<f64>() / SEEDS as f64
}

/// P = exp(−G · LAI / cos θ), at nadir, and at the hinge, where it is the same for all
/// inclinations.
#[test]
fn the_gap_fraction_of_a_slab_is_beers() {
    use Inclination::{Horizontal, Spherical, Vertical};
    let leaf = LeafKind::new(0.1);
    for (inclination, index, zenith_deg, table) in [
        (Spherical, 1.0, 0.0, 0.6065),
        (Spherical, 3.0, 0.0, 0.2231),
        (Horizontal, 1.0, 0.0, 0.3679),
        (Spherical, 1.0, HINGE_DEG, 0.3943),
        (Spherical, 2.0, HINGE_DEG, 0.1555),
        (Horizontal, 2.0, HINGE_DEG, 0.1353),
        (Vertical, 2.0, HINGE_DEG, 0.1353),
    ] {
        let zenith = f64::to_radians(zenith_deg);
        let g = inclination.projection(zenith);
        let law = (-g * index / zenith.cos()).exp();
        assert!((law - table).abs() < 0.001, "{law} {table}");
        let gap = slab(&leaf, inclination, index, zenith_deg);
        println!("{inclination:?} LAI {index} at {zenith_deg}°: {gap:.4}, law {law:.4}");
        assert!(
            (gap - law).abs() <= 0.01,
            "{inclination:?} LAI {index} at {zenith_deg}°: {gap} {law}"
        );
        if inclination == Spherical {
            // The test would detect leaves without their holes, and square ones.
            let filled = (-g * index / leaf.opaque() / zenith.cos()).exp();
            assert!((gap - filled).abs() > 0.02, "{gap} {filled}");
        }
    }
}

/// P = 2 [1 − (1 + k) e^−k] / k², k = 2 G u R, for parallel rays over a sphere's disc.
#[test]
fn the_gap_fraction_of_a_round_crown_is_known() {
    const RADIUS_M: f64 = 2.0;
    let leaf = LeafKind::new(0.08);
    for (index, table) in [(1.0, 0.6164), (3.0, 0.2597)] {
        let k = 0.75 * index;
        let law = 2.0 * (1.0 - (1.0 + k) * f64::exp(-k)) / (k * k);
        // The index is leaf area over the area of the crown's disc.
        let leaves = (index * PI * RADIUS_M * RADIUS_M / leaf.area_m2()).round() as usize;
        let gaps = (0..SEEDS).into_par_iter().map(|seed| {
            let mut rng = Key::world(seed).rng();
            let in_ball =
                |rng: &mut PhiloxRng| any_direction(rng) * RADIUS_M * rng.unit_f64().cbrt();
            let crown = leaf.group(leaves, Inclination::Spherical, in_ball, &mut rng);
            let forest = RayScene::new(vec![(Vec3::ZERO, crown)]);
            // Each seed has its own direction.
            let ahead = any_direction(&mut rng);
            let (a, b) = ahead.any_orthonormal_pair();
            let rays: Vec<Ray> = (0..RAYS)
                .map(|_| {
                    let (sin, cos) = rng.range_f64(0.0, TAU).sin_cos();
                    let off = (a * cos + b * sin) * RADIUS_M * rng.unit_f64().sqrt();
                    ray(off - 5.0 * ahead, ahead)
                })
                .collect();
            gap_fraction(&forest, &rays)
        });
        let gap = gaps.sum::<f64>() / SEEDS as f64;
        println!("crown LAI {index}: {gap:.4}, law {law:.4}, table {table}");
        assert!((law - table).abs() < 0.0001, "{law} {table}");
        assert!((gap - law).abs() <= 0.01, "LAI {index}: {gap} {law}");
    }
}

/// Distances from random places in random directions to the first leaf, in a block without edges
/// whose leaves fill it, or are all in a quarter of each tile.
fn first_hits_m(leaf: &LeafKind, density: f64, clumped: bool) -> Vec<f64> {
    const SIDE_M: f64 = 5.0;
    let leaves = (density * SIDE_M.powi(3) / leaf.area_m2()).round() as usize;
    let filled = if clumped { 0.5 } else { 1.0 } * SIDE_M;
    let of_seed = |seed| {
        let mut rng = Key::world(seed).rng();
        let size = DVec3::new(filled, filled, SIDE_M);
        let tile = leaf.tile(size, leaves, Inclination::Spherical, &mut rng);
        let block = periodic(&tile, SIDE_M, [4; 3]);
        let first_hit_m = |_| {
            let start = DVec3::from_array([0; 3].map(|_| SIDE_M * rng.unit_f64()));
            let hit = block.closest_hit(&ray(start, any_direction(&mut rng)));
            hit.map_or(f64::INFINITY, |h| f64::from(h.surface.distance_m))
        };
        (0..400).map(first_hit_m).collect::<Vec<_>>()
    };
    (0..SEEDS).into_par_iter().flat_map_iter(of_seed).collect()
}

/// The free path is exponential with the mean 1 / (G u), but not where whole cards count as leaves,
/// or where leaves are clumped.
#[test]
fn first_hits_in_random_foliage_are_exponential() {
    const DENSITY: f64 = 1.0;
    let leaf = LeafKind::new(0.1);
    let exponential = |rate: f64| move |m: f64| 1.0 - (-rate * m).exp();
    let mut random = first_hits_m(&leaf, DENSITY, false);
    let mean = random.iter().sum::<f64>() / random.len() as f64;
    let p = kolmogorov_smirnov(&mut random, exponential(0.5 * DENSITY));
    println!("{} first hits, mean {mean:.3} m, p = {p:.3}", random.len());
    assert!(p > 0.01, "p = {p}, mean {mean} m");

    let as_cards = exponential(0.5 * DENSITY / leaf.opaque());
    assert!(kolmogorov_smirnov(&mut random, as_cards) < 1e-6);
    let mut clumped = first_hits_m(&leaf, DENSITY, true);
    let p = kolmogorov_smirnov(&mut clumped, exponential(0.5 * DENSITY));
    assert!(p < 1e-6, "clumped: p = {p}");
}

/// Rays pass a card of each masked material of the library where it is not opaque.
#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn every_card_of_the_library_lets_through_what_its_mask_does_not_stop() {
    const RAYS: u32 = 20_000;
    let of = |species| StandSpecies {
        species,
        dbh_mean_m: 0.2,
        trees_per_ha: 300.0,
    };
    let params = AssetParams {
        species: Species::all().into_iter().map(of).collect(),
        individuals_per_species: 1,
        textures: false,
        ..AssetParams::default()
    };
    let library = Library::grow(&params, Key::world(3)).expect("valid");
    let masked: Vec<_> = (0_u16..)
        .zip(library.materials.materials())
        .filter_map(|(id, m)| Some((id, &m.name, m.mask.as_ref()?)))
        .collect();
    assert!(masked.len() > 40, "{} masked materials", masked.len());
    for (id, name, mask) in masked {
        let texels = mask.width() * mask.height();
        let opaque = (0..texels).filter(|i| mask.texel(i % mask.width(), i / mask.width()));
        let opaque = opaque.count() as f64 / texels as f64;
        assert!((0.02..0.98).contains(&opaque), "{name}: {opaque}");
        let mut rng = Key::world(id.into()).rng();
        // The card is any parallelogram, not only a rectangle.
        let [corner, edge_u] = [0; 2].map(|_| 2.0 * any_direction(&mut rng));
        let edge_v = edge_u.any_orthonormal_vector() * 1.5 + 0.3 * edge_u;
        let card = Card {
            corner: corner.as_vec3(),
            edge_u: edge_u.as_vec3(),
            edge_v: edge_v.as_vec3(),
            material: MaterialId(id),
        };
        let shape = Prototype::new("card", Mesh::default(), vec![card], &library.materials)
            .expect("a card is sound");
        let forest = RayScene::of_shape(Arc::new(shape), &library.materials);
        let passed = (0..RAYS).filter(|_| {
            // Rays avoid the very borders, where rounding may miss the card.
            let [u, v] = [0; 2].map(|_| rng.range_f64(1e-5, 1.0 - 1e-5));
            let target = corner + u * edge_u + v * edge_v;
            let back = any_direction(&mut rng);
            let facing = back.dot(edge_u.cross(edge_v).normalize()).abs() > 0.1;
            let origin = if facing {
                target + back
            } else {
                target + edge_u.cross(edge_v)
            };
            let ray = ray(origin, (target - origin).normalize());
            forest.closest_hit(&ray).is_none()
        });
        let passed = passed.count() as f64 / f64::from(RAYS);
        let sigma = (opaque * (1.0 - opaque) / f64::from(RAYS)).sqrt();
        let off = (passed - (1.0 - opaque)) / sigma;
        assert!(
            off.abs() < 4.0,
            "{name}: passed {passed}, opaque {opaque}, {off} σ"
        );
    }
}
