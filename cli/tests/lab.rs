//! `tumble lab` on a software driver: every variant of the kernels has the CPU's bits; and reports that are no lab's.
#![cfg(target_os = "linux")]

use crate::program::{finish, run};
use crate::prove::{LAVAPIPE, faults, is_there, read, schema, with_driver};

#[test]
fn every_variant_has_the_bits_of_the_cpu() {
    if !is_there(LAVAPIPE) {
        return;
    }
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    let line = ["lab", "--bits", "-o", "lab.json"];
    let bits = finish(with_driver(folder, LAVAPIPE, &line).output().unwrap());
    let page = String::from_utf8_lossy(&bits.out);
    assert_eq!(bits.code, 0, "{page}{}", bits.words);
    assert!(
        page.contains("0 variants differ") && page.lines().count() <= 60,
        "{page}"
    );
    let file = read(&folder.join("lab.json"));
    assert_eq!(faults(&schema("lab"), &file), Vec::<String>::new());
    assert!(
        file["lab"]["variants_compared"].as_u64().unwrap() >= 16 * 12,
        "{page}"
    );
    assert!(
        file["lab"]["words_compared"].as_u64().unwrap() > 1_000_000,
        "{page}"
    );

    // Within a second, at least the limits of the device are measured; the rules decide by the times that exist.
    let line = ["lab", "--time-limit", "1", "-o", "timed.json"];
    let timed = finish(with_driver(folder, LAVAPIPE, &line).output().unwrap());
    let page = String::from_utf8_lossy(&timed.out);
    assert_eq!(timed.code, 0, "{page}{}", timed.words);
    assert!(page.lines().count() <= 60, "{page}");
    let file = read(&folder.join("timed.json"));
    assert_eq!(faults(&schema("lab"), &file), Vec::<String>::new());
    let lab = &file["lab"];
    let counts = ["ceilings", "decisions"].map(|of| lab[of].as_array().unwrap().len());
    assert!(counts[0] == 14 && counts[1] >= 3, "{page}");
    assert!(lab["row"] == 2 && lab["run_lanes"].as_array().unwrap().len() == 5);

    // `prove --lab` needs a report with numbers of lanes; other files are refused.
    std::fs::write(folder.join("no.json"), "{\"format\": \"tumble-proof\"}").unwrap();
    for (file, why) in [
        ("lab.json", "it has no `run_lanes`"),
        (
            "no.json",
            "it is not the report of a lab; `tumble lab -o FILE` writes one",
        ),
        ("absent.json", "No such file"),
    ] {
        let refused = run(folder, &["prove", "--lab", file]);
        assert_eq!(refused.code, 4, "{}", refused.words);
        assert!(refused.words.contains(why), "{}", refused.words);
    }
    let cpu = run(folder, &["lab", "--device", "cpu"]);
    assert_eq!(cpu.code, 8, "{}", cpu.words);
}
