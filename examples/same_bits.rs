//! Evaluates a generated set on the CPU and on every Vulkan device, and counts the
//! rotations whose bits differ.
//!
//! `cargo run --release --example same_bits`

use tumble::{Device, Engine, METHODS, SampleTimes};
use tumble_formats::generate::{Generate, KeySpacing};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let set = Generate {
        box_count: 1000,
        spacing: KeySpacing::Random,
        ..Generate::default()
    }
    .track_set()?;
    let frames = SampleTimes::fps(60);
    let cpu = Engine::new(Device::Cpu)?;
    for device in Device::list()? {
        let vulkan = Engine::new(device)?;
        for method in METHODS {
            let expected = cpu.evaluate(&set, method, &frames)?;
            let found = vulkan.evaluate(&set, method, &frames)?;
            let bits = |q: &glam::Quat| q.to_array().map(f32::to_bits);
            let pairs = expected.as_quats().iter().zip(found.as_quats());
            let differing = pairs.filter(|(a, b)| bits(a) != bits(b)).count();
            let total = expected.as_quats().len();
            println!(
                "{}, {method}: {differing} of {total} differ",
                vulkan.device_name()
            );
        }
    }
    Ok(())
}
