//! `tumble reduce`, by running it.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::program::{root, run, sample_folder, succeed};

/// A joint that turns and moves smoothly, and one on it.
fn walk(folder: &Path) {
    let mut text = String::from(
        "HIERARCHY\nROOT hip\n{\n OFFSET 0 1 0\n CHANNELS 6 Xposition Yposition Zposition Zrotation \
         Xrotation Yrotation\n JOINT knee\n {\n  OFFSET 0 -0.5 0\n  CHANNELS 3 Zrotation Xrotation \
         Yrotation\n  End Site\n  {\n   OFFSET 0 -0.5 0\n  }\n }\n}\nMOTION\nFrames: 121\nFrame Time: \
         0.0166667\n",
    );
    for i in 0..121 {
        let t = f64::from(i) * 0.05;
        text += &format!(
            "{} 1 {} {} 5 0 {} 0 0\n",
            t,
            0.2 * (t * 2.0).sin(),
            30.0 * t.sin(),
            -20.0 * (t * 1.5).cos()
        );
    }
    fs::write(folder.join("walk.bvh"), text).unwrap();
}

#[test]
fn a_walk_gets_few_keys_and_compares() {
    let temporary = sample_folder();
    let folder = temporary.path();
    walk(folder);
    for (curve, max_keys) in [("linear", 180), ("cubic", 30)] {
        let line = [
            "reduce",
            "walk.bvh",
            "-o",
            "walk.glb",
            "--overwrite",
            "--method",
            curve,
        ];
        let said = succeed(
            folder,
            &[&line[..], &["--json", "--plot", "errors.svg"]].concat(),
        );
        assert!(said.words.contains("363 → "), "{}", said.words);
        let json: Value = serde_json::from_slice(&said.out).unwrap();
        let clip = &json[0];
        assert_eq!(
            (clip["keys_before"].as_u64(), clip["samples"].as_u64()),
            (Some(363), Some(121))
        );
        let keys = clip["keys_after"].as_u64().unwrap();
        assert!(keys <= max_keys, "{curve}: {keys} keys");
        let largest = clip["angle"]["largest"].as_f64().unwrap();
        let bound = clip["angle"]["bound"].as_f64().unwrap();
        assert!(largest > 0.01 && largest <= bound && (bound - 0.1).abs() < 1e-9);
        // The file is within the reported bounds, in the world.
        let distance = clip["distance"]["bound"].as_f64().unwrap().to_string();
        let bounds = ["--tolerance", "0.1001", "--distance", &distance];
        let times = ["--fps", "60", "--end", "2"];
        let line = ["compare", "walk.bvh", "walk.glb", "--world"];
        succeed(folder, &[&line[..], &bounds, &times].concat());
        let svg = fs::read_to_string(folder.join("errors.svg")).unwrap();
        assert!(
            svg.contains("largest angle of all joints") && svg.contains(&format!("→ {keys} keys"))
        );
    }
}

#[test]
fn a_gltf_keeps_all_but_its_keys() {
    let fox = root().join("../shared/data/gltf/Fox.glb");
    if !fox.exists() {
        eprintln!("{} is not there: nothing was reduced", fox.display());
        return;
    }
    let temporary = sample_folder();
    let folder = temporary.path();
    let fox = fox.to_str().unwrap();
    let said = succeed(
        folder,
        &["reduce", fox, "-o", "fox.glb", "--method", "cubic"],
    );
    assert!(
        said.words.contains("Survey: ") && said.words.contains("Run: "),
        "{}",
        said.words
    );
    let json = |file: &Path| -> Value {
        let bytes = fs::read(file).unwrap();
        let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        serde_json::from_slice(&bytes[20..20 + length]).unwrap()
    };
    let (before, after) = (json(Path::new(fox)), json(&folder.join("fox.glb")));
    for kept in ["meshes", "materials", "skins", "nodes", "scenes"] {
        assert_eq!(before[kept], after[kept], "{kept}");
    }
    // In the file, the image's view is after the views of the old keys, which the result does not
    // have.
    let image = |file: &Path| -> Vec<u8> {
        let (bytes, found) = (fs::read(file).unwrap(), json(file));
        let bin = 28 + u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        let view = found["images"][0]["bufferView"].as_u64().unwrap() as usize;
        let number = |name: &str| found["bufferViews"][view][name].as_u64().unwrap() as usize;
        bytes[bin + number("byteOffset")..][..number("byteLength")].to_vec()
    };
    assert!(image(Path::new(fox)) == image(&folder.join("fox.glb")));
    // If there are few cubics, their tangents take more memory than the removed keys; the message
    // says so.
    let sizes = "fox.glb (162.9 kB → 164.0 kB), 1.2 kB more than the input";
    assert!(said.words.contains(sizes), "{}", said.words);
    let said = succeed(folder, &["reduce", fox, "-o", "lines.glb"]);
    let sizes = "lines.glb (162.9 kB → 144.9 kB)\n";
    assert!(said.words.contains(sizes), "{}", said.words);
    // Rotations of 16 bits are written into a copy of the file with its other content, or into a
    // new, compressed file.
    let bounds = ["--world", "--tolerance", "0.1001"];
    for (name, more) in [
        ("short.glb", &["--quantize"][..]),
        ("packed.glb", &["--quantize", "--meshopt"]),
    ] {
        let said = succeed(folder, &[&["reduce", fox, "-o", name][..], more].concat());
        let is_new = said
            .words
            .contains("compression makes a new file; not copied: meshes");
        assert_eq!(is_new, name == "packed.glb", "{}", said.words);
        let found = json(&folder.join(name));
        let accessors = found["accessors"].as_array().unwrap();
        let is_short =
            |accessor: &&Value| accessor["componentType"] == 5122 && accessor["normalized"] == true;
        assert!(accessors.iter().filter(is_short).count() > 20, "{found}");
        assert_eq!(before["meshes"] == found["meshes"], !is_new);
        succeed(folder, &[&["compare", fox, name][..], &bounds].concat());
    }
    let samplers = after["animations"][0]["samplers"].as_array().unwrap();
    let cubics = samplers
        .iter()
        .filter(|sampler| sampler["interpolation"] == "CUBICSPLINE")
        .count();
    assert!(cubics > 5, "{cubics} of {}", samplers.len());
    // If the input has arcs, the error between samples is small, too.
    succeed(folder, &["reduce", fox, "-o", "arcs.glb"]);
    let line = [
        "compare",
        fox,
        "arcs.glb",
        "--world",
        "--tolerance",
        "0.1001",
    ];
    succeed(folder, &line);
}

#[test]
fn a_chain_goes_back_into_dat() {
    let temporary = sample_folder();
    let folder = temporary.path();
    succeed(folder, &["convert", "a.dat", "-o", "a.npz"]);
    let line = [
        "reduce",
        "a.dat",
        "-o",
        "few.dat",
        "--fps",
        "100",
        "--method",
        "bessel-overhauser",
    ];
    let said = succeed(folder, &line);
    assert!(said.words.contains("402 → "), "{}", said.words);
    let text = fs::read_to_string(folder.join("few.dat")).unwrap();
    assert!(text.lines().count() < 60, "{text}");
    succeed(
        folder,
        &[
            "compare",
            "a.dat",
            "few.dat",
            "--fps",
            "100",
            "--tolerance",
            "0.1001",
        ],
    );
}

#[test]
fn what_cannot_be_reduced_is_refused() {
    let temporary = sample_folder();
    let folder = temporary.path();
    walk(folder);
    for (line, code, says) in [
        (
            &[
                "reduce",
                "walk.bvh",
                "-o",
                "a.glb",
                "--method",
                "bessel-overhauser",
            ][..],
            2,
            "glTF has no bessel",
        ),
        (
            &["reduce", "walk.bvh", "-o", "a.glb", "--tolerance", "-3"],
            2,
            "expected a finite number of 0 or more",
        ),
        (
            &["reduce", "walk.bvh", "-o", "a.glb", "--tolerance", "1e-9"],
            4,
            "give a larger tolerance",
        ),
        (&["reduce", "walk.bvh", "-o", "a.npy"], 2, "holds results"),
        (
            &["reduce", "walk.bvh", "-o", "a.npz", "--quantize"],
            2,
            "--quantize is for glTF",
        ),
        (
            &["reduce", "walk.bvh", "-o", "a.bvh", "--meshopt"],
            2,
            "--meshopt is for glTF",
        ),
        (
            &[
                "reduce",
                "walk.bvh",
                "-o",
                "a.glb",
                "--quantize",
                "--method",
                "cubic",
            ],
            2,
            "leave out --method cubic",
        ),
        (
            &["reduce", "walk.bvh", "-o", "a.npz", "--method", "cubic"],
            4,
            "cubic spline",
        ),
        (
            &[
                "reduce", "walk.bvh", "a.dat", "-o", "all", "--to", "glb", "--plot", "a.svg",
            ],
            2,
            "needs a single input",
        ),
    ] {
        let run = run(folder, line);
        assert_eq!(run.code, code, "{line:?}: {}", run.words);
        assert!(run.words.contains(says), "{line:?}: {}", run.words);
    }
    let left: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name())
        .collect();
    assert!(
        !left
            .iter()
            .any(|name| name.to_str().unwrap().starts_with("a.glb")),
        "{left:?}"
    );
}

/// Channels at times of their own, and cubics with their tangents, go from glTF to glTF as they are.
#[test]
fn convert_keeps_cubics_and_times_of_channels() {
    let temporary = sample_folder();
    let folder = temporary.path();
    walk(folder);
    succeed(
        folder,
        &["reduce", "walk.bvh", "-o", "cubic.glb", "--method", "cubic"],
    );
    succeed(folder, &["convert", "cubic.glb", "-o", "again.glb"]);
    let bits = ["--tolerance", "0", "--distance", "0"];
    let said = succeed(
        folder,
        &[&["compare", "cubic.glb", "again.glb"][..], &bits].concat(),
    );
    assert!(String::from_utf8(said.out).unwrap().contains("largest 0°"));
    let refused = run(folder, &["convert", "cubic.glb", "-o", "again.bvh"]);
    assert!(
        refused.code == 4 && refused.words.contains("other times"),
        "{}",
        refused.words
    );
}

/// Formats with one list of times take a joint that stands still beside one that moves.
#[test]
fn still_joints_have_the_times_of_the_others() {
    let temporary = sample_folder();
    let folder = temporary.path();
    let keys = (0..31).map(|key| {
        let angle = f64::from(key) * 0.1;
        format!(
            "{} {} 0 0 {} 1 0 0 0\n",
            f64::from(key) / 30.0,
            angle.cos(),
            angle.sin()
        )
    });
    let keys: String = keys.collect();
    fs::write(folder.join("still.dat"), format!("# 2 1\n{keys}")).unwrap();
    for format in ["npz", "csv", "parquet"] {
        let out = format!("few.{format}");
        succeed(folder, &["reduce", "still.dat", "-o", &out]);
        let run = succeed(
            folder,
            &["compare", "still.dat", &out, "--tolerance", "0.11"],
        );
        assert!(run.words.is_empty(), "{}", run.words);
    }
}
