//! The materials of MTL files, as far as they are read.

use crate::ImportError;
use crate::error::shown;

use super::MAX_MATERIALS;

/// The most bytes of a file of materials.
const MAX_BYTES: usize = 1 << 20;

/// A material. Paths of pictures are as the file has them.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Mtl {
    pub(super) name: String,
    /// `Kd`; linear.
    pub(super) diffuse: Option<[f32; 3]>,
    /// `d`, or one less `Tr`: 1 is opaque.
    pub(super) opacity: Option<f32>,
    /// `map_Kd`.
    pub(super) picture: Option<String>,
    /// `map_d`.
    pub(super) holes: Option<String>,
}

/// The first word of a line, and what follows it.
pub(super) fn split(line: &str) -> (&str, &str) {
    let line = line.trim();
    line.split_once(char::is_whitespace)
        .map_or((line, ""), |(word, rest)| (word, rest.trim_start()))
}

/// Reads a file of materials of this name.
pub(super) fn read(bytes: &[u8], name: &str) -> Result<Vec<Mtl>, ImportError> {
    let wrong = |why: &str| ImportError::file(format!("materials {}: {why}", shown(name)));
    if bytes.len() > MAX_BYTES {
        return Err(wrong("at most 1 MiB of them is read"));
    }
    let text = String::from_utf8_lossy(bytes);
    let mut materials: Vec<Mtl> = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let (word, rest) = split(line);
        if word == "newmtl" {
            if materials.len() == MAX_MATERIALS {
                return Err(wrong(&format!("at most {MAX_MATERIALS} are read")));
            }
            materials.push(Mtl {
                name: rest.to_owned(),
                ..Mtl::default()
            });
        }
        // What comes before the first material belongs to none.
        let Some(material) = materials.last_mut() else {
            continue;
        };
        let mut is_read = true;
        let mut set = |to: &mut Option<f32>, value: Option<f32>| {
            is_read = value.is_some();
            *to = value;
        };
        match word {
            "d" => {
                let rest = rest.strip_prefix("-halo").unwrap_or(rest);
                set(&mut material.opacity, number(rest));
            }
            "Tr" => set(&mut material.opacity, number(rest).map(|t| 1.0 - t)),
            "Kd" => match colour(rest) {
                Some(colour) => material.diffuse = colour,
                None => is_read = false,
            },
            "map_Kd" => material.picture = path(rest),
            "map_d" => material.holes = path(rest),
            _ => {}
        }
        if !is_read {
            let line = format!("line {}: {word} {}: must be numbers", i + 1, shown(rest));
            return Err(wrong(&line));
        }
    }
    Ok(materials)
}

fn number(text: &str) -> Option<f32> {
    text.split_whitespace().next()?.parse().ok()
}

/// Red, green and blue, or one number for all; `Some(None)` for a spectrum, which is left out.
fn colour(text: &str) -> Option<Option<[f32; 3]>> {
    let mut words = text.split_whitespace().peekable();
    if words.peek().is_some_and(|&w| w == "spectral" || w == "xyz") {
        return Some(None);
    }
    let numbers: Vec<f32> = words
        .take(3)
        .map(|word| word.parse().ok())
        .collect::<Option<_>>()?;
    match numbers[..] {
        [grey] => Some(Some([grey; 3])),
        [red, green, blue] => Some(Some([red, green, blue])),
        _ => None,
    }
}

/// The path after a map's options; `None` if there is none.
fn path(text: &str) -> Option<String> {
    let mut rest = text.trim();
    while rest.starts_with('-') {
        let (option, after) = split(rest);
        rest = after;
        if matches!(option, "-imfchan" | "-type" | "-texres") {
            rest = split(rest).1;
            continue;
        }
        loop {
            let (word, after) = split(rest);
            if word.parse::<f32>().is_err() && !matches!(word, "on" | "off") {
                break;
            }
            rest = after;
        }
    }
    (!rest.is_empty()).then(|| rest.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn materials_are_read_and_others_named() {
        let text = "Kd 1 1 1\nnewmtl bark of oak\nKd 0.5\nKs 1\nKe 0 0\nnewmtl leaf\n\
                    Kd 0.1 0.2 0.3\nTr 0.25\nmap_Kd -s 1 1 1 -clamp on my leaf.png\n\
                    map_d -imfchan m holes.png\nnewmtl plain\nKd spectral x.rfl 1\nd -halo 0.4";
        let materials = read(text.as_bytes(), "a.mtl").expect("fine");
        let names: Vec<&str> = materials.iter().map(|m| m.name.as_str()).collect();
        assert_eq!(names, ["bark of oak", "leaf", "plain"]);
        assert_eq!(materials[0].diffuse, Some([0.5; 3]));
        let leaf = &materials[1];
        assert_eq!(
            (leaf.diffuse, leaf.opacity),
            (Some([0.1, 0.2, 0.3]), Some(0.75))
        );
        assert_eq!(leaf.picture.as_deref(), Some("my leaf.png"));
        assert_eq!(leaf.holes.as_deref(), Some("holes.png"));
        assert_eq!(
            (materials[2].diffuse, materials[2].opacity),
            (None, Some(0.4))
        );
        for bad in ["Kd 0.1 0.2", "Kd red", "d", "Tr x"] {
            let text = format!("newmtl a\n\n{bad}");
            let message = read(text.as_bytes(), "a.mtl").expect_err(bad).to_string();
            assert!(message.contains("a.mtl: line 3: "), "{message}");
        }
    }
}
