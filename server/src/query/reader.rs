//! The reading of a query into a struct by serde: every parameter at fault is told, not the first alone.
//!
//! The fields of the struct are the parameters that are known. A struct is read until nothing new is found wrong with it:
//! what was refused counts as not given, and comes last.

use std::fmt;

use proto::json::FieldError;
use serde::{
    Deserializer,
    de::{DeserializeOwned, DeserializeSeed, Error, IntoDeserializer, MapAccess, Visitor, value::StrDeserializer},
    forward_to_deserialize_any,
};

/// Reads a query into `T`, or tells everything that is wrong with it.
pub fn read<T: DeserializeOwned>(pairs: Vec<(String, String)>) -> Result<T, Vec<FieldError>> {
    let mut reader = Reader { pairs, is_sifted: false, refused: Vec::new(), under_way: "", errors: Vec::new() };
    loop {
        match T::deserialize(&mut reader) {
            Ok(asked) if reader.errors.is_empty() => return Ok(asked),
            // What is required was refused before.
            Err(_) if reader.refused.contains(&reader.under_way) => return Err(reader.errors),
            Ok(_) => return Err(reader.errors),
            Err(Wrong(detail)) => {
                reader.refused.push(reader.under_way);
                reader.refuse(reader.under_way, detail);
            }
        }
    }
}

struct Reader {
    pairs: Vec<(String, String)>,
    /// Whether unknown and repeated parameters are out of the pairs.
    is_sifted: bool,
    refused: Vec<&'static str>,
    /// The parameter that is being read.
    under_way: &'static str,
    errors: Vec<FieldError>,
}

impl Reader {
    fn refuse(&mut self, name: &str, detail: impl Into<String>) {
        let name: String = name.chars().take(64).collect();
        self.errors.push(FieldError::parameter(name, detail));
    }

    fn text(&self, name: &str) -> Option<&str> {
        self.pairs.iter().find(|(known, _)| known == name).map(|(_, value)| value.as_str())
    }

    /// Refuses parameters that are not known, and repeated ones.
    fn sift(&mut self, known: &[&str]) {
        for (name, value) in std::mem::take(&mut self.pairs) {
            if !known.contains(&name.as_str()) {
                let offered = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
                self.refuse(&name, format!("unknown; known are: {offered}"));
            } else if self.text(&name).is_some() {
                self.refuse(&name, "given twice");
            } else {
                self.pairs.push((name, value));
            }
        }
        self.is_sifted = true;
    }
}

/// The fault of the parameter under way.
#[derive(Debug)]
struct Wrong(String);

impl fmt::Display for Wrong {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Wrong {}

impl Error for Wrong {
    fn custom<T: fmt::Display>(detail: T) -> Self {
        Self(detail.to_string())
    }
}

impl<'de> Deserializer<'de> for &mut Reader {
    type Error = Wrong;

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Wrong> {
        if !self.is_sifted {
            self.sift(fields);
        }
        let (refused, fresh): (Vec<&'static str>, Vec<_>) = fields.iter().partition(|name| self.refused.contains(name));
        visitor
            .visit_map(Fields { reader: self, names: fresh.into_iter().chain(refused).collect::<Vec<_>>().into_iter() })
    }

    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Wrong> {
        Err(Wrong("a query is read into a struct".to_owned()))
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 u8 u16 u32 u64 f32 f64 char str string bytes byte_buf option unit unit_struct newtype_struct
        seq tuple tuple_struct map enum identifier ignored_any
    }
}

/// All fields of a struct, those that are not given as nothing.
struct Fields<'a> {
    reader: &'a mut Reader,
    names: std::vec::IntoIter<&'static str>,
}

impl<'de> MapAccess<'de> for Fields<'_> {
    type Error = Wrong;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, Wrong> {
        let Some(name) = self.names.next() else { return Ok(None) };
        self.reader.under_way = name;
        let name: StrDeserializer<'_, Wrong> = name.into_deserializer();
        seed.deserialize(name).map(Some)
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, Wrong> {
        let name = self.reader.under_way;
        let text = if self.reader.refused.contains(&name) { None } else { self.reader.text(name) };
        seed.deserialize(Given(text))
    }
}

/// The text of a parameter, if it is given.
struct Given<'a>(Option<&'a str>);

impl<'de> Deserializer<'de> for Given<'_> {
    type Error = Wrong;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Wrong> {
        match self.0 {
            None => visitor.visit_none(),
            Some(text) => {
                let text: StrDeserializer<'_, Wrong> = text.into_deserializer();
                visitor.visit_some(text)
            }
        }
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 u8 u16 u32 u64 f32 f64 char str string bytes byte_buf option unit unit_struct newtype_struct
        seq tuple tuple_struct map struct enum identifier ignored_any
    }
}

#[cfg(test)]
mod tests {
    use serde::Deserialize;

    use super::*;
    use crate::query::{hours, hours_list, limit, required};

    fn kind<'de, D: Deserializer<'de>>(given: D) -> Result<char, D::Error> {
        required(given, "a letter", |text| text.parse().ok())
    }

    #[derive(Debug, PartialEq, Deserialize)]
    struct Asked {
        #[serde(deserialize_with = "kind")]
        kind: char,
        #[serde(deserialize_with = "limit")]
        limit: u32,
        #[serde(deserialize_with = "hours_list")]
        within_fh: Option<Vec<f64>>,
        #[serde(deserialize_with = "hours")]
        from_fh: Option<f64>,
    }

    fn asked(pairs: &[(&str, &str)]) -> Result<Asked, Vec<String>> {
        let owned = pairs.iter().map(|(name, value)| (name.to_string(), value.to_string()));
        let words = |error: FieldError| format!("{}: {}", error.parameter.unwrap_or_default(), error.detail);
        read(owned.collect()).map_err(|errors| errors.into_iter().map(words).collect())
    }

    #[test]
    fn values_are_parsed() {
        let read = asked(&[("limit", "7"), ("within_fh", "100, 250.5"), ("kind", "a")]);
        assert_eq!(read, Ok(Asked { kind: 'a', limit: 7, within_fh: Some(vec![100.0, 250.5]), from_fh: None }));
        assert_eq!(asked(&[("kind", "a")]).unwrap().limit, 50);
    }

    #[test]
    fn whatever_is_wrong_is_named() {
        let bad = [("limit", "0"), ("within_fh", "100,NaN"), ("from_fh", "-1"), ("frm", "1"), ("from_fh", "2")];
        let told = asked(&bad).unwrap_err();
        let expected = [
            "frm: unknown; known are: kind, limit, within_fh, from_fh",
            "from_fh: given twice",
            "kind: missing; it must be a letter",
            "limit: \"0\" must be a number from 1 to 1000",
            "within_fh: \"100,NaN\" must be 1 to 64 flight hours, each 0 to 1000000, separated by commas",
            "from_fh: \"-1\" must be flight hours, 0 to 1000000",
        ];
        assert_eq!(told, expected);
        assert_eq!(asked(&[("kind", "ab")]).unwrap_err(), ["kind: \"ab\" must be a letter"], "once");
    }
}
