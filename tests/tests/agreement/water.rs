//! Sensors agree where there is water, which is opaque to all of them; mirrored echoes are apart.

use std::sync::LazyLock;

use nemoral_scene::{PointFlags, Semantic};
use nemoral_tests::World;

use crate::sensors::{assert_agreement, frames_of};

/// A stand along streams, with puddles wherever they stay.
const SETTINGS: [&str; 17] = [
    "seed=11",
    "frames=8",
    "assets.individuals=1",
    "water.springs_per_km2=300",
    "water.ponds=1",
    "chunks.visible_radius_m=60",
    "chunks.undergrowth_radius_m=30",
    "camera.width_px=320",
    "camera.height_px=180",
    "camera.fov.horizontal_deg=100",
    "camera.mount_z_m=1.35",
    "lidar.pulses=40000",
    "lidar.noise.model=off",
    "robot.speed_m_s=1e-6",
    "robot.start_x_m=0",
    "robot.start_y_m=0",
    "robot.heading_deg=45",
];

static WORLD: LazyLock<World> = LazyLock::new(|| {
    let settings: Vec<&str> = SETTINGS
        .iter()
        .copied()
        .chain(["robot.spacing_m=9"])
        .collect();
    World::new("stream-valley", &settings)
});

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn a_camera_at_the_lidar_sees_the_same_water() {
    let frames = frames_of(&WORLD);
    println!("{}", assert_agreement(&frames, 100_000, &[1, 3]));
    let points = frames.iter().flat_map(|f| f.points());
    let (mut water, mut mirrored) = (0, 0);
    for point in points {
        if point.flags.has(PointFlags::MIRRORED) {
            mirrored += 1;
        } else {
            water += u32::from(point.semantic == Semantic::Water);
        }
    }
    println!("{water} points on water, {mirrored} by way of it");
    assert!(water > 300 && mirrored > 30, "{water} {mirrored}");
}
