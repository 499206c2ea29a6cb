//! The graph of a tree's wood against the mesh that was made of the same wood.

use crate::common::{BRANCH, DEAD, LIMB, key, materials};
use nemoral_assets::{GrowthParams, Species, TreeStructure, WoodNode, grow, grow_with_structure};
use nemoral_scene::glam::DVec3;

/// Distance of a point from the surface of the nearest cone, metres.
fn distance_m(structure: &TreeStructure, point: DVec3) -> f64 {
    let nodes = &structure.nodes;
    let cones = nodes.iter().filter_map(|node| {
        let parent = &nodes[node.parent? as usize];
        // A branch begins within its bearer; its own radius counts there.
        let base_m = match parent.axis == node.axis {
            true => parent.radius_m,
            false => node.radius_m,
        };
        let along = node.position_m - parent.position_m;
        let t = (point - parent.position_m).dot(along) / along.length_squared().max(1e-12);
        let t = t.clamp(0.0, 1.0);
        let axis = parent.position_m + along * t;
        Some((axis.distance(point) - (base_m + (node.radius_m - base_m) * t)).abs())
    });
    cones.fold(f64::INFINITY, f64::min)
}

#[test]
fn the_mesh_is_the_surface_of_the_cones() {
    for (i, species) in Species::all().into_iter().enumerate() {
        let size = species.draw_size(0.2, key(i as u64));
        let (params, materials) = (GrowthParams::default(), materials());
        let grown = grow_with_structure(&species, &size, &materials, &params, key(i as u64));
        let (tree, structure) = grown.expect("a drawn size grows");
        let alone = grow(&species, &size, &materials, &params, key(i as u64));
        assert_eq!(alone.expect("the same").mesh, tree.mesh);

        let nodes = &structure.nodes;
        assert!(nodes[0].parent.is_none() && nodes[0].order == 0);
        for (k, node) in nodes.iter().enumerate().skip(1) {
            let parent = node.parent.expect("the foot is the only root") as usize;
            assert!(
                parent < k && node.radius_m > 0.0,
                "{}: node {k}",
                species.name
            );
            let same = nodes[parent].axis == node.axis;
            assert_eq!(nodes[parent].order < node.order, !same && node.order > 0);
        }

        let wood = tree.mesh.triangles.iter();
        let branches = wood.filter(|t| [LIMB, BRANCH, DEAD].contains(&t.material));
        let corners = branches.step_by(7).map(|t| t.corners[0] as usize);
        let points: Vec<DVec3> = corners.map(|c| tree.mesh.positions[c].as_dvec3()).collect();
        // Joints are rounded in the mesh.
        let far = |structure: &TreeStructure| {
            let off_m = points.iter().map(|&p| distance_m(structure, p));
            let off_m: Vec<f64> = off_m.collect();
            let share = off_m.iter().filter(|&&m| m > 0.004).count() as f64 / off_m.len() as f64;
            (share, off_m.into_iter().fold(0.0, f64::max))
        };
        let name = &species.name;
        let (share, most_m) = far(&structure);
        assert!(share < 0.15 && most_m < 0.03, "{name}: {share} {most_m} m");
        let mut thick = structure.clone();
        thick.nodes.iter_mut().for_each(|n| n.radius_m += 0.008);
        assert!(far(&thick).0 > 0.5, "{name}: {:?}", far(&thick));

        // The stem's volume in the mesh has the root flare besides.
        let mut stem = structure.clone();
        stem.nodes.retain(|n| n.axis == 0 && n.position_m.z > -0.1);
        let below = structure.nodes.iter().position(|n| n.position_m.z > -0.1);
        let below = below.expect("a stem") as u32;
        for node in &mut stem.nodes {
            node.parent = node.parent.and_then(|p| p.checked_sub(below));
        }
        let ratio = stem.volume_m3() / tree.stem.volume_m3();
        assert!((0.8..1.02).contains(&ratio), "{name}: {ratio}");
        assert!(structure.volume_m3() > stem.volume_m3(), "{name}");
    }
}

/// Neither the buried foot counts, nor what of a branch lies inside of the stem.
#[test]
fn volume_is_that_of_the_wood_above_the_ground() {
    let node = |x: f64, z: f64, radius_m: f64, parent: Option<u32>, axis: u32| WoodNode {
        position_m: DVec3::new(x, 0.0, z),
        radius_m,
        parent,
        axis,
        order: axis.min(1) as u8,
        is_dead: false,
    };
    let nodes = vec![
        node(0.0, -0.5, 0.2, None, 0),
        node(0.0, 5.0, 0.2, Some(0), 0),
        node(0.0, 10.0, 0.2, Some(1), 0),
        // A branch from the middle of the stem, whose second node is inside of it still.
        node(0.0, 5.0, 0.05, Some(1), 1),
        node(0.1, 5.0, 0.05, Some(3), 1),
        node(2.0, 5.0, 0.05, Some(4), 1),
        // A leader, that goes on where the stem ends.
        node(0.0, 10.0, 0.1, Some(2), 2),
        node(0.0, 13.0, 0.1, Some(6), 2),
    ];
    let found = TreeStructure { nodes }.volume_m3();
    let exact = std::f64::consts::PI * (0.04 * 10.0 + 0.0025 * 1.8 + 0.01 * 3.0);
    assert!((found / exact - 1.0).abs() < 1e-12, "{found} for {exact}");
}
