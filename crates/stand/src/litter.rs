//! Where litter lies, and how deep.

/// How much litter there is in a world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Litter {
    /// The share of the ground under closed crowns on which litter lies, 0..1.
    pub cover: f64,
    /// The share of that on trails, 0..1: what is trodden, driven over and swept aside is not here.
    pub on_trails: f64,
}

/// What decides about the litter of a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LitterSite {
    /// The sky view factor just above the ground: 0 is closed, 1 is open.
    pub sky_view: f64,
    /// How much higher the ground some steps around is on average, metres: positive in a hollow,
    /// negative on a crest.
    pub hollow_m: f64,
    /// The ground's slope, metres per metre.
    pub slope: f64,
    /// The distance from the foot of the nearest stem, metres.
    pub stem_m: f64,
    /// Signed distance from the nearest trail's edge, metres: negative on the trail.
    pub trail_edge_m: f64,
    /// Whether the trail's own surface is litter, or moss covers the ground there.
    pub surface: LitterSurface,
}

/// What a place's ground looks like without litter in relief.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LitterSurface {
    /// A forest floor of leaves or needles.
    Litter,
    /// Moss, through which little of it shows.
    Moss,
    /// A trail that is covered with leaves or needles.
    LitteredTrail,
    /// Any other trail.
    Trail,
}

/// The sky view factors between which litter becomes less, as crowns open.
const OPEN: [f64; 2] = [0.35, 0.9];
/// The share of litter that wind carries to open places.
const BLOWN: f64 = 0.12;
/// The slopes between which leaves begin to slide, and none lie.
const STEEP: [f64; 2] = [0.6, 1.2];
/// The share of litter that shows on moss.
const ON_MOSS: f64 = 0.4;
/// How much more lies on a trail that is covered with litter than on others.
const LITTERED: f64 = 3.0;

/// The depth on level ground under closed crowns.
const DEPTH: f64 = 0.42;
/// What a hollow of a metre would add to it; a crest takes as much.
const PER_HOLLOW_M: f64 = 4.5;
/// What is added to it at a stem's foot, and the distance over which that falls to a third, metres.
const AT_STEM: [f64; 2] = [0.42, 0.45];
/// What is added to it where a trail's verge catches what is swept aside, and how far that reaches,
/// metres.
const AT_VERGE: [f64; 2] = [0.25, 0.7];

impl Litter {
    /// The chance that there is litter at a place, 0..1.
    #[must_use]
    pub fn chance(&self, site: &LitterSite) -> f64 {
        let steep = 1.0 - ramp(STEEP, site.slope);
        let here = match site.surface {
            LitterSurface::Litter => 1.0,
            LitterSurface::Moss => ON_MOSS,
            LitterSurface::LitteredTrail => (LITTERED * self.on_trails).min(1.0),
            LitterSurface::Trail => self.on_trails,
        };
        self.cover * closed(site.sky_view) * steep * here
    }

    /// How deep it is there, 0..1: deep in hollows, against stems and along verges, thin on crests,
    /// on trails and in the open.
    #[must_use]
    pub fn depth(&self, site: &LitterSite) -> f64 {
        let [stem, reach_m] = AT_STEM;
        let at_stem = stem * libm::exp(-site.stem_m.max(0.0) / reach_m);
        let lies = match site.surface {
            LitterSurface::Litter => 1.0,
            LitterSurface::Moss => 0.6,
            LitterSurface::LitteredTrail => 0.5,
            LitterSurface::Trail => 0.25,
        };
        let [verge, verge_m] = AT_VERGE;
        let at_verge = if site.trail_edge_m > 0.0 {
            verge * (1.0 - site.trail_edge_m / verge_m).max(0.0)
        } else {
            0.0
        };
        // A trail's own section is no hollow.
        let hollow = if site.trail_edge_m > 0.0 {
            (PER_HOLLOW_M * site.hollow_m).clamp(-0.36, 0.42)
        } else {
            0.0
        };
        let crowns = 0.4 + 0.6 * closed(site.sky_view);
        ((DEPTH + hollow + at_stem + at_verge) * lies * crowns).clamp(0.0, 1.0)
    }
}

/// How much of the litter of closed crowns reaches the ground under such a sky.
fn closed(sky_view: f64) -> f64 {
    1.0 - (1.0 - BLOWN) * ramp(OPEN, sky_view)
}

/// 0 below the first value, 1 above the second, and even between.
fn ramp([low, high]: [f64; 2], value: f64) -> f64 {
    ((value - low) / (high - low)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LITTER: Litter = Litter {
        cover: 0.9,
        on_trails: 0.12,
    };
    const LEVEL: LitterSite = LitterSite {
        sky_view: 0.1,
        hollow_m: 0.0,
        slope: 0.1,
        stem_m: 5.0,
        trail_edge_m: f64::INFINITY,
        surface: LitterSurface::Litter,
    };

    #[test]
    fn it_is_deep_in_hollows_and_at_stems_and_thin_on_crests_and_trails() {
        let depth = |site| LITTER.depth(&site);
        let level = depth(LEVEL);
        let with = |change: fn(&mut LitterSite)| {
            let mut site = LEVEL;
            change(&mut site);
            depth(site)
        };
        assert!((level - 0.42).abs() < 0.01, "{level}");
        assert!(with(|s| s.hollow_m = 0.05) > level + 0.2);
        assert!(with(|s| s.hollow_m = -0.05) < level - 0.2);
        assert!(with(|s| s.stem_m = 0.1) > level + 0.3);
        assert!(with(|s| s.trail_edge_m = 0.1) > level + 0.15);
        assert!(with(|s| s.surface = LitterSurface::Moss) < 0.7 * level);
        let on_trail = |s: &mut LitterSite| {
            (s.trail_edge_m, s.surface) = (-0.5, LitterSurface::Trail);
        };
        assert!(with(on_trail) < 0.3 * level);
        let mut trail = LEVEL;
        on_trail(&mut trail);
        assert!(LITTER.chance(&trail) < 0.15 * LITTER.chance(&LEVEL));
        trail.surface = LitterSurface::LitteredTrail;
        assert!((LITTER.chance(&trail) / LITTER.chance(&LEVEL) - 0.36).abs() < 1e-9);
    }

    #[test]
    fn little_lies_in_the_open_and_none_on_a_bank() {
        let chance = |sky_view, slope| {
            LITTER.chance(&LitterSite {
                sky_view,
                slope,
                ..LEVEL
            })
        };
        assert!((chance(0.1, 0.0) - 0.9).abs() < 1e-12);
        assert!(chance(0.95, 0.0) < 0.12);
        assert_eq!(chance(0.1, 1.3), 0.0);
    }

    proptest! {
        #[test]
        fn chances_and_depths_are_shares(
            cover in 0.0..=1.0, on_trails in 0.0..=1.0, sky_view in -0.1..1.1,
            hollow_m in -3.0..3.0, slope in 0.0..5.0, stem_m in -0.5..40.0,
            trail_edge_m in -3.0..40.0, kind in 0_usize..4,
        ) {
            let litter = Litter { cover, on_trails };
            let surface = [
                LitterSurface::Litter,
                LitterSurface::Moss,
                LitterSurface::LitteredTrail,
                LitterSurface::Trail,
            ][kind];
            let site =
                LitterSite { sky_view, hollow_m, slope, stem_m, trail_edge_m, surface };
            prop_assert!((0.0..=cover + 1e-12).contains(&litter.chance(&site)));
            prop_assert!((0.0..=1.0).contains(&litter.depth(&site)));
            // More cover never means less litter.
            let more = Litter { cover: 1.0, ..litter };
            prop_assert!(more.chance(&site) >= litter.chance(&site));
        }
    }
}
