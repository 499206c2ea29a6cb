//! Which textures are made, and that nothing but colour depends on them.

use std::sync::{Arc, LazyLock};

use nemoral_assets::{
    AssetParams, ClimberParams, Library, LitterParams, Species, StandSpecies, StemMoss,
};
use nemoral_scene::{Material, MaterialLibrary, TrailSurfaceKind};
use nemoral_seed::Key;

static TEXTURED: LazyLock<Library> = LazyLock::new(|| grow(true));

fn grow(textures: bool) -> Library {
    let params = AssetParams {
        species: vec![StandSpecies {
            species: Species::built_in("silver_birch").expect("a built-in species"),
            dbh_mean_m: 0.15,
            trees_per_ha: 300.0,
        }],
        individuals_per_species: 1,
        snags_per_species: 1,
        seedlings_per_species: 1,
        deadwood: true,
        climbers: Some(ClimberParams {
            moss: StemMoss {
                amount: 1.0,
                height_m: 1.0,
            },
            lianas: true,
            resin: true,
        }),
        trail_surfaces: vec![TrailSurfaceKind::Grassy],
        wayside: true,
        surface_roots: true,
        litter: Some(LitterParams {
            shares: vec![1.0],
            leaves: 1.0,
            wood: 1.0,
            stones: 1.0,
        }),
        textures,
        ..AssetParams::default()
    };
    Library::grow(&params, Key::world(11)).expect("valid")
}

#[test]
fn trails_of_one_surface_share_its_textures() {
    let ground = &TEXTURED.ground;
    let albedo = |kind| &TEXTURED.materials.get(ground.trail(kind).surface).albedo;
    let only = albedo(TrailSurfaceKind::Grassy);
    assert!(only.width() > 1);
    let shared = |kind| Arc::ptr_eq(albedo(kind), only);
    assert!(TrailSurfaceKind::ALL.into_iter().all(shared));
}

#[test]
fn nothing_but_colour_depends_on_textures() {
    let mut plain = grow(false);
    let textured = TEXTURED.materials.materials();
    let of_plain = plain.materials.materials();
    assert_eq!(of_plain.len(), textured.len());
    // Images of leaves are drawn in any case: their masks are what rays meet.
    let is_plain = |m: &&Material| m.albedo.width() == 1 && m.mask.is_none();
    let plain_ones = of_plain.iter().filter(is_plain).count();
    let solid = textured.iter().filter(|m| m.mask.is_none()).count();
    assert_eq!(plain_ones, solid);
    // In a culvert it is dark.
    let names: Vec<_> = textured.iter().filter(is_plain).map(|m| &m.name).collect();
    assert_eq!(names, ["culvert.dark"]);
    let mut painted = MaterialLibrary::new();
    for (material, with) in of_plain.iter().zip(textured) {
        painted.add(Material {
            albedo: with.albedo.clone(),
            ..material.clone()
        });
    }
    plain.materials = painted;
    assert!(plain.to_bytes() == TEXTURED.to_bytes());
}
