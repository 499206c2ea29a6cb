//! `--frames` and `--shard`.

use std::collections::BTreeSet;
use std::str::FromStr;

/// What `--frames` asks for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Frames {
    /// `N`: the sequence has N frames, make all of them.
    Length(u64),
    /// `A..B` or a list: make these of the sequence's frames.
    These(Vec<u64>),
}

impl FromStr for Frames {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |word: &str| {
            word.trim()
                .parse::<u64>()
                .map_err(|_| format!("{word:?}: must be a frame's number, 0 or more"))
        };
        if let Some((from, to)) = text.split_once("..") {
            let (from, to) = (number(from)?, number(to)?);
            if from >= to {
                return Err(format!("{text}: holds no frame; A..B ends before B"));
            }
            return Ok(Self::These((from..to).collect()));
        }
        if text.contains(',') {
            let list = text
                .split(',')
                .map(number)
                .collect::<Result<BTreeSet<_>, _>>()?;
            return Ok(Self::These(list.into_iter().collect()));
        }
        match number(text)? {
            0 => Err("0: must be at least 1".to_owned()),
            n => Ok(Self::Length(n)),
        }
    }
}

/// `--shard I/N`: the Ith of N equal parts, I from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shard {
    index: u64,
    count: u64,
}

impl Shard {
    /// The frames of this shard: whole frames in blocks, so that a worker's chunks stay together.
    pub(crate) fn of(self, frames: &[u64]) -> Vec<u64> {
        let n = frames.len() as u64;
        let cut = |i: u64| (n * i / self.count) as usize;
        frames[cut(self.index)..cut(self.index + 1)].to_vec()
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text
            .split_once('/')
            .and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match parts {
            Some((index, count)) if index < count => Ok(Self { index, count }),
            _ => Err(format!("{text:?}: must be I/N with I from 0 to N - 1")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_in_three_ways() {
        assert_eq!("12".parse(), Ok(Frames::Length(12)));
        assert_eq!("3..6".parse(), Ok(Frames::These(vec![3, 4, 5])));
        assert_eq!("9, 2,2".parse(), Ok(Frames::These(vec![2, 9])));
        for bad in ["", "0", "x", "5..5", "6..2", "1,,2", "-1"] {
            assert!(bad.parse::<Frames>().is_err(), "{bad}");
        }
    }

    #[test]
    fn shards_share_the_frames() {
        let frames: Vec<u64> = (5..28).collect();
        for count in 1..30 {
            let shards = (0..count).flat_map(|index| Shard { index, count }.of(&frames));
            assert_eq!(shards.collect::<Vec<_>>(), frames);
        }
        assert_eq!("1/4".parse(), Ok(Shard { index: 1, count: 4 }));
        for bad in ["4/4", "1", "a/b", "0/0", "-1/2"] {
            assert!(bad.parse::<Shard>().is_err(), "{bad}");
        }
    }
}
