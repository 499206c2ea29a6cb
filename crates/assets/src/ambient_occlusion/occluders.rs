//! What of a shape hides light from the ground around it.

use std::collections::BTreeMap;

use glam::Vec3;
use nemoral_scene::{Occluder, Prototype};

use super::MaskCoverage;
use super::pieces::for_each_piece;

/// The side of the cubes whose surface is one [`Occluder`], metres: as fine as the ground's shade
/// is known.
const CUBE_M: f32 = 0.15;

/// What is higher belongs to the light of a place, metres.
const HIDES_TO_M: f32 = 1.5;

/// The area of leaves that counts for a unit of half the surface of thick wood and stone: next to
/// no light passes a cube that their surface crosses, and most would pass as many leaves.
const SOLID: f32 = 4.0;

/// What the meshes of a shape are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Meshes {
    /// Stalks and blades, thinner than a cube.
    Thin,
    /// Stems, logs and stones.
    Thick,
}

/// The occluders of a shape whose materials are those of `masks`; its copies are `scale` times as
/// large.
pub(crate) fn occluders(
    shape: &Prototype,
    masks: &MaskCoverage,
    meshes: Meshes,
    scale: f32,
) -> Vec<Occluder> {
    let (cube_m, top_m) = (CUBE_M / scale, HIDES_TO_M / scale);
    let mut cubes: BTreeMap<[i32; 3], (f32, Vec3)> = BTreeMap::new();
    for_each_piece(shape, masks, (cube_m, top_m), |piece| {
        let weight = match meshes {
            Meshes::Thick if piece.is_solid => SOLID,
            _ => 1.0,
        };
        let area_m2 = piece.area_m2 * weight;
        if area_m2 > 0.0 && piece.at.z < top_m {
            let cube = (piece.at / cube_m).floor().as_ivec3().to_array();
            let (sum_m2, moment) = cubes.entry(cube).or_default();
            *sum_m2 += area_m2;
            *moment += piece.at * area_m2;
        }
    });
    let occluder = |(area_m2, moment): (f32, Vec3)| Occluder {
        position_m: moment / area_m2,
        area_m2,
    };
    cubes.into_values().map(occluder).collect()
}

#[cfg(test)]
mod tests {
    use nemoral_scene::{Card, Material, MaterialId, MaterialLibrary, Mesh, Semantic, Triangle};

    use super::*;

    fn of(mesh: Mesh, cards: Vec<Card>, meshes: Meshes) -> Vec<Occluder> {
        let mut library = MaterialLibrary::new();
        library.add(Material::plain("leaf", Semantic::Leaf, Vec3::ONE));
        let shape = Prototype::new("shape", mesh, cards, &library).expect("sound");
        occluders(&shape, &MaskCoverage::of(&library), meshes, 1.0)
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
        let all = of(Mesh::default(), vec![low, high], Meshes::Thin);
        assert!((area_m2(&all) - 0.12).abs() < 1e-5, "{}", area_m2(&all));
        let moment: Vec3 = all.iter().map(|o| o.position_m * o.area_m2).sum();
        assert!((moment / area_m2(&all) - middle).length() < 1e-3);
        // One for each cube of 15 cm that has a piece's middle.
        assert!((4..=9).contains(&all.len()), "{}", all.len());
        assert_eq!(of(Mesh::default(), vec![high], Meshes::Thin), []);
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
            [Meshes::Thin, Meshes::Thick].map(|m| area_m2(&of(beam(), Vec::new(), m)));
        assert!(
            (thin - 0.25).abs() < 1e-5 && (thick - SOLID * thin).abs() < 1e-4,
            "{thin} {thick}"
        );
    }
}
