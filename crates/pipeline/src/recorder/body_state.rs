//! Where, when and how a body moves whose sensors record.

use nemoral_scene::{RigidTransform, Twist};
use nemoral_seed::{Domain, Key};

use crate::Error;

/// The noise of what is observed without an index.
const OBSERVATION: Domain = Domain::new("pipeline.observation");

/// A place and a time at which the robot's sensors record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyState {
    /// The body's pose in the world at that time.
    pub world_from_body: RigidTransform,
    /// How the body moves around that time, in its own axes.
    pub motion: Twist,
    /// Seconds after the start of the sequence: it decides where scan patterns are.
    pub time_s: f64,
    /// The number that keys the sensors' noise; without one, pose and time do.
    pub index: Option<u64>,
}

/// The greatest distance of a pose from the world's origin along each axis, metres.
const FARTHEST_M: f64 = 1e8;

impl BodyState {
    /// Refuses what is no turn, and places and times that are too far.
    pub(super) fn check(&self) -> Result<(), Error> {
        let RigidTransform {
            rotation,
            translation_m,
        } = self.world_from_body;
        if !rotation.is_normalized() {
            let message = format!("rotation = {rotation}: must be a unit quaternion");
            return Err(Error::request(message));
        }
        if translation_m.abs().max_element() > FARTHEST_M || !translation_m.is_finite() {
            let message = format!("translation_m = {translation_m}: must be within 1e8 m");
            return Err(Error::request(message));
        }
        if !(0.0..=1e9).contains(&self.time_s) {
            return Err(Error::request(format!(
                "time_s = {}: must be 0..=1e9",
                self.time_s
            )));
        }
        Ok(())
    }
}

/// The number that keys the noise of an observation whose state has no index.
pub(super) fn noise_of(state: &BodyState) -> u64 {
    let rows = state.world_from_body.to_rows();
    let numbers = rows.as_flattened().iter().chain([&state.time_s]);
    // -0 is 0.
    let mut key = Key::world(0).domain(OBSERVATION);
    for number in numbers {
        key = key.item((number + 0.0).to_bits());
    }
    key.to_u64()
}
