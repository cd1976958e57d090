//! The kernels over poses and that of the self-test, each beside its twin.

use std::f32::consts::FRAC_PI_2;

use bytemuck::Zeroable as _;

use crate::shader::{Link, Probe, ROOT, Reply};
use crate::twin::self_test::reply;
use crate::twin::{pose_add, pose_blend, pose_mix, pose_smooth, pose_steps, pose_world};

use super::trial::{Twin, TwinTrial, UNTOUCHED, twin, with_globals};
use crate::gpu::kernel_check::random::Random;

pub(super) fn self_test() -> Twin {
    with_globals("self_test", "main", |random, trial| {
        let n = (random.word() as i32) >> random.below(32);
        let [a, b, c] = [random.finite(), random.finite(), random.finite()];
        trial.argument([0u32; 3]);
        trial.global("probes", (a, b, c, n));
        trial.output("replies");
        let reply = reply(Probe { a, b, c, n });
        trial.expect(bytemuck::cast::<Reply, [f32; 10]>(reply));
    })
}

/// Rotations for layers, some of them opposite or nearly so.
fn layer(random: &mut Random) -> [f32; 4] {
    match random.once_in(4) {
        true => [0.0, 0.0, 0.0, 1.0],
        false => random.rotation(),
    }
}

/// Mixes the rotations at `index`.
fn mix(random: &mut Random, trial: &mut TwinTrial, index: usize) {
    let (pair, weight) = (random.pair(), random.number());
    let [from, to] = pair.map(|key| {
        let mut layer = vec![[0.0; 4]; index];
        layer.push(key);
        layer
    });
    trial.global("from_layer", from);
    trial.global("to_layer", to);
    trial.global("weights", weight);
    trial.output("mixed");
    trial.expect(vec![[UNTOUCHED; 4]; index]);
    trial.expect(pose_mix::pose(pair[0], pair[1], weight));
}

pub(super) fn poses() -> Vec<Twin> {
    vec![
        with_globals("poses_mix", "pose", |random, trial| {
            trial.argument(1u32);
            mix(random, trial, 1);
        }),
        with_globals("poses_mix", "main", |random, trial| {
            // The second row of workgroups, of one each.
            trial.argument([1, 1, 0]);
            trial.argument([1u32, 2, 1]);
            trial.global("dispatch", [66u32, 0]);
            mix(random, trial, 65);
        }),
        with_globals("poses_add", "pose", |random, trial| {
            let [base, added, reference] = [0; 3].map(|_| layer(random));
            let weight = random.number();
            trial.argument(0u32);
            trial.global("base", base);
            trial.global("layer", added);
            trial.global("reference", [reference, [weight, 0.0, 0.0, 0.0]]);
            trial.global("dispatch", [1u32, 0]);
            trial.output("added");
            trial.expect(pose_add::pose(base, added, reference, weight));
        }),
        with_globals("poses_blend", "pose", |random, trial| {
            const COUNT: usize = 2;
            let (layers, index) = (1 + random.below(3), random.below(COUNT as u32));
            let mut all = vec![[0.0; 4]; layers as usize * COUNT];
            all.fill_with(|| layer(random));
            let mut weights: Vec<f32> = (0..layers).map(|_| random.number()).collect();
            if layers == 2 && random.once_in(4) {
                // They cancel, but for a rest near 2^-20, the border of what has a direction.
                all.copy_within(..COUNT, COUNT);
                weights = vec![1.0, -1.0 + (16.0 + random.number()) / (1 << 24) as f32];
            }
            trial.argument(index);
            trial.global("dispatch", [COUNT as u32, layers]);
            trial.output("blended");
            trial.expect(vec![[UNTOUCHED; 4]; index as usize]);
            trial.expect(pose_blend::pose(&all, &weights, COUNT, index as usize));
            trial.global("layers", all);
            trial.global("weights", weights);
        }),
        twin(
            "poses_steps",
            "rotation_step",
            Random::pair,
            |[from, to]: [[f32; 4]; 2]| pose_steps::rotation_step(from, to),
        ),
        with_globals("poses_steps", "pose", |random, trial| {
            let ([value, next], are_rotations) = (random.pair(), random.below(2));
            trial.argument(1u32);
            trial.global("dispatch", [2u32, are_rotations]);
            trial.global("values", [[0.0; 4], value, next]);
            trial.output("steps");
            trial.expect([UNTOUCHED; 4]);
            trial.expect(pose_steps::pose(value, next, are_rotations == 1));
        }),
        twin(
            "poses_smooth",
            "rotated_by",
            |random: &mut Random| {
                // Near the longest rotation vector there is, or any.
                let long = [FRAC_PI_2 + 0.0007 * random.number(), 0.0, 0.0, 0.0];
                let any = random.vector::<4>();
                let vector = if random.once_in(4) { long } else { any };
                (random.rotation(), vector)
            },
            |(q, v)| pose_smooth::rotated_by(q, v),
        ),
        with_globals("poses_smooth", "pose", |random, trial| {
            let weights: Vec<f32> = (0..1 + random.below(3)).map(|_| random.number()).collect();
            let values = [random.rotation(), random.rotation()];
            let mut steps = vec![[0.0; 4]; 2 * weights.len() + 1];
            steps.fill_with(|| random.vector::<4>().map(|c| 0.3 * c));
            let (index, are_rotations) = (random.below(2), random.below(2));
            trial.argument(index);
            trial.global("dispatch", [2, 2 * weights.len() as u32 + are_rotations]);
            trial.output("smoothed");
            trial.expect(vec![[UNTOUCHED; 4]; index as usize]);
            let kind_is_rotation = are_rotations == 1;
            let smoothed =
                pose_smooth::pose(&values, &steps, &weights, kind_is_rotation, index as usize);
            trial.expect(smoothed);
            trial.global("values", values);
            trial.global("steps", steps);
            trial.global("weights", weights);
        }),
        with_globals("poses_world", "pose", |random, trial| {
            const TRACKS: usize = 3;
            // A root, then its child and a second root or a grandchild; their tracks in any order.
            let order = [[0, 1, 2], [2, 0, 1], [1, 2, 0]][random.below(3) as usize];
            let parents = [ROOT, order[0], [ROOT, order[1]][random.below(2) as usize]];
            let links: [Link; TRACKS] = std::array::from_fn(|i| Link {
                offset: random.vector(),
                track: order[i],
                parent: parents[i],
                ..Link::zeroed()
            });
            let local: [[f32; 4]; 2 * TRACKS] = std::array::from_fn(|_| random.rotation());
            let frame = random.below(2);
            trial.argument(frame);
            trial.global("local", local);
            trial.global(
                "links",
                links.map(|link| (link.offset, link.track, link.parent)),
            );
            trial.global("dispatch", [2, TRACKS as u32]);
            trial.output("world");
            let first = frame as usize * TRACKS;
            let mut world = [[0.0; 4]; 2 * TRACKS];
            pose_world::pose(&local[first..][..TRACKS], &links, &mut world);
            trial.expect(vec![[UNTOUCHED; 4]; 2 * first]);
            trial.expect(world);
        }),
    ]
}
