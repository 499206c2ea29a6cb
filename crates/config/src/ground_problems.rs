//! Combinations of the keys of terrain and ways that are impossible, though each value alone is
//! allowed.

use super::validate::Problems;
use super::{Config, RobotPath, TerrainNoise, Trails, WAYS};

impl Config {
    pub(super) fn ground_problems(&self, out: &mut Problems) {
        let (terrain, trails) = (&self.terrain, &self.trails);
        out.ordered(
            ("terrain.fine_cell_m", terrain.fine_cell_m),
            ("terrain.cell_m", terrain.cell_m),
        );
        let any = trails.enabled || !self.site.trails.path.is_empty();
        if any && trails.width_m < 2.0 * terrain.fine_cell_m {
            let must = format!(
                "be at least twice terrain.fine_cell_m = {}",
                terrain.fine_cell_m
            );
            out.refuse("trails.width_m", trails.width_m, &must);
        }
        if let Err(problem) = trails.section.points() {
            out.add("trails.section.curve", &format!(": {problem}"));
        }
        if trails.kinds.shares().iter().sum::<f64>() <= 0.0 {
            out.add("trails.kinds", ": the shares are all 0");
        }
        self.way_problems(out);
        self.relief_problems(out);
    }

    /// Forms of the terrain that do not fit into it.
    fn relief_problems(&self, out: &mut Problems) {
        let t = &self.terrain;
        if t.terraces > 0.0 && t.terrace_step_m > 0.5 * t.max_height_m {
            let must = format!(
                "be at most half of terrain.max_height_m = {}, or terrain.terraces 0",
                t.max_height_m
            );
            out.refuse("terrain.terrace_step_m", t.terrace_step_m, &must);
        }
        if t.cliffs > 0.0 && t.terraces <= 0.0 {
            let must = "be 0, or terrain.terraces above 0: cliffs are the rises between terraces";
            out.refuse("terrain.cliffs", t.cliffs, must);
        }
        if t.gully_depth_m > 0.4 * t.gully_spacing_m {
            let must = format!(
                "be at most 0.4 of terrain.gully_spacing_m = {}",
                t.gully_spacing_m
            );
            out.refuse("terrain.gully_depth_m", t.gully_depth_m, &must);
        }
        let is_shaped = t.ridges > 0.0 || t.warp > 0.0 || t.terraces > 0.0;
        if is_shaped && t.noise == TerrainNoise::PerlinSurflet {
            let must = "be \"nemoral\" where terrain.ridges, terrain.warp or terrain.terraces is \
                        above 0";
            out.refuse("terrain.noise", "\"perlin-surflet\"", must);
        }
    }

    /// Ways that are too narrow for the ground's mesh or too wide for a chunk, and a robot on a
    /// kind that there is not.
    fn way_problems(&self, out: &mut Problems) {
        let (terrain, trails) = (&self.terrain, &self.trails);
        let ways = trails.params().ways.into_iter().enumerate();
        let born = ways.filter(|(_, w)| trails.enabled && w.1 > 0.0);
        for (i, (way, _)) in born {
            let key = match i {
                Trails::TRACK => "trails.width_m".to_owned(),
                _ => format!("trails.{}.width_m", WAYS[1 + i]),
            };
            // Its narrow places too are as wide as a cell.
            let cells = (1.0 / (1.0 - way.width_variation)).max(1.5);
            if way.width_m < cells * terrain.fine_cell_m {
                let must = format!(
                    "be at least {cells:.2} times terrain.fine_cell_m = {}, or trails.kinds.{} 0",
                    terrain.fine_cell_m,
                    WAYS[1 + i]
                );
                out.refuse(&key, way.width_m, &must);
            }
            if 4.0 * way.width_m > self.chunks.size_m {
                let must = format!(
                    "be at most a quarter of chunks.size_m = {}, or trails.kinds.{} 0",
                    self.chunks.size_m,
                    WAYS[1 + i]
                );
                out.refuse(&key, way.width_m, &must);
            }
        }
        let has_lines = !self.site.trails.path.is_empty();
        if let RobotPath::Trail(path) = &self.robot.path
            && let Some(i) = path.way_number()
            && (trails.enabled || has_lines)
            && !(trails.enabled && trails.kinds.shares()[i] > 0.0)
            && !(has_lines && i == Trails::TRACK)
        {
            let way = &path.way;
            let must = if trails.enabled {
                format!("be a kind that there is, and trails.kinds.{way} is 0")
            } else {
                "be \"any\" or \"track\", as which trails along lines are built: trails.enabled is \
                 false"
                    .to_owned()
            };
            out.refuse("robot.trail.way", format!("\"{way}\""), &must);
        }
    }
}
