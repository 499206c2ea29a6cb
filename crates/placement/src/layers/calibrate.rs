//! Calibration: finds hard cores for a target number, and the share of a sample (or of planted
//! rows) that is to be kept.

use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::sync::Arc;

use glam::DVec2;
use nemoral_scene::ChunkCoord;
use nemoral_seed::{Domain, Draw, Key};

use super::calibrated_layer::{CalibratedLayer, Pattern};
use super::gap_part::{GapPart, Unevenness};
use super::params::{LayerParams, PlacementParams};
use super::size_bias::SizeBias;
use crate::error::PlacementError;
use crate::sampler::bridson::SamplePoint;
use crate::sampler::quadtree::{QuadTree, is_free};
use crate::sampler::sizes::DiskSizes;
use crate::sampler::square::Square;
use crate::variety::mean_over_radius;

const CALIBRATION: Domain = Domain::new("placement.calibration");

/// Points per square of the hard-core distance in a saturated pattern of one radius (five runs of
/// 7·10⁷ points, spread 2·10⁻⁵).
const SATURATED: f64 = 0.6966;
/// The edge of the calibration's window in mean hard-core distances: some 3000 points of a filled
/// pattern.
const WINDOW: f64 = 72.0;
/// The same where initial samples alone are enough. These are fewer, and their number varies more:
/// in the window above, by 2 %. Without rounds of darts, a wider one takes no longer.
const WINDOW_OF_SAMPLES: f64 = 144.0;
/// More rounds than this add almost no points.
const MAX_ROUNDS: u32 = 4;
/// Probes along the edge of the grid that measures the room that earlier layers leave.
const PROBES: u32 = 64;

/// Makes every part of every layer of valid parameters, in order, by growing a window of each; an
/// empty layer has none.
///
/// Calibration has a key of its own, so that equal parameters keep equal shares in every world.
pub(crate) fn calibrate(params: &PlacementParams) -> Result<Vec<CalibratedLayer>, PlacementError> {
    let layers = params.layers.iter().enumerate();
    let parts = layers
        .filter(|(_, layer)| layer.per_chunk > 0.0)
        .flat_map(|(number, layer)| {
            let parts = GapPart::of(params, layer).iter();
            parts.map(move |&part| (number, layer, part))
        });
    let parts: Vec<_> = parts.collect();
    // What stands in gaps differs from what stands outside of them.
    let mut earlier: Vec<EarlierLayers> = [GapPart::Both, GapPart::Inside, GapPart::Outside]
        .into_iter()
        .filter(|place| parts.iter().any(|(.., part)| part == place))
        .map(|place| EarlierLayers::none(place, params.factor()))
        .collect();
    let calibrated =
        |&(number, layer, part): &_| calibrate_part(params, (number, layer), part, &mut earlier);
    parts.iter().map(calibrated).collect()
}

/// Makes a part of a layer, and adds its points to those of the earlier ones in each part of the
/// plane.
fn calibrate_part(
    params: &PlacementParams,
    (number, layer): (usize, &LayerParams),
    part: GapPart,
    earlier: &mut [EarlierLayers],
) -> Result<CalibratedLayer, PlacementError> {
    let target =
        layer.per_chunk / (params.allowed_fraction * params.density_factor * params.density_factor);
    let uneven = Unevenness::of(params, layer, part);
    // The hard cores must leave room where the density is greatest, too.
    let sizes = sizes(params, layer, target * uneven.most / uneven.mean);
    let max_radius = layer.max_radius_m() / params.chunk_size_m;
    // Slightly more than will be needed, so that rounding puts no radius beyond the last probe.
    let most = 1.001 * params.factor() * max_radius;
    let there = earlier.iter().find(|earlier| earlier.place == part);
    let clearances = there.map_or_else(Clearances::default, |there| Clearances::of(there, most));
    // The share of all darts of a variety that overlap neither rocks nor earlier layers.
    let room: Vec<f64> = layer
        .varieties
        .iter()
        .map(|v| {
            mean_over_radius(v, |r| rock_free(params, r))
                * mean_over_radius(v, |r| {
                    clearances.share(params.factor() * r / params.chunk_size_m)
                })
        })
        .collect();
    let key = Key::world(0).domain(CALIBRATION).item(number as u64);
    let mut most = f64::INFINITY;
    // Of young trees and shrubs in and out of gaps the initial samples are enough if they are as
    // many as are wanted: they need not be regular, and rounds of darts cost thirty times as much.
    let least = u32::from(part == GapPart::Both);
    let mut patterns: Vec<Pattern> = (least..=MAX_ROUNDS).map(Pattern::Fill).collect();
    if let Some(rows) = layer.rows {
        patterns = vec![Pattern::Rows(rows)];
    }
    for pattern in patterns {
        let mut made = CalibratedLayer {
            number,
            part,
            sizes: sizes.clone(),
            pattern,
            blocks: Arc::default(),
            chunk_size_m: params.chunk_size_m,
            max_radius,
            keep: Vec::new(),
            in_gaps: layer.in_gaps,
            clusters: layer.clusters,
            at_edges: layer.at_edges.clone(),
        };
        let window = match pattern {
            Pattern::Fill(0) => WINDOW_OF_SAMPLES,
            Pattern::Fill(_) | Pattern::Rows(_) => WINDOW,
        };
        let half = window * sizes.mean_core();
        let square = Square::around_tile(half);
        let points = made.pattern_in(key, ChunkCoord::default(), square);
        let (filled, bias) = match pattern {
            Pattern::Fill(_) => (
                points.len() as f64 / (4.0 * half * half),
                SizeBias::of(&sizes, layer, &points),
            ),
            // Planted places are known and take any variety.
            Pattern::Rows(rows) => (rows.per_chunk(params.chunk_size_m), SizeBias::NONE),
        };
        made.keep = (0..room.len())
            .map(|i| target / (uneven.mean * filled * bias.acceptance(&sizes, i) * room[i]))
            .collect();
        let kept = made.keep.iter().zip(&layer.varieties);
        most = kept
            .filter(|(_, v)| v.weight > 0.0)
            .map(|(keep, _)| *keep * uneven.most)
            .fold(0.0, f64::max);
        if most <= 1.0 {
            for there in earlier {
                there.add(&points, &made, uneven.mean_in(there.place), half);
            }
            return Ok(made);
        }
    }
    Err(PlacementError::TooDense {
        layer: number,
        name: layer.name.clone(),
        per_chunk: layer.per_chunk,
        at_most: layer.per_chunk / most,
    })
}

/// The points of the layers so far in the calibration's window, as they are in a part of the plane.
struct EarlierLayers {
    place: GapPart,
    factor: f64,
    /// Half the edge of the square where the points are complete.
    half: f64,
    points: Vec<SamplePoint<Key>>,
}

impl EarlierLayers {
    fn none(place: GapPart, factor: f64) -> Self {
        Self {
            place,
            factor,
            half: f64::INFINITY,
            points: Vec::new(),
        }
    }

    /// Adds a layer with `share` of its density everywhere. For the mean room that others find,
    /// this is equivalent to the full density in a part of the plane.
    fn add(&mut self, points: &[SamplePoint<Key>], layer: &CalibratedLayer, share: f64, half: f64) {
        // What is not there must not narrow the square for what is.
        if share == 0.0 {
            return;
        }
        let half = half.min(self.half);
        let index = self.index();
        let square = Square::around_tile(half);
        let stays = |p: &&SamplePoint<Key>| {
            square.contains(p.p)
                && layer.keeps_share(p, share)
                && is_free(&index, p.p, self.factor * p.radius)
        };
        let stay: Vec<SamplePoint<Key>> = points.iter().filter(stays).copied().collect();
        self.half = half;
        self.points.retain(|p| square.contains(p.p));
        self.points.extend(stay);
    }

    fn index(&self) -> QuadTree {
        let mut index = QuadTree::new(DVec2::splat(0.5 - self.half), 2.0 * self.half);
        for point in &self.points {
            index.insert(point.p, self.factor * point.radius);
        }
        index
    }
}

/// The hard cores of a layer: `hard_core` times the spacing that the target implies, and more for
/// large varieties.
fn sizes(params: &PlacementParams, layer: &LayerParams, target: f64) -> DiskSizes {
    let total: f64 = layer.varieties.iter().map(|v| v.weight).sum();
    let mid = |i: usize| (layer.varieties[i].radius_m.0 + layer.varieties[i].radius_m.1) / 2.0;
    // The room that a tree takes grows like the width of its crown, which is about the square root
    // of its stem's: a stem four times as thick keeps twice the distance. Where its own occupancy
    // is larger, that decides.
    let relative: Vec<f64> = {
        let mean = (0..layer.varieties.len())
            .map(|i| layer.varieties[i].weight / total * mid(i))
            .sum::<f64>();
        (0..layer.varieties.len())
            .map(|i| libm::sqrt(mid(i) / mean).clamp(0.5, 2.0))
            .collect()
    };
    let mean_square: f64 = layer
        .varieties
        .iter()
        .zip(&relative)
        .map(|(v, r)| v.weight / total * r * r)
        .sum();
    let core = params.hard_core * libm::sqrt(SATURATED / (target * mean_square)) / 2.0;
    DiskSizes::new(
        &layer.varieties,
        relative.iter().map(|r| core * r).collect(),
        params.chunk_size_m,
        params.factor(),
    )
}

/// The share of the plane where rocks leave room for a radius (m): rocks fall nearly independently.
fn rock_free(params: &PlacementParams, radius_m: f64) -> f64 {
    let rocks = &params.rocks;
    if rocks.max_per_chunk == 0 {
        return 1.0;
    }
    let total: f64 = rocks.varieties.iter().map(|v| v.weight).sum();
    let area_m2 = |rock_m: f64| {
        let reach = params.rock_factor() * (rock_m + radius_m);
        PI * reach * reach
    };
    let mean_area_m2: f64 = rocks
        .varieties
        .iter()
        .map(|v| v.weight / total * mean_over_radius(v, area_m2))
        .sum();
    let number = f64::from(rocks.min_per_chunk + rocks.max_per_chunk) / 2.0;
    libm::exp(-number * mean_area_m2 / (params.chunk_size_m * params.chunk_size_m))
}

/// The distances of probes from the nearest site, ascending, up to the greatest that is needed.
#[derive(Default)]
struct Clearances(Vec<f64>);

impl Clearances {
    /// `most` is the largest scaled radius that [`share`](Self::share) will be called with.
    fn of(earlier: &EarlierLayers, most: f64) -> Self {
        if earlier.points.is_empty() {
            return Self(Vec::new());
        }
        let index = earlier.index();
        let largest = earlier.points.iter().map(|p| p.radius).fold(0.0, f64::max);
        let half = earlier.half - (most + earlier.factor * largest);
        let mut rng = Key::world(0).domain(CALIBRATION).rng();
        let mut clearances = Vec::new();
        for y in 0..PROBES {
            for x in 0..PROBES {
                let cell = DVec2::new(f64::from(x), f64::from(y));
                let at = (cell + DVec2::new(rng.unit_f64(), rng.unit_f64())) / f64::from(PROBES);
                let p = DVec2::splat(0.5 - half) + at * (2.0 * half);
                let mut clearance = most;
                let _ = index.search(p, most, &mut |i| {
                    if let Some((q, r)) = index.get(i) {
                        clearance = clearance.min(p.distance(q) - r);
                    }
                    ControlFlow::Continue(())
                });
                clearances.push(clearance);
            }
        }
        clearances.sort_unstable_by(f64::total_cmp);
        Self(clearances)
    }

    /// The share of the plane where a disk finds room.
    fn share(&self, radius: f64) -> f64 {
        if self.0.is_empty() {
            return 1.0;
        }
        let blocked = self.0.partition_point(|c| *c < radius);
        1.0 - blocked as f64 / self.0.len() as f64
    }
}
