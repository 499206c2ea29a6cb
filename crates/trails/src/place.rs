//! What trails make of a place.

use std::cell::OnceCell;
use std::fmt;

use glam::DVec2;
use nemoral_scene::{Dual, Surface, SurfaceSample};

use crate::TrailSurfaceKind;
use crate::curve::smoothstep;
use crate::earthwork::REACH_M;
use crate::earthwork_layer::{Around, Layer, Strand, nearest, union};
use crate::section::Part;
use crate::value_noise::ValueNoise2d;
use crate::zone::TrailZone;

/// The distance from the edge of a way within which what another earthwork changes fades, metres.
const MERGE_M: f64 = 2.0;

/// How far the borders of materials are moved to and fro where kinds of way meet, metres.
const RAGGED_M: f64 = 0.35;

/// How far they are moved along a way, metres.
const RAGGED_ALONG: f64 = 1.6;

/// The least change of the ground that counts as a slope, metres.
const TOUCH_M: f64 = 0.02;

/// A place on a [`TrailGround`](crate::TrailGround), with the trails around it.
pub struct TrailPlace<'a> {
    base: &'a dyn Surface,
    /// How materials end, if they do so raggedly.
    ragged: Option<&'a ValueNoise2d>,
    world_m: DVec2,
    /// The layers that have a trail within reach.
    around: Vec<Near<'a>>,
    /// The ground without trails, which is sampled once if it is asked for.
    natural: OnceCell<SurfaceSample>,
    carved: OnceCell<Option<Dual>>,
}

impl fmt::Debug for TrailPlace<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TrailPlace")
            .field("world_m", &self.world_m)
            .finish_non_exhaustive()
    }
}

/// A layer that has trails near a point, and these.
struct Near<'a> {
    layer: &'a Layer,
    here: Around<'a>,
}

impl<'a> TrailPlace<'a> {
    pub(crate) fn new(
        layers: &'a [Layer],
        base: &'a dyn Surface,
        ragged: Option<&'a ValueNoise2d>,
        world_m: DVec2,
    ) -> Self {
        let near = layers.iter().filter_map(|layer| {
            let here = layer.around(world_m)?;
            Some(Near { layer, here })
        });
        Self {
            base,
            ragged,
            world_m,
            around: near.collect(),
            natural: OnceCell::new(),
            carved: OnceCell::new(),
        }
    }

    /// Where it is in the world, metres.
    #[must_use]
    pub fn world_m(&self) -> DVec2 {
        self.world_m
    }

    /// Signed distance to the edge of the union of trail surfaces, metres: negative on a trail,
    /// `f64::INFINITY` farther than 12 m from all.
    #[must_use]
    pub fn edge_m(&self) -> f64 {
        self.edge().0
    }

    /// [`edge_m`](Self::edge_m) and its gradient, which is zero where that is infinite.
    #[must_use]
    pub fn edge(&self) -> (f64, DVec2) {
        match outline(&self.around) {
            Some(edge) if edge.value < REACH_M => (edge.value, edge.gradient),
            _ => (f64::INFINITY, DVec2::ZERO),
        }
    }

    /// The part of a trail at this position; where trails meet, that of the nearest one.
    #[must_use]
    pub fn zone(&self) -> TrailZone {
        self.beside(part(&self.around).map(|p| p.zone))
    }

    /// Signed distance to the nearest border between parts of trails, slopes counting as untouched
    /// ground, metres: negative on surface and strip, positive in ruts and off the trails,
    /// `f64::INFINITY` farther than 12 m from all. Parts that touch differ in sign, so a mesh that
    /// is cut along its zeros follows every border. It changes by up to 1.42 per metre in rounded
    /// corners, and up to 2.5 inside of the tightest bends.
    #[must_use]
    pub fn border_m(&self) -> f64 {
        match part(&self.around) {
            Some(p) if is_negative(p.zone) => -p.border_m,
            Some(p) if p.border_m < REACH_M => p.border_m,
            _ => f64::INFINITY,
        }
    }

    /// [`zone`](Self::zone) for a piece of a mesh that is cut along the borders: the nearest part
    /// on its side of them, whatever the rounding of its middle.
    #[must_use]
    pub fn zone_on_side(&self, negative: bool) -> TrailZone {
        self.beside(part(&self.around).map(|p| {
            if is_negative(p.zone) == negative {
                p.zone
            } else {
                p.beyond
            }
        }))
    }

    /// The material of the trail here; `None` farther than 5 cm outside.
    #[must_use]
    pub fn kind(&self) -> Option<TrailSurfaceKind> {
        outline(&self.around).filter(|e| e.value <= 0.05)?;
        let ragged = self.ragged.map_or(0.0, |ragged| ragged.at(self.world_m));
        let strand = topmost(&self.around, ragged)?;
        let along_m = if strand.path.way().change > 0.0 {
            RAGGED_ALONG * ragged
        } else {
            0.0
        };
        Some(strand.path.kind(strand.foot.arc + along_m))
    }

    /// The number of the kind of the way here among the parameters' ways; `None` outside.
    #[must_use]
    pub fn way_number(&self) -> Option<usize> {
        outline(&self.around).filter(|e| e.value <= 0.0)?;
        topmost(&self.around, 0.0).map(|s| s.path.way_number())
    }

    /// Whether a disk reaches into a ditch.
    #[must_use]
    pub fn is_in_ditch(&self, radius_m: f64) -> bool {
        let mut strands = self.around.iter().flat_map(|near| &near.here.strands);
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
    pub fn offset_m(&self) -> Option<f64> {
        let strands = (self.around.iter()).filter_map(|near| nearest(near.here.strands.iter()));
        let strand = strands
            .min_by(|a, b| a.edge.value.total_cmp(&b.edge.value))
            .filter(|s| s.edge.value < REACH_M)?;
        let side = strand.foot.away.dot(strand.foot.left);
        Some(strand.foot.distance.copysign(side))
    }

    /// The ground with its trails carved in.
    #[must_use]
    pub fn sample(&self) -> SurfaceSample {
        match self.carved() {
            Some(z) => SurfaceSample {
                height_m: z.value,
                gradient: z.gradient,
            },
            None => self.natural(),
        }
    }

    /// Distinguishes slopes from untouched ground beside the surfaces of trails.
    fn beside(&self, zone: Option<TrailZone>) -> TrailZone {
        let is_slope = || {
            let carved = self.carved();
            carved.is_some_and(|z| (z.value - self.natural().height_m).abs() > TOUCH_M)
        };
        match zone {
            Some(TrailZone::Off) if is_slope() => TrailZone::CutSlope,
            Some(zone) => zone,
            None => TrailZone::Off,
        }
    }

    fn natural(&self) -> SurfaceSample {
        *(self.natural).get_or_init(|| self.base.sample(self.world_m))
    }

    /// The ground carved; `None` where it is the natural one.
    fn carved(&self) -> Option<Dual> {
        *self.carved.get_or_init(|| {
            let natural = || {
                let SurfaceSample { height_m, gradient } = self.natural();
                Dual::new(height_m, gradient)
            };
            carved(self.world_m, &self.around, &natural)
        })
    }
}

/// The part of a trail at a point with these trails around.
fn part(around: &[Near<'_>]) -> Option<Part> {
    let edge = outline(around)?.value;
    let mut before = f64::INFINITY;
    for near in around.iter().filter(|_| edge < 0.0) {
        let strand = nearest(near.here.strands.iter())?;
        if near.here.edge.value < 0.0 {
            // Ruts end where a way that is listed before has its edge.
            let bound = near.here.edge.value.max(-before);
            return Some(strand.path.way().part(&strand.foot, edge, bound));
        }
        before = before.min(near.here.edge.value);
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
    for Near { layer, here } in around {
        let fade = joined(&before).map(|edge| {
            let t = (edge.value / MERGE_M).clamp(0.0, 1.0);
            edge.chain((smoothstep(t), 6.0 * t * (1.0 - t) / MERGE_M))
        });
        if fade.is_none_or(|f| f.value > 0.0)
            && let Some(carved) = layer.carved(p, here, natural)
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
        before.push((here.edge, layer.fillet_m()));
    }
    ground
}

/// Signed distance to the union of the trails of all layers.
fn outline(around: &[Near<'_>]) -> Option<Dual> {
    let edges: Vec<_> = (around.iter())
        .map(|n| (n.here.edge, n.layer.fillet_m()))
        .collect();
    joined(&edges)
}

/// The union of outlines with the radii of their inner corners: the nearest of what each two of
/// them are together, so that a third one that is far away changes nothing.
fn joined(edges: &[(Dual, f64)]) -> Option<Dual> {
    let nearest = |a: Dual, b: Dual| if b.value < a.value { b } else { a };
    let pair = |i: usize, j: usize| {
        let ((a, fillet_a), (b, fillet_b)) = (edges[i], edges[j]);
        union(a, b, Dual::constant(1.0), fillet_a.min(fillet_b))
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
    let near = match around
        .iter()
        .find(|n| n.here.edge.value < RAGGED_M * ragged)
    {
        Some(near) => near,
        None => (around.iter()).min_by(|a, b| a.here.edge.value.total_cmp(&b.here.edge.value))?,
    };
    let edge = |s: &Strand<'_>| s.edge.value + RAGGED_M * ragged * s.path.way_number() as f64;
    (near.here.strands.iter()).min_by(|a, b| edge(a).total_cmp(&edge(b)))
}

/// The side of [`TrailPlace::border_m`] that a part is on.
fn is_negative(zone: TrailZone) -> bool {
    matches!(zone, TrailZone::Surface | TrailZone::Strip)
}
