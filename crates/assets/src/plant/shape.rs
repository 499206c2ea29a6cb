//! Building blocks of plants: swept wood and cards.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};
use nemoral_scene::{Card, MaterialId, Mesh, Prototype, Triangle};

use crate::tree::FoliageCard;

/// A shape under construction.
#[derive(Clone, Debug, Default)]
pub(crate) struct Shape {
    pub(crate) mesh: Mesh,
    pub(crate) cards: Vec<Card>,
}

/// The unit vector at an angle about the vertical, radians from +x.
pub(crate) fn around(angle: f32) -> Vec3 {
    let a = f64::from(angle);
    Vec3::new(libm::cos(a) as f32, libm::sin(a) as f32, 0.0)
}

/// The unit vector at an azimuth, `tilt` radians off the vertical.
pub(crate) fn leaning(azimuth: f32, tilt: f32) -> Vec3 {
    let t = f64::from(tilt);
    around(azimuth) * libm::sin(t) as f32 + Vec3::Z * libm::cos(t) as f32
}

impl Shape {
    /// The parts of a finished shape.
    pub(crate) fn of(shape: &Prototype) -> Self {
        Self {
            mesh: shape.mesh().clone(),
            cards: shape.cards().to_vec(),
        }
    }

    /// Presses it towards the ground: heights are multiplied by a share.
    pub(crate) fn flatten(&mut self, share: f32) {
        if share == 1.0 {
            return;
        }
        let pressed = Vec3::new(1.0, 1.0, share);
        for position in &mut self.mesh.positions {
            *position *= pressed;
        }
        for normal in &mut self.mesh.normals {
            *normal = (*normal / pressed).normalize_or(Vec3::Z);
        }
        for card in &mut self.cards {
            card.corner *= pressed;
            card.edge_u *= pressed;
            card.edge_v *= pressed;
        }
    }

    /// Hangs an image at `base`, growing along `along` and spread along `across`; both are made
    /// perpendicular unit vectors.
    pub(crate) fn card(
        &mut self,
        image: &FoliageCard,
        base: Vec3,
        along: Vec3,
        across: Vec3,
        scale: f32,
    ) {
        let along = along.normalize_or(Vec3::Z);
        let side =
            (across - along * across.dot(along)).normalize_or(along.any_orthonormal_vector());
        let edge_u = side * image.width_m * scale;
        self.cards.push(Card {
            corner: base - 0.5 * edge_u,
            edge_u,
            edge_v: along * image.height_m * scale,
            material: image.material,
        });
    }

    /// Sweeps a circle of `sides` corners along a line with rotation-minimising frames; both ends
    /// are closed with a point. `radii` has one radius for each point; uv repeat every metre around
    /// and every two metres along, at least once around.
    pub(crate) fn tube(
        &mut self,
        points: &[Vec3],
        radii: &[f32],
        sides: u32,
        material: MaterialId,
    ) {
        let (Some(&first), Some(&last)) = (points.first(), points.last()) else {
            return;
        };
        if points.len() < 2 {
            return;
        }
        let start = self.mesh.positions.len() as u32;
        let tangent = |i: usize| {
            let a = points[i.saturating_sub(1)];
            let b = points[(i + 1).min(points.len() - 1)];
            (b - a).normalize_or(Vec3::Z)
        };
        let mut normal = tangent(0).any_orthonormal_vector();
        let mut length = 0.0;
        let columns = sides + 1;
        for (i, &p) in points.iter().enumerate() {
            if i > 0 {
                length += p.distance(points[i - 1]);
            }
            let t = tangent(i);
            normal = (normal - t * normal.dot(t)).normalize_or(t.any_orthonormal_vector());
            let binormal = t.cross(normal);
            for k in 0..columns {
                let u = k as f32 / sides as f32;
                let circle = around(u * TAU);
                let out = normal * circle.x + binormal * circle.y;
                self.push(p + out * radii[i], out, Vec2::new(u, 0.5 * length));
            }
        }
        for i in 0..points.len() as u32 - 1 {
            for k in 0..sides {
                let a = start + i * columns + k;
                let (b, c, d) = (a + 1, a + columns, a + columns + 1);
                self.triangle([a, b, d], material);
                self.triangle([a, d, c], material);
            }
        }
        let (low, high) = (tangent(0), tangent(points.len() - 1));
        let foot = self.push(first - low * radii[0] * 0.5, -low, Vec2::new(0.5, 0.0));
        let tip = self.push(
            last + high * radii[points.len() - 1] * 0.5,
            high,
            Vec2::new(0.5, 0.5 * length),
        );
        let end = start + (points.len() as u32 - 1) * columns;
        for k in 0..sides {
            self.triangle([foot, start + k + 1, start + k], material);
            self.triangle([tip, end + k, end + k + 1], material);
        }
    }

    /// Adds another shape without cards, turned about the vertical by the angle of a unit vector
    /// from +x, at a place.
    pub(crate) fn add(&mut self, other: &Self, turn: Vec2, at: Vec3) {
        let turned = |v: Vec3| turn.rotate(v.truncate()).extend(v.z);
        let (to, from) = (&mut self.mesh, &other.mesh);
        let first = to.positions.len() as u32;
        let moved = from.positions.iter().map(|&p| turned(p) + at);
        to.positions.extend(moved);
        to.normals.extend(from.normals.iter().map(|&n| turned(n)));
        to.uvs.extend(&from.uvs);
        for triangle in &from.triangles {
            self.triangle(triangle.corners.map(|c| c + first), triangle.material);
        }
    }

    /// Adds a smooth surface through rows of as many points each. It faces to where the direction
    /// from row to row is turned into that along a row. `uv` is of a row and a column.
    pub(crate) fn surface(
        &mut self,
        rows: &[Vec<Vec3>],
        uv: impl Fn(usize, usize) -> Vec2,
        material: MaterialId,
    ) {
        let first = self.mesh.positions.len() as u32;
        let columns = rows.first().map_or(0, Vec::len);
        for (i, row) in rows.iter().enumerate() {
            let (before, after) = (
                &rows[i.saturating_sub(1)],
                &rows[(i + 1).min(rows.len() - 1)],
            );
            for (k, &p) in row.iter().enumerate() {
                let along = after[k] - before[k];
                let across = row[(k + 1).min(columns - 1)] - row[k.saturating_sub(1)];
                self.push(p, along.cross(across), uv(i, k));
            }
        }
        let columns = columns as u32;
        for i in 1..rows.len() as u32 {
            for k in 1..columns {
                let d = first + i * columns + k;
                let (c, b, a) = (d - 1, d - columns, d - columns - 1);
                self.triangle([a, d, b], material);
                self.triangle([a, c, d], material);
            }
        }
    }

    /// Gives all below a height the material `wet`; triangles across it are cut there.
    pub(crate) fn soak(&mut self, line_m: f32, wet: MaterialId) {
        let whole = std::mem::take(&mut self.mesh.triangles);
        for Triangle { corners, material } in whole {
            let below = corners.map(|c| self.mesh.positions[c as usize].z < line_m);
            let count = below.iter().filter(|b| **b).count();
            if count == 0 || count == 3 {
                self.triangle(corners, if count == 3 { wet } else { material });
                continue;
            }
            // One corner is alone on its side; the order of corners stays.
            let alone = (0..3).find(|&i| below.iter().filter(|b| **b == below[i]).count() == 1);
            let alone = alone.expect("two corners are on the other side");
            let [a, b, c] = [0, 1, 2].map(|i| corners[(alone + i) % 3]);
            let (ab, ac) = (self.cut(a, b, line_m), self.cut(a, c, line_m));
            let [own, other] = if below[alone] {
                [wet, material]
            } else {
                [material, wet]
            };
            self.triangle([a, ab, ac], own);
            self.triangle([ab, b, c], other);
            self.triangle([ab, c, ac], other);
        }
    }

    /// Adds the vertex of an edge at a height between its ends.
    fn cut(&mut self, a: u32, b: u32, height_m: f32) -> u32 {
        let mesh = &self.mesh;
        let [a, b] = [a, b].map(|i| i as usize);
        let [low, high] = [a, b].map(|i| mesh.positions[i].z);
        let t = (height_m - low) / (high - low);
        self.push(
            mesh.positions[a].lerp(mesh.positions[b], t),
            mesh.normals[a].lerp(mesh.normals[b], t),
            mesh.uvs[a].lerp(mesh.uvs[b], t),
        )
    }

    /// Adds a vertex and returns its number.
    pub(crate) fn push(&mut self, position: Vec3, normal: Vec3, uv: Vec2) -> u32 {
        self.mesh.positions.push(position);
        self.mesh.normals.push(normal.normalize_or(Vec3::Z));
        self.mesh.uvs.push(uv);
        self.mesh.positions.len() as u32 - 1
    }

    /// Adds a triangle, counter-clockwise from outside.
    pub(crate) fn triangle(&mut self, corners: [u32; 3], material: MaterialId) {
        self.mesh.triangles.push(Triangle { corners, material });
    }

    /// The box around everything.
    #[cfg(test)]
    pub(crate) fn bounds(&self) -> nemoral_scene::Bounds {
        let cards = self.cards.iter().flat_map(Card::corners);
        nemoral_scene::Bounds::of_points(self.mesh.positions.iter().copied().chain(cards))
    }

    /// The largest horizontal distance from the origin, metres.
    pub(crate) fn reach_m(&self) -> f32 {
        self.mesh
            .positions
            .iter()
            .copied()
            .chain(self.cards.iter().flat_map(Card::corners))
            .fold(0.0, |r, p| r.max(p.truncate().length()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tube_is_closed_and_faces_outwards() {
        let mut shape = Shape::default();
        let points: Vec<Vec3> = (0..9)
            .map(|i| Vec3::new(0.01 * (i * i) as f32, 0.0, 0.1 * i as f32))
            .collect();
        shape.tube(&points, &[0.05; 9], 12, MaterialId(0));
        let m = &shape.mesh;
        // By the divergence theorem, a closed surface whose triangles face outwards has a positive
        // volume.
        let volume: f32 = m
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.corners.map(|i| m.positions[i as usize]);
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        let length: f32 = points.windows(2).map(|w| w[0].distance(w[1])).sum();
        let want = 0.5 * 12.0 * (TAU / 12.0).sin() * 0.05 * 0.05 * length;
        assert!((volume / want - 1.0).abs() < 0.06, "{volume} {want}");
        for t in &m.triangles {
            let [a, b, c] = t.corners.map(|i| m.positions[i as usize]);
            let n = (b - a).cross(c - a);
            assert!(n.dot(m.normals[t.corners[0] as usize]) > -1e-9);
        }
    }

    #[test]
    fn a_card_is_attached_at_the_middle_of_its_foot() {
        let image = FoliageCard {
            material: MaterialId(3),
            width_m: 0.2,
            height_m: 0.4,
            opaque_fraction: 0.4,
        };
        let mut shape = Shape::default();
        shape.card(&image, Vec3::ONE, Vec3::Y, Vec3::new(1.0, 1.0, 0.0), 2.0);
        let c = shape.cards[0];
        assert!((c.corner + 0.5 * c.edge_u).distance(Vec3::ONE) < 1e-6);
        assert!(
            (c.edge_u - 0.4 * Vec3::X).length() < 1e-6
                && (c.edge_v - 0.8 * Vec3::Y).length() < 1e-6
        );
    }
}
