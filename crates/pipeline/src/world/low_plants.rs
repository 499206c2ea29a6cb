//! The low plants of a chunk, each with one of the library's shapes.

use std::sync::Arc;

use nemoral_assets::{Library, PlantKind};
use nemoral_placement::CoverPoint;
use nemoral_raycast::Blas;
use nemoral_scene::{ChunkCoord, InstancePlace, Surface};
use nemoral_seed::{Domain, Draw, Key};
use nemoral_stand::{LOW_PLANT_VARIATION, LowPlant, PatchKind, SkyViewFactor};
use nemoral_trails::{DressingKind, TrailDressing};

use super::assets::WorldAssets;
use super::banks::banks;
use super::chunk_ground::ChunkGround;
use super::closed_vegetation::trodden_chance;
use super::culverts::culverts;
use super::patch::Patch;
use super::stream_stones::StreamStones;
use crate::Error;

const STRIP: Domain = Domain::new("pipeline.strip");
const TUFTS: Domain = Domain::new("pipeline.tufts");

/// The height at which the light of plants on trails is known, metres.
const EYE_M: f64 = 0.3;

/// How far the variants of neighbouring tiles differ, as a share of all.
const VARIANT_SPREAD: f64 = 0.16;

/// The low plants of a chunk: undergrowth, seedlings, and grass on trails; what lies along trails
/// and streams.
pub(crate) struct LowPlants<'a> {
    pub(crate) patches: &'a [Patch],
    pub(crate) seedlings: &'a [CoverPoint],
    pub(crate) dressing: &'a [TrailDressing],
    /// `trails.banks`.
    pub(crate) banks: f64,
    pub(crate) sky: &'a SkyViewFactor,
}

impl LowPlants<'_> {
    /// Every plant in its chunk.
    pub(crate) fn instances(
        &self,
        (at, chunk_size_m): (ChunkCoord, f64),
        world: Key,
        assets: &WorldAssets,
        ground: &ChunkGround,
    ) -> Result<Vec<(InstancePlace, Arc<Blas>)>, Error> {
        let origin = at.origin_m(chunk_size_m);
        let plants = &assets.plants;
        let mut instances = Vec::new();
        let mut plant = |shapes: &[Arc<Blas>], weights: Option<&[f64]>, plant: LowPlant| {
            let placed = plant.place(shapes, weights, ground, origin);
            instances.extend(placed.map(|(place, shape)| (place, Arc::clone(shape))));
        };
        for Patch {
            kind,
            point,
            variant,
        } in self.patches
        {
            let tiles = |of: &Vec<Arc<Blas>>| near(*variant, of.len());
            let weights = match kind {
                PatchKind::Closed(of) => Some(tiles(&assets.communities[of.index()][0])),
                PatchKind::ClosedBorder(of) => Some(tiles(&assets.communities[of.index()][1])),
                _ => None,
            };
            let shapes = match kind {
                PatchKind::Closed(of) => &assets.communities[of.index()][0],
                PatchKind::ClosedBorder(of) => &assets.communities[of.index()][1],
                PatchKind::Grass => &plants[PlantKind::Grass],
                PatchKind::Herbs => &plants[PlantKind::Herbs],
                PatchKind::Ferns => &plants[PlantKind::Ferns],
                PatchKind::Litter => &plants[PlantKind::Litter],
                PatchKind::Branch => &plants[PlantKind::Branch],
                PatchKind::Brash => &plants[PlantKind::Brash],
                PatchKind::Scree => &plants[PlantKind::StoneBed],
            };
            plant(shapes, weights.as_deref(), of_point(point));
        }
        for point in self.seedlings {
            let weights = Some(&*assets.seedling_weights);
            plant(&plants[PlantKind::Seedling], weights, of_point(point));
        }
        let is_dry = |d: &TrailDressing| {
            !ground.is_puddle(d.position_m) && ground.is_clear_of_water(d.position_m, 0.3)
        };
        // There are no roots where there are no trees.
        let is_rootless = |d: &TrailDressing| {
            d.kind == DressingKind::Root && ground.litterfall(d.position_m) <= 0.0
        };
        let tufts = self.dressing.iter().filter(|d| {
            let is_elsewhere = matches!(
                d.kind,
                DressingKind::Stone | DressingKind::Culvert | DressingKind::Strip
            );
            !is_elsewhere && is_dry(d) && !is_rootless(d)
        });
        let steps = plants[PlantKind::TrailStep].chunks(Library::TRAIL_STEPS);
        let of_kind: Vec<_> = steps.collect();
        for (i, d) in tufts.enumerate() {
            let item = |domain: Domain| world.domain(domain).chunk(at).item(i as u64);
            if !grows(d.kind, self.light_at(d, ground), item(TUFTS)) {
                continue;
            }
            let key = item(LOW_PLANT_VARIATION);
            let tuft = LowPlant {
                position_m: d.position_m,
                yaw_rad: d.yaw_rad,
                scale: d.scale,
                key,
            };
            let shapes: &[Arc<Blas>] = match d.kind {
                DressingKind::Root => &plants[PlantKind::TrailRoot],
                DressingKind::Bed => &plants[PlantKind::StoneBed],
                DressingKind::Step => {
                    let kind = ground.trail_kind(d.position_m).map(|kind| kind.index());
                    kind.and_then(|kind| of_kind.get(kind))
                        .copied()
                        .unwrap_or(&[])
                }
                _ => &plants[PlantKind::TrailTuft],
            };
            plant(shapes, None, tuft);
        }
        let mats = self
            .dressing
            .iter()
            .filter(|d| d.kind == DressingKind::Strip);
        for (i, d) in mats.enumerate() {
            let key = world.domain(STRIP).chunk(at).item(i as u64);
            if is_dry(d) && key.rng().chance(trodden_chance(self.light_at(d, ground))) {
                let mat = LowPlant {
                    position_m: d.position_m,
                    yaw_rad: d.yaw_rad,
                    scale: d.scale,
                    key,
                };
                plant(&plants[PlantKind::StripMat], None, mat);
            }
        }
        let along = StreamStones::new(at, world, ground);
        for bed in along.cobbles {
            plant(&plants[PlantKind::WetBed], None, bed);
        }
        for stone in along.wet_stones {
            plant(&plants[PlantKind::WetStone], None, stone);
        }
        for stone in along.stones {
            plant(&plants[PlantKind::TrailStone], None, stone);
        }
        let mouths = culverts(at, world, self.dressing, ground);
        for (mouth, level) in mouths {
            let placed = mouth.place(&plants[PlantKind::Culvert], None, &level, origin);
            instances.extend(placed.map(|(place, shape)| (place, Arc::clone(shape))));
        }
        let of_banks = &plants[PlantKind::Bank];
        let (bare, rooty) = of_banks.split_at(of_banks.len() / 2);
        for piece in banks((at, chunk_size_m), world, self.banks, ground)? {
            let shapes = if piece.is_rooty { rooty } else { bare };
            let placed = piece.place(shapes, origin);
            instances.extend(placed.map(|(place, shape)| (place, Arc::clone(shape))));
        }
        Ok(instances)
    }

    /// The sky view factor at a plant of a trail, 0..1.
    fn light_at(&self, of: &TrailDressing, ground: &ChunkGround) -> f64 {
        let height_m = ground.height_m(of.position_m) + EYE_M;
        f64::from(self.sky.at(of.position_m.extend(height_m)))
    }
}

/// Whether what belongs to a trail is there with this sky view factor: grass, clover and plantain
/// need light, on the trail and along it; nothing else lives.
fn grows(kind: DressingKind, sky_view: f64, key: Key) -> bool {
    match kind {
        DressingKind::Grass | DressingKind::Verge => key.rng().chance(trodden_chance(sky_view)),
        _ => true,
    }
}

/// Weights of `count` variants of which those near `variant`, 0..1, are frequent.
pub(crate) fn near(variant: f64, count: usize) -> Vec<f64> {
    let weight = |i: usize| {
        let off = (i as f64 + 0.5) / count as f64 - variant;
        libm::exp(-off * off / (2.0 * VARIANT_SPREAD * VARIANT_SPREAD))
    };
    (0..count).map(weight).collect()
}

fn of_point(point: &CoverPoint) -> LowPlant {
    LowPlant {
        position_m: point.position_m,
        yaw_rad: point.yaw_rad,
        scale: point.scale,
        key: point.key,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grass_along_trails_needs_light_and_what_is_dead_does_not() {
        let there = |kind, sky_view| {
            let keys = (0..1000).map(|i| Key::world(1).item(i));
            keys.filter(|key| grows(kind, sky_view, *key)).count()
        };
        for kind in [DressingKind::Grass, DressingKind::Verge] {
            assert_eq!(there(kind, 0.08), 0);
            assert!((450..550).contains(&there(kind, 0.18)));
            assert_eq!(there(kind, 0.3), 1000);
        }
        for kind in [DressingKind::Root, DressingKind::Bed, DressingKind::Step] {
            assert_eq!(there(kind, 0.0), 1000);
        }
    }
}
