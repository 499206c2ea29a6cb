//! The densities and varieties of rocks and woody plants.

use std::sync::Arc;

use nemoral_assets::PlantKind;
use nemoral_placement::{
    DiskKind, LayerParams, OpenLand, ParamError, Patches, Placement, PlacementError,
    PlacementParams, RockParams, Rows, Site,
};
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, ObjectKind};
use nemoral_seed::{Domain, Key};
use nemoral_stand::StandLayer;

use super::assets::{StandingTree, WorldAssets};
use super::chunk_ground::ChunkGround;
use super::ground::GroundModel;
use super::meadows::at_edges;
use super::plot::PLOT_LAYER;
use crate::Error;
use crate::config::{self, Config};
use crate::plan::{Encode, Encoder};

/// The config key of the number of plants of a layer, below `placement`.
const fn layer_key(layer: StandLayer) -> &'static str {
    match layer {
        StandLayer::Trees => "trees",
        StandLayer::Stumps => "stumps",
        StandLayer::Shrubs => "shrubs",
        StandLayer::Saplings => "regeneration.saplings",
    }
}

/// Shrubs may overlap: their sites have a hard core, which is this share of their radius.
pub(crate) const SHRUB_CORE: f64 = 0.4;

const PLOT_SITES: Domain = Domain::new("pipeline.plot_sites");

/// The least distance of woody plants from a trail's edge, in addition to their radius, metres.
const VERGE_M: f64 = 0.25;

/// The least distance of woody plants from water, in addition to their radius, metres.
const BANK_M: f64 = 0.15;

/// Whether a disk keeps clear of trails and their ditches, of water, of thrown trees, and of the
/// trees of a stem map.
pub(crate) fn is_free(ground: &ChunkGround, world_m: DVec2, radius_m: f64) -> bool {
    let edge_m = ground.trail_edge_m(world_m);
    edge_m > radius_m + VERGE_M
        && (edge_m.is_infinite() || !ground.is_in_ditch(world_m, radius_m))
        && ground.is_clear_of_thrown(world_m, radius_m)
        && ground.is_clear_of_water(world_m, radius_m + BANK_M)
        && ground.is_clear_of_plot(world_m, radius_m)
        && !ground.is_rock_face(world_m)
}

/// The woody plants of a chunk that keep clear of the rocks around, and last its part of a stem
/// map.
pub(crate) fn woody_sites(
    at: ChunkCoord,
    world: Key,
    placement: &Placement,
    ground: &ChunkGround,
    rocks: &[Site],
) -> Vec<Site> {
    let allowed = |p: DVec2, r: f64| is_free(ground, p, r);
    let mut sites = placement.woody(at, &allowed, rocks);
    if let Some(plot) = ground.plot() {
        // In the area of the stem map it alone says where trees stand.
        let trees = StandLayer::Trees.index() as u8;
        sites.retain(|site| site.layer != trees || !plot.contains(site.position_m));
        sites.extend(measured_sites(at, ground, world));
    }
    sites
}

/// The trees of a chunk's part of a plot as sites, in the order of the stem map.
fn measured_sites(at: ChunkCoord, ground: &ChunkGround, world: Key) -> Vec<Site> {
    let Some(plot) = ground.plot() else {
        return Vec::new();
    };
    let site = |(i, &tree): (usize, &usize)| {
        let place = plot.place(tree);
        Site {
            position_m: place.position_m,
            radius_m: place.radius_m,
            layer: PLOT_LAYER,
            // A chunk has far fewer objects than that.
            variety: i as u16,
            key: world.domain(PLOT_SITES).item(tree as u64),
        }
    };
    plot.in_chunk(at).iter().enumerate().map(site).collect()
}

/// The placement of rocks and woody plants, as a config describes it.
#[derive(Clone, Debug)]
pub(crate) struct PlacementRecipe {
    placement: config::Placement,
    /// Weights of gorse, heather and bramble.
    shrubs: [f64; 3],
    chunk_size_m: f64,
}

/// The share of trails is measured around here: a world does not depend on where a robot starts.
const TRAILS_AROUND: ChunkCoord = ChunkCoord { x: 0, y: 0 };

impl PlacementRecipe {
    pub(crate) fn new(config: &Config) -> Self {
        Self {
            placement: config.placement.clone(),
            shrubs: {
                let a = &config.assets;
                [a.gorse, a.heather, a.bramble]
            },
            chunk_size_m: config.chunks.size_m,
        }
    }

    /// The placement of a world.
    pub(crate) fn make(
        &self,
        assets: &WorldAssets,
        ground: &GroundModel,
        world: Key,
    ) -> Result<Placement, Error> {
        let p = &self.placement;
        let plants = &assets.library.plants;
        let models = &assets.models;
        let tree = |t: &StandingTree| DiskKind {
            weight: t.weight,
            ..exactly(t.tree.radius_m)
        };
        let (grown, young) = assets.standing.split_at(assets.first_sapling);
        let mut trees: Vec<DiskKind> = grown.iter().map(tree).collect();
        models.widen(ObjectKind::Tree, &mut trees);
        let saplings: Vec<DiskKind> = young.iter().map(tree).collect();
        let exact = |kind: PlantKind| -> Vec<DiskKind> {
            let radii = plants[kind].iter().map(|plant| plant.radius_m);
            radii.map(exactly).collect()
        };
        let mut stumps = exact(PlantKind::Stump);
        let weights = stump_weights(stumps.len(), &assets.shares);
        for (stump, weight) in stumps.iter_mut().zip(weights) {
            stump.weight = weight;
        }
        let mut shrubs: Vec<DiskKind> = (plants[PlantKind::Shrub].iter())
            .map(|s| DiskKind {
                weight: match s.name.as_str() {
                    "gorse" => self.shrubs[0],
                    "heather" => self.shrubs[1],
                    _ => self.shrubs[2],
                },
                ..exactly(SHRUB_CORE * s.radius_m)
            })
            .collect();
        models.mix_in(ObjectKind::Shrub, &mut shrubs);
        let mut rocks = exact(PlantKind::Rock);
        models.mix_in(ObjectKind::Rock, &mut rocks);
        // Targets are means over the whole plane, of which trails take a share.
        let weight: f64 = trees.iter().map(|t| t.weight).sum();
        let mean_radius =
            trees.iter().map(|t| t.weight * t.radius_m.0).sum::<f64>() / weight.max(1e-9);
        let trail_share = ground.trail_share(TRAILS_AROUND, mean_radius + VERGE_M);
        let counts = [p.trees, p.stumps, p.shrubs, p.regeneration.saplings];
        let varieties = [trees, stumps, shrubs, saplings];
        let layers = StandLayer::ALL.into_iter().zip(counts).zip(varieties);
        let mut layers: Vec<LayerParams> = layers
            .map(|((layer, per_chunk), varieties)| {
                LayerParams::new(layer_key(layer), per_chunk, varieties)
            })
            .collect();
        let in_gaps = [0.0, 1.0, p.gaps.shrubs, p.gaps.saplings];
        for (layer, in_gaps) in layers.iter_mut().zip(in_gaps) {
            layer.in_gaps = in_gaps;
        }
        for (layer, of) in layers.iter_mut().zip(StandLayer::ALL) {
            layer.at_edges = at_edges(of, &p.meadows);
        }
        layers[StandLayer::Trees.index()].rows = (p.rows.spacing_m > 0.0).then_some(Rows {
            row_m: p.rows.spacing_m,
            in_row_m: p.rows.in_row_m,
            jitter_m: p.rows.jitter_m,
            heading_deg: p.rows.heading_deg,
        });
        layers[StandLayer::Saplings.index()].clusters = Some(Patches {
            share: p.regeneration.share,
            radius_m: (p.regeneration.radius_min_m, p.regeneration.radius_max_m),
        });
        let params = PlacementParams {
            chunk_size_m: self.chunk_size_m,
            rocks: RockParams {
                min_per_chunk: p.rocks_min,
                max_per_chunk: p.rocks_max,
                varieties: rocks,
            },
            layers,
            gaps: (p.gaps.share > 0.0).then_some(Patches {
                share: p.gaps.share.max(0.001),
                radius_m: (p.gaps.radius_min_m, p.gaps.radius_max_m),
            }),
            hard_core: p.hard_core,
            spacing_factor: p.spacing_factor,
            density_factor: p.density_factor,
            allowed_fraction: (1.0 - trail_share).max(0.05),
        };
        let placement = Placement::new(params, world).map_err(|e| match e {
            // Layers have the names of their config keys.
            PlacementError::TooDense {
                name,
                per_chunk,
                at_most,
                ..
            } => {
                let rows = name == layer_key(StandLayer::Trees) && p.rows.spacing_m > 0.0;
                let lower = if rows {
                    "its rows have no more places; lower it, placement.rows.spacing_m or \
                     placement.rows.in_row_m"
                } else {
                    "lower it, placement.spacing_factor, placement.hard_core or \
                     placement.density_factor"
                };
                Error::request(format!(
                    "placement.{name} = {per_chunk}: at most about {at_most:.1} per chunk find \
                     room; {lower}"
                ))
            }
            PlacementError::Param(e) if e.field.starts_with("layers[0].rows.") => {
                let field = e.field.replace("layers[0].rows.", "placement.rows.");
                Error::request(ParamError::new(field, e.value, e.allowed).to_string())
            }
            other => Error::of_stage(other),
        })?;
        Ok(match ground.meadows() {
            Some(meadows) => placement.with_open_land(Arc::clone(meadows) as Arc<dyn OpenLand>),
            None => placement,
        })
    }
}

/// How frequent each of `count` stumps is, of which there are equally many of each species, one
/// species after the other: as its species is among the trees that stand. They are equally frequent
/// if no species has a share.
fn stump_weights(count: usize, shares: &[(String, f64)]) -> Vec<f64> {
    let each = (count / shares.len().max(1)).max(1);
    let total: f64 = shares.iter().map(|(_, share)| share).sum();
    let weight = |i: usize| match shares.get(i / each) {
        Some((_, share)) if total > 0.0 => share / each as f64,
        _ => 1.0,
    };
    (0..count).map(weight).collect()
}

fn exactly(radius_m: f64) -> DiskKind {
    DiskKind {
        weight: 1.0,
        radius_m: (radius_m, radius_m),
    }
}

impl Encode for PlacementRecipe {
    fn encode(&self, encoder: &mut dyn Encoder) {
        let Self {
            placement,
            shrubs,
            chunk_size_m,
        } = self;
        let ChunkCoord { x, y } = TRAILS_AROUND;
        encoder.field("placement", placement);
        encoder.field("shrubs", shrubs);
        encoder.field("chunk_size_m", chunk_size_m);
        encoder.field("centre", &[x, y]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stumps_are_as_frequent_as_their_species() {
        let of = |shares: &[(&str, f64)]| -> Vec<(String, f64)> {
            let shares = shares.iter();
            shares.map(|(name, n)| ((*name).to_owned(), *n)).collect()
        };
        let beech = of(&[("english_oak", 0.04), ("beech", 0.96)]);
        let weights = stump_weights(10, &beech);
        let beeches: f64 = weights[5..].iter().sum();
        let all: f64 = weights.iter().sum();
        assert!(beeches / all > 0.9, "{weights:?}");
        // Without shares, none is left out.
        assert_eq!(stump_weights(4, &of(&[("a", 0.0), ("b", 0.0)])), [1.0; 4]);
        assert_eq!(stump_weights(3, &[]), [1.0; 3]);
    }
}
