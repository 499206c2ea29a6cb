//! Meshes, materials, textures.

use std::collections::{BTreeMap, BTreeSet};

use nemoral_scene::{MaterialId, Prototype, Texture};
use serde_json::{Value, json};

use super::binary::Binary;
use super::extras::about_material;
use crate::parts::{is_double_sided, parts};
use crate::picture::Pictures;
use crate::scene::ExportScene;

/// The materials of a file in the order in which its shapes use them.
pub(super) struct Materials<'a> {
    scene: &'a ExportScene,
    numbers: BTreeMap<MaterialId, usize>,
    used: Vec<MaterialId>,
    with_cards: BTreeSet<MaterialId>,
}

/// Materials, textures and images of a document.
type Tables = (Vec<Value>, Vec<Value>, Vec<Value>);

impl<'a> Materials<'a> {
    pub(super) fn new(scene: &'a ExportScene) -> Self {
        Self {
            scene,
            numbers: BTreeMap::new(),
            used: Vec::new(),
            with_cards: BTreeSet::new(),
        }
    }

    /// A shape as a mesh with a primitive for each material.
    pub(super) fn mesh(&mut self, shape: &Prototype, binary: &mut Binary) -> Value {
        self.with_cards
            .extend(shape.cards().iter().map(|card| card.material));
        let mut primitives = Vec::new();
        for part in parts(shape, &self.scene.materials) {
            let material = self.scene.materials.get(part.material);
            let number = self.number(part.material);
            let mut attributes = json!({
                "POSITION": binary.positions(&part.positions),
                "NORMAL": binary.normals(&part.normals),
            });
            // A material of one colour needs no texture coordinates.
            if material.mask.is_some() || !is_plain(&material.albedo) {
                attributes["TEXCOORD_0"] = json!(binary.uvs(&part.uvs));
            }
            primitives.push(json!({
                "attributes": attributes,
                "indices": binary.indices(&part.indices),
                "material": number,
                "extras": {
                    "semantic": material.semantic.name(),
                    "semantic_id": material.semantic as u8,
                    "class_id": self.scene.ontology.class(material.semantic).id,
                },
            }));
        }
        json!({ "name": shape.name(), "primitives": primitives })
    }

    fn number(&mut self, material: MaterialId) -> usize {
        *self.numbers.entry(material).or_insert_with(|| {
            self.used.push(material);
            self.used.len() - 1
        })
    }

    /// The materials with their pictures.
    pub(super) fn finish(self, binary: &mut Binary) -> Tables {
        let mut pictures = Pictures::default();
        let mut materials = Vec::new();
        for &id in &self.used {
            let material = self.scene.materials.get(id);
            let mask = material.mask.as_ref();
            let mut surface = json!({
                "metallicFactor": 0.0,
                "roughnessFactor": material.roughness.clamp(0.0, 1.0),
            });
            if mask.is_none() && is_plain(&material.albedo) {
                let [r, g, b] = material.albedo.mean().to_array();
                surface["baseColorFactor"] = json!([r, g, b, 1.0]);
            } else {
                surface["baseColorTexture"] = json!({ "index": pictures.number(material) });
            }
            let mut described = json!({
                "name": material.name,
                "pbrMetallicRoughness": surface,
                "doubleSided": is_double_sided(material, self.with_cards.contains(&id)),
                "extras": about_material(material, &self.scene.ontology),
            });
            if mask.is_some() {
                described["alphaMode"] = json!("MASK");
                described["alphaCutoff"] = json!(0.5);
            }
            materials.push(described);
        }
        let mut textures = Vec::new();
        let mut images = Vec::new();
        for (file, has_mask) in pictures.files() {
            let view = binary.view(file);
            images.push(json!({ "bufferView": view, "mimeType": "image/png" }));
            let sampler = if has_mask { MASKED } else { COLOUR };
            textures.push(json!({ "source": images.len() - 1, "sampler": sampler }));
        }
        (materials, textures, images)
    }
}

/// Whether a texture is a single colour.
fn is_plain(texture: &Texture) -> bool {
    texture.width() == 1 && texture.height() == 1
}

const COLOUR: usize = 0;
const MASKED: usize = 1;

/// The samplers of colours, which repeat and are filtered, and of masks, whose nearest texel
/// decides at any distance, as it does for our sensors.
pub(super) fn samplers() -> Value {
    const NEAREST: u32 = 9_728;
    const LINEAR: u32 = 9_729;
    const TRILINEAR: u32 = 9_987;
    const REPEAT: u32 = 10_497;
    const CLAMP: u32 = 33_071;
    json!([
        { "magFilter": LINEAR, "minFilter": TRILINEAR, "wrapS": REPEAT, "wrapT": REPEAT },
        { "magFilter": NEAREST, "minFilter": NEAREST, "wrapS": CLAMP, "wrapT": CLAMP },
    ])
}
