//! Leaf area from first returns, voxel by voxel, as foresters do it; and the truth beside it.

use std::f64::consts::{FRAC_PI_2, PI};
use std::ops::Range;

use nemoral_scene::glam::{DVec3, I64Vec3};
use nemoral_scene::{Bounds, MaterialLibrary, Prototype};

/// Voxels that fill a box.
#[derive(Clone, Debug)]
pub struct Voxels {
    origin: DVec3,
    size_m: f64,
    counts: I64Vec3,
    cells: Vec<Voxel>,
}

/// What is known of a voxel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Voxel {
    /// Rays that entered it.
    pub rays: u32,
    /// A bit for each station that such a ray came from.
    pub stations: u8,
    /// Rays that a leaf in it stopped.
    pub hits: u32,
    /// Sum of the rays' chords through it, as if nothing stopped them, metres times the projection of
    /// leaves along the ray.
    pub chords_m: f32,
    /// The truth: leaf area in it, m².
    pub leaf_m2: f32,
}

impl Voxel {
    /// Leaf area by contact frequency: stops per metre of the rays that entered and per projected unit of
    /// leaf area (Warren Wilson 1960; on voxels Hosoi and Omasa 2006). Exact as long as no ray would be
    /// stopped twice, so for voxels smaller than the gaps between leaves; in larger ones leaves hide each
    /// other.
    #[must_use]
    pub fn contact_area_m2(&self, volume_m3: f64) -> f64 {
        volume_m3 * f64::from(self.hits) / f64::from(self.chords_m)
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
        }
    }

    fn at(&mut self, cell: I64Vec3) -> Option<&mut Voxel> {
        let inside = cell.cmpge(I64Vec3::ZERO).all() && cell.cmplt(self.counts).all();
        let i = (cell.z * self.counts.y + cell.y) * self.counts.x + cell.x;
        inside.then(|| &mut self.cells[i as usize])
    }

    /// All of them.
    #[must_use]
    pub fn cells(&self) -> &[Voxel] {
        &self.cells
    }

    /// A voxel's volume, m³.
    #[must_use]
    pub fn volume_m3(&self) -> f64 {
        self.size_m.powi(3)
    }

    /// Adds the leaf area of a shape's cards, opaque texel by texel.
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
                    if let Some(voxel) = self.at(cell) {
                        voxel.leaf_m2 += texel_m2 as f32;
                    }
                }
            }
        }
    }

    /// Adds a ray of a station, 0 to 7, that ran from outside to `end_m` and was stopped there, by a leaf or
    /// by wood, or ran on. `projection` is G along it.
    pub fn add_ray(
        &mut self,
        station: u32,
        origin: DVec3,
        direction: DVec3,
        end_m: f64,
        leaf: bool,
        projection: f64,
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
            let Some(voxel) = self.at(cell) else { return };
            let stops = end_m < wall;
            voxel.rays += 1;
            voxel.stations |= 1 << station;
            voxel.chords_m += ((wall - here).max(0.0) * projection) as f32;
            if stops && leaf {
                voxel.hits += 1;
            }
            if stops {
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

/// G by zenith angle of leaves with these inclinations and random azimuths.
#[derive(Clone, Debug)]
pub struct Projection {
    by_degree: Vec<f64>,
}

impl Projection {
    /// Of the cards of a shape that have their middle between two heights, each with the weight of its
    /// leaf area.
    #[must_use]
    pub fn of(shape: &Prototype, heights_m: Range<f32>, materials: &MaterialLibrary) -> Self {
        let leaves: Vec<(f64, f64)> = shape
            .cards()
            .iter()
            .filter(|c| heights_m.contains(&(c.corner + 0.5 * (c.edge_u + c.edge_v)).z))
            .map(|c| {
                let normal = c.edge_u.as_dvec3().cross(c.edge_v.as_dvec3());
                let mask = materials.get(c.material).mask.as_ref();
                let opaque = mask.map_or(1.0, |m| m.opaque_fraction());
                let area = normal.length() * opaque;
                ((normal.z.abs() / normal.length()).min(1.0).acos(), area)
            })
            .collect();
        let area: f64 = leaves.iter().map(|l| l.1).sum();
        let by_degree = (0..=90)
            .map(|zenith| {
                let zenith = f64::from(zenith).to_radians();
                let sum: f64 = leaves.iter().map(|l| l.1 * projection(zenith, l.0)).sum();
                sum / area
            })
            .collect();
        Self { by_degree }
    }

    /// G along a unit vector.
    #[must_use]
    pub fn along(&self, direction: DVec3) -> f64 {
        let degrees = direction.z.abs().min(1.0).acos() / FRAC_PI_2 * 90.0;
        let (i, share) = (degrees.floor() as usize, degrees.fract());
        let next = self.by_degree[(i + 1).min(90)];
        self.by_degree[i] * (1.0 - share) + next * share
    }
}

/// The mean projection of a leaf of one inclination over all azimuths along a zenith angle, both in radians
/// (Ross 1981).
#[must_use]
pub fn projection(zenith: f64, inclination: f64) -> f64 {
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
