use std::fs;
use std::path::Path;

use nemoral_export::{Error, ExportScene, stem_cylinders, write_sdf};
use nemoral_scene::glam::{DMat4, DQuat, DVec3};

use crate::common::{Labelled, expect_equal, id, long_named_card, scene, truth};
use crate::glb::Glb;

/// The text between two others, each time.
fn all_between<'a>(text: &'a str, from: &str, to: &str) -> Vec<&'a str> {
    let parts = text.split(from).skip(1);
    parts
        .map(|part| part.split(to).next().expect("an end"))
        .collect()
}

fn between<'a>(text: &'a str, from: &str, to: &str) -> &'a str {
    all_between(text, from, to).first().expect(from)
}

fn numbers(text: &str) -> Vec<f64> {
    let words = text.split_whitespace();
    words.map(|n| n.parse().expect("a number")).collect()
}

/// A scene's world and folder.
fn written(scene: &ExportScene) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let size = write_sdf(scene, folder.path()).expect("written");
    let world = fs::read_to_string(folder.path().join("world.sdf")).expect("a world");
    let files = ["meshes", "collision"].map(|name| {
        let files = fs::read_dir(folder.path().join(name)).expect("a folder");
        files
            .map(|f| f.expect("a file").metadata().expect("a size").len())
            .sum::<u64>()
    });
    assert_eq!(size, world.len() as u64 + files[0] + files[1]);
    (folder, world)
}

/// All triangles of the visuals, with the object in the model's name.
fn visuals(folder: &Path, world: &str) -> Vec<Labelled> {
    let mut found = Vec::new();
    for model in all_between(world, "<model name=", "</model>") {
        let name = between(model, "\"", "\"");
        let object = name.rsplit('_').next().and_then(|id| id.parse().ok());
        let at = DVec3::from_slice(&numbers(between(model, "<pose>", "</pose>")));
        for visual in all_between(model, "<visual ", "</visual>") {
            let place = numbers(between(visual, "\"quat_xyzw\">", "</pose>"));
            let scale = numbers(between(visual, "<scale>", "</scale>"));
            let here = DMat4::from_translation(at)
                * DMat4::from_scale_rotation_translation(
                    DVec3::from_slice(&scale),
                    DQuat::from_slice(&place[3..]),
                    DVec3::from_slice(&place),
                );
            let file = folder.join(between(visual, "<uri>", "</uri>"));
            let glb = Glb::read(&fs::read(file).expect("a mesh"));
            // The axes of these files are z up: what a reader of glTF would turn is turned back.
            let turn = DMat4::from_rotation_x(-std::f64::consts::FRAC_PI_2);
            for triangle in glb.triangles() {
                let corners = triangle.corners;
                found.push(Labelled {
                    corners: corners.map(|p| here.transform_point3(turn.transform_point3(p))),
                    object: object.unwrap_or(0),
                    ..triangle
                });
            }
        }
    }
    found
}

#[test]
fn visuals_are_where_rays_meet_them() {
    let scene = scene();
    let (folder, world) = written(&scene);
    expect_equal(&visuals(folder.path(), &world), &truth(&scene));
}

#[test]
fn ground_and_objects_collide_and_low_plants_do_not() {
    let scene = scene();
    let (folder, world) = written(&scene);
    assert!(world.contains("<world name=\"a scene &amp; &lt;more&gt;\">"));
    let model = |name: &str| between(&world, &format!("<model name=\"{name}\">"), "</model>");
    assert!(model("ground").contains("<uri>collision/ground.obj</uri>"));
    assert!(!model("low_plants").contains("<collision"));
    let tree = model(&format!("tree_{}", id(2).to_u64()));
    assert!(tree.contains("<cylinder>") && !tree.contains("collision/"));
    assert!(tree.contains("<visual name=\"Trunks_0\">") && tree.contains("<label>3</label>"));
    let rock = format!("rock_{}", id(3).to_u64());
    assert!(model(&rock).contains(&format!("collision/{rock}.obj")));
    let obj = fs::read_to_string(folder.path().join(format!("collision/{rock}.obj")));
    let obj = obj.expect("a mesh");
    let corners: Vec<Vec<f64>> = all_between(&obj, "\nv ", "\n")
        .into_iter()
        .map(numbers)
        .collect();
    let instance = &scene.instances[2];
    for (corner, position) in corners.iter().zip(&instance.prototype.mesh().positions) {
        let expected = (instance.linear * *position).as_dvec3();
        assert!(DVec3::from_slice(corner).distance(expected) < 1e-5);
    }
    assert_eq!(corners.len(), 4);
}

#[test]
fn cylinders_follow_a_stem() {
    let scene = scene();
    let tree = &scene.instances[1].prototype;
    let cylinders = stem_cylinders(tree, &scene.materials);
    // A tetrahedron 12 m high: its section at z is (1 - z / 12) of its foot.
    assert_eq!(cylinders.len(), 8);
    for (i, cylinder) in cylinders.iter().enumerate() {
        let z = 1.5 * (i as f32 + 0.5);
        assert!((cylinder.centre_m.z - z).abs() < 1e-5 && cylinder.length_m == 1.5);
        let side = 0.3 * (1.0 - z / 12.0);
        assert!(cylinder.centre_m.truncate().min_element() > 0.2 * side);
        assert!(
            (0.25..0.5).contains(&(cylinder.radius_m / side)),
            "{cylinder:?}"
        );
    }
    let rock = &scene.instances[2].prototype;
    assert!(stem_cylinders(rock, &scene.materials).is_empty());
}

#[test]
fn long_names_are_cut() {
    let scene = long_named_card();
    let folder = tempfile::tempdir().expect("a folder");
    write_sdf(&scene, folder.path()).expect("written");
    let world = fs::read_to_string(folder.path().join("world.sdf")).expect("a world");
    expect_equal(&visuals(folder.path(), &world), &truth(&scene));
}

#[test]
fn a_folder_with_something_in_it_is_left_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("mine"), "x").expect("written");
    let error = write_sdf(&scene(), folder.path()).expect_err("refused");
    assert!(matches!(error, Error::NotEmpty { .. }) && error.is_request());
    assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 1);
}
