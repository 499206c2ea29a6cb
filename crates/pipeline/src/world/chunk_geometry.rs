//! The geometry of a chunk, ready for rays.

use std::sync::Arc;

use nemoral_raycast::{Blas, Group};
use nemoral_scene::InstancePlace;

use crate::pool::in_pool;

/// The ground of a chunk and all its objects with an id.
#[derive(Debug)]
pub struct ObjectGeometry {
    /// As they are in their season.
    pub group: Arc<Group>,
    /// The same in full leaf, if they are not: what grows below goes by it.
    pub in_full_leaf: Option<Arc<Group>>,
}

/// A chunk's undergrowth, seedlings and trail grass; `None` where nothing grows.
#[derive(Debug)]
pub struct UndergrowthGeometry(pub Option<Arc<Group>>);

/// A chunk's litter; `None` where none lies.
#[derive(Debug)]
pub struct LitterGeometry(pub Option<Arc<Group>>);

impl ObjectGeometry {
    /// From instances as they are and, if they differ, in full leaf.
    pub(crate) fn new(
        instances: Vec<(InstancePlace, Arc<Blas>)>,
        in_full_leaf: Option<Vec<(InstancePlace, Arc<Blas>)>>,
    ) -> Self {
        let build = |instances| Arc::new(in_pool(|| Group::build(instances)));
        Self {
            group: build(instances),
            in_full_leaf: in_full_leaf.map(build),
        }
    }
}

impl UndergrowthGeometry {
    pub(crate) fn new(instances: Vec<(InstancePlace, Arc<Blas>)>) -> Self {
        Self(group(instances))
    }
}

impl LitterGeometry {
    pub(crate) fn new(instances: Vec<(InstancePlace, Arc<Blas>)>) -> Self {
        Self(group(instances))
    }
}

/// The group of some instances, if there are any.
fn group(instances: Vec<(InstancePlace, Arc<Blas>)>) -> Option<Arc<Group>> {
    let is_bare = instances.is_empty();
    (!is_bare).then(|| Arc::new(in_pool(|| Group::build(instances))))
}
