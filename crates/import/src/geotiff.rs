//! Height maps from GeoTIFF.

use std::io::Cursor;

use tiff::ColorType;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::{Tag, Type, ValueBuffer};

use crate::error::shown;
use crate::gdal_metadata::BandScale;
use crate::{EPSG_CODES, HeightMap, ImportError, MAX_POSTS};

/// The key of a GeoTIFF that says what a pixel is, and its value where it is a point.
const RASTER_TYPE: u16 = 1025;
const PIXEL_IS_POINT: u16 = 2;
/// The key that says what the coordinates are, and its value for degrees.
const MODEL_TYPE: u16 = 1024;
const GEOGRAPHIC: u16 = 2;
/// The key of the unit of projected coordinates, and its value for metres.
const LINEAR_UNIT: u16 = 3076;
const METRE: u16 = 9001;
/// The key of the projected system's EPSG code.
const PROJECTED_CRS: u16 = 3072;
/// The keys of the heights' unit, and of the EPSG code of their system.
const VERTICAL_UNIT: u16 = 4099;
const VERTICAL_CRS: u16 = 4096;
/// The systems of heights and depths whose unit is a foot (EPSG 11), as that of NAVD88 is in many
/// states of the USA (6360, 8228).
const CRS_IN_FEET: [u16; 16] = [
    5614, 5702, 5754, 6130, 6131, 6132, 6358, 6359, 6360, 8050, 8051, 8052, 8053, 8228, 8897,
    10_919,
];

/// The tag of what GDAL says about the file and its bands.
const GDAL_METADATA: Tag = Tag::Unknown(42_112);
/// The photometric interpretation in which 0 is white.
const WHITE_IS_ZERO: u16 = 0;

impl HeightMap {
    /// Reads a GeoTIFF: one band of whole or real numbers, north up, with square pixels
    /// (`ModelPixelScale` and `ModelTiepoint`), in projected metres. Posts are the middles of
    /// pixels, or their corners if the file says that a pixel is a point. Values equal to
    /// `GDAL_NODATA`, and those that are no numbers, are posts without data; all others are
    /// multiplied by the band's scale, and its offset is added, if `GDAL_METADATA` has them. Of
    /// several images the first is read.
    ///
    /// # Errors
    /// The file is no such GeoTIFF, its compression is not known (known are none, LZW, Deflate and
    /// PackBits), the unit of its map or of its heights is not the metre, 0 is white, a height is
    /// not -1,000 to 10,000 m, or it is too large.
    pub fn from_tiff(bytes: &[u8]) -> Result<Self, ImportError> {
        let wrong = |e: tiff::TiffError| {
            ImportError::file(format!(
                "is no GeoTIFF that can be read: {}",
                shown(&e.to_string())
            ))
        };
        let mut limits = Limits::default();
        limits.decoding_buffer_size = MAX_POSTS * size_of::<f64>();
        limits.intermediate_buffer_size = MAX_POSTS * size_of::<f64>();
        limits.ifd_value_size = 8 << 20;
        let mut tiff = Decoder::new(Cursor::new(bytes))
            .map_err(wrong)?
            .with_limits(limits);
        let (columns, rows) = tiff.dimensions().map_err(wrong)?;
        let [columns, rows] = Self::check_size(columns.into(), rows.into())?;
        if !matches!(tiff.colortype().map_err(wrong)?, ColorType::Gray(_)) {
            return Err(ImportError::file("has several bands: a height map has one"));
        }
        let photometric = tiff.find_tag_unsigned::<u16>(Tag::PhotometricInterpretation);
        if photometric.map_err(wrong)? == Some(WHITE_IS_ZERO) {
            // The decoder would turn the values upside down, which other programs do not.
            let message = "has values of which 0 is white: write it anew with black as 0 \
                           (gdal_translate -co PHOTOMETRIC=MINISBLACK)";
            return Err(ImportError::file(message));
        }
        let ([west_m, north_m, spacing_m], epsg) = place(&mut tiff, &wrong)?;
        let no_data = match tiff.find_tag(Tag::GdalNodata).map_err(wrong)? {
            None => None,
            Some(value) => {
                let text = value.into_string().map_err(wrong)?;
                let text = text.trim_matches(['\0', ' ', '\n']);
                Some(text.parse::<f64>().map_err(|_| {
                    let message = format!("has GDAL_NODATA = {}: must be a number", shown(text));
                    ImportError::file(message)
                })?)
            }
        };
        let scale = band_scale(&mut tiff, &wrong)?;
        let heights_m = heights(tiff.read_image().map_err(wrong)?, no_data, scale);
        if heights_m.len() != columns * rows {
            let found = heights_m.len();
            let message = format!("has {found} values for {columns} × {rows} pixels");
            return Err(ImportError::file(message));
        }
        Self {
            columns,
            rows,
            west_m,
            north_m,
            spacing_m,
            heights_m,
            epsg,
        }
        .checked()
    }
}

/// The first post's easting and northing, the distance between posts, and the EPSG code.
fn place(
    tiff: &mut Decoder<Cursor<&[u8]>>,
    wrong: &dyn Fn(tiff::TiffError) -> ImportError,
) -> Result<([f64; 3], Option<u16>), ImportError> {
    let mut numbers =
        |tag, name: &str, least: usize| {
            let found = tiff.find_tag(tag).map_err(wrong)?;
            let found = found.map(|value| value.into_f64_vec()).transpose();
            found.map_err(wrong)?.filter(|v| v.len() >= least).ok_or_else(|| {
            ImportError::file(format!(
                "has no tag {name} with {least} numbers, which says where it lies; a turned or \
                 sheared map must be resampled north up"
            ))
        })
        };
    let scale = numbers(Tag::ModelPixelScaleTag, "ModelPixelScale", 2)?;
    let tie = numbers(Tag::ModelTiepointTag, "ModelTiepoint", 6)?;
    let keys = tiff.find_tag(Tag::GeoKeyDirectoryTag).map_err(wrong)?;
    let keys = keys.map(|value| value.into_u16_vec()).transpose();
    let keys = keys.map_err(wrong)?.unwrap_or_default();
    // After a header of four numbers, each key has an id, a place, a count and a value.
    let key = |id: u16| {
        let entries = keys.chunks_exact(4).skip(1);
        entries
            .filter(|e| e[0] == id && e[1] == 0)
            .map(|e| e[3])
            .next()
    };
    if key(MODEL_TYPE) == Some(GEOGRAPHIC) {
        let message = "is in degrees: project it to metres first, such as UTM";
        return Err(ImportError::file(message));
    }
    if let Some(unit) = key(LINEAR_UNIT).filter(|&unit| unit != METRE) {
        let message = format!("is not in metres (its GeoKey {LINEAR_UNIT} is {unit}): project it");
        return Err(ImportError::file(message));
    }
    let unit = key(VERTICAL_UNIT).filter(|unit| ![0, METRE].contains(unit));
    let in_feet = key(VERTICAL_CRS).filter(|code| CRS_IN_FEET.contains(code));
    let found = unit.map(|of| (VERTICAL_UNIT, of));
    if let Some((key, found)) = found.or(in_feet.map(|of| (VERTICAL_CRS, of))) {
        let message = format!(
            "has heights that are not in metres (its GeoKey {key} is {found}): convert them"
        );
        return Err(ImportError::file(message));
    }
    let spacing_m = scale[0];
    HeightMap::check_spacing(spacing_m)?;
    let are_squares = (scale[1] - spacing_m).abs() <= 1e-6 * spacing_m;
    if !are_squares {
        let message = format!(
            "has pixels of {} × {} m: must be squares",
            scale[0], scale[1]
        );
        return Err(ImportError::file(message));
    }
    let middle = if key(RASTER_TYPE) == Some(PIXEL_IS_POINT) {
        0.0
    } else {
        0.5
    };
    let west_m = tie[3] + (middle - tie[0]) * spacing_m;
    let north_m = tie[4] - (middle - tie[1]) * spacing_m;
    let epsg = key(PROJECTED_CRS).filter(|code| EPSG_CODES.contains(code));
    Ok(([west_m, north_m, spacing_m], epsg))
}

/// How the values of the band become heights.
fn band_scale(
    tiff: &mut Decoder<Cursor<&[u8]>>,
    wrong: &dyn Fn(tiff::TiffError) -> ImportError,
) -> Result<BandScale, ImportError> {
    let mut text = ValueBuffer::empty(Type::ASCII);
    let found = tiff.image_ifd().find_tag_buf(GDAL_METADATA, &mut text);
    match found.map_err(wrong)? {
        None => Ok(BandScale::default()),
        // Descriptions and names in it may have any encoding.
        Some(_) => BandScale::of(&String::from_utf8_lossy(text.as_bytes())),
    }
}

/// The values of an image as heights.
fn heights(image: DecodingResult, no_data: Option<f64>, scale: BandScale) -> Vec<f32> {
    fn all<T: Into<f64>>(values: Vec<T>, height: impl Fn(f64) -> f32) -> Vec<f32> {
        let values = values.into_iter().map(Into::<f64>::into);
        values.map(height).collect()
    }
    let height = |value: f64| {
        // A value for no data is often written with other digits than it is stored.
        let is_none = no_data.is_some_and(|none| value == none || value == none as f32 as f64);
        if is_none {
            f32::NAN
        } else {
            scale.height_m(value) as f32
        }
    };
    match image {
        DecodingResult::U8(v) => all(v, height),
        DecodingResult::U16(v) => all(v, height),
        DecodingResult::U32(v) => all(v, height),
        DecodingResult::I8(v) => all(v, height),
        DecodingResult::I16(v) => all(v, height),
        DecodingResult::I32(v) => all(v, height),
        DecodingResult::F32(v) => all(v, height),
        DecodingResult::F64(v) => all(v, height),
        // No format of heights has them.
        _ => Vec::new(),
    }
}
