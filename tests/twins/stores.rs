//! The functions that read and store elements of buffers.

use crate::output::encoding::{Encoding, MatrixOrder};
use crate::output::euler::EulerSequence;
use crate::shader::{LINE, WORKGROUP};

use super::trial::{Twin, TwinTrial, UNTOUCHED, with_globals};
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
        let index = random.below(3);
        trial.argument((index, rotation));
        trial.global("dispatch", [0, 0, 0, encoding.row().detail, 0u32]);
        trial.output("rotations");
        let cells: Vec<u64> = match kind {
            "f32_wide" => bytemuck::pod_collect_to_vec(bytemuck::bytes_of(&rotation)),
            _ => words(encoding, rotation),
        };
        trial.expect(vec![UNTOUCHED; index as usize * cells.len()]);
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
        let index = random.below(3);
        trial.argument(index);
        trial.expect(all[index as usize * words..][..words].to_vec());
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
    for (kernel, kind) in [
        ("arc_frames_matrix3x3", "matrix3x3"),
        ("arc_frames_matrix3x4", "matrix3x4"),
        ("arc_frames_euler", "euler"),
        ("arc_frames_vector", "vector"),
    ] {
        all.push(with_globals(kernel, "parts", move |random, trial| {
            let (encoding, rotation) = (encoding(kind, random), random.rotation());
            trial.argument(rotation);
            trial.global("dispatch", [0, 0, 0, encoding.row().detail, 0u32]);
            trial.expect(words(encoding, rotation));
        }));
    }
    for (kernel, kind, size) in [
        ("arc_frames_coalesced_matrix3x3", "matrix3x3", 1),
        ("arc_frames_coalesced_matrix3x4", "matrix3x4", 4),
        ("arc_frames_coalesced_euler", "euler", 1),
    ] {
        all.push(together(kernel, kind, size));
    }
    all.push(with_globals(
        "arc_frames_coalesced_f32",
        "finish",
        |random, trial| {
            let (index, is_stored) = (random.below(3), random.once_in(2));
            let rotation = random.rotation();
            trial.argument((random.below(WORKGROUP), index, rotation, is_stored));
            trial.output("rotations");
            trial.expect(vec![UNTOUCHED; 4 * index as usize]);
            match is_stored {
                true => trial.expect(rotation),
                false => trial.expect([UNTOUCHED; 4]),
            }
        },
    ));
    all
}

/// The words of an encoded rotation.
fn words(encoding: Encoding, rotation: [f32; 4]) -> Vec<u64> {
    let mut bytes = vec![0; encoding.bytes()];
    encoding.encode(&[rotation], &mut bytes).unwrap();
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(&bytes);
    words.into_iter().map(u64::from).collect()
}

/// The parts, of so many words each, that an invocation stores of what its neighbours have put together.
fn together(kernel: &'static str, kind: &'static str, size: usize) -> Twin {
    with_globals(kernel, "finish", move |random, trial| {
        let encoding = encoding(kind, random);
        let (lane, rotation) = (random.below(WORKGROUP), random.rotation());
        let (within, line) = (lane % LINE, 2 * LINE);
        let is_stored = random.once_in(2);
        trial.argument((lane, line + within, rotation, is_stored));
        trial.global("dispatch", [encoding.row().detail, 0, 0, 0, 0, 0, 0u32]);
        let words = words(encoding, rotation);
        let parts = words.len() / size;
        let mut there: Vec<u64> = (0..WORKGROUP).map(|_| random.below(2).into()).collect();
        let mut tile: Vec<u64> = (0..WORKGROUP as usize * words.len())
            .map(|_| random.word().into())
            .collect();
        trial.global("is_there", there.clone());
        trial.global("tile", tile.clone());
        there[lane as usize] = is_stored.into();
        if is_stored {
            tile[lane as usize * words.len()..][..words.len()].copy_from_slice(&words);
        }
        trial.output("rotations");
        trial.expect(vec![UNTOUCHED; line as usize * words.len()]);
        for part in 0..LINE as usize * parts {
            let other = (lane - within) as usize + part / parts;
            let is_inside = part % LINE as usize == within as usize && there[other] != 0;
            match is_inside {
                true => trial.expect(
                    tile[(lane - within) as usize * words.len() + part * size..][..size].to_vec(),
                ),
                false => trial.expect(vec![UNTOUCHED; size]),
            }
        }
    })
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
            reader(crowd, "position_at", "positions", 2),
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
            move |random: &mut Random, trial: &mut TwinTrial| {
                let key = stored_key(random);
                trial.argument(key.stored);
                trial.expect(expected(key));
            },
        )
    };
    vec![
        key("as_stored", |key| key.authored),
        key("continued", |key| key.continued),
        with_globals(KERNEL, "continued_key_at", |random, trial| {
            let all: [StoredKey; 2] = std::array::from_fn(|_| stored_key(random));
            let index = random.below(2);
            trial.argument(index);
            trial.global("keys", [all[0].stored, all[1].stored]);
            trial.expect(all[index as usize].continued);
        }),
    ]
}
