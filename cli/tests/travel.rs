//! Bodies on paths in pictures, plots and pages; and the pipe from a hill to a film.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use glam::{Quat, Vec3};

use crate::browser::Page;
use crate::program::{finish, root, run, sample_folder, succeed};

/// A curve in space with bends to both sides.
const ROAD: &str = "t,x,y,z\n0,0,0,0\n1,1,0.4,1\n2,2,0.8,-1\n3,3,0.3,1\n4,4,0,0\n";

fn road_folder() -> tempfile::TempDir {
    let folder = sample_folder();
    fs::write(folder.path().join("road.csv"), ROAD).unwrap();
    folder
}

fn words(line: &str) -> Vec<&str> {
    line.split(' ').collect()
}

/// Red, green and blue of a PNG, and how wide it is.
fn pixels(file: &Path) -> (Vec<[u8; 3]>, usize) {
    let file = std::io::BufReader::new(fs::File::open(file).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    let pixels = bytes[..info.buffer_size()].chunks_exact(3);
    let pixels = pixels.map(|pixel| [pixel[0], pixel[1], pixel[2]]);
    (pixels.collect(), info.width as usize)
}

fn colourful(pixel: &[u8; 3]) -> bool {
    pixel.iter().max().unwrap() - pixel.iter().min().unwrap() > 60
}

/// The commands of the guide's block that begins so.
fn commands(start: &str) -> String {
    let guide = fs::read_to_string(root().join("docs/paths.md")).unwrap();
    let mut blocks = guide.split("```");
    let found =
        blocks.find_map(|block| block.strip_prefix("sh\n").filter(|b| b.starts_with(start)));
    found
        .unwrap_or_else(|| panic!("no block begins with {start}"))
        .to_owned()
}

/// The guide's pipe, as it stands there: the box stays on the hill, upright on it, and clear of rocks.
#[test]
fn the_guide_s_pipe_leads_a_box_over_the_hill() {
    let folder = tempfile::tempdir().unwrap();
    let program = Path::new(env!("CARGO_BIN_EXE_tumble")).parent().unwrap();
    let path = std::env::var("PATH").unwrap();
    let output = Command::new("sh")
        .args(["-euc", &commands("tumble generate --hill")])
        .env("PATH", format!("{}:{path}", program.display()))
        .current_dir(folder.path())
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let done = finish(output);
    assert_eq!(done.code, 0, "{}", done.words);
    let film = fs::metadata(folder.path().join("walk.gif")).unwrap().len();
    assert!((20_000..400_000).contains(&film), "{film} bytes");

    succeed(
        folder.path(),
        &words("eval walk.glb --quantity world -o walk.npy"),
    );
    let bytes = fs::read(folder.path().join("walk.npy")).unwrap();
    let poses = npyz::NpyFile::new(&bytes[..]).unwrap();
    let poses = poses.into_vec::<f32>().unwrap();
    let read = |name: &str| {
        let bytes = fs::read(folder.path().join(name)).unwrap();
        let polygons = tumble_formats::surface::obj::read_obj(name, &bytes).unwrap();
        let faces = polygons.iter();
        tumble_routes::mesh::Mesh::welded(&polygons.positions, faces, 0.0).unwrap()
    };
    let (hill, rocks) = (read("hill.obj"), read("rocks.obj"));
    let distance: f32 = poses
        .chunks(7)
        .zip(poses.chunks(7).skip(1))
        .map(|(from, to)| Vec3::from_slice(from).distance(Vec3::from_slice(to)))
        .sum();
    assert!(distance > 12.0, "{distance}");
    assert!(poses.chunks(7).any(|pose| pose[1] > 1.0), "it climbs");
    for pose in poses.chunks(7) {
        let at = Vec3::from_slice(pose).as_dvec3();
        // Straight parts between f32 points of the path lie on the hill's triangles.
        let off = hill.nearest(at).distance(at);
        assert!(off < 0.01, "{at} is {off} off the hill");
        let clear = rocks.nearest(at).distance(at);
        // The route's clearance, minus the rounding of its points. No point of a box of length 0.6 is
        // farther than this from its foot: the upper corners are √(0.3² + 0.18² + 0.24²) = 0.424 away.
        assert!(clear > 0.45 - 1e-5, "{at} is {clear} from a rock");
        let up = Quat::from_slice(&pose[3..]) * Vec3::Y;
        // The ground has a slope of at most 40°; looking ahead adds at most 5°.
        assert!(up.y > 0.707, "{up} at {at} is not upright");
    }
}

#[test]
fn a_path_its_axes_and_a_box_are_rendered() {
    let folder = road_folder();
    let line = "render road.csv --path-frame frenet,minimal --size 400x200 --start 1.5 -o a.png";
    let run = succeed(folder.path(), &words(line));
    assert!(
        run.words.contains("road.csv: 1 frame, 1 path, on"),
        "{}",
        run.words
    );
    let (found, width) = pixels(&folder.path().join("a.png"));
    let coloured = |columns: std::ops::Range<usize>| {
        let rows = found.chunks(width).flat_map(|row| &row[columns.clone()]);
        rows.filter(|pixel| colourful(pixel)).count()
    };
    for columns in [0..200, 200..400] {
        let count = coloured(columns);
        assert!(count > 300, "{count} pixels of boxes and axes");
    }
    // Without axes, only the small body is coloured, and it moves.
    let still = |start: &str, out: &str| {
        let line =
            format!("render road.csv --drawn-frames 0 --size 200x200 --start {start} -o {out}");
        succeed(folder.path(), &words(&line));
        pixels(&folder.path().join(out)).0
    };
    let (one, other) = (still("0.5", "b.png"), still("3.5", "c.png"));
    let middle = |pixels: &[[u8; 3]]| {
        let columns = (0..pixels.len())
            .filter(|&at| colourful(&pixels[at]))
            .map(|at| at % 200);
        let columns: Vec<usize> = columns.collect();
        assert!(columns.len() > 50, "{} pixels of a box", columns.len());
        columns.iter().sum::<usize>() / columns.len()
    };
    assert!(middle(&one) + 40 < middle(&other), "it goes to the right");
    // The result of `follow` looks the same.
    succeed(
        folder.path(),
        &words("follow road.csv --fps 100 -o road.glb"),
    );
    let line = "render road.glb --drawn-frames 0 --size 200x200 --start 3.5 -o d.png";
    succeed(folder.path(), &words(line));
    let again = pixels(&folder.path().join("d.png")).0;
    let differ = |(a, b): &(&[u8; 3], &[u8; 3])| (0..3).any(|c| a[c].abs_diff(b[c]) > 40);
    let count = other.iter().zip(&again).filter(differ).count();
    assert!(count < 400, "{count} pixels differ");
}

#[test]
fn paths_are_plotted_by_each_frame() {
    let folder = road_folder();
    let line = "plot road.csv --path-frame minimal,fixed -o road.svg";
    succeed(folder.path(), &words(line));
    let svg = fs::read_to_string(folder.path().join("road.svg")).unwrap();
    for word in [
        "speed along the path",
        "turning rate",
        "turned about",
        "minimal",
        "fixed",
    ] {
        assert!(svg.contains(word), "no {word}");
    }
    succeed(folder.path(), &words("follow road.csv -o road.glb"));
    succeed(
        folder.path(),
        &words("plot road.glb --show path -o again.png"),
    );
    let refused = |line: &str, message: &str| {
        let run = run(folder.path(), &words(line));
        assert_eq!(run.code, 2, "{}", run.words);
        assert!(run.words.contains(message), "{}", run.words);
    };
    refused("plot road.csv --show error -o e.svg", "--show path");
    refused("plot a.dat --show path -o e.svg", "neither a file of paths");
    refused(
        "render road.csv --path-frame sideways -o e.png",
        "--path-frame",
    );
}

#[test]
fn smoothing_is_plotted() {
    let folder = road_folder();
    succeed(
        folder.path(),
        &words("smooth a.dat -o calm.npy --plot calm.svg"),
    );
    let svg = fs::read_to_string(folder.path().join("calm.svg")).unwrap();
    for word in ["before and after", "angular speed", "gaussian:2"] {
        assert!(svg.contains(word), "no {word}");
    }
    let run = run(
        folder.path(),
        &words("smooth a.dat b.dat -o calm --plot c.svg"),
    );
    assert_eq!(run.code, 2, "{}", run.words);
}

#[test]
fn a_batch_of_paths_goes_on_where_it_stopped() {
    let folder = road_folder();
    fs::create_dir(folder.path().join("paths")).unwrap();
    for name in ["a", "b"] {
        fs::write(folder.path().join(format!("paths/{name}.csv")), ROAD).unwrap();
    }
    succeed(folder.path(), &words("follow paths -o poses --resume"));
    let result = |name: &str| fs::read(folder.path().join("poses").join(name)).unwrap();
    let first = result("a.npy");
    fs::remove_file(folder.path().join("poses/b.npy")).unwrap();
    let again = succeed(folder.path(), &words("follow paths -o poses --resume"));
    assert!(again.words.contains("1 result kept"), "{}", again.words);
    assert_eq!(result("b.npy"), first, "the same path");
    // With other options, `follow` makes all results again.
    let other = succeed(
        folder.path(),
        &words("follow paths -o poses --resume --path-frame fixed"),
    );
    assert!(
        !other.words.contains("(already complete)"),
        "{}",
        other.words
    );
    assert!(result("a.npy") != first);
    succeed(folder.path(), &words("check poses"));
}

#[test]
fn the_page_shows_paths_with_axes_and_a_body_that_moves() {
    let folder = road_folder();
    succeed(
        folder.path(),
        &words("generate --hill -o hill.obj --rocks rocks.obj"),
    );
    let line = "view road.csv --path-frame minimal,frenet --fps 30 --mesh hill.obj -o view.html";
    succeed(folder.path(), &words(line));
    let Some(mut page) = Page::open(&folder.path().join("view.html")) else {
        return;
    };
    // In view are one box and its roof, a curve with a bar between every two samples, and three
    // axes at 40 points.
    let found = page.value("tumble.inView()");
    let samples = page.value("tumble.state.input.samples").as_u64().unwrap();
    assert!(samples >= 121, "{samples}");
    assert_eq!(found, serde_json::json!([[1, 1, samples - 1, 120]]));
    let names = "[...document.querySelectorAll('#method option')].map((e) => e.value).join()";
    assert_eq!(page.value(names), "minimal,frenet");
    assert_eq!(
        page.value("document.querySelector('#method-label').textContent"),
        "Frame"
    );

    // Bodies are where `follow` puts them, and turned as it turns them.
    succeed(
        folder.path(),
        &words("follow road.csv --fps 1 -o poses.npy"),
    );
    let bytes = fs::read(folder.path().join("poses.npy")).unwrap();
    let poses = npyz::NpyFile::new(&bytes[..]).unwrap().into_vec::<f32>();
    for (time, pose) in poses.unwrap().chunks(7).enumerate() {
        page.value(&format!("tumble.seek({time})"));
        let numbers = |value: serde_json::Value| -> Vec<f32> {
            let all = value.as_array().unwrap().iter();
            all.map(|number| number.as_f64().unwrap() as f32).collect()
        };
        let at = numbers(page.value("tumble.ends(0)[0]"));
        assert!(Vec3::from_slice(&at).distance(Vec3::from_slice(pose)) < 2e-4);
        let rotation = numbers(page.value("tumble.shown(0)"));
        let cosine = Quat::from_slice(&rotation).dot(Quat::from_slice(&pose[3..]));
        assert!(cosine.abs() > 1.0 - 1e-6, "{cosine} at {time}");
    }
    let mut drawn = |time: &str| {
        page.value(&format!("tumble.seek({time})"));
        page.pixels("#stage").0
    };
    let (start, later) = (drawn("0"), drawn("3"));
    let count = start.iter().filter(|pixel| colourful(pixel)).count();
    assert!(count > 500, "{count} pixels of a path");
    assert!(start != later, "the body moves");
    assert_eq!(page.errors, Vec::<String>::new());
}
