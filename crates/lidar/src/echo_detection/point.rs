//! What a scan has of a return: where it seems to be, and what is known about it.

use nemoral_scene::glam::{DVec3, Vec3};
use nemoral_scene::{LidarPoint, ObjectId, PointFlags, RigidTransform};

use super::{BatchHits, NO_RAY, Return, towards};
use crate::pulse_batch::ScanContext;

impl ScanContext<'_> {
    /// The point of a return.
    pub(crate) fn point(&self, cast: &BatchHits<'_>, reported: &Return) -> LidarPoint {
        let shot = reported.shot as usize;
        let (pulse, pose) = (&cast.batch.pulses[shot], cast.batch.pose(shot));
        // The point lies along the pulse, not along its ray, whose f32 origin is micrometres off
        // the LiDAR's. A camera at the LiDAR's place, with the same f32 origin, looks along the
        // pulse too.
        let in_lidar = pulse.direction * reported.measured_m;
        let position = if self.params.deskew {
            let in_scene = pose.transform_point(in_lidar);
            self.lidar_from_scene.transform_point(in_scene)
        } else {
            in_lidar
        };
        let met = (reported.ray != NO_RAY).then(|| {
            let ray = reported.ray as usize;
            let (hit, towards) = match reported.mirrored {
                Some(number) => {
                    let m = &cast.mirrored[number as usize];
                    let towards = towards(&m.met, &m.path).as_vec3();
                    (&m.met, DVec3::from(m.image(towards)))
                }
                None => (cast.hit(ray), towards(cast.hit(ray), &cast.rays[ray])),
            };
            let normal = self.written(pose, towards);
            let material = self.materials.get(hit.material);
            (material.semantic, material.support, hit.object, normal)
        });
        let (semantic, support, object, normal) =
            met.unwrap_or((reported.of_none, None, ObjectId::NONE, Vec3::ZERO));
        LidarPoint {
            position_m: position.as_vec3(),
            true_range_m: reported.true_range_m,
            range_m: reported.measured_m as f32,
            intensity: reported.intensity,
            reflectivity: reported.reflectivity,
            semantic,
            object,
            ring: pulse.ring,
            return_number: reported.return_number,
            returns: reported.returns,
            time_ns: ((pulse.time_s - self.middle_s) * 1e9).round() as i64,
            pulse: cast.batch.start + reported.shot,
            incidence_cos: reported.incidence_cos,
            normal,
            flags: PointFlags(reported.flags.0 | PointFlags::of_support(support)),
        }
    }

    /// A vector of the scene in the frame that points are written in.
    fn written(&self, pose: &RigidTransform, in_scene: DVec3) -> Vec3 {
        let lidar_from_scene = if self.params.deskew {
            self.lidar_from_scene
        } else {
            pose.inverse()
        };
        lidar_from_scene.transform_vector(in_scene).as_vec3()
    }
}
