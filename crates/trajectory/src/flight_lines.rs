//! Parallel lines above an area, along which drones and aircraft fly surveys.

use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_scene::{ParamError, RigidTransform};
use nemoral_seed::Key;

use crate::spline::CubicBSpline;
use crate::sway::Sway;

/// Distance between knots of the height along a line, metres.
const KNOT_M: f64 = 20.0;
/// Rows across the line in which the ground is looked at, between two knots.
const ROWS: usize = 2;
/// Distance between rows, and at most between the places where the ground is looked at in them,
/// metres.
const LOOK_M: f64 = KNOT_M / ROWS as f64;

/// What the altitude of a flight follows on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AltitudeMode {
    /// The ground, smoothly.
    Ground,
    /// A level above the highest ground of all lines.
    Level,
}

/// Parameters of [`FlightLines`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlightLinesParams {
    /// The middle of the area on the map, metres.
    pub middle_m: DVec2,
    /// The direction of the first line, of any length above 0.
    pub forward: DVec2,
    /// The extent of the area along the lines, metres; above 0.
    pub length_m: f64,
    /// The extent of the area across the lines, metres; 0 for a single line.
    pub width_m: f64,
    /// How far lines reach beyond the area at both ends, metres.
    pub margin_m: f64,
    /// Distance between neighbouring lines, metres; above 0. There are as many as cover the width,
    /// so that the outermost may lie outside of the area. The ground is looked at within half of it
    /// to both sides of a line, also of a single one.
    pub line_spacing_m: f64,
    /// Whether a second set of lines follows, at right angles to the first.
    pub is_crossed: bool,
    /// Height above what is followed, metres.
    pub height_m: f64,
    /// What the heights are above.
    pub follow: AltitudeMode,
    /// Speed, metres per second; above 0.
    pub speed_m_s: f64,
    /// The time of a frame, seconds; above 0. Frames follow each other without gaps on a line.
    pub step_s: f64,
    /// Time between the end of a line and the start of the next, seconds.
    pub turn_s: f64,
    /// The standard deviation of roll and pitch, radians. That of the heading is twice as large.
    pub sway_rad: f64,
}

impl FlightLinesParams {
    /// Checks the values.
    ///
    /// # Errors
    /// If one is out of its range.
    pub fn check(&self) -> Result<(), ParamError> {
        let is_direction = self.forward.is_finite() && self.forward.length() > 0.0;
        ParamError::check(
            is_direction,
            "forward",
            self.forward,
            "finite and longer than 0",
        )?;
        let is_place = self.middle_m.is_finite();
        ParamError::check(is_place, "middle_m", self.middle_m, "finite")?;
        for (field, value) in [
            ("length_m", self.length_m),
            ("line_spacing_m", self.line_spacing_m),
            ("speed_m_s", self.speed_m_s),
            ("step_s", self.step_s),
        ] {
            ParamError::check_positive(field, value)?;
        }
        for (field, value) in [
            ("width_m", self.width_m),
            ("margin_m", self.margin_m),
            ("height_m", self.height_m),
            ("turn_s", self.turn_s),
            ("sway_rad", self.sway_rad),
        ] {
            ParamError::check_at_least_zero(field, value)?;
        }
        let most = 1e7;
        let frames = self.sets().map(|set| set.lines as f64 * set.frames as f64);
        let frames = frames.sum::<f64>();
        let allowed = "long enough for at most 10,000,000 frames";
        ParamError::check(frames <= most, "step_s", self.step_s, allowed)?;
        // The ground below is looked at all along, and aside, before the first frame.
        let most_m = 1e7;
        let frame_m = self.speed_m_s * self.step_s;
        let allowed = "wide enough for at most 10,000 km of lines";
        let spacing_m = self.line_spacing_m;
        ParamError::check(
            frames * frame_m <= most_m,
            "line_spacing_m",
            spacing_m,
            allowed,
        )?;
        let lines: f64 = self.sets().map(|set| set.lines as f64).sum();
        let rows = frames * frame_m / LOOK_M + lines * (5 * ROWS) as f64;
        let looks = rows * (2.0 * looks_aside(spacing_m) + 1.0);
        let allowed = "narrow enough to look at the ground below in at most 10,000,000 places";
        ParamError::check(looks <= 1e7, "line_spacing_m", spacing_m, allowed)
    }

    /// The number of frames of all lines.
    #[must_use]
    pub fn frames(&self) -> u64 {
        let of_sets = self.sets().map(|set| set.lines.saturating_mul(set.frames));
        of_sets.fold(0, u64::saturating_add)
    }

    /// The sets of parallel lines: one, or two that cross.
    fn sets(&self) -> impl Iterator<Item = LineSet> {
        let forward = self.forward.normalize_or(DVec2::X);
        let set = |forward, length_m: f64, width_m: f64| {
            let way_m = length_m + 2.0 * self.margin_m;
            let frame_m = self.speed_m_s * self.step_s;
            LineSet {
                forward,
                lines: enough(width_m / self.line_spacing_m).saturating_add(1),
                frames: enough(way_m / frame_m).max(1),
            }
        };
        let first = set(forward, self.length_m, self.width_m);
        let across = (self.is_crossed && self.width_m > 0.0)
            .then(|| set(-forward.perp(), self.width_m, self.length_m));
        std::iter::once(first).chain(across)
    }
}

/// The whole number that is at least this much, but for a rounding error.
fn enough(x: f64) -> u64 {
    (x - 1e-6).ceil().max(0.0) as u64
}

/// In how many places to either side of a line the ground is looked at.
fn looks_aside(spacing_m: f64) -> f64 {
    (spacing_m / 2.0 / LOOK_M).ceil().max(1.0)
}

/// Parallel lines.
#[derive(Clone, Copy, Debug)]
struct LineSet {
    forward: DVec2,
    lines: u64,
    frames: u64,
}

/// Flight lines, flown one after the other in alternating directions, as one mows a lawn.
///
/// Frames are on the lines alone: sensors are off in the turns between them. A frame's time is the
/// middle of its stretch of a line, so that scans which take [`FlightLinesParams::step_s`] cover
/// each line once, without gaps.
///
/// Following the ground, a line is a B-spline above the highest ground within a knot ahead, a knot
/// behind, and half the lines' spacing to both sides, so that the height above the ground below is
/// rarely less than asked for.
#[derive(Clone, Debug)]
pub struct FlightLines {
    params: FlightLinesParams,
    lines: Vec<Line>,
    sway: Sway,
}

#[derive(Clone, Debug)]
struct Line {
    first_frame: u64,
    /// The time at its first frame's start, seconds.
    start_s: f64,
    middle_m: DVec2,
    forward: DVec2,
    /// Half the length of its frames, metres.
    half_m: f64,
    /// Heights by knots, of which the second is at the line's start.
    heights_m: CubicBSpline<Vec<f64>>,
}

impl FlightLines {
    /// The lines above a ground, whose height at a place on the map, metres, `ground_m` tells.
    ///
    /// # Errors
    /// As [`FlightLinesParams::check`].
    pub fn new(
        params: FlightLinesParams,
        ground_m: impl Fn(DVec2) -> f64,
        key: Key,
    ) -> Result<Self, ParamError> {
        params.check()?;
        let mut lines: Vec<Line> = Vec::new();
        let (mut first_frame, mut start_s) = (0, 0.0);
        for set in params.sets() {
            for i in 0..set.lines {
                let back = i % 2 == 1;
                let forward = if back { -set.forward } else { set.forward };
                let place = i as f64 - (set.lines - 1) as f64 / 2.0;
                let spacing_m = params.line_spacing_m;
                let line = Line {
                    first_frame,
                    start_s,
                    // From left to right of the first line's direction.
                    middle_m: params.middle_m - set.forward.perp() * (place * spacing_m),
                    forward,
                    half_m: 0.5 * set.frames as f64 * params.step_s * params.speed_m_s,
                    heights_m: CubicBSpline {
                        controls: Vec::new(),
                    },
                };
                let heights_m = line.highest_ground_m(spacing_m, &ground_m);
                lines.push(Line { heights_m, ..line });
                first_frame += set.frames;
                start_s += set.frames as f64 * params.step_s + params.turn_s;
            }
        }
        let grounds_m = lines.iter().flat_map(|line| &line.heights_m.controls);
        let highest_m = grounds_m.copied().fold(f64::MIN, f64::max);
        for z in lines
            .iter_mut()
            .flat_map(|line| &mut line.heights_m.controls)
        {
            let followed_m = match params.follow {
                AltitudeMode::Ground => *z,
                AltitudeMode::Level => highest_m,
            };
            *z = followed_m + params.height_m;
        }
        Ok(Self {
            params,
            lines,
            sway: Sway::new(params.sway_rad, key),
        })
    }

    /// The number of frames of all lines.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.params.frames()
    }

    /// The first frame of each line, in order.
    pub fn first_frames(&self) -> impl Iterator<Item = u64> {
        self.lines.iter().map(|line| line.first_frame)
    }

    /// Whether a frame is the first of a line.
    #[must_use]
    pub fn starts_line(&self, frame: u64) -> bool {
        self.line_of(frame).first_frame == frame
    }

    /// A frame's time, seconds.
    #[must_use]
    pub fn time_s(&self, frame: u64) -> f64 {
        let line = self.line_of(frame);
        line.start_s + ((frame - line.first_frame) as f64 + 0.5) * self.params.step_s
    }

    /// The body's pose some time after a frame's; beyond the ends of its line it flies straight on.
    #[must_use]
    pub fn pose(&self, frame: u64, offset_s: f64) -> RigidTransform {
        let line = self.line_of(frame);
        let time_s = self.time_s(frame) + offset_s;
        let along_m = (time_s - line.start_s) * self.params.speed_m_s;
        let position_m = line.middle_m + line.forward * (along_m - line.half_m);
        let [roll_rad, pitch_rad, yaw_rad] = self.sway.at(time_s);
        RigidTransform::from_xyz_rpy(
            DVec3::from((position_m, line.height_m(along_m))),
            roll_rad,
            pitch_rad,
            line.forward.to_angle() + yaw_rad,
        )
    }

    fn line_of(&self, frame: u64) -> &Line {
        let after = self.lines.partition_point(|line| line.first_frame <= frame);
        &self.lines[after.max(1) - 1]
    }
}

impl Line {
    /// The highest ground around each knot.
    fn highest_ground_m(
        &self,
        spacing_m: f64,
        ground_m: &impl Fn(DVec2) -> f64,
    ) -> CubicBSpline<Vec<f64>> {
        let spans = enough(2.0 * self.half_m / KNOT_M).max(1) as usize;
        // The ground is looked at in rows across the line, from a knot before the first one on.
        let aside = looks_aside(spacing_m);
        let row = |i: usize| {
            let along_m = i as f64 * LOOK_M - 2.0 * KNOT_M - self.half_m;
            let middle_m = self.middle_m + self.forward * along_m;
            let looks = (-(aside as i32)..=aside as i32).map(|j| {
                let aside_m = f64::from(j) / aside * spacing_m / 2.0;
                ground_m(middle_m + self.forward.perp() * aside_m)
            });
            looks.fold(f64::MIN, f64::max)
        };
        let rows: Vec<f64> = (0..=(spans + 4) * ROWS).map(row).collect();
        let around = rows.windows(2 * ROWS + 1).step_by(ROWS);
        let highest_m = around.map(|rows| rows.iter().copied().fold(f64::MIN, f64::max));
        CubicBSpline {
            controls: highest_m.collect(),
        }
    }

    /// The height at a way along the line; beyond its ends as at them.
    fn height_m(&self, along_m: f64) -> f64 {
        let knots = (self.heights_m.controls.len() - 3) as f64;
        self.heights_m.at((along_m / KNOT_M).clamp(0.0, knots))
    }
}
