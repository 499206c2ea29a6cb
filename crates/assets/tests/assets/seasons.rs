//! A library through the year: leaves come, turn and fall, and everything else stays as it is.

use nemoral_assets::{
    AssetParams, ClimberParams, Library, PlantKind, Season, SnowParams, Species, StandSpecies,
    StemMoss,
};
use nemoral_scene::{Material, MaterialId, PlantCommunity, Prototype, Semantic};
use nemoral_seed::Key;

/// A grown beech, oak, birch and spruce with two saplings each, at 50 degrees north; high summer
/// without a day.
fn library(day_of_year: Option<f64>) -> Library {
    let of = |species| StandSpecies {
        species,
        dbh_mean_m: 0.25,
        trees_per_ha: 300.0,
    };
    let params = AssetParams {
        species: vec![
            of(Species::beech()),
            of(Species::english_oak()),
            of(Species::silver_birch()),
            of(Species::norway_spruce()),
        ],
        individuals_per_species: 1,
        saplings_per_species: 2,
        seedlings_per_species: 2,
        communities: vec![PlantCommunity::Bilberry, PlantCommunity::Bracken],
        climbers: Some(ClimberParams {
            moss: StemMoss {
                amount: 0.5,
                height_m: 2.0,
            },
            lianas: true,
            resin: false,
        }),
        season: day_of_year.map(|day_of_year| Season {
            day_of_year,
            latitude_deg: 50.0,
        }),
        textures: false,
        ..AssetParams::default()
    };
    Library::grow(&params, Key::world(7)).expect("valid")
}

fn named<'a>(library: &'a Library, start: &'a str) -> impl Iterator<Item = &'a Material> {
    let all = library.materials.materials().iter();
    all.filter(move |m| m.name.starts_with(start) && m.mask.is_some())
}

fn opaque(m: &Material) -> f64 {
    m.mask.as_ref().map_or(1.0, |mask| mask.opaque_fraction())
}

/// The share of the opaque area of a shape's cards that is left of that in full leaf.
fn share_left(library: &Library, shape: &Prototype) -> f64 {
    let full = library.materials_in_full_leaf();
    let full = full.as_ref().unwrap_or(&library.materials);
    let area = |of: &dyn Fn(MaterialId) -> f64| -> f64 {
        let cards = shape.cards().iter();
        cards.map(|c| f64::from(c.area_m2()) * of(c.material)).sum()
    };
    area(&|m| opaque(library.materials.get(m))) / area(&|m| opaque(full.get(m)))
}

#[test]
fn in_high_summer_a_day_changes_nothing() {
    let (without, summer) = (library(None), library(Some(190.0)));
    assert!(without.materials_in_full_leaf().is_none());
    assert_eq!(without.to_bytes(), summer.to_bytes());
}

#[test]
fn shapes_are_the_same_all_year() {
    let (summer, winter) = (library(None), library(Some(20.0)));
    let trees = |of: &Library| [of.trees.clone(), of.saplings.clone()].concat();
    for (a, b) in trees(&summer).iter().zip(&trees(&winter)) {
        assert_eq!(a.size, b.size, "{}", a.species);
        assert_eq!(a.prototype.mesh().positions, b.prototype.mesh().positions);
        let places = |of: &Prototype| -> Vec<_> {
            of.cards()
                .iter()
                .map(|c| (c.corner, c.edge_u, c.edge_v))
                .collect()
        };
        assert_eq!(places(&a.prototype), places(&b.prototype), "{}", a.species);
    }
    // But for fronds, which lie down.
    let height = |of: &Library| -> f64 {
        let ferns = of.plants[PlantKind::Ferns].iter();
        ferns.map(|f| f.height_m).sum()
    };
    assert!(height(&winter) < 0.8 * height(&summer));
    let bracken = |of: &Library| of.communities[PlantCommunity::Bracken.index()].wide[0].height_m;
    assert!(bracken(&winter) < 0.7 * bracken(&summer));
}

#[test]
fn heather_and_gorse_flower_in_their_time() {
    let [winter, spring, autumn] = [20.0, 90.0, 240.0].map(|day| library(Some(day)));
    // The greatest share of a colour in the means of a plant's images.
    let most =
        |library: &Library, start: &str, share: fn(nemoral_scene::glam::Vec3) -> f32| -> f32 {
            let means = named(library, start).map(|m| share(m.albedo.mean()));
            means.fold(0.0, f32::max)
        };
    let pink = |library: &Library| most(library, "heather.foliage.", |c| c.z / c.y);
    assert!(pink(&autumn) > 1.1 * pink(&winter));
    let yellow = |library: &Library| most(library, "gorse.foliage.", |c| c.x / c.y);
    assert!(yellow(&spring) > 1.05 * yellow(&winter));
}

#[test]
fn trees_are_bare_in_winter_and_their_twigs_stay() {
    let winter = library(Some(20.0));
    for tree in &winter.trees {
        let left = share_left(&winter, &tree.prototype);
        let expected = if tree.species == "norway_spruce" {
            1.0..=1.0
        } else {
            0.02..=0.35
        };
        println!("{}: {left:.2} of the opaque area is left", tree.species);
        assert!(expected.contains(&left), "{}: {left}", tree.species);
    }
    for sapling in &winter.saplings {
        let left = share_left(&winter, &sapling.prototype);
        // The young keep dead leaves.
        if ["beech", "english_oak"].contains(&sapling.species.as_str()) {
            assert!(left > 0.5, "{}: {left}", sapling.species);
        }
    }
    let bare: Vec<_> = named(&winter, "beech.foliage.")
        .map(|m| m.semantic)
        .collect();
    assert!(bare.contains(&Semantic::Twig), "{bare:?}");
    assert!(named(&winter, "norway_spruce.foliage.").all(|m| m.semantic == Semantic::Needle));
}

#[test]
#[ignore = "half a minute: .ci/full runs it"]
fn what_has_fallen_on_one_day_stays_fallen() {
    let days: Vec<Library> = (0..5)
        .map(|i| library(Some(294.0 + 5.0 * f64::from(i))))
        .collect();
    let mut left = Vec::new();
    for pair in days.windows(2) {
        let (mut before, mut after) = (0, 0);
        for species in ["beech", "english_oak", "silver_birch"] {
            // Groups that are in different phases follow each other in both.
            let start = format!("{species}.foliage.");
            for (a, b) in named(&pair[0], &start).zip(named(&pair[1], &start)) {
                let (Some(a), Some(b)) = (&a.mask, &b.mask) else {
                    unreachable!("leaves have masks")
                };
                for (x, y) in (0..a.height()).flat_map(|y| (0..a.width()).map(move |x| (x, y))) {
                    assert!(a.texel(x, y) || !b.texel(x, y), "{start} at {x}, {y}");
                    before += u32::from(a.texel(x, y));
                    after += u32::from(b.texel(x, y));
                }
            }
        }
        left.push(f64::from(after) / f64::from(before));
    }
    assert!(
        left.iter().all(|share| (0.3..0.97).contains(share)),
        "{left:?}"
    );
}

#[test]
fn half_of_the_leaves_have_fallen_when_the_species_says_so() {
    // The middle group of the beech, in images 5 to 9: early trees come first.
    let beech = library(Some(305.0));
    let full = beech.materials_in_full_leaf().expect("an autumn");
    let images = beech.materials.materials().iter().zip(full.materials());
    let middle = images.filter(|(m, _)| m.name.starts_with("beech.foliage.b."));
    let (mut now, mut whole, mut count) = (0.0, 0.0, 0);
    for (m, full) in middle {
        now += opaque(m);
        whole += opaque(full);
        count += 1;
    }
    assert_eq!(count, 5);
    // Twigs stay, and withered leaves are narrower.
    assert!((0.4..0.65).contains(&(now / whole)), "{}", now / whole);
}

#[test]
fn a_library_of_autumn_is_read_back_to_the_bit() {
    let autumn = library(Some(300.0));
    let bytes = autumn.to_bytes();
    let read = Library::from_bytes(&bytes).expect("its own bytes");
    assert_eq!(read.to_bytes(), bytes);
    assert_eq!(read.full_leaf_masks.len(), autumn.full_leaf_masks.len());
    assert!(read.materials_in_full_leaf().is_some());
}

#[test]
fn leaves_of_autumn_are_yellow_and_leaves_of_spring_are_small() {
    let mean = |of: &Library, start: &str| {
        let all: Vec<_> = named(of, start).collect();
        let sum = all
            .iter()
            .map(|m| m.albedo.mean())
            .sum::<nemoral_scene::glam::Vec3>();
        let opaque = all.iter().map(|m| opaque(m)).sum::<f64>() / all.len() as f64;
        (sum / all.len() as f32, opaque)
    };
    let green = |(c, _): (nemoral_scene::glam::Vec3, f64)| c.y / (c.x + c.y + c.z);
    let (summer, autumn, spring) = (library(None), library(Some(300.0)), library(Some(120.0)));
    for species in ["beech.foliage.", "silver_birch.foliage."] {
        assert!(green(mean(&summer, species)) > 0.5, "{species}");
        assert!(green(mean(&autumn, species)) < 0.43, "{species}");
    }
    let (_, spring) = mean(&spring, "beech.foliage.");
    let (_, summer) = mean(&summer, "beech.foliage.");
    assert!(
        (0.15..0.75).contains(&(spring / summer)),
        "{}",
        spring / summer
    );
    let bilberry = |of: &Library| mean(of, "bilberry.foliage");
    assert!(bilberry(&library(Some(20.0))).1 < 0.6 * bilberry(&library(None)).1);
}

#[test]
fn days_and_latitudes_that_there_are_not_are_refused() {
    for (day_of_year, latitude_deg, field) in [
        (0.0, 50.0, "season.day_of_year"),
        (367.0, 50.0, "season.day_of_year"),
        (f64::NAN, 50.0, "season.day_of_year"),
        (100.0, 80.0, "season.latitude_deg"),
    ] {
        let params = AssetParams {
            season: Some(Season {
                day_of_year,
                latitude_deg,
            }),
            ..AssetParams::default()
        };
        let refused = params.check().expect_err("refused").to_string();
        assert!(refused.contains(field), "{refused}");
    }
}

/// Snow covers what is on the ground from above, folds grass down and leaves trees alone.
#[test]
fn snow_covers_what_lies() {
    let mut library = library(Some(20.0));
    let before = library.clone();
    let params = SnowParams {
        depth_m: 0.2,
        on_crowns: 0.0,
        beds: &[],
        textures: false,
    };
    let snow = library.add_snow(&params, Key::world(7));
    let of = |id: MaterialId| library.materials.get(id);
    for &floor in &before.ground.floor {
        let cover = of(snow.over(floor));
        assert_eq!((cover.semantic, cover.ground), (Semantic::Snow, true));
        assert_eq!(cover.support, Some(of(floor).semantic));
        // The brightest thing at 905 nm, the darkest at 1550 nm.
        let [near, far] = [cover.optics.nm905, cover.optics.nm1550].map(|band| band.reflectance);
        assert!(near > 0.75 && far < 0.1 && cover.albedo.mean().min_element() > 0.8);
    }
    let trail = before.ground.trails[0].rut;
    let cover = of(snow.over(trail));
    assert_eq!(cover.semantic, of(trail).semantic, "a trail stays one");
    let (mut covered, mut bare) = (0, 0);
    for rock in &library.plants[PlantKind::Rock] {
        let mesh = rock.prototype.mesh();
        for t in &mesh.triangles {
            let [a, b, c] = t.corners.map(|i| mesh.positions[i as usize]);
            let rises = (b - a).cross(c - a).normalize_or_zero().z > 0.57;
            let m = of(t.material);
            assert_eq!(m.semantic, Semantic::Rock);
            assert_eq!(m.name.ends_with(".snow"), rises, "{}", m.name);
            *(if rises { &mut covered } else { &mut bare }) += 1;
        }
    }
    assert!(covered > 500 && bare > 500, "{covered} {bare}");
    let [high, low] = [&before, &library].map(|of| &of.plants[PlantKind::Grass]);
    for (a, b) in high.iter().zip(low) {
        assert!((b.height_m / a.height_m - 0.35).abs() < 1e-3);
        let top = f64::from(b.prototype.bounds().max.z);
        assert!((top - b.height_m).abs() < 1e-3);
    }
    for (a, b) in before.trees.iter().zip(&library.trees) {
        assert!(std::sync::Arc::ptr_eq(&a.prototype, &b.prototype));
    }
}

/// Snow on crowns is a second card over a share of the shoots with needles, a little above them.
#[test]
fn crowns_hold_snow() {
    let mut library = library(Some(20.0));
    let before = library.clone();
    let params = SnowParams {
        depth_m: 0.2,
        on_crowns: 0.5,
        beds: &[],
        textures: false,
    };
    library.add_snow(&params, Key::world(7));
    for (a, b) in before.trees.iter().zip(&library.trees) {
        let (old, new) = (a.prototype.cards(), b.prototype.cards());
        assert_eq!(old, &new[..old.len()], "{}", a.species);
        let covers = &new[old.len()..];
        let share = covers.len() as f64 / old.len() as f64;
        println!("{}: {share:.2} of the shoots hold snow", a.species);
        if a.species == "norway_spruce" {
            assert!((0.3..0.51).contains(&share), "{share}");
        } else {
            assert_eq!(covers.len(), 0, "leaves have fallen");
        }
        let middle = |c: &nemoral_scene::Card| c.corner + 0.5 * (c.edge_u + c.edge_v);
        for cover in covers.iter().step_by(50) {
            let m = library.materials.get(cover.material);
            assert!(m.name.ends_with(".snow") && m.mask.is_some());
            assert_eq!(m.semantic, Semantic::Needle);
            let lies = old.iter().any(|card| {
                let up = middle(cover) - middle(card);
                up.truncate().length() < 1e-3 && (0.009..0.023).contains(&up.z)
            });
            assert!(lies, "a cover lies on a shoot");
        }
        let snowy =
            |t: &nemoral_scene::Triangle| library.materials.get(t.material).name.ends_with(".snow");
        let on_wood = b
            .prototype
            .mesh()
            .triangles
            .iter()
            .filter(|t| snowy(t))
            .count();
        assert!(on_wood > 50, "{}: branches hold snow", a.species);
    }
}
