//! Trials of the kernels that evaluate samples directly from keys.

use crate::math::canonical::canonical;
use crate::math::quaternion::dot;
use crate::shader::{
    ArcsDispatch, END_NEGATED, FROM_KEYS_WORKGROUP, IS_KEY, KEY_AT_END, Kernel, KeySample,
    ROWS_PER_INVOCATION, RowShape, SIGN_NEGATED, START_NEGATED, TangentWeights,
};

use super::random::Random;
use super::{Trial, bytes, groups};

/// A key as a kernel reads it: with the sign with which it was added, and a bit that says whether the shortest path
/// needs the opposite sign.
fn stored(authored: [f32; 4], is_negated: bool) -> [u32; 4] {
    let mut stored = authored.map(f32::to_bits);
    if is_negated {
        stored[0] |= SIGN_NEGATED;
    }
    stored
}

const KEYS: usize = 23;
const SAMPLES: usize = 75;
/// One more row than an invocation evaluates.
const ROWS: usize = ROWS_PER_INVOCATION as usize + 1;

/// Some rows of keys, and samples of them.
struct KeyRows {
    keys: Vec<[u32; 4]>,
    samples: Vec<KeySample>,
    weights: Vec<TangentWeights>,
}

pub(super) fn trials(kernel: Kernel, random: &mut Random) -> Vec<Trial> {
    let rows = KeyRows::new(random, kernel == Kernel::FromKeysCubics);
    // An invocation with all its rows, and one row per invocation that begins within a cache line.
    [(ROWS_PER_INVOCATION, 0), (1, 7)]
        .map(|(each, line)| rows.trial(kernel, each, line))
        .into()
}

/// Trials of the kernel that prepares arcs: between neighbouring keys, with signs of both, in one column of
/// workgroups and in one row.
pub(super) fn arc_trials(random: &mut Random) -> Vec<Trial> {
    const COUNT: usize = 200;
    let (mut keys, mut intervals) = (Vec::new(), Vec::new());
    for _ in 0..COUNT {
        let pair = random.pair();
        let [start, end] = pair.map(|key| (key, random.once_in(3)));
        let flag = |(_, is_negated), flag| if is_negated { flag } else { 0 };
        let flags = flag(start, START_NEGATED) | flag(end, END_NEGATED);
        intervals.push(keys.len() as u32 | flags);
        let with_sign =
            |(key, is_negated): ([f32; 4], bool)| if is_negated { key.map(|c| -c) } else { key };
        keys.extend([start, end].map(with_sign));
    }
    let count = COUNT as u32;
    [false, true]
        .map(|in_row| {
            let inputs = [bytes(&keys), bytes(&intervals)];
            Trial::new(inputs, &ArcsDispatch { count }, groups(COUNT, in_row))
        })
        .into()
}

impl KeyRows {
    fn new(random: &mut Random, are_cubics: bool) -> Self {
        let mut keys = Vec::new();
        for _ in 0..ROWS {
            let mut key = random.unit();
            for _ in 0..KEYS {
                let is_negated = random.once_in(3);
                let authored = if is_negated {
                    key.map(|c| canonical(-c))
                } else {
                    key
                };
                keys.push(stored(authored, is_negated));
                key = match are_cubics || random.once_in(2) {
                    true => {
                        let step = random.step();
                        random.near(key, step)
                    }
                    false => {
                        let next = random.unit();
                        let is_near = dot(key, next) >= 0.0;
                        if is_near {
                            next
                        } else {
                            next.map(|c| canonical(-c))
                        }
                    }
                };
            }
        }
        let samples = (0..SAMPLES).map(|_| match random.once_in(6) {
            true => KeySample {
                key: random.below(KEYS as u32) | IS_KEY,
                parameter: 0.0,
            },
            false => KeySample {
                key: random.below(KEYS as u32 - 1),
                parameter: random.parameter(),
            },
        });
        let samples = samples.collect();
        let mut weights: Vec<_> = (0..KEYS).map(|_| random.weights()).collect();
        // There is nothing before the first key and nothing after the last one.
        (weights[0].kind, weights[KEYS - 1].kind) = (KEY_AT_END, KEY_AT_END);
        Self {
            keys,
            samples,
            weights,
        }
    }

    fn trial(&self, kernel: Kernel, each: u32, line: u32) -> Trial {
        let shape = RowShape {
            samples: SAMPLES as u32,
            keys: KEYS as u32,
            count: ROWS as u32,
            each,
            line,
        };
        let groups = [
            (shape.samples + line).div_ceil(FROM_KEYS_WORKGROUP),
            shape.count.div_ceil(each),
            1,
        ];
        let mut inputs = vec![bytes(&self.keys), bytes(&self.samples)];
        inputs.extend((kernel == Kernel::FromKeysCubics).then(|| bytes(&self.weights)));
        Trial::new(inputs, &shape, groups)
    }
}
