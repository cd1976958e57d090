//! Trials of the kernels over poses.

use bytemuck::Zeroable as _;

use crate::shader::{Kernel, LEAST_SQUARED_SUM, Link, PoseDispatch, ROOT};

use super::random::Random;
use super::{Trial, bytes, groups};

/// The number of values of a pass: more than a workgroup, and not a multiple of its size.
const COUNT: usize = 131;

const IDENTITY: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

fn dispatch(count: usize, detail: usize) -> PoseDispatch {
    let [count, detail] = [count as u32, detail as u32];
    PoseDispatch { count, detail }
}

/// Rotations of a layer, some of them the identity.
fn layer(random: &mut Random) -> Vec<[f32; 4]> {
    let rotation = |random: &mut Random| match random.once_in(4) {
        true => IDENTITY,
        false => random.rotation(),
    };
    (0..COUNT).map(|_| rotation(random)).collect()
}

pub(super) fn trials(kernel: Kernel, random: &mut Random) -> Vec<Trial> {
    match kernel {
        Kernel::PosesAdd => vec![add(random, 1.0), add(random, 0.3)],
        Kernel::PosesBlend => vec![
            blend(random, &[0.5, 0.25, 0.25]),
            blend(random, &[1.0, -1.0]),
            // A sum whose length is just above the limit.
            blend(random, &[1.0003 * LEAST_SQUARED_SUM.sqrt(), 0.0]),
        ],
        Kernel::PosesMix => [0.0, 0.4, 1.0].map(|weight| mix(random, weight)).into(),
        Kernel::PosesSteps => vec![steps(random, true), steps(random, false)],
        Kernel::PosesSmooth => vec![smooth(random, true), smooth(random, false)],
        _ => vec![world(random)],
    }
}

fn add(random: &mut Random, weight: f32) -> Trial {
    let [base, added, mut reference] = [0; 3].map(|_| layer(random));
    reference.push([weight, 0.0, 0.0, 0.0]);
    let inputs = [bytes(&base), bytes(&added), bytes(&reference)];
    Trial::new(inputs, &dispatch(COUNT, 0), groups(COUNT, true))
}

/// Where two layers have weights that cancel, half of their rotations are equal.
fn blend(random: &mut Random, weights: &[f32]) -> Trial {
    let mut layers: Vec<_> = weights.iter().flat_map(|_| layer(random)).collect();
    layers.copy_within(..COUNT / 2, COUNT);
    let inputs = [bytes(&layers), bytes(weights)];
    let groups = groups(COUNT, false);
    Trial::new(inputs, &dispatch(COUNT, weights.len()), groups)
}

fn mix(random: &mut Random, weight: f32) -> Trial {
    let (from, to): (Vec<_>, Vec<_>) = (0..COUNT).map(|_| random.pair().into()).unzip();
    let inputs = [bytes(&from), bytes(&to), bytes(&[weight])];
    Trial::new(inputs, &dispatch(COUNT, 0), groups(COUNT, true))
}

fn steps(random: &mut Random, are_rotations: bool) -> Trial {
    let mut values: Vec<_> = (0..COUNT).flat_map(|_| random.pair()).collect();
    values.truncate(COUNT + 1);
    let dispatch = dispatch(COUNT, usize::from(are_rotations));
    Trial::new([bytes(&values)], &dispatch, groups(COUNT, false))
}

fn smooth(random: &mut Random, are_rotations: bool) -> Trial {
    const WEIGHTS: [f32; 3] = [0.4, -0.05, 0.3];
    let values: Vec<_> = (0..COUNT).map(|_| random.rotation()).collect();
    let mut steps = vec![[0.0; 4]; COUNT + 2 * WEIGHTS.len()];
    steps.fill_with(|| random.vector::<4>().map(|c| 0.3 * c));
    let inputs = [bytes(&values), bytes(&steps), bytes(&WEIGHTS)];
    let detail = 2 * WEIGHTS.len() + usize::from(are_rotations);
    Trial::new(inputs, &dispatch(COUNT, detail), groups(COUNT, true))
}

/// A chain with a branch, and a second root, listed in another order than that of the tracks.
fn world(random: &mut Random) -> Trial {
    const TRACKS: usize = 5;
    const FRAMES: usize = 71;
    let order = [3, 1, 4, 0, 2];
    let parents = [ROOT, 3, 3, 4, ROOT];
    let links: [Link; TRACKS] = std::array::from_fn(|i| Link {
        offset: random.vector(),
        track: order[i],
        parent: parents[i],
        ..Link::zeroed()
    });
    let local: Vec<_> = (0..FRAMES * TRACKS).map(|_| random.rotation()).collect();
    let inputs = [bytes(&local), bytes(&links)];
    Trial::new(inputs, &dispatch(FRAMES, TRACKS), groups(FRAMES, false))
}
