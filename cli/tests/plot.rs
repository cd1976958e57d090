//! The contents of pictures, read back from SVG and PNG.

use std::fs;
use std::path::Path;

use crate::program::{pendulum, run, sample_folder, succeed};
use roxmltree::{Document, Node};

const SLERP: &str = "#D55E00";
const BESSEL_OVERHAUSER: &str = "#009E73";
const AUTHORED: &str = "#E7298A";
/// The number of an SVG's units in one of its pixels.
const FINER: f64 = 10.0;

/// An SVG file's marks.
struct Marks {
    texts: Vec<String>,
    /// Labels of ticks below the axes of times, and where their middle is.
    time_labels: Vec<(f64, f64)>,
    /// Width and height in pixels.
    size: [f64; 2],
    /// Stroke and points of every line.
    lines: Vec<(String, Vec<(f64, f64)>)>,
    dots: Vec<(f64, f64)>,
}

fn number(node: Node<'_, '_>, name: &str) -> f64 {
    node.attribute(name).unwrap().parse().unwrap()
}

impl Marks {
    fn of(path: &Path) -> Self {
        let text = fs::read_to_string(path).unwrap();
        let document = Document::parse(&text).unwrap();
        let named =
            |name: &'static str| document.descendants().filter(move |n| n.has_tag_name(name));
        let points = |line: Node<'_, '_>| {
            let numbers = line.attribute("points").unwrap().split([' ', ',']);
            let numbers: Vec<f64> = numbers.filter_map(|number| number.parse().ok()).collect();
            numbers.chunks(2).map(|pair| (pair[0], pair[1])).collect()
        };
        let texts = || named("text").map(|text| (text, text.text().unwrap().trim()));
        // Labels of the other axis end where the panel begins; titles and names of axes are not numbers.
        let middle = texts().filter(|(text, _)| text.attribute("text-anchor") == Some("middle"));
        Self {
            texts: texts().map(|(_, shown)| shown.to_owned()).collect(),
            time_labels: middle
                .filter_map(|(text, shown)| Some((shown.parse().ok()?, number(text, "x"))))
                .collect(),
            size: ["width", "height"].map(|name| number(document.root_element(), name)),
            lines: named("polyline")
                .map(|line| (line.attribute("stroke").unwrap().to_owned(), points(line)))
                .collect(),
            dots: named("circle")
                .map(|dot| (number(dot, "cx"), number(dot, "cy")))
                .collect(),
        }
    }

    /// Curves of that colour; the legend's mark is a line of two points.
    fn curves(&self, colour: &str) -> Vec<&Vec<(f64, f64)>> {
        let curves = self
            .lines
            .iter()
            .filter(|line| line.0 == colour && line.1.len() > 2);
        curves.map(|line| &line.1).collect()
    }

    fn says(&self, text: &str) -> bool {
        self.texts.iter().any(|shown| shown == text)
    }
}

fn plot(folder: &Path, arguments: &[&str]) -> Marks {
    let line = [
        &["plot", "a.dat", "-o", "out.svg", "--overwrite"],
        arguments,
    ]
    .concat();
    let run = succeed(folder, &line);
    assert!(
        run.words.contains("1 picture of 1 input, on "),
        "{}",
        run.words
    );
    Marks::of(&folder.join("out.svg"))
}

/// Would catch a component mistaken for another, a wrong order of boxes, and an axis that
/// does not show the values it says.
#[test]
fn a_dimension_is_drawn_with_its_keys_where_its_values_are() {
    let folder = sample_folder();
    let (times, keys) = pendulum();
    // Only z of box 1 and x of box 2 turn.
    for (dimension, title, track, component) in [
        ("4", "dimension 4: z of box 1", 0, 2),
        ("6", "dimension 6: x of box 2", 1, 0),
    ] {
        let marks = plot(
            folder.path(),
            &["--dimension", dimension, "-m", "slerp", "--fps", "50"],
        );
        assert!(marks.says(title), "{:?}", marks.texts);
        assert!(marks.says("slerp") && marks.says("key") && marks.says("time, s"));
        assert!(
            marks.says("101 frames, 50 per second; evaluated on CPU"),
            "{:?}",
            marks.texts
        );
        let [curve] = marks.curves(SLERP)[..] else {
            panic!("one curve, not {}", marks.curves(SLERP).len());
        };
        assert_eq!(curve.len(), 101);
        // A dot for each key, and one in the legend, which comes first.
        let dots = &marks.dots[1..];
        assert_eq!(dots.len(), times.len());
        let values: Vec<f64> = (0..times.len())
            .map(|key| keys[track * times.len() + key].to_array()[component].into())
            .collect();
        let height = (dots[1].1 - dots[0].1) / (values[1] - values[0]);
        let width = (dots[1].0 - dots[0].0) / (times[1] - times[0]);
        assert!(height < 0.0 && width > 0.0, "up is more, right is later");
        assert!(marks.time_labels.len() >= 5, "{:?}", marks.time_labels);
        for &(seconds, x) in &marks.time_labels {
            let expected = dots[0].0 + width * (seconds - times[0]);
            assert!(
                (x - expected).abs() < FINER / 2.0,
                "{seconds} s is at {x}, not {expected}"
            );
        }
        for ((dot, value), time) in dots.iter().zip(&values).zip(&times) {
            let expected = (
                dots[0].0 + width * (time - times[0]),
                dots[0].1 + height * (value - values[0]),
            );
            let off = (dot.0 - expected.0).hypot(dot.1 - expected.1);
            assert!(off < FINER / 2.0, "{dot:?} is not at {expected:?}");
            let near = curve.iter().map(|p| (p.0 - dot.0).hypot(p.1 - dot.1));
            assert!(
                near.fold(f64::INFINITY, f64::min) < FINER / 2.0,
                "off the curve"
            );
        }
    }
}

/// Keys as dense as frames would hide the curve; a few lie on it.
#[test]
fn dots_cover_a_curve_only_where_they_are_apart() {
    let folder = sample_folder();
    for (keys, is_covered) in [("20", true), ("400", false)] {
        let line = [
            "generate",
            "--boxes",
            "1",
            "--keys",
            keys,
            "-o",
            "a.dat",
            "--overwrite",
        ];
        succeed(folder.path(), &line);
        let options = [
            "plot",
            "a.dat",
            "--dimension",
            "1",
            "-m",
            "slerp",
            "-o",
            "out.svg",
            "--overwrite",
        ];
        succeed(folder.path(), &options);
        let text = fs::read_to_string(folder.path().join("out.svg")).unwrap();
        let document = Document::parse(&text).unwrap();
        let mut drawn = document.descendants().filter(|node| {
            let is_curve = node.has_tag_name("polyline") && node.attribute("stroke") == Some(SLERP);
            is_curve || node.has_tag_name("circle")
        });
        let last = drawn.next_back().unwrap();
        assert_eq!(last.has_tag_name("circle"), is_covered, "{keys} keys");
    }
}

#[test]
fn every_box_has_a_panel_and_every_method_a_curve() {
    let folder = sample_folder();
    let marks = plot(folder.path(), &[]);
    assert!(marks.says("box 1: dimensions 1 to 4") && marks.says("box 2: dimensions 5 to 8"));
    for (name, colour) in [
        ("w", "#22262B"),
        ("x", "#D55E00"),
        ("y", "#009E73"),
        ("z", "#0072B2"),
    ] {
        assert!(marks.says(name));
        assert_eq!(marks.curves(colour).len(), 2, "{name}");
    }
    assert_eq!(marks.dots.len(), 1 + 2 * 4 * 5);
    let marks = plot(folder.path(), &["-m", "slerp,bessel-overhauser,slerp"]);
    assert_eq!(marks.curves(SLERP).len(), 8);
    assert_eq!(marks.curves(BESSEL_OVERHAUSER).len(), 8);
    let marks = plot(folder.path(), &["--box", "2", "-m", "all"]);
    assert!(marks.says("dimension 5: w of box 2") && !marks.says("dimension 1: w of box 1"));
    // A curve that later ones cover is named with the one above it.
    let covered = |text: &String, name: &str| text.starts_with(&format!("{name} (below "));
    for method in tumble::METHODS {
        let is_covered = marks.texts.iter().any(|text| covered(text, method.name));
        assert!(marks.says(method.name) != is_covered, "{method}");
    }
    let marks = plot(
        folder.path(),
        &["--box", "2", "-m", "catmull-rom,slerp,kochanek-bartels"],
    );
    assert!(
        marks.says("catmull-rom (below kochanek-bartels)") && marks.says("slerp"),
        "{:?}",
        marks.texts
    );
}

/// The panels of a skeleton have the names of its joints; of a long name, the end is shown.
#[test]
fn panels_have_the_names_of_joints() {
    let folder = tempfile::tempdir().unwrap();
    let long = "a name with more characters than a panel has room for: left hand";
    let text = format!(
        "HIERARCHY\nROOT hips\n{{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n\
         JOINT {}\n{{\nOFFSET 0 1 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n\
         End Site\n{{\nOFFSET 0 1 0\n}}\n}}\n}}\n\
         MOTION\nFrames: 2\nFrame Time: 0.5\n0 0 0 0 0 0\n90 0 0 0 45 0\n",
        long.replace(' ', "_")
    );
    fs::write(folder.path().join("a.dat"), text).unwrap();
    let hand = "…acters_than_a_panel_has_room_for:_left_hand";
    for show in ["speed", "error", "sphere"] {
        let marks = plot(folder.path(), &["--show", show]);
        assert!(marks.says("hips") && marks.says(hand), "{:?}", marks.texts);
    }
    let marks = plot(folder.path(), &[]);
    assert!(
        marks.says("hips") && marks.says(hand) && !marks.says("hips: dimensions 1 to 4"),
        "{:?}",
        marks.texts
    );
    let marks = plot(folder.path(), &["--dimension", "6"]);
    assert!(marks.says(&format!("x of {hand}")), "{:?}", marks.texts);
}

/// A BVH file of joints side by side, `joint1` and so on. Those numbered in `still` do not turn.
fn skeleton(folder: &Path, joints: usize, still: &[usize]) {
    let mut text =
        "HIERARCHY\nROOT joint1\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n"
            .to_owned();
    for joint in 2..=joints {
        text += &format!(
            "JOINT joint{joint}\n{{\nOFFSET 0 1 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n\
             End Site\n{{\nOFFSET 0 1 0\n}}\n}}\n"
        );
    }
    text += "}\nMOTION\nFrames: 3\nFrame Time: 0.5\n";
    for angle in [10, 20, 10] {
        for joint in 1..=joints {
            let angle = if still.contains(&joint) { 30 } else { angle };
            text += &format!("{angle} 0 0 ");
        }
        text += "\n";
    }
    fs::write(folder.join("a.dat"), text).unwrap();
}

/// Would catch panels that show nothing, joints that are missing without a word, and chosen ones that are left out.
#[test]
fn joints_that_do_not_turn_are_left_out_unless_they_are_chosen() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let out = ["-o", "out.svg", "--overwrite", "--show", "speed"];
    for (still, arguments, drawn, note) in [
        (&[][..], "", &[1, 2, 3, 4][..], None),
        (
            &[2, 4],
            "",
            &[1, 3],
            Some("a.dat: without rotation and not drawn: joint2, joint4; --tracks draws them\n"),
        ),
        (
            &[1],
            "",
            &[2, 3, 4],
            Some("a.dat: without rotation and not drawn: joint1; --tracks draws it\n"),
        ),
        (&[2, 4], "--box 2,3", &[2, 3], None),
        (&[2, 4], "--tracks joint4", &[4], None),
        (&[1, 2, 3, 4], "", &[1, 2, 3, 4], None),
    ] {
        skeleton(folder, 4, still);
        let chosen = arguments.split_whitespace();
        let line: Vec<&str> = ["plot", "a.dat"]
            .into_iter()
            .chain(out)
            .chain(chosen)
            .collect();
        let words = succeed(folder, &line).words;
        match note {
            Some(note) => assert!(words.contains(note), "{words}"),
            None => assert!(!words.contains("not drawn"), "{words}"),
        }
        let marks = Marks::of(&folder.join("out.svg"));
        for joint in 1..=4 {
            let is_drawn = marks.says(&format!("joint{joint}"));
            assert_eq!(
                is_drawn,
                drawn.contains(&joint),
                "{still:?} {arguments}: {joint}"
            );
        }
    }
    skeleton(folder, 4, &[2, 4]);
    succeed(folder, &["plot", "a.dat", "-o", "each"]);
    assert_eq!(fs::read_dir(folder.join("each")).unwrap().count(), 2);
    succeed(folder, &["plot", "--report", "a.dat", "-o", "report"]);
    let marks = Marks::of(&folder.join("report/a-speed.svg"));
    assert!(marks.says("joint3") && !marks.says("joint2"));
    // A dimension that is named counts as chosen.
    succeed(
        folder,
        &["plot", "a.dat", "--dimension", "5", "-o", "one.svg"],
    );
    assert!(Marks::of(&folder.join("one.svg")).says("w of joint2"));
}

/// Would catch a page of one long column.
#[test]
fn a_page_of_many_panels_is_about_as_broad_as_high() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for (joints, show, columns) in [
        (1, "components", 1),
        (2, "speed", 1),
        (3, "speed", 2),
        (8, "components", 2),
        (9, "speed", 3),
        (18, "error", 3),
        (19, "speed", 4),
        (31, "components", 4),
        (8, "sphere", 2),
        (9, "sphere", 3),
        (10, "sphere", 4),
        (31, "sphere", 6),
    ] {
        skeleton(folder, joints, &[]);
        let marks = plot(folder, &["--show", show]);
        let titles = marks.texts.iter().filter(|text| text.starts_with("joint"));
        assert_eq!(titles.count(), joints);
        let [width, height] = marks.size;
        let panel = match (columns, show) {
            (1, _) => 800.0,
            (_, "sphere") => 400.0,
            (2, _) => 560.0,
            _ => 400.0,
        };
        assert_eq!(width / panel, f64::from(columns), "{joints} of {show}");
        if joints > 8 {
            let shape = width / height;
            assert!((0.6..1.6).contains(&shape), "{joints} of {show}: {shape}");
        }
    }
}

/// Would catch an axis whose labels are all 0.
#[test]
fn an_axis_of_zeros_has_labels_that_differ() {
    let folder = tempfile::tempdir().unwrap();
    skeleton(folder.path(), 1, &[1]);
    for (arguments, labels) in [
        ("--show speed", &["0", "0.2", "0.8"][..]),
        // Dimension 2 is x of a turn about z.
        ("--dimension 2", &["-0.6", "0", "0.6"]),
    ] {
        let arguments: Vec<&str> = arguments.split(' ').collect();
        let marks = plot(folder.path(), &arguments);
        for label in labels {
            assert!(marks.says(label), "{arguments:?}: {:?}", marks.texts);
        }
    }
}

#[test]
fn speed_error_and_sphere_are_drawn_for_each_box() {
    let folder = sample_folder();
    let both = |show| ["--show", show, "-m", "slerp,bessel-overhauser"];
    let marks = plot(folder.path(), &both("speed"));
    assert!(marks.says("angular speed, rad/s") && marks.says("box 2"));
    assert_eq!(marks.curves(SLERP).len(), 2);
    assert!(marks.says("key"), "the legend has the lines of the keys");
    // Slerp's speed: four plateaus, so five heights or fewer but more than one.
    let mut heights: Vec<i64> = marks.curves(SLERP)[0]
        .iter()
        .map(|p| (p.1 / FINER) as i64)
        .collect();
    heights.dedup();
    assert!((2..=5).contains(&heights.len()), "{heights:?}");

    let marks = plot(folder.path(), &both("error"));
    assert!(marks.says("error, rad") && marks.says("bound") && marks.says("1e-7"));
    assert!(marks.curves(SLERP).len() >= 2, "in pieces: keys are exact");

    let marks = plot(folder.path(), &both("sphere"));
    assert_eq!(marks.dots.len(), 1 + 2 * 5);
    assert!(!marks.curves(SLERP).is_empty() && !marks.curves(BESSEL_OVERHAUSER).is_empty());
}

#[test]
fn png_shows_the_same_picture() {
    let folder = sample_folder();
    succeed(
        folder.path(),
        &[
            "plot",
            "a.dat",
            "-m",
            "slerp",
            "--dimension",
            "4",
            "-o",
            "out.png",
        ],
    );
    let file = fs::File::open(folder.path().join("out.png")).unwrap();
    let mut reader = png::Decoder::new(std::io::BufReader::new(file))
        .read_info()
        .unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    let marks = plot(folder.path(), &["-m", "slerp", "--dimension", "4"]);
    // The middle of a key's dot has the key's colour. The picture has two pixels for each pixel of the SVG.
    for &(x, y) in &marks.dots {
        let (x, y) = ((x / FINER * 2.0) as usize, (y / FINER * 2.0) as usize);
        let at = (y * info.width as usize + x) * 3;
        assert_eq!(pixels[at..at + 3], [0x22, 0x26, 0x2b], "at {x}, {y}");
    }
    let curve = pixels
        .chunks(3)
        .filter(|pixel| *pixel == [0xd5, 0x5e, 0x00])
        .count();
    assert!(curve > 1000, "{curve} pixels of the curve");
}

#[test]
fn a_report_has_every_figure_and_a_page_that_shows_them() {
    let temporary = sample_folder();
    // The two files have the same name; their directories differ.
    fs::create_dir(temporary.path().join("b & c")).unwrap();
    fs::rename(
        temporary.path().join("b.dat"),
        temporary.path().join("b & c/a.dat"),
    )
    .unwrap();
    succeed(
        temporary.path(),
        &["plot", "--report", "a.dat", "b & c/a.dat", "-o", "report"],
    );
    let folder = temporary.path().join("report");
    let page = fs::read_to_string(folder.join("index.html")).unwrap();
    let shown: Vec<&str> = page
        .split("<img src=\"")
        .skip(1)
        .map(|rest| rest.split('"').next().unwrap())
        .collect();
    // For each input: two dimensions (the 16th does not exist for two boxes, so the last one is
    // drawn), each by three methods and by all of them, then speed, error and sphere.
    assert_eq!(shown.len(), 2 * (2 * 4 + 3));
    for address in &shown {
        let file = address.replace("%20", " ").replace("%26", "&");
        let marks = Marks::of(&folder.join(&file));
        assert!(!marks.lines.is_empty(), "{file}");
    }
    assert_eq!(fs::read_dir(&folder).unwrap().count(), shown.len() + 1);
    for name in [
        "a-slerp-dimension-2.svg",
        "a-all-dimension-8.svg",
        "b%20%26%20c-a-sphere.svg",
    ] {
        assert!(shown.contains(&name), "{name} in {shown:?}");
    }
    assert!(page.contains("<h2>b &amp; c/a.dat</h2>") && page.contains("<h2>a.dat</h2>"));
    assert!(page.contains("a key every 0.5000 s"));
    let marks = Marks::of(&folder.join("b & c-a-slerp-dimension-2.svg"));
    let has_title = marks
        .texts
        .iter()
        .any(|text| text.starts_with("b & c/a.dat: "));
    assert!(has_title, "{:?}", marks.texts);
    let again = run(
        temporary.path(),
        &["plot", "--report", "a.dat", "-o", "report"],
    );
    assert!(again.code == 2 && again.words.contains("index.html: exists; give --overwrite"));
}

#[test]
fn a_directory_gets_a_picture_for_each_box_or_dimension() {
    let folder = sample_folder();
    succeed(
        folder.path(),
        &["plot", "a.dat", "b.dat", "--show", "speed", "-o", "out"],
    );
    succeed(
        folder.path(),
        &[
            "plot",
            "a.dat",
            "--components",
            "0.x,1.z",
            "--format",
            "png",
            "-o",
            "out",
        ],
    );
    // Inputs with equal names in different directories.
    fs::create_dir(folder.path().join("take")).unwrap();
    fs::copy(
        folder.path().join("a.dat"),
        folder.path().join("take/a.dat"),
    )
    .unwrap();
    let line = "plot take/a.dat a.dat --show error --tracks 0 -o out";
    succeed(folder.path(), &line.split(' ').collect::<Vec<_>>());
    let mut names: Vec<String> = fs::read_dir(folder.path().join("out"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    let expected = [
        "a-dimension-2.png",
        "a-dimension-8.png",
        "a-error-box-1.svg",
        "a-speed-box-1.svg",
        "a-speed-box-2.svg",
        "b-speed-box-1.svg",
        "b-speed-box-2.svg",
        "take-a-error-box-1.svg",
    ];
    assert_eq!(names, expected);
}

#[test]
fn what_cannot_be_drawn_is_refused_and_nothing_is_written() {
    let folder = sample_folder();
    fs::write(folder.path().join("old.svg"), "old").unwrap();
    fs::write(
        folder.path().join("way.csv"),
        "t,x,y,z\n0,0,0,0\n1,1,0,0\n2,1,1,0\n",
    )
    .unwrap();
    for (arguments, message) in [
        (
            "plot a.dat -o x.svg --dimension 9",
            "there is no dimension 9: a.dat has 2 boxes, dimensions 1 to 8 (w x y z of box 1, then of box 2 …)",
        ),
        (
            "plot a.dat -o x.svg --dimension 0",
            "there is no dimension 0: a.dat has 2 boxes",
        ),
        (
            "plot a.dat -o x.svg --box 3",
            "there is no box 3: a.dat has 2 boxes",
        ),
        (
            "plot a.dat -o x.svg --components 2.x",
            "a.dat: --components: there is no track `2`; it has 2 tracks",
        ),
        (
            "plot a.dat -o x.svg --components 1.q",
            "expected a track and w, x, y or z, such as 0.x",
        ),
        (
            "plot a.dat -o x.jpg",
            "x.jpg: end the picture in .svg or .png, or give a directory",
        ),
        (
            "plot a.dat b.dat -o x.svg",
            "several inputs need a directory",
        ),
        (
            "plot a.dat -o x.svg --report",
            "a report has many pictures; give a directory",
        ),
        (
            "plot a.dat -o x.svg --show speed --dimension 2",
            "--components needs --show components",
        ),
        (
            "plot a.dat -o x.svg --dimension 2 --box 1",
            "cannot be used with",
        ),
        (
            "plot a.dat -o old.svg",
            "old.svg: exists; give --overwrite to replace it",
        ),
        ("plot a.dat -o x.svg -m slurp", "slerp"),
        (
            "plot a.dat -o x.svg --axis x",
            "--axis has no effect on this plot; add --show sphere",
        ),
        (
            "plot a.dat -o x.svg --path-frame frenet",
            "--path-frame has no effect on files of rotations; it is for files of paths",
        ),
        (
            "plot a.dat -o x.svg -m slerp --ends natural",
            "a.dat: --ends has no effect on slerp",
        ),
        (
            "plot way.csv -o x.svg --fps 50",
            "--fps has no effect on pictures of paths",
        ),
        (
            "plot way.csv -o x.svg -m slerp",
            "--method has no effect on files of paths",
        ),
    ] {
        let line: Vec<&str> = arguments.split(' ').collect();
        let run = run(folder.path(), &line);
        assert_eq!(run.code, 2, "{arguments}: {}", run.words);
        assert!(run.words.contains(message), "{arguments}: {}", run.words);
        assert!(!folder.path().join("x.svg").exists(), "{arguments}");
    }
    assert_eq!(fs::read(folder.path().join("old.svg")).unwrap(), b"old");
    let many = succeed(
        folder.path(),
        &["generate", "--boxes", "65", "-o", "many.dat"],
    );
    assert!(many.words.contains("65 boxes"));
    let run = run(folder.path(), &["plot", "many.dat", "-o", "x.svg"]);
    assert!(
        run.code == 2
            && run
                .words
                .contains("65 panels in one picture cannot be read")
    );
    // Tracks that are not drawn do not count.
    skeleton(folder.path(), 65, &[7]);
    let marks = plot(folder.path(), &["--show", "speed"]);
    assert!(marks.says("joint65") && !marks.says("joint7"));
}

/// A single key has no steps, no speed and no span of time.
#[test]
fn a_single_key_is_drawn_in_every_way() {
    let folder = sample_folder();
    fs::write(folder.path().join("one.dat"), "# 1 3\n0.5 1 0 0 0\n").unwrap();
    for show in ["components", "speed", "error", "sphere"] {
        let out = format!("{show}.svg");
        succeed(
            folder.path(),
            &["plot", "one.dat", "--show", show, "-o", &out],
        );
        let marks = Marks::of(&folder.path().join(out));
        let finite =
            |points: &[(f64, f64)]| points.iter().all(|p| p.0.is_finite() && p.1.is_finite());
        assert!(
            finite(&marks.dots) && marks.lines.iter().all(|line| finite(&line.1)),
            "{show}"
        );
    }
    succeed(
        folder.path(),
        &["plot", "--report", "one.dat", "-o", "report"],
    );
    let page = fs::read_to_string(folder.path().join("report/index.html")).unwrap();
    assert!(
        page.contains("<p>1 box, 1 key in all, from 0.5 to 0.5 s</p>"),
        "{page}"
    );
    for out in ["one.html", "one.gif", "one.apng"] {
        let command = if out.ends_with("html") {
            "view"
        } else {
            "render"
        };
        succeed(folder.path(), &[command, "one.dat", "-o", out]);
    }
}

/// A curve goes through its keys, whatever frames are between them, and is the one that the file states.
#[test]
fn curves_go_through_their_keys_as_the_file_states() {
    let folder = sample_folder();
    // Keys that no frame of 25 a second meets.
    let mut text = "# 1 9\n".to_owned();
    for i in 0..9 {
        let (sine, cosine) = (f64::from(i * i) * 0.05).sin_cos();
        text += &format!("{} {cosine} 0 0 {sine}\n", f64::from(i) * 0.017);
    }
    fs::write(folder.path().join("keys.dat"), text).unwrap();
    let drawn = |line: &str| {
        let line = format!("plot {line} -o k.svg --overwrite --dimension 4");
        succeed(folder.path(), &line.split(' ').collect::<Vec<_>>());
        Marks::of(&folder.path().join("k.svg"))
    };
    for (more, colour) in [("", BESSEL_OVERHAUSER), (" -m slerp --fps 25", SLERP)] {
        let marks = drawn(&format!("keys.dat{more}"));
        let curve = marks.curves(colour)[0];
        assert_eq!(marks.dots.len(), 10);
        for dot in &marks.dots[1..] {
            let off = |p: &(f64, f64)| (p.0 - dot.0).hypot(p.1 - dot.1);
            let off = curve.iter().map(off).fold(f64::INFINITY, f64::min);
            assert!(off < 0.5, "{more}: a key lies {off} off the curve");
        }
    }
    // glTF joins its keys by arcs: so does the plot.
    succeed(folder.path(), &["convert", "keys.dat", "-o", "keys.glb"]);
    let (authored, arcs) = (drawn("keys.glb"), drawn("keys.glb -m slerp"));
    assert!(authored.says("authored"), "{:?}", authored.texts);
    let (authored, arcs) = (authored.curves(AUTHORED)[0], arcs.curves(SLERP)[0]);
    assert!(authored == arcs, "the file's curve is not drawn");
    let smooth = drawn("keys.glb -m bessel-overhauser");
    assert!(
        authored != smooth.curves(BESSEL_OVERHAUSER)[0],
        "arcs are no smooth curve"
    );
}

/// Catches values, names, units or keys of other scalars, and a choice that is not followed.
#[test]
fn scalars_are_drawn_with_their_names_units_and_keys() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("robot.xml"), crate::robots::ROBOT).unwrap();
    fs::write(folder.join("take.csv"), crate::robots::take()).unwrap();
    let draw = |more: &str| {
        let line =
            format!("plot take.csv --robot robot.xml --show scalars -o out.svg --overwrite {more}");
        succeed(
            folder,
            &line
                .split(' ')
                .filter(|word| !word.is_empty())
                .collect::<Vec<_>>(),
        );
        Marks::of(&folder.join("out.svg"))
    };
    let all = draw("");
    for joint in [
        "left_shoulder",
        "left_elbow",
        "right_shoulder",
        "right_elbow",
    ] {
        assert!(all.says(joint), "{joint}");
    }
    assert_eq!(
        all.texts
            .iter()
            .filter(|text| *text == "angle, rad")
            .count(),
        4
    );
    assert_eq!(all.curves(AUTHORED).len(), 4);
    let elbows = draw("--scalars *_elbow");
    assert!(elbows.says("right_elbow") && !elbows.says("left_shoulder"));
    let one = draw("--scalars left_shoulder -m slerp,bessel-overhauser");
    assert_eq!(
        (one.curves(SLERP).len(), one.curves(BESSEL_OVERHAUSER).len()),
        (1, 1)
    );
    // The dots lie where the keys are: 31 and the legend's, at 0.3 sin(4 t).
    let keys: Vec<(f64, f64)> = one.dots[one.dots.len() - 31..].to_vec();
    let value = |frame: usize| 0.3 * (4.0 * frame as f64 / 30.0).sin();
    let (top, bottom) = (11, 30);
    let scale = (keys[top].1 - keys[bottom].1) / (value(top) - value(bottom));
    for (frame, key) in keys.iter().enumerate() {
        let y = keys[bottom].1 + scale * (value(frame) - value(bottom));
        assert!((key.1 - y).abs() < 1.5 * FINER, "{frame}: {} {y}", key.1);
    }
    for (line, says) in [
        (
            "--show scalars --scalars knee",
            "--scalars: there is no `knee`; it has 4 scalars",
        ),
        ("--show scalars --tracks root", "--tracks"),
        ("--scalars left_elbow", "add --show scalars"),
    ] {
        let line = format!("plot take.csv --robot robot.xml -o out.svg --overwrite {line}");
        let refused = run(folder, &line.split(' ').collect::<Vec<_>>());
        assert_eq!(refused.code, 2, "{line}: {}", refused.words);
        assert!(refused.words.contains(says), "{line}: {}", refused.words);
    }
}

/// A file of several animations has a chapter for each.
#[test]
fn a_report_has_all_animations() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = temporary.path();
    let animation = |name: &str| {
        format!(
            r#"{{"name":"{name}","channels":[{{"sampler":0,"target":{{"node":0,"path":"rotation"}}}}],"samplers":[{{"input":0,"output":1}}]}}"#
        )
    };
    let text = format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"name":"arm"}}],
"buffers":[{{"uri":"data:application/octet-stream;base64,AAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAAAAAAAAAAAAIA/AAAAAA==","byteLength":40}}],
"bufferViews":[{{"buffer":0,"byteLength":40}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":2,"type":"SCALAR","min":[0],"max":[1]}},
{{"bufferView":0,"byteOffset":8,"componentType":5126,"count":2,"type":"VEC4"}}],
"animations":[{},{}]}}"#,
        animation("Walk"),
        animation("Run")
    );
    fs::write(folder.join("hero.gltf"), text).unwrap();
    fs::write(folder.join("joint.csv"), "t,arm.scalar_angle\n0,0\n1,1\n").unwrap();
    // A clip without tracks is refused, and the report has the others.
    let made = run(
        folder,
        &[
            "plot",
            "--report",
            "joint.csv",
            "hero.gltf",
            "-m",
            "slerp",
            "-o",
            "report",
        ],
    );
    assert_eq!(made.code, 3, "{}", made.words);
    let refusal = "joint.csv: has no tracks of rotations, only 1 scalar";
    assert!(made.words.contains(refusal), "{}", made.words);
    let page = fs::read_to_string(folder.join("report/index.html")).unwrap();
    for name in ["Walk", "Run"] {
        assert!(
            page.contains(&format!("<h2>hero.gltf: {name}</h2>")),
            "{page}"
        );
        let marks = Marks::of(&folder.join(format!("report/hero.{name}-slerp-dimension-2.svg")));
        assert!(marks.says("x of arm"), "{:?}", marks.texts);
    }
}
