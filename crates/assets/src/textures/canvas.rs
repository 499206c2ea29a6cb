//! A canvas for leaves and strokes: the ground's litter and the cards' foliage are drawn with it.

use std::sync::Arc;

use glam::{IVec2, Vec2, Vec3};

use super::noise::at::{scramble, unit};
use super::tile::{Texel, Tile};
use crate::tree::LeafLook;

/// Painted texels over a rectangle of the plane, in metres. Row 0 is at the smallest y.
#[derive(Clone, Debug)]
pub(crate) struct Canvas {
    width: usize,
    height: usize,
    origin: Vec2,
    texel_m: Vec2,
    repeats: bool,
    texels: Vec<Texel>,
    painted: Vec<bool>,
}

/// Half the width of a leaf along its midrib, as a share of its largest half-width.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Outline([f32; Self::STEPS + 1]);

/// A leaf, needle pair or petal, seen flat.
#[derive(Clone, Debug)]
pub(crate) struct Leaf {
    pub(crate) outline: Arc<Outline>,
    /// Where its stalk ends, metres.
    pub(crate) base: Vec2,
    /// The direction in which it points there; a unit vector.
    pub(crate) direction: Vec2,
    pub(crate) length_m: f32,
    pub(crate) width_m: f32,
    /// How far the tip is off the straight line, as a share of the length (a sickle's bend);
    /// positive to the left.
    pub(crate) bend: f32,
    pub(crate) colour: Vec3,
    /// How much lighter veins are: 0 none, 0.3 strong.
    pub(crate) veins: f32,
    /// 0..1 share of browning from the edge and tip.
    pub(crate) browning: f32,
    /// Height of the leaf above the canvas, for hollows.
    pub(crate) level: f32,
}

/// A tapered, bent stroke: a needle, a blade, a twig.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stroke {
    /// Control points of a quadratic Bézier curve, metres.
    pub(crate) points: [Vec2; 3],
    /// Full width at both ends, metres.
    pub(crate) width_m: [f32; 2],
    /// Colours at both ends.
    pub(crate) colour: [Vec3; 2],
    pub(crate) level: f32,
}

impl Outline {
    const STEPS: usize = 64;

    /// From a function of t = 0 (base) to 1 (tip), scaled so that its largest value is 1.
    pub(crate) fn new(f: impl Fn(f64) -> f64) -> Self {
        let raw: [f64; Self::STEPS + 1] =
            std::array::from_fn(|i| f(i as f64 / Self::STEPS as f64).max(0.0));
        let largest = raw.iter().fold(1e-9_f64, |a, &b| a.max(b));
        Self(raw.map(|w| (w / largest) as f32))
    }

    /// That of a species' leaves.
    pub(crate) fn of(look: &LeafLook) -> Self {
        let [a, b] = look.outline;
        let whole = if look.lobes > 0.0 {
            Self::lobed(look.lobes, look.lobe_depth)
        } else {
            Self::ovate(a, b)
        };
        if look.teeth > 0.0 {
            whole.toothed(look.teeth, look.tooth_depth)
        } else {
            whole
        }
    }

    /// t^a (1 - t)^b: ovate, lanceolate, rhombic.
    pub(crate) fn ovate(a: f64, b: f64) -> Self {
        Self::new(|t| libm::pow(t, a) * libm::pow(1.0 - t, b))
    }

    /// An oak's: an obovate leaf with `lobes` rounded lobes a side, cut in by `depth` (0..1).
    pub(crate) fn lobed(lobes: f64, depth: f64) -> Self {
        Self::new(|t| {
            let body = libm::pow(t, 0.75) * libm::pow(1.0 - t, 0.65) * (0.40 + 0.95 * t);
            let wave = libm::cos(std::f64::consts::TAU * (lobes * t * (0.85 + 0.15 * t) + 0.5));
            // The cosine's troughs are made narrow: sinuses are tighter than lobes.
            let sinus = libm::pow(0.5 - 0.5 * wave, 1.6);
            body * (1.0 - depth * sinus)
        })
    }

    /// A serrate or spiny version of this outline.
    pub(crate) fn toothed(&self, teeth: f64, amplitude: f64) -> Self {
        Self::new(|t| {
            let saw = t * teeth - libm::floor(t * teeth);
            f64::from(self.at(t as f32)) * (1.0 - amplitude * saw)
        })
    }

    #[inline]
    fn at(&self, t: f32) -> f32 {
        let x = t.clamp(0.0, 1.0) * Self::STEPS as f32;
        let i = (x as usize).min(Self::STEPS - 1);
        let r = x - i as f32;
        self.0[i] + (self.0[i + 1] - self.0[i]) * r
    }
}

impl Leaf {
    /// A box around it: (low, high).
    pub(crate) fn bounds(&self) -> (Vec2, Vec2) {
        let side = self.direction.perp();
        let (mut low, mut high) = (Vec2::MAX, Vec2::MIN);
        for i in 0..=8 {
            let t = i as f32 / 8.0;
            let mid = self.base + self.length_m * (t * self.direction + self.bend * t * t * side);
            let half = Vec2::splat(0.5 * self.width_m * if i == 8 { 0.3 } else { 1.0 });
            low = low.min(mid - half);
            high = high.max(mid + half);
        }
        (low, high)
    }

    /// How far it and another leaf overlap, metres: the sum over three discs along each midrib.
    pub(crate) fn overlap_m(&self, other: &Self) -> f32 {
        let mut sum = 0.0;
        for (at, radius_m) in self.discs() {
            for (other_at, other_radius_m) in other.discs() {
                sum += (radius_m + other_radius_m - at.distance(other_at)).max(0.0);
            }
        }
        sum
    }

    /// Discs that cover most of it: (centre, radius).
    fn discs(&self) -> [(Vec2, f32); 3] {
        [0.2, 0.5, 0.8].map(|t| {
            let sideways = self.bend * t * t * self.direction.perp();
            let middle = self.base + self.length_m * (t * self.direction + sideways);
            (middle, 0.45 * self.width_m)
        })
    }

    /// The area of one side, m²: the integral of its width along the midrib. A bend shears the leaf
    /// and does not change its area.
    #[cfg(test)]
    pub(crate) fn area_m2(&self) -> f64 {
        let widths = (0..500).map(|i| f64::from(self.outline.at((i as f32 + 0.5) / 500.0)));
        f64::from(self.length_m * self.width_m) * widths.sum::<f64>() / 500.0
    }
}

impl Stroke {
    /// Multiplies its colours.
    pub(crate) fn tint(&mut self, by: Vec3) {
        self.colour = self.colour.map(|c| c * by);
    }

    /// A straight stroke of one colour.
    pub(crate) fn straight(from: Vec2, to: Vec2, width_m: [f32; 2], colour: Vec3) -> Self {
        Self {
            points: [from, 0.5 * (from + to), to],
            width_m,
            colour: [colour; 2],
            level: 0.0,
        }
    }

    /// The control points of a bent stroke, whose middle lies half of `pull` beside the straight
    /// line.
    pub(crate) fn bowed(from: Vec2, reach: Vec2, pull: Vec2) -> [Vec2; 3] {
        [from, from + 0.5 * reach + pull, from + reach]
    }

    /// The point at t in 0..=1.
    pub(crate) fn at(&self, t: f32) -> Vec2 {
        let [a, b, c] = self.points;
        a.lerp(b, t).lerp(b.lerp(c, t), t)
    }

    /// A box around it: (low, high).
    pub(crate) fn bounds(&self) -> (Vec2, Vec2) {
        let half = Vec2::splat(0.5 * self.width_m[0].max(self.width_m[1]));
        let points = (0..=8).map(|i| self.at(i as f32 / 8.0));
        points.fold((Vec2::MAX, Vec2::MIN), |(low, high), p| {
            (low.min(p - half), high.max(p + half))
        })
    }
}

impl Canvas {
    /// An empty canvas whose texel (0, 0) has its corner at `origin`.
    pub(crate) fn new(width: usize, height: usize, origin: Vec2, size_m: Vec2) -> Self {
        Self {
            width,
            height,
            origin,
            texel_m: size_m / Vec2::new(width as f32, height as f32),
            repeats: false,
            texels: vec![Texel::default(); width * height],
            painted: vec![false; width * height],
        }
    }

    /// A canvas that repeats, on top of a painted tile.
    pub(crate) fn over(tile: Tile, size_m: Vec2) -> Self {
        let mut canvas = Self::new(tile.width, tile.height, Vec2::ZERO, size_m);
        canvas.repeats = true;
        canvas.painted = vec![true; tile.texels.len()];
        canvas.texels = tile.texels;
        canvas
    }

    /// The painting as a tile, with nothing where nothing is painted.
    pub(crate) fn into_tile(self) -> (Tile, Vec<bool>) {
        let tile = Tile {
            width: self.width,
            height: self.height,
            texels: self.texels,
        };
        (tile, self.painted)
    }

    /// Visits the texels of a box with their centres in metres; `paint` says whether it painted. On
    /// a canvas that repeats, those outside come back in on the other side.
    fn visit(
        &mut self,
        (low, high): (Vec2, Vec2),
        mut paint: impl FnMut(Vec2, &mut Texel, u32) -> bool,
    ) {
        let mut first = ((low - self.origin) / self.texel_m).floor().as_ivec2();
        let mut last = ((high - self.origin) / self.texel_m).ceil().as_ivec2();
        let (width, height) = (self.width as i32, self.height as i32);
        if !self.repeats {
            first = first.max(IVec2::ZERO);
            last = last.min(IVec2::new(width, height));
        }
        for y in first.y..last.y {
            let line = (y.rem_euclid(height) * width) as usize;
            let mut column = first.x.rem_euclid(width) as usize;
            for x in first.x..last.x {
                let i = line + column;
                let centre =
                    self.origin + (Vec2::new(x as f32, y as f32) + Vec2::splat(0.5)) * self.texel_m;
                if paint(centre, &mut self.texels[i], i as u32) {
                    self.painted[i] = true;
                }
                column += 1;
                if column == self.width {
                    column = 0;
                }
            }
        }
    }

    /// Darkens what lies under and just around a leaf that is to be drawn on top.
    pub(crate) fn shade_under(&mut self, leaf: &Leaf) {
        let side = leaf.direction.perp();
        let margin = 2.5 * self.texel_m.max_element();
        let (low, high) = leaf.bounds();
        let pad = Vec2::splat(margin);
        self.visit((low - pad, high + pad), |p, texel, _| {
            let d = (p - leaf.base) / leaf.length_m;
            let t = d.dot(leaf.direction).clamp(0.0, 1.0);
            let off = (d.dot(side) - leaf.bend * t * t).abs() * leaf.length_m;
            if off < 0.5 * leaf.width_m * leaf.outline.at(t) + margin {
                texel.albedo *= 0.80;
            }
            false
        });
    }

    /// Draws a leaf over what is there.
    pub(crate) fn leaf(&mut self, leaf: &Leaf) {
        let side = leaf.direction.perp();
        let half_texel = 0.55 * self.texel_m.max_element() / leaf.length_m;
        let half_width = 0.5 * leaf.width_m / leaf.length_m;
        // A leaf is folded along its midrib: one half is turned a little to the light.
        let fold = if leaf.bend < 0.0 { -0.09 } else { 0.09 };
        let pairs = 6.0;
        let level = leaf.level;
        let pad = Vec2::splat(half_texel * leaf.length_m);
        let (low, high) = leaf.bounds();
        self.visit((low - pad, high + pad), |p, texel, i| {
            let d = (p - leaf.base) / leaf.length_m;
            let t = d.dot(leaf.direction);
            if !(0.0..=1.0).contains(&t) {
                return false;
            }
            let s = d.dot(side) - leaf.bend * t * t;
            let half = (half_width * leaf.outline.at(t)).max(half_texel);
            if s.abs() > half {
                return false;
            }
            let across = s / half;
            let mut shade = 0.93 + 0.12 * t + fold * across.signum();
            if leaf.veins > 0.0 {
                let rib = 1.0 - (s.abs() / (0.07 * half_width).max(0.6 * half_texel)).min(1.0);
                let phase = pairs * t - 2.2 * half_width * pairs * across.abs();
                let vein = 1.0 - ((phase - phase.floor() - 0.5).abs() / 0.16).min(1.0);
                shade *= 1.0 + leaf.veins * (rib + 0.35 * vein * (1.0 - across.abs()));
            }
            let speckle = unit(scramble(i ^ leaf.length_m.to_bits()));
            shade *= 0.95 + 0.1 * speckle;
            let edge = across * across * across.abs();
            let brown = (leaf.browning * (1.6 * edge + 1.2 * t * t * t - 0.35 + 0.5 * speckle))
                .clamp(0.0, 1.0);
            let colour = leaf.colour.lerp(BROWNED, brown);
            *texel = Texel {
                albedo: colour * shade,
                height: level + 0.12 * (1.0 - across.abs()) * leaf.width_m,
            };
            true
        });
    }

    /// Draws a stroke over what is there; it is never thinner than a texel.
    pub(crate) fn stroke(&mut self, stroke: &Stroke) {
        let [a, b, c] = stroke.points;
        // Short pieces follow the bend, and their boxes are mostly full.
        let texels = ((b - a).length() + (c - b).length()) / self.texel_m.max_element();
        let steps = (1 + (texels / 9.0) as usize).min(32);
        let thinnest = 0.55 * self.texel_m.max_element();
        for k in 0..steps {
            let (t0, t1) = (k as f32 / steps as f32, (k + 1) as f32 / steps as f32);
            let (p0, p1) = (stroke.at(t0), stroke.at(t1));
            let along = p1 - p0;
            let inverse = 1.0 / along.length_squared().max(1e-12);
            let half = |t: f32| {
                (0.5 * (stroke.width_m[0] + (stroke.width_m[1] - stroke.width_m[0]) * t))
                    .max(thinnest)
            };
            let pad = Vec2::splat(half(t0).max(half(t1)));
            self.visit((p0.min(p1) - pad, p0.max(p1) + pad), |p, texel, _| {
                let s = ((p - p0).dot(along) * inverse).clamp(0.0, 1.0);
                let t = t0 + (t1 - t0) * s;
                let off = (p - p0 - s * along).length() / half(t);
                if off > 1.0 {
                    return false;
                }
                let round = 1.0 - 0.25 * off * off;
                *texel = Texel {
                    albedo: stroke.colour[0].lerp(stroke.colour[1], t) * round,
                    height: stroke.level + 0.5 * half(t) * round,
                };
                true
            });
        }
    }
}

/// Dry edges of leaves.
const BROWNED: Vec3 = Vec3::new(0.16, 0.10, 0.05);

#[cfg(test)]
mod tests {
    use super::super::tile::Texels;
    use super::*;

    #[test]
    fn a_leaf_covers_its_area() {
        // An outline of 4 t (1 - t) covers 2/3 of its box.
        let outline = Arc::new(Outline::ovate(1.0, 1.0));
        let mut canvas = Canvas::new(256, 256, Vec2::ZERO, Vec2::ONE);
        canvas.leaf(&Leaf {
            outline,
            base: Vec2::new(0.1, 0.3),
            direction: Vec2::new(0.8, 0.6),
            length_m: 0.6,
            width_m: 0.3,
            bend: 0.1,
            colour: Vec3::splat(0.1),
            veins: 0.2,
            browning: 0.0,
            level: 0.0,
        });
        let painted = canvas.into_tile().1;
        let area = painted.iter().filter(|p| **p).count() as f32 / 65536.0;
        assert!((area - 0.12).abs() < 0.003, "{area}");
    }

    #[test]
    fn a_stroke_wraps_only_where_the_canvas_repeats() {
        let stroke = Stroke::straight(
            Vec2::new(-0.2, 0.5),
            Vec2::new(0.2, 0.5),
            [0.1; 2],
            Vec3::ONE,
        );
        let mut open = Canvas::new(100, 100, Vec2::ZERO, Vec2::ONE);
        open.stroke(&stroke);
        let ground = Tile::bake(100, 100, |_| Texels {
            albedo: Vec3::ZERO.into(),
            height: 0.0.into(),
        });
        let mut ring = Canvas::over(ground, Vec2::ONE);
        ring.stroke(&stroke);
        let lit = |c: Canvas| {
            c.into_tile()
                .0
                .texels
                .iter()
                .filter(|t| t.albedo.x > 0.0)
                .count()
        };
        let (open, ring) = (lit(open), lit(ring));
        assert!(
            (ring as f32 / open as f32 - 2.0).abs() < 0.05,
            "{ring} {open}"
        );
    }
}
