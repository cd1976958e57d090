//! `tumble route`, by running it.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::program::{root, run, succeed};

/// A terrain whose lengths are known, as OBJ; z is up.
fn terrain(folder: &Path) {
    let height =
        |x: u32, y: u32| f64::from((7 * x * x + 13 * y * y + 5 * x * y + 3 * x) % 17) / 8.0;
    let mut text = String::new();
    for (x, y) in (0..10).flat_map(|y| (0..10).map(move |x| (x, y))) {
        text += &format!("v {x} {y} {}\n", height(x, y));
    }
    for (x, y) in (0..9).flat_map(|y| (0..9).map(move |x| (x, y))) {
        let at = |dx, dy| (y + dy) * 10 + x + dx + 1;
        text += &format!("f {} {} {}\n", at(0, 0), at(1, 0), at(1, 1));
        text += &format!("f {} {} {}\n", at(0, 0), at(1, 1), at(0, 1));
    }
    fs::write(folder.join("hill.obj"), text).unwrap();
}

/// A square of 10 by 10 in the plane of x and z, with y up, as glTF; beside it one of 1 by 1.
pub(crate) fn plaza(folder: &Path) {
    let corners: [f32; 24] = [
        0.0, 0.0, 0.0, 10.0, 0.0, 0.0, 10.0, 0.0, 10.0, 0.0, 0.0, 10.0, 20.0, 0.0, 0.0, 21.0, 0.0,
        0.0, 21.0, 0.0, 1.0, 20.0, 0.0, 1.0,
    ];
    let indices: [u16; 12] = [0, 2, 1, 0, 3, 2, 4, 6, 5, 4, 7, 6];
    let mut bytes: Vec<u8> = corners.iter().flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend(indices.iter().flat_map(|index| index.to_le_bytes()));
    fs::write(folder.join("plaza.bin"), bytes).unwrap();
    let text = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
        "nodes":[{"children":[1],"translation":[0,1,0]},{"mesh":0,"scale":[2,1,2]},{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":8,"type":"VEC3"},
            {"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}],
        "bufferViews":[{"buffer":0,"byteLength":96},{"buffer":0,"byteOffset":96,"byteLength":24}],
        "buffers":[{"uri":"plaza.bin","byteLength":120}]}"#;
    fs::write(folder.join("plaza.gltf"), text).unwrap();
}

fn rows(file: &Path) -> (String, Vec<Vec<f64>>) {
    let text = fs::read_to_string(file).unwrap();
    let (header, rest) = text.split_once('\n').unwrap();
    let row = |line: &str| line.split(',').map(|cell| cell.parse().unwrap()).collect();
    (header.to_owned(), rest.lines().map(row).collect())
}

fn length(rows: &[Vec<f64>], first: usize) -> f64 {
    let step = |pair: &[Vec<f64>]| -> f64 {
        let square = |k: usize| (pair[0][first + k] - pair[1][first + k]).powi(2);
        (square(0) + square(1) + square(2)).sqrt()
    };
    rows.windows(2).map(step).sum()
}

#[test]
fn a_way_over_a_hill() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    terrain(folder);
    for (by, expected) in [
        ("exact", 7.986_460_126_6),
        ("plane", 8.413_577_301_2),
        ("greedy", 8.891_446_896_6),
        ("edges", 8.415_952_011_6),
    ] {
        let line = [
            "route",
            "hill.obj",
            "--start-point",
            "0,0,0",
            "--end-point",
            "3,6,0.125",
            "--by",
            by,
            "-o",
            "way.csv",
            "--overwrite",
            "--plot",
            "way.svg",
        ];
        let words = succeed(folder, &line).words;
        let (header, rows) = rows(&folder.join("way.csv"));
        assert_eq!(header, "x,y,z,ux,uy,uz");
        assert!(
            (length(&rows, 0) - expected).abs() < 1e-9,
            "{by}: {}",
            length(&rows, 0)
        );
        assert!(words.contains(&format!("{} points", rows.len())), "{words}");
    }
    let svg = fs::read_to_string(folder.join("way.svg")).unwrap();
    assert!(
        roxmltree::Document::parse(&svg)
            .unwrap()
            .descendants()
            .filter(|node| node.has_tag_name("circle"))
            .count()
            == 2
    );
    // The path goes to standard output; a message says how far the start is from the surface.
    let printed = succeed(
        folder,
        &[
            "route",
            "hill.obj",
            "--start-point",
            "0,0,5",
            "--end-point",
            "3,6,0.125",
            "-o",
            "-",
            "--plot",
            "way.png",
        ],
    );
    assert!(
        printed.words.contains("the start point is"),
        "{}",
        printed.words
    );
    assert!(
        String::from_utf8(printed.out)
            .unwrap()
            .starts_with("x,y,z,")
    );
    assert!(
        fs::read(folder.join("way.png"))
            .unwrap()
            .starts_with(b"\x89PNG")
    );
}

#[test]
fn many_pairs_and_what_fails_of_them() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    plaza(folder);
    // The child stands 1 up and is twice as large; the other node is in no scene.
    fs::write(
        folder.join("pairs.txt"),
        "# x y z, x y z\n0 1 0 20 1 20\n0,1,0,41,1,1\n\n5 1 5 5 1 5\n",
    )
    .unwrap();
    let batch = run(
        folder,
        &[
            "route",
            "plaza.gltf",
            "--pairs",
            "pairs.txt",
            "-o",
            "ways",
            "--json",
        ],
    );
    assert_eq!(batch.code, 3, "{}", batch.words);
    assert!(
        batch
            .words
            .contains("route-2: start and goal are on parts of the surface that are not connected"),
        "{}",
        batch.words
    );
    assert!(
        batch.words.contains("the start's has 2 triangles"),
        "{}",
        batch.words
    );
    let lines: serde_json::Value = serde_json::from_slice(&batch.out).unwrap();
    assert!((lines[0]["length"].as_f64().unwrap() - 800f64.sqrt()).abs() < 1e-12);
    assert_eq!(
        (lines[1]["length"].is_null(), lines[2]["points"].as_u64()),
        (true, Some(1))
    );
    assert!(folder.join("ways/route-1.csv").exists() && !folder.join("ways/route-2.csv").exists());
    fs::write(folder.join("pairs.txt"), "0 1 0 41 1 1\n").unwrap();
    let failed = run(
        folder,
        &["route", "plaza.gltf", "--pairs", "pairs.txt", "-o", "none"],
    );
    assert_eq!(failed.code, 4, "{}", failed.words);
}

#[test]
fn walkers_wait() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    plaza(folder);
    let walkers = "name,radius,speed,x,y,z,to_x,to_y,to_z,track\n\
                   one,0.5,1,5,1,10,15,1,10,\ntwo,0.5,1,10,1,5,10,1,15,\ngate,0.5,,,,,,,,gate.csv\n";
    fs::write(folder.join("walkers.csv"), walkers).unwrap();
    fs::write(folder.join("gate.csv"), "t,x,y,z\n90,10,1,10\n95,10,1,10\n").unwrap();
    let walked = succeed(
        folder,
        &[
            "route",
            "plaza.gltf",
            "--walkers",
            "walkers.csv",
            "-o",
            "ways",
            "--json",
        ],
    );
    let lines: serde_json::Value = serde_json::from_slice(&walked.out).unwrap();
    for (line, expected) in [(0, 10.0), (1, 10.0 + 2f64.sqrt())] {
        let arrival = lines[line]["arrival"].as_f64().unwrap();
        assert!((arrival - expected).abs() < 1e-9, "{arrival}");
    }
    let (header, rows) = rows(&folder.join("ways/two.csv"));
    assert_eq!(header, "t,x,y,z,ux,uy,uz");
    assert!(
        rows.windows(2).all(|pair| pair[0][0] < pair[1][0]),
        "{rows:?}"
    );
}

#[test]
fn ways_between_rocks_and_on_nets() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    plaza(folder);
    let rock = "v 10 1 10\nv 10.01 1 10\nv 10 1.01 10\nf 1 2 3\n";
    fs::write(folder.join("rock.obj"), rock).unwrap();
    let line = |from, out| {
        [
            "route",
            "plaza.gltf",
            "--start-point",
            from,
            "--end-point",
            "14,1,10",
            "--avoid",
            "rock.obj",
            "--clearance",
            "2",
            "--finest",
            "0.2",
            "-o",
            out,
        ]
    };
    succeed(folder, &line("6,1,10", "way.csv"));
    let (_, points) = rows(&folder.join("way.csv"));
    let shortest = 2.0 * (2.0 * 3f64.sqrt() + std::f64::consts::PI / 3.0);
    let over = length(&points, 0) - shortest;
    assert!(over > 0.0 && over < 0.6, "{over}");
    let refused = run(folder, &line("9,1,10", "no.csv"));
    assert_eq!(refused.code, 4);
    assert!(
        refused.words.contains("is not on free ground"),
        "{}",
        refused.words
    );
    // z = x y, as NPY.
    let mut bytes =
        b"\x93NUMPY\x01\x00\x76\x00{'descr': '<f8', 'fortran_order': False, 'shape': (2, 2, 3), }"
            .to_vec();
    bytes.resize(127, b' ');
    bytes.push(b'\n');
    for number in [0, 0, 0, 0, 1, 0, 1, 0, 0, 1, 1, 1] {
        bytes.extend(f64::from(number).to_le_bytes());
    }
    fs::write(folder.join("net.npy"), bytes).unwrap();
    let net = |by| {
        [
            "route",
            "net.npy",
            "--start-point",
            "0,0,0",
            "--end-point",
            "1,0.5,0.5",
            "--by",
            by,
            "-o",
            "net.csv",
            "--overwrite",
            "--json",
        ]
    };
    for (by, expected, bound) in [
        ("line", 1.252_949_347_6, 1e-10),
        ("facets:40", 1.251_039, 3e-5),
    ] {
        let routed = succeed(folder, &net(by));
        let lines: serde_json::Value = serde_json::from_slice(&routed.out).unwrap();
        let length = lines[0]["length"].as_f64().unwrap();
        assert!((length - expected).abs() < bound, "{by}: {length}");
    }
    for by in ["exact", "facets:0", "facets:x"] {
        assert_ne!(run(folder, &net(by)).code, 0);
    }
}

#[test]
fn bad_inputs_and_lines() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    terrain(folder);
    fs::write(
        folder.join("flat.obj"),
        "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n",
    )
    .unwrap();
    fs::write(
        folder.join("empty.ply"),
        "ply\nformat ascii 1.0\nend_header\n",
    )
    .unwrap();
    fs::write(folder.join("pairs.txt"), "1 2 3\n").unwrap();
    fs::write(folder.join("hill.txt"), "").unwrap();
    fs::write(folder.join("cube.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\nf 1 3 4 2\nf 1 2 6 5\nf 1 5 7 3\nf 8 7 5 6\nf 8 6 2 4\nf 8 4 3 7\n").unwrap();
    let ends = [
        "--start-point",
        "0,0,0",
        "--end-point",
        "1,1,1",
        "-o",
        "out.csv",
    ];
    for (code, words, message) in [
        (4, vec!["route", "flat.obj"], "no faces with an area"),
        (4, vec!["route", "empty.ply"], "no faces"),
        (4, vec!["route", "none.obj"], "cannot be read"),
        (2, vec!["route", "hill.txt"], ".obj, .ply"),
        (2, vec!["route", "hill.obj", "--by", "crow"], "exact, plane"),
        (2, vec!["route", "hill.obj", "--by", "line"], "is a mesh"),
        (2, vec!["route", "hill.obj", "--clearance", "1"], "--avoid"),
        (2, vec!["route", "hill.obj", "--max-slope", "91"], "0 to 90"),
        (
            2,
            vec!["route", "hill.obj", "--finest", "0.1"],
            "--finest has no effect on routes over a whole mesh",
        ),
        (
            2,
            vec!["route", "hill.obj", "--up", "0,0,1"],
            "--up has no effect on these routes",
        ),
        (
            2,
            vec!["route", "hill.obj", "--pairs", "pairs.txt"],
            "cannot be used with",
        ),
        (
            4,
            vec!["route", "cube.obj", "--by", "plane"],
            "the plane is not defined",
        ),
    ] {
        let line: Vec<&str> = words.into_iter().chain(ends).collect();
        let refused = run(folder, &line);
        assert_eq!(refused.code, code, "{line:?}: {}", refused.words);
        assert!(
            refused.words.contains(message),
            "{line:?}: {}",
            refused.words
        );
        assert!(!folder.join("out.csv").exists());
    }
    let refused = run(
        folder,
        &["route", "hill.obj", "--pairs", "pairs.txt", "-o", "out"],
    );
    assert_eq!(refused.code, 4);
    assert!(refused.words.contains("pairs.txt:1"), "{}", refused.words);
    let refused = run(folder, &["route", "hill.obj", "-o", "out.csv"]);
    assert_eq!(refused.code, 2);
}

/// An exact algorithm that is not ours has the same lengths.
#[test]
fn pygeodesic_agrees() {
    let python = root().join("target/peers/bin/python");
    if !python.exists() {
        assert!(
            std::env::var_os("CI").is_none(),
            "scripts/test.sh installs the peers into target/peers"
        );
        eprintln!("NO PEERS (scripts/test.sh installs them): this test compared nothing");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut peers = Command::new(python);
    peers.arg(root().join("cli/tests/peers/routes.py"));
    let output = peers
        .arg(env!("CARGO_BIN_EXE_tumble"))
        .arg(folder.path())
        .output()
        .unwrap();
    println!("{}", String::from_utf8_lossy(&output.stdout));
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}
