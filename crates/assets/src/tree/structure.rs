//! The wood of a tree as a graph of nodes with radii, as structure models describe it.

use nemoral_scene::glam::DVec3;

use super::skeleton::Axis;
use super::wood::Frustum;

/// A point of the wood's centre line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WoodNode {
    /// Where it is, metres; the tree's foot is the origin, z is up. The stem's first nodes are
    /// below the ground.
    pub position_m: DVec3,
    /// The wood's radius over bark there, without the root flare, metres.
    pub radius_m: f64,
    /// The node that is next on the way to the foot. A branch's first node lies on the centre line
    /// of what bears it, and this is the node there that is nearest. The stem's first has none.
    pub parent: Option<u32>,
    /// The axis: all nodes from the base of a stem, branch or twig to its tip have the same.
    pub axis: u32,
    /// The branching order: 0 for the stem, 1 for its branches, and so on.
    pub order: u8,
    /// Whether it is dead wood.
    pub is_dead: bool,
}

/// The wood of a tree as a graph: a quantitative structure model (Raumonen et al. 2013, "Fast
/// automatic precision tree models from terrestrial laser scanner data") that is the truth. Between
/// a node and its parent, the wood is a truncated cone.
///
/// Twigs that a budget of triangles leaves out of the mesh are in it all the same.
#[derive(Clone, Debug, PartialEq)]
pub struct TreeStructure {
    /// The nodes, a parent before all that it bears.
    pub nodes: Vec<WoodNode>,
}

impl TreeStructure {
    pub(super) fn new(axes: &[Axis], radii: &[Vec<f64>]) -> Self {
        let mut firsts = Vec::with_capacity(axes.len());
        let mut nodes: Vec<WoodNode> = Vec::new();
        for (i, (axis, radii)) in axes.iter().zip(radii).enumerate() {
            let first = nodes.len();
            firsts.push(first);
            let base = axis.parent.map(|(bearer, at)| {
                let last = axes[bearer].points.len() - 1;
                (firsts[bearer] + (at.round() as usize).min(last)) as u32
            });
            let points = axis.points.iter().zip(radii).enumerate();
            nodes.extend(points.map(|(k, (&position_m, &radius_m))| WoodNode {
                position_m,
                radius_m,
                parent: match k {
                    0 => base,
                    _ => Some((first + k - 1) as u32),
                },
                axis: i as u32,
                order: axis.order as u8,
                is_dead: axis.dead,
            }));
        }
        Self { nodes }
    }

    /// Volume of the wood over bark above the ground, m³: of the cones between nodes of the same
    /// axis. What of a branch lies inside of the wood that bears it counts once.
    #[must_use]
    pub fn volume_m3(&self) -> f64 {
        let stem = self.stem().map(|piece| piece.volume_m3()).sum::<f64>();
        stem + self.branches().map(|piece| piece.volume_m3()).sum::<f64>()
    }

    /// The stem's cones above the ground.
    fn stem(&self) -> impl Iterator<Item = Frustum> {
        let stem = self.nodes.iter().filter(|node| node.order == 0);
        stem.filter_map(|node| {
            let from = &self.nodes[node.parent? as usize];
            let [low_m, high_m] = [from, node].map(|node| node.position_m.z);
            (high_m > 0.0).then(|| {
                let buried = (-low_m).max(0.0) / (high_m - low_m);
                between(from, node).without_first(buried)
            })
        })
    }

    /// The branches' cones, from the surface of what bears them.
    pub(super) fn branches(&self) -> impl Iterator<Item = Frustum> {
        // How much of the axis, from there on, is inside of what bears it.
        let mut inside_m = 0.0;
        let nodes = self.nodes.iter().filter(|node| node.order > 0);
        nodes.filter_map(move |node| {
            let parent = node.parent? as usize;
            let from = &self.nodes[parent];
            if from.axis != node.axis {
                // What goes on where its bearer ends is outside from the start.
                let is_end = (self.nodes.get(parent + 1)).is_none_or(|n| n.axis != from.axis);
                inside_m = if is_end { 0.0 } else { from.radius_m };
                return None;
            }
            let cone = between(from, node);
            let share = (inside_m / cone.length_m).min(1.0);
            inside_m -= share * cone.length_m;
            (share < 1.0).then(|| cone.without_first(share))
        })
    }
}

/// The wood between two nodes of an axis.
fn between(from: &WoodNode, to: &WoodNode) -> Frustum {
    Frustum {
        length_m: from.position_m.distance(to.position_m),
        diameters_m: [2.0 * from.radius_m, 2.0 * to.radius_m],
    }
}
