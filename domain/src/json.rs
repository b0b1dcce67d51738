//! JSON read strictly where a slip would be taken for something else, and kindly where it cannot be.
//!
//! serde would take a list for an object, field by field in their order: here an object is an object. A whole number
//! may be written with a point or an exponent, 12.0 or 1.2e1, as JSON Schema has it; where it is not whole, or too large
//! for a double to be sure, it is refused. A byte order mark before the text is skipped. Keys that are given twice are
//! refused, as derived types do.

use std::fmt;

use serde::de::{
    DeserializeOwned, DeserializeSeed, Deserializer, EnumAccess, Error, MapAccess, SeqAccess, VariantAccess, Visitor,
};

/// What some editors and libraries put before UTF-8.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";
/// Whole numbers up to here are exact in a double.
const EXACT: f64 = 9_007_199_254_740_992.0;

/// Reads one document.
pub fn from_slice<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, serde_json::Error> {
    let mut reader = serde_json::Deserializer::from_slice(without_mark(bytes));
    let document = T::deserialize(Strict(&mut reader))?;
    reader.end()?;
    Ok(document)
}

/// The text behind a byte order mark, if there is one.
pub fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes)
}

/// A reader, and what is inside of what it reads, by the rules of this module.
pub struct Strict<T>(pub T);

macro_rules! as_it_is {
    ($($read:ident)*) => {
        $(fn $read<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, D::Error> {
            self.0.$read(Strict(visitor))
        })*
    };
}

macro_rules! whole_numbers {
    ($($read:ident)*) => {
        $(fn $read<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, D::Error> {
            self.0.$read(Whole(visitor))
        })*
    };
}

impl<'de, D: Deserializer<'de>> Deserializer<'de> for Strict<D> {
    type Error = D::Error;

    as_it_is! {
        deserialize_any deserialize_bool deserialize_f32 deserialize_f64 deserialize_char deserialize_str
        deserialize_string deserialize_bytes deserialize_byte_buf deserialize_option deserialize_unit deserialize_seq
        deserialize_map deserialize_identifier deserialize_ignored_any
    }

    whole_numbers! {
        deserialize_i8 deserialize_i16 deserialize_i32 deserialize_i64 deserialize_i128
        deserialize_u8 deserialize_u16 deserialize_u32 deserialize_u64 deserialize_u128
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, D::Error> {
        self.0.deserialize_map(Strict(visitor))
    }

    fn deserialize_unit_struct<V: Visitor<'de>>(self, name: &'static str, visitor: V) -> Result<V::Value, D::Error> {
        self.0.deserialize_unit_struct(name, Strict(visitor))
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, name: &'static str, visitor: V) -> Result<V::Value, D::Error> {
        self.0.deserialize_newtype_struct(name, Strict(visitor))
    }

    fn deserialize_tuple<V: Visitor<'de>>(self, length: usize, visitor: V) -> Result<V::Value, D::Error> {
        self.0.deserialize_tuple(length, Strict(visitor))
    }

    fn deserialize_tuple_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        length: usize,
        visitor: V,
    ) -> Result<V::Value, D::Error> {
        self.0.deserialize_tuple_struct(name, length, Strict(visitor))
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, D::Error> {
        self.0.deserialize_enum(name, variants, Strict(visitor))
    }

    fn is_human_readable(&self) -> bool {
        self.0.is_human_readable()
    }
}

macro_rules! values {
    ($($visit:ident: $type:ty),*) => {
        $(fn $visit<E: Error>(self, value: $type) -> Result<V::Value, E> {
            self.0.$visit(value)
        })*
    };
}

impl<'de, V: Visitor<'de>> Visitor<'de> for Strict<V> {
    type Value = V::Value;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        self.0.expecting(f)
    }

    values! {
        visit_bool: bool, visit_i64: i64, visit_i128: i128, visit_u64: u64, visit_u128: u128, visit_f64: f64,
        visit_str: &str, visit_borrowed_str: &'de str, visit_string: String, visit_bytes: &[u8],
        visit_borrowed_bytes: &'de [u8], visit_byte_buf: Vec<u8>
    }

    fn visit_none<E: Error>(self) -> Result<V::Value, E> {
        self.0.visit_none()
    }

    fn visit_unit<E: Error>(self) -> Result<V::Value, E> {
        self.0.visit_unit()
    }

    fn visit_some<D: Deserializer<'de>>(self, inner: D) -> Result<V::Value, D::Error> {
        self.0.visit_some(Strict(inner))
    }

    fn visit_newtype_struct<D: Deserializer<'de>>(self, inner: D) -> Result<V::Value, D::Error> {
        self.0.visit_newtype_struct(Strict(inner))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, list: A) -> Result<V::Value, A::Error> {
        self.0.visit_seq(Strict(list))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<V::Value, A::Error> {
        self.0.visit_map(Strict(map))
    }

    fn visit_enum<A: EnumAccess<'de>>(self, variants: A) -> Result<V::Value, A::Error> {
        self.0.visit_enum(Strict(variants))
    }
}

impl<'de, S: DeserializeSeed<'de>> DeserializeSeed<'de> for Strict<S> {
    type Value = S::Value;

    fn deserialize<D: Deserializer<'de>>(self, inner: D) -> Result<S::Value, D::Error> {
        self.0.deserialize(Strict(inner))
    }
}

impl<'de, A: SeqAccess<'de>> SeqAccess<'de> for Strict<A> {
    type Error = A::Error;

    fn next_element_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<Option<S::Value>, A::Error> {
        self.0.next_element_seed(Strict(seed))
    }

    fn size_hint(&self) -> Option<usize> {
        self.0.size_hint()
    }
}

impl<'de, A: MapAccess<'de>> MapAccess<'de> for Strict<A> {
    type Error = A::Error;

    fn next_key_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<Option<S::Value>, A::Error> {
        self.0.next_key_seed(seed)
    }

    fn next_value_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<S::Value, A::Error> {
        self.0.next_value_seed(Strict(seed))
    }

    fn size_hint(&self) -> Option<usize> {
        self.0.size_hint()
    }
}

impl<'de, A: EnumAccess<'de>> EnumAccess<'de> for Strict<A> {
    type Error = A::Error;
    type Variant = Strict<A::Variant>;

    fn variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<(S::Value, Self::Variant), A::Error> {
        let (value, variant) = self.0.variant_seed(seed)?;
        Ok((value, Strict(variant)))
    }
}

impl<'de, A: VariantAccess<'de>> VariantAccess<'de> for Strict<A> {
    type Error = A::Error;

    fn unit_variant(self) -> Result<(), A::Error> {
        self.0.unit_variant()
    }

    fn newtype_variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<S::Value, A::Error> {
        self.0.newtype_variant_seed(Strict(seed))
    }

    fn tuple_variant<V: Visitor<'de>>(self, length: usize, visitor: V) -> Result<V::Value, A::Error> {
        self.0.tuple_variant(length, Strict(visitor))
    }

    fn struct_variant<V: Visitor<'de>>(self, _: &'static [&'static str], visitor: V) -> Result<V::Value, A::Error> {
        self.0.newtype_variant_seed(Object(Strict(visitor)))
    }
}

/// Reads an object for a visitor.
struct Object<V>(V);

impl<'de, V: Visitor<'de>> DeserializeSeed<'de> for Object<V> {
    type Value = V::Value;

    fn deserialize<D: Deserializer<'de>>(self, inner: D) -> Result<V::Value, D::Error> {
        inner.deserialize_map(self.0)
    }
}

/// Takes a number with a point for a whole one, if it is one.
struct Whole<V>(V);

impl<'de, V: Visitor<'de>> Visitor<'de> for Whole<V> {
    type Value = V::Value;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        self.0.expecting(f)
    }

    values! { visit_i64: i64, visit_i128: i128, visit_u64: u64, visit_u128: u128 }

    fn visit_f64<E: Error>(self, value: f64) -> Result<V::Value, E> {
        match libm::trunc(value) == value && value.abs() <= EXACT {
            true if value < 0.0 => self.0.visit_i64(value as i64),
            true => self.0.visit_u64(value as u64),
            false => self.0.visit_f64(value),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use proptest::{collection::vec, prelude::*};
    use serde::{Deserialize, Serialize};

    use super::*;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Outer {
        count: u32,
        signed: Option<i64>,
        inner: Option<Inner>,
        list: Vec<Inner>,
        map: BTreeMap<u8, Inner>,
        kind: Kind,
        pair: (u8, f64),
    }

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct Inner {
        x: f64,
    }

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    enum Kind {
        Unit,
        New(Inner),
        Named { x: u64 },
    }

    const GOOD: &str = r#"{"count":12,"signed":-3,"inner":{"x":1},"list":[{"x":2}],"map":{"7":{"x":3}},
        "kind":{"Named":{"x":9007199254740993}},"pair":[1,2.5]}"#;

    fn read(from: &str, to: &str) -> Result<Outer, String> {
        assert!(from.is_empty() || GOOD.contains(from), "{from}");
        from_slice(GOOD.replacen(from, to, 1).as_bytes()).map_err(|error| error.to_string())
    }

    #[test]
    fn a_list_is_no_object_wherever_it_stands() {
        assert!(read(r#"{"count""#, r#"{"count""#).is_ok());
        assert!(from_slice::<Outer>(br#"[12,null,null,[],{},"Unit",[1,2]]"#).is_err());
        let objects = [(r#"{"x":1}"#, "[1]"), (r#"{"x":2}"#, "[2]"), (r#"{"x":3}"#, "[3]")];
        let variants =
            [(r#"{"x":9007199254740993}"#, "[9]"), (r#"{"Named":{"x":9007199254740993}}"#, r#"{"New":[1]}"#)];
        for (from, to) in objects.into_iter().chain(variants) {
            let refused = read(from, to).unwrap_err();
            assert!(refused.contains("sequence"), "{to}: {refused}");
        }
        assert!(read(r#"{"Named":{"x":9007199254740993}}"#, r#"{"New":{"x":1}}"#).is_ok());
    }

    #[test]
    fn a_whole_number_may_have_a_point() {
        for (text, count) in
            [("12.0", 12), ("1.2e1", 12), ("0.0", 0), ("-0.0", 0), ("12", 12), ("4294967295.0", u32::MAX)]
        {
            assert_eq!(read("12", text).unwrap().count, count, "{text}");
        }
        for text in ["12.5", "-12.0", "4294967296.0", "1e300", "1e-1", "\"12\""] {
            assert!(read("12", text).is_err(), "{text}");
        }
        assert_eq!(read("-3", "-3.0").unwrap().signed, Some(-3));
        assert!(read("-3", "9007199254740994.0").is_err(), "a double is not sure of it");
        assert_eq!(read("", "").unwrap().kind, Kind::Named { x: 9_007_199_254_740_993 }, "digits alone are exact");
    }

    #[test]
    fn a_key_is_given_once() {
        assert!(read(r#""count":12"#, r#""count":12,"count":12"#).unwrap_err().contains("duplicate field"));
    }

    #[test]
    fn a_byte_order_mark_is_skipped_before_the_text_only() {
        assert!(read(r#"{"count""#, "\u{feff}{\"count\"").is_ok());
        assert!(read(r#"{"count""#, "\u{feff}\u{feff}{\"count\"").is_err());
        assert!(read("12", "\u{feff}12").is_err());
    }

    proptest! {
        #[test]
        fn what_is_written_is_read(count: u32, signed: Option<i64>, xs in vec(-1e300..1e300_f64, 0..4)) {
            let list = || xs.iter().map(|&x| Inner { x });
            let outer = Outer {
                count,
                signed,
                inner: list().next(),
                list: list().collect(),
                map: (0..).zip(list()).collect(),
                kind: list().next_back().map_or(Kind::Unit, Kind::New),
                pair: (1, 2.5),
            };
            prop_assert_eq!(from_slice::<Outer>(&serde_json::to_vec(&outer).unwrap()).unwrap(), outer);
        }
    }
}
