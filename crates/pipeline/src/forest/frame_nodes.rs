//! What is made for each frame, and what only frames need.

use nemoral_render::CameraImages;
use nemoral_scene::{Annotations, ChunkCoord, LidarPoint};

use super::chunk_nodes::ChunkNodes;
use super::world_nodes::WorldNodes;
use crate::InputFiles;
use crate::config::Config;
use crate::plan::{Node, Plan};
use crate::recording::annotations::AnnotationRecipe;
use crate::recording::pose::{FramePose, pictures_s};
use crate::recording::scene::FrameScene;
use crate::recording::visible_reach::VisibleReach;
use crate::stages::annotations::{AnnotationStage, TrunkStage, UncoveredGeometryStage};
use crate::stages::balance::{ChoiceStage, ChosenPoseStage, PilotStage};
use crate::stages::frame::{
    CameraSceneStage, ImageStage, LidarSceneStage, PoseStage, ScanStage, SceneStage,
};
use crate::world::balance::{BalanceChoice, BalanceRecipe, Pilot};
use crate::world::uncovered::UncoveredGeometry;

/// The nodes of a frame.
pub(super) struct FrameNodes {
    pub(super) balance_pilot: Option<Node<(), Pilot>>,
    pub(super) balance_choice: Option<Node<u64, BalanceChoice>>,
    pub(super) pose: Node<u64, FramePose>,
    pub(super) scene: Node<u64, FrameScene>,
    pub(super) camera_scene: Node<u64, FrameScene>,
    pub(super) lidar_scene: Node<u64, FrameScene>,
    pub(super) images: Node<u64, Vec<CameraImages>>,
    pub(super) uncovered_geometry: Node<ChunkCoord, UncoveredGeometry>,
    pub(super) annotations: Node<u64, Vec<Annotations>>,
    pub(super) scans: Node<u64, Vec<Vec<LidarPoint>>>,
}

impl FrameNodes {
    /// Adds them to a plan.
    pub(super) fn add_to(
        plan: &mut Plan,
        config: &Config,
        inputs: &InputFiles,
        reach: VisibleReach,
        (world, chunk): (&WorldNodes, &ChunkNodes),
    ) -> Self {
        let &WorldNodes {
            ground_model,
            assets,
            materials,
            trajectory,
            cameras,
            lidars,
            ..
        } = world;
        let &ChunkNodes {
            ground,
            objects,
            object_geometry,
            sky_view_factor,
            undergrowth_geometry,
            ground_occlusion,
            litter_geometry,
            ..
        } = chunk;
        let chunk_size_m = config.chunks.size_m;
        let (ground_there, objects_there) = (ground.anywhere(), objects.anywhere());
        let pictures_s = pictures_s(config);
        let chosen = BalanceRecipe::new(config, inputs).map(|recipe| {
            let (path, assets, lidars) = (trajectory.global(), assets.global(), lidars.global());
            let (solid, low) = (object_geometry.anywhere(), undergrowth_geometry.anywhere());
            let litter = litter_geometry.anywhere();
            let pilot = plan.add(
                PilotStage(recipe.clone()),
                (
                    path,
                    assets,
                    lidars,
                    ground_there,
                    objects_there,
                    solid,
                    low,
                    litter,
                ),
            );
            let choice = plan.add(
                ChoiceStage(recipe),
                (
                    pilot.global(),
                    path,
                    assets,
                    lidars,
                    ground_there,
                    objects_there,
                    solid,
                    low,
                    litter,
                ),
            );
            let pose = plan.add(
                ChosenPoseStage {
                    chunk_size_m,
                    pictures_s,
                },
                (choice, path, lidars, ground_there, objects_there),
            );
            (pilot, choice, pose)
        });
        let pose = match chosen {
            Some((_, _, pose)) => pose,
            None => plan.add(
                PoseStage {
                    chunk_size_m,
                    pictures_s,
                },
                (
                    trajectory.global(),
                    lidars.global(),
                    ground_there,
                    objects_there,
                ),
            ),
        };
        let scene = plan.add(
            SceneStage(reach),
            (
                pose,
                object_geometry.anywhere(),
                undergrowth_geometry.anywhere(),
                litter_geometry.anywhere(),
                sky_view_factor.anywhere(),
                ground_occlusion.anywhere(),
            ),
        );
        let camera_scene = plan.add(
            CameraSceneStage(reach),
            (
                cameras.global(),
                assets.global(),
                ground_model.global(),
                pose,
                object_geometry.anywhere(),
                undergrowth_geometry.anywhere(),
                litter_geometry.anywhere(),
                sky_view_factor.anywhere(),
                ground_occlusion.anywhere(),
            ),
        );
        let lidar_scene = plan.add(
            LidarSceneStage(reach),
            (
                lidars.global(),
                assets.global(),
                ground_model.global(),
                pose,
                object_geometry.anywhere(),
                undergrowth_geometry.anywhere(),
                litter_geometry.anywhere(),
            ),
        );
        let images = plan.add(
            ImageStage,
            (cameras.global(), materials.global(), pose, camera_scene),
        );
        let trunks = plan.add(
            TrunkStage {
                ontology: config.output.ontology,
            },
            (assets.global(),),
        );
        let uncovered_geometry = plan.add(
            UncoveredGeometryStage { chunk_size_m },
            (trunks.global(), assets.global(), object_geometry, objects),
        );
        let annotations = plan.add(
            AnnotationStage(AnnotationRecipe::new(config)),
            (
                cameras.global(),
                trajectory.global(),
                pose.anywhere(),
                camera_scene.anywhere(),
                images,
                uncovered_geometry.anywhere(),
            ),
        );
        let scans = plan.add(
            ScanStage,
            (lidars.global(), materials.global(), pose, lidar_scene),
        );
        Self {
            balance_pilot: chosen.map(|(pilot, _, _)| pilot),
            balance_choice: chosen.map(|(_, choice, _)| choice),
            pose,
            scene,
            camera_scene,
            lidar_scene,
            images,
            uncovered_geometry,
            annotations,
            scans,
        }
    }
}
