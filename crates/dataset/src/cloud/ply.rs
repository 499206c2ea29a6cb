//! All scans of a data set as one registered, labelled cloud.

use std::collections::HashSet;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::Path;

use nemoral_files::PendingFile;

use nemoral_scene::glam::DVec3;
use nemoral_scene::{PointFlags, RigidTransform};

use crate::formats::ply;
use crate::{Dataset, Error, PlyPoint};

/// What goes into a cloud.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CloudParams {
    /// Side of a voxel, metres, 0.0001 to 1000: only the first point in each is kept; `None` keeps
    /// all.
    pub voxel_m: Option<f64>,
    /// Whether mixed returns and false alarms are left out.
    pub pure: bool,
    /// Which sequence; may be `None` if there is only one.
    pub sequence: Option<u32>,
}

/// Allowed sides of voxels, metres: from finer than any scanner measures to larger than any
/// scanner's reach.
const VOXEL_M: std::ops::RangeInclusive<f64> = 1e-4..=1e3;

/// Writes the points of all frames and all LiDARs of a sequence in world coordinates, in the order
/// of frames, as a binary PLY at `out`: for plots that are scanned from stations, and for maps of
/// drives.
///
/// Positions are the measured ones, registered by the true poses. Every point has its class, its
/// object (`chunk_x`, `chunk_y`, `item` as in `trees.csv` and `instances.csv`), frame, LiDAR,
/// return, true range, normal and its class's colour. Returns how many points were written. The
/// file appears when it is whole.
///
/// # Errors
/// If there is no such sequence, or there are several and none is named, if a scan is missing or
/// damaged, was written raw (not deskewed) or without PLY, if `voxel_m` is out of range, if `out`
/// does not end in `.ply` or is one of the data set's own files, or if the file cannot be written.
pub fn cloud(dir: &Path, out: &Path, params: CloudParams) -> Result<u64, Error> {
    if let Some(side) = params.voxel_m.filter(|v| !VOXEL_M.contains(v)) {
        let allowed = format!("{} to {} m", VOXEL_M.start(), VOXEL_M.end());
        return Err(Error::invalid("voxel_m", side, allowed));
    }
    if out
        .extension()
        .is_none_or(|e| !e.eq_ignore_ascii_case("ply"))
    {
        return Err(Error::invalid(
            "out",
            out.display(),
            "a name that ends in .ply",
        ));
    }
    let dataset = Dataset::open(dir)?;
    if dataset.owns(out) {
        let allowed = "none of the data set's own files";
        return Err(Error::invalid("out", out.display(), allowed));
    }
    let header = &dataset.manifest().header;
    let sequences = (dataset.manifest().tracks.iter()).map(|t| t.sequence);
    let mut only = sequences
        .clone()
        .filter(|&s| params.sequence.is_none_or(|of| of == s));
    let (Some(number), None) = (only.next(), only.next()) else {
        let found = params.sequence.map_or("none".to_owned(), |s| s.to_string());
        let there: Vec<String> = sequences.map(|s| s.to_string()).collect();
        let allowed = format!("one of {}: each is a world of its own", there.join(", "));
        return Err(Error::invalid("sequence", found, allowed));
    };
    let sequence = header
        .sequence(number)
        .expect("a manifest's tracks are of sequences");
    for lidar in &sequence.lidars {
        if !lidar.ply {
            let allowed = "a data set with PLY files (output.ply = true)";
            return Err(Error::invalid("dir", dir.display(), allowed));
        }
        if !lidar.deskewed {
            let allowed = "a data set whose scans are deskewed (lidar.deskew = true)";
            return Err(Error::invalid("dir", dir.display(), allowed));
        }
    }
    // The number of points is written before them but known only after them.
    let mut body = BufWriter::new(nemoral_files::scratch_beside(out)?);
    let mut kept = Kept {
        params,
        seen: HashSet::new(),
    };
    let mut count = 0_usize;
    for record in (dataset.frames().iter()).filter(|f| f.sequence == number) {
        let frame = i32::try_from(record.index)
            .map_err(|_| Error::invalid("frame", record.index, "at most 2147483647"))?;
        for (i, lidar) in sequence.lidars.iter().enumerate() {
            let world_from_lidar = record.world_from_body() * lidar.body_from_lidar;
            for p in dataset.read_ply(record, i)? {
                let world = world_from_lidar.transform_point(p.point.position_m.as_dvec3());
                if kept.keeps(&p, world) {
                    let colour = header.ontology.class(p.point.semantic).colour;
                    let place = Placed {
                        world,
                        world_from_lidar: &world_from_lidar,
                        colour,
                        frame,
                        lidar: i as u8,
                    };
                    write_point(&mut body, &p, &place).map_err(Error::io(out))?;
                    count += 1;
                }
            }
        }
    }
    let mut file = PendingFile::create(out)?;
    let write = || -> io::Result<()> {
        let mut body = body.into_inner().map_err(io::IntoInnerError::into_error)?;
        body.seek(SeekFrom::Start(0))?;
        file.write_all(&ply::cloud_header(count))?;
        io::copy(&mut body, &mut file).map(drop)
    };
    write().map_err(Error::io(out))?;
    file.commit_synced()?;
    Ok(count as u64)
}

/// Which points are kept.
struct Kept {
    params: CloudParams,
    seen: HashSet<[i64; 3]>,
}

impl Kept {
    fn keeps(&mut self, p: &PlyPoint, world: DVec3) -> bool {
        let odd = PointFlags::MIXED | PointFlags::FALSE_ALARM;
        if self.params.pure && p.point.flags.has(odd) {
            return false;
        }
        // The set is only asked whether it contains a point, so its order does not matter.
        self.params.voxel_m.is_none_or(|side| {
            let cell = (world / side).floor();
            self.seen.insert(cell.to_array().map(|c| c as i64))
        })
    }
}

struct Placed<'a> {
    world: DVec3,
    world_from_lidar: &'a RigidTransform,
    colour: [u8; 3],
    frame: i32,
    lidar: u8,
}

/// Writes a point in the order of [`ply::CLOUD_FIELDS`].
fn write_point(out: &mut impl Write, p: &PlyPoint, place: &Placed<'_>) -> io::Result<()> {
    let point = &p.point;
    for v in place.world.to_array() {
        out.write_all(&v.to_le_bytes())?;
    }
    let normal = place
        .world_from_lidar
        .transform_vector(point.normal.as_dvec3());
    let floats = [
        point.intensity,
        point.true_range_m,
        point.range_m,
        point.incidence_cos,
        normal.x as f32,
        normal.y as f32,
        normal.z as f32,
    ];
    for v in floats {
        out.write_all(&v.to_le_bytes())?;
    }
    let chunk = point.object.chunk();
    out.write_all(&chunk.x.to_le_bytes())?;
    out.write_all(&chunk.y.to_le_bytes())?;
    out.write_all(&place.frame.to_le_bytes())?;
    out.write_all(&i32::from(point.object.item()).to_le_bytes())?;
    let [r, g, b] = place.colour;
    out.write_all(&[
        p.class,
        point.semantic as u8,
        place.lidar,
        point.return_number,
        point.returns,
        point.flags.0,
        r,
        g,
        b,
    ])
}
