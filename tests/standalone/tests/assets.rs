//! Use of `nemoral-assets` alone: plants for another engine.

use nemoral_assets::{AssetParams, Library, ParamError, PlantKind};
use nemoral_scene::{AlphaMask, Semantic};
use nemoral_seed::Key;

#[test]
fn a_library_is_grown_from_a_key() -> Result<(), ParamError> {
    let params = AssetParams {
        individuals_per_species: 1,
        ..AssetParams::default()
    };
    let library = Library::grow(&params, Key::world(7))?;
    assert!(library.trees.len() >= 3, "{} trees", library.trees.len());
    let semantic = |material| library.materials.get(material).semantic;
    for tree in &library.trees {
        // The tree is as tall as its record says, and has wood and leaves.
        let bounds = tree.prototype.bounds();
        let height_m = f64::from(bounds.max.z);
        let ratio = height_m / tree.size.height_m;
        assert!(
            (0.8..1.2).contains(&ratio),
            "{}: {height_m} m",
            tree.species
        );
        assert!((0.05..1.5).contains(&tree.size.dbh_m), "{}", tree.species);
        let mut wood = tree.prototype.mesh().triangles.iter();
        assert!(wood.any(|t| semantic(t.material) == Semantic::Stem));
        let mut cards = tree.prototype.cards().iter();
        assert!(cards.any(|c| [Semantic::Needle, Semantic::Leaf].contains(&semantic(c.material))));
    }
    for kind in [
        PlantKind::Shrub,
        PlantKind::Stump,
        PlantKind::Rock,
        PlantKind::Grass,
        PlantKind::Herbs,
        PlantKind::Ferns,
        PlantKind::Litter,
    ] {
        let plants = &library.plants[kind];
        assert!(!plants.is_empty(), "{kind:?}");
        for plant in plants {
            assert!(
                plant.radius_m > 0.0 && plant.height_m >= 0.0,
                "{}",
                plant.name
            );
        }
    }
    // Some materials have masks, which cut leaves out of their cards.
    let masks = library.materials.materials().iter();
    let masks: Vec<&AlphaMask> = masks.filter_map(|m| m.mask.as_deref()).collect();
    assert!(masks.len() > 5, "{} masks", masks.len());
    Ok(())
}
