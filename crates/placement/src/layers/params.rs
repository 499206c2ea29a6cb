//! The parameters of rocks and woody layers, and their ranges.

use super::open_land::EdgeProfile;
use super::patches::Patches;
use super::rows::Rows;
use crate::variety::{DiskKind, check_varieties};
use nemoral_scene::ParamError;

/// Rocks: scattered at random, a number per chunk (paper, section IV-D).
#[derive(Clone, Debug, PartialEq)]
pub struct RockParams {
    /// The least number in a chunk.
    pub min_per_chunk: u32,
    /// The largest number in a chunk. The number is uniform in `min_per_chunk..=max_per_chunk`.
    pub max_per_chunk: u32,
    /// The kinds of rocks. May be empty if `max_per_chunk` is 0.
    pub varieties: Vec<DiskKind>,
}

/// One layer of woody plants.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerParams {
    /// A name for messages, such as `trees`.
    pub name: String,
    /// The target: the mean number per chunk over the whole plane, trails included, at
    /// `density_factor` 1. 0 for none, otherwise from 10⁻⁴ to 10⁵.
    pub per_chunk: f64,
    /// The varieties of the layer. May be empty if `per_chunk` is 0.
    pub varieties: Vec<DiskKind>,
    /// Rows in which the layer is planted, or `None` for a scattered layer. Of the places of rows,
    /// as many as `per_chunk` asks for hold a plant; in the others it died or was thinned.
    pub rows: Option<Rows>,
    /// Density inside [`PlacementParams::gaps`] relative to outside, 0 to 20: 0 for a canopy, 1 for
    /// plants that are indifferent, more for those that need light. The mean over the plane is
    /// still the target. Where there is more both in gaps and [at edges](Self::at_edges), the
    /// greater one counts. A layer that is denser in gaps, but not at edges, has one pattern there
    /// and another outside.
    pub in_gaps: f64,
    /// Patches to which the layer is restricted, each layer to its own; `None` for everywhere.
    pub clusters: Option<Patches>,
    /// Its density across the edges of woods, where there is
    /// [open land](crate::Placement::with_open_land); `None` if it stands there as elsewhere. The
    /// target is then the mean within woods.
    pub at_edges: Option<EdgeProfile>,
}

impl LayerParams {
    /// A layer that is scattered over the whole plane.
    #[must_use]
    pub fn new(name: impl Into<String>, per_chunk: f64, varieties: Vec<DiskKind>) -> Self {
        Self {
            name: name.into(),
            per_chunk,
            varieties,
            rows: None,
            in_gaps: 1.0,
            clusters: None,
            at_edges: None,
        }
    }

    /// The largest occupancy radius of the varieties with a positive weight, metres.
    pub(crate) fn max_radius_m(&self) -> f64 {
        let weighted = self.varieties.iter().filter(|v| v.weight > 0.0);
        weighted.map(|v| v.radius_m.1).fold(0.0, f64::max)
    }
}

/// Everything that decides where rocks and plants stand, except the seed.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacementParams {
    /// The edge of a chunk, metres; 1 to 10⁴. The paper's is 50.
    pub chunk_size_m: f64,
    /// Rocks, placed first.
    pub rocks: RockParams,
    /// Woody layers in their order, such as trees, stumps, shrubs; a later layer gives way to the
    /// earlier ones.
    pub layers: Vec<LayerParams>,
    /// Gaps, which layers avoid or seek; `None` for no gaps.
    pub gaps: Option<Patches>,
    /// Two sites p and q are at least `spacing_factor · density_factor · (r_p + r_q)` apart; 0 to
    /// 100.
    pub spacing_factor: f64,
    /// The paper's factor on all woody radii, those that the target implies included; 0.05 to 20. A
    /// layer's mean number is `per_chunk / density_factor²`: larger is sparser. Rows stay where
    /// they are, and fewer of their places hold a plant.
    pub density_factor: f64,
    /// The regularity of scattered layers: the hard core at which a layer is filled, over the
    /// spacing of a saturated pattern of its density; 0.05 to 0.75. At 0 points would be random, at
    /// 1 as regular as in a plantation; Clark and Evans's R is 1.07 at 0.25 and 1.2 at 0.5.
    pub hard_core: f64,
    /// The share of the plane that the exclusion allows (1 without trails); more than 0, at most 1.
    /// The density there is raised by its inverse, so that the mean over the whole plane meets the
    /// target.
    pub allowed_fraction: f64,
}

impl Default for PlacementParams {
    /// The paper's medium density: 96 trees on 50 m chunks, with some stumps, shrubs and rocks.
    fn default() -> Self {
        let layer = |name: &str, per_chunk, radius_m| {
            let variety = DiskKind {
                weight: 1.0,
                radius_m,
            };
            LayerParams::new(name, per_chunk, vec![variety])
        };
        Self {
            chunk_size_m: 50.0,
            rocks: RockParams {
                min_per_chunk: 4,
                max_per_chunk: 16,
                varieties: vec![DiskKind {
                    weight: 1.0,
                    radius_m: (0.15, 0.8),
                }],
            },
            layers: vec![
                layer("trees", 96.0, (0.1, 0.3)),
                layer("stumps", 8.0, (0.1, 0.3)),
                layer("shrubs", 120.0, (0.2, 0.4)),
            ],
            gaps: None,
            spacing_factor: 1.2,
            density_factor: 1.0,
            hard_core: 0.5,
            allowed_fraction: 1.0,
        }
    }
}

impl PlacementParams {
    /// The factor between occupancy radii and the distance rule of woody things.
    pub(crate) fn factor(&self) -> f64 {
        self.spacing_factor * self.density_factor
    }

    /// Rocks are solid, so a factor below 1 does not let anything stand in one.
    pub(crate) fn rock_factor(&self) -> f64 {
        self.factor().max(1.0)
    }

    pub(crate) fn check(&self) -> Result<(), ParamError> {
        ParamError::check_within("chunk_size_m", self.chunk_size_m, 1.0, 1e4)?;
        ParamError::check_within("spacing_factor", self.spacing_factor, 0.0, 100.0)?;
        ParamError::check_within("hard_core", self.hard_core, 0.05, 0.75)?;
        ParamError::check_within("density_factor", self.density_factor, 0.05, 20.0)?;
        if !(self.allowed_fraction > 0.0 && self.allowed_fraction <= 1.0) {
            return Err(ParamError::new(
                "allowed_fraction",
                self.allowed_fraction,
                "more than 0 and at most 1",
            ));
        }
        let rocks = &self.rocks;
        if rocks.min_per_chunk > rocks.max_per_chunk {
            return Err(ParamError::new(
                "rocks.min_per_chunk",
                rocks.min_per_chunk,
                format!("at most rocks.max_per_chunk = {}", rocks.max_per_chunk),
            ));
        }
        if rocks.max_per_chunk > 10_000 {
            return Err(ParamError::new(
                "rocks.max_per_chunk",
                rocks.max_per_chunk,
                "at most 10000",
            ));
        }
        const WHAT_REACH: &str = "half a chunk over the factor of the distance rule";
        // Only the 8 neighbours of a chunk are considered, so no distance rule may reach beyond
        // them.
        let reach = self.chunk_size_m / 2.0;
        if rocks.max_per_chunk > 0 {
            check_varieties(
                "rocks.varieties",
                &rocks.varieties,
                reach / self.rock_factor(),
                WHAT_REACH,
            )?;
        }
        if let Some(gaps) = &self.gaps {
            gaps.check("gaps", self.chunk_size_m)?;
        }
        if self.layers.len() > 255 {
            return Err(ParamError::new(
                "layers.len()",
                self.layers.len(),
                "at most 255",
            ));
        }
        for (i, layer) in self.layers.iter().enumerate() {
            if layer.per_chunk != 0.0 {
                ParamError::check_within(
                    format!("layers[{i}].per_chunk"),
                    layer.per_chunk,
                    1e-4,
                    1e5,
                )?;
                check_varieties(
                    &format!("layers[{i}].varieties"),
                    &layer.varieties,
                    reach / self.rock_factor(),
                    WHAT_REACH,
                )?;
                ParamError::check_within(format!("layers[{i}].in_gaps"), layer.in_gaps, 0.0, 20.0)?;
                if let Some(clusters) = &layer.clusters {
                    clusters.check(&format!("layers[{i}].clusters"), self.chunk_size_m)?;
                }
                if let Some(profile) = &layer.at_edges {
                    profile.check(&format!("layers[{i}].at_edges"))?;
                }
                if let Some(rows) = &layer.rows {
                    let largest_m = self.factor() * layer.max_radius_m();
                    rows.check(&format!("layers[{i}].rows"), largest_m)?;
                }
            }
        }
        Ok(())
    }
}
