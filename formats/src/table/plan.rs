//! Assigns a meaning to the columns of a table, by their names and by the option `--map`.

use std::collections::{HashMap, HashSet};
use std::ops::Range;

use tumble::FrameRate;

use crate::diagnostic::{Code, Diagnostic};
use crate::format::{ReadOptions, TimeUnit};
use crate::map::{Entry, Map};
use crate::motion::ScalarKind;
use crate::npz::plan::scalars::RADIANS;
use crate::quaternion::ComponentOrder;
use crate::rotation_form::RotationForm;
use crate::table::columns::{ColumnNeed, RequestedColumn, Table};
use crate::warnings::{Warnings, listed};

/// Columns with the track of a row, in long tables.
const TRACK: [&str; 3] = ["track", "joint", "body"];

/// Columns with the clip of a row.
const CLIP: [&str; 3] = ["clip", "clip_id", "motion_id"];

/// Columns with the number of a row.
const COUNTED: [&str; 3] = ["frame", "frame_index", "index"];

/// The columns that are read, and their use. Columns are indices in `columns`.
#[derive(Debug)]
pub(crate) struct TablePlan {
    pub(crate) columns: Vec<RequestedColumn>,
    pub(crate) time_source: TimeSource,
    /// The unit of the times in a column of numbers, if it is given or was recognised.
    pub(crate) time_unit: Option<TimeUnit>,
    /// The column of clips, and the prefix of its values in the names of clips.
    pub(crate) clip: Option<(usize, &'static str)>,
    pub(crate) rows: RowLayout,
    /// The scalars of each row, beside the keys of tracks.
    pub(crate) scalars: Vec<ScalarColumn>,
    /// The names of the columns that are not read.
    pub(crate) left_out: Vec<String>,
    /// The metadata of the file.
    #[cfg(feature = "parquet")]
    pub(crate) notes: Vec<(String, String)>,
}

/// The source of the times of rows.
#[derive(Debug, Clone, Copy)]
pub(crate) enum TimeSource {
    /// A column of times.
    Times(usize),
    /// A column with the number of the frame, of frames of a rate.
    Frames(usize, FrameRate),
    /// The position of the row among those of its track, of frames of a rate.
    Rows(FrameRate),
}

impl TimeSource {
    /// The column in which a row has its time, for messages about it.
    pub(crate) fn column(self) -> usize {
        match self {
            Self::Times(column) | Self::Frames(column, _) => column,
            // The error is about a row, so any column will do.
            Self::Rows(_) => 0,
        }
    }
}

/// The meaning of a row.
#[derive(Debug)]
pub(crate) enum RowLayout {
    /// A key of the track that a column names.
    Keys {
        track: Option<usize>,
        parts: Box<Parts>,
        is_world: bool,
    },
    /// A key of every track; with the name of each.
    Times {
        tracks: Vec<(String, Parts)>,
        is_world: bool,
    },
}

/// Scalars in a column: of a number, or of a list.
#[derive(Debug)]
pub(crate) struct ScalarColumn {
    pub(crate) column: usize,
    /// Which numbers of a list; `None` for all of it.
    pub(crate) items: Option<Range<usize>>,
    /// The beginning of the names of several scalars, or the name of one.
    pub(crate) name: String,
    /// The name of each of several, if they are known.
    pub(crate) names: Vec<String>,
    pub(crate) kind: ScalarKind,
    /// The factor for the numbers.
    pub(crate) factor: f64,
}

impl ScalarColumn {
    /// The name and the location of each scalar.
    pub(crate) fn cells(
        &self,
        table: &Table,
        warnings: &mut Warnings,
    ) -> Vec<(String, CellSource)> {
        let column = self.column;
        let Some(length) = table.list_length(column) else {
            let cell = CellSource {
                column,
                item: None,
                whole: None,
            };
            return vec![(self.name.clone(), cell)];
        };
        let items = self.items.clone().unwrap_or(0..length);
        let has_names = self.names.len() == items.len();
        if !has_names {
            warnings.warn(Code::UnnamedJoints, || {
                let name = &self.name;
                let message = format!(
                    "the {length} numbers of `{name}` have no names; they are called {name}.0, {name}.1 …; --map names \
                     them, as in --map 'left_knee={name}[0]:scalar:angle'"
                );
                (None, message)
            });
        }
        let named = |(index, item): (usize, usize)| {
            let name = match has_names {
                true => self.names[index].clone(),
                false => format!("{}.{index}", self.name),
            };
            let cell = CellSource {
                column,
                item: Some(item),
                whole: self.items.is_none().then_some(length),
            };
            (name, cell)
        };
        items.enumerate().map(named).collect()
    }
}

/// The columns of robots' data sets by `LeRobot` that are scalars.
const LEROBOT: [&str; 2] = ["observation.state", "action"];

/// The columns of the numbers of a track's keys.
#[derive(Debug)]
pub(crate) struct Parts {
    pub(crate) rotation: RotationCells,
    pub(crate) translation: Option<[CellSource; 3]>,
    pub(crate) scale: Option<[CellSource; 3]>,
}

impl Parts {
    /// All cells of a key.
    pub(crate) fn cells(&self) -> impl Iterator<Item = CellSource> {
        let vectors = [&self.translation, &self.scale].into_iter().flatten();
        let rotation = self.rotation.all().iter();
        rotation.chain(vectors.flatten()).copied()
    }
}

/// The columns of the numbers of rotations.
#[derive(Debug)]
pub(crate) enum RotationCells {
    /// Quaternions x y z w.
    Quaternion([CellSource; 4]),
    /// Rotations in another form, with as many numbers as it needs.
    Other(RotationForm, Vec<CellSource>),
}

impl RotationCells {
    pub(crate) fn all(&self) -> &[CellSource] {
        match self {
            Self::Quaternion(cells) => cells,
            Self::Other(_, cells) => cells,
        }
    }
}

/// The location of a number in a row: a column, or an index in the list of a column.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CellSource {
    pub(crate) column: usize,
    pub(crate) item: Option<usize>,
    /// The required length of the list, if all of it is used.
    pub(crate) whole: Option<usize>,
}

/// The names of a file's columns, some of which `--map` has changed.
struct ColumnNames<'a> {
    file: &'a str,
    /// The columns with each name; a name with several columns is not usable.
    seen: HashMap<String, Vec<usize>>,
    file_columns: &'a [String],
    requested: Vec<RequestedColumn>,
    requested_indices: HashMap<(usize, ColumnNeed), usize>,
}

impl ColumnNames<'_> {
    fn refuse(&self, code: Code, message: String) -> Diagnostic {
        Diagnostic::new(self.file, code, message)
    }

    /// The names of the file's columns, for messages.
    fn list(&self) -> String {
        const MAX_SHOWN: usize = 12;
        let shown: Vec<String> = self
            .file_columns
            .iter()
            .take(MAX_SHOWN)
            .map(|n| format!("`{n}`"))
            .collect();
        let more = if self.file_columns.len() > MAX_SHOWN {
            ", …"
        } else {
            ""
        };
        format!("{}{more}", shown.join(", "))
    }

    /// The index of a column of the file.
    fn find(&self, name: &str) -> Result<Option<usize>, Diagnostic> {
        match self.seen.get(name).map_or(&[][..], Vec::as_slice) {
            [] => Ok(None),
            [index] => Ok(Some(*index)),
            _ => {
                let message = format!(
                    "two columns are called `{name}`; rename one of them, or tell them apart by --map, in which the \
                     second is `{name}.1`"
                );
                Err(self.refuse(Code::ColumnTwice, message))
            }
        }
    }

    /// As [`ColumnNames::position`]; an error without such a column.
    fn required(&self, source: &str) -> Result<usize, Diagnostic> {
        self.position(source).ok_or_else(|| {
            let message = format!("there is no column `{source}`; there are {}", self.list());
            self.refuse(Code::ColumnMissing, message)
        })
    }

    /// The index of the column that `--map` names. Of several columns of one name, the second is called `x.1`, the
    /// third `x.2`, as pandas names them.
    fn position(&self, source: &str) -> Option<usize> {
        let nth = |name: &str, nth: usize| {
            let all = self.file_columns.iter().enumerate();
            let mut same = all.filter(|(_, column)| *column == name);
            same.nth(nth).map(|(index, _)| index)
        };
        nth(source, 0).or_else(|| {
            let (name, number) = source.rsplit_once('.')?;
            nth(name, number.parse().ok()?)
        })
    }

    fn request(&mut self, index: usize, need: ColumnNeed) -> usize {
        *self
            .requested_indices
            .entry((index, need))
            .or_insert_with(|| {
                self.requested.push(RequestedColumn {
                    name: self.file_columns[index].clone(),
                    index,
                    need,
                });
                self.requested.len() - 1
            })
    }

    fn take(&mut self, name: &str, need: ColumnNeed) -> Result<Option<usize>, Diagnostic> {
        Ok(self.find(name)?.map(|index| self.request(index, need)))
    }

    /// The first column that has one of these names.
    fn first_of(&mut self, all: &[&str]) -> Result<Option<usize>, Diagnostic> {
        for name in all {
            if let Some(found) = self.take(name, ColumnNeed::Name)? {
                return Ok(Some(found));
            }
        }
        Ok(None)
    }

    /// The columns with all of these names; `None` if there are none of them.
    fn group<const N: usize>(
        &mut self,
        prefix: &str,
        parts: [&str; N],
    ) -> Result<Option<[CellSource; N]>, Diagnostic> {
        let names = parts.map(|part| format!("{prefix}{part}"));
        let mut found = [None; N];
        for (found, name) in found.iter_mut().zip(&names) {
            *found = self.find(name)?;
        }
        if found.iter().all(Option::is_none) {
            return Ok(None);
        }
        let mut cells = [CellSource {
            column: 0,
            item: None,
            whole: None,
        }; N];
        for ((cell, found), name) in cells.iter_mut().zip(found).zip(&names) {
            let Some(index) = found else {
                let message = format!(
                    "column `{name}` is missing: {} belong together; there are {}",
                    names.join(", "),
                    self.list()
                );
                return Err(self.refuse(Code::ColumnMissing, message));
            };
            cell.column = self.request(index, ColumnNeed::Number);
        }
        Ok(Some(cells))
    }

    /// The columns of one track, and whether its translations are relative to the world.
    fn parts(&mut self, prefix: &str) -> Result<(Parts, bool), Diagnostic> {
        // In trajectories, rotations are called qx qy qz qw, and positions may be called x y z.
        let is_pose = self.find(&format!("{prefix}qw"))?.is_some();
        let names = match is_pose {
            true => ["qx", "qy", "qz", "qw"],
            false => ["x", "y", "z", "w"],
        };
        if !is_pose {
            self.check_position(prefix)?;
        }
        let missing = "a rotation has the columns x, y, z and w, or qx, qy, qz and qw".to_owned();
        let rotation = self.group(prefix, names)?;
        let rotation = rotation.ok_or_else(|| self.refuse(Code::NoRotations, missing))?;
        let mut vectors = self.vectors(prefix)?;
        if is_pose && vectors.translation.is_none() && self.find(&format!("{prefix}x"))?.is_some() {
            vectors.translation = self.group(prefix, ["x", "y", "z"])?;
        }
        if vectors.translation.is_none()
            && let Some(beside) = prefix_of_position(prefix)
        {
            vectors.translation = self.group(&beside, ["x", "y", "z"])?;
        }
        let parts = Parts {
            rotation: RotationCells::Quaternion(rotation),
            translation: vectors.translation,
            scale: vectors.scale,
        };
        Ok((parts, vectors.is_world))
    }

    /// The columns of the translations and scales of one track.
    fn vectors(&mut self, prefix: &str) -> Result<VectorCells, Diagnostic> {
        let local = self.group(prefix, ["tx", "ty", "tz"])?;
        let world = match local {
            Some(_) => None,
            None => self.group(prefix, ["px", "py", "pz"])?,
        };
        Ok(VectorCells {
            is_world: world.is_some(),
            translation: local.or(world),
            scale: self.group(prefix, ["sx", "sy", "sz"])?,
        })
    }

    /// Refuses columns x y z beside which another three may be those of the quaternion. Where the fields of a pose
    /// are flattened, the position has the names, and the quaternion a number after them.
    fn check_position(&self, prefix: &str) -> Result<(), Diagnostic> {
        const OTHERS: [[&str; 3]; 6] = [
            ["x_1", "y_1", "z_1"],
            ["x.1", "y.1", "z.1"],
            ["x1", "y1", "z1"],
            ["x_2", "y_2", "z_2"],
            ["x2", "y2", "z2"],
            ["qx", "qy", "qz"],
        ];
        let has = |name: &str| self.find(&format!("{prefix}{name}"));
        for [x, y, z] in OTHERS {
            if has("x")?.is_some() && has(x)?.is_some() && has(y)?.is_some() && has(z)?.is_some() {
                let message = format!(
                    "the quaternion may be `{prefix}x` … `{prefix}w` or `{prefix}{x}`, `{prefix}{y}`, `{prefix}{z}` \
                     and `{prefix}w` after a position; if it is the latter, give --map \
                     '{prefix}tx={prefix}x,{prefix}ty={prefix}y,{prefix}tz={prefix}z,{prefix}x={prefix}{x},\
                     {prefix}y={prefix}{y},{prefix}z={prefix}{z}'"
                );
                return Err(self.refuse(Code::ColumnsAmbiguous, message));
            }
        }
        Ok(())
    }
}

/// The prefix of the columns of a position, from that of an orientation, as the fields of ROS' poses and transforms are
/// called: `pose.orientation.x` beside `pose.position.x`.
fn prefix_of_position(of_rotation: &str) -> Option<String> {
    let separator = of_rotation.chars().next_back()?;
    let names = [("orientation", "position"), ("rotation", "translation")];
    names.into_iter().find_map(|(rotation, position)| {
        let before = of_rotation
            .strip_suffix(separator)?
            .strip_suffix(rotation)?;
        Some(format!("{before}{position}{separator}"))
    })
}

/// The columns of the translations and scales of one track.
struct VectorCells {
    translation: Option<[CellSource; 3]>,
    scale: Option<[CellSource; 3]>,
    is_world: bool,
}

impl TablePlan {
    /// Whether a column has numbers of the keys of tracks.
    pub(crate) fn is_of_track(&self, column: usize) -> bool {
        let has = |parts: &Parts| parts.cells().any(|cell| cell.column == column);
        match &self.rows {
            RowLayout::Keys { parts, .. } => has(parts),
            RowLayout::Times { tracks, .. } => tracks.iter().any(|(_, parts)| has(parts)),
        }
    }

    /// The names of data that is not read: columns, and parts of lists.
    pub(crate) fn left_out(&self, table: &Table) -> Option<String> {
        let mut all: Vec<String> = self
            .left_out
            .iter()
            .map(|name| format!("`{name}`"))
            .collect();
        for (column, named) in self.columns.iter().enumerate() {
            let Some(length) = table.list_length(column) else {
                continue;
            };
            let mut is_read = vec![false; length];
            for scalars in self.scalars.iter().filter(|it| it.column == column) {
                let items = scalars.items.clone().unwrap_or(0..length);
                is_read[items.start.min(length)..items.end.min(length)].fill(true);
            }
            for cell in self.cells().filter(|cell| cell.column == column) {
                if let Some(known) = cell.item.and_then(|item| is_read.get_mut(item)) {
                    *known = true;
                }
            }
            let mut first = 0;
            for run in is_read.chunk_by(|a, b| a == b) {
                let end = first + run.len();
                if !run[0] {
                    all.push(format!("`{}[{first}:{end}]`", named.name));
                }
                first = end;
            }
        }
        listed(all)
    }

    /// The locations of the numbers of all tracks.
    fn cells(&self) -> impl Iterator<Item = &CellSource> {
        let parts: Vec<&Parts> = match &self.rows {
            RowLayout::Keys { parts, .. } => vec![parts],
            RowLayout::Times { tracks, .. } => tracks.iter().map(|(_, parts)| parts).collect(),
        };
        parts.into_iter().flat_map(|parts| {
            let vectors = parts.translation.iter().chain(&parts.scale).flatten();
            parts.rotation.all().iter().chain(vectors)
        })
    }

    /// The plan for a file with columns of these names.
    ///
    /// # Errors
    /// When times or rotations are not among them, or when `--map` names a column that does not exist.
    pub(crate) fn of(
        file: &str,
        file_columns: &[String],
        options: &ReadOptions,
    ) -> Result<Self, Diagnostic> {
        let mut seen: HashMap<String, Vec<usize>> = HashMap::new();
        for (index, name) in file_columns.iter().enumerate() {
            seen.entry(name.clone()).or_default().push(index);
        }
        let mut names = ColumnNames {
            file,
            seen,
            file_columns,
            requested: Vec::new(),
            requested_indices: HashMap::new(),
        };
        let mapped = match &options.map {
            Some(map) => rename(&mut names, map)?,
            None => MappedColumns::default(),
        };
        let time_source = time_source(&mut names, options)?;
        let clip = match names.first_of(&CLIP)? {
            Some(clip) => Some((clip, "")),
            None => names
                .take("episode_index", ColumnNeed::Whole)?
                .map(|at| (at, "episode_")),
        };
        let scalars = scalar_columns(&mut names, &mapped)?;
        let rows = if !mapped.tracks.is_empty() {
            mapped_rows(&mut names, &mapped.tracks)?
        } else if names.find("w")?.is_some() || names.find("qw")?.is_some() {
            let (parts, is_world) = names.parts("")?;
            RowLayout::Keys {
                track: names.first_of(&TRACK)?,
                parts: Box::new(parts),
                is_world,
            }
        } else if !scalars.is_empty() && wide_names(&names).is_empty() {
            RowLayout::Times {
                tracks: Vec::new(),
                is_world: false,
            }
        } else {
            wide_rows(&mut names)?
        };
        let is_read: HashSet<usize> = names.requested.iter().map(|it| it.index).collect();
        mapped.check_used(&names, &is_read)?;
        // If there are times, a column of frame numbers adds nothing. A comma at the end of a line makes a column
        // without a name.
        let is_known = |name: &str| name.is_empty() || COUNTED.contains(&name);
        let left_out = (file_columns.iter().enumerate())
            .filter(|(index, name)| !is_read.contains(index) && !is_known(name))
            .map(|(_, name)| name.clone());
        Ok(Self {
            left_out: left_out.collect(),
            columns: names.requested,
            time_source,
            time_unit: options.time_unit,
            clip,
            rows,
            scalars,
            #[cfg(feature = "parquet")]
            notes: Vec::new(),
        })
    }
}

/// The columns that `--map` names.
#[derive(Default)]
struct MappedColumns {
    /// The entries that are rotations, and translations and scales of their tracks.
    tracks: Vec<Entry>,
    /// The entries that are scalars.
    scalars: Vec<Entry>,
    /// The columns that got other names, and the entries of these.
    renamed: Vec<(usize, Entry)>,
}

impl MappedColumns {
    /// Refuses a column that `--map` names if nothing reads it.
    fn check_used(
        &self,
        names: &ColumnNames<'_>,
        is_read: &HashSet<usize>,
    ) -> Result<(), Diagnostic> {
        let mut unused = self.renamed.iter().filter(|(at, _)| !is_read.contains(at));
        let Some((_, Entry { name, source, .. })) = unused.next() else {
            return Ok(());
        };
        let message = format!(
            "`{name}={source}` of --map has no effect, because no track uses it; name its track, such as \
             `knee.{name}={source}`, or leave it out"
        );
        Err(names.refuse(Code::Map, message))
    }
}

/// Renames columns as `--map` specifies.
fn rename(names: &mut ColumnNames<'_>, map: &str) -> Result<MappedColumns, Diagnostic> {
    let parsed: Result<Map, _> = map.parse();
    let map = parsed.map_err(|error| names.refuse(Code::Map, error.to_string()))?;
    let mut mapped = MappedColumns::default();
    for entry in map.entries {
        if entry.scalar.is_some() {
            mapped.scalars.push(entry);
            continue;
        }
        if column_range(names, &entry.source).is_some() {
            mapped.tracks.push(entry);
            continue;
        }
        let index = names.required(&entry.source)?;
        let is_rotation = entry.order.is_some() || entry.form.is_some();
        if entry.columns.is_some() || is_rotation || !is_column(&entry.name) {
            mapped.tracks.push(entry);
            continue;
        }
        if let Some(indices) = names.seen.get_mut(&names.file_columns[index]) {
            indices.retain(|&at| at != index);
        }
        names.seen.insert(entry.name.clone(), vec![index]);
        mapped.renamed.push((index, entry));
    }
    Ok(mapped)
}

/// The scalars that `--map` names, those of columns that are called so, and those of data sets by `LeRobot`.
fn scalar_columns(
    names: &mut ColumnNames<'_>,
    mapped: &MappedColumns,
) -> Result<Vec<ScalarColumn>, Diagnostic> {
    let mut all = Vec::new();
    for entry in &mapped.scalars {
        let index = names.required(&entry.source)?;
        let need = match entry.columns {
            Some(_) => ColumnNeed::List,
            None => ColumnNeed::Number,
        };
        let count = entry.columns.as_ref().map_or(1, Range::len);
        all.push(ScalarColumn {
            column: names.request(index, need),
            items: entry.columns.clone(),
            name: entry.name.clone(),
            names: entry.scalar_names(count).collect(),
            kind: entry.scalar.unwrap_or_default(),
            factor: if entry.is_scalar_in_degrees {
                RADIANS
            } else {
                1.0
            },
        });
    }
    let plain = |column, name: &str, kind| ScalarColumn {
        column,
        items: None,
        name: name.to_owned(),
        names: vec![name.to_owned()],
        kind,
        factor: 1.0,
    };
    let columns = names.file_columns;
    for (index, column) in columns.iter().enumerate() {
        if let Some((name, kind)) = ScalarKind::of_column(column) {
            names.find(column)?;
            all.push(plain(names.request(index, ColumnNeed::Number), name, kind));
        }
    }
    let is_lerobot = ["episode_index", "frame_index", "timestamp"]
        .iter()
        .all(|name| names.position(name).is_some());
    if is_lerobot && mapped.tracks.is_empty() && mapped.scalars.is_empty() {
        for name in LEROBOT {
            if let Some(column) = names.take(name, ColumnNeed::List)? {
                all.push(ScalarColumn {
                    names: Vec::new(),
                    ..plain(column, name, ScalarKind::Angle)
                });
            }
        }
    }
    Ok(all)
}

/// Whether a column may have this name; other names are tracks.
fn is_column(target: &str) -> bool {
    const WHOLE: [&str; 4] = ["time", "timestamp", "t", "frame_index"];
    const NUMBERS: [&str; 17] = [
        "x", "y", "z", "w", "tx", "ty", "tz", "px", "py", "pz", "sx", "sy", "sz", "qx", "qy", "qz",
        "qw",
    ];
    let last = target.rsplit('.').next().unwrap_or(target);
    let tells_apart = TRACK.contains(&target) || CLIP.contains(&target);
    WHOLE.contains(&target) || tells_apart || target == "episode_index" || NUMBERS.contains(&last)
}

/// The source of the times of rows.
fn time_source(
    names: &mut ColumnNames<'_>,
    options: &ReadOptions,
) -> Result<TimeSource, Diagnostic> {
    for name in ["time", "timestamp", "t"] {
        if let Some(time) = names.take(name, ColumnNeed::Time)? {
            return Ok(TimeSource::Times(time));
        }
    }
    let frames = match names.find("frame_index")? {
        Some(frames) => Some(frames),
        None => names.find("frame")?,
    };
    let hint = heading_hint(names.file_columns);
    let message = match (frames, options.source_rate) {
        (Some(frames), Some(rate)) => {
            let column = names.request(frames, ColumnNeed::Whole);
            return Ok(TimeSource::Frames(column, rate));
        }
        (None, Some(rate)) if hint.is_none() => return Ok(TimeSource::Rows(rate)),
        (Some(frames), None) => format!(
            "times are frames, in the column `{}`; give their rate with --source-fps",
            names.file_columns[frames]
        ),
        (None, _) => format!(
            "no column is `time`, `timestamp`, `t` or `frame_index`; there are {}; {}",
            names.list(),
            hint.unwrap_or(
                "name the time column with --map time=NAME, or give --source-fps FPS if each row is a frame"
            )
        ),
    };
    Err(names.refuse(Code::NoTimes, message))
}

/// The hint about a heading that has no names in columns of its format, where no `--map` helps; `None` for other
/// headings.
fn heading_hint(columns: &[String]) -> Option<&'static str> {
    let [first, ..] = columns else {
        return None;
    };
    if columns.len() == 1 && first.contains([';', '\t']) {
        return Some(
            "columns must be separated by commas, and numbers must have decimal points: export the table again in this \
             way",
        );
    }
    // A comma at the end of a line makes an empty cell.
    let is_number = |name: &String| name.trim().is_empty() || name.trim().parse::<f64>().is_ok();
    let is_comment = columns.len() == 1 && first.starts_with('#');
    if !is_comment && !columns.iter().all(is_number) {
        return None;
    }
    let is_nanoseconds = |text: &str| text.len() > 17 && text.bytes().all(|it| it.is_ascii_digit());
    Some(match columns.len() >= 8 && is_nanoseconds(first.trim()) {
        true => {
            "begin the file with the names of the columns; if they are timestamp,x,y,z,qw,qx,qy,qz, as EuRoC and \
             VINS-Mono write them, give --from euroc"
        }
        false => {
            "begin the file with the names of the columns, such as time,x,y,z,w, or x,y,z,qx,qy,qz,qw for rows of \
             frames (--source-fps)"
        }
    })
}

/// Tracks in columns: `knee.x`, `knee.y`, `knee.z`, `knee.w`.
fn wide_rows(names: &mut ColumnNames<'_>) -> Result<RowLayout, Diagnostic> {
    let tracks = wide_names(names);
    if tracks.is_empty() {
        let message = format!(
            "no columns are rotations: x y z w, or knee.x knee.y knee.z knee.w; there are {}; \
             {}",
            names.list(),
            angles_hint(names).unwrap_or_else(|| {
                "--map hand=LIST[3:7] selects a part of a list, hand=rx..rz:rotvec a range of columns, \
                 knee=COLUMN:scalar:angle the angle of a joint, grip=COLUMN:scalar another number"
                    .to_owned()
            })
        );
        return Err(names.refuse(Code::NoRotations, message));
    }
    let mut layout = Vec::with_capacity(tracks.len());
    let mut is_world = false;
    for track in tracks {
        let (parts, world) = names.parts(&format!("{track}."))?;
        is_world |= world;
        layout.push((track, parts));
    }
    Ok(RowLayout::Times {
        tracks: layout,
        is_world,
    })
}

/// The tracks that have columns of quaternions with their name, in the order of their columns.
fn wide_names(names: &ColumnNames<'_>) -> Vec<String> {
    let mut prefixes: Vec<(String, usize)> = names
        .seen
        .iter()
        .filter_map(|(name, at)| {
            let track = name.strip_suffix(".w").or(name.strip_suffix(".qw"))?;
            Some((track.to_owned(), *at.first()?))
        })
        .collect();
    prefixes.sort_by_key(|&(_, index)| index);
    let mut known = HashSet::new();
    prefixes.retain(|(track, _)| known.insert(track.clone()));
    prefixes.into_iter().map(|(track, _)| track).collect()
}

/// The `--map` for columns that are called roll, pitch and yaw.
fn angles_hint(names: &ColumnNames<'_>) -> Option<String> {
    const ANGLES: [&str; 3] = ["roll", "pitch", "yaw"];
    let columns = names.file_columns.windows(3).find(|columns| {
        let mut pairs = columns.iter().zip(ANGLES);
        pairs.all(|(column, angle)| column.to_lowercase().contains(angle))
    })?;
    let position = ["x", "y", "z"].map(|name| names.position(name).map(|_| name));
    let moved = match position {
        [Some(_), Some(_), Some(_)] => "tx=x,ty=y,tz=z,",
        _ => "",
    };
    Some(format!(
        "give --map '{moved}body={}..{}:xyz:deg' if they are in degrees, without `:deg` if in radians",
        columns[0], columns[2]
    ))
}

/// The tracks whose rotations `--map` names, with the translations and scales that belong to them: entries
/// `hand.translation` and `hand.scale`, and columns such as `hand.tx`, belong to the track `hand`. A column `tx`
/// belongs to the only track.
fn mapped_rows(names: &mut ColumnNames<'_>, entries: &[Entry]) -> Result<RowLayout, Diagnostic> {
    const VECTORS: [&str; 2] = [".translation", ".scale"];
    let vector_of = |target: &str| {
        let ending = VECTORS.iter().position(|ending| target.ends_with(ending));
        ending.map(|at| (target[..target.len() - VECTORS[at].len()].to_owned(), at))
    };
    let mut tracks: Vec<(String, Parts)> = Vec::new();
    let mut track_of: HashMap<&str, usize> = HashMap::new();
    let mut is_world = false;
    for entry in entries
        .iter()
        .filter(|entry| vector_of(&entry.name).is_none())
    {
        let form = entry.form();
        let cells = cells(names, entry, form.width())?;
        let rotation = match (form, &*cells) {
            (RotationForm::Quaternion(ComponentOrder::Xyzw), &[x, y, z, w])
            | (RotationForm::Quaternion(ComponentOrder::Wxyz), &[w, x, y, z]) => {
                RotationCells::Quaternion([x, y, z, w])
            }
            _ => RotationCells::Other(form, cells),
        };
        let vectors = names.vectors(&format!("{}.", entry.name))?;
        is_world |= vectors.is_world;
        let parts = Parts {
            rotation,
            translation: vectors.translation,
            scale: vectors.scale,
        };
        track_of.insert(&entry.name, tracks.len());
        tracks.push((entry.name.clone(), parts));
    }
    for entry in entries {
        let Some((track, vector)) = vector_of(&entry.name) else {
            continue;
        };
        let cells = cells(names, entry, 3)?;
        let cells = [cells[0], cells[1], cells[2]];
        let Some(&index) = track_of.get(&*track) else {
            let message = format!(
                "`{}` has no rotations; --map {track}=LIST[3:7] gives the track `{track}` some",
                entry.name
            );
            return Err(names.refuse(Code::NoRotations, message));
        };
        let parts = &mut tracks[index].1;
        match vector {
            0 => parts.translation = Some(cells),
            _ => parts.scale = Some(cells),
        }
    }
    if let [(_, only)] = &mut *tracks {
        let vectors = names.vectors("")?;
        is_world |= vectors.is_world && only.translation.is_none();
        only.translation = only.translation.or(vectors.translation);
        only.scale = only.scale.or(vectors.scale);
    }
    let is_range = |entry: &Entry| column_range(names, &entry.source).is_some();
    if let [_] = &*tracks
        && entries.iter().all(is_range)
        && let Some(track) = names.first_of(&TRACK)?
        && let Some((_, parts)) = tracks.pop()
    {
        return Ok(RowLayout::Keys {
            track: Some(track),
            parts: Box::new(parts),
            is_world,
        });
    }
    for track in wide_names(names) {
        if track_of.contains_key(&*track) {
            let message =
                format!("--map and the columns `{track}.w` both say the rotations of `{track}`");
            return Err(names.refuse(Code::ColumnTwice, message));
        }
        let (parts, world) = names.parts(&format!("{track}."))?;
        is_world |= world;
        tracks.push((track, parts));
    }
    Ok(RowLayout::Times { tracks, is_world })
}

/// The columns from one name to another, `first..last`, unless a column has this name.
fn column_range(names: &ColumnNames<'_>, source: &str) -> Option<Range<usize>> {
    let index = |column: &str| names.position(column.trim());
    if index(source).is_some() {
        return None;
    }
    let (first, last) = source.split_once("..")?;
    Some(index(first)?..index(last)? + 1)
}

/// The cells of the numbers that an entry takes: the first ones of a list, a part of it, or neighbouring columns.
fn cells(
    names: &mut ColumnNames<'_>,
    entry: &Entry,
    count: usize,
) -> Result<Vec<CellSource>, Diagnostic> {
    if let Some(columns) = column_range(names, &entry.source) {
        if columns.len() != count {
            let message = format!(
                "`{}` is {} columns; `{}` needs {count}, neighbours in this order",
                entry.source,
                columns.len(),
                entry.name
            );
            return Err(names.refuse(Code::ListLength, message));
        }
        let cell = |index| CellSource {
            column: names.request(index, ColumnNeed::Number),
            item: None,
            whole: None,
        };
        return Ok(columns.map(cell).collect());
    }
    let range = entry.columns.clone().unwrap_or(0..count);
    if range.len() != count {
        let message = format!(
            "`{}` takes {} numbers of `{}`; it needs {count}, such as [{}:{}]",
            entry.name,
            range.len(),
            entry.source,
            range.start,
            range.start.saturating_add(count)
        );
        return Err(names.refuse(Code::ListLength, message));
    }
    let index = names.position(&entry.source);
    let column = names.request(index.unwrap_or_default(), ColumnNeed::List);
    let cell = |item| CellSource {
        column,
        item: Some(item),
        whole: entry.columns.is_none().then_some(count),
    };
    Ok(range.map(cell).collect())
}
