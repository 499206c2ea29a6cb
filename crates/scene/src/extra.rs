//! Truth beyond a picture's pixels: where they go, what is behind them, and boxes around things.

use glam::{DQuat, DVec3, Vec2};

use crate::{Image, ObjectId, ObjectKind};

/// What a camera writes besides its pictures and their [`TruthImages`](crate::TruthImages).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ExtraKinds {
    /// Where nothing was hit.
    pub sky: bool,
    /// Optical flow to the next frame.
    pub flow: bool,
    /// The nearest trunk behind whatever hides it.
    pub trunks: bool,
    /// Boxes around things, in the image and in space.
    pub boxes: bool,
    /// The light itself, before exposure.
    #[cfg_attr(
        feature = "serde",
        serde(default, skip_serializing_if = "std::ops::Not::not")
    )]
    pub radiance: bool,
}

/// What was asked for of a picture's further truth. The sky is where depth is 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExtraTruth {
    /// Where the surface at each pixel's centre is in the next frame; `None` where nothing was hit, or
    /// where it lies behind the next frame's camera.
    pub flow: Option<Image<Option<Flow>>>,
    /// Whose trunk is the nearest at each pixel's centre if all but trunks and the ground is taken away;
    /// [`ObjectId::NONE`] where there is none.
    pub trunks: Option<Image<ObjectId>>,
    /// The things in the picture, in order of their ids.
    pub boxes: Option<Vec<ObjectBox>>,
}

/// Where a surface point is in the next frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flow {
    /// Its image position there less its position here, pixels.
    pub offset_px: Vec2,
    /// Does the next frame show it: inside the image, and nothing before it?
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

    /// The smallest that holds a pixel too.
    #[must_use]
    pub fn with(self, column: u32, row: u32) -> Self {
        Self {
            left: self.left.min(column),
            top: self.top.min(row),
            right: self.right.max(column + 1),
            bottom: self.bottom.max(row + 1),
        }
    }
}

/// A thing in a picture: how much of it is seen, and where it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectBox {
    /// Whose.
    pub object: ObjectId,
    /// What it is.
    pub kind: ObjectKind,
    /// Around the pixels that show it; `None` if none does.
    pub visible: Option<PixelBox>,
    /// Around the pixels that would show it if it stood alone on the ground.
    pub whole: PixelBox,
    /// How many pixels show it.
    pub visible_px: u32,
    /// How many would if it stood alone on the ground, at least 1.
    pub whole_px: u32,
    /// The middle of an upright box around it, in the optical frame, metres.
    pub centre_m: DVec3,
    /// Length, width and height of that box, metres.
    pub size_m: DVec3,
    /// The optical frame's axes from the box's (its length, its width, up).
    pub camera_from_box: DQuat,
}

impl ObjectBox {
    /// Visible pixels over those of the thing alone, 0..=1.
    #[must_use]
    pub fn visible_fraction(&self) -> f64 {
        f64::from(self.visible_px) / f64::from(self.whole_px)
    }
}
