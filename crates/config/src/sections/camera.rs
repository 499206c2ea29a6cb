//! Keys of the camera.

use super::{
    CameraAberration, CameraLens, CameraOptics, CameraProcessing, CameraSoiling, CameraTone,
    CameraVignetting, CameraWhiteBalance,
};
use crate::schema::AllowedValues::{Flag, OneOf, Real, Whole};
use crate::schema::{SectionSpec, section};
use crate::{ExposureMode, Look, MeteringMode};

section! {
    /// The camera (paper, V-C).
    Camera at "camera" {
        /// Whether there is a camera. Without the first one there are no further ones.
        enabled: bool = true, Flag, "a scan alone is 20 times as fast";
        /// Columns.
        width_px: u32 = 1280, Whole(16, 8192), "paper, VI";
        /// Rows.
        height_px: u32 = 720, Whole(16, 8192), "paper, VI";
        /// Colour samples of every pixel. A GPU takes 1 if nothing more is asked for here and for
        /// edges, else 4 of every pixel.
        samples: u32 = 1, Whole(1, 256), "mean light needs as many rays";
        /// Colour samples of pixels on silhouettes, where a neighbour shows another object, class
        /// or depth (half of a forest's), if that is more than `samples`. If both are 1, the
        /// picture is a draft.
        edge_samples: u32 = 2, Whole(1, 256), "edges at a fifth more than a draft's time";
        /// How far the lens spreads the light of a point in the picture: the standard deviation of
        /// a Gaussian, pixels. With a pixel's own width, 0.5 leaves half of the contrast at 0.32
        /// cycles a pixel, 0.7 at 0.25. Below a third nothing is spread, and leaves that are
        /// smaller than a pixel are noise.
        spread_px: f64 = 0.7, Real(0.0, 4.0), "our choice: noise as of 8 samples";
        /// Number of surfaces over which light is followed to the sky by random rays; 0 takes the
        /// mean light of a place from its sky view factor. More than 0 works on the CPU alone, and
        /// is grainy with less than about 64 `samples`, with which 4 bounces take minutes.
        bounces: u32 = 0, Whole(0, 16), "mean light is within a tenth or two of it";
        /// Exposure of pictures: by a light meter, or fixed to `exposure_ev`.
        exposure: ExposureMode = ExposureMode::Auto, OneOf(ExposureMode::WORDS), "as cameras do";
        /// The `fixed` exposure at ISO 100: 0.125 cd/m² times 2 to its power is middle grey. It is
        /// 15 in sunshine, 12 under an overcast sky or in shade, 8 to 11 under crowns.
        exposure_ev: f64 = 11.0, Real(-10.0, 25.0), "a forest on a clear day";
        /// What the automatic exposure looks at: the whole picture, mostly its middle, all but the
        /// sky (as if exposed for the ground), the sky alone, or highlights: the brightest
        /// fiftieth, which becomes nearly white, as one exposes what a lamp shines on.
        metering: MeteringMode = MeteringMode::Average, OneOf(MeteringMode::WORDS),
            "a meter's mean of logarithms";
        /// What the exposure, automatic or fixed, is wrong by, stops: with 1 twice the light is
        /// recorded.
        exposure_error_ev: f64 = 0.0, Real(-8.0, 8.0), "none";
        /// How light becomes a picture: `robot` is what a small camera records in a forest, with
        /// the contrast of a camera's standard picture, glare at edges and dark corners; `cinema`
        /// is a soft curve that keeps highlights; `flat` is proportional to light, with a clean
        /// lens, for those who augment pictures themselves.
        look: Look = Look::Robot, OneOf(Look::WORDS), "what the data is for";
        /// Brightens (positive) or darkens the automatic exposure, stops.
        exposure_bias_ev: f64 = -0.3, Real(-8.0, 8.0),
            "our choice: leaves are dark, gaps keep their colours";
        /// The least automatic exposure at ISO 100, at which shutter and gain end: what is darker
        /// stays dark. Moonlight on open ground has -4, under crowns -8. It ends so before
        /// `exposure_error_ev`.
        exposure_least_ev: f64 = 0.0, Real(-10.0, 25.0), "f/2, 1/60 s, a gain of 256 (48 dB)";
        /// Write `radiance`, the light behind the lens, before exposure and sensor: OpenEXR, linear
        /// sRGB in cd/m², 32-bit floats.
        radiance: bool = false, Flag, "at most 11 MB for a picture of 1280 x 720";
        /// Write `sky`, a mask of where nothing was hit.
        sky: bool = false, Flag, "depth 0 contains the same";
        /// Write `flow`, the exact optical flow to the next frame, with a flag for points that the
        /// next frame shows.
        flow: bool = false, Flag, "one more ray for each pixel";
        /// Write `trunks`, the nearest trunk at each pixel, also behind leaves and shrubs.
        trunks: bool = false, Flag, "the paper's hard case, VII; one more ray for each pixel";
        /// Write `boxes`, 2-D and 3-D boxes of trees, stumps, shrubs and rocks with their visible
        /// fraction.
        boxes: bool = false, Flag, "each object is cast separately";
        /// Greatest distance of objects with boxes.
        boxes_range_m: f64 = 60.0, Real(1.0, 600.0), "a tree there is still 10 pixels wide";
        /// Position in front of the body's origin.
        mount_x_m: f64 = 0.35, Real(-10.0, 10.0), "a small tracked robot";
        /// Position to the left of it.
        mount_y_m: f64 = 0.0, Real(-10.0, 10.0), "centred";
        /// Height above the ground.
        mount_z_m: f64 = 1.2, Real(0.0, 50.0), "a small tracked robot";
        /// Rotation to the left.
        mount_yaw_deg: f64 = 0.0, Real(-180.0, 180.0), "forward";
        /// Pitch, downwards.
        mount_pitch_deg: f64 = 0.0, Real(-90.0, 90.0), "level";
        /// Roll, about its own forward axis after yaw and pitch: the right side goes down.
        mount_roll_deg: f64 = 0.0, Real(-180.0, 180.0), "upright";
    }
    plus {
        /// The camera's optics.
        #[serde(flatten)]
        optics: CameraOptics;
        /// The camera's lens.
        #[serde(flatten)]
        lens: CameraLens;
        /// The camera's shutter.
        shutter: CameraShutter;
        /// The noise of the camera's sensor.
        noise: CameraNoise;
        /// The camera's white balance.
        white_balance: CameraWhiteBalance;
        /// The camera's tone and colour.
        tone: CameraTone;
        /// How its corners darken.
        vignetting: CameraVignetting;
        /// The fringes of its lens.
        aberration: CameraAberration;
        /// What it does to pictures.
        processing: CameraProcessing;
        /// Dirt and drops on its lens.
        soiling: CameraSoiling;
    }
}

section! {
    /// When the camera's rows are exposed. While the robot moves, pictures blur and vertical lines
    /// lean. The truth of each row is that of the middle of its exposure.
    CameraShutter at "camera.shutter" {
        /// How long each row is exposed; 0 for an instant, without motion blur.
        exposure_ms: f64 = 0.0, Real(0.0, 1000.0), "off; 5 to 20 under crowns, 1 in the sun";
        /// From the upper edge of the first row to the lower edge of the last one, for a rolling
        /// shutter: the time between rows times their number; 0 for a global shutter.
        readout_ms: f64 = 0.0, Real(0.0, 1000.0), "off; 10 to 33 of rolling CMOS sensors";
        /// Least number of colour samples for each pixel of a picture with motion blur, one in each
        /// of as many parts of the exposure.
        samples: u32 = 9, Whole(2, 256), "steps of a blur of 9 pixels are not visible";
    }
}

section! {
    /// The noise of the camera's sensor, in electrons (EMVA 1288, linear model), before the tone
    /// curve.
    CameraNoise at "camera.noise" {
        /// Whether there is noise.
        enabled: bool = false, Flag, "off: those who augment add their own";
        /// Electrons that a pixel holds at the light that clips in the standard picture.
        full_well_e: f64 = 10_500.0, Real(10.0, 1e7),
            "Sony IMX273: 40.2 dB at best (EMVA 1288 of Balluff's mvBlueFOX3-2016)";
        /// Read noise, electrons.
        read_noise_e: f64 = 2.4, Real(0.0, 10_000.0), "the same: 71.4 dB of dynamic range";
        /// Amplification before the converter: with 2 a pixel clips at half its full well.
        gain: f64 = 1.0, Real(1.0, 1000.0), "none in good light";
        /// Below this exposure value (ISO 100), each stop doubles the gain.
        gain_below_ev: f64 = 8.0, Real(-20.0, 30.0), "f/2 and 1/60 s, wide open";
        /// Spread of the pixels' sensitivity (PRNU).
        prnu: f64 = 0.008, Real(0.0, 0.5), "0.5 to 1 % of CMOS sensors";
        /// Spread of the pixels' dark level (DSNU), electrons.
        dsnu_e: f64 = 1.0, Real(0.0, 10_000.0), "about 1 of good CMOS sensors";
        /// Bits of the converter.
        bits: u32 = 12, Whole(1, 16), "usual in machine vision";
    }
}

/// Further cameras.
pub(super) const FURTHER_CAMERAS: SectionSpec = SectionSpec {
    path: "cameras",
    doc: " Further cameras on the same robot: a table `[cameras.NAME]` for each, with the keys of \
        `[camera]`; what it leaves out is as in `[camera]`. Their files are in folders of that \
        name. One called `right` writes its pictures to `image_3` and is `P3` in `calib.txt`, as \
        KITTI's right eye.",
    choice: None,
    keys: &[],
    named: None,
    defaults: toml::Table::new,
};
