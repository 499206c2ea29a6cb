//! Kinds of way.

use nemoral_scene::{ParamError, TrailSurfaceKind};

use glam::DVec2;

use crate::{CrossSection, Ditch, Ruts};

/// A kind of way: its width and section, its materials, what grows and lies on it, and how much it
/// changes along its run.
#[derive(Clone, Debug, PartialEq)]
pub struct WayKind {
    /// Width of the usable surface, metres, 0.3..=12.
    pub width_m: f64,
    /// How much the width varies along the way, relative to it, 0..=0.6.
    pub width_variation: f64,
    /// The shape across the run.
    pub section: CrossSection,
    /// The weights of the materials, in the order of [`TrailSurfaceKind::ALL`].
    pub surfaces: [f64; TrailSurfaceKind::ALL.len()],
    /// How readily the surface changes along the way, 0..=1. With 0, each way has a main material
    /// and stretches of others, each 60 to 180 m long, which end in straight lines. Otherwise the
    /// materials with a weight come and go by smooth noise of the arc length, with ragged ends;
    /// grass is thick here and missing there, and stones lie in patches.
    pub change: f64,
    /// The most grass tufts along the middle of ways in one chunk; 0 for none.
    pub grass_max_per_chunk: u32,
    /// How far from a way's middle its grass grows, metres, 0..=10.
    pub grass_spread_m: f64,
    /// Tufts of grass that a metre of each edge has room for, 0..=20; 0 for bare verges. About half
    /// of them grow, in patches.
    pub verge_tufts_per_m: f64,
    /// The share of the strip between the ruts that low plants cover where there is light for
    /// them, 0..=1: all of it on earth, less on sand, needles and rock, and in patches. Ways
    /// without ruts have none.
    pub strip_cover: f64,
    /// The most stones on one way, over its whole length; 0 for none.
    pub rocks_max_per_trail: u32,
    /// Roots that lie across a metre of a way, 0..=5. On a way that changes, there are half as
    /// many, in patches.
    pub roots_per_m: f64,
    /// The grade from which steps of logs are built on a way, 0..=1; 0 for none. About two thirds
    /// of the runs that are as steep have them.
    pub steps_from_grade: f64,
    /// The share of the ditches, or of the edges of a way that has none, along which stones lie
    /// side by side, 0..=1.
    pub stone_beds: f64,
    /// The distance of the culverts that lead the water of a ditch under the way to its other side,
    /// metres, 0..=500, at least 5 m; 0 for none. They are where the way lies on a slope, and so
    /// has a ditch on its uphill side alone.
    pub culvert_spacing_m: f64,
    /// The radius of the loops on which vehicles turn at its ends, metres, 0..=15; 0 for none. They
    /// are smaller where chunks have no room for them; where they would be narrower than the way
    /// is wide, and on trails of one chunk or along given lines, there are none.
    pub turning_radius_m: f64,
}

impl Default for WayKind {
    /// A machine track, 3 m wide: two ruts, and a strip of grass between.
    fn default() -> Self {
        Self {
            width_m: 3.0,
            width_variation: 0.0,
            section: CrossSection::default(),
            surfaces: Self::ALL_SURFACES,
            change: 0.0,
            grass_max_per_chunk: 120,
            grass_spread_m: 0.5,
            verge_tufts_per_m: 6.0,
            strip_cover: 0.6,
            rocks_max_per_trail: 300,
            roots_per_m: 0.0,
            steps_from_grade: 0.0,
            stone_beds: 0.0,
            culvert_spacing_m: 0.0,
            turning_radius_m: 0.0,
        }
    }
}

impl WayKind {
    /// Weights of all materials: common ones are more frequent.
    pub const ALL_SURFACES: [f64; TrailSurfaceKind::ALL.len()] =
        [0.2, 0.2, 0.13, 0.14, 0.13, 0.1, 0.05, 0.05];

    /// A trodden path, 0.5 to 1.1 m wide, which follows the ground, lies a few centimetres deep,
    /// is worn to a hollow way where it is steep, and has steps of logs there.
    #[must_use]
    pub fn footpath() -> Self {
        Self {
            width_m: 0.8,
            width_variation: 0.4,
            section: CrossSection {
                cut_ratio: 0.6,
                fill_ratio: 1.2,
                max_grade: 0.5,
                smoothing_m: 3.0,
                crossfall: 0.02,
                crown: -0.08,
                levelling: 0.8,
                reach_m: 4.0,
                sink_m: 0.06,
                hollow_m: 0.4,
                ruts: None,
                ..CrossSection::default()
            },
            surfaces: surfaces(&[
                (TrailSurfaceKind::DryEarth, 0.4),
                (TrailSurfaceKind::LeafLitter, 0.2),
                (TrailSurfaceKind::Needles, 0.2),
                (TrailSurfaceKind::Mud, 0.1),
                (TrailSurfaceKind::Rock, 0.1),
            ]),
            change: 0.5,
            grass_max_per_chunk: 20,
            grass_spread_m: 0.4,
            verge_tufts_per_m: 7.0,
            strip_cover: 0.0,
            rocks_max_per_trail: 400,
            roots_per_m: 1.0,
            steps_from_grade: 0.2,
            stone_beds: 0.0,
            culvert_spacing_m: 0.0,
            turning_radius_m: 0.0,
        }
    }

    /// A road with a carriageway of gravel, 3.6 m wide, cambered by 4 %, cut and filled, with a
    /// ditch on its uphill side, from which culverts lead. It ends in loops of 7 m on which lorries
    /// turn.
    #[must_use]
    pub fn forest_road() -> Self {
        Self {
            width_m: 3.6,
            width_variation: 0.06,
            section: CrossSection {
                max_grade: 0.12,
                smoothing_m: 15.0,
                crossfall: 0.0,
                crown: 0.04,
                ditch: Some(Ditch {
                    depth_m: 0.35,
                    width_m: 1.2,
                }),
                ruts: Some(Ruts {
                    depth_m: 0.03,
                    gauge_m: 1.8,
                    sigma_m: 0.25,
                }),
                ..CrossSection::default()
            },
            surfaces: surfaces(&[
                (TrailSurfaceKind::Gravel, 0.85),
                (TrailSurfaceKind::DryEarth, 0.1),
                (TrailSurfaceKind::Grassy, 0.05),
            ]),
            change: 0.3,
            grass_max_per_chunk: 60,
            grass_spread_m: 0.35,
            verge_tufts_per_m: 10.0,
            strip_cover: 0.0,
            rocks_max_per_trail: 500,
            roots_per_m: 0.0,
            steps_from_grade: 0.0,
            stone_beds: 0.35,
            culvert_spacing_m: 60.0,
            turning_radius_m: 7.0,
        }
    }

    /// A trail on which timber is skidded, 4 m wide: deep ruts, often in mud, and little grass.
    #[must_use]
    pub fn skid_trail() -> Self {
        Self {
            width_m: 4.0,
            width_variation: 0.1,
            section: CrossSection {
                max_grade: 0.35,
                smoothing_m: 5.0,
                crossfall: 0.0,
                crown: 0.0,
                ruts: Some(Ruts {
                    depth_m: 0.12,
                    gauge_m: 2.1,
                    sigma_m: 0.24,
                }),
                ..CrossSection::default()
            },
            surfaces: surfaces(&[
                (TrailSurfaceKind::Mud, 0.5),
                (TrailSurfaceKind::LeafLitter, 0.2),
                (TrailSurfaceKind::DryEarth, 0.2),
                (TrailSurfaceKind::Needles, 0.1),
            ]),
            change: 0.6,
            grass_max_per_chunk: 20,
            grass_spread_m: 1.5,
            verge_tufts_per_m: 2.0,
            strip_cover: 0.25,
            rocks_max_per_trail: 100,
            roots_per_m: 0.0,
            steps_from_grade: 0.0,
            stone_beds: 0.0,
            culvert_spacing_m: 0.0,
            turning_radius_m: 0.0,
        }
    }

    /// A path of deer, 0.4 m wide, barely carved.
    #[must_use]
    pub fn deer_path() -> Self {
        Self {
            width_m: 0.4,
            width_variation: 0.0,
            section: CrossSection {
                cut_ratio: 0.6,
                fill_ratio: 1.2,
                max_grade: 0.8,
                smoothing_m: 1.5,
                crossfall: 0.0,
                crown: -0.05,
                levelling: 0.2,
                reach_m: 2.0,
                sink_m: 0.03,
                hollow_m: 0.05,
                ruts: None,
                ..CrossSection::default()
            },
            surfaces: surfaces(&[
                (TrailSurfaceKind::DryEarth, 0.5),
                (TrailSurfaceKind::LeafLitter, 0.25),
                (TrailSurfaceKind::Needles, 0.25),
            ]),
            change: 0.5,
            grass_max_per_chunk: 0,
            grass_spread_m: 0.2,
            verge_tufts_per_m: 4.0,
            strip_cover: 0.0,
            rocks_max_per_trail: 50,
            roots_per_m: 0.3,
            steps_from_grade: 0.0,
            stone_beds: 0.0,
            culvert_spacing_m: 0.0,
            turning_radius_m: 0.0,
        }
    }

    /// A strip that is kept free of fuel, 8 m wide: mineral soil that was scraped bare, or a short
    /// sward. It follows the ground, and what was scraped lies along its edges.
    #[must_use]
    pub fn firebreak() -> Self {
        Self {
            width_m: 8.0,
            width_variation: 0.08,
            section: CrossSection {
                max_grade: 1.0,
                smoothing_m: 2.0,
                crossfall: 0.0,
                crown: 0.0,
                levelling: 0.0,
                reach_m: 4.0,
                sink_m: 0.08,
                ruts: Some(Ruts {
                    depth_m: 0.04,
                    gauge_m: 1.8,
                    sigma_m: 0.2,
                }),
                curve: [(-4.0, 0.22), (-3.1, 0.0), (3.1, 0.0), (4.0, 0.22)]
                    .map(|(x, y)| DVec2::new(x, y))
                    .to_vec(),
                ..CrossSection::default()
            },
            surfaces: surfaces(&[
                (TrailSurfaceKind::DryEarth, 0.45),
                (TrailSurfaceKind::Sand, 0.25),
                (TrailSurfaceKind::Grassy, 0.3),
            ]),
            change: 0.4,
            grass_max_per_chunk: 350,
            grass_spread_m: 3.8,
            verge_tufts_per_m: 6.0,
            strip_cover: 0.5,
            rocks_max_per_trail: 600,
            roots_per_m: 0.0,
            steps_from_grade: 0.0,
            stone_beds: 0.0,
            culvert_spacing_m: 0.0,
            turning_radius_m: 0.0,
        }
    }

    /// This way with one material only.
    #[must_use]
    pub fn surfaced(mut self, kind: TrailSurfaceKind) -> Self {
        self.surfaces = surfaces(&[(kind, 1.0)]);
        self
    }

    pub(crate) fn check(&self) -> Result<(), ParamError> {
        ParamError::check_range("width_m", self.width_m, 0.3..=12.0, "0.3..=12 m")?;
        ParamError::check_range(
            "width_variation",
            self.width_variation,
            0.0..=0.6,
            "0..=0.6",
        )?;
        for weight in self.surfaces {
            ParamError::check_range("surfaces", weight, 0.0..=1e6, "0..=1e6")?;
        }
        ParamError::check_range(
            "surfaces",
            self.surfaces.iter().sum::<f64>(),
            f64::MIN_POSITIVE..=f64::MAX,
            "at least one weight above 0",
        )?;
        ParamError::check_range("change", self.change, 0.0..=1.0, "0..=1")?;
        ParamError::check_range(
            "grass_max_per_chunk",
            f64::from(self.grass_max_per_chunk),
            0.0..=100_000.0,
            "0..=100000",
        )?;
        ParamError::check_range(
            "grass_spread_m",
            self.grass_spread_m,
            0.0..=10.0,
            "0..=10 m",
        )?;
        ParamError::check_range(
            "verge_tufts_per_m",
            self.verge_tufts_per_m,
            0.0..=20.0,
            "0..=20 per metre",
        )?;
        ParamError::check_range("strip_cover", self.strip_cover, 0.0..=1.0, "0..=1")?;
        ParamError::check_range(
            "rocks_max_per_trail",
            f64::from(self.rocks_max_per_trail),
            0.0..=100_000.0,
            "0..=100000",
        )?;
        ParamError::check_range("roots_per_m", self.roots_per_m, 0.0..=5.0, "0..=5")?;
        ParamError::check_range(
            "steps_from_grade",
            self.steps_from_grade,
            0.0..=1.0,
            "0..=1",
        )?;
        ParamError::check_range("stone_beds", self.stone_beds, 0.0..=1.0, "0..=1")?;
        ParamError::check_range(
            "culvert_spacing_m",
            self.culvert_spacing_m,
            0.0..=500.0,
            "0..=500 m",
        )?;
        ParamError::check_range(
            "turning_radius_m",
            self.turning_radius_m,
            0.0..=15.0,
            "0..=15 m",
        )?;
        self.section.check()
    }

    /// The greatest width that may be found along a way, metres.
    pub(crate) fn widest_m(&self) -> f64 {
        self.width_m * (1.0 + self.width_variation)
    }

    /// Whether ways of both kinds are one piece of earthwork, and so join at grade.
    pub(crate) fn joins(&self, other: &Self) -> bool {
        let earthwork = |w: &Self| {
            let s = &w.section;
            [s.levelling, s.reach_m, s.cut_ratio, s.fill_ratio]
        };
        earthwork(self) == earthwork(other)
    }
}

/// Weights in the order of all materials.
fn surfaces(weights: &[(TrailSurfaceKind, f64)]) -> [f64; TrailSurfaceKind::ALL.len()] {
    TrailSurfaceKind::ALL.map(|kind| {
        let weight = weights.iter().find(|w| w.0 == kind);
        weight.map_or(0.0, |w| w.1)
    })
}
