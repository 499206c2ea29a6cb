//! Swards and thickets, tile by tile.

use std::f64::consts::TAU;

use nemoral_placement::{CoverKind, CoverPoint, GroundCover, GroundCoverParams};
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, PlantCommunity, Surface, TrailSurfaceKind};
use nemoral_seed::{Domain, Draw, Key};
use nemoral_stand::{
    Communities, CommunityCover, CommunityParams, CommunitySite, PatchKind, SkyViewFactor,
};

use super::chunk_ground::ChunkGround;
use super::ground::TerrainField;
use super::patch::Patch;
use crate::Error;

const COMMUNITIES: Domain = Domain::new("pipeline.communities");
const TILES: Domain = Domain::new("pipeline.communities.tiles");
const BORDERS: Domain = Domain::new("pipeline.communities.borders");
const STANDS: Domain = Domain::new("pipeline.communities.stands");
const TRODDEN: Domain = Domain::new("pipeline.communities.trodden");

/// Sides of the cells of wide and narrow tiles, metres. Tiles of the neighbours overlap by half.
const CELLS_M: [f64; 2] = [1.25, 0.55];
/// The greatest distance of a tile from its cell's middle, in cells.
const JITTER: f64 = 0.3;
/// How far the middle of a wide tile of grass is from a trail's edge at least, metres. Nearer,
/// there are narrow ones up to `NARROW_M`.
const WIDE_M: f64 = 0.95;
const NARROW_M: f64 = 0.28;
/// How far thickets keep from a trail's edge, metres: brambles arch over it.
const THICKET_M: f64 = 0.85;
const BRAMBLE_M: f64 = 1.15;
/// How far the middles of tiles of grass and of thickets are from water, metres.
const GRASS_BANK_M: f64 = 0.5;
const BANK_M: f64 = 0.7;
/// Reeds at the edge of a tile stand in the water.
const REEDS_BANK_M: f64 = 0.15;
/// The distance at which the ground around tells whether a place is in a hollow, metres.
const HOLLOW_M: f64 = 7.0;
/// How much of moisture is that of the ground farther away.
const WIDER: f64 = 0.3;
/// A grassy trail is bare below the first sky view factor, and green from verge to verge above the
/// second.
const TRAIL_LIGHT: [f64; 2] = [0.10, 0.26];

/// The swards and thickets of a world.
#[derive(Debug)]
pub(crate) struct ClosedVegetation {
    communities: Communities<TerrainField>,
    has_sward: bool,
    wide: GroundCover,
    narrow: GroundCover,
}

impl ClosedVegetation {
    /// The closed vegetation of a world; `None` if there is none.
    pub(crate) fn new(
        params: &CommunityParams,
        chunk_size_m: f64,
        world: Key,
    ) -> Result<Option<Self>, Error> {
        let key = world.domain(COMMUNITIES);
        let field = |i, params| TerrainField::new(params, key.item(i));
        let communities = Communities::new(params, field)?;
        if communities.is_empty() {
            return Ok(None);
        }
        let grid = |domain, cell_m| {
            let params = GroundCoverParams {
                chunk_size_m,
                cell_m,
                jitter: JITTER,
                varieties: vec![CoverKind {
                    weight: 1.0,
                    radius_m: 0.0,
                    scale: (0.9, 1.12),
                }],
            };
            GroundCover::new(params, world.domain(domain)).map_err(Error::of_stage)
        };
        Ok(Some(Self {
            communities,
            has_sward: params.sward > 0.0,
            wide: grid(TILES, CELLS_M[0])?,
            narrow: grid(BORDERS, CELLS_M[1])?,
        }))
    }

    /// What closes over the ground at a place off trails, if it has room there.
    fn at(
        &self,
        world_m: DVec2,
        ground: &ChunkGround,
        sky: &SkyViewFactor,
    ) -> Option<CommunityCover> {
        let edge_m = ground.trail_edge_m(world_m);
        let cover = self.communities.at(world_m, &site(world_m, ground, sky));
        cover.filter(|cover| {
            let bank_m = match cover.community {
                PlantCommunity::Reeds => REEDS_BANK_M,
                community if community.is_grass() => GRASS_BANK_M,
                _ => BANK_M,
            };
            let room_m = match cover.community {
                PlantCommunity::Bramble => BRAMBLE_M,
                community if community.is_grass() => NARROW_M,
                _ => THICKET_M,
            };
            edge_m > room_m
                && ground.is_clear_of_water(world_m, bank_m)
                && !ground.is_rock_face(world_m)
        })
    }

    /// Whether it hides the ground at a place.
    pub(crate) fn hides(&self, world_m: DVec2, ground: &ChunkGround, sky: &SkyViewFactor) -> bool {
        let cover = self.at(world_m, ground, sky);
        cover.is_some_and(|cover| cover.density > 0.5)
    }

    /// Lays the tiles of a chunk.
    pub(crate) fn lay(
        &self,
        at: ChunkCoord,
        ground: &ChunkGround,
        sky: &SkyViewFactor,
        patches: &mut Vec<Patch>,
    ) {
        let off_trail = |p: DVec2, _: f64| ground.trail_edge_m(p) > THICKET_M && !ground.is_pit(p);
        for point in self.wide.points(at, &off_trail, &|_| 1.0) {
            let Some(cover) = self.at(point.position_m, ground, sky) else {
                continue;
            };
            let edge_m = ground.trail_edge_m(point.position_m);
            let has_room = !cover.community.is_grass() || edge_m > WIDE_M;
            if has_room && point.key.domain(STANDS).rng().chance(cover.density) {
                patches.push(self.tile(point, cover, PatchKind::Closed));
            }
        }
        if !self.has_sward {
            return;
        }
        let beside = |p: DVec2, _: f64| ground.trail_edge_m(p) <= WIDE_M && !ground.is_pit(p);
        for point in self.narrow.points(at, &beside, &|_| 1.0) {
            let p = point.position_m;
            let cover = if ground.trail_edge_m(p) > NARROW_M {
                let cover = self.at(p, ground, sky);
                cover.filter(|cover| cover.community.is_grass())
            } else {
                self.on_trail(&point, ground, sky)
            };
            if let Some(cover) = cover {
                patches.push(self.tile(point, cover, PatchKind::ClosedBorder));
            }
        }
    }

    /// Short grass on a trail whose surface is grassy, from verge to verge.
    fn on_trail(
        &self,
        point: &CoverPoint,
        ground: &ChunkGround,
        sky: &SkyViewFactor,
    ) -> Option<CommunityCover> {
        let p = point.position_m;
        if ground.trail_kind(p) != Some(TrailSurfaceKind::Grassy) {
            return None;
        }
        let chance = trodden_chance(site(p, ground, sky).sky_view);
        let mut rng = point.key.domain(TRODDEN).rng();
        rng.chance(chance).then(|| CommunityCover {
            community: PlantCommunity::GrazedGrass,
            vigour: rng.range_f64(0.6, 1.0),
            density: 1.0,
        })
    }

    fn tile(
        &self,
        mut point: CoverPoint,
        cover: CommunityCover,
        kind: fn(PlantCommunity) -> PatchKind,
    ) -> Patch {
        let variant = self.communities.variant(point.position_m);
        let size = if cover.community.is_grass() {
            // Lower grass must still close.
            0.55 + 0.45 * cover.vigour
        } else {
            cover.vigour
        };
        point.scale *= size;
        if cover.community == PlantCommunity::LodgedGrass {
            // Wind lays all of a place in one direction.
            point.yaw_rad = (TAU * variant + 0.08 * point.yaw_rad).rem_euclid(TAU);
        }
        Patch {
            kind: kind(cover.community),
            point,
            variant,
        }
    }
}

/// The chance that there is grass at a place of a trail that would have it, by its light.
pub(crate) fn trodden_chance(sky_view: f64) -> f64 {
    let [dark, light] = TRAIL_LIGHT;
    ((sky_view - dark) / (light - dark)).clamp(0.0, 1.0)
}

/// The conditions at a place: water gathers in the nearest hollows and runs off slopes, and over
/// larger distances by [`ChunkGround::conditions`].
fn site(world_m: DVec2, ground: &ChunkGround, sky: &SkyViewFactor) -> CommunitySite {
    let here = ground.sample(world_m);
    let around = [DVec2::X, DVec2::Y, DVec2::NEG_X, DVec2::NEG_Y];
    let around = around.map(|way| ground.height_m(world_m + HOLLOW_M * way));
    let hollow_m = around.iter().sum::<f64>() / 4.0 - here.height_m;
    let slope = here.gradient.length();
    let nearest = 0.5 + 0.6 * hollow_m - 0.4 * (slope - 0.15).max(0.0);
    let (conditions, open_m) = (ground.conditions(world_m), ground.open_m(world_m));
    CommunitySite {
        sky_view: f64::from(sky.at(world_m.extend(here.height_m + 0.3))),
        moisture: (nearest + WIDER * conditions.wetness).clamp(0.0, 1.0),
        slope,
        heat_load: conditions.heat_load,
        soil_m: conditions.soil_m,
        meadow: ground.meadow(open_m),
        fringe: ground.fringe(open_m),
        bank_m: ground.bank_m(world_m),
        history: ground.history(world_m),
    }
}

#[cfg(test)]
mod tests {
    use super::trodden_chance;

    #[test]
    fn what_is_trodden_grows_in_the_light_alone() {
        let chances = [0.0, 0.1, 0.18, 0.26, 1.0].map(trodden_chance);
        assert_eq!(
            [chances[0], chances[1], chances[3], chances[4]],
            [0.0, 0.0, 1.0, 1.0]
        );
        assert!((chances[2] - 0.5).abs() < 1e-9);
    }
}
