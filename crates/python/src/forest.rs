//! Forests that are recorded in memory.

use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use nemoral_pipeline::{BodyState, SurveyParams};
use nemoral_scene::glam::{DVec2, DVec3, Vec3};
use nemoral_scene::{Ray, RigidTransform, Semantic, SurfaceHit};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::failure::Failure;
use crate::frame::Frame;
use crate::places::{mean_within, place, pose_of};
use crate::record_columns::{object_columns, tree_columns};
use crate::worlds::{CacheLocation, World, Worlds, backend_of};
use crate::{arrays, config, imu, survey, work};

/// The sequences of a request, recorded in memory.
#[pyclass(frozen)]
pub(crate) struct Forest(Arc<Worlds>);

#[pymethods]
impl Forest {
    #[new]
    fn new(
        py: Python<'_>,
        preset: Option<String>,
        file: Option<PathBuf>,
        settings: &Bound<'_, PyList>,
        backend: &str,
        cache: Option<PathBuf>,
        program: PathBuf,
    ) -> PyResult<Self> {
        let request = config::Request::new(preset, file, settings)?;
        let backend = backend.to_owned();
        let location = CacheLocation { cache, program };
        let worlds = work::run(py, move || {
            let sequences = request.sequences()?;
            let config = sequences.get(0)?.config;
            Ok(Worlds {
                ontology: Arc::new(config.output.ontology.table()),
                backend: backend_of(&backend, &config)?,
                cache: location.cache(),
                grown: Mutex::default(),
                sequences,
            })
        })?;
        let forest = Self(Arc::new(worlds));
        // A config that no world can be made of is refused here, not at the first frame.
        forest.with(py, 0, |_, _| Ok(()))?;
        Ok(forest)
    }

    /// How many sequences there are.
    #[getter]
    fn sequences(&self) -> u32 {
        self.0.sequences.len()
    }

    /// How many frames each sequence has.
    #[getter]
    fn frames(&self) -> u64 {
        self.0.sequences.asked().frames
    }

    /// The sequences whose worlds are kept, the latest last.
    #[getter]
    fn grown(&self) -> Vec<u32> {
        self.0.grown().iter().map(|w| w.number).collect()
    }

    #[getter]
    fn backend(&self) -> String {
        self.0.backend.name()
    }

    /// The request as TOML, every key of a single sequence.
    fn to_toml(&self, py: Python<'_>) -> PyResult<String> {
        let text = self.0.sequences.to_toml();
        text.map_err(|e| Failure::from(e).raise(py))
    }

    /// The config of a sequence, what was drawn for it and its split, as JSON.
    fn config(&self, py: Python<'_>, sequence: u32) -> PyResult<String> {
        let worlds = Arc::clone(&self.0);
        work::run(py, move || {
            let spec = worlds.spec(sequence)?;
            let about = serde_json::json!({
                "config": spec.config,
                "drawn": spec.drawn,
                "split": spec.split.map(|s| s.name()),
                "seed": spec.seed,
            });
            Ok(about.to_string())
        })
    }

    /// Id, name and colour of each class.
    fn classes(&self) -> Vec<(u8, String, (u8, u8, u8))> {
        let classes = self.0.ontology.classes().iter();
        classes
            .map(|c| (c.id, c.name.clone(), c.colour.into()))
            .collect()
    }

    /// Grows what all frames of a sequence have in common.
    fn prepare(&self, py: Python<'_>, sequence: u32) -> PyResult<()> {
        self.with(py, sequence, |_, world| Ok(world.recorder.prepare()?))
    }

    /// A frame of a sequence.
    fn frame(&self, py: Python<'_>, sequence: u32, frame: u64) -> PyResult<Frame> {
        self.with(py, sequence, move |worlds, world| {
            let recorded = world.recorder.frame(frame)?;
            let (spec, ontology) = (Arc::clone(&world.spec), Arc::clone(&worlds.ontology));
            Ok(Frame::recorded(spec, ontology, Some(frame), recorded))
        })
    }

    /// Time, and pose by the rows of its matrix, of a frame of a sequence.
    fn pose<'py>(
        &self,
        py: Python<'py>,
        sequence: u32,
        frame: u64,
    ) -> PyResult<(f64, Bound<'py, PyAny>)> {
        let pose = self.with(py, sequence, move |_, world| {
            Ok(world.recorder.pose(frame)?)
        })?;
        let matrix = arrays::matrix(py, &pose.world_from_body())?;
        Ok((pose.time_s, matrix.into_any()))
    }

    /// The pose of a body that stands on the ground at x, y, facing a heading.
    fn stand<'py>(
        &self,
        py: Python<'py>,
        sequence: u32,
        x_m: f64,
        y_m: f64,
        heading_rad: f64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let pose = self.with(py, sequence, move |_, world| {
            let place_m = place("pose", x_m, y_m)?;
            if !heading_rad.is_finite() {
                return Err(Failure::argument("heading", heading_rad, "finite"));
            }
            Ok((world.recorder).pose_on_ground(place_m, DVec2::from_angle(heading_rad))?)
        })?;
        Ok(arrays::matrix(py, &pose)?.into_any())
    }

    /// What the sensors record at a pose, given by the 16 numbers of its matrix, by rows.
    #[expect(clippy::too_many_arguments, reason = "the keywords of one function")]
    fn observe(
        &self,
        py: Python<'_>,
        sequence: u32,
        pose: [f64; 16],
        time_s: f64,
        index: Option<u64>,
        linear_m_s: [f64; 3],
        angular_rad_s: [f64; 3],
    ) -> PyResult<Frame> {
        self.with(py, sequence, move |worlds, world| {
            if !(0.0..=1e9).contains(&time_s) {
                return Err(Failure::argument("time_s", time_s, "0 to 1e9 s"));
            }
            let state = BodyState {
                motion: arrays::motion(linear_m_s, angular_rad_s)?,
                world_from_body: pose_of(&pose)?,
                time_s,
                index,
            };
            let recorded = world.recorder.observe(&state)?;
            let (spec, ontology) = (Arc::clone(&world.spec), Arc::clone(&worlds.ontology));
            Ok(Frame::recorded(spec, ontology, index, recorded))
        })
    }

    /// Height, upward normal, signed distance to the nearest trail's edge and class of the ground
    /// at rows of x and y.
    fn ground<'py>(
        &self,
        py: Python<'py>,
        sequence: u32,
        places: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let places: Vec<DVec2> = {
            let places = places.as_array();
            let rows = places.rows().into_iter();
            rows.map(|row| DVec2::new(row[0], row[1])).collect()
        };
        let (samples, classes) = self.with(py, sequence, move |worlds, world| {
            for p in &places {
                place("x, y", p.x, p.y)?;
            }
            let class = |s| worlds.ontology.class(s).id;
            let classes = [class(Semantic::Soil), class(Semantic::TrailSurface)];
            Ok((world.recorder.ground(&places)?, classes))
        })?;
        let column = |number: &dyn Fn(f64, f64) -> f64| -> Vec<f64> {
            let numbers = samples.iter().map(|(s, edge)| number(s.height_m, *edge));
            numbers.collect()
        };
        let dict = PyDict::new(py);
        let heights = column(&|height_m, _| height_m);
        dict.set_item("height_m", PyArray1::from_vec(py, heights))?;
        let normals: Vec<Vec3> = samples.iter().map(|(s, _)| s.normal()).collect();
        dict.set_item("normal", arrays::vectors(py, &normals)?)?;
        let edges = column(&|_, edge| edge);
        dict.set_item("trail_edge_m", PyArray1::from_vec(py, edges))?;
        let class = |edge_m: f64| classes[usize::from(edge_m < 0.0)];
        let semantic: Vec<u8> = samples.iter().map(|(_, edge)| class(*edge)).collect();
        dict.set_item("semantic", PyArray1::from_vec(py, semantic))?;
        Ok(dict)
    }

    /// The columns of the objects, or of the trees alone, whose feet are in a rectangle.
    fn inventory<'py>(
        &self,
        py: Python<'py>,
        sequence: u32,
        low: [f64; 2],
        high: [f64; 2],
        only_trees: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let items = self.with(py, sequence, move |_, world| {
            let low_m = place("xmin, ymin", low[0], low[1])?;
            let high_m = place("xmax, ymax", high[0], high[1])?;
            Ok(world.recorder.inventory(low_m, high_m)?)
        })?;
        if only_trees {
            let trees: Vec<_> = items.iter().filter_map(|item| item.tree.as_ref()).collect();
            return tree_columns(py, &trees);
        }
        let dict = object_columns(py, &items.iter().map(|i| &i.record).collect::<Vec<_>>())?;
        let on_trail: Vec<bool> = items.iter().map(|i| i.on_trail).collect();
        dict.set_item("on_trail", PyArray1::from_vec(py, on_trail))?;
        Ok(dict)
    }

    /// Maps of ground and canopy and the profile of leaves over a rectangle.
    fn survey<'py>(
        &self,
        py: Python<'py>,
        sequence: u32,
        low: [f64; 2],
        high: [f64; 2],
        params: (f64, usize, f64),
    ) -> PyResult<Bound<'py, PyDict>> {
        let (cell_m, rays_a_side, layer_m) = params;
        let params = SurveyParams {
            cell_m,
            rays_a_side,
            layer_m,
        };
        let survey = self.with(py, sequence, move |_, world| {
            let low_m = place("xmin, ymin", low[0], low[1])?;
            let high_m = place("xmax, ymax", high[0], high[1])?;
            Ok(world.recorder.survey(low_m, high_m, &params)?)
        })?;
        survey::columns(py, &survey)
    }

    /// What the inertial measurement unit measures along a sequence's drive, as columns.
    fn imu<'py>(&self, py: Python<'py>, sequence: u32) -> PyResult<Bound<'py, PyDict>> {
        let readings = self.with(py, sequence, move |_, world| {
            Ok(world.recorder.imu_readings()?)
        })?;
        imu::columns(py, &readings)
    }

    /// Rows of x, y and radius of the disks that reach into a rectangle and stand in the way.
    fn obstacles<'py>(
        &self,
        py: Python<'py>,
        sequence: u32,
        low: [f64; 2],
        high: [f64; 2],
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let disks = self.with(py, sequence, move |_, world| {
            let low_m = place("xmin, ymin", low[0], low[1])?;
            let high_m = place("xmax, ymax", high[0], high[1])?;
            Ok(world.recorder.obstacles(low_m, high_m)?)
        })?;
        let rows = disks
            .iter()
            .flat_map(|d| [d.position_m.x, d.position_m.y, d.radius_m]);
        PyArray1::from_vec(py, rows.collect()).reshape([disks.len(), 3])
    }

    /// What rays in the world hit around a place: rows of x, y, z and a direction. `around` is
    /// where the scene is centred; if it is none, at the mean of the origins, which may then be no
    /// farther from it than one sees.
    fn cast<'py>(
        &self,
        py: Python<'py>,
        sequence: u32,
        rays: PyReadonlyArray2<'py, f64>,
        around: Option<[f64; 2]>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let rays: Vec<(DVec3, DVec3)> = {
            let rays = rays.as_array();
            let rows = rays.rows().into_iter();
            let vector = |row: &numpy::ndarray::ArrayView1<'_, f64>, i: usize| {
                DVec3::new(row[i], row[i + 1], row[i + 2])
            };
            rows.map(|row| (vector(&row, 0), vector(&row, 3))).collect()
        };
        let (hits, classes) = self.with(py, sequence, move |worlds, world| {
            let place_m = match around {
                Some([x_m, y_m]) => place("around", x_m, y_m)?,
                None => {
                    let config = worlds.sequences.get(world.number)?.config;
                    mean_within(&rays, config.chunks.visible_radius_m)?
                }
            };
            let pose = RigidTransform {
                translation_m: place_m.extend(0.0),
                ..RigidTransform::IDENTITY
            };
            let recorder = &world.recorder;
            let scene = recorder.scene_at(pose)?;
            let local = rays.iter().enumerate().map(|(i, (origin, direction))| {
                let length = direction.length();
                let far = origin.distance(place_m.extend(origin.z));
                if !(length > 0.0 && length.is_finite() && far < 1e4 && origin.z.abs() < 1e5) {
                    let found = format!("{origin}, {direction}");
                    let allowed = "an origin near `around` and a direction that is not zero";
                    return Err(Failure::argument(&format!("rays[{i}]"), found, allowed));
                }
                let origin = (origin - scene.origin_m).as_vec3();
                Ok(Ray::new(origin, (direction / length).as_vec3()))
            });
            let local: Vec<Ray> = local.collect::<Result<_, _>>()?;
            let mut hits: Vec<Option<SurfaceHit>> = vec![None; local.len()];
            let pool = crate::pool::ready().map_err(|e| Failure::Other(e.to_string()))?;
            pool.install(|| scene.caster.closest_surfaces(&local, &mut hits));
            let assets = recorder.runner().get(recorder.forest().assets, ())?;
            let class = |hit: &SurfaceHit| {
                let semantic = assets.library.materials.get(hit.material).semantic;
                worlds.ontology.class(semantic).id
            };
            let sky = worlds.ontology.class(Semantic::Sky).id;
            let classes = hits.iter().map(|h| h.as_ref().map_or(sky, class));
            let classes: Vec<u8> = classes.collect();
            Ok((hits, classes))
        })?;
        let dict = PyDict::new(py);
        let distance = |h: &Option<SurfaceHit>| h.map_or(f32::INFINITY, |h| h.distance_m);
        let distances: Vec<f32> = hits.iter().map(distance).collect();
        dict.set_item("distance_m", PyArray1::from_vec(py, distances))?;
        let normal = |h: &Option<SurfaceHit>| h.map_or(Vec3::ZERO, |h| h.geometric_normal);
        let normals: Vec<Vec3> = hits.iter().map(normal).collect();
        dict.set_item("normal", arrays::vectors(py, &normals)?)?;
        dict.set_item("semantic", PyArray1::from_vec(py, classes))?;
        let instance = |h: &Option<SurfaceHit>| h.map_or(0, |h| h.object.to_image_id());
        let instances: Vec<u32> = hits.iter().map(instance).collect();
        dict.set_item("instance", PyArray1::from_vec(py, instances))?;
        Ok(dict)
    }
}

impl Forest {
    /// Does something with the world of a sequence, without the interpreter's lock.
    fn with<T: Send + 'static>(
        &self,
        py: Python<'_>,
        sequence: u32,
        work: impl FnOnce(&Worlds, &World) -> Result<T, Failure> + Send + 'static,
    ) -> PyResult<T> {
        let worlds = Arc::clone(&self.0);
        work::run(py, move || {
            let world = worlds.get(sequence)?;
            // A loader's worker is told its share of the cores after it got the forest.
            let pool = crate::pool::ready().map_err(|e| Failure::Other(e.to_string()));
            world.recorder.set_threads(pool?.current_num_threads());
            work(&worlds, &world)
        })
    }
}
