//! The ground and the surfaces of trails.

use std::cell::LazyCell;
use std::sync::Arc;

use nemoral_scene::{
    Material, MaterialId, MaterialLibrary, Optics, Semantic, Texture, TrailSurfaceKind,
};
use nemoral_seed::Key;
use rayon::prelude::*;

use super::TextureBaker;
use super::solid::solid;
use crate::textures::fallen::FallenFoliage;
use crate::textures::ground;
use crate::textures::tile::Tile;
use crate::textures::trail::{self, TRAIL_M};

/// The materials of the ground and of trails; all of them `ground`, uv in metres.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct GroundMaterials {
    /// The forest floor: leaf litter, needle litter, moss and soil.
    pub floor: Vec<MaterialId>,
    /// Slopes that a trail has cut or filled.
    pub cut_slope: MaterialId,
    /// Bare soil, as in the pits of thrown trees.
    pub bare_soil: MaterialId,
    /// The faces of cliffs; `None` if they were not asked for.
    pub rock_face: Option<MaterialId>,
    /// Trails, by [`TrailSurfaceKind::index`]; see [`trail`](Self::trail).
    pub trails: [TrailMaterials; TrailSurfaceKind::ALL.len()],
}

impl GroundMaterials {
    /// The materials of a kind of trail.
    #[must_use]
    pub fn trail(&self, kind: TrailSurfaceKind) -> &TrailMaterials {
        &self.trails[kind.index()]
    }

    /// All of them.
    pub(crate) fn all(&self) -> impl Iterator<Item = MaterialId> {
        let Self {
            floor,
            cut_slope,
            bare_soil,
            rock_face,
            trails,
        } = self;
        let off_trails = floor.iter().chain([cut_slope, bare_soil]).chain(rock_face);
        let trails = trails.iter().flat_map(|t| [t.surface, t.rut, t.strip]);
        off_trails.copied().chain(trails)
    }
}

/// The three bands of a trail's section.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct TrailMaterials {
    /// Most of it.
    pub surface: MaterialId,
    /// Where wheels run.
    pub rut: MaterialId,
    /// Between the ruts.
    pub strip: MaterialId,
}

/// Surface, rut and strip of each kind of trail. Those that are not wanted, which nothing shows,
/// share the textures of one that is.
pub(super) fn bake_trails(
    baker: &TextureBaker,
    wanted: &[TrailSurfaceKind],
    fallen: &FallenFoliage,
    key: Key,
) -> Vec<[Arc<Texture>; 3]> {
    let bake = |kind: TrailSurfaceKind| {
        let tiles = LazyCell::new(|| trail::bake(kind, fallen, key.item(kind.index() as u64)));
        [
            baker.bake(|| tiles.surface.clone()),
            baker.bake(|| tiles.rut.clone()),
            baker.bake(|| tiles.strip.clone()),
        ]
    };
    let first = wanted.first().copied().unwrap_or(TrailSurfaceKind::ALL[0]);
    let is_baked = |kind: TrailSurfaceKind| kind == first || wanted.contains(&kind);
    let baked: Vec<_> = (TrailSurfaceKind::ALL.into_par_iter())
        .map(|kind| is_baked(kind).then(|| bake(kind)))
        .collect();
    let of_first = baked[first.index()].clone();
    let all = (baked.into_iter()).map(|textures| textures.or_else(|| of_first.clone()));
    all.map(|textures| textures.expect("the first is baked"))
        .collect()
}

/// Leaf litter, needle litter, moss and soil, bare soil.
pub(super) fn bake_floors(
    baker: &TextureBaker,
    fallen: &FallenFoliage,
    key: Key,
) -> Vec<Arc<Texture>> {
    let recipes: [fn(&FallenFoliage, Key) -> Tile; 4] = [
        ground::leaf_litter,
        ground::needle_litter,
        ground::moss_and_soil,
        ground::bare_soil,
    ];
    recipes
        .par_iter()
        .enumerate()
        .map(|(i, recipe)| baker.bake(|| recipe(fallen, key.item(i as u64))))
        .collect()
}

pub(super) fn register_ground(
    library: &mut MaterialLibrary,
    floors: Vec<Arc<Texture>>,
    trails: Vec<[Arc<Texture>; 3]>,
) -> GroundMaterials {
    let mut add = |name: String, semantic, albedo, roughness, tile_m, optics| {
        library.add(Material {
            ground: true,
            tile_m,
            ..solid(&name, semantic, albedo, roughness, optics)
        })
    };
    let looks = [
        ("ground.leaf_litter", Semantic::Litter, Optics::LITTER),
        ("ground.needle_litter", Semantic::Litter, Optics::LITTER),
        ("ground.moss", Semantic::GroundMoss, Optics::MOSS),
        ("ground.cut_slope", Semantic::CutSlope, Optics::DRY_SOIL),
    ];
    let mut floor: Vec<MaterialId> = floors
        .into_iter()
        .zip(looks)
        .map(|(texture, (name, semantic, optics))| {
            add(
                name.to_owned(),
                semantic,
                texture,
                0.92,
                ground::FLOOR_M,
                optics,
            )
        })
        .collect();
    let cut_slope = floor.pop().expect("there are four floors");
    let trails: Vec<TrailMaterials> = TrailSurfaceKind::ALL
        .into_iter()
        .zip(trails)
        .map(|(kind, [surface, rut, strip])| {
            let (roughness, optics) = trail::surface_optics(kind);
            let mut band = |band: &str, semantic, albedo, optics| {
                let name = format!("trail.{}.{band}", kind.name());
                add(name, semantic, albedo, roughness, TRAIL_M, optics)
            };
            TrailMaterials {
                surface: band("surface", Semantic::TrailSurface, surface, optics),
                rut: band("rut", Semantic::TrailRut, rut, optics),
                strip: band("strip", Semantic::TrailStrip, strip, optics),
            }
        })
        .collect();
    let soil = library.get(cut_slope).clone();
    let bare_soil = library.add(Material {
        name: "ground.soil".to_owned(),
        semantic: Semantic::Soil,
        ..soil
    });
    GroundMaterials {
        rock_face: None,
        floor,
        cut_slope,
        bare_soil,
        trails: trails.try_into().expect("one entry for each kind"),
    }
}
