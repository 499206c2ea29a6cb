//! Pictures of an open stand of cork oaks have statistics and classes in the ranges of
//! docs/measurements/realism.md, and crowns of spruce have their colours. Each measure leaves its
//! range when its cause is broken on purpose.

use std::sync::{Arc, LazyLock};

use nemoral_pipeline::ForestPlan;
use nemoral_pipeline::plan::{Runner, Store};
use nemoral_pipeline::world::assets::WorldAssets;
use nemoral_realism::ranges::{self, leaves};
use nemoral_realism::{
    ClassCounts, amplitude_slope, colour, ground_repetition, isotropy, luminance,
    luminance_of_light, spectrum, tones,
};
use nemoral_render::CameraImages;
use nemoral_scene::{Image, Material, Ontology, Semantic};
use nemoral_seed::{Draw, Key};

const SETTINGS: [&str; 13] = [
    "assets.individuals=2",
    "frames=3",
    "robot.spacing_m=8",
    "chunks.visible_radius_m=120",
    "chunks.undergrowth_radius_m=40",
    "chunks.delete_radius_m=200",
    "camera.width_px=256",
    "camera.height_px=256",
    "camera.edge_samples=2",
    // Statistics of natural images are those of photographs made smaller. At so few pixels
    // the default lens is as wide as four of a whole picture's, and log-luminance spreads by 0.743.
    "camera.spread_px=0",
    "camera.radiance=true",
    "lidar.pulses=1000",
    "terrain.cell_m=1",
];
const FRAMES: u64 = 3;

struct Stand {
    store: Store,
    assets: Arc<WorldAssets>,
    images: Vec<Arc<Vec<CameraImages>>>,
}

static STAND: LazyLock<Stand> = LazyLock::new(|| {
    let store = nemoral_tests::store();
    let (assets, images) = taken("montado", &store, &[]);
    Stand {
        store,
        assets,
        images,
    }
});

/// Pictures of a preset with further settings. What does not depend on them is computed once, as
/// the keys in the store are the same.
fn taken(
    preset: &str,
    store: &Store,
    settings: &[&str],
) -> (Arc<WorldAssets>, Vec<Arc<Vec<CameraImages>>>) {
    let config = nemoral_tests::config(preset, &[&SETTINGS, settings].concat());
    let forest = ForestPlan::new(&config).unwrap_or_else(|e| panic!("{e}"));
    let runner = Runner::new(forest.plan(), store, 2);
    let image = |frame| runner.get(forest.images, frame).expect("a picture");
    let assets = runner.get(forest.assets, ()).expect("assets");
    (assets, (0..FRAMES).map(image).collect())
}

/// The mean of a measure over the pictures of the robot's camera.
fn mean(of: impl Fn(&CameraImages) -> f64) -> f64 {
    STAND.images.iter().map(|i| of(&i[0])).sum::<f64>() / FRAMES as f64
}

/// The mean of a measure over the same pictures with changed pixels.
fn mean_of(change: impl Fn(&Image<[u8; 3]>) -> Image<[u8; 3]>, of: fn(&Image<f64>) -> f64) -> f64 {
    mean(|i| of(&luminance(&change(&i.rgb))))
}

/// A picture each of whose pixels is the mean of those right of it and below it.
fn smeared(picture: &Image<[u8; 3]>, across: usize, down: usize) -> Image<[u8; 3]> {
    let (w, h) = (picture.width(), picture.height());
    let pixel = |i: usize| {
        let mut sum = [0_u32; 3];
        for j in 0..across * down {
            let (x, y) = ((i % w + j % across) % w, (i / w + j / across) % h);
            for (s, v) in sum.iter_mut().zip(picture.pixels()[y * w + x]) {
                *s += u32::from(v);
            }
        }
        sum.map(|s| (s as usize / (across * down)) as u8)
    };
    Image::new(w, h, (0..w * h).map(pixel).collect())
}

fn noise(picture: &Image<[u8; 3]>) -> Image<[u8; 3]> {
    let mut rng = Key::world(2).rng();
    let pixels = picture.pixels().iter();
    let pixels = pixels.map(|_| [150 + rng.below(20) as u8; 3]).collect();
    Image::new(picture.width(), picture.height(), pixels)
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn pictures_of_no_forest_are_noticed() {
    let slope = |v: &Image<f64>| amplitude_slope(&spectrum(v));
    leaves(
        "slope",
        ranges::SLOPE,
        mean_of(Clone::clone, slope),
        &[
            ("out of focus", mean_of(|p| smeared(p, 7, 7), slope)),
            ("flat with noise", mean_of(noise, slope)),
        ],
    );
    let kurtosis = |v: &Image<f64>| tones(v).gradient_kurtosis;
    leaves(
        "kurtosis of steps",
        ranges::KURTOSIS,
        mean_of(Clone::clone, kurtosis),
        &[("flat with noise", mean_of(noise, kurtosis))],
    );
    leaves(
        "isotropy",
        ranges::ISOTROPY,
        mean_of(Clone::clone, isotropy),
        &[
            ("moved sideways", mean_of(|p| smeared(p, 5, 1), isotropy)),
            ("moved up", mean_of(|p| smeared(p, 1, 5), isotropy)),
        ],
    );
    let log_sd = |haze: f64| {
        mean(|i| {
            let light = luminance_of_light(i.linear.as_ref().expect("asked for"), i.ev100);
            tones(&light.map(|v| v + haze)).log_sd
        })
    };
    leaves(
        "log-luminance SD",
        ranges::LOG_LUMINANCE_SD,
        log_sd(0.0),
        &[("in a mist", log_sd(1.0))],
    );
}

#[test]
#[ignore = "a minute: .ci/full runs it"]
fn crowns_of_other_colours_are_noticed() {
    // The first camera is mounted like PhenoCams on towers, as a second one would need one more
    // picture.
    let tower = ["camera.mount_z_m=45", "camera.mount_pitch_deg=60"];
    let images = taken("spruce", &nemoral_tests::store(), &tower).1;
    let painted = |paint: fn([u8; 3]) -> [u8; 3]| {
        let of = |images: &Arc<Vec<CameraImages>>| {
            let from_above = &images[0];
            let semantic = &from_above.truth.semantic;
            colour(&from_above.rgb.map(|p| paint(*p)), semantic)
        };
        let found: Vec<_> = images.iter().filter_map(of).collect();
        let n = found.len() as f64;
        assert!(n > 0.0, "there are leaves");
        let sum = |of: fn(&nemoral_realism::Colour) -> f64| found.iter().map(of).sum::<f64>();
        (
            sum(|c| c.gcc) / n,
            sum(|c| c.hue_deg) / n,
            sum(|c| c.glaring) / n,
        )
    };
    let sound = painted(|p| p);
    let lime = painted(|[r, g, b]| [r / 2, g.max(60).saturating_mul(3), b / 4]);
    let autumn = painted(|[r, g, b]| [r.saturating_mul(2), g, b / 2]);
    let range = ranges::green("spruce", 1.0);
    let broken = [("lime", lime.0), ("autumn", autumn.0)];
    leaves("GCC", range, sound.0, &broken);
    leaves("hue", ranges::HUE_DEG, sound.1, &[("autumn", autumn.1)]);
    leaves("glaring", ranges::GLARING, sound.2, &[("lime", lime.2)]);
}

#[test]
#[ignore = "a minute: .ci/full runs it"]
fn classes_that_are_missing_are_noticed() {
    let ontology = Ontology::by_name("paper").expect("the paper's");
    let share = |images: &[Arc<Vec<CameraImages>>], class: &str| {
        let mut counts = ClassCounts::default();
        for image in images {
            counts.add(
                &ontology,
                image[0].truth.semantic.pixels(),
                std::iter::empty::<Semantic>(),
            );
        }
        let shares = counts.shares(&ontology);
        let share = shares.iter().find(|s| s.0 == class);
        share.unwrap_or_else(|| panic!("{class}")).1
    };
    let broken = [
        (
            "no trees",
            &["placement.trees=0", "placement.regeneration.saplings=0"][..],
            &["Trunks", "Canopy"][..],
        ),
        (
            "no shrubs",
            &[
                "placement.shrubs=0",
                "undergrowth.cover=0",
                "undergrowth.thickets.bramble=0",
                "undergrowth.thickets.heath=0",
                "climbers.ivy=0",
                "climbers.honeysuckle=0",
            ],
            &["Shrubs"],
        ),
        (
            "no undergrowth",
            &[
                "undergrowth.cover=0",
                "undergrowth.litter=0",
                "undergrowth.sward.cover=0",
                "undergrowth.thickets.nettles=0",
                "undergrowth.thickets.reeds=0",
                "placement.regeneration.seedlings=0",
                "trails.grass_max=0",
                "trails.verge_per_m=0",
            ],
            &["Herbaceous"],
        ),
        ("no trails", &["trails.enabled=false"], &["Traversable"]),
        (
            "the camera looks up",
            &["camera.mount_pitch_deg=-60"],
            &["Terrain"],
        ),
        (
            "the camera looks down",
            &["camera.mount_pitch_deg=60"],
            &["Background"],
        ),
    ];
    for (cause, settings, classes) in broken {
        let without = taken("montado", &STAND.store, settings).1;
        for class in classes {
            let range = ranges::class_share(class).expect("not of rocks");
            let broken = [(cause, share(&without, class))];
            let measure = format!("share of {class}");
            leaves(&measure, range, share(&STAND.images, class), &broken);
        }
    }
}

#[test]
#[ignore = "a minute: .ci/full runs it"]
fn ground_that_shows_its_tile_is_noticed() {
    let materials = STAND.assets.library.materials.materials();
    let ground: Vec<&Material> = materials.iter().filter(|m| m.ground).collect();
    assert!(ground.len() > 3, "a floor and trails");
    for material in ground {
        let tiled = Material {
            ground: false,
            ..material.clone()
        };
        let broken = [("tiled", ground_repetition(&tiled))];
        let sound = ground_repetition(material);
        leaves(&material.name, ranges::GROUND_REPEATS, sound, &broken);
    }
}
