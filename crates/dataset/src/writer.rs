//! Writing data sets: from several threads, and so that a run that was killed at any moment can be
//! resumed.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use nemoral_files::{Folder, Lock, Syncer};
use nemoral_scene::{Image, Semantic};

use crate::formats::kitti::{self, Calibration};
use crate::formats::tables::Tables;
use crate::formats::{data_card, images, ontology_yaml, ply, scan, tables};
use crate::manifest::ranges;
use crate::output::{self, Content};
use crate::{
    BalanceRecord, CameraData, CameraFile, Dataset, DatasetHeader, Error, FORMAT_VERSION,
    FileRecord, FrameData, FrameRecord, ImuTexts, LidarData, Manifest, PlyPoint, SequenceSpec,
    Track, TrackRecord, WorldTables, layout, limits, output::compare, output::state,
};

/// What to do with an output folder that is not empty.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OpenMode {
    /// The folder must be new or empty.
    #[default]
    Fresh,
    /// Continue the data set in the folder, finished or not, if its header is equal; like `Fresh`
    /// if the folder is new or empty.
    Resume,
    /// Remove the data set in the folder first, but no other files; like `Fresh` if the folder is
    /// new or empty.
    Overwrite,
}

/// Writes a data set into a folder.
///
/// While it is unfinished the folder holds `.nemoral/`: the header, a record for each whole frame,
/// and a lock against a second writer. [`Writer::finish`] moves all of it into `dataset.json`. A
/// writer that is dropped, or whose process is killed, leaves a folder that [`OpenMode::Resume`]
/// can continue.
///
/// That holds after a power cut, too. The header is on the medium before the first frame is begun.
/// The files of frames are synced in the background; those that a power cut damages are found by
/// their checksums and made again. All files that `dataset.json` names are on the medium before it
/// gets its name.
#[derive(Debug)]
pub struct Writer {
    folder: Folder,
    header: DatasetHeader,
    class_ids: [u8; Semantic::ALL.len()],
    records: Mutex<BTreeMap<(u32, u64), FrameRecord>>,
    /// The sequences whose own files are written, with these.
    drives: Mutex<BTreeMap<u32, (TrackRecord, Vec<FileRecord>)>>,
    syncer: Mutex<Syncer>,
    /// It is held and not used.
    _lock: Lock,
}

impl Writer {
    /// Tests whether [`Writer::create`] would accept this folder and header. It leaves nothing
    /// behind.
    ///
    /// # Errors
    /// Those of [`Writer::create`].
    pub fn probe(out: &Path, mode: OpenMode, header: &DatasetHeader) -> Result<(), Error> {
        header.validate()?;
        let folder = Folder::new(out);
        Self::admit(&folder, mode, header, &output::look(&folder)?)?;
        Ok(folder.probe()?)
    }

    /// Decides whether this folder may be written to.
    fn admit(
        folder: &Folder,
        mode: OpenMode,
        header: &DatasetHeader,
        content: &Content,
    ) -> Result<(), Error> {
        let out = folder.root();
        if let (Content::Dataset { header, .. }, OpenMode::Resume | OpenMode::Overwrite) =
            (content, mode)
        {
            // A link among the folders is refused here, before anything is changed.
            output::owned_files(folder, header)?;
        }
        match (content, mode) {
            (Content::Dataset { finished, .. }, OpenMode::Fresh) => Err(Error::Exists {
                path: out.to_owned(),
                finished: finished.is_some(),
            }),
            (Content::Dataset { header: found, .. }, OpenMode::Resume) => {
                // A data set may get further sequences.
                let mut known = header.clone();
                (known.sequences).retain(|s| found.sequence(s.number).is_some());
                compare::compare(out, found, &known)
            }
            _ => Ok(()),
        }
    }

    /// Opens an output folder, and makes it if necessary. Nothing is changed if there is an error.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a header with impossible names, sizes or mounts; [`Error::Foreign`],
    /// [`Error::Exists`], [`Error::Damaged`] and [`Error::Unowned`] for a folder that may not be
    /// written to; [`Error::Mismatch`] for a resume with another header; [`Error::Busy`];
    /// [`Error::Malformed`] for a link where a file or folder of the data set should be; and
    /// [`Error::Io`].
    pub fn create(out: &Path, mode: OpenMode, header: DatasetHeader) -> Result<Self, Error> {
        header.validate()?;
        let folder = Folder::new(out);
        Self::admit(&folder, mode, &header, &output::look(&folder)?)?;
        let lock = state::lock(&folder)?;
        // Another writer may have ended between the first look and the lock.
        let content = output::look(&folder)?;
        Self::admit(&folder, mode, &header, &content)?;
        let mut records = BTreeMap::new();
        if let Content::Dataset {
            finished,
            header: found,
        } = content
        {
            if mode == OpenMode::Overwrite {
                output::clear(&folder, &found)?;
            } else {
                output::remove_leftovers(&folder, &found)?;
                let of_manifest = finished.map(|m| m.frames).unwrap_or_default();
                records.extend(of_manifest.into_iter().map(|f| ((f.sequence, f.index), f)));
                for (at, record) in state::records(&folder, &found)? {
                    match record {
                        Some(record) => records.insert(at, record),
                        None => records.remove(&at),
                    };
                }
            }
        }
        // This includes the files of a writer that was killed before its header was whole.
        output::remove_leftovers(&folder, &header)?;
        state::put_header(&folder, &header)?;
        Ok(Self {
            class_ids: images::class_ids(&header.ontology),
            header,
            records: Mutex::new(records),
            drives: Mutex::default(),
            syncer: Mutex::new(Syncer::start(folder.clone())?),
            folder,
            _lock: lock,
        })
    }

    /// Whether this frame is here, whole, and made from this key. It reads the files and compares
    /// sizes and checksums.
    #[must_use]
    pub fn has_frame(&self, sequence: u32, index: u64, frame_key: &[u8; 32]) -> bool {
        let record = self.lock().get(&(sequence, index)).cloned();
        record.is_some_and(|r| r.key == hex(frame_key) && self.is_whole(&r))
    }

    /// Whether a frame's files agree with their records.
    fn is_whole(&self, record: &FrameRecord) -> bool {
        record.files.iter().all(|f| f.read(&self.folder).is_ok())
    }

    /// What decides the bytes.
    #[must_use]
    pub fn header(&self) -> &DatasetHeader {
        &self.header
    }

    /// The frames recorded so far by (sequence, index), those of earlier runs included: each of
    /// their sequences must be [written](Self::write_sequence) before the end.
    #[must_use]
    pub fn frames(&self) -> Vec<(u32, u64)> {
        self.lock().keys().copied().collect()
    }

    /// Writes a frame, replacing an earlier one; it may be called from several threads at once.
    /// Each file appears under its final name only when it is whole, and the frame's record comes
    /// last, so that after an error or a kill the frame counts as missing.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the frame does not fit the header, or is at a time or a place that no
    /// data set has, before anything is written; [`Error::Io`] names the file that could not be
    /// written (disk full, no permission).
    pub fn write_frame(&self, frame: &FrameData<'_>) -> Result<FrameRecord, Error> {
        let sequence = self.sequence(frame.sequence)?;
        self.validate(sequence, frame)?;
        let mut record = self.record(frame);
        // What `dataset.json` cannot list is refused before any of it is written, not at the end
        // of all work.
        record.validate_numbers(sequence)?;
        let at = (frame.sequence, frame.index);
        if self.lock().remove(&at).is_some() {
            state::put_record(&self.folder, frame.sequence, frame.index, None)?;
        }
        let mut files = Vec::new();
        for (i, camera) in frame.cameras.iter().enumerate() {
            self.put_camera(sequence, frame, i, camera, &mut files)?;
        }
        for (i, lidar) in frame.lidars.iter().enumerate() {
            let points = self.points(lidar);
            let f = layout::lidar_folders(sequence, i);
            let mut put = |folder: &str, extension, bytes: Vec<u8>| {
                self.put_frame_file(frame, folder, extension, &bytes, &mut files)
            };
            put(&f.velodyne, "bin", scan::encode_points(&points))?;
            put(&f.labels, "label", scan::encode_labels(&points))?;
            if sequence.lidars[i].ply {
                put(&f.points, "ply", ply::encode(&points))?;
            }
        }
        files.sort_by(|a, b| a.path.cmp(&b.path));
        record.files = files;
        // Files may be too large.
        record.validate(sequence)?;
        self.enter(record.clone())?;
        Ok(record)
    }

    /// The record of a frame without its files.
    fn record(&self, frame: &FrameData<'_>) -> FrameRecord {
        FrameRecord {
            sequence: frame.sequence,
            index: frame.index,
            time_s: frame.time_s,
            key: hex(&frame.frame_key),
            world_from_body: frame.world_from_body.to_rows(),
            body_motion: frame.body_motion,
            balance: frame.balance.clone(),
            sensor_chunks: frame.lidars.iter().map(|l| l.sensor_chunk.into()).collect(),
            point_classes: self.point_classes(frame),
            files: Vec::new(),
        }
    }

    /// How many LiDAR points of a frame have each class.
    fn point_classes(&self, frame: &FrameData<'_>) -> BTreeMap<u8, u64> {
        let mut counts = [0_u64; 256];
        for point in frame.lidars.iter().flat_map(|lidar| lidar.points) {
            counts[usize::from(self.class_ids[point.semantic as usize])] += 1;
        }
        let classes = (0..=u8::MAX).zip(counts);
        classes.filter(|(_, count)| *count > 0).collect()
    }

    /// Records a whole frame and queues its files to be synced.
    fn enter(&self, record: FrameRecord) -> Result<(), Error> {
        state::put_record(&self.folder, record.sequence, record.index, Some(&record))?;
        let syncer = self.syncer.lock().unwrap_or_else(PoisonError::into_inner);
        for file in &record.files {
            syncer.push(file.path.clone());
        }
        drop(syncer);
        self.lock().insert((record.sequence, record.index), record);
        Ok(())
    }

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
        imu: Option<&ImuTexts>,
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
        for (name, text) in imu.into_iter().flat_map(ImuTexts::files) {
            put(&path(name), text)?;
        }
        self.drives().insert(spec.number, (record, files));
        Ok(())
    }

    /// Writes the files of the whole data set, `dataset.json` last, and removes `.nemoral/`.
    ///
    /// # Errors
    /// [`Error::Invalid`] if a sequence with frames was not [written](Self::write_sequence);
    /// [`Error::Io`].
    pub fn finish(self) -> Result<Manifest, Error> {
        let frames: Vec<FrameRecord> = self.lock().values().cloned().collect();
        let mut manifest = Manifest {
            format_version: FORMAT_VERSION,
            header: self.header.clone(),
            tracks: Vec::new(),
            files: Vec::new(),
            frames,
        };
        for (mut track, files) in std::mem::take(&mut *self.drives()).into_values() {
            let first = (manifest.frames).partition_point(|f| f.sequence < track.sequence);
            let of_track = manifest.frames[first..].iter();
            let of_track = of_track.take_while(|f| f.sequence == track.sequence);
            track.frames = ranges(of_track.map(|f| f.index));
            manifest.tracks.push(track);
            manifest.files.extend(files);
        }
        for (path, asked) in self.header.inputs() {
            let content = self.header.input_files.get(path).filter(|bytes| {
                // A file that differs from its record would make the data set unreadable.
                FileRecord::of(path.clone(), bytes) == *asked
            });
            let content = content.ok_or_else(|| {
                let allowed = "the content that the sequences' inputs record";
                Error::invalid(format!("input_files.{path}"), "none, or another", allowed)
            })?;
            let record = FileRecord::put(&self.folder, path.clone(), content)?;
            manifest.files.push(record);
        }
        let ontology = ontology_yaml::encode(&self.header, &manifest.point_classes());
        for (name, text) in [
            (layout::README, data_card::encode(&manifest)),
            (layout::CONFIG, self.header.config_toml.clone()),
            (layout::ONTOLOGY, ontology),
        ] {
            let record = FileRecord::put(&self.folder, layout::inner(name), text.as_bytes())?;
            manifest.files.push(record);
        }
        manifest.files.sort_by(|a, b| a.path.cmp(&b.path));
        // A resumed folder may hold frames that no track knows.
        manifest.validate()?;
        let syncer = self
            .syncer
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner);
        // Files of earlier runs are synced too, as nothing says how those runs ended. Syncing a
        // file twice costs little.
        for file in manifest
            .files
            .iter()
            .chain(manifest.frames.iter().flat_map(|f| &f.files))
        {
            syncer.push(file.path.clone());
        }
        syncer.finish()?;
        let path = layout::inner(layout::MANIFEST);
        self.folder
            .put_synced(&path, manifest.to_json().as_bytes())?;
        state::remove(&self.folder)?;
        Ok(manifest)
    }

    /// Takes over a frame of another data set with an equal header, if it is whole there and not
    /// yet here.
    pub(crate) fn adopt(&self, from: &Dataset, record: &FrameRecord) -> Result<(), Error> {
        let ours = self.lock().get(&(record.sequence, record.index)).cloned();
        if let Some(ours) = ours {
            if ours != *record {
                return Err(Error::Mismatch {
                    path: from.root().to_owned(),
                    field: format!("frame {} of sequence {}", record.index, record.sequence),
                    found: record.key.clone(),
                    asked: ours.key.clone(),
                });
            }
            if self.is_whole(&ours) {
                return Ok(());
            }
        }
        for file in &record.files {
            let bytes = file.read(from.folder())?;
            self.folder.put(&file.path, &bytes)?;
        }
        self.enter(record.clone())
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<(u32, u64), FrameRecord>> {
        // Every insertion and removal is one step, so a panic of another thread leaves the map
        // consistent.
        self.records.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What decides the bytes of a sequence.
    fn sequence(&self, number: u32) -> Result<&SequenceSpec, Error> {
        let known = self.header.sequence(number);
        known.ok_or_else(|| Error::invalid("sequence", number, "one of the header's"))
    }

    fn drives(&self) -> MutexGuard<'_, BTreeMap<u32, (TrackRecord, Vec<FileRecord>)>> {
        self.drives.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn validate(&self, h: &SequenceSpec, frame: &FrameData<'_>) -> Result<(), Error> {
        let name = format!("frame {}", frame.index);
        let asked: Vec<&str> = h.cameras.iter().map(|c| &*c.name).collect();
        let found: Vec<&str> = frame.cameras.iter().map(|c| c.name).collect();
        if asked != found {
            let (found, asked) = (format!("{found:?}"), format!("the header's {asked:?}"));
            return Err(Error::invalid(format!("{name}.cameras"), found, asked));
        }
        let asked: Vec<&str> = h.lidars.iter().map(|l| &*l.name).collect();
        let found: Vec<&str> = frame.lidars.iter().map(|l| l.name).collect();
        if asked != found {
            let (found, asked) = (format!("{found:?}"), format!("the header's {asked:?}"));
            return Err(Error::invalid(format!("{name}.lidars"), found, asked));
        }
        for (camera, spec) in frame.cameras.iter().zip(&h.cameras) {
            let asked = (
                spec.intrinsics.width as usize,
                spec.intrinsics.height as usize,
            );
            let t = camera.truth;
            let sizes = [
                ("rgb", size(camera.rgb)),
                ("semantic", size(&t.semantic)),
                ("object", size(&t.object)),
                ("depth", size(&t.depth_m)),
                ("normal", size(&t.normal)),
            ];
            let e = camera.annotations;
            for (what, asked, given) in [
                ("flow", spec.annotations.flow, e.flow.is_some()),
                ("trunks", spec.annotations.trunks, e.trunks.is_some()),
                ("boxes", spec.annotations.boxes, e.boxes.is_some()),
                (
                    "radiance",
                    spec.annotations.radiance,
                    camera.radiance.is_some(),
                ),
            ] {
                if asked && !given {
                    let field = format!("{name}.{}.{what}", camera.name);
                    return Err(Error::invalid(
                        field,
                        "none",
                        "there: the header asks for it",
                    ));
                }
            }
            let more = [
                e.flow.as_ref().map(|i| ("flow", size(i))),
                e.trunks.as_ref().map(|i| ("trunks", size(i))),
                camera.radiance.map(|i| ("radiance", size(i))),
            ];
            for (image, found) in sizes.into_iter().chain(more.into_iter().flatten()) {
                if found != asked {
                    return Err(Error::invalid(
                        format!("{name}.{}.{image}", camera.name),
                        format!("{} × {}", found.0, found.1),
                        format!("{} × {}", asked.0, asked.1),
                    ));
                }
            }
        }
        for lidar in &frame.lidars {
            let points = lidar.points.len();
            if points as u64 > limits::MAX_POINTS {
                let field = format!("{name}.{}.points", lidar.name);
                let allowed = format!("at most {}", limits::MAX_POINTS);
                return Err(Error::invalid(field, points, allowed));
            }
            if let Some(p) = lidar.points.iter().find(|p| !ply::holds(p)) {
                let found = format!("{} at {} ns", p.pulse, p.time_ns);
                let allowed = format!("below 2^31, {}", ply::MOST_TIME);
                return Err(Error::invalid(
                    format!("{name}.{}.pulse", lidar.name),
                    found,
                    allowed,
                ));
            }
        }
        Ok(())
    }

    fn put_frame_file(
        &self,
        frame: &FrameData<'_>,
        folder: &str,
        extension: &str,
        bytes: &[u8],
        files: &mut Vec<FileRecord>,
    ) -> Result<(), Error> {
        let path = layout::frame_file(frame.sequence, folder, frame.index, extension);
        files.push(FileRecord::put(&self.folder, layout::inner(&path), bytes)?);
        Ok(())
    }

    fn put_camera(
        &self,
        sequence: &SequenceSpec,
        frame: &FrameData<'_>,
        i: usize,
        camera: &CameraData<'_>,
        files: &mut Vec<FileRecord>,
    ) -> Result<(), Error> {
        for file in CameraFile::ALL {
            if let Some(bytes) = file.encode(sequence, &self.header.ontology, i, camera) {
                let extension = file.extension(sequence);
                let folder = layout::camera_folder(sequence, i, file);
                self.put_frame_file(frame, &folder, extension, &bytes, files)?;
            }
        }
        Ok(())
    }

    fn points(&self, lidar: &LidarData<'_>) -> Vec<PlyPoint> {
        lidar
            .points
            .iter()
            .map(|&point| PlyPoint {
                point,
                class: self.class_ids[point.semantic as usize],
                label: point.object.to_label_id(lidar.sensor_chunk),
            })
            .collect()
    }
}

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

fn size<T>(image: &Image<T>) -> (usize, usize) {
    (image.width(), image.height())
}

fn hex(key: &[u8; 32]) -> String {
    key.iter().map(|b| format!("{b:02x}")).collect()
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
