//! The single files that a camera writes for a frame.

use crate::formats::{annotations, exr, images, npy};
use nemoral_scene::{Intrinsics, Ontology};

use crate::{CameraData, DepthFormat, SequenceSpec, limits};

/// One of the files that a camera writes for a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CameraFile {
    /// The picture.
    Rgb,
    /// Classes.
    Semantic,
    /// Instances.
    Instance,
    /// Planar depth.
    Depth,
    /// Normals.
    Normals,
    /// The mask of the sky, which follows from depth.
    Sky,
    /// Optical flow.
    Flow,
    /// The nearest trunks, also where leaves hide them.
    Trunks,
    /// Boxes, in the image and in space.
    Boxes,
    /// Radiance.
    Radiance,
}

impl CameraFile {
    /// All of them; those that are written only on request come last.
    pub const ALL: [Self; 10] = [
        Self::Rgb,
        Self::Semantic,
        Self::Instance,
        Self::Depth,
        Self::Normals,
        Self::Sky,
        Self::Flow,
        Self::Trunks,
        Self::Boxes,
        Self::Radiance,
    ];

    /// Whether a sequence asks for it from its `camera`-th camera.
    pub(crate) fn is_asked(self, sequence: &SequenceSpec, camera: usize) -> bool {
        let extra = sequence.cameras[camera].annotations;
        match self {
            Self::Rgb | Self::Semantic | Self::Instance | Self::Depth | Self::Normals => true,
            Self::Sky => extra.sky,
            Self::Flow => extra.flow,
            Self::Trunks => extra.trunks,
            Self::Boxes => extra.boxes,
            Self::Radiance => extra.radiance,
        }
    }

    /// Its bytes, as [`Writer`](crate::Writer) writes them, for the `camera`-th camera of a
    /// sequence; `None` if the sequence does not ask for it or `data` does not contain it.
    ///
    /// # Panics
    /// If the sequence has fewer cameras.
    #[must_use]
    pub fn encode(
        self,
        sequence: &SequenceSpec,
        ontology: &Ontology,
        camera: usize,
        data: &CameraData<'_>,
    ) -> Option<Vec<u8>> {
        if !self.is_asked(sequence, camera) {
            return None;
        }
        let (truth, further) = (data.truth, data.annotations);
        Some(match self {
            Self::Rgb => images::encode_rgb(data.rgb, Some(&sequence.cameras[camera].intrinsics)),
            Self::Semantic => images::encode_semantic(&truth.semantic, ontology),
            Self::Instance => images::encode_instance(&truth.object),
            Self::Depth => match sequence.depth_format {
                DepthFormat::Png16 => images::encode_depth(&truth.depth_m),
                DepthFormat::Npy => npy::encode(&truth.depth_m),
            },
            Self::Normals => images::encode_normals(&truth.normal),
            Self::Sky => images::encode_mask(&annotations::sky_mask(&truth.depth_m)),
            Self::Flow => images::encode_flow(further.flow.as_ref()?),
            Self::Trunks => images::encode_instance(further.trunks.as_ref()?),
            Self::Boxes => annotations::encode_boxes(further.boxes.as_ref()?).into_bytes(),
            Self::Radiance => exr::encode(data.radiance?),
        })
    }

    /// The most bytes that it may have for a camera of this size.
    pub(crate) fn max_bytes(self, sequence: &SequenceSpec, size: &Intrinsics) -> u64 {
        let bytes_per_pixel = match self {
            Self::Boxes => return limits::BOXES_BYTES,
            Self::Semantic | Self::Sky => 1,
            Self::Rgb | Self::Instance | Self::Normals | Self::Trunks => 3,
            Self::Depth => match sequence.depth_format {
                DepthFormat::Png16 => 2,
                DepthFormat::Npy => 4,
            },
            Self::Flow => 6,
            Self::Radiance => 12,
        };
        limits::image_bytes(size, bytes_per_pixel)
    }

    /// Its folder, below that of its camera.
    pub(crate) fn folder(self) -> &'static str {
        match self {
            Self::Rgb => "image_2",
            Self::Semantic => "semantic",
            Self::Instance => "instance",
            Self::Depth => "depth",
            Self::Normals => "normals",
            Self::Sky => "sky",
            Self::Flow => "flow",
            Self::Trunks => "trunks",
            Self::Boxes => "boxes",
            Self::Radiance => "radiance",
        }
    }

    pub(crate) fn extension(self, sequence: &SequenceSpec) -> &'static str {
        match self {
            Self::Depth => match sequence.depth_format {
                DepthFormat::Png16 => "png",
                DepthFormat::Npy => "npy",
            },
            Self::Boxes => "csv",
            Self::Radiance => "exr",
            _ => "png",
        }
    }
}
