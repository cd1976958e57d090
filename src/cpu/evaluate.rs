//! Twin of `shaders/runs.wgsl`: evaluates the samples of one run in vector lanes, and writes them to a slice by
//! ordinary stores, or to whole cache lines by streaming (non-temporal) stores.

use std::marker::PhantomData;
use std::slice;

use crate::shader::ArcSegment;
use crate::simd::cache_line::CacheLine;
use crate::simd::lanes::{Lanes, MAX_LANES};
use crate::time::runs::Affine;
use crate::twin::{Evaluate, Parameters, WHOLE_DEGREE};

/// The maximum number of samples that are evaluated one by one, because most lanes of a vector would be unused.
pub(crate) const SAMPLES_ONE_BY_ONE: usize = 3;

/// Evaluates frames `first`, `first + 1`, … into `output[..count]`. Elements after `count` may be overwritten, up to
/// the end of a vector. All distances must be integers that are exact in f32, including those that fill up the last
/// vector.
#[inline(always)]
pub(crate) fn frames<L: Lanes, S: Evaluate>(
    segment: &S,
    affine: Affine,
    first: f32,
    count: usize,
    output: &mut [[f32; 4]],
) {
    if count <= SAMPLES_ONE_BY_ONE {
        for (j, rotation) in output[..count].iter_mut().enumerate() {
            *rotation = one(segment, affine, first + j as f32);
        }
        return;
    }
    frames_in_vectors::<L, S>(segment, affine, first, count, output);
}

/// The distances of a vector's samples from its first.
const STEPS: [f32; 16] = [
    0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0,
];

/// As [`frames`], with streaming stores.
#[inline(always)]
pub(crate) fn frames_past_caches<L: Lanes, S: Evaluate>(
    segment: &S,
    affine: Affine,
    first: f32,
    count: usize,
    lines: StreamingLines<'_>,
) {
    // Evaluation starts at the beginning of the cache line. The rotations that are already in the line are kept.
    let (_, there) = lines.begun;
    let (first, count) = (first - there as f32, there + count);
    frames_in_vectors::<L, S>(segment, affine, first, count, lines);
}

#[inline(always)]
fn frames_in_vectors<L: Lanes, S: Evaluate>(
    segment: &S,
    affine: Affine,
    first: f32,
    count: usize,
    output: impl Sink,
) {
    // Only a run that fits narrow vectors uses them: the rest of a longer run takes one more wide
    // vector.
    let (all, narrow) = (S::samples::<L>(), S::samples::<L::Narrow>());
    if all > narrow && count <= narrow {
        run::<L::Narrow, S, _>(
            segment,
            affine,
            count,
            FrameDistances::new::<S>(first),
            output,
        );
    } else {
        run::<L, S, _>(
            segment,
            affine,
            count,
            FrameDistances::new::<S>(first),
            output,
        );
    }
}

/// Evaluates the first `count` samples, from their `distances` from the segment's middle. The list must continue
/// after `count` up to the end of a vector.
#[inline(always)]
pub(crate) fn distances<L: Lanes, S: Evaluate>(
    segment: &S,
    affine: Affine,
    distances: &[f32],
    count: usize,
    output: &mut [[f32; 4]],
) {
    if count <= SAMPLES_ONE_BY_ONE {
        for (rotation, &distance) in output[..count].iter_mut().zip(distances) {
            *rotation = one(segment, affine, distance);
        }
        return;
    }
    let distances = ListedDistances::<S>(distances, PhantomData);
    run::<L, S, _>(segment, affine, count, distances, output);
}

/// Evaluates the sample at a distance from the segment's middle.
#[inline(always)]
pub(crate) fn one<S: Evaluate>(segment: &S, affine: Affine, distance: f32) -> [f32; 4] {
    segment.value_at(distance * affine.scale + affine.offset)
}

/// The distances of a run's samples from the segment's middle, a vector at a time.
trait Distances<L> {
    fn next(&mut self) -> L;
}

struct OfDistances<L, D> {
    distances: D,
    scale: L,
    offset: L,
}

impl<L: Lanes, D: Distances<L>> Parameters<L> for OfDistances<L, D> {
    #[inline(always)]
    fn next(&mut self) -> L {
        self.distances.next() * self.scale + self.offset
    }
}

struct FrameDistances<L> {
    next: L,
    /// The distances of the iteration after the next, computed one iteration ahead so that no iteration waits for the
    /// addition.
    after: L,
    step: L,
}

impl<L: Lanes> FrameDistances<L> {
    #[inline(always)]
    fn new<S: Evaluate>(first: f32) -> Self {
        let next = L::all(first) + S::load(&STEPS);
        let step = L::all(S::samples::<L>() as f32);
        Self {
            next,
            after: next + step,
            step,
        }
    }
}

impl<L: Lanes> Distances<L> for FrameDistances<L> {
    #[inline(always)]
    fn next(&mut self) -> L {
        let current = self.next;
        self.next = self.after;
        self.after = self.after + self.step;
        current
    }
}

struct ListedDistances<'a, S>(&'a [f32], PhantomData<S>);

impl<L: Lanes, S: Evaluate> Distances<L> for ListedDistances<'_, S> {
    #[inline(always)]
    fn next(&mut self) -> L {
        // The pipelined loop also reads parameters after its last iteration; their values have no effect.
        let Some((vector, rest)) = self.0.split_at_checked(S::samples::<L>()) else {
            return L::all(0.0);
        };
        self.0 = rest;
        S::load(vector)
    }
}

#[inline(always)]
fn run<L: Lanes, S: Evaluate, O: Sink>(
    segment: &S,
    affine: Affine,
    count: usize,
    distances: impl Distances<L>,
    output: O,
) {
    let iterations = count.div_ceil(S::samples::<L>());
    let prefetches = matches!(S::PIPELINE_FROM, Some(from) if iterations >= from);
    if S::IS_SHORT {
        vectors::<L, S, O, false, false, WHOLE_DEGREE>(segment, affine, count, distances, output);
    } else if cfg!(smallest) || !segment.is_canonical() {
        vectors::<L, S, O, true, false, WHOLE_DEGREE>(segment, affine, count, distances, output);
    } else if prefetches {
        vectors::<L, S, O, false, true, WHOLE_DEGREE>(segment, affine, count, distances, output);
    } else {
        // Nearly all curves of motion have small angles.
        match segment.degree() {
            6 => vectors::<L, S, O, false, false, 6>(segment, affine, count, distances, output),
            8 => vectors::<L, S, O, false, false, 8>(segment, affine, count, distances, output),
            _ => vectors::<L, S, O, false, false, WHOLE_DEGREE>(
                segment, affine, count, distances, output,
            ),
        }
    }
}

/// Evaluates a run of a segment of this degree; [`VectorLoop`] explains `FILTER` and `PREFETCH`.
#[inline(always)]
fn vectors<
    L: Lanes,
    S: Evaluate,
    O: Sink,
    const FILTER: bool,
    const PREFETCH: bool,
    const DEGREE: usize,
>(
    segment: &S,
    affine: Affine,
    count: usize,
    distances: impl Distances<L>,
    output: O,
) {
    let mut parameters = OfDistances {
        distances,
        scale: L::all(affine.scale),
        offset: L::all(affine.offset),
    };
    let constant = L::all(segment.constant());
    let begun = S::begin::<L, PREFETCH>(constant, &mut parameters);
    // The constants are copied before the first sample is stored. This is faster for arcs, and for polynomials that
    // come from memory, as in long results. If a polynomial is in the cache, loading each coefficient where it is used
    // is faster.
    let copy;
    let is_copied = O::STREAMS || size_of::<S>() <= size_of::<ArcSegment>();
    let segment = match is_copied {
        true => {
            copy = *segment;
            &copy
        }
        false => segment,
    };
    let vector_loop = VectorLoop::<_, _, _, FILTER, PREFETCH, DEGREE> {
        segment,
        constant,
        begun,
        parameters,
    };
    output.store_samples(count, vector_loop);
}

/// The maximum number of samples of one iteration of the evaluation loop.
const MAX_SAMPLES: usize = MAX_LANES;

/// Evaluates a run, [`Evaluate::samples`] samples in each iteration. With `FILTER`, components below 2^-64 in
/// magnitude become 0; with `PREFETCH`, the computation of samples starts several iterations ahead.
pub(crate) struct VectorLoop<
    'a,
    L: Lanes,
    S: Evaluate,
    P,
    const FILTER: bool,
    const PREFETCH: bool,
    const DEGREE: usize,
> {
    pub(crate) segment: &'a S,
    pub(crate) constant: L,
    pub(crate) begun: S::Begun<L>,
    pub(crate) parameters: P,
}

/// The vectors of a run, for any kind of parameters.
pub(crate) trait NextVectors<L: Lanes, S: Evaluate> {
    fn next(&mut self) -> S::Vectors<L>;
}

impl<
    L: Lanes,
    S: Evaluate,
    P: Parameters<L>,
    const FILTER: bool,
    const PREFETCH: bool,
    const DEGREE: usize,
> NextVectors<L, S> for VectorLoop<'_, L, S, P, FILTER, PREFETCH, DEGREE>
{
    #[inline(always)]
    fn next(&mut self) -> S::Vectors<L> {
        let (begun, parameters) = (self.begun, &mut self.parameters);
        let (begun, vectors) = (self.segment).evaluate::<L, FILTER, PREFETCH, DEGREE>(
            self.constant,
            begun,
            parameters,
        );
        self.begun = begun;
        vectors
    }
}

pub(crate) trait Sink {
    /// Whether its stores bypass the caches.
    const STREAMS: bool;

    /// Stores the first `count` samples.
    fn store_samples<L: Lanes, S: Evaluate>(self, count: usize, vectors: impl NextVectors<L, S>);
}

/// Ordinary stores. Elements after `count` may be overwritten, up to the end of an iteration.
impl Sink for &mut [[f32; 4]] {
    const STREAMS: bool = false;

    #[inline(always)]
    fn store_samples<L: Lanes, S: Evaluate>(
        self,
        count: usize,
        mut vectors: impl NextVectors<L, S>,
    ) {
        let samples = S::samples::<L>();
        let whole = count.next_multiple_of(samples).min(self.len());
        let mut all = self[..whole].chunks_exact_mut(samples);
        for rotations in &mut all {
            store(&vectors.next(), rotations);
        }
        let rest = all.into_remainder();
        if !rest.is_empty() {
            let mut rotations = AlignedRotations([[0.0; 4]; MAX_SAMPLES]);
            store(&vectors.next(), &mut rotations.0[..samples]);
            rest.copy_from_slice(&rotations.0[..rest.len()]);
        }
    }
}

#[repr(align(64))]
struct AlignedRotations([[f32; 4]; MAX_SAMPLES]);

#[inline(always)]
fn store<L: Lanes>(vectors: &impl AsRef<[L]>, rotations: &mut [[f32; 4]]) {
    let parts = rotations.chunks_exact_mut(L::COUNT / 4);
    for (vector, part) in vectors.as_ref().iter().zip(parts) {
        vector.store_side_by_side(part);
    }
}

/// Streaming stores: the whole cache lines of the result, and the staging lines before and after them. The first
/// sample of the first iteration is at the start of a line.
pub(crate) struct StreamingLines<'a> {
    /// The first staging line, and the number of its rotations that are already computed and must not change.
    pub(crate) begun: (CacheLine, usize),
    pub(crate) whole: &'a mut [CacheLine],
    /// The staging line for the samples after the whole lines.
    pub(crate) rest: &'a mut CacheLine,
}

impl Sink for StreamingLines<'_> {
    const STREAMS: bool = true;

    #[inline(always)]
    fn store_samples<L: Lanes, S: Evaluate>(
        self,
        count: usize,
        mut vectors: impl NextVectors<L, S>,
    ) {
        let rotations = L::COUNT / 4;
        let vectors_each = S::samples::<L>() / rotations;
        let (begun, there) = self.begun;
        let begun: &[L::Block] = bytemuck::cast_slice(slice::from_ref(&begun));
        let whole: &mut [L::Block] = bytemuck::cast_slice_mut(self.whole);
        let rest = bytemuck::cast_slice_mut(slice::from_mut(self.rest));
        // From here on, `count` and `made` are numbers of vectors.
        let (count, mut made) = (count.div_ceil(rotations), 0);
        while made < begun.len() {
            for (i, vector) in (made..).zip(vectors.next().as_ref()) {
                let vector = match begun.get(i) {
                    Some(staged) => {
                        let there = there.saturating_sub(i * rotations).min(rotations);
                        vector.behind(staged, there)
                    }
                    None => *vector,
                };
                put(vector, i, whole, rest);
            }
            made += vectors_each;
        }
        let first = made.min(whole.len());
        let mut all = whole[first..].chunks_exact_mut(vectors_each);
        for blocks in &mut all {
            for (vector, block) in vectors.next().as_ref().iter().zip(blocks) {
                vector.store_past_caches(block);
            }
            made += vectors_each;
        }
        let whole = all.into_remainder();
        let left = count.saturating_sub(made);
        for first in (0..left).step_by(vectors_each) {
            for (i, vector) in (first..).zip(vectors.next().as_ref()) {
                put(*vector, i, whole, rest);
            }
        }
    }
}

/// Stores the `i`th vector: to a whole line, or to the rest after the whole lines.
#[inline(always)]
fn put<L: Lanes>(vector: L, i: usize, whole: &mut [L::Block], rest: &mut [L::Block]) {
    if let Some(block) = whole.get_mut(i) {
        vector.store_past_caches(block);
    } else if let Some(block) = rest.get_mut(i - whole.len()) {
        vector.store_side_by_side(bytemuck::cast_slice_mut(slice::from_mut(block)));
    }
}

#[cfg(test)]
mod tests {
    use fastrand::Rng;

    use glam::Vec4;

    use crate::math::canonical::canonical;
    use crate::twin::COARSE;

    use super::*;
    use crate::shader::PolynomialSegment;

    /// Both signs, magnitudes about 2^-40 and below, and zero.
    fn hostile(random: &mut Rng) -> f32 {
        let sign = if random.bool() { 1.0 } else { -1.0 };
        match random.u32(0..8) {
            0 => 0.0,
            1 => sign * random.f32(),
            2 => sign * (1.0 + random.f32()) * 2.0f32.powi(random.i32(-140..-38)),
            _ => sign * (1.0 + random.f32()) * 2.0f32.powi(random.i32(-43..-38)),
        }
    }

    fn four(random: &mut Rng) -> [f32; 4] {
        std::array::from_fn(|_| canonical(hostile(random)))
    }

    /// How many components of some samples [`canonical`] changes.
    fn changed<S: Evaluate>(segment: &S, random: &mut Rng) -> usize {
        let mut changed = 0;
        for _ in 0..32 {
            let parameter = (random.f32() - 0.5) * 2.0f32.powi(-random.i32(0..30));
            let q = segment.at(parameter).to_array();
            let differs = |c: &f32| canonical(*c).to_bits() != c.to_bits();
            changed += q.iter().filter(|c| differs(c)).count();
        }
        changed
    }

    /// Catches a limit that is too low: then a component whose terms cancel would keep a tiny value that other devices
    /// replace by 0.
    #[test]
    fn segments_that_say_so_have_no_tiny_components() {
        let random = &mut Rng::with_seed(1);
        let (mut canonical, mut others) = (0, 0);
        for _ in 0..20_000 {
            let arc = ArcSegment {
                middle: four(random),
                tangent: four(random),
            };
            let polynomial = PolynomialSegment {
                coefficients: std::array::from_fn(|_| four(random)),
            };
            for (is_canonical, changed) in [
                (arc.is_canonical(), changed(&arc, random)),
                (polynomial.is_canonical(), changed(&polynomial, random)),
            ] {
                assert!(!is_canonical || changed == 0);
                canonical += usize::from(is_canonical);
                others += usize::from(changed > 0);
            }
        }
        assert!(canonical > 300 && others > 1000, "{canonical} {others}");
    }

    /// The case nearest to the limit: two numbers that nearly cancel leave 2^-63.
    #[test]
    fn the_limit_is_where_terms_cancel_to_a_tiny_rest() {
        let nearly_zero = |middle: f32| {
            let mut coefficients = [[0.0; 4]; 11];
            coefficients[0] = [middle; 4];
            coefficients[1] = [-2.0 * middle.next_up(); 4];
            PolynomialSegment { coefficients }
        };
        let at_limit = nearly_zero(COARSE);
        assert!(at_limit.is_canonical());
        assert_eq!(at_limit.at(0.5), Vec4::splat(-(2.0f32.powi(-63))));
        let below = nearly_zero(COARSE * 0.125);
        assert!(!below.is_canonical());
        assert_eq!(below.at(0.5), Vec4::splat(-(2.0f32.powi(-66))));
        assert_eq!(canonical(-(2.0f32.powi(-66))).to_bits(), 0);
    }
}
