//! Reads pages of plain numbers, compressed by zstd or not at all, directly into the list that they become.
//!
//! The crate `parquet` makes a compressor and a decompressor for each column of each group of rows. Each of them
//! queries the features of the processor, and each query exits a virtual machine: for small files this was a third of
//! the reading time.

use std::cell::RefCell;

use bytemuck::Pod;
use parquet::basic::Compression;
use zstd::bulk::Decompressor;

use crate::parquet::pages::page;

thread_local! {
    /// The decompressor of each thread, for all files that it reads.
    static ZSTD: RefCell<Decompressor<'static>> = RefCell::default();
}

/// Appends the numbers of all pages of a column in a group of rows; `None` if a page is compressed or encoded in
/// another way, contains a null, or is damaged.
pub(super) fn append<T: Pod>(
    mut pages: &[u8],
    compression: Compression,
    may_have_nulls: bool,
    values: &mut Vec<T>,
) -> Option<()> {
    while !pages.is_empty() {
        let page = page(pages).filter(|page| page.is_plain)?;
        let (packed, rest) = pages
            .get(page.header..)?
            .split_at_checked(page.compressed)?;
        pages = rest;
        let count = usize::try_from(page.values).ok()?;
        let length = usize::try_from(page.uncompressed).ok()?;
        let bytes = count.checked_mul(size_of::<T>())?;
        let start = values.len();
        if may_have_nulls {
            let mut unpacked = vec![0; length];
            unpack(compression, packed, &mut unpacked)?;
            let numbers =
                behind_levels(&unpacked, page.values).filter(|numbers| numbers.len() == bytes)?;
            values.resize(start + count, T::zeroed());
            bytemuck::cast_slice_mut(&mut values[start..]).copy_from_slice(numbers);
        } else if length == bytes {
            values.resize(start + count, T::zeroed());
            unpack(
                compression,
                packed,
                bytemuck::cast_slice_mut(&mut values[start..]),
            )?;
        } else {
            return None;
        }
    }
    Some(())
}

fn unpack(compression: Compression, packed: &[u8], to: &mut [u8]) -> Option<()> {
    match compression {
        Compression::UNCOMPRESSED if packed.len() == to.len() => to.copy_from_slice(packed),
        Compression::ZSTD(_) => {
            let unpacked = ZSTD.with_borrow_mut(|zstd| zstd.decompress_to_buffer(packed, to));
            unpacked.ok().filter(|&length| length == to.len())?;
        }
        _ => return None,
    }
    Some(())
}

/// The bytes after the definition levels of a page, if none of its values is null. The levels are a length, and runs
/// of the level 1, each with a varint of twice its length (Parquet's "RLE/bit-packing hybrid").
fn behind_levels(page: &[u8], count: u64) -> Option<&[u8]> {
    let (length, rest) = page.split_first_chunk::<4>()?;
    let length = usize::try_from(u32::from_le_bytes(*length)).ok()?;
    let (mut levels, values) = rest.split_at_checked(length)?;
    let mut left = count;
    while left > 0 {
        let mut header = 0;
        for shift in (0..35).step_by(7) {
            let (&byte, rest) = levels.split_first()?;
            levels = rest;
            header |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                break;
            }
        }
        let (&level, rest) = levels.split_first()?;
        levels = rest;
        let run = header >> 1;
        if header & 1 == 1 || level != 1 || run == 0 {
            return None;
        }
        left = left.saturating_sub(run);
    }
    Some(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_of_no_null_are_passed_over() {
        let page = |levels: &[u8]| {
            let mut page = (levels.len() as u32).to_le_bytes().to_vec();
            page.extend_from_slice(levels);
            page.extend_from_slice(b"values");
            page
        };
        // One run of 300 values, then runs of 100 and of 200.
        for levels in [&[0xd8, 0x04, 1][..], &[0xc8, 0x01, 1, 0x90, 0x03, 1]] {
            assert_eq!(behind_levels(&page(levels), 300), Some(&b"values"[..]));
            assert_eq!(behind_levels(&page(levels), 301), None);
        }
        for levels in [
            &[][..],
            &[0xd8],
            &[0xd8, 0x04],
            // A run of nulls, a run of length 0, packed bits, and a number without an end.
            &[0xd8, 0x04, 0],
            &[0x00, 1, 0xd8, 0x04, 1],
            &[0x03, 0xff],
            &[0xff; 9],
        ] {
            assert_eq!(behind_levels(&page(levels), 300), None, "{levels:?}");
        }
        assert_eq!(behind_levels(&[9, 0, 0, 0, 2, 1], 1), None);
        assert_eq!(behind_levels(&[9, 0], 1), None);
    }
}
