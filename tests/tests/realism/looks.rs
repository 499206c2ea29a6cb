//! The three looks in a closed stand. Pictures of a robot's camera in a forest are harsh: gaps
//! clip, trunks are dark in front of them, glare washes out edges, corners are dark, and litter is
//! sharp down to single leaves.
#![allow(clippy::print_stdout, reason = "what was measured, for --nocapture")]

use nemoral_pipeline::ForestPlan;
use nemoral_pipeline::plan::{Runner, Store};
use nemoral_realism::{luminance, luminance_of_light};
use nemoral_render::CameraImages;
use nemoral_scene::{Image, Semantic};
use nemoral_tests::{TRACKS_ALONE, config, store};

const WIDTH: usize = 320;
const HEIGHT: usize = 180;

const FLOOR: [Semantic; 3] = [Semantic::Litter, Semantic::GroundMoss, Semantic::Soil];
const WOOD: [Semantic; 3] = [Semantic::Stem, Semantic::Limb, Semantic::RootFlare];

/// A picture, with its luminance as displayed and as in the scene.
struct Taken {
    images: CameraImages,
    shown: Image<f64>,
    scene: Image<f64>,
}

/// Pictures of a spruce stand by a look, with the same views for each look.
fn taken(store: &Store, look: &str) -> Vec<Taken> {
    let look = format!("camera.look={look}");
    let of_stand = [
        "assets.individuals=1",
        "chunks.visible_radius_m=60",
        "chunks.undergrowth_radius_m=20",
        "chunks.delete_radius_m=120",
        "camera.width_px=320",
        "camera.height_px=180",
        "camera.edge_samples=1",
        // What is compared are single pixels, which a lens would mix.
        "camera.spread_px=0",
        "camera.radiance=true",
        "lidar.pulses=10",
        &look,
    ];
    let settings = [&of_stand[..], &TRACKS_ALONE].concat();
    let forest = ForestPlan::new(&config("spruce", &settings)).expect("a plan");
    store.retain(|stage, _| stage != "frame.images" && stage != "world.cameras");
    let runner = Runner::new(forest.plan(), store, 2);
    let take = |frame: u64| {
        let images = runner.get(forest.images, frame).expect("pictures")[0].clone();
        Taken {
            shown: luminance(&images.rgb),
            scene: luminance_of_light(images.linear.as_ref().expect("asked for"), images.ev100),
            images,
        }
    };
    [0, 40, 80].into_iter().map(take).collect()
}

fn median(mut values: Vec<f64>) -> f64 {
    assert!(values.len() > 50, "{} pixels", values.len());
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

fn mean(values: &[f64]) -> f64 {
    assert!(values.len() > 50, "{} pixels", values.len());
    values.iter().sum::<f64>() / values.len() as f64
}

/// The values of pictures at all pixels that meet a condition.
fn of(
    pictures: &[Taken],
    value: impl Fn(&Taken, usize) -> f64,
    holds: impl Fn(&Image<Semantic>, usize) -> bool,
) -> Vec<f64> {
    let mut values = Vec::new();
    for taken in pictures {
        let semantic = &taken.images.truth.semantic;
        let pixels = (0..WIDTH * HEIGHT).filter(|&i| holds(semantic, i));
        values.extend(pixels.map(|i| value(taken, i)));
    }
    values
}

fn is_sky(semantic: &Image<Semantic>, i: usize) -> bool {
    semantic.pixels()[i] == Semantic::Sky
}

/// Whether the sky is within two pixels along the row.
fn before_sky(semantic: &Image<Semantic>, i: usize) -> bool {
    let (row, column) = (i / WIDTH * WIDTH, i % WIDTH);
    let near = column.saturating_sub(2)..(column + 3).min(WIDTH);
    !is_sky(semantic, i) && near.into_iter().any(|c| is_sky(semantic, row + c))
}

#[test]
#[ignore = "a minute: .ci/full runs it"]
fn a_forest_is_harsh_to_a_small_camera() {
    let store = store();
    let [robot, cinema, flat] = ["robot", "cinema", "flat"].map(|look| taken(&store, look));
    let scene = |t: &Taken, i: usize| t.scene.pixels()[i];
    let picture = |t: &Taken, i: usize| t.shown.pixels()[i];
    let is_floor = |s: &Image<Semantic>, i: usize| FLOOR.contains(&s.pixels()[i]);
    let is_trunk = |s: &Image<Semantic>, i: usize| WOOD.contains(&s.pixels()[i]);

    let stops = (median(of(&flat, scene, is_sky)) / median(of(&flat, scene, is_floor))).log2();
    println!("gaps are {stops:.1} stops brighter than the floor");
    assert!(stops > 2.0);

    let clipped = |pictures: &[Taken]| {
        let clips = |t: &Taken, i: usize| f64::from(t.images.rgb.pixels()[i].contains(&255));
        mean(&of(pictures, clips, is_sky))
    };
    let shares = [&robot, &cinema, &flat].map(|p| clipped(p));
    println!("of gaps clip: {shares:.2?}");
    // The soft curve keeps highlights, light itself loses most of them, and a camera's standard
    // picture is between.
    assert!(shares[1] < 0.05 && shares[2] > 0.5);
    assert!(shares[0] > 2.0 * shares[1] && shares[0] < shares[2]);

    let against = |s: &Image<Semantic>, i: usize| is_trunk(s, i) && before_sky(s, i);
    let gap = median(of(&robot, picture, is_sky));
    let silhouette = median(of(&robot, picture, against));
    let leaves = median(of(&robot, picture, |s, i| {
        s.pixels()[i] == Semantic::Needle
    }));
    println!("gaps {gap:.3}, trunks before them {silhouette:.3}, leaves {leaves:.3}");
    // The curve's shoulder brings the two nearer to each other than they are in the light.
    assert!(silhouette < gap / 2.0 && leaves < gap / 4.0);

    let washed = |holds: &dyn Fn(&Image<Semantic>, usize) -> bool| {
        mean(&of(&robot, picture, holds)) / mean(&of(&flat, picture, holds))
    };
    let far = |s: &Image<Semantic>, i: usize| !is_sky(s, i) && !before_sky(s, i);
    let (edges, others) = (washed(&before_sky), washed(&far));
    println!("edges {edges:.2}, others {others:.2} of what a clean lens shows");
    assert!(edges > 1.03 * others);

    let at = |inside: &dyn Fn(f32) -> bool| {
        washed(&|_, i| {
            let (x, y) = ((i % WIDTH) as f32 - 160.0, (i / WIDTH) as f32 - 90.0);
            inside(x.hypot(y) / 160.0_f32.hypot(90.0))
        })
    };
    let (middle, corners) = (at(&|r| r < 0.3), at(&|r| r > 0.9));
    println!("middle {middle:.2}, corners {corners:.2}");
    assert!(corners < 0.85 * middle);
}

/// The correlation of the logarithm of light between neighbours in a row, for pixels of litter 2 to
/// 4 m away, after the mean of the pixels 4 to either side is subtracted, which removes shadows and
/// slopes.
fn likeness(images: &CameraImages) -> f64 {
    let (semantic, depth_m) = (&images.truth.semantic, &images.truth.depth_m);
    let light = images.linear.as_ref().expect("asked for").pixels();
    let width = semantic.width();
    let near = |i: usize| {
        semantic.pixels()[i] == Semantic::Litter && (2.0..4.0).contains(&depth_m.pixels()[i])
    };
    let log = |i: usize| f64::from(light[i].y).ln();
    let detail = |i: usize| log(i) - 0.5 * (log(i - 4) + log(i + 4));
    let (mut product, mut square, mut count) = (0.0, 0.0, 0);
    for i in 4..light.len() - 5 {
        if i % width > 3 && i % width < width - 5 && (i - 4..=i + 5).all(near) {
            product += detail(i) * detail(i + 1);
            square += 0.5 * (detail(i).powi(2) + detail(i + 1).powi(2));
            count += 1;
        }
    }
    assert!(count > 5_000, "{count} pixels");
    product / square
}

#[test]
#[ignore = "a minute: .ci/full runs it"]
fn near_litter_is_sharp_to_the_single_leaf() {
    let settings = [
        "assets.individuals=1",
        "chunks.visible_radius_m=30",
        "chunks.undergrowth_radius_m=10",
        "chunks.delete_radius_m=60",
        "undergrowth.floor={leaf_litter=1.0, needle_litter=0.0, moss=0.0}",
        "camera.edge_samples=1",
        // Lookups are measured, not the lens.
        "camera.spread_px=0",
        "camera.look=flat",
        "camera.radiance=true",
        "sky.overcast=1",
        "lidar.pulses=10",
    ];
    let forest = ForestPlan::new(&config("beech", &settings)).expect("a plan");
    let store = store();
    let images = Runner::new(forest.plan(), &store, 2).get(forest.images, 0);
    let likeness = likeness(&images.expect("pictures")[0]);
    println!("neighbours in litter are alike by {likeness:.2}");
    // It would be 0.79 if samples were filtered with the mean of their ellipse's axes, and 0 for
    // noise.
    assert!((0.4..0.73).contains(&likeness), "{likeness:.2}");
}
