//! The formats, a file for each.

mod coco;
mod colmap;
mod depth;
mod euroc;
mod goose;
mod huggingface;
mod kitti;
mod kitti2015;
pub(crate) mod laz;
mod mcap;
mod nerfstudio;
mod nuscenes;
mod object_kinds;
mod points;
mod rellis;
mod stereo;
mod tum;
mod webdataset;
mod yolo;

use std::fmt;
use std::str::FromStr;

use nemoral_dataset::{FrameRecord, Manifest};

use crate::{ClassMapping, Error, Format};

/// The formats that there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FormatName {
    /// KITTI's odometry benchmark.
    Kitti,
    /// SemanticKITTI: the same layout with its classes.
    SemanticKitti,
    /// KITTI's stereo, flow and scene flow benchmark of 2015.
    Kitti2015,
    /// TUM's RGB-D benchmark, a folder for each sensor.
    Tum,
    /// The layout of the EuRoC MAV data set, with Kalibr's files.
    Euroc,
    /// COCO: objects with masks, and panoptic segments.
    Coco,
    /// LAZ: each scan as compressed LAS 1.4, in world coordinates.
    Laz,
    /// COLMAP's text model.
    Colmap,
    /// nerfstudio's `transforms.json`.
    Nerfstudio,
    /// YOLO's boxes.
    Yolo,
    /// WebDataset's tar files.
    WebDataset,
    /// A folder of pictures for Hugging Face's `datasets`, with Croissant's description.
    HuggingFace,
    /// RELLIS-3D's layout and classes.
    Rellis,
    /// GOOSE's layout and classes.
    Goose,
    /// nuScenes' tables, with boxes in space.
    NuScenes,
    /// MCAP with ROS 2's messages.
    Mcap,
    /// Depth as OpenEXR.
    Exr,
    /// Depth as NumPy's arrays.
    Npy,
}

impl FormatName {
    /// All of them.
    pub const ALL: [Self; 18] = [
        Self::Kitti,
        Self::SemanticKitti,
        Self::Kitti2015,
        Self::Tum,
        Self::Euroc,
        Self::Coco,
        Self::Laz,
        Self::Colmap,
        Self::Nerfstudio,
        Self::Yolo,
        Self::WebDataset,
        Self::HuggingFace,
        Self::Rellis,
        Self::Goose,
        Self::NuScenes,
        Self::Mcap,
        Self::Exr,
        Self::Npy,
    ];

    /// The name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Kitti => "kitti",
            Self::SemanticKitti => "semantickitti",
            Self::Kitti2015 => "kitti2015",
            Self::Tum => "tum",
            Self::Euroc => "euroc",
            Self::Coco => "coco",
            Self::Laz => "laz",
            Self::Colmap => "colmap",
            Self::Nerfstudio => "nerfstudio",
            Self::Yolo => "yolo",
            Self::WebDataset => "webdataset",
            Self::HuggingFace => "hf",
            Self::Rellis => "rellis",
            Self::Goose => "goose",
            Self::NuScenes => "nuscenes",
            Self::Mcap => "mcap",
            Self::Exr => "exr",
            Self::Npy => "npy",
        }
    }

    /// Whether a class table may be given.
    #[must_use]
    pub const fn takes_ontology(self) -> bool {
        use FormatName as F;
        matches!(
            self,
            F::Kitti
                | F::SemanticKitti
                | F::Coco
                | F::Laz
                | F::HuggingFace
                | F::Rellis
                | F::Goose
                | F::NuScenes
                | F::Mcap
        )
    }

    /// Whether it lists objects by their pixels, so that small ones may be left out.
    #[must_use]
    pub const fn takes_min_px(self) -> bool {
        matches!(self, Self::Coco | Self::Yolo)
    }

    /// The format with the given classes in place of its own, and without the objects of fewer
    /// pixels in a picture if it lists any ([`takes_min_px`](Self::takes_min_px)).
    #[must_use]
    pub fn with(self, ontology: Option<ClassMapping>, min_px: u32) -> Box<dyn Format> {
        match self {
            Self::Kitti => Box::new(kitti::Kitti {
                ontology,
                built_in: None,
            }),
            Self::SemanticKitti => Box::new(kitti::Kitti {
                ontology,
                built_in: Some("semantickitti"),
            }),
            Self::Kitti2015 => Box::new(kitti2015::Kitti2015),
            Self::Tum => Box::new(tum::Tum),
            Self::Euroc => Box::new(euroc::Euroc),
            Self::Coco => Box::new(coco::Coco { ontology, min_px }),
            Self::Laz => Box::new(laz::Laz { ontology }),
            Self::Colmap => Box::new(colmap::Colmap),
            Self::Nerfstudio => Box::new(nerfstudio::Nerfstudio),
            Self::Yolo => Box::new(yolo::Yolo { min_px }),
            Self::WebDataset => Box::new(webdataset::WebDataset),
            Self::HuggingFace => Box::new(huggingface::HuggingFace { ontology }),
            Self::Rellis => Box::new(rellis::Rellis { ontology }),
            Self::Goose => Box::new(goose::Goose { ontology }),
            Self::NuScenes => Box::new(nuscenes::NuScenes { ontology }),
            Self::Mcap => Box::new(mcap::Mcap { ontology }),
            Self::Exr => Box::new(depth::Depth::Exr),
            Self::Npy => Box::new(depth::Depth::Npy),
        }
    }
}

impl fmt::Display for FormatName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for FormatName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let names: Vec<_> = Self::ALL.into_iter().map(Self::name).collect();
        let found = Self::ALL.into_iter().find(|f| f.name() == text);
        found.ok_or_else(|| format!("no such format; there are {}", names.join(", ")))
    }
}

/// Refuses a data set without pictures to a format that has them.
fn refuse_without_cameras(format: &'static str, manifest: &Manifest) -> Result<(), Error> {
    let mut sequences = manifest.header.sequences.iter();
    if sequences.any(|s| !s.cameras.is_empty()) {
        return Ok(());
    }
    Err(Error::Unsuitable {
        format,
        reason: "the data set has no camera; make it with camera.enabled = true".to_owned(),
    })
}

/// Refuses times of frames that ROS' 32 bits of seconds do not hold, or that are before the start
/// of a sequence.
fn refuse_times_beyond(format: &'static str, manifest: &Manifest) -> Result<(), Error> {
    const MOST_S: f64 = 2_147_483_000.0;
    let mut frames = manifest.frames.iter();
    let beyond = frames.find(|frame| !(0.0..=MOST_S).contains(&frame.time_s));
    beyond.map_or(Ok(()), |frame| {
        Err(Error::Unsuitable {
            format,
            reason: format!(
                "frame {:02}_{:06} is at {} s: must be at 0 to {MOST_S} s",
                frame.sequence, frame.index, frame.time_s
            ),
        })
    })
}

/// Refuses a data set of which times of frames, in seconds, do not rise to a format that calls
/// pictures by their times.
fn refuse_times_that_do_not_rise(
    format: &'static str,
    manifest: &Manifest,
    is_same: impl Fn(f64, f64) -> bool,
) -> Result<(), Error> {
    let name = |f: &FrameRecord| format!("{:02}_{:06}", f.sequence, f.index);
    let mut pairs = manifest.frames.windows(2);
    let same = pairs.find(|p| p[0].sequence == p[1].sequence && is_same(p[0].time_s, p[1].time_s));
    same.map_or(Ok(()), |pair| {
        Err(Error::Unsuitable {
            format,
            reason: format!(
                "the time of frame {} is not after that of {}",
                name(&pair[1]),
                name(&pair[0])
            ),
        })
    })
}
