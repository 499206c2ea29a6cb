//! The files that describe a data set: `dataset.json`, and the state of an unfinished data set.

use nemoral_dataset::{Dataset, OpenMode, Writer, fuzz};

use crate::scratch::Scratch;

/// Reads a `dataset.json`. An accepted one can be written and read again.
pub fn manifest(input: &[u8]) {
    let scratch = Scratch::new();
    scratch.put("dataset.json", input);
    let Ok(dataset) = Dataset::open(scratch.path()) else {
        return;
    };
    for (i, record) in dataset.frames().iter().enumerate() {
        std::hint::black_box(record.bytes());
        let _ = dataset.read_frame(i);
    }
    let [json, ..] = fuzz::texts(dataset.manifest());
    scratch.put("dataset.json", json.as_bytes());
    let again = Dataset::open(scratch.path()).expect("what was written is read");
    assert_eq!(again.manifest(), dataset.manifest());
    assert!(again.is_untouched());
}

/// Opens an unfinished data set by its header and records, which are separated by bytes 0. Each is
/// sealed if the byte before it is even.
pub fn state(input: &[u8]) {
    let Ok(text) = std::str::from_utf8(input) else {
        return;
    };
    let scratch = Scratch::new();
    let put = |name: &str, part: &str| {
        let mut chars = part.chars();
        let is_sealed = chars.next().is_some_and(|c| u32::from(c).is_multiple_of(2));
        let content = if is_sealed {
            fuzz::seal(chars.as_str())
        } else {
            chars.as_str().to_owned()
        };
        scratch.put(&format!(".nemoral/{name}"), content.as_bytes());
    };
    let mut parts = text.split('\0');
    put("header.json", parts.next().unwrap_or_default());
    for (i, part) in parts.take(16).enumerate() {
        put(&format!("frames/00-{i:06}.json"), part);
    }
    if let Ok(Some((header, _))) = fuzz::state(scratch.path()) {
        for mode in [OpenMode::Resume, OpenMode::Overwrite] {
            let _ = Writer::probe(scratch.path(), mode, &header);
            if let Ok(writer) = Writer::create(scratch.path(), mode, header.clone()) {
                for (sequence, index) in writer.frames() {
                    std::hint::black_box(writer.has_frame(sequence, index, &[0; 32]));
                }
            }
        }
    }
}
