//! From columns to clips: rows are shared out to clips and tracks, keys become unit quaternions at
//! increasing times.

use std::ops::Range;

use glam::{DQuat, Quat, Vec3};
use tumble::TrackSet;

use crate::diagnostic::{Code, Diagnostic};
use crate::format::{Loaded, ReadOptions};
use crate::grid::restore;
use crate::keys::{Origin, select};
use crate::motion::Motion;
use crate::table::columns::{Reader, Table, Values};
use crate::table::groups::{labels, numbered, scatter, share_out};
use crate::table::plan::{Cell, Parts, Plan, Rows};
use crate::table::times::{Times, times};
use crate::warnings::Warnings;

/// Makes clips of a table that holds what its plan wants.
///
/// # Errors
/// The first fault, if the table is of one clip; in one of several it refuses that clip alone.
pub(crate) fn clips(
    table: &Table,
    plan: &Plan,
    options: &ReadOptions,
) -> Result<Loaded, Diagnostic> {
    if table.rows == 0 {
        return Err(table.refuse(Code::NoRows, "the table has no rows; there are no keys"));
    }
    if u32::try_from(table.rows).is_err() {
        let message = format!("{} rows are more than 2^32; split the table", table.rows);
        return Err(table.refuse(Code::TableClaims, message));
    }
    table.check_nulls()?;
    let mut warnings = Warnings::new(&table.file);
    let times = times(table, plan, options)?;
    let mut loaded = Loaded::default();
    let groups = match plan.clip {
        Some((column, prefix)) => {
            let (codes, names) = labels(table, column);
            let all: Vec<u32> = (0..table.rows as u32).collect();
            let (order, ranges) = share_out(&codes, names.len());
            let rows = scatter(&all, &order);
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
    let tracks = match plan.rows {
        Rows::Keys {
            track: Some(track), ..
        } => Some(labels(table, track)),
        _ => None,
    };
    let alone = groups.len() == 1;
    for (place, (name, rows)) in groups.into_iter().enumerate() {
        let clip = Clip {
            table,
            times: &times,
            rows: rows.as_deref(),
            tracks: tracks.as_ref(),
            options,
        };
        match clip.read(plan, name, &mut warnings) {
            Ok(motion) => loaded.clips.push(Motion { place, ..motion }),
            Err(refusal) if alone => return Err(refusal),
            Err(refusal) => loaded.refused.push(refusal),
        }
    }
    loaded.warnings = warnings.into_list();
    Ok(loaded)
}

/// The keys of one track, row by row.
struct Keys {
    name: String,
    /// Where they come from; empty where that is every row of the clip.
    rows: Vec<u32>,
    /// Which of the clip's lists of times is theirs.
    list: usize,
    rotations: Vec<Quat>,
    translations: Vec<Vec3>,
    scales: Vec<Vec3>,
}

/// One clip of a table: some of its rows, or all.
struct Clip<'a> {
    table: &'a Table,
    times: &'a Times,
    rows: Option<&'a [u32]>,
    /// The track of each row of the table, and the names of the tracks; none in a table of one.
    tracks: Option<&'a (Vec<u32>, Vec<String>)>,
    options: &'a ReadOptions,
}

impl Clip<'_> {
    fn len(&self) -> usize {
        self.rows.map_or(self.table.rows, <[u32]>::len)
    }

    fn row(&self, place: usize) -> usize {
        self.rows.map_or(place, |rows| rows[place] as usize)
    }

    fn read(
        &self,
        plan: &Plan,
        name: Option<String>,
        warnings: &mut Warnings,
    ) -> Result<Motion, Diagnostic> {
        let times: Vec<f64> = match self.rows {
            Some(rows) => rows
                .iter()
                .map(|&row| self.times.seconds[row as usize])
                .collect(),
            None => self.times.seconds.clone(),
        };
        let (mut tracks, mut lists, is_world) = match &plan.rows {
            Rows::Keys {
                parts, is_world, ..
            } => {
                let all = self.keys(String::new(), parts, warnings)?;
                let (tracks, lists) = self.share_out(all, times);
                (tracks, lists, *is_world)
            }
            Rows::Times { tracks, is_world } => {
                let keys = tracks
                    .iter()
                    .map(|(name, parts)| self.keys(name.clone(), parts, warnings));
                (keys.collect::<Result<Vec<_>, _>>()?, vec![times], *is_world)
            }
        };
        let rate = match self.times.precision {
            Some(precision) if !self.options.raw_times => restore(&mut lists, precision),
            Some(_) => None,
            None => self.options.source_rate,
        };
        for keys in &mut tracks {
            self.increasing(plan, keys, &mut lists, warnings)?;
        }
        let mut set = TrackSet::new();
        for (track, keys) in tracks.iter().enumerate() {
            let times = &lists[keys.list];
            let pushed = set
                .push(keys.name.as_str(), times, &keys.rotations)
                .and_then(|()| match keys.translations[..] {
                    [] => Ok(()),
                    _ => set.set_translations(track, times, &keys.translations, &[]),
                })
                .and_then(|()| match keys.scales[..] {
                    [] => Ok(()),
                    _ => set.set_scales(track, times, &keys.scales, &[]),
                });
            pushed.map_err(|error| self.table.refuse(Code::Norm, error.to_string()))?;
        }
        Ok(Motion {
            name,
            set,
            rate,
            is_world,
            time_offset: self.times.offset,
            ..Motion::default()
        })
    }

    /// All keys of one track of a wide table, or those of all tracks of a long one.
    fn keys(
        &self,
        name: String,
        parts: &Parts,
        warnings: &mut Warnings,
    ) -> Result<Keys, Diagnostic> {
        let column = parts.rotation[0].column;
        let place = |key: usize| self.table.place(column, self.row(key));
        let origin = Origin {
            file: &self.table.file,
            place: &place,
            duplicates: self.options.duplicates,
        };
        let [x, y, z, w] = self.columns(&parts.rotation)?;
        let quats = (0..self.len()).map(|place| {
            let row = self.row(place);
            DQuat::from_xyzw(x.at(row), y.at(row), z.at(row), w.at(row))
        });
        let rotations = origin.unit(quats, warnings)?;
        Ok(Keys {
            name,
            rows: Vec::new(),
            list: 0,
            rotations,
            translations: self.vectors(parts.translation.as_ref())?,
            scales: self.vectors(parts.scale.as_ref())?,
        })
    }

    /// Shares keys out to the tracks that a column names, each with a list of times.
    fn share_out(&self, all: Keys, times: Vec<f64>) -> (Vec<Keys>, Vec<Vec<f64>>) {
        let (codes, names) = match (self.tracks, self.rows) {
            (None, _) => (vec![0; self.len()], vec![String::new()]),
            (Some(labels), None) => labels.clone(),
            (Some((codes, names)), Some(rows)) => {
                let own = rows.iter().map(|&row| codes[row as usize]);
                let (codes, own) = numbered(own, |code| code as usize);
                (
                    codes,
                    own.iter()
                        .map(|&code| names[code as usize].clone())
                        .collect(),
                )
            }
        };
        let (order, ranges) = share_out(&codes, names.len());
        let rows: Vec<u32> = (0..self.len())
            .map(|place| self.row(place) as u32)
            .collect();
        let rows = scatter(&rows, &order);
        let times = scatter(&times, &order);
        let rotations = scatter(&all.rotations, &order);
        let translations = scatter(&all.translations, &order);
        let scales = scatter(&all.scales, &order);
        let mut tracks = Vec::new();
        let mut lists: Vec<Vec<f64>> = Vec::new();
        for (name, range) in names.into_iter().zip(ranges) {
            let mut times = times[range.clone()].to_vec();
            let mut keys = Keys {
                name,
                rows: rows[range.clone()].to_vec(),
                list: 0,
                rotations: rotations[range.clone()].to_vec(),
                translations: part(&translations, &range),
                scales: part(&scales, &range),
            };
            // Rows of a long table may come in any order.
            if !times.is_sorted() {
                let mut order: Vec<usize> = (0..times.len()).collect();
                order.sort_by(|&a, &b| times[a].total_cmp(&times[b]));
                select(&mut times, Some(&order));
                select(&mut keys.rows, Some(&order));
                keys.select(&order);
            }
            // Tracks mostly have the times of the track before.
            if lists.last() != Some(&times) {
                lists.push(times);
            }
            keys.list = lists.len() - 1;
            tracks.push(keys);
        }
        (tracks, lists)
    }

    fn vectors(&self, cells: Option<&[Cell; 3]>) -> Result<Vec<Vec3>, Diagnostic> {
        let Some(cells) = cells else {
            return Ok(Vec::new());
        };
        let columns = self.columns(cells)?;
        let vector = |place| {
            let row = self.row(place);
            let numbers = [0, 1, 2].map(|i: usize| columns[i].at(row) as f32);
            if let Some(i) = numbers.iter().position(|number| !number.is_finite()) {
                let message = format!("{} is not finite in f32; repair it", columns[i].at(row));
                let column = cells[i].column;
                return Err(self.table.refuse_at(column, row, Code::NotFinite, message));
            }
            Ok(Vec3::from_array(numbers))
        };
        (0..self.len()).map(vector).collect()
    }

    /// What reads the numbers of some cells.
    fn columns<const N: usize>(&self, cells: &[Cell; N]) -> Result<[Reader<'_>; N], Diagnostic> {
        let mut readers = [Reader::NONE; N];
        for (reader, cell) in readers.iter_mut().zip(cells) {
            *reader = self.reader(*cell)?;
        }
        Ok(readers)
    }

    fn reader(&self, cell: Cell) -> Result<Reader<'_>, Diagnostic> {
        let column = &self.table.columns[cell.column];
        match (&column.values, cell.place) {
            (Values::Numbers(numbers), None) => Ok(Reader {
                numbers,
                ends: None,
                place: 0,
            }),
            (Values::Lists { ends, numbers }, Some(place)) => {
                let short = (0..self.len()).map(|at| self.row(at)).find(|&row| {
                    let start = if row == 0 { 0 } else { ends[row - 1] };
                    ends[row] - start <= place
                });
                if let Some(row) = short {
                    let start = if row == 0 { 0 } else { ends[row - 1] };
                    let message = format!(
                        "the list `{}` has {} numbers; number {place} of it is wanted, from 0",
                        column.name,
                        ends[row] - start
                    );
                    return Err(self
                        .table
                        .refuse_at(cell.column, row, Code::ListLength, message));
                }
                Ok(Reader {
                    numbers,
                    ends: Some(ends),
                    place,
                })
            }
            _ => {
                let message = format!("column `{}` holds no such numbers", column.name);
                Err(self
                    .table
                    .refuse_at(cell.column, 0, Code::ColumnType, message))
            }
        }
    }

    /// Drops keys that are given twice; refuses times that decrease.
    fn increasing(
        &self,
        plan: &Plan,
        keys: &mut Keys,
        lists: &mut Vec<Vec<f64>>,
        warnings: &mut Warnings,
    ) -> Result<(), Diagnostic> {
        let kept = {
            let row = |key| {
                keys.rows
                    .get(key)
                    .map_or_else(|| self.row(key), |&row| row as usize)
            };
            let place = |key: usize| self.table.place(plan.time, row(key));
            let origin = Origin {
                file: &self.table.file,
                place: &place,
                duplicates: self.options.duplicates,
            };
            let same = |list: &[Vec3], i: usize, j: usize| list.is_empty() || list[i] == list[j];
            let equal = |i, j| {
                keys.rotations[i] == keys.rotations[j]
                    && same(&keys.translations, i, j)
                    && same(&keys.scales, i, j)
            };
            origin.increasing(&lists[keys.list], equal, warnings)?
        };
        if let Some(kept) = kept {
            let times = &lists[keys.list];
            lists.push(kept.iter().map(|&key| times[key]).collect());
            keys.list = lists.len() - 1;
            keys.select(&kept);
        }
        Ok(())
    }
}

impl Keys {
    /// Keeps some keys, in this order.
    fn select(&mut self, kept: &[usize]) {
        select(&mut self.rotations, Some(kept));
        for list in [&mut self.translations, &mut self.scales] {
            if !list.is_empty() {
                select(list, Some(kept));
            }
        }
    }
}

/// A part of a list that may not be there.
fn part(list: &[Vec3], range: &Range<usize>) -> Vec<Vec3> {
    list.get(range.clone()).unwrap_or_default().to_vec()
}
