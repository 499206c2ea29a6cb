//! The other formats that a data set asks for in `output.formats`: folders beside its own.

use std::ffi::OsString;
use std::ops::ControlFlow;
use std::path::{self, Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::thread;

use nemoral_convert::{
    ConversionSummary, ConvertParams, Error as ConvertError, FormatName, OutputMode,
    convert_with_progress,
};
use nemoral_dataset::{
    Dataset, DatasetHeader, FrameProgress, Manifest, MergeParams, OpenMode, ProgressMonitor,
    merge_with_progress,
};

use crate::Error;
use crate::generate::Observer;

/// The folder of a format, beside the data set's: `OUT-FORMAT`.
fn format_folder(out: &Path, format: FormatName) -> PathBuf {
    // `.` has no name of its own.
    let named = match out.file_name() {
        Some(_) => out.to_owned(),
        None => path::absolute(out).unwrap_or_else(|_| out.to_owned()),
    };
    let name = named.file_name().unwrap_or("dataset".as_ref());
    let mut name: OsString = name.to_owned();
    name.push(format!("-{format}"));
    named.with_file_name(name)
}

/// Refuses a data set that is still to be made if one of its formats cannot hold it.
///
/// # Errors
/// [`Error::Convert`], and [`Error::Request`] for formats that there are not.
pub(crate) fn check_formats(header: &DatasetHeader) -> Result<(), Error> {
    for format in asked(header)? {
        nemoral_convert::check_header(header, &ConvertParams::new(format))?;
    }
    Ok(())
}

/// Refuses a data set that is still to be made into `out` if one of its formats cannot hold it, or
/// if the folder of one cannot be used.
///
/// # Errors
/// [`Error::Convert`], and [`Error::Request`] for formats that there are not.
pub(crate) fn probe_formats(
    header: &DatasetHeader,
    out: &Path,
    mode: OpenMode,
) -> Result<(), Error> {
    check_formats(header)?;
    for format in asked(header)? {
        let folder = format_folder(out, format);
        nemoral_convert::check_folder(out, &folder, header, &params(format, mode))?;
    }
    Ok(())
}

/// Writes the formats of a finished data set.
///
/// With [`OpenMode::Resume`], those of an earlier state of the data set are replaced, and no other
/// ones. `stop` is checked after each frame.
///
/// # Errors
/// [`Error::Convert`], and [`Error::Interrupted`] if it was asked to stop.
pub(crate) fn write_formats(
    header: &DatasetHeader,
    out: &Path,
    mode: OpenMode,
    observer: &dyn Observer,
    stop: &AtomicBool,
) -> Result<(), Error> {
    for format in asked(header)? {
        let folder = format_folder(out, format);
        let done = convert_observed(out, &folder, &params(format, mode), observer, stop)?;
        observer.converted(format, &folder, done);
    }
    Ok(())
}

/// Unites the shards of a data set, as [`nemoral_dataset::merge_with_progress`] does, and writes
/// the formats that their config asks for, which are refused before anything is written, as
/// [`generate`](crate::generate()) does. `stop` is checked after each frame of a format; `monitor`
/// stops the merge itself.
///
/// The config may be a stranger's, and nobody has typed the names of these folders: whatever the
/// mode, a conversion of another data set, or with other classes, is not replaced.
///
/// # Errors
/// [`Error::Dataset`], [`Error::Convert`], and [`Error::Interrupted`] if it was asked to stop;
/// [`OpenMode::Resume`] goes on.
pub fn merge(
    shards: &[&Path],
    out: &Path,
    params: MergeParams,
    monitor: &ProgressMonitor,
    observer: &dyn Observer,
    stop: &AtomicBool,
) -> Result<Manifest, Error> {
    let of_formats = match params.mode {
        OpenMode::Fresh => OpenMode::Fresh,
        OpenMode::Resume | OpenMode::Overwrite => OpenMode::Resume,
    };
    if let [first, ..] = shards {
        let first = Dataset::open(first)?;
        probe_formats(&first.manifest().header, out, of_formats)?;
    }
    let merged = merge_with_progress(shards, out, params, monitor)?;
    write_formats(&merged.header, out, of_formats, observer, stop)?;
    Ok(merged)
}

/// The formats in a data set's config. They are the same in all of its sequences.
fn asked(header: &DatasetHeader) -> Result<Vec<FormatName>, Error> {
    let config = header.sequences.first().map(|s| s.config.value());
    let names = (config.as_ref()).and_then(|c| c.pointer("/output/formats")?.as_array());
    let name = |value: &serde_json::Value| {
        let name = value.as_str().unwrap_or_default();
        let format = name.parse().ok();
        format.ok_or_else(|| Error::request(format!("output.formats: there is no format {value}")))
    };
    names.into_iter().flatten().map(name).collect()
}

/// How a format is written beside a data set that is written in this mode.
fn params(format: FormatName, mode: OpenMode) -> ConvertParams {
    ConvertParams {
        mode: match mode {
            OpenMode::Fresh => OutputMode::Fresh,
            OpenMode::Resume => OutputMode::Renew,
            OpenMode::Overwrite => OutputMode::Overwrite,
        },
        ..ConvertParams::new(format)
    }
}

/// Converts on a thread of its own, and tells the observer on this one.
fn convert_observed(
    out: &Path,
    folder: &Path,
    params: &ConvertParams,
    observer: &dyn Observer,
    stop: &AtomicBool,
) -> Result<ConversionSummary, ConvertError> {
    let (sender, receiver) = mpsc::channel::<FrameProgress>();
    let ended = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&ended);
    let monitor = ProgressMonitor::new(move |frame| {
        if sender.send(frame).is_err() || asked.load(Ordering::Relaxed) {
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    });
    thread::scope(|scope| {
        let converting = scope.spawn(move || convert_with_progress(out, folder, params, &monitor));
        for frame in receiver {
            observer.converting(params.format, frame);
            ended.store(stop.load(Ordering::Relaxed), Ordering::Relaxed);
        }
        converting.join().expect("converting does not panic")
    })
}

#[cfg(test)]
mod tests {
    use nemoral_convert::{ClassMapping, convert};
    use nemoral_dataset::{FrameData, LidarData, LidarSpec, Track, WorldTables, Writer};
    use nemoral_scene::{ChunkCoord, Ontology, RigidTransform, Twist};

    use super::*;
    use crate::generate::FrameWritten;

    struct Silent;

    impl Observer for Silent {
        fn note(&self, _: &str) {}

        fn frame(&self, _: FrameWritten) {}
    }

    /// Frames of a drive of two, by a LiDAR that sees nothing, for KITTI's readers, too.
    fn write(out: &Path, seed: u64, frames: &[u64]) {
        let pose = RigidTransform::IDENTITY;
        let mut header = DatasetHeader::new("nemoral", "0.1.0", seed, Ontology::paper());
        let sequence = &mut header.sequences[0];
        sequence.config = serde_json::json!({ "output": { "formats": ["kitti"] } }).into();
        sequence.lidars = vec![LidarSpec {
            name: "top".to_owned(),
            body_from_lidar: pose,
            deskewed: true,
            pointing_errors: false,
            ply: true,
        }];
        let writer = Writer::create(out, OpenMode::Fresh, header).expect("created");
        for &index in frames {
            let frame = FrameData {
                sequence: 0,
                index,
                time_s: index as f64,
                world_from_body: pose,
                body_motion: Twist::STILL,
                balance: None,
                cameras: vec![],
                lidars: vec![LidarData {
                    name: "top",
                    points: &[],
                    sensor_chunk: ChunkCoord::new(0, 0),
                }],
                frame_key: [index as u8; 32],
            };
            writer.write_frame(&frame).expect("written");
        }
        let track = Track {
            sequence: 0,
            poses: vec![(0.0, pose), (1.0, pose)],
            estimated: vec![],
            balance: None,
            stands: false,
            lines: vec![],
            imu: None,
        };
        let written = writer.write_sequence(&track, &WorldTables::default());
        written.expect("written");
        writer.finish().expect("finished");
    }

    #[test]
    fn merging_replaces_no_conversion_but_that_of_an_earlier_state() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        write(&at("one"), 7, &[0]);
        write(&at("two"), 7, &[1]);
        write(&at("other"), 8, &[0, 1]);
        let shards = [at("one"), at("two")];
        let merge_into = |out: &Path, mode: OpenMode| {
            let shards = shards.each_ref().map(PathBuf::as_path);
            let partial = false;
            let params = MergeParams { mode, partial };
            let never = AtomicBool::new(false);
            merge(
                &shards,
                out,
                params,
                &ProgressMonitor::default(),
                &Silent,
                &never,
            )
        };
        let kitti = |out: &Path| format_folder(out, FormatName::Kitti);
        let convert_to = |out: &Path, source: &str, ontology: Option<ClassMapping>| {
            let params = ConvertParams {
                ontology,
                ..ConvertParams::new(FormatName::Kitti)
            };
            convert(&at(source), &kitti(out), &params).expect("converted");
        };
        // The user has made conversions: with other classes, and of another data set.
        let rellis = ClassMapping::load("rellis").expect("built in");
        for (source, ontology, differs) in [
            ("one", Some(rellis), "ontology"),
            ("other", None, "data set"),
        ] {
            let out = at(&format!("all-of-{source}"));
            convert_to(&out, source, ontology);
            for (mode, said) in [
                (OpenMode::Fresh, "holds a conversion"),
                (OpenMode::Resume, differs),
                (OpenMode::Overwrite, differs),
            ] {
                let e = merge_into(&out, mode).expect_err("taken");
                assert!(matches!(e, Error::Convert(_)), "{e}");
                assert!(e.to_string().contains(said), "{mode:?}: {e}");
                assert!(!out.exists(), "nothing is merged");
            }
        }
        // One of a shard is of the same data set, before it had all its frames.
        let out = at("all");
        convert_to(&out, "one", None);
        for mode in [OpenMode::Overwrite, OpenMode::Resume, OpenMode::Overwrite] {
            merge_into(&out, mode).expect("merged");
            let second = kitti(&out).join("sequences/00/velodyne/000001.bin");
            assert!(second.exists(), "{mode:?}");
        }
    }

    #[test]
    fn folders_of_formats_lie_beside_the_data_sets() {
        let beside = |out: &str| format_folder(Path::new(out), FormatName::Coco);
        assert_eq!(beside("forest"), Path::new("forest-coco"));
        assert_eq!(beside("a/forest/"), Path::new("a/forest-coco"));
        let here = path::absolute(".").expect("there is a working folder");
        assert_eq!(beside(".").parent(), here.parent());
        assert!(beside(".").to_string_lossy().ends_with("-coco"));
        assert_eq!(
            beside("a/.."),
            path::absolute("a/../dataset-coco").expect("a path")
        );
    }
}
