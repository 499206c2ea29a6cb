//! What the ways of a config ask for.

use nemoral_scene::TrailSurfaceKind;
use nemoral_trails::WayKind;

use crate::config;

/// The surfaces of a config's trails, each once.
pub(crate) fn surfaces(t: &config::Trails) -> Vec<TrailSurfaceKind> {
    let ways = t.params().ways.into_iter().enumerate();
    // Trails along given lines are tracks.
    let is_built = |number: usize, share: f64| share > 0.0 || number == config::Trails::TRACK;
    let built = ways.filter(|(number, (_, share))| is_built(*number, *share));
    let built: Vec<WayKind> = built.map(|(_, (way, _))| way).collect();
    let has = |kind: &TrailSurfaceKind| built.iter().any(|w| w.surfaces[kind.index()] > 0.0);
    TrailSurfaceKind::ALL.into_iter().filter(has).collect()
}

/// Whether roots lie across any of a config's trails, stones beside them, or either in their banks.
pub(crate) fn has_wayside(t: &config::Trails) -> bool {
    let mut ways = t.params().ways.into_iter();
    t.enabled
        && (t.banks > 0.0
            || ways.any(|(w, share)| {
                share > 0.0
                    && w.roots_per_m + w.stone_beds + w.steps_from_grade + w.culvert_spacing_m > 0.0
            }))
}

/// Share of skid trails that is covered with brash, where there are any.
pub(crate) fn skid_brash(t: &config::Trails) -> f64 {
    if t.enabled && t.kinds.skid_trail > 0.0 {
        t.skid_trail.brash
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Preset;

    #[test]
    fn presets_have_the_surfaces_that_they_name() {
        let mut named = 0;
        for preset in Preset::ALL {
            let trails = preset.config().trails;
            let mut kinds = TrailSurfaceKind::ALL.into_iter();
            let own = kinds.find(|kind| kind.name() == trails.surface);
            let is_varied = ["low", "medium", "high", "demo"].contains(&preset.name);
            let all = surfaces(&trails);
            match own.filter(|_| !is_varied) {
                Some(own) => {
                    named += 1;
                    assert!(all.contains(&own) && all.contains(&TrailSurfaceKind::Gravel));
                    assert!(all.len() <= 5, "{}: {all:?}", preset.name);
                }
                None => assert_eq!(all, TrailSurfaceKind::ALL),
            }
        }
        assert!(named > 3, "{named}");
    }
}
