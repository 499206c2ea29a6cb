//! What is made for each chunk.

use nemoral_placement::{CoverPoint, Site};
use nemoral_scene::ChunkCoord;
use nemoral_stand::{FallenStem, GroundOcclusion, SceneObjects, SkyViewFactor};

use super::world_nodes::WorldNodes;
use crate::Error;
use crate::config::Config;
use crate::plan::{Node, Plan};
use crate::stages::deadwood::{DeadwoodStage, FallenStemStage};
use crate::stages::ground::ChunkGroundStage;
use crate::stages::ground_occlusion::GroundOcclusionStage;
use crate::stages::litter::{LitterGeometryStage, LitterStage};
use crate::stages::object_geometry::ObjectGeometryStage;
use crate::stages::placement::{RockPhaseStage, RockStage, WoodyStage};
use crate::stages::scene_objects::SceneObjectStage;
use crate::stages::sky_view_factor::{GroundSkyViewStage, SkyViewStage};
use crate::stages::undergrowth::{SeedlingStage, UndergrowthStage};
use crate::stages::undergrowth_geometry::UndergrowthGeometryStage;
use crate::world::chunk_geometry::{LitterGeometry, ObjectGeometry, UndergrowthGeometry};
use crate::world::chunk_ground::ChunkGround;
use crate::world::deadwood::LogRecipe;
use crate::world::ground_mesh::GroundMeshRecipe;
use crate::world::litter::LitterPatch;
use crate::world::patch::Patch;

/// The nodes of a chunk.
pub(super) struct ChunkNodes {
    pub(super) ground: Node<ChunkCoord, ChunkGround>,
    pub(super) rocks: Node<ChunkCoord, Vec<Site>>,
    pub(super) woody: Node<ChunkCoord, Vec<Site>>,
    pub(super) deadwood: Node<ChunkCoord, Vec<FallenStem>>,
    pub(super) objects: Node<ChunkCoord, SceneObjects>,
    pub(super) object_geometry: Node<ChunkCoord, ObjectGeometry>,
    pub(super) ground_sky_view_factor: Node<ChunkCoord, SkyViewFactor>,
    pub(super) sky_view_factor: Node<ChunkCoord, SkyViewFactor>,
    pub(super) undergrowth: Node<ChunkCoord, Vec<Patch>>,
    pub(super) seedlings: Node<ChunkCoord, Vec<CoverPoint>>,
    pub(super) undergrowth_geometry: Node<ChunkCoord, UndergrowthGeometry>,
    pub(super) ground_occlusion: Node<ChunkCoord, Option<GroundOcclusion>>,
    pub(super) litter: Node<ChunkCoord, Vec<LitterPatch>>,
    pub(super) litter_geometry: Node<ChunkCoord, LitterGeometry>,
}

impl ChunkNodes {
    /// Adds them to a plan.
    pub(super) fn add_to(
        plan: &mut Plan,
        config: &Config,
        nodes: &WorldNodes,
    ) -> Result<Self, Error> {
        let &WorldNodes {
            ground_model,
            assets,
            placement,
            flora,
            ..
        } = nodes;
        let chunk_size_m = config.chunks.size_m;
        let ground = plan.add(ChunkGroundStage, (ground_model.global(),));
        // Rocks of a phase see those of lower phases, so there are four nodes and the plan is
        // acyclic.
        let world = placement.global();
        let phase0 = plan.add(RockPhaseStage::<0>, (world, ground, []));
        let phase1 = plan.add(RockPhaseStage::<1>, (world, ground, [phase0.anywhere()]));
        let lower = [phase0.anywhere(), phase1.anywhere()];
        let phase2 = plan.add(RockPhaseStage::<2>, (world, ground, lower));
        let lower = [phase0.anywhere(), phase1.anywhere(), phase2.anywhere()];
        let phase3 = plan.add(RockPhaseStage::<3>, (world, ground, lower));
        let phases = [phase0, phase1, phase2, phase3].map(Node::anywhere);
        let rocks = plan.add(
            RockStage {
                outcrops: config.placement.outcrops,
                chunk_size_m,
            },
            (world, ground, phases),
        );
        let woody = plan.add(WoodyStage, (world, ground, rocks.anywhere()));
        let logs = LogRecipe::new(config);
        let is_empty = logs.is_empty();
        let fallen = plan.add(
            FallenStemStage(logs),
            (
                assets.global(),
                ground_model.global(),
                ground,
                rocks.anywhere(),
                woody.anywhere(),
            ),
        );
        let deadwood = plan.add(DeadwoodStage { is_empty }, (fallen.anywhere(),));
        let objects = plan.add(
            SceneObjectStage,
            (
                assets.global(),
                ground_model.global(),
                ground,
                rocks,
                woody,
                deadwood,
            ),
        );
        let object_geometry = plan.add(
            ObjectGeometryStage {
                ground: GroundMeshRecipe::new(config)?,
                chunk_size_m,
            },
            (assets.global(), ground, objects),
        );
        let ground_sky_view_factor = plan.add(
            GroundSkyViewStage { chunk_size_m },
            (assets.global(), ground, object_geometry.anywhere()),
        );
        let sky_view_factor = plan.add(
            SkyViewStage { chunk_size_m },
            (
                assets.global(),
                ground,
                ground_sky_view_factor,
                object_geometry.anywhere(),
            ),
        );
        let undergrowth = plan.add(
            UndergrowthStage,
            (flora.global(), ground, ground_sky_view_factor),
        );
        let seedlings = plan.add(
            SeedlingStage {
                per_m2: config.placement.regeneration.seedlings,
                chunk_size_m,
            },
            (world, ground, ground_sky_view_factor),
        );
        let undergrowth_geometry = plan.add(
            UndergrowthGeometryStage {
                climbers: config.climbers.clone(),
                banks: config.trails.banks,
                surface_roots: config.undergrowth.surface_roots,
                chunk_size_m,
            },
            (
                assets.global(),
                ground_model.global(),
                ground,
                undergrowth,
                seedlings,
                objects,
                ground_sky_view_factor,
            ),
        );
        let ground_occlusion = plan.add(
            GroundOcclusionStage { chunk_size_m },
            (
                assets.global(),
                ground,
                object_geometry,
                undergrowth_geometry,
            ),
        );
        let litter = plan.add(
            LitterStage { chunk_size_m },
            (
                flora.global(),
                assets.global(),
                ground,
                ground_sky_view_factor,
                object_geometry,
                objects.anywhere(),
            ),
        );
        let litter_geometry = plan.add(
            LitterGeometryStage { chunk_size_m },
            (assets.global(), litter),
        );
        Ok(Self {
            ground,
            rocks,
            woody,
            deadwood,
            objects,
            object_geometry,
            ground_sky_view_factor,
            sky_view_factor,
            undergrowth,
            seedlings,
            undergrowth_geometry,
            ground_occlusion,
            litter,
            litter_geometry,
        })
    }
}
