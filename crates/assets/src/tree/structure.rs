//! The wood of a tree as a graph of nodes with radii, as structure models describe it.

use nemoral_scene::glam::DVec3;

use super::skeleton::Axis;

/// A point of the wood's centre line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WoodNode {
    /// Where it is, metres; the tree's foot is the origin, z is up.
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

    /// Volume of the wood over bark, m³: of the cones between nodes of the same axis.
    #[must_use]
    pub fn volume_m3(&self) -> f64 {
        let cone = |node: &WoodNode| {
            let parent = &self.nodes[node.parent? as usize];
            (parent.axis == node.axis).then(|| {
                let (a, b) = (parent.radius_m, node.radius_m);
                let length_m = parent.position_m.distance(node.position_m);
                std::f64::consts::PI / 3.0 * length_m * (a * a + a * b + b * b)
            })
        };
        self.nodes.iter().filter_map(cone).sum()
    }
}
