//! Height maps from a 16-bit grey PNG and a sidecar.

use nemoral_scene::on_deep_stack;
use png::{BitDepth, ColorType, Decoder, Limits, Transformations};
use serde::Deserialize;

use crate::error::shown;
use crate::{HeightMap, ImportError, MAX_POSTS};

/// What a PNG of heights does not say itself: a file beside it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeightPngSidecar {
    /// Where the map lies.
    pub origin: GridOrigin,
    /// Distance between posts, metres.
    pub spacing_m: f64,
    /// The height of code 0, metres.
    pub lowest_m: f64,
    /// The height of one code, metres.
    pub metres_per_level: f64,
    /// The code of posts without data, if there are any.
    pub no_data: Option<u16>,
}

/// Where a PNG of heights lies: an easting and a northing, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GridOrigin {
    /// The south-west corner of the south-west pixel, which is in the last row.
    SouthWestCorner([f64; 2]),
    /// The first post: that of the first row, the northernmost, and the first column.
    FirstPost([f64; 2]),
}

/// A sidecar in JSON.
#[derive(Deserialize)]
struct Json {
    origin_m: [f64; 2],
    metres_per_pixel: f64,
    min_height_m: f64,
    max_height_m: f64,
    #[serde(default)]
    no_data: Option<u16>,
}

/// A sidecar in TOML, as nemoral exports it.
#[derive(Deserialize)]
struct Toml {
    west_m: f64,
    north_m: f64,
    spacing_m: f64,
    lowest_m: f64,
    metres_per_level: f64,
    #[serde(default)]
    no_data: Option<u16>,
}

impl HeightPngSidecar {
    /// Reads a sidecar. In JSON it has `origin_m` (the south-west corner, `[x, y]`),
    /// `metres_per_pixel`, `min_height_m` (of code 0) and `max_height_m` (of code 65535); in TOML
    /// `west_m` and `north_m` (the first post), `spacing_m`, `lowest_m` and `metres_per_level`.
    /// Both may have `no_data`; other fields are ignored.
    ///
    /// # Errors
    /// It is neither, a field is missing, or heights are not finite and in order.
    pub fn read(bytes: &[u8]) -> Result<Self, ImportError> {
        let wrong = |e: &str| ImportError::file(format!("is no sidecar: {}", shown(e)));
        let sidecar = if bytes.trim_ascii_start().starts_with(b"{") {
            let json: Json = serde_json::from_slice(bytes).map_err(|e| wrong(&e.to_string()))?;
            Self {
                origin: GridOrigin::SouthWestCorner(json.origin_m),
                spacing_m: json.metres_per_pixel,
                lowest_m: json.min_height_m,
                metres_per_level: (json.max_height_m - json.min_height_m) / f64::from(u16::MAX),
                no_data: json.no_data,
            }
        } else {
            let read = on_deep_stack(|| toml::from_slice::<Toml>(bytes));
            let read = read.map_err(|e| wrong(&e.to_string()))?;
            let toml = read.map_err(|e| wrong(e.message()))?;
            Self {
                origin: GridOrigin::FirstPost([toml.west_m, toml.north_m]),
                spacing_m: toml.spacing_m,
                lowest_m: toml.lowest_m,
                metres_per_level: toml.metres_per_level,
                no_data: toml.no_data,
            }
        };
        let (low, level) = (sidecar.lowest_m, sidecar.metres_per_level);
        if !(low.is_finite() && level.is_finite() && level >= 0.0) {
            let message = format!(
                "has heights from {low} in levels of {level} m: must be finite and in order"
            );
            return Err(ImportError::file(message));
        }
        Ok(sidecar)
    }
}

impl HeightMap {
    /// Reads a 16-bit grey PNG; its first row is the north edge, and posts are the middles of
    /// pixels.
    ///
    /// # Errors
    /// The file is no such PNG, or is too large; the sidecar has an impossible value.
    pub fn from_png(bytes: &[u8], sidecar: &HeightPngSidecar) -> Result<Self, ImportError> {
        let wrong = |e: png::DecodingError| {
            ImportError::file(format!(
                "is no PNG that can be read: {}",
                shown(&e.to_string())
            ))
        };
        let limits = Limits {
            bytes: MAX_POSTS * size_of::<u16>() + (1 << 20),
        };
        let mut decoder = Decoder::new_with_limits(std::io::Cursor::new(bytes), limits);
        decoder.set_transformations(Transformations::IDENTITY);
        let header = decoder.read_header_info().map_err(wrong)?;
        let [columns, rows] = Self::check_size(header.width.into(), header.height.into())?;
        if (header.color_type, header.bit_depth) != (ColorType::Grayscale, BitDepth::Sixteen) {
            let message = "is not 16-bit grey, which a PNG of heights must be";
            return Err(ImportError::file(message));
        }
        let mut reader = decoder.read_info().map_err(wrong)?;
        let mut codes = vec![0; columns * rows * size_of::<u16>()];
        reader.next_frame(&mut codes).map_err(wrong)?;
        let HeightPngSidecar {
            origin,
            spacing_m,
            lowest_m,
            metres_per_level,
            no_data,
        } = *sidecar;
        let [west_m, north_m] = match origin {
            GridOrigin::FirstPost(at) => at,
            GridOrigin::SouthWestCorner([x, y]) => {
                [x + 0.5 * spacing_m, y + (rows as f64 - 0.5) * spacing_m]
            }
        };
        let height = |code: &[u8]| {
            let code = u16::from_be_bytes([code[0], code[1]]);
            if Some(code) == no_data {
                return f32::NAN;
            }
            (lowest_m + metres_per_level * f64::from(code)) as f32
        };
        Self {
            columns,
            rows,
            west_m,
            north_m,
            spacing_m,
            heights_m: codes.chunks_exact(2).map(height).collect(),
            epsg: None,
        }
        .checked()
    }
}
