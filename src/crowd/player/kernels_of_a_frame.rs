//! Which kernels a device runs for a frame.

use glam::{Affine3A, Quat};

use crate::crowd::library::CrowdLibrary;
use crate::crowd::player::Crowd;
use crate::crowd::player::application_device::vulkan_crowd;
use crate::device::Device;
use crate::engine::Engine;
use crate::machine::options::{EngineOptions, Mapping};
use crate::method::slerp::SLERP;
use crate::method::vector_method::VectorMethod;
use crate::output::crowd::{CrowdOutput, CrowdValues};
use crate::pose::skeleton::Skeleton;
use crate::shader::Kernel;
use crate::tracks::set::TrackSet;

/// An instance of so many joints, each with a time base if there are many.
fn crowd(mapping: Mapping, joints: usize, layers: usize, has_many_bases: bool) -> Vec<Crowd> {
    let skeleton = Skeleton::chain(joints, 1.0).unwrap();
    let mut library = CrowdLibrary::new(&skeleton).unwrap();
    let mut set = TrackSet::new();
    for joint in 0..joints {
        let first = if has_many_bases { joint as f64 } else { 0.0 };
        let keys = [0.0, 1.0].map(Quat::from_rotation_x);
        set.push("", &[first, first + 1.5], &keys).unwrap();
    }
    library.push(&set, SLERP, VectorMethod::Linear).unwrap();
    library
        .set_inverse_bind(&vec![Affine3A::IDENTITY; joints])
        .unwrap();
    let devices = Device::list().unwrap_or_default();
    let crowds = devices.into_iter().map(|device| {
        let options = EngineOptions {
            mapping,
            ..EngineOptions::default()
        };
        let engine = Engine::with_options(device, &options).unwrap();
        engine.crowd(&library, 1, layers).unwrap()
    });
    crowds.collect()
}

/// The kernels of an output, by their names.
fn kernels(crowd: &Crowd, output: CrowdOutput) -> Vec<&'static str> {
    let device = vulkan_crowd(crowd.device.as_deref()).expect("a Vulkan device");
    let kernels = device.kernels(output).kernels.into_iter();
    kernels.map(|kernel: Kernel| kernel.code(false).0).collect()
}

#[test]
fn a_frame_of_small_instances_is_one_kernel_on_cards() {
    use CrowdValues::{Local, Model, Rotations, Skinning};
    for crowd in crowd(Mapping::Samples, 128, 1, false) {
        for output in [CrowdOutput::from, CrowdOutput::half] {
            let rotations = ["crowd_plain_whole_rotations"];
            assert_eq!(kernels(&crowd, output(Rotations)), rotations);
            for values in [Local, Model, Skinning] {
                let matrices = ["crowd_plain_whole_matrices"];
                assert_eq!(kernels(&crowd, output(values)), matrices);
            }
        }
    }
    for crowd in crowd(Mapping::Samples, 20, 2, false) {
        let found = kernels(&crowd, CrowdOutput::half(Skinning));
        assert_eq!(found, ["crowd_whole_matrices"]);
        let found = kernels(&crowd, Rotations.into());
        assert_eq!(found, ["crowd_whole_rotations"]);
    }
}

#[test]
fn large_instances_and_software_devices_have_a_kernel_for_each_step() {
    use CrowdValues::{Rotations, Skinning};
    let skinning = CrowdOutput::half(Skinning);
    let steps = |walk| {
        let [times, locals] = ["crowd_times", "crowd_plain_locals"];
        [times, locals, walk, "crowd_skin", "crowd_half"]
    };
    for crowd in crowd(Mapping::Samples, 129, 1, false) {
        assert_eq!(kernels(&crowd, skinning), steps("crowd_walk"));
    }
    // As many time bases as there are joints.
    for crowd in crowd(Mapping::Samples, 33, 4, true) {
        let [times, _, walk, skin, half] = steps("crowd_walk_all");
        let found = kernels(&crowd, skinning);
        assert_eq!(found, [times, "crowd_locals", walk, skin, half]);
    }
    for crowd in crowd(Mapping::Runs, 20, 1, false) {
        assert_eq!(kernels(&crowd, skinning), steps("crowd_walk"));
        let rotations = ["crowd_times", "crowd_plain_rotations"];
        assert_eq!(kernels(&crowd, Rotations.into()), rotations);
    }
}
