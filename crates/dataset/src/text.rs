//! `poses.txt`, `calib.txt`, `times.txt`.

use nemoral_scene::RigidTransform;
use nemoral_scene::glam::{DMat3, DQuat, DVec3};

/// A transform from its 3 × 4 matrix.
pub(crate) fn from_rows(rows: &[[f64; 4]; 3]) -> RigidTransform {
    let column = |c: usize| DVec3::new(rows[0][c], rows[1][c], rows[2][c]);
    RigidTransform {
        rotation: DQuat::from_mat3(&DMat3::from_cols(column(0), column(1), column(2))).normalize(),
        translation_m: column(3),
    }
}
