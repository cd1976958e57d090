//! The grid of a window whose samples are stored frame by frame, for devices on which neighbouring invocations evaluate
//! neighbouring tracks, if the tracks have different runs. Blocks of samples specify the item of each sample, so that no search is needed.

use std::ops::Range;

use crate::output::window::Window;
use crate::shader::{
    BLOCK_SAMPLES, Block, Grid, IS_CONSTANT, Item, LINE, MAY_BE_TINY, SAMPLES_EACH, WORKGROUP,
};
use crate::work::lists::GroupWork;

/// The rows of a window, one for each track.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GridRows {
    /// Distance in the result between neighbouring samples of a track.
    stride: u32,
    /// Samples of each track.
    samples: u32,
}

impl GridRows {
    /// `None` for a window with fewer tracks than a memory line has rotations.
    pub(crate) fn new(window: &Window) -> Option<Self> {
        let stride = window.stride() as u32;
        (stride >= LINE).then_some(Self {
            stride,
            samples: window.samples.len() as u32,
        })
    }

    /// The row and the position in it of an offset in the output.
    pub(crate) fn cell(self, offset: u32) -> (u32, u32) {
        (offset % self.stride, offset / self.stride)
    }

    /// The grids of all groups, whose blocks are consecutive. `None` as in [`GridRows::of_group`].
    pub(crate) fn of_groups(self, lists: &[GroupWork]) -> Option<Vec<GroupGrid>> {
        let mut first_block = 0;
        let grids = lists.iter().map(|list| {
            let grid = self.of_group(list, first_block)?;
            first_block += grid.blocks();
            Some(grid)
        });
        grids.collect()
    }

    /// The rows and positions of a group, whose first block has the index `first_block`. `None` if items overlap, or
    /// are not in the order of their rows and positions.
    fn of_group(self, list: &GroupWork, first_block: u32) -> Option<GroupGrid> {
        let (mut first_row, mut row, mut end) = (None, 0, 0);
        for item in items(list) {
            let (item_row, position) = self.cell(item.output);
            let is_next = item_row > row || (item_row == row && position >= end);
            if count(item) == 0 || (first_row.is_some() && !is_next) {
                return None;
            }
            first_row.get_or_insert(item_row);
            (row, end) = (item_row, position + count(item));
        }
        let first_row = first_row.unwrap_or_default();
        Some(GroupGrid {
            all: self,
            first_row,
            arguments: Grid {
                detail: 0,
                stride: self.stride,
                samples: self.samples,
                rows: row - first_row + 1,
                first_output: first_row,
                first_block,
            },
        })
    }
}

/// Writes the blocks of all groups; `nothing` is the index of an item without samples, after the items of all groups.
pub(crate) fn write_blocks(
    lists: &[GroupWork],
    grids: &[GroupGrid],
    nothing: u32,
    mut blocks: &mut [Block],
) {
    let mut first_item = 0;
    for (list, grid) in lists.iter().zip(grids) {
        let (group_blocks, others) = blocks.split_at_mut(grid.blocks() as usize);
        blocks = others;
        grid.write(list, first_item, nothing, group_blocks);
        first_item += list.item_count() as u32;
    }
}

fn items(list: &GroupWork) -> impl Iterator<Item = &Item> {
    list.chunks.iter().flat_map(|chunk| &chunk.items)
}

fn count(item: &Item) -> u32 {
    item.count & !(IS_CONSTANT | MAY_BE_TINY)
}

/// The rows of a group's samples.
#[derive(Debug, Clone, Copy)]
pub(crate) struct GroupGrid {
    all: GridRows,
    /// The index in the window of the group's first row.
    first_row: u32,
    /// The push constants of its dispatch, without the detail.
    pub(crate) arguments: Grid,
}

impl GroupGrid {
    pub(crate) fn blocks(&self) -> u32 {
        self.arguments.samples.div_ceil(BLOCK_SAMPLES) * self.arguments.rows
    }

    /// Writes the blocks of the group. `first_item` is the index of its first item in the whole list, and `nothing`
    /// the index of an item without samples.
    fn write(&self, list: &GroupWork, first_item: u32, nothing: u32, blocks: &mut [Block]) {
        blocks.fill(Block {
            first: nothing,
            starts: 0,
        });
        let end = self.arguments.samples.div_ceil(BLOCK_SAMPLES);
        // The current row, the first of its blocks that is not yet written, and the last item that began in the row.
        let (mut row, mut next, mut last) = (0, 0, nothing);
        for (index, item) in (first_item..).zip(items(list)) {
            let (item_row, position) = self.all.cell(item.output);
            let item_row = item_row - self.first_row;
            if item_row != row || index == first_item {
                self.go_on(row, next..end, last, blocks);
                // Positions before the first item of the row get this item.
                (row, next, last) = (item_row, 0, index);
            }
            let block = position / BLOCK_SAMPLES;
            self.go_on(row, next..block + 1, last, blocks);
            next = block + 1;
            let found = &mut blocks[self.block_index(row, block)];
            match position % BLOCK_SAMPLES {
                0 => found.first = index,
                _ if index == last => {}
                within => found.starts |= 1 << within,
            }
            last = index;
        }
        self.go_on(row, next..end, last, blocks);
    }

    /// Blocks of a row in which an earlier item continues.
    fn go_on(&self, row: u32, written_blocks: Range<u32>, item: u32, blocks: &mut [Block]) {
        for block in written_blocks {
            blocks[self.block_index(row, block)].first = item;
        }
    }

    /// The index of a row's block among all blocks.
    fn block_index(&self, row: u32, block: u32) -> usize {
        (block * self.arguments.rows + row) as usize
    }

    /// The workgroups of its dispatch.
    pub(crate) fn workgroups(&self) -> [u32; 3] {
        // Rows may begin up to LINE - 1 positions before the first track, so that neighbouring rows begin at a line.
        let tiles = (self.arguments.rows + LINE - 1).div_ceil(LINE);
        let samples = WORKGROUP * SAMPLES_EACH / LINE;
        [tiles, 1, self.arguments.samples.div_ceil(samples)]
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable as _;

    use super::*;
    use crate::output::rotations::Layout;
    use crate::work::lists::WorkChunk;

    /// Items with gaps between them, in two chunks, as (row, position, samples).
    fn listed(rows: GridRows, tracks: u32) -> GroupWork {
        let mut chunks = [WorkChunk::default(), WorkChunk::default()];
        let mut random = fastrand::Rng::with_seed(u64::from(rows.stride + tracks));
        // The first two tracks, and one in between, have no items.
        for track in (2..tracks).filter(|track| *track != 5) {
            let mut sample = random.u32(..40);
            while sample < rows.samples {
                let count = random.u32(1..50).min(rows.samples - sample);
                let mut item = Item::zeroed();
                (item.output, item.count) = (sample * rows.stride + track, count);
                let flags = [0, IS_CONSTANT, MAY_BE_TINY];
                item.count |= flags[random.usize(..3)];
                chunks[usize::from(track > 4)].items.push(item);
                sample += count + random.u32(..3) * random.u32(..60);
            }
        }
        let chunks = chunks.into();
        GroupWork { group: 0, chunks }
    }

    /// The item that blocks name for each sample is the one that has it, if any has.
    #[test]
    fn blocks_tell_the_item_of_every_sample() {
        for (tracks, samples) in [(9, 300), (8, 1), (40, 65), (11, 32)] {
            let window = Window::whole(tracks as usize, samples as usize, Layout::FrameMajor);
            let rows = GridRows::new(&window).unwrap();
            let list = listed(rows, tracks);
            let grid = rows.of_group(&list, 0).unwrap();
            let mut blocks = vec![Block::zeroed(); grid.blocks() as usize];
            let nothing = list.item_count() as u32 + 3;
            grid.write(&list, 3, nothing, &mut blocks);
            let all: Vec<Item> = items(&list).copied().collect();
            let mut found = 0;
            for row in 0..grid.arguments.rows {
                for position in 0..grid.arguments.samples {
                    let block = blocks[grid.block_index(row, position / BLOCK_SAMPLES)];
                    let begun = block.starts << (!position & (BLOCK_SAMPLES - 1));
                    let index = block.first + begun.count_ones();
                    let track = grid.arguments.first_output + row;
                    let has = |item: &Item| {
                        let (item_track, at) = rows.cell(item.output);
                        item_track == track && (at..at + count(item)).contains(&position)
                    };
                    let found_item = all.get((index - 3) as usize).filter(|item| has(item));
                    let expected = all.iter().find(|item| has(item));
                    assert_eq!(found_item, expected, "track {track}, sample {position}");
                    found += u32::from(found_item.is_some());
                }
            }
            assert_eq!(found, all.iter().map(count).sum::<u32>());
        }
    }

    #[test]
    fn items_in_another_order_have_no_grid() {
        let window = Window::whole(9, 300, Layout::FrameMajor);
        let rows = GridRows::new(&window).unwrap();
        let mut list = listed(rows, 9);
        list.chunks.reverse();
        assert!(rows.of_group(&list, 0).is_none());
        list.chunks.reverse();
        let first = list.chunks[0].items[0];
        list.chunks[0].items[1].output = first.output + (count(&first) - 1) * 9;
        assert!(rows.of_group(&list, 0).is_none());
        let narrow = Window::whole(7, 300, Layout::FrameMajor);
        assert!(GridRows::new(&narrow).is_none());
    }
}
