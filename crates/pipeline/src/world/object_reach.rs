//! How far objects reach from where they stand or lie.

use std::sync::Arc;

use nemoral_assets::PlantKind;
use nemoral_raycast::Blas;
use nemoral_scene::ObjectKind;

use super::assets::WorldAssets;

/// No object of a world reaches farther than this from the place that decides its chunk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ObjectReach {
    /// On the map, metres.
    pub(crate) across_m: f64,
    /// Upwards, metres.
    pub(crate) up_m: f64,
}

impl ObjectReach {
    /// That of everything with an id that stands or lies in a world, whatever its size there.
    pub(crate) fn of(assets: &WorldAssets) -> Self {
        let mut reach = Self {
            across_m: 0.0,
            up_m: 0.0,
        };
        for (asset, standing) in assets.standing.iter().enumerate() {
            let scale = assets.models.largest(ObjectKind::Tree, asset);
            reach.add_upright(&standing.blas, [scale; 2]);
        }
        for tree in &assets.measured {
            let shape = &assets.standing[tree.asset].blas;
            reach.add_upright(shape, [tree.size.across, tree.size.along]);
        }
        let plants = &assets.plants;
        // Wet ones have the numbers after those of dry ones.
        let rocks = [PlantKind::Rock, PlantKind::WetRock].map(|kind| &plants[kind][..]);
        let rocks = rocks.concat();
        for (kind, shapes) in [
            (ObjectKind::Stump, &plants[PlantKind::Stump]),
            (ObjectKind::Shrub, &plants[PlantKind::Shrub]),
            (ObjectKind::Rock, &rocks),
            (ObjectKind::Log, &assets.logs),
            (ObjectKind::RootPlate, &plants[PlantKind::RootPlate]),
        ] {
            for (asset, shape) in shapes.iter().enumerate() {
                reach.add_turned(shape, assets.models.largest(kind, asset));
            }
        }
        reach
    }

    /// Adds what stands upright, at the greatest scales of its width and height.
    fn add_upright(&mut self, shape: &Arc<Blas>, [across, up]: [f64; 2]) {
        let bounds = shape.prototype().bounds();
        let widest = bounds.min.abs().max(bounds.max.abs()).truncate();
        self.across_m = self.across_m.max(across * f64::from(widest.length()));
        self.up_m = self.up_m.max(up * f64::from(bounds.max.z));
    }

    /// Adds what may be turned in any way.
    fn add_turned(&mut self, shape: &Arc<Blas>, scale: f64) {
        let bounds = shape.prototype().bounds();
        let farthest = bounds.min.abs().max(bounds.max.abs()).length();
        let reach_m = scale * f64::from(farthest);
        self.across_m = self.across_m.max(reach_m);
        self.up_m = self.up_m.max(reach_m);
    }
}
