//! Making rays from pulses.

use nemoral_scene::glam::DVec3;
use nemoral_scene::{MaterialLibrary, Ray, RayCaster, RigidTransform};
use nemoral_seed::{Domain, Draw, Key};

use crate::air::Air;
use crate::beam::{BeamAxes, SubRay, turned};
use crate::params::ScannerParams;
use crate::pattern::{Pulse, ScanPattern};
use crate::range_model::RangeModel;

const JITTER: Domain = Domain::new("lidar.jitter");

/// What the pulses of one scan have in common.
pub(crate) struct ScanContext<'a> {
    pub(crate) params: &'a ScannerParams,
    pub(crate) pattern: &'a dyn ScanPattern,
    pub(crate) sub_rays: &'a [SubRay],
    pub(crate) air: &'a Air,
    pub(crate) first_pulse: u64,
    /// The frame's time, in the pattern's.
    pub(crate) middle_s: f64,
    /// The transform at the frame's time.
    pub(crate) lidar_from_scene: RigidTransform,
    pub(crate) caster: &'a dyn RayCaster,
    pub(crate) materials: &'a MaterialLibrary,
    pub(crate) scene_from_lidar_at: &'a (dyn Fn(f64) -> RigidTransform + Sync),
    pub(crate) range_model: &'a dyn RangeModel,
    pub(crate) key: Key,
}

/// Consecutive pulses that one task works on.
pub(crate) struct PulseBatch {
    /// The number of the first one in the scan.
    pub(crate) start: u32,
    pub(crate) pulses: Vec<Pulse>,
    /// For each pulse, the number of the pose that the LiDAR has when it fires.
    pose_of: Vec<u32>,
    /// The transform from the LiDAR to the scene at each moment of firing.
    poses: Vec<RigidTransform>,
}

impl PulseBatch {
    /// The transform from the LiDAR to the scene when a pulse fires.
    pub(crate) fn pose(&self, shot: usize) -> &RigidTransform {
        &self.poses[self.pose_of[shot] as usize]
    }
}

impl ScanContext<'_> {
    /// A batch of pulses from the `start`-th of the scan on. Sets their rays in the scene.
    pub(crate) fn aim(&self, start: u32, rays: &mut [Ray]) -> PulseBatch {
        let rays_per_pulse = self.sub_rays.len();
        let count = (rays.len() / rays_per_pulse) as u32;
        let pulses = (self.pattern).pulses(self.in_pattern(start), count);
        // Lasers that fire together share a pose, as computing poses may take longer than casting
        // rays.
        let mut fired_s = f64::NAN;
        let mut poses = Vec::new();
        let mut pose_of = Vec::with_capacity(pulses.len());
        let rays = rays.chunks_mut(rays_per_pulse);
        for ((number, pulse), rays) in (start..).zip(&pulses).zip(rays) {
            if pulse.time_s != fired_s {
                fired_s = pulse.time_s;
                let pose = (self.scene_from_lidar_at)(fired_s - self.middle_s);
                debug_assert!(
                    pose.rotation.is_normalized(),
                    "{pose:?}: must be a rotation"
                );
                poses.push(pose);
            }
            pose_of.push(poses.len() as u32 - 1);
            let pose = &poses[poses.len() - 1];
            self.aim_pulse(pose, fired_s, self.jittered(number, pulse.direction), rays);
        }
        PulseBatch {
            start,
            pulses,
            pose_of,
            poses,
        }
    }

    /// Sets the rays of a pulse, given when it is fired and its true direction in the LiDAR frame.
    fn aim_pulse(
        &self,
        scene_from_lidar: &RigidTransform,
        fired_s: f64,
        direction: DVec3,
        rays: &mut [Ray],
    ) {
        let in_scene = |v| scene_from_lidar.transform_vector(v);
        // Starts at a place off the LiDAR's, along a direction in the scene, and ends at a range.
        let ray = |exit_m: DVec3, direction: DVec3, t_max_m: f32| Ray {
            origin: (scene_from_lidar.translation_m + exit_m).as_vec3(),
            direction: direction.as_vec3(),
            // The ray starts at 0 rather than at the blind zone, because surfaces there block the
            // pulse.
            t_min_m: 0.0,
            t_max_m,
        };
        if let [only] = rays {
            let t_max_m = self.reach_m(DVec3::ZERO, direction);
            *only = ray(DVec3::ZERO, in_scene(direction), t_max_m);
            return;
        }
        let in_lidar = BeamAxes::along(direction, self.pattern.up(fired_s));
        let axes = in_lidar.map(in_scene);
        for (ray_of_part, part) in rays.iter_mut().zip(self.sub_rays) {
            let t_max_m = if self.params.carrier.is_some() {
                self.reach_m(in_lidar.exit_m(part), in_lidar.towards(part))
            } else {
                self.params.max_range_m
            };
            *ray_of_part = ray(axes.exit_m(part), axes.towards(part), t_max_m);
        }
    }

    /// How far a ray reaches from a place in a direction, both in the LiDAR's frame: to what
    /// carries the LiDAR, if that is in its way.
    fn reach_m(&self, from_m: DVec3, direction: DVec3) -> f32 {
        let max_range_m = self.params.max_range_m;
        let carrier = self.params.carrier.as_ref();
        match carrier.and_then(|carrier| carrier.distance_m(from_m, direction)) {
            Some(distance_m) => max_range_m.min(distance_m as f32),
            None => max_range_m,
        }
    }

    /// The identity in the pattern of a pulse of the scan, which keys its randomness.
    pub(crate) fn identity(&self, number: u32) -> u64 {
        self.pattern.identity(self.in_pattern(number))
    }

    /// The key of a pulse of the scan for one purpose.
    pub(crate) fn key_of(&self, number: u32, domain: Domain) -> Key {
        self.key.item(self.identity(number)).domain(domain)
    }

    /// The number in the pattern of a pulse of the scan.
    fn in_pattern(&self, number: u32) -> u64 {
        self.first_pulse.wrapping_add(number.into())
    }

    fn jittered(&self, number: u32, direction: DVec3) -> DVec3 {
        let sigma = self.params.errors.angular_sigma_rad;
        if sigma == 0.0 {
            return direction;
        }
        let mut rng = self.key_of(number, JITTER).rng();
        turned(direction, sigma * rng.normal(), sigma * rng.normal())
    }
}
