//! Which joints of two clips are the same. All functions that combine clips of one skeleton match their joints here.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};

use crate::tracks::set::{TrackSet, default_name};

/// The names of a clip's joints, and their parents where these are known.
///
/// Joints of two clips are the same if their names are equal. Joints without names are called `box1`, `box2` … by their
/// index, so that joints of two clips without any names are matched by index. If all joints of one clip have such names,
/// and those of the other are `joint0`, `joint1` …, as BVH files call joints without names, they are matched by number.
///
/// ```
/// use tumble::Joints;
/// let walk = Joints::named(["hip", "left", "right"]).with_parents(vec![None, Some(0), Some(0)]);
/// let run = Joints::named(["hip", "right", "left"]).with_parents(vec![None, Some(0), Some(0)]);
/// assert_eq!(walk.order_of(&run, ["walk", "run"])?, [0, 2, 1]);
/// let other = Joints::named(["hip", "Right", "left"]);
/// let error = walk.order_of(&other, ["walk", "other"]).unwrap_err();
/// assert_eq!(
///     error.to_string(),
///     "walk has a joint `right`, other has none of that name; `Right` is near, but only equal names match"
/// );
/// # Ok::<(), tumble::JointMatchError>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct Joints {
    /// A name for each joint, also for those without one.
    names: Vec<String>,
    /// Whether any joint has a name.
    is_named: bool,
    /// The index of each joint's parent; `None` if the parents are not known.
    parents: Option<Vec<Option<usize>>>,
    /// The index of each joint by its name, kept by [`Joints::extend`]: without it, each of thousands of clips would
    /// look at all joints of those before. Empty until it is needed.
    by_name: HashMap<String, usize>,
}

/// Pairs of joints of two clips that are the same.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct JointPairs {
    /// The index of each pair's joint in the first clip and in the second, in the order of the first.
    pub pairs: Vec<[usize; 2]>,
    /// The joints that only the first clip has, and those that only the second has.
    pub missing: [Vec<usize>; 2],
}

impl JointPairs {
    /// The joints of two clips that have the same `count` joints in the same order.
    #[must_use]
    pub fn in_order(count: usize) -> Self {
        Self {
            pairs: (0..count).map(|joint| [joint; 2]).collect(),
            ..Self::default()
        }
    }
}

/// Why joints of two clips are not the same.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum JointMatchError {
    /// Two joints of a clip have the same name, so that names do not tell them apart.
    #[error(
        "{clip} has two joints `{name}`; joints are matched by name, so give them names that differ"
    )]
    Repeated {
        /// The name of the clip in messages.
        clip: String,
        /// The name of both joints.
        name: String,
    },
    /// The joints of one clip have names, those of the other have none.
    #[error(
        "{named} has a joint `{name}`, but the joints of {unnamed} have no names; joints are matched by name, or by \
         index if neither clip has names"
    )]
    Unnamed {
        /// The name of the clip with names in messages.
        named: String,
        /// Its first name.
        name: String,
        /// The name of the other clip in messages.
        unnamed: String,
    },
    /// The clips have different numbers of joints, and no names.
    #[error("{}: {} tracks; {} has {} joints", clips[1], joints[1], clips[0], joints[0])]
    Count {
        /// The names of the clips in messages.
        clips: [String; 2],
        /// Their numbers of joints.
        joints: [usize; 2],
    },
    /// A joint has no partner.
    #[error("{clip} has a joint `{name}`, {other} has none of that name{}", hint(near.as_deref()))]
    Missing {
        /// The name of the clip in messages.
        clip: String,
        /// The joint's name.
        name: String,
        /// The name of the clip without that joint in messages.
        other: String,
        /// A name in the other clip that differs only in case, separators or a prefix.
        near: Option<String>,
    },
    /// A joint has another parent.
    #[error(
        "`{joint}` {} in {}, but {} in {}",
        hangs(parents[0].as_deref()), clips[0], hangs(parents[1].as_deref()), clips[1]
    )]
    Parent {
        /// The names of the clips in messages.
        clips: [String; 2],
        /// The joint's name.
        joint: String,
        /// The name of its parent in each clip; `None` for a root.
        parents: [Option<String>; 2],
    },
}

fn hint(near: Option<&str>) -> String {
    near.map_or_else(String::new, |name| {
        format!("; `{name}` is near, but only equal names match")
    })
}

fn hangs(parent: Option<&str>) -> String {
    parent.map_or_else(
        || "is a root".to_owned(),
        |name| format!("has the parent `{name}`"),
    )
}

impl Joints {
    /// The joints that the tracks of a set are, without parents.
    #[must_use]
    pub fn of(set: &TrackSet) -> Self {
        Self::named((0..set.track_count()).map(|track| set.track(track).name.unwrap_or_default()))
    }

    /// Joints with these names, without parents. A joint without a name has an empty one.
    #[must_use]
    pub fn named<T: Into<String>>(names: impl IntoIterator<Item = T>) -> Self {
        let mut names: Vec<String> = names.into_iter().map(Into::into).collect();
        let is_named = names.iter().any(|name| !name.is_empty());
        for (joint, name) in names.iter_mut().enumerate() {
            if name.is_empty() {
                *name = default_name(joint);
            }
        }
        Self {
            names,
            is_named,
            ..Self::default()
        }
    }

    /// The same joints with the index of each joint's parent, `None` for a root. Joints beyond the end of `parents` are
    /// roots.
    #[must_use]
    pub fn with_parents(self, parents: Vec<Option<usize>>) -> Self {
        let parents = Some(parents);
        Self { parents, ..self }
    }

    /// Number of joints.
    #[must_use]
    pub fn len(&self) -> usize {
        self.names.len()
    }

    /// Whether there are no joints.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.names.is_empty()
    }

    /// Whether any joint has a name.
    #[must_use]
    pub fn is_named(&self) -> bool {
        self.is_named
    }

    /// The name of each joint; `box1`, `box2` … for joints without one.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// The pairs of joints with equal names, and the joints without a partner. `clips` are the names of this clip and
    /// the other in messages. Parents are not compared ([`Joints::check_parents`]).
    ///
    /// # Errors
    /// When two joints of one clip have the same name, unless the names of both clips are equal, in the same order.
    pub fn pairs(&self, other: &Self, clips: [&str; 2]) -> Result<JointPairs, JointMatchError> {
        let others = self.names_of(other);
        if self.names == *others {
            return Ok(JointPairs::in_order(self.len()));
        }
        let of_first = by_name(&self.names, clips[0])?;
        let of_second = by_name(&others, clips[1])?;
        let partner = |joint: usize| of_second.get(&*self.names[joint]);
        let lone = |joint: &usize| !of_first.contains_key(&*others[*joint]);
        Ok(JointPairs {
            pairs: (0..self.len())
                .filter_map(|joint| Some([joint, *partner(joint)?]))
                .collect(),
            missing: [
                (0..self.len())
                    .filter(|&joint| partner(joint).is_none())
                    .collect(),
                (0..other.len()).filter(lone).collect(),
            ],
        })
    }

    /// Appends the joints that only the other clip has, and returns, for each joint of the other clip, its index here.
    /// `clips` are the names of this clip and the other in messages. Joints whose parents are not known become roots.
    ///
    /// # Errors
    /// As [`Joints::pairs`]; also when a joint of both has another parent in the other clip. The joints are then unchanged.
    pub fn extend(
        &mut self,
        other: &Self,
        clips: [&str; 2],
    ) -> Result<Vec<usize>, JointMatchError> {
        let (before, others) = (self.len(), self.names_of(other));
        let mut added: Vec<String> = Vec::new();
        let indices: Vec<usize> = if self.names == *others {
            (0..before).collect()
        } else {
            if self.by_name.len() < before {
                let known = by_name(&self.names, clips[0])?.into_iter();
                self.by_name = known
                    .map(|(name, joint)| (name.to_owned(), joint))
                    .collect();
            }
            by_name(&others, clips[1])?;
            let index_of = |name: &String| {
                self.by_name.get(name).copied().unwrap_or_else(|| {
                    added.push(name.clone());
                    before + added.len() - 1
                })
            };
            others.iter().map(index_of).collect()
        };
        let tracks = indices.iter().enumerate();
        let shared = tracks.filter(|&(_, &joint)| joint < before);
        let shared = JointPairs {
            pairs: shared.map(|(track, &joint)| [joint, track]).collect(),
            ..JointPairs::default()
        };
        self.check_parents(other, &shared, clips)?;
        let parents = self.parents.get_or_insert_default();
        parents.resize(before, None);
        let is_added = |track: &usize| indices[*track] >= before;
        parents.extend((0..other.len()).filter(is_added).map(|track| {
            let parent = other.parents.as_ref()?.get(track).copied().flatten()?;
            indices.get(parent).copied()
        }));
        let numbered = (before..).zip(&added);
        (self.by_name).extend(numbered.map(|(joint, name)| (name.clone(), joint)));
        self.names.append(&mut added);
        self.is_named |= other.is_named;
        Ok(indices)
    }

    /// The names of the other clip's joints as this clip calls them: its own, unless those of one clip are numbered and
    /// those of the other are default names.
    fn names_of<'a>(&self, other: &'a Self) -> Cow<'a, [String]> {
        let renamed = [
            (default_name as Numbering, bvh_name as Numbering),
            (bvh_name, default_name),
        ]
        .into_iter()
        .find_map(|(to, from)| {
            let numbers = numbers_of(&other.names, from)?;
            numbers_of(&self.names, to)?;
            Some(numbers.into_iter().map(to).collect())
        });
        renamed.map_or(Cow::Borrowed(&other.names), Cow::Owned)
    }

    /// For each joint of this clip, the index of the same joint in the other. Both have the same joints with the same
    /// parents, where the parents of both are known. `clips` are the names of this clip and the other in messages.
    ///
    /// # Errors
    /// The first difference.
    pub fn order_of(&self, other: &Self, clips: [&str; 2]) -> Result<Vec<usize>, JointMatchError> {
        if !self.is_named && !other.is_named && self.len() != other.len() {
            return Err(JointMatchError::Count {
                clips: clips.map(str::to_owned),
                joints: [self.len(), other.len()],
            });
        }
        let matched = self.pairs(other, clips)?;
        if let Some(&joint) = matched.missing[0].first() {
            return Err(self.missing(joint, other, clips));
        }
        self.check_extra(other, &matched, clips)?;
        self.check_parents(other, &matched, clips)?;
        Ok(matched.pairs.into_iter().map(|[_, joint]| joint).collect())
    }

    /// Refuses joints that only the other clip has.
    ///
    /// # Errors
    /// The first such joint.
    pub fn check_extra(
        &self,
        other: &Self,
        matched: &JointPairs,
        clips: [&str; 2],
    ) -> Result<(), JointMatchError> {
        let first = matched.missing[1].first();
        first.map_or(Ok(()), |&joint| {
            Err(other.missing(joint, self, [clips[1], clips[0]]))
        })
    }

    /// Refuses a pair of joints if their parents are not a pair, too. If the parents of either clip are not known,
    /// nothing is refused.
    ///
    /// # Errors
    /// The first joint with another parent.
    pub fn check_parents(
        &self,
        other: &Self,
        matched: &JointPairs,
        clips: [&str; 2],
    ) -> Result<(), JointMatchError> {
        self.check_parents_of(other, matched, |_| true, clips)
    }

    /// As [`Joints::check_parents`], but only refuses pairs for which `is_checked` is true.
    ///
    /// # Errors
    /// The first of these joints with another parent.
    pub fn check_parents_of(
        &self,
        other: &Self,
        matched: &JointPairs,
        is_checked: impl Fn([usize; 2]) -> bool,
        clips: [&str; 2],
    ) -> Result<(), JointMatchError> {
        let (Some(parents), Some(others)) = (&self.parents, &other.parents) else {
            return Ok(());
        };
        let pairs = &matched.pairs;
        let partners: HashMap<usize, usize> = pairs.iter().map(|pair| (pair[0], pair[1])).collect();
        for &[joint, same] in pairs.iter().filter(|&&pair| is_checked(pair)) {
            let parent = parents.get(joint).copied().flatten();
            let others = others.get(same).copied().flatten();
            let is_same = match (parent, others) {
                (None, None) => true,
                (Some(parent), Some(other)) => partners.get(&parent) == Some(&other),
                _ => false,
            };
            if !is_same {
                let name = |joints: &Self, parent: usize| joints.names.get(parent).cloned();
                return Err(JointMatchError::Parent {
                    clips: clips.map(str::to_owned),
                    joint: self.names[joint].clone(),
                    parents: [
                        parent.and_then(|parent| name(self, parent)),
                        others.and_then(|parent| name(other, parent)),
                    ],
                });
            }
        }
        Ok(())
    }

    /// The error that the other clip has no joint like one of this clip.
    fn missing(&self, joint: usize, other: &Self, clips: [&str; 2]) -> JointMatchError {
        let [clip, other_clip] = clips.map(str::to_owned);
        if self.is_named != other.is_named {
            let (named, unnamed, first) = match self.is_named {
                true => (clip, other_clip, self.names.first()),
                false => (other_clip, clip, other.names.first()),
            };
            return JointMatchError::Unnamed {
                named,
                name: first.cloned().unwrap_or_default(),
                unnamed,
            };
        }
        let name = self.names[joint].clone();
        // A name that also exists in this clip belongs to another joint, so it is not suggested.
        let mut lone = (other.names.iter()).filter(|near| !self.names.contains(near));
        JointMatchError::Missing {
            near: lone.find(|near| are_near(&name, near)).cloned(),
            clip,
            name,
            other: other_clip,
        }
    }
}

/// The indices of joints by name.
fn by_name<'a>(
    names: &'a [String],
    clip: &str,
) -> Result<HashMap<&'a str, usize>, JointMatchError> {
    let mut indices = HashMap::with_capacity(names.len());
    for (joint, name) in names.iter().enumerate() {
        if indices.insert(&**name, joint).is_some() {
            return Err(JointMatchError::Repeated {
                clip: clip.to_owned(),
                name: name.clone(),
            });
        }
    }
    Ok(indices)
}

/// A name for each joint by its index.
type Numbering = fn(usize) -> String;

/// The name that is read from BVH files for a joint without one.
fn bvh_name(joint: usize) -> String {
    format!("joint{joint}")
}

/// The index that each name has in a numbering; `None` if a name has none, two have the same, or there are no names.
fn numbers_of(names: &[String], numbering: Numbering) -> Option<Vec<usize>> {
    let mut seen = HashSet::with_capacity(names.len());
    let number = |name: &String| {
        let digits = name.trim_start_matches(|c: char| !c.is_ascii_digit());
        let number: usize = digits.parse().ok()?;
        // Joints may be numbered from 0 or from 1.
        let indices = [Some(number), number.checked_sub(1)];
        let index = (indices.into_iter().flatten()).find(|&index| numbering(index) == *name)?;
        seen.insert(index).then_some(index)
    };
    let numbers: Vec<usize> = names.iter().map(number).collect::<Option<_>>()?;
    (!numbers.is_empty()).then_some(numbers)
}

/// Whether two names differ only in case, in the separators of their words, or in a prefix such as `mixamorig:`.
fn are_near(name: &str, other: &str) -> bool {
    let plain = |name: &str| -> String {
        let letters = name.chars().filter(|letter| letter.is_alphanumeric());
        letters.flat_map(char::to_lowercase).collect()
    };
    let (name, other) = (plain(name), plain(other));
    let (short, long) = match name.len() < other.len() {
        true => (name, other),
        false => (other, name),
    };
    // Many names end in one or two letters that are also a name, so such short names are not suggested.
    long == short || short.len() > 2 && long.ends_with(&short)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LABELS: [&str; 2] = ["a", "b"];

    fn chain(names: &[&str]) -> Joints {
        let parents = (0..names.len()).map(|joint| joint.checked_sub(1));
        Joints::named(names.iter().copied()).with_parents(parents.collect())
    }

    #[track_caller]
    fn refused(first: &Joints, second: &Joints, text: &str) {
        let error = first.order_of(second, LABELS).unwrap_err();
        assert_eq!(error.to_string(), text);
    }

    #[test]
    fn joints_are_matched_by_name_whatever_their_order() {
        let first =
            Joints::named(["hip", "arm", "hand"]).with_parents(vec![None, Some(0), Some(1)]);
        let second =
            Joints::named(["hand", "hip", "arm"]).with_parents(vec![Some(2), None, Some(1)]);
        assert_eq!(first.order_of(&second, LABELS).unwrap(), [1, 2, 0]);
        assert_eq!(second.order_of(&first, LABELS).unwrap(), [2, 0, 1]);
        // Tables contain no parents.
        let table = Joints::named(["arm", "hand", "hip"]);
        assert_eq!(first.order_of(&table, LABELS).unwrap(), [2, 0, 1]);
    }

    #[test]
    fn joints_without_names_are_matched_by_index() {
        let unnamed = |count: usize| Joints::named(vec![""; count]);
        assert_eq!(unnamed(2).order_of(&unnamed(2), LABELS).unwrap(), [0, 1]);
        refused(&unnamed(2), &unnamed(3), "b: 3 tracks; a has 2 joints");
        // Formats that require names write these names for joints without names.
        let written = Joints::named(["box2", "box1"]);
        assert_eq!(unnamed(2).order_of(&written, LABELS).unwrap(), [1, 0]);
        let of_bvh = Joints::named(["joint0", "joint2", "joint1"]);
        assert_eq!(unnamed(3).order_of(&of_bvh, LABELS).unwrap(), [0, 2, 1]);
        assert_eq!(of_bvh.names(), ["joint0", "joint2", "joint1"]);
        assert_eq!(of_bvh.order_of(&unnamed(3), LABELS).unwrap(), [0, 2, 1]);
        let part = Joints::named(["joint0", "joint2"]);
        let matched = unnamed(3).pairs(&part, LABELS).unwrap();
        assert_eq!(matched.pairs, [[0, 0], [2, 1]]);
        assert_eq!(matched.missing, [vec![1], vec![]]);
        let text = "b has a joint `hip`, but the joints of a have no names; joints are matched by name, or by index \
                    if neither clip has names";
        refused(&unnamed(2), &chain(&["hip", "arm"]), text);
    }

    /// Names like those that BVH files give are names as any others beside clips that have names.
    #[test]
    fn numbered_names_match_where_they_are_equal() {
        let two = Joints::named(["joint0", "joint1"]);
        for (other, more) in [
            (["joint0", "joint1", "tool"], 2),
            (["tool", "joint0", "joint1"], 0),
            (["joint0", "joint1", "joint2"], 2),
        ] {
            let other = Joints::named(other);
            let matched = two.pairs(&other, LABELS).unwrap();
            let first = usize::from(more == 0);
            assert_eq!(matched.pairs, [[0, first], [1, first + 1]]);
            assert_eq!(matched.missing, [vec![], vec![more]]);
            let back = other.pairs(&two, LABELS).unwrap();
            assert_eq!(back.pairs, [[first, 0], [first + 1, 1]]);
        }
        let gap = Joints::named(["joint0", "joint2"]);
        let matched = two.pairs(&gap, LABELS).unwrap();
        assert_eq!(matched.pairs, [[0, 0]]);
        assert_eq!(matched.missing, [vec![1], vec![1]]);
        refused(
            &two,
            &gap,
            "a has a joint `joint1`, b has none of that name",
        );
        // Only numbers without leading zeros count as numbers.
        let padded = Joints::named(["joint00", "joint1"]);
        let text = "b has a joint `joint00`, but the joints of a have no names; joints are matched by name, or by \
                    index if neither clip has names";
        refused(&Joints::named(["", ""]), &padded, text);
    }

    #[test]
    fn joints_that_are_new_follow_the_others() {
        let mut all = chain(&["hip", "arm"]);
        let tree = |names: [&str; 3], parents: [Option<usize>; 3]| {
            Joints::named(names).with_parents(parents.to_vec())
        };
        let other = tree(["tail", "hip", "hand"], [Some(1), None, Some(0)]);
        assert_eq!(all.extend(&other, LABELS).unwrap(), [2, 0, 3]);
        assert_eq!(all.names(), ["hip", "arm", "tail", "hand"]);
        assert_eq!(
            all.parents.as_deref().unwrap(),
            [None, Some(0), Some(0), Some(2)]
        );
        assert_eq!(all.extend(&other, LABELS).unwrap(), [2, 0, 3]);
        // After an error nothing has changed.
        let wrong = tree(["toe", "arm", "hip"], [Some(1), None, None]);
        let error = all.extend(&wrong, LABELS).unwrap_err();
        let text = "`arm` has the parent `hip` in a, but is a root in b";
        assert_eq!(error.to_string(), text);
        let twice = chain(&["hip", "toe", "toe"]);
        assert!(all.extend(&twice, LABELS).is_err());
        assert_eq!((all.len(), all.by_name.len()), (4, 4));
        assert_eq!(all.parents.as_ref().map(Vec::len), Some(4));
        // Joints without names are numbered as before and get no names.
        let mut unnamed = Joints::named(["", ""]);
        let of_bvh = Joints::named(["joint2", "joint0", "joint1"]);
        assert_eq!(unnamed.extend(&of_bvh, LABELS).unwrap(), [2, 0, 1]);
        assert_eq!(unnamed.names(), ["box1", "box2", "box3"]);
        let mut unnamed = Joints::named([""]);
        assert_eq!(
            unnamed.extend(&Joints::named(["", ""]), LABELS).unwrap(),
            [0, 1]
        );
        assert!(!unnamed.is_named());
        // Lists in which a name occurs twice are matched only if they are equal.
        let mut twice = chain(&["hip", "toe", "toe"]);
        assert_eq!(twice.extend(&twice.clone(), LABELS).unwrap(), [0, 1, 2]);
        assert!(twice.extend(&chain(&["hip", "toe"]), LABELS).is_err());
    }

    #[test]
    fn the_first_difference_is_named() {
        let first = chain(&["hip", "arm", "hand"]);
        for (second, text) in [
            (
                chain(&["hip", "arm"]),
                "a has a joint `hand`, b has none of that name",
            ),
            (
                chain(&["hip", "arm", "hand", "tool"]),
                "b has a joint `tool`, a has none of that name",
            ),
            (
                chain(&["rig:Hip", "rig:Arm", "rig:Hand"]),
                "a has a joint `hip`, b has none of that name; `rig:Hip` is near, but only equal names match",
            ),
            (
                chain(&["arm", "hip", "hand"]),
                "`hip` is a root in a, but has the parent `arm` in b",
            ),
            (
                Joints::named(["hip", "arm", "hand"]).with_parents(vec![None, Some(0), Some(0)]),
                "`hand` has the parent `arm` in a, but has the parent `hip` in b",
            ),
            (
                chain(&["hip", "hand", "hand"]),
                "b has two joints `hand`; joints are matched by name, so give them names that differ",
            ),
        ] {
            refused(&first, &second, text);
        }
        // If all names are the same in the same order, joints with equal names are matched by their order.
        let twice = chain(&["hip", "hand", "hand"]);
        assert_eq!(twice.order_of(&twice.clone(), LABELS).unwrap(), [0, 1, 2]);
    }

    #[test]
    fn a_part_of_the_joints_can_be_matched() {
        let (first, second) = (
            chain(&["hip", "arm", "hand"]),
            chain(&["hand", "tail", "hip"]),
        );
        let matched = first.pairs(&second, LABELS).unwrap();
        assert_eq!(matched.pairs, [[0, 2], [2, 0]]);
        assert_eq!(matched.missing, [vec![1], vec![1]]);
    }
}
