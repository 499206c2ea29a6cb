//! Every key of a config.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::choices::{CUSTOM_DEVICE, DEVICES, TRAIL_SURFACES};
use super::schema::Allowed::{File, Flag, OneOf, Real, RealAbove, Text, Triple, Whole};
use super::schema::{SectionSpec, encode_variants, section};
use super::{
    CameraAberration, CameraProcessing, CameraSoiling, CameraTone, CameraVignetting,
    CameraWhiteBalance, DeerPath, ExposureMode, Firebreak, Footpath, ForestRoad, InputPath,
    LaconteSensor, Look, MeteringMode, PathFormat, PathTrail, RangeNoiseModel, ReturnMode,
    SkidTrail, SpinningHead, TerrainNoise, TrailKinds, TrailSection, VARIED_SURFACES,
};

/// The largest text file that a config may name.
const TEXT: u64 = 1 << 20;
/// The largest file of trail lines, some 200,000 vertices.
const LINES: u64 = 8 << 20;
/// The largest stem map, some 200,000 trees.
const STEMS: u64 = 16 << 20;
/// The largest table, list of poses or image.
const DATA: u64 = 256 << 20;

section! {
    /// A whole request: the world, the robot, and what is recorded.
    Config at "" {
        /// The world's seed. The same seed, config and program give the same bytes.
        seed: u64 = 7, Whole(0, i64::MAX), "any number; TOML allows up to 2^63 - 1";
        /// How many sequences the data set has, each a drive through a world of its own. Sequence 0
        /// has the seed above, and the others' seeds are drawn from it.
        sequences: u32 = 1, Whole(1, 10_000), "one world";
        /// How many frames each sequence has.
        frames: u64 = 10, Whole(1, 10_000_000), "enough to look at, made in a minute";
    }
    plus {
        /// Splits.
        splits: Splits;
        /// Chunks and visible distances.
        chunks: Chunks;
        /// Your own site.
        site: Site;
        /// Terrain.
        terrain: Terrain;
        /// Trails.
        trails: Trails;
        /// Rocks, trees, stumps and shrubs.
        placement: Placement;
        /// Logs, thrown trees and branches.
        deadwood: Deadwood;
        /// Ivy and moss on trees.
        climbers: Climbers;
        /// Grass, herbs and ferns.
        undergrowth: Undergrowth;
        /// What is grown.
        assets: Assets;
        /// Sun.
        sun: Sun;
        /// Sky.
        sky: Sky;
        /// Weather.
        weather: Weather;
        /// Camera.
        camera: Camera;
        /// Further cameras.
        cameras: BTreeMap<String, Camera>;
        /// LiDAR.
        lidar: Lidar;
        /// Further LiDARs.
        lidars: BTreeMap<String, Lidar>;
        /// Robot.
        robot: Robot;
        /// Files.
        output: Output;
    }
}

section! {
    /// Which sequences are for training, validation and testing, in shares; without shares the data
    /// set is not split. No two sequences have a tree, a chunk or a place in common, and sequences
    /// of different splits share no grown plants and no textures of plants either.
    Splits at "splits" {
        /// Share of sequences to learn from. The three shares add up to 1, or all are 0.
        train: f64 = 0.0, Real(0.0, 1.0), "not split";
        /// Share of sequences to choose a model by.
        val: f64 = 0.0, Real(0.0, 1.0), "not split";
        /// Share of sequences to measure the chosen model.
        test: f64 = 0.0, Real(0.0, 1.0), "not split";
        /// The choice or group in `[vary]` whose alternatives are each split in these shares, such
        /// as `preset`; empty for none.
        by: String = String::new(), Text, "not stratified";
    }
}

section! {
    /// The chunk manager: the world is made, kept and dropped in square chunks (paper, IV-A).
    Chunks at "chunks" {
        /// Side of a chunk.
        size_m: f64 = 50.0, Real(20.0, 100.0), "paper, VI";
        /// Trees, rocks and ground are visible in chunks that come this near.
        visible_radius_m: f64 = 300.0, Real(10.0, 600.0), "far enough that haze closes the view";
        /// Undergrowth is visible in chunks that come this near.
        undergrowth_radius_m: f64 = 100.0, Real(0.0, 300.0), "the paper's visible radius, VI";
        /// Chunks farther than this are deleted; between the radii they are disabled.
        delete_radius_m: f64 = 400.0, Real(10.0, 2000.0), "two chunks beyond the visible radius";
    }
}

section! {
    /// Your own site: what you know of it, from files in projected coordinates such as UTM, metres
    /// east and north. The forest around it, and what the files leave open, is grown as ever.
    Site at "site" {
        /// Easting, in the files' coordinates, of the world's origin.
        origin_x_m: f64 = 0.0, Real(-5e7, 5e7), "the files' own origin";
        /// Northing, in the files' coordinates, of the world's origin.
        origin_y_m: f64 = 0.0, Real(-5e7, 5e7), "the files' own origin";
    }
    plus {
        /// Its trees.
        stems: SiteStems;
        /// Its ground.
        terrain: SiteTerrain;
        /// Its trails.
        trails: SiteTrails;
    }
}

section! {
    /// The trails of a site, which run where they do, carved and covered as `[trails]` says. They
    /// are there whatever `trails.enabled` says, which is about trails of chance.
    SiteTrails at "site.trails" {
        /// The middles of trails: GeoJSON with LineStrings, or CSV with the columns trail, x_m,
        /// y_m.
        path: InputPath = InputPath::default(), File(LINES), "none";
    }
}

section! {
    /// The trees of a plot: they stand where the stem map has them, as thick and as high as it
    /// says. What it does not say is drawn from the relations of their species, and species from
    /// the shares in `[assets]`, or if these are all 0 from those of the map.
    SiteStems at "site.stems" {
        /// A stem map: CSV with the columns x_m, y_m and, if known, species, dbh_m or dbh_cm,
        /// height_m, alive.
        path: InputPath = InputPath::default(), File(STEMS), "none";
        /// The species that stands for those of the map which are not among ours; empty to refuse
        /// them.
        other_species: String = String::new(), Text, "a wrong name should not go unseen";
        /// No other tree stands inside the area that the stems span, nor nearer to it than this.
        margin_m: f64 = 3.0, Real(0.0, 100.0), "our choice: half the distance of trees";
        /// How many different trees are grown of each species, living and dead ones apart. A stem
        /// is the nearest of them in diameter and height, brought to exactly its own.
        shapes: u32 = 24, Whole(1, 128), "our choice: of 600 trees, none is more than a sixth off";
    }
}

section! {
    /// The ground of a site: a height map, over the terrain of `[terrain]`, into which it passes
    /// beyond its edges and where it has no data. Trails are carved into both.
    SiteTerrain at "site.terrain" {
        /// A height map: GeoTIFF, or 16-bit grey PNG with a sidecar. It is the bare ground.
        path: InputPath = InputPath::default(), File(DATA), "none";
        /// What a PNG does not say, JSON or TOML, as on the guide's page on your own site.
        sidecar: InputPath = InputPath::default(), File(TEXT), "none";
        /// The height, in the file, of the world's zero. The terrain around is up to
        /// `terrain.max_height_m` high.
        origin_z_m: f64 = 0.0, Real(-10_000.0, 10_000.0), "the file's own";
        /// The width of the passage into the terrain around.
        blend_m: f64 = 40.0, Real(1.0, 2000.0), "our choice: slopes that one can walk";
    }
}

section! {
    /// The terrain: octaves of gradient noise (paper, IV-B).
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
        /// Side of a terrain cell away from trails.
        cell_m: f64 = 1.0, Real(0.5, 5.0), "paper, Fig. 3";
        /// Side of a terrain cell on trails and chunk borders.
        fine_cell_m: f64 = 0.25, Real(0.1, 2.0), "resolves wheel ruts";
    }
}

section! {
    /// The trails (paper, IV-C), carved into the terrain.
    Trails at "trails" {
        /// Whether there are trails.
        enabled: bool = true, Flag, "paper, IV-C: can be switched off";
        /// Width of machine tracks.
        width_m: f64 = 2.6, Real(0.8, 6.0), "our choice: a forest track";
        /// Surface of tracks: one for all, or varied from trail to trail. Other kinds of way than
        /// forest roads are of one surface, mud and grass.
        surface: String = VARIED_SURFACES.into(), OneOf(&TRAIL_SURFACES),
            "paper, VII: one texture for all was its models' failure";
        /// Probability that a trail is born in a chunk.
        spawn_probability: f64 = 0.012, Real(0.0, 1.0), "a trail in every third chunk";
        /// Probability that a trail leaves a chunk by the opposite border, rather than left or
        /// right.
        forward_probability: f64 = 0.75, Real(0.0, 1.0), "long trails with some bends";
        /// A trail ends after this many chunks.
        max_length_chunks: u32 = 40, Whole(1, 200), "2 km; bounds the search for trails";
        /// How readily surface, grass and stones change along a way. 0: in stretches of 60 to
        /// 180 m, with grass and stones evenly along it.
        change: f64 = 0.5, Real(0.0, 1.0), "our choice: overgrown, muddy and stony places";
        /// Depth of the wheel ruts of tracks.
        rut_depth_m: f64 = 0.05, Real(0.0, 0.4), "our choice: 2-8 cm when dry";
        /// Height of the crown in the middle of tracks over the edges.
        crown_m: f64 = 0.04, Real(-0.3, 0.3), "our choice: some 4 %";
        /// Most tufts of grass along the trails in a chunk; 0 for none.
        grass_max: u32 = 120, Whole(0, 2000), "paper, IV-C";
        /// How far from the middle a tuft may stand.
        grass_spread_m: f64 = 0.6, Real(0.0, 5.0), "paper, IV-C; between the ruts";
        /// Room for tufts of grass on a metre of each edge, of which about half grow; 0 for bare
        /// verges.
        verge_per_m: f64 = 6.0, Real(0.0, 20.0), "grassed verges, which get light and water";
        /// Most stones along a trail in a chunk; 0 for none.
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
    /// What grows on the stems of trees: ivy and moss.
    Climbers at "climbers" {
        /// Share of the trees that ivy climbs; thick ones are climbed more often, and those near
        /// each other.
        ivy: f64 = 0.05, Real(0.0, 1.0), "our choice: 0-0.3";
        /// Of these, the share whose ivy reaches the crown. The others' climbs a third as high.
        ivy_in_crown: f64 = 0.4, Real(0.0, 1.0), "our choice";
        /// Cover of moss on the moist side of the stem's foot: 1 as in a moist forest.
        moss: f64 = 0.5, Real(0.0, 3.0), "our choice";
        /// How high moss reaches on that side; half as high elsewhere.
        moss_height_m: f64 = 0.9, Real(0.1, 6.0), "our choice";
        /// The azimuth of that side, clockwise from north.
        moss_azimuth_deg: f64 = 0.0, Real(-360.0, 360.0), "north, which the sun dries least";
    }
}

section! {
    /// Low plants, on a jittered grid over the whole chunk (paper, IV-D).
    Undergrowth at "undergrowth" {
        /// Side of a grid cell; each may hold a patch of plants.
        cell_m: f64 = 1.25, Real(0.5, 10.0), "patches are 1-2 m wide";
        /// Share of cells that hold a patch in full light.
        cover: f64 = 0.9, Real(0.0, 1.0), "our choice";
        /// Patches of fallen twigs per cell.
        litter: f64 = 0.12, Real(0.0, 1.0), "our choice";
        /// Weight of grass among the patches.
        grass: f64 = 0.45, Real(0.0, 100.0), "open forests of the south";
        /// Weight of herbs.
        herbs: f64 = 0.3, Real(0.0, 100.0), "open forests of the south";
        /// Weight of ferns and bracken, which grow in groups.
        ferns: f64 = 0.6, Real(0.0, 100.0), "open forests of the south";
    }
    plus {
        /// The cover of the ground.
        floor: Floor;
        /// Grass without gaps.
        sward: Sward;
        /// Thickets.
        thickets: Thickets;
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
    /// grow, one of them does.
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

section! {
    /// What is grown.
    Assets at "assets" {
        /// The seed of plants. Worlds with the same one, and the same plants asked for, share grown
        /// plants. 0 is the world's own or, if there are several sequences, one for each split.
        seed: u64 = 0, Whole(0, i64::MAX), "plants are grown once for each split";
        /// Individuals of each tree species.
        individuals: u32 = 8, Whole(1, 64), "our choice: 8-16 look varied";
        /// Wood thicker than this radius is trunk, thinner wood is canopy.
        trunk_radius_m: f64 = 0.04, Real(0.005, 1.0), "our choice";
        /// Mean stem diameter at breast height.
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

section! {
    /// The sun (paper, IV-E).
    Sun at "sun" {
        /// Multiplies the sun's light.
        intensity: f64 = 1.0, Real(0.0, 100.0), "physical";
        /// Multiplies its colour, linear red, green, blue.
        colour: [f64; 3] = [1.0; 3], Triple(0.0, 10.0), "physical";
    }
    plus {
        /// The sun's position.
        #[serde(flatten)]
        position: SunPosition;
    }
}

/// The sun's position.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum SunPosition {
    /// By angles.
    Angles(SunAngles),
    /// By place, date and time.
    Date(SunDate),
}

encode_variants! { SunPosition
    Angles: "angles";
    Date: "date";
}

impl Default for SunPosition {
    fn default() -> Self {
        Self::Angles(SunAngles::default())
    }
}

section! {
    /// The sun by angles.
    SunAngles at "sun.angles", one of "the sun's position" {
        /// Clockwise from north.
        azimuth_deg: f64 = 215.0, Real(-360.0, 360.0), "early afternoon";
        /// Above the horizon.
        elevation_deg: f64 = 48.0, Real(-5.0, 90.0), "spring or autumn at 40 degrees north";
    }
}

section! {
    /// The sun by place, date and time.
    SunDate at "sun.date", one of "the sun's position" {
        /// Latitude, north positive.
        latitude_deg: f64 = 40.2033, Real(-90.0, 90.0), "Coimbra";
        /// Longitude, east positive.
        longitude_deg: f64 = -8.4103, Real(-180.0, 180.0), "Coimbra";
        /// Date and time in UTC.
        utc: String = "2022-06-21T14:30:00".into(), Text, "YYYY-MM-DDThh:mm:ss";
        /// Hours to add to that time (negative: to subtract). As a number it can be drawn from a
        /// range.
        later_h: f64 = 0.0, Real(-8784.0, 8784.0), "that time itself";
    }
}

section! {
    /// The sky that lights the scene.
    Sky at "sky" {
        /// Haze: 2 very clear, 3 clear, 6 hazy.
        turbidity: f64 = 3.0, Real(1.8, 10.0), "Preetham 1999";
        /// Share of cloud: 0 clear, 1 overcast.
        overcast: f64 = 0.0, Real(0.0, 1.0), "clear";
        /// A photographed sky instead: an equirectangular Radiance (.hdr) or OpenEXR file, zenith
        /// on top. It is visible in gaps and lights the scene as brightly as the modelled sky
        /// would. The sun is still that of `[sun]`; the one in the image is removed.
        image: InputPath = InputPath::default(), File(DATA), "none";
        /// Direction of the middle column of that image, clockwise from north.
        image_azimuth_deg: f64 = 0.0, Real(-360.0, 360.0), "north";
        /// Multiplies that image's light.
        image_gain: f64 = 1.0, Real(0.001, 1000.0), "as bright as the modelled sky";
    }
}

section! {
    /// The air near the ground: visibility and fog.
    Weather at "weather" {
        /// Meteorological visibility at the camera's height: the distance at which 2 % of the
        /// contrast is left. It is haze below 10,000 and mist below 2000.
        visibility_m: f64 = 20_000.0, Real(10.0, 1_000_000.0), "a clear day; Koschmieder 1924";
        /// The height over which that haze decreases by a factor of e.
        haze_height_m: f64 = 100.0, Real(1.0, 10_000.0),
            "a shallow layer: crowns against the sky stay clear";
        /// Extinction of fog at its base, which is 3.912 over the visibility there; 0 for no fog.
        fog_per_m: f64 = 0.0, Real(0.0, 1.0), "none";
        /// The height in the world at which fog has that extinction; below, it is denser.
        fog_base_m: f64 = 0.0, Real(-1000.0, 10_000.0), "where the terrain is lowest";
        /// The height over which fog decreases by a factor of e.
        fog_height_m: f64 = 8.0, Real(0.5, 1000.0), "fog on a valley floor";
    }
}

section! {
    /// The camera (paper, V-C).
    Camera at "camera" {
        /// Whether there is a camera. Without the first one there are no further ones.
        enabled: bool = true, Flag, "a scan alone is 20 times as fast";
        /// Columns.
        width_px: u32 = 1280, Whole(16, 8192), "paper, VI";
        /// Rows.
        height_px: u32 = 720, Whole(16, 8192), "paper, VI";
        /// Colour samples of every pixel. A GPU takes 1 if nothing more is asked for here and for
        /// edges, else 4 of every pixel.
        samples: u32 = 1, Whole(1, 256), "mean light needs as many rays";
        /// Colour samples of pixels on silhouettes, where a neighbour shows another object, class
        /// or depth (half of a forest's), if that is more than `samples`. If both are 1, the
        /// picture is a draft.
        edge_samples: u32 = 2, Whole(1, 256), "edges at a fifth more than a draft's time";
        /// How far the lens spreads the light of a point in the picture: the standard deviation of
        /// a Gaussian, pixels. With a pixel's own width, 0.5 leaves half of the contrast at 0.32
        /// cycles a pixel, 0.7 at 0.25. Below a third nothing is spread, and leaves that are
        /// smaller than a pixel are noise.
        spread_px: f64 = 0.7, Real(0.0, 4.0), "our choice: noise as of 8 samples";
        /// Number of surfaces over which light is followed to the sky by random rays; 0 takes the
        /// mean light of a place from its sky view factor. More than 0 works on the CPU alone, and
        /// is grainy with less than about 64 `samples`, with which 4 bounces take minutes.
        bounces: u32 = 0, Whole(0, 16), "mean light is within a tenth or two of it";
        /// Exposure of pictures: by a light meter, or fixed to `exposure_ev`.
        exposure: ExposureMode = ExposureMode::Auto, OneOf(ExposureMode::WORDS), "as cameras do";
        /// The `fixed` exposure at ISO 100: 0.125 cd/m² times 2 to its power is middle grey. It is
        /// 15 in sunshine, 12 under an overcast sky or in shade, 8 to 11 under crowns.
        exposure_ev: f64 = 11.0, Real(-10.0, 25.0), "a forest on a clear day";
        /// What the automatic exposure looks at: the whole picture, mostly its middle, all but the
        /// sky (as if exposed for the ground), or the sky alone.
        metering: MeteringMode = MeteringMode::Average, OneOf(MeteringMode::WORDS),
            "a meter's mean of logarithms";
        /// What the exposure, automatic or fixed, is wrong by, stops: with 1 twice the light is
        /// recorded.
        exposure_error_ev: f64 = 0.0, Real(-8.0, 8.0), "none";
        /// How light becomes a picture: `robot` is what a small camera records in a forest, with
        /// harsh contrast, clipped skies, glare at edges and dark corners; `cinema` is a soft curve
        /// that keeps highlights; `flat` is proportional to light, with a clean lens, for those who
        /// augment pictures themselves.
        look: Look = Look::Robot, OneOf(Look::WORDS), "what the data is for";
        /// Brightens (positive) or darkens the automatic exposure, stops.
        exposure_bias_ev: f64 = -0.6, Real(-8.0, 8.0),
            "as cameras meter: for bright gaps, so that leaves are dark";
        /// Write `radiance`, the light behind the lens, before exposure and sensor: OpenEXR, linear
        /// sRGB in cd/m², 32-bit floats.
        radiance: bool = false, Flag, "at most 11 MB for a picture of 1280 x 720";
        /// Write `sky`, a mask of where nothing was hit.
        sky: bool = false, Flag, "depth 0 contains the same";
        /// Write `flow`, the exact optical flow to the next frame, with a flag for points that the
        /// next frame shows.
        flow: bool = false, Flag, "one more ray for each pixel";
        /// Write `trunks`, the nearest trunk at each pixel, also behind leaves and shrubs.
        trunks: bool = false, Flag, "the paper's hard case, VII; one more ray for each pixel";
        /// Write `boxes`, 2-D and 3-D boxes of trees, stumps, shrubs and rocks with their visible
        /// fraction.
        boxes: bool = false, Flag, "each object is cast separately";
        /// Greatest distance of objects with boxes.
        boxes_range_m: f64 = 60.0, Real(1.0, 600.0), "a tree there is still 10 pixels wide";
        /// Position in front of the body's origin.
        mount_x_m: f64 = 0.35, Real(-10.0, 10.0), "a small tracked robot";
        /// Position to the left of it.
        mount_y_m: f64 = 0.0, Real(-10.0, 10.0), "centred";
        /// Height above the ground.
        mount_z_m: f64 = 1.2, Real(0.0, 50.0), "a small tracked robot";
        /// Rotation to the left.
        mount_yaw_deg: f64 = 0.0, Real(-180.0, 180.0), "forward";
        /// Pitch, downwards.
        mount_pitch_deg: f64 = 0.0, Real(-90.0, 90.0), "level";
    }
    plus {
        /// The camera's optics.
        #[serde(flatten)]
        optics: CameraOptics;
        /// The camera's lens.
        #[serde(flatten)]
        lens: CameraLens;
        /// The camera's shutter.
        shutter: CameraShutter;
        /// The noise of the camera's sensor.
        noise: CameraNoise;
        /// The camera's white balance.
        white_balance: CameraWhiteBalance;
        /// The camera's tone and colour.
        tone: CameraTone;
        /// How its corners darken.
        vignetting: CameraVignetting;
        /// The fringes of its lens.
        aberration: CameraAberration;
        /// What it does to pictures.
        processing: CameraProcessing;
        /// Dirt and drops on its lens.
        soiling: CameraSoiling;
    }
}

section! {
    /// When the camera's rows are exposed. While the robot moves, pictures blur and vertical lines
    /// lean. The truth of each row is that of the middle of its exposure.
    CameraShutter at "camera.shutter" {
        /// How long each row is exposed; 0 for an instant, without motion blur.
        exposure_ms: f64 = 0.0, Real(0.0, 1000.0), "off; 5 to 20 under crowns, 1 in the sun";
        /// From the first row's time to the last one's, for a rolling shutter; 0 for a global
        /// shutter.
        readout_ms: f64 = 0.0, Real(0.0, 1000.0), "off; 10 to 33 of rolling CMOS sensors";
        /// Least number of colour samples for each pixel of a picture with motion blur, one in each
        /// of as many parts of the exposure.
        samples: u32 = 9, Whole(2, 256), "steps of a blur of 9 pixels are not visible";
    }
}

section! {
    /// The noise of the camera's sensor, in electrons (EMVA 1288, linear model), before the tone
    /// curve.
    CameraNoise at "camera.noise" {
        /// Whether there is noise.
        enabled: bool = false, Flag, "off: those who augment add their own";
        /// Electrons that a pixel holds before it clips.
        full_well_e: f64 = 10_500.0, Real(10.0, 1e7),
            "Sony IMX273: 40.2 dB at best (EMVA 1288 of Balluff's mvBlueFOX3-2016)";
        /// Read noise, electrons.
        read_noise_e: f64 = 2.4, Real(0.0, 10_000.0), "the same: 71.4 dB of dynamic range";
        /// Amplification before the converter: with 2 a pixel clips at half its full well.
        gain: f64 = 1.0, Real(1.0, 1000.0), "none in good light";
        /// Below this exposure value (ISO 100), each stop doubles the gain.
        gain_below_ev: f64 = 8.0, Real(-20.0, 30.0), "f/2 and 1/60 s, wide open";
        /// Spread of the pixels' sensitivity (PRNU).
        prnu: f64 = 0.008, Real(0.0, 0.5), "0.5 to 1 % of CMOS sensors";
        /// Spread of the pixels' dark level (DSNU), electrons.
        dsnu_e: f64 = 1.0, Real(0.0, 10_000.0), "about 1 of good CMOS sensors";
        /// Bits of the converter.
        bits: u32 = 12, Whole(1, 16), "usual in machine vision";
    }
}

/// Further cameras.
pub(super) const FURTHER_CAMERAS: SectionSpec = SectionSpec {
    path: "cameras",
    doc: " Further cameras on the same robot: a table `[cameras.NAME]` for each, with the keys of \
        `[camera]`; what it leaves out is as in `[camera]`. Their files are in folders of that \
        name. One called `right` writes its pictures to `image_3` and is `P3` in `calib.txt`, as \
        KITTI's right eye.",
    choice: None,
    keys: &[],
};

/// The optics of a camera.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum CameraOptics {
    /// By its field of view.
    Fov(CameraFov),
    /// By sensor and lens.
    Sensor(CameraSensor),
    /// By a calibration.
    Calibration(CameraCalibration),
}

encode_variants! { CameraOptics
    Fov: "fov";
    Sensor: "sensor";
    Calibration: "calibration";
}

impl Default for CameraOptics {
    fn default() -> Self {
        Self::Fov(CameraFov::default())
    }
}

section! {
    /// The camera by its field of view.
    CameraFov at "camera.fov", one of "the camera's optics" {
        /// Horizontal field of view.
        horizontal_deg: f64 = 80.0, Real(1.0, 179.0), "as wide as the default LiDAR";
    }
}

section! {
    /// The camera by sensor size and focal length.
    CameraSensor at "camera.sensor", one of "the camera's optics" {
        /// Sensor width.
        width_mm: f64 = 7.2, Real(0.1, 1000.0), "1/2 inch class";
        /// Sensor height.
        height_mm: f64 = 4.05, Real(0.1, 1000.0), "1/2 inch class";
        /// Focal length.
        focal_length_mm: f64 = 4.3, Real(0.1, 1000.0), "80 degrees on 7.2 mm";
    }
}

section! {
    /// The camera by the numbers of its calibration, in pixels; the first pixel's centre is at
    /// (0.5, 0.5).
    CameraCalibration at "camera.calibration", one of "the camera's optics" {
        /// Focal length along rows.
        fx_px: f64 = 760.0, Real(1.0, 1e6), "80 degrees on 1280 pixels";
        /// Focal length along columns.
        fy_px: f64 = 760.0, Real(1.0, 1e6), "square pixels";
        /// Principal point from the left edge; OpenCV's plus 0.5.
        cx_px: f64 = 640.0, Real(-8192.0, 16384.0), "the middle of 1280 pixels";
        /// Principal point from the top edge; OpenCV's plus 0.5.
        cy_px: f64 = 360.0, Real(-8192.0, 16384.0), "the middle of 720 pixels";
    }
}

/// The lens of a camera.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum CameraLens {
    /// No distortion.
    Pinhole(CameraPinhole),
    /// Brown and Conrady's distortion.
    BrownConrady(CameraBrownConrady),
    /// A fisheye.
    Fisheye(CameraFisheye),
}

encode_variants! { CameraLens
    Pinhole: "pinhole";
    BrownConrady: "brown_conrady";
    Fisheye: "fisheye";
}

impl Default for CameraLens {
    fn default() -> Self {
        Self::Pinhole(CameraPinhole::default())
    }
}

section! {
    /// No distortion.
    CameraPinhole at "camera.pinhole", one of "the camera's lens" {}
}

section! {
    /// Brown and Conrady's distortion with OpenCV's coefficients, applied to picture and truth
    /// alike. The field of view is that of the middle row.
    CameraBrownConrady at "camera.brown_conrady", one of "the camera's lens" {
        /// Radial coefficient, negative for barrel distortion.
        k1: f64 = -0.1, Real(-100.0, 100.0), "a wide lens of machine vision";
        /// Radial coefficient of the fourth power.
        k2: f64 = 0.01, Real(-100.0, 100.0), "a wide lens of machine vision";
        /// Radial coefficient of the sixth power.
        k3: f64 = 0.0, Real(-100.0, 100.0), "none";
        /// Tangential.
        p1: f64 = 0.0, Real(-1.0, 1.0), "none";
        /// Tangential.
        p2: f64 = 0.0, Real(-1.0, 1.0), "none";
    }
}

section! {
    /// An equidistant fisheye after Kannala and Brandt with OpenCV's coefficients, applied to
    /// picture and truth alike. Every pixel must look within 89 degrees of the axis.
    CameraFisheye at "camera.fisheye", one of "the camera's lens" {
        /// Coefficient of the third power of the angle.
        k1: f64 = 0.0, Real(-100.0, 100.0), "equidistant";
        /// Coefficient of the fifth power.
        k2: f64 = 0.0, Real(-100.0, 100.0), "equidistant";
        /// Coefficient of the seventh power.
        k3: f64 = 0.0, Real(-100.0, 100.0), "equidistant";
        /// Coefficient of the ninth power.
        k4: f64 = 0.0, Real(-100.0, 100.0), "equidistant";
    }
}

section! {
    /// The LiDAR (paper, V-B).
    Lidar at "lidar" {
        /// Whether there is a LiDAR. Without the first one there are no further ones.
        enabled: bool = true, Flag, "pictures alone are a tenth smaller and quicker";
        /// A scanner by its data sheet. It sets the pattern, the pulses of 0.1 s (of a turn, for a
        /// terrestrial scanner), ranges, wavelength, beam, errors and noise below; keys that you
        /// set yourself override it.
        device: String = CUSTOM_DEVICE.into(), OneOf(&DEVICES),
            "the makers' data sheets, each named in the handbook";
        /// Pulses fired in a scan.
        pulses: u32 = 50_000, Whole(1, 10_000_000), "paper, VI";
        /// Surfaces nearer than this block pulses and give no return.
        min_range_m: f64 = 0.5, Real(0.0, 10.0), "blind zone: Livox";
        /// Surfaces farther than this give no return.
        max_range_m: f64 = 260.0, Real(1.0, 2000.0), "Livox wiki, at 80 % reflectance";
        /// Laser wavelength.
        wavelength_nm: u32 = 905, Whole(905, 1550), "905 or 1550";
        /// Which echoes of a pulse become points.
        returns: ReturnMode = ReturnMode::Strongest, OneOf(ReturnMode::WORDS),
            "one for each pulse, as in the paper";
        /// The most returns of a pulse with `all`.
        max_returns: u32 = 5, Whole(1, 15), "LAS allows 15";
        /// Write points in the LiDAR frame at the frame's time; if false, raw points, each in the
        /// LiDAR frame at its pulse's time.
        deskew: bool = true, Flag, "our choice";
        /// Position in front of the body's origin.
        mount_x_m: f64 = 0.35, Real(-10.0, 10.0), "above the camera";
        /// Position to the left of it.
        mount_y_m: f64 = 0.0, Real(-10.0, 10.0), "centred";
        /// Height above the ground.
        mount_z_m: f64 = 1.35, Real(0.0, 50.0), "above the camera";
        /// Rotation to the left.
        mount_yaw_deg: f64 = 0.0, Real(-180.0, 180.0), "forward";
        /// Pitch, downwards.
        mount_pitch_deg: f64 = 0.0, Real(-90.0, 90.0), "level";
    }
    plus {
        /// The LiDAR's pattern.
        #[serde(flatten)]
        pattern: LidarPattern;
        /// The LiDAR's beam.
        beam: LidarBeam;
        /// Errors other than those of ranges.
        errors: LidarErrors;
        /// Errors of ranges.
        noise: Noise;
    }
}

/// The scan pattern.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum LidarPattern {
    /// Repeating lines.
    Lines(LidarLines),
    /// Non-repeating, circular.
    Mid40(LidarMid40),
    /// Non-repeating, rectangular.
    Horizon(LidarHorizon),
    /// Non-repeating, circular and wide.
    Mid70(LidarMid70),
    /// Non-repeating, six beams.
    Avia(LidarAvia),
    /// A spinning head by its beam table.
    Spinning(LidarSpinning),
    /// A terrestrial scanner's turn.
    Panorama(LidarPanorama),
    /// From a file.
    Table(LidarTable),
}

encode_variants! { LidarPattern
    Lines: "lines";
    Mid40: "mid40";
    Horizon: "horizon";
    Mid70: "mid70";
    Avia: "avia";
    Spinning: "spinning";
    Panorama: "panorama";
    Table: "table";
}

impl Default for LidarPattern {
    fn default() -> Self {
        Self::Horizon(LidarHorizon::default())
    }
}

/// Further LiDARs.
pub(super) const FURTHER_LIDARS: SectionSpec = SectionSpec {
    path: "lidars",
    doc: " Further LiDARs on the same robot: a table `[lidars.NAME]` for each, with the keys of \
        `[lidar]`, says how it differs from the first one. Their files are in folders of that \
        name.",
    choice: None,
    keys: &[],
};

section! {
    /// Repeating lines: a spinning scanner.
    LidarLines at "lidar.lines", one of "the scan pattern" {
        /// Lines.
        lines: u32 = 32, Whole(1, 128), "a common spinning scanner";
        /// Lowest line, above the horizon.
        low_deg: f64 = -15.0, Real(-90.0, 90.0), "VLP-16 user manual";
        /// Highest line.
        high_deg: f64 = 15.0, Real(-90.0, 90.0), "VLP-16 user manual";
        /// Turns per second.
        rotation_hz: f64 = 10.0, RealAbove(0.0, 100.0), "VLP-16 user manual: 5-20 Hz";
    }
}

section! {
    /// Non-repeating, circular field of view: the Livox Mid-40's two prisms, 100,000 pulses a
    /// second.
    LidarMid40 at "lidar.mid40", one of "the scan pattern" {}
}

section! {
    /// Non-repeating, rectangular field of view: Horizon-like, 240,000 pulses a second.
    LidarHorizon at "lidar.horizon", one of "the scan pattern" {}
}

section! {
    /// Non-repeating, circular: the Livox Mid-70's stronger prisms, 100,000 pulses a second.
    LidarMid70 at "lidar.mid70", one of "the scan pattern" {}
}

section! {
    /// Non-repeating, 70° by 77°: the Livox Avia's three prisms and six beams, 240,000 pulses a
    /// second.
    LidarAvia at "lidar.avia", one of "the scan pattern" {}
}

section! {
    /// A spinning head, with its beam table and firing times.
    LidarSpinning at "lidar.spinning", one of "the scan pattern" {
        /// The scanner.
        head: SpinningHead = SpinningHead::Vlp16, OneOf(SpinningHead::WORDS),
            "Velodyne and Ouster manuals, ros-drivers/velodyne";
        /// Turns per second.
        rotation_hz: f64 = 10.0, RealAbove(0.0, 100.0), "VLP-16 user manual: 5-20 Hz";
        /// Beams of an `ouster`.
        beams: u32 = 64, Whole(1, 255), "OS1-64";
        /// Vertical field of view of an `ouster`.
        vertical_fov_deg: f64 = 45.0, RealAbove(0.0, 180.0), "OS1; an OS0 has 90";
        /// Columns per turn of an `ouster`.
        columns: u32 = 1024, Whole(1, 100_000), "OS1 at 10 Hz";
    }
}

section! {
    /// A terrestrial scanner: one turn of sweeps from below to the zenith, at equal angles; it has
    /// the number of pulses that is asked for.
    LidarPanorama at "lidar.panorama", one of "the scan pattern" {
        /// Lowest pulse, above the horizon.
        low_deg: f64 = -60.0, Real(-90.0, 90.0), "the tripod hides what is below";
        /// Highest pulse.
        high_deg: f64 = 90.0, Real(-90.0, 90.0), "the zenith";
        /// Pulses per second.
        rate_hz: f64 = 2e6, RealAbove(0.0, 1e8), "phase-shift scanners";
    }
}

section! {
    /// A table of pulses that is replayed: rows of `time, azimuth, elevation[, ring]` in seconds,
    /// degrees to the left of forward and degrees up. A header may come first; times never
    /// decrease.
    LidarTable at "lidar.table", one of "the scan pattern" {
        /// The CSV file.
        path: InputPath = InputPath::default(), File(DATA), "none";
    }
}

section! {
    /// The laser beam. It is cast as sub-rays, whose echoes mix or separate as in a real pulse.
    LidarBeam at "lidar.beam" {
        /// Divergence sideways, full width at half maximum.
        horizontal_deg: f64 = 0.28, Real(0.0, 5.0), "Livox Horizon: Livox wiki";
        /// Divergence upwards, full width at half maximum.
        vertical_deg: f64 = 0.03, Real(0.0, 5.0), "Livox Horizon: Livox wiki";
        /// Rings of sub-rays around the middle: 0, 1, 2, 3 give 1, 7, 19, 37 rays for each pulse.
        rings: u32 = 0, Whole(0, 8), "a line, as in the paper; HELIOS++ has 2";
        /// Length of the pulse; surfaces that are less than half of it apart merge into one echo.
        pulse_ns: f64 = 4.0, Real(0.0, 100.0), "Livox scanners in HELIOS++";
    }
}

section! {
    /// Errors of pointing and detection.
    LidarErrors at "lidar.errors" {
        /// Standard deviation of a pulse's direction, sideways and upwards.
        angular_deg: f64 = 0.0, Real(0.0, 5.0), "off; Livox below 0.05 to 0.1";
        /// Ranges are written in steps of this; 0 for none.
        range_step_m: f64 = 0.0, Real(0.0, 1.0), "off; Velodyne 0.002, Livox 0.001";
        /// Probability that a pulse is lost.
        dropout: f64 = 0.0, Real(0.0, 1.0), "off";
        /// Probability that a pulse that meets nothing gives a point all the same.
        false_alarm: f64 = 0.0, Real(0.0, 1.0), "off; Livox below 0.0001";
    }
}

section! {
    /// Errors of measured ranges (paper, V-B).
    Noise at "lidar.noise" {
        /// The model: no errors, the paper's, Laconte's bias, a spread by incidence, by range, or
        /// by signal-to-noise ratio with a threshold of detection.
        model: RangeNoiseModel = RangeNoiseModel::Paper, OneOf(RangeNoiseModel::WORDS),
            "paper, V-B; each model's source is named in the handbook";
        /// Standard deviation of `paper` and `laconte`.
        sigma_m: f64 = 0.02, Real(0.0, 1.0), "Livox wiki: Mid-40 at 20 m";
        /// The sensor whose bias `laconte` has.
        laconte_device: LaconteSensor = LaconteSensor::Hdl32e, OneOf(LaconteSensor::WORDS),
            "Laconte et al. 2019, in libpointmatcher";
        /// `laconte` by its closed form: within 2 % for narrow beams, and faster.
        laconte_closed: bool = false, Flag, "as published";
        /// `snr` sees this far …
        reference_range_m: f64 = 90.0, RealAbove(0.0, 10_000.0), "Livox wiki: 90 m at 10 %";
        /// … a target of this reflectance.
        reference_reflectance: f64 = 0.1, RealAbove(0.0, 1.0), "Livox wiki: 90 m at 10 %";
        /// Extinction of the air for `snr`: 3 / visibility.
        extinction_per_m: f64 = 0.0, Real(0.0, 1.0), "clear air";
        /// Spread of strong echoes for `snr`; the least one for `linear`; head-on at 20 m for
        /// `incidence`.
        floor_m: f64 = 0.007, Real(0.0, 1.0), "our choice: some millimetres";
        /// Spread that `snr` adds at its threshold.
        at_threshold_m: f64 = 0.09, Real(0.0, 1.0), "LISA (Kilic et al. 2021)";
        /// Spread that `linear` adds per metre of range.
        per_metre: f64 = 0.0006, Real(0.0, 1.0), "Hokuyo UTM-30LX, in libpointmatcher";
    }
}

section! {
    /// The robot: its path, and the interval of frames.
    Robot at "robot" {
        /// Distance between frames.
        spacing_m: f64 = 1.0, Real(0.0, 1000.0), "new views, overlapping";
        /// Time between frames; 0 to use the distance instead.
        spacing_s: f64 = 0.0, Real(0.0, 3600.0), "by metres";
        /// Speed, which gives times and the motion during a scan.
        speed_m_s: f64 = 1.0, RealAbove(0.0, 30.0), "walking pace";
        /// Start of the path, metres east.
        start_x_m: f64 = 0.0, Real(-1e8, 1e8), "the origin";
        /// Start of the path, metres north.
        start_y_m: f64 = 0.0, Real(-1e8, 1e8), "the origin";
        /// Heading of `straight` and of a wander, clockwise from north.
        heading_deg: f64 = 45.0, Real(-360.0, 360.0), "north-east";
        /// Distance between axles, over which the body's pitch follows the ground.
        wheelbase_m: f64 = 0.8, Real(0.1, 10.0), "a small tracked robot";
        /// Distance between tracks, over which the body's roll follows the ground.
        track_m: f64 = 0.6, Real(0.1, 10.0), "a small tracked robot";
        /// Clearance from stems and rocks on a wander.
        clearance_m: f64 = 0.8, Real(0.0, 10.0), "half the robot's width and a margin";
    }
    plus {
        /// The path.
        #[serde(flatten)]
        path: RobotPath;
    }
}

/// The path of the robot.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum RobotPath {
    /// Along the nearest trail, there and back.
    Trail(PathTrail),
    /// A smooth wander through the forest.
    Wander(PathWander),
    /// A straight line.
    Straight(PathStraight),
    /// A grid of fixed stations.
    Stations(PathStations),
    /// Poses from a file.
    File(PathFile),
}

encode_variants! { RobotPath
    Trail: "trail";
    Wander: "wander";
    Straight: "straight";
    Stations: "stations";
    File: "file";
}

impl Default for RobotPath {
    fn default() -> Self {
        Self::Trail(PathTrail::default())
    }
}

section! {
    /// A smooth wander that avoids stems and rocks.
    PathWander at "robot.wander", one of "the robot's path" {
        /// The greatest deviation from the line of its heading.
        amplitude_m: f64 = 8.0, Real(0.0, 30.0), "a few trees wide";
    }
}

section! {
    /// A straight line, which does not avoid anything.
    PathStraight at "robot.straight", one of "the robot's path" {}
}

section! {
    /// Fixed stations, as in terrestrial scanning: a grid around the start. Each station is level
    /// and still, and is moved to the nearest clear place.
    PathStations at "robot.stations", one of "the robot's path" {
        /// Stations from west to east.
        columns: u32 = 3, Whole(1, 1000), "a plot of 30 m";
        /// Stations from south to north.
        rows: u32 = 3, Whole(1, 1000), "a plot of 30 m";
        /// Distance between neighbouring stations.
        distance_m: f64 = 12.0, RealAbove(0.0, 1000.0), "10 to 15 m are usual";
    }
}

section! {
    /// Poses from a file; frame k takes pose k.
    PathFile at "robot.file", one of "the robot's path" {
        /// The file.
        path: InputPath = InputPath::default(), File(DATA), "none";
        /// Its format: TUM (`t x y z qx qy qz qw`) or KITTI (a 3 x 4 matrix), one pose on each
        /// line.
        format: PathFormat = PathFormat::Tum, OneOf(PathFormat::WORDS), "TUM contains times";
        /// Take height, pitch and roll from the ground instead of the file.
        on_ground: bool = true, Flag, "the file does not know this ground";
    }
}

section! {
    /// What is written.
    Output at "output" {
        /// The class table.
        ontology: String = "paper".into(), OneOf(&["paper", "fuel"]), "paper, V-A and VII";
        /// Write a PLY with every field of every point, besides `.bin` and `.label`.
        ply: bool = true, Flag, "true range, true id, time, normal and more";
        /// Write depth as float32 `.npy` instead of 16-bit PNG.
        depth_npy: bool = false, Flag, "every loader reads PNG, which is exact to 2 mm";
    }
}

/// Every section, in the order of the reference page.
pub const SECTIONS: &[SectionSpec] = &[
    Config::SPEC,
    Splits::SPEC,
    Chunks::SPEC,
    Site::SPEC,
    SiteStems::SPEC,
    SiteTerrain::SPEC,
    SiteTrails::SPEC,
    Terrain::SPEC,
    Trails::SPEC,
    TrailKinds::SPEC,
    TrailSection::SPEC,
    ForestRoad::SPEC,
    SkidTrail::SPEC,
    Firebreak::SPEC,
    Footpath::SPEC,
    DeerPath::SPEC,
    Placement::SPEC,
    PlacementRows::SPEC,
    PlacementGaps::SPEC,
    Regeneration::SPEC,
    Deadwood::SPEC,
    Climbers::SPEC,
    Undergrowth::SPEC,
    Floor::SPEC,
    Sward::SPEC,
    Thickets::SPEC,
    Assets::SPEC,
    Sun::SPEC,
    SunAngles::SPEC,
    SunDate::SPEC,
    Sky::SPEC,
    Weather::SPEC,
    Camera::SPEC,
    CameraFov::SPEC,
    CameraSensor::SPEC,
    CameraCalibration::SPEC,
    CameraPinhole::SPEC,
    CameraBrownConrady::SPEC,
    CameraFisheye::SPEC,
    CameraShutter::SPEC,
    CameraNoise::SPEC,
    CameraWhiteBalance::SPEC,
    CameraTone::SPEC,
    CameraVignetting::SPEC,
    CameraAberration::SPEC,
    CameraProcessing::SPEC,
    CameraSoiling::SPEC,
    FURTHER_CAMERAS,
    Lidar::SPEC,
    LidarLines::SPEC,
    LidarMid40::SPEC,
    LidarHorizon::SPEC,
    LidarMid70::SPEC,
    LidarAvia::SPEC,
    LidarSpinning::SPEC,
    LidarPanorama::SPEC,
    LidarTable::SPEC,
    LidarBeam::SPEC,
    LidarErrors::SPEC,
    Noise::SPEC,
    FURTHER_LIDARS,
    Robot::SPEC,
    PathTrail::SPEC,
    PathWander::SPEC,
    PathStraight::SPEC,
    PathStations::SPEC,
    PathFile::SPEC,
    Output::SPEC,
    super::vary::VARY,
    super::vary::RANGES,
];
