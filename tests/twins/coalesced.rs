//! The entry point of cards, whose invocations take a sample each, and what tells them apart.

use crate::cpu::evaluate::one;
use crate::shader::{
    ArcSegment, BLOCK_SAMPLES, GRID_WORKGROUP, IS_CONSTANT, LINE, MAY_BE_TINY, PolynomialSegment,
};
use crate::time::runs::Affine;

use super::kernels::Segment;
use super::random::Random;
use super::trial::{Trial, Twin, UNTOUCHED, with_globals};

/// An invocation, and the sample that it takes.
struct Invocation {
    is_inside: bool,
    place: u32,
    position: u32,
    block: u32,
}

impl Invocation {
    /// Makes up an invocation that stores at one of the first places: additions of u32 wrap, so the
    /// grid may begin anywhere.
    fn new(random: &mut Random, trial: &mut Trial) -> Self {
        let group = [random.below(2), random.below(2), random.below(3)];
        let groups = [2, 2, 3];
        let tile = 2 * group[1] + group[0];
        let first_block = random.below(3);
        let is_row = random.once_in(2);
        let (own, lane, grid);
        if is_row {
            let place = random.below(40);
            lane = place % BLOCK_SAMPLES + BLOCK_SAMPLES * random.below(8);
            let index = tile * GRID_WORKGROUP + lane;
            let samples = index + random.below(3);
            let first_output = place.wrapping_sub(index);
            own = Self {
                is_inside: index < samples,
                place,
                position: place,
                block: first_block + index / BLOCK_SAMPLES,
            };
            grid = [0, 1, samples, 1, first_output, first_block];
        } else {
            lane = random.below(GRID_WORKGROUP);
            let (stride, row) = (LINE + random.below(3), random.below(12));
            let sample = group[2] * (GRID_WORKGROUP / LINE) + lane / LINE;
            // Eight neighbours begin where a line does, which may be before the row.
            let place = row / LINE * LINE + tile * LINE + lane % LINE;
            let track = place.wrapping_sub(row);
            let rows = track.wrapping_add(random.below(3)).min(40);
            let samples = sample + random.below(3);
            let block = (sample / BLOCK_SAMPLES * rows).wrapping_add(track);
            own = Self {
                is_inside: sample < samples && track < rows,
                place,
                position: sample,
                block: first_block.wrapping_add(block),
            };
            let first_output = row.wrapping_sub(sample * stride);
            grid = [0, stride, samples, rows, first_output, first_block];
        }
        trial.argument(group);
        trial.argument(groups);
        trial.argument(lane);
        trial.global("dispatch", grid);
        own
    }
}

/// Any item but the one that is meant: nothing lies in it.
const NOTHING: (u32, u32, u32, i32, f32, f32) = (0, 0, 0, 0, 0.0, 0.0);

fn entry<S: Segment>(kernel: &'static str, is_listed: bool) -> Twin {
    with_globals(kernel, "main", move |random, trial| {
        let own = Invocation::new(random, trial);
        let segments = [S::random(random), S::random(random)];
        let constants = [random.rotation(), random.rotation()];
        let (source, is_constant) = (random.below(2), random.once_in(8));
        trial.output("rotations");
        trial.global("segments", [segments[0].cells(), segments[1].cells()].concat());
        trial.global("constants", constants);
        // Items begin at some positions of the block, before this one and after it.
        let within = own.position % BLOCK_SAMPLES;
        let starts = random.word() & random.word() & random.word();
        let begun = (0..=within).filter(|bit| (starts >> bit) & 1 == 1).count();
        let first_item = random.below(3);
        let item = first_item as usize + begun;
        let mut blocks = vec![(0, 0); if own.is_inside { own.block as usize } else { 0 }];
        blocks.push((first_item, starts));
        trial.global("blocks", blocks);
        // This is the item's `j`th sample; some items end before it.
        let j = random.below(own.position.min(20) + 1);
        let count = (j + random.below(4)).min(j + 2);
        let is_own = own.is_inside && j < count;
        let affine = Affine {
            scale: random.number() * 0.25,
            offset: random.parameter(),
        };
        let first = random.below(9) as i32 - if is_listed { 0 } else { 4 };
        let listed: [f32; 32] = std::array::from_fn(|_| random.number() * 4.0);
        if is_listed {
            trial.global("distances", listed);
        }
        let distance = match is_listed {
            true => listed[first as usize + j as usize],
            false => (first + j as i32) as f32,
        };
        let segment = &segments[source as usize];
        // As on the CPU, every segment that may give a tiny component says so; others may.
        let may_be_tiny = !segment.is_canonical() || random.once_in(4);
        let bits = match (is_constant, may_be_tiny) {
            (true, _) => IS_CONSTANT,
            (false, true) => MAY_BE_TINY,
            (false, false) => 0,
        };
        let mut items = vec![NOTHING; item];
        let output = own.position - j;
        let (scale, offset) = (affine.scale, affine.offset);
        items.push((source, output, count | bits, first, scale, offset));
        items.push(NOTHING);
        trial.global("items", items);
        if is_own {
            trial.expect(vec![[UNTOUCHED; 4]; own.place as usize]);
            trial.expect(match is_constant {
                true => constants[source as usize],
                false => one(segment, affine, distance),
            });
        } else {
            trial.expect(vec![[UNTOUCHED; 4]; own.place as usize + 1]);
        }
    })
}

pub(super) fn coalesced() -> Vec<Twin> {
    vec![
        with_globals("arc_frames_coalesced_f32", "cell_of", |random, trial| {
            let own = Invocation::new(random, trial);
            trial.expect((own.place, own.position, own.block, own.is_inside));
        }),
        with_globals("arc_frames_coalesced_f32", "block_at", |random, trial| {
            let all: [u32; 6] = std::array::from_fn(|_| random.word());
            let place = random.below(3);
            trial.argument(place);
            trial.expect(all[place as usize * 2..][..2].to_vec());
            trial.global("blocks", all);
        }),
        entry::<ArcSegment>("arc_frames_coalesced_f32", false),
        entry::<ArcSegment>("arc_times_coalesced_f32", true),
        entry::<PolynomialSegment>("polynomial_frames_coalesced_f32", false),
        entry::<PolynomialSegment>("polynomial_times_coalesced_f32", true),
    ]
}
