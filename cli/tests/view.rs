//! The page of `tumble view`, in a real browser: the drawings, and that the rotations shown are the
//! engine's.

mod limits;

use std::fs;
use std::path::{Path, PathBuf};

use crate::browser::Page;
use crate::program::{sample_folder, succeed};
use glam::Quat;
use sha1::{Digest, Sha1};
use tumble::METHODS;

fn root() -> PathBuf {
    crate::program::root()
}

fn sample_data(name: &str) -> String {
    root().join("data").join(name).display().to_string()
}

pub(crate) fn page(folder: &Path, line: &[&str]) -> Option<Page> {
    let line = [&["view", "-o", "view.html", "--overwrite"], line].concat();
    succeed(folder, &line);
    Page::open(&folder.join("view.html"))
}

/// Rotations `[track][sample]` by `tumble eval`.
pub(crate) fn evaluated(folder: &Path, line: &[&str]) -> (Vec<u64>, Vec<Quat>) {
    let line = [&["eval", "-o", "out.npy", "--overwrite"], line].concat();
    succeed(folder, &line);
    let bytes = fs::read(folder.join("out.npy")).unwrap();
    let file = npyz::NpyFile::new(&bytes[..]).unwrap();
    let shape = file.shape().to_vec();
    let numbers = file.into_vec::<f32>().unwrap();
    let quats = numbers.chunks(4).map(|q| Quat::from_slice(q)).collect();
    (shape, quats)
}

pub(crate) fn quat(value: &serde_json::Value) -> Quat {
    let component = |i: usize| value[i].as_f64().unwrap() as f32;
    Quat::from_xyzw(component(0), component(1), component(2), component(3))
}

/// How far two rotations are apart, component by component; the sign does not matter.
pub(crate) fn apart(a: Quat, b: Quat) -> f32 {
    let b = if a.dot(b) < 0.0 { -b } else { b };
    (a - b)
        .to_array()
        .into_iter()
        .map(f32::abs)
        .fold(0.0, f32::max)
}

/// A page older than its sources would be tested, and shipped, in vain.
#[test]
fn the_page_is_built_from_its_sources() {
    let web = root().join("web");
    let mut names: Vec<PathBuf> = fs::read_dir(web.join("src"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    names.sort();
    let others = ["build.mjs", "package-lock.json", "../npm/package/core.js"];
    names.extend(others.map(|name| web.join(name)));
    let mut hash = Sha1::new();
    for name in names {
        hash.update(fs::read(name).unwrap());
    }
    let hash: String = hash
        .finalize()
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    let page = fs::read_to_string(root().join("cli/src/commands/view/page.html")).unwrap();
    assert!(
        page.contains(&format!("sources {hash}")),
        "the page of the program is older than web/src: npm ci && npm run build in web/"
    );
    for licence in ["three 0.", "uplot 1.", "Permission is hereby granted"] {
        assert!(page.contains(licence), "no `{licence}` in the page");
    }
}

#[test]
fn it_loads_alone_and_draws_boxes_that_move() {
    let folder = sample_folder();
    let sample = sample_data("pendulum.dat");
    let Some(mut page) = page(folder.path(), &[&sample]) else {
        return;
    };
    let size = fs::metadata(folder.path().join("view.html")).unwrap().len();
    assert!(size < 2_000_000, "{size} bytes");
    let about = page.value("document.querySelector('#about').textContent");
    let device = succeed(folder.path(), &["eval", &sample, "-o", "d.npy"]).words;
    let device = device
        .split(" on ")
        .nth(1)
        .unwrap()
        .split(" in ")
        .next()
        .unwrap();
    assert!(
        about.as_str().unwrap().contains(device),
        "{about} names not {device}"
    );

    page.value("tumble.seek(0)");
    let (start, _) = page.pixels("#stage");
    page.value("tumble.seek(3.3)");
    let (later, width) = page.pixels("#stage");
    // Boxes are coloured; the background and the floor are grey.
    let colourful =
        |pixel: &&[u8; 3]| pixel.iter().max().unwrap() - pixel.iter().min().unwrap() > 60;
    for pixels in [&start, &later] {
        let boxes = pixels.iter().filter(colourful).count();
        assert!(
            boxes > pixels.len() / 200,
            "{boxes} pixels of boxes, width {width}"
        );
    }
    let different = start.iter().zip(&later).filter(|(a, b)| a != b).count();
    assert!(
        different > start.len() / 200,
        "{different} pixels differ between two times"
    );

    // The button starts the animation and stops it.
    page.click("#play");
    page.wait("tumble.state.playing && tumble.state.time > 3.5");
    page.click("#play");
    assert_eq!(page.value("tumble.state.playing"), false);

    let address = format!("file://{}", folder.path().join("view.html").display());
    assert!(
        page.requests.iter().all(|request| *request == address),
        "{:?}",
        page.requests
    );
    assert!(!page.requests.is_empty(), "requests are seen at all");
    assert_eq!(page.errors, Vec::<String>::new());
}

/// Keys at uneven times, between frames: the page shows a key itself there.
#[test]
fn the_rotations_shown_are_the_engine_s() {
    let folder = sample_folder();
    let sample = sample_data("pendulum-random.dat");
    let Some(mut page) = page(folder.path(), &[&sample, "--fps", "30"]) else {
        return;
    };
    let text = fs::read_to_string(&sample).unwrap();
    let key_times: Vec<&str> = text
        .lines()
        .skip(1)
        .filter_map(|line| line.split_whitespace().next())
        .collect();
    let times: Vec<String> = (0..40).map(|i| format!("{}", f64::from(i) / 2.0)).collect();
    let times: Vec<&str> = times
        .iter()
        .map(String::as_str)
        .chain(key_times.iter().copied())
        .collect();
    fs::write(folder.path().join("times.txt"), times.join("\n")).unwrap();
    let mut largest = 0.0f32;
    for method in METHODS {
        let line = [&sample, "-m", method.name, "--times", "times.txt"];
        let (shape, expected) = evaluated(folder.path(), &line);
        assert_eq!(shape[..2], [4, times.len() as u64]);
        page.choose("#method", method.name);
        page.value("tumble.loaded().then(() => true)");
        let list = times.join(",");
        // The rotations as drawn, read back from the matrices that three.js was given.
        let shown = page.value(&format!(
            "[{list}].map((time) => {{ tumble.seek(time); return [0, 1, 2, 3].map((box) => tumble.shown(box)) }})"
        ));
        for (sample, time) in times.iter().enumerate() {
            for track in 0..4 {
                let found = quat(&shown[sample][track]);
                let off = apart(found, expected[track * times.len() + sample]);
                assert!(off < 1e-4, "{method}, {time} s, box {track}: off by {off}");
                largest = largest.max(off);
            }
        }
    }
    println!("largest difference of a component: {largest:.1e}");
    assert!(largest > 0.0, "16 bits leave something");
}

#[test]
fn ghosts_and_pairs_are_drawn() {
    let folder = sample_folder();
    let Some(mut page) = page(folder.path(), &["a.dat"]) else {
        return;
    };
    page.value("tumble.seek(0.25)");
    let (alone, _) = page.pixels("#stage");
    page.choose("#other", "step");
    page.value("tumble.loaded().then(() => true)");
    let (ghost, _) = page.pixels("#stage");
    assert!(alone != ghost);
    // The ghost is drawn by another method than the solid body.
    let (shown, ghost_shown) = (
        page.value("tumble.shown(0)"),
        page.value("tumble.shown(0, 1)"),
    );
    assert!(
        apart(quat(&shown), quat(&ghost_shown)) > 0.1,
        "{shown} and {ghost_shown}"
    );
    page.choose("#pairing", "side");
    page.value("tumble.loaded().then(() => true)");
    let (side, width) = page.pixels("#stage");
    let colourful =
        |pixel: &[u8; 3]| pixel.iter().max().unwrap() - pixel.iter().min().unwrap() > 60;
    let halves = side.chunks(width).fold([0, 0], |[left, right], row| {
        let count = |half: &[[u8; 3]]| half.iter().filter(|pixel| colourful(pixel)).count();
        let (l, r) = row.split_at(width / 2);
        [left + count(l), right + count(r)]
    });
    assert!(
        halves.iter().all(|&pixels| pixels > 200),
        "left and right: {halves:?}"
    );
}

/// The cursors of the curves move with time, the dots are where the keys are.
#[test]
fn curves_follow_time_and_box() {
    let folder = sample_folder();
    let Some(mut page) = page(folder.path(), &["a.dat", "--fps", "50"]) else {
        return;
    };
    let now = "Number(/translateX\\(([\\d.]+)px/.exec(document.querySelector('#components .now').style.transform)[1]) \
               / document.querySelector('#components .u-over').clientWidth";
    for time in [0.5, 1.0, 1.5] {
        page.value(&format!("tumble.seek({time})"));
        let share = page.value(now).as_f64().unwrap();
        assert!((share - time / 2.0).abs() < 0.01, "at {time} s: {share}");
    }
    // z turns in box 1, x in box 2; a quarter turn's sine is the half angle's.
    page.value("tumble.seek(0.5)");
    let values = page.value("document.querySelector('#box-values').textContent");
    let expected = format!("z +{:.4}", (0.45f64).sin());
    assert!(
        values.as_str().unwrap().contains(&expected),
        "{values} has not {expected}"
    );
    page.press("n");
    let values = page.value("document.querySelector('#box-values').textContent");
    let expected = format!("x +{:.4}", (0.45f64).sin());
    assert!(
        values.as_str().unwrap().contains(&expected),
        "{values} has not {expected}"
    );
    assert_eq!(
        page.value("document.querySelectorAll('#plots canvas').length"),
        2
    );
    let labels = page.value(
        "[...document.querySelectorAll('#plots .u-label')].map((e) => e.textContent).join('|')",
    );
    for label in [
        "w",
        "x",
        "y",
        "z",
        "key w",
        "angular speed, bessel-overhauser, rad/s",
    ] {
        assert!(
            labels
                .as_str()
                .unwrap()
                .split('|')
                .any(|text| text == label),
            "{label} in {labels}"
        );
    }
}

#[test]
fn it_is_readable_on_a_phone_by_night_and_by_keyboard() {
    let folder = sample_folder();
    let Some(mut page) = page(folder.path(), &["a.dat"]) else {
        return;
    };
    let ground = "getComputedStyle(document.body).backgroundColor";
    page.scheme("light");
    let light = page.value(ground);
    page.scheme("dark");
    let dark = page.value(ground);
    assert_ne!(light, dark);
    let brightness = |(pixels, _): (Vec<[u8; 3]>, usize)| {
        pixels.iter().map(|pixel| u64::from(pixel[1])).sum::<u64>() / pixels.len() as u64
    };
    assert!(brightness(page.pixels("#stage")) < 80);
    page.scheme("light");
    assert!(brightness(page.pixels("#stage")) > 180);

    for width in [320, 390, 768] {
        page.size(width, 800);
        page.wait(&format!("document.documentElement.scrollWidth <= {width}"));
        page.wait(&format!(
            "document.querySelector('.uplot').clientWidth <= {width}"
        ));
        let cut = page.value(
            "[...document.querySelectorAll('button, select, input')].filter((e) => e.checkVisibility()) \
             .filter((e) => e.getBoundingClientRect().right > innerWidth).length",
        );
        assert_eq!(cut, 0, "controls beyond the edge at {width}");
    }

    let mut reached = Vec::new();
    for _ in 0..24 {
        page.press("Tab");
        reached.push(
            page.value("document.activeElement.id")
                .as_str()
                .unwrap_or_default()
                .to_owned(),
        );
    }
    for id in [
        "method",
        "other",
        "arrangement",
        "theme",
        "help-open",
        "stage",
        "to-start",
        "play",
        "time",
        "speed",
        "loop",
        "box",
    ] {
        assert!(
            reached.iter().any(|found| found == id),
            "Tab does not reach {id}: {reached:?}"
        );
    }
    let unnamed = page.value(
        "[...document.querySelectorAll('button, select, input')] \
         .filter((e) => !(e.ariaLabel || e.textContent.trim() || e.labels?.length)).length",
    );
    assert_eq!(unnamed, 0, "controls without a name");
}
