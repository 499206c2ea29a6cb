//! EPSG codes, by which files name their coordinate reference system.

use std::ops::RangeInclusive;

/// The codes that EPSG gives. Those below are reserved, and those above are users' own.
pub const EPSG_CODES: RangeInclusive<u16> = 1024..=32_766;

/// The code of a name such as `EPSG:25829` or `urn:ogc:def:crs:EPSG::25829`. A compound system,
/// whose parts are separated by commas, has none.
pub(crate) fn code_of_name(name: &str) -> Option<u16> {
    let mut parts = name.rsplit([':', '/']);
    let code = parts.next()?.parse().ok()?;
    // Between the authority and the code may be a version.
    let is_epsg = parts.take(2).any(|part| part.eq_ignore_ascii_case("EPSG"));
    (is_epsg && !name.contains(',') && EPSG_CODES.contains(&code)).then_some(code)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_have_codes() {
        for name in [
            "EPSG:25829",
            "epsg:25829",
            "urn:ogc:def:crs:EPSG::25829",
            "urn:ogc:def:crs:EPSG:9.8:25829",
            "http://www.opengis.net/def/crs/EPSG/0/25829",
        ] {
            assert_eq!(code_of_name(name), Some(25_829), "{name}");
        }
        for name in [
            "",
            "25829",
            "EPSG:",
            "EPSG:1023",
            "EPSG:32767",
            "EPSG:99999",
            "EPSG:-25829",
            "ESRI:25829",
            "urn:ogc:def:crs:OGC:1.3:CRS84",
            "urn:ogc:def:crs,crs:EPSG::25829,crs:EPSG::5773",
        ] {
            assert_eq!(code_of_name(name), None, "{name}");
        }
    }
}
