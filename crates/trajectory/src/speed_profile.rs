//! How fast a body drives, and when frames are.

use nemoral_scene::ParamError;

/// The speed of a body, and the interval of frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedProfile {
    /// Distance between frames at full speed, metres.
    pub spacing_m: f64,
    /// Time between frames, seconds; 0 to use the distance instead.
    pub spacing_s: f64,
    /// Speed, metres per second; above 0.
    pub speed_m_s: f64,
    /// How long the body is at rest before it sets out, seconds. It speeds up from there; with 0 it
    /// has its speed from the start.
    pub rest_s: f64,
}

impl SpeedProfile {
    /// Checks the values.
    ///
    /// # Errors
    /// If the speed is not above 0, or another value is negative or not finite.
    pub fn check(&self) -> Result<(), ParamError> {
        ParamError::check_positive("pace.speed_m_s", self.speed_m_s)?;
        ParamError::check_at_least_zero("pace.spacing_m", self.spacing_m)?;
        ParamError::check_at_least_zero("pace.spacing_s", self.spacing_s)?;
        ParamError::check_at_least_zero("pace.rest_s", self.rest_s)
    }

    /// The time between frames, seconds.
    #[must_use]
    pub fn step_s(&self) -> f64 {
        if self.spacing_s > 0.0 {
            self.spacing_s
        } else {
            self.spacing_m / self.speed_m_s
        }
    }

    /// A frame's time, seconds.
    #[must_use]
    pub fn time_s(&self, frame: u64) -> f64 {
        if self.spacing_s > 0.0 {
            frame as f64 * self.spacing_s
        } else {
            frame as f64 * self.spacing_m / self.speed_m_s
        }
    }

    /// The number of frames until the body has come so many metres, at least those on which it
    /// speeds up; all that can be if there is no interval.
    #[must_use]
    pub fn frames_in_m(&self, travelled_m: f64) -> u64 {
        let driving_m = if self.rest_s > 0.0 {
            let late_m = sped_up::way_m(self.speed_m_s);
            travelled_m.max(late_m) + late_m
        } else {
            travelled_m
        };
        let last_s = self.rest_s + driving_m / self.speed_m_s;
        (last_s / self.step_s()).ceil() as u64
    }

    /// The way that the body has come at a time, metres.
    #[must_use]
    pub fn travelled_m(&self, time_s: f64) -> f64 {
        if self.rest_s <= 0.0 {
            return self.speed_m_s * time_s;
        }
        let driving_s = time_s - self.rest_s;
        let full_m = 2.0 * sped_up::way_m(self.speed_m_s);
        let full_s = full_m / self.speed_m_s;
        if driving_s < full_s {
            full_m * sped_up::share((driving_s / full_s).max(0.0))
        } else {
            self.speed_m_s * driving_s - 0.5 * full_m
        }
    }
}

/// From rest to full speed, with a continuous acceleration.
pub(crate) mod sped_up {
    /// The greatest acceleration, m/s²: that of careful drivers.
    const MOST_M_S2: f64 = 1.0;

    /// The way on which a body reaches a speed, metres. It would have come twice as far in that
    /// time if it had had the speed from the start.
    pub(crate) fn way_m(speed_m_s: f64) -> f64 {
        0.75 * speed_m_s * speed_m_s / MOST_M_S2
    }

    /// The way at a share of the time, over what it would have been at full speed all the time. The
    /// speed rises as 3 x² - 2 x³.
    pub(crate) fn share(x: f64) -> f64 {
        x * x * x * (1.0 - 0.5 * x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_rests_and_speeds_up_smoothly() {
        let pace = SpeedProfile {
            spacing_m: 1.0,
            spacing_s: 0.1,
            speed_m_s: 4.0,
            rest_s: 3.0,
        };
        let at = |t: f64| pace.travelled_m(t);
        assert_eq!([at(0.0), at(-1.0), at(3.0)], [0.0; 3]);
        let frames = pace.frames_in_m(100.0);
        let last_m = at(pace.time_s(frames));
        assert!((100.0..100.0 + 0.1 * 4.0).contains(&last_m), "{last_m}");
        let h = 1e-3;
        let speed = |t: f64| (at(t + h) - at(t - h)) / (2.0 * h);
        let pull = |t: f64| (at(t + h) - 2.0 * at(t) + at(t - h)) / (h * h);
        let mut most = 0.0_f64;
        for i in 0..2000 {
            let t = 0.01 * f64::from(i);
            assert!((pull(t + 0.01) - pull(t)).abs() < 0.02, "at {t}");
            most = most.max(pull(t));
        }
        assert!((most - 1.0).abs() < 0.01, "{most}");
        assert!((speed(3.0 + 6.1) - 4.0).abs() < 1e-6 && (speed(3.0 + 3.0) - 2.0).abs() < 1e-3);
        for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let error = SpeedProfile {
                speed_m_s: wrong,
                ..pace
            };
            assert!(error.check().is_err(), "{wrong}");
        }
        assert_eq!(pace.check(), Ok(()));
        let at_once = SpeedProfile {
            rest_s: 0.0,
            ..pace
        };
        assert_eq!(at_once.travelled_m(2.5), 10.0);
    }
}
