//! Each command: one call of the pipeline or of the data set.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::CommandFactory;
use nemoral_convert::{
    ClassMapping, ConvertParams, LazCloudParams, OutputMode, convert_with_progress, laz_cloud,
    laz_note,
};
use nemoral_dataset::{CloudFormat, CloudParams, CloudPoses, MergeParams, OpenMode};
use nemoral_export::{check_apart, check_name};
use nemoral_pipeline::config::{
    Preset, SequenceConfig, Sequences, SiteFiles, annotated_toml, json_schema, reference_page,
};
use nemoral_pipeline::plan::{GraphFormat, Store};
use nemoral_pipeline::{
    Backend, ForestPlan, FrameSelection, GenerateParams, Observer, SequenceFrames, check, estimate,
    generate, merge, preview, write_png,
};
use serde_json::json;

use crate::arguments::{
    Arguments, Cloud, Command, ConfigCommand, Convert, Folder, Generate, Graph, Imu, Merge, Plan,
    Plot, Preview,
};
use crate::failure::{Failure, wrong};
use crate::frames::Frames;
use crate::progress::Reporter;
use crate::request::{cache, layers, load, recorder, threads};
use crate::terminal::{note, print_data, say, tell};
use crate::{export, inventory, view};

/// Runs a command. The result is `false` if it ran but its answer is no.
///
/// `program` is the file that makes values which are kept between runs.
pub(crate) fn run(arguments: Arguments, program: Option<&Path>) -> Result<bool, Failure> {
    match arguments.command {
        Command::Generate(a) => run_generate(&a, None, program),
        Command::Plot(a) => {
            let Plot {
                stems,
                terrain,
                trails,
                generate,
            } = a;
            let files = SiteFiles {
                stems,
                terrain,
                trails,
            };
            run_generate(&generate, Some(&files), program)
        }
        Command::Preview(a) => run_preview(&a, program),
        Command::View(a) => view::run(a, program),
        Command::Config(a) => run_config(&a, program),
        Command::Plan(a) => run_plan(&a, program),
        Command::Check(Folder { dir }) => {
            let report = nemoral_dataset::check(&dir)?;
            say(&report.to_string())?;
            Ok(report.passed())
        }
        Command::Stats(Folder { dir }) => {
            say(nemoral_dataset::stats(&dir)?.to_string().trim_end())?;
            Ok(true)
        }
        Command::Report(a) => {
            let made = nemoral_report::report(&a.dir, &a.out)?;
            let (out, mb) = (a.out.display(), made.bytes as f64 / 1e6);
            say(&format!("{} frames in {out}, {mb:.1} MB", made.frames))?;
            Ok(true)
        }
        Command::Cloud(a) => run_cloud(a),
        Command::Convert(a) => run_convert(&a),
        Command::Merge(a) => run_merge(&a),
        Command::Tree(a) => export::run_tree(&a),
        Command::Export(a) => export::run(&a, program),
        Command::Inventory(a) => inventory::run(&a, program),
        Command::Imu(a) => run_imu(&a, program),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            let mut program = Arguments::command();
            clap_complete::generate(shell, &mut program, "nemoral", &mut script);
            print_data(String::from_utf8_lossy(&script).trim_end())?;
            Ok(true)
        }
        Command::Man { command } => {
            print_data(manual(command.as_deref())?.trim_end())?;
            Ok(true)
        }
    }
}

fn run_imu(a: &Imu, program: Option<&Path>) -> Result<bool, Failure> {
    let (recorder, no_cache) = recorder(&a.of, program)?;
    let measured = recorder.write_imu(&a.out)?;
    let (samples, out) = (measured.samples, a.out.display());
    say(&format!("{samples} samples in {out}"))?;
    if let Some(about_drive) = &measured.note {
        note(about_drive);
    }
    if let Some(beyond) = measured.range_note() {
        note(&beyond);
    }
    if let Some(no_cache) = no_cache {
        note(&no_cache);
    }
    Ok(true)
}

fn run_cloud(a: Cloud) -> Result<bool, Failure> {
    let params = CloudParams {
        voxel_m: a.voxel,
        pure: a.pure,
        poses: match a.poses {
            Some(file) => CloudPoses::File(file),
            None if a.estimated_poses => CloudPoses::Estimated,
            None => CloudPoses::True,
        },
        sequence: a.sequence,
        crop: a.crop,
        only: a.only_class,
    };
    let refused = |why: &str| {
        let message = format!("--out {}: {why}", a.out.display());
        let is_request = true;
        Err(Failure {
            message,
            is_request,
        })
    };
    let ends_in = |ending: &str| {
        let end = a.out.extension();
        end.is_some_and(|e| e.eq_ignore_ascii_case(ending))
    };
    let is_laz = ends_in("laz");
    if !is_laz && !ends_in("ply") {
        return refused("must be a name that ends in .ply or .laz");
    }
    if !is_laz && (a.tile.is_some() || a.ontology.is_some()) {
        return refused("--tile and --ontology are for LAZ; give it a name that ends in .laz");
    }
    let cloud = nemoral_dataset::Cloud::open(&a.dir, params)?;
    for table in a.trees.iter().chain(&a.trajectory) {
        cloud.check_name(table, "csv")?;
    }
    if let (Some(trees), Some(trajectory)) = (&a.trees, &a.trajectory) {
        nemoral_dataset::Cloud::check_apart(trees, trajectory)?;
    }
    if is_laz {
        let laz = LazCloudParams {
            tile_m: a.tile,
            ontology: a.ontology.as_deref().map(ClassMapping::load).transpose()?,
            overwrite: a.overwrite,
        };
        for tile in laz_cloud(&cloud, &a.out, &laz)? {
            say(&format!(
                "{} points in {}",
                tile.points,
                tile.path.display()
            ))?;
        }
        if let Some(about) = laz_note(&cloud) {
            note(&about);
        }
    } else {
        let points = cloud.write_ply(&a.out)?;
        say(&format!("{points} points in {}", a.out.display()))?;
    }
    let format = if is_laz {
        CloudFormat::Laz
    } else {
        CloudFormat::Ply
    };
    let coordinates = match cloud.site() {
        Some(_) if is_laz => "the site's coordinates",
        _ => "world coordinates",
    };
    if let Some(path) = &a.trees {
        let (trees, path) = (cloud.write_trees(path, format)?, path.display());
        say(&format!("{trees} trees in {path}, in {coordinates}"))?;
    }
    if let Some(path) = &a.trajectory {
        let (poses, path) = (cloud.write_trajectory(path, format)?, path.display());
        say(&format!("{poses} poses in {path}, in {coordinates}"))?;
    }
    Ok(true)
}

/// The manual page of the program, or of one of its commands.
fn manual(command: Option<&str>) -> Result<String, Failure> {
    let mut program = Arguments::command();
    program.build();
    let page = match command {
        None => program,
        Some(name) => program.find_subcommand(name).cloned().ok_or_else(|| {
            let names: Vec<&str> = program.get_subcommands().map(|c| c.get_name()).collect();
            wrong(format!(
                "there is no command '{name}'; there are {}",
                names.join(", ")
            ))
        })?,
    };
    let mut text = Vec::new();
    clap_mangen::Man::new(page).render(&mut text)?;
    Ok(String::from_utf8_lossy(&text).into_owned())
}

fn run_convert(a: &Convert) -> Result<bool, Failure> {
    let params = ConvertParams {
        format: a.to,
        ontology: a.ontology.as_deref().map(ClassMapping::load).transpose()?,
        min_px: a.min_px,
        mode: match (a.resume, a.overwrite) {
            (true, _) => OutputMode::Resume,
            (_, true) => OutputMode::Overwrite,
            _ => OutputMode::Fresh,
        },
    };
    let reporter = Reporter::of_data_set("converting", a.progress_args);
    let done = convert_with_progress(&a.dir, &a.out, &params, &reporter.monitor());
    let done = done.inspect_err(|_| reporter.clear())?;
    let out = a.out.display().to_string();
    let answer = format!(
        "{} frames in {out}: {} files, {:.1} MB",
        done.frames,
        done.files,
        done.bytes as f64 / 1e6
    );
    let (frames, files, bytes) = (done.frames, done.files, done.bytes);
    let facts = json!({ "frames": frames, "out": out, "files": files, "bytes": bytes });
    for message in &done.notes {
        reporter.note(message);
    }
    reporter.answer(&answer, facts)?;
    Ok(true)
}

fn run_merge(a: &Merge) -> Result<bool, Failure> {
    let shards: Vec<&Path> = a.shards.iter().map(PathBuf::as_path).collect();
    let params = MergeParams {
        mode: open_mode(a.resume, a.overwrite),
        partial: a.partial,
    };
    let reporter = Reporter::of_data_set("merging", a.progress_args);
    let never = AtomicBool::new(false);
    let merged = merge(
        &shards,
        &a.out,
        params,
        &reporter.monitor(),
        &*reporter,
        &never,
    );
    let merged = merged.inspect_err(|_| reporter.clear())?;
    let (frames, out) = (merged.frames.len(), a.out.display().to_string());
    let answer = format!("{frames} frames in {out}");
    reporter.answer(&answer, json!({ "frames": frames, "out": out }))?;
    Ok(true)
}

/// What to do with an output folder that holds something.
fn open_mode(resume: bool, overwrite: bool) -> OpenMode {
    match (resume, overwrite) {
        (true, _) => OpenMode::Resume,
        (_, true) => OpenMode::Overwrite,
        _ => OpenMode::Fresh,
    }
}

/// `plot` are the files of a plot.
fn run_generate(
    a: &Generate,
    plot: Option<&SiteFiles>,
    program: Option<&Path>,
) -> Result<bool, Failure> {
    let mut world = a.world.clone();
    if !a.formats.is_empty() {
        let names: Vec<_> = a.formats.iter().map(|f| f.name()).collect();
        world.settings.push(format!("output.formats={names:?}"));
    }
    if let Some(Frames::Length(n)) = a.frames {
        world.settings.push(format!("frames={n}"));
    }
    let sequences = match plot {
        None => load(&world)?,
        Some(files) => layers(&world).plot(files)?,
    };
    let config = sequences.get(0)?.config;
    let of_each = match &a.frames {
        Some(Frames::These(frames)) => frames.clone(),
        _ => FrameSelection::first(config.frames),
    };
    let mut frames = SequenceFrames::new(of_each, sequences.len());
    if let Some(shard) = a.shard {
        frames = shard.of(&frames);
    }
    let mode = open_mode(a.resume, a.overwrite);
    let stop = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&stop);
    ctrlc::set_handler(move || {
        // Ctrl-C, or SIGTERM from whoever manages the machine. A second one does not wait until the
        // current frame is finished.
        if asked.swap(true, Ordering::Relaxed) {
            std::process::exit(1);
        }
    })
    .map_err(|e| Failure {
        message: format!("cannot listen for signals: {e}"),
        is_request: false,
    })?;
    let reporter = Reporter::new(frames.count(), sequences.len(), a.progress_args);
    let (backend, of_backend) = Backend::for_sequences(a.backend.into(), &sequences)?;
    if config.camera.enabled {
        reporter.note_with_first(of_backend);
    }
    let (cache, no_cache) = cache(&a.cache_args, program);
    if let Some(no_cache) = no_cache {
        reporter.note_with_first(no_cache);
    }
    let params = GenerateParams {
        cache,
        sequences,
        frames,
        out: a.out.clone(),
        mode,
        is_shard: a.shard.is_some(),
        threads: threads(&a.world)?,
        backend: backend.with_gpu_memory(a.gpu_memory),
    };
    let manifest = generate(&params, &reporter, &stop);
    let manifest = manifest.inspect_err(|_| reporter.clear())?;
    reporter.finish(manifest.frames.len(), &a.out);
    Ok(true)
}

fn run_preview(a: &Preview, program: Option<&Path>) -> Result<bool, Failure> {
    check_name(&a.out, "png")?;
    let SequenceConfig { config, inputs, .. } = load(&a.world)?.get(a.sequence)?;
    let asked = a.world.config.iter().map(|path| &**path);
    check_apart(&a.out, &asked.chain(inputs.paths()).collect::<Vec<_>>())?;
    let (backend, of_backend) = Backend::for_config(a.backend.into(), &config)?;
    let (cache, no_cache) = cache(&a.cache_args, program);
    let threads = threads(&a.world)?;
    let sheet = preview(&config, &inputs, backend, a.frame, threads, cache)?;
    write_png(&sheet, &a.out)?;
    note(&of_backend);
    if let Some(no_cache) = no_cache {
        note(&no_cache);
    }
    say(&format!("{}", a.out.display()))?;
    Ok(true)
}

fn run_config(command: &ConfigCommand, program: Option<&Path>) -> Result<bool, Failure> {
    match command {
        ConfigCommand::Presets => {
            for preset in Preset::ALL {
                say(&format!("{:<21} {}", preset.name, preset.doc))?;
            }
        }
        ConfigCommand::Init(world) => {
            print_data(annotated_toml(load(world)?.asked()).trim_end())?;
        }
        ConfigCommand::Show { world, sequence } => {
            print_data(load(world)?.get(*sequence)?.config.to_toml().trim_end())?;
        }
        ConfigCommand::Check { world, cache_args } => {
            let sequences = load(world)?;
            let (cache, no_cache) = cache(cache_args, program);
            let begin = |number: u32| {
                if sequences.len() > 1 {
                    tell(&format!("sequence {} of {}", number + 1, sequences.len()));
                }
            };
            let known = check(&sequences, threads(world)?, cache, begin)?;
            for message in known.into_iter().chain(no_cache) {
                note(&message);
            }
            say("fine")?;
        }
        ConfigCommand::Schema => {
            print_data(&serde_json::to_string_pretty(&json_schema()).map_err(wrong)?)?;
        }
        ConfigCommand::Reference => print_data(reference_page().trim_end())?,
    }
    Ok(true)
}

fn run_plan(a: &Plan, program: Option<&Path>) -> Result<bool, Failure> {
    let sequences = load(&a.world)?;
    if a.list {
        return list_sequences(&sequences);
    }
    let SequenceConfig { config, inputs, .. } = sequences.get(a.sequence)?;
    let forest = ForestPlan::with_inputs(&config, &inputs, Backend::Cpu)?;
    if a.explain {
        let (cache, no_cache) = cache(&a.cache_args, program);
        if let Some(no_cache) = no_cache {
            note(&no_cache);
        }
        let store = Store::unlimited().with_cache(cache);
        say(forest.plan().explain(&store).trim_end())?;
        say(&estimate(&config, sequences.len()).to_string())?;
    } else {
        let format = match a.format {
            Graph::Mermaid => GraphFormat::Mermaid,
            Graph::Dot => GraphFormat::Dot,
        };
        print_data(forest.plan().draw(format).trim_end())?;
    }
    Ok(true)
}

/// Prints a line for each sequence: its number, its split, its world's seed and what was drawn.
fn list_sequences(sequences: &Sequences) -> Result<bool, Failure> {
    for number in 0..sequences.len() {
        let sequence = sequences.get(number)?;
        let mut line = format!("{number:02}");
        if let Some(split) = sequence.split {
            line += &format!("  {:5}", split.name());
        }
        line += &format!("  seed = {}", sequence.config.seed);
        for (key, value) in &sequence.drawn {
            line += &format!("  {key} = {value}");
        }
        say(&line)?;
    }
    Ok(true)
}
