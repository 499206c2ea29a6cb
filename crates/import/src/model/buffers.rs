//! The numbers in glTF's buffers. Every range is checked before it is read.

use std::borrow::Cow;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::MAX_TRIANGLES;
use super::json::{Accessor, Document};
use super::model_files::ModelFiles;
use crate::ImportError;
use crate::error::shown;

/// The buffers of a document.
pub(super) struct Buffers<'a> {
    document: &'a Document,
    buffers: Vec<Cow<'a, [u8]>>,
}

impl<'a> Buffers<'a> {
    /// Finds all buffers: in the file, beside it, or in their own URIs.
    pub(super) fn new(
        document: &'a Document,
        binary: Option<&'a [u8]>,
        files: &'a ModelFiles,
    ) -> Result<Self, ImportError> {
        let buffers = document.buffers.iter().enumerate();
        let buffers = buffers.map(|(i, buffer)| match (&buffer.uri, binary) {
            (Some(uri), _) => content(uri, files),
            (None, Some(binary)) if i == 0 => Ok(Cow::Borrowed(binary)),
            (None, _) => Err(ImportError::file(format!("buffers[{i}] is nowhere"))),
        });
        Ok(Self {
            document,
            buffers: buffers.collect::<Result<_, _>>()?,
        })
    }

    /// The bytes of a buffer view.
    pub(super) fn view(&self, view: u32) -> Result<(&[u8], Option<u64>), ImportError> {
        let outside = || ImportError::file(format!("bufferViews[{view}] is outside of its buffer"));
        let of = item(&self.document.buffer_views, view, "bufferViews")?;
        let buffer = item(&self.buffers, of.buffer, "buffers")?;
        let range = range(of.byte_offset, of.byte_length).ok_or_else(outside)?;
        let bytes = buffer.get(range).ok_or_else(outside)?;
        Ok((bytes, of.byte_stride))
    }

    /// Vectors of `N` real numbers: floats, or integers, which stand for 0..1 or -1..1 if the
    /// accessor says so.
    pub(super) fn vectors<const N: usize>(
        &self,
        accessor: u32,
        kind: &str,
    ) -> Result<Vec<[f32; N]>, ImportError> {
        let of = self.accessor(accessor, kind)?;
        let component = Component::of(of, accessor)?;
        let read = |element: &[u8]| {
            let size = component.size();
            let at = |i: usize| component.real(&element[i * size..], of.normalized);
            std::array::from_fn(at)
        };
        let elements = self.elements(of, accessor, N * component.size())?;
        Ok(elements.into_iter().map(read).collect())
    }

    /// Indices of vertices.
    pub(super) fn indices(&self, accessor: u32) -> Result<Vec<u32>, ImportError> {
        let of = self.accessor(accessor, "SCALAR")?;
        let component = Component::of(of, accessor)?;
        if !matches!(component, Component::U8 | Component::U16 | Component::U32) {
            let reason = format!("accessors[{accessor}]: indices are unsigned integers");
            return Err(ImportError::file(reason));
        }
        let elements = self.elements(of, accessor, component.size())?;
        Ok(elements.into_iter().map(|e| component.whole(e)).collect())
    }

    /// How many elements an accessor has.
    pub(super) fn count(&self, accessor: u32) -> Result<usize, ImportError> {
        let of = item(&self.document.accessors, accessor, "accessors")?;
        let count = usize::try_from(of.count).ok();
        count.filter(|&n| n <= 3 * MAX_TRIANGLES).ok_or_else(|| {
            ImportError::file(format!(
                "accessors[{accessor}] has {} elements: at most {} are read",
                of.count,
                3 * MAX_TRIANGLES
            ))
        })
    }

    fn accessor(&self, accessor: u32, kind: &str) -> Result<&Accessor, ImportError> {
        let of = item(&self.document.accessors, accessor, "accessors")?;
        if of.kind != kind {
            return Err(ImportError::file(format!(
                "accessors[{accessor}] is of type {}, and must be {kind}",
                shown(&of.kind)
            )));
        }
        if of.sparse.is_some() {
            let reason = format!("accessors[{accessor}] is sparse, which is not read");
            return Err(ImportError::file(reason));
        }
        Ok(of)
    }

    fn elements(
        &self,
        of: &Accessor,
        accessor: u32,
        size: usize,
    ) -> Result<Vec<&[u8]>, ImportError> {
        let outside = || {
            let reason = format!("accessors[{accessor}] is outside of its buffer view");
            ImportError::file(reason)
        };
        let count = self.count(accessor)?;
        let view = of.buffer_view.ok_or_else(outside)?;
        let (bytes, stride) = self.view(view)?;
        let stride = usize::try_from(stride.unwrap_or(size as u64)).map_err(|_| outside())?;
        if stride < size {
            let reason = format!("bufferViews[{view}]: byteStride = {stride} is below {size}");
            return Err(ImportError::file(reason));
        }
        let first = usize::try_from(of.byte_offset).map_err(|_| outside())?;
        let element = |i: usize| {
            let start = i.checked_mul(stride)?.checked_add(first)?;
            bytes.get(start..start.checked_add(size)?)
        };
        // The last one first, so that nothing is allocated for what is not there.
        if count > 0 && element(count - 1).is_none() {
            return Err(outside());
        }
        (0..count).map(|i| element(i).ok_or_else(outside)).collect()
    }
}

#[derive(Clone, Copy)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(accessor: &Accessor, number: u32) -> Result<Self, ImportError> {
        Ok(match accessor.component_type {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            other => {
                return Err(ImportError::file(format!(
                    "accessors[{number}]: componentType = {other} is none of glTF"
                )));
            }
        })
    }

    const fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The number at the start of some bytes, of which there are enough.
    fn real(self, bytes: &[u8], normalized: bool) -> f32 {
        let share = |of: f32, most: f32| {
            if normalized {
                (of / most).max(-1.0)
            } else {
                of
            }
        };
        match self {
            Self::I8 => share(f32::from(bytes[0] as i8), 127.0),
            Self::U8 => share(f32::from(bytes[0]), 255.0),
            Self::I16 => share(
                f32::from(i16::from_le_bytes([bytes[0], bytes[1]])),
                32_767.0,
            ),
            Self::U16 => share(
                f32::from(u16::from_le_bytes([bytes[0], bytes[1]])),
                65_535.0,
            ),
            Self::U32 => self.whole(bytes) as f32,
            Self::F32 => f32::from_bits(Self::U32.whole(bytes)),
        }
    }

    fn whole(self, bytes: &[u8]) -> u32 {
        match self {
            Self::I8 | Self::U8 => u32::from(bytes[0]),
            Self::I16 | Self::U16 => u32::from(u16::from_le_bytes([bytes[0], bytes[1]])),
            Self::U32 | Self::F32 => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
        }
    }
}

fn range(offset: u64, length: u64) -> Option<std::ops::Range<usize>> {
    let end = usize::try_from(offset.checked_add(length)?).ok()?;
    Some(usize::try_from(offset).ok()?..end)
}

/// An item of a list by its number in the file.
pub(super) fn item<'a, T>(list: &'a [T], number: u32, what: &str) -> Result<&'a T, ImportError> {
    list.get(number as usize).ok_or_else(|| {
        let count = list.len();
        ImportError::file(format!(
            "{what}[{number}] does not exist: there are {count}"
        ))
    })
}

/// What a URI stands for: its own data, or a file beside the model.
pub(super) fn content<'a>(uri: &str, files: &'a ModelFiles) -> Result<Cow<'a, [u8]>, ImportError> {
    let Some(data) = uri.strip_prefix("data:") else {
        return Ok(Cow::Borrowed(files.get(&decoded(uri)?)?));
    };
    let coded = data.split_once(";base64,").map(|(_, coded)| coded);
    let bytes = coded.and_then(|coded| STANDARD.decode(coded).ok());
    let bytes = bytes.ok_or_else(|| ImportError::file("has a data URI that is not base64"))?;
    Ok(Cow::Owned(bytes))
}

/// The path that a relative URI stands for.
pub(super) fn decoded(uri: &str) -> Result<String, ImportError> {
    let wrong = || {
        let uri = shown(uri);
        ImportError::file(format!("names {uri}, which is no relative path of a file"))
    };
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.bytes();
    while let Some(byte) = rest.next() {
        let mut digit = || char::from(rest.next()?).to_digit(16);
        bytes.push(match byte {
            b'%' => {
                let (high, low) = (digit().ok_or_else(wrong)?, digit().ok_or_else(wrong)?);
                (16 * high + low) as u8
            }
            byte => byte,
        });
    }
    let path = String::from_utf8(bytes).map_err(|_| wrong())?;
    let path = path.strip_prefix("./").unwrap_or(&path).to_owned();
    if path.is_empty() || path.contains("://") {
        return Err(wrong());
    }
    Ok(path)
}
