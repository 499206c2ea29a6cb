//! Checks frames: poses, images, points, and whether camera and LiDAR agree.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use nemoral_scene::{ChunkCoord, ObjectId, RigidTransform, Semantic};

use super::agreement::View;
use super::annotations::AnnotationView;
use super::drive::{Drive, differs};
use super::tables::Inventory;
use super::{Checker, Problem};
use crate::formats::{images, kitti};
use crate::{CameraFile, Error, Frame, FrameRecord, PlyPoint, layout};

impl Checker<'_> {
    /// Checks the frames of a sequence.
    pub(super) fn frames(
        &mut self,
        sequence: u32,
        drive: &Drive,
        inventory: &Inventory,
    ) -> Result<(), Error> {
        // The frame before, for the residual across frames.
        let mut before: Option<(RigidTransform, Frame)> = None;
        let all = self.dataset.frames();
        let first = all.partition_point(|f| f.sequence < sequence);
        let end = all.partition_point(|f| f.sequence <= sequence);
        for i in first..end {
            before = self.frame(i, all[..end].get(i + 1), drive, inventory, before);
            self.monitor.done(i + 1, all.len(), &all[i])?;
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
