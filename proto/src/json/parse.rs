//! From bytes to a body, or to the field at fault.

use domain::{
    Invalid,
    invalid::step,
    json::{Strict, without_mark},
};
use serde::de::DeserializeOwned;
use serde_json::error::Category;
use serde_path_to_error::{Path, Segment};

/// Why bytes are not the wanted body.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BodyError {
    /// Not JSON (NaN and Infinity are not, nor are numbers beyond the double range), or nested too
    /// deeply; the field where reading stopped.
    #[error("malformed JSON at {0}")]
    Malformed(Invalid),
    /// JSON, but not of the wanted shape.
    #[error("{0}")]
    Invalid(Invalid),
}

/// Reads a body by the rules of [`domain::json`]; every error names the field where reading stopped.
pub fn parse<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, BodyError> {
    let mut reader = serde_json::Deserializer::from_slice(without_mark(bytes));
    let body = serde_path_to_error::deserialize(Strict(&mut reader)).map_err(|error| {
        let path = error.path().clone();
        refusal(&path, &error.into_inner())
    })?;
    reader.end().map_err(|error| BodyError::Malformed(Invalid::one("#", error.to_string())))?;
    Ok(body)
}

fn refusal(path: &Path, error: &serde_json::Error) -> BodyError {
    let message = error.to_string();
    let mut pointer = pointer(path);
    match error.classify() {
        Category::Data => {
            if let Some(field) = named_field(&message) {
                pointer.push('/');
                pointer.push_str(&step(field));
            }
            BodyError::Invalid(Invalid::one(pointer, message))
        }
        Category::Syntax | Category::Eof | Category::Io => BodyError::Malformed(Invalid::one(pointer, message)),
    }
}

/// serde reports a missing field, and one that is given twice, under its parent and names it in the message only.
fn named_field(message: &str) -> Option<&str> {
    let missing = message.strip_prefix("missing field `");
    missing.or_else(|| message.strip_prefix("duplicate field `"))?.split('`').next()
}

/// RFC 6901 as a URI fragment.
fn pointer(path: &Path) -> String {
    let mut pointer = String::from("#");
    for segment in path {
        let name = match segment {
            Segment::Seq { index } => index.to_string(),
            Segment::Map { key } => step(key),
            Segment::Enum { variant } => step(variant),
            // Reading stopped between fields.
            Segment::Unknown => continue,
        };
        pointer.push('/');
        pointer.push_str(&name);
    }
    pointer
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::json::UploadBody;

    fn refused(json: &str) -> BodyError {
        parse::<UploadBody>(json.as_bytes()).unwrap_err()
    }

    fn malformed(json: &str) -> String {
        match refused(json) {
            BodyError::Malformed(invalid) => invalid.violations[0].pointer.clone(),
            other => panic!("{json}: {other:?}"),
        }
    }

    fn invalid(json: &str) -> String {
        match refused(json) {
            BodyError::Invalid(invalid) => invalid.violations[0].pointer.clone(),
            other => panic!("{json}: {other:?}"),
        }
    }

    #[test]
    fn what_is_not_json_names_the_place() {
        assert_eq!(malformed(r#"{"samples":[0.1,NaN]}"#), "#/samples/1");
        assert_eq!(malformed(r#"{"samples":[0.1,-Infinity]}"#), "#/samples/1");
        assert_eq!(malformed(r#"{"flight_hours":1e400}"#), "#/flight_hours");
        assert_eq!(malformed(r#"{"load_ratio":[0.1,NaN]}"#), "#/load_ratio/1");
        assert!(malformed("").starts_with('#'));
        assert!(malformed("{\"samples\":").starts_with('#'));
    }

    #[test]
    fn json_of_the_wrong_shape_names_the_field() {
        assert_eq!(invalid(r#"{"samples":[0.1,"x"]}"#), "#/samples/1");
        assert_eq!(invalid(r#"{"load_ratio":[0.1,"x"]}"#), "#/load_ratio/1");
        assert_eq!(invalid(r#"{"load_ratio":"x"}"#), "#/load_ratio");
        assert_eq!(invalid(r#"{"air_data":{"flap_rad":[]}}"#), "#/air_data/flap_rad");
        assert_eq!(invalid(r#"{"strain":{"wavelengths_nm":[]}}"#), "#/strain/temperature_wavelengths_nm");
        assert_eq!(invalid("[]"), "#");
        assert_eq!(invalid("{}"), "#/upload_id");
        assert_eq!(invalid(r#"{"a/b ~":1}"#), "#/a~1b%20~0");
    }

    #[test]
    fn a_list_is_no_object_and_half_a_thing_is_no_number_of_things() {
        assert_eq!(invalid(r#"["u1","AIL-L"]"#), "#");
        assert_eq!(invalid(r#"{"strain":[[],[]]}"#), "#/strain");
        assert_eq!(invalid(r#"{"air_data":[1,2,3,4,5,6]}"#), "#/air_data");
        assert_eq!(invalid(r#"{"flight_cycles":12.5}"#), "#/flight_cycles");
        assert_eq!(invalid(r#"{"flight_cycles":12.0}"#), "#/upload_id", "the cycles are fine");
        assert_eq!(invalid("\u{feff}{}"), "#/upload_id", "a byte order mark is skipped");
        assert_eq!(invalid(r#"{"upload_id":"a","upload_id":"b"}"#), "#/upload_id");
    }

    #[test]
    fn depth_is_limited() {
        let deep = format!(r#"{{"samples":{}{}}}"#, "[".repeat(100_000), "]".repeat(100_000));
        refused(&deep);
        let unknown = parse::<serde_json::Value>(deep.as_bytes()).unwrap_err();
        assert!(matches!(unknown, BodyError::Malformed(_)), "{unknown:?}");
    }

    #[test]
    fn nothing_may_follow_the_body() {
        let twice = parse::<u32>(b"1 2").unwrap_err();
        assert!(matches!(twice, BodyError::Malformed(_)));
    }
}
