//! Frames, read back: all of their files, or one of a sensor.

use std::path::Path;

use nemoral_scene::glam::Vec3;
use nemoral_scene::{Flow, Image, ObjectBox};

use super::recorded;
use crate::formats::{Size, annotations, exr, images, npy, ply, scan};
use crate::{CameraFile, Dataset, DepthFormat, Error, FrameRecord, PlyPoint, layout};

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

impl Dataset {
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
        let lidars = (0..sequence.lidars.len()).map(|l| self.scan(frame, l));
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

    /// The class ids of a camera, and its depth in metres, without the other images.
    ///
    /// # Errors
    /// [`Error::Io`] and [`Error::Malformed`], naming the file.
    pub(crate) fn read_semantic_and_depth(
        &self,
        frame: &FrameRecord,
        camera: usize,
    ) -> Result<(Image<u8>, Image<f32>), Error> {
        Ok((self.classes(frame, camera)?, self.depth_m(frame, camera)?))
    }

    fn read_camera(&self, frame: &FrameRecord, camera: usize) -> Result<CameraFrame, Error> {
        let spec = &self.sequence_of(frame).cameras[camera];
        let (semantic, depth_m) = self.read_semantic_and_depth(frame, camera)?;
        Ok(CameraFrame {
            name: spec.name.clone(),
            rgb: self.picture(frame, camera)?,
            semantic,
            instance: self.instances(frame, camera)?,
            depth_m,
            normal: self.normals(frame, camera)?,
            sky: (spec.annotations.sky)
                .then(|| self.image(frame, camera, CameraFile::Sky, images::decode_mask))
                .transpose()?,
            flow: (spec.annotations.flow)
                .then(|| self.flow(frame, camera))
                .transpose()?,
            trunks: (spec.annotations.trunks)
                .then(|| self.trunks(frame, camera))
                .transpose()?,
            boxes: (spec.annotations.boxes)
                .then(|| self.boxes(frame, camera))
                .transpose()?,
            radiance: (spec.annotations.radiance)
                .then(|| self.radiance(frame, camera))
                .transpose()?,
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
}
