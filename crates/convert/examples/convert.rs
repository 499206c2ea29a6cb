//! Converts a data set without the program: `convert DATASET FORMAT OUT [--resume]`.

use std::path::Path;

use nemoral_convert::{ConvertParams, OutputMode, convert};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [dataset, format, out, mode @ ..] = &arguments[..] else {
        return Err("convert DATASET FORMAT OUT [--resume]".into());
    };
    let mut params = ConvertParams::new(format.parse()?);
    if mode == ["--resume"] {
        params.mode = OutputMode::Resume;
    }
    let done = convert(Path::new(dataset), Path::new(out), &params)?;
    let (frames, files, bytes) = (done.frames, done.files, done.bytes);
    let mut text = format!("{frames} frames, {files} files, {bytes} bytes\n");
    for note in done.notes {
        text += &format!("note: {note}\n");
    }
    std::io::Write::write_all(&mut std::io::stdout(), text.as_bytes())?;
    Ok(())
}
