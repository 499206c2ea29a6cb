//! One definition for each key: its default, what is allowed, and where the default comes from.
//!
//! The same definition makes the struct, the checks, the commented `config init`, the JSON schema
//! and the reference page.

use toml::Value;

/// What values a key may have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AllowedValues {
    /// A real number, both ends included.
    Real(f64, f64),
    /// A real number, the lower end excluded.
    RealAbove(f64, f64),
    /// A whole number, both ends included.
    Whole(i64, i64),
    /// `true` or `false`.
    Flag,
    /// One of these words.
    OneOf(&'static [&'static str]),
    /// A list of some of these words, each once.
    SomeOf(&'static [&'static str]),
    /// Any text.
    Text,
    /// The path of a file of at most this number of bytes.
    File(u64),
    /// The path of a model, of at most this number of bytes with all files that it names.
    Model(u64),
    /// Three real numbers, both ends included.
    Triple(f64, f64),
    /// A box by two of its corners, six real numbers, both ends included; or none.
    Cuboid(f64, f64),
}

impl AllowedValues {
    /// A description in words, for messages and pages.
    #[must_use]
    pub fn describe(&self) -> String {
        match self {
            Self::Real(low, high) => format!("a number from {low} to {high}"),
            Self::RealAbove(low, high) => format!("a number above {low}, at most {high}"),
            Self::Whole(low, high) => format!("a whole number from {low} to {high}"),
            Self::Flag => "true or false".to_owned(),
            Self::OneOf(words) => format!("one of {}", quoted(words)),
            Self::SomeOf(words) => format!("a list, each at most once, of {}", quoted(words)),
            Self::Text => "text in quotes".to_owned(),
            Self::File(most) => {
                let mib = most >> 20;
                format!("the path of a file of at most {mib} MiB, in quotes")
            }
            Self::Model(most) => {
                let mib = most >> 20;
                format!("the path of a model of at most {mib} MiB with its files, in quotes")
            }
            Self::Triple(low, high) => format!("three numbers from {low} to {high}, [a, b, c]"),
            Self::Cuboid(low, high) => format!(
                "a box, [x0, y0, z0, x1, y1, z1], of numbers from {low} to {high}, each of the \
                 first three below its fellow, or [] for none"
            ),
        }
    }

    /// Whether this value is allowed.
    #[must_use]
    pub fn allows(&self, value: &Value) -> bool {
        match (self, value) {
            (Self::Real(low, high), v) => number(v).is_some_and(|x| (*low..=*high).contains(&x)),
            (Self::RealAbove(low, high), v) => number(v).is_some_and(|x| x > *low && x <= *high),
            (Self::Whole(low, high), Value::Integer(i)) => (low..=high).contains(&i),
            (Self::Flag, Value::Boolean(_))
            | (Self::Text | Self::File(_) | Self::Model(_), Value::String(_)) => true,
            (Self::OneOf(words), Value::String(s)) => words.contains(&s.as_str()),
            (Self::SomeOf(words), Value::Array(list)) => {
                let is_new = |i: usize| !list[..i].contains(&list[i]);
                let is_word = |v: &Value| v.as_str().is_some_and(|s| words.contains(&s));
                list.iter()
                    .enumerate()
                    .all(|(i, v)| is_word(v) && is_new(i))
            }
            (Self::Triple(low, high), Value::Array(a)) => {
                let inside = |v| number(v).is_some_and(|x| (*low..=*high).contains(&x));
                a.len() == 3 && a.iter().all(inside)
            }
            (Self::Cuboid(low, high), Value::Array(a)) => {
                let inside = |v| number(v).filter(|x| (*low..=*high).contains(x));
                let all: Option<Vec<f64>> = a.iter().map(inside).collect();
                all.is_some_and(|c| match c.as_slice() {
                    [] => true,
                    [x0, y0, z0, x1, y1, z1] => x0 < x1 && y0 < y1 && z0 < z1,
                    _ => false,
                })
            }
            _ => false,
        }
    }

    /// The JSON schema of such a value.
    #[must_use]
    pub fn json_schema(&self) -> serde_json::Value {
        use serde_json::json;
        match self {
            Self::Real(low, high) => json!({"type": "number", "minimum": low, "maximum": high}),
            Self::RealAbove(low, high) => {
                json!({"type": "number", "exclusiveMinimum": low, "maximum": high})
            }
            Self::Whole(low, high) => json!({"type": "integer", "minimum": low, "maximum": high}),
            Self::Flag => json!({"type": "boolean"}),
            Self::OneOf(words) => json!({"enum": words}),
            Self::SomeOf(words) => {
                json!({"type": "array", "items": {"enum": words}, "uniqueItems": true})
            }
            Self::Text | Self::File(_) | Self::Model(_) => json!({"type": "string"}),
            Self::Triple(low, high) => json!({
                "type": "array", "minItems": 3, "maxItems": 3,
                "items": {"type": "number", "minimum": low, "maximum": high},
            }),
            Self::Cuboid(low, high) => json!({
                "type": "array",
                "items": {"type": "number", "minimum": low, "maximum": high},
                "anyOf": [{"maxItems": 0}, {"minItems": 6, "maxItems": 6}],
            }),
        }
    }
}

/// Words in quotes, with commas.
fn quoted(words: &[&str]) -> String {
    let quoted: Vec<String> = words.iter().map(|w| format!("\"{w}\"")).collect();
    quoted.join(", ")
}

/// A TOML number, which may be a whole number.
fn number(value: &Value) -> Option<f64> {
    match value {
        Value::Integer(i) => Some(*i as f64),
        Value::Float(f) => Some(*f),
        _ => None,
    }
}

/// A key of a section.
#[derive(Clone, Copy, Debug)]
pub struct KeySpec {
    /// Its name, with its unit.
    pub name: &'static str,
    /// What it does.
    pub doc: &'static str,
    /// Its allowed values.
    pub allowed: AllowedValues,
    /// Where the default comes from.
    pub source: &'static str,
}

/// A table of the config.
#[derive(Clone, Copy, Debug)]
pub struct SectionSpec {
    /// Its dotted path; empty for the root.
    pub path: &'static str,
    /// What it is about.
    pub doc: &'static str,
    /// The choice it is one variant of: at most one table of a choice may be present.
    pub choice: Option<&'static str>,
    /// Its keys.
    pub keys: &'static [KeySpec],
    /// The values of keys whose names users choose; `None` if it has no such keys.
    pub named: Option<AllowedValues>,
    /// The values of its keys where a config has the table but not the keys.
    pub defaults: fn() -> toml::Table,
}

impl SectionSpec {
    /// What values a key of the table may have; `None` if there is no such key.
    #[must_use]
    pub fn allowed(&self, name: &str) -> Option<AllowedValues> {
        let key = self.keys.iter().find(|k| k.name == name);
        key.map(|k| k.allowed).or(self.named)
    }
}

/// Defines a section: the struct, its defaults and its keys. The lines of a comment are joined to
/// the text of its key.
macro_rules! section {
    (
        $( #[doc = $doc:literal] )+
        $name:ident at $path:literal $(, one of $choice:literal)? {
            $(
                $( #[doc = $field_doc:literal] )+
                $field:ident: $type:ty = $default:expr, $allowed:expr, $source:literal;
            )*
        }
        $( plus {
            $(
                $( #[doc = $sub_doc:literal] )+
                $(#[serde($serde:ident)])?
                $sub:ident: $sub_type:ty;
            )*
        } )?
    ) => {
        $( #[doc = $doc] )+
        #[derive(Clone, Debug, PartialEq, serde::Deserialize, serde::Serialize)]
        #[serde(default)]
        #[non_exhaustive]
        pub struct $name {
            $( $( #[doc = $field_doc] )+ pub $field: $type, )*
            $($( $( #[doc = $sub_doc] )+ $(#[serde($serde)])? pub $sub: $sub_type, )*)?
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $( $field: $default, )* $($( $sub: Default::default(), )*)? }
            }
        }

        impl nemoral_plan::Encode for $name {
            fn encode(&self, encoder: &mut dyn nemoral_plan::Encoder) {
                // A field that is missing here does not compile.
                let Self { $( $field, )* $($( $sub, )*)? } = self;
                let _ = &encoder;
                $( encoder.field(stringify!($field), $field); )*
                $($( section!(@encode encoder, $sub $(, $serde)?); )*)?
            }
        }

        impl $name {
            /// This section's definition.
            pub const SPEC: $crate::SectionSpec = $crate::SectionSpec {
                path: $path,
                doc: concat!($( $doc ),+),
                choice: section!(@choice $($choice)?),
                keys: &[$( $crate::KeySpec {
                    name: stringify!($field),
                    doc: concat!($( $field_doc ),+),
                    allowed: $allowed,
                    source: $source,
                }, )*],
                named: None,
                defaults: || $crate::dotted_keys::to_table(&Self::default()),
            };
        }
    };
    // A flattened part has the names of its variants.
    (@encode $encoder:ident, $sub:ident, flatten) => {
        nemoral_plan::Encode::encode($sub, $encoder)
    };
    (@encode $encoder:ident, $sub:ident) => { $encoder.field(stringify!($sub), $sub) };
    (@choice $choice:literal) => { Some($choice) };
    (@choice) => { None };
}

/// Encodes an enum whose variants hold a section each, by the names that TOML has for them.
macro_rules! encode_variants {
    ($name:ident $( $variant:ident: $tag:literal; )*) => {
        impl nemoral_plan::Encode for $name {
            fn encode(&self, encoder: &mut dyn nemoral_plan::Encoder) {
                match self {
                    $( Self::$variant(inner) => encoder.field($tag, inner), )*
                }
            }
        }
    };
}

pub(super) use {encode_variants, section};
