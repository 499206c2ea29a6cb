//! What of a shape hides light from the ground around it.

use std::collections::BTreeMap;

use glam::Vec3;
use nemoral_scene::{MaterialLibrary, Occluder, Prototype};

use super::MaskCoverage;
use super::pieces::{for_each_piece, size_of_most};

/// The side of the cubes whose surface is one [`Occluder`], metres: as fine as the ground's shade
/// is known.
const CUBE_M: f32 = 0.15;

/// What is higher belongs to the light of a place, metres.
const HIDES_TO_M: f32 = 1.5;

/// The area of leaves that counts for a unit of half the surface of thick wood and stone: next to
/// no light passes a cube that their surface crosses, and most would pass as many leaves.
const SOLID: f32 = 4.0;

/// The most pieces that a shape is cut into, and the most occluders that it has: those of larger
/// shapes are coarser. Grown ones have a hundredth of both.
const MOST_PIECES: f32 = 1e6;
const MOST_OCCLUDERS: usize = 50_000;

/// How thick the meshes of a shape are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Thickness {
    /// Stalks and blades, thinner than a cube.
    Thin,
    /// Stems, logs and stones.
    Thick,
}

/// The occluders of a shape whose materials are those of `library` and its `masks`; its copies are
/// `scale` times as large. What lies on the ground hides nothing.
pub(crate) fn occluders(
    shape: &Prototype,
    (library, masks): (&MaterialLibrary, &MaskCoverage),
    thickness: Thickness,
    scale: f32,
) -> Vec<Occluder> {
    let top_m = HIDES_TO_M / scale;
    let mut cube_m = (CUBE_M / scale).max(size_of_most(shape, top_m, MOST_PIECES));
    let mut all = Vec::new();
    for_each_piece(shape, masks, (cube_m, top_m), |piece| {
        let weight = match thickness {
            Thickness::Thick if piece.is_solid => SOLID,
            _ => 1.0,
        };
        let occluder = Occluder {
            position_m: piece.at,
            area_m2: piece.area_m2 * weight,
        };
        let hides = !library.get(piece.material).lies_on_ground();
        if hides && occluder.area_m2 > 0.0 && piece.at.z < top_m {
            all.push(occluder);
        }
    });
    let mut all = merged(&all, cube_m);
    while all.len() > MOST_OCCLUDERS {
        cube_m *= 2.0;
        all = merged(&all, cube_m);
    }
    all
}

/// One occluder for all in each cube.
fn merged(all: &[Occluder], cube_m: f32) -> Vec<Occluder> {
    let mut cubes: BTreeMap<[i32; 3], (f32, Vec3)> = BTreeMap::new();
    for occluder in all {
        let cube = (occluder.position_m / cube_m).floor().as_ivec3().to_array();
        let (area_m2, moment) = cubes.entry(cube).or_default();
        *area_m2 += occluder.area_m2;
        *moment += occluder.position_m * occluder.area_m2;
    }
    let occluder = |(area_m2, moment): (f32, Vec3)| Occluder {
        position_m: moment / area_m2,
        area_m2,
    };
    cubes.into_values().map(occluder).collect()
}

#[cfg(test)]
mod tests {
    use nemoral_scene::{Card, Material, MaterialId, Mesh, Semantic, Triangle};

    use super::*;

    fn of(mesh: Mesh, cards: Vec<Card>, thickness: Thickness) -> Vec<Occluder> {
        made_of(Semantic::Leaf, mesh, cards, thickness)
    }

    fn made_of(
        semantic: Semantic,
        mesh: Mesh,
        cards: Vec<Card>,
        thickness: Thickness,
    ) -> Vec<Occluder> {
        let mut library = MaterialLibrary::new();
        library.add(Material::plain("part", semantic, Vec3::ONE));
        let shape = Prototype::new("shape", mesh, cards, &library).expect("sound");
        let of = (&library, &MaskCoverage::of(&library));
        occluders(&shape, of, thickness, 1.0)
    }

    fn area_m2(occluders: &[Occluder]) -> f32 {
        occluders.iter().map(|o| o.area_m2).sum()
    }

    #[test]
    fn leaves_near_the_ground_hide_light_from_it() {
        let card = |middle: Vec3, edge_u: Vec3, edge_v: Vec3| Card {
            corner: middle - 0.5 * (edge_u + edge_v),
            edge_u,
            edge_v,
            material: MaterialId(0),
        };
        let middle = Vec3::new(0.32, -0.14, 0.45);
        let low = card(middle, 0.4 * Vec3::X, 0.3 * Vec3::Y);
        let high = card(Vec3::Z * 1.9, Vec3::X, Vec3::Y);
        let all = of(Mesh::default(), vec![low, high], Thickness::Thin);
        assert!((area_m2(&all) - 0.12).abs() < 1e-5, "{}", area_m2(&all));
        let moment: Vec3 = all.iter().map(|o| o.position_m * o.area_m2).sum();
        assert!((moment / area_m2(&all) - middle).length() < 1e-3);
        // One for each cube of 15 cm that has a piece's middle.
        assert!((4..=9).contains(&all.len()), "{}", all.len());
        assert_eq!(of(Mesh::default(), vec![high], Thickness::Thin), []);
    }

    #[test]
    fn thick_wood_hides_more_than_leaves_of_its_surface() {
        let beam = || Mesh {
            positions: [[0, 0, 0], [1, 0, 0], [0, 0, 1]]
                .map(|p| Vec3::from_array(p.map(|x| x as f32)))
                .to_vec(),
            triangles: vec![Triangle {
                corners: [0, 1, 2],
                material: MaterialId(0),
            }],
            ..Mesh::default()
        };
        let [thin, thick] =
            [Thickness::Thin, Thickness::Thick].map(|m| area_m2(&of(beam(), Vec::new(), m)));
        assert!(
            (thin - 0.25).abs() < 1e-5 && (thick - SOLID * thin).abs() < 1e-4,
            "{thin} {thick}"
        );
    }

    #[test]
    fn what_lies_on_the_ground_hides_nothing() {
        let card = Card {
            corner: Vec3::ZERO,
            edge_u: Vec3::X,
            edge_v: Vec3::Y,
            material: MaterialId(0),
        };
        let count =
            |semantic| made_of(semantic, Mesh::default(), vec![card], Thickness::Thin).len();
        assert_eq!([Semantic::Litter, Semantic::Stone].map(count), [0; 2]);
        assert!(count(Semantic::Fern) > 0);
    }

    #[test]
    fn a_hundred_thousand_large_sheets_have_few_occluders() {
        let sheet = |i: i32| Card {
            corner: Vec3::new(-50.0, -50.0, 1e-5 * i as f32),
            edge_u: 100.0 * Vec3::X,
            edge_v: 100.0 * Vec3::Y,
            material: MaterialId(0),
        };
        let sheets = of(
            Mesh::default(),
            (0..100_000).map(sheet).collect(),
            Thickness::Thin,
        );
        assert!(
            !sheets.is_empty() && sheets.len() <= MOST_OCCLUDERS,
            "{}",
            sheets.len()
        );
        let area_m2: f64 = sheets.iter().map(|o| f64::from(o.area_m2)).sum();
        assert!((area_m2 / 1e9 - 1.0).abs() < 0.01, "{area_m2}");
    }
}
