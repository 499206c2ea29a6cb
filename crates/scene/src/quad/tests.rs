//! Which triangles are cards, and that brute force finds the same.

use std::collections::HashSet;
use std::sync::Arc;

use proptest::prelude::*;

use super::*;
use crate::{AlphaMask, Blend, Material, MaterialId, Semantic, Triangle};

const CORNERS: [Vec2; 4] = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];

/// An opaque material, then two with masks of 100 × 60.
fn library() -> MaterialLibrary {
    let mut library = MaterialLibrary::new();
    library.add(Material::plain("bark", Semantic::Stem, Vec3::ONE));
    for _ in 0..2 {
        let mask = AlphaMask::from_fn(100, 60, |c, r| c > r).expect("size");
        library.add(Material {
            mask: Some(Arc::new(mask)),
            ..Material::plain("leaf", Semantic::Leaf, Vec3::ONE)
        });
    }
    library
}

/// A leaf of 4 cm by 6 cm somewhere, as two triangles with vertices of their own.
fn leaf(mesh: &mut Mesh, at: Vec3, uvs: [Vec2; 4], order: [[usize; 3]; 2]) {
    let (u, v) = (Vec3::new(0.04, 0.01, 0.0), Vec3::new(-0.01, 0.05, 0.03));
    for corners in order {
        let first = mesh.positions.len() as u32;
        for k in corners {
            let place = CORNERS[k];
            mesh.positions.push(at + u * place.x + v * place.y);
            mesh.uvs.push(uvs[k]);
        }
        mesh.triangles.push(Triangle {
            corners: [first, first + 1, first + 2],
            material: MaterialId(1),
        });
    }
}

fn one(uvs: [Vec2; 4], order: [[usize; 3]; 2]) -> Mesh {
    let mut mesh = Mesh::default();
    leaf(&mut mesh, Vec3::new(3.0, 1.0, 9.0), uvs, order);
    mesh
}

#[test]
fn a_leaf_is_one_card_however_it_is_cut_and_turned() {
    let orders = [
        [[0, 1, 2], [0, 2, 3]],
        [[1, 2, 0], [3, 0, 2]],
        [[0, 1, 3], [3, 1, 2]],
        [[2, 3, 1], [0, 1, 3]],
    ];
    for order in orders {
        let mesh = one(CORNERS, order);
        let found = find(&mesh, &library());
        let [quad] = found[..] else {
            panic!("{order:?}: {found:?}");
        };
        let (card, window) = quad.card(&mesh);
        assert_eq!(window, TextureWindow::WHOLE, "{order:?}");
        assert!((card.corner - Vec3::new(3.0, 1.0, 9.0)).length() < 1e-6);
        assert!((card.edge_u - Vec3::new(0.04, 0.01, 0.0)).length() < 2e-6);
        // Each triangle has its side of the diagonal.
        for (s, t) in [(0.9, 0.2), (0.2, 0.9), (0.1, 0.1), (0.8, 0.9)] {
            let (number, u, v) = quad.triangle_at(s, t);
            assert!(u >= -1e-12 && v >= -1e-12 && u + v <= 1.0 + 1e-12);
            let [a, b, c] = mesh.triangles[number as usize].corners.map(|i| mesh.uv(i));
            let uv = a * (1.0 - u - v) as f32 + b * u as f32 + c * v as f32;
            assert!((uv - Vec2::new(s as f32, t as f32)).length() < 1e-6);
        }
    }
}

#[test]
fn windows_of_an_atlas_are_kept() {
    let order = [[0, 1, 2], [0, 2, 3]];
    let window = TextureWindow::rectangle(Vec2::new(0.25, 0.5), Vec2::new(0.5, 1.0));
    for window in [
        window,
        window.flipped(),
        window.turned(),
        window.flipped().turned(),
    ] {
        let uvs = CORNERS.map(|p| window.uv(p.x.into(), p.y.into()));
        let mesh = one(uvs, order);
        let (card, found) = find(&mesh, &library())[0].card(&mesh);
        // Its corner is the one with the lowest texture coordinate.
        assert_eq!(found.origin, Vec2::new(0.25, 0.5));
        assert_eq!(found.area(), 0.125);
        let normal = Vec3::new(0.04, 0.01, 0.0).cross(Vec3::new(-0.01, 0.05, 0.03));
        assert!(card.edge_u.cross(card.edge_v).dot(normal) > 0.0);
    }
    // Turned by less than a quarter it is a window too, unless it is bent.
    let turn = Vec2::from_angle(0.3) * 0.4;
    let turned = CORNERS.map(|p| Vec2::new(0.3, 0.3) + turn.rotate(p));
    assert_eq!(find(&one(turned, order), &library()).len(), 1);
    let mut bent = turned;
    bent[2].x += 0.01;
    assert!(find(&one(bent, order), &library()).is_empty());
}

#[test]
fn the_back_of_a_leaf_is_a_card_and_what_touches_others_is_none() {
    let order = [[0, 1, 2], [0, 2, 3]];
    let mut mesh = one(CORNERS, order);
    let back = [[2, 1, 0], [3, 2, 0]];
    leaf(&mut mesh, Vec3::new(3.0, 1.0, 9.0), CORNERS, back);
    let found = find(&mesh, &library());
    assert_eq!(found.len(), 2);
    assert_eq!((found[0].triangles, found[1].triangles), ([0, 1], [2, 3]));
    // A neighbour along an edge.
    let next = Vec3::new(3.0, 1.0, 9.0) + Vec3::new(0.04, 0.01, 0.0);
    leaf(&mut mesh, next, CORNERS, order);
    assert!(find(&mesh, &library()).is_empty());
}

#[test]
fn what_is_no_leaf_stays_triangles() {
    let order = [[0, 1, 2], [0, 2, 3]];
    let sound = one(CORNERS, order);
    assert_eq!(find(&sound, &library()).len(), 1);
    type Spoil = fn(&mut Mesh);
    let spoilt: [Spoil; 8] = [
        |m| m.uvs.clear(),
        |m| m.triangles[1].material = MaterialId(2),
        |m| {
            m.triangles
                .iter_mut()
                .for_each(|t| t.material = MaterialId(0))
        },
        |m| m.triangles[1].corners.swap(0, 1),
        |m| m.positions[5].z += 0.0002,
        |m| m.positions[3].z = m.positions[3].z.next_up(),
        |m| m.uvs[3].x += 0.1,
        |m| {
            let blend = Blend {
                corners: [[MaterialId(0), MaterialId(1)]; 3],
            };
            m.blends = vec![blend; 2];
        },
    ];
    for (i, spoil) in spoilt.into_iter().enumerate() {
        let mut mesh = sound.clone();
        spoil(&mut mesh);
        assert!(find(&mesh, &library()).is_empty(), "{i}");
    }
    let flat = |m: &mut Mesh| m.positions.iter_mut().for_each(|p| *p = p.with_y(p.x));
    let mut mesh = sound;
    flat(&mut mesh);
    mesh.positions.iter_mut().for_each(|p| p.z = p.x);
    assert!(find(&mesh, &library()).is_empty());
}

/// The oracle: every pair of triangles is tried, and every edge compared with every other.
fn brute_force(mesh: &Mesh, library: &MaterialLibrary) -> Vec<[u32; 2]> {
    let is_leaf = |i: &u32| mesh.triangles[*i as usize].material != MaterialId(0);
    let bits = |v: u32| {
        let position = mesh.positions[v as usize] + Vec3::ZERO;
        position.to_array().map(f32::to_bits)
    };
    let edges = |round: &[u32]| -> HashSet<[[u32; 3]; 2]> {
        let next = round.iter().cycle().skip(1);
        let edges = round.iter().zip(next).map(|(&a, &b)| [bits(a), bits(b)]);
        edges.map(|[a, b]| [a.min(b), a.max(b)]).collect()
    };
    let of = |i: u32| edges(&mesh.triangles[i as usize].corners);
    let all: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
    let mut quads: Vec<Quad> = Vec::new();
    for &i in all.iter().filter(|i| is_leaf(i)) {
        for &k in all.iter().filter(|k| **k > i && is_leaf(k)) {
            let is_taken = |t| quads.iter().any(|q| q.triangles.contains(&t));
            if !is_taken(i) && !is_taken(k) && !of(i).is_disjoint(&of(k)) {
                quads.extend(join(mesh, library, i, k));
            }
        }
    }
    let corners = |q: &Quad| q.corners.iter().map(|&v| bits(v)).collect::<HashSet<_>>();
    let is_alone = |q: &&Quad| {
        let border = edges(&q.corners);
        let free = |t: &u32| !quads.iter().any(|q| q.triangles.contains(t));
        let mut others = quads.iter().filter(|other| corners(other) != corners(q));
        let mut rest = all.iter().filter(|t| free(t));
        others.all(|other| border.is_disjoint(&edges(&other.corners)))
            && rest.all(|&t| border.is_disjoint(&of(t)))
    };
    quads.iter().filter(is_alone).map(|q| q.triangles).collect()
}

/// Halves of leaves on a small lattice, so that many touch or coincide, in any order: the place of
/// the first corner, whether the leaf is upright, and the corners.
fn halves() -> impl Strategy<Value = Vec<([u8; 2], bool, [usize; 3])>> {
    const CUTS: [[[usize; 3]; 2]; 4] = [
        [[0, 1, 2], [0, 2, 3]],
        [[0, 1, 3], [3, 1, 2]],
        [[2, 1, 0], [3, 2, 0]],
        [[0, 1, 2], [0, 1, 3]],
    ];
    let leaf = (prop::array::uniform2(0_u8..3), any::<bool>(), 0..CUTS.len());
    let halves = prop::collection::vec(leaf, 1..9).prop_map(|leaves| {
        let halves = leaves.into_iter();
        let halves = halves.flat_map(|(at, upright, cut)| CUTS[cut].map(|c| (at, upright, c)));
        halves.collect::<Vec<_>>()
    });
    halves.prop_shuffle()
}

proptest! {
    #[test]
    fn the_quads_are_those_of_brute_force(
        halves in halves(),
        wood in prop::collection::vec(prop::array::uniform3((0_u8..4, 0_u8..4)), 0..3),
    ) {
        let mut mesh = Mesh::default();
        let mut triangle = |points: [(Vec3, Vec2); 3], material| {
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(points.map(|p| p.0));
            mesh.uvs.extend(points.map(|p| p.1));
            let corners = [first, first + 1, first + 2];
            mesh.triangles.push(Triangle { corners, material });
        };
        for ([x, y], upright, corners) in halves {
            let along = if upright { Vec3::Z } else { Vec3::Y };
            let corner = |k: usize| {
                let p = CORNERS[k];
                let at = Vec3::new(x.into(), y.into(), 0.0);
                (at + Vec3::X * p.x + along * p.y, p)
            };
            triangle(corners.map(corner), MaterialId(1));
        }
        for corners in wood {
            let corner = |(x, y): (u8, u8)| (Vec3::new(x.into(), y.into(), 0.0), Vec2::ZERO);
            triangle(corners.map(corner), MaterialId(0));
        }
        let found = find(&mesh, &library());
        let found: Vec<[u32; 2]> = found.iter().map(|q| q.triangles).collect();
        prop_assert_eq!(found, brute_force(&mesh, &library()));
    }
}
