//! Limits of the page: many boxes, odd names, refused inputs, and the browser that opens it.

use std::fs;

use crate::program::{run, sample_folder, succeed};
use crate::view::{apart, evaluated, page, quat};

/// A thousand boxes are drawn correctly; the speed is printed, and not tested.
#[test]
fn a_thousand_boxes_are_shown() {
    let folder = sample_folder();
    let line = "generate --boxes 1000 --keys 12 --seconds 3 --random -o many.dat";
    succeed(folder.path(), &line.split(' ').collect::<Vec<_>>());
    let Some(mut page) = page(folder.path(), &["many.dat", "-m", "slerp"]) else {
        return;
    };
    fs::write(folder.path().join("times.txt"), "1.5").unwrap();
    let (_, expected) = evaluated(
        folder.path(),
        &["many.dat", "-m", "slerp", "--times", "times.txt"],
    );
    assert_eq!(
        page.value("tumble.state.apart"),
        true,
        "so long a chain is a tangle"
    );
    for arrangement in ["chain", "apart"] {
        page.choose("#arrangement", arrangement);
        page.value("tumble.loaded().then(() => true)");
        page.value("tumble.seek(1.5)");
        let shown = page.value("Array.from({length: 1000}, (_, box) => tumble.shown(box))");
        for (track, &expected) in expected.iter().enumerate() {
            let off = apart(quat(&shown[track]), expected);
            assert!(off < 1e-4, "box {track}, {arrangement}: off by {off}");
        }
        page.value("tumble.seek(0)");
        page.click("#play");
        let rate = page.value(
            "(async () => { const frames = tumble.frames(), start = performance.now(); \
             await new Promise((done) => setTimeout(done, 2000)); \
             return (tumble.frames() - frames) / (performance.now() - start) * 1000 })()",
        );
        page.click("#play");
        println!(
            "1000 boxes, {arrangement}: {:.1} frames per second",
            rate.as_f64().unwrap()
        );
        assert!(rate.as_f64().unwrap() > 0.0, "it moves");
    }
}

#[test]
fn names_cannot_break_the_page() {
    let folder = sample_folder();
    let name = "a</script><b>&$&.dat".replace('/', "");
    fs::copy(folder.path().join("a.dat"), folder.path().join(&name)).unwrap();
    let Some(mut page) = page(folder.path(), &[&name, "-m", "slerp"]) else {
        return;
    };
    assert_eq!(
        page.value("document.querySelector('#title').textContent"),
        name
    );
    assert_eq!(page.value("document.querySelectorAll('b').length"), 0);
}

#[test]
fn what_cannot_be_shown_is_refused() {
    let folder = sample_folder();
    fs::write(folder.path().join("old.html"), "old").unwrap();
    for (line, code, message) in [
        ("view a.dat", 2, "--output"),
        (
            "view a.dat -o old.html",
            2,
            "old.html: exists; give --overwrite to replace it",
        ),
        (
            "view a.dat -o - --open",
            2,
            "standard output cannot be opened in a browser",
        ),
        (
            "view a.dat -o x.html --fps 1e7",
            2,
            "are more than a page can hold; ask for fewer frames",
        ),
        (
            "view a.dat -o x.html --fps 500000 -m all",
            2,
            "more than the 256.0 MB that a page can hold",
        ),
        ("view bad.dat -o x.html", 4, "bad.dat:2"),
        ("view a.dat -o x.html -m slurp", 2, "slerp"),
    ] {
        let run = run(folder.path(), &line.split(' ').collect::<Vec<_>>());
        assert_eq!(run.code, code, "{line}: {}", run.words);
        assert!(run.words.contains(message), "{line}: {}", run.words);
        assert!(!folder.path().join("x.html").exists(), "{line}");
    }
    assert_eq!(fs::read(folder.path().join("old.html")).unwrap(), b"old");
    let piped = succeed(folder.path(), &["view", "a.dat", "-o", "-"]);
    assert!(piped.out.starts_with(b"<!doctype html>"));
}

/// A script in place of the browser, which records its arguments.
#[cfg(unix)]
#[test]
fn open_shows_the_page_to_the_browser() {
    use std::os::unix::fs::PermissionsExt;

    let folder = sample_folder();
    let browser = folder.path().join("xdg-open");
    fs::write(
        &browser,
        "#!/bin/sh\necho \"$1\" > opened.part && mv opened.part opened\n",
    )
    .unwrap();
    fs::set_permissions(&browser, fs::Permissions::from_mode(0o755)).unwrap();
    let path = format!("{}:/usr/bin:/bin", folder.path().display());
    let view = |line: &[&str]| {
        let mut command = crate::program::command(folder.path(), line);
        let run = crate::program::finish(command.env("PATH", &path).output().unwrap());
        assert_eq!(run.code, 0, "{}", run.words);
        let opened = folder.path().join("opened");
        for _ in 0..100 {
            if opened.exists() {
                break;
            }
            std::thread::sleep(std::time::Duration::from_millis(50));
        }
        let file = fs::read_to_string(&opened).unwrap().trim().to_owned();
        fs::remove_file(opened).unwrap();
        file
    };
    assert_eq!(view(&["view", "a.dat", "-o", "x.html", "--open"]), "x.html");
    let temporary = view(&["view", "a.dat", "--open"]);
    assert!(
        fs::read_to_string(&temporary)
            .unwrap()
            .starts_with("<!doctype html>")
    );
    fs::remove_file(temporary).unwrap();
}
