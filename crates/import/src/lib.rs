//! Readers of what users bring: [models](Model) of trees, shrubs and rocks, [stem
//! maps](read_stem_map), [height maps](HeightMap) and [trail lines](read_trail_lines).
//!
//! The files may come from a stranger. Everything is read from bytes into plain structs, and what
//! is wrong is an [`ImportError`] that names its place; nothing panics, and memory is bounded:
//!
//! | file | limits |
//! |---|---|
//! | stem map | [`MAX_STEMS`] rows |
//! | height map | [`MAX_POSTS`] posts, however well they are compressed |
//! | model | [`MAX_MODEL_BYTES`] with all files that it names; [`MAX_TRIANGLES`], [`MAX_NODES`] |
//! | its pictures | [`MAX_PICTURES`] of [`MAX_PICTURE_SIDE`], together [`MAX_PICTURE_PIXELS`] |
//! | trail lines | [`MAX_LINES`], with [`MAX_VERTICES`] vertices and [`MAX_LENGTH_M`] together |
//!
//! Coordinates of sites are those of the file, in metres, x east and y north: projected ones such
//! as UTM, not degrees; a GeoTIFF and GeoJSON may say which, by an EPSG code. Heights are metres,
//! too. Models are brought to metres, z up, with their foot at the origin.
//!
//! ```
//! use nemoral_import::{HeightMap, HeightPngSidecar};
//!
//! let sidecar = r#"{ "origin_m": [10.0, 20.0], "metres_per_pixel": 0.5,
//!                    "min_height_m": 100.0, "max_height_m": 120.0 }"#;
//! assert_eq!(HeightPngSidecar::read(sidecar.as_bytes())?.spacing_m, 0.5);
//! let error = HeightMap::from_tiff(b"no TIFF").unwrap_err().to_string();
//! assert!(error.starts_with("is no GeoTIFF"), "{error}");
//! # Ok::<(), nemoral_import::ImportError>(())
//! ```

mod epsg;
mod error;
mod gdal_metadata;
mod geotiff;
mod height_map;
mod height_png;
mod model;
mod stem_map;
mod table;
mod trail_lines;

#[doc = include_str!("../README.md")]
#[cfg(doctest)]
struct Readme;

pub use epsg::EPSG_CODES;
pub use error::ImportError;
pub use height_map::{HeightMap, MAX_POSTS};
pub use height_png::{GridOrigin, HeightPngSidecar};
pub use model::{
    Extent, FindFile, LogMeasures, MAX_DEPTH, MAX_MATERIALS, MAX_MODEL_BYTES, MAX_NODES,
    MAX_PICTURE_PIXELS, MAX_PICTURE_SIDE, MAX_PICTURES, MAX_TRIANGLES, Model, ModelFiles,
    ModelKind, ModelSidecar, TreeMeasures, UpAxis,
};
pub use stem_map::{MAX_STEMS, Stem, read_stem_map, unread_columns};
pub use trail_lines::{
    MAX_LENGTH_M, MAX_LINES, MAX_VERTICES, TrailLine, TrailLines, read_trail_lines,
};
