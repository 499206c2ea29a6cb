//! Patches of what trees shed.

use std::collections::BTreeSet;
use std::sync::LazyLock;

use nemoral_assets::{
    AssetParams, Library, LitterParams, PlantAsset, PlantKind, Species, StandSpecies,
};
use nemoral_scene::{Card, Semantic};
use nemoral_seed::Key;

fn params(names: &[&str]) -> AssetParams {
    AssetParams {
        species: (names.iter())
            .map(|name| StandSpecies {
                species: Species::built_in(name).expect("a built-in species"),
                dbh_mean_m: 0.15,
                trees_per_ha: 300.0,
            })
            .collect(),
        individuals_per_species: 1,
        litter: Some(LitterParams {
            shares: vec![1.0; names.len()],
            leaves: 1.0,
            wood: 1.0,
            stones: 1.0,
        }),
        wayside: true,
        textures: false,
        ..AssetParams::default()
    }
}

const NAMES: [&str; 4] = ["beech", "norway_spruce", "eucalyptus", "maritime_pine"];

static LIBRARY: LazyLock<Library> =
    LazyLock::new(|| Library::grow(&params(&NAMES), Key::world(11)).expect("valid"));

fn patches() -> impl Iterator<Item = (&'static str, bool, &'static PlantAsset)> {
    NAMES.into_iter().zip(&LIBRARY.shed).flat_map(|(name, of)| {
        let wide = of.wide.iter().map(move |patch| (name, true, patch));
        wide.chain(of.narrow.iter().map(move |patch| (name, false, patch)))
    })
}

fn semantics(patch: &PlantAsset) -> BTreeSet<Semantic> {
    let shape = &patch.prototype;
    let cards = shape.cards().iter().map(|c| c.material);
    let materials = cards.chain(shape.mesh().triangles.iter().map(|t| t.material));
    materials
        .map(|m| LIBRARY.materials.get(m).semantic)
        .collect()
}

#[test]
fn what_stands_hides_light_from_the_ground_and_what_lies_flat_does_not() {
    let library = &*LIBRARY;
    let hides = |plants: &[PlantAsset]| -> Vec<bool> {
        let shapes = plants.iter().map(|plant| &plant.prototype);
        shapes.map(|shape| !shape.occluders().is_empty()).collect()
    };
    for upright in [
        PlantKind::Rock,
        PlantKind::Stump,
        PlantKind::Shrub,
        PlantKind::Grass,
        PlantKind::Ferns,
    ] {
        let hides = hides(&library.plants[upright]);
        assert!(
            !hides.is_empty() && hides.iter().all(|hides| *hides),
            "{upright:?}: {hides:?}"
        );
    }
    assert!(
        library
            .trees
            .iter()
            .all(|tree| !tree.prototype.occluders().is_empty())
    );
    // They are shaded as the ground is, and would shade themselves.
    let shed = library.shed.iter().flat_map(|of| [&of.wide, &of.narrow]);
    let of_ways = [PlantKind::StoneBed, PlantKind::TrailRoot].map(|kind| &library.plants[kind]);
    for flat in shed.chain(of_ways) {
        assert!(!flat.is_empty() && hides(flat).iter().all(|hides| !hides));
    }
}

#[test]
fn each_species_sheds_what_it_has() {
    use Semantic as S;
    for (name, of) in NAMES.into_iter().zip(&LIBRARY.shed) {
        assert!(of.wide.len() >= 12 && of.narrow.len() >= 8, "{name}");
        let all: BTreeSet<Semantic> = of.wide.iter().flat_map(semantics).collect();
        let wanted = BTreeSet::from([S::Litter, S::FallenTwig, S::FallenBark, S::Stone]);
        assert_eq!(all, wanted, "{name}");
    }
    for (name, is_wide, patch) in patches() {
        let reach = patch.radius_m;
        let radius = if is_wide { 0.8 } else { 0.42 };
        assert!(
            reach > 0.7 * radius && reach < radius + 0.4,
            "{name} {reach}"
        );
        assert!(patch.height_m < 0.14, "{name} {}", patch.height_m);
        let materials: BTreeSet<u16> = (patch.prototype.cards().iter())
            .map(|c| c.material.0)
            .collect();
        let least = if is_wide { 5 } else { 3 };
        assert!(materials.len() >= least, "{name}: leaves are all alike");
        assert!(patch.prototype.cards().len() <= 900, "{name}");
        assert!(patch.prototype.mesh().triangles.len() <= 6000, "{name}");
    }
}

/// Leaves rest on the ground or on others: none of them is below it, and none hangs above.
#[test]
fn leaves_rest() {
    for (name, _, patch) in patches() {
        // Leaves of two pieces are two cards in turn.
        let cards = patch.prototype.cards();
        let low = |card: &Card| card.corners().iter().fold(f32::MAX, |a, p| a.min(p.z));
        let high = |card: &Card| card.corners().iter().fold(f32::MIN, |a, p| a.max(p.z));
        for card in cards {
            assert!(low(card) > 0.0019, "{name}: a leaf is in the ground");
            assert!(low(card) < 0.075, "{name}: a leaf hangs in the air");
            assert!(high(card) < 0.14, "{name}: a leaf stands up");
        }
        let near = cards.iter().filter(|c| low(c) < 0.03).count();
        assert!(near * 10 > cards.len() * 8, "{name}: leaves hang");
    }
}

#[test]
fn deep_patches_have_more_leaves() {
    for (name, of) in NAMES.into_iter().zip(&LIBRARY.shed) {
        for list in [&of.wide, &of.narrow] {
            let counts: Vec<usize> = list.iter().map(|p| p.prototype.cards().len()).collect();
            let (first, last) = (counts[0], counts[counts.len() - 1]);
            assert!(last > 3 * first, "{name}: {counts:?}");
        }
    }
}

#[test]
fn amounts_are_followed() {
    let cards = |leaves: f64| -> usize {
        let mut params = params(&["beech"]);
        params.litter = params.litter.map(|of| LitterParams {
            leaves,
            wood: 0.0,
            stones: 0.0,
            ..of
        });
        let library = Library::grow(&params, Key::world(3)).expect("valid");
        let wide = library.shed[0].wide.iter();
        assert!(
            wide.clone()
                .all(|p| p.prototype.mesh().triangles.is_empty())
        );
        wide.map(|p| p.prototype.cards().len()).sum()
    };
    let (one, half) = (cards(1.0), cards(0.5));
    let share = half as f64 / one as f64;
    assert!((share - 0.5).abs() < 0.02, "{share}");
    let mut wrong = params(&["beech"]);
    wrong.litter.as_mut().expect("asked for").shares.clear();
    let said = wrong.check().expect_err("one share is missing").to_string();
    assert!(said.contains("litter.shares"), "{said}");
}

#[test]
fn it_is_stored_and_nothing_is_made_without_being_asked_for() {
    let restored = Library::from_bytes(&LIBRARY.to_bytes()).expect("it can be read");
    for (a, b) in restored.shed.iter().zip(&LIBRARY.shed) {
        for (a, b) in a.wide.iter().zip(&b.wide) {
            assert_eq!(a.prototype.cards(), b.prototype.cards());
            assert_eq!(a.prototype.mesh(), b.prototype.mesh());
        }
        assert_eq!(a.narrow.len(), b.narrow.len());
    }
    let without = AssetParams {
        litter: None,
        ..params(&["beech"])
    };
    let without = Library::grow(&without, Key::world(11)).expect("valid");
    assert!(without.shed.is_empty());
    let names = without.materials.materials().iter().map(|m| &m.name);
    assert!(names.clone().all(|name| !name.contains(".shed.")));
    // All that is grown without it has the same materials with it.
    let with = Library::grow(&params(&["beech"]), Key::world(11)).expect("valid");
    let first = with.materials.materials().iter().map(|m| &m.name);
    assert!(first.zip(names).all(|(a, b)| a == b));
}

#[test]
fn value_stability() {
    let of = &LIBRARY.shed[0].wide[6].prototype;
    let card = of.cards()[10];
    assert_eq!((of.cards().len(), of.mesh().positions.len()), (435, 1942));
    assert_eq!(
        card.corner.to_array(),
        [0.529_275_06, 0.261_144_1, 0.007_781_269]
    );
    assert_eq!(
        card.edge_v.to_array(),
        [0.014_364_313, 0.036_260_117, 0.023_218_554]
    );
}
