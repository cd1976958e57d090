//! The claim itself: every device gives the CPU's bits.

mod support;

use support::{first_difference, hostile_set, vulkan_devices};
use tumble::{Device, Engine, Frames, Interpolation, METHODS};

#[test]
fn fifty_million_hostile_rotations_have_the_same_bits() {
    let cpu = Engine::new(Device::Cpu).unwrap();
    for device in vulkan_devices() {
        let vulkan = Engine::new(device).unwrap();
        let mut compared = 0;
        let mut seed = 1;
        while compared < 50_000_000 {
            let set = hostile_set(seed, 256);
            for method in METHODS {
                let frames = Frames::fps(60).between(-1.0, 100.0);
                let t = std::time::Instant::now();
                let expected = cpu.upload(&set, method).unwrap();
                let a=t.elapsed();
                let expected = expected.evaluate(&frames).unwrap();
                let b=t.elapsed();
                let found = vulkan.upload(&set, method).unwrap();
                let c=t.elapsed();
                let found = found.evaluate(&frames).unwrap();
                let d=t.elapsed();
                let place = first_difference(expected.as_quats(), found.as_quats());
                eprintln!("{method} {} cpu prep {a:?} eval {:?} gpu prep {:?} eval {:?}", expected.as_quats().len(), b-a, c-b, d-c);
                assert_eq!(place, None, "{method}, seed {seed}, {}", vulkan.device_name());
                compared += expected.as_quats().len();
            }
            seed += 1;
        }
        let _: Interpolation = METHODS[0].into();
    }
}
