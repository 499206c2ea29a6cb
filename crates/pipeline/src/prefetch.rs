//! What a moving body is about to see is grown before it comes into sight, a little at a time, so
//! that no single observation has to wait for a whole row of chunks.

use nemoral_scene::ChunkCoord;
use nemoral_scene::glam::DVec2;
use nemoral_stand::SkyViewFactor;

use crate::ForestPlan;
use crate::plan::{Node, Runner};
use crate::recording::scene::visible_chunks;
use crate::recording::visible_reach::VisibleReach;
use crate::stages::sky_view_factor::chunks_of_trees;

/// A part of a chunk that becomes visible.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Part {
    Objects,
    /// The sky view factor: all of it for pictures, or the part by which plants grow.
    Light,
    Undergrowth,
    Litter,
}

/// A part of a chunk, and how far it is from being visible.
#[derive(Clone, Copy, Debug)]
struct Coming {
    metres: f64,
    chunk: ChunkCoord,
    part: Part,
}

impl VisibleReach {
    /// The parts of chunks that are not visible from a place, but from one that lies ahead, in the
    /// order in which they come.
    fn coming(&self, place_m: DVec2, ahead_m: DVec2) -> Vec<Coming> {
        let size_m = self.chunk_size_m;
        let light_m = match self.is_lit {
            true => self.visible_radius_m,
            false => self.undergrowth_radius_m,
        };
        let parts = [
            (Part::Objects, Some(self.visible_radius_m)),
            (Part::Light, Some(light_m)),
            (Part::Undergrowth, Some(self.undergrowth_radius_m)),
            (Part::Litter, self.litter_radius_m),
        ];
        let mut coming = Vec::new();
        for (part, radius_m) in parts {
            let Some(radius_m) = radius_m else { continue };
            for chunk in visible_chunks(ahead_m, radius_m, size_m) {
                let metres = chunk.distance_m(place_m, size_m) - radius_m;
                if metres > 0.0 {
                    coming.push(Coming {
                        metres,
                        chunk,
                        part,
                    });
                }
            }
        }
        coming.sort_by(|a, b| {
            let order = a.metres.total_cmp(&b.metres);
            order.then((a.part, a.chunk).cmp(&(b.part, b.chunk)))
        });
        coming
    }

    /// Whether all trees that a part depends on are within a radius. All parts but the objects
    /// depend on the sky view factor, and so on the trees of chunks around.
    fn trees_are_within(&self, coming: &Coming, place_m: DVec2, radius_m: f64) -> bool {
        let size_m = self.chunk_size_m;
        let near = |chunk: ChunkCoord| chunk.distance_m(place_m, size_m) <= radius_m;
        match coming.part {
            Part::Objects => near(coming.chunk),
            _ => chunks_of_trees(coming.chunk, size_m).all(near),
        }
    }
}

/// How many of the parts that are missing must be grown now, if each must be there before the body
/// has moved by its metres, and it moves by `step_m` at a time.
fn due(missing: &[Coming], step_m: f64) -> usize {
    let number = |(i, coming): (usize, &Coming)| {
        let steps = (coming.metres / step_m).floor().max(1.0);
        ((i + 1) as f64 / steps).ceil() as usize
    };
    missing.iter().enumerate().map(number).max().unwrap_or(0)
}

impl ForestPlan {
    /// Grows some of what a body that went from one place to another will see next if it goes on
    /// like this, as much as must be grown at each step so that nothing is missing when it is seen.
    /// No trees are grown that the chunk manager would not keep, which are `spare_m` beyond the
    /// visible radius: the next step would drop them, and grow them again for the next chunk.
    pub(crate) fn grow_ahead(
        &self,
        runner: &Runner<'_>,
        (before_m, place_m): (DVec2, DVec2),
        spare_m: f64,
        is_lit: bool,
    ) {
        let reach = VisibleReach {
            is_lit,
            ..self.reach
        };
        let step_m = before_m.distance(place_m);
        let lead_m = reach.chunk_size_m.min(spare_m);
        // What jumps has no direction.
        if step_m == 0.0 || step_m > lead_m {
            return;
        }
        let ahead_m = place_m + (place_m - before_m) * (lead_m / step_m);
        let mut missing = reach.coming(place_m, ahead_m);
        let kept_m = reach.visible_radius_m + spare_m;
        missing.retain(|coming| {
            !self.has(runner, is_lit, *coming) && reach.trees_are_within(coming, place_m, kept_m)
        });
        for &Coming { chunk, part, .. } in &missing[..due(&missing, step_m)] {
            // An error occurs again when the chunk is seen.
            let _ = match part {
                Part::Objects => runner.get(self.object_geometry, chunk).map(drop),
                Part::Light => runner.get(self.light(is_lit), chunk).map(drop),
                Part::Undergrowth if is_lit => runner.get(self.ground_occlusion, chunk).map(drop),
                Part::Undergrowth => runner.get(self.undergrowth_geometry, chunk).map(drop),
                Part::Litter => runner.get(self.litter_geometry, chunk).map(drop),
            };
        }
    }

    /// The sky view factor that is needed, whether or not it is asked how bright things are.
    fn light(&self, is_lit: bool) -> Node<ChunkCoord, SkyViewFactor> {
        if is_lit {
            self.sky_view_factor
        } else {
            self.ground_sky_view_factor
        }
    }

    /// Whether a part of a chunk has grown.
    fn has(&self, runner: &Runner<'_>, is_lit: bool, coming: Coming) -> bool {
        fn has<T>(runner: &Runner<'_>, node: Node<ChunkCoord, T>, chunk: ChunkCoord) -> bool {
            runner.store().contains(runner.plan().key(node, chunk))
        }
        let chunk = coming.chunk;
        match coming.part {
            Part::Objects => has(runner, self.object_geometry, chunk),
            Part::Light => has(runner, self.light(is_lit), chunk),
            Part::Undergrowth if is_lit => has(runner, self.ground_occlusion, chunk),
            Part::Undergrowth => has(runner, self.undergrowth_geometry, chunk),
            Part::Litter => has(runner, self.litter_geometry, chunk),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const REACH: VisibleReach = VisibleReach {
        chunk_size_m: 50.0,
        visible_radius_m: 100.0,
        undergrowth_radius_m: 40.0,
        litter_radius_m: None,
        is_lit: false,
    };

    /// The middle of chunk (0, 0).
    const HERE: DVec2 = DVec2::new(25.0, 25.0);

    fn coming(metres: f64) -> Coming {
        Coming {
            metres,
            chunk: ChunkCoord::new(0, 0),
            part: Part::Objects,
        }
    }

    #[test]
    fn what_comes_is_spread_over_the_steps_until_then() {
        assert_eq!(due(&[], 0.2), 0);
        assert_eq!(due(&[coming(50.0); 13], 0.2), 1);
        // Thirteen within two steps and a half.
        assert_eq!(due(&[coming(50.0); 13], 20.0), 7);
        assert_eq!(due(&[coming(0.1), coming(49.0)], 20.0), 1);
        assert_eq!(due(&[coming(0.1), coming(0.1), coming(49.0)], 20.0), 2);
    }

    #[test]
    fn what_comes_is_not_visible_yet() {
        let found = REACH.coming(HERE, HERE + DVec2::new(50.0, 0.0));
        let column = |part| {
            let of_part = found.iter().filter(move |c| c.part == part);
            of_part.map(|c| c.chunk.x).collect::<Vec<_>>()
        };
        assert_eq!(column(Part::Objects), [2, 2, 3, 3, 3]);
        assert_eq!(column(Part::Undergrowth), [2; 3]);
        assert_eq!(column(Part::Light), column(Part::Undergrowth));
        assert!(column(Part::Litter).is_empty());
        assert!(found.iter().all(|c| 0.0 < c.metres && c.metres <= 50.0));
        assert!(found.is_sorted_by(|a, b| a.metres <= b.metres));
    }

    #[test]
    fn low_plants_depend_on_the_trees_around() {
        let within = |part, x, radius_m| {
            let chunk = ChunkCoord::new(x, 0);
            let coming = Coming {
                metres: 1.0,
                chunk,
                part,
            };
            REACH.trees_are_within(&coming, HERE, radius_m)
        };
        // The nearest point of chunk (2, 0) is 75 m away, that of (3, 1) 127.5 m.
        assert!(within(Part::Objects, 2, 75.0));
        assert!(!within(Part::Objects, 2, 74.0));
        assert!(within(Part::Undergrowth, 2, 128.0));
        assert!(!within(Part::Undergrowth, 2, 127.0));
        assert!(!within(Part::Light, 2, 127.0));
    }
}
