//! Sets of frames of a sequence.

use std::ops::Range;

/// A set of frames, stored as ranges, so that it is as small for a thousand million frames as for
/// one.
///
/// ```
/// use nemoral_pipeline::FrameSelection;
///
/// let frames: FrameSelection = [0..3, 8..9].into_iter().collect();
/// assert_eq!(frames.iter().collect::<Vec<_>>(), [0, 1, 2, 8]);
/// assert_eq!(frames.shard(1, 2), FrameSelection::from_iter([2..3, 8..9]));
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FrameSelection {
    /// Invariant: none is empty, they increase, and between two lies at least one frame.
    ranges: Vec<Range<u64>>,
}

impl FrameSelection {
    /// The first `count` frames.
    #[must_use]
    pub fn first(count: u64) -> Self {
        std::iter::once(0..count).collect()
    }

    /// The number of frames.
    #[must_use]
    pub fn count(&self) -> u64 {
        // The ranges are disjoint parts of 0..u64::MAX, so the sum of their lengths does not
        // overflow.
        self.ranges.iter().map(|r| r.end - r.start).sum()
    }

    /// Whether the set is empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.ranges.is_empty()
    }

    /// The last frame; `None` if there is none.
    #[must_use]
    pub fn last(&self) -> Option<u64> {
        self.ranges.last().map(|r| r.end - 1)
    }

    /// Whether a frame is in the set.
    #[must_use]
    pub fn contains(&self, frame: u64) -> bool {
        let after = self.ranges.partition_point(|r| r.start <= frame);
        after > 0 && self.ranges[after - 1].contains(&frame)
    }

    /// The frames, in order.
    pub fn iter(&self) -> impl Iterator<Item = u64> + Clone + '_ {
        self.ranges.iter().cloned().flatten()
    }

    /// The part `index` of `count` equal parts, `index` from 0: whole frames in blocks, so that the
    /// chunks of a worker stay together. All parts together hold each frame once.
    ///
    /// # Panics
    /// If `index` is not below `count`.
    #[must_use]
    pub fn shard(&self, index: u64, count: u64) -> Self {
        assert!(index < count, "shard {index} of {count}");
        self.positions(cut(self.count(), index, count))
    }

    /// The frames at these positions in the set.
    fn positions(&self, positions: Range<u64>) -> Self {
        let mut before = 0;
        let parts = self.ranges.iter().map(|range| {
            let length = range.end - range.start;
            // The limits as numbers within this range.
            let low = positions.start.saturating_sub(before).min(length);
            let high = positions.end.saturating_sub(before).min(length);
            before += length;
            range.start + low..range.start + high
        });
        parts.collect()
    }
}

/// The positions of the part `index` of `count` equal parts of `all`.
fn cut(all: u64, index: u64, count: u64) -> Range<u64> {
    let at = |i: u64| (u128::from(all) * u128::from(i) / u128::from(count)) as u64;
    at(index)..at(index + 1)
}

/// The same frames of each of several sequences, or a part of these.
///
/// ```
/// use nemoral_pipeline::{FrameSelection, SequenceFrames};
///
/// let frames = SequenceFrames::new(FrameSelection::first(10), 4);
/// assert_eq!(frames.count(), 40);
/// // A worker's frames are neighbours, so that it grows few worlds.
/// let half = frames.shard(1, 3);
/// assert_eq!(half.of(0).count() + half.of(1).count() + half.of(2).count(), half.count());
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SequenceFrames {
    of_each: FrameSelection,
    sequences: u32,
    /// Which of all frames, in the order of sequences.
    part: Range<u64>,
}

impl SequenceFrames {
    /// These frames of sequences 0, 1, …, `sequences` - 1.
    #[must_use]
    pub fn new(of_each: FrameSelection, sequences: u32) -> Self {
        let all = of_each.count().saturating_mul(sequences.into());
        Self {
            of_each,
            sequences,
            part: 0..all,
        }
    }

    /// The part `index` of `count` equal parts, `index` from 0, as [`FrameSelection::shard`] cuts
    /// them.
    ///
    /// # Panics
    /// If `index` is not below `count`.
    #[must_use]
    pub fn shard(&self, index: u64, count: u64) -> Self {
        assert!(index < count, "shard {index} of {count}");
        let part = cut(self.count(), index, count);
        Self {
            part: self.part.start + part.start..self.part.start + part.end,
            ..self.clone()
        }
    }

    /// The number of frames.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.part.end - self.part.start
    }

    /// The last frame that is asked for of each sequence; `None` if there is none.
    #[must_use]
    pub fn last(&self) -> Option<u64> {
        self.of_each.last()
    }

    /// The frames of a sequence.
    #[must_use]
    pub fn of(&self, sequence: u32) -> FrameSelection {
        let length = self.of_each.count();
        let before = length.saturating_mul(sequence.into());
        let within = |at: u64| at.saturating_sub(before).min(length);
        self.of_each
            .positions(within(self.part.start)..within(self.part.end))
    }

    /// The sequences that have frames here.
    pub fn sequences(&self) -> impl Iterator<Item = u32> + '_ {
        let length = self.of_each.count().max(1);
        let first = self.part.start / length;
        let end = if self.part.is_empty() {
            first
        } else {
            self.part.end.div_ceil(length).min(self.sequences.into())
        };
        (first..end).map(|number| number as u32)
    }
}

impl FromIterator<Range<u64>> for FrameSelection {
    /// The union of ranges in any order; empty ones add nothing.
    fn from_iter<T: IntoIterator<Item = Range<u64>>>(ranges: T) -> Self {
        let mut all: Vec<Range<u64>> = ranges.into_iter().filter(|r| !r.is_empty()).collect();
        all.sort_unstable_by_key(|r| r.start);
        let mut ranges: Vec<Range<u64>> = Vec::new();
        for range in all {
            match ranges.last_mut() {
                Some(last) if range.start <= last.end => last.end = last.end.max(range.end),
                _ => ranges.push(range),
            }
        }
        Self { ranges }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    proptest! {
        #[test]
        fn it_is_the_set_of_its_frames(
            pairs in prop::collection::vec((0_u64..60, 0_u64..9), 0..6),
            count in 1_u64..12,
        ) {
            let expected: BTreeSet<u64> = pairs.iter().flat_map(|&(a, n)| a..a + n).collect();
            let frames: FrameSelection = pairs.iter().map(|&(a, n)| a..a + n).collect();
            let listed: Vec<u64> = expected.iter().copied().collect();
            prop_assert_eq!(frames.iter().collect::<Vec<_>>(), &listed[..]);
            prop_assert_eq!(frames.count(), listed.len() as u64);
            prop_assert_eq!(frames.last(), listed.last().copied());
            prop_assert_eq!(frames.is_empty(), listed.is_empty());
            for frame in 0..80 {
                prop_assert_eq!(frames.contains(frame), expected.contains(&frame));
            }
            let shards: Vec<FrameSelection> = (0..count).map(|i| frames.shard(i, count)).collect();
            let joined: Vec<u64> = shards.iter().flat_map(FrameSelection::iter).collect();
            prop_assert_eq!(joined, listed);
            let sizes: Vec<u64> = shards.iter().map(FrameSelection::count).collect();
            let (least, most) = (sizes.iter().min(), sizes.iter().max());
            prop_assert!(most.zip(least).is_some_and(|(a, b)| a - b <= 1));
        }
    }

    proptest! {
        #[test]
        fn parts_of_sequences_hold_each_frame_once(
            frames in prop::collection::vec((0_u64..30, 0_u64..6), 0..4),
            sequences in 1_u32..9,
            count in 1_u64..20,
        ) {
            let each: FrameSelection = frames.into_iter().map(|(a, n)| a..a + n).collect();
            let all = SequenceFrames::new(each.clone(), sequences);
            prop_assert_eq!(all.count(), each.count() * u64::from(sequences));
            let mut found = Vec::new();
            for index in 0..count {
                let part = all.shard(index, count);
                let before = found.len() as u64;
                for number in part.sequences() {
                    prop_assert!(!part.of(number).is_empty());
                    found.extend(part.of(number).iter().map(|frame| (number, frame)));
                }
                prop_assert_eq!(found.len() as u64 - before, part.count());
            }
            let expected = (0..sequences).flat_map(|s| each.iter().map(move |f| (s, f)));
            prop_assert_eq!(found, expected.collect::<Vec<_>>());
        }
    }

    #[test]
    fn the_largest_numbers_are_numbers_like_others() {
        let all = FrameSelection::first(u64::MAX);
        assert_eq!((all.count(), all.last()), (u64::MAX, Some(u64::MAX - 1)));
        assert_eq!(all.iter().next(), Some(0));
        let shard = all.shard(6_148_914_691_236_517_205, 9_223_372_036_854_775_808);
        assert_eq!(shard.count(), 2);
        assert_eq!(shard.iter().next(), Some(12_297_829_382_473_034_409));
        let last = all.shard(u64::MAX - 1, u64::MAX);
        assert_eq!(
            last,
            FrameSelection::from_iter(std::iter::once(u64::MAX - 1..u64::MAX))
        );
        let few = FrameSelection::first(10);
        assert!(few.shard(3, u64::MAX).is_empty());
        assert_eq!(few.shard(u64::MAX - 1, u64::MAX).last(), Some(9));
    }
}
