//! Maps and profiles of a part of a forest, as arrays.

use nemoral_pipeline::Survey;
use numpy::{Element, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The maps of a survey, the northernmost row first, and its profile.
pub(crate) fn columns<'py>(py: Python<'py>, survey: &Survey) -> PyResult<Bound<'py, PyDict>> {
    let maps = &survey.maps;
    let grid = &maps.grid;
    let dict = PyDict::new(py);
    let heights: Vec<f64> = maps.heights_m().collect();
    for (name, values) in [
        ("ground_m", &maps.ground_m),
        ("surface_m", &maps.surface_m),
        ("height_m", &heights),
    ] {
        dict.set_item(name, map(py, values, grid.columns)?)?;
    }
    let ids: Vec<u32> = maps.tops.iter().map(|top| top.to_image_id()).collect();
    dict.set_item("instance", map(py, &ids, grid.columns)?)?;
    let xs = (0..grid.columns).map(|column| grid.middle_m(column, 0).x);
    let ys = (0..grid.rows).rev().map(|row| grid.middle_m(0, row).y);
    dict.set_item("x_m", PyArray1::from_vec(py, xs.collect()))?;
    dict.set_item("y_m", PyArray1::from_vec(py, ys.collect()))?;
    let layers = (0..survey.profile.layers()).map(|layer| survey.profile.densities_m2_m3(layer));
    let (leaves, wood): (Vec<f64>, Vec<f64>) = layers.map(|[leaf, wood]| (leaf, wood)).unzip();
    dict.set_item("leaf_area_density_m2_m3", PyArray1::from_vec(py, leaves))?;
    dict.set_item("wood_area_density_m2_m3", PyArray1::from_vec(py, wood))?;
    dict.set_item("leaf_area_index", survey.profile.leaf_area_index())?;
    dict.set_item("canopy_cover", maps.cover)?;
    Ok(dict)
}

/// Rows from north to south, of rows from south to north.
fn map<'py, T: Element + Copy>(
    py: Python<'py>,
    values: &[T],
    columns: usize,
) -> PyResult<Bound<'py, PyArray2<T>>> {
    let rows = values.len() / columns;
    let from_north: Vec<T> = values.chunks(columns).rev().flatten().copied().collect();
    PyArray1::from_vec(py, from_north).reshape([rows, columns])
}
