//! What lies and grows on the trails of a chunk and at their edges.

use glam::DVec2;
use nemoral_scene::ChunkCoord;

use crate::dressing_placement::{beds, culverts, grass, roots, steps, strip, verges};
use crate::{DressingKind, TrailDressing, TrailPath, TrailZone, Trails, WayKind};

/// Hands over what lies along a trail's passage through a chunk.
type Dress<'a> = dyn Fn(&TrailPath, ChunkCoord, &mut dyn FnMut(TrailDressing)) + 'a;

impl Trails {
    /// What lies and grows on trails and at their edges, whose position is in a chunk: grass in a
    /// keyed order, then stones, verges, roots and beds, culverts, steps, and strips, by trail. At
    /// most the greatest `grass_max_per_chunk` of tufts grow on the trails, however many meet
    /// there; where they meet, the verge of one does not grow on another.
    #[must_use]
    pub fn dressing(&self, coord: ChunkCoord) -> Vec<TrailDressing> {
        let size = self.chunk_size_m;
        let spread_m = self
            .used_ways()
            .fold(0.0_f64, |a, w| a.max(w.grass_spread_m));
        let rings = (spread_m / size).ceil().max(1.0) as i32;
        let here = |p: DVec2| ChunkCoord::containing(p, size) == coord;
        let most = self.used_ways().map(|w| w.grass_max_per_chunk).max();
        let most = most.unwrap_or(0) as usize;
        // The keyed priority decides which tufts stay.
        let keep = |tufts: &mut Vec<(u64, TrailDressing)>| {
            tufts.sort_by_key(|t| t.0);
            tufts.truncate(most);
        };
        let mut tufts = Vec::new();
        for x in -rings..=rings {
            for y in -rings..=rings {
                let chunk = coord.offset(x, y);
                for path in self.in_chunk(chunk) {
                    grass(self.key, &path, chunk, |priority, tuft| {
                        if here(tuft.position_m) {
                            tufts.push((priority, tuft));
                            // However many passages there are, memory stays bounded.
                            if tufts.len() >= 4 * most + 4096 {
                                keep(&mut tufts);
                            }
                        }
                    });
                }
            }
        }
        keep(&mut tufts);
        let mut dressing: Vec<_> = tufts.into_iter().map(|t| t.1).collect();
        for path in self.in_chunk(coord) {
            dressing.extend(path.stones().iter().filter(|s| here(s.position_m)));
        }
        let has_any = |of: &dyn Fn(&WayKind) -> f64| self.used_ways().any(|w| of(w) > 0.0);
        if has_any(&|w| w.verge_tufts_per_m) {
            self.add(coord, &mut dressing, &|path, chunk, emit| {
                verges(self.key, path, chunk, emit);
            });
        }
        if has_any(&|w| w.roots_per_m) || has_any(&|w| w.stone_beds) {
            self.add(coord, &mut dressing, &|path, chunk, emit| {
                roots(self.key, path, chunk, &mut *emit);
                beds(self.key, path, chunk, emit);
            });
        }
        if has_any(&|w| w.culvert_spacing_m) {
            self.add(coord, &mut dressing, &|path, chunk, emit| {
                culverts(self.key, path, chunk, emit);
            });
        }
        if has_any(&|w| w.steps_from_grade) {
            self.add(coord, &mut dressing, &|path, chunk, emit| {
                steps(self.key, path, chunk, emit);
            });
        }
        if has_any(&|w| w.strip_cover) {
            self.add(coord, &mut dressing, &|path, chunk, emit| {
                strip(self.key, path, chunk, emit);
            });
        }
        dressing
    }

    /// Adds what trails have in a chunk, each along its passage through one; nothing of a verge or
    /// a ditch lies on another trail, and no root or step on another kind of way.
    fn add(&self, coord: ChunkCoord, dressing: &mut Vec<TrailDressing>, dress: &Dress<'_>) {
        let size = self.chunk_size_m;
        let mut added = Vec::new();
        // A trail just beyond the border may have a verge here.
        for x in -1..=1 {
            for y in -1..=1 {
                let chunk = coord.offset(x, y);
                for path in self.in_chunk(chunk) {
                    dress(&path, chunk, &mut |it| {
                        if ChunkCoord::containing(it.position_m, size) == coord {
                            added.push((path.way_number(), it));
                        }
                    });
                }
            }
        }
        if added.is_empty() {
            return;
        }
        let ground = self.ground_near(coord, 0.0);
        let stays = |&(own, d): &(usize, TrailDressing)| match d.kind {
            DressingKind::Verge | DressingKind::Bed | DressingKind::Culvert => {
                ground.edge_m(d.position_m) >= 0.0
            }
            DressingKind::Strip => ground.zone(d.position_m) == TrailZone::Strip,
            _ => (ground.way_number(d.position_m)).is_none_or(|way| way == own),
        };
        dressing.extend(added.into_iter().filter(stays).map(|(_, d)| d));
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nemoral_scene::FlatSurface;
    use nemoral_seed::Key;

    use super::*;
    use crate::TrailParams;

    #[test]
    fn of_endless_grass_the_same_tufts_stay() {
        let way = WayKind {
            grass_max_per_chunk: 10,
            rocks_max_per_trail: 0,
            verge_tufts_per_m: 0.0,
            strip_cover: 0.0,
            ..WayKind::default()
        };
        let params = TrailParams {
            spawn_probability: 0.0,
            ..TrailParams::of(way)
        };
        // It crosses the border of a chunk many times.
        let line =
            (0..2400).map(|i| DVec2::new(f64::from(i % 2 * 6 - 3), 1.0 + 0.02 * f64::from(i)));
        let base = Arc::new(FlatSurface::default());
        let trails = Trails::new(params, 50.0, Key::world(1), base).expect("valid");
        let trails = trails.along(&[line.collect()], 0).expect("finite");
        let here = ChunkCoord::new(0, 0);
        let mut all = Vec::new();
        for chunk in here.square(1) {
            for path in trails.in_chunk(chunk) {
                grass(trails.key, &path, chunk, |priority, tuft| {
                    if ChunkCoord::containing(tuft.position_m, 50.0) == here {
                        all.push((priority, tuft));
                    }
                });
            }
        }
        assert!(all.len() > 4 * 10 + 4096, "{}", all.len());
        all.sort_by_key(|t| t.0);
        let first: Vec<_> = all.into_iter().take(10).map(|t| t.1).collect();
        assert_eq!(trails.dressing(here), first);
    }
}
