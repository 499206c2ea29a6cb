//! A frame, recorded or read back.

use std::sync::Arc;

use nemoral_dataset::{Dataset, FrameRecord, PlyPoint, SequenceSpec};
use nemoral_pipeline::RecordedFrame;
use nemoral_pipeline::recording::pose::FramePose;
use nemoral_scene::{
    Annotations, Distortion, Flow, Image, LidarPoint, ObjectBox, Ontology, PixelBox,
    RigidTransform, Twist,
};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::arrays;
use crate::failure::Failure;
use crate::pictures::Pictures;
use crate::work;

/// A frame, whose images and points become arrays when they are asked for.
#[pyclass(frozen)]
pub(crate) struct Frame {
    spec: Arc<SequenceSpec>,
    ontology: Arc<Ontology>,
    sequence: u32,
    index: Option<u64>,
    source: Source,
}

enum Source {
    Recorded(Recorded),
    Stored { dataset: Arc<Dataset>, at: usize },
}

struct Recorded {
    pose: Arc<FramePose>,
    /// Of each camera.
    pictures: Vec<Pictures>,
    annotations: Arc<Vec<Annotations>>,
    scans: Arc<Vec<Vec<LidarPoint>>>,
}

impl Frame {
    /// A frame that was just recorded.
    pub(crate) fn recorded(
        spec: Arc<SequenceSpec>,
        ontology: Arc<Ontology>,
        index: Option<u64>,
        recorded: RecordedFrame,
    ) -> Self {
        // Nobody else has them, but for a thread that records the same frame at the same time.
        let images = Arc::unwrap_or_clone(recorded.images);
        Self {
            sequence: spec.number,
            spec,
            ontology,
            index,
            source: Source::Recorded(Recorded {
                pose: recorded.pose,
                pictures: images.into_iter().map(Pictures::new).collect(),
                annotations: recorded.annotations,
                scans: recorded.scans,
            }),
        }
    }

    /// The `at`-th frame of a data set.
    pub(crate) fn stored(
        dataset: Arc<Dataset>,
        ontology: Arc<Ontology>,
        spec: Arc<SequenceSpec>,
        at: usize,
    ) -> Self {
        let record = &dataset.frames()[at];
        Self {
            sequence: record.sequence,
            index: Some(record.index),
            source: Source::Stored { dataset, at },
            spec,
            ontology,
        }
    }

    fn pose(&self) -> (f64, RigidTransform, Twist) {
        match &self.source {
            Source::Recorded(r) => (r.pose.time_s, r.pose.world_from_body(), r.pose.motion),
            Source::Stored { dataset, at } => {
                let record = &dataset.frames()[*at];
                (record.time_s, record.world_from_body(), record.body_motion)
            }
        }
    }

    /// Refuses the number of a sensor that there is not.
    fn check(&self, number: usize, count: usize) -> PyResult<()> {
        if number < count {
            return Ok(());
        }
        Err(PyIndexError::new_err(format!("sensor {number} of {count}")))
    }
}

/// Reads a part of a stored frame without the interpreter's lock.
fn read<T: Send>(
    py: Python<'_>,
    dataset: &Dataset,
    at: usize,
    read: impl Fn(&Dataset, &FrameRecord) -> Result<T, nemoral_dataset::Error> + Sync,
) -> PyResult<T> {
    work::brief(py, |_| {
        read(dataset, &dataset.frames()[at]).map_err(Failure::from)
    })
}

#[pymethods]
impl Frame {
    #[getter]
    fn sequence(&self) -> u32 {
        self.sequence
    }

    #[getter]
    fn index(&self) -> Option<u64> {
        self.index
    }

    #[getter]
    fn time_s(&self) -> f64 {
        self.pose().0
    }

    #[getter]
    fn world_from_body<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(arrays::matrix(py, &self.pose().1)?.into_any())
    }

    /// Linear and angular velocity in the body's axes, as far as a camera with a shutter needs it.
    #[getter]
    fn body_motion(&self) -> ([f64; 3], [f64; 3]) {
        let motion = self.pose().2;
        (
            motion.linear_m_s.to_array(),
            motion.angular_rad_s.to_array(),
        )
    }

    /// Id, name and colour of each class.
    #[getter]
    fn classes(&self) -> Vec<(u8, String, (u8, u8, u8))> {
        let classes = self.ontology.classes().iter();
        classes
            .map(|c| (c.id, c.name.clone(), c.colour.into()))
            .collect()
    }

    /// Name, size, K, distortion, mount, and what further truth there is, of each camera.
    #[getter]
    fn cameras<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let cameras = self.spec.cameras.iter().map(|camera| {
            let k = &camera.intrinsics;
            let dict = PyDict::new(py);
            dict.set_item("name", &camera.name)?;
            dict.set_item("width_px", k.width)?;
            dict.set_item("height_px", k.height)?;
            let matrix = [[k.fx, 0.0, k.cx], [0.0, k.fy, k.cy], [0.0, 0.0, 1.0]];
            dict.set_item("intrinsics", arrays::rows(py, matrix.to_vec())?)?;
            let (model, numbers) = match k.distortion {
                Distortion::None => ("none", Vec::new()),
                Distortion::BrownConrady { k1, k2, k3, p1, p2 } => {
                    ("brown_conrady", vec![k1, k2, p1, p2, k3])
                }
                Distortion::Fisheye { k1, k2, k3, k4 } => ("fisheye", vec![k1, k2, k3, k4]),
                other => {
                    let numbers = other.coefficients().into_iter().map(|(_, number)| number);
                    ("other", numbers.collect())
                }
            };
            dict.set_item("distortion_model", model)?;
            dict.set_item("distortion", PyArray1::from_vec(py, numbers))?;
            let mount = arrays::matrix(py, &camera.body_from_camera)?;
            dict.set_item("body_from_sensor", mount)?;
            Ok(dict)
        });
        PyList::new(py, cameras.collect::<PyResult<Vec<_>>>()?)
    }

    /// Name and mount of each LiDAR.
    #[getter]
    fn lidars<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let lidars = self.spec.lidars.iter().map(|lidar| {
            let dict = PyDict::new(py);
            dict.set_item("name", &lidar.name)?;
            let mount = arrays::matrix(py, &lidar.body_from_lidar)?;
            dict.set_item("body_from_sensor", mount)?;
            dict.set_item("deskewed", lidar.deskewed)?;
            Ok(dict)
        });
        PyList::new(py, lidars.collect::<PyResult<Vec<_>>>()?)
    }

    /// One of a camera's images; `None` if it was not asked for.
    fn image<'py>(
        &self,
        py: Python<'py>,
        camera: usize,
        kind: &str,
    ) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.check(camera, self.spec.cameras.len())?;
        match &self.source {
            Source::Recorded(r) => self.recorded_image(py, r, camera, kind),
            Source::Stored { dataset, at } => self.stored_image(py, (dataset, *at), camera, kind),
        }
    }

    /// The columns of a camera's boxes; `None` if they were not asked for.
    fn boxes<'py>(&self, py: Python<'py>, camera: usize) -> PyResult<Option<Bound<'py, PyDict>>> {
        self.check(camera, self.spec.cameras.len())?;
        if !self.spec.cameras[camera].annotations.boxes {
            return Ok(None);
        }
        match &self.source {
            Source::Recorded(r) => {
                let boxes = r.annotations[camera].boxes.as_deref();
                boxes.map(|boxes| box_columns(py, boxes)).transpose()
            }
            Source::Stored { dataset, at } => {
                let boxes = read(py, dataset, *at, |d, frame| d.boxes(frame, camera))?;
                box_columns(py, &boxes).map(Some)
            }
        }
    }

    /// The points of a LiDAR as the bytes of a `.ply` file's vertices; `None` if a data set does
    /// not have them.
    fn points<'py>(
        &self,
        py: Python<'py>,
        lidar: usize,
    ) -> PyResult<Option<Bound<'py, PyArray1<u8>>>> {
        self.check(lidar, self.spec.lidars.len())?;
        let bytes = match &self.source {
            Source::Recorded(r) => {
                let (points, chunk) = (&r.scans[lidar], r.pose.chunk);
                let bytes = |&point: &_| PlyPoint::new(point, &self.ontology, chunk).to_bytes();
                arrays::numbers(py, points, bytes)?
            }
            Source::Stored { .. } if !self.spec.lidars[lidar].ply => return Ok(None),
            Source::Stored { dataset, at } => {
                let scan = read(py, dataset, *at, |d, frame| d.scan(frame, lidar))?;
                let mut bytes = Vec::with_capacity(PlyPoint::BYTES * scan.ply.len());
                for point in &scan.ply {
                    point.write_to(&mut bytes);
                }
                bytes
            }
        };
        Ok(Some(PyArray1::from_vec(py, bytes)))
    }

    /// x, y, z, intensity and label word of the points of a LiDAR: what `.bin` and `.label` hold.
    fn plain_points<'py>(
        &self,
        py: Python<'py>,
        lidar: usize,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        self.check(lidar, self.spec.lidars.len())?;
        let (points, labels): (Vec<[f32; 4]>, Vec<u32>) = match &self.source {
            Source::Recorded(r) => {
                let chunk = r.pose.chunk;
                let plain = r.scans[lidar].iter().map(|&point| {
                    let p = PlyPoint::new(point, &self.ontology, chunk);
                    let [x, y, z] = point.position_m.to_array();
                    let word = u32::from(p.class) | u32::from(p.label) << 16;
                    ([x, y, z, point.intensity], word)
                });
                plain.unzip()
            }
            Source::Stored { dataset, at } => {
                let scan = read(py, dataset, *at, |d, frame| d.scan(frame, lidar))?;
                let word = |(class, label): (u16, u16)| u32::from(class) | u32::from(label) << 16;
                (scan.points, scan.labels.into_iter().map(word).collect())
            }
        };
        let labels = PyArray1::from_vec(py, labels);
        Ok((arrays::rows(py, points)?.into_any(), labels.into_any()))
    }
}

impl Frame {
    fn recorded_image<'py>(
        &self,
        py: Python<'py>,
        recorded: &Recorded,
        camera: usize,
        kind: &str,
    ) -> PyResult<Option<Bound<'py, PyAny>>> {
        let (pictures, asked) = (
            &recorded.pictures[camera],
            self.spec.cameras[camera].annotations,
        );
        let Annotations { flow, trunks, .. } = &recorded.annotations[camera];
        let image = match kind {
            "image" => pictures.rgb(py)?,
            "semantic" => pictures.semantic(py, &self.ontology)?,
            "instance" => pictures.instance(py)?,
            "depth_m" => pictures.depth_m(py)?,
            "normal" => pictures.normal(py)?,
            "sky" if asked.sky => pictures.sky(py)?,
            "flow" => match flow.as_ref().filter(|_| asked.flow) {
                Some(flow) => flow_image(py, flow)?,
                None => return Ok(None),
            },
            "trunks" => match trunks.as_ref().filter(|_| asked.trunks) {
                Some(trunks) => arrays::image(py, trunks, |o| o.to_image_id())?.into_any(),
                None => return Ok(None),
            },
            "radiance" if asked.radiance => return pictures.linear(py),
            _ => return Ok(None),
        };
        Ok(Some(image))
    }

    fn stored_image<'py>(
        &self,
        py: Python<'py>,
        (dataset, at): (&Arc<Dataset>, usize),
        camera: usize,
        kind: &str,
    ) -> PyResult<Option<Bound<'py, PyAny>>> {
        let asked = self.spec.cameras[camera].annotations;
        let c = camera;
        let image = match kind {
            "image" => {
                let image = read(py, dataset, at, |d, f| d.picture(f, c))?;
                arrays::own_channels(py, image)?.into_any()
            }
            "semantic" => {
                let image = read(py, dataset, at, |d, f| d.classes(f, c))?;
                arrays::own_image(py, image)?.into_any()
            }
            "instance" => {
                let image = read(py, dataset, at, |d, f| d.instances(f, c))?;
                arrays::own_image(py, image)?.into_any()
            }
            "depth_m" => {
                let image = read(py, dataset, at, |d, f| d.depth_m(f, c))?;
                arrays::own_image(py, image)?.into_any()
            }
            "normal" => {
                let image = read(py, dataset, at, |d, f| d.normals(f, c))?;
                arrays::own_vectors(py, image)?.into_any()
            }
            "sky" if asked.sky => {
                // Where nothing was hit, there is no depth.
                let image = read(py, dataset, at, |d, f| d.depth_m(f, c))?;
                arrays::image(py, &image, |d| *d == 0.0)?.into_any()
            }
            "flow" if asked.flow => {
                let image = read(py, dataset, at, |d, f| d.flow(f, c))?;
                flow_image(py, &image)?
            }
            "trunks" if asked.trunks => {
                let image = read(py, dataset, at, |d, f| d.trunks(f, c))?;
                arrays::own_image(py, image)?.into_any()
            }
            "radiance" if asked.radiance => {
                let image = read(py, dataset, at, |d, f| d.radiance(f, c))?;
                arrays::own_vectors(py, image)?.into_any()
            }
            _ => return Ok(None),
        };
        Ok(Some(image))
    }
}

/// Offsets, pixels, and 1 where the next frame shows the point, else 0; NaN where there is none.
fn flow_image<'py>(py: Python<'py>, flow: &Image<Option<Flow>>) -> PyResult<Bound<'py, PyAny>> {
    let numbers = |flow: &Option<Flow>| match flow {
        Some(flow) => [
            flow.offset_px.x,
            flow.offset_px.y,
            f32::from(u8::from(flow.seen)),
        ],
        None => [f32::NAN, f32::NAN, 0.0],
    };
    Ok(arrays::channels(py, flow, numbers)?.into_any())
}

fn box_columns<'py>(py: Python<'py>, boxes: &[ObjectBox]) -> PyResult<Bound<'py, PyDict>> {
    let edges = |b: &PixelBox| [b.left, b.top, b.right, b.bottom].map(i64::from);
    let visible = |b: &ObjectBox| b.visible.as_ref().map_or([-1; 4], edges);
    let column = |number: fn(&ObjectBox) -> u32| -> Vec<u32> { boxes.iter().map(number).collect() };
    let dict = PyDict::new(py);
    let object: Vec<u64> = boxes.iter().map(|b| b.object.to_u64()).collect();
    dict.set_item("object", PyArray1::from_vec(py, object))?;
    let instance = column(|b| b.object.to_image_id());
    dict.set_item("instance", PyArray1::from_vec(py, instance))?;
    let kinds: Vec<&str> = boxes.iter().map(|b| b.kind.name()).collect();
    dict.set_item("kind", kinds)?;
    let visible: Vec<[i64; 4]> = boxes.iter().map(visible).collect();
    dict.set_item("visible", arrays::rows(py, visible)?)?;
    let whole: Vec<[i64; 4]> = boxes.iter().map(|b| edges(&b.whole)).collect();
    dict.set_item("whole", arrays::rows(py, whole)?)?;
    dict.set_item(
        "visible_px",
        PyArray1::from_vec(py, column(|b| b.visible_px)),
    )?;
    dict.set_item("whole_px", PyArray1::from_vec(py, column(|b| b.whole_px)))?;
    let place = |b: &ObjectBox| {
        let pose = RigidTransform {
            rotation: b.camera_from_box,
            translation_m: b.centre_m,
        };
        let [x, y, z] = pose.to_rows();
        [x, y, z, [0.0, 0.0, 0.0, 1.0]]
    };
    let poses: Vec<[f64; 4]> = boxes.iter().flat_map(place).collect();
    let poses = PyArray1::from_vec(py, poses.into_flattened());
    dict.set_item("camera_from_box", poses.reshape([boxes.len(), 4, 4])?)?;
    let sizes: Vec<[f64; 3]> = boxes.iter().map(|b| b.size_m.to_array()).collect();
    dict.set_item("size_m", arrays::rows(py, sizes)?)?;
    Ok(dict)
}
