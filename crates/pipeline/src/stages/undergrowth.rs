//! Where low plants grow.

use std::sync::Arc;

use nemoral_placement::{CoverPoint, CoverVariety, GroundCover, GroundCoverParams};
use nemoral_scene::ChunkCoord;
use nemoral_scene::Surface;
use nemoral_scene::glam::DVec2;
use nemoral_seed::{Domain, Draw, Key};
use nemoral_terrain::{Terrain, TerrainParams};

use super::ground::ChunkGround;
use super::openness::Openness;
use crate::config::{self, Config};
use crate::plan::{Encode, Encoder, Forest, Hasher, Node, OfWorld, Stage};
use crate::{Error, InputFiles};

const KIND: Domain = Domain::new("pipeline.undergrowth.kind");
const PATCHES: Domain = Domain::new("pipeline.undergrowth.patches");

/// What grows in a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PatchKind {
    /// Grass.
    Grass,
    /// Herbs.
    Herbs,
    /// Ferns.
    Ferns,
    /// Fallen twigs and cones.
    Litter,
}

/// A patch of low plants.
#[derive(Clone, Debug)]
pub struct Patch {
    /// What it is.
    pub kind: PatchKind,
    /// Where it is, which of its kind, how turned and how large.
    pub point: CoverPoint,
}

/// The undergrowth of a world: the grid, and where which plants like to grow.
#[derive(Debug)]
pub struct Flora {
    cover: GroundCover,
    /// Smooth fields, 0..1: where plants cluster, where ferns do.
    clumps: Terrain,
    ferns: Terrain,
    params: config::Undergrowth,
}

/// Makes the [`Flora`].
#[derive(Clone, Debug)]
pub struct FloraStage {
    params: config::Undergrowth,
    chunk_size_m: f64,
}

impl FloraStage {
    /// The stage of a config.
    #[must_use]
    pub fn new(config: &Config) -> Self {
        Self {
            params: config.undergrowth.clone(),
            chunk_size_m: config.chunks.size_m,
        }
    }
}

impl Encode for FloraStage {
    fn encode(&self, encoder: &mut dyn Encoder) {
        let Self {
            params,
            chunk_size_m,
        } = self;
        encoder.field("undergrowth", params);
        encoder.field("chunk_size_m", chunk_size_m);
    }
}

impl Stage<Forest> for FloraStage {
    type At = ();
    type Inputs = ();
    type Output = Flora;
    const ID: &'static str = "world.flora";
    const VERSION: u32 = 1;

    fn fingerprint(&self, hasher: &mut Hasher) {
        InputFiles::default().encode(hasher, self);
    }

    fn run(&self, (): (), world: Key, (): ()) -> Result<Flora, Error> {
        let key = world.domain(PATCHES);
        let field = |scale_m: f64, number: u64| {
            let params = TerrainParams {
                octaves: 3,
                scale_m,
                lacunarity: 2.0,
                persistence: 0.5,
                max_height_m: 1.0,
            };
            Terrain::new(params, key.item(number)).map_err(Error::of_stage)
        };
        let cover = GroundCoverParams {
            chunk_size_m: self.chunk_size_m,
            cell_m: self.params.cell_m,
            jitter: 0.6,
            varieties: vec![CoverVariety {
                weight: 1.0,
                radius_m: 0.0,
                scale: (0.75, 1.25),
            }],
        };
        Ok(Flora {
            cover: GroundCover::new(cover, key).map_err(Error::of_stage)?,
            clumps: field(9.0, 1)?,
            ferns: field(24.0, 2)?,
            params: self.params.clone(),
        })
    }
}

/// Sows the undergrowth of a chunk.
#[derive(Clone, Copy, Debug)]
pub struct UndergrowthStage;

impl Stage<Forest> for UndergrowthStage {
    type At = ChunkCoord;
    type Inputs = (
        OfWorld<Flora>,
        Node<ChunkCoord, ChunkGround>,
        Node<ChunkCoord, Openness>,
    );
    type Output = Vec<Patch>;
    const ID: &'static str = "chunk.undergrowth";
    const VERSION: u32 = 1;

    fn fingerprint(&self, _: &mut Hasher) {}

    fn run(
        &self,
        at: ChunkCoord,
        _: Key,
        (flora, ground, openness): (Arc<Flora>, Arc<ChunkGround>, Arc<Openness>),
    ) -> Result<Vec<Patch>, Error> {
        let radius_m = flora.params.cell_m * 0.5;
        let off_trail = |p: DVec2, _: f64| ground.trail_edge_m(p) > radius_m;
        // Contrast: a field of octaves keeps to its middle; patches have an edge.
        let contrast =
            |field: &Terrain, p: DVec2| ((field.height_m(p) - 0.5) * 3.5 + 0.5).clamp(0.0, 1.0);
        let density = |p: DVec2| {
            // Light: little grows in deep shade (vegetation.md 2.5).
            let light = f64::from(openness.at(p.extend(ground.height_m(p) + 0.3)));
            let light = (light / 0.3).clamp(0.2, 1.0);
            let plants = flora.params.cover * light * (0.4 + 0.6 * contrast(&flora.clumps, p));
            (plants + flora.params.litter).min(1.0)
        };
        let points = flora.cover.points(at, &off_trail, &density);
        let patches = points.into_iter().map(|point| {
            let mut rng = point.key.domain(KIND).rng();
            let fern = contrast(&flora.ferns, point.position_m);
            let all = density(point.position_m);
            let params = &flora.params;
            let weights = [params.grass, params.herbs, params.ferns * fern];
            let kind = if rng.chance(flora.params.litter / all.max(1e-9)) {
                PatchKind::Litter
            } else {
                match rng.weighted(&weights) {
                    Some(0) => PatchKind::Grass,
                    Some(1) => PatchKind::Herbs,
                    Some(_) => PatchKind::Ferns,
                    // Ferns alone, where ferns do not like to grow.
                    None => PatchKind::Litter,
                }
            };
            Patch { kind, point }
        });
        Ok(patches.collect())
    }
}
