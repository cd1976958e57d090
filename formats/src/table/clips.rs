//! Makes clips of columns: rows are assigned to clips and tracks, and keys become unit quaternions at increasing
//! times.

mod keys;

use std::borrow::Cow;
use std::ops::Range;

use glam::DVec3;

use crate::decimal::time_text;
use crate::diagnostic::{Code, Diagnostic};
use crate::format::{Loaded, ReadOptions};
use crate::motion::grid::restore;
use crate::motion::keys::{Origin, select};
use crate::motion::{Motion, Scalar};
use crate::printable::printable;
use crate::table::clips::keys::RowKeys;
use crate::table::columns::Table;
use crate::table::groups::{labels, numbered, rows_by_code};
use crate::table::plan::{Parts, RowLayout, TablePlan};
use crate::table::times::{RowGroups, RowTimes, times};
#[cfg(feature = "parquet")]
use crate::table::{scalars, skeleton};
use crate::time_order::{TimeOrder, time_order};
use crate::warnings::Warnings;

/// Makes the clips of a table that contains the columns of its plan.
///
/// # Errors
/// The first error if the table is of one clip. In a table of several clips, an error refuses one clip only.
pub(crate) fn clips(
    table: &Table,
    plan: &TablePlan,
    options: &ReadOptions,
) -> Result<Loaded, Diagnostic> {
    if table.rows == 0 {
        return Err(table.refuse(Code::NoRows, "the table has no rows; there are no keys"));
    }
    if u32::try_from(table.rows).is_err() {
        let message = format!("{} rows are more than 2^32; split the table", table.rows);
        return Err(table.refuse(Code::TableClaims, message));
    }
    // The keys of tracks that will be left out are not read.
    table.check_nulls(|column| {
        options.bridge_gaps || options.tracks.is_some() && plan.is_of_track(column)
    })?;
    let mut warnings = Warnings::new(&table.file);
    if let Some(columns) = plan.left_out(table) {
        warnings.warn(Code::ColumnsLeftOut, || {
            let message = format!(
                "columns with unknown names are left out: {columns}; if they are keys, name them with --map"
            );
            (None, message)
        });
    }
    let tracks = match plan.rows {
        RowLayout::Keys {
            track: Some(track), ..
        } => Some(labels(table, track)),
        _ => None,
    };
    let named_clips = plan
        .clip
        .map(|(column, prefix)| (labels(table, column), prefix));
    let row_groups = RowGroups {
        clips: named_clips.as_ref().map(|((codes, _), _)| &**codes),
        tracks: tracks.as_ref().map(|(codes, _)| &**codes),
    };
    let times = times(table, plan, &row_groups, options, &mut warnings)?;
    let mut loaded = Loaded::default();
    let groups = match named_clips {
        Some(((codes, names), prefix)) => {
            let (rows, ranges) = rows_by_code(&codes, names.len());
            let named = names
                .into_iter()
                .map(|name| Some(format!("{prefix}{name}")));
            named
                .zip(ranges)
                .map(|(name, range)| (name, Some(rows[range].to_vec())))
                .collect()
        }
        None => vec![(None, None)],
    };
    let alone = groups.len() == 1;
    for (index, (name, rows)) in groups.into_iter().enumerate() {
        let clip = TableClip {
            table,
            times: &times,
            rows: rows.as_deref(),
            tracks: tracks.as_ref(),
            options,
        };
        match clip.read(plan, name, &mut warnings) {
            Ok(mut motion) => {
                #[cfg(feature = "parquet")]
                skeleton::attach_skeleton(&mut motion, index, &plan.notes);
                #[cfg(feature = "parquet")]
                scalars::attach_scalars(&mut motion, index, &plan.notes);
                motion.index = index;
                loaded.clips.push(motion);
            }
            Err(refusal) if alone => return Err(refusal),
            Err(refusal) => loaded.refused.push(refusal),
        }
    }
    loaded.warnings = warnings.into_list();
    Ok(loaded)
}

/// One clip of a table: all of its rows, or some.
pub(crate) struct TableClip<'a> {
    pub(crate) table: &'a Table,
    times: &'a RowTimes,
    rows: Option<&'a [u32]>,
    /// The track of each row of the table, and the names of the tracks; `None` in a table of one track.
    tracks: Option<&'a (Vec<u32>, Vec<String>)>,
    pub(crate) options: &'a ReadOptions,
}

/// The assignment of a clip's rows.
pub(crate) struct SharedRows<'a> {
    pub(crate) tracks: Vec<TableTrack<'a>>,
    /// Indices of rows among those of the clip; each track has a range of this list.
    order: Vec<u32>,
    /// The times of tracks.
    lists: Vec<Vec<f64>>,
}

/// The source of the keys of one track.
pub(crate) struct TableTrack<'a> {
    name: String,
    pub(crate) parts: &'a Parts,
    range: Range<usize>,
    /// The index of its list of times.
    list: usize,
}

impl SharedRows<'_> {
    /// The positions of a track's rows in the clip, by increasing time.
    pub(crate) fn positions(&self, track: &TableTrack<'_>) -> &[u32] {
        &self.order[track.range.clone()]
    }
}

impl TableClip<'_> {
    pub(crate) fn len(&self) -> usize {
        self.rows.map_or(self.table.rows, <[u32]>::len)
    }

    /// The row of the table at a position in the clip.
    #[inline]
    pub(crate) fn row(&self, position: usize) -> usize {
        self.rows.map_or(position, |rows| rows[position] as usize)
    }

    /// Whether each track will be needed. Parents are not known yet, so that all are if ancestors are needed.
    pub(crate) fn are_needed(&self, shared: &SharedRows<'_>) -> Vec<bool> {
        let names = shared.tracks.iter().map(|track| &*track.name);
        match &self.options.tracks {
            Some(selection) if !selection.with_ancestors => selection.are_needed(names, &[]),
            _ => vec![true; shared.tracks.len()],
        }
    }

    fn read(
        &self,
        plan: &TablePlan,
        name: Option<String>,
        warnings: &mut Warnings,
    ) -> Result<Motion, Diagnostic> {
        let (mut shared, is_world) = match &plan.rows {
            RowLayout::Keys {
                parts, is_world, ..
            } => (self.share_out(parts, plan, warnings)?, *is_world),
            RowLayout::Times { tracks, is_world } => {
                (self.share_all(tracks, plan, warnings)?, *is_world)
            }
        };
        if self.options.bridge_gaps {
            self.leave_out_gaps(plan, &mut shared, warnings)?;
        }
        let mut keys = self.keys(&shared, warnings)?;
        let (scalar_rows, scalar_list) = scalar_rows(&shared);
        let lists = &mut shared.lists;
        let rate = match self.times.precision {
            Some(precision) if !self.options.raw_times => restore(lists, precision),
            Some(_) => None,
            None => self.options.source_rate,
        };
        let scalar_times = match plan.scalars[..] {
            [] => Vec::new(),
            _ => lists[scalar_list].clone(),
        };
        self.increasing(plan, &mut shared, &mut keys, warnings)?;
        let mut motion = Motion {
            name,
            rate,
            is_world,
            time_offset: self.times.offset,
            ..Motion::default()
        };
        let set = &mut motion.set;
        set.reserve(
            keys.len(),
            keys.iter().map(|keys| keys.rotations.len()).sum(),
        );
        let origins: Vec<DVec3> = keys.iter().map(|keys| keys.origin).collect();
        for (index, (track, keys)) in shared.tracks.into_iter().zip(keys).enumerate() {
            let times = &shared.lists[track.list];
            let pushed = set
                .push(track.name, times, &keys.rotations)
                .and_then(|()| match keys.translations[..] {
                    [] => Ok(()),
                    _ => set.set_translations(index, times, &keys.translations, &[]),
                })
                .and_then(|()| match keys.scales[..] {
                    [] => Ok(()),
                    _ => set.set_scales(index, times, &keys.scales, &[]),
                });
            pushed.map_err(|error| self.table.refuse(Code::Norm, error.to_string()))?;
        }
        for (track, origin) in origins.into_iter().enumerate() {
            motion.set_origin(track, origin);
        }
        self.read_scalars(plan, (&scalar_rows, &scalar_times), &mut motion, warnings)?;
        Ok(motion)
    }

    /// Adds the scalars of some rows, at these times, to a clip.
    fn read_scalars(
        &self,
        plan: &TablePlan,
        (positions, times): (&[u32], &[f64]),
        motion: &mut Motion,
        warnings: &mut Warnings,
    ) -> Result<(), Diagnostic> {
        for scalars in &plan.scalars {
            for (name, cell) in scalars.cells(self.table, warnings) {
                let reader = self.reader(cell)?;
                let (mut key_times, mut keys): (Vec<f64>, Vec<f32>) = (Vec::new(), Vec::new());
                let mut rows = Vec::new();
                let numbers = positions.iter().map(|&position| {
                    let row = self.row(position as usize);
                    (row, (reader.at(row) * scalars.factor) as f32)
                });
                let numbers: Vec<(usize, f32)> = numbers.collect();
                // A scalar that only other clips of the table have: all its numbers are missing.
                if numbers.iter().all(|(_, number)| number.is_nan()) {
                    continue;
                }
                for (&time, &(row, number)) in times.iter().zip(&numbers) {
                    if !(number.is_finite() || number.is_nan() && self.options.bridge_gaps) {
                        let message = format!("{number} is not a finite number of f32; repair it");
                        return Err(self.table.refuse_at(
                            cell.column,
                            row,
                            Code::NotFinite,
                            message,
                        ));
                    }
                    if !number.is_nan() {
                        key_times.push(time);
                        keys.push(number);
                        rows.push(row);
                    }
                }
                let origin = Origin {
                    file: &self.table.file,
                    location: &|key| self.table.location(cell.column, rows[key]),
                    duplicates: self.options.duplicates,
                };
                let equal = |i: usize, j: usize| keys[i].to_bits() == keys[j].to_bits();
                let kept = origin.increasing(&mut key_times, equal, warnings)?;
                select(&mut key_times, kept.as_deref());
                select(&mut keys, kept.as_deref());
                let scalar = Scalar::of(scalars.kind);
                let added = motion.add_scalar(scalar, &name, &key_times, &keys, &[]);
                added.map_err(|error| {
                    let message = format!("the scalar `{name}` cannot be kept: {error}");
                    self.table
                        .refuse_at(cell.column, self.row(0), Code::TimeNotIncreasing, message)
                })?;
            }
        }
        if let Some(message) = motion.angle_jump() {
            warnings.warn(Code::AngleJumps, || (None, message));
        }
        if let Some(message) = motion.coarse_angle() {
            warnings.warn(Code::CoarseAngles, || (None, message));
        }
        Ok(())
    }

    /// Assigns every row to every track, in a wide table.
    fn share_all<'a>(
        &self,
        tracks: &'a [(String, Parts)],
        plan: &TablePlan,
        warnings: &mut Warnings,
    ) -> Result<SharedRows<'a>, Diagnostic> {
        let track = |(name, parts): &'a (String, Parts)| TableTrack {
            name: name.clone(),
            parts,
            range: 0..self.len(),
            list: 0,
        };
        let mut order: Vec<u32> = (0..self.len() as u32).collect();
        let times = self.sorted(&mut order, plan, warnings)?;
        Ok(SharedRows {
            tracks: tracks.iter().map(track).collect(),
            lists: vec![times],
            order,
        })
    }

    /// Sorts the positions of one track's rows by time if they are not, and returns the times.
    ///
    /// # Errors
    /// When the clock was set back, so that sorting would mix two recordings.
    fn sorted(
        &self,
        positions: &mut [u32],
        plan: &TablePlan,
        warnings: &mut Warnings,
    ) -> Result<Vec<f64>, Diagnostic> {
        let times = self.times_of(positions);
        let at = |row: usize| {
            let offset = self.times.offset;
            let [before, time] = [row - 1, row].map(|row| time_text(offset, times[row]));
            let location = self
                .table
                .location(plan.time_source.column(), self.row(positions[row] as usize));
            (location, before, time)
        };
        match time_order(&times) {
            TimeOrder::Sorted => return Ok(times),
            TimeOrder::Reset { row } => {
                let (location, before, time) = at(row);
                let message = format!(
                    "the clock was set back from {before} s to {time} s; the rows before and after this one are at \
                     the same times: split the table here, or sort it by time if it is one recording"
                );
                let mut refusal = self.table.refuse(Code::TimeNotIncreasing, message);
                refusal.location = Some(location);
                return Err(refusal);
            }
            TimeOrder::Unsorted { row } => warnings.warn(Code::RowsSorted, || {
                let (location, before, time) = at(row);
                let message = format!(
                    "the time {time} is before the previous time, {before}; the rows are sorted by time"
                );
                (Some(location), message)
            }),
        }
        positions.sort_by(|&a, &b| self.time(a).total_cmp(&self.time(b)));
        Ok(self.times_of(positions))
    }

    /// Removes from each track the rows in which one of its numbers is missing.
    fn leave_out_gaps(
        &self,
        plan: &TablePlan,
        shared: &mut SharedRows<'_>,
        warnings: &mut Warnings,
    ) -> Result<(), Diagnostic> {
        let mut known: Option<(&Parts, Option<Vec<bool>>)> = None;
        for track in 0..shared.tracks.len() {
            let parts = shared.tracks[track].parts;
            if !known
                .as_ref()
                .is_some_and(|(last, _)| std::ptr::eq(*last, parts))
            {
                known = Some((parts, self.gaps(parts)?));
            }
            let Some((_, Some(gaps))) = &known else {
                continue;
            };
            let positions = shared.positions(&shared.tracks[track]).to_vec();
            let (missing, there): (Vec<u32>, Vec<u32>) = positions
                .into_iter()
                .partition(|&position| gaps[position as usize]);
            if missing.is_empty() {
                continue;
            }
            // The name that a set gives to a track without a name.
            let name = match &*shared.tracks[track].name {
                "" => format!("box{}", track + 1),
                name => printable(name).into_owned(),
            };
            if there.is_empty() {
                let message = format!("the track `{name}` has no key without a gap; remove it");
                return Err(self.table.refuse(Code::Null, message));
            }
            warnings.warn_of(missing.len(), Code::Bridged, || {
                let message = format!(
                    "{} of the track `{name}` without a value left out; the curve joins the others",
                    match missing.len() {
                        1 => "1 key".to_owned(),
                        count => format!("{count} keys"),
                    }
                );
                let row = self.row(missing[0] as usize);
                (
                    Some(self.table.location(plan.time_source.column(), row)),
                    message,
                )
            });
            let times = self.times_of(&there);
            let start = shared.order.len();
            shared.order.extend(there);
            shared.lists.push(times);
            let changed = &mut shared.tracks[track];
            (changed.range, changed.list) = (start..shared.order.len(), shared.lists.len() - 1);
        }
        Ok(())
    }

    /// Assigns each row to the track that a column names.
    fn share_out<'a>(
        &self,
        parts: &'a Parts,
        plan: &TablePlan,
        warnings: &mut Warnings,
    ) -> Result<SharedRows<'a>, Diagnostic> {
        let (codes, names) = match (self.tracks, self.rows) {
            (None, _) => (Cow::Owned(vec![0; self.len()]), vec![String::new()]),
            (Some((codes, names)), None) => (Cow::Borrowed(&**codes), names.clone()),
            (Some((codes, names)), Some(rows)) => {
                let group_codes = rows.iter().map(|&row| codes[row as usize]);
                let (codes, distinct) = numbered(group_codes, |code| code as usize);
                let names = distinct.iter().map(|&code| names[code as usize].clone());
                (Cow::Owned(codes), names.collect())
            }
        };
        let (mut order, ranges) = rows_by_code(&codes, names.len());
        let mut tracks = Vec::with_capacity(names.len());
        let mut lists: Vec<Vec<f64>> = Vec::new();
        for (name, range) in names.into_iter().zip(ranges) {
            let times = self.sorted(&mut order[range.clone()], plan, warnings)?;
            // Most tracks have the same times as the track before.
            if lists.last() != Some(&times) {
                lists.push(times);
            }
            tracks.push(TableTrack {
                name,
                parts,
                range,
                list: lists.len() - 1,
            });
        }
        Ok(SharedRows {
            tracks,
            order,
            lists,
        })
    }

    fn time(&self, position: u32) -> f64 {
        self.times.seconds[self.row(position as usize)]
    }

    fn times_of(&self, positions: &[u32]) -> Vec<f64> {
        positions
            .iter()
            .map(|&position| self.time(position))
            .collect()
    }

    /// Removes repeated keys, and refuses times that decrease.
    fn increasing(
        &self,
        plan: &TablePlan,
        shared: &mut SharedRows<'_>,
        keys: &mut [RowKeys],
        warnings: &mut Warnings,
    ) -> Result<(), Diagnostic> {
        // The last list of times that was checked, so that equal lists are not checked again.
        let mut increases = None;
        for (track, keys) in keys.iter_mut().enumerate() {
            let list = shared.tracks[track].list;
            if increases == Some(list) {
                continue;
            }
            let positions = shared.positions(&shared.tracks[track]);
            let location = |key: usize| {
                self.table
                    .location(plan.time_source.column(), self.row(positions[key] as usize))
            };
            let origin = Origin {
                file: &self.table.file,
                location: &location,
                duplicates: self.options.duplicates,
            };
            let mut times = shared.lists[list].clone();
            match origin.increasing(&mut times, |i, j| keys.are_equal(i, j), warnings)? {
                None => increases = Some(list),
                Some(kept) => {
                    let times = kept.iter().map(|&key| times[key]).collect();
                    shared.lists.push(times);
                    shared.tracks[track].list = shared.lists.len() - 1;
                    keys.select(&kept);
                }
            }
        }
        Ok(())
    }
}

/// The indices of the rows with scalars, sorted by time, and the index of the list of their times. These are the rows of
/// the first track, or all rows of a table without tracks.
fn scalar_rows(shared: &SharedRows<'_>) -> (Vec<u32>, usize) {
    match shared.tracks.first() {
        Some(track) => (shared.positions(track).to_vec(), track.list),
        None => (shared.order.clone(), 0),
    }
}
