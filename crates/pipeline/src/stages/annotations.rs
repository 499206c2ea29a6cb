//! Further annotations of a picture: flow, hidden trunks, boxes.

use std::sync::Arc;

use nemoral_raycast::{Blas, Group, RayScene};
use nemoral_render::{
    CameraImages, Candidate, View, nearest_objects, object_boxes, optical_flow, with_visible,
};
use nemoral_scene::glam::{DVec3, Vec3};
use nemoral_scene::{
    Annotations, ChunkCoord, Instance, MaterialId, ObjectKind, Ontology, RigidTransform, Semantic,
    Twist,
};
use nemoral_seed::Key;
use nemoral_stand::{SceneObject, SceneObjects};

use super::frame::{FramePose, FrameScene, motion, pictures_s, visible_chunks};
use super::object_geometry::ObjectGeometry;
use crate::Error;
use crate::config::Config;
use crate::plan::{AnyChunk, Demand, Hasher, Node, OfWorld, Stage};
use crate::robot::{Guide, Land};
use crate::world::assets::WorldAssets;
use crate::world::cameras::CameraRig;
use crate::world::ground::ChunkGround;

/// Trees and stumps without all that is no trunk.
#[derive(Debug)]
pub struct Trunks {
    /// Of `standing`; `None` without trunk.
    standing: Vec<Option<Arc<Blas>>>,
    /// Of `stumps`.
    stumps: Vec<Option<Arc<Blas>>>,
}

/// Strips the [`WorldAssets`] to their [`Trunks`].
#[derive(Clone, Debug)]
pub struct TrunkStage {
    ontology: String,
}

impl TrunkStage {
    /// The stage of a config.
    #[must_use]
    pub fn new(config: &Config) -> Self {
        Self {
            ontology: config.output.ontology.clone(),
        }
    }
}

impl Stage for TrunkStage {
    type At = ();
    type Inputs = (OfWorld<WorldAssets>,);
    type Output = Trunks;
    const ID: &'static str = "world.trunks";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        let Self { ontology } = self;
        hasher.write_str(ontology);
    }

    fn run(&self, (): (), _: Key, (assets,): (Arc<WorldAssets>,)) -> Result<Trunks, Error> {
        let ontology = Ontology::by_name(&self.ontology)
            .expect("the config's words are the built-in ontologies");
        let trunk = ontology.class(Semantic::Stem).id;
        let materials = &assets.library.materials;
        let is_trunk = |m: MaterialId| ontology.class(materials.get(m).semantic).id == trunk;
        let strip = |shape: &Arc<Blas>| -> Result<Option<Arc<Blas>>, Error> {
            let stripped = shape.prototype().retaining(is_trunk, materials);
            let stripped = stripped.map_err(Error::of_stage)?;
            Ok(stripped.map(|trunk| Arc::new(Blas::build(Arc::new(trunk), materials))))
        };
        let standing = assets.standing.iter().map(|s| strip(&s.blas));
        Ok(Trunks {
            standing: standing.collect::<Result<_, _>>()?,
            stumps: assets.stumps.iter().map(strip).collect::<Result<_, _>>()?,
        })
    }
}

/// The geometry of a chunk without what hides it: its ground, its trunks on the ground, and its
/// objects one by one.
#[derive(Debug)]
pub struct UncoveredGeometry {
    ground: Arc<Group>,
    trunks: Arc<Group>,
    objects: Vec<(SceneObject, Instance, Arc<Blas>)>,
}

/// Strips a chunk.
#[derive(Clone, Copy, Debug)]
pub struct UncoveredGeometryStage {
    /// Side of a chunk.
    pub chunk_size_m: f64,
}

impl Stage for UncoveredGeometryStage {
    type At = ChunkCoord;
    type Inputs = (
        OfWorld<Trunks>,
        OfWorld<WorldAssets>,
        Node<ChunkCoord, ObjectGeometry>,
        Node<ChunkCoord, SceneObjects>,
    );
    type Output = UncoveredGeometry;
    const ID: &'static str = "chunk.bare";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        let Self { chunk_size_m } = self;
        hasher.write_f64(*chunk_size_m);
    }

    fn run(
        &self,
        at: ChunkCoord,
        _: Key,
        (trunks, assets, geometry, objects): (
            Arc<Trunks>,
            Arc<WorldAssets>,
            Arc<ObjectGeometry>,
            Arc<SceneObjects>,
        ),
    ) -> Result<UncoveredGeometry, Error> {
        // All that has no id there is the chunk's ground.
        let ground: Vec<_> = (geometry.0.instances().iter())
            .filter(|(instance, _)| instance.object.is_none())
            .cloned()
            .collect();
        let mut with_trunks = ground.clone();
        for object in &objects.0 {
            let shape = match object.kind {
                ObjectKind::Tree => &trunks.standing[object.asset],
                ObjectKind::Stump => &trunks.stumps[object.asset],
                _ => &None,
            };
            if let Some(shape) = shape {
                let instance = object.instance(shape.prototype(), at, self.chunk_size_m);
                with_trunks.push((instance, Arc::clone(shape)));
            }
        }
        let objects = objects.0.iter().map(|object| {
            let (instance, shape) = assets.instance(object, at, self.chunk_size_m);
            (object.clone(), instance, shape)
        });
        Ok(UncoveredGeometry {
            ground: Arc::new(Group::build(ground)),
            trunks: Arc::new(Group::build(with_trunks)),
            objects: objects.collect(),
        })
    }
}

/// Finds out what the pictures were asked for besides.
#[derive(Clone, Debug)]
pub struct AnnotationStage {
    ontology: String,
    chunk_size_m: f64,
    visible_radius_m: f64,
    pictures_s: f64,
}

impl AnnotationStage {
    /// The stage of a config.
    #[must_use]
    pub fn new(config: &Config) -> Self {
        Self {
            ontology: config.output.ontology.clone(),
            chunk_size_m: config.chunks.size_m,
            visible_radius_m: config.chunks.visible_radius_m,
            pictures_s: pictures_s(config),
        }
    }
}

impl Stage for AnnotationStage {
    type At = u64;
    type Inputs = (
        OfWorld<Vec<CameraRig>>,
        OfWorld<Guide>,
        Node<u64, FramePose>,
        Node<u64, FrameScene>,
        Node<u64, Vec<CameraImages>>,
        AnyChunk<ChunkGround>,
        AnyChunk<SceneObjects>,
        AnyChunk<UncoveredGeometry>,
    );
    type Output = Vec<Annotations>;
    const ID: &'static str = "frame.extra";
    const VERSION: u32 = 2;

    fn fingerprint(&self, hasher: &mut Hasher) {
        let Self {
            ontology,
            chunk_size_m,
            visible_radius_m,
            pictures_s,
        } = self;
        hasher.write_str(ontology);
        hasher.write_f64(*chunk_size_m);
        hasher.write_f64(*visible_radius_m);
        hasher.write_f64(*pictures_s);
    }

    fn run(
        &self,
        at: u64,
        _: Key,
        (rigs, guide, pose, scene, images, ground, objects, uncovered): (
            Arc<Vec<CameraRig>>,
            Arc<Guide>,
            Arc<FramePose>,
            Arc<FrameScene>,
            Arc<Vec<CameraImages>>,
            Demand<'_, ChunkGround>,
            Demand<'_, SceneObjects>,
            Demand<'_, UncoveredGeometry>,
        ),
    ) -> Result<Vec<Annotations>, Error> {
        let view = |rig: &CameraRig, (body, motion): (RigidTransform, Twist)| View {
            shutter: rig.shutter,
            motion: motion.of_mounted(&rig.body_from_camera),
            ..View::new(rig.intrinsics, body * rig.body_from_camera)
        };
        let body = pose.track.relative_to(scene.origin_m).middle();
        let body = (body, pose.motion);
        let next = if rigs.iter().any(|r| r.annotations.flow) {
            let land = Land { ground, objects };
            self.next_body(at, &guide, land, scene.origin_m)?
        } else {
            None
        };
        let stripped = if rigs
            .iter()
            .any(|r| r.annotations.trunks || r.annotations.boxes)
        {
            Some(self.strip(&pose, uncovered)?)
        } else {
            None
        };
        let max_range_m = self.visible_radius_m as f32;
        let ontology = Ontology::by_name(&self.ontology)
            .expect("the config's words are the built-in ontologies");
        let trunk = ontology.class(Semantic::Stem).id;
        let is_trunk = |s: Semantic| ontology.class(s).id == trunk;
        let of = |(rig, images): (&CameraRig, &CameraImages)| {
            let (truth, seen) = (&images.truth, view(rig, body));
            let flow = rig.annotations.flow.then(|| match next {
                Some(next) => optical_flow(&*scene.caster, truth, &seen, &view(rig, next)),
                // The path ends here.
                None => truth.depth_m.map(|_| None),
            });
            let stripped = stripped.as_ref();
            let trunks = stripped.filter(|_| rig.annotations.trunks).map(|s| {
                let cast = nearest_objects(&s.trunks, &seen, max_range_m);
                with_visible(&cast.map(|(_, object)| *object), truth, is_trunk)
            });
            let boxes = stripped.filter(|_| rig.annotations.boxes).map(|s| {
                let ground_m = nearest_objects(&s.ground, &seen, max_range_m);
                let eye = seen.scene_from_camera.translation_m;
                let near: Vec<&Stripped> = (s.objects.iter())
                    .filter(|t| t.foot_m.distance(eye) <= rig.boxes_range_m)
                    .collect();
                let candidates: Vec<Candidate> = near.iter().map(|t| t.candidate).collect();
                let alone = |i: usize| near[i].alone();
                object_boxes(&candidates, alone, &ground_m, truth, &seen, max_range_m)
            });
            Annotations {
                flow,
                trunks,
                boxes,
            }
        };
        Ok(rigs.iter().zip(&*images).map(of).collect())
    }
}

/// A frame's scene without what hides.
struct StrippedScene {
    ground: RayScene,
    trunks: RayScene,
    objects: Vec<Stripped>,
}

/// A thing of the scene.
struct Stripped {
    candidate: Candidate,
    foot_m: DVec3,
    offset: Vec3,
    instance: Instance,
    shape: Arc<Blas>,
}

impl Stripped {
    fn new(offset: Vec3, (object, instance, shape): &(SceneObject, Instance, Arc<Blas>)) -> Self {
        let foot_m = (offset + instance.position_m).as_dvec3();
        let bounds = shape.prototype().bounds();
        let (object, kind) = (object.object, object.kind);
        Self {
            candidate: Candidate::around(object, kind, foot_m, &instance.linear, bounds),
            foot_m,
            offset,
            instance: instance.clone(),
            shape: Arc::clone(shape),
        }
    }

    /// A scene of nothing else.
    fn alone(&self) -> RayScene {
        let group = Group::build(vec![(self.instance.clone(), Arc::clone(&self.shape))]);
        RayScene::new(vec![(self.offset, Arc::new(group))])
    }
}

impl AnnotationStage {
    /// The body's pose at the next frame, in this frame's scene, and how it moves then; `None` where the
    /// path ends.
    fn next_body(
        &self,
        at: u64,
        guide: &Guide,
        land: Land<'_>,
        origin_m: DVec3,
    ) -> Result<Option<(RigidTransform, Twist)>, Error> {
        if guide.frames().is_some_and(|frames| at + 1 >= frames) {
            return Ok(None);
        }
        let mut body = guide.pose(at + 1, 0.0, land)?;
        body.translation_m -= origin_m;
        Ok(Some((body, motion(guide, at + 1, self.pictures_s, land)?)))
    }

    fn strip(
        &self,
        pose: &FramePose,
        uncovered: Demand<'_, UncoveredGeometry>,
    ) -> Result<StrippedScene, Error> {
        let size = self.chunk_size_m;
        let position = pose.world_from_body().translation_m.truncate();
        let visible = visible_chunks(position, self.visible_radius_m, size);
        let (mut ground, mut trunks, mut objects) = (Vec::new(), Vec::new(), Vec::new());
        for (chunk, uncovered) in visible.iter().zip(uncovered.all(&visible)?) {
            let steps = (chunk.x - pose.chunk.x, chunk.y - pose.chunk.y);
            let offset = Vec3::new(steps.0 as f32, steps.1 as f32, 0.0) * size as f32;
            ground.push((offset, Arc::clone(&uncovered.ground)));
            trunks.push((offset, Arc::clone(&uncovered.trunks)));
            objects.extend(uncovered.objects.iter().map(|t| Stripped::new(offset, t)));
        }
        Ok(StrippedScene {
            ground: RayScene::new(ground),
            trunks: RayScene::new(trunks),
            objects,
        })
    }
}
