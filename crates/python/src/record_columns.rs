//! Trees and other objects as columns.

use nemoral_scene::glam::DVec3;
use nemoral_scene::{ObjectRecord, TreeRecord};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays;

/// Columns that trees and other objects share.
fn columns<'py, R>(
    py: Python<'py>,
    records: &[&R],
    object: impl Fn(&R) -> nemoral_scene::ObjectId,
    species: impl Fn(&R) -> &str,
    position_m: impl Fn(&R) -> DVec3,
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let ids: Vec<u64> = records.iter().map(|r| object(r).to_u64()).collect();
    dict.set_item("object", PyArray1::from_vec(py, ids))?;
    let ids: Vec<u32> = records.iter().map(|r| object(r).to_image_id()).collect();
    dict.set_item("instance", PyArray1::from_vec(py, ids))?;
    let species: Vec<&str> = records.iter().map(|r| species(r)).collect();
    dict.set_item("species", species)?;
    let places: Vec<[f64; 3]> = records.iter().map(|r| position_m(r).to_array()).collect();
    dict.set_item("position_m", arrays::rows(py, places)?)?;
    Ok(dict)
}

/// The columns of `instances.csv`.
pub(crate) fn object_columns<'py>(
    py: Python<'py>,
    objects: &[&ObjectRecord],
) -> PyResult<Bound<'py, PyDict>> {
    let dict = columns(py, objects, |o| o.object, |o| &o.species, |o| o.position_m)?;
    let kinds: Vec<&str> = objects.iter().map(|o| o.kind.name()).collect();
    dict.set_item("kind", kinds)?;
    let radii: Vec<f64> = objects.iter().map(|o| o.radius_m).collect();
    dict.set_item("radius_m", PyArray1::from_vec(py, radii))?;
    let heights: Vec<f64> = objects.iter().map(|o| o.height_m).collect();
    dict.set_item("height_m", PyArray1::from_vec(py, heights))?;
    Ok(dict)
}

/// The columns of `trees.csv`.
pub(crate) fn tree_columns<'py>(
    py: Python<'py>,
    trees: &[&TreeRecord],
) -> PyResult<Bound<'py, PyDict>> {
    let dict = columns(py, trees, |t| t.object, |t| &t.species, |t| t.position_m)?;
    type Number = fn(&TreeRecord) -> f64;
    let numbers: [(&str, Number); 9] = [
        ("dbh_m", |t| t.dbh_m),
        ("height_m", |t| t.height_m),
        ("crown_base_m", |t| t.crown_base_m),
        ("crown_radius_m", |t| t.crown_radius_m),
        ("leaf_area_m2", |t| t.leaf_area_m2),
        ("stem_volume_m3", |t| t.stem_volume_m3),
        ("wood_volume_m3", |t| t.wood_volume_m3.unwrap_or(f64::NAN)),
        ("merchantable_volume_m3", |t| {
            t.merchantable_volume_m3.unwrap_or(f64::NAN)
        }),
        ("lean_rad", |t| t.lean_rad),
    ];
    for (name, number) in numbers {
        let numbers: Vec<f64> = trees.iter().map(|t| number(t)).collect();
        dict.set_item(name, PyArray1::from_vec(py, numbers))?;
    }
    let classes: Vec<&str> = trees.iter().map(|t| &*t.age_class).collect();
    dict.set_item("age_class", classes)?;
    let alive: Vec<bool> = trees.iter().map(|t| t.alive).collect();
    dict.set_item("alive", PyArray1::from_vec(py, alive))?;
    let names: Vec<&str> = trees.iter().map(|t| &*t.field_id).collect();
    dict.set_item("field_id", names)?;
    Ok(dict)
}
