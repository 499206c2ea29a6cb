//! Agreement with casters that share no code with this crate: parry's triangles, and a solver in
//! f64.

use crate::common::{self, Groups, scene};
use glam::{DMat3, DVec2, DVec3};
use nemoral_raycast::RayScene;
use nemoral_scene::{
    AlphaMask, Card, Hit, MaterialId, MaterialLibrary, Mesh, ObjectId, Ray, RayCaster,
};
use parry3d::query::RayCast;

/// A primitive in the scene, relative to a ray's origin.
struct Placed<'a> {
    corners: [DVec3; 3],
    /// Texture coordinates at the corners.
    uvs: [DVec2; 3],
    card: bool,
    mask: Option<&'a AlphaMask>,
    material: MaterialId,
    object: ObjectId,
    mirrored: bool,
}

#[derive(Clone, Copy, Debug)]
struct Found {
    t: f64,
    material: MaterialId,
    object: ObjectId,
    normal: DVec3,
    uv_per_m: f64,
}

impl Found {
    fn of(t: f64, p: &Placed) -> Self {
        let [a, b, c] = p.corners;
        let [s, t0, t1] = p.uvs;
        let cross = (b - a).cross(c - a);
        let uv_area = (t0 - s).perp_dot(t1 - s).abs();
        Self {
            t,
            material: p.material,
            object: p.object,
            normal: cross.normalize() * if p.mirrored { -1.0 } else { 1.0 },
            uv_per_m: (uv_area / cross.length()).sqrt(),
        }
    }
}

fn placed<'a>(groups: &Groups, library: &'a MaterialLibrary, ray: &Ray) -> Vec<Placed<'a>> {
    let mut all = Vec::new();
    for (offset, group) in groups {
        for (instance, blas) in group.instances() {
            let linear = instance.linear.as_dmat3();
            let origin = offset.as_dvec3() + instance.position_m.as_dvec3() - ray.origin.as_dvec3();
            let at = |p: DVec3| origin + linear * p;
            let mut add = |corners: [DVec3; 3], uvs, card, material| {
                let mask = library.get(material).mask.as_deref();
                let object = instance.object;
                let mirrored = linear.determinant() < 0.0;
                all.push(Placed {
                    corners: corners.map(at),
                    uvs,
                    card,
                    mask,
                    material,
                    object,
                    mirrored,
                });
            };
            let mesh: &Mesh = blas.prototype().mesh();
            for t in &mesh.triangles {
                let corners = t.corners.map(|i| mesh.positions[i as usize].as_dvec3());
                let uvs = t.corners.map(|i| mesh.uvs[i as usize].as_dvec2());
                add(corners, uvs, false, t.material);
            }
            for &Card {
                corner,
                edge_u,
                edge_v,
                material,
            } in blas.prototype().cards()
            {
                let [c, u, v] = [corner, edge_u, edge_v].map(|p| p.as_dvec3());
                add(
                    [c, c + u, c + v],
                    [DVec2::ZERO, DVec2::X, DVec2::Y],
                    true,
                    material,
                );
            }
        }
    }
    all
}

impl Placed<'_> {
    /// The solver: `origin + t d = a + u (b − a) + v (c − a)` by an inverse matrix. Returns t, the
    /// weights, and how close the decision is: the distance of the weights from the border and of
    /// the texture coordinates from the next texel, both in shares of the primitive.
    fn solve(&self, d: DVec3) -> Option<(f64, bool, f64)> {
        let [a, b, c] = self.corners;
        let matrix = DMat3::from_cols(b - a, c - a, -d);
        if matrix.determinant() == 0.0 {
            return None;
        }
        let x = matrix.inverse() * -a;
        let (u, v, t) = (x.x, x.y, x.z);
        let sides = if self.card {
            [u, v, 1.0 - u, 1.0 - v]
        } else {
            [u, v, 1.0 - u - v, 1.0]
        };
        let depth = sides.into_iter().fold(f64::INFINITY, f64::min);
        let mut margin = depth.abs();
        let mut there = depth >= 0.0;
        if let (true, Some(mask)) = (there, self.mask) {
            let uv =
                self.uvs[0] + (self.uvs[1] - self.uvs[0]) * u + (self.uvs[2] - self.uvs[0]) * v;
            let size = DVec2::new(mask.width() as f64, mask.height() as f64);
            let texel = uv * size;
            let border = (texel - texel.round()).abs() / size;
            margin = margin.min(border.min_element());
            there = mask.is_opaque(uv.x as f32, uv.y as f32);
        }
        Some((t, there, margin))
    }

    /// The same by parry, in f32.
    fn parry(&self, ray: &Ray) -> Option<f64> {
        let [a, b, c] = self.corners.map(|p| p.as_vec3());
        let cast = |corners: [glam::Vec3; 3]| {
            let [p, q, r] = corners;
            let triangle = parry3d::shape::Triangle::new(p, q, r);
            let along = parry3d::query::Ray::new(glam::Vec3::ZERO, ray.direction);
            triangle.cast_local_ray(&along, f32::MAX, false)
        };
        let t = cast([a, b, c]).or_else(|| self.card.then(|| cast([b, b + c - a, c])).flatten())?;
        let Some(mask) = self.mask else {
            return Some(t.into());
        };
        let (e, f, p) = (
            (b - a).as_dvec3(),
            (c - a).as_dvec3(),
            (ray.direction * t - a).as_dvec3(),
        );
        let n = e.cross(f);
        let (u, v) = (p.cross(f).dot(n) / n.dot(n), e.cross(p).dot(n) / n.dot(n));
        let uv = self.uvs[0] + (self.uvs[1] - self.uvs[0]) * u + (self.uvs[2] - self.uvs[0]) * v;
        mask.is_opaque(uv.x as f32, uv.y as f32).then_some(t.into())
    }
}

/// The nearest hit in range, by distance and then by id.
fn nearest(found: impl Iterator<Item = Found>, ray: &Ray) -> Option<Found> {
    let range = f64::from(ray.t_min_m)..=f64::from(ray.t_max_m);
    found
        .filter(|f| range.contains(&f.t))
        .min_by(|a, b| a.t.total_cmp(&b.t))
}

fn agree(a: &Option<Hit>, b: &Option<Found>) -> bool {
    match (a, b) {
        (None, None) => true,
        (Some(a), Some(b)) => {
            let t = f64::from(a.surface.distance_m);
            let same = a.surface.object == b.object && a.surface.material == b.material;
            let normal = a.surface.geometric_normal.as_dvec3();
            same && (t - b.t).abs() <= 1e-4 * t.abs().max(b.t.abs())
                && normal.distance(b.normal) < 1e-4
                && (f64::from(a.shading.uv_per_m) - b.uv_per_m).abs() <= 1e-4 * b.uv_per_m
        }
        _ => false,
    }
}

#[test]
fn parry_and_an_f64_solver_agree() {
    let (mut rays, mut hits, mut masked, mut parry_differs, mut solver_unsure) = (0, 0, 0, 0, 0);
    for seed in 0..60 {
        let (groups, targets) = scene(seed);
        let library = common::library(seed);
        let forest = RayScene::new(groups.clone());
        for ray in common::rays(seed, &targets, 120) {
            let ours = forest.closest_hit(&ray);
            let things = placed(&groups, &library, &ray);
            let d = ray.direction.as_dvec3();
            rays += 1;
            hits += u32::from(ours.is_some());
            masked +=
                u32::from(ours.is_some_and(|h| library.get(h.surface.material).mask.is_some()));

            // A decision is delicate if some primitive on the way is met within a millionth of its
            // size of a border or texel edge, or two are met at all but the same distance, or at
            // the end of the range.
            let solved: Vec<(Found, bool, f64)> = things
                .iter()
                .filter_map(|p| {
                    p.solve(d)
                        .map(|(t, there, margin)| (Found::of(t, p), there, margin))
                })
                .collect();
            let by_solver = nearest(solved.iter().filter(|s| s.1).map(|s| s.0), &ray);
            let delicate = |tolerance: f64| {
                let near = |a: f64, b: f64| (a - b).abs() <= tolerance * a.abs().max(b.abs());
                let ends = [ray.t_min_m, ray.t_max_m].map(f64::from);
                let first = ends[0] * (1.0 - tolerance);
                let last = by_solver.map_or(ends[1], |f| f.t) * (1.0 + tolerance);
                solved.iter().any(|(f, there, margin)| {
                    let close_call = *margin < tolerance;
                    let twin = by_solver.is_some_and(|b| {
                        near(f.t, b.t) && (f.object, f.material) != (b.object, b.material)
                    });
                    let at_end = ends
                        .into_iter()
                        .any(|end| end.is_finite() && near(f.t, end));
                    (first..=last).contains(&f.t) && (close_call || *there && (twin || at_end))
                })
            };
            if delicate(1e-6) {
                solver_unsure += 1;
            } else {
                assert!(
                    agree(&ours, &by_solver),
                    "seed {seed}, {ray:?}: {ours:?}, f64 {by_solver:?}"
                );
            }

            // parry computes in f32, so it may differ only where the f64 solver calls the decision
            // delicate.
            let by_parry = things
                .iter()
                .filter_map(|p| p.parry(&ray).map(|t| Found::of(t, p)));
            let by_parry = nearest(by_parry, &ray);
            if !agree(&ours, &by_parry) {
                parry_differs += 1;
                assert!(
                    delicate(1e-2),
                    "seed {seed}, {ray:?}: {ours:?}, parry {by_parry:?}"
                );
            }
        }
    }
    assert!(
        hits > 2000 && masked > 500,
        "{hits} hits, {masked} on masks, of {rays} rays"
    );
    assert!(
        parry_differs * 100 < rays,
        "parry differs in {parry_differs} of {rays}"
    );
    assert!(
        solver_unsure * 200 < rays,
        "the solver is unsure in {solver_unsure} of {rays}"
    );
}
