//! The sites that get an id, from all that was placed.

use nemoral_assets::PlantKind;
use nemoral_placement::Site;
use nemoral_scene::{ChunkCoord, ObjectKind};
use nemoral_seed::{Draw, Key};
use nemoral_stand::{FallenStem, OBJECT_VARIATION, ObjectSite, ObjectSize, StandLayer};
use nemoral_trails::{DressingKind, TrailDressing};

use super::assets::WorldAssets;
use super::chunk_ground::ChunkGround;
use super::deadwood::lying_sites;
use super::edge_trees::light_from;
use super::ground::GroundModel;
use super::meadows::Meadows;
use super::placement::SHRUB_CORE;
use super::plot::PLOT_LAYER;
use super::stream_stones::boulders;

/// The objects of a chunk in the order of their numbers: rocks, woody plants, stones on trails,
/// boulders in streams, then logs, thrown stems and root plates.
pub(crate) fn object_sites(
    at: ChunkCoord,
    world: Key,
    (rocks, woody, logs): (&[Site], &[Site], &[FallenStem]),
    ground: &ChunkGround,
    assets: &WorldAssets,
    model: &GroundModel,
) -> Vec<ObjectSite> {
    let rocks = rocks
        .iter()
        .map(|site| grown(ObjectKind::Rock, site, assets));
    let plot = ground.plot().map_or(&[][..], |plot| plot.in_chunk(at));
    let woody = woody.iter().map(|site| {
        let plant = woody_plant(site, assets, plot);
        match model.meadows() {
            Some(meadows) => at_edge(plant, meadows, assets),
            None => plant,
        }
    });
    let mut sites: Vec<ObjectSite> = rocks.chain(woody).collect();
    let dressing = model.trails().map(|t| t.dressing(at)).unwrap_or_default();
    let stones = (dressing.iter()).filter(|d| d.kind == DressingKind::Stone);
    for (i, stone) in stones.enumerate() {
        let key = world.domain(OBJECT_VARIATION).chunk(at).item(i as u64);
        sites.push(trail_stone(stone, key, assets));
    }
    sites.extend(boulders(at, world, ground, assets));
    sites.extend(lying_sites(logs, &model.thrown(at), assets, ground));
    sites
}

/// An object of a placed site: what is grown is nearly as large as its asset.
fn grown(kind: ObjectKind, site: &Site, assets: &WorldAssets) -> ObjectSite {
    let asset = usize::from(site.variety);
    ObjectSite {
        kind,
        position_m: site.position_m,
        radius_m: site.radius_m,
        asset,
        size: assets.models.size(kind, asset),
        key: site.key,
        on_trail: false,
        facing_rad: None,
        lying: None,
    }
}

/// What grew up at the edge of a meadow is another tree there.
fn at_edge(plant: ObjectSite, meadows: &Meadows, assets: &WorldAssets) -> ObjectSite {
    let is_grown = plant.kind == ObjectKind::Tree && plant.size == ObjectSize::Grown;
    let asset = assets.at_edge(plant.asset).filter(|_| is_grown);
    let light = || light_from(plant.position_m, plant.key, meadows);
    match asset.and_then(|asset| Some((asset, light()?))) {
        Some((asset, light)) => ObjectSite {
            asset,
            facing_rad: Some(light),
            ..plant
        },
        None => plant,
    }
}

/// `plot` are the trees of the stem map in this chunk.
fn woody_plant(site: &Site, assets: &WorldAssets, plot: &[usize]) -> ObjectSite {
    if site.layer == PLOT_LAYER {
        let tree = &assets.measured[plot[usize::from(site.variety)]];
        return ObjectSite {
            asset: tree.asset,
            size: ObjectSize::Measured(tree.size),
            radius_m: tree.radius_m,
            ..grown(ObjectKind::Tree, site, assets)
        };
    }
    match StandLayer::ALL[usize::from(site.layer)] {
        StandLayer::Trees => grown(ObjectKind::Tree, site, assets),
        StandLayer::Stumps => grown(ObjectKind::Stump, site, assets),
        // A site has the core alone, which others keep clear of.
        StandLayer::Shrubs => ObjectSite {
            radius_m: site.radius_m / SHRUB_CORE,
            ..grown(ObjectKind::Shrub, site, assets)
        },
        StandLayer::Saplings => ObjectSite {
            asset: assets.first_sapling + usize::from(site.variety),
            size: ObjectSize::Sapling,
            ..grown(ObjectKind::Tree, site, assets)
        },
    }
}

fn trail_stone(stone: &TrailDressing, key: Key, assets: &WorldAssets) -> ObjectSite {
    let stones = &assets.library.plants[PlantKind::TrailStone];
    let asset = key.rng().below(stones.len() as u32) as usize;
    ObjectSite {
        kind: ObjectKind::Rock,
        position_m: stone.position_m,
        radius_m: stones[asset].radius_m * stone.scale,
        asset,
        size: ObjectSize::Given(stone.scale),
        key,
        on_trail: true,
        facing_rad: None,
        lying: None,
    }
}
