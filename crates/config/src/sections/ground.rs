//! Keys of the terrain and of trails.

use super::{DeerPath, Firebreak, Footpath, ForestRoad, SkidTrail, TrailKinds, TrailSection};
use crate::TerrainNoise;
use crate::choices::{TRAIL_SURFACES, VARIED_SURFACES};
use crate::schema::AllowedValues::{Flag, OneOf, Real, RealAbove, Whole};
use crate::schema::section;

section! {
    /// The terrain: octaves of gradient noise (paper, IV-B), and what shapes them further.
    Terrain at "terrain" {
        /// Number of noise layers.
        octaves: u32 = 6, Whole(1, 16), "paper, Fig. 3, has 5; one more for relief under 4 m";
        /// Size of the largest hills.
        scale_m: f64 = 130.0, RealAbove(0.0, 10_000.0),
            "paper, Fig. 3, has 40, which is steep; ours is walkable";
        /// Frequency of each layer over the one before.
        lacunarity: f64 = 2.1, RealAbove(1.0, 10.0),
            "paper, IV-B: above 1; not 2, so that lattices do not align";
        /// Amplitude of each layer over the one before.
        persistence: f64 = 0.33, Real(0.0, 1.0), "paper, IV-B: 0..1";
        /// The greatest height.
        max_height_m: f64 = 22.0, Real(0.0, 2000.0), "paper, Fig. 3, has 50, for mountains; ours \
            are hills";
        /// The noise: ours, or that of the noise crate.
        noise: TerrainNoise = TerrainNoise::Nemoral, OneOf(TerrainNoise::WORDS),
            "ours has no period and exact gradients";
        /// Share of ridges: crests in the largest forms, and fewer in each layer of smaller ones.
        ridges: f64 = 0.0, Real(0.0, 1.0), "none: the paper's octaves";
        /// Domain warping: valleys wind by this part of `scale_m`, as a standard deviation.
        warp: f64 = 0.0, Real(0.0, 0.25), "none: the paper's octaves";
        /// Share of terraces, as of hard beds in rock: level ground between rises up to four times
        /// as steep. They fade in and out from place to place.
        terraces: f64 = 0.0, Real(0.0, 1.0), "none: the paper's octaves";
        /// How sheer the rises between terraces are: at 1, up to eight times as steep. Above 0,
        /// what is steeper than some 45 degrees is bare rock, on which nothing stands.
        cliffs: f64 = 0.0, Real(0.0, 1.0), "none: the paper's octaves";
        /// Height of a terrace; at most half of `max_height_m`, if there are terraces.
        terrace_step_m: f64 = 4.0, Real(0.2, 200.0), "our choice";
        /// Depth of the largest gullies where slopes are steep; less on gentle ones, none on level
        /// ground. At most 0.4 of `gully_spacing_m`.
        gully_depth_m: f64 = 0.0, Real(0.0, 100.0), "none: the paper's octaves";
        /// Distance between the largest gullies.
        gully_spacing_m: f64 = 30.0, Real(4.0, 500.0), "our choice";
        /// How often gullies branch: each generation has half the distance and two fifths of the
        /// depth of the one before.
        gully_generations: u32 = 3, Whole(1, 5), "our choice: down to forms of some metres";
        /// Side of a terrain cell away from trails.
        cell_m: f64 = 1.0, Real(0.5, 5.0), "paper, Fig. 3";
        /// Side of a terrain cell on trails and chunk borders.
        fine_cell_m: f64 = 0.25, Real(0.1, 2.0), "resolves wheel ruts";
    }
}

impl Terrain {
    /// Whether some of it is cliffs.
    #[must_use]
    pub fn has_cliffs(&self) -> bool {
        self.terraces > 0.0 && self.cliffs > 0.0
    }
}

section! {
    /// The trails (paper, IV-C), carved into the terrain.
    Trails at "trails" {
        /// Whether there are trails.
        enabled: bool = true, Flag, "paper, IV-C: can be switched off";
        /// Width of machine tracks.
        width_m: f64 = 2.6, Real(0.8, 6.0), "our choice: a forest track";
        /// Surface of tracks: one for all, or varied from trail to trail. Where it is one,
        /// footpaths, deer paths, skid trails and firebreaks have it too, besides mud and grass.
        surface: String = VARIED_SURFACES.into(), OneOf(&TRAIL_SURFACES),
            "paper, VII: one texture for all was its models' failure";
        /// Probability that a trail is born in a chunk.
        spawn_probability: f64 = 0.012, Real(0.0, 1.0), "a trail in every third chunk";
        /// Probability that a trail leaves a chunk by the opposite border, rather than left or
        /// right.
        forward_probability: f64 = 0.75, Real(0.0, 1.0), "long trails with some bends";
        /// A trail ends after this many chunks.
        max_length_chunks: u32 = 40, Whole(1, 64), "2 km; bounds the search for trails";
        /// Probability that a trail forks where it enters a chunk: a branch of 2 to 6 chunks leaves
        /// it at an acute angle. Robots stay on the trail.
        forks: f64 = 0.08, Real(0.0, 1.0), "our choice: a fork every 600 m";
        /// How readily surface, grass and stones change along a way. 0: in stretches of 60 to
        /// 180 m, with grass and stones evenly along it; above 0, half as many, in patches.
        change: f64 = 0.5, Real(0.0, 1.0), "our choice: overgrown, muddy and stony places";
        /// Depth of the wheel ruts of tracks.
        rut_depth_m: f64 = 0.05, Real(0.0, 0.4), "our choice: 2-8 cm when dry";
        /// Height of the crown in the middle of tracks over the edges.
        crown_m: f64 = 0.04, Real(-0.3, 0.3), "our choice: some 4 %";
        /// Most tufts of grass along the tracks in a chunk, and in proportion along other ways; 0
        /// for none.
        grass_max: u32 = 120, Whole(0, 2000), "paper, IV-C";
        /// How far from the middle a tuft may stand.
        grass_spread_m: f64 = 0.6, Real(0.0, 5.0), "paper, IV-C; between the ruts";
        /// Room for tufts of grass on a metre of each edge, of which about half grow; 0 for bare
        /// verges.
        verge_per_m: f64 = 6.0, Real(0.0, 20.0), "grassed verges, which get light and water";
        /// Share of the strip between the ruts that short grass, plantain and clover cover where
        /// there is light for them; less on sand and needles.
        strip_cover: f64 = 0.6, Real(0.0, 1.0), "our choice: a track that is driven now and then";
        /// Stones, lumps of earth and ends of roots in the slopes that trails cut, relative to the
        /// usual; 0 for smooth slopes.
        banks: f64 = 1.0, Real(0.0, 2.0), "our choice: a cut of some years";
        /// Most stones along a track, and in proportion along other ways, at most 120; 0 for none.
        rocks_max: u32 = 25, Whole(0, 500), "paper, IV-C";
    }
    plus {
        /// Shares of the kinds of way.
        kinds: TrailKinds;
        /// How trails are built.
        section: TrailSection;
        /// Forest roads.
        forest_road: ForestRoad;
        /// Skid trails.
        skid_trail: SkidTrail;
        /// Firebreaks.
        firebreak: Firebreak;
        /// Footpaths.
        footpath: Footpath;
        /// Paths of deer.
        deer_path: DeerPath;
    }
}
