//! Motion files through the program: several animations a file, conversion between formats, bodies
//! without places, and trees of mixed formats.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use crate::program::{Run, root, run, sample_folder, succeed};

/// Two animations of a node that turns about x, `Walk` and `Run`, and one that moves nothing.
fn two_animations() -> String {
    let times = [0.0f32, 0.5, 1.0];
    let turn = |angle: f32| [(angle / 2.0).sin(), 0.0, 0.0, (angle / 2.0).cos()];
    let numbers: Vec<f32> = times
        .into_iter()
        .chain([0.0, 0.4, 1.0].into_iter().flat_map(turn))
        .chain([0.0, -0.8, 0.3].into_iter().flat_map(turn))
        .collect();
    let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
    let encoded: String = bytes.iter().map(|byte| format!("%{byte:02x}")).collect();
    let animation = |name: &str, output: u32| {
        format!(
            r#"{{"name":"{name}","channels":[{{"sampler":0,"target":{{"node":0,"path":"rotation"}}}}],
            "samplers":[{{"input":0,"output":{output}}}]}}"#
        )
    };
    format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"name":"hip"}}],"scenes":[{{"nodes":[0]}}],
        "buffers":[{{"byteLength":{},"uri":"data:application/octet-stream,{encoded}"}}],
        "bufferViews":[{{"buffer":0,"byteOffset":0,"byteLength":12}},
        {{"buffer":0,"byteOffset":12,"byteLength":96}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"SCALAR","min":[0],"max":[1]}},
        {{"bufferView":1,"componentType":5126,"count":3,"type":"VEC4"}},
        {{"bufferView":1,"byteOffset":48,"componentType":5126,"count":3,"type":"VEC4"}}],
        "animations":[{},{}]}}"#,
        bytes.len(),
        animation("Walk", 1),
        animation("Run", 2)
    )
}

fn names(folder: &Path) -> BTreeSet<String> {
    let entries = fs::read_dir(folder).unwrap();
    entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect()
}

fn line(place: &Path, line: &str) -> Run {
    succeed(place, &line.split(' ').collect::<Vec<_>>())
}

fn refused(place: &Path, line: &str) -> Run {
    let run = run(place, &line.split(' ').collect::<Vec<_>>());
    assert_ne!(run.code, 0, "{line}: {}", run.words);
    run
}

fn fixture(at: &Path, from: &str, to: &str) {
    let from = root().join("formats/tests/fixtures").join(from);
    fs::copy(from, at.join(to)).unwrap();
}

#[test]
fn a_file_of_several_animations_gives_several_results_that_are_checked_and_resumed() {
    let place = sample_folder();
    let at = place.path();
    fs::write(at.join("fox.gltf"), two_animations()).unwrap();
    let one_file = refused(at, "eval fox.gltf -o fox.npy");
    for words in [
        "has several animations, Walk, Run",
        "--animation",
        "-o RESULTS/",
    ] {
        assert!(one_file.words.contains(words), "{}", one_file.words);
    }
    line(at, "eval fox.gltf --animation Run -o run.npy");

    line(at, "eval fox.gltf -o out/ --device cpu");
    let all = ["fox.Run.npy", "fox.Walk.npy", "manifest.jsonl"].map(str::to_owned);
    assert_eq!(names(&at.join("out")), BTreeSet::from(all.clone()));
    let run = fs::read(at.join("out/fox.Run.npy")).unwrap();
    assert_eq!(run, fs::read(at.join("run.npy")).unwrap());
    line(at, "check out");
    let again = line(at, "eval fox.gltf -o out/ --device cpu --resume");
    assert!(again.words.contains("1 result skipped"), "{}", again.words);

    // One of both is missing: the file is done again.
    fs::remove_file(at.join("out/fox.Run.npy")).unwrap();
    refused(at, "check out");
    let again = line(at, "eval fox.gltf -o out/ --device cpu --resume");
    assert!(!again.words.contains("skipped"), "{}", again.words);
    assert_eq!(names(&at.join("out")), BTreeSet::from(all));
    assert_eq!(run, fs::read(at.join("out/fox.Run.npy")).unwrap());
    line(at, "check out");
}

#[test]
fn clips_and_inputs_of_one_name_do_not_overwrite_each_other() {
    let place = sample_folder();
    let at = place.path();
    fs::write(at.join("fox.gltf"), two_animations()).unwrap();
    fs::copy(at.join("a.dat"), at.join("fox.Run.dat")).unwrap();
    let line = "eval fox.gltf fox.Run.dat -o out --overwrite";
    let clash = run(at, &line.split(' ').collect::<Vec<_>>());
    let words = "another input's result is fox.Run.npy already";
    assert!(
        clash.code != 0 && clash.words.contains(words),
        "{}",
        clash.words
    );
    let (found, own) = (at.join("out/fox.Run.npy"), at.join("own.npy"));
    succeed(
        at,
        &["eval", "fox.gltf", "--animation", "Run", "-o", "own.npy"],
    );
    assert_eq!(fs::read(found).unwrap(), fs::read(own).unwrap());
}

/// Sampled at the rate of its keys, what was converted is what it was.
#[test]
fn every_format_that_holds_clips_holds_a_walk() {
    let place = sample_folder();
    let at = place.path();
    fixture(at, "bvh/good.bvh", "walk.bvh");
    let rotations = |file: &str| -> Vec<f32> {
        succeed(
            at,
            &[
                "eval",
                file,
                "-m",
                "slerp",
                "--fps",
                "24",
                "-o",
                "x.npy",
                "--overwrite",
            ],
        );
        let bytes = fs::read(at.join("x.npy")).unwrap();
        npyz::NpyFile::new(&bytes[..]).unwrap().into_vec().unwrap()
    };
    let expected = rotations("walk.bvh");
    for format in ["glb", "gltf", "npz", "parquet", "arrow", "csv"] {
        let file = format!("walk.{format}");
        succeed(at, &["convert", "walk.bvh", "-o", &file]);
        let found = rotations(&file);
        assert_eq!(found.len(), expected.len(), "{format}");
        let pairs = found.chunks_exact(4).zip(expected.chunks_exact(4));
        for (found, expected) in pairs {
            let dot: f32 = found.iter().zip(expected).map(|(a, b)| a * b).sum();
            assert!(dot.abs() > 1.0 - 1e-6, "{format}: {found:?} {expected:?}");
        }
        let back = format!("{format}.bvh");
        succeed(at, &["convert", &file, "-o", &back]);
        let found = rotations(&back);
        assert_eq!(found.len(), expected.len(), "{format}");
    }
}

#[test]
fn a_tree_of_mixed_formats_is_walked() {
    let place = sample_folder();
    let at = place.path();
    fs::create_dir_all(at.join("clips/deep")).unwrap();
    fs::write(at.join("clips/fox.gltf"), two_animations()).unwrap();
    fixture(at, "bvh/good.bvh", "clips/deep/walk.bvh");
    fixture(at, "npz/smpl.npz", "clips/deep/body.npz");
    fixture(at, "tum/good.tum", "clips/camera.tum");
    line(at, "eval clips -o out --to glb --fps 30");
    assert_eq!(
        names(&at.join("out")),
        ["camera.glb", "deep", "fox.glb", "manifest.jsonl"]
            .map(str::to_owned)
            .into()
    );
    assert_eq!(
        names(&at.join("out/deep")),
        ["body.glb", "walk.glb"].map(str::to_owned).into()
    );
    line(at, "check out");
}

#[test]
fn bodies_have_places_in_the_world_when_they_are_given_offsets() {
    let place = sample_folder();
    let at = place.path();
    fixture(at, "npz/smpl.npz", "body.npz");
    let without = refused(at, "eval body.npz --output world -o world.npy");
    assert!(without.words.contains("--offsets"), "{}", without.words);
    assert!(!at.join("world.npy").exists());
    fs::write(at.join("short.txt"), "0 0.1 0\n").unwrap();
    let short = refused(
        at,
        "eval body.npz --output world --offsets short.txt -o world.npy",
    );
    assert!(
        short.words.contains("3 numbers of offsets for 24 joints"),
        "{}",
        short.words
    );

    fs::write(
        at.join("offsets.txt"),
        "# x y z\n".to_owned() + &"0 0.1 0\n".repeat(24),
    )
    .unwrap();
    line(
        at,
        "eval body.npz --output world --offsets offsets.txt -o world.npy",
    );
    let bytes = fs::read(at.join("world.npy")).unwrap();
    let file = npyz::NpyFile::new(&bytes[..]).unwrap();
    assert_eq!(file.shape()[1..], [24, 7]);
    let poses = file.into_vec::<f32>().unwrap();
    // The left hip hangs on the pelvis, a tenth of a unit away.
    let distance = (0..3).map(|axis| (poses[axis] - poses[7 + axis]).powi(2));
    let distance = distance.sum::<f32>().sqrt();
    assert!((distance - 0.1).abs() < 1e-6, "{distance}");
}

#[test]
fn the_page_has_a_menu_of_a_files_animations() {
    let place = sample_folder();
    let at = place.path();
    fs::write(at.join("fox.gltf"), two_animations()).unwrap();
    line(at, "view fox.gltf -o view.html");
    let Some(mut page) = crate::browser::Page::open(&at.join("view.html")) else {
        return;
    };
    let options =
        "[...document.querySelectorAll('#set option')].map((e) => e.textContent).join('|')";
    let found = page.value(options).to_string();
    assert!(found.contains("Walk") && found.contains("Run"), "{found}");
    page.choose("#set", "1");
    page.value("tumble.loaded().then(() => true)");
    let name = "document.querySelector('#box-name').textContent";
    assert_eq!(page.value(name), "hip");
    assert_eq!(page.errors, Vec::<String>::new());
}

#[test]
fn times_since_1970_are_kept_or_said_to_be_moved() {
    let place = sample_folder();
    let at = place.path();
    let poses = "1305031098.6659 1 2 3 0 0 0 1\n1305031099.6659 1 2 4 0 0 0.6 0.8\n";
    fs::write(at.join("camera.txt"), poses).unwrap();
    line(at, "convert camera.txt --from tum -o camera.npz");
    let told = line(at, "info camera.npz");
    let told = String::from_utf8(told.out).unwrap();
    assert!(
        told.contains("1305031098.6659 to 1305031099.6659"),
        "{told}"
    );
    let moved = line(at, "convert camera.txt --from tum -o camera.glb");
    assert!(
        moved.words.contains("W204") && moved.words.contains("1305031098"),
        "{}",
        moved.words
    );
}

/// A file written in its own format keeps what no clip holds.
#[test]
fn converting_and_smoothing_keep_the_rest_of_a_file() {
    let place = sample_folder();
    let at = place.path();
    let with = two_animations().replacen('{', r#"{"materials":[{"name":"skin"}],"#, 1);
    fs::write(at.join("fox.gltf"), &with).unwrap();
    for command in ["convert", "smooth --fps 8", "eval --fps 8", "reduce"] {
        let out = format!("{}.glb", command.split(' ').next().unwrap());
        line(at, &format!("{command} fox.gltf -o {out}"));
        let bytes = fs::read(at.join(&out)).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        assert!(
            text.contains(r#""materials":[{"name":"skin"}]"#),
            "{command}: {text}"
        );
        let told = String::from_utf8(line(at, &format!("info {out}")).out).unwrap();
        assert!(
            told.contains("animation Walk") && told.contains("animation Run"),
            "{told}"
        );
    }
    line(at, "convert fox.gltf -o copy.gltf");
    assert_eq!(fs::read_to_string(at.join("copy.gltf")).unwrap(), with);
    let part = line(at, "convert fox.gltf --animation Run -o run.glb");
    assert!(
        part.words
            .contains("one animation makes a new file; stays behind: materials"),
        "{}",
        part.words
    );
    let scaled = line(at, "convert fox.gltf --up z -o up.glb");
    assert!(
        scaled.words.contains("stays behind: materials"),
        "{}",
        scaled.words
    );
    let other = line(at, "convert fox.gltf --animation Run -o run.csv");
    assert!(
        other.words.contains("left out: materials"),
        "{}",
        other.words
    );
    line(at, "convert fox.gltf --start 0.25 --end 0.75 -o cut.glb");
    let told = String::from_utf8(line(at, "info cut.glb").out).unwrap();
    assert_eq!(told.matches("0.25 to 0.75 s").count(), 2, "{told}");
}

#[test]
fn one_name_of_two_animations_is_refused_with_their_places() {
    let place = sample_folder();
    let at = place.path();
    fs::write(
        at.join("two.gltf"),
        two_animations().replace("\"Run\"", "\"Walk\""),
    )
    .unwrap();
    let run = refused(at, "eval two.gltf --animation Walk -o out.npy");
    assert!(
        run.words
            .contains("2 animations `Walk`, at the places 0 and 1"),
        "{}",
        run.words
    );
    line(at, "eval two.gltf --animation 1 -o out.npy");
}

#[test]
fn angles_of_bvh_keep_their_order_or_get_the_one_that_is_asked_for() {
    let place = sample_folder();
    let at = place.path();
    let text = "HIERARCHY\nROOT left hip\n{\n  OFFSET 0 0 0\n  CHANNELS 3 Xrotation Yrotation \
                Zrotation\n  End Site\n  {\n    OFFSET 0 12.5 0\n  }\n}\nMOTION\nFrames: 3\nFrame \
                Time: 0.04\n0 0 0\n10 20 30\n20 40 60\n";
    fs::write(at.join("in.bvh"), text).unwrap();
    line(at, "convert in.bvh -o same.bvh");
    let same = fs::read_to_string(at.join("same.bvh")).unwrap();
    assert_eq!(
        same.split("Frame Time").next(),
        text.split("Frame Time").next()
    );
    for command in ["convert", "smooth", "reduce --tolerance 0", "eval --fps 25"] {
        let run = line(
            at,
            &format!("{command} in.bvh --sequence ZYX -o turned.bvh --overwrite"),
        );
        let found = fs::read_to_string(at.join("turned.bvh")).unwrap();
        assert!(
            found.contains("CHANNELS 3 Zrotation Yrotation Xrotation\n  End Site"),
            "{command}: {found} {}",
            run.words
        );
        assert!(found.contains("OFFSET 0 12.5 0"), "{found}");
    }
    let run = refused(at, "convert in.bvh --sequence ZYX -o out.glb");
    assert!(run.words.contains("leave out --sequence"), "{}", run.words);
}

/// FBX is read as every other format: its curves, or with a method its keys alone; in its units and axes, or
/// in others.
#[test]
fn fbx_goes_into_other_formats() {
    let folder = sample_folder();
    let place = folder.path();
    let fixtures = concat!(env!("CARGO_MANIFEST_DIR"), "/../formats/tests/fixtures/fbx");
    std::fs::copy(format!("{fixtures}/walk.fbx"), place.join("walk.fbx")).unwrap();
    let info = |line: &[&str]| -> serde_json::Value {
        let line = [&["info", "walk.fbx", "--json"][..], line].concat();
        serde_json::from_slice(&succeed(place, &line).out).unwrap()
    };
    let found = &info(&[])[0];
    assert_eq!(found["metres"], 0.01);
    assert_eq!(found["up"], serde_json::json!([0.0, 0.0, 1.0]));
    assert!(found["keys"].as_u64().unwrap() > 20, "{found}");
    // One of the hips, which do not turn, and three of the knee.
    assert_eq!(info(&["--keyframes"])[0]["keys"], 4);

    succeed(place, &["convert", "walk.fbx", "-o", "walk.glb"]);
    let alike = ["--world", "--tolerance", "1e-4", "--distance", "1e-4"];
    succeed(
        place,
        &[&["compare", "walk.fbx", "walk.glb"][..], &alike].concat(),
    );
    let metres = ["--scale", "metres", "--up", "y", "-o", "metres.bvh"];
    succeed(
        place,
        &[&["eval", "walk.fbx", "--fps", "30"][..], &metres].concat(),
    );
    let text = std::fs::read_to_string(place.join("metres.bvh")).unwrap();
    // The hips go 30 cm along x; z was up.
    let last = text.lines().last().unwrap();
    assert!(last.starts_with("0.3 0 0 0 -90 0 "), "{last}");
    assert!(text.contains("OFFSET 0 -0.5 0"), "{text}");

    for (name, more) in [
        ("slerp.npy", &["-m", "slerp"][..]),
        ("keys.npy", &["--keyframes"]),
        ("curves.npy", &[]),
    ] {
        let line = ["eval", "walk.fbx", "--fps", "30", "-o", name];
        succeed(place, &[&line[..], more].concat());
    }
    let zero = ["--tolerance", "0"];
    succeed(
        place,
        &[&["compare", "slerp.npy", "keys.npy"][..], &zero].concat(),
    );
    let apart = run(
        place,
        &[&["compare", "keys.npy", "curves.npy"][..], &zero].concat(),
    );
    assert_eq!(apart.code, 8, "{}", apart.words);
    let refused = run(place, &["convert", "walk.glb", "-o", "back.fbx"]);
    assert_ne!(refused.code, 0, "{}", refused.words);
    let scaled = run(place, &["info", "walk.glb", "--scale", "metres"]);
    assert!(
        scaled.words.contains("does not say its unit"),
        "{}",
        scaled.words
    );
}
