//! Writing frames.

use std::collections::BTreeMap;

use nemoral_scene::Image;

use super::hex;
use crate::formats::{ply, scan};
use crate::output::state;
use crate::{
    CameraData, CameraFile, Error, FileRecord, FrameData, FrameRecord, LidarData, PlyPoint,
    SequenceSpec, Writer, layout, limits,
};

impl Writer {
    /// Writes a frame, replacing an earlier one; it may be called from several threads at once.
    /// Each file appears under its final name only when it is whole, and the frame's record comes
    /// last, so that after an error or a kill the frame counts as missing.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the frame does not fit the header, or is at a time or a place that no
    /// data set has, before anything is written; [`Error::Io`] names the file that could not be
    /// written (disk full, no permission).
    pub fn write_frame(&self, frame: &FrameData<'_>) -> Result<FrameRecord, Error> {
        let sequence = self.sequence(frame.sequence)?;
        self.validate(sequence, frame)?;
        let mut record = self.record(frame);
        // What `dataset.json` cannot list is refused before any of it is written, not at the end
        // of all work.
        record.validate_numbers(sequence)?;
        let at = (frame.sequence, frame.index);
        if self.lock().remove(&at).is_some() {
            state::put_record(&self.folder, frame.sequence, frame.index, None)?;
        }
        let mut files = Vec::new();
        for (i, camera) in frame.cameras.iter().enumerate() {
            self.put_camera(sequence, frame, i, camera, &mut files)?;
        }
        for (i, lidar) in frame.lidars.iter().enumerate() {
            let points = self.points(lidar);
            let f = layout::lidar_folders(sequence, i);
            let mut put = |folder: &str, extension, bytes: Vec<u8>| {
                self.put_frame_file(frame, folder, extension, &bytes, &mut files)
            };
            put(&f.velodyne, "bin", scan::encode_points(&points))?;
            put(&f.labels, "label", scan::encode_labels(&points))?;
            if sequence.lidars[i].ply {
                put(&f.points, "ply", ply::encode(&points))?;
            }
        }
        files.sort_by(|a, b| a.path.cmp(&b.path));
        record.files = files;
        // Files may be too large.
        record.validate(sequence)?;
        self.enter(record.clone())?;
        Ok(record)
    }

    /// The record of a frame without its files.
    fn record(&self, frame: &FrameData<'_>) -> FrameRecord {
        FrameRecord {
            sequence: frame.sequence,
            index: frame.index,
            time_s: frame.time_s,
            key: hex(&frame.frame_key),
            world_from_body: frame.world_from_body.to_rows(),
            body_motion: frame.body_motion,
            balance: frame.balance.clone(),
            sensor_chunks: frame.lidars.iter().map(|l| l.sensor_chunk.into()).collect(),
            point_classes: self.point_classes(frame),
            files: Vec::new(),
        }
    }

    /// How many LiDAR points of a frame have each class.
    fn point_classes(&self, frame: &FrameData<'_>) -> BTreeMap<u8, u64> {
        let mut counts = [0_u64; 256];
        for point in frame.lidars.iter().flat_map(|lidar| lidar.points) {
            counts[usize::from(self.class_ids[point.semantic as usize])] += 1;
        }
        let classes = (0..=u8::MAX).zip(counts);
        classes.filter(|(_, count)| *count > 0).collect()
    }

    fn validate(&self, h: &SequenceSpec, frame: &FrameData<'_>) -> Result<(), Error> {
        let name = format!("frame {}", frame.index);
        let asked: Vec<&str> = h.cameras.iter().map(|c| &*c.name).collect();
        let found: Vec<&str> = frame.cameras.iter().map(|c| c.name).collect();
        if asked != found {
            let (found, asked) = (format!("{found:?}"), format!("the header's {asked:?}"));
            return Err(Error::invalid(format!("{name}.cameras"), found, asked));
        }
        let asked: Vec<&str> = h.lidars.iter().map(|l| &*l.name).collect();
        let found: Vec<&str> = frame.lidars.iter().map(|l| l.name).collect();
        if asked != found {
            let (found, asked) = (format!("{found:?}"), format!("the header's {asked:?}"));
            return Err(Error::invalid(format!("{name}.lidars"), found, asked));
        }
        for (camera, spec) in frame.cameras.iter().zip(&h.cameras) {
            let asked = (
                spec.intrinsics.width as usize,
                spec.intrinsics.height as usize,
            );
            let t = camera.truth;
            let sizes = [
                ("rgb", size(camera.rgb)),
                ("semantic", size(&t.semantic)),
                ("object", size(&t.object)),
                ("depth", size(&t.depth_m)),
                ("normal", size(&t.normal)),
            ];
            let e = camera.annotations;
            for (what, asked, given) in [
                ("flow", spec.annotations.flow, e.flow.is_some()),
                ("trunks", spec.annotations.trunks, e.trunks.is_some()),
                ("boxes", spec.annotations.boxes, e.boxes.is_some()),
                (
                    "radiance",
                    spec.annotations.radiance,
                    camera.radiance.is_some(),
                ),
            ] {
                if asked && !given {
                    let field = format!("{name}.{}.{what}", camera.name);
                    return Err(Error::invalid(
                        field,
                        "none",
                        "there: the header asks for it",
                    ));
                }
            }
            let more = [
                e.flow.as_ref().map(|i| ("flow", size(i))),
                e.trunks.as_ref().map(|i| ("trunks", size(i))),
                camera.radiance.map(|i| ("radiance", size(i))),
            ];
            for (image, found) in sizes.into_iter().chain(more.into_iter().flatten()) {
                if found != asked {
                    return Err(Error::invalid(
                        format!("{name}.{}.{image}", camera.name),
                        format!("{} × {}", found.0, found.1),
                        format!("{} × {}", asked.0, asked.1),
                    ));
                }
            }
        }
        for lidar in &frame.lidars {
            let points = lidar.points.len();
            if points as u64 > limits::MAX_POINTS {
                let field = format!("{name}.{}.points", lidar.name);
                let allowed = format!("at most {}", limits::MAX_POINTS);
                return Err(Error::invalid(field, points, allowed));
            }
            if let Some(p) = lidar.points.iter().find(|p| !ply::holds(p)) {
                let found = format!("{} at {} ns", p.pulse, p.time_ns);
                let allowed = format!("below 2^31, {}", ply::MOST_TIME);
                return Err(Error::invalid(
                    format!("{name}.{}.pulse", lidar.name),
                    found,
                    allowed,
                ));
            }
        }
        Ok(())
    }

    fn put_frame_file(
        &self,
        frame: &FrameData<'_>,
        folder: &str,
        extension: &str,
        bytes: &[u8],
        files: &mut Vec<FileRecord>,
    ) -> Result<(), Error> {
        let path = layout::frame_file(frame.sequence, folder, frame.index, extension);
        files.push(FileRecord::put(&self.folder, layout::inner(&path), bytes)?);
        Ok(())
    }

    fn put_camera(
        &self,
        sequence: &SequenceSpec,
        frame: &FrameData<'_>,
        i: usize,
        camera: &CameraData<'_>,
        files: &mut Vec<FileRecord>,
    ) -> Result<(), Error> {
        for file in CameraFile::ALL {
            if let Some(bytes) = file.encode(sequence, &self.header.ontology, i, camera) {
                let extension = file.extension(sequence);
                let folder = layout::camera_folder(sequence, i, file);
                self.put_frame_file(frame, &folder, extension, &bytes, files)?;
            }
        }
        Ok(())
    }

    fn points(&self, lidar: &LidarData<'_>) -> Vec<PlyPoint> {
        lidar
            .points
            .iter()
            .map(|&point| PlyPoint {
                point,
                class: self.class_ids[point.semantic as usize],
                label: point.object.to_label_id(lidar.sensor_chunk),
            })
            .collect()
    }
}

fn size<T>(image: &Image<T>) -> (usize, usize) {
    (image.width(), image.height())
}
