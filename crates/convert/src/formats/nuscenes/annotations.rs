//! The boxes of a frame: the union over its cameras, in the world.

use std::collections::BTreeMap;

use nemoral_dataset::LidarFrame;
use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_scene::{ChunkCoord, ObjectBox, ObjectId, ObjectKind, RigidTransform};
use serde::{Deserialize, Serialize};

use super::scenes::Scene;
use crate::{Error, FrameRef, Source};

/// A box in the world, as a frame's step leaves it for the tables.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Annotation {
    /// The object's true id.
    pub(super) object: u64,
    /// The object's id in instance maps.
    pub(super) image_id: u32,
    #[serde(with = "by_name")]
    pub(super) kind: ObjectKind,
    pub(super) centre_m: [f64; 3],
    /// Width, length, height.
    pub(super) size_m: [f64; 3],
    /// w, x, y, z.
    pub(super) rotation: [f64; 4],
    /// The greatest share of the object that a camera sees.
    visible_fraction: f64,
    /// The points of the first LiDAR that are the object's.
    pub(super) points: u32,
}

impl Annotation {
    fn of(world_from_camera: &RigidTransform, b: &ObjectBox) -> Self {
        let world_from_box = *world_from_camera
            * RigidTransform {
                rotation: b.camera_from_box,
                translation_m: b.centre_m,
            };
        let forward = (world_from_box.rotation * DVec3::X).truncate();
        let [length, width, height] = b.size_m.to_array();
        Self {
            object: b.object.to_u64(),
            image_id: b.object.to_image_id(),
            kind: b.kind,
            // Adding zero turns -0 into 0.
            centre_m: world_from_box.translation_m.to_array().map(|v| v + 0.0),
            size_m: [width, length, height],
            rotation: about_up(forward.normalize_or(DVec2::X)).map(|v| v + 0.0),
            visible_fraction: b.visible_fraction(),
            points: 0,
        }
    }

    /// nuScenes' level of visibility: 1 up to 40 %, 2 up to 60 %, 3 up to 80 %, 4 above.
    pub(super) fn visibility(&self) -> usize {
        let shares = [0.4, 0.6, 0.8];
        1 + shares
            .iter()
            .filter(|s| self.visible_fraction > **s)
            .count()
    }
}

/// A kind of objects as its name.
mod by_name {
    use nemoral_scene::ObjectKind;
    use serde::de::Error as _;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(super) fn serialize<S: Serializer>(kind: &ObjectKind, to: S) -> Result<S::Ok, S::Error> {
        kind.name().serialize(to)
    }

    pub(super) fn deserialize<'a, D: Deserializer<'a>>(from: D) -> Result<ObjectKind, D::Error> {
        let name = String::deserialize(from)?;
        let kind = ObjectKind::ALL.iter().find(|kind| kind.name() == name);
        kind.copied().ok_or_else(|| D::Error::custom("no kind"))
    }
}

/// The quaternion w, x, y, z of the rotation about the world's up that takes x to this direction.
/// Boxes are upright; what four digits of a data set's files leave of a tilt goes.
fn about_up(forward: DVec2) -> [f64; 4] {
    // Half of the angle, by the root that loses no digits.
    if forward.x >= 0.0 {
        let w = (0.5 * (1.0 + forward.x)).sqrt();
        [w, 0.0, 0.0, 0.5 * forward.y / w]
    } else {
        let z = (0.5 * (1.0 - forward.x)).sqrt().copysign(forward.y);
        [0.5 * forward.y / z, 0.0, 0.0, z]
    }
}

/// The boxes of a frame, by object. An object that several cameras see has the box that the first
/// of them says, as all say the same.
pub(super) fn of_frame(
    source: &Source,
    scene: &Scene<'_>,
    frame: &FrameRef<'_>,
) -> Result<BTreeMap<u64, Annotation>, Error> {
    let mut found: BTreeMap<u64, Annotation> = BTreeMap::new();
    for (i, camera) in scene.sequence.cameras.iter().enumerate() {
        if !camera.annotations.boxes {
            continue;
        }
        let world_from_camera = frame.world_from_body() * camera.body_from_camera;
        for b in source.boxes(frame, i)? {
            let fraction = b.visible_fraction();
            let known = found.entry(b.object.to_u64());
            let known = known.or_insert_with(|| Annotation::of(&world_from_camera, &b));
            known.visible_fraction = known.visible_fraction.max(fraction);
        }
    }
    Ok(found)
}

/// Counts the points of each object in the first LiDAR's scan: by true ids if there is a PLY file,
/// else by the ids of `.label`, which number the objects around the sensor.
pub(super) fn count_points(
    scan: &LidarFrame,
    sensor_chunk: ChunkCoord,
    found: &mut BTreeMap<u64, Annotation>,
) {
    let mut counts: BTreeMap<u64, u32> = BTreeMap::new();
    if scan.ply.is_empty() {
        for &(_, instance) in &scan.labels {
            *counts.entry(instance.into()).or_default() += 1;
        }
        // 0 stands for all points of no object, and of objects that have no number.
        counts.remove(&0);
        for (&object, annotation) in found {
            let object = ObjectId::from_u64(object).expect("it was one");
            let label = object.to_label_id(sensor_chunk);
            annotation.points = counts.get(&label.into()).copied().unwrap_or(0);
        }
    } else {
        for p in &scan.ply {
            *counts.entry(p.point.object.to_u64()).or_default() += 1;
        }
        for (object, annotation) in found {
            annotation.points = counts.get(object).copied().unwrap_or(0);
        }
    }
}
