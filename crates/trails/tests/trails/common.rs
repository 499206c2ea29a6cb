//! Grounds and trails for tests.

use std::sync::Arc;

use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, FlatSurface, Surface, SurfaceSample};
use nemoral_seed::Key;
use nemoral_trails::{CrossSection, TrailParams, TrailPath, Trails, WayKind};

pub(crate) const SIZE_M: f64 = 50.0;

/// Hills of sines, which are smooth and have slopes of up to about `steepness`.
pub(crate) struct Hills {
    pub(crate) steepness: f64,
}

impl Surface for Hills {
    fn sample(&self, p: DVec2) -> SurfaceSample {
        let mut sample = SurfaceSample {
            height_m: 50.0,
            gradient: DVec2::ZERO,
        };
        for (share, k, phase) in [
            (0.5, DVec2::new(0.021, 0.013), 0.3),
            (0.3, DVec2::new(-0.017, 0.038), 1.1),
            (0.2, DVec2::new(0.081, 0.035), 2.0),
        ] {
            let angle: f64 = k.dot(p) + phase;
            let amplitude = share * self.steepness / k.length();
            sample.height_m += amplitude * angle.sin();
            sample.gradient += amplitude * angle.cos() * k;
        }
        sample
    }
}

pub(crate) fn flat(slope: DVec2) -> Arc<dyn Surface> {
    Arc::new(FlatSurface {
        height_m: 10.0,
        gradient: slope,
    })
}

pub(crate) fn hills(steepness: f64) -> Arc<dyn Surface> {
    Arc::new(Hills { steepness })
}

/// A flat section.
pub(crate) fn plain() -> CrossSection {
    CrossSection {
        crossfall: 0.0,
        crown: 0.0,
        ruts: None,
        ..CrossSection::default()
    }
}

pub(crate) fn trails(params: TrailParams, seed: u64, base: Arc<dyn Surface>) -> Trails {
    Trails::new(params, SIZE_M, Key::world(seed), base).expect("valid")
}

/// Chunks of a square around a chunk.
pub(crate) fn around(centre: ChunkCoord, n: i32) -> impl Iterator<Item = ChunkCoord> {
    (-n..=n).flat_map(move |x| (-n..=n).map(move |y| centre.offset(x, y)))
}

/// A world with given lines only: each with the way's number.
pub(crate) fn given(
    ways: Vec<(WayKind, f64)>,
    lines: &[(usize, [DVec2; 2])],
    base: Arc<dyn Surface>,
) -> Trails {
    let params = TrailParams {
        spawn_probability: 0.0,
        ways,
        ..TrailParams::default()
    };
    let none = trails(params, 5, base);
    (lines.iter()).fold(none, |t, (way, line)| {
        t.along(&[line.to_vec()], *way).expect("finite")
    })
}

/// A straight way towards the north through the origin.
pub(crate) fn northward(way: WayKind, base: Arc<dyn Surface>) -> (Trails, Arc<TrailPath>) {
    let line = [DVec2::new(3.0, -120.0), DVec2::new(3.0, 120.0)];
    let trails = given(vec![(way, 1.0)], &[(0, line)], base);
    let (path, _) = trails.nearest(DVec2::ZERO, 20.0).expect("it is near");
    (trails, path)
}

/// All kinds of way, with their shares.
pub(crate) fn all_ways() -> Vec<(WayKind, f64)> {
    vec![
        (WayKind::forest_road(), 1.0),
        (WayKind::default(), 1.0),
        (WayKind::skid_trail(), 1.0),
        (WayKind::firebreak(), 0.5),
        (WayKind::footpath(), 2.0),
        (WayKind::deer_path(), 1.0),
    ]
}

/// Trails of all kinds.
pub(crate) fn mixed() -> TrailParams {
    TrailParams {
        spawn_probability: 0.1,
        max_length_chunks: 14,
        ways: all_ways(),
        ..TrailParams::default()
    }
}

/// Many trails of the default kind, some with branches, on hills.
pub(crate) fn dense(seed: u64) -> Trails {
    let params = TrailParams {
        spawn_probability: 0.1,
        max_length_chunks: 12,
        fork_probability: 0.15,
        ..TrailParams::default()
    };
    trails(params, seed, hills(0.3))
}

/// Points along a path, with arc lengths.
pub(crate) fn points(path: &TrailPath, step_m: f64) -> impl Iterator<Item = (f64, DVec2)> + '_ {
    let n = (path.length_m() / step_m) as usize;
    (0..=n).map(move |i| {
        let s = i as f64 / n as f64 * path.length_m();
        (s, path.position_m(s))
    })
}
