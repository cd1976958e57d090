//! Patterns of names and of files: `*` is any characters, `?` one, `[a-z]` one of these, `[!a-z]` one of the
//! others; between slashes `**` is any folders.
//!
//! A match takes at most the pattern's length times the name's: after a `*` nothing before it is tried
//! again. To try every split of a name at every star would take longer than a user waits for
//! `*a*a*a*a*a*a*b`.

use std::path::{Component, Path, PathBuf};

use walkdir::WalkDir;

/// A pattern of one name.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Wildcard {
    parts: Vec<PatternPart>,
}

#[derive(Debug, Clone, PartialEq)]
enum PatternPart {
    Character(char),
    Any,
    Many,
    /// Ranges of characters with both ends, and whether the other characters match instead.
    Class(Vec<(char, char)>, bool),
}

/// Whether a text has anything that makes it a pattern.
pub(crate) fn is_pattern(text: &str) -> bool {
    text.contains(['*', '?', '['])
}

impl Wildcard {
    /// Reads a pattern.
    ///
    /// # Errors
    /// When a class of characters has no end; in words.
    pub(crate) fn new(text: &str) -> Result<Self, String> {
        let mut parts = Vec::new();
        let mut rest = text;
        while let Some(first) = rest.chars().next() {
            rest = &rest[first.len_utf8()..];
            match first {
                '*' if parts.last() == Some(&PatternPart::Many) => {}
                '*' => parts.push(PatternPart::Many),
                '?' => parts.push(PatternPart::Any),
                '[' => {
                    let (class, behind) = class(rest).ok_or_else(|| {
                        format!("the range pattern `[{rest}` in `{text}` has no end; write `[[]` for a bracket")
                    })?;
                    parts.push(class);
                    rest = behind;
                }
                other => parts.push(PatternPart::Character(other)),
            }
        }
        Ok(Self { parts })
    }

    /// Whether it matches the whole of a name.
    pub(crate) fn matches(&self, name: &str) -> bool {
        let name: Vec<char> = name.chars().collect();
        let (mut at, mut part) = (0, 0);
        // After the last star: the index of the next part, and the end of the text that the star matches.
        let mut star: Option<(usize, usize)> = None;
        while at < name.len() {
            match self.parts.get(part) {
                Some(PatternPart::Many) => {
                    part += 1;
                    star = Some((part, at));
                }
                Some(element) if element.is_one(name[at]) => {
                    part += 1;
                    at += 1;
                }
                _ => match &mut star {
                    // Let the star match one more character.
                    Some((behind, end)) => {
                        *end += 1;
                        (part, at) = (*behind, *end);
                    }
                    None => return false,
                },
            }
        }
        self.parts[part..]
            .iter()
            .all(|part| *part == PatternPart::Many)
    }
}

/// The class whose `[` is read, and the text after it. A `]` right behind the `[` is one of its characters.
fn class(text: &str) -> Option<(PatternPart, &str)> {
    let (is_other, text) = match text.strip_prefix('!') {
        Some(text) => (true, text),
        None => (false, text),
    };
    let first = text.chars().next()?.len_utf8();
    let end = first + text[first..].find(']')?;
    let characters: Vec<char> = text[..end].chars().collect();
    let mut ranges = Vec::new();
    let mut rest = &characters[..];
    while let Some((&first, behind)) = rest.split_first() {
        match *behind {
            ['-', last, ..] => {
                ranges.push((first, last));
                rest = &behind[2..];
            }
            _ => {
                ranges.push((first, first));
                rest = behind;
            }
        }
    }
    Some((PatternPart::Class(ranges, is_other), &text[end + 1..]))
}

impl PatternPart {
    fn is_one(&self, character: char) -> bool {
        match self {
            Self::Character(expected) => *expected == character,
            Self::Any => true,
            Self::Many => false,
            Self::Class(ranges, is_other) => {
                let is_in = |&(first, last): &(char, char)| (first..=last).contains(&character);
                ranges.iter().any(is_in) != *is_other
            }
        }
    }
}

/// A pattern of names in a path: of one name, or of several that follow each other.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PathPattern {
    /// The pattern as on the command line.
    text: String,
    names: Vec<PathPart>,
}

#[derive(Debug, Clone, PartialEq)]
enum PathPart {
    Name(Wildcard),
    /// Any number of folders, also none.
    Folders,
}

impl PathPattern {
    /// Reads a pattern.
    ///
    /// # Errors
    /// When it has no name, or as [`Wildcard::new`]; in words.
    pub(crate) fn new(text: &str) -> Result<Self, String> {
        let names = text.split('/').filter(|name| !matches!(*name, "" | "."));
        let names = names.map(|name| match name {
            "**" => Ok(PathPart::Folders),
            name => Wildcard::new(name).map(PathPart::Name),
        });
        let names: Vec<PathPart> = names.collect::<Result<_, String>>()?;
        match names.is_empty() {
            true => Err("expected a pattern of a name, such as '*_draft.bvh'".to_owned()),
            false => Ok(Self {
                text: text.to_owned(),
                names,
            }),
        }
    }

    /// Its text, as it was given.
    pub(crate) fn text(&self) -> &str {
        &self.text
    }

    /// Whether it matches names of the path that follow each other, anywhere in it: a file, or a folder that it is in.
    pub(crate) fn matches(&self, path: &Path) -> bool {
        let names = path.components().filter_map(|component| match component {
            Component::Normal(name) => Some(name.to_string_lossy()),
            _ => None,
        });
        let names: Vec<_> = names.collect();
        // For each part of the pattern, whether the names so far match the parts before it.
        let mut open = vec![false; self.names.len() + 1];
        for name in &names {
            open[0] = true;
            self.skip_folders(&mut open);
            let mut next = vec![false; open.len()];
            for (index, part) in self
                .names
                .iter()
                .enumerate()
                .filter(|(index, _)| open[*index])
            {
                match part {
                    PathPart::Name(wildcard) => next[index + 1] |= wildcard.matches(name),
                    PathPart::Folders => next[index] = true,
                }
            }
            self.skip_folders(&mut next);
            if next[self.names.len()] {
                return true;
            }
            open = next;
        }
        false
    }

    /// `**` may stand for no folder.
    fn skip_folders(&self, open: &mut [bool]) {
        for (index, part) in self.names.iter().enumerate() {
            open[index + 1] |= open[index] && matches!(part, PathPart::Folders);
        }
    }
}

/// The files and folders that a pattern of paths matches, sorted; none where a part of it is malformed.
/// Folders that cannot be read match nothing.
pub(crate) fn paths(pattern: &str) -> Vec<PathBuf> {
    let mut found = vec![PathBuf::new()];
    let components: Vec<Component<'_>> = Path::new(pattern).components().collect();
    for (index, component) in components.iter().enumerate() {
        let name = match component {
            Component::Normal(name) => name.to_str().unwrap_or_default(),
            Component::ParentDir => {
                found = found.into_iter().map(parent_of).collect();
                remove_repeated(&mut found);
                continue;
            }
            other => {
                found.iter_mut().for_each(|path| path.push(other));
                continue;
            }
        };
        if name == "**" {
            // `**` also matches the folders themselves; as the last part, it matches all files in them.
            let is_last = index + 1 == components.len();
            found = found.iter().flat_map(|path| tree(path, is_last)).collect();
            remove_repeated(&mut found);
            continue;
        }
        if !is_pattern(name) {
            found.iter_mut().for_each(|path| path.push(name));
            continue;
        }
        let Ok(wildcard) = Wildcard::new(name) else {
            return Vec::new();
        };
        found = found
            .iter()
            .flat_map(|path| children(path, &wildcard))
            .collect();
    }
    found.retain(|path| path.symlink_metadata().is_ok());
    remove_repeated(&mut found);
    found
}

/// The folder above a path. Above a link it is that of the folder that the link leads to.
fn parent_of(mut path: PathBuf) -> PathBuf {
    let is_name = matches!(path.components().next_back(), Some(Component::Normal(_)));
    let is_folder = path.symlink_metadata().is_ok_and(|found| found.is_dir());
    match is_name && is_folder {
        true => {
            path.pop();
        }
        false => path.push(".."),
    }
    path
}

/// Sorts paths and removes those that occur twice, so that patterns with `..` do not multiply them.
fn remove_repeated(paths: &mut Vec<PathBuf>) {
    paths.sort_unstable();
    paths.dedup();
}

fn folder(path: &Path) -> &Path {
    match path.as_os_str().is_empty() {
        true => Path::new("."),
        false => path,
    }
}

fn children(path: &Path, wildcard: &Wildcard) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder(path)).into_iter().flatten();
    let names = entries.flatten().map(|entry| entry.file_name());
    names
        .filter(|name| wildcard.matches(&name.to_string_lossy()))
        .map(|name| path.join(name))
        .collect()
}

fn tree(path: &Path, with_files: bool) -> Vec<PathBuf> {
    let walk = WalkDir::new(folder(path)).into_iter().flatten();
    let kept = walk.filter(|entry| with_files || entry.file_type().is_dir());
    kept.map(|entry| match path.as_os_str().is_empty() {
        true => entry
            .path()
            .strip_prefix(".")
            .unwrap_or(entry.path())
            .to_owned(),
        false => entry.into_path(),
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn patterns_match_as_those_of_shells() {
        for (pattern, name, is_match) in [
            ("*Arm", "LeftArm", true),
            ("*Arm", "LeftArmRoll", false),
            ("*", "", true),
            ("", "", true),
            ("", "a", false),
            ("a*b*c", "aXbYbZc", true),
            ("a*b*c", "aXcYb", false),
            ("?", "ä", true),
            ("??", "ä", false),
            ("[LR]*", "RightHand", true),
            ("[!LR]*", "RightHand", false),
            ("[a-c]x", "bx", true),
            ("[]]", "]", true),
            ("[[]*", "[0]", true),
            ("[a-]", "-", true),
            ("**", "anything", true),
        ] {
            let wildcard = Wildcard::new(pattern).unwrap();
            assert_eq!(wildcard.matches(name), is_match, "{pattern} {name}");
        }
        assert!(Wildcard::new("[ab").unwrap_err().contains("no end"));
        assert!(Wildcard::new("a[").is_err() && Wildcard::new("[!").is_err());
    }

    #[test]
    fn patterns_of_paths_match_names_that_follow_each_other() {
        for (pattern, path, is_match) in [
            ("*_draft.bvh", "walks/run_draft.bvh", true),
            ("*_draft.bvh", "walks/run.bvh", false),
            ("old", "walks/old/run.bvh", true),
            ("old", "walks/older/run.bvh", false),
            ("takes/old", "walks/takes/old/run.bvh", true),
            ("takes/old/", "takes/old", true),
            ("takes/old", "takes/new/old/run.bvh", false),
            ("takes/**/old", "takes/new/old/run.bvh", true),
            ("takes/**/old", "takes/old/run.bvh", true),
            ("**/run.*", "run.bvh", true),
            ("./run.bvh", "walks/run.bvh", true),
            ("[a-c]*/run.*", "../b/run.bvh", true),
        ] {
            let found = PathPattern::new(pattern).unwrap().matches(Path::new(path));
            assert_eq!(found, is_match, "{pattern} {path}");
        }
        assert!(PathPattern::new("").is_err() && PathPattern::new("./").is_err());
        assert!(PathPattern::new("a/[b").unwrap_err().contains("no end"));
    }

    /// Trying every split would take longer than the age of the universe.
    #[test]
    fn many_stars_take_no_time() {
        let wildcard = Wildcard::new(&format!("{}b", "*a".repeat(200))).unwrap();
        assert!(!wildcard.matches(&"a".repeat(20_000)));
        assert!(wildcard.matches(&format!("{}b", "a".repeat(20_000))));
    }

    #[test]
    fn patterns_find_files_in_folders() {
        let directory = tempfile::tempdir().unwrap();
        for name in ["a/1.dat", "a/2.bvh", "b/c/3.dat", "4.dat"] {
            let file = directory.path().join(name);
            fs::create_dir_all(file.parent().unwrap()).unwrap();
            fs::write(file, "").unwrap();
        }
        let found = |pattern: &str| -> Vec<String> {
            let pattern = directory.path().join(pattern);
            let found = paths(pattern.to_str().unwrap()).into_iter();
            let below = found.map(|path| path.strip_prefix(directory.path()).unwrap().to_owned());
            below
                .map(|path| path.to_str().unwrap().to_owned())
                .collect()
        };
        assert_eq!(found("*.dat"), ["4.dat"]);
        assert_eq!(found("*/*.dat"), ["a/1.dat"]);
        assert_eq!(found("**/*.dat"), ["4.dat", "a/1.dat", "b/c/3.dat"]);
        assert_eq!(found("a/[12].*"), ["a/1.dat", "a/2.bvh"]);
        assert_eq!(found("b/?/3.dat"), ["b/c/3.dat"]);
        // A path that returns to its folder by `..` names the same file, which is listed once.
        assert_eq!(found("*/../*.dat"), ["4.dat"]);
        assert_eq!(found("*/../a/1.dat"), ["a/1.dat"]);
        let round = "*/../".repeat(40);
        assert_eq!(found(&format!("{round}*.dat")), ["4.dat"]);
        assert_eq!(found("none/*"), [""; 0]);
        assert_eq!(found("*/none"), [""; 0]);
    }
}
