//! Objects in the paper's three forests, counted through the plans as by a user, with trails, in a
//! hundred chunks of each.

use std::collections::HashSet;
use std::sync::{Arc, LazyLock};

use nemoral_assets::PlantKind;
use nemoral_pipeline::ForestPlan;
use nemoral_pipeline::config::Config;
use nemoral_pipeline::plan::Runner;
use nemoral_pipeline::world::assets::WorldAssets;
use nemoral_pipeline::world::chunk_ground::ChunkGround;
use nemoral_placement::Placement;
use nemoral_scene::glam::DVec2;
use nemoral_scene::{ChunkCoord, ObjectKind};
use nemoral_stand::{SceneObject, SceneObjects};
use nemoral_tests::{config, store};

/// Mean number of trees in a chunk (paper, section VI).
const PRESETS: [(&str, f64); 3] = [("low", 31.0), ("medium", 96.0), ("high", 210.0)];

/// Side of the square that is counted, chunks.
const SIDE: i32 = 10;

struct Chunk {
    coord: ChunkCoord,
    ground: Arc<ChunkGround>,
    things: Arc<SceneObjects>,
}

struct Stand {
    name: &'static str,
    target: f64,
    config: Config,
    assets: Arc<WorldAssets>,
    chunks: Vec<Chunk>,
}

static STANDS: LazyLock<Vec<Stand>> = LazyLock::new(|| {
    // Three plans share a store, and the library, which is the same, is grown once.
    let store = store();
    let stand = |(name, target): (&'static str, f64)| {
        let config = config(name, &["camera.enabled=false"]);
        let forest = ForestPlan::new(&config).expect("a preset");
        let runner = Runner::new(forest.plan(), &store, 2);
        let square = (0..SIDE * SIDE).map(|i| ChunkCoord::new(i % SIDE - 5, i / SIDE - 5));
        let square: Vec<ChunkCoord> = square.collect();
        let things = runner.demand(forest.objects).all(&square).expect("things");
        let ground = runner.demand(forest.ground).all(&square).expect("ground");
        let chunk = |((coord, ground), things)| Chunk {
            coord,
            ground,
            things,
        };
        Stand {
            name,
            target,
            assets: runner.get(forest.assets, ()).expect("assets"),
            chunks: square
                .into_iter()
                .zip(ground)
                .zip(things)
                .map(chunk)
                .collect(),
            config,
        }
    };
    PRESETS.map(stand).into()
});

/// Whether an object stands, so that a circle around its foot has its room. What lies is longer:
/// `pipeline/tests/worlds/deadwood.rs` tests where it may be.
fn stands(thing: &SceneObject) -> bool {
    !matches!(thing.kind, ObjectKind::Log | ObjectKind::RootPlate)
}

/// The radius of the room that a thing has among others, metres: that of its shape, of which it is
/// a larger or smaller copy, and of shrubs, whose crowns may touch, that of their cores.
fn room_m(thing: &SceneObject) -> f64 {
    let core = if thing.kind == ObjectKind::Shrub {
        0.4
    } else {
        1.0
    };
    core * thing.radius_m / thing.scale
}

impl Chunk {
    fn of(&self, kind: ObjectKind) -> impl Iterator<Item = &SceneObject> {
        let placed = self.things.0.iter().filter(|t| !t.on_trail);
        placed.filter(move |t| t.kind == kind)
    }
}

impl Stand {
    /// The number of objects of a kind in each chunk.
    fn counts(&self, kind: ObjectKind) -> Vec<f64> {
        let count = |c: &Chunk| c.of(kind).count() as f64;
        self.chunks.iter().map(count).collect()
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn variance(values: &[f64]) -> f64 {
    let mean = mean(values);
    values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (values.len() - 1) as f64
}

#[test]
fn the_papers_three_densities_are_met() {
    for stand in &*STANDS {
        // Trees are counted as rows of trees.csv.
        let trees = |c: &Chunk| {
            let records = c
                .things
                .0
                .iter()
                .filter_map(|t| stand.assets.tree_record(t));
            records.filter(|t| t.dbh_m >= 0.07).count() as f64
        };
        let counts: Vec<f64> = stand.chunks.iter().map(trees).collect();
        let (mean, variance) = (mean(&counts), variance(&counts));
        let on_trail = stand.chunks.iter().flat_map(|c| &c.things.0);
        let stones = on_trail.filter(|t| t.on_trail).count();
        println!(
            "{}: {mean:.2} trees a chunk, {:.0} asked for ({:+.2} %), variance / mean {:.2}, \
             {stones} stones on trails",
            stand.name,
            stand.target,
            100.0 * (mean / stand.target - 1.0),
            variance / mean
        );
        assert!((mean / stand.target - 1.0).abs() <= 0.05, "{mean}");
        // A random pattern has 1, rows have less and clumps more.
        assert!((0.3..2.5).contains(&(variance / mean)), "{variance}");
        let different: HashSet<u64> = counts.iter().map(|c| *c as u64).collect();
        assert!(different.len() >= 10, "counts vary");
        assert!(stones > 0, "no trail runs here");
    }
}

#[test]
fn stumps_shrubs_and_rocks_meet_their_numbers() {
    let pooled = |kind, target: fn(&Config) -> f64| {
        let counts: Vec<f64> = STANDS.iter().flat_map(|s| s.counts(kind)).collect();
        let expected: f64 = STANDS
            .iter()
            .map(|s| target(&s.config) * s.chunks.len() as f64)
            .sum();
        let total: f64 = counts.iter().sum();
        println!(
            "{}: {total} of {expected} in {} chunks",
            kind.name(),
            counts.len()
        );
        // The tolerance covers chance, and the room that rocks and trees take from later objects.
        let tolerance = 3.0 * expected.sqrt() + 0.05 * expected;
        assert!((total - expected).abs() <= tolerance, "{}", kind.name());
    };
    pooled(ObjectKind::Stump, |c| c.placement.stumps);
    pooled(ObjectKind::Shrub, |c| c.placement.shrubs);
    pooled(ObjectKind::Rock, |c| {
        f64::from(c.placement.rocks_min + c.placement.rocks_max) / 2.0
    });
    for stand in &*STANDS {
        let p = &stand.config.placement;
        let allowed = f64::from(p.rocks_min)..=f64::from(p.rocks_max);
        let counts = stand.counts(ObjectKind::Rock);
        assert!(counts.iter().all(|n| allowed.contains(n)), "{counts:?}");
        // The counts use the whole range.
        assert!(counts.contains(allowed.start()) && counts.contains(allowed.end()));
    }
}

#[test]
fn what_stands_is_as_wide_as_its_shape() {
    for stand in &*STANDS {
        for (kind, shapes) in [
            (ObjectKind::Rock, PlantKind::Rock),
            (ObjectKind::Shrub, PlantKind::Shrub),
            (ObjectKind::Stump, PlantKind::Stump),
        ] {
            let shapes = &stand.assets.library.plants[shapes];
            let mut things = stand.chunks.iter().flat_map(|c| c.of(kind)).peekable();
            assert!(things.peek().is_some(), "{}: no {kind:?}", stand.name);
            for thing in things {
                let radius_m = shapes[thing.asset].radius_m * thing.scale;
                assert!((thing.radius_m - radius_m).abs() < 1e-9, "{thing:?}");
            }
        }
    }
}

#[test]
fn no_two_things_are_too_near_across_borders_too() {
    for stand in &*STANDS {
        let p = &stand.config.placement;
        let factor = p.spacing_factor * p.density_factor;
        let placed = |c: &Chunk| -> Vec<(ObjectKind, DVec2, f64)> {
            let of = (c.things.0.iter()).filter(|t| !t.on_trail && stands(t));
            of.map(|t| (t.kind, t.position_m.truncate(), room_m(t)))
                .collect()
        };
        let chunks: Vec<_> = stand.chunks.iter().map(placed).collect();
        let at = |x: i32, y: i32| {
            let inside = (0..SIDE).contains(&x) && (0..SIDE).contains(&y);
            inside.then(|| &chunks[(y * SIDE + x) as usize])
        };
        let (mut pairs, mut across, mut tightest) = (0_u64, 0_u64, f64::INFINITY);
        for (i, here) in chunks.iter().enumerate() {
            let (x, y) = (i as i32 % SIDE, i as i32 / SIDE);
            // This chunk and half of its neighbours give every pair once.
            for (dx, dy) in [(0, 0), (1, 0), (-1, 1), (0, 1), (1, 1)] {
                let Some(there) = at(x + dx, y + dy) else {
                    continue;
                };
                for (a, (kind, position, radius)) in here.iter().enumerate() {
                    let from = if (dx, dy) == (0, 0) { a + 1 } else { 0 };
                    for (other, q, r) in &there[from..] {
                        let is_rock = [kind, other].contains(&&ObjectKind::Rock);
                        let factor = if is_rock { factor.max(1.0) } else { factor };
                        let margin = position.distance(*q) - factor * (radius + r);
                        assert!(
                            margin > -1e-6,
                            "{}: {kind:?} at {position} and {other:?} at {q} are {margin} m too \
                             near",
                            stand.name
                        );
                        tightest = tightest.min(margin);
                        pairs += 1;
                        across += u64::from((dx, dy) != (0, 0) && margin < 0.5);
                    }
                }
            }
        }
        println!(
            "{}: {pairs} pairs, {across} within half a metre of the rule across a border, tightest \
             {tightest:.4} m",
            stand.name
        );
        assert!(across > 10, "the rule is put to the test at borders");
        assert!(tightest < 0.05, "and is not far from being broken");
    }
}

#[test]
fn nothing_but_stones_stands_on_a_trail() {
    for stand in &*STANDS {
        let mut nearest = f64::INFINITY;
        for chunk in &stand.chunks {
            for thing in chunk.things.0.iter().filter(|t| stands(t)) {
                let edge_m = chunk.ground.trail_edge_m(thing.position_m.truncate());
                if thing.on_trail {
                    assert!(edge_m < 0.0, "a stone {edge_m} m beside its trail");
                } else {
                    let free = edge_m - room_m(thing);
                    assert!(
                        free > 0.0,
                        "{:?} at {}: {free} m",
                        thing.kind,
                        thing.position_m
                    );
                    nearest = nearest.min(free);
                }
            }
        }
        println!("{}: nearest to a trail's edge {nearest:.3} m", stand.name);
        assert!(nearest < 1.0, "things stand beside the trails");
    }
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn ids_are_unique_and_fit_a_label() {
    for stand in &*STANDS {
        let mut seen = HashSet::new();
        let mut most = 0;
        for chunk in &stand.chunks {
            for (i, thing) in chunk.things.0.iter().enumerate() {
                assert_eq!(thing.object.chunk(), chunk.coord);
                assert_eq!(usize::from(thing.object.item()), i + 1);
                assert!(seen.insert(thing.object), "{:?}", thing.object);
                let foot = thing.position_m.truncate();
                let home = ChunkCoord::containing(foot, stand.config.chunks.size_m);
                let may_be_elsewhere = thing.on_trail || !stands(thing);
                assert!(may_be_elsewhere || home == chunk.coord, "{foot}");
            }
            most = most.max(chunk.things.0.len());
        }
        println!(
            "{}: {} ids, at most {most} in a chunk",
            stand.name,
            seen.len()
        );
        assert!((1..=1310).contains(&most));
    }
}

#[test]
fn neither_border_nor_phase_shows() {
    let mut strips = [0.0_f64; 8];
    let mut phases = [0.0_f64; 4];
    let mut total = 0.0;
    for stand in &*STANDS {
        let size_m = stand.config.chunks.size_m;
        for chunk in &stand.chunks {
            for tree in chunk.of(ObjectKind::Tree) {
                total += 1.0;
                phases[usize::from(Placement::phase(chunk.coord))] += 1.0;
                let p = tree.position_m.truncate() - chunk.coord.origin_m(size_m);
                let inside_m = p.min_element().min(size_m - p.max_element());
                if let Some(strip) = strips.get_mut((inside_m / 0.5) as usize) {
                    *strip += 1.0;
                }
            }
        }
    }
    // The tolerance is 3 % or 3 sigma of random points.
    let check = |what: &str, count: f64, expected: f64| {
        let (off, sigmas) = (count / expected - 1.0, (count - expected) / expected.sqrt());
        println!(
            "{what}: {count} of {expected:.0}, {:+.2} %, {sigmas:+.2} sigma",
            100.0 * off
        );
        assert!(off.abs() <= 0.03 || sigmas.abs() <= 3.0, "{what}");
    };
    for (i, count) in strips.into_iter().enumerate() {
        // These squares have a side of 50 m less 0.5 m times i on each side.
        let inner = 50.0 - i as f64;
        let share = (inner.powi(2) - (inner - 1.0).powi(2)) / 2500.0;
        let what = format!("strip {:.1}..{:.1} m", i as f64 / 2.0, (i + 1) as f64 / 2.0);
        check(&what, count, total * share);
    }
    for (i, count) in phases.into_iter().enumerate() {
        check(&format!("phase {i}"), count, total / 4.0);
    }
}
