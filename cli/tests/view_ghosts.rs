//! The page of `tumble view`, of several inputs: ghosts at the same moment, and how far they are apart.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::browser::Page;
use crate::program::{run, sample_folder, succeed};

/// A joint of a BVH file at `offset` from its parent, with its children.
fn joint(name: &str, offset: &str, children: &str) -> String {
    let children = match children {
        "" => "End Site\n{\nOFFSET 0.5 0 0\n}\n",
        children => children,
    };
    format!("JOINT {name}\n{{\nOFFSET {offset}\nCHANNELS 1 Zrotation\n{children}}}\n")
}

/// A hip with these joints, and frames at 4 a second: degrees about z for each joint behind the hip.
fn bvh(children: &str, frames: &[&[f64]]) -> String {
    let mut text = format!(
        "HIERARCHY\nROOT hip\n{{\nOFFSET 0 2 0\nCHANNELS 1 Zrotation\n{children}}}\nMOTION\n\
         Frames: {}\nFrame Time: 0.25\n",
        frames.len()
    );
    for frame in frames {
        let numbers: Vec<String> = frame.iter().map(ToString::to_string).collect();
        let _ = writeln!(text, "0 {}", numbers.join(" "));
    }
    text
}

/// `a.bvh`: an arm that turns by 10° a frame. `b.npz`: the same joints in another order, the arm 30° ahead and the leg
/// 5° at 0.5 s. `other.bvh`: joints of other names. `hung.bvh`: the hand hangs on the hip.
fn write_clips(folder: &Path) {
    let hand = joint("hand", "1 0 0", "");
    let arm = joint("arm", "0 1 0", &hand);
    let leg = joint("leg", "0 -1 0", "");
    let angles: Vec<[f64; 3]> = (0..5)
        .map(|frame| [10.0 * f64::from(frame), 0.0, 0.0])
        .collect();
    let steady: Vec<&[f64]> = angles.iter().map(|frame| &frame[..]).collect();
    // leg, arm, hand
    let ahead: [&[f64]; 5] = [
        &[0.0, 0.0, 0.0],
        &[0.0, 25.0, 0.0],
        &[5.0, 50.0, 0.0],
        &[0.0, 30.0, 0.0],
        &[0.0, 40.0, 0.0],
    ];
    let write = |name: &str, text: String| fs::write(folder.join(name), text).unwrap();
    write("a.bvh", bvh(&[&*arm, &leg].concat(), &steady));
    write("b.bvh", bvh(&[&*leg, &arm].concat(), &ahead));
    let others = [
        joint("Arm", "0 1 0", ""),
        joint("tail", "0 -1 0", ""),
        joint("ear", "1 1 0", ""),
    ];
    write(
        "other.bvh",
        bvh(&others.concat(), &steady).replace("ROOT hip", "ROOT Hip"),
    );
    let hung = [joint("arm", "0 1 0", ""), hand, leg];
    write("hung.bvh", bvh(&hung.concat(), &steady));
    succeed(folder, &["convert", "b.bvh", "-o", "b.npz"]);
}

fn open(folder: &Path, line: &str) -> (String, Option<Page>) {
    let words = ["view", "-o", "view.html", "--overwrite"]
        .into_iter()
        .chain(line.split(' '));
    let run = succeed(folder, &words.collect::<Vec<_>>());
    (run.words, Page::open(&folder.join("view.html")))
}

/// The texts of a clip in the list, by its number from 1: its name, its distance from the solid one, and its note.
fn said(page: &mut Page, clip: usize) -> [String; 3] {
    [".clip-name", "output", ".note"].map(|part| {
        let text =
            format!("document.querySelector('#clips div:nth-child({clip}) {part}').textContent");
        page.value(&text).as_str().unwrap().to_owned()
    })
}

fn loaded(page: &mut Page) {
    page.value("tumble.loaded().then(() => true)");
}

#[test]
fn ghosts_are_drawn_at_the_same_moment_by_their_own_skeletons() {
    let folder = sample_folder();
    write_clips(folder.path());
    let (words, page) = open(folder.path(), "a.bvh b.npz");
    assert!(words.starts_with("2 inputs, "), "{words}");
    let Some(mut page) = page else { return };
    assert_eq!(page.value("tumble.ghosts().join()"), "b.npz");
    // Compares the hands of both files; in the second file the leg is first. One time is halfway between
    // two frames, one is at a frame.
    for (time, degrees) in [
        (0.0, [0.0, 0.0]),
        (0.375, [15.0, 37.5]),
        (0.5, [20.0, 50.0]),
    ] {
        page.value("document.querySelector('#between').checked || document.querySelector('#between').click()");
        page.value(&format!("tumble.seek({time})"));
        for (group, hand) in [(0, 2), (1, 3)] {
            let drawn = page.value(&format!("tumble.ends({hand}, {group})[0]"));
            let (sine, cosine) = f64::to_radians(degrees[group]).sin_cos();
            for (axis, expected) in [cosine, 3.0 + sine, 0.0].into_iter().enumerate() {
                let found = drawn[axis].as_f64().unwrap();
                assert!(
                    (found - expected).abs() < 1e-4,
                    "group {group}, {time} s: {drawn}"
                );
            }
        }
    }
    // 2 sin 15°.
    let [name, distances, note] = said(&mut page, 2);
    assert_eq!(
        [&*name, &distances, &note],
        ["b.npz", "furthest apart: arm 30.00°, hand 0.5176", ""]
    );
    assert_eq!(said(&mut page, 1), ["a.bvh", "", ""]);
    page.value("tumble.seek(0.75)");
    assert_eq!(said(&mut page, 2)[1], "furthest apart: 0.00°, 0.0000");
    page.value("tumble.seek(0.5)");

    // A checkbox for each input hides it.
    let counts = |page: &mut Page| page.value("JSON.stringify(tumble.inView())");
    assert_eq!(counts(&mut page), "[[3,1],[3,1]]");
    let (both, _) = page.pixels("#stage");
    page.click("#clips div:nth-child(2) input");
    loaded(&mut page);
    assert_eq!(counts(&mut page), "[[3,1]]");
    assert!(page.pixels("#stage").0 != both);
    assert_eq!(said(&mut page, 2)[1], "");
    page.click("#clips div:nth-child(1) input");
    loaded(&mut page);
    assert_eq!(counts(&mut page), "[[]]");
    page.press("h");
    loaded(&mut page);
    assert_eq!(counts(&mut page), "[[],[3,1]]");
    page.click("#clips div:nth-child(1) input");
    loaded(&mut page);
    assert!(page.pixels("#stage").0 == both);

    // Now the other input is the solid one, at the same time.
    page.choose("#box", "3");
    page.choose("#set", "1");
    loaded(&mut page);
    assert_eq!(page.value("tumble.state.input.name"), "b.npz");
    page.wait("tumble.state.time === 0.5");
    assert_eq!(
        page.value("document.querySelector('#box-name').textContent"),
        "hand"
    );
    assert_eq!(
        said(&mut page, 1)[1],
        "furthest apart: arm 30.00°, hand 0.5176"
    );
    assert_eq!(page.errors, Vec::<String>::new());
}

#[test]
fn clips_that_cannot_be_compared_are_drawn_and_named() {
    let folder = sample_folder();
    write_clips(folder.path());
    let (words, page) = open(folder.path(), "a.bvh hung.bvh other.bvh a.dat");
    let hung = "compared in the world, because `hand` has the parent `arm` in a.bvh, \
                but has the parent `hip` in hung.bvh";
    let other = "not compared: no joint has the same name in both \
                 (`hip` and `Hip` are similar, but only equal names match)";
    for line in [
        format!("a.bvh and hung.bvh: {hung}"),
        format!("a.bvh and other.bvh: {other}"),
    ] {
        assert!(words.lines().any(|found| found == line), "{line}: {words}");
    }
    let span = "a.bvh and a.dat: they have the times from 0 to 1 s in common; at others one is shown alone";
    assert!(words.lines().any(|found| found == span), "{words}");
    let Some(mut page) = page else { return };
    page.value("tumble.seek(0.5)");
    // Relative to their parents, the hands do not differ; the boxes of the chain are drawn next to the
    // bones.
    assert_eq!(
        said(&mut page, 2),
        ["hung.bvh", "furthest apart: hand 20.00°, hand 1.3434", hung]
    );
    assert_eq!(said(&mut page, 3), ["other.bvh", "", other]);
    assert_eq!(page.value("tumble.inView().length"), 4);
    let quaternion = page.value("tumble.shown(0, 3)");
    assert!(
        (quaternion[2].as_f64().unwrap() - 0.45f64.sin()).abs() < 1e-4,
        "{quaternion}"
    );
    assert_eq!(page.errors, Vec::<String>::new());
}

/// Bodies on paths that begin 2.03 s after each other on a clock that counts from 1970, 100 m apart.
#[test]
fn moments_are_those_of_the_files_clocks() {
    let folder = sample_folder();
    let at = folder.path();
    let path = |name: &str, first: f64, east: f64| {
        let mut text = String::new();
        for second in 0..5 {
            let time = first + f64::from(second);
            let x = 500_000.0 + east + time;
            let _ = writeln!(
                text,
                "{:.2} {x:.2} 4649776 0 0 0 0 1",
                1_700_000_000.0 + time
            );
        }
        fs::write(at.join(name), text).unwrap();
    };
    path("a.tum", 0.0, 0.0);
    path("b.tum", 2.03, 100.0);
    path("late.tum", 100.0, 0.0);
    let (words, page) = open(at, "a.tum b.tum");
    let span = "a.tum and b.tum: they have the times from 1700000002.03 to 1700000004 s in common";
    assert!(words.contains(span), "{words}");
    if let Some(mut page) = page {
        page.value("tumble.seek(3)");
        assert_eq!(
            said(&mut page, 2)[1],
            "furthest apart: 0.00°, body 100.0000"
        );
        page.value("tumble.seek(2)");
        assert_eq!(
            said(&mut page, 2)[1],
            "not at this moment; it has 2.030 to 6.030 s"
        );
        assert_eq!(page.value("JSON.stringify(tumble.inView()[1])"), "[]");
        page.value("tumble.seek(4)");
        page.choose("#set", "1");
        loaded(&mut page);
        page.wait("Math.abs(tumble.state.time - 2) < 0.0301");
    }
    // Pages with frames only show the nearest frame.
    let (_, page) = open(at, "a.tum b.tum --frames-only --fps 10");
    if let Some(mut page) = page {
        page.value("tumble.seek(3)");
        let nearest = "its nearest frame, 0.0300 s later, furthest apart: 0.00°, body 100.0300";
        assert_eq!(said(&mut page, 2)[1], nearest);
    }
    // Inputs without a common time are shown one at a time.
    let (words, page) = open(at, "a.tum late.tum");
    let apart = "the inputs have no common time: a.tum from 1700000000 to 1700000004 s, \
                 late.tum from 1700000100 to 1700000104 s; \
                 they are shown one at a time, chosen in the menu";
    assert!(words.lines().any(|found| found == apart), "{words}");
    if let Some(mut page) = page {
        assert_eq!(page.value("tumble.ghosts()"), Value::Array(Vec::new()));
        assert_eq!(
            page.value("document.querySelector('#clips').checkVisibility()"),
            false
        );
    }
}

#[test]
fn without_ghosts_inputs_are_in_the_menu_alone() {
    let folder = sample_folder();
    let (_, page) = open(folder.path(), "a.dat folder/a.dat --no-ghosts");
    if let Some(mut page) = page {
        assert_eq!(
            page.value("document.querySelector('#clips').checkVisibility()"),
            false
        );
        let titles =
            "[...document.querySelectorAll('#set option')].map((e) => e.textContent).join()";
        assert_eq!(page.value(titles), "a.dat,folder/a.dat");
    }
    write_clips(folder.path());
    fs::write(
        folder.path().join("late.dat"),
        "# 1 1\n90 1 0 0 0\n91 0 1 0 0\n",
    )
    .unwrap();
    for (inputs, on) in [
        ("a.bvh", "one input"),
        (
            "a.dat late.dat",
            "inputs without an animation and a time in common",
        ),
    ] {
        let line = format!("view {inputs} --no-ghosts -o refused.html");
        let run = run(folder.path(), &line.split(' ').collect::<Vec<_>>());
        assert_eq!(run.code, 2, "{}", run.words);
        let words = format!("--no-ghosts has no effect on {on}; leave it out");
        assert!(run.words.contains(&words), "{}", run.words);
        assert!(!folder.path().join("refused.html").exists());
    }
}
