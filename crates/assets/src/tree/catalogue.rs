//! The built-in species, which are data files in `species/`, and the reader of a user's own file.

use super::Species;
use nemoral_scene::{ParamError, on_deep_stack};

/// Why a species file was refused.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SpeciesError {
    /// It is not TOML, or a field is missing, unknown or of the wrong type; the message shows the
    /// line.
    #[error("{origin}: {message}")]
    Syntax {
        /// The file, or what the text was called.
        origin: String,
        /// What is wrong, with the line and what was expected.
        message: String,
    },
    /// A number is out of its range.
    #[error("{origin}: {source}")]
    Value {
        /// The file, or what the text was called.
        origin: String,
        /// Which, and what is allowed.
        source: ParamError,
    },
}

macro_rules! built_in {
    ($($(#[$doc:meta])* $function:ident: $file:literal;)*) => {
        /// The built-in species' files: their names and texts.
        const FILES: &[(&str, &str)] = &[
            $((stringify!($function), include_str!(concat!("../../species/", $file))),)*
        ];

        impl Species {
            $($(#[$doc])*
            #[must_use]
            pub fn $function() -> Self {
                Self::built_in(stringify!($function)).expect("it is in the table above")
            })*
        }
    };
}

built_in! {
    /// Maritime pine, *Pinus pinaster*; `species/maritime_pine.toml`.
    maritime_pine: "maritime_pine.toml";
    /// Blue gum, *Eucalyptus globulus*; `species/eucalyptus.toml`.
    eucalyptus: "eucalyptus.toml";
    /// English oak, *Quercus robur*; `species/english_oak.toml`.
    english_oak: "english_oak.toml";
    /// Scots pine, *Pinus sylvestris*; `species/scots_pine.toml`.
    scots_pine: "scots_pine.toml";
    /// Norway spruce, *Picea abies*; `species/norway_spruce.toml`.
    norway_spruce: "norway_spruce.toml";
    /// Douglas fir, *Pseudotsuga menziesii*; `species/douglas_fir.toml`.
    douglas_fir: "douglas_fir.toml";
    /// Cork oak, *Quercus suber*; `species/cork_oak.toml`.
    cork_oak: "cork_oak.toml";
    /// European beech, *Fagus sylvatica*; `species/beech.toml`.
    beech: "beech.toml";
    /// Silver birch, *Betula pendula*; `species/silver_birch.toml`.
    silver_birch: "silver_birch.toml";
}

impl Species {
    /// The names of the built-in species, in a fixed order.
    pub fn names() -> impl Iterator<Item = &'static str> {
        FILES.iter().map(|(name, _)| *name)
    }

    /// All built-in species, in the order of [`names`](Self::names).
    #[must_use]
    pub fn all() -> Vec<Self> {
        Self::names().filter_map(Self::built_in).collect()
    }

    /// The built-in species of a name.
    #[must_use]
    pub fn built_in(name: &str) -> Option<Self> {
        let (_, text) = FILES.iter().find(|(n, _)| *n == name)?;
        Some(Self::from_toml(text, name).expect("built-in species are proved by the tests"))
    }

    /// Whether this is its name or its scientific name, in whichever case and with whichever
    /// separators.
    ///
    /// ```
    /// use nemoral_assets::Species;
    ///
    /// assert!(Species::beech().is_named("Fagus sylvatica"));
    /// assert!(!Species::beech().is_named("oak"));
    /// ```
    #[must_use]
    pub fn is_named(&self, name: &str) -> bool {
        let plain = |text: &str| text.trim().to_lowercase().replace([' ', '-'], "_");
        [&self.name, &self.scientific_name]
            .iter()
            .any(|known| plain(known) == plain(name))
    }

    /// The text of a built-in species' file, from which a user's own can be made.
    #[must_use]
    pub fn built_in_toml(name: &str) -> Option<&'static str> {
        FILES.iter().find(|(n, _)| *n == name).map(|(_, t)| *t)
    }

    /// Reads a species from the text of a file; `origin` is what errors call it.
    ///
    /// ```
    /// use nemoral_assets::Species;
    ///
    /// let text = Species::built_in_toml("beech").expect("there is a beech");
    /// let copper = text
    ///     .replace("\"beech\"", "\"copper_beech\"")
    ///     .replace("[0.06, 0.11, 0.034]", "[0.25, 0.132, 0.04]");
    /// assert_eq!(Species::from_toml(&copper, "copper.toml")?.name, "copper_beech");
    /// let wrong = text.replace("apical_dominance = 0.7", "apical_dominance = 7");
    /// let message = Species::from_toml(&wrong, "wrong.toml").unwrap_err().to_string();
    /// assert_eq!(message, "wrong.toml: beech.stem.apical_dominance = 7: must be from 0.02 to 1");
    /// # Ok::<(), nemoral_assets::SpeciesError>(())
    /// ```
    ///
    /// # Errors
    /// If the text is not TOML, a field is missing, unknown, of the wrong type or out of its range.
    pub fn from_toml(text: &str, origin: &str) -> Result<Self, SpeciesError> {
        let wrong = |message: String| SpeciesError::Syntax {
            origin: origin.to_owned(),
            message: message.trim_end().to_owned(),
        };
        let read = on_deep_stack(|| toml::from_str::<Self>(text));
        let read = read.map_err(|e| wrong(e.to_string()))?;
        let species = read.map_err(|e| wrong(e.to_string()))?;
        species.check().map_err(|source| SpeciesError::Value {
            origin: origin.to_owned(),
            source,
        })?;
        Ok(species)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn built_in_species_are_read_and_named_as_their_files() {
        assert_eq!(Species::all().len(), 9);
        for (name, species) in Species::names().zip(Species::all()) {
            assert_eq!(species.name, name);
            assert!(!species.sources.is_empty());
        }
    }

    #[test]
    fn every_wrong_field_is_named() {
        let text = Species::built_in_toml("beech").expect("there is a beech");
        let message = |from: &str, to: &str| {
            assert!(text.contains(from), "{from}");
            let e = Species::from_toml(&text.replacen(from, to, 1), "my.toml").expect_err(to);
            e.to_string()
        };
        let has = |message: String, parts: &[&str]| {
            for part in ["my.toml"].iter().chain(parts) {
                assert!(message.contains(part), "{message:?} lacks {part:?}");
            }
        };
        has(
            message("sweep_deg = 4.0", "swep_deg = 4.0"),
            &["swep_deg", "unknown field", "sweep_deg"],
        );
        // The mean height stays a tenth inside both.
        has(
            message("slenderness = [29.0, 112.0]", "slenderness = [60.0, 60.0]"),
            &["slenderness[0]", "60", "48"],
        );
        has(
            message("sweep_deg = 4.0", ""),
            &["missing field", "sweep_deg"],
        );
        has(
            message("sweep_deg = 4.0", "sweep_deg = \"much\""),
            &["much", "expected f64"],
        );
        has(
            message("kind = \"smooth\"", "kind = \"velvet\""),
            &["velvet", "stripped_cork"],
        );
        // Such a leaf would send on more light than it receives.
        has(
            message(
                "albedo = [0.06, 0.11, 0.034] # linear RGB reflectance (PROSPECT-D)\n\
                 transmittance = [0.066, 0.13, 0.0]",
                "albedo = [0.06, 0.5, 0.034]\ntransmittance = [0.066, 0.6, 0.0]",
            ),
            &["beech.leaves.transmittance", "0.6", "0.49"],
        );
        has(
            message("widest_at = 0.42", "widest_at = 1.5"),
            &["beech.crown.widest_at = 1.5", "from 0.01 to 0.99"],
        );
        has(
            message("height_sd = 0.09", "height_sd = nan"),
            &["beech.allometry.height_sd = NaN"],
        );
        has(
            message("nm905 = [0.44, 0.51]", "nm905 = [0.44, 0.6]"),
            &["beech.leaves.nm905 = 0.6"],
        );
        has(
            message("name = \"beech\"", "name = \"My Beech\""),
            &["name = My Beech", "snake_case"],
        );
    }
}
