//! Keys of your own site.

use super::{DATA, LINES, STEMS, TEXT};
use crate::InputPath;
use crate::schema::AllowedValues::{File, Real, Text, Whole};
use crate::schema::section;

section! {
    /// Your own site: what you know of it, from files in projected coordinates such as UTM, metres
    /// east and north. The forest around it, and what the files leave open, is grown as ever.
    Site at "site" {
        /// Easting, in the files' coordinates, of the world's origin.
        origin_x_m: f64 = 0.0, Real(-5e7, 5e7), "the files' own origin";
        /// Northing, in the files' coordinates, of the world's origin.
        origin_y_m: f64 = 0.0, Real(-5e7, 5e7), "the files' own origin";
        /// The EPSG code of the files' coordinates, such as 25829 for UTM zone 29N: 0, or from 1024
        /// on. 0 is the code that the files say, if one says it: GeoTIFF does, and GeoJSON of
        /// ogr2ogr.
        epsg: u32 = 0, Whole(0, 32_766), "what the files say";
    }
    plus {
        /// Its trees.
        stems: SiteStems;
        /// Its ground.
        terrain: SiteTerrain;
        /// Its trails.
        trails: SiteTrails;
    }
}

section! {
    /// The trails of a site, which run where they do, carved and covered as `[trails]` says. They
    /// are there whatever `trails.enabled` says, which is about trails of chance.
    SiteTrails at "site.trails" {
        /// The middles of trails: GeoJSON with LineStrings, or CSV with the columns trail, x_m,
        /// y_m.
        path: InputPath = InputPath::default(), File(LINES), "none";
    }
}

section! {
    /// The trees of a plot: they stand where the stem map has them, as thick and as high as it
    /// says. What it does not say is drawn from the relations of their species, and species from
    /// the shares in `[assets]`, or if these are all 0 from those of the map.
    SiteStems at "site.stems" {
        /// A stem map: CSV with the columns x_m, y_m and, if known, species, dbh_m or dbh_cm,
        /// height_m, alive.
        path: InputPath = InputPath::default(), File(STEMS), "none";
        /// The species that stands for those of the map which are not among ours; empty to refuse
        /// them.
        other_species: String = String::new(), Text, "a wrong name should not go unseen";
        /// No other tree stands inside the area that the stems span, nor nearer to it than this.
        margin_m: f64 = 3.0, Real(0.0, 100.0), "our choice: half the distance of trees";
        /// How many different trees are grown of each species, living and dead ones apart. A stem
        /// is the nearest of them in diameter and height, brought to exactly its own.
        shapes: u32 = 24, Whole(1, 128), "our choice: of 600 trees, none is more than a sixth off";
    }
}

section! {
    /// The ground of a site: a height map, over the terrain of `[terrain]`, into which it passes
    /// beyond its edges. Holes in it are filled. Trails are carved into both.
    SiteTerrain at "site.terrain" {
        /// A height map: GeoTIFF, or 16-bit grey PNG with a sidecar. It is the bare ground.
        path: InputPath = InputPath::default(), File(DATA), "none";
        /// What a PNG does not say, JSON or TOML, as on the guide's page on your own site.
        sidecar: InputPath = InputPath::default(), File(TEXT), "none";
        /// The height, in the file, of the world's zero. The terrain around is up to
        /// `terrain.max_height_m` high.
        origin_z_m: f64 = 0.0, Real(-10_000.0, 10_000.0), "the file's own";
        /// The width of the passage into the terrain around.
        blend_m: f64 = 40.0, Real(1.0, 2000.0), "our choice: slopes that one can walk";
    }
}
