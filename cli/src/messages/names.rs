//! How messages, titles and files call inputs and their clips.

use std::path::Path;

use tumble_formats::Loaded;
use tumble_formats::motion::Motion;
use tumble_formats::printable::{printable, printable_path};

/// `-` is standard input.
pub(crate) fn is_standard(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// The name of an input in messages.
pub(crate) fn input(path: &Path) -> String {
    if is_standard(path) {
        "standard input".to_owned()
    } else {
        printable_path(path)
    }
}

/// `folder/walk.dat` is `walk.dat` in titles.
pub(crate) fn file(path: &Path) -> String {
    match path.file_name() {
        Some(component) if !is_standard(path) => printable_path(Path::new(component)),
        _ => input(path),
    }
}

/// `folder/walk.dat` is `walk` in the names of pictures.
pub(crate) fn stem(path: &Path) -> String {
    match path.file_stem() {
        Some(stem) if !is_standard(path) => stem.to_string_lossy().into_owned(),
        _ => "stdin".to_owned(),
    }
}

/// The name in messages of a clip of a file with several.
pub(crate) fn clip(clip: &Motion) -> String {
    match &clip.name {
        Some(name) => printable(name).into_owned(),
        None => clip.index.to_string(),
    }
}

/// The title of a clip: its file and its name, if it has one.
pub(crate) fn title(path: &Path, of_file: &Motion) -> String {
    match of_file.name {
        Some(_) => format!("{}: {}", file(path), clip(of_file)),
        None => file(path),
    }
}

/// The names in messages of all clips of a file.
pub(crate) fn clips(loaded: &Loaded) -> String {
    let names: Vec<String> = loaded.clips.iter().map(clip).collect();
    names.join(", ")
}
