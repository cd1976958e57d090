//! Trials of the kernels that evaluate samples directly from keys.

use bytemuck::Zeroable as _;

use crate::from_keys::arcs::TwoKeyBlock;
use crate::from_keys::cubics::CubicBlock;
use crate::math::canonical::canonical;
use crate::math::quaternion::dot;
use crate::shader::{
    ArcSegment, ArcsDispatch, END_NEGATED, FROM_KEYS_WORKGROUP, Form, IS_KEY, KEY_AT_END,
    KEY_INNER, Kernel, KeySample, ROWS_PER_INVOCATION, RowShape, SIGN_NEGATED, START_NEGATED,
    TangentWeights,
};
use crate::simd::dispatch::in_lanes;
use crate::twin::arc_between::arc_between;

use super::random::Random;
use super::{Trial, bytes, groups};

/// A key as a kernel reads it, with its original sign and with the sign for the shortest path.
#[derive(Clone, Copy)]
pub(crate) struct StoredKey {
    pub(crate) stored: [u32; 4],
    pub(crate) authored: [f32; 4],
    pub(crate) continued: [f32; 4],
}

impl StoredKey {
    pub(crate) fn new(authored: [f32; 4], is_negated: bool) -> Self {
        let mut stored = authored.map(f32::to_bits);
        let sign = if is_negated { -1.0 } else { 1.0 };
        if is_negated {
            stored[0] |= SIGN_NEGATED;
        }
        Self {
            stored,
            authored,
            continued: authored.map(|c| c * sign),
        }
    }
}

const KEYS: usize = 23;
const SAMPLES: usize = 75;
/// One more row than an invocation evaluates.
const ROWS: usize = ROWS_PER_INVOCATION as usize + 1;

/// Some rows of keys, and samples of them.
struct KeyRows {
    keys: Vec<StoredKey>,
    samples: Vec<KeySample>,
    weights: Vec<TangentWeights>,
}

pub(super) fn trials(kernel: Kernel) -> Vec<Trial> {
    let rows = KeyRows::new(&mut Random::canonical(), kernel == Kernel::FromKeysCubics);
    // All rows of an invocation, or one each that begins where a line of memory does.
    [(ROWS_PER_INVOCATION, 0), (1, 7)]
        .map(|(each, line)| rows.trial(kernel, each, line))
        .into()
}

/// Trials of the kernel that prepares arcs: between neighbouring keys, with signs of both, in one column of
/// workgroups and in one row.
pub(super) fn arc_trials() -> Vec<Trial> {
    const COUNT: usize = 200;
    let mut random = Random::canonical();
    let (mut keys, mut intervals, mut arcs) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..COUNT {
        let pair = random.pair();
        let [start, end] = pair.map(|key| (key, random.once_in(3)));
        let flag = |(_, is_negated), flag| if is_negated { flag } else { 0 };
        let flags = flag(start, START_NEGATED) | flag(end, END_NEGATED);
        intervals.push(keys.len() as u32 | flags);
        let stored =
            |(key, is_negated): ([f32; 4], bool)| if is_negated { key.map(|c| -c) } else { key };
        keys.extend([stored(start), stored(end)]);
        arcs.push(arc_between(pair[0], pair[1]));
    }
    let count = COUNT as u32;
    [false, true]
        .map(|in_row| {
            let inputs = [bytes(&keys), bytes(&intervals)];
            let mut trial = Trial::new(inputs, &ArcsDispatch { count }, groups(COUNT, in_row));
            for (i, &(middle, tangent)) in arcs.iter().enumerate() {
                trial.expect(i, &ArcSegment { middle, tangent });
            }
            trial
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
                keys.push(StoredKey::new(authored, is_negated));
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
        // Nothing lies before the first key, and nothing after the last.
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
        let stored: Vec<_> = self.keys.iter().map(|key| key.stored).collect();
        let (keys, samples) = (bytes(&stored), bytes(&self.samples));
        let mut trial = match kernel {
            Kernel::FromKeysCubics => {
                Trial::new([keys, samples, bytes(&self.weights)], &shape, groups)
            }
            _ => Trial::new([keys, samples], &shape, groups),
        };
        for row in 0..ROWS {
            let keys = &self.keys[row * KEYS..][..KEYS];
            for (i, sample) in self.samples.iter().enumerate() {
                let rotation = match kernel {
                    Kernel::FromKeysArcs => two_keys(Form::Arc, keys, sample),
                    Kernel::FromKeysTwoKeys => two_keys(Form::Polynomial, keys, sample),
                    _ => self.cubic(keys, sample),
                };
                trial.expect(row * SAMPLES + i, &rotation);
            }
        }
        trial
    }

    fn cubic(&self, keys: &[StoredKey], sample: &KeySample) -> [f32; 4] {
        let (is_key, key) = (sample.key & IS_KEY != 0, (sample.key & !IS_KEY) as usize);
        let mut block = CubicBlock::zeroed();
        (block.count, block.parameters[0]) = (1, sample.parameter);
        if is_key {
            block.held[0] = 1.0;
            block.keys[1][0] = keys[key].authored;
        } else {
            let (first, last) = (self.weights[key], self.weights[key + 1]);
            // At an end the key itself stands in for the missing neighbour.
            let before = key - usize::from(first.kind == KEY_INNER);
            let after = key + 1 + usize::from(last.kind == KEY_INNER);
            for (i, key) in [before, key, key + 1, after].into_iter().enumerate() {
                block.keys[i][0] = keys[key].continued;
            }
            (block.weights[0][0], block.weights[1][0]) = (first, last);
        }
        // Lanes without a sample count as held.
        block.held[1..].fill(1.0);
        in_lanes(&mut block);
        block.rotations[0]
    }
}

fn two_keys(form: Form, keys: &[StoredKey], sample: &KeySample) -> [f32; 4] {
    let key = (sample.key & !IS_KEY) as usize;
    let mut block = TwoKeyBlock::new(form);
    (block.from[0], block.to[0]) = match sample.key & IS_KEY {
        0 => (keys[key].continued, keys[key + 1].continued),
        _ => (keys[key].authored, keys[key].authored),
    };
    (block.count, block.parameters[0]) = (1, sample.parameter);
    in_lanes(&mut block);
    block.rotations[0]
}
