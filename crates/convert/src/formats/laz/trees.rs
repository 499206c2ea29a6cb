//! Which tree a point is of.

use std::collections::HashMap;

use nemoral_scene::{ObjectId, TreeRecord};

/// The numbers of a sequence's trees: their rows in `trees.csv`, from 1.
///
/// It is only asked for single ids, so that its order does not matter.
pub(crate) struct TreeNumbers(HashMap<ObjectId, u32>);

impl TreeNumbers {
    /// Those of all trees of a sequence, in the order of the table.
    pub(crate) fn new(trees: &[TreeRecord]) -> Self {
        let numbered = (1..).zip(trees).map(|(row, tree)| (tree.object, row));
        Self(numbered.collect())
    }

    /// The number of the tree that an object is; 0 if it is none.
    pub(crate) fn of(&self, object: ObjectId) -> u32 {
        self.0.get(&object).copied().unwrap_or(0)
    }
}
