//! What the robot's inertial measurement unit measures along its drive.

use std::io::Write;
use std::path::{Path, PathBuf};

use nemoral_dataset::{EurocFiles, ImuReading};
use nemoral_files::{Folder, InnerPath, PendingFile};
use nemoral_imu::{ImuMotion, ImuNoise, ImuSample, euroc, motions};
use nemoral_scene::RigidTransform;
use nemoral_scene::glam::DVec2;
use nemoral_seed::{Domain, Key};

use crate::chunks::ChunkManager;
use crate::config::Config;
use crate::plan::Runner;
use crate::preflight::preflight;
use crate::recording::pose::half_scan_s;
use crate::world::lidars::LidarRig;
use crate::world::trajectory::{RobotTrajectory, Surroundings};
use crate::{Error, ForestPlan, Recorder};

const IMU: Domain = Domain::new("pipeline.imu");

/// The most samples that are made of a drive, some days of them.
const MOST_SAMPLES: f64 = 1e8;

/// The most samples that are kept in memory, as those of a data set's sequence are: seven hours at
/// 200 Hz.
const MOST_KEPT: f64 = 5e6;

/// Rates and forces beyond these, 2000 °/s and 16 g, are beyond a unit's range.
const MOST_RAD_S: f64 = 34.9;
const MOST_M_S2: f64 = 157.0;

/// What was measured of a drive.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MeasuredMotion {
    /// The number of samples.
    pub samples: u64,
    /// How many of them are beyond 2000 °/s or 16 g.
    pub out_of_range: u64,
    /// What a user should know about the drive.
    pub note: Option<String>,
}

impl MeasuredMotion {
    /// What a user should know about the samples.
    #[must_use]
    pub fn range_note(&self) -> Option<String> {
        (self.out_of_range > 0).then(|| {
            format!(
                "{} of {} samples of the inertial unit are beyond 2000 degrees a second or 16 g, \
                 which is beyond the range of most: the robot drives too fast for its ground",
                self.out_of_range, self.samples
            )
        })
    }
}

/// Hands over what the unit of a config measures along its drive, in the order of time; `leave` is
/// called now and then with the place that the robot has come to, metres, to free what is far from
/// it.
fn measure(
    config: &Config,
    forest: &ForestPlan,
    runner: &Runner<'_>,
    mut each: impl FnMut(&ImuMotion, &ImuSample) -> Result<(), Error>,
    leave: impl Fn(DVec2),
) -> Result<MeasuredMotion, Error> {
    let mut measured = MeasuredMotion::default();
    let trajectory = runner.get(forest.trajectory, ())?;
    let body_from_imu = config.imu.body_from_imu();
    let pose = |time_s: f64| -> Result<RigidTransform, Error> {
        let surroundings = Surroundings {
            ground: runner.demand(forest.ground),
            objects: runner.demand(forest.objects),
        };
        Ok(trajectory.pose(0, time_s, surroundings)? * body_from_imu)
    };
    let params = config.imu.params();
    let key = Key::world(config.seed).domain(IMU);
    let mut noise = ImuNoise::new(&params, key).map_err(|e| Error::request(e.to_string()))?;
    let first_s = trajectory.time_s(0);
    let last_s = trajectory.time_s(config.frames - 1) - first_s;
    let end_s = end_s(config, &trajectory, &runner.get(forest.lidars, ())?);
    // Beyond the last frame in any case: programs wait for a sample after it.
    let after_last = (last_s * params.rate_hz + 1e-6).floor() + 1.0;
    let intervals = (end_s * params.rate_hz - 1e-6).ceil().max(after_last);
    if intervals >= MOST_SAMPLES {
        return Err(Error::request(format!(
            "imu.rate_hz = {}: in the {last_s:.1e} s of the drive these are {intervals:.1e} \
             samples: at most {MOST_SAMPLES:e} are made",
            params.rate_hz
        )));
    }
    let samples = intervals as u64 + 1;
    let mut left_m = None;
    for motion in motions(params.rate_hz, samples, pose) {
        let motion = motion?;
        let motion = ImuMotion {
            time_s: first_s + motion.time_s,
            ..motion
        };
        let sample = noise.measure(&motion);
        each(&motion, &sample)?;
        measured.samples += 1;
        let is_beyond = motion.angular_rate_rad_s.abs().max_element() > MOST_RAD_S
            || motion.specific_force_m_s2.abs().max_element() > MOST_M_S2;
        measured.out_of_range += u64::from(is_beyond);
        let place_m = motion.world_from_imu.translation_m.truncate();
        let moved_m = place_m.distance(*left_m.get_or_insert(place_m));
        if moved_m > config.chunks.size_m {
            leave(place_m);
            left_m = Some(place_m);
        }
    }
    Ok(measured)
}

/// The files of a data set's unit.
pub(crate) fn imu_files(
    config: &Config,
    forest: &ForestPlan,
    runner: &Runner<'_>,
) -> Result<(EurocFiles, MeasuredMotion), Error> {
    let manager = ChunkManager::new(config.chunks.clone());
    let mut files = EurocFiles {
        samples: euroc::SAMPLES_HEADER.to_owned(),
        sensor: euroc::sensor_yaml(&config.imu.params(), &config.imu.body_from_imu()),
        states: euroc::STATES_HEADER.to_owned(),
    };
    let each = |motion: &ImuMotion, sample: &ImuSample| {
        euroc::push_sample(&mut files.samples, sample);
        euroc::push_state(&mut files.states, motion, sample);
        Ok(())
    };
    let leave = |place_m| manager.evict(runner.store(), place_m, &[]);
    let measured = measure(config, forest, runner, each, leave)?;
    Ok((files, measured))
}

/// When the last scan has ended, seconds after the first frame.
fn end_s(config: &Config, trajectory: &RobotTrajectory, lidars: &[LidarRig]) -> f64 {
    trajectory.time_s(config.frames - 1) - trajectory.time_s(0) + half_scan_s(lidars)
}

/// Refuses more samples than a data set's sequence may have.
pub(crate) fn refuse_too_many(
    config: &Config,
    trajectory: &RobotTrajectory,
    lidars: &[LidarRig],
) -> Result<(), Error> {
    let (last_s, rate_hz) = (end_s(config, trajectory, lidars), config.imu.rate_hz);
    if last_s * rate_hz < MOST_KEPT {
        return Ok(());
    }
    Err(Error::request(format!(
        "imu.rate_hz = {rate_hz}: must be at most {:.1} with {} frames in {last_s:.0} s: a \
         sequence has at most {MOST_KEPT:e} samples",
        (MOST_KEPT / last_s * 10.0).floor() / 10.0,
        config.frames
    )))
}

impl Recorder {
    /// Hands over what the unit measures, in the order of time, from the first frame's time until
    /// the last scan has ended, with its true motion. Chunks that are left behind are freed, for
    /// other uses of this recorder, too.
    ///
    /// # Errors
    /// If the robot does not drive: at stations, or at places beside its path; if the ground cannot
    /// be made; and the first error of `each`.
    pub fn measure_motion(
        &self,
        each: impl FnMut(&ImuMotion, &ImuSample) -> Result<(), Error>,
    ) -> Result<MeasuredMotion, Error> {
        let note = self.preflight_drive()?;
        let config = &self.sequence().config;
        let leave = |place_m| self.free_around(place_m);
        let measured = measure(config, self.forest(), &self.runner(), each, leave)?;
        Ok(MeasuredMotion { note, ..measured })
    }

    /// What the unit measures, all of it, as a data set has it.
    ///
    /// # Errors
    /// As [`Recorder::measure_motion`], and if there are more samples than a data set's sequence
    /// may have.
    pub fn imu_readings(&self) -> Result<Vec<ImuReading>, Error> {
        let (runner, forest) = (self.runner(), self.forest());
        let trajectory = runner.get(forest.trajectory, ())?;
        let lidars = runner.get(forest.lidars, ())?;
        refuse_too_many(&self.sequence().config, &trajectory, &lidars)?;
        let mut all = Vec::new();
        self.measure_motion(|motion, sample| {
            all.push(ImuReading {
                time_ns: (sample.time_s * 1e9).round() as i64,
                angular_rate_rad_s: sample.angular_rate_rad_s,
                specific_force_m_s2: sample.specific_force_m_s2,
                world_from_imu: motion.world_from_imu,
                velocity_m_s: motion.velocity_m_s,
                gyroscope_bias_rad_s: sample.gyroscope_bias_rad_s,
                accelerometer_bias_m_s2: sample.accelerometer_bias_m_s2,
            });
            Ok(())
        })?;
        Ok(all)
    }

    /// Refuses robots that do not drive, and says what a user should know about a drive.
    fn preflight_drive(&self) -> Result<Option<String>, Error> {
        let config = &self.sequence().config;
        if let Some((path, why)) = config.motion_is_unknown() {
            return Err(Error::request(format!(
                "{path}: has no motion to measure: {why}; a drive along a trail, a wander, lanes, \
                 a straight line or a file's poses has"
            )));
        }
        preflight(config, self.forest(), &self.runner())
    }

    /// Writes what the unit measures into a folder in the layout of the EuRoC MAV data set
    /// ([`nemoral_imu::euroc`]). Each file appears when it is whole.
    ///
    /// # Errors
    /// As [`Recorder::measure_motion`], if the folder is not empty, and if a file cannot be
    /// written.
    pub fn write_imu(&self, folder: &Path) -> Result<MeasuredMotion, Error> {
        self.preflight_drive()?;
        nemoral_export::check_folder(folder).map_err(|e| Error::request(e.to_string()))?;
        let imu = &self.sequence().config.imu;
        let folder = Folder::new(folder);
        folder.create_root()?;
        let mut samples = TextFile::begin(&folder, euroc::SAMPLES, euroc::SAMPLES_HEADER)?;
        let mut states = TextFile::begin(&folder, euroc::STATES, euroc::STATES_HEADER)?;
        let measured = self.measure_motion(|motion, sample| {
            euroc::push_sample(&mut samples.text, sample);
            euroc::push_state(&mut states.text, motion, sample);
            samples.flush(BUFFER)?;
            states.flush(BUFFER)
        })?;
        let yaml = euroc::sensor_yaml(&imu.params(), &imu.body_from_imu());
        let sensor = TextFile::begin(&folder, euroc::SENSOR, &yaml)?;
        for file in [samples, states, sensor] {
            file.commit()?;
        }
        Ok(measured)
    }
}

/// So much text is written at once, bytes.
const BUFFER: usize = 1 << 16;

/// A text that is written in parts.
struct TextFile {
    path: PathBuf,
    file: PendingFile,
    text: String,
}

impl TextFile {
    fn begin(folder: &Folder, name: &str, text: &str) -> Result<Self, Error> {
        let name = InnerPath::new(name).expect("the layout's names are inside of a folder");
        if let Some(parent) = name.parent() {
            folder.create_folders(&parent)?;
        }
        Ok(Self {
            path: name.below(folder.root()),
            file: folder.begin(&name)?,
            text: text.to_owned(),
        })
    }

    /// Writes the text if it is at least so long.
    fn flush(&mut self, at_least: usize) -> Result<(), Error> {
        if self.text.len() >= at_least {
            let written = self.file.write_all(self.text.as_bytes());
            written.map_err(nemoral_files::Error::io(&self.path))?;
            self.text.clear();
        }
        Ok(())
    }

    fn commit(mut self) -> Result<(), Error> {
        self.flush(0)?;
        Ok(self.file.commit()?)
    }
}
