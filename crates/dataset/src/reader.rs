//! Reading data sets.

use std::path::Path;

use nemoral_files::{Folder, InnerPath};
use nemoral_scene::glam::Vec3;
use nemoral_scene::{
    DeadwoodRecord, Flow, Image, ObjectBox, ObjectRecord, RigidTransform, TreeRecord,
};

use crate::formats::{Size, annotations, exr, images, kitti, npy, ply, scan, tables};
use crate::{
    Calibration, CameraFile, DepthFormat, Error, FileRecord, FrameRecord, Manifest, PlyPoint,
    SequenceSpec, TrackRecord, layout, limits,
};

/// A finished data set on disk. Every file that is read is compared with its size and checksum in
/// `dataset.json`, and pictures with the sizes of their cameras before they are unpacked.
#[derive(Clone, Debug)]
pub struct Dataset {
    folder: Folder,
    manifest: Manifest,
    /// Whether `dataset.json` is unchanged since it was written.
    is_untouched: bool,
}

/// A frame, read back.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// In the header's order.
    pub cameras: Vec<CameraFrame>,
    /// In the header's order.
    pub lidars: Vec<LidarFrame>,
}

/// The content of a camera's files.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraFrame {
    /// The camera's name.
    pub name: String,
    /// sRGB.
    pub rgb: Image<[u8; 3]>,
    /// Class ids.
    pub semantic: Image<u8>,
    /// 24-bit ids ([`nemoral_scene::ObjectId::to_image_id`]); 0 for none.
    pub instance: Image<u32>,
    /// Planar depth, metres; 0 for none.
    pub depth_m: Image<f32>,
    /// Unit normals in the optical frame, within 0.4°; zero for none.
    pub normal: Image<Vec3>,
    /// 255 where nothing was hit, else 0, if it is written.
    pub sky: Option<Image<u8>>,
    /// Flow to the next frame, within 1/128 pixel, if it is written.
    pub flow: Option<Image<Option<Flow>>>,
    /// 24-bit ids of the nearest trunk, also where it is hidden, and 0 for none, if it is written.
    pub trunks: Option<Image<u32>>,
    /// Boxes around objects, if they are written.
    pub boxes: Option<Vec<ObjectBox>>,
    /// The light behind the lens, before exposure and sensor, linear sRGB, cd/m², if it is written.
    pub radiance: Option<Image<Vec3>>,
}

/// The content of a LiDAR's files.
#[derive(Clone, Debug, PartialEq)]
pub struct LidarFrame {
    /// The LiDAR's name.
    pub name: String,
    /// `.bin`: x, y, z in metres, intensity.
    pub points: Vec<[f32; 4]>,
    /// `.label`: class id, instance id.
    pub labels: Vec<(u16, u16)>,
    /// `.ply`: all fields; empty if it is not written.
    pub ply: Vec<PlyPoint>,
}

/// The message about a `dataset.json` that was changed.
pub(crate) const CHANGED: &str = "was changed after it was written: its checksum differs";

impl Dataset {
    /// Opens a finished data set.
    ///
    /// # Errors
    /// [`Error::Io`] if the folder cannot be read, [`Error::Malformed`] if it holds no data set, an
    /// unfinished one, one of another format version, or one whose `dataset.json` is not valid.
    pub fn open(dir: &Path) -> Result<Self, Error> {
        let folder = Folder::new(dir);
        if folder.kind(&layout::inner(layout::MANIFEST))?.is_none() {
            let entries = folder.entries()?;
            let message = if entries.iter().any(|e| e.name == layout::STATE) {
                "holds an unfinished data set: resume what was writing it"
            } else if !dir.is_dir() {
                "there is no such folder"
            } else {
                "holds no data set: there is no dataset.json"
            };
            return Err(Error::malformed(dir, message));
        }
        let (manifest, is_untouched) = Manifest::read(&folder)?;
        let mut dataset = Self {
            folder,
            manifest,
            is_untouched,
        };
        // It is for human readers only; `check` reports what is wrong with it. Those of sequences
        // may be too many for memory.
        let config = dataset.read_text(layout::CONFIG);
        dataset.manifest.header.config_toml = config.unwrap_or_default();
        Ok(dataset)
    }

    /// The folder.
    #[must_use]
    pub fn root(&self) -> &Path {
        self.folder.root()
    }

    /// Whether `dataset.json` is unchanged since it was written. A data set whose `dataset.json`
    /// was changed on purpose can still be read, but not merged.
    #[must_use]
    pub fn is_untouched(&self) -> bool {
        self.is_untouched
    }

    /// Whether this path leads to a file of the data set, or to a place where only its files may
    /// be.
    pub(crate) fn owns(&self, path: &Path) -> bool {
        let Some(inner) = self.folder.inner_path_of(path) else {
            // A name that no data set has may still lie in one of its folders.
            return self.folder.contains(path);
        };
        let own = [
            layout::SEQUENCES,
            layout::ALL_POSES,
            layout::INPUTS,
            layout::STATE,
            layout::MANIFEST,
        ];
        own.contains(&inner.components().next().unwrap_or_default())
            || self.manifest.files.iter().any(|f| f.path == inner)
    }

    pub(crate) fn folder(&self) -> &Folder {
        &self.folder
    }

    /// Compares `dataset.json`, and all files that belong to no frame, with their checksums.
    pub(crate) fn verify_common_files(&self) -> Result<(), Error> {
        if !self.is_untouched {
            let path = self.root().join(layout::MANIFEST);
            return Err(Error::malformed(path, CHANGED));
        }
        for file in &self.manifest.files {
            file.read(&self.folder)?;
        }
        Ok(())
    }

    /// `dataset.json`.
    #[must_use]
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// The frames that exist here, by sequence and index.
    #[must_use]
    pub fn frames(&self) -> &[FrameRecord] {
        &self.manifest.frames
    }

    /// Reads all files of the `i`-th of [`Dataset::frames`].
    ///
    /// # Errors
    /// [`Error::Io`] and [`Error::Malformed`], naming the file; [`Error::Invalid`] if there is no
    /// `i`-th frame.
    pub fn read_frame(&self, i: usize) -> Result<Frame, Error> {
        let count = self.frames().len();
        let allowed = || format!("less than {count}, the number of frames here");
        let frame = self.frames().get(i);
        let frame = frame.ok_or_else(|| Error::invalid("frame", i, allowed()))?;
        let sequence = self.sequence_of(frame);
        let cameras = (0..sequence.cameras.len()).map(|c| self.read_camera(frame, c));
        let lidars = (0..sequence.lidars.len()).map(|l| self.read_lidar(frame, l));
        Ok(Frame {
            cameras: cameras.collect::<Result<_, _>>()?,
            lidars: lidars.collect::<Result<_, _>>()?,
        })
    }

    /// The bytes of one of a camera's files, compared with their checksum.
    ///
    /// # Errors
    /// [`Error::Io`] and [`Error::Malformed`], naming the file; [`Error::Invalid`] if the camera
    /// does not write it.
    ///
    /// # Panics
    /// If the data set has fewer cameras.
    pub fn camera_bytes(
        &self,
        frame: &FrameRecord,
        camera: usize,
        file: CameraFile,
    ) -> Result<Vec<u8>, Error> {
        self.camera_file(frame, camera, file, |_, bytes| Ok(bytes.to_vec()))
    }

    /// A camera's picture, without its other files.
    ///
    /// # Errors
    /// [`Error::Io`] and [`Error::Malformed`], naming the file.
    ///
    /// # Panics
    /// If the data set has fewer cameras.
    pub fn picture(&self, frame: &FrameRecord, camera: usize) -> Result<Image<[u8; 3]>, Error> {
        self.image(frame, camera, CameraFile::Rgb, images::decode_rgb)
    }

    /// The class ids of a camera's pixels, without its other files.
    ///
    /// # Errors
    /// [`Error::Io`] and [`Error::Malformed`], naming the file.
    ///
    /// # Panics
    /// If the data set has fewer cameras.
    pub fn classes(&self, frame: &FrameRecord, camera: usize) -> Result<Image<u8>, Error> {
        self.image(frame, camera, CameraFile::Semantic, images::decode_semantic)
    }

    /// The instance ids of a camera's pixels, without its other files.
    ///
    /// # Errors
    /// [`Error::Io`] and [`Error::Malformed`], naming the file.
    ///
    /// # Panics
    /// If the data set has fewer cameras.
    pub fn instances(&self, frame: &FrameRecord, camera: usize) -> Result<Image<u32>, Error> {
        self.image(frame, camera, CameraFile::Instance, images::decode_instance)
    }

    /// A camera's planar depth in metres, without its other files.
    ///
    /// # Errors
    /// [`Error::Io`] and [`Error::Malformed`], naming the file.
    ///
    /// # Panics
    /// If the data set has fewer cameras.
    pub fn depth_m(&self, frame: &FrameRecord, camera: usize) -> Result<Image<f32>, Error> {
        let decode = match self.sequence_of(frame).depth_format {
            DepthFormat::Png16 => images::decode_depth,
            DepthFormat::Npy => npy::decode,
        };
        self.image(frame, camera, CameraFile::Depth, decode)
    }

    /// A camera's unit normals in its optical frame, without its other files; zero for none.
    ///
    /// # Errors
    /// [`Error::Io`] and [`Error::Malformed`], naming the file.
    ///
    /// # Panics
    /// If the data set has fewer cameras.
    pub fn normals(&self, frame: &FrameRecord, camera: usize) -> Result<Image<Vec3>, Error> {
        self.image(frame, camera, CameraFile::Normals, images::decode_normals)
    }

    /// A camera's flow to the next frame, without its other files.
    ///
    /// # Errors
    /// [`Error::Io`] and [`Error::Malformed`], naming the file; [`Error::Invalid`] if the camera
    /// does not write it.
    ///
    /// # Panics
    /// If the data set has fewer cameras.
    pub fn flow(&self, frame: &FrameRecord, camera: usize) -> Result<Image<Option<Flow>>, Error> {
        self.image(frame, camera, CameraFile::Flow, images::decode_flow)
    }

    /// The ids of a camera's nearest trunks, without its other files.
    ///
    /// # Errors
    /// As [`Dataset::flow`].
    ///
    /// # Panics
    /// If the data set has fewer cameras.
    pub fn trunks(&self, frame: &FrameRecord, camera: usize) -> Result<Image<u32>, Error> {
        self.image(frame, camera, CameraFile::Trunks, images::decode_instance)
    }

    /// A camera's boxes, without its other files.
    ///
    /// # Errors
    /// As [`Dataset::flow`].
    ///
    /// # Panics
    /// If the data set has fewer cameras.
    pub fn boxes(&self, frame: &FrameRecord, camera: usize) -> Result<Vec<ObjectBox>, Error> {
        self.camera_file(frame, camera, CameraFile::Boxes, annotations::decode_boxes)
    }

    /// A camera's radiance, without its other files.
    ///
    /// # Errors
    /// As [`Dataset::flow`].
    ///
    /// # Panics
    /// If the data set has fewer cameras.
    pub fn radiance(&self, frame: &FrameRecord, camera: usize) -> Result<Image<Vec3>, Error> {
        self.image(frame, camera, CameraFile::Radiance, exr::decode)
    }

    /// The files of one LiDAR.
    ///
    /// # Errors
    /// [`Error::Io`] and [`Error::Malformed`], naming the file.
    ///
    /// # Panics
    /// If the data set has fewer LiDARs.
    pub fn scan(&self, frame: &FrameRecord, lidar: usize) -> Result<LidarFrame, Error> {
        self.read_lidar(frame, lidar)
    }

    /// The class ids of a camera, and its depth in metres, without the other images.
    ///
    /// # Errors
    /// [`Error::Io`] and [`Error::Malformed`], naming the file.
    pub(crate) fn read_semantic_and_depth(
        &self,
        frame: &FrameRecord,
        camera: usize,
    ) -> Result<(Image<u8>, Image<f32>), Error> {
        use CameraFile::{Depth, Semantic};
        let decode_depth = match self.sequence_of(frame).depth_format {
            DepthFormat::Png16 => images::decode_depth,
            DepthFormat::Npy => npy::decode,
        };
        Ok((
            self.image(frame, camera, Semantic, images::decode_semantic)?,
            self.image(frame, camera, Depth, decode_depth)?,
        ))
    }

    fn read_camera(&self, frame: &FrameRecord, camera: usize) -> Result<CameraFrame, Error> {
        let spec = &self.sequence_of(frame).cameras[camera];
        use CameraFile as F;
        let (semantic, depth_m) = self.read_semantic_and_depth(frame, camera)?;
        Ok(CameraFrame {
            name: spec.name.clone(),
            rgb: self.image(frame, camera, F::Rgb, images::decode_rgb)?,
            semantic,
            instance: self.image(frame, camera, F::Instance, images::decode_instance)?,
            depth_m,
            normal: self.image(frame, camera, F::Normals, images::decode_normals)?,
            sky: (spec.annotations.sky)
                .then(|| self.image(frame, camera, F::Sky, images::decode_mask))
                .transpose()?,
            flow: (spec.annotations.flow)
                .then(|| self.image(frame, camera, F::Flow, images::decode_flow))
                .transpose()?,
            trunks: (spec.annotations.trunks)
                .then(|| self.image(frame, camera, F::Trunks, images::decode_instance))
                .transpose()?,
            boxes: (spec.annotations.boxes)
                .then(|| self.camera_file(frame, camera, F::Boxes, annotations::decode_boxes))
                .transpose()?,
            radiance: (spec.annotations.radiance)
                .then(|| self.image(frame, camera, F::Radiance, exr::decode))
                .transpose()?,
        })
    }

    fn read_lidar(&self, frame: &FrameRecord, lidar: usize) -> Result<LidarFrame, Error> {
        let sequence = self.sequence_of(frame);
        let f = layout::lidar_folders(sequence, lidar);
        Ok(LidarFrame {
            name: sequence.lidars[lidar].name.clone(),
            points: self.load(frame, &f.velodyne, "bin", scan::decode_points)?,
            labels: self.load(frame, &f.labels, "label", scan::decode_labels)?,
            ply: if sequence.lidars[lidar].ply {
                self.read_ply(frame, lidar)?
            } else {
                Vec::new()
            },
        })
    }

    /// Class and position of each point in the LiDAR's frame, from `.bin` and `.label`.
    ///
    /// # Errors
    /// [`Error::Io`] and [`Error::Malformed`], naming the file.
    pub(crate) fn read_classes_and_positions(
        &self,
        frame: &FrameRecord,
        lidar: usize,
    ) -> Result<Vec<(u8, Vec3)>, Error> {
        let f = layout::lidar_folders(self.sequence_of(frame), lidar);
        let points = self.load(frame, &f.velodyne, "bin", scan::decode_points)?;
        let labels = self.load(frame, &f.labels, "label", scan::decode_labels)?;
        let class = |(class, _): (u16, u16)| class as u8;
        let position_m = |[x, y, z, _]: [f32; 4]| Vec3::new(x, y, z);
        Ok(labels
            .into_iter()
            .zip(points)
            .map(|(l, p)| (class(l), position_m(p)))
            .collect())
    }

    /// The points of a LiDAR, without the other files.
    ///
    /// # Errors
    /// [`Error::Io`] and [`Error::Malformed`], naming the file.
    pub(crate) fn read_ply(
        &self,
        frame: &FrameRecord,
        lidar: usize,
    ) -> Result<Vec<PlyPoint>, Error> {
        let f = layout::lidar_folders(self.sequence_of(frame), lidar);
        self.load(frame, &f.points, "ply", ply::decode)
    }

    /// One file of a frame.
    fn load<T>(
        &self,
        frame: &FrameRecord,
        folder: &str,
        extension: &str,
        decode: impl Fn(&Path, &[u8]) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let path = layout::frame_file(frame.sequence, folder, frame.index, extension);
        let record = recorded(&frame.files, layout::inner(&path))?;
        decode(&record.path.below(self.root()), &record.read(&self.folder)?)
    }

    /// One file of a camera.
    fn camera_file<T>(
        &self,
        frame: &FrameRecord,
        camera: usize,
        file: CameraFile,
        decode: impl Fn(&Path, &[u8]) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let sequence = self.sequence_of(frame);
        let folder = layout::camera_folder(sequence, camera, file);
        self.load(frame, &folder, file.extension(sequence), decode)
    }

    /// One image of a frame. Its size must be the camera's, which is known before memory is
    /// allocated.
    fn image<T>(
        &self,
        frame: &FrameRecord,
        camera: usize,
        file: CameraFile,
        decode: impl Fn(&Path, &[u8], Size) -> Result<Image<T>, Error>,
    ) -> Result<Image<T>, Error> {
        let k = &self.sequence_of(frame).cameras[camera].intrinsics;
        let size = (k.width as usize, k.height as usize);
        self.camera_file(frame, camera, file, |path, bytes| decode(path, bytes, size))
    }

    fn load_text<T>(
        &self,
        path: &str,
        decode: impl Fn(&Path, &str) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let record = recorded(&self.manifest.files, layout::inner(path))?;
        decode(
            &record.path.below(self.root()),
            &record.read_text(&self.folder)?,
        )
    }

    /// The sequence of a frame of this data set.
    ///
    /// # Panics
    /// If the frame is another data set's, whose sequence this one does not have.
    #[must_use]
    pub fn sequence_of(&self, frame: &FrameRecord) -> &SequenceSpec {
        let sequence = self.manifest.header.sequence(frame.sequence);
        sequence.expect("a manifest's frames are of its sequences")
    }

    /// The record of a sequence's drive.
    ///
    /// # Errors
    /// [`Error::Invalid`] if there is no such sequence here.
    pub fn track(&self, sequence: u32) -> Result<&TrackRecord, Error> {
        let tracks = &self.manifest.tracks;
        let at = tracks.binary_search_by_key(&sequence, |t| t.sequence);
        at.map(|i| &tracks[i])
            .map_err(|_| Error::invalid("sequence", sequence, "one with frames here"))
    }

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

    pub(crate) fn read_text(&self, relative: &str) -> Result<String, Error> {
        self.load_text(relative, |_, text| Ok(text.to_owned()))
    }
}

/// The record of a file; a manifest lists all files of the layout, by path.
fn recorded(files: &[FileRecord], path: InnerPath) -> Result<&FileRecord, Error> {
    files
        .binary_search_by(|f| f.path.cmp(&path))
        .map(|i| &files[i])
        .map_err(|_| Error::invalid("file", path, "one that dataset.json lists"))
}
