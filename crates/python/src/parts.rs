//! Parts that are useful alone: terrain, Poisson disks, trees.

use nemoral_assets::{
    FoliageCard, GrowthParams, Species, TreeMaterials, TreeStructure, WoodNode, grow_with_structure,
};
use nemoral_placement::{DiskKind, PoissonDiskParams, PoissonDisks};
use nemoral_scene::glam::{DVec2, Vec3};
use nemoral_scene::{MaterialId, Surface};
use nemoral_seed::{Domain, Key};
use nemoral_terrain::TerrainParams;
use numpy::{PyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::failure::Failure;
use crate::{arrays, work};

const TREE: Domain = Domain::new("python.tree");
/// The most disks that a call may ask for, by area over the smallest disk's.
const MOST_DISKS: f64 = 5e7;

/// An endless terrain.
#[pyclass(frozen)]
pub(crate) struct Terrain(nemoral_terrain::NoiseTerrain);

#[pymethods]
impl Terrain {
    #[new]
    fn new(
        py: Python<'_>,
        octaves: u32,
        scale_m: f64,
        lacunarity: f64,
        persistence: f64,
        max_height_m: f64,
        seed: u64,
    ) -> PyResult<Self> {
        let params = TerrainParams {
            octaves,
            scale_m,
            lacunarity,
            persistence,
            max_height_m,
        };
        let terrain = nemoral_terrain::NoiseTerrain::new(params, Key::world(seed));
        terrain.map(Self).map_err(|e| Failure::from(e).raise(py))
    }

    /// Rows of height and gradient at rows of x and y.
    fn sample<'py>(
        &self,
        py: Python<'py>,
        places: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        use rayon::prelude::*;
        let places: Vec<DVec2> = {
            let places = places.as_array();
            let rows = places.rows().into_iter();
            rows.map(|row| DVec2::new(row[0], row[1])).collect()
        };
        let samples = work::brief(py, |pool| {
            let is_near = |p: &DVec2| p.abs().cmple(DVec2::splat(1e9)).all();
            if let Some(p) = places.iter().find(|p| !is_near(p)) {
                return Err(Failure::argument("x, y", p, "finite, at most 1e9 m"));
            }
            let sample = |p: &DVec2| {
                let s = self.0.sample(*p);
                [s.height_m, s.gradient.x, s.gradient.y]
            };
            Ok(pool.install(|| places.par_iter().map(sample).collect::<Vec<[f64; 3]>>()))
        })?;
        Ok(arrays::rows(py, samples)?.into_any())
    }
}

/// Rows of x, y and radius of the disks in a rectangle.
#[pyfunction]
pub(crate) fn poisson_disks<'py>(
    py: Python<'py>,
    low: [f64; 2],
    high: [f64; 2],
    radius_m: (f64, f64),
    rounds: u32,
    seed: u64,
) -> PyResult<Bound<'py, PyAny>> {
    let disks = work::run(py, move || {
        let (least, most) = radius_m;
        let (low, high) = (DVec2::from_array(low), DVec2::from_array(high));
        let is_near = |p: DVec2| p.abs().cmple(DVec2::splat(1e7)).all();
        if !(is_near(low) && is_near(high)) {
            let found = format!("{low}, {high}");
            return Err(Failure::argument(
                "rectangle",
                found,
                "within 1e7 m of the origin",
            ));
        }
        // Tiles are as the sampler's own are to its disks.
        let tile_m = (50.0 * most).clamp(1e-3, 1e6);
        let params = PoissonDiskParams {
            tile_m,
            varieties: vec![DiskKind {
                weight: 1.0,
                radius_m,
            }],
            rounds,
        };
        let sampler = PoissonDisks::new(params, Key::world(seed))?;
        let side = (high - low).max(DVec2::ZERO);
        if side.x * side.y / (least * least) > MOST_DISKS || side.max_element() > 1e5 * tile_m {
            let found = format!("{low}, {high}");
            return Err(Failure::argument(
                "rectangle",
                found,
                "smaller: it has too many disks",
            ));
        }
        let disks = sampler.in_rect(low, high).into_iter();
        let row = |d: nemoral_placement::Disk<Key>| [d.position_m.x, d.position_m.y, d.radius_m];
        Ok(disks.map(row).collect::<Vec<[f64; 3]>>())
    })?;
    Ok(arrays::rows(py, disks)?.into_any())
}

/// A tree as arrays of wood and leaf cards.
#[pyfunction]
pub(crate) fn grow_tree<'py>(
    py: Python<'py>,
    species: &str,
    dbh_m: f64,
    seed: u64,
    wood_triangles_max: usize,
    cards_max: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let species = Species::built_in(species).ok_or_else(|| {
        let allowed = format!("one of {}", Species::names().collect::<Vec<_>>().join(", "));
        Failure::argument("species", format!("{species:?}"), allowed).raise(py)
    })?;
    let (tree, structure) = work::run(py, move || {
        if !(0.02..=1.5).contains(&dbh_m) {
            return Err(Failure::argument("dbh_m", dbh_m, "0.02 to 1.5 m"));
        }
        let part = MaterialId;
        let materials = TreeMaterials {
            stem: part(0),
            change: part(0),
            upper: part(0),
            flare: part(1),
            limb: part(2),
            branch: part(3),
            dead: part(4),
            snag: part(0),
            foliage: vec![FoliageCard {
                material: part(5),
                width_m: 0.3,
                height_m: 0.3,
                opaque_fraction: 0.5,
            }],
        };
        let params = GrowthParams {
            wood_triangles_max,
            cards_max,
            ..GrowthParams::default()
        };
        let key = Key::world(seed).domain(TREE);
        let size = species.draw_size(dbh_m, key);
        Ok(grow_with_structure(
            &species, &size, &materials, &params, key,
        )?)
    })?;
    let dict = PyDict::new(py);
    dict.set_item("vertices", arrays::vectors(py, &tree.mesh.positions)?)?;
    dict.set_item("normals", arrays::vectors(py, &tree.mesh.normals)?)?;
    let triangles = tree.mesh.triangles.iter();
    let corners: Vec<[u32; 3]> = triangles.clone().map(|t| t.corners).collect();
    dict.set_item("triangles", arrays::rows(py, corners)?)?;
    let wood: Vec<u8> = triangles.map(|t| t.material.0 as u8).collect();
    dict.set_item("parts", PyArray1::from_vec(py, wood))?;
    let cards: Vec<Vec3> = (tree.cards.iter()).flat_map(|c| c.corners()).collect();
    dict.set_item("leaf_corners", arrays::vectors(py, &cards)?)?;
    dict.set_item("structure", structure_columns(py, &structure)?)?;
    let size = PyDict::new(py);
    for (name, number) in [
        ("dbh_m", tree.size.dbh_m),
        ("height_m", tree.size.height_m),
        ("crown_base_m", tree.size.crown_base_m),
        ("crown_radius_m", tree.size.crown_radius_m),
        ("leaf_area_m2", tree.size.leaf_area_m2),
        ("lean_rad", tree.size.lean_rad),
        ("stem_volume_m3", tree.stem.volume_m3()),
        ("wood_volume_m3", tree.wood.total_m3()),
        ("foot_radius_m", tree.foot_radius_m),
    ] {
        size.set_item(name, number)?;
    }
    dict.set_item("size", size)?;
    Ok(dict)
}

/// The graph of the wood as columns.
fn structure_columns<'py>(
    py: Python<'py>,
    structure: &TreeStructure,
) -> PyResult<Bound<'py, PyDict>> {
    let nodes = &structure.nodes;
    let positions_m = nodes.iter().map(|n| n.position_m.to_array()).collect();
    let parent = |n: &WoodNode| n.parent.map_or(-1, i64::from);
    let dict = PyDict::new(py);
    dict.set_item("position_m", arrays::rows(py, positions_m)?)?;
    dict.set_item(
        "radius_m",
        PyArray1::from_iter(py, nodes.iter().map(|n| n.radius_m)),
    )?;
    dict.set_item("parent", PyArray1::from_iter(py, nodes.iter().map(parent)))?;
    dict.set_item(
        "axis",
        PyArray1::from_iter(py, nodes.iter().map(|n| n.axis)),
    )?;
    dict.set_item(
        "order",
        PyArray1::from_iter(py, nodes.iter().map(|n| n.order)),
    )?;
    dict.set_item(
        "is_dead",
        PyArray1::from_iter(py, nodes.iter().map(|n| n.is_dead)),
    )?;
    Ok(dict)
}
