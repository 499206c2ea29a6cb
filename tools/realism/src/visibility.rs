//! How far one sees stems between other stems and what grows under them.

use std::f64::consts::TAU;

use nemoral_pipeline::plan::Runner;
use nemoral_pipeline::world::assets::WorldAssets;
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, ObjectId, Ray, Semantic, Surface, TreeRecord};
use nemoral_seed::{Draw, Key};

use crate::world::World;

/// Height of eyes, and of what they look at, above the ground, metres.
const BREAST_M: f64 = 1.3;
/// Stems are looked for within this distance, metres.
pub const SIGHT_M: f64 = 40.0;
/// Width of the classes of distance, metres.
const CLASS_M: f64 = 10.0;
/// Viewpoints at each frame, and their greatest distance from the robot, metres.
const VIEWPOINTS: usize = 60;
const AROUND_M: f64 = 20.0;
/// Nobody looks from nearer to a stem's middle than this, metres.
const CLEAR_M: f64 = 0.6;

/// Stems, by their distance from viewpoints and whether they are seen from there: the line between
/// the two, at breast height, meets the stem first.
///
/// Between stems that stand at random, what is free falls off exponentially with distance, by the
/// number of stems on a square metre times their mean diameter; in mature stands it was found to be
/// exponential too (Lang et al. 2021, "Horizontal visibility in forests", Remote Sensing 13:4455).
#[derive(Clone, Debug, Default)]
pub struct StemVisibility {
    stems: Vec<(f64, bool)>,
}

impl StemVisibility {
    /// The living grown trees of a survey, seen from places around the robot at some frames.
    ///
    /// # Panics
    /// If the world cannot be grown.
    #[must_use]
    pub fn of(
        world: &World,
        runner: &Runner<'_>,
        assets: &WorldAssets,
        trees: &[TreeRecord],
        frames: &[u64],
    ) -> Self {
        let mut all = Self::default();
        let height_m = |place: DVec2| {
            let chunk = ChunkCoord::containing(place, world.config.chunks.size_m);
            let ground = runner.get(world.forest.ground, chunk).expect("ground");
            ground.height_m(place) + BREAST_M
        };
        let materials = assets.library.materials.materials();
        for &frame in frames {
            let scene = runner.get(world.forest.scene, frame).expect("a scene");
            let pose = runner.get(world.forest.pose, frame).expect("a pose");
            let here = pose.world_from_body().translation_m.truncate();
            let mut rng = Key::world(17).item(frame).rng();
            let mut looks: Vec<(ObjectId, f64, Ray)> = Vec::new();
            for _ in 0..VIEWPOINTS {
                let way = DVec2::from_angle(rng.range_f64(0.0, TAU));
                let eye = here + way * AROUND_M * rng.unit_f64().sqrt();
                let foot = |tree: &TreeRecord| tree.position_m.truncate();
                if trees.iter().any(|t| foot(t).distance(eye) < CLEAR_M) {
                    continue;
                }
                let from = eye.extend(height_m(eye)) - scene.origin_m;
                let near = trees.iter().filter(|t| foot(t).distance(eye) < SIGHT_M);
                for tree in near {
                    let at = foot(tree);
                    let to = at.extend(tree.position_m.z + BREAST_M) - scene.origin_m;
                    let ray = Ray::new(from.as_vec3(), (to - from).normalize().as_vec3());
                    looks.push((tree.object, at.distance(eye), ray));
                }
            }
            let rays: Vec<Ray> = looks.iter().map(|look| look.2).collect();
            let mut hits = vec![None; rays.len()];
            scene.caster.closest_hits(&rays, &mut hits);
            for ((tree, distance_m, _), hit) in looks.into_iter().zip(hits) {
                let is_seen = hit.is_some_and(|hit| {
                    let material = materials.get(usize::from(hit.surface.material.0));
                    hit.surface.object == tree && material.is_some_and(|m| is_stem(m.semantic))
                });
                all.add(distance_m, is_seen);
            }
        }
        all
    }

    /// Adds a stem at this distance from a viewpoint.
    pub fn add(&mut self, distance_m: f64, is_seen: bool) {
        self.stems.push((distance_m, is_seen));
    }

    /// The share of stems that are seen, by classes of 10 m of distance.
    #[must_use]
    pub fn shares(&self) -> [f64; (SIGHT_M / CLASS_M) as usize] {
        std::array::from_fn(|i| {
            let (from, to) = (CLASS_M * i as f64, CLASS_M * (i + 1) as f64);
            let of_class = self.stems.iter().filter(|s| (from..to).contains(&s.0));
            let seen = of_class.clone().filter(|s| s.1).count();
            seen as f64 / of_class.count().max(1) as f64
        })
    }

    /// The greatest difference of the [shares](Self::shares) that are seen from the curve of the
    /// whole, exp(-k r), at the classes' mean distances.
    #[must_use]
    pub fn off_the_curve(&self) -> f64 {
        let k = self.falls_off_per_m();
        let off = self.shares().into_iter().enumerate().map(|(i, share)| {
            let (from, to) = (CLASS_M * i as f64, CLASS_M * (i + 1) as f64);
            let of_class = self.stems.iter().filter(|s| (from..to).contains(&s.0));
            let expected = of_class.clone().map(|s| (-k * s.0).exp()).sum::<f64>();
            (share - expected / of_class.count().max(1) as f64).abs()
        });
        off.fold(0.0, f64::max)
    }

    /// How fast sight falls off, per metre: the most likely k if stems at a distance r are seen
    /// with the probability exp(-k r).
    #[must_use]
    pub fn falls_off_per_m(&self) -> f64 {
        // The derivative of the likelihood's logarithm falls with k.
        let derivative = |k: f64| -> f64 {
            let of = |&(r, is_seen): &(f64, bool)| {
                if is_seen { -r } else { r / (k * r).exp_m1() }
            };
            self.stems.iter().map(of).sum()
        };
        let (mut low, mut high) = (1e-6, 10.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if derivative(middle) > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }
}

/// Ivy and moss on a stem show where it is.
fn is_stem(semantic: Semantic) -> bool {
    use Semantic as S;
    matches!(
        semantic,
        S::Stem | S::RootFlare | S::Limb | S::Snag | S::Climber | S::StemGrowth
    )
}

/// How fast sight falls off between trees that stand at random, per metre: their number on a square
/// metre times their mean diameter at breast height.
#[must_use]
pub fn law_per_m(trees: &[TreeRecord], area_m2: f64) -> f64 {
    trees.iter().map(|t| t.dbh_m).sum::<f64>() / area_m2
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The law holds for discs at random places, by plane geometry alone.
    #[test]
    fn sight_between_discs_at_random_falls_off_by_the_law() {
        let mut rng = Key::world(3).rng();
        let (side, radius, count) = (140.0, 0.25, 900);
        let mut place = || side * DVec2::new(rng.unit_f64(), rng.unit_f64());
        let discs: Vec<DVec2> = (0..count).map(|_| place()).collect();
        let mut visibility = StemVisibility::default();
        for i in 0..60 {
            let eye = DVec2::new(
                45.0 + f64::from(i % 10) * 5.0,
                45.0 + f64::from(i / 10) * 8.0,
            );
            if discs.iter().any(|d| d.distance(eye) < CLEAR_M) {
                continue;
            }
            for disc in discs.iter().filter(|d| d.distance(eye) < SIGHT_M) {
                let along = *disc - eye;
                let hides = |other: &DVec2| {
                    let off = *other - eye;
                    let t = off.dot(along) / along.length_squared();
                    other != disc && (0.0..1.0).contains(&t) && (off - along * t).length() < radius
                };
                visibility.add(along.length(), !discs.iter().any(hides));
            }
        }
        let law = f64::from(count) * 2.0 * radius / (side * side);
        let found = visibility.falls_off_per_m();
        assert!((found / law - 1.0).abs() < 0.1, "{found} {law}");
        assert!(visibility.off_the_curve() < 0.05);
        let shares = visibility.shares();
        for (i, share) in shares.iter().enumerate() {
            let expected = (-law * (10.0 * i as f64 + 6.0)).exp();
            assert!((share - expected).abs() < 0.06, "{share} {expected}");
        }
    }
}
