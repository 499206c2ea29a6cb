//! The pilot: what views of a world show without balance, and the weights that follow.

use nemoral_dataset::{BalanceRecord, BalanceTarget};
use nemoral_seed::Key;

use super::weights::{self, CAP, MOST, capped, mean};
use super::{BalanceRecipe, Land, PILOT, WorldAssets};
use crate::Error;
use crate::world::lidars::LidarRig;
use crate::world::trajectory::RobotTrajectory;

/// Distance between the pilot's places on the path, metres, and the most of them.
const STEP_M: f64 = 20.0;
const PLACES: u32 = 32;

/// The weights of a world's targets, and the shares from which they follow.
#[derive(Clone, Debug, PartialEq)]
pub struct Pilot {
    /// How many poses it has.
    pub poses: u32,
    /// How many candidates a frame has.
    pub candidates: u32,
    /// The targets, in order of their names.
    pub targets: Vec<BalanceTarget>,
}

impl BalanceRecipe {
    /// Looks around at places along the path's beginning.
    pub(crate) fn pilot(
        &self,
        trajectory: &RobotTrajectory,
        (assets, lidars): (&WorldAssets, &[LidarRig]),
        land: Land<'_>,
        world: Key,
    ) -> Result<Pilot, Error> {
        let looker = self.looker(&assets.library.materials, lidars)?;
        let groups = self.balance.pilot.div_ceil(self.balance.candidates);
        let places = groups.min(PLACES);
        let mut shares: Vec<Vec<Vec<f64>>> = Vec::new();
        for place in 0..places {
            let after_s = f64::from(place) * STEP_M / trajectory.trajectory.pace.speed_m_s;
            let on_path = trajectory.pose_2d(0, after_s, land.surroundings)?;
            let scene = looker.scene(on_path, land)?;
            for group in (place..groups).step_by(places as usize) {
                let key = world.domain(PILOT).item(u64::from(group));
                let stands = looker.candidates(on_path, trajectory, land, key)?;
                let viewed = looker.view(&scene, stands);
                shares.push(viewed.into_iter().map(|(_, shares)| shares).collect());
            }
        }
        let targets = self.targets();
        let goals: Vec<f64> = targets.iter().map(|t| t.goal).collect();
        let of_group = |group: &Vec<Vec<f64>>| group.iter().map(|s| capped(s, &goals)).collect();
        let groups: Vec<Vec<Vec<f64>>> = shares.iter().map(of_group).collect();
        let found = weights::weights(&groups, goals.len());
        let none = vec![0.0; goals.len()];
        let target = |(t, target): (usize, &crate::config::BalanceTarget)| BalanceTarget {
            name: target.name.clone(),
            goal: target.goal,
            before: mean(&groups, &none, |g, j| shares[g][j][t]),
            expected: mean(&groups, &found, |g, j| shares[g][j][t]),
            weight: found[t],
        };
        Ok(Pilot {
            poses: shares.iter().map(|g| g.len() as u32).sum(),
            candidates: self.balance.candidates,
            targets: targets.iter().enumerate().map(target).collect(),
        })
    }
}

impl Pilot {
    /// What a data set keeps of it.
    #[must_use]
    pub fn record(&self) -> BalanceRecord {
        BalanceRecord {
            candidates: self.candidates,
            pilot_poses: self.poses,
            cap: CAP,
            targets: self.targets.clone(),
        }
    }

    /// What a user should know: the goals that are out of reach.
    #[must_use]
    pub fn note(&self) -> Option<String> {
        let percent = |share: f64| format!("{:.2} %", 100.0 * share);
        let missed = self.targets.iter().filter(|t| t.weight >= MOST);
        let missed: Vec<String> = missed
            .map(|t| match t.before {
                0.0 => format!("none of {} views shows {}", self.poses, t.name),
                before => format!(
                    "{} of {} is out of reach: about {}, {} without",
                    percent(t.goal),
                    t.name,
                    percent(t.expected),
                    percent(before)
                ),
            })
            .collect();
        (!missed.is_empty()).then(|| {
            format!(
                "balance: {}; more candidates, a longer reach or a world that holds more of it \
                 would help",
                missed.join("; ")
            )
        })
    }

    /// The pilot as bytes.
    pub(crate) fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = [self.poses, self.candidates].map(u32::to_le_bytes).concat();
        for t in &self.targets {
            bytes.extend((t.name.len() as u32).to_le_bytes());
            bytes.extend(t.name.as_bytes());
            for number in [t.goal, t.before, t.expected, t.weight] {
                bytes.extend(number.to_le_bytes());
            }
        }
        bytes
    }

    /// The pilot from its bytes; `None` if they are none.
    pub(crate) fn from_bytes(mut bytes: &[u8]) -> Option<Self> {
        let rest = &mut bytes;
        let (poses, candidates) = (whole(rest)?, whole(rest)?);
        let mut targets = Vec::new();
        while !rest.is_empty() {
            let length = whole(rest)? as usize;
            let name = String::from_utf8(take(rest, length)?.to_vec()).ok()?;
            let [goal, before, expected, weight] =
                [real(rest)?, real(rest)?, real(rest)?, real(rest)?];
            targets.push(BalanceTarget {
                name,
                goal,
                before,
                expected,
                weight,
            });
        }
        Some(Self {
            poses,
            candidates,
            targets,
        })
    }
}

fn take<'a>(rest: &mut &'a [u8], length: usize) -> Option<&'a [u8]> {
    let (first, others) = rest.split_at_checked(length)?;
    *rest = others;
    Some(first)
}

fn whole(rest: &mut &[u8]) -> Option<u32> {
    Some(u32::from_le_bytes(take(rest, 4)?.try_into().ok()?))
}

fn real(rest: &mut &[u8]) -> Option<f64> {
    Some(f64::from_le_bytes(take(rest, 8)?.try_into().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pilot() -> Pilot {
        let target = |name: &str, before, weight| BalanceTarget {
            name: name.to_owned(),
            goal: 0.05,
            before,
            expected: 0.1 / 3.0,
            weight,
        };
        Pilot {
            poses: 240,
            candidates: 16,
            targets: vec![target("logs", 0.0, MOST), target("rocks", 0.012, MOST)],
        }
    }

    #[test]
    fn bytes_are_the_pilot_to_the_bit() {
        let bytes = pilot().to_bytes();
        assert_eq!(Pilot::from_bytes(&bytes), Some(pilot()));
        for length in 0..bytes.len() {
            let part = Pilot::from_bytes(&bytes[..length]);
            assert_ne!(part, Some(pilot()), "{length}");
        }
    }

    #[test]
    fn what_is_out_of_reach_is_said() {
        let note = pilot().note().expect("a note");
        assert!(note.contains("none of 240 views shows logs"), "{note}");
        let rocks = "5.00 % of rocks is out of reach: about 3.33 %, 1.20 % without";
        assert!(note.contains(rocks), "{note}");
        let mut reached = pilot();
        reached.targets.iter_mut().for_each(|t| t.weight = 2.0);
        assert_eq!(reached.note(), None);
    }
}
