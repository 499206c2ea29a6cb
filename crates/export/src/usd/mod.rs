//! OpenUSD as text, with the labels that Isaac Sim reads.
//!
//! Axes and units are ours: z up, metres. Each shape is a class prim that its copies inherit from:
//! many copies are a point instancer, single ones are prims. USD has matrices, so that what is
//! sheared is one prim.

mod materials;
mod text;

use std::path::Path;

use nemoral_files::{Folder, InnerPath};
use nemoral_scene::glam::{Mat3, Vec3};
use nemoral_scene::{Bounds, Instance, ObjectId, Prototype};

use crate::decomposition::{Decomposition, RotationScale};
use crate::gltf::Instancing;
use crate::name::Names;
use crate::parts::is_double_sided;
use crate::scene::{ExportScene, Inventory, ShapeInstances};
use crate::{Error, check_folder, name, parts};
use materials::Materials;
use text::{Text, quoted, tuple, tuples};

/// How an OpenUSD scene is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UsdParams {
    /// How instances are written: by `PointInstancer`s, whose ids are those of objects, or as a
    /// prim each, so that every object can be selected and labelled by itself.
    pub instancing: Instancing,
}

/// The folder's main file.
const STAGE: &str = "forest.usda";

/// Writes a scene as OpenUSD: `forest.usda` in the folder, and its pictures in `textures`. The
/// stage appears last, when all is there. The result is the size of all files in bytes.
///
/// Each mesh has its class as a label of `SemanticsLabelsAPI:class` and of the older
/// `SemanticsAPI:class`, and its fine semantic as one of `SemanticsLabelsAPI:semantic`; objects
/// that are prims have their kind, species and id.
///
/// # Errors
/// If the folder has something in it, the scene is empty, an instance cannot be placed, or a file
/// cannot be written.
pub fn write_usd(scene: &ExportScene, folder: &Path, params: UsdParams) -> Result<u64, Error> {
    check_folder(folder)?;
    let out = Folder::new(folder);
    let shapes = scene.shapes()?;
    let mut materials = Materials::new(scene);
    let inventory = Inventory::new(scene);
    let mut stage = Stage {
        scene,
        inventory,
        text: Text::default(),
        names: Names::default(),
    };
    stage.header();
    stage.text.open("class Scope \"Shapes\"");
    let mut names = Names::default();
    let mut named = Vec::new();
    for shape in &shapes {
        let name = names.unique(name::plain(shape.shape.name()));
        stage.shape(&name, shape.shape, &mut materials);
        named.push((name, shape));
    }
    stage.text.close();
    for (name, shape) in named {
        stage.instances(&name, shape, params)?;
    }
    stage.cameras();
    let pictures = materials.write(&mut stage.text);
    stage.text.close();
    let mut bytes = 0;
    let mut put = |file: &str, content: &[u8]| {
        bytes += content.len() as u64;
        let file = InnerPath::new(file).expect("names are made of letters and numbers");
        out.put(&file, content)
    };
    for (file, content) in pictures {
        put(&file, &content)?;
    }
    put(STAGE, stage.text.finish().as_bytes())?;
    Ok(bytes)
}

struct Stage<'a> {
    scene: &'a ExportScene,
    inventory: Inventory<'a>,
    text: Text,
    /// The names of prims below the root.
    names: Names,
}

impl Stage<'_> {
    fn header(&mut self) {
        let scene = self.scene;
        for taken in ["Shapes", "Materials"] {
            self.names.unique(taken.to_owned());
        }
        let text = &mut self.text;
        text.line("#usda 1.0");
        text.line("(");
        text.line("    defaultPrim = \"Forest\"");
        text.line("    metersPerUnit = 1");
        text.line("    upAxis = \"Z\"");
        text.line(")");
        text.line("");
        text.open("def Xform \"Forest\" (\n    kind = \"assembly\"\n)");
        let [x, y, z] = scene.origin_m.to_array();
        text.line(&format!(
            "custom double3 nemoral:world_origin_m = ({x}, {y}, {z})"
        ));
        text.line(&format!(
            "custom string nemoral:name = {}",
            quoted(&scene.name)
        ));
        text.line(&format!("custom uint64 nemoral:seed = {}", scene.seed));
    }

    /// A shape as a class prim: a mesh for each material.
    fn shape(&mut self, name: &str, shape: &Prototype, materials: &mut Materials<'_>) {
        let scene = self.scene;
        self.text.open(&format!("def Xform {}", quoted(name)));
        for (number, part) in parts(shape, &scene.materials).into_iter().enumerate() {
            let material = scene.materials.get(part.material);
            let (class, semantic) = (
                scene.ontology.class(material.semantic).name.as_str(),
                material.semantic.name(),
            );
            let bound = materials.name(part.material);
            self.text.open(&format!(
                "def Mesh \"part_{number}\" (\n    prepend apiSchemas = [\"MaterialBindingAPI\", \
                 \"SemanticsLabelsAPI:class\", \"SemanticsLabelsAPI:semantic\", \
                 \"SemanticsAPI:class\"]\n)"
            ));
            let text = &mut self.text;
            text.labels("class", &[class]);
            text.labels("semantic", &[semantic]);
            text.line("string semantic:class:params:semanticType = \"class\"");
            text.line(&format!(
                "string semantic:class:params:semanticData = {}",
                quoted(class)
            ));
            text.line(&format!(
                "rel material:binding = </Forest/Materials/{bound}>"
            ));
            text.line("uniform token subdivisionScheme = \"none\"");
            let has_cards = shape.cards().iter().any(|c| c.material == part.material);
            let is_double_sided = u8::from(is_double_sided(material, has_cards));
            text.line(&format!("uniform bool doubleSided = {is_double_sided}"));
            let Bounds { min, max } = Bounds::of_points(part.positions.iter().copied());
            text.line(&format!(
                "float3[] extent = {}",
                tuples([min, max].iter().map(Vec3::to_array))
            ));
            let faces = part.indices.len() / 3;
            text.list("int[] faceVertexCounts", std::iter::repeat_n("3", faces));
            text.list("int[] faceVertexIndices", &part.indices);
            text.array(
                "point3f[] points",
                part.positions.iter().map(Vec3::to_array),
            );
            text.array(
                "normal3f[] normals",
                part.normals.iter().map(Vec3::to_array),
            );
            text.interpolated();
            // The origin of textures is their lower left corner.
            let uvs = part.uvs.iter().map(|uv| [uv.x, 1.0 - uv.y]);
            text.array("texCoord2f[] primvars:st", uvs);
            text.interpolated();
            text.close();
        }
        self.text.close();
    }

    /// All copies of a shape.
    fn instances(
        &mut self,
        name: &str,
        shape: &ShapeInstances<'_>,
        params: UsdParams,
    ) -> Result<(), Error> {
        let mut batch = Vec::new();
        for &(number, instance) in &shape.instances {
            match Decomposition::of_numbered(number, instance)? {
                Decomposition::Plain(turn) => batch.push((instance, turn)),
                Decomposition::Nested { .. } => self.prim(name, instance),
            }
        }
        if params.instancing == Instancing::Nodes || batch.len() < 2 {
            for (instance, _) in batch {
                self.prim(name, instance);
            }
        } else {
            self.instancer(name, &batch);
        }
        Ok(())
    }

    /// One copy as a prim.
    fn prim(&mut self, shape: &str, instance: &Instance) {
        let wanted = if instance.object.is_none() {
            shape.to_owned()
        } else {
            format!("{shape}_{}", instance.object.to_u64())
        };
        let unique = self.names.unique(wanted);
        let record = self.inventory.object(instance.object);
        let schemas = if record.is_some() {
            "\n    prepend apiSchemas = [\"SemanticsLabelsAPI:kind\", \
             \"SemanticsLabelsAPI:species\", \"SemanticsLabelsAPI:object\"]"
        } else {
            ""
        };
        let text = &mut self.text;
        text.open(&format!(
            "def Xform {} (\n    inherits = </Forest/Shapes/{shape}>\n    instanceable = \
             true{schemas}\n)",
            quoted(&unique)
        ));
        about_object(text, instance.object);
        if let Some(record) = record {
            text.labels("kind", &[record.kind.name()]);
            text.labels("species", &[&record.species]);
            text.labels("object", &[&instance.object.to_u64().to_string()]);
        }
        text.line(&format!(
            "custom float nemoral:variation = {}",
            instance.variation
        ));
        text.line(&format!(
            "matrix4d xformOp:transform = {}",
            matrix(instance.linear, instance.position_m)
        ));
        text.line("uniform token[] xformOpOrder = [\"xformOp:transform\"]");
        text.close();
    }

    /// Many copies as one prim.
    fn instancer(&mut self, name: &str, batch: &[(&Instance, RotationScale)]) {
        let unique = self.names.unique(format!("{name}_copies"));
        let text = &mut self.text;
        text.open(&format!("def PointInstancer {}", quoted(&unique)));
        if batch.iter().any(|(i, _)| !i.object.is_none()) {
            text.list("int64[] ids", batch.iter().map(|(i, _)| i.object.to_u64()));
            if let Some(record) = self.inventory.object(batch[0].0.object) {
                let species = quoted(&record.species);
                text.line(&format!(
                    "custom string nemoral:kind = \"{}\"",
                    record.kind.name()
                ));
                text.line(&format!("custom string nemoral:species = {species}"));
            }
        }
        text.line("rel prototypes = <Shape>");
        text.list("int[] protoIndices", std::iter::repeat_n("0", batch.len()));
        text.array(
            "point3f[] positions",
            batch.iter().map(|(i, _)| i.position_m.to_array()),
        );
        // The real part comes first. Readers that know `orientationsf` leave the other out, whose
        // half floats move a tree's top by up to a centimetre.
        let turns = batch.iter().map(|(_, turn)| {
            let [x, y, z, w] = turn.rotation.to_array();
            [w, x, y, z]
        });
        text.array("quath[] orientations", turns.clone());
        text.array("quatf[] orientationsf", turns);
        text.array(
            "float3[] scales",
            batch.iter().map(|(_, turn)| turn.scale.to_array()),
        );
        text.list(
            "float[] primvars:nemoral_variation",
            batch.iter().map(|(i, _)| i.variation),
        );
        text.open(&format!(
            "def Xform \"Shape\" (\n    inherits = </Forest/Shapes/{name}>\n)"
        ));
        text.close();
        text.close();
    }

    /// USD's cameras look along -z with y up, as glTF's do.
    fn cameras(&mut self) {
        for camera in &self.scene.cameras {
            let k = &camera.intrinsics;
            let unique = self.names.unique(name::plain(&camera.name));
            let pose = &camera.scene_from_camera;
            let axes = nemoral_scene::glam::DMat3::from_quat(pose.rotation);
            let text = &mut self.text;
            text.open(&format!("def Camera {}", quoted(&unique)));
            // Apertures and focal length are in tenths of a unit; any common factor will do.
            text.line(&format!(
                "float focalLength = {}",
                10.0 * k.fx / f64::from(k.width)
            ));
            text.line("float horizontalAperture = 10");
            let vertical = 10.0 * f64::from(k.height) / k.fy * k.fx / f64::from(k.width);
            text.line(&format!("float verticalAperture = {vertical}"));
            // The window's middle as seen from the principal point, to the right and upwards.
            let aside = 10.0 * (0.5 - k.cx / f64::from(k.width));
            let up = vertical * (k.cy / f64::from(k.height) - 0.5);
            text.line(&format!("float horizontalApertureOffset = {aside}"));
            text.line(&format!("float verticalApertureOffset = {up}"));
            text.line("float2 clippingRange = (0.01, 100000)");
            let row =
                |v: nemoral_scene::glam::DVec3, w: f64| format!("({}, {}, {}, {w})", v.x, v.y, v.z);
            text.line(&format!(
                "matrix4d xformOp:transform = ( {}, {}, {}, {} )",
                row(axes.x_axis, 0.0),
                row(-axes.y_axis, 0.0),
                row(-axes.z_axis, 0.0),
                row(pose.translation_m, 1.0)
            ));
            text.line("uniform token[] xformOpOrder = [\"xformOp:transform\"]");
            text.close();
        }
    }
}

fn about_object(text: &mut Text, object: ObjectId) {
    if object.is_none() {
        return;
    }
    let (id, image_id) = (object.to_u64(), object.to_image_id());
    text.line(&format!("custom uint64 nemoral:object = {id}"));
    text.line(&format!("custom uint nemoral:image_id = {image_id}"));
}

/// A matrix as USD writes it, for row vectors.
fn matrix(linear: Mat3, position_m: Vec3) -> String {
    let row = |v: Vec3, w: f32| tuple(&[v.x, v.y, v.z, w]);
    format!(
        "( {}, {}, {}, {} )",
        row(linear.x_axis, 0.0),
        row(linear.y_axis, 0.0),
        row(linear.z_axis, 0.0),
        row(position_m, 1.0)
    )
}
