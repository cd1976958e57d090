//! The engine without its feature `vulkan`: no device is listed, and the CPU evaluates.

use std::f32::consts::FRAC_PI_2;

use tumble::glam::Quat;
use tumble::{Device, Engine, Frames, TrackSet, method};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let error = Device::list().expect_err("no device");
    assert!(
        error.to_string().contains("the feature `vulkan`"),
        "{error}"
    );

    let mut set = TrackSet::new();
    let keys = [0.0, FRAC_PI_2].map(Quat::from_rotation_z);
    set.push("door", &[0.0, 1.0], &keys)?;
    for engine in [Engine::auto()?, Engine::new(Device::Cpu)?] {
        assert_eq!(engine.device_name(), "CPU");
        let rotations = engine.evaluate(&set, method::SLERP, &Frames::fps(2))?;
        let half = rotations.get(0, 1).ok_or("three samples")?;
        assert!(
            half.angle_between(Quat::from_rotation_z(FRAC_PI_2 / 2.0)) < 1e-6,
            "{half}"
        );
        assert_eq!(rotations.get(0, 2), Some(keys[1]));
    }
    println!("the engine without Vulkan evaluates on the CPU");
    Ok(())
}
