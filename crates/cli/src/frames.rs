//! `--frames` and `--shard`.

use std::ops::Range;
use std::str::FromStr;

use nemoral_pipeline::{FrameSelection, SequenceFrames};

/// What `--frames` asks for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Frames {
    /// `N`: the sequence has N frames, all of which are made.
    Length(u64),
    /// `A..B`, or a list of frames and such ranges: these of the sequence's frames are made.
    These(FrameSelection),
}

impl FromStr for Frames {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if !text.contains(',') && !text.contains("..") {
            return match number(text)? {
                0 => Err("0: must be at least 1".to_owned()),
                n => Ok(Self::Length(n)),
            };
        }
        let ranges = text.split(',').map(range).collect::<Result<_, _>>()?;
        Ok(Self::These(ranges))
    }
}

fn number(word: &str) -> Result<u64, String> {
    word.trim()
        .parse::<u64>()
        .map_err(|_| format!("{}: must be a frame's number, 0 or more", quoted(word)))
}

/// `A..B`, or one frame.
fn range(item: &str) -> Result<Range<u64>, String> {
    match item.split_once("..") {
        None => {
            let frame = number(item)?;
            let end = frame.checked_add(1);
            end.map(|end| frame..end)
                .ok_or_else(|| format!("{frame}: no sequence has so many frames"))
        }
        Some((from, to)) => {
            let (from, to) = (number(from)?, number(to)?);
            if from >= to {
                return Err(format!(
                    "{}: holds no frame; A..B ends before B",
                    item.trim()
                ));
            }
            Ok(from..to)
        }
    }
}

/// What the user wrote, in quotes; a long text is shortened.
fn quoted(word: &str) -> String {
    const SHOWN: usize = 40;
    match word.char_indices().nth(SHOWN) {
        Some((at, _)) => format!("{:?}", format!("{}…", &word[..at])),
        None => format!("{word:?}"),
    }
}

/// `--shard I/N`: the Ith of N equal parts, I from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shard {
    index: u64,
    count: u64,
}

impl Shard {
    /// The frames of this shard.
    pub(crate) fn of(self, frames: &SequenceFrames) -> SequenceFrames {
        frames.shard(self.index, self.count)
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
            _ => Err(format!(
                "{}: must be I/N with I from 0 to N - 1",
                quoted(text)
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn these(ranges: &[Range<u64>]) -> Frames {
        Frames::These(ranges.iter().cloned().collect())
    }

    fn range(from: u64, to: u64) -> std::ops::Range<u64> {
        from..to
    }

    #[test]
    fn frames_in_three_ways() {
        assert_eq!("12".parse(), Ok(Frames::Length(12)));
        assert_eq!("3..6".parse(), Ok(these(&[range(3, 6)])));
        assert_eq!("9, 2,2".parse(), Ok(these(&[2..3, 9..10])));
        assert_eq!("0..2,5".parse(), Ok(these(&[0..2, 5..6])));
        let all = format!("0..{}", u64::MAX);
        assert_eq!(all.parse(), Ok(these(&[range(0, u64::MAX)])));
        for bad in [
            "",
            "0",
            "x",
            "5..5",
            "6..2",
            "1,,2",
            "-1",
            "1,18446744073709551615",
        ] {
            assert!(bad.parse::<Frames>().is_err(), "{bad}");
        }
        let long = "9".repeat(300).parse::<Frames>().expect_err("no number");
        assert!(long.chars().count() < 100, "{long}");
    }

    #[test]
    fn shards() {
        let frames = SequenceFrames::new(FrameSelection::first(10), 1);
        let shard: Shard = "1/4".parse().expect("fine");
        let of_first = shard.of(&frames).of(0);
        assert_eq!(of_first, FrameSelection::from_iter([range(2, 5)]));
        for bad in ["4/4", "1", "a/b", "0/0", "-1/2"] {
            assert!(bad.parse::<Shard>().is_err(), "{bad}");
        }
    }
}
