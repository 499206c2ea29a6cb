//! Models of users: what is read of them, what is measured, what is refused.

use crate::common::{self, DBH_M, HEIGHT_M, LEAVES};
use nemoral_import::{ImportError, Model, ModelFiles, ModelKind};
use nemoral_scene::glam::Vec3;
use nemoral_scene::{MaterialLibrary, Semantic};
use proptest::prelude::*;
use serde_json::{Value, json};

fn read(files: &ModelFiles) -> Model {
    Model::read(files, ModelKind::Tree).expect("a tree")
}

fn none(_: &str) -> Option<Vec<u8>> {
    None
}

fn glb_with(sidecar: &str, change: impl Fn(&mut Value)) -> Result<Model, ImportError> {
    let (mut document, bytes) = common::document();
    change(&mut document);
    let file = common::glb(&document, &bytes);
    let files = common::gathered("tree.glb", file, sidecar, none)?;
    Model::read(&files, ModelKind::Tree)
}

fn obj_with(sidecar: &str) -> Model {
    let files = common::gathered("tree.obj", common::tree_obj(), sidecar, common::beside_obj);
    read(&files.expect("all files are there"))
}

/// Checks that a model is the tree of `common`.
fn is_the_tree(model: &Model) {
    let tree = model.tree.as_ref().expect("a tree");
    assert!((tree.dbh_m - f64::from(DBH_M)).abs() < 1e-4, "{tree:?}");
    assert!((model.extent.height_m - f64::from(HEIGHT_M)).abs() < 1e-5);
    assert!((tree.foot_radius_m - 0.2).abs() < 0.01, "{tree:?}");
    // Half of each leaf is opaque.
    let area = LEAVES as f64 * 0.25 / 2.0;
    assert!((tree.leaf_area_m2 / area - 1.0).abs() < 0.03, "{tree:?}");
    assert!((3.9..4.5).contains(&tree.crown_base_m), "{tree:?}");
    assert!((1.4..2.1).contains(&tree.crown_radius_m), "{tree:?}");
    let volume = f64::from(DBH_M * DBH_M) * std::f64::consts::FRAC_PI_4 * 6.0;
    assert!(
        (tree.stem_volume_m3 / volume - 1.0).abs() < 0.03,
        "{tree:?}"
    );
    // The stem is a cylinder.
    let cuts = &tree.stem_cuts_m;
    assert!(
        cuts.len() > 30 && cuts.windows(2).all(|w| w[0][0] < w[1][0]),
        "{cuts:?}"
    );
    let off_m = |cut: &[f64; 2]| (cut[1] - f64::from(DBH_M)).abs();
    assert!(cuts.iter().all(|cut| off_m(cut) < 1e-3), "{cuts:?}");
    assert!(tree.is_alive && tree.lean_rad < 0.03);
    let semantics: Vec<Semantic> = model.materials.iter().map(|m| m.semantic).collect();
    assert_eq!(semantics, [Semantic::Stem, Semantic::Leaf]);
    let [bark, leaf] = &model.materials[..] else {
        unreachable!("two materials")
    };
    assert!(bark.mask.is_none() && bark.transmittance == Vec3::ZERO);
    assert!((bark.albedo.mean() - Vec3::new(0.2, 0.15, 0.1)).length() < 0.01);
    let mask = leaf.mask.as_ref().expect("cut out");
    assert_eq!((mask.width(), mask.height()), (6, 4));
    for row in 0..4 {
        assert!(
            (0..6).all(|column| mask.texel(column, row) == (row < 2)),
            "row {row}"
        );
    }
    assert!(leaf.optics.nm905.reflectance > 0.4 && leaf.transmittance.y > 0.0);
    // Each leaf is a card, up along +z with the picture's top above.
    let mut library = MaterialLibrary::new();
    let shape = model.prototype("tree", &mut library).expect("sound");
    assert_eq!(shape.quads().len(), LEAVES);
    for quad in shape.quads() {
        let (card, _) = quad.card(shape.mesh());
        let down = [card.edge_u, card.edge_v]
            .into_iter()
            .find(|e| e.z.abs() > 0.4);
        assert!((down.expect("upright").length() - 0.5).abs() < 1e-5);
    }
    for triangle in &shape.mesh().triangles {
        for corner in triangle.corners {
            let at = shape.mesh().positions[corner as usize];
            if library.get(triangle.material).mask.is_some() {
                let v = shape.mesh().uv(corner).y;
                let is_top = shape.mesh().positions[triangle.corners[0] as usize].z < at.z + 1e-6;
                assert!((0.0..=1.0).contains(&v) && (v == 1.0 || is_top));
            }
        }
    }
}

#[test]
fn the_same_tree_in_every_format_is_the_same() {
    let glb = ModelFiles::single("tree.glb", common::tree_glb());
    is_the_tree(&read(&glb));
    let gltf = ModelFiles::single("tree.gltf", common::tree_gltf());
    let gltf = read(&gltf);
    is_the_tree(&gltf);
    assert_eq!(gltf.mesh, read(&glb).mesh);
    let told = "up = \"y\"\nmetres_per_unit = 1\n";
    let obj = obj_with(told);
    is_the_tree(&obj);
    let guesses = |model: &Model| model.notes.iter().any(|n| n.contains("axes and unit"));
    assert!(!guesses(&obj), "{:?}", obj.notes);
    let guessed = obj_with("");
    is_the_tree(&guessed);
    assert!(guesses(&guessed));
    assert!(
        guessed
            .notes
            .iter()
            .any(|n| n.contains("OakLeaves is leaf")),
        "{:?}",
        guessed.notes
    );
    // In centimetres.
    let (mut document, bytes) = common::document();
    document["nodes"][0]["scale"] = json!([100.0, 100.0, 100.0]);
    let file = common::glb(&document, &bytes);
    let files = common::gathered("tree.glb", file, "metres_per_unit = 0.01", none);
    is_the_tree(&read(&files.expect("a sidecar")));
}

#[test]
fn nodes_turn_move_and_mirror() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    // z up in the file, as our own export has it below a node that turns.
    let turned = glb_with("", |document| {
        document["nodes"][0]["rotation"] = json!([-half, 0.0, 0.0, half]);
        document["nodes"][1]["rotation"] = json!([half, 0.0, 0.0, half]);
    });
    let plain = glb_with("", |_| {}).expect("a tree");
    assert_eq!(
        turned.expect("a tree").mesh,
        plain.mesh,
        "there and back is exact"
    );
    let mirrored = glb_with("", |document| {
        document["nodes"][1]["matrix"] = json!([-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
    });
    let mirrored = mirrored.expect("a tree");
    is_the_tree(&mirrored);
    for triangle in &mirrored.mesh.triangles {
        let [a, b, c] = triangle
            .corners
            .map(|i| mirrored.mesh.positions[i as usize]);
        let normal = mirrored.mesh.normal(triangle.corners[0]).expect("normals");
        assert!(
            (b - a).cross(c - a).dot(normal) > 0.0,
            "still seen from outside"
        );
    }
    // What stands elsewhere is brought to the origin, and it is said so.
    let moved = glb_with("", |document| {
        document["nodes"][1]["translation"] = json!([100.0, 50.0, -30.0]);
    });
    let moved = moved.expect("a tree");
    assert_eq!(
        moved
            .notes
            .iter()
            .filter(|n| n.contains("foot") || n.contains("ground"))
            .count(),
        2
    );
    let lowest = moved
        .mesh
        .positions
        .iter()
        .map(|p| p.z)
        .fold(f32::MAX, f32::min);
    assert!(lowest.abs() < 1e-4, "{lowest}");
    let foot = moved
        .mesh
        .positions
        .iter()
        .find(|p| p.z < 0.01)
        .expect("a foot");
    assert!((foot.truncate().length() - 0.2).abs() < 0.01, "{foot}");
}

#[test]
fn names_and_sidecars_say_what_is_what() {
    let rename = |document: &mut Value| {
        document["materials"][0]["name"] = json!("Material.001");
        document["materials"][1]["name"] = json!("Material.002");
    };
    let refused = glb_with("", rename).expect_err("unknown").to_string();
    assert!(
        refused.contains("Material.001 (of mesh, all of it, tree)") && refused.contains("002"),
        "{refused}"
    );
    assert!(refused.contains("needle"), "{refused}");
    let sidecar = "[semantics]\n\"*.001\" = \"stem\"\n\"Material.002\" = \"needle\"\n";
    let told = glb_with(sidecar, rename).expect("told");
    let semantics: Vec<Semantic> = told.materials.iter().map(|m| m.semantic).collect();
    assert_eq!(semantics, [Semantic::Stem, Semantic::Needle]);
    // Nodes have names too, and what is not wanted is left out.
    let bare = glb_with("[semantics]\nOakLeaves = \"nothing\"\n", |_| {}).expect("a bare tree");
    assert_eq!(bare.materials.len(), 1);
    assert!(!bare.tree.expect("a tree").is_alive);
    let by_node = glb_with("[semantics]\ntree = \"snag\"\n", rename).expect("told by its node");
    assert!(
        by_node
            .materials
            .iter()
            .all(|m| m.semantic == Semantic::Snag)
    );
    // A rock needs no names.
    let (mut document, bytes) = common::document();
    rename(&mut document);
    let files = ModelFiles::single("rock.glb", common::glb(&document, &bytes));
    let rock = Model::read(&files, ModelKind::Rock).expect("a rock");
    assert!(rock.tree.is_none() && rock.materials.iter().all(|m| m.semantic == Semantic::Rock));
}

#[test]
fn a_picture_that_repeats_cuts_out_what_it_shows() {
    // Leaves whose texture coordinates lie in 2..5 and -3..-2 show the picture three times.
    let shifted = |document: &mut Value| {
        document["materials"][1]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] =
            json!({ "KHR_texture_transform": { "offset": [2.0, -3.0], "scale": [3.0, 1.0] } });
    };
    let model = glb_with("", shifted).expect("a tree");
    let mask = model.materials[1].mask.as_ref().expect("cut out");
    assert_eq!((mask.width(), mask.height()), (18, 4));
    assert!(
        model
            .mesh
            .triangles
            .iter()
            .filter(|t| t.material.0 == 1)
            .all(|t| {
                t.corners.iter().all(|&c| {
                    let uv = model.mesh.uv(c);
                    (0.0..=1.0).contains(&uv.x) && (0.0..=1.0).contains(&uv.y)
                })
            })
    );
    let area = LEAVES as f64 * 0.25 / 2.0;
    let measured = model.tree.expect("a tree").leaf_area_m2;
    assert!((measured / area - 1.0).abs() < 0.03, "{measured}");
    let refused = glb_with("", |document| {
        document["materials"][1]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] =
            json!({ "KHR_texture_transform": { "scale": [9000.0, 1.0] } });
    });
    let message = refused.expect_err("too often").to_string();
    assert!(
        message.contains("material OakLeaves") && message.contains("8192"),
        "{message}"
    );
}

#[test]
fn what_is_wrong_is_named() {
    let refused = |change: fn(&mut Value)| {
        let refused = glb_with("", change);
        refused.expect_err("refused").to_string()
    };
    for (message, part) in [
        (
            refused(|d| d["asset"]["version"] = json!("1.0")),
            "glTF 1.0",
        ),
        (
            refused(|d| d["extensionsRequired"] = json!(["KHR_draco_mesh_compression"])),
            "KHR_draco",
        ),
        (refused(|d| d["nodes"][1]["children"] = json!([0])), "twice"),
        (
            refused(|d| d["nodes"][0]["children"] = json!([9])),
            "nodes[9] does not exist",
        ),
        (
            refused(|d| d["accessors"][0]["count"] = json!(1_000_000)),
            "accessors[0] is outside",
        ),
        (
            refused(|d| d["accessors"][0]["count"] = json!(u64::MAX)),
            "at most 6000000",
        ),
        (
            refused(|d| d["accessors"][2]["componentType"] = json!(5126)),
            "unsigned",
        ),
        (
            refused(|d| d["accessors"][1]["type"] = json!("VEC3")),
            "must be VEC2",
        ),
        (
            refused(|d| d["bufferViews"][0]["byteLength"] = json!(u64::MAX)),
            "outside",
        ),
        (
            refused(|d| d["meshes"][0]["primitives"] = json!([])),
            "no triangles",
        ),
        (
            refused(|d| d["materials"][1]["alphaMode"] = json!("SOME")),
            "alphaMode = SOME",
        ),
        (
            refused(|d| d["nodes"][0]["scale"] = json!([1e6, 1e6, 1e6])),
            "10000 m",
        ),
        (
            refused(|d| d["nodes"][0]["scale"] = json!([0.001, 0.001, 0.001])),
            "dbh_m",
        ),
        (
            refused(|d| d["images"][0] = json!({ "uri": "leaf.png" })),
            "leaf.png, which is not",
        ),
        (
            refused(|d| d["images"][0]["bufferView"] = json!(0)),
            "neither PNG nor JPEG",
        ),
    ] {
        assert!(message.contains(part), "{message}: should say {part}");
    }
    let deep = |document: &mut Value| {
        let nodes = (0..80).map(|i| json!({ "children": [i + 1] }));
        let mut nodes: Vec<Value> = nodes.collect();
        nodes.push(json!({ "mesh": 0 }));
        document["nodes"] = json!(nodes);
    };
    assert!(
        glb_with("", deep)
            .expect_err("deep")
            .to_string()
            .contains("deeper than 64")
    );
    // A copy at each of many nodes is bounded together.
    let many = |document: &mut Value| {
        let nodes: Vec<Value> = (0..90_000).map(|_| json!({ "mesh": 0 })).collect();
        document["scenes"][0]["nodes"] = json!((0..nodes.len()).collect::<Vec<_>>());
        document["nodes"] = json!(nodes);
    };
    assert!(
        glb_with("", many)
            .expect_err("many")
            .to_string()
            .contains("at most 2000000")
    );
    let bomb = common::png(8193, 1, &vec![255; 4 * 8193]);
    let obj = common::gathered("tree.obj", common::tree_obj(), "", |name| {
        if name.ends_with("png") {
            Some(bomb.clone())
        } else {
            common::beside_obj(name)
        }
    });
    let message = Model::read(&obj.expect("files"), ModelKind::Tree)
        .expect_err("large")
        .to_string();
    assert!(message.contains("materials/leaf.png"), "{message}");
}

#[test]
fn files_elsewhere_are_asked_for_by_their_own_names() {
    // Whoever answers refuses them: the names are passed on as they are.
    let file = br#"{"asset":{"version":"2.0"},"buffers":[{"uri":"..%2F..%2Fetc%2Fpasswd"}]}"#;
    let mut asked = Vec::new();
    let refused = ModelFiles::gather("x.gltf", file.to_vec(), &mut |name, _| {
        asked.push(name.to_owned());
        Ok(None)
    });
    assert!(refused.is_err());
    assert_eq!(asked, ["x.gltf.toml", "../../etc/passwd"]);
    let file = br#"{"asset":{"version":"2.0"},"buffers":[{"uri":"http://example.org/a.bin"}]}"#;
    let refused = ModelFiles::gather("x.gltf", file.to_vec(), &mut |_, _| Ok(None));
    assert!(
        refused
            .expect_err("elsewhere")
            .to_string()
            .contains("no relative path")
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Wherever, however turned about the vertical and however large a tree stands in its file, it
    /// is the same tree.
    #[test]
    fn places_and_turns_do_not_matter(
        yaw in 0.0..std::f64::consts::TAU, x in -1e3..1e3, z in -1e3..1e3, scale in 0.2..5.0,
    ) {
        let (sin, cos) = (yaw / 2.0).sin_cos();
        let model = glb_with(&format!("metres_per_unit = {}", 1.0 / scale), |document| {
            document["nodes"][0]["rotation"] = json!([0.0, sin, 0.0, cos]);
            document["nodes"][0]["translation"] = json!([x, 0.0, z]);
            document["nodes"][0]["scale"] = json!([scale, scale, scale]);
        });
        let model = model.expect("a tree");
        let tree = model.tree.expect("a tree");
        prop_assert!((tree.dbh_m - f64::from(DBH_M)).abs() < 2e-3, "{:?}", tree);
        prop_assert!((model.extent.height_m - f64::from(HEIGHT_M)).abs() < 1e-3);
        prop_assert!((tree.foot_radius_m - 0.2).abs() < 0.02, "{:?}", tree);
    }
}
