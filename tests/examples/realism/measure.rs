//! What is measured of a stand.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use nemoral_assets::TreeAsset;
use nemoral_pipeline::config::Config;
use nemoral_pipeline::plan::Runner;
use nemoral_pipeline::stages::assets::WorldAssets;
use nemoral_pipeline::stages::frame::FrameScene;
use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_scene::{ChunkCoord, Ontology, Ray, RayCaster, Semantic, Surface, TreeRecord};
use nemoral_seed::{Draw, Key};
use nemoral_tests::World;
use nemoral_tests::realism::{
    Colour, amplitude_slope, clark_evans, colour, luminance, pair_correlation, spectrum,
    weibull_fit,
};

/// Chunks along a side of the square whose trees are counted.
const SIDE: i32 = 8;
/// The ring step of the pair correlation, metres.
pub(crate) const STEP_M: f64 = 0.5;
/// Frames that are looked at.
const FRAMES: [u64; 3] = [0, 12, 24];
/// Where leaves of any inclination project alike.
const HINGE_DEG: f64 = 57.5;
/// Azimuths that a sky is cut into for its clumping.
const SECTORS: usize = 24;

/// A stand, measured.
pub(crate) struct Stand {
    pub(crate) name: &'static str,
    pub(crate) config: Config,
    /// Living trees without saplings.
    pub(crate) trees: Vec<TreeRecord>,
    pub(crate) per_chunk: f64,
    pub(crate) basal_area_m2_ha: f64,
    pub(crate) weibull: (f64, f64),
    pub(crate) clark_evans: f64,
    pub(crate) pairs: Vec<f64>,
    pub(crate) leaf_area_index: f64,
    /// Along the hinge, from 1.3 m up.
    pub(crate) openness: f64,
    /// Lang and Xiang's.
    pub(crate) clumping: f64,
    /// By species: mean and standard deviation of the leaves' inclination, degrees.
    pub(crate) inclination: BTreeMap<String, (f64, f64)>,
    /// Plant area density by metre above ground, m²/m³.
    pub(crate) profile: Vec<f64>,
    pub(crate) slope: f64,
    pub(crate) colour: Option<Colour>,
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
            "camera.samples=4",
            "lidar.pulses=20000",
        ];
        let world = World::new(name, &settings);
        let runner = world.runner(2);
        let size_m = world.config.chunks.size_m;
        let assets = runner.get(world.forest.assets, ()).expect("assets");
        let trees = trees(&world, &runner, &assets);
        let edge_m = size_m * f64::from(SIDE);
        let places: Vec<DVec2> = trees.iter().map(|t| t.position_m.truncate()).collect();
        let low = DVec2::splat(-f64::from(SIDE / 2) * size_m);
        let hectares = edge_m * edge_m / 10_000.0;
        let diameters: Vec<f64> = trees.iter().map(|t| t.dbh_m).collect();
        let basal = diameters.iter().map(|d| d * d).sum::<f64>() * TAU / 8.0;
        let mut sky = Sky::default();
        let (mut slope, mut tints, mut classes) = (0.0, Vec::new(), Classes::default());
        let ontology = Ontology::by_name(&world.config.output.ontology).expect("an ontology");
        for frame in FRAMES {
            let scene = runner.get(world.forest.scene, frame).expect("a scene");
            let pose = runner.get(world.forest.pose, frame).expect("a pose");
            let here = pose.world_from_body().translation_m.truncate();
            sky.look(&world, &runner, &scene, &assets, here, frame);
            let images = &runner.get(world.forest.images, frame).expect("a picture")[0];
            slope += amplitude_slope(&spectrum(&luminance(&images.rgb))) / FRAMES.len() as f64;
            tints.extend(colour(&images.rgb, &images.truth.semantic));
            let scans = runner.get(world.forest.scans, frame).expect("a scan");
            classes.add(
                &ontology,
                images.truth.semantic.pixels(),
                scans[0].iter().map(|p| p.semantic),
            );
        }
        let mean = |of: fn(&Colour) -> f64| tints.iter().map(of).sum::<f64>() / tints.len() as f64;
        Self {
            name,
            per_chunk: trees.len() as f64 / f64::from(SIDE * SIDE),
            basal_area_m2_ha: basal / hectares,
            weibull: weibull_fit(&diameters),
            clark_evans: clark_evans(&places, low, edge_m, 25.0),
            pairs: pair_correlation(&places, edge_m, STEP_M, 30),
            leaf_area_index: trees.iter().map(|t| t.leaf_area_m2).sum::<f64>() / (edge_m * edge_m),
            openness: sky.openness(),
            clumping: sky.clumping(),
            inclination: inclinations(&assets),
            profile: sky.profile(),
            slope,
            colour: (!tints.is_empty()).then(|| Colour {
                gcc: mean(|c| c.gcc),
                glaring: mean(|c| c.glaring),
            }),
            classes: classes.shares(&ontology),
            trees,
            config: world.config,
        }
    }
}

fn trees(world: &World, runner: &Runner<'_>, assets: &WorldAssets) -> Vec<TreeRecord> {
    let half = SIDE / 2;
    let square: Vec<ChunkCoord> = (0..SIDE * SIDE)
        .map(|i| ChunkCoord::new(i % SIDE - half, i / SIDE - half))
        .collect();
    let things = runner
        .demand(world.forest.things)
        .all(&square)
        .expect("things");
    let all = things.iter().flat_map(|t| t.0.iter());
    let records = all.filter_map(|t| t.tree_record(assets));
    records
        .filter(|t| t.alive && t.age_class != "sapling")
        .collect()
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

/// What rays upwards meet.
#[derive(Default)]
struct Sky {
    /// Of every sector of every place: rays, and those that met the sky.
    sectors: Vec<(u32, u32)>,
    /// Heights above ground where rays to the zenith were stopped, metres.
    stops_m: Vec<f64>,
    zenith: u32,
}

impl Sky {
    fn look(
        &mut self,
        world: &World,
        runner: &Runner<'_>,
        scene: &FrameScene,
        assets: &WorldAssets,
        here: DVec2,
        frame: u64,
    ) {
        let mut rng = Key::world(11).item(frame).rng();
        let (sin, cos) = HINGE_DEG.to_radians().sin_cos();
        let size_m = world.config.chunks.size_m;
        let crown = |semantic: Semantic| {
            matches!(
                semantic,
                Semantic::Leaf
                    | Semantic::Needle
                    | Semantic::Stem
                    | Semantic::Limb
                    | Semantic::Branch
                    | Semantic::Twig
            )
        };
        for _ in 0..60 {
            let mut stray = || rng.range_f64(-40.0, 40.0);
            let place = here + DVec2::new(stray(), stray());
            let chunk = ChunkCoord::containing(place, size_m);
            let ground = runner.get(world.forest.ground, chunk).expect("ground");
            let foot = place.extend(ground.height_m(place)) - scene.origin_m;
            let cast = |direction: DVec3, from_m: f64| {
                let origin = foot + DVec3::Z * from_m;
                let ray = Ray::new(origin.as_vec3(), direction.as_vec3());
                let hit = scene.forest.closest_hit(&ray);
                hit.map(|h| {
                    let semantic = assets.library.materials.get(h.material).semantic;
                    (semantic, f64::from(h.distance_m))
                })
            };
            for sector in 0..SECTORS {
                let (mut rays, mut open) = (0, 0);
                for _ in 0..24 {
                    let azimuth = TAU * (sector as f64 + rng.unit_f64()) / SECTORS as f64;
                    let up = DVec3::new(sin * azimuth.cos(), sin * azimuth.sin(), cos);
                    match cast(up, 1.3) {
                        None => (rays, open) = (rays + 1, open + 1),
                        Some((semantic, _)) if crown(semantic) => rays += 1,
                        // Ground, shrubs: no matter of the canopy's.
                        Some(_) => {}
                    }
                }
                if rays > 0 {
                    self.sectors.push((rays, open));
                }
            }
            for _ in 0..60 {
                let tilt = DVec2::from_angle(rng.range_f64(0.0, TAU)) * rng.range_f64(0.0, 0.15);
                self.zenith += 1;
                if let Some((_, distance_m)) = cast(tilt.extend(1.0).normalize(), 0.1) {
                    self.stops_m.push(0.1 + distance_m);
                }
            }
        }
    }

    fn openness(&self) -> f64 {
        let (rays, open) = self
            .sectors
            .iter()
            .fold((0, 0), |(r, o), s| (r + s.0, o + s.1));
        f64::from(open) / f64::from(rays)
    }

    /// Lang and Xiang 1986: the logarithm of the mean gap fraction over the mean logarithm; a sector
    /// without a gap has half a ray's.
    fn clumping(&self) -> f64 {
        let logs = self
            .sectors
            .iter()
            .map(|&(rays, open)| (f64::from(open).max(0.5) / f64::from(rays)).ln());
        self.openness().max(1e-6).ln() / (logs.sum::<f64>() / self.sectors.len() as f64)
    }

    /// -d ln P / dz / K, K = 0.5 (Bouvier et al. 2015), of gap fractions seen from the ground.
    fn profile(&self) -> Vec<f64> {
        let beyond = |z: f64| {
            let below = self.stops_m.iter().filter(|s| **s < z).count();
            (f64::from(self.zenith) - below as f64).max(0.5) / f64::from(self.zenith)
        };
        (0..45)
            .map(|z| 2.0 * (beyond(f64::from(z)) / beyond(f64::from(z + 1))).ln())
            .collect()
    }
}

#[derive(Default)]
struct Classes {
    pixels: BTreeMap<usize, u32>,
    points: BTreeMap<usize, u32>,
}

impl Classes {
    fn add(
        &mut self,
        ontology: &Ontology,
        pixels: &[Semantic],
        points: impl Iterator<Item = Semantic>,
    ) {
        let id = |s: Semantic| usize::from(ontology.class(s).id);
        for s in pixels {
            *self.pixels.entry(id(*s)).or_default() += 1;
        }
        for s in points {
            *self.points.entry(id(s)).or_default() += 1;
        }
    }

    fn shares(&self, ontology: &Ontology) -> Vec<(String, f64, f64)> {
        let share = |of: &BTreeMap<usize, u32>, id| {
            let all: u32 = of.values().sum();
            f64::from(of.get(&id).copied().unwrap_or(0)) / f64::from(all.max(1))
        };
        let mut names: BTreeMap<usize, String> = BTreeMap::new();
        for s in Semantic::ALL {
            let class = ontology.class(*s);
            names.insert(usize::from(class.id), class.name.to_string());
        }
        names
            .into_iter()
            .map(|(id, name)| (name, share(&self.pixels, id), share(&self.points, id)))
            .collect()
    }
}
