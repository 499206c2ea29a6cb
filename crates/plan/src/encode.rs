//! The encoding of parameters in keys.

use std::collections::BTreeMap;

use crate::Hasher;

/// Receives the parts of a value from [`Encode`], in a fixed order.
///
/// Parts have names, so that fields of the same type are not mistaken for one another, and values
/// have types, so that values of equal text and different types differ.
pub trait Encoder {
    /// A named part begins.
    fn open(&mut self, name: &str);

    /// The part ends.
    fn close(&mut self);

    /// A number of items follows.
    fn count(&mut self, items: usize);

    /// A whole number from 0.
    fn whole(&mut self, value: u64);

    /// A whole number of either sign.
    fn signed(&mut self, value: i64);

    /// A real number.
    fn real(&mut self, value: f64);

    /// True or false.
    fn flag(&mut self, value: bool);

    /// Text.
    fn text(&mut self, value: &str);

    /// A file, which is encoded by its content and not by its name. The path is empty for no file.
    fn file(&mut self, path: &str);
}

impl dyn Encoder + '_ {
    /// A named part.
    pub fn field(&mut self, name: &str, value: &dyn Encode) {
        self.open(name);
        value.encode(self);
        self.close();
    }
}

/// A value that keys are made of. Its encoding is written out rather than derived, so that it
/// changes only deliberately and not with a release of Rust or of a package.
///
/// Structs are destructured by `let Self { a, b } = self;`, without `..`, so that an added field
/// that is forgotten here does not compile.
pub trait Encode {
    /// Passes all parts of the value to the encoder.
    fn encode(&self, encoder: &mut dyn Encoder);
}

macro_rules! encode_as {
    ($($type:ty: $method:ident as $wide:ty;)*) => {$(
        impl Encode for $type {
            fn encode(&self, encoder: &mut dyn Encoder) {
                encoder.$method(<$wide>::from(*self));
            }
        }
    )*};
}

encode_as! {
    bool: flag as bool;
    u8: whole as u64;
    u32: whole as u64;
    u64: whole as u64;
    i32: signed as i64;
    i64: signed as i64;
    f32: real as f64;
    f64: real as f64;
}

impl Encode for str {
    fn encode(&self, encoder: &mut dyn Encoder) {
        encoder.text(self);
    }
}

impl Encode for String {
    fn encode(&self, encoder: &mut dyn Encoder) {
        encoder.text(self);
    }
}

impl<T: Encode> Encode for [T] {
    fn encode(&self, encoder: &mut dyn Encoder) {
        encoder.count(self.len());
        for item in self {
            item.encode(encoder);
        }
    }
}

impl<T: Encode> Encode for Vec<T> {
    fn encode(&self, encoder: &mut dyn Encoder) {
        self.as_slice().encode(encoder);
    }
}

impl<T: Encode, const N: usize> Encode for [T; N] {
    fn encode(&self, encoder: &mut dyn Encoder) {
        self.as_slice().encode(encoder);
    }
}

impl<T: Encode> Encode for Option<T> {
    fn encode(&self, encoder: &mut dyn Encoder) {
        self.as_slice().encode(encoder);
    }
}

impl<T: Encode> Encode for BTreeMap<String, T> {
    fn encode(&self, encoder: &mut dyn Encoder) {
        encoder.count(self.len());
        for (name, value) in self {
            encoder.open(name);
            value.encode(encoder);
            encoder.close();
        }
    }
}

/// An [`Encoder`] that hashes.
pub struct KeyEncoder<'a> {
    hasher: &'a mut Hasher,
    digest: &'a dyn Fn(&str) -> [u8; 32],
}

impl<'a> KeyEncoder<'a> {
    /// Hashes into `hasher`; `digest` gives the digest of a file's content by its path.
    pub fn new(hasher: &'a mut Hasher, digest: &'a dyn Fn(&str) -> [u8; 32]) -> Self {
        Self { hasher, digest }
    }
}

impl std::fmt::Debug for KeyEncoder<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("KeyEncoder").finish_non_exhaustive()
    }
}

/// One byte before each part tells its type.
impl Encoder for KeyEncoder<'_> {
    fn open(&mut self, name: &str) {
        self.hasher.write_tag(b'(');
        self.hasher.write_str(name);
    }

    fn close(&mut self) {
        self.hasher.write_tag(b')');
    }

    fn count(&mut self, items: usize) {
        self.hasher.write_tag(b'#');
        self.hasher.write_u64(items as u64);
    }

    fn whole(&mut self, value: u64) {
        self.hasher.write_tag(b'u');
        self.hasher.write_u64(value);
    }

    fn signed(&mut self, value: i64) {
        self.hasher.write_tag(b'i');
        self.hasher.write_i64(value);
    }

    fn real(&mut self, value: f64) {
        self.hasher.write_tag(b'f');
        self.hasher.write_f64(value);
    }

    fn flag(&mut self, value: bool) {
        self.hasher.write_tag(if value { b'T' } else { b'F' });
    }

    fn text(&mut self, value: &str) {
        self.hasher.write_tag(b's');
        self.hasher.write_str(value);
    }

    fn file(&mut self, path: &str) {
        if path.is_empty() {
            self.hasher.write_tag(b'-');
        } else {
            self.hasher.write_tag(b'@');
            let digest = (self.digest)(path);
            self.hasher.write_bytes(&digest);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(value: &dyn Encode) -> crate::Fingerprint {
        let mut hasher = Hasher::new("test");
        value.encode(&mut KeyEncoder::new(&mut hasher, &|_| [7; 32]));
        hasher.finish()
    }

    struct Point {
        x: f64,
        y: u32,
    }

    impl Encode for Point {
        fn encode(&self, encoder: &mut dyn Encoder) {
            let Self { x, y } = self;
            encoder.field("x", x);
            encoder.field("y", y);
        }
    }

    /// The bytes are part of the interface: changing them changes all keys.
    #[test]
    fn the_encoding_is_written_down() {
        let mut expected = Hasher::new("test");
        for (name, tag, bytes) in [("x", b'f', 0.5_f64.to_bits()), ("y", b'u', 3)] {
            expected.write_tag(b'(');
            expected.write_str(name);
            expected.write_tag(tag);
            expected.write_u64(bytes);
            expected.write_tag(b')');
        }
        assert_eq!(key(&Point { x: 0.5, y: 3 }), expected.finish());
        let golden = "1db20856775250c32976f89ecee09c1e52239489baa14e4238756e190d129234";
        assert_eq!(key(&Point { x: 0.5, y: 3 }).to_string(), golden);
    }

    #[test]
    fn values_that_look_alike_have_keys_of_their_own() {
        let map = |name: &str| BTreeMap::from([(name.to_owned(), 1_u32)]);
        let values: [&dyn Encode; 15] = [
            &0_u32,
            &0_i64,
            &0.0_f64,
            &false,
            &true,
            &1_u64,
            &String::new(),
            &"0".to_owned(),
            &[0_u32; 0],
            &[0_u32],
            &[0_u32, 0],
            &Some("0".to_owned()),
            &map("a"),
            &map("b"),
            &Point { x: 0.0, y: 0 },
        ];
        for (i, a) in values.iter().enumerate() {
            for (k, b) in values.iter().enumerate() {
                assert_eq!(key(*a) == key(*b), i == k, "{i} {k}");
            }
        }
        // The same number has the same key in any integer type, and both zeros are equal.
        assert_eq!(key(&1_u32), key(&1_u64));
        assert_eq!(key(&0.0_f64), key(&-0.0_f64));
    }
}
