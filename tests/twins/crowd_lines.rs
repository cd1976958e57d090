//! Counts the lines of memory that the waves of a card touch when they evaluate whole instances of a crowd, as
//! `lines.rs` does. The results must be the CPU's.

use fastrand::Rng;
use glam::{Affine3A, Vec3};

use crate::crowd::compact::CrowdStorage;
use crate::crowd::layer::CrowdLayer;
use crate::crowd::library::CrowdLibrary;
use crate::machine::crowd::CrowdCurves;
use crate::method::Method;
use crate::method::bessel_overhauser::BESSEL_OVERHAUSER;
use crate::method::slerp::SLERP;
use crate::method::vector_method::VectorMethod;
use crate::output::crowd::{CrowdOutput, CrowdValues};
use crate::pose::skeleton::Skeleton;
use crate::shader::{CrowdDispatch, Kernel};
use crate::tracks::set::TrackSet;
use crate::twin::machine::Memory;
use crate::work::subgroup_instances::SubgroupInstances;
use crate::work::whole_instances::WholeInstances;
use crate::{Device, Engine};

use super::lines::{CARDS, Count, walk};

const INSTANCES: u32 = 50;

/// Two clips of a skeleton.
fn library(joints: usize, method: Method, storage: CrowdStorage) -> CrowdLibrary {
    let mut random = Rng::with_seed(5);
    let parents = (0..joints).map(|joint| joint.checked_sub(1).map(|before| before / 2));
    let skeleton = Skeleton::new(parents.collect(), vec![Vec3::ONE; joints]).unwrap();
    let mut library = CrowdLibrary::new(&skeleton).unwrap();
    library.set_storage(storage);
    for keys in [20, 40] {
        let mut set = TrackSet::new();
        let times: Vec<f64> = (0..keys).map(|key| f64::from(key) * 0.1).collect();
        for _ in 0..joints {
            set.push("", &times, &walk(&mut random, times.len(), 0.3))
                .unwrap();
        }
        library.push(&set, method, VectorMethod::Linear).unwrap();
    }
    let bind = (0..joints).map(|joint| Affine3A::from_rotation_x(joint as f32));
    let bind: Vec<Affine3A> = bind.collect();
    library.set_inverse_bind(&bind).unwrap();
    library
}

/// Runs all workgroups of the kernel over whole instances, counts, and compares the result with the CPU's; the same
/// for the kernel whose subgroups take them, if there are lanes. Returns the kernel.
fn assert_stores_whole_lines(
    library: &CrowdLibrary,
    layers: usize,
    output: CrowdOutput,
    subgroup_lanes: Option<u32>,
) -> Kernel {
    const CLOCK: u64 = 1 << 20;
    let mut random = Rng::with_seed(6);
    let joints = library.joint_count() as u32;
    let arguments = CrowdDispatch {
        count: INSTANCES,
        clock_low: CLOCK as u32,
        ..library.arguments(layers)
    };
    let curves = CrowdCurves::new(library.tables.forms(), layers as u32);
    let (kernel, pushed, groups) = match subgroup_lanes {
        None => {
            let whole = WholeInstances::new(&arguments, output, curves).expect("it is small");
            let (pushed, groups) = whole.dispatch(arguments, &library.levels);
            (whole.kernel, bytemuck::bytes_of(&pushed).to_vec(), groups)
        }
        Some(lanes) => {
            let whole = SubgroupInstances::new(&arguments, output, curves, lanes).unwrap();
            let (pushed, groups) = whole.dispatch(&arguments);
            let pushed = bytemuck::bytes_of(&pushed).to_vec();
            (whole.kernel(), pushed, groups)
        }
    };
    let engine = Engine::new(Device::Cpu).unwrap();
    let mut crowd = engine.crowd(library, INSTANCES as usize, layers).unwrap();
    crowd.set_clock(CLOCK).unwrap();
    let entries: Vec<_> = (0..INSTANCES as usize * layers)
        .map(|entry| {
            let plays = CrowdLayer::new(random.usize(..2))
                .at(random.i64(..1 << 20))
                .with_weight(0.5);
            crowd.set(entry / layers, entry % layers, plays).unwrap();
            plays.packed(&library.tables.clips, 0, CLOCK).unwrap()
        })
        .collect();
    let mut links = library.links.clone();
    let levels = library.levels.windows(2);
    links.extend(levels.map(|level| crate::shader::CrowdLink {
        joint: level[0],
        parent: level[1],
    }));
    let (tables, cells) = (&library.tables, library.cells().unwrap());
    let mut inputs: Vec<&[u8]> = vec![
        bytemuck::cast_slice(&entries),
        bytemuck::cast_slice(&tables.clips),
        bytemuck::cast_slice(&tables.bases),
        bytemuck::cast_slice(&tables.spans),
        bytemuck::cast_slice(&tables.channels),
        bytemuck::cast_slice(&cells),
    ];
    if output.values != CrowdValues::Rotations {
        inputs.extend([
            bytemuck::cast_slice(&links),
            bytemuck::cast_slice(&library.bind),
        ]);
    }
    let memory = Memory::new(kernel, inputs.into_iter(), &pushed, Vec::new());
    let memory = memory.with_subgroups_of(subgroup_lanes.unwrap_or(32));
    let mut count = Count::default();
    for group in 0..groups {
        count.add(&memory, [group, 0, 0], [groups, 1, 1]);
    }
    let found = memory.into_output();
    // Only the result is stored, and each value once.
    assert_eq!(count.words as usize, found.len(), "{kernel:?}");
    let expected: Vec<u32> = match output.is_half {
        true => {
            let mut values = vec![[0u16; 4]; crowd.output_len(output)];
            crowd
                .evaluate_half_into(output.values, &mut values)
                .unwrap();
            bytemuck::pod_collect_to_vec(&values)
        }
        false => {
            let mut values = vec![[0.0f32; 4]; crowd.output_len(output)];
            crowd.evaluate_into(output.values, &mut values).unwrap();
            bytemuck::pod_collect_to_vec(&values)
        }
    };
    let label = format!("{kernel:?}, {joints} joints, {output:?}, {subgroup_lanes:?}");
    assert!(found == expected, "{label}: not the CPU's values");
    for ((wave, line), [stores, loads]) in CARDS.into_iter().zip(count.of_cards) {
        let (stored, loaded) = (stores.ratio(), loads.ratio());
        println!("{label}, {wave} lanes, lines of {line}: {stored:.2} {loaded:.2}");
        let label = format!("{label}, {wave} lanes, lines of {line}");
        assert!(stored <= 1.1, "{label}: {stored}");
        assert!(loaded <= 1.3, "{label}: {loaded}");
    }
    kernel
}

/// Waves store whole lines, from any instance on, and all that is stored is the result.
#[test]
fn whole_instances_store_whole_lines() {
    let mut kernels = Vec::new();
    for (joints, method, layers, storage) in [
        (60, SLERP, 1, CrowdStorage::Segments),
        (21, SLERP, 1, CrowdStorage::Segments),
        (60, BESSEL_OVERHAUSER, 2, CrowdStorage::Segments),
        (21, BESSEL_OVERHAUSER, 2, CrowdStorage::Segments),
        (60, SLERP, 1, CrowdStorage::Compact),
    ] {
        let library = library(joints, method, storage);
        // There is no such kernel for the matrices of compact clips.
        let is_compact = storage == CrowdStorage::Compact;
        let all = CrowdValues::ALL.into_iter();
        for values in all.filter(|values| !is_compact || *values == CrowdValues::Rotations) {
            for output in [CrowdOutput::from(values), CrowdOutput::half(values)] {
                let kernel = assert_stores_whole_lines(&library, layers, output, None);
                kernels.push(kernel as usize);
            }
        }
    }
    let all = [
        Kernel::CrowdWholeRotations,
        Kernel::CrowdPlainWholeRotations,
        Kernel::CrowdWholeMatrices,
        Kernel::CrowdPlainWholeMatrices,
        Kernel::CrowdCompactWholeRotations,
    ];
    assert!(
        all.iter()
            .all(|kernel| kernels.contains(&(*kernel as usize)))
    );
}

/// Whatever the number of lanes is.
#[test]
fn subgroups_store_whole_lines() {
    for (joints, lanes) in [(60, 8), (60, 16), (60, 32), (60, 64), (8, 32), (2, 64)] {
        let library = library(joints, SLERP, CrowdStorage::Segments);
        let rotations = CrowdValues::Rotations;
        assert_stores_whole_lines(&library, 1, rotations.into(), Some(lanes));
        // Eight lanes store half of the largest line.
        if joints > 2 && lanes > 8 {
            assert_stores_whole_lines(&library, 1, CrowdOutput::half(rotations), Some(lanes));
        }
    }
}
