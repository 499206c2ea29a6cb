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
    /// The same in full leaf and without snow, if they are not so: what grows, grew under these.
    in_summer: Option<Arc<Group>>,
}

/// A chunk's undergrowth, seedlings and trail grass; `None` where nothing grows.
#[derive(Debug)]
pub struct UndergrowthGeometry(pub Option<Arc<Group>>);

/// A chunk's litter; `None` where none lies.
#[derive(Debug)]
pub struct LitterGeometry(pub Option<Arc<Group>>);

impl ObjectGeometry {
    /// As they are in summer.
    #[must_use]
    pub fn in_summer(&self) -> &Arc<Group> {
        self.in_summer.as_ref().unwrap_or(&self.group)
    }

    /// From instances as they are and, if they differ, as they are in summer.
    pub(crate) fn new(
        instances: Vec<(InstancePlace, Arc<Blas>)>,
        in_summer: Option<Vec<(InstancePlace, Arc<Blas>)>>,
    ) -> Self {
        let build = |instances| Arc::new(in_pool(|| Group::build(instances)));
        Self {
            group: build(instances),
            in_summer: in_summer.map(build),
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
