//! The functions that read and store elements of buffers.

use crate::math::canonical::canonical;
use crate::output::encoding::{Encoding, MatrixOrder};
use crate::output::euler::EulerSequence;

use super::trial::{Trial, Twin, UNTOUCHED, with_globals};
use crate::gpu::kernel_check::StoredKey;
use crate::gpu::kernel_check::random::Random;

/// The parameter of the store of Euler angles.
pub(super) fn euler_detail(random: &mut Random) -> u32 {
    let all = EulerSequence::all();
    let sequence = all[random.below(all.len() as u32) as usize];
    Encoding::Euler(sequence).row().detail
}

fn encoding(kind: &str, random: &mut Random) -> Encoding {
    let order = match random.below(2) {
        0 => MatrixOrder::RowMajor,
        _ => MatrixOrder::ColumnMajor,
    };
    match kind {
        "f16" => Encoding::F16,
        "snorm16" => Encoding::Snorm16,
        "axis_angle" => Encoding::AxisAngle,
        "matrix3x3" => Encoding::Matrix3x3(order),
        "matrix3x4" => Encoding::Matrix3x4(order),
        "euler" => {
            let all = EulerSequence::all();
            Encoding::Euler(all[random.below(all.len() as u32) as usize])
        }
        "vector" => Encoding::Vector,
        _ => Encoding::F32,
    }
}

/// What a kernel's `store` of a rotation leaves in its buffer.
fn store(kernel: &'static str, kind: &'static str) -> Twin {
    with_globals(kernel, "store", move |random, trial| {
        let encoding = encoding(kind, random);
        let rotation = random.rotation();
        let place = random.below(3);
        trial.argument((place, rotation));
        trial.global("dispatch", [0, 0, 0, encoding.row().detail, 0u32]);
        trial.output("rotations");
        let mut bytes = vec![0; encoding.bytes()];
        encoding.encode(&[rotation], &mut bytes).unwrap();
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(&bytes);
        let cells: Vec<u64> = match kind {
            "f32_wide" => bytemuck::pod_collect_to_vec(&bytes),
            _ => words.into_iter().map(u64::from).collect(),
        };
        trial.expect(vec![UNTOUCHED; place as usize * cells.len()]);
        trial.expect(cells);
    })
}

/// A function that reads an element of so many words from a buffer. Texel buffers end with a whole
/// texel of four words.
fn reader(
    kernel: &'static str,
    function: &'static str,
    buffer: &'static str,
    words: usize,
) -> Twin {
    with_globals(kernel, function, move |random, trial| {
        let count = (3 * words).next_multiple_of(4);
        let all: Vec<u32> = (0..count).map(|_| random.word()).collect();
        let place = random.below(3);
        trial.argument(place);
        trial.expect(all[place as usize * words..][..words].to_vec());
        trial.global(buffer, all);
    })
}

pub(super) fn stores() -> Vec<Twin> {
    let mut all = vec![
        store("arc_frames_f32", "f32"),
        store("arc_frames_f32_texels", "f32_wide"),
        store("arc_frames_f16", "f16"),
        store("arc_frames_snorm16", "snorm16"),
        store("arc_frames_axis_angle", "axis_angle"),
        store("arc_frames_matrix3x3", "matrix3x3"),
        store("arc_frames_matrix3x4", "matrix3x4"),
        store("arc_frames_euler", "euler"),
        store("arc_frames_vector", "vector"),
    ];
    all.push(with_globals(
        "arc_frames_matrix3x3",
        "store_row",
        |random, trial| {
            let row: [f32; 3] = random.vector();
            trial.argument((1u32, row));
            trial.output("rotations");
            trial.expect(UNTOUCHED);
            trial.expect(row.map(canonical));
        },
    ));
    all
}

pub(super) fn readers() -> Vec<Twin> {
    let mut all = Vec::new();
    for [arcs, polynomials, times, samples, keys, crowd] in [
        [
            "arc_frames_f32",
            "polynomial_frames_f32",
            "arc_times_f32",
            "arc_samples_f32",
            "from_keys_cubics",
            "crowd_rotations",
        ],
        [
            "arc_frames_f32_texels",
            "polynomial_frames_f32_texels",
            "arc_times_f32_texels",
            "arc_samples_f32_texels",
            "from_keys_cubics_texels",
            "crowd_rotations_texels",
        ],
    ] {
        all.extend([
            reader(arcs, "segment_at", "segments", 8),
            reader(polynomials, "segment_at", "segments", 44),
            reader(arcs, "constant_at", "constants", 4),
            reader(arcs, "item_at", "items", 6),
            reader(times, "distance_at", "distances", 1),
            reader(samples, "sample_at", "samples", 2),
            reader(keys, "key_at", "keys", 4),
            reader(keys, "sample_at", "samples", 2),
            reader(keys, "weights_at", "weights", 4),
            reader(crowd, "entry_at", "entries", 4),
            reader(crowd, "channel_at", "channels", 4),
            reader(crowd, "cell_at", "cells", 4),
            reader(crowd, "place_at", "places", 2),
        ]);
    }
    all.push(with_globals(
        "arc_times_f32",
        "distance_from_middle",
        |random, trial| {
            let all: [f32; 8] = random.vector();
            let (first, j) = (random.below(4), random.below(4));
            trial.argument((first, j));
            trial.global("distances", all);
            trial.expect(all[(first + j) as usize]);
        },
    ));
    all
}

fn stored_key(random: &mut Random) -> StoredKey {
    StoredKey::new(random.unit(), random.once_in(2))
}

pub(super) fn keys() -> Vec<Twin> {
    const KERNEL: &str = "from_keys_arcs";
    let key = |function, expected: fn(StoredKey) -> [f32; 4]| {
        with_globals(
            KERNEL,
            function,
            move |random: &mut Random, trial: &mut Trial| {
                let key = stored_key(random);
                trial.argument(key.stored);
                trial.expect(expected(key));
            },
        )
    };
    vec![
        key("as_given", |key| key.given),
        key("continued", |key| key.continued),
        with_globals(KERNEL, "continued_key_at", |random, trial| {
            let all: [StoredKey; 2] = std::array::from_fn(|_| stored_key(random));
            let place = random.below(2);
            trial.argument(place);
            trial.global("keys", [all[0].stored, all[1].stored]);
            trial.expect(all[place as usize].continued);
        }),
    ]
}
