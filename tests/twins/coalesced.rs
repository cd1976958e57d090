//! The entry point of cards, whose neighbouring invocations take neighbouring samples, and what tells
//! them apart.

use crate::cpu::evaluate::one;
use crate::shader::{
    ArcSegment, BLOCK_SAMPLES, IS_CONSTANT, LINE, MAY_BE_TINY, PolynomialSegment, SAMPLES_EACH,
    WORKGROUP,
};
use crate::time::runs::Affine;

use super::kernels::Segment;
use super::trial::{Twin, TwinTrial, UNTOUCHED, with_globals};
use crate::gpu::kernel_check::random::Random;

/// The sample that an invocation evaluates in one of its rounds.
struct Cell {
    slot: u32,
    row: u32,
    position: u32,
    block: u32,
    is_inside: bool,
}

/// An invocation, where its samples begin, and those of its rounds.
struct Invocation {
    group: [u32; 3],
    groups: [u32; 3],
    lane: u32,
    corner: [u32; 3],
    rounds: [Cell; SAMPLES_EACH as usize],
}

/// Makes up an invocation that stores at some of the first slots: additions of u32 wrap, so the
/// grid may begin anywhere.
fn invocation(random: &mut Random, trial: &mut TwinTrial) -> Invocation {
    let group = [random.below(2), random.below(2), random.below(3)];
    let groups = [2, 2, 3];
    let tile = 2 * group[1] + group[0];
    let lane = random.below(WORKGROUP);
    let (line, within) = (lane / LINE, lane % LINE);
    let first_block = random.below(3);
    let rounds: [u32; SAMPLES_EACH as usize] = std::array::from_fn(|round| round as u32);
    if random.once_in(2) {
        // Track by track: the line's first index of all, and where that is stored.
        let first = (tile * WORKGROUP + line * LINE) * SAMPLES_EACH;
        let (position, shift) = (BLOCK_SAMPLES * random.below(2), random.below(5));
        let samples = first + random.below(LINE * SAMPLES_EACH + 8);
        let first_output = position.wrapping_sub(first);
        trial.global(
            "dispatch",
            [0, 1, samples, 1, first_output, first_block, shift],
        );
        let cell = |round: u32| {
            let offset = round * LINE + within;
            Cell {
                slot: position + offset + shift,
                row: 0,
                position: position + offset,
                block: first_block + (first + offset) / BLOCK_SAMPLES,
                is_inside: first + offset < samples,
            }
        };
        return Invocation {
            group,
            groups,
            lane,
            corner: [first + within, 0, first_block + first / BLOCK_SAMPLES],
            rounds: rounds.map(cell),
        };
    }
    let (stride, first_row) = (LINE + random.below(3), random.below(12));
    let first = (group[2] * (WORKGROUP / LINE) + line) * SAMPLES_EACH;
    let rows = (tile * LINE + within + random.below(4)).saturating_sub(first_row % LINE);
    let samples = first + random.below(SAMPLES_EACH + 2);
    let first_output = first_row.wrapping_sub(first * stride);
    trial.global(
        "dispatch",
        [0, stride, samples, rows, first_output, first_block, 0],
    );
    let before = first / BLOCK_SAMPLES * rows + first_block;
    let cell = |round: u32| {
        let (sample, row) = (first + round, first_row + round * stride);
        // Eight neighbours begin where a line does, which may be before the row.
        let slot = row / LINE * LINE + tile * LINE + within;
        let track = slot.wrapping_sub(row);
        let block = sample / BLOCK_SAMPLES * rows + first_block;
        Cell {
            slot,
            row: track,
            position: sample,
            block: block.wrapping_add(track),
            is_inside: sample < samples && track < rows,
        }
    };
    Invocation {
        group,
        groups,
        lane,
        corner: [first, tile * LINE + within, before],
        rounds: rounds.map(cell),
    }
}

/// Items of the list.
const ITEMS: u32 = 6;

fn entry<S: Segment>(kernel: &'static str, is_listed: bool) -> Twin {
    with_globals(kernel, "main", move |random, trial| {
        let invocation = invocation(random, trial);
        trial.argument((invocation.group, invocation.groups, invocation.lane));
        let rounds = invocation.rounds;
        let segments = [S::random(random), S::random(random)];
        let constants = [random.rotation(), random.rotation()];
        trial.output("rotations");
        let cells = [segments[0].cells(), segments[1].cells()];
        trial.global("segments", cells.concat());
        trial.global("constants", constants);
        let listed: [f32; 64] = std::array::from_fn(|_| random.number() * 4.0);
        if is_listed {
            trial.global("distances", listed);
        }
        // Some items end before the samples, or begin after them.
        let items: [_; ITEMS as usize] = std::array::from_fn(|_| {
            let (source, is_constant) = (random.below(2), random.once_in(8));
            // As on the CPU, every segment that may give a tiny component says so; others may.
            let segment = &segments[source as usize];
            let may_be_tiny = !segment.is_canonical() || random.once_in(4);
            let bits = match (is_constant, may_be_tiny) {
                (true, _) => IS_CONSTANT,
                (false, true) => MAY_BE_TINY,
                (false, false) => 0,
            };
            let output = rounds[0].position.saturating_sub(random.below(20)) + random.below(4);
            let first = random.below(9) as i32 - if is_listed { 0 } else { 4 };
            let (scale, offset) = (random.number() * 0.25, random.parameter());
            (
                source,
                output,
                random.below(50) | bits,
                first,
                scale,
                offset,
            )
        });
        trial.global("items", items);
        let last = rounds.iter().filter(|cell| cell.is_inside);
        let last = last.map(|cell| cell.block as usize).max().unwrap_or(0);
        // At most three items begin in a block.
        let mut block = || {
            let starts = (0..3).fold(0, |bits, _| bits | 1_u32 << random.below(BLOCK_SAMPLES));
            (random.below(ITEMS - 3), starts)
        };
        let blocks: Vec<(u32, u32)> = (0..=last).map(|_| block()).collect();
        let length = rounds.iter().map(|cell| cell.slot as usize + 1).max();
        let mut stored = vec![None; length.unwrap_or(0)];
        // The row of the item that was looked for last, and its index.
        let mut last: Option<(u32, usize)> = None;
        for cell in rounds.iter().filter(|cell| cell.is_inside) {
            let has = |item: usize| {
                let (_, output, count, ..) = items[item];
                cell.position.wrapping_sub(output) < count & !(IS_CONSTANT | MAY_BE_TINY)
            };
            let (_, item) = *(last.insert(match last {
                Some((row, item)) if row == cell.row && has(item) => (row, item),
                _ => {
                    let (first, starts) = blocks[cell.block as usize];
                    let within = cell.position % BLOCK_SAMPLES;
                    let begun = (0..=within).filter(|bit| (starts >> bit) & 1 == 1);
                    (cell.row, first as usize + begun.count())
                }
            }));
            if !has(item) {
                continue;
            }
            let (source, output, count, first, scale, offset) = items[item];
            let j = cell.position.wrapping_sub(output);
            let source = source as usize;
            let distance = match is_listed {
                true => listed[first as usize + j as usize],
                false => (first + j as i32) as f32,
            };
            stored[cell.slot as usize] = Some(match count & IS_CONSTANT {
                0 => one(&segments[source], Affine { scale, offset }, distance),
                _ => constants[source],
            });
        }
        trial.global("blocks", blocks);
        for value in stored {
            match value {
                Some(rotation) => trial.expect(rotation),
                None => trial.expect([UNTOUCHED; 4]),
            }
        }
    })
}

pub(super) fn coalesced() -> Vec<Twin> {
    const KERNEL: &str = "arc_frames_coalesced_f32";
    vec![
        with_globals(KERNEL, "corner_of", |random, trial| {
            let invocation = invocation(random, trial);
            trial.argument((invocation.group, invocation.groups, invocation.lane));
            trial.expect(invocation.corner);
        }),
        with_globals(KERNEL, "cell_of", |random, trial| {
            let invocation = invocation(random, trial);
            let round = random.below(SAMPLES_EACH);
            trial.argument((invocation.corner, round));
            let cell = &invocation.rounds[round as usize];
            trial.expect((
                cell.slot,
                cell.row,
                cell.position,
                cell.block,
                cell.is_inside,
            ));
        }),
        with_globals(KERNEL, "item_of", |random, trial| {
            let blocks: [(u32, u32); 3] = std::array::from_fn(|_| (random.word(), random.word()));
            let (position, block) = (random.word(), random.below(3));
            trial.argument((random.word(), random.word(), position, block, true));
            trial.global("blocks", blocks);
            let (first, starts) = blocks[block as usize];
            let begun = (0..=position % BLOCK_SAMPLES).filter(|bit| (starts >> bit) & 1 == 1);
            trial.expect(first.wrapping_add(begun.count() as u32));
        }),
        with_globals(KERNEL, "has", |random, trial| {
            let (output, count, position) = (random.below(40), random.below(40), random.below(90));
            let bits = [0, IS_CONSTANT, MAY_BE_TINY, IS_CONSTANT | MAY_BE_TINY];
            let bits = bits[random.below(4) as usize];
            trial.argument((random.word(), output, count | bits));
            trial.argument((random.word(), random.word(), random.word()));
            trial.argument(position);
            trial.expect((output..output + count).contains(&position));
        }),
        with_globals(KERNEL, "block_at", |random, trial| {
            let all: [u32; 6] = std::array::from_fn(|_| random.word());
            let slot = random.below(3);
            trial.argument(slot);
            trial.expect(all[slot as usize * 2..][..2].to_vec());
            trial.global("blocks", all);
        }),
        entry::<ArcSegment>(KERNEL, false),
        entry::<ArcSegment>("arc_times_coalesced_f32", true),
        entry::<PolynomialSegment>("polynomial_frames_coalesced_f32", false),
        entry::<PolynomialSegment>("polynomial_times_coalesced_f32", true),
    ]
}
