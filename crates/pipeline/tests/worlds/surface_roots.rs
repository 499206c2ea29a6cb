//! Roots that spread from the feet of old trees.

use nemoral_assets::PlantKind;
use nemoral_realism::World;
use nemoral_scene::glam::Vec3;
use nemoral_scene::{ChunkCoord, ObjectKind, Semantic, Surface};

#[test]
fn roots_go_on_from_old_feet_and_lie_on_the_ground() {
    let world = World::without_cameras("beech", &["assets.individuals=2"]);
    let runner = world.runner(2);
    let model = runner.get(world.forest.ground_model, ()).expect("ground");
    let assets = runner.get(world.forest.assets, ()).expect("assets");
    let (mut roots, mut rooted, mut old) = (0, 0, 0);
    for at in ChunkCoord::new(0, 0).square(1) {
        let ground = model.near(at);
        let objects = runner.get(world.forest.objects, at).expect("objects");
        let feet: Vec<_> = (objects.0.iter())
            .filter(|o| o.kind == ObjectKind::Tree)
            .map(|o| (o.position_m.truncate(), o.radius_m))
            .collect();
        old += feet.iter().filter(|(_, radius_m)| *radius_m > 0.3).count();
        let geometry = (runner.get(world.forest.undergrowth_geometry, at)).expect("a chunk");
        let mut with_roots = vec![false; feet.len()];
        for (place, shape) in geometry.0.iter().flat_map(|g| g.instances()) {
            let is_root = (assets.plants[PlantKind::SurfaceRoot].iter())
                .any(|root| std::sync::Arc::ptr_eq(root.prototype(), shape.prototype()));
            if !is_root {
                continue;
            }
            roots += 1;
            let materials = &assets.library.materials;
            assert!(
                (shape.prototype().mesh().triangles.iter())
                    .all(|t| materials.get(t.material).semantic == Semantic::SurfaceRoot)
            );
            let world_m = |local: Vec3| {
                let p = (place.position_m + place.linear * local).as_dvec3();
                at.origin_m(50.0).extend(0.0) + p
            };
            let start = world_m(Vec3::ZERO);
            let away = |foot: &(nemoral_scene::glam::DVec2, f64)| {
                (foot.0.distance(start.truncate()) / foot.1 - 1.0).abs()
            };
            let of = (0..feet.len())
                .min_by(|&a, &b| away(&feet[a]).total_cmp(&away(&feet[b])))
                .expect("a chunk with a root has a tree");
            // A root begins at the end of a lobe, and the greatest lobe makes the radius.
            assert!(away(&feet[of]) < 0.25, "{}", away(&feet[of]));
            assert!(feet[of].1 > 0.13, "a tree of {} m has roots", feet[of].1);
            with_roots[of] = true;
            let end = shape.prototype().bounds().max.x;
            for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
                let p = world_m(Vec3::X * (share * end));
                let off = p.z - ground.height_m(p.truncate());
                assert!(off.abs() < 0.07, "{off} at {p}");
                assert!(ground.trail_edge_m(p.truncate()) > 0.2);
            }
        }
        rooted += with_roots.iter().filter(|has| **has).count();
    }
    println!("{roots} roots of {rooted} trees; {old} feet are wider than 0.3 m");
    assert!(old > 20 && roots > 60, "{roots} roots, {old} old trees");
    assert!(
        rooted as f64 > 0.4 * f64::from(old as u32),
        "{rooted} of {old}"
    );
}
