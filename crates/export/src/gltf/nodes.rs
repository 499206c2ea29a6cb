//! Nodes: the root, instances, cameras.

use std::collections::BTreeMap;

use nemoral_scene::Instance;
use nemoral_scene::glam::{DMat3, DQuat, DVec3, Quat, Vec3};
use serde_json::{Value, json};

use super::binary::Binary;
use super::extras::about_object;
use super::{GPU_INSTANCING, GltfParams, Instancing};
use crate::decomposition::{Decomposition, RotationScale};
use crate::scene::{ExportCamera, ExportScene, Inventory, ShapeInstances};
use crate::{Error, is_ground};

/// The nodes of a file. The first one is the root.
#[derive(Debug, Default)]
pub(super) struct Nodes {
    /// All but the root, whose numbers therefore begin with 1.
    nodes: Vec<Value>,
    /// The numbers of those directly below the root.
    children: Vec<usize>,
    pub(super) cameras: Vec<Value>,
    pub(super) uses_instancing: bool,
}

impl Nodes {
    fn add(&mut self, node: Value) -> usize {
        self.nodes.push(node);
        self.nodes.len()
    }

    /// Places all instances of a shape, whose mesh has this number.
    pub(super) fn place(
        &mut self,
        scene: &ExportScene,
        inventory: &Inventory<'_>,
        (shape, mesh): (&ShapeInstances<'_>, usize),
        params: GltfParams,
        binary: &mut Binary,
    ) -> Result<(), Error> {
        let mut batch = Vec::new();
        for &(number, instance) in &shape.instances {
            match Decomposition::of_numbered(number, instance)? {
                Decomposition::Plain(turn) => batch.push((instance, turn)),
                Decomposition::Nested { outer, inner } => {
                    let child = self.add(json!({
                        "mesh": mesh,
                        "rotation": inner.to_array(),
                    }));
                    let mut node = node(scene, inventory, instance, outer);
                    node["children"] = json!([child]);
                    let node = self.add(node);
                    self.children.push(node);
                }
            }
        }
        if params.instancing == Instancing::Nodes || batch.len() < 2 {
            for (instance, turn) in batch {
                let mut node = node(scene, inventory, instance, turn);
                node["mesh"] = json!(mesh);
                let node = self.add(node);
                self.children.push(node);
            }
        } else {
            let node = self.add(batched(&batch, inventory, mesh, binary));
            self.children.push(node);
            self.uses_instancing = true;
        }
        Ok(())
    }

    /// Places a camera. One of glTF looks along -z, with y up.
    pub(super) fn add_camera(&mut self, camera: &ExportCamera) {
        let k = &camera.intrinsics;
        let (width, height) = (f64::from(k.width), f64::from(k.height));
        let distortion: BTreeMap<_, _> = k.distortion.coefficients().into_iter().collect();
        self.cameras.push(json!({
            "name": camera.name,
            "type": "perspective",
            "perspective": {
                "yfov": 2.0 * libm::atan(height / 2.0 / k.fy),
                "aspectRatio": width / k.fx / (height / k.fy),
                "znear": 0.01,
            },
            "extras": {
                "width_px": k.width,
                "height_px": k.height,
                "fx": k.fx,
                "fy": k.fy,
                "cx": k.cx,
                "cy": k.cy,
                "distortion": distortion,
            },
        }));
        let pose = &camera.scene_from_camera;
        let flip = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
        let rotation = pose.rotation * DQuat::from_mat3(&flip);
        let node = self.add(json!({
            "name": camera.name,
            "camera": self.cameras.len() - 1,
            "translation": pose.translation_m.to_array(),
            "rotation": rotation.normalize().to_array(),
        }));
        self.children.push(node);
    }

    /// All nodes, and the number of the root.
    pub(super) fn finish(self, name: &str, z_up: bool) -> (Vec<Value>, usize) {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let mut root = json!({ "name": name, "children": self.children });
        if !z_up {
            root["rotation"] = json!([-half, 0.0, 0.0, half]);
        }
        let nodes = std::iter::once(root).chain(self.nodes).collect();
        (nodes, 0)
    }
}

/// The node of an instance, without its mesh.
fn node(
    scene: &ExportScene,
    inventory: &Inventory<'_>,
    instance: &Instance,
    turn: RotationScale,
) -> Value {
    let shape = &instance.prototype;
    let name = if instance.object.is_none() {
        shape.name().to_owned()
    } else {
        format!("{}#{}", shape.name(), instance.object.to_u64())
    };
    let mut node = json!({
        "name": name,
        "translation": instance.position_m.to_array(),
        "extras": about_object(instance.object, instance.variation, inventory),
    });
    if turn.rotation != Quat::IDENTITY {
        node["rotation"] = json!(turn.rotation.to_array());
    }
    if turn.scale != Vec3::ONE {
        node["scale"] = json!(turn.scale.to_array());
    }
    if is_ground(shape, &scene.materials) {
        node["extras"]["kind"] = json!("ground");
    }
    node
}

/// One node for many instances of a shape.
fn batched(
    batch: &[(&Instance, RotationScale)],
    inventory: &Inventory<'_>,
    mesh: usize,
    binary: &mut Binary,
) -> Value {
    let of =
        |pick: fn(&(&Instance, RotationScale)) -> Vec3| batch.iter().map(pick).collect::<Vec<_>>();
    let rotations: Vec<Quat> = batch.iter().map(|(_, turn)| turn.rotation).collect();
    let variations: Vec<f32> = batch.iter().map(|(i, _)| i.variation).collect();
    let mut attributes = json!({
        "TRANSLATION": binary.vectors(&of(|(instance, _)| instance.position_m)),
        "ROTATION": binary.rotations(&rotations),
        "SCALE": binary.vectors(&of(|(_, turn)| turn.scale)),
        "_VARIATION": binary.scalars(&variations),
    });
    let first = batch[0].0;
    let mut extras = json!({ "instances": batch.len() });
    if batch.iter().any(|(i, _)| !i.object.is_none()) {
        let ids: Vec<u64> = batch.iter().map(|(i, _)| i.object.to_u64()).collect();
        // Below 2^24, so that a float has them exactly.
        let image_ids: Vec<f32> = batch
            .iter()
            .map(|(i, _)| i.object.to_image_id() as f32)
            .collect();
        attributes["_OBJECT_ID"] = json!(binary.quadruples(&ids));
        attributes["_IMAGE_ID"] = json!(binary.scalars(&image_ids));
        extras["objects"] = ids.iter().map(u64::to_string).collect();
        if let Some(record) = inventory.object(first.object) {
            extras["kind"] = json!(record.kind.name());
            extras["species"] = json!(record.species);
        }
    }
    json!({
        "name": first.prototype.name(),
        "mesh": mesh,
        "extensions": { GPU_INSTANCING: { "attributes": attributes } },
        "extras": extras,
    })
}
