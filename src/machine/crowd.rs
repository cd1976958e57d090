//! Crowds on a machine that keeps their tables.

use std::any::Any;

use crate::machine::error::VulkanError;
use crate::output::crowd::CrowdOutput;
use crate::shader::{
    CrowdBase, CrowdChange, CrowdChannel, CrowdClip, CrowdDispatch, CrowdEntry, CrowdLink,
    CrowdSpan,
};

/// The tables of a crowd's library, and the number of its instances.
pub(crate) struct CrowdSource<'a> {
    pub(crate) instances: u32,
    pub(crate) clips: &'a [CrowdClip],
    pub(crate) bases: &'a [CrowdBase],
    pub(crate) spans: &'a [CrowdSpan],
    pub(crate) channels: &'a [CrowdChannel],
    pub(crate) cells: &'a [[f32; 4]],
    pub(crate) links: &'a [CrowdLink],
    /// The first link of each level of the skeleton below the roots, then the number of links.
    pub(crate) levels: &'a [u32],
    /// The rows of inverse bind matrices; empty if there are none.
    pub(crate) bind: &'a [[[f32; 4]; 3]],
    pub(crate) forms: ChannelForms,
    /// The push constants that all dispatches share.
    pub(crate) arguments: CrowdDispatch,
}

/// The forms of a library's channels, as far as they choose the kernels of a crowd.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ChannelForms {
    /// All rotations are arcs or constants.
    Arcs,
    /// Any segments.
    Segments,
    /// Some channels are stored compactly.
    Compact,
}

/// The curves of a crowd's channels, of which each kind has kernels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum CrowdCurves {
    /// Instances have one layer, and all rotations are arcs.
    Plain,
    /// Any segments.
    Any,
    /// Some are stored compactly.
    Compact,
}

impl CrowdCurves {
    pub(crate) fn new(forms: ChannelForms, layers: u32) -> Self {
        match forms {
            ChannelForms::Arcs if layers == 1 => Self::Plain,
            ChannelForms::Arcs | ChannelForms::Segments => Self::Any,
            ChannelForms::Compact => Self::Compact,
        }
    }
}

/// The changes that a device needs for an evaluation.
pub(crate) struct CrowdFrame<'a> {
    /// The clock in ticks.
    pub(crate) clock: u64,
    pub(crate) changes: EntryChanges<'a>,
    /// Number of instances that are evaluated.
    pub(crate) instances: u32,
    pub(crate) visible: VisibleInstances<'a>,
}

/// The entries that changed since the previous evaluation.
pub(crate) enum EntryChanges<'a> {
    None,
    /// The entries from an index on, one after another; some of them may be unchanged.
    Range(usize, &'a [CrowdEntry]),
    /// Single entries, no more than [`listed_changes`](crate::output::crowd::listed_changes).
    List(&'a [CrowdChange]),
}

/// Which instances are evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum VisibleInstances<'a> {
    All,
    /// The instances of the list that the device has.
    AsBefore,
    /// The instances of a list that the device does not have yet.
    List(&'a [u32]),
}

/// A crowd whose tables and entries a machine keeps.
pub(crate) trait MachineCrowd: Any + Send + Sync {
    /// Starts the evaluation of a frame with at least one instance; the result of the previous one must have been
    /// taken. After an error the machine may have missed the frame's changes.
    fn submit(&mut self, output: CrowdOutput, frame: &CrowdFrame<'_>) -> Result<(), VulkanError>;

    /// Whether the submitted evaluation has ended, without waiting.
    fn is_done(&self) -> Result<bool, VulkanError>;

    /// Waits, and copies the result to `output`, which is exactly as long; false if nothing was submitted. After an
    /// error the machine may have missed the frame's changes.
    fn wait_into(&mut self, output: &mut [u8]) -> Result<bool, VulkanError>;
}
