//! Compares the sizes that a Parquet file claims with its length, before anything is decoded. The crate `parquet`
//! allocates memory for a page by the length in its header, up to 2 GiB for a header of 20 bytes.

use std::ops::Range;

use parquet::basic::Compression;
use parquet::file::metadata::{ColumnChunkMetaData, ParquetMetaData};

use crate::budget::{Budget, OverBudget};
use crate::diagnostic::{Code, Diagnostic};
use crate::limits::Limits;
use crate::parquet::thrift::{Compact, INTEGER, STRUCT};

/// The largest number of numbers for each byte of a file. Equal numbers compress best: a page of 2^20 of them may
/// have 100 bytes, but the times beside them differ and need a byte each.
const MAX_NUMBERS_PER_BYTE: u64 = 1024;

/// Up to this length, a page is allowed without a look at its compressed length. Writers begin a new page after 1 MiB.
const FREE_PAGE: u64 = 16 << 20;

/// The largest ratio of the length of a longer page to its compressed length.
const MAX_PAGE_RATIO: u64 = 64;

/// Bytes of memory of a number: while it is decoded, in its column, and in a key.
const NUMBER: usize = 32;

/// Checks the pages of some columns.
///
/// # Errors
/// When they lie outside the file, are compressed in an unsupported way, or claim more numbers or bytes than the file
/// can contain or the memory budget allows.
pub(crate) fn check_pages(
    name: &str,
    bytes: &[u8],
    metadata: &ParquetMetaData,
    roots: &[usize],
    limits: Limits,
) -> Result<(), Diagnostic> {
    let budget = Budget::of(bytes.len(), limits);
    let over = |error: OverBudget| Diagnostic::new(name, Code::Memory, error.to_string());
    let refuse = |code, message: String| Diagnostic::new(name, code, message);
    let claims = |numbers: u64, unit: &str| {
        let message = format!(
            "the file has {} bytes, but states {numbers} {unit}; it is damaged",
            bytes.len()
        );
        refuse(Code::TableClaims, message)
    };
    let limit = bytes.len() as u64 * MAX_NUMBERS_PER_BYTE;
    let schema = metadata.file_metadata().schema_descr();
    let (mut rows, mut numbers) = (0u64, 0u64);
    for group in metadata.row_groups() {
        rows = rows.saturating_add(u64::try_from(group.num_rows()).unwrap_or(u64::MAX));
        if rows > limit {
            return Err(claims(rows, "rows"));
        }
        for (leaf, column) in group.columns().iter().enumerate() {
            let root = (leaf < schema.num_columns()).then(|| schema.get_column_root_idx(leaf));
            if root.is_none_or(|root| roots.binary_search(&root).is_err()) {
                continue;
            }
            let path = column.column_path().string();
            check_compression(name, &path, column.compression())?;
            let outside = || {
                let message =
                    format!("the pages of column `{path}` lie outside the file; it is cut");
                refuse(Code::TableDamaged, message)
            };
            let mut range = chunk(column, bytes.len()).ok_or_else(outside)?;
            while !range.is_empty() {
                let page = page(&bytes[range.clone()]).ok_or_else(outside)?;
                let packed = page.compressed as u64;
                if page.uncompressed > FREE_PAGE.max(packed.saturating_mul(MAX_PAGE_RATIO)) {
                    let message = format!(
                        "a page of column `{path}` is said to have {} bytes, packed into {packed}; \
                         the file is damaged",
                        page.uncompressed
                    );
                    return Err(refuse(Code::TableClaims, message));
                }
                let count = |number: u64| usize::try_from(number).unwrap_or(usize::MAX);
                budget.take(count(page.uncompressed), 1).map_err(over)?;
                budget.take(count(page.values), NUMBER).map_err(over)?;
                numbers = numbers.saturating_add(page.values);
                if numbers > limit {
                    return Err(claims(numbers, "numbers"));
                }
                let next = range.start + page.header + page.compressed;
                if next > range.end {
                    return Err(outside());
                }
                range.start = next;
            }
        }
    }
    Ok(())
}

fn check_compression(name: &str, path: &str, found: Compression) -> Result<(), Diagnostic> {
    match found {
        Compression::UNCOMPRESSED
        | Compression::SNAPPY
        | Compression::LZ4
        | Compression::LZ4_RAW
        | Compression::ZSTD(_) => Ok(()),
        other => {
            let found = other.to_string();
            // The text of a compression may contain its level in parentheses, which is cut off.
            let found = found.split('(').next().unwrap_or_default();
            let message = format!(
                "column `{path}` is compressed by {found}; write it with snappy, zstd or LZ4"
            );
            Err(Diagnostic::new(name, Code::Compression, message))
        }
    }
}

/// The range of a column's pages in the file.
pub(super) fn chunk(column: &ColumnChunkMetaData, length: usize) -> Option<Range<usize>> {
    let start = column
        .dictionary_page_offset()
        .unwrap_or(column.data_page_offset());
    let start = usize::try_from(start).ok()?;
    let end = start.checked_add(usize::try_from(column.compressed_size()).ok()?)?;
    (end <= length).then_some(start..end)
}

/// The header of a page.
pub(super) struct PageSizes {
    /// Bytes of the header, and of the page after it.
    pub(super) header: usize,
    pub(super) compressed: usize,
    pub(super) uncompressed: u64,
    pub(super) values: u64,
    /// Whether it is a data page (version 1) with plain values.
    pub(super) is_plain: bool,
}

/// Reads a page's header. Its fields (parquet.thrift, `PageHeader`): 1 is the type, 0 for a data page;
/// 2 is the uncompressed and 3 the compressed length; 5, 7 and 8 are the headers of data pages,
/// dictionaries and data pages of version 2, whose field 1 is the number of values. Fields 2 and 3 of
/// the first are the encodings of its values, 0 for none, and of its definition levels, 3 for runs.
pub(super) fn page(bytes: &[u8]) -> Option<PageSizes> {
    let mut input = Compact { bytes, at: 0 };
    let (mut uncompressed, mut compressed, mut values) = (None, None, 0);
    let (mut page_type, mut encodings) = (None, [None; 2]);
    let mut id = 0;
    while let Some(kind) = input.field(&mut id)? {
        match (id, kind) {
            (1, INTEGER) => page_type = Some(input.integer()?),
            (2, INTEGER) => uncompressed = Some(input.integer()?),
            (3, INTEGER) => compressed = Some(input.integer()?),
            (header @ (5 | 7 | 8), STRUCT) => {
                let mut id = 0;
                while let Some(kind) = input.field(&mut id)? {
                    match (id, kind) {
                        (1, INTEGER) => values = input.integer()?,
                        (2, INTEGER) if header == 5 => encodings[0] = Some(input.integer()?),
                        (3, INTEGER) if header == 5 => encodings[1] = Some(input.integer()?),
                        _ => input.skip(kind, 0)?,
                    }
                }
            }
            _ => input.skip(kind, 0)?,
        }
    }
    Some(PageSizes {
        header: input.at,
        compressed: usize::try_from(compressed?).ok()?,
        uncompressed: u64::try_from(uncompressed?).ok()?,
        values: u64::try_from(values).ok()?,
        is_plain: page_type == Some(0) && encodings == [Some(0), Some(3)],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Type 0, lengths 300 and 20, a data page of 70 values with statistics to skip, whose encodings
    /// it does not say.
    const HEADER: [u8; 20] = [
        0x15, 0x00, 0x15, 0xd8, 0x04, 0x15, 0x28, 0x2c, 0x15, 0x8c, 0x01, 0x1c, 0x18, 0x01, b'a',
        0x00, 0x00, 0x00, 0xaa, 0xbb,
    ];

    #[test]
    fn a_header_says_its_lengths_and_values() {
        let page = page(&HEADER).unwrap();
        assert_eq!((page.header, page.compressed), (18, 20));
        assert_eq!((page.uncompressed, page.values), (300, 70));
        assert!(!page.is_plain);
    }

    #[test]
    fn a_header_that_is_cut_or_wild_is_none() {
        for end in 0..18 {
            assert!(page(&HEADER[..end]).is_none(), "{end}");
        }
        // A list of 2^60 structs, structs in structs, and a string that ends beyond the data.
        let list = [
            0x19, 0xfc, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x0f, 0x00,
        ];
        assert!(page(&list).is_none());
        assert!(page(&[0x1c; 100]).is_none());
        assert!(page(&[0x18, 0xff, 0xff, 0xff, 0x0f]).is_none());
    }
}
