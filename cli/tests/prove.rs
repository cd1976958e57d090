//! `tumble prove` on the software drivers: its proofs, the faults for which it refuses one, and the page
//! `docs/proofs.md`, which is written from the files in `proofs/`.
#![cfg(target_os = "linux")]

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::program::{Run, command, finish, root, run};
use crate::support::vulkan_devices;

pub(crate) const LAVAPIPE: &str = "/usr/share/vulkan/icd.d/lvp_icd.x86_64.json";
const SWIFTSHADER: &str = "/usr/lib/chromium/vk_swiftshader_icd.json";

/// Whether a driver is installed; on CI it must be.
pub(crate) fn is_there(driver: &str) -> bool {
    let there = Path::new(driver).exists() && !vulkan_devices().is_empty();
    assert!(
        there || std::env::var_os("CI").is_none(),
        "{driver} is not there"
    );
    if !there {
        eprintln!("NOT TESTED: {driver} is not there");
    }
    there
}

/// The program with one driver.
pub(crate) fn with_driver(folder: &Path, driver: &str, line: &[&str]) -> Command {
    let mut command = command(folder, line);
    command
        .env("VK_DRIVER_FILES", driver)
        .env_remove("VK_ADD_DRIVER_FILES");
    command
}

pub(crate) fn read(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// Asserts the numbers and the verdict that every proof of a software driver has.
fn expect_proof(run: &Run, proof: &Value, name: &str) {
    let page = String::from_utf8_lossy(&run.out);
    assert_eq!(run.code, 0, "{page}{}", run.words);
    assert_eq!(proof["verdict"], "proved", "{page}");
    assert!(
        page.contains("PROVED: this device gives the CPU's bits"),
        "{page}"
    );
    assert!(
        proof["device"]["name"].as_str().unwrap().contains(name),
        "{page}"
    );
    let number = |pointer: &str| proof.pointer(pointer).and_then(Value::as_u64).unwrap_or(0);
    assert!(number("/kernels/count") >= 98, "{page}");
    assert_eq!(number("/kernels/ran"), number("/kernels/count"), "{page}");
    assert!(number("/golden/cases") > 360, "{page}");
    assert_eq!(number("/golden/cases_compared"), number("/golden/cases"));
    assert!(number("/random/crowds") >= 1 && number("/random/values") > 10_000);
    // Rows of crowds whose results stay on the device are measured, too; slower drivers may not have enough time
    // for all.
    let cases = proof["figures"]["cases"].as_array().unwrap();
    let rows = cases.iter().filter(|case| case["row_seconds"].is_f64());
    let crowds = rows.filter(|case| case["case"] == "crowd").count();
    assert!(name != "llvmpipe" || crowds == 6, "{page}");
    assert_eq!(faults(&schema("proof"), proof), Vec::<String>::new());
}

/// Everything, on both software drivers, under the validation layer too; each in a time that CI has. The CPU's
/// results of the same random rounds are the same in both, and `--compare` says so.
#[test]
fn the_software_drivers_are_proved_and_compared() {
    if !is_there(LAVAPIPE) || !is_there(SWIFTSHADER) {
        return;
    }
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    for (driver, name, file, more) in [
        (LAVAPIPE, "llvmpipe", "one.json", "--validate"),
        (SWIFTSHADER, "SwiftShader", "two.json", "--overwrite"),
    ] {
        let line = ["prove", "--quick", "--time-limit", "600", "-o", file, more];
        let run = finish(with_driver(folder, driver, &line).output().unwrap());
        let proof = read(&folder.join(file));
        expect_proof(&run, &proof, name);
        if name == "llvmpipe" {
            assert!(proof["negative_control"]["differing"].as_u64().unwrap() > 100);
            assert_eq!(proof["validation"]["message_count"], 0);
            assert!(proof["validation"]["renderer_values"].as_u64().unwrap() > 1000);
        }
    }
    let compared = run(folder, &["prove", "--compare", "one.json", "two.json"]);
    let page = String::from_utf8_lossy(&compared.out);
    assert_eq!(compared.code, 0, "{page}{}", compared.words);
    for word in [
        "SwiftShader",
        "kernels            the same",
        "the same bits in the",
    ] {
        assert!(page.contains(word), "{word}: {page}");
    }

    // A digest that differs is found, and an existing file is not replaced.
    let text = std::fs::read_to_string(folder.join("two.json")).unwrap();
    let mut other: Value = serde_json::from_str(&text).unwrap();
    for digest in other["random"]["digests"].as_array_mut().unwrap() {
        digest["hash"] = "0".into();
    }
    std::fs::write(folder.join("other.json"), other.to_string()).unwrap();
    let compared = run(folder, &["prove", "--compare", "one.json", "other.json"]);
    assert_eq!(compared.code, 8, "{}", compared.words);
    assert!(
        compared.words.contains("gave different bits"),
        "{}",
        compared.words
    );
    let line = ["prove", "-o", "one.json"];
    let kept = finish(with_driver(folder, LAVAPIPE, &line).output().unwrap());
    assert!(
        kept.code == 2 && kept.words.contains("--overwrite"),
        "{}",
        kept.words
    );
}

/// Without SSE, Mesa's compiler makes code that rounds otherwise.
#[test]
fn a_driver_that_is_not_exact_is_told_with_code_6() {
    if !is_there(LAVAPIPE) {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let line = ["prove", "--time-limit", "1", "--json"];
    let mut command = with_driver(folder.path(), LAVAPIPE, &line);
    command
        .env("GALLIUM_NOSSE", "1")
        .env("MESA_SHADER_CACHE_DISABLE", "true");
    let run = finish(command.output().unwrap());
    assert_eq!(run.code, 6, "{}", run.words);
    assert!(
        run.words.contains("bits differ: self-test"),
        "{}",
        run.words
    );
    let proof: Value = serde_json::from_slice(&run.out).unwrap();
    assert_eq!(proof["verdict"], "bits_differ");
    assert_eq!(faults(&schema("proof"), &proof), Vec::<String>::new());
}

/// Not proved: the CPU compared with itself, a time limit that is too short for the necessary
/// parts, and no driver at all.
#[test]
fn what_proves_nothing_is_refused() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    let cpu = run(folder, &["prove", "--device", "cpu"]);
    assert_eq!(cpu.code, 8, "{}", cpu.words);
    assert!(cpu.words.contains("nothing is proved"), "{}", cpu.words);
    let mut none = command(folder, &["prove"]);
    let none = finish(crate::program::no_vulkan(&mut none).output().unwrap());
    assert_eq!(none.code, 5, "{}", none.words);
    std::fs::write(folder.join("no.json"), "{}").unwrap();
    for files in [["no.json", "no.json"], ["absent.json", "no.json"]] {
        let run = run(folder, &["prove", "--compare", files[0], files[1]]);
        assert_eq!(run.code, 4, "{}", run.words);
    }
    if !is_there(LAVAPIPE) {
        return;
    }
    let line = ["prove", "--time-limit", "1"];
    let short = finish(with_driver(folder, LAVAPIPE, &line).output().unwrap());
    let page = String::from_utf8_lossy(&short.out);
    assert_eq!(short.code, 8, "{page}{}", short.words);
    assert!(page.contains("NOT PROVED"), "{page}");
    assert!(
        short.words.contains("recorded results were compared"),
        "{}",
        short.words
    );
}

// ---------------------------------------------------------------- the schema

pub(crate) fn schema(of: &str) -> Value {
    read(&root().join(format!("docs/{of}.schema.json")))
}

/// The faults of a value, by the parts of JSON Schema that the schema uses: `type`, `properties`,
/// `required`, `additionalProperties`, `items`, `enum`, `const`.
pub(crate) fn faults(schema: &Value, value: &Value) -> Vec<String> {
    let mut found = Vec::new();
    check(schema, value, "$", &mut found);
    found
}

fn is_of(kind: &str, value: &Value) -> bool {
    match kind {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "number" => value.is_number(),
        "integer" => value.is_u64() || value.is_i64(),
        "boolean" => value.is_boolean(),
        "null" => value.is_null(),
        other => panic!("the schema has a type `{other}`"),
    }
}

fn check(schema: &Value, value: &Value, location: &str, found: &mut Vec<String>) {
    const KNOWN: [&str; 11] = [
        "$schema",
        "title",
        "description",
        "type",
        "properties",
        "required",
        "additionalProperties",
        "items",
        "enum",
        "const",
        "$comment",
    ];
    let rules = schema.as_object().expect("a schema is an object");
    let unknown = rules.keys().find(|key| !KNOWN.contains(&key.as_str()));
    assert_eq!(
        unknown, None,
        "{location}: the test does not know this rule"
    );
    let kinds: Vec<&str> = match &rules.get("type") {
        Some(Value::String(kind)) => vec![kind],
        Some(Value::Array(kinds)) => kinds.iter().filter_map(Value::as_str).collect(),
        _ => Vec::new(),
    };
    if !kinds.is_empty() && !kinds.iter().any(|kind| is_of(kind, value)) {
        found.push(format!("{location}: not of type {kinds:?}"));
        return;
    }
    if let Some(all) = rules.get("enum").and_then(Value::as_array)
        && !all.contains(value)
    {
        found.push(format!("{location}: {value} is none of {all:?}"));
    }
    if rules.get("const").is_some_and(|only| only != value) {
        found.push(format!("{location}: {value} is not {}", rules["const"]));
    }
    if let (Some(items), Some(values)) = (rules.get("items"), value.as_array()) {
        for (index, value) in values.iter().enumerate() {
            check(items, value, &format!("{location}[{index}]"), found);
        }
    }
    let Some(members) = value.as_object() else {
        return;
    };
    for name in rules
        .get("required")
        .and_then(Value::as_array)
        .into_iter()
        .flatten()
    {
        let name = name.as_str().expect("a name");
        if !members.contains_key(name) {
            found.push(format!("{location}: no `{name}`"));
        }
    }
    let properties = rules.get("properties").and_then(Value::as_object);
    for (name, value) in members {
        match properties.and_then(|all| all.get(name)) {
            Some(schema) => check(schema, value, &format!("{location}.{name}"), found),
            None if rules.get("additionalProperties") == Some(&Value::Bool(false)) => {
                found.push(format!("{location}: `{name}` is not in the schema"));
            }
            None => {}
        }
    }
}

/// The check of the schema finds missing members, additional members, and members of another type.
#[test]
fn the_schema_refuses_what_it_does_not_describe() {
    let Some(path) = proofs().into_iter().next() else {
        panic!("proofs/ is empty");
    };
    let schema = schema("proof");
    let good = read(&path);
    assert_eq!(faults(&schema, &good), Vec::<String>::new());
    let changes: [fn(&mut Value); 5] = [
        |proof| proof["verdict"] = "perhaps".into(),
        |proof| proof["random"]["rounds"] = "8".into(),
        |proof| proof["golden"]["more"] = 1.into(),
        |proof| drop(proof.as_object_mut().unwrap().remove("kernels")),
        |proof| proof["format_version"] = 2.into(),
    ];
    for (index, change) in changes.into_iter().enumerate() {
        let mut bad = good.clone();
        change(&mut bad);
        assert_eq!(faults(&schema, &bad).len(), 1, "change {index}");
    }
}

// ---------------------------------------------------------------- the devices that were available

/// The files of `proofs/`, in the order of their names.
fn proofs() -> Vec<std::path::PathBuf> {
    let entries = std::fs::read_dir(root().join("proofs")).unwrap();
    let paths = entries.map(|entry| entry.unwrap().path());
    let mut paths: Vec<_> = paths
        .filter(|path| {
            path.extension()
                .is_some_and(|extension| extension == "json")
        })
        .collect();
    paths.sort();
    paths
}

/// `1.23 GB/s`.
fn rate(bytes: f64) -> String {
    match bytes {
        0.0..1e9 => format!("{:.0} MB/s", bytes / 1e6),
        1e9..1e12 => format!("{:.1} GB/s", bytes / 1e9),
        _ => format!("{:.2} TB/s", bytes / 1e12),
    }
}

fn milliseconds(seconds: f64) -> String {
    match seconds {
        0.0..1e-3 => format!("{:.0} µs", seconds * 1e6),
        1e-3..0.1 => format!("{:.1} ms", seconds * 1e3),
        _ => format!("{:.0} ms", seconds * 1e3),
    }
}

/// The tables of `docs/proofs.md`.
fn tables() -> String {
    let all: Vec<(String, Value)> = (proofs().into_iter())
        .map(|path| {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            (name, read(&path))
        })
        .collect();
    let mut text = String::from("| | ");
    for (name, _) in &all {
        let _ = write!(text, "[{name}](../proofs/{name}) | ");
    }
    text.push_str("\n|---|");
    text.push_str(&"---|".repeat(all.len()));
    text.push('\n');
    let words = |value: &Value| value.as_str().unwrap_or("unknown").to_owned();
    let count = |value: &Value| value.as_u64().unwrap_or(0);
    let number = |value: &Value| value.as_f64().unwrap_or(0.0);
    let mut row = |name: &str, cell: &dyn Fn(&Value) -> String| {
        let _ = write!(text, "| {name} |");
        for (_, proof) in &all {
            let _ = write!(text, " {} |", cell(proof));
        }
        text.push('\n');
    };
    row("device", &|p| words(&p["device"]["name"]));
    row("driver", &|p| words(&p["device"]["driver"]));
    row("host", &|p| words(&p["host"]["processor"]));
    row("tumble", &|p| {
        let commit: String = words(&p["program"]["commit"]).chars().take(9).collect();
        format!("{}, {commit}", words(&p["program"]["version"]))
    });
    row("date", &|p| words(&p["date"]).chars().take(10).collect());
    row("verdict", &|p| words(&p["verdict"]).replace('_', " "));
    row("kernels equal to their twins", &|p| {
        let kernels = &p["kernels"];
        format!("{} of {}", count(&kernels["ran"]), count(&kernels["count"]))
    });
    row(
        "negative control: values that differ without the decorations",
        &|p| {
            let control = &p["negative_control"];
            format!(
                "{} of {}",
                count(&control["differing"]),
                count(&control["values"])
            )
        },
    );
    row(
        "recorded results; configurations in which they were compared",
        &|p| {
            let golden = &p["golden"];
            let settings = golden["by_setting"].as_array().map_or(0, Vec::len);
            format!(
                "{}, {settings} of {}",
                count(&golden["cases_compared"]),
                count(&golden["settings"])
            )
        },
    );
    row("random values; rounds; crowds among them", &|p| {
        let random = &p["random"];
        format!(
            "{:.1} million, {}, {}",
            number(&random["values"]) / 1e6,
            count(&random["rounds"]),
            count(&random["crowds"])
        )
    });
    row("a renderer's device: values compared", &|p| {
        let checks = p["renderer"]["checks"].as_array().into_iter().flatten();
        checks
            .map(|check| count(&check["values"]))
            .sum::<u64>()
            .to_string()
    });
    row("… its memory; its copy queue", &|p| {
        let hidden = p["renderer"]["memory_is_hidden"] == true;
        let queue = p["renderer"]["copy_queue_family"].is_u64();
        let hidden = if hidden {
            "hidden from the host"
        } else {
            "shared with the host"
        };
        format!("{hidden}, {}", if queue { "used" } else { "none" })
    });
    row(
        "messages of the validation layer",
        &|p| match &p["validation"] {
            Value::Null => "not asked".to_owned(),
            validation => count(&validation["message_count"]).to_string(),
        },
    );
    row("time to open the device; to open it again", &|p| {
        let opened = &p["device"]["opened_in"];
        format!("{:.0} ms, {:.0} ms", number(&opened[0]), number(&opened[1]))
    });
    row("kernels compiled without a cache; time", &|p| {
        let compile = &p["compile_times"];
        let kernels = compile["kernels"].as_array().map_or(0, Vec::len);
        format!(
            "{kernels} in {:.0} ms",
            number(&compile["milliseconds_total"])
        )
    });
    row("speed of filling memory; of copying it", &|p| {
        let figures = &p["figures"];
        let [fill, copy] =
            ["fill_rate", "device_copy_rate"].map(|figure| rate(number(&figures[figure])));
        format!("{fill}, {copy}")
    });
    row("bus to the device; to the host", &|p| {
        let figures = &p["figures"];
        let [up, down] =
            ["upload_rate", "download_rate"].map(|figure| rate(number(&figures[figure])));
        format!("{up}, {down}")
    });
    row("time from submission to fence", &|p| {
        milliseconds(number(&p["figures"]["submit_and_fence"]))
    });
    for (case, part, name) in [
        ("resident", "slerp", "(a) resident, slerp"),
        ("resident", "bessel", "(a) resident, Bessel-Overhauser"),
        ("read-back", "slerp", "(b) read back, slerp"),
        ("crowd", "Model", "(c) crowd, model matrices"),
        ("encoded", "matrix-3x4 row", "(d) 3 × 4 matrices, resident"),
        ("encoded", "f16", "(d) 16 bits, resident"),
    ] {
        row(name, &|p| {
            let cases = p["figures"]["cases"].as_array().into_iter().flatten();
            let mut found = cases.filter(|entry| {
                entry["case"] == case
                    && entry["name"]
                        .as_str()
                        .is_some_and(|name| name.contains(part))
            });
            found.next().map_or_else(String::new, |entry| {
                let share = 100.0 * number(&entry["share"]);
                format!("{}, {share:.0} %", milliseconds(number(&entry["seconds"])))
            })
        });
    }
    text
}

const BEGIN: &str = "<!-- Written from proofs/ by a test: UPDATE_PROOFS=1 -->\n";
const END: &str = "<!-- end -->\n";

/// `UPDATE_PROOFS=1` writes the page anew.
#[test]
fn the_page_of_proofs_is_what_the_files_say() {
    let schema = schema("proof");
    for path in proofs() {
        let proof = read(&path);
        assert_eq!(
            faults(&schema, &proof),
            Vec::<String>::new(),
            "{}",
            path.display()
        );
        assert_eq!(proof["verdict"], "proved", "{}", path.display());
        let size = std::fs::metadata(&path).unwrap().len();
        assert!(size < 64 << 10, "{}: {size} bytes", path.display());
    }
    let path = root().join("docs/proofs.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let (before, rest) = page
        .split_once(BEGIN)
        .expect("the page has a place for tables");
    let (_, after) = rest.split_once(END).expect("it has an end");
    let expected = format!("{before}{BEGIN}\n{}\n{END}{after}", tables());
    if std::env::var_os("UPDATE_PROOFS").is_some() {
        std::fs::write(&path, &expected).unwrap();
        return;
    }
    assert!(page == expected, "UPDATE_PROOFS=1 writes docs/proofs.md");
}
