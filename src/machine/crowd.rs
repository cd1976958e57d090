//! Crowds on a machine that keeps their tables.

use std::any::Any;

use crate::machine::error::VulkanError;
use crate::output::crowd::{CrowdFrame, CrowdOutput};
use crate::shader::{CrowdBase, CrowdChannel, CrowdClip, CrowdDispatch, CrowdLink, CrowdSpan};

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
    /// Whether all rotations are arcs or constants.
    pub(crate) only_arcs: bool,
    /// The push constants that all dispatches share.
    pub(crate) arguments: CrowdDispatch,
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
