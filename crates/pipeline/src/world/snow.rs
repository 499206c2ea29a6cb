//! How deep snow lies on the ground.

use nemoral_assets::AssetParams;
use nemoral_scene::glam::DVec2;
use nemoral_scene::{Surface, SurfaceSample};

use super::assets::LyingSnow;
use super::chunk_ground::ChunkGround;

/// The depth of trodden snow over that beside the trail (our choice).
const TRODDEN: f64 = 0.35;
/// Less snow than this does not hide the ground, metres; and where all of it is thin, less than
/// this share of its depth in the open.
const HIDES_M: f64 = 0.015;
const HIDES: f64 = 0.3;
/// The slopes over which snow slides off, metres per metre: 50 and 60 degrees.
const SLIDES: [f64; 2] = [1.19, 1.73];
/// The step of differences for its slope, metres.
const STEP_M: f64 = 0.02;

/// Snow over the ground of a chunk.
pub(crate) struct SnowCover<'a, S> {
    ground: &'a ChunkGround,
    /// The ground below it.
    below: &'a S,
    /// Its depth on level ground in the open, metres.
    depth_m: f64,
    /// The share of that depth that lies under crowns.
    under_crowns: f64,
}

impl<'a, S: Surface> SnowCover<'a, S> {
    /// The snow of a world on the ground of a chunk, whose surface is `below`.
    pub(crate) fn new(snow: &LyingSnow, ground: &'a ChunkGround, below: &'a S) -> Self {
        Self {
            ground,
            below,
            depth_m: snow.depth_m,
            under_crowns: snow.under_crowns,
        }
    }

    /// The depth of snow at a place, metres. It is none at the edge of water, less on trails, under
    /// crowns and on slopes, and uneven as wind leaves it.
    pub(crate) fn depth_m(&self, p: DVec2) -> f64 {
        self.depth_on(p, self.below.sample(p).gradient)
    }

    /// Whether it hides what lies below.
    pub(crate) fn hides(&self, p: DVec2) -> bool {
        self.depth_m(p) > HIDES_M.min(HIDES * self.depth_m)
    }

    fn depth_on(&self, p: DVec2, gradient: DVec2) -> f64 {
        let ground = self.ground;
        let trodden = TRODDEN + (1.0 - TRODDEN) * smooth(-0.5, 0.9, ground.trail_edge_m(p));
        let open = smooth(-3.0, 4.0, ground.open_m(p));
        let shelter = self.under_crowns + (1.0 - self.under_crowns) * open;
        let shore = smooth(0.05, 0.6, ground.bank_m(p).min(ground.puddle_edge_m(p)));
        let [holds, slides] = SLIDES;
        let lies = 1.0 - smooth(holds, slides, gradient.length());
        self.depth_m * trodden * shelter * shore * lies * drift(p)
    }
}

impl<S: Surface> Surface for SnowCover<'_, S> {
    fn sample(&self, p: DVec2) -> SurfaceSample {
        let below = self.below.sample(p);
        let depth = |p: DVec2| self.depth_on(p, below.gradient);
        let here = depth(p);
        let slope = |step: DVec2| (depth(p + step) - here) / STEP_M;
        SurfaceSample {
            height_m: below.height_m + here,
            gradient: below.gradient
                + DVec2::new(slope(DVec2::X * STEP_M), slope(DVec2::Y * STEP_M)),
        }
    }
}

/// The share of the snow of the open that reaches the ground under the crowns of a stand:
/// 1 − 0.65 C for crowns that cover the share C of the ground (Varhola et al. 2010, "Forest canopy
/// effects on snow accumulation and ablation"). They cover it at random, so that C = 1 − e^(−s),
/// where s is the area of all crowns over the ground's. A bare crown counts as a third, as its wood
/// holds about a third of the snow that a leafy one holds (our choice).
pub(crate) fn share_under_crowns(stand: &AssetParams) -> f64 {
    const HELD: f64 = 0.65;
    const WOOD: f64 = 1.0 / 3.0;
    let crowns = stand.species.iter().map(|of| {
        let width_m = of.species.mean_crown_width_m(of.dbh_mean_m);
        let (_, leafy) = of.species.shoot_in(stand.season.as_ref());
        let holds = WOOD + (1.0 - WOOD) * leafy;
        holds * std::f64::consts::FRAC_PI_4 * width_m * width_m * of.trees_per_ha / 10_000.0
    });
    let sum: f64 = crowns.sum();
    1.0 - HELD * (1.0 - libm::exp(-sum))
}

/// Drifts of metres, about 1.
fn drift(p: DVec2) -> f64 {
    let wave = |x: f64, y: f64| libm::sin(x + 1.3 * libm::sin(y));
    1.0 + 0.14 * wave(0.61 * p.x + 0.3 * p.y, 0.47 * p.y) + 0.06 * wave(1.9 * p.y, 1.7 * p.x + 0.4)
}

/// A smooth step from 0 at `from` to 1 at `to`.
fn smooth(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::InputFiles;
    use crate::config::Preset;
    use crate::world::library_recipe::LibraryRecipe;

    /// The share of the snow of the open that lies in the wood of a preset, in summer or on a day.
    fn under_crowns(preset: &str, day_of_year: u32) -> f64 {
        let found = Preset::ALL.iter().find(|of| of.name == preset);
        let mut config = found.expect("a preset").config();
        config.season.day_of_year = day_of_year;
        let recipe = LibraryRecipe::new(&config, &InputFiles::default());
        let species = recipe.species().expect("known species");
        share_under_crowns(&recipe.params(&species))
    }

    #[test]
    fn snow_lies_half_as_deep_under_spruces_and_hardly_less_deep_under_bare_crowns() {
        let winter = 20;
        let spruce = under_crowns("spruce", winter);
        assert!((0.44..0.56).contains(&spruce), "{spruce}");
        let bare = under_crowns("beech", winter);
        assert!((0.74..0.85).contains(&bare), "{bare}");
        // A few wide crowns leave most of the ground open, in leaf, too.
        let montado = under_crowns("montado", winter);
        assert!((0.72..0.86).contains(&montado), "{montado}");
        let mixed = under_crowns("boreal-birch-pine", winter);
        assert!(spruce < mixed && mixed < bare, "{mixed}");
        assert!(under_crowns("beech", 0) < bare - 0.1);
    }
}
