//! Appends Arrow arrays, to which Parquet is also decoded, to columns.

use std::collections::HashMap;
use std::sync::Arc;

use arrow_array::cast::AsArray;
use arrow_array::types::{
    ArrowPrimitiveType, DurationMicrosecondType, DurationMillisecondType, DurationNanosecondType,
    DurationSecondType, Float16Type, Float32Type, Float64Type, Int8Type, Int16Type, Int32Type,
    Int64Type, TimestampMicrosecondType, TimestampMillisecondType, TimestampNanosecondType,
    TimestampSecondType, UInt8Type, UInt16Type, UInt32Type, UInt64Type,
};
use arrow_array::{Array, ArrayRef, RecordBatch};
use arrow_schema::{DataType, TimeUnit as ArrowUnit};

use crate::diagnostic::{Code, Diagnostic};
use crate::format::TimeUnit;
use crate::table::columns::{
    Column, ColumnNeed, ColumnNumbers, ColumnValues, RequestedColumn, Table, wrong_type,
};

/// Collects the rows of a table while they arrive.
pub(crate) struct Gather {
    table: Table,
    known: Vec<KnownWords>,
}

/// The words of a column that occurred before.
#[derive(Default)]
struct KnownWords {
    codes: HashMap<String, u32>,
    /// The last dictionary and the codes of its words, because batches usually share one.
    last: Option<(ArrayRef, Vec<u32>)>,
}

impl Gather {
    /// For the requested columns, each with its type.
    ///
    /// # Errors
    /// When a column does not have the type that it needs.
    pub(crate) fn new<'a>(
        file: &str,
        requested: impl IntoIterator<Item = (&'a RequestedColumn, &'a DataType)>,
    ) -> Result<Self, Diagnostic> {
        let column = |(column, data_type): (&RequestedColumn, &DataType)| {
            let Some(values) = values(data_type, column.need) else {
                let found = data_type.to_string();
                return Err(wrong_type(file, &column.name, &found, column.need));
            };
            Ok(Column {
                name: column.name.clone(),
                index: column.index,
                values,
                null: None,
            })
        };
        let columns: Result<Vec<_>, _> = requested.into_iter().map(column).collect();
        let columns = columns?;
        Ok(Self {
            known: columns.iter().map(|_| KnownWords::default()).collect(),
            table: Table {
                file: file.to_owned(),
                columns,
                rows: 0,
                text: None,
            },
        })
    }

    /// Appends the rows of a batch that contains the requested columns in their order.
    ///
    /// # Errors
    /// When a column is of another type than before, or when a number does not fit.
    pub(crate) fn push(&mut self, batch: &[&dyn Array], rows: usize) -> Result<(), Diagnostic> {
        let columns = self
            .table
            .columns
            .iter_mut()
            .zip(&mut self.known)
            .zip(batch);
        for ((column, known), array) in columns {
            let (rows, before) = (array.len(), column.len());
            if array.null_count() > 0 && column.null.is_none() {
                let first = (0..array.len()).find(|&row| array.is_null(row));
                column.null = first.map(|row| self.table.rows + row);
            }
            if append(&mut column.values, known, *array, &mut column.null).is_none() {
                let message = format!(
                    "column `{}` holds what its type {} does not say; the file is damaged",
                    column.name,
                    array.data_type()
                );
                return Err(Diagnostic::new(
                    &self.table.file,
                    Code::TableDamaged,
                    message,
                ));
            }
            // The number in memory at a null is arbitrary.
            let nulls = (0..rows).filter(|&row| array.null_count() > 0 && array.is_null(row));
            match &mut column.values {
                ColumnValues::Numbers(ColumnNumbers::F32(list)) => {
                    nulls.for_each(|row| list[before + row] = f32::NAN);
                }
                ColumnValues::Numbers(ColumnNumbers::F64(list)) => {
                    nulls.for_each(|row| list[before + row] = f64::NAN);
                }
                _ => {}
            }
        }
        self.table.rows += rows;
        Ok(())
    }

    /// The table, after the last row.
    ///
    /// # Errors
    /// When columns have different lengths.
    pub(crate) fn finish(self) -> Result<Table, Diagnostic> {
        let mut columns = self.table.columns.iter();
        if let Some(short) = columns.find(|column| column.len() != self.table.rows) {
            let message = format!(
                "column `{}` has {} rows where there are {}; the file is damaged",
                short.name,
                short.len(),
                self.table.rows
            );
            return Err(self.table.refuse(Code::TableDamaged, message));
        }
        Ok(self.table)
    }
}

/// The columns of a batch at these indices.
pub(crate) fn chosen<'a>(batch: &'a RecordBatch, indices: &[usize]) -> Option<Vec<&'a dyn Array>> {
    let columns = batch.columns();
    indices
        .iter()
        .map(|&index| Some(&**columns.get(index)?))
        .collect()
}

/// An empty column for a type; `None` if the type is not usable.
fn values(data_type: &DataType, need: ColumnNeed) -> Option<ColumnValues> {
    let numbers = numbers(data_type);
    match (need, data_type) {
        (ColumnNeed::Number, _) => numbers.map(ColumnValues::Numbers),
        (ColumnNeed::Whole, _) => whole(numbers),
        (ColumnNeed::Name, data_type) if is_text(data_type) => Some(ColumnValues::Words {
            codes: Vec::new(),
            words: Vec::new(),
        }),
        (ColumnNeed::Name, _) => whole(numbers),
        (ColumnNeed::Time, DataType::Timestamp(unit, _) | DataType::Duration(unit)) => {
            let unit = match unit {
                ArrowUnit::Second => TimeUnit::Seconds,
                ArrowUnit::Millisecond => TimeUnit::Milliseconds,
                ArrowUnit::Microsecond => TimeUnit::Microseconds,
                ArrowUnit::Nanosecond => TimeUnit::Nanoseconds,
            };
            Some(ColumnValues::Stamps(Vec::new(), unit))
        }
        (ColumnNeed::Time, _) => numbers.map(ColumnValues::Numbers),
        (ColumnNeed::List, DataType::List(item) | DataType::LargeList(item)) => {
            Some(ColumnValues::Lists {
                ends: Vec::new(),
                numbers: self::numbers(item.data_type())?,
            })
        }
        (ColumnNeed::List, DataType::FixedSizeList(item, length)) if *length >= 0 => {
            Some(ColumnValues::Lists {
                ends: Vec::new(),
                numbers: self::numbers(item.data_type())?,
            })
        }
        (ColumnNeed::List, _) => None,
    }
}

fn whole(numbers: Option<ColumnNumbers>) -> Option<ColumnValues> {
    let numbers = numbers.filter(|numbers| matches!(numbers, ColumnNumbers::Whole(_)));
    numbers.map(ColumnValues::Numbers)
}

fn numbers(data_type: &DataType) -> Option<ColumnNumbers> {
    match data_type {
        DataType::Float16 | DataType::Float32 => Some(ColumnNumbers::F32(Vec::new())),
        DataType::Float64 => Some(ColumnNumbers::F64(Vec::new())),
        other if other.is_integer() => Some(ColumnNumbers::Whole(Vec::new())),
        _ => None,
    }
}

fn is_text(data_type: &DataType) -> bool {
    match data_type {
        DataType::Utf8 | DataType::LargeUtf8 | DataType::Utf8View => true,
        DataType::Dictionary(_, words) => {
            matches!(
                **words,
                DataType::Utf8 | DataType::LargeUtf8 | DataType::Utf8View
            )
        }
        _ => false,
    }
}

/// Appends an array to values of its type; `None` if it is of another type.
fn append(
    values: &mut ColumnValues,
    known: &mut KnownWords,
    array: &dyn Array,
    null: &mut Option<usize>,
) -> Option<()> {
    match values {
        ColumnValues::Numbers(numbers) => append_numbers(numbers, array),
        ColumnValues::Stamps(stamps, _) => append_stamps(stamps, array),
        ColumnValues::Words { codes, words } => append_words(codes, words, known, array, null),
        ColumnValues::Lists { ends, numbers } => append_lists(ends, numbers, array, null),
        // Decimals come only from text, not from Arrow arrays.
        ColumnValues::Decimals(..) => None,
    }
}

fn append_numbers(numbers: &mut ColumnNumbers, array: &dyn Array) -> Option<()> {
    match numbers {
        ColumnNumbers::F32(list) => match array.as_primitive_opt::<Float16Type>() {
            Some(halves) => list.extend(halves.values().iter().map(|half| half.to_f32())),
            None => list.extend_from_slice(array.as_primitive_opt::<Float32Type>()?.values()),
        },
        ColumnNumbers::F64(list) => {
            list.extend_from_slice(array.as_primitive_opt::<Float64Type>()?.values());
        }
        ColumnNumbers::Whole(list) => match array.data_type() {
            DataType::Int8 => extend::<Int8Type>(list, array)?,
            DataType::Int16 => extend::<Int16Type>(list, array)?,
            DataType::Int32 => extend::<Int32Type>(list, array)?,
            DataType::Int64 => extend::<Int64Type>(list, array)?,
            DataType::UInt8 => extend::<UInt8Type>(list, array)?,
            DataType::UInt16 => extend::<UInt16Type>(list, array)?,
            DataType::UInt32 => extend::<UInt32Type>(list, array)?,
            DataType::UInt64 => {
                // A number beyond i64 is neither a time nor a count. It stays out of range and is refused later.
                let all = array.as_primitive_opt::<UInt64Type>()?.values();
                list.extend(
                    all.iter()
                        .map(|&number| i64::try_from(number).unwrap_or(i64::MAX)),
                );
            }
            _ => return None,
        },
    }
    Some(())
}

fn extend<T: ArrowPrimitiveType>(list: &mut Vec<i64>, array: &dyn Array) -> Option<()>
where
    T::Native: Into<i64>,
{
    let all = array.as_primitive_opt::<T>()?.values();
    list.extend(all.iter().map(|&number| number.into()));
    Some(())
}

fn append_stamps(stamps: &mut Vec<i64>, array: &dyn Array) -> Option<()> {
    use ArrowUnit::{Microsecond, Millisecond, Nanosecond, Second};
    match array.data_type() {
        DataType::Timestamp(Second, _) => extend::<TimestampSecondType>(stamps, array),
        DataType::Timestamp(Millisecond, _) => extend::<TimestampMillisecondType>(stamps, array),
        DataType::Timestamp(Microsecond, _) => extend::<TimestampMicrosecondType>(stamps, array),
        DataType::Timestamp(Nanosecond, _) => extend::<TimestampNanosecondType>(stamps, array),
        DataType::Duration(Second) => extend::<DurationSecondType>(stamps, array),
        DataType::Duration(Millisecond) => extend::<DurationMillisecondType>(stamps, array),
        DataType::Duration(Microsecond) => extend::<DurationMicrosecondType>(stamps, array),
        DataType::Duration(Nanosecond) => extend::<DurationNanosecondType>(stamps, array),
        _ => None,
    }
}

/// The code of a word, which is new if necessary.
fn code(words: &mut Vec<String>, known: &mut KnownWords, word: &str) -> u32 {
    if let Some(&code) = known.codes.get(word) {
        return code;
    }
    let code = words.len() as u32;
    words.push(word.to_owned());
    known.codes.insert(word.to_owned(), code);
    code
}

/// Appends words. Rows without a word get the first one, and the column is refused for them later.
fn append_words(
    codes: &mut Vec<u32>,
    words: &mut Vec<String>,
    known: &mut KnownWords,
    array: &dyn Array,
    null: &mut Option<usize>,
) -> Option<()> {
    let start = codes.len();
    let Some(dictionary) = array.as_any_dictionary_opt() else {
        let mut last: Option<(&str, u32)> = None;
        for row in 0..array.len() {
            let word = if array.is_null(row) {
                ""
            } else {
                text(array, row)?
            };
            let code = match last {
                Some((before, code)) if before == word => code,
                _ => code(words, known, word),
            };
            last = Some((word, code));
            codes.push(code);
        }
        return Some(());
    };
    let values = dictionary.values();
    if values.is_empty() {
        // An empty dictionary: every row is null.
        let none = code(words, known, "");
        codes.resize(start + array.len(), none);
        return Some(());
    }
    let code_of = match known.last.take() {
        Some((last, code_of)) if last.to_data().ptr_eq(&values.to_data()) => code_of,
        _ => (0..values.len())
            .map(|i| {
                let word = if values.is_null(i) {
                    ""
                } else {
                    text(values, i)?
                };
                Some(code(words, known, word))
            })
            .collect::<Option<Vec<u32>>>()?,
    };
    let keys = dictionary.normalized_keys();
    if values.null_count() > 0 && null.is_none() {
        *null = keys
            .iter()
            .position(|&key| values.is_null(key))
            .map(|row| start + row);
    }
    codes.extend(keys.iter().map(|&key| code_of[key]));
    known.last = Some((Arc::clone(values), code_of));
    Some(())
}

fn text(array: &dyn Array, row: usize) -> Option<&str> {
    match array.data_type() {
        DataType::Utf8 => Some(array.as_string_opt::<i32>()?.value(row)),
        DataType::LargeUtf8 => Some(array.as_string_opt::<i64>()?.value(row)),
        DataType::Utf8View => Some(array.as_string_view_opt()?.value(row)),
        _ => None,
    }
}

fn append_lists(
    ends: &mut Vec<usize>,
    numbers: &mut ColumnNumbers,
    array: &dyn Array,
    null: &mut Option<usize>,
) -> Option<()> {
    let start = ends.len();
    let (list_ends, items): (Vec<usize>, _) = if let Some(list) = array.as_list_opt::<i32>() {
        let ends = list.value_offsets().iter().map(|&end| end as usize);
        (ends.collect(), list.values())
    } else if let Some(list) = array.as_list_opt::<i64>() {
        let ends = list.value_offsets().iter().map(|&end| end as usize);
        (ends.collect(), list.values())
    } else {
        let list = array.as_fixed_size_list_opt()?;
        let length = list.value_length() as usize;
        (
            (0..=list.len()).map(|row| row * length).collect(),
            list.values(),
        )
    };
    // A slice of a longer array begins after the first number of the array.
    let (first, last) = (*list_ends.first()?, *list_ends.last()?);
    let items = items.slice(first, last.checked_sub(first)?);
    if items.null_count() > 0 && null.is_none() {
        let item = (0..items.len()).find(|&item| items.is_null(item));
        *null = item.map(|item| start + list_ends.partition_point(|&end| end - first <= item) - 1);
    }
    let before = numbers.len();
    append_numbers(numbers, &items)?;
    ends.extend(list_ends[1..].iter().map(|&end| before + end - first));
    Some(())
}
