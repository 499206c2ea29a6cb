//! Geometry without foliage and other occluders: the ground, trunks, and each object by itself.

use std::sync::Arc;

use nemoral_assets::PlantKind;
use nemoral_raycast::{Blas, Group};
use nemoral_scene::{ChunkCoord, InstancePlace, MaterialId, ObjectKind, Ontology, Semantic};
use nemoral_stand::{SceneObject, SceneObjects};

use super::assets::WorldAssets;
use crate::Error;

/// The trunks of trees and stumps, logs and root plates.
#[derive(Debug)]
pub struct Trunks {
    /// Those of `standing`; `None` without a trunk.
    standing: Vec<Option<Arc<Blas>>>,
    stumps: Vec<Option<Arc<Blas>>>,
    logs: Vec<Option<Arc<Blas>>>,
    root_plates: Vec<Option<Arc<Blas>>>,
}

impl Trunks {
    /// The parts of trees and stumps that an ontology calls trunks.
    pub(crate) fn new(assets: &WorldAssets, ontology: &Ontology) -> Result<Self, Error> {
        let trunk = ontology.class(Semantic::Stem).id;
        let materials = &assets.library.materials;
        let is_trunk = |m: MaterialId| ontology.class(materials.get(m).semantic).id == trunk;
        let strip = |shape: &Arc<Blas>| -> Result<Option<Arc<Blas>>, Error> {
            let stripped = shape.prototype().retaining(is_trunk, materials);
            let stripped = stripped.map_err(Error::of_stage)?;
            Ok(stripped.map(|trunk| Arc::new(Blas::build(Arc::new(trunk), materials))))
        };
        let strip_all =
            |shapes: &[Arc<Blas>]| -> Result<Vec<_>, Error> { shapes.iter().map(strip).collect() };
        let standing = assets.standing.iter().map(|s| strip(&s.blas));
        Ok(Self {
            standing: standing.collect::<Result<_, _>>()?,
            stumps: strip_all(&assets.plants[PlantKind::Stump])?,
            logs: strip_all(&assets.logs)?,
            root_plates: strip_all(&assets.plants[PlantKind::RootPlate])?,
        })
    }
}

/// The geometry of a chunk without foliage and other occluders: its ground, the trunks on it, and
/// its objects one by one.
#[derive(Debug)]
pub struct UncoveredGeometry {
    pub(crate) ground: Arc<Group>,
    pub(crate) trunks: Arc<Group>,
    pub(crate) objects: Vec<(SceneObject, InstancePlace, Arc<Blas>)>,
}

impl UncoveredGeometry {
    /// Strips a chunk whose ground and objects are in `geometry`.
    pub(crate) fn new(
        (at, chunk_size_m): (ChunkCoord, f64),
        trunks: &Trunks,
        assets: &WorldAssets,
        geometry: &Group,
        objects: &SceneObjects,
    ) -> Self {
        // Instances without an id are the chunk's ground.
        let ground: Vec<_> = (geometry.instances().iter())
            .filter(|(instance, _)| instance.object.is_none())
            .map(|(instance, shape)| (instance.place(), Arc::clone(shape)))
            .collect();
        let mut with_trunks = ground.clone();
        for object in &objects.0 {
            let shape = match object.kind {
                ObjectKind::Tree => &trunks.standing[object.asset],
                ObjectKind::Stump => &trunks.stumps[object.asset],
                ObjectKind::Log => &trunks.logs[object.asset],
                ObjectKind::RootPlate => &trunks.root_plates[object.asset],
                _ => &None,
            };
            if let Some(shape) = shape {
                with_trunks.push((object.place(at, chunk_size_m), Arc::clone(shape)));
            }
        }
        let objects = objects.0.iter().map(|object| {
            let (place, shape) = assets.instance(object, at, chunk_size_m);
            (object.clone(), place, shape)
        });
        Self {
            ground: Arc::new(Group::build(ground)),
            trunks: Arc::new(Group::build(with_trunks)),
            objects: objects.collect(),
        }
    }
}
