//! Ivy, lianas, moss and resin on the trees of a chunk.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

use nemoral_assets::PlantKind;
use nemoral_raycast::Blas;
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, InstancePlace, ObjectId, ObjectKind};
use nemoral_seed::{Domain, Draw, Key};
use nemoral_stand::{FERN_FIELD, LowPlant, ScalarField, SceneObject, SceneObjects};

use super::assets::{ClimberShapes, WorldAssets};
use super::chunk_ground::ChunkGround;
use super::ground::TerrainField;
use crate::{Error, config};

const CLIMBERS: Domain = Domain::new("pipeline.climbers");
const LIANAS: Domain = Domain::new("pipeline.lianas");

/// How much more often clematis hangs from a tree that grew up in the open.
const CLEMATIS_AT_EDGE: f64 = 3.0;

/// Patches of carpet around a climbed tree: the least and the most.
const CARPETS: [u32; 2] = [3, 7];
/// How far the farthest is from the stem, metres.
const CARPET_REACH_M: f64 = 2.0;

/// Which trees are climbed, in a world.
#[derive(Clone, Debug)]
pub(crate) struct Climbing {
    wanted: config::Climbers,
    /// Where ivy is, and where lianas are.
    fields: [TerrainField; 2],
    key: Key,
}

impl Climbing {
    pub(crate) fn new(wanted: &config::Climbers, world: Key) -> Result<Self, Error> {
        let key = world.domain(CLIMBERS);
        Ok(Self {
            wanted: wanted.clone(),
            fields: [
                TerrainField::new(FERN_FIELD, key)?,
                TerrainField::new(FERN_FIELD, world.domain(LIANAS))?,
            ],
            key,
        })
    }

    /// What grows on the trees of a chunk and around them. Moss has the id of the tree whose trunk
    /// it covers; ivy, which is a plant of its own, has none.
    pub(crate) fn instances(
        &self,
        (at, chunk_size_m): (ChunkCoord, f64),
        objects: &SceneObjects,
        assets: &WorldAssets,
        ground: &ChunkGround,
    ) -> Vec<(InstancePlace, Arc<Blas>)> {
        let mut all = Vec::new();
        for object in &objects.0 {
            if object.kind != ObjectKind::Tree {
                continue;
            }
            // Saplings, which come after all grown trees, are not climbed.
            let Some(shapes) = assets.climbers.get(object.asset) else {
                continue;
            };
            let key = self.key.chunk(at).item(u64::from(object.object.item()));
            let mut rng = key.rng();
            let moss_place = InstancePlace {
                variation: rng.unit_f32(),
                ..object.place(at, chunk_size_m)
            };
            if let Some(shape) = self.mossy_side(object).and_then(|i| shapes.moss.get(i)) {
                all.push((moss_place, Arc::clone(shape)));
            }
            let ivy_place = InstancePlace {
                object: ObjectId::NONE,
                ..moss_place
            };
            for (shape, is_plant) in self.lianas_and_resin(object, shapes, assets, key) {
                let place = if is_plant { ivy_place } else { moss_place };
                all.push((place, Arc::clone(shape)));
            }
            let dbh_m = assets.standing[object.asset].tree.size.dbh_m * object.scale;
            let climbed = rng.chance(self.ivy_chance(object.position_m.truncate(), dbh_m, assets));
            let high = rng.chance(self.wanted.ivy_in_crown);
            let Some(shape) = shapes.ivy.get(usize::from(high)).filter(|_| climbed) else {
                continue;
            };
            all.push((ivy_place, Arc::clone(shape)));
            for i in 0..rng.between(CARPETS[0], CARPETS[1]) {
                let (sin, cos) = libm::sincos(rng.range_f64(0.0, TAU));
                let off = object.radius_m + CARPET_REACH_M * rng.unit_f64();
                let patch = LowPlant {
                    position_m: object.position_m.truncate() + DVec2::new(cos, sin) * off,
                    yaw_rad: rng.range_f64(0.0, TAU),
                    scale: rng.range_f64(0.7, 1.15),
                    key: key.item(u64::from(i)),
                };
                let p = patch.position_m;
                if ground.trail_edge_m(p) > 0.6 && ground.is_clear_of_water(p, 0.6) {
                    let origin = at.origin_m(chunk_size_m);
                    let carpets = &assets.plants[PlantKind::IvyCarpet];
                    let laid = patch.place(carpets, None, ground, origin);
                    all.extend(laid.map(|(place, shape)| (place, Arc::clone(shape))));
                }
            }
        }
        all
    }

    /// The chance that ivy climbs a tree: thick ones more often, and in patches.
    fn ivy_chance(&self, world_m: DVec2, dbh_m: f64, assets: &WorldAssets) -> f64 {
        let thick = (dbh_m / assets.dbh_mean_m.max(0.05)).clamp(0.3, 1.7);
        self.wanted.ivy * thick * patchiness(&self.fields[0], world_m)
    }

    /// Lianas and resin on a tree, each with whether it is a plant of its own.
    fn lianas_and_resin<'a>(
        &self,
        object: &SceneObject,
        shapes: &'a ClimberShapes,
        assets: &WorldAssets,
        of_tree: Key,
    ) -> impl Iterator<Item = (&'a Arc<Blas>, bool)> {
        let mut rng = of_tree.domain(LIANAS).rng();
        let patch = patchiness(&self.fields[1], object.position_m.truncate());
        let dbh_m = assets.standing[object.asset].tree.size.dbh_m * object.scale;
        // A twiner holds thin stems best.
        let thin = (assets.dbh_mean_m / dbh_m.max(0.05)).clamp(0.4, 1.5);
        let light = if assets.is_at_edge(object.asset) {
            CLEMATIS_AT_EDGE
        } else {
            1.0
        };
        let all = [
            (
                &shapes.honeysuckle,
                self.wanted.honeysuckle * thin * patch,
                true,
            ),
            (&shapes.clematis, self.wanted.clematis * light * patch, true),
            (&shapes.resin, self.wanted.resin, false),
        ];
        // Each is drawn, whether there is a shape or not.
        let drawn = all.map(|(shape, share, is_plant)| {
            let is_there = rng.chance(share.min(1.0));
            let shape = shape.as_ref().filter(|_| is_there);
            shape.map(|shape| (shape, is_plant))
        });
        drawn.into_iter().flatten()
    }

    /// The number of the moss whose side of a tree is the moist side; `None` without moss.
    fn mossy_side(&self, object: &SceneObject) -> Option<usize> {
        if self.wanted.moss <= 0.0 {
            return None;
        }
        let x = object.linear.x_axis.as_dvec3();
        let turned = libm::atan2(x.y, x.x);
        let moist = FRAC_PI_2 - self.wanted.moss_azimuth_deg.to_radians();
        let quarter = ((moist - turned) / FRAC_PI_2).round() as i64;
        Some(quarter.rem_euclid(4) as usize)
    }
}

/// A factor of the frequency of climbers, 0.3 to 1.7 by a field that is 0.5 on average.
fn patchiness(field: &TerrainField, world_m: DVec2) -> f64 {
    let patch = ((field.value(world_m) - 0.5) * 3.5 + 0.5).clamp(0.0, 1.0);
    0.3 + 1.4 * patch
}
