//! Further truth of a picture: flow, hidden trunks, boxes.

use std::sync::Arc;

use nemoral_raycast::{Blas, Group, RayScene};
use nemoral_render::{CameraImages, Candidate, View, nearest_objects, object_boxes, optical_flow};
use nemoral_scene::glam::{DMat3, DQuat, DVec3, Mat3, Vec3};
use nemoral_scene::{
    Annotations, ChunkCoord, Image, Instance, MaterialId, Mesh, ObjectId, ObjectKind, Ontology,
    Prototype, RigidTransform, Semantic, TruthImages, Twist,
};
use nemoral_seed::Key;

use super::assets::WorldAssets;
use super::chunk::Solid;
use super::frame::{FramePose, FrameScene, motion, pictures_s, visible_chunks};
use super::ground::ChunkGround;
use super::guide::{Guide, Land};
use super::sensors::CameraRig;
use super::things::{Thing, Things};
use crate::Error;
use crate::config::Config;
use crate::plan::{AnyChunk, Demand, Forest, Hasher, Node, OfWorld, Stage};

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

impl Stage<Forest> for TrunkStage {
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
            let whole = shape.prototype();
            let mesh = whole.mesh();
            let kept: Vec<_> = (mesh.triangles.iter().copied())
                .filter(|t| is_trunk(t.material))
                .collect();
            let cards: Vec<_> = (whole.cards().iter().copied())
                .filter(|c| is_trunk(c.material))
                .collect();
            if kept.is_empty() && cards.is_empty() {
                return Ok(None);
            }
            let mesh = Mesh {
                triangles: kept,
                blends: Vec::new(),
                ..mesh.clone()
            };
            let stripped = Prototype::new(whole.name(), mesh, cards, materials);
            let stripped = Arc::new(stripped.map_err(Error::of_stage)?);
            Ok(Some(Arc::new(Blas::build(stripped, materials))))
        };
        let standing = assets.standing.iter().map(|s| strip(&s.blas));
        Ok(Trunks {
            standing: standing.collect::<Result<_, _>>()?,
            stumps: assets.stumps.iter().map(strip).collect::<Result<_, _>>()?,
        })
    }
}

/// A chunk without what hides: its ground, its trunks on the ground, its things one by one.
#[derive(Debug)]
pub struct Bare {
    ground: Arc<Group>,
    trunks: Arc<Group>,
    things: Vec<(Thing, Instance, Arc<Blas>)>,
}

/// Strips a chunk.
#[derive(Clone, Copy, Debug)]
pub struct BareStage {
    /// Side of a chunk.
    pub chunk_size_m: f64,
}

impl Stage<Forest> for BareStage {
    type At = ChunkCoord;
    type Inputs = (
        OfWorld<Trunks>,
        OfWorld<WorldAssets>,
        Node<ChunkCoord, Solid>,
        Node<ChunkCoord, Things>,
    );
    type Output = Bare;
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
        (trunks, assets, solid, things): (Arc<Trunks>, Arc<WorldAssets>, Arc<Solid>, Arc<Things>),
    ) -> Result<Bare, Error> {
        // All that has no id in a solid chunk is its ground.
        let ground: Vec<_> = (solid.0.instances().iter())
            .filter(|(instance, _)| instance.object.is_none())
            .cloned()
            .collect();
        let mut with_trunks = ground.clone();
        for thing in &things.0 {
            let shape = match thing.kind {
                ObjectKind::Tree => &trunks.standing[thing.asset],
                ObjectKind::Stump => &trunks.stumps[thing.asset],
                _ => &None,
            };
            if let Some(shape) = shape {
                let instance = thing.instance(shape, at, self.chunk_size_m);
                with_trunks.push((instance, Arc::clone(shape)));
            }
        }
        let things = things.0.iter().map(|thing| {
            let shape = thing.shape(&assets);
            let instance = thing.instance(shape, at, self.chunk_size_m);
            (thing.clone(), instance, Arc::clone(shape))
        });
        Ok(Bare {
            ground: Arc::new(Group::build(ground)),
            trunks: Arc::new(Group::build(with_trunks)),
            things: things.collect(),
        })
    }
}

/// Finds out what the pictures were asked for besides.
#[derive(Clone, Debug)]
pub struct ExtraStage {
    ontology: String,
    chunk_size_m: f64,
    visible_radius_m: f64,
    pictures_s: f64,
}

impl ExtraStage {
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

impl Stage<Forest> for ExtraStage {
    type At = u64;
    type Inputs = (
        OfWorld<Vec<CameraRig>>,
        OfWorld<Guide>,
        Node<u64, FramePose>,
        Node<u64, FrameScene>,
        Node<u64, Vec<CameraImages>>,
        AnyChunk<ChunkGround>,
        AnyChunk<Things>,
        AnyChunk<Bare>,
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
        (rigs, guide, pose, scene, images, ground, things, bare): (
            Arc<Vec<CameraRig>>,
            Arc<Guide>,
            Arc<FramePose>,
            Arc<FrameScene>,
            Arc<Vec<CameraImages>>,
            Demand<'_, ChunkGround>,
            Demand<'_, Things>,
            Demand<'_, Bare>,
        ),
    ) -> Result<Vec<Annotations>, Error> {
        let view = |rig: &CameraRig, (body, motion): (RigidTransform, Twist)| View {
            shutter: rig.shutter,
            motion: motion.of_mounted(&rig.body_from_camera),
            ..View::new(rig.intrinsics, body * rig.body_from_camera)
        };
        let body = pose.track.relative_to(scene.origin_m).middle();
        let body = (body, pose.motion);
        let next = if rigs.iter().any(|r| r.extra.flow) {
            let land = Land { ground, things };
            self.next_body(at, &guide, land, scene.origin_m)?
        } else {
            None
        };
        let stripped = if rigs.iter().any(|r| r.extra.trunks || r.extra.boxes) {
            Some(self.strip(&pose, bare)?)
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
            let flow = rig.extra.flow.then(|| match next {
                Some(next) => optical_flow(&*scene.caster, truth, &seen, &view(rig, next)),
                // The path ends here.
                None => truth.depth_m.map(|_| None),
            });
            let stripped = stripped.as_ref();
            let trunks = stripped.filter(|_| rig.extra.trunks).map(|s| {
                let cast = nearest_objects(&s.trunks, &seen, max_range_m);
                with_seen(&cast.map(|(_, object)| *object), truth, is_trunk)
            });
            let boxes = stripped.filter(|_| rig.extra.boxes).map(|s| {
                let ground_m = nearest_objects(&s.ground, &seen, max_range_m);
                let eye = seen.scene_from_camera.translation_m;
                let near: Vec<&Stripped> = (s.things.iter())
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

/// The trunks on rays, and those that the picture shows: on a trunk's border a GPU's pixel may show what
/// the ray just misses.
fn with_seen(
    cast: &Image<ObjectId>,
    truth: &TruthImages,
    is_trunk: impl Fn(Semantic) -> bool,
) -> Image<ObjectId> {
    let seen = truth.semantic.pixels().iter().zip(truth.object.pixels());
    let pixels = cast.pixels().iter().zip(seen);
    let pixels = pixels.map(|(cast, (semantic, seen))| {
        let shows = !seen.is_none() && is_trunk(*semantic);
        if shows { *seen } else { *cast }
    });
    Image::new(cast.width(), cast.height(), pixels.collect())
}

/// A frame's scene without what hides.
struct StrippedScene {
    ground: RayScene,
    trunks: RayScene,
    things: Vec<Stripped>,
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
    fn new(offset: Vec3, (thing, instance, shape): &(Thing, Instance, Arc<Blas>)) -> Self {
        let foot_m = (offset + instance.position_m).as_dvec3();
        let (scene_from_box, size_m) = upright_box(foot_m, &instance.linear, shape.prototype());
        Self {
            candidate: Candidate {
                object: thing.object,
                kind: thing.kind,
                scene_from_box,
                size_m,
            },
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

/// The upright box around a placed shape, turned as the shape is turned.
fn upright_box(foot_m: DVec3, linear: &Mat3, shape: &Prototype) -> (RigidTransform, DVec3) {
    let linear: DMat3 = linear.as_dmat3();
    let yaw_rad = libm::atan2(linear.x_axis.y, linear.x_axis.x);
    let turned = RigidTransform::from_xyz_rpy(DVec3::ZERO, 0.0, 0.0, yaw_rad).rotation;
    let back: DQuat = turned.inverse();
    let b = shape.bounds();
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for i in 0..8 {
        let pick = |bit: u32, low: f32, high: f32| if i >> bit & 1 == 0 { low } else { high };
        let corner = Vec3::new(
            pick(0, b.min.x, b.max.x),
            pick(1, b.min.y, b.max.y),
            pick(2, b.min.z, b.max.z),
        );
        let p = back * (linear * corner.as_dvec3());
        (low, high) = (low.min(p), high.max(p));
    }
    let scene_from_box = RigidTransform {
        rotation: turned,
        translation_m: foot_m + turned * ((low + high) / 2.0),
    };
    (scene_from_box, high - low)
}

impl ExtraStage {
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

    fn strip(&self, pose: &FramePose, bare: Demand<'_, Bare>) -> Result<StrippedScene, Error> {
        let size = self.chunk_size_m;
        let position = pose.world_from_body().translation_m.truncate();
        let visible = visible_chunks(position, self.visible_radius_m, size);
        let (mut ground, mut trunks, mut things) = (Vec::new(), Vec::new(), Vec::new());
        for (chunk, bare) in visible.iter().zip(bare.all(&visible)?) {
            let steps = (chunk.x - pose.chunk.x, chunk.y - pose.chunk.y);
            let offset = Vec3::new(steps.0 as f32, steps.1 as f32, 0.0) * size as f32;
            ground.push((offset, Arc::clone(&bare.ground)));
            trunks.push((offset, Arc::clone(&bare.trunks)));
            things.extend(bare.things.iter().map(|t| Stripped::new(offset, t)));
        }
        Ok(StrippedScene {
            ground: RayScene::new(ground),
            trunks: RayScene::new(trunks),
            things,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trunk_that_is_seen_is_the_nearest() {
        let tree = |item| ObjectId::new(ChunkCoord::new(0, 0), item).expect("in range");
        let (none, near, far) = (ObjectId::NONE, tree(1), tree(2));
        // The ray hits and the pixel shows, it misses, a leaf is before, a stem of nobody.
        let cast = [near, far, far, far];
        let shown = [near, near, near, none];
        use Semantic::{Leaf, Stem};
        let row = |objects: [ObjectId; 4]| Image::new(4, 1, objects.to_vec());
        let truth = TruthImages {
            semantic: Image::new(4, 1, vec![Stem, Stem, Leaf, Stem]),
            object: row(shown),
            depth_m: Image::new(4, 1, vec![1.0; 4]),
            normal: Image::new(4, 1, vec![Vec3::Z; 4]),
        };
        let trunks = with_seen(&row(cast), &truth, |s| s == Stem);
        assert_eq!(trunks, row([near, near, far, far]));
    }
}
