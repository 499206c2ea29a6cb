//! What must hold for every shape of a library.

use crate::default_library::{KEY, LIBRARY, all_plants, params, semantics};
use nemoral_assets::{AssetParams, Library, PlantKind, Species, StandParams, StandSpecies};
use nemoral_scene::Semantic;
use nemoral_scene::glam::Vec3;

#[test]
fn every_kind_has_its_semantics_and_its_variants() {
    let l = &*LIBRARY;
    let only = |kind: PlantKind, wanted: &[Semantic]| {
        for p in &l.plants[kind] {
            for s in semantics(&p.prototype) {
                assert!(wanted.contains(&s), "{}: {s:?}", p.prototype.name());
            }
        }
    };
    only(PlantKind::Grass, &[Semantic::Grass]);
    only(PlantKind::Herbs, &[Semantic::Herb]);
    only(PlantKind::Ferns, &[Semantic::Fern]);
    only(PlantKind::Litter, &[Semantic::FallenTwig]);
    only(PlantKind::TrailTuft, &[Semantic::Grass, Semantic::Herb]);
    only(PlantKind::StripMat, &[Semantic::Grass, Semantic::Herb]);
    only(PlantKind::TrailStone, &[Semantic::Stone]);
    only(PlantKind::Rock, &[Semantic::Rock]);
    only(PlantKind::Stump, &[Semantic::Stump]);
    only(PlantKind::Shrub, &[Semantic::Shrub, Semantic::Bramble]);
    for p in &l.plants[PlantKind::Shrub] {
        let want = if p.name == "bramble" {
            Semantic::Bramble
        } else {
            Semantic::Shrub
        };
        assert_eq!(semantics(&p.prototype), [want], "{}", p.name);
    }
    for kind in [
        PlantKind::Grass,
        PlantKind::Herbs,
        PlantKind::Litter,
        PlantKind::TrailTuft,
        PlantKind::StripMat,
        PlantKind::TrailStone,
    ] {
        assert!(l.plants[kind].len() >= 16, "{kind:?}");
    }
    for kind in ["bracken", "male_fern"] {
        let ferns = l.plants[PlantKind::Ferns].iter();
        assert!(ferns.filter(|p| p.name == kind).count() >= 16);
    }
    let count = |kind: PlantKind| l.plants[kind].len();
    assert!(count(PlantKind::Shrub) >= 6);
    assert!(count(PlantKind::Rock) >= 8 && count(PlantKind::Stump) >= 6);
    let mut names: Vec<_> = all_plants()
        .map(|p| p.prototype.name().to_owned())
        .collect();
    names.sort();
    let count = names.len();
    names.dedup();
    assert_eq!(names.len(), count, "two prototypes share a name");
}

#[test]
fn things_stand_in_the_ground_and_keep_their_radius() {
    let l = &*LIBRARY;
    for p in all_plants() {
        let b = p.prototype.bounds();
        assert!((f64::from(b.max.z) - p.height_m).abs() < 1e-6);
        assert!(p.radius_m > 0.02, "{}", p.name);
        let lies = p.name == "litter";
        assert!(
            lies || b.min.z < -0.009,
            "{} floats: {}",
            p.prototype.name(),
            b.min.z
        );
    }
    let patches = [
        PlantKind::Grass,
        PlantKind::Herbs,
        PlantKind::Ferns,
        PlantKind::Litter,
    ];
    for p in patches.into_iter().flat_map(|kind| &l.plants[kind]) {
        assert!(
            (0.2..1.8).contains(&p.radius_m),
            "{}: {}",
            p.prototype.name(),
            p.radius_m
        );
        assert!(p.height_m < 1.8, "{}: {}", p.name, p.height_m);
        let cards = p.prototype.cards().len();
        assert!(
            (30..=400).contains(&cards),
            "{}: {cards} cards",
            p.prototype.name()
        );
        let triangles = p.prototype.mesh().triangles.len();
        assert!(
            triangles <= 3000,
            "{}: {triangles} triangles",
            p.prototype.name()
        );
    }
    let stones = [PlantKind::Rock, PlantKind::TrailStone].into_iter();
    for p in stones.flat_map(|kind| &l.plants[kind]) {
        let b = p.prototype.bounds();
        let sunk = -b.min.z / (b.max.z - b.min.z);
        assert!(
            (0.24..0.62).contains(&sunk),
            "{}: {sunk}",
            p.prototype.name()
        );
    }
    for p in &l.plants[PlantKind::Stump] {
        // Under the ground all around, also on a slope of 45 degrees.
        let b = p.prototype.bounds();
        let wide = b.max.truncate().max(-b.min.truncate()).max_element();
        assert!(b.min.z < -wide, "{} of {wide}", b.min.z);
        assert!((0.06..0.75).contains(&p.radius_m), "{}", p.radius_m);
    }
    for p in &l.plants[PlantKind::Shrub] {
        assert!(
            (0.35..2.4).contains(&p.height_m),
            "{}: {}",
            p.prototype.name(),
            p.height_m
        );
    }
    for p in &l.plants[PlantKind::TrailStone] {
        assert!((0.03..0.14).contains(&p.radius_m), "{}", p.radius_m);
    }
    for t in &l.trees {
        assert!(
            t.size.dbh_m >= 0.07 && t.radius_m >= 0.4 * t.size.dbh_m,
            "{}",
            t.species
        );
    }
}

/// Stumps are left by trees such as stand.
#[test]
fn stumps_are_of_the_stands_species_and_sizes() {
    let species = params().species;
    let stumps = &LIBRARY.plants[PlantKind::Stump];
    let each = stumps.len() / species.len();
    assert!(each >= 3 && stumps.len() == each * species.len());
    for (of, stumps) in species.iter().zip(stumps.chunks(each)) {
        for stump in stumps {
            let mesh = stump.prototype.mesh();
            let own = format!("{}.stump_", of.species.name);
            for t in &mesh.triangles {
                let name = &LIBRARY.materials.get(t.material).name;
                assert!(name.starts_with(&own), "{name} in a stump of {own}");
            }
        }
        assert!(stumps[0].radius_m < stumps[each - 1].radius_m);
    }
    // A plantation of thin trees has no thick stumps.
    let thin = AssetParams {
        species: vec![StandSpecies {
            species: Species::eucalyptus(),
            dbh_mean_m: 0.16,
            trees_per_ha: 900.0,
        }],
        stand: StandParams {
            shape: 4.0,
            dbh_min_m: 0.08,
            dbh_max_m: 0.30,
        },
        textures: false,
        ..params()
    };
    let thin = Library::grow(&thin, KEY).expect("valid");
    // Roots make the foot up to twice as wide as the cut, which is up to 1.3 times as wide as the
    // tree.
    let stumps = thin.plants[PlantKind::Stump].iter();
    let radii_m: Vec<f64> = stumps.map(|s| s.radius_m).collect();
    assert!(
        radii_m.iter().all(|r| *r < 0.65 * 0.30 * 2.0),
        "{radii_m:?}"
    );
    let mean_m = radii_m.iter().sum::<f64>() / radii_m.len() as f64;
    assert!((0.09..0.19).contains(&mean_m), "{mean_m}");
}

#[test]
fn meshes_face_the_way_their_normals_do() {
    for p in all_plants() {
        let m = p.prototype.mesh();
        let turned = m
            .triangles
            .iter()
            .filter(|t| {
                let [a, b, c] = t.corners.map(|i| m.positions[i as usize]);
                let n: Vec3 = t.corners.iter().map(|&i| m.normals[i as usize]).sum();
                (b - a).cross(c - a).dot(n) < 0.0
            })
            .count();
        assert!(
            turned * 200 <= m.triangles.len(),
            "{}: {turned} of {}",
            p.prototype.name(),
            m.triangles.len()
        );
    }
}
