//! How deep snow lies on the ground.

use nemoral_scene::glam::DVec2;
use nemoral_scene::{Surface, SurfaceSample};

use super::assets::LyingSnow;
use super::chunk_ground::ChunkGround;

/// The depth of trodden snow over that beside the trail (our choice).
const TRODDEN: f64 = 0.35;
/// Less snow than this does not hide the ground, metres; and where all of it is thin, less than
/// this share of its depth in the open.
const HIDES_M: f64 = 0.015;
const HIDES: f64 = 0.3;
/// The slopes over which snow slides off, metres per metre: 50 and 60 degrees.
const SLIDES: [f64; 2] = [1.19, 1.73];
/// The step of differences for its slope, metres.
const STEP_M: f64 = 0.02;

/// Snow over the ground of a chunk.
pub(crate) struct SnowCover<'a, S> {
    ground: &'a ChunkGround,
    /// The ground below it.
    below: &'a S,
    /// Its depth on level ground in the open, metres.
    depth_m: f64,
    /// The share of that depth that lies under crowns.
    under_crowns: f64,
}

impl<'a, S: Surface> SnowCover<'a, S> {
    /// The snow of a world on the ground of a chunk, whose surface is `below`.
    pub(crate) fn new(snow: &LyingSnow, ground: &'a ChunkGround, below: &'a S) -> Self {
        Self {
            ground,
            below,
            depth_m: snow.depth_m,
            under_crowns: snow.under_crowns,
        }
    }

    /// The depth of snow at a place, metres. It is none at the edge of water, less on trails, under
    /// crowns and on slopes, and uneven as wind leaves it.
    pub(crate) fn depth_m(&self, p: DVec2) -> f64 {
        self.depth_on(p, self.below.sample(p).gradient)
    }

    /// Whether it hides what lies below.
    pub(crate) fn hides(&self, p: DVec2) -> bool {
        self.depth_m(p) > HIDES_M.min(HIDES * self.depth_m)
    }

    fn depth_on(&self, p: DVec2, gradient: DVec2) -> f64 {
        let ground = self.ground;
        let trodden = TRODDEN + (1.0 - TRODDEN) * smooth(-0.5, 0.9, ground.trail_edge_m(p));
        let open = smooth(-3.0, 4.0, ground.open_m(p));
        let shelter = self.under_crowns + (1.0 - self.under_crowns) * open;
        let shore = smooth(0.05, 0.6, ground.bank_m(p).min(ground.puddle_edge_m(p)));
        let [holds, slides] = SLIDES;
        let lies = 1.0 - smooth(holds, slides, gradient.length());
        self.depth_m * trodden * shelter * shore * lies * drift(p)
    }
}

impl<S: Surface> Surface for SnowCover<'_, S> {
    fn sample(&self, p: DVec2) -> SurfaceSample {
        let below = self.below.sample(p);
        let depth = |p: DVec2| self.depth_on(p, below.gradient);
        let here = depth(p);
        let slope = |step: DVec2| (depth(p + step) - here) / STEP_M;
        SurfaceSample {
            height_m: below.height_m + here,
            gradient: below.gradient
                + DVec2::new(slope(DVec2::X * STEP_M), slope(DVec2::Y * STEP_M)),
        }
    }
}

/// Drifts of metres, about 1.
fn drift(p: DVec2) -> f64 {
    let wave = |x: f64, y: f64| libm::sin(x + 1.3 * libm::sin(y));
    1.0 + 0.14 * wave(0.61 * p.x + 0.3 * p.y, 0.47 * p.y) + 0.06 * wave(1.9 * p.y, 1.7 * p.x + 0.4)
}

/// A smooth step from 0 at `from` to 1 at `to`.
fn smooth(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
