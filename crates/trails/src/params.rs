//! The parameters of trails.

use glam::DVec2;
use nemoral_scene::ParamError;

use crate::WayKind;

/// Where trails run (the paper's section IV-C), and which kinds of way they are.
#[derive(Clone, Debug, PartialEq)]
pub struct TrailParams {
    /// Probability that a chunk is the birth of a trail, 0..=1. A chunk is crossed by about this
    /// times three quarters of `max_length_chunks` trails.
    pub spawn_probability: f64,
    /// Probability that a trail leaves a chunk by the border opposite to the one it came in by,
    /// 0..=1; otherwise it turns left or right with equal probability.
    pub forward_probability: f64,
    /// The most chunks a trail goes through, 1..=64; lengths are uniform from half of it.
    pub max_length_chunks: u32,
    /// Probability that a trail forks at a border that it crosses, 0..=1: a branch of its kind,
    /// 2 to 6 chunks long, leaves it there at an acute angle. Branches do not fork.
    pub fork_probability: f64,
    /// The kinds of way, each with its share of all trails, at least one above 0. Each trail has
    /// one of them. Neighbours in this list that have the same earthwork ([`CrossSection`]) join at
    /// grade; where others meet, the one listed first keeps its section and the later ones fade
    /// into it.
    pub ways: Vec<(WayKind, f64)>,
}

/// The shape of a trail across its run, and how it meets the ground beside it.
///
/// Offsets are to the left of the direction of travel, heights above the formation: the smoothed
/// ground along the middle.
#[derive(Clone, Debug, PartialEq)]
pub struct CrossSection {
    /// Horizontal metres per metre of height of the slopes cut into higher ground, 0.25..=10.
    pub cut_ratio: f64,
    /// Horizontal metres per metre of height of the slopes filled onto lower ground, 0.25..=10.
    pub fill_ratio: f64,
    /// The steepest run along the trail, 0.02..=1, away from other ways: where ways meet, their
    /// formations pass over into each other. It is exceeded where the ground leaves no choice
    /// within `earth_m`.
    pub max_grade: f64,
    /// How far the formation may lie above or below the smoothed ground, metres, 0.2..=30.
    pub earth_m: f64,
    /// Standard deviation of the smoothing of the ground along the trail, metres, 1..=50.
    pub smoothing_m: f64,
    /// Slope across the trail towards the downhill side, 0..=0.2.
    pub crossfall: f64,
    /// How much higher the middle is than the edges, over half the width, -0.5..=0.5; negative is
    /// a hollow way.
    pub crown: f64,
    /// Wheel ruts; trails narrower than 2 m never have them.
    pub ruts: Option<Ruts>,
    /// How far the ground is levelled across, 0..=1: 1 is a full bench, with 0 the surface follows
    /// the ground.
    pub levelling: f64,
    /// The distance from its edge at which a way stops to change the ground, metres, 2..=12.
    pub reach_m: f64,
    /// Depth of the surface below the formation, metres, -0.3..=1, as of a trodden path.
    pub sink_m: f64,
    /// Further depth where the run is steep, metres, 0..=1.5: none on level runs, half of it at a
    /// grade of 10 %, all of it from 20 % on (a hollow way).
    pub hollow_m: f64,
    /// A ditch along the uphill edge, on level ground along both.
    pub ditch: Option<Ditch>,
    /// The user's own curve, which is added: (offset, height) in metres, by rising offset,
    /// interpolated linearly and constant beyond the ends; offsets -10..=10 m, heights -2..=2 m. It
    /// goes on beyond the edges, where it fades within 1.5 m. Empty for none.
    pub curve: Vec<DVec2>,
}

/// A ditch beside the surface, beyond which the cut slope begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ditch {
    /// Depth below the edge, metres, 0.05..=0.8.
    pub depth_m: f64,
    /// Width from the edge to the foot of the slope, metres, 0.4..=1.5.
    pub width_m: f64,
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
        Self::of(WayKind::default())
    }
}

impl Default for CrossSection {
    /// A forest track in earth: slopes 1:1 cut and 1.5:1 filled, 20 % grade where 3 m of earth are
    /// enough, 3 % crossfall, ruts.
    fn default() -> Self {
        Self {
            cut_ratio: 1.0,
            fill_ratio: 1.5,
            max_grade: 0.2,
            earth_m: 3.0,
            smoothing_m: 8.0,
            crossfall: 0.03,
            crown: 0.02,
            levelling: 1.0,
            reach_m: 12.0,
            sink_m: 0.0,
            hollow_m: 0.0,
            ditch: None,
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

/// The least distance of two points of a section's curve, metres.
const CURVE_STEP_M: f64 = 0.01;

/// The greatest offset of a point of a section's curve to either side, metres.
const CURVE_REACH_M: f64 = 10.0;

impl TrailParams {
    /// Trails of one kind only.
    #[must_use]
    pub fn of(way: WayKind) -> Self {
        Self {
            spawn_probability: 0.02,
            forward_probability: 0.7,
            max_length_chunks: 40,
            fork_probability: 0.0,
            ways: vec![(way, 1.0)],
        }
    }

    pub(crate) fn check(&self, chunk_size_m: f64) -> Result<(), ParamError> {
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
            "fork_probability",
            self.fork_probability,
            0.0..=1.0,
            "0..=1",
        )?;
        let mut total = 0.0;
        for (way, share) in &self.ways {
            ParamError::check_range("ways share", *share, 0.0..=1e6, "0..=1e6")?;
            total += share;
            way.check()?;
            // Of a kind without a share no trail crosses a chunk's border at a keyed place.
            let width_m = if *share > 0.0 { way.width_m } else { 0.0 };
            ParamError::check_range(
                "chunk_size_m",
                chunk_size_m,
                4.0 * width_m..=1000.0,
                "at least 4 times width_m and at most 1000 m",
            )?;
        }
        ParamError::check_range(
            "ways",
            total,
            f64::MIN_POSITIVE..=f64::MAX,
            "at least one way with a share above 0",
        )
    }
}

impl CrossSection {
    pub(crate) fn check(&self) -> Result<(), ParamError> {
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
        ParamError::check_range("section.earth_m", self.earth_m, 0.2..=30.0, "0.2..=30 m")?;
        ParamError::check_range(
            "section.smoothing_m",
            self.smoothing_m,
            1.0..=50.0,
            "1..=50 m",
        )?;
        ParamError::check_range("section.crossfall", self.crossfall, 0.0..=0.2, "0..=0.2")?;
        ParamError::check_range("section.crown", self.crown, -0.5..=0.5, "-0.5..=0.5")?;
        ParamError::check_range("section.levelling", self.levelling, 0.0..=1.0, "0..=1")?;
        ParamError::check_range("section.reach_m", self.reach_m, 2.0..=12.0, "2..=12 m")?;
        ParamError::check_range("section.sink_m", self.sink_m, -0.3..=1.0, "-0.3..=1 m")?;
        ParamError::check_range("section.hollow_m", self.hollow_m, 0.0..=1.5, "0..=1.5 m")?;
        if let Some(ditch) = self.ditch {
            let Ditch { depth_m, width_m } = ditch;
            ParamError::check_range("section.ditch.depth_m", depth_m, 0.05..=0.8, "0.05..=0.8 m")?;
            ParamError::check_range("section.ditch.width_m", width_m, 0.4..=1.5, "0.4..=1.5 m")?;
        }
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
        let mut least = -CURVE_REACH_M;
        for point in &self.curve {
            ParamError::check_range(
                "section.curve offset",
                point.x,
                least..=CURVE_REACH_M,
                "-10..=10 m, and at least 1 cm more than the one before",
            )?;
            ParamError::check_range("section.curve height", point.y, -2.0..=2.0, "-2..=2 m")?;
            least = point.x + CURVE_STEP_M;
        }
        Ok(())
    }
}
