//! What is converted: a data set, as sequences with their sensors and frames.
//!
//! All reading of a data set's header is here, so that no format knows where sensors are written.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use nemoral_dataset::{
    CameraFile, CameraSpec, Dataset, DepthFormat, EurocFiles, FrameProgress, FrameRecord,
    ImuReading, ImuSpec, LidarFrame, LidarSpec, Manifest, ProgressMonitor, SequenceSpec, SiteSpec,
    Split, TrackRecord,
};
use nemoral_scene::{
    ChunkCoord, Flow, Image, ObjectBox, ObjectRecord, Ontology, RigidTransform, TreeRecord,
};

use crate::Error;

/// A finished data set that is being converted. Every file that is read is compared with its
/// checksum.
#[derive(Clone, Debug)]
pub struct Source {
    dataset: Dataset,
    monitor: ProgressMonitor,
    /// How many frames the monitor knows to be done.
    told: Arc<AtomicUsize>,
}

/// A drive with its own sensors.
#[derive(Clone, Copy, Debug)]
pub struct Sequence<'a> {
    /// Its number.
    pub number: u32,
    /// Its cameras, the reference camera first.
    pub cameras: &'a [CameraSpec],
    /// Its LiDARs, the reference LiDAR first.
    pub lidars: &'a [LidarSpec],
    /// Its inertial measurement unit, if it has one.
    pub imu: Option<&'a ImuSpec>,
    /// Where its world lies on the earth; `None` if it is invented.
    pub site: Option<SiteSpec>,
}

/// A frame that exists, by sequence and index.
#[derive(Clone, Copy, Debug)]
pub struct FrameRef<'a> {
    /// The sequence's number.
    pub sequence: u32,
    /// The frame's number in its sequence.
    pub index: u64,
    /// Seconds after the start of the sequence.
    pub time_s: f64,
    record: &'a FrameRecord,
}

impl Source {
    /// Opens a data set.
    ///
    /// # Errors
    /// As [`Dataset::open`].
    pub fn open(dir: &Path) -> Result<Self, Error> {
        Ok(Self {
            dataset: Dataset::open(dir)?,
            monitor: ProgressMonitor::default(),
            told: Arc::default(),
        })
    }

    /// The same, with news of each frame: it is done when files of a later one are read.
    #[must_use]
    pub fn with_progress(self, monitor: ProgressMonitor) -> Self {
        Self { monitor, ..self }
    }

    /// Tells the monitor that the frames before this one are done.
    fn reach(&self, frame: &FrameRef<'_>) -> Result<(), Error> {
        let place = (frame.sequence, frame.index);
        let frames = self.dataset.frames();
        self.tell(frames.partition_point(|f| (f.sequence, f.index) < place))
    }

    /// Tells the monitor that all frames are done.
    pub(crate) fn finish(&self) -> Result<(), Error> {
        self.tell(self.frame_count())
    }

    fn tell(&self, done: usize) -> Result<(), Error> {
        if done <= self.told.fetch_max(done, Ordering::Relaxed) {
            return Ok(());
        }
        let last = &self.dataset.frames()[done - 1];
        Ok(self.monitor.tell(FrameProgress {
            done: done as u64,
            total: self.frame_count() as u64,
            sequence: last.sequence,
            frame: last.index,
        })?)
    }

    /// The data set's folder.
    #[must_use]
    pub fn root(&self) -> &Path {
        self.dataset.root()
    }

    pub(crate) fn manifest(&self) -> &Manifest {
        self.dataset.manifest()
    }

    /// BLAKE3 of `dataset.json`, which has the checksums of all files.
    #[must_use]
    pub fn digest(&self) -> &str {
        self.dataset.digest()
    }

    /// The program that made the data set, with its version.
    #[must_use]
    pub fn generator(&self) -> String {
        let header = &self.manifest().header;
        format!("{} {}", header.generator, header.version)
    }

    /// The licence that the user gives the data.
    #[must_use]
    pub fn licence(&self) -> &str {
        &self.manifest().header.licence
    }

    /// The classes of pictures and scans.
    #[must_use]
    pub fn ontology(&self) -> &Ontology {
        &self.manifest().header.ontology
    }

    /// The sequences that have frames, by number. Of the others nothing may exist, tables neither:
    /// a part of a data set knows all sequences of the whole.
    pub fn sequences(&self) -> impl Iterator<Item = Sequence<'_>> {
        let sequences = self.manifest().header.sequences.iter();
        let made = sequences.filter(move |s| self.frames(s.number).next().is_some());
        made.map(|s| Sequence {
            number: s.number,
            cameras: &s.cameras,
            lidars: &s.lidars,
            imu: s.imu.as_ref(),
            site: s.site,
        })
    }

    /// The [`split`](Self::split) of a sequence; `None` if the data set is not split.
    #[must_use]
    pub fn own_split(&self, sequence: u32) -> Option<Split> {
        let mut all = self.manifest().header.sequences.iter();
        let has_splits = all.any(|s| s.split.is_some());
        has_splits.then(|| self.split(sequence))
    }

    /// The split of a sequence: the data set's own. If it has none, the last one of several
    /// sequences with frames is for validation, and all others are for training.
    #[must_use]
    pub fn split(&self, sequence: u32) -> Split {
        let own = self.manifest().header.sequence(sequence);
        if let Some(split) = own.and_then(|spec| spec.split) {
            return split;
        }
        let mut all = self.manifest().header.sequences.iter();
        if all.any(|s| s.split.is_some()) {
            return Split::Train;
        }
        // A single one is for training.
        let last = self.sequences().skip(1).last();
        if last.is_some_and(|last| last.number == sequence) {
            Split::Val
        } else {
            Split::Train
        }
    }

    /// The frames of a sequence that exist, by index.
    pub fn frames(&self, sequence: u32) -> impl Iterator<Item = FrameRef<'_>> {
        let frames = self.dataset.frames();
        let first = frames.partition_point(|f| f.sequence < sequence);
        let of_sequence = frames[first..]
            .iter()
            .take_while(move |f| f.sequence == sequence);
        of_sequence.map(|record| FrameRef {
            sequence: record.sequence,
            index: record.index,
            time_s: record.time_s,
            record,
        })
    }

    /// The number of frames that exist, of all sequences.
    #[must_use]
    pub fn frame_count(&self) -> usize {
        self.dataset.frames().len()
    }

    /// The bytes of one of a camera's files.
    ///
    /// # Errors
    /// [`Error::Dataset`], naming the file, or if the camera does not write it.
    pub fn camera_bytes(
        &self,
        frame: &FrameRef<'_>,
        camera: usize,
        file: CameraFile,
    ) -> Result<Vec<u8>, Error> {
        self.reach(frame)?;
        Ok(self.dataset.camera_bytes(frame.record, camera, file)?)
    }

    /// The bytes of a camera's picture, a PNG of 8-bit sRGB.
    ///
    /// # Errors
    /// [`Error::Dataset`], naming the file.
    pub fn picture_bytes(&self, frame: &FrameRef<'_>, camera: usize) -> Result<Vec<u8>, Error> {
        self.camera_bytes(frame, camera, CameraFile::Rgb)
    }

    /// A camera's picture.
    ///
    /// # Errors
    /// [`Error::Dataset`], naming the file.
    pub fn picture(&self, frame: &FrameRef<'_>, camera: usize) -> Result<Image<[u8; 3]>, Error> {
        self.reach(frame)?;
        Ok(self.dataset.picture(frame.record, camera)?)
    }

    /// The class ids of a camera's pixels.
    ///
    /// # Errors
    /// [`Error::Dataset`], naming the file.
    pub fn classes(&self, frame: &FrameRef<'_>, camera: usize) -> Result<Image<u8>, Error> {
        self.reach(frame)?;
        Ok(self.dataset.classes(frame.record, camera)?)
    }

    /// The instance ids of a camera's pixels; 0 for none.
    ///
    /// # Errors
    /// [`Error::Dataset`], naming the file.
    pub fn instances(&self, frame: &FrameRef<'_>, camera: usize) -> Result<Image<u32>, Error> {
        self.reach(frame)?;
        Ok(self.dataset.instances(frame.record, camera)?)
    }

    /// A camera's planar depth, metres; 0 for none, and infinite for what is farther than the file
    /// can say: of such a place nothing is known but that something is there.
    ///
    /// # Errors
    /// [`Error::Dataset`], naming the file.
    pub fn depth_m(&self, frame: &FrameRef<'_>, camera: usize) -> Result<Image<f32>, Error> {
        self.reach(frame)?;
        let depth_m = self.dataset.depth_m(frame.record, camera)?;
        Ok(match self.depth_format(frame.sequence).farthest_m() {
            Some(most_m) => depth_m.map(|&z| if z < most_m { z } else { f32::INFINITY }),
            None => depth_m,
        })
    }

    /// A camera's flow to the next frame.
    ///
    /// # Errors
    /// [`Error::Dataset`], naming the file, or if the camera does not write it.
    pub fn flow(&self, frame: &FrameRef<'_>, camera: usize) -> Result<Image<Option<Flow>>, Error> {
        self.reach(frame)?;
        Ok(self.dataset.flow(frame.record, camera)?)
    }

    /// A camera's boxes around objects.
    ///
    /// # Errors
    /// [`Error::Dataset`], naming the file, or if the camera does not write it.
    pub fn boxes(&self, frame: &FrameRef<'_>, camera: usize) -> Result<Vec<ObjectBox>, Error> {
        self.reach(frame)?;
        Ok(self.dataset.boxes(frame.record, camera)?)
    }

    /// How a sequence's depth is stored.
    fn depth_format(&self, sequence: u32) -> DepthFormat {
        let spec = self.manifest().header.sequence(sequence);
        spec.map_or_else(DepthFormat::default, |spec| spec.depth_format)
    }

    /// What LAZ adds to the times of a sequence, seconds.
    pub(crate) fn las_time_shift_s(&self, sequence: u32) -> f64 {
        let spec = self.manifest().header.sequence(sequence);
        spec.map_or(0.0, SequenceSpec::las_time_shift_s)
    }

    /// A LiDAR's scan.
    ///
    /// # Errors
    /// [`Error::Dataset`], naming the file.
    pub fn scan(&self, frame: &FrameRef<'_>, lidar: usize) -> Result<LidarFrame, Error> {
        self.reach(frame)?;
        Ok(self.dataset.scan(frame.record, lidar)?)
    }

    /// When the first and the last point of a LiDAR were fired, over all scans of a sequence:
    /// nanoseconds after the frame's time, which is between them; 0 if there are no such points.
    /// The monitor is told nothing of it, as no frame is done.
    pub(crate) fn firing_span_ns(&self, sequence: u32, lidar: usize) -> Result<(i64, i64), Error> {
        let (mut first_ns, mut last_ns) = (0, 0);
        for frame in self.frames(sequence) {
            for p in self.dataset.scan(frame.record, lidar)?.ply {
                first_ns = p.point.time_ns.min(first_ns);
                last_ns = p.point.time_ns.max(last_ns);
            }
        }
        Ok((first_ns, last_ns))
    }

    /// The poses of a sequence; `None` if there is no such sequence.
    pub(crate) fn track(&self, sequence: u32) -> Option<&TrackRecord> {
        let mut tracks = self.manifest().tracks.iter();
        tracks.find(|track| track.sequence == sequence)
    }

    /// What the inertial measurement unit of a sequence measured along the whole drive, in the
    /// order of time; nothing if it has none.
    ///
    /// # Errors
    /// [`Error::Dataset`], naming the file.
    pub fn imu(&self, sequence: u32) -> Result<Vec<ImuReading>, Error> {
        Ok(self.dataset.imu(sequence)?)
    }

    /// The files of a sequence's unit, as the EuRoC MAV data set has them; `None` if it has none.
    ///
    /// # Errors
    /// [`Error::Dataset`], naming the file.
    pub fn imu_files(&self, sequence: u32) -> Result<Option<EurocFiles>, Error> {
        Ok(self.dataset.imu_files(sequence)?)
    }

    /// The body's pose in the world at each frame of the whole sequence, as a navigation system
    /// estimates it; `None` if the sequence has none.
    ///
    /// # Errors
    /// [`Error::Dataset`], naming the file.
    pub fn estimated_world_from_body(
        &self,
        sequence: u32,
    ) -> Result<Option<Vec<RigidTransform>>, Error> {
        Ok(self.dataset.estimated_world_from_body(sequence)?)
    }

    /// All objects of a sequence with an id.
    ///
    /// # Errors
    /// [`Error::Dataset`], naming the file.
    pub fn objects(&self, sequence: u32) -> Result<Vec<ObjectRecord>, Error> {
        Ok(self.dataset.objects(sequence)?)
    }

    /// All trees of a sequence, in the order of `trees.csv`.
    ///
    /// # Errors
    /// [`Error::Dataset`], naming the file.
    pub fn trees(&self, sequence: u32) -> Result<Vec<TreeRecord>, Error> {
        Ok(self.dataset.trees(sequence)?)
    }
}

impl Sequence<'_> {
    /// The mount of the reference sensor: the first camera, or the first LiDAR if there is none.
    #[must_use]
    pub fn body_from_reference(&self) -> RigidTransform {
        let camera = self.cameras.first().map(|c| c.body_from_camera);
        let lidar = self.lidars.first().map(|l| l.body_from_lidar);
        camera.or(lidar).unwrap_or(RigidTransform::IDENTITY)
    }
}

impl FrameRef<'_> {
    /// The body's pose in the world.
    #[must_use]
    pub fn world_from_body(&self) -> RigidTransform {
        self.record.world_from_body()
    }

    /// The chunk in which a LiDAR stood, which instances of `.label` files are relative to.
    pub(crate) fn sensor_chunk(&self, lidar: usize) -> ChunkCoord {
        let [x, y] = self.record.sensor_chunks[lidar];
        ChunkCoord::new(x, y)
    }

    /// `SS_FFFFFF`, unique in the data set.
    #[must_use]
    pub fn name(&self) -> String {
        format!("{:02}_{:06}", self.sequence, self.index)
    }
}
