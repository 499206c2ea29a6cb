//! The compiled part of nemoral's Python package.
//!
//! Its classes and functions are as few and as plain as possible: they take checked arguments and
//! return arrays, and the package's Python files make of these what users see. Whatever computes
//! long does so on a thread of its own without the interpreter's lock, while the calling thread
//! looks after signals and progress (module `work`).

mod arrays;
mod built_scene;
mod commands;
mod config;
mod dataset;
mod failure;
mod forest;
mod frame;
mod imu;
mod parts;
mod pictures;
mod places;
mod pool;
mod ray_scene;
mod rays;
mod record_columns;
mod scanner;
mod survey;
mod work;
mod worlds;

use pyo3::prelude::*;

/// The compiled part of the package `nemoral`.
#[pymodule]
mod _native {
    #[pymodule_export]
    use super::commands::{check, cloud, convert, generate, merge, report, run_program, stats};
    #[pymodule_export]
    use super::config::{json_schema, presets};
    #[pymodule_export]
    use super::dataset::Dataset;
    #[pymodule_export]
    use super::forest::Forest;
    #[pymodule_export]
    use super::frame::Frame;
    #[pymodule_export]
    use super::parts::{Terrain, grow_tree, poisson_disks};
    #[pymodule_export]
    use super::pool::{process_changed, set_threads, threads};
    #[pymodule_export]
    use super::ray_scene::RayScene;
    #[pymodule_export]
    use super::scanner::Scanner;
    use super::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        module.add("POINT_FIELDS", nemoral_dataset::PlyPoint::FIELDS.to_vec())?;
        let semantics = nemoral_scene::Semantic::ALL.iter();
        module.add("SEMANTICS", semantics.map(|s| s.name()).collect::<Vec<_>>())
    }
}
