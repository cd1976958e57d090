//! Frames of a track, computed directly from its keys: there is a lane for each interval between two keys that contains
//! samples. The curve of an interval is made once for all of its samples, and stays in registers while these are
//! evaluated and stored. The samples of an interval, their parameters and the weights of tangents depend only on the
//! key times. Therefore they are kept for the following tracks with the same times.

use std::ops::Range;

use crate::from_keys::KeyCurve;
use crate::from_keys::cubics::sample;
use crate::shader::{IS_KEY, KEY_INNER, KeySample, TangentWeights};
use crate::simd::dispatch::{InLanesInto, VectorWidth, in_lanes_into};
use crate::simd::lanes::{Lanes, MAX_LANES, canonical};
use crate::simd::together::Together;
use crate::twin::arc_between::arc_between;
use crate::twin::evaluate_arc::{norm_squared, on_arc};
use crate::twin::small_angle::{SmallAngleCubic, small_angle_cubic};

/// The maximum number of samples of a lane. An interval with more samples takes several lanes, so that all lanes have
/// about the same number.
const SAMPLES: usize = 8;

/// With fewer lanes most of a vector would be unused; then the samples of several tracks share vectors.
pub(crate) const MIN_LANES: usize = 8;

/// The samples of a track's intervals.
pub(crate) struct IntervalPlan {
    curve: KeyCurve,
    /// The number of the frame plan from which this one was made.
    number: usize,
    vectors: Vec<IntervalLanes>,
    /// A vector for each sample of a vector's lanes.
    parameters: Vec<[f32; MAX_LANES]>,
    /// Samples at keys: the key, and the sample's index.
    held: Vec<(u32, u32)>,
    lane_count: usize,
}

/// Intervals in the lanes of a vector.
pub(crate) struct IntervalLanes {
    /// The key before each interval, those at its start and its end, and the one after it.
    keys: [[u32; MAX_LANES]; 4],
    /// Whether they are the keys of consecutive intervals.
    are_in_order: bool,
    /// At the start and at the end of each interval, by the fields of [`TangentWeights`].
    weights: [[[f32; MAX_LANES]; 4]; 2],
    /// The index of the first sample of each, and the number of its samples; unused lanes have none.
    first: [u32; MAX_LANES],
    count: [u32; MAX_LANES],
    /// The number of lanes in use.
    used: usize,
    /// The fewest and the most samples of a lane.
    min_count: usize,
    max_count: usize,
    /// The index of the vector's first parameters.
    parameters: usize,
}

impl IntervalPlan {
    pub(crate) fn new(curve: KeyCurve) -> Self {
        Self {
            curve,
            number: 0,
            vectors: Vec::new(),
            parameters: Vec::new(),
            held: Vec::new(),
            lane_count: 0,
        }
    }

    /// Whether there are so few intervals that a lane for each sample is faster. Samples that are all at keys need no
    /// lane.
    pub(crate) fn is_short(&self) -> bool {
        (1..MIN_LANES).contains(&self.lane_count) || self.curve == KeyCurve::TwoKeys
    }

    /// Finds the intervals that contain these samples of the frame plan with this number, unless they are found already.
    /// `weights` are those of all keys.
    pub(crate) fn find(
        &mut self,
        number: usize,
        samples: &[KeySample],
        weights: &[TangentWeights],
    ) {
        if self.number == number {
            return;
        }
        self.number = number;
        self.vectors.clear();
        self.parameters.clear();
        self.held.clear();
        self.lane_count = 0;
        let mut first = 0;
        for run in samples.chunk_by(|one, next| one.key == next.key) {
            let key = run[0].key;
            if key & IS_KEY != 0 {
                let indices = first as u32..(first + run.len()) as u32;
                self.held
                    .extend(indices.map(|index| (key & !IS_KEY, index)));
            } else {
                for (i, some) in run.chunks(SAMPLES).enumerate() {
                    self.push(key, first + i * SAMPLES, some, weights);
                }
            }
            first += run.len();
        }
        for vector in &mut self.vectors {
            vector.finish(self.curve);
        }
    }

    /// The vectors of intervals, in order of time.
    pub(crate) fn vectors(&self) -> &[IntervalLanes] {
        &self.vectors
    }

    /// The parameters of the samples in a lane.
    #[inline(always)]
    pub(crate) fn parameters_of(
        &self,
        lanes: &IntervalLanes,
        lane: usize,
    ) -> impl Iterator<Item = f32> {
        let parameters = self.parameters[lanes.parameters..].iter();
        parameters.map(move |parameters| parameters[lane])
    }

    /// Stores the samples at keys.
    pub(crate) fn store_keys(&self, keys: &[[f32; 4]], output: &mut [[f32; 4]]) {
        for &(key, index) in &self.held {
            output[index as usize] = keys[key as usize];
        }
    }

    /// Adds a lane with samples after a key.
    fn push(&mut self, key: u32, first: usize, samples: &[KeySample], weights: &[TangentWeights]) {
        let lane = self.lane_count % MAX_LANES;
        let [at_start, at_end] = match weights.get(key as usize..key as usize + 2) {
            Some(&[at_start, at_end]) => [at_start, at_end],
            _ => [bytemuck::Zeroable::zeroed(); 2],
        };
        self.lane_count += 1;
        let keys = [
            key - u32::from(at_start.kind == KEY_INNER && !weights.is_empty()),
            key,
            key + 1,
            key + 1 + u32::from(at_end.kind == KEY_INNER && !weights.is_empty()),
        ];
        if lane == 0 {
            // Unused lanes get the keys of the first lane.
            self.vectors.push(IntervalLanes::new(
                keys.map(|key| [key; MAX_LANES]),
                [at_start, at_end],
                self.parameters.len(),
            ));
        }
        let Some(vector) = self.vectors.last_mut() else {
            return;
        };
        for (lanes, key) in vector.keys.iter_mut().zip(keys) {
            lanes[lane] = key;
        }
        for (of_end, weights) in vector.weights.iter_mut().zip([at_start, at_end]) {
            let fields: [f32; 4] = bytemuck::cast(weights);
            for (lanes, field) in of_end.iter_mut().zip(fields) {
                lanes[lane] = field;
            }
        }
        vector.first[lane] = first as u32;
        vector.count[lane] = samples.len() as u32;
        vector.used = lane + 1;
        let needed = vector.parameters + samples.len();
        if self.parameters.len() < needed {
            self.parameters.resize(needed, [0.0; MAX_LANES]);
        }
        let parameters = self.parameters[vector.parameters..].iter_mut();
        for (parameters, sample) in parameters.zip(samples) {
            parameters[lane] = sample.parameter;
        }
    }
}

impl IntervalLanes {
    fn new(keys: [[u32; MAX_LANES]; 4], weights: [TangentWeights; 2], parameters: usize) -> Self {
        let in_lanes =
            |weights| bytemuck::cast::<_, [f32; 4]>(weights).map(|field| [field; MAX_LANES]);
        Self {
            keys,
            are_in_order: false,
            weights: weights.map(in_lanes),
            first: [0; MAX_LANES],
            count: [0; MAX_LANES],
            used: 0,
            min_count: 0,
            max_count: 0,
            parameters,
        }
    }

    /// Sets the fields that are computed from all lanes.
    fn finish(&mut self, curve: KeyCurve) {
        let beside = curve.beside();
        let is_in_order = |keys: &[u32; MAX_LANES]| {
            (keys.iter().zip(keys[0]..)).all(|(&key, expected)| key == expected)
        };
        self.are_in_order = self.keys[1 - beside..3 + beside].iter().all(is_in_order);
        let count = self.count.iter().map(|&count| count as usize);
        self.min_count = count.clone().min().unwrap_or_default();
        self.max_count = count.max().unwrap_or_default();
    }

    /// Each interval, and the indices of its samples.
    #[inline(always)]
    pub(crate) fn intervals(&self) -> impl Iterator<Item = (usize, Range<usize>)> {
        let starts = self.keys[1][..self.used].iter();
        let samples = self.first.iter().zip(&self.count);
        starts.zip(samples).map(|(&interval, (&first, &count))| {
            let (first, count) = (first as usize, count as usize);
            (interval as usize, first..first + count)
        })
    }
}

/// Evaluates the samples of a track with these keys, as they were added and with their signs for the shortest path;
/// returns whether all samples are resolved.
pub(crate) fn evaluate_intervals(
    width: VectorWidth,
    plan: &IntervalPlan,
    authored: &[[f32; 4]],
    signed: &[[f32; 4]],
    output: &mut [[f32; 4]],
) -> bool {
    plan.store_keys(authored, output);
    match plan.curve {
        KeyCurve::Cubics(_) => in_lanes_into(width, &Cubics(plan), signed, output),
        _ => {
            in_lanes_into(width, &Arcs(plan), signed, output);
            true
        }
    }
}

struct Arcs<'a>(&'a IntervalPlan);

impl InLanesInto<[[f32; 4]], [[f32; 4]]> for Arcs<'_> {
    const WIDE_IN_TESTS: bool = true;
    type Outcome = ();

    #[inline(always)]
    fn run<L: Lanes>(&self, keys: &[[f32; 4]], output: &mut [[f32; 4]]) {
        let mut vectors = Vectors(&self.0.vectors, 0);
        while let Some(a) = vectors.next::<L>() {
            // The last vector of an odd number is computed twice.
            let b = vectors.next::<L>().unwrap_or(a);
            let from = Together::of_rotations(a.keys::<L>(1, keys), b.keys(1, keys));
            let to = Together::of_rotations(a.keys::<L>(2, keys), b.keys(2, keys));
            let (middle, tangent) = arc_between(from, to);
            let square = norm_squared(tangent);
            for i in 0..a.lanes.max_count.max(b.lanes.max_count) {
                let parameters = [a.parameters::<L>(self.0, i), b.parameters(self.0, i)];
                let found = canonical(on_arc(middle, tangent, square, Together(parameters)));
                let [of_a, of_b] = Together::rotations(found);
                a.store(i, of_a, output);
                b.store(i, of_b, output);
            }
        }
    }
}

struct Cubics<'a>(&'a IntervalPlan);

impl InLanesInto<[[f32; 4]], [[f32; 4]]> for Cubics<'_> {
    const WIDE_IN_TESTS: bool = true;
    /// Whether all curves have small angles.
    type Outcome = bool;

    #[inline(always)]
    fn run<L: Lanes>(&self, keys: &[[f32; 4]], output: &mut [[f32; 4]]) -> bool {
        let mut are_resolved = true;
        let mut vectors = Vectors(&self.0.vectors, 0);
        while let Some(at) = vectors.next::<L>() {
            let curve: SmallAngleCubic<L> = small_angle_cubic(
                at.keys(0, keys),
                at.keys(1, keys),
                at.keys(2, keys),
                at.keys(3, keys),
                at.weights(0).into(),
                at.weights(1).into(),
            );
            let valid = L::choose(curve.is_valid, L::all(1.0), L::all(0.0));
            are_resolved &= !valid.any_at_most(0.0);
            for i in 0..at.lanes.max_count {
                at.store(i, sample(&curve, at.parameters(self.0, i)), output);
            }
        }
        are_resolved
    }
}

/// The vectors of intervals that are still to be evaluated, and the first lane of the next.
struct Vectors<'a>(&'a [IntervalLanes], usize);

impl<'a> Vectors<'a> {
    #[inline(always)]
    fn next<L: Lanes>(&mut self) -> Option<VectorAt<'a>> {
        let (lanes, rest) = self.0.split_first()?;
        let at = VectorAt {
            lanes,
            lane: self.1,
        };
        self.1 += L::COUNT;
        if self.1 >= lanes.used {
            *self = Self(rest, 0);
        }
        Some(at)
    }
}

/// The intervals in the lanes from `lane` on, as many as a vector has.
#[derive(Clone, Copy)]
struct VectorAt<'a> {
    lanes: &'a IntervalLanes,
    lane: usize,
}

impl VectorAt<'_> {
    /// The keys before, at the start, at the end and after each interval: by `end` 0 to 3.
    #[inline(always)]
    fn keys<L: Lanes>(self, end: usize, keys: &[[f32; 4]]) -> [L; 4] {
        let indices = &self.lanes.keys[end][self.lane..];
        match self.lanes.are_in_order {
            true => L::load_rotations(&keys[indices[0] as usize..]),
            false => L::gather_rotations(keys, indices),
        }
    }

    /// The tangent weights at the start or at the end of each interval.
    #[inline(always)]
    fn weights<L: Lanes>(self, end: usize) -> [L; 4] {
        let [before, after, outgoing, kind] = &self.lanes.weights[end];
        [
            L::load(&before[self.lane..]),
            L::load(&after[self.lane..]),
            L::load(&outgoing[self.lane..]),
            L::load(&kind[self.lane..]),
        ]
    }

    /// The parameter of each interval's sample `i`; any number for intervals with fewer samples.
    #[inline(always)]
    fn parameters<L: Lanes>(self, plan: &IntervalPlan, i: usize) -> L {
        let i = i.min(self.lanes.max_count - 1);
        L::load(&plan.parameters[self.lanes.parameters + i][self.lane..])
    }

    /// Stores sample `i` of each interval that has as many.
    #[inline(always)]
    fn store<L: Lanes>(self, i: usize, components: [L; 4], output: &mut [[f32; 4]]) {
        let rotations = L::rotations(components);
        let first = &self.lanes.first[self.lane..self.lane + L::COUNT];
        if i < self.lanes.min_count {
            for (&first, rotation) in first.iter().zip(rotations.as_ref()) {
                output[first as usize + i] = *rotation;
            }
            return;
        }
        let counts = &self.lanes.count[self.lane..self.lane + L::COUNT];
        for ((&first, &count), rotation) in first.iter().zip(counts).zip(rotations.as_ref()) {
            if i < count as usize {
                output[first as usize + i] = *rotation;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use fastrand::Rng;
    use glam::{EulerRot, Quat};

    use super::*;
    use crate::device::Device;
    use crate::engine::Engine;
    use crate::fit::tangent_weights::TrackWeights;
    use crate::from_keys::UNRESOLVED;
    use crate::method::interpolation::Interpolation;
    use crate::method::{BESSEL_OVERHAUSER, CATMULL_ROM, Method, SLERP};
    use crate::output::rotations::{Layout, Rotations};
    use crate::prepare::clip_data::{ClipData, PrepareRequest};
    use crate::time::frame_clock::FrameClock;
    use crate::time::frames::{SampleTimes, Ticks};
    use crate::time::key_samples::FramePlan;
    use crate::time::runs::NONE;
    use crate::tracks::set::TrackSet;
    use crate::tracks::track_keys::TrackKeys;

    /// Groups of tracks with the same times, of few and of many keys, even and uneven, with gaps of many frames, signs
    /// that change, and some curves of large angles.
    fn motion(random: &mut Rng) -> TrackSet {
        let mut set = TrackSet::new();
        let mut times: Vec<f64> = Vec::new();
        for track in 0..48 {
            let group = track / 8;
            if track % 8 == 0 {
                let mut time = 0.25;
                let mut next = |_| {
                    time += match group % 3 {
                        0 => 1.0 / 30.0,
                        1 => (1.0 + random.f64()) / 40.0,
                        _ if random.u32(0..12) == 0 => 0.5,
                        _ => 1.0 / 48.0,
                    };
                    time
                };
                times = (0..[5, 20, 33, 90][group % 4]).map(&mut next).collect();
            }
            let mut rotation = Quat::IDENTITY;
            let keys: Vec<Quat> = (times.iter())
                .map(|_| {
                    let widest = if random.u32(0..15) == 0 { 0.8 } else { 0.05 };
                    let [x, y, z] = [(); 3].map(|()| (random.f32() - 0.5) * widest);
                    rotation = (rotation * Quat::from_euler(EulerRot::XYZ, x, y, z)).normalize();
                    if random.bool() && track % 8 == 5 {
                        -rotation
                    } else {
                        rotation
                    }
                })
                .collect();
            set.push("", &times, &keys).unwrap();
        }
        set
    }

    fn curve_of(method: Method) -> KeyCurve {
        let interpolation = Interpolation::from(method);
        let plain = interpolation.plain().and_then(|smooth| smooth.fast);
        plain.map_or(KeyCurve::Arcs, |fast| KeyCurve::Cubics(fast.weights))
    }

    /// Every vector width has the bits of segments, in any part of the frames. Samples for which the series is not
    /// exact enough are marked, and there are few of them.
    #[test]
    fn lanes_of_intervals_have_the_bits_of_segments() {
        let set = &motion(&mut Rng::with_seed(7));
        let engine = Engine::new(Device::Cpu).unwrap();
        let (mut marked, mut all) = (0, 0);
        for (method, rate) in [SLERP, BESSEL_OVERHAUSER, CATMULL_ROM]
            .into_iter()
            .flat_map(|method| [24, 30, 60, 97, 240].map(|rate| (method, rate)))
        {
            let interpolation = Interpolation::from(method);
            let frames = SampleTimes::fps(rate);
            let clip = engine.upload(set, method).unwrap();
            let timeline = frames.resolve(set.track_count(), set.time_span()).unwrap();
            let count = timeline.len();
            // The expected samples are requested three at a time: so few samples are evaluated one by one, each from
            // its segment.
            let mut expected = vec![[0.0; 4]; set.track_count() * count];
            for first in (0..count).step_by(3) {
                let some = first..count.min(first + 3);
                let part = clip.request(&frames).samples(some.clone());
                let part = part.evaluate().unwrap();
                let rows = part.as_arrays().chunks(some.len());
                for (row, expected) in rows.zip(expected.chunks_mut(count)) {
                    expected[some.clone()].copy_from_slice(row);
                }
            }
            let Ticks::Frames { rate, start } = timeline.ticks else {
                unreachable!()
            };
            let clock = FrameClock::new(rate, start, false);
            for window in [0..count, 0..7, count / 3..count - 5] {
                let curve = curve_of(method);
                let mut frame_plan = FramePlan::new();
                let mut plan = IntervalPlan::new(curve);
                let mut weights = match curve {
                    KeyCurve::Cubics(rule) => Some(TrackWeights::new(rule, interpolation.ends)),
                    _ => None,
                };
                for track in 0..set.track_count() {
                    let keys = TrackKeys::whole(set, track);
                    let (samples, number) = frame_plan.samples(keys, clock, &window).unwrap();
                    let weights = weights.as_mut().map_or(&[][..], |weights| {
                        weights.weights_of(keys.times, 0, keys.track_key_count)
                    });
                    plan.find(number, samples, weights);
                    let (mut signed, authored) = (Vec::new(), keys.authored());
                    let signed = keys.signed(&mut signed);
                    let row = &expected[track * count..][window.clone()];
                    for width in VectorWidth::available() {
                        let mut found = vec![[9.0; 4]; window.len()];
                        let is_resolved =
                            evaluate_intervals(width, &plan, authored, signed, &mut found);
                        assert_eq!(is_resolved, !found.contains(&UNRESOLVED));
                        for (found, expected) in found.iter().zip(row) {
                            all += 1;
                            marked += usize::from(*found == UNRESOLVED);
                            let same = found.map(f32::to_bits) == expected.map(f32::to_bits);
                            assert!(
                                same || *found == UNRESOLVED,
                                "{method}, track {track}, {width}"
                            );
                        }
                    }
                }
            }
            let is_shared = |class: &u32| *class != NONE;
            let data = ClipData::new(set, interpolation, PrepareRequest::all(set)).unwrap();
            assert!(data.time_classes().iter().any(is_shared));
            let expected: Vec<[u32; 4]> = (expected.iter())
                .map(|rotation| rotation.map(f32::to_bits))
                .collect();
            let bits = |rotations: &Rotations| -> Vec<[u32; 4]> {
                let arrays = rotations.as_arrays().iter();
                arrays.map(|rotation| rotation.map(f32::to_bits)).collect()
            };
            // Results from keys, and of a kept clip in both layouts.
            let of_keys = engine.evaluate(set, method, &frames).unwrap();
            assert!(bits(&of_keys) == expected, "{method} from keys");
            assert!(
                bits(&clip.evaluate(&frames).unwrap()) == expected,
                "{method}, kept"
            );
            let by_frame = clip.request(&frames).layout(Layout::FrameMajor);
            let by_frame = bits(&by_frame.evaluate().unwrap());
            let tracks = set.track_count();
            let is_same = |i: usize| by_frame[i] == expected[i % tracks * count + i / tracks];
            assert!((0..by_frame.len()).all(is_same), "{method}, frame by frame");
        }
        assert!(marked > 0 && marked * 5 < all, "{marked} of {all}");
    }
}
