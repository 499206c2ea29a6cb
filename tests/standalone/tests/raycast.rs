//! Use of `nemoral-raycast` alone: line of sight through foliage.

use std::sync::Arc;

use nemoral_raycast::{Blas, BruteForce, Group, RayScene};
use nemoral_scene::glam::{Mat3, Vec3};
use nemoral_scene::{
    AlphaMask, Card, ChunkCoord, InstancePlace, Material, MaterialLibrary, Mesh, ObjectId,
    Prototype, Ray, RayCaster, Semantic,
};

/// A square metre of a leaf whose left half is a hole, in 100 places 2 m above each other.
fn groups() -> Vec<(Vec3, Arc<Group>)> {
    let mut materials = MaterialLibrary::new();
    let mask = AlphaMask::from_fn(8, 8, |column, _| column >= 4).expect("a mask");
    let material = materials.add(Material {
        mask: Some(Arc::new(mask)),
        ..Material::plain("leaf", Semantic::Leaf, Vec3::splat(0.2))
    });
    let card = Card {
        corner: Vec3::ZERO,
        edge_u: Vec3::X,
        edge_v: Vec3::Y,
        material,
    };
    let prototype = Prototype::new("one leaf", Mesh::default(), vec![card], &materials);
    let prototype = Arc::new(prototype.expect("a leaf"));
    let blas = Arc::new(Blas::build(Arc::clone(&prototype), &materials));
    let leaf = |i: u16| {
        let instance = InstancePlace {
            position_m: Vec3::Z * 2.0 * f32::from(i),
            linear: Mat3::IDENTITY,
            object: ObjectId::new(ChunkCoord::new(0, 0), i).expect("in range"),
            variation: 0.0,
        };
        (instance, Arc::clone(&blas))
    };
    vec![(
        Vec3::ZERO,
        Arc::new(Group::build((1..=100).map(leaf).collect())),
    )]
}

#[test]
fn light_falls_through_holes() {
    let forest = RayScene::new(groups());
    let up = |x_m: f32| Ray::new(Vec3::new(x_m, 0.3, 0.0), Vec3::Z);
    assert_eq!(forest.closest_hit(&up(0.25)), None);
    assert!(!forest.is_occluded(&up(0.25)));
    let hit = forest.closest_hit(&up(0.75)).expect("a leaf");
    assert_eq!(
        (hit.surface.distance_m, hit.surface.object.item()),
        (2.0, 1)
    );
    assert!(forest.is_occluded(&up(0.75)));
    let down = Ray::new(Vec3::new(0.75, 0.3, 1000.0), Vec3::NEG_Z);
    let hit = forest.closest_hit(&down).expect("the other end");
    assert_eq!(
        (hit.surface.distance_m, hit.surface.object.item()),
        (800.0, 100)
    );
}

#[test]
fn it_is_what_a_loop_over_everything_gives() {
    let (forest, oracle) = (RayScene::new(groups()), BruteForce::new(groups()));
    let rays: Vec<Ray> = (0..2000_u16)
        .map(|i| {
            let turn = f32::from(i) * 0.1;
            let direction = Vec3::new(0.3 * turn.cos(), 0.3 * turn.sin(), (turn * 0.37).sin());
            let origin = Vec3::new(0.5, 0.5, 0.1 * f32::from(i) + 0.05);
            Ray::new(origin, direction.normalize_or(Vec3::Z))
        })
        .collect();
    let mut hits = vec![None; rays.len()];
    forest.closest_hits(&rays, &mut hits);
    let met = hits.iter().flatten().count();
    assert!((100..1900).contains(&met), "{met} hits");
    for (ray, hit) in rays.iter().zip(hits) {
        assert_eq!(hit, oracle.closest_hit(ray));
    }
}
