//! LiDAR points.

use glam::Vec3;

use crate::{ObjectId, Semantic};

/// Flags of a [`LidarPoint`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct PointFlags(pub u8);

impl PointFlags {
    /// The return comes from more than one surface, or from one that the middle of the beam misses.
    /// The point is written on the middle, where there need not be a surface.
    pub const MIXED: u8 = 1;
    /// The return is a false alarm without a surface, or an echo of the air.
    pub const FALSE_ALARM: u8 = 2;
    /// The light was mirrored by the surface of a liquid on its way out and back. The point lies on
    /// the pulse, behind that surface, at the range of the whole path; semantic, object and
    /// incidence are of what the light met, and the normal is of its mirror image.
    pub const MIRRORED: u8 = 4;
    /// What was hit grows on the stem of a tree, as ivy, honeysuckle and moss do.
    pub const ON_STEM: u8 = 8;
    /// What was hit grows on the branches of a tree, as clematis does.
    pub const ON_BRANCH: u8 = 16;

    /// The flag that says what holds a surface, by its material's [support]; 0 of what stands by
    /// itself.
    ///
    /// [support]: crate::Material::support
    #[must_use]
    pub const fn of_support(support: Option<Semantic>) -> u8 {
        match support {
            Some(Semantic::Stem) => Self::ON_STEM,
            Some(Semantic::Branch) => Self::ON_BRANCH,
            _ => 0,
        }
    }

    /// Whether a flag is set.
    #[must_use]
    pub const fn has(self, flag: u8) -> bool {
        self.0 & flag != 0
    }
}

/// One LiDAR return with everything that is known about it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LidarPoint {
    /// Measured position, metres, in the LiDAR frame at the frame's time (deskewed) or, in a raw
    /// scan, at the pulse's time.
    pub position_m: Vec3,
    /// Range without error, metres: the mean weighted by received power where the return is mixed,
    /// 0 for a false alarm.
    pub true_range_m: f32,
    /// Measured range, metres.
    pub range_m: f32,
    /// Received power relative to a perfect Lambertian plate at the same place, facing the sensor
    /// and filling the beam, at least 0: reflectance × cos(incidence) of the part of the beam that
    /// met it, with the error of the receiver. It is above 1 only where water glints and, by that
    /// error, of weak echoes.
    pub intensity: f32,
    /// Livox convention: 0..150 is 0..100 % diffuse reflectance, range-calibrated; 151..255 is
    /// retroreflective, as water is where it glints.
    pub reflectivity: u8,
    /// What was hit; for a mixed return what gave most of the light, added up over all surfaces of
    /// a semantic; [`Semantic::Sky`] for a false alarm.
    pub semantic: Semantic,
    /// The object that was hit; for a mixed return the one of that semantic that gave most of the
    /// light.
    pub object: ObjectId,
    /// Laser line or ring.
    pub ring: u8,
    /// This return's number in its pulse, from 1.
    pub return_number: u8,
    /// How many returns the pulse gave.
    pub returns: u8,
    /// Time of firing after the frame's time, which is the middle of the scan, nanoseconds;
    /// negative before it.
    pub time_ns: i64,
    /// Number of the pulse in the scan.
    pub pulse: u32,
    /// Cosine of the angle between beam and surface normal, 0..1.
    pub incidence_cos: f32,
    /// Unit surface normal in the frame of `position_m`, towards the sensor; 0 for a false alarm.
    pub normal: Vec3,
    /// Flags of this return.
    pub flags: PointFlags,
}
