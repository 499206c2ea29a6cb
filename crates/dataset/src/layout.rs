//! The layout of a data set's folder.

use nemoral_files::InnerPath;

use crate::{CameraFile, DatasetHeader, header, limits};

pub(crate) const MANIFEST: &str = "dataset.json";
/// Present while a data set is unfinished: the header, a record for each frame, a lock.
pub(crate) const STATE: &str = ".nemoral";
pub(crate) const STATE_HEADER: &str = ".nemoral/header.json";
pub(crate) const STATE_LOCK: &str = ".nemoral/lock";
pub(crate) const STATE_FRAMES: &str = ".nemoral/frames";
pub(crate) const README: &str = "README.md";
pub(crate) const CONFIG: &str = "config.toml";
pub(crate) const ONTOLOGY: &str = "ontology.yaml";
pub(crate) const TREES: &str = "trees.csv";
pub(crate) const INSTANCES: &str = "instances.csv";
/// The files at the top, except `dataset.json`.
pub(crate) const TOP_FILES: [&str; 5] = [README, CONFIG, ONTOLOGY, TREES, INSTANCES];
pub(crate) const SEQUENCES: &str = "sequences";
/// The folder of KITTI's odometry benchmark for all sequences' poses.
pub(crate) const ALL_POSES: &str = "poses";
pub(crate) const POSES: &str = "poses.txt";
pub(crate) const CALIB: &str = "calib.txt";
pub(crate) const TIMES: &str = "times.txt";

/// The folders of one LiDAR, below the sequence's.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct LidarFolders {
    pub(crate) velodyne: String,
    pub(crate) labels: String,
    pub(crate) points: String,
}

/// The folder below the sequence in which the `i`-th camera writes one of its files; those of the
/// first camera are SemanticKITTI's.
pub(crate) fn camera_folder(header: &DatasetHeader, i: usize, file: CameraFile) -> String {
    let name = &header.cameras[i].name;
    if i > 0 && name == header::RIGHT && file == CameraFile::Rgb {
        return "image_3".to_owned();
    }
    format!("{}{}", prefix(i, name), file.folder())
}

/// The folders of the `i`-th LiDAR; those of the first one are SemanticKITTI's.
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
        let asked = (CameraFile::ALL.into_iter()).filter(|file| file.is_asked(header, i));
        all.extend(asked.map(|file| (camera_folder(header, i, file), file.extension(header))));
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
    format!("{STATE_FRAMES}/{sequence_number:02}-{index:06}.json")
}

/// The sequence and index of a frame's record, by its name.
pub(crate) fn frame_of_record(name: &str) -> Option<(u32, u64)> {
    let (sequence, index) = name.strip_suffix(".json")?.split_once('-')?;
    let at = (sequence.parse().ok()?, index.parse().ok()?);
    // A frame has only one valid name.
    (frame_record(at.0, at.1).rsplit('/').next() == Some(name)).then_some(at)
}

/// Whether this is the name of a frame's file.
pub(crate) fn is_frame_file(name: &str, extension: &str) -> bool {
    name.split_once('.')
        .is_some_and(|(stem, e)| is_number(stem, 6) && e == extension)
}

/// Whether this is the name of a sequence's folder.
pub(crate) fn is_sequence_name(name: &str) -> bool {
    is_number(name, 2)
}

fn is_number(text: &str, least_digits: usize) -> bool {
    (least_digits..=20).contains(&text.len()) && text.bytes().all(|b| b.is_ascii_digit())
}

/// A name of the layout as a path. Sensors' names have been checked, so it cannot fail.
pub(crate) fn inner(path: &str) -> InnerPath {
    InnerPath::new(path).expect("the layout's names are plain")
}

/// One file of the `i`-th camera for a frame, given by its sequence and index.
pub(crate) fn camera_file(
    header: &DatasetHeader,
    (number, index): (u32, u64),
    i: usize,
    file: CameraFile,
) -> String {
    let folder = camera_folder(header, i, file);
    frame_file(number, &folder, index, file.extension(header))
}

/// Every file of a frame, by path, with the most bytes that it may have.
pub(crate) fn frame_files(
    header: &DatasetHeader,
    number: u32,
    index: u64,
) -> Vec<(InnerPath, u64)> {
    let path = |folder: &str, extension| inner(&frame_file(number, folder, index, extension));
    let mut files = Vec::new();
    for (i, camera) in header.cameras.iter().enumerate() {
        let asked = (CameraFile::ALL.into_iter()).filter(|file| file.is_asked(header, i));
        files.extend(asked.map(|file| {
            let limit = file.max_bytes(header, &camera.intrinsics);
            (inner(&camera_file(header, (number, index), i, file)), limit)
        }));
    }
    for (i, lidar) in header.lidars.iter().enumerate() {
        let f = lidar_folders(header, i);
        files.push((path(&f.velodyne, "bin"), limits::scan_bytes(16)));
        files.push((path(&f.labels, "label"), limits::scan_bytes(4)));
        if lidar.ply {
            files.push((path(&f.points, "ply"), limits::scan_bytes(67)));
        }
    }
    files.sort();
    files
}

/// Every file that belongs to no frame, by path, with the most bytes that it may have. Sequences
/// are given by their numbers and lengths.
pub(crate) fn common_files(
    header: &DatasetHeader,
    sequences: impl IntoIterator<Item = (u32, u64)>,
) -> Vec<(InnerPath, u64)> {
    let mut files = vec![
        (inner(README), limits::TEXT_BYTES),
        (inner(CONFIG), limits::TEXT_BYTES),
        (inner(ONTOLOGY), limits::TEXT_BYTES),
        (inner(TREES), limits::TABLE_BYTES),
        (inner(INSTANCES), limits::TABLE_BYTES),
    ];
    for (number, length) in sequences {
        let path = |name| inner(&sequence_file(number, name));
        files.push((path(POSES), limits::lines_bytes(length)));
        files.push((inner(&kitti_poses(number)), limits::lines_bytes(length)));
        files.push((path(TIMES), limits::lines_bytes(length)));
        files.push((path(CALIB), limits::calibration_bytes(header.cameras.len())));
    }
    files.sort();
    files
}

/// `poses/NN.txt`, where readers of KITTI's odometry benchmark look for a sequence's `poses.txt`.
pub(crate) fn kitti_poses(number: u32) -> String {
    format!("{ALL_POSES}/{number:02}.txt")
}

/// Whether this is the name of a file of `poses`.
pub(crate) fn is_kitti_poses(name: &str) -> bool {
    name.strip_suffix(".txt").is_some_and(is_sequence_name)
}

/// `sequences/NN/NAME`.
pub(crate) fn sequence_file(number: u32, name: &str) -> String {
    format!("{}/{name}", sequence(number))
}
