//! Options from a file: `--options`.

use serde_json::{Map, Value};
use skep::{Error, Options, Result};
use std::path::Path;

/// Options of the machine, which do not change the result.
const OF_MACHINE: [&str; 3] = ["threads", "memory", "simd"];

/// The member that names the preset to start from.
const PRESET: &str = "preset";

/// Sets the options in a file: those of the run that wrote a `report.json`, or the members of an object. Its
/// member `preset` names the preset to start from.
///
/// # Errors
/// A file that cannot be read or is no such object; a preset or an option that does not exist, or that has no
/// such value.
pub fn apply(file: &Path, options: &mut Options) -> Result<()> {
    let text = skep::io::read_text(file)?;
    let mut found = parse(&text).map_err(|error| Error::file(file, error))?;
    if let Some(preset) = found.remove(PRESET) {
        let name = preset.as_str().map_or_else(|| preset.to_string(), str::to_owned);
        let preset = Options::preset(&name).map_err(|error| Error::file(file, error.to_string()))?;
        *options = Options { threads: options.threads, memory: options.memory, ..preset };
    }
    for (name, value) in found.iter().filter(|(name, _)| !OF_MACHINE.contains(&name.as_str())) {
        let set = match value {
            Value::String(text) => options.set(name, text),
            Value::Bool(_) | Value::Number(_) => options.set(name, &value.to_string()),
            _ => Err(Error::file(
                file,
                format!("option {name}: {value}; expected a number, true, false or a text"),
            )),
        };
        set.map_err(|error| Error::file(file, error.to_string()))?;
    }
    Ok(())
}

/// The options in the text of a file.
fn parse(text: &str) -> std::result::Result<Map<String, Value>, String> {
    const EXPECTED: &str = "expected a report.json of skep, or an object with options by name";
    let value: Value = serde_json::from_str(text).map_err(|error| format!("{error}; {EXPECTED}"))?;
    match value {
        Value::Object(mut members) => match members.remove("options") {
            Some(Value::Object(options)) => Ok(options),
            Some(other) => Err(format!("`options` is {other}; {EXPECTED}")),
            None => Ok(members),
        },
        _ => Err(EXPECTED.to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn applied(text: &str) -> std::result::Result<Options, String> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("options.json");
        std::fs::write(&file, text).unwrap();
        let mut options = Options::default();
        apply(&file, &mut options).map(|()| options).map_err(|error| error.to_string())
    }

    #[test]
    fn the_options_of_a_report_are_those_of_its_run() {
        let mut expected = Options::preset("fast").unwrap();
        expected.seed = 7;
        expected.input.masks = "masks".into();
        let text = |value: skep::OptionValue| Value::String(value.to_string());
        let values: Map<String, Value> =
            expected.values().map(|(name, value)| (name.to_owned(), text(value))).collect();
        let report = serde_json::json!({ "version": "0.1.0", "options": values }).to_string();
        assert_eq!(applied(&report), Ok(expected));
    }

    #[test]
    fn an_object_has_single_options_and_those_of_the_machine_are_not_taken() {
        let options =
            applied(r#"{"threads": 3, "fusion.min_agreeing_views": 2, "refine.fill_gaps": false}"#).unwrap();
        assert_eq!((options.threads, options.fusion.min_agreeing_views), (0, 2));
        assert!(!options.refine.fill_gaps);
    }

    #[test]
    fn an_object_names_the_preset_that_its_options_change() {
        let mut expected = Options::preset("fast").unwrap();
        expected.refine.fill_gaps = false;
        assert_eq!(applied(r#"{"refine.fill_gaps": false, "preset": "fast"}"#), Ok(expected));
        for preset in [r#""quick""#, "3"] {
            let error = applied(&format!(r#"{{"preset": {preset}}}"#)).unwrap_err();
            assert!(error.contains("options.json: preset is") && error.contains("fast, paper"), "{error}");
        }
    }

    #[test]
    fn what_is_no_option_is_named_with_the_file() {
        let error = applied(r#"{"fusion.agreeing": 2}"#).unwrap_err();
        assert!(error.contains("options.json") && error.contains("fusion.agreeing"), "{error}");
        let error = applied(r#"{"seed": [1]}"#).unwrap_err();
        assert!(error.contains("option seed: [1]; expected a number"), "{error}");
        for text in ["", "3", r#"{"options": 3}"#] {
            let error = applied(text).unwrap_err();
            assert!(error.contains("expected a report.json of skep"), "{text}: {error}");
        }
    }
}
