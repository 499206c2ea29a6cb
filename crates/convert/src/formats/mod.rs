//! The formats, a file for each.

mod coco;
mod kitti;
mod tum;

use std::fmt;
use std::str::FromStr;

use crate::{Format, Table};

/// The formats that there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FormatName {
    /// KITTI's odometry benchmark.
    Kitti,
    /// TUM's RGB-D benchmark, a folder for each sensor.
    Tum,
    /// COCO: objects with masks, and panoptic segments.
    Coco,
}

impl FormatName {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Kitti, Self::Tum, Self::Coco];

    /// The name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Kitti => "kitti",
            Self::Tum => "tum",
            Self::Coco => "coco",
        }
    }

    /// The format with the given classes in place of its own.
    #[must_use]
    pub fn with(self, ontology: Option<Table>) -> Box<dyn Format> {
        match self {
            Self::Kitti => Box::new(kitti::Kitti { ontology }),
            Self::Tum => Box::new(tum::Tum),
            Self::Coco => Box::new(coco::Coco { ontology }),
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
