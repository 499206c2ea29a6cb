//! Reads scans, and nothing else: their header says how many bytes follow it.

use std::path::Path;

use nemoral_scene::glam::Vec3;
use nemoral_scene::{ChunkCoord, LidarPoint, ObjectId, PointFlags, Semantic};

use super::{MOST_TIME, PlyPoint, STRIDE, holds, scan_header, seconds};
use crate::Error;

/// The points of a file, which must have the layout of [`encode`](super::encode).
pub(crate) fn decode(path: &Path, bytes: &[u8]) -> Result<Vec<PlyPoint>, Error> {
    let wrong = |message: String| Error::malformed(path, message);
    let vertices = vertices(bytes).ok_or_else(|| wrong("is no scan of this program".to_owned()))?;
    let header = scan_header(vertices);
    let Some(body) = bytes.strip_prefix(header.as_bytes()) else {
        return Err(wrong("has other fields than a scan's".to_owned()));
    };
    if vertices.checked_mul(STRIDE) != Some(body.len()) {
        let found = body.len();
        return Err(wrong(format!(
            "has {found} bytes after its header, {vertices} vertices have {STRIDE} each"
        )));
    }
    let (vertices, _) = body.as_chunks::<STRIDE>();
    (vertices.iter().enumerate())
        .map(|(i, bytes)| point(bytes).map_err(|what| wrong(format!("vertex {i}: {what}"))))
        .collect()
}

/// The number of vertices that a header declares.
fn vertices(bytes: &[u8]) -> Option<usize> {
    const LINE: &[u8] = b"\nelement vertex ";
    let head = &bytes[..bytes.len().min(1024)];
    let at = head.windows(LINE.len()).position(|w| w == LINE)? + LINE.len();
    let digits = head[at..].split(|b| *b == b'\n').next()?;
    std::str::from_utf8(digits).ok()?.parse().ok()
}

/// Takes values one after the other from the front of a vertex, which is as long as all of them.
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (value, rest) = self
            .0
            .split_first_chunk()
            .expect("a vertex has all its fields");
        self.0 = rest;
        *value
    }

    fn byte(&mut self) -> u8 {
        let [value] = self.take();
        value
    }

    /// A number that the type has.
    fn whole<T: TryFrom<i32>>(&mut self, name: &str) -> Result<T, String> {
        let value = i32::from_le_bytes(self.take());
        T::try_from(value).map_err(|_| format!("{name} {value} is out of range"))
    }

    fn float(&mut self, name: &str) -> Result<f32, String> {
        let value = f32::from_le_bytes(self.take());
        let number = value.is_finite().then_some(value);
        number.ok_or_else(|| format!("{name} {value} is no finite number"))
    }

    fn vector(&mut self, names: [&str; 3]) -> Result<Vec3, String> {
        let [x, y, z] = names.map(|name| self.float(name));
        Ok(Vec3::new(x?, y?, z?))
    }
}

fn point(bytes: &[u8; STRIDE]) -> Result<PlyPoint, String> {
    let mut f = Fields(bytes);
    let position_m = f.vector(["x", "y", "z"])?;
    let range_m = f.float("range")?;
    let true_range_m = f.float("range_true")?;
    let intensity = f.float("intensity")?;
    let [reflectivity, class, semantic] = f.take();
    let semantic =
        Semantic::from_u8(semantic).ok_or_else(|| format!("semantic {semantic} is unknown"))?;
    let chunk = ChunkCoord::new(i32::from_le_bytes(f.take()), i32::from_le_bytes(f.take()));
    let object = match (f.whole("item")?, chunk) {
        (0, ChunkCoord { x: 0, y: 0 }) => ObjectId::NONE,
        (item, chunk) => ObjectId::new(chunk, item)
            .ok_or_else(|| format!("there is no item {item} in a chunk {chunk}"))?,
    };
    let label = f.whole("label_instance")?;
    let [ring, return_number, returns] = f.take();
    let time_s = f64::from_le_bytes(f.take());
    let time_ns = nanoseconds(time_s)
        .ok_or_else(|| format!("t {time_s} s is no whole number of nanoseconds"))?;
    let point = LidarPoint {
        position_m,
        true_range_m,
        range_m,
        intensity,
        reflectivity,
        semantic,
        object,
        ring,
        return_number,
        returns,
        time_ns,
        pulse: f.whole("pulse")?,
        incidence_cos: f.float("incidence_cos")?,
        normal: f.vector(["nx", "ny", "nz"])?,
        flags: PointFlags(f.byte()),
    };
    if !holds(&point) {
        return Err(format!("t {time_s} s: must be {MOST_TIME}"));
    }
    Ok(PlyPoint {
        point,
        class,
        label,
    })
}

/// The whole nanoseconds of which these are the seconds, if there are any.
fn nanoseconds(time_s: f64) -> Option<i64> {
    let time_ns = (time_s * 1e9).round() as i64;
    (seconds(time_ns).to_bits() == time_s.to_bits()).then_some(time_ns)
}

#[cfg(test)]
mod tests {
    use super::super::encode;
    use super::super::tests::sample;
    use super::*;

    #[test]
    fn times_that_are_not_written_are_not_read() {
        let read = |time_ns: i64| {
            let mut point = sample(1);
            point.point.time_ns = time_ns;
            decode(Path::new("x"), &encode(&[point]))
        };
        for time_ns in [0, (1 << 50) - 1, 1 - (1 << 50)] {
            let points = read(time_ns).expect("within the limit");
            assert_eq!(points[0].point.time_ns, time_ns);
        }
        for time_ns in [1 << 50, -(1 << 50), i64::MAX, i64::MIN] {
            let e = read(time_ns).expect_err("beyond the limit").to_string();
            let told = e.contains("vertex 0: t ") && e.contains("must be within 2^50 ns");
            assert!(told, "{e}");
        }
    }

    #[test]
    fn numbers_that_are_not_finite_are_not_read() {
        let read = |change: fn(&mut LidarPoint)| {
            let mut points = [sample(1), sample(2)];
            change(&mut points[1].point);
            decode(Path::new("x"), &encode(&points))
        };
        assert!(read(|_| {}).is_ok());
        type Change = fn(&mut LidarPoint);
        let changes: [(Change, &str); 4] = [
            (|p| p.position_m.z = f32::NAN, "z NaN"),
            (|p| p.intensity = f32::INFINITY, "intensity inf"),
            (|p| p.normal.y = f32::NEG_INFINITY, "ny -inf"),
            (|p| p.incidence_cos = f32::NAN, "incidence_cos NaN"),
        ];
        for (change, told) in changes {
            let error = read(change).expect_err(told).to_string();
            assert!(
                error.contains(&format!("vertex 1: {told} is no finite")),
                "{error}"
            );
        }
    }

    #[test]
    fn a_header_that_lies_is_refused_without_asking_for_memory() {
        let bytes = encode(&[sample(1)]);
        let text = |from: &str, to: &str| {
            let at = bytes
                .windows(from.len())
                .position(|w| w == from.as_bytes())
                .expect("there");
            [&bytes[..at], to.as_bytes(), &bytes[at + from.len()..]].concat()
        };
        for lie in [
            b"ply\nformat binary_little_endian 1.0\nelement vertex 1\nend_header\n\0\0".to_vec(),
            text("vertex 1\n", "vertex 2\n"),
            text("vertex 1\n", "vertex 18446744073709551615\n"),
            text("vertex 1\n", "vertex 01\n"),
            text("vertex 1\n", "vertex -1\n"),
            text("float x", "double x"),
            text("\nproperty double t\n", "\nproperty float tt\n"),
            bytes[..bytes.len() - 1].to_vec(),
            [&*bytes, &[0]].concat(),
            Vec::new(),
        ] {
            decode(Path::new("x"), &lie).expect_err("a lie");
        }
    }
}
