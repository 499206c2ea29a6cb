//! KITTI's stereo, flow and scene flow benchmark of 2015, as torchvision, RAFT and mmflow read it:
//! ```text
//! training/image_2/NNNNNN_10.png  NNNNNN_11.png      the first camera at a frame, and at the next
//! training/image_3/NNNNNN_10.png  NNNNNN_11.png      the camera called `right`
//! training/disp_occ_0/NNNNNN_10.png  disp_noc_0/     disparity at the frame
//! training/disp_occ_1/NNNNNN_10.png  disp_noc_1/     that of the same places at the next frame
//! training/flow_occ/NNNNNN_10.png  flow_noc/         flow to the next frame
//! training/calib_cam_to_cam/NNNNNN.txt
//! pairs.csv  train.txt  val.txt  test.txt            which frames these are, and their splits
//! ```
//! A number is that of a pair of frames that follow one another in a drive. Disparity is 16 bits,
//! pixels × 256, 0 = none; flow is 16 bits, pixels × 64 + 2¹⁵, with 1 in blue where there is any.
//! `occ` has all places, `noc` those that the other picture shows, too.
//!
//! Readers take the files of folders in the order of their names, so all pairs have the same files:
//! disparity if each sequence has a rectified pair of cameras, flow if each first camera has it.
//! There is no `obj_map` of objects that move, as none does. Source: Menze and Geiger (CVPR 2015)
//! and the benchmark's development kit, `readme.txt`.

mod calibration;
mod disparity;
mod rig;

use std::collections::BTreeMap;

use nemoral_dataset::{FrameRecord, Manifest, SequenceSpec, Split, TrackRecord};
use nemoral_scene::{Flow, Image};
use png::{BitDepth, ColorType};

use crate::{Error, Format, FrameRef, Sequence, Sink, Source, StepFiles, png_encoding};
use disparity::Depths;
use rig::Rig;

const FORMAT: &str = "kitti2015";
const FOLDER: &str = "training";

/// The format.
#[derive(Debug)]
pub(crate) struct Kitti2015;

/// What a data set has for the benchmark; of the other part, why not.
struct Parts {
    stereo: Result<(), String>,
    flow: Result<(), String>,
}

impl Parts {
    fn of(sequences: &[SequenceSpec]) -> Self {
        let stereo = |s: &SequenceSpec| Rig::of(s.number, &s.cameras).map(drop);
        let flow = |s: &SequenceSpec| match s.cameras.first() {
            Some(camera) if camera.annotations.flow => Ok(()),
            _ => Err(format!(
                "the first camera of sequence {:02} has no flow (camera.flow = true)",
                s.number
            )),
        };
        Self {
            stereo: sequences.iter().try_for_each(stereo),
            flow: sequences.iter().try_for_each(flow),
        }
    }
}

fn unsuitable(reason: String) -> Error {
    Error::Unsuitable {
        format: FORMAT,
        reason,
    }
}

impl Format for Kitti2015 {
    fn check(&self, manifest: &Manifest) -> Result<(), Error> {
        let sequences = &manifest.header.sequences;
        let parts = Parts::of(sequences);
        if let (Err(stereo), Err(flow)) = (&parts.stereo, &parts.flow) {
            return Err(unsuitable(format!(
                "{stereo}, and {flow}; the one is needed for disparity, the other for flow"
            )));
        }
        for sequence in sequences {
            if let Some(camera) = sequence.cameras.first() {
                rig::refuse_distorted(sequence.number, camera)?;
            }
        }
        // A data set that is still to be made has no frames yet.
        if manifest.frames.is_empty() {
            return Ok(());
        }
        let tracks = tracks(manifest);
        let place = |f: &FrameRecord| (f.sequence, f.index);
        let mut neighbours = manifest.frames.windows(2);
        if neighbours.any(|two| follows(&tracks, place(&two[0]), place(&two[1]))) {
            return Ok(());
        }
        Err(unsuitable(
            if !tracks.values().any(|track| track.is_drive()) {
                "no frame follows another one, as they are stations or single views of [balance]; \
                 make the data set as a drive, without these"
                    .to_owned()
            } else {
                "no two frames of a drive follow one another here; make the data set of more \
                 frames, or without gaps between those of --frames"
                    .to_owned()
            },
        ))
    }

    fn notes(&self, manifest: &Manifest) -> Vec<String> {
        let parts = Parts::of(&manifest.header.sequences);
        let stereo = parts
            .stereo
            .err()
            .map(|why| format!("there is no disparity: {why}"));
        let flow = parts
            .flow
            .err()
            .map(|why| format!("there is no flow: {why}"));
        stereo.into_iter().chain(flow).collect()
    }

    fn write(&self, source: &Source, sink: &mut Sink) -> Result<(), Error> {
        let parts = Parts::of(&source.manifest().header.sequences);
        let pairs = pairs(source);
        for pair in &pairs {
            sink.step(&format!("pair-{:06}", pair.number), |files| {
                pair.put(source, &parts, files)?;
                Ok(String::new())
            })?;
        }
        sink.step("lists", |files| {
            files.put("pairs.csv", table(source, &pairs));
            for split in Split::ALL {
                let mine = pairs.iter().filter(|p| p.split(source) == split);
                let list: String = mine.map(|p| format!("{:06}\n", p.number)).collect();
                files.put(format!("{split}.txt"), list);
            }
            Ok(String::new())
        })
    }
}

/// The tracks of all sequences.
fn tracks(manifest: &Manifest) -> BTreeMap<u32, &TrackRecord> {
    let tracks = manifest.tracks.iter();
    tracks.map(|track| (track.sequence, track)).collect()
}

/// Whether a body drives from the first to the second of two frames, by sequence and index.
fn follows(
    tracks: &BTreeMap<u32, &TrackRecord>,
    (sequence, first): (u32, u64),
    second: (u32, u64),
) -> bool {
    let track = tracks.get(&sequence);
    track.is_some_and(|track| track.goes_on_after(first)) && second == (sequence, first + 1)
}

/// Two frames that follow one another.
#[derive(Debug)]
struct Pair<'a> {
    number: usize,
    sequence: Sequence<'a>,
    first: FrameRef<'a>,
    next: FrameRef<'a>,
}

impl Pair<'_> {
    /// The place of a picture; `time` is 10 or 11.
    fn path(&self, folder: &str, time: u32) -> String {
        format!("{FOLDER}/{folder}/{:06}_{time}.png", self.number)
    }

    fn split(&self, source: &Source) -> Split {
        source.split(self.sequence.number)
    }

    /// Writes all files. Those of the first frame are read before any of the next one, at which it
    /// counts as done.
    fn put(&self, source: &Source, parts: &Parts, files: &mut StepFiles) -> Result<(), Error> {
        let cameras = self.sequence.cameras;
        let rig = (parts.stereo.is_ok())
            .then(|| Rig::of(self.sequence.number, cameras).map_err(unsuitable))
            .transpose()?;
        let rig = rig.as_ref();
        let first = self.put_view(source, 10, &self.first, rig, files)?;
        let has_flow = cameras[0].annotations.flow;
        let flow = has_flow.then(|| source.flow(&self.first, 0)).transpose()?;
        if let (Some(flow), true) = (&flow, parts.flow.is_ok()) {
            files.put(self.path("flow_occ", 10), encode_flow(flow, |_| true));
            files.put(self.path("flow_noc", 10), encode_flow(flow, |f| f.seen));
        }
        let next = self.put_view(source, 11, &self.next, rig, files)?;
        if let (Some(rig), Some(first), Some(next)) = (rig, &first, &next) {
            disparity::put(self, rig, [first, next], flow.as_ref(), files);
        }
        let path = format!("{FOLDER}/calib_cam_to_cam/{:06}.txt", self.number);
        files.put(path, calibration::text(&cameras[0], rig));
        Ok(())
    }

    /// The pictures of a frame, byte for byte; returns what disparity needs of it.
    fn put_view(
        &self,
        source: &Source,
        time: u32,
        frame: &FrameRef<'_>,
        rig: Option<&Rig>,
        files: &mut StepFiles,
    ) -> Result<Option<Depths>, Error> {
        let left = source.picture_bytes(frame, 0)?;
        files.put(self.path("image_2", time), left);
        let Some(rig) = rig else {
            return Ok(None);
        };
        let right = source.picture_bytes(frame, rig.right)?;
        files.put(self.path("image_3", time), right);
        Depths::of(source, frame, rig).map(Some)
    }
}

/// The pairs of all sequences, numbered from 0.
fn pairs(source: &Source) -> Vec<Pair<'_>> {
    let mut pairs = Vec::new();
    let tracks = tracks(source.manifest());
    let place = |f: &FrameRef<'_>| (f.sequence, f.index);
    for sequence in source.sequences() {
        let frames: Vec<_> = source.frames(sequence.number).collect();
        for two in frames.windows(2) {
            if !follows(&tracks, place(&two[0]), place(&two[1])) {
                continue;
            }
            pairs.push(Pair {
                number: pairs.len(),
                sequence,
                first: two[0],
                next: two[1],
            });
        }
    }
    pairs
}

/// `pairs.csv`.
fn table(source: &Source, pairs: &[Pair<'_>]) -> String {
    let mut text = "pair,sequence,frame,next_frame,split\n".to_owned();
    for pair in pairs {
        text += &format!(
            "{:06},{},{},{},{}\n",
            pair.number,
            pair.sequence.number,
            pair.first.index,
            pair.next.index,
            pair.split(source)
        );
    }
    text
}

/// The flow that is kept, as 16-bit RGB.
fn encode_flow(flow: &Image<Option<Flow>>, keep: impl Fn(&Flow) -> bool) -> Vec<u8> {
    let sample = |pixels: f32| (pixels * 64.0 + 32768.0).round() as u16;
    let samples = |flow: &Option<Flow>| match flow {
        Some(f) if keep(f) => [sample(f.offset_px.x), sample(f.offset_px.y), 1],
        _ => [0; 3],
    };
    let data: Vec<u8> = (flow.pixels().iter())
        .flat_map(|f| samples(f).into_iter().flat_map(u16::to_be_bytes))
        .collect();
    let (rgb, sixteen) = (ColorType::Rgb, BitDepth::Sixteen);
    png_encoding::encode(flow.width(), flow.height(), rgb, sixteen, None, &data)
}
