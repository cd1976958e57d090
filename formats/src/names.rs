//! Names of joints that any program can read, and that are told apart.

use std::collections::HashSet;

use tumble::TrackSet;

/// The name of joint `index` (from 0) in a file whose names are all that is on a line before a brace,
/// and differ: braces and control characters become `_`, a joint without a name is `joint7`, and a name
/// that is taken gets the joint's number behind it, `hand#12`. `taken` collects what was given.
pub(crate) fn line_name(name: &str, index: usize, taken: &mut HashSet<String>) -> String {
    let is_odd = |c: char| c.is_control() && c != '\t' || c == '{' || c == '}';
    let mut usable = name.trim().replace(is_odd, "_");
    if usable.is_empty() {
        usable = format!("joint{index}");
    }
    untaken(usable, index, taken)
}

/// The name itself; one that is taken gets the number behind it, and as many `_` as it takes.
pub(crate) fn untaken(mut name: String, index: usize, taken: &mut HashSet<String>) -> String {
    if taken.contains(&name) {
        name = format!("{name}#{index}");
    }
    while taken.contains(&name) {
        name.push('_');
    }
    taken.insert(name.clone());
    name
}

/// The names of a set's tracks, told apart: a name that is taken gets the track's number behind it.
pub(crate) fn distinct_names(set: &TrackSet) -> Vec<String> {
    let mut taken = HashSet::new();
    let names =
        (0..set.track_count()).map(|track| untaken(set.track_name(track), track, &mut taken));
    names.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_lines_that_differ() {
        let given = [
            "hips", "left arm", "", " a{b}\n", "hips", "hips#4", "joint2", "hips",
        ];
        let mut taken = HashSet::new();
        let names = given.iter().enumerate();
        let names: Vec<_> = names
            .map(|(index, name)| line_name(name, index, &mut taken))
            .collect();
        let expected = [
            "hips", "left arm", "joint2", "a_b_", "hips#4", "hips#4#5", "joint2#6", "hips#7",
        ];
        assert_eq!(names, expected);
    }
}
