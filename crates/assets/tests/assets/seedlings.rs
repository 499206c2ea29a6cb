//! Tree seedlings, tested through the public interface: their heights, what is near the ground, and
//! their materials.

use std::sync::LazyLock;

use nemoral_assets::{
    AssetParams, LeafKind, Library, PlantAsset, PlantKind, Species, StandSpecies,
};
use nemoral_scene::glam::{Vec2, Vec3};
use nemoral_scene::{Card, Material, Semantic};
use nemoral_seed::Key;

const KEY: Key = Key::world(7);
const EACH: u32 = 6;

/// Placed seedlings are up to a tenth smaller or larger than grown.
const SCALE: [f32; 2] = [0.9, 1.1];

fn grow(species: Vec<Species>, seedlings_per_species: u32) -> Library {
    let of = |species| StandSpecies {
        species,
        dbh_mean_m: 0.2,
        trees_per_ha: 300.0,
    };
    let params = AssetParams {
        species: species.into_iter().map(of).collect(),
        individuals_per_species: 1,
        seedlings_per_species,
        textures: false,
        ..AssetParams::default()
    };
    Library::grow(&params, KEY).expect("valid")
}

static ALL: LazyLock<Library> = LazyLock::new(|| grow(Species::all(), EACH));

/// Each species with its seedlings.
fn by_species() -> impl Iterator<Item = (Species, &'static [PlantAsset])> {
    let seedlings = ALL.plants[PlantKind::Seedling].chunks_exact(EACH as usize);
    assert_eq!(seedlings.len(), Species::all().len());
    Species::all().into_iter().zip(seedlings)
}

fn has_needles(species: &Species) -> bool {
    matches!(
        species.leaves.kind,
        LeafKind::NeedleTuft | LeafKind::NeedleSpray
    )
}

fn materials(plant: &PlantAsset) -> impl Iterator<Item = &'static Material> {
    let shape = &plant.prototype;
    let wood = shape.mesh().triangles.iter().map(|t| t.material);
    let leaves = shape.cards().iter().map(|c| c.material);
    let all: Vec<_> = wood.chain(leaves).collect();
    all.into_iter().map(|m| ALL.materials.get(m))
}

fn lowest_m(card: &Card) -> f32 {
    card.corners().map(|c| c.z).into_iter().fold(1.0, f32::min)
}

fn level(card: &Card) -> f32 {
    let normal = card.edge_u.cross(card.edge_v);
    normal.normalize_or(Vec3::X).z.abs()
}

#[test]
fn they_stand_in_the_ground_and_are_under_30_cm_high() {
    for (species, seedlings) in by_species() {
        let heights: Vec<f64> = seedlings.iter().map(|s| s.height_m).collect();
        for s in seedlings {
            assert_eq!(s.name, format!("{}_seedling", species.name));
            let top_m = s.height_m as f32;
            let placed = SCALE.map(|scale| scale * top_m);
            assert!(placed[0] > 0.05 && placed[1] < 0.3, "{}: {top_m}", s.name);
            assert!(s.prototype.bounds().min.z < -0.02, "{} floats", s.name);
            // A seedling is slender, and its crown is around its stem.
            assert!((0.02..0.2).contains(&s.radius_m), "{}", s.radius_m);
        }
        // There are all sizes, small ones first.
        assert!(heights.is_sorted_by(|a, b| a < &(b + 0.02)), "{heights:?}");
        assert!(heights[EACH as usize - 1] > 2.0 * heights[0], "{heights:?}");
    }
}

/// A blade that is nearer to the ground than the LiDAR can resolve would be ground to one sensor
/// and seedling to the other.
#[test]
fn leaves_keep_clear_of_the_ground() {
    for s in &ALL.plants[PlantKind::Seedling] {
        let lowest = s.prototype.cards().iter().map(lowest_m).fold(1.0, f32::min);
        assert!(SCALE[0] * lowest >= 0.04, "{}: {lowest}", s.name);
    }
}

#[test]
fn leaves_spring_from_the_stem() {
    for s in &ALL.plants[PlantKind::Seedling] {
        // A stem is rings of four corners, the first one twice, and its two ends.
        let rings = s.prototype.mesh().positions.chunks_exact(5);
        let line: Vec<Vec3> = rings.map(|r| (r[0] + r[1] + r[2] + r[3]) / 4.0).collect();
        for card in s.prototype.cards() {
            let foot = card.corner + 0.5 * card.edge_u;
            let pieces = line.windows(2).map(|w| {
                let t = (foot - w[0]).dot(w[1] - w[0]) / w[0].distance_squared(w[1]);
                w[0].lerp(w[1], t.clamp(0.0, 1.0)).distance(foot)
            });
            let off_m = pieces.fold(f32::INFINITY, f32::min);
            assert!(off_m < 0.006, "{}: {off_m} m off", s.name);
        }
    }
}

#[test]
fn they_are_made_of_their_species_under_their_own_semantic() {
    for (species, seedlings) in by_species() {
        let own = |m: &Material| m.name.starts_with(&format!("{}.seedling", species.name));
        let leaf = &species.leaves;
        for m in seedlings.iter().flat_map(materials) {
            assert!(own(m), "{} in {}", m.name, species.name);
            assert_eq!(m.semantic, Semantic::Seedling, "{}", m.name);
            if m.mask.is_some() {
                // Single leaves and short shoots have the optical properties of leaves, not those
                // of whole shoots.
                let bands = [m.optics.nm905, m.optics.nm1550];
                let [near, far] = bands.map(|b| [b.reflectance, b.transmittance]);
                assert_eq!(
                    [near, far],
                    [leaf.nm905, leaf.nm1550].map(|b| b.map(|x| x as f32))
                );
                // Leaves shade each other, for what comes through as for what comes back.
                for (got, own) in m
                    .transmittance
                    .to_array()
                    .into_iter()
                    .zip(leaf.transmittance)
                {
                    assert!(
                        (f64::from(got) - 0.92 * own).abs() < 1e-6,
                        "{}: {got}",
                        m.name
                    );
                }
                // Leaves of an image face different ways, as needles of a shoot do by themselves.
                let rough = leaf.roughness as f32;
                let want = match leaf.kind {
                    LeafKind::NeedleTuft | LeafKind::NeedleSpray => rough,
                    _ => (rough.powi(4) + 2.0 * 0.37 * 0.37).powf(0.25),
                };
                assert!((m.roughness - want).abs() < 1e-5, "{}: {want}", m.roughness);
                let (young, old) = (light(m), leaf.reflectance().dot(LUMINANCE));
                assert!(
                    (young / old - 1.0).abs() < 0.15,
                    "{}: {young} {old}",
                    m.name
                );
            }
        }
    }
}

const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

/// The mean luminance of the opaque texels.
fn light(m: &Material) -> f32 {
    let mask = m.mask.as_ref().expect("a mask");
    let (mut sum, mut count) = (0.0, 0.0);
    for row in 0..mask.height() {
        for column in (0..mask.width()).filter(|c| mask.texel(*c, row)) {
            let size = Vec2::new(mask.width() as f32, mask.height() as f32);
            let uv = (Vec2::new(column as f32, row as f32) + 0.5) / size;
            sum += m.albedo.sample(uv, 0.0).dot(LUMINANCE);
            count += 1.0;
        }
    }
    sum / count
}

#[test]
fn no_two_look_alike_and_their_leaves_stand_as_they_should() {
    for (species, seedlings) in by_species() {
        for (i, s) in seedlings.iter().enumerate() {
            let cards = s.prototype.cards();
            let alike = |o: &PlantAsset| o.prototype.cards() == cards;
            assert!(!seedlings[..i].iter().any(alike), "{} {i}", s.name);
            let upright = cards.iter().filter(|c| level(c) < 0.3).count();
            if has_needles(&species) {
                // There are a leader of two pictures, and whorls.
                assert_eq!(upright.min(2), 2, "{} has no leader", s.name);
                assert!((5..=12).contains(&cards.len()), "{}", cards.len());
            } else {
                assert_eq!(upright, 0, "{} has hanging leaves", s.name);
                assert!((3..=10).contains(&cards.len()), "{}", cards.len());
                let flat = cards.iter().map(level).sum::<f32>() / cards.len() as f32;
                assert!(flat > 0.9, "{}: {flat}", s.name);
            }
            assert!(s.prototype.mesh().triangles.len() < 60);
        }
    }
}

#[test]
fn they_disturb_nothing_else_and_do_not_know_other_species() {
    let oak = || vec![Species::english_oak(), Species::beech()];
    let (without, with) = (grow(oak(), 0), grow(oak(), EACH));
    assert!(without.plants[PlantKind::Seedling].is_empty());
    let named = |l: &Library| -> Vec<String> {
        l.materials
            .materials()
            .iter()
            .map(|m| m.name.clone())
            .collect()
    };
    let (before, after) = (named(&without), named(&with));
    assert_eq!(after[..before.len()], before);
    assert!(
        after[before.len()..]
            .iter()
            .all(|m| m.contains(".seedling."))
    );
    let [herbs, same] = [&without, &with].map(|l| &l.plants[PlantKind::Herbs]);
    for (a, b) in herbs.iter().zip(same) {
        assert!(a.prototype.cards() == b.prototype.cards());
    }
    // Beeches come last here, and elsewhere if all species are grown.
    let beeches = |l: &Library| -> Vec<_> {
        let all = l.plants[PlantKind::Seedling].iter();
        let all = all.filter(|s| s.name == "beech_seedling");
        all.map(|s| s.prototype.mesh().positions.clone()).collect()
    };
    assert_eq!(beeches(&with).len(), EACH as usize);
    assert_eq!(beeches(&with), beeches(&ALL));
}

#[test]
fn value_stability() {
    let mut hash = 0xCBF2_9CE4_8422_2325_u64;
    for s in &ALL.plants[PlantKind::Seedling] {
        let wood = s.prototype.mesh().positions.iter().copied();
        let leaves = s.prototype.cards().iter();
        let leaves = leaves.flat_map(|c| [c.corner, c.edge_u, c.edge_v]);
        for p in wood.chain(leaves).flat_map(|p| p.to_array()) {
            hash = (hash ^ u64::from(p.to_bits())).wrapping_mul(0x0100_0000_01B3);
        }
    }
    assert_eq!(format!("{hash:x}"), "d991f959a9648bc5");
}
