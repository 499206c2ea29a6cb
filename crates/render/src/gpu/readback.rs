//! Copies images from the GPU's memory to the processor's.

use std::sync::mpsc;

use super::{Gpu, GpuError};

/// An image that is being read back.
#[derive(Debug)]
pub(crate) struct Readback {
    buffer: wgpu::Buffer,
    /// Bytes of a row, and of a row with its padding.
    row: usize,
    padded: usize,
    rows: usize,
}

impl Readback {
    /// Encodes the copy of a texture with `pixel` bytes per pixel.
    pub(crate) fn encode(
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        texture: &wgpu::Texture,
        pixel: usize,
    ) -> Self {
        let row = texture.width() as usize * pixel;
        let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT as usize);
        let rows = texture.height() as usize;
        let buffer = gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("read-back"),
            size: (padded * rows) as u64,
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(padded as u32),
                    rows_per_image: None,
                },
            },
            texture.size(),
        );
        Self {
            buffer,
            row,
            padded,
            rows,
        }
    }

    pub(crate) fn bytes(&self) -> u64 {
        self.buffer.size()
    }

    /// Waits for the submission that copies, and hands out the rows.
    pub(crate) fn read<T>(
        &self,
        gpu: &Gpu,
        submission: &wgpu::SubmissionIndex,
        take: impl FnOnce(&mut dyn Iterator<Item = &[u8]>) -> T,
    ) -> Result<T, GpuError> {
        let (sender, receiver) = mpsc::channel();
        self.buffer
            .map_async(wgpu::MapMode::Read, .., move |result| {
                // If waiting failed, there is no receiver any more.
                let _ = sender.send(result);
            });
        gpu.wait(submission.clone())?;
        let refused = |reason: String| GpuError::Refused { reason };
        // The copy is done, but another thread that polls the same device may be just about to
        // report it.
        match receiver.recv() {
            Ok(Ok(())) => {}
            Ok(Err(e)) => return Err(refused(e.to_string())),
            Err(_) => return Err(refused("the picture did not come back".to_owned())),
        }
        let mapped = self
            .buffer
            .get_mapped_range(..)
            .map_err(|e| refused(e.to_string()))?;
        let mut rows = (0..self.rows).map(|y| &mapped[y * self.padded..][..self.row]);
        Ok(take(&mut rows))
    }
}
