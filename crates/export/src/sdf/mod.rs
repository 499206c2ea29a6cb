//! A world for Gazebo: SDF with visuals and collisions.
//!
//! SDF has no shear, no instancing and no masks of its own. So visuals are binary glTF files, one
//! for each shape and class, whose axes are those of SDF (z up), and what has no id lies in one
//! file a class.

mod collision;
mod xml;

use std::collections::{BTreeMap, HashMap};
use std::path::Path;
use std::sync::Arc;

use nemoral_files::{Folder, InnerPath};
use nemoral_scene::glam::{Mat3, Quat, Vec3};
use nemoral_scene::{Instance, ObjectId, ObjectKind, Prototype};

pub use collision::{Cylinder, stem_cylinders};
use xml::{Xml, numbers};

use crate::decomposition::{Decomposition, RotationScale};
use crate::gltf::{GltfParams, Instancing, to_glb};
use crate::name::Names;
use crate::scene::{ExportScene, Inventory};
use crate::{Error, check_folder, is_ground, name};

/// The folder's main file.
const WORLD: &str = "world.sdf";

/// The models of what has no id.
const GROUND: &str = "ground";
const LOW_PLANTS: &str = "low_plants";

/// How visuals are written: Gazebo's reader knows no instancing, and its axes are ours.
const VISUALS: GltfParams = GltfParams {
    instancing: Instancing::Nodes,
    z_up: true,
};

/// Writes a scene as a Gazebo world: `world.sdf` in the folder, visuals in `meshes`, and what
/// things collide with in `collision`. The world appears last, when all is there. The result is the
/// size of all files in bytes.
///
/// - The ground is a static model that collides as its triangles do.
/// - Every object is a static model of its id: a tree collides as the cylinders of its stem, rocks,
///   stumps, logs and root plates as their triangles, shrubs with nothing.
/// - Low plants, which have no id, are one model without collisions.
/// - Each visual has the label of its class, as Gazebo's segmentation camera reads it.
///
/// # Errors
/// If the folder has something in it, the scene is empty, an instance cannot be placed, or a file
/// cannot be written.
pub fn write_sdf(scene: &ExportScene, folder: &Path) -> Result<u64, Error> {
    let out = Output::new(folder)?;
    if scene.instances.is_empty() {
        return Err(Error::Empty);
    }
    let mut world = World {
        scene,
        inventory: Inventory::new(scene),
        out,
        xml: Xml::new(&scene.name),
        part: ExportScene {
            name: String::new(),
            origin_m: scene.origin_m,
            seed: scene.seed,
            materials: scene.materials.clone(),
            ontology: scene.ontology.clone(),
            instances: Vec::new(),
            objects: Vec::new(),
            trees: Vec::new(),
            cameras: Vec::new(),
        },
        visuals: HashMap::new(),
        stems: HashMap::new(),
        names: Names::default(),
    };
    for taken in [GROUND, LOW_PLANTS] {
        world.names.unique(taken.to_owned());
    }
    let (mut ground, mut low_plants) = (Vec::new(), Vec::new());
    let mut objects: BTreeMap<ObjectId, Vec<(&Instance, Decomposition)>> = BTreeMap::new();
    for (number, instance) in scene.instances.iter().enumerate() {
        let decomposition = Decomposition::of_numbered(number, instance)?;
        if is_ground(&instance.prototype, &scene.materials) {
            ground.push(instance);
        } else if instance.object.is_none() {
            low_plants.push(instance);
        } else {
            let object = objects.entry(instance.object).or_default();
            object.push((instance, decomposition));
        }
    }
    world.merged(GROUND, &ground, true)?;
    for (object, instances) in &objects {
        world.object(*object, instances)?;
    }
    world.merged(LOW_PLANTS, &low_plants, false)?;
    let World { mut out, xml, .. } = world;
    out.put(WORLD, xml.finish().as_bytes())?;
    Ok(out.bytes)
}

/// A folder that was empty.
struct Output {
    folder: Folder,
    bytes: u64,
}

impl Output {
    fn new(path: &Path) -> Result<Self, Error> {
        check_folder(path)?;
        Ok(Self {
            folder: Folder::new(path),
            bytes: 0,
        })
    }

    fn put(&mut self, file: &str, bytes: &[u8]) -> Result<(), Error> {
        let file = InnerPath::new(file).expect("names are made of letters and numbers");
        self.folder.put(&file, bytes)?;
        self.bytes += bytes.len() as u64;
        Ok(())
    }
}

/// A visual: the label of its class, the class's name, and its file.
type Visual = (u8, String, String);

struct World<'a> {
    scene: &'a ExportScene,
    inventory: Inventory<'a>,
    out: Output,
    xml: Xml,
    /// What visuals are written from: the scene without its instances.
    part: ExportScene,
    /// The visuals of a shape, by where it is.
    visuals: HashMap<*const Prototype, Vec<Visual>>,
    /// The stems of shapes, by where these are.
    stems: HashMap<*const Prototype, Vec<Cylinder>>,
    names: Names,
}

impl World<'_> {
    /// A file name that no other file has.
    fn unique(&mut self, name: String) -> String {
        self.names.unique(name)
    }

    /// Writes some instances, a file for each class of their surfaces.
    fn write_visuals(&mut self, stem: &str, instances: &[&Instance]) -> Result<Vec<Visual>, Error> {
        let scene = self.scene;
        let mut visuals = Vec::new();
        for class in scene.ontology.classes() {
            let mut parts: HashMap<*const Prototype, Option<Arc<Prototype>>> = HashMap::new();
            let mut kept = Vec::new();
            for &instance in instances {
                let shape = &instance.prototype;
                let part = parts.entry(Arc::as_ptr(shape)).or_insert_with(|| {
                    let is_of = |m| scene.ontology.class(scene.materials.get(m).semantic) == class;
                    let part = shape.retaining(is_of, &scene.materials);
                    part.expect("the library is the shape's own").map(Arc::new)
                });
                if let Some(part) = part {
                    kept.push(Instance {
                        prototype: Arc::clone(part),
                        ..instance.clone()
                    });
                }
            }
            if kept.is_empty() {
                continue;
            }
            self.part.name = stem.to_owned();
            self.part.instances = kept;
            let file = format!("meshes/{stem}.{}.glb", name::plain(&class.name));
            self.out.put(&file, &to_glb(&self.part, VISUALS)?)?;
            visuals.push((class.id, class.name.clone(), file));
        }
        Ok(visuals)
    }

    /// One model of many instances, each where it is.
    fn merged(&mut self, name: &str, instances: &[&Instance], solid: bool) -> Result<(), Error> {
        if instances.is_empty() {
            return Ok(());
        }
        let visuals = self.write_visuals(name, instances)?;
        self.xml.open_model(name, Vec3::ZERO);
        if solid {
            let file = format!("collision/{name}.obj");
            let text = collision::obj(instances, Vec3::ZERO);
            self.out.put(&file, text.as_bytes())?;
            self.xml.mesh_collision(&file);
        }
        for visual in &visuals {
            self.xml.visual(visual, AS_IT_IS, Vec3::ZERO);
        }
        self.xml.close_model();
        Ok(())
    }

    /// The model of an object: its shape first, then what grows on it.
    fn object(
        &mut self,
        object: ObjectId,
        instances: &[(&Instance, Decomposition)],
    ) -> Result<(), Error> {
        let record = self.inventory.object(object);
        let kind = record.map(|record| record.kind);
        let kind_name = kind.map_or("object", ObjectKind::name);
        let model = format!("{kind_name}_{}", object.to_u64());
        let at_m = instances[0].0.position_m;
        self.xml.open_model(&model, at_m);
        for (number, &(instance, decomposition)) in instances.iter().enumerate() {
            let turn = match decomposition {
                Decomposition::Plain(turn) if turn.scale.min_element() > 0.0 => Some(turn),
                _ => None,
            };
            let offset_m = instance.position_m - at_m;
            if number == 0 {
                self.collide((&model, kind), instance, turn)?;
            }
            // A shape that is only turned and scaled is written once; others are, each by itself.
            if let Some(turn) = turn {
                let key = Arc::as_ptr(&instance.prototype);
                if !self.visuals.contains_key(&key) {
                    let unplaced = Instance {
                        position_m: Vec3::ZERO,
                        linear: Mat3::IDENTITY,
                        object: ObjectId::NONE,
                        variation: 0.5,
                        prototype: Arc::clone(&instance.prototype),
                    };
                    let stem = self.unique(name::plain(instance.prototype.name()));
                    let visuals = self.write_visuals(&stem, &[&unplaced])?;
                    self.visuals.insert(key, visuals);
                }
                for visual in &self.visuals[&key] {
                    self.xml.visual(visual, turn, offset_m);
                }
            } else {
                let own = Instance {
                    position_m: offset_m,
                    ..instance.clone()
                };
                let stem = self.unique(model.clone());
                for visual in &self.write_visuals(&stem, &[&own])? {
                    self.xml.visual(visual, AS_IT_IS, Vec3::ZERO);
                }
            }
        }
        self.xml.close_model();
        Ok(())
    }

    /// What an object collides as.
    fn collide(
        &mut self,
        (model, kind): (&str, Option<ObjectKind>),
        instance: &Instance,
        turn: Option<RotationScale>,
    ) -> Result<(), Error> {
        match kind {
            Some(ObjectKind::Tree) => {
                let linear = instance.linear;
                // How much wider and longer the cylinders are.
                let wide = (linear.x_axis.length() + linear.y_axis.length()) / 2.0;
                let long = linear.z_axis.length();
                let rotation = turn.map_or(Quat::IDENTITY, |turn| turn.rotation);
                let shape = &instance.prototype;
                let stem = self.stems.entry(Arc::as_ptr(shape));
                let stem = stem.or_insert_with(|| stem_cylinders(shape, &self.scene.materials));
                for cylinder in stem {
                    let placed = Cylinder {
                        centre_m: linear * cylinder.centre_m,
                        radius_m: cylinder.radius_m * wide,
                        length_m: cylinder.length_m * long,
                    };
                    self.xml.cylinder_collision(placed, rotation);
                }
            }
            // Cards alone are no solids.
            Some(ObjectKind::Shrub) | None => {}
            Some(_) if instance.prototype.mesh().triangles.is_empty() => {}
            Some(_) => {
                let file = format!("collision/{model}.obj");
                let text = collision::obj(&[instance], instance.position_m);
                self.out.put(&file, text.as_bytes())?;
                self.xml.mesh_collision(&file);
            }
        }
        Ok(())
    }
}

const AS_IT_IS: RotationScale = RotationScale {
    rotation: Quat::IDENTITY,
    scale: Vec3::ONE,
};

/// A pose by position and quaternion.
fn pose(position_m: Vec3, rotation: Quat) -> String {
    format!(
        "<pose rotation_format=\"quat_xyzw\">{}  {}</pose>",
        numbers(&position_m.to_array()),
        numbers(&rotation.to_array())
    )
}
