//! The guarantees of a ground mesh.

use std::collections::HashMap;

use nemoral_scene::glam::{DVec2, Vec3};
use nemoral_scene::{ChunkCoord, FlatSurface, MaterialId, Mesh, Surface};
use nemoral_seed::Key;
use nemoral_terrain::{
    GroundMesher, GroundZones, MeshParams, NoZones, NoiseTerrain, TerrainParams, ZoneSample,
};
use proptest::prelude::*;

const OUTSIDE: MaterialId = MaterialId(0);
const INSIDE: MaterialId = MaterialId(1);

/// A zone by its exact signed distance.
struct Zone<F>(F);

impl<F: Fn(DVec2) -> f64 + Send + Sync> GroundZones for Zone<F> {
    fn sample(&self, world_m: DVec2) -> ZoneSample {
        let edge_m = (self.0)(world_m);
        ZoneSample {
            edge_m,
            detail_m: if edge_m < 0.0 { 0.25 } else { f64::INFINITY },
        }
    }
}

fn terrain() -> NoiseTerrain {
    NoiseTerrain::new(TerrainParams::default(), Key::world(7)).expect("valid")
}

fn mesher(chunk_size_m: f64) -> GroundMesher {
    GroundMesher::new(MeshParams {
        chunk_size_m,
        ..MeshParams::default()
    })
    .expect("valid")
}

fn mesh(
    m: &GroundMesher,
    coord: ChunkCoord,
    surface: &dyn Surface,
    zones: &dyn GroundZones,
) -> Mesh {
    m.mesh(coord, surface, zones, &|_, inside| {
        if inside { INSIDE } else { OUTSIDE }
    })
}

/// Twice the signed area of a triangle's projection, m².
fn doubled_area(m: &Mesh, corners: [u32; 3]) -> f64 {
    let [a, b, c] = corners.map(|i| m.positions[i as usize].truncate().as_dvec2());
    (b - a).perp_dot(c - a)
}

/// How often each directed side occurs.
fn sides(m: &Mesh) -> HashMap<(u32, u32), u32> {
    let mut count = HashMap::new();
    for t in &m.triangles {
        let [a, b, c] = t.corners;
        for side in [(a, b), (b, c), (c, a)] {
            *count.entry(side).or_insert(0) += 1;
        }
    }
    count
}

fn check(m: &Mesh, size: f64) {
    let on_border = |p: Vec3, q: Vec3| {
        let same = |a: f32, b: f32| a == b && (a == 0.0 || a == size as f32);
        same(p.x, q.x) || same(p.y, q.y)
    };
    let count = sides(m);
    for t in &m.triangles {
        let [a, b, c] = t.corners;
        for (a, b) in [(a, b), (b, c), (c, a)] {
            assert_eq!(count[&(a, b)], 1, "a side is used twice in one direction");
            let [p, q] = [a, b].map(|i| m.positions[i as usize]);
            let paired = count.get(&(b, a)) == Some(&1);
            assert_eq!(paired, !on_border(p, q), "{p} {q}");
        }
        assert!(doubled_area(m, t.corners) > 0.0);
    }
    let area: f64 = m
        .triangles
        .iter()
        .map(|t| doubled_area(m, t.corners) / 2.0)
        .sum();
    assert!((area - size * size).abs() < 1e-4 * size, "{area}");
    // No two vertices are at the same place, because gaps between sides would not be found
    // otherwise.
    let mut places = HashMap::new();
    for p in &m.positions {
        assert!(
            places.insert((p.x.to_bits(), p.y.to_bits()), ()).is_none(),
            "{p} twice"
        );
    }
    let shares = shares_inside(m);
    assert!(
        shares.iter().all(|s| [0.0, 0.5, 1.0].contains(s)),
        "{shares:?}"
    );
    assert_eq!(
        (m.normals.len(), m.uvs.len()),
        (m.positions.len(), m.positions.len())
    );
    assert!(
        m.normals
            .iter()
            .all(|n| (n.length() - 1.0).abs() < 1e-5 && n.z > 0.0)
    );
}

/// The share of the zone in each vertex's colour, on which all triangles around it agree.
fn shares_inside(m: &Mesh) -> Vec<f32> {
    assert_eq!(m.blends.len(), m.triangles.len());
    let mut shares = vec![f32::NAN; m.positions.len()];
    for (t, blend) in m.triangles.iter().zip(&m.blends) {
        for (corner, halves) in t.corners.into_iter().zip(blend.corners) {
            let of_zone = halves.iter().filter(|&&half| half == INSIDE).count();
            let inside = 0.5 * of_zone as f32;
            let known = &mut shares[corner as usize];
            assert!(known.is_nan() || *known == inside, "{known} {inside}");
            *known = inside;
        }
    }
    shares
}

/// The vertices on one border, by the coordinate along it: height, normal and colour as bits.
fn border(m: &Mesh, along: impl Fn(Vec3) -> Option<f32>) -> Vec<[u32; 6]> {
    let shares = shares_inside(m);
    let mut out: Vec<_> = (0..m.positions.len())
        .filter_map(|i| {
            let (p, n) = (m.positions[i], m.normals[i]);
            along(p).map(|s| [s, p.z, n.x, n.y, n.z, shares[i]].map(f32::to_bits))
        })
        .collect();
    out.sort_unstable();
    out
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn meshes_are_watertight_and_neighbours_agree_to_the_bit(
        x in -1_000_000..1_000_000_i32,
        y in -1_000_000..1_000_000_i32,
        size in prop_oneof![Just(50.0), Just(64.0), 7.0_f64..60.0],
        angle in 0.0_f64..6.3,
        offset in -9.0_f64..9.0,
        radius in 1.0_f64..20.0,
        tolerance_m in 0.005_f64..0.2,
    ) {
        let coord = ChunkCoord::new(x, y);
        // A stripe and a disc around the chunk's north-east corner.
        let corner = coord.offset(1, 1).origin_m(size);
        let n = DVec2::from_angle(angle);
        let zone = Zone(move |p: DVec2| {
            let q = p - corner;
            ((q.dot(n) - offset).abs() - 1.5).min(q.length() - radius)
        });
        let surface = terrain();
        let m = GroundMesher::new(MeshParams {
            chunk_size_m: size,
            tolerance_m,
            ..MeshParams::default()
        })
        .expect("valid");
        let here = mesh(&m, coord, &surface, &zone);
        check(&here, size);
        let east = mesh(&m, coord.offset(1, 0), &surface, &zone);
        let north = mesh(&m, coord.offset(0, 1), &surface, &zone);
        let far = size as f32;
        let a = border(&here, |p| (p.x == far).then_some(p.y));
        let b = border(&east, |p| (p.x == 0.0).then_some(p.y));
        prop_assert!(a.len() >= (size / 0.26) as usize);
        prop_assert_eq!(a, b);
        let a = border(&here, |p| (p.y == far).then_some(p.x));
        let b = border(&north, |p| (p.y == 0.0).then_some(p.x));
        prop_assert_eq!(a, b);
    }

    #[test]
    fn class_edges_are_where_they_are(
        x in 10.0_f64..40.0,
        y in 10.0_f64..40.0,
        radius in 1.0_f64..9.0,
        angle in 0.0_f64..6.3,
    ) {
        let centre = DVec2::new(x, y);
        let disc = Zone(move |p: DVec2| p.distance(centre) - radius);
        class_edge(&disc, std::f64::consts::PI * radius * radius, radius);
        let n = DVec2::from_angle(angle);
        let stripe = Zone(move |p: DVec2| (p - centre).dot(n).abs() - 1.0);
        class_edge(&stripe, f64::NAN, f64::INFINITY);
    }
}

/// Every side between the classes is within 2 cm of the zone's true edge, and no triangle has its
/// middle on the wrong side by more.
fn class_edge<F: Fn(DVec2) -> f64 + Send + Sync>(zone: &Zone<F>, area: f64, radius: f64) {
    let m = mesh(&mesher(50.0), ChunkCoord::new(0, 0), &terrain(), zone);
    let mut owner = HashMap::new();
    for t in &m.triangles {
        let [a, b, c] = t.corners;
        for side in [(a, b), (b, c), (c, a)] {
            owner.insert(side, t.material);
        }
    }
    let place = |i: u32| m.positions[i as usize].truncate().as_dvec2();
    let mut borders = 0;
    for t in m.triangles.iter().filter(|t| t.material == INSIDE) {
        let [a, b, c] = t.corners;
        for (a, b) in [(a, b), (b, c), (c, a)] {
            if owner.get(&(b, a)) == Some(&OUTSIDE) {
                borders += 1;
                for k in 0..=4 {
                    let p = place(a).lerp(place(b), f64::from(k) / 4.0);
                    assert!((zone.0)(p).abs() < 0.02, "{p}: {}", (zone.0)(p));
                }
            }
        }
    }
    assert!(borders > 20);
    // The blend is half and half on the line and nowhere else.
    for (p, share) in m.positions.iter().zip(shares_inside(&m)) {
        let e = (zone.0)(p.truncate().as_dvec2());
        let expected = match share {
            0.5 => e.abs() < 0.002,
            s => e.abs() < 0.002 || (s == 1.0) == (e < 0.0),
        };
        assert!(expected, "{p}: {share} at {e} m");
    }
    for t in &m.triangles {
        let [a, b, c] = t.corners.map(place);
        let e = (zone.0)((a + b + c) / 3.0);
        assert!(
            if t.material == INSIDE {
                e < 0.02
            } else {
                e > -0.02
            },
            "{e}"
        );
    }
    if area.is_finite() {
        let inside = m.triangles.iter().filter(|t| t.material == INSIDE);
        let sum: f64 = inside.map(|t| doubled_area(&m, t.corners) / 2.0).sum();
        assert!(
            (sum - area).abs() < 0.02 * std::f64::consts::TAU * radius,
            "{sum} {area}"
        );
    }
}

#[test]
fn an_edge_through_the_lattice_is_followed() {
    // Edges exactly on lattice lines, and a micrometre beside them.
    for offset in [0.0, 1e-6, -1e-6, 9e-4, 2e-3] {
        let zone = Zone(move |p: DVec2| (p.x - 25.0 - offset).abs() - 1.5);
        let m = mesh(&mesher(50.0), ChunkCoord::new(0, 0), &terrain(), &zone);
        check(&m, 50.0);
        let inside = m.triangles.iter().filter(|t| t.material == INSIDE);
        let area: f64 = inside.map(|t| doubled_area(&m, t.corners) / 2.0).sum();
        assert!((area - 150.0).abs() < 0.1, "{area}");
    }
}

#[test]
fn triangles_are_spent_where_they_are_asked_for() {
    let flat = FlatSurface::default();
    let m = mesher(50.0);
    let plain = mesh(&m, ChunkCoord::new(2, 3), &flat, &NoZones)
        .triangles
        .len();
    let hilly = mesh(&m, ChunkCoord::new(2, 3), &terrain(), &NoZones)
        .triangles
        .len();
    let trail = Zone(|p: DVec2| (p.x - 125.0 - 0.1 * (p.y - 175.0)).abs() - 1.5);
    let trail = mesh(&m, ChunkCoord::new(2, 3), &terrain(), &trail)
        .triangles
        .len();
    assert!(plain < 8000, "{plain}");
    assert!(hilly < 9000, "{hilly}");
    assert!((15_000..25_000).contains(&trail), "{trail}");
}

#[test]
fn curvature_asks_for_triangles() {
    struct Bump;
    impl Surface for Bump {
        fn sample(&self, p: DVec2) -> nemoral_scene::SurfaceSample {
            let q = p - DVec2::new(25.2, 24.7);
            let height_m = (-q.length_squared()).exp();
            nemoral_scene::SurfaceSample {
                height_m,
                gradient: -2.0 * height_m * q,
            }
        }
    }
    let worst = |tolerance_m: f64| {
        let m = GroundMesher::new(MeshParams {
            tolerance_m,
            ..MeshParams::default()
        })
        .expect("valid");
        let m = mesh(&m, ChunkCoord::new(0, 0), &Bump, &NoZones);
        let miss = |t: &nemoral_scene::Triangle| {
            let [a, b, c] = t.corners.map(|i| m.positions[i as usize].as_dvec3());
            let p = (a + b + c) / 3.0;
            (Bump.height_m(p.truncate()) - p.z).abs()
        };
        m.triangles.iter().map(miss).fold(0.0, f64::max)
    };
    assert!(worst(f64::INFINITY) > 0.1);
    assert!(worst(0.02) < 0.03);
}

#[test]
fn uvs_are_metres_and_continuous_to_the_texture() {
    let m = mesher(50.0);
    for coord in [ChunkCoord::new(0, 0), ChunkCoord::new(-1, 1_000_000)] {
        let mesh = mesh(&m, coord, &FlatSurface::default(), &NoZones);
        let origin = coord.origin_m(50.0);
        for (p, uv) in mesh.positions.iter().zip(&mesh.uvs) {
            let world = origin + p.truncate().as_dvec2();
            let wrapped = (uv.as_dvec2() - world) / 1024.0;
            assert!((wrapped - wrapped.round()).length() < 1e-6, "{uv} {world}");
        }
    }
}

#[test]
fn impossible_meshes_are_refused() {
    let refused = |p: MeshParams| GroundMesher::new(p).expect_err("refused").field;
    let good = MeshParams::default();
    assert_eq!(
        refused(MeshParams {
            chunk_size_m: 0.0,
            ..good
        }),
        "chunk_size_m"
    );
    assert_eq!(
        refused(MeshParams {
            cell_m: 51.0,
            ..good
        }),
        "cell_m"
    );
    assert_eq!(
        refused(MeshParams {
            fine_cell_m: 2.0,
            ..good
        }),
        "fine_cell_m"
    );
    assert_eq!(
        refused(MeshParams {
            fine_cell_m: 0.01,
            ..good
        }),
        "fine_cell_m"
    );
    assert_eq!(
        refused(MeshParams {
            tolerance_m: f64::NAN,
            ..good
        }),
        "tolerance_m"
    );
}

#[test]
fn value_stability() {
    let zone = Zone(|p: DVec2| p.distance(DVec2::new(20.0, 22.0)) - 5.0);
    let m = mesh(&mesher(50.0), ChunkCoord::new(0, 0), &terrain(), &zone);
    let sum: f64 = m.positions.iter().map(|p| f64::from(p.x * p.y + p.z)).sum();
    assert_eq!(
        format!("{} {} {sum:?}", m.positions.len(), m.triangles.len()),
        VALUES
    );
}
const VALUES: &str = "5825 10848 3323340.2805011272";
