//! The page of `tumble view`, of a motion file: bones where `tumble eval` puts the joints.

use std::fs;

use crate::browser::Page;
use crate::program::{root, run, sample_folder, succeed};

const BVH: &str = "formats/tests/fixtures/bvh/good.bvh";

#[test]
fn bones_of_a_bvh_file_are_where_eval_puts_its_joints() {
    let temporary = sample_folder();
    let folder = temporary.path();
    fs::copy(root().join(BVH), folder.join("walk.bvh")).unwrap();
    let run = succeed(folder, &["view", "walk.bvh", "a.dat", "-o", "view.html"]);
    // All methods, and `authored`: BVH's frames are joined by slerp.
    assert!(
        run.words.contains(&format!(
            "2 inputs, authored and {} methods",
            tumble::METHODS.len()
        )),
        "{}",
        run.words
    );
    let Some(mut page) = Page::open(&folder.join("view.html")) else {
        return;
    };
    let texts = |selector: &str| {
        format!("[...document.querySelectorAll('{selector}')].map((e) => e.textContent).join('|')")
    };
    assert_eq!(page.value(&texts("#set option")), "walk.bvh|a.dat");
    assert_eq!(page.value(&texts("#set-label")), "Input");

    let times = page.value("Array.from(tumble.state.input.times)");
    let lines: Vec<String> = times
        .as_array()
        .unwrap()
        .iter()
        .map(ToString::to_string)
        .collect();
    fs::write(folder.join("times.txt"), lines.join("\n")).unwrap();
    for method in ["bessel-overhauser", "c2"] {
        page.choose("#method", method);
        page.value("tumble.loaded().then(() => true)");
        let line = "eval walk.bvh --quantity world --times times.txt -o world.npy --overwrite -m";
        let line: Vec<&str> = line.split(' ').chain([method]).collect();
        succeed(folder, &line);
        let bytes = fs::read(folder.join("world.npy")).unwrap();
        let file = npyz::NpyFile::new(&bytes[..]).unwrap();
        let &[samples, joints, 7] = file.shape() else {
            panic!("{:?}", file.shape());
        };
        assert_eq!(samples as usize, lines.len());
        let expected = file.into_vec::<f32>().unwrap();
        let drawn = page.value(&format!(
            "Array.from(tumble.state.input.times, (time) => {{ tumble.seek(time); \
             return Array.from({{length: {joints}}}, (_, joint) => tumble.ends(joint)[0]) }}).flat(2)"
        ));
        let drawn: Vec<f64> = drawn
            .as_array()
            .unwrap()
            .iter()
            .map(|x| x.as_f64().unwrap())
            .collect();
        let positions = expected.chunks_exact(7).map(|pose| &pose[..3]);
        assert_eq!(drawn.len(), positions.len() * 3);
        let size = page.value("tumble.state.input.stored.results[0].positions.size");
        let size = (0..3)
            .map(|axis| size[axis].as_f64().unwrap())
            .fold(0.0, f64::max);
        assert!(size > 0.1, "it moves: {size}");
        for (i, (found, &right)) in drawn.iter().zip(positions.flatten()).enumerate() {
            let off = (found - f64::from(right)).abs();
            assert!(
                off < size / 65535.0 + 1e-6,
                "{method}, {i}: {found}, {right}"
            );
        }
    }

    // The boxes of the other input are drawn as a chain, and have no names.
    page.choose("#set", "1");
    page.value("tumble.loaded().then(() => true)");
    let name = "document.querySelector('#box-name').textContent";
    assert_eq!(page.value(name), "");
    page.wait("document.querySelector('#arrangement').checkVisibility()");
    page.choose("#set", "0");
    page.value("tumble.loaded().then(() => true)");
    assert_eq!(page.value(name), "pelvis");
    assert_eq!(page.errors, Vec::<String>::new());
}

#[test]
fn a_long_motion_is_refused_in_its_words() {
    let folder = sample_folder();
    fs::copy(root().join(BVH), folder.path().join("walk.bvh")).unwrap();
    for (line, says) in [
        (
            "view walk.bvh -o x.html --twist free",
            "--twist has no effect on files of rotations",
        ),
        (
            "view walk.bvh -o x.html --body-length 2",
            "--body-length has no effect on boxes and skeletons",
        ),
    ] {
        let run = run(folder.path(), &line.split(' ').collect::<Vec<_>>());
        assert_eq!(run.code, 2, "{}", run.words);
        assert!(run.words.contains(says), "{}", run.words);
    }
    let line = "view walk.bvh -o x.html --fps 1e9";
    let run = run(folder.path(), &line.split(' ').collect::<Vec<_>>());
    assert_eq!(run.code, 2, "{}", run.words);
    let words = [
        "joints ×",
        "are more than a page can hold; ask for fewer frames",
    ];
    for words in words {
        assert!(run.words.contains(words), "{}", run.words);
    }
}
