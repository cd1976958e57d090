//! The page of `tumble view`, where its engine evaluates methods and rates that were not written into it.

use std::fs;
use std::path::Path;

use serde_json::Value;
use sha1::{Digest, Sha1};

use crate::browser::Page;
use crate::program::{root, sample_folder};
use crate::view::{apart, evaluated, page, quat};

const SKIN: &str = "formats/tests/fixtures/skinned.gltf";

/// A module older than its sources would be tested, and shipped, in vain. `scripts/npm.sh` has the same list.
#[test]
fn the_page_s_engine_is_built_from_its_sources() {
    let read = |name: &str| fs::read(root().join(name)).unwrap();
    let mut names: Vec<String> = fs::read_dir(root().join("npm/src"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .map(|name| format!("npm/src/{name}"))
        .collect();
    names.sort();
    names.insert(0, "npm/Cargo.toml".to_owned());
    let others =
        ["packed.rs", "sample.rs", "world.rs"].map(|name| format!("formats/src/motion/{name}"));
    names.extend(others);
    names.push("verify/src/golden.txt".to_owned());
    let mut hash = Sha1::new();
    for name in &names {
        hash.update(read(name));
    }
    let hash: Vec<String> = hash
        .finalize()
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    let recorded = read("cli/src/commands/view/tumble.wasm.sources");
    assert_eq!(
        String::from_utf8(recorded).unwrap().trim(),
        hash.concat(),
        "the engine of the page is older than {}: scripts/npm.sh --page",
        names.join(", ")
    );
    let packed = read("cli/src/commands/view/tumble.wasm.gz").len();
    assert!(packed < 400_000, "{packed} bytes in every page");
}

fn number(page: &mut Page, expression: &str) -> usize {
    page.value(expression).as_u64().unwrap() as usize
}

/// Rotations that the page has made, `[track][sample]`, bit for bit those of `tumble eval`.
fn assert_same_bits(page: &mut Page, folder: &Path, line: &[&str]) {
    let times = page.value("Array.from(tumble.state.input.times)");
    let times: Vec<String> = times
        .as_array()
        .unwrap()
        .iter()
        .map(Value::to_string)
        .collect();
    fs::write(folder.join("times.txt"), times.join("\n")).unwrap();
    let line = [line, &["--times", "times.txt", "--device", "cpu"]].concat();
    let (shape, expected) = evaluated(folder, &line);
    let tracks = number(page, "tumble.state.input.boxes");
    assert_eq!(shape[..2], [tracks as u64, times.len() as u64]);
    let found = page.value("Array.from(tumble.results()[0].rotations)");
    let found = found.as_array().unwrap();
    assert_eq!(found.len(), expected.len() * 4);
    for (track, rotations) in expected.chunks(times.len()).enumerate() {
        for (sample, rotation) in rotations.iter().enumerate() {
            let live = &found[(sample * tracks + track) * 4..][..4];
            let live = live.iter().map(|number| number.as_f64().unwrap() as f32);
            assert!(
                live.eq(rotation.to_array()),
                "{line:?}, track {track}, sample {sample}: {rotation}"
            );
        }
    }
}

#[test]
fn methods_and_rates_that_were_not_written_have_the_program_s_bits() {
    let folder = sample_folder();
    let data = root()
        .join("data/pendulum-random.dat")
        .display()
        .to_string();
    let line = [&*data, "-m", "slerp", "--fps", "10", "--ends", "natural"];
    let Some(mut page) = page(folder.path(), &line) else {
        return;
    };
    let written = number(&mut page, "tumble.state.input.samples");
    let labels = "[...document.querySelectorAll('#method optgroup')].map((e) => e.label).join()";
    assert_eq!(page.value(labels), "evaluated in this page");
    let names =
        page.value("[...document.querySelectorAll('#method optgroup option')].map((e) => e.value)");
    let names: Vec<&str> = names
        .as_array()
        .unwrap()
        .iter()
        .filter_map(Value::as_str)
        .collect();
    assert!(names.len() >= 14 && !names.contains(&"slerp"), "{names:?}");
    for (method, rate) in [("c2", ""), ("b-spline", "23"), ("slerp", "23.976")] {
        page.choose("#rate", rate);
        page.choose("#method", method);
        page.value("tumble.loaded().then(() => true)");
        assert_eq!(page.value("tumble.results()[0].method"), method);
        let mut line = vec![&*data, "-m", method];
        if method != "slerp" {
            line.extend(["--ends", "natural"]);
        }
        assert_same_bits(&mut page, folder.path(), &line);
        let samples = number(&mut page, "tumble.state.input.samples");
        assert_eq!(samples > written, !rate.is_empty(), "{samples} at `{rate}`");
    }
    // The empty choice returns to the stored result, which has 16 bits.
    page.choose("#rate", "");
    page.value("tumble.loaded().then(() => true)");
    assert_eq!(number(&mut page, "tumble.state.input.samples"), written);
    assert_eq!(page.value("tumble.results()[0].unit"), 32767);
    // A rate with too many samples is refused with a message, and the old one stays.
    page.choose("#rate", "1e9");
    let trouble = page.value("document.querySelector('#trouble').textContent");
    assert!(
        trouble.as_str().unwrap().contains("frames a second are"),
        "{trouble}"
    );
    assert_eq!(page.value("document.querySelector('#rate').value"), "");
    assert_eq!(page.errors, Vec::<String>::new());
}

#[test]
fn pictures_between_frames_are_evaluated_at_their_own_times() {
    let folder = sample_folder();
    let data = root()
        .join("data/pendulum-random.dat")
        .display()
        .to_string();
    let Some(mut page) = page(folder.path(), &[&data, "-m", "c2", "--fps", "4"]) else {
        return;
    };
    let times = ["0.1234", "1.77", "5.01"];
    fs::write(folder.path().join("between.txt"), times.join("\n")).unwrap();
    let (_, expected) = evaluated(
        folder.path(),
        &[&data, "-m", "c2", "--times", "between.txt"],
    );
    let shown =
        |page: &mut Page, time: &str| page.value(&format!("tumble.seek({time}), tumble.shown(0)"));
    let before = shown(&mut page, times[0]);
    assert!(apart(quat(&before), expected[0]) > 1e-3, "a frame is shown");
    page.click("#between");
    for (time, &expected) in times.iter().zip(&expected) {
        let off = apart(quat(&shown(&mut page, time)), expected);
        assert!(off < 1e-6, "at {time} s: off by {off}");
    }
    let clock = page.value("document.querySelector('#clock').textContent");
    assert!(
        clock
            .as_str()
            .unwrap()
            .starts_with("5.010 s, after sample "),
        "{clock}"
    );
    // While the animation is played, times need not be those of frames.
    page.click("#play");
    page.wait("!tumble.state.input.times.includes(tumble.state.time) && tumble.state.time > 5.1");
    page.click("#play");
    assert_eq!(page.errors, Vec::<String>::new());
}

#[test]
fn without_its_engine_a_page_shows_what_was_written() {
    let folder = sample_folder();
    let line = ["a.dat", "-m", "slerp,c2"];
    let Some(mut whole) = page(folder.path(), &line) else {
        return;
    };
    let file = folder.path().join("view.html");
    let text = fs::read_to_string(&file).unwrap();
    // A damaged module stands for a browser that cannot run it.
    let start = text.find("\"engine\":\"").unwrap() + 40;
    let broken = [&text[..start], "AAAAAAAA", &text[start + 8..]].concat();
    assert!(whole.value("tumble.state.input.live !== null") == true);
    fs::write(&file, broken).unwrap();
    let mut pages = vec![Page::open(&file).unwrap()];
    pages.extend(page(
        folder.path(),
        &[&line[..], &["--frames-only"]].concat(),
    ));
    assert_eq!(pages.len(), 2);
    assert!(fs::metadata(&file).unwrap().len() as usize + 300_000 < text.len());
    for mut page in pages {
        assert_eq!(page.value("tumble.state.input.live"), Value::Null);
        assert_eq!(page.value("tumble.state.input.methods.join()"), "slerp,c2");
        assert_eq!(
            page.value("document.querySelectorAll('optgroup').length"),
            0
        );
        for field in ["rate", "between"] {
            let seen = format!("document.querySelector('#{field}').checkVisibility()");
            assert_eq!(page.value(&seen), false, "{field}");
        }
        page.choose("#method", "c2");
        page.value("tumble.loaded().then(() => true)");
        assert_eq!(page.value("tumble.results()[0].method"), "c2");
        assert_eq!(page.errors, Vec::<String>::new());
    }
}

#[test]
fn a_mesh_follows_its_bones_and_keys_are_told() {
    let folder = sample_folder();
    fs::copy(root().join(SKIN), folder.path().join("bend.gltf")).unwrap();
    let line = ["bend.gltf", "--fps", "4"];
    for frames_only in [false, true] {
        let extra: &[&str] = if frames_only { &["--frames-only"] } else { &[] };
        let Some(mut page) = page(folder.path(), &[&line[..], extra].concat()) else {
            return;
        };
        assert_eq!(number(&mut page, "tumble.vertices()"), 7);
        // formats/tests/skins.rs has the same positions.
        for (time, vertex, [x, y]) in [
            (0.0, 2, [0.0, 2.0]),
            (1.0, 2, [-1.0, 1.0]),
            (1.0, 3, [0.0, 2.0]),
            (1.0, 4, [-1.0, 1.0]),
        ] {
            let found = page.value(&format!("tumble.seek({time}), tumble.vertex({vertex})"));
            let off = [(0, x), (1, y), (2, 0.0)]
                .map(|(axis, right): (usize, f64)| (found[axis].as_f64().unwrap() - right).abs());
            assert!(
                off.iter().all(|off| *off < 1e-4),
                "{time} {vertex}: {found}"
            );
        }
        // It opens at the joint that moves, and says which frames are its keys.
        let name = page.value("document.querySelector('#box-name').textContent");
        assert_eq!(name, "upper");
        let mut clock = |time: &str| {
            page.value(&format!(
                "tumble.seek({time}), document.querySelector('#clock').textContent"
            ))
        };
        assert_eq!(clock("1"), "1.000 s, sample 5 of 5, key 2 of 2");
        assert_eq!(clock("0.5"), "0.500 s, sample 3 of 5");
        let marks =
            "[...document.querySelectorAll('#key-marks option')].map((e) => e.value).join()";
        assert_eq!(page.value(marks), "0,4");
        // The mesh is seen, and can be left out.
        page.value("tumble.seek(0)");
        let (with, _) = page.pixels("#stage");
        page.press("k");
        let (without, _) = page.pixels("#stage");
        let changed = with.iter().zip(&without).filter(|(a, b)| a != b).count();
        assert!(changed > with.len() / 100, "{changed} pixels of the mesh");
        assert_eq!(page.errors, Vec::<String>::new());
    }
}
