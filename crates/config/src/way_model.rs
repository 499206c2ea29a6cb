//! The kinds of way of a config.

use nemoral_scene::TrailSurfaceKind;
use nemoral_scene::glam::DVec2;
use nemoral_trails::{CrossSection, Ditch, Ruts, TrailParams, WayKind};

use super::{PathTrail, Trails, WAYS};

impl Trails {
    /// The number of machine tracks among the kinds of way, as which trails along given lines are
    /// built.
    pub const TRACK: usize = 1;

    /// The number of skid trails among them.
    pub const SKID_TRAIL: usize = 2;

    /// The parameters of the trails, whose kinds of way are in the order of their numbers.
    #[must_use]
    pub fn params(&self) -> TrailParams {
        let ways = [
            forest_road(self),
            track(self),
            skid_trail(self),
            firebreak(self),
            footpath(self),
            deer_path(self),
        ];
        TrailParams {
            spawn_probability: self.spawn_probability,
            forward_probability: self.forward_probability,
            max_length_chunks: self.max_length_chunks,
            fork_probability: self.forks,
            ways: ways.into_iter().zip(self.kinds.shares()).collect(),
        }
    }
}

impl PathTrail {
    /// The number of the kind of way that is searched among those of [`Trails::params`]; `None`
    /// for any.
    #[must_use]
    pub fn way_number(&self) -> Option<usize> {
        WAYS[1..].iter().position(|word| *word == self.way)
    }
}

fn track(t: &Trails) -> WayKind {
    let ruts = Ruts {
        depth_m: t.rut_depth_m,
        ..Ruts::default()
    };
    let section = &t.section;
    let curve = section.points().unwrap_or_default();
    let way = WayKind {
        width_m: t.width_m,
        section: CrossSection {
            max_grade: section.max_grade,
            smoothing_m: section.smoothing_m,
            crossfall: section.crossfall,
            crown: t.crown_m / (t.width_m / 2.0),
            // A narrow one has no wheel ruts.
            ruts: (t.width_m >= 2.0 && t.rut_depth_m > 0.0).then_some(ruts),
            curve: curve.into_iter().map(DVec2::from).collect(),
            ..built(t, CrossSection::default())
        },
        change: t.change,
        grass_max_per_chunk: t.grass_max,
        grass_spread_m: t.grass_spread_m,
        verge_tufts_per_m: t.verge_per_m,
        strip_cover: t.strip_cover,
        rocks_max_per_trail: t.rocks_max,
        ..WayKind::default()
    };
    match trail_surface(&t.surface) {
        Some(kind) => way.surfaced(kind),
        None => way,
    }
}

fn forest_road(t: &Trails) -> WayKind {
    let way = WayKind::forest_road();
    let road = &t.forest_road;
    let ditch = Ditch {
        depth_m: road.ditch_depth_m.max(0.05),
        width_m: road.ditch_width_m,
    };
    let section = CrossSection {
        crown: road.camber,
        ditch: (road.ditch_depth_m >= 0.05).then_some(ditch),
        ..built(t, way.section.clone())
    };
    // Its gravel was brought, whatever the ground is.
    let stone_beds = if section.ditch.is_some() {
        road.stone_beds
    } else {
        0.0
    };
    let way = WayKind {
        section,
        stone_beds,
        culvert_spacing_m: road.culvert_spacing_m,
        turning_radius_m: road.turning_radius_m,
        ..way
    };
    dressed(t, road.width_m, way)
}

fn skid_trail(t: &Trails) -> WayKind {
    let way = WayKind::skid_trail();
    let trail = &t.skid_trail;
    let ruts = way.section.ruts.map(|ruts| Ruts {
        depth_m: trail.rut_depth_m,
        // On a narrow one, smaller machines drive.
        gauge_m: ruts.gauge_m.min(trail.width_m - 1.4),
        ..ruts
    });
    let section = CrossSection {
        ruts: ruts.filter(|r| r.depth_m > 0.0),
        ..built(t, way.section.clone())
    };
    local(t, dressed(t, trail.width_m, WayKind { section, ..way }))
}

fn firebreak(t: &Trails) -> WayKind {
    let width_m = t.firebreak.width_m;
    let mut way = WayKind::firebreak();
    // What was scraped lies along the edges, and the sward between.
    let inward = 0.5 * (width_m - way.width_m);
    for point in &mut way.section.curve {
        point.x += inward * point.x.signum();
    }
    way.grass_spread_m += inward;
    local(t, dressed(t, width_m, way))
}

fn footpath(t: &Trails) -> WayKind {
    let path = &t.footpath;
    let mut way = WayKind::footpath();
    way.width_variation = path.width_variation;
    way.section.sink_m = path.sink_m;
    way.section.hollow_m = path.hollow_m;
    way.roots_per_m = path.roots_per_m;
    way.steps_from_grade = path.steps_from_grade;
    local(t, dressed(t, path.width_m, way))
}

fn deer_path(t: &Trails) -> WayKind {
    local(t, dressed(t, t.deer_path.width_m, WayKind::deer_path()))
}

/// A section with the slopes and the earth to move of the config, which built ways share.
fn built(t: &Trails, section: CrossSection) -> CrossSection {
    CrossSection {
        cut_ratio: t.section.cut_ratio,
        fill_ratio: t.section.fill_ratio,
        earth_m: t.section.earth_m,
        ..section
    }
}

/// The most stones on one way, whatever the config asks for: each has an id.
const STONES_MAX: u32 = 120;

/// A way of some width with as much grass and as many stones, relative to the usual, as the tracks
/// of the config have.
fn dressed(t: &Trails, width_m: f64, way: WayKind) -> WayKind {
    let usual = Trails::default();
    let times = |n: u32, wanted: u32, usual: u32| {
        (f64::from(n) * f64::from(wanted) / f64::from(usual)).round() as u32
    };
    WayKind {
        width_m,
        change: t.change,
        grass_max_per_chunk: times(way.grass_max_per_chunk, t.grass_max, usual.grass_max),
        strip_cover: (way.strip_cover * t.strip_cover / usual.strip_cover).min(1.0),
        verge_tufts_per_m: (way.verge_tufts_per_m * t.verge_per_m / usual.verge_per_m).min(20.0),
        rocks_max_per_trail: times(way.rocks_max_per_trail, t.rocks_max, usual.rocks_max)
            .min(STONES_MAX.max(t.rocks_max)),
        ..way
    }
}

/// A way on the ground as it is: where the config names the surface of trails, that takes the place
/// of all others but mud and grass.
fn local(t: &Trails, mut way: WayKind) -> WayKind {
    let Some(kind) = trail_surface(&t.surface) else {
        return way;
    };
    let mut rest = 0.0;
    for other in TrailSurfaceKind::ALL {
        let weight = &mut way.surfaces[other.index()];
        if other != kind && !matches!(other, TrailSurfaceKind::Mud | TrailSurfaceKind::Grassy) {
            rest += std::mem::take(weight);
        }
    }
    way.surfaces[kind.index()] += rest;
    way
}

/// The only surface of tracks by its name; `None` if it varies.
fn trail_surface(name: &str) -> Option<TrailSurfaceKind> {
    let mut all = TrailSurfaceKind::ALL.into_iter();
    all.find(|kind| kind.name() == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Preset;

    #[test]
    fn presets_have_the_ways_that_they_say() {
        for preset in Preset::ALL {
            let trails = preset.config().trails;
            let params = trails.params();
            assert_eq!(params.ways.len() + 1, WAYS.len());
            let kinds = params.ways.iter().filter(|w| w.1 > 0.0).count();
            let as_the_paper = ["low", "medium", "high", "demo"].contains(&preset.name);
            assert_eq!(kinds, if as_the_paper { 1 } else { 6 }, "{}", preset.name);
            if as_the_paper {
                // The paper's trails are all of one kind, which does not change along its run.
                assert_eq!(trails.change, 0.0);
            }
        }
        assert_eq!(WAYS[1 + Trails::TRACK], "track");
        assert_eq!(WAYS[1 + Trails::SKID_TRAIL], "skid_trail");
    }

    #[test]
    fn the_section_of_the_config_is_that_of_tracks_and_slopes_are_all_built_ways() {
        let mut trails = Trails::default();
        trails.section.cut_ratio = 0.7;
        trails.section.max_grade = 0.31;
        trails.section.earth_m = 7.0;
        trails.section.curve = "-1 0.2, 1 0".to_owned();
        let ways = trails.params().ways;
        for (way, _) in &ways[..=Trails::SKID_TRAIL] {
            assert_eq!((way.section.cut_ratio, way.section.earth_m), (0.7, 7.0));
        }
        let track = &ways[Trails::TRACK].0.section;
        assert_eq!((track.max_grade, track.curve.len()), (0.31, 2));
        assert_ne!(ways[0].0.section.max_grade, 0.31);
        // A firebreak's ridges stay at its edges.
        trails.firebreak.width_m = 5.0;
        let firebreak = &trails.params().ways[3].0;
        let ends = [0, 3].map(|i| firebreak.section.curve[i].x);
        assert_eq!(ends, [-2.5, 2.5]);
    }
}
