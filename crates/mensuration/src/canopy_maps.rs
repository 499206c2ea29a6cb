//! Maps of the ground and of the canopy over it, by vertical rays.

use nemoral_scene::glam::{DVec2, DVec3, Vec3};
use nemoral_scene::{ObjectId, ParamError, Ray, RayCaster};
use rayon::prelude::*;

use crate::MapGrid;

/// From this height above the ground on, what a vertical ray meets is canopy, metres.
const COVER_FROM_M: f64 = 2.0;

/// How many vertical rays are cast in a cell: a square number, at the middles of as many parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellRays {
    a_side: usize,
}

impl CellRays {
    /// So many along each side of the cell.
    ///
    /// # Errors
    /// If they are not 1 to 32.
    pub fn a_side(rays: usize) -> Result<Self, ParamError> {
        ParamError::check_within("rays_a_side", rays as f64, 1.0, 32.0)?;
        Ok(Self { a_side: rays })
    }
}

/// A scene that vertical rays are cast at.
#[derive(Clone, Copy)]
pub struct CanopyScene<'a> {
    /// What casts rays, in the scene's frame: axes of the world around another origin.
    pub caster: &'a (dyn RayCaster + Sync),
    /// World position of the scene's origin, metres.
    pub origin_m: DVec3,
    /// A height of the world that nothing in the scene reaches, metres.
    pub above_m: f64,
    /// Height of the ground at a place of the world, metres.
    pub ground_m: &'a (dyn Fn(DVec2) -> f64 + Sync),
}

/// What is highest in each cell of a map.
///
/// The surface is exact for the rays that are cast, which are a regular grid in each cell. So it
/// is at least as high as that of any scanner, whose first echoes miss the tips between pulses.
#[derive(Clone, Debug, PartialEq)]
pub struct CanopyMaps {
    /// The cells; all other fields have one value for each, in their order.
    pub grid: MapGrid,
    /// The ground at the middle of the cell (digital terrain model), world heights, metres.
    pub ground_m: Vec<f64>,
    /// The highest point that a ray met, ground included (digital surface model), metres.
    pub surface_m: Vec<f64>,
    /// The object that the highest point is of; [`ObjectId::NONE`] for ground and undergrowth.
    pub tops: Vec<ObjectId>,
    /// The share of all rays that meet something 2 m above the ground or higher (canopy cover).
    pub cover: f64,
}

impl std::fmt::Debug for CanopyScene<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("CanopyScene")
            .field("origin_m", &self.origin_m)
            .field("above_m", &self.above_m)
            .finish_non_exhaustive()
    }
}

/// One cell.
struct Cell {
    ground_m: f64,
    surface_m: f64,
    top: ObjectId,
    covered: usize,
}

impl CanopyMaps {
    /// Casts rays down in each cell.
    #[must_use]
    pub fn cast(scene: &CanopyScene<'_>, grid: MapGrid, rays: CellRays) -> Self {
        let side = rays.a_side;
        let row = |row: usize| -> Vec<Cell> { cast_row(scene, &grid, side, row) };
        let cells: Vec<Cell> = (0..grid.rows).into_par_iter().flat_map_iter(row).collect();
        let covered: usize = cells.iter().map(|cell| cell.covered).sum();
        let rays = grid.cells() * side * side;
        Self {
            grid,
            ground_m: cells.iter().map(|cell| cell.ground_m).collect(),
            surface_m: cells.iter().map(|cell| cell.surface_m).collect(),
            tops: cells.iter().map(|cell| cell.top).collect(),
            cover: covered as f64 / rays as f64,
        }
    }

    /// Heights of the surface above the ground of each cell (canopy height model), metres, at
    /// least 0.
    pub fn heights_m(&self) -> impl Iterator<Item = f64> {
        let cells = self.surface_m.iter().zip(&self.ground_m);
        cells.map(|(surface, ground)| (surface - ground).max(0.0))
    }
}

fn cast_row(scene: &CanopyScene<'_>, grid: &MapGrid, side: usize, row: usize) -> Vec<Cell> {
    let from_world = |place_m: DVec2| (place_m.extend(scene.above_m) - scene.origin_m).as_vec3();
    let mut rays = Vec::with_capacity(grid.columns * side * side);
    for column in 0..grid.columns {
        let corner_m = grid.middle_m(column, row) - 0.5 * grid.cell_m;
        for part in 0..side * side {
            let part = DVec2::new((part % side) as f64, (part / side) as f64) + 0.5;
            let place_m = corner_m + part * (grid.cell_m / side as f64);
            rays.push(Ray::new(from_world(place_m), Vec3::NEG_Z));
        }
    }
    let mut hits = vec![None; rays.len()];
    scene.caster.closest_surfaces(&rays, &mut hits);
    let cells = hits.chunks(side * side).enumerate();
    let cell = |(column, hits): (usize, &[Option<nemoral_scene::SurfaceHit>])| {
        let ground_m = (scene.ground_m)(grid.middle_m(column, row));
        let mut cell = Cell {
            ground_m,
            surface_m: f64::NEG_INFINITY,
            top: ObjectId::NONE,
            covered: 0,
        };
        for hit in hits.iter().flatten() {
            let height_m = scene.above_m - f64::from(hit.distance_m);
            cell.covered += usize::from(height_m >= ground_m + COVER_FROM_M);
            if height_m > cell.surface_m {
                (cell.surface_m, cell.top) = (height_m, hit.object);
            }
        }
        if cell.surface_m == f64::NEG_INFINITY {
            cell.surface_m = ground_m;
        }
        cell
    };
    cells.map(cell).collect()
}
