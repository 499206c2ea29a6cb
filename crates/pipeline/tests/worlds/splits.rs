//! Sequences of different splits have no shape, no texture and no chunk in common; those of one
//! split have their grown plants in common.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use nemoral_assets::{Climbers, Deadwood, Library, PlantKind, TreeAsset, TreeClimbers};
use nemoral_dataset::Split;
use nemoral_pipeline::config::{ConfigLayers, SequenceConfig};
use nemoral_pipeline::plan::Runner;
use nemoral_pipeline::{Backend, ForestPlan};
use nemoral_realism::store;
use nemoral_scene::glam::{DVec2, Vec3};
use nemoral_scene::{ChunkCoord, Prototype, Surface};

/// Digests with what they are of, for messages.
type Digests = BTreeMap<Digest, String>;
type Digest = [u8; blake3::OUT_LEN];

/// Two sequences of each of two splits, with a few individuals of all that grows.
fn sequences() -> Vec<SequenceConfig> {
    let settings = [
        "sequences=4",
        "splits.train=0.5",
        "splits.test=0.5",
        "deadwood.volume_m3_ha=20",
        "climbers.ivy=0.5",
        "climbers.moss=1",
        "climbers.honeysuckle=0.1",
        "climbers.clematis=0.1",
        "climbers.resin=0.5",
        "litter.cover=0.9",
        "assets.eucalyptus=0",
        "assets.english_oak=0",
        "placement.regeneration.saplings=20",
        "placement.regeneration.seedlings=0.1",
        "undergrowth.surface_roots=1",
        "undergrowth.sward.cover=0.3",
        "undergrowth.thickets.bramble=0.1",
        "undergrowth.thickets.bracken=0.1",
        "undergrowth.thickets.heath=0.1",
        "undergrowth.thickets.bilberry=0.1",
        "undergrowth.thickets.nettles=0.1",
        "undergrowth.thickets.reeds=0.5",
        // With streams there are wet stones, and what lies across ways and beside them.
        "water.springs_per_km2=14",
    ];
    let layers = ConfigLayers {
        preset: Some("demo".to_owned()),
        settings: settings.map(str::to_owned).into(),
        ..ConfigLayers::default()
    };
    let sequences = layers.sequences().expect("a sound request");
    let get = |number| sequences.get(number).expect("a sound sequence");
    (0..sequences.len()).map(get).collect()
}

/// What a sequence's world is made of.
#[derive(Debug)]
struct Parts {
    split: Split,
    library: Arc<Library>,
    /// Of the ground and of all objects of each chunk.
    chunks: Digests,
    /// Of each object alone.
    objects: Digests,
}

fn digest(numbers: impl IntoIterator<Item = f64>) -> Digest {
    let mut hasher = blake3::Hasher::new();
    for number in numbers {
        hasher.update(&number.to_bits().to_le_bytes());
    }
    hasher.finalize().into()
}

/// Of the vertices and the cards.
fn of_shape(shape: &Prototype) -> Digest {
    let corners = shape.cards().iter().flat_map(|card| card.corners());
    let vertices = shape.mesh().positions.iter().copied().chain(corners);
    digest(vertices.flat_map(|v: Vec3| v.as_dvec3().to_array()))
}

fn trees(library: &Library) -> Digests {
    let trees = [&library.trees, &library.saplings, &library.snags]
        .into_iter()
        .flatten();
    let of_tree = |tree: &TreeAsset| (of_shape(&tree.prototype), tree.prototype.name().to_owned());
    trees.map(of_tree).collect()
}

/// Of everything but the trees. Nothing is shared by design: all shapes are grown from the key of
/// the split's plants. Parts are taken out one by one, so that no new one is forgotten here.
fn other_shapes(library: &Library) -> Digests {
    let Library {
        // What the others refer to.
        materials: _,
        full_leaf_masks: _,
        always_wet: _,
        ground: _,
        // They are in `trees`.
        trees: _,
        saplings: _,
        snags: _,
        plants,
        shed,
        deadwood: Deadwood { logs, thrown },
        climbers: Climbers {
            trees: on_trees,
            snags: on_snags,
        },
        communities,
    } = library;
    for kind in PlantKind::ALL {
        assert!(!plants[kind].is_empty(), "there are some of {kind:?}");
    }
    let shed = shed.iter().flat_map(|of| of.wide.iter().chain(&of.narrow));
    let tiles = communities
        .iter()
        .flat_map(|of| of.wide.iter().chain(&of.narrow));
    assert!(communities.iter().all(|of| !of.wide.is_empty()));
    assert!(shed.clone().next().is_some() && !logs.is_empty() && !thrown.is_empty());
    let plants = plants.iter().flatten().chain(shed).chain(tiles);
    let plants = plants.map(|plant| &plant.prototype);
    let logs = logs.iter().chain(thrown).map(|log| &log.prototype);
    let climbers = on_trees.iter().chain(on_snags).flat_map(|of| {
        let TreeClimbers {
            ivy,
            moss,
            honeysuckle,
            clematis,
            resin,
        } = of;
        let lianas = honeysuckle.iter().chain(clematis).chain(resin);
        ivy.iter().chain(moss).chain(lianas)
    });
    let shapes = plants.chain(logs).chain(climbers);
    shapes
        .map(|shape| (of_shape(shape), shape.name().to_owned()))
        .collect()
}

/// Of the textures of materials that are of more than one colour, and of their masks.
fn textures(library: &Library) -> Digests {
    let mut found = Digests::new();
    for material in library.materials.materials() {
        let texels = material.albedo.srgb();
        if texels.iter().any(|texel| texel != &texels[0]) {
            let bytes = texels.as_flattened().iter().map(|&byte| f64::from(byte));
            found.insert(digest(bytes), format!("{}, colours", material.name));
        }
        if let Some(mask) = &material.mask {
            let words = mask.words().iter().map(|&word| f64::from(word));
            found.insert(digest(words), format!("{}, mask", material.name));
        }
    }
    found
}

/// Grows a world, as far as it is looked at here.
fn parts(sequence: &SequenceConfig, store: &nemoral_pipeline::plan::Store) -> Parts {
    let forest = ForestPlan::with_inputs(&sequence.config, &sequence.inputs, Backend::Cpu);
    let forest = forest.expect("a sound config");
    let runner = Runner::new(forest.plan(), store, 2);
    let (mut chunks, mut objects) = (Digests::new(), Digests::new());
    let side_m = sequence.config.chunks.size_m;
    for at in (0..4).map(|i| ChunkCoord::new(i % 2, i / 2)) {
        let ground = runner.get(forest.ground, at).expect("ground");
        let first_m = at.origin_m(side_m);
        let height_m = |i: u32| {
            let off_m = DVec2::new(f64::from(i % 5), f64::from(i / 5)) * side_m / 5.0;
            ground.height_m(first_m + off_m)
        };
        let name = format!("chunk {at}");
        chunks.insert(digest((0..25).map(height_m)), format!("{name}, ground"));
        let found = runner.get(forest.objects, at).expect("objects");
        let of_object = |o: &nemoral_stand::SceneObject| {
            // Places alone, so that the same places with other plants would be found, too.
            o.position_m.to_array()
        };
        chunks.insert(
            digest(found.0.iter().flat_map(of_object)),
            format!("{name}, objects"),
        );
        for object in &found.0 {
            let name = format!("{} {}", object.kind.name(), object.object.to_u64());
            objects.insert(digest(of_object(object)), name);
        }
    }
    Parts {
        split: sequence.split.expect("it is split"),
        library: runner.get(forest.library, ()).expect("a library"),
        chunks,
        objects,
    }
}

#[track_caller]
fn assert_disjoint(what: &str, a: &Digests, b: &Digests) {
    assert!(!a.is_empty() && !b.is_empty(), "there are some {what}");
    let common: BTreeSet<_> = a.keys().filter_map(|digest| b.get(digest)).collect();
    assert!(common.is_empty(), "{what} in common: {common:?}");
}

#[test]
fn splits_have_no_shape_no_texture_and_no_chunk_in_common() {
    let store = store();
    let worlds: Vec<Parts> = sequences().iter().map(|s| parts(s, &store)).collect();
    for (i, a) in worlds.iter().enumerate() {
        for b in &worlds[i + 1..] {
            // No two sequences, of whatever split, are at the same place.
            assert_disjoint("chunks", &a.chunks, &b.chunks);
            assert_disjoint("objects", &a.objects, &b.objects);
            assert_eq!(
                Arc::ptr_eq(&a.library, &b.library),
                a.split == b.split,
                "plants are grown once for each split"
            );
        }
    }
    let of = |split| {
        let mut of_split = worlds.iter().filter(|world| world.split == split);
        let first = of_split.next().expect("each split has sequences");
        assert_eq!(of_split.count(), 1);
        &*first.library
    };
    let (train, test) = (of(Split::Train), of(Split::Test));
    assert_disjoint("trees", &trees(train), &trees(test));
    assert_disjoint("other shapes", &other_shapes(train), &other_shapes(test));
    assert_disjoint("textures", &textures(train), &textures(test));
}
