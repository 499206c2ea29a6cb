//! Arrays of Python: made of Rust's vectors without copies where their types are equal.

use nemoral_scene::glam::{DMat3, DQuat, DVec3, Vec3};
use nemoral_scene::{Image, RigidTransform};
use numpy::{Element, PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::failure::Failure;
use crate::work;

/// Pixels of a task: fewer are not worth a second thread.
const TASK: usize = 1 << 16;

/// The numbers of pixels, by all threads of the pool: most of the time goes into the first touch of
/// fresh memory.
fn numbers<T: Sync, U: Copy + Default + Send + Sync>(
    py: Python<'_>,
    pixels: &[T],
    number: impl Fn(&T) -> U + Sync,
) -> PyResult<Vec<U>> {
    work::brief(py, |pool| {
        // Zeros come from the system untouched.
        let mut all = vec![U::default(); pixels.len()];
        let tasks = pixels.par_chunks(TASK).zip(all.par_chunks_mut(TASK));
        pool.install(|| {
            tasks.for_each(|(pixels, all)| {
                for (place, pixel) in all.iter_mut().zip(pixels) {
                    *place = number(pixel);
                }
            });
        });
        Ok(all)
    })
}

/// An image of numbers: rows × columns.
pub(crate) fn image<'py, T: Sync, U: Element + Copy + Default>(
    py: Python<'py>,
    image: &Image<T>,
    number: impl Fn(&T) -> U + Sync,
) -> PyResult<Bound<'py, PyArray2<U>>> {
    let numbers = numbers(py, image.pixels(), number)?;
    PyArray1::from_vec(py, numbers).reshape([image.height(), image.width()])
}

/// An image of several numbers a pixel: rows × columns × N.
pub(crate) fn channels<'py, T: Sync, U: Element + Copy, const N: usize>(
    py: Python<'py>,
    image: &Image<T>,
    channels: impl Fn(&T) -> [U; N] + Sync,
) -> PyResult<Bound<'py, PyArray3<U>>>
where
    [U; N]: Default,
{
    let numbers = numbers(py, image.pixels(), channels)?;
    let shape = [image.height(), image.width(), N];
    PyArray1::from_vec(py, numbers.into_flattened()).reshape(shape)
}

/// Rows of N numbers.
pub(crate) fn rows<U: Element, const N: usize>(
    py: Python<'_>,
    rows: Vec<[U; N]>,
) -> PyResult<Bound<'_, PyArray2<U>>> {
    let count = rows.len();
    PyArray1::from_vec(py, rows.into_flattened()).reshape([count, N])
}

/// Vectors as rows.
pub(crate) fn vectors<'py>(
    py: Python<'py>,
    vectors: &[Vec3],
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    rows(py, vectors.iter().map(Vec3::to_array).collect())
}

/// A 4 × 4 matrix.
pub(crate) fn matrix<'py>(
    py: Python<'py>,
    transform: &RigidTransform,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let [a, b, c] = transform.to_rows();
    rows(py, vec![a, b, c, [0.0, 0.0, 0.0, 1.0]])
}

/// A rigid transform from the 16 numbers of its matrix, by rows.
pub(crate) fn transform(name: &str, m: &[f64; 16]) -> Result<RigidTransform, Failure> {
    /// How far a matrix may be from a rotation: what single precision leaves of one.
    const ROUNDING: f64 = 1e-4;
    let refused = |allowed: &str| Err(Failure::argument(name, format!("{m:?}"), allowed));
    if m.iter().any(|x| !x.is_finite() || x.abs() > 1e8) {
        return refused("finite numbers, positions at most 1e8 m from the origin");
    }
    if m[12..] != [0.0, 0.0, 0.0, 1.0] {
        return refused("a matrix whose last row is 0, 0, 0, 1");
    }
    let column = |i: usize| DVec3::new(m[i], m[4 + i], m[8 + i]);
    let turn = DMat3::from_cols(column(0), column(1), column(2));
    let left = (turn.transpose() * turn - DMat3::IDENTITY).to_cols_array();
    if left.iter().any(|x| x.abs() > ROUNDING) || turn.determinant() < 0.0 {
        return refused("a rotation and a translation, without scale or mirroring");
    }
    Ok(RigidTransform {
        rotation: DQuat::from_mat3(&turn).normalize(),
        translation_m: column(3),
    })
}
