//! Turns a camera's table into the parameters of the renderer.

use nemoral_render::{
    ChromaticAberration, Exposure, Jpeg, Lens, Metering, Processing, SensorNoise, Soiling,
    ToneCurve, Vignetting, WhiteBalance, WhiteReference,
};
use nemoral_scene::glam::DVec2;
use nemoral_scene::{AnnotationKinds, Distortion, Intrinsics, ParamError, RigidTransform, Shutter};
use nemoral_seed::Key;
use toml::{Table, Value};

use super::mount::mount;
use super::{
    Camera, CameraCalibration, CameraLens, CameraOptics, ExposureMode, Look, MeteringMode,
    ToneChoice, VignettingModel, WhiteBalanceMode,
};

impl CameraCalibration {
    /// Gives a camera the numbers that its calibration leaves out, which follow from the others and
    /// from the size of its pictures.
    pub(super) fn complete(camera: &mut Table) {
        let [width, height] = ["width_px", "height_px"].map(|key| {
            let pixels = camera.get(key).and_then(Value::as_integer);
            pixels.unwrap_or_default() as f64
        });
        let Some(Value::Table(calibration)) = camera.get_mut("calibration") else {
            return;
        };
        let said = |key: &str| calibration.get(key).cloned();
        let usual = Self::default().fx_px / f64::from(Camera::default().width_px) * width;
        let focal = said("fx_px").or_else(|| said("fy_px"));
        let focal = focal.unwrap_or(Value::Float(usual));
        let numbers = [
            ("fx_px", focal.clone()),
            ("fy_px", focal),
            ("cx_px", Value::Float(0.5 * width)),
            ("cy_px", Value::Float(0.5 * height)),
        ];
        for (key, value) in numbers {
            calibration.entry(key).or_insert(value);
        }
    }
}

impl Camera {
    /// The camera's pinhole and lens.
    ///
    /// # Errors
    /// If they are invalid; the error names the key below the camera's table.
    pub fn intrinsics(&self) -> Result<Intrinsics, ParamError> {
        let (width, height) = (self.width_px, self.height_px);
        let distortion = match &self.lens {
            CameraLens::Pinhole(_) => Distortion::None,
            CameraLens::BrownConrady(b) => Distortion::BrownConrady {
                k1: b.k1,
                k2: b.k2,
                k3: b.k3,
                p1: b.p1,
                p2: b.p2,
            },
            CameraLens::Fisheye(f) => Distortion::Fisheye {
                k1: f.k1,
                k2: f.k2,
                k3: f.k3,
                k4: f.k4,
            },
        };
        let made = match &self.optics {
            CameraOptics::Fov(fov) => {
                let fov_rad = fov.horizontal_deg.to_radians();
                Intrinsics::through_lens(width, height, fov_rad, distortion)
            }
            CameraOptics::Sensor(s) => {
                let size = DVec2::new(s.width_mm, s.height_mm);
                Intrinsics::from_sensor(width, height, size, s.focal_length_mm)
                    .and_then(|k| k.with_distortion(distortion))
            }
            CameraOptics::Calibration(c) => {
                let (focal, centre) = (DVec2::new(c.fx_px, c.fy_px), DVec2::new(c.cx_px, c.cy_px));
                Intrinsics::from_calibration(width, height, focal, centre)
                    .and_then(|k| k.with_distortion(distortion))
            }
        };
        made.map_err(|e| {
            if e.field != "horizontal_fov_deg" {
                return e;
            }
            // The key that says how wide the picture is.
            match &self.optics {
                CameraOptics::Fov(_) => ParamError::new("fov.horizontal_deg", e.value, e.allowed),
                CameraOptics::Sensor(s) => {
                    let allowed = format!("so long that the field of view is {}", e.allowed);
                    ParamError::new("sensor.focal_length_mm", s.focal_length_mm, allowed)
                }
                CameraOptics::Calibration(c) => {
                    let allowed = format!("so long that the field of view is {}", e.allowed);
                    ParamError::new("calibration.fx_px", c.fx_px, allowed)
                }
            }
        })
    }

    /// The annotations that the camera writes besides its pictures and their labels.
    #[must_use]
    pub fn annotation_kinds(&self) -> AnnotationKinds {
        AnnotationKinds {
            sky: self.sky,
            flow: self.flow,
            trunks: self.trunks,
            boxes: self.boxes,
            radiance: self.radiance,
        }
    }

    /// When the camera's rows are exposed.
    #[must_use]
    pub fn shutter_times(&self) -> Shutter {
        Shutter {
            exposure_s: self.shutter.exposure_ms / 1000.0,
            readout_s: self.shutter.readout_ms / 1000.0,
        }
    }

    /// The position and direction of the camera's optical frame on the body.
    #[must_use]
    pub fn body_from_camera(&self) -> RigidTransform {
        mount(
            [self.mount_x_m, self.mount_y_m, self.mount_z_m],
            [
                self.mount_roll_deg,
                self.mount_pitch_deg,
                self.mount_yaw_deg,
            ],
        ) * RigidTransform::body_from_optical()
    }

    /// The noise of the camera's sensor; `serial` decides its fixed pattern.
    #[must_use]
    pub fn sensor_noise(&self, serial: Key) -> Option<SensorNoise> {
        let n = &self.noise;
        n.enabled.then_some(SensorNoise {
            full_well_e: n.full_well_e,
            read_noise_e: n.read_noise_e,
            gain: n.gain,
            gain_below_ev: n.gain_below_ev,
            prnu: n.prnu,
            dsnu_e: n.dsnu_e,
            bits: n.bits,
            serial,
        })
    }

    /// The exposure of pictures.
    #[must_use]
    pub fn exposure_mode(&self) -> Exposure {
        match self.exposure {
            ExposureMode::Auto => {
                Exposure::metered(self.exposure_bias_ev).down_to(self.exposure_least_ev)
            }
            ExposureMode::Fixed => Exposure::Fixed {
                ev100: self.exposure_ev,
            },
        }
    }

    /// What an automatic exposure looks at.
    #[must_use]
    pub fn metering_mode(&self) -> Metering {
        match self.metering {
            MeteringMode::Average => Metering::Average,
            MeteringMode::Centre => Metering::Centre,
            MeteringMode::Ground => Metering::Ground,
            MeteringMode::Sky => Metering::Sky,
            MeteringMode::Highlights => Metering::Highlights,
        }
    }

    /// The tone curve, and the effects of the lens.
    #[must_use]
    pub fn tone_and_lens(&self) -> (ToneCurve, Lens) {
        let (tone, veiling_glare, halo, vignetting) = match self.look {
            Look::Cinema => (ToneCurve::Filmic, 0.01, 0.02, 0.2),
            Look::Flat => (ToneCurve::Linear, 0.01, 0.0, 0.0),
            // A small plastic lens on a small sensor.
            Look::Robot => (ToneCurve::Standard, 0.02, 0.06, 0.5),
        };
        let tone = match self.tone.curve {
            ToneChoice::Look => tone,
            ToneChoice::Standard => ToneCurve::Standard,
            ToneChoice::Linear => ToneCurve::Linear,
            ToneChoice::Filmic => ToneCurve::Filmic,
        };
        let v = &self.vignetting;
        let vignetting = match v.model {
            VignettingModel::Look => Vignetting::CosineFourth(vignetting),
            VignettingModel::CosineFourth => Vignetting::CosineFourth(v.strength as f32),
            VignettingModel::Polynomial => Vignetting::Polynomial {
                a2: v.a2 as f32,
                a4: v.a4 as f32,
                a6: v.a6 as f32,
            },
        };
        let lens = Lens {
            veiling_glare,
            halo,
            vignetting,
            aberration: ChromaticAberration {
                red_px: self.aberration.red_px as f32,
                blue_px: self.aberration.blue_px as f32,
            },
            spread_px: self.spread_px as f32,
        };
        (tone, lens)
    }

    /// Dirt and drops on the lens; `serial` decides where they are.
    #[must_use]
    pub fn soiled(&self, serial: Key) -> Option<Soiling> {
        let s = &self.soiling;
        (s.specks > 0 || s.drops > 0).then_some(Soiling {
            specks: s.specks,
            speck_radius: s.speck_radius as f32,
            opacity: s.opacity as f32,
            albedo: s.albedo as f32,
            drops: s.drops,
            drop_radius: s.drop_radius as f32,
            serial,
        })
    }

    /// What the camera makes of the sensor's values.
    #[must_use]
    pub fn image_processing(&self) -> Processing {
        let (w, p) = (&self.white_balance, &self.processing);
        Processing {
            white_balance: WhiteBalance {
                reference: match w.mode {
                    WhiteBalanceMode::Fixed => WhiteReference::Fixed { kelvin: w.kelvin },
                    WhiteBalanceMode::Auto => WhiteReference::Automatic,
                },
                error_k: w.error_k,
                tint: w.tint,
            },
            contrast: self.tone.contrast,
            denoising: p.denoising,
            saturation: self.tone.saturation,
            sharpening: p.sharpening,
            sharpening_radius_px: p.sharpening_radius_px,
            jpeg: (p.jpeg_quality > 0).then_some(Jpeg {
                quality: p.jpeg_quality,
                subsampled: p.jpeg_subsampling,
            }),
        }
    }

    /// Whether pictures are more than a tone curve of the light at each pixel, equal for all
    /// colours.
    #[must_use]
    pub fn is_processed(&self) -> bool {
        let plain = Processing {
            contrast: self.tone.contrast,
            sharpening_radius_px: self.processing.sharpening_radius_px,
            ..Processing::default()
        };
        self.image_processing() != plain
    }
}

#[cfg(test)]
mod tests {
    use nemoral_render::{
        CameraRenderer, Lighting, OpenSky, RayCastCamera, RayCastParams, SceneView, View,
    };
    use nemoral_scene::glam::Vec3;
    use nemoral_scene::{Hit, Material, MaterialId, MaterialLibrary, Ray, RayCaster, Semantic};

    use super::*;

    /// A grey card in front of the lens, in every direction.
    struct GreyCard;

    impl RayCaster for GreyCard {
        fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
            Some(Hit::new(1.0, -ray.direction, MaterialId(0)))
        }
    }

    /// The code of 18 % of what a light meter reads is sRGB's 118, and 125 with the filmic curve.
    #[test]
    fn a_grey_card_has_its_code_value_in_every_look() {
        let mut camera = Camera {
            exposure: ExposureMode::Fixed,
            exposure_ev: 12.0,
            ..Camera::default()
        };
        let mut materials = MaterialLibrary::new();
        materials.add(Material::plain("card", Semantic::Rock, Vec3::splat(0.18)));
        let scene = SceneView {
            caster: &GreyCard,
            instances: None,
            materials: &materials,
            sky_visibility: &OpenSky,
            lamps: &[],
        };
        // The inside of an integrating sphere with the luminance that EV 12 is meant for.
        let white = 0.125 * 4096.0 / 0.18;
        for (look, code) in [(Look::Robot, 118), (Look::Cinema, 125), (Look::Flat, 118)] {
            camera.look = look;
            let (tone, lens) = camera.tone_and_lens();
            let params = RayCastParams {
                lens,
                ..RayCastParams::draft()
            };
            let renderer = RayCastCamera::new(params, Lighting::uniform(Vec3::splat(white)));
            let mut shoot = |ev: f64| {
                camera.exposure_ev = ev;
                let view = View {
                    exposure: camera.exposure_mode(),
                    tone,
                    ..View::new(
                        Intrinsics::from_fov(33, 21, 0.5).expect("a pinhole"),
                        RigidTransform::body_from_optical(),
                    )
                };
                let renderer = renderer.as_ref().expect("valid");
                let images = renderer.render(&scene, &view, Key::world(1));
                images.expect("renders").rgb.at(16, 10)[1]
            };
            let got = shoot(12.0);
            assert!(got.abs_diff(code) <= 1, "{look:?}: {got} for {code}");
            // One stop more halves the light.
            assert!(shoot(13.0) < got - 25, "{look:?}");
        }
    }
}
