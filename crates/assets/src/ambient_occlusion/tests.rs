//! What near parts of shapes block, against formulas.

use std::sync::Arc;

use glam::Vec2;
use nemoral_scene::{Material, MaterialId, Semantic, Triangle};
use nemoral_seed::{Draw, Key};

use super::*;

const NEAR: OcclusionParams = OcclusionParams {
    cell_m: 0.1,
    reach_m: 6.0,
    directions: 500,
    among_leaves: None,
};

fn library() -> MaterialLibrary {
    let mut library = MaterialLibrary::new();
    library.add(Material::plain("leaf", Semantic::Leaf, Vec3::ONE));
    library
}

fn card(middle: Vec3, edge_u: Vec3, edge_v: Vec3) -> Card {
    Card {
        corner: middle - 0.5 * (edge_u + edge_v),
        edge_u,
        edge_v,
        material: MaterialId(0),
    }
}

fn shares(mesh: Mesh, cards: Vec<Card>, near: &OcclusionParams) -> AmbientOcclusion {
    let library = library();
    let shape = Prototype::new("grid", mesh, cards, &library).expect("sound");
    bake(&shape, &MaskCoverage::of(&library), near)
}

/// The share of light that cards leave a level speck at the origin.
fn speck(cards: Vec<Card>) -> f32 {
    let mesh = Mesh {
        positions: [Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| p * 1e-3).to_vec(),
        normals: vec![Vec3::Z; 3],
        uvs: vec![Vec2::ZERO; 3],
        triangles: vec![Triangle {
            corners: [0, 1, 2],
            material: MaterialId(0),
        }],
        blends: Vec::new(),
    };
    AmbientOcclusion::decode(shares(mesh, cards, &NEAR).vertices[0])
}

/// Leaves behind leaves, which nothing passes.
fn wall(across: Vec3) -> Vec<Card> {
    let (u, v) = across.any_orthonormal_pair();
    let middle = |k: i32| across * (0.3 + 0.01 * k as f32);
    (0..50)
        .map(|k| card(middle(k), 14.0 * u, 14.0 * v))
        .collect()
}

#[test]
fn leaves_of_a_mesh_are_as_dark_as_cards() {
    let mut library = MaterialLibrary::new();
    let mask = AlphaMask::from_fn(8, 8, |c, r| c != r).expect("a size");
    library.add(Material {
        mask: Some(Arc::new(mask)),
        ..Material::plain("leaf", Semantic::Leaf, Vec3::ONE)
    });
    let mut rng = Key::world(4).rng();
    let mut number = |most: f64| rng.range_f64(-most, most) as f32;
    let cards: Vec<Card> = (0..600)
        .map(|_| {
            let middle = Vec3::new(number(1.0), number(1.0), number(1.0));
            let way = Vec3::new(number(1.0), number(1.0), number(1.0)).normalize_or(Vec3::X);
            let (u, v) = way.any_orthonormal_pair();
            card(middle, 0.3 * u, 0.3 * v)
        })
        .collect();
    let mut mesh = Mesh::default();
    for card in &cards {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(card.corners());
        let normal = card.edge_u.cross(card.edge_v).normalize_or(Vec3::Z);
        mesh.normals.extend([normal; 4]);
        mesh.uvs.extend([Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]);
        for corners in [[0, 1, 2], [0, 2, 3]] {
            mesh.triangles.push(Triangle {
                corners: corners.map(|c| first + c),
                material: MaterialId(0),
            });
        }
    }
    let shares = |mesh: Mesh, cards: Vec<Card>| {
        let shape = Prototype::new("leaves", mesh, cards, &library).expect("sound");
        let shape = with_occlusion(shape, &library, ShapeKind::Tree, 1.0);
        shape.ambient_occlusion().cloned().expect("baked")
    };
    let of_cards = bake(
        &Prototype::new("leaves", Mesh::default(), cards, &library).expect("sound"),
        &MaskCoverage::of(&library),
        &OcclusionParams::TREE,
    );
    let of_mesh = shares(mesh, Vec::new());
    let of_cards: Vec<f32> = of_cards
        .cards
        .iter()
        .flatten()
        .map(|&s| AmbientOcclusion::decode(s))
        .collect();
    let of_mesh: Vec<f32> = of_mesh
        .vertices
        .iter()
        .map(|&s| AmbientOcclusion::decode(s))
        .collect();
    let mean = |shares: &[f32]| shares.iter().sum::<f32>() / shares.len() as f32;
    assert!((mean(&of_cards) - mean(&of_mesh)).abs() < 0.01);
    let off = of_cards.iter().zip(&of_mesh).map(|(a, b)| (a - b).abs());
    let off: f32 = off.sum::<f32>() / of_cards.len() as f32;
    let spread = of_cards
        .iter()
        .map(|s| (s - mean(&of_cards)).abs())
        .sum::<f32>();
    let spread = spread / of_cards.len() as f32;
    assert!(spread > 0.05 && off < 0.2 * spread, "{off} {spread}");
}

#[test]
fn a_lone_card_is_in_the_open() {
    for (u, v) in [
        (Vec3::X, Vec3::Y),
        (Vec3::X, Vec3::Z),
        (Vec3::new(0.3, -0.2, 0.1), Vec3::new(0.1, 0.5, 0.7)),
    ] {
        for cell_m in [0.02, 0.1, 0.7] {
            let near = OcclusionParams { cell_m, ..NEAR };
            let alone = shares(
                Mesh::default(),
                vec![card(Vec3::new(0.4, -0.1, 0.23), u, v)],
                &near,
            );
            assert_eq!(alone.cards, [[255; 4]], "{u} {v} {cell_m}");
        }
    }
}

#[test]
fn walls_hide_what_they_hide_of_the_sky() {
    assert_eq!(speck(Vec::new()), 1.0);
    // Weighted by the cosine, one wall at the side hides a half of the light, and two in a
    // corner leave a quarter.
    let beside = speck(wall(Vec3::X));
    assert!((beside - 0.5).abs() < 0.03, "{beside}");
    let corner = speck([wall(Vec3::X), wall(Vec3::Y)].concat());
    assert!((corner - 0.25).abs() < 0.03, "{corner}");
}

#[test]
fn a_layer_of_leaves_passes_what_it_does_by_beer_and_lambert() {
    // A layer of leaves of every orientation with an area index of 1 passes twice the third
    // exponential integral of a half.
    let layer = speck(vec![card(Vec3::Z * 0.65, 14.0 * Vec3::X, 14.0 * Vec3::Y)]);
    assert!((layer - 0.443).abs() < 0.02, "{layer}");
    // Each of two parallel cards gets half of its light, on its outer side; more comes from
    // above than from below.
    let at = |z: f32| card(Vec3::Z * z, 14.0 * Vec3::X, 14.0 * Vec3::Y);
    let middle = |z: f32| card(Vec3::Z * z, 0.1 * Vec3::X, 0.1 * Vec3::Y);
    let two = shares(
        Mesh::default(),
        vec![at(0.05), middle(0.05), at(0.65), middle(0.65)],
        &NEAR,
    );
    let [low, high] = [1, 3].map(|card| AmbientOcclusion::decode(two.cards[card][0]));
    let expected = |above: f32, below: f32| (above + FROM_BELOW * below) / (1.0 + FROM_BELOW);
    assert!((low - expected(0.443, 1.0)).abs() < 0.03, "{low}");
    assert!((high - expected(1.0, 0.443)).abs() < 0.03, "{high}");
}

fn grid(cards: u64) -> Vec<Card> {
    let mut rng = Key::world(11).rng();
    let mut point =
        |size: f32| Vec3::from_array(std::array::from_fn(|_| rng.range_f32(-size, size)));
    (0..cards)
        .map(|_| card(point(0.5), point(0.2), point(0.2)))
        .collect()
}

#[test]
fn taking_leaves_away_never_darkens() {
    let all = grid(400);
    let of = |cards: &[Card]| shares(Mesh::default(), cards.to_vec(), &NEAR).cards;
    let (before, after) = (of(&all), of(&all[..250]));
    for (before, after) in before.iter().zip(&after) {
        assert!(
            before.iter().zip(after).all(|(b, a)| a >= b),
            "{before:?} {after:?}"
        );
    }
    assert!(before[..250] != after[..]);
}

#[test]
fn shares_among_leaves_are_told_from_their_mean() {
    let near = OcclusionParams {
        among_leaves: Some(0.4),
        ..NEAR
    };
    let cards = shares(Mesh::default(), grid(400), &near).cards;
    let mean = cards
        .iter()
        .flatten()
        .map(|&c| AmbientOcclusion::decode(c))
        .sum::<f32>()
        / 1600.0;
    assert!((mean - 0.4).abs() < 0.01, "{mean}");
}

#[test]
fn a_thread_a_kilometre_long_has_few_cells() {
    let long = OcclusionParams::LOW.for_size(Vec3::new(1e-3, 1e3, 1e-3));
    assert!(1e3 / long.cell_m <= grid::MOST_ALONG as f32);
    let card = card(Vec3::ZERO, 1e-3 * Vec3::X, 1e3 * Vec3::Y);
    assert_eq!(shares(Mesh::default(), vec![card], &long).cards, [[255; 4]]);
}

#[test]
fn value_stability() {
    let cards = shares(Mesh::default(), grid(400), &OcclusionParams::LOW).cards;
    let sum: u32 = cards.iter().flatten().map(|&c| u32::from(c)).sum();
    assert_eq!((cards[0], sum), ([107, 40, 71, 60], 167_588));
}
