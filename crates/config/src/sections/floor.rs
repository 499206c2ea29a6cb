//! Keys of what lies, grows and climbs between the trees and on them.

use crate::schema::AllowedValues::{Flag, Real};
use crate::schema::section;

section! {
    /// Deadwood that lies: logs in five stages of decay, thrown trees with their root plates and
    /// pits, branches, brash. Standing dead trees are `assets.snags`.
    Deadwood at "deadwood" {
        /// Volume of logs and thrown stems on a hectare.
        volume_m3_ha: f64 = 8.0, Real(0.0, 200.0),
            "managed forests: below 25 in 77 % of some 90 European plots, doi 10.3832/ifor1057";
        /// Mean stage of decay of logs: 1 fresh with its bark, 2 losing it, 3 bare and mossy, 4
        /// soft and flattened, 5 rotten. Stages are spread about it by 1.1.
        decay: f64 = 2.7, Real(1.0, 5.0), "stages of Maser et al. 1979; the mean is our choice";
        /// Trees on a hectare that a storm threw: a stem, a root plate, and a pit in the ground.
        thrown_per_ha: f64 = 1.0, Real(0.0, 60.0), "our choice: a few";
        /// Whether logs may lie across trails, where they are in a vehicle's way.
        across_trails: bool = false, Flag, "trails are kept clear";
        /// Fallen branches, and tops left after thinning, on 100 m² beside trails.
        branches: f64 = 4.0, Real(0.0, 40.0), "our choice";
        /// Share of trails that are covered with mats of brash, which machines lay down to drive
        /// on; skid trails have `trails.skid_trail.brash`, if that is more.
        brash: f64 = 0.0, Real(0.0, 1.0), "none: skid trails alone have them";
    }
}

section! {
    /// What grows on trees, and resin that runs down them.
    Climbers at "climbers" {
        /// Share of the trees that ivy climbs; thick ones are climbed more often, and those near
        /// each other.
        ivy: f64 = 0.05, Real(0.0, 1.0), "our choice: 0-0.3";
        /// Of these, the share whose ivy reaches the crown. The others' climbs a third as high.
        ivy_in_crown: f64 = 0.4, Real(0.0, 1.0), "our choice";
        /// Share of the trees that honeysuckle winds up; thin ones more often, and those near each
        /// other.
        honeysuckle: f64 = 0.05, Real(0.0, 1.0), "our choice";
        /// Share of the trees that clematis hangs from; those at meadows three times as often. It
        /// hangs only where leaves begin below 14 m.
        clematis: f64 = 0.02, Real(0.0, 1.0), "our choice: it needs light";
        /// Share of living conifers whose bark has runs of resin.
        resin: f64 = 0.15, Real(0.0, 1.0), "our choice";
        /// Cover of moss on the moist side of the stem's foot: 1 as in a moist forest.
        moss: f64 = 0.5, Real(0.0, 3.0), "our choice";
        /// How high moss reaches on that side; half as high elsewhere.
        moss_height_m: f64 = 0.9, Real(0.1, 6.0), "our choice";
        /// The azimuth of that side, clockwise from north; 180 south of the equator.
        moss_azimuth_deg: f64 = 0.0, Real(-360.0, 360.0), "north, which the sun dries least";
    }
}

impl Climbers {
    /// Bare stems.
    #[must_use]
    pub fn none() -> Self {
        Self {
            ivy: 0.0,
            honeysuckle: 0.0,
            clematis: 0.0,
            resin: 0.0,
            moss: 0.0,
            ..Self::default()
        }
    }
}

section! {
    /// Low plants, on a jittered grid over the whole chunk (paper, IV-D).
    Undergrowth at "undergrowth" {
        /// Side of a grid cell; each may hold a patch of plants.
        cell_m: f64 = 1.25, Real(0.5, 10.0), "patches are 1-2 m wide";
        /// Share of cells that hold a patch in full light.
        cover: f64 = 0.9, Real(0.0, 1.0), "our choice";
        /// Patches of fallen twigs per cell, where there is no `[litter]`.
        litter: f64 = 0.12, Real(0.0, 1.0), "our choice";
        /// Weight of grass among the patches.
        grass: f64 = 0.45, Real(0.0, 100.0), "open forests of the south";
        /// Weight of herbs.
        herbs: f64 = 0.3, Real(0.0, 100.0), "open forests of the south";
        /// Weight of ferns and bracken, which grow in groups.
        ferns: f64 = 0.6, Real(0.0, 100.0), "open forests of the south";
        /// Roots that spread over the ground from the feet of old trees, relative to the usual:
        /// more of species with a wide foot, and where soil is thin; 0 for none.
        surface_roots: f64 = 1.0, Real(0.0, 2.0), "our choice: each large lobe of an old foot";
    }
    plus {
        /// The cover of the ground.
        floor: Floor;
        /// What the lie of the ground does.
        ground: GroundEffects;
        /// Grass without gaps.
        sward: Sward;
        /// Thickets.
        thickets: Thickets;
    }
}

section! {
    /// How the lie of the ground steers what covers it. It is wet in hollows and by water, dry on
    /// crests, steep slopes and those to the south-west, or south of the equator (by the latitude
    /// of `sun.date`, or else of `[season]`) to the north-west; its soil is thin where it is convex
    /// or steep. Moss, mud and puddles, herbs, ferns, grass and thickets follow.
    GroundEffects at "undergrowth.ground" {
        /// Effect of wetness; 0: only the nearest seven metres matter, and only to thickets.
        wetness: f64 = 1.0, Real(0.0, 2.0), "our choice; Beven and Kirkby 1979 for the index";
        /// Effect of the sun on slopes: those to the south-west are dry, or to the north-west south
        /// of the equator.
        heat_load: f64 = 1.0, Real(0.0, 2.0), "McCune and Keon 2002 for the direction";
        /// Effect of the depth of soil.
        soil: f64 = 1.0, Real(0.0, 2.0), "Heimsath et al. 1997 for the depth";
        /// How readily the wettest ground is bare mud: along water and in the open; in woods litter
        /// covers most of it.
        mud: f64 = 0.3, Real(0.0, 1.0), "our choice";
        /// Effect of deer, which are many here and few there: where they are, brambles, bilberry
        /// and young trees are few and low, grass is short, and bracken stays.
        browsing: f64 = 0.6, Real(0.0, 1.0), "our choice; Kirby 2001 for what is eaten";
        /// Effect of the years since storms or people opened a place: grass and nettles come
        /// first, then brambles, then bracken and young trees.
        succession: f64 = 0.6, Real(0.0, 1.0), "our choice";
    }
}

impl GroundEffects {
    /// The lie of the ground does nothing.
    #[must_use]
    pub fn none() -> Self {
        Self {
            wetness: 0.0,
            heat_load: 0.0,
            soil: 0.0,
            mud: 0.0,
            browsing: 0.0,
            succession: 0.0,
        }
    }
}

section! {
    /// Grass that leaves no gaps, on the forest floor, along trails, and on those with a grassy
    /// surface. It needs light: it is thinner under closed crowns, and there is none in deep shade.
    /// Its kinds change from place to place.
    Sward at "undergrowth.sward" {
        /// Share of the ground that it covers where there is light for it.
        cover: f64 = 0.3, Real(0.0, 1.0), "our choice: open forests of the south";
        /// Weight of tall grass that nobody cuts.
        rank: f64 = 1.0, Real(0.0, 100.0), "our choice";
        /// Weight of short grass, grazed or mown.
        grazed: f64 = 0.6, Real(0.0, 100.0), "our choice";
        /// Weight of grass in clumps, more where it is moist.
        tussocks: f64 = 0.6, Real(0.0, 100.0), "our choice";
        /// Weight of grass that has dried on its stalks, more where it is dry.
        dry: f64 = 0.6, Real(0.0, 100.0), "our choice";
        /// Weight of lodged grass: tall, and laid by wind and rain.
        lodged: f64 = 0.4, Real(0.0, 100.0), "our choice";
    }
}

section! {
    /// Thickets, which close over the ground in stands of some metres to tens of metres: shares of
    /// the ground that they cover where light, moisture and slope suit them. Where several would
    /// grow, one of them does. Reeds are by streams and ponds alone.
    Thickets at "undergrowth.thickets" {
        /// Share of brambles, 0.6 to 1.5 m high.
        bramble: f64 = 0.06, Real(0.0, 1.0), "our choice";
        /// Share of bracken, 0.7 to 1.4 m high.
        bracken: f64 = 0.08, Real(0.0, 1.0), "our choice";
        /// Share of heather, in the light, where it is not moist.
        heath: f64 = 0.05, Real(0.0, 1.0), "our choice";
        /// Share of bilberry, which bears shade.
        bilberry: f64 = 0.0, Real(0.0, 1.0), "rare in open forests of the south";
        /// Share of nettles, where it is moist.
        nettles: f64 = 0.02, Real(0.0, 1.0), "our choice";
        /// Share of the banks of streams and ponds, where there is light, that is under reeds, 1.2
        /// to 2.3 m high.
        reeds: f64 = 0.5, Real(0.0, 1.0), "our choice";
    }
}

section! {
    /// The forest floor: shares of its covers, which form patches of some metres.
    Floor at "undergrowth.floor" {
        /// Share of fallen leaves.
        leaf_litter: f64 = 1.0, Real(0.0, 1000.0), "a mixed forest";
        /// Share of fallen needles.
        needle_litter: f64 = 1.0, Real(0.0, 1000.0), "a mixed forest";
        /// Share of moss and soil.
        moss: f64 = 1.0, Real(0.0, 1000.0), "a mixed forest";
    }
}
