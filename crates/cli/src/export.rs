//! The commands `tree` and `export`: scenes for other programs.

use std::path::Path;

use nemoral_export::{
    ExportScene, GltfParams, Instancing, UsdParams, check_apart, check_folder, check_height_map,
    check_name, write_glb, write_height_map, write_sdf, write_usd,
};
use nemoral_pipeline::{ExportArea, tree_scene};

use crate::arguments::{Export, ExportFormat, Region, Tree};
use crate::failure::{Failure, wrong};
use crate::request::recorder;
use crate::terminal::{note, say};

/// Distance between the posts of a height map, metres.
const SPACING_M: f64 = 0.5;

/// Grows one tree.
pub(crate) fn run_tree(a: &Tree) -> Result<bool, Failure> {
    check_name(&a.out, "glb")?;
    let scene = tree_scene(&a.species, a.dbh, !a.dead, a.seed)?;
    let bytes = write_glb(&scene, &a.out, GltfParams::default())?;
    for tree in &scene.trees {
        say(&format!(
            "{}: {:.2} m thick, {:.1} m high; {:.1} MB in {}",
            tree.species,
            tree.dbh_m,
            tree.height_m,
            megabytes(bytes),
            a.out.display()
        ))?;
    }
    Ok(true)
}

/// Exports a part of a forest.
pub(crate) fn run(a: &Export, program: Option<&Path>) -> Result<bool, Failure> {
    let config: Vec<&Path> = a.of.world.config.iter().map(|path| &**path).collect();
    match a.to {
        ExportFormat::Glb => {
            check_name(&a.out, "glb")?;
            check_apart(&a.out, &config)?;
        }
        ExportFormat::Heightmap => check_height_map(&a.out, &config)?,
        ExportFormat::Usd | ExportFormat::Sdf => check_folder(&a.out)?,
    }
    if a.spacing.is_some() && a.to != ExportFormat::Heightmap {
        return Err(wrong("--spacing: only --to heightmap has posts"));
    }
    if a.plain_nodes && !matches!(a.to, ExportFormat::Glb | ExportFormat::Usd) {
        return Err(wrong("--plain-nodes: only --to glb and usd have instances"));
    }
    let area = match a.region {
        None => ExportArea::Frame(a.frame),
        Some(Region([x0, y0, x1, y1])) => ExportArea::Region {
            low_m: [x0, y0].into(),
            high_m: [x1, y1].into(),
        },
    };
    let (recorder, no_cache) = recorder(&a.of, program)?;
    let inputs: Vec<&Path> = recorder.sequence().inputs.paths().collect();
    match a.to {
        ExportFormat::Glb => check_apart(&a.out, &inputs)?,
        ExportFormat::Heightmap => check_height_map(&a.out, &inputs)?,
        // These are in folders that are empty.
        ExportFormat::Usd | ExportFormat::Sdf => {}
    }
    let instancing = if a.plain_nodes {
        Instancing::Nodes
    } else {
        Instancing::Extension
    };
    let export = |write: &dyn Fn(&ExportScene) -> Result<u64, nemoral_export::Error>| {
        let scene = recorder.export_scene(area)?;
        tell(&scene, &a.out, write(&scene)?)
    };
    match a.to {
        ExportFormat::Glb => {
            let z_up = false;
            export(&|scene| write_glb(scene, &a.out, GltfParams { instancing, z_up }))?;
        }
        ExportFormat::Usd => export(&|scene| write_usd(scene, &a.out, UsdParams { instancing }))?,
        ExportFormat::Sdf => export(&|scene| write_sdf(scene, &a.out))?,
        ExportFormat::Heightmap => {
            let grid = recorder.export_heights(area, a.spacing.unwrap_or(SPACING_M))?;
            let bytes = write_height_map(&grid, &a.out)?;
            say(&format!(
                "{} x {} posts, {:.4} m a level; {:.1} MB in {}",
                grid.columns,
                grid.rows,
                grid.height_scale().metres_per_level,
                megabytes(bytes),
                a.out.display()
            ))?;
        }
    }
    if let Some(no_cache) = no_cache {
        note(&no_cache);
    }
    Ok(true)
}

fn tell(scene: &ExportScene, out: &Path, bytes: u64) -> Result<(), Failure> {
    say(&format!(
        "{} instances, {} objects, {} trees; {:.1} MB in {}",
        scene.instances.len(),
        scene.objects.len(),
        scene.trees.len(),
        megabytes(bytes),
        out.display()
    ))?;
    let [x, y, z] = scene.origin_m.to_array();
    note(&format!(
        "the scene's origin is at {x}, {y}, {z} m of the world"
    ));
    Ok(())
}

fn megabytes(bytes: u64) -> f64 {
    bytes as f64 / 1e6
}
