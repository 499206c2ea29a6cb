//! Makes triangles from axes and radii.

mod bark_map;
mod rings;
mod tube;

use std::f64::consts::PI;
use std::ops::Range;

use nemoral_scene::Mesh;

use self::rings::{parent_radius, rings};
use self::tube::{Tube, sides};
use super::flare::Flare;
use super::materials::TreeMaterials;
use super::skeleton::Axis;

/// The wood of a tree that is drawn.
#[derive(Clone, Debug)]
pub(super) struct DrawnWood {
    /// How finely it is drawn.
    pub(super) tessellation: Tessellation,
    /// For every axis, whether it is drawn.
    pub(super) drawn: Vec<bool>,
    /// For every axis, whether it ends in a point. Living twigs that bear no others do.
    pub(super) pointed: Vec<bool>,
}

/// How finely to sweep.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tessellation {
    /// Where stems and limbs end and branches begin.
    pub(super) trunk_radius_m: f64,
    /// Factor on all tolerances: above 1 for trees that would be over their budget.
    pub(super) tolerance: f64,
}

/// Sweeps every axis that is drawn. The stem's triangles come first: their range is returned.
pub(super) fn sweep(
    axes: &[Axis],
    radii: &[Vec<f64>],
    flare: &Flare,
    materials: &TreeMaterials,
    upper_from_m: f64,
    wood: &DrawnWood,
) -> (Mesh, Range<usize>) {
    let mut mesh = Mesh::default();
    let mut stem = 0..0;
    let tessellation = wood.tessellation;
    for (i, (axis, r)) in axes.iter().zip(radii).enumerate() {
        if !wood.drawn[i] {
            continue;
        }
        let rings = rings(axis, r, parent_radius(axis, radii), tessellation);
        let tube = Tube {
            axis,
            pointed: wood.pointed[i],
            flare: (axis.order == 0).then_some(flare),
            snag: axes[0].dead,
            upper_from_m,
            materials,
            tessellation,
        };
        tube.mesh(&rings, &mut mesh);
        if axis.order == 0 {
            stem = 0..mesh.triangles.len();
        }
    }
    (mesh, stem)
}

/// An upper bound of the triangles that [`sweep`] makes of the `i`-th axis.
pub(super) fn cost(
    axes: &[Axis],
    radii: &[Vec<f64>],
    i: usize,
    pointed: bool,
    tessellation: Tessellation,
) -> usize {
    let axis = &axes[i];
    let rings = rings(axis, &radii[i], parent_radius(axis, radii), tessellation);
    let greatest = rings.iter().fold(0.0_f64, |m, r| m.max(r.radius));
    let n = sides(axis.order, greatest, tessellation.tolerance);
    // A stem's change of bark takes two rings more.
    let rings = rings.len() + if axis.order == 0 { 2 } else { 0 };
    n * (2 * rings - if pointed { 3 } else { 1 })
}

/// Diameter of the circle with the area of a level cut through closed walls, metres: the shoelace
/// sum over the pieces in which the triangles meet the plane.
pub(super) fn diameter_at(mesh: &Mesh, triangles: Range<usize>, z: f64) -> f64 {
    let mut twice_area = 0.0;
    for triangle in &mesh.triangles[triangles] {
        let p = triangle
            .corners
            .map(|c| mesh.positions[c as usize].as_dvec3());
        // Entry and exit of the plane, in the triangle's sense of turning.
        let crossing = |rising: bool| {
            (0..3).find_map(|k| {
                let (a, b) = (p[k], p[(k + 1) % 3]);
                let crosses = if rising {
                    a.z < z && b.z >= z
                } else {
                    a.z >= z && b.z < z
                };
                crosses.then(|| a.lerp(b, (z - a.z) / (b.z - a.z)))
            })
        };
        if let (Some(a), Some(b)) = (crossing(false), crossing(true)) {
            twice_area += a.x * b.y - a.y * b.x;
        }
    }
    (2.0 * twice_area.abs() / PI).sqrt()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use nemoral_scene::{MaterialId, Triangle};
    use nemoral_seed::{Domain, Key};

    use super::*;
    use crate::tree::{FoliageCard, GrownTree, GrowthParams, Species, TreeSize, grow};

    pub(super) fn key(i: u64) -> Key {
        Key::world(7).domain(Domain::new("test.sweep")).item(i)
    }

    /// Each part of a tree has its own material.
    pub(super) fn materials() -> TreeMaterials {
        TreeMaterials {
            stem: MaterialId(0),
            change: MaterialId(1),
            upper: MaterialId(2),
            flare: MaterialId(3),
            limb: MaterialId(4),
            branch: MaterialId(5),
            dead: MaterialId(6),
            snag: MaterialId(7),
            foliage: vec![FoliageCard {
                material: MaterialId(8),
                width_m: 0.4,
                height_m: 0.42,
                opaque_fraction: 0.5,
            }],
        }
    }

    /// Upright trees of species with one stem to the top, because a level cut of a leaning stem is
    /// an ellipse.
    fn upright() -> impl Iterator<Item = (Species, TreeSize, Flare, GrownTree)> {
        let species = [
            Species::maritime_pine(),
            Species::norway_spruce(),
            Species::eucalyptus(),
            Species::douglas_fir(),
            Species::silver_birch(),
        ];
        species.into_iter().zip(0..).map(|(species, i)| {
            let size = TreeSize {
                lean_rad: 0.0,
                ..species.draw_size(0.34, key(i))
            };
            let params = GrowthParams::default();
            let tree = grow(&species, &size, &materials(), &params, key(i)).expect("grows");
            let flare = Flare::new(&species.stem, &size, key(i));
            (species, size, flare, tree)
        })
    }

    #[test]
    fn stems_taper_as_their_species() {
        for (species, size, _, tree) in upright() {
            let of_stem = |t: &Triangle| t.material <= materials().flare;
            let end = tree.mesh.triangles.iter().rposition(of_stem);
            let stem = 0..end.expect("a stem") + 1;
            for x in [0.3, 0.5, 0.7] {
                let z = x * size.height_m;
                let taper_m = 2.0 * species.stem.taper.radius_m(&size, z);
                let share = diameter_at(&tree.mesh, stem.clone(), z) / taper_m;
                // Between two rings a stem is a cone, which lies inside of the curve.
                assert!(
                    (0.98..1.01).contains(&share),
                    "{} at {x}: {share}",
                    species.name
                );
            }
        }
    }

    #[test]
    fn stems_have_the_volume_of_their_taper() {
        const STEPS: u32 = 2000;
        const AROUND: u32 = 90;
        for (species, size, flare, tree) in upright() {
            let step = size.height_m / f64::from(STEPS);
            let slice = |i: u32| {
                let z = (f64::from(i) + 0.5) * step;
                let r = species.stem.taper.radius_m(&size, z);
                let azimuth = |k: u32| TAU * f64::from(k) / f64::from(AROUND);
                let squares = (0..AROUND).map(|k| (r * flare.factor(azimuth(k), z)).powi(2));
                step * PI * squares.sum::<f64>() / f64::from(AROUND)
            };
            let share = tree.stem.volume_m3() / (0..STEPS).map(slice).sum::<f64>();
            assert!((share - 1.0).abs() < 0.03, "{}: {share}", species.name);
        }
    }
}
