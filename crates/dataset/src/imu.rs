//! What an inertial measurement unit on the robot measured along a sequence's drive.

use std::path::Path;

use nemoral_scene::glam::{DQuat, DVec3};
use nemoral_scene::{RigidTransform, excerpt};
use serde::{Deserialize, Serialize};

use crate::{Dataset, Error, FileRecord, layout, serde_scene};

/// The inertial measurement unit of a sequence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ImuSpec {
    /// The mount: x forward, y to the left, z up in the unit's frame.
    #[serde(with = "serde_scene::rigid_transform")]
    pub body_from_imu: RigidTransform,
    /// Samples per second.
    pub rate_hz: f64,
    /// Standard deviation of the white noise in an angular rate, rad/s.
    pub angular_rate_noise_rad_s: f64,
    /// Standard deviation of the white noise in a specific force, m/s².
    pub specific_force_noise_m_s2: f64,
}

/// The files of a unit, as the EuRoC MAV data set has them (Burri et al. 2016). They cover the
/// whole drive, whichever frames are made here, so that shards agree.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EurocFiles {
    /// `imu0/data.csv`: what it measured.
    pub samples: String,
    /// `imu0/sensor.yaml`: its mount, rate and errors.
    pub sensor: String,
    /// `state_groundtruth_estimate0/data.csv`: how it truly moved, and its biases.
    pub states: String,
}

impl EurocFiles {
    /// The texts with their places below the sequence's folder.
    pub(crate) fn files(&self) -> [(&'static str, &str); 3] {
        let [samples, sensor, states] = layout::IMU_FILES;
        [
            (samples, &self.samples),
            (sensor, &self.sensor),
            (states, &self.states),
        ]
    }
}

/// What a unit measured at a moment, and its true state then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuReading {
    /// Nanoseconds on the clock of `times.txt`.
    pub time_ns: i64,
    /// The angular rate that it measured, in its own frame, rad/s.
    pub angular_rate_rad_s: DVec3,
    /// The specific force (acceleration less gravity) that it measured, in its own frame, m/s².
    pub specific_force_m_s2: DVec3,
    /// Its true pose in the world.
    pub world_from_imu: RigidTransform,
    /// Its true velocity in the world, m/s.
    pub velocity_m_s: DVec3,
    /// The gyroscope's bias, rad/s.
    pub gyroscope_bias_rad_s: DVec3,
    /// The accelerometer's bias, m/s².
    pub accelerometer_bias_m_s2: DVec3,
}

impl Dataset {
    /// What the unit of a sequence measured, in the order of time; nothing if it has none.
    ///
    /// # Errors
    /// [`Error::Io`] and [`Error::Malformed`].
    pub fn imu(&self, sequence: u32) -> Result<Vec<ImuReading>, Error> {
        let Some(files) = self.imu_files(sequence)? else {
            return Ok(Vec::new());
        };
        let place = |name| self.root().join(layout::sequence_file(sequence, name));
        let [samples, _, states] = layout::IMU_FILES;
        readings(
            (&place(samples), &files.samples),
            (&place(states), &files.states),
        )
    }

    /// The records of the files of a sequence's unit; none if it has none.
    pub(crate) fn imu_records(&self, sequence: u32) -> Vec<&FileRecord> {
        let paths = layout::IMU_FILES.map(|name| layout::sequence_file(sequence, name));
        let files = self.manifest().files.iter();
        files
            .filter(|f| paths.iter().any(|path| f.path.as_str() == path))
            .collect()
    }

    /// The files of a sequence's unit; `None` if it has none.
    ///
    /// # Errors
    /// [`Error::Io`] and [`Error::Malformed`].
    pub fn imu_files(&self, sequence: u32) -> Result<Option<EurocFiles>, Error> {
        let spec = self.manifest().header.sequence(sequence);
        if spec.is_none_or(|spec| spec.imu.is_none()) {
            return Ok(None);
        }
        let text = |name| self.read_text(&layout::sequence_file(sequence, name));
        let [samples, sensor, states] = layout::IMU_FILES;
        Ok(Some(EurocFiles {
            samples: text(samples)?,
            sensor: text(sensor)?,
            states: text(states)?,
        }))
    }
}

/// The readings of both tables, which have the same times, one after the other.
pub(crate) fn readings(
    (samples_at, samples): (&Path, &str),
    (states_at, states): (&Path, &str),
) -> Result<Vec<ImuReading>, Error> {
    let mut all = Vec::new();
    let (mut samples, mut states) = (lines(samples), lines(states));
    loop {
        let (sample, state) = (samples.next(), states.next());
        let (Some(sample), Some(state)) = (sample, state) else {
            if sample.is_some() || state.is_some() {
                let message = format!("has not as many lines as {}", states_at.display());
                return Err(Error::malformed(samples_at, message));
            }
            return Ok(all);
        };
        let (time_ns, [rate, force]) = columns::<2>(samples_at, sample, &[3, 3])?;
        let (state_ns, [position, turn, velocity, gyroscope, accelerometer]) =
            columns::<5>(states_at, state, &[3, 4, 3, 3, 3])?;
        if state_ns != time_ns {
            let message = format!("has {state_ns} ns where the samples have {time_ns} ns");
            return Err(Error::malformed(states_at, message));
        }
        if all
            .last()
            .is_some_and(|last: &ImuReading| last.time_ns >= time_ns)
        {
            let message = format!("{time_ns} ns: times do not rise");
            return Err(Error::malformed(samples_at, message));
        }
        let [w, x, y, z] = turn;
        let rotation = DQuat::from_xyzw(x, y, z, w);
        if (rotation.length() - 1.0).abs() > 1e-6 {
            let message = format!("{time_ns} ns: {turn:?} is no unit quaternion");
            return Err(Error::malformed(states_at, message));
        }
        let vector = |[x, y, z, _]: [f64; 4]| DVec3::new(x, y, z);
        all.push(ImuReading {
            time_ns,
            angular_rate_rad_s: vector(rate),
            specific_force_m_s2: vector(force),
            world_from_imu: RigidTransform {
                rotation: rotation.normalize(),
                translation_m: vector(position),
            },
            velocity_m_s: vector(velocity),
            gyroscope_bias_rad_s: vector(gyroscope),
            accelerometer_bias_m_s2: vector(accelerometer),
        });
    }
}

/// The lines of a table; those that begin with `#` name its columns.
fn lines(text: &str) -> impl Iterator<Item = &str> {
    text.lines().filter(|line| !line.starts_with('#'))
}

/// The time of a line and its vectors, which have so many finite numbers each, at most four.
fn columns<const N: usize>(
    path: &Path,
    line: &str,
    sizes: &[usize; N],
) -> Result<(i64, [[f64; 4]; N]), Error> {
    let wide = 1 + sizes.iter().sum::<usize>();
    let bad = || {
        let shown = excerpt(line, 200);
        Error::malformed(path, format!("'{shown}' is not {wide} numbers"))
    };
    let mut fields = line.split(',');
    let time_ns = fields.next().and_then(|field| field.parse::<i64>().ok());
    // So differences of times are times, too.
    let time_ns = time_ns
        .filter(|t| t.unsigned_abs() <= 1 << 62)
        .ok_or_else(bad)?;
    let mut vectors = [[0.0; 4]; N];
    for (vector, &size) in vectors.iter_mut().zip(sizes) {
        for number in &mut vector[..size] {
            let parsed = fields.next().and_then(|field| field.parse::<f64>().ok());
            *number = parsed.filter(|number| number.is_finite()).ok_or_else(bad)?;
        }
    }
    if fields.next().is_some() {
        return Err(bad());
    }
    Ok((time_ns, vectors))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAMPLES: &str = "#timestamp [ns],…\n0,0.1,0.2,0.3,1,2,9.8\n5000000,0,0,0,0,0,9.8\n";
    const STATES: &str = "#timestamp,…\n0,1,2,3,1,0,0,0,0.5,0,0,0,0,0.01,0,0,0.2\n\
                          5000000,1,2,3,0.6,0,0,0.8,0.5,0,0,0,0,0,0,0,0\n";

    fn read(samples: &str, states: &str) -> Result<Vec<ImuReading>, String> {
        let (a, b) = (Path::new("samples"), Path::new("states"));
        readings((a, samples), (b, states)).map_err(|e| e.to_string())
    }

    #[test]
    fn both_tables_are_read_together() {
        let [first, second] = *read(SAMPLES, STATES).expect("sound") else {
            panic!("two lines")
        };
        assert_eq!((first.time_ns, second.time_ns), (0, 5_000_000));
        assert_eq!(first.angular_rate_rad_s, DVec3::new(0.1, 0.2, 0.3));
        assert_eq!(first.specific_force_m_s2, DVec3::new(1.0, 2.0, 9.8));
        assert_eq!(first.gyroscope_bias_rad_s, DVec3::Z * 0.01);
        assert_eq!(first.accelerometer_bias_m_s2, DVec3::Z * 0.2);
        assert_eq!(first.velocity_m_s, DVec3::X * 0.5);
        // The scalar comes first.
        let turned = second.world_from_imu.rotation;
        assert_eq!(turned.to_array(), [0.0, 0.0, 0.8, 0.6]);
        assert_eq!(
            second.world_from_imu.translation_m,
            DVec3::new(1.0, 2.0, 3.0)
        );
    }

    #[test]
    fn wrong_tables_are_refused() {
        for (samples, states, told) in [
            ("0,1,2,3,4,5\n".into(), STATES.into(), "is not 7 numbers"),
            (
                "0,1,2,3,4,5,NaN\n".into(),
                STATES.into(),
                "is not 7 numbers",
            ),
            (
                "0,1,2,3,4,5,6,7\n".into(),
                STATES.into(),
                "is not 7 numbers",
            ),
            ("0,1,2,3,4,5,6\n".into(), STATES.into(), "not as many lines"),
            (
                SAMPLES.replace("5000000", "1"),
                STATES.to_owned(),
                "5000000 ns where",
            ),
            (
                SAMPLES.replace("5000000", "0"),
                STATES.replace("5000000", "0"),
                "do not rise",
            ),
            (
                SAMPLES.into(),
                STATES.replace("0.8", "0.9"),
                "no unit quaternion",
            ),
        ] {
            let (samples, states): (String, String) = (samples, states);
            let error = read(&samples, &states).expect_err(told);
            assert!(error.contains(told), "{error}");
        }
    }
}
