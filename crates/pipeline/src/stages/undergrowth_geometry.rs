//! The geometry of a chunk's undergrowth, ready for rays.

use std::sync::Arc;

use nemoral_placement::CoverPoint;
use nemoral_raycast::{Blas, Group};
use nemoral_scene::ChunkCoord;
use nemoral_seed::Key;
use nemoral_stand::{LOW_PLANT_VARIATION, LowPlant, PatchKind};
use nemoral_trails::DressingKind;

use crate::Error;
use crate::plan::{Hasher, Node, OfWorld, Stage};
use crate::world::assets::WorldAssets;
use crate::world::flora::Patch;
use crate::world::ground::{ChunkGround, GroundModel};

/// A chunk's undergrowth, seedlings and trail grass; `None` where nothing grows.
#[derive(Debug)]
pub struct UndergrowthGeometry(pub Option<Arc<Group>>);

/// Grows the undergrowth of a chunk.
#[derive(Clone, Copy, Debug)]
pub struct UndergrowthGeometryStage {
    /// Side of a chunk.
    pub chunk_size_m: f64,
}

impl Stage for UndergrowthGeometryStage {
    type At = ChunkCoord;
    type Inputs = (
        OfWorld<WorldAssets>,
        OfWorld<GroundModel>,
        Node<ChunkCoord, ChunkGround>,
        Node<ChunkCoord, Vec<Patch>>,
        Node<ChunkCoord, Vec<CoverPoint>>,
    );
    type Output = UndergrowthGeometry;
    const ID: &'static str = "chunk.low";
    const VERSION: u32 = 3;

    fn fingerprint(&self, hasher: &mut Hasher) {
        let Self { chunk_size_m } = self;
        hasher.write_f64(*chunk_size_m);
    }

    fn run(
        &self,
        at: ChunkCoord,
        world: Key,
        (assets, model, ground, patches, seedlings): (
            Arc<WorldAssets>,
            Arc<GroundModel>,
            Arc<ChunkGround>,
            Arc<Vec<Patch>>,
            Arc<Vec<CoverPoint>>,
        ),
    ) -> Result<UndergrowthGeometry, Error> {
        let origin = at.origin_m(self.chunk_size_m);
        let mut instances = Vec::new();
        let mut plant = |shapes: &[Arc<Blas>], weights: Option<&[f64]>, plant: LowPlant| {
            let placed = plant.instance(shapes, weights, |s| s.prototype(), &*ground, origin);
            instances.extend(placed.map(|(instance, shape)| (instance, Arc::clone(shape))));
        };
        for Patch { kind, point } in patches.iter() {
            let shapes = match kind {
                PatchKind::Grass => &assets.grass,
                PatchKind::Herbs => &assets.herbs,
                PatchKind::Ferns => &assets.ferns,
                PatchKind::Litter => &assets.litter,
            };
            plant(shapes, None, of_point(point));
        }
        for point in seedlings.iter() {
            let weights = Some(&*assets.seedling_weights);
            plant(&assets.seedlings, weights, of_point(point));
        }
        let dressing = model.trails().map(|t| t.dressing(at)).unwrap_or_default();
        let tufts = dressing.iter().filter(|d| d.kind != DressingKind::Stone);
        for (i, d) in tufts.enumerate() {
            let key = world.domain(LOW_PLANT_VARIATION).chunk(at).item(i as u64);
            let tuft = LowPlant {
                position_m: d.position_m,
                yaw_rad: d.yaw_rad,
                scale: d.scale,
                key,
            };
            plant(&assets.trail_tufts, None, tuft);
        }
        Ok(UndergrowthGeometry(
            (!instances.is_empty()).then(|| Arc::new(Group::build(instances))),
        ))
    }
}

fn of_point(point: &CoverPoint) -> LowPlant {
    LowPlant {
        position_m: point.position_m,
        yaw_rad: point.yaw_rad,
        scale: point.scale,
        key: point.key,
    }
}
