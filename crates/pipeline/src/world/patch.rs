//! Patches of low plants, which are placed before they have a shape.

use nemoral_placement::CoverPoint;
use nemoral_stand::PatchKind;

/// A patch of low plants.
#[derive(Clone, Debug)]
pub struct Patch {
    /// What it is.
    pub kind: PatchKind,
    /// Its position, variety, turn and size.
    pub point: CoverPoint,
    /// For tiles of closed vegetation: which of its variants it takes after, 0..1.
    pub variant: f64,
}
