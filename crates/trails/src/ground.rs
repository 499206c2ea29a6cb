//! The ground with its trails carved in.

use std::cell::OnceCell;
use std::fmt;
use std::sync::Arc;

use glam::DVec2;
use nemoral_scene::{ChunkCoord, Surface, SurfaceSample};
use nemoral_seed::{Domain, Draw, Key};

use crate::dual::Dual;
use crate::layer::{Earthwork, Earthworks, Layer, REACH_M, Strand, nearest, union};
use crate::profile::smoothstep;
use crate::section::Part;
use crate::zone::TrailZone;
use crate::{TrailPath, TrailSurfaceKind};

const RAGGED: Domain = Domain::new("trails.ragged");

/// The distance from the edge of a way within which what another earthwork changes fades, metres.
const MERGE_M: f64 = 2.0;

/// How far the borders of materials are moved to and fro where kinds of way meet, metres.
const RAGGED_M: f64 = 0.35;

/// How far they are moved along a way, metres.
const RAGGED_ALONG: f64 = 1.6;

/// The size of the teeth, metres.
const RAGGED_CELL_M: f64 = 0.8;

/// The least change of the ground that counts as a slope, metres.
const TOUCH_M: f64 = 0.02;

/// The ground near a chunk with its trails carved in.
///
/// With t the height of the ground, d the distance to the edge of a trail, f the formation (the
/// smoothed, grade-limited ground along the trails' middles) and p the section's height above it:
///
/// z = min(max(t, f + p − F(d)), f + p + C(d)), with rounded corners,
///
/// where F and C rise with the fill and the cut ratio, and without bounds towards the way's reach
/// (12 m by default), so that a trail's influence ends there on any ground. Where trails meet, f is
/// the mean of their formations weighted smoothly by distance, and their outlines join with rounded
/// inner corners, so there are no steps. On a way that does not level the ground across, f follows
/// the ground. With a ditch, C starts at its far side, and p falls by its depth between.
///
/// Ways that are another earthwork carve the natural ground as if they were alone; what they change
/// is added, and fades over 2 m towards the edges of ways that are listed before them.
///
/// Every value depends only on the world position and on the trails within reach, so that grounds
/// made for neighbouring chunks agree to the bit.
pub struct TrailGround {
    base: Arc<dyn Surface>,
    key: Key,
    layers: Vec<Layer>,
    fine_m: f64,
    /// Whether materials end raggedly, where they change and where kinds of way meet.
    ragged: bool,
}

impl fmt::Debug for TrailGround {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TrailGround")
            .field("layers", &self.layers.len())
            .finish_non_exhaustive()
    }
}

/// The trails of a layer near a point, and the signed distance to their edges.
struct Near<'a> {
    layer: &'a Layer,
    strands: Vec<Strand<'a>>,
    edge: Dual,
}

impl TrailGround {
    /// `paths`, sorted by id, must be all that come within reach of the square.
    pub(crate) fn new(
        earthworks: &Earthworks,
        key: Key,
        base: Arc<dyn Surface>,
        paths: &[Arc<TrailPath>],
        square: (DVec2, DVec2),
        near: &dyn Fn(ChunkCoord) -> bool,
    ) -> Self {
        let layer = |earthwork: &Earthwork| {
            let is_of = |p: &&Arc<TrailPath>| earthwork.numbers.contains(&p.way_number());
            let paths: Vec<_> = paths.iter().filter(is_of).cloned().collect();
            (!paths.is_empty()).then(|| Layer::new(earthwork, paths, square, near))
        };
        Self {
            base,
            key: key.domain(RAGGED),
            layers: earthworks.all.iter().filter_map(layer).collect(),
            fine_m: earthworks.fine_m,
            ragged: earthworks.ragged,
        }
    }

    /// Signed distance to the edge of the union of trail surfaces, metres: negative on a trail,
    /// `f64::INFINITY` farther than 12 m from all.
    #[must_use]
    pub fn edge_m(&self, world_m: DVec2) -> f64 {
        match outline(&self.around(world_m)) {
            Some(edge) if edge.value < REACH_M => edge.value,
            _ => f64::INFINITY,
        }
    }

    /// [`edge_m`](Self::edge_m) and its gradient, which is zero where that is infinite.
    #[must_use]
    pub fn edge(&self, world_m: DVec2) -> (f64, DVec2) {
        match outline(&self.around(world_m)) {
            Some(edge) if edge.value < REACH_M => (edge.value, edge.gradient),
            _ => (f64::INFINITY, DVec2::ZERO),
        }
    }

    /// The part of a trail at this position; where trails meet, that of the nearest one.
    #[must_use]
    pub fn zone(&self, world_m: DVec2) -> TrailZone {
        let around = self.around(world_m);
        self.beside(world_m, &around, part(&around).map(|p| p.zone))
    }

    /// Signed distance to the nearest border between parts of trails, slopes counting as untouched
    /// ground, metres: negative on surface and strip, positive in ruts and off the trails,
    /// `f64::INFINITY` farther than 12 m from all. Parts that touch differ in sign, so a mesh that
    /// is cut along its zeros follows every border.
    #[must_use]
    pub fn border_m(&self, world_m: DVec2) -> f64 {
        match part(&self.around(world_m)) {
            Some(p) if is_negative(p.zone) => -p.border_m,
            Some(p) if p.border_m < REACH_M => p.border_m,
            _ => f64::INFINITY,
        }
    }

    /// [`zone`](Self::zone) for a piece of a mesh that is cut along the borders: the nearest part
    /// on its side of them, whatever the rounding of its middle.
    #[must_use]
    pub fn zone_on_side(&self, world_m: DVec2, negative: bool) -> TrailZone {
        let around = self.around(world_m);
        let zone = part(&around).map(|p| {
            if is_negative(p.zone) == negative {
                p.zone
            } else {
                p.beyond
            }
        });
        self.beside(world_m, &around, zone)
    }

    /// The distance from their edges within which ways have shapes as small as ruts and ditches,
    /// metres.
    #[must_use]
    pub fn fine_m(&self) -> f64 {
        self.fine_m
    }

    /// Distinguishes slopes from untouched ground beside the surfaces of trails.
    fn beside(&self, world_m: DVec2, around: &[Near<'_>], zone: Option<TrailZone>) -> TrailZone {
        match zone {
            Some(TrailZone::Off) => {
                let natural = self.natural(world_m);
                match carved(world_m, around, &natural) {
                    Some(z) if (z.value - natural().value).abs() > TOUCH_M => TrailZone::CutSlope,
                    _ => TrailZone::Off,
                }
            }
            Some(zone) => zone,
            None => TrailZone::Off,
        }
    }

    /// The material of the trail here; `None` farther than 5 cm outside.
    #[must_use]
    pub fn kind(&self, world_m: DVec2) -> Option<TrailSurfaceKind> {
        let around = self.around(world_m);
        outline(&around).filter(|e| e.value <= 0.05)?;
        let ragged = if self.ragged {
            self.ragged(world_m)
        } else {
            0.0
        };
        let strand = topmost(&around, ragged)?;
        let along_m = if strand.path.way().change > 0.0 {
            RAGGED_ALONG * ragged
        } else {
            0.0
        };
        Some(strand.path.kind(strand.foot.arc + along_m))
    }

    /// The number of the kind of the way here among the parameters' ways; `None` outside.
    #[must_use]
    pub fn way_number(&self, world_m: DVec2) -> Option<usize> {
        let around = self.around(world_m);
        outline(&around).filter(|e| e.value <= 0.0)?;
        topmost(&around, 0.0).map(|s| s.path.way_number())
    }

    /// Whether a disk reaches into a ditch.
    #[must_use]
    pub fn is_in_ditch(&self, world_m: DVec2, radius_m: f64) -> bool {
        let around = self.around(world_m);
        let mut strands = around.iter().flat_map(|near| &near.strands);
        strands.any(|strand| {
            let ditch = strand.path.way().ditch(&strand.foot);
            ditch.is_some_and(|(ditch, share)| {
                share.value > 0.0 && strand.edge.value - radius_m < ditch.width_m
            })
        })
    }

    /// Signed offset from the middle of the nearest trail, metres, positive to the left of its
    /// direction; `None` farther than 12 m from all edges.
    #[must_use]
    pub fn offset_m(&self, world_m: DVec2) -> Option<f64> {
        let around = self.around(world_m);
        let strands = around.iter().filter_map(|near| nearest(&near.strands));
        let strand = strands
            .min_by(|a, b| a.edge.value.total_cmp(&b.edge.value))
            .filter(|s| s.edge.value < REACH_M)?;
        let side = strand.foot.away.dot(strand.foot.left);
        Some(strand.foot.distance.copysign(side))
    }

    /// The layers that have a trail within reach.
    fn around(&self, p: DVec2) -> Vec<Near<'_>> {
        let near = self.layers.iter().filter_map(|layer| {
            let strands = layer.strands(p);
            let edge = union(strands.iter().map(|s| s.edge), layer.fillet_m())?;
            Some(Near {
                layer,
                strands,
                edge,
            })
        });
        near.collect()
    }

    /// The ground without trails, which is sampled once if it is asked for.
    fn natural(&self, p: DVec2) -> impl Fn() -> Dual + use<'_> {
        let natural = OnceCell::new();
        move || {
            *natural.get_or_init(|| {
                let base = self.base.sample(p);
                Dual::new(base.height_m, base.gradient)
            })
        }
    }

    /// Keyed noise of the plane in -1..=1, a metre across.
    fn ragged(&self, p: DVec2) -> f64 {
        let place = p / RAGGED_CELL_M;
        let cell = place.floor();
        let t = place - cell;
        let (x, y) = (smoothstep(t.x), smoothstep(t.y));
        let [a, b, c, d] = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| {
            let corner = [cell.x as i32 + i, cell.y as i32 + j];
            self.key.chunk(corner).rng().range_f64(-1.0, 1.0)
        });
        let (low, high) = (a + x * (b - a), c + x * (d - c));
        low + y * (high - low)
    }
}

/// The part of a trail at a point with these trails around.
fn part(around: &[Near<'_>]) -> Option<Part> {
    let edge = outline(around)?.value;
    let mut before = f64::INFINITY;
    for near in around.iter().filter(|_| edge < 0.0) {
        let strand = nearest(&near.strands)?;
        if near.edge.value < 0.0 {
            // Ruts end where a way that is listed before has its edge.
            let bound = near.edge.value.max(-before);
            return Some(strand.path.way().part(&strand.foot, edge, bound));
        }
        before = before.min(near.edge.value);
    }
    let (zone, beyond) = if edge < 0.0 {
        (TrailZone::Surface, TrailZone::Off)
    } else {
        (TrailZone::Off, TrailZone::Surface)
    };
    Some(Part {
        zone,
        border_m: edge.abs(),
        beyond,
    })
}

/// The ground with these trails around carved in; `None` where it is the natural one.
fn carved(p: DVec2, around: &[Near<'_>], natural: &dyn Fn() -> Dual) -> Option<Dual> {
    let (mut ground, mut before): (Option<Dual>, Vec<(Dual, f64)>) = (None, Vec::new());
    for Near {
        layer,
        strands,
        edge,
    } in around
    {
        let fade = joined(&before).map(|edge| {
            let t = (edge.value / MERGE_M).clamp(0.0, 1.0);
            edge.chain((smoothstep(t), 6.0 * t * (1.0 - t) / MERGE_M))
        });
        if fade.is_none_or(|f| f.value > 0.0)
            && let Some(carved) = layer.carved(p, strands, *edge, natural)
        {
            ground = Some(match (fade, ground) {
                // A layer that is too far away to matter may be known here and not in the next
                // chunk, so it must not change a bit.
                (None, _) => carved,
                (Some(fade), None) if fade.value >= 1.0 => carved,
                (Some(fade), before) => {
                    before.unwrap_or_else(natural) + fade * (carved - natural())
                }
            });
        }
        before.push((*edge, layer.fillet_m()));
    }
    ground
}

/// Signed distance to the union of the trails of all layers.
fn outline(around: &[Near<'_>]) -> Option<Dual> {
    let edges: Vec<_> = (around.iter())
        .map(|n| (n.edge, n.layer.fillet_m()))
        .collect();
    joined(&edges)
}

/// The union of outlines with the radii of their inner corners: the nearest of what each two of
/// them are together, so that a third one that is far away changes nothing.
fn joined(edges: &[(Dual, f64)]) -> Option<Dual> {
    let nearest = |a: Dual, b: Dual| if b.value < a.value { b } else { a };
    let pair = |i: usize, j: usize| {
        let ((a, fillet_a), (b, fillet_b)) = (edges[i], edges[j]);
        union([a, b].into_iter(), fillet_a.min(fillet_b)).unwrap_or(a)
    };
    let count = edges.len();
    let pairs = (0..count).flat_map(|i| (i + 1..count).map(move |j| (i, j)));
    match edges {
        [(only, _)] => Some(*only),
        _ => pairs.map(|(i, j)| pair(i, j)).reduce(nearest),
    }
}

/// The trail that is uppermost: of the first layer whose surface is here, the one whose edge is
/// nearest, where borders between kinds of way are moved by some noise.
fn topmost<'a>(around: &'a [Near<'a>], ragged: f64) -> Option<&'a Strand<'a>> {
    let near = match around.iter().find(|n| n.edge.value < RAGGED_M * ragged) {
        Some(near) => near,
        None => (around.iter()).min_by(|a, b| a.edge.value.total_cmp(&b.edge.value))?,
    };
    let edge = |s: &Strand<'_>| s.edge.value + RAGGED_M * ragged * s.path.way_number() as f64;
    (near.strands.iter()).min_by(|a, b| edge(a).total_cmp(&edge(b)))
}

impl Surface for TrailGround {
    fn sample(&self, world_m: DVec2) -> SurfaceSample {
        match carved(world_m, &self.around(world_m), &self.natural(world_m)) {
            Some(z) => SurfaceSample {
                height_m: z.value,
                gradient: z.gradient,
            },
            None => self.base.sample(world_m),
        }
    }
}

/// The side of [`TrailGround::border_m`] that a part is on.
fn is_negative(zone: TrailZone) -> bool {
    matches!(zone, TrailZone::Surface | TrailZone::Strip)
}
