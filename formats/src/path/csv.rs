//! Paths in CSV: `[t,]x,y,z[,ux,uy,uz]`.

use glam::DVec3;

use crate::diagnostic::{Code, Diagnostic, Location};
use crate::path::{PathFormat, PathPoints};
use crate::text::lines::refuse_lone_returns;
use crate::text::number;

/// The CSV format of paths: points as text.
pub static FORMAT: PathFormat = PathFormat {
    name: "csv",
    summary: "one point per row, with the columns `t,x,y,z,ux,uy,uz`; the time `t` and the upward direction \
              `ux,uy,uz` are optional, and upward directions may be blank",
    probe: |_| false,
    is_of_paths,
    read_bytes: |file, bytes| Ok(vec![read_text(file, bytes)?]),
};

/// Names of the columns; those of the time and of the upward directions may be missing.
const NAMES: [&str; 7] = ["t", "x", "y", "z", "ux", "uy", "uz"];

/// Whether the first line names the columns of points.
fn is_of_paths(start: &[u8]) -> bool {
    let line = start.split(|byte| matches!(byte, b'\n' | b'\r')).next();
    let line = String::from_utf8_lossy(line.unwrap_or_default()).to_lowercase();
    let names = line.trim_start_matches('\u{feff}').split(',');
    let names: Vec<&str> = names.map(str::trim).collect();
    let has_all = ["x", "y", "z"].iter().all(|name| names.contains(name));
    let is_known = |name: &&str| NAMES.contains(name) || *name == "time";
    has_all && names.iter().all(is_known)
}

fn read_text(file: &str, bytes: &[u8]) -> Result<PathPoints, Diagnostic> {
    let refuse = |line: u64, code, message: String| {
        let mut fault = Diagnostic::new(file, code, message);
        fault.location = Some(Location::Text { line, column: 1 });
        fault
    };
    refuse_lone_returns(file, bytes, Some(b'"'))?;
    let text = std::str::from_utf8(bytes)
        .map_err(|_| Diagnostic::new(file, Code::Encoding, "this is not UTF-8; save it as text"))?;
    let text = text.trim_start_matches('\u{feff}');
    let mut reader = ::csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(::csv::Trim::All)
        .from_reader(text.as_bytes());
    let mut record = ::csv::StringRecord::new();
    let mut next = |record: &mut ::csv::StringRecord| {
        let read = reader.read_record(record);
        read.map_err(|error| Diagnostic::new(file, Code::Path, error.to_string()))
    };
    if !next(&mut record)? {
        return Err(Diagnostic::new(
            file,
            Code::Empty,
            "the file is empty; it begins with `t,x,y,z`",
        ));
    }
    let names: Vec<String> = record.iter().map(str::to_lowercase).collect();
    let column = |name: &str| {
        names
            .iter()
            .position(|known| known == name || name == "t" && known == "time")
    };
    let columns = NAMES.map(column);
    let known = columns.iter().flatten().count();
    let has = |range: std::ops::Range<usize>| columns[range].iter().flatten().count();
    if has(1..4) < 3 || !matches!(has(4..7), 0 | 3) || known != names.len() {
        let message = format!(
            "the header is `{}`; a path has the columns t,x,y,z,ux,uy,uz; t, and ux,uy,uz together, may be missing",
            names.join(",")
        );
        return Err(refuse(1, Code::Path, message));
    }
    let mut path = PathPoints::default();
    while next(&mut record)? {
        let line = record.position().map_or(0, ::csv::Position::line);
        if record.len() != names.len() {
            let message = format!(
                "{} cells where the header has {}",
                record.len(),
                names.len()
            );
            return Err(refuse(line, Code::Columns, message));
        }
        let number = |field: usize| -> Result<f64, Diagnostic> {
            let cell = columns[field]
                .and_then(|column| record.get(column))
                .unwrap_or_default();
            let read = number::parse(cell);
            read.map(|parsed| parsed.value)
                .map_err(|(code, message)| refuse(line, code, message))
        };
        if columns[0].is_some() {
            let time = number(0)?;
            if let Some(&before) = path.times.last()
                && time <= before
            {
                let message = format!("the time {time} is not after {before}");
                return Err(refuse(line, Code::TimeNotIncreasing, message));
            }
            path.times.push(time);
        }
        let vector = |from: usize| -> Result<DVec3, Diagnostic> {
            Ok(DVec3::new(
                number(from)?,
                number(from + 1)?,
                number(from + 2)?,
            ))
        };
        path.points.push(vector(1)?);
        let is_blank = |column: &Option<usize>| {
            column
                .and_then(|column| record.get(column))
                .is_none_or(str::is_empty)
        };
        let up = match columns[4..7].iter().all(is_blank) {
            true => None,
            false => Some(vector(4)?.as_vec3()),
        };
        if up.is_some_and(|up| up.as_dvec3().length() == 0.0) {
            let message = "the upward direction has no length; leave its cells blank".to_owned();
            return Err(refuse(line, Code::Path, message));
        }
        path.ups.push(up);
    }
    if path.points.is_empty() {
        return Err(refuse(
            1,
            Code::NoKeys,
            "there is no point after the header".to_owned(),
        ));
    }
    Ok(path)
}
