//! Reading.
use crate::*;
use nemoral_scene::{Image, LidarPoint, ObjectRecord, RigidTransform, TreeRecord, glam::Vec3};
use std::path::Path;

/// A data set on disk.
#[derive(Clone, Debug)]
pub struct Dataset {}

/// A frame, read back.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// By camera.
    pub cameras: Vec<CameraFrame>,
    /// By LiDAR.
    pub lidars: Vec<LidarFrame>,
}

/// What a camera's files hold.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraFrame {
    /// sRGB.
    pub rgb: Image<[u8; 3]>,
    /// Class ids.
    pub semantic: Image<u8>,
    /// 24-bit ids ([`nemoral_scene::ObjectId::to_image_id`]); 0 for none.
    pub instance: Image<u32>,
    /// Planar depth, metres; 0 for none.
    pub depth_m: Image<f32>,
    /// Unit normals in the optical frame; zero for none.
    pub normal: Image<Vec3>,
}

/// What a LiDAR's files hold.
#[derive(Clone, Debug, PartialEq)]
pub struct LidarFrame {
    /// `.bin`: x, y, z in metres, intensity.
    pub points: Vec<[f32; 4]>,
    /// `.label`: class id, instance id.
    pub labels: Vec<(u16, u16)>,
    /// `.ply`: everything.
    pub ply: Vec<PlyPoint>,
}

/// A vertex of the `.ply` file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlyPoint {
    /// All fields, the true id among them.
    pub point: LidarPoint,
    /// The ontology's class id.
    pub class: u8,
    /// The instance id of the `.label` file.
    pub label: u16,
}

/// `calib.txt`.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// P0 to P3: pixels from the reference camera's frame.
    pub projections: [[[f64; 4]; 3]; 4],
    /// Tr: the reference camera from the first LiDAR.
    pub camera_from_lidar: RigidTransform,
}

impl Dataset {
    /// Opens a finished data set.
    ///
    /// # Errors
    /// See [`Error`].
    pub fn open(_dir: &Path) -> Result<Self, Error> {
        todo!()
    }
    /// `dataset.json`.
    #[must_use]
    pub fn manifest(&self) -> &Manifest {
        todo!()
    }
    /// The frames that exist.
    #[must_use]
    pub fn frames(&self) -> &[FrameRecord] {
        todo!()
    }
    /// Reads the `i`-th of [`Dataset::frames`].
    ///
    /// # Errors
    /// See [`Error`].
    pub fn read_frame(&self, _i: usize) -> Result<Frame, Error> {
        todo!()
    }
    /// `poses.txt`: frame 0 of the reference camera from frame k.
    ///
    /// # Errors
    /// See [`Error`].
    pub fn poses(&self, _sequence: u32) -> Result<Vec<RigidTransform>, Error> {
        todo!()
    }
    /// `calib.txt`.
    ///
    /// # Errors
    /// See [`Error`].
    pub fn calibration(&self, _sequence: u32) -> Result<Calibration, Error> {
        todo!()
    }
    /// `times.txt`, seconds.
    ///
    /// # Errors
    /// See [`Error`].
    pub fn times(&self, _sequence: u32) -> Result<Vec<f64>, Error> {
        todo!()
    }
    /// `trees.csv`.
    ///
    /// # Errors
    /// See [`Error`].
    pub fn trees(&self) -> Result<Vec<TreeRecord>, Error> {
        todo!()
    }
    /// `instances.csv`.
    ///
    /// # Errors
    /// See [`Error`].
    pub fn objects(&self) -> Result<Vec<ObjectRecord>, Error> {
        todo!()
    }
}
