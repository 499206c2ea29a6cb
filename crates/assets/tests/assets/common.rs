//! What several tests of trees need.

use nemoral_assets::{FoliageCard, TreeMaterials};
use nemoral_scene::glam::{DVec2, DVec3, Vec3};
use nemoral_scene::{Card, Material, MaterialId, MaterialLibrary, Mesh, Semantic, Triangle};
use nemoral_seed::{Domain, Key};

pub(crate) const STEM: MaterialId = MaterialId(0);
pub(crate) const FLARE: MaterialId = MaterialId(1);
pub(crate) const LIMB: MaterialId = MaterialId(2);
pub(crate) const BRANCH: MaterialId = MaterialId(3);
pub(crate) const DEAD: MaterialId = MaterialId(4);
pub(crate) const CHANGE: MaterialId = MaterialId(7);
pub(crate) const UPPER: MaterialId = MaterialId(8);
pub(crate) const SNAG: MaterialId = MaterialId(9);

pub(crate) fn library() -> MaterialLibrary {
    let mut library = MaterialLibrary::new();
    for semantic in [
        Semantic::Stem,
        Semantic::RootFlare,
        Semantic::Limb,
        Semantic::Branch,
        Semantic::Twig,
        Semantic::Leaf,
        Semantic::Leaf,
        Semantic::Stem,
        Semantic::Stem,
        Semantic::Snag,
    ] {
        library.add(Material::plain(semantic.name(), semantic, Vec3::splat(0.2)));
    }
    library
}

pub(crate) fn materials() -> TreeMaterials {
    let card = |material, width_m, opaque_fraction| FoliageCard {
        material: MaterialId(material),
        width_m,
        height_m: 0.42,
        opaque_fraction,
    };
    TreeMaterials {
        stem: STEM,
        flare: FLARE,
        limb: LIMB,
        branch: BRANCH,
        dead: DEAD,
        change: CHANGE,
        upper: UPPER,
        snag: SNAG,
        foliage: vec![card(5, 0.4, 0.5), card(6, 0.3, 0.4)],
    }
}

pub(crate) fn key(i: u64) -> Key {
    Key::world(7).domain(Domain::new("test.trees")).item(i)
}

pub(crate) fn corners(mesh: &Mesh, t: &Triangle) -> [DVec3; 3] {
    t.corners.map(|c| mesh.positions[c as usize].as_dvec3())
}

pub(crate) fn silhouette_m2(cards: &[Card]) -> f64 {
    let materials = materials();
    let of = |card: &Card| {
        let kind = materials
            .foliage
            .iter()
            .find(|f| f.material == card.material)
            .expect("a foliage material");
        f64::from(card.area_m2()) * f64::from(kind.opaque_fraction)
    };
    cards.iter().map(of).sum()
}

/// A level cut through the stem: corners, sorted by azimuth.
pub(crate) fn stem_cut(mesh: &Mesh, z: f64) -> Vec<DVec2> {
    let mut cut = Vec::new();
    for t in mesh
        .triangles
        .iter()
        .filter(|t| [STEM, FLARE, CHANGE, UPPER, SNAG].contains(&t.material))
    {
        let p = corners(mesh, t);
        for k in 0..3 {
            let (a, b) = (p[k], p[(k + 1) % 3]);
            if (a.z < z) != (b.z < z) {
                cut.push(a.lerp(b, (z - a.z) / (b.z - a.z)).truncate());
            }
        }
    }
    let centre = cut.iter().sum::<DVec2>() / cut.len() as f64;
    cut.sort_by(|a, b| {
        (*a - centre)
            .to_angle()
            .total_cmp(&(*b - centre).to_angle())
    });
    cut
}

/// The girth of a cut, metres.
pub(crate) fn girth_m(cut: &[DVec2]) -> f64 {
    (0..cut.len())
        .map(|i| cut[i].distance(cut[(i + 1) % cut.len()]))
        .sum()
}

/// Diameter at breast height by cutting the stem: that of a circle with the cut's area.
pub(crate) fn cut_dbh_m(mesh: &Mesh) -> f64 {
    cut_diameter_m(mesh, 1.3)
}

/// The same at another height, metres.
pub(crate) fn cut_diameter_m(mesh: &Mesh, z: f64) -> f64 {
    let cut = stem_cut(mesh, z);
    let centre = cut.iter().sum::<DVec2>() / cut.len() as f64;
    let twice: f64 = (0..cut.len())
        .map(|i| (cut[i] - centre).perp_dot(cut[(i + 1) % cut.len()] - centre))
        .sum();
    (2.0 * twice.abs() / std::f64::consts::PI).sqrt()
}

/// The highest point of a picture, taken as an ellipse that fills the card, because its corners are
/// empty.
pub(crate) fn top_m(card: &Card) -> f32 {
    let middle = card.corner + 0.5 * (card.edge_u + card.edge_v);
    middle.z + 0.5 * card.edge_u.z.hypot(card.edge_v.z)
}
