//! What a cloud shows of each tree of a plot.

use std::collections::{HashMap, HashSet};
use std::f64::consts::TAU;
use std::path::Path;

use nemoral_scene::glam::DVec2;
use nemoral_scene::{ObjectId, Semantic, TreeRecord};

use super::{Cloud, CloudFormat, CloudPoint};
use crate::Error;
use crate::formats::tables::{self, rounded};

/// The height above a tree's foot at which diameters are measured, metres.
const BREAST_M: f64 = 1.3;
/// How far above and below that height points count, metres.
const BREAST_REACH_M: f64 = 0.05;
/// The directions around a stem from which it is asked whether it was seen.
const SECTORS: u8 = 16;
/// The columns after those of `trees.csv`.
const COLUMNS: &str = "tree_id,foot_inside,points,points_cropped,highest_point_m,\
                       stem_points_1_3m,stem_sectors_1_3m";

/// A tree of a plot, and what the cloud shows of it.
#[derive(Clone, Debug, PartialEq)]
pub struct SeenTree {
    /// The number of its row in the sequence's `trees.csv`, from 1: `treeID` of LAZ.
    pub number: u64,
    /// The tree, as in `trees.csv`.
    pub tree: TreeRecord,
    /// Whether its foot is in the part of the world that is kept.
    pub foot_inside: bool,
    /// Its points in the cloud.
    pub points: u64,
    /// Its points outside of the part of the world that is kept, which would be in the cloud
    /// without a crop; voxels are filled there by themselves.
    pub points_cropped: u64,
    /// How high above its foot its highest point in the cloud is, metres; `None` if it has none.
    pub highest_point_m: Option<f64>,
    /// The points of its stem in the cloud from 1.25 to 1.35 m above its foot: those of `stem`,
    /// `root_flare`, `snag` and `stem_growth`. A stem that is thinner than 8 cm there is `branch`,
    /// and has none.
    pub stem_points_1_3m: u64,
    /// In how many of 16 equal sectors around the stem's middle, seen from above, these points
    /// are. The middle is the mean of where they say that it is: half of the diameter behind each,
    /// along the true normal, so that a stem may lean, and poses may be off.
    pub stem_sectors_1_3m: u32,
}

impl SeenTree {
    /// The fields of [`COLUMNS`].
    fn fields(&self) -> Vec<String> {
        let highest_m = self.highest_point_m.map(|h| rounded(h, 1e3).to_string());
        vec![
            self.number.to_string(),
            self.foot_inside.to_string(),
            self.points.to_string(),
            self.points_cropped.to_string(),
            highest_m.unwrap_or_default(),
            self.stem_points_1_3m.to_string(),
            self.stem_sectors_1_3m.to_string(),
        ]
    }
}

impl Cloud {
    /// The trees that stand in the part of the world that is kept, or have a point in the cloud, in
    /// the order of `trees.csv`. All scans are read for it, with news of each frame as from
    /// [`for_each`](Self::for_each).
    ///
    /// # Errors
    /// If `trees.csv` or a scan is missing or damaged, and [`Error::Stopped`].
    pub fn seen_trees(&self) -> Result<Vec<SeenTree>, Error> {
        let mut census = Census::new(self.all_trees()?, |tree| self.is_within(tree.position_m));
        let (mut filled, mut filled_outside) = (HashSet::new(), HashSet::new());
        self.for_each_measured(|point: &CloudPoint| -> Result<(), Error> {
            let is_within = self.is_within(point.world_m);
            let voxels = if is_within {
                &mut filled
            } else {
                &mut filled_outside
            };
            if self.keeps(point, voxels) {
                census.count(point, is_within);
            }
            Ok(())
        })?;
        Ok(census.finish())
    }

    /// Writes [`seen_trees`](Self::seen_trees) as a CSV, and returns how many they are: the columns
    /// of `trees.csv`, and those of [`SeenTree`]. Places are in the coordinates of a cloud of this
    /// format. The file appears when it is whole.
    ///
    /// # Errors
    /// As [`seen_trees`](Self::seen_trees) and [`check_name`](Self::check_name), and if it cannot
    /// be written.
    pub fn write_trees(&self, out: &Path, format: CloudFormat) -> Result<usize, Error> {
        self.check_name(out, "csv")?;
        let seen = self.seen_trees()?;
        let rows = seen.iter().map(|seen| {
            let tree = TreeRecord {
                position_m: self.place_m(format, seen.tree.position_m),
                ..seen.tree.clone()
            };
            (tree, seen.fields())
        });
        let text = tables::encode_trees_and(COLUMNS, rows)?;
        nemoral_files::write(out, text.as_bytes())?;
        Ok(seen.len())
    }
}

/// A point of a stem at breast height, seen from above.
struct StemPoint {
    /// Its place relative to the tree's foot, metres.
    from_foot_m: DVec2,
    /// The unit vector away from the stem's middle.
    outwards: DVec2,
}

/// Counts the points of trees.
struct Census {
    seen: Vec<SeenTree>,
    /// The points of each tree's stem at breast height.
    stems: Vec<Vec<StemPoint>>,
    /// Which tree an object is. It is only asked for single ids, so its order does not matter.
    by_object: HashMap<ObjectId, usize>,
}

impl Census {
    fn new(trees: Vec<TreeRecord>, is_inside: impl Fn(&TreeRecord) -> bool) -> Self {
        let objects = trees.iter().enumerate();
        let by_object = objects.map(|(i, tree)| (tree.object, i)).collect();
        let unseen = |(number, tree): (u64, TreeRecord)| SeenTree {
            number,
            foot_inside: is_inside(&tree),
            tree,
            points: 0,
            points_cropped: 0,
            highest_point_m: None,
            stem_points_1_3m: 0,
            stem_sectors_1_3m: 0,
        };
        let seen: Vec<SeenTree> = (1..).zip(trees).map(unseen).collect();
        Self {
            stems: seen.iter().map(|_| Vec::new()).collect(),
            seen,
            by_object,
        }
    }

    /// Counts a point, which is in the cloud or outside of the part of the world that is kept.
    fn count(&mut self, point: &CloudPoint, is_within: bool) {
        let Some(&i) = self.by_object.get(&point.recorded.point.object) else {
            return;
        };
        let seen = &mut self.seen[i];
        if !is_within {
            seen.points_cropped += 1;
            return;
        }
        seen.points += 1;
        let from_foot_m = point.world_m - seen.tree.position_m;
        let height_m = from_foot_m.z;
        let highest_m = seen.highest_point_m.map_or(height_m, |h| h.max(height_m));
        seen.highest_point_m = Some(highest_m);
        let is_near = (height_m - BREAST_M).abs() <= BREAST_REACH_M;
        if is_near && is_stem(point.recorded.point.semantic) {
            self.stems[i].push(StemPoint {
                from_foot_m: from_foot_m.truncate(),
                outwards: point.normal.truncate().normalize_or_zero(),
            });
        }
    }

    /// The trees that stand inside or have a point.
    fn finish(mut self) -> Vec<SeenTree> {
        for (seen, stem) in self.seen.iter_mut().zip(&self.stems) {
            seen.stem_points_1_3m = stem.len() as u64;
            seen.stem_sectors_1_3m = sectors(stem, seen.tree.dbh_m / 2.0);
        }
        self.seen.retain(|seen| seen.foot_inside || seen.points > 0);
        self.seen
    }
}

/// Whether it is the surface of a stem.
fn is_stem(semantic: Semantic) -> bool {
    use Semantic::{RootFlare, Snag, Stem, StemGrowth};
    matches!(semantic, Stem | RootFlare | Snag | StemGrowth)
}

/// In how many sectors around the middle of a stem of this radius points are.
fn sectors(stem: &[StemPoint], radius_m: f64) -> u32 {
    let middles = stem.iter().map(|p| p.from_foot_m - radius_m * p.outwards);
    let middle_m = middles.sum::<DVec2>() / stem.len().max(1) as f64;
    let sector = |p: &StemPoint| {
        let turn = ((p.from_foot_m - middle_m).to_angle() / TAU).rem_euclid(1.0);
        // A turn that is hardly less than 0 is rounded to a whole one.
        ((turn * f64::from(SECTORS)) as u8).min(SECTORS - 1)
    };
    let seen = stem.iter().fold(0_u16, |seen, p| seen | 1_u16 << sector(p));
    seen.count_ones()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points on the sides of a stem that lie in these directions, degrees.
    fn stem(middle_m: DVec2, radius_m: f64, degrees: impl Iterator<Item = u32>) -> Vec<StemPoint> {
        let point = |degrees: u32| {
            let outwards = DVec2::from_angle(f64::from(degrees).to_radians());
            StemPoint {
                from_foot_m: middle_m + radius_m * outwards,
                outwards,
            }
        };
        degrees.map(point).collect()
    }

    #[test]
    fn sectors_are_those_around_the_middle_of_a_leaning_stem() {
        // The foot is outside of the stem.
        let middle_m = DVec2::new(0.3, -0.2);
        for (degrees, expected) in [
            (0..360, 16),
            (1..179, 8),
            (91..269, 8),
            // A station sees half of a stem, and parts of two sectors more.
            (80..281, 10),
            (1..22, 1),
        ] {
            let points = stem(middle_m, 0.15, degrees);
            assert_eq!(sectors(&points, 0.15), expected);
        }
        assert_eq!(sectors(&[], 0.15), 0);
    }
}
