//! Trials of the kernels over the states of a motion library's clips.

use bytemuck::Zeroable as _;

use crate::shader::{
    CHANNELS, CrowdBase, CrowdChannel, CrowdClip, CrowdLink, CrowdSpan, FORM_ARC, FORM_CONSTANT,
    FORM_CUBIC, FORM_KEYS, FORM_LINE, FORM_PACKED, FORM_POLYNOMIAL, FRAME_BALL, FRAME_FIXED,
    FRAME_FREE, FRAME_HINGE, FRAME_ROOT, FRAME_SLIDE, Kernel, MotionDispatch, MotionSample,
    NO_FRAME, ON_KEY, POSITION, POWERS, ROTATION, STATE_VECTORS, TreeFrame, VECTOR_WORDS,
    WORLD_ROTATION,
};

use super::random::Random;
use super::{Trial, bytes, groups};

const JOINTS: u32 = 7;
const INSTANCES: u32 = 23;
/// The spans of a time base, and the ticks of one of them. The last one is constant.
const SPANS: u32 = 5;
const TICKS_OF_SPAN: u32 = 12;

pub(super) fn trials(kernel: Kernel, random: &mut Random) -> Vec<Trial> {
    match kernel {
        Kernel::MotionJoints => vec![joints(random, 0), joints(random, 1)],
        Kernel::MotionWalk => vec![walk(random, 0), walk(random, 1)],
        Kernel::MotionDifferences => vec![differences(random)],
        Kernel::MotionMatrices => vec![matrices(random, 6, 1), matrices(random, 9, 0)],
        Kernel::MotionTree => vec![tree(random, 0), tree(random, 1)],
        Kernel::MotionPick => vec![picked(random)],
        _ => vec![stored(random)],
    }
}

/// States of `samples` samples: unit rotations, positions and velocities.
fn states(random: &mut Random, samples: u32) -> Vec<[f32; 4]> {
    let state = |random: &mut Random| {
        let [local, world] = random.pair();
        let mut vector = || {
            let [x, y, z] = random.vector();
            [x, y, z, 0.0]
        };
        [local, world, vector(), vector(), vector()]
    };
    (0..samples * JOINTS).flat_map(|_| state(random)).collect()
}

fn arguments(count: u32, moves: u32) -> MotionDispatch {
    MotionDispatch {
        count,
        joints: JOINTS,
        moves,
        ticks_per_second: 705_600.0,
        ..MotionDispatch::zeroed()
    }
}

/// Two clips with a time base for rotations and one for the rest; channels of all forms.
fn joints(random: &mut Random, moves: u32) -> Trial {
    const FIRST: u32 = 3;
    /// Channels that lie side by side.
    const COUNT: u32 = 2;
    let period = (SPANS - 1) * TICKS_OF_SPAN;
    let clip = |clip: u32| CrowdClip {
        period,
        first_base: 2 * clip,
        bases: 2,
    };
    let base = |base: u32| CrowdBase {
        first: base * SPANS,
        count: SPANS,
        step: 4,
    };
    let span = |random: &mut Random, index: u32| {
        let start = index % SPANS * TICKS_OF_SPAN;
        let is_key = if random.once_in(3) { 0 } else { ON_KEY };
        let is_last = index % SPANS == SPANS - 1;
        CrowdSpan {
            start: start | is_key,
            whole: (start + TICKS_OF_SPAN / 2) as i32,
            scale: if is_last {
                0.0
            } else {
                (1.0 + random.parameter()) / TICKS_OF_SPAN as f32
            },
            offset: if is_last {
                0.0
            } else {
                0.01 * random.parameter()
            },
        }
    };
    // The cells contain rotations for all forms. Every channel gets as many cells as polynomials need, which need the
    // most.
    let room = SPANS * COUNT * POWERS as u32;
    let cells: Vec<[f32; 4]> = (0..room + 4).map(|_| random.rotation()).collect();
    let channel = |random: &mut Random, kind: u32| {
        let forms: &[u32] = match kind {
            ROTATION => &[
                FORM_CONSTANT,
                FORM_ARC,
                FORM_POLYNOMIAL,
                FORM_KEYS,
                FORM_PACKED,
            ],
            _ => &[FORM_CONSTANT, FORM_CUBIC, FORM_LINE],
        };
        let form = forms[random.below(forms.len() as u32) as usize];
        CrowdChannel {
            first: random.below(COUNT),
            count: if form == FORM_CONSTANT { 0 } else { COUNT },
            form_and_base: form << 24 | u32::from(kind != ROTATION),
            keys: random.below(room - SPANS * COUNT),
        }
    };
    let spans: Vec<CrowdSpan> = (0..4 * SPANS).map(|index| span(random, index)).collect();
    let channels = 2 * JOINTS * CHANNELS;
    let channels: Vec<CrowdChannel> = (0..channels)
        .map(|index| channel(random, index % CHANNELS))
        .collect();
    // Some samples are at keys, some after the end.
    let sample = |random: &mut Random| MotionSample {
        clip: random.below(2),
        tick: match random.once_in(3) {
            true => random.below(SPANS + 1) * TICKS_OF_SPAN,
            false => random.below(period),
        },
    };
    let samples: Vec<MotionSample> = (0..FIRST + INSTANCES).map(|_| sample(random)).collect();
    let count = INSTANCES * JOINTS;
    let dispatch = MotionDispatch {
        first_sample: FIRST,
        ..arguments(count, moves)
    };
    let inputs = [
        bytes(&samples),
        bytes(&[clip(0), clip(1)]),
        bytes(&[0, 1, 2, 3].map(base)),
        bytes(&spans),
        bytes(&channels),
        bytes(&cells),
    ];
    let before = vec![[0.0; 4]; (count * STATE_VECTORS) as usize];
    Trial::new(inputs, &dispatch, groups(count as usize, false)).over(&before)
}

fn walk(random: &mut Random, moves: u32) -> Trial {
    let links = [[1, 0], [2, 0], [6, 1], [3, 2], [5, 6], [4, 6]];
    let links = links.map(|[joint, parent]| CrowdLink { joint, parent });
    let before = states(random, INSTANCES);
    let dispatch = MotionDispatch {
        links: links.len() as u32,
        ..arguments(INSTANCES, moves)
    };
    Trial::new([bytes(&links)], &dispatch, groups(INSTANCES as usize, true)).over(&before)
}

/// Differences of rotations at all angles, and of equal ones.
fn differences(random: &mut Random) -> Trial {
    const FIRST: u32 = 2;
    let mut before = states(random, 3 * INSTANCES);
    let of_instances = (INSTANCES * JOINTS * STATE_VECTORS) as usize;
    before.copy_within(of_instances..of_instances + 40, 2 * of_instances);
    let rates: Vec<f32> = (0..FIRST + INSTANCES)
        .map(|_| 60.0 * (1.0 + random.parameter()))
        .collect();
    let count = INSTANCES * JOINTS;
    let dispatch = MotionDispatch {
        first_sample: FIRST,
        ..arguments(count, 0)
    };
    Trial::new([bytes(&rates)], &dispatch, groups(count as usize, true)).over(&before)
}

fn stored(random: &mut Random) -> Trial {
    const NUMBERS: u32 = 3;
    let count = INSTANCES * JOINTS * NUMBERS;
    let dispatch = MotionDispatch {
        vector: POSITION,
        numbers: NUMBERS,
        ..arguments(count, 0)
    };
    let states = states(random, INSTANCES);
    Trial::new([bytes(&states)], &dispatch, groups(count as usize, false))
}

/// Matrices of rotations in the world, or the first `numbers` numbers of each.
fn matrices(random: &mut Random, numbers: u32, detail: u32) -> Trial {
    let count = INSTANCES * JOINTS;
    let dispatch = MotionDispatch {
        vector: WORLD_ROTATION,
        numbers,
        detail,
        ..arguments(count, 0)
    };
    let states = states(random, INSTANCES);
    Trial::new([bytes(&states)], &dispatch, groups(count as usize, false))
}

/// Frames of every kind: a root and one that is fixed in the world, each with others beneath it. Some hinges are turned
/// by many turns.
fn tree(random: &mut Random, moves: u32) -> Trial {
    const WORDS: u32 = STATE_VECTORS * VECTOR_WORDS;
    let kinds = [
        FRAME_ROOT,
        FRAME_HINGE,
        FRAME_SLIDE,
        FRAME_FIXED,
        FRAME_FIXED,
        FRAME_HINGE,
        FRAME_BALL,
        FRAME_FREE,
        FRAME_HINGE,
        FRAME_HINGE,
    ];
    let above = [NO_FRAME, 0, 1, 2, NO_FRAME, 4, 5, 6, 7, 3];
    let root_of = [
        0, 0, 0, 0, NO_FRAME, NO_FRAME, NO_FRAME, NO_FRAME, NO_FRAME, 0,
    ];
    let frame = |random: &mut Random, index: usize| {
        let track = random.below(JOINTS) * WORDS;
        let is_scalar = matches!(kinds[index], FRAME_HINGE | FRAME_SLIDE);
        let coordinate = POSITION * VECTOR_WORDS + random.below(3);
        let [x, y, z, _] = random.rotation();
        TreeFrame {
            offset: random.vector(),
            above: above[index],
            rest: random.rotation(),
            axis: [x, y, z],
            kind: kinds[index],
            source: if is_scalar { track + coordinate } else { track },
            root: root_of[index],
            multiplier: 1.0 + random.parameter(),
            shift: [0.0, -0.7, 1000.0][random.below(3) as usize],
        }
    };
    let frames: Vec<TreeFrame> = (0..kinds.len()).map(|index| frame(random, index)).collect();
    let tracks = states(random, INSTANCES);
    let before = vec![[0.0; 4]; kinds.len() * (INSTANCES * STATE_VECTORS) as usize];
    let dispatch = MotionDispatch {
        links: kinds.len() as u32,
        ..arguments(INSTANCES, moves)
    };
    let inputs = [bytes(&frames), bytes(&tracks)];
    Trial::new(inputs, &dispatch, groups(INSTANCES as usize, true)).over(&before)
}

fn picked(random: &mut Random) -> Trial {
    const NUMBERS: u32 = 9;
    const FIRST: u32 = 4;
    let vectors = JOINTS * STATE_VECTORS;
    let pick = |random: &mut Random| random.below(vectors * VECTOR_WORDS);
    let picks: Vec<u32> = (0..FIRST + NUMBERS).map(|_| pick(random)).collect();
    let count = INSTANCES * NUMBERS;
    let dispatch = MotionDispatch {
        vector: FIRST,
        numbers: NUMBERS,
        joints: vectors,
        ..arguments(count, 0)
    };
    let states = states(random, INSTANCES);
    let inputs = [bytes(&picks), bytes(&states)];
    Trial::new(inputs, &dispatch, groups(count as usize, false))
}
