//! Shutters against closed forms: the lean of edges, the width of blur, and the truth.

use crate::analytic::{Shape, World, camera, grey, look, radiances};
use glam::{DQuat, DVec2, DVec3, Vec3};
use nemoral_render::{CameraImages, Lighting, RayCastCamera, RayCastParams, View, optical_flow};
use nemoral_scene::{RigidTransform, Semantic, Shutter, Twist};

/// The light is white from everywhere, so the radiance of a surface is its albedo.
fn shoot(world: &World, view: &View, params: RayCastParams) -> CameraImages {
    radiances(world, Lighting::uniform(Vec3::ONE), view, params)
}

/// A black wall 4 m ahead, and 3 m ahead on the left a white one with a vertical edge at y = 0.
fn edge() -> World {
    let mut world = World::default();
    let wall = Shape::Plane {
        normal: DVec3::X,
        offset: 4.0,
    };
    world.add(wall, grey(0.0), 0);
    let card = nemoral_scene::Card {
        corner: Vec3::new(3.0, 0.0, -20.0),
        edge_u: Vec3::new(0.0, 20.0, 0.0),
        edge_v: Vec3::new(0.0, 0.0, 40.0),
        material: nemoral_scene::MaterialId(1),
    };
    world.add(Shape::Card(card), grey(1.0), 1);
    world
}

fn moving(shutter: Shutter, linear: DVec3, angular: DVec3) -> View {
    View {
        shutter,
        motion: Twist {
            linear_m_s: linear,
            angular_rad_s: angular,
        },
        ..camera(320, 200, 60.0, DVec3::ZERO, DVec3::X)
    }
}

/// Moving sideways at v past an edge at z, the row at time t sees it shifted by f v t / z, in
/// picture and truth.
#[test]
fn a_rolling_shutter_leans_edges_and_truth_leans_with_them() {
    let shutter = Shutter {
        exposure_s: 0.0,
        readout_s: 0.03,
    };
    let view = moving(shutter, DVec3::X * 6.0, DVec3::ZERO);
    let images = shoot(&edge(), &view, RayCastParams::draft());
    let k = view.intrinsics;
    let mut least = f64::INFINITY;
    for row in 0..200 {
        let time = 0.03 * ((row as f64 + 0.5) / 200.0 - 0.5);
        let at = k.cx - k.fx * 6.0 * time / 3.0;
        least = least.min(at);
        for column in 0..320 {
            let white = (column as f64 + 0.5) < at;
            if (column as f64 + 0.5 - at).abs() < 0.01 {
                continue;
            }
            let truth = &images.truth;
            let depth = if white { 3.0 } else { 4.0 };
            assert!((truth.depth_m.at(column, row) - depth).abs() < 1e-4);
            assert_eq!(images.rgb.at(column, row)[1] > 60, white);
        }
    }
    assert!(k.cx - least > 5.0, "it leans by {} pixels", k.cx - least);
}

/// While the camera turns, depth and normals of a row are in the camera's frame at the row's time.
#[test]
fn truth_of_a_row_is_in_the_frame_of_its_camera() {
    let shutter = Shutter {
        exposure_s: 0.0,
        readout_s: 0.04,
    };
    // About the optical x, z and y axes, and forward.
    let view = moving(shutter, DVec3::Z * 2.0, DVec3::new(0.3, 1.5, -0.4));
    let images = shoot(&edge(), &view, RayCastParams::draft());
    let start = look(DVec3::ZERO, DVec3::X);
    for (row, column) in [(0, 10), (30, 200), (199, 300), (120, 160)] {
        let time = 0.04 * ((row as f64 + 0.5) / 200.0 - 0.5);
        let turned = DQuat::from_scaled_axis(view.motion.angular_rad_s * time);
        let pose = start
            * RigidTransform {
                rotation: turned,
                translation_m: DVec3::Z * 2.0 * time,
            };
        let pixel = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
        let d = pose.transform_vector(view.intrinsics.direction(pixel));
        let o = pose.translation_m;
        let at = |x: f64| o + d * ((x - o.x) / d.x);
        let place = if at(3.0).y > 0.0 { at(3.0) } else { at(4.0) };
        let exact = pose.inverse().transform_point(place).z;
        let truth = &images.truth;
        let got = f64::from(*truth.depth_m.at(column, row));
        assert!((got / exact - 1.0).abs() < 1e-5, "{got} for {exact}");
        let normal = pose.rotation.inverse() * -DVec3::X;
        let got = truth.normal.at(column, row).as_dvec3();
        assert!(got.distance(normal) < 1e-5, "{got} for {normal}");
        assert!((view.scene_from_row(pixel.y).translation_m - o).length() < 1e-12);
        let back = view.project(place).expect("in front");
        assert!(back.distance(pixel) < 1e-4, "{back} for {pixel}");
    }
}

/// An edge at z that passes at v while the shutter is open for T becomes a ramp f v T / z wide; its
/// middle, and the truth, is where the edge is in the middle of the exposure.
#[test]
fn an_edge_blurs_into_a_ramp() {
    let shutter = Shutter {
        exposure_s: 0.03,
        readout_s: 0.0,
    };
    let view = moving(shutter, DVec3::X * 4.0, DVec3::ZERO);
    let params = RayCastParams {
        blur_samples: 33,
        ..RayCastParams::draft()
    };
    let images = shoot(&edge(), &view, params);
    let linear = images.linear.as_ref().expect("asked for");
    let k = view.intrinsics;
    let width = k.fx * 4.0 * 0.03 / 3.0;
    assert!(width > 10.0);
    let mut worst = 0.0_f64;
    for column in 140..180 {
        // The ramp's mean over a pixel, by its integral.
        let integral = |x: f64| {
            let u = ((k.cx - x) / width + 0.5).clamp(0.0, 1.0);
            let beyond = (x - (k.cx - width / 2.0)).min(0.0);
            beyond - width * u * u / 2.0
        };
        let exact = integral(column as f64 + 1.0) - integral(column as f64);
        let mean = (0..200)
            .map(|row| f64::from(linear.at(column, row).y))
            .sum::<f64>()
            / 200.0;
        worst = worst.max((mean - exact).abs());
        // Each pixel has a sample in each 33rd of the exposure, of which at most about one is
        // wrong.
        for row in 0..200 {
            let off = f64::from(linear.at(column, row).y) - exact;
            assert!(off.abs() < 2.5 / 33.0, "column {column}: {off} off");
        }
        let depth = if (column as f64) < k.cx { 3.0 } else { 4.0 };
        assert!((images.truth.depth_m.at(column, 100) - depth).abs() < 1e-4);
    }
    assert!(worst < 0.008, "{worst}");
}

/// A shutter changes no bit of the picture of a still camera, and motion changes none of an
/// instant.
#[test]
fn still_cameras_and_instants_take_the_plain_picture() {
    let plain = shoot(
        &edge(),
        &moving(Shutter::INSTANT, DVec3::ZERO, DVec3::ZERO),
        RayCastParams::default(),
    );
    let slow = Shutter {
        exposure_s: 0.1,
        readout_s: 0.1,
    };
    let still = shoot(
        &edge(),
        &moving(slow, DVec3::ZERO, DVec3::ZERO),
        RayCastParams::default(),
    );
    assert_eq!(plain, still);
    let instant = shoot(
        &edge(),
        &moving(Shutter::INSTANT, DVec3::X, DVec3::Y),
        RayCastParams::default(),
    );
    assert_eq!(plain, instant);
}

/// Flow from one picture with a rolling shutter to the next leads to the same point of the world.
#[test]
fn flow_leads_to_the_row_that_sees_the_place_next() {
    let shutter = Shutter {
        exposure_s: 0.0,
        readout_s: 0.03,
    };
    let world = edge();
    let view = moving(
        shutter,
        DVec3::new(1.0, 0.0, 2.0),
        DVec3::new(0.1, 0.5, 0.2),
    );
    let mut next = moving(
        shutter,
        DVec3::new(-1.0, 0.2, 2.0),
        DVec3::new(-0.2, -0.5, 0.0),
    );
    next.scene_from_camera = look(DVec3::new(0.2, 0.05, 0.0), DVec3::new(4.0, 0.3, 0.0));
    let truth = shoot(&world, &view, RayCastParams::draft()).truth;
    let flow = optical_flow(&world, &truth, &view, &next, 1e5);
    let params = RayCastParams {
        max_range_m: 1e5,
        ..RayCastParams::draft()
    };
    let camera = RayCastCamera::new(params, Lighting::uniform(Vec3::ONE)).expect("valid");
    let (mut seen, mut wrong) = (0, 0);
    for (row, column) in (0..200)
        .step_by(7)
        .flat_map(|r| (0..320).step_by(7).map(move |c| (r, c)))
    {
        let Some(flow) = flow.at(column, row).filter(|f| f.seen) else {
            continue;
        };
        let pixel = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
        let there = pixel + flow.offset_px.as_dvec2();
        let found = camera.truth_at(&world.view(), &next, there);
        seen += 1;
        let place = |view: &View, at: DVec2, depth: f32| {
            let d = view.intrinsics.direction(at);
            let in_camera = d * (f64::from(depth) / d.z);
            view.scene_from_row(at.y).transform_point(in_camera)
        };
        let (a, b) = (
            place(&view, pixel, *truth.depth_m.at(column, row)),
            place(&next, there, found.depth_m),
        );
        wrong += usize::from(a.distance(b) > 1e-3 || found.semantic != Semantic::Rock);
    }
    assert!(seen > 500 && wrong == 0, "{wrong} of {seen}");
}

/// The next picture is of its own surroundings, and ends at its range: what vanishes, what
/// something new hides, and what is too far away then are not seen.
#[test]
fn flow_is_seen_if_the_next_picture_shows_it() {
    let world = edge();
    let view = moving(Shutter::INSTANT, DVec3::ZERO, DVec3::ZERO);
    let truth = shoot(&world, &view, RayCastParams::draft()).truth;
    // 1 m back: the wall is 5 m ahead, the card 4 m.
    let next = View {
        scene_from_camera: look(DVec3::new(-1.0, 0.0, 0.0), DVec3::X),
        ..view
    };
    // Shares of the pixels of the card and of those of the wall that are seen.
    let seen = |around: &World, max_range_m: f32| {
        let flow = optical_flow(around, &truth, &view, &next, max_range_m);
        let share = |depth: f32| {
            let pixels = truth.depth_m.pixels().iter().zip(flow.pixels());
            let of_depth: Vec<bool> = pixels
                .filter(|(z, _)| (*z - depth).abs() < 1e-3)
                .map(|(_, flow)| flow.is_some_and(|flow| flow.seen))
                .collect();
            let count = of_depth.iter().filter(|seen| **seen).count();
            count as f64 / of_depth.len() as f64
        };
        [share(3.0), share(4.0)]
    };
    assert_eq!(seen(&world, 1e5), [1.0, 1.0]);
    // Without the card only the wall is there, all of which is seen.
    let mut without = edge();
    without.items.truncate(1);
    assert_eq!(seen(&without, 1e5), [0.0, 1.0]);
    // Something stands before all of it.
    let mut hidden = edge();
    let screen = Shape::Plane {
        normal: DVec3::X,
        offset: 1.0,
    };
    hidden.add(screen, grey(0.5), 2);
    assert_eq!(seen(&hidden, 1e5), [0.0, 0.0]);
    // Of the card, 4.2 m reach as far as 18 degrees from the axis, and to the wall nowhere.
    let [card, wall] = seen(&world, 4.2);
    assert!((card - 0.637).abs() < 0.02 && wall == 0.0, "{card} {wall}");
}
