//! Deadwood: logs, thrown trees with their root plates, and how they lie.

use nemoral_assets::{Library, LogAsset, PlantKind};
use nemoral_placement::Site;
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, DecayStage, ObjectKind, Surface};
use nemoral_seed::{Domain, Key};
use nemoral_stand::{
    FallenStem, LyingPlacement, LyingStem, ObjectSite, ObjectSize, StemKind, StemScale,
    StemSupport, fallen_stems, mean_volume_m3, roll_rad,
};

use super::assets::WorldAssets;
use super::chunk_ground::ChunkGround;
use super::ground::GroundModel;
use super::windthrow::{LOG_REACH_M, WindthrownTree};
use crate::config::{self, Config};
use crate::plan::{Encode, Encoder};

const LOGS: Domain = Domain::new("pipeline.logs");

/// Stages of decay spread about their mean by this.
const SPREAD: f64 = 1.1;
/// A round stem rolls down a slope across it that is steeper than this, until something holds it.
const ROLLS: f64 = 0.30;
/// Least distance of a log from a trail's edge, metres.
const VERGE_M: f64 = 0.35;
/// Least distance of a log from water, metres.
const BANK_M: f64 = 0.3;
/// How deep logs lie in the ground, as a share of their height, by stage.
const SUNK: [f64; 5] = [0.05, 0.08, 0.15, 0.32, 0.48];

/// Where logs may lie in a chunk.
pub(crate) struct Surroundings<'a> {
    pub(crate) ground: &'a ChunkGround,
    pub(crate) model: &'a GroundModel,
    /// What stands in the chunk and its neighbours.
    pub(crate) sites: &'a [Site],
}

/// The logs that a config wants.
#[derive(Clone, Debug)]
pub(crate) struct LogRecipe {
    deadwood: config::Deadwood,
    chunk_size_m: f64,
}

impl Encode for LogRecipe {
    fn encode(&self, encoder: &mut dyn Encoder) {
        let Self {
            deadwood,
            chunk_size_m,
        } = self;
        encoder.field("deadwood", deadwood);
        encoder.field("chunk_size_m", chunk_size_m);
    }
}

impl LogRecipe {
    pub(crate) fn new(config: &Config) -> Self {
        Self {
            deadwood: config.deadwood.clone(),
            chunk_size_m: config.chunks.size_m,
        }
    }

    /// Whether there are no logs at all.
    pub(crate) fn is_empty(&self) -> bool {
        self.deadwood.volume_m3_ha <= 0.0
    }

    /// The logs of a chunk, before those of its neighbours are looked at.
    pub(crate) fn logs(
        &self,
        at: ChunkCoord,
        world: Key,
        assets: &WorldAssets,
        around: &Surroundings<'_>,
    ) -> Vec<FallenStem> {
        let Self {
            deadwood: wanted,
            chunk_size_m,
        } = self;
        let chunk_size_m = *chunk_size_m;
        let kinds = kinds(assets, wanted.decay);
        let mean = mean_count(assets, wanted, &kinds, chunk_size_m);
        let origin = at.origin_m(chunk_size_m);
        let near: Vec<&Site> = (around.sites.iter())
            .filter(|s| {
                let off = s.position_m - origin;
                let out = (-off).max(off - chunk_size_m).max_element();
                out < LOG_REACH_M + s.radius_m
            })
            .collect();
        let thrown = around.model.thrown_around(at, LOG_REACH_M);
        let is_free = |stem: &FallenStem| {
            let ground = around.ground;
            let across = stem
                .heading
                .perp()
                .dot(ground.sample(stem.middle_m).gradient);
            if across.abs() > ROLLS {
                return false;
            }
            let steps = (stem.length_m / 0.8).ceil();
            let on_trail = (0..=steps as u32).any(|i| {
                let s = (f64::from(i) / steps - 0.5) * stem.length_m;
                let edge = ground.trail_edge_m(stem.middle_m + stem.heading * s);
                edge < stem.radius_m + VERGE_M
            });
            let in_water = (0..=steps as u32).any(|i| {
                let s = (f64::from(i) / steps - 0.5) * stem.length_m;
                let p = stem.middle_m + stem.heading * s;
                !ground.is_clear_of_water(p, stem.radius_m + BANK_M)
            });
            (wanted.across_trails || !on_trail)
                && !in_water
                && ground.open_m(stem.middle_m) < 0.4 * stem.length_m
                && !near.iter().any(|site| {
                    let room = site.radius_m + stem.radius_m + 0.04;
                    stem.distance_m(site.position_m) < room
                })
                && !thrown.iter().any(|tree| tree.is_near_stem(stem))
        };
        fallen_stems(at, chunk_size_m, world.domain(LOGS), mean, &kinds, is_free)
    }
}

/// The mean number of logs in a chunk: what thrown trees leave of the volume that is asked for.
fn mean_count(
    assets: &WorldAssets,
    wanted: &config::Deadwood,
    kinds: &[StemKind],
    chunk_size_m: f64,
) -> f64 {
    let of = &assets.library.deadwood;
    let thrown_m3 = if of.thrown.is_empty() {
        0.0
    } else {
        let shape = WindthrownTree::kind(assets.dbh_mean_m);
        let volumes = of.thrown.iter().map(|log| volume_of_thrown_m3(log, &shape));
        mean_volume_m3(&[StemKind {
            volume_m3: volumes.sum::<f64>() / of.thrown.len() as f64,
            ..shape
        }])
        .unwrap_or(0.0)
    };
    let hectares = chunk_size_m * chunk_size_m / 10_000.0;
    let rest_m3 = hectares * (wanted.volume_m3_ha - wanted.thrown_per_ha * thrown_m3);
    mean_volume_m3(kinds).map_or(0.0, |mean_m3| rest_m3.max(0.0) / mean_m3)
}

/// The volume of a thrown tree's log that is made as large as a stem of this kind.
fn volume_of_thrown_m3(log: &LogAsset, stem: &StemKind) -> f64 {
    let across = stem.radius_m / (0.5 * log.diameter_m[0]);
    log.volume_m3 * (stem.length_m / log.length_m) * across * across
}

/// The logs of the library as kinds, by the shares of species and the mean stage of decay.
fn kinds(assets: &WorldAssets, decay: f64) -> Vec<StemKind> {
    let of_stage = |stage: DecayStage| {
        let off = (f64::from(stage.number()) - decay) / SPREAD;
        libm::exp(-0.5 * off * off)
    };
    let logs = assets.library.deadwood.logs.iter();
    let mut kinds: Vec<StemKind> = logs
        .map(|log| StemKind {
            weight: of_stage(log.stage) * assets.share_of(&log.species),
            length_m: log.length_m,
            radius_m: 0.5 * log.diameter_m[0],
            volume_m3: log.volume_m3,
            scale: StemScale::GROWN,
        })
        .collect();
    assets.models.mix_in_logs(&mut kinds);
    kinds
}

/// Logs, thrown stems and root plates as they lie on the ground of a chunk.
pub(crate) fn lying_sites(
    logs: &[FallenStem],
    thrown: &[WindthrownTree],
    assets: &WorldAssets,
    ground: &ChunkGround,
) -> Vec<ObjectSite> {
    let library = &assets.library;
    let mut sites: Vec<ObjectSite> = logs
        .iter()
        .map(|stem| {
            let may_roll = !assets.models.contain(ObjectKind::Log, stem.kind);
            log_site(stem, &library.deadwood.logs[stem.kind], may_roll, ground)
        })
        .collect();
    for tree in thrown {
        sites.extend(thrown_sites(tree, library, ground));
    }
    sites
}

/// A log as it lies. One that may not roll has its upper side up, as its model has.
fn log_site(stem: &FallenStem, log: &LogAsset, may_roll: bool, ground: &ChunkGround) -> ObjectSite {
    let half_height_m = log.half_height_m.map(|h| h * stem.radius_scale);
    let shape = LyingStem {
        length_m: stem.length_m,
        half_height_m,
    };
    let (support, is_round) = match log.stage {
        DecayStage::Fresh | DecayStage::Loosening => (StemSupport::Stiff, true),
        DecayStage::Bare => (StemSupport::Sagging, true),
        DecayStage::Soft | DecayStage::Rotten => (StemSupport::Sagging, false),
    };
    let roll = if is_round && may_roll {
        roll_rad(stem.key)
    } else {
        0.0
    };
    let sink_m = SUNK[log.stage.index()] * (half_height_m[0] + half_height_m[1]);
    let pose = shape.pose_on_ground(ground, stem.middle_m, stem.heading, support, sink_m, roll);
    ObjectSite {
        kind: ObjectKind::Log,
        position_m: stem.middle_m,
        radius_m: 0.5 * stem.length_m,
        asset: stem.kind,
        size: ObjectSize::Given(1.0),
        key: stem.key,
        on_trail: false,
        facing_rad: None,
        lying: Some(LyingPlacement {
            pose,
            scale: [stem.length_scale, stem.radius_scale],
            half_width_m: stem.radius_m,
        }),
    }
}

/// The stem of a thrown tree and its root plate.
fn thrown_sites(tree: &WindthrownTree, library: &Library, ground: &ChunkGround) -> Vec<ObjectSite> {
    let of = &library.deadwood;
    if of.thrown.is_empty() {
        return Vec::new();
    }
    let stem = &tree.stem;
    let number = tree.number(of.thrown.len());
    let log = &of.thrown[number];
    let plate = &library.plants[PlantKind::RootPlate][number];
    let across = stem.radius_m / (0.5 * log.diameter_m[0]);
    let scale = [stem.length_m / log.length_m, across];
    let shape = LyingStem {
        length_m: stem.length_m,
        half_height_m: log.half_height_m.map(|h| h * across),
    };
    let held_m = tree.held_m();
    let (middle, heading) = (stem.middle_m, stem.heading);
    let support = StemSupport::Held(held_m);
    let pose = shape.pose_on_ground(ground, middle, heading, support, 0.0, roll_rad(stem.key));
    let axis = pose.rotation.x_axis.as_dvec3();
    let mut of_plate = pose;
    of_plate.position_m -= axis * (0.5 * stem.length_m);
    let size = tree.plate_radius_m() / plate.radius_m;
    let site = |kind, asset, radius_m, position_m: DVec2, lying| ObjectSite {
        kind,
        position_m,
        radius_m,
        asset,
        size: ObjectSize::Given(1.0),
        key: stem.key.item(u64::from(kind == ObjectKind::RootPlate)),
        on_trail: false,
        facing_rad: None,
        lying: Some(lying),
    };
    vec![
        site(
            ObjectKind::Log,
            of.logs.len() + number,
            0.5 * stem.length_m,
            middle,
            LyingPlacement {
                pose,
                scale,
                half_width_m: stem.radius_m,
            },
        ),
        site(
            ObjectKind::RootPlate,
            number,
            tree.plate_radius_m(),
            of_plate.position_m.truncate(),
            LyingPlacement {
                pose: of_plate,
                scale: [size, size],
                half_width_m: tree.plate_radius_m(),
            },
        ),
    ]
}
