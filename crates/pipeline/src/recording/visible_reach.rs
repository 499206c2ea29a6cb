//! How far from a place things are visible.

use crate::config::Config;
use crate::plan::Hasher;

/// How far a scene reaches.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VisibleReach {
    /// Side of a chunk, metres.
    pub(crate) chunk_size_m: f64,
    /// The distance to which trees and ground are visible, metres.
    pub(crate) visible_radius_m: f64,
    /// The distance to which undergrowth is visible, metres.
    pub(crate) undergrowth_radius_m: f64,
    /// The distance to which litter is visible, metres; `None` where there is none.
    pub(crate) litter_radius_m: Option<f64>,
    /// Whether it is asked how bright things are. Lasers bring their own light: where there is no
    /// camera, nobody needs the sky view factor of far chunks, which is most of what these cost.
    pub(crate) is_lit: bool,
}

impl VisibleReach {
    /// That of the frames of a config.
    pub(crate) fn new(config: &Config) -> Self {
        let chunks = &config.chunks;
        let litter_radius_m = chunks.litter_radius_m.min(chunks.undergrowth_radius_m);
        Self {
            chunk_size_m: chunks.size_m,
            visible_radius_m: chunks.visible_radius_m,
            undergrowth_radius_m: chunks.undergrowth_radius_m,
            litter_radius_m: config.litter.is_any().then_some(litter_radius_m),
            is_lit: config.all_cameras().next().is_some(),
        }
    }

    /// The same, as far as `reach_m` only.
    pub(crate) fn within(self, reach_m: f64) -> Self {
        Self {
            visible_radius_m: self.visible_radius_m.min(reach_m),
            undergrowth_radius_m: self.undergrowth_radius_m.min(reach_m),
            litter_radius_m: self.litter_radius_m.map(|radius_m| radius_m.min(reach_m)),
            ..self
        }
    }

    pub(crate) fn fingerprint(&self, hasher: &mut Hasher) {
        let Self {
            chunk_size_m,
            visible_radius_m,
            undergrowth_radius_m,
            litter_radius_m,
            is_lit,
        } = self;
        hasher.write_f64(*chunk_size_m);
        hasher.write_f64(*visible_radius_m);
        hasher.write_f64(*undergrowth_radius_m);
        hasher.write_f64(litter_radius_m.unwrap_or(-1.0));
        hasher.write_u64(u64::from(*is_lit));
    }
}
