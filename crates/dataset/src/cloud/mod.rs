//! All scans of a sequence as one registered, labelled cloud.

mod class_filter;
mod crop;
mod ply;
mod point;
mod trajectory;
mod trees;

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use nemoral_scene::glam::{DVec2, DVec3};
use nemoral_scene::{Ontology, PointFlags, RigidTransform, TreeRecord};

use crate::{Dataset, Error, FrameRecord, ProgressMonitor, SequenceSpec, SiteSpec};
use class_filter::ClassFilter;

pub use crop::Crop;
pub use ply::cloud;
pub use point::CloudPoint;
pub use trees::SeenTree;

/// By which poses scans are registered.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum CloudPoses {
    /// By the true ones.
    #[default]
    True,
    /// By those that the robot's navigation system estimates, with their errors.
    Estimated,
    /// By those of a file in the form of `poses.txt`, with a line for each frame of the whole
    /// sequence: what a program for odometry or mapping made of the data set.
    File(PathBuf),
}

/// The format of a cloud's file, which decides the coordinates and the clock of the tables beside
/// it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CloudFormat {
    /// PLY: the world's coordinates, and seconds after the start of the sequence.
    Ply,
    /// LAZ: the coordinates of the [site](Cloud::site), or those of an invented world, and times
    /// that are later by [`Cloud::las_time_shift_s`].
    Laz,
}

/// What goes into a cloud.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CloudParams {
    /// Side of a voxel, metres, 0.0001 to 1000: only the first point in each is kept; `None` keeps
    /// all.
    pub voxel_m: Option<f64>,
    /// Whether mixed returns and false alarms are left out.
    pub pure: bool,
    /// By which poses scans are registered.
    pub poses: CloudPoses,
    /// Which sequence; may be `None` if there is only one.
    pub sequence: Option<u32>,
    /// The part of the world that is kept; `None` keeps all.
    pub crop: Option<Crop>,
    /// Names of classes of the data set and of fine semantics, of which points are kept; all if it
    /// is empty.
    pub only: Vec<String>,
}

/// Allowed sides of voxels, metres: from finer than any scanner measures to larger than any
/// scanner's reach.
const VOXEL_M: std::ops::RangeInclusive<f64> = 1e-4..=1e3;

/// The scans of a sequence that are to become one cloud.
#[derive(Clone, Debug)]
pub struct Cloud {
    dataset: Dataset,
    number: u32,
    params: CloudParams,
    filter: ClassFilter,
    /// The body's pose in the world at each frame of the sequence, if it is not the true one.
    world_from_body: Option<Vec<RigidTransform>>,
    monitor: ProgressMonitor,
}

impl Cloud {
    /// Opens a data set's sequence.
    ///
    /// # Errors
    /// If there is no such sequence, or there are several and none is named, if it has no
    /// LiDAR, if its scans were written raw (not deskewed) or without PLY, if estimated poses are
    /// asked for and it has none, if a file is no poses or has not one for each frame, if `voxel_m`
    /// is out of range, or if `only` has a name that is no class.
    pub fn open(dir: &Path, params: CloudParams) -> Result<Self, Error> {
        if let Some(side) = params.voxel_m.filter(|v| !VOXEL_M.contains(v)) {
            let allowed = format!("{} to {} m", VOXEL_M.start(), VOXEL_M.end());
            return Err(Error::invalid("voxel_m", format!("{side:?}"), allowed));
        }
        let dataset = Dataset::open(dir)?;
        let sequences = (dataset.manifest().tracks.iter()).map(|t| t.sequence);
        let mut matching = sequences
            .clone()
            .filter(|&s| params.sequence.is_none_or(|of| of == s));
        let (Some(number), None) = (matching.next(), matching.next()) else {
            let found = params.sequence.map_or("none".to_owned(), |s| s.to_string());
            let there: Vec<String> = sequences.map(|s| s.to_string()).collect();
            let allowed = format!("one of {}: each is a world of its own", there.join(", "));
            return Err(Error::invalid("sequence", found, allowed));
        };
        let filter = ClassFilter::new(&params.only, &dataset.manifest().header.ontology)?;
        let world_from_body = match &params.poses {
            CloudPoses::True => None,
            CloudPoses::Estimated => Some(estimated(&dataset, number)?),
            CloudPoses::File(path) => {
                let poses = dataset.world_from_body_by(number, path);
                Some(poses.map_err(|e| {
                    let allowed = format!("a file with a pose for each frame: {e}");
                    Error::invalid("poses", path.display(), allowed)
                })?)
            }
        };
        let this = Self {
            dataset,
            number,
            params,
            filter,
            world_from_body,
            monitor: ProgressMonitor::default(),
        };
        if this.spec().lidars.is_empty() {
            let allowed = "a data set with a LiDAR (lidar.enabled = true)";
            return Err(Error::invalid("dir", dir.display(), allowed));
        }
        for lidar in &this.spec().lidars {
            if !lidar.ply {
                let allowed = "a data set with PLY files (output.ply = true)";
                return Err(Error::invalid("dir", dir.display(), allowed));
            }
            if !lidar.deskewed {
                let allowed = "a data set whose scans are deskewed (lidar.deskew = true)";
                return Err(Error::invalid("dir", dir.display(), allowed));
            }
        }
        Ok(this)
    }

    /// The same, with news of each frame from [`for_each`](Self::for_each).
    #[must_use]
    pub fn with_progress(self, monitor: ProgressMonitor) -> Self {
        Self { monitor, ..self }
    }

    /// The data set's class table.
    #[must_use]
    pub fn ontology(&self) -> &Ontology {
        &self.dataset.manifest().header.ontology
    }

    /// Where the sequence's world lies on the earth; `None` if it is invented.
    #[must_use]
    pub fn site(&self) -> Option<&SiteSpec> {
        self.spec().site.as_ref()
    }

    /// What LAZ adds to the times of the sequence, seconds
    /// ([`SequenceSpec::las_time_shift_s`]).
    #[must_use]
    pub fn las_time_shift_s(&self) -> f64 {
        self.spec().las_time_shift_s()
    }

    /// All trees of the sequence, wherever they stand, in the order of `trees.csv`.
    ///
    /// # Errors
    /// If `trees.csv` is missing or damaged.
    pub fn all_trees(&self) -> Result<Vec<TreeRecord>, Error> {
        self.dataset.trees(self.number)
    }

    fn spec(&self) -> &SequenceSpec {
        let header = &self.dataset.manifest().header;
        (header.sequence(self.number)).expect("a manifest's tracks are of sequences")
    }

    /// Refuses a name that does not end in `.extension`, or that is one of the data set's files or
    /// that of the poses.
    ///
    /// # Errors
    /// [`Error::Invalid`].
    pub fn check_name(&self, out: &Path, extension: &str) -> Result<(), Error> {
        let ends = out.extension();
        if ends.is_none_or(|e| !e.eq_ignore_ascii_case(extension)) {
            let allowed = format!("a name that ends in .{extension}");
            return Err(Error::invalid("out", out.display(), allowed));
        }
        if self.dataset.owns(out) {
            let allowed = "none of the data set's own files";
            return Err(Error::invalid("out", out.display(), allowed));
        }
        if let CloudPoses::File(poses) = &self.params.poses
            && nemoral_files::is_same(poses, out)
        {
            let allowed = "another file than that of the poses";
            return Err(Error::invalid("out", out.display(), allowed));
        }
        Ok(())
    }

    /// Refuses to write the table of trees and the trajectory into one file, whatever the ways to
    /// it are called.
    ///
    /// # Errors
    /// [`Error::Invalid`].
    pub fn check_apart(trees: &Path, trajectory: &Path) -> Result<(), Error> {
        let folder = |file: &Path| match file.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
            _ => PathBuf::from("."),
        };
        let is_named_so = trees.file_name() == trajectory.file_name()
            && nemoral_files::is_same(&folder(trees), &folder(trajectory));
        // Some file systems know a file by several names: in capitals and in small letters.
        if is_named_so || nemoral_files::is_same(trees, trajectory) {
            let allowed = "another file than that of the trees";
            return Err(Error::invalid("trajectory", trajectory.display(), allowed));
        }
        Ok(())
    }

    /// Calls `put` with each point, in the order of frames and LiDARs. One scan is in memory at a
    /// time. Returns how many points there were.
    ///
    /// # Errors
    /// If a scan is missing or damaged, those of `put`, and [`Error::Stopped`].
    pub fn for_each<E: From<Error>>(
        &self,
        mut put: impl FnMut(&CloudPoint) -> Result<(), E>,
    ) -> Result<u64, E> {
        let mut filled = HashSet::new();
        let mut count = 0;
        let mut is_anything_there = self.params.crop.is_none();
        self.for_each_measured(|point: &CloudPoint| -> Result<(), E> {
            if !self.is_within(point.world_m) {
                return Ok(());
            }
            is_anything_there = true;
            if self.keeps(point, &mut filled) {
                put(point)?;
                count += 1;
            }
            Ok(())
        })?;
        if !is_anything_there {
            return Err(self.nothing_there().into());
        }
        Ok(count)
    }

    /// Calls `put` with each point of the sequence, whether or not it is kept.
    fn for_each_measured<E: From<Error>>(
        &self,
        mut put: impl FnMut(&CloudPoint) -> Result<(), E>,
    ) -> Result<(), E> {
        let total = self.frames().count();
        for (done, record) in self.frames().enumerate() {
            let world_from_body = self.world_from_body(record);
            let left = world_from_body.level_left();
            let line = self.line_of(record);
            for (i, lidar) in self.spec().lidars.iter().enumerate() {
                let world_from_lidar = world_from_body * lidar.body_from_lidar;
                let scan = self.scan_number(record, i);
                for recorded in self.dataset.read_ply(record, i)? {
                    let point = &recorded.point;
                    let position_m = point.position_m.as_dvec3();
                    let from_scanner_m = world_from_lidar.transform_vector(position_m);
                    put(&CloudPoint {
                        world_m: world_from_lidar.transform_point(position_m),
                        normal: world_from_lidar.transform_vector(point.normal.as_dvec3()),
                        from_scanner_m,
                        left_m: left.dot(from_scanner_m),
                        scan,
                        line,
                        frame: record.index,
                        time_s: record.time_s,
                        lidar: i as u8,
                        recorded,
                    })?;
                }
            }
            self.monitor.done(done + 1, total, record)?;
        }
        Ok(())
    }

    /// The frames of the sequence that exist here.
    fn frames(&self) -> impl Iterator<Item = &FrameRecord> {
        let frames = self.dataset.frames().iter();
        frames.filter(move |frame| frame.sequence == self.number)
    }

    /// The number of the flight line that a frame is on, from 0; `None` if it is on none.
    fn line_of(&self, frame: &FrameRecord) -> Option<u64> {
        let track = self.dataset.track(self.number).ok()?;
        track.line_of(frame.index)
    }

    /// The number of a LiDAR's scan among those of the sequence, from 0.
    fn scan_number(&self, frame: &FrameRecord, lidar: usize) -> u64 {
        frame.index * self.spec().lidars.len() as u64 + lidar as u64
    }

    /// The pose by which a frame's scans are registered.
    fn world_from_body(&self, frame: &FrameRecord) -> RigidTransform {
        match &self.world_from_body {
            // One for each frame of the sequence, and a manifest lists none beyond its end.
            Some(poses) => poses[frame.index as usize],
            None => frame.world_from_body(),
        }
    }

    /// The error of a crop without points, which says where there are any.
    fn nothing_there(&self) -> Error {
        let places = self
            .frames()
            .map(|f| f.world_from_body().translation_m.truncate());
        let (low, high) = places.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| {
            (low.min(p), high.max(p))
        });
        let allowed = format!(
            "a part of the world with points: the scanners were within ({:.1}, {:.1}) and \
             ({:.1}, {:.1}), in world coordinates, from which site.origin_x_m and \
             site.origin_y_m are subtracted",
            low.x, low.y, high.x, high.y
        );
        Error::invalid("crop", "no point", allowed)
    }

    /// Whether a point is kept, wherever it lies. `filled` has the voxels of those that were kept.
    fn keeps(&self, p: &CloudPoint, filled: &mut HashSet<[i64; 3]>) -> bool {
        let odd = PointFlags::MIXED | PointFlags::FALSE_ALARM | PointFlags::MIRRORED;
        if self.params.pure && p.recorded.point.flags.has(odd) || !self.filter.has(&p.recorded) {
            return false;
        }
        // The set is only asked whether it contains a point, so its order does not matter.
        self.params.voxel_m.is_none_or(|side| {
            let cell = (p.world_m / side).floor();
            filled.insert(cell.to_array().map(|c| c as i64))
        })
    }

    /// Whether a place belongs to the part of the world that is kept.
    #[must_use]
    pub fn is_within(&self, world_m: DVec3) -> bool {
        (self.params.crop).is_none_or(|crop| crop.contains(world_m.truncate()))
    }

    /// A place of the world in the coordinates of a format.
    fn place_m(&self, format: CloudFormat, world_m: DVec3) -> DVec3 {
        match (format, self.site()) {
            (CloudFormat::Laz, Some(site)) => site.from_world(world_m),
            _ => world_m,
        }
    }
}

/// The body's pose in the world at each frame of a sequence, as its navigation system estimates it.
fn estimated(dataset: &Dataset, sequence: u32) -> Result<Vec<RigidTransform>, Error> {
    dataset.estimated_world_from_body(sequence)?.ok_or_else(|| {
        let allowed = "false for a data set without poses_estimated.txt \
                       (navigation.enabled = true)";
        Error::invalid("estimated_poses", true, allowed)
    })
}
