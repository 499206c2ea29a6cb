//! The ground in and around a chunk: its height, and what is at a place of it.

use std::sync::Arc;

use nemoral_placement::OpenLand;
use nemoral_scene::glam::DVec2;
use nemoral_scene::{MaterialId, Mesh, Surface, SurfaceSample};
use nemoral_stand::{GroundConditions, SiteHistory, VegetationHistory};
use nemoral_terrain::ZoneSample;
use nemoral_trails::{TrailGround, TrailPlace, TrailSurfaceKind, TrailZone};
use nemoral_water::{ChunkWater, Puddle, WaterKind, puddle_surfaces};

use super::conditions::Conditions;
use super::ground::TerrainField;
use super::meadows::Meadows;
use super::plot::Plot;
use super::windthrow::WindthrownTree;
use crate::config;

/// How far from the edge of a wood twigs and branches still fall, metres.
const CROWN_M: f64 = 6.0;

/// Where a stream is this near to a trail's edge, it is in a culvert, metres.
const CULVERT_M: f64 = 0.8;

/// The slope from which on the ground of a world with cliffs is bare rock, and how much gentler
/// ground is meshed as finely.
const FACE_SLOPE: f64 = 1.05;
const FACE_MARGIN: f64 = 0.4;

/// By how much wetter than in the open the ground of a wood is where it is bare mud, and how much
/// less ragged its border is: litter lies on all but the middle of a hollow.
const LITTER_OVER_MUD: f64 = 0.2;
const SMOOTHER: f64 = 0.8;

/// The ground in and around a chunk.
pub struct ChunkGround {
    pub(super) base: Arc<dyn Surface>,
    pub(super) carved: Option<TrailGround>,
    pub(super) water: Option<Arc<ChunkWater>>,
    pub(super) puddles: Vec<Puddle>,
    pub(super) thrown: Vec<WindthrownTree>,
    pub(super) plot: Option<Arc<Plot>>,
    pub(super) conditions: Conditions,
    pub(super) meadows: Option<Arc<Meadows>>,
    pub(super) history: Option<Arc<VegetationHistory<TerrainField>>>,
    pub(super) square: (DVec2, DVec2),
    pub(super) has_cliffs: bool,
}

impl std::fmt::Debug for ChunkGround {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "ChunkGround(carved: {})", self.carved.is_some())
    }
}

impl ChunkGround {
    /// Signed distance to the nearest trail edge, metres: negative on a trail, infinite far from
    /// any.
    #[must_use]
    pub fn trail_edge_m(&self, world_m: DVec2) -> f64 {
        self.carved
            .as_ref()
            .map_or(f64::INFINITY, |g| g.edge_m(world_m))
    }

    /// [`trail_edge_m`](Self::trail_edge_m) and its gradient.
    pub(crate) fn trail_edge(&self, world_m: DVec2) -> (f64, DVec2) {
        let carved = self.carved.as_ref();
        carved.map_or((f64::INFINITY, DVec2::ZERO), |g| g.edge(world_m))
    }

    /// The part of a trail that a piece of the ground's mesh lies on, by its middle and its side of
    /// the break-lines.
    #[must_use]
    pub fn trail_zone(&self, world_m: DVec2, inside: bool) -> TrailZone {
        let place = self.trail_place(world_m);
        place.map_or(TrailZone::Off, |trails| trails.zone_on_side(inside))
    }

    /// What trails make of a place; `None` if there are none near the chunk.
    pub(crate) fn trail_place(&self, world_m: DVec2) -> Option<TrailPlace<'_>> {
        self.carved.as_ref().map(|ground| ground.place(world_m))
    }

    /// Height and gradient at a place of which trails make this.
    pub(crate) fn sample_at(
        &self,
        world_m: DVec2,
        trails: Option<&TrailPlace<'_>>,
    ) -> SurfaceSample {
        let mut sample = match trails {
            Some(trails) => trails.sample(),
            None => self.base.sample(world_m),
        };
        if let Some(water) = &self.water
            && water.concerns(world_m)
        {
            sample = match trails {
                Some(trails) => water.carve_beside(world_m, sample, trails.edge()),
                None => water.carve(world_m, sample),
            };
        }
        for tree in &self.thrown {
            tree.dig(world_m, &mut sample);
        }
        for puddle in &self.puddles {
            puddle.carve(world_m, &mut sample);
        }
        sample
    }

    /// The break-lines near a place of which trails make this.
    pub(crate) fn zones_at(&self, world_m: DVec2, trails: Option<&TrailPlace<'_>>) -> ZoneSample {
        let edge_m = trails.map_or(f64::INFINITY, TrailPlace::border_m);
        // The slopes that a trail cuts and fills are meshed as finely as its surface.
        let near_trail = self.carved.as_ref().is_some_and(|g| edge_m < g.fine_m());
        // So are pits.
        let in_pit = self.thrown.iter().any(|t| t.pit_border_m(world_m) < 0.2);
        // And the beds and banks of waters.
        let in_bed = self.water.as_ref().is_some_and(|w| w.is_steep(world_m))
            || self.puddle_edge_m(world_m) < 0.3;
        let near_face = self.has_cliffs
            && self.base.sample(world_m).gradient.length() > FACE_SLOPE - FACE_MARGIN;
        let detail_m = if near_trail || in_pit || in_bed || near_face {
            0.0
        } else {
            f64::INFINITY
        };
        ZoneSample { edge_m, detail_m }
    }

    /// Whether a disk on the map keeps clear of thrown trees, their root plates and pits.
    pub(crate) fn is_clear_of_thrown(&self, world_m: DVec2, radius_m: f64) -> bool {
        (self.thrown.iter()).all(|tree| tree.is_clear_of(world_m, radius_m))
    }

    /// Signed distance from the edge of the nearest stream or pond, metres, nearly: negative in its
    /// water, infinite farther than 5 m, and where streams are in culverts.
    #[must_use]
    pub fn bank_m(&self, world_m: DVec2) -> f64 {
        match &self.water {
            Some(water) => {
                let edge_m = water.edge_m(world_m);
                let in_culvert = edge_m < f64::INFINITY && self.trail_edge_m(world_m) < CULVERT_M;
                if in_culvert { f64::INFINITY } else { edge_m }
            }
            None => f64::INFINITY,
        }
    }

    /// Whether a place is in the hollow of a puddle.
    pub(crate) fn is_puddle(&self, world_m: DVec2) -> bool {
        self.puddles.iter().any(|p| p.edge_m(world_m) < 0.0)
    }

    /// Signed distance from the border of the nearest puddle's hollow, metres.
    #[must_use]
    pub fn puddle_edge_m(&self, world_m: DVec2) -> f64 {
        let near = (self.puddles.iter())
            .filter(|p| p.middle_m().distance_squared(world_m) < 4.0 * p.reach_m() * p.reach_m());
        near.map(|p| p.edge_m(world_m))
            .fold(f64::INFINITY, f64::min)
    }

    /// Whether a disk on the map keeps clear of streams and ponds.
    pub(crate) fn is_clear_of_water(&self, world_m: DVec2, radius_m: f64) -> bool {
        self.water.is_none() || self.bank_m(world_m) > radius_m
    }

    /// The puddles in the chunk and near it.
    pub fn puddles(&self) -> impl Iterator<Item = &Puddle> {
        self.puddles.iter()
    }

    /// The streams and ponds near the chunk; `None` if there are none.
    #[must_use]
    pub fn water(&self) -> Option<&ChunkWater> {
        self.water.as_deref()
    }

    /// Whether a place is in the chunk.
    #[must_use]
    pub fn owns(&self, world_m: DVec2) -> bool {
        let (low_m, high_m) = self.square;
        world_m.cmpge(low_m).all() && world_m.cmplt(high_m).all()
    }

    /// The surfaces of the chunk's waters.
    pub(crate) fn water_mesh(&self, material: &dyn Fn(WaterKind) -> MaterialId) -> Mesh {
        let water = self.water.as_ref();
        let mut mesh = water.map_or_else(Mesh::default, |water| water.surface_mesh(self, material));
        puddle_surfaces(&self.puddles, self.square, self, material, &mut mesh);
        mesh
    }

    /// How wet, sunny and deep the ground of a place is, as far as that matters in this world.
    #[must_use]
    pub fn conditions(&self, world_m: DVec2) -> GroundConditions {
        self.conditions
            .at(&self.base, world_m, self.bank_m(world_m))
    }

    /// Whether the ground is the bare face of a cliff, on which nothing stands.
    #[must_use]
    pub fn is_rock_face(&self, world_m: DVec2) -> bool {
        self.has_cliffs && self.base.sample(world_m).gradient.length() > FACE_SLOPE
    }

    /// What happened to the vegetation of a place, as far as that matters in this world.
    #[must_use]
    pub fn history(&self, world_m: DVec2) -> SiteHistory {
        (self.history.as_ref()).map_or(SiteHistory::NEUTRAL, |h| h.at(world_m))
    }

    /// Whether the ground of a place that is this wet is bare mud, as [`Conditions::is_mud`] says:
    /// what falls from trees covers it, but along water, which washes it away.
    pub(crate) fn is_mud(&self, world_m: DVec2, wetness: f64, wave: impl Fn() -> f64) -> bool {
        self.conditions.is_mud(wetness, &wave) && {
            let lies = (0.5 * self.bank_m(world_m) - 0.25).clamp(0.0, 1.0);
            let covered = self.litterfall(world_m) * lies;
            let wave = || wave() * (1.0 - SMOOTHER * covered);
            self.conditions
                .is_mud(wetness - LITTER_OVER_MUD * covered, wave)
        }
    }

    /// How far a place is within a meadow or clearing, metres: negative in the wood, and minus
    /// infinity without any.
    #[must_use]
    pub fn open_m(&self, world_m: DVec2) -> f64 {
        (self.meadows.as_ref()).map_or(f64::NEG_INFINITY, |m| m.depth_m(world_m))
    }

    /// How much falls from trees at a place, 0..=1: nothing far out in a meadow.
    pub(crate) fn litterfall(&self, world_m: DVec2) -> f64 {
        (1.0 - self.open_m(world_m) / CROWN_M).clamp(0.0, 1.0)
    }

    /// How much of a place so far within a meadow is kept as grass, 0..=1.
    pub(crate) fn meadow(&self, open_m: f64) -> f64 {
        self.meadows.as_ref().map_or(0.0, |m| m.kept(open_m))
    }

    /// How near a place so far within a meadow is to the edge of the wood, 0..=1.
    pub(crate) fn fringe(&self, open_m: f64) -> f64 {
        self.meadows.as_ref().map_or(0.0, |m| m.fringe(open_m))
    }

    /// The trees of the stem map, if there is one.
    pub(crate) fn plot(&self) -> Option<&Plot> {
        self.plot.as_deref()
    }

    /// Whether a disk on the map keeps clear of the trees of the stem map.
    pub(crate) fn is_clear_of_plot(&self, world_m: DVec2, radius_m: f64) -> bool {
        (self.plot.as_ref()).is_none_or(|plot| plot.is_clear(world_m, radius_m))
    }

    /// Whether a disk on the map reaches into a ditch along a trail.
    pub(crate) fn is_in_ditch(&self, world_m: DVec2, radius_m: f64) -> bool {
        (self.carved.as_ref()).is_some_and(|g| g.is_in_ditch(world_m, radius_m))
    }

    /// Whether a place is in the bare soil of a thrown tree's pit.
    pub(crate) fn is_pit(&self, world_m: DVec2) -> bool {
        self.thrown.iter().any(|tree| tree.is_pit(world_m))
    }

    /// Whether a place is on a skid trail.
    pub(crate) fn is_skid_trail(&self, world_m: DVec2) -> bool {
        let way = self.carved.as_ref().and_then(|g| g.way_number(world_m));
        way == Some(config::Trails::SKID_TRAIL)
    }

    /// The surface of the trail at a world position.
    #[must_use]
    pub fn trail_kind(&self, world_m: DVec2) -> Option<TrailSurfaceKind> {
        self.carved.as_ref().and_then(|g| g.kind(world_m))
    }
}

impl Surface for ChunkGround {
    fn sample(&self, world_m: DVec2) -> SurfaceSample {
        self.sample_at(world_m, self.trail_place(world_m).as_ref())
    }
}
