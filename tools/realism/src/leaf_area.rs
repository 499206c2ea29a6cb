//! Leaf area from first returns, voxel by voxel, as in forestry, with the true leaf area.

use std::f64::consts::PI;

use nemoral_scene::glam::{DVec3, I64Vec3, Vec3};
use nemoral_scene::{Bounds, MaterialLibrary, Prototype};

/// Voxels that fill a box.
#[derive(Clone, Debug)]
pub struct Voxels {
    origin: DVec3,
    size_m: f64,
    counts: I64Vec3,
    cells: Vec<Voxel>,
    /// Stops of rays by leaves: the voxel, and the leaf's normal.
    stops: Vec<(usize, Vec3)>,
}

/// The measurements of a voxel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Voxel {
    /// Rays that entered it.
    pub rays: u32,
    /// The stations that such rays came from, a bit each.
    pub stations: u8,
    /// For each station, the sum of its rays' directions times their chords through the voxel, as
    /// if nothing stopped them, metres.
    pub paths_m: [Vec3; 8],
    /// True leaf area in the voxel, m².
    pub leaf_m2: f32,
}

impl Voxel {
    /// The sum of the rays' chords times the projection of a leaf with this normal, metres.
    fn projected_m(&self, normal: Vec3) -> f32 {
        let of_station = |path: &Vec3| path.dot(normal).abs();
        self.paths_m.iter().map(of_station).sum()
    }
}

impl Voxels {
    /// Empty voxels of this size that fill a box.
    #[must_use]
    pub fn fill(bounds: Bounds, size_m: f64) -> Self {
        let origin = bounds.min.as_dvec3() - 1e-3;
        let extent = bounds.max.as_dvec3() + 1e-3 - origin;
        let counts = (extent / size_m).ceil().as_i64vec3();
        let cells = vec![Voxel::default(); counts.element_product() as usize];
        Self {
            origin,
            size_m,
            counts,
            cells,
            stops: Vec::new(),
        }
    }

    fn number(&self, cell: I64Vec3) -> Option<usize> {
        let inside = cell.cmpge(I64Vec3::ZERO).all() && cell.cmplt(self.counts).all();
        let i = (cell.z * self.counts.y + cell.y) * self.counts.x + cell.x;
        inside.then_some(i as usize)
    }

    /// All voxels.
    #[must_use]
    pub fn cells(&self) -> &[Voxel] {
        &self.cells
    }

    /// Leaf area of each voxel by contact frequency, m²: stops per projected metre of the rays that
    /// entered (Warren Wilson 1960; on voxels Hosoi and Omasa 2006).
    ///
    /// Each stop is weighted by the inverse of its probability, given the leaf's normal and all
    /// rays of all stations (Horvitz and Thompson 1952). So the estimate needs no distribution of
    /// inclinations, nor that visible leaves are inclined like hidden ones. It is exact as long as
    /// no ray would be stopped twice, so for voxels smaller than the gaps between leaves; in larger
    /// ones leaves hide each other.
    #[must_use]
    pub fn leaf_areas_m2(&self) -> Vec<f64> {
        let volume_m3 = self.size_m.powi(3);
        let mut areas_m2 = vec![0.0; self.cells.len()];
        for &(i, normal) in &self.stops {
            areas_m2[i] += volume_m3 / f64::from(self.cells[i].projected_m(normal));
        }
        areas_m2
    }

    /// Adds the leaf area of a shape's cards, of each opaque texel to its voxel.
    ///
    /// # Panics
    /// If a card has no mask.
    pub fn add_truth(&mut self, shape: &Prototype, materials: &MaterialLibrary) {
        for card in shape.cards() {
            let mask = materials.get(card.material).mask.as_ref();
            let mask = mask.expect("leaves are masked");
            let (u, v) = (card.edge_u.as_dvec3(), card.edge_v.as_dvec3());
            let (columns, rows) = (mask.width(), mask.height());
            let texel_m2 = u.cross(v).length() / (columns * rows) as f64;
            for row in 0..rows {
                for column in 0..columns {
                    if !mask.texel(column, row) {
                        continue;
                    }
                    let at = card.corner.as_dvec3()
                        + u * ((column as f64 + 0.5) / columns as f64)
                        + v * ((row as f64 + 0.5) / rows as f64);
                    let cell = ((at - self.origin) / self.size_m).floor().as_i64vec3();
                    if let Some(i) = self.number(cell) {
                        self.cells[i].leaf_m2 += texel_m2 as f32;
                    }
                }
            }
        }
    }

    /// Adds a ray of a station, 0 to 7, that came from outside to `end_m` and was stopped there by
    /// a leaf with this normal or by wood, or went on.
    pub fn add_ray(
        &mut self,
        station: u32,
        (origin, direction): (DVec3, DVec3),
        end_m: f64,
        leaf: Option<Vec3>,
    ) {
        let far = self.origin + self.counts.as_dvec3() * self.size_m;
        let inverse = direction.recip();
        let (a, b) = ((self.origin - origin) * inverse, (far - origin) * inverse);
        let enter = a.min(b).max_element().max(0.0);
        let leave = a.max(b).min_element();
        if enter >= leave.min(end_m) {
            return;
        }
        let ahead = direction.cmpge(DVec3::ZERO);
        let inside = origin + direction * (enter + 1e-9) - self.origin;
        let mut cell = (inside / self.size_m).floor().as_i64vec3();
        let mut here = enter;
        loop {
            let next = cell + I64Vec3::new(ahead.x.into(), ahead.y.into(), ahead.z.into());
            let walls = (self.origin + next.as_dvec3() * self.size_m - origin) * inverse;
            let wall = walls.min_element();
            let Some(i) = self.number(cell) else { return };
            let voxel = &mut self.cells[i];
            voxel.rays += 1;
            voxel.stations |= 1 << station;
            voxel.paths_m[station as usize] += (direction * (wall - here).max(0.0)).as_vec3();
            if end_m < wall {
                self.stops.extend(leaf.map(|normal| (i, normal)));
                return;
            }
            here = wall;
            let axis = if walls.x == wall {
                I64Vec3::X
            } else if walls.y == wall {
                I64Vec3::Y
            } else {
                I64Vec3::Z
            };
            cell += if ahead.x && axis.x == 1 || ahead.y && axis.y == 1 || ahead.z && axis.z == 1 {
                axis
            } else {
                -axis
            };
        }
    }
}

/// The mean projection of a leaf of one inclination over all azimuths along a zenith angle, both in
/// radians (Ross 1981).
#[must_use]
pub(crate) fn projection(zenith: f64, inclination: f64) -> f64 {
    let (along, across) = (
        zenith.cos() * inclination.cos(),
        zenith.sin() * inclination.sin(),
    );
    if along >= across {
        return along;
    }
    let turn = (-along / across).acos();
    along * (2.0 * turn / PI - 1.0) + 2.0 / PI * across * turn.sin()
}
