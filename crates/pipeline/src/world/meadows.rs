//! Meadows and clearings: where the wood ends.

use std::sync::Arc;

use nemoral_placement::{EdgeProfile, OpenLand};
use nemoral_scene::Surface;
use nemoral_scene::glam::DVec2;
use nemoral_seed::{Domain, Key};
use nemoral_stand::StandLayer;
use nemoral_terrain::{NoiseTerrain, TerrainParams};

use super::plot::Plot;
use crate::{Error, config};

const MEADOWS: Domain = Domain::new("pipeline.meadows");
const RAGGED: Domain = Domain::new("pipeline.meadows.ragged");

/// Number of places along each side of the grid at which the field's quantiles are sampled, and
/// their distance in multiples of the meadows' scale.
const SAMPLES: u32 = 40;
const SAMPLE_STEP: f64 = 1.7;
/// The least slope of the field that a distance is reckoned with, per scale: near its saddles
/// distances would grow beyond all bounds.
const LEAST_SLOPE: f64 = 0.2;
/// Wavelength of the small bays and tongues of an edge, and how far they reach, metres.
const RAGGED_SCALE_M: f64 = 9.0;
const RAGGED_M: f64 = 3.0;
/// The least width of a mantle, metres.
const LEAST_MANTLE_M: f64 = 0.1;

/// Where meadows are in a world: above a level of smooth noise.
#[derive(Clone, Debug)]
pub(crate) struct Meadows {
    field: NoiseTerrain,
    level: f64,
    scale_m: f64,
    ragged: NoiseTerrain,
    mantle_m: f64,
    kept: f64,
    edge_trees: f64,
    plot: Option<Arc<Plot>>,
}

impl Meadows {
    /// The meadows that a config asks for, none of which reaches into a stem map; `None` if there
    /// are none.
    pub(crate) fn new(
        of: &config::Meadows,
        plot: Option<Arc<Plot>>,
        world: Key,
    ) -> Result<Option<Self>, Error> {
        if of.share <= 0.0 {
            return Ok(None);
        }
        let noise = |octaves, scale_m, domain| {
            let params = TerrainParams {
                octaves,
                scale_m,
                lacunarity: 2.3,
                persistence: 0.32,
                max_height_m: 1.0,
            };
            NoiseTerrain::new(params, world.domain(domain)).map_err(Error::of_stage)
        };
        let field = noise(3, of.scale_m, MEADOWS)?;
        let places = (0..SAMPLES * SAMPLES)
            .map(|i| DVec2::new(f64::from(i % SAMPLES), f64::from(i / SAMPLES)));
        let mut values: Vec<f64> = places
            .map(|p| field.height_m(p * SAMPLE_STEP * of.scale_m))
            .collect();
        values.sort_unstable_by(f64::total_cmp);
        let rank = (1.0 - of.share) * values.len() as f64;
        Ok(Some(Self {
            level: values[(rank as usize).min(values.len() - 1)],
            field,
            scale_m: of.scale_m,
            ragged: noise(2, RAGGED_SCALE_M, RAGGED)?,
            mantle_m: of.mantle_m,
            kept: of.kept,
            edge_trees: of.edge_trees,
            plot,
        }))
    }

    /// The share of the trees at their edges that grew up there.
    pub(crate) fn edge_trees(&self) -> f64 {
        self.edge_trees
    }

    /// How near the edge is at a depth, 0..=1: 1 on it, 0 beyond the mantle.
    pub(crate) fn fringe(&self, depth_m: f64) -> f64 {
        (1.3 - depth_m.abs() / (self.mantle_m + 0.5)).clamp(0.0, 1.0)
    }

    /// How much of a place at a depth is meadow that is kept as grass, 0..=1.
    pub(crate) fn kept(&self, depth_m: f64) -> f64 {
        if self.kept <= 0.0 {
            return 0.0;
        }
        // The fringe of tall herbs in front of the mantle is left when the meadow is mown.
        let fringe_m = 0.5 * self.mantle_m;
        let inside = (depth_m - fringe_m) / (0.7 * self.mantle_m + 1.0);
        self.kept * inside.clamp(0.0, 1.0)
    }
}

impl OpenLand for Meadows {
    fn depth_m(&self, world_m: DVec2) -> f64 {
        let here = self.field.sample(world_m);
        let least = LEAST_SLOPE / self.scale_m;
        let slope = libm::sqrt(here.gradient.length_squared() + least * least);
        let bays_m = 2.0 * RAGGED_M * (self.ragged.height_m(world_m) - 0.5);
        let depth_m = (here.height_m - self.level) / slope + bays_m;
        // Around the trees of a stem map is wood.
        match &self.plot {
            Some(plot) if plot.contains(world_m) => f64::NEG_INFINITY,
            Some(plot) => depth_m.min(plot.beyond_margin_m(world_m)),
            None => depth_m,
        }
    }
}

/// How dense a layer is across the edges of meadows.
pub(crate) fn at_edges(layer: StandLayer, of: &config::Meadows) -> Option<EdgeProfile> {
    if of.share <= 0.0 {
        return None;
    }
    // Without a mantle, one layer passes into the other within decimetres.
    let m = of.mantle_m.max(LEAST_MANTLE_M);
    let points = match layer {
        // The outermost trees stand by themselves.
        StandLayer::Trees => vec![(-3.0, 1.0), (0.0, 0.6), (2.0, 0.0)],
        StandLayer::Stumps => vec![(-1.0, 1.0), (1.0, of.open_stumps)],
        // The mantle: shrubs in the light, with young trees behind and between them.
        StandLayer::Shrubs => vec![
            (-1.3 * m, 1.0),
            (-0.4 * m, 0.6 * of.mantle_shrubs),
            (0.0, of.mantle_shrubs),
            (0.5 * m, of.mantle_shrubs),
            (m, 0.25 * of.mantle_shrubs),
            (1.5 * m, of.open_shrubs),
        ],
        StandLayer::Saplings => vec![
            (-1.5 * m, 1.0),
            (-0.5 * m, of.mantle_saplings),
            (0.3 * m, of.mantle_saplings),
            (1.2 * m, of.open_saplings),
        ],
    };
    Some(EdgeProfile { points })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn meadows(change: impl Fn(&mut config::Meadows)) -> config::Meadows {
        let mut of = config::Meadows::default();
        of.share = 0.4;
        change(&mut of);
        of
    }

    #[test]
    fn they_have_their_share_and_distances_are_distances() {
        for seed in 0..4 {
            let of = meadows(|_| {});
            let land = Meadows::new(&of, None, Key::world(seed))
                .expect("valid")
                .expect("some");
            let (mut open, mut near, mut off) = (0, 0, 0);
            for i in 0..40_000 {
                let p = DVec2::new(f64::from(i % 200), f64::from(i / 200)) * 23.0;
                let depth_m = land.depth_m(p);
                open += i32::from(depth_m > 0.0);
                // Over 10 m across an edge, depth changes by 10 m, give or take its bays.
                if depth_m.abs() < 3.0 {
                    near += 1;
                    let across = land.field.sample(p).gradient.normalize_or_zero();
                    let step = land.depth_m(p + 5.0 * across) - land.depth_m(p - 5.0 * across);
                    off += i32::from(!(4.0..16.0).contains(&step));
                }
            }
            let share = f64::from(open) / 40_000.0;
            assert!((share - 0.4).abs() < 0.06, "{share}");
            assert!(near > 300 && off * 5 < near, "{off} of {near}");
        }
    }

    #[test]
    fn a_meadow_is_kept_beyond_its_fringe() {
        let of = meadows(|of| of.kept = 0.9);
        let land = Meadows::new(&of, None, Key::world(1))
            .expect("valid")
            .expect("some");
        for i in 0..10_000 {
            let p = DVec2::new(f64::from(i % 100), f64::from(i / 100)) * 5.0;
            let (depth_m, kept) = (land.depth_m(p), land.kept(land.depth_m(p)));
            assert!((0.0..=0.9).contains(&kept));
            assert!(depth_m > 0.0 || kept == 0.0);
            assert!(depth_m < 2.0 * of.mantle_m + 2.0 || kept == 0.9);
        }
    }

    #[test]
    fn no_meadow_reaches_into_a_stem_map() {
        let plot = Arc::new(crate::world::plot::tests::plot(
            &[[0.0, 0.0], [40.0, 0.0], [40.0, 40.0], [0.0, 40.0]],
            3.0,
        ));
        let of = meadows(|of| (of.share, of.scale_m) = (0.9, 30.0));
        let land = |plot| {
            let land = Meadows::new(&of, plot, Key::world(2));
            land.expect("valid").expect("some")
        };
        let (around, without) = (land(Some(Arc::clone(&plot))), land(None));
        let (mut in_plot, mut open) = (0, 0);
        for i in 0..6400 {
            let p = DVec2::new(f64::from(i % 80), f64::from(i / 80)) * 2.0 - 60.0;
            let (depth_m, alone_m) = (around.depth_m(p), without.depth_m(p));
            if plot.contains(p) {
                in_plot += i32::from(alone_m > 0.0);
                assert!(depth_m < -1e3, "{p} {depth_m}");
            } else {
                open += i32::from(depth_m > 0.0);
                assert_eq!(depth_m > 0.0, alone_m > 0.0, "{p}");
                assert!(
                    depth_m <= alone_m && depth_m <= plot.beyond_margin_m(p),
                    "{p}"
                );
            }
        }
        assert!(in_plot > 200 && open > 2000, "{in_plot} {open}");
    }

    #[test]
    fn no_trees_stand_in_the_open() {
        for mantle_m in [0.0, 6.0] {
            let of = meadows(|of| {
                (of.mantle_m, of.open_shrubs, of.open_saplings) = (mantle_m, 0.3, 0.2);
            });
            for layer in StandLayer::ALL {
                let points = at_edges(layer, &of).expect("edges").points;
                assert!(points.is_sorted_by(|a, b| a.0 < b.0), "{points:?}");
            }
            let open = |layer| {
                let points = at_edges(layer, &of).expect("edges").points;
                points.last().map(|point| point.1)
            };
            assert_eq!(open(StandLayer::Trees), Some(0.0));
            assert_eq!(open(StandLayer::Shrubs), Some(of.open_shrubs));
            assert_eq!(open(StandLayer::Saplings), Some(of.open_saplings));
        }
        assert_eq!(
            at_edges(StandLayer::Trees, &config::Meadows::default()),
            None
        );
    }
}
