//! Coordinate reference systems by their EPSG codes.
//!
//! The definitions are those of the crate `crs-definitions`, from PostGIS.

/// A coordinate reference system.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Crs {
    /// Its name, such as `ETRS89 / UTM zone 29N`.
    pub name: &'static str,
    /// Its definition as OGC WKT 1 (OGC 01-009), if it is one that sites may have: projected, in
    /// metres, and not one of the whole world, whose metres are those of the ground along one
    /// parallel only.
    pub wkt: Option<String>,
    /// Of a compound system, which has heights, too, the code of that of its map.
    pub map_epsg: Option<u16>,
}

impl Crs {
    /// The system that has a code; `None` if it is not known.
    #[must_use]
    pub fn of_epsg(code: u16) -> Option<Self> {
        let text = crs_definitions::from_code(code)?.wkt;
        // Its unit is the last one: those of the system on which it is based are before.
        let unit = text.rfind("UNIT[").map(|at| &text[at..]);
        let in_metres = unit.is_some_and(|unit| unit.starts_with("UNIT[\"metre\",1,"));
        let is_site = text.starts_with("PROJCS[") && in_metres && !is_of_the_world(text);
        Some(Self {
            name: text.split('"').nth(1)?,
            wkt: is_site.then(|| without_shift(text)),
            map_epsg: map_of_compound(text),
        })
    }
}

/// Whether a projection is a cylindrical one of the whole world: Mercator's that is true to scale
/// at the equator, as that of web maps is, of which a metre at 50° north is 0.64 m of the ground,
/// and those that stretch east and north differently.
fn is_of_the_world(wkt: &str) -> bool {
    let is = |projection: &str| wkt.contains(&format!("PROJECTION[\"{projection}\"]"));
    (is("Mercator_1SP") && wkt.contains("PARAMETER[\"scale_factor\",1]"))
        || is("Equirectangular")
        || is("Cylindrical_Equal_Area")
}

/// The code of the map's system in a compound one, which is the first of its two.
fn map_of_compound(wkt: &str) -> Option<u16> {
    let parts = wkt.strip_prefix("COMPD_CS[")?;
    let (map, _heights) = parts.split_once(",VERT_CS[")?;
    let code = map.strip_suffix("\"]]")?.rsplit('"').next()?;
    code.parse().ok()
}

/// Without the shift to WGS 84, which is no part of a definition: with it, readers such as PROJ
/// would not recognise the system by its code.
fn without_shift(wkt: &str) -> String {
    const SHIFT: &str = ",TOWGS84[";
    let Some((before, shift)) = wkt.split_once(SHIFT) else {
        return wkt.to_owned();
    };
    let after = shift.split_once(']').map_or("", |(_, after)| after);
    format!("{before}{after}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn utm_is_as_it_is_defined() {
        // Snyder 1987, table 8, and the ellipsoids' own constants.
        let utm = |code: u16| Crs::of_epsg(code).expect("known").wkt.expect("in metres");
        for (first, name, datum, ellipsoid) in [
            (
                32_600,
                "WGS 84 / UTM zone",
                "WGS_1984",
                "6378137,298.257223563",
            ),
            (
                25_800,
                "ETRS89 / UTM zone",
                "European_Terrestrial_Reference_System_1989",
                "6378137,298.257222101",
            ),
        ] {
            for zone in 28..=37_u16 {
                let code = first + zone;
                let wkt = utm(code);
                let meridian = i32::from(zone) * 6 - 183;
                for part in [
                    &*format!("PROJCS[\"{name} {zone}N\","),
                    &format!("DATUM[\"{datum}\","),
                    &format!("{ellipsoid},"),
                    "PROJECTION[\"Transverse_Mercator\"]",
                    "PARAMETER[\"latitude_of_origin\",0]",
                    &format!("PARAMETER[\"central_meridian\",{meridian}]"),
                    "PARAMETER[\"scale_factor\",0.9996]",
                    "PARAMETER[\"false_easting\",500000]",
                    "PARAMETER[\"false_northing\",0]",
                ] {
                    assert!(wkt.contains(part), "{part}: {wkt}");
                }
                assert!(
                    wkt.ends_with(&format!("AUTHORITY[\"EPSG\",\"{code}\"]]")),
                    "{wkt}"
                );
                assert!(!wkt.contains("TOWGS84"), "{wkt}");
            }
        }
        let south = utm(32_721);
        assert!(
            south.contains("PARAMETER[\"false_northing\",10000000]"),
            "{south}"
        );
    }

    #[test]
    fn all_are_whole_and_what_is_no_site_has_no_text() {
        let known = (1024..=32_766).filter_map(|code| Some((code, Crs::of_epsg(code)?)));
        let (mut sites, mut others) = (0, 0);
        for (code, Crs { name, wkt, .. }) in known {
            assert!(!name.is_empty(), "{code}");
            let Some(wkt) = wkt else {
                others += 1;
                continue;
            };
            sites += 1;
            let (mut depth, mut is_text) = (0, false);
            for (at, byte) in wkt.bytes().enumerate() {
                match byte {
                    b'"' => is_text = !is_text,
                    b'[' if !is_text => depth += 1,
                    b']' if !is_text => depth -= 1,
                    _ => {}
                }
                assert!(depth > 0 || at < 6 || at + 1 == wkt.len(), "{code}: {wkt}");
            }
            assert_eq!((depth, is_text), (0, false), "{code}: {wkt}");
            assert!(
                wkt.is_ascii() && wkt.ends_with(&format!("\"{code}\"]]")),
                "{wkt}"
            );
        }
        assert!(sites > 3_900 && others > 1_500, "{sites} {others}");
        // Degrees, feet, a height system, and a code that nothing has.
        assert_eq!(
            Crs::of_epsg(4326).map(|c| (c.name, c.wkt)),
            Some(("WGS 84", None))
        );
        assert_eq!(Crs::of_epsg(2263).and_then(|c| c.wkt), None);
        assert_eq!(Crs::of_epsg(5773).and_then(|c| c.wkt), None);
        assert_eq!(Crs::of_epsg(1024), None);
    }

    #[test]
    fn metres_of_a_map_of_the_world_are_no_metres() {
        let is_site = |code| Crs::of_epsg(code).expect("known").wkt.is_some();
        // Web maps, World Mercator, PDC Mercator, Mercator 41, and their older codes; Plate Carree,
        // other equidistant cylinders, EASE-Grid.
        for code in [
            3857, 3785, 3395, 3832, 3349, 3752, 32_662, 32_663, 4087, 4088, 3786, 6933, 3410, 3975,
        ] {
            assert!(!is_site(code), "{code}");
        }
        // Mercator's of a part of the world: Celebes, the Caspian Sea, New Zealand, Brazil; and
        // conformal ones of countries.
        for code in [
            3002, 3388, 3994, 5641, 32_632, 31_467, 2154, 2056, 3067, 3844, 5514,
        ] {
            assert!(is_site(code), "{code}");
        }
    }

    #[test]
    fn a_compound_system_knows_the_code_of_its_map() {
        let map = |code| Crs::of_epsg(code).and_then(|crs| crs.map_epsg);
        assert_eq!(map(5555), Some(25_832));
        assert_eq!(map(6871), Some(3857));
        // Degrees and heights.
        assert_eq!(map(5498), Some(4269));
        for simple in [25_832, 3857, 2263, 4326] {
            assert_eq!(map(simple), None, "{simple}");
        }
        let known = (1024..=32_766).filter_map(map);
        let mut count = 0;
        for code in known {
            assert!(Crs::of_epsg(code).is_some(), "{code}");
            count += 1;
        }
        assert!(count > 250, "{count}");
    }
}
