//! A reader of binary glTF files, of as much as there is in ours.

use nemoral_scene::glam::{DMat4, DQuat, DVec3};
use serde_json::Value;

use crate::common::Labelled;

pub(crate) struct Glb {
    pub(crate) json: Value,
    pub(crate) binary: Vec<u8>,
}

fn word(bytes: &[u8], at: usize) -> usize {
    u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four")) as usize
}

impl Glb {
    pub(crate) fn read(file: &[u8]) -> Self {
        assert_eq!(&file[..4], b"glTF");
        assert_eq!((word(file, 4), word(file, 8)), (2, file.len()));
        let json = word(file, 12);
        assert_eq!(&file[16..20], b"JSON");
        let (head, binary) = file[20 + json..].split_at(8);
        assert_eq!((word(head, 0), &head[4..]), (binary.len(), &b"BIN\0"[..]));
        assert_eq!((json % 4, binary.len() % 4), (0, 0));
        Self {
            json: serde_json::from_slice(&file[20..20 + json]).expect("JSON"),
            binary: binary.to_vec(),
        }
    }

    /// The numbers of an accessor, with how many an element has.
    pub(crate) fn numbers(&self, accessor: &Value) -> (usize, Vec<f64>) {
        let a = &self.json["accessors"][index(accessor)];
        let view = &self.json["bufferViews"][index(&a["bufferView"])];
        let width = match a["type"].as_str() {
            Some("SCALAR") => 1,
            Some("VEC2") => 2,
            Some("VEC3") => 3,
            Some("VEC4") => 4,
            other => panic!("{other:?}"),
        };
        let count = index(&a["count"]) * width;
        let start = index(&view["byteOffset"]);
        let bytes = &self.binary[start..start + index(&view["byteLength"])];
        let numbers: Vec<f64> = match a["componentType"].as_u64() {
            Some(5123) => bytes
                .chunks_exact(2)
                .map(|b| f64::from(u16::from_le_bytes([b[0], b[1]])))
                .collect(),
            Some(5125) => bytes.chunks_exact(4).map(|b| word(b, 0) as f64).collect(),
            Some(5126) => bytes
                .chunks_exact(4)
                .map(|b| f64::from(f32::from_le_bytes(b.try_into().expect("four"))))
                .collect(),
            other => panic!("{other:?}"),
        };
        assert_eq!(numbers.len(), count);
        (width, numbers)
    }

    fn vectors(&self, accessor: &Value) -> Vec<DVec3> {
        let (width, numbers) = self.numbers(accessor);
        assert_eq!(width, 3);
        numbers.chunks_exact(3).map(DVec3::from_slice).collect()
    }

    /// All triangles in z-up axes, with the labels that extras and attributes give them.
    pub(crate) fn triangles(&self) -> Vec<Labelled> {
        let mut all = Vec::new();
        // The inverse of glTF's y up.
        let up = DMat4::from_cols_array(&[
            1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0,
        ]);
        for root in self.json["scenes"][0]["nodes"].as_array().expect("nodes") {
            self.visit(index(root), up, 0, &mut all);
        }
        all
    }

    fn visit(&self, number: usize, above: DMat4, object: u64, all: &mut Vec<Labelled>) {
        let node = &self.json["nodes"][number];
        let here = above * transform(node);
        let object = match node["extras"]["object"].as_str() {
            Some(id) => id.parse().expect("a number"),
            None => object,
        };
        for child in node["children"].as_array().into_iter().flatten() {
            self.visit(index(child), here, object, all);
        }
        let Some(mesh) = node.get("mesh") else { return };
        let batch = &node["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
        if batch.is_null() {
            self.mesh(index(mesh), here, object, all);
            return;
        }
        let (places, scales) = (
            self.vectors(&batch["TRANSLATION"]),
            self.vectors(&batch["SCALE"]),
        );
        let (_, turns) = self.numbers(&batch["ROTATION"]);
        let ids = batch.get("_OBJECT_ID").map(|ids| self.numbers(ids).1);
        for i in 0..places.len() {
            let turn = DQuat::from_slice(&turns[4 * i..]);
            let of = DMat4::from_scale_rotation_translation(scales[i], turn, places[i]);
            let words = ids
                .as_ref()
                .map_or(&[0.0; 4][..], |ids| &ids[4 * i..4 * i + 4]);
            let id = (0..4).fold(0, |id, k| id | (words[k] as u64) << (16 * k));
            if let Some(listed) = node["extras"]["objects"].get(i) {
                assert_eq!(listed.as_str(), Some(&*id.to_string()));
            }
            self.mesh(index(mesh), here * of, id, all);
        }
    }

    fn mesh(&self, number: usize, here: DMat4, object: u64, all: &mut Vec<Labelled>) {
        let mesh = &self.json["meshes"][number];
        for primitive in mesh["primitives"].as_array().expect("primitives") {
            let attributes = &primitive["attributes"];
            let points = self.vectors(&attributes["POSITION"]);
            for normal in self.vectors(&attributes["NORMAL"]) {
                assert!((normal.length() - 1.0).abs() < 1e-5);
            }
            let accessor = &self.json["accessors"][index(&attributes["POSITION"])];
            for k in 0..3 {
                let all = points.iter().map(|p| p[k]);
                let bounds = [all.clone().reduce(f64::min), all.reduce(f64::max)];
                for (bound, key) in bounds.into_iter().zip(["min", "max"]) {
                    // The parser of JSON rounds the last digit.
                    let said = accessor[key][k].as_f64().expect("a bound");
                    assert!((said - bound.expect("points")).abs() < 1e-12 * said.abs().max(1.0));
                }
            }
            let material = &self.json["materials"][index(&primitive["material"])];
            let semantic = &material["extras"]["semantic"];
            assert_eq!(&primitive["extras"]["semantic"], semantic);
            let (_, corners) = self.numbers(&primitive["indices"]);
            for t in corners.chunks_exact(3) {
                let at = |i: usize| here.transform_point3(points[t[i] as usize]);
                all.push(Labelled {
                    corners: [at(0), at(1), at(2)],
                    object,
                    semantic: semantic.as_str().expect("text").to_owned(),
                });
            }
        }
    }
}

pub(crate) fn index(value: &Value) -> usize {
    value.as_u64().expect("a number") as usize
}

fn transform(node: &Value) -> DMat4 {
    let numbers = |key: &str, default: &[f64]| -> Vec<f64> {
        match node[key].as_array() {
            Some(all) => all.iter().map(|n| n.as_f64().expect("a number")).collect(),
            None => default.to_vec(),
        }
    };
    DMat4::from_scale_rotation_translation(
        DVec3::from_slice(&numbers("scale", &[1.0; 3])),
        DQuat::from_slice(&numbers("rotation", &[0.0, 0.0, 0.0, 1.0])),
        DVec3::from_slice(&numbers("translation", &[0.0; 3])),
    )
}
