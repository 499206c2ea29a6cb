//! Where rocks and woody plants stand.

use std::sync::Arc;

use nemoral_placement::{
    LayerParams, ParamError, Patches, Placement, PlacementParams, RockParams, Rows, Site, Variety,
};
use nemoral_scene::ChunkCoord;
use nemoral_scene::glam::DVec2;
use nemoral_seed::Key;

use super::assets::{Standing, WorldAssets};
use super::ground::{ChunkGround, GroundModel};
use crate::config::{self, Config};
use crate::plan::{AnyChunk, Demand, Encode, Encoder, Forest, Hasher, Node, OfWorld, Stage};
use crate::{Error, InputFiles};

/// The woody layers of a stand, in the order in which they are placed: the paper's, then saplings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StandLayer {
    /// Living and dead standing trees.
    Trees,
    /// Stumps.
    Stumps,
    /// Shrubs.
    Shrubs,
    /// Saplings of the trees' species.
    Saplings,
}

impl StandLayer {
    /// All layers, by [`index`](Self::index).
    pub const ALL: [Self; 4] = [Self::Trees, Self::Stumps, Self::Shrubs, Self::Saplings];

    /// The place of the layer in [`PlacementParams::layers`].
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }

    /// The layer of a site that [`PlacementStage`]'s placement made.
    #[must_use]
    pub fn of(site: &Site) -> Self {
        Self::ALL[usize::from(site.layer)]
    }

    /// The config key of its number of plants, below `placement`.
    #[must_use]
    pub const fn key(self) -> &'static str {
        match self {
            Self::Trees => "trees",
            Self::Stumps => "stumps",
            Self::Shrubs => "shrubs",
            Self::Saplings => "regeneration.saplings",
        }
    }
}

/// Shrubs grow into each other: they keep apart by this share of their spread.
const SHRUB_CORE: f64 = 0.4;

/// Nothing woody stands nearer to a trail's edge than its radius and this.
const VERGE_M: f64 = 0.25;

/// Makes the world's [`Placement`].
#[derive(Clone, Debug)]
pub struct PlacementStage {
    placement: config::Placement,
    /// Of gorse, heather and bramble.
    shrubs: [f64; 3],
    chunk_size_m: f64,
    centre: ChunkCoord,
}

impl PlacementStage {
    /// The stage of a config.
    #[must_use]
    pub fn new(config: &Config) -> Self {
        let start = DVec2::new(config.robot.start_x_m, config.robot.start_y_m);
        Self {
            placement: config.placement.clone(),
            shrubs: {
                let a = &config.assets;
                [a.gorse, a.heather, a.bramble]
            },
            chunk_size_m: config.chunks.size_m,
            centre: ChunkCoord::containing(start, config.chunks.size_m),
        }
    }
}

fn exactly(radius_m: f64) -> Variety {
    Variety {
        weight: 1.0,
        radius_m: (radius_m, radius_m),
    }
}

impl Encode for PlacementStage {
    fn encode(&self, encoder: &mut dyn Encoder) {
        let Self {
            placement,
            shrubs,
            chunk_size_m,
            centre,
        } = self;
        let ChunkCoord { x, y } = centre;
        encoder.field("placement", placement);
        encoder.field("shrubs", shrubs);
        encoder.field("chunk_size_m", chunk_size_m);
        encoder.field("centre", &[*x, *y]);
    }
}

impl Stage<Forest> for PlacementStage {
    type At = ();
    type Inputs = (OfWorld<WorldAssets>, OfWorld<GroundModel>);
    type Output = Placement;
    const ID: &'static str = "world.placement";
    const VERSION: u32 = 2;

    fn fingerprint(&self, hasher: &mut Hasher) {
        InputFiles::default().encode(hasher, self);
    }

    fn run(
        &self,
        (): (),
        world: Key,
        (assets, ground): (Arc<WorldAssets>, Arc<GroundModel>),
    ) -> Result<Placement, Error> {
        let p = &self.placement;
        let library = &assets.library;
        let tree = |t: &Standing| Variety {
            weight: t.weight,
            ..exactly(t.tree.radius_m)
        };
        let (grown, young) = assets.standing.split_at(assets.first_sapling);
        let trees: Vec<Variety> = grown.iter().map(tree).collect();
        let saplings: Vec<Variety> = young.iter().map(tree).collect();
        let stumps: Vec<Variety> = library.stumps.iter().map(|s| exactly(s.radius_m)).collect();
        let shrubs: Vec<Variety> = library
            .shrubs
            .iter()
            .map(|s| Variety {
                weight: match s.name.as_str() {
                    "gorse" => self.shrubs[0],
                    "heather" => self.shrubs[1],
                    _ => self.shrubs[2],
                },
                ..exactly(SHRUB_CORE * s.radius_m)
            })
            .collect();
        let rocks = library.rocks.iter().map(|r| exactly(r.radius_m)).collect();
        // Targets are means over the whole plane; trails take their share of it.
        let weight: f64 = trees.iter().map(|t| t.weight).sum();
        let mean_radius =
            trees.iter().map(|t| t.weight * t.radius_m.0).sum::<f64>() / weight.max(1e-9);
        let trail_share = ground.trail_share(self.centre, mean_radius + VERGE_M);
        let counts = [p.trees, p.stumps, p.shrubs, p.regeneration.saplings];
        let varieties = [trees, stumps, shrubs, saplings];
        let layers = StandLayer::ALL.into_iter().zip(counts).zip(varieties);
        let mut layers: Vec<LayerParams> = layers
            .map(|((layer, per_chunk), varieties)| {
                LayerParams::new(layer.key(), per_chunk, varieties)
            })
            .collect();
        let in_gaps = [0.0, 1.0, p.gaps.shrubs, p.gaps.saplings];
        for (layer, in_gaps) in layers.iter_mut().zip(in_gaps) {
            layer.in_gaps = in_gaps;
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
        Placement::new(params, world).map_err(|e| match e {
            // Layers have the names of their config keys.
            ParamError::TooDense {
                name,
                per_chunk,
                at_most,
                ..
            } => {
                let rows = name == StandLayer::Trees.key() && p.rows.spacing_m > 0.0;
                let lower = if rows {
                    "its rows have no more places; lower it, placement.rows.spacing_m or placement.rows.in_row_m"
                } else {
                    "lower it, placement.spacing_factor, placement.hard_core or placement.density_factor"
                };
                Error::request(format!(
                    "placement.{name} = {per_chunk}: at most about {at_most:.1} per chunk find room; {lower}"
                ))
            }
            ParamError::OutOfRange {
                field,
                value,
                allowed,
            } if field.starts_with("layers[0].rows.") => Error::request(format!(
                "{} = {value}: must be {allowed}",
                field.replace("layers[0].rows.", "placement.rows.")
            )),
            other => Error::of_stage(other),
        })
    }
}

/// The rocks of a chunk of phase `N`: it sees those of lower phases next to it.
#[derive(Clone, Copy, Debug)]
pub struct RockPhaseStage<const N: usize>;

impl<const N: usize> Stage<Forest> for RockPhaseStage<N> {
    type At = ChunkCoord;
    type Inputs = (
        OfWorld<Placement>,
        Node<ChunkCoord, ChunkGround>,
        [AnyChunk<Vec<Site>>; N],
    );
    type Output = Vec<Site>;
    const ID: &'static str = "chunk.rocks.phase";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        hasher.write_u64(N as u64);
    }

    fn run(
        &self,
        at: ChunkCoord,
        _: Key,
        (placement, ground, lower): (Arc<Placement>, Arc<ChunkGround>, [Demand<'_, Vec<Site>>; N]),
    ) -> Result<Vec<Site>, Error> {
        let neighbours = Placement::lower_phase_neighbours(at)
            .into_iter()
            .map(|c| lower[usize::from(Placement::phase(c))].at(c))
            .collect::<Result<Vec<_>, _>>()?;
        let slices: Vec<&[Site]> = neighbours.iter().map(|n| n.as_slice()).collect();
        let allowed = |p: DVec2, r: f64| ground.trail_edge_m(p) > r + VERGE_M;
        Ok(placement.rocks(at, &allowed, &slices))
    }
}

/// The rocks of any chunk.
#[derive(Clone, Copy, Debug)]
pub struct RockStage;

impl Stage<Forest> for RockStage {
    type At = ChunkCoord;
    type Inputs = ([AnyChunk<Vec<Site>>; 4],);
    type Output = Vec<Site>;
    const ID: &'static str = "chunk.rocks";
    const VERSION: u32 = 1;

    fn fingerprint(&self, _: &mut Hasher) {}

    fn run(
        &self,
        at: ChunkCoord,
        _: Key,
        (phases,): ([Demand<'_, Vec<Site>>; 4],),
    ) -> Result<Vec<Site>, Error> {
        Ok(phases[usize::from(Placement::phase(at))].at(at)?.to_vec())
    }
}

/// The trees, stumps and shrubs of a chunk.
#[derive(Clone, Copy, Debug)]
pub struct WoodyStage;

impl Stage<Forest> for WoodyStage {
    type At = ChunkCoord;
    type Inputs = (
        OfWorld<Placement>,
        Node<ChunkCoord, ChunkGround>,
        AnyChunk<Vec<Site>>,
    );
    type Output = Vec<Site>;
    const ID: &'static str = "chunk.woody";
    const VERSION: u32 = 1;

    fn fingerprint(&self, _: &mut Hasher) {}

    fn run(
        &self,
        at: ChunkCoord,
        _: Key,
        (placement, ground, rocks): (Arc<Placement>, Arc<ChunkGround>, Demand<'_, Vec<Site>>),
    ) -> Result<Vec<Site>, Error> {
        let mut around = Vec::new();
        for (dx, dy) in (-1..=1).flat_map(|x| (-1..=1).map(move |y| (x, y))) {
            around.extend_from_slice(&rocks.at(at.offset(dx, dy))?);
        }
        let allowed = |p: DVec2, r: f64| ground.trail_edge_m(p) > r + VERGE_M;
        Ok(placement.woody(at, &allowed, &around))
    }
}
