//! The maps that place shapes, in the parts that formats have: rotations, scales, translations.

use nemoral_scene::glam::{DMat3, DQuat, DVec3, Mat3, Quat, Vec3};
use nemoral_scene::{Bounds, Instance};

use crate::Error;

/// By how much a point of a shape may be moved for want of a shear, metres.
const TOLERANCE_M: f64 = 5e-5;

/// A rotation of a scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotationScale {
    /// The rotation, a unit quaternion.
    pub rotation: Quat,
    /// The factors along the axes before it; a negative one mirrors.
    pub scale: Vec3,
}

/// A linear map, written for formats that know no shear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Decomposition {
    /// One node suffices.
    Plain(RotationScale),
    /// A node inside another: `outer · inner`. The map shears, and any map is a rotation of a
    /// scale of a rotation (its singular value decomposition).
    Nested {
        /// The outer node's.
        outer: RotationScale,
        /// The inner node's rotation.
        inner: Quat,
    },
}

impl Decomposition {
    /// The parts of an instance's map; `None` if it is flat or not finite.
    ///
    /// A shear that moves no point of the shape's box by more than 0.05 mm is left out.
    #[must_use]
    pub fn of(instance: &Instance) -> Option<Self> {
        let linear = instance.linear.as_dmat3();
        let is_sound = linear.is_finite()
            && instance.position_m.is_finite()
            && linear.determinant() != 0.0
            && linear.inverse().is_finite();
        if !is_sound {
            return None;
        }
        let plain = plain(linear);
        if error_m(plain.matrix(), instance.linear, instance.prototype.bounds()) <= TOLERANCE_M {
            return Some(Self::Plain(plain));
        }
        Some(nested(linear))
    }

    /// The parts of the instance with this number in its scene.
    pub(crate) fn of_numbered(number: usize, instance: &Instance) -> Result<Self, Error> {
        Self::of(instance).ok_or_else(|| Error::Singular {
            number,
            shape: instance.prototype.name().to_owned(),
        })
    }

    /// The linear map.
    #[must_use]
    pub fn matrix(&self) -> Mat3 {
        match self {
            Self::Plain(turn) => turn.matrix(),
            Self::Nested { outer, inner } => outer.matrix() * Mat3::from_quat(*inner),
        }
    }
}

impl RotationScale {
    /// The linear map.
    #[must_use]
    pub fn matrix(&self) -> Mat3 {
        Mat3::from_quat(self.rotation) * Mat3::from_diagonal(self.scale)
    }
}

/// The rotation of a scale that is nearest to a map along its columns.
fn plain(linear: DMat3) -> RotationScale {
    let mut scale = DVec3::new(
        linear.x_axis.length(),
        linear.y_axis.length(),
        linear.z_axis.length(),
    );
    if linear.determinant() < 0.0 {
        scale.x = -scale.x;
    }
    let axes = linear * DMat3::from_diagonal(scale.recip());
    RotationScale {
        rotation: rotation(axes),
        scale: scale.as_vec3(),
    }
}

fn rotation(axes: DMat3) -> Quat {
    let turn = DQuat::from_mat3(&axes).normalize();
    // Both signs are one rotation; equal maps give equal bytes.
    let turn = if turn.w < 0.0 { -turn } else { turn };
    turn.as_quat().normalize()
}

/// By how much at most two maps move the points of a box apart, metres.
fn error_m(a: Mat3, b: Mat3, bounds: Bounds) -> f64 {
    let difference = a.as_dmat3() - b.as_dmat3();
    let corner = |i: usize| {
        let pick = |k: usize| {
            let side = if i >> k & 1 == 0 {
                bounds.min
            } else {
                bounds.max
            };
            f64::from(side[k])
        };
        DVec3::new(pick(0), pick(1), pick(2))
    };
    (0..8)
        .map(|i| (difference * corner(i)).length())
        .fold(0.0, f64::max)
}

/// The singular value decomposition of a map that can be inverted.
fn nested(linear: DMat3) -> Decomposition {
    let mut v = eigenvectors(linear.transpose() * linear);
    if v.determinant() < 0.0 {
        v.z_axis = -v.z_axis;
    }
    Decomposition::Nested {
        outer: plain(linear * v),
        inner: rotation(v.transpose()),
    }
}

/// Orthonormal eigenvectors of a symmetric matrix, by Jacobi's rotations (Golub and Van Loan,
/// *Matrix Computations*, section 8.5).
fn eigenvectors(symmetric: DMat3) -> DMat3 {
    const SWEEPS: usize = 30;
    let mut a = symmetric;
    let mut vectors = DMat3::IDENTITY;
    for _ in 0..SWEEPS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let off = a.col(q)[p];
            let (app, aqq) = (a.col(p)[p], a.col(q)[q]);
            if off.abs() <= f64::EPSILON * (app * aqq).abs().sqrt() {
                continue;
            }
            let tau = (aqq - app) / (2.0 * off);
            let t = tau.signum() / (tau.abs() + (1.0 + tau * tau).sqrt());
            let c = 1.0 / (1.0 + t * t).sqrt();
            let s = t * c;
            let mut turn = DMat3::IDENTITY;
            turn.col_mut(p)[p] = c;
            turn.col_mut(q)[q] = c;
            turn.col_mut(q)[p] = s;
            turn.col_mut(p)[q] = -s;
            a = turn.transpose() * a * turn;
            vectors *= turn;
        }
    }
    vectors
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nemoral_scene::glam::{Vec2, Vec3};
    use nemoral_scene::{
        Card, InstancePlace, Material, MaterialLibrary, Mesh, Prototype, Semantic,
    };
    use proptest::prelude::*;

    use super::*;

    fn leaf() -> Arc<Prototype> {
        let mut library = MaterialLibrary::new();
        let material = library.add(Material::plain("leaf", Semantic::Leaf, Vec3::ONE));
        let card = Card {
            corner: Vec3::new(-1.0, -1.0, 0.0),
            edge_u: Vec3::new(2.0, 0.0, 0.5),
            edge_v: Vec3::new(0.0, 2.0, 0.5),
            material,
        };
        let shape = Prototype::new("leaf", Mesh::default(), vec![card], &library);
        Arc::new(shape.expect("sound"))
    }

    fn placed(linear: Mat3) -> Instance {
        let place = InstancePlace {
            linear,
            ..InstancePlace::at(Vec3::ZERO)
        };
        Instance::new(leaf(), place)
    }

    proptest! {
        #[test]
        fn parts_make_the_whole(columns in prop::array::uniform9(-3.0_f32..3.0)) {
            let linear = Mat3::from_cols_array(&columns);
            prop_assume!(linear.determinant().abs() > 0.02);
            let decomposition = Decomposition::of(&placed(linear)).expect("can be inverted");
            let error = error_m(decomposition.matrix(), linear, leaf().bounds());
            prop_assert!(error < 1e-4, "{error}");
        }

        #[test]
        fn turned_and_scaled_shapes_are_plain(
            axis in prop::array::uniform3(-1.0_f32..1.0),
            angle in -3.0_f32..3.0,
            scale in prop::array::uniform3(0.2_f32..3.0),
            mirrored: bool,
        ) {
            let axis = Vec3::from_array(axis);
            prop_assume!(axis.length() > 0.1);
            let mut scale = Vec3::from_array(scale);
            if mirrored {
                scale.y = -scale.y;
            }
            let turn = Mat3::from_axis_angle(axis.normalize_or(Vec3::X), angle);
            let linear = turn * Mat3::from_diagonal(scale);
            let decomposition = Decomposition::of(&placed(linear)).expect("can be inverted");
            prop_assert!(matches!(decomposition, Decomposition::Plain(_)), "{decomposition:?}");
            prop_assert!(error_m(decomposition.matrix(), linear, leaf().bounds()) < 1e-4);
        }
    }

    #[test]
    fn on_a_slope_nodes_are_nested() {
        let upright = Instance::upright(0.7, 1.3, Vec2::new(0.2, -0.1));
        let decomposition = Decomposition::of(&placed(upright));
        assert!(matches!(decomposition, Some(Decomposition::Nested { .. })));
        let flat = Instance::upright(0.7, 1.3, Vec2::ZERO);
        assert!(matches!(
            Decomposition::of(&placed(flat)),
            Some(Decomposition::Plain(_))
        ));
    }

    #[test]
    fn flat_maps_are_refused() {
        let flat = Mat3::from_diagonal(Vec3::new(1.0, 0.0, 1.0));
        assert_eq!(Decomposition::of(&placed(flat)), None);
        assert_eq!(Decomposition::of(&placed(Mat3::NAN)), None);
    }
}
