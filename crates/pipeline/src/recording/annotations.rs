//! Annotations of a picture: flow, hidden trunks, boxes.

use std::sync::Arc;

use nemoral_raycast::{Blas, Group, RayScene};
use nemoral_render::{
    BoxCandidate, CameraImages, View, nearest_objects, object_boxes, optical_flow, with_visible,
};
use nemoral_scene::glam::{DVec3, Vec3};
use nemoral_scene::{Annotations, ChunkCoord, InstancePlace, Ontology, Semantic};
use nemoral_stand::SceneObject;

use super::pose::FramePose;
use super::scene::{FrameScene, chunk_offset_m};
use crate::Error;
use crate::config::{Config, OntologyName};
use crate::plan::{Demand, Hasher};
use crate::pool::in_pool;
use crate::world::cameras::CameraRig;
use crate::world::uncovered::UncoveredGeometry;

/// The annotations that a config wants.
#[derive(Clone, Debug)]
pub(crate) struct AnnotationRecipe {
    ontology: OntologyName,
    chunk_size_m: f64,
    visible_radius_m: f64,
}

/// The next frame, which flow leads to.
pub(crate) struct NextFrame {
    pub(crate) pose: Arc<FramePose>,
    /// What its cameras see. Undergrowth, litter and what is far away come and go as the body
    /// moves, so that this frame's scene does not tell what that one's pictures show.
    pub(crate) scene: Arc<FrameScene>,
}

impl AnnotationRecipe {
    pub(crate) fn new(config: &Config) -> Self {
        Self {
            ontology: config.output.ontology,
            chunk_size_m: config.chunks.size_m,
            visible_radius_m: config.chunks.visible_radius_m,
        }
    }

    pub(crate) fn fingerprint(&self, hasher: &mut Hasher) {
        let Self {
            ontology,
            chunk_size_m,
            visible_radius_m,
        } = self;
        hasher.write_str(ontology.word());
        hasher.write_f64(*chunk_size_m);
        hasher.write_f64(*visible_radius_m);
    }

    /// The annotations of pictures that were taken at a pose; without a next frame, flow is empty.
    pub(crate) fn annotate(
        &self,
        rigs: &[CameraRig],
        (pose, scene, images): (&FramePose, &FrameScene, &[CameraImages]),
        uncovered: Demand<'_, UncoveredGeometry>,
        next: Option<NextFrame>,
    ) -> Result<Vec<Annotations>, Error> {
        let want_stripped = |rig: &CameraRig| rig.annotations.trunks || rig.annotations.boxes;
        let stripped = if rigs.iter().any(want_stripped) {
            let visible = &scene.chunks;
            let uncovered = uncovered.all(visible)?;
            let chunks = visible.iter().zip(&uncovered).map(|(at, u)| (*at, &**u));
            let strip = || StrippedScene::new(pose.chunk, self.chunk_size_m, chunks);
            Some(in_pool(strip))
        } else {
            None
        };
        let ontology = self.ontology.table();
        let annotator = Annotator {
            ontology: &ontology,
            max_range_m: self.visible_radius_m as f32,
            pose,
            origin_m: scene.origin_m,
            stripped,
            next,
        };
        let pictures = || rigs.iter().zip(images);
        Ok(in_pool(|| {
            let annotated = pictures().map(|(rig, images)| annotator.annotate(rig, images));
            annotated.collect()
        }))
    }
}

/// The data from which pictures of a frame are annotated.
struct Annotator<'a> {
    /// The ontology that defines trunks.
    ontology: &'a Ontology,
    /// The greatest distance that pictures show, metres.
    max_range_m: f32,
    /// Where the body is.
    pose: &'a FramePose,
    /// The world position of the scene's origin.
    origin_m: DVec3,
    /// The scene without foliage and other occluders, which trunks and boxes need.
    stripped: Option<StrippedScene>,
    /// The next frame; `None` where the path ends.
    next: Option<NextFrame>,
}

/// What a camera sees from a pose of the body, in a scene with this origin in the world.
fn view(rig: &CameraRig, pose: &FramePose, origin_m: DVec3) -> View {
    let body = pose.track.relative_to(origin_m).middle();
    View {
        shutter: rig.shutter,
        motion: pose.motion.of_mounted(&rig.body_from_camera),
        ..View::new(rig.intrinsics, body * rig.body_from_camera)
    }
}

impl Annotator<'_> {
    /// The annotations that a camera asks for, of its picture.
    fn annotate(&self, rig: &CameraRig, images: &CameraImages) -> Annotations {
        let trunk = self.ontology.class(Semantic::Stem).id;
        let is_trunk = |s: Semantic| self.ontology.class(s).id == trunk;
        let (truth, seen) = (&images.truth, view(rig, self.pose, self.origin_m));
        let flow = rig.annotations.flow.then(|| match &self.next {
            Some(NextFrame { pose, scene }) => {
                let [here, there] =
                    [self.pose, &**pose].map(|pose| view(rig, pose, scene.origin_m));
                optical_flow(&*scene.caster, truth, &here, &there, self.max_range_m)
            }
            // The path ends here.
            None => truth.depth_m.map(|_| None),
        });
        let stripped = self.stripped.as_ref();
        let trunks = stripped.filter(|_| rig.annotations.trunks).map(|s| {
            let cast = nearest_objects(&s.trunks, &seen, self.max_range_m);
            with_visible(&cast.map(|(_, object)| *object), truth, is_trunk)
        });
        let boxes = stripped.filter(|_| rig.annotations.boxes).map(|s| {
            let ground_m = nearest_objects(&s.ground, &seen, self.max_range_m);
            let eye = seen.scene_from_camera.translation_m;
            let near: Vec<&Stripped> = (s.objects.iter())
                .filter(|t| t.foot_m.distance(eye) <= rig.boxes_range_m)
                .collect();
            let candidates: Vec<BoxCandidate> = near.iter().map(|t| t.candidate).collect();
            let alone = |i: usize| near[i].alone();
            object_boxes(
                &candidates,
                alone,
                &ground_m,
                truth,
                &seen,
                self.max_range_m,
            )
        });
        Annotations {
            flow,
            trunks,
            boxes,
        }
    }
}

/// A frame's scene without foliage and other occluders.
struct StrippedScene {
    ground: RayScene,
    trunks: RayScene,
    objects: Vec<Stripped>,
}

impl StrippedScene {
    /// The scene around the corner of a chunk.
    fn new<'a>(
        around: ChunkCoord,
        chunk_size_m: f64,
        chunks: impl Iterator<Item = (ChunkCoord, &'a UncoveredGeometry)>,
    ) -> Self {
        let (mut ground, mut trunks, mut objects) = (Vec::new(), Vec::new(), Vec::new());
        for (chunk, uncovered) in chunks {
            let offset = chunk_offset_m(chunk, around, chunk_size_m);
            ground.push((offset, Arc::clone(&uncovered.ground)));
            trunks.push((offset, Arc::clone(&uncovered.trunks)));
            objects.extend(uncovered.objects.iter().map(|t| Stripped::new(offset, t)));
        }
        Self {
            ground: RayScene::new(ground),
            trunks: RayScene::new(trunks),
            objects,
        }
    }
}

/// An object of the scene.
struct Stripped {
    candidate: BoxCandidate,
    foot_m: DVec3,
    offset: Vec3,
    place: InstancePlace,
    shape: Arc<Blas>,
}

impl Stripped {
    fn new(offset: Vec3, (object, place, shape): &(SceneObject, InstancePlace, Arc<Blas>)) -> Self {
        let foot_m = (offset + place.position_m).as_dvec3();
        let bounds = shape.prototype().bounds();
        let (object, kind) = (object.object, object.kind);
        Self {
            candidate: BoxCandidate::around(object, kind, foot_m, &place.linear, bounds),
            foot_m,
            offset,
            place: *place,
            shape: Arc::clone(shape),
        }
    }

    /// A scene of this object alone.
    fn alone(&self) -> RayScene {
        let group = Group::build(vec![(self.place, Arc::clone(&self.shape))]);
        RayScene::new(vec![(self.offset, Arc::new(group))])
    }
}
