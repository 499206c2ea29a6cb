//! The layout of the EuRoC MAV data set, with calibrations as Kalibr has them, a folder for each
//! sequence:
//! ```text
//! SS/mav0/body.yaml
//! SS/mav0/cam0/data/0000000001000000000.png  data.csv  sensor.yaml    cam1 and so on are alike
//! SS/mav0/imu0/data.csv  sensor.yaml                                  if there is a unit
//! SS/mav0/state_groundtruth_estimate0/data.csv  sensor.yaml
//! SS/camchain-imucam.yaml  imu.yaml        Kalibr's files; camchain.yaml without a unit
//! ```
//! Cameras have numbers in the data set's order. B, the body of `T_BS`, is the inertial unit's
//! frame, as in EuRoC: so the unit and the true states have the identity there, and a camera its
//! pose in the unit's frame. Without a unit B is the robot's body, and the true states are the
//! frames' poses.
//!
//! Times are those of the format `mcap`: nanoseconds after the start of the sequence plus a second,
//! in 19 digits as EuRoC's. Readers cut seconds off such a text, and sort pictures by their names,
//! which needs ten digits or more, and equally many. The first pixel's centre is at (0, 0).
//!
//! Sources: Burri et al., "The EuRoC micro aerial vehicle datasets", International Journal of
//! Robotics Research 35(10), 2016; Kalibr's page "YAML formats".

mod calibration;
mod states;

use nemoral_dataset::Manifest;
use nemoral_scene::RigidTransform;

use crate::formats::mcap::stamp_ns;
use crate::formats::{refuse_times_beyond, refuse_times_that_do_not_rise, refuse_without_cameras};
use crate::geometry::relative;
use crate::{Error, Format, FrameRef, Sequence, Sink, Source, StepFiles};
use calibration::Lens;

/// The format.
#[derive(Debug)]
pub(crate) struct Euroc;

impl Format for Euroc {
    fn check(&self, manifest: &Manifest) -> Result<(), Error> {
        refuse_without_cameras("euroc", manifest)?;
        for sequence in &manifest.header.sequences {
            for camera in &sequence.cameras {
                Lens::of(sequence.number, camera)?;
            }
        }
        refuse_times_beyond("euroc", manifest)?;
        refuse_times_that_do_not_rise("euroc", manifest, |a, b| stamp_ns(b) <= stamp_ns(a))
    }

    fn write(&self, source: &Source, sink: &mut Sink) -> Result<(), Error> {
        for sequence in source.sequences() {
            let folder = format!("{:02}/mav0", sequence.number);
            for frame in source.frames(sequence.number) {
                sink.step(&format!("frame-{}", frame.name()), |files| {
                    for i in 0..sequence.cameras.len() {
                        let path = format!("{folder}/cam{i}/data/{}.png", stamp(&frame));
                        files.put(path, source.picture_bytes(&frame, i)?);
                    }
                    Ok(String::new())
                })?;
            }
            let frames: Vec<_> = source.frames(sequence.number).collect();
            sink.step(&format!("sequence-{:02}", sequence.number), |files| {
                cameras(&sequence, &frames, files)?;
                states::put(source, &sequence, &frames, files)?;
                let body = calibration::body_yaml(sequence.imu.is_some());
                files.put(format!("{folder}/body.yaml"), body);
                Ok(String::new())
            })?;
        }
        Ok(())
    }
}

/// The lists and calibrations of a sequence's cameras.
fn cameras(
    sequence: &Sequence<'_>,
    frames: &[FrameRef<'_>],
    files: &mut StepFiles,
) -> Result<(), Error> {
    let number = sequence.number;
    let body = body_from_b(sequence);
    for (i, camera) in sequence.cameras.iter().enumerate() {
        let folder = format!("{number:02}/mav0/cam{i}");
        let lens = Lens::of(number, camera)?;
        let mount = relative(&body, &camera.body_from_camera);
        let text = calibration::camera_yaml(camera, &lens, &mount, rate_hz(frames));
        files.put(format!("{folder}/sensor.yaml"), text);
        let list = frames.iter().map(|frame| {
            let stamp = stamp(frame);
            format!("{stamp},{stamp}.png\n")
        });
        let text = "#timestamp [ns],filename\n".to_owned() + &list.collect::<String>();
        files.put(format!("{folder}/data.csv"), text);
    }
    if !sequence.cameras.is_empty() {
        let name = match sequence.imu {
            Some(_) => "camchain-imucam",
            None => "camchain",
        };
        let text = calibration::camera_chain(sequence)?;
        files.put(format!("{number:02}/{name}.yaml"), text);
    }
    Ok(())
}

/// The place of B on the robot's body.
fn body_from_b(sequence: &Sequence<'_>) -> RigidTransform {
    let unit = sequence.imu.map(|unit| unit.body_from_imu);
    unit.unwrap_or(RigidTransform::IDENTITY)
}

fn stamp(frame: &FrameRef<'_>) -> String {
    stamp_of(stamp_ns(frame.time_s))
}

/// A time as it is in all files.
fn stamp_of(time_ns: u64) -> String {
    format!("{time_ns:019}")
}

/// Pictures per second, those left out included, in millionths; nothing can be said of one picture.
fn rate_hz(frames: &[FrameRef<'_>]) -> Option<f64> {
    let (first, last) = (frames.first()?, frames.last()?);
    let rate_hz = last.index.saturating_sub(first.index) as f64 / (last.time_s - first.time_s);
    (rate_hz.is_finite() && rate_hz > 0.0).then(|| (rate_hz * 1e6).round() / 1e6)
}
