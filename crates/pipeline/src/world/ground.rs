//! The ground: terrain with trails carved into it, which is one surface with one owner.

use std::sync::Arc;

use nemoral_placement::OpenLand;
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, Surface};
use nemoral_seed::{Domain, Key};
use nemoral_stand::{
    FallenStem, FieldParams, Hemisphere, ScalarField, VegetationHistory, fallen_stems, settle,
};
use nemoral_terrain::{
    ErodedSurface, ErosionParams, HeightField, HeightPosts, NoiseTerrain, PerlinTerrain,
    ReliefParams, TerrainParams,
};
use nemoral_trails::Trails;
use nemoral_water::{ChunkWater, Water, WaterParams};
use rayon::prelude::*;

use super::chunk_ground::ChunkGround;
use super::conditions::{ConditionEffects, Conditions};
use super::meadows::Meadows;
use super::plot::Plot;
use super::puddles::{PUDDLE_REACH_M, Puddles};
use super::terrain_with_trails::TerrainWithTrails;
use super::windthrow::{LOG_REACH_M, WindthrownTree};
use crate::Error;
use crate::config::{self, TerrainNoise};
use crate::pool::in_pool;

/// How far outside of its chunk a ground is valid, metres, because robots, light and placement look
/// over the border.
const MARGIN_M: f64 = 12.0;

/// How far thrown trees and their pits keep from trails, metres.
const THROWN_VERGE_M: f64 = 0.8;

/// How far they keep from water, metres.
const THROWN_BANK_M: f64 = 1.2;

const THROWN: Domain = Domain::new("pipeline.thrown");
const HISTORY: Domain = Domain::new("pipeline.history");

/// The endless ground of a world.
pub struct GroundModel {
    base: Arc<dyn Surface>,
    trails: Option<Arc<Trails>>,
    chunk_size_m: f64,
    water: Option<Water>,
    puddles: Option<Puddles>,
    thrown: Thrown,
    meadows: Option<Arc<Meadows>>,
    history: Option<Arc<VegetationHistory<TerrainField>>>,
    effects: ConditionEffects,
    has_cliffs: bool,
    plot: Option<Arc<Plot>>,
}

/// The tables of a config that the ground follows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GroundTables<'a> {
    pub(crate) terrain: &'a config::Terrain,
    pub(crate) trails: &'a config::Trails,
    pub(crate) water: &'a config::Water,
    pub(crate) deadwood: &'a config::Deadwood,
    pub(crate) meadows: &'a config::Meadows,
    pub(crate) effects: &'a config::GroundEffects,
    pub(crate) hemisphere: Hemisphere,
    pub(crate) dbh_mean_m: f64,
}

/// What is known of the ground of a site.
#[derive(Debug, Default)]
pub(crate) struct SiteGround {
    /// The trees of a stem map.
    pub(crate) plot: Option<Plot>,
    /// Measured heights, and the distance within which they pass into the terrain around, metres.
    pub(crate) posts: Option<(HeightPosts, f64)>,
    /// The middles of trails.
    pub(crate) lines_m: Vec<Vec<DVec2>>,
}

/// The trees that storms threw.
#[derive(Clone, Debug)]
struct Thrown {
    key: Key,
    /// Mean number in a chunk.
    mean: f64,
    dbh_mean_m: f64,
    across_trails: bool,
}

impl std::fmt::Debug for GroundModel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "GroundModel(trails: {})", self.trails.is_some())
    }
}

impl GroundModel {
    /// The ground of a config's terrain, with a site's heights over it that pass into it within a
    /// distance, and with its trails, waters and the pits of thrown trees carved into it.
    pub(crate) fn new(
        tables: GroundTables<'_>,
        site: SiteGround,
        chunk_size_m: f64,
        world: Key,
    ) -> Result<Self, Error> {
        let GroundTables {
            terrain,
            trails,
            water,
            deadwood,
            meadows,
            effects,
            hemisphere,
            dbh_mean_m,
        } = tables;
        let SiteGround {
            plot,
            posts,
            lines_m,
        } = site;
        // The water of a measured site is where it was measured.
        let is_measured = plot.is_some() || posts.is_some();
        let base = terrain_of(terrain, world)?;
        let base: Arc<dyn Surface> = match posts {
            None => base,
            Some((posts, blend_m)) => {
                Arc::new(HeightField::new(&posts, blend_m, base).map_err(Error::of_stage)?)
            }
        };
        let trails = if trails.enabled || !lines_m.is_empty() {
            let mut params = trails.params();
            if !trails.enabled {
                // Those along the lines are all that there are.
                params.spawn_probability = 0.0;
                for (number, (_, share)) in params.ways.iter_mut().enumerate() {
                    *share = f64::from(u8::from(number == config::Trails::TRACK));
                }
            }
            let trails = Trails::new(params, chunk_size_m, world, Arc::clone(&base));
            let trails = trails.and_then(|trails| trails.along(&lines_m, config::Trails::TRACK));
            Some(Arc::new(trails.map_err(Error::of_stage)?))
        } else {
            None
        };
        let params = WaterParams {
            springs_per_km2: water.springs_per_km2,
            stream_width_m: water.stream_width_m,
            ponds: water.ponds,
            pond_radius_m: water.pond_radius_m,
        };
        let water_of_beds = if water.has_beds() && !is_measured {
            let ways = TerrainWithTrails::new(Arc::clone(&base), trails.clone(), chunk_size_m);
            let found = Water::new(
                params,
                chunk_size_m,
                world,
                Arc::clone(&base),
                Arc::new(ways),
            );
            Some(found.map_err(Error::of_stage)?)
        } else {
            None
        };
        let puddles = (water.puddles > 0.0).then_some(Puddles {
            share: water.puddles,
            world,
        });
        let plot = plot.map(Arc::new);
        let meadows = Meadows::new(meadows, plot.clone(), world)?.map(Arc::new);
        let shows = [effects.browsing, effects.succession];
        let history = if shows.iter().any(|effect| *effect > 0.0) {
            let key = world.domain(HISTORY);
            let field = |i, params| TerrainField::new(params, key.item(i));
            Some(Arc::new(VegetationHistory::new(shows, field)?))
        } else {
            None
        };
        let effects = ConditionEffects {
            of: effects.clone(),
            hemisphere,
        };
        Ok(Self {
            base,
            trails,
            chunk_size_m,
            water: water_of_beds,
            puddles,
            plot,
            meadows,
            history,
            effects,
            has_cliffs: terrain.has_cliffs(),
            thrown: Thrown {
                key: world.domain(THROWN),
                mean: deadwood.thrown_per_ha * chunk_size_m * chunk_size_m / 10_000.0,
                dbh_mean_m,
                across_trails: deadwood.across_trails,
            },
        })
    }

    /// The trails, if there are any.
    #[must_use]
    pub fn trails(&self) -> Option<&Arc<Trails>> {
        self.trails.as_ref()
    }

    /// What the user should know about the stem map, if there is one.
    pub(crate) fn note_of_plot(&self) -> Option<String> {
        self.plot.as_ref()?.note().map(str::to_owned)
    }

    /// How many trees of the stem map stand on trails.
    pub(crate) fn measured_trees_on_trails(&self) -> usize {
        let (Some(plot), Some(trails)) = (&self.plot, &self.trails) else {
            return 0;
        };
        let in_chunk = |chunk| {
            let edges = trails.edges_near(chunk, 1.0);
            let on_trail = |&&tree: &&usize| {
                let place = plot.place(tree);
                edges.edge_m(place.position_m) < place.radius_m
            };
            plot.in_chunk(chunk).iter().filter(on_trail).count()
        };
        plot.chunks().map(in_chunk).sum()
    }

    /// The ground in and around a chunk.
    #[must_use]
    pub fn near(&self, chunk: ChunkCoord) -> ChunkGround {
        let trails = self.trails.as_ref();
        let reach_m = self.puddles.map_or(0.0, |_| PUDDLE_REACH_M);
        let carved = trails.map(|t| t.ground_near(chunk, MARGIN_M + reach_m));
        let origin = chunk.origin_m(self.chunk_size_m);
        let square = (origin, origin + self.chunk_size_m);
        ChunkGround {
            base: Arc::clone(&self.base),
            water: self.water_near(chunk),
            puddles: match (&self.puddles, &carved) {
                (Some(puddles), Some(trails)) => {
                    let wetness = |p| Conditions::puddles(&self.effects, &self.base, p);
                    puddles.near(square, MARGIN_M, trails, &wetness)
                }
                _ => Vec::new(),
            },
            conditions: Conditions::new(&self.effects, square),
            meadows: self.meadows.clone(),
            history: self.history.clone(),
            has_cliffs: self.has_cliffs,
            carved,
            thrown: self.thrown_around(chunk, MARGIN_M),
            square,
            plot: self.plot.clone(),
        }
    }

    /// Height of the ground before ways, water and thrown trees change it by some decimetres,
    /// metres.
    pub(crate) fn natural_height_m(&self, world_m: DVec2) -> f64 {
        self.base.height_m(world_m)
    }

    /// The streams and ponds near a chunk; `None` where none is near.
    fn water_near(&self, chunk: ChunkCoord) -> Option<Arc<ChunkWater>> {
        let near = self.water.as_ref()?.near(chunk, MARGIN_M);
        (!near.is_empty()).then_some(near)
    }

    /// Whether the surfaces of a chunk's waters may reach into a rectangle.
    pub(crate) fn waters_reach(&self, chunk: ChunkCoord, (low_m, high_m): (DVec2, DVec2)) -> bool {
        let origin_m = chunk.origin_m(self.chunk_size_m);
        let (first_m, last_m) = (origin_m - PUDDLE_REACH_M, origin_m + self.chunk_size_m);
        let is_beside = first_m.cmple(high_m).all() && (last_m + PUDDLE_REACH_M).cmpge(low_m).all();
        let of_water = |near: Arc<ChunkWater>| near.surface_reaches(low_m, high_m);
        (self.puddles.is_some() && is_beside) || self.water_near(chunk).is_some_and(of_water)
    }

    /// Where woods end at open land, if there is any.
    pub(crate) fn meadows(&self) -> Option<&Arc<Meadows>> {
        self.meadows.as_ref()
    }

    /// Whether there may be streams or ponds in this world.
    pub(crate) fn has_beds(&self) -> bool {
        self.water.is_some()
    }

    /// Whether there may be water on it: streams, ponds or puddles.
    pub(crate) fn has_water(&self) -> bool {
        self.water.is_some() || self.puddles.is_some()
    }

    /// The thrown trees whose stems' middles are in a chunk.
    pub(crate) fn thrown(&self, chunk: ChunkCoord) -> Vec<WindthrownTree> {
        if self.thrown.mean <= 0.0 {
            return Vec::new();
        }
        let own = self.thrown_here(chunk);
        if own.is_empty() {
            return Vec::new();
        }
        let around = (-1..=1).flat_map(|x| (-1..=1).map(move |y| (x, y)));
        let around: Vec<Vec<FallenStem>> = around
            .filter(|&at| at != (0, 0))
            .map(|(x, y)| self.thrown_here(chunk.offset(x, y)))
            .collect();
        let around: Vec<&[FallenStem]> = around.iter().map(Vec::as_slice).collect();
        let stems = settle(&own, &around).into_iter();
        stems.map(|stem| WindthrownTree { stem }).collect()
    }

    /// The thrown trees of which any part may be nearer to a chunk than `margin_m`.
    pub(crate) fn thrown_around(&self, chunk: ChunkCoord, margin_m: f64) -> Vec<WindthrownTree> {
        if self.thrown.mean <= 0.0 {
            return Vec::new();
        }
        let rings = ((margin_m + LOG_REACH_M + 4.0) / self.chunk_size_m).ceil() as i32;
        let around = (-rings..=rings).flat_map(|x| (-rings..=rings).map(move |y| (x, y)));
        around
            .flat_map(|(x, y)| self.thrown(chunk.offset(x, y)))
            .collect()
    }

    /// The thrown trees of a chunk, before those of its neighbours are looked at.
    fn thrown_here(&self, chunk: ChunkCoord) -> Vec<FallenStem> {
        let kinds = [WindthrownTree::kind(self.thrown.dbh_mean_m)];
        let edges = std::cell::OnceCell::new();
        let edges = || {
            edges.get_or_init(|| {
                let trails = self.trails.as_ref();
                trails.map(|t| t.edges_near(chunk, MARGIN_M))
            })
        };
        let edge_m = |p: DVec2| edges().as_ref().map_or(f64::INFINITY, |e| e.edge_m(p));
        let water = std::cell::OnceCell::new();
        let water_m = |p: DVec2| {
            let near = water.get_or_init(|| self.water_near(chunk));
            near.as_ref().map_or(f64::INFINITY, |w| w.edge_m(p))
        };
        let is_free = |stem: &FallenStem| {
            let tree = WindthrownTree { stem: *stem };
            let of_plot = self
                .plot
                .as_ref()
                .map_or(f64::INFINITY, |p| p.distance_m(stem.middle_m));
            let in_wood = (self.meadows.as_ref())
                .is_none_or(|m| tree.is_beside(|p| -m.depth_m(p), false, 0.0));
            in_wood
                && of_plot > LOG_REACH_M
                && tree.is_beside(water_m, false, THROWN_BANK_M)
                && tree.is_beside(edge_m, self.thrown.across_trails, THROWN_VERGE_M)
        };
        let Thrown { key, mean, .. } = self.thrown;
        fallen_stems(chunk, self.chunk_size_m, key, mean, &kinds, is_free)
    }

    /// The share of the world that lies on a trail or nearer than `clearance_m` to one, measured at
    /// stratified points of 256 chunks around `centre`.
    #[must_use]
    pub fn trail_share(&self, centre: ChunkCoord, clearance_m: f64) -> f64 {
        let Some(trails) = &self.trails else {
            return 0.0;
        };
        let near = |i: i32| {
            // Every fifth chunk of a square is sampled, as trails reach over 40 chunks and
            // neighbours add little information.
            let chunk = centre.offset(5 * (i % 16 - 8), 5 * (i / 16 - 8));
            if !trails.is_crossed(chunk) {
                return 0;
            }
            let origin = chunk.origin_m(self.chunk_size_m);
            let edges = trails.edges_near(chunk, 1.0);
            let is_near = |j: &i32| {
                let cell = DVec2::new(f64::from(j % 8) + 0.5, f64::from(j / 8) + 0.5) / 8.0;
                edges.edge_m(origin + cell * self.chunk_size_m) < clearance_m
            };
            (0..64).filter(is_near).count()
        };
        let near: usize = in_pool(|| (0..256).into_par_iter().map(near).sum());
        near as f64 / f64::from(256 * 64)
    }
}

/// The terrain of a config, before anything is carved into it.
fn terrain_of(of: &config::Terrain, world: Key) -> Result<Arc<dyn Surface>, Error> {
    let params = TerrainParams {
        octaves: of.octaves,
        scale_m: of.scale_m,
        lacunarity: of.lacunarity,
        persistence: of.persistence,
        max_height_m: of.max_height_m,
    };
    let relief = ReliefParams {
        ridges: of.ridges,
        warp: of.warp,
        terraces: of.terraces,
        cliffs: of.cliffs,
        terrace_step_m: of.terrace_step_m,
    };
    let base: Arc<dyn Surface> = match of.noise {
        TerrainNoise::Nemoral => {
            Arc::new(NoiseTerrain::shaped(params, relief, world).map_err(Error::of_stage)?)
        }
        TerrainNoise::PerlinSurflet => {
            Arc::new(PerlinTerrain::new(params, world).map_err(Error::of_stage)?)
        }
    };
    if of.gully_depth_m <= 0.0 {
        return Ok(base);
    }
    let erosion = ErosionParams {
        spacing_m: of.gully_spacing_m,
        depth_m: of.gully_depth_m,
        generations: of.gully_generations,
    };
    Ok(Arc::new(
        ErodedSurface::new(erosion, world, base).map_err(Error::of_stage)?,
    ))
}

/// The terrain's noise as a field of the plane.
#[derive(Clone, Debug)]
pub(crate) struct TerrainField(NoiseTerrain);

impl TerrainField {
    pub(crate) fn new(params: FieldParams, key: Key) -> Result<Self, Error> {
        let FieldParams {
            octaves,
            scale_m,
            lacunarity,
            persistence,
        } = params;
        let params = TerrainParams {
            octaves,
            scale_m,
            lacunarity,
            persistence,
            max_height_m: 1.0,
        };
        NoiseTerrain::new(params, key)
            .map(Self)
            .map_err(Error::of_stage)
    }
}

impl ScalarField for TerrainField {
    fn value(&self, world_m: DVec2) -> f64 {
        self.0.height_m(world_m)
    }
}
