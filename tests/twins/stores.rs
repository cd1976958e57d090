//! The functions that read and store elements of buffers.

use std::fs;
use std::path::Path;

use crate::output::encoding::Encoding;
use crate::output::euler::EulerSequence;
use crate::shader::{Form, KERNELS, LINE, List, Store, WORKGROUP};

use super::source;
use super::trial::{Twin, TwinTrial, UNTOUCHED, with_globals};
use crate::gpu::kernel_check::StoredKey;
use crate::gpu::kernel_check::random::Random;

/// The parameter of the store of Euler angles.
pub(super) fn euler_detail(random: &mut Random) -> u32 {
    let all = EulerSequence::all();
    let sequence = all[random.below(all.len() as u32) as usize];
    Encoding::Euler(sequence).row().detail
}

fn pick(random: &mut Random, encodings: &[Encoding]) -> Encoding {
    encodings[random.below(encodings.len() as u32) as usize]
}

/// The kernels of a list that evaluate arcs, one for each store.
fn over_arcs(list: List) -> impl Iterator<Item = (&'static str, Vec<Encoding>)> {
    KERNELS.iter().filter_map(move |code| match code.segments {
        Some((Form::Arc, of_list, store)) if of_list == list => {
            Some((code.kernel.code(false).0, Encoding::of_store(store)))
        }
        _ => None,
    })
}

/// How many words one part has that a kernel stores, if its values have several.
fn words_of_part(kernel: &str) -> Option<usize> {
    let text = source(kernel);
    if !text.contains("\nfn parts(") {
        return None;
    }
    let (_, stored) = text
        .split_once("alias Stored = ")
        .expect("every store names it");
    let (stored, _) = stored.split_once(';').expect("a line of WGSL");
    match stored.strip_prefix("vec") {
        Some(components) => components[..1].parse().ok(),
        None => Some(1),
    }
}

/// The functions of a store's file, if it is that of a kernel over the frames of arcs.
pub(super) fn functions_of_file(kernel: &str) -> Vec<String> {
    let Some(name) = kernel.strip_prefix("arc_frames_") else {
        return Vec::new();
    };
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("shaders/stores/{name}.wgsl"));
    let text = fs::read_to_string(file).unwrap_or_default(); // texel variants have no file of that name
    let functions = text.lines().filter_map(|line| line.strip_prefix("fn "));
    let named = functions.filter_map(|line| line.split_once('('));
    named.map(|(name, _)| name.to_owned()).collect()
}

/// What a kernel's `store` of a rotation leaves in its buffer.
fn store(kernel: &'static str, encodings: Vec<Encoding>, is_wide: bool) -> Twin {
    with_globals(kernel, "store", move |random, trial| {
        let encoding = pick(random, &encodings);
        let rotation = random.rotation();
        let index = random.below(3);
        trial.argument((index, rotation));
        trial.global("dispatch", [0, 0, 0, encoding.row().detail, 0u32]);
        trial.output("rotations");
        let cells: Vec<u64> = if is_wide {
            bytemuck::pod_collect_to_vec(bytemuck::bytes_of(&rotation))
        } else {
            words(encoding, rotation)
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
    let mut all = vec![store(
        "arc_frames_f32_texels",
        Encoding::of_store(Store::F32),
        true,
    )];
    for (kernel, encodings) in over_arcs(List::Frames) {
        all.push(store(kernel, encodings.clone(), false));
        if words_of_part(kernel).is_some() {
            all.push(with_globals(kernel, "parts", move |random, trial| {
                let (encoding, rotation) = (pick(random, &encodings), random.rotation());
                trial.argument(rotation);
                trial.global("dispatch", [0, 0, 0, encoding.row().detail, 0u32]);
                trial.expect(words(encoding, rotation));
            }));
        }
    }
    for (kernel, encodings) in over_arcs(List::FramesCoalesced) {
        if let Some(size) = words_of_part(kernel) {
            all.push(together(kernel, encodings, size));
        }
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
fn together(kernel: &'static str, encodings: Vec<Encoding>, size: usize) -> Twin {
    with_globals(kernel, "finish", move |random, trial| {
        let encoding = pick(random, &encodings);
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
    all.push(reader("prepare_arcs", "interval_at", "intervals", 1));
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
