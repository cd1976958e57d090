//! Checks the schema of a file before it is decoded: the crate `parquet` recurses into its groups, and reserves memory
//! for the number of columns that a group states.

use crate::parquet::thrift::{Compact, INTEGER, LIST, STRUCT};

/// Groups that are nested deeper are refused.
const DEEPEST: usize = 64;

/// Refuses metadata with a schema that is nested too deep, or has groups of more columns than there are; says why.
pub(super) fn check_schema(metadata: &[u8]) -> Result<(), String> {
    let damaged = || "its metadata cannot be decoded".to_owned();
    let mut input = Compact {
        bytes: metadata,
        at: 0,
    };
    let mut id = 0;
    while let Some(kind) = input.field(&mut id).ok_or_else(damaged)? {
        if (id, kind) != (2, LIST) {
            input.skip(kind, 0).ok_or_else(damaged)?;
            continue;
        }
        let (count, kind) = input.list().ok_or_else(damaged)?;
        // The number of columns that are still missing in each open group.
        let mut open: Vec<u64> = Vec::new();
        for read in 1..=count {
            let columns = columns_of(&mut input, kind).ok_or_else(damaged)?;
            while let Some(0) = open.last() {
                open.pop();
            }
            if let Some(left) = open.last_mut() {
                *left -= 1;
            }
            if columns > count - read {
                let more = count - read;
                return Err(format!(
                    "a group of its schema is said to have {columns} columns, and {more} follow"
                ));
            }
            if columns > 0 {
                open.push(columns);
            }
            if open.len() > DEEPEST {
                return Err(format!("its schema is nested more than {DEEPEST} deep"));
            }
        }
    }
    Ok(())
}

/// The number of columns that follow an entry of a schema as its group; 0 if the entry is not a group.
fn columns_of(input: &mut Compact<'_>, kind: u8) -> Option<u64> {
    if kind != STRUCT {
        return None;
    }
    let (mut id, mut columns) = (0, 0);
    while let Some(kind) = input.field(&mut id)? {
        match (id, kind) {
            (5, INTEGER) => columns = input.integer()?,
            _ => input.skip(kind, 0)?,
        }
    }
    Some(u64::try_from(columns).unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostic::Code;
    use crate::format::ReadOptions;
    use crate::parquet::read_parquet;

    /// A file without rows, whose schema is a chain of groups, each said to have `columns`, and a number.
    fn file(depth: usize, columns: u8) -> Vec<u8> {
        let mut metadata = vec![0x15, 0x04, 0x19, 0xfc];
        let count = depth + 1;
        metadata.extend([
            count as u8 | 0x80,
            (count >> 7) as u8 | 0x80,
            (count >> 14) as u8,
        ]);
        for _ in 0..depth {
            metadata.extend([0x35, 0x00, 0x18, 0x01, b'a', 0x15, 2 * columns, 0x00]);
        }
        metadata.extend([0x15, 0x0a, 0x25, 0x00, 0x18, 0x01, b'a', 0x00]);
        metadata.extend([0x16, 0x00, 0x19, 0x0c, 0x00]);
        let length = (metadata.len() as u32).to_le_bytes();
        [b"PAR1", &*metadata, &length, b"PAR1"].concat()
    }

    /// Schemas that are nested deeper than a thread's stack allows, or that state more columns than they have.
    #[test]
    fn schemas_that_are_too_deep_are_refused() {
        let refusal =
            |depth, columns| read_parquet("t", file(depth, columns), &ReadOptions::default());
        for (depth, columns, code, words) in [
            (60, 1, Code::NoTimes, "there are `a`"),
            (65, 1, Code::TableDamaged, "nested more than 64 deep"),
            (100_000, 1, Code::TableDamaged, "nested more than 64 deep"),
            (
                3,
                2,
                Code::TableDamaged,
                "said to have 2 columns, and 1 follow",
            ),
        ] {
            let error = refusal(depth, columns).unwrap_err();
            assert_eq!(error.code, code, "{error}");
            assert!(error.message.contains(words), "{error}");
        }
        // Cut anywhere.
        let whole = file(3, 1);
        let metadata = &whole[4..whole.len() - 8];
        assert_eq!(check_schema(metadata), Ok(()));
        for end in 0..metadata.len() {
            assert!(check_schema(&metadata[..end]).is_err(), "{end}");
        }
    }
}
