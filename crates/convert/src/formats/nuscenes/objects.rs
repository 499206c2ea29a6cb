//! The tables of objects, `instance` and `sample_annotation`, from what the steps of frames have
//! left. In memory there is an entry for each object of a scene, however many frames it has.

use std::collections::BTreeMap;

use nemoral_scene::ObjectKind;
use serde_json::json;

use super::annotations::Annotation;
use super::classes::kind_name;
use super::scenes::{self, Scene, Tokens};
use super::tables::Rows;
use crate::{Error, FileStream, StepNotes};

/// Where in a scene an object has boxes; frames are their places in it.
struct Track {
    image_id: u32,
    kind: ObjectKind,
    count: u64,
    first: usize,
    last: usize,
}

pub(super) fn instances(
    scenes: &[Scene<'_>],
    tokens: &Tokens,
    notes: &StepNotes,
    out: &mut FileStream,
) -> Result<(), Error> {
    let mut rows = Rows::begin(out)?;
    for scene in scenes {
        let mut tracks: BTreeMap<u64, Track> = BTreeMap::new();
        for (i, frame) in scene.frames.iter().enumerate() {
            for a in notes.json::<Vec<Annotation>>(&scenes::step(frame))? {
                let track = tracks.entry(a.object).or_insert(Track {
                    image_id: a.image_id,
                    kind: a.kind,
                    count: 0,
                    first: i,
                    last: i,
                });
                track.count += 1;
                track.last = i;
            }
        }
        for (object, track) in tracks {
            let token = |at: usize| tokens.annotation(&scene.frames[at], object);
            rows.put(&json!({
                "token": tokens.instance(scene, object),
                "category_token": tokens.category(&kind_name(track.kind)),
                "nbr_annotations": track.count,
                "first_annotation_token": token(track.first),
                "last_annotation_token": token(track.last),
                // Ours: the ids of instances.csv and of instance maps.
                "object": object, "image_id": track.image_id,
            }))?;
        }
    }
    rows.end()
}

/// A box whose successor is not known yet.
struct Pending {
    annotation: Annotation,
    /// The frame that it is of.
    at: usize,
    /// The frame of its predecessor.
    before: Option<usize>,
}

/// A box is written as soon as the next one of its object is found, so that both can name one
/// another.
pub(super) fn annotations(
    scenes: &[Scene<'_>],
    tokens: &Tokens,
    notes: &StepNotes,
    out: &mut FileStream,
) -> Result<(), Error> {
    let mut rows = Rows::begin(out)?;
    for scene in scenes {
        let mut pending: BTreeMap<u64, Pending> = BTreeMap::new();
        for (at, frame) in scene.frames.iter().enumerate() {
            for annotation in notes.json::<Vec<Annotation>>(&scenes::step(frame))? {
                let object = annotation.object;
                let old = pending.remove(&object);
                if let Some(old) = &old {
                    put(scene, tokens, old, Some(at), &mut rows)?;
                }
                let before = old.map(|old| old.at);
                let new = Pending {
                    annotation,
                    at,
                    before,
                };
                pending.insert(object, new);
            }
        }
        for last in pending.values() {
            put(scene, tokens, last, None, &mut rows)?;
        }
    }
    rows.end()
}

fn put(
    scene: &Scene<'_>,
    tokens: &Tokens,
    of: &Pending,
    next: Option<usize>,
    rows: &mut Rows<'_>,
) -> Result<(), Error> {
    let a = &of.annotation;
    let token = |at: usize| tokens.annotation(&scene.frames[at], a.object);
    let [prev, next] = [of.before, next].map(|at| at.map_or_else(String::new, token));
    rows.put(&json!({
        "token": token(of.at),
        "sample_token": tokens.sample(&scene.frames[of.at]),
        "instance_token": tokens.instance(scene, a.object),
        "visibility_token": a.visibility().to_string(),
        "attribute_tokens": [], "translation": a.centre_m, "size": a.size_m,
        "rotation": a.rotation, "num_lidar_pts": a.points, "num_radar_pts": 0,
        "prev": prev, "next": next,
    }))
}
