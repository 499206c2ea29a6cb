//! Models of users: a tree that was exported is the same tree when it comes back, and stands in a
//! forest as grown ones do.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use nemoral_export::{GltfParams, to_glb};
use nemoral_import::{Model, ModelFiles, ModelKind};
use nemoral_pipeline::tree_scene;
use nemoral_scene::{
    ChunkCoord, MaterialLibrary, ObjectKind, ObjectRecord, Prototype, Semantic, TreeRecord,
};
use nemoral_tests::{World, record};

use crate::sensors::{assert_agreement, frames_of};

/// One-sided areas of a shape by semantic, m², masks not considered.
fn areas_m2(shape: &Prototype, materials: &MaterialLibrary) -> BTreeMap<Semantic, f64> {
    let mut areas = BTreeMap::new();
    let mesh = shape.mesh();
    let triangles = mesh.triangles.iter().map(|t| {
        let [a, b, c] = t.corners.map(|i| mesh.positions[i as usize]);
        (t.material, f64::from((b - a).cross(c - a).length()) / 2.0)
    });
    let cards = shape
        .cards()
        .iter()
        .map(|c| (c.material, f64::from(c.area_m2())));
    for (material, area) in triangles.chain(cards) {
        *areas.entry(materials.get(material).semantic).or_default() += area;
    }
    areas
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn a_tree_that_was_exported_is_the_same_tree() {
    for species in ["beech", "scots_pine"] {
        let scene = tree_scene(species, Some(0.25), true, 3).expect("a tree");
        let glb = to_glb(&scene, GltfParams::default()).expect("a file");
        let files = ModelFiles::single("tree.glb", glb);
        let model = Model::read(&files, ModelKind::Tree).expect("a tree");
        assert!(
            model.notes.is_empty(),
            "nothing is guessed: {:?}",
            model.notes
        );
        let mut materials = MaterialLibrary::new();
        let shape = model.prototype("tree", &mut materials).expect("sound");
        let ours = &scene.instances[0].prototype;
        let (cards, wood) = (ours.cards().len(), ours.mesh().triangles.len());
        let quads = shape.quads().len();
        println!("{species}: {wood} triangles and {cards} cards; {quads} cards come back");
        // Triangles without area, at the tips of wood, are left out.
        let triangles = shape.mesh().triangles.len();
        assert!(triangles <= wood + 2 * cards && 100 * triangles > 99 * (wood + 2 * cards));
        assert_eq!(quads, cards);
        let (mine, its) = (
            areas_m2(ours, &scene.materials),
            areas_m2(&shape, &materials),
        );
        assert!(
            mine.len() > 2 && mine.keys().eq(its.keys()),
            "{mine:?} {its:?}"
        );
        for (semantic, area) in &mine {
            assert!((its[semantic] / area - 1.0).abs() < 1e-4, "{semantic:?}");
        }
        let (a, b) = (ours.bounds(), shape.bounds());
        assert!((a.min - b.min).length() < 1e-5 && (a.max - b.max).length() < 1e-5);
        let mut masks = 0;
        for material in &model.materials {
            let mut of_name = scene.materials.materials().iter();
            let own = of_name
                .find(|m| m.name == material.name)
                .expect("our own name");
            assert_eq!(material.semantic, own.semantic);
            assert_eq!(material.optics, own.optics, "{}", own.name);
            assert!((material.transmittance - own.transmittance).length() < 1e-6);
            assert!((material.albedo.mean() - own.albedo.mean()).length() < 0.01);
            match (&material.mask, &own.mask) {
                (Some(mask), Some(own)) => {
                    masks += 1;
                    for row in 0..own.height() {
                        for column in 0..own.width() {
                            let place = |i: usize, n: usize| (i as f32 + 0.5) / n as f32;
                            let (u, v) = (place(column, own.width()), place(row, own.height()));
                            assert_eq!(mask.is_opaque(u, v), own.texel(column, row));
                        }
                    }
                }
                (None, None) => {}
                (None, Some(own)) => assert_eq!(own.opaque_fraction(), 1.0),
                (Some(_), None) => panic!("{} has got a mask", own.name),
            }
        }
        assert!(masks > 0);
        let (tree, row) = (model.tree.expect("a tree"), &scene.trees[0]);
        println!("{tree:?}\n{row:?}");
        let near = |a: f64, b: f64, share: f64| (a / b - 1.0).abs() < share;
        assert!(near(tree.dbh_m, row.dbh_m, 0.03), "{tree:?}");
        assert!(
            near(model.extent.height_m, row.height_m, 0.02),
            "{:?}",
            model.extent
        );
        // What is seen is less than what the leaves of a shoot have: they overlap, and of needles
        // in an image even more.
        let share = tree.leaf_area_m2 / row.leaf_area_m2;
        assert!((0.55..1.02).contains(&share), "{share}");
        assert!(
            near(tree.crown_radius_m, row.crown_radius_m, 0.2),
            "{tree:?}"
        );
        assert!(
            near(tree.stem_volume_m3, row.stem_volume_m3, 0.4),
            "{tree:?}"
        );
        let base_m = (tree.crown_base_m - row.crown_base_m).abs();
        assert!(base_m < 0.05 * row.height_m && tree.is_alive, "{tree:?}");
    }
}

/// Length and radii of a trunk, metres.
const TRUNK_M: (f64, [f64; 2]) = (5.0, [0.3, 0.2]);

/// A trunk that lies to the north-east.
fn trunk_obj() -> String {
    let mut obj = "usemtl wood\n".to_owned();
    let (length_m, radii_m) = TRUNK_M;
    for (end, radius_m) in radii_m.into_iter().enumerate() {
        let along = (end as f64 - 0.5) * length_m * std::f64::consts::FRAC_1_SQRT_2;
        for side in 0..16 {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(side) / 16.0).sin_cos();
            let aside = radius_m * cos * std::f64::consts::FRAC_1_SQRT_2;
            let z = radius_m * (1.0 + sin);
            obj += &format!("v {} {} {z}\n", along + aside, along - aside);
        }
    }
    for side in 0..16 {
        let (a, b) = (side + 1, (side + 1) % 16 + 1);
        obj += &format!("f {a} {b} {} {}\n", b + 16, a + 16);
    }
    let ring = |first: u32| {
        (first..first + 16)
            .map(|i| format!(" {i}"))
            .collect::<String>()
    };
    obj + &format!("f{}\nf{}\n", ring(1), ring(17))
}

/// A forest in which half of the trees and logs and all rocks are models.
fn world() -> World {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let scene = tree_scene("silver_birch", Some(0.18), true, 5).expect("a tree");
    let glb = to_glb(&scene, GltfParams::default()).expect("a file");
    nemoral_files::write(&path("birch.glb"), &glb).expect("written");
    let obj = "mtllib rock.mtl\nusemtl granite\nv -50 -50 -10\nv 50 -50 -10\nv 50 50 -10\n\
               v -50 50 -10\nv 0 0 60\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\nf 4 3 2 1\n";
    nemoral_files::write(&path("rock.obj"), obj.as_bytes()).expect("written");
    let mtl = b"newmtl granite\nKd 0.4 0.38 0.35\n";
    nemoral_files::write(&path("rock.mtl"), mtl).expect("written");
    let sidecar = b"up = \"z\"\nmetres_per_unit = 0.01\n";
    nemoral_files::write(&path("rock.obj.toml"), sidecar).expect("written");
    nemoral_files::write(&path("trunk.obj"), trunk_obj().as_bytes()).expect("written");
    nemoral_files::write(
        &path("trunk.obj.toml"),
        b"up = \"z\"\nmetres_per_unit = 1.0\n",
    )
    .expect("written");
    let file = |name: &str| path(name).display().to_string();
    let settings = [
        "frames=5".to_owned(),
        "chunks.visible_radius_m=40".to_owned(),
        "chunks.undergrowth_radius_m=15".to_owned(),
        "camera.width_px=160".to_owned(),
        "camera.height_px=90".to_owned(),
        "camera.fov.horizontal_deg=100".to_owned(),
        "camera.mount_z_m=1.35".to_owned(),
        "lidar.pulses=20000".to_owned(),
        "lidar.noise.model=off".to_owned(),
        "robot.spacing_m=9".to_owned(),
        "robot.speed_m_s=1e-6".to_owned(),
        "assets.individuals=2".to_owned(),
        format!("models.birch.file={}", file("birch.glb")),
        "models.birch.share=0.5".to_owned(),
        "models.birch.species=my_birch".to_owned(),
        format!("models.boulder.file={}", file("rock.obj")),
        "models.boulder.kind=rock".to_owned(),
        "models.boulder.share=1".to_owned(),
        "models.boulder.scale_min=0.3".to_owned(),
        "models.boulder.scale_max=1.5".to_owned(),
        format!("models.trunk.file={}", file("trunk.obj")),
        "models.trunk.kind=log".to_owned(),
        "models.trunk.share=0.5".to_owned(),
        "models.trunk.decay=2".to_owned(),
        "deadwood.volume_m3_ha=40".to_owned(),
        "placement.rocks_max=30".to_owned(),
        "placement.rocks_min=20".to_owned(),
    ];
    World::new("demo", &settings.each_ref().map(String::as_str))
}

static WORLD: LazyLock<World> = LazyLock::new(world);

/// The rows of all objects around, and of all trees.
fn inventory() -> (Vec<ObjectRecord>, Vec<TreeRecord>) {
    let runner = WORLD.runner(2);
    let assets = runner.get(WORLD.forest.assets, ()).expect("plants");
    let (mut objects, mut trees) = (Vec::new(), Vec::new());
    for (x, y) in (-2..=2).flat_map(|x| (-2..=2).map(move |y| (x, y))) {
        let of_chunk = runner.get(WORLD.forest.objects, ChunkCoord::new(x, y));
        for object in &of_chunk.expect("objects").0 {
            objects.push(assets.object_record(object));
            trees.extend(assets.tree_record(object));
        }
    }
    (objects, trees)
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn models_are_in_the_inventory_in_their_shares() {
    let (objects, trees) = inventory();
    let models = trees.iter().filter(|t| t.species == "my_birch").count();
    let share = models as f64 / trees.len() as f64;
    println!("{models} of {} trees are models", trees.len());
    assert!(
        trees.len() > 1000 && (0.44..0.56).contains(&share),
        "{share}"
    );
    for tree in trees.iter().filter(|t| t.species == "my_birch") {
        assert!((0.15..0.21).contains(&tree.dbh_m) && tree.alive, "{tree:?}");
    }
    let rocks = objects.iter().filter(|o| o.kind == ObjectKind::Rock);
    let rocks: Vec<_> = rocks.filter(|o| o.species == "boulder").collect();
    assert!(rocks.len() > 300, "{}", rocks.len());
    let heights = || rocks.iter().map(|r| r.height_m);
    // 60 cm above its foot, and from 0.3 to 1.5 times as large.
    assert!(heights().all(|h| (0.17..0.91).contains(&h)));
    assert!(heights().fold(0.0, f64::max) > 0.8 && heights().fold(9.0, f64::min) < 0.25);
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn logs_of_models_lie_among_the_others() {
    let runner = WORLD.runner(2);
    let assets = runner.get(WORLD.forest.assets, ()).expect("plants");
    let (length_m, [thick, thin]) = TRUNK_M;
    let cone_m3 =
        std::f64::consts::PI / 3.0 * length_m * (thick * thick + thick * thin + thin * thin);
    let (mut of_model, mut others, mut volume_m3) = (0, 0, 0.0);
    for (x, y) in (-4..=4).flat_map(|x| (-4..=4).map(move |y| (x, y))) {
        let objects = runner.get(WORLD.forest.objects, ChunkCoord::new(x, y));
        for log in (objects.expect("objects").0.iter()).filter_map(|o| assets.deadwood_record(o)) {
            volume_m3 += log.volume_m3;
            if log.species != "trunk" {
                others += 1;
                continue;
            }
            of_model += 1;
            assert_eq!(log.decay.number(), 2);
            let scale = log.length_m / length_m;
            assert!((0.89..=1.11).contains(&scale), "{log:?}");
            // It keeps its form.
            let near = |a: f64, b: f64| (a / b - 1.0).abs() < 0.05;
            assert!(near(log.volume_m3, cone_m3 * scale.powi(3)), "{log:?}");
            assert!(near(log.diameter_m[0], scale * 2.0 * thick), "{log:?}");
        }
    }
    println!("{of_model} logs of a model, {others} others, {volume_m3:.0} m³");
    assert!(of_model > 150, "{of_model}");
    let share = f64::from(of_model) / f64::from(of_model + others);
    assert!((0.40..0.60).contains(&share), "{share}");
    // 81 chunks of a quarter of a hectare; some find no place.
    let per_ha = volume_m3 / (81.0 * 0.25);
    assert!((28.0..44.0).contains(&per_ha), "{per_ha}");
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn a_stem_map_names_models() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let scene = tree_scene("silver_birch", Some(0.18), true, 5).expect("a tree");
    let glb = to_glb(&scene, GltfParams::default()).expect("a file");
    nemoral_files::write(&path("birch.glb"), &glb).expect("written");
    // In the middle of the first chunk; the third and the fourth say less.
    let stems = "id,x,y,species,dbh_cm,height_m\na,10,10,old_birch,30,15\n\
                 b,20,10,beech,30,20\nc,10,20,old_birch,27,\nd,20,20,old_birch,,\n";
    nemoral_files::write(&path("stems.csv"), stems.as_bytes()).expect("written");
    let file = |name: &str| path(name).display().to_string();
    let settings = [
        format!("site.stems.path={}", file("stems.csv")),
        format!("models.old_birch.file={}", file("birch.glb")),
        "models.old_birch.share=0".to_owned(),
        "assets.individuals=1".to_owned(),
    ];
    let world = World::new("demo", &settings.each_ref().map(String::as_str));
    let runner = world.runner(2);
    let assets = runner.get(world.forest.assets, ()).expect("plants");
    let objects = runner.get(world.forest.objects, ChunkCoord::new(0, 0));
    let objects = objects.expect("objects");
    let trees = objects.0.iter().filter_map(|o| assets.tree_record(o));
    let mut trees: Vec<TreeRecord> = trees.collect();
    let others = trees.iter().filter(|t| t.field_id.is_empty());
    assert_eq!(others.filter(|t| t.species == "old_birch").count(), 0);
    trees.retain(|t| !t.field_id.is_empty());
    trees.sort_by(|a, b| a.field_id.cmp(&b.field_id));
    let row = |t: &TreeRecord| (t.species.clone(), t.position_m.x, t.position_m.y);
    let birch = |x: f64, y: f64| ("old_birch".to_owned(), x, y);
    let expected = [
        birch(10.0, 10.0),
        ("beech".to_owned(), 20.0, 10.0),
        birch(10.0, 20.0),
        birch(20.0, 20.0),
    ];
    assert_eq!(trees.iter().map(row).collect::<Vec<_>>(), expected);
    let sizes: Vec<[f64; 2]> = trees.iter().map(|t| [t.dbh_m, t.height_m]).collect();
    let [own_dbh_m, own_height_m] = sizes[3];
    assert!((own_dbh_m / 0.18 - 1.0).abs() < 0.03, "{own_dbh_m}");
    let near = |a: [f64; 2], b: [f64; 2]| (0..2).all(|k| (a[k] / b[k] - 1.0).abs() < 1e-9);
    assert!(near(sizes[0], [0.30, 15.0]) && near(sizes[1], [0.30, 20.0]));
    assert!(
        near(sizes[2], [0.27, own_height_m * 0.27 / own_dbh_m]),
        "{sizes:?}"
    );
}

#[test]
fn sensors_agree_on_models() {
    let frames = frames_of(&WORLD);
    println!("{}", assert_agreement(&frames, 40_000, &[1, 3, 4]));
    let runner = WORLD.runner(2);
    let assets = runner.get(WORLD.forest.assets, ()).expect("plants");
    // Points on models are labelled as what they are.
    let (mut stems, mut leaves, mut rocks, mut logs) = (0, 0, 0, 0);
    let mut of_models = std::collections::BTreeSet::new();
    for (x, y) in (-3..=3).flat_map(|x| (-3..=3).map(move |y| (x, y))) {
        let objects = runner.get(WORLD.forest.objects, ChunkCoord::new(x, y));
        for object in &objects.expect("objects").0 {
            let species = assets.object_record(object).species;
            if ["my_birch", "boulder", "trunk"].contains(&species.as_str()) {
                of_models.insert(object.object);
            }
        }
    }
    for frame in 0..WORLD.config.frames {
        let scans = runner.get(WORLD.forest.scans, frame).expect("a scan");
        for point in scans[0].iter().filter(|p| of_models.contains(&p.object)) {
            match point.semantic {
                Semantic::Stem | Semantic::Limb | Semantic::RootFlare => stems += 1,
                Semantic::Leaf => leaves += 1,
                Semantic::Rock => rocks += 1,
                Semantic::Log => logs += 1,
                Semantic::Branch | Semantic::Twig => {}
                other => panic!("a model is {other:?}"),
            }
        }
    }
    println!("on models: {stems} on stems, {leaves} on leaves, {rocks} on rocks, {logs} on logs");
    assert!(
        stems > 500 && leaves > 500 && rocks > 50 && logs > 50,
        "{stems} {leaves} {rocks} {logs}"
    );
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn the_same_models_make_the_same_forest() {
    let again = world();
    let frame = |world: &World, threads| record(&world.forest, &world.runner(threads), 3);
    let (first, second) = (
        frame(&WORLD, 2).expect("a frame"),
        frame(&again, 1).expect("a frame"),
    );
    assert!(first == second, "frame 3 differs");
    assert_eq!(again.config.models.len(), 3);
}
