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

/// At every vector width and on every device, with a kernel for each step and with one for whole instances; with one
/// layer and with several, which fade; in 32 and in 16 bits.
#[test]
fn compact_libraries_have_the_bits_of_whole_ones() {
    let mut random = Random(23);
    for (joints, layers, methods, vectors) in [
        (19, 1, &[method::SLERP][..], VectorMethod::Linear),
        (
            18,
            3,
            &[method::BESSEL_OVERHAUSER, method::SLERP, method::C2][..],
            VectorMethod::CatmullRom,
        ),
    ] {
        let [whole, compact] = [CrowdStorage::Segments, CrowdStorage::Compact]
            .map(|storage| library_of(storage, joints, methods, vectors));
        let [of_whole, of_compact] = [&whole, &compact].map(CrowdLibrary::bytes_per_key);
        assert!(of_compact < 0.7 * of_whole, "{of_compact}, {of_whole}");
        assert_eq!(compact.storage(), CrowdStorage::Compact);
        const INSTANCES: usize = 41;
        let plays: Vec<_> = (0..INSTANCES * layers)
            .map(|slot| (slot / layers, slot % layers, layer(&mut random, &whole)))
            .map(|(instance, index, plays)| (instance, index, plays.with_mask(None)))
            .collect();
        let mut expected_crowd = cpu().crowd(&whole, INSTANCES, layers).unwrap();
        let mut all = crowds(&compact, INSTANCES, layers);
        for (_, crowd) in &mut all {
            crowd.set_all(&plays).unwrap();
        }
        expected_crowd.set_all(&plays).unwrap();
        for (step, ticks) in [0, 11_760, 1 << 33].into_iter().enumerate() {
            let moved = |crowd: &mut Crowd| {
                crowd.advance_ticks(ticks).unwrap();
                if layers > 1 && step == 1 {
                    crowd.fade(3, 1, 0.5, 1 << 34).unwrap();
                }
            };
            moved(&mut expected_crowd);
            let expected = ALL.map(|values| bits(&evaluated(&mut expected_crowd, values)));
            let mut half = vec![[0; 4]; expected_crowd.output_len(CrowdValues::Model)];
            expected_crowd
                .evaluate_half_into(CrowdValues::Model, &mut half)
                .unwrap();
            for (name, crowd) in &mut all {
                moved(crowd);
                for (values, expected) in ALL.into_iter().zip(&expected) {
                    let found = bits(&evaluated(crowd, values));
                    let first = found.iter().zip(expected).position(|(a, b)| a != b);
                    assert_eq!(first, None, "{name}, {values:?}, {methods:?}, step {step}");
                }
                let mut found = vec![[0; 4]; half.len()];
                crowd
                    .evaluate_half_into(CrowdValues::Model, &mut found)
                    .unwrap();
                assert!(found == half, "{name}, 16 bits");
            }
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
