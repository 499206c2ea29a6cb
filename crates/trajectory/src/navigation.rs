//! What a navigation system estimates of a body's poses.

use nemoral_scene::glam::{DQuat, DVec3};
use nemoral_scene::{ParamError, RigidTransform};
use nemoral_seed::{Domain, Draw, Key};

const WANDERING: Domain = Domain::new("trajectory.navigation.wandering");
const DRIFT: Domain = Domain::new("trajectory.navigation.drift");

/// The errors of a navigation system, with which it estimates poses; all 0 are none.
///
/// - *Wandering* errors stay within bounds and change slowly, as those of satellites and inertial
///   sensors do: first-order Gauss-Markov processes (Gelb 1974, "Applied Optimal Estimation",
///   section 2.2), whose correlation over a time t is exp(-t / `correlation_s`).
/// - *Drift* grows with the way, as that of odometry and of simultaneous localisation and mapping
///   does: random walks, which are 0 again where a loop is closed (Brownian bridges). What a
///   heading's drift does to later places is part of `drift_m`.
/// - *Misalignment* is constant: how the sensors' mounts are known to the body.
///
/// It estimates the place of a reference point on the body, about which errors of attitude turn it:
/// a sensor there stays there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NavigationParams {
    /// Standard deviation of the wandering of the place, east and north each, metres.
    pub horizontal_m: f64,
    /// That of the height, metres.
    pub vertical_m: f64,
    /// That of roll and pitch, each, radians.
    pub roll_pitch_rad: f64,
    /// That of the heading, radians.
    pub heading_rad: f64,
    /// The time constant of wandering, seconds; with 0, errors of poses are independent.
    pub correlation_s: f64,
    /// Drift of the place along each axis, metres after a metre; `k` times as much after `k²` m.
    pub drift_m: f64,
    /// Drift of the heading, radians after a metre; `k` times as much after `k²` m.
    pub heading_drift_rad: f64,
    /// The length of a loop, after which a place is recognised and drift is 0, metres; 0 if none
    /// ever is.
    pub loop_m: f64,
    /// The point on the body whose place is estimated, metres: that of the sensor that matters.
    pub reference_point_m: DVec3,
    /// A constant error of the place, in the body's axes, metres: a wrong lever arm.
    pub lever_m: DVec3,
    /// A constant error of the attitude, in the body's axes: roll, pitch and yaw, radians; the
    /// boresight angles.
    pub boresight_rad: [f64; 3],
}

impl NavigationParams {
    fn check(&self) -> Result<(), ParamError> {
        for (field, value) in [
            ("horizontal_m", self.horizontal_m),
            ("vertical_m", self.vertical_m),
            ("roll_pitch_rad", self.roll_pitch_rad),
            ("heading_rad", self.heading_rad),
            ("correlation_s", self.correlation_s),
            ("drift_m", self.drift_m),
            ("heading_drift_rad", self.heading_drift_rad),
            ("loop_m", self.loop_m),
        ] {
            ParamError::check_at_least_zero(field, value)?;
        }
        for (field, place_m) in [
            ("reference_point_m", self.reference_point_m),
            ("lever_m", self.lever_m),
        ] {
            ParamError::check(place_m.is_finite(), field, place_m, "finite")?;
        }
        let boresight_rad = DVec3::from(self.boresight_rad);
        ParamError::check(
            boresight_rad.is_finite(),
            "boresight_rad",
            boresight_rad,
            "finite",
        )
    }
}

/// The true pose of a body at a time, and the way that it has come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackPoint {
    /// Seconds; they never decrease.
    pub time_s: f64,
    /// The way that it has come, metres, from any start; it never decreases.
    pub travelled_m: f64,
    /// Its pose in the world.
    pub world_from_body: RigidTransform,
}

impl TrackPoint {
    /// Poses at times, with straight ways from each to the next.
    #[must_use]
    pub fn along(poses: &[(f64, RigidTransform)]) -> Vec<Self> {
        let (mut travelled_m, mut before_m) = (0.0, None);
        let point = |&(time_s, world_from_body): &(f64, RigidTransform)| {
            let at_m = world_from_body.translation_m;
            travelled_m += before_m
                .replace(at_m)
                .map_or(0.0, |before| at_m.distance(before));
            Self {
                time_s,
                travelled_m,
                world_from_body,
            }
        };
        poses.iter().map(point).collect()
    }
}

/// Estimates poses, with errors.
#[derive(Clone, Debug)]
pub struct Navigation {
    params: NavigationParams,
    wandering: Key,
    drift: Key,
}

impl Navigation {
    /// A navigation system whose errors are those of `key`.
    ///
    /// # Errors
    /// If a value is below 0 or not finite.
    pub fn new(params: NavigationParams, key: Key) -> Result<Self, ParamError> {
        params.check()?;
        Ok(Self {
            params,
            wandering: key.domain(WANDERING),
            drift: key.domain(DRIFT),
        })
    }

    /// The poses that it estimates of a body with these true ones, in their order. The first ones
    /// do not depend on later ones.
    #[must_use]
    pub fn estimated<'a>(&self, truth: &'a [TrackPoint]) -> Vec<RigidTransform> {
        let mut wandering = [0.0; 6];
        let mut drift = Drift::default();
        let mut before: Option<&'a TrackPoint> = None;
        let estimate = |(number, now): (usize, &'a TrackPoint)| {
            let (passed_s, travelled_m) = match before.replace(now) {
                // The first errors are as independent as those after a long time.
                None => (f64::INFINITY, 0.0),
                Some(before) => (
                    (now.time_s - before.time_s).max(0.0),
                    (now.travelled_m - before.travelled_m).max(0.0),
                ),
            };
            let constant_s = self.params.correlation_s;
            let correlation = if constant_s > 0.0 {
                libm::exp(-passed_s / constant_s)
            } else {
                0.0
            };
            let new = libm::sqrt(1.0 - correlation * correlation);
            let mut rng = self.wandering.item(number as u64).rng();
            for error in &mut wandering {
                *error = correlation * *error + new * rng.normal();
            }
            let mut rng = self.drift.item(number as u64).rng();
            let steps = std::array::from_fn(|_| rng.normal());
            drift.go_on(travelled_m, self.params.loop_m, steps);
            self.with_errors(now.world_from_body, wandering, drift.errors)
        };
        truth.iter().enumerate().map(estimate).collect()
    }

    /// A pose with errors in units of their deviations: east, north, up, roll, pitch, heading of
    /// wandering; east, north, up, heading of drift.
    fn with_errors(
        &self,
        pose: RigidTransform,
        wandering: [f64; 6],
        drift: [f64; 4],
    ) -> RigidTransform {
        let p = &self.params;
        let [east, north, up, roll, pitch, heading] = wandering;
        let of_place = DVec3::new(
            p.horizontal_m * east + p.drift_m * drift[0],
            p.horizontal_m * north + p.drift_m * drift[1],
            p.vertical_m * up + p.drift_m * drift[2],
        );
        let [roll, pitch] = [roll, pitch].map(|angle| p.roll_pitch_rad * angle);
        let heading = p.heading_rad * heading + p.heading_drift_rad * drift[3];
        let [bore_roll, bore_pitch, bore_yaw] = p.boresight_rad;
        let turned =
            |roll, pitch, yaw| RigidTransform::from_xyz_rpy(DVec3::ZERO, roll, pitch, yaw).rotation;
        let rotation = DQuat::from_rotation_z(heading)
            * pose.rotation
            * turned(roll, pitch, 0.0)
            * turned(bore_roll, bore_pitch, bore_yaw);
        let rotation = rotation.normalize();
        let point_m = pose.transform_point(p.reference_point_m + p.lever_m) + of_place;
        RigidTransform {
            rotation,
            translation_m: point_m - rotation * p.reference_point_m,
        }
    }
}

/// Random walks with the way, of deviation 1 after a metre.
#[derive(Clone, Copy, Debug, Default)]
struct Drift {
    /// The way since the last loop was closed, metres.
    since_m: f64,
    errors: [f64; 4],
}

impl Drift {
    /// Goes on by some metres; `loop_m` is 0 if no loop is ever closed.
    fn go_on(&mut self, travelled_m: f64, loop_m: f64, steps: [f64; 4]) {
        if loop_m == 0.0 {
            let deviation = libm::sqrt(travelled_m);
            for (error, step) in self.errors.iter_mut().zip(steps) {
                *error += deviation * step;
            }
            return;
        }
        let mut to_m = self.since_m + travelled_m;
        if to_m >= loop_m {
            to_m %= loop_m;
            *self = Self::default();
        }
        // A Brownian bridge, given where it is and that it ends at 0.
        let left = (loop_m - to_m) / (loop_m - self.since_m);
        let deviation = libm::sqrt((to_m - self.since_m) * left);
        for (error, step) in self.errors.iter_mut().zip(steps) {
            *error = left * *error + deviation * step;
        }
        self.since_m = to_m;
    }
}
