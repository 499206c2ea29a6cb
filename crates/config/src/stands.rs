//! Recipes of stands, in a forester's terms.
//!
//! Numbers per hectare, spacing and diameters lie in the ranges that are given with each recipe,
//! which are usual in European forestry. The values within these ranges are our choice, and so are
//! numbers without a range (saplings, stumps, shrubs, Weibull shapes). A chunk of 50 m is a quarter
//! of a hectare.

use super::choices::VARIED_SURFACES;
use super::{
    Assets, Climbers, Config, Deadwood, Floor, Meadows, PathWander, RobotPath, Sward, Thickets,
    Water,
};

/// Removes all species, as each recipe names its own.
fn bare(config: &mut Config) -> &mut Assets {
    let a = &mut config.assets;
    a.maritime_pine = 0.0;
    a.eucalyptus = 0.0;
    a.english_oak = 0.0;
    a
}

/// Volume, mean stage of decay, thrown trees and branches.
fn deadwood([volume_m3_ha, decay, thrown_per_ha, branches]: [f64; 4]) -> Deadwood {
    Deadwood {
        volume_m3_ha,
        decay,
        thrown_per_ha,
        branches,
        ..Deadwood::default()
    }
}

/// The shares of trees with ivy, the density of moss, the shares of trees with honeysuckle and with
/// clematis, and of conifers with resin.
fn climbers([ivy, moss, honeysuckle, clematis, resin]: [f64; 5]) -> Climbers {
    Climbers {
        ivy,
        moss,
        honeysuckle,
        clematis,
        resin,
        ..Climbers::default()
    }
}

fn per_hectare(config: &Config, number: f64) -> f64 {
    number * config.chunks.size_m * config.chunks.size_m / 10_000.0
}

fn floor(leaf_litter: f64, needle_litter: f64, moss: f64) -> Floor {
    Floor {
        leaf_litter,
        needle_litter,
        moss,
    }
}

/// The share of the ground under grass in the light, and the weights of tall, grazed, clumped, dry
/// and lodged grass.
fn sward(cover: f64, [rank, grazed, tussocks, dry, lodged]: [f64; 5]) -> Sward {
    Sward {
        cover,
        rank,
        grazed,
        tussocks,
        dry,
        lodged,
    }
}

/// The shares of brambles, bracken, heather, bilberry and nettles.
fn thickets([bramble, bracken, heath, bilberry, nettles]: [f64; 5]) -> Thickets {
    Thickets {
        bramble,
        bracken,
        heath,
        bilberry,
        nettles,
        ..Thickets::default()
    }
}

/// Pinus pinaster, 250-700/ha at 40-60 years, on dunes, with gorse and heather.
pub(super) fn maritime_pine(c: &mut Config) {
    let a = bare(c);
    a.maritime_pine = 1.0;
    (a.dbh_mean_m, a.dbh_shape, a.dbh_min_m, a.dbh_max_m) = (0.27, 3.2, 0.12, 0.50);
    (a.gorse, a.heather, a.bramble) = (0.7, 1.0, 0.15);
    a.snags = 0.02;
    c.placement.trees = per_hectare(c, 400.0);
    c.placement.stumps = per_hectare(c, 60.0);
    c.placement.shrubs = per_hectare(c, 560.0);
    (c.placement.rocks_min, c.placement.rocks_max) = (0, 2);
    c.placement.gaps.share = 0.06;
    c.placement.regeneration.saplings = per_hectare(c, 100.0);
    c.placement.regeneration.seedlings = 0.5;
    c.terrain.max_height_m = 12.0;
    c.terrain.scale_m = 110.0;
    c.undergrowth.cover = 0.75;
    (
        c.undergrowth.grass,
        c.undergrowth.herbs,
        c.undergrowth.ferns,
    ) = (0.5, 0.1, 0.7);
    c.undergrowth.floor = floor(0.05, 0.85, 0.1);
    c.undergrowth.sward = sward(0.15, [0.3, 0.2, 0.6, 1.0, 0.2]);
    c.undergrowth.thickets = thickets([0.04, 0.22, 0.26, 0.0, 0.0]);
    c.trails.surface = "sand".to_owned();
    c.trails.rocks_max = 2;
    c.deadwood = deadwood([5.0, 2.5, 1.0, 4.0]);
    c.climbers = climbers([0.01, 0.1, 0.03, 0.0, 0.3]);
}

/// Eucalyptus globulus in rows of 3 x 3 m, 1111/ha planted, of which 15 % died or were thinned. The
/// trees are slender, with H/D of 90-120.
pub(super) fn eucalyptus_plantation(c: &mut Config) {
    let a = bare(c);
    a.eucalyptus = 1.0;
    (a.dbh_mean_m, a.dbh_shape, a.dbh_min_m, a.dbh_max_m) = (0.16, 4.0, 0.08, 0.30);
    (a.gorse, a.heather, a.bramble) = (0.6, 0.6, 0.5);
    a.snags = 0.015;
    c.placement.trees = per_hectare(c, 940.0);
    c.placement.rows.spacing_m = 3.0;
    c.placement.rows.in_row_m = 3.0;
    c.placement.stumps = per_hectare(c, 30.0);
    c.placement.regeneration.seedlings = 0.0;
    c.placement.shrubs = per_hectare(c, 160.0);
    (c.placement.rocks_min, c.placement.rocks_max) = (0, 6);
    c.terrain.max_height_m = 40.0;
    c.terrain.scale_m = 170.0;
    c.undergrowth.cover = 0.45;
    c.undergrowth.litter = 0.4;
    (
        c.undergrowth.grass,
        c.undergrowth.herbs,
        c.undergrowth.ferns,
    ) = (0.6, 0.3, 0.4);
    c.litter.wood = 1.4;
    c.undergrowth.floor = floor(0.95, 0.0, 0.05);
    c.undergrowth.sward = sward(0.22, [0.6, 0.2, 0.3, 1.0, 0.4]);
    c.undergrowth.thickets = thickets([0.12, 0.12, 0.10, 0.0, 0.01]);
    c.trails.surface = "dry_earth".to_owned();
    c.trails.width_m = 3.2;
    c.deadwood = deadwood([4.0, 2.2, 0.5, 9.0]);
    c.climbers = climbers([0.02, 0.15, 0.03, 0.0, 0.0]);
}

/// The main species has 60-80 %, with nearly all ages: a Weibull shape of 1.7 (1 to 1.5 is fully
/// uneven-aged); saplings 100-2000/ha. There are so few trees because the crowns are as wide as
/// those of trees in the open, and more of them would exceed an LAI of 5.5.
pub(super) fn oak_mixed(c: &mut Config) {
    let a = bare(c);
    a.english_oak = 0.65;
    a.beech = 0.15;
    a.silver_birch = 0.14;
    a.scots_pine = 0.06;
    (a.dbh_mean_m, a.dbh_shape, a.dbh_min_m, a.dbh_max_m) = (0.28, 1.7, 0.08, 0.75);
    (a.gorse, a.heather, a.bramble) = (0.0, 0.05, 1.0);
    a.snags = 0.04;
    c.placement.trees = per_hectare(c, 200.0);
    c.placement.stumps = per_hectare(c, 40.0);
    c.placement.shrubs = per_hectare(c, 240.0);
    c.placement.hard_core = 0.4;
    c.placement.gaps.share = 0.08;
    c.placement.regeneration.saplings = per_hectare(c, 320.0);
    c.placement.regeneration.seedlings = 1.2;
    (c.placement.rocks_min, c.placement.rocks_max) = (0, 8);
    c.undergrowth.cover = 0.8;
    c.undergrowth.litter = 0.2;
    (
        c.undergrowth.grass,
        c.undergrowth.herbs,
        c.undergrowth.ferns,
    ) = (0.35, 0.5, 0.6);
    c.undergrowth.floor = floor(0.75, 0.0, 0.25);
    c.undergrowth.sward = sward(0.40, [1.0, 0.4, 0.6, 0.2, 0.5]);
    c.undergrowth.thickets = thickets([0.18, 0.12, 0.0, 0.06, 0.08]);
    c.trails.surface = "leaf_litter".to_owned();
    c.deadwood = deadwood([12.0, 3.0, 1.5, 4.0]);
    c.climbers = climbers([0.18, 0.9, 0.12, 0.03, 0.1]);
}

/// Beech 200-600/ha, LAI 5-7. The cover of undergrowth is about exp(-LAI/2), so there is little but
/// dead leaves.
pub(super) fn beech(c: &mut Config) {
    let a = bare(c);
    a.beech = 0.96;
    a.english_oak = 0.04;
    (a.dbh_mean_m, a.dbh_shape, a.dbh_min_m, a.dbh_max_m) = (0.34, 2.4, 0.10, 0.65);
    (a.gorse, a.heather, a.bramble) = (0.0, 0.0, 1.0);
    a.snags = 0.02;
    c.placement.trees = per_hectare(c, 240.0);
    c.placement.stumps = per_hectare(c, 35.0);
    c.placement.shrubs = per_hectare(c, 12.0);
    c.placement.hard_core = 0.45;
    c.placement.gaps.share = 0.05;
    c.placement.gaps.saplings = 10.0;
    c.placement.regeneration.saplings = per_hectare(c, 240.0);
    c.placement.regeneration.seedlings = 2.0;
    c.placement.regeneration.share = 0.12;
    (c.placement.rocks_min, c.placement.rocks_max) = (0, 8);
    c.terrain.max_height_m = 30.0;
    c.terrain.scale_m = 190.0;
    c.undergrowth.cover = 0.22;
    c.undergrowth.litter = 0.35;
    (
        c.undergrowth.grass,
        c.undergrowth.herbs,
        c.undergrowth.ferns,
    ) = (0.3, 0.7, 0.2);
    c.litter.leaves = 1.3;
    c.undergrowth.floor = floor(0.96, 0.0, 0.04);
    c.undergrowth.sward = sward(0.30, [0.8, 0.5, 0.5, 0.1, 0.4]);
    c.undergrowth.thickets = thickets([0.20, 0.08, 0.0, 0.04, 0.06]);
    c.trails.surface = "leaf_litter".to_owned();
    c.deadwood = deadwood([10.0, 2.8, 1.0, 5.0]);
    c.climbers = climbers([0.05, 0.6, 0.02, 0.0, 0.0]);
}

/// Spruce 400-1200/ha, LAI 4-8; there are a quarter as many stumps (10-60 % in managed stands).
pub(super) fn spruce(c: &mut Config) {
    let a = bare(c);
    a.norway_spruce = 0.97;
    a.silver_birch = 0.03;
    (a.dbh_mean_m, a.dbh_shape, a.dbh_min_m, a.dbh_max_m) = (0.26, 3.0, 0.10, 0.55);
    (a.gorse, a.heather, a.bramble) = (0.0, 0.3, 1.0);
    a.snags = 0.04;
    c.placement.trees = per_hectare(c, 580.0);
    c.placement.stumps = per_hectare(c, 140.0);
    c.placement.shrubs = per_hectare(c, 20.0);
    c.placement.gaps.share = 0.05;
    c.placement.regeneration.saplings = per_hectare(c, 100.0);
    c.placement.regeneration.seedlings = 1.5;
    (c.placement.rocks_min, c.placement.rocks_max) = (2, 16);
    c.terrain.max_height_m = 20.0;
    c.terrain.scale_m = 170.0;
    c.undergrowth.cover = 0.25;
    c.undergrowth.litter = 0.35;
    (
        c.undergrowth.grass,
        c.undergrowth.herbs,
        c.undergrowth.ferns,
    ) = (0.25, 0.25, 0.8);
    c.undergrowth.floor = floor(0.0, 0.62, 0.38);
    c.undergrowth.sward = sward(0.30, [0.6, 0.4, 1.0, 0.2, 0.4]);
    c.undergrowth.thickets = thickets([0.12, 0.06, 0.0, 0.32, 0.04]);
    c.trails.surface = "needles".to_owned();
    c.deadwood = deadwood([11.0, 2.8, 2.5, 6.0]);
    c.climbers = climbers([0.01, 0.5, 0.0, 0.0, 0.2]);
}

/// Birch 500-1500/ha, mixed with pine; heather stands for the dwarf shrubs; boulders up to 300/ha.
pub(super) fn boreal_birch_pine(c: &mut Config) {
    let a = bare(c);
    a.scots_pine = 0.47;
    a.silver_birch = 0.43;
    a.norway_spruce = 0.10;
    (a.dbh_mean_m, a.dbh_shape, a.dbh_min_m, a.dbh_max_m) = (0.16, 2.2, 0.08, 0.38);
    (a.gorse, a.heather, a.bramble) = (0.0, 1.0, 0.0);
    a.snags = 0.04;
    c.placement.trees = per_hectare(c, 900.0);
    c.placement.stumps = per_hectare(c, 60.0);
    c.placement.shrubs = per_hectare(c, 560.0);
    c.placement.hard_core = 0.45;
    c.placement.gaps.share = 0.08;
    c.placement.regeneration.saplings = per_hectare(c, 200.0);
    c.placement.regeneration.seedlings = 0.6;
    (c.placement.rocks_min, c.placement.rocks_max) = (8, 50);
    c.terrain.max_height_m = 9.0;
    c.terrain.scale_m = 90.0;
    c.undergrowth.cover = 0.8;
    (
        c.undergrowth.grass,
        c.undergrowth.herbs,
        c.undergrowth.ferns,
    ) = (0.5, 0.6, 0.15);
    c.litter.leaves = 0.7;
    c.undergrowth.floor = floor(0.12, 0.28, 0.6);
    c.undergrowth.sward = sward(0.12, [0.4, 0.3, 0.8, 0.3, 0.3]);
    c.undergrowth.thickets = thickets([0.0, 0.05, 0.18, 0.45, 0.0]);
    c.trails.surface = "dry_earth".to_owned();
    c.trails.width_m = 2.2;
    c.deadwood = deadwood([8.0, 3.2, 2.0, 4.0]);
    c.climbers = climbers([0.0, 0.3, 0.0, 0.0, 0.12]);
}

/// Montado with 40-120 trees/ha, LAI 0.5-2, over pasture on gentle hills.
pub(super) fn montado(c: &mut Config) {
    // There are hardly any trees beside its paths.
    c.trails.footpath.roots_per_m = 0.0;
    let a = bare(c);
    a.cork_oak = 1.0;
    (a.dbh_mean_m, a.dbh_shape, a.dbh_min_m, a.dbh_max_m) = (0.42, 2.6, 0.18, 0.90);
    (a.gorse, a.heather, a.bramble) = (0.6, 0.6, 0.2);
    a.snags = 0.01;
    c.placement.trees = per_hectare(c, 60.0);
    c.placement.stumps = per_hectare(c, 4.0);
    c.placement.shrubs = per_hectare(c, 40.0);
    c.placement.regeneration.saplings = per_hectare(c, 8.0);
    c.placement.regeneration.seedlings = 0.1;
    (c.placement.rocks_min, c.placement.rocks_max) = (0, 8);
    c.terrain.max_height_m = 18.0;
    c.terrain.scale_m = 200.0;
    c.undergrowth.cell_m = 0.95;
    c.undergrowth.cover = 1.0;
    c.undergrowth.litter = 0.03;
    (
        c.undergrowth.grass,
        c.undergrowth.herbs,
        c.undergrowth.ferns,
    ) = (1.0, 0.25, 0.0);
    c.undergrowth.floor = floor(0.15, 0.0, 0.85);
    c.undergrowth.sward = sward(1.0, [0.5, 1.0, 0.3, 0.9, 0.5]);
    c.undergrowth.thickets = thickets([0.01, 0.0, 0.01, 0.0, 0.02]);
    c.trails.surface = "sand".to_owned();
    c.deadwood = deadwood([1.0, 2.4, 0.0, 0.8]);
    c.climbers = climbers([0.02, 0.2, 0.01, 0.0, 0.0]);
}

/// A glade: two fifths of the ground without trees, as far as gaps reach, under grass that is
/// grazed, cut late or not at all. Shrubs and saplings are densest at its edges and in its gaps.
pub(super) fn glade(c: &mut Config) {
    oak_mixed(c);
    // There are hardly any trees beside its paths.
    c.trails.footpath.roots_per_m = 0.0;
    let a = bare(c);
    (a.english_oak, a.beech, a.silver_birch, a.scots_pine) = (0.6, 0.0, 0.4, 0.0);
    (a.gorse, a.heather, a.bramble) = (0.15, 0.1, 1.0);
    c.placement.trees = per_hectare(c, 90.0);
    c.placement.stumps = per_hectare(c, 8.0);
    c.placement.shrubs = per_hectare(c, 160.0);
    c.placement.gaps.share = 0.42;
    (c.placement.gaps.radius_min_m, c.placement.gaps.radius_max_m) = (8.0, 10.0);
    c.placement.gaps.shrubs = 0.5;
    c.placement.gaps.saplings = 0.5;
    c.placement.regeneration.saplings = per_hectare(c, 260.0);
    c.placement.regeneration.seedlings = 0.4;
    c.undergrowth.litter = 0.05;
    c.undergrowth.floor = floor(0.4, 0.0, 0.6);
    c.undergrowth.sward = sward(0.95, [1.0, 0.7, 0.5, 0.5, 0.6]);
    c.undergrowth.thickets = thickets([0.08, 0.05, 0.0, 0.0, 0.05]);
    c.trails.surface = "grassy".to_owned();
    c.deadwood = deadwood([4.0, 3.0, 0.5, 2.0]);
    c.climbers = climbers([0.1, 0.4, 0.1, 0.06, 0.1]);
}

/// The edge of an oak wood towards meadows that are cut late: the wood ends in a mantle of
/// brambles, gorse and young trees, and that in a fringe of nettles and bracken.
pub(super) fn meadow_edge(c: &mut Config) {
    oak_mixed(c);
    let a = &mut c.assets;
    (a.gorse, a.heather, a.bramble) = (0.25, 0.0, 1.0);
    c.placement.trees = per_hectare(c, 220.0);
    c.placement.shrubs = per_hectare(c, 150.0);
    c.placement.gaps.share = 0.04;
    c.placement.meadows = Meadows {
        share: 0.5,
        scale_m: 260.0,
        mantle_m: 9.0,
        mantle_shrubs: 7.0,
        mantle_saplings: 20.0,
        ..Meadows::default()
    };
    c.placement.regeneration.saplings = per_hectare(c, 160.0);
    c.placement.regeneration.share = 0.8;
    (
        c.placement.regeneration.radius_min_m,
        c.placement.regeneration.radius_max_m,
    ) = (1.5, 4.0);
    c.terrain.scale_m = 190.0;
    c.terrain.max_height_m = 18.0;
    c.undergrowth.sward = sward(0.5, [1.0, 0.15, 0.25, 0.5, 0.45]);
    c.undergrowth.thickets = thickets([0.3, 0.14, 0.0, 0.02, 0.16]);
    c.climbers.clematis = 0.1;
    c.trails.surface = "grassy".to_owned();
    c.deadwood = deadwood([10.0, 3.0, 1.0, 4.0]);
    // In the meadow, along the edge, in the world of the seed that it comes with.
    (c.robot.start_x_m, c.robot.start_y_m, c.robot.heading_deg) = (92.0, 40.0, 300.0);
    c.robot.path = RobotPath::Wander(PathWander::default());
}

/// Clearings some years after felling, in a wood: a stump for each tree that was felled, and what
/// comes first, over a robot's head in places.
pub(super) fn rank_clearing(c: &mut Config) {
    oak_mixed(c);
    c.placement.trees = per_hectare(c, 220.0);
    c.placement.stumps = per_hectare(c, 40.0);
    c.placement.shrubs = per_hectare(c, 130.0);
    c.placement.gaps.share = 0.0;
    c.placement.meadows = Meadows {
        share: 0.5,
        scale_m: 130.0,
        mantle_m: 4.0,
        mantle_shrubs: 4.0,
        mantle_saplings: 11.0,
        open_shrubs: 1.5,
        open_saplings: 11.0,
        open_stumps: 4.5,
        kept: 0.0,
        // What stands around was within the wood until lately.
        edge_trees: 0.1,
        ..Meadows::default()
    };
    c.placement.regeneration.saplings = per_hectare(c, 160.0);
    c.placement.regeneration.share = 0.6;
    (
        c.placement.regeneration.radius_min_m,
        c.placement.regeneration.radius_max_m,
    ) = (1.5, 3.5);
    c.placement.regeneration.seedlings = 1.0;
    c.undergrowth.litter = 0.1;
    c.undergrowth.sward = sward(0.6, [1.0, 0.0, 0.5, 0.3, 0.8]);
    c.undergrowth.thickets = thickets([0.34, 0.24, 0.0, 0.0, 0.14]);
    c.climbers.clematis = 0.06;
    c.deadwood = deadwood([9.0, 2.6, 1.0, 9.0]);
    // In a clearing, towards the wood, in the world of the seed that it comes with.
    (c.robot.start_x_m, c.robot.start_y_m, c.robot.heading_deg) = (62.0, 2.0, 285.0);
    c.robot.path = RobotPath::Wander(PathWander::default());
}

/// A stand along streams, on moist ground between wide hills: oak and birch with spruce, as in
/// riparian forests of the hills (alder is not among the species), ferns and tussocks, boulders.
pub(super) fn stream_valley(c: &mut Config) {
    oak_mixed(c);
    let a = bare(c);
    (a.english_oak, a.silver_birch, a.norway_spruce) = (0.5, 0.3, 0.2);
    (a.gorse, a.heather, a.bramble) = (0.0, 0.0, 1.0);
    c.placement.trees = per_hectare(c, 260.0);
    c.placement.shrubs = per_hectare(c, 120.0);
    c.placement.gaps.share = 0.1;
    (c.placement.rocks_min, c.placement.rocks_max) = (6, 30);
    // Wide valleys, with little between them to keep water from running down.
    c.terrain.scale_m = 240.0;
    c.terrain.max_height_m = 34.0;
    c.terrain.persistence = 0.24;
    c.water = Water {
        springs_per_km2: 95.0,
        stream_width_m: 1.3,
        ponds: 0.3,
        puddles: 1.0,
        ..Water::default()
    };
    c.undergrowth.floor = floor(0.5, 0.1, 0.4);
    (
        c.undergrowth.grass,
        c.undergrowth.herbs,
        c.undergrowth.ferns,
    ) = (0.4, 0.6, 0.9);
    c.undergrowth.sward = sward(0.35, [0.9, 0.1, 1.0, 0.1, 0.5]);
    c.undergrowth.thickets = thickets([0.12, 0.08, 0.0, 0.1, 0.12]);
    c.trails.surface = VARIED_SURFACES.to_owned();
    c.deadwood = deadwood([14.0, 3.2, 2.0, 5.0]);
    c.climbers = climbers([0.1, 1.4, 0.1, 0.06, 0.1]);
    // By a stream and a pond, in the world of the seed that it comes with.
    (c.robot.start_x_m, c.robot.start_y_m, c.robot.heading_deg) = (39.0, 60.0, 2.0);
    c.robot.path = RobotPath::Wander(PathWander::default());
}
