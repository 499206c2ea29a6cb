//! What a GPU camera keeps between pictures, and what pictures under way borrow.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::DVec3;
use nemoral_scene::PlacedGroup;

use super::herd::Herd;
use super::lit::Lit;
use super::materials::Materials;
use super::pipeline::{ExactPass, Layouts};
use super::shapes::Shapes;
use super::targets::Targets;
use super::{Gpu, GpuError};
use crate::{SceneView, View};

/// All that one picture leaves to the next.
pub(crate) struct State {
    pub(crate) materials: Option<Materials>,
    pub(crate) herd: Option<Herd>,
    pub(crate) shapes: Shapes,
    /// The truth first.
    pub(crate) passes: Vec<ExactPass>,
    pub(crate) lit: Lit,
    pub(crate) targets: Option<Targets>,
    /// What the last picture borrowed, bytes: the next one will, too.
    pub(crate) transient: u64,
}

/// Device memory of a picture under way; given back when it is done.
#[derive(Debug)]
pub(crate) struct Loan {
    pub(crate) bytes: u64,
    of: Arc<AtomicU64>,
}

impl Loan {
    /// Nothing yet, of what all together have borrowed.
    pub(crate) fn new(of: &Arc<AtomicU64>) -> Self {
        Self {
            bytes: 0,
            of: Arc::clone(of),
        }
    }

    pub(crate) fn take(&mut self, bytes: u64) {
        self.bytes += bytes;
        self.of.fetch_add(bytes, Ordering::Relaxed);
    }
}

impl Drop for Loan {
    fn drop(&mut self) {
        self.of.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

impl State {
    /// All but the pages, bytes.
    pub(crate) fn fixed(&self) -> u64 {
        let targets = self.targets.as_ref().map_or(0, Targets::bytes);
        let materials = self.materials.as_ref().map_or(0, Materials::bytes);
        let herd = self.herd.as_ref().map_or(0, Herd::bytes);
        targets + materials + herd + self.lit.bytes()
    }

    pub(crate) fn hold_herd(
        &mut self,
        gpu: &Gpu,
        groups: &[PlacedGroup],
        origin_m: DVec3,
    ) -> Result<(), GpuError> {
        if !self
            .herd
            .as_ref()
            .is_some_and(|h| h.is_of(groups, origin_m))
        {
            // The old one first: both need not fit.
            self.herd = None;
            self.herd = Some(Herd::gather(gpu, groups, origin_m)?);
            gpu.check()?;
        }
        Ok(())
    }

    pub(crate) fn hold_materials(
        &mut self,
        gpu: &Gpu,
        scene: &SceneView<'_>,
    ) -> Result<(), GpuError> {
        let library = scene.materials;
        if !self.materials.as_ref().is_some_and(|m| m.are(library)) {
            self.materials = Some(Materials::upload(gpu, library)?);
            for pass in &mut self.passes {
                pass.table = None;
            }
        }
        for pass in self.passes.iter_mut().filter(|p| p.table.is_none()) {
            pass.tabulate(gpu, library)?;
        }
        Ok(())
    }

    /// Makes what bent pictures are drawn with.
    pub(crate) fn bend(&mut self, gpu: &Gpu, layouts: &Layouts) -> Result<(), GpuError> {
        for pass in &mut self.passes {
            pass.bend(gpu, layouts)?;
        }
        self.lit.bend(gpu, layouts)
    }

    pub(crate) fn hold_targets(&mut self, gpu: &Gpu, view: &View) -> Result<(), GpuError> {
        let size = [view.intrinsics.width, view.intrinsics.height];
        if self.targets.as_ref().is_none_or(|t| t.size != size) {
            gpu.check_size(size)?;
            // The old ones first: both need not fit.
            self.targets = None;
            self.targets = Some(Targets::new(gpu, size)?);
            gpu.check()?;
        }
        Ok(())
    }
}
