//! How messages, titles and files call inputs and their clips.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

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

/// The name of an input in JSON and in manifests: as it is, so that a program can open it. Bytes that are not UTF-8,
/// for which JSON has no room, are escaped as in messages.
pub(crate) fn recorded(path: &Path) -> String {
    match path.to_str() {
        Some(name) if !is_standard(path) => name.to_owned(),
        _ => input(path),
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

/// Names for the pictures of some inputs, no two of them the same. A name is the stem of the input's file. If several
/// inputs share a stem, as many directories as are needed to distinguish them stand before it (`sh010-walk`). If these
/// do not suffice, the name has the file's ending, too.
pub(crate) fn distinct_stems(paths: &[PathBuf]) -> Vec<String> {
    let mut names: Vec<String> = paths.iter().map(|path| stem(path)).collect();
    for depth in 1.. {
        let shared = shared_names(&names);
        if shared.is_empty() {
            break;
        }
        let mut is_longer = false;
        for index in shared {
            let folders = paths[index].ancestors().skip(1);
            let mut folders = folders.filter_map(|folder| folder.file_name());
            if let Some(folder) = folders.nth(depth - 1) {
                names[index] = format!("{}-{}", folder.to_string_lossy(), names[index]);
                is_longer = true;
            }
        }
        if !is_longer {
            break;
        }
    }
    for index in shared_names(&names) {
        if let Some(ending) = paths[index].extension() {
            names[index] = format!("{}-{}", names[index], ending.to_string_lossy());
        }
    }
    // Different paths may give the same name: `a/b-c.dat` and `a-b/c.dat`.
    for index in shared_names(&names).into_iter().skip(1) {
        names[index] = format!("{}-{}", names[index], index + 1);
    }
    names
}

/// The indices of names that are there more than once.
fn shared_names(names: &[String]) -> Vec<usize> {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for name in names {
        *counts.entry(name).or_default() += 1;
    }
    let all = 0..names.len();
    all.filter(|&index| counts[&*names[index]] > 1).collect()
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
    clip_title(&file(path), of_file)
}

/// The title of a clip of a file that is called so.
pub(crate) fn clip_title(file: &str, of_file: &Motion) -> String {
    match of_file.name {
        Some(_) => format!("{file}: {}", clip(of_file)),
        None => file.to_owned(),
    }
}

/// The names of some inputs in titles: those of the files; where several inputs have files of one name, with their
/// directories.
pub(crate) fn distinct_files(paths: &[PathBuf]) -> Vec<String> {
    let mut names: Vec<String> = paths.iter().map(|path| file(path)).collect();
    for index in shared_names(&names) {
        names[index] = input(&paths[index]);
    }
    names
}

/// The names in messages of all clips of a file.
pub(crate) fn clips(loaded: &Loaded) -> String {
    let names: Vec<String> = loaded.clips.iter().map(clip).collect();
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_of_inputs_with_equal_names_are_told_apart() {
        let names = |paths: &[&str]| {
            let paths: Vec<PathBuf> = paths.iter().map(PathBuf::from).collect();
            distinct_stems(&paths)
        };
        assert_eq!(names(&["a/walk.bvh", "a/run.bvh"]), ["walk", "run"]);
        assert_eq!(
            names(&["s/1/walk.bvh", "s/2/walk.bvh"]),
            ["1-walk", "2-walk"]
        );
        assert_eq!(
            names(&["x/s/walk.bvh", "y/s/walk.bvh"]),
            ["x-s-walk", "y-s-walk"]
        );
        assert_eq!(names(&["walk.bvh", "a/walk.bvh"]), ["walk", "a-walk"]);
        assert_eq!(names(&["walk.bvh", "walk.glb"]), ["walk-bvh", "walk-glb"]);
        let odd = names(&["a/b-c.dat", "a-b/c.dat", "c.dat", "b-c.dat", "-"]);
        let distinct: std::collections::BTreeSet<&String> = odd.iter().collect();
        assert_eq!(distinct.len(), odd.len(), "{odd:?}");
    }
}
