//! `README.md`: the data card.

use nemoral_scene::AnnotationKinds;

use crate::{Manifest, Split};

/// The card of a data set.
pub(crate) fn encode(manifest: &Manifest) -> String {
    let h = &manifest.header;
    let frames = manifest.frames.len();
    let of: u64 = manifest.tracks.iter().map(|t| t.length).sum();
    // Cameras and LiDARs of different sequences that are described alike are listed once.
    let cameras = || h.sequences.iter().flat_map(|s| &s.cameras);
    let lidars = || h.sequences.iter().flat_map(|s| &s.lidars);
    let list = |all: &mut dyn Iterator<Item = String>| {
        let mut names: Vec<String> = Vec::new();
        for name in all {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        if names.is_empty() {
            "none".to_owned()
        } else {
            names.join(", ")
        }
    };
    let camera_list = list(&mut cameras().map(|c| {
        let k = &c.intrinsics;
        format!("{} ({} × {})", c.name, k.width, k.height)
    }));
    let lidar_list = list(&mut lidars().map(|l| l.name.clone()));
    let classes: Vec<String> = h
        .ontology
        .classes()
        .iter()
        .map(|c| format!("{} {}", c.id, c.name))
        .collect();
    let depth = match h.sequences[0].depth_format {
        crate::DepthFormat::Png16 => {
            "16-bit PNG, metres × 256; 0 = nothing there, 65535 = 255.996 m or more"
        }
        crate::DepthFormat::Npy => "NumPy float32, metres; 0 = nothing there",
    };
    let all = |asked: fn(&AnnotationKinds) -> bool| cameras().any(|c| asked(&c.annotations));
    let further: String = [
        (
            all(|e| e.sky),
            "| `sequences/NN/sky/*.png` | 255 where nothing was hit, else 0 |\n",
        ),
        (
            all(|e| e.flow),
            "| `sequences/NN/flow/*.png` | optical flow to the next frame, KITTI's: 16-bit RGB, u \
             and v × 64 + 32768; blue 0 = none, 1 = seen in the next frame, 2 = hidden or outside \
             there; exact, the world stands still |\n",
        ),
        (
            all(|e| e.trunks),
            "| `sequences/NN/trunks/*.png` | as `instance`: the nearest trunk if all but trunks \
             and the ground is taken away |\n",
        ),
        (
            all(|e| e.boxes),
            "| `sequences/NN/boxes/*.csv` | things with an id: half-open boxes around their \
             visible pixels and around those of the thing alone on the ground, the counts of both \
             and their ratio; an upright box in space: its middle in the camera's frame, length, \
             width, height, rotation (x, y, z, w) of the camera's axes from the box's |\n",
        ),
        (
            all(|e| e.radiance),
            "| `sequences/NN/radiance/*.exr` | OpenEXR, 32-bit floats: the light behind the lens, \
             before exposure and sensor; linear sRGB, scaled so that luminance is in cd/m² |\n",
        ),
    ]
    .iter()
    .filter(|(asked, _)| *asked)
    .map(|(_, row)| *row)
    .collect();
    let rolling = if cameras().any(|c| c.shutter.readout_s > 0.0) {
        "
A camera with a `shutter` in `dataset.json` reads its rows one after the other: \
row r of H is exposed
readout_s · ((r + 0.5) / H - 0.5) after the frame's time, \
and its truth is that of this moment, depth and
normals in the camera's frame as it is then. The body moves by the frame's `body_motion`.
"
    } else {
        ""
    };
    let balanced = manifest.tracks.iter().filter_map(|t| t.balance.as_ref());
    let mut wanted: Vec<&str> = balanced
        .flat_map(|b| b.targets.iter().map(|t| &*t.name))
        .collect();
    wanted.sort_unstable();
    wanted.dedup();
    let balanced = if wanted.is_empty() {
        String::new()
    } else {
        format!(
            "
## Balance

Frames are single views, chosen among candidates beside the path so that more of them show \
{}.
They are no drive: poses jump from frame to frame. In `dataset.json`, `balance` of a track has the \
shares
before, the goals and the weights; `balance` of a frame, which candidate it is and what it shows.
",
            wanted.join(", ")
        )
    };
    let moment = if lidars().all(|l| l.deskewed) {
        "deskewed to the frame's time"
    } else {
        "deskewed to the frame's time, or as it was at each pulse's (`deskewed` in `dataset.json`)"
    };
    format!(
        "\
---
license: {licence}
tags: [synthetic, forest, lidar, semantic-segmentation, depth-estimation]
---
# A virtual forest, recorded

{frames} of {of} frames in {sequences}. Made by {generator} {version}, seed {seed}, \
backend {backend}; `config.toml` is the whole
request and `nemoral generate config.toml` makes it again. The data belong to whoever made them.

- Cameras: {camera_list}
- LiDARs: {lidar_list}
- Classes (`{ontology}`): {classes}

| file | what it holds |
|---|---|
| `sequences/NN/image_2/*.png` | 8-bit sRGB |
| `sequences/NN/semantic/*.png` | palette PNG: class ids when read, class colours when looked at |
| `sequences/NN/instance/*.png` | id = R + 256 G + 65536 B, `image_id` in `instances.csv`; \
0 = ground, undergrowth, sky |
| `sequences/NN/depth/*` | planar depth (z of the camera): {depth} |
| `sequences/NN/normals/*.png` | camera frame, channel = round(127.5 (n + 1)); \
(0, 0, 0) = nothing there |
{further}| `sequences/NN/velodyne/*.bin` | float32 x, y, z, intensity; LiDAR frame, {moment} |
| `sequences/NN/labels/*.label` | uint32: class in the lower 16 bits, instance (`label_id`, \
within 2 chunks, at most 32,750) in the upper 16 |
| `sequences/NN/points/*.ply` | every field of every point: true range, true id, ring, return, \
`t` in seconds after the frame's time (that of `times.txt` and `poses.txt`), normal, flags |
| `sequences/NN/poses.txt` | line k: frame k of the whole drive, {posed}, \
relative to frame 0 (KITTI); `poses/NN.txt` is a copy |
{estimated}\
| `sequences/NN/calib.txt` | P0 to P3 (the first camera's; P3 is `right`'s if there is one) and \
Tr, LiDAR to first camera (KITTI); P_NAME and Tr_NAME of further cameras: \
pixels from the first camera's frame, first LiDAR to camera; Tr_NAME of further LiDARs: LiDAR to \
first camera; D2, D_NAME (OpenCV's k1 k2 p1 p2 k3) or F2, \
F_NAME (its fisheye's k1 to k4) where a lens distorts |
| `sequences/NN/times.txt` | seconds |
{imu}| `sequences/NN/trees.csv`, `instances.csv` | the inventory: positions in the sequence's \
world, sizes, species |
| `sequences/NN/config.toml` | every key of the sequence, with what was drawn for it |
| `ontology.yaml` | the class table in SemanticKITTI's form |
| `dataset.json` | versions, seed, configuration, keys, mounts, frames, sizes, BLAKE3 checksums |

Metres. World: x east, y north, z up; LiDAR: x forward, y left, z up; camera: x right, y down, \
z forward.
Projected with P2, a point is in column floor(u) and row floor(v): \
the first pixel's centre is at (0.5, 0.5).
Further cameras and LiDARs have the same folders inside a folder of their name, but \
the pictures of a further camera
called `right` are in `image_3`. Truth images hold what is
exactly at the pixel's centre; nothing in them is blended.
{placed}{rolling}{balanced}",
        estimated = if h.sequences.iter().any(|s| s.has_estimated_poses) {
            "| `sequences/NN/poses_estimated.txt` | the same as a navigation system estimates it, \
             with its errors, relative to the true pose of frame 0 (KITTI) |\n"
        } else {
            ""
        },
        imu = if h.sequences.iter().any(|s| s.imu.is_some()) {
            "| `sequences/NN/imu0/data.csv` | angular rates and specific forces, with the errors \
             that `imu0/sensor.yaml` describes; nanoseconds of `times.txt` (EuRoC) |\n\
             | `sequences/NN/state_groundtruth_estimate0/data.csv` | the unit's true pose and \
             velocity in the sequence's world, and its biases (EuRoC) |\n"
        } else {
            ""
        },
        placed = placed(manifest),
        rolling = rolling,
        balanced = balanced,
        sequences = sequences(manifest),
        posed = if cameras().next().is_none() {
            "reference LiDAR"
        } else {
            "reference camera"
        },
        licence = serde_json::to_string(&h.licence).expect("a string is JSON"),
        generator = h.generator,
        version = h.version,
        seed = h.seed,
        backend = h.backend,
        ontology = h.ontology.name(),
        classes = classes.join(", "),
    )
}

/// Where the worlds lie that are not invented.
fn placed(manifest: &Manifest) -> String {
    let sites = manifest.header.sequences.iter().filter_map(|s| s.site);
    let mut systems: Vec<String> = sites
        .map(|site| match site.epsg {
            Some(code) => format!("EPSG:{code}"),
            None => "those of its files".to_owned(),
        })
        .collect();
    systems.sort_unstable();
    systems.dedup();
    if systems.is_empty() {
        return String::new();
    }
    format!(
        "
The world lies on a site: coordinates there ({}) are those of the world plus `origin_m` of \
`site`,
which the sequence has in `dataset.json`.
",
        systems.join(", ")
    )
}

/// How many sequences there are, and of which splits.
fn sequences(manifest: &Manifest) -> String {
    let count = match manifest.tracks.len() {
        1 => "1 sequence".to_owned(),
        n => format!("{n} sequences, each of a world of its own"),
    };
    let numbers = |split: Split| manifest.header.numbers(Some(split));
    let of_splits: Vec<String> = (Split::ALL.into_iter())
        .map(|split| (split, numbers(split)))
        .filter(|(_, numbers)| !numbers.is_empty())
        .map(|(split, numbers)| {
            let numbers: Vec<String> = numbers.iter().map(|n| format!("{n:02}")).collect();
            format!("{split}: {}", numbers.join(" "))
        })
        .collect();
    if of_splits.is_empty() {
        return count;
    }
    format!("{count} ({})", of_splits.join("; "))
}
