//! Maps as GeoTIFF.

use std::io::{Cursor, Write};
use std::path::Path;

use nemoral_files::PendingFile;
use nemoral_scene::ParamError;
use nemoral_scene::glam::DVec2;
use tiff::encoder::colortype::{ColorType, Gray32, Gray32Float};
use tiff::encoder::{Compression, DeflateLevel, Predictor, TiffEncoder, TiffValue};
use tiff::tags::Tag;

use crate::{Error, check_name};

/// A map of square cells, north up.
#[derive(Clone, Debug, PartialEq)]
pub struct RasterMap {
    /// The north-west corner of the first cell, in the coordinates of the map, metres.
    pub north_west_m: DVec2,
    /// Side of a cell, metres.
    pub cell_m: f64,
    /// Cells from west to east.
    pub columns: usize,
    /// Rows from north to south.
    pub rows: usize,
    /// Of each cell its value: rows from north to south, each from west to east.
    pub values: RasterValues,
    /// The EPSG code of the projected coordinate reference system, if there is one.
    pub epsg: Option<u16>,
}

/// The values of a map's cells.
#[derive(Clone, Debug, PartialEq)]
pub enum RasterValues {
    /// Heights or other measures.
    Real(Vec<f32>),
    /// Ids; 0 is none.
    Id(Vec<u32>),
}

/// The most cells of a map: offsets in the file have 32 bits.
const MOST_CELLS: usize = 1 << 29;

impl RasterMap {
    fn check(&self) -> Result<(), ParamError> {
        ParamError::check_positive("cell_m", self.cell_m)?;
        let found = match &self.values {
            RasterValues::Real(values) => values.len(),
            RasterValues::Id(values) => values.len(),
        };
        let sides = format!("{} x {} cells, {found} values", self.columns, self.rows);
        let most = 1..=65_535;
        let fits = most.contains(&self.columns)
            && most.contains(&self.rows)
            && self.columns * self.rows == found
            && found <= MOST_CELLS
            && self.north_west_m.is_finite();
        let allowed =
            "1 to 65535 by 1 to 65535, at most 2^29, with a value each, at a finite place";
        ParamError::check(fits, "cells", sides, allowed)
    }
}

/// Writes a map to `path`, whose name ends in `.tif`: one band of 32 bits, compressed by Deflate,
/// with its place, and its reference system if it has one. The result is its size in bytes.
///
/// Source: OGC GeoTIFF 1.1 (19-008r4). Without a reference system the file says where it lies in
/// metres, of no known place on earth.
///
/// # Errors
/// If the name has another ending, the map has no cells, too many, or other than values, or the
/// file cannot be written.
pub fn write_geotiff(map: &RasterMap, path: &Path) -> Result<u64, Error> {
    check_name(path, "tif")?;
    let bytes = to_geotiff(map)?;
    let mut file = PendingFile::create(path)?;
    file.write_all(&bytes)
        .map_err(nemoral_files::Error::io(path))?;
    file.commit()?;
    Ok(bytes.len() as u64)
}

/// The file of a map, as [`write_geotiff`] writes it.
///
/// # Errors
/// If the map has no cells, too many, or other than values.
pub fn to_geotiff(map: &RasterMap) -> Result<Vec<u8>, Error> {
    map.check()?;
    let bytes = match &map.values {
        RasterValues::Real(values) => encode::<Gray32Float>(map, values),
        RasterValues::Id(values) => encode::<Gray32>(map, values),
    };
    Ok(bytes.expect("memory takes all bytes, and the sizes were checked"))
}

fn encode<C: ColorType>(map: &RasterMap, values: &[C::Inner]) -> tiff::TiffResult<Vec<u8>>
where
    [C::Inner]: TiffValue,
{
    let mut bytes = Cursor::new(Vec::new());
    let mut file = TiffEncoder::new(&mut bytes)?
        .with_compression(Compression::Deflate(DeflateLevel::Balanced))
        .with_predictor(Predictor::None);
    let mut image = file.new_image::<C>(map.columns as u32, map.rows as u32)?;
    let DVec2 { x, y } = map.north_west_m;
    let tags = image.encoder();
    tags.write_tag(Tag::ModelPixelScaleTag, &[map.cell_m, map.cell_m, 0.0][..])?;
    tags.write_tag(Tag::ModelTiepointTag, &[0.0, 0.0, 0.0, x, y, 0.0][..])?;
    tags.write_tag(Tag::GeoKeyDirectoryTag, &geo_keys(map.epsg)[..])?;
    image.write_data(values)?;
    Ok(bytes.into_inner())
}

/// The directory of GeoKeys: a header of four numbers, then four for each key. Without a reference
/// system it says that values are those of areas, and no more.
fn geo_keys(epsg: Option<u16>) -> Vec<u16> {
    const MODEL_TYPE: u16 = 1024;
    const RASTER_TYPE: u16 = 1025;
    const PROJECTED_CRS: u16 = 3072;
    const PROJECTED: u16 = 1;
    const PIXEL_IS_AREA: u16 = 1;
    let area = [RASTER_TYPE, PIXEL_IS_AREA];
    let keys = match epsg {
        Some(code) => vec![[MODEL_TYPE, PROJECTED], area, [PROJECTED_CRS, code]],
        None => vec![area],
    };
    let header = [1, 1, 0, keys.len() as u16];
    let of_key = keys.iter().flat_map(|&[id, value]| [id, 0, 1, value]);
    header.into_iter().chain(of_key).collect()
}
