//! The layout of a data set's folder.

use nemoral_files::InnerPath;

use crate::{CameraFile, DatasetHeader, FileRecord, PlyPoint, SequenceSpec, header, limits};

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
pub(crate) const DEADWOOD: &str = "deadwood.csv";
/// The files at the top, except `dataset.json`.
pub(crate) const TOP_FILES: [&str; 3] = [README, CONFIG, ONTOLOGY];
/// The folder of the files that the configuration names.
pub(crate) const INPUTS: &str = "inputs";
/// How many digits of its checksum a file's name begins with there.
const INPUT_DIGITS: usize = 16;
/// The most bytes of a file's own name there.
const INPUT_NAME_BYTES: usize = 80;
pub(crate) const SEQUENCES: &str = "sequences";
/// The folder of KITTI's odometry benchmark for all sequences' poses.
pub(crate) const ALL_POSES: &str = "poses";
pub(crate) const POSES: &str = "poses.txt";
/// What a navigation system estimates of the poses.
pub(crate) const ESTIMATED_POSES: &str = "poses_estimated.txt";
pub(crate) const CALIB: &str = "calib.txt";
pub(crate) const TIMES: &str = "times.txt";
/// The files of a sequence's inertial measurement unit, where the EuRoC MAV data set has them:
/// samples, description, true states.
pub(crate) const IMU_FILES: [&str; 3] = [
    "imu0/data.csv",
    "imu0/sensor.yaml",
    "state_groundtruth_estimate0/data.csv",
];
/// The files of a sequence that belong to no frame, besides [`IMU_FILES`].
pub(crate) const SEQUENCE_FILES: [&str; 8] = [
    CALIB,
    CONFIG,
    DEADWOOD,
    ESTIMATED_POSES,
    INSTANCES,
    POSES,
    TIMES,
    TREES,
];

/// The folders of one LiDAR, below the sequence's.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct LidarFolders {
    pub(crate) velodyne: String,
    pub(crate) labels: String,
    pub(crate) points: String,
}

/// The folder below the sequence in which the `i`-th camera writes one of its files; those of the
/// first camera are SemanticKITTI's.
pub(crate) fn camera_folder(sequence: &SequenceSpec, i: usize, file: CameraFile) -> String {
    let name = &sequence.cameras[i].name;
    if i > 0 && name == header::RIGHT && file == CameraFile::Rgb {
        return "image_3".to_owned();
    }
    format!("{}{}", prefix(i, name), file.folder())
}

/// The folders of the `i`-th LiDAR; those of the first one are SemanticKITTI's.
pub(crate) fn lidar_folders(sequence: &SequenceSpec, i: usize) -> LidarFolders {
    let prefix = prefix(i, &sequence.lidars[i].name);
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
pub(crate) fn sensor_folders(sequence: &SequenceSpec) -> Vec<(String, &'static str)> {
    let mut all = Vec::new();
    for i in 0..sequence.cameras.len() {
        let asked = (CameraFile::ALL.into_iter()).filter(|file| file.is_asked(sequence, i));
        all.extend(asked.map(|f| (camera_folder(sequence, i, f), f.extension(sequence))));
    }
    for i in 0..sequence.lidars.len() {
        let f = lidar_folders(sequence, i);
        all.extend([(f.velodyne, "bin"), (f.labels, "label")]);
        if sequence.lidars[i].ply {
            all.push((f.points, "ply"));
        }
    }
    all
}

/// `sequences/NN`.
pub(crate) fn sequence_folder(number: u32) -> String {
    format!("{SEQUENCES}/{number:02}")
}

/// `sequences/NN/FOLDER/IIIIII.EXT`.
pub(crate) fn frame_file(sequence_number: u32, folder: &str, index: u64, ext: &str) -> String {
    format!(
        "{}/{folder}/{index:06}.{ext}",
        sequence_folder(sequence_number)
    )
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

/// The number of a sequence, by the name of its folder.
pub(crate) fn sequence_of_name(name: &str) -> Option<u32> {
    let number = name.parse().ok()?;
    // A sequence has only one valid name.
    (format!("{number:02}") == name).then_some(number)
}

fn is_number(text: &str, least_digits: usize) -> bool {
    (least_digits..=20).contains(&text.len()) && text.bytes().all(|b| b.is_ascii_digit())
}

/// A name of the layout as a path. Sensors' names have been checked, so it cannot fail.
pub(crate) fn inner(path: &str) -> InnerPath {
    InnerPath::new(path).expect("the layout's names are plain")
}

/// One file of the `i`-th camera for a frame.
pub(crate) fn camera_file(
    sequence: &SequenceSpec,
    index: u64,
    i: usize,
    file: CameraFile,
) -> String {
    let folder = camera_folder(sequence, i, file);
    frame_file(sequence.number, &folder, index, file.extension(sequence))
}

/// Every file of a frame, by path, with the most bytes that it may have.
pub(crate) fn frame_files(sequence: &SequenceSpec, index: u64) -> Vec<(InnerPath, u64)> {
    let number = sequence.number;
    let path = |folder: &str, extension| inner(&frame_file(number, folder, index, extension));
    let mut files = Vec::new();
    for (i, camera) in sequence.cameras.iter().enumerate() {
        let asked = (CameraFile::ALL.into_iter()).filter(|file| file.is_asked(sequence, i));
        files.extend(asked.map(|file| {
            let limit = file.max_bytes(sequence, &camera.intrinsics);
            (inner(&camera_file(sequence, index, i, file)), limit)
        }));
    }
    for (i, lidar) in sequence.lidars.iter().enumerate() {
        let f = lidar_folders(sequence, i);
        files.push((path(&f.velodyne, "bin"), limits::scan_bytes(16)));
        files.push((path(&f.labels, "label"), limits::scan_bytes(4)));
        if lidar.ply {
            let bytes_per_point = PlyPoint::BYTES as u64;
            files.push((path(&f.points, "ply"), limits::scan_bytes(bytes_per_point)));
        }
    }
    files.sort();
    files
}

/// The place in a data set of a file that a configuration names: `inputs/DIGEST-NAME`, where
/// DIGEST begins the BLAKE3 of its content and NAME is its own name, in plain characters. So the
/// place does not depend on where the file lay, nor on the data set's other files. A file that has
/// such a name already keeps it.
#[must_use]
pub fn input_path(name: &str, content: &[u8]) -> InnerPath {
    let digest = blake3::hash(content).to_hex();
    let digest = &digest[..INPUT_DIGITS];
    let own = name.strip_prefix(digest).and_then(|n| n.strip_prefix('-'));
    let plain = |c: char| {
        if c.is_ascii_alphanumeric() || matches!(c, '.' | '_' | '-') {
            c
        } else {
            '_'
        }
    };
    let own: String = own.unwrap_or(name).chars().map(plain).collect();
    // The end has the extension.
    let own = &own[own.len().saturating_sub(INPUT_NAME_BYTES)..];
    let own = own.trim_end_matches('.');
    inner(&format!("{INPUTS}/{digest}-{own}"))
}

/// Whether a record is that of a file which a configuration names.
pub(crate) fn is_input(file: &FileRecord) -> bool {
    let name = file.path.file_name();
    file.path.parent().is_some_and(|p| p.as_str() == INPUTS)
        && (file.blake3.get(..INPUT_DIGITS)).is_some_and(|d| name.starts_with(&format!("{d}-")))
}

/// Every file that belongs to no frame, by path, with the most bytes that it may have. Sequences
/// are given with their lengths.
pub(crate) fn common_files<'a>(
    header: &DatasetHeader,
    sequences: impl IntoIterator<Item = (&'a SequenceSpec, u64)>,
) -> Vec<(InnerPath, u64)> {
    let most_bytes = |name: &str| match name {
        CONFIG => limits::CONFIG_BYTES,
        _ => limits::TEXT_BYTES,
    };
    let mut files: Vec<_> = TOP_FILES.map(|f| (inner(f), most_bytes(f))).into();
    let inputs = header.inputs().into_keys();
    files.extend(inputs.map(|path| (path.clone(), limits::INPUT_BYTES)));
    for (sequence, length) in sequences {
        let path = |name| inner(&sequence_file(sequence.number, name));
        let poses = limits::lines_bytes(length);
        let sensors = sequence.cameras.len() + sequence.lidars.len();
        files.extend([
            (path(POSES), poses),
            (inner(&kitti_poses(sequence.number)), poses),
            (path(TIMES), poses),
            (path(CALIB), limits::calibration_bytes(sensors)),
            (path(CONFIG), limits::CONFIG_BYTES),
            (path(TREES), limits::TABLE_BYTES),
            (path(INSTANCES), limits::TABLE_BYTES),
        ]);
        if sequence.has_estimated_poses {
            files.push((path(ESTIMATED_POSES), poses));
        }
        if sequence.has_deadwood {
            files.push((path(DEADWOOD), limits::TABLE_BYTES));
        }
        if sequence.imu.is_some() {
            let [samples, sensor, states] = IMU_FILES;
            files.extend([
                (path(samples), limits::TABLE_BYTES),
                (path(sensor), limits::TEXT_BYTES),
                (path(states), limits::TABLE_BYTES),
            ]);
        }
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
    name.strip_suffix(".txt").is_some_and(|n| is_number(n, 2))
}

/// `sequences/NN/NAME`.
pub(crate) fn sequence_file(number: u32, name: &str) -> String {
    format!("{}/{name}", sequence_folder(number))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inputs_are_named_by_their_content() {
        let path = input_path("my poses.txt", b"0 1 2\n");
        let digest = &blake3::hash(b"0 1 2\n").to_hex()[..16];
        assert_eq!(path.as_str(), format!("inputs/{digest}-my_poses.txt"));
        // A copy of a copy has the same name.
        assert_eq!(input_path(path.file_name(), b"0 1 2\n"), path);
        assert_ne!(input_path(path.file_name(), b"0 1 3\n"), path);
        let record = FileRecord::of(path.clone(), b"0 1 2\n");
        assert!(is_input(&record));
        assert!(!is_input(&FileRecord::of(path, b"0 1 3\n")));
        for other in ["config.toml", "inputs/a/b.csv", "inputs/spiral.csv"] {
            assert!(!is_input(&FileRecord::of(inner(other), b"x")), "{other}");
        }
        // Whatever the name is, the path is one of the layout.
        for name in ["", "..", "a/b\\c:d", "Bäume…", &"x".repeat(500), "con."] {
            let path = input_path(name, b"x");
            assert!(is_input(&FileRecord::of(path, b"x")), "{name}");
        }
    }
}
