//! Wood and leaves: surfaces, the trunk's threshold, where leaves grow and how they are inclined.

use std::collections::BTreeMap;

use nemoral_assets::{GrowthParams, SizeClass, Species, grow};
use nemoral_scene::glam::{DVec3, Vec3};
use nemoral_scene::{Mesh, Triangle};

use super::{attachment, sample, tree};
use crate::common::{BRANCH, DEAD, LIMB, corners, key, materials};

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
