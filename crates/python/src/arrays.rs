//! Arrays of Python: made of Rust's vectors without copies where their types are equal.

use std::sync::{Mutex, PoisonError};

use nemoral_scene::glam::{DMat3, DQuat, DVec3, Vec3};
use nemoral_scene::{Image, RigidTransform, Twist};
use numpy::{Element, PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;

use crate::failure::Failure;
use crate::work;

/// Bytes of a task: fewer are not worth a second thread.
const TASK: usize = 1 << 18;

/// The numbers of some things, N each. Many are made by the calling thread with the help of the
/// pool's: half of the time goes into the first touch of fresh memory, and the other half is not
/// worth waiting until another thread is awake.
pub(crate) fn numbers<T: Sync, U: Copy + Default + Send + Sync, const N: usize>(
    py: Python<'_>,
    things: &[T],
    numbers: impl Fn(&T) -> [U; N] + Sync,
) -> PyResult<Vec<U>> {
    let task = TASK / size_of::<[U; N]>();
    if things.len() <= task {
        let all: Vec<_> = things.iter().map(numbers).collect();
        return Ok(all.into_flattened());
    }
    work::brief(py, |pool| {
        // Zeros come from the system untouched.
        let mut all = vec![U::default(); things.len() * N];
        let (rows, _) = all.as_chunks_mut::<N>();
        let tasks = Mutex::new(things.chunks(task).zip(rows.chunks_mut(task)));
        let next = || tasks.lock().unwrap_or_else(PoisonError::into_inner).next();
        let labour = || {
            while let Some((things, rows)) = next() {
                for (row, thing) in rows.iter_mut().zip(things) {
                    *row = numbers(thing);
                }
            }
        };
        pool.in_place_scope(|scope| {
            for _ in 1..pool.current_num_threads() {
                scope.spawn(|_| labour());
            }
            labour();
        });
        Ok(all)
    })
}

/// An image as it is: rows × columns.
pub(crate) fn own_image<T: Element>(
    py: Python<'_>,
    image: Image<T>,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    let shape = [image.height(), image.width()];
    PyArray1::from_vec(py, image.into_pixels()).reshape(shape)
}

/// An image of several numbers a pixel as it is: rows × columns × N.
pub(crate) fn own_channels<T: Element, const N: usize>(
    py: Python<'_>,
    image: Image<[T; N]>,
) -> PyResult<Bound<'_, PyArray3<T>>> {
    let shape = [image.height(), image.width(), N];
    PyArray1::from_vec(py, image.into_pixels().into_flattened()).reshape(shape)
}

/// An image of vectors as it is: rows × columns × 3.
pub(crate) fn own_vectors(
    py: Python<'_>,
    image: Image<Vec3>,
) -> PyResult<Bound<'_, PyArray3<f32>>> {
    let (width, height) = (image.width(), image.height());
    let vectors = image.into_pixels().into_iter();
    // In place, as both are three numbers.
    let numbers = vectors.map(|v| v.to_array()).collect();
    own_channels(py, Image::new(width, height, numbers))
}

/// An image of numbers: rows × columns.
pub(crate) fn image<'py, T: Sync, U: Element + Copy + Default>(
    py: Python<'py>,
    image: &Image<T>,
    number: impl Fn(&T) -> U + Sync,
) -> PyResult<Bound<'py, PyArray2<U>>> {
    let numbers = numbers(py, image.pixels(), |pixel| [number(pixel)])?;
    PyArray1::from_vec(py, numbers).reshape([image.height(), image.width()])
}

/// An image of several numbers a pixel: rows × columns × N.
pub(crate) fn channels<'py, T: Sync, U: Element + Copy + Default, const N: usize>(
    py: Python<'py>,
    image: &Image<T>,
    channels: impl Fn(&T) -> [U; N] + Sync,
) -> PyResult<Bound<'py, PyArray3<U>>> {
    let numbers = numbers(py, image.pixels(), channels)?;
    let shape = [image.height(), image.width(), N];
    PyArray1::from_vec(py, numbers).reshape(shape)
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

/// A motion from its velocity, m/s, and its rate of turning, rad/s, along and about the axes of
/// what moves.
pub(crate) fn motion(linear_m_s: [f64; 3], angular_rad_s: [f64; 3]) -> Result<Twist, Failure> {
    for (name, vector, most) in [
        ("velocity", linear_m_s, 100.0),
        ("turn_rate", angular_rad_s, 10.0),
    ] {
        if !vector.iter().all(|x: &f64| x.abs() <= most) {
            let allowed = format!("finite, at most {most} along each axis");
            return Err(Failure::argument(name, format!("{vector:?}"), allowed));
        }
    }
    Ok(Twist {
        linear_m_s: DVec3::from_array(linear_m_s),
        angular_rad_s: DVec3::from_array(angular_rad_s),
    })
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
