//! Maps of the ground and of the canopy over it, by vertical rays.

use std::fmt;

use nemoral_scene::glam::{DVec2, DVec3, Vec3};
use nemoral_scene::{MaterialLibrary, ObjectId, ParamError, Ray, RayCaster, Semantic, SurfaceHit};
use rayon::prelude::*;

use crate::MapGrid;

/// From this height above the ground on, what a vertical ray meets is canopy, metres.
pub(crate) const CANOPY_FROM_M: f64 = 2.0;

/// So many rays are cast in one call, but at least those of a cell.
const BLOCK_RAYS: usize = 1 << 14;

/// How many vertical rays are cast in a cell: a square number, at the middles of as many parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellRays {
    per_side: usize,
}

impl CellRays {
    /// So many along each side of the cell.
    ///
    /// # Errors
    /// If they are not 1 to 32.
    pub fn per_side(rays: usize) -> Result<Self, ParamError> {
        ParamError::check_within("rays_a_side", rays as f64, 1.0, 32.0)?;
        Ok(Self { per_side: rays })
    }
}

/// A scene that vertical rays are cast at.
#[derive(Clone, Copy)]
pub struct CanopyScene<'a> {
    /// What casts rays, in the scene's frame: axes of the world around another origin.
    pub caster: &'a (dyn RayCaster + Sync),
    /// The materials that it finds.
    pub materials: &'a MaterialLibrary,
    /// World position of the scene's origin, metres.
    pub origin_m: DVec3,
    /// A height of the world that nothing in the scene reaches, metres.
    pub above_m: f64,
    /// Height of the ground at a place of the world, metres.
    pub ground_m: &'a (dyn Fn(DVec2) -> f64 + Sync),
}

/// Ground and canopy in the cells of a map.
#[derive(Clone, Debug, PartialEq)]
pub struct CanopyMaps {
    /// Where the cells are.
    pub grid: MapGrid,
    /// What is in them, in the grid's order.
    pub cells: Vec<CanopyCell>,
}

/// What vertical rays find in a cell of a map.
///
/// They are a sample, 10 cm apart in a cell of half a metre with 5 rays a side, as a dense scan
/// from the air is: the very tip of a conifer may be between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CanopyCell {
    /// The ground at the middle of the cell (digital terrain model), world height, metres. Under
    /// water it is the bed, under snow the soil.
    pub ground_m: f64,
    /// The highest point that a ray met, ground included (digital surface model), metres.
    pub surface_m: f64,
    /// The greatest height of such a point above the ground below it (canopy height model),
    /// metres: 0 if rays met but ground and what lies flat on it, water or snow.
    pub height_m: f64,
    /// The share of rays that met something 2 m above the ground or higher. As they pass through
    /// gaps in crowns, this is the effective canopy cover.
    pub cover: f64,
    /// The object whose highest point in the cell is higher than those of others, from 2 m above
    /// the ground on; [`ObjectId::NONE`] if there is none. What has no id, such as climbers, is
    /// looked past.
    pub top: ObjectId,
}

impl fmt::Debug for CanopyScene<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("CanopyScene")
            .field("origin_m", &self.origin_m)
            .field("above_m", &self.above_m)
            .finish_non_exhaustive()
    }
}

impl CanopyMaps {
    /// Casts rays down in each cell.
    #[must_use]
    pub fn cast(scene: &CanopyScene<'_>, grid: MapGrid, rays: CellRays) -> Self {
        let side = rays.per_side;
        let a_block = (BLOCK_RAYS / (side * side)).max(1);
        let nothing = CanopyCell {
            ground_m: 0.0,
            surface_m: 0.0,
            height_m: 0.0,
            cover: 0.0,
            top: ObjectId::NONE,
        };
        let mut cells = vec![nothing; grid.cells()];
        let blocks = cells.par_chunks_mut(a_block).enumerate();
        blocks.for_each(|(block, cells)| scene.cast_block(&grid, side, block * a_block, cells));
        Self { grid, cells }
    }

    /// The share of all rays that met something 2 m above the ground or higher: the effective
    /// canopy cover.
    #[must_use]
    pub fn cover(&self) -> f64 {
        self.cells.iter().map(|cell| cell.cover).sum::<f64>() / self.cells.len() as f64
    }
}

impl CanopyScene<'_> {
    /// Casts the rays of some cells from a number on.
    fn cast_block(&self, grid: &MapGrid, side: usize, first: usize, cells: &mut [CanopyCell]) {
        let a_cell = side * side;
        let part_m = grid.cell_m / side as f64;
        let places_of = |number: usize| {
            let corner_m = grid.middle_m(number) - 0.5 * grid.cell_m;
            (0..a_cell).map(move |part| {
                let part = DVec2::new((part % side) as f64, (part / side) as f64) + 0.5;
                corner_m + part * part_m
            })
        };
        let numbers = first..first + cells.len();
        let places: Vec<DVec2> = numbers.clone().flat_map(places_of).collect();
        let ray = |place_m: &DVec2| {
            let from = (place_m.extend(self.above_m) - self.origin_m).as_vec3();
            Ray::new(from, Vec3::NEG_Z)
        };
        let rays: Vec<Ray> = places.iter().map(ray).collect();
        let mut hits = vec![None; rays.len()];
        self.caster.closest_surfaces(&rays, &mut hits);
        let found = places.chunks(a_cell).zip(hits.chunks(a_cell));
        for ((cell, number), (places, hits)) in cells.iter_mut().zip(numbers).zip(found) {
            *cell = self.cell((self.ground_m)(grid.middle_m(number)), places, hits);
        }
    }

    fn cell(&self, ground_m: f64, places: &[DVec2], hits: &[Option<SurfaceHit>]) -> CanopyCell {
        let mut cell = CanopyCell {
            ground_m,
            surface_m: f64::NEG_INFINITY,
            height_m: 0.0,
            cover: 0.0,
            top: ObjectId::NONE,
        };
        let mut top_m = f64::NEG_INFINITY;
        let mut covered = 0;
        for (place_m, hit) in places.iter().zip(hits) {
            let Some(hit) = hit else { continue };
            let surface_m = self.above_m - f64::from(hit.distance_m);
            cell.surface_m = cell.surface_m.max(surface_m);
            if self.is_ground(hit) {
                continue;
            }
            let height_m = surface_m - (self.ground_m)(*place_m);
            cell.height_m = cell.height_m.max(height_m);
            if height_m >= CANOPY_FROM_M {
                covered += 1;
                if !hit.object.is_none() && surface_m > top_m {
                    (top_m, cell.top) = (surface_m, hit.object);
                }
            }
        }
        if cell.surface_m == f64::NEG_INFINITY {
            cell.surface_m = ground_m;
        }
        cell.cover = f64::from(covered) / hits.len() as f64;
        cell
    }

    /// Whether a ray met what lies under all that grows.
    fn is_ground(&self, hit: &SurfaceHit) -> bool {
        use Semantic as S;
        let material = self.materials.get(hit.material);
        material.lies_on_ground() || matches!(material.semantic, S::Water | S::Ice | S::Snow)
    }
}
