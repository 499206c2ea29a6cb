//! Measurement of a stand.

use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::sync::Arc;

use nemoral_assets::{Species, TreeAsset};
use nemoral_pipeline::ForestPlan;
use nemoral_pipeline::config::Config;
use nemoral_pipeline::plan::Runner;
use nemoral_pipeline::world::assets::WorldAssets;
use nemoral_realism::{
    Canopy, ClassCounts, Colour, CopyKind, Gaps, LayerCover, Layers, LowCover, STATIONS,
    ScannedDiameters, StemVisibility, Survey, Tones, amplitude_slope, asked_diameters,
    asked_shapes, clark_evans, colour, distribution_distance, ground_repetition, isotropy,
    law_per_m, layers, luminance, luminance_of_light, mark_correlation, pair_correlation,
    plant_area_density, spectrum, tones, weibull_fit,
};
use nemoral_realism::{World, config};
use nemoral_scene::glam::{DVec2, DVec3, Vec3};
use nemoral_scene::{ChunkCoord, Image, Ray, Surface, TreeRecord};
use nemoral_seed::{Draw, Key};

/// Side of the square whose trees are counted, chunks.
pub(crate) const SIDE: i32 = 8;
/// Side of the square whose leaves are counted, chunks.
const LEAFY_SIDE: i32 = 5;
/// Distance from the border of that square to where lines begin, metres: 1.57 times the height of
/// the trees.
const MARGIN_M: f64 = 60.0;
/// Edge of the smallest voxels by which clumping is shown, metres: the size of a shoot's picture.
const VOXEL_M: f64 = 0.4;
const LINES: usize = 8_000;
/// Number of photographs of the sky from under the trees.
const PHOTOGRAPHS: usize = 200;
/// The ring step of the pair correlation, metres.
pub(crate) const STEP_M: f64 = 0.5;

/// The middle of a ring of the pair correlation, metres.
pub(crate) fn ring_m(i: usize) -> f64 {
    (i as f64 + 0.5) * STEP_M
}
/// Frames whose pictures and scans are measured.
const FRAMES: [u64; 5] = [0, 6, 12, 18, 24];
/// Pulses from above at each frame.
const PULSES: u32 = 20_000;
/// Pulses from above come down within this distance of the robot, metres.
const FLIGHT_M: f64 = 45.0;

/// A stand, measured.
pub(crate) struct Stand {
    pub(crate) name: &'static str,
    pub(crate) config: Config,
    /// Living trees without saplings.
    pub(crate) trees: Vec<TreeRecord>,
    pub(crate) per_chunk: f64,
    pub(crate) basal_area_m2_ha: f64,
    /// Share of the trees within their species' limits of slenderness.
    pub(crate) slender: f64,
    /// Distance between the distributions of the trees' diameters and of those asked for.
    pub(crate) diameter_distance: f64,
    /// Shape and scale of the Weibull distribution of the trees' diameters.
    pub(crate) weibull: (f64, f64),
    /// The range of the shape that so few individuals allow.
    pub(crate) shapes: (f64, f64),
    pub(crate) clark_evans: f64,
    pub(crate) pairs: Vec<f64>,
    pub(crate) marks: f64,
    /// Pairs of the same individual within 30 m that look alike, and all such pairs, of grown and
    /// dead trees.
    pub(crate) alike: (usize, usize),
    /// The same of saplings.
    pub(crate) saplings_alike: (usize, usize),
    /// Diameters by circles fitted to scans.
    pub(crate) scanned: ScannedDiameters,
    pub(crate) dominant_m: f64,
    pub(crate) leaf_area_index: f64,
    pub(crate) gaps: Gaps,
    /// Silhouette over leaf area, as the species' files ask for.
    pub(crate) silhouette: f64,
    /// Ω as photographs of the sky find it.
    pub(crate) photographed: f64,
    pub(crate) by_scale: Vec<(f64, f64)>,
    /// Share of lines along the hinge, from 1.3 m up, that meet no leaf; `openness` is that of
    /// lines that meet nothing of a tree.
    pub(crate) leafless: f64,
    pub(crate) openness: f64,
    pub(crate) openness_above: f64,
    /// Mean and standard deviation of the leaves' inclination by species, degrees.
    pub(crate) inclination: BTreeMap<String, (f64, f64)>,
    /// Plant area density by metre above ground, m²/m³.
    pub(crate) profile: Vec<f64>,
    pub(crate) layers: Layers,
    pub(crate) low_cover: LowCover,
    pub(crate) layer_cover: LayerCover,
    /// How fast stems go out of sight with distance, and the share that is seen by distance.
    pub(crate) visibility: StemVisibility,
    /// The same between stems alone that stand at random, per metre.
    pub(crate) sight_law_per_m: f64,
    /// Lying deadwood, m³/ha.
    pub(crate) deadwood_m3_ha: f64,
    pub(crate) slope: f64,
    pub(crate) isotropy: f64,
    pub(crate) tones: Tones,
    pub(crate) colour: Option<Colour>,
    /// Colour of foliage from above the crowns.
    pub(crate) colour_from_above: Option<Colour>,
    /// Repetition of the kind of ground that repeats most.
    pub(crate) ground_repeats: f64,
    /// Share of the pixels and of the points, by class.
    pub(crate) classes: Vec<(String, f64, f64)>,
}

impl Stand {
    pub(crate) fn measure(name: &'static str) -> Self {
        let settings = [
            "frames=25",
            "robot.spacing_m=4",
            "chunks.visible_radius_m=150",
            "chunks.undergrowth_radius_m=60",
            "chunks.delete_radius_m=250",
            "camera.width_px=640",
            "camera.height_px=360",
            "camera.edge_samples=4",
            "camera.radiance=true",
            // A camera sees the crowns from above, like PhenoCams on towers.
            "cameras.tower.mount_z_m=45",
            "cameras.tower.mount_pitch_deg=60",
            "lidar.pulses=20000",
        ];
        let world = World::new(name, &settings);
        let runner = world.runner(2);
        let assets = runner.get(world.forest.assets, ()).expect("assets");
        let survey = Survey::of(&world, &runner, &assets, SIDE);
        let (low, edge_m) = survey.square;
        let places = survey.places();
        let diameters: Vec<f64> = survey.trees.iter().map(|t| t.dbh_m).collect();
        let marked: Vec<(DVec2, f64)> = places
            .iter()
            .copied()
            .zip(diameters.iter().copied())
            .collect();
        let basal = diameters.iter().map(|d| d * d).sum::<f64>() * TAU / 8.0;
        let area_m2 = edge_m * edge_m;

        let canopy = canopy(&world, &runner, &assets);
        let dominant_m = survey.dominant_height_m();
        let profile = profile(&world, &runner);
        let views = Views::take(&world, &runner);
        Self {
            name,
            per_chunk: survey.trees.len() as f64 / f64::from(SIDE * SIDE),
            basal_area_m2_ha: basal / area_m2 * 10_000.0,
            slender: slender(&survey.trees),
            diameter_distance: distribution_distance(
                &diameters,
                &asked_diameters(&world.config.assets),
            ),
            weibull: weibull_fit(&diameters),
            shapes: asked_shapes(&world.config.assets),
            clark_evans: clark_evans(&places, low, edge_m, 25.0),
            pairs: pair_correlation(&places, edge_m, STEP_M, 30),
            marks: mark_correlation(&marked, 3.5),
            alike: survey.alike(|k| k != CopyKind::Sapling, 30.0),
            saplings_alike: survey.alike(|k| k == CopyKind::Sapling, 30.0),
            scanned: scanned(name, &world),
            dominant_m,
            leaf_area_index: survey.trees.iter().map(|t| t.leaf_area_m2).sum::<f64>() / area_m2,
            gaps: canopy.gaps(),
            silhouette: silhouette(&survey.trees),
            photographed: canopy.clumping_as_photographed(PHOTOGRAPHS),
            by_scale: canopy.clumping_by_scale(VOXEL_M, 5),
            leafless: canopy.leafless(),
            openness: canopy.openness(),
            openness_above: canopy.openness_above(),
            inclination: inclinations(&assets),
            layers: layers(&profile, dominant_m),
            low_cover: low_cover(&world, &runner, &assets),
            layer_cover: LayerCover::of(&world, &runner, &assets, &FRAMES),
            visibility: StemVisibility::of(&world, &runner, &assets, &survey.trees, &FRAMES),
            sight_law_per_m: law_per_m(&survey.trees, area_m2),
            deadwood_m3_ha: survey.deadwood_m3_ha,
            profile,
            slope: Views::mean(&views.luminances, |v| amplitude_slope(&spectrum(v))),
            isotropy: Views::mean(&views.luminances, isotropy),
            tones: Tones {
                log_sd: Views::mean(&views.lights, |v| tones(v).log_sd),
                gradient_kurtosis: Views::mean(&views.luminances, |v| tones(v).gradient_kurtosis),
            },
            colour: mean_colour(&views.colours),
            colour_from_above: mean_colour(&views.from_above),
            ground_repeats: ground_repeats(&assets),
            classes: views.classes,
            trees: survey.trees,
            config: world.config,
        }
    }
}

/// Scans the same stand from a tripod, with the library and chunks that are already computed.
fn scanned(name: &str, world: &World) -> ScannedDiameters {
    let config = config(name, &STATIONS);
    let forest = ForestPlan::new(&config).expect("a preset");
    let runner = Runner::new(forest.plan(), &world.store, 2);
    ScannedDiameters::of(&forest, &config, &runner)
}

fn ground_repeats(assets: &WorldAssets) -> f64 {
    let materials = assets.library.materials.materials().iter();
    let ground = materials.filter(|m| m.ground);
    ground.map(ground_repetition).fold(-1.0, f64::max)
}

fn canopy(world: &World, runner: &Runner<'_>, assets: &WorldAssets) -> Canopy {
    let survey = Survey::of(world, runner, assets, LEAFY_SIDE);
    Canopy::new(
        &survey.leafy,
        &assets.library.materials,
        survey.square,
        MARGIN_M,
        LINES,
    )
}

fn slender(trees: &[TreeRecord]) -> f64 {
    let fits = |t: &&TreeRecord| {
        Species::built_in(&t.species).is_some_and(|s| {
            let [least, most] = s.allometry.slenderness;
            (least..=most).contains(&(t.height_m / t.dbh_m))
        })
    };
    trees.iter().filter(fits).count() as f64 / trees.len() as f64
}

/// The silhouette factors that the species' files ask for, by leaf area.
fn silhouette(trees: &[TreeRecord]) -> f64 {
    let (mut sum, mut area) = (0.0, 0.0);
    for tree in trees {
        if let Some(species) = Species::built_in(&tree.species) {
            sum += species.foliage.silhouette_factor * tree.leaf_area_m2;
            area += tree.leaf_area_m2;
        }
    }
    sum / area
}

/// The leaves' inclinations by species, each card with the weight of its leaf.
fn inclinations(assets: &WorldAssets) -> BTreeMap<String, (f64, f64)> {
    let mut sums: BTreeMap<String, [f64; 3]> = BTreeMap::new();
    let trees: &[TreeAsset] = &assets.library.trees;
    for tree in trees {
        let sum = sums.entry(tree.species.clone()).or_default();
        for card in tree.prototype.cards() {
            let normal = card.edge_u.as_dvec3().cross(card.edge_v.as_dvec3());
            let area = normal.length();
            let degrees = (normal.z.abs() / area).min(1.0).acos().to_degrees();
            for (s, v) in sum.iter_mut().zip([1.0, degrees, degrees * degrees]) {
                *s += area * v;
            }
        }
    }
    let moments = |[n, s, q]: [f64; 3]| (s / n, (q / n - (s / n).powi(2)).max(0.0).sqrt());
    sums.into_iter()
        .map(|(name, s)| (name, moments(s)))
        .collect()
}

/// The profile of an airborne scanner: from first returns of pulses within 10° of the vertical,
/// with everything that grows there.
fn profile(world: &World, runner: &Runner<'_>) -> Vec<f64> {
    let mut heights_m = Vec::new();
    for frame in FRAMES {
        let scene = runner.get(world.forest.scene, frame).expect("a scene");
        let pose = runner.get(world.forest.pose, frame).expect("a pose");
        let here = pose.world_from_body().translation_m;
        let mut rng = Key::world(11).item(frame).rng();
        let mut pulse = || {
            let (s, c) = rng.range_f64(0.0, TAU).sin_cos();
            let place = here + DVec3::new(c, s, 0.0) * FLIGHT_M * rng.unit_f64().sqrt();
            let tilt = DVec2::from_angle(rng.range_f64(0.0, TAU)) * 0.176 * rng.unit_f64().sqrt();
            let down = tilt.extend(-1.0).normalize();
            let origin = place - scene.origin_m - down * (80.0 / -down.z);
            Ray::new(origin.as_vec3(), down.as_vec3())
        };
        let rays: Vec<Ray> = (0..PULSES).map(|_| pulse()).collect();
        let mut hits = vec![None; rays.len()];
        scene.caster.closest_hits(&rays, &mut hits);
        for (ray, hit) in rays.iter().zip(hits) {
            let Some(hit) = hit else { continue };
            let at = scene.origin_m + ray.at(hit.surface.distance_m).as_dvec3();
            let chunk = ChunkCoord::containing(at.truncate(), world.config.chunks.size_m);
            let ground = runner.get(world.forest.ground, chunk).expect("ground");
            heights_m.push(at.z - ground.height_m(at.truncate()));
        }
    }
    plant_area_density(&heights_m, 45)
}

/// Cover of low plants along lines straight down from 2 m above ground, trails included.
fn low_cover(world: &World, runner: &Runner<'_>, assets: &WorldAssets) -> LowCover {
    const FROM_M: f64 = 2.0;
    let mut cover = LowCover::default();
    for frame in FRAMES {
        let scene = runner.get(world.forest.scene, frame).expect("a scene");
        let pose = runner.get(world.forest.pose, frame).expect("a pose");
        let here = pose.world_from_body().translation_m.truncate();
        let mut rng = Key::world(13).item(frame).rng();
        let mut line = || {
            let to = DVec2::from_angle(rng.range_f64(0.0, TAU)) * FLIGHT_M * rng.unit_f64().sqrt();
            let place = here + to;
            let chunk = ChunkCoord::containing(place, world.config.chunks.size_m);
            let ground = runner.get(world.forest.ground, chunk).expect("ground");
            let from = place.extend(ground.height_m(place) + FROM_M) - scene.origin_m;
            Ray::new(from.as_vec3(), Vec3::NEG_Z)
        };
        let rays: Vec<Ray> = (0..PULSES).map(|_| line()).collect();
        let mut hits = vec![None; rays.len()];
        scene.caster.closest_hits(&rays, &mut hits);
        let materials = assets.library.materials.materials();
        for hit in hits {
            cover.add(hit.and_then(|h| materials.get(h.surface.material.0 as usize)));
        }
    }
    cover
}

/// What the robot's sensors and a camera high above it see.
struct Views {
    luminances: Vec<Image<f64>>,
    /// Luminance before the sensor clips.
    lights: Vec<Image<f64>>,
    colours: Vec<Colour>,
    from_above: Vec<Colour>,
    classes: Vec<(String, f64, f64)>,
}

impl Views {
    fn take(world: &World, runner: &Runner<'_>) -> Self {
        let ontology = world.config.output.ontology.table();
        let (mut luminances, mut lights) = (Vec::new(), Vec::new());
        let (mut colours, mut from_above) = (Vec::new(), Vec::new());
        let mut seen = ClassCounts::default();
        for frame in FRAMES {
            let images = runner.get(world.forest.images, frame).expect("a picture");
            let picture = &images[0];
            luminances.push(luminance(&picture.rgb));
            let light = picture.linear.as_ref().expect("asked for");
            lights.push(luminance_of_light(light, picture.ev100));
            colours.extend(colour(&picture.rgb, &picture.truth.semantic));
            let tower = &images[1];
            from_above.extend(colour(&tower.rgb, &tower.truth.semantic));
            let scans: Arc<_> = runner.get(world.forest.scans, frame).expect("a scan");
            seen.add(
                &ontology,
                picture.truth.semantic.pixels(),
                scans[0].iter().map(|p| p.semantic),
            );
        }
        Self {
            luminances,
            lights,
            colours,
            from_above,
            classes: seen.shares(&ontology),
        }
    }

    fn mean(pictures: &[Image<f64>], of: impl Fn(&Image<f64>) -> f64) -> f64 {
        pictures.iter().map(of).sum::<f64>() / pictures.len() as f64
    }
}

fn mean_colour(colours: &[Colour]) -> Option<Colour> {
    let n = colours.len() as f64;
    let mean = |of: fn(&Colour) -> f64| colours.iter().map(of).sum::<f64>() / n;
    (!colours.is_empty()).then(|| Colour {
        gcc: mean(|c| c.gcc),
        glaring: mean(|c| c.glaring),
        hue_deg: mean(|c| c.hue_deg),
    })
}
