//! A small z-buffer renderer: an orthographic view of trees, with the sun's shadows.

use nemoral_assets::TreeAsset;
use nemoral_scene::glam::{Vec2, Vec3};
use nemoral_scene::{MaterialId, MaterialLibrary};

/// Each pixel is the mean of so many samples in either direction.
const FINER: usize = 2;

/// Towards the sun: upper left, behind the viewer.
const SUN: Vec3 = Vec3::new(-0.45, -0.55, 0.70);

/// A tree that stands somewhere, and its materials.
pub(crate) struct Standing<'a> {
    pub(crate) tree: &'a TreeAsset,
    pub(crate) library: &'a MaterialLibrary,
    pub(crate) at: Vec3,
}

/// Depths of what is seen along a direction, nearest first.
struct Depths {
    right: Vec3,
    up: Vec3,
    /// Away from the viewer.
    into: Vec3,
    /// Upper left corner, along `right` and `up`.
    corner: Vec2,
    pixel_m: f32,
    width: usize,
    height: usize,
    depth: Vec<f32>,
}

impl Depths {
    fn new(into: Vec3, corner: Vec2, size_m: Vec2, pixel_m: f32) -> Self {
        let into = into.normalize_or(Vec3::Y);
        let right = into.cross(Vec3::Z).try_normalize().unwrap_or(Vec3::X);
        let [width, height] = (size_m / pixel_m).to_array().map(|n| n as usize);
        Self {
            right,
            up: right.cross(into),
            into,
            corner,
            pixel_m,
            width,
            height,
            depth: vec![f32::INFINITY; width * height],
        }
    }

    /// The depths of all trees along `into`.
    fn of(standing: &[Standing<'_>], into: Vec3, pixel_m: f32) -> Self {
        let mut all = Self::new(into, Vec2::ZERO, Vec2::ONE, pixel_m);
        let (mut low, mut high) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
        for s in standing {
            let bounds = s.tree.prototype.bounds();
            for k in 0..8 {
                let pick = |bit: u8, a: f32, b: f32| if k & bit == 0 { a } else { b };
                let p = Vec3::new(
                    pick(1, bounds.min.x, bounds.max.x),
                    pick(2, bounds.min.y, bounds.max.y),
                    pick(4, bounds.min.z, bounds.max.z),
                ) + s.at;
                let at = Vec2::new(p.dot(all.right), p.dot(all.up));
                (low, high) = (low.min(at), high.max(at));
            }
        }
        all = Self::new(into, Vec2::new(low.x, high.y), high - low, pixel_m);
        for s in standing {
            faces(s, &mut |p, face| {
                all.triangle(p, |w, _| face.covers(w), |_, ()| ())
            });
        }
        all
    }

    /// Whether anything stands in front of the point.
    fn hides(&self, p: Vec3) -> bool {
        let at = Vec2::new(p.dot(self.right), p.dot(self.up)) - self.corner;
        let (x, y) = (at.x / self.pixel_m, -at.y / self.pixel_m);
        x >= 0.0
            && y >= 0.0
            && (x as usize) < self.width
            && (y as usize) < self.height
            && self.depth[y as usize * self.width + x as usize] < p.dot(self.into) - 0.12
    }

    /// Stores depth and paint of each pixel for which `cover`, given barycentric weights and
    /// position, returns something.
    fn triangle<T>(
        &mut self,
        p: [Vec3; 3],
        cover: impl Fn(Vec3, Vec3) -> Option<T>,
        mut paint: impl FnMut(usize, T),
    ) {
        let s = p.map(|p| {
            let (x, y) = (p.dot(self.right), p.dot(self.up));
            Vec2::new(x - self.corner.x, self.corner.y - y) / self.pixel_m
        });
        let area = (s[1] - s[0]).perp_dot(s[2] - s[0]);
        if area.abs() < 1e-9 {
            return;
        }
        let low = s[0].min(s[1]).min(s[2]).max(Vec2::ZERO);
        let high = s[0].max(s[1]).max(s[2]).max(Vec2::ZERO);
        let (right, bottom) = (
            (high.x as usize + 1).min(self.width),
            (high.y as usize + 1).min(self.height),
        );
        for y in low.y as usize..bottom {
            for x in low.x as usize..right {
                let q = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                let w = Vec3::new(
                    (s[1] - q).perp_dot(s[2] - q),
                    (s[2] - q).perp_dot(s[0] - q),
                    (s[0] - q).perp_dot(s[1] - q),
                ) / area;
                if w.min_element() < 0.0 {
                    continue;
                }
                let at = p[0] * w.x + p[1] * w.y + p[2] * w.z;
                let (depth, pixel) = (at.dot(self.into), y * self.width + x);
                if depth < self.depth[pixel]
                    && let Some(value) = cover(w, at)
                {
                    self.depth[pixel] = depth;
                    paint(pixel, value);
                }
            }
        }
    }
}

/// How a triangle looks.
struct Face<'a> {
    library: &'a MaterialLibrary,
    material: MaterialId,
    normals: [Vec3; 3],
    uvs: [Vec2; 3],
}

impl Face<'_> {
    fn uv(&self, w: Vec3) -> Vec2 {
        self.uvs[0] * w.x + self.uvs[1] * w.y + self.uvs[2] * w.z
    }

    fn covers(&self, w: Vec3) -> Option<()> {
        let uv = self.uv(w);
        let mask = self.library.get(self.material).mask.as_ref();
        mask.is_none_or(|m| m.is_opaque(uv.x, uv.y)).then_some(())
    }

    /// The light of sun and sky; a leaf lets a part of the sun's through.
    fn light(&self, w: Vec3, sunny: bool, open: bool) -> Vec3 {
        let material = self.library.get(self.material);
        let albedo = material.albedo.sample(self.uv(w), 0.0);
        let n = self.normals[0] * w.x + self.normals[1] * w.y + self.normals[2] * w.z;
        let n = n.normalize_or(Vec3::Z);
        // The normal of the visible side.
        let n = if n.y > 0.0 { -n } else { n };
        let sun = if sunny { n.dot(SUN) } else { 0.0 };
        let direct = 3.4 * (albedo * sun.max(0.0) + material.transmittance * (-sun).max(0.0));
        let sky = if open { 1.0 } else { 0.55 };
        direct + 0.9 * sky * albedo * (0.6 + 0.4 * n.z)
    }
}

/// All triangles of a tree, halves of its cards among them.
fn faces(s: &Standing<'_>, draw: &mut dyn FnMut([Vec3; 3], &Face<'_>)) {
    let mesh = s.tree.prototype.mesh();
    let library = s.library;
    for t in &mesh.triangles {
        let corner = t.corners.map(|c| c as usize);
        let face = Face {
            library,
            material: t.material,
            normals: corner.map(|c| mesh.normals[c]),
            uvs: corner.map(|c| mesh.uvs[c]),
        };
        draw(corner.map(|c| mesh.positions[c] + s.at), &face);
    }
    for card in s.tree.prototype.cards() {
        let corners = card.corners().map(|c| c + s.at);
        let uvs = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
        for half in [[0, 1, 2], [0, 2, 3]] {
            let face = Face {
                library,
                material: card.material,
                normals: [card.edge_u.cross(card.edge_v); 3],
                uvs: half.map(|k| uvs[k]),
            };
            draw(half.map(|k| corners[k]), &face);
        }
    }
}

/// A picture from the south.
pub(crate) struct Canvas {
    seen: Depths,
    colour: Vec<Vec3>,
}

impl Canvas {
    /// World x of the left edge and world z of the upper edge; metres of a pixel.
    pub(crate) fn new(size_m: [f32; 2], corner: Vec2, pixel_m: f32) -> Self {
        let pixel_m = pixel_m / FINER as f32;
        let size = size_m.map(|s| (s / pixel_m) as usize / FINER * FINER);
        let mut seen = Depths::new(Vec3::Y, corner, Vec2::ONE, pixel_m);
        [seen.width, seen.height] = size;
        seen.depth = vec![f32::INFINITY; size[0] * size[1]];
        Self {
            colour: vec![Vec3::new(0.9, 1.0, 1.1); size[0] * size[1]],
            seen,
        }
    }

    /// A board as high as a person, for scale.
    pub(crate) fn person(&mut self, x: f32) {
        let person = [(0.0, 0.0), (0.4, 0.0), (0.4, 1.8), (0.0, 1.8)];
        let p = person.map(|(dx, z)| Vec3::new(x + dx, -2.0, z));
        let Self { seen, colour } = self;
        for corners in [[0, 1, 2], [0, 2, 3]] {
            let red = |_, _| Some(Vec3::new(0.6, 0.05, 0.05));
            seen.triangle(corners.map(|c| p[c]), red, |i, c| colour[i] = c);
        }
    }

    pub(crate) fn trees(&mut self, standing: &[Standing<'_>]) {
        let fine = (2.0 * self.seen.pixel_m).clamp(0.008, 0.03);
        let sun = Depths::of(standing, -SUN, fine);
        let sky = Depths::of(standing, Vec3::new(0.05, 0.1, -1.0), 2.0 * fine);
        let Self { seen, colour } = self;
        for s in standing {
            faces(s, &mut |p, face| {
                let shade = |w, at| {
                    face.covers(w)
                        .map(|()| face.light(w, !sun.hides(at), !sky.hides(at)))
                };
                seen.triangle(p, shade, |i, c| colour[i] = c);
            });
        }
    }

    pub(crate) fn into_image(self) -> image::RgbImage {
        let seen = &self.seen;
        let ground = (seen.corner.y.max(0.0) / seen.pixel_m) as usize;
        let colour = |x: usize, y: usize| {
            let i = y * seen.width + x;
            if y >= ground && seen.depth[i] > -1.0 {
                Vec3::new(0.12, 0.10, 0.075)
            } else {
                self.colour[i]
            }
        };
        let (width, height) = (seen.width / FINER, seen.height / FINER);
        image::RgbImage::from_fn(width as u32, height as u32, |x, y| {
            let (x, y) = (x as usize * FINER, y as usize * FINER);
            let sum: Vec3 = (0..FINER * FINER)
                .map(|k| colour(x + k % FINER, y + k / FINER))
                .sum();
            let mean = 0.62 * sum / (FINER * FINER) as f32;
            let tone = |v: f32| (v.clamp(0.0, 1.0).powf(1.0 / 2.2) * 255.0) as u8;
            image::Rgb(mean.to_array().map(tone))
        })
    }
}
