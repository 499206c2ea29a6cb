//! The species that a site needs: those of the stand, and those of its stem map.

use nemoral_assets::Species;
use nemoral_import::Stem;
use nemoral_seed::Key;

use super::measured::{MeasuredStems, Named, measure, species_of};
use crate::{Assets, Error, InputFiles, Site};

/// What decides which species are grown, and how large the trees of a stem map are.
#[derive(Clone, Copy, Debug)]
pub struct SiteSpecies<'a> {
    /// The stand.
    pub assets: &'a Assets,
    /// The site, whose stem map names species.
    pub site: &'a Site,
    /// The names of the user's models of trees.
    pub tree_models: &'a [String],
    /// The files of the config.
    pub inputs: &'a InputFiles,
}

impl SiteSpecies<'_> {
    /// The species that are grown, and their shares among the stand's trees: those with a share,
    /// and those of the stem map, which have shares only if no others do.
    ///
    /// # Errors
    /// If a file cannot be used, a species is unknown, or there is none.
    pub fn all(&self) -> Result<Vec<(Species, f64)>, Error> {
        let mut all = self.of_stand()?;
        let Some((stems, known, of_stem)) = self.stem_map()? else {
            return Ok(all);
        };
        let is_without = all.is_empty();
        let mut counts = vec![0_usize; known.len()];
        for named in of_stem.iter().flatten() {
            if let Named::Species(i) = *named {
                counts[i] += 1;
            }
        }
        for (species, count) in known.into_iter().zip(counts) {
            let is_there = all.iter().any(|(s, _)| s.name == species.name);
            if count > 0 && !is_there {
                let share = if is_without {
                    count as f64 / stems.len() as f64
                } else {
                    0.0
                };
                all.push((species, share));
            }
        }
        if all.is_empty() {
            let message = "site.stems.path: no tree has a species of ours, and the shares in \
                           [assets] are all 0";
            return Err(Error::request(message));
        }
        Ok(all)
    }

    /// The stem map, the species that it may name, and what each stem is.
    #[expect(clippy::type_complexity, reason = "three results of one reading")]
    fn stem_map(&self) -> Result<Option<(Vec<Stem>, Vec<Species>, Vec<Option<Named>>)>, Error> {
        let Some(stems) = self.site.stem_map(self.inputs)? else {
            return Ok(None);
        };
        let mut known: Vec<Species> = Species::all();
        if !self.assets.own_species.is_empty() {
            known.push(self.own_species()?);
        }
        let other = &self.site.stems.other_species;
        let of_stem = species_of(&stems, &known, self.tree_models, other);
        let of_stem = of_stem.map_err(|e| self.of_stems(&e))?;
        Ok(Some((stems, known, of_stem)))
    }

    /// The trees of the stem map with everything that is drawn for them, from the key of plants;
    /// none without a stem map. `species` are those of [`SiteSpecies::all`].
    ///
    /// # Errors
    /// If the stem map cannot be used, or no tree can have a size that it says.
    pub fn measured(&self, species: &[(Species, f64)], key: Key) -> Result<MeasuredStems, Error> {
        let Some((stems, known, of_stem)) = self.stem_map()? else {
            return Ok(MeasuredStems::default());
        };
        let index = |i: usize| species.iter().position(|(s, _)| s.name == known[i].name);
        let place = |named: Named| match named {
            Named::Species(i) => index(i).map(Named::Species),
            model @ Named::Model(_) => Some(model),
        };
        let of_stem: Vec<_> = of_stem.into_iter().map(|i| i.and_then(place)).collect();
        let shapes = self.site.stems.shapes;
        measure(
            (&stems, &of_stem),
            species,
            self.assets,
            (self.site.stems.margin_m, shapes),
            key,
        )
        .map_err(|e| self.of_stems(&e))
    }

    /// An error in the stem map.
    #[must_use]
    pub fn of_stems(&self, message: &str) -> Error {
        Error::request(format!("{}: {message}", self.site.stems.path))
    }

    fn own_species(&self) -> Result<Species, Error> {
        let file = self.inputs.get(&self.assets.own_species);
        let (text, path) = match file {
            Some(file) => (file.text()?, file.path().display().to_string()),
            None => ("", "assets.own_species".to_owned()),
        };
        Species::from_toml(text, &path).map_err(|e| Error::request(e.to_string()))
    }

    /// The species with a share, and their shares.
    fn of_stand(&self) -> Result<Vec<(Species, f64)>, Error> {
        let wanted = self.assets.shares().into_iter().filter(|(_, s)| *s > 0.0);
        let species = wanted.map(|(name, share)| {
            let species = match name.and_then(Species::built_in) {
                Some(species) => species,
                None => self.own_species()?,
            };
            Ok((species, share))
        });
        species.collect()
    }
}
