//! Properties of grown trees, checked on their triangles and cards.

mod allometry;
mod competition;
mod requests;
mod size;
mod stability;
mod stem;
mod surface;

use crate::common::{key, materials};
use nemoral_assets::{GrownTree, GrowthParams, Species, TreeSize, grow};
use nemoral_scene::Card;
use nemoral_scene::glam::Vec3;

fn tree(species: &Species, dbh_m: f64, i: u64) -> (TreeSize, GrownTree) {
    let size = species.draw_size(dbh_m, key(i));
    let tree = grow(
        species,
        &size,
        &materials(),
        &GrowthParams::default(),
        key(i),
    )
    .expect("a drawn size grows");
    (size, tree)
}

/// Every species at three diameters.
fn sample() -> Vec<(Species, TreeSize, GrownTree)> {
    let mut out = Vec::new();
    for species in Species::all() {
        for (i, dbh) in [0.12, 0.28, 0.5].into_iter().enumerate() {
            let (size, tree) = tree(&species, dbh, i as u64);
            out.push((species.clone(), size, tree));
        }
    }
    out
}

fn tip(card: &Card) -> Vec3 {
    card.corner + 0.5 * card.edge_u + card.edge_v
}

fn attachment(card: &Card) -> Vec3 {
    card.corner + 0.5 * card.edge_u
}
