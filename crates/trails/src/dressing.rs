//! Grass, stones, roots, steps and culverts on trails and at their edges.

use glam::DVec2;

/// The kinds of dressing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum DressingKind {
    /// A tuft of grass or of another plant that tolerates being trodden on.
    Grass,
    /// A stone.
    Stone,
    /// A tuft of grass just beside the surface, whose blades hang over the edge.
    Verge,
    /// A mat of short grass and herbs between the ruts, which wheels and feet keep low.
    Strip,
    /// A root of a tree at the surface, which lies across the way.
    Root,
    /// A bed of stones, one beside the other, about a metre wide.
    Bed,
    /// A step of a log that lies across the way, with earth trodden level behind it.
    Step,
    /// An end of a culvert: the mouth of a pipe under the way, in its ditch or the slope below.
    Culvert,
}

/// A tuft, stone, root or the like that belongs to a trail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrailDressing {
    /// World position, metres.
    pub position_m: DVec2,
    /// Turn about the vertical; before, a root's and a step's axis lies along x, a step goes down
    /// along y, and a culvert opens along x.
    pub yaw_rad: f64,
    /// Size relative to the usual one: grass 0.6..1.2, on a verge 0.6..1.6, mats on a strip
    /// 0.5..1.3, stones lognormal, 0.9..2.5, roots 0.6..1.3, beds 0.8..1.15, steps the width of the
    /// way in metres, culverts 0.85..1.2.
    pub scale: f64,
    /// What it is.
    pub kind: DressingKind,
}
