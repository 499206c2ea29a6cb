//! Parts of a forest as plain scenes, which `nemoral-export` writes for other programs.

mod area;
mod heights;
mod tree;

use nemoral_export::{ExportCamera, ExportScene};
use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_scene::{ChunkCoord, Instance};

pub use tree::tree_scene;

use crate::plan::Runner;
use crate::preflight::within_sequence;
use crate::{Error, Recorder};

/// Which part of a forest is exported.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ExportArea {
    /// Everything that is visible at a frame, with the cameras as they are then. The origin is that
    /// of the frame's scene: the south-west corner of the robot's chunk.
    Frame(u64),
    /// A rectangle of the world, metres, with everything whose foot is in it; ground and water are
    /// cut at its borders. The origin is its middle.
    Region {
        /// Its south-west corner.
        low_m: DVec2,
        /// Its north-east corner.
        high_m: DVec2,
    },
}

impl Recorder {
    /// The most chunks of a region that is exported.
    pub const EXPORT_CHUNKS: i64 = 900;

    /// A part of the forest. Heights are above the world's zero.
    ///
    /// # Errors
    /// If the frame is beyond the sequence, the region has no area or too many chunks, or its
    /// chunks cannot be made.
    pub fn export_scene(&self, area: ExportArea) -> Result<ExportScene, Error> {
        match area {
            ExportArea::Frame(frame) => {
                within_sequence(&self.sequence().config, frame)?;
                self.prepare()?;
                let scene = self.frame_scene(&self.runner(), frame)?;
                let pose = self.pose(frame)?;
                self.stay_near(pose.world_from_body().translation_m.truncate());
                Ok(scene)
            }
            ExportArea::Region { low_m, high_m } => {
                let rectangle = self.rectangle(low_m, high_m)?;
                let chunks = rectangle.chunks(self.sequence().config.chunks.size_m)?;
                self.prepare()?;
                let scene = self.region(&self.runner(), rectangle, &chunks)?;
                self.stay_near(rectangle.middle_m());
                Ok(scene)
            }
        }
    }

    /// What is visible at a frame.
    fn frame_scene(&self, runner: &Runner<'_>, frame: u64) -> Result<ExportScene, Error> {
        let forest = self.forest();
        let pose = runner.get(forest.pose, frame)?;
        let visible = runner.get(forest.scene, frame)?;
        let mut instances = Vec::new();
        for (offset_m, group) in &visible.groups {
            instances.extend(group.instances().iter().map(|(instance, _)| Instance {
                position_m: instance.position_m + *offset_m,
                ..instance.clone()
            }));
        }
        let config = &self.sequence().config;
        let place_m = pose.world_from_body().translation_m.truncate();
        let (radius_m, size_m) = (config.chunks.visible_radius_m, config.chunks.size_m);
        let chunks = ChunkCoord::within(place_m, radius_m, size_m);
        let scene_from_body = pose.track.relative_to(visible.origin_m).middle();
        let rigs = runner.get(forest.cameras, ())?;
        let cameras = rigs.iter().map(|rig| ExportCamera {
            name: rig.name.clone(),
            intrinsics: rig.intrinsics,
            scene_from_camera: scene_from_body * rig.body_from_camera,
        });
        let name = format!("frame {frame}");
        Ok(ExportScene {
            cameras: cameras.collect(),
            ..self.scene_of(runner, &chunks, (name, visible.origin_m, instances))?
        })
    }

    /// A scene of some instances, with what is known of the objects of these chunks among them.
    fn scene_of(
        &self,
        runner: &Runner<'_>,
        chunks: &[ChunkCoord],
        (name, origin_m, instances): (String, DVec3, Vec<Instance>),
    ) -> Result<ExportScene, Error> {
        let config = &self.sequence().config;
        let assets = runner.get(self.forest().textured_assets, ())?;
        let mut present: Vec<_> = instances.iter().map(|instance| instance.object).collect();
        present.sort_unstable();
        let (mut objects, mut trees) = (Vec::new(), Vec::new());
        for &chunk in chunks {
            for object in &runner.get(self.forest().objects, chunk)?.0 {
                if present.binary_search(&object.object).is_ok() {
                    objects.push(assets.object_record(object));
                    trees.extend(assets.tree_record(object));
                }
            }
        }
        Ok(ExportScene {
            name,
            origin_m,
            seed: config.seed,
            materials: assets.wet_materials(config.weather.wetness()),
            ontology: config.output.ontology.table(),
            instances,
            objects,
            trees,
            cameras: Vec::new(),
        })
    }
}
