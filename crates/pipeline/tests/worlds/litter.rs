//! Litter in relief: how much of it lies where, that it lies on the ground, and that chunks agree.
//! What sticks out of banks.

use std::sync::{Arc, LazyLock};

use nemoral_assets::LitterPatches;
use nemoral_pipeline::world::litter::LitterPatch;
use nemoral_raycast::RayScene;
use nemoral_realism::{World, config};
use nemoral_scene::glam::{DVec2, DVec3, Vec3};
use nemoral_scene::{ChunkCoord, Instance, ObjectKind, Ray, RayCaster, Surface};
use nemoral_trails::TrailZone;

/// A world of few plants.
fn world(preset: &str, settings: &[&str]) -> World {
    World::without_cameras(preset, &[&["assets.individuals=1"], settings].concat())
}

/// The litter of a chunk.
fn litter(world: &World, at: ChunkCoord) -> Vec<LitterPatch> {
    let patches = world.runner(2).get(world.forest.litter, at);
    patches.expect("litter").to_vec()
}

/// The area of a patch on the map, m².
fn area_m2(patch: &LitterPatch) -> f64 {
    let radius_m = patch.at.scale * LitterPatches::RADII_M[usize::from(!patch.is_wide)];
    std::f64::consts::PI * radius_m * radius_m
}

fn chunks() -> impl Iterator<Item = ChunkCoord> {
    (0..4).map(|i| ChunkCoord::new(i % 2, i / 2))
}

static BEECH: LazyLock<World> = LazyLock::new(|| {
    world(
        "beech",
        &["litter.cover=1.0", "trails.spawn_probability=0.05"],
    )
});

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn as_much_lies_as_was_asked_for() {
    let area = |cover: &str| {
        let cover = format!("litter.cover={cover}");
        let world = world("demo", &[&cover]);
        let patches = litter(&world, ChunkCoord::new(0, 0));
        patches.iter().map(area_m2).sum::<f64>()
    };
    let whole = area("1");
    println!("{whole:.0} m² on 2,500");
    assert!((1200.0..3200.0).contains(&whole), "{whole}");
    let half = area("0.5");
    assert!((half / whole - 0.5).abs() < 0.06, "{half} of {whole}");
    assert_eq!(area("0"), 0.0);
}

#[test]
fn presets_of_the_paper_and_the_demo_have_none() {
    for preset in ["low", "medium", "high", "demo"] {
        let config = config(preset, &[]);
        assert!(!config.litter.is_any(), "{preset}");
    }
    let world = world("demo", &[]);
    assert!(litter(&world, ChunkCoord::new(0, 0)).is_empty());
    let assets = world
        .runner(2)
        .get(world.forest.assets, ())
        .expect("assets");
    assert!(assets.shed.is_empty() && assets.library.shed.is_empty());
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn leaves_lie_on_the_mesh_of_the_ground() {
    for (preset, settings) in [
        ("beech", &[][..]),
        ("eucalyptus-plantation", &["terrain.max_height_m=90"][..]),
    ] {
        let world = world(preset, settings);
        let runner = world.runner(2);
        let (mut gaps, mut ids) = (Vec::new(), 0);
        let mut square = 0.0;
        for at in chunks().take(1) {
            let solid = runner
                .get(world.forest.object_geometry, at)
                .expect("a chunk");
            let ground = Arc::clone(solid.group.instances()[0].1.prototype());
            let assets = runner.get(world.forest.assets, ()).expect("assets");
            let mesh = RayScene::of_shape(ground, &assets.library.materials);
            let geometry = runner
                .get(world.forest.litter_geometry, at)
                .expect("litter");
            let group = geometry.0.as_ref().expect("litter lies in every chunk");
            for (instance, _) in group.instances() {
                ids += usize::from(!instance.object.is_none());
                for card in instance.prototype.cards() {
                    // The lowest corner of each card, above the mesh.
                    let gap = |corner: Vec3| {
                        let p = instance.position_m + instance.linear * corner;
                        let hit =
                            mesh.closest_surface(&Ray::new(p + Vec3::Z * 2.0, Vec3::NEG_Z))?;
                        Some(hit.distance_m - 2.0)
                    };
                    let corners = card.corners().into_iter().filter_map(gap);
                    let lowest = corners.fold(f32::INFINITY, f32::min);
                    if lowest.is_finite() {
                        gaps.push(lowest);
                        square += f64::from(lowest * lowest);
                    }
                }
            }
        }
        gaps.sort_unstable_by(f32::total_cmp);
        let at = |share: f64| gaps[((gaps.len() - 1) as f64 * share) as usize] * 1e3;
        println!(
            "{preset}: lowest corners of {} cards above the mesh, mm: least {:.0}, 1 % {:.0}, \
             half {:.0}, 99 % {:.0}, most {:.0}; r.m.s. {:.0}",
            gaps.len(),
            at(0.0),
            at(0.01),
            at(0.5),
            at(0.99),
            at(1.0),
            (square / gaps.len() as f64).sqrt() * 1e3,
        );
        assert_eq!(ids, 0);
        assert!(gaps.len() > 50_000, "{preset}: {}", gaps.len());
        assert!(at(0.01) > -20.0 && at(0.0) > -45.0, "{preset}: sunk");
        assert!((-4.0..20.0).contains(&at(0.5)), "{preset}: {}", at(0.5));
        assert!(at(0.99) < 45.0 && at(1.0) < 80.0, "{preset}: floats");
    }
}

/// A chunk's litter reaches over its border, where the neighbour's mesh is what it lies on.
#[test]
fn leaves_lie_on_the_neighbour_s_mesh_too() {
    let runner = BEECH.runner(2);
    let assets = runner.get(BEECH.forest.assets, ()).expect("assets");
    let mut gaps = Vec::new();
    for (at, step) in [(ChunkCoord::new(0, 0), 1), (ChunkCoord::new(1, 1), -1)] {
        let next = ChunkCoord::new(at.x + step, at.y);
        let solid = runner.get(BEECH.forest.object_geometry, next);
        let solid = solid.expect("a chunk");
        let ground = Arc::clone(solid.group.instances()[0].1.prototype());
        let mesh = RayScene::of_shape(ground, &assets.library.materials);
        let litter = runner
            .get(BEECH.forest.litter_geometry, at)
            .expect("litter");
        let group = litter.0.as_ref().expect("litter lies in every chunk");
        for (instance, _) in group.instances() {
            for card in instance.prototype.cards() {
                let corner = |c| instance.position_m + instance.linear * c;
                let corners = card.corners().map(corner);
                let low = corners.into_iter().min_by(|a, b| a.z.total_cmp(&b.z));
                let low = low.expect("four corners") - Vec3::X * (50 * step) as f32;
                let ray = Ray::new(low + Vec3::Z * 2.0, Vec3::NEG_Z);
                if let Some(hit) = mesh.closest_surface(&ray) {
                    gaps.push((hit.distance_m - 2.0) * 1e3);
                }
            }
        }
    }
    gaps.sort_unstable_by(f32::total_cmp);
    let at = |share: f64| gaps[((gaps.len() - 1) as f64 * share) as usize];
    println!(
        "{} cards beyond a border, mm above the mesh: least {:.0}, 1 % {:.0}, half {:.0}, \
         99 % {:.0}, most {:.0}",
        gaps.len(),
        at(0.0),
        at(0.01),
        at(0.5),
        at(0.99),
        at(1.0)
    );
    assert!(gaps.len() > 500, "{}", gaps.len());
    assert!(at(0.01) > -20.0 && at(0.0) > -45.0, "sunk");
    assert!((-4.0..20.0).contains(&at(0.5)), "{}", at(0.5));
    assert!(at(0.99) < 45.0 && at(1.0) < 80.0, "floats");
}

#[test]
fn it_is_thin_on_trails_and_deep_at_stems_and_in_hollows() {
    let runner = BEECH.runner(2);
    let (mut on, mut off) = ((0.0, 0), (0.0, 0));
    let (mut at_stems, mut elsewhere) = (Vec::new(), Vec::new());
    let mut by_hollow = Vec::new();
    for at in chunks() {
        let ground = runner.get(BEECH.forest.ground, at).expect("a ground");
        let objects = runner.get(BEECH.forest.objects, at).expect("objects");
        for k in 0..100 * 100 {
            let cell = DVec2::new(f64::from(k % 100) + 0.5, f64::from(k / 100) + 0.5) * 0.5;
            let edge_m = ground.trail_edge_m(at.origin_m(50.0) + cell);
            on.1 += i32::from(edge_m < 0.0);
            off.1 += i32::from(edge_m > 1.0);
        }
        for patch in litter(&BEECH, at) {
            let p = patch.at.position_m;
            let edge_m = ground.trail_edge_m(p);
            if edge_m < 0.0 {
                assert!(!patch.is_wide);
                on.0 += area_m2(&patch);
                continue;
            }
            if edge_m < 1.0 {
                continue;
            }
            off.0 += area_m2(&patch);
            let stem_m = (objects.0.iter())
                .filter(|o| matches!(o.kind, ObjectKind::Tree | ObjectKind::Stump))
                .map(|o| o.position_m.truncate().distance(p) - o.radius_m)
                .fold(f64::INFINITY, f64::min);
            let around = [DVec2::X, DVec2::Y, DVec2::NEG_X, DVec2::NEG_Y];
            let around = around.map(|way| ground.height_m(p + 2.5 * way));
            let hollow_m = around.iter().sum::<f64>() / 4.0 - ground.height_m(p);
            if stem_m < 0.3 {
                at_stems.push(patch.depth);
            } else if stem_m > 1.5 {
                elsewhere.push(patch.depth);
                by_hollow.push((hollow_m, patch.depth));
            }
        }
    }
    let [on_trail, beside] = [on, off].map(|(m2, cells)| m2 / (f64::from(cells) * 0.25));
    let mean = |depths: &[f64]| depths.iter().sum::<f64>() / depths.len() as f64;
    by_hollow.sort_by(|a, b| a.0.total_cmp(&b.0));
    let fifth = by_hollow.len() / 5;
    let of = |part: &[(f64, f64)]| part.iter().map(|(_, d)| d).sum::<f64>() / part.len() as f64;
    let (crest, hollow) = (
        of(&by_hollow[..fifth]),
        of(&by_hollow[by_hollow.len() - fifth..]),
    );
    println!(
        "patches cover {on_trail:.2} of trails and {beside:.2} beside; depth {:.2} at stems, \
         {:.2} elsewhere, {crest:.2} on crests, {hollow:.2} in hollows",
        mean(&at_stems),
        mean(&elsewhere)
    );
    assert!(
        on.1 > 500 && at_stems.len() > 50,
        "{} {}",
        on.1,
        at_stems.len()
    );
    // The trails of a beech stand are covered with leaves: three times `litter.on_trails`.
    assert!(
        on_trail < 0.45 * beside && on_trail > 0.0,
        "{on_trail} {beside}"
    );
    assert!(mean(&at_stems) > mean(&elsewhere) + 0.15);
    assert!(hollow > crest + 0.15);
}

#[test]
#[ignore = "a minute: .ci/full runs it"]
fn none_lies_in_water() {
    let settings = [
        "water.springs_per_km2=300",
        "water.ponds=1",
        "water.puddles=1",
        "trails.spawn_probability=0.05",
    ];
    let world = world("stream-valley", &settings);
    let runner = world.runner(2);
    let (mut count, mut near) = (0, 0);
    for at in chunks() {
        let ground = runner.get(world.forest.ground, at).expect("a ground");
        let origin = at.origin_m(50.0);
        let geometry = runner
            .get(world.forest.litter_geometry, at)
            .expect("litter");
        for (instance, _) in geometry.0.iter().flat_map(|g| g.instances()) {
            for card in instance.prototype.cards().iter().step_by(7) {
                let local = instance.position_m + instance.linear * card.corner;
                let p = origin + local.truncate().as_dvec2();
                let bank_m = ground.bank_m(p).min(ground.puddle_edge_m(p));
                count += 1;
                near += usize::from(bank_m < 2.0);
                assert!(bank_m > 0.0, "{bank_m} at {p}");
            }
        }
    }
    println!("{count} cards, {near} within 2 m of water");
    assert!(near > 500, "{near} of {count}");
}

/// A chunk's litter does not depend on which chunks were asked for before, nor on threads.
#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn chunks_agree_whatever_is_asked_first() {
    let settings = ["trails.spawn_probability=0.05"];
    let at = ChunkCoord::new(1, -1);
    let alone = litter(&world("beech", &settings), at);
    let world = world("beech", &settings);
    for before in at
        .square(1)
        .filter(|c| *c != at)
        .collect::<Vec<_>>()
        .iter()
        .rev()
    {
        litter(&world, *before);
    }
    assert_eq!(alone, litter(&world, at));
    // Each patch is of one chunk, and a little more than a narrow one's distance may be beyond.
    assert!(alone.len() > 500);
    for patch in &alone {
        let beyond = at.distance_m(patch.at.position_m, 50.0);
        assert!(
            beyond == 0.0 || (!patch.is_wide && beyond < 0.6),
            "{beyond}"
        );
    }
    // No two patches are in the same place, across borders either.
    let mut all: Vec<DVec2> = at
        .square(1)
        .flat_map(|c| litter(&world, c))
        .map(|patch| patch.at.position_m)
        .collect();
    let count = all.len();
    all.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    all.dedup();
    assert_eq!(all.len(), count);
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn it_adds_few_instances() {
    let count = |settings: &[&str]| {
        let world = world("beech", settings);
        let scene = world.runner(2).get(world.forest.scene, 0).expect("a scene");
        let groups = scene.groups.iter();
        groups
            .map(|(_, group)| group.instances().len())
            .sum::<usize>()
    };
    // Litter is near, whatever else is far.
    let near = [
        "chunks.visible_radius_m=50",
        "chunks.undergrowth_radius_m=50",
    ];
    let (with, without) = (count(&near), count(&[near[0], near[1], "litter.cover=0"]));
    println!("{with} instances in view with litter, {without} without");
    // Without it there are the patches of `undergrowth.litter`.
    assert!(with < without + 7_000, "{with} {without}");
}

/// Pieces of banks: the place, how well their z is the ground's normal, and the slope away from the
/// trail.
fn banks(world: &World, at: ChunkCoord) -> Vec<(DVec2, f64, f64)> {
    let runner = world.runner(2);
    let ground = runner.get(world.forest.ground, at).expect("a chunk");
    let node = world.forest.undergrowth_geometry;
    let geometry = runner.get(node, at).expect("a chunk");
    let instances = geometry.0.iter().flat_map(|group| group.instances());
    let of_banks = instances.filter(|(i, _)| i.prototype.name().starts_with("bank."));
    let piece = |instance: &Instance| {
        assert!(instance.object.is_none());
        let p = at.origin_m(50.0) + instance.position_m.truncate().as_dvec2();
        assert_eq!(ground.trail_zone(p, false), TrailZone::CutSlope, "{p}");
        let sample = ground.sample(p);
        let gap_m = f64::from(instance.position_m.z) - sample.height_m;
        assert!(gap_m.abs() < 0.04, "{gap_m}");
        let normal = (-sample.gradient).extend(1.0).normalize_or(DVec3::Z);
        let z = instance.linear.z_axis.as_dvec3().normalize_or(DVec3::Z);
        // Away from the trail, by differences.
        let edge_m = |off: DVec2| ground.trail_edge_m(p + off) - ground.trail_edge_m(p - off);
        let away = DVec2::new(edge_m(DVec2::X * 0.01), edge_m(DVec2::Y * 0.01));
        (
            p,
            z.dot(normal),
            sample.gradient.dot(away.normalize_or(DVec2::X)),
        )
    };
    of_banks.map(|(instance, _)| piece(instance)).collect()
}

#[test]
fn what_sticks_out_of_banks_is_in_cut_slopes() {
    let (mut pieces, mut aligned) = (0, 0);
    for at in chunks().take(2) {
        for (p, alignment, rise) in banks(&BEECH, at) {
            assert_eq!(ChunkCoord::containing(p, 50.0), at);
            assert!(rise > 0.35, "{rise}");
            pieces += 1;
            aligned += usize::from(alignment > 0.95);
        }
    }
    println!("{pieces} pieces, {aligned} of them within 18 degrees of the bank");
    assert!(pieces > 40 && aligned * 10 > pieces * 9);
    for preset in ["low", "medium", "high", "demo"] {
        assert_eq!(config(preset, &[]).trails.banks, 0.0, "{preset}");
    }
}

#[test]
fn value_stability() {
    let patches = litter(&BEECH, ChunkCoord::new(0, 0));
    let patch = patches[100];
    assert_eq!(
        (patches.len(), patch.species, patch.is_wide),
        (1237, 1, true)
    );
    let place = DVec2::new(26.282_571_997_974_13, 3.319_940_887_018_889);
    assert_eq!(patch.at.position_m, place);
    assert_eq!(patch.depth, 0.241_909_924_929_421_9);
    assert_eq!(patch.plane.height_m, 15.447_425_842_285_156);
}
