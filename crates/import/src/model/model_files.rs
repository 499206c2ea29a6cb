//! A model's file with those beside it, and all of them as one archive.

use std::collections::BTreeMap;

use crate::ImportError;
use crate::error::shown;

/// The most bytes of a model's files together.
pub const MAX_MODEL_BYTES: u64 = 256 << 20;
/// The most files of a model.
pub(super) const MAX_FILES: usize = 512;

/// A model's file and the files beside it that belong to it: buffers, pictures, materials, and the
/// [sidecar](super::ModelSidecar).
///
/// They are packed into one tar archive ([`Self::to_tar`]), so that a model is one file wherever
/// it goes.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelFiles {
    pub(super) name: String,
    pub(super) bytes: Vec<u8>,
    pub(super) beside: BTreeMap<String, Vec<u8>>,
}

impl ModelFiles {
    /// A model of a single file.
    #[must_use]
    pub fn single(name: &str, bytes: Vec<u8>) -> Self {
        Self {
            name: name.to_owned(),
            bytes,
            beside: BTreeMap::new(),
        }
    }

    /// Whether some bytes are an archive, beside which nothing is looked for.
    #[must_use]
    pub fn is_archive(bytes: &[u8]) -> bool {
        is_tar(bytes)
    }

    /// The name of the model's own file.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    pub(super) fn is_obj(&self) -> bool {
        !is_gltf(&self.bytes)
    }

    pub(super) fn sidecar(&self) -> Option<&[u8]> {
        let name = format!("{}.toml", self.name);
        self.beside.get(&name).map(Vec::as_slice)
    }

    /// A file beside the model.
    pub(super) fn get(&self, name: &str) -> Result<&[u8], ImportError> {
        let found = self.beside.get(name).map(Vec::as_slice);
        found.ok_or_else(|| {
            let name = shown(name);
            ImportError::file(format!("names the file {name}, which is not beside it"))
        })
    }

    /// All files as one tar archive, the model's own first. Equal files give equal bytes.
    ///
    /// # Errors
    /// If a name is longer than the 100 bytes that an archive has room for, or there are more than
    /// [`MAX_MODEL_BYTES`].
    pub fn to_tar(&self) -> Result<Vec<u8>, ImportError> {
        let mut archive = Vec::new();
        let own = std::iter::once((&self.name, &self.bytes));
        for (name, bytes) in own.chain(&self.beside) {
            archive.extend(header(name, bytes.len())?);
            archive.extend(bytes);
            archive.resize(archive.len().next_multiple_of(BLOCK), 0);
        }
        archive.resize(archive.len() + END as usize, 0);
        if archive.len() as u64 > MAX_MODEL_BYTES {
            return Err(too_large());
        }
        Ok(archive)
    }

    /// The files of an archive.
    pub(super) fn from_tar(archive: &[u8]) -> Result<Self, ImportError> {
        let wrong = || ImportError::file("is no archive of a model: it is damaged");
        let mut rest = archive;
        let mut own: Option<(String, Vec<u8>)> = None;
        let mut beside = BTreeMap::new();
        while let Some((header, after)) = rest.split_at_checked(BLOCK) {
            if header.iter().all(|&b| b == 0) {
                break;
            }
            let octal = |field: &[u8]| {
                let text = std::str::from_utf8(field).ok()?;
                u64::from_str_radix(text.trim_matches(['\0', ' ']), 8).ok()
            };
            let sum = octal(&header[148..156]).ok_or_else(wrong)?;
            let size = octal(&header[124..136]).ok_or_else(wrong)?;
            if !is_tar(header) || sum != u64::from(checksum(header)) {
                return Err(wrong());
            }
            let size = usize::try_from(size).map_err(|_| wrong())?;
            let (bytes, after) = after.split_at_checked(size).ok_or_else(wrong)?;
            let padding = (BLOCK - size % BLOCK) % BLOCK;
            rest = after.get(padding..).ok_or_else(wrong)?;
            let is_file = matches!(header[156], b'0' | 0);
            if !is_file {
                continue;
            }
            let name = header[..NAME].split(|&b| b == 0).next();
            let name = std::str::from_utf8(name.unwrap_or_default()).map_err(|_| wrong())?;
            if beside.len() == MAX_FILES {
                let reason = format!("has more than {MAX_FILES} files");
                return Err(ImportError::file(reason));
            }
            if own.is_none() {
                own = Some((name.to_owned(), bytes.to_vec()));
            } else {
                beside.insert(name.to_owned(), bytes.to_vec());
            }
        }
        let (name, bytes) = own.ok_or_else(wrong)?;
        Ok(Self {
            name,
            bytes,
            beside,
        })
    }
}

/// The first bytes of a GLB file.
pub(super) const GLB_MAGIC: &[u8] = b"glTF";

/// Whether a file is glTF, and not OBJ.
fn is_gltf(bytes: &[u8]) -> bool {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    bytes.starts_with(GLB_MAGIC) || text.trim_ascii_start().starts_with(b"{")
}

pub(super) fn too_large() -> ImportError {
    ImportError::file(format!(
        "has more than {} MiB with the files that it names",
        MAX_MODEL_BYTES >> 20
    ))
}

/// The blocks of an archive.
const BLOCK: usize = 512;
/// Two empty blocks end an archive.
pub(super) const END: u64 = 2 * BLOCK as u64;
/// The most bytes of a name.
const NAME: usize = 100;

/// The bytes that a file of so many takes in an archive.
pub(super) fn archived(bytes: usize) -> u64 {
    (BLOCK + bytes.next_multiple_of(BLOCK)) as u64
}

pub(super) fn is_tar(bytes: &[u8]) -> bool {
    bytes.get(257..262) == Some(b"ustar")
}

/// The sum of a header's bytes, with spaces for that of the sum itself.
fn checksum(header: &[u8]) -> u32 {
    let sum = |bytes: &[u8]| bytes.iter().map(|&b| u32::from(b)).sum::<u32>();
    sum(&header[..148]) + 8 * u32::from(b' ') + sum(&header[156..])
}

fn header(name: &str, bytes: usize) -> Result<[u8; BLOCK], ImportError> {
    if name.is_empty() || name.len() > NAME {
        return Err(ImportError::file(format!(
            "the name of the file {} has {} bytes: 1 to {NAME} are allowed",
            shown(name),
            name.len()
        )));
    }
    let mut header = [0; BLOCK];
    let mut put = |at: usize, text: &str| {
        header[at..at + text.len()].copy_from_slice(text.as_bytes());
    };
    put(0, name);
    put(100, "0000644\0");
    put(108, "0000000\0");
    put(116, "0000000\0");
    put(124, &format!("{bytes:011o}\0"));
    put(136, "00000000000\0");
    put(156, "0");
    put(257, "ustar\x0000");
    let sum = format!("{:06o}\0 ", checksum(&header));
    header[148..156].copy_from_slice(sum.as_bytes());
    Ok(header)
}
