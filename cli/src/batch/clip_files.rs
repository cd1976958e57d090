//! The files that an input's clips go into: one for all where its format holds several, else one for each.

use std::collections::{HashSet, VecDeque};
use std::ops::Range;
use std::path::Path;

use tumble_formats::motion::Motion;
use tumble_formats::{Feature, Loaded};

use crate::arguments::input::several_clips_failure;
use crate::batch::target::ResultTarget;
use crate::messages::exit::Failure;
use crate::messages::names;

/// A file to write: which of the input's clips go into it.
pub(super) struct ClipFile {
    /// What messages call these clips.
    pub(super) name: String,
    pub(super) clips: Range<usize>,
    pub(super) target: ResultTarget,
}

/// The files of an input whose result is `target`; a clip that can have none fails alone.
pub(super) fn clip_files(
    path: &Path,
    loaded: &Loaded,
    target: &ResultTarget,
) -> Result<VecDeque<Result<ClipFile, Failure>>, Failure> {
    let (name, clips) = (names::input(path), &loaded.clips);
    if target.format().supports(Feature::SeveralClips) || clips.len() == 1 {
        return Ok(VecDeque::from([Ok(ClipFile {
            name,
            clips: 0..clips.len(),
            target: target.clone(),
        })]));
    }
    if target.name().is_empty() {
        let hint = ", or give a directory for all of them: -o RESULTS/";
        return Err(several_clips_failure(path, loaded).hinted(hint));
    }
    let file_names = file_names(clips).into_iter();
    let files = clips.iter().zip(file_names).enumerate();
    Ok(files
        .map(|(index, (clip, file))| {
            Ok(ClipFile {
                name: format!("{name} {}", names::clip(clip)),
                clips: index..index + 1,
                target: target.of_clip(&file)?,
            })
        })
        .collect())
}

/// The names of the clips' files: the clips' names, with characters that file systems refuse replaced;
/// names that are then equal get the clip's index appended.
fn file_names(clips: &[Motion]) -> Vec<String> {
    let is_plain = |c: char| c.is_alphanumeric() || matches!(c, '-' | '_' | '.' | ' ');
    let plain = |clip: &Motion| -> String {
        let name = clip.name.clone().unwrap_or_else(|| clip.index.to_string());
        let each = name.chars().map(|c| if is_plain(c) { c } else { '_' });
        each.collect()
    };
    let mut used = HashSet::new();
    let names = clips.iter().map(|clip| {
        let whole = plain(clip);
        let mut name = short(&whole, "");
        let mut end = String::new();
        if name != whole {
            end = format!(".{}", clip.index);
            name = short(&whole, &end);
        }
        while !used.insert(name.to_lowercase()) {
            end = format!("{end}.{}", clip.index);
            name = short(&whole, &end);
        }
        name
    });
    names.collect()
}

/// The most bytes of a clip's name in a file name: the input's name and two extensions must fit too.
const MAX_CLIP_NAME: usize = 120;

/// The name, cut so that it fits with `end` into [`MAX_CLIP_NAME`] bytes, and `end`.
fn short(name: &str, end: &str) -> String {
    let max_length = MAX_CLIP_NAME.saturating_sub(end.len()).min(name.len());
    let cut = (0..=max_length).rfind(|&at| name.is_char_boundary(at));
    format!("{}{end}", &name[..cut.unwrap_or(0)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clips_never_share_a_file() {
        let names = [
            Some("Run"),
            Some("run"),
            Some("a/b"),
            Some("a:b"),
            None,
            Some("4"),
        ];
        let clips: Vec<Motion> = names
            .iter()
            .enumerate()
            .map(|(index, name)| Motion {
                name: name.map(str::to_owned),
                index,
                ..Motion::default()
            })
            .collect();
        assert_eq!(
            file_names(&clips),
            ["Run", "run.1", "a_b", "a_b.3", "4", "4.5"]
        );
    }

    #[test]
    fn long_names_are_cut_between_letters_and_stay_apart() {
        let long = "ä".repeat(200);
        let clip = |index| Motion {
            name: Some(long.clone()),
            index,
            ..Motion::default()
        };
        let names = file_names(&[clip(0), clip(1)]);
        assert_eq!(names[0], format!("{}.0", "ä".repeat(59)));
        assert_eq!(names[1], format!("{}.1", "ä".repeat(59)));
    }
}
