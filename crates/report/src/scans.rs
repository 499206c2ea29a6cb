//! Scans, thinned, packed for a page.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use nemoral_dataset::LidarFrame;
use serde::Serialize;

/// The most points of a frame, over its LiDARs.
const FRAME_POINTS: usize = 24_000;

/// A LiDAR's scan.
#[derive(Debug, Serialize)]
pub(crate) struct Scan {
    name: String,
    /// Points of the whole scan.
    total: usize,
    /// Points that are on the page.
    count: usize,
    /// What a step of a coordinate is, metres.
    unit_m: f32,
    /// Whether the times are known.
    timed: bool,
    /// Base64 of little-endian arrays, one after the other: x, y, z as `i16`, instance and time (as
    /// a share of the scan) as `u16`, class and intensity as `u8`.
    data: String,
}

/// A scan that shares the frame with others. The points that are kept are spread over the scan by
/// the golden ratio, so that no ring and no column of a regular pattern is favoured.
pub(crate) fn scan(lidar: &LidarFrame, lidars: usize) -> Scan {
    let total = lidar.points.len();
    let most = (FRAME_POINTS / lidars).max(1);
    let threshold = (most as f64 / total.max(1) as f64).min(1.0) * 2_f64.powi(32);
    let is_kept = |i: usize| f64::from((i as u32).wrapping_mul(0x9E37_79B9)) < threshold;
    let kept: Vec<usize> = (0..total).filter(|&i| is_kept(i)).collect();
    let finite = |v: f32| if v.is_finite() { v } else { 0.0 };
    let at = |i: usize| [0, 1, 2].map(|k| finite(lidar.points[i][k]));
    let farthest = kept
        .iter()
        .flat_map(|&i| at(i))
        .fold(1.0, |m: f32, v| m.max(v.abs()));
    let unit_m = farthest / 32_000.0;
    let times: Vec<i64> = lidar.ply.iter().map(|p| p.point.time_ns).collect();
    let first = times.iter().min().copied().unwrap_or(0);
    let last = times.iter().max().copied().unwrap_or(0);
    let mut data = Vec::new();
    for k in 0..3 {
        for &i in &kept {
            data.extend(((at(i)[k] / unit_m) as i16).to_le_bytes());
        }
    }
    let instance = |i: usize| lidar.labels.get(i).map_or(0, |l| l.1);
    let share = |i: usize| match times.get(i) {
        Some(&t) => ((t - first) as f64 / (last - first).max(1) as f64 * 65535.0) as u16,
        None => 0,
    };
    kept.iter()
        .for_each(|&i| data.extend(instance(i).to_le_bytes()));
    kept.iter()
        .for_each(|&i| data.extend(share(i).to_le_bytes()));
    data.extend(
        kept.iter()
            .map(|&i| lidar.labels.get(i).map_or(0, |l| l.0 as u8)),
    );
    data.extend(
        kept.iter()
            .map(|&i| (255.0 * lidar.points[i][3].clamp(0.0, 1.0)) as u8),
    );
    Scan {
        name: lidar.name.clone(),
        total,
        count: kept.len(),
        unit_m,
        timed: times.len() == total,
        data: STANDARD.encode(data),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thinned_scan_is_small_and_keeps_every_ring() {
        let rings = 64;
        let scan = scan(
            &LidarFrame {
                name: "top".into(),
                points: (0..300_000)
                    .map(|i| [(i % rings) as f32, 1.0, 2.0, 0.5])
                    .collect(),
                labels: vec![(3, 9); 300_000],
                ply: Vec::new(),
            },
            1,
        );
        assert!(scan.count.abs_diff(FRAME_POINTS) < 100, "{}", scan.count);
        assert!(!scan.timed);
        let data = STANDARD.decode(&scan.data).expect("it is base64");
        assert_eq!(data.len(), 12 * scan.count);
        let mut of_ring = [0_usize; 64];
        for x in data[..2 * scan.count].chunks(2) {
            let x = f32::from(i16::from_le_bytes([x[0], x[1]])) * scan.unit_m;
            of_ring[x.round() as usize] += 1;
        }
        let mean = scan.count / rings;
        assert!(
            of_ring.iter().all(|n| n.abs_diff(mean) < mean / 4),
            "{of_ring:?}"
        );
    }

    #[test]
    fn a_scan_without_points_is_shown_as_one() {
        let empty = LidarFrame {
            name: "top".into(),
            points: Vec::new(),
            labels: Vec::new(),
            ply: Vec::new(),
        };
        assert_eq!((scan(&empty, 2).total, scan(&empty, 2).count), (0, 0));
    }
}
