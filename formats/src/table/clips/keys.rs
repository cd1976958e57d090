//! Makes the keys of a clip's tracks from the columns of its table.

use glam::{DQuat, DVec3, Quat, Vec3};
use rayon::prelude::*;

use crate::diagnostic::{Code, Diagnostic};
use crate::motion::keys::{Origin, quiet_unit, quiet_unit_f32, select};
use crate::motion::origin::{origin_of, relative};
use crate::motion::signs::continue_signs;
use crate::table::clips::{SharedRows, TableClip, TableTrack};
use crate::table::columns::{CellReader, Cells, ColumnValues};
use crate::table::plan::{CellSource, Parts, RotationCells};
use crate::warnings::Warnings;

/// Fewer rows than this are processed faster by one thread.
const MIN_PARALLEL_ROWS: usize = 1 << 14;

/// The keys of one track.
pub(crate) struct RowKeys {
    pub(crate) rotations: Vec<Quat>,
    /// The vector to add to the translations.
    pub(crate) origin: DVec3,
    pub(crate) translations: Vec<Vec3>,
    pub(crate) scales: Vec<Vec3>,
}

impl RowKeys {
    /// The keys of a track that will be left out.
    fn at_rest(count: usize) -> Self {
        Self {
            rotations: vec![Quat::IDENTITY; count],
            origin: DVec3::ZERO,
            translations: Vec::new(),
            scales: Vec::new(),
        }
    }

    /// Keeps the keys with these indices, in this order.
    pub(crate) fn select(&mut self, kept: &[usize]) {
        select(&mut self.rotations, Some(kept));
        for list in [&mut self.translations, &mut self.scales] {
            if !list.is_empty() {
                select(list, Some(kept));
            }
        }
    }

    pub(crate) fn are_equal(&self, i: usize, j: usize) -> bool {
        let same = |list: &[Vec3]| list.is_empty() || list[i] == list[j];
        self.rotations[i] == self.rotations[j] && same(&self.translations) && same(&self.scales)
    }
}

/// The keys of all rows of a table, whose positions have no origin yet.
struct AllKeys {
    /// Whether signs must be continued, because the stored form of the rotations has no sign.
    continues_signs: bool,
    rotations: Vec<Quat>,
    translations: Vec<DVec3>,
    scales: Vec<DVec3>,
}

impl AllKeys {
    /// The keys at some positions.
    fn at(&self, positions: &[u32]) -> RowKeys {
        let vectors = |list: &[DVec3]| -> Vec<DVec3> {
            match list {
                [] => Vec::new(),
                list => positions
                    .iter()
                    .map(|&position| list[position as usize])
                    .collect(),
            }
        };
        let rotations = positions
            .iter()
            .map(|&position| self.rotations[position as usize]);
        let mut rotations: Vec<Quat> = rotations.collect();
        if self.continues_signs {
            continue_signs(&mut rotations, 1);
        }
        let (origin, translations) = relative(&vectors(&self.translations));
        let scales = vectors(&self.scales);
        RowKeys {
            rotations,
            origin,
            translations,
            scales: scales.iter().map(|scale| scale.as_vec3()).collect(),
        }
    }
}

impl TableClip<'_> {
    /// The keys of all tracks.
    ///
    /// # Errors
    /// The first error, row by row.
    pub(crate) fn keys(
        &self,
        shared: &SharedRows<'_>,
        warnings: &mut Warnings,
    ) -> Result<Vec<RowKeys>, Diagnostic> {
        let are_needed = self.are_needed(shared);
        let quiet_keys = |(track, &is_needed): (&TableTrack<'_>, &bool)| {
            let positions = shared.positions(track);
            match is_needed {
                true => self.quiet_keys(track.parts, positions),
                false => Some(RowKeys::at_rest(positions.len())),
            }
        };
        let rows = shared
            .tracks
            .first()
            .map_or(0, |track| shared.positions(track).len());
        let at_least = MIN_PARALLEL_ROWS.div_ceil(rows.max(1));
        let alone = || {
            shared
                .tracks
                .iter()
                .zip(&are_needed)
                .map(quiet_keys)
                .collect()
        };
        let quiet: Vec<Option<RowKeys>> = match shared.tracks.len() <= at_least {
            true => alone(),
            false => tumble::on_threads(|| {
                let tracks = shared.tracks.par_iter().zip(&are_needed);
                tracks.with_min_len(at_least).map(quiet_keys).collect()
            })
            // If the system refuses to start threads, this thread does all the work.
            .unwrap_or_else(|_| alone()),
        };
        let left_out = self.left_out(shared, &are_needed);
        // Tracks with the same columns are read together, so that warnings are in the order of the rows.
        let mut known: Option<(&Parts, AllKeys)> = None;
        let keys = shared.tracks.iter().zip(quiet).map(|(track, quiet)| {
            if let Some(keys) = quiet {
                return Ok(keys);
            }
            let all = match known.take() {
                Some((parts, all)) if std::ptr::eq(parts, track.parts) => all,
                _ => self.all_keys(track.parts, &left_out, warnings)?,
            };
            let keys = all.at(shared.positions(track));
            known = Some((track.parts, all));
            Ok(keys)
        });
        keys.collect()
    }

    /// The keys at some positions; `None` if any of them needs a warning or an error.
    fn quiet_keys(&self, parts: &Parts, positions: &[u32]) -> Option<RowKeys> {
        let rotations = match &parts.rotation {
            RotationCells::Quaternion(cells) => self.quiet_quaternions(cells, positions),
            RotationCells::Other(form, cells) => {
                let columns = cells.iter().map(|&cell| self.reader(cell).ok());
                let columns: Vec<CellReader<'_>> = columns.collect::<Option<_>>()?;
                let mut numbers = vec![0.0; columns.len()];
                let keys = positions.iter().map(|&position| {
                    let row = self.row(position as usize);
                    let each = numbers.iter_mut().zip(&columns);
                    each.for_each(|(number, column)| *number = column.at(row));
                    form.rotation(&numbers).map_or(Quat::NAN, quiet_unit)
                });
                let mut keys = units(keys)?;
                continue_signs(&mut keys, 1);
                Some(keys)
            }
        };
        let (origin, translations) = self.quiet_points(parts.translation.as_ref(), positions)?;
        Some(RowKeys {
            rotations: rotations?,
            origin,
            translations,
            scales: self.quiet_vectors(parts.scale.as_ref(), positions)?,
        })
    }

    fn quiet_quaternions(&self, cells: &[CellSource; 4], positions: &[u32]) -> Option<Vec<Quat>> {
        let rows = positions
            .iter()
            .map(|&position| self.row(position as usize));
        match Cells::of(self.columns(cells).ok()?) {
            Cells::F32([x, y, z, w]) => units(
                rows.map(|row| quiet_unit_f32(Quat::from_xyzw(x[row], y[row], z[row], w[row]))),
            ),
            Cells::F64([x, y, z, w]) => {
                units(rows.map(|row| quiet_unit(DQuat::from_xyzw(x[row], y[row], z[row], w[row]))))
            }
            Cells::Other([x, y, z, w]) => units(rows.map(|row| {
                let key = DQuat::from_xyzw(x.at(row), y.at(row), z.at(row), w.at(row));
                quiet_unit(key)
            })),
        }
    }

    /// Positions with their origin. Positions that are f32 in the file have no digits that an origin would keep.
    fn quiet_points(
        &self,
        cells: Option<&[CellSource; 3]>,
        positions: &[u32],
    ) -> Option<(DVec3, Vec<Vec3>)> {
        let columns = cells.map(|cells| self.columns(cells).ok());
        let point: &dyn Fn(usize) -> DVec3 = match columns.map(|columns| columns.map(Cells::of)) {
            None | Some(Some(Cells::F32(_))) => {
                return Some((DVec3::ZERO, self.quiet_vectors(cells, positions)?));
            }
            Some(None) => return None,
            Some(Some(Cells::F64([x, y, z]))) => &move |row| DVec3::new(x[row], y[row], z[row]),
            Some(Some(Cells::Other(columns))) => {
                &move |row| DVec3::from_array(columns.map(|column| column.at(row)))
            }
        };
        let points = || {
            positions
                .iter()
                .map(|&position| point(self.row(position as usize)))
        };
        let origin = origin_of(points());
        let points = finite(points().map(|point| (point - origin).as_vec3()))?;
        Some((origin, points))
    }

    fn quiet_vectors(
        &self,
        cells: Option<&[CellSource; 3]>,
        positions: &[u32],
    ) -> Option<Vec<Vec3>> {
        let Some(cells) = cells else {
            return Some(Vec::new());
        };
        let rows = positions
            .iter()
            .map(|&position| self.row(position as usize));
        match Cells::of(self.columns(cells).ok()?) {
            Cells::F32([x, y, z]) => finite(rows.map(|row| Vec3::new(x[row], y[row], z[row]))),
            Cells::F64([x, y, z]) => {
                finite(rows.map(|row| Vec3::new(x[row] as f32, y[row] as f32, z[row] as f32)))
            }
            Cells::Other(columns) => finite(rows.map(|row| {
                let [x, y, z] = columns.map(|column| column.at(row) as f32);
                Vec3::new(x, y, z)
            })),
        }
    }

    /// For each row, whether it is only of tracks that will be left out.
    fn left_out(&self, shared: &SharedRows<'_>, are_needed: &[bool]) -> Vec<bool> {
        if are_needed.iter().all(|&is_needed| is_needed) {
            return vec![false; self.len()];
        }
        let mut left_out = vec![true; self.len()];
        let tracks = shared.tracks.iter().zip(are_needed);
        for (track, _) in tracks.filter(|(_, is_needed)| **is_needed) {
            for &position in shared.positions(track) {
                left_out[position as usize] = false;
            }
        }
        left_out
    }

    /// The keys of all rows, one after another; those that are left out are at rest.
    fn all_keys(
        &self,
        parts: &Parts,
        left_out: &[bool],
        warnings: &mut Warnings,
    ) -> Result<AllKeys, Diagnostic> {
        let column = parts.rotation.all()[0].column;
        let location = |key: usize| self.table.location(column, self.row(key));
        let origin = Origin {
            file: &self.table.file,
            location: &location,
            duplicates: self.options.duplicates,
        };
        let quats: Vec<DQuat> = match &parts.rotation {
            RotationCells::Quaternion(cells) => {
                let [x, y, z, w] = self.columns(cells)?;
                let rotation = |position: usize| {
                    let row = self.row(position);
                    match left_out[position] {
                        true => DQuat::IDENTITY,
                        false => DQuat::from_xyzw(x.at(row), y.at(row), z.at(row), w.at(row)),
                    }
                };
                (0..self.len()).map(rotation).collect()
            }
            RotationCells::Other(form, cells) => {
                let columns = cells.iter().map(|&cell| self.reader(cell));
                let columns: Vec<CellReader<'_>> = columns.collect::<Result<_, _>>()?;
                let rotation = |position: usize| {
                    if left_out[position] {
                        return Ok(DQuat::IDENTITY);
                    }
                    let row = self.row(position);
                    let numbers: Vec<f64> = columns.iter().map(|column| column.at(row)).collect();
                    // Rows with NaN are removed later.
                    if self.options.bridge_gaps && numbers.iter().any(|number| number.is_nan()) {
                        return Ok(DQuat::IDENTITY);
                    }
                    form.rotation(&numbers).ok_or_else(|| {
                        let message =
                            format!("{numbers:?} are not a rotation; repair or remove the row");
                        let code = match numbers.iter().all(|number| number.is_finite()) {
                            true => Code::NoRotation,
                            false => Code::NotFinite,
                        };
                        self.table.refuse_at(column, row, code, message)
                    })
                };
                (0..self.len()).map(rotation).collect::<Result<_, _>>()?
            }
        };
        let is_gap = |q: &DQuat| self.options.bridge_gaps && q.is_nan();
        let quats = quats
            .into_iter()
            .map(|q| if is_gap(&q) { DQuat::IDENTITY } else { q });
        Ok(AllKeys {
            continues_signs: matches!(parts.rotation, RotationCells::Other(..)),
            rotations: origin.unit(quats, warnings)?,
            translations: self.all_vectors(parts.translation.as_ref(), left_out)?,
            scales: self.all_vectors(parts.scale.as_ref(), left_out)?,
        })
    }

    fn all_vectors(
        &self,
        cells: Option<&[CellSource; 3]>,
        left_out: &[bool],
    ) -> Result<Vec<DVec3>, Diagnostic> {
        let Some(cells) = cells else {
            return Ok(Vec::new());
        };
        let columns = self.columns(cells)?;
        let vector = |position: usize| {
            if left_out[position] {
                return Ok(DVec3::ZERO);
            }
            let row = self.row(position);
            let numbers = [0, 1, 2].map(|i: usize| columns[i].at(row));
            let is_bad = |number: f64| {
                !((number as f32).is_finite() || self.options.bridge_gaps && number.is_nan())
            };
            if let Some(i) = numbers.iter().position(|&number| is_bad(number)) {
                let message = format!("{} is not finite in f32; repair it", columns[i].at(row));
                let column = cells[i].column;
                return Err(self.table.refuse_at(column, row, Code::NotFinite, message));
            }
            Ok(DVec3::from_array(numbers))
        };
        (0..self.len()).map(vector).collect()
    }

    /// For each row, whether a number of a track's key is missing, so that [`ReadOptions::bridge_gaps`] leaves it
    /// out.
    ///
    /// [`ReadOptions::bridge_gaps`]: crate::format::ReadOptions::bridge_gaps
    pub(crate) fn gaps(&self, parts: &Parts) -> Result<Option<Vec<bool>>, Diagnostic> {
        let columns = parts.cells().map(|cell| self.reader(cell));
        let columns: Vec<CellReader<'_>> = columns.collect::<Result<_, _>>()?;
        let is_gap = |position: usize| {
            let row = self.row(position);
            columns.iter().any(|column| column.at(row).is_nan())
        };
        let gaps: Vec<bool> = (0..self.len()).map(is_gap).collect();
        Ok(gaps.contains(&true).then_some(gaps))
    }

    /// The readers of the numbers of some cells.
    fn columns<const N: usize>(
        &self,
        cells: &[CellSource; N],
    ) -> Result<[CellReader<'_>; N], Diagnostic> {
        let mut readers = [CellReader::NONE; N];
        for (reader, cell) in readers.iter_mut().zip(cells) {
            *reader = self.reader(*cell)?;
        }
        Ok(readers)
    }

    pub(in crate::table) fn reader(&self, cell: CellSource) -> Result<CellReader<'_>, Diagnostic> {
        let column = &self.table.columns[cell.column];
        match (&column.values, cell.item) {
            (ColumnValues::Numbers(numbers), None) => Ok(CellReader {
                numbers,
                ends: None,
                item: 0,
            }),
            (ColumnValues::Lists { ends, numbers }, Some(item)) => {
                let length = |row: usize| ends[row] - if row == 0 { 0 } else { ends[row - 1] };
                let rows = (0..self.len()).map(|at| self.row(at));
                let misfit = { rows }.find(|&row| match cell.whole {
                    Some(whole) => length(row) != whole,
                    None => length(row) <= item,
                });
                if let Some(row) = misfit {
                    let (name, length) = (&column.name, length(row));
                    let message = match cell.whole {
                        Some(whole) => format!(
                            "the list `{name}` has {length} numbers, and {whole} are needed; say which, such as {name}[0:{whole}]"
                        ),
                        None => format!(
                            "the list `{name}` has {length} numbers; number {item} of it is asked for, counted from 0"
                        ),
                    };
                    return Err(self
                        .table
                        .refuse_at(cell.column, row, Code::ListLength, message));
                }
                Ok(CellReader {
                    numbers,
                    ends: Some(ends),
                    item,
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
}

/// Keys as [`quiet_unit`] makes them; `None` if any of them needs a warning or an error.
fn units(keys: impl Iterator<Item = Quat>) -> Option<Vec<Quat>> {
    let keys: Vec<Quat> = keys.collect();
    let is_marked = |any: bool, key: &Quat| any | key.w.is_nan();
    (!keys.iter().fold(false, is_marked)).then_some(keys)
}

/// The vectors; `None` if one of them is not finite.
fn finite(vectors: impl Iterator<Item = Vec3>) -> Option<Vec<Vec3>> {
    let vectors: Vec<Vec3> = vectors.collect();
    let numbers: &[f32] = bytemuck::cast_slice(&vectors);
    // The loop has no early exit, so that it is compiled to vector instructions.
    let are_finite = |all: bool, number: &f32| all & number.is_finite();
    numbers.iter().fold(true, are_finite).then_some(vectors)
}
