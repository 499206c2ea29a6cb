//! Device memory for primitives: pages of one size, each seen whole by a shader.

use super::pipeline::GROUP_PAGE;
use super::{Gpu, GpuError};

/// A page's size: small enough for the least GPU, large enough that draws are few.
const PAGE_BYTES: u64 = 16 << 20;

/// What the camera holds on the GPU.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GpuMemory {
    /// Now, bytes.
    pub bytes: u64,
    /// At most, bytes.
    pub limit_bytes: u64,
    /// Shapes that are there.
    pub shapes: usize,
    /// Shapes that had to go for others, so far.
    pub evicted: u64,
}

/// What a page holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Triangles,
    Cards,
}

impl Kind {
    pub(crate) const ALL: [Self; 2] = [Self::Triangles, Self::Cards];

    /// Size of a primitive.
    pub(crate) fn stride(self) -> u64 {
        match self {
            Self::Triangles => 80,
            Self::Cards => 48,
        }
    }

    /// Vertices of a primitive.
    pub(crate) fn vertices(self) -> u32 {
        match self {
            Self::Triangles => 3,
            Self::Cards => 6,
        }
    }

    fn capacity(self) -> u32 {
        (PAGE_BYTES / self.stride()) as u32
    }

    /// The pages that so many primitives fill.
    pub(crate) fn bytes_of_pages(self, primitives: u64) -> u64 {
        primitives.div_ceil(u64::from(self.capacity())) * PAGE_BYTES
    }
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
    pub(crate) kind: Kind,
    buffer: wgpu::Buffer,
    pub(crate) group: wgpu::BindGroup,
    /// First and number of free primitives, in order, never touching.
    free: Vec<(u32, u32)>,
}

/// All pages; a page that was given back leaves `None`, so numbers stay.
#[derive(Debug, Default)]
pub(crate) struct Pages {
    pub(crate) pages: Vec<Option<Page>>,
}

impl Pages {
    pub(crate) fn bytes(&self) -> u64 {
        self.pages.iter().flatten().count() as u64 * PAGE_BYTES
    }

    /// Room for primitives, in as few ranges as the pages allow; `None` if they are full.
    pub(crate) fn take(&mut self, kind: Kind, count: u32) -> Option<Vec<Range>> {
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
        if page.free == [(0, page.kind.capacity())] {
            page.buffer.destroy();
            self.pages[range.page] = None;
        }
    }

    /// A page more.
    pub(crate) fn grow(&mut self, gpu: &Gpu, kind: Kind, layout: &wgpu::BindGroupLayout) {
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
            free: vec![(0, kind.capacity())],
        };
        match self.pages.iter_mut().find(|p| p.is_none()) {
            Some(empty) => *empty = Some(page),
            None => self.pages.push(Some(page)),
        }
    }

    /// How much a page more costs.
    pub(crate) const COST: u64 = PAGE_BYTES;

    /// Writes primitives, whole ones, to ranges that were taken for them.
    pub(crate) fn write(
        &self,
        gpu: &Gpu,
        kind: Kind,
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

    fn of(&self, kind: Kind) -> impl Iterator<Item = (usize, &Page)> {
        let pages = self.pages.iter().enumerate();
        pages.filter_map(move |(n, page)| Some((n, page.as_ref().filter(|p| p.kind == kind)?)))
    }
}
