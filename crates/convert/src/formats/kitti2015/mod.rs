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

use nemoral_dataset::{FrameRecord, Manifest, SequenceSpec, Split};
use nemoral_scene::{Flow, Image};
use png::{BitDepth, ColorType};

use crate::{Error, Files, Format, FrameRef, Sequence, Sink, Source, pictures};
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
                rig::refuse_bent(sequence.number, camera)?;
            }
        }
        // A data set that is still to be made has no frames yet.
        if !manifest.frames.is_empty()
            && !manifest.frames.windows(2).any(|two| follows(two, manifest))
        {
            return Err(unsuitable(
                "no two frames follow one another in a drive; make a data set of more frames"
                    .to_owned(),
            ));
        }
        Ok(())
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
                pair.put_pictures(source, "image_2", 0, files)?;
                if parts.stereo.is_ok() {
                    let rig = Rig::of(pair.sequence.number, pair.sequence.cameras);
                    let rig = rig.map_err(unsuitable)?;
                    pair.put_pictures(source, "image_3", rig.right, files)?;
                    disparity::put(source, pair, &rig, files)?;
                }
                if parts.flow.is_ok() {
                    let flow = source.flow(&pair.first, 0)?;
                    files.put(pair.path("flow_occ", 10), encode_flow(&flow, |_| true));
                    files.put(pair.path("flow_noc", 10), encode_flow(&flow, |f| f.seen));
                }
                let text = calibration::text(pair.sequence.cameras, parts.stereo.is_ok());
                files.put(
                    format!("{FOLDER}/calib_cam_to_cam/{:06}.txt", pair.number),
                    text,
                );
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

/// Whether the second of two frames is the next one of a drive.
fn follows(two: &[FrameRecord], manifest: &Manifest) -> bool {
    let (a, b) = (&two[0], &two[1]);
    let mut tracks = manifest.tracks.iter();
    let track = tracks.find(|track| track.sequence == a.sequence);
    let drives = track.is_some_and(|track| track.balance.is_none() && !track.stands);
    drives && a.sequence == b.sequence && b.index == a.index + 1
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

    /// A camera's pictures, byte for byte.
    fn put_pictures(
        &self,
        source: &Source,
        folder: &str,
        camera: usize,
        files: &mut Files,
    ) -> Result<(), Error> {
        for (time, frame) in [(10, &self.first), (11, &self.next)] {
            files.put(
                self.path(folder, time),
                source.picture_bytes(frame, camera)?,
            );
        }
        Ok(())
    }
}

/// The pairs of all sequences, numbered from 0.
fn pairs(source: &Source) -> Vec<Pair<'_>> {
    let mut pairs = Vec::new();
    for sequence in source.sequences() {
        if source.drive_length(sequence.number).is_none() {
            continue;
        }
        let frames: Vec<_> = source.frames(sequence.number).collect();
        for two in frames.windows(2).filter(|f| f[1].index == f[0].index + 1) {
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
    pictures::encode(flow.width(), flow.height(), rgb, sixteen, None, &data)
}
