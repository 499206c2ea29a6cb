//! The data that a caller hands over to be written.

use nemoral_scene::glam::Vec3;
use nemoral_scene::{
    Annotations, ChunkCoord, DeadwoodRecord, Image, LidarPoint, ObjectRecord, RigidTransform,
    TreeRecord, TruthImages, Twist,
};

use crate::{BalanceRecord, EurocFiles, FrameChoice};

/// One frame, in memory.
#[derive(Clone, Debug)]
pub struct FrameData<'a> {
    /// The sequence's number.
    pub sequence: u32,
    /// The frame's number in its sequence.
    pub index: u64,
    /// Seconds after the start of the sequence, the middle of the exposure.
    pub time_s: f64,
    /// The body's pose in the world at that time.
    pub world_from_body: RigidTransform,
    /// How the body moves at that time. Readers need it for pictures with a rolling shutter;
    /// otherwise it may be left at zero.
    pub body_motion: Twist,
    /// Which candidate it is, if the sequence's frames are chosen among several.
    pub balance: Option<FrameChoice>,
    /// One for each camera of the header, in its order.
    pub cameras: Vec<CameraData<'a>>,
    /// One for each LiDAR of the header, in its order.
    pub lidars: Vec<LidarData<'a>>,
    /// The key of everything that went into the frame, by which a resumed run decides what to keep.
    pub frame_key: [u8; 32],
}

/// What a camera saw.
#[derive(Clone, Copy, Debug)]
pub struct CameraData<'a> {
    /// The camera's name, as in the header.
    pub name: &'a str,
    /// sRGB.
    pub rgb: &'a Image<[u8; 3]>,
    /// The light behind the lens, before exposure and sensor: linear sRGB, cd/m², of the same size;
    /// present if the header asks for it.
    pub radiance: Option<&'a Image<Vec3>>,
    /// The truth at each pixel's centre; of the same size.
    pub truth: &'a TruthImages,
    /// The further truth that the header asks for.
    pub annotations: &'a Annotations,
}

/// What a LiDAR saw.
#[derive(Clone, Copy, Debug)]
pub struct LidarData<'a> {
    /// The LiDAR's name, as in the header.
    pub name: &'a str,
    /// The returns, deskewed to the frame's time.
    pub points: &'a [LidarPoint],
    /// The chunk that the sensor is in.
    pub sensor_chunk: ChunkCoord,
}

/// The objects of the world that `trees.csv`, `deadwood.csv` and `instances.csv` list.
#[derive(Clone, Copy, Debug, Default)]
pub struct WorldTables<'a> {
    /// The trees, in any order.
    pub trees: &'a [TreeRecord],
    /// Logs and root plates, in any order; none if the sequence has no deadwood.
    pub deadwood: &'a [DeadwoodRecord],
    /// All objects with an id, trees and deadwood included, in any order.
    pub objects: &'a [ObjectRecord],
}

/// The poses of all frames of a sequence, including those that are not made here.
#[derive(Clone, Debug)]
pub struct Track {
    /// The sequence's number.
    pub sequence: u32,
    /// Time and `world_from_body` of frame 0, 1, 2, ….
    pub poses: Vec<(f64, RigidTransform)>,
    /// `world_from_body` of the same frames as a navigation system estimates them; none if there is
    /// no such system.
    pub estimated: Vec<RigidTransform>,
    /// How they were chosen, if they are not a drive.
    pub balance: Option<BalanceRecord>,
    /// Whether the body stands still at each of them, as a tripod does.
    pub stands: bool,
    /// The first frames of flight lines, from 0 on; none if it is no flight along lines.
    pub lines: Vec<u64>,
    /// What the inertial measurement unit measured, if the sequence has one.
    pub imu: Option<EurocFiles>,
}
