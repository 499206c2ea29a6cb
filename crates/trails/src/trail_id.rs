//! The identity of a trail.

use nemoral_scene::ChunkCoord;
use nemoral_seed::Key;

/// The identity of a trail: the chunk that it starts in, in which at most one trail is born, and
/// further ones may be given; of a branch, the chunk in which the trail was born that it leaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TrailId {
    /// The chunk that the trail starts in, or that which a branch leaves.
    pub birth: ChunkCoord,
    /// 0 for a trail that was born there, the number of a given one, from 1, or
    /// [`TrailId::BRANCHES`] and the number of the trail's chunk in which a branch leaves it.
    pub number: u32,
}

impl TrailId {
    /// Numbers from this one on are those of branches.
    pub const BRANCHES: u32 = 1 << 31;

    pub(crate) fn branch(birth: ChunkCoord, step: usize) -> Self {
        Self {
            birth,
            number: Self::BRANCHES | step as u32,
        }
    }

    /// The number of the step at whose beginning a branch leaves its trail; `None` if it is none.
    pub(crate) fn leaves_at(self) -> Option<usize> {
        let step = self.number.checked_sub(Self::BRANCHES)?;
        Some(step as usize)
    }

    /// Whether it is a branch of another trail.
    #[must_use]
    pub fn is_branch(self) -> bool {
        self.leaves_at().is_some()
    }

    /// The key of this trail for some purpose.
    pub(crate) fn key(self, purpose: Key) -> Key {
        let key = purpose.chunk(self.birth);
        match self.number {
            0 => key,
            // Items of trails that are born are small numbers.
            number => key.item(u64::from(number) << 32),
        }
    }
}
