//! LAZ: each scan as a compressed LAS 1.4 file with point format 6:
//! ```text
//! SS/LIDAR/FFFFFF.laz
//! ```
//! x, y and z are those of the site, with its coordinate reference system as WKT, or of an invented
//! world; at the frame's pose, in steps of 0.1 mm. `gps_time` is seconds after the start of the
//! sequence plus [`SequenceSpec::las_time_shift_s`], and tells pulses from each other that are
//! fired together. `intensity` is that of the scan times 65535, `point_source_id` and `user_data`
//! the number of the LiDAR, from 1, `scanner_channel` the same from 0, modulo 4, and `scan_angle`
//! that from straight down at which the scanner saw the point from where it was at the frame's
//! time, negative to the left of where the body heads. `classification` is by the table `asprs`
//! unless another is given; what the data set knows besides is in extra dimensions: `class` and
//! `semantic`, the object's `instance` (as in instance maps), `chunk_x` and `chunk_y`, `treeID`
//! (the row of `trees.csv`), `ring`, `pulse`, `range`, `range_true`, `incidence_cos`, `flags`.
//!
//! The files themselves are in [`file`], their extra dimensions in [`extra`].
//!
//! [`SequenceSpec::las_time_shift_s`]: nemoral_dataset::SequenceSpec::las_time_shift_s

mod bytes;
mod extra;
mod file;
mod trees;

use std::collections::BTreeSet;
use std::io::{self, Cursor};

use nemoral_dataset::{Manifest, PlyPoint, SiteSpec};
use nemoral_scene::glam::DVec3;
use nemoral_scene::{Ontology, RigidTransform};

pub(crate) use self::file::{LazPoint, LazWriter, START_BYTES, STEP_M, is_own, place_m};
pub(crate) use self::trees::TreeNumbers;
use crate::labels::Labels;
use crate::{ClassMapping, Crs, Error, Format, Sink, Source};

/// The format.
#[derive(Debug)]
pub(crate) struct Laz {
    pub(crate) ontology: Option<ClassMapping>,
}

impl Laz {
    /// The classes that are written, which are ASPRS's unless others are asked for.
    pub(crate) fn labels(&self, own: &Ontology) -> Result<Labels, Error> {
        let table = match &self.ontology {
            Some(table) => table.clone(),
            None => ClassMapping::load("asprs")?,
        };
        Labels::of(own, Some(&table))?.in_bytes()
    }
}

impl Format for Laz {
    fn check(&self, manifest: &Manifest) -> Result<(), Error> {
        let sequences = &manifest.header.sequences;
        let mut lidars = sequences.iter().flat_map(|s| &s.lidars);
        let unsuitable = |reason: &str| Error::Unsuitable {
            format: "laz",
            reason: reason.to_owned(),
        };
        if sequences.iter().all(|s| s.lidars.is_empty()) {
            return Err(unsuitable("the data set has no LiDAR"));
        }
        if !lidars.all(|l| l.ply) {
            let reason = "points/*.ply are missing, which alone have times and returns; make the \
                          data set with output.ply = true";
            return Err(unsuitable(reason));
        }
        self.labels(&manifest.header.ontology).map(drop)
    }

    fn notes(&self, manifest: &Manifest) -> Vec<String> {
        let sites = manifest.header.sequences.iter().filter_map(|s| s.site);
        let notes: BTreeSet<String> = sites.filter_map(|site| crs_note(&site)).collect();
        notes.into_iter().collect()
    }

    fn write(&self, source: &Source, sink: &mut Sink) -> Result<(), Error> {
        let labels = self.labels(source.ontology())?;
        for sequence in source.sequences() {
            let trees = TreeNumbers::new(&source.trees(sequence.number)?);
            let time_shift_s = source.las_time_shift_s(sequence.number);
            for frame in source.frames(sequence.number) {
                sink.step(&format!("frame-{}", frame.name()), |files| {
                    for (i, lidar) in sequence.lidars.iter().enumerate() {
                        let world_from_body = frame.world_from_body();
                        let points = &source.scan(&frame, i)?.ply;
                        let scan = Scan {
                            site: sequence.site,
                            world_from_lidar: world_from_body * lidar.body_from_lidar,
                            left: world_from_body.level_left(),
                            time_s: frame.time_s,
                            time_shift_s,
                            lidar: i as u8,
                            labels: &labels,
                            trees: &trees,
                        };
                        let (number, name) = (sequence.number, &lidar.name);
                        let path = format!("{number:02}/{name}/{:06}.laz", frame.index);
                        let bytes = scan.encode(points).map_err(|e| Error::Unsuitable {
                            format: "laz",
                            reason: format!("{path}: {e}"),
                        })?;
                        files.put(path, bytes);
                    }
                    Ok(String::new())
                })?;
            }
        }
        Ok(())
    }
}

/// What the user should know if files of a site do not say which coordinates they have.
pub(crate) fn crs_note(site: &SiteSpec) -> Option<String> {
    let why = match site.epsg {
        Some(code) if Crs::of_epsg(code).is_some_and(|crs| crs.wkt.is_some()) => return None,
        Some(code) => format!(
            "EPSG:{code} is not known here as a projected system in metres that is true to scale"
        ),
        None => "the data set does not know it: site.epsg says it".to_owned(),
    };
    Some(format!(
        "points are in the site's coordinates, and no file names their reference system, as {why}"
    ))
}

/// What the points of a scan have in common.
struct Scan<'a> {
    site: Option<SiteSpec>,
    world_from_lidar: RigidTransform,
    /// The level direction to the left of where the body heads, in the world.
    left: DVec3,
    time_s: f64,
    time_shift_s: f64,
    lidar: u8,
    labels: &'a Labels,
    trees: &'a TreeNumbers,
}

impl Scan<'_> {
    /// The file; an error if a point is too far from the scanner for it.
    fn encode(&self, points: &[PlyPoint]) -> io::Result<Vec<u8>> {
        let near_m = self.world_from_lidar.translation_m;
        let mut writer = LazWriter::new(Cursor::new(Vec::new()), self.site.as_ref(), near_m)?;
        for recorded in points {
            let position_m = recorded.point.position_m.as_dvec3();
            let from_scanner_m = self.world_from_lidar.transform_vector(position_m);
            let point = LazPoint {
                recorded,
                world_m: self.world_from_lidar.transform_point(position_m),
                from_scanner_m,
                left_m: self.left.dot(from_scanner_m),
                time_s: self.time_s,
                time_shift_s: self.time_shift_s,
                lidar: self.lidar,
                source: u16::from(self.lidar) + 1,
                class: self.labels.id_of_semantic(recorded.point.semantic) as u8,
                tree: self.trees.of(recorded.point.object),
            };
            writer.put(&point)?;
        }
        Ok(writer.finish()?.into_inner())
    }
}
