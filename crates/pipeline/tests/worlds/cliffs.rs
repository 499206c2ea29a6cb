//! Cliffs: bare rock, on which nothing stands, between ground as elsewhere.

use nemoral_realism::World;
use nemoral_scene::{ChunkCoord, ObjectKind, Semantic};

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn cliffs_are_bare_rock_on_which_nothing_stands() {
    let steep = [
        "assets.individuals=1",
        "terrain.terraces=1",
        "terrain.cliffs=1",
        "terrain.terrace_step_m=7",
        "terrain.max_height_m=80",
        "terrain.scale_m=150",
    ];
    let world = World::without_cameras("oak-mixed", &steep);
    let runner = world.runner(2);
    let model = runner.get(world.forest.ground_model, ()).expect("ground");
    let assets = runner.get(world.forest.assets, ()).expect("assets");
    let materials = &assets.library.materials;
    // Of triangles of the ground: bare and steep, bare and gentle, covered and steep.
    let mut areas_m2 = [0.0_f32; 3];
    let (mut plants, mut on_steep) = (0, 0);
    for at in ChunkCoord::new(0, 0).square(1) {
        let ground = model.near(at);
        let objects = runner.get(world.forest.objects, at).expect("objects");
        let stands = |kind| !matches!(kind, ObjectKind::Log | ObjectKind::RootPlate);
        let places = objects.0.iter().filter(|o| stands(o.kind));
        let places = places.map(|o| o.position_m.truncate());
        let patches = runner.get(world.forest.undergrowth, at).expect("patches");
        let patches = patches.iter().map(|p| p.point.position_m);
        for p in places.chain(patches) {
            plants += 1;
            on_steep += usize::from(ground.is_rock_face(p) && ground.trail_edge_m(p) > 14.0);
        }
        let geometry = runner
            .get(world.forest.object_geometry, at)
            .expect("a chunk");
        let mut shapes = geometry
            .group
            .instances()
            .iter()
            .map(|(_, s)| s.prototype());
        let mesh = (shapes.find(|s| s.name() == "ground"))
            .expect("ground")
            .mesh();
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.corners.map(|i| mesh.positions[i as usize]);
            let normal = (b - a).cross(c - a);
            let slope = normal.truncate().length() / normal.z.max(1e-9);
            let is_rock = materials.get(triangle.material).semantic == Semantic::Rock;
            let p = at.origin_m(50.0) + ((a + b + c) / 3.0).truncate().as_dvec2();
            // Cuts of trails are of earth.
            if ground.trail_edge_m(p) < 14.0 {
                continue;
            }
            let kind = match (is_rock, slope > 1.25, slope < 0.85) {
                (true, true, _) => 0,
                (true, _, true) => 1,
                (false, true, _) => 2,
                _ => continue,
            };
            areas_m2[kind] += 0.5 * normal.length();
        }
    }
    println!("{on_steep} of {plants} plants on steep rock; {areas_m2:?} m2");
    assert!(plants > 1000 && on_steep == 0, "{on_steep} of {plants}");
    let [faces, gentle, covered] = areas_m2;
    assert!(faces > 200.0, "{areas_m2:?}");
    assert!(
        gentle < 0.02 * faces && covered < 0.03 * faces,
        "{areas_m2:?}"
    );
}
