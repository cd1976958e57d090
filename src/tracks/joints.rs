//! Which joints of two clips are the same. All that combines clips of a skeleton matches their joints here.

use std::collections::HashMap;

use crate::tracks::set::{TrackSet, default_name};

/// The names of a clip's joints, and their parents where these are known.
///
/// Joints of two clips are the same if their names are equal. Joints without names are called `box1`, `box2` … by their
/// index, so that joints of two clips without any names are matched by index. `joint0`, `joint1` …, as BVH files call joints
/// without names, are the same names if all joints have them.
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
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Joints {
    /// A name for each joint, also for those without one.
    names: Vec<String>,
    /// The names by which joints are matched.
    keys: Vec<String>,
    /// Whether any joint has a name.
    is_named: bool,
    /// The index of each joint's parent; `None` if the parents are not known.
    parents: Option<Vec<Option<usize>>>,
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
        "{named} has a joint `{name}`, but the joints of {unnamed} have no names; name both, or neither to match them by \
         index"
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
        let keys = match &numbered(&names)[..] {
            [] => names.clone(),
            numbers => numbers.iter().map(|&number| default_name(number)).collect(),
        };
        Self {
            names,
            keys,
            is_named,
            parents: None,
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

    /// The pairs of joints with equal names, and the joints without a partner. `clips` are what this clip and the other
    /// are called in messages. Parents are not compared ([`Joints::check_parents`]).
    ///
    /// # Errors
    /// When two joints of one clip have the same name, unless the names of both clips are equal, in the same order.
    pub fn pairs(&self, other: &Self, clips: [&str; 2]) -> Result<JointPairs, JointMatchError> {
        if self.keys == other.keys {
            return Ok(JointPairs {
                pairs: (0..self.len()).map(|joint| [joint; 2]).collect(),
                ..JointPairs::default()
            });
        }
        let [of_first, of_second] = [self.by_name(clips[0])?, other.by_name(clips[1])?];
        let partner = |joint: usize| of_second.get(&*self.keys[joint]);
        let lone = |joint: &usize| !of_first.contains_key(&*other.keys[*joint]);
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

    /// For each joint of this clip, the index of the same joint in the other. Both have the same joints with the same
    /// parents, where the parents of both are known. `clips` are what this clip and the other are called in messages.
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
        self.check_parents(other, &matched.pairs, &matched.pairs, clips)?;
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

    /// Refuses those of some pairs of joints whose parents are not a pair in `all`. If the parents of either clip are
    /// not known, nothing is refused.
    ///
    /// # Errors
    /// The first joint with another parent.
    pub fn check_parents(
        &self,
        other: &Self,
        some: &[[usize; 2]],
        all: &[[usize; 2]],
        clips: [&str; 2],
    ) -> Result<(), JointMatchError> {
        let (Some(parents), Some(others)) = (&self.parents, &other.parents) else {
            return Ok(());
        };
        let partners: HashMap<usize, usize> = all.iter().map(|pair| (pair[0], pair[1])).collect();
        for &[joint, same] in some {
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

    /// The indices of joints by name.
    fn by_name(&self, clip: &str) -> Result<HashMap<&str, usize>, JointMatchError> {
        let mut indices = HashMap::with_capacity(self.len());
        for (joint, name) in self.keys.iter().enumerate() {
            if indices.insert(&**name, joint).is_some() {
                return Err(JointMatchError::Repeated {
                    clip: clip.to_owned(),
                    name: name.clone(),
                });
            }
        }
        Ok(indices)
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
        // A name that has its equal in this clip is the name of another joint.
        let mut lone = (other.names.iter()).filter(|near| !self.names.contains(near));
        JointMatchError::Missing {
            near: lone.find(|near| are_near(&name, near)).cloned(),
            clip,
            name,
            other: other_clip,
        }
    }
}

/// The number of each joint if all are called `joint0`, `joint1` … in any order, as BVH files call joints without names;
/// otherwise empty.
fn numbered(names: &[String]) -> Vec<usize> {
    let number = |name: &String| {
        let number: usize = name.strip_prefix("joint")?.parse().ok()?;
        (number < names.len()).then_some(number)
    };
    let numbers: Vec<usize> = names.iter().map_while(number).collect();
    let mut is_known = vec![false; names.len()];
    numbers.iter().for_each(|&number| is_known[number] = true);
    match is_known.iter().all(|&known| known) {
        true => numbers,
        false => Vec::new(),
    }
}

/// Whether two names differ only in case, in what separates their words, or in a prefix such as `mixamorig:`.
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
    // Names of one or two letters end many others.
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
        // Tables do not say parents.
        let table = Joints::named(["arm", "hand", "hip"]);
        assert_eq!(first.order_of(&table, LABELS).unwrap(), [2, 0, 1]);
    }

    #[test]
    fn joints_without_names_are_matched_by_index() {
        let unnamed = |count: usize| Joints::named(vec![""; count]);
        assert_eq!(unnamed(2).order_of(&unnamed(2), LABELS).unwrap(), [0, 1]);
        refused(&unnamed(2), &unnamed(3), "b: 3 tracks; a has 2 joints");
        // Files that need names write these.
        let written = Joints::named(["box2", "box1"]);
        assert_eq!(unnamed(2).order_of(&written, LABELS).unwrap(), [1, 0]);
        let of_bvh = Joints::named(["joint0", "joint2", "joint1"]);
        assert_eq!(unnamed(3).order_of(&of_bvh, LABELS).unwrap(), [0, 2, 1]);
        assert_eq!(of_bvh.names(), ["joint0", "joint2", "joint1"]);
        let text = "b has a joint `hip`, but the joints of a have no names; name both, or neither to match them by \
                    index";
        refused(&unnamed(2), &chain(&["hip", "arm"]), text);
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
        // Where all names are the same in the same order, the order tells the joints apart.
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
