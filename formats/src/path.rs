//! Paths that bodies follow, and their file formats. To add a format, write a module with a `FORMAT`, and add it to
//! the table [`PATHS`].

pub mod csv;
pub mod npy;

use std::io::Read;
use std::path::Path;

use glam::{DVec3, Vec3};
use tumble::TrackSet;

use crate::PATHS;
use crate::diagnostic::{Code, Diagnostic};
use crate::format::ReadOptions;
use crate::motion::Motion;
use crate::motion::origin::origin_of;
use crate::source::Source;

/// A file format of paths.
pub struct PathFormat {
    /// Name of the format in options and messages, which is also the extension of its files.
    pub name: &'static str,
    /// A short description of the contents that are read.
    pub summary: &'static str,
    /// Whether a file that begins with these bytes is in this format; it need not contain paths.
    pub probe: fn(&[u8]) -> bool,
    /// Whether a file of this format that begins with these bytes contains paths.
    pub is_of_paths: fn(&[u8]) -> bool,
    /// Reads the paths of the bytes of a file; the text is the input's name in messages.
    pub read_bytes: fn(&str, &[u8]) -> Result<Vec<PathPoints>, Diagnostic>,
}

impl PathFormat {
    /// The format of a file that begins with these bytes; the first of [`PATHS`] if no format recognises them.
    #[must_use]
    pub fn detect(start: &[u8]) -> &'static Self {
        let mut all = PATHS.iter().copied();
        all.find(|format| (format.probe)(start)).unwrap_or(PATHS[0])
    }
}

impl std::fmt::Debug for PathFormat {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("PathFormat").field(&self.name).finish()
    }
}

/// The speed or the duration of paths whose file contains no times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pace {
    /// The time from the first point to the last, in seconds. The time of each point is proportional to its distance
    /// from the first point along the straight lines between points.
    Seconds(f64),
    /// The distance along these lines in a second.
    Rate(f64),
}

/// The points of one path.
#[derive(Debug, Clone, Default)]
pub struct PathPoints {
    /// The times of the points in seconds, increasing; empty if there are none.
    pub times: Vec<f64>,
    /// The points.
    pub points: Vec<DVec3>,
    /// Upward directions, one for each point; empty if there are none.
    pub ups: Vec<Option<Vec3>>,
}

/// Reads the paths of a file as a clip with one track for each; `-` is standard input. A single track is named
/// `name`, and several are named `name` with their index. All tracks have the same [origin](Motion::origins), if any,
/// so that one can be the target of another.
///
/// # Errors
/// When the file cannot be opened or is invalid; the first error is returned.
pub fn open_paths(
    path: &Path,
    name: &str,
    pace: Option<Pace>,
    options: &ReadOptions,
) -> Result<Motion, Diagnostic> {
    let source = Source::open(path, options.pipes)?;
    let file = source.name.clone();
    read_paths(&file, name, &source.into_bytes(options.limits.file)?, pace)
}

/// Whether a file seems to contain paths; `false` if it cannot be read.
#[must_use]
pub fn looks_like_paths(path: &Path) -> bool {
    let mut start = Vec::new();
    if !path.is_file() {
        return false; // a pipe would lose its first bytes
    }
    let read =
        std::fs::File::open(path).and_then(|file| file.take(MAX_HEADER).read_to_end(&mut start));
    read.is_ok() && (PathFormat::detect(&start).is_of_paths)(&start)
}

/// Number of first bytes that are read: more than the header of an array or the first line of a table needs.
const MAX_HEADER: u64 = 4096;

/// Reads the paths of the bytes of a file as [`open_paths`] does. `file` is the input's name in messages, and `name`
/// is the name of tracks.
///
/// # Errors
/// When the input is invalid; the first error is returned.
pub fn read_paths(
    file: &str,
    name: &str,
    bytes: &[u8],
    pace: Option<Pace>,
) -> Result<Motion, Diagnostic> {
    let paths = (PathFormat::detect(bytes).read_bytes)(file, bytes)?;
    paths_of(file, name, paths, pace)
}

/// Makes a clip of paths, with one track for each, as [`open_paths`] does.
///
/// # Errors
/// When a path has neither times nor a pace, when it has both, or when its points are not valid keys.
pub fn paths_of(
    file: &str,
    name: &str,
    paths: Vec<PathPoints>,
    pace: Option<Pace>,
) -> Result<Motion, Diagnostic> {
    let mut set = TrackSet::new();
    let several = paths.len() > 1;
    let origin = origin_of(paths.iter().flat_map(|path| path.points.iter().copied()));
    for (index, mut path) in paths.into_iter().enumerate() {
        path.set_times(file, pace)?;
        let points = path.points.iter().map(|&point| (point - origin).as_vec3());
        let points: Vec<Vec3> = points.collect();
        let track_name = if several {
            format!("{name}{index}")
        } else {
            name.to_owned()
        };
        let pushed = set.push_path(&track_name, &path.times, &points, &path.ups);
        pushed.map_err(|error| Diagnostic::new(file, Code::Path, error.to_string()))?;
    }
    let mut paths = Motion {
        set,
        ..Motion::default()
    };
    for track in 0..paths.set.track_count() {
        paths.set_origin(track, origin);
    }
    Ok(paths)
}

impl PathPoints {
    /// Computes times for points without times. Points that repeat the one before are removed.
    fn set_times(&mut self, file: &str, pace: Option<Pace>) -> Result<(), Diagnostic> {
        let refuse = |message: &str| Err(Diagnostic::new(file, Code::PathTimes, message));
        let has_times = !self.times.is_empty();
        let Some(pace) = pace else {
            return match has_times {
                true => Ok(()),
                false => refuse("the path has no times; give --seconds or --pace"),
            };
        };
        if has_times {
            return refuse("the path has times of its own; leave out --seconds and --pace");
        }
        let input = std::mem::take(self);
        let mut length = 0.0;
        for (i, &point) in input.points.iter().enumerate() {
            if let Some(before) = self.points.last() {
                let step = (point - before).length();
                if length + step <= length {
                    continue;
                }
                length += step;
            }
            self.times.push(length);
            self.points.push(point);
            if !input.ups.is_empty() {
                self.ups.push(input.ups[i]);
            }
        }
        let second = match pace {
            Pace::Seconds(seconds) => length / seconds,
            Pace::Rate(rate) => rate,
        };
        for time in self.times.iter_mut().skip(1) {
            *time /= second;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tumble::Channel;

    fn read(text: &str, pace: Option<Pace>) -> Result<TrackSet, Diagnostic> {
        read_paths("way.csv", "way", text.as_bytes(), pace).map(|paths| paths.set)
    }

    #[test]
    fn points_with_times_and_ups_are_read() {
        let set = read("t,x,y,z,ux,uy,uz\n0,1,2,3,,,\n0.5,2,2,3,0,1,0\n", None).unwrap();
        let path = set.vector_keys(Channel::Translation, 0).unwrap();
        assert_eq!(path.times, [0.0, 0.5]);
        assert_eq!(
            path.keys,
            [Vec3::new(1.0, 2.0, 3.0), Vec3::new(2.0, 2.0, 3.0)]
        );
        assert_eq!(set.track_name(0), "way");
    }

    #[test]
    fn paths_without_times_get_them_by_their_length() {
        let text = "x,y,z\n0,0,0\n1,0,0\n1,0,0\n1,3,0\n";
        let times = |pace| {
            let set = read(text, Some(pace)).unwrap();
            set.vector_keys(Channel::Translation, 0)
                .unwrap()
                .times
                .to_vec()
        };
        assert_eq!(times(Pace::Seconds(8.0)), [0.0, 2.0, 8.0]);
        assert_eq!(times(Pace::Rate(2.0)), [0.0, 0.5, 2.0]);
    }

    #[test]
    fn what_is_no_path_is_refused() {
        let code = |text: &str, pace| read(text, pace).unwrap_err().code;
        assert_eq!(code("", None), Code::Empty);
        assert_eq!(code("t,x,y,z\n", None), Code::NoKeys);
        assert_eq!(code("t,x,y\n0,0,0\n", None), Code::Path);
        assert_eq!(code("t,x,y,z,w\n0,0,0,0,0\n", None), Code::Path);
        assert_eq!(code("t,x,y,z\n0,0,0\n", None), Code::Columns);
        assert_eq!(code("t,x,y,z\n0,0,NaN,0\n", None), Code::NotFinite);
        assert_eq!(
            code("t,x,y,z\n0,0,0,0\n0,1,0,0\n", None),
            Code::TimeNotIncreasing
        );
        assert_eq!(code("t,x,y,z,ux,uy,uz\n0,0,0,0,0,0,0\n", None), Code::Path);
        assert_eq!(code("x,y,z\n0,0,0\n", None), Code::PathTimes);
        assert_eq!(
            code("t,x,y,z\n0,0,0,0\n", Some(Pace::Rate(1.0))),
            Code::PathTimes
        );
    }

    #[test]
    fn files_of_paths_are_told_from_others() {
        let folder = tempfile::tempdir().unwrap();
        let looks = |name: &str, bytes: &[u8]| {
            let file = folder.path().join(name);
            std::fs::write(&file, bytes).unwrap();
            looks_like_paths(&file)
        };
        assert!(looks("a.csv", b"t,x,y,z\n0,0,0,0\n"));
        assert!(looks("b.csv", b"\xef\xbb\xbfTime, X, Y, Z, ux, uy, uz\r\n"));
        assert!(looks("c.csv", b"x,y,z"));
        assert!(!looks("d.csv", b"frame,time,box.x,box.y,box.z,box.w\n"));
        assert!(!looks("e.csv", b"t,x,y,z,w\n"));
        assert!(!looks("f.dat", b"# 4 3.0\n"));
        assert!(!looks("g.glb", b"glTF\x02\0\0\0"));
        assert!(!looks("h", b""));
        let array = |shape: &str| {
            let dictionary =
                format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}");
            let header = format!("{dictionary:117}\n");
            [&b"\x93NUMPY\x01\0\x76\0"[..], header.as_bytes()].concat()
        };
        assert!(looks("i.npy", &array("(2, 5, 3)")));
        assert!(!looks("j.npy", &array("(2, 5, 4)")));
        assert!(!looks_like_paths(folder.path()));
        assert!(!looks_like_paths(&folder.path().join("none")));
    }

    #[test]
    fn arrays_are_read_and_checked() {
        use npyz::WriterBuilder;
        let array = |shape: &[u64], numbers: &[f32]| {
            let mut bytes = Vec::new();
            let options = npyz::WriteOptions::<f32>::new()
                .default_dtype()
                .shape(shape);
            let mut writer = options.writer(&mut bytes).begin_nd().unwrap();
            writer.extend(numbers.iter().copied()).unwrap();
            writer.finish().unwrap();
            bytes
        };
        let numbers: Vec<f32> = (0..12u8).map(f32::from).collect();
        let pace = Some(Pace::Seconds(1.0));
        let set = read_paths("a.npy", "a", &array(&[2, 2, 3], &numbers), pace)
            .unwrap()
            .set;
        assert_eq!((set.track_count(), set.track_name(1)), (2, "a1".to_owned()));
        let refused = |bytes: &[u8]| read_paths("a.npy", "a", bytes, pace).unwrap_err().code;
        assert_eq!(refused(&array(&[2, 3, 2], &numbers)), Code::Shape);
        assert_eq!(refused(&array(&[0, 2, 3], &[])), Code::NoKeys);
        let whole = array(&[2, 2, 3], &numbers);
        assert_eq!(refused(&whole[..whole.len() - 4]), Code::ArraySize);
        assert_eq!(
            refused(&array(&[1, 1, 3], &[0.0, f32::NAN, 0.0])),
            Code::NotFinite
        );
    }
}
