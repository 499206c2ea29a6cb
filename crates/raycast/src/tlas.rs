//! The top-level acceleration structure: a tree over the groups of a scene.

use std::sync::Arc;

use glam::Vec3;

use crate::bvh8::{self, BuildEffort};
use crate::group::Group;
use crate::node::{Node, bounds_of, extent};

/// Groups placed in a scene, and the tree over them, which is the only one made anew for a frame.
#[derive(Clone, Debug)]
pub(crate) struct Tlas {
    pub(crate) groups: Vec<(Vec3, Arc<Group>)>,
    pub(crate) nodes: Vec<Node>,
    /// `None` if there is nothing to hit.
    pub(crate) root: Option<u32>,
    /// The largest coordinate of any box, in absolute value.
    pub(crate) extent: f32,
}

/// The tree over a frame's groups is small.
const EFFORT: BuildEffort = BuildEffort {
    passes: 1,
    share: 1.0,
};

impl Tlas {
    /// Builds the tree over groups, each with the offset of its frame in the scene.
    pub(crate) fn build(groups: Vec<(Vec3, Arc<Group>)>) -> Self {
        let mut numbers = Vec::new();
        let mut boxes = Vec::new();
        for (i, (offset, group)) in groups.iter().enumerate() {
            if let Some(b) = group.bounds() {
                let at = |p: Vec3| p.as_dvec3() + offset.as_dvec3();
                numbers.push(i as u32);
                boxes.push(bounds_of([at(b.min), at(b.max)]));
            }
        }
        let mut nodes = Vec::new();
        let leaf = |b: &[u32]| numbers[b[0] as usize];
        let root = (!boxes.is_empty()).then(|| bvh8::build(&boxes, 1, EFFORT, &mut nodes, leaf));
        Self {
            groups,
            nodes,
            root,
            extent: boxes.iter().map(extent).fold(0.0, f32::max),
        }
    }
}
