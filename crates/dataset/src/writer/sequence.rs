//! Writing the files of a sequence that belong to no single frame: poses, times and tables.

use crate::formats::kitti::{self, Calibration};
use crate::formats::tables::{self, Tables};
use crate::{
    BalanceRecord, Error, EurocFiles, FileRecord, FrameRecord, SequenceSpec, Track, TrackRecord,
    WorldTables, Writer, layout,
};

/// The data of a sequence besides its frames.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Drive {
    pub(crate) length: u64,
    pub(crate) world_from_frame0: kitti::Rows,
    pub(crate) poses: String,
    pub(crate) estimated: Option<String>,
    pub(crate) times: String,
    pub(crate) balance: Option<BalanceRecord>,
    pub(crate) stands: bool,
    pub(crate) lines: Vec<u64>,
}

impl Writer {
    /// Writes the files of a sequence that belong to no single frame: the poses and times of the
    /// whole drive, so that shards agree, and the inventory of its world. It may be called from
    /// several threads at once.
    ///
    /// `world` must contain every object that a recorded frame of the sequence shows
    /// ([`Writer::frames`]).
    ///
    /// # Errors
    /// [`Error::Invalid`] for a sequence that the header does not have or that was written before,
    /// for a frame without a pose, or with a pose that differs from its track's, and for two
    /// different objects with one id; [`Error::Io`].
    pub fn write_sequence(&self, track: &Track, world: &WorldTables<'_>) -> Result<(), Error> {
        let spec = self.sequence(track.sequence)?;
        let mount = spec.body_from_reference();
        for record in self.lock().values() {
            if record.sequence == track.sequence {
                check_pose(record, track)?;
            }
        }
        let poses: Vec<_> = track.poses.iter().map(|(_, p)| *p * mount).collect();
        let Some(first) = poses.first() else {
            return Err(Error::invalid("track.poses", "[]", "at least one pose"));
        };
        let relative = poses.iter().map(|p| kitti::relative(first, p).to_rows());
        let times: Vec<_> = track.poses.iter().map(|(t, _)| *t).collect();
        let estimated = track.estimated.iter().map(|pose| *pose * mount);
        // Relative to the true pose, so that the errors of frame 0 are there too.
        let estimated: Vec<_> = estimated
            .map(|pose| kitti::relative(first, &pose).to_rows())
            .collect();
        let asked = if spec.has_estimated_poses {
            poses.len()
        } else {
            0
        };
        if estimated.len() != asked {
            let allowed = format!("{asked} poses");
            return Err(Error::invalid("track.estimated", estimated.len(), allowed));
        }
        let drive = Drive {
            length: poses.len() as u64,
            world_from_frame0: first.to_rows(),
            poses: kitti::encode_poses(&relative.collect::<Vec<_>>()),
            estimated: (spec.has_estimated_poses).then(|| kitti::encode_poses(&estimated)),
            times: kitti::encode_times(&times),
            balance: track.balance.clone(),
            stands: track.stands,
            lines: track.lines.clone(),
        };
        let trees = tables::tree_rows(world.trees)?;
        let objects = tables::object_rows(world.objects)?;
        let deadwood = tables::deadwood_rows(world.deadwood)?;
        let tables = Tables {
            trees,
            deadwood,
            objects,
        };
        let config = &spec.config_toml;
        self.put_sequence(spec, config, &drive, &tables, track.imu.as_ref())
    }

    /// The same from prepared texts, tables and tracks, as merging has them.
    pub(crate) fn put_sequence(
        &self,
        spec: &SequenceSpec,
        config_toml: &str,
        drive: &Drive,
        tables: &Tables,
        imu: Option<&EurocFiles>,
    ) -> Result<(), Error> {
        if self.drives().contains_key(&spec.number) {
            return Err(Error::invalid("sequence", spec.number, "written once"));
        }
        let Tables {
            trees,
            deadwood,
            objects,
        } = tables;
        if !spec.has_deadwood && !deadwood.is_empty() {
            let rows = format!("{} rows", deadwood.len());
            return Err(Error::invalid(
                "deadwood",
                rows,
                "none: has_deadwood is false",
            ));
        }
        if spec.imu.is_some() != imu.is_some() {
            let word = |is_there| if is_there { "there" } else { "none" };
            let [found, asked] = [imu.is_some(), spec.imu.is_some()].map(word);
            let allowed = format!("the header's: {asked}");
            return Err(Error::invalid("track.imu", found, allowed));
        }
        let record = TrackRecord {
            sequence: spec.number,
            length: drive.length,
            // These are known at the end.
            frames: Vec::new(),
            world_from_frame0: drive.world_from_frame0,
            balance: drive.balance.clone(),
            stands: drive.stands,
            lines: drive.lines.clone(),
        };
        record.validate()?;
        let of_deadwood = (spec.has_deadwood).then(|| {
            let path = layout::sequence_file(spec.number, layout::DEADWOOD);
            (path, tables::encode_deadwood(deadwood))
        });
        let path = |name| layout::sequence_file(spec.number, name);
        let calibration = kitti::encode_calibration(&Calibration::of(spec));
        let mut files = Vec::new();
        let common = [
            (path(layout::CALIB), calibration),
            (path(layout::CONFIG), config_toml.to_owned()),
            (path(layout::INSTANCES), tables::encode_objects(objects)),
            (path(layout::POSES), drive.poses.clone()),
            (layout::kitti_poses(spec.number), drive.poses.clone()),
            (path(layout::TIMES), drive.times.clone()),
            (path(layout::TREES), tables::encode_trees(trees)),
        ];
        let mut put = |path: &str, text: &str| {
            let record = FileRecord::put(&self.folder, layout::inner(path), text.as_bytes());
            record.map(|record| files.push(record))
        };
        let estimated =
            (drive.estimated.as_ref()).map(|text| (path(layout::ESTIMATED_POSES), text.clone()));
        for (path, text) in common.into_iter().chain(of_deadwood).chain(estimated) {
            put(&path, &text)?;
        }
        for (name, text) in imu.into_iter().flat_map(EurocFiles::files) {
            put(&path(name), text)?;
        }
        self.drives().insert(spec.number, (record, files));
        Ok(())
    }
}

/// Checks that a frame's pose is its track's; otherwise images and `poses.txt` would contradict
/// each other.
fn check_pose(record: &FrameRecord, track: &Track) -> Result<(), Error> {
    let pose = usize::try_from(record.index)
        .ok()
        .and_then(|i| track.poses.get(i));
    let field = format!(
        "pose of frame {} in sequence {}",
        record.index, record.sequence
    );
    let Some((_, pose)) = pose else {
        return Err(Error::invalid(field, "none", "in its track"));
    };
    let rows = pose.to_rows();
    let pairs = || {
        rows.as_flattened()
            .iter()
            .zip(record.world_from_body.as_flattened())
    };
    if pairs().any(|(a, b)| (a - b).abs() > 1e-6) {
        let value = format!("{:?}", record.world_from_body);
        return Err(Error::invalid(
            field,
            value,
            format!("its track's, {rows:?}"),
        ));
    }
    Ok(())
}
