//! What of an interface's document breaks those who call it, when it changes.
//!
//! Callers break when an operation, a parameter or a field of an answer goes, when something becomes required of them, or
//! when less is accepted of a value than before. Prose, examples and what is added for free break nobody.

use std::collections::BTreeSet;

use serde_json::{Value, json};

/// A change that breaks callers of an operation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Break {
    /// The operation's name.
    pub operation: String,
    /// What breaks them.
    pub what: String,
}

/// Who writes a value, and who has to read it.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Way {
    /// Callers write: the service may not begin to refuse.
    In,
    /// The service writes: callers may not miss anything.
    Out,
}

/// All that breaks callers of `old` when `new` is served.
pub fn breaks(old: &Value, new: &Value) -> Vec<Break> {
    let mut all = Vec::new();
    for (path, item) in entries(&old["paths"]) {
        for (method, operation) in entries(item) {
            let name = operation["operationId"].as_str().unwrap_or("an operation without a name");
            let mut comparison = Comparison { old, new, found: Vec::new() };
            match new["paths"][path].get(method) {
                None => comparison.found.push(format!("{method} {path} is gone")),
                Some(present) => comparison.operation(operation, present),
            }
            let told = comparison.found.into_iter().map(|what| Break { operation: name.to_owned(), what });
            all.extend(told);
        }
    }
    all
}

struct Comparison<'a> {
    old: &'a Value,
    new: &'a Value,
    found: Vec<String>,
}

impl Comparison<'_> {
    fn operation(&mut self, old: &Value, new: &Value) {
        let named = |operation: &Value, wanted: &Value| {
            let key = |parameter: &Value| (parameter["in"].clone(), parameter["name"].clone());
            items(&operation["parameters"]).find(|parameter| key(parameter) == key(wanted)).cloned()
        };
        for parameter in items(&old["parameters"]) {
            let name = parameter["name"].as_str().unwrap_or_default();
            match named(new, parameter) {
                None => self.found.push(format!("parameter {name} is gone")),
                Some(present) => self.value(&parameter["schema"], &present["schema"], Way::In, name),
            }
        }
        for parameter in items(&new["parameters"]).filter(|parameter| parameter["required"] == true) {
            if named(old, parameter).is_none_or(|before| before["required"] != true) {
                self.found.push(format!("parameter {} becomes required", parameter["name"]));
            }
        }
        if new["requestBody"]["required"] == true && old["requestBody"]["required"] != true {
            self.found.push("a body becomes required".to_owned());
        }
        self.content(&old["requestBody"], &new["requestBody"], Way::In, "the body");
        for (status, answer) in entries(&old["responses"]).filter(|(status, _)| status.starts_with('2')) {
            match new["responses"].get(status) {
                None => self.found.push(format!("answer {status} is gone")),
                Some(present) => self.content(answer, present, Way::Out, status),
            }
        }
    }

    fn content(&mut self, old: &Value, new: &Value, way: Way, at: &str) {
        for (media_type, content) in entries(&old["content"]) {
            match new["content"].get(media_type) {
                None => self.found.push(format!("{at} as {media_type} is gone")),
                Some(present) => self.value(&content["schema"], &present["schema"], way, at),
            }
        }
    }

    fn value(&mut self, old: &Value, new: &Value, way: Way, at: &str) {
        let (old, new) = (Shape::of(self.old, old), Shape::of(self.new, new));
        let (wide, narrow) = if way == Way::In { (&new, &old) } else { (&old, &new) };
        if !wide.takes_types_of(narrow) {
            self.found.push(format!("{at} was {:?} and becomes {:?}", old.types, new.types));
        }
        if way == Way::In {
            self.limits(&old, &new, at);
        }
        for (name, field) in &old.fields {
            let within = format!("{at}.{name}");
            match new.fields.iter().find(|(other, _)| other == name) {
                None => self.found.push(format!("{within} is gone")),
                Some((_, present)) => self.value(field, present, way, &within),
            }
        }
        let (asked, before) = if way == Way::In { (&new, &old) } else { (&old, &new) };
        for name in asked.required.difference(&before.required).filter(|name| way == Way::In || new.has(name)) {
            let change = if way == Way::In { "becomes required" } else { "may be missing" };
            self.found.push(format!("{at}.{name} {change}"));
        }
        if let (Some(old), Some(new)) = (&old.items, &new.items) {
            self.value(old, new, way, &format!("{at}[]"));
        }
    }

    fn limits(&mut self, old: &Shape, new: &Shape, at: &str) {
        let lost = old.values.as_ref().zip(new.values.as_ref()).is_some_and(|(old, new)| !old.is_subset(new));
        if lost || (old.values.is_none() && new.values.is_some()) {
            self.found.push(format!("{at} takes fewer values"));
        }
        if new.least > old.least || new.most < old.most {
            self.found.push(format!("{at} takes a smaller range"));
        }
        if new.pattern.is_some() && new.pattern != old.pattern {
            self.found.push(format!("{at} has another pattern"));
        }
    }
}

/// What a schema says of values, whatever way it is written in.
struct Shape {
    types: BTreeSet<String>,
    values: Option<BTreeSet<String>>,
    pattern: Option<String>,
    least: f64,
    most: f64,
    fields: Vec<(String, Value)>,
    required: BTreeSet<String>,
    items: Option<Value>,
}

impl Shape {
    /// The shape of a schema of a document.
    fn of(document: &Value, schema: &Value) -> Self {
        let mut shape = Self {
            types: BTreeSet::new(),
            values: None,
            pattern: None,
            least: f64::NEG_INFINITY,
            most: f64::INFINITY,
            fields: Vec::new(),
            required: BTreeSet::new(),
            items: None,
        };
        shape.add(document, schema);
        shape
    }

    /// References are followed, alternatives joined: a variant that goes shows by its types and fields.
    fn add(&mut self, document: &Value, schema: &Value) {
        if let Some(target) = schema["$ref"].as_str() {
            return self.add(document, document.pointer(&target[1..]).expect("a reference within the document"));
        }
        ["oneOf", "anyOf", "allOf"]
            .iter()
            .flat_map(|key| items(&schema[*key]))
            .for_each(|part| self.add(document, part));
        let text = |value: &Value| value.as_str().map(str::to_owned);
        self.types.extend(text(&schema["type"]));
        self.types.extend(items(&schema["type"]).filter_map(text));
        if schema["enum"].is_array() {
            self.values.get_or_insert_default().extend(items(&schema["enum"]).map(Value::to_string));
        }
        self.pattern = text(&schema["pattern"]).or(self.pattern.take());
        let bound = |names: [&str; 3]| names.into_iter().find_map(|name| schema[name].as_f64());
        self.least = bound(["minimum", "exclusiveMinimum", "minLength"]).unwrap_or(self.least);
        self.most = bound(["maximum", "exclusiveMaximum", "maxLength"]).unwrap_or(self.most);
        for (name, field) in entries(&schema["properties"]) {
            match self.fields.iter_mut().find(|(known, _)| known == name) {
                Some((_, known)) => *known = json!({ "anyOf": [known.take(), field] }),
                None => self.fields.push((name.clone(), field.clone())),
            }
        }
        self.required.extend(items(&schema["required"]).filter_map(text));
        self.items = match (self.items.take(), schema.get("items")) {
            (Some(known), Some(further)) => Some(json!({ "anyOf": [known, further] })),
            (known, further) => known.or(further.cloned()),
        };
    }

    fn has(&self, field: &str) -> bool {
        self.fields.iter().any(|(name, _)| name == field)
    }

    fn takes_types_of(&self, other: &Self) -> bool {
        let takes =
            |wanted: &String| self.types.contains(wanted) || (wanted == "integer" && self.types.contains("number"));
        self.types.is_empty() || (!other.types.is_empty() && other.types.iter().all(takes))
    }
}

fn entries(value: &Value) -> impl Iterator<Item = (&String, &Value)> {
    value.as_object().into_iter().flatten()
}

fn items(value: &Value) -> impl Iterator<Item = &Value> {
    value.as_array().into_iter().flatten()
}

mod tests {
    use super::*;

    /// A document of one operation that takes a limit and a body, and answers with an item.
    fn document() -> Value {
        json!({
            "paths": { "/v1/things": { "post": {
                "operationId": "postThing",
                "parameters": [{
                    "in": "query", "name": "limit", "schema": { "type": ["integer", "null"], "minimum": 1, "maximum": 9 }
                }],
                "requestBody": { "content": { "application/json": { "schema": { "$ref": "#/components/schemas/Thing" } } } },
                "responses": { "200": { "content": { "application/json": {
                    "schema": { "type": "array", "items": { "$ref": "#/components/schemas/Item" } }
                } } } }
            } } },
            "components": { "schemas": {
                "Thing": { "type": "object", "required": ["kind"], "properties": {
                    "kind": { "type": "string", "enum": ["a", "b"] }, "note": { "type": "string", "pattern": "^x$" }
                } },
                "Item": { "type": "object", "required": ["p"], "properties": { "p": { "type": "number" } } }
            } }
        })
    }

    /// What breaks when the value at a pointer becomes another one, or goes.
    fn when(pointer: &str, becomes: Option<Value>) -> Vec<String> {
        let (mut new, (parent, key)) = (document(), pointer.rsplit_once('/').unwrap());
        match (new.pointer_mut(parent).unwrap(), becomes) {
            (Value::Object(map), Some(value)) => drop(map.insert(key.replace("~1", "/"), value)),
            (Value::Object(map), None) => drop(map.remove(&key.replace("~1", "/"))),
            (Value::Array(list), Some(value)) => list.push(value),
            (Value::Array(list), None) => drop(list.remove(key.parse().unwrap())),
            (other, _) => panic!("{other} holds nothing"),
        }
        breaks(&document(), &new).into_iter().map(|found| found.what).collect()
    }

    const OPERATION: &str = "/paths/~1v1~1things/post";

    fn at(rest: &str) -> String {
        format!("{OPERATION}{rest}")
    }

    #[test]
    fn what_goes_breaks() {
        assert_eq!(when("/paths/~1v1~1things", None), ["post /v1/things is gone"]);
        assert_eq!(when(OPERATION, None), ["post /v1/things is gone"]);
        assert_eq!(when(&at("/parameters/0"), None), ["parameter limit is gone"]);
        assert_eq!(when(&at("/requestBody/content/application~1json"), None), ["the body as application/json is gone"]);
        assert_eq!(when(&at("/responses/200"), None), ["answer 200 is gone"]);
        assert_eq!(when("/components/schemas/Item/properties/p", None), ["200[].p is gone"]);
        assert_eq!(when("/components/schemas/Thing/properties/note", None), ["the body.note is gone"]);
    }

    #[test]
    fn what_is_asked_anew_breaks() {
        assert_eq!(when(&at("/parameters/0/required"), Some(json!(true))), ["parameter \"limit\" becomes required"]);
        let further = json!({ "in": "query", "name": "life", "required": true, "schema": { "type": "integer" } });
        assert_eq!(when(&at("/parameters/1"), Some(further)), ["parameter \"life\" becomes required"]);
        assert_eq!(
            when("/components/schemas/Thing/required/1", Some(json!("note"))),
            ["the body.note becomes required"]
        );
        assert_eq!(when(&at("/requestBody/required"), Some(json!(true))), ["a body becomes required"]);
    }

    #[test]
    fn what_is_accepted_no_longer_breaks() {
        let schema = at("/parameters/0/schema");
        assert_eq!(when(&format!("{schema}/type"), Some(json!("boolean"))).len(), 1);
        assert_eq!(when(&format!("{schema}/maximum"), Some(json!(8))), ["limit takes a smaller range"]);
        assert_eq!(when(&format!("{schema}/minimum"), Some(json!(2))), ["limit takes a smaller range"]);
        let thing = "/components/schemas/Thing/properties";
        assert_eq!(when(&format!("{thing}/kind/enum"), Some(json!(["a"]))), ["the body.kind takes fewer values"]);
        assert_eq!(when(&format!("{thing}/note/pattern"), Some(json!("^y$"))), ["the body.note has another pattern"]);
    }

    #[test]
    fn an_answer_that_callers_did_not_expect_breaks() {
        let p = "/components/schemas/Item/properties/p/type";
        assert_eq!(when(p, Some(json!(["number", "null"]))).len(), 1);
        assert_eq!(when("/components/schemas/Item/required/0", None), ["200[].p may be missing"]);
    }

    #[test]
    fn what_is_added_breaks_nobody() {
        assert!(breaks(&document(), &document()).is_empty());
        let further = json!({ "in": "query", "name": "life", "schema": { "type": "integer" } });
        assert!(when(&at("/parameters/1"), Some(further)).is_empty());
        assert!(when("/components/schemas/Item/properties/q", Some(json!({ "type": "string" }))).is_empty());
        assert!(when("/components/schemas/Item/properties/p/type", Some(json!("integer"))).is_empty());
        assert!(when("/components/schemas/Thing/properties/kind/enum", Some(json!(["a", "b", "c"]))).is_empty());
        assert!(when(&at("/parameters/0/schema/maximum"), Some(json!(99))).is_empty());
        assert!(when(&at("/parameters/0/description"), Some(json!("other words"))).is_empty());
    }
}
