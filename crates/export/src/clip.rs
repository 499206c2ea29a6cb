//! Cutting ground and water along the borders of a rectangle.

use std::collections::HashMap;

use nemoral_scene::glam::{Vec2, Vec3};
use nemoral_scene::{Mesh, Triangle};

/// A vertex with what it carries.
#[derive(Clone, Copy)]
struct Vertex {
    position: Vec3,
    normal: Vec3,
    uv: Vec2,
    /// Its number in the mesh, if it is one of the mesh's.
    number: Option<u32>,
}

impl Vertex {
    /// The point between two vertices, `t` of the way from the first to the second.
    fn between(self, other: Self, t: f32) -> Self {
        Self {
            position: self.position.lerp(other.position, t),
            normal: self.normal.lerp(other.normal, t).normalize_or(self.normal),
            uv: self.uv.lerp(other.uv, t),
            number: None,
        }
    }
}

/// The part of a mesh above a rectangle of its ground plane, borders included, cut exactly there
/// (Sutherland and Hodgman 1974, "Reentrant polygon clipping"). Triangles inside stay as they are,
/// in their order; blends are left out. It may be empty.
#[must_use]
pub fn clipped(mesh: &Mesh, low: Vec2, high: Vec2) -> Mesh {
    let mut cut = Cut {
        mesh: Mesh::default(),
        has_normals: !mesh.normals.is_empty(),
        has_uvs: !mesh.uvs.is_empty(),
        known: HashMap::new(),
    };
    for triangle in &mesh.triangles {
        let corners = triangle.corners.map(|corner| Vertex {
            position: mesh.positions[corner as usize],
            normal: mesh.normal(corner).unwrap_or(Vec3::Z),
            uv: mesh.uv(corner),
            number: Some(corner),
        });
        let mut polygon = corners.to_vec();
        for axis in 0..2 {
            polygon = cut_off(&polygon, |p| p[axis] - low[axis], low[axis], axis);
            polygon = cut_off(&polygon, |p| high[axis] - p[axis], high[axis], axis);
        }
        for i in 2..polygon.len() {
            let corners = [polygon[0], polygon[i - 1], polygon[i]];
            let [a, b, c] = corners.map(|v| v.position);
            // Slivers of a border that only touches a triangle.
            if (b - a).cross(c - a) != Vec3::ZERO {
                let corners = corners.map(|v| cut.number(v));
                cut.mesh.triangles.push(Triangle {
                    corners,
                    material: triangle.material,
                });
            }
        }
    }
    cut.mesh
}

/// The part of a polygon where `inside` is at least 0, which it is linearly; its border has this
/// coordinate.
fn cut_off(
    polygon: &[Vertex],
    inside: impl Fn(Vec3) -> f32,
    border: f32,
    axis: usize,
) -> Vec<Vertex> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, &to) in polygon.iter().enumerate() {
        let from = polygon[(i + polygon.len() - 1) % polygon.len()];
        let (a, b) = (inside(from.position), inside(to.position));
        if (a < 0.0) != (b < 0.0) {
            let mut cut = from.between(to, a / (a - b));
            cut.position[axis] = border;
            kept.push(cut);
        }
        if b >= 0.0 {
            kept.push(to);
        }
    }
    kept
}

struct Cut {
    mesh: Mesh,
    has_normals: bool,
    has_uvs: bool,
    known: HashMap<u32, u32>,
}

impl Cut {
    fn number(&mut self, vertex: Vertex) -> u32 {
        if let Some(&number) = vertex.number.and_then(|n| self.known.get(&n)) {
            return number;
        }
        let number = self.mesh.positions.len() as u32;
        self.mesh.positions.push(vertex.position);
        if self.has_normals {
            self.mesh.normals.push(vertex.normal);
        }
        if self.has_uvs {
            self.mesh.uvs.push(vertex.uv);
        }
        if let Some(known) = vertex.number {
            self.known.insert(known, number);
        }
        number
    }
}

#[cfg(test)]
mod tests {
    use nemoral_scene::MaterialId;

    use super::*;

    /// A slope of 10 by 10 m.
    fn slope() -> Mesh {
        let at = |x: f32, y: f32| Vec3::new(x, y, 0.5 * x + 0.25 * y);
        let positions = vec![at(0.0, 0.0), at(10.0, 0.0), at(10.0, 10.0), at(0.0, 10.0)];
        Mesh {
            uvs: positions.iter().map(|p| p.truncate()).collect(),
            positions,
            triangles: [[0, 1, 2], [0, 2, 3]]
                .map(|corners| Triangle {
                    corners,
                    material: MaterialId(0),
                })
                .to_vec(),
            ..Mesh::default()
        }
    }

    fn area(mesh: &Mesh) -> f32 {
        let of = |t: &Triangle| {
            let [a, b, c] = t.corners.map(|i| mesh.positions[i as usize].truncate());
            (b - a).perp_dot(c - a) / 2.0
        };
        mesh.triangles.iter().map(of).sum()
    }

    #[test]
    fn what_is_cut_lies_on_the_mesh_and_fills_the_rectangle() {
        let (low, high) = (Vec2::new(1.5, 2.0), Vec2::new(7.0, 9.25));
        let cut = clipped(&slope(), low, high);
        assert!((area(&cut) - 5.5 * 7.25).abs() < 1e-4, "{}", area(&cut));
        for (p, uv) in cut.positions.iter().zip(&cut.uvs) {
            assert!((p.z - 0.5 * p.x - 0.25 * p.y).abs() < 1e-5);
            assert!(p.truncate().cmpge(low).all() && p.truncate().cmple(high).all());
            assert!(uv.distance(p.truncate()) < 1e-5);
        }
        assert!(cut.normals.is_empty());
    }

    #[test]
    fn inside_all_stays_and_outside_nothing() {
        let all = clipped(&slope(), Vec2::ZERO, Vec2::splat(10.0));
        assert_eq!(all, slope());
        let none = clipped(&slope(), Vec2::splat(11.0), Vec2::splat(12.0));
        assert_eq!(none, Mesh::default());
        // A border that touches an edge leaves nothing.
        let edge = clipped(&slope(), Vec2::new(10.0, 0.0), Vec2::new(12.0, 10.0));
        assert!(edge.triangles.is_empty());
    }
}
