//! Machines evaluate. The CPU ([`cpu`](crate::cpu)) and Vulkan devices (`gpu`) implement the same trait, so that the
//! layers above need not distinguish them.
//!
//! * [`Machine`]: evaluates rows of samples, takes prepared tracks ([`MachineClip`]) and crowds ([`MachineCrowd`]), and
//!   runs passes over poses ([`PassRunner`]). A request goes to a machine as its [`Plan`](plan::Plan) says, which depends
//!   on the machine's [`Limits`] alone.
//! * [`ListedDevice`]: a device that is not open yet.
//! * [`EngineOptions`], [`EvaluateError`], [`reports`] and the files that
//!   are kept from process to process ([`cache`]): every build has them, with and without the feature `vulkan`.
//!
//! The traits have no methods for operations that only Vulkan devices have, such as writing into an application's
//! buffer. Callers get the device for these by `gpu::Opened::of`.

pub(crate) mod cache;
// Only devices use these types: the CPU evaluates crowds without them.
#[cfg_attr(not(feature = "vulkan"), allow(dead_code))]
pub(crate) mod crowd;
pub(crate) mod error;
pub(crate) mod options;
pub(crate) mod plan;
pub(crate) mod poses;
pub(crate) mod reports;

use std::any::Any;
use std::sync::Arc;

use crate::machine::crowd::{CrowdSource, MachineCrowd};
use crate::machine::error::{EvaluateError, VulkanError};
use crate::machine::options::{EngineOptions, Timings};
use crate::machine::plan::{Limits, Rows};
use crate::machine::poses::PassRunner;
use crate::machine::reports::{DeviceInfo, KernelCheck, NegativeControl, SelfTestReport};
use crate::output::encoded::EncodedOutput;
use crate::output::encoding::Encoding;
use crate::output::rotations::{Layout, Storage};
use crate::output::window::Window;
use crate::prepare::clip_data::ClipData;
use crate::prepare::preparation::SetRequest;
use crate::prepare::prepared::Prepared;
use crate::shader::Form;
use crate::simd::dispatch::VectorWidth;
use crate::threads::Threads;
use crate::time::frames::Timeline;

/// A machine that evaluates. All machines give the same bits.
pub(crate) trait Machine: Any + Send + Sync {
    /// The capabilities of the machine on which plans depend.
    fn limits(&self) -> Limits;

    /// The vectors in which the host computes its part.
    fn width(&self) -> VectorWidth {
        VectorWidth::widest()
    }

    /// The threads on which the host computes its part.
    fn threads(&self) -> &Threads {
        Threads::of_process()
    }

    /// Evaluates a request in rows, each with the samples of a track, into `output`, which is exactly as long.
    #[cfg(not(smallest))]
    fn rows(
        &self,
        request: &SetRequest<'_>,
        rows: Rows,
        output: EncodedOutput<'_>,
    ) -> Result<(), EvaluateError>;

    /// Takes prepared tracks, for any number of evaluations.
    fn clip(self: Arc<Self>, data: ClipData) -> Result<Box<dyn MachineClip>, EvaluateError>;

    /// Calls `work` with the runner of its passes over poses. If memory runs out, the call is repeated with smaller
    /// windows.
    fn passes(
        &self,
        work: &mut dyn FnMut(&dyn PassRunner) -> Result<(), EvaluateError>,
    ) -> Result<(), EvaluateError>;

    /// Takes the tables of a crowd; `None` if the host evaluates crowds.
    fn crowd(&self, _: &CrowdSource<'_>) -> Result<Option<Box<dyn MachineCrowd>>, VulkanError> {
        Ok(None)
    }

    /// Name, kind and limits of a Vulkan device; `None` for the CPU.
    fn info(&self) -> Option<&DeviceInfo> {
        None
    }

    /// The results of the self-test; empty for the CPU, with which devices are compared.
    fn self_tests(&self) -> &[SelfTestReport] {
        &[]
    }

    /// The self-test's expressions as the driver computes them if it may change them; `None` for the CPU.
    fn negative_control(&self) -> Result<Option<NegativeControl>, VulkanError> {
        Ok(None)
    }

    /// The machine's kernels, without running any.
    fn known_kernels(&self) -> Vec<KernelCheck> {
        Vec::new()
    }

    /// Compares kernels with the CPU, while `each` returns true; with `only_unknown`, those that are known to pass are
    /// not run.
    fn check_kernels(
        &self,
        _only_unknown: bool,
        _each: &mut dyn FnMut(KernelCheck) -> bool,
    ) -> Result<(), VulkanError> {
        Ok(())
    }

    /// Compiles the kernels for segments of a form and for evaluation from keys.
    fn warm(&self, _form: Form, _encoding: Encoding) -> Result<(), EvaluateError> {
        Ok(())
    }

    /// The messages of the validation layer so far.
    fn validation_messages(&self) -> Vec<String> {
        Vec::new()
    }

    /// The times of a device's evaluations since the last call.
    fn take_timings(&self) -> Timings {
        Timings::default()
    }
}

/// Prepared tracks on a machine.
pub(crate) trait MachineClip: Any + Send + Sync {
    fn data(&self) -> &Arc<ClipData>;

    /// Evaluates all tracks; the result stays in memory of the device if this saves a copy. Explicit times must have
    /// been folded into the time range of the keys by the wrap mode ([`ClipData::folded`]).
    fn evaluate(
        &self,
        timeline: &Timeline,
        layout: Layout,
    ) -> Result<Box<dyn Storage>, EvaluateError>;

    /// Evaluates a window of the result into `output`, which is exactly as long. The timeline is as in
    /// [`MachineClip::evaluate`].
    fn evaluate_into(
        &self,
        timeline: &Timeline,
        window: &Window,
        output: EncodedOutput<'_>,
    ) -> Result<(), EvaluateError>;

    /// Takes the segments out, whose memory the next ones use. Afterwards only [`MachineClip::replace`] may follow.
    fn take_segments(&mut self) -> Vec<Prepared>;

    /// Replaces the tracks by others, in the same memory as far as they fit.
    fn replace(&mut self, data: ClipData) -> Result<(), EvaluateError>;
}

/// A device that was listed, and is not open yet.
pub(crate) trait ListedDevice: Any + Send + Sync {
    fn info(&self) -> &DeviceInfo;

    /// Opens the device and runs the self-test; refuses a device that fails it, unless the options allow inexact ones.
    fn open(&self, options: &EngineOptions) -> Result<Arc<dyn Machine>, VulkanError>;
}
