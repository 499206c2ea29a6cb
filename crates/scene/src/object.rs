//! True ids of objects.

use crate::ChunkCoord;

/// The true id of an object: its chunk and its number there. 0 stands for no object: ground, litter
/// and undergrowth.
///
/// 22 bits of signed chunk x, 22 bits of signed chunk y, 16 bits of item (1..=65535, unique in the
/// chunk over all layers); a chunk coordinate reaches ±2,097,151 (about 100,000 km at 50 m). Ids
/// order by (x, y, item).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "stored::StoredId"))]
pub struct ObjectId(u64);

const BIAS: i32 = 1 << 21;

impl ObjectId {
    /// The id of everything that is no object: ground, litter, undergrowth, sky.
    pub const NONE: Self = Self(0);

    /// The `item`-th object of a chunk; `None` for item 0 or a chunk beyond ±2,097,151.
    #[must_use]
    pub const fn new(chunk: ChunkCoord, item: u16) -> Option<Self> {
        let (x, y) = (chunk.x.wrapping_add(BIAS), chunk.y.wrapping_add(BIAS));
        if item == 0 || x <= 0 || y <= 0 || x >= 2 * BIAS || y >= 2 * BIAS {
            return None;
        }
        Some(Self((x as u64) << 38 | (y as u64) << 16 | item as u64))
    }

    /// True for [`ObjectId::NONE`].
    #[inline]
    #[must_use]
    pub const fn is_none(self) -> bool {
        self.0 == 0
    }

    /// The chunk that the object stands in; (0, 0) for [`ObjectId::NONE`].
    #[inline]
    #[must_use]
    pub const fn chunk(self) -> ChunkCoord {
        if self.is_none() {
            return ChunkCoord::new(0, 0);
        }
        let mask = 2 * BIAS as u64 - 1;
        ChunkCoord::new(
            (self.0 >> 38) as i32 - BIAS,
            ((self.0 >> 16 & mask) as i32) - BIAS,
        )
    }

    /// The object's number in its chunk, 1..=65535; 0 for [`ObjectId::NONE`].
    #[inline]
    #[must_use]
    pub const fn item(self) -> u16 {
        self.0 as u16
    }

    /// The bits, for csv files and caches.
    #[must_use]
    pub const fn to_u64(self) -> u64 {
        self.0
    }

    /// The id with these bits; `None` if there is no such id.
    #[must_use]
    pub const fn from_u64(bits: u64) -> Option<Self> {
        let id = Self(bits);
        match Self::new(id.chunk(), id.item()) {
            Some(same) if same.0 == bits => Some(id),
            _ => None,
        }
    }

    /// The 24-bit id of instance images: chunk x mod 16, chunk y mod 16, item. 0 for none.
    #[inline]
    #[must_use]
    pub const fn to_image_id(self) -> u32 {
        let c = self.chunk();
        if self.is_none() {
            return 0;
        }
        (c.x.rem_euclid(16) as u32) << 20 | (c.y.rem_euclid(16) as u32) << 16 | self.item() as u32
    }

    /// The highest [`item`](Self::item) that `.label` files can number.
    pub const LABEL_ITEM_MAX: u16 = 1310;

    /// The 16-bit id of `.label` files: `(5 (x mod 5) + y mod 5) 1310 + item` for the objects of
    /// chunks at most 2 from the sensor's, with items 1..=1310; 0 for none, farther objects and
    /// higher items. It is below 2^15, as SemanticKITTI's tools for panoptic segmentation pack it
    /// with other bits.
    #[inline]
    #[must_use]
    pub const fn to_label_id(self, sensor_chunk: ChunkCoord) -> u16 {
        let c = self.chunk();
        let near = c.x.abs_diff(sensor_chunk.x) <= 2 && c.y.abs_diff(sensor_chunk.y) <= 2;
        if self.is_none() || !near || self.item() > Self::LABEL_ITEM_MAX {
            return 0;
        }
        let place = 5 * c.x.rem_euclid(5) as u16 + c.y.rem_euclid(5) as u16;
        place * Self::LABEL_ITEM_MAX + self.item()
    }
}

#[cfg(feature = "serde")]
mod stored {
    use super::ObjectId;

    /// An id as it is read, before its bits are checked.
    #[derive(serde::Deserialize)]
    pub(super) struct StoredId(u64);

    impl TryFrom<StoredId> for ObjectId {
        type Error = String;

        fn try_from(StoredId(bits): StoredId) -> Result<Self, String> {
            let known = (bits == 0).then_some(Self::NONE);
            known
                .or_else(|| Self::from_u64(bits))
                .ok_or_else(|| format!("{bits} is no object's id"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::HashSet;

    proptest! {
        #[test]
        fn round_trip(x in -2_097_151..=2_097_151, y in -2_097_151..=2_097_151, item in 1_u16..) {
            let c = ChunkCoord::new(x, y);
            let id = ObjectId::new(c, item).expect("in range");
            prop_assert_eq!((id.chunk(), id.item()), (c, item));
        }

        #[test]
        fn order_is_by_chunk_then_item(
            a in (-9..9, -9..9, 1_u16..9),
            b in (-9..9, -9..9, 1_u16..9),
        ) {
            let id = |(x, y, i)| ObjectId::new(ChunkCoord::new(x, y), i).expect("in range");
            prop_assert_eq!(a.cmp(&b), id(a).cmp(&id(b)));
        }
    }

    #[test]
    fn out_of_range_is_refused() {
        assert_eq!(ObjectId::new(ChunkCoord::new(0, 0), 0), None);
        for far in [-2_097_152, 2_097_152, i32::MAX, i32::MIN] {
            assert_eq!(ObjectId::new(ChunkCoord::new(far, 0), 1), None);
        }
    }

    #[cfg(feature = "serde")]
    #[test]
    fn bits_of_no_object_are_refused_when_they_are_read() {
        use serde::Deserialize;
        use serde::de::value::{Error, SeqDeserializer};

        let read = |bits: u64| {
            let fields = SeqDeserializer::<_, Error>::new(std::iter::once(bits));
            ObjectId::deserialize(fields)
        };
        let id = ObjectId::new(ChunkCoord::new(-3, 4), 5).expect("in range");
        assert_eq!(read(id.to_u64()), Ok(id));
        assert_eq!(read(0), Ok(ObjectId::NONE));
        let error = read(5).expect_err("of no chunk");
        assert_eq!(error.to_string(), "5 is no object's id");
    }

    #[test]
    fn a_sensor_may_be_in_any_chunk() {
        let id = ObjectId::new(ChunkCoord::new(5, 5), 1).expect("in range");
        for far in [i32::MIN, i32::MAX] {
            assert_eq!(id.to_label_id(ChunkCoord::new(far, 5)), 0);
            assert_eq!(id.to_label_id(ChunkCoord::new(5, far)), 0);
        }
    }

    #[test]
    fn short_ids_are_unique_in_their_window() {
        let centre = ChunkCoord::new(-5, 1000);
        let (mut images, mut labels) = (HashSet::new(), HashSet::new());
        for (dx, dy) in (-7..=8).flat_map(|x| (-7..=8).map(move |y| (x, y))) {
            for item in [1, 2, ObjectId::LABEL_ITEM_MAX] {
                let id = ObjectId::new(centre.offset(dx, dy), item).expect("in range");
                assert!(images.insert(id.to_image_id()));
                let label = id.to_label_id(centre);
                let near = dx.abs() <= 2 && dy.abs() <= 2;
                assert_eq!(label != 0, near);
                assert!(!near || labels.insert(label));
                assert!(label <= 32_750);
            }
        }
    }
}
