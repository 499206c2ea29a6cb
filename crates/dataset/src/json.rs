//! Values of any form in a header, such as a config. Those that are read take no more memory than
//! their text.

use std::borrow::Cow;

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::Value;
use serde_json::value::RawValue;

use crate::limits::CONFIG_BYTES;

/// JSON of any form. What was read is kept as its text, and becomes values when it is asked for:
/// values take up to 87 bytes for each byte of text, and a data set has many configs.
#[derive(Clone, Debug)]
pub struct Json(Form);

#[derive(Clone, Debug)]
enum Form {
    Values(Value),
    /// It was parsed when it was read.
    Text(Box<RawValue>),
}

impl Json {
    /// What it says.
    #[must_use]
    pub fn value(&self) -> Cow<'_, Value> {
        match &self.0 {
            Form::Values(value) => Cow::Borrowed(value),
            Form::Text(text) => Cow::Owned(parsed(text)),
        }
    }

    /// What it says, to be changed.
    pub fn to_mut(&mut self) -> &mut Value {
        if let Form::Text(text) = &self.0 {
            self.0 = Form::Values(parsed(text));
        }
        match &mut self.0 {
            Form::Values(value) => value,
            Form::Text(_) => unreachable!("it has just become values"),
        }
    }

    /// Whether it is an object without fields.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.value()
            .as_object()
            .is_some_and(serde_json::Map::is_empty)
    }
}

fn parsed(text: &RawValue) -> Value {
    serde_json::from_str(text.get()).expect("it was parsed when it was read")
}

/// An object without fields.
impl Default for Json {
    fn default() -> Self {
        Value::Object(serde_json::Map::new()).into()
    }
}

impl From<Value> for Json {
    fn from(value: Value) -> Self {
        Self(Form::Values(value))
    }
}

/// Equal values are equal, however they are written.
impl PartialEq for Json {
    fn eq(&self, other: &Self) -> bool {
        self.value() == other.value()
    }
}

impl Serialize for Json {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.value().serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Json {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = Box::<RawValue>::deserialize(deserializer)?;
        // Blanks do not count, as a manifest indents its lines.
        let bytes = text.get().bytes().filter(|b| !b.is_ascii_whitespace());
        let bytes = bytes.count() as u64;
        if bytes > CONFIG_BYTES {
            let message = format!("has {bytes} bytes: at most {CONFIG_BYTES} are read");
            return Err(D::Error::custom(message));
        }
        serde_json::from_str::<Value>(text.get()).map_err(D::Error::custom)?;
        Ok(Self(Form::Text(text)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_read_is_kept_as_text_and_written_as_it_was() {
        let text = "{\"a\":[1,0.1],\"b\":{}}";
        let read: Json = serde_json::from_str(&format!("  {text} ")).expect("JSON");
        assert!(matches!(&read.0, Form::Text(kept) if kept.get() == text));
        assert_eq!(serde_json::to_string(&read).expect("written"), text);
        let mut made = Json::from(serde_json::json!({ "b": {}, "a": [1, 0.1] }));
        assert_eq!(made, read);
        made.to_mut()["a"] = 2.into();
        assert_ne!(made, read);
        assert!(!read.is_empty() && Json::default().is_empty());
    }

    #[test]
    fn more_than_a_config_has_is_refused() {
        let list = |items: usize| format!("[{}0]", "0,".repeat(items));
        let most = CONFIG_BYTES as usize / 2 - 2;
        assert!(serde_json::from_str::<Json>(&list(most)).is_ok());
        let refused = serde_json::from_str::<Json>(&list(most + 1)).expect_err("too long");
        let told = "has 4194305 bytes: at most 4194304 are read";
        assert!(refused.to_string().contains(told), "{refused}");
    }
}
