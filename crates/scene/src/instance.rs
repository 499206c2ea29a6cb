//! Shapes placed in a chunk.

use std::fmt;
use std::sync::Arc;

use glam::{Mat3, Mat4, Quat, Vec2, Vec3};

use crate::{ObjectId, Prototype};

/// A shape placed in a chunk.
#[derive(Clone, Debug)]
pub struct Instance {
    /// What is placed.
    pub prototype: Arc<Prototype>,
    /// Where its origin stands: chunk-local, metres, z above the world's zero.
    pub position_m: Vec3,
    /// Chunk axes from the shape's axes: rotation, scale, and shear along the ground.
    pub linear: Mat3,
    /// The object that it is; [`ObjectId::NONE`] for ground and undergrowth.
    pub object: ObjectId,
    /// A keyed number, 0..1, that varies the colour of this instance.
    pub variation: f32,
}

/// Where a shape is placed, how turned and scaled, and as which object: an [`Instance`] without
/// its shape.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct InstancePlace {
    /// Where its origin stands: chunk-local, metres, z above the world's zero.
    pub position_m: Vec3,
    /// Chunk axes from the shape's axes: any map that can be inverted, so rotations, scales that
    /// differ by axis, mirrors and shears.
    pub linear: Mat3,
    /// The object that it is; [`ObjectId::NONE`] for ground and undergrowth.
    pub object: ObjectId,
    /// A keyed number, 0..1, that varies the colour of this instance; 0.5 is the material's own.
    pub variation: f32,
}

/// Why a matrix places no shape.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum InstanceError {
    /// A number is not finite.
    NotFinite,
    /// The last row is not 0, 0, 0, 1: the matrix projects.
    Projective {
        /// The last row.
        last_row: [f32; 4],
    },
    /// The map is flat: it takes the volume from whatever it is applied to.
    Singular {
        /// The determinant of its linear part.
        determinant: f32,
    },
}

impl fmt::Display for InstanceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite => write!(f, "placement of a shape: a number is not finite"),
            Self::Projective { last_row } => write!(
                f,
                "placement of a shape: the last row of its matrix is {last_row:?}, allowed is \
                 [0, 0, 0, 1] (is the matrix stored by rows instead of columns?)"
            ),
            Self::Singular { determinant } => write!(
                f,
                "placement of a shape: its matrix has determinant {determinant}, so that the shape \
                 would be flat; scales must not be 0"
            ),
        }
    }
}

impl std::error::Error for InstanceError {}

impl InstancePlace {
    /// A shape as it is, its origin at a place, without an object id.
    #[must_use]
    pub const fn at(position_m: Vec3) -> Self {
        Self {
            position_m,
            linear: Mat3::IDENTITY,
            object: ObjectId::NONE,
            variation: 0.5,
        }
    }

    /// A shape scaled by factors along its own axes, then turned, then moved. A negative factor
    /// mirrors.
    ///
    /// # Errors
    /// If a number is not finite or a factor is 0.
    pub fn new(rotation: Quat, scale: Vec3, position_m: Vec3) -> Result<Self, InstanceError> {
        let turn = Mat3::from_quat(rotation);
        Self::from_linear(turn * Mat3::from_diagonal(scale), position_m)
    }

    /// Placed by a 4 × 4 matrix of columns, chunk axes from the shape's axes. Mirrors, shears and
    /// scales that differ by axis are allowed.
    ///
    /// # Errors
    /// If a number is not finite, the last row is not 0, 0, 0, 1, or the linear part cannot be
    /// inverted.
    pub fn from_matrix(chunk_from_shape: Mat4) -> Result<Self, InstanceError> {
        let last_row = chunk_from_shape.row(3).to_array();
        if !chunk_from_shape.is_finite() {
            return Err(InstanceError::NotFinite);
        }
        if last_row != [0.0, 0.0, 0.0, 1.0] {
            return Err(InstanceError::Projective { last_row });
        }
        let linear = Mat3::from_mat4(chunk_from_shape);
        Self::from_linear(linear, chunk_from_shape.w_axis.truncate())
    }

    fn from_linear(linear: Mat3, position_m: Vec3) -> Result<Self, InstanceError> {
        if !linear.is_finite() || !position_m.is_finite() {
            return Err(InstanceError::NotFinite);
        }
        // As casters test it: in f64, where the determinant of small shapes does not underflow.
        let inverse = linear.as_dmat3().inverse();
        if linear.as_dmat3().determinant() == 0.0 || !inverse.is_finite() {
            let determinant = linear.determinant();
            return Err(InstanceError::Singular { determinant });
        }
        Ok(Self {
            linear,
            ..Self::at(position_m)
        })
    }

    /// The same place for another object.
    #[must_use]
    pub const fn with_object(mut self, object: ObjectId) -> Self {
        self.object = object;
        self
    }

    /// The same place with another variation of colour, 0..1.
    #[must_use]
    pub const fn with_variation(mut self, variation: f32) -> Self {
        self.variation = variation;
        self
    }
}

impl Instance {
    /// A shape at a place.
    #[must_use]
    pub const fn new(prototype: Arc<Prototype>, place: InstancePlace) -> Self {
        let InstancePlace {
            position_m,
            linear,
            object,
            variation,
        } = place;
        Self {
            prototype,
            position_m,
            linear,
            object,
            variation,
        }
    }

    /// Where it is placed.
    #[must_use]
    pub const fn place(&self) -> InstancePlace {
        InstancePlace {
            position_m: self.position_m,
            linear: self.linear,
            object: self.object,
            variation: self.variation,
        }
    }

    /// The linear part of a plant that stands upright on a slope: a turn about the vertical and a
    /// uniform scale, then a shear that keeps verticals vertical and lays its foot on the ground.
    /// `gradient` is (dz/dx, dz/dy) of the ground, (0, 0) for no shear.
    #[must_use]
    pub fn upright(yaw_rad: f32, scale: f32, gradient: Vec2) -> Mat3 {
        let turn = Mat3::from_rotation_z(yaw_rad) * scale;
        let shear = Mat3::from_cols(
            Vec3::new(1.0, 0.0, gradient.x),
            Vec3::new(0.0, 1.0, gradient.y),
            Vec3::Z,
        );
        shear * turn
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matrices_and_their_parts_place_alike() {
        let (turn, at) = (Quat::from_rotation_z(0.7), Vec3::new(1.0, -2.0, 3.0));
        let scale = Vec3::new(2.0, -3.0, 0.5);
        let parts = InstancePlace::new(turn, scale, at).expect("can be inverted");
        let matrix = Mat4::from_scale_rotation_translation(scale, turn, at);
        let whole = InstancePlace::from_matrix(matrix).expect("can be inverted");
        assert!((parts.linear - whole.linear).abs_diff_eq(Mat3::ZERO, 1e-6));
        assert_eq!(parts.position_m, whole.position_m);
        assert!(parts.linear.determinant() < 0.0);
    }

    #[test]
    fn what_places_nothing_is_refused() {
        let said = |result: Result<InstancePlace, InstanceError>| match result {
            Ok(_) => String::new(),
            Err(error) => error.to_string(),
        };
        let flat = InstancePlace::new(Quat::IDENTITY, Vec3::new(1.0, 0.0, 1.0), Vec3::ZERO);
        assert!(said(flat).contains("determinant 0"));
        let lost = InstancePlace::new(Quat::IDENTITY, Vec3::ONE, Vec3::NAN);
        assert!(said(lost).contains("not finite"));
        let rows = Mat4::from_translation(Vec3::X).transpose();
        let by_rows = said(InstancePlace::from_matrix(rows));
        assert!(by_rows.contains("[1.0, 0.0, 0.0, 1.0]"), "{by_rows}");
        assert_eq!(said(InstancePlace::from_matrix(Mat4::IDENTITY)), "");
    }
}
