//! What is wrong with the files of a site, and with what a config asks for beside them.

use std::collections::BTreeMap;

use nemoral_assets::StemProfile;
use nemoral_import::ModelKind;
use nemoral_scene::{ChunkCoord, ObjectId};
use nemoral_seed::Key;

use super::{MeasuredStems, SiteSpecies};
use crate::placement_problems::OBJECTS_OF_A_CHUNK_MAX;
use crate::{Config, InputFiles};

/// Every problem of a config's site: the key and the message, which starts with it.
pub(crate) fn problems(config: &Config, inputs: &InputFiles) -> Vec<(String, String)> {
    let lines = config.site.trail_lines_m(inputs).err();
    let found = [
        ("site.terrain.path", terrain_problem(config, inputs)),
        ("site.trails.path", lines.map(|e| e.to_string())),
        ("site.stems.path", stems_problem(config, inputs)),
    ];
    let named = |(key, message): (&str, Option<String>)| {
        message.map(|message| (key.to_owned(), format!("{key}: {message}")))
    };
    let mut all: Vec<_> = found.into_iter().filter_map(named).collect();
    // It is the files that say which coordinates they have.
    if all.is_empty()
        && let Err(e) = config.site_epsg(inputs)
    {
        all.push(("site.epsg".to_owned(), e.to_string()));
    }
    all
}

fn terrain_problem(config: &Config, inputs: &InputFiles) -> Option<String> {
    let site = &config.site;
    let map = match site.height_map(inputs) {
        Ok(Some(map)) => map,
        Ok(None) => return None,
        Err(e) => return Some(e.to_string()),
    };
    let (low, high) = (map.post_m(0, map.rows - 1), map.post_m(map.columns - 1, 0));
    if let Ok(Some(stems)) = site.stem_map(inputs)
        && !(stems.iter())
            .any(|s| (low[0]..=high[0]).contains(&s.x_m) && (low[1]..=high[1]).contains(&s.y_m))
    {
        let first = &stems[0];
        let message = format!(
            "it reaches from ({}, {}) to ({}, {}), and no tree of the stem map is there (the \
             first is at ({}, {})): both must have the same coordinates",
            low[0], low[1], high[0], high[1], first.x_m, first.y_m
        );
        return Some(message);
    }
    let refused = site.height_posts(&map).validate(site.terrain.blend_m);
    refused.err().map(|e| e.to_string())
}

fn stems_problem(config: &Config, inputs: &InputFiles) -> Option<String> {
    let site = &config.site;
    if site.stems.path.is_empty() {
        return None;
    }
    // Species and sizes are looked at, too.
    let assets = &config.assets;
    let tree_models = config.tree_models();
    let of_site = SiteSpecies {
        assets,
        site,
        tree_models: &tree_models,
        inputs,
    };
    // That of the plants, as in the stages.
    let seed = assets.own_seed().unwrap_or(config.seed);
    let sized = |species: Vec<_>| of_site.measured(&species, Key::world(seed));
    let fit = |measured: MeasuredStems| {
        let misfit = (measured.models.iter()).find_map(|stem| {
            let name = &tree_models[stem.model];
            let file = inputs.get(&config.models[name].file)?;
            // What is wrong with a model itself is said of the model.
            let model = file.model(ModelKind::Tree).ok()?;
            let height_m = model.extent.height_m;
            let profile = StemProfile::new(model.tree.as_ref()?.stem_cuts_m.clone(), height_m);
            stem.stretch(name, &profile, height_m).err()
        });
        misfit.map_or(Ok(()), |e| Err(of_site.of_stems(&e)))
    };
    if let Err(e) = of_site.all().and_then(sized).and_then(fit) {
        return Some(e.to_string());
    }
    let mut trees_of: BTreeMap<[i32; 2], usize> = BTreeMap::new();
    for stem in site.stem_map(inputs).ok().flatten()? {
        let chunk = ChunkCoord::containing(site.position_m(&stem), config.chunks.size_m);
        *trees_of.entry([chunk.x, chunk.y]).or_default() += 1;
    }
    let placed = config.most_objects_of_a_chunk(inputs);
    trees_of.into_iter().find_map(|([x, y], trees)| {
        let chunk = ChunkCoord::new(x, y);
        if ObjectId::new(chunk, 1).is_none() {
            return Some(format!(
                "a tree lies in chunk {chunk}, and ids reach chunk ±2,097,151: set \
                 site.origin_x_m and site.origin_y_m"
            ));
        }
        (placed + trees as f64 > OBJECTS_OF_A_CHUNK_MAX).then(|| {
            format!(
                "chunk {chunk} has {trees} trees and up to {placed:.0} other things, and .label \
                 files number only {OBJECTS_OF_A_CHUNK_MAX}: lower chunks.size_m, or what \
                 [placement] asks for"
            )
        })
    })
}
