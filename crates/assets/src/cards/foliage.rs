//! Foliage of the trees.

use std::sync::Arc;

use glam::{Vec2, Vec3};
use nemoral_seed::{Draw, Rng};

use super::card_raster::{CardDrawing, Mark};
use crate::textures::canvas::{Leaf, Outline, Stroke};
use crate::tree::{LeafKind, LeafLook, linear};

/// Places tried for each leaf of a spray.
const PLACES: u32 = 8;

/// The unit vector `angle` radians to the left of +y.
pub(crate) fn heading(angle: f32) -> Vec2 {
    let a = f64::from(angle);
    Vec2::new(-libm::sin(a) as f32, libm::cos(a) as f32)
}

/// A leaf colour varied as leaves vary: hue by ±4°, value by ±15 %.
pub(crate) fn varied(colour: Vec3, rng: &mut impl Rng) -> Vec3 {
    let hue = rng.range_f32(-1.0, 1.0);
    // Towards yellow, red and green rise together; towards blue-green red falls.
    let tint = Vec3::new(1.0 + 0.14 * hue, 1.0 + 0.02 * hue, 1.0 - 0.12 * hue);
    colour * tint * rng.range_f32(0.85, 1.15)
}

/// An upright twig from the origin with a slight bend.
pub(crate) fn stalk(length_m: f32, width_m: f32, colour: Vec3, rng: &mut impl Rng) -> Stroke {
    let tip = Vec2::new(rng.range_f32(-0.06, 0.06) * length_m, length_m);
    Stroke {
        points: [Vec2::ZERO, Vec2::new(-0.5 * tip.x, 0.5 * length_m), tip],
        width_m: [width_m, 0.6 * width_m],
        colour: [colour, colour * 1.1],
        level: 0.0,
    }
}

/// The image of a leafy twig of a species, of leaves as long as they grow.
pub(crate) fn draw(look: &LeafLook, rng: &mut impl Rng) -> CardDrawing {
    let painter = Painter::new(look);
    match look.kind {
        LeafKind::NeedleTuft => painter.tuft(rng),
        LeafKind::NeedleSpray => painter.needle_spray(rng),
        LeafKind::LeafSpray => painter.leaf_spray(rng),
        LeafKind::LeafRosettes => painter.rosettes(rng),
        LeafKind::HangingLeaves => painter.hanging(rng),
    }
}

/// A leaf on its stalk.
pub(super) struct Stalked {
    stalk: Stroke,
    pub(super) leaf: Leaf,
    /// 0 behind the others, in shade; 1 before them.
    front: f32,
}

impl CardDrawing {
    pub(super) fn stalked(&mut self, Stalked { stalk, leaf, .. }: Stalked) {
        self.marks.push(Mark::Stalked(stalk, leaf));
    }
}

/// Draws a species' leaves.
pub(super) struct Painter<'a> {
    pub(super) look: &'a LeafLook,
    pub(super) green: Vec3,
    pub(super) wood: Vec3,
    outline: Arc<Outline>,
}

impl<'a> Painter<'a> {
    pub(super) fn new(look: &'a LeafLook) -> Self {
        Self {
            look,
            green: look.reflectance(),
            wood: linear(look.twig_albedo),
            outline: Arc::new(Outline::of(look)),
        }
    }

    pub(super) fn length_m(&self, rng: &mut impl Rng) -> f32 {
        rng.range_f32(self.look.length_m[0] as f32, self.look.length_m[1] as f32)
    }

    pub(super) fn ratio(&self, rng: &mut impl Rng) -> f32 {
        let [a, b] = self.look.width_ratio.map(|r| r as f32);
        rng.range_f32(a, b.max(a + 1e-6))
    }

    fn count(&self, rng: &mut impl Rng) -> u32 {
        rng.between(self.look.count[0], self.look.count[1])
    }

    fn twig_m(&self) -> f32 {
        self.look.twig_m as f32
    }

    /// Of some leaves drawn at random, the one that overlaps least with those already there: twigs
    /// turn their leaves to where light is left, a *leaf mosaic* (Horn 1971, The adaptive geometry
    /// of trees).
    fn freest(others: &[Stalked], mut grow: impl FnMut() -> Stalked) -> Stalked {
        let overlap_m =
            |new: &Stalked| -> f32 { others.iter().map(|o| o.leaf.overlap_m(&new.leaf)).sum() };
        let mut best = grow();
        let mut least = overlap_m(&best);
        for _ in 1..PLACES {
            let next = grow();
            let overlap = overlap_m(&next);
            if overlap < least {
                (best, least) = (next, overlap);
            }
        }
        best
    }

    pub(super) fn leaf(
        &self,
        base: Vec2,
        direction: Vec2,
        front: f32,
        rng: &mut impl Rng,
    ) -> Stalked {
        let length_m = self.length_m(rng);
        let foot = base + self.look.stalk as f32 * length_m * direction;
        let mut colour = varied(self.green, rng) * (0.70 + 0.34 * front);
        if rng.chance(0.05) {
            // A leaf that has begun to turn.
            colour = colour.lerp(Vec3::new(0.16, 0.14, 0.035), 0.5);
        }
        let stalk = Stroke::straight(base, foot, [0.0016, 0.0012], 0.6 * self.wood + 0.4 * colour);
        let leaf = Leaf {
            outline: self.outline.clone(),
            base: foot,
            direction,
            length_m,
            width_m: length_m * self.ratio(rng),
            bend: rng.range_f32(-0.14, 0.14),
            colour,
            veins: 0.22,
            browning: rng.range_f32(0.0, 0.22),
            level: 0.0,
        };
        Stalked { stalk, leaf, front }
    }

    /// Needles on all sides around the end of a shoot.
    fn tuft(&self, rng: &mut impl Rng) -> CardDrawing {
        let mut drawing = CardDrawing::default();
        let shoot = stalk(self.twig_m(), 0.008, self.wood, rng);
        let needles = self.count(rng);
        let longest = self.look.length_m[1] as f32;
        // Short needles stand off the whole shoot, long ones lean to its tip.
        let stand_off = (1.42_f32).min(0.75 + 0.1 / longest);
        for i in 0..needles {
            // The shoot is drawn once half of the needles are behind it.
            if i == needles / 2 {
                drawing.stroke(shoot);
            }
            let front = i as f32 / needles as f32;
            let t = rng.unit_f32();
            let base = shoot.at(0.10 + 0.90 * t);
            let spread = stand_off - (0.75 * stand_off - 0.1) * t;
            let angle = rng.range_f32(-1.0, 1.0) * spread;
            let length = self.length_m(rng) * (1.0 - 0.18 * angle.abs());
            let shade = 0.50 + 0.5 * front;
            let green = if rng.chance(0.03) {
                Vec3::new(0.20, 0.125, 0.06)
            } else {
                varied(self.green, rng)
            };
            let width = self.ratio(rng) * length;
            drawing.stroke(Stroke {
                points: [
                    base,
                    base + 0.5 * length * heading(angle * 1.1),
                    base + length * heading(angle * 0.86),
                ],
                width_m: [width, 0.6 * width],
                colour: [green * 0.72 * shade, green * shade],
                level: 0.0,
            });
        }
        drawing
    }

    /// A flat spray: a twig with side shoots, all of them feathered with needles.
    fn needle_spray(&self, rng: &mut impl Rng) -> CardDrawing {
        let mut drawing = CardDrawing::default();
        let twig = stalk(self.twig_m(), 0.006, self.wood, rng);
        let side_shoots = self.count(rng);
        let mut shoots = Vec::new();
        for i in 0..side_shoots {
            let t = (i as f32 + rng.range_f32(0.2, 0.8)) / side_shoots as f32;
            let side = if i % 2 == 0 { 1.0 } else { -1.0 };
            let base = twig.at(0.06 + 0.9 * t);
            let angle = side * rng.range_f32(0.75, 1.0) * (1.0 - 0.25 * t);
            // Side shoots are a fir's triangle: longest low on the twig. Hanging ones bend back.
            let length = self.twig_m() * (0.56 - 0.40 * t) * rng.range_f32(0.8, 1.15);
            let sag = 1.0 + 0.5 * self.look.hang as f32;
            let middle = base + 0.5 * length * heading(angle);
            let tip = middle + 0.5 * length * heading(angle * sag);
            shoots.push(Stroke {
                points: [base, middle, tip],
                width_m: [0.0030, 0.0018],
                colour: [self.wood; 2],
                level: 0.0,
            });
        }
        shoots.push(twig);
        for shoot in shoots {
            drawing.stroke(shoot);
            let [a, b, c] = shoot.points;
            let length = (b - a).length() + (c - b).length();
            let pitch = 0.0042;
            let needles = (length / pitch) as u32;
            for i in 0..2 * needles {
                let t = (i as f32 + rng.unit_f32()) / (2 * needles) as f32;
                let at = shoot.at(t);
                let along = (shoot.at((t + 0.05).min(1.0)) - shoot.at((t - 0.05).max(0.0)))
                    .normalize_or(Vec2::Y);
                let side = if i % 2 == 0 { 1.0 } else { -1.0 };
                let lean = rng.range_f32(0.45, 0.95) * (1.0 - 0.5 * t * t);
                let direction = (along + side * lean * along.perp()).normalize_or(along);
                let needle = self.length_m(rng);
                let width = self.ratio(rng) * needle;
                // This year's needles, at the tips, are lighter.
                let shade = rng.range_f32(0.62, 1.0) + if t > 0.8 { 0.22 } else { 0.0 };
                let green = varied(self.green, rng) * shade;
                drawing.stroke(Stroke::straight(
                    at,
                    at + needle * direction,
                    [width, 0.7 * width],
                    green,
                ));
            }
        }
        drawing
    }

    /// Leaves along a twig and two to four side twigs.
    fn leaf_spray(&self, rng: &mut impl Rng) -> CardDrawing {
        let mut drawing = CardDrawing::default();
        let twig = stalk(self.twig_m(), 0.0045, self.wood, rng);
        let mut twigs = vec![twig];
        let sides = rng.between(3, 4);
        for i in 0..sides {
            let t = 0.12 + 0.55 * (i as f32 + rng.range_f32(0.2, 0.8)) / sides as f32;
            let side = if i % 2 == 0 { 1.0 } else { -1.0 };
            let angle = side * rng.range_f32(0.55, 0.85);
            let length = self.twig_m() * (0.62 - 0.4 * t) * rng.range_f32(0.85, 1.15);
            let base = twig.at(t);
            twigs.push(Stroke {
                points: [
                    base,
                    base + 0.5 * length * heading(angle),
                    base + length * heading(0.85 * angle),
                ],
                width_m: [0.0030, 0.0020],
                colour: [self.wood; 2],
                level: 0.0,
            });
        }
        for twig in &twigs {
            drawing.stroke(*twig);
        }
        let lengths: Vec<f32> = twigs
            .iter()
            .map(|t| (t.points[2] - t.points[0]).length())
            .collect();
        let total: f32 = lengths.iter().sum();
        let count = self.count(rng);
        let mut leaves: Vec<Stalked> = Vec::new();
        for i in 0..count {
            let side = if i % 2 == 0 { 1.0 } else { -1.0 };
            leaves.push(Self::freest(&leaves, || {
                // Evenly over all twigs, one after the other along each.
                let mut at = total * (i as f32 + rng.range_f32(0.15, 0.85)) / count as f32;
                let mut k = 0;
                while k + 1 < twigs.len() && at > lengths[k] {
                    at -= lengths[k];
                    k += 1;
                }
                let t = (at / lengths[k]).clamp(0.0, 1.0);
                let t = if self.look.distichous { t } else { t.sqrt() };
                let along = (twigs[k].at((t + 0.05).min(1.0)) - twigs[k].at((t - 0.05).max(0.0)))
                    .normalize_or(Vec2::Y);
                let open = if self.look.distichous {
                    rng.range_f32(0.75, 1.05)
                } else {
                    rng.range_f32(0.25, 1.45)
                };
                let turn = heading(side * open * (1.0 - 0.7 * t * t));
                let direction = along * turn.y - along.perp() * turn.x;
                self.leaf(twigs[k].at(t), direction, rng.unit_f32(), rng)
            }));
        }
        leaves.sort_by(|a, b| a.front.total_cmp(&b.front));
        for leaf in leaves {
            drawing.stalked(leaf);
        }
        drawing
    }

    /// Leaves crowded at the ends of a twig and of its side twigs.
    fn rosettes(&self, rng: &mut impl Rng) -> CardDrawing {
        let mut drawing = CardDrawing::default();
        let twig = stalk(self.twig_m(), 0.006, self.wood, rng);
        drawing.stroke(twig);
        let mut ends = vec![(twig.at(0.97), 0.0_f32, 1.0_f32)];
        for i in 0..4_u32 {
            let t = 0.15 + 0.17 * i as f32 + rng.range_f32(-0.04, 0.04);
            let side = if i % 2 == 0 { 1.0 } else { -1.0 };
            let angle = side * rng.range_f32(0.65, 1.0);
            let length = self.twig_m() * (0.62 - 0.45 * t) * rng.range_f32(0.85, 1.15);
            let base = twig.at(t);
            let tip = base + length * heading(angle);
            drawing.stroke(Stroke::straight(base, tip, [0.0042, 0.0030], self.wood));
            ends.push((tip, angle, 0.85));
        }
        let count = self.count(rng);
        let each = (count as usize / ends.len()).max(1) as u32;
        let last = ends.len() as u32 * each;
        let mut leaves: Vec<Stalked> = Vec::new();
        for k in 0..last {
            // Rosette by rosette; outer leaves first, the last ones stand in front.
            let (end, angle, size) = ends[(k / each) as usize];
            let front = (k % each) as f32 / each as f32;
            let side = if k % 2 == 0 { 1.0 } else { -1.0 };
            leaves.push(Self::freest(&leaves, || {
                let open = (1.75 - 1.5 * front + rng.range_f32(-0.25, 0.25)).max(0.05);
                let direction = heading(angle + side * open);
                let back = heading(angle) * -rng.range_f32(0.0, 0.035) * (1.0 - front);
                let mut new = self.leaf(end + back, direction, front, rng);
                new.leaf.length_m *= size;
                new.leaf.width_m *= size;
                new
            }));
        }
        for leaf in leaves {
            drawing.stalked(leaf);
        }
        drawing
    }

    /// Sickle leaves that all turn to the tip of a hanging twig.
    fn hanging(&self, rng: &mut impl Rng) -> CardDrawing {
        let mut drawing = CardDrawing::default();
        let twig = stalk(self.twig_m(), 0.006, self.wood, rng);
        let count = self.count(rng);
        let mut leaves: Vec<Stalked> = Vec::new();
        for i in 0..count {
            let side = if i % 2 == 0 { 1.0 } else { -1.0 };
            leaves.push(Self::freest(&leaves, || {
                let t = (i as f32 + rng.range_f32(0.2, 0.8)) / count as f32;
                let angle = side * rng.range_f32(0.15, 1.1) * (1.05 - 0.45 * t);
                let base = twig.at(0.10 + 0.9 * t);
                let mut new = self.leaf(base, heading(angle), rng.unit_f32(), rng);
                new.leaf.bend = -side * rng.range_f32(0.10, 0.38);
                // Young leaves at the tip are reddish.
                if t > 0.88 {
                    let reddish = Vec3::new(0.15, 0.10, 0.045);
                    new.leaf.colour = new.leaf.colour.lerp(reddish, 0.35);
                }
                new
            }));
        }
        leaves.sort_by(|a, b| a.front.total_cmp(&b.front));
        for (i, leaf) in leaves.into_iter().enumerate() {
            if i as u32 == count / 2 {
                drawing.stroke(twig);
            }
            drawing.stalked(leaf);
        }
        drawing
    }
}

#[cfg(test)]
mod tests {
    use nemoral_scene::MaterialId;
    use nemoral_seed::{Domain, Key};

    use super::*;
    use crate::cards::card_raster::TWIG_TEXELS;
    use crate::tree::{FoliageCard, GrowthParams, SizeClass, Species, TreeMaterials, grow};

    /// The leaf area that is recorded for a broadleaved tree is what is drawn: the sum of the areas
    /// of all leaves in the images on its cards by their outlines, hidden ones included.
    #[test]
    fn all_leaves_of_a_tree_are_drawn() {
        let species = Species::all().into_iter();
        let broad = species.filter(|s| !s.leaves.kind.is_needle());
        let mut count = 0;
        for species in broad {
            let key = Key::world(5).domain(Domain::new(&species.name));
            // For each image: its card, and the leaf area over the area of the card.
            let images: Vec<(FoliageCard, f64)> = (0..5)
                .map(|i| {
                    let drawing = draw(&species.leaves, &mut key.item(i).rng());
                    let leaves = drawing.marks.iter().map(|mark| match mark {
                        Mark::Stalked(_, leaf) => leaf.area_m2(),
                        _ => 0.0,
                    });
                    let leaf_m2: f64 = leaves.sum();
                    let image = drawing
                        .slices(1, TWIG_TEXELS, Vec3::splat(0.1))
                        .swap_remove(0);
                    let card = FoliageCard {
                        material: MaterialId(10 + i as u16),
                        width_m: image.width_m,
                        height_m: image.height_m,
                        opaque_fraction: image.mask.opaque_fraction() as f32,
                    };
                    (card, leaf_m2 / f64::from(card.width_m * card.height_m))
                })
                .collect();
            let id = MaterialId(0);
            let materials = TreeMaterials {
                stem: id,
                change: id,
                upper: id,
                flare: id,
                limb: id,
                branch: id,
                dead: id,
                snag: id,
                foliage: images.iter().map(|p| p.0).collect(),
            };
            let size = species.draw_size(species.class_dbh_m(SizeClass::Middle), key);
            let tree = grow(&species, &size, &materials, &GrowthParams::default(), key);
            let tree = tree.expect("a middling tree");
            let drawn = tree.cards.iter().map(|card| {
                let leaves = images[usize::from(card.material.0 - 10)].1;
                leaves * f64::from(card.area_m2())
            });
            let share = drawn.sum::<f64>() / tree.size.leaf_area_m2;
            assert!((share - 1.0).abs() < 0.05, "{}: {share:.3}", species.name);
            count += 1;
        }
        assert_eq!(count, 5);
    }
}
