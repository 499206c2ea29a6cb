//! The other formats that a data set asks for in `output.formats`: folders beside its own.

use std::ffi::OsString;
use std::ops::ControlFlow;
use std::path::{self, Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::thread;

use nemoral_convert::{
    ConvertParams, Converted, Error as ConvertError, FormatName, Mode, convert_watched,
};
use nemoral_dataset::{
    Dataset, DatasetHeader, FrameDone, Manifest, MergeParams, OpenMode, Watch, merge_watched,
};

use crate::Error;
use crate::generate::Observer;

/// The folder of a format, beside the data set's: `OUT-FORMAT`.
#[must_use]
pub fn format_folder(out: &Path, format: FormatName) -> PathBuf {
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
        nemoral_convert::check_folder(out, &format_folder(out, format), mode_of(mode))?;
    }
    Ok(())
}

/// Writes the formats of a finished data set.
///
/// With [`OpenMode::Resume`], those of an earlier state of the data set are replaced. `stop` is
/// checked after each frame.
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
        let mut params = ConvertParams {
            mode: mode_of(mode),
            ..ConvertParams::new(format)
        };
        let mut done = convert_observed(out, &folder, &params, observer, stop);
        let is_other = |e: &ConvertError| matches!(e, ConvertError::Mismatch { .. });
        if mode == OpenMode::Resume && done.as_ref().is_err_and(is_other) {
            params.mode = Mode::Overwrite;
            done = convert_observed(out, &folder, &params, observer, stop);
        }
        observer.converted(format, &folder, done?);
    }
    Ok(())
}

/// Unites the shards of a data set, as [`nemoral_dataset::merge_watched`] does, and writes the
/// formats that their config asks for, which are refused before anything is written, as
/// [`generate`](crate::generate()) does. `stop` is checked after each frame of a format; `watch`
/// stops the merge itself.
///
/// # Errors
/// [`Error::Dataset`], [`Error::Convert`], and [`Error::Interrupted`] if it was asked to stop;
/// [`OpenMode::Resume`] goes on.
pub fn merge(
    shards: &[&Path],
    out: &Path,
    params: MergeParams,
    watch: &Watch,
    observer: &dyn Observer,
    stop: &AtomicBool,
) -> Result<Manifest, Error> {
    if let [first, ..] = shards {
        let first = Dataset::open(first)?;
        probe_formats(&first.manifest().header, out, params.mode)?;
    }
    let merged = merge_watched(shards, out, params, watch)?;
    write_formats(&merged.header, out, params.mode, observer, stop)?;
    Ok(merged)
}

/// The formats in a data set's config. They are the same in all of its sequences.
fn asked(header: &DatasetHeader) -> Result<Vec<FormatName>, Error> {
    let config = header.sequences.first().map(|s| &s.config);
    let names = config.and_then(|c| c.pointer("/output/formats")?.as_array());
    let name = |value: &serde_json::Value| {
        let name = value.as_str().unwrap_or_default();
        let format = name.parse().ok();
        format.ok_or_else(|| Error::request(format!("output.formats: there is no format {value}")))
    };
    names.into_iter().flatten().map(name).collect()
}

fn mode_of(mode: OpenMode) -> Mode {
    match mode {
        OpenMode::Fresh => Mode::Fresh,
        OpenMode::Resume => Mode::Resume,
        OpenMode::Overwrite => Mode::Overwrite,
    }
}

/// Converts on a thread of its own, and tells the observer on this one.
fn convert_observed(
    out: &Path,
    folder: &Path,
    params: &ConvertParams,
    observer: &dyn Observer,
    stop: &AtomicBool,
) -> Result<Converted, ConvertError> {
    let (sender, receiver) = mpsc::channel::<FrameDone>();
    let ended = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&ended);
    let watch = Watch::new(move |frame| {
        if sender.send(frame).is_err() || asked.load(Ordering::Relaxed) {
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    });
    thread::scope(|scope| {
        let converting = scope.spawn(move || convert_watched(out, folder, params, &watch));
        for frame in receiver {
            observer.converting(params.format, frame);
            ended.store(stop.load(Ordering::Relaxed), Ordering::Relaxed);
        }
        converting.join().expect("converting does not panic")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

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
