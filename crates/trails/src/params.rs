//! The parameters of trails.

use glam::DVec2;
use nemoral_scene::TrailSurfaceKind;

use nemoral_scene::ParamError;

/// The paper's parameters of trails (section IV-C).
#[derive(Clone, Debug, PartialEq)]
pub struct TrailParams {
    /// Width of the usable surface, metres, 0.5..=8.
    pub width_m: f64,
    /// Probability that a chunk is the birth of a trail, 0..=1. A chunk is crossed by about this
    /// times three quarters of `max_length_chunks` trails.
    pub spawn_probability: f64,
    /// Probability that a trail leaves a chunk by the border opposite to the one it came in by,
    /// 0..=1; otherwise it turns left or right with equal probability.
    pub forward_probability: f64,
    /// The most chunks a trail goes through, 1..=64; lengths are uniform from half of it.
    pub max_length_chunks: u32,
    /// The shape of a trail across its run.
    pub section: Section,
    /// The most grass tufts along the middle of trails in one chunk; 0 for none.
    pub grass_max_per_chunk: u32,
    /// How far from a trail's middle its grass grows, metres, 0..=10.
    pub grass_spread_m: f64,
    /// Tufts of grass that a metre of each edge has room for, 0..=20; 0 for bare verges. About half
    /// of them grow, in patches.
    pub verge_tufts_per_m: f64,
    /// The most stones on one trail, over its whole length; 0 for none.
    pub rocks_max_per_trail: u32,
    /// The material of all trails; `None` draws one for each trail.
    pub surface: Option<TrailSurfaceKind>,
}

/// The shape of a trail across its run, and how it meets the ground beside it.
///
/// Offsets are to the left of the direction of travel, heights above the formation: the smoothed
/// ground along the middle.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// Horizontal metres per metre of height of the slopes cut into higher ground, 0.25..=10.
    pub cut_ratio: f64,
    /// Horizontal metres per metre of height of the slopes filled onto lower ground, 0.25..=10.
    pub fill_ratio: f64,
    /// The steepest run along the trail, 0.02..=1.
    pub max_grade: f64,
    /// Standard deviation of the smoothing of the ground along the trail, metres, 1..=50.
    pub smoothing_m: f64,
    /// Slope across the trail towards the downhill side, 0..=0.2.
    pub crossfall: f64,
    /// How much higher the middle is than the edges, over half the width, -0.5..=0.5; negative is
    /// a hollow way.
    pub crown: f64,
    /// Wheel ruts; trails narrower than 2 m never have them.
    pub ruts: Option<Ruts>,
    /// The user's own curve, which is added: (offset, height) in metres, by rising offset,
    /// interpolated linearly and constant beyond the ends. Empty for none.
    pub curve: Vec<DVec2>,
}

/// Two wheel ruts and the ridge between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ruts {
    /// Mean depth, metres, 0..=0.5; mud has deeper, rock and gravel have shallower ones.
    pub depth_m: f64,
    /// Distance between their middles, metres, 1..=3.
    pub gauge_m: f64,
    /// Standard deviation of a rut's bell-shaped section, metres, 0.05..=0.5.
    pub sigma_m: f64,
}

impl Default for TrailParams {
    /// A 3 m forest track in about every second chunk.
    fn default() -> Self {
        Self {
            width_m: 3.0,
            spawn_probability: 0.02,
            forward_probability: 0.7,
            max_length_chunks: 40,
            section: Section::default(),
            grass_max_per_chunk: 120,
            grass_spread_m: 0.5,
            verge_tufts_per_m: 6.0,
            rocks_max_per_trail: 300,
            surface: None,
        }
    }
}

impl Default for Section {
    /// A forest track in earth: slopes 1:1 cut and 1.5:1 filled, 20 % grade, 3 % crossfall, ruts.
    fn default() -> Self {
        Self {
            cut_ratio: 1.0,
            fill_ratio: 1.5,
            max_grade: 0.2,
            smoothing_m: 8.0,
            crossfall: 0.03,
            crown: 0.02,
            ruts: Some(Ruts::default()),
            curve: Vec::new(),
        }
    }
}

impl Default for Ruts {
    /// The ruts of a car: 5 cm deep, 1.6 m apart.
    fn default() -> Self {
        Self {
            depth_m: 0.05,
            gauge_m: 1.6,
            sigma_m: 0.16,
        }
    }
}

impl TrailParams {
    pub(crate) fn check(&self, chunk_size_m: f64) -> Result<(), ParamError> {
        ParamError::check_range("width_m", self.width_m, 0.5..=8.0, "0.5..=8 m")?;
        ParamError::check_range(
            "chunk_size_m",
            chunk_size_m,
            4.0 * self.width_m..=1000.0,
            "at least 4 times width_m and at most 1000 m",
        )?;
        ParamError::check_range(
            "spawn_probability",
            self.spawn_probability,
            0.0..=1.0,
            "0..=1",
        )?;
        ParamError::check_range(
            "forward_probability",
            self.forward_probability,
            0.0..=1.0,
            "0..=1",
        )?;
        ParamError::check_range(
            "max_length_chunks",
            f64::from(self.max_length_chunks),
            1.0..=64.0,
            "1..=64",
        )?;
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
        ParamError::check_range(
            "rocks_max_per_trail",
            f64::from(self.rocks_max_per_trail),
            0.0..=100_000.0,
            "0..=100000",
        )?;
        self.section.check()
    }
}

impl Section {
    fn check(&self) -> Result<(), ParamError> {
        ParamError::check_range(
            "section.cut_ratio",
            self.cut_ratio,
            0.25..=10.0,
            "0.25..=10",
        )?;
        ParamError::check_range(
            "section.fill_ratio",
            self.fill_ratio,
            0.25..=10.0,
            "0.25..=10",
        )?;
        ParamError::check_range("section.max_grade", self.max_grade, 0.02..=1.0, "0.02..=1")?;
        ParamError::check_range(
            "section.smoothing_m",
            self.smoothing_m,
            1.0..=50.0,
            "1..=50 m",
        )?;
        ParamError::check_range("section.crossfall", self.crossfall, 0.0..=0.2, "0..=0.2")?;
        ParamError::check_range("section.crown", self.crown, -0.5..=0.5, "-0.5..=0.5")?;
        if let Some(ruts) = self.ruts {
            ParamError::check_range("section.ruts.depth_m", ruts.depth_m, 0.0..=0.5, "0..=0.5 m")?;
            ParamError::check_range("section.ruts.gauge_m", ruts.gauge_m, 1.0..=3.0, "1..=3 m")?;
            ParamError::check_range(
                "section.ruts.sigma_m",
                ruts.sigma_m,
                0.05..=0.5,
                "0.05..=0.5 m",
            )?;
        }
        let mut last = f64::NEG_INFINITY;
        for point in &self.curve {
            ParamError::check_range(
                "section.curve offset",
                point.x,
                last.next_up()..=10.0,
                "rising and at most 10 m",
            )?;
            ParamError::check_range("section.curve height", point.y, -2.0..=2.0, "-2..=2 m")?;
            last = point.x;
        }
        Ok(())
    }
}
