//! Scenes that are ready for rays.

use nemoral_raycast::RayScene as Caster;
use nemoral_scene::{ChunkCoord, MaterialLibrary, ObjectId};

/// The objects of a chunk, as which instances are numbered.
const ITEMS: u32 = 65_535;

/// A scene that is ready for rays.
pub(crate) struct Built {
    pub(crate) caster: Caster,
    pub(crate) materials: MaterialLibrary,
    /// Mesh, semantic and instance of each placed shape.
    pub(crate) labels: Vec<[u32; 3]>,
}

impl Built {
    /// Semantic and instance of an object; 0 for none.
    pub(crate) fn labels(&self, object: ObjectId) -> [u32; 2] {
        if object.is_none() {
            return [0; 2];
        }
        let number = object.chunk().x as u32 * ITEMS + u32::from(object.item()) - 1;
        let [_, semantic, instance] = self.labels[number as usize];
        [semantic, instance]
    }
}

/// The number of an instance as an object.
pub(crate) fn object(number: usize) -> Option<ObjectId> {
    let number = u32::try_from(number).ok()?;
    let chunk = ChunkCoord::new(i32::try_from(number / ITEMS).ok()?, 0);
    ObjectId::new(chunk, (number % ITEMS + 1) as u16)
}
