//! Lists that grow without copies, for inputs of unknown length.

use bytemuck::Zeroable;

/// Rows of `width` values, in blocks of increasing size. Values do not move while rows are added, and a block is
/// freed when its values have been moved to the result.
pub(crate) struct Blocks<T> {
    width: usize,
    blocks: Vec<Vec<T>>,
}

/// Bytes of the largest block, unless a row is longer.
const LARGEST: usize = 1 << 25;

impl<T: Copy + Zeroable> Blocks<T> {
    pub(crate) fn new(width: usize) -> Self {
        Self {
            width,
            blocks: Vec::new(),
        }
    }

    /// Number of values in a row.
    pub(crate) fn width(&self) -> usize {
        self.width
    }

    pub(crate) fn push(&mut self, value: T) {
        match self.blocks.last_mut() {
            Some(last) if last.len() < last.capacity() => last.push(value),
            last => {
                let row = self.width * size_of::<T>();
                let rows = last.map_or(1, |last| 2 * last.capacity() / self.width);
                let rows = rows.clamp(1, (LARGEST / row).max(1));
                let mut block = Vec::with_capacity(rows * self.width);
                block.push(value);
                self.blocks.push(block);
            }
        }
    }

    pub(crate) fn last(&self) -> Option<T> {
        self.blocks.last()?.last().copied()
    }

    /// Number of complete rows.
    pub(crate) fn rows(&self) -> usize {
        self.blocks
            .iter()
            .map(|block| block.len() / self.width)
            .sum()
    }

    /// All values, one column after another.
    pub(crate) fn into_columns(self) -> Vec<T> {
        let rows = self.rows();
        // The system provides zeroed memory only when it is first used, so this takes no time here.
        let mut columns: Vec<T> = bytemuck::zeroed_vec(rows * self.width);
        let mut row = 0;
        for block in self.blocks {
            let there = block.len() / self.width;
            for index in 0..self.width {
                let rows_of_block = &mut columns[index * rows + row..][..there];
                let column = block.iter().skip(index).step_by(self.width);
                for (slot, value) in rows_of_block.iter_mut().zip(column) {
                    *slot = *value;
                }
            }
            row += there;
        }
        columns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_become_columns() {
        for (width, rows) in [(1, 0), (1, 1), (1, 1000), (3, 1), (3, 7), (70, 100)] {
            let mut blocks = Blocks::new(width);
            for value in 0..rows * width {
                blocks.push(value);
                assert_eq!(blocks.last(), Some(value));
            }
            assert_eq!(blocks.rows(), rows);
            let columns = blocks.into_columns();
            let expected =
                (0..width).flat_map(|column| (0..rows).map(move |row| row * width + column));
            assert_eq!(columns, expected.collect::<Vec<usize>>());
        }
    }
}
