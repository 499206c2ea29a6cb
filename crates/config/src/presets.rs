//! Named requests.

use super::{
    Climbers, Config, Deadwood, GroundEffects, Litter, Sward, Thickets, TrailKinds, Water, stands,
};

/// A named request.
#[derive(Clone, Copy, Debug)]
pub struct Preset {
    /// Its name.
    pub name: &'static str,
    /// What it is for.
    pub doc: &'static str,
    change: fn(&mut Config),
}

impl Preset {
    /// Every preset.
    pub const ALL: &'static [Self] = &[
        Self {
            name: "default",
            doc: "a start: medium density, trees to 300 m, rectangular scan pattern",
            change: |_| {},
        },
        Self {
            name: "low",
            doc: "the paper's experiment: 31 trees per chunk, everything to 100 m",
            change: |c| paper(c, 31.0),
        },
        Self {
            name: "medium",
            doc: "the paper's experiment: 96 trees per chunk, everything to 100 m",
            change: |c| paper(c, 96.0),
        },
        Self {
            name: "high",
            doc: "the paper's experiment: 210 trees per chunk, everything to 100 m",
            change: |c| paper(c, 210.0),
        },
        Self {
            name: "maritime-pine",
            doc: "Pinus pinaster on coastal sand, 400 trees/ha, 45 years: gorse and heather, \
                bracken, needles, sandy tracks",
            change: stands::maritime_pine,
        },
        Self {
            name: "eucalyptus-plantation",
            doc: "Eucalyptus globulus in rows of 3 x 3 m, 940 trees/ha of 1111 planted: bark \
                and leaves on the ground, little else",
            change: stands::eucalyptus_plantation,
        },
        Self {
            name: "oak-mixed",
            doc: "Quercus robur with beech, birch and pine, 200 trees/ha of all ages: gaps, \
                regeneration, bramble and fern",
            change: stands::oak_mixed,
        },
        Self {
            name: "beech",
            doc: "Fagus sylvatica high forest, 240 trees/ha: a hall of grey stems over dead \
                leaves, young beeches in gaps",
            change: stands::beech,
        },
        Self {
            name: "spruce",
            doc: "Picea abies, managed, 580 trees/ha: dark, with needles, moss and stumps",
            change: stands::spruce,
        },
        Self {
            name: "boreal-birch-pine",
            doc: "Pinus sylvestris and Betula pendula with spruce, 900 thin trees/ha: dwarf \
                shrubs, moss, boulders",
            change: stands::boreal_birch_pine,
        },
        Self {
            name: "montado",
            doc: "Quercus suber over pasture, 60 trees/ha: wide crowns, grass, hardly a shrub",
            change: stands::montado,
        },
        Self {
            name: "glade",
            doc: "a meadow with its edges: groups of Quercus robur and Betula pendula, grass of \
                all kinds, shrubs, saplings",
            change: stands::glade,
        },
        Self {
            name: "meadow-edge",
            doc: "an oak wood that ends at meadows: a mantle of shrubs and young trees, a fringe \
                of tall herbs, grass in flower",
            change: stands::meadow_edge,
        },
        Self {
            name: "rank-clearing",
            doc: "clearings in a wood some years after felling: stumps, brambles, bracken, \
                nettles, tall grass, young growth like a wall",
            change: stands::rank_clearing,
        },
        Self {
            name: "stream-valley",
            doc: "Quercus robur, Betula pendula and Picea abies along streams that run to ponds: \
                cobbles, ferns, tussocks, moss",
            change: stands::stream_valley,
        },
        Self {
            name: "demo",
            doc: "tiny and quick, for tests",
            change: demo,
        },
    ];

    /// Their names.
    pub(super) const NAMES: &'static [&'static str] = &{
        let mut names = [""; Self::ALL.len()];
        let mut i = 0;
        while i < names.len() {
            names[i] = Self::ALL[i].name;
            i += 1;
        }
        names
    };

    /// The preset of this name.
    #[must_use]
    pub fn by_name(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|p| p.name == name).copied()
    }

    /// Its config.
    #[must_use]
    pub fn config(&self) -> Config {
        let mut config = Config::default();
        (self.change)(&mut config);
        config
    }
}

/// Section VI: visible radius 100 m, 1280 x 720, 50,000 points. Its timings are of drafts.
fn paper(config: &mut Config, trees: f64) {
    config.placement.trees = trees;
    config.chunks.visible_radius_m = 100.0;
    config.chunks.undergrowth_radius_m = 100.0;
    config.chunks.delete_radius_m = 200.0;
    config.camera.edge_samples = 1;
    config.water = Water::none();
    config.undergrowth.ground = GroundEffects::none();
    config.undergrowth.surface_roots = 0.0;
    config.litter = Litter::none();
    config.climbers = Climbers {
        ivy: config.climbers.ivy,
        moss: config.climbers.moss,
        ..Climbers::none()
    };
    one_kind_of_way(config);
}

/// All trails are tracks that change along their run in stretches, with smooth banks and with
/// nothing but tufts on their strips.
fn one_kind_of_way(config: &mut Config) {
    config.trails.kinds = TrailKinds::tracks_only();
    config.trails.change = 0.0;
    config.trails.forks = 0.0;
    config.trails.banks = 0.0;
    config.trails.strip_cover = 0.0;
}

fn demo(config: &mut Config) {
    one_kind_of_way(config);
    config.water = Water::none();
    config.undergrowth.ground = GroundEffects::none();
    config.undergrowth.surface_roots = 0.0;
    config.litter = Litter::none();
    config.deadwood = Deadwood {
        volume_m3_ha: 0.0,
        thrown_per_ha: 0.0,
        branches: 0.0,
        ..Deadwood::default()
    };
    config.climbers = Climbers::none();
    config.undergrowth.sward = Sward {
        cover: 0.0,
        ..Sward::default()
    };
    config.undergrowth.thickets = Thickets {
        bramble: 0.0,
        bracken: 0.0,
        heath: 0.0,
        bilberry: 0.0,
        nettles: 0.0,
        reeds: 0.0,
    };
    config.frames = 2;
    config.chunks.visible_radius_m = 40.0;
    config.chunks.undergrowth_radius_m = 20.0;
    config.chunks.delete_radius_m = 120.0;
    config.assets.individuals = 1;
    config.camera.width_px = 160;
    config.camera.height_px = 96;
    config.camera.edge_samples = 1;
    config.lidar.pulses = 3000;
}
