//! Keys whose value is one of a few words. Each has an enum, so that every use names every case.

use nemoral_convert::FormatName;
use nemoral_lidar::Device;
use nemoral_scene::{Ontology, TrailSurfaceKind};

/// Declares an enum with the word that a config has for each variant.
macro_rules! choices {
    ($(
        $( #[doc = $doc:literal] )+
        $name:ident { $( $( #[doc = $variant_doc:literal] )+ $variant:ident = $word:literal, )+ }
    )+) => { $(
        $( #[doc = $doc] )+
        #[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
        pub enum $name {
            $( $( #[doc = $variant_doc] )+ #[serde(rename = $word)] $variant, )+
        }

        impl $name {
            /// The words that a config has for the variants, in their order.
            pub const WORDS: &'static [&'static str] = &[$( $word ),+];

            /// The word that a config has for this one.
            #[must_use]
            pub const fn word(self) -> &'static str {
                match self {
                    $( Self::$variant => $word, )+
                }
            }
        }

        impl nemoral_plan::Encode for $name {
            fn encode(&self, encoder: &mut dyn nemoral_plan::Encoder) {
                self.word().encode(encoder);
            }
        }
    )+ };
}

choices! {
    /// A class table by its name.
    OntologyName {
        /// The paper's eight classes.
        Paper = "paper",
        /// The paper's, with shrubs and herbs as fuel.
        Fuel = "fuel",
        /// Each semantic as a class.
        Semantics = "semantics",
    }

    /// The noise that the terrain sums.
    TerrainNoise {
        /// Gradient noise of this project, without a period and with exact gradients.
        Nemoral = "nemoral",
        /// The `noise` crate's surflet noise.
        PerlinSurflet = "perlin-surflet",
    }

    /// What a model of a user is.
    ModelKind {
        /// A tree.
        Tree = "tree",
        /// A shrub.
        Shrub = "shrub",
        /// A rock.
        Rock = "rock",
        /// A log.
        Log = "log",
    }

    /// How the exposure of pictures is chosen.
    ExposureMode {
        /// By a light meter.
        Auto = "auto",
        /// By the config.
        Fixed = "fixed",
    }

    /// What an automatic exposure looks at.
    MeteringMode {
        /// The whole picture.
        Average = "average",
        /// Its middle, for the most part.
        Centre = "centre",
        /// All but the sky.
        Ground = "ground",
        /// The sky alone.
        Sky = "sky",
        /// What is brightest.
        Highlights = "highlights",
    }

    /// How the colour of the light is found.
    WhiteBalanceMode {
        /// By the config.
        Fixed = "fixed",
        /// In each picture.
        Auto = "auto",
    }

    /// The curve from light to brightness.
    ToneChoice {
        /// As the look says.
        Look = "look",
        /// A camera's standard picture.
        Standard = "standard",
        /// Proportional to light.
        Linear = "linear",
        /// With a soft toe and shoulder.
        Filmic = "filmic",
    }

    /// How corners darken.
    VignettingModel {
        /// As the look says.
        Look = "look",
        /// By the fourth power of the cosine.
        CosineFourth = "cos4",
        /// By a polynomial in the distance from the principal point.
        Polynomial = "polynomial",
    }

    /// How light becomes a picture.
    Look {
        /// What a small camera of a robot records.
        Robot = "robot",
        /// A soft curve that keeps highlights.
        Cinema = "cinema",
        /// Proportional to light, through a clean lens.
        Flat = "flat",
    }

    /// Which echoes of a pulse become points.
    ReturnMode {
        /// The strongest one.
        Strongest = "strongest",
        /// The first one.
        First = "first",
        /// The last one.
        Last = "last",
        /// The strongest and the last one.
        Dual = "dual",
        /// All, up to a number.
        All = "all",
    }

    /// Whose beam table a spinning head has.
    SpinningHead {
        /// Velodyne VLP-16.
        Vlp16 = "vlp16",
        /// Velodyne HDL-64E.
        Hdl64e = "hdl64e",
        /// An Ouster of any number of beams.
        Ouster = "ouster",
        /// Ouster OS-1-64, of the first generation.
        Os1x64 = "os1_64",
    }

    /// The model of range errors.
    RangeNoiseModel {
        /// No errors.
        Off = "off",
        /// The paper's normal distribution.
        Paper = "paper",
        /// The bias by incidence of Laconte et al. 2019.
        Laconte = "laconte",
        /// A spread that grows with incidence.
        Incidence = "incidence",
        /// A spread that grows with range.
        Linear = "linear",
        /// A spread by the ratio of signal to noise.
        SignalToNoise = "snr",
    }

    /// How an airborne scanner's mirror moves the beam.
    MirrorKind {
        /// One facet that turns about the direction of flight.
        Rotating = "rotating",
        /// Several facets that turn.
        Polygon = "polygon",
        /// A mirror that swings like a sine.
        Sine = "sine",
        /// A mirror that swings at a constant rate.
        Triangle = "triangle",
        /// A Palmer scanner.
        Cone = "cone",
        /// A mirror that wobbles.
        Nutating = "nutating",
    }

    /// Whose bias the Laconte model has.
    LaconteSensor {
        /// Velodyne HDL-32E.
        Hdl32e = "hdl32e",
        /// SICK LMS1xx.
        Lms1xx = "lms1xx",
    }

    /// What a flight follows.
    FlightFollow {
        /// The ground, smoothly.
        Ground = "ground",
        /// A level above the highest ground of all lines.
        Level = "level",
    }

    /// The format of a file of poses.
    PathFormat {
        /// TUM: `t x y z qx qy qz qw` on each line.
        Tum = "tum",
        /// KITTI: a 3 x 4 matrix on each line.
        Kitti = "kitti",
    }
}

impl OntologyName {
    /// The class table.
    #[must_use]
    pub fn table(self) -> Ontology {
        match self {
            Self::Paper => Ontology::paper(),
            Self::Fuel => Ontology::fuel(),
            Self::Semantics => Ontology::semantics(),
        }
    }
}

/// The word of `trails.surface` for a surface of its own on each trail.
pub(super) const VARIED_SURFACES: &str = "varied";

/// The words of `trails.surface`.
pub(super) const TRAIL_SURFACES: [&str; 1 + TrailSurfaceKind::ALL.len()] = {
    let mut words = [VARIED_SURFACES; 1 + TrailSurfaceKind::ALL.len()];
    let mut i = 0;
    while i < TrailSurfaceKind::ALL.len() {
        words[i + 1] = TrailSurfaceKind::ALL[i].name();
        i += 1;
    }
    words
};

/// The words of `output.formats`.
pub(super) const FORMATS: [&str; FormatName::ALL.len()] = {
    let mut words = [""; FormatName::ALL.len()];
    let mut i = 0;
    while i < FormatName::ALL.len() {
        words[i] = FormatName::ALL[i].name();
        i += 1;
    }
    words
};

/// The word of `lidar.device` for a user's own scanner.
pub(super) const CUSTOM_DEVICE: &str = "custom";

/// The words of `lidar.device`.
pub(super) const DEVICES: [&str; 1 + Device::ALL.len()] = {
    let mut words = [CUSTOM_DEVICE; 1 + Device::ALL.len()];
    let mut i = 0;
    while i < Device::ALL.len() {
        words[i + 1] = Device::ALL[i].name();
        i += 1;
    }
    words
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn class_tables_have_the_names_of_their_words() {
        let all = [
            OntologyName::Paper,
            OntologyName::Fuel,
            OntologyName::Semantics,
        ];
        assert_eq!(all.map(OntologyName::word), OntologyName::WORDS);
        for name in all {
            assert_eq!(name.table().name(), name.word());
        }
    }
}
