//! The schema of lines of JSON: every field of `wstac run --json` and of a recording's messages, with its type, unit
//! and description.
//!
//! `schema/record.json` is JSON Schema of draft 07. Viewers such as Foxglove read `properties` alone and know one type
//! of each field, so a field that may be null has a reference beside its type. By draft 07, a validator takes the
//! reference and nothing beside it.

use std::sync::LazyLock;

/// The JSON Schema of the records that `wstac run --json` prints and that recordings have.
pub const RECORD: &str = include_str!("schema/record.json");

/// Returns the schema `wstac.Record` as recordings have it: without indentation.
pub(super) fn record() -> &'static [u8] {
    static SHORT: LazyLock<Vec<u8>> =
        LazyLock::new(|| RECORD.lines().map(str::trim_start).collect::<String>().into_bytes());
    &SHORT
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use crate::output::FEATURE_NAMES;
    use serde_json::Value;
    use wstac_core::params::FEATURES;

    use super::*;

    fn schema() -> Value {
        serde_json::from_slice(record()).unwrap()
    }

    /// Checks what Foxglove's reader of schemas demands of a type and of all that is in it.
    fn is_for_viewers(name: &str, of: &Value) {
        assert!(of["description"].as_str().is_some_and(|text| text.len() > 8), "{name} has no description");
        assert!(of.get("oneOf").is_none(), "{name}");
        match of["type"].as_str() {
            Some("string" | "number" | "integer" | "boolean") => {}
            Some("array") => assert!(matches!(of["items"]["type"].as_str(), Some("number")), "{name}"),
            Some("object") => {
                for (member, of) in of["properties"].as_object().unwrap() {
                    is_for_viewers(&format!("{name}.{member}"), of);
                }
            }
            other => panic!("{name} has type {other:?}"),
        }
        // A number has a unit, a 1 for what has none.
        let is_number = matches!(of["type"].as_str(), Some("number" | "integer" | "array"));
        assert_eq!(of["unit"].is_string(), is_number, "{name}");
    }

    #[test]
    fn every_field_has_one_type_a_unit_and_a_description() {
        let schema = schema();
        assert_eq!(schema["$schema"], "http://json-schema.org/draft-07/schema#");
        is_for_viewers("record", &schema);
        for (name, of) in schema["properties"].as_object().unwrap() {
            if let Some(reference) = of["$ref"].as_str() {
                let definition = reference.strip_prefix("#/definitions/").unwrap();
                assert!(schema["definitions"][definition].is_object(), "{name}: {reference}");
            }
        }
    }

    #[test]
    fn features_have_their_names() {
        let schema = schema();
        for definition in ["features", "sample"] {
            let items = schema["definitions"][definition]["items"].as_array().unwrap();
            let names: Vec<&str> = items.iter().map(|item| item["title"].as_str().unwrap()).collect();
            assert_eq!(names, FEATURE_NAMES, "{definition}");
            assert_eq!(names.len(), FEATURES);
        }
    }

    #[test]
    fn every_kind_says_which_fields_it_has() {
        let schema = schema();
        let kinds = schema["properties"]["kind"]["enum"].as_array().unwrap();
        let rules = schema["allOf"].as_array().unwrap();
        let known: BTreeSet<&str> = schema["properties"].as_object().unwrap().keys().map(String::as_str).collect();
        for kind in kinds {
            let rule = rules.iter().find(|rule| rule["if"]["properties"]["kind"]["const"] == *kind).unwrap();
            let names = rule["then"]["propertyNames"]["enum"].as_array().unwrap();
            for name in names.iter().chain(rule["then"]["required"].as_array().unwrap()) {
                // Viewers know no list of lists: those stand in the rule alone.
                let name = name.as_str().unwrap();
                let is_of_lists = rule["then"]["properties"][name].is_object();
                assert!(known.contains(name) || is_of_lists, "{kind}: {name}");
            }
        }
    }
}
