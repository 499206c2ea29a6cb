//! A comparison of ray casters by processor time: ours, ours without special instructions, parry3d,
//! and Intel's Embree 4 if `NEMORAL_EMBREE` is the path of a `libembree4` (PyPI's `embreex`
//! contains one).
//!
//! `cargo bench -p nemoral-benches --bench casters -- [ROUNDS] [WORDS...]`; words choose worlds,
//! rays and casters whose names contain one of them. `docs/measurements/casting.md` has the method
//! and the results.
#![allow(clippy::print_stdout, reason = "a report for its user")]

mod clock;
mod embree;
mod f64_solver;
mod parry;
mod placed;
mod rays;
mod reference;
mod report;
mod world;

use std::time::Instant;

use nemoral_raycast::RayScene;
use nemoral_scene::{Ray, RayCaster};
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

use crate::embree::{Embree, Scene};
use crate::parry::Parry;
use crate::placed::Placed;
use crate::rays::Work;
use crate::report::Order::{Fired, Sorted};
use crate::report::Row;
use crate::world::World;

const EMBREE: &str = "NEMORAL_EMBREE";

/// The arguments of the command line.
struct Choice {
    rounds: usize,
    words: Vec<String>,
}

impl Choice {
    fn of_arguments() -> Self {
        let mut choice = Self {
            rounds: 5,
            words: Vec::new(),
        };
        for word in std::env::args()
            .skip(1)
            .filter(|word| !word.starts_with("--"))
        {
            match word.parse() {
                Ok(rounds) => choice.rounds = rounds,
                Err(_) => choice.words.push(word),
            }
        }
        choice
    }

    /// Whether a name is among those of its kind that were asked for.
    fn wants(&self, name: &str, kind: &[&str]) -> bool {
        let named = |word: &&String| kind.iter().any(|name| name.contains(word.as_str()));
        let mut words = self.words.iter().filter(named).peekable();
        words.peek().is_none() || words.any(|word| name.contains(word.as_str()))
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let choice = Choice::of_arguments();
    // Our caster spreads a scan over all threads of the pool, which has one here.
    ThreadPoolBuilder::new().num_threads(1).build_global()?;
    let embree = match std::env::var_os(EMBREE) {
        Some(path) => Some(Embree::load(&path)?),
        None => {
            println!(
                "*** {EMBREE} is not set: EMBREE IS LEFT OUT. Set it to the path of a libembree4"
            );
            println!(
                "*** (pip download embreex==4.4.0.post1 and unzip: embreex.libs/libembree4-*)."
            );
            None
        }
    };
    for name in world::NAMES {
        if choice.wants(name, &world::NAMES) {
            compare(&World::named(name)?, embree.as_ref(), &choice)?;
        }
    }
    Ok(())
}

/// Embree with its scene.
struct Rival {
    whole: Scene,
    cut: Scene,
}

fn compare(
    world: &World,
    embree: Option<&Embree>,
    choice: &Choice,
) -> Result<(), ThreadPoolBuildError> {
    let placed = Placed::new(&world.groups, &world.materials);
    println!(
        "\n{}: {} instances of {} shapes, {:.1} M triangles",
        world.name,
        placed.instances.len(),
        placed.shapes.len(),
        placed.triangle_count() as f64 / 1e6
    );
    let start = Instant::now();
    let rival = embree.map(|embree| Rival {
        whole: embree.scene(&placed),
        cut: embree.scene(&placed.cut()),
    });
    if rival.is_some() {
        println!(
            "Embree's two scenes: {:.0} ms",
            start.elapsed().as_secs_f64() * 1e3
        );
    }
    let parry = Parry::new(&placed);
    let forest = world.forest();
    let imported = world.imported.clone().map(RayScene::new);
    let portable = forest.clone().portable();
    let works = rays::all(&world.eyes);
    let names: Vec<&str> = works.iter().map(|w| w.name).collect();
    for work in works.iter().filter(|w| choice.wants(w.name, &names)) {
        let mut rows = rows(&forest, &portable, rival.as_ref(), &parry);
        if let Some(imported) = &imported {
            let leaves = |rays: &[Ray], out: &mut [f32]| batch(imported, rays, out);
            rows.push(Row::new("nemoral, imported", Fired, Box::new(leaves)));
        }
        let casters: Vec<String> = rows.iter().map(|r| r.name.clone()).collect();
        let casters: Vec<&str> = casters.iter().map(String::as_str).collect();
        rows.retain(|r| choice.wants(&r.name, &casters));
        report::race(&mut rows, work, choice.rounds);
        report::print(&rows, work);
        agreement(&placed, work, &rows);
        two_threads(&forest, work, choice.rounds)?;
    }
    Ok(())
}

/// The casters. The others are compared with the first one.
fn rows<'a>(
    forest: &'a impl RayCaster,
    portable: &'a impl RayCaster,
    rival: Option<&'a Rival>,
    parry: &'a Parry<'a>,
) -> Vec<Row<'a>> {
    let mut rows = Vec::new();
    for (name, caster) in [
        ("nemoral", forest as &dyn RayCaster),
        ("portable", portable),
    ] {
        for order in [Fired, Sorted] {
            let batch = move |rays: &[Ray], out: &mut [f32]| batch(caster, rays, out);
            rows.push(Row::new(name, order, Box::new(batch)));
        }
        let single = move |rays: &[Ray], out: &mut [f32]| {
            for (ray, out) in rays.iter().zip(out) {
                let hit = caster.closest_surface(ray);
                *out = hit.map_or(f32::INFINITY, |hit| hit.distance_m);
            }
        };
        let shaded = move |rays: &[Ray], out: &mut [f32]| {
            for (ray, out) in rays.iter().zip(out) {
                let hit = caster.closest_hit(ray);
                *out = hit.map_or(f32::INFINITY, |hit| hit.surface.distance_m);
            }
        };
        let each = format!("{name} one by one");
        rows.push(Row::new(&each, Fired, Box::new(single)));
        rows.push(Row::new(
            &format!("{each}, shaded"),
            Fired,
            Box::new(shaded),
        ));
    }
    if let Some(rival) = rival {
        for (cut, scene) in [("", &rival.whole), (" cut", &rival.cut)] {
            for order in [Fired, Sorted] {
                let one = |rays: &[Ray], out: &mut [f32]| scene.cast1(rays, out);
                rows.push(Row::new(&format!("embree x1{cut}"), order, Box::new(one)));
                for (hint, coherent) in [("", false), (" coherent", true)] {
                    let name = format!("embree x8{cut}{hint}");
                    let eight =
                        move |rays: &[Ray], out: &mut [f32]| scene.cast8(rays, out, coherent);
                    rows.push(Row::new(&name, order, Box::new(eight)));
                }
            }
        }
    }
    let single = |rays: &[Ray], out: &mut [f32]| {
        for (ray, out) in rays.iter().zip(out) {
            *out = parry.cast(ray);
        }
    };
    rows.push(Row::new("parry3d", Fired, Box::new(single)));
    rows
}

fn batch(caster: &dyn RayCaster, rays: &[Ray], out: &mut [f32]) {
    let mut hits = vec![None; rays.len()];
    caster.closest_surfaces(rays, &mut hits);
    for (hit, out) in hits.into_iter().zip(out) {
        *out = hit.map_or(f32::INFINITY, |hit| hit.distance_m);
    }
}

/// The wall-clock speed-up of each scan by a second thread: the median of ratios within a round.
fn two_threads(forest: &RayScene, work: &Work, rounds: usize) -> Result<(), ThreadPoolBuildError> {
    let pool = |threads| ThreadPoolBuilder::new().num_threads(threads).build();
    let pools = [pool(1)?, pool(2)?];
    let mut hits = vec![None; work.fired.iter().map(Vec::len).max().unwrap_or(0)];
    let mut wall_s = |pool: &ThreadPool| {
        let start = Instant::now();
        for scan in &work.fired {
            pool.install(|| forest.closest_surfaces(scan, &mut hits[..scan.len()]));
        }
        start.elapsed().as_secs_f64()
    };
    let mut ratios: Vec<f64> = (0..4 * rounds + 1)
        .map(|_| wall_s(&pools[0]) / wall_s(&pools[1]))
        .collect();
    ratios.sort_by(f64::total_cmp);
    println!(
        "    two threads are {:.2} times one by the wall, {:.2} to {:.2} in {} rounds",
        ratios[ratios.len() / 2],
        ratios[0],
        ratios[ratios.len() - 1],
        ratios.len(),
    );
    Ok(())
}

/// Counts the rays that other casters see differently, and says whom an f64 loop over all triangles
/// proves right.
fn agreement(placed: &Placed, work: &Work, rows: &[Row<'_>]) {
    let Some(ours) = rows.iter().find(|r| r.name.starts_with("nemoral")) else {
        return;
    };
    let rays: Vec<Ray> = work.fired.concat();
    let own = ours.distances_fired(work);
    let hits = own.iter().filter(|t| t.is_finite()).count();
    println!("    {:.1} % hit", 100.0 * hits as f64 / own.len() as f64);
    for name in ["portable", "embree x1", "embree x8 cut", "parry3d"] {
        let Some(other) = rows.iter().find(|r| r.name == name) else {
            continue;
        };
        let theirs = other.distances_fired(work);
        let differ: Vec<usize> = (0..rays.len())
            .filter(|&i| !same(own[i], theirs[i]))
            .collect();
        let (mut we, mut they) = (0, 0);
        for &i in differ.iter().take(200) {
            let truth = f64_solver::nearest(placed, &rays[i]) as f32;
            we += u32::from(same(own[i], truth));
            they += u32::from(same(theirs[i], truth));
        }
        println!(
            "    {name}: {} of {} rays differ ({:.1e}); of {} the f64 solver sides {we} : {they}",
            differ.len(),
            rays.len(),
            differ.len() as f64 / rays.len() as f64,
            differ.len().min(200),
        );
    }
}

/// Whether both miss, or both hit within 1 mm plus a ten-thousandth of the distance.
fn same(a: f32, b: f32) -> bool {
    a == b || (a - b).abs() <= 1e-3 + 1e-4 * a.min(b)
}
