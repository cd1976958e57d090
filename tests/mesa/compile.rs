//! Compiles the engine's kernels with the driver of this process, and writes the results into
//! files. Runs in a separate process, because a driver reads its environment once.
#![allow(unsafe_code)] // a device that the engine does not open: it cannot compute

use std::ffi::CStr;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use crate::spirv::exactness::spirv::{FloatControls, float_controls, without_decorations};
use ash::{khr, vk};
use tumble::Device;

/// Where the child writes its listings.
pub(super) const FOLDER: &str = "MESA_LISTINGS";
/// The kernels to compile, with spaces between them; all where it is not set.
pub(super) const KERNELS: &str = "MESA_KERNELS";
/// Set where the exactness pass is to be undone.
pub(super) const BARE: &str = "MESA_WITHOUT_THE_PASS";

/// The line before each representation of a kernel.
pub(super) const REPRESENTATION: &str = "#### ";

#[test]
#[ignore = "compiles for the driver of its environment; run by the tests of mesa::radv"]
fn every_kernel() {
    let folder = PathBuf::from(std::env::var_os(FOLDER).expect("set by the test that runs it"));
    let requested = std::env::var(KERNELS).ok();
    let is_bare = std::env::var_os(BARE).is_some();
    let compiler = Compiler::new();
    for (name, code) in tumble::vulkan::kernels() {
        if let Some(requested) = &requested
            && !requested.split(' ').any(|kernel| kernel == name)
        {
            continue;
        }
        let words = words(code);
        let words = match is_bare {
            true => without_decorations(&words).unwrap(),
            false => float_controls(&words, compiler.controls).unwrap(),
        };
        let listing = compiler.listing(name.ends_with("_texels"), &words);
        std::fs::write(folder.join(name), listing).unwrap();
    }
}

fn words(code: &[u8]) -> Vec<u32> {
    let words = code.chunks_exact(4);
    words
        .map(|bytes| u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
        .collect()
}

/// The first device of the driver, open for compiling.
struct Compiler {
    /// The controls that the engine adds on it.
    controls: FloatControls,
    executables: khr::pipeline_executable_properties::Device,
    device: ash::Device,
    instance: ash::Instance,
    _entry: ash::Entry,
}

impl Compiler {
    fn new() -> Self {
        let devices = Device::list().unwrap();
        let [Device::Vulkan(device)] = &*devices else {
            panic!("one driver with one device, not {devices:?}");
        };
        let info = device.info();
        let controls = FloatControls {
            preserve_signed_zero_inf_nan: info.preserves_signed_zero_inf_nan,
            round_to_nearest_even: info.rounds_to_nearest_even,
        };
        println!("{}, {}, {controls:?}", info.name, info.driver);
        // SAFETY: plain creation; everything is destroyed in `drop`, and what is chained lives
        // until the call is over.
        unsafe {
            let entry = ash::Entry::load().unwrap();
            let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
            let create = vk::InstanceCreateInfo::default().application_info(&application);
            let instance = entry.create_instance(&create, None).unwrap();
            let physical = instance.enumerate_physical_devices().unwrap()[0];
            let queues = [vk::DeviceQueueCreateInfo::default()
                .queue_family_index(0)
                .queue_priorities(&[1.0])];
            let extensions = [khr::pipeline_executable_properties::NAME.as_ptr()];
            let mut reports = vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default()
                .pipeline_executable_info(true);
            // What the kernels that read texels declare.
            let features = vk::PhysicalDeviceFeatures::default().shader_int64(true);
            let create = vk::DeviceCreateInfo::default()
                .queue_create_infos(&queues)
                .enabled_extension_names(&extensions)
                .enabled_features(&features)
                .push_next(&mut reports);
            let device = instance.create_device(physical, &create, None).unwrap();
            Self {
                controls,
                executables: khr::pipeline_executable_properties::Device::new(&instance, &device),
                device,
                instance,
                _entry: entry,
            }
        }
    }

    /// Compiles a module, and says what the driver says of it: a line for each statistic, then
    /// every representation after a line with its name.
    fn listing(&self, reads_texels: bool, words: &[u32]) -> String {
        let bindings = binding_count(words);
        let kind = |binding| match reads_texels && binding + 1 < bindings {
            true => vk::DescriptorType::UNIFORM_TEXEL_BUFFER,
            false => vk::DescriptorType::STORAGE_BUFFER,
        };
        let bindings: Vec<_> = (0..bindings)
            .map(|binding| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding)
                    .descriptor_type(kind(binding))
                    .descriptor_count(1)
                    .stage_flags(vk::ShaderStageFlags::COMPUTE)
            })
            .collect();
        let device = &self.device;
        // SAFETY: the device is alive, the module is the engine's and fits the layout, and what is
        // created is destroyed at the end.
        unsafe {
            let create = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
            let sets = [device.create_descriptor_set_layout(&create, None).unwrap()];
            let constants = [vk::PushConstantRange::default()
                .stage_flags(vk::ShaderStageFlags::COMPUTE)
                .size(128)]; // what every device has
            let create = vk::PipelineLayoutCreateInfo::default()
                .set_layouts(&sets)
                .push_constant_ranges(&constants);
            let layout = device.create_pipeline_layout(&create, None).unwrap();
            let create = vk::ShaderModuleCreateInfo::default().code(words);
            let module = device.create_shader_module(&create, None).unwrap();
            let stage = vk::PipelineShaderStageCreateInfo::default()
                .stage(vk::ShaderStageFlags::COMPUTE)
                .module(module)
                .name(c"main");
            let create = [vk::ComputePipelineCreateInfo::default()
                .flags(
                    vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR
                        | vk::PipelineCreateFlags::CAPTURE_INTERNAL_REPRESENTATIONS_KHR,
                )
                .stage(stage)
                .layout(layout)];
            let cache = vk::PipelineCache::null();
            let pipeline = device
                .create_compute_pipelines(cache, &create, None)
                .unwrap()[0];
            let text = self.reports(pipeline);
            device.destroy_pipeline(pipeline, None);
            device.destroy_shader_module(module, None);
            device.destroy_pipeline_layout(layout, None);
            device.destroy_descriptor_set_layout(sets[0], None);
            text
        }
    }

    /// # Safety
    /// The pipeline is this device's, with statistics and representations captured.
    unsafe fn reports(&self, pipeline: vk::Pipeline) -> String {
        let mut text = String::new();
        let of = vk::PipelineInfoKHR::default().pipeline(pipeline);
        // SAFETY: as above.
        let executables = unsafe { self.executables.get_pipeline_executable_properties(&of) };
        assert_eq!(executables.unwrap().len(), 1, "one compute shader");
        let of = vk::PipelineExecutableInfoKHR::default().pipeline(pipeline);
        // SAFETY: as above.
        let statistics = unsafe { self.executables.get_pipeline_executable_statistics(&of) };
        for statistic in statistics.unwrap() {
            if statistic.format == vk::PipelineExecutableStatisticFormatKHR::UINT64 {
                let name = statistic.name_as_c_str().unwrap().to_str().unwrap();
                // SAFETY: the format says which field was written.
                let value = unsafe { statistic.value.u64 };
                writeln!(text, "{name} = {value}").unwrap();
            }
        }
        let get = (self.executables.fp()).get_pipeline_executable_internal_representations_khr;
        let mut count = 0;
        // SAFETY: asks for the number of representations, then for the size of each, then for the
        // bytes, into memory of that size which lives until the end.
        unsafe {
            let handle = self.device.handle();
            let null = std::ptr::null_mut();
            get(handle, &raw const of, &raw mut count, null)
                .result()
                .unwrap();
            let empty = vk::PipelineExecutableInternalRepresentationKHR::default();
            let mut all = vec![empty; count as usize];
            get(handle, &raw const of, &raw mut count, all.as_mut_ptr())
                .result()
                .unwrap();
            let mut bytes: Vec<Vec<u8>> = all
                .iter()
                .map(|representation| vec![0; representation.data_size])
                .collect();
            for (representation, bytes) in all.iter_mut().zip(&mut bytes) {
                representation.p_data = bytes.as_mut_ptr().cast();
            }
            get(handle, &raw const of, &raw mut count, all.as_mut_ptr())
                .result()
                .unwrap();
            for (representation, bytes) in all.iter().zip(&bytes) {
                let name = representation.name_as_c_str().unwrap().to_str().unwrap();
                let words = CStr::from_bytes_until_nul(bytes).unwrap().to_string_lossy();
                write!(text, "{REPRESENTATION}{name}\n{words}\n").unwrap();
            }
        }
        text
    }
}

/// How many buffers a module binds: the largest binding and one more.
fn binding_count(module: &[u32]) -> u32 {
    const DECORATE: u32 = 71;
    const BINDING: u32 = 33;
    let mut rest = &module[5..];
    let mut count = 0;
    while let Some(&first) = rest.first() {
        let (instruction, tail) = rest.split_at((first >> 16) as usize);
        if let [_, _, BINDING, binding] = *instruction
            && first & 0xffff == DECORATE
        {
            count = count.max(binding + 1);
        }
        rest = tail;
    }
    count
}

impl Drop for Compiler {
    fn drop(&mut self) {
        // SAFETY: nothing that was created from either is left.
        unsafe {
            self.device.destroy_device(None);
            self.instance.destroy_instance(None);
        }
    }
}

/// A process of this program that compiles the kernels named, all where none is, and leaves a file
/// for each in `folder`.
pub(super) fn child(folder: &Path, kernels: &[&str], is_bare: bool) -> std::process::Command {
    let mut command = std::process::Command::new(std::env::current_exe().unwrap());
    command
        .args(["--exact", "mesa::compile::every_kernel"])
        .args(["--ignored", "--nocapture"])
        .env(FOLDER, folder)
        .env_remove(KERNELS)
        .env_remove(BARE);
    if !kernels.is_empty() {
        command.env(KERNELS, kernels.join(" "));
    }
    if is_bare {
        command.env(BARE, "1");
    }
    command
}
