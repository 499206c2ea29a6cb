//! Scenes of a user's own meshes that rays are cast at.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nemoral_raycast::{Blas, Group, RayScene as Caster};
use nemoral_scene::glam::{Mat4, Vec2, Vec3};
use nemoral_scene::{
    AlphaMask, InstancePlace, LaserBand, Material, MaterialId, MaterialLibrary, Mesh, Optics,
    Prototype, Semantic, Triangle,
};
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use rayon::ThreadPool;

use crate::built_scene::{Built, object};
use crate::failure::Failure;
use crate::rays::{Hits, Limits, Rays, occluded};
use crate::{arrays, work};

/// Meshes and their instances.
#[pyclass(frozen)]
pub(crate) struct RayScene(Mutex<Parts>);

#[derive(Default)]
struct Parts {
    materials: MaterialLibrary,
    meshes: Vec<MeshPart>,
    instances: Vec<InstancePart>,
    built: Option<Arc<Built>>,
}

struct MeshPart {
    shape: Arc<Blas>,
    material: MaterialId,
    semantic: u32,
}

#[derive(Clone, Copy)]
struct InstancePart {
    mesh: u32,
    instance: u32,
    place: InstancePlace,
}

impl RayScene {
    fn parts(&self) -> MutexGuard<'_, Parts> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The scene, built in the pool now if it has changed.
    pub(crate) fn built(&self, pool: &ThreadPool) -> Arc<Built> {
        let mut parts = self.parts();
        if let Some(built) = &parts.built {
            return Arc::clone(built);
        }
        let shapes = parts.instances.iter();
        let shapes = shapes.map(|i| {
            let shape = &parts.meshes[i.mesh as usize].shape;
            (i.place, Arc::clone(shape))
        });
        let shapes: Vec<_> = shapes.collect();
        let group = pool.install(|| Group::build(shapes));
        let label = |i: &InstancePart| {
            let semantic = parts.meshes[i.mesh as usize].semantic;
            [i.mesh, semantic, i.instance]
        };
        let built = Arc::new(Built {
            caster: Caster::new(vec![(Vec3::ZERO, Arc::new(group))]),
            materials: parts.materials.clone(),
            labels: parts.instances.iter().map(label).collect(),
        });
        parts.built = Some(Arc::clone(&built));
        built
    }
}

#[pymethods]
impl RayScene {
    #[new]
    fn new() -> Self {
        Self(Mutex::default())
    }

    /// Adds a shape and gives its number.
    #[expect(clippy::too_many_arguments, reason = "the keywords of one function")]
    fn add_mesh(
        &self,
        py: Python<'_>,
        vertices: PyReadonlyArray2<'_, f32>,
        triangles: PyReadonlyArray2<'_, u32>,
        uv: Option<PyReadonlyArray2<'_, f32>>,
        alpha: Option<PyReadonlyArray2<'_, bool>>,
        semantic: u32,
        reflectance: f32,
    ) -> PyResult<u32> {
        let positions = vertices.as_array();
        let positions = positions.rows().into_iter();
        let positions = positions.map(|r| Vec3::new(r[0], r[1], r[2])).collect();
        let uvs = uv.map_or(Vec::new(), |uv| {
            let uv = uv.as_array();
            (uv.rows().into_iter())
                .map(|r| Vec2::new(r[0], r[1]))
                .collect()
        });
        let corners: Vec<[u32; 3]> = {
            let triangles = triangles.as_array();
            let rows = triangles.rows().into_iter();
            rows.map(|r| [r[0], r[1], r[2]]).collect()
        };
        let alpha = alpha.map(|alpha| alpha.as_array().to_owned());
        work::brief(py, move |pool| {
            if !(0.0..=1.0).contains(&reflectance) {
                return Err(Failure::argument("reflectance", reflectance, "0 to 1"));
            }
            let mask = alpha.map(|alpha| {
                let (rows, columns) = alpha.dim();
                let mask = AlphaMask::from_fn(columns, rows, |c, r| alpha[(r, c)]);
                mask.map_err(|e| Failure::argument("alpha", e.to_string(), "an image"))
            });
            let band = LaserBand {
                reflectance,
                transmittance: 0.0,
            };
            let mask = mask.transpose()?.map(Arc::new);
            let material = Material {
                mask,
                optics: Optics {
                    nm905: band,
                    nm1550: band,
                },
                ..Material::plain("mesh", Semantic::Stone, Vec3::splat(reflectance))
            };
            let mut parts = self.parts();
            if parts.meshes.len() >= usize::from(u16::MAX) {
                return Err(Failure::argument(
                    "meshes",
                    parts.meshes.len() + 1,
                    "at most 65,535",
                ));
            }
            let material = parts.materials.add(material);
            let triangle = |corners| Triangle { corners, material };
            let mesh = Mesh {
                positions,
                uvs,
                triangles: corners.into_iter().map(triangle).collect(),
                ..Mesh::default()
            };
            let shape = Prototype::new("mesh", mesh, Vec::new(), &parts.materials);
            if shape.is_err() {
                parts.materials.pop();
            }
            let shape = shape.map_err(|e| Failure::Argument {
                key: "mesh".to_owned(),
                message: e.to_string(),
                value: None,
                allowed: None,
            })?;
            let materials = &parts.materials;
            let shape = Arc::new(pool.install(|| Blas::build(Arc::new(shape), materials)));
            parts.meshes.push(MeshPart {
                shape,
                material,
                semantic,
            });
            parts.built = None;
            Ok((parts.meshes.len() - 1) as u32)
        })
    }

    /// Places a shape by matrices, N × 4 × 4, each as the instance of a number.
    fn add_instances(
        &self,
        py: Python<'_>,
        mesh: u32,
        transforms: PyReadonlyArray3<'_, f64>,
        instances: Vec<u32>,
    ) -> PyResult<()> {
        let transforms: Vec<Mat4> = {
            let all = transforms.as_array();
            let matrix = |i: usize| {
                let entry = |k: usize| all[(i, k % 4, k / 4)] as f32;
                Mat4::from_cols_array(&std::array::from_fn(entry))
            };
            (0..all.dim().0).map(matrix).collect()
        };
        work::brief(py, move |_| {
            let mut parts = self.parts();
            if mesh as usize >= parts.meshes.len() {
                let allowed = format!("the number of one of {} meshes", parts.meshes.len());
                return Err(Failure::argument("mesh", mesh, allowed));
            }
            let first = parts.instances.len();
            let mut placed = Vec::with_capacity(transforms.len());
            for (i, (transform, instance)) in transforms.into_iter().zip(instances).enumerate() {
                let place = InstancePlace::from_matrix(transform);
                let mut place = place.map_err(|e| Failure::Argument {
                    key: format!("transforms[{i}]"),
                    message: format!("transforms[{i}]: {e}"),
                    value: None,
                    allowed: None,
                })?;
                place.object = object(first + i)
                    .ok_or_else(|| Failure::argument("instances", first + i, "fewer"))?;
                placed.push(InstancePart {
                    mesh,
                    instance,
                    place,
                });
            }
            parts.instances.extend(placed);
            parts.built = None;
            Ok(())
        })
    }

    /// How many meshes and instances there are.
    fn counts(&self) -> (usize, usize) {
        let parts = self.parts();
        (parts.meshes.len(), parts.instances.len())
    }

    /// The arguments of `add_mesh` of each mesh, by name.
    fn meshes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let parts = self.parts();
        let meshes = parts.meshes.iter().map(|part| {
            let (mesh, dict) = (part.shape.prototype().mesh(), PyDict::new(py));
            let material = parts.materials.get(part.material);
            let corners: Vec<[u32; 3]> = mesh.triangles.iter().map(|t| t.corners).collect();
            let uvs: Vec<[f32; 2]> = mesh.uvs.iter().map(|uv| uv.to_array()).collect();
            let alpha = material.mask.as_deref().map(|mask| {
                let columns = mask.width();
                let texel = |i| mask.texel(i % columns, i / columns);
                let texels: Vec<bool> = (0..columns * mask.height()).map(texel).collect();
                PyArray1::from_vec(py, texels).reshape([mask.height(), columns])
            });
            dict.set_item("vertices", arrays::vectors(py, &mesh.positions)?)?;
            dict.set_item("triangles", arrays::rows(py, corners)?)?;
            let uvs = (!uvs.is_empty())
                .then(|| arrays::rows(py, uvs))
                .transpose()?;
            dict.set_item("uv", uvs)?;
            dict.set_item("alpha", alpha.transpose()?)?;
            dict.set_item("semantic", part.semantic)?;
            dict.set_item("reflectance", material.optics.nm905.reflectance)?;
            Ok(dict)
        });
        PyList::new(py, meshes.collect::<PyResult<Vec<_>>>()?)
    }

    /// Columns of the instances, in their order: mesh, matrix (N × 4 × 4), number.
    fn instances<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (mut meshes, mut rows, mut numbers) = (Vec::new(), Vec::new(), Vec::new());
        for part in &self.parts().instances {
            let InstancePlace {
                position_m, linear, ..
            } = part.place;
            for i in 0..3 {
                let [x, y, z] = linear.row(i).to_array();
                rows.push([x, y, z, position_m[i]]);
            }
            rows.push([0.0, 0.0, 0.0, 1.0]);
            meshes.push(part.mesh);
            numbers.push(part.instance);
        }
        let dict = PyDict::new(py);
        let matrices = PyArray1::from_vec(py, rows.into_flattened());
        let matrices = matrices.reshape([meshes.len(), 4, 4])?;
        dict.set_item("mesh", PyArray1::from_vec(py, meshes))?;
        dict.set_item("transforms", matrices)?;
        dict.set_item("instances", PyArray1::from_vec(py, numbers))?;
        Ok(dict)
    }

    /// The memory that the scene takes, bytes.
    fn memory_bytes(&self, py: Python<'_>) -> PyResult<usize> {
        work::brief(py, |pool| Ok(self.built(pool).caster.memory_bytes()))
    }

    /// The nearest hit of each ray.
    fn cast<'py>(
        &self,
        py: Python<'py>,
        rays: PyReadonlyArray2<'py, f32>,
        tnear: f32,
        tfar: f32,
    ) -> PyResult<Bound<'py, PyDict>> {
        let rays = Rays::copied(&rays);
        let hits = work::brief(py, |pool| {
            let limits = Limits::new(tnear, tfar)?;
            let built = self.built(pool);
            pool.install(|| Hits::cast(&built, &rays, limits))
        })?;
        let dict = PyDict::new(py);
        dict.set_item("t_hit", PyArray1::from_vec(py, hits.distances))?;
        dict.set_item("geometry_ids", PyArray1::from_vec(py, hits.meshes))?;
        dict.set_item("primitive_ids", PyArray1::from_vec(py, hits.primitives))?;
        dict.set_item("primitive_uvs", arrays::rows(py, hits.uvs)?)?;
        dict.set_item("primitive_normals", arrays::rows(py, hits.normals)?)?;
        dict.set_item("instance_ids", PyArray1::from_vec(py, hits.instances))?;
        dict.set_item("semantic", PyArray1::from_vec(py, hits.semantics))?;
        Ok(dict)
    }

    /// Whether there is any hit for each ray.
    fn occluded<'py>(
        &self,
        py: Python<'py>,
        rays: PyReadonlyArray2<'py, f32>,
        tnear: f32,
        tfar: f32,
    ) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let rays = Rays::copied(&rays);
        let occluded = work::brief(py, |pool| {
            let limits = Limits::new(tnear, tfar)?;
            let built = self.built(pool);
            pool.install(|| occluded(&built, &rays, limits))
        })?;
        Ok(PyArray1::from_vec(py, occluded))
    }
}
