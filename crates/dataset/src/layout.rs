//! Where things lie in a data set's folder.

use crate::{CameraFile, DatasetHeader, DepthFormat, Error};

pub(crate) const MANIFEST: &str = "dataset.json";
/// Present while a data set is unfinished: the header, a record for each frame, a lock.
pub(crate) const STATE: &str = ".nemoral";
pub(crate) const README: &str = "README.md";
pub(crate) const CONFIG: &str = "config.toml";
pub(crate) const ONTOLOGY: &str = "ontology.yaml";
pub(crate) const TREES: &str = "trees.csv";
pub(crate) const INSTANCES: &str = "instances.csv";
pub(crate) const SEQUENCES: &str = "sequences";
pub(crate) const POSES: &str = "poses.txt";
pub(crate) const CALIB: &str = "calib.txt";
pub(crate) const TIMES: &str = "times.txt";

/// The folders of one camera, below the sequence's.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct CameraFolders {
    pub(crate) rgb: String,
    pub(crate) semantic: String,
    pub(crate) instance: String,
    pub(crate) depth: String,
    pub(crate) normals: String,
    pub(crate) sky: String,
    pub(crate) flow: String,
    pub(crate) trunks: String,
    pub(crate) boxes: String,
    pub(crate) radiance: String,
}

/// The folders of one LiDAR, below the sequence's.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct LidarFolders {
    pub(crate) velodyne: String,
    pub(crate) labels: String,
    pub(crate) points: String,
}

/// The further camera that is KITTI's right eye: its pictures are `image_3`, its projection is `P3`.
pub(crate) const RIGHT: &str = "right";

/// The `i`-th camera's folders: the first one's are SemanticKITTI's.
pub(crate) fn camera_folders(header: &DatasetHeader, i: usize) -> CameraFolders {
    let name = &header.cameras[i].name;
    let prefix = prefix(i, name);
    CameraFolders {
        rgb: if i > 0 && name == RIGHT {
            "image_3".to_owned()
        } else {
            format!("{prefix}image_2")
        },
        semantic: format!("{prefix}semantic"),
        instance: format!("{prefix}instance"),
        depth: format!("{prefix}depth"),
        normals: format!("{prefix}normals"),
        sky: format!("{prefix}sky"),
        flow: format!("{prefix}flow"),
        trunks: format!("{prefix}trunks"),
        boxes: format!("{prefix}boxes"),
        radiance: format!("{prefix}radiance"),
    }
}

/// The `i`-th LiDAR's folders: the first one's are SemanticKITTI's.
pub(crate) fn lidar_folders(header: &DatasetHeader, i: usize) -> LidarFolders {
    let prefix = prefix(i, &header.lidars[i].name);
    LidarFolders {
        velodyne: format!("{prefix}velodyne"),
        labels: format!("{prefix}labels"),
        points: format!("{prefix}points"),
    }
}

fn prefix(i: usize, name: &str) -> String {
    if i == 0 {
        String::new()
    } else {
        format!("{name}/")
    }
}

/// Every folder of a sequence with the extension of its files.
pub(crate) fn sensor_folders(header: &DatasetHeader) -> Vec<(String, &'static str)> {
    let mut all = Vec::new();
    for i in 0..header.cameras.len() {
        let f = camera_folders(header, i);
        let asked = (CameraFile::ALL.into_iter()).filter(|file| file.is_asked(header, i));
        all.extend(asked.map(|file| (file.folder(&f).to_owned(), file.extension(header))));
    }
    for i in 0..header.lidars.len() {
        let f = lidar_folders(header, i);
        all.extend([(f.velodyne, "bin"), (f.labels, "label")]);
        if header.lidars[i].ply {
            all.push((f.points, "ply"));
        }
    }
    all
}

pub(crate) const fn depth_extension(format: DepthFormat) -> &'static str {
    match format {
        DepthFormat::Png16 => "png",
        DepthFormat::Npy => "npy",
    }
}

/// `sequences/NN`.
pub(crate) fn sequence(number: u32) -> String {
    format!("{SEQUENCES}/{number:02}")
}

/// `sequences/NN/FOLDER/IIIIII.EXT`.
pub(crate) fn frame_file(sequence_number: u32, folder: &str, index: u64, ext: &str) -> String {
    format!("{}/{folder}/{index:06}.{ext}", sequence(sequence_number))
}

/// `.nemoral/frames/NN-IIIIII.json`.
pub(crate) fn frame_record(sequence_number: u32, index: u64) -> String {
    format!("{STATE}/frames/{sequence_number:02}-{index:06}.json")
}

/// Names that could be mistaken for a folder of the layout, or that file systems dislike, are refused.
pub(crate) fn check_sensor_name(name: &str) -> Result<(), Error> {
    const RESERVED: [&str; 14] = [
        "image_2", "image_3", "semantic", "instance", "depth", "normals", "sky", "flow", "trunks",
        "boxes", "radiance", "velodyne", "labels", "points",
    ];
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_' || c == '-';
    if name.is_empty() || name.len() > 64 || !name.chars().all(plain) || RESERVED.contains(&name) {
        return Err(Error::invalid(
            "sensor name",
            format!("'{name}'"),
            "1 to 64 of a-z, 0-9, '_' and '-', and none of the layout's own folders",
        ));
    }
    Ok(())
}
