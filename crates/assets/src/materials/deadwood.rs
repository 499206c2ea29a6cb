//! The materials of logs, root plates and branches on the ground.

use std::sync::Arc;

use nemoral_scene::{DecayStage, MaterialId, MaterialLibrary, Optics, Semantic, Texture};
use nemoral_seed::Key;
use rayon::prelude::*;

use super::solid::{SolidTextures, laser, solid};
use super::{GroundMaterials, TextureBaker};
use crate::textures::{bark, mineral};
use crate::tree::Species;

/// What the logs of a species are made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LogMaterials {
    /// The side, by the stage of decay; u runs once around from the underside.
    pub(crate) side: [MaterialId; 5],
    /// A cut: sawn lately, and years ago.
    pub(crate) faces: [MaterialId; 2],
    /// A break, by the stage of decay.
    pub(crate) torn: [MaterialId; 5],
    /// What is left of branches.
    pub(crate) stub: MaterialId,
    /// Bracket fungi.
    pub(crate) fungus: MaterialId,
}

/// What root plates are made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RootPlateMaterials {
    /// The side that was the forest floor.
    pub(crate) floor: MaterialId,
    /// The side that was below.
    pub(crate) soil: MaterialId,
    pub(crate) root: MaterialId,
    /// Stones that hang in the soil.
    pub(crate) stone: MaterialId,
}

/// What deadwood is made of.
#[derive(Clone, Debug)]
pub(crate) struct DeadwoodMaterials {
    /// Of each species.
    pub(crate) logs: Vec<LogMaterials>,
    pub(crate) root_plate: RootPlateMaterials,
    /// Branches on the ground: with their bark, and weathered.
    pub(crate) branches: [MaterialId; 2],
}

/// The textures that only deadwood has.
pub(super) struct DeadwoodTextures {
    /// Sides at the last three stages of decay.
    decayed: [Arc<Texture>; 3],
    fungus: Arc<Texture>,
}

impl DeadwoodTextures {
    pub(super) fn bake(baker: &TextureBaker, key: Key) -> Self {
        let stages = [DecayStage::Bare, DecayStage::Soft, DecayStage::Rotten];
        let decayed: Vec<Arc<Texture>> = stages
            .into_par_iter()
            .map(|stage| {
                let seed = key.item(stage.index() as u64).to_u64() as u32;
                baker.bake(|| bark::decayed(stage, seed))
            })
            .collect();
        Self {
            decayed: decayed.try_into().expect("three stages"),
            fungus: baker.bake(|| mineral::fungus(key.item(20).to_u64() as u32)),
        }
    }
}

impl DeadwoodMaterials {
    pub(super) fn register(
        library: &mut MaterialLibrary,
        species: &[Species],
        solids: &SolidTextures,
        textures: &DeadwoodTextures,
        ground: &GroundMaterials,
    ) -> Self {
        let [bare, soft, rotten] = &textures.decayed;
        let decayed_optics = [Optics::CUT_WOOD, Optics::BARK, Optics::MOSS];
        let mut log = |name: &str, albedo: &Arc<Texture>, roughness: f32, optics| {
            library.add(solid(
                name,
                Semantic::Log,
                albedo.clone(),
                roughness,
                optics,
            ))
        };
        let decayed = [
            log("log.bare", bare, 0.9, decayed_optics[0]),
            log("log.soft", soft, 0.95, decayed_optics[1]),
            log("log.rotten", rotten, 0.95, decayed_optics[2]),
        ];
        let weathered = log("log.weathered", &solids.dead, 0.9, Optics::CUT_WOOD);
        let fungus = log("log.fungus", &textures.fungus, 0.8, Optics::CUT_WOOD);
        let mut logs = Vec::new();
        for (species, barks) in species.iter().zip(&solids.barks) {
            let look = &species.bark;
            let of_bark = laser([look.nm905, 0.0], [look.nm1550, 0.0]);
            let name = |part: &str| format!("{}.log.{part}", species.name);
            let loosening = barks.loosening.as_ref().unwrap_or(&barks.lower);
            let roughness = look.roughness as f32;
            let fresh = log(&name("fresh"), &barks.lower, roughness, of_bark);
            let loosening = log(&name("loosening"), loosening, roughness, of_bark);
            let faces = std::array::from_fn(|age| {
                let name = name(&format!("face.{age}"));
                log(&name, &barks.faces[age], 0.8, Optics::CUT_WOOD)
            });
            let [bare, soft, rotten] = decayed;
            logs.push(LogMaterials {
                side: [fresh, loosening, bare, soft, rotten],
                faces,
                torn: [weathered, weathered, weathered, soft, rotten],
                stub: weathered,
                fungus,
            });
        }
        let albedo_of = |library: &MaterialLibrary, id| library.get(id).albedo.clone();
        let (floor, soil) = (
            albedo_of(library, ground.floor[2]),
            albedo_of(library, ground.cut_slope),
        );
        let mut add = |name: &str, semantic, albedo: Arc<Texture>, optics| {
            library.add(solid(name, semantic, albedo, 0.92, optics))
        };
        let plate = Semantic::RootPlate;
        let root_plate = RootPlateMaterials {
            floor: add("root_plate.floor", plate, floor, Optics::MOSS),
            soil: add("root_plate.soil", plate, soil, Optics::DRY_SOIL),
            root: add("root_plate.root", plate, solids.dead.clone(), Optics::BARK),
            stone: add(
                "root_plate.stone",
                plate,
                solids.stone.clone(),
                Optics::ROCK,
            ),
        };
        let branch = Semantic::FallenBranch;
        let branches = [
            add(
                "fallen.branch.0",
                branch,
                solids.shrub_wood.clone(),
                Optics::BARK,
            ),
            add("fallen.branch.1", branch, solids.dead.clone(), Optics::BARK),
        ];
        Self {
            logs,
            root_plate,
            branches,
        }
    }
}
