//! What sequences and frames become: scenes, samples, their times, and the tokens of all records.

use std::collections::BTreeMap;

use nemoral_dataset::Manifest;

use super::sensors::{self, Sensor};
use super::{LIDAR_TOP, unsuitable};
use crate::{Error, FrameRef, Sequence, Source, digest};

/// Microseconds in a second.
const US_PER_S: u64 = 1_000_000;

/// A sequence that has frames.
#[derive(Debug)]
pub(super) struct Scene<'a> {
    pub(super) sequence: Sequence<'a>,
    pub(super) frames: Vec<FrameRef<'a>>,
    pub(super) sensors: Vec<Sensor>,
    /// When it starts, microseconds.
    start_us: u64,
    /// The whole second of the data set's own time that this is.
    start_s: f64,
}

impl Scene<'_> {
    pub(super) fn name(&self) -> String {
        name(self.sequence.number)
    }

    /// The first LiDAR.
    pub(super) fn top(&self) -> Option<&Sensor> {
        self.sensors.iter().find(|s| s.channel == LIDAR_TOP)
    }

    /// A frame's time.
    pub(super) fn time_us(&self, frame: &FrameRef<'_>) -> u64 {
        self.start_us + ((frame.time_s - self.start_s) * US_PER_S as f64).round() as u64
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

/// When the scenes start, microseconds, by their sequences' numbers. Each one starts a second after
/// the whole second in which the one before has ended, as programs sort the samples of all scenes
/// by their times, and at a whole second of its own time.
pub(super) fn starts_us(manifest: &Manifest) -> Result<BTreeMap<u32, u64>, Error> {
    let mut starts_us = BTreeMap::new();
    let mut next_us = US_PER_S;
    for frames in manifest.frames.chunk_by(|a, b| a.sequence == b.sequence) {
        let (first, last) = (&frames[0], &frames[frames.len() - 1]);
        starts_us.insert(first.sequence, next_us);
        let lasts_s = (last.time_s.ceil() - first.time_s.floor()) as u64;
        let end_us = (lasts_s.checked_add(1))
            .and_then(|s| s.checked_mul(US_PER_S))
            .and_then(|us| us.checked_add(next_us));
        next_us = end_us.ok_or_else(|| {
            unsuitable(format!(
                "sequence {:02} lasts {lasts_s} s: the microseconds of all sequences must fit in \
                 64 bits",
                first.sequence
            ))
        })?;
    }
    Ok(starts_us)
}

/// The scenes.
pub(super) fn scenes(source: &Source) -> Result<Vec<Scene<'_>>, Error> {
    let mut scenes = Vec::new();
    let starts_us = starts_us(source.manifest())?;
    for sequence in source.sequences() {
        let (number, cameras, lidars) = (sequence.number, sequence.cameras, sequence.lidars);
        let frames: Vec<_> = source.frames(number).collect();
        let (Some(first), Some(&start_us)) = (frames.first(), starts_us.get(&number)) else {
            continue;
        };
        scenes.push(Scene {
            sensors: sensors::of(number, cameras, lidars)?,
            sequence,
            start_us,
            start_s: first.time_s.floor(),
            frames,
        });
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

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use nemoral_dataset::{DatasetHeader, FORMAT_VERSION, FrameRecord, Manifest};
    use nemoral_scene::{Ontology, RigidTransform, Twist};

    use super::starts_us;

    /// Sequences of two frames at these times.
    fn manifest(sequences: u32, times_s: [f64; 2]) -> Manifest {
        let frame = |sequence, (index, time_s)| FrameRecord {
            sequence,
            index,
            time_s,
            key: String::new(),
            world_from_body: RigidTransform::IDENTITY.to_rows(),
            body_motion: Twist::STILL,
            balance: None,
            sensor_chunks: Vec::new(),
            point_classes: BTreeMap::new(),
            files: Vec::new(),
        };
        let frames =
            (0..sequences).flat_map(|number| (0..).zip(times_s).map(move |at| frame(number, at)));
        Manifest {
            format_version: FORMAT_VERSION,
            header: DatasetHeader::new("nemoral", "0", 0, Ontology::paper()),
            tracks: Vec::new(),
            files: Vec::new(),
            frames: frames.collect(),
        }
    }

    #[test]
    fn starts_are_whole_seconds_apart_and_fit_or_are_refused() {
        let starts = |sequences, times_s| starts_us(&manifest(sequences, times_s));
        let found = starts(3, [1.7e9 + 0.5, 1.7e9 + 2.25]).expect("they fit");
        assert_eq!(
            Vec::from_iter(found.into_values()),
            [1_000_000, 5_000_000, 9_000_000]
        );
        assert_eq!(starts(8_000, [0.0, 2.1e9]).expect("they fit").len(), 8_000);
        let refused = starts(9_000, [0.0, 2.1e9]).expect_err("too many");
        assert!(
            refused
                .to_string()
                .contains("sequence 8784 lasts 2100000000 s"),
            "{refused}"
        );
    }
}
