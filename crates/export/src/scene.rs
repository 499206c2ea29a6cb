//! What is exported.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use nemoral_scene::glam::DVec3;
use nemoral_scene::{
    Instance, Intrinsics, MaterialLibrary, ObjectId, ObjectRecord, Ontology, Prototype,
    RigidTransform, TreeRecord,
};

use crate::Error;

/// A scene as plain data: every writer of this crate takes it.
///
/// Its frame is that of all scenes: right-handed, metres, z up, x east, y north.
#[derive(Clone, Debug)]
pub struct ExportScene {
    /// Its name.
    pub name: String,
    /// The world position of its origin, metres.
    pub origin_m: DVec3,
    /// The seed of its world.
    pub seed: u64,
    /// The materials that its shapes refer to.
    pub materials: MaterialLibrary,
    /// The classes that surfaces are labelled with, beside their fine semantics.
    pub ontology: Ontology,
    /// The shapes in their places; their positions are the scene's.
    pub instances: Vec<Instance>,
    /// What is known of the objects.
    pub objects: Vec<ObjectRecord>,
    /// What is known of the trees among them.
    pub trees: Vec<TreeRecord>,
    /// Cameras that look at it.
    pub cameras: Vec<ExportCamera>,
}

/// A camera of a scene.
#[derive(Clone, Debug)]
pub struct ExportCamera {
    /// Its name.
    pub name: String,
    /// Its pinhole and lens.
    pub intrinsics: Intrinsics,
    /// The pose of its optical frame (x right, y down, z forward).
    pub scene_from_camera: RigidTransform,
}

/// The instances of one shape.
#[derive(Clone, Debug)]
pub(crate) struct ShapeInstances<'a> {
    pub(crate) shape: &'a Arc<Prototype>,
    /// With their numbers in the scene.
    pub(crate) instances: Vec<(usize, &'a Instance)>,
}

impl ExportScene {
    /// The shapes in the order of their first instances, each with all its instances.
    pub(crate) fn shapes(&self) -> Result<Vec<ShapeInstances<'_>>, Error> {
        let mut index = HashMap::new();
        let mut shapes: Vec<ShapeInstances<'_>> = Vec::new();
        for (number, instance) in self.instances.iter().enumerate() {
            let shape = &instance.prototype;
            let at = *index.entry(Arc::as_ptr(shape)).or_insert_with(|| {
                shapes.push(ShapeInstances {
                    shape,
                    instances: Vec::new(),
                });
                shapes.len() - 1
            });
            shapes[at].instances.push((number, instance));
        }
        if shapes.is_empty() {
            return Err(Error::Empty);
        }
        Ok(shapes)
    }
}

/// What is known of the objects, by their ids.
#[derive(Clone, Debug)]
pub(crate) struct Inventory<'a> {
    objects: BTreeMap<ObjectId, &'a ObjectRecord>,
    trees: BTreeMap<ObjectId, &'a TreeRecord>,
}

impl<'a> Inventory<'a> {
    pub(crate) fn new(scene: &'a ExportScene) -> Self {
        Self {
            objects: scene.objects.iter().map(|r| (r.object, r)).collect(),
            trees: scene.trees.iter().map(|r| (r.object, r)).collect(),
        }
    }

    pub(crate) fn object(&self, object: ObjectId) -> Option<&'a ObjectRecord> {
        self.objects.get(&object).copied()
    }

    pub(crate) fn tree(&self, object: ObjectId) -> Option<&'a TreeRecord> {
        self.trees.get(&object).copied()
    }

    pub(crate) fn objects(&self) -> impl Iterator<Item = &'a ObjectRecord> {
        self.objects.values().copied()
    }
}
