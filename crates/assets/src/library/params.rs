//! What a library is asked to hold.

use nemoral_scene::{ParamError, PlantCommunity, TrailSurfaceKind};

use super::climbers::ClimberParams;
use super::litter::LitterParams;
use crate::materials::MaterialSelection;
use crate::tree::{Competitors, Season, Species, TreeSize};

/// What to grow.
#[derive(Clone, Debug, PartialEq)]
pub struct AssetParams {
    /// The trees' species, 1 to 32, each with a name of its own.
    pub species: Vec<StandSpecies>,
    /// Different living trees of each species, 1..=64. The stand's distribution of diameters is
    /// divided into as many equal parts, and each tree stands for one, so that even a few trees
    /// show its spread and its basal area.
    pub individuals_per_species: u32,
    /// Different saplings of each species, 0..=64, 2 to 4.5 m high.
    pub saplings_per_species: u32,
    /// Different seedlings of each species, 0..=64, under 0.3 m high.
    pub seedlings_per_species: u32,
    /// Different standing dead trees of each species, 0..=64, as thick as the stand's.
    pub snags_per_species: u32,
    /// Whether logs, root plates, branches and brash are made.
    pub deadwood: bool,
    /// What grows on trees; `None` for nothing.
    pub climbers: Option<ClimberParams>,
    /// The communities of low plants of which tiles are made, each once, in any order.
    pub communities: Vec<PlantCommunity>,
    /// The surfaces that trails have, each once, in any order. The others have the textures of the
    /// first one of these; there are none without one.
    pub trail_surfaces: Vec<TrailSurfaceKind>,
    /// Whether roots across trails, beds of stones beside them, and what sticks out of their banks
    /// are made.
    pub wayside: bool,
    /// Whether roots that spread over the ground from old trees are made.
    pub surface_roots: bool,
    /// Stones that lie in streams, wet up to some height.
    pub stream_stones: bool,
    /// The ground of cliffs.
    pub rock_faces: bool,
    /// Whether each of the stand's living trees is also grown as it would be at the wood's edge:
    /// with a crown that reaches down on the side of +x. These follow the stand's trees in
    /// [`Library::trees`](crate::Library::trees), in the same order.
    pub edge_trees: bool,
    /// When; `None` is high summer. Shapes do not depend on it, but for those of ferns, which lie
    /// down in winter.
    pub season: Option<Season>,
    /// What litter is made of what the trees shed; `None` for none.
    pub litter: Option<LitterParams>,
    /// Whether bark, wood, stone and ground have textures. Without, each is of one grey, and
    /// nothing else differs: shapes, masks of leaves, semantics and what lasers meet are the same.
    /// Scans need no more, and much of the time to grow a library goes into textures.
    pub textures: bool,
    /// Wood of at least this radius is a limb, thinner wood a branch; metres, 0.01..=0.2.
    pub trunk_radius_m: f64,
    /// How thick the trees of a stand are.
    pub stand: StandParams,
    /// Trees of given sizes, such as those of a plot, at most 4096. They follow the other trees in
    /// [`Library::trees`](crate::Library::trees) if they are alive, else those in
    /// [`Library::snags`](crate::Library::snags).
    pub measured: Vec<MeasuredTree>,
}

/// A tree of a given size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredTree {
    /// The index of its species in [`AssetParams::species`].
    pub species: usize,
    /// Its size; of a dead tree, the size that it had before its top broke.
    pub size: TreeSize,
    /// Is it alive?
    pub alive: bool,
}

/// A species in a stand.
#[derive(Clone, Debug, PartialEq)]
pub struct StandSpecies {
    /// The species.
    pub species: Species,
    /// Mean diameter at breast height before truncation, metres, 0.08..=1.0.
    pub dbh_mean_m: f64,
    /// How many of its trees stand on a hectare of the stand, 0..=20,000.
    pub trees_per_ha: f64,
}

/// The distribution of diameters at breast height: a truncated Weibull distribution (shape 2.5 to 4
/// in even-aged stands, 1 to 1.5 in uneven-aged ones), whose mean is given by species.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StandParams {
    /// Weibull shape, 1..=6: about 1.2 in uneven-aged, 3 in even-aged stands.
    pub shape: f64,
    /// Thinnest tree, metres, 0.07..=0.5.
    pub dbh_min_m: f64,
    /// Thickest tree, metres, above the thinnest and at most 1.5.
    pub dbh_max_m: f64,
}

impl Default for AssetParams {
    /// The paper's Portuguese forest: maritime pine, eucalypt, English oak.
    fn default() -> Self {
        let of = |species, dbh_mean_m| StandSpecies {
            species,
            dbh_mean_m,
            trees_per_ha: 150.0,
        };
        Self {
            species: vec![
                of(Species::maritime_pine(), 0.28),
                of(Species::eucalyptus(), 0.22),
                of(Species::english_oak(), 0.30),
            ],
            individuals_per_species: 8,
            saplings_per_species: 0,
            seedlings_per_species: 0,
            snags_per_species: 0,
            deadwood: false,
            climbers: None,
            communities: Vec::new(),
            trail_surfaces: TrailSurfaceKind::ALL.to_vec(),
            wayside: false,
            surface_roots: false,
            stream_stones: false,
            rock_faces: false,
            edge_trees: false,
            season: None,
            litter: None,
            textures: true,
            trunk_radius_m: 0.04,
            stand: StandParams::default(),
            measured: Vec::new(),
        }
    }
}

impl Default for StandParams {
    fn default() -> Self {
        Self {
            shape: 2.5,
            dbh_min_m: 0.10,
            dbh_max_m: 0.60,
        }
    }
}

impl AssetParams {
    /// Checks the parameters.
    ///
    /// # Errors
    /// If one is out of its range.
    pub fn check(&self) -> Result<(), ParamError> {
        if !(1..=32).contains(&self.species.len()) {
            let n = self.species.len();
            return Err(ParamError::new("species", n, "1 to 32 species"));
        }
        for (i, of) in self.species.iter().enumerate() {
            of.species.check()?;
            let name = &of.species.name;
            if self.species[..i].iter().any(|o| o.species.name == *name) {
                let field = format!("species[{i}].name");
                return Err(ParamError::new(
                    field,
                    name,
                    "another name than the others'",
                ));
            }
            let field = format!("species[{i}].dbh_mean_m");
            ParamError::check_within(field, of.dbh_mean_m, 0.08, 1.0)?;
            let field = format!("species[{i}].trees_per_ha");
            ParamError::check_within(field, of.trees_per_ha, 0.0, 20_000.0)?;
        }
        let n = f64::from(self.individuals_per_species);
        ParamError::check_within("individuals_per_species", n, 1.0, 64.0)?;
        let n = f64::from(self.saplings_per_species);
        ParamError::check_within("saplings_per_species", n, 0.0, 64.0)?;
        let n = f64::from(self.seedlings_per_species);
        ParamError::check_within("seedlings_per_species", n, 0.0, 64.0)?;
        let n = f64::from(self.snags_per_species);
        ParamError::check_within("snags_per_species", n, 0.0, 64.0)?;
        ParamError::check_within("trunk_radius_m", self.trunk_radius_m, 0.01, 0.2)?;
        if let Some(ClimberParams { moss, .. }) = self.climbers {
            ParamError::check_within("climbers.moss.amount", moss.amount, 0.0, 3.0)?;
            ParamError::check_within("climbers.moss.height_m", moss.height_m, 0.1, 10.0)?;
        }
        let n = self.measured.len() as f64;
        ParamError::check_within("measured.len()", n, 0.0, 4096.0)?;
        if let Some(i) = self
            .measured
            .iter()
            .position(|m| m.species >= self.species.len())
        {
            let field = format!("measured[{i}].species");
            let allowed = "the index of a species";
            return Err(ParamError::new(field, self.measured[i].species, allowed));
        }
        if let Some(season) = &self.season {
            season.check()?;
        }
        if let Some(litter) = &self.litter {
            litter.check(self.species.len())?;
        }
        let stand = &self.stand;
        ParamError::check_within("stand.shape", stand.shape, 1.0, 6.0)?;
        ParamError::check_within("stand.dbh_min_m", stand.dbh_min_m, 0.07, 0.5)?;
        ParamError::check_within("stand.dbh_max_m", stand.dbh_max_m, stand.dbh_min_m, 1.5)
    }

    /// The stand's trees as competitors of each other.
    #[must_use]
    pub fn competitors(&self) -> Competitors {
        const CLASSES: u32 = 32;
        let StandParams {
            shape,
            dbh_min_m,
            dbh_max_m,
        } = self.stand;
        Competitors::new(self.species.iter().flat_map(|of| {
            let per_ha = of.trees_per_ha / f64::from(CLASSES);
            (0..CLASSES).map(move |class| {
                let rank = (f64::from(class) + 0.5) / f64::from(CLASSES);
                let limits = [dbh_min_m, dbh_max_m];
                let dbh_m = of.species.dbh_of_rank(of.dbh_mean_m, shape, limits, rank);
                (&of.species, dbh_m, per_ha)
            })
        }))
    }

    /// The materials that are needed for all of it, with so many trees of each species, in a
    /// season.
    pub(super) fn wanted_materials<'a>(
        &'a self,
        trees_per_ha: &'a [f64],
        season: Option<Season>,
    ) -> MaterialSelection<'a> {
        MaterialSelection {
            trees_per_ha,
            communities: &self.communities,
            trail_surfaces: &self.trail_surfaces,
            wayside: self.wayside,
            stream_stones: self.stream_stones,
            rock_faces: self.rock_faces,
            surface_roots: self.surface_roots,
            litter: self.litter.is_some(),
            season,
            seedlings: self.seedlings_per_species > 0,
            deadwood: self.deadwood,
            climbers: self.climbers.is_some(),
            lianas: self.climbers.is_some_and(|of| of.lianas),
            resin: self.climbers.is_some_and(|of| of.resin),
            textures: self.textures,
        }
    }
}
