//! Keys of what frames are chosen for.

use std::collections::BTreeMap;

use crate::schema::AllowedValues::{Real, RealAbove, Whole};
use crate::schema::{SectionSpec, section};

section! {
    /// More of what is rare. With a target, a sequence is no drive: each frame is a single view
    /// from beside the path, the best of several candidates, which differ in place and direction.
    /// Their weights follow from a pilot in the same world, never from other frames.
    Balance at "balance" {
        /// Candidates for each frame.
        candidates: u32 = 16, Whole(2, 64), "our choice: what a frame's time allows";
        /// Poses of the pilot, by which the weights are found.
        pilot: u32 = 256, Whole(64, 4096), "our choice: shares to about a tenth of themselves";
        /// Greatest distance of candidates from the frame's place on the path. Frames that are
        /// nearer to each other on the path often choose the same thing.
        reach_m: f64 = 10.0, RealAbove(0.0, 30.0), "our choice: within the chunks in view";
        /// Greatest angle between a candidate's direction and the path's, to either side.
        turn_deg: f64 = 180.0, Real(0.0, 180.0), "any direction";
        /// How near an obstacle is for the target `near_obstacles`, metres from the sensor.
        near_m: f64 = 3.0, RealAbove(0.0, 30.0), "our choice: a robot's braking distance and more";
    }
    plus {
        /// What frames are chosen for.
        targets: BTreeMap<String, f64>;
    }
}

/// What frames are chosen for, by name.
pub(super) const TARGETS: SectionSpec = SectionSpec {
    path: "balance.targets",
    doc: " What frames should show more of, and how much: `rocks = 0.05` asks that rocks are 5 % \
        of what the first camera sees within 50 m (the first LiDAR, without a camera), on average, \
        where a frame counts with at most four times that. Empty for a drive. Names are those of \
        the ontology's classes in lower case, of fine semantics, and \
        `logs` (with root plates), `rocks`, `wrapped_trunks` (trunks under ivy), and \
        `near_obstacles`: trunks, stumps, logs, and rocks within `balance.near_m`, between 0.1 and \
        1.5 m above where the robot stands. At most 16; 0 is none.",
    choice: None,
    keys: &[],
    named: Some(Real(0.0, 1.0)),
    defaults: toml::Table::new,
};

impl Balance {
    /// Whether frames are chosen rather than driven to.
    #[must_use]
    pub fn is_on(&self) -> bool {
        self.targets.values().any(|goal| *goal > 0.0)
    }
}
