//! The columns of a table of any file format, and the locations of errors in them.

use crate::decimal::Decimal;
use crate::diagnostic::{Code, Diagnostic, Location};
use crate::format::TimeUnit;

/// The kind of values that a column must contain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum ColumnNeed {
    Number,
    Whole,
    /// Text, or integers that serve as names.
    Name,
    Time,
    List,
}

/// A column that is to be read.
#[derive(Debug)]
pub(crate) struct RequestedColumn {
    /// Its name in the file.
    pub(crate) name: String,
    /// Its index among all columns of the file.
    pub(crate) index: usize,
    pub(crate) need: ColumnNeed,
}

/// Columns of equal length.
pub(crate) struct Table {
    /// The input's name in messages.
    pub(crate) file: String,
    /// The columns of the plan, in its order.
    pub(crate) columns: Vec<Column>,
    pub(crate) rows: usize,
    /// The text, if the table is text, for locations by line and column.
    pub(crate) text: Option<Text>,
}

/// One column.
pub(crate) struct Column {
    pub(crate) name: String,
    /// Its index among all columns of the file.
    pub(crate) index: usize,
    pub(crate) values: ColumnValues,
    /// The first row without a value.
    pub(crate) null: Option<usize>,
}

/// The values of a column.
pub(crate) enum ColumnValues {
    Numbers(ColumnNumbers),
    /// Times in seconds as in the text, and the largest number of decimals.
    Decimals(Vec<Decimal>, u32),
    /// Points in time, relative to a day of the file's choice.
    Stamps(Vec<i64>, TimeUnit),
    /// A word for each row, by its index.
    Words {
        codes: Vec<u32>,
        words: Vec<String>,
    },
    /// A list for each row: row `i` ends before index `ends[i]`.
    Lists {
        ends: Vec<usize>,
        numbers: ColumnNumbers,
    },
}

/// Numbers of the type in the file.
pub(crate) enum ColumnNumbers {
    F32(Vec<f32>),
    F64(Vec<f64>),
    Whole(Vec<i64>),
}

impl ColumnNumbers {
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::F32(numbers) => numbers.len(),
            Self::F64(numbers) => numbers.len(),
            Self::Whole(numbers) => numbers.len(),
        }
    }

    /// The number at an index below [`ColumnNumbers::len`].
    pub(crate) fn at(&self, index: usize) -> f64 {
        match self {
            Self::F32(numbers) => f64::from(numbers[index]),
            Self::F64(numbers) => numbers[index],
            Self::Whole(numbers) => numbers[index] as f64,
        }
    }
}

/// Finds the line and the column of a cell.
pub(crate) type Text = Box<dyn Fn(usize, usize) -> Location + Sync>;

impl Table {
    pub(crate) fn refuse(&self, code: Code, message: impl Into<String>) -> Diagnostic {
        Diagnostic::new(&self.file, code, message)
    }

    /// The length of the list in the first row of a column of lists.
    pub(crate) fn list_length(&self, column: usize) -> Option<usize> {
        match &self.columns.get(column)?.values {
            ColumnValues::Lists { ends, .. } => ends.first().copied(),
            _ => None,
        }
    }

    /// The location of a cell.
    pub(crate) fn location(&self, column: usize, row: usize) -> Location {
        let column = &self.columns[column];
        match &self.text {
            Some(text) => text(column.index, row),
            None => Location::Inside(format!("column {}, row {row}", column.name)),
        }
    }

    /// An error about a cell.
    pub(crate) fn refuse_at(
        &self,
        column: usize,
        row: usize,
        code: Code,
        message: impl Into<String>,
    ) -> Diagnostic {
        let mut refusal = self.refuse(code, message);
        refusal.location = Some(self.location(column, row));
        refusal
    }

    /// Refuses the first null of any column, except those of the columns of numbers that may have gaps. They are NaN.
    pub(crate) fn check_nulls(
        &self,
        may_have_gaps: impl Fn(usize) -> bool,
    ) -> Result<(), Diagnostic> {
        let is_float = |column: &Column| {
            matches!(
                column.values,
                ColumnValues::Numbers(ColumnNumbers::F32(_) | ColumnNumbers::F64(_))
            )
        };
        let checked = self.columns.iter().enumerate();
        for (index, column) in checked {
            if is_float(column) && may_have_gaps(index) {
                continue;
            }
            if let Some(row) = column.null {
                let remedy = match is_float(column) {
                    true => "fill it in, remove the row, or leave the key out with --bridge-gaps",
                    false => "fill it in or remove the row",
                };
                // The location of the message names the row, or the line of a text.
                let message = format!("column `{}` has no value; {remedy}", column.name);
                return Err(self.refuse_at(index, row, Code::Null, message));
            }
        }
        Ok(())
    }
}

impl Column {
    /// The number of rows.
    pub(crate) fn len(&self) -> usize {
        match &self.values {
            ColumnValues::Numbers(numbers) => numbers.len(),
            ColumnValues::Decimals(times, _) => times.len(),
            ColumnValues::Stamps(stamps, _) => stamps.len(),
            ColumnValues::Words { codes, .. } => codes.len(),
            ColumnValues::Lists { ends, .. } => ends.len(),
        }
    }
}

/// Reads one number of each row.
#[derive(Clone, Copy)]
pub(crate) struct CellReader<'a> {
    pub(crate) numbers: &'a ColumnNumbers,
    /// The ends of the lists of the rows, in a column of lists.
    pub(crate) ends: Option<&'a [usize]>,
    /// The index of the number in each list.
    pub(crate) item: usize,
}

impl CellReader<'_> {
    /// A reader of no column.
    pub(crate) const NONE: Self = Self {
        numbers: &ColumnNumbers::Whole(Vec::new()),
        ends: None,
        item: 0,
    };

    pub(crate) fn at(&self, row: usize) -> f64 {
        match self.ends {
            None => self.numbers.at(row),
            Some(_) if row == 0 => self.numbers.at(self.item),
            Some(ends) => self.numbers.at(ends[row - 1] + self.item),
        }
    }
}

/// The numbers of each row from several columns; they are slices if all columns are of one type.
pub(crate) enum Cells<'a, const N: usize> {
    F32([&'a [f32]; N]),
    F64([&'a [f64]; N]),
    Other([CellReader<'a>; N]),
}

impl<'a, const N: usize> Cells<'a, N> {
    pub(crate) fn of(readers: [CellReader<'a>; N]) -> Self {
        let f32s = |numbers: &'a ColumnNumbers| match numbers {
            ColumnNumbers::F32(list) => Some(&**list),
            _ => None,
        };
        let f64s = |numbers: &'a ColumnNumbers| match numbers {
            ColumnNumbers::F64(list) => Some(&**list),
            _ => None,
        };
        if let Some(lists) = slices(&readers, f32s) {
            return Self::F32(lists);
        }
        match slices(&readers, f64s) {
            Some(lists) => Self::F64(lists),
            None => Self::Other(readers),
        }
    }
}

fn slices<'a, T, const N: usize>(
    readers: &[CellReader<'a>; N],
    list: impl Fn(&'a ColumnNumbers) -> Option<&'a [T]>,
) -> Option<[&'a [T]; N]> {
    let mut lists = [&[][..]; N];
    for (slot, reader) in lists.iter_mut().zip(readers) {
        *slot = list(reader.numbers).filter(|_| reader.ends.is_none())?;
    }
    Some(lists)
}

/// The error of a column whose type is not usable.
pub(crate) fn wrong_type(file: &str, column: &str, found: &str, need: ColumnNeed) -> Diagnostic {
    let expected = match need {
        ColumnNeed::Number => "numbers",
        ColumnNeed::Whole => "whole numbers",
        ColumnNeed::Name => "text or whole numbers",
        ColumnNeed::Time => "numbers or timestamps",
        ColumnNeed::List => "lists of numbers",
    };
    let message = format!("column `{column}` is of type {found}; {expected} are expected");
    Diagnostic::new(file, Code::ColumnType, message).inside(format!("column {column}, row 0"))
}
