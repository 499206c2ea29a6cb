//! A pool of buffers for primitives: pages of one size, each of which is bound to a shader as a
//! whole.

use super::pipeline::GROUP_PAGE;
use super::primitive::PrimitiveKind;
use super::{Gpu, GpuError};

/// The size of a page: small enough for the smallest GPU, large enough that draws are few.
const PAGE_BYTES: u64 = 16 << 20;

fn capacity(kind: PrimitiveKind) -> u32 {
    (PAGE_BYTES / kind.stride()) as u32
}

/// The bytes of the pages that this number of primitives fills.
pub(crate) fn bytes_of_pages(kind: PrimitiveKind, primitives: u64) -> u64 {
    primitives.div_ceil(u64::from(capacity(kind))) * PAGE_BYTES
}

/// Primitives side by side in a page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Range {
    pub(crate) page: usize,
    pub(crate) first: u32,
    pub(crate) count: u32,
}

#[derive(Debug)]
pub(crate) struct Page {
    pub(crate) kind: PrimitiveKind,
    buffer: wgpu::Buffer,
    pub(crate) group: wgpu::BindGroup,
    /// Free ranges (first primitive, count) in order, with gaps between them.
    free: Vec<(u32, u32)>,
}

/// All pages. A page that was freed leaves `None`, so that the numbers of the others do not change.
#[derive(Debug, Default)]
pub(crate) struct BufferPool {
    pub(crate) pages: Vec<Option<Page>>,
}

impl BufferPool {
    pub(crate) fn bytes(&self) -> u64 {
        self.pages.iter().flatten().count() as u64 * PAGE_BYTES
    }

    /// Room for primitives, in as few ranges as the pages allow; `None` if they are full.
    pub(crate) fn take(&mut self, kind: PrimitiveKind, count: u32) -> Option<Vec<Range>> {
        let room: u64 = self
            .of(kind)
            .flat_map(|(_, page)| &page.free)
            .map(|&(_, n)| u64::from(n))
            .sum();
        if room < u64::from(count) {
            return None;
        }
        let mut left = count;
        let mut ranges = Vec::new();
        for (number, page) in self.pages.iter_mut().enumerate() {
            let Some(page) = page.as_mut().filter(|p| p.kind == kind) else {
                continue;
            };
            page.free.retain_mut(|(first, n)| {
                let taken = left.min(*n);
                if taken > 0 {
                    ranges.push(Range {
                        page: number,
                        first: *first,
                        count: taken,
                    });
                    (*first, *n, left) = (*first + taken, *n - taken, left - taken);
                }
                *n > 0
            });
        }
        Some(ranges)
    }

    pub(crate) fn give_back(&mut self, range: Range) {
        let page = self.pages[range.page].as_mut().expect("a taken page");
        let at = page.free.partition_point(|&(first, _)| first < range.first);
        page.free.insert(at, (range.first, range.count));
        page.free.dedup_by(|next, before| {
            let touch = before.0 + before.1 == next.0;
            if touch {
                before.1 += next.1;
            }
            touch
        });
        if page.free == [(0, capacity(page.kind))] {
            page.buffer.destroy();
            self.pages[range.page] = None;
        }
    }

    /// Adds a page.
    pub(crate) fn grow(&mut self, gpu: &Gpu, kind: PrimitiveKind, layout: &wgpu::BindGroupLayout) {
        let buffer = gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("page"),
            size: PAGE_BYTES,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let group = gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("page"),
            layout,
            entries: &[wgpu::BindGroupEntry {
                binding: GROUP_PAGE,
                resource: buffer.as_entire_binding(),
            }],
        });
        let page = Page {
            kind,
            buffer,
            group,
            free: vec![(0, capacity(kind))],
        };
        match self.pages.iter_mut().find(|p| p.is_none()) {
            Some(empty) => *empty = Some(page),
            None => self.pages.push(Some(page)),
        }
    }

    /// The bytes of one more page.
    pub(crate) const PAGE_COST: u64 = PAGE_BYTES;

    /// Writes whole primitives to ranges that were taken for them.
    pub(crate) fn write(
        &self,
        gpu: &Gpu,
        kind: PrimitiveKind,
        ranges: &[Range],
        bytes: &[u8],
    ) -> Result<(), GpuError> {
        let stride = kind.stride();
        let mut bytes = bytes;
        for range in ranges {
            let page = self.pages[range.page].as_ref().expect("a taken page");
            let (now, later) = bytes.split_at((u64::from(range.count) * stride) as usize);
            gpu.queue()
                .write_buffer(&page.buffer, u64::from(range.first) * stride, now);
            bytes = later;
        }
        gpu.check()
    }

    fn of(&self, kind: PrimitiveKind) -> impl Iterator<Item = (usize, &Page)> {
        let pages = self.pages.iter().enumerate();
        pages.filter_map(move |(n, page)| Some((n, page.as_ref().filter(|p| p.kind == kind)?)))
    }
}
