//! Every species can be recognised: by a few simple features of its shape and its textures, an
//! individual is nearest to the mean of its own species among all nine. That holds for its form
//! alone, and for its leaves and bark alone, too.

use super::*;
use crate::common::{key, materials};
use nemoral_assets::{GrowthParams, SizeClass, TreeSize, grow};
use nemoral_scene::glam::DVec2;
use nemoral_seed::{Domain, Draw, Key};

const INDIVIDUALS: u64 = 12;
const OF_FORM: usize = 5;
const ALL: usize = 9;

/// The spread that light and individual variation add to colours and leaf sizes: a tenth, in
/// logarithms.
const SPREAD: f64 = 0.1;

fn at_rank(sorted: &[f64], rank: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * rank) as usize]
}

/// Features of the shape: height and length of the crown relative to its width, its taper, the
/// inclination of its leaves, and the slenderness of the tree.
fn form(species: &Species, i: u64) -> [f64; OF_FORM] {
    let params = GrowthParams {
        wood_triangles_max: 3_000,
        cards_max: 400,
        ..GrowthParams::default()
    };
    // Diameters from the middle half of the middle class.
    let [young_m, mature_m] = [SizeClass::Young, SizeClass::Mature].map(|c| species.class_dbh_m(c));
    let rank = 0.35 + 0.3 * (i as f64 + 0.5) / INDIVIDUALS as f64;
    let size: TreeSize = species.draw_size(young_m + rank * (mature_m - young_m), key(i));
    let tree = grow(species, &size, &materials(), &params, key(i)).expect("grows");
    let places: Vec<_> = (tree.cards.iter())
        .map(|c| (c.corner + 0.5 * (c.edge_u + c.edge_v)).as_dvec3())
        .collect();
    let axis = places.iter().map(|p| p.truncate()).sum::<DVec2>() / places.len() as f64;
    let sorted = |values: &mut dyn Iterator<Item = f64>| {
        let mut values: Vec<f64> = values.collect();
        values.sort_by(f64::total_cmp);
        values
    };
    let heights = sorted(&mut places.iter().map(|p| p.z));
    let [low, middle, high] = [0.03, 0.5, 0.97].map(|rank| at_rank(&heights, rank));
    let radius = |from: f64, to: f64| {
        let here = places.iter().filter(|p| (from..to).contains(&p.z));
        let away = sorted(&mut here.map(|p| p.truncate().distance(axis)));
        at_rank(&away, 0.9)
    };
    let (mut inclination, mut area) = (0.0, 0.0);
    for card in &tree.cards {
        let normal = card.edge_u.cross(card.edge_v).as_dvec3();
        let of_card = normal.length();
        inclination += of_card * (normal.z.abs() / of_card).min(1.0).acos();
        area += of_card;
    }
    [
        low / high,
        ((high - low) / radius(low, high)).ln(),
        (radius(middle, high) / radius(low, middle)).ln(),
        inclination / area,
        (tree.size.height_m / tree.size.dbh_m).ln(),
    ]
}

/// The mean width of opaque runs along the rows of a picture, metres: that of a leaf, or of a
/// needle.
fn grain_m(m: &Material, width_m: f64) -> f64 {
    let mask = m.mask.as_ref().expect("leaves are cut out");
    let (mut opaque, mut runs) = (0, 0);
    for row in 0..mask.height() {
        let mut before = false;
        for column in 0..mask.width() {
            let here = mask.texel(column, row);
            opaque += u32::from(here);
            runs += u32::from(here && !before);
            before = here;
        }
    }
    width_m / mask.width() as f64 * f64::from(opaque) / f64::from(runs)
}

/// Features of the pictures, in logarithms: the width and the brightness of leaves, the brightness
/// and the redness of bark.
fn look(species: &str) -> [f64; ALL - OF_FORM] {
    let tree = LIBRARY.trees.iter().find(|t| t.species == species);
    let card = &tree.expect("one of each").prototype.cards()[0];
    let leaves = LIBRARY.materials.get(card.material);
    let bark = named(&format!("{species}.stem.upper")).albedo.mean();
    [
        grain_m(leaves, f64::from(card.edge_u.length())).ln(),
        f64::from(luminance(leaves.albedo.mean())).ln(),
        f64::from(luminance(bark)).ln(),
        f64::from(bark.x / bark.z).ln(),
    ]
}

/// The share of individuals that are nearest to the mean of their own species (computed without
/// them) by some of the features, each divided by its spread within species; and which were
/// mistaken for what.
fn recognised(
    individuals: &[Vec<[f64; ALL]>],
    features: std::ops::Range<usize>,
) -> (f64, Vec<String>) {
    let n = INDIVIDUALS as f64;
    let mean = |of: &[[f64; ALL]], k: usize| of.iter().map(|f| f[k]).sum::<f64>() / of.len() as f64;
    let spread: Vec<f64> = (0..ALL)
        .map(|k| {
            let squares = individuals.iter().flat_map(|of| {
                let mean = mean(of, k);
                of.iter().map(move |f| (f[k] - mean).powi(2))
            });
            (squares.sum::<f64>() / (n * individuals.len() as f64)).sqrt()
        })
        .collect();
    let names: Vec<&str> = Species::names().collect();
    let mut mistaken = Vec::new();
    for (own, of) in individuals.iter().enumerate() {
        for one in of {
            let distance = |other: usize| -> f64 {
                features
                    .clone()
                    .map(|k| {
                        let mut mean = mean(&individuals[other], k);
                        if other == own {
                            mean = (n * mean - one[k]) / (n - 1.0);
                        }
                        ((one[k] - mean) / spread[k]).powi(2)
                    })
                    .sum()
            };
            let nearest = (0..names.len())
                .min_by(|a, b| distance(*a).total_cmp(&distance(*b)))
                .expect("nine");
            if nearest != own {
                mistaken.push(format!("{} for {}", names[own], names[nearest]));
            }
        }
    }
    (
        1.0 - mistaken.len() as f64 / (n * names.len() as f64),
        mistaken,
    )
}

#[test]
fn a_glance_tells_the_species() {
    let individuals: Vec<Vec<[f64; ALL]>> = Species::all()
        .iter()
        .map(|species| {
            let look = look(&species.name);
            let of = Key::world(9).domain(Domain::new(&species.name));
            (0..INDIVIDUALS)
                .map(|i| {
                    let mut rng = of.item(i).rng();
                    let form = form(species, i);
                    std::array::from_fn(|k| match k.checked_sub(OF_FORM) {
                        None => form[k],
                        Some(k) => look[k] + SPREAD * rng.range_f64(-1.7, 1.7),
                    })
                })
                .collect()
        })
        .collect();
    let features = [
        ("all", 0..ALL),
        ("form", 0..OF_FORM),
        ("look", OF_FORM..ALL),
    ];
    for (name, features) in features {
        let (share, mistaken) = recognised(&individuals, features);
        println!("{name}: {share:.3} {mistaken:?}");
        assert!(share >= 0.95, "by {name} {share:.3}: {mistaken:?}");
    }
}
