//! What sequences and frames become: scenes, samples, their times, and the tokens of all records.

use super::sensors::{self, Sensor};
use crate::{Error, FrameRef, Sequence, Source, digest};

/// A microsecond's share of a second.
const US: u64 = 1_000_000;

/// A sequence that has frames.
#[derive(Debug)]
pub(super) struct Scene<'a> {
    pub(super) sequence: Sequence<'a>,
    pub(super) frames: Vec<FrameRef<'a>>,
    pub(super) sensors: Vec<Sensor>,
    /// When it starts, microseconds.
    start_us: u64,
}

impl Scene<'_> {
    pub(super) fn name(&self) -> String {
        name(self.sequence.number)
    }

    /// A frame's time.
    pub(super) fn time_us(&self, frame: &FrameRef<'_>) -> u64 {
        self.start_us + (frame.time_s * US as f64).round() as u64
    }
}

/// The name of a sequence's scene.
pub(super) fn name(sequence: u32) -> String {
    format!("nemoral-{sequence:02}")
}

/// The step of a frame, whose note has its annotations.
pub(super) fn step(frame: &FrameRef<'_>) -> String {
    format!("frame-{}", frame.name())
}

/// The scenes, each of which starts a second after the whole second in which the one before has
/// ended: programs sort the samples of all scenes by their times.
pub(super) fn scenes(source: &Source) -> Result<Vec<Scene<'_>>, Error> {
    let mut scenes = Vec::new();
    let mut start_us = US;
    for sequence in source.sequences() {
        let frames: Vec<_> = source.frames(sequence.number).collect();
        let Some(last) = frames.last() else {
            continue;
        };
        let lasts_us = US * (last.time_s.ceil() as u64 + 1);
        let (number, cameras, lidars) = (sequence.number, sequence.cameras, sequence.lidars);
        scenes.push(Scene {
            sensors: sensors::of(number, cameras, lidars)?,
            sequence,
            frames,
            start_us,
        });
        start_us += lasts_us;
    }
    Ok(scenes)
}

/// The tokens of records: digests of the data set and of what a record is about, so that two data
/// sets share none, and equal ones all.
#[derive(Clone, Debug)]
pub(super) struct Tokens {
    source: String,
}

impl Tokens {
    pub(super) fn of(source: &Source) -> Self {
        let source = source.digest().to_owned();
        Self { source }
    }

    fn token(&self, key: &str) -> String {
        let mut token = digest(format!("{}/{key}", self.source).as_bytes());
        token.truncate(32);
        token
    }

    pub(super) fn map(&self) -> String {
        self.token("map")
    }

    pub(super) fn log(&self, scene: &Scene<'_>) -> String {
        self.token(&format!("log/{}", scene.name()))
    }

    pub(super) fn scene(&self, scene: &Scene<'_>) -> String {
        self.token(&format!("scene/{}", scene.name()))
    }

    pub(super) fn category(&self, name: &str) -> String {
        self.token(&format!("category/{name}"))
    }

    pub(super) fn sensor(&self, sensor: &Sensor) -> String {
        self.token(&format!("sensor/{}", sensor.channel))
    }

    pub(super) fn calibrated_sensor(&self, scene: &Scene<'_>, sensor: &Sensor) -> String {
        let (scene, channel) = (scene.name(), &sensor.channel);
        self.token(&format!("calibrated_sensor/{scene}/{channel}"))
    }

    pub(super) fn sample(&self, frame: &FrameRef<'_>) -> String {
        self.token(&format!("sample/{}", frame.name()))
    }

    pub(super) fn ego_pose(&self, frame: &FrameRef<'_>) -> String {
        self.token(&format!("ego_pose/{}", frame.name()))
    }

    pub(super) fn sample_data(&self, frame: &FrameRef<'_>, sensor: &Sensor) -> String {
        let (frame, channel) = (frame.name(), &sensor.channel);
        self.token(&format!("sample_data/{frame}/{channel}"))
    }

    pub(super) fn instance(&self, scene: &Scene<'_>, object: u64) -> String {
        self.token(&format!("instance/{}/{object}", scene.name()))
    }

    pub(super) fn annotation(&self, frame: &FrameRef<'_>, object: u64) -> String {
        self.token(&format!("sample_annotation/{}/{object}", frame.name()))
    }
}
