//! Converts a column of times to seconds.

use std::collections::HashMap;

use tumble::FrameRate;

use crate::decimal::{LARGEST_SECONDS, offset_of};
use crate::diagnostic::{Code, Diagnostic};
use crate::format::{ReadOptions, TimeUnit};
use crate::motion::clock_second;
use crate::rate::Precision;
use crate::table::columns::{Column, ColumnNumbers, ColumnValues, Table};
use crate::table::plan::{TablePlan, TimeSource};
use crate::warnings::Warnings;

/// Times of all rows.
pub(crate) struct RowTimes {
    pub(crate) seconds: Vec<f64>,
    /// The type of the times in the file; `None` if they are exact.
    pub(crate) precision: Option<Precision>,
    /// The whole second from which they count.
    pub(crate) offset: i64,
}

impl RowTimes {
    fn at_zero(seconds: Vec<f64>, precision: Option<Precision>) -> Self {
        Self {
            seconds,
            precision,
            offset: 0,
        }
    }
}

/// The clip and the track of each row, if columns say them.
pub(crate) struct RowGroups<'a> {
    pub(crate) clips: Option<&'a [u32]>,
    pub(crate) tracks: Option<&'a [u32]>,
}

impl RowGroups<'_> {
    /// The number of each row among those of its clip and track, from 0.
    fn numbers(&self, rows: usize) -> Vec<u64> {
        let mut next: HashMap<[u32; 2], u64> = HashMap::new();
        let number = |row: usize| {
            let group = [self.clips, self.tracks].map(|codes| codes.map_or(0, |codes| codes[row]));
            let next = next.entry(group).or_default();
            *next += 1;
            *next - 1
        };
        (0..rows).map(number).collect()
    }
}

/// The times of a table's rows.
///
/// # Errors
/// When they are integers without a known unit, or frames before the first one.
pub(crate) fn times(
    table: &Table,
    plan: &TablePlan,
    groups: &RowGroups<'_>,
    options: &ReadOptions,
    warnings: &mut Warnings,
) -> Result<RowTimes, Diagnostic> {
    let column = match plan.time_source {
        TimeSource::Times(column) => column,
        TimeSource::Frames(column, rate) => return frame_times(table, column, rate),
        TimeSource::Rows(rate) => {
            let frames = groups.numbers(table.rows);
            let seconds = frames.into_iter().map(|frame| rate.time_of(frame));
            return Ok(RowTimes::at_zero(seconds.collect(), None));
        }
    };
    let Column { name, values, .. } = &table.columns[column];
    if let Some(rate) = options.source_rate {
        let message = format!("`{name}` has the time of every row; leave out --source-fps {rate}");
        return Err(table.refuse_at(column, 0, Code::RateBesideTimes, message));
    }
    // `--time-unit` applies to numbers of every kind; timestamps have their own unit.
    let unit = match values {
        ColumnValues::Numbers(numbers) if numbers.len() > 0 => {
            let first = numbers.at(0);
            TimeUnit::or_of_first(plan.time_unit, first, |unit| {
                let location = Some(table.location(column, 0));
                warnings.warn(Code::TimeUnit, || (location, unit.assumed(first)));
            })
        }
        _ => plan.time_unit,
    };
    let per_second = unit.map_or(1.0, |unit| unit.per_second() as f64);
    match values {
        ColumnValues::Numbers(ColumnNumbers::F32(times)) => {
            let seconds = times.iter().map(|&time| f64::from(time) / per_second);
            Ok(RowTimes::at_zero(seconds.collect(), Some(Precision::F32)))
        }
        ColumnValues::Numbers(ColumnNumbers::F64(times)) => {
            let seconds = times.iter().map(|&time| time / per_second);
            Ok(doubles(seconds.collect()))
        }
        ColumnValues::Decimals(times, decimals) => {
            let offset = offset_of(times.iter().min().map_or(0, |first| first.whole_seconds()));
            Ok(RowTimes {
                seconds: times.iter().map(|time| time.since(offset)).collect(),
                precision: Some(Precision::Decimals(*decimals)),
                offset,
            })
        }
        ColumnValues::Numbers(ColumnNumbers::Whole(times)) => {
            // In text, 2 may mean 2.0, so small whole numbers are seconds. In binary files, whole numbers need a
            // unit.
            let small = times
                .iter()
                .all(|time| (time.unsigned_abs() as f64) < LARGEST_SECONDS);
            let guessed = (small && table.text.is_some()).then_some(TimeUnit::Seconds);
            let Some(unit) = unit.or(guessed) else {
                let first = times.first().copied().unwrap_or_default();
                let message = format!(
                    "`{name}` has whole numbers, {first} first; give their unit with --time-unit s, ms, us or ns"
                );
                return Err(table.refuse_at(column, 0, Code::WholeTimes, message));
            };
            Ok(stamps(times, unit))
        }
        ColumnValues::Stamps(times, unit) => Ok(stamps(times, *unit)),
        ColumnValues::Words { .. } | ColumnValues::Lists { .. } => {
            let message = format!("`{name}` holds no times");
            Err(table.refuse_at(column, 0, Code::ColumnType, message))
        }
    }
}

/// The times of rows that say which frame of a rate they are.
fn frame_times(table: &Table, column: usize, rate: FrameRate) -> Result<RowTimes, Diagnostic> {
    let Column { name, values, .. } = &table.columns[column];
    let ColumnValues::Numbers(ColumnNumbers::Whole(frames)) = values else {
        let message = format!("`{name}` holds no numbers of frames");
        return Err(table.refuse_at(column, 0, Code::ColumnType, message));
    };
    if let Some(row) = frames.iter().position(|&frame| frame < 0) {
        let message = format!("frame {} comes before the first, 0", frames[row]);
        return Err(table.refuse_at(column, row, Code::Time, message));
    }
    let seconds = frames
        .iter()
        .map(|&frame| rate.time_of(frame.unsigned_abs()));
    Ok(RowTimes::at_zero(seconds.collect(), None))
}

/// Times in f64. Those that begin at a large distance from 0 were rounded there: 1.7e9 s to a quarter of a
/// microsecond.
fn doubles(mut seconds: Vec<f64>) -> RowTimes {
    let offset = clock_second(&seconds);
    if offset == 0 {
        return RowTimes {
            seconds,
            precision: Some(Precision::F64),
            offset,
        };
    }
    let step = Precision::F64.ulp(offset as f64);
    seconds.iter_mut().for_each(|time| *time -= offset as f64);
    RowTimes {
        seconds,
        precision: Some(Precision::Decimals(-libm::log10(step).ceil() as u32)),
        offset,
    }
}

fn stamps(times: &[i64], unit: TimeUnit) -> RowTimes {
    let per_second = i128::from(unit.per_second());
    let first = times.iter().min().copied().map_or(0, i128::from);
    let offset = offset_of(first.div_euclid(per_second) as i64);
    let start = i128::from(offset) * per_second;
    let seconds = times
        .iter()
        .map(|&time| (i128::from(time) - start) as f64 / per_second as f64)
        .collect();
    RowTimes {
        seconds,
        precision: Some(Precision::Decimals(unit.power().unsigned_abs())),
        offset,
    }
}
