//! Replacement of Vulkan in a build without the feature `vulkan`: the names that the rest of the engine uses, with
//! types that have no values. No device is listed, so none is opened.

#[path = "cache.rs"]
pub(crate) mod cache;
#[path = "error.rs"]
pub(crate) mod error;
#[path = "options.rs"]
pub(crate) mod options;
#[path = "reports.rs"]
pub(crate) mod reports;

/// A type without values.
#[derive(Clone, Copy)]
pub(crate) enum Never {}

pub(crate) mod physical {
    use crate::gpu::Never;
    use crate::gpu::error::VulkanError;
    pub(crate) use crate::gpu::reports::{DeviceInfo, DeviceKind};

    #[derive(Clone)]
    pub(crate) struct PhysicalDevice {
        pub(crate) info: DeviceInfo,
        pub(crate) never: Never,
    }

    pub(crate) fn list(_validation: bool) -> Result<Vec<PhysicalDevice>, VulkanError> {
        Err(VulkanError::NotBuilt)
    }
}

pub(crate) mod kept_lists {
    #[derive(Default)]
    pub(crate) struct ListCache;

    impl ListCache {
        pub(crate) fn forget(&self) {}
    }
}

pub(crate) mod job {
    use std::sync::Arc;

    use crate::gpu::Never;
    use crate::gpu::kept_lists::ListCache;
    use crate::output::encoding::Encoding;
    use crate::prepare::clip_data::ClipData;
    use crate::time::frames::Timeline;

    pub(crate) struct ClipBuffers {
        pub(crate) never: Never,
    }

    pub(crate) struct Job<'a> {
        pub(crate) clip: &'a ClipData,
        pub(crate) buffers: &'a Arc<ClipBuffers>,
        pub(crate) timeline: &'a Timeline,
        pub(crate) encoding: Encoding,
        pub(crate) lists: &'a ListCache,
    }
}

pub(crate) mod engine {
    use std::sync::{Arc, Mutex};

    use bytemuck::NoUninit;

    use crate::from_keys::dispatches::KeyJob;
    use crate::gpu::Never;
    use crate::gpu::error::{EvaluateError, VulkanError};
    use crate::gpu::job::{ClipBuffers, Job};
    use crate::gpu::options::Timings;
    use crate::gpu::reports::KernelCheck;
    use crate::output::rotations::{Layout, Storage};
    use crate::output::window::Window;
    use crate::prepare::clip_data::ClipData;
    use crate::shader::Kernel;

    pub(crate) struct VulkanEngine {
        pub(crate) never: Never,
        pub(crate) group_bytes: usize,
        pub(crate) prepares_arcs_from: usize,
        pub(crate) clip_bytes: Option<usize>,
        pub(crate) timings: Mutex<Timings>,
        pub(crate) device: Arc<LogicalDevice>,
    }

    pub(crate) struct LogicalDevice {
        pub(crate) physical: OpenedPhysical,
    }

    pub(crate) struct OpenedPhysical {
        pub(crate) instance: Instance,
    }

    pub(crate) struct Instance {
        never: Never,
    }

    impl Instance {
        pub(crate) fn validation_messages(&self) -> Vec<String> {
            match self.never {}
        }
    }

    impl VulkanEngine {
        pub(crate) fn window(&self) -> usize {
            match self.never {}
        }

        pub(crate) fn owns(&self, _buffers: &ClipBuffers) -> bool {
            match self.never {}
        }

        pub(crate) fn upload(
            &self,
            _clip: &ClipData,
            _spare: Option<ClipBuffers>,
        ) -> Result<ClipBuffers, VulkanError> {
            match self.never {}
        }

        pub(crate) fn evaluate(
            &self,
            _job: Job<'_>,
            _layout: Layout,
        ) -> Result<Box<dyn Storage>, EvaluateError> {
            match self.never {}
        }

        pub(crate) fn evaluate_into(
            &self,
            _job: Job<'_>,
            _window: &Window,
            _output: &mut [u8],
        ) -> Result<(), EvaluateError> {
            match self.never {}
        }

        pub(crate) fn evaluate_keys(
            &self,
            _job: &KeyJob<'_>,
            _output: &mut [[f32; 4]],
        ) -> Result<(), EvaluateError> {
            match self.never {}
        }

        pub(crate) fn pass(
            &self,
            _kernel: Kernel,
            _inputs: &[&[u8]],
            _counts: [usize; 2],
            _output: &mut [[f32; 4]],
        ) -> Result<(), VulkanError> {
            match self.never {}
        }

        pub(crate) fn crowd_table<T: NoUninit>(
            &self,
            _name: &str,
            _table: &[T],
        ) -> Result<Never, VulkanError> {
            match self.never {}
        }

        pub(crate) fn known_kernels(&self) -> Vec<KernelCheck> {
            match self.never {}
        }

        pub(crate) fn check_kernels(
            &self,
            _only_unknown: bool,
            _each: &mut dyn FnMut(KernelCheck) -> bool,
        ) -> Result<(), VulkanError> {
            match self.never {}
        }
    }
}

pub(crate) mod self_test {
    use crate::gpu::engine::VulkanEngine;
    use crate::gpu::error::VulkanError;
    use crate::gpu::reports::NegativeControl;

    pub(crate) fn negative_control(engine: &VulkanEngine) -> Result<NegativeControl, VulkanError> {
        match engine.never {}
    }
}

pub(crate) mod recovery {
    use std::sync::Arc;

    use crate::gpu::Never;
    use crate::gpu::engine::VulkanEngine;
    use crate::gpu::error::{EvaluateError, VulkanError};
    use crate::gpu::job::ClipBuffers;
    use crate::gpu::options::EngineOptions;
    use crate::gpu::physical::{DeviceInfo, PhysicalDevice};
    use crate::gpu::reports::SelfTestReport;
    use crate::output::encoding::Encoding;
    use crate::prepare::clip_data::ClipData;
    use crate::shader::Form;

    pub(crate) struct Opened {
        pub(crate) self_tests: Vec<SelfTestReport>,
        pub(crate) info: DeviceInfo,
        never: Never,
    }

    impl Opened {
        pub(crate) fn new(
            physical: &PhysicalDevice,
            _options: &EngineOptions,
        ) -> Result<Self, VulkanError> {
            match physical.never {}
        }

        pub(crate) fn engine(&self) -> Arc<VulkanEngine> {
            match self.never {}
        }

        pub(crate) fn upload(
            &self,
            _clip: &ClipData,
            _spare: Option<ClipBuffers>,
        ) -> Result<ClipBuffers, EvaluateError> {
            match self.never {}
        }

        pub(crate) fn warm(&self, _form: Form, _encoding: Encoding) -> Result<(), EvaluateError> {
            match self.never {}
        }

        pub(crate) fn attempt_smaller<T>(
            &self,
            _work: impl FnMut(&VulkanEngine) -> Result<T, EvaluateError>,
        ) -> Result<T, EvaluateError> {
            match self.never {}
        }
    }
}

pub(crate) mod crowd {
    use std::sync::Arc;

    use crate::gpu::Never;
    use crate::gpu::engine::VulkanEngine;
    use crate::gpu::error::VulkanError;
    use crate::output::crowd::{CrowdFrame, CrowdOutput};
    use crate::work::crowd::CrowdShape;

    pub(crate) struct CrowdTables {
        pub(crate) instances: u32,
        pub(crate) shape: CrowdShape,
        pub(crate) clips: Never,
        pub(crate) bases: Never,
        pub(crate) spans: Never,
        pub(crate) channels: Never,
        pub(crate) cells: Never,
        pub(crate) links: Never,
        pub(crate) bind: Never,
    }

    pub(crate) struct DeviceCrowd {
        pub(crate) never: Never,
    }

    impl DeviceCrowd {
        pub(crate) fn new(
            engine: Arc<VulkanEngine>,
            _tables: CrowdTables,
        ) -> Result<Self, VulkanError> {
            match engine.never {}
        }
    }

    pub(crate) struct CrowdReader {
        pub(crate) results: Results,
    }

    pub(crate) struct Results {
        never: Never,
    }

    impl Results {
        pub(crate) fn is_done(&self) -> Result<bool, VulkanError> {
            match self.never {}
        }
    }

    impl CrowdReader {
        pub(crate) fn new(
            crowd: &Arc<DeviceCrowd>,
            _output: CrowdOutput,
            _room: u32,
        ) -> Result<Self, VulkanError> {
            match crowd.never {}
        }

        pub(crate) fn fits(&self, _output: CrowdOutput, _instances: u32) -> bool {
            match self.results.never {}
        }

        pub(crate) fn submit(&mut self, _frame: &CrowdFrame<'_>) -> Result<(), VulkanError> {
            match self.results.never {}
        }

        pub(crate) fn wait_into(&mut self, _output: &mut [u8]) -> Result<(), VulkanError> {
            match self.results.never {}
        }
    }
}
