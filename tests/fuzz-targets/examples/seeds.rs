//! Makes the corpora's seeds and the dictionaries anew: `seeds FUZZ [DATASET]...`, where FUZZ is
//! the folder of the fuzzers. Files of the two base data sets, and of the given ones, which the
//! program has made, go to the targets that read them; requests are the program's own presets and
//! species.

#![allow(
    clippy::disallowed_methods,
    reason = "tests, examples and benchmarks use files directly"
)]

use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use nemoral_assets::Species;
use nemoral_dataset::DepthFormat;
use nemoral_fuzz_targets::{files, write_shard};
use nemoral_pipeline::config::Preset;
use serde_json::Value;

#[path = "../../../crates/import/tests/common/mod.rs"]
mod models;

/// Size of the largest seed, bytes: mutating larger ones finds little.
const LARGEST: usize = 48 << 10;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args_os().skip(1).map(PathBuf::from);
    let fuzz = arguments.next().ok_or("usage: seeds FUZZ [DATASET]...")?;
    let seeds = Seeds {
        corpus: fuzz.join("corpus"),
    };
    dictionaries(&fuzz.join("dictionaries"))?;
    let folder = tempfile::tempdir()?;
    let base = [("png", DepthFormat::Png16), ("npy", DepthFormat::Npy)];
    for (name, depth) in base {
        let out = folder.path().join(name);
        write_shard(&out, depth, 0..2);
        seeds.dataset(&format!("base-{name}"), &out)?;
    }
    for made in arguments {
        let name = made.file_name().ok_or("a data set's folder has a name")?;
        seeds.dataset(&name.to_string_lossy(), &made)?;
    }
    seeds.requests()?;
    seeds.skies()?;
    seeds.sites()?;
    seeds.models()?;
    seeds.merges()
}

/// Writes the dictionaries of text formats with many words: their keys and tables.
fn dictionaries(folder: &Path) -> Result<(), Box<dyn Error>> {
    let mut words = BTreeSet::new();
    for preset in Preset::ALL {
        words.extend(keys(&preset.config().to_toml()));
    }
    words.extend(["[ranges]", "lidars.rear.", "cameras.right.", "preset = "].map(str::to_owned));
    write_dictionary(&folder.join("config.dict"), &words)?;
    let bare = |word: &String| word.trim_matches(['[', ']', ' ']).replace(" =", "=");
    let settings = words.iter().map(bare).collect();
    write_dictionary(&folder.join("settings.dict"), &settings)?;
    let text = Species::built_in_toml("beech").ok_or("there is a beech")?;
    write_dictionary(&folder.join("species.dict"), &keys(text).collect())
}

/// The keys of a TOML text with their equals signs, and its tables in brackets.
fn keys(toml: &str) -> impl Iterator<Item = String> {
    toml.lines()
        .filter_map(|line| match line.split_once(" = ") {
            Some((key, _)) => Some(format!("{key} = ")),
            None => line.starts_with('[').then(|| line.to_owned()),
        })
}

fn write_dictionary(path: &Path, words: &BTreeSet<String>) -> Result<(), Box<dyn Error>> {
    let lines: String = words.iter().map(|word| format!("{word:?}\n")).collect();
    fs::create_dir_all(path.parent().ok_or("a dictionary has a folder")?)?;
    Ok(fs::write(path, lines)?)
}

struct Seeds {
    corpus: PathBuf,
}

impl Seeds {
    fn put(&self, target: &str, name: &str, bytes: &[u8]) -> Result<(), Box<dyn Error>> {
        if bytes.len() <= LARGEST {
            let folder = self.corpus.join(target);
            fs::create_dir_all(&folder)?;
            fs::write(folder.join(format!("seed-{name}")), bytes)?;
        }
        Ok(())
    }

    /// Makes a seed of each kind of file of a data set.
    fn dataset(&self, name: &str, root: &Path) -> Result<(), Box<dyn Error>> {
        let files = files(root);
        let mut of_kind: BTreeMap<&str, &str> = BTreeMap::new();
        for path in files.keys() {
            let folder = path.rsplit('/').nth(1).unwrap_or("");
            let extension = path.rsplit('.').next().unwrap_or("");
            // Only the first frame's files are used: `sequences/NN/FOLDER/FILE`.
            if !path.starts_with("sequences/") || path.matches('/').count() < 3 {
                continue;
            }
            of_kind
                .entry(match (folder, extension) {
                    ("image_2", _) => "rgb",
                    (_, "png") => folder,
                    (_, extension) => extension,
                })
                .or_insert(path);
        }
        for (kind, path) in of_kind {
            let bytes = &files[path];
            let png = |kind: u8| -> Result<(), Box<dyn Error>> {
                let side = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().expect("4"));
                self.picture("png", path, name, kind, (side(16), side(20)), bytes)
            };
            match kind {
                "rgb" | "instance" | "trunks" => png(0)?,
                "semantic" => png(1)?,
                "depth" => png(2)?,
                "sky" => png(3)?,
                "flow" => png(4)?,
                "normals" => png(5)?,
                "npy" | "exr" => {
                    let header = &files["dataset.json"];
                    let json: Value = serde_json::from_slice(header)?;
                    let of = &json["sequences"][0]["cameras"][0]["intrinsics"];
                    let side = |name: &str| of[name].as_u64().unwrap_or(1) as u32;
                    let size = (side("width"), side("height"));
                    self.picture(kind, path, name, 0, size, bytes)?;
                }
                "csv" => self.put("boxes", name, bytes)?,
                other => self.put(other, name, bytes)?,
            }
        }
        for (path, target) in [
            ("sequences/00/poses.txt", "poses"),
            ("sequences/00/calib.txt", "calib"),
            ("sequences/00/times.txt", "times"),
            ("sequences/00/trees.csv", "trees"),
            ("sequences/00/instances.csv", "instances"),
            ("dataset.json", "manifest"),
            ("config.toml", "config"),
        ] {
            self.put(target, name, head(&files[path], target))?;
        }
        // Only of forests with wood on the ground.
        if let Some(wood) = files.get("sequences/00/deadwood.csv") {
            self.put("deadwood", name, head(wood, "deadwood"))?;
        }
        let mut kitti = vec![1];
        kitti.extend_from_slice(head(&files["sequences/00/poses.txt"], "poses"));
        self.put("robot_poses", name, &kitti)?;
        self.state(name, &files["dataset.json"])
    }

    fn picture(
        &self,
        target: &str,
        path: &str,
        name: &str,
        kind: u8,
        (width, height): (u32, u32),
        bytes: &[u8],
    ) -> Result<(), Box<dyn Error>> {
        let folder = path.rsplit('/').nth(1).unwrap_or("");
        let side = |pixels: u32| u8::try_from(pixels.max(1) - 1);
        let mut input = vec![kind, side(width)?, side(height)?];
        input.extend_from_slice(bytes);
        self.put(target, &format!("{name}-{folder}"), &input)
    }

    /// Makes a seed of the state that a data set had before it was finished.
    fn state(&self, name: &str, manifest: &[u8]) -> Result<(), Box<dyn Error>> {
        let mut header: Value = serde_json::from_slice(manifest)?;
        let frames = header["frames"].take();
        let version = nemoral_dataset::FORMAT_VERSION;
        let state = serde_json::json!({ "format_version": version, "header": header });
        let mut input = format!("0{state}");
        for frame in frames.as_array().into_iter().flatten().take(2) {
            input += &format!("\u{0}0{frame}");
        }
        self.put("state", name, input.as_bytes())
    }

    /// Makes seeds of configs, settings, species, patterns and poses.
    fn requests(&self) -> Result<(), Box<dyn Error>> {
        for preset in Preset::ALL {
            let name = preset.name;
            self.put("config", name, preset.config().to_toml().as_bytes())?;
        }
        let ranges = "preset = \"demo\"\n[ranges]\n\"placement.trees\" = [60, 140]\n\
                      [cameras.rear]\nyaw_deg = 180.0\n[lidars.side]\ndevice = \"vlp-16\"\n";
        self.put("config", "ranges", ranges.as_bytes())?;
        let vary = "sequences = 9\n[splits]\ntrain = 0.5\nval = 0.25\ntest = 0.25\n\
                    by = \"preset\"\n[vary]\npreset = { beech = 2, demo = 1 }\n\
                    camera.sky = [true, false]\n\
                    [[vary.group.a]]\nweight = 2\nsky.overcast = [0, 1]\n[[vary.group.a]]\n\
                    \"lidar.spinning\" = {}\n";
        self.put("config", "vary", vary.as_bytes())?;
        let settings = "demo\nseed=3\nframes=2\nsky.image=\"x.hdr\"\nrobot.spacing_m=0.5\n\
                        lidars.rear.device=vlp-16\ncamera.width_px=320\n\
                        ranges.\"placement.trees\"=[1, 2]";
        self.put("settings", "some", settings.as_bytes())?;
        for name in Species::names() {
            let text = Species::built_in_toml(name).ok_or("every species has its file")?;
            self.put("species", name, text.as_bytes())?;
        }
        let pattern = "time,azimuth,elevation,ring\n# three pulses\n0,0,0,0\n1e-5,10.5,-3,1\n\
            2e-5,-180,90,255\n";
        self.put("pattern", "rings", pattern.as_bytes())?;
        self.put("pattern", "bare", b"5,1,1\n6,2,2\n6,3,3\n")?;
        let tum = "\u{0}# t x y z qx qy qz qw\n0.5 1 2 3 0 0 0.6 0.8\n1 2 2 3 0 0 0 1\n";
        self.put("robot_poses", "tum", tum.as_bytes())?;
        let imu = "#timestamp [ns]\n0,0.1,0,0,0,0,9.8\n5000000,0,0,0.1,0,0,9.8\n\0#timestamp\n\
                   0,1,2,3,1,0,0,0,0.5,0,0,0,0,0,0,0,0\n\
                   5000000,1,2,3,0.6,0,0,0.8,0.5,0,0,0,0,0,0,0,0\n";
        self.put("imu", "two", imu.as_bytes())
    }

    /// Makes seeds of the files of a site, from the example's and in other forms.
    fn sites(&self) -> Result<(), Box<dyn Error>> {
        let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/site");
        self.put("stem_map", "example", &fs::read(example.join("stems.csv"))?)?;
        let semicolons = "X;Y;Species;DBH_cm;Height;alive\n1;2;beech;31,5;24,5;1\n-3,5;0;;;;no\n";
        self.put("stem_map", "semicolons", semicolons.as_bytes())?;
        self.put(
            "trail_lines",
            "example",
            &fs::read(example.join("trails.geojson"))?,
        )?;
        let table = "trail,x_m,y_m\na,1,2\na,30,4\nb,5,6\nb,70,8\n";
        self.put("trail_lines", "table", table.as_bytes())?;
        self.put(
            "geotiff",
            "example",
            &fs::read(example.join("terrain.tif"))?,
        )?;
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("heights.png");
        let code = |x: u32, y: u32| image::Luma([(1000 * x + 9000 * y) as u16]);
        image::ImageBuffer::from_fn(6, 4, code).save(&path)?;
        let mut png = b"{\"origin_m\":[0,0],\"metres_per_pixel\":1,\"min_height_m\":0,\
            \"max_height_m\":20}\n"
            .to_vec();
        png.extend(fs::read(&path)?);
        self.put("height_png", "grey", &png)
    }

    /// Makes seeds of models: one tree in all formats.
    fn models(&self) -> Result<(), Box<dyn Error>> {
        self.put("gltf", "binary", &models::tree_glb())?;
        self.put("gltf", "text", &models::tree_gltf())?;
        let obj = models::tree_obj();
        self.put("obj", "bare", &obj)?;
        let sidecar = "up = \"y\"\nmetres_per_unit = 1\n[semantics]\n\"*_Bark\" = \"stem\"\n";
        let files = models::gathered("tree.obj", obj, sidecar, models::beside_obj)?;
        self.put("obj", "archive", &files.to_tar()?)
    }

    /// Makes seeds of both formats of skies.
    fn skies(&self) -> Result<(), Box<dyn Error>> {
        let folder = tempfile::tempdir()?;
        let pixel = |x: u32, y: u32| image::Rgb([x as f32, 1.0, 0.5 * y as f32]);
        let pixels = image::Rgb32FImage::from_fn(16, 8, pixel);
        for name in ["sky.hdr", "sky.exr"] {
            let path = folder.path().join(name);
            pixels.save(&path)?;
            self.put("sky", name, &fs::read(&path)?)?;
        }
        Ok(())
    }

    /// Makes seeds of instructions for two shards, one of each kind.
    fn merges(&self) -> Result<(), Box<dyn Error>> {
        self.put("merge", "untouched", &[0])?;
        self.put("merge", "everything", &[0xff])?;
        for operation in 0..14_u8 {
            for file in [0_u8, 5, 12] {
                let name = format!("{operation:02}-{file:02}");
                let edit = [3, operation & 1, operation, file, 0, 5, 1, 2, 3, 4];
                self.put("merge", &name, &edit)?;
            }
        }
        Ok(())
    }
}

/// The first lines of a table; other files are left whole.
fn head<'a>(bytes: &'a [u8], target: &str) -> &'a [u8] {
    if ["manifest", "config"].contains(&target) {
        return bytes;
    }
    let ends = bytes.iter().enumerate().filter(|(_, b)| **b == b'\n');
    let end = ends.map(|(at, _)| at + 1).nth(7).unwrap_or(bytes.len());
    &bytes[..end]
}
