//! Names of joints that are unique and that all programs can read.

use std::collections::{HashMap, HashSet};

use tumble::TrackSet;

/// The name of the only track of a trajectory.
pub(crate) const TRAJECTORY_TRACK: &str = "body";

/// The name of joint `index` (from 0) for a file in which a name is followed by a brace on the same line and must be
/// unique. Braces and control characters become `_`, a joint without a name is `joint7`, and a name in `used` gets
/// the joint's number after it: `hand#12`. The new name is added to `used`.
pub(crate) fn line_name(name: &str, index: usize, used: &mut HashSet<String>) -> String {
    let is_odd = |c: char| c.is_control() && c != '\t' || c == '{' || c == '}';
    let mut usable = name.trim().replace(is_odd, "_");
    if usable.is_empty() {
        usable = format!("joint{index}");
    }
    unique_name(usable, index, used)
}

/// The name; if it is in `used`, the number and as many `_` as needed are appended.
pub(crate) fn unique_name(mut name: String, index: usize, used: &mut HashSet<String>) -> String {
    if used.contains(&name) {
        name = format!("{name}#{index}");
    }
    while used.contains(&name) {
        name.push('_');
    }
    used.insert(name.clone());
    name
}

/// The first two tracks that are siblings (have one parent) and have the same name, or that had one until a reader
/// appended a number to the second ([`unique_name`]). `parents` has the parent of each track; it is empty if there are
/// none.
pub(crate) fn same_named(names: &[String], parents: &[Option<usize>]) -> Option<[usize; 2]> {
    let known: HashSet<&str> = names.iter().map(String::as_str).collect();
    let stated = |mut name: &str| {
        while let Some((base, number)) = name.trim_end_matches('_').rsplit_once('#')
            && known.contains(base)
            && !number.is_empty()
            && number.bytes().all(|digit| digit.is_ascii_digit())
        {
            name = base;
        }
        name.to_owned()
    };
    let mut tracks: HashMap<(Option<usize>, String), usize> = HashMap::new();
    names.iter().enumerate().find_map(|(track, name)| {
        let parent = parents.get(track).copied().flatten();
        let first = tracks.insert((parent, stated(name)), track)?;
        Some([first, track])
    })
}

/// The unique names of a set's tracks: a repeated name gets the track's number after it.
pub(crate) fn distinct_names(set: &TrackSet) -> Vec<String> {
    let mut used = HashSet::new();
    let names =
        (0..set.track_count()).map(|track| unique_name(set.track_name(track), track, &mut used));
    names.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_were_one_are_found_unless_their_parents_differ() {
        let found = |names: &[&str], parents: &[Option<usize>]| {
            let names: Vec<String> = names.iter().copied().map(str::to_owned).collect();
            same_named(&names, parents)
        };
        let siblings = [None, Some(0), Some(0)];
        assert_eq!(found(&["hip", "leg", "leg#2"], &siblings), Some([1, 2]));
        assert_eq!(found(&["hip", "leg", "leg#2_"], &siblings), Some([1, 2]));
        assert_eq!(found(&["hip", "leg", "leg"], &[]), Some([1, 2]));
        assert_eq!(
            found(&["hip", "leg", "leg#2"], &[None, Some(0), Some(1)]),
            None
        );
        assert_eq!(found(&["hip", "leg", "arm#2"], &siblings), None);
        assert_eq!(found(&["hip", "leg", "leg#b"], &siblings), None);
        assert_eq!(found(&["leg", "leg#1", "leg#1#2"], &[]), Some([0, 1]));
    }

    #[test]
    fn names_become_lines_that_differ() {
        let input = [
            "hips", "left arm", "", " a{b}\n", "hips", "hips#4", "joint2", "hips",
        ];
        let mut used = HashSet::new();
        let names = input.iter().enumerate();
        let names: Vec<_> = names
            .map(|(index, name)| line_name(name, index, &mut used))
            .collect();
        let expected = [
            "hips", "left arm", "joint2", "a_b_", "hips#4", "hips#4#5", "joint2#6", "hips#7",
        ];
        assert_eq!(names, expected);
    }
}
