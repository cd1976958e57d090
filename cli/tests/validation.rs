//! The Khronos validation layer over all that the program does (the library: `tests/validation.rs`): core and
//! synchronization checks, and checks on the device itself (GPU-assisted), which a newer layer does better; Debian's
//! `chromium` package brings one. Each kind of check must first find a planted fault, because a layer that does not
//! work reports nothing either.
#![allow(unsafe_code)] // the planted faults

use std::process::Command;

use crate::application::Application;
use crate::layer::Layer;
use crate::program::sample_folder;
use ash::vk;

/// Runs a test of this file in a process of its own, under a layer.
fn under(layer: &Layer, test: &str, plant: &str) -> Vec<String> {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", test, "--ignored", "--nocapture"]);
    layer.messages(command.env("PLANT", plant))
}

#[test]
fn each_kind_of_check_finds_its_planted_fault() {
    for layer in Layer::all() {
        assert_eq!(
            under(&layer, "validation::planted_fault", "none"),
            Vec::<String>::new()
        );
        for (plant, sign) in layer.planted {
            let messages = under(&layer, "validation::planted_fault", plant);
            let found = messages.iter().any(|line| line.contains(sign));
            assert!(found, "{}, {plant}: {messages:?}", layer.name);
        }
    }
}

/// All that the program does on Vulkan: all methods, forms, layouts and sources of times.
#[test]
fn no_layer_has_anything_to_say_of_the_program() {
    let folder = sample_folder();
    let lines: [&[&str]; 5] = [
        &["verify", "a.dat", "-m", "all", "--device", "vulkan"],
        &[
            "eval",
            "a.dat",
            "-o",
            "o.npy",
            "--fps",
            "1000000",
            "--overwrite",
        ],
        &[
            "eval",
            "a.dat",
            "-o",
            "o.npy",
            "--times",
            "t.txt",
            "--layout",
            "frame",
            "--overwrite",
        ],
        &[
            "eval",
            "a.dat",
            "-o",
            "o.npy",
            "--quantity",
            "world",
            "--overwrite",
        ],
        &[
            "eval",
            "a.dat",
            "-o",
            "o.npy",
            "--memory",
            "1MiB",
            "--fps",
            "100000",
            "--overwrite",
        ],
    ];
    for layer in Layer::all() {
        for line in lines {
            let messages = layer.messages(&mut crate::program::command(
                folder.path(),
                &on_vulkan(line),
            ));
            assert_eq!(messages, Vec::<String>::new(), "{}: {line:?}", layer.name);
        }
    }
}

/// The line, on a Vulkan device where it names none.
fn on_vulkan<'a>(line: &[&'a str]) -> Vec<&'a str> {
    if line.contains(&"--device") {
        line.to_vec()
    } else {
        [line, &["--device", "vulkan"]].concat()
    }
}

/// The test above runs this in a separate process.
#[test]
#[ignore = "plants a fault; run by each_kind_of_check_finds_its_planted_fault"]
fn planted_fault() {
    let application = Application::new();
    let device = &application.device;
    match std::env::var("PLANT").as_deref() {
        Ok("core") => {
            let info = vk::BufferCreateInfo::default()
                .size(0)
                .usage(vk::BufferUsageFlags::STORAGE_BUFFER);
            // SAFETY: a fault on purpose, which the layer catches and drivers bear.
            unsafe {
                if let Ok(buffer) = device.create_buffer(&info, None) {
                    device.destroy_buffer(buffer, None);
                }
            }
        }
        Ok("synchronization") => run(&application, |commands, buffer| {
            // SAFETY: two fills with no barrier between them: a race on purpose.
            unsafe {
                device.cmd_fill_buffer(commands, buffer, 0, 64, 1);
                device.cmd_fill_buffer(commands, buffer, 0, 64, 2);
            }
        }),
        Ok("bounds") => dispatch(&application, 4096),
        Ok("none") => dispatch(&application, 3),
        plant => println!("nothing is planted: {plant:?}"),
    }
}

/// Records some commands on a buffer of 64 bytes, and runs them.
fn run(application: &Application, record: impl FnOnce(vk::CommandBuffer, vk::Buffer)) {
    let device = &application.device;
    let (buffer, memory) = application.buffer(64);
    // SAFETY: plain use of a device that is alive; everything is waited for and destroyed.
    unsafe {
        let pool = device
            .create_command_pool(&vk::CommandPoolCreateInfo::default(), None)
            .unwrap();
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(pool)
            .command_buffer_count(1);
        let commands = device.allocate_command_buffers(&info).unwrap();
        device
            .begin_command_buffer(commands[0], &vk::CommandBufferBeginInfo::default())
            .unwrap();
        record(commands[0], buffer);
        device.end_command_buffer(commands[0]).unwrap();
        let submit = [vk::SubmitInfo::default().command_buffers(&commands)];
        device
            .queue_submit(application.queue, &submit, vk::Fence::null())
            .unwrap();
        device.device_wait_idle().unwrap();
        device.destroy_command_pool(pool, None);
        device.destroy_buffer(buffer, None);
        device.free_memory(memory, None);
    }
}

/// A kernel that writes one number into a buffer of 16, at the index given.
fn dispatch(application: &Application, index: u32) {
    let source = "
        @group(0) @binding(0) var<storage, read_write> values: array<u32>;
        var<immediate> index: u32;
        @compute @workgroup_size(1) fn main() { values[index] = 1u; }";
    let module = naga::front::wgsl::parse_str(source).unwrap();
    let info = naga::valid::Validator::new(
        naga::valid::ValidationFlags::all(),
        naga::valid::Capabilities::IMMEDIATES,
    )
    .validate(&module)
    .unwrap();
    let mut options = naga::back::spv::Options {
        lang_version: (1, 3),
        ..Default::default()
    };
    options.bounds_check_policies.buffer = naga::proc::BoundsCheckPolicy::Unchecked;
    let code = naga::back::spv::write_vec(&module, &info, &options, None).unwrap();
    let device = &application.device;
    // SAFETY: plain use of a device that is alive; the store may be out of bounds, on
    // purpose, by less than the memory behind the buffer bears.
    unsafe {
        let binding = [vk::DescriptorSetLayoutBinding::default()
            .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
            .descriptor_count(1)
            .stage_flags(vk::ShaderStageFlags::COMPUTE)];
        let set_layouts = [device
            .create_descriptor_set_layout(
                &vk::DescriptorSetLayoutCreateInfo::default().bindings(&binding),
                None,
            )
            .unwrap()];
        let constants = [vk::PushConstantRange::default()
            .stage_flags(vk::ShaderStageFlags::COMPUTE)
            .size(4)];
        let info = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(&set_layouts)
            .push_constant_ranges(&constants);
        let layout = device.create_pipeline_layout(&info, None).unwrap();
        let module = device
            .create_shader_module(&vk::ShaderModuleCreateInfo::default().code(&code), None)
            .unwrap();
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module)
            .name(c"main");
        let info = [vk::ComputePipelineCreateInfo::default()
            .stage(stage)
            .layout(layout)];
        let pipeline = device
            .create_compute_pipelines(vk::PipelineCache::null(), &info, None)
            .unwrap()[0];
        let sizes = [vk::DescriptorPoolSize::default()
            .ty(vk::DescriptorType::STORAGE_BUFFER)
            .descriptor_count(1)];
        let info = vk::DescriptorPoolCreateInfo::default()
            .max_sets(1)
            .pool_sizes(&sizes);
        let pool = device.create_descriptor_pool(&info, None).unwrap();
        let info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(pool)
            .set_layouts(&set_layouts);
        let sets = device.allocate_descriptor_sets(&info).unwrap();
        run(application, |commands, buffer| {
            let buffers = [vk::DescriptorBufferInfo::default().buffer(buffer).range(64)];
            let write = vk::WriteDescriptorSet::default()
                .dst_set(sets[0])
                .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
                .buffer_info(&buffers);
            device.update_descriptor_sets(&[write], &[]);
            let compute = vk::PipelineBindPoint::COMPUTE;
            device.cmd_bind_pipeline(commands, compute, pipeline);
            device.cmd_bind_descriptor_sets(commands, compute, layout, 0, &sets, &[]);
            let bytes = index.to_le_bytes();
            let stage = vk::ShaderStageFlags::COMPUTE;
            device.cmd_push_constants(commands, layout, stage, 0, &bytes);
            device.cmd_dispatch(commands, 1, 1, 1);
        });
        device.destroy_descriptor_pool(pool, None);
        device.destroy_pipeline(pipeline, None);
        device.destroy_shader_module(module, None);
        device.destroy_pipeline_layout(layout, None);
        device.destroy_descriptor_set_layout(set_layouts[0], None);
    }
}
