//! `--json` prints JSON of numbers, names and sentences, without any Rust in it.

use serde_json::Value;

use crate::program::{run, sample_folder};

/// Marks of Rust's debug text.
const MARKS: [&str; 7] = ["Some(", "None", "Ok(", "Err(", "::", " { ", "\\\""];

/// Adds the faults of a value, with their locations.
fn faults(value: &Value, location: &str, found: &mut Vec<String>) {
    match value {
        Value::Object(members) => {
            for (name, value) in members {
                let is_plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
                if !name.chars().all(is_plain) {
                    found.push(format!("{location}: the name `{name}`"));
                }
                faults(value, &format!("{location}.{name}"), found);
            }
        }
        Value::Array(values) => {
            let each = values.iter().enumerate();
            each.for_each(|(i, value)| faults(value, &format!("{location}[{i}]"), found));
        }
        Value::String(text) => {
            let words = text.split(|c: char| !c.is_ascii_alphanumeric());
            // Names such as `TrackMajor` are of the source; `SwiftShader` is a driver.
            let is_camel = |word: &str| {
                let capitals = word.bytes().filter(u8::is_ascii_uppercase).count();
                let starts = word.starts_with(|c: char| c.is_ascii_uppercase());
                starts && capitals > 1 && word.bytes().any(|c| c.is_ascii_lowercase())
            };
            let names = ["SwiftShader", "LLVM", "LunarG", "PyPI", "NumPy"];
            let camel = words
                .clone()
                .find(|word| is_camel(word) && !names.contains(word));
            // These are names of devices and sources, which are not ours.
            let is_name = location.contains("device") || location.ends_with(".source");
            let mark = MARKS.iter().copied().find(|mark| text.contains(mark));
            if let Some(mark) = mark.or(camel.filter(|_| !is_name)) {
                found.push(format!("{location}: `{mark}` in `{text}`"));
            }
        }
        _ => {}
    }
}

#[test]
fn every_command_prints_json_without_debug_text() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let lines: &[&[&str]] = &[
        &["info", "a.dat", "b.dat", "antipodal.dat"],
        &["methods"],
        &["devices"],
        &["verify", "a.dat", "-m", "slerp,c2", "--fps", "5"],
        &[
            "verify",
            "a.dat",
            "-m",
            "catmull-rom",
            "--device",
            "cpu",
            "--fps",
            "5",
        ],
        &["eval", "a.dat", "-o", "a.npy"],
        &["eval", "a.dat", "-o", "e.csv", "--quantity", "euler"],
        &["eval", "a.dat", "-o", "w.npy", "--quantity", "world"],
        &["eval", "a.dat", "-o", "a.npz"],
        &["eval", "a.dat", "b.dat", "-o", "both"],
        &["compare", "a.dat", "b.dat"],
        &["check", "both"],
        &["plot", "a.dat", "-m", "slerp", "-o", "a.svg"],
        &[
            "render", "a.dat", "--size", "32x32", "--end", "0.1", "-o", "a.gif",
        ],
        &["view", "a.dat", "b.dat", "--fps", "5", "-o", "page.html"],
        &["compare", "a.npy", "a.npy.again"],
        &["bench", "small", "--shrink", "10000"],
    ];
    for line in lines {
        if line.contains(&"a.npy.again") {
            std::fs::copy(folder.join("a.npy"), folder.join("a.npy.again")).unwrap();
        }
        let run = run(folder, &[*line, &["--json"]].concat());
        assert_eq!(run.code, 0, "{line:?}: {}", run.words);
        let text = String::from_utf8(run.out).unwrap();
        let mut found = Vec::new();
        let values = serde_json::Deserializer::from_str(&text).into_iter::<Value>();
        let mut count = 0;
        for value in values {
            let value = value.unwrap_or_else(|error| panic!("{line:?}: {error}\n{text}"));
            faults(&value, "", &mut found);
            count += 1;
        }
        assert!(count > 0, "{line:?}: printed nothing");
        assert!(found.is_empty(), "{line:?}:\n{}", found.join("\n"));
    }
}

/// The line about a result and its record say the same of frames that were assumed, and of an end that is left out.
#[test]
fn records_have_the_assumed_rate_and_the_end_that_is_left_out() {
    let temporary = sample_folder();
    let record = |line: &str| -> Value {
        let line: Vec<&str> = line.split(' ').collect();
        let run = run(temporary.path(), &line);
        assert_eq!(run.code, 0, "{}", run.words);
        let records: Value = serde_json::from_slice(&run.out).unwrap();
        records[0].clone()
    };
    let assumed = record("eval a.dat -o assumed.npy --json");
    assert_eq!(assumed["assumed_fps"], "25", "{assumed}");
    assert!(assumed["left_out_seconds"].is_null(), "{assumed}");
    let chosen = record("eval a.dat --fps 7.3 -o chosen.npy --json");
    assert!(chosen["assumed_fps"].is_null(), "{chosen}");
    let left_out = chosen["left_out_seconds"].as_f64().unwrap();
    assert!(
        (left_out - 0.6 / 7.3).abs() < 1e-9 && chosen["frames"] == 15,
        "{chosen}"
    );
    assert_eq!(
        (&chosen["quantity"], &chosen["method"]),
        (&"quaternion".into(), &"authored".into())
    );
    // Manifests contain these members too, and so do the records of kept results.
    record("eval a.dat b.dat --fps 7.3 -o out --json");
    let path = temporary.path().join("out/manifest.jsonl");
    let manifest = std::fs::read_to_string(&path).unwrap();
    let line: Value = serde_json::from_str(manifest.lines().next().unwrap()).unwrap();
    assert_eq!(
        line["left_out_seconds"], chosen["left_out_seconds"],
        "{line}"
    );
    assert!(
        line["options"]
            .as_str()
            .unwrap()
            .contains(" quantity=quaternion "),
        "{line}"
    );
    let kept = record("eval a.dat b.dat --fps 7.3 -o out --json --resume");
    assert_eq!(kept["state"], "kept", "{kept}");
    assert_eq!(
        kept["left_out_seconds"], chosen["left_out_seconds"],
        "{kept}"
    );
    assert_eq!(std::fs::read_to_string(&path).unwrap(), manifest);
}

/// Failed inputs have records too, so that the JSON alone tells about every input.
#[test]
fn lists_have_the_inputs_that_failed() {
    let temporary = sample_folder();
    for line in [
        &["info", "bad.dat", "a.dat"][..],
        &[
            "verify", "bad.dat", "a.dat", "-m", "slerp", "--fps", "5", "--device", "cpu",
        ],
    ] {
        let run = run(temporary.path(), &[line, &["--json"]].concat());
        assert_eq!(run.code, 3, "{line:?}: {}", run.words);
        let records: Value = serde_json::from_slice(&run.out).unwrap();
        assert_eq!(records[0]["input"], "a.dat", "{line:?}");
        let failed = &records[1];
        assert_eq!(
            (&failed["state"], &failed["input"]),
            (&"failed".into(), &"bad.dat".into())
        );
        assert_eq!(failed["code"], 4, "{line:?}");
        let message = failed["message"].as_str().unwrap();
        assert!(message.starts_with("bad.dat:2:"), "{message}");
    }
}

#[test]
fn debug_text_is_found() {
    for wrong in [
        serde_json::json!({"method": "Some(\"slerp\")"}),
        serde_json::json!([{"layout": "TrackMajor"}]),
        serde_json::json!({"ends": "Clamped { start: 0 }"}),
        serde_json::json!({"someName": 1}),
    ] {
        let mut found = Vec::new();
        faults(&wrong, "", &mut found);
        assert_eq!(found.len(), 1, "{wrong}");
    }
}
