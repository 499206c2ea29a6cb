//! The images of a recorded camera as arrays, which take them over where their types are equal.

use std::sync::{Mutex, PoisonError};

use nemoral_render::CameraImages;
use nemoral_scene::glam::Vec3;
use nemoral_scene::{Image, ObjectId, Ontology, Semantic};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;

use crate::arrays;

/// What a camera recorded.
pub(crate) struct Pictures {
    rgb: Handed<[u8; 3]>,
    depth_m: Handed<f32>,
    normal: Handed<Vec3>,
    linear: Option<Handed<Vec3>>,
    semantic: Image<Semantic>,
    object: Image<ObjectId>,
}

impl Pictures {
    pub(crate) fn new(images: CameraImages) -> Self {
        Self {
            rgb: Handed::new(images.rgb),
            depth_m: Handed::new(images.truth.depth_m),
            normal: Handed::new(images.truth.normal),
            linear: images.linear.map(Handed::new),
            semantic: images.truth.semantic,
            object: images.truth.object,
        }
    }

    pub(crate) fn rgb<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        (self.rgb).array(py, |image| Ok(arrays::own_channels(py, image)?.into_any()))
    }

    pub(crate) fn depth_m<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        (self.depth_m).array(py, |image| Ok(arrays::own_image(py, image)?.into_any()))
    }

    pub(crate) fn normal<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.normal
            .array(py, |image| Ok(arrays::own_vectors(py, image)?.into_any()))
    }

    pub(crate) fn linear<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let linear = self.linear.as_ref();
        let array = linear
            .map(|linear| linear.array(py, |image| Ok(arrays::own_vectors(py, image)?.into_any())));
        array.transpose()
    }

    /// The numbers of classes.
    pub(crate) fn semantic<'py>(
        &self,
        py: Python<'py>,
        ontology: &Ontology,
    ) -> PyResult<Bound<'py, PyAny>> {
        let classes = Semantic::ALL.iter().map(|s| ontology.class(*s).id);
        let classes: Vec<u8> = classes.collect();
        Ok(arrays::image(py, &self.semantic, |s| classes[*s as usize])?.into_any())
    }

    /// Where nothing was hit. It does not ask for the depth, which may have been changed.
    pub(crate) fn sky<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(arrays::image(py, &self.semantic, |s| *s == Semantic::Sky)?.into_any())
    }

    pub(crate) fn instance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(arrays::image(py, &self.object, |o| o.to_image_id())?.into_any())
    }
}

/// An image until it is asked for, and its array from then on.
struct Handed<T> {
    image: Mutex<Option<Image<T>>>,
    array: PyOnceLock<Py<PyAny>>,
}

impl<T> Handed<T> {
    fn new(image: Image<T>) -> Self {
        Self {
            image: Mutex::new(Some(image)),
            array: PyOnceLock::new(),
        }
    }

    fn array<'py>(
        &self,
        py: Python<'py>,
        make: impl FnOnce(Image<T>) -> PyResult<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let array = self.array.get_or_try_init(py, || {
            let mut image = self.image.lock().unwrap_or_else(PoisonError::into_inner);
            let image = image.take();
            let image = image.ok_or_else(|| {
                PyRuntimeError::new_err("an image is being handed over to another thread")
            })?;
            make(image).map(Bound::unbind)
        })?;
        Ok(array.bind(py).clone())
    }
}
