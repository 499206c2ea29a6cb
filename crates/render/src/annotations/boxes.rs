//! Boxes around objects, in the picture and in space.

use std::collections::BTreeMap;

use glam::{DMat3, DQuat, DVec2, DVec3, Mat3, Vec3};
use nemoral_scene::{
    Bounds, Image, ObjectBox, ObjectId, ObjectKind, PixelBox, Ray, RayCaster, RigidTransform,
    TruthImages,
};
use rayon::prelude::*;

use super::pixel_centre;
use crate::View;

/// An object that may get a box.
#[derive(Clone, Copy, Debug)]
pub struct BoxCandidate {
    /// The object.
    pub object: ObjectId,
    /// What it is.
    pub kind: ObjectKind,
    /// The transform to the scene's frame from that of an upright box around the object, whose
    /// origin is the middle of the box.
    pub scene_from_box: RigidTransform,
    /// Length, width and height of that box, metres.
    pub size_m: DVec3,
}

impl BoxCandidate {
    /// An object with the upright box around its placed shape, turned like the shape.
    ///
    /// `foot_m` is the position of the shape's origin in the scene, `linear` the linear map from
    /// the shape's axes to the scene's, and `bounds` the box around the shape in its own frame.
    #[must_use]
    pub fn around(
        object: ObjectId,
        kind: ObjectKind,
        foot_m: DVec3,
        linear: &Mat3,
        bounds: Bounds,
    ) -> Self {
        let (scene_from_box, size_m) = upright_box(foot_m, linear, bounds);
        Self {
            object,
            kind,
            scene_from_box,
            size_m,
        }
    }
}

/// The frame and size of the upright box around a placed shape.
fn upright_box(foot_m: DVec3, linear: &Mat3, b: Bounds) -> (RigidTransform, DVec3) {
    let linear: DMat3 = linear.as_dmat3();
    let yaw_rad = libm::atan2(linear.x_axis.y, linear.x_axis.x);
    let turned = RigidTransform::from_xyz_rpy(DVec3::ZERO, 0.0, 0.0, yaw_rad).rotation;
    let back: DQuat = turned.inverse();
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for i in 0..8 {
        let pick = |bit: u32, low: f32, high: f32| if i >> bit & 1 == 0 { low } else { high };
        let corner = Vec3::new(
            pick(0, b.min.x, b.max.x),
            pick(1, b.min.y, b.max.y),
            pick(2, b.min.z, b.max.z),
        );
        let p = back * (linear * corner.as_dvec3());
        (low, high) = (low.min(p), high.max(p));
    }
    let scene_from_box = RigidTransform {
        rotation: turned,
        translation_m: foot_m + turned * ((low + high) / 2.0),
    };
    (scene_from_box, high - low)
}

/// The boxes of those objects that the picture would show in at least one pixel if they stood alone
/// on the ground.
///
/// `ground_m` is the distance of the ground on each pixel's ray
/// ([`nearest_objects`](crate::nearest_objects) of the ground); `alone` gives the caster of a
/// single object, by its number. `max_range_m` is that of the picture.
#[must_use]
pub fn object_boxes<C: RayCaster>(
    candidates: &[BoxCandidate],
    alone: impl Fn(usize) -> C + Sync,
    ground_m: &Image<(f32, ObjectId)>,
    truth: &TruthImages,
    view: &View,
    max_range_m: f32,
) -> Vec<ObjectBox> {
    let mut seen: BTreeMap<ObjectId, (u32, PixelBox)> = BTreeMap::new();
    let width = truth.object.width();
    for (i, object) in truth.object.pixels().iter().enumerate() {
        if !object.is_none() {
            let (count, bounds) = seen.entry(*object).or_insert((0, PixelBox::EMPTY));
            *count += 1;
            *bounds = bounds.with((i % width) as u32, (i / width) as u32);
        }
    }
    // A pixel's ray is the same for all objects.
    let to_ground: Vec<Ray> = (ground_m.pixels().par_iter().enumerate())
        .map(|(i, (ground_m, _))| {
            view.ray(
                pixel_centre(i % width, i / width),
                ground_m.min(max_range_m),
            )
        })
        .collect();
    let camera_from_scene = view.scene_from_camera.inverse();
    let boxed = |(i, c): (usize, &BoxCandidate)| {
        // What grows on an object, such as moss, bears its id and may lie beyond its own box.
        let shown = seen.get(&c.object).map(|(_, pixels)| *pixels);
        let range = match (bounds_in_image(c, view), shown) {
            (Some(box_px), Some(shown)) => box_px.union(shown),
            (range, shown) => range.or(shown)?,
        };
        let (left, right) = (range.left as usize, range.right as usize);
        let rays: Vec<Ray> = (range.top as usize..range.bottom as usize)
            .flat_map(|y| &to_ground[y * width + left..y * width + right])
            .copied()
            .collect();
        let mut met = vec![false; rays.len()];
        alone(i).are_occluded(&rays, &mut met);
        let (mut count, mut whole) = (0, PixelBox::EMPTY);
        let of_row = range.right - range.left;
        for (i, met) in (0..).zip(met) {
            let (x, y) = (range.left + i % of_row, range.top + i / of_row);
            // Pixels that show the object count too: by what grows on it, or because a GPU's border
            // lies one pixel beside that of the rays.
            if met || *truth.object.at(x as usize, y as usize) == c.object {
                count += 1;
                whole = whole.with(x, y);
            }
        }
        let (visible_px, visible) = seen.get(&c.object).map_or((0, None), |s| (s.0, Some(s.1)));
        let camera_from_box = camera_from_scene * c.scene_from_box;
        (count > 0).then_some(ObjectBox {
            object: c.object,
            kind: c.kind,
            visible,
            whole,
            visible_px,
            whole_px: count,
            centre_m: camera_from_box.translation_m,
            size_m: c.size_m,
            camera_from_box: camera_from_box.rotation,
        })
    };
    let mut boxes: Vec<ObjectBox> = candidates
        .par_iter()
        .enumerate()
        .filter_map(boxed)
        .collect();
    boxes.sort_by_key(|b| b.object);
    boxes
}

/// The pixels that may show the object: those around its box, or all if the box reaches behind the
/// lens.
fn bounds_in_image(c: &BoxCandidate, view: &View) -> Option<PixelBox> {
    /// Number of points on an edge of the box, because lenses bend edges.
    const STEPS: u32 = 6;
    let k = &view.intrinsics;
    let size = DVec2::new(k.width.into(), k.height.into());
    let camera_from_box = view.scene_from_camera.inverse() * c.scene_from_box;
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    let (mut behind, mut before) = (false, false);
    let part = |i: u32| f64::from(i) / f64::from(STEPS) - 0.5;
    for i in 0..=STEPS {
        for j in 0..=STEPS {
            for l in 0..=STEPS {
                let inner = |n: u32| n != 0 && n != STEPS;
                if inner(i) && inner(j) && inner(l) {
                    continue;
                }
                let corner = DVec3::new(part(i), part(j), part(l)) * c.size_m;
                let p = camera_from_box.transform_point(corner);
                match k
                    .project_moving(p, &view.shutter, &view.motion)
                    .filter(|_| p.z > 0.05)
                {
                    Some(at) => {
                        before = true;
                        (low, high) = (low.min(at), high.max(at));
                    }
                    None => behind = true,
                }
            }
        }
    }
    if !before {
        return None;
    }
    let (low, high) = if behind {
        (DVec2::ZERO, size)
    } else {
        // An edge may bulge between the points.
        let spare = (high - low) * 0.05 + 1.0;
        ((low - spare).max(DVec2::ZERO), (high + spare).min(size))
    };
    (low.cmplt(high).all()).then(|| PixelBox {
        left: low.x as u32,
        top: low.y as u32,
        right: high.x.ceil() as u32,
        bottom: high.y.ceil() as u32,
    })
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use nemoral_scene::{ChunkCoord, Hit, Intrinsics, Semantic};

    use super::*;

    /// A half space, to the right of a plane through the lens.
    struct Right;

    impl RayCaster for Right {
        fn closest_hit(&self, _: &Ray) -> Option<Hit> {
            unreachable!("boxes ask only whether something is there")
        }

        fn is_occluded(&self, ray: &Ray) -> bool {
            ray.direction.y < 0.0
        }
    }

    #[test]
    fn a_box_holds_what_the_picture_shows_beside_the_rays() {
        let object = ObjectId::new(ChunkCoord::new(0, 0), 1).expect("in range");
        let view = View::new(
            Intrinsics::from_fov(8, 4, 1.0).expect("valid"),
            RigidTransform::body_from_optical(),
        );
        let thing = BoxCandidate {
            object,
            kind: ObjectKind::Tree,
            scene_from_box: RigidTransform::from_xyz_rpy(DVec3::X * 5.0, 0.0, 0.0, 0.0),
            size_m: DVec3::splat(20.0),
        };
        // In one of the rows the border in the picture lies one pixel to the left of the middle.
        let shown = |i: usize| if i == 11 { object } else { ObjectId::NONE };
        let all = |i: f32| Image::new(8, 4, vec![i; 32]);
        let truth = TruthImages {
            semantic: all(0.0).map(|_| Semantic::Stem),
            object: Image::new(8, 4, (0..32).map(shown).collect()),
            depth_m: all(1.0),
            normal: all(0.0).map(|_| Vec3::Z),
        };
        let ground_m = all(9.0).map(|far| (*far, ObjectId::NONE));
        let boxes = object_boxes(&[thing], |_| Right, &ground_m, &truth, &view, 9.0);
        let [b] = boxes[..] else { panic!("{boxes:?}") };
        assert_eq!((b.visible_px, b.whole_px), (1, 17));
        assert_eq!((b.whole.left, b.whole.right), (3, 8));
    }
}
