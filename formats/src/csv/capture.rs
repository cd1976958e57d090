//! Tables of motion capture systems, whose columns are named by several rows: `OptiTrack` Motive and Vicon (Nexus,
//! Tracker). From these rows follow the names that other tables have: `drone.x` to `drone.w` for a rotation, `drone.px`
//! to `drone.pz` for a position in the world.

use ::csv::ByteRecord;
use glam::DVec3;
use tumble::FrameRate;

use crate::diagnostic::{Code, Diagnostic};
use crate::format::Space;

/// The heading of a table of a motion-capture program.
pub(super) struct CaptureHeading {
    /// The name of each column.
    pub(super) names: Vec<String>,
    /// The rate of frames that are counted; `None` if each row has its time.
    pub(super) rate: Option<FrameRate>,
    /// The unit that the file states, and the up axis that its program has by default.
    pub(super) space: Space,
}

/// The most rows above the numbers.
const MAX_ROWS: usize = 16;

/// The most columns that one name stands above: a rotation and a position.
const NAMED_COLUMNS: usize = 7;

type Row = Vec<String>;

/// The trimmed cells of a row.
fn cells(record: &ByteRecord) -> Row {
    let cells = record.iter().map(<[u8]>::trim_ascii);
    cells
        .map(|cell| String::from_utf8_lossy(cell).into_owned())
        .collect()
}

/// Whether none of these cells is a number, as in rows of names and units.
pub(super) fn has_no_number(record: &ByteRecord) -> bool {
    let is_number =
        |cell: &[u8]| std::str::from_utf8(cell).is_ok_and(|it| it.parse::<f64>().is_ok());
    !record.iter().map(<[u8]>::trim_ascii).any(is_number)
}

/// The cell of a row; empty after its end.
fn at(row: &[String], column: usize) -> &str {
    row.get(column).map_or("", String::as_str)
}

impl CaptureHeading {
    /// Reads the rows above the numbers, if the first row of a table is one of these programs'. `next` reads a row.
    ///
    /// # Errors
    /// When the table has no rotations that can be read.
    pub(super) fn read(
        file: &str,
        first: &ByteRecord,
        mut next: impl FnMut() -> Result<Option<ByteRecord>, Diagnostic>,
    ) -> Result<Option<Self>, Diagnostic> {
        const TABLES: [&str; 5] = [
            "Objects",
            "Segments",
            "Joints",
            "Model Outputs",
            "Trajectories",
        ];
        let first = cells(first);
        let is_alone = first.iter().skip(1).all(String::is_empty);
        let is_motive = at(&first, 0) == "Format Version";
        let is_vicon = is_alone && TABLES.contains(&at(&first, 0));
        if !(is_motive || is_vicon) {
            return Ok(None);
        }
        let mut rows = vec![first];
        loop {
            let row = match next()? {
                Some(record) if rows.len() < MAX_ROWS => cells(&record),
                _ => {
                    let program = if is_motive { "Motive" } else { "Vicon" };
                    let message = format!(
                        "the file begins as a table of {program}, but no row begins with `Frame`, so the names of the \
                         columns are missing; export it again"
                    );
                    return Err(Diagnostic::new(file, Code::NoTimes, message));
                }
            };
            let is_last = at(&row, 0) == "Frame";
            rows.push(row);
            if is_last {
                break;
            }
        }
        let refused = |message: String| Diagnostic::new(file, Code::NoRotations, message);
        match is_motive {
            true => motive(&rows).map(Some).map_err(refused),
            false => {
                let units = next()?.map(|record| cells(&record)).unwrap_or_default();
                vicon(&rows, &units).map(Some).map_err(refused)
            }
        }
    }
}

/// `Format Version,1.23,Take Name,…`, then rows that are labelled in their second cell, then what each number is, then
/// the axes.
fn motive(rows: &[Row]) -> Result<CaptureHeading, String> {
    let (Some(take), Some(axes)) = (rows.first(), rows.last()) else {
        return Err("it has no rows".to_owned());
    };
    let field = |label: &str| {
        let label = take.iter().position(|cell| cell == label);
        label.map_or("", |label| at(take, label + 1))
    };
    let above = &rows[1..rows.len() - 1];
    let labelled = |label: &str| {
        let row = above.iter().find(|row| at(row, 1) == label);
        row.map_or(&[][..], Vec::as_slice)
    };
    let is_kinds = |row: &&Row| {
        row.iter()
            .any(|cell| cell == "Rotation" || cell == "Position")
    };
    let kinds = above.iter().rev().find(is_kinds);
    let kinds = kinds.map_or(&[][..], Vec::as_slice);
    let (types, bodies) = (labelled("Type"), labelled("Name"));
    let turning = field("Rotation Type");
    if !matches!(turning, "" | "Quaternion") && kinds.iter().any(|kind| kind == "Rotation") {
        return Err(format!(
            "the rotations of this table of Motive are Euler angles (Rotation Type {turning}): export the take again \
             with the rotation type Quaternion"
        ));
    }
    let name = |column: usize| {
        let (body, kind, axis) = (at(bodies, column), at(kinds, column), at(axes, column));
        let is_body = matches!(at(types, column), "" | "Rigid Body" | "Bone");
        match (column, kind, axis) {
            (0, ..) => "frame".to_owned(),
            (1, ..) => "time".to_owned(),
            (_, "Rotation", "X" | "Y" | "Z" | "W") if is_body => {
                format!("{body}.{}", axis.to_lowercase())
            }
            (_, "Position", "X" | "Y" | "Z") if is_body => {
                format!("{body}.p{}", axis.to_lowercase())
            }
            (_, "", "") => body.to_owned(),
            (_, kind, "") => format!("{body}.{kind}"),
            (_, kind, axis) => format!("{body}.{kind} {axis}"),
        }
    };
    let names: Vec<String> = (0..axes.len().max(kinds.len())).map(name).collect();
    if !names.iter().any(|name| name.ends_with(".w")) {
        return Err(
            "this table of Motive has no rotations, perhaps only markers: export the take again with rigid bodies or \
             bones"
                .to_owned(),
        );
    }
    let metres = match field("Length Units") {
        "Millimeters" => 0.001,
        "Centimeters" => 0.01,
        "Inches" => 0.0254,
        "Feet" => 0.3048,
        _ => 1.0,
    };
    Ok(CaptureHeading {
        names,
        rate: None,
        space: Space {
            up: DVec3::Y,
            metres,
        },
    })
}

/// The kind of table, the rate, the names of bodies, each above the first of its columns, the names of columns; then
/// the units.
fn vicon(rows: &[Row], units: &[String]) -> Result<CaptureHeading, String> {
    let [table, rate, .., bodies, columns] = rows else {
        return Err(
            "the row with the names of bodies, above the names of the columns, is missing"
                .to_owned(),
        );
    };
    let rate_text = at(rate, 0);
    let rate: FrameRate = rate_text.parse().map_err(|_| {
        format!("`{rate_text}`, in the second line of a table of Vicon, is not a frame rate")
    })?;
    let body = |column: usize| {
        let first = column.saturating_sub(NAMED_COLUMNS - 1);
        let mut near = (first..=column).rev().map(|column| at(bodies, column));
        near.find(|name| !name.is_empty()).unwrap_or_default()
    };
    let name = |column: usize| {
        let (body, number) = (body(column), at(columns, column));
        match (column, number) {
            (0, _) => "frame_index".to_owned(),
            (1, _) => "index".to_owned(),
            (_, "RX" | "RY" | "RZ" | "RW") => format!("{body}.{}", number[1..].to_lowercase()),
            (_, "TX" | "TY" | "TZ") => format!("{body}.p{}", number[1..].to_lowercase()),
            (_, "") => String::new(),
            (_, number) => format!("{body}.{number}"),
        }
    };
    let has = |number: &str| columns.iter().any(|column| column == number);
    if !has("RW") {
        let table = at(table, 0);
        return Err(match has("RX") {
            true => format!(
                "the rotations of this table of Vicon ({table}) are three angles, RX RY RZ: export it again with \
                 quaternions, RX RY RZ RW"
            ),
            false => format!(
                "this table of Vicon ({table}) has no rotations: export objects or segments, with quaternions"
            ),
        });
    }
    let position = columns.iter().position(|column| column == "TX");
    let metres = match position.map_or("", |column| at(units, column)) {
        "m" => 1.0,
        "cm" => 0.01,
        _ => 0.001,
    };
    Ok(CaptureHeading {
        names: (0..columns.len()).map(name).collect(),
        rate: Some(rate),
        space: Space {
            up: DVec3::Z,
            metres,
        },
    })
}
