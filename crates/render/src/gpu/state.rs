//! The state of a GPU camera between pictures.

use glam::DVec3;
use nemoral_scene::PlacedGroup;

use super::instance_buffer::InstanceBuffer;
use super::lighting::LightingPass;
use super::materials::Materials;
use super::pipeline::{ExactPass, Layouts};
use super::shapes::Shapes;
use super::targets::Targets;
use super::{Gpu, GpuError};
use crate::{SceneView, View};

/// All resources that pictures share.
pub(crate) struct State {
    pub(crate) materials: Option<Materials>,
    pub(crate) instances: Option<InstanceBuffer>,
    pub(crate) shapes: Shapes,
    /// All exact passes, of which the truth is the first.
    pub(crate) passes: Vec<ExactPass>,
    pub(crate) lighting: LightingPass,
    pub(crate) targets: Option<Targets>,
    /// Bytes that the last picture reserved, as an estimate for the next one.
    pub(crate) transient: u64,
}

impl State {
    /// Bytes of all resources but the pool of primitives.
    pub(crate) fn fixed(&self) -> u64 {
        let targets = self.targets.as_ref().map_or(0, Targets::bytes);
        let materials = self.materials.as_ref().map_or(0, Materials::bytes);
        let instances = self.instances.as_ref().map_or(0, InstanceBuffer::bytes);
        targets + materials + instances + self.lighting.bytes()
    }

    pub(crate) fn hold_instances(
        &mut self,
        gpu: &Gpu,
        groups: &[PlacedGroup],
        origin_m: DVec3,
    ) -> Result<(), GpuError> {
        if !self
            .instances
            .as_ref()
            .is_some_and(|held| held.holds(groups, origin_m))
        {
            // The old buffer is dropped first, so that both need not fit.
            self.instances = None;
            self.instances = Some(InstanceBuffer::upload(gpu, groups, origin_m)?);
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

    /// Makes the pipelines that distorted pictures are drawn with.
    pub(crate) fn prepare_distorted(
        &mut self,
        gpu: &Gpu,
        layouts: &Layouts,
    ) -> Result<(), GpuError> {
        for pass in &mut self.passes {
            pass.prepare_distorted(gpu, layouts)?;
        }
        self.lighting.prepare_distorted(gpu, layouts)
    }

    pub(crate) fn hold_targets(&mut self, gpu: &Gpu, view: &View) -> Result<(), GpuError> {
        let size = [view.intrinsics.width, view.intrinsics.height];
        if self.targets.as_ref().is_none_or(|t| t.size != size) {
            gpu.check_size(size)?;
            // The old targets are dropped first, so that both need not fit.
            self.targets = None;
            self.targets = Some(Targets::new(gpu, size)?);
            gpu.check()?;
        }
        Ok(())
    }
}
