use nemoral_export::{Error, ExportScene, GltfParams, Instancing, to_glb, write_glb};
use nemoral_scene::glam::{DQuat, DVec3, Mat3};
use nemoral_scene::{Instance, InstancePlace};
use proptest::prelude::*;
use serde_json::Value;

use crate::common::{expect_equal, id, scene, truth};
use crate::glb::{Glb, index};

const NODES: GltfParams = GltfParams {
    instancing: Instancing::Nodes,
    z_up: false,
};

fn read(scene: &ExportScene, params: GltfParams) -> Glb {
    Glb::read(&to_glb(scene, params).expect("it can be written"))
}

#[test]
fn every_triangle_is_where_rays_meet_it() {
    let scene = scene();
    for params in [GltfParams::default(), NODES] {
        expect_equal(&read(&scene, params).triangles(), &truth(&scene));
    }
}

proptest! {
    #[test]
    fn any_map_places_what_it_places(
        columns in prop::array::uniform9(-2.0_f32..2.0),
        others in prop::array::uniform9(-2.0_f32..2.0),
    ) {
        let mut scene = scene();
        let maps = [columns, others].map(|c| Mat3::from_cols_array(&c));
        prop_assume!(maps.iter().all(|m| m.determinant().abs() > 0.05));
        let shape = scene.instances[4].prototype.clone();
        scene.instances = maps
            .map(|linear| {
                let place = InstancePlace { linear, ..InstancePlace::at([1.0, 2.0, 3.0].into()) };
                Instance::new(shape.clone(), place.with_object(id(9)))
            })
            .to_vec();
        expect_equal(&read(&scene, GltfParams::default()).triangles(), &truth(&scene));
    }
}

#[test]
fn copies_are_instances_and_what_is_sheared_is_nested() {
    let glb = read(&scene(), GltfParams::default());
    let nodes = glb.json["nodes"].as_array().expect("nodes");
    let name = "EXT_mesh_gpu_instancing";
    assert_eq!(glb.json["extensionsUsed"][0], name);
    let batches: Vec<_> = nodes
        .iter()
        .filter(|n| !n["extensions"].is_null())
        .collect();
    assert_eq!(batches.len(), 1);
    assert_eq!(batches[0]["extras"]["instances"], 3);
    assert_eq!(batches[0]["extras"]["species"], "maritime_pine");
    let attributes = &batches[0]["extensions"][name]["attributes"];
    let (_, image_ids) = glb.numbers(&attributes["_IMAGE_ID"]);
    assert_eq!(image_ids[1], f64::from(id(2).to_image_id()));
    let nested = nodes[1..].iter().filter(|n| !n["children"].is_null());
    assert_eq!(nested.count(), 3);
    assert!(read(&scene(), NODES).json.get("extensionsUsed").is_none());
}

#[test]
fn materials_have_pictures_masks_and_semantics() {
    let glb = read(&scene(), GltfParams::default());
    let material = |name: &str| -> &Value {
        let all = glb.json["materials"].as_array().expect("materials");
        all.iter()
            .find(|m| m["name"] == name)
            .expect("there is one")
    };
    let leaf = material("pine.foliage");
    assert_eq!(
        (&leaf["alphaMode"], &leaf["doubleSided"]),
        (&"MASK".into(), &true.into())
    );
    assert_eq!(leaf["extras"]["class"], "Canopy");
    assert_eq!(leaf["extras"]["semantic_id"], 19);
    assert_eq!(material("soil")["extras"]["class_id"], 1);
    assert!(material("stone")["pbrMetallicRoughness"]["baseColorFactor"].is_array());
    let picture = |material: &Value| {
        let texture = index(&material["pbrMetallicRoughness"]["baseColorTexture"]["index"]);
        let texture = &glb.json["textures"][texture];
        let image = &glb.json["images"][index(&texture["source"])];
        let view = &glb.json["bufferViews"][index(&image["bufferView"])];
        let start = index(&view["byteOffset"]);
        let file = &glb.binary[start..start + index(&view["byteLength"])];
        let reader = png::Decoder::new(std::io::Cursor::new(file)).read_info();
        let mut reader = reader.expect("a PNG");
        let mut pixels = vec![0; reader.output_buffer_size().expect("small")];
        let info = reader.next_frame(&mut pixels).expect("pixels");
        (info.width, info.height, pixels)
    };
    let (width, height, pixels) = picture(leaf);
    assert_eq!((width, height), (4, 4));
    let alpha: Vec<u8> = pixels.chunks_exact(4).map(|p| p[3]).collect();
    // Row 0 first: opaque where the column is at most the row.
    assert_eq!(alpha[..8], [255, 0, 0, 0, 255, 255, 0, 0]);
    let (width, height, pixels) = picture(material("pine.stem"));
    assert_eq!(
        (width, height, &pixels[..6]),
        (2, 2, &[255, 0, 0, 0, 255, 0][..])
    );
}

#[test]
fn texture_coordinates_of_cards_follow_their_windows() {
    let glb = read(&scene(), GltfParams::default());
    let meshes = glb.json["meshes"].as_array().expect("meshes");
    let pine = meshes
        .iter()
        .find(|m| m["name"] == "pine.0")
        .expect("a pine");
    let leaves = &pine["primitives"][1];
    let (_, uvs) = glb.numbers(&leaves["attributes"]["TEXCOORD_0"]);
    assert_eq!(uvs[..8], [0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0]);
    assert_eq!(uvs[8..], [0.0, 0.0, 0.5, 0.0, 0.5, 1.0, 0.0, 1.0]);
}

#[test]
fn the_scene_says_where_it_is_and_what_is_in_it() {
    let glb = read(&scene(), GltfParams::default());
    let extras = &glb.json["scenes"][0]["extras"];
    assert_eq!(extras["world_origin_m"][1], 100_000.0);
    assert_eq!(extras["objects"].as_array().map(Vec::len), Some(4));
    assert_eq!(extras["objects"][0]["dbh_m"], 0.25);
    assert!(extras["objects"][2]["dbh_m"].is_null());
    assert_eq!(extras["classes"][3]["name"], "Trunks");
}

#[test]
fn the_camera_looks_where_ours_does() {
    let scene = scene();
    let glb = read(&scene, GltfParams::default());
    let nodes = glb.json["nodes"].as_array().expect("nodes");
    let node = nodes.iter().find(|n| !n["camera"].is_null()).expect("one");
    let numbers: Vec<f64> = (0..4)
        .map(|i| node["rotation"][i].as_f64().expect("a number"))
        .collect();
    let turn = DQuat::from_slice(&numbers);
    let ours = scene.cameras[0].scene_from_camera;
    // glTF looks along -z, and its y is up.
    assert!((turn * -DVec3::Z).distance(ours.transform_vector(DVec3::Z)) < 1e-9);
    assert!((turn * DVec3::Y).distance(ours.transform_vector(-DVec3::Y)) < 1e-9);
    let k = &scene.cameras[0].intrinsics;
    let lens = &glb.json["cameras"][0]["perspective"];
    let yfov = lens["yfov"].as_f64().expect("a number");
    assert!((180.0 / (yfov / 2.0).tan() - k.fy).abs() < 1e-9);
}

#[test]
fn equal_scenes_give_equal_bytes() {
    let file = || to_glb(&scene(), GltfParams::default()).expect("written");
    assert_eq!(file(), file());
}

#[test]
fn what_cannot_be_written_is_refused_and_leaves_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.glb");
    let params = GltfParams::default();
    let refused = |scene: &ExportScene, path: &std::path::Path| {
        let error = write_glb(scene, path, params).expect_err("refused");
        let none = std::fs::read_dir(folder.path()).expect("a folder").next();
        assert!(none.is_none(), "{none:?}");
        error
    };
    let name = refused(&scene(), &folder.path().join("scene.gltf"));
    assert!(name.is_request() && name.to_string().ends_with("the name must end in .glb"));
    let mut empty = scene();
    empty.instances.clear();
    assert!(matches!(refused(&empty, &path), Error::Empty));
    let mut flat = scene();
    flat.instances[2].linear = Mat3::ZERO;
    let error = refused(&flat, &path).to_string();
    assert!(error.contains("instance 2 of shape `rock.2`"), "{error}");
    let missing = refused(&scene(), &folder.path().join("none/scene.glb"));
    assert!(!missing.is_request());
    let size = write_glb(&scene(), &path, params).expect("written");
    assert_eq!(std::fs::metadata(&path).expect("a file").len(), size);
}
