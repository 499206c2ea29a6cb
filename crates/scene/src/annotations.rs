//! Annotations of a picture beyond its label maps: optical flow, hidden trunks, bounding boxes.

use glam::{DQuat, DVec3, Vec2};

use crate::{Image, ObjectId, ObjectKind};

/// Which annotations a camera writes besides its pictures and their
/// [`TruthImages`](crate::TruthImages).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct AnnotationKinds {
    /// A mask of the sky: the pixels where nothing was hit.
    pub sky: bool,
    /// Optical flow to the next frame.
    pub flow: bool,
    /// The nearest trunk, also where other objects hide it.
    pub trunks: bool,
    /// Bounding boxes of objects, in the image and in space.
    pub boxes: bool,
    /// The radiance image, before exposure.
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "std::ops::Not::not")
    )]
    pub radiance: bool,
}

/// The annotations of one picture, as far as they were asked for. (The sky needs none: it is where
/// depth is 0.)
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Annotations {
    /// Where the surface at each pixel's centre is in the next frame; `None` where nothing was hit,
    /// or where the point is behind the next frame's camera.
    pub flow: Option<Image<Option<Flow>>>,
    /// The object whose trunk is the nearest at each pixel's centre if everything but trunks and
    /// the ground is taken away; [`ObjectId::NONE`] where there is none.
    pub trunks: Option<Image<ObjectId>>,
    /// The boxes of the objects in the picture, in order of their ids.
    pub boxes: Option<Vec<ObjectBox>>,
}

/// Where a surface point is in the next frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flow {
    /// Its position in the next image minus its position in this one, pixels.
    pub offset_px: Vec2,
    /// Whether the next frame shows it: inside the image, within what is visible then, and with
    /// nothing in front of it.
    pub seen: bool,
}

/// A half-open rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelBox {
    /// The first column.
    pub left: u32,
    /// The first row.
    pub top: u32,
    /// The column after the last.
    pub right: u32,
    /// The row after the last.
    pub bottom: u32,
}

impl PixelBox {
    /// The rectangle of no pixels.
    pub const EMPTY: Self = Self {
        left: u32::MAX,
        top: u32::MAX,
        right: 0,
        bottom: 0,
    };

    /// The smallest rectangle that also holds a pixel.
    #[must_use]
    pub fn with(self, column: u32, row: u32) -> Self {
        Self {
            left: self.left.min(column),
            top: self.top.min(row),
            right: self.right.max(column + 1),
            bottom: self.bottom.max(row + 1),
        }
    }

    /// The smallest rectangle that holds both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self {
            left: self.left.min(other.left),
            top: self.top.min(other.top),
            right: self.right.max(other.right),
            bottom: self.bottom.max(other.bottom),
        }
    }
}

/// The bounding boxes of an object in a picture, and how much of it is visible.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectBox {
    /// The object.
    pub object: ObjectId,
    /// What kind of object it is.
    pub kind: ObjectKind,
    /// The box of the pixels that show it; `None` if no pixel does.
    pub visible: Option<PixelBox>,
    /// The box of the pixels that would show it if it stood alone on the ground.
    pub whole: PixelBox,
    /// How many pixels show it.
    pub visible_px: u32,
    /// How many pixels would show it if it stood alone on the ground, at least 1.
    pub whole_px: u32,
    /// The middle of an upright box around it, in the optical frame, metres.
    pub centre_m: DVec3,
    /// Length, width and height of that box, metres.
    pub size_m: DVec3,
    /// The rotation from the box's axes (its length, its width, up) to the optical frame's.
    pub camera_from_box: DQuat,
}

impl ObjectBox {
    /// Visible pixels divided by those of the object standing alone, 0..=1.
    #[must_use]
    pub fn visible_fraction(&self) -> f64 {
        f64::from(self.visible_px) / f64::from(self.whole_px)
    }
}
