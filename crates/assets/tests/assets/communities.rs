//! Tiles of swards and thickets.

use std::collections::BTreeSet;
use std::sync::LazyLock;

use glam::{Vec2, Vec3};
use nemoral_assets::{AssetParams, Library, PlantAsset, PlantKind, Species, StandSpecies};
use nemoral_scene::{PlantCommunity, Semantic, TrailSurfaceKind};
use nemoral_seed::Key;

static LIBRARY: LazyLock<Library> = LazyLock::new(|| grow(&PlantCommunity::ALL));

fn grow(communities: &[PlantCommunity]) -> Library {
    Library::grow(&params(communities), Key::world(11)).expect("valid")
}

fn params(communities: &[PlantCommunity]) -> AssetParams {
    AssetParams {
        species: vec![StandSpecies {
            species: Species::built_in("silver_birch").expect("a built-in species"),
            dbh_mean_m: 0.15,
            trees_per_ha: 300.0,
        }],
        individuals_per_species: 1,
        communities: communities.to_vec(),
        trail_surfaces: vec![TrailSurfaceKind::Grassy],
        textures: false,
        ..AssetParams::default()
    }
}

fn tiles() -> impl Iterator<Item = (PlantCommunity, bool, &'static PlantAsset)> {
    PlantCommunity::ALL.into_iter().flat_map(|community| {
        let of = &LIBRARY.communities[community.index()];
        let wide = of.wide.iter().map(move |tile| (community, true, tile));
        wide.chain(of.narrow.iter().map(move |tile| (community, false, tile)))
    })
}

#[test]
fn roots_and_beds_of_stones_are_what_they_say() {
    let params = AssetParams {
        wayside: true,
        ..params(&[])
    };
    let library = Library::grow(&params, Key::world(11)).expect("valid");
    for (kind, semantics, count) in [
        (PlantKind::TrailRoot, &[Semantic::SurfaceRoot][..], 16),
        (PlantKind::StoneBed, &[Semantic::Soil, Semantic::Stone], 8),
    ] {
        let list = &library.plants[kind];
        assert_eq!(list.len(), count);
        for asset in list {
            let mesh = asset.prototype.mesh();
            let semantic_of = |m| library.materials.get(m).semantic;
            let found: BTreeSet<_> = mesh
                .triangles
                .iter()
                .map(|t| semantic_of(t.material))
                .collect();
            assert!(found.iter().eq(semantics), "{found:?}");
            assert!(asset.prototype.cards().is_empty());
            assert!((0.01..0.12).contains(&asset.height_m), "{}", asset.height_m);
        }
    }
    let restored = Library::from_bytes(&library.to_bytes()).expect("it can be read");
    let count = |library: &Library, kind: PlantKind| library.plants[kind].len();
    assert_eq!(count(&restored, PlantKind::TrailRoot), 16);
    assert_eq!(count(&restored, PlantKind::StoneBed), 8);
    // Roots are in the second half of what sticks out of banks.
    assert_eq!(count(&restored, PlantKind::Bank), 16);
    assert_eq!(count(&library, PlantKind::Bank), 16);
    for (i, asset) in library.plants[PlantKind::Bank].iter().enumerate() {
        let triangles = &asset.prototype.mesh().triangles;
        let has = |semantic| {
            let is_of = |m| library.materials.get(m).semantic == semantic;
            triangles.iter().any(|t| is_of(t.material))
        };
        assert!(has(Semantic::CutSlope));
        assert_eq!(has(Semantic::SurfaceRoot), i >= 8);
        assert!((0.02..0.25).contains(&asset.height_m), "{}", asset.height_m);
    }
    // Nothing of them is made where it is not asked for.
    for kind in [PlantKind::TrailRoot, PlantKind::StoneBed, PlantKind::Bank] {
        assert!(LIBRARY.plants[kind].is_empty(), "{kind:?}");
    }
}

#[test]
fn each_community_has_its_semantics_size_and_variants() {
    for community in PlantCommunity::ALL {
        let of = &LIBRARY.communities[community.index()];
        assert_eq!(of.wide.len(), 8, "{community:?}");
        let narrow = if community.is_grass() { 8 } else { 0 };
        assert_eq!(of.narrow.len(), narrow, "{community:?}");
    }
    for (community, is_wide, tile) in tiles() {
        let shape = &tile.prototype;
        let cards = shape.cards().iter().map(|c| c.material);
        let wood = shape.mesh().triangles.iter().map(|t| t.material);
        let materials = cards.chain(wood);
        let found: BTreeSet<Semantic> = materials
            .map(|m| LIBRARY.materials.get(m).semantic)
            .collect();
        let want = match community {
            PlantCommunity::Bramble => Semantic::Bramble,
            PlantCommunity::Bracken => Semantic::Fern,
            PlantCommunity::Heath | PlantCommunity::Bilberry => Semantic::Shrub,
            PlantCommunity::Nettles => Semantic::Herb,
            _ => Semantic::Grass,
        };
        assert_eq!(found, BTreeSet::from([want]), "{}", shape.name());
        let height = match community {
            PlantCommunity::GrazedGrass => 0.10..0.9,
            PlantCommunity::Bilberry => 0.12..0.55,
            PlantCommunity::Heath => 0.25..1.1,
            PlantCommunity::Reeds => 0.9..2.8,
            PlantCommunity::Bramble | PlantCommunity::Bracken | PlantCommunity::Nettles => 0.4..1.9,
            _ => 0.25..1.2,
        };
        assert!(
            height.contains(&tile.height_m),
            "{}: {}",
            shape.name(),
            tile.height_m
        );
        // None floats: what stands is rooted below the ground.
        assert!(shape.bounds().min.z < -0.004, "{}", shape.name());
        let most = if is_wide { 800 } else { 150 };
        let count = shape.cards().len();
        assert!(
            (20..most).contains(&count),
            "{}: {count} cards",
            shape.name()
        );
        let triangles = shape.mesh().triangles.len();
        assert!(triangles <= 4000, "{}: {triangles} triangles", shape.name());
    }
}

/// The share of lines straight down that meet an opaque texel of tiles on a grid of `cell_m`.
fn cover(tiles: &[PlantAsset], cell_m: f32) -> f64 {
    let (mut met, mut all) = (0, 0);
    for i in 0..900 {
        let p = Vec2::new((i % 30) as f32, (i / 30) as f32) / 30.0 * cell_m;
        let is_met = (-1..=1).any(|x: i32| {
            (-1..=1).any(|y: i32| {
                let number = (5 * (x + 1) + y + 1) as usize % tiles.len();
                let middle = (Vec2::new(x as f32, y as f32) + 0.5) * cell_m;
                meets(&tiles[number], p - middle)
            })
        });
        met += i32::from(is_met);
        all += 1;
    }
    f64::from(met) / f64::from(all)
}

/// Whether a line straight down at p meets a card of a tile.
fn meets(tile: &PlantAsset, p: Vec2) -> bool {
    tile.prototype.cards().iter().any(|card| {
        let (u, v, corner) = (card.edge_u, card.edge_v, card.corner);
        let normal = u.cross(v);
        if normal.z.abs() < 1e-9 {
            return false;
        }
        let off = p.extend(0.0) - corner;
        let z = -(normal.x * off.x + normal.y * off.y) / normal.z;
        let at = Vec3::new(off.x, off.y, z);
        let (a, b) = (
            at.dot(u) / u.length_squared(),
            at.dot(v) / v.length_squared(),
        );
        if !(0.0..1.0).contains(&a) || !(0.0..1.0).contains(&b) {
            return false;
        }
        let mask = LIBRARY
            .materials
            .get(card.material)
            .mask
            .as_ref()
            .expect("a mask");
        let texel = |t: f32, of: usize| ((t * of as f32) as usize).min(of - 1);
        mask.texel(texel(a, mask.width()), texel(b, mask.height()))
    })
}

#[test]
fn tiles_side_by_side_hide_the_ground() {
    for community in PlantCommunity::ALL {
        let of = &LIBRARY.communities[community.index()];
        let wide = cover(&of.wide, 1.25);
        assert!(wide > 0.70, "{community:?}: {wide}");
        if community.is_grass() {
            let narrow = cover(&of.narrow, 0.55);
            assert!(narrow > 0.65, "{community:?}: {narrow}");
        }
        // Twice as far apart they leave gaps, so the measure can fail.
        let sparse = cover(&of.wide, 3.6);
        assert!(sparse < 0.70, "{community:?}: {sparse}");
    }
}

#[test]
fn what_is_not_asked_for_is_not_made_and_changes_nothing_else() {
    let few = grow(&[PlantCommunity::Bracken]);
    let none = grow(&[]);
    assert!(
        none.communities
            .iter()
            .all(|t| t.wide.is_empty() && t.narrow.is_empty())
    );
    let made = few.communities.iter().filter(|t| !t.wide.is_empty());
    assert_eq!(made.count(), 1);
    let all = &LIBRARY.materials;
    for (a, b) in none.materials.materials().iter().zip(all.materials()) {
        assert_eq!(a.name, b.name);
    }
    let [without, with] = [&none, &*LIBRARY].map(|l| &l.plants[PlantKind::Grass]);
    for (a, b) in without.iter().zip(with) {
        assert_eq!(a.prototype.cards(), b.prototype.cards());
    }
    let bracken = PlantCommunity::Bracken.index();
    let [a, b] = [&few, &*LIBRARY].map(|l| l.communities[bracken].wide[3].prototype.cards()[7]);
    assert_eq!(a.corner, b.corner);
}

#[test]
fn a_library_with_communities_survives_storage() {
    let library = grow(&[PlantCommunity::GrazedGrass, PlantCommunity::Nettles]);
    let bytes = library.to_bytes();
    let read = Library::from_bytes(&bytes).expect("its own bytes");
    assert_eq!(read.to_bytes(), bytes);
    assert_eq!(read.communities[1].narrow.len(), 8);
}
