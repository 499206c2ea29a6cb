//! What a species sheds: numbers for the litter that lies under it.

use serde::Deserialize;

use super::ranges::Ranges;
use nemoral_scene::ParamError;

/// Dead leaves, fruits and bark on the ground.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LitterLook {
    /// Mean linear RGB reflectance of a dead leaf or needle, 0.01..=0.7.
    pub albedo: [f64; 3],
    /// Leaves that stand out on a square metre of middling litter, 1..=200; of conifers, mats of
    /// needles.
    pub leaves_per_m2: f64,
    /// Cones, nuts or capsules.
    pub fruit: Option<FruitLook>,
    /// Pieces of bark.
    pub bark: Option<LitterBark>,
}

/// A cone, nut or capsule: an egg of whorled scales, or smooth.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FruitLook {
    /// Length, least and most, metres, 0.005..=0.4.
    pub length_m: [f64; 2],
    /// Its width over its length, least and most, 0.05..=1.5.
    pub width_ratio: [f64; 2],
    /// How far its scales stand off, as a share of its radius, 0..=0.5: 0 for a nut.
    pub scales: f64,
    /// How many lie on a square metre, 0..=20.
    pub per_m2: f64,
}

/// Strips or flakes of bark.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LitterBark {
    /// Length, least and most, metres, 0.01..=1.4; short ones are more frequent.
    pub length_m: [f64; 2],
    /// Width, least and most, metres, 0.005..=0.2.
    pub width_m: [f64; 2],
    /// How many lie on a square metre, 0..=20.
    pub per_m2: f64,
}

impl LitterLook {
    pub(super) fn check(&self, species: &str) -> Result<(), ParamError> {
        let name = format!("{species}.shed");
        let r = Ranges(&name);
        r.each("albedo", &self.albedo, 0.01, 0.7)?;
        r.one("leaves_per_m2", self.leaves_per_m2, 1.0, 200.0)?;
        if let Some(fruit) = &self.fruit {
            r.pair("fruit.length_m", fruit.length_m, 0.005, 0.4)?;
            r.pair("fruit.width_ratio", fruit.width_ratio, 0.05, 1.5)?;
            r.one("fruit.scales", fruit.scales, 0.0, 0.5)?;
            r.one("fruit.per_m2", fruit.per_m2, 0.0, 20.0)?;
        }
        if let Some(bark) = &self.bark {
            r.pair("bark.length_m", bark.length_m, 0.01, 1.4)?;
            r.pair("bark.width_m", bark.width_m, 0.005, 0.2)?;
            r.one("bark.per_m2", bark.per_m2, 0.0, 20.0)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use crate::Species;
    use proptest::prelude::*;

    /// Every number of the tables, as a path and its least and greatest value.
    const NUMBERS: [(&str, f64, f64); 15] = [
        ("albedo", 0.01, 0.7),
        ("albedo", 0.01, 0.7),
        ("albedo", 0.01, 0.7),
        ("leaves_per_m2", 1.0, 200.0),
        ("fruit.length_m", 0.005, 0.4),
        ("fruit.length_m", 0.005, 0.4),
        ("fruit.width_ratio", 0.05, 1.5),
        ("fruit.width_ratio", 0.05, 1.5),
        ("fruit.scales", 0.0, 0.5),
        ("fruit.per_m2", 0.0, 20.0),
        ("bark.length_m", 0.01, 1.4),
        ("bark.length_m", 0.01, 1.4),
        ("bark.width_m", 0.005, 0.2),
        ("bark.width_m", 0.005, 0.2),
        ("bark.per_m2", 0.0, 20.0),
    ];

    /// A table in which the numbers have these values, in the order of [`NUMBERS`].
    fn table(values: &[String]) -> String {
        let [
            a,
            b,
            c,
            leaves,
            l0,
            l1,
            w0,
            w1,
            scales,
            fruits,
            m0,
            m1,
            n0,
            n1,
            barks,
        ] = values
        else {
            panic!("one value for each number");
        };
        format!(
            "[shed]\nalbedo = [{a}, {b}, {c}]\nleaves_per_m2 = {leaves}\n\
             fruit.length_m = [{l0}, {l1}]\nfruit.width_ratio = [{w0}, {w1}]\n\
             fruit.scales = {scales}\nfruit.per_m2 = {fruits}\n\
             bark.length_m = [{m0}, {m1}]\nbark.width_m = [{n0}, {n1}]\n\
             bark.per_m2 = {barks}\n"
        )
    }

    /// What is said about a beech that sheds what a table says.
    fn said(table: &str) -> String {
        let text = Species::built_in_toml("beech").expect("there is a beech");
        let (before, _) = text.split_once("[shed]").expect("it sheds leaves");
        let read = Species::from_toml(&format!("{before}{table}"), "my.toml");
        read.err().map(|e| e.to_string()).unwrap_or_default()
    }

    fn middle() -> Vec<f64> {
        let middle = |(_, low, high): &(&str, f64, f64)| 0.5 * (low + high);
        NUMBERS.iter().map(middle).collect()
    }

    fn texts(values: &[f64]) -> Vec<String> {
        values
            .iter()
            .map(|v| format!("{v:?}").to_lowercase())
            .collect()
    }

    #[test]
    fn numbers_of_a_file_that_are_out_of_range_are_refused_by_name() {
        assert_eq!(said(&table(&texts(&middle()))), "");
        for (i, (name, low, high)) in NUMBERS.into_iter().enumerate() {
            for value in [low - 1e-3, high + 1e-3, -1e300, 1e300] {
                let mut values = middle();
                values[i] = value;
                let said = said(&table(&texts(&values)));
                let value = match value.abs() {
                    1e300 => format!("{value:e}"),
                    _ => value.to_string(),
                };
                let field = format!("my.toml: beech.shed.{name} = {value}: must be from ");
                assert!(said.starts_with(&field), "{said:?}, not {field:?}");
            }
            for value in ["nan", "inf", "-inf"] {
                let mut values = texts(&middle());
                values[i] = value.to_owned();
                let said = said(&table(&values));
                let field = format!("my.toml: beech.shed.{name} = ");
                assert!(said.starts_with(&field), "{said:?}, not {field:?}");
                assert!(
                    !said.contains("from NaN") && !said.contains("to NaN"),
                    "{said}"
                );
            }
        }
        let mut turned = middle();
        turned.swap(10, 11);
        (turned[10], turned[11]) = (0.5, 0.1);
        let said = said(&table(&texts(&turned)));
        assert!(
            said.contains("beech.shed.bark.length_m = 0.5: must be from 0.01 to 0.1"),
            "{said}"
        );
    }

    #[test]
    fn species_that_do_not_say_shed_leaves() {
        let mut species = Species::eucalyptus();
        species.shed = None;
        assert!(species.check().is_ok() && species.litter_look().leaves_per_m2 > 1.0);
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_or_refused(text in "[ -~\n]{0,80}") {
            // Whatever it is, it is no panic.
            let _ = said(&format!("[shed]\n{text}"));
        }
    }
}
