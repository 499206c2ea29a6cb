//! Converts a data set without the program: `convert DATASET FORMAT OUT`.

use std::path::Path;

use nemoral_convert::{ConvertParams, convert};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [dataset, format, out] = &arguments[..] else {
        return Err("convert DATASET FORMAT OUT".into());
    };
    let params = ConvertParams::new(format.parse()?);
    let done = convert(Path::new(dataset), Path::new(out), &params)?;
    let (frames, files, bytes) = (done.frames, done.files, done.bytes);
    let text = format!("{frames} frames, {files} files, {bytes} bytes\n");
    std::io::Write::write_all(&mut std::io::stdout(), text.as_bytes())?;
    Ok(())
}
