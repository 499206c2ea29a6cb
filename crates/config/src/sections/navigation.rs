//! Keys of the navigation system.

use crate::schema::AllowedValues::{Flag, Real, Triple};
use crate::schema::section;

section! {
    /// The robot's navigation system: satellites and inertial sensors, or simultaneous localisation
    /// and mapping. Poses, labels and all that sensors record stay true; what the system would
    /// estimate of the poses, with its errors, is a file beside them, `poses_estimated.txt`, by
    /// which `nemoral cloud --estimated-poses` registers scans. All errors of attitude turn the
    /// body about its first LiDAR, or its first camera if there is none.
    Navigation at "navigation" {
        /// Whether data sets have what it estimates, which stations and drives do, not balanced
        /// frames.
        enabled: bool = false, Flag, "who needs it asks for it";
        /// Standard deviation of the place, east and north each.
        horizontal_m: f64 = 0.03, Real(0.0, 100.0), "a drone's, post-processed: 2 to 5 cm";
        /// Standard deviation of the height.
        vertical_m: f64 = 0.05, Real(0.0, 100.0), "a drone's, post-processed";
        /// Standard deviation of roll and pitch, each.
        roll_pitch_deg: f64 = 0.025, Real(0.0, 10.0), "Applanix APX-15";
        /// Standard deviation of the heading.
        heading_deg: f64 = 0.08, Real(0.0, 45.0), "Applanix APX-15";
        /// Time after which these four errors agree with their former values by a factor of 1/e.
        /// Those of stations are independent, and all are with 0.
        correlation_s: f64 = 100.0, Real(0.0, 1e6), "our choice: slower than a line";
        /// Drift of the place along each axis, metres after a metre; it grows with the root of the
        /// way.
        drift_m: f64 = 0.0, Real(0.0, 1.0), "satellites; backpacks and handhelds: 0.005 to 0.02";
        /// Drift of the heading, degrees after a metre; it grows with the root of the way.
        heading_drift_deg: f64 = 0.0, Real(0.0, 10.0), "satellites; handhelds: 0.02 to 0.1";
        /// Length of a loop, after which a place is recognised and drift is 0; 0 for the loop of
        /// `[robot.lanes]`, and for none on other paths. Where it is longer than the way, as 1e6,
        /// no loop is closed.
        loop_m: f64 = 0.0, Real(0.0, 1e6), "lanes end near where they begin";
        /// Error of the lever arm: forward, left, up.
        lever_m: [f64; 3] = [0.0; 3], Triple(-10.0, 10.0), "well measured";
        /// Boresight angles, by which the sensors' mounts are known wrongly: roll, pitch, yaw.
        boresight_deg: [f64; 3] = [0.0; 3], Triple(-10.0, 10.0), "well calibrated";
    }
}
