//! No ray passes between neighbouring triangles, not even at their edges and corners.

use std::sync::Arc;

use crate::common::{self, Groups, cube, place, ray, rng, soup};
use glam::{Mat3, Vec2, Vec3};
use nemoral_raycast::{Group, RayScene};
use nemoral_scene::{Material, MaterialId, MaterialLibrary, Mesh, RayCaster, Semantic};
use nemoral_seed::{Domain, Draw, Key};

const CELLS: i32 = 20;
const CELL_M: f32 = 2.5;

/// Rough ground, whose height is a function of the global grid point, so that neighbours agree to
/// the bit.
fn height(i: i32, j: i32) -> f32 {
    Key::world(11)
        .domain(Domain::new("height"))
        .chunk([i, j])
        .rng()
        .range_f32(0.0, 2.0)
}

fn corner(chunk: [i32; 2], i: i32, j: i32) -> Vec3 {
    let z = height(chunk[0] * CELLS + i, chunk[1] * CELLS + j);
    Vec3::new(i as f32 * CELL_M, j as f32 * CELL_M, z)
}

fn ground(chunk: [i32; 2]) -> Mesh {
    let cells = (0..CELLS).flat_map(|i| (0..CELLS).map(move |j| (i, j)));
    soup(cells.flat_map(|(i, j)| {
        let at = |di, dj| corner(chunk, i + di, j + dj);
        let uvs = [Vec2::ZERO; 3];
        [
            ([at(0, 0), at(1, 0), at(1, 1)], uvs, MaterialId(0)),
            ([at(0, 0), at(1, 1), at(0, 1)], uvs, MaterialId(0)),
        ]
    }))
}

fn library() -> MaterialLibrary {
    let mut library = MaterialLibrary::new();
    library.add(Material::plain("soil", Semantic::Soil, Vec3::splat(0.2)));
    library
}

#[test]
fn no_ray_leaks_through_one_ground() {
    let mut rng = rng(1, "leaks");
    let blas = common::blas(ground([0, 0]), Vec::new(), &library());
    // The mesh as it is, and rotated, sheared and scaled, at some distance.
    let turned = common::linear(&mut common::rng(4, "turned"));
    for (linear, offset) in [
        (Mat3::IDENTITY, Vec3::ZERO),
        (turned, Vec3::new(-371.3, 288.7, 3.1)),
    ] {
        let group = Group::build(vec![place(&blas, Vec3::new(0.7, -0.3, 0.1), linear, 0)]);
        let forest = RayScene::new(vec![(offset, Arc::new(group))]);
        let to_scene = |p: Vec3| linear * p + Vec3::new(0.7, -0.3, 0.1) + offset;
        for k in 0..50_000 {
            let (i, j) = (rng.between(2, 18) as i32, rng.between(2, 18) as i32);
            let (di, dj) = [(0, 0), (1, 0), (0, 1), (1, 1)][k % 4];
            // The target is a corner or a point of an edge.
            let target = corner([0, 0], i, j).lerp(corner([0, 0], i + di, j + dj), rng.unit_f32());
            let away =
                cube(&mut rng, 1.0) * Vec3::new(4.0, 4.0, 0.0) + Vec3::Z * rng.range_f32(3.0, 20.0);
            let r = ray(to_scene(target + away), to_scene(target));
            assert!(
                forest.is_occluded(&r),
                "ray {k} to {target} from {}",
                r.origin
            );
        }
    }
}

#[test]
fn no_ray_leaks_between_grounds_of_neighbouring_groups() {
    let library = library();
    let chunk_m = CELLS as f32 * CELL_M;
    for far in [0, 7, -8] {
        let chunks = [
            [far, -far],
            [far + 1, -far],
            [far, 1 - far],
            [far + 1, 1 - far],
        ];
        let groups: Groups = chunks
            .iter()
            .map(|&chunk| {
                let blas = common::blas(ground(chunk), Vec::new(), &library);
                let group = Group::build(vec![place(&blas, Vec3::ZERO, Mat3::IDENTITY, 0)]);
                (
                    Vec3::new(chunk[0] as f32, chunk[1] as f32, 0.0) * chunk_m,
                    Arc::new(group),
                )
            })
            .collect();
        let centre = groups[3].0;
        let forest = RayScene::new(groups);
        let mut rng = rng(far.unsigned_abs().into(), "borders");
        for k in 0..20_000 {
            // The target is a point of the border between two or all four of the groups.
            let s = rng.range_f32(-15.0, 15.0);
            let border = match k % 3 {
                0 => Vec3::X * s,
                1 => Vec3::Y * s,
                _ => Vec3::ZERO,
            };
            let target = centre + border + Vec3::Z;
            let away =
                cube(&mut rng, 1.0) * Vec3::new(9.0, 9.0, 0.0) + Vec3::Z * rng.range_f32(3.0, 20.0);
            let mut r = ray(target + away, target);
            if k % 2 == 0 {
                // Every ray of these goes straight down onto the border.
                r.origin = centre + border + Vec3::Z * 9.0;
                r.direction = -Vec3::Z;
            }
            assert!(
                forest.is_occluded(&r),
                "ray {k} at {border} from {}",
                r.origin
            );
        }
    }
}
