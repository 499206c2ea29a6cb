//! Random foliage and the physics of rays in it, independent of the crates under test.

use std::f64::consts::TAU;
use std::sync::Arc;

use nemoral_raycast::{Blas, Group, RayScene};
use nemoral_scene::glam::{DVec3, Mat3, Vec3};
use nemoral_scene::{
    AlphaMask, Card, InstancePlace, Material, MaterialId, MaterialLibrary, Mesh, ObjectId,
    Prototype, Ray, RayCaster, Semantic,
};
use nemoral_seed::{Draw, PhiloxRng};

/// Distribution of the leaves' inclinations; azimuths are random.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Inclination {
    /// Like the surface of a sphere: G is ½ in every direction.
    Spherical,
    /// Horizontal leaves: G is the cosine of the zenith angle.
    Horizontal,
    /// Vertical leaves: G is 2 / π times the sine of the zenith angle.
    Vertical,
}

impl Inclination {
    /// The mean projection of a unit of leaf area along a zenith angle.
    #[must_use]
    pub fn projection(self, zenith_rad: f64) -> f64 {
        match self {
            Self::Spherical => 0.5,
            Self::Horizontal => zenith_rad.cos(),
            Self::Vertical => 4.0 / TAU * zenith_rad.sin(),
        }
    }

    fn normal(self, rng: &mut PhiloxRng) -> DVec3 {
        let up = match self {
            Self::Spherical => rng.range_f64(-1.0, 1.0),
            Self::Horizontal => 1.0,
            Self::Vertical => 0.0,
        };
        let (sin, cos) = rng.range_f64(0.0, TAU).sin_cos();
        let across = (1.0 - up * up).max(0.0).sqrt();
        DVec3::new(across * cos, across * sin, up)
    }
}

/// A random direction, uniform on the sphere.
pub fn any_direction(rng: &mut PhiloxRng) -> DVec3 {
    Inclination::Spherical.normal(rng)
}

/// A leaf: a round picture with a hole on a square card.
#[derive(Debug)]
pub struct LeafKind {
    /// A library with only the leaf's material.
    pub materials: MaterialLibrary,
    /// The card's width, metres.
    pub card_m: f64,
    material: MaterialId,
    opaque: f64,
}

impl LeafKind {
    /// A leaf on a card of this width: a disc with a hole.
    ///
    /// # Panics
    /// Never.
    #[must_use]
    pub fn new(card_m: f64) -> Self {
        let inside = |column: usize, row: usize, x: f64, y: f64, radius: f64| {
            (column as f64 + 0.5 - x).hypot(row as f64 + 0.5 - y) < radius
        };
        let opaque =
            |c: usize, r: usize| inside(c, r, 24.0, 24.0, 24.0) && !inside(c, r, 30.0, 20.0, 9.0);
        let texels = (0..48 * 48).filter(|i| opaque(i % 48, i / 48)).count();
        let mask = AlphaMask::from_fn(48, 48, opaque).expect("48 x 48 is allowed");
        let mut materials = MaterialLibrary::new();
        let material = materials.add(Material {
            mask: Some(Arc::new(mask)),
            ..Material::plain("leaf", Semantic::Leaf, Vec3::splat(0.3))
        });
        Self {
            materials,
            card_m,
            material,
            opaque: texels as f64 / (48.0 * 48.0),
        }
    }

    /// The share of the card that is leaf.
    #[must_use]
    pub fn opaque(&self) -> f64 {
        self.opaque
    }

    /// One side of the leaf, m².
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        self.card_m * self.card_m * self.opaque
    }

    fn card(&self, centre: DVec3, normal: DVec3, rng: &mut PhiloxRng) -> Card {
        let (sin, cos) = rng.range_f64(0.0, TAU).sin_cos();
        let (a, b) = normal.any_orthonormal_pair();
        let u = self.card_m * (cos * a + sin * b);
        let v = self.card_m * (cos * b - sin * a);
        Card {
            corner: (centre - 0.5 * (u + v)).as_vec3(),
            edge_u: u.as_vec3(),
            edge_v: v.as_vec3(),
            material: self.material,
        }
    }

    /// As many leaves as one shape, with their centres where `place` puts them.
    ///
    /// # Panics
    /// If a place is not finite.
    #[must_use]
    pub fn group(
        &self,
        leaves: usize,
        inclination: Inclination,
        place: impl Fn(&mut PhiloxRng) -> DVec3,
        rng: &mut PhiloxRng,
    ) -> Arc<Group> {
        let cards = (0..leaves)
            .map(|_| {
                let (centre, normal) = (place(rng), inclination.normal(rng));
                self.card(centre, normal, rng)
            })
            .collect();
        let shape = Prototype::new("leaves", Mesh::default(), cards, &self.materials)
            .expect("leaves are sound");
        group_of(Arc::new(shape), &self.materials)
    }

    /// A tile of this size with as many leaves at random places between the origin and `filled`.
    #[must_use]
    pub fn tile(
        &self,
        filled: DVec3,
        leaves: usize,
        inclination: Inclination,
        rng: &mut PhiloxRng,
    ) -> Arc<Group> {
        let anywhere = |rng: &mut PhiloxRng| {
            let [x, y, z] = [0; 3].map(|_| rng.unit_f64());
            filled * DVec3::new(x, y, z)
        };
        self.group(leaves, inclination, anywhere, rng)
    }
}

/// A slab or block without edges: a tile of this size with this many copies to each side along each
/// axis.
#[must_use]
pub fn periodic(tile: &Arc<Group>, size_m: f64, around: [i32; 3]) -> RayScene {
    let [nx, ny, nz] = around;
    let mut groups = Vec::new();
    for z in -nz..=nz {
        for y in -ny..=ny {
            for x in -nx..=nx {
                let at = DVec3::new(x.into(), y.into(), z.into()) * size_m;
                groups.push((at.as_vec3(), Arc::clone(tile)));
            }
        }
    }
    RayScene::new(groups)
}

/// A group with one copy of a shape.
fn group_of(shape: Arc<Prototype>, materials: &MaterialLibrary) -> Arc<Group> {
    let blas = Arc::new(Blas::build(Arc::clone(&shape), materials));
    let instance = InstancePlace {
        position_m: Vec3::ZERO,
        linear: Mat3::IDENTITY,
        object: ObjectId::NONE,
        variation: 0.0,
    };
    Arc::new(Group::build(vec![(instance, blas)]))
}

/// The share of rays that hit nothing.
pub fn gap_fraction(caster: &dyn RayCaster, rays: &[Ray]) -> f64 {
    let through = rays.iter().filter(|r| caster.closest_hit(r).is_none());
    through.count() as f64 / rays.len() as f64
}

/// Kolmogorov's probability that a sample from this distribution is as far from it as this one.
#[must_use]
pub fn kolmogorov_smirnov(sample: &mut [f64], distribution: impl Fn(f64) -> f64) -> f64 {
    sample.sort_by(f64::total_cmp);
    let n = sample.len() as f64;
    let farthest = sample.iter().enumerate().fold(0.0, |most: f64, (i, &x)| {
        let f = distribution(x);
        most.max(f - i as f64 / n).max((i + 1) as f64 / n - f)
    });
    // Stephens (1970): with this argument the limit law is good from n = 8 on.
    let x = farthest * (n.sqrt() + 0.12 + 0.11 / n.sqrt());
    let term = |k: i32| {
        let k = f64::from(k);
        (if k % 2.0 == 0.0 { -2.0 } else { 2.0 }) * (-2.0 * (k * x).powi(2)).exp()
    };
    (1..=100).map(term).sum::<f64>().clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Critical values of the limit law are those of tables.
    #[test]
    fn kolmogorovs_law() {
        for (x, p) in [(1.2238, 0.10), (1.3581, 0.05), (1.6276, 0.01)] {
            let n = 10_000_f64;
            let off = x / (n.sqrt() + 0.12 + 0.11 / n.sqrt());
            let mut sample: Vec<f64> = (0..10_000).map(|i| (f64::from(i) + 0.5) / n).collect();
            let got = kolmogorov_smirnov(&mut sample, |u| (u + off - 0.5 / n).clamp(0.0, 1.0));
            assert!((got - p).abs() < 2e-3, "{x} {got}");
        }
    }
}
