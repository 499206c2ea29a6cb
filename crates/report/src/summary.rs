//! What the page shows of the whole data set.

use std::collections::{BTreeMap, BTreeSet};

use nemoral_dataset::{Dataset, Json, Quantiles, Stats};
use nemoral_scene::TreeRecord;
use serde::Serialize;

use crate::budget::{Budget, halving_order, spread};
use crate::species::Species;
use crate::{Error, MAX_PLACES, MAX_THUMBNAILS, MAX_TREES, MAX_WHOLE_FRAMES, maps, warnings};

/// The page's main data.
#[derive(Debug, Serialize)]
pub(crate) struct Summary {
    name: String,
    generator: String,
    backend: String,
    licence: String,
    seed: String,
    bytes: u64,
    config: String,
    warnings: Vec<String>,
    classes: Vec<Class>,
    quantiles: Vec<(&'static str, Option<[f64; 5]>)>,
    /// Names; the last one may stand for many.
    species: Vec<String>,
    depth: DepthScale,
    trees_total: usize,
    trees_shown: usize,
    sequences: Vec<Sequence>,
    frames_total: usize,
    /// Those whose places are on the maps, all that have more among them.
    frames: Vec<Frame>,
}

#[derive(Debug, Serialize)]
struct Class {
    id: u8,
    name: String,
    colour: [u8; 3],
    pixels: u64,
    points: u64,
}

#[derive(Debug, Serialize)]
struct DepthScale {
    far_m: f32,
    palette: Vec<[u8; 3]>,
}

/// Species, east, north, DBH, height, crown radius; metres.
type Tree = (usize, f32, f32, f32, f32, f32);

#[derive(Debug, Serialize)]
struct Sequence {
    number: u32,
    seed: String,
    split: Option<&'static str>,
    drawn: Json,
    /// Frames, which need not all be listed.
    frames: usize,
    /// LiDAR points by class id.
    points: BTreeMap<u8, u64>,
    trees: Vec<Tree>,
    /// Trees by species.
    counts: BTreeMap<usize, usize>,
}

#[derive(Debug, Serialize)]
struct Frame {
    /// Its place among all frames of the data set.
    #[serde(skip)]
    number: usize,
    sequence: u32,
    index: u64,
    time_s: f64,
    /// East and north of the body, metres.
    at: [f32; 2],
    /// Its place among the frames with all maps.
    whole: Option<usize>,
    thumbnail: Option<String>,
}

impl Sequence {
    /// Replaces the numbers of species by their places on the page.
    fn place_species(&mut self, places: &[usize]) {
        for tree in &mut self.trees {
            tree.0 = places[tree.0];
        }
        let mut counts = BTreeMap::<usize, usize>::new();
        for (&number, &trees) in &self.counts {
            *counts.entry(places[number]).or_default() += trees;
        }
        self.counts = counts;
    }
}

fn rounded(v: f64) -> f32 {
    ((v * 100.0).round() / 100.0) as f32
}

impl Summary {
    /// Reads what is needed of every file. No frame has its maps yet; thumbnails take at most
    /// `thumbnail_bytes`.
    pub(crate) fn new(dataset: &Dataset, thumbnail_bytes: usize) -> Result<Self, Error> {
        let (thumbnails, brightness) = thumbnails(dataset, Budget::new(thumbnail_bytes))?;
        summary(dataset, thumbnails, &brightness)
    }

    /// Says which frames of the data set (ascending) have all their maps.
    pub(crate) fn set_whole(&mut self, frames: impl Iterator<Item = usize>) {
        for (whole, number) in frames.enumerate() {
            let listed = self.frames.binary_search_by_key(&number, |f| f.number);
            let listed = listed.expect("all that may have their maps are listed");
            self.frames[listed].whole = Some(whole);
        }
    }
}

/// The frames that may have all their maps.
pub(crate) fn candidates(frames: usize) -> Vec<usize> {
    spread(frames, MAX_WHOLE_FRAMES)
}

/// Thumbnails of frames that are spread over the data set, as many as fit, and their brightness.
fn thumbnails(
    dataset: &Dataset,
    mut budget: Budget,
) -> Result<(BTreeMap<usize, String>, Vec<f64>), Error> {
    let frames = dataset.frames();
    let mut pictured = spread(frames.len(), MAX_THUMBNAILS);
    pictured.extend(candidates(frames.len()));
    pictured.retain(|&i| !dataset.sequence_of(&frames[i]).cameras.is_empty());
    pictured.sort_unstable();
    pictured.dedup();
    let (mut thumbnails, mut brightness) = (BTreeMap::new(), Vec::new());
    for i in halving_order(pictured.len()) {
        let number = pictured[i];
        let (thumbnail, bright) = maps::thumbnail(&dataset.picture(&frames[number], 0)?);
        if !budget.take(thumbnail.len()) {
            break;
        }
        brightness.push(bright);
        thumbnails.insert(number, thumbnail);
    }
    Ok((thumbnails, brightness))
}

fn summary(
    dataset: &Dataset,
    mut thumbnails: BTreeMap<usize, String>,
    brightness: &[f64],
) -> Result<Summary, Error> {
    let stats = nemoral_dataset::stats(dataset.root())?;
    let manifest = dataset.manifest();
    let header = &manifest.header;
    let frames = dataset.frames();
    let mut listed = BTreeSet::from_iter(spread(frames.len(), MAX_PLACES));
    listed.extend(thumbnails.keys());
    listed.extend(candidates(frames.len()));
    let shown = listed.into_iter().map(|number| {
        let frame = &frames[number];
        let at = frame.world_from_body().translation_m;
        Frame {
            number,
            sequence: frame.sequence,
            index: frame.index,
            time_s: frame.time_s,
            at: [rounded(at.x), rounded(at.y)],
            whole: None,
            thumbnail: thumbnails.remove(&number),
        }
    });
    let shown = shown.collect();
    let mut species = Species::default();
    let mut sequences = Vec::new();
    // An even choice of trees, of the same share in each sequence.
    let every = stats.trees.div_ceil(MAX_TREES).max(1);
    for track in &manifest.tracks {
        let spec = header
            .sequence(track.sequence)
            .expect("tracks are of sequences");
        let (trees, counts) = trees(dataset.trees(track.sequence)?, every, &mut species);
        // Frames are in the order of their sequences.
        let from = frames.partition_point(|f| f.sequence < track.sequence);
        let to = frames.partition_point(|f| f.sequence <= track.sequence);
        let mut points = BTreeMap::new();
        for frame in &frames[from..to] {
            for (&class, n) in &frame.point_classes {
                *points.entry(class).or_default() += n;
            }
        }
        sequences.push(Sequence {
            number: track.sequence,
            // A number of JavaScript has no room for it.
            seed: spec.seed.to_string(),
            split: spec.split.map(|s| s.name()),
            drawn: spec.drawn.clone(),
            frames: to - from,
            points,
            trees,
            counts,
        });
    }
    let species = species.named();
    for sequence in &mut sequences {
        sequence.place_species(&species.places);
    }
    let root = dataset.root();
    let name = root.canonicalize().ok();
    let name = name.as_deref().unwrap_or(root).file_name();
    Ok(Summary {
        name: name.map_or("data set".into(), |n| n.to_string_lossy().into_owned()),
        generator: format!("{} {}", header.generator, header.version),
        backend: header.backend.clone(),
        licence: header.licence.clone(),
        seed: header.seed.to_string(),
        bytes: stats.bytes,
        config: header.config_toml.clone(),
        warnings: warnings::warnings(dataset, &stats, brightness),
        quantiles: quantiles(&stats),
        classes: classes(dataset, &stats),
        species: species.names,
        depth: DepthScale {
            far_m: maps::FAR_M,
            palette: maps::depth_palette().to_vec(),
        },
        trees_total: stats.trees,
        trees_shown: sequences.iter().map(|s| s.trees.len()).sum(),
        sequences,
        frames_total: frames.len(),
        frames: shown,
    })
}

/// Each `every`th of a sequence's trees, and how many there are by species' number.
fn trees(
    all: Vec<TreeRecord>,
    every: usize,
    species: &mut Species,
) -> (Vec<Tree>, BTreeMap<usize, usize>) {
    let (mut shown, mut counts) = (Vec::new(), BTreeMap::<usize, usize>::new());
    for (i, tree) in all.into_iter().enumerate() {
        let number = species.count(tree.species);
        *counts.entry(number).or_default() += 1;
        if i % every == 0 {
            shown.push((
                number,
                rounded(tree.position_m.x),
                rounded(tree.position_m.y),
                tree.dbh_m as f32,
                rounded(tree.height_m),
                rounded(tree.crown_radius_m),
            ));
        }
    }
    (shown, counts)
}

fn classes(dataset: &Dataset, stats: &Stats) -> Vec<Class> {
    let classes = dataset.manifest().header.ontology.classes().iter();
    let counted = classes.zip(&stats.classes);
    counted
        .map(|(class, share)| Class {
            id: class.id,
            name: class.name.clone(),
            colour: class.colour,
            pixels: share.pixels,
            points: share.points,
        })
        .collect()
}

fn quantiles(stats: &Stats) -> Vec<(&'static str, Option<[f64; 5]>)> {
    let row = |q: Quantiles| [q.min, q.p05, q.median, q.p95, q.max];
    let percent = |q: Quantiles| row(q).map(|v| 100.0 * v);
    vec![
        (
            "Diameter at breast height (7 cm and more), m",
            stats.dbh_m.map(row),
        ),
        ("Height of these trees, m", stats.tree_height_m.map(row)),
        ("Depth of pixels, m", stats.depth_m.map(row)),
        ("Range of points, m", stats.range_m.map(row)),
        (
            "Points seen in the frame before, %",
            stats.overlap.map(percent),
        ),
    ]
}
