//! A cloud as a binary PLY.

use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::Path;

use nemoral_files::PendingFile;

use super::{Cloud, CloudParams, CloudPoint};
use crate::Error;
use crate::formats::ply;

/// Writes the points of all frames and all LiDARs of a sequence in world coordinates, in the order
/// of frames, as a binary PLY at `out`: for plots that are scanned from stations, and for maps of
/// drives.
///
/// Positions are the measured ones, registered by the true poses unless others are
/// asked for. Every point has its time (`time`: seconds after the start of the sequence, at which
/// its pulse was fired), its class, its object (`chunk_x`, `chunk_y`, `item` as in `trees.csv` and
/// `instances.csv`), frame, LiDAR, ring, return, true range, normal and its class's colour. Returns
/// how many points were written. The file appears when it is whole.
///
/// # Errors
/// As [`Cloud::open`], [`Cloud::check_name`] with `ply`, and [`Cloud::for_each`], and if the file
/// cannot be written.
pub fn cloud(dir: &Path, out: &Path, params: CloudParams) -> Result<u64, Error> {
    Cloud::open(dir, params)?.write_ply(out)
}

impl Cloud {
    /// Writes the points as [`cloud`] does.
    ///
    /// # Errors
    /// As [`Cloud::check_name`] with `ply` and [`Cloud::for_each`], and if the file cannot be
    /// written.
    pub fn write_ply(&self, out: &Path) -> Result<u64, Error> {
        self.check_name(out, "ply")?;
        // The number of points is written before them but known only after them.
        let mut body = BufWriter::new(nemoral_files::scratch_beside(out)?);
        let count = self.for_each(|p| {
            let frame = i32::try_from(p.frame)
                .map_err(|_| Error::invalid("frame", p.frame, "at most 2147483647"))?;
            let colour = self.ontology().class(p.recorded.point.semantic).colour;
            write_point(&mut body, p, frame, colour).map_err(Error::io(out))
        })?;
        let mut file = PendingFile::create(out)?;
        let write = || -> io::Result<()> {
            let mut body = body.into_inner().map_err(io::IntoInnerError::into_error)?;
            body.seek(SeekFrom::Start(0))?;
            file.write_all(&ply::cloud_header(count as usize))?;
            io::copy(&mut body, &mut file).map(drop)
        };
        write().map_err(Error::io(out))?;
        file.commit_synced()?;
        Ok(count)
    }
}

/// Writes a point in the order of [`ply::CLOUD_FIELDS`].
fn write_point(
    out: &mut impl Write,
    p: &CloudPoint,
    frame: i32,
    [r, g, b]: [u8; 3],
) -> io::Result<()> {
    let point = &p.recorded.point;
    let [x, y, z] = p.world_m.to_array();
    for v in [x, y, z, p.fired_s()] {
        out.write_all(&v.to_le_bytes())?;
    }
    let floats = [
        point.intensity,
        point.true_range_m,
        point.range_m,
        point.incidence_cos,
        p.normal.x as f32,
        p.normal.y as f32,
        p.normal.z as f32,
    ];
    for v in floats {
        out.write_all(&v.to_le_bytes())?;
    }
    let chunk = point.object.chunk();
    out.write_all(&chunk.x.to_le_bytes())?;
    out.write_all(&chunk.y.to_le_bytes())?;
    out.write_all(&frame.to_le_bytes())?;
    out.write_all(&i32::from(point.object.item()).to_le_bytes())?;
    out.write_all(&[
        p.recorded.class,
        point.semantic as u8,
        p.lidar,
        point.ring,
        point.return_number,
        point.returns,
        point.flags.0,
        r,
        g,
        b,
    ])
}
