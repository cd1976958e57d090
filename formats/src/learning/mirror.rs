//! Mirrored poses: left becomes right.

use std::collections::HashMap;

use glam::{DQuat, DVec3};

/// A point mirrored at the plane through the origin across an axis (0 for x, 1 for y, 2 for z). Velocities are mirrored
/// like points, angular velocities are not: like rotations.
#[must_use]
pub fn mirrored_point(point: DVec3, axis: usize) -> DVec3 {
    let mut mirrored = point;
    mirrored[axis] = -mirrored[axis];
    mirrored
}

/// A rotation in the world, mirrored at the same plane: its axis is mirrored and its angle changes its sign.
#[must_use]
pub fn mirrored_rotation(rotation: DQuat, axis: usize) -> DQuat {
    let mut vector = -rotation.xyz();
    vector[axis] = -vector[axis];
    DQuat::from_xyzw(vector.x, vector.y, vector.z, rotation.w)
}

/// The words for the sides in names, as they are written.
const SIDES: [[&str; 2]; 9] = [
    ["left", "right"],
    ["Left", "Right"],
    ["LEFT", "RIGHT"],
    ["_l", "_r"],
    ["_L", "_R"],
    [".L", ".R"],
    ["L_", "R_"],
    ["l_", "r_"],
    [" L ", " R "],
];

/// The partner of each name on the other side, by indices; a name without a partner is its own. Sides are words in
/// names: `left_hip`, `RightArm`, `foot_l`, `Arm.L`, `L_Foot`, `Bip01 L Thigh`, `kLeftElbow`, or an initial: `LThumb`.
/// Serial numbers at the ends of names may differ, as in `LeftHand_011` and `RightHand_08`, if no other names are equal
/// without them.
#[must_use]
pub fn mirror_pairs<T: AsRef<str>>(names: &[T]) -> Vec<usize> {
    let mut by_name = HashMap::new();
    // The names without serial numbers; `None` for those that several names have.
    let mut by_bare_name: HashMap<&str, Option<usize>> = HashMap::new();
    for (index, name) in names.iter().enumerate() {
        let name = name.as_ref();
        by_name.entry(name).or_insert(index);
        let only = by_bare_name.entry(without_serial(name));
        only.and_modify(|only| *only = None).or_insert(Some(index));
    }
    let partner = |name: &str| {
        let exact = renamed(name).find_map(|other| by_name.get(&*other).copied());
        let bare = without_serial(name);
        let is_only = by_bare_name.get(bare).is_some_and(Option::is_some);
        let mut others = renamed(bare).filter(|_| is_only);
        exact.or_else(|| others.find_map(|other| by_bare_name.get(&*other).copied().flatten()))
    };
    let names = names.iter().enumerate();
    let pairs = names.map(|(index, name)| partner(name.as_ref()).unwrap_or(index));
    pairs.collect()
}

/// The name with the other side, in each of the ways in which names have sides.
fn renamed(name: &str) -> impl Iterator<Item = String> {
    on_other_side(name).chain(by_initial(name))
}

/// A name without the number that some exporters write behind each: `LeftHand` of `LeftHand_011`.
fn without_serial(name: &str) -> &str {
    let bare = name.trim_end_matches(|c: char| c.is_ascii_digit());
    let bare = match bare.len() < name.len() {
        true => bare.strip_suffix(['_', '.', ' ']).unwrap_or(name),
        false => name,
    };
    if bare.is_empty() { name } else { bare }
}

/// The indices of names with a word for a side that have no partner among these pairs. Initials do not count: many words
/// begin with L or R.
#[must_use]
pub fn without_partner<T: AsRef<str>>(names: &[T], pairs: &[usize]) -> Vec<usize> {
    let is_alone = |&index: &usize| {
        let mut renamed = on_other_side(names[index].as_ref());
        pairs[index] == index && renamed.next().is_some()
    };
    (0..names.len()).filter(is_alone).collect()
}

/// The name with a word for a side exchanged, for each such word.
fn on_other_side(name: &str) -> impl Iterator<Item = String> {
    let sides = SIDES.iter();
    let both = sides.flat_map(|&[left, right]| [(left, right), (right, left)]);
    both.filter_map(move |(side, other)| swapped(name, side, other))
}

/// The name with the initial of the other side, before a capital.
fn by_initial(name: &str) -> Option<String> {
    let (other, rest) = match name.strip_prefix('L') {
        Some(rest) => ('R', rest),
        None => ('L', name.strip_prefix('R')?),
    };
    let is_initial = rest.starts_with(char::is_uppercase);
    is_initial.then(|| format!("{other}{rest}"))
}

/// The name with another side, if it has that word between other words.
fn swapped(name: &str, side: &str, other: &str) -> Option<String> {
    let found = name.match_indices(side).map(|(at, _)| at);
    let at = { found }.find(|&at| {
        let (before, after) = (&name[..at], &name[at + side.len()..]);
        let (before, after) = (before.chars().next_back(), after.chars().next());
        if side.starts_with(char::is_lowercase) && side.len() > 2 {
            // `left` in `cleft` does not name a side.
            return !before.is_some_and(char::is_alphanumeric);
        }
        match side {
            "_l" | "_r" | "_L" | "_R" | ".L" | ".R" => !after.is_some_and(char::is_alphanumeric),
            "L_" | "R_" | "l_" | "r_" => !before.is_some_and(char::is_alphanumeric),
            // `Left` in `kLeftElbow`, not in `Leftover`.
            _ => !after.is_some_and(char::is_lowercase),
        }
    })?;
    Some([&name[..at], other, &name[at + side.len()..]].concat())
}
