//! What GDAL writes into a GeoTIFF about the values of its band: scale, offset and unit.
//!
//! It is XML in a tag of its own, with an item for each:
//! ```text
//! <GDALMetadata>
//!   <Item name="OFFSET" sample="0" role="offset">70</Item>
//!   <Item name="SCALE" sample="0" role="scale">0.01</Item>
//!   <Item name="UNITTYPE" sample="0" role="unittype">m</Item>
//! </GDALMetadata>
//! ```

use crate::ImportError;
use crate::error::shown;

/// How the stored values of a band become heights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BandScale {
    /// The height of one step of the values, metres.
    scale_m: f64,
    /// The height of the value 0, metres.
    offset_m: f64,
}

impl Default for BandScale {
    /// Values are heights in metres, as where nothing else is said.
    fn default() -> Self {
        Self {
            scale_m: 1.0,
            offset_m: 0.0,
        }
    }
}

impl BandScale {
    /// That of the first band, by the text of the tag. Items of other bands and roles, and those of
    /// the whole file, say nothing about it.
    ///
    /// # Errors
    /// If scale or offset are no finite numbers, the scale is 0, or the unit is known not to be the
    /// metre.
    pub(crate) fn of(metadata: &str) -> Result<Self, ImportError> {
        let mut scale = Self::default();
        for (attributes, text) in items(metadata) {
            if attribute(attributes, "sample").map(str::trim) != Some("0") {
                continue;
            }
            let text = text.trim();
            match attribute(attributes, "role") {
                Some("scale") => scale.scale_m = number("scale", text, |n| n != 0.0)?,
                Some("offset") => scale.offset_m = number("offset", text, |_| true)?,
                Some("unittype") if is_not_metre(text) => {
                    return Err(ImportError::file(format!(
                        "has heights in {}: convert them to metres",
                        shown(text)
                    )));
                }
                _ => {}
            }
        }
        Ok(scale)
    }

    /// The height of a stored value, metres.
    pub(crate) fn height_m(&self, value: f64) -> f64 {
        self.scale_m * value + self.offset_m
    }
}

/// A finite number that is allowed.
fn number(role: &str, text: &str, is_allowed: fn(f64) -> bool) -> Result<f64, ImportError> {
    let found = text.parse::<f64>().ok();
    let found = found.filter(|n| n.is_finite() && is_allowed(*n));
    found.ok_or_else(|| {
        ImportError::file(format!(
            "has {} as the {role} of its values: must be a finite number, and no scale 0",
            shown(text)
        ))
    })
}

/// Whether a band's unit is one that heights are written in and that is not the metre: feet of any
/// kind, decimetres, centimetres or millimetres. Units have no fixed names, so that others count as
/// metres.
fn is_not_metre(unit: &str) -> bool {
    let unit = unit.to_ascii_lowercase();
    let mut words = unit.split(|c: char| !c.is_ascii_alphanumeric());
    words.any(|word| {
        let starts = [
            "ft", "foot", "feet", "usft", "decimet", "centimet", "millimet",
        ];
        starts.iter().any(|start| word.starts_with(start)) || ["dm", "cm", "mm"].contains(&word)
    })
}

/// The items of the text, each as its attributes and its content.
fn items(xml: &str) -> impl Iterator<Item = (&str, &str)> {
    let starts = xml.split("<Item").skip(1);
    let starts = starts.filter(|item| item.starts_with(|c: char| c.is_ascii_whitespace()));
    starts.filter_map(|item| {
        let (attributes, rest) = item.split_once('>')?;
        let (content, _) = rest.split_once("</Item")?;
        Some((attributes, content))
    })
}

/// The value of an attribute; `None` if there is none of this name.
fn attribute<'a>(attributes: &'a str, name: &str) -> Option<&'a str> {
    let mut rest = attributes;
    loop {
        let (found, after) = rest.split_once('=')?;
        let after = after.trim_start();
        let quote = after.chars().next().filter(|c| ['"', '\''].contains(c))?;
        let (value, next) = after[1..].split_once(quote)?;
        if found.trim() == name {
            return Some(value);
        }
        rest = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn height_m(metadata: &str, value: f64) -> f64 {
        BandScale::of(metadata).expect(metadata).height_m(value)
    }

    #[test]
    fn scale_and_offset_are_those_of_the_first_band() {
        // As GDAL 3.10 writes it.
        let text = "<GDALMetadata>\n  <Item name=\"DESCRIPTION\" sample=\"0\" role=\"description\">\
                    a &amp;gt; 'role=\"scale\"'</Item>\n  <Item name=\"OFFSET\" sample=\"0\" \
                    role=\"offset\">70</Item>\n  <Item name=\"SCALE\" sample=\"0\" \
                    role=\"scale\">0.01</Item>\n  <Item name=\"UNITTYPE\" sample=\"0\" \
                    role=\"unittype\">m</Item>\n</GDALMetadata>\n";
        assert!((height_m(text, 2500.0) - 95.0).abs() < 1e-9);
        // In another order, with other quotes and spaces.
        let other = "<Item role = 'scale'\n sample='0' name='x'> -2.5e-1 </Item >";
        assert_eq!(height_m(other, 8.0), -2.0);
        for says_nothing in [
            "",
            "no XML",
            "<GDALMetadata/>",
            "<Item",
            "<Item role=\"scale\" sample=\"0\">2",
            "<Item role=\"scale\" sample=\"0\"/>\n<Item name=\"x\">3</Item>",
            // Of the whole file, of another band, by its name alone.
            "<Item name=\"SCALE\" role=\"scale\">2</Item>",
            "<Item sample=\"1\" role=\"scale\">2</Item>",
            "<Item name=\"scale\" sample=\"0\">2</Item>",
            "<Item name='role=\"scale\"' sample=\"0\">2</Item>",
            "<Items sample=\"0\" role=\"scale\">2</Items>",
        ] {
            assert_eq!(height_m(says_nothing, 7.5), 7.5, "{says_nothing}");
        }
    }

    #[test]
    fn what_gives_no_heights_in_metres_is_refused() {
        let item =
            |role: &str, text: &str| format!("<Item sample=\"0\" role=\"{role}\">{text}</Item>");
        for (role, text) in [
            ("scale", "0"),
            ("scale", "inf"),
            ("scale", "one"),
            ("offset", ""),
            ("offset", "NaN"),
            ("offset", "1,5"),
        ] {
            let error = BandScale::of(&item(role, text))
                .expect_err(text)
                .to_string();
            assert!(error.contains(&format!("the {role} of its")), "{error}");
        }
        for unit in [
            "ft",
            "US survey foot",
            "ftUS",
            "Feet",
            "us_survey_foot",
            "USft",
            "cm",
            "Centimetres",
            "millimeter",
        ] {
            let error = BandScale::of(&item("unittype", unit)).expect_err(unit);
            assert!(error.to_string().contains("to metres"), "{error}");
        }
        for unit in ["", "m", "metre", "Meters", "m above the sea (lift 3)", "?"] {
            assert_eq!(
                BandScale::of(&item("unittype", unit)),
                Ok(BandScale::default())
            );
        }
    }
}
