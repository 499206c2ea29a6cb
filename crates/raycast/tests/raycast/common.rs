//! Random scenes and rays by number, shared by the integration tests.

use std::sync::Arc;

use glam::{Mat3, Quat, Vec2, Vec3};
use nemoral_raycast::{Blas, BuildQuality, Group};
use nemoral_scene::{
    AlphaMask, Card, ChunkCoord, Hit, Instance, InstancePlace, Material, MaterialId,
    MaterialLibrary, Mesh, ObjectId, Prototype, Ray, RayCaster, Semantic, Triangle,
};
use nemoral_seed::{Domain, Draw, Key, PhiloxRng};

pub(crate) type Groups = Vec<(Vec3, Arc<Group>)>;

pub(crate) fn rng(seed: u64, purpose: &str) -> PhiloxRng {
    Key::world(seed).domain(Domain::new(purpose)).rng()
}

pub(crate) fn cube(rng: &mut PhiloxRng, half: f32) -> Vec3 {
    let mut axis = || rng.range_f32(-half, half);
    Vec3::new(axis(), axis(), axis())
}

pub(crate) fn direction(rng: &mut PhiloxRng) -> Vec3 {
    cube(rng, 1.0).try_normalize().unwrap_or(Vec3::X)
}

pub(crate) fn ray(origin: Vec3, towards: Vec3) -> Ray {
    Ray::new(
        origin,
        (towards - origin).try_normalize().unwrap_or(Vec3::Z),
    )
}

/// Two opaque materials, then four masked ones of several sizes, then one without an opaque texel.
pub(crate) fn library(seed: u64) -> MaterialLibrary {
    let mut rng = rng(seed, "library");
    let mut library = MaterialLibrary::new();
    library.add(Material::plain("soil", Semantic::Soil, Vec3::splat(0.2)));
    library.add(Material::plain("bark", Semantic::Stem, Vec3::splat(0.3)));
    for (width, height) in [(1, 2), (7, 5), (33, 64), (256, 40)] {
        let salt = rng.below(u32::MAX);
        let (x, y) = (rng.range_f64(0.2, 0.8), rng.range_f64(0.2, 0.8));
        let opaque = |c: usize, r: usize| {
            let near = (c as f64 / width as f64 - x).hypot(r as f64 / height as f64 - y) < 0.4;
            let bits = (c * 31 + r * 17) as u32 ^ salt.rotate_left((c * r % 32) as u32);
            near && !bits.is_multiple_of(3)
        };
        add_masked(
            &mut library,
            AlphaMask::from_fn(width, height, opaque).expect("valid by construction"),
        );
    }
    add_masked(
        &mut library,
        AlphaMask::from_fn(9, 9, |_, _| false).expect("valid by construction"),
    );
    library
}

pub(crate) fn add_masked(library: &mut MaterialLibrary, mask: AlphaMask) -> MaterialId {
    library.add(Material {
        mask: Some(Arc::new(mask)),
        ..Material::plain("leaf", Semantic::Leaf, Vec3::splat(0.1))
    })
}

pub(crate) fn blas(mesh: Mesh, cards: Vec<Card>, library: &MaterialLibrary) -> Arc<Blas> {
    let prototype = Prototype::new("shape", mesh, cards, library).expect("valid by construction");
    blas_of(Arc::new(prototype), library)
}

pub(crate) fn blas_of(prototype: Arc<Prototype>, library: &MaterialLibrary) -> Arc<Blas> {
    // Results do not depend on the quality, so half of the shapes are built with one and half with
    // the other.
    let careful = prototype.cards().len().is_multiple_of(2);
    let quality = if careful {
        BuildQuality::High
    } else {
        BuildQuality::Fast
    };
    Arc::new(Blas::with_quality(prototype, library, quality))
}

/// A mesh of separate triangles with unit normals and given uvs.
pub(crate) fn soup(corners: impl IntoIterator<Item = ([Vec3; 3], [Vec2; 3], MaterialId)>) -> Mesh {
    let mut mesh = Mesh::default();
    for (points, uvs, material) in corners {
        let first = mesh.positions.len() as u32;
        let normal = (points[1] - points[0]).cross(points[2] - points[0]);
        mesh.positions.extend(points);
        mesh.normals
            .extend([normal.try_normalize().unwrap_or(Vec3::Z); 3]);
        mesh.uvs.extend(uvs);
        mesh.triangles.push(Triangle {
            corners: [first, first + 1, first + 2],
            material,
        });
    }
    mesh
}

/// Triangles and cards in a box of half size `half`, some masked, some without area.
pub(crate) fn clutter(
    rng: &mut PhiloxRng,
    triangles: u32,
    cards: u32,
    half: f32,
) -> (Mesh, Vec<Card>) {
    let material = |rng: &mut PhiloxRng| MaterialId(rng.below(7) as u16);
    let mut mesh = soup((0..triangles).map(|_| {
        let a = cube(rng, half);
        let size = rng.range_f32(0.01, 1.0) * half;
        let flat = f32::from(u8::from(!rng.chance(0.05)));
        let (b, c) = (a + cube(rng, size), a + cube(rng, size) * flat);
        let uvs = [0, 1, 2].map(|_| Vec2::new(rng.range_f32(-0.2, 1.2), rng.range_f32(-0.2, 1.2)));
        ([a, b, c], uvs, material(rng))
    }));
    mesh.normals.iter_mut().for_each(|n| *n = direction(rng));
    let cards = (0..cards)
        .map(|_| {
            let size = rng.range_f32(0.01, 1.0) * half;
            let flat = f32::from(u8::from(!rng.chance(0.05)));
            Card {
                corner: cube(rng, half),
                edge_u: cube(rng, size),
                edge_v: cube(rng, size) * flat,
                material: material(rng),
            }
        })
        .collect();
    (mesh, cards)
}

pub(crate) fn place(
    blas: &Arc<Blas>,
    position_m: Vec3,
    linear: Mat3,
    item: u16,
) -> (InstancePlace, Arc<Blas>) {
    let object = ObjectId::new(ChunkCoord::new(0, 0), item).unwrap_or(ObjectId::NONE);
    let place = InstancePlace {
        position_m,
        linear,
        object,
        variation: f32::from(item) / 16.0,
    };
    (place, Arc::clone(blas))
}

/// A random invertible map of moderate size: rotated, scaled, sheared, sometimes mirrored or the
/// identity.
pub(crate) fn linear(rng: &mut PhiloxRng) -> Mat3 {
    if rng.chance(0.2) {
        return Mat3::IDENTITY;
    }
    let turn = Mat3::from_quat(Quat::from_axis_angle(
        direction(rng),
        rng.range_f32(0.0, 6.0),
    ));
    let mirror = if rng.chance(0.2) { -1.0 } else { 1.0 };
    let mut axis = || rng.range_f32(0.3, 3.0);
    let scale = Mat3::from_diagonal(Vec3::new(axis() * mirror, axis(), axis()));
    let gradient = Vec2::new(rng.range_f32(-0.5, 0.5), rng.range_f32(-0.5, 0.5));
    Instance::upright(rng.range_f32(0.0, 6.3), rng.range_f32(0.5, 2.0), gradient) * turn * scale
}

/// A random scene and points worth aiming at.
pub(crate) fn scene(seed: u64) -> (Groups, Vec<Vec3>) {
    let library = library(seed);
    let mut rng = rng(seed, "scene");
    let shapes: Vec<Arc<Blas>> = (0..rng.between(1, 4))
        .map(|_| {
            let half = rng.range_f32(0.05, 3.0);
            let (triangles, cards) = (rng.below(40), rng.below(40));
            let (mesh, cards) =
                clutter(&mut rng, triangles.max(u32::from(cards == 0)), cards, half);
            blas(mesh, cards, &library)
        })
        .collect();
    let reach = if rng.chance(0.5) { 400.0 } else { 5.0 };
    let mut targets = Vec::new();
    let groups = (0..rng.between(1, 5))
        .map(|_| {
            let offset = cube(&mut rng, reach);
            let instances = (0..rng.below(20))
                .map(|_| {
                    let shape = rng.choose(&shapes);
                    let position = cube(&mut rng, 6.0);
                    targets.push(offset + position);
                    place(shape, position, linear(&mut rng), rng.below(4) as u16)
                })
                .collect();
            (offset, Arc::new(Group::build(instances)))
        })
        .collect();
    targets.push(Vec3::ZERO);
    (groups, targets)
}

/// Rays near and through the targets, with all kinds of range.
pub(crate) fn rays(seed: u64, targets: &[Vec3], n: usize) -> Vec<Ray> {
    let mut rng = rng(seed, "rays");
    (0..n)
        .map(|i| {
            let target = *rng.choose(targets) + cube(&mut rng, 1.5);
            let away = [0.5, 5.0, 50.0, 300.0][i % 4];
            let mut r = ray(target + direction(&mut rng) * away, target);
            if i % 5 == 0 {
                // A direction along an axis, where the slab test divides by zero.
                r.direction = [Vec3::X, -Vec3::Y, -Vec3::Z][i % 3];
                r.origin = target - r.direction * away;
            }
            if i % 7 == 0 {
                r.t_min_m = rng.range_f32(0.0, 1.5 * away);
                r.t_max_m = r.t_min_m + rng.range_f32(0.0, away);
            }
            r
        })
        .collect()
}

/// What each ray meets.
pub(crate) fn all(caster: &impl RayCaster, rays: &[Ray]) -> Vec<Option<Hit>> {
    rays.iter().map(|r| caster.closest_hit(r)).collect()
}

/// Equal to the bit, the sign of zero included.
pub(crate) fn bits(hits: &[Option<Hit>]) -> Vec<String> {
    hits.iter().map(|h| format!("{h:?}")).collect()
}

/// A library of one opaque material.
pub(crate) fn plain() -> MaterialLibrary {
    let mut library = MaterialLibrary::new();
    library.add(Material::plain("plain", Semantic::Rock, Vec3::ONE));
    library
}

/// The material of [`plain`].
pub(crate) const OPAQUE: MaterialId = MaterialId(0);

/// A card of 1 m about the origin.
pub(crate) fn square() -> Card {
    Card {
        corner: Vec3::new(-0.5, -0.5, 0.0),
        edge_u: Vec3::X,
        edge_v: Vec3::Y,
        material: OPAQUE,
    }
}

/// A scene of one shape at the origin.
pub(crate) fn alone(blas: &Arc<Blas>, linear: Mat3) -> Groups {
    vec![(
        Vec3::ZERO,
        Arc::new(Group::build(vec![place(blas, Vec3::ZERO, linear, 1)])),
    )]
}
