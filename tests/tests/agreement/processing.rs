//! What sets cameras apart changes pictures and nothing else.

use nemoral_tests::World;

/// Cameras in the same place, each with an effect.
const CAMERAS: [(&str, &str); 12] = [
    ("balance", "white_balance.kelvin=3500"),
    ("auto", "white_balance.mode=auto"),
    ("metering", "metering=centre"),
    ("error", "exposure_error_ev=1.5"),
    ("tone", "tone.contrast=1.5"),
    ("colour", "tone.saturation=0.4"),
    ("corners", "vignetting.model=polynomial"),
    ("fringes", "aberration.red_px=2"),
    ("smooth", "processing.denoising=0.5"),
    ("sharp", "processing.sharpening=1"),
    ("jpeg", "processing.jpeg_quality=60"),
    ("dirt", "soiling.drops=5"),
];

#[test]
fn effects_change_the_picture_and_neither_truth_nor_scans() {
    let mut settings = vec![
        "camera.width_px=160".to_owned(),
        "camera.height_px=90".to_owned(),
        "camera.radiance=true".to_owned(),
        "lidar.pulses=500".to_owned(),
    ];
    let plain = World::new(
        "demo",
        &settings.iter().map(String::as_str).collect::<Vec<_>>(),
    );
    let effects = CAMERAS.map(|(name, effect)| format!("cameras.{name}.{effect}"));
    settings.extend(effects);
    let all = World::new(
        "demo",
        &settings.iter().map(String::as_str).collect::<Vec<_>>(),
    );
    let pictures = |world: &World| {
        world
            .runner(2)
            .get(world.forest.images, 0)
            .expect("pictures")
    };
    let scans = |world: &World| world.runner(2).get(world.forest.scans, 0).expect("scans");
    let (alone, beside) = (pictures(&plain), pictures(&all));
    assert_eq!(alone[0], beside[0], "the first camera's");
    assert_eq!(scans(&plain), scans(&all));
    assert_eq!(beside.len(), 1 + CAMERAS.len());
    let first = &beside[0];
    for (images, (name, effect)) in beside[1..].iter().zip(sorted()) {
        assert_eq!(images.truth, first.truth, "{name}");
        let codes = images.rgb.pixels().iter().zip(first.rgb.pixels());
        let changed = codes.filter(|(a, b)| a != b).count();
        assert!(changed > 160, "{effect} changes {changed} pixels");
        // Radiance is the light behind the lens, which only the lens changes.
        let by_lens = ["corners", "fringes", "dirt"].contains(&name);
        let light =
            |i: &nemoral_render::CameraImages| i.linear.as_ref().expect("asked for").clone();
        // Cameras draw their samples independently, so light differs a little in any case.
        let mean = |i| {
            let light = light(i);
            let sum: f64 = light.pixels().iter().map(|c| f64::from(c.y)).sum();
            sum / light.pixels().len() as f64
        };
        let ratio = mean(images) / mean(first);
        let most = if by_lens { 0.35 } else { 0.02 };
        assert!((ratio - 1.0).abs() < most, "{name}: {ratio}");
    }
    let error = beside[1..]
        .iter()
        .zip(sorted())
        .find(|(_, (name, _))| *name == "error");
    let ev = first.ev100 - error.expect("there is one").0.ev100;
    assert!((ev - 1.5).abs() < 0.05, "{ev}");
}

/// Further cameras are in the order of their names.
fn sorted() -> Vec<(&'static str, &'static str)> {
    let mut all = CAMERAS.to_vec();
    all.sort_unstable();
    all
}
