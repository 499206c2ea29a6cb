//! The materials of a species' trees.

use std::sync::Arc;

use nemoral_scene::{MaterialLibrary, Semantic, Texture};

use super::foliage::register_leaves;
use super::solid::{BarkTextures, SolidTextures, laser, solid};
use crate::cards::card_raster::CardImage;
use crate::tree::{LeafKind, Species, TreeMaterials};

pub(super) fn register_tree(
    library: &mut MaterialLibrary,
    species: &Species,
    barks: &BarkTextures,
    solids: &SolidTextures,
    images: Vec<CardImage>,
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
    let leaves = &species.shoot();
    let semantic = match leaves.kind {
        LeafKind::NeedleTuft | LeafKind::NeedleSpray => Semantic::Needle,
        _ => Semantic::Leaf,
    };
    let foliage = images.into_iter().enumerate().map(|(number, image)| {
        let name = format!("{}.foliage.{number}", species.name);
        register_leaves(library, &name, semantic, leaves, image)
    });
    TreeMaterials {
        foliage: foliage.collect(),
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
