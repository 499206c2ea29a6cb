//! Keys of the sun, the sky and the air.

use serde::{Deserialize, Serialize};

use super::DATA;
use crate::InputPath;
use crate::schema::AllowedValues::{File, Flag, Real, Text, Triple, Whole};
use crate::schema::{SectionSpec, encode_variants, section};

section! {
    /// The sun (paper, IV-E).
    Sun at "sun" {
        /// Multiplies the sun's light, and by it the moon's.
        intensity: f64 = 1.0, Real(0.0, 100.0), "physical";
        /// Multiplies its colour, linear red, green, blue.
        colour: [f64; 3] = [1.0; 3], Triple(0.0, 10.0), "physical";
    }
    plus {
        /// The sun's position.
        #[serde(flatten)]
        position: SunPosition;
    }
}

/// The sun's position.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SunPosition {
    /// By angles.
    Angles(SunAngles),
    /// By place, date and time.
    Date(SunDate),
}

encode_variants! { SunPosition
    Angles: "angles";
    Date: "date";
}

impl Default for SunPosition {
    fn default() -> Self {
        Self::Angles(SunAngles::default())
    }
}

section! {
    /// The sun by angles.
    SunAngles at "sun.angles", one of "the sun's position" {
        /// Clockwise from north.
        azimuth_deg: f64 = 215.0, Real(-360.0, 360.0), "early afternoon";
        /// Above the horizon: civil twilight ends at -6, nautical at -12, and night begins at -18.
        elevation_deg: f64 = 48.0, Real(-90.0, 90.0), "spring or autumn at 40 degrees north";
    }
}

section! {
    /// The sun by place, date and time.
    SunDate at "sun.date", one of "the sun's position" {
        /// Latitude, north positive.
        latitude_deg: f64 = 40.2033, Real(-90.0, 90.0), "Coimbra";
        /// Longitude, east positive.
        longitude_deg: f64 = -8.4103, Real(-180.0, 180.0), "Coimbra";
        /// Date and time in UTC.
        utc: String = "2022-06-21T14:30:00".into(), Text, "YYYY-MM-DDThh:mm:ss";
        /// Hours to add to that time (negative: to subtract). As a number it can be drawn from a
        /// range.
        later_h: f64 = 0.0, Real(-8784.0, 8784.0), "that time itself";
    }
}

section! {
    /// The moon, which shines once the sun has set. A clear night without one is lit by stars
    /// alone, too little for any camera. Moonlight needs a `camera.exposure_least_ev` below 0.
    Moon at "moon" {
        /// Share of its disc that is in sunlight: 0 is new moon, 0.5 half and 1 full, which has
        /// eleven times a half moon's light. Below 0 the moon is where it is at the time of
        /// `sun.date`, with its phase, and there is none if the sun has angles.
        illuminated: f64 = -1.0, Real(-1.0, 1.0), "follows the date";
        /// Clockwise from north; of the date, if `illuminated` is.
        azimuth_deg: f64 = 150.0, Real(-360.0, 360.0), "south-east";
        /// Above the horizon; of the date, if `illuminated` is.
        elevation_deg: f64 = 40.0, Real(-90.0, 90.0), "a winter's full moon";
    }
}

section! {
    /// A lamp on the robot: headlight, work light or head torch. Cameras see by it, LiDARs do not;
    /// truth is the same with and without. Objects cast shadows in its light, and fog, rain and
    /// snowfall shine in it. The lamp itself is not seen. It works on the CPU alone.
    Lamp at "lamp" {
        /// Whether it shines.
        enabled: bool = false, Flag, "by day nobody needs it";
        /// All of its light, lumen: 300 is a head torch, 3000 a work light, 12,000 a light bar.
        lumen: f64 = 3000.0, Real(1.0, 1_000_000.0), "a work light of LEDs";
        /// Width of its beam: at the edge the intensity is half of that in the middle.
        beam_deg: f64 = 60.0, Real(10.0, 170.0), "a flood light";
        /// Colour temperature.
        kelvin: f64 = 5700.0, Real(2000.0, 12_000.0), "white LEDs; halogen has 3200";
        /// Radius of the disc that shines, which softens shadows.
        radius_m: f64 = 0.03, Real(0.0, 1.0), "a hand's width in all";
        /// Position in front of the body's origin.
        mount_x_m: f64 = 0.35, Real(-5.0, 5.0), "as the camera's";
        /// Position to the left of it.
        mount_y_m: f64 = 0.25, Real(-5.0, 5.0), "beside the camera, so that it sees shadows";
        /// Height above the ground.
        mount_z_m: f64 = 1.1, Real(0.0, 50.0), "below the camera";
        /// Rotation to the left.
        mount_yaw_deg: f64 = 0.0, Real(-180.0, 180.0), "forward";
        /// Pitch, downwards.
        mount_pitch_deg: f64 = 3.0, Real(-90.0, 90.0), "to the ground 20 m ahead";
    }
}

/// Further lamps.
pub(super) const FURTHER_LAMPS: SectionSpec = SectionSpec {
    path: "lamps",
    doc: " Further lamps on the same robot: a table `[lamps.NAME]` for each, with the keys of \
        `[lamp]`; what it leaves out is as in `[lamp]`, so it shines if that does.",
    choice: None,
    keys: &[],
    named: None,
    defaults: toml::Table::new,
};

section! {
    /// The time of the year. Leaves unfold, turn and fall; bracken, herbs and grass die down, and
    /// fresh litter lies. The sun does not follow it: `[sun]` does. Where things stand and how low
    /// plants grew does not depend on it.
    Season at "season" {
        /// The day of the year; 0 for that of `sun.date`, or high summer if the sun has angles. In
        /// the north 105 is spring, 290 autumn and 20 winter.
        day_of_year: u32 = 0, Whole(0, 366), "high summer";
        /// The latitude that says when buds burst and leaves fall, north positive; of `sun.date`,
        /// if that gives the day.
        latitude_deg: f64 = 50.0, Real(-70.0, 70.0), "central Europe";
    }
}

section! {
    /// The sky that lights the scene.
    Sky at "sky" {
        /// Haze: 2 very clear, 3 clear, 6 hazy.
        turbidity: f64 = 3.0, Real(1.8, 10.0), "Preetham 1999";
        /// Share of cloud: 0 clear, 1 overcast.
        overcast: f64 = 0.0, Real(0.0, 1.0), "clear";
        /// A photographed sky instead: an equirectangular Radiance (.hdr) or OpenEXR file, zenith
        /// on top. It is visible in gaps and lights the scene as brightly as the modelled sky
        /// would. The sun is still that of `[sun]`; the one in the image is removed.
        image: InputPath = InputPath::default(), File(DATA), "none";
        /// Direction of the middle column of that image, clockwise from north.
        image_azimuth_deg: f64 = 0.0, Real(-360.0, 360.0), "north";
        /// Multiplies that image's light.
        image_gain: f64 = 1.0, Real(0.001, 1000.0), "as bright as the modelled sky";
    }
}

section! {
    /// The air near the ground, for cameras and LiDARs: visibility, fog, falling rain and snow; and
    /// how wet everything is, and how deep snow lies.
    Weather at "weather" {
        /// Meteorological visibility at the camera's height: the distance at which 2 % of the
        /// contrast is left. It is haze below 10,000 and mist below 2000.
        visibility_m: f64 = 20_000.0, Real(10.0, 1_000_000.0), "a clear day; Koschmieder 1924";
        /// The height over which that haze decreases by a factor of e.
        haze_height_m: f64 = 100.0, Real(1.0, 10_000.0),
            "a shallow layer: crowns against the sky stay clear";
        /// Extinction of fog at its base, which is 3.912 over the visibility there; 0 for no fog.
        fog_per_m: f64 = 0.0, Real(0.0, 1.0), "none";
        /// The height in the world at which fog has that extinction; below, it is denser.
        fog_base_m: f64 = 0.0, Real(-1000.0, 10_000.0), "where the terrain is lowest";
        /// The height over which fog decreases by a factor of e.
        fog_height_m: f64 = 8.0, Real(0.5, 1000.0), "fog on a valley floor";
        /// Rain that falls: 1 is light, 10 heavy, 50 a cloudburst.
        rain_mm_per_h: f64 = 0.0, Real(0.0, 200.0), "none; sizes by Marshall and Palmer 1948";
        /// Snowfall as water: 0.5 is light, 1 moderate, 3 heavy.
        snowfall_mm_per_h: f64 = 0.0, Real(0.0, 20.0), "none; sizes by Gunn and Marshall 1958";
        /// Snow that lies on level ground in the open: half as deep under spruces, four fifths
        /// under bare crowns, a third of that on trails. It covers the ground, rocks, stumps and
        /// logs.
        snow_depth_m: f64 = 0.0, Real(0.0, 0.6), "none";
        /// Share of shoots with needles that hold snow, where some lies; with any, branches do,
        /// too. It falls off within days.
        snow_on_crowns: f64 = 0.0, Real(0.0, 1.0), "none: it has fallen off";
        /// How wet ground, bark, stones and leaves are, from 0, dry, to 1, soaked; below 0 as wet
        /// as an hour of the rain that falls makes them.
        wetness: f64 = -1.0, Real(-1.0, 1.0), "follows the rain";
    }
}
