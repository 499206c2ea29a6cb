//! Keys of the species that are grown.

use super::TEXT;
use crate::InputPath;
use crate::schema::AllowedValues::{File, Real, Whole};
use crate::schema::section;

section! {
    /// What is grown.
    Assets at "assets" {
        /// The seed of plants. Worlds with the same one, and the same plants asked for, share grown
        /// plants. 0 is the world's own or, if there are several sequences, one for each split. No
        /// other value may be in two splits.
        seed: u64 = 0, Whole(0, i64::MAX), "plants are grown once for each split";
        /// Individuals of each tree species, of which all others are copies. A stand has as many
        /// shapes, and its diameters and heights are scattered about theirs: 64 to study those.
        individuals: u32 = 8, Whole(1, 64), "our choice: 8-16 look varied";
        /// Wood thicker than this radius is trunk, thinner wood is canopy.
        trunk_radius_m: f64 = 0.04, Real(0.005, 1.0), "our choice";
        /// Mean stem diameter at breast height, before diameters are kept within the limits.
        dbh_mean_m: f64 = 0.26, Real(0.08, 0.8), "our choice: managed stands";
        /// Shape of the Weibull distribution of diameters: 1.2 for uneven-aged stands, 3 for
        /// even-aged ones.
        dbh_shape: f64 = 2.5, Real(1.0, 6.0), "our choice";
        /// Thinnest tree.
        dbh_min_m: f64 = 0.10, Real(0.07, 0.5), "usual threshold of inventories";
        /// Thickest tree.
        dbh_max_m: f64 = 0.60, Real(0.1, 1.5), "our choice: managed stands";
        /// Share of maritime pines.
        maritime_pine: f64 = 0.6, Real(0.0, 1000.0), "the paper's Portuguese forests";
        /// Share of eucalypts.
        eucalyptus: f64 = 0.2, Real(0.0, 1000.0), "the paper's Portuguese forests";
        /// Share of English oaks.
        english_oak: f64 = 0.2, Real(0.0, 1000.0), "the paper's Portuguese forests";
        /// Share of Scots pines.
        scots_pine: f64 = 0.0, Real(0.0, 1000.0), "not in the paper's forests";
        /// Share of Norway spruces.
        norway_spruce: f64 = 0.0, Real(0.0, 1000.0), "not in the paper's forests";
        /// Share of Douglas firs.
        douglas_fir: f64 = 0.0, Real(0.0, 1000.0), "not in the paper's forests";
        /// Share of cork oaks.
        cork_oak: f64 = 0.0, Real(0.0, 1000.0), "not in the paper's forests";
        /// Share of European beeches.
        beech: f64 = 0.0, Real(0.0, 1000.0), "not in the paper's forests";
        /// Share of silver birches.
        silver_birch: f64 = 0.0, Real(0.0, 1000.0), "not in the paper's forests";
        /// Your own species file (TOML, like those in crates/assets/species); empty for none.
        own_species: InputPath = InputPath::default(), File(TEXT), "none";
        /// Share of that species.
        own_share: f64 = 0.0, Real(0.0, 1000.0), "none";
        /// Share of the trees that are dead and still stand.
        snags: f64 = 0.03, Real(0.0, 0.9), "managed European stands: a few in a hundred";
        /// Share of gorse among the shrubs.
        gorse: f64 = 1.0, Real(0.0, 1000.0), "our choice";
        /// Share of heather.
        heather: f64 = 1.0, Real(0.0, 1000.0), "our choice";
        /// Share of bramble.
        bramble: f64 = 1.0, Real(0.0, 1000.0), "our choice";
    }
}
