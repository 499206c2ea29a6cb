//! One scan: makes rays from pulses and points from hits.

use nemoral_scene::glam::Vec3;
use nemoral_scene::{LidarPoint, Ray, SurfaceHit};
use rayon::iter::repeat_n;
use rayon::prelude::*;

use crate::echo_detection::{BatchHits, Return};
use crate::pulse_batch::{PulseBatch, ScanContext};
use crate::water_reflection::mirrored;

/// The most rays that are cast together: enough that a caster finds many similar ones, and that a
/// usual scan is cast in one call.
const MAX_RAYS: u32 = 50 << 10;

/// The pulses that one task works on.
const BATCH_PULSES: usize = 1024;

/// All points of a scan, in the order of firing.
pub(crate) fn points(scan: &ScanContext<'_>) -> Vec<LidarPoint> {
    let pulses = scan.params.pulses_per_scan;
    let together = (MAX_RAYS / scan.sub_rays.len() as u32).max(1);
    let mut points = Vec::with_capacity(pulses as usize);
    for start in (0..pulses).step_by(together as usize) {
        fire(scan, start, together.min(pulses - start), &mut points);
    }
    points
}

/// Adds the points of `count` pulses from the `start`-th of the scan on.
fn fire(scan: &ScanContext<'_>, start: u32, count: u32, points: &mut Vec<LidarPoint>) {
    let rays_per_pulse = scan.sub_rays.len();
    let rays_per_batch = BATCH_PULSES * rays_per_pulse;
    let all = count as usize * rays_per_pulse;
    let mut rays = first_touched(Ray::new(Vec3::ZERO, Vec3::X), all);
    let aim = |(i, rays): (usize, &mut [Ray])| scan.aim(start + (i * BATCH_PULSES) as u32, rays);
    let batches = rays.par_chunks_mut(rays_per_batch).enumerate().map(aim);
    let batches: Vec<PulseBatch> = batches.collect();
    let mut hits: Vec<Option<SurfaceHit>> = first_touched(None, all);
    scan.caster.closest_surfaces(&rays, &mut hits);
    let cast = rays
        .par_chunks(rays_per_batch)
        .zip(hits.par_chunks(rays_per_batch));
    let cast = batches.par_iter().zip(cast);
    let detected: Vec<(BatchHits<'_>, Vec<Return>)> = cast
        .map(|(batch, (rays, hits))| {
            let range = (scan.params.min_range_m, scan.params.max_range_m);
            let cast = BatchHits {
                batch,
                rays,
                hits,
                mirrored: mirrored(rays, hits, scan.caster, scan.materials, range),
            };
            let returns = scan.detect(&cast);
            (cast, returns)
        })
        .collect();
    // Points are written in their final places, as each task knows how many come before its own.
    let mut ends = Vec::with_capacity(detected.len());
    let mut returned = 0;
    for (_, returns) in &detected {
        returned += returns.len();
        ends.push(returned);
    }
    let point = |batch: &mut usize, number: usize| {
        while ends[*batch] <= number {
            *batch += 1;
        }
        let (hits, returns) = &detected[*batch];
        let behind = ends[*batch] - number;
        scan.point(hits, &returns[returns.len() - behind])
    };
    let numbers = (0..returned).into_par_iter().with_min_len(BATCH_PULSES);
    points.par_extend(numbers.map_init(|| 0, point));
}

/// Memory for `count` values, first touched by all threads, so that these share the page faults.
fn first_touched<T: Copy + Send + Sync>(value: T, count: usize) -> Vec<T> {
    repeat_n(value, count)
        .with_min_len(8 * BATCH_PULSES)
        .collect()
}
