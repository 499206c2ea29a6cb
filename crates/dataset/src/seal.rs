//! JSON with a checksum that shows whether it was changed.

/// The text before the digest, between digest and content, and after the content.
const BEFORE: &str = "{\"blake3\":\"";
const BETWEEN: &str = "\",\"content\":";
const AFTER: &str = "}";
const DIGEST: usize = 64;

/// `{"blake3": DIGEST, "content": JSON}`, where the digest is of the bytes of `json`.
pub(crate) fn seal(json: &str) -> String {
    let digest = blake3::hash(json.as_bytes()).to_hex();
    format!("{BEFORE}{digest}{BETWEEN}{json}{AFTER}\n")
}

/// The content of a file that [`seal`] has made; `None` if a byte differs.
pub(crate) fn unseal(text: &str) -> Option<&str> {
    let (digest, rest) = text.strip_prefix(BEFORE)?.split_at_checked(DIGEST)?;
    let json = rest.strip_prefix(BETWEEN)?.trim_end().strip_suffix(AFTER)?;
    (*blake3::hash(json.as_bytes()).to_hex() == *digest).then_some(json)
}

/// In a stamped text its own digest follows this mark; while it is computed, zeros are in its
/// place.
const MARK: &str = "\"checksum\": \"";

/// Fills in the digest of a text that has [`MARK`] and room for it. It shows whether `dataset.json`
/// was changed.
pub(crate) fn stamp(text: &str) -> String {
    let Some(at) = place(text) else {
        return text.to_owned();
    };
    let blank = blanked(text, at);
    let digest = blake3::hash(blank.as_bytes()).to_hex();
    format!("{}{digest}{}", &blank[..at], &blank[at + DIGEST..])
}

/// Whether a text is equal to what [`stamp`] made.
pub(crate) fn is_stamped(text: &str) -> bool {
    place(text).is_some_and(|at| {
        let digest = blake3::hash(blanked(text, at).as_bytes()).to_hex();
        text[at..at + DIGEST] == *digest
    })
}

/// Room for a digest.
pub(crate) fn blank() -> String {
    "0".repeat(DIGEST)
}

fn place(text: &str) -> Option<usize> {
    let at = text.find(MARK)? + MARK.len();
    let digest = text.get(at..at + DIGEST)?;
    (digest.bytes().all(|b| b.is_ascii_hexdigit())).then_some(at)
}

fn blanked(text: &str, at: usize) -> String {
    format!("{}{}{}", &text[..at], blank(), &text[at + DIGEST..])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn any_changed_byte_is_seen(at in 0_usize..200, to in 0_u8..128) {
            let json = "{\"a\": 1.5, \"b\": [\"x\"]}";
            for sealed in [
                seal(json),
                stamp(&format!("{{ {MARK}{}\", \"a\": 1 }}", blank())),
            ] {
                let whole = |text: &str| unseal(text) == Some(json) || is_stamped(text);
                prop_assert!(whole(&sealed));
                let mut bytes = sealed.clone().into_bytes();
                let at = at % bytes.len();
                bytes[at] = to;
                let changed = String::from_utf8(bytes).expect("ASCII");
                // White space after a sealed text does not count as content.
                prop_assert!(
                    changed == sealed
                        || !whole(&changed)
                        || changed.trim_end() == sealed.trim_end()
                );
            }
        }
    }

    #[test]
    fn cut_off_is_changed() {
        let sealed = seal("{\"frame\": 7}");
        for length in 0..sealed.len() - 1 {
            assert_eq!(unseal(&sealed[..length]), None, "{length}");
        }
        assert!(!is_stamped("") && !is_stamped(MARK));
    }
}
