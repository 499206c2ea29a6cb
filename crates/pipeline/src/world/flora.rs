//! Low plants and seedlings on their grids.

use nemoral_placement::{
    CoverKind, CoverPoint, GroundCover, GroundCoverParams, Placement, SiteFilter,
};
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, Surface};
use nemoral_seed::{Domain, Draw, Key};
use nemoral_stand::{
    CLUMP_FIELD, CommunityParams, FERN_FIELD, PATCH_JITTER, PATCH_SCALE, PatchKind, PatchSite,
    Seedlings, SkyViewFactor, StandLayer, Undergrowth, UndergrowthParams,
};

use super::closed_vegetation::ClosedVegetation;
use super::communities::community_params;
use super::litter::{GroundHeights, LitterLayer, LitterPatch, Stems};
use super::outcrops::bareness;
use super::patch::Patch;
use super::ways::skid_brash;

use super::chunk_ground::ChunkGround;
use super::ground::TerrainField;
use crate::Error;
use crate::config::{self, Config};
use crate::plan::{Encode, Encoder};

/// The chance that a cell at a place holds something.
type Chance<'a> = dyn Fn(DVec2) -> f64 + 'a;

const PATCHES: Domain = Domain::new("pipeline.undergrowth.patches");
const AMONG: Domain = Domain::new("pipeline.undergrowth.among");
const BRANCHES: Domain = Domain::new("pipeline.branches");
const BRASH: Domain = Domain::new("pipeline.brash");
const SCREE: Domain = Domain::new("pipeline.scree");
const SEEDLINGS: Domain = Domain::new("pipeline.seedlings");

/// Side of the cells that may hold a branch, or a mat of brash, metres.
const BRANCH_CELL_M: f64 = 1.5;
/// Side of the cells that may hold a bed of scree, metres.
const SCREE_CELL_M: f64 = 0.9;
/// How far the middle of a branch is from a trail's edge, metres: it reaches no farther.
const BRANCH_VERGE_M: f64 = 1.3;

/// How far the middle of a patch is from water, metres: it hangs over the bank.
const BANK_M: f64 = 0.45;

/// The share of patches that stay where other vegetation closes over them.
const PATCHES_AMONG: f64 = 0.12;

/// The undergrowth of a world: its grid, and the preferred places of its plants.
#[derive(Debug)]
pub struct Flora {
    grid: GroundCover,
    undergrowth: Undergrowth<TerrainField>,
    cell_m: f64,
    /// Branches beside trails: their grid, and the chance of a cell.
    branches: (GroundCover, f64),
    /// Brash on trails: its grid, and the chance of a cell, usually and on skid trails.
    brash: (GroundCover, [f64; 2]),
    /// Scree where rock crops out: its grid, and the chance of a cell.
    scree: (GroundCover, f64),
    /// What closes over the ground; `None` if nothing does.
    closed: Option<ClosedVegetation>,
    /// What the trees shed; `None` without litter in relief.
    litter: Option<LitterLayer>,
}

/// The undergrowth that a config wants.
#[derive(Clone, Debug)]
pub(crate) struct FloraRecipe {
    undergrowth: config::Undergrowth,
    communities: CommunityParams,
    litter: config::Litter,
    deadwood: config::Deadwood,
    skid_brash: f64,
    outcrops: f64,
    chunk_size_m: f64,
}

impl FloraRecipe {
    pub(crate) fn new(config: &Config) -> Self {
        Self {
            undergrowth: config.undergrowth.clone(),
            communities: community_params(&config.undergrowth, &config.water),
            litter: config.litter.clone(),
            deadwood: config.deadwood.clone(),
            skid_brash: skid_brash(&config.trails),
            outcrops: config.placement.outcrops,
            chunk_size_m: config.chunks.size_m,
        }
    }
}

impl Encode for FloraRecipe {
    fn encode(&self, encoder: &mut dyn Encoder) {
        let Self {
            undergrowth,
            communities,
            litter,
            deadwood,
            skid_brash,
            outcrops,
            chunk_size_m,
        } = self;
        encoder.field("undergrowth", undergrowth);
        // What follows from the water; the rest is among the keys of the undergrowth.
        encoder.field("has_reeds", &(communities.thickets[5] > 0.0));
        encoder.field("litter", litter);
        encoder.field("branches", &deadwood.branches);
        encoder.field("brash", &deadwood.brash);
        encoder.field("skid_brash", skid_brash);
        encoder.field("outcrops", outcrops);
        encoder.field("chunk_size_m", chunk_size_m);
    }
}

impl Flora {
    /// The undergrowth of a world.
    pub(crate) fn new(recipe: &FloraRecipe, world: Key) -> Result<Self, Error> {
        let FloraRecipe {
            undergrowth: p,
            communities,
            litter,
            deadwood,
            skid_brash,
            outcrops,
            chunk_size_m,
        } = recipe;
        let chunk_size_m = *chunk_size_m;
        let key = world.domain(PATCHES);
        let grid = GroundCoverParams {
            chunk_size_m,
            cell_m: p.cell_m,
            jitter: PATCH_JITTER,
            varieties: vec![CoverKind {
                weight: 1.0,
                radius_m: 0.0,
                scale: PATCH_SCALE,
            }],
        };
        let lying = |domain: Domain, cell_m: f64, radius_m: f64, scale: (f64, f64)| {
            let grid = GroundCoverParams {
                chunk_size_m,
                cell_m: cell_m.min(chunk_size_m),
                jitter: 1.0,
                varieties: vec![CoverKind {
                    weight: 1.0,
                    radius_m,
                    scale,
                }],
            };
            GroundCover::new(grid, world.domain(domain)).map_err(Error::of_stage)
        };
        let of_cell = BRANCH_CELL_M * BRANCH_CELL_M / 100.0;
        Ok(Self {
            branches: (
                lying(BRANCHES, BRANCH_CELL_M, BRANCH_VERGE_M, (0.8, 1.25))?,
                deadwood.branches * of_cell,
            ),
            brash: (
                lying(BRASH, BRANCH_CELL_M, BRANCH_VERGE_M, (0.85, 1.15))?,
                [deadwood.brash, skid_brash.max(deadwood.brash)],
            ),
            scree: (
                lying(SCREE, SCREE_CELL_M, SCREE_CELL_M, (0.6, 1.3))?,
                *outcrops,
            ),
            closed: ClosedVegetation::new(communities, chunk_size_m, world)?,
            litter: LitterLayer::new(litter, &p.floor, chunk_size_m, world)?,
            grid: GroundCover::new(grid, key).map_err(Error::of_stage)?,
            undergrowth: Undergrowth {
                params: UndergrowthParams {
                    cover: p.cover,
                    litter: p.litter,
                    grass: p.grass,
                    herbs: p.herbs,
                    ferns: p.ferns,
                },
                clumps: TerrainField::new(CLUMP_FIELD, key.item(1))?,
                ferns: TerrainField::new(FERN_FIELD, key.item(2))?,
            },
            cell_m: p.cell_m,
        })
    }

    /// The patches of a chunk.
    pub(crate) fn patches(
        &self,
        at: ChunkCoord,
        ground: &ChunkGround,
        sky: &SkyViewFactor,
    ) -> Vec<Patch> {
        let radius_m = self.cell_m * 0.5;
        let off_trail = |p: DVec2, _: f64| {
            ground.trail_edge_m(p) > radius_m
                && ground.is_clear_of_water(p, BANK_M)
                && !ground.is_rock_face(p)
        };
        let site = |p: DVec2| {
            let conditions = ground.conditions(p);
            PatchSite {
                sky_view: sky.at(p.extend(ground.height_m(p) + 0.3)),
                wetness: conditions.wetness,
                soil_m: conditions.soil_m,
                litter: ground.litterfall(p),
            }
        };
        let chance = |p: DVec2| self.undergrowth.chance(p, &site(p));
        let points = self.grid.points(at, &off_trail, &chance).into_iter();
        let is_crowded_out = |point: &CoverPoint| {
            let closed = self.closed.as_ref();
            closed.is_some_and(|c| c.hides(point.position_m, ground, sky))
                && !point.key.domain(AMONG).rng().chance(PATCHES_AMONG)
        };
        let patches = points.filter(|point| !is_crowded_out(point)).map(|point| {
            let (p, site) = (point.position_m, site(point.position_m));
            let chance = self.undergrowth.chance(p, &site);
            let kind = self.undergrowth.kind(p, chance, &site, point.key);
            let variant = 0.5;
            Patch {
                kind,
                point,
                variant,
            }
        });
        // Where litter lies in relief, twigs and leaves are part of it.
        let is_left = |patch: &Patch| self.litter.is_none() || patch.kind != PatchKind::Litter;
        let mut patches: Vec<Patch> = patches.filter(is_left).collect();
        if let Some(closed) = &self.closed {
            closed.lay(at, ground, sky, &mut patches);
        }
        let mut lay = |grid: &GroundCover, kind, allowed: &dyn SiteFilter, chance: &Chance| {
            let points = grid.points(at, allowed, chance).into_iter();
            patches.extend(points.map(|point| Patch {
                kind,
                point,
                variant: 0.5,
            }));
        };
        let beside = |p: DVec2, verge_m: f64| {
            ground.trail_edge_m(p) > verge_m
                && ground.is_clear_of_thrown(p, 0.3)
                && ground.is_clear_of_water(p, verge_m)
                && !ground.is_rock_face(p)
        };
        let on_trail = |p: DVec2, _: f64| ground.trail_edge_m(p) < -0.2 && !ground.is_puddle(p);
        let (branches, chance) = &self.branches;
        if *chance > 0.0 {
            lay(branches, PatchKind::Branch, &beside, &|p| {
                *chance * ground.litterfall(p)
            });
        }
        let (scree, share) = &self.scree;
        if *share > 0.0 {
            lay(scree, PatchKind::Scree, &beside, &|p| {
                0.7 * *share * bareness(ground, p)
            });
        }
        let (brash, [usual, of_skid_trails]) = &self.brash;
        if *of_skid_trails > 0.0 {
            lay(brash, PatchKind::Brash, &on_trail, &|p| {
                if of_skid_trails > usual && ground.is_skid_trail(p) {
                    *of_skid_trails
                } else {
                    *usual
                }
            });
        }
        patches
    }

    /// Whether there is litter in relief.
    pub(crate) fn has_litter(&self) -> bool {
        self.litter.is_some()
    }

    /// The litter of a chunk; none where grass or a thicket hides the ground.
    pub(crate) fn litter(
        &self,
        at: ChunkCoord,
        (ground, mesh): (&ChunkGround, &GroundHeights<'_>),
        sky: &SkyViewFactor,
        stems: &Stems,
    ) -> Vec<LitterPatch> {
        let Some(litter) = &self.litter else {
            return Vec::new();
        };
        let is_hidden = |p: DVec2| {
            let closed = self.closed.as_ref();
            closed.is_some_and(|c| c.hides(p, ground, sky))
        };
        litter.lay(at, (ground, mesh), sky, stems, &is_hidden)
    }
}

/// The seedlings of a chunk, `per_m2` of them in clusters in full light.
pub(crate) fn seedlings(
    at: ChunkCoord,
    world: Key,
    (per_m2, chunk_size_m): (f64, f64),
    placement: &Placement,
    ground: &ChunkGround,
    sky: &SkyViewFactor,
) -> Result<Vec<CoverPoint>, Error> {
    let seedlings = Seedlings { per_m2 };
    let grid = GroundCoverParams {
        chunk_size_m,
        cell_m: Seedlings::CELL_M,
        jitter: Seedlings::JITTER,
        varieties: vec![CoverKind {
            weight: 1.0,
            radius_m: Seedlings::VERGE_M,
            scale: Seedlings::SCALE,
        }],
    };
    let grid = GroundCover::new(grid, world.domain(SEEDLINGS)).map_err(Error::of_stage)?;
    let clusters = placement.clusters(at, StandLayer::Saplings.index());
    let chance = |p: DVec2| {
        let in_cluster = clusters.as_ref().is_some_and(|c| c.contain(p));
        let sky_view = sky.at(p.extend(ground.height_m(p) + 0.3));
        let let_grow = (1.0 - ground.meadow(ground.open_m(p))) * ground.history(p).young_trees();
        seedlings.chance(in_cluster, sky_view) * let_grow
    };
    let off_trail = |p: DVec2, verge_m: f64| {
        ground.trail_edge_m(p) > verge_m
            && ground.is_clear_of_water(p, verge_m)
            && !ground.is_rock_face(p)
    };
    Ok(grid.points(at, &off_trail, &chance))
}
