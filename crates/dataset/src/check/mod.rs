//! Checks whether a data set is right, from its files alone.

mod agreement;
mod annotations;
mod splits;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::Path;

use nemoral_files::InnerPath;
use nemoral_scene::{
    ChunkCoord, Distortion, ObjectId, ObjectKind, ObjectRecord, RigidTransform, Semantic,
    TreeRecord,
};

pub use self::agreement::{Agreement, ClassAgreement, JudgedAgreement, Residual};

use self::agreement::{ClassGroups, View};
use self::annotations::AnnotationView;
use self::splits::SplitTrees;
use crate::formats::{images, kitti, ontology_yaml};
use crate::{
    Calibration, CameraCalibration, CameraFile, Dataset, Error, FileRecord, Frame, FrameRecord,
    PlyPoint, TrackRecord, Watch, layout, output, reader,
};

/// Something wrong with a data set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// The file, below the data set's folder.
    pub path: String,
    /// What is wrong.
    pub message: String,
}

/// What [`check`] found.
#[derive(Clone, Debug, PartialEq)]
pub struct CheckReport {
    /// Everything wrong with files, ids and poses.
    pub problems: Vec<Problem>,
    /// Frames listed.
    pub frames: usize,
    /// Files listed.
    pub files: usize,
    /// Their size.
    pub bytes: u64,
    /// The agreement of LiDAR and camera.
    pub agreement: Agreement,
}

impl CheckReport {
    /// Whether the data set is right.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.problems.is_empty() && self.agreement.failures().is_empty()
    }
}

impl fmt::Display for CheckReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{} frames, {} files, {} bytes",
            self.frames, self.files, self.bytes
        )?;
        write!(f, "{}", self.agreement)?;
        for p in &self.problems {
            writeln!(f, "problem: {}: {}", p.path, p.message)?;
        }
        for failure in self.agreement.failures() {
            writeln!(f, "problem: agreement: {failure}")?;
        }
        writeln!(f, "{}", if self.passed() { "passed" } else { "FAILED" })
    }
}

/// Checks a data set from its files alone: structure, sizes, checksums; ids against
/// `instances.csv` and the class table; poses and calibration against `dataset.json`; that splits
/// have no seed and no tree in common; and the agreement of LiDAR and camera.
///
/// # Errors
/// If the folder holds no finished data set. Whatever is wrong with a finished one is in the
/// report.
pub fn check(dir: &Path) -> Result<CheckReport, Error> {
    check_watched(dir, &Watch::default())
}

/// As [`check`], with news of each frame.
///
/// # Errors
/// As [`check`], and [`Error::Stopped`].
pub fn check_watched(dir: &Path, watch: &Watch) -> Result<CheckReport, Error> {
    let dataset = Dataset::open(dir)?;
    let manifest = dataset.manifest();
    let files = || {
        let of_frames = manifest.frames.iter().flat_map(|f| &f.files);
        manifest.files.iter().chain(of_frames)
    };
    let mut checker = Checker {
        dataset: &dataset,
        watch,
        problems: Vec::new(),
        split_trees: SplitTrees::default(),
        class_groups: ClassGroups::of(&manifest.header.ontology),
        agreement: Agreement::new(
            &manifest.header.ontology,
            (manifest.header.sequences.iter())
                .flat_map(|s| &s.lidars)
                .all(crate::LidarSpec::well_placed),
        ),
    };
    if !dataset.is_untouched() {
        checker.problem(layout::MANIFEST, reader::CHANGED);
    }
    checker.strangers()?;
    for file in &manifest.files {
        checker.verified(std::slice::from_ref(file));
    }
    checker.ontology();
    for message in splits::common_sources(&manifest.header) {
        checker.problem(layout::MANIFEST, message);
    }
    for track in &manifest.tracks {
        let inventory = checker.inventory(track.sequence);
        if let Some(drive) = checker.drive(track) {
            checker.frames(track.sequence, &drive, &inventory)?;
        }
    }
    Ok(CheckReport {
        problems: checker.problems,
        frames: manifest.frames.len(),
        files: files().count(),
        bytes: files().map(|f| f.bytes).sum(),
        agreement: checker.agreement,
    })
}

/// The content of a sequence's poses, times and calibration.
struct Drive {
    poses: Vec<RigidTransform>,
    times: Vec<f64>,
    camera_from_lidar: RigidTransform,
}

/// The ids of a sequence's objects.
struct Inventory {
    true_ids: BTreeSet<ObjectId>,
    image_ids: BTreeSet<u32>,
}

struct Checker<'a> {
    dataset: &'a Dataset,
    watch: &'a Watch,
    problems: Vec<Problem>,
    split_trees: SplitTrees,
    class_groups: ClassGroups,
    agreement: Agreement,
}

impl Checker<'_> {
    fn problem(&mut self, path: impl ToString, message: impl ToString) {
        self.problems.push(Problem {
            path: path.to_string(),
            message: message.to_string(),
        });
    }

    /// Records a failed read as a problem, unless the checksum has shown it already.
    fn read<T>(&mut self, path: &str, result: Result<T, Error>) -> Option<T> {
        let has_told = self.problems.iter().any(|p| p.path == path);
        let mut problem = |e: Error| {
            if !has_told {
                self.problem(path, e.without_path());
            }
        };
        result.map_err(&mut problem).ok()
    }

    /// Looks for files that are not listed where only listed ones may be.
    fn strangers(&mut self) -> Result<(), Error> {
        let manifest = self.dataset.manifest();
        let listed: BTreeSet<&InnerPath> = manifest
            .files
            .iter()
            .chain(manifest.frames.iter().flat_map(|f| &f.files))
            .map(|f| &f.path)
            .collect();
        let folder = self.dataset.folder();
        for path in output::owned_files(folder, &manifest.header)? {
            if !listed.contains(&path) {
                self.problem(path, "belongs to no frame of dataset.json");
            }
        }
        if folder.kind(&layout::inner(layout::STATE))?.is_some() {
            self.problem(
                layout::STATE,
                "the data set is being written, or its writer was killed",
            );
        }
        Ok(())
    }

    /// Compares files with their records and reports those that differ.
    fn verified(&mut self, files: &[FileRecord]) -> bool {
        let mut sound = true;
        for file in files {
            if let Err(e) = file.read(self.dataset.folder()) {
                sound = false;
                self.problem(&file.path, e.without_path());
            }
        }
        sound
    }

    /// Checks `trees.csv`, `deadwood.csv` and `instances.csv` of a sequence.
    fn inventory(&mut self, sequence: u32) -> Inventory {
        let path = |name| layout::sequence_file(sequence, name);
        let (of_trees, of_objects) = (path(layout::TREES), path(layout::INSTANCES));
        let objects = self.dataset.objects(sequence);
        let objects = self.read(&of_objects, objects).unwrap_or_default();
        let trees = self.dataset.trees(sequence);
        let trees = self.read(&of_trees, trees).unwrap_or_default();
        let path = of_trees;
        let is_tree = |o: &&ObjectRecord| o.kind == ObjectKind::Tree;
        let of_objects: BTreeSet<_> = objects.iter().filter(is_tree).map(|o| o.object).collect();
        let of_trees: BTreeSet<_> = trees.iter().map(|t| t.object).collect();
        if let Some(id) = of_objects.symmetric_difference(&of_trees).next() {
            let message = format!(
                "{} trees here, {} in instances.csv; tree {} is in one of them only",
                of_trees.len(),
                of_objects.len(),
                id.to_u64()
            );
            self.problem(&path, message);
        }
        for tree in &trees {
            if let Some(message) = impossible(tree) {
                self.problem(&path, message);
            }
        }
        let header = &self.dataset.manifest().header;
        if let Some(message) = self.split_trees.add(header, sequence, &trees) {
            self.problem(&path, message);
        }
        self.deadwood(sequence, &objects);
        let true_ids: BTreeSet<ObjectId> = objects.iter().map(|o| o.object).collect();
        Inventory {
            image_ids: true_ids.iter().map(|id| id.to_image_id()).collect(),
            true_ids,
        }
    }

    /// Compares `deadwood.csv` with a sequence's objects.
    fn deadwood(&mut self, sequence: u32, objects: &[ObjectRecord]) {
        let path = layout::sequence_file(sequence, layout::DEADWOOD);
        let deadwood = self.dataset.deadwood(sequence);
        let Some(deadwood) = self.read(&path, deadwood) else {
            return;
        };
        let lies = |kind| matches!(kind, ObjectKind::Log | ObjectKind::RootPlate);
        let objects = objects.iter().filter(|o| lies(o.kind));
        let objects: BTreeSet<_> = objects.map(|o| (o.object, o.kind)).collect();
        let rows: BTreeSet<_> = deadwood.iter().map(|d| (d.object, d.kind)).collect();
        if let Some((id, kind)) = objects.symmetric_difference(&rows).next() {
            let message = format!(
                "{} rows, {} logs and root plates in instances.csv; {} {} is in one of them only",
                rows.len(),
                objects.len(),
                kind.name(),
                id.to_u64()
            );
            self.problem(&path, message);
        }
        for row in &deadwood {
            let [large, small] = row.diameter_m;
            let is_log = row.kind == ObjectKind::Log;
            let fine = row.length_m > 0.0
                && small > 0.0
                && large >= small
                && (0.0..360.0).contains(&row.azimuth_deg)
                && (row.volume_m3 > 0.0) == is_log;
            if !fine {
                let message = format!(
                    "{} {}: length_m = {}, diameters {large} and {small}, volume_m3 = {}, \
                     azimuth_deg = {}: lengths must be above 0, the large diameter the larger, \
                     azimuths from 0 to 360, and logs alone have a volume",
                    row.kind.name(),
                    row.object.to_u64(),
                    row.length_m,
                    row.volume_m3,
                    row.azimuth_deg
                );
                self.problem(&path, message);
            }
        }
    }

    /// Checks `ontology.yaml`.
    fn ontology(&mut self) {
        let manifest = self.dataset.manifest();
        let yaml = ontology_yaml::encode(&manifest.header, &manifest.point_classes());
        let found = self.dataset.read_text(layout::ONTOLOGY);
        if self
            .read(layout::ONTOLOGY, found)
            .is_some_and(|found| found != yaml)
        {
            self.problem(
                layout::ONTOLOGY,
                "differs from the class table in dataset.json",
            );
        }
    }

    /// Compares `poses.txt`, `calib.txt` and `times.txt` of a sequence with `dataset.json`.
    fn drive(&mut self, track: &TrackRecord) -> Option<Drive> {
        let number = track.sequence;
        let path = |name| layout::sequence_file(number, name);
        let (poses, times, calib) = (
            path(layout::POSES),
            path(layout::TIMES),
            path(layout::CALIB),
        );
        let read = (
            self.read(&poses, self.dataset.poses(number)),
            self.read(&times, self.dataset.times(number)),
            self.read(&calib, self.dataset.calibration(number)),
        );
        let (Some(pose_list), Some(time_list), Some(calibration)) = read else {
            let name = layout::sequence_folder(number);
            self.problem(name, "its frames cannot be checked without these files");
            return None;
        };
        for (path, lines) in [(&poses, pose_list.len()), (&times, time_list.len())] {
            if lines as u64 != track.length {
                let message = format!("has {lines} lines, the sequence {} frames", track.length);
                self.problem(path, message);
            }
        }
        let copy = layout::kitti_poses(number);
        if let Some(text) = self.read(&copy, self.dataset.read_text(&copy))
            && Some(text) != self.dataset.read_text(&poses).ok()
        {
            self.problem(copy, format!("differs from {poses}"));
        }
        let camera_from_lidar = kitti::from_rows(&calibration.camera_from_lidar);
        if let Some(sequence) = self.dataset.manifest().header.sequence(number) {
            self.calibration(&calib, &Calibration::of(sequence), &calibration);
        }
        Some(Drive {
            poses: pose_list,
            times: time_list,
            camera_from_lidar,
        })
    }

    /// Compares `calib.txt` with the intrinsics and mounts of `dataset.json`.
    fn calibration(&mut self, path: &str, asked: &Calibration, found: &Calibration) {
        let mut mount = |name: &str, asked: &kitti::Rows, found: &kitti::Rows| {
            if let Some(distance) = differs(&kitti::from_rows(asked), &kitti::from_rows(found)) {
                let message = format!("{name} is {distance} off the mounts in dataset.json");
                self.problem(path, message);
            }
        };
        mount("Tr", &asked.camera_from_lidar, &found.camera_from_lidar);
        for (asked, found) in asked.further.iter().zip(&found.further) {
            let name = format!("Tr_{}", asked.name);
            mount(&name, &asked.camera_from_lidar, &found.camera_from_lidar);
        }
        for (asked, found) in asked.further_lidars.iter().zip(&found.further_lidars) {
            let name = format!("Tr_{}", asked.name);
            mount(&name, &asked.camera_from_lidar, &found.camera_from_lidar);
        }
        let lidars = |c: &Calibration| -> Vec<String> {
            c.further_lidars.iter().map(|l| l.name.clone()).collect()
        };
        if lidars(asked) != lidars(found) {
            let message = "the lines Tr_NAME differ from the further LiDARs in dataset.json";
            self.problem(path, message);
        }
        let lenses = |c: &Calibration| -> Vec<Distortion> {
            let of_further = c.further.iter().map(|c| c.distortion);
            std::iter::once(c.distortion).chain(of_further).collect()
        };
        if lenses(asked) != lenses(found) {
            self.problem(
                path,
                "the lines D or F differ from the lenses in dataset.json",
            );
        }
        if asked.projections != found.projections {
            self.problem(path, "P0 to P3 differ from the cameras in dataset.json");
        }
        let lines = |c: &Calibration| -> Vec<(String, kitti::Rows)> {
            let line = |c: &CameraCalibration| (c.name.clone(), c.projection);
            c.further.iter().map(line).collect()
        };
        if lines(asked) != lines(found) {
            let message = "the lines P_NAME differ from the further cameras in dataset.json";
            self.problem(path, message);
        }
    }

    /// Checks the frames of a sequence.
    fn frames(&mut self, sequence: u32, drive: &Drive, inventory: &Inventory) -> Result<(), Error> {
        // The frame before, for the residual across frames.
        let mut before: Option<(RigidTransform, Frame)> = None;
        let all = self.dataset.frames();
        let first = all.partition_point(|f| f.sequence < sequence);
        let end = all.partition_point(|f| f.sequence <= sequence);
        for i in first..end {
            before = self.frame(i, all[..end].get(i + 1), drive, inventory, before);
            self.watch.done(i + 1, all.len(), &all[i])?;
        }
        Ok(())
    }

    /// Checks the `i`-th frame. The result is the frame with its pose, before which comes the next
    /// one; `before` still if it cannot be read.
    fn frame(
        &mut self,
        i: usize,
        next: Option<&FrameRecord>,
        drive: &Drive,
        inventory: &Inventory,
        before: Option<(RigidTransform, Frame)>,
    ) -> Option<(RigidTransform, Frame)> {
        let record = &self.dataset.frames()[i];
        let pose = self.pose(record, drive);
        // Reading verifies all files of the frame. If that fails, each file is compared with its
        // record, so that all damaged files are named.
        let frame = match self.dataset.read_frame(i) {
            Ok(frame) => frame,
            Err(e) => {
                if self.verified(&record.files) {
                    let folder = layout::sequence_folder(record.sequence);
                    self.problem(format!("{folder} frame {:06}", record.index), e);
                }
                return before;
            }
        };
        self.images(record, &frame, inventory);
        self.annotations(record, next, drive, &frame, inventory);
        self.points(record, &frame, inventory);
        self.agreement(record, drive, pose, &frame, before.as_ref());
        pose.map(|pose| (pose, frame))
    }

    /// Checks the further truth of cameras against the images and the poses.
    fn annotations(
        &mut self,
        record: &FrameRecord,
        next_record: Option<&FrameRecord>,
        track: &Drive,
        frame: &Frame,
        inventory: &Inventory,
    ) {
        let header = &self.dataset.manifest().header;
        let sequence = self.dataset.sequence_of(record);
        let index = usize::try_from(record.index).unwrap_or(usize::MAX);
        let next = index.checked_add(1).and_then(|next| track.poses.get(next));
        let step = track.poses.get(index).zip(next);
        let next_from_here = step.map(|(here, next)| kitti::relative(next, here));
        let next_motion = next_record
            .filter(|f| Some(f.index) == record.index.checked_add(1))
            .map(|f| f.body_motion);
        for (i, camera) in frame.cameras.iter().enumerate() {
            let view = AnnotationView {
                ontology: &header.ontology,
                sequence,
                spec: &sequence.cameras[i],
                camera,
                next_from_here: next_from_here.as_ref(),
                motion: record.body_motion,
                next_motion,
                ids: &inventory.image_ids,
            };
            for (file, message) in view.problems() {
                let path = layout::camera_file(sequence, record.index, i, file);
                self.problems.push(Problem { path, message });
            }
        }
    }

    /// The reference sensor's pose by `poses.txt`, compared with the body's in `dataset.json`.
    fn pose(&mut self, record: &FrameRecord, track: &Drive) -> Option<RigidTransform> {
        let folder = layout::sequence_folder(record.sequence);
        let index = usize::try_from(record.index).ok()?;
        let (Some(pose), Some(&time)) = (track.poses.get(index), track.times.get(index)) else {
            let message = format!("has no line for frame {}", record.index);
            self.problem(format!("{folder}/{}", layout::POSES), message);
            return None;
        };
        if time != record.time_s {
            let message = format!(
                "frame {} is at {time} s, dataset.json says {} s",
                record.index, record.time_s
            );
            self.problem(format!("{folder}/{}", layout::TIMES), message);
        }
        let recorded = self.dataset.track(record.sequence).ok()?;
        let mount = self.dataset.sequence_of(record).body_from_reference();
        let expected = kitti::relative(
            &recorded.world_from_frame0(),
            &(record.world_from_body() * mount),
        );
        if let Some(distance) = differs(&expected, pose) {
            let message = format!(
                "frame {} is {distance} off its pose in dataset.json",
                record.index
            );
            self.problem(format!("{folder}/{}", layout::POSES), message);
        }
        Some(*pose)
    }

    fn images(&mut self, record: &FrameRecord, frame: &Frame, inventory: &Inventory) {
        let header = &self.dataset.manifest().header;
        let sequence = self.dataset.sequence_of(record);
        let known: BTreeSet<u8> = header.ontology.classes().iter().map(|c| c.id).collect();
        let sky = header.ontology.class(Semantic::Sky).id;
        for (i, camera) in frame.cameras.iter().enumerate() {
            let path = |file| layout::camera_file(sequence, record.index, i, file);
            let pixels = || {
                let classes = camera
                    .semantic
                    .pixels()
                    .iter()
                    .zip(camera.instance.pixels());
                classes.zip(camera.depth_m.pixels().iter().zip(camera.normal.pixels()))
            };
            let semantic = path(CameraFile::Semantic);
            let unknown = pixels().filter(|((class, _), _)| !known.contains(class));
            self.count(
                &semantic,
                unknown.map(|((c, _), _)| *c),
                "pixels have a class that the ontology lacks",
            );
            let surfaces = pixels().filter(|((class, _), (z, _))| **z == 0.0 && **class != sky);
            self.count(
                &semantic,
                surfaces.map(|((c, _), _)| *c),
                "pixels without depth have a class",
            );
            let instance = path(CameraFile::Instance);
            let ids = &inventory.image_ids;
            let strangers: Vec<u32> = pixels()
                .map(|((_, id), _)| *id)
                .filter(|id| *id != 0 && !ids.contains(id))
                .collect();
            self.count(
                &instance,
                strangers.into_iter(),
                "pixels have an id that instances.csv lacks",
            );
            let floating = pixels().filter(|((_, id), (z, _))| **z == 0.0 && **id != 0);
            self.count(
                &instance,
                floating.map(|((_, id), _)| *id),
                "pixels without depth have an id",
            );
            let normals = path(CameraFile::Normals);
            let lone = pixels().filter(|(_, (z, n))| (**z == 0.0) != (n.length_squared() == 0.0));
            self.count(
                &normals,
                lone.map(|(_, (_, n))| *n),
                "pixels have a normal without depth, or depth without a normal",
            );
        }
    }

    fn count<T: fmt::Display>(
        &mut self,
        path: &str,
        mut found: impl Iterator<Item = T>,
        what: &str,
    ) {
        if let Some(first) = found.next() {
            let message = format!("{} {what} (the first: {first})", 1 + found.count());
            self.problem(path, message);
        }
    }

    fn points(&mut self, record: &FrameRecord, frame: &Frame, inventory: &Inventory) {
        let header = &self.dataset.manifest().header;
        let sequence = self.dataset.sequence_of(record);
        let class_ids = images::class_ids(&header.ontology);
        let mut point_classes = BTreeMap::new();
        for (i, lidar) in frame.lidars.iter().enumerate() {
            for &(class, _) in &lidar.labels {
                *point_classes.entry(class as u8).or_insert(0) += 1;
            }
            let f = layout::lidar_folders(sequence, i);
            let path = |folder, extension| {
                layout::frame_file(record.sequence, folder, record.index, extension)
            };
            let (points, labels) = (lidar.points.len(), lidar.labels.len());
            if points != labels {
                let message = format!("{labels} labels for {points} points");
                self.problem(path(&f.labels, "label"), message);
            }
            if !sequence.lidars[i].ply {
                continue;
            }
            let ply = path(&f.points, "ply");
            let position = |p: &PlyPoint| {
                let [x, y, z] = p.point.position_m.to_array();
                [x, y, z, p.point.intensity].map(f32::to_bits)
            };
            let points = lidar.points.iter().map(|p| p.map(f32::to_bits));
            if !points.eq(lidar.ply.iter().map(position)) {
                self.problem(path(&f.velodyne, "bin"), format!("differs from {ply}"));
            }
            let label = |p: &PlyPoint| (u16::from(p.class), p.label);
            if !lidar.labels.iter().copied().eq(lidar.ply.iter().map(label)) {
                self.problem(path(&f.labels, "label"), format!("differs from {ply}"));
            }
            let wrong = lidar
                .ply
                .iter()
                .filter(|p| p.class != class_ids[p.point.semantic as usize]);
            self.count(
                &ply,
                wrong.map(|p| p.class),
                "points have another class than their semantic's",
            );
            let true_ids = &inventory.true_ids;
            let strangers: Vec<u64> = lidar
                .ply
                .iter()
                .map(|p| p.point.object)
                .filter(|id| !id.is_none() && !true_ids.contains(id))
                .map(ObjectId::to_u64)
                .collect();
            self.count(
                &ply,
                strangers.into_iter(),
                "points have a true id that instances.csv lacks",
            );
            match record.sensor_chunks.get(i) {
                Some(&[x, y]) => {
                    let chunk = ChunkCoord::new(x, y);
                    let wrong = lidar
                        .ply
                        .iter()
                        .filter(|p| p.label != p.point.object.to_label_id(chunk));
                    self.count(
                        &ply,
                        wrong.map(|p| p.label),
                        "points have another label than their true id's",
                    );
                }
                None => self.problem(
                    &ply,
                    "dataset.json does not say in which chunk the sensor is",
                ),
            }
        }
        if point_classes != record.point_classes {
            let message = format!(
                "frame {}: point_classes differ from the scans",
                record.index
            );
            self.problem(layout::MANIFEST, message);
        }
    }

    fn agreement(
        &mut self,
        record: &FrameRecord,
        track: &Drive,
        pose: Option<RigidTransform>,
        frame: &Frame,
        before: Option<&(RigidTransform, Frame)>,
    ) {
        let sequence = self.dataset.sequence_of(record);
        for (c, (camera, image)) in sequence.cameras.iter().zip(&frame.cameras).enumerate() {
            let view = View {
                camera,
                motion: record.body_motion.of_mounted(&camera.body_from_camera),
                image,
                format: sequence.depth_format,
                groups: &self.class_groups,
            };
            for (l, lidar) in sequence.lidars.iter().enumerate() {
                // The first pair is checked by the transform that loaders use, the others by their
                // mounts.
                let camera_from_lidar = if (c, l) == (0, 0) {
                    track.camera_from_lidar
                } else {
                    kitti::relative(&camera.body_from_camera, &lidar.body_from_lidar)
                };
                self.agreement
                    .add(&view, &frame.lidars[l].ply, &camera_from_lidar);
                if (c, l) == (0, 0)
                    && let (Some(pose), Some((before, points))) = (pose, before)
                {
                    let step = kitti::relative(&pose, before);
                    let next_camera_from_lidar = step * camera_from_lidar;
                    self.agreement
                        .add_next(&view, &points.lidars[l].ply, &next_camera_from_lidar);
                }
            }
        }
    }
}

/// The difference of two transforms, in words, if it is more than rounding can explain.
fn differs(a: &RigidTransform, b: &RigidTransform) -> Option<String> {
    let distance = a.translation_m.distance(b.translation_m);
    let angle = a.rotation.angle_between(b.rotation).to_degrees();
    // An angle near 0 comes from an arc cosine near 1, which loses half of the digits.
    (distance > 1e-5 || angle > 1e-5).then(|| format!("{distance:.4} m and {angle:.4}°"))
}
/// What is impossible about a tree: sizes that are not above 0, a crown above its top, leaves on
/// dead wood.
fn impossible(tree: &TreeRecord) -> Option<String> {
    let positive = |name: &str, value: f64| {
        let fine = value > 0.0 && value.is_finite();
        (!fine).then(|| format!("{name} = {value}: must be above 0"))
    };
    let crown = || {
        let (base, top) = (tree.crown_base_m, tree.height_m);
        let fine = (0.0..=top).contains(&base);
        (!fine).then(|| format!("crown_base_m = {base}: must be from 0 to height_m = {top}"))
    };
    let leaves = || {
        let leafless = tree.leaf_area_m2 == 0.0;
        let fine = tree.leaf_area_m2 >= 0.0 && leafless != tree.alive;
        (!fine).then(|| {
            let (area, alive) = (tree.leaf_area_m2, tree.alive);
            format!(
                "leaf_area_m2 = {area}, alive = {alive}: a living tree has leaves, a dead one none"
            )
        })
    };
    // A tree that is lower than breast height has no diameter there.
    let diameter = || {
        let low = tree.height_m <= 1.3 && tree.dbh_m == 0.0;
        if low {
            None
        } else {
            positive("dbh_m", tree.dbh_m)
        }
    };
    let found = diameter()
        .or_else(|| positive("height_m", tree.height_m))
        .or_else(|| positive("stem_volume_m3", tree.stem_volume_m3))
        .or_else(crown)
        .or_else(leaves)?;
    Some(format!("tree {}: {found}", tree.object.to_u64()))
}
