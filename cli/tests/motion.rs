//! Motion files through the program: several animations a file, conversion between formats, bodies
//! without positions, and trees of mixed formats.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use tumble::glam::Quat;
use tumble_formats::{Format, ReadOptions};

use crate::program::{Run, run, sample_folder, succeed};
use crate::tree::tree;

/// Two animations of a node that turns about x, `Walk` and `Run`, and one that moves nothing.
fn two_animations() -> String {
    let times = [0.0f32, 0.5, 1.0];
    let about_x = |angle: f32| [(angle / 2.0).sin(), 0.0, 0.0, (angle / 2.0).cos()];
    let numbers: Vec<f32> = times
        .into_iter()
        .chain([0.0, 0.4, 1.0].into_iter().flat_map(about_x))
        .chain([0.0, -0.8, 0.3].into_iter().flat_map(about_x))
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

fn line(folder: &Path, line: &str) -> Run {
    succeed(folder, &line.split(' ').collect::<Vec<_>>())
}

fn refused(folder: &Path, line: &str) -> Run {
    let run = run(folder, &line.split(' ').collect::<Vec<_>>());
    assert_ne!(run.code, 0, "{line}: {}", run.words);
    run
}

fn fixture(at: &Path, from: &str, to: &str) {
    let (format, name) = from.split_once('/').unwrap();
    fs::copy(crate::cases::folder(format).join(name), at.join(to)).unwrap();
}

#[test]
fn a_file_of_several_animations_gives_several_results_that_are_checked_and_resumed() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::write(folder.join("fox.gltf"), two_animations()).unwrap();
    let one_file = refused(folder, "eval fox.gltf -o fox.npy");
    for words in [
        "has several animations, Walk, Run",
        "--animation",
        "-o RESULTS/",
    ] {
        assert!(one_file.words.contains(words), "{}", one_file.words);
    }
    line(folder, "eval fox.gltf --animation Run -o run.npy");

    line(folder, "eval fox.gltf -o out/ --device cpu");
    let all = ["fox.Run.npy", "fox.Walk.npy", "manifest.jsonl"].map(str::to_owned);
    assert_eq!(names(&folder.join("out")), BTreeSet::from(all.clone()));
    let run = fs::read(folder.join("out/fox.Run.npy")).unwrap();
    assert_eq!(run, fs::read(folder.join("run.npy")).unwrap());
    line(folder, "check out");
    let again = line(folder, "eval fox.gltf -o out/ --device cpu --resume");
    let kept = "2 results of 1 input kept";
    assert!(again.words.contains(kept), "{}", again.words);

    // One of both is missing: the file is done again.
    fs::remove_file(folder.join("out/fox.Run.npy")).unwrap();
    refused(folder, "check out");
    let again = line(folder, "eval fox.gltf -o out/ --device cpu --resume");
    assert!(
        !again.words.contains("(already complete)"),
        "{}",
        again.words
    );
    assert_eq!(names(&folder.join("out")), BTreeSet::from(all));
    assert_eq!(run, fs::read(folder.join("out/fox.Run.npy")).unwrap());
    line(folder, "check out");
}

#[test]
fn clips_and_inputs_of_one_name_do_not_overwrite_each_other() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::write(folder.join("fox.gltf"), two_animations()).unwrap();
    fs::copy(folder.join("a.dat"), folder.join("fox.Run.dat")).unwrap();
    let line = "eval fox.gltf fox.Run.dat -o out --overwrite";
    let clash = run(folder, &line.split(' ').collect::<Vec<_>>());
    let words = "another input's result is fox.Run.npy already";
    assert!(
        clash.code != 0 && clash.words.contains(words),
        "{}",
        clash.words
    );
    let (found, expected) = (folder.join("out/fox.Run.npy"), folder.join("own.npy"));
    succeed(
        folder,
        &["eval", "fox.gltf", "--animation", "Run", "-o", "own.npy"],
    );
    assert_eq!(fs::read(found).unwrap(), fs::read(expected).unwrap());
    // In another order, and resumed: the result of the other input stays.
    let line = "eval fox.Run.dat fox.gltf -o kept";
    let line: Vec<&str> = line.split(' ').collect();
    assert_eq!(run(folder, &line).code, 3);
    let whole = tree(&folder.join("kept"));
    let again = run(folder, &[&line[..], &["--resume"]].concat());
    assert_eq!(again.code, 3, "{}", again.words);
    let words = "kept/fox.Run.npy is the result of fox.Run.dat; give --names full";
    assert!(again.words.contains(words), "{}", again.words);
    let kept = tree(&folder.join("kept"));
    assert_eq!(kept["fox.Run.npy"], whole["fox.Run.npy"]);
    assert_eq!(run(folder, &["check", "kept"]).code, 8);
}

/// A file that had several animations and has one leaves results behind, which `--prune` removes.
#[test]
fn results_of_animations_that_are_gone_are_pruned() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::create_dir(folder.join("in")).unwrap();
    fs::write(folder.join("in/fox.gltf"), two_animations()).unwrap();
    fs::copy(folder.join("a.dat"), folder.join("in/b.dat")).unwrap();
    line(folder, "eval in -o out");
    let mut model: serde_json::Value = serde_json::from_str(&two_animations()).unwrap();
    model["animations"].as_array_mut().unwrap().truncate(1);
    fs::write(folder.join("in/fox.gltf"), model.to_string()).unwrap();
    let again = line(folder, "eval in -o out --resume");
    assert!(
        again.words.contains("2 results have no input any more"),
        "{}",
        again.words
    );
    refused(folder, "check out");
    line(folder, "eval in -o out --resume --prune");
    line(folder, "check out");
    let left = ["b.npy", "fox.npy", "manifest.jsonl"].map(str::to_owned);
    assert_eq!(names(&folder.join("out")), BTreeSet::from(left));
}

/// A converted clip, sampled at the rate of its keys, is unchanged.
#[test]
fn every_format_that_holds_clips_holds_a_walk() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fixture(folder, "bvh/good.bvh", "walk.bvh");
    let rotations = |file: &str| -> Vec<f32> {
        succeed(
            folder,
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
        let bytes = fs::read(folder.join("x.npy")).unwrap();
        npyz::NpyFile::new(&bytes[..]).unwrap().into_vec().unwrap()
    };
    let expected = rotations("walk.bvh");
    for format in ["glb", "gltf", "npz", "parquet", "arrow", "csv"] {
        let file = format!("walk.{format}");
        succeed(folder, &["convert", "walk.bvh", "-o", &file]);
        let found = rotations(&file);
        assert_eq!(found.len(), expected.len(), "{format}");
        let pairs = found.chunks_exact(4).zip(expected.chunks_exact(4));
        for (found, expected) in pairs {
            let dot: f32 = found.iter().zip(expected).map(|(a, b)| a * b).sum();
            assert!(dot.abs() > 1.0 - 1e-6, "{format}: {found:?} {expected:?}");
        }
        let back = format!("{format}.bvh");
        succeed(folder, &["convert", &file, "-o", &back]);
        let found = rotations(&back);
        assert_eq!(found.len(), expected.len(), "{format}");
    }
}

#[test]
fn a_tree_of_mixed_formats_is_walked() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::create_dir_all(folder.join("clips/deep")).unwrap();
    fs::write(folder.join("clips/fox.gltf"), two_animations()).unwrap();
    fixture(folder, "bvh/good.bvh", "clips/deep/walk.bvh");
    fixture(folder, "npz/smpl.npz", "clips/deep/body.npz");
    fixture(folder, "tum/good.tum", "clips/camera.tum");
    line(folder, "eval clips -o out --to glb --fps 30");
    assert_eq!(
        names(&folder.join("out")),
        ["camera.glb", "deep", "fox.glb", "manifest.jsonl"]
            .map(str::to_owned)
            .into()
    );
    assert_eq!(
        names(&folder.join("out/deep")),
        ["body.glb", "walk.glb"].map(str::to_owned).into()
    );
    line(folder, "check out");
}

#[test]
fn bodies_have_places_in_the_world_when_they_are_given_offsets() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fixture(folder, "npz/smpl.npz", "body.npz");
    let without = refused(folder, "eval body.npz --quantity world -o world.npy");
    assert!(without.words.contains("--offsets"), "{}", without.words);
    assert!(!folder.join("world.npy").exists());
    fs::write(folder.join("short.txt"), "0 0.1 0\n").unwrap();
    let short = refused(
        folder,
        "eval body.npz --quantity world --offsets short.txt -o world.npy",
    );
    assert!(
        short.words.contains("3 numbers of offsets for 24 joints"),
        "{}",
        short.words
    );

    fs::write(
        folder.join("offsets.txt"),
        "# x y z\n".to_owned() + &"0 0.1 0\n".repeat(24),
    )
    .unwrap();
    line(
        folder,
        "eval body.npz --quantity world --offsets offsets.txt -o world.npy",
    );
    let bytes = fs::read(folder.join("world.npy")).unwrap();
    let file = npyz::NpyFile::new(&bytes[..]).unwrap();
    assert_eq!(file.shape()[1..], [24, 7]);
    let poses = file.into_vec::<f32>().unwrap();
    // The left hip hangs on the pelvis, a tenth of a unit away.
    let distance = (0..3).map(|axis| (poses[axis] - poses[7 + axis]).powi(2));
    let distance = distance.sum::<f32>().sqrt();
    assert!((distance - 0.1).abs() < 1e-6, "{distance}");
}

/// Legs a unit beside the hip, in three frames.
const WALK: &str = "\
HIERARCHY
ROOT hip
{
 OFFSET 0 0 0
 CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
 JOINT left
 {
  OFFSET 1 0 0
  CHANNELS 3 Zrotation Xrotation Yrotation
 }
 JOINT right
 {
  OFFSET -1 0 0
  CHANNELS 3 Zrotation Xrotation Yrotation
 }
}
MOTION
Frames: 3
Frame Time: 0.1
0 1 0 0 0 0 0 10 0 0 20 0
0 1.1 0 0 5 0 0 15 0 0 10 0
0 1.2 0 0 9 0 0 20 0 0 5 0
";

/// The numbers of a CSV's first row, by the names of their columns.
fn first_row(folder: &Path, file: &str) -> std::collections::HashMap<String, f64> {
    let line = [
        "eval",
        file,
        "--fps",
        "10",
        "--quantity",
        "transform",
        "--to",
        "csv",
        "-o",
        "-",
    ];
    let table = String::from_utf8(succeed(folder, &line).out).unwrap();
    let mut rows = table.lines().map(|row| row.split(','));
    let names = rows.next().unwrap().map(str::to_owned);
    let numbers = rows.next().unwrap().map(|cell| cell.parse().unwrap());
    names.zip(numbers).collect()
}

/// Offsets are in every result, whatever command and format it is of, and replaced offsets are told of.
#[test]
fn other_offsets_are_written_into_the_format_of_the_input_too() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::write(folder.join("walk.bvh"), WALK).unwrap();
    for format in ["glb", "gltf", "npz"] {
        line(folder, &format!("convert walk.bvh -o walk.{format}"));
    }
    fs::write(
        folder.join("far.txt"),
        "left 2 0 0\nhip 0 0 0\nright -2 0 0\n",
    )
    .unwrap();
    let commands = ["eval --fps 20", "convert", "smooth --fps 20", "reduce"];
    for (command, format) in commands
        .iter()
        .flat_map(|command| ["glb", "gltf", "npz", "bvh"].map(|format| (command, format)))
    {
        let (name, options) = command.split_once(' ').unwrap_or((command, ""));
        let wide =
            format!("{name} walk.{format} --offsets far.txt -o far.{format} --overwrite {options}");
        let run = line(folder, wide.trim_end());
        assert!(
            run.words.contains("W212]: the offsets of 2 joints in the file are replaced: that of `left` is 1 0 0 there, and now 2 0 0"),
            "{wide}: {}",
            run.words
        );
        let row = first_row(folder, &format!("far.{format}"));
        assert_eq!((row["left.tx"], row["right.tx"]), (2.0, -2.0), "{wide}");
    }
    // The same offsets change nothing: the file is written again as it is.
    fs::write(
        folder.join("same.txt"),
        "left 1 0 0\nhip 0 0 0\nright -1 0 0\n",
    )
    .unwrap();
    let same = line(folder, "convert walk.glb --offsets same.txt -o same.glb");
    assert!(!same.words.contains("W212"), "{}", same.words);
    // The warning names the members that a new file does not have.
    fs::write(
        folder.join("fox.gltf"),
        two_animations().replace("\"scenes\"", "\"cameras\":[{}],\"scenes\""),
    )
    .unwrap();
    fs::write(folder.join("hip.txt"), "hip 0 3 0\n").unwrap();
    let new = line(
        folder,
        "eval fox.gltf --offsets hip.txt --fps 30 -o fox30.gltf",
    );
    assert!(
        new.words
            .contains("other offsets make a new file; not copied: cameras"),
        "{}",
        new.words
    );
}

/// A body without offsets has none either in the formats that need some.
#[test]
fn joints_without_offsets_are_not_read_as_joints_in_one_point() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fixture(folder, "npz/smpl.npz", "body.npz");
    fs::write(folder.join("offsets.txt"), "0 0.1 0\n".repeat(24)).unwrap();
    for format in ["glb", "gltf", "bvh", "npz", "parquet"] {
        line(folder, &format!("eval body.npz --fps 30 -o first.{format}"));
        // Written again: the input's file with other keys.
        line(
            folder,
            &format!("eval first.{format} --fps 30 -o body.{format} --overwrite"),
        );
        let world = format!("eval body.{format} --quantity world -o world.npy --overwrite");
        let without = refused(folder, &world);
        assert!(
            without.words.contains("--offsets"),
            "{format}: {}",
            without.words
        );
        line(folder, &format!("{world} --offsets offsets.txt"));
    }
}

/// An SMPL body with offsets is written as a clip that has them, not in the layout of the input, which has no room
/// for them.
#[test]
fn offsets_of_a_body_are_written_to_npz() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fixture(folder, "npz/smpl.npz", "body.npz");
    fs::write(folder.join("offsets.txt"), "0 0.1 0\n".repeat(24)).unwrap();
    for command in ["eval --fps 20", "convert"] {
        let (name, options) = command.split_once(' ').unwrap_or((command, ""));
        let wide =
            format!("{name} body.npz --offsets offsets.txt -o placed.npz --overwrite {options}");
        line(folder, wide.trim_end());
        line(
            folder,
            "eval placed.npz --quantity world -o world.npy --overwrite",
        );
        let row = first_row(folder, "placed.npz");
        assert_eq!(row["left_hip.ty"], 0.1, "{wide}");
    }
}

/// A file that an option names is as much a part of a result as its input is.
#[test]
fn a_check_finds_changed_files_of_options() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::write(folder.join("walk.bvh"), WALK).unwrap();
    fs::write(
        folder.join("far.txt"),
        "hip 0 0 0\nleft 2 0 0\nright -2 0 0\n",
    )
    .unwrap();
    fs::create_dir(folder.join("in")).unwrap();
    fs::rename(folder.join("walk.bvh"), folder.join("in/walk.bvh")).unwrap();
    for (option, file) in [("offsets", "far.txt"), ("times", "t.txt")] {
        let batch = format!("eval in -o {option} --to glb --{option} {file} --resume");
        line(folder, &batch);
        line(folder, &format!("check {option}"));
        let text = fs::read_to_string(folder.join(file)).unwrap();
        fs::write(
            folder.join(file),
            text.replace('1', "0.5").replace('2', "3"),
        )
        .unwrap();
        let changed = run(folder, &["check", option]);
        let words = format!("its file {file} of --{option} has changed since it was written");
        assert!(
            changed.code == 8 && changed.words.contains(&words),
            "{}",
            changed.words
        );
        line(folder, &batch);
        line(folder, &format!("check {option}"));
        fs::remove_file(folder.join(file)).unwrap();
        let absent = run(folder, &["check", option]);
        let words = format!("1 input file not found (the first: {file})");
        assert!(
            absent.code == 8 && absent.words.contains(&words),
            "{}",
            absent.words
        );
    }
}

/// Every reader asks the budget for its keys; without an option only those of compressed data can pass it.
#[test]
fn the_memory_limit_holds_for_every_format() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::write(folder.join("walk.bvh"), WALK).unwrap();
    for format in ["glb", "npz", "csv", "parquet", "arrow"] {
        line(folder, &format!("convert walk.bvh -o walk.{format}"));
    }
    line(folder, "eval walk.bvh -o walk.npy");
    for format in ["tum", "euroc", "kitti"] {
        line(
            folder,
            &format!("eval walk.bvh --tracks hip --fps 10 -o path.{format}"),
        );
    }
    let of_format = |format: &str| match format {
        "dat" => "info a.dat".to_owned(),
        "npy" => "info walk.npy --source-fps 25 --map rotations=arr_0:track".to_owned(),
        "kitti" => "info path.kitti --source-fps 10".to_owned(),
        "tum" | "euroc" => format!("info path.{format} --from {format}"),
        format => format!("info walk.{format}"),
    };
    for format in [
        "bvh", "glb", "npz", "csv", "parquet", "arrow", "npy", "dat", "tum", "euroc", "kitti",
    ] {
        let read = of_format(format);
        line(folder, &format!("{read} --max-memory 1MiB"));
        let run = refused(folder, &format!("{read} --max-memory 10B"));
        assert!(
            run.words.contains("E034") && run.words.contains("the limit is 10 (--max-memory)"),
            "{format}: {}",
            run.words
        );
    }
}

#[test]
fn the_page_has_a_menu_of_a_files_animations() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::write(folder.join("fox.gltf"), two_animations()).unwrap();
    line(folder, "plot fox.gltf --animation Run -o run.svg");
    let picture = fs::read_to_string(folder.join("run.svg")).unwrap();
    assert!(picture.contains("fox.gltf: Run: components"), "{picture}");
    line(folder, "view fox.gltf -o view.html");
    let Some(mut page) = crate::browser::Page::open(&folder.join("view.html")) else {
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
    let temporary = sample_folder();
    let folder = temporary.path();
    let poses = "1305031098.6659 1 2 3 0 0 0 1\n1305031099.6659 1 2 4 0 0 0.6 0.8\n";
    fs::write(folder.join("camera.txt"), poses).unwrap();
    line(folder, "convert camera.txt --from tum -o camera.npz");
    let run = line(folder, "info camera.npz");
    let info = String::from_utf8(run.out).unwrap();
    assert!(
        info.contains("1305031098.6659 to 1305031099.6659"),
        "{info}"
    );
    let moved = line(folder, "convert camera.txt --from tum -o camera.glb");
    assert!(
        moved.words.contains("W204") && moved.words.contains("1305031098"),
        "{}",
        moved.words
    );
    // A body of SMPL has a rate and no start.
    fixture(folder, "npz/smpl.npz", "body.npz");
    let later = line(folder, "convert body.npz --start 0.1 -o later.npz");
    assert!(later.words.contains("W204"), "{}", later.words);
    let whole = line(folder, "convert body.npz -o whole.npz");
    assert!(!whole.words.contains("W204"), "{}", whole.words);
}

/// A file written in the format that it was read in keeps everything that is not part of a clip.
#[test]
fn converting_and_smoothing_keep_the_rest_of_a_file() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let with = two_animations().replacen('{', r#"{"materials":[{"name":"skin"}],"#, 1);
    fs::write(folder.join("fox.gltf"), &with).unwrap();
    for command in ["convert", "smooth --fps 8", "eval --fps 8", "reduce"] {
        let out = format!("{}.glb", command.split(' ').next().unwrap());
        line(folder, &format!("{command} fox.gltf -o {out}"));
        let bytes = fs::read(folder.join(&out)).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        assert!(
            text.contains(r#""materials":[{"name":"skin"}]"#),
            "{command}: {text}"
        );
        let info = String::from_utf8(line(folder, &format!("info {out}")).out).unwrap();
        assert!(
            info.contains("animation Walk") && info.contains("animation Run"),
            "{info}"
        );
    }
    line(folder, "convert fox.gltf -o copy.gltf");
    assert_eq!(fs::read_to_string(folder.join("copy.gltf")).unwrap(), with);
    let part = line(folder, "convert fox.gltf --animation Run -o run.glb");
    assert!(
        part.words
            .contains("one animation makes a new file; not copied: materials"),
        "{}",
        part.words
    );
    let scaled = line(folder, "convert fox.gltf --up-axis z -o up.glb");
    assert!(
        scaled.words.contains("not copied: materials"),
        "{}",
        scaled.words
    );
    let other = line(folder, "convert fox.gltf --animation Run -o run.csv");
    assert!(
        other.words.contains("left out: materials"),
        "{}",
        other.words
    );
    line(
        folder,
        "convert fox.gltf --start 0.25 --end 0.75 -o cut.glb",
    );
    let info = String::from_utf8(line(folder, "info cut.glb").out).unwrap();
    assert_eq!(info.matches("0.25 to 0.75 s").count(), 2, "{info}");
}

/// A warning about an animation stands under it, and not under the first one.
#[test]
fn info_lists_the_warnings_of_each_animation() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let channel = r#""name":"Run","channels":[{"sampler":0,"target":{"node":0,"path":"colour"}},"#;
    let odd = two_animations().replacen(r#""name":"Run","channels":["#, channel, 1);
    fs::write(folder.join("fox.gltf"), odd).unwrap();
    for (options, expected) in [
        (&[][..], vec![0, 1]),
        (&["--animation", "Walk"], vec![1]),
        (&["--animation", "Run"], vec![1]),
    ] {
        let info = succeed(folder, &[&["info", "fox.gltf", "--json"], options].concat());
        let clips: serde_json::Value = serde_json::from_slice(&info.out).unwrap();
        let warnings = clips.as_array().unwrap().iter().map(|clip| {
            let warnings = clip["warnings"].as_array().unwrap();
            let is_of_run = |it: &&serde_json::Value| {
                it.as_str()
                    .unwrap()
                    .contains("fox.gltf:/animations/1/channels/0/target/path: warning[W")
            };
            assert!(warnings.iter().all(|it| is_of_run(&it)), "{warnings:?}");
            warnings.len()
        });
        assert_eq!(warnings.collect::<Vec<_>>(), expected, "{options:?}");
    }
}

#[test]
fn one_name_of_two_animations_is_refused_with_their_places() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::write(
        folder.join("two.gltf"),
        two_animations().replace("\"Run\"", "\"Walk\""),
    )
    .unwrap();
    let run = refused(folder, "eval two.gltf --animation Walk -o out.npy");
    assert!(
        run.words
            .contains("2 animations called `Walk`, at the indices 0 and 1"),
        "{}",
        run.words
    );
    line(folder, "eval two.gltf --animation 1 -o out.npy");
}

#[test]
fn angles_of_bvh_keep_their_order_or_get_the_one_that_is_asked_for() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let text = "HIERARCHY\nROOT left hip\n{\n  OFFSET 0 0 0\n  CHANNELS 3 Xrotation Yrotation \
                Zrotation\n  End Site\n  {\n    OFFSET 0 12.5 0\n  }\n}\nMOTION\nFrames: 3\nFrame \
                Time: 0.04\n0 0 0\n10 20 30\n20 40 60\n";
    fs::write(folder.join("in.bvh"), text).unwrap();
    line(folder, "convert in.bvh -o same.bvh");
    let same = fs::read_to_string(folder.join("same.bvh")).unwrap();
    assert_eq!(
        same.split("Frame Time").next(),
        text.split("Frame Time").next()
    );
    for command in ["convert", "smooth", "reduce --tolerance 0", "eval --fps 25"] {
        let run = line(
            folder,
            &format!("{command} in.bvh --sequence ZYX -o turned.bvh --overwrite"),
        );
        let found = fs::read_to_string(folder.join("turned.bvh")).unwrap();
        assert!(
            found.contains("CHANNELS 3 Zrotation Yrotation Xrotation\n  End Site"),
            "{command}: {found} {}",
            run.words
        );
        assert!(found.contains("OFFSET 0 12.5 0"), "{found}");
    }
    let run = refused(folder, "convert in.bvh --sequence ZYX -o out.glb");
    assert!(run.words.contains("leave out --sequence"), "{}", run.words);
}

/// FBX is read as every other format: its curves, or with a method its keys alone; in its units and axes, or
/// in others.
#[test]
fn fbx_goes_into_other_formats() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let fixtures = concat!(env!("CARGO_MANIFEST_DIR"), "/../formats/tests/fixtures/fbx");
    std::fs::copy(format!("{fixtures}/walk.fbx"), folder.join("walk.fbx")).unwrap();
    let info = |line: &[&str]| -> serde_json::Value {
        let line = [&["info", "walk.fbx", "--json"][..], line].concat();
        serde_json::from_slice(&succeed(folder, &line).out).unwrap()
    };
    let found = &info(&[])[0];
    assert_eq!(found["metres"], 0.01);
    assert_eq!(found["up"], serde_json::json!([0.0, 0.0, 1.0]));
    assert!(found["keys"].as_u64().unwrap() > 20, "{found}");
    // One of the hips, which do not turn, and three of the knee.
    assert_eq!(info(&["--keyframes"])[0]["keys"], 4);

    succeed(folder, &["convert", "walk.fbx", "-o", "walk.glb"]);
    let alike = ["--world", "--tolerance", "1e-4", "--distance", "1e-4"];
    succeed(
        folder,
        &[&["compare", "walk.fbx", "walk.glb"][..], &alike].concat(),
    );
    let metres = ["--scale", "metres", "--up-axis", "y", "-o", "metres.bvh"];
    succeed(
        folder,
        &[&["eval", "walk.fbx", "--fps", "30"][..], &metres].concat(),
    );
    let text = std::fs::read_to_string(folder.join("metres.bvh")).unwrap();
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
        succeed(folder, &[&line[..], more].concat());
    }
    let zero = ["--tolerance", "0"];
    succeed(
        folder,
        &[&["compare", "slerp.npy", "keys.npy"][..], &zero].concat(),
    );
    let apart = run(
        folder,
        &[&["compare", "keys.npy", "curves.npy"][..], &zero].concat(),
    );
    assert_eq!(apart.code, 8, "{}", apart.words);
    let refused = run(folder, &["convert", "walk.glb", "-o", "back.fbx"]);
    assert_ne!(refused.code, 0, "{}", refused.words);
    let scaled = run(folder, &["info", "metres.bvh", "--scale", "metres"]);
    assert!(
        scaled.words.contains("does not state its unit of length"),
        "{}",
        scaled.words
    );
}

/// The values of a pickle are listed whether or not they are a motion, and of one that is, the motion too.
#[test]
fn info_lists_the_values_of_a_pickle() {
    let temporary = sample_folder();
    let at = temporary.path();
    fixture(at, "pickle/unknown.pkl", "unknown.pkl");
    fixture(at, "pickle/inert.pkl", "inert.pkl");
    fixture(at, "pickle/calls.pkl", "calls.pkl");
    let values = String::from_utf8(line(at, "info unknown.pkl").out).unwrap();
    let expected = "unknown.pkl\n  values             3: name, shape and type\n    a  () i8  1\n    b  (2,) f8\n    \
                    c  () U4  text\n";
    assert_eq!(values, expected);
    let both = String::from_utf8(line(at, "info inert.pkl").out).unwrap();
    for part in [
        "rotations  (1, 3, 4) f8",
        "pose  object of body.Pose",
        "tracks             1",
        "W911",
    ] {
        assert!(both.contains(part), "{part}: {both}");
    }
    assert!(refused(at, "info calls.pkl").words.contains("E911"));
}

/// Mirrored animations of a glTF file keep all else: their names, also where two have one, the weights of morph targets,
/// and animations that move no joint.
#[test]
fn mirrored_animations_keep_weights_and_names() {
    let temporary = sample_folder();
    let folder = temporary.path();
    // Times; rotations of a hip; weights of a target.
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let numbers = [
        0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, half, half, 0.25, 0.75, 0.0, 0.0, 0.0, 1.0, 0.0,
        0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0f32,
    ];
    let bytes: Vec<u8> = numbers
        .iter()
        .flat_map(|number| number.to_le_bytes())
        .collect();
    fs::write(folder.join("a.bin"), &bytes).unwrap();
    let accessor = |offset: usize, count: usize, kind: &str| {
        let bounds = match (offset, kind) {
            (0, _) => ", \"min\": [0.0], \"max\": [1.0]",
            (_, "VEC3") => ", \"min\": [0, 0, 0], \"max\": [1, 1, 1]",
            _ => "",
        };
        format!(
            "{{\"bufferView\": 0, \"byteOffset\": {offset}, \"componentType\": 5126, \"count\": {count}, \"type\": \"{kind}\"{bounds}}}"
        )
    };
    let accessors = [
        accessor(0, 2, "SCALAR"),
        accessor(8, 2, "VEC4"),
        accessor(40, 2, "SCALAR"),
        accessor(48, 3, "VEC3"),
        accessor(84, 2, "VEC4"),
    ];
    let hips = r#", {"sampler": 1, "target": {"node": 1, "path": "rotation"}},
        {"sampler": 2, "target": {"node": 2, "path": "rotation"}}"#;
    let weights = r#"{"sampler": 0, "target": {"node": 3, "path": "weights"}}"#;
    let file = format!(
        r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}],
        "nodes": [{{"name": "hips", "children": [1, 2, 3]}}, {{"name": "left_hip", "translation": [1, 0, 0]}},
            {{"name": "right_hip", "translation": [-1, 0, 0]}}, {{"name": "face", "mesh": 0}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 3}}, "targets": [{{"POSITION": 3}}]}}], "weights": [0],
            "extras": {{"targetNames": ["smile_left"]}}}}],
        "animations": [
            {{"name": "wave", "extras": {{"mood": 1.50}}, "samplers": [{{"input": 0, "output": 2}}, {{"input": 0, "output": 1}}, {{"input": 0, "output": 4}}],
                "channels": [{weights}{hips}]}},
            {{"name": "wave", "samplers": [{{"input": 0, "output": 2}}], "channels": [{weights}]}},
            {{"name": "empty", "samplers": [{{"input": 0, "output": 2}}], "channels": [{{"sampler": 0, "target": {{"path": "weights"}}}}]}}],
        "accessors": [{}], "bufferViews": [{{"buffer": 0, "byteLength": {length}}}],
        "buffers": [{{"byteLength": {length}, "uri": "a.bin"}}]}}"#,
        accessors.join(", "),
        length = bytes.len(),
    );
    fs::write(folder.join("a.gltf"), &file).unwrap();
    let made = line(folder, "convert a.gltf --mirror x -o b.gltf");
    let said = "the weights of morph targets are not mirrored: 1 target with the name of a side (the first: smile_left)";
    assert!(made.words.contains(said), "{}", made.words);
    assert!(
        made.words
            .contains("; wave: 1 pair of joints change their sides and "),
        "{}",
        made.words
    );
    line(folder, "convert b.gltf --mirror x -o c.gltf");
    let read = |name: &str| -> serde_json::Value {
        serde_json::from_slice(&fs::read(folder.join(name)).unwrap()).unwrap()
    };
    let [before, mirrored, twice] = ["a.gltf", "b.gltf", "c.gltf"].map(read);
    for after in [&mirrored, &twice] {
        let animations = &after["animations"];
        for index in 0..3 {
            assert_eq!(
                animations[index]["name"],
                before["animations"][index]["name"]
            );
        }
        assert_eq!(animations[0]["extras"]["mood"], 1.5);
        assert_eq!(animations[0]["channels"][0]["target"]["path"], "weights");
        for index in [1, 2] {
            let channels = &animations[index]["channels"];
            assert_eq!(channels, &before["animations"][index]["channels"]);
        }
    }
    // The left hip turned by 90° about z; now the right one turns the other way.
    let loaded = Format::open_detected(&folder.join("b.gltf"), &ReadOptions::default()).unwrap();
    let set = &loaded.clips[0].set;
    let last = |track: usize| *set.track(track).keys.last().unwrap();
    assert_eq!(
        [last(1), last(2)],
        [Quat::IDENTITY, Quat::from_xyzw(0.0, 0.0, -half, half)]
    );
    line(folder, "compare a.gltf c.gltf --tolerance 0 --distance 0");
    // Without the first animation, no joint moves.
    let alone = file.replace(hips, "");
    fs::write(folder.join("d.gltf"), alone).unwrap();
    line(folder, "convert d.gltf --mirror x -o e.gltf");
    let [alone, mirrored] = ["d.gltf", "e.gltf"].map(read);
    assert_eq!(mirrored["animations"], alone["animations"]);
    // Weights are cut as joints are.
    line(
        folder,
        "convert a.gltf --mirror x --start 0.5 --end 0.75 -o cut.gltf",
    );
    let cut = read("cut.gltf");
    for index in [0, 1] {
        for channel in cut["animations"][index]["channels"].as_array().unwrap() {
            let sampler = channel["sampler"].as_u64().unwrap() as usize;
            let input = &cut["animations"][index]["samplers"][sampler]["input"];
            let times = &cut["accessors"][input.as_u64().unwrap() as usize];
            let [first, last] = ["min", "max"].map(|end| times[end][0].as_f64().unwrap());
            assert_eq!(last - first, 0.25, "{channel}");
        }
    }
    // A joint at rest gets the motion of its partner, which then rests.
    let right = ",\n        {\"sampler\": 2, \"target\": {\"node\": 2, \"path\": \"rotation\"}}";
    fs::write(folder.join("one.gltf"), file.replace(right, "")).unwrap();
    line(folder, "convert one.gltf --mirror x -o other.gltf");
    let channels = &read("other.gltf")["animations"][0]["channels"];
    let nodes = channels.as_array().unwrap().iter();
    let nodes: Vec<u64> = nodes
        .map(|it| it["target"]["node"].as_u64().unwrap())
        .collect();
    assert_eq!(nodes, [3, 2]);
}

/// The mirror image of a walk is another walk, and the image of this is the first again.
#[test]
fn a_walk_is_mirrored() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let walk = concat!(env!("CARGO_MANIFEST_DIR"), "/../data/walk.bvh");
    fs::copy(walk, folder.join("w.bvh")).unwrap();
    let made = line(folder, "convert w.bvh --mirror x -o m.bvh");
    let expected = "pairs of joints change their sides";
    assert!(made.words.contains(expected), "{}", made.words);
    assert!(!made.words.contains("W908"), "{}", made.words);
    line(folder, "convert m.bvh --mirror x -o back.bvh");
    line(
        folder,
        "compare w.bvh back.bvh --tolerance 1e-3deg --distance 1e-4",
    );
    let other = run(
        folder,
        &["compare", "w.bvh", "m.bvh", "--tolerance", "1deg"],
    );
    assert_eq!(other.code, 8, "{}", other.words);
    // From head to feet a body is no mirror image.
    let made = line(folder, "convert w.bvh --mirror y -o y.glb");
    assert!(made.words.contains("W908"), "{}", made.words);
    fs::write(
        folder.join("s.csv"),
        "time,left_knee.scalar_angle,right_knee.scalar_angle\n0,0,0\n1,1,0\n",
    )
    .unwrap();
    let refused = run(
        folder,
        &["convert", "s.csv", "--mirror", "y", "-o", "t.csv"],
    );
    assert_eq!(refused.code, 4, "{}", refused.words);
    let expected =
        "error[E916]: the axis of the joint `left_knee` is not known; give the robot (--robot)";
    assert!(refused.words.contains(expected), "{}", refused.words);
}
