//! Statistics of a data set.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use crate::overlap::Overlap;
use crate::{Dataset, Error, Manifest, ProgressMonitor};

/// One class's share of pixels and points.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ClassShare {
    /// The class id.
    pub id: u8,
    /// Its name.
    pub name: String,
    /// Pixels of this class, over all cameras.
    pub pixels: u64,
    /// Points of this class, over all LiDARs.
    pub points: u64,
}

/// The share of something that frames were chosen for.
#[derive(Clone, Debug, PartialEq)]
pub struct BalancedShare {
    /// Its name in the configuration.
    pub name: String,
    /// The share that was asked for. This and the others are means over frames.
    pub goal: f64,
    /// The share that frames of the same worlds would have without balance, by the pilots.
    pub before: f64,
    /// The share that they have, by the rays of their choice.
    pub after: f64,
}

/// A distribution by its quantiles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quantiles {
    /// The smallest.
    pub min: f64,
    /// 5 % are below.
    pub p05: f64,
    /// Half are below.
    pub median: f64,
    /// 95 % are below.
    pub p95: f64,
    /// The largest.
    pub max: f64,
}

/// The statistics of a data set.
#[derive(Clone, Debug, PartialEq)]
pub struct Stats {
    /// Sequences.
    pub sequences: usize,
    /// Frames.
    pub frames: usize,
    /// Size of all listed files.
    pub bytes: u64,
    /// By class, in the ontology's order.
    pub classes: Vec<ClassShare>,
    /// Trees in `trees.csv`.
    pub trees: usize,
    /// How many of them have a diameter at breast height of 7 cm and more, as inventories count
    /// them.
    pub measured_trees: usize,
    /// Diameter at breast height of these, metres; `None` without any.
    pub dbh_m: Option<Quantiles>,
    /// Their height, metres; `None` without any.
    pub tree_height_m: Option<Quantiles>,
    /// Planar depth of pixels that hold a surface, to 1/256 m; `None` without such pixels.
    pub depth_m: Option<Quantiles>,
    /// Measured range of points, to 1/256 m; `None` without points.
    pub range_m: Option<Quantiles>,
    /// The share of a frame's points that are within 0.1 m of a point of the frame before in its
    /// sequence, by the first LiDAR; `None` without such pairs, or if scans are raw. It tells how
    /// many frames differ: of a still robot it is near 1. Scans that somebody made so that they
    /// take thousands of steps for each point are left out.
    pub overlap: Option<Quantiles>,
    /// What frames were chosen for, by name; empty if all sequences are drives.
    pub balance: Vec<BalancedShare>,
}

impl Stats {
    /// All pixels.
    #[must_use]
    pub fn pixels(&self) -> u64 {
        self.classes.iter().map(|c| c.pixels).sum()
    }

    /// All points.
    #[must_use]
    pub fn points(&self) -> u64 {
        self.classes.iter().map(|c| c.points).sum()
    }
}

impl fmt::Display for Stats {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{} frames in {} sequences, {:.1} MB, {} points, {} trees, {} of 7 cm and more",
            self.frames,
            self.sequences,
            self.bytes as f64 / 1e6,
            self.points(),
            self.trees,
            self.measured_trees
        )?;
        let percent = |part: u64, whole: u64| 100.0 * part as f64 / whole.max(1) as f64;
        writeln!(f, "{:<16}{:>12}{:>12}", "class", "pixels", "points")?;
        for c in &self.classes {
            let name = format!("{} {}", c.id, c.name);
            let (pixels, points) = (
                percent(c.pixels, self.pixels()),
                percent(c.points, self.points()),
            );
            writeln!(f, "{name:<16}{pixels:>10.2} %{points:>10.2} %")?;
        }
        writeln!(
            f,
            "{:<16}{:>9}{:>9}{:>9}{:>9}{:>9}",
            "", "min", "5 %", "median", "95 %", "max"
        )?;
        let in_percent = |q: Quantiles| Quantiles {
            min: 100.0 * q.min,
            p05: 100.0 * q.p05,
            median: 100.0 * q.median,
            p95: 100.0 * q.p95,
            max: 100.0 * q.max,
        };
        for (name, q) in [
            ("DBH, m", self.dbh_m),
            ("tree height, m", self.tree_height_m),
            ("depth, m", self.depth_m),
            ("range, m", self.range_m),
            ("seen before, %", self.overlap.map(in_percent)),
        ] {
            if let Some(q) = q {
                writeln!(
                    f,
                    "{name:<16}{:>9.2}{:>9.2}{:>9.2}{:>9.2}{:>9.2}",
                    q.min, q.p05, q.median, q.p95, q.max
                )?;
            }
        }
        if !self.balance.is_empty() {
            writeln!(
                f,
                "{:<18}{:>9}{:>11}{:>11}",
                "balance", "goal", "before", "after"
            )?;
        }
        for b in &self.balance {
            let [goal, before, after] = [b.goal, b.before, b.after].map(|share| 100.0 * share);
            writeln!(
                f,
                "{:<18}{goal:>7.2} %{before:>9.2} %{after:>9.2} %",
                b.name
            )?;
        }
        Ok(())
    }
}

/// Reads a data set and computes its statistics.
///
/// # Errors
/// If the folder holds no finished data set, or a file is missing or damaged.
pub fn stats(dir: &Path) -> Result<Stats, Error> {
    stats_with_progress(dir, &ProgressMonitor::default())
}

/// As [`stats`], with news of each frame.
///
/// # Errors
/// As [`stats`], and [`Error::Stopped`].
pub fn stats_with_progress(dir: &Path, monitor: &ProgressMonitor) -> Result<Stats, Error> {
    let dataset = Dataset::open(dir)?;
    let manifest = dataset.manifest();
    let (mut pixels, mut points) = ([0_u64; 256], [0_u64; 256]);
    let (mut depths, mut ranges) = (Histogram::new(), Histogram::new());
    let mut overlap = Overlap::default();
    for (i, frame) in manifest.frames.iter().enumerate() {
        let sequence = dataset.sequence_of(frame);
        for camera in 0..sequence.cameras.len() {
            let (semantic, depth_m) = dataset.read_semantic_and_depth(frame, camera)?;
            for &class in semantic.pixels() {
                pixels[usize::from(class)] += 1;
            }
            depth_m.pixels().iter().for_each(|&z| depths.add(z));
        }
        for (lidar, spec) in sequence.lidars.iter().enumerate() {
            let world_from_lidar = frame.world_from_body() * spec.body_from_lidar;
            let mut in_world = Vec::new();
            for (class, position_m) in dataset.read_classes_and_positions(frame, lidar)? {
                points[usize::from(class)] += 1;
                ranges.add(position_m.length());
                if lidar == 0 && spec.deskewed {
                    in_world.push(world_from_lidar.transform_point(position_m.as_dvec3()));
                }
            }
            if lidar == 0 {
                overlap.add(frame.sequence, in_world);
            }
        }
        monitor.done(i + 1, manifest.frames.len(), frame)?;
    }
    let mut trees = Vec::new();
    for track in &manifest.tracks {
        trees.extend(dataset.trees(track.sequence)?);
    }
    let measured = || trees.iter().filter(|t| t.dbh_m >= MEASURED_DBH_M);
    let share = |c: &nemoral_scene::Class| ClassShare {
        id: c.id,
        name: c.name.clone(),
        pixels: pixels[usize::from(c.id)],
        points: points[usize::from(c.id)],
    };
    let of_frames = manifest.frames.iter().map(crate::FrameRecord::bytes);
    let of_files = manifest.files.iter().map(|f| f.bytes);
    Ok(Stats {
        sequences: manifest.tracks.len(),
        frames: manifest.frames.len(),
        bytes: of_frames.chain(of_files).sum(),
        classes: manifest
            .header
            .ontology
            .classes()
            .iter()
            .map(share)
            .collect(),
        trees: trees.len(),
        measured_trees: measured().count(),
        dbh_m: quantiles(measured().map(|t| t.dbh_m).collect()),
        tree_height_m: quantiles(measured().map(|t| t.height_m).collect()),
        depth_m: depths.quantiles(),
        range_m: ranges.quantiles(),
        overlap: quantiles(overlap.shares()),
        balance: balance(manifest),
    })
}

/// The means over the frames that were chosen for something.
fn balance(manifest: &Manifest) -> Vec<BalancedShare> {
    let mut sums: BTreeMap<&str, (f64, BalancedShare)> = BTreeMap::new();
    for frame in &manifest.frames {
        let track = manifest
            .tracks
            .iter()
            .find(|t| t.sequence == frame.sequence);
        let of = track.and_then(|t| t.balance.as_ref());
        let (Some(choice), Some(of)) = (&frame.balance, of) else {
            continue;
        };
        for (target, share) in of.targets.iter().zip(&choice.shares) {
            let none = || {
                let name = target.name.clone();
                let (goal, before, after) = (0.0, 0.0, 0.0);
                (
                    0.0,
                    BalancedShare {
                        name,
                        goal,
                        before,
                        after,
                    },
                )
            };
            let (count, sum) = sums.entry(&target.name).or_insert_with(none);
            *count += 1.0;
            sum.goal += target.goal;
            sum.before += target.before;
            sum.after += share;
        }
    }
    let mean = |(count, sum): (f64, BalancedShare)| BalancedShare {
        goal: sum.goal / count,
        before: sum.before / count,
        after: sum.after / count,
        ..sum
    };
    sums.into_values().map(mean).collect()
}

/// The index of the element at a share of the way through `count` sorted ones.
fn rank(share: f64, count: u64) -> u64 {
    (share * (count - 1) as f64).round() as u64
}

fn quantiles(mut values: Vec<f64>) -> Option<Quantiles> {
    values.sort_by(f64::total_cmp);
    let count = values.len() as u64;
    let at = |share| values[rank(share, count) as usize];
    (count > 0).then(|| Quantiles {
        min: at(0.0),
        p05: at(0.05),
        median: at(0.5),
        p95: at(0.95),
        max: at(1.0),
    })
}

/// From this diameter on trees are measured in inventories, metres.
const MEASURED_DBH_M: f64 = 0.07;

/// Counts in steps of 1/256 m up to 4 km, for more numbers than fit into memory.
struct Histogram(Vec<u64>);

impl Histogram {
    fn new() -> Self {
        Self(vec![0; 1 << 20])
    }

    fn add(&mut self, metres: f32) {
        if metres > 0.0 {
            let bin = (metres * 256.0).round() as usize;
            let last = self.0.len() - 1;
            self.0[bin.clamp(1, last)] += 1;
        }
    }

    fn quantiles(&self) -> Option<Quantiles> {
        let count: u64 = self.0.iter().sum();
        let at = |share| {
            let rank = rank(share, count);
            let mut below = 0;
            let bin = self.0.iter().position(|n| {
                below += n;
                below > rank
            });
            bin.unwrap_or(0) as f64 / 256.0
        };
        (count > 0).then(|| Quantiles {
            min: at(0.0),
            p05: at(0.05),
            median: at(0.5),
            p95: at(0.95),
            max: at(1.0),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_histogram_gives_the_quantiles_of_its_values() {
        // Up to a kilometre.
        let values: Vec<f64> = (1..=1001).map(f64::from).collect();
        let mut histogram = Histogram::new();
        values.iter().for_each(|&v| histogram.add(v as f32));
        assert_eq!(histogram.quantiles(), quantiles(values.clone()));
        assert_eq!(quantiles(values).map(|q| q.median), Some(501.0));
        assert_eq!(quantiles(Vec::new()), None);
        assert_eq!(Histogram::new().quantiles(), None);
    }
}
