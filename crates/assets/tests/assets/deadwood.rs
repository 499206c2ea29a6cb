//! Logs, root plates, branches, and what climbs on stems.

use std::collections::BTreeSet;
use std::sync::LazyLock;

use glam::Vec3;
use nemoral_assets::{AssetParams, ClimberParams, Library, LogAsset, PlantKind, StemMoss};
use nemoral_scene::{DecayStage, Occluder, Prototype, Semantic};
use nemoral_seed::Key;

static LIBRARY: LazyLock<Library> = LazyLock::new(|| {
    let params = AssetParams {
        individuals_per_species: 2,
        snags_per_species: 1,
        deadwood: true,
        climbers: Some(ClimberParams {
            moss: StemMoss {
                amount: 1.0,
                height_m: 1.2,
            },
            lianas: true,
            resin: true,
        }),
        textures: false,
        ..AssetParams::default()
    };
    Library::grow(&params, Key::world(11)).expect("valid")
});

fn logs() -> impl Iterator<Item = &'static LogAsset> {
    LIBRARY.deadwood.logs.iter().chain(&LIBRARY.deadwood.thrown)
}

fn semantics(shape: &Prototype) -> BTreeSet<Semantic> {
    let triangles = shape.mesh().triangles.iter().map(|t| t.material);
    let cards = shape.cards().iter().map(|c| c.material);
    let materials = triangles.chain(cards);
    materials
        .map(|m| LIBRARY.materials.get(m).semantic)
        .collect()
}

/// The volume in closed surfaces that face outwards, by the divergence theorem.
fn volume_m3(shape: &Prototype) -> f64 {
    let m = shape.mesh();
    let triangles = m.triangles.iter().map(|t| {
        let [a, b, c] = t.corners.map(|i| m.positions[i as usize].as_dvec3());
        a.dot(b.cross(c)) / 6.0
    });
    triangles.sum()
}

fn faces_outwards(shape: &Prototype) {
    let m = shape.mesh();
    let turned = m.triangles.iter().filter(|t| {
        let [a, b, c] = t.corners.map(|i| m.positions[i as usize]);
        let n: Vec3 = t.corners.iter().map(|&i| m.normals[i as usize]).sum();
        (b - a).cross(c - a).dot(n) < 0.0
    });
    let turned = turned.count();
    assert!(
        turned * 100 <= m.triangles.len(),
        "{}: {turned} of {}",
        shape.name(),
        m.triangles.len()
    );
}

#[test]
fn every_species_has_logs_of_every_stage_and_size() {
    for species in ["maritime_pine", "eucalyptus", "english_oak"] {
        for stage in DecayStage::ALL {
            let of = LIBRARY.deadwood.logs.iter();
            let of = of.filter(|l| l.species == species && l.stage == stage);
            let sizes: Vec<f64> = of.map(|l| l.diameter_m[0]).collect();
            assert!(
                sizes.len() == 3 && sizes[0] < sizes[2],
                "{species} {sizes:?}"
            );
        }
    }
    let count = |kind: PlantKind| LIBRARY.plants[kind].len();
    assert_eq!(count(PlantKind::RootPlate), LIBRARY.deadwood.thrown.len());
    assert!(count(PlantKind::Branch) >= 8 && count(PlantKind::Brash) >= 8);
}

#[test]
fn deadwood_hides_light_from_the_ground() {
    let patches = [PlantKind::RootPlate, PlantKind::Branch, PlantKind::Brash]
        .into_iter()
        .flat_map(|kind| &LIBRARY.plants[kind]);
    let shapes = logs()
        .map(|log| &log.prototype)
        .chain(patches.map(|p| &p.prototype));
    for shape in shapes {
        let occluders = shape.occluders();
        let hides = |o: &Occluder| o.area_m2 > 0.0 && o.position_m.z < 1.5;
        assert!(
            !occluders.is_empty() && occluders.iter().all(hides),
            "{}",
            shape.name()
        );
    }
    let is_there = |kind: PlantKind| !LIBRARY.plants[kind].is_empty();
    assert!(is_there(PlantKind::Brash) && is_there(PlantKind::RootPlate));
}

#[test]
fn a_log_has_the_sizes_that_it_says() {
    for log in logs() {
        let name = log.prototype.name();
        let bounds = log.prototype.bounds();
        let (length, low, high) = (
            f64::from(bounds.max.x - bounds.min.x),
            f64::from(-bounds.min.z),
            log.half_height_m[0],
        );
        // Splinters reach a little beyond the ends.
        let reach = length - log.length_m;
        assert!((-0.05..0.5).contains(&reach), "{name}: {reach}");
        assert!((0.75..1.35).contains(&(low / high)), "{name}: {low} {high}");
        // Stubs of branches, splinters and unevenness are all that it differs by.
        let found = volume_m3(&log.prototype);
        let off = found / log.volume_m3;
        assert!((0.6..1.25).contains(&off), "{name} {:?}: {off}", log.stage);
        faces_outwards(&log.prototype);
        assert_eq!(semantics(&log.prototype), BTreeSet::from([Semantic::Log]));
        assert!(log.prototype.mesh().triangles.len() < 3500, "{name}");
    }
    // What decays gets flat.
    let flat = |stage| {
        let logs = LIBRARY.deadwood.logs.iter().filter(|l| l.stage == stage);
        let shares = logs.map(|l| 2.0 * l.half_height_m[0] / l.diameter_m[0]);
        shares.fold(0.0, f64::max)
    };
    assert!(flat(DecayStage::Fresh) > 0.99 && flat(DecayStage::Rotten) < 0.8);
}

#[test]
fn plates_and_branches_lie_and_are_what_they_are() {
    for plate in &LIBRARY.plants[PlantKind::RootPlate] {
        assert_eq!(
            semantics(&plate.prototype),
            BTreeSet::from([Semantic::RootPlate])
        );
        faces_outwards(&plate.prototype);
        assert!((0.5..1.5).contains(&plate.radius_m));
    }
    let lying = [PlantKind::Branch, PlantKind::Brash].into_iter();
    for patch in lying.flat_map(|kind| &LIBRARY.plants[kind]) {
        let (name, bounds) = (patch.prototype.name(), patch.prototype.bounds());
        assert_eq!(
            semantics(&patch.prototype),
            BTreeSet::from([Semantic::FallenBranch])
        );
        assert!((-0.03..0.03).contains(&bounds.min.z), "{name}: {bounds:?}");
        assert!(
            bounds.max.z < 1.6 && patch.radius_m < 2.6,
            "{name}: {bounds:?}"
        );
        let triangles = patch.prototype.mesh().triangles.len();
        assert!(triangles < 7000, "{name}: {triangles}");
    }
}

#[test]
fn climbers_keep_to_their_stem_and_name_it() {
    let trees = LIBRARY.trees.iter().chain(&LIBRARY.snags);
    let climbers = (LIBRARY.climbers.trees.iter()).chain(&LIBRARY.climbers.snags);
    let mut pairs = 0;
    for (tree, climbers) in trees.zip(climbers) {
        assert!(climbers.ivy.len() == 2 && climbers.moss.len() == 4);
        let [low, high] = [0, 1].map(|i| climbers.ivy[i].bounds().max.z);
        assert!(low < high, "{}: {low} {high}", tree.species);
        for (shapes, semantic) in [
            (&climbers.ivy, Semantic::Climber),
            (&climbers.moss, Semantic::StemGrowth),
        ] {
            for shape in shapes {
                assert_eq!(semantics(shape), BTreeSet::from([semantic]));
                let material = LIBRARY.materials.get(shape.cards()[0].material);
                assert_eq!(material.support, Some(Semantic::Stem));
                assert!(shape.cards().len() <= 900, "{}", shape.name());
                let reach = tree.radius_m as f32 + 0.35;
                // Leaning stems reach aside.
                let lean = tree.size.lean_rad.tan() as f32;
                // Ivy also covers the limbs of dead trees.
                let on_stem = shape.cards().iter().filter(|_| tree.alive);
                for card in on_stem {
                    let at = card.corner + 0.5 * (card.edge_u + card.edge_v);
                    let aside = at.truncate().length() - lean * at.z.max(0.0) * 1.5;
                    assert!(aside < reach + 0.5, "{}: {at}", shape.name());
                }
            }
        }
        pairs += 1;
    }
    assert_eq!(pairs, 9);
    // Moss is densest on its side.
    let moss = &LIBRARY.climbers.trees[0].moss;
    let east = moss[0].cards().iter().filter(|c| c.corner.x > 0.0).count();
    assert!(east * 2 > moss[0].cards().len(), "{east}");
}
