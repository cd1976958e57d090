//! What a crowd's evaluation stores, and how large it is.

use crate::names::names;
use crate::shader::{CrowdChange, CrowdEntry};

/// What is stored of every joint of every instance, `[instance][joint]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CrowdValues {
    /// The rotation in the parent's frame, `x y z w`.
    Rotations,
    /// The transform in the parent's frame, `T R S`: three rows of four numbers, for column vectors,
    /// the last column the translation.
    Local,
    /// The transform in the model, as a matrix likewise.
    Model,
    /// The transform in the model times the inverse bind matrix, as vertices are skinned with.
    Skinning,
}

names! {
    CrowdValues, "kind of values",
    Rotations => "rotations",
    Local => "local",
    Model => "model",
    Skinning => "skinning",
}

/// What a crowd's evaluation stores, and in which precision.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct CrowdOutput {
    /// What is stored of every joint.
    pub values: CrowdValues,
    /// Whether numbers are of 16 bits, rounded to nearest from f32, not of 32.
    pub is_half: bool,
}

impl From<CrowdValues> for CrowdOutput {
    fn from(values: CrowdValues) -> Self {
        Self {
            values,
            is_half: false,
        }
    }
}

impl CrowdOutput {
    /// The same in 16 bits.
    #[must_use]
    pub fn half(values: CrowdValues) -> Self {
        Self {
            values,
            is_half: true,
        }
    }

    /// Vectors of four numbers for each joint.
    #[must_use]
    pub fn vector_count(self) -> usize {
        match self.values {
            CrowdValues::Rotations => 1,
            _ => 3,
        }
    }

    /// Bytes for each joint.
    #[must_use]
    pub fn bytes(self) -> usize {
        self.vector_count() * if self.is_half { 8 } else { 16 }
    }
}

/// What a device needs to know for an evaluation.
pub(crate) struct CrowdFrame<'a> {
    /// The clock, ticks.
    pub(crate) clock: u64,
    pub(crate) changes: EntryChanges<'a>,
    /// How many instances are evaluated.
    pub(crate) instances: u32,
    pub(crate) visible: VisibleInstances<'a>,
}

/// The entries that changed since the evaluation before.
pub(crate) enum EntryChanges<'a> {
    None,
    /// Those from an index on, one after another; some of them may be as they were.
    Range(usize, &'a [CrowdEntry]),
    /// Those here and there; no more than [`listed_changes`].
    List(&'a [CrowdChange]),
}

/// Which instances are evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum VisibleInstances<'a> {
    All,
    /// Those of the list that the device has.
    AsBefore,
    /// Those of a list that the device does not have yet.
    List(&'a [u32]),
}

/// The most changes that are listed, of so many entries. Of more, all entries from the first that changed to the last
/// are written.
pub(crate) fn listed_changes(entries: usize) -> usize {
    entries.div_ceil(4)
}
