//! `--tracks` and `--scalars`: some tracks or scalars only.

use std::borrow::Cow;
use std::str::FromStr;

use clap::Args;
use tumble_formats::motion::Motion;

use crate::arguments::wildcard::{Wildcard, is_pattern};
use crate::messages::exit::Failure;
use crate::messages::words;

/// The tracks that `--tracks` selects in each clip.
#[derive(Debug, Clone, Default, Args)]
pub(crate) struct TrackArguments {
    /// Only these tracks: names, patterns ('*Hand*'), indices from 0, and ranges of indices (3..7, both
    /// ends included); the parents of joints are kept as well
    #[arg(long = "tracks", value_name = "LIST", value_delimiter = ',', help_heading = READING)]
    tracks: Vec<Selector>,
}

const READING: &str = "Reading motion files";

/// One entry of the list. A track of that very name wins over an index, a range or a pattern.
#[derive(Debug, Clone)]
struct Selector {
    text: String,
    meaning: SelectorKind,
}

#[derive(Debug, Clone)]
enum SelectorKind {
    Name,
    Range(usize, usize),
    Pattern(Wildcard),
}

impl FromStr for Selector {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (first, last) = text.split_once("..").unwrap_or((text, text));
        let meaning = match (first.parse(), last.parse()) {
            (Ok(first), Ok(last)) if first <= last => SelectorKind::Range(first, last),
            (Ok(first), Ok(last)) => {
                return Err(format!(
                    "the range ends at {last}, before it starts at {first}"
                ));
            }
            _ if text.is_empty() => {
                return Err("give a name, an index, a range or a pattern".to_owned());
            }
            _ if is_pattern(text) => SelectorKind::Pattern(Wildcard::new(text)?),
            _ => SelectorKind::Name,
        };
        Ok(Self {
            text: text.to_owned(),
            meaning,
        })
    }
}

impl Selector {
    /// The indices of the tracks that it selects.
    fn of(&self, names: &[String]) -> Vec<usize> {
        let all = || 0..names.len();
        let named: Vec<usize> = all().filter(|&track| names[track] == self.text).collect();
        if !named.is_empty() {
            return named;
        }
        match &self.meaning {
            SelectorKind::Name => Vec::new(),
            // A range must exist completely; a part of one is probably a mistake.
            SelectorKind::Range(_, last) if *last >= names.len() => Vec::new(),
            SelectorKind::Range(first, last) => (*first..=*last).collect(),
            SelectorKind::Pattern(pattern) => all()
                .filter(|&track| pattern.matches(&names[track]))
                .collect(),
        }
    }
}

/// A message names no more tracks than this.
const MAX_NAMED_TRACKS: usize = 12;

/// The indices that selectors select among names, in the order of the names. `option` and `noun` are those of the message
/// about a selector that selects none.
fn indices(
    selectors: &[Selector],
    names: &[String],
    (option, noun): (&str, &str),
    name: &str,
) -> Result<Vec<usize>, Failure> {
    let mut is_selected = vec![false; names.len()];
    for selector in selectors {
        let found = selector.of(names);
        if found.is_empty() {
            let text = &selector.text;
            let near = words::nearest(text, names.iter().map(String::as_str));
            let near = near
                .map(|near| format!("; did you mean `{near}`?"))
                .unwrap_or_default();
            let count = words::count(names.len(), noun);
            let mut list = names
                .iter()
                .take(MAX_NAMED_TRACKS)
                .cloned()
                .collect::<Vec<_>>()
                .join(", ");
            if names.len() > MAX_NAMED_TRACKS {
                list += " … (`tumble info --json` names all)";
            }
            let separator = if names.is_empty() { "" } else { ", " };
            return Err(Failure::usage(format!(
                "{name}: {option}: there is no `{text}`{near}; it has {count}{separator}{list}"
            )));
        }
        found
            .into_iter()
            .for_each(|index| is_selected[index] = true);
    }
    Ok((0..names.len())
        .filter(|&index| is_selected[index])
        .collect())
}

/// The scalars that `--scalars` selects.
#[derive(Debug, Clone, Default, Args)]
pub(crate) struct ScalarArguments {
    /// With --show scalars: only these scalars, by names, patterns ('*knee*'), indices from 0, and ranges of indices
    #[arg(long = "scalars", value_name = "LIST", value_delimiter = ',')]
    scalars: Vec<Selector>,
}

impl ScalarArguments {
    /// The selected scalars, in the order of the clip; `None` for all.
    pub(crate) fn of(&self, clip: &Motion, name: &str) -> Result<Option<Vec<usize>>, Failure> {
        if self.scalars.is_empty() {
            return Ok(None);
        }
        let all = (0..clip.set.scalar_count()).filter_map(|index| clip.set.scalar(index));
        let names: Vec<String> = all.map(|keys| keys.name.to_owned()).collect();
        indices(&self.scalars, &names, ("--scalars", "scalar"), name).map(Some)
    }
}

impl TrackArguments {
    /// Whether `--tracks` is set.
    pub(crate) fn is_set(&self) -> bool {
        !self.tracks.is_empty()
    }

    /// The selected tracks, in the order of the clip; `None` for all.
    pub(crate) fn of(&self, clip: &Motion, name: &str) -> Result<Option<Vec<usize>>, Failure> {
        if self.tracks.is_empty() {
            return Ok(None);
        }
        let set = &clip.set;
        let names: Vec<String> = (0..set.track_count())
            .map(|track| set.track_name(track))
            .collect();
        indices(&self.tracks, &names, ("--tracks", "track"), name).map(Some)
    }

    /// The clip with the selected tracks alone.
    pub(crate) fn select<'a>(
        &self,
        clip: &'a Motion,
        name: &str,
    ) -> Result<Cow<'a, Motion>, Failure> {
        Ok(match self.of(clip, name)? {
            Some(tracks) => Cow::Owned(selected(clip, &tracks, name)?),
            None => Cow::Borrowed(clip),
        })
    }

    /// The clip with the selected tracks and all their ancestors, which decide where they are.
    pub(crate) fn select_with_ancestors<'a>(
        &self,
        clip: &'a Motion,
        name: &str,
    ) -> Result<Cow<'a, Motion>, Failure> {
        let Some(tracks) = self.of(clip, name)? else {
            return Ok(Cow::Borrowed(clip));
        };
        let all = clip.with_ancestors(&tracks);
        if all.len() > tracks.len() {
            let more: Vec<String> = all
                .iter()
                .filter(|track| !tracks.contains(track))
                .map(|&track| clip.set.track_name(track))
                .collect();
            words::note(&format!(
                "{name}: also kept, as parents of the selected tracks: {}",
                more.join(", ")
            ));
        }
        Ok(Cow::Owned(selected(clip, &all, name)?))
    }

    /// The selected boxes of a chain and all before them, from which they hang; `None` for all.
    pub(crate) fn chain(&self, clip: &Motion, name: &str) -> Result<Option<Vec<usize>>, Failure> {
        let last = self
            .of(clip, name)?
            .and_then(|tracks| tracks.last().copied());
        Ok(last.map(|last| (0..=last).collect()))
    }
}

/// The clip of these tracks.
pub(crate) fn selected(clip: &Motion, tracks: &[usize], name: &str) -> Result<Motion, Failure> {
    let selected = clip.select(tracks);
    selected.map_err(|error| Failure::evaluating(name, &error.into()))
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;

    fn chosen(list: &str) -> Result<Option<Vec<usize>>, String> {
        let mut clip = Motion::default();
        for name in ["hips", "LeftArm", "LeftHand", "7", "RightArm", "RightHand"] {
            clip.set.push(name, &[0.0], &[Quat::IDENTITY]).unwrap();
        }
        let tracks = list
            .split(',')
            .map(str::parse)
            .collect::<Result<_, String>>()?;
        let tracks = TrackArguments { tracks };
        tracks.of(&clip, "walk").map_err(Failure::into_message)
    }

    #[test]
    fn names_places_ranges_and_patterns_choose_tracks() {
        for (list, tracks) in [
            ("RightArm,hips", vec![0, 4]),
            ("1..2,0", vec![0, 1, 2]),
            ("*Arm", vec![1, 4]),
            ("7", vec![3]),
            ("5,5,*Hand", vec![2, 5]),
            ("[LR]*", vec![1, 2, 4, 5]),
        ] {
            assert_eq!(chosen(list), Ok(Some(tracks)), "{list}");
        }
        for (list, says) in [
            ("hip", "there is no `hip`; did you mean `hips`?"),
            ("4..6", "there is no `4..6`"),
            ("*Foot", "it has 6 tracks, hips, LeftArm"),
            ("3..1", "before it starts at 3"),
            ("hips,", "give a name"),
            ("[", "range pattern"),
        ] {
            let refused = chosen(list).unwrap_err();
            assert!(refused.contains(says), "{list}: {refused}");
        }
    }
}
