//! Lists of pairs, and of walkers.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use glam::DVec3;
use serde::Deserialize;
use tumble_formats::beneath::open_beneath;
use tumble_formats::{Code, Diagnostic, Location};
use tumble_routes::walkers::Mover;

use crate::commands::route::surface::MAX_BYTES;
use crate::messages::exit::Failure;

/// The start and the goal of each route.
pub(crate) struct Participants {
    pub(super) pairs: Vec<[DVec3; 2]>,
    /// Their names in messages and files.
    pub(super) names: Vec<String>,
    /// The speed and the start time of each walker, if routes depend on time.
    pub(super) paces: Option<Vec<WalkingPace>>,
    /// Moving obstacles, each on its track.
    pub(super) movers: Vec<Mover>,
    /// Whether there is one route, for one file.
    pub(super) is_single: bool,
}

pub(super) struct WalkingPace {
    pub(super) radius: f64,
    pub(super) speed: f64,
    pub(super) start: f64,
}

impl Participants {
    pub(super) fn of_pair(pair: [DVec3; 2]) -> Self {
        Self {
            pairs: vec![pair],
            names: vec!["route".to_owned()],
            paces: None,
            movers: Vec::new(),
            is_single: true,
        }
    }
}

fn whole(path: &Path, code: Code, message: &str) -> Failure {
    let fault = Diagnostic::new(path.display().to_string(), code, message);
    Failure::input(&fault, "")
}

fn refuse(path: &Path, line: u64, code: Code, message: &str) -> Failure {
    let mut fault = Diagnostic::new(path.display().to_string(), code, message);
    fault.location = Some(Location::Text { line, column: 1 });
    Failure::input(&fault, "")
}

fn text(path: &Path, bytes: Vec<u8>) -> Result<String, Failure> {
    let text = String::from_utf8(bytes);
    text.map_err(|_| whole(path, Code::Encoding, "is not UTF-8 text; save it as UTF-8"))
}

/// All bytes of a file; pipes are refused, because they may be endless.
fn bytes(path: &Path) -> Result<Vec<u8>, Failure> {
    let open = || match std::fs::metadata(path)?.is_file() {
        true => File::open(path),
        false => Err(io::Error::other("is not a regular file")),
    };
    read(path, open())
}

/// All bytes of a file that a file in `folder` names.
fn bytes_beneath(folder: &Path, name: &Path) -> Result<Vec<u8>, Failure> {
    read(name, open_beneath(folder, name))
}

fn read(path: &Path, file: io::Result<File>) -> Result<Vec<u8>, Failure> {
    let refused = |code, message: String| {
        let fault = Diagnostic::new(path.display().to_string(), code, message);
        Failure::input(&fault, "")
    };
    let refuse = |error: io::Error| refused(Code::Open, format!("cannot be read: {error}"));
    let mut bytes = Vec::new();
    let file = file.map_err(refuse)?;
    file.take(MAX_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(refuse)?;
    match bytes.len() as u64 <= MAX_BYTES {
        true => Ok(bytes),
        false => {
            let message = "is longer than 4 GiB; split it";
            Err(refused(Code::FileTooLong, message.to_owned()))
        }
    }
}

/// Six numbers a line; lines with `#` in front and empty ones are skipped.
pub(super) fn read_pairs(path: &Path) -> Result<Participants, Failure> {
    let mut pairs = Vec::new();
    for (number, line) in (1..).zip(text(path, bytes(path)?)?.lines()) {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let parts = line.split(|c: char| c == ',' || c.is_whitespace());
        let numbers: Result<Vec<f64>, _> = parts
            .filter(|part| !part.is_empty())
            .map(str::parse)
            .collect();
        match numbers.as_deref() {
            Ok(&[a, b, c, d, e, f]) => pairs.push([DVec3::new(a, b, c), DVec3::new(d, e, f)]),
            _ => {
                let message = format!(
                    "invalid pair `{line}`: expected x y z of the start, then x y z of the goal"
                );
                return Err(refuse(path, number, Code::Pairs, &message));
            }
        }
    }
    if pairs.is_empty() {
        return Err(whole(path, Code::Pairs, "has no pairs"));
    }
    let digits = pairs.len().to_string().len();
    Ok(Participants {
        names: (1..=pairs.len())
            .map(|number| format!("route-{number:0digits$}"))
            .collect(),
        pairs,
        paces: None,
        movers: Vec::new(),
        is_single: false,
    })
}

/// A row of a file of walkers.
#[derive(Deserialize)]
struct WalkerRow {
    name: Option<String>,
    radius: f64,
    speed: Option<f64>,
    start: Option<f64>,
    x: Option<f64>,
    y: Option<f64>,
    z: Option<f64>,
    to_x: Option<f64>,
    to_y: Option<f64>,
    to_z: Option<f64>,
    track: Option<String>,
}

/// A row of a track.
#[derive(Deserialize)]
struct TrackRow {
    t: f64,
    x: f64,
    y: f64,
    z: f64,
}

fn rows<T: for<'de> Deserialize<'de>>(
    path: &Path,
    bytes: Vec<u8>,
) -> Result<Vec<(u64, T)>, Failure> {
    let text = text(path, bytes)?;
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_reader(text.as_bytes());
    let unreadable = |error: csv::Error| {
        let line = error.position().map_or(1, csv::Position::line);
        refuse(
            path,
            line,
            Code::Walkers,
            &format!("cannot be read: {error}"),
        )
    };
    let headers = reader.headers().map_err(unreadable)?.clone();
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(unreadable)?;
        let line = record.position().map_or(1, csv::Position::line);
        rows.push((
            line,
            record.deserialize(Some(&headers)).map_err(unreadable)?,
        ));
    }
    Ok(rows)
}

pub(super) fn read_walkers(path: &Path) -> Result<Participants, Failure> {
    let mut participants = Participants {
        pairs: Vec::new(),
        names: Vec::new(),
        paces: Some(Vec::new()),
        movers: Vec::new(),
        is_single: false,
    };
    for (line, row) in rows::<WalkerRow>(path, bytes(path)?)? {
        if let Some(track) = row.track.filter(|track| !track.is_empty()) {
            if !(row.radius >= 0.0 && row.radius.is_finite()) {
                let message = "a radius is a number of 0 or more";
                return Err(refuse(path, line, Code::Walkers, message));
            }
            let folder = path.parent().unwrap_or(Path::new(""));
            let file = folder.join(&track);
            let bytes = bytes_beneath(folder, Path::new(&track))
                .map_err(|failure| refuse(path, line, Code::Walkers, failure.message()))?;
            participants.movers.push(Mover {
                track: read_track(&file, bytes)?,
                radius: row.radius,
            });
            continue;
        }
        let all = [row.x, row.y, row.z, row.to_x, row.to_y, row.to_z, row.speed];
        let [
            Some(x),
            Some(y),
            Some(z),
            Some(to_x),
            Some(to_y),
            Some(to_z),
            Some(speed),
        ] = all
        else {
            let message =
                "a walker needs speed, x, y, z, to_x, to_y and to_z; a moving obstacle needs track";
            return Err(refuse(path, line, Code::Walkers, message));
        };
        participants
            .pairs
            .push([DVec3::new(x, y, z), DVec3::new(to_x, to_y, to_z)]);
        let name = row.name.filter(|name| !name.is_empty());
        let name = name.unwrap_or_else(|| format!("walker-{}", participants.pairs.len()));
        let is_plain = |c: char| c.is_alphanumeric() || matches!(c, '-' | '_' | '.' | ' ');
        if !name.chars().all(is_plain)
            || name.starts_with('.')
            || participants.names.contains(&name)
        {
            let message =
                format!("`{name}` cannot name a file: give each walker a different, plain name");
            return Err(refuse(path, line, Code::Walkers, &message));
        }
        participants.names.push(name);
        let pace = WalkingPace {
            radius: row.radius,
            speed,
            start: row.start.unwrap_or(0.0),
        };
        participants.paces.get_or_insert_default().push(pace);
    }
    match participants.pairs.is_empty() {
        true => Err(whole(path, Code::Walkers, "has no walkers")),
        false => Ok(participants),
    }
}

/// Times and positions: `t,x,y,z`, times increasing.
fn read_track(path: &Path, bytes: Vec<u8>) -> Result<Vec<(f64, DVec3)>, Failure> {
    let mut track: Vec<(f64, DVec3)> = Vec::new();
    for (line, row) in rows::<TrackRow>(path, bytes)? {
        let position = DVec3::new(row.x, row.y, row.z);
        if !(position.is_finite() && row.t.is_finite()) {
            let message = "times and positions must be finite numbers";
            return Err(refuse(path, line, Code::Walkers, message));
        }
        if track.last().is_some_and(|last| last.0 >= row.t) {
            return Err(refuse(
                path,
                line,
                Code::Walkers,
                &format!("times must increase, and {} does not", row.t),
            ));
        }
        track.push((row.t, position));
    }
    match track.is_empty() {
        true => Err(whole(path, Code::Walkers, "has no positions")),
        false => Ok(track),
    }
}
