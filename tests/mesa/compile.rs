//! Compiles the engine's kernels with the driver of this process, and writes the results into
//! files. Runs in a separate process, because a driver reads its environment once.
#![allow(unsafe_code)] // a device that the engine does not open: it cannot compute

use std::collections::BTreeMap;
use std::ffi::CStr;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use ash::{khr, vk};
use tumble::Device;
use tumble_exact::{FloatControls, float_controls, without_decorations};

/// Where the child writes its listings.
const FOLDER: &str = "MESA_LISTINGS";
/// The kernels to compile, separated by spaces; all if it is not set.
const KERNELS: &str = "MESA_KERNELS";
/// Set if the exactness pass is to be undone.
const BARE: &str = "MESA_WITHOUT_THE_PASS";

/// The line before each representation of a kernel.
const REPRESENTATION: &str = "#### ";

#[test]
#[ignore = "compiles for the driver of its environment; run by the tests of mesa::radv and mesa::nvk"]
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
        let controls = FloatControls::default()
            .with_preserve_signed_zero_inf_nan(info.preserves_signed_zero_inf_nan)
            .with_round_to_nearest_even(info.rounds_to_nearest_even);
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
            // The feature that the kernels that read texels declare.
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

    /// Compiles a module, and prints the driver's information about it: a line for each statistic,
    /// then every representation after a line with its name.
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

/// The listings of kernels as a driver compiles them (all kernels where none is named), with their names, made in a
/// process of its own. `program` runs this program with the driver; `is_bare` undoes the exactness pass.
pub(super) fn listings(
    program: &mut Command,
    label: &str,
    kernels: &[&str],
    is_bare: bool,
) -> Vec<(String, String)> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("mesa-{label}"));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    program
        .args(["--exact", "mesa::compile::every_kernel"])
        .args(["--ignored", "--nocapture"])
        .env(FOLDER, &folder)
        .env("XDG_RUNTIME_DIR", &folder)
        .env_remove(KERNELS)
        .env_remove(BARE);
    if !kernels.is_empty() {
        program.env(KERNELS, kernels.join(" "));
    }
    if is_bare {
        program.env(BARE, "1");
    }
    let output = program.output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{label}: {said}{errors}");
    let named = tumble::vulkan::kernels().map(|(name, _)| name);
    let named = named.filter(|name| kernels.is_empty() || kernels.contains(name));
    let texts = named.map(|name| {
        let text = std::fs::read_to_string(folder.join(name)).unwrap();
        (name.to_owned(), text)
    });
    let texts = texts.collect();
    std::fs::remove_dir_all(&folder).unwrap();
    texts
}

/// This program, to be run as another process.
pub(super) fn this_program() -> Command {
    Command::new(std::env::current_exe().unwrap())
}

/// The statistics before the representations, by their names.
pub(super) fn statistics(text: &str) -> BTreeMap<String, u64> {
    let (head, _) = text.split_once(REPRESENTATION).expect("representations");
    let statistics = head.lines().filter_map(|line| {
        let (name, value) = line.split_once(" = ")?;
        Some((name.to_owned(), value.parse().ok()?))
    });
    statistics.collect()
}

/// The representations, by their names.
pub(super) fn representations(text: &str) -> BTreeMap<&str, &str> {
    text.split(REPRESENTATION)
        .skip(1)
        .map(|part| part.split_once('\n').expect("a line with the name"))
        .collect()
}

/// How often a kernel divides whole numbers, where its functions are put into their callers. Graphics cards have no such
/// division: their compilers make it of a reciprocal, taken to a whole number, and of exact steps that make good what
/// that lacks.
pub(super) fn divisions(kernel: &str) -> usize {
    const ENTRY_POINT: u32 = 15;
    const FUNCTION: u32 = 54;
    const CALL: u32 = 57;
    const DIVISION: u32 = 134;
    const REMAINDER: u32 = 137;
    let code = tumble::vulkan::kernels()
        .find(|(name, _)| *name == kernel)
        .unwrap()
        .1;
    let words = code
        .chunks_exact(4)
        .map(|word| u32::from_le_bytes(word.try_into().unwrap()));
    let words: Vec<u32> = words.collect();
    let (mut offset, mut main, mut function) = (5, 0, 0);
    // The number of divisions of each function, and the functions that it calls.
    let mut functions = BTreeMap::<u32, (usize, Vec<u32>)>::new();
    while let Some(&word) = words.get(offset) {
        let body = functions.entry(function).or_default();
        match word & 0xffff {
            ENTRY_POINT => main = words[offset + 2],
            FUNCTION => function = words[offset + 2],
            CALL => body.1.push(words[offset + 3]),
            DIVISION | REMAINDER => body.0 += 1,
            _ => {}
        }
        offset += (word >> 16).max(1) as usize;
    }
    fn within(function: u32, functions: &BTreeMap<u32, (usize, Vec<u32>)>) -> usize {
        let (divisions, calls) = &functions[&function];
        let called = calls.iter().map(|&called| within(called, functions));
        divisions + called.sum::<usize>()
    }
    within(main, &functions)
}
