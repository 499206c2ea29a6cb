//! The sizes of the trees of a stem map, and the shapes that are grown for them.

use nemoral_assets::{Competitors, MeasuredTree, Species, StemProfile, TreeSize};
use nemoral_import::Stem;
use nemoral_scene::glam::DVec2;
use nemoral_seed::{Domain, Draw, Key};
use nemoral_stand::{area_around_m2, convex_hull};

use crate::Assets;
use crate::quotations::cut;

const PLOT: Domain = Domain::new("pipeline.plot");

/// The size of a copy relative to its shape, across and along, is within these.
const STRETCH: [f64; 2] = [0.35, 2.8];

/// Of the height that a dead tree had, so much is left on average ([`nemoral_assets::grow_snag`]).
const BROKEN: f64 = 0.65;

/// What a stem map says that a tree is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Named {
    /// The index of a species.
    Species(usize),
    /// The index of a user's model among those of trees.
    Model(usize),
}

/// A tree of a stem map that is a copy of a user's model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelStem {
    /// Its place in the map.
    pub number: usize,
    /// Its line in the file.
    line: u64,
    /// The index of the model among those of trees.
    pub model: usize,
    dbh_m: Option<f64>,
    height_m: Option<f64>,
}

impl ModelStem {
    /// How much wider and how much higher the copy is than its model, which has a name, a stem and
    /// a height. What the map does not say follows from what it says.
    ///
    /// # Errors
    /// If the copy would be stretched too far; the message names the line of the map.
    pub fn stretch(
        &self,
        name: &str,
        stem: &StemProfile,
        height_m: f64,
    ) -> Result<[f64; 2], String> {
        let [low, high] = STRETCH;
        let check = |what: &str, told: f64, [least, most]: [f64; 2]| {
            let is_within = (least..=most).contains(&told);
            is_within.then_some(told).ok_or_else(|| {
                format!(
                    "line {}: {what} = {told}: must be from {least:.2} to {most:.2} for a copy of \
                     models.{name}",
                    self.line
                )
            })
        };
        let along = match self.height_m {
            Some(told) => {
                Some(check("height_m", told, [low * height_m, high * height_m])? / height_m)
            }
            None => None,
        };
        let Some(dbh_m) = self.dbh_m else {
            return Ok([along.unwrap_or(1.0); 2]);
        };
        // At breast height of the copy, that of a model of the copy's height and its own width.
        let own_m = |along: f64| stem.dbh_m(along);
        if let Some(along) = along {
            let own_m = own_m(along);
            check("dbh_m", dbh_m, [low * own_m, high * own_m])?;
            return Ok([dbh_m / own_m, along]);
        }
        // The larger the copy, the thicker it is there.
        check("dbh_m", dbh_m, [low * own_m(low), high * own_m(high)])?;
        let mut between = STRETCH;
        for _ in 0..60 {
            let middle = 0.5 * (between[0] + between[1]);
            let is_too_thick = middle * own_m(middle) > dbh_m;
            between[usize::from(is_too_thick)] = middle;
        }
        Ok([between[0]; 2])
    }
}

/// A tree of a stem map with everything that was drawn for it.
#[derive(Clone, Copy, Debug)]
pub struct MeasuredStem {
    /// Its place in the map.
    pub number: usize,
    /// The index of its species.
    pub species: usize,
    /// Whether it is alive.
    pub alive: bool,
    /// Its diameter at breast height, metres.
    pub dbh_m: f64,
    /// Its height, metres.
    pub height_m: f64,
    /// The size in which a tree of its own would be grown.
    growth: TreeSize,
    /// The index of its shape.
    pub shape: usize,
}

/// The trees of a stem map, and the shapes that stand for them.
#[derive(Clone, Debug, Default)]
pub struct MeasuredStems {
    /// Those that are grown, in the file's order.
    pub stems: Vec<MeasuredStem>,
    /// Those that are copies of models, in the file's order.
    pub models: Vec<ModelStem>,
    /// What the file calls each; empty where it does not say.
    pub ids: Vec<String>,
    /// Of each species, living ones first.
    pub shapes: Vec<MeasuredTree>,
}

/// What each stem is: of a species, or else a copy of one of the `models` of trees; `None` for one
/// whose species is drawn.
pub(super) fn species_of(
    stems: &[Stem],
    known: &[Species],
    models: &[String],
    other: &str,
) -> Result<Vec<Option<Named>>, String> {
    let find = |name: &str| {
        let species = known.iter().position(|species| species.is_named(name));
        species.map(Named::Species)
    };
    let copied = |name: &str| models.iter().position(|m| m == name).map(Named::Model);
    let names = || {
        let names = known.iter().map(|s| &s.name).chain(models);
        let names: Vec<&str> = names.map(String::as_str).collect();
        names.join(", ")
    };
    let other = match other {
        "" => None,
        name => Some(find(name).ok_or_else(|| {
            format!(
                "site.stems.other_species = \"{}\": must be one of {}",
                cut(name),
                names()
            )
        })?),
    };
    let of_stem =
        |stem: &Stem| {
            match &stem.species {
        None => Ok(None),
        Some(name) => find(name).or_else(|| copied(name)).or(other).map(Some).ok_or_else(|| {
            let name: String = name.chars().take(40).collect();
            format!(
                "line {}: species = {name:?}: must be one of {}, or their scientific names; \
                 site.stems.other_species stands for others",
                stem.line,
                names()
            )
        }),
    }
        };
    stems.iter().map(of_stem).collect()
}

/// Draws what a stem map does not say, and chooses the shapes that are grown. `of_stem` are the
/// species of [`species_of`] as indices into `species`, with their shares.
pub(super) fn measure(
    (stems, of_stem): (&[Stem], &[Option<Named>]),
    species: &[(Species, f64)],
    stand: &Assets,
    (margin_m, shapes): (f64, u32),
    key: Key,
) -> Result<MeasuredStems, String> {
    let key = key.domain(PLOT);
    let shares: Vec<f64> = species.iter().map(|(_, share)| *share).collect();
    let id = |stem: &Stem| stem.id.clone().unwrap_or_default();
    let mut all = MeasuredStems {
        ids: stems.iter().map(id).collect(),
        ..MeasuredStems::default()
    };
    let mut drawn = Vec::new();
    // Copies of models compete as the stand's first species does.
    let mut copies = Vec::new();
    for (i, (stem, known)) in stems.iter().zip(of_stem).enumerate() {
        let key = key.item(i as u64);
        let index = match *known {
            Some(Named::Species(index)) => index,
            Some(Named::Model(model)) => {
                copies.push((i, 0, stem.dbh_m.unwrap_or(stand.dbh_mean_m)));
                all.models.push(ModelStem {
                    number: i,
                    line: stem.line,
                    model,
                    dbh_m: stem.dbh_m,
                    height_m: stem.height_m,
                });
                continue;
            }
            None => key.rng().weighted(&shares).unwrap_or(0),
        };
        drawn.push((i, index, dbh_m(stem, &species[index].0, stand, key)));
    }
    let standing = [&drawn[..], &copies[..]].concat();
    let competitors = competitors(stems, &standing, species, margin_m);
    for (i, index, dbh_m) in drawn {
        let stem = &stems[i];
        let sized = size(
            (stem, dbh_m),
            &species[index].0,
            &competitors,
            key.item(i as u64),
        );
        let (height_m, growth) = sized.map_err(|e| format!("line {}: {e}", stem.line))?;
        all.stems.push(MeasuredStem {
            number: i,
            species: index,
            alive: stem.is_alive,
            dbh_m,
            height_m,
            growth,
            shape: 0,
        });
    }
    for index in 0..species.len() {
        for alive in [true, false] {
            let members: Vec<usize> = (0..all.stems.len())
                .filter(|&i| all.stems[i].species == index && all.stems[i].alive == alive)
                .collect();
            all.choose(&members, shapes as usize);
        }
    }
    Ok(all)
}

/// The living trees of these numbers, species and diameters as each other's competitors, on the
/// ground within the margin of them all.
fn competitors(
    stems: &[Stem],
    drawn: &[(usize, usize, f64)],
    species: &[(Species, f64)],
    margin_m: f64,
) -> Competitors {
    /// A single tree's place.
    const LEAST_M2: f64 = 100.0;
    let feet = stems.iter().map(|stem| DVec2::new(stem.x_m, stem.y_m));
    let m2 = area_around_m2(&convex_hull(feet.collect()), margin_m).max(LEAST_M2);
    let alive = drawn.iter().filter(|&&(i, ..)| stems[i].is_alive);
    let of = |&(_, index, dbh_m): &(usize, usize, f64)| {
        let (species, _) = species.get(index)?;
        Some((species, dbh_m, 10_000.0 / m2))
    };
    Competitors::new(alive.filter_map(of))
}

/// The diameter of a stem, measured or drawn.
fn dbh_m(stem: &Stem, species: &Species, stand: &Assets, key: Key) -> f64 {
    let least = species.allometry.dbh_range_m[0];
    match (stem.dbh_m, stem.height_m) {
        (Some(dbh_m), _) => dbh_m,
        // Young trees of a species have a slenderness of about 100 above breast height.
        (None, Some(h)) if h < species.mean_height_m(least) => {
            least.min(0.010 * (h - 1.3).max(0.5))
        }
        (None, Some(height_m)) => species.mean_dbh_m(height_m),
        (None, None) => {
            let limits = [stand.dbh_min_m, stand.dbh_max_m];
            species.draw_dbh(stand.dbh_mean_m, stand.dbh_shape, limits, key)
        }
    }
}

/// The height of a stem of this diameter, and the size in which it is grown.
fn size(
    (stem, dbh_m): (&Stem, f64),
    species: &Species,
    competitors: &Competitors,
    key: Key,
) -> Result<(f64, TreeSize), String> {
    let al = &species.allometry;
    let [least, most] = al.dbh_range_m;
    let (height_m, mut growth) = if dbh_m < least {
        let height_m = stem.height_m.unwrap_or(1.3 + 100.0 * dbh_m).max(2.0);
        (height_m, species.draw_sapling(height_m, key))
    } else {
        let mut growth = species.draw_size_among(dbh_m, &competitors.of(dbh_m), key);
        let height_m = stem.height_m.unwrap_or(growth.height_m);
        // The crown keeps its share of the height.
        let [slender, most_slender] = al.slenderness.map(|s| s * growth.dbh_m);
        let grown_m = height_m.clamp(slender, most_slender).clamp(1.6, 70.0);
        growth.crown_base_m *= grown_m / growth.height_m;
        growth.height_m = grown_m;
        (height_m, growth)
    };
    let [low, high] = STRETCH;
    let across = dbh_m / growth.dbh_m;
    if !(low..=high).contains(&across) {
        let (name, least, most) = (&species.name, low * least, high * most);
        return Err(format!(
            "dbh_m = {dbh_m}: must be from {least:.3} to {most:.2} for {name}"
        ));
    }
    let along = height_m / growth.height_m;
    if !(low..=high).contains(&along) {
        let (least, most) = (low * growth.height_m, high * growth.height_m);
        return Err(format!(
            "height_m = {height_m}: must be from {least:.1} to {most:.1} for a {} with \
             dbh_m = {dbh_m}",
            species.name
        ));
    }
    if !stem.is_alive {
        // It is grown as high as it was before it broke.
        let whole_m = (growth.height_m / BROKEN).min(70.0);
        growth.crown_base_m *= whole_m / growth.height_m;
        growth.height_m = whole_m;
    }
    Ok((height_m, growth))
}

impl MeasuredStems {
    /// Adds at most `count` shapes for these stems, and gives each stem the nearest: the first is
    /// that of the stem in the middle, and each further one that of the stem which is worst off
    /// (Gonzalez 1985, "Clustering to minimize the maximum intercluster distance").
    fn choose(&mut self, members: &[usize], count: usize) {
        let at = |stem: &MeasuredStem| [libm::log(stem.dbh_m), libm::log(stem.height_m)];
        let places: Vec<[f64; 2]> = members.iter().map(|&i| at(&self.stems[i])).collect();
        let distance = |a: [f64; 2], b: [f64; 2]| DVec2::from(a).distance(DVec2::from(b));
        let n = places.len().max(1) as f64;
        let mean = [0, 1].map(|k| places.iter().map(|p| p[k]).sum::<f64>() / n);
        // Distances to the nearest shape so far, or to the middle.
        let mut off: Vec<f64> = places.iter().map(|&p| distance(p, mean)).collect();
        let mut next = (0..members.len()).min_by(|&a, &b| off[a].total_cmp(&off[b]));
        off.fill(f64::INFINITY);
        for _ in 0..count {
            let Some(chosen) = next.filter(|&m| off[m] > 0.0) else {
                break;
            };
            let stem = self.stems[members[chosen]];
            let shape = self.shapes.len();
            self.shapes.push(MeasuredTree {
                species: stem.species,
                size: stem.growth,
                alive: stem.alive,
            });
            for (m, &i) in members.iter().enumerate() {
                let d = distance(places[m], places[chosen]);
                if d < off[m] {
                    off[m] = d;
                    self.stems[i].shape = shape;
                }
            }
            // Of equally far ones, the first.
            next = (0..members.len())
                .rev()
                .max_by(|&a, &b| off[a].total_cmp(&off[b]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Config;
    use nemoral_import::read_stem_map;

    fn measured(table: &str, shapes: u32) -> Result<MeasuredStems, String> {
        let stems = read_stem_map(table.as_bytes()).expect("a stem map");
        let known = [Species::beech(), Species::english_oak()];
        let of_stem = species_of(&stems, &known, &["old_oak".to_owned()], "")?;
        let shares = known.map(|species| (species, 0.5));
        let stand = Config::default().assets;
        measure(
            (&stems, &of_stem),
            &shares,
            &stand,
            (5.0, shapes),
            Key::world(7),
        )
    }

    #[test]
    fn what_is_missing_follows_the_relations() {
        let table = "x,y,species,dbh_cm,height_m,alive\n0,0,Fagus sylvatica,31,24.5,1\n\
                     1,0,beech,31,,1\n2,0,beech,,24.5,1\n3,0,BEECH,,,1\n4,0,,30,20,1\n\
                     5,0,beech,3,3.1,1\n6,0,English oak,,,1\n7,0,english-oak,35,9,0\n";
        let all = measured(table, 24).expect("a plot");
        let beech = Species::beech();
        let [exact, high, thick, both, drawn, sapling, oak, dead] = all.stems[..] else {
            panic!("{} stems", all.stems.len());
        };
        assert_eq!((exact.dbh_m, exact.height_m), (0.31, 24.5));
        let ratio = high.height_m / beech.mean_height_m(0.31);
        assert!(high.dbh_m == 0.31 && (ratio - 1.0).abs() < 0.3, "{ratio}");
        let mean_m = beech.mean_height_m(thick.dbh_m);
        assert!(
            thick.height_m == 24.5 && (mean_m - 24.5).abs() < 0.01,
            "{mean_m}"
        );
        assert!((0.1..0.6).contains(&both.dbh_m) && (5.0..40.0).contains(&both.height_m));
        assert!(drawn.species < 2 && drawn.dbh_m == 0.3);
        assert_eq!((sapling.dbh_m, sapling.height_m), (0.03, 3.1));
        assert_eq!((oak.species, dead.species, dead.alive), (1, 1, false));
        // Each has its own shape here, of its own kind.
        assert_eq!(all.shapes.len(), 8);
        for stem in &all.stems {
            let shape = &all.shapes[stem.shape];
            assert_eq!((shape.species, shape.alive), (stem.species, stem.alive));
        }
    }

    #[test]
    fn few_shapes_are_near_to_all_stems() {
        let mut table = "x,y,species,dbh_cm\n".to_owned();
        for i in 0..600 {
            table += &format!("{i},0,beech,{}\n", 10 + (i * 37) % 45);
        }
        let off = |shapes: u32| {
            let all = measured(&table, shapes).expect("a plot");
            assert_eq!(all.shapes.len(), shapes as usize);
            let of_stem = |stem: &MeasuredStem| {
                let size = &all.shapes[stem.shape].size;
                let ratio = |a: f64, b: f64| (a / b).max(b / a);
                ratio(size.dbh_m, stem.dbh_m).max(ratio(size.height_m, stem.height_m))
            };
            all.stems.iter().map(of_stem).fold(1.0, f64::max)
        };
        let (few, many) = (off(24), off(96));
        assert!(few < 1.17 && many < 1.07, "{few} {many}");
    }

    #[test]
    fn impossible_sizes_and_names_are_refused() {
        let refused = |row: &str| {
            let table = format!("x,y,species,dbh_cm,height_m\n0,0,beech,30,20\n1,0,{row}\n");
            measured(&table, 24).map(drop).expect_err(row)
        };
        let message = refused("beech,400,30");
        assert!(
            message.contains("line 3: dbh_m = 4: must be from"),
            "{message}"
        );
        let message = refused("beech,30,2.5");
        assert!(
            message.contains("line 3: height_m = 2.5: must be from"),
            "{message}"
        );
        let message = refused("beach,30,20");
        for part in [
            "line 3",
            "\"beach\"",
            "beech, english_oak, old_oak",
            "other_species",
        ] {
            assert!(message.contains(part), "{message}");
        }
    }

    #[test]
    fn models_are_stretched_to_what_is_known_of_their_copies() {
        let table = "x,y,species,dbh_cm,height_m\n0,0,old_oak,80,18\n1,0,beech,30,20\n\
                     2,0,old_oak,20,\n3,0,old_oak,,\n4,0,old_oak,300,\n";
        let all = measured(table, 24).expect("a plot");
        assert_eq!((all.stems.len(), all.stems[0].number), (1, 1));
        let numbers: Vec<usize> = all.models.iter().map(|m| m.number).collect();
        assert_eq!(numbers, [0, 2, 3, 4]);
        // 0.4 m thick up to 2 m, then thinner: 0.2 m at 7 m.
        let oak = StemProfile::new(vec![[0.1, 0.4], [2.0, 0.4]], 12.0);
        let stretch = |i: usize| all.models[i].stretch("old_oak", &oak, 12.0);
        assert_eq!(stretch(0), Ok([2.0, 1.5]));
        // At half of its size, 1.3 m are 2.6 m of the model, where it is thinner.
        let [across, along] = stretch(1).expect("possible");
        assert_eq!(across, along);
        assert!((across * oak.diameter_m(1.3 / along) - 0.2).abs() < 1e-9 && across > 0.5);
        assert_eq!(stretch(2), Ok([1.0, 1.0]));
        let message = stretch(3).expect_err("too thick");
        let expected = "line 6: dbh_m = 3: must be from 0.12 to 1.12 for a copy of models.old_oak";
        assert_eq!(message, expected);
    }

    #[test]
    fn a_long_name_is_cut() {
        let name = "beech and ".repeat(1000);
        let stems = read_stem_map(b"x,y\n0,0\n").expect("a stem map");
        let error = species_of(&stems, &[Species::beech()], &[], &name).expect_err("no species");
        assert!(error.len() < 300 && error.contains('…'), "{error}");
    }

    #[test]
    fn value_stability() {
        let all = measured("x,y\n0,0\n1,0\n", 2).expect("a plot");
        let [a, b] = all.stems[..] else {
            panic!("two stems");
        };
        let values = [a.dbh_m, a.height_m, b.dbh_m, b.height_m];
        let known = [
            0.297_494_102_837_994_66,
            17.892_557_394_200_39,
            0.272_346_398_710_540_5,
            20.711_907_083_223_33,
        ];
        assert_eq!((a.species, b.species, values), (1, 0, known));
    }
}
