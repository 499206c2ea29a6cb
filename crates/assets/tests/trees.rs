//! Properties of grown trees, checked on their triangles and cards.

mod common;

use std::collections::BTreeMap;

use common::{
    BRANCH, DEAD, LIMB, SNAG, corners, cut_dbh_m, cut_diameter_m, girth_m, key, library, materials,
    silhouette_m2, stem_cut, top_m,
};
use nemoral_assets::{
    GrownTree, GrowthParams, SizeClass, Species, StemForm, TreeMaterials, TreeSize, grow, grow_snag,
};
use nemoral_scene::glam::{DVec2, DVec3, Vec3};
use nemoral_scene::{Card, Mesh, Prototype, Semantic, Triangle};
use nemoral_seed::{Draw, Key};
use proptest::prelude::*;

fn tree(species: &Species, dbh_m: f64, i: u64) -> (TreeSize, GrownTree) {
    let size = species.draw_size(dbh_m, key(i));
    let tree = grow(
        species,
        &size,
        &materials(),
        &GrowthParams::default(),
        key(i),
    )
    .expect("a drawn size grows");
    (size, tree)
}

/// Every species at three diameters.
fn sample() -> Vec<(Species, TreeSize, GrownTree)> {
    let mut out = Vec::new();
    for species in Species::all() {
        for (i, dbh) in [0.12, 0.28, 0.5].into_iter().enumerate() {
            let (size, tree) = tree(&species, dbh, i as u64);
            out.push((species.clone(), size, tree));
        }
    }
    out
}

fn tip(card: &Card) -> Vec3 {
    card.corner + 0.5 * card.edge_u + card.edge_v
}

fn attachment(card: &Card) -> Vec3 {
    card.corner + 0.5 * card.edge_u
}

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
            (0.12..0.75).contains(&(tree.stem_volume_m3 / cylinder)),
            "{name}: {} of {cylinder}",
            tree.stem_volume_m3
        );
        assert!(
            (0.5 * size.dbh_m..1.2 * size.dbh_m).contains(&tree.foot_radius_m),
            "{name}: foot {}",
            tree.foot_radius_m
        );
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

/// Triangles by axis: an axis shares no vertex with another.
fn axes(mesh: &Mesh) -> Vec<Vec<Triangle>> {
    let mut root: Vec<usize> = (0..mesh.positions.len()).collect();
    fn find(root: &mut [usize], mut i: usize) -> usize {
        while root[i] != i {
            root[i] = root[root[i]];
            i = root[i];
        }
        i
    }
    // Vertices at seams and cuts exist twice, so vertices at equal places are joined too, within
    // the indices of one axis.
    let mut by_place: BTreeMap<[u32; 3], usize> = BTreeMap::new();
    for (i, p) in mesh.positions.iter().enumerate() {
        let other = *by_place.entry(p.to_array().map(f32::to_bits)).or_insert(i);
        let (a, b) = (find(&mut root, i), find(&mut root, other));
        root[a] = b;
    }
    for t in &mesh.triangles {
        let [a, b, c] = t.corners.map(|c| find(&mut root, c as usize));
        root[a] = b;
        let (b, c) = (find(&mut root, b), find(&mut root, c));
        root[b] = c;
    }
    let mut out: BTreeMap<usize, Vec<Triangle>> = BTreeMap::new();
    for t in &mesh.triangles {
        out.entry(find(&mut root, t.corners[0] as usize))
            .or_default()
            .push(*t);
    }
    out.into_values().collect()
}

#[test]
fn surfaces_face_outwards() {
    for (species, _, tree) in sample() {
        let mesh = &tree.mesh;
        assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-4));
        let axes = axes(mesh);
        assert!(axes.len() > 20, "{}: {} axes", species.name, axes.len());
        for axis in &axes {
            // The open base contributes nothing to a volume seen from a point in its plane.
            let origin = mesh.positions[axis[0].corners[0] as usize].as_dvec3();
            let volume: f64 = axis
                .iter()
                .map(|t| {
                    let [a, b, c] = corners(mesh, t).map(|p| p - origin);
                    a.dot(b.cross(c)) / 6.0
                })
                .sum();
            assert!(
                volume > 0.0,
                "{}: an axis of {} triangles is inside out",
                species.name,
                axis.len()
            );
        }
        let mut against = 0;
        for t in &mesh.triangles {
            let [a, b, c] = corners(mesh, t);
            let face = (b - a).cross(c - a);
            against += t
                .corners
                .iter()
                .filter(|&&k| mesh.normals[k as usize].as_dvec3().dot(face) < 0.0)
                .count();
        }
        assert!(
            against * 300 < mesh.triangles.len(),
            "{}: {against} normals against their triangle",
            species.name
        );
    }
}

/// The local radius of an axis: half of the chord from the middle of a triangle straight inwards.
fn half_chord(mesh: &Mesh, axis: &[Triangle], from: usize) -> Option<f64> {
    let [a, b, c] = corners(mesh, &axis[from]);
    let inward = -(b - a).cross(c - a).try_normalize()?;
    let origin = (a + b + c) / 3.0;
    let hit = |t: &Triangle| {
        let [a, b, c] = corners(mesh, t);
        let normal = (b - a).cross(c - a);
        let along = normal.dot(inward);
        if along < 1e-12 {
            return None;
        }
        let s = normal.dot(a - origin) / along;
        let p = origin + inward * s;
        let inside = [(a, b), (b, c), (c, a)]
            .iter()
            .all(|(u, v)| normal.dot((*v - *u).cross(p - *u)) >= 0.0);
        (inside && s > 1e-6).then_some(s)
    };
    axis.iter()
        .filter_map(hit)
        .min_by(f64::total_cmp)
        .map(|s| 0.5 * s)
}

#[test]
fn wood_is_sorted_by_the_trunk_threshold() {
    for (species, dbh) in [
        (Species::english_oak(), 0.5),
        (Species::maritime_pine(), 0.5),
    ] {
        for threshold in [0.03, 0.06] {
            let size = species.draw_size(dbh, key(5));
            let params = GrowthParams {
                trunk_radius_m: threshold,
                ..GrowthParams::default()
            };
            let tree = grow(&species, &size, &materials(), &params, key(5)).expect("grows");
            let (mut thin, mut too_thick, mut thick, mut too_thin) = (0, 0, 0, 0);
            for axis in axes(&tree.mesh) {
                let apex = axis
                    .iter()
                    .flat_map(|t| t.corners)
                    .max()
                    .expect("an axis has triangles");
                for i in 0..axis.len() {
                    // The end of an axis is closed at its last vertex, where inwards is along the
                    // axis.
                    if axis[i].corners.contains(&apex) {
                        continue;
                    }
                    let Some(radius) = half_chord(&tree.mesh, &axis, i) else {
                        continue;
                    };
                    if [BRANCH, DEAD].contains(&axis[i].material) {
                        thin += 1;
                        too_thick += usize::from(radius >= 1.08 * threshold);
                        assert!(
                            radius < 1.25 * threshold,
                            "{}: a branch of radius {radius}, threshold {threshold}",
                            species.name
                        );
                    } else if axis[i].material == LIMB {
                        thick += 1;
                        too_thin += usize::from(radius < 0.85 * threshold);
                    }
                }
            }
            assert!(thin > 1000, "{}: {thin} thin", species.name);
            // Where wood bends, a chord may cross it obliquely, or be cut short.
            assert!(
                too_thick * 500 <= thin,
                "{}: {too_thick} of {thin} branch triangles are on thick wood",
                species.name
            );
            assert!(
                too_thin * 25 <= thick,
                "{}: {too_thin} of {thick} limb triangles are on thin wood",
                species.name
            );
            // Only an oak's limbs are thicker than 6 cm.
            assert!(
                thick > 20 || threshold > 0.05 && species.name != "english_oak",
                "{}: {thick} thick",
                species.name
            );
        }
    }
}

/// Pines and spruces of stands keep dead branches below their crowns.
#[test]
fn dead_branches_are_below_the_crown() {
    for species in [Species::maritime_pine(), Species::norway_spruce()] {
        for i in 0..4 {
            let size = species.draw_size(0.32, key(i));
            let dead_of = |species: &Species| -> Vec<f64> {
                let params = GrowthParams::default();
                let tree = grow(species, &size, &materials(), &params, key(i)).expect("grows");
                let dead = tree.mesh.triangles.iter().filter(|t| t.material == DEAD);
                let height = |t: &Triangle| corners(&tree.mesh, t).map(|p| p.z);
                dead.map(|t| height(t).into_iter().sum::<f64>() / 3.0)
                    .collect()
            };
            let name = format!("{} {i}", species.name);
            let heights = dead_of(&species);
            let below = heights.iter().filter(|z| **z < size.crown_base_m).count();
            assert!(below > 100, "{name}: {below} triangles");
            // They spring from below it; the tips of the uppermost may reach higher.
            assert!(below * 4 > heights.len() * 3, "{name}: {below} below");
            let lowest = heights.iter().fold(f64::INFINITY, |m, z| m.min(*z));
            let from = species.dead.from * size.crown_base_m;
            assert!(lowest > 0.5 * from, "{name}: {lowest} m, none below {from}");

            let mut pruned = species.clone();
            pruned.dead.persistence = 0.0;
            assert_eq!(dead_of(&pruned).len(), 0, "{name}");
        }
    }
}

#[test]
fn a_lower_threshold_makes_more_trunk() {
    let species = Species::english_oak();
    let size = species.draw_size(0.5, key(1));
    let share = |threshold| {
        let params = GrowthParams {
            trunk_radius_m: threshold,
            ..GrowthParams::default()
        };
        let tree = grow(&species, &size, &materials(), &params, key(1)).expect("grows");
        tree.mesh
            .triangles
            .iter()
            .filter(|t| t.material == LIMB)
            .count()
    };
    let counts = [0.02, 0.04, 0.08].map(share);
    assert!(
        counts[0] > counts[1] && counts[1] > counts[2] && counts[2] > 0,
        "{counts:?}"
    );
}

#[test]
fn every_card_grows_on_wood() {
    for (species, size, tree) in sample() {
        // Boxes of triangles, in cells of 25 cm.
        let cell = |p: Vec3| (p / 0.25).floor().as_ivec3().to_array();
        let mut cells: BTreeMap<[i32; 3], Vec<[DVec3; 3]>> = BTreeMap::new();
        for t in &tree.mesh.triangles {
            let c = corners(&tree.mesh, t);
            let low = cell((c[0].min(c[1]).min(c[2]) - 0.05).as_vec3());
            let high = cell((c[0].max(c[1]).max(c[2]) + 0.05).as_vec3());
            for x in low[0]..=high[0] {
                for y in low[1]..=high[1] {
                    for z in low[2]..=high[2] {
                        cells.entry([x, y, z]).or_default().push(c);
                    }
                }
            }
        }
        for card in &tree.cards {
            let p = attachment(card);
            let near = cells
                .get(&cell(p))
                .is_some_and(|ts| ts.iter().any(|t| distance(p.as_dvec3(), t) < 0.05));
            assert!(
                near,
                "{} of {} m: a card floats at {p}",
                species.name, size.dbh_m
            );
        }
    }
}

/// Distance of a point from a triangle: from its plane if it is over it, else from its edges.
fn distance(p: DVec3, &[a, b, c]: &[DVec3; 3]) -> f64 {
    let normal = (b - a).cross(c - a);
    let over = [(a, b), (b, c), (c, a)]
        .iter()
        .all(|(u, v)| normal.dot((*v - *u).cross(p - *u)) >= 0.0);
    if over && normal.length() > 0.0 {
        return normal.dot(p - a).abs() / normal.length();
    }
    let edge = |u: DVec3, v: DVec3| {
        let t = ((p - u).dot(v - u) / (v - u).length_squared().max(1e-18)).clamp(0.0, 1.0);
        p.distance(u + (v - u) * t)
    };
    edge(a, b).min(edge(b, c)).min(edge(c, a))
}

#[test]
fn leaves_are_inclined_as_measured_in_the_field() {
    // Values measured in the field (see the species' files); a spherical distribution has 57.3 +-
    // 21.6, hanging leaves 65 to 75. Where only a mean is published, the deviation is our choice.
    for (species, mean, sd) in [
        (Species::english_oak(), 35.7, 19.3),
        (Species::maritime_pine(), 57.3, 21.6),
        (Species::eucalyptus(), 70.0, 13.0),
        (Species::cork_oak(), 31.4, 22.0),
        (Species::beech(), 33.1, 17.4),
        (Species::silver_birch(), 56.6, 19.4),
        (Species::norway_spruce(), 42.4, 20.0),
        (Species::scots_pine(), 25.7, 32.0),
        (Species::douglas_fir(), 51.9, 20.0),
    ] {
        let (mut weight, mut sum, mut squares) = (0.0, 0.0, 0.0);
        let classes = [SizeClass::Young, SizeClass::Middle, SizeClass::Mature];
        let trees = classes.map(|class| tree(&species, species.class_dbh_m(class), 3).1);
        for card in trees.iter().flat_map(|t| &t.cards) {
            let normal = card.edge_u.cross(card.edge_v).as_dvec3();
            let area = normal.length();
            let degrees = (normal.z.abs() / area).min(1.0).acos().to_degrees();
            weight += area;
            sum += area * degrees;
            squares += area * degrees * degrees;
        }
        let m = sum / weight;
        let s = (squares / weight - m * m).sqrt();
        assert!(
            (m - mean).abs() < 5.0 && (s - sd).abs() < 5.0,
            "{}: {m} +- {s} for {mean} +- {sd}",
            species.name
        );
    }
}

/// The published relations, written out independently: height, crown width, leaf area from d in cm.
fn published(name: &str, d: f64) -> [f64; 3] {
    let schnute = |a: f64, b: f64, d0: f64, h0: f64| {
        let foot = 1.3_f64.powf(b);
        (foot + (h0.powf(b) - foot) * (1.0 - (-a * d).exp()) / (1.0 - (-a * d0).exp()))
            .powf(1.0 / b)
    };
    match name {
        "maritime_pine" => [
            schnute(-0.00123, 3.363, 35.0, 20.0).clamp(0.297 * d, 0.72 * d),
            0.2775 * d.powf(0.841),
            0.0416 * d.powf(2.235),
        ],
        "eucalyptus" => [
            schnute(0.05, 1.0, 20.0, 22.0).clamp(0.627 * d, 1.413 * d),
            0.35 * d.powf(0.78),
            0.1834 * d.powf(1.917),
        ],
        "english_oak" => [
            schnute(0.0616, 1.067, 45.0, 20.0).clamp(0.253 * d, 0.837 * d),
            0.672 * d.powf(0.7328),
            0.1623 * d.powf(2.138),
        ],
        "scots_pine" => [
            schnute(0.10, 1.0, 35.0, 20.0).clamp(0.33 * d, 0.747 * d),
            (1.14 * (2.0 + 1.25 * d) + 10.7) / 10.0,
            0.1280 * d.powf(1.746),
        ],
        "norway_spruce" => [
            schnute(0.03, 1.0, 40.0, 26.0).clamp(0.495 * d, 0.81 * d),
            (1.06 * (2.0 + 1.25 * d) + 15.5) / 10.0,
            0.2639 * d.powf(1.857),
        ],
        "douglas_fir" => [
            schnute(0.018, 1.0, 50.0, 34.0).clamp(0.55 * d, 0.918 * d),
            1.24 + 0.126 * d,
            0.1941 * d.powf(1.903),
        ],
        "cork_oak" => [
            schnute(0.035, 1.0, 45.0, 10.0).clamp(0.176 * d, 0.468 * d),
            0.447 * d.powf(0.792),
            // Not published; our choice, for the reason given in the species file.
            0.62 * d.powf(1.4),
        ],
        "beech" => [
            schnute(0.012, 1.0, 45.0, 32.0).clamp(0.319 * d, 0.972 * d),
            0.7 * 0.839 * d.powf(0.735),
            0.2656 * d.powf(1.891),
        ],
        "silver_birch" => [
            schnute(0.045, 1.0, 28.0, 22.0).clamp(0.44 * d, 0.936 * d),
            (1.51 * (2.0 + 1.25 * d) + 12.8) / 10.0,
            0.2442 * d.powf(1.886),
        ],
        other => panic!("no published relations for {other}"),
    }
}

#[test]
fn allometry_is_recovered_from_draws() {
    for species in Species::all() {
        let [low, high] = species.allometry.dbh_range_m;
        let cap = species.allometry.leaf_area_index_max;
        let mut halves = [[0.0; 3]; 2];
        for i in 0..500 {
            let dbh = low + (high - low) * (f64::from(i) + 0.5) / 500.0;
            let size = species.draw_size(dbh, key(u64::from(i as u32)));
            let [h, width, leaf] = published(&species.name, 100.0 * dbh);
            let leaf = leaf.min(cap * std::f64::consts::FRAC_PI_4 * width * width);
            let got = [
                size.height_m / h,
                2.0 * size.crown_radius_m / width,
                size.leaf_area_m2 / leaf,
            ];
            for (sum, ratio) in halves[usize::from(i >= 250)].iter_mut().zip(got) {
                *sum += ratio / 250.0;
            }
            let slenderness = size.height_m / size.dbh_m;
            let [least, most] = species.allometry.slenderness;
            assert!(
                (least - 1e-9..=most + 1e-9).contains(&slenderness),
                "{}: H/D {slenderness}",
                species.name
            );
            assert!(
                size.crown_base_m > 0.04 * size.height_m && size.crown_base_m < 0.8 * size.height_m
            );
        }
        for ratio in halves.iter().flatten() {
            assert!((ratio - 1.0).abs() < 0.03, "{}: {halves:?}", species.name);
        }
    }
}

#[test]
fn diameters_follow_the_truncated_weibull() {
    let species = Species::maritime_pine();
    let (mean, shape, low, high) = (0.3, 3.0, 0.12, 0.5);
    let n = 2000_u32;
    let mut draws: Vec<f64> = (0..n)
        .map(|i| species.draw_dbh(mean, shape, [low, high], key(u64::from(i))))
        .collect();
    draws.sort_by(f64::total_cmp);
    // Γ(4/3) = 0.892979511569249.
    let scale = mean / 0.892_979_511_569_249_f64;
    let weibull = |d: f64| 1.0 - (-(d / scale).powf(shape)).exp();
    let cdf = |d: f64| (weibull(d) - weibull(low)) / (weibull(high) - weibull(low));
    let ks = draws
        .iter()
        .zip(0_u32..)
        .map(|(&d, i)| {
            (cdf(d) - f64::from(i) / f64::from(n))
                .abs()
                .max((cdf(d) - f64::from(i + 1) / f64::from(n)).abs())
        })
        .fold(0.0, f64::max);
    assert!(ks < 1.36 / f64::from(n).sqrt(), "Kolmogorov-Smirnov {ks}");
    // Odd requests still give a diameter of the species.
    for (mean, shape) in [(f64::NAN, 3.0), (0.3, 0.0), (9.0, 3.0), (1e-9, 3.0)] {
        let d = species.draw_dbh(mean, shape, [0.1, 0.4], key(1));
        assert!((0.1..=0.4).contains(&d), "{mean} {shape}: {d}");
    }
}

#[test]
fn few_individuals_stand_for_a_stand() {
    let stands = [
        (Species::maritime_pine(), 0.27, 3.2, [0.12, 0.50]),
        (Species::english_oak(), 0.28, 1.7, [0.08, 0.75]),
        (Species::eucalyptus(), 0.16, 4.0, [0.08, 0.30]),
    ];
    for (species, mean, shape, limits) in stands {
        let moments = |diameters: &[f64]| {
            let n = diameters.len() as f64;
            let mean = diameters.iter().sum::<f64>() / n;
            let square = diameters.iter().map(|d| d * d).sum::<f64>() / n;
            (square, (square - mean * mean).sqrt())
        };
        let of_ranks = |n: u32| -> Vec<f64> {
            let rank = |i: u32| (f64::from(i) + 0.5) / f64::from(n);
            let ranks = (0..n).map(rank);
            ranks
                .map(|rank| species.dbh_of_rank(mean, shape, limits, rank))
                .collect()
        };
        let (square, spread) = moments(&of_ranks(4000));
        let stands: Vec<(f64, f64)> = (0..40)
            .map(|i| {
                let of = |k: u32| species.dbh_of_individual(mean, shape, limits, [k, 8], key(i));
                moments(&(0..8).map(of).collect::<Vec<f64>>())
            })
            .collect();
        for (found, width) in &stands {
            // They have the basal area and most of the spread; the rest of the spread is within the
            // parts.
            assert!(
                (found / square - 1.0).abs() < 0.03,
                "{}: {found} {square}",
                species.name
            );
            assert!(
                (0.92..1.04).contains(&(width / spread)),
                "{}: {width} {spread}",
                species.name
            );
        }
        let mean_square = stands.iter().map(|s| s.0).sum::<f64>() / 40.0;
        let medians = moments(&of_ranks(8)).0;
        assert!(
            (mean_square / square - 1.0).abs() < 0.005,
            "{mean_square} {square}"
        );
        assert!(
            medians / square < 0.993,
            "medians would do: {medians} {square}"
        );
    }
}

fn fingerprint(tree: &GrownTree) -> u64 {
    let vectors = tree
        .mesh
        .positions
        .iter()
        .chain(&tree.mesh.normals)
        .copied();
    let cards = tree
        .cards
        .iter()
        .flat_map(|c| [c.corner, c.edge_u, c.edge_v]);
    let words = vectors
        .chain(cards)
        .flat_map(|v| v.to_array())
        .chain(tree.mesh.uvs.iter().flat_map(|v| v.to_array()))
        .map(f32::to_bits);
    let indices = tree
        .mesh
        .triangles
        .iter()
        .flat_map(|t| t.corners.into_iter().chain([u32::from(t.material.0)]));
    words.chain(indices).fold(0xCBF2_9CE4_8422_2325, |h, w| {
        (h ^ u64::from(w)).wrapping_mul(0x0000_0100_0000_01B3)
    })
}

#[test]
fn value_stability() {
    let got: Vec<String> = Species::all()
        .iter()
        .map(|s| format!("{:016x}", fingerprint(&tree(s, 0.25, 9).1)))
        .collect();
    assert_eq!(got, FINGERPRINTS);
    let size = Species::english_oak().draw_size(0.3, key(9));
    assert_eq!(
        format!(
            "{:.9} {:.9} {:.9}",
            size.height_m, size.crown_radius_m, size.leaf_area_m2
        ),
        SIZE
    );
    assert_eq!(
        format!(
            "{:.12}",
            Species::eucalyptus().draw_dbh(0.2, 2.5, [0.1, 0.4], key(9))
        ),
        DBH
    );
    let of_eight = |i| Species::beech().dbh_of_individual(0.34, 2.4, [0.1, 0.65], [i, 8], key(9));
    assert_eq!(
        format!("{:.12} {:.12}", of_eight(0), of_eight(6)),
        INDIVIDUALS
    );
}
const INDIVIDUALS: &str = "0.138010800348 0.475840711052";
const FINGERPRINTS: [&str; 9] = [
    "2e8639f93a4df807",
    "cb8cb0b955743daf",
    "c276999f80a60fd7",
    "6d7f9e2652818ca3",
    "43ce3ffacc1acf37",
    "6cc56bd843f69782",
    "eb2b0e4d370b44cc",
    "a54fb369d78f4ab0",
    "72449523e1d9282a",
];
const SIZE: &str = "18.755967525 4.727007432 233.612933315";
const DBH: &str = "0.128658733404";

/// A spruce whose stem is straight and upright, except for what `change` does to it.
fn straight(change: impl Fn(&mut StemForm)) -> (TreeSize, GrownTree) {
    let mut species = Species::norway_spruce();
    species.stem.sweep_deg = 0.0;
    species.stem.sinuosity = 0.0;
    change(&mut species.stem);
    let size = TreeSize {
        lean_rad: 0.0,
        ..species.draw_size(0.35, key(3))
    };
    let params = GrowthParams::default();
    let tree = grow(&species, &size, &materials(), &params, key(3)).expect("grows");
    (size, tree)
}

#[test]
fn stems_are_bowed_by_their_basal_sweep() {
    // The horizontal distance of the stem from its foot at a fifth of its height, where the bow is
    // widest.
    let bow_m = |sweep_deg: f64| {
        let (size, tree) = straight(|stem| stem.sweep_deg = sweep_deg);
        let cut = stem_cut(&tree.mesh, 0.2 * size.height_m);
        (cut.iter().sum::<DVec2>() / cut.len() as f64).length()
    };
    let none = bow_m(0.0);
    assert!(none < 0.002, "{none} m of a straight stem");
    let [slight, middle, strong] = [3.0, 6.0, 12.0].map(bow_m);
    assert!(
        slight > 0.01 && middle > slight && strong > middle,
        "{slight} {middle} {strong}"
    );
    // One tree with more and more sweep: the bow grows as the tangent of the angle, apart from what
    // the fit of the crown changes.
    let tangent = |deg: f64| deg.to_radians().tan();
    for (bow, deg) in [(slight, 3.0), (middle, 6.0)] {
        let ratio = strong / bow * tangent(deg) / tangent(12.0);
        assert!((ratio - 1.0).abs() < 0.25, "{deg}: {ratio}");
    }
}

#[test]
fn the_foot_is_as_wide_as_its_flare() {
    // The girth at the ground over the girth at breast height.
    let swelling = |flare: f64| {
        let (size, tree) = straight(|stem| stem.flare = [flare; 2]);
        let [ground, breast] = [0.0, 1.3].map(|z| girth_m(&stem_cut(&tree.mesh, z)));
        let dbh = breast / std::f64::consts::PI / size.dbh_m;
        assert!((dbh - 1.0).abs() < 0.02, "breast height is not changed");
        ground / breast
    };
    let none = swelling(0.0);
    assert!((1.0..1.3).contains(&none), "the taper's butt alone: {none}");
    for flare in [0.1, 0.2, 0.4, 0.8] {
        let more = swelling(flare) / none - 1.0;
        // The lobes fall to nothing between each other, which adds half of their height to the mean
        // radius, and their outline is longer than a circle.
        assert!((0.4..1.0).contains(&(more / flare)), "{flare}: {more}");
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

#[test]
fn snags_are_dead_wood_of_the_demanded_diameter() {
    let library = library();
    for species in Species::all() {
        for i in 0..4 {
            let size = species.draw_size(0.3, key(i));
            let params = GrowthParams::default();
            let snag = grow_snag(&species, &size, &materials(), &params, key(i)).expect("it grows");
            let name = format!("{} {i}", species.name);
            assert!(!snag.alive && snag.cards.is_empty(), "{name}");
            assert_eq!(snag.size.leaf_area_m2, 0.0);
            let dbh = cut_dbh_m(&snag.mesh);
            assert!((dbh / size.dbh_m - 1.0).abs() < 0.02, "{name}: {dbh}");
            assert!((snag.size.dbh_m / dbh - 1.0).abs() < 0.002, "{name}");
            // Its taper is that of the tree before its top broke.
            let upper = species.stem_diameter_m(&size, 2.6) / species.stem_diameter_m(&size, 1.3);
            let cut = cut_diameter_m(&snag.mesh, 2.6);
            assert!((upper * dbh / cut - 1.0).abs() < 0.05, "{name}: {cut}");
            let top = snag.mesh.positions.iter().fold(0.0_f32, |m, p| m.max(p.z));
            assert!(
                (f64::from(top) / snag.size.height_m - 1.0).abs() < 0.001,
                "{name}"
            );
            assert!(
                top > 1.9 && f64::from(top) < 1.3 * size.height_m,
                "{name}: {top}"
            );
            // There is no living wood, and nothing hangs in the air.
            for t in &snag.mesh.triangles {
                let semantic = library.get(t.material).semantic;
                assert!(
                    [Semantic::Snag, Semantic::Twig].contains(&semantic),
                    "{name}"
                );
            }
            let stem_top = snag.mesh.triangles.iter().filter(|t| t.material == SNAG);
            assert!(stem_top.count() > 100, "{name}");
        }
    }
}

/// The sizes in the inventory of 120 grown trees of each species follow the published relations.
#[test]
fn allometry_is_recovered_from_grown_trees() {
    allometry_is_recovered_from(120);
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn allometry_is_recovered_from_500_grown_trees() {
    allometry_is_recovered_from(500);
}

/// Leaf areas are not limited. Cards and wood are few, as sizes do not depend on them.
fn allometry_is_recovered_from(trees: u32) {
    let params = GrowthParams {
        wood_triangles_max: 3_000,
        cards_max: 200,
        ..GrowthParams::default()
    };
    for species in Species::all() {
        let [low, high] = species.allometry.dbh_range_m;
        // The range of diameters that the relations were fitted to.
        let high = match species.name.as_str() {
            "eucalyptus" => 0.35,
            _ => high.min(0.6),
        };
        let mut sums = [0.0; 3];
        for i in 0..trees {
            let dbh = low + (high - low) * (f64::from(i) + 0.5) / f64::from(trees);
            let key = key(u64::from(i));
            let size = species.draw_size(dbh, key);
            let tree = grow(&species, &size, &materials(), &params, key);
            let tree = tree.unwrap_or_else(|e| panic!("{} of {dbh} m: {e}", species.name));
            let [h, width, leaf] = published(&species.name, 100.0 * tree.size.dbh_m);
            let got = [
                tree.size.height_m / h,
                2.0 * tree.size.crown_radius_m / width,
                tree.size.leaf_area_m2 / leaf,
            ];
            for (sum, ratio) in sums.iter_mut().zip(got) {
                *sum += ratio / f64::from(trees);
            }
        }
        for (name, mean) in ["height", "crown width", "leaf area"].iter().zip(sums) {
            assert!((mean - 1.0).abs() < 0.03, "{} {name}: {mean}", species.name);
        }
    }
}

#[test]
fn individuals_differ_and_repeat() {
    let species = Species::maritime_pine();
    let size = species.draw_size(0.25, key(0));
    let grow = |k| {
        grow(
            &species,
            &size,
            &materials(),
            &GrowthParams::default(),
            key(k),
        )
        .expect("grows")
    };
    assert_eq!(fingerprint(&grow(1)), fingerprint(&grow(1)));
    assert_ne!(fingerprint(&grow(1)), fingerprint(&grow(2)));
}

#[test]
fn wrong_requests_are_refused_by_name() {
    let species = Species::eucalyptus();
    let good = species.draw_size(0.2, key(0));
    let params = GrowthParams::default();
    let field =
        |species: &Species, size: &TreeSize, materials: &TreeMaterials, params: &GrowthParams| {
            grow(species, size, materials, params, key(0))
                .map(|_| ())
                .map_err(|e| e.field)
        };
    let refused = |name: &str| Err(name.to_owned());
    assert_eq!(field(&species, &good, &materials(), &params), Ok(()));
    let size = TreeSize {
        dbh_m: f64::NAN,
        ..good
    };
    assert_eq!(
        field(&species, &size, &materials(), &params),
        refused("size.dbh_m")
    );
    let size = TreeSize {
        crown_base_m: good.height_m,
        ..good
    };
    assert_eq!(
        field(&species, &size, &materials(), &params),
        refused("size.crown_base_m")
    );
    let none = TreeMaterials {
        foliage: Vec::new(),
        ..materials()
    };
    assert_eq!(field(&species, &good, &none, &params), refused("foliage"));
    let mut bad = materials();
    bad.foliage[1].opaque_fraction = 0.0;
    assert_eq!(
        field(&species, &good, &bad, &params),
        refused("foliage[1].opaque_fraction")
    );
    let few = GrowthParams {
        wood_triangles_max: 10,
        ..params
    };
    assert_eq!(
        field(&species, &good, &materials(), &few),
        refused("wood_triangles_max")
    );
    let bald = Species {
        levels: Vec::new(),
        ..species.clone()
    };
    assert_eq!(
        field(&bald, &good, &materials(), &params),
        refused("eucalyptus.levels")
    );
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
        // The foot is under the ground all around, on slopes too.
        let lowest = tree.mesh.positions.iter().fold(0.0_f32, |m, p| m.min(p.z));
        prop_assert!((-0.65..=-0.25).contains(&lowest), "{lowest}");
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
