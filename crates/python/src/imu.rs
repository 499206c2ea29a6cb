//! What inertial measurement units measure, as columns.

use nemoral_dataset::ImuReading;
use nemoral_scene::glam::DVec3;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays;

/// The columns of readings.
pub(crate) fn columns<'py>(
    py: Python<'py>,
    readings: &[ImuReading],
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let times = readings.iter().map(|r| r.time_ns as f64 * 1e-9).collect();
    dict.set_item("time_s", PyArray1::<f64>::from_vec(py, times))?;
    type Vector = fn(&ImuReading) -> DVec3;
    let vectors: [(&str, Vector); 6] = [
        ("angular_rate_rad_s", |r| r.angular_rate_rad_s),
        ("specific_force_m_s2", |r| r.specific_force_m_s2),
        ("position_m", |r| r.world_from_imu.translation_m),
        ("velocity_m_s", |r| r.velocity_m_s),
        ("gyroscope_bias_rad_s", |r| r.gyroscope_bias_rad_s),
        ("accelerometer_bias_m_s2", |r| r.accelerometer_bias_m_s2),
    ];
    for (name, vector) in vectors {
        let rows = readings.iter().map(|r| vector(r).to_array()).collect();
        dict.set_item(name, arrays::rows(py, rows)?)?;
    }
    let turns = readings
        .iter()
        .map(|r| r.world_from_imu.rotation.to_array());
    dict.set_item("rotation_xyzw", arrays::rows(py, turns.collect())?)?;
    Ok(dict)
}
