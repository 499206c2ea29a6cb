//! Trails along given lines.

use std::sync::Arc;

use glam::DVec2;
use nemoral_scene::ChunkCoord;

use crate::earthwork::Earthworks;
use crate::layout::Course;
use crate::line_course::{course, free_ends};
use crate::{ParamError, Trails};

/// The greatest coordinate of a given line, metres.
const FARTHEST_M: f64 = 1e8;
/// The greatest length of all given lines together, metres.
const LONGEST_M: f64 = 1e7;

impl Trails {
    /// These trails and further ones along given lines, of the way with this number among the
    /// parameters' ways (the last one, if there are fewer): smooth curves through their vertices,
    /// in world coordinates. Lines shorter than a metre are left out. Trails narrow and fade at
    /// their ends, but where the line's other end or the end of another given line is within a
    /// metre: there they go on.
    ///
    /// # Errors
    /// If a coordinate of a vertex is not within ±100,000 km, or if lines are longer than 10,000 km
    /// in all.
    pub fn along(mut self, lines_m: &[Vec<DVec2>], way: usize) -> Result<Self, ParamError> {
        for (number, line) in lines_m.iter().enumerate() {
            let beyond = |p: &&DVec2| !p.abs().cmple(DVec2::splat(FARTHEST_M)).all();
            if let Some(vertex) = line.iter().find(beyond) {
                let field = format!("lines_m[{number}]");
                return Err(ParamError::new(field, vertex, "finite and within ±1e8 m"));
            }
        }
        let length_m =
            |line: &Vec<DVec2>| line.windows(2).map(|w| w[0].distance(w[1])).sum::<f64>();
        let all_m: f64 = lines_m.iter().map(length_m).sum();
        ParamError::check(all_m <= LONGEST_M, "lines_m", all_m, "at most 1e7 m in all")?;
        let way = way.min(self.ways.len() - 1);
        let numbered = (self.numbered..).zip(lines_m);
        let courses: Vec<Course> = numbered
            .filter_map(|(number, line)| course(line, number, self.chunk_size_m))
            .collect();
        let known = self.given.iter().map(|path| {
            let knots = path.knots();
            let ends = [0, knots.len() - 1].map(|i| knots[i].position);
            (ends, path.length_m())
        });
        let added = courses.iter().map(|course| {
            let [first, last] = [0, course.points.len() - 1].map(|i| course.points[i]);
            ([first.0, last.0], last.2)
        });
        let free = free_ends(&known.chain(added).collect::<Vec<_>>());
        let (of_known, of_added) = free.split_at(self.given.len());
        for (i, &free) in of_known.iter().enumerate() {
            let path = Arc::clone(&self.given[i]);
            if path.free() != free {
                self.given[i] = Arc::new(self.lay(path.way_number(), path.course(free)));
            }
        }
        for (course, &free) in courses.into_iter().zip(of_added) {
            let path = Arc::new(self.lay(way, Course { free, ..course }));
            for chunk in path.chunks() {
                let here = self.given_in.entry([chunk.x, chunk.y]).or_default();
                if here.last() != Some(&self.given.len()) {
                    here.push(self.given.len());
                }
            }
            self.given.push(path);
        }
        self.numbered += lines_m.len() as u32;
        if !self.given.is_empty() && !self.used[way] {
            self.used[way] = true;
            self.earthworks = Earthworks::new(&self.ways, &self.used);
        }
        Ok(self)
    }

    /// The given trails that touch a chunk.
    pub(super) fn given_in(&self, chunk: ChunkCoord) -> &[usize] {
        self.given_in
            .get(&[chunk.x, chunk.y])
            .map_or(&[], Vec::as_slice)
    }
}

#[cfg(test)]
mod tests {
    use nemoral_scene::FlatSurface;
    use nemoral_seed::Key;

    use super::*;
    use crate::TrailParams;

    #[test]
    fn lines_that_are_not_finite_are_refused() {
        for bad in [f64::NAN, f64::INFINITY, -1e300] {
            let base = Arc::new(FlatSurface::default());
            let trails = Trails::new(TrailParams::default(), 50.0, Key::world(3), base);
            let good = vec![DVec2::ZERO, DVec2::new(40.0, 0.0)];
            let spoilt = vec![DVec2::ZERO, DVec2::new(40.0, bad)];
            let found = trails.expect("valid").along(&[good, spoilt], 0);
            let error = found.expect_err("refused").to_string();
            let said = "lines_m[1] = [40, ";
            assert!(
                error.starts_with(said) && error.ends_with("within ±1e8 m"),
                "{error}"
            );
        }
    }

    #[test]
    fn given_lines_are_trails_in_every_chunk_that_they_cross() {
        let params = TrailParams {
            spawn_probability: 0.0,
            ..TrailParams::default()
        };
        let line = vec![
            DVec2::new(-70.0, 3.0),
            DVec2::new(-20.0, 12.0),
            DVec2::new(-20.0, 12.3),
            DVec2::new(35.0, -4.0),
            DVec2::new(80.0, 40.0),
        ];
        let short = vec![DVec2::ZERO, DVec2::new(0.3, 0.0)];
        let base = Arc::new(FlatSurface::default());
        let trails = Trails::new(params, 50.0, Key::world(3), base).expect("valid");
        assert!(!trails.is_crossed(ChunkCoord::new(0, 0)));
        let trails = trails.along(&[short, line.clone()], 0).expect("finite");
        for (i, vertex) in line.iter().enumerate() {
            let chunk = ChunkCoord::containing(*vertex, 50.0);
            assert!(trails.is_crossed(chunk) && trails.in_chunk(chunk).len() == 1);
            let ground = trails.ground_near(chunk, 2.0);
            let inner = i > 0 && i + 1 < line.len();
            // The middle of the surface, which is narrower at its ends.
            let edge = ground.edge_m(*vertex);
            let width = 0.5 * trails.params().ways[0].0.width_m;
            assert!(
                edge < -0.25 && (!inner || (edge + width).abs() < 0.4),
                "{vertex}: {edge}"
            );
            let edges = trails.edges_near(chunk, 2.0);
            assert_eq!(edges.edge_m(*vertex).to_bits(), edge.to_bits());
        }
        // Every place along it is on it, from whichever chunk it is asked.
        let (path, _) = trails.nearest(DVec2::ZERO, 100.0).expect("it is near");
        assert_eq!(path.id().number, 2);
        let mut s_m = 0.0;
        while s_m < path.length_m() {
            let p = path.position_m(s_m);
            let home = ChunkCoord::containing(p, 50.0);
            let here = trails.ground_near(home, 2.0).edge_m(p);
            assert!(here < -0.25, "{s_m}: {here}");
            s_m += 0.37;
        }
        assert!(!trails.is_crossed(ChunkCoord::new(3, 3)));
    }
}
