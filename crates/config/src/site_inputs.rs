//! What the files of a site say: its trees, its ground and its trails.

use std::sync::Arc;

use nemoral_convert::Crs;
use nemoral_import::{
    EPSG_CODES, HeightMap, HeightPngSidecar, ImportError, Stem, TrailLines, read_stem_map,
};
use nemoral_scene::glam::DVec2;
use nemoral_terrain::HeightPosts;

use super::{Config, Error, InputFile, InputFiles, Site};

fn wrong(file: &InputFile, e: &ImportError) -> Error {
    Error::request(format!("{}: {e}", file.path().display()))
}

impl Site {
    /// The trees of the stem map; `None` without one.
    ///
    /// # Errors
    /// If the file is no stem map.
    pub fn stem_map(&self, inputs: &InputFiles) -> Result<Option<Vec<Stem>>, Error> {
        let Some(file) = inputs.get(&self.stems.path) else {
            return Ok(None);
        };
        let stems = read_stem_map(file.bytes()).map_err(|e| wrong(file, &e))?;
        Ok(Some(stems))
    }

    /// The place of a tree of the stem map in the world.
    #[must_use]
    pub fn position_m(&self, stem: &Stem) -> DVec2 {
        DVec2::new(stem.x_m - self.origin_x_m, stem.y_m - self.origin_y_m)
    }

    /// The height map; `None` without one.
    ///
    /// # Errors
    /// If the file is no height map, or a PNG without its sidecar.
    pub fn height_map(&self, inputs: &InputFiles) -> Result<Option<Arc<HeightMap>>, Error> {
        let Some(file) = inputs.get(&self.terrain.path) else {
            return Ok(None);
        };
        if !HeightMap::needs_sidecar(file.bytes()) {
            return file.height_map().map(Some).map_err(|e| wrong(file, &e));
        }
        let sidecar = {
            let sidecar = inputs.get(&self.terrain.sidecar).ok_or_else(|| {
                let path = file.path().display();
                Error::request(format!(
                    "{path}: a PNG needs site.terrain.sidecar, a file that says where it lies and \
                     how high"
                ))
            })?;
            HeightPngSidecar::read(sidecar.bytes()).map_err(|e| wrong(sidecar, &e))?
        };
        let map = HeightMap::from_png(file.bytes(), &sidecar).map_err(|e| wrong(file, &e))?;
        Ok(Some(Arc::new(map)))
    }

    /// The posts of a height map in the world.
    #[must_use]
    pub fn height_posts(&self, map: &HeightMap) -> HeightPosts {
        let origin_z_m = self.terrain.origin_z_m;
        HeightPosts {
            columns: map.columns,
            first_m: DVec2::new(map.west_m - self.origin_x_m, map.north_m - self.origin_y_m),
            spacing_m: map.spacing_m,
            heights_m: (map.heights_m.iter())
                .map(|&h| (f64::from(h) - origin_z_m) as f32)
                .collect(),
        }
    }

    /// The trail lines in the world; none without a file.
    ///
    /// # Errors
    /// If the file has no trail lines.
    pub fn trail_lines_m(&self, inputs: &InputFiles) -> Result<Vec<Vec<DVec2>>, Error> {
        let Some(trails) = self.trail_lines(inputs)? else {
            return Ok(Vec::new());
        };
        let place = |[x, y]: [f64; 2]| DVec2::new(x - self.origin_x_m, y - self.origin_y_m);
        let of_line =
            |line: &nemoral_import::TrailLine| line.vertices_m.iter().copied().map(place).collect();
        Ok(trails.lines.iter().map(of_line).collect())
    }

    /// The trail lines as their file has them; `None` without a file.
    fn trail_lines(&self, inputs: &InputFiles) -> Result<Option<Arc<TrailLines>>, Error> {
        let Some(file) = inputs.get(&self.trails.path) else {
            return Ok(None);
        };
        file.trail_lines().map(Some).map_err(|e| wrong(file, &e))
    }
}

impl Config {
    /// The EPSG code of the site's coordinates: `site.epsg`, or what the site's files say; `None`
    /// if nothing says it.
    ///
    /// # Errors
    /// If two of them disagree, if the code is none of a projected system whose metres are those of
    /// the ground, or if a file cannot be read.
    pub fn site_epsg(&self, inputs: &InputFiles) -> Result<Option<u16>, Error> {
        let site = &self.site;
        let asked = u16::try_from(site.epsg).ok().filter(|code| *code != 0);
        if asked.is_some_and(|code| !EPSG_CODES.contains(&code)) {
            let (low, high) = (EPSG_CODES.start(), EPSG_CODES.end());
            let message = format!("site.epsg = {}: must be 0, or {low} to {high}", site.epsg);
            return Err(Error::request(message));
        }
        // A file may name a system of more than the map, of which the config says the map's part.
        let is_asked = |code: &u16| {
            let map = Crs::of_epsg(*code).and_then(|crs| crs.map_epsg);
            asked.is_some() && map == asked
        };
        let of_map = site.height_map(inputs)?.and_then(|map| map.epsg);
        let of_lines = site.trail_lines(inputs)?.and_then(|trails| trails.epsg);
        let [of_map, of_lines] = [of_map, of_lines].map(|code| code.filter(|code| !is_asked(code)));
        let said = [
            ("the config", asked),
            (site.terrain.path.as_str(), of_map),
            (site.trails.path.as_str(), of_lines),
        ];
        let mut said = said
            .into_iter()
            .filter_map(|(who, code)| Some((who, code?)));
        let Some((first, code)) = said.next() else {
            return Ok(None);
        };
        if let Some((other, of_other)) = said.find(|(_, of_other)| *of_other != code) {
            return Err(Error::request(format!(
                "site.epsg: {first} says EPSG:{code}, and {other} says EPSG:{of_other}: a site has \
                 one coordinate reference system"
            )));
        }
        match Crs::of_epsg(code) {
            Some(Crs {
                name, wkt: None, ..
            }) => Err(Error::request(format!(
                "site.epsg: {first} says EPSG:{code}, which is {name}: must be a conformal \
                 projected system in metres that is true to scale at the site, such as UTM; none \
                 of degrees, of feet or of the whole world, such as Web Mercator"
            ))),
            _ => Ok(Some(code)),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::ConfigLayers;

    /// Trail lines with a name of their coordinates, or without one.
    fn trails(folder: &Path, name: &str) -> String {
        let crs = match name {
            "" => String::new(),
            _ => format!(r#""crs":{{"type":"name","properties":{{"name":"{name}"}}}},"#),
        };
        let text = format!(
            r#"{{"type":"FeatureCollection",{crs}"features":[{{"type":"Feature","geometry":
            {{"type":"LineString","coordinates":[[553196,4450288],[553195,4450352]]}}}}]}}"#
        );
        let path = folder.join(format!("{}.geojson", name.replace(':', "_")));
        nemoral_files::write(&path, text.as_bytes()).expect("written");
        format!("site.trails.path={}", path.display())
    }

    fn load(settings: &[&str]) -> Result<(Config, InputFiles), String> {
        let origin = ["site.origin_x_m=553220", "site.origin_y_m=4450330"];
        let settings = origin.iter().chain(settings).map(|s| (*s).to_owned());
        let layers = ConfigLayers {
            settings: settings.collect(),
            ..ConfigLayers::default()
        };
        let config = layers.load().map_err(|e| e.to_string())?;
        let inputs = InputFiles::read(&config).expect("readable");
        Ok((config, inputs))
    }

    fn epsg(settings: &[&str]) -> Result<Option<u16>, String> {
        let (config, inputs) = load(settings)?;
        config.site_epsg(&inputs).map_err(|e| e.to_string())
    }

    #[test]
    fn the_config_or_a_file_says_which_coordinates_a_site_has() {
        let dir = tempfile::tempdir().expect("a folder");
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/site/terrain.tif");
        let terrain = &format!("site.terrain.path={}", path.display());
        let of_lines = |name: &str| trails(dir.path(), name);
        let (same, other) = (
            &of_lines("EPSG:32629"),
            &of_lines("urn:ogc:def:crs:EPSG::32630"),
        );
        let unnamed = &of_lines("");
        assert_eq!(epsg(&[]), Ok(None));
        assert_eq!(epsg(&[unnamed]), Ok(None));
        assert_eq!(epsg(&[terrain]), Ok(Some(32_629)));
        assert_eq!(epsg(&[other]), Ok(Some(32_630)));
        assert_eq!(epsg(&[terrain, unnamed]), Ok(Some(32_629)));
        assert_eq!(epsg(&[terrain, same, "site.epsg=32629"]), Ok(Some(32_629)));
        assert_eq!(epsg(&["site.epsg=25829"]), Ok(Some(25_829)));
        // One that is not known here.
        assert_eq!(epsg(&["site.epsg=1024"]), Ok(Some(1024)));

        let refused = |settings: &[&str]| epsg(settings).expect_err("refused");
        let text = refused(&[terrain, other]);
        for part in [
            "terrain.tif says EPSG:32629",
            "_32630.geojson says EPSG:32630",
        ] {
            assert!(text.contains(part), "{text}");
        }
        let text = refused(&[terrain, "site.epsg=25829"]);
        assert!(
            text.contains("site.epsg: the config says EPSG:25829"),
            "{text}"
        );
        assert!(text.contains("terrain.tif says EPSG:32629"), "{text}");
        let text = refused(&[same, "site.epsg=25829"]);
        assert!(
            text.contains("EPSG_32629.geojson says EPSG:32629"),
            "{text}"
        );
        let text = refused(&["site.epsg=1023"]);
        assert!(text.contains("1023: must be 0, or 1024 to 32766"), "{text}");
        assert!(refused(&["site.epsg=32767"]).contains("site.epsg"));
        assert!(refused(&["site.epsg=-1"]).contains("site.epsg"));
        // Degrees, and feet.
        let text = refused(&["site.epsg=4326"]);
        assert!(
            text.contains("EPSG:4326, which is WGS 84: must be"),
            "{text}"
        );
        assert!(refused(&["site.epsg=2263"]).contains("in metres"));
        // Web maps, of which a metre is none of the ground.
        let web = &of_lines("EPSG:3857");
        for text in [refused(&["site.epsg=3857"]), refused(&[web])] {
            assert!(
                text.contains("Pseudo-Mercator: must be a conformal"),
                "{text}"
            );
        }
        // A file in feet, in degrees or of a web map does not lie where the config says.
        for (lines, code) in [
            (&of_lines("EPSG:2263"), 2263),
            (&of_lines("EPSG:4326"), 4326),
        ] {
            let text = refused(&[lines, "site.epsg=32618"]);
            for part in ["says EPSG:32618", &format!("says EPSG:{code}")] {
                assert!(text.contains(part), "{text}");
            }
        }
        assert!(refused(&[web, "site.epsg=32629"]).contains("says EPSG:3857"));
        // A file that cannot be read is said once.
        let broken = dir.path().join("broken.geojson");
        nemoral_files::write(&broken, b"{").expect("written");
        let text = refused(&[terrain, &format!("site.trails.path={}", broken.display())]);
        assert_eq!(text.matches("is no GeoJSON").count(), 1, "{text}");
        // A system of heights, too, of which the config says the map's part.
        let compound = &of_lines("EPSG:5555");
        assert!(refused(&[compound]).contains("EPSG:5555"));
        assert_eq!(epsg(&[compound, "site.epsg=25832"]), Ok(Some(25_832)));
        let text = refused(&[compound, "site.epsg=25833"]);
        assert!(text.contains("says EPSG:5555"), "{text}");
    }
}
