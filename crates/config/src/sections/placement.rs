//! Keys of where rocks, trees, stumps and shrubs stand.

use crate::schema::AllowedValues::{Real, RealAbove, Whole};
use crate::schema::section;

section! {
    /// Rocks, trees, stumps and shrubs, which are placed in this order (paper, IV-D).
    Placement at "placement" {
        /// Mean number of trees in a chunk.
        trees: f64 = 96.0, Real(0.0, 400.0), "paper, VI: medium";
        /// Mean number of stumps in a chunk.
        stumps: f64 = 5.0, Real(0.0, 200.0), "our choice: managed stands";
        /// Mean number of shrubs in a chunk.
        shrubs: f64 = 60.0, Real(0.0, 400.0), "our choice";
        /// Fewest rocks in a chunk.
        rocks_min: u32 = 2, Whole(0, 400), "paper, IV-D";
        /// Most rocks in a chunk.
        rocks_max: u32 = 14, Whole(0, 400), "paper, IV-D";
        /// How readily rock crops out where the soil is thin, most on steep slopes, with scree
        /// between the rocks; 0 for none. Where soil is thin, `undergrowth.ground.soil` decides.
        outcrops: f64 = 0.0, Real(0.0, 1.0), "none: the paper's rocks are anywhere";
        /// Multiplies the radii of occupation: larger is sparser.
        density_factor: f64 = 1.0, RealAbove(0.0, 10.0), "paper, IV-D";
        /// The least distance of two objects, in multiples of the sum of their radii.
        spacing_factor: f64 = 1.3, Real(1.0, 10.0), "trunks keep apart, crowns may overlap";
        /// Regularity: the least distance of plants over the spacing of a saturated pattern; 0.3 as
        /// in natural stands, 0.5 as in thinned ones.
        hard_core: f64 = 0.5, Real(0.1, 0.7), "our choice: 0.4-0.6";
    }
    plus {
        /// Planted rows.
        rows: PlacementRows;
        /// Gaps in the canopy.
        gaps: PlacementGaps;
        /// Meadows and clearings.
        meadows: Meadows;
        /// Young trees.
        regeneration: Regeneration;
    }
}

section! {
    /// Trees in rows, as in plantations: a grid over the whole world. Of its places,
    /// `placement.trees` hold a tree; in the others the tree died or was thinned. Neighbours
    /// compete.
    PlacementRows at "placement.rows" {
        /// Distance between rows; 0 for scattered trees without rows.
        spacing_m: f64 = 0.0, Real(0.0, 20.0), "scattered; eucalypts are planted 3 x 3 m";
        /// Distance between trees in a row.
        in_row_m: f64 = 3.0, Real(0.8, 20.0), "our choice";
        /// Standard deviation of a tree's position about its place, along each axis.
        jitter_m: f64 = 0.2, Real(0.0, 1.0), "our choice: 0.15-0.3";
        /// Direction of the rows, clockwise from north.
        heading_deg: f64 = 25.0, Real(-180.0, 180.0), "any";
    }
}

section! {
    /// Gaps in the canopy at random places, with wavy outlines. Trees stand outside of them, as
    /// densely as `placement.trees` requires.
    PlacementGaps at "placement.gaps" {
        /// Share of the forest that is in gaps; 0 for no gaps.
        share: f64 = 0.0, Real(0.0, 0.6), "none, as in the paper's forests";
        /// Smallest mean radius.
        radius_min_m: f64 = 5.0, Real(1.0, 10.0), "our choice: 5-15";
        /// Largest mean radius.
        radius_max_m: f64 = 9.0, Real(1.0, 10.0), "at most half a chunk of 20 m";
        /// Density of shrubs in a gap, relative to outside.
        shrubs: f64 = 2.0, Real(0.0, 10.0), "our choice: driven by light";
        /// Density of saplings in a gap, relative to outside.
        saplings: f64 = 4.0, Real(0.0, 10.0), "gaps regenerate";
    }
}

section! {
    /// Meadows and clearings, in which no trees stand. They end at the wood in a mantle of shrubs
    /// and young trees. The numbers of `[placement]` are means of the wood.
    Meadows at "placement.meadows" {
        /// Share of the world that is open; 0 for none.
        share: f64 = 0.0, Real(0.0, 0.9), "none: forests";
        /// Size of the largest bays and tongues of its edge; meadows are about as wide.
        scale_m: f64 = 220.0, Real(30.0, 5000.0), "our choice";
        /// Width of the mantle on each side of the edge.
        mantle_m: f64 = 5.0, Real(0.0, 25.0), "our choice: mantle and fringe are 5-15 m wide";
        /// Density of shrubs in the mantle, relative to the wood.
        mantle_shrubs: f64 = 5.0, Real(0.0, 20.0), "our choice: nearly closed";
        /// Density of saplings in the mantle, relative to the wood.
        mantle_saplings: f64 = 4.0, Real(0.0, 20.0), "our choice";
        /// Density of shrubs in the open, relative to the wood.
        open_shrubs: f64 = 0.0, Real(0.0, 20.0), "a meadow is mown or grazed";
        /// Density of saplings in the open, relative to the wood.
        open_saplings: f64 = 0.0, Real(0.0, 20.0), "a meadow is mown or grazed";
        /// Density of stumps in the open, relative to the wood.
        open_stumps: f64 = 0.0, Real(0.0, 20.0), "a meadow is old";
        /// How much of the open is kept as grass without gaps, in which no thickets and no single
        /// patches grow; 0 for a clearing where everything grows that light lets grow.
        kept: f64 = 1.0, Real(0.0, 1.0), "a meadow is mown or grazed";
        /// Share of the trees at the edge that grew up there: on the open side their crowns reach
        /// down as far as their species' do in the light. 0 for a clearing of some years, around
        /// which stand the bare stems of what was within the wood.
        edge_trees: f64 = 0.9, Real(0.0, 1.0), "our choice: an old edge";
    }
}

section! {
    /// Regeneration: saplings (0.7 to 4.5 m high) and seedlings (under 0.3 m) of the stand's
    /// species, in clusters.
    Regeneration at "placement.regeneration" {
        /// Mean number of saplings in a chunk.
        saplings: f64 = 0.0, Real(0.0, 400.0),
            "none, as in the paper's forests; our choice for others: 25-500";
        /// Seedlings on a square metre of a cluster in full light; down to a tenth of that in deep
        /// shade, 6 % of it outside clusters, none on trails.
        seedlings: f64 = 0.4, Real(0.0, 2.0),
            "our choice: few; young beeches in gaps 2.5-55, Sagheb-Talebi 2012";
        /// Share of the ground that clusters cover.
        share: f64 = 0.2, Real(0.02, 0.9), "our choice";
        /// Smallest mean radius of a cluster.
        radius_min_m: f64 = 2.0, Real(0.5, 10.0), "our choice: 1-5";
        /// Largest mean radius of a cluster.
        radius_max_m: f64 = 5.0, Real(0.5, 10.0), "our choice: 1-5";
    }
}
