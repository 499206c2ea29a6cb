//! All tests are in one binary, because linking takes most of the time. `common` makes data sets,
//! `folders` proves what holds for every format (resume, failing disks, damaged sources), and each
//! format has a file in which an independent reader reads it back.

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]

mod coco;
mod colmap;
mod common;
mod depth;
mod euroc;
mod folders;
mod goose;
mod huggingface;
mod kitti;
mod kitti2015;
mod las;
mod laz;
mod laz_cloud;
mod laz_cloud_truth;
mod laz_site;
mod mcap;
mod mcap_times;
mod nuscenes;
mod progress;
mod rellis;
mod splits;
mod stereo;
mod tum;
mod webdataset;
mod yolo;
