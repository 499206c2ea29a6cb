//! Ray casters side by side, each judged by the processor time of its thread: ours, ours without
//! special instructions, parry3d, and Intel's Embree 4 if `NEMORAL_EMBREE` is the path of a
//! `libembree4` (PyPI's `embreex` carries one).
//!
//! `cargo bench -p nemoral-benches --bench casters -- [ROUNDS] [WORDS...]`; words choose worlds, rays
//! and casters whose names contain one of them. `docs/raycast.md` says what is measured and found.
#![allow(clippy::print_stdout, reason = "a report for its user")]

mod clock;
mod embree;
mod parry;
mod placed;
mod rays;
mod referee;
mod reference;
mod report;
mod world;

use std::time::Instant;

use nemoral_raycast::Forest;
use nemoral_scene::{Ray, RayCaster};

use crate::clock::seconds;
use crate::embree::{Embree, Scene};
use crate::parry::Parry;
use crate::placed::Placed;
use crate::rays::Work;
use crate::report::Order::{Fired, Sorted};
use crate::report::Row;
use crate::world::World;

const EMBREE: &str = "NEMORAL_EMBREE";

/// What the command line asks for.
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

    /// Is a name among those of its kind that were asked for?
    fn wants(&self, name: &str, kind: &[&str]) -> bool {
        let named = |word: &&String| kind.iter().any(|name| name.contains(word.as_str()));
        let mut words = self.words.iter().filter(named).peekable();
        words.peek().is_none() || words.any(|word| name.contains(word.as_str()))
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let choice = Choice::of_arguments();
    // Ours casts a scan on all threads of the pool: here on the one that is timed.
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build_global()?;
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
            compare(&World::named(name)?, embree.as_ref(), &choice);
        }
    }
    Ok(())
}

/// What Embree is given.
struct Rival {
    whole: Scene,
    cut: Scene,
}

fn compare(world: &World, embree: Option<&Embree>, choice: &Choice) {
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
    let portable = forest.clone().portable();
    let works = rays::all(&world.eyes);
    let names: Vec<&str> = works.iter().map(|w| w.name).collect();
    for work in works.iter().filter(|w| choice.wants(w.name, &names)) {
        let mut rows = rows(&forest, &portable, rival.as_ref(), &parry);
        let casters: Vec<String> = rows.iter().map(|r| r.name.clone()).collect();
        let casters: Vec<&str> = casters.iter().map(String::as_str).collect();
        rows.retain(|r| choice.wants(&r.name, &casters));
        report::race(&mut rows, work, choice.rounds);
        report::print(&rows, work);
        agreement(&placed, work, &rows);
        two_threads(&forest, work);
    }
}

/// The casters. The first is the one that others are compared with.
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
                let hit = caster.closest_hit(ray);
                *out = hit.map_or(f32::INFINITY, |hit| hit.distance_m);
            }
        };
        rows.push(Row::new(
            &format!("{name} one by one"),
            Fired,
            Box::new(single),
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

/// What a second thread brings: by the wall's clock, and by the processor's, which other processes
/// do not lengthen.
fn two_threads(forest: &Forest, work: &Work) {
    let cast = |scans: &[Vec<Ray>]| {
        let mut out = vec![0.0; work.count()];
        seconds(|| scans.iter().for_each(|scan| batch(forest, scan, &mut out)))
    };
    let halves: Vec<Vec<Ray>> = match &work.fired[..] {
        [whole] => whole.chunks(whole.len() / 8).map(<[Ray]>::to_vec).collect(),
        scans => scans.to_vec(),
    };
    let start = Instant::now();
    let one = cast(&halves);
    let one_wall = start.elapsed().as_secs_f64();
    let (a, b) = halves.split_at(halves.len() / 2);
    let start = Instant::now();
    let (a, b) = std::thread::scope(|scope| {
        let other = scope.spawn(|| cast(b));
        (cast(a), other.join().unwrap_or(f64::NAN))
    });
    println!(
        "    two threads are {:.2} times one by the wall, {:.2} by the processor",
        one_wall / start.elapsed().as_secs_f64(),
        2.0 * one / (a + b)
    );
}

/// How many rays others see differently, and whom an f64 loop over all triangles proves right.
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
            let truth = referee::nearest(placed, &rays[i]) as f32;
            we += u32::from(same(own[i], truth));
            they += u32::from(same(theirs[i], truth));
        }
        println!(
            "    {name}: {} of {} rays differ ({:.1e}); of {} the referee sides {we} : {they}",
            differ.len(),
            rays.len(),
            differ.len() as f64 / rays.len() as f64,
            differ.len().min(200),
        );
    }
}

/// Both miss, or both hit within 1 mm and a ten-thousandth.
fn same(a: f32, b: f32) -> bool {
    a == b || (a - b).abs() <= 1e-3 + 1e-4 * a.min(b)
}
