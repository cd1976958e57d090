//! How many lines of memory the waves of a card touch when they evaluate whole instances of a crowd, counted as in
//! `lines.rs`, and how many bytes they store.

use std::collections::BTreeMap;

use fastrand::Rng;
use glam::Vec3;

use crate::crowd::layer::CrowdLayer;
use crate::crowd::library::CrowdLibrary;
use crate::method::Method;
use crate::method::bessel_overhauser::BESSEL_OVERHAUSER;
use crate::method::slerp::SLERP;
use crate::method::vector_method::VectorMethod;
use crate::output::crowd::{CrowdOutput, CrowdValues};
use crate::pose::skeleton::Skeleton;
use crate::shader::{
    CROWD_WORKGROUP, CrowdDispatch, Kernel, LINE_VECTORS, MAX_WHOLE_JOINTS, MAX_WHOLE_POSITIONS,
};
use crate::tracks::set::TrackSet;
use crate::work::whole_instances::WholeInstances;

use super::lines::{CARDS, Lines, cells, global, loads_of, store, walk};
use super::machine::{Machine, Touch};
use super::operations::FloatMode;
use super::program::Checked;
use super::source;

const INSTANCES: u32 = 50;

/// What comes with a dispatch, and the memory of an invocation and of a workgroup.
const NO_BUFFERS: [&str; 5] = [
    "dispatch",
    "first_entry",
    "found_spans",
    "found_parameters",
    "rows",
];

/// Two clips of a skeleton.
fn library(joints: usize, method: Method) -> CrowdLibrary {
    let mut random = Rng::with_seed(5);
    let parents = (0..joints).map(|joint| joint.checked_sub(1).map(|before| before / 2));
    let skeleton = Skeleton::new(parents.collect(), vec![Vec3::ONE; joints]).unwrap();
    let mut library = CrowdLibrary::new(&skeleton).unwrap();
    for keys in [20, 40] {
        let mut set = TrackSet::new();
        let times: Vec<f64> = (0..keys).map(|key| f64::from(key) * 0.1).collect();
        for _ in 0..joints {
            set.push("", &times, &walk(&mut random, times.len(), 0.3))
                .unwrap();
        }
        library.push(&set, method, VectorMethod::Linear).unwrap();
    }
    library
}

/// Runs all workgroups, and counts.
fn assert_stores_whole_lines(library: &CrowdLibrary, layers: usize, output: CrowdOutput) {
    let mut random = Rng::with_seed(6);
    let joints = library.joint_count() as u32;
    let arguments = CrowdDispatch {
        count: INSTANCES,
        clock_low: 1 << 20,
        ..library.arguments(layers)
    };
    let is_plain = layers == 1 && library.tables.has_only_arcs();
    let whole = WholeInstances::new(&arguments, output, is_plain).expect("it is small");
    let (pushed, groups) = whole.dispatch(arguments, &library.levels);
    let kernel = whole.kernel.code(false).0;
    let program = Checked::parse(source(kernel)).program(FloatMode::AsWritten);
    let mut machine = Machine::new(&program);
    let entries: Vec<_> = (0..INSTANCES * layers as u32)
        .map(|_| {
            let plays = CrowdLayer {
                weight: 0.5,
                ..CrowdLayer::new(random.usize(..2)).at(random.i64(..1 << 20))
            };
            plays.packed(&library.tables.clips, 0, 0).unwrap()
        })
        .collect();
    let mut links = library.links.clone();
    links.extend(
        library
            .levels
            .windows(2)
            .map(|level| crate::shader::CrowdLink {
                joint: level[0],
                parent: level[1],
            }),
    );
    let each = if output.is_half { 2 } else { 4 };
    let stored = if output.is_half { "halves" } else { "values" };
    let vectors = INSTANCES * joints * output.vector_count() as u32;
    let tables = &library.tables;
    for (name, filled) in [
        ("dispatch", cells(bytemuck::bytes_of(&pushed))),
        ("first_entry", vec![0]),
        ("found_spans", vec![0; MAX_WHOLE_POSITIONS as usize]),
        ("found_parameters", vec![0; MAX_WHOLE_POSITIONS as usize]),
        ("entries", cells(bytemuck::cast_slice(&entries))),
        ("clips", cells(bytemuck::cast_slice(&tables.clips))),
        ("time_bases", cells(bytemuck::cast_slice(&tables.bases))),
        ("spans", cells(bytemuck::cast_slice(&tables.spans))),
        ("channels", cells(bytemuck::cast_slice(&tables.channels))),
        (
            "cells",
            cells(bytemuck::cast_slice(&library.cells().unwrap())),
        ),
        (stored, vec![0; (vectors * each) as usize]),
    ] {
        machine.globals[global(&program, name)] = filled;
    }
    if output.values != CrowdValues::Rotations {
        let bind = vec![0; 12 * joints as usize];
        for (name, filled) in [
            ("rows", vec![0; 12 * MAX_WHOLE_JOINTS as usize]),
            ("links", cells(bytemuck::cast_slice(&links))),
            ("bind", bind),
        ] {
            machine.globals[global(&program, name)] = filled;
        }
    }
    let is_buffer = |touch: &Touch| !NO_BUFFERS.contains(&&*program.globals[touch.global]);
    let main = program.functions.len() - 1;
    let of_group = pushed.instances * joints * output.vector_count() as u32;
    let line_vectors = LINE_VECTORS << u32::from(output.is_half);
    let mut of_cards = [[Lines::default(); 2]; CARDS.len()];
    let mut bytes = 0;
    for group in 0..groups {
        let mut run = |lane| {
            machine.touches = Some(Vec::new());
            let arguments = [group, 0, 0, groups, 1, 1, lane].map(u64::from);
            assert!(
                machine.call(main, &arguments).is_some(),
                "{kernel}: {group}, {lane}"
            );
            let mut touches = machine.touches.take().unwrap_or_default();
            touches.retain(is_buffer);
            touches
        };
        // The first run leaves the positions for the second.
        (0..CROWD_WORKGROUP).for_each(|lane| drop(run(lane)));
        let lanes: Vec<Vec<Touch>> = (0..CROWD_WORKGROUP).map(run).collect();
        // Invocations take vectors from the beginning of a line on, in rounds.
        let first = group * of_group / line_vectors * line_vectors;
        let vector = |touch: &Touch| (touch.bytes().start / (4 * u64::from(each))) as u32 - first;
        for ((wave, line), lines) in CARDS.into_iter().zip(&mut of_cards) {
            let mut together = BTreeMap::<(u32, u32), Vec<_>>::new();
            for (lane, touches) in (0..).zip(&lanes) {
                for touch in touches.iter().filter(|touch| touch.is_store) {
                    let vector = vector(touch);
                    assert_eq!(vector % CROWD_WORKGROUP, lane, "{kernel}: {group}");
                    let key = (vector / CROWD_WORKGROUP, lane / wave);
                    together.entry(key).or_default().push(touch.bytes());
                }
            }
            together
                .values()
                .for_each(|ranges| lines[0].add(store(ranges, line)));
            lines[1].add(loads_of(&lanes, line));
        }
        let stores = lanes.iter().flatten().filter(|touch| touch.is_store);
        bytes += stores
            .map(|touch| touch.bytes().end - touch.bytes().start)
            .sum::<u64>();
    }
    // Nothing is stored but the result, once.
    assert_eq!(bytes, u64::from(vectors * each * 4), "{kernel}");
    let label = format!("{kernel}, {joints} joints, {output:?}");
    for ((wave, line), [stores, loads]) in CARDS.into_iter().zip(of_cards) {
        let (stored, loaded) = (stores.ratio(), loads.ratio());
        println!("{label}, {wave} lanes, lines of {line}: {stored:.2} {loaded:.2}");
        assert!(
            stored <= 1.1,
            "{label}, {wave} lanes, lines of {line}: {stored}"
        );
        assert!(
            loaded <= 1.3,
            "{label}, {wave} lanes, lines of {line}: {loaded}"
        );
    }
}

/// Waves store whole lines, from any instance on, and all that is stored is the result.
#[test]
fn whole_instances_store_whole_lines() {
    let mut kernels = Vec::new();
    for (joints, method, layers) in [
        (60, SLERP, 1),
        (21, SLERP, 1),
        (60, BESSEL_OVERHAUSER, 2),
        (21, BESSEL_OVERHAUSER, 2),
    ] {
        let library = library(joints, method);
        for values in CrowdValues::ALL {
            for output in [CrowdOutput::from(values), CrowdOutput::half(values)] {
                assert_stores_whole_lines(&library, layers, output);
                let arguments = library.arguments(layers);
                let whole = WholeInstances::new(&arguments, output, layers == 1);
                kernels.extend(whole.map(|whole| whole.kernel as usize));
            }
        }
    }
    let all = [
        Kernel::CrowdWholeRotations,
        Kernel::CrowdPlainWholeRotations,
        Kernel::CrowdWholeMatrices,
        Kernel::CrowdPlainWholeMatrices,
    ];
    assert!(
        all.iter()
            .all(|kernel| kernels.contains(&(*kernel as usize)))
    );
}
