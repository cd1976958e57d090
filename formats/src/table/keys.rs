//! The keys of a clip's tracks, from the columns of its table.

use glam::{DQuat, DVec3, Quat, Vec3};
use rayon::prelude::*;

use crate::diagnostic::{Code, Diagnostic};
use crate::keys::{Origin, quiet_unit, quiet_unit_f32, select};
use crate::origin::{origin_of, relative};
use crate::signs::continue_signs;
use crate::table::clips::{Clip, Shared, Track};
use crate::table::columns::{Cells, Reader, Values};
use crate::table::plan::{Cell, Parts, RotationCells};
use crate::warnings::Warnings;

/// Fewer rows than this are no work for another thread.
const FEW: usize = 1 << 14;

/// The keys of one track.
pub(crate) struct Keys {
    pub(crate) rotations: Vec<Quat>,
    /// What the translations are to be moved by.
    pub(crate) origin: DVec3,
    pub(crate) translations: Vec<Vec3>,
    pub(crate) scales: Vec<Vec3>,
}

impl Keys {
    /// Keeps some keys, in this order.
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
    /// Signs say nothing.
    continues_signs: bool,
    rotations: Vec<Quat>,
    translations: Vec<DVec3>,
    scales: Vec<DVec3>,
}

impl AllKeys {
    /// Those at some places.
    fn at(&self, places: &[u32]) -> Keys {
        let vectors = |list: &[DVec3]| -> Vec<DVec3> {
            match list {
                [] => Vec::new(),
                list => places.iter().map(|&place| list[place as usize]).collect(),
            }
        };
        let rotations = places.iter().map(|&place| self.rotations[place as usize]);
        let mut rotations: Vec<Quat> = rotations.collect();
        if self.continues_signs {
            continue_signs(&mut rotations, 1);
        }
        let (origin, translations) = relative(&vectors(&self.translations));
        let scales = vectors(&self.scales);
        Keys {
            rotations,
            origin,
            translations,
            scales: scales.iter().map(|scale| scale.as_vec3()).collect(),
        }
    }
}

impl Clip<'_> {
    /// The keys of all tracks.
    ///
    /// # Errors
    /// The first fault, row by row.
    pub(crate) fn keys(
        &self,
        shared: &Shared<'_>,
        warnings: &mut Warnings,
    ) -> Result<Vec<Keys>, Diagnostic> {
        let quiet = |track: &Track<'_>| self.quiet_keys(track.parts, shared.places(track));
        let rows = shared
            .tracks
            .first()
            .map_or(0, |track| shared.places(track).len());
        let at_least = FEW.div_ceil(rows.max(1));
        let alone = || shared.tracks.iter().map(quiet).collect();
        let quiet: Vec<Option<Keys>> = match shared.tracks.len() <= at_least {
            true => alone(),
            false => tumble::on_threads(|| {
                let tracks = shared.tracks.par_iter().with_min_len(at_least);
                tracks.map(quiet).collect()
            })
            // Where the system refuses threads this one does it all.
            .unwrap_or_else(|_| alone()),
        };
        // Where there is something to be said it is said in the order of the rows: tracks that share
        // columns are read together.
        let mut known: Option<(&Parts, AllKeys)> = None;
        let keys = shared.tracks.iter().zip(quiet).map(|(track, quiet)| {
            if let Some(keys) = quiet {
                return Ok(keys);
            }
            let all = match known.take() {
                Some((parts, all)) if std::ptr::eq(parts, track.parts) => all,
                _ => self.all_keys(track.parts, warnings)?,
            };
            let keys = all.at(shared.places(track));
            known = Some((track.parts, all));
            Ok(keys)
        });
        keys.collect()
    }

    /// The keys at some places; nothing if there is anything to be said about them.
    fn quiet_keys(&self, parts: &Parts, places: &[u32]) -> Option<Keys> {
        let rotations = match &parts.rotation {
            RotationCells::Quaternion(cells) => self.quiet_quaternions(cells, places),
            RotationCells::Other(form, cells) => {
                let columns = cells.iter().map(|&cell| self.reader(cell).ok());
                let columns: Vec<Reader<'_>> = columns.collect::<Option<_>>()?;
                let mut numbers = vec![0.0; columns.len()];
                let keys = places.iter().map(|&place| {
                    let row = self.row(place as usize);
                    let each = numbers.iter_mut().zip(&columns);
                    each.for_each(|(number, column)| *number = column.at(row));
                    form.rotation(&numbers).map_or(Quat::NAN, quiet_unit)
                });
                let mut keys = units(keys)?;
                continue_signs(&mut keys, 1);
                Some(keys)
            }
        };
        let (origin, translations) = self.quiet_points(parts.translation.as_ref(), places)?;
        Some(Keys {
            rotations: rotations?,
            origin,
            translations,
            scales: self.quiet_vectors(parts.scale.as_ref(), places)?,
        })
    }

    fn quiet_quaternions(&self, cells: &[Cell; 4], places: &[u32]) -> Option<Vec<Quat>> {
        let rows = places.iter().map(|&place| self.row(place as usize));
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

    /// Positions, with their origin. Those that are f32 in the file have lost what one would keep.
    fn quiet_points(
        &self,
        cells: Option<&[Cell; 3]>,
        places: &[u32],
    ) -> Option<(DVec3, Vec<Vec3>)> {
        let columns = cells.map(|cells| self.columns(cells).ok());
        let point: &dyn Fn(usize) -> DVec3 = match columns.map(|columns| columns.map(Cells::of)) {
            None | Some(Some(Cells::F32(_))) => {
                return Some((DVec3::ZERO, self.quiet_vectors(cells, places)?));
            }
            Some(None) => return None,
            Some(Some(Cells::F64([x, y, z]))) => &move |row| DVec3::new(x[row], y[row], z[row]),
            Some(Some(Cells::Other(columns))) => {
                &move |row| DVec3::from_array(columns.map(|column| column.at(row)))
            }
        };
        let points = || places.iter().map(|&place| point(self.row(place as usize)));
        let origin = origin_of(points());
        let points = finite(points().map(|point| (point - origin).as_vec3()))?;
        Some((origin, points))
    }

    fn quiet_vectors(&self, cells: Option<&[Cell; 3]>, places: &[u32]) -> Option<Vec<Vec3>> {
        let Some(cells) = cells else {
            return Some(Vec::new());
        };
        let rows = places.iter().map(|&place| self.row(place as usize));
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

    /// The keys of all rows, one after another.
    fn all_keys(&self, parts: &Parts, warnings: &mut Warnings) -> Result<AllKeys, Diagnostic> {
        let column = parts.rotation.all()[0].column;
        let place = |key: usize| self.table.place(column, self.row(key));
        let origin = Origin {
            file: &self.table.file,
            place: &place,
            duplicates: self.options.duplicates,
        };
        let quats: Vec<DQuat> = match &parts.rotation {
            RotationCells::Quaternion(cells) => {
                let [x, y, z, w] = self.columns(cells)?;
                let rows = (0..self.len()).map(|place| self.row(place));
                rows.map(|row| DQuat::from_xyzw(x.at(row), y.at(row), z.at(row), w.at(row)))
                    .collect()
            }
            RotationCells::Other(form, cells) => {
                let columns = cells.iter().map(|&cell| self.reader(cell));
                let columns: Vec<Reader<'_>> = columns.collect::<Result<_, _>>()?;
                let rotation = |place| {
                    let row = self.row(place);
                    let numbers: Vec<f64> = columns.iter().map(|column| column.at(row)).collect();
                    // Gaps are left out later.
                    if self.options.bridge_gaps && numbers.iter().any(|number| number.is_nan()) {
                        return Ok(DQuat::IDENTITY);
                    }
                    form.rotation(&numbers).ok_or_else(|| {
                        let message =
                            format!("{numbers:?} are no rotation; repair or remove the row");
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
            translations: self.all_vectors(parts.translation.as_ref())?,
            scales: self.all_vectors(parts.scale.as_ref())?,
        })
    }

    fn all_vectors(&self, cells: Option<&[Cell; 3]>) -> Result<Vec<DVec3>, Diagnostic> {
        let Some(cells) = cells else {
            return Ok(Vec::new());
        };
        let columns = self.columns(cells)?;
        let vector = |place| {
            let row = self.row(place);
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

    /// Whether a number of a track's key is missing in a row: [`ReadOptions::bridge_gaps`] leaves it out.
    ///
    /// [`ReadOptions::bridge_gaps`]: crate::format::ReadOptions::bridge_gaps
    pub(crate) fn gaps(&self, parts: &Parts) -> Result<Option<Vec<bool>>, Diagnostic> {
        let vectors = [&parts.translation, &parts.scale];
        let cells = parts.rotation.all().iter();
        let cells = cells.chain(vectors.into_iter().flatten().flatten());
        let columns = cells.map(|&cell| self.reader(cell));
        let columns: Vec<Reader<'_>> = columns.collect::<Result<_, _>>()?;
        let is_gap = |place: usize| {
            let row = self.row(place);
            columns.iter().any(|column| column.at(row).is_nan())
        };
        let gaps: Vec<bool> = (0..self.len()).map(is_gap).collect();
        Ok(gaps.contains(&true).then_some(gaps))
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
                let length = |row: usize| ends[row] - if row == 0 { 0 } else { ends[row - 1] };
                let rows = (0..self.len()).map(|at| self.row(at));
                let misfit = { rows }.find(|&row| match cell.whole {
                    Some(whole) => length(row) != whole,
                    None => length(row) <= place,
                });
                if let Some(row) = misfit {
                    let (name, length) = (&column.name, length(row));
                    let message = match cell.whole {
                        Some(whole) => format!(
                            "the list `{name}` has {length} numbers, and {whole} are needed; say which, such as {name}[0:{whole}]"
                        ),
                        None => format!(
                            "the list `{name}` has {length} numbers; number {place} of it is asked for, counted from 0"
                        ),
                    };
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
}

/// Keys as [`quiet_unit`] makes them; nothing if there is anything to be said about one of them.
fn units(keys: impl Iterator<Item = Quat>) -> Option<Vec<Quat>> {
    let keys: Vec<Quat> = keys.collect();
    let is_marked = |any: bool, key: &Quat| any | key.w.is_nan();
    (!keys.iter().fold(false, is_marked)).then_some(keys)
}

/// The vectors; nothing if one of them is not finite.
fn finite(vectors: impl Iterator<Item = Vec3>) -> Option<Vec<Vec3>> {
    let vectors: Vec<Vec3> = vectors.collect();
    let numbers: &[f32] = bytemuck::cast_slice(&vectors);
    // To the end in any case, so that it is compiled to vectors.
    let are_finite = |all: bool, number: &f32| all & number.is_finite();
    numbers.iter().fold(true, are_finite).then_some(vectors)
}
