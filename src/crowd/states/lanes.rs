//! States of as many instances as a vector has lanes, joint by joint: the keys or constants of a joint are gathered
//! from the clips of all of these instances, so that no lane is idle, whatever the number of joints. The bits do not
//! depend on which instances share a group. The numbers of all joints of a group stay in vectors from the keys to the
//! results.

use crate::crowd::clip_keys::{next, unpacked};
use crate::crowd::states::{
    ClipMoment, JOINT_NUMBERS, Joint, LocatedTicks, MotionStates, PoseValues, Poses, canonical3,
};
use crate::math::quaternion::{product, scaled};
use crate::shader::{
    CHANNELS, CrowdChannel, CrowdLink, FORM_CONSTANT, FORM_KEYS, FORM_PACKED, FORM_POLYNOMIAL,
    ON_KEY, POWERS, TICKS, TRANSLATION,
};
use crate::simd::lanes::{Lanes, MAX_LANES, canonical};
use crate::twin::arc_between::arc_between;
use crate::twin::evaluate_arc::{norm_squared, on_arc};
use crate::twin::functions::{polynomial_begin, polynomial_end};

/// Some instances, at most as many as a vector has lanes, each with a clip and a tick.
#[derive(Clone, Copy)]
pub(in crate::crowd) struct InstanceGroup<'a> {
    pub(in crate::crowd) poses: Poses<'a>,
    pub(in crate::crowd) at: &'a [(u32, u32)],
    pub(in crate::crowd) located: &'a LocatedTicks,
}

/// The clip of an instance, at its tick.
#[derive(Clone, Copy, Default)]
struct LaneClip<'a> {
    channels: &'a [CrowdChannel],
    moment: ClipMoment<'a>,
}

/// The sources of the rotations of one joint, for each lane.
#[derive(Default)]
struct LaneSources {
    /// The cells of the keys at both ends of an arc; of a polynomial the first constant, and the cells from one to the next.
    first: [u32; MAX_LANES],
    second: [u32; MAX_LANES],
    /// The cell of a value that is taken as it is, where `copied` is not 0.
    key: [u32; MAX_LANES],
    /// The value that is taken as it is: 0 for none, [`START`] or [`END`].
    copied: [f32; MAX_LANES],
    is_any_copied: bool,
    parameters: [f32; MAX_LANES],
    /// Twice the rates of the parameters.
    factors: [f32; MAX_LANES],
}

/// The key at the start of an arc, or the key of a polynomial.
const START: f32 = 1.0;

/// The key at the end of an arc.
const END: f32 = 2.0;

/// A rotation in the parent's frame, and the angular velocity about the parent's axes.
type Rotating<L> = ([L; 4], [L; 3]);

impl InstanceGroup<'_> {
    /// Computes the states in the parents' frames to `numbers`, which has [`JOINT_NUMBERS`] vectors for each joint, and the
    /// rotations to `local`, `[instance][joint]`, if it is not empty.
    #[inline(always)]
    pub(in crate::crowd) fn pose<L: Lanes>(
        &self,
        values: PoseValues,
        local: &mut [[f32; 4]],
        numbers: &mut [f32],
    ) {
        let joints = self.poses.tables.joint_count();
        let moves = values == PoseValues::Velocities;
        let mut clips = [LaneClip::default(); MAX_LANES];
        for (lane, clip) in clips.iter_mut().take(L::COUNT).enumerate() {
            // The unused lanes repeat the first instance.
            let index = if lane < self.at.len() { lane } else { 0 };
            let (of, _) = self.at[index];
            *clip = LaneClip {
                channels: self.poses.channels(of),
                moment: ClipMoment {
                    bases: self.poses.bases(of),
                    cells: self.poses.cells,
                    positions: self.located.of(index),
                },
            };
        }
        let clips = &clips[..L::COUNT];
        for (joint, numbers) in (0..joints).zip(numbers.chunks_exact_mut(JOINT_NUMBERS * L::COUNT))
        {
            let (rotation, angular_velocity) =
                rotations::<L>(self.poses.cells, clips, joint, moves);
            put::<L, _>(local, rotation, (joint, joints), |row| row);
            if values == PoseValues::Rotations {
                continue;
            }
            let (position, velocity) = translations::<L>(self.poses.cells, clips, joint, moves);
            let state = Joint {
                rotation,
                position,
                velocity,
                angular_velocity,
            };
            state.store(numbers);
        }
    }
}

/// Converts the states of a group from the parents' frames to the world.
#[inline(always)]
pub(super) fn walk<L: Lanes>(links: &[CrowdLink], values: PoseValues, numbers: &mut [f32]) {
    let each = JOINT_NUMBERS * L::COUNT;
    let moves = values == PoseValues::Velocities;
    for link in links {
        let [parent, child] = [link.parent, link.joint].map(|joint| joint as usize * each);
        let above = Joint::<L>::load(&numbers[parent..parent + each]);
        let numbers = &mut numbers[child..child + each];
        Joint::load(numbers).hung_on(&above, moves).store(numbers);
    }
}

/// Stores the states of a group in the arrays that are not left out, but for rotations in the parents' frames.
#[inline(always)]
pub(super) fn put_states<L: Lanes>(
    values: PoseValues,
    joints: usize,
    numbers: &[f32],
    states: &mut MotionStates<'_>,
) {
    for (joint, numbers) in (0..joints).zip(numbers.chunks_exact(JOINT_NUMBERS * L::COUNT)) {
        let state = Joint::<L>::load(numbers);
        let at = (joint, joints);
        put::<L, _>(states.world_rotations, state.rotation, at, |row| row);
        let [x, y, z] = state.position;
        put::<L, _>(states.positions, [x, y, z, L::all(0.0)], at, three);
        if values == PoseValues::Velocities {
            put_velocities(&state, at, states);
        }
    }
}

/// Stores the velocities of a group that are differences between two states, the numbers of which are `ends`.
#[inline(always)]
pub(super) fn put_differences<L: Lanes>(
    per_second: &[f32; MAX_LANES],
    joints: usize,
    [before, after]: &[Vec<f32>; 2],
    states: &mut MotionStates<'_>,
) {
    let each = JOINT_NUMBERS * L::COUNT;
    let pairs = before.chunks_exact(each).zip(after.chunks_exact(each));
    let per_second = L::load(per_second);
    for (joint, (before, after)) in (0..joints).zip(pairs) {
        let (before, after) = (Joint::<L>::load(before), Joint::<L>::load(after));
        let mut state = before;
        state.differ(&before, &after, per_second);
        put_velocities(&state, (joint, joints), states);
    }
}

#[inline(always)]
fn put_velocities<L: Lanes>(state: &Joint<L>, at: (usize, usize), states: &mut MotionStates<'_>) {
    let zero = L::all(0.0);
    let [x, y, z] = state.velocity;
    put::<L, _>(states.velocities, [x, y, z, zero], at, three);
    let [x, y, z] = state.angular_velocity;
    put::<L, _>(states.angular_velocities, [x, y, z, zero], at, three);
}

pub(in crate::crowd) fn three([x, y, z, _]: [f32; 4]) -> [f32; 3] {
    [x, y, z]
}

/// Stores the values of one joint of a group in an array of all joints, unless it is empty.
#[inline(always)]
pub(in crate::crowd) fn put<L: Lanes, T>(
    array: &mut [T],
    components: [L; 4],
    (joint, joints): (usize, usize),
    of: fn([f32; 4]) -> T,
) {
    if array.is_empty() {
        return;
    }
    let rows = L::rotations(components);
    let values = array[joint..].iter_mut().step_by(joints);
    for (value, row) in values.zip(rows.as_ref()) {
        *value = of(*row);
    }
}

/// The rotations of a joint.
#[inline(always)]
fn rotations<L: Lanes>(
    cells: &[[f32; 4]],
    clips: &[LaneClip<'_>],
    joint: usize,
    moves: bool,
) -> Rotating<L> {
    let index = joint * CHANNELS as usize;
    let mut forms = 0u32;
    for clip in clips {
        forms |= 1 << (clip.channels[index].form_and_base >> 24);
    }
    let mut sources = LaneSources::default();
    let found = match forms & !(1 << FORM_CONSTANT) {
        0 => Some(constants::<L>(cells, clips, index, &mut sources)),
        of if of == 1 << FORM_KEYS || of == 1 << FORM_PACKED => {
            let is_packed = of == 1 << FORM_PACKED;
            Some(arcs::<L>(
                cells,
                clips,
                (index, is_packed, moves),
                &mut sources,
            ))
        }
        of if of == 1 << FORM_POLYNOMIAL => {
            polynomials::<L>(cells, clips, (index, moves), &mut sources)
        }
        _ => None,
    };
    found.unwrap_or_else(|| one_by_one::<L>(clips, index, moves))
}

/// Rotations that are the same at every time.
#[inline(always)]
fn constants<L: Lanes>(
    cells: &[[f32; 4]],
    clips: &[LaneClip<'_>],
    index: usize,
    sources: &mut LaneSources,
) -> Rotating<L> {
    for (cell, clip) in sources.first.iter_mut().zip(clips) {
        *cell = clip.channels[index].first;
    }
    let zero = L::all(0.0);
    (
        L::gather_rotations(cells, &sources.first),
        [zero, zero, zero],
    )
}

/// Rotations along arcs between keys.
#[inline(always)]
fn arcs<L: Lanes>(
    cells: &[[f32; 4]],
    clips: &[LaneClip<'_>],
    (index, is_packed, moves): (usize, bool, bool),
    sources: &mut LaneSources,
) -> Rotating<L> {
    for (lane, clip) in clips.iter().enumerate() {
        let channel = &clip.channels[index];
        let (first, count) = (channel.first, channel.count);
        if channel.form_and_base >> 24 == FORM_CONSTANT {
            (sources.first[lane], sources.second[lane]) = (first, first);
            (sources.copied[lane], sources.is_any_copied) = (START, true);
            continue;
        }
        let base = (channel.form_and_base & 0x00ff_ffff) as usize;
        let position = clip.moment.positions[base];
        let rows = clip.moment.bases[base].count as usize;
        let (along, span) = (position.along, position.span & TICKS);
        sources.first[lane] = first + along * count;
        sources.second[lane] = first + next(along as usize, rows) as u32 * count;
        if position.span & ON_KEY != 0 || along != span {
            sources.copied[lane] = if along == span { START } else { END };
            sources.is_any_copied = true;
        }
        sources.parameters[lane] = position.parameter;
        sources.factors[lane] = 2.0 * position.rate;
    }
    let (starts, ends) = match is_packed {
        false => (
            L::gather_rotations(cells, &sources.first),
            L::gather_rotations(cells, &sources.second),
        ),
        true => (
            L::load_rotations(&unpacked_lanes(cells, clips, index, &sources.first)),
            L::load_rotations(&unpacked_lanes(cells, clips, index, &sources.second)),
        ),
    };
    let (middle, tangent) = arc_between(starts, ends);
    let parameters = L::load(&sources.parameters);
    let mut rotation = canonical(on_arc(middle, tangent, norm_squared(tangent), parameters));
    if sources.is_any_copied {
        let copied = L::load(&sources.copied);
        for (component, (start, end)) in rotation.iter_mut().zip(starts.into_iter().zip(ends)) {
            let at_end = copied.where_equal(END, end, *component);
            *component = copied.where_equal(START, start, at_end);
        }
    }
    let zero = L::all(0.0);
    let mut angular_velocity = [zero, zero, zero];
    if moves {
        angular_velocity = angular_velocities(middle, tangent, &sources.factors);
    }
    (rotation, angular_velocity)
}

/// Keys of all lanes, of which those of [`FORM_PACKED`] are unpacked.
#[inline(always)]
fn unpacked_lanes(
    cells: &[[f32; 4]],
    clips: &[LaneClip<'_>],
    index: usize,
    indices: &[u32; MAX_LANES],
) -> [[f32; 4]; MAX_LANES] {
    let halves: &[[u32; 2]] = bytemuck::cast_slice(cells);
    let mut keys = [[0.0; 4]; MAX_LANES];
    for ((key, clip), &at) in keys.iter_mut().zip(clips).zip(indices) {
        *key = match clip.channels[index].form_and_base >> 24 {
            FORM_CONSTANT => cells[at as usize],
            _ => unpacked(halves[at as usize]),
        };
    }
    keys
}

/// Rotations along polynomials; `None` where a lane is at an end that is no key.
#[inline(always)]
fn polynomials<L: Lanes>(
    cells: &[[f32; 4]],
    clips: &[LaneClip<'_>],
    (index, moves): (usize, bool),
    sources: &mut LaneSources,
) -> Option<Rotating<L>> {
    for (lane, clip) in clips.iter().enumerate() {
        let channel = &clip.channels[index];
        let (first, count) = (channel.first, channel.count);
        if channel.form_and_base >> 24 == FORM_CONSTANT {
            (sources.first[lane], sources.key[lane]) = (first, first);
            (sources.copied[lane], sources.is_any_copied) = (START, true);
            continue;
        }
        let position = clip.moment.position(channel);
        let (along, span) = (position.along, position.span & TICKS);
        sources.first[lane] = first + along * count * POWERS as u32;
        sources.second[lane] = count;
        if position.span & ON_KEY != 0 {
            sources.key[lane] = channel.keys + span * count;
            (sources.copied[lane], sources.is_any_copied) = (START, true);
        } else if along != span {
            return None;
        }
        sources.parameters[lane] = position.parameter_along;
        sources.factors[lane] = 2.0 * position.rate;
    }
    let zero = L::all(0.0);
    let mut coefficients = [[zero, zero, zero, zero]; POWERS];
    for row in &mut coefficients {
        *row = L::gather_rotations(cells, &sources.first);
        for (cell, step) in sources.first.iter_mut().zip(&sources.second) {
            *cell += step;
        }
    }
    let s = L::load(&sources.parameters);
    let begun = polynomial_begin(s);
    let mut rotation = [zero, zero, zero, zero];
    for (c, component) in rotation.iter_mut().enumerate() {
        let mut powers = [zero; POWERS];
        for (power, row) in powers.iter_mut().zip(&coefficients) {
            *power = row[c];
        }
        *component = polynomial_end(powers, begun).canonical();
    }
    if sources.is_any_copied {
        let copied = L::load(&sources.copied);
        let keys = L::gather_rotations(cells, &sources.key);
        for (component, key) in rotation.iter_mut().zip(keys) {
            *component = copied.where_equal(START, key, *component);
        }
    }
    let mut angular_velocity = [zero, zero, zero];
    if moves {
        let (mut value, mut slope) = (coefficients[POWERS - 1], [zero, zero, zero, zero]);
        for row in coefficients[..POWERS - 1].iter().rev() {
            for ((slope, value), &coefficient) in slope.iter_mut().zip(&mut value).zip(row) {
                *slope = *slope * s + *value;
                *value = *value * s + coefficient;
            }
        }
        angular_velocity = angular_velocities(value, slope, &sources.factors);
    }
    Some((rotation, angular_velocity))
}

/// The angular velocities of rotations with these derivatives by their parameters. `factors` are twice the rates of these.
#[inline(always)]
fn angular_velocities<L: Lanes>(
    [x, y, z, w]: [L; 4],
    slope: [L; 4],
    factors: &[f32; MAX_LANES],
) -> [L; 3] {
    let [x, y, z, _] = product(slope, [-x, -y, -z, w]);
    canonical3(scaled([x, y, z], L::load(factors)))
}

/// The rotations of a joint whose channels differ in form from clip to clip.
#[inline(always)]
fn one_by_one<L: Lanes>(clips: &[LaneClip<'_>], index: usize, moves: bool) -> Rotating<L> {
    let mut rotations = [[0.0; 4]; MAX_LANES];
    let mut rates = [[0.0; 4]; MAX_LANES];
    for ((rotation, rate), clip) in rotations.iter_mut().zip(&mut rates).zip(clips) {
        let channel = &clip.channels[index];
        *rotation = clip.moment.rotation(channel);
        if moves {
            *rate = clip.moment.angular_velocity(channel);
        }
    }
    let [x, y, z, _] = L::load_rotations(&rates);
    (L::load_rotations(&rotations), [x, y, z])
}

/// The translations of a joint, and their derivatives.
#[inline(always)]
fn translations<L: Lanes>(
    cells: &[[f32; 4]],
    clips: &[LaneClip<'_>],
    joint: usize,
    moves: bool,
) -> ([L; 3], [L; 3]) {
    let index = joint * CHANNELS as usize + TRANSLATION as usize;
    let mut constants = [0; MAX_LANES];
    let mut are_constant = true;
    for (cell, clip) in constants.iter_mut().zip(clips) {
        let channel = &clip.channels[index];
        are_constant &= channel.form_and_base >> 24 == FORM_CONSTANT;
        *cell = channel.first;
    }
    let zero = L::all(0.0);
    if are_constant {
        let [x, y, z, _] = L::gather_rotations(cells, &constants);
        return ([x, y, z], [zero, zero, zero]);
    }
    let mut values = [[0.0; 4]; MAX_LANES];
    let mut rates = [[0.0; 4]; MAX_LANES];
    for ((value, rate), clip) in values.iter_mut().zip(&mut rates).zip(clips) {
        let channel = &clip.channels[index];
        *value = clip.moment.value(channel);
        if moves {
            *rate = clip.moment.velocity(channel);
        }
    }
    let [x, y, z, _] = L::load_rotations(&values);
    let [a, b, c, _] = L::load_rotations(&rates);
    ([x, y, z], [a, b, c])
}
