//! The interface's document: what the routes say of themselves, and what every name in it has to be like.
//!
//! The rule of a name stands beside its noun; here it is told wherever the document speaks of that name.

use domain::{ContentHash, EventId, OperatorId, PartNumber, Position, SerialNumber, TailNumber, UploadId};
use serde_json::{Value, json};
use utoipa::openapi::OpenApi;

/// Names of fields and parameters, with the pattern of their noun.
const PATTERNS: [(&str, &str); 18] = [
    ("operator", OperatorId::PATTERN),
    ("tail", TailNumber::PATTERN),
    ("position", Position::PATTERN),
    ("last_position", Position::PATTERN),
    ("part", PartNumber::PATTERN),
    ("part_number", PartNumber::PATTERN),
    ("serial", SerialNumber::PATTERN),
    ("serial_number", SerialNumber::PATTERN),
    ("upload_id", UploadId::PATTERN),
    ("event_id", EventId::PATTERN),
    ("hash", ContentHash::PATTERN),
    ("model", ContentHash::PATTERN),
    ("prior", ContentHash::PATTERN),
    ("mask_id", ContentHash::PATTERN),
    ("mask_ids", ContentHash::PATTERN),
    ("sensor_configuration", ContentHash::PATTERN),
    ("pointer", "^#(/.*)?$"),
    ("date", "^[0-9]{4}-[0-9]{2}-[0-9]{2}$"),
];

/// The document as it is served.
pub fn written(document: &OpenApi) -> Value {
    let mut document = serde_json::to_value(document).expect("documents have text keys only");
    tell_patterns(&mut document);
    document
}

fn tell_patterns(value: &mut Value) {
    if let Value::Object(map) = &mut *value {
        if let Some(Value::Object(fields)) = map.get_mut("properties") {
            fields.iter_mut().for_each(|(name, schema)| tell(name, schema));
        }
        if let (Some(Value::String(name)), Some(_)) = (map.get("name").cloned(), map.get("in"))
            && let Some(schema) = map.get_mut("schema")
        {
            tell(&name, schema);
        }
    }
    match value {
        Value::Object(map) => map.values_mut().for_each(tell_patterns),
        Value::Array(list) => list.iter_mut().for_each(tell_patterns),
        _ => {}
    }
}

/// Tells what a name has to be like, unless its schema has a rule of its own.
fn tell(name: &str, schema: &mut Value) {
    let Some((_, pattern)) = PATTERNS.iter().find(|(known, _)| *known == name) else { return };
    let schema = match schema["type"] == "array" {
        true => &mut schema["items"],
        false => schema,
    };
    let is_text =
        schema["type"] == "string" || schema["type"].as_array().is_some_and(|of| of.contains(&json!("string")));
    if is_text && schema["pattern"].is_null() {
        schema["pattern"] = json!(pattern);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_have_one_rule_wherever_they_stand() {
        let mut document = json!({
            "parameters": [{ "in": "path", "name": "tail", "schema": { "type": "string" } }],
            "properties": {
                "tail": { "type": ["string", "null"] },
                "mask_ids": { "type": "array", "items": { "type": "string" } },
                "model": { "type": "string", "pattern": "its own" },
                "position": { "type": "object" }
            }
        });
        tell_patterns(&mut document);
        assert_eq!(document["parameters"][0]["schema"]["pattern"], TailNumber::PATTERN);
        assert_eq!(document["properties"]["tail"]["pattern"], TailNumber::PATTERN);
        assert_eq!(document["properties"]["mask_ids"]["items"]["pattern"], ContentHash::PATTERN);
        assert_eq!(document["properties"]["model"]["pattern"], "its own");
        assert!(document["properties"]["position"]["pattern"].is_null());
    }
}
