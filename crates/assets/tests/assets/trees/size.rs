//! How large trees are: height, crown, leaf area and diameter are those that were demanded.

use nemoral_assets::{GrowthParams, Species, grow};
use nemoral_scene::Prototype;
use nemoral_scene::glam::DVec2;
use nemoral_seed::{Draw, Key};
use proptest::prelude::*;

use super::{attachment, sample, tip};
use crate::common::{cut_dbh_m, cut_diameter_m, key, library, materials, silhouette_m2, top_m};

#[test]
fn sizes_are_as_demanded() {
    for (species, size, tree) in sample() {
        let name = format!("{} of {} m", species.name, size.dbh_m);
        let near = |what: &str, got: f64, wanted: f64, share: f64| {
            assert!(
                (got / wanted - 1.0).abs() < share,
                "{name}: {what} {got} for {wanted}"
            );
        };
        let dbh = cut_dbh_m(&tree.mesh);
        near("diameter", dbh, size.dbh_m, 0.02);
        near("diameter as told", tree.size.dbh_m, dbh, 0.002);
        let wood = tree.mesh.positions.iter().map(|p| p.z);
        let top = wood.chain(tree.cards.iter().map(top_m)).fold(0.0, f32::max);
        near("height", f64::from(top), size.height_m, 0.01);
        near("height as told", tree.size.height_m, size.height_m, 0.01);
        near(
            "silhouette",
            silhouette_m2(&tree.cards),
            species.foliage.silhouette_factor * size.leaf_area_m2,
            0.05,
        );
        near(
            "leaf area as told",
            tree.size.leaf_area_m2,
            size.leaf_area_m2,
            0.05,
        );
        near(
            "crown radius as told",
            tree.size.crown_radius_m,
            size.crown_radius_m,
            0.1,
        );
        assert!(
            (tree.size.crown_base_m - size.crown_base_m).abs() < 0.05 * size.height_m,
            "{name}: crown base {}",
            tree.size.crown_base_m
        );
        assert!(
            (tree.size.lean_rad - size.lean_rad).abs() < 0.01,
            "{name}: lean {} for {}",
            tree.size.lean_rad,
            size.lean_rad
        );
        // A stem is thinner than a cylinder of its diameter and thicker than half a cone.
        let cylinder = std::f64::consts::FRAC_PI_4 * size.dbh_m * size.dbh_m * size.height_m;
        assert!(
            (0.12..0.75).contains(&(tree.stem.volume_m3() / cylinder)),
            "{name}: {} of {cylinder}",
            tree.stem.volume_m3()
        );
        assert!(
            (0.5 * size.dbh_m..1.2 * size.dbh_m).contains(&tree.foot_radius_m),
            "{name}: foot {}",
            tree.foot_radius_m
        );
    }
}

/// Breast height of a copy that is larger or smaller lies elsewhere on its shape.
#[test]
fn stems_are_as_thick_as_their_profiles_say() {
    for (species, size, tree) in sample() {
        let heights_m = [0.02, 0.07, 0.33, 1.0, 1.18, 1.3, 1.44, 2.1, 3.7];
        // Where there are no branches.
        let low = heights_m.iter().filter(|&&z| z < 0.5 * size.crown_base_m);
        for &z in low {
            let (cut, told) = (cut_diameter_m(&tree.mesh, z), tree.stem.diameter_m(z));
            let name = &species.name;
            // Rings at the foot are tilted and near each other.
            let most = if z < 0.1 { 0.01 } else { 0.003 };
            assert!(
                (told / cut - 1.0).abs() < most,
                "{name} at {z} m: {told} for {cut}"
            );
        }
        // The boughs of a tree that forks low have more wood than its stem.
        let (stem_m3, all_m3) = (tree.stem.volume_m3(), tree.wood.total_m3());
        assert!(
            all_m3 > stem_m3 && all_m3 < 5.0 * stem_m3,
            "{stem_m3} of {all_m3} m3"
        );
        assert!(tree.wood.volume_above_diameter_m3(0.07) < all_m3);
        assert!((tree.size.dbh_m - tree.stem.diameter_m(1.3)).abs() < 1e-12);
    }
}

/// The crown radius is measured in another way: as that of the circle with the area of the
/// foliage's convex hull from above. The hull of a few branches' ends lies inside of the crown (an
/// octagon's radius is 5 % smaller).
#[test]
fn the_crown_keeps_to_its_envelope() {
    for (species, size, tree) in sample() {
        let mut points: Vec<DVec2> = tree
            .cards
            .iter()
            .flat_map(|c| [tip(c), attachment(c)])
            .map(|p| p.truncate().as_dvec2())
            .collect();
        points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
        let half = |points: &mut dyn Iterator<Item = DVec2>| {
            let mut hull: Vec<DVec2> = Vec::new();
            for p in points {
                while hull.len() > 1
                    && (hull[hull.len() - 1] - hull[hull.len() - 2])
                        .perp_dot(p - hull[hull.len() - 1])
                        <= 0.0
                {
                    hull.pop();
                }
                hull.push(p);
            }
            hull.pop();
            hull
        };
        let mut hull = half(&mut points.iter().copied());
        hull.extend(half(&mut points.iter().rev().copied()));
        let area: f64 = 0.5
            * (0..hull.len())
                .map(|i| hull[i].perp_dot(hull[(i + 1) % hull.len()]))
                .sum::<f64>();
        let radius = (area / std::f64::consts::PI).sqrt();
        assert!(
            (0.85..1.1).contains(&(radius / size.crown_radius_m)),
            "{} {}: hull radius {radius} for {}",
            species.name,
            size.dbh_m,
            size.crown_radius_m
        );
        let low = tree
            .cards
            .iter()
            .filter(|c| f64::from(attachment(c).z) < size.crown_base_m - 0.05 * size.height_m)
            .count();
        assert!(
            low * 20 < tree.cards.len(),
            "{}: {low} cards below the crown",
            species.name
        );
    }
}

#[test]
fn heights_of_saplings_are_limited() {
    let species = Species::maritime_pine();
    for (asked, drawn) in [(f64::NAN, 2.0), (-1.0, 2.0), (3.0, 3.0), (9.0, 5.0)] {
        assert_eq!(species.draw_sapling(asked, key(1)).height_m, drawn);
    }
}

/// Saplings meet their demand, stem included, however thin it is at breast height.
#[test]
fn saplings_are_as_demanded() {
    for species in Species::all() {
        for (i, height) in [2.0, 3.0, 4.5].into_iter().enumerate() {
            let size = species.draw_sapling(height, key(i as u64));
            let params = GrowthParams::default();
            let tree = grow(&species, &size, &materials(), &params, key(i as u64));
            let tree = tree.expect("a drawn sapling grows");
            let name = format!("{} of {height} m", species.name);
            let wood = tree.mesh.positions.iter().map(|p| p.z);
            let top = wood.chain(tree.cards.iter().map(top_m)).fold(0.0, f32::max);
            assert!(
                (f64::from(top) / height - 1.0).abs() < 0.01,
                "{name}: {top}"
            );
            let silhouette =
                silhouette_m2(&tree.cards) / species.foliage.silhouette_factor / size.leaf_area_m2;
            assert!((silhouette - 1.0).abs() < 0.05, "{name}: {silhouette}");
            assert!(
                (tree.size.dbh_m / size.dbh_m - 1.0).abs() < 0.02,
                "{name}: {}",
                tree.size.dbh_m
            );
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn any_drawn_tree_is_sound(
        which in 0_usize..9,
        share in 0.0..1.0_f64,
        seed: u64,
        odd in 0.6..1.6_f64,
    ) {
        let species = &Species::all()[which];
        let [low, high] = species.allometry.dbh_range_m;
        let key = Key::world(seed);
        let mut size = species.draw_size(low + share * (high - low), key);
        // Demands that are somewhat off the allometry must be met as well. (Squat saplings consist
        // of little but cards.)
        size.height_m = (size.height_m * odd).clamp(2.0, 70.0);
        size.crown_radius_m = (size.crown_radius_m / odd).clamp(0.3, 15.0);
        size.crown_base_m = size.crown_base_m.min(0.85 * size.height_m);
        let params = GrowthParams::default();
        let tree = grow(species, &size, &materials(), &params, key);
        let tree = tree.map_err(|e| TestCaseError::fail(e.to_string()))?;
        prop_assert!(tree.mesh.triangles.len() <= params.wood_triangles_max);
        prop_assert!(!tree.cards.is_empty() && tree.cards.len() <= params.cards_max);
        prop_assert!(
            (tree.size.dbh_m / size.dbh_m - 1.0).abs() < 0.02,
            "dbh {} for {}",
            tree.size.dbh_m,
            size.dbh_m
        );
        prop_assert!(
            (tree.size.height_m / size.height_m - 1.0).abs() < 0.01,
            "height {} for {}",
            tree.size.height_m,
            size.height_m
        );
        prop_assert!((tree.size.leaf_area_m2 / size.leaf_area_m2 - 1.0).abs() < 0.05);
        prop_assert!(
            (tree.size.crown_radius_m / size.crown_radius_m - 1.0).abs() < 0.1,
            "radius {} for {}",
            tree.size.crown_radius_m,
            size.crown_radius_m
        );
        // The foot is under the ground all around, also on a slope of 40 degrees.
        let lowest = tree.mesh.positions.iter().fold(0.0_f32, |m, p| m.min(p.z));
        let deep_enough = 0.84 * tree.foot_radius_m;
        prop_assert!(f64::from(-lowest) >= deep_enough, "{lowest}, {deep_enough}");
        prop_assert!(lowest >= -1.8, "{lowest}");
        let prototype = Prototype::new("tree", tree.mesh, tree.cards, &library());
        prop_assert!(prototype.is_ok(), "{:?}", prototype.err());
    }

    #[test]
    fn draws_stay_in_range(which in 0_usize..9, dbh in -1.0..5.0_f64, seed: u64) {
        let species = &Species::all()[which];
        let size = species.draw_size(dbh, Key::world(seed));
        let [low, high] = species.allometry.dbh_range_m;
        prop_assert!((low..=high).contains(&size.dbh_m));
        prop_assert!(size.crown_base_m > 0.0 && size.crown_base_m < size.height_m);
        prop_assert!(
            size.crown_radius_m > 0.0
                && size.leaf_area_m2 > 0.0
                && (0.0..0.35).contains(&size.lean_rad)
        );
        let mut rng = Key::world(seed).rng();
        let limits = [rng.range_f64(0.0, 1.0), rng.range_f64(0.0, 1.0)];
        let drawn = species.draw_dbh(
            rng.range_f64(0.05, 1.0),
            rng.range_f64(1.0, 6.0),
            limits,
            Key::world(seed),
        );
        prop_assert!((low..=high).contains(&drawn));
    }

    #[test]
    fn individuals_keep_to_their_parts(
        which in 0_usize..9,
        seed: u64,
        mean in 0.05..1.0_f64,
        shape in 1.0..6.0_f64,
        limits in [0.07..0.5_f64, 0.5..1.5_f64],
        of in 1_u32..=64,
    ) {
        let species = &Species::all()[which];
        for number in 0..of {
            let rank = |at: u32| f64::from(at) / f64::from(of);
            let least = species.dbh_of_rank(mean, shape, limits, rank(number));
            let most = species.dbh_of_rank(mean, shape, limits, rank(number + 1));
            let one =
                species.dbh_of_individual(mean, shape, limits, [number, of], Key::world(seed));
            prop_assert!((least..=most).contains(&one), "{number} of {of}: {one}");
            let again =
                species.dbh_of_individual(mean, shape, limits, [number, of], Key::world(!seed));
            prop_assert!(one != again || least == most);
        }
    }
}
