//! Checks of the further files of cameras: sky masks, flow, hidden trunks and boxes against images
//! and poses, and radiance against the picture.

use std::collections::{BTreeMap, BTreeSet};

use nemoral_scene::glam::{DVec2, Vec3};
use nemoral_scene::{Flow, Ontology, PixelBox, RigidTransform, Semantic, Twist};

use crate::reader::CameraFrame;
use crate::{CameraFile, CameraSpec, DepthFormat, SequenceSpec};

/// One camera's frame, to be checked.
pub(crate) struct AnnotationView<'a> {
    pub(crate) ontology: &'a Ontology,
    pub(crate) sequence: &'a SequenceSpec,
    pub(crate) spec: &'a CameraSpec,
    pub(crate) camera: &'a CameraFrame,
    /// The transform from the reference camera's frame to its next one; `None` after the last
    /// frame.
    pub(crate) next_from_here: Option<&'a RigidTransform>,
    /// How the body moved.
    pub(crate) motion: Twist,
    /// How it moved in the next frame, if that frame exists here.
    pub(crate) next_motion: Option<Twist>,
    /// Image ids of `instances.csv`.
    pub(crate) ids: &'a BTreeSet<u32>,
}

impl AnnotationView<'_> {
    /// Which files are wrong, and how.
    pub(crate) fn problems(&self) -> Vec<(CameraFile, String)> {
        let found = [
            (CameraFile::Sky, self.sky()),
            (CameraFile::Flow, self.flow()),
            (CameraFile::Trunks, self.trunks()),
            (CameraFile::Boxes, self.boxes()),
            (CameraFile::Radiance, self.radiance()),
        ];
        found
            .into_iter()
            .filter_map(|(file, message)| Some((file, message?)))
            .collect()
    }

    fn sky(&self) -> Option<String> {
        let mask = self.camera.sky.as_ref()?;
        let pairs = mask.pixels().iter().zip(self.camera.depth_m.pixels());
        let wrong = pairs.filter(|(m, z)| **m != if **z == 0.0 { 255 } else { 0 });
        counted(wrong.count(), "pixels contradict the depth image")
    }

    /// Compares flow with depth and poses; they may differ as far as the rounding of both allows.
    fn flow(&self) -> Option<String> {
        let flow = self.camera.flow.as_ref()?;
        let depth = &self.camera.depth_m;
        let lone = |(f, z): &(&Option<Flow>, &f32)| f.is_some() && **z == 0.0;
        let lone = flow.pixels().iter().zip(depth.pixels()).filter(lone);
        if let Some(message) = counted(lone.count(), "pixels have flow without depth") {
            return Some(message);
        }
        let step = self.next_from_here?;
        // The step of the reference camera, as seen by this camera.
        let reference_from_camera =
            self.sequence.body_from_reference().inverse() * self.spec.body_from_camera;
        let next_from_here = reference_from_camera.inverse() * *step * reference_from_camera;
        let (k, shutter) = (&self.spec.intrinsics, &self.spec.shutter);
        let mount = &self.spec.body_from_camera;
        let motion = self.motion.of_mounted(mount);
        // With a rolling shutter, positions in the next picture depend on the motion at that time,
        // too.
        let next_motion = match self.next_motion {
            Some(next) => next.of_mounted(mount),
            None if shutter.readout_s > 0.0 => return None,
            None => Twist::STILL,
        };
        let half_step_m = match self.sequence.depth_format {
            DepthFormat::Png16 => 0.5 / 256.0,
            DepthFormat::Npy => 0.0,
        };
        let mut wrong = 0;
        for (i, (f, &z)) in flow.pixels().iter().zip(depth.pixels()).enumerate() {
            let (Some(f), true) = (f, z < 255.0) else {
                continue;
            };
            let (column, row) = (i % depth.width(), i / depth.width());
            let pixel = DVec2::new(column as f64 + 0.5, row as f64 + 0.5);
            let direction = k.direction(pixel);
            let then = next_from_here * motion.after(shutter.row_time_s(pixel.y, k.height));
            let expected = |z: f64| {
                let there = then.transform_point(direction * (z / direction.z));
                Some(k.project_moving(there, shutter, &next_motion)? - pixel)
            };
            let z = f64::from(z);
            let (Some(far), Some(near), Some(middle)) = (
                expected(z + half_step_m),
                expected((z - half_step_m).max(1e-3)),
                expected(z),
            ) else {
                continue;
            };
            let spread = (far - middle).length().max((near - middle).length());
            let off = (f.offset_px.as_dvec2() - middle).length();
            wrong += usize::from(off > 0.05 + 1.1 * spread);
        }
        counted(wrong, "pixels flow elsewhere than depth and poses.txt say")
    }

    /// Checks that a visible trunk is the nearest one.
    fn trunks(&self) -> Option<String> {
        let trunks = self.camera.trunks.as_ref()?;
        let strangers = trunks.pixels().iter();
        let strangers = strangers.filter(|id| **id != 0 && !self.ids.contains(id));
        let strangers = counted(
            strangers.count(),
            "pixels have an id that instances.csv lacks",
        );
        strangers.or_else(|| {
            let class = self.ontology.class(Semantic::Stem).id;
            let c = self.camera;
            let seen = c.semantic.pixels().iter().zip(c.instance.pixels());
            let wrong = seen
                .zip(trunks.pixels())
                .filter(|((seen, id), trunk)| **seen == class && **id != 0 && id != trunk);
            counted(
                wrong.count(),
                "pixels show a trunk and have another one here",
            )
        })
    }

    /// Compares counts and boxes with the instance image.
    fn boxes(&self) -> Option<String> {
        let boxes = self.camera.boxes.as_ref()?;
        let image = &self.camera.instance;
        let mut seen: BTreeMap<u32, (u32, PixelBox)> = BTreeMap::new();
        for (i, &id) in image
            .pixels()
            .iter()
            .enumerate()
            .filter(|(_, id)| **id != 0)
        {
            let (count, bounds) = seen.entry(id).or_insert((0, PixelBox::EMPTY));
            *count += 1;
            *bounds = bounds.with((i % image.width()) as u32, (i / image.width()) as u32);
        }
        if !boxes.is_sorted_by(|a, b| a.object < b.object) {
            return Some("things repeat or are out of order".to_owned());
        }
        let wrong = boxes.iter().find(|b| {
            let id = b.object.to_image_id();
            let found = seen.get(&id);
            let w = b.whole;
            let whole_area = u64::from(w.right.saturating_sub(w.left))
                * u64::from(w.bottom.saturating_sub(w.top));
            !self.ids.contains(&id)
                || found.map_or(0, |f| f.0) != b.visible_px
                || found.map(|f| f.1) != b.visible
                || b.visible_px > b.whole_px
                || whole_area < u64::from(b.whole_px)
                || b.visible.is_some_and(|v| {
                    v.left < w.left || v.top < w.top || v.right > w.right || v.bottom > w.bottom
                })
                || b.size_m.min_element() <= 0.0
        });
        let wrong = wrong.map(|b| b.object.to_u64());
        wrong.map(|id| format!("the box of {id} contradicts the instance image or instances.csv"))
    }
}

impl AnnotationView<'_> {
    /// Checks that radiance is finite and not negative, and that, without a sensor's noise and a
    /// camera's processing, the picture follows it: under any tone curve more light never gives a
    /// lower code.
    fn radiance(&self) -> Option<String> {
        let radiance = self.camera.radiance.as_ref()?;
        let dark = |c: &&Vec3| !(c.is_finite() && c.min_element() >= 0.0);
        let wrong = radiance.pixels().iter().filter(dark).count();
        let wrong = counted(wrong, "pixels are not finite, or below 0");
        if wrong.is_some() || self.spec.noisy || self.spec.processed {
            return wrong;
        }
        // The least and the most light of each code, over all channels.
        let mut ends = [(f32::INFINITY, 0.0_f32); 256];
        for (light, codes) in radiance.pixels().iter().zip(self.camera.rgb.pixels()) {
            for (light, code) in light.to_array().into_iter().zip(codes) {
                let (least, most) = &mut ends[usize::from(*code)];
                (*least, *most) = (least.min(light), most.max(light));
            }
        }
        let mut below = 0.0_f32;
        for (code, (least, most)) in ends.into_iter().enumerate() {
            if least < below {
                return Some(format!(
                    "{least} cd/m² is code {code} in the picture, and {below} cd/m² a lower one"
                ));
            }
            below = below.max(most);
        }
        None
    }
}

fn counted(count: usize, what: &str) -> Option<String> {
    (count > 0).then(|| format!("{count} {what}"))
}
