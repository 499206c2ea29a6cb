//! One scan: from pulses to rays, and the way to points.

use nemoral_scene::glam::{DVec3, Vec3};
use nemoral_scene::{LidarPoint, MaterialLibrary, Ray, RayCaster, RigidTransform, SurfaceHit};
use nemoral_seed::{Domain, Draw, Key};
use rayon::iter::repeat_n;
use rayon::prelude::*;

use crate::beam::{BeamAxes, SubRay, turned};
use crate::receive::{Answer, Report};
use crate::{Pulse, RangeModel, ScanPattern, ScannerParams};

/// Rays cast together, at the most: enough that a caster finds many alike, and a usual scan in one.
const MOST_RAYS: u32 = 50 << 10;

/// Pulses that one thread works on.
const PIECE: usize = 1024;

const JITTER: Domain = Domain::new("lidar.jitter");

/// What the pulses of one scan have in common.
pub(crate) struct Scan<'a> {
    pub(crate) params: &'a ScannerParams,
    pub(crate) pattern: &'a dyn ScanPattern,
    pub(crate) sub_rays: &'a [SubRay],
    pub(crate) first_pulse: u64,
    /// When the first pulse fires, in the pattern's time.
    pub(crate) start_s: f64,
    /// The frame's time, in the pattern's.
    pub(crate) middle_s: f64,
    /// At the frame's time.
    pub(crate) lidar_from_scene: RigidTransform,
    pub(crate) caster: &'a dyn RayCaster,
    pub(crate) materials: &'a MaterialLibrary,
    pub(crate) scene_from_lidar_at: &'a (dyn Fn(f64) -> RigidTransform + Sync),
    pub(crate) noise: &'a dyn RangeModel,
    pub(crate) key: Key,
}

/// Pulses that one thread works on.
pub(crate) struct Piece {
    /// The first one's number in the scan.
    pub(crate) start: u32,
    pub(crate) pulses: Vec<Pulse>,
    /// Which of the poses the LiDAR has as each fires.
    pose_of: Vec<u32>,
    /// Scene from LiDAR, of each moment of firing.
    poses: Vec<RigidTransform>,
}

impl Piece {
    /// Scene from LiDAR, as a pulse fires.
    pub(crate) fn pose(&self, shot: usize) -> &RigidTransform {
        &self.poses[self.pose_of[shot] as usize]
    }
}

impl Scan<'_> {
    /// All points, in the order of firing.
    pub(crate) fn points(&self) -> Vec<LidarPoint> {
        let pulses = self.params.pulses_per_scan;
        let together = (MOST_RAYS / self.sub_rays.len() as u32).max(1);
        let mut points = Vec::with_capacity(pulses as usize);
        for start in (0..pulses).step_by(together as usize) {
            self.fire(start, together.min(pulses - start), &mut points);
        }
        points
    }

    /// Adds the points of `count` pulses from the `start`-th of the scan on.
    fn fire(&self, start: u32, count: u32, points: &mut Vec<LidarPoint>) {
        let of_shot = self.sub_rays.len();
        let of_piece = PIECE * of_shot;
        let all = count as usize * of_shot;
        let mut rays = fresh(Ray::new(Vec3::ZERO, Vec3::X), all);
        let aim = |(i, rays): (usize, &mut [Ray])| self.aim(start + (i * PIECE) as u32, rays);
        let pieces = rays.par_chunks_mut(of_piece).enumerate().map(aim);
        let pieces: Vec<Piece> = pieces.collect();
        let mut hits: Vec<Option<SurfaceHit>> = fresh(None, all);
        self.caster.closest_surfaces(&rays, &mut hits);
        let answers = rays.par_chunks(of_piece).zip(hits.par_chunks(of_piece));
        let answers = pieces.par_iter().zip(answers);
        let answers = answers.map(|(piece, (rays, hits))| Answer { piece, rays, hits });
        let received: Vec<(Answer<'_>, Vec<Report>)> = answers
            .map(|answer| {
                let reports = self.receive(&answer);
                (answer, reports)
            })
            .collect();
        // Points are made where they stay: each thread knows how many come before its own.
        let mut ends = Vec::with_capacity(received.len());
        let mut reported = 0;
        for (_, reports) in &received {
            reported += reports.len();
            ends.push(reported);
        }
        let point = |piece: &mut usize, number: usize| {
            while ends[*piece] <= number {
                *piece += 1;
            }
            let (answer, reports) = &received[*piece];
            let behind = ends[*piece] - number;
            self.point(answer, &reports[reports.len() - behind])
        };
        let numbers = (0..reported).into_par_iter().with_min_len(PIECE);
        points.par_extend(numbers.map_init(|| 0, point));
    }

    /// Pulses from the `start`-th of the scan on, and their rays in the scene.
    fn aim(&self, start: u32, rays: &mut [Ray]) -> Piece {
        let of_shot = self.sub_rays.len();
        let pulses = (self.pattern).pulses(self.in_pattern(start), (rays.len() / of_shot) as u32);
        // Lasers that fire together share a pose, and poses may cost more than rays.
        let mut fired_s = f64::NAN;
        let mut poses = Vec::new();
        let mut pose_of = Vec::with_capacity(pulses.len());
        for ((number, pulse), rays) in (start..).zip(&pulses).zip(rays.chunks_mut(of_shot)) {
            if pulse.time_s != fired_s {
                fired_s = pulse.time_s;
                poses.push((self.scene_from_lidar_at)(fired_s - self.middle_s));
            }
            pose_of.push(poses.len() as u32 - 1);
            let pose = &poses[poses.len() - 1];
            self.aim_one(pose, self.jittered(number, pulse.direction), rays);
        }
        Piece {
            start,
            pulses,
            pose_of,
            poses,
        }
    }

    /// Makes the rays of a pulse that really goes in a direction of the LiDAR frame.
    fn aim_one(&self, scene_from_lidar: &RigidTransform, direction: DVec3, rays: &mut [Ray]) {
        let in_scene = |v| scene_from_lidar.transform_vector(v);
        let ray = |direction: DVec3| Ray {
            origin: scene_from_lidar.translation_m.as_vec3(),
            direction: direction.as_vec3(),
            // From 0, not from the blind zone: what is there blocks the pulse.
            t_min_m: 0.0,
            t_max_m: self.params.max_range_m,
        };
        if let [only] = rays {
            *only = ray(in_scene(direction));
            return;
        }
        let axes = BeamAxes::along(direction).map(in_scene);
        for (ray_of_part, part) in rays.iter_mut().zip(self.sub_rays) {
            *ray_of_part = ray(axes.towards(part));
        }
    }

    /// What keys the randomness of a pulse of the scan.
    pub(crate) fn identity(&self, number: u32) -> u64 {
        self.pattern.identity(self.in_pattern(number))
    }

    /// A key of a pulse for one purpose.
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

/// Memory for so many, touched for the first time by all threads.
fn fresh<T: Copy + Send + Sync>(value: T, count: usize) -> Vec<T> {
    repeat_n(value, count).with_min_len(8 * PIECE).collect()
}
