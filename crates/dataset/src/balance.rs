//! What was done for rare things: how often a world shows them, and where frames were taken
//! instead.

use serde::{Deserialize, Serialize};

use crate::error::shown;
use crate::{Error, limits};

/// Something of which a sequence's frames should show a certain share.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BalanceTarget {
    /// Its name in the configuration.
    pub name: String,
    /// The share that was asked for, above 0 and at most 1: the mean over frames, where a frame
    /// counts with at most [`BalanceRecord::cap`] times this share.
    pub goal: f64,
    /// The mean share of the pilot's poses, 0 to 1: what frames would show without balance.
    pub before: f64,
    /// The mean share that the pilot's poses have with the weights, 0 to 1.
    pub expected: f64,
    /// The weight of a pose's capped share over the goal, at least 0.
    pub weight: f64,
}

/// How a sequence's frames were chosen among candidate poses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BalanceRecord {
    /// Candidates for each frame.
    pub candidates: u32,
    /// Poses of the pilot, by which the weights were found: those of which the rays met anything
    /// but leaves before the lens.
    pub pilot_poses: u32,
    /// How many times the goal a frame counts with at most.
    pub cap: f64,
    /// The targets, in order of their names.
    pub targets: Vec<BalanceTarget>,
}

/// Which candidate a frame is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameChoice {
    /// Its number, from 0; absent if no candidate was fit, and the pose is that of the path.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub candidate: Option<u32>,
    /// The share of each target, in the order of the sequence's, as a few thousand rays found it
    /// before the frame was made; 0 to 1.
    pub shares: Vec<f64>,
}

fn check_share(field: &str, share: f64) -> Result<(), Error> {
    if (0.0..=1.0).contains(&share) {
        return Ok(());
    }
    Err(Error::invalid(field, share, "0 to 1"))
}

impl BalanceRecord {
    pub(crate) fn validate(&self, field: &str) -> Result<(), Error> {
        let count = self.targets.len();
        if !(1..=limits::MAX_TARGETS).contains(&count) {
            let allowed = format!("1 to {}", limits::MAX_TARGETS);
            return Err(Error::invalid(format!("{field}.targets"), count, allowed));
        }
        if !self.targets.is_sorted_by(|a, b| a.name < b.name) {
            let allowed = "in order of their names, each once";
            return Err(Error::invalid(format!("{field}.targets"), "…", allowed));
        }
        if !(self.cap >= 1.0 && self.cap.is_finite()) {
            return Err(Error::invalid(
                format!("{field}.cap"),
                self.cap,
                "1 or more",
            ));
        }
        for t in &self.targets {
            let of = |what| format!("{field}.targets.{}.{what}", shown(&t.name));
            check_share(&of("goal"), t.goal)?;
            check_share(&of("before"), t.before)?;
            check_share(&of("expected"), t.expected)?;
            if !(t.weight >= 0.0 && t.weight.is_finite()) {
                return Err(Error::invalid(of("weight"), t.weight, "0 or more"));
            }
        }
        Ok(())
    }
}

impl FrameChoice {
    /// Checks the choice of a frame whose sequence was balanced like this.
    pub(crate) fn validate(&self, field: &str, of: &BalanceRecord) -> Result<(), Error> {
        let (found, asked) = (self.shares.len(), of.targets.len());
        if found != asked {
            let allowed = format!("{asked}, one for each target");
            return Err(Error::invalid(format!("{field}.shares"), found, allowed));
        }
        if let Some(candidate) = self.candidate.filter(|&c| c >= of.candidates) {
            let allowed = format!("below {}", of.candidates);
            let field = format!("{field}.candidate");
            return Err(Error::invalid(field, candidate, allowed));
        }
        (self.shares.iter()).try_for_each(|&s| check_share(&format!("{field}.shares"), s))
    }
}
