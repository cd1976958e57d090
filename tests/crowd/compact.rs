//! Libraries whose clips are stored compactly give the bits of others.

use tumble::crowd::CrowdStorage;

use super::*;

/// Motion with close keys: most cubics follow from keys, and a few are segments. Some joints begin later or have another
/// sign somewhere.
fn close_keys(random: &mut Random, joints: usize, keys: usize) -> TrackSet {
    let mut set = TrackSet::new();
    for joint in 0..joints {
        let first = if joint % 5 == 4 { 2 } else { 0 };
        let times: Vec<f64> = (first..keys).map(|key| key as f64 / 30.0).collect();
        let mut rotation = random.rotation();
        let rotations: Vec<Quat> = (times.iter())
            .map(|_| {
                let angle = random.pick(&[0.01, 0.02, 0.03, 0.04, 0.05, 0.5]);
                let step = glam::DQuat::from_axis_angle(random.direction(), angle);
                rotation = (rotation * step).normalize();
                rotation.as_quat() * random.pick(&[1.0, 1.0, 1.0, -1.0])
            })
            .collect();
        set.push(format!("{joint}"), &times, &rotations).unwrap();
        if joint.is_multiple_of(4) {
            let keys: Vec<Vec3> = (times.iter())
                .map(|_| (random.direction() * 2.0).as_vec3())
                .collect();
            set.set_translations(joint, &times, &keys, &[]).unwrap();
        }
    }
    set
}

fn library_of(
    storage: CrowdStorage,
    joints: usize,
    methods: &[Method],
    vectors: VectorMethod,
) -> CrowdLibrary {
    let mut random = Random(19);
    let mut library = CrowdLibrary::new(&skeleton(&mut random, joints)).unwrap();
    library.set_storage(storage);
    for (index, &method) in methods.iter().enumerate() {
        let set = close_keys(&mut random, joints, 20 + 7 * index);
        library.push(&set, method, vectors).unwrap();
    }
    let weights: Vec<f32> = (0..joints).map(|joint| (joint % 3) as f32 / 2.0).collect();
    library.push_mask(&weights).unwrap();
    library
        .set_reference(0, methods.len() - 1, 300_000)
        .unwrap();
    let bind = vec![Affine3A::from_translation(Vec3::ONE); joints];
    library.set_inverse_bind(&bind).unwrap();
    library
}

/// On the CPU at every vector width, and on every Vulkan device with a kernel for each step and with one for whole
/// instances.
fn engines() -> Vec<(String, Engine)> {
    let widths = VectorWidth::available().into_iter().map(|width| {
        let mut options = EngineOptions::default();
        options.vector_width = Some(width);
        let engine = Engine::with_options(Device::Cpu, &options).unwrap();
        (format!("CPU, {width:?}"), engine)
    });
    let devices = vulkan_devices().into_iter().flat_map(|device| {
        [Mapping::Runs, Mapping::Samples].map(|mapping| {
            let mut options = EngineOptions::default();
            options.mapping = mapping;
            let engine = Engine::with_options(device.clone(), &options).unwrap();
            let name = engine.device_name().to_owned();
            (format!("{name}, {mapping:?}"), engine)
        })
    });
    widths.chain(devices).collect()
}

/// Arcs and cubics in three layers, one of which fades, in 32 and in 16 bits.
#[test]
fn compact_libraries_have_the_bits_of_whole_ones() {
    const JOINTS: usize = 18;
    const LAYERS: usize = 3;
    const INSTANCES: usize = 41;
    let methods = [method::BESSEL_OVERHAUSER, method::SLERP];
    let [whole, compact] = [CrowdStorage::Segments, CrowdStorage::Compact]
        .map(|storage| library_of(storage, JOINTS, &methods, VectorMethod::Linear));
    let [of_whole, of_compact] = [&whole, &compact].map(CrowdLibrary::bytes_per_key);
    assert!(of_compact < 0.7 * of_whole, "{of_compact}, {of_whole}");
    assert_eq!(compact.storage(), CrowdStorage::Compact);
    let mut random = Random(23);
    let plays: Vec<_> = (0..INSTANCES * LAYERS)
        .map(|slot| (slot / LAYERS, slot % LAYERS, layer(&mut random, &compact)))
        .map(|(instance, index, plays)| {
            let mask = plays.mask.map(|_| 0);
            (instance, index, plays.with_mask(mask))
        })
        .collect();
    // All values at some times.
    let evaluate = |mut crowd: Crowd| {
        crowd.set_all(&plays).unwrap();
        let mut found = Vec::new();
        for ticks in [0, 11_760, 1 << 33] {
            crowd.advance_ticks(ticks).unwrap();
            for values in ALL {
                found.push(bits(&evaluated(&mut crowd, values)));
                let mut half = vec![[0; 4]; crowd.output_len(values)];
                crowd.evaluate_half_into(values, &mut half).unwrap();
                found.push(half.iter().map(|value| value.map(u32::from)).collect());
            }
            crowd.fade(3, 1, 0.5, 1 << 34).unwrap();
        }
        found
    };
    let expected = evaluate(cpu().crowd(&whole, INSTANCES, LAYERS).unwrap());
    for (name, engine) in engines() {
        let found = evaluate(engine.crowd(&compact, INSTANCES, LAYERS).unwrap());
        for (index, (found, expected)) in found.iter().zip(&expected).enumerate() {
            let first = found.iter().zip(expected).position(|(a, b)| a != b);
            assert_eq!(first, None, "{name}, result {index}");
        }
    }
}

/// Motion tables of a compact library are those of the whole one.
#[test]
fn compact_libraries_become_motion_tables() {
    let methods = [method::SLERP, method::BESSEL_OVERHAUSER];
    let rotations = [CrowdStorage::Segments, CrowdStorage::Compact].map(|storage| {
        let library = library_of(storage, 6, &methods, VectorMethod::Linear);
        let (tables, spans, cells) = library.into_tables();
        let at: Vec<(u32, u32)> = (0..60).map(|i| (i % 2, 9_973 * i)).collect();
        let mut rotations = vec![[0.0; 4]; 6 * at.len()];
        let mut velocities = vec![[0.0; 3]; rotations.len()];
        let states = tumble::crowd::MotionStates {
            rotations: &mut rotations,
            velocities: &mut velocities,
            ..Default::default()
        };
        let parts = (&*spans, &*cells);
        tables.sample_into(&cpu(), parts, &at, states).unwrap();
        let velocities: Vec<_> = velocities.iter().map(|v| v.map(f32::to_bits)).collect();
        (bits(&rotations), velocities)
    });
    assert!(rotations[0] == rotations[1]);
}
