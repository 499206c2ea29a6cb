//! The formats of all kinds of files. Nothing here opens a file or knows where one lies.

pub(crate) mod annotations;
pub(crate) mod data_card;
pub(crate) mod exif;
pub(crate) mod exr;
pub(crate) mod images;
pub(crate) mod kitti;
pub(crate) mod npy;
pub(crate) mod ontology_yaml;
pub(crate) mod ply;
pub(crate) mod scan;
pub(crate) mod tables;

/// Columns and rows of a picture.
pub(crate) type Size = (usize, usize);
