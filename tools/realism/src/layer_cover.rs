//! The cover of layers of low plants.

use std::f64::consts::TAU;

use nemoral_pipeline::plan::Runner;
use nemoral_pipeline::world::assets::WorldAssets;
use nemoral_scene::glam::{DVec2, DVec3, Vec3};
use nemoral_scene::{ChunkCoord, Hit, Material, Ray, Semantic, Surface};
use nemoral_seed::{Draw, Key};

use crate::world::World;

/// Places at each frame, and their greatest distance from the robot, metres.
const PLACES: u32 = 20_000;
const AROUND_M: f64 = 45.0;

/// The layers whose cover is measured, as [`LayerCover::shares`] has them.
pub const COVER_LAYERS: [&str; 5] = ["moss", "herbs", "shrubs < 0.5 m", "< 1.5 m", "< 3 m"];

/// The tops of layers above the ground, metres, the lowest first.
const TOPS_M: [f64; 3] = [0.5, 1.5, 3.0];

/// Counts of what lines straight down meet first within layers: a line begins at the top of each
/// layer, so that none hides what is below.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LayerCover {
    lines: u32,
    of: [u32; COVER_LAYERS.len()],
}

impl LayerCover {
    /// The cover around the robot at some frames.
    ///
    /// # Panics
    /// If the world cannot be grown.
    #[must_use]
    pub fn of(world: &World, runner: &Runner<'_>, assets: &WorldAssets, frames: &[u64]) -> Self {
        let mut cover = Self::default();
        let materials = assets.library.materials.materials();
        for &frame in frames {
            let scene = runner.get(world.forest.scene, frame).expect("a scene");
            let pose = runner.get(world.forest.pose, frame).expect("a pose");
            let here = pose.world_from_body().translation_m.truncate();
            let mut rng = Key::world(19).item(frame).rng();
            let mut place = || {
                let way = DVec2::from_angle(rng.range_f64(0.0, TAU));
                let place = here + way * AROUND_M * rng.unit_f64().sqrt();
                let chunk = ChunkCoord::containing(place, world.config.chunks.size_m);
                let ground = runner.get(world.forest.ground, chunk).expect("ground");
                place.extend(ground.height_m(place)) - scene.origin_m
            };
            let places: Vec<DVec3> = (0..PLACES).map(|_| place()).collect();
            let met = TOPS_M.map(|top_m| {
                let from = |place: &DVec3| (*place + DVec3::Z * top_m).as_vec3();
                let rays = places.iter().map(|p| Ray::new(from(p), Vec3::NEG_Z));
                let rays: Vec<Ray> = rays.collect();
                let mut hits = vec![None; rays.len()];
                scene.caster.closest_hits(&rays, &mut hits);
                hits
            });
            for i in 0..places.len() {
                let of = |hits: &Vec<Option<Hit>>| {
                    let surface = hits[i]?.surface;
                    let material = materials.get(usize::from(surface.material.0))?;
                    Some((material, f64::from(surface.distance_m)))
                };
                cover.add([of(&met[0]), of(&met[1]), of(&met[2])]);
            }
        }
        cover
    }

    /// Counts a place by what its lines met first, from the lowest layer to the highest: the
    /// material, and how far below the layer's top, metres.
    pub fn add(&mut self, met: [Option<(&Material, f64)>; TOPS_M.len()]) {
        self.lines += 1;
        let bases_m = [0.0, TOPS_M[0], TOPS_M[1]];
        for (i, met) in met.into_iter().enumerate() {
            let Some((material, below_m)) = met else {
                continue;
            };
            let is_within = i == 0 || below_m <= TOPS_M[i] - bases_m[i];
            let layer = match (i, material.semantic) {
                (0, Semantic::GroundMoss) => 0,
                (0, Semantic::Fern | Semantic::Grass | Semantic::Herb | Semantic::Seedling) => 1,
                (0, Semantic::Shrub | Semantic::Bramble) => 2,
                (
                    i,
                    Semantic::Fern
                    | Semantic::Grass
                    | Semantic::Herb
                    | Semantic::Seedling
                    | Semantic::Shrub
                    | Semantic::Bramble,
                ) => 2 + i,
                _ => continue,
            };
            self.of[layer] += u32::from(is_within);
        }
    }

    /// The share of the ground that each of [`COVER_LAYERS`] covers.
    #[must_use]
    pub fn shares(&self) -> [f64; COVER_LAYERS.len()] {
        self.of.map(|n| f64::from(n) / f64::from(self.lines.max(1)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_do_not_hide_each_other() {
        let plain = |name: &str, semantic| Material::plain(name, semantic, Vec3::ONE);
        let (fern, moss) = (
            plain("fern", Semantic::Fern),
            plain("moss", Semantic::GroundMoss),
        );
        let (gorse, leaf) = (
            plain("gorse.foliage", Semantic::Shrub),
            plain("oak", Semantic::Leaf),
        );
        let mut cover = LayerCover::default();
        // A fern of 0.7 m over moss; gorse of 2 m whose foliage ends above the ground; a branch.
        cover.add([Some((&moss, 0.5)), Some((&fern, 0.8)), Some((&fern, 2.3))]);
        cover.add([
            Some((&gorse, 0.2)),
            Some((&gorse, 0.3)),
            Some((&gorse, 1.0)),
        ]);
        cover.add([None, Some((&leaf, 0.1)), None]);
        cover.add([Some((&fern, 0.1)), Some((&fern, 1.1)), Some((&fern, 2.6))]);
        assert_eq!(cover.shares(), [0.25, 0.25, 0.25, 0.5, 0.25]);
    }
}
