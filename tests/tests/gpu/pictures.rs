//! Lit pictures of the GPU look like those of the ray-cast camera.

use nemoral_render::{
    CameraRenderer, Gpu, GpuCamera, GpuParams, Lighting, OpenSky, RayCastCamera, RayCastParams,
    SceneView, SkyImage, SkyParams, SkyVisibility, Sun, View,
};
use nemoral_scene::glam::{DVec3, Vec3};
use nemoral_scene::{Distortion, Image, Intrinsics, Shutter, Twist};
use nemoral_seed::Key;
use nemoral_tests::gpu::{Agreement, gpu};

use super::common::{LEAST, RandomForest, view};

/// Crowns that close and open within some metres, and let in more light at greater heights. They
/// change as fast as the pipeline's sky view factor can, which has a node every five metres.
fn crowns(p: Vec3) -> f32 {
    let gaps = (0.4 * p.x).sin() * (0.5 * p.y).cos();
    (0.35 + 0.3 * gaps + 0.03 * p.z).clamp(0.0, 1.0)
}

#[test]
fn pictures_look_alike() {
    look_alike(&["a draft", "fog under crowns", "between low plants"]);
}

#[test]
#[ignore = "takes long: for .ci/full"]
fn all_pictures_look_alike() {
    look_alike(&[
        "clear",
        "fog",
        "a fisheye",
        "a draft",
        "a blur",
        "a blurred fisheye",
        "overcast under crowns",
        "fog under crowns",
        "between low plants",
    ]);
}

/// Compares the light of named pictures.
fn look_alike(names: &[&str]) {
    let Some(gpu) = gpu("lit pictures") else {
        return;
    };
    let sun = Sun::from_angles(130.0, 40.0).expect("valid");
    let clear = Lighting::new(&sun, &SkyParams::default()).expect("valid");
    // Low fog and haze, under a photographed sky that is bright in the east.
    let fog = SkyParams {
        visibility_m: 300.0,
        fog_per_m: 0.05,
        fog_base_m: -1.0,
        fog_height_m: 3.0,
        ..SkyParams::default()
    };
    let pixel = |i: usize| Vec3::new(1.0, 1.2, 1.5) * if i % 64 < 32 { 1.0 } else { 4.0 };
    let photograph = Image::new(64, 32, (0..64 * 32).map(pixel).collect());
    let photograph = SkyImage::new(&photograph, 0.0).expect("a sky");
    let fog = Lighting::photographed(&sun, &fog, &photograph, 0.8).expect("valid");
    // These are a lens, and a moving camera with an exposure time and a rolling shutter.
    let wide = Intrinsics::through_lens(
        320,
        240,
        2.2,
        Distortion::Fisheye {
            k1: 0.01,
            k2: 0.0,
            k3: 0.0,
            k4: 0.0,
        },
    );
    let wide = View {
        intrinsics: wide.expect("a sound lens"),
        ..view(320, 240)
    };
    let blurred = |view: View, readout_s: f64| View {
        shutter: Shutter {
            exposure_s: 0.05,
            readout_s,
        },
        motion: Twist {
            linear_m_s: DVec3::new(1.0, 0.0, 1.0),
            angular_rad_s: DVec3::new(0.0, 0.5, 1.5),
        },
        ..view
    };
    let standard = GpuParams::default();
    // One sample per pixel gives the same light, with more noise.
    let draft = GpuParams {
        colour_samples: 1,
        ..standard
    };
    let plain = view(320, 240);
    let overcast = SkyParams {
        overcast: 1.0,
        ..SkyParams::default()
    };
    let overcast = Lighting::new(&sun, &overcast).expect("valid");
    let (open, crowns): (&dyn SkyVisibility, &dyn SkyVisibility) = (&OpenSky, &crowns);
    let low: &dyn SkyVisibility = &Tufts(0.0);
    for (what, params, lighting, sky, view) in [
        ("clear", standard, &clear, open, plain),
        ("fog", standard, &fog, open, plain),
        ("a fisheye", standard, &clear, open, wide),
        ("a draft", draft, &clear, open, plain),
        ("a blur", standard, &clear, open, blurred(plain, 0.0)),
        (
            "a blurred fisheye",
            standard,
            &clear,
            open,
            blurred(wide, 0.03),
        ),
        ("overcast under crowns", standard, &overcast, crowns, plain),
        ("between low plants", standard, &overcast, low, plain),
        ("fog under crowns", standard, &fog, crowns, plain),
    ]
    .into_iter()
    .filter(|(what, ..)| names.contains(what))
    {
        let (median, most, exposure) = difference(gpu, params, lighting, [sky; 2], &view);
        println!("{what}: {median} in the median, {most} at the 95th percentile");
        assert!(median < 0.015 && most < 0.1, "{what}: {median} {most}");
        assert!(exposure < 0.1, "{what}: {exposure} EV");
    }
    // Crowns that are displaced by a step of the finest grid of sky view factors are detected.
    let beside = |p: Vec3| crowns.sky_view_factor(p + Vec3::X * 1.5);
    let (median, most, _) = difference(gpu, draft, &overcast, [crowns, &beside], &plain);
    println!("crowns beside: {median} in the median, {most} at the 95th percentile");
    assert!(median > 0.03 && most > 0.2, "{median} {most}");
    let (median, most, _) = difference(gpu, draft, &overcast, [low, &Tufts(1.0)], &plain);
    println!("low plants beside: {median} in the median, {most} at the 95th percentile");
    assert!(most > 0.2, "{median} {most}");
}

/// Tufts in rows 4 m apart, displaced by some metres.
struct Tufts(f32);

impl SkyVisibility for Tufts {
    fn sky_view_factor(&self, _: Vec3) -> f32 {
        1.0
    }

    fn ground_occlusion(&self, scene_point: Vec3) -> f32 {
        let wave = |at: f32| 4.0 * ((at + self.0) / 4.0).rem_euclid(1.0) - 2.0;
        let [x, y] = [scene_point.x, scene_point.y].map(|at| wave(at).abs() - 1.0);
        0.5 + 0.5 * x * y
    }
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn pictures_of_two_threads_are_those_taken_in_turn() {
    let Some(gpu) = gpu("pictures at once") else {
        return;
    };
    let sun = Sun::from_angles(130.0, 40.0).expect("valid");
    let light = Lighting::new(&sun, &SkyParams::default()).expect("valid");
    let params = GpuParams {
        colour_samples: 1,
        ..GpuParams::default()
    };
    let camera = GpuCamera::new(gpu, params, light);
    let camera = camera.unwrap_or_else(|e| panic!("{e}"));
    // These are two scenes, so that instances come and go.
    let forests = [5, 6].map(|seed| RandomForest::new(seed, |m| m));
    let take = |i: usize| {
        let mut view = view(160, 96 + 8 * (i % 3) as u32);
        view.scene_from_camera.translation_m.x += i as f64;
        let images = camera.render(&forests[i / 2 % 2].scene(), &view, Key::world(1));
        images.unwrap_or_else(|e| panic!("{e}"))
    };
    let in_turn: Vec<_> = (0..4).map(take).collect();
    let memory = camera.memory().bytes;
    let at_once: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..4).map(|i| scope.spawn(move || take(i))).collect();
        threads
            .into_iter()
            .map(|t| t.join().expect("a picture"))
            .collect()
    });
    assert!(in_turn == at_once);
    assert!(in_turn[0].truth != in_turn[2].truth);
    // Temporary buffers are given back.
    take(3);
    assert_eq!(camera.memory().bytes, memory);
}

/// The relative difference of the two renderers' light in blocks of 16 pixels, as median and 95th
/// percentile, and the difference of their exposures, EV. Each renderer has its own crowns before
/// the sky.
fn difference(
    gpu: &Gpu,
    params: GpuParams,
    lighting: &Lighting,
    [of_cast, of_drawn]: [&dyn SkyVisibility; 2],
    view: &View,
) -> (f32, f32, f32) {
    let fine = RayCastParams {
        keep_linear: true,
        blur_samples: 36,
        ..RayCastParams::fine()
    };
    let cast = RayCastCamera::new(fine, lighting.clone()).expect("allowed");
    let params = GpuParams {
        keep_linear: true,
        ..params
    };
    let draw = GpuCamera::new(gpu, params, lighting.clone()).unwrap_or_else(|e| panic!("{e}"));
    let forest = RandomForest::new(5, |m| m);
    let under = |sky_visibility| SceneView {
        sky_visibility,
        ..forest.scene()
    };
    let a = cast.render(&under(of_cast), view, Key::world(1));
    let a = a.expect("a picture");
    let b = draw.render(&under(of_drawn), view, Key::world(1));
    let b = b.unwrap_or_else(|e| panic!("{e}"));
    assert!(Agreement::of(&a.truth, &b.truth).is_right(LEAST));
    let exposure = (a.ev100 - b.ev100).abs() as f32;
    // Blocks of 16 pixels are compared, as the renderers sample penumbrae and silhouettes
    // differently.
    let blocks = |image: &Image<Vec3>| -> Vec<Vec3> {
        let mean = |i: usize| {
            let (left, top) = (i % 20 * 16, i / 20 * 16);
            let pixels = (0..256).map(|k| *image.at(left + k % 16, top + k / 16));
            pixels.sum::<Vec3>() / 256.0
        };
        (0..300).map(mean).collect()
    };
    let [a, b] = [a, b].map(|i| blocks(&i.linear.expect("asked for")));
    let mut differences: Vec<f32> = a
        .iter()
        .zip(&b)
        .map(|(a, b)| (*a - *b).abs().max_element() / a.max_element())
        .collect();
    differences.sort_by(f32::total_cmp);
    (differences[150], differences[285], exposure)
}
