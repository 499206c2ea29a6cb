//! Data sets on disk.

use std::path::PathBuf;
use std::sync::Arc;

use nemoral_scene::{ObjectRecord, Ontology, RigidTransform, TreeRecord};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays;
use crate::frame::Frame;
use crate::record_columns::{object_columns, tree_columns};
use crate::{imu, work};

/// A finished data set on disk, read as far as it is asked for.
#[pyclass(frozen)]
pub(crate) struct Dataset {
    dataset: Arc<nemoral_dataset::Dataset>,
    ontology: Arc<Ontology>,
    specs: Vec<Arc<nemoral_dataset::SequenceSpec>>,
}

#[pymethods]
impl Dataset {
    #[new]
    fn open(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let dataset = work::brief(py, |_| Ok(nemoral_dataset::Dataset::open(&path)?))?;
        let header = &dataset.manifest().header;
        Ok(Self {
            ontology: Arc::new(header.ontology.clone()),
            specs: header.sequences.iter().cloned().map(Arc::new).collect(),
            dataset: Arc::new(dataset),
        })
    }

    #[getter]
    fn path(&self) -> PathBuf {
        self.dataset.root().to_owned()
    }

    /// Sequence and index of each frame that exists here.
    fn frames(&self) -> Vec<(u32, u64)> {
        let frames = self.dataset.frames().iter();
        frames.map(|f| (f.sequence, f.index)).collect()
    }

    /// Number, seed, split and length of each sequence with frames here, and the EPSG code and the
    /// origin of its site.
    #[expect(clippy::type_complexity, reason = "a row of a table")]
    fn sequences(
        &self,
    ) -> Vec<(
        u32,
        u64,
        Option<&'static str>,
        u64,
        Option<u16>,
        Option<(f64, f64, f64)>,
    )> {
        let tracks = self.dataset.manifest().tracks.iter();
        let header = &self.dataset.manifest().header;
        tracks
            .filter_map(|t| {
                let spec = header.sequence(t.sequence)?;
                Some((
                    t.sequence,
                    spec.seed,
                    spec.split.map(|s| s.name()),
                    t.length,
                    spec.site.and_then(|site| site.epsg),
                    spec.site.map(|site| site.origin_m.into()),
                ))
            })
            .collect()
    }

    /// The `i`-th frame.
    fn frame(&self, i: usize) -> PyResult<Frame> {
        let count = self.dataset.frames().len();
        let frame = self.dataset.frames().get(i);
        let frame = frame.ok_or_else(|| {
            PyIndexError::new_err(format!("frame {i}: the data set has {count} frames"))
        })?;
        let spec = self.specs.iter().find(|s| s.number == frame.sequence);
        let spec = spec.expect("a manifest's frames are of its sequences");
        let (dataset, ontology) = (Arc::clone(&self.dataset), Arc::clone(&self.ontology));
        Ok(Frame::stored(dataset, ontology, Arc::clone(spec), i))
    }

    /// The manifest's header and more as JSON, without the frames.
    fn header(&self) -> String {
        let header = &self.dataset.manifest().header;
        let about = serde_json::json!({
            "generator": header.generator,
            "version": header.version,
            "seed": header.seed,
            "backend": header.backend,
            "licence": header.licence,
        });
        about.to_string()
    }

    /// Id, name and colour of each class.
    fn classes(&self) -> Vec<(u8, String, (u8, u8, u8))> {
        let classes = self.ontology.classes().iter();
        classes
            .map(|c| (c.id, c.name.clone(), c.colour.into()))
            .collect()
    }

    /// The config of a sequence as JSON.
    fn config(&self, sequence: u32) -> PyResult<String> {
        Ok(self.spec(sequence)?.config.value().to_string())
    }

    /// `poses.txt`: poses of the reference camera relative to frame 0.
    fn poses<'py>(&self, py: Python<'py>, sequence: u32) -> PyResult<Bound<'py, PyAny>> {
        let poses = work::brief(py, |_| Ok(self.dataset.poses(sequence)?))?;
        matrices(py, &poses)
    }

    /// `poses_estimated.txt`: the same as a navigation system estimates them; `None` if there is
    /// no such file.
    fn estimated_poses<'py>(
        &self,
        py: Python<'py>,
        sequence: u32,
    ) -> PyResult<Option<Bound<'py, PyAny>>> {
        let poses = work::brief(py, |_| Ok(self.dataset.estimated_poses(sequence)?))?;
        poses.map(|poses| matrices(py, &poses)).transpose()
    }

    /// `times.txt`.
    fn times(&self, py: Python<'_>, sequence: u32) -> PyResult<Vec<f64>> {
        work::brief(py, |_| Ok(self.dataset.times(sequence)?))
    }

    /// The columns of `trees.csv`.
    fn trees<'py>(&self, py: Python<'py>, sequence: u32) -> PyResult<Bound<'py, PyDict>> {
        let trees = work::brief(py, |_| Ok(self.dataset.trees(sequence)?))?;
        tree_columns(py, &trees.iter().collect::<Vec<&TreeRecord>>())
    }

    /// The columns of `instances.csv`.
    fn objects<'py>(&self, py: Python<'py>, sequence: u32) -> PyResult<Bound<'py, PyDict>> {
        let objects = work::brief(py, |_| Ok(self.dataset.objects(sequence)?))?;
        object_columns(py, &objects.iter().collect::<Vec<&ObjectRecord>>())
    }

    /// The columns of the inertial measurement unit's files; `None` if there are none.
    fn imu<'py>(&self, py: Python<'py>, sequence: u32) -> PyResult<Option<Bound<'py, PyDict>>> {
        if self.spec(sequence)?.imu.is_none() {
            return Ok(None);
        }
        let readings = work::brief(py, |_| Ok(self.dataset.imu(sequence)?))?;
        imu::columns(py, &readings).map(Some)
    }
}

impl Dataset {
    fn spec(&self, number: u32) -> PyResult<&nemoral_dataset::SequenceSpec> {
        let spec = self.specs.iter().find(|s| s.number == number);
        spec.map(|s| &**s)
            .ok_or_else(|| PyIndexError::new_err(format!("sequence {number}: is not here")))
    }
}

/// Poses as rows of four numbers, four to a pose.
fn matrices<'py>(py: Python<'py>, poses: &[RigidTransform]) -> PyResult<Bound<'py, PyAny>> {
    let rows = poses.iter().flat_map(|pose| {
        let [x, y, z] = pose.to_rows();
        [x, y, z, [0.0, 0.0, 0.0, 1.0]]
    });
    Ok(arrays::rows(py, rows.collect())?.into_any())
}
