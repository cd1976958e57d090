//! The engine without its feature `vulkan`: no device is listed, and the CPU evaluates.
//!
//! `without-vulkan golden` evaluates the cases of the recorded hashes at every vector width, on whatever
//! processor and system it was compiled for (`scripts/platforms.sh`).

use std::env;
use std::error::Error;
use std::f32::consts::FRAC_PI_2;

use tumble::glam::Quat;
use tumble::{Device, Engine, EngineOptions, SampleTimes, TrackSet, VectorWidth, method};
use tumble_verify::golden::Golden;

fn main() -> Result<(), Box<dyn Error>> {
    match env::args().nth(1).as_deref() {
        None => door(),
        Some("golden") => golden(),
        Some(other) => Err(format!("`{other}` is not known; there is `golden`").into()),
    }
}

fn door() -> Result<(), Box<dyn Error>> {
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
        let rotations = engine.evaluate(&set, method::SLERP, &SampleTimes::fps(2))?;
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

fn golden() -> Result<(), Box<dyn Error>> {
    let golden = Golden::new();
    let widths = VectorWidth::available();
    let mut differing = 0;
    for &width in &widths {
        let mut options = EngineOptions::default();
        options.vector_width = Some(width);
        let engine = Engine::with_options(Device::Cpu, &options)?;
        for case in 0..golden.case_count() {
            let name = golden.name(case);
            let recorded = Golden::recorded(name).ok_or(format!("{name}: no hash is recorded"))?;
            let found = golden.evaluate(case, &engine)?.hash;
            if found != recorded {
                differing += 1;
                println!("{name}: {found} at {width:?}, recorded is {recorded}");
            }
        }
    }
    let compared = golden.case_count() * widths.len();
    println!(
        "{compared} results of {} {} compared with the recorded hashes ({} cases at {widths:?}): {differing} differ",
        env::consts::ARCH,
        env::consts::OS,
        golden.case_count(),
    );
    match (compared, differing) {
        (0, _) => Err("nothing was compared".into()),
        (_, 0) => Ok(()),
        _ => Err(format!("{differing} results differ").into()),
    }
}
