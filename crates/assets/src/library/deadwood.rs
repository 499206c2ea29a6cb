//! Grows logs, root plates, fallen branches and brash.

use std::sync::Arc;

use nemoral_scene::{DecayStage, Prototype};
use nemoral_seed::{Domain, Draw, Key};
use rayon::prelude::*;

use super::plants::PlantGrower;
use super::{PlantAsset, prototype, with_occluders};
use crate::ambient_occlusion::Thickness;
use crate::materials::DeadwoodMaterials;
use crate::plant::branch::{branch, brash};
use crate::plant::log::{LogPlan, log};
use crate::plant::root_plate::root_plate;
use crate::plant::shape::Shape;

const LOGS: Domain = Domain::new("assets.logs");
const THROWN: Domain = Domain::new("assets.thrown");
const BRANCHES: Domain = Domain::new("assets.branches");
const BRASH: Domain = Domain::new("assets.brash");

/// Diameters of logs at their thick end, over the stand's mean diameter at breast height.
const DIAMETERS: [f64; 3] = [0.5, 0.85, 1.25];
/// The least of them, metres: what is thinner is a branch.
const THINNEST_M: f64 = 0.10;
/// Length over diameter of a log that is not broken.
const SLENDERNESS: [f64; 2] = [19.0, 28.0];
/// What is left of that length in one piece, by stage.
const PIECES: [f64; 5] = [1.0, 0.9, 0.75, 0.5, 0.36];
/// The stages of thrown trees, whose root plates still stand.
const THROWN_STAGES: [DecayStage; 3] = [DecayStage::Fresh, DecayStage::Loosening, DecayStage::Bare];
/// Variants of branches and of brash.
const VARIANTS: u32 = 12;

/// A log, or the stem of a thrown tree.
#[derive(Clone, Debug)]
pub struct LogAsset {
    /// Its shape: along x, the thick end at negative x, the middle of its axis at the origin, its
    /// upper side up.
    pub prototype: Arc<Prototype>,
    /// Its species, `snake_case`.
    pub species: String,
    /// Its stage of decay.
    pub stage: DecayStage,
    /// Its length, metres.
    pub length_m: f64,
    /// Diameters at its thick and its thin end, metres: those of circles as large as its sections.
    pub diameter_m: [f64; 2],
    /// Half of its height at its thick and its thin end, metres.
    pub half_height_m: [f64; 2],
    /// Its volume, m³.
    pub volume_m3: f64,
}

/// All stems that lie. The root plates of thrown trees, fallen branches and brash have a
/// [`PlantKind`](super::PlantKind).
#[derive(Clone, Debug, Default)]
pub struct Deadwood {
    /// Logs, species by species, in order of decay, and there thin ones first.
    pub logs: Vec<LogAsset>,
    /// Stems of thrown trees, species by species.
    pub thrown: Vec<LogAsset>,
}

impl PlantGrower<'_> {
    /// Logs and thrown stems, if deadwood was asked for.
    pub(super) fn deadwood(&self) -> Deadwood {
        let Some(of) = &self.materials.deadwood else {
            return Deadwood::default();
        };
        let mut logs = Vec::new();
        for (index, species) in self.params.species.iter().enumerate() {
            // The keys are the species' own, so that its logs do not depend on the other species.
            let own = Domain::new(&species.species.name);
            let key = self.key.domain(LOGS).domain(own);
            let plans = DecayStage::ALL.into_iter().flat_map(|stage| {
                let sizes = DIAMETERS.into_iter().enumerate();
                sizes.map(move |(i, d)| (stage, i as u64, (d * species.dbh_mean_m).max(THINNEST_M)))
            });
            let plans: Vec<(DecayStage, u64, f64)> = plans.collect();
            let of_species = plans.into_par_iter().map(|(stage, i, diameter_m)| {
                let key = key.item(10 * stage.index() as u64 + i);
                let plan = fallen(stage, diameter_m, key);
                self.log(index, of, &plan, key.item(1))
            });
            logs.extend(of_species.collect::<Vec<_>>());
        }
        Deadwood {
            logs,
            thrown: self.of_thrown_trees(|(_, species), plan, key| {
                self.log(species, of, plan, key.item(1))
            }),
        }
    }

    /// The root plates of thrown trees.
    pub(super) fn root_plates(&self) -> Vec<PlantAsset> {
        let Some(of) = &self.materials.deadwood else {
            return Vec::new();
        };
        self.of_thrown_trees(|(number, _), plan, key| {
            // Plates are some three times as wide as the flare of the stem.
            let radius_m = (3.4 * plan.radius_m[0] * 1.6).clamp(0.65, 1.35);
            let plate = root_plate(radius_m, &of.root_plate, key.item(2));
            let size = (radius_m, Thickness::Thick);
            self.upright("root_plate", number, plate, size)
        })
    }

    /// Fallen branches and tops.
    pub(super) fn branches(&self) -> Vec<PlantAsset> {
        self.lying(BRANCHES, "fallen_branch", |i, of, key| {
            branch(i, of, &mut key.rng())
        })
    }

    /// Mats of brash.
    pub(super) fn brash(&self) -> Vec<PlantAsset> {
        self.lying(BRASH, "brash", |_, of, key| brash(of, &mut key.rng()))
    }

    /// Patches of thin deadwood, if deadwood was asked for.
    fn lying(
        &self,
        domain: Domain,
        name: &str,
        grow: impl Fn(u32, &DeadwoodMaterials, Key) -> Shape + Sync,
    ) -> Vec<PlantAsset> {
        let Some(of) = &self.materials.deadwood else {
            return Vec::new();
        };
        self.collect(domain, VARIANTS, &|i, key| {
            let shape = grow(i, of, key);
            let radius_m = shape.reach_m();
            self.upright(name, i, shape, (radius_m, Thickness::Thin))
        })
    }

    /// What `grow` makes of each thrown tree, species by species: of its number, the index of its
    /// species, the plan of its stem, and its key.
    fn of_thrown_trees<T: Send>(
        &self,
        grow: impl Fn((u32, usize), &LogPlan, Key) -> T + Sync,
    ) -> Vec<T> {
        let stand = &self.params.species;
        (0..stand.len() * THROWN_STAGES.len())
            .into_par_iter()
            .map(|number| {
                let (index, i) = (number / THROWN_STAGES.len(), number % THROWN_STAGES.len());
                let species = &stand[index];
                let own = Domain::new(&species.species.name);
                let key = self.key.domain(THROWN).domain(own).item(i as u64);
                let plan = thrown(THROWN_STAGES[i], species.dbh_mean_m, key);
                grow((number as u32, index), &plan, key)
            })
            .collect()
    }

    fn log(&self, species: usize, of: &DeadwoodMaterials, plan: &LogPlan, key: Key) -> LogAsset {
        let name = &self.species[species].name;
        let shape = log(plan, &of.logs[species], key);
        let number = u32::from(plan.stage.number());
        let name_of_shape = format!("{name}.log");
        let library = &self.materials.library;
        let prototype = prototype(&name_of_shape, number, shape, library);
        let of = (library, self.masks);
        LogAsset {
            prototype: Arc::new(with_occluders(prototype, of, Thickness::Thick)),
            species: name.clone(),
            stage: plan.stage,
            length_m: f64::from(plan.length_m),
            diameter_m: plan.radius_m.map(|r| 2.0 * f64::from(r)),
            half_height_m: plan.half_height_m().map(f64::from),
            volume_m3: plan.volume_m3(),
        }
    }
}

/// A log that broke or was left.
fn fallen(stage: DecayStage, diameter_m: f64, key: Key) -> LogPlan {
    let mut rng = key.rng();
    let whole = diameter_m * rng.range_f64(SLENDERNESS[0], SLENDERNESS[1]);
    let length_m = (whole * PIECES[stage.index()]).clamp(0.9, 11.0);
    // It tapers as a stem does, a hundredth of its length.
    let tip_m = (diameter_m - 0.011 * length_m).max(0.45 * diameter_m);
    LogPlan {
        stage,
        length_m: length_m as f32,
        radius_m: [diameter_m, tip_m].map(|d| (0.5 * d) as f32),
        is_sawn: rng.chance(0.55),
    }
}

/// The stem of a thrown tree without its crown.
fn thrown(stage: DecayStage, dbh_mean_m: f64, key: Key) -> LogPlan {
    let mut rng = key.rng();
    let diameter_m = dbh_mean_m * rng.range_f64(0.95, 1.35);
    let length_m = (diameter_m * rng.range_f64(32.0, 42.0)).clamp(4.0, 15.0);
    let tip_m = (diameter_m - 0.012 * length_m).max(0.35 * diameter_m);
    LogPlan {
        stage,
        length_m: length_m as f32,
        radius_m: [diameter_m, tip_m].map(|d| (0.5 * d) as f32),
        is_sawn: false,
    }
}
