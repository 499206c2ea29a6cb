//! The kinds of the objects that instance maps show: trees, logs, rocks and others.

use std::collections::BTreeMap;

use nemoral_scene::ObjectKind;
use nemoral_scene::glam::DVec2;

use crate::{Error, FrameRef, Source};

/// The places and kinds of a sequence's objects, by their ids in instance maps.
///
/// These ids come again every 16 chunks, so that several objects of a long drive have one.
pub(super) struct ObjectKinds(BTreeMap<u32, Vec<(DVec2, usize)>>);

impl ObjectKinds {
    pub(super) fn of(source: &Source, sequence: u32) -> Result<Self, Error> {
        let mut kinds: BTreeMap<u32, Vec<(DVec2, usize)>> = BTreeMap::new();
        for object in source.objects(sequence)? {
            let kind = ObjectKind::ALL.iter().position(|k| *k == object.kind);
            if let Some(kind) = kind {
                let of_id = kinds.entry(object.object.to_image_id()).or_default();
                of_id.push((object.position_m.truncate(), kind));
            }
        }
        Ok(Self(kinds))
    }

    /// Where the kind of an object that a picture shows stands in [`ObjectKind::ALL`]. Of several
    /// with its id it is the one nearest to the body, as views reach less than 8 chunks far.
    pub(super) fn kind(
        &self,
        format: &'static str,
        instance: u32,
        (frame, picture): (&FrameRef<'_>, &str),
    ) -> Result<usize, Error> {
        let body_m = frame.world_from_body().translation_m.truncate();
        let of_id = self.0.get(&instance).into_iter().flatten();
        let apart = |(at_m, _): &&(DVec2, usize)| at_m.distance_squared(body_m);
        let nearest = of_id.min_by(|a, b| apart(a).total_cmp(&apart(b)));
        let known = nearest.map(|(_, kind)| *kind);
        known.ok_or_else(|| Error::Unsuitable {
            format,
            reason: format!("{picture} shows object {instance}, which instances.csv lacks"),
        })
    }
}
