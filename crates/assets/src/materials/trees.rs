//! The materials of a species' trees.

use std::sync::Arc;

use nemoral_scene::{MaterialLibrary, Semantic, Texture};

use super::foliage::{LeafImage, register_leaves};
use super::seasons::FullLeafMasks;
use super::solid::{BarkTextures, SolidTextures, laser, solid};
use crate::tree::{FoliageCard, LeafLook, Species, TreeMaterials};

pub(super) fn register_tree(
    library: &mut MaterialLibrary,
    species: &Species,
    barks: &BarkTextures,
    solids: &SolidTextures,
    images: Vec<LeafImage>,
    full_leaf: &mut FullLeafMasks,
) -> TreeMaterials {
    let look = &species.bark;
    let optics = laser([look.nm905, 0.0], [look.nm1550, 0.0]);
    let mut part = |part: &str, semantic, albedo: &Arc<Texture>| {
        let name = format!("{}.{part}", species.name);
        let roughness = look.roughness as f32;
        library.add(solid(&name, semantic, albedo.clone(), roughness, optics))
    };
    let (stem, change, upper) = (
        part("stem", Semantic::Stem, &barks.lower),
        part("stem.change", Semantic::Stem, &barks.change),
        part("stem.upper", Semantic::Stem, &barks.upper),
    );
    let (flare, limb, branch) = (
        part("flare", Semantic::RootFlare, &barks.foot),
        part("limb", Semantic::Limb, &barks.upper),
        part("branch", Semantic::Branch, &barks.branch),
    );
    let (dead, snag) = (
        part("dead", Semantic::Twig, &solids.dead),
        part("snag", Semantic::Snag, &solids.snag),
    );
    let foliage = register_foliage(library, species, "foliage", images, full_leaf);
    TreeMaterials {
        foliage,
        stem,
        change,
        upper,
        flare,
        limb,
        branch,
        dead,
        snag,
    }
}

/// Registers the images of a species' leafy twigs; those without leaves are twigs.
pub(super) fn register_foliage(
    library: &mut MaterialLibrary,
    species: &Species,
    part: &str,
    images: Vec<LeafImage>,
    full_leaf: &mut FullLeafMasks,
) -> Vec<FoliageCard> {
    let of_leaf = match species.leaves.kind.is_needle() {
        true => Semantic::Needle,
        false => Semantic::Leaf,
    };
    let cards = images.into_iter().enumerate().map(|(number, of)| {
        let name = format!("{}.{part}.{number}", species.name);
        let (semantic, look) = match of.leaves {
            Some(leaves) => (of_leaf, leaves),
            None => (Semantic::Twig, bare_twig(species)),
        };
        let whole = of.image.whole_mask.clone();
        let card = register_leaves(library, &name, semantic, &look, of.image);
        full_leaf.extend(whole.map(|mask| (card.material, Arc::new(mask))));
        card
    });
    cards.collect()
}

/// A twig as if it were a leaf: it lets no light through.
fn bare_twig(species: &Species) -> LeafLook {
    LeafLook {
        transmittance: [0.0; 3],
        nm905: [species.bark.nm905, 0.0],
        nm1550: [species.bark.nm1550, 0.0],
        ..species.leaves.clone()
    }
}
