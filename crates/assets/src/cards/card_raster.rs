//! Rasterises drawings of leaves, in metres, to the image of a card: a mask, and colours that go on
//! under the mask.

use glam::{Vec2, Vec3};
use nemoral_scene::{AlphaMask, Texture};

use crate::textures::canvas::{Canvas, Leaf, Stroke};
use crate::textures::tile::luminance;

/// A mark of a drawing.
#[derive(Clone, Debug)]
pub(crate) enum Mark {
    /// A leaf.
    Leaf(Leaf),
    /// A leaf on its stalk, which is drawn first.
    Stalked(Stroke, Leaf),
    /// A needle, a blade, a twig or a stalk.
    Stroke(Stroke),
    /// A flower as narrow as a stroke: a bell of heather.
    Bell(Stroke),
}

/// A drawing of a twig that enters at (0, 0) and grows towards +y, back to front.
#[derive(Clone, Debug, Default)]
pub(crate) struct CardDrawing {
    pub(crate) marks: Vec<Mark>,
}

/// The image of a card. Its twig enters at (u, v) = (0.5, 0); v grows towards the tip.
#[derive(Clone, Debug)]
pub(crate) struct CardImage {
    pub(crate) mask: AlphaMask,
    /// The mask of the whole drawing, if this is less of it.
    pub(crate) whole_mask: Option<AlphaMask>,
    pub(crate) texture: Texture,
    pub(crate) width_m: f32,
    pub(crate) height_m: f32,
}

/// Texels along the longer side of the image of a twig.
pub(crate) const TWIG_TEXELS: usize = 256;

impl CardDrawing {
    pub(crate) fn leaf(&mut self, leaf: Leaf) {
        self.marks.push(Mark::Leaf(leaf));
    }

    pub(crate) fn stroke(&mut self, stroke: Stroke) {
        self.marks.push(Mark::Stroke(stroke));
    }

    pub(crate) fn bell(&mut self, bell: Stroke) {
        self.marks.push(Mark::Bell(bell));
    }

    /// Multiplies all colours.
    pub(crate) fn tint(&mut self, by: Vec3) {
        for mark in &mut self.marks {
            match mark {
                Mark::Leaf(leaf) => leaf.colour *= by,
                Mark::Stroke(stroke) | Mark::Bell(stroke) => stroke.tint(by),
                Mark::Stalked(stalk, leaf) => {
                    stalk.tint(by);
                    leaf.colour *= by;
                }
            }
        }
    }

    /// Crops to the content, draws, fills the colours on under the mask, and scales colours so that
    /// the opaque texels' luminance is on average that of `mean` (hues are kept). The drawing is
    /// cut across into `count` images of equal height and width, foot first, so that what is drawn
    /// can be bent where they meet; the longer side of each has `texels`.
    pub(crate) fn slices(&self, count: usize, texels: usize, mean: Vec3) -> Vec<CardImage> {
        self.slices_within(self, count, texels, mean)
    }

    /// The same, in the frame and in the light of a larger drawing, whose opaque texels have that
    /// mean.
    pub(crate) fn slices_within(
        &self,
        whole: &Self,
        count: usize,
        texels: usize,
        mean: Vec3,
    ) -> Vec<CardImage> {
        let (half_width, top) = whole.extent();
        let size_m = Vec2::new(2.0 * half_width, top / count as f32);
        let side = |ratio: f32| {
            if ratio > 0.5 { texels } else { texels / 2 }
        };
        let size = [side(size_m.x / size_m.y), side(size_m.y / size_m.x)];
        let drawn = |drawing: &Self| -> Vec<(Vec<Vec3>, Vec<bool>)> {
            (0..count)
                .map(|k| {
                    let low = Vec2::new(-half_width, k as f32 * size_m.y);
                    let (tile, painted) = drawing.draw(size, low, size_m).into_tile();
                    let colours = tile.texels.iter().map(|t| t.albedo).collect();
                    (colours, painted)
                })
                .collect()
        };
        let of_whole = drawn(whole);
        let (mut sum, mut opaque) = (0.0_f64, 0_usize);
        for (colours, painted) in &of_whole {
            for (c, _) in colours.iter().zip(painted).filter(|(_, p)| **p) {
                sum += f64::from(luminance(*c));
                opaque += 1;
            }
        }
        let gain = (f64::from(luminance(mean)) * opaque as f64 / sum.max(1e-6)) as f32;
        let is_part = !std::ptr::eq(self, whole);
        let of_self = is_part.then(|| drawn(self));
        let mask = |painted: &[bool]| {
            AlphaMask::from_fn(size[0], size[1], |c, r| painted[r * size[0] + c])
                .expect("sides are at most 256")
        };
        (of_self.as_ref().unwrap_or(&of_whole).iter())
            .zip(&of_whole)
            .map(|((colours, painted), (_, whole))| {
                let filled = fill_under(size, colours, painted);
                let linear: Vec<Vec3> = filled
                    .iter()
                    // Reflected and transmitted light together must not exceed the light that
                    // arrives.
                    .map(|c| (*c * gain).min(Vec3::splat(0.7)))
                    .collect();
                let opaque = |c: usize, r: usize| painted[r * size[0] + c];
                CardImage {
                    mask: mask(painted),
                    whole_mask: (is_part && painted != whole).then(|| mask(whole)),
                    texture: Texture::from_linear_where(size[0], size[1], &linear, opaque)
                        .expect("sides are powers of two"),
                    width_m: size_m.x,
                    height_m: size_m.y,
                }
            })
            .collect()
    }

    /// Half the width and the height of what is drawn above y = 0, metres.
    fn extent(&self) -> (f32, f32) {
        let (mut half_width, mut top) = (0.01_f32, 0.02_f32);
        for mark in &self.marks {
            let (low, high) = match mark {
                Mark::Leaf(l) => l.bounds(),
                Mark::Stroke(s) | Mark::Bell(s) => s.bounds(),
                Mark::Stalked(s, l) => {
                    let ((low, high), (low_of_leaf, high_of_leaf)) = (s.bounds(), l.bounds());
                    (low.min(low_of_leaf), high.max(high_of_leaf))
                }
            };
            half_width = half_width.max(-low.x).max(high.x);
            top = top.max(high.y);
        }
        // Boxes of leaves are larger than needed; a draft finds where the paint ends.
        let low = Vec2::new(-half_width, 0.0);
        let draft = self.draw([TWIG_TEXELS; 2], low, Vec2::new(2.0 * half_width, top));
        let (_, painted) = draft.into_tile();
        let (mut reach, mut rows) = (1, 1);
        for (i, _) in painted.iter().enumerate().filter(|(_, p)| **p) {
            let (column, row) = (i % TWIG_TEXELS, i / TWIG_TEXELS);
            reach = reach
                .max(column.abs_diff(TWIG_TEXELS / 2))
                .max((column + 1).abs_diff(TWIG_TEXELS / 2));
            rows = rows.max(row + 1);
        }
        (
            half_width * reach as f32 / (TWIG_TEXELS / 2) as f32,
            top * rows as f32 / TWIG_TEXELS as f32,
        )
    }

    fn draw(&self, size: [usize; 2], low: Vec2, size_m: Vec2) -> Canvas {
        let mut canvas = Canvas::new(size[0], size[1], low, size_m);
        let leaf = |canvas: &mut Canvas, leaf: &Leaf| {
            canvas.shade_under(leaf);
            canvas.leaf(leaf);
        };
        for mark in &self.marks {
            match mark {
                Mark::Leaf(of) => leaf(&mut canvas, of),
                Mark::Stroke(stroke) | Mark::Bell(stroke) => canvas.stroke(stroke),
                Mark::Stalked(stalk, of) => {
                    canvas.stroke(stalk);
                    leaf(&mut canvas, of);
                }
            }
        }
        canvas
    }
}

/// Gives transparent texels the colour of the nearest opaque ones, coarse to fine (pull and push,
/// Gortler et al. 1996), so that filtering adds no halo. Mips are made of opaque texels alone.
fn fill_under([width, height]: [usize; 2], colours: &[Vec3], painted: &[bool]) -> Vec<Vec3> {
    // Width, height, and the sums of colours and of weights of the level below.
    type Level = (usize, usize, Vec<(Vec3, f32)>);
    let mut levels: Vec<Level> = vec![(
        width,
        height,
        colours
            .iter()
            .zip(painted)
            .map(|(c, &p)| if p { (*c, 1.0) } else { (Vec3::ZERO, 0.0) })
            .collect(),
    )];
    while let Some((w, h, fine)) = levels.last().filter(|(w, h, _)| w * h > 1) {
        let (nw, nh) = ((w / 2).max(1), (h / 2).max(1));
        let (sx, sy) = (w / nw, h / nh);
        let mut coarse = vec![(Vec3::ZERO, 0.0); nw * nh];
        for (i, (c, k)) in fine.iter().enumerate() {
            let cell = &mut coarse[(i / w / sy) * nw + i % w / sx];
            cell.0 += *c;
            cell.1 += *k;
        }
        // Weights saturate, so that the nearest paint decides rather than the largest amount.
        for (c, k) in &mut coarse {
            if *k > 1.0 {
                *c /= *k;
                *k = 1.0;
            }
        }
        levels.push((nw, nh, coarse));
    }
    let (mut w, mut h) = (1, 1);
    let mut filled = vec![Vec3::ZERO];
    for (fw, fh, fine) in levels.iter().rev() {
        let (sx, sy) = (fw / w, fh / h);
        filled = fine
            .iter()
            .enumerate()
            .map(|(i, (c, k))| {
                let under = filled[(i / fw / sy) * w + i % fw / sx];
                *c + under * (1.0 - k.min(1.0))
            })
            .collect();
        (w, h) = (*fw, *fh);
    }
    filled
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filling_keeps_paint_and_leaves_no_hole() {
        let painted: Vec<bool> = (0..64 * 32).map(|i| i % 64 == 10 && i / 64 > 20).collect();
        let colours: Vec<Vec3> = painted
            .iter()
            .map(|&p| {
                if p {
                    Vec3::new(0.1, 0.2, 0.05)
                } else {
                    Vec3::splat(9.0)
                }
            })
            .collect();
        let filled = fill_under([64, 32], &colours, &painted);
        for c in filled {
            assert!(
                (c - Vec3::new(0.1, 0.2, 0.05)).abs().max_element() < 1e-4,
                "{c}"
            );
        }
    }

    #[test]
    fn a_picture_is_cropped_and_attached() {
        let mut drawing = CardDrawing::default();
        let stalk = Stroke::straight(Vec2::ZERO, Vec2::new(0.0, 0.2), [0.01; 2], Vec3::splat(0.1));
        drawing.stroke(stalk);
        drawing.stroke(Stroke::straight(
            Vec2::new(0.0, 0.1),
            Vec2::new(0.07, 0.1),
            [0.02; 2],
            Vec3::splat(0.2),
        ));
        let p = drawing.slices(1, TWIG_TEXELS, Vec3::splat(0.12)).remove(0);
        assert!((p.width_m - 0.16).abs() < 0.003, "{}", p.width_m);
        assert!((p.height_m - 0.205).abs() < 0.003, "{}", p.height_m);
        assert!(p.mask.is_opaque(0.5, 0.0) && p.mask.is_opaque(0.95, 0.49));
        assert!(!p.mask.is_opaque(0.05, 0.49));
    }
}
