//! Content keys.

use std::fmt;

/// 256 bits that identify a value before it exists.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Fingerprint(pub [u8; 32]);

impl fmt::Display for Fingerprint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Debug for Fingerprint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// Collects what a value depends on, with an explicit and portable encoding. `std::hash::Hash` is
/// not used, as its encoding is not guaranteed.
#[derive(Clone, Debug)]
pub struct Hasher(blake3::Hasher);

impl Hasher {
    /// A hasher for one kind of thing.
    #[must_use]
    pub fn new(domain: &str) -> Self {
        let mut hasher = Self(blake3::Hasher::new());
        hasher.write_str(domain);
        hasher
    }

    /// Bytes, with their number before them, so that neighbouring fields cannot run together.
    pub fn write_bytes(&mut self, bytes: &[u8]) {
        self.0.update(&(bytes.len() as u64).to_le_bytes());
        self.0.update(bytes);
    }

    /// A string.
    pub fn write_str(&mut self, text: &str) {
        self.write_bytes(text.as_bytes());
    }

    /// One byte that says what follows.
    pub fn write_tag(&mut self, tag: u8) {
        self.0.update(&[tag]);
    }

    /// An unsigned number.
    pub fn write_u64(&mut self, value: u64) {
        self.0.update(&value.to_le_bytes());
    }

    /// A signed number.
    pub fn write_i64(&mut self, value: i64) {
        self.0.update(&value.to_le_bytes());
    }

    /// A float, by its bits; both zeros are equal.
    pub fn write_f64(&mut self, value: f64) {
        self.write_u64((value + 0.0).to_bits());
    }

    /// The key of all that was written.
    #[must_use]
    pub fn finish(&self) -> Fingerprint {
        Fingerprint(*self.0.finalize().as_bytes())
    }
}
