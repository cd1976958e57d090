//! The entry points that evaluate samples, each beside the function in Rust that does the same work.

use glam::Vec4;

use crate::cpu::evaluate::{distances, frames, one};
use crate::from_keys::arcs::TwoKeyBlock;
use crate::from_keys::cubics::CubicBlock;
use crate::math::canonical::canonical;
use crate::shader::{
    ArcSegment, END_NEGATED, Form, IS_CONSTANT, IS_KEY, KEY_INNER, PREPARE_WORKGROUP,
    PolynomialSegment, ROWS_PER_INVOCATION, START_NEGATED,
};
use crate::simd::dispatch::in_lanes;
use crate::time::runs::Affine;
use crate::twin::Evaluate;
use crate::twin::arc_between::arc_between;

use super::trial::{Twin, TwinTrial, UNTOUCHED, with_globals};
use crate::gpu::kernel_check::StoredKey;
use crate::gpu::kernel_check::random::Random;

/// A form of segments: what its kernels read.
pub(super) trait Segment: Evaluate + 'static {
    const KERNELS: [&str; 3];
    fn random(random: &mut Random) -> Self;
    fn cells(&self) -> Vec<[f32; 4]>;
}

fn canonical_vector(random: &mut Random) -> [f32; 4] {
    random.vector().map(canonical)
}

impl Segment for ArcSegment {
    const KERNELS: [&str; 3] = ["arc_frames_f32", "arc_times_f32", "arc_samples_f32"];

    fn random(random: &mut Random) -> Self {
        let (middle, tangent) = (canonical_vector(random), canonical_vector(random));
        Self { middle, tangent }
    }

    fn cells(&self) -> Vec<[f32; 4]> {
        vec![self.middle, self.tangent]
    }
}

impl Segment for PolynomialSegment {
    const KERNELS: [&str; 3] = [
        "polynomial_frames_f32",
        "polynomial_times_f32",
        "polynomial_samples_f32",
    ];

    fn random(random: &mut Random) -> Self {
        let coefficients = std::array::from_fn(|_| canonical_vector(random));
        Self { coefficients }
    }

    fn cells(&self) -> Vec<[f32; 4]> {
        self.coefficients.to_vec()
    }
}

/// Everything that a dispatch over two segments and two constants reads but its work.
struct RunScene<S> {
    segments: [S; 2],
    constants: [[f32; 4]; 2],
    /// The one of both that the work uses, and whether it is a constant.
    source: usize,
    is_constant: bool,
    /// The invocation, of two rows of workgroups, and the first item.
    index: u32,
    first_item: u32,
}

impl<S: Segment> RunScene<S> {
    fn new(random: &mut Random, trial: &mut TwinTrial) -> Self {
        let scene = Self {
            segments: [S::random(random), S::random(random)],
            constants: [random.rotation(), random.rotation()],
            source: random.below(2) as usize,
            is_constant: random.once_in(8),
            index: 64 + random.below(2),
            first_item: random.below(3),
        };
        // One workgroup in each row.
        trial.argument([scene.index - 64, 1, 0]);
        trial.argument([1u32, 2, 1]);
        let segments = [scene.segments[0].cells(), scene.segments[1].cells()];
        trial.global("segments", segments.concat());
        trial.global("constants", scene.constants);
        trial.output("rotations");
        scene
    }

    /// The index of the item of this invocation among all.
    fn index_of_item(&self) -> usize {
        (self.first_item + self.index) as usize
    }

    fn source_with_bit(&self) -> (u32, u32) {
        let bit = if self.is_constant { IS_CONSTANT } else { 0 };
        (self.source as u32, bit)
    }

    /// `idle` invocations before the first do nothing.
    fn dispatch(&self, trial: &mut TwinTrial, stride: u32, first_output: u32, idle: u32) {
        let count = self.index + 1 - idle;
        let dispatch = [self.first_item, count, stride, 0, first_output, idle];
        trial.global("dispatch", dispatch);
    }
}

/// Runs of up to four samples, at frames or at listed distances.
fn runs<S: Segment>(is_listed: bool) -> Twin {
    let kernel = S::KERNELS[usize::from(is_listed)];
    with_globals(kernel, "main", move |random, trial| {
        let scene = RunScene::<S>::new(random, trial);
        let (output, stride, count) = (random.below(2), 1 + random.below(3), 1 + random.below(4));
        let first_output = random.below(3);
        trial.samples(count);
        scene.dispatch(trial, stride, first_output, 0);
        let affine = Affine {
            scale: random.number() * 0.25,
            offset: random.parameter(),
        };
        let first = random.below(9) as i32 - if is_listed { 0 } else { 4 };
        let listed: [f32; 32] = std::array::from_fn(|_| random.number() * 4.0);
        if is_listed {
            trial.global("distances", listed);
        }
        let (source, bit) = scene.source_with_bit();
        let mut items = vec![(0, 0, 0, 0, 0.0, 0.0); scene.index_of_item()];
        items.push((
            source,
            output,
            count | bit,
            first,
            affine.scale,
            affine.offset,
        ));
        trial.global("items", items);
        let mut found = [[0.0; 4]; 4];
        let segment = &scene.segments[scene.source];
        match (scene.is_constant, is_listed) {
            (true, _) => found = [scene.constants[scene.source]; 4],
            (_, true) => {
                let item_distances = &listed[first as usize..];
                distances::<Vec4, S>(segment, affine, item_distances, count as usize, &mut found);
            }
            _ => frames::<Vec4, S>(segment, affine, first as f32, count as usize, &mut found),
        }
        trial.expect(vec![[UNTOUCHED; 4]; (first_output + output) as usize]);
        for rotation in &found[..count as usize - 1] {
            trial.expect(*rotation);
            trial.expect(vec![[UNTOUCHED; 4]; stride as usize - 1]);
        }
        trial.expect(found[count as usize - 1]);
    })
}

fn samples<S: Segment>() -> Twin {
    with_globals(S::KERNELS[2], "main", |random, trial| {
        let scene = RunScene::<S>::new(random, trial);
        let first_output = random.below(2);
        scene.dispatch(trial, 0, first_output, random.below(2));
        let parameter = random.parameter();
        let (source, bit) = scene.source_with_bit();
        let mut list = vec![(0, 0.0); scene.index_of_item()];
        list.push((source | bit, parameter));
        trial.global("samples", list);
        trial.expect(vec![[UNTOUCHED; 4]; (first_output + scene.index) as usize]);
        // A scale of 1 and an offset of 0 keep the parameter.
        let affine = Affine {
            scale: 1.0,
            offset: 0.0,
        };
        trial.expect(match scene.is_constant {
            true => scene.constants[scene.source],
            false => one(&scene.segments[scene.source], affine, parameter),
        });
    })
}

/// The rows of the second invocation of its sample: those after the first ones.
struct KeyRows {
    rows: Vec<Vec<StoredKey>>,
    is_key: bool,
    parameter: f32,
}

impl KeyRows {
    /// One row or two, each of so many keys; the sample lies after the key `before`, or is it.
    fn new(
        random: &mut Random,
        trial: &mut TwinTrial,
        before: u32,
        mut keys: impl FnMut(&mut Random) -> Vec<StoredKey>,
    ) -> Self {
        const SAMPLES: u32 = 2;
        // Lines of four rotations, of which rows of two begin at the first or at the third.
        let (each, line) = match random.below(2) {
            0 => (ROWS_PER_INVOCATION, 0),
            _ => (1, 3),
        };
        let count = 1 + random.below(2).min(each - 1);
        trial.samples(count);
        let rows: Vec<_> = (0..count).map(|_| keys(random)).collect();
        let keys = rows[0].len();
        let (is_key, parameter) = (random.once_in(8), random.parameter());
        let sample = random.below(SAMPLES);
        let invocation = sample + ((each * SAMPLES) & line);
        trial.argument([invocation, 1, 0]);
        trial.global("rows", [SAMPLES, keys as u32, each + count, each, line]);
        let mut samples = [(0, 0.0); SAMPLES as usize];
        samples[sample as usize] = (before | if is_key { IS_KEY } else { 0 }, parameter);
        trial.global("samples", samples);
        let mut stored = vec![[0; 4]; each as usize * keys];
        stored.extend(rows.iter().flatten().map(|key| key.stored));
        trial.global("keys", stored);
        trial.output("rotations");
        trial.expect(vec![[UNTOUCHED; 4]; (each * SAMPLES + sample) as usize]);
        Self {
            rows,
            is_key,
            parameter,
        }
    }

    /// What the rows give, one after another, with the other sample between them.
    fn expect(&self, trial: &mut TwinTrial, rotations: &[[f32; 4]]) {
        for (row, rotation) in rotations[..self.rows.len()].iter().enumerate() {
            trial.expect(vec![[UNTOUCHED; 4]; usize::from(row > 0)]);
            trial.expect(*rotation);
        }
    }
}

fn from_two_keys(kernel: &'static str, form: Form) -> Twin {
    with_globals(kernel, "main", move |random, trial| {
        let before = random.below(2) as usize;
        let rows = KeyRows::new(random, trial, before as u32, |random| {
            let is_negated = random.once_in(2);
            let mut keys = vec![StoredKey::new(random.unit(), false)];
            let pair = random.pair().map(|key| StoredKey::new(key, is_negated));
            keys.splice(before..before, pair);
            keys
        });
        let mut block = TwoKeyBlock::new(form);
        for (row, keys) in rows.rows.iter().enumerate() {
            let [from, to] = &keys[before..before + 2] else {
                unreachable!("three keys");
            };
            (block.from[row], block.to[row]) = match rows.is_key {
                true => (from.authored, from.authored),
                false => (from.continued, to.continued),
            };
            block.parameters[row] = rows.parameter;
        }
        block.count = rows.rows.len();
        in_lanes(&mut block);
        rows.expect(trial, &block.rotations);
    })
}

fn from_four_keys() -> Twin {
    with_globals("from_keys_cubics", "main", |random, trial| {
        let rows = KeyRows::new(random, trial, 1, |random| {
            let keys = random.four_keys();
            keys.map(|key| StoredKey::new(key, random.once_in(2)))
                .into()
        });
        let weights = [0; 4].map(|_| random.weights());
        trial.global("weights", weights);
        let [_, first, last, _] = weights;
        // A key without a neighbour stands in for it.
        let before = usize::from(first.kind != KEY_INNER);
        let after = 3 - usize::from(last.kind != KEY_INNER);
        let mut block: CubicBlock = bytemuck::Zeroable::zeroed();
        for (row, keys) in rows.rows.iter().enumerate() {
            for (i, key) in [before, 1, 2, after].into_iter().enumerate() {
                block.keys[i][row] = keys[key].continued;
            }
            if rows.is_key {
                block.keys[1][row] = keys[1].authored;
                block.held[row] = 1.0;
            }
            (block.weights[0][row], block.weights[1][row]) = (first, last);
            block.parameters[row] = rows.parameter;
        }
        block.count = rows.rows.len();
        in_lanes(&mut block);
        rows.expect(trial, &block.rotations);
    })
}

/// An interval with signs of both keys, the others of the list beside it.
fn prepared_arcs() -> Twin {
    const BEFORE: u32 = PREPARE_WORKGROUP; // a workgroup above this one
    const COUNT: u32 = BEFORE + 3;
    with_globals("prepare_arcs", "main", |random, trial| {
        let index = BEFORE + random.below(COUNT - BEFORE);
        let pair = random.pair();
        let negated = [random.once_in(2), random.once_in(2)];
        let mut keys = [0; 4].map(|_| random.unit().map(f32::to_bits));
        let key = random.below(3);
        for (j, (authored, is_negated)) in pair.into_iter().zip(negated).enumerate() {
            let stored = authored.map(|c| if is_negated { -c } else { c });
            keys[key as usize + j] = stored.map(f32::to_bits);
        }
        let flag = |is_negated, flag| if is_negated { flag } else { 0 };
        let flags = flag(negated[0], START_NEGATED) | flag(negated[1], END_NEGATED);
        let mut intervals = [0; COUNT as usize];
        intervals[index as usize] = key | flags;
        trial.argument([index - BEFORE, 1, 0]);
        trial.argument([1u32, 2, 1]);
        trial.global("dispatch", index + 1);
        trial.global("keys", keys);
        trial.global("intervals", intervals);
        trial.output("rotations");
        trial.expect(vec![[UNTOUCHED; 4]; 2 * index as usize]);
        let (middle, tangent) = arc_between(pair[0], pair[1]);
        trial.expect(middle);
        trial.expect(tangent);
    })
}

pub(super) fn evaluation() -> Vec<Twin> {
    vec![
        runs::<ArcSegment>(false),
        runs::<ArcSegment>(true),
        samples::<ArcSegment>(),
        runs::<PolynomialSegment>(false),
        runs::<PolynomialSegment>(true),
        samples::<PolynomialSegment>(),
        from_two_keys("from_keys_arcs", Form::Arc),
        from_two_keys("from_keys_two_keys", Form::Polynomial),
        from_four_keys(),
        prepared_arcs(),
    ]
}
