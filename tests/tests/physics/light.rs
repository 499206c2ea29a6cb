//! The quick mean light under crowns, which lights pictures, compared with path-traced light.

use nemoral_pipeline::ForestPlan;
use nemoral_pipeline::plan::{Runner, Store};
use nemoral_realism::{luminance_of_light, tones};
use nemoral_render::CameraImages;
use nemoral_scene::glam::DVec3;
use nemoral_scene::{Image, Semantic};
use nemoral_tests::{config, store};

const PARTS: [(&str, &[Semantic]); 4] = [
    (
        "ground",
        &[Semantic::Litter, Semantic::GroundMoss, Semantic::Soil],
    ),
    ("stems", &[Semantic::Stem]),
    ("leaves", &[Semantic::Leaf, Semantic::Needle]),
    (
        "low plants",
        &[Semantic::Grass, Semantic::Fern, Semantic::Herb],
    ),
];

fn taken(store: &Store, stand: &str, more: &[&str]) -> Vec<CameraImages> {
    let settings = [
        "assets.individuals=2",
        "chunks.visible_radius_m=60",
        "chunks.undergrowth_radius_m=30",
        "chunks.delete_radius_m=120",
        "camera.width_px=160",
        "camera.height_px=90",
        "camera.edge_samples=1",
        "camera.look=flat",
        "camera.radiance=true",
        "lidar.pulses=10",
    ];
    let settings: Vec<&str> = settings.iter().chain(more).copied().collect();
    let forest = ForestPlan::new(&config(stand, &settings)).expect("a plan");
    store.retain(|stage, _| stage != "frame.images" && stage != "world.cameras");
    let runner = Runner::new(forest.plan(), store, 2);
    let take = |frame: u64| runner.get(forest.images, frame).expect("pictures")[0].clone();
    [0, 30, 60].into_iter().map(take).collect()
}

/// Mean light of pixels of these classes, cd/m², and their number.
fn mean_of(pictures: &[CameraImages], semantics: &[Semantic]) -> (DVec3, usize) {
    let (mut sum, mut count) = (DVec3::ZERO, 0);
    for images in pictures {
        let linear = images.linear.as_ref().expect("asked for").pixels();
        for (semantic, light) in images.truth.semantic.pixels().iter().zip(linear) {
            if semantics.contains(semantic) {
                sum += light.as_dvec3();
                count += 1;
            }
        }
    }
    (sum / count as f64, count)
}

/// Side of the squares whose logarithms of light are compared by standard deviation, pixels. Single
/// pixels would add the noise of path tracing with few samples.
const SQUARE: usize = 4;

fn contrast(pictures: &[CameraImages]) -> f64 {
    let of = |images: &CameraImages| {
        let light = images.linear.as_ref().expect("asked for");
        let light = luminance_of_light(light, images.ev100);
        let (width, height) = (light.width() / SQUARE, light.height() / SQUARE);
        let mean = |square: usize| {
            let (left, top) = (square % width * SQUARE, square / width * SQUARE);
            let rows = light.pixels().chunks(light.width()).skip(top).take(SQUARE);
            let sum: f64 = rows.flat_map(|row| &row[left..left + SQUARE]).sum();
            sum / (SQUARE * SQUARE) as f64
        };
        let means = (0..width * height).map(mean).collect();
        tones(&Image::new(width, height, means)).log_sd
    };
    pictures.iter().map(of).sum::<f64>() / pictures.len() as f64
}

fn green(light: DVec3) -> f64 {
    light.y / light.element_sum()
}

#[test]
#[ignore = "a minute: .ci/full runs it"]
fn mean_light_is_near_followed_light() {
    mean_is_near_followed(&["spruce"], &["sky.overcast=0"]);
}

#[test]
#[ignore = "minutes: .ci/full runs it"]
fn mean_light_is_near_followed_light_in_sun_and_under_clouds() {
    let stands = ["beech", "spruce", "oak-mixed", "boreal-birch-pine"];
    mean_is_near_followed(&stands, &["sky.overcast=0", "sky.overcast=1"]);
}

fn mean_is_near_followed(stands: &[&str], skies: &[&str]) {
    let mut off = Vec::new();
    for stand in stands {
        let store = store();
        for sky in skies {
            let mean = taken(&store, stand, &[sky, "camera.samples=9"]);
            let followed = taken(
                &store,
                stand,
                &[sky, "camera.samples=16", "camera.bounces=5"],
            );
            for (part, semantics) in PARTS {
                let ((a, n), (b, _)) = (mean_of(&mean, semantics), mean_of(&followed, semantics));
                if n < 500 {
                    continue;
                }
                let (ratio, greener) = (a.y / b.y, green(a) - green(b));
                println!("{stand}, {sky}, {part}: {ratio:.2}, green {greener:+.3} ({n} pixels)");
                // Under clouds oak-mixed is too dark below: its ground by a sixth, its low plants
                // by an eighth.
                let least = if part == "ground" { 0.8 } else { 0.87 };
                if !(least..1.1).contains(&ratio) || greener.abs() >= 0.02 {
                    off.push(format!("{stand}, {sky}, {part}: {ratio:.2} {greener:+.3}"));
                }
            }
            let (a, b) = (contrast(&mean), contrast(&followed));
            println!("{stand}, {sky}: contrast {a:.2} of {b:.2}");
            if !(0.9 * b..1.1 * b).contains(&a) {
                off.push(format!("{stand}, {sky}: contrast {a:.2} of {b:.2}"));
            }
        }
    }
    assert!(off.is_empty(), "{off:#?}");
}
