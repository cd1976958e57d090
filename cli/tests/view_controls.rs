//! The page of `tumble view`: the effect of every key, click and control.

use crate::program::sample_folder;
use crate::view::page;
use tumble::METHODS;

#[test]
fn every_key_does_what_it_says() {
    let folder = sample_folder();
    let Some(mut page) = page(folder.path(), &["a.dat"]) else {
        return;
    };
    // Keys at 0, 0.5, 1, 1.5 and 2 s; 60 frames a second.
    for (key, expected) in [
        ("s", "tumble.state.method === 'slerp' && legend === 'slerp'"),
        (
            "c",
            "tumble.state.method === 'catmull-rom' && legend === 'catmull-rom'",
        ),
        (
            "b",
            "tumble.state.method === 'bessel-overhauser' && legend === 'bessel-overhauser'",
        ),
        ("ArrowRight", "tumble.state.sample === 1"),
        ("ArrowRight", "tumble.state.sample === 2"),
        ("ArrowLeft", "tumble.state.sample === 1"),
        ("]", "tumble.state.time === 0.5"),
        ("]", "tumble.state.time === 1"),
        ("[", "tumble.state.time === 0.5"),
        ("End", "tumble.state.time === 2"),
        (
            "Home",
            "tumble.state.time === 0 && document.querySelector('#time').value === '0'",
        ),
        (
            " ",
            "tumble.state.playing && document.querySelector('#play').textContent === 'Pause'",
        ),
        (
            " ",
            "!tumble.state.playing && document.querySelector('#play').textContent === 'Play'",
        ),
        (
            "g",
            "tumble.state.other === 'slerp' && legend === 'bessel-overhauser|ghost: slerp'",
        ),
        (
            "g",
            "tumble.state.pairing === 'side' && legend === 'left: bessel-overhauser|right: slerp'",
        ),
        (
            "g",
            "tumble.state.other === '' && legend === 'bessel-overhauser'",
        ),
        (
            "a",
            "tumble.state.apart && document.querySelector('#arrangement').value === 'apart'",
        ),
        ("a", "!tumble.state.apart"),
        (
            "n",
            "tumble.state.box === 1 && document.querySelector('#box').value === '2'",
        ),
        ("n", "tumble.state.box === 1"),
        ("p", "tumble.state.box === 0"),
        (
            "+",
            "tumble.state.speed === 2 && document.querySelector('#speed').value === '2'",
        ),
        ("-", "tumble.state.speed === 1"),
        ("-", "tumble.state.speed === 0.5"),
        ("=", "tumble.state.speed === 1"),
        (
            "l",
            "!tumble.state.loop && !document.querySelector('#loop').checked",
        ),
        ("l", "tumble.state.loop"),
        ("t", "document.documentElement.dataset.theme === 'dark'"),
        ("t", "document.documentElement.dataset.theme === 'light'"),
        (
            "?",
            "document.querySelector('#help').open && document.querySelectorAll('#keys dt').length > 10",
        ),
        ("Escape", "!document.querySelector('#help').open"),
        ("m", "document.activeElement.id === 'method'"),
    ] {
        page.press(key);
        let legend =
            "[...document.querySelectorAll('#legend span')].map((e) => e.textContent).join('|')";
        let expected = expected.replace("legend", legend);
        page.value("tumble.loaded().then(() => true)");
        page.wait(&expected);
    }
    assert_eq!(page.errors, Vec::<String>::new());
}

#[test]
fn the_view_turns_and_fits_again() {
    let folder = sample_folder();
    let Some(mut page) = page(folder.path(), &["a.dat"]) else {
        return;
    };
    let (before, _) = page.pixels("#stage");
    let mut seen = vec![before.clone()];
    page.value("document.querySelector('#stage').focus()");
    for key in ["ArrowRight", "ArrowUp", "PageUp"] {
        page.press(key);
        seen.push(page.pixels("#stage").0);
    }
    page.drag("#stage", (120.0, 30.0));
    seen.push(page.pixels("#stage").0);
    for (i, pair) in seen.windows(2).enumerate() {
        assert!(pair[0] != pair[1], "view {i} is that before it");
    }
    page.press("r");
    assert!(
        page.pixels("#stage").0 == before,
        "r brings the first view back"
    );
    assert_eq!(
        page.value("tumble.state.sample"),
        0,
        "arrows turned the view, not time"
    );
}

#[test]
fn every_control_does_what_it_says() {
    let folder = sample_folder();
    let Some(mut page) = page(folder.path(), &["a.dat", "b.dat"]) else {
        return;
    };
    for (selector, expected) in [
        ("#key-after", "tumble.state.time === 0.5"),
        ("#key-after", "tumble.state.time === 1"),
        ("#key-before", "tumble.state.time === 0.5"),
        ("#to-start", "tumble.state.time === 0"),
        ("#play", "tumble.state.playing"),
        ("#play", "!tumble.state.playing"),
        ("#loop", "!tumble.state.loop"),
        (
            "#theme",
            "document.documentElement.dataset.theme === 'dark'",
        ),
        ("#help-open", "document.querySelector('#help').open"),
        ("#help button", "!document.querySelector('#help').open"),
        (
            "#components .u-over",
            "Math.abs(tumble.state.time - 1) < 0.02",
        ),
    ] {
        page.click(selector);
        page.wait(expected);
    }
    for (selector, value, expected) in [
        ("#time", "30", "tumble.state.time === 0.5"),
        ("#speed", "0.25", "tumble.state.speed === 0.25"),
        ("#other", "slerp", "tumble.state.other === 'slerp'"),
        ("#pairing", "side", "tumble.state.pairing === 'side'"),
        ("#arrangement", "apart", "tumble.state.apart"),
        ("#box", "2", "tumble.state.box === 1"),
        ("#box", "99", "tumble.state.box === 1"),
        (
            "#set",
            "1",
            "tumble.state.input.name === 'b.dat' && document.title.startsWith('b.dat')",
        ),
    ] {
        page.choose(selector, value);
        page.value("tumble.loaded().then(() => true)");
        page.wait(expected);
    }
    for method in METHODS {
        page.choose("#method", method.name);
        page.value("tumble.loaded().then(() => true)");
        let shown = page.value("document.querySelector('#legend').textContent");
        assert!(
            shown.as_str().unwrap().contains(method.name),
            "{method}: {shown}"
        );
    }
    assert_eq!(page.errors, Vec::<String>::new());
}

#[test]
fn a_click_on_a_box_shows_its_curves() {
    let folder = sample_folder();
    let Some(mut page) = page(folder.path(), &["a.dat"]) else {
        return;
    };
    let area = page.value("(() => { const r = document.querySelector('#stage').getBoundingClientRect(); return [r.x, r.y] })()");
    let (pixels, width) = page.pixels("#stage");
    // Orange is the second box; a pixel inside it has orange ones all round.
    let orange = |pixel: &[u8; 3]| pixel[0] > 90 && pixel[1] > pixel[0] / 2 && pixel[2] < 30;
    let inside = (4 * width + 4..pixels.len() - 4 * width - 4).find(|&at| {
        let round = [at, at - 4, at + 4, at - 4 * width, at + 4 * width];
        round.iter().all(|&neighbour| orange(&pixels[neighbour]))
    });
    let at = inside.expect("the second box is seen");
    let (x, y) = ((at % width) as f64, (at / width) as f64);
    page.click_at(area[0].as_f64().unwrap() + x, area[1].as_f64().unwrap() + y);
    page.wait("tumble.state.box === 1 && document.querySelector('#box').value === '2'");
}

/// Without looping, the animation stops at its end; with looping, it begins again.
#[test]
fn it_loops_or_stops_at_the_end() {
    let folder = sample_folder();
    let Some(mut page) = page(folder.path(), &["a.dat"]) else {
        return;
    };
    page.value("tumble.seek(1.9)");
    page.press(" ");
    page.wait("tumble.state.playing && tumble.state.time < 1");
    page.press(" ");
    page.press("l");
    page.value("tumble.seek(1.9)");
    page.press(" ");
    page.wait("!tumble.state.playing && tumble.state.time === 2");
    page.press(" ");
    page.wait("tumble.state.playing && tumble.state.time < 1");
}
