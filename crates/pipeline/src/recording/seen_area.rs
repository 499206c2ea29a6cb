//! The part of the map that the sensors of a frame see, so that nothing grows behind their backs.

use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_scene::{ChunkCoord, DirectionCone, Intrinsics, RigidTransform};

use super::pose::FramePose;
use super::visible_reach::VisibleReach;
use crate::world::cameras::CameraRig;
use crate::world::ground::GroundModel;
use crate::world::lidars::LidarRig;
use crate::world::object_reach::ObjectReach;

/// How far beyond its sides an area goes on, metres, apart from the reach of objects out of the
/// chunk that they belong to: rippled water mirrors a little sideways, and roots, climbers and
/// patches of low plants are wide, too; a lamp is up to 22 m beside a camera, whose light it is.
const SPARE_M: f64 = 25.0;
/// How far beyond its sides the light is known, metres. It is as far as things are mirrored, and as
/// wide as the cells in which a GPU looks it up, 27 m across corners at the widest view.
const LIGHT_SPARE_M: f64 = 30.0;
/// How much wider than its field of view a sensor sees, radians: the sun's disc.
const SPARE_RAD: f64 = 0.02;
/// Pointing errors of more standard deviations than this are one in a million.
const RARE_SIGMAS: f64 = 5.3;
/// From this angle to the horizon on, a cone of directions is taken to go all around.
const STEEP_RAD: f64 = 1.4;
/// How much higher and lower the ground is elsewhere than where it is looked at, metres, if it is
/// asked which trees cast shadows, and how far those see who look down.
const SPARE_HEIGHT_M: f64 = 15.0;
/// Points of a picture's border from which its cone of directions is found, a side.
const BORDER_POINTS: u32 = 16;

/// How far a sensor sees.
#[derive(Clone, Copy, Debug)]
struct Limits {
    /// On the map, whatever it looks at, metres.
    reach_m: f64,
    /// The height of the lowest ground, metres.
    lowest_m: f64,
    /// How high above the lowest ground things are mirrored by water there, metres; 0 without
    /// water.
    mirrored_m: f64,
}

/// A sector of the map that contains what a sensor sees, and of a camera what casts shadows there.
#[derive(Clone, Copy, Debug)]
struct Sector {
    apex_m: DVec2,
    /// The normals of its two sides, outwards; `None` for a whole disc.
    sides: Option<[DVec2; 2]>,
    /// The radius, metres.
    reach_m: f64,
    /// How far what is seen may be on the map, metres: `reach_m`, or less for who looks down.
    seen_m: f64,
    /// The longest shadow, as a way on the map towards the sun. The disc is not moved by it, as
    /// nothing beyond the visible radius casts shadows.
    shadow_m: DVec2,
}

impl Sector {
    /// What is seen from a place in a cone of directions of the world.
    fn of_cone(origin_m: DVec3, cone: &DirectionCone, limits: Limits) -> Self {
        let reach_m = limits.reach_m;
        let axis = cone.axis;
        let half_rad = cone.half_angle_rad + SPARE_RAD;
        // The directions furthest from straight down meet the lowest ground this far away, and what
        // is mirrored there as far beyond as it is high.
        let outermost_rad = libm::acos(-axis.z.clamp(-1.0, 1.0)) + half_rad;
        let above_m = origin_m.z - limits.lowest_m;
        let seen_m = if outermost_rad < STEEP_RAD && above_m > 0.0 {
            libm::tan(outermost_rad) * (above_m + limits.mirrored_m)
        } else {
            reach_m
        };
        let steepest_rad = libm::asin(axis.z.clamp(-1.0, 1.0)).abs() + half_rad;
        let sides = (steepest_rad < STEEP_RAD).then(|| {
            // A circle on the sphere, seen from above, is this wide.
            let middle = axis.truncate();
            let level = middle.length();
            let half_width_rad = libm::asin(libm::sin(half_rad) / level);
            let left = DVec2::from_angle(half_width_rad).rotate(middle / level);
            let right = DVec2::from_angle(-half_width_rad).rotate(middle / level);
            [left.perp(), -right.perp()]
        });
        Self {
            apex_m: origin_m.truncate(),
            sides,
            reach_m,
            seen_m: seen_m.min(reach_m),
            shadow_m: DVec2::ZERO,
        }
    }

    /// Whether what belongs to a chunk, and reaches at most `spare_m` out of it, may come into it.
    fn includes(&self, chunk: ChunkCoord, chunk_size_m: f64, spare_m: f64) -> bool {
        let within_m = self.reach_m.min(self.seen_m + self.shadow_m.length());
        if chunk.distance_m(self.apex_m, chunk_size_m) > within_m + spare_m {
            return false;
        }
        let Some(sides) = self.sides else {
            return true;
        };
        let low = chunk.origin_m(chunk_size_m) - self.apex_m;
        sides.iter().all(|side| {
            // How far outside of this side the nearest corner is, or what its shadow falls on.
            let corner = low
                + DVec2::select(
                    side.cmplt(DVec2::ZERO),
                    DVec2::splat(chunk_size_m),
                    DVec2::ZERO,
                );
            side.dot(corner) - side.dot(self.shadow_m).max(0.0) <= spare_m
        })
    }
}

/// The part of the map that sensors of a frame see.
#[derive(Clone, Debug)]
pub(crate) struct SeenArea {
    chunk_size_m: f64,
    /// How far things reach out of their chunks, metres.
    spare_m: f64,
    sectors: Vec<Sector>,
}

impl SeenArea {
    /// All that cameras see from a pose of the body, and what casts shadows on it.
    pub(crate) fn of_cameras(
        rigs: &[CameraRig],
        pose: &FramePose,
        (ground, objects): (&GroundModel, ObjectReach),
        reach: &VisibleReach,
    ) -> Self {
        let (size_m, radius_m) = (reach.chunk_size_m, reach.visible_radius_m);
        let (low_m, high_m) = heights_m(ground, pose, reach);
        let blockers_m = high_m - low_m + 2.0 * SPARE_HEIGHT_M + objects.up_m;
        let of_rig = |rig: &CameraRig| {
            let half_s = rig.shutter.duration_s() / 2.0;
            let body = |time_s| pose.world_from_body() * pose.motion.after(time_s);
            let poses = [-half_s, 0.0, half_s].map(body);
            let mount = &rig.body_from_camera;
            let limits = Limits {
                reach_m: radius_m,
                lowest_m: low_m - SPARE_HEIGHT_M,
                // Ripples mirror what is anywhere.
                mirrored_m: if ground.has_water() {
                    f64::INFINITY
                } else {
                    0.0
                },
            };
            let mut sectors = Self::swept(&poses, mount, &cone(&rig.intrinsics), limits);
            let shadow_m = shadow(rig, blockers_m).filter(|_| !rig.looks_all_around);
            for sector in &mut sectors {
                match shadow_m {
                    Some(shadow_m) => sector.shadow_m = shadow_m,
                    None => (sector.sides, sector.seen_m) = (None, radius_m),
                }
            }
            sectors
        };
        Self {
            chunk_size_m: size_m,
            spare_m: objects.across_m + SPARE_M,
            sectors: rigs.iter().flat_map(of_rig).collect(),
        }
    }

    /// All that LiDARs see while the body moves.
    pub(crate) fn of_lidars(
        rigs: &[LidarRig],
        pose: &FramePose,
        (ground, objects): (&GroundModel, ObjectReach),
        reach: &VisibleReach,
    ) -> Self {
        let (low_m, high_m) = heights_m(ground, pose, reach);
        let highest_m = high_m - low_m + 2.0 * SPARE_HEIGHT_M + objects.up_m;
        let of_rig = |rig: &LidarRig| {
            let scanner = rig.scanner.params();
            let limits = Limits {
                reach_m: scanner.max_range_m.into(),
                lowest_m: low_m - SPARE_HEIGHT_M,
                // To lasers, ripples only weaken what is mirrored.
                mirrored_m: if ground.has_water() { highest_m } else { 0.0 },
            };
            let beam = &scanner.beam;
            let mut cone = rig.scanner.field_of_view();
            cone.half_angle_rad += RARE_SIGMAS * scanner.errors.angular_sigma_rad
                + beam.horizontal_fwhm_rad.max(beam.vertical_fwhm_rad);
            Self::swept(pose.track.poses(), &rig.body_from_lidar, &cone, limits)
        };
        Self {
            chunk_size_m: reach.chunk_size_m,
            spare_m: objects.across_m + SPARE_M,
            sectors: rigs.iter().flat_map(of_rig).collect(),
        }
    }

    /// The sectors of a sensor on a body that moves through these poses.
    fn swept(
        poses: &[RigidTransform],
        body_from_sensor: &RigidTransform,
        cone: &DirectionCone,
        limits: Limits,
    ) -> Vec<Sector> {
        let sensor = |body: &RigidTransform| *body * *body_from_sensor;
        let axis = |body: &RigidTransform| sensor(body).transform_vector(cone.axis);
        let turns = poses
            .windows(2)
            .map(|w| axis(&w[0]).angle_between(axis(&w[1])));
        let half_angle_rad = cone.half_angle_rad + turns.fold(0.0, f64::max);
        let seen = |body: &RigidTransform| {
            let cone = DirectionCone {
                axis: axis(body),
                half_angle_rad,
            };
            Sector::of_cone(sensor(body).translation_m, &cone, limits)
        };
        poses.iter().map(seen).collect()
    }

    /// Whether what belongs to a chunk is seen, or casts shadows on what is.
    pub(crate) fn includes(&self, chunk: ChunkCoord) -> bool {
        self.sectors
            .iter()
            .any(|sector| sector.includes(chunk, self.chunk_size_m, self.spare_m))
    }

    /// Whether anything is seen that is in the square of a chunk, whatever it belongs to.
    pub(crate) fn shows(&self, chunk: ChunkCoord) -> bool {
        self.sectors.iter().any(|sector| {
            let seen = Sector {
                shadow_m: DVec2::ZERO,
                ..*sector
            };
            seen.includes(chunk, self.chunk_size_m, LIGHT_SPARE_M)
        })
    }
}

/// The lowest and the highest middle or corner of a visible chunk, metres.
fn heights_m(ground: &GroundModel, pose: &FramePose, reach: &VisibleReach) -> (f64, f64) {
    let size_m = reach.chunk_size_m;
    let visible = ChunkCoord::within(pose.place().1, reach.visible_radius_m, size_m);
    let places_m = visible
        .iter()
        .flat_map(|at| [at.centre_m(size_m), at.origin_m(size_m)]);
    let heights_m = places_m.map(|place_m| ground.natural_height_m(place_m));
    heights_m.fold((f64::MAX, f64::MIN), |(low, high), z| {
        (low.min(z), high.max(z))
    })
}

/// The directions of a picture's pixels, in the optical frame.
fn cone(intrinsics: &Intrinsics) -> DirectionCone {
    let size = DVec2::new(intrinsics.width.into(), intrinsics.height.into());
    let border = (0..=BORDER_POINTS).flat_map(|i| {
        let t = f64::from(i) / f64::from(BORDER_POINTS);
        [(t, 0.0), (t, 1.0), (0.0, t), (1.0, t)]
    });
    let directions = border.map(|(x, y)| intrinsics.direction(DVec2::new(x, y) * size));
    DirectionCone::around(DVec3::Z, directions)
}

/// How far shadows of what is `height_m` high reach under a camera's sun, as a way towards it;
/// `None` if that is farther than can be said.
fn shadow(rig: &CameraRig, height_m: f64) -> Option<DVec2> {
    let lighting = rig.renderer.lighting();
    if lighting.sun_irradiance().max_element() <= 0.0 {
        return Some(DVec2::ZERO);
    }
    let sun = lighting.sun_direction().as_dvec3();
    (sun.z > 0.02).then(|| sun.truncate() * (height_m / sun.z))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nemoral_scene::Distortion;
    use nemoral_scene::glam::DQuat;
    use proptest::prelude::*;

    const CHUNK_M: f64 = 50.0;
    const REACH_M: f64 = 300.0;
    /// How far things reach out of their chunks.
    const OUT_M: f64 = 40.0;

    proptest! {
        #[test]
        fn a_sector_has_all_that_is_seen(
            (yaw, pitch) in (-3.2_f64..3.2, -1.5_f64..1.5),
            half_angle_rad in 0.05_f64..1.5,
            (turn, share) in (0.0_f64..6.3, 0.0_f64..=1.0),
            distance_m in 0.0..REACH_M,
            lowest_m in -60.0_f64..12.0,
            (sun, length_m, cast) in (0.0_f64..6.3, 0.0_f64..200.0, 0.0_f64..=1.0),
            (spare_m, way) in (0.0_f64..300.0, 0.0_f64..6.3),
        ) {
            let place_m = DVec3::new(17.0, -240.0, 12.0);
            let turned = DQuat::from_rotation_z(yaw) * DQuat::from_rotation_y(pitch);
            let cone = DirectionCone { axis: turned * DVec3::X, half_angle_rad };
            let limits = Limits { reach_m: REACH_M, lowest_m, mirrored_m: 0.0 };
            let mut sector = Sector::of_cone(place_m, &cone, limits);
            sector.shadow_m = DVec2::from_angle(sun) * length_m;
            let (around, aside) = (DQuat::from_rotation_x(turn), share * half_angle_rad);
            let ray = turned * around * DQuat::from_rotation_z(aside) * DVec3::X;
            let seen_m = place_m + ray * distance_m;
            let blocker_m = seen_m.truncate() + sector.shadow_m * cast;
            let reaching = DVec2::from_angle(way) * spare_m;
            // What is beyond the reach casts no shadows, and nothing is below the ground.
            if seen_m.z >= lowest_m && blocker_m.distance(place_m.truncate()) <= REACH_M {
                for at_m in [seen_m.truncate(), blocker_m] {
                    let chunk = ChunkCoord::containing(at_m + reaching, CHUNK_M);
                    prop_assert!(sector.includes(chunk, CHUNK_M, spare_m));
                }
            }
        }
    }

    #[test]
    fn the_cone_of_a_picture_has_all_of_its_pixels() {
        let lens = Distortion::BrownConrady {
            k1: -0.3,
            k2: 0.1,
            k3: 0.0,
            p1: 1e-3,
            p2: -2e-3,
        };
        let pinhole = Intrinsics::from_fov(1280, 720, 1.4).expect("valid");
        let barrel = Intrinsics::through_lens(640, 480, 1.2, lens).expect("valid");
        let off_centre = Intrinsics {
            cx: 300.0,
            cy: -40.0,
            ..pinhole
        };
        for intrinsics in [pinhole, barrel, off_centre] {
            let cone = cone(&intrinsics);
            let all = |side: u32| (0..=side).step_by(20).map(f64::from);
            for (x, y) in
                all(intrinsics.width).flat_map(|x| all(intrinsics.height).map(move |y| (x, y)))
            {
                let off_axis_rad = cone
                    .axis
                    .angle_between(intrinsics.direction(DVec2::new(x, y)));
                assert!(off_axis_rad <= cone.half_angle_rad + SPARE_RAD / 2.0);
            }
            assert!(cone.half_angle_rad < 1.2, "{}", cone.half_angle_rad);
        }
    }

    #[test]
    fn what_lies_behind_is_not_seen() {
        let cone = |half_angle_rad, up: f64| DirectionCone {
            axis: DVec3::new(libm::cos(up), 0.0, libm::sin(up)),
            half_angle_rad,
        };
        let count = |cone: &DirectionCone, shadow_m: DVec2| {
            let place_m = DVec3::new(25.0, 25.0, 1.0);
            let limits = Limits {
                reach_m: REACH_M,
                lowest_m: -30.0,
                mirrored_m: 0.0,
            };
            let sector = Sector {
                shadow_m,
                ..Sector::of_cone(place_m, cone, limits)
            };
            let all = ChunkCoord::within(place_m.truncate(), REACH_M, CHUNK_M);
            let seen = all
                .iter()
                .filter(|at| sector.includes(**at, CHUNK_M, OUT_M));
            (seen.count(), all.len())
        };
        let (seen, all) = count(&cone(0.7, 0.0), DVec2::ZERO);
        assert!(2 * seen < all, "{seen} of {all}");
        // With the sun at the side more cast shadows, and none with the sun ahead.
        assert!(count(&cone(0.7, 0.0), DVec2::Y * 100.0).0 > seen + 10);
        assert_eq!(count(&cone(0.7, 0.0), DVec2::X * 100.0).0, seen);
        // Who looks up steeply, down nearly to the horizon, or all around, sees all.
        for cone in [cone(0.7, 1.0), cone(0.9, -1.0), DirectionCone::ALL] {
            assert_eq!(count(&cone, DVec2::ZERO), (all, all));
        }
        // Straight down from 31 m, 27 m around are seen; shadows come from further away.
        let down = cone(0.7, -std::f64::consts::FRAC_PI_2);
        let (near, _) = count(&down, DVec2::ZERO);
        assert!((9..=13).contains(&near), "{near} of {all}");
        assert!(count(&down, DVec2::X * 100.0).0 > near + 10);
    }
}
