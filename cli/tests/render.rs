//! Pictures and films of boxes, decoded again.

use std::fs;
use std::io::BufReader;
use std::path::Path;

use crate::program::{run, sample_folder, succeed};

/// Red, green and blue, row by row.
#[derive(Clone, PartialEq)]
struct Image {
    width: usize,
    pixels: Vec<[u8; 3]>,
}

const BLUE: [u8; 3] = [0x00, 0x72, 0xb2];
const ORANGE: [u8; 3] = [0xe6, 0x9f, 0x00];
const GREEN: [u8; 3] = [0x00, 0x9e, 0x73];

impl Image {
    /// The extent of the pixels with the hue of a box: left, top, right, bottom.
    fn extent(&self, hue: [u8; 3]) -> Option<[usize; 4]> {
        // Light makes a hue brighter or darker; its channels keep their proportions.
        let like = |pixel: &[u8; 3]| {
            let sum = |colour: &[u8; 3]| colour.iter().map(|&c| f64::from(c)).sum::<f64>().max(1.0);
            let share = |colour: &[u8; 3], c: usize| f64::from(colour[c]) / sum(colour);
            (0..3).all(|c| (share(pixel, c) - share(&hue, c)).abs() < 0.04)
        };
        let matching = (0..self.pixels.len()).filter(|&i| like(&self.pixels[i]));
        matching.fold(None, |extent, i| {
            let (x, y) = (i % self.width, i / self.width);
            let [l, t, r, b] = extent.unwrap_or([x, y, x, y]);
            Some([l.min(x), t.min(y), r.max(x), b.max(y)])
        })
    }
}

fn png(path: &Path) -> Image {
    let [image] = &films(path).0[..] else {
        panic!("{}: one frame", path.display());
    };
    image.clone()
}

/// The frames of a PNG, animated or not, and the time that all are shown for.
fn films(path: &Path) -> (Vec<Image>, f64) {
    let file = BufReader::new(fs::File::open(path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    let count = reader
        .info()
        .animation_control()
        .map_or(1, |control| control.num_frames);
    let mut canvas = vec![[0; 3]; width * height];
    let (mut images, mut seconds) = (Vec::new(), 0.0);
    for _ in 0..count {
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        let (x, y) = match reader.info().frame_control() {
            Some(control) => {
                seconds += f64::from(control.delay_num) / f64::from(control.delay_den);
                (control.x_offset as usize, control.y_offset as usize)
            }
            None => (0, 0),
        };
        let pixels: Vec<[u8; 3]> = bytes[..info.buffer_size()]
            .chunks_exact(3)
            .map(|pixel| [pixel[0], pixel[1], pixel[2]])
            .collect();
        for (row, line) in pixels.chunks(info.width as usize).enumerate() {
            let start = (y + row) * width + x;
            canvas[start..start + line.len()].copy_from_slice(line);
        }
        images.push(Image {
            width,
            pixels: canvas.clone(),
        });
    }
    (images, seconds)
}

fn gif_film(path: &Path) -> (Vec<Image>, f64) {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut reader = options.read_info(fs::File::open(path).unwrap()).unwrap();
    let (width, height) = (reader.width() as usize, reader.height() as usize);
    let mut canvas = vec![[0; 3]; width * height];
    let (mut images, mut seconds) = (Vec::new(), 0.0);
    while let Some(frame) = reader.read_next_frame().unwrap() {
        seconds += f64::from(frame.delay) / 100.0;
        for (i, pixel) in frame.buffer.chunks_exact(4).enumerate() {
            let (x, y) = (i % frame.width as usize, i / frame.width as usize);
            if pixel[3] > 0 {
                let at = (frame.top as usize + y) * width + frame.left as usize + x;
                canvas[at] = [pixel[0], pixel[1], pixel[2]];
            }
        }
        images.push(Image {
            width,
            pixels: canvas.clone(),
        });
    }
    (images, seconds)
}

/// The three ways to write a film show the same: PNG files and APNG exactly, GIF as near
/// as its palette comes.
#[test]
fn frames_apng_and_gif_show_the_same_film() {
    let folder = sample_folder();
    for out in ["frames", "film.apng", "film.gif"] {
        let line = [
            "render", "a.dat", "--fps", "12", "--size", "200x150", "-o", out,
        ];
        let run = succeed(folder.path(), &line);
        assert!(
            run.words.contains("a.dat: 25 frames, 2 boxes, on "),
            "{}",
            run.words
        );
    }
    let frames: Vec<Image> = (0..25)
        .map(|frame| png(&folder.path().join(format!("frames/{frame:05}.png"))))
        .collect();
    assert_eq!(
        fs::read_dir(folder.path().join("frames")).unwrap().count(),
        25
    );
    let (apng, seconds) = films(&folder.path().join("film.apng"));
    assert!(apng == frames, "APNG differs");
    assert!((seconds - 25.0 / 12.0).abs() < 2e-3, "{seconds} s");
    let (gif, seconds) = gif_film(&folder.path().join("film.gif"));
    assert_eq!(gif.len(), 25);
    assert!((seconds - 25.0 / 12.0).abs() < 2e-2, "{seconds} s");
    for (number, (found, expected)) in gif.iter().zip(&frames).enumerate() {
        let is_different = |(a, b): &(&[u8; 3], &[u8; 3])| (0..3).any(|c| a[c].abs_diff(b[c]) > 24);
        let count = found
            .pixels
            .iter()
            .zip(&expected.pixels)
            .filter(is_different)
            .count();
        assert!(
            count < 90,
            "frame {number}: {count} pixels are another colour"
        );
    }
    for pair in frames.windows(2) {
        assert!(pair[0] != pair[1], "frames that follow each other differ");
    }
}

/// Would catch a wrong parent, a wrong axis, a box that hangs upwards, a mirrored picture.
#[test]
fn boxes_hang_where_their_rotations_say() {
    let folder = sample_folder();
    let half = std::f32::consts::FRAC_1_SQRT_2;
    // First both boxes point down; then the first is rotated by 90° about z and carries the second.
    let text = format!(
        "# 2 3\n0 1 0 0 0 1 0 0 0\n1 {half} 0 0 {half} 1 0 0 0\n2 {half} 0 0 {half} {half} 0 0 {half}\n"
    );
    fs::write(folder.path().join("hang.dat"), text).unwrap();
    let still = |start: &str| {
        let line =
            format!("render hang.dat -m slerp --view 0,0 --start {start} -o s.png --overwrite");
        succeed(folder.path(), &line.split(' ').collect::<Vec<_>>());
        let image = png(&folder.path().join("s.png"));
        (image.extent(BLUE).unwrap(), image.extent(ORANGE).unwrap())
    };
    let tall = |[l, t, r, b]: [usize; 4]| b - t > r - l;
    let (first, second) = still("0");
    assert!(tall(first) && tall(second));
    assert!(
        first[3] < second[1] + 12,
        "the second hangs below the first"
    );
    // A quarter turn to the left seen against z: a box that pointed down points to the right.
    let (first, second) = still("1");
    assert!(!tall(first) && !tall(second));
    assert!(
        first[2] < second[0] + 12,
        "the second is right of the first"
    );
    let (first, second) = still("2");
    assert!(!tall(first) && tall(second));
    assert!(
        second[1] < first[1],
        "the second points up from the first's end"
    );
}

#[test]
fn methods_stand_side_by_side_under_their_names() {
    let folder = sample_folder();
    let line = "render a.dat -m slerp,step --size 400x200 --start 0.25 -o s.png";
    succeed(folder.path(), &line.split(' ').collect::<Vec<_>>());
    let image = png(&folder.path().join("s.png"));
    let half = |right: bool| {
        let columns = if right { 200..400 } else { 0..200 };
        let rows = image
            .pixels
            .chunks(400)
            .flat_map(|row| row[columns.clone()].to_vec());
        Image {
            width: 200,
            pixels: rows.collect(),
        }
    };
    let (left, right) = (half(false), half(true));
    assert!(left.extent(BLUE).is_some() && right.extent(BLUE).is_some());
    assert!(left != right);
    // Names in ink, at the bottom of each half.
    for half in [&left, &right] {
        let foot = &half.pixels[200 * 180..];
        let ink = foot
            .iter()
            .filter(|pixel| pixel.iter().all(|&channel| channel < 128))
            .count();
        assert!(ink > 10, "{ink} pixels of letters");
    }
    let dark = "render a.dat --theme dark --size 64x64 --start 1 -o d.png";
    succeed(folder.path(), &dark.split(' ').collect::<Vec<_>>());
    assert_eq!(
        png(&folder.path().join("d.png")).pixels[0],
        [0x1d, 0x21, 0x27]
    );
}

#[test]
fn a_gif_of_more_frames_than_it_can_show_is_warned_of() {
    let folder = sample_folder();
    for (fps, out, warned) in [
        ("50", "a.gif", false),
        ("60", "b.gif", true),
        ("60", "b.apng", false),
    ] {
        let line = [
            "render", "a.dat", "--fps", fps, "--size", "32x32", "--end", "0.2", "-o", out,
        ];
        let run = succeed(folder.path(), &line);
        assert_eq!(
            run.words.contains("warning: GIF shows no frame"),
            warned,
            "{}",
            run.words
        );
    }
}

#[test]
fn what_cannot_be_rendered_is_refused_and_nothing_is_written() {
    let folder = sample_folder();
    fs::write(folder.path().join("old.gif"), "old").unwrap();
    fs::create_dir(folder.path().join("used")).unwrap();
    fs::write(folder.path().join("used/00003.png"), "old").unwrap();
    for (line, code, message) in [
        (
            "render a.dat -o x.mp4",
            2,
            "x.mp4: unknown ending; give .gif or .apng for a film, .png for a picture, or a directory",
        ),
        ("render a.dat b.dat -o x.gif", 2, "takes a single input"),
        (
            "render a.dat -o x.gif --size 0x100",
            2,
            "invalid size `0x100`: expected WIDTHxHEIGHT",
        ),
        ("render a.dat -o x.gif --size big", 2, "invalid size `big`"),
        (
            "render a.dat -o x.gif --view 10,95",
            2,
            "invalid view `10,95`: expected two angles in degrees",
        ),
        (
            "render a.dat -o x.gif -m all",
            2,
            "methods are too many for one picture, at most 4",
        ),
        (
            "render a.dat -o old.gif",
            2,
            "old.gif: exists; give --overwrite to replace it",
        ),
        (
            "render a.dat -o used",
            2,
            "00003.png: exists; give --overwrite to replace it",
        ),
        ("render bad.dat -o x.gif", 4, "bad.dat:2"),
        (
            "render a.dat -o x.gif --drawn-frames 3",
            2,
            "--drawn-frames has no effect on boxes and skeletons",
        ),
        (
            "render a.dat -o x.gif --twist free",
            2,
            "--twist has no effect on a file of rotations",
        ),
        (
            "render a.dat -o x.png --fps 50",
            2,
            "--fps has no effect on a single picture",
        ),
        (
            "render a.dat -o x.gif --tension 1",
            2,
            "a.dat: --tension is for kochanek-bartels",
        ),
        (
            "render a.dat -o nowhere/x.gif",
            7,
            "its directory nowhere does not exist",
        ),
    ] {
        let run = run(folder.path(), &line.split(' ').collect::<Vec<_>>());
        assert_eq!(run.code, code, "{line}: {}", run.words);
        assert!(run.words.contains(message), "{line}: {}", run.words);
        assert!(!folder.path().join("x.gif").exists(), "{line}");
    }
    assert_eq!(fs::read(folder.path().join("old.gif")).unwrap(), b"old");
    assert_eq!(fs::read_dir(folder.path().join("used")).unwrap().count(), 1);
}

/// Two legs, from hips that are 2 apart, each with its end: bones follow the parents and do not form a
/// chain.
#[test]
fn bones_are_where_joints_are() {
    let folder = sample_folder();
    let leg = |name: &str, x: f64| {
        format!(
            " JOINT {name}\n {{\n  OFFSET {x} 0 0\n  CHANNELS 3 Zrotation Xrotation Yrotation\n  End Site\n  \
             {{\n   OFFSET 0 -4 0\n  }}\n }}\n"
        )
    };
    let text = format!(
        "HIERARCHY\nROOT hips\n{{\n OFFSET 0 0 0\n CHANNELS 6 Xposition Yposition Zposition Zrotation \
         Xrotation Yrotation\n{}{}}}\nMOTION\nFrames: 2\nFrame Time: 1\n0 8 0 0 0 0 0 0 0 0 0 0\n\
         0 8 0 0 0 0 90 0 0 0 0 0\n",
        leg("left", -2.0),
        leg("right", 2.0)
    );
    fs::write(folder.path().join("legs.bvh"), text).unwrap();
    let still = |start: &str| {
        let line = format!(
            "render legs.bvh --view 0,0 --start {start} --size 400x400 -o s.png --overwrite"
        );
        let run = succeed(folder.path(), &line.split(' ').collect::<Vec<_>>());
        assert!(run.words.contains("3 joints"), "{}", run.words);
        png(&folder.path().join("s.png"))
    };
    // The first joint is the root's cube, the second orange and the third green.
    let standing = still("0");
    let [cube, left, right] = [BLUE, ORANGE, GREEN].map(|hue| standing.extent(hue).unwrap());
    let middle = |[l, _, r, _]: [usize; 4]| (l + r) / 2;
    let tall = |[l, t, r, b]: [usize; 4]| b - t > (r - l) / 2;
    assert!(
        left[0] < middle(cube) && right[2] > middle(cube),
        "{left:?} {right:?}"
    );
    assert!(tall(left) && tall(right), "{left:?} {right:?}");
    assert!(
        left[2] <= cube[2] && right[0] >= cube[0],
        "{left:?} {right:?}"
    );
    let height = |[_, t, _, b]: [usize; 4]| b - t;
    assert!(
        height(left).abs_diff(height(right)) < 4,
        "{left:?} {right:?}"
    );
    // The left leg, rotated by 90° about z, points to the right and does not hide the right foot.
    let kicking = still("1");
    let (left, right) = (
        kicking.extent(ORANGE).unwrap(),
        kicking.extent(GREEN).unwrap(),
    );
    assert!(right[3] > left[3] + 40, "{left:?} {right:?}");
}

/// The mesh of a glTF file follows its joints, and takes the place of bones.
#[test]
fn a_mesh_is_drawn_where_the_file_has_one() {
    let fox = crate::program::root().join("../shared/data/gltf/Fox.glb");
    if !fox.exists() {
        eprintln!("{} is not there: no mesh was drawn", fox.display());
        return;
    }
    let folder = sample_folder();
    let shown = |more: &[&str]| {
        let line = [
            "render",
            fox.to_str().unwrap(),
            "--animation",
            "Run",
            "--start",
            "0.3",
        ];
        let out = ["--size", "200x150", "-o", "fox.png", "--overwrite"];
        succeed(folder.path(), &[&line[..], &out, more].concat());
        png(&folder.path().join("fox.png"))
    };
    const SKIN: [u8; 3] = [0xc9, 0xb8, 0xa4];
    let covered = |image: &Image| image.extent(SKIN).map(|[l, t, r, b]| (r - l) * (b - t));
    let mesh = shown(&[]);
    assert!(covered(&mesh).unwrap() > 200 * 150 / 4);
    assert!(mesh.extent(GREEN).is_none(), "no bones");
    // In other units the file's mesh does not fit, so the bones are drawn.
    assert!(shown(&["--scale", "0.01"]).extent(GREEN).is_some());
}

/// A body without offsets is drawn as a typical one, and a message says so.
#[test]
fn a_body_without_places_is_a_typical_one() {
    let body = crate::program::root().join("../shared/data/npz/smplh_like.npz");
    if !body.exists() {
        eprintln!("{} is not there: no body was drawn", body.display());
        return;
    }
    let folder = sample_folder();
    let line = [
        "render",
        body.to_str().unwrap(),
        "--size",
        "200x150",
        "-o",
        "body.png",
    ];
    let said = succeed(folder.path(), &line).words;
    assert!(
        said.contains("so a typical body is drawn; give its model with --body-model"),
        "{said}"
    );
    assert!(said.contains("52 joints"), "{said}");
    let image = png(&folder.path().join("body.png"));
    for hue in [BLUE, ORANGE, GREEN] {
        assert!(image.extent(hue).is_some(), "{hue:?}");
    }
}
