//! What a sensor would see from a pose, by a few rays.

use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_scene::{MaterialLibrary, Ray, RigidTransform, Semantic, SurfaceHit};

use super::super::lidars::LidarRig;
use crate::Error;
use crate::config::{BalanceTarget, Config, CountedSurfaces};
use crate::recording::scene::FrameScene;

/// How many rays a view is known by, about.
pub(crate) const RAYS: u32 = 2000;
/// The greatest distance at which something counts, metres.
pub(crate) const PROBE_M: f64 = 50.0;
/// Heights above the ground under the robot between which something is in its way, metres.
const IN_THE_WAY_M: [f64; 2] = [0.1, 1.5];
/// A view of which more than half is this near, metres, is one into leaves before the lens.
const BLIND_M: f32 = 0.5;

/// The rays of a view, in the frame of the body.
#[derive(Clone, Debug)]
pub(crate) struct Probe {
    eye: DVec3,
    directions: Vec<DVec3>,
}

impl Probe {
    /// Those of the first camera, evenly over its picture, or of the first LiDAR if there is no
    /// camera, evenly over its first scan.
    pub(crate) fn new(config: &Config, lidars: &[LidarRig]) -> Result<Self, Error> {
        let of = |mount: RigidTransform, directions: Vec<DVec3>| Self {
            eye: mount.translation_m,
            directions: (directions.into_iter())
                .map(|d| mount.transform_vector(d))
                .collect(),
        };
        if config.camera.enabled {
            let lens = crate::world::cameras::intrinsics("camera", &config.camera)?;
            let (width, height) = (f64::from(lens.width), f64::from(lens.height));
            let columns = libm::round(libm::sqrt(f64::from(RAYS) * width / height)).max(1.0);
            let rows = libm::round(f64::from(RAYS) / columns).max(1.0);
            let (columns, rows) = (columns as u32, rows as u32);
            let direction = |i: u32| {
                let (column, row) = (f64::from(i % columns), f64::from(i / columns));
                lens.direction(DVec2::new(
                    (column + 0.5) / f64::from(columns) * width,
                    (row + 0.5) / f64::from(rows) * height,
                ))
            };
            let directions = (0..columns * rows).map(direction).collect();
            return Ok(of(config.camera.body_from_camera(), directions));
        }
        let Some(lidar) = lidars.first() else {
            return Ok(of(RigidTransform::IDENTITY, Vec::new()));
        };
        let pulses = lidar.scanner.params().pulses_per_scan;
        let step = (pulses / RAYS).max(1) as usize;
        let directions = lidar.scanner.pulses(0).step_by(step);
        let directions = directions.map(|pulse| pulse.direction).collect();
        Ok(of(lidar.body_from_lidar, directions))
    }

    /// The share of each target among the rays, from a pose of the body in the world; `None` if the
    /// view is blind.
    pub(crate) fn shares(
        &self,
        (scene, reach_m): (&FrameScene, f64),
        world_from_body: &RigidTransform,
        table: &TargetTable,
    ) -> Option<Vec<f64>> {
        let scene_from_body = RigidTransform {
            translation_m: world_from_body.translation_m - scene.origin_m,
            ..*world_from_body
        };
        let origin = scene_from_body.transform_point(self.eye).as_vec3();
        let ray = |direction: &DVec3| Ray {
            origin,
            direction: scene_from_body.transform_vector(*direction).as_vec3(),
            t_min_m: 0.0,
            t_max_m: reach_m as f32,
        };
        let rays: Vec<Ray> = self.directions.iter().map(ray).collect();
        let mut hits: Vec<Option<SurfaceHit>> = vec![None; rays.len()];
        scene.caster.closest_surfaces(&rays, &mut hits);
        let (mut counts, mut blind) = (vec![0_u32; table.targets], 0_u32);
        for (direction, hit) in self.directions.iter().zip(&hits) {
            let Some(hit) = hit else { continue };
            let of = &table.of_material[usize::from(hit.material.0)];
            if hit.distance_m < BLIND_M && !of.is_ground {
                blind += 1;
            }
            let at_m = self.eye + *direction * f64::from(hit.distance_m);
            let [low_m, high_m] = IN_THE_WAY_M;
            let in_the_way =
                f64::from(hit.distance_m) <= table.near_m && (low_m..=high_m).contains(&at_m.z);
            let met = of.anywhere | if in_the_way { of.near } else { 0 };
            for (t, count) in counts.iter_mut().enumerate() {
                *count += u32::from(met >> t & 1 == 1);
            }
        }
        let all = self.directions.len().max(1) as f64;
        let share = |count: u32| f64::from(count) / all;
        (2.0 * share(blind) <= 1.0).then(|| counts.into_iter().map(share).collect())
    }
}

/// The targets that each material counts for.
pub(crate) struct TargetTable {
    targets: usize,
    near_m: f64,
    of_material: Vec<OfMaterial>,
}

/// Targets as bits, in their order.
struct OfMaterial {
    /// Those that it counts for.
    anywhere: u32,
    /// Those that it counts for if it is near and in the way.
    near: u32,
    is_ground: bool,
}

impl TargetTable {
    pub(crate) fn new(targets: &[BalanceTarget], near_m: f64, materials: &MaterialLibrary) -> Self {
        let bits = |counts: &dyn Fn(&CountedSurfaces) -> bool| {
            let of = |(t, target): (usize, &BalanceTarget)| {
                if counts(&target.counts) { 1 << t } else { 0 }
            };
            targets.iter().enumerate().map(of).sum()
        };
        let of_material = |material: &nemoral_scene::Material| {
            let (what, on) = (material.semantic, material.support);
            OfMaterial {
                anywhere: bits(&|counts| match counts {
                    CountedSurfaces::Of(these) => these.contains(&what),
                    CountedSurfaces::OnTrunks(climber) => {
                        *climber == what && on == Some(Semantic::Stem)
                    }
                    CountedSurfaces::NearObstacles(_) => false,
                }),
                near: bits(&|counts| match counts {
                    CountedSurfaces::NearObstacles(these) => these.contains(&what),
                    CountedSurfaces::Of(_) | CountedSurfaces::OnTrunks(_) => false,
                }),
                is_ground: material.ground,
            }
        };
        Self {
            targets: targets.len(),
            near_m,
            of_material: materials.materials().iter().map(of_material).collect(),
        }
    }
}
