//! Maps and profiles of a part of a forest, as arrays.

use nemoral_mensuration::{CanopyCell, MapGrid};
use nemoral_pipeline::Survey;
use numpy::{Element, PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The maps of a survey, the northernmost row first, and its profile.
pub(crate) fn columns<'py>(py: Python<'py>, survey: &Survey) -> PyResult<Bound<'py, PyDict>> {
    let maps = &survey.maps;
    let grid = &maps.grid;
    let dict = PyDict::new(py);
    type OfCell = fn(&CanopyCell) -> f64;
    let real: [(&str, OfCell); 4] = [
        ("ground_m", |cell| cell.ground_m),
        ("surface_m", |cell| cell.surface_m),
        ("height_m", |cell| cell.height_m),
        ("cover", |cell| cell.cover),
    ];
    for (name, of) in real {
        let values = grid.from_north(|number| of(&maps.cells[number]));
        dict.set_item(name, map(py, values, grid)?)?;
    }
    let tops = grid.from_north(|number| maps.cells[number].top.to_u64());
    dict.set_item("object", map(py, tops, grid)?)?;
    let xs = (0..grid.columns).map(|column| grid.middle_m(column).x);
    let ys = (0..grid.rows)
        .rev()
        .map(|row| grid.middle_m(row * grid.columns).y);
    dict.set_item("x_m", PyArray1::from_vec(py, xs.collect()))?;
    dict.set_item("y_m", PyArray1::from_vec(py, ys.collect()))?;
    let layers = (0..survey.profile.layers()).map(|layer| survey.profile.densities_m2_m3(layer));
    let (leaves, wood): (Vec<f64>, Vec<f64>) = layers.map(|[leaf, wood]| (leaf, wood)).unzip();
    dict.set_item("leaf_area_density_m2_m3", PyArray1::from_vec(py, leaves))?;
    dict.set_item("wood_area_density_m2_m3", PyArray1::from_vec(py, wood))?;
    dict.set_item("leaf_area_index", survey.profile.leaf_area_index())?;
    dict.set_item("canopy_cover", maps.cover())?;
    Ok(dict)
}

fn map<'py, T: Element>(
    py: Python<'py>,
    from_north: Vec<T>,
    grid: &MapGrid,
) -> PyResult<Bound<'py, PyArray2<T>>> {
    PyArray1::from_vec(py, from_north).reshape([grid.rows, grid.columns])
}
