//! The ground with its trails carved in.

use std::fmt;
use std::sync::Arc;

use glam::DVec2;
use nemoral_scene::{ChunkCoord, Surface, SurfaceSample};
use nemoral_seed::Key;

use crate::earthwork::{Earthwork, Earthworks};
use crate::earthwork_layer::Layer;
use crate::place::TrailPlace;
use crate::value_noise::ValueNoise2d;
use crate::zone::TrailZone;
use crate::{TrailPath, TrailSurfaceKind};

/// The ground near a chunk with its trails carved in.
///
/// With t the height of the ground, d the distance to the edge of a trail, f the formation (the
/// smoothed ground along the trails' middles, limited in grade as far as that moves no more earth
/// than allowed) and p the section's height above it:
///
/// z = min(max(t, f + p − F(d)), f + p + C(d)), with rounded corners,
///
/// where F and C rise with the fill and the cut ratio, and without bounds towards the way's reach
/// (12 m by default), so that a trail's influence ends there on any ground. Where trails meet, f is
/// the mean of their formations weighted smoothly by distance, and their outlines join with rounded
/// inner corners. On a way that does not level the ground across, f follows the ground. With a
/// ditch, C starts at its far side, and p falls by its depth between.
///
/// There are no steps, as d is a minimum over all places of all trails, not that at the nearest
/// one, and p is a mean over all passages. Inside of a bend, towards the centre of its circle, the
/// nearest place leaps: there a place that is not square to the trail counts as farther away, and p
/// falls to 0.
///
/// Ways that are another earthwork carve the natural ground as if they were alone; what they change
/// is added, and fades over 2 m towards the edges of ways that are listed before them.
///
/// Every value depends only on the world position and on the trails within reach, so that grounds
/// made for neighbouring chunks agree to the bit.
pub struct TrailGround {
    base: Arc<dyn Surface>,
    layers: Vec<Layer>,
    fine_m: f64,
    ragged: Option<ValueNoise2d>,
}

impl fmt::Debug for TrailGround {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TrailGround")
            .field("layers", &self.layers.len())
            .finish_non_exhaustive()
    }
}

impl TrailGround {
    /// `paths`, sorted by id, must be all that come within reach of the square.
    pub(crate) fn new(
        earthworks: &Earthworks,
        key: Key,
        base: Arc<dyn Surface>,
        paths: &[Arc<TrailPath>],
        square: (DVec2, DVec2),
        near: &dyn Fn(ChunkCoord) -> bool,
    ) -> Self {
        let layer = |earthwork: &Earthwork| {
            let is_of = |p: &&Arc<TrailPath>| earthwork.numbers.contains(&p.way_number());
            let paths: Vec<_> = paths.iter().filter(is_of).cloned().collect();
            (!paths.is_empty()).then(|| Layer::new(earthwork, paths, square, near))
        };
        Self {
            base,
            layers: earthworks.all.iter().filter_map(layer).collect(),
            fine_m: earthworks.fine_m,
            ragged: earthworks.ragged.then(|| ValueNoise2d::new(key)),
        }
    }

    /// A place on the ground, at which the trails around are found once, whatever is asked of it.
    #[must_use]
    pub fn place(&self, world_m: DVec2) -> TrailPlace<'_> {
        TrailPlace::new(&self.layers, &*self.base, self.ragged.as_ref(), world_m)
    }

    /// See [`TrailPlace::edge_m`].
    #[must_use]
    pub fn edge_m(&self, world_m: DVec2) -> f64 {
        self.place(world_m).edge_m()
    }

    /// See [`TrailPlace::edge`].
    #[must_use]
    pub fn edge(&self, world_m: DVec2) -> (f64, DVec2) {
        self.place(world_m).edge()
    }

    /// See [`TrailPlace::zone`].
    #[must_use]
    pub fn zone(&self, world_m: DVec2) -> TrailZone {
        self.place(world_m).zone()
    }

    /// See [`TrailPlace::border_m`].
    #[must_use]
    pub fn border_m(&self, world_m: DVec2) -> f64 {
        self.place(world_m).border_m()
    }

    /// The distance from their edges within which ways have shapes as small as ruts and ditches,
    /// metres.
    #[must_use]
    pub fn fine_m(&self) -> f64 {
        self.fine_m
    }

    /// See [`TrailPlace::kind`].
    #[must_use]
    pub fn kind(&self, world_m: DVec2) -> Option<TrailSurfaceKind> {
        self.place(world_m).kind()
    }

    /// See [`TrailPlace::way_number`].
    #[must_use]
    pub fn way_number(&self, world_m: DVec2) -> Option<usize> {
        self.place(world_m).way_number()
    }

    /// See [`TrailPlace::is_in_ditch`].
    #[must_use]
    pub fn is_in_ditch(&self, world_m: DVec2, radius_m: f64) -> bool {
        self.place(world_m).is_in_ditch(radius_m)
    }

    /// See [`TrailPlace::offset_m`].
    #[must_use]
    pub fn offset_m(&self, world_m: DVec2) -> Option<f64> {
        self.place(world_m).offset_m()
    }
}

impl Surface for TrailGround {
    fn sample(&self, world_m: DVec2) -> SurfaceSample {
        self.place(world_m).sample()
    }
}
