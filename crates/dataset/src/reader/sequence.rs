//! The files of a sequence that belong to no single frame, read back: poses, times and tables.

use std::path::Path;

use nemoral_scene::{DeadwoodRecord, ObjectRecord, RigidTransform, TreeRecord};

use crate::formats::{kitti, tables};
use crate::{Calibration, Dataset, Error, layout, limits};

impl Dataset {
    /// `config.toml` of a sequence: each of its keys, with what was drawn for it.
    ///
    /// # Errors
    /// [`Error::Invalid`] if there is no such sequence here; [`Error::Io`] and
    /// [`Error::Malformed`].
    pub fn sequence_config(&self, sequence: u32) -> Result<String, Error> {
        self.track(sequence)?;
        self.read_text(&layout::sequence_file(sequence, layout::CONFIG))
    }

    /// `poses.txt`: for each frame of the whole sequence, the transform that takes points of the
    /// reference camera at that frame to the reference camera at frame 0.
    ///
    /// # Errors
    /// [`Error::Io`] and [`Error::Malformed`].
    pub fn poses(&self, sequence: u32) -> Result<Vec<RigidTransform>, Error> {
        let path = layout::sequence_file(sequence, layout::POSES);
        let rows = self.load_text(&path, kitti::decode_poses)?;
        Ok(rows.iter().map(kitti::from_rows).collect())
    }

    /// `poses_estimated.txt`: the same transforms as a navigation system estimates them, to the
    /// true reference camera at frame 0; `None` if the sequence has no such system.
    ///
    /// # Errors
    /// [`Error::Invalid`] if there is no such sequence here; [`Error::Io`] and
    /// [`Error::Malformed`].
    pub fn estimated_poses(&self, sequence: u32) -> Result<Option<Vec<RigidTransform>>, Error> {
        if !self.has_estimated_poses(sequence) {
            return Ok(None);
        }
        let path = layout::sequence_file(sequence, layout::ESTIMATED_POSES);
        let rows = self.load_text(&path, kitti::decode_poses)?;
        // Nothing else says where these poses are.
        let path = self.root().join(&path);
        let poses = self.poses_of_frames(sequence, (&path, &rows), kitti::is_pose)?;
        Ok(Some(poses))
    }

    /// The body's pose in the world at each frame of the whole sequence, as a navigation system
    /// estimates it ([`estimated_poses`](Self::estimated_poses)); `None` if the sequence has none.
    ///
    /// # Errors
    /// [`Error::Invalid`] if there is no such sequence here; [`Error::Io`] and
    /// [`Error::Malformed`].
    pub fn estimated_world_from_body(
        &self,
        sequence: u32,
    ) -> Result<Option<Vec<RigidTransform>>, Error> {
        let poses = self.estimated_poses(sequence)?;
        poses
            .map(|poses| self.in_world(sequence, poses))
            .transpose()
    }

    /// The body's pose in the world at each frame of the whole sequence, by a file of somebody's in
    /// the form of `poses.txt`. Rotations that were rounded to three digits are taken as they are
    /// meant.
    pub(crate) fn world_from_body_by(
        &self,
        sequence: u32,
        path: &Path,
    ) -> Result<Vec<RigidTransform>, Error> {
        let length = self.track(sequence)?.length;
        // Others may write more digits than we do.
        let limit = limits::lines_bytes(length.saturating_mul(2));
        let text = nemoral_files::read_text(path, limit)?;
        let rows = kitti::decode_poses(path, &text)?;
        let poses = self.poses_of_frames(sequence, (path, &rows), kitti::is_nearly_pose)?;
        self.in_world(sequence, poses)
    }

    /// The poses of a file, which has one for each frame of a sequence.
    fn poses_of_frames(
        &self,
        sequence: u32,
        (path, rows): (&Path, &[kitti::Rows]),
        is_pose: fn(&kitti::Rows) -> bool,
    ) -> Result<Vec<RigidTransform>, Error> {
        if let Some(line) = rows.iter().position(|rows| !is_pose(rows)) {
            let message = format!("line {}: must be a rotation and a place", line + 1);
            return Err(Error::malformed(path, message));
        }
        let length = self.track(sequence)?.length;
        if rows.len() as u64 != length {
            let message = format!(
                "has {} lines: must have one for each of the sequence's {length} frames",
                rows.len()
            );
            return Err(Error::malformed(path, message));
        }
        Ok(rows.iter().map(kitti::from_rows).collect())
    }

    /// Poses relative to the reference sensor at frame 0 as those of the body in the world.
    fn in_world(
        &self,
        sequence: u32,
        poses: Vec<RigidTransform>,
    ) -> Result<Vec<RigidTransform>, Error> {
        let world_from_frame0 = self.track(sequence)?.world_from_frame0();
        let spec = self.manifest.header.sequence(sequence);
        let spec = spec.expect("a manifest's tracks are of sequences");
        let reference_from_body = spec.body_from_reference().inverse();
        let in_world = |pose| world_from_frame0 * pose * reference_from_body;
        Ok(poses.into_iter().map(in_world).collect())
    }

    pub(crate) fn has_estimated_poses(&self, sequence: u32) -> bool {
        let spec = self.manifest.header.sequence(sequence);
        spec.is_some_and(|spec| spec.has_estimated_poses)
    }

    /// `calib.txt`.
    ///
    /// # Errors
    /// [`Error::Io`] and [`Error::Malformed`].
    pub fn calibration(&self, sequence: u32) -> Result<Calibration, Error> {
        let path = layout::sequence_file(sequence, layout::CALIB);
        self.load_text(&path, kitti::decode_calibration)
    }

    /// `times.txt`: seconds after the start of the sequence.
    ///
    /// # Errors
    /// [`Error::Io`] and [`Error::Malformed`].
    pub fn times(&self, sequence: u32) -> Result<Vec<f64>, Error> {
        let path = layout::sequence_file(sequence, layout::TIMES);
        self.load_text(&path, kitti::decode_times)
    }

    /// `trees.csv` of a sequence, by true id.
    ///
    /// # Errors
    /// [`Error::Io`] and [`Error::Malformed`].
    pub fn trees(&self, sequence: u32) -> Result<Vec<TreeRecord>, Error> {
        let path = layout::sequence_file(sequence, layout::TREES);
        tables::trees(&self.root().join(path), &self.tree_rows(sequence)?)
    }

    /// `instances.csv` of a sequence, by true id.
    ///
    /// # Errors
    /// [`Error::Io`] and [`Error::Malformed`].
    pub fn objects(&self, sequence: u32) -> Result<Vec<ObjectRecord>, Error> {
        let path = layout::sequence_file(sequence, layout::INSTANCES);
        tables::objects(&self.root().join(path), &self.object_rows(sequence)?)
    }

    /// `deadwood.csv` of a sequence, by true id; nothing if it has none.
    ///
    /// # Errors
    /// [`Error::Io`] and [`Error::Malformed`].
    pub fn deadwood(&self, sequence: u32) -> Result<Vec<DeadwoodRecord>, Error> {
        let path = layout::sequence_file(sequence, layout::DEADWOOD);
        tables::deadwood(&self.root().join(path), &self.deadwood_rows(sequence)?)
    }

    pub(crate) fn deadwood_rows(&self, sequence: u32) -> Result<tables::Rows, Error> {
        let spec = self.manifest().header.sequence(sequence);
        if spec.is_none_or(|spec| !spec.has_deadwood) {
            return Ok(tables::Rows::new());
        }
        let path = layout::sequence_file(sequence, layout::DEADWOOD);
        self.load_text(&path, tables::read_deadwood_rows)
    }

    pub(crate) fn tree_rows(&self, sequence: u32) -> Result<tables::Rows, Error> {
        let path = layout::sequence_file(sequence, layout::TREES);
        self.load_text(&path, tables::read_tree_rows)
    }

    pub(crate) fn object_rows(&self, sequence: u32) -> Result<tables::Rows, Error> {
        let path = layout::sequence_file(sequence, layout::INSTANCES);
        self.load_text(&path, tables::read_object_rows)
    }
}
