//! Trajectories in the format of the `EuRoC` MAV data sets: CSV of `timestamp x y z qw qx qy qz` after a heading.
//! Times are whole nanoseconds; w is the first component. Files of ground truth have velocities and biases after each
//! pose, which are not read.

use std::fmt::Write as _;
use std::io::{BufRead, Write};
use std::path::Path;

use crate::csv::read::open_csv;
use crate::decimal::Decimal;
use crate::diagnostic::Diagnostic;
use crate::feature::Feature;
use crate::format::{
    Format, FormatOption, Loaded, MotionOptions, ReadOptions, TimeUnit, WriteError,
};
use crate::motion::SampledClip;
use crate::source::Source;
use crate::tum::{PoseLine, Trajectory, read_lines};

/// The `EuRoC` format: the path of one body.
pub static FORMAT: Format = Format {
    name: "euroc",
    summary: "a trajectory, CSV of nanoseconds, `x y z` and `qw qx qy qz`",
    extensions: &[],
    probe: |start| {
        let start = start.strip_prefix(b"\xef\xbb\xbf").unwrap_or(start);
        let line = start
            .split(|&byte| byte == b'\n')
            .next()
            .unwrap_or_default();
        // Its columns are in this order in every file of the data sets.
        let columns: [&[u8]; 5] = [b"timestamp", b"p_RS_R_x", b"q_RS_w", b"q_RS_x", b"q_RS_z"];
        let mut rest = line;
        line.starts_with(b"#")
            && columns.iter().all(|word| {
                let found = rest.windows(word.len()).position(|part| part == *word);
                rest = found.map_or(&[], |at| &rest[at..]);
                found.is_some()
            })
    },
    numbers_in_line: None,
    is_text: true,
    numbers_repeated_names: false,
    guesses_time_unit: false,
    read: open_euroc,
    read_bytes: |name, bytes, options| match options.map {
        Some(_) => (crate::csv::FORMAT.read_bytes)(name, bytes, options),
        None => read_euroc(name, &bytes[..], options),
    },
    write: None,
    write_motion: Some(write_motion),
    features: &[
        Feature::Quaternions,
        Feature::Translations,
        Feature::Curves,
        Feature::UnevenTimes,
        Feature::Start,
        Feature::Nanoseconds,
    ],
    options: &[
        FormatOption::RawTimes,
        FormatOption::Duplicates,
        FormatOption::TimeUnit,
        FormatOption::Map,
        FormatOption::BridgeGaps,
        FormatOption::SourceOrder,
    ],
};

const LINE: PoseLine = PoseLine {
    numbers: "timestamp,x,y,z,qw,qx,qy,qz",
    is_w_first: true,
    unit: Some(TimeUnit::Nanoseconds),
};

/// The first line of a file.
const HEADING: &str = "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],\
                       q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n";

fn open_euroc(path: &Path, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    // With `--map`, the user defines the columns, so the file is read as a table.
    if options.map.is_some() {
        return open_csv(path, options);
    }
    Source::read_by(path, options.pipes, |name, reader| {
        read_euroc(name, reader, options)
    })
}

/// Reads poses; `name` is the input's name in messages. The only track is named `body`. Times are nanoseconds unless
/// the options specify another unit. Times from a million seconds on count from the whole second at or before the
/// first time, which is the clip's [`time_offset`](crate::motion::Motion::time_offset).
///
/// # Errors
/// When the input is invalid; the first error is returned.
pub fn read_euroc(
    name: &str,
    reader: impl BufRead,
    options: &ReadOptions,
) -> Result<Loaded, Diagnostic> {
    read_lines(name, reader, options, &LINE)
}

/// Writes one clip of one track. Times are rounded to nanoseconds. Other numbers have the fewest digits that are read
/// back as the same f32, relative to an origin if there is one.
fn write_motion(
    clips: &[SampledClip<'_>],
    options: &MotionOptions,
    out: &mut dyn Write,
) -> Result<Vec<Diagnostic>, WriteError> {
    let path = Trajectory::of(clips, options)?;
    let mut text = HEADING.to_owned();
    let mut last = None;
    for (sample, &time) in path.sampled.times.iter().enumerate() {
        let exact = Decimal::of(path.sampled.clip.time_offset, time);
        let exact = exact.ok_or_else(|| path.out_of_range(sample))?;
        let nanoseconds = exact.nanoseconds();
        if last == Some(nanoseconds) {
            let message = format!(
                "two poses at {nanoseconds} ns, in which EuRoC has times; write another format"
            );
            return Err(path.refuse(message));
        }
        last = Some(nanoseconds);
        let (rotation, position) = path.pose(sample)?;
        let [x, y, z] = position;
        let [qx, qy, qz, qw] = rotation.to_array();
        // The result is ignored, because writing to memory cannot fail.
        let _ = writeln!(text, "{nanoseconds},{x},{y},{z},{qw},{qx},{qy},{qz}");
        out.write_all(text.as_bytes())?;
        text.clear();
    }
    out.write_all(text.as_bytes())?;
    Ok(Vec::new())
}

#[cfg(test)]
mod tests {
    use glam::{Quat, Vec3};
    use tumble::Channel;

    use super::*;
    use crate::diagnostic::Code;
    use crate::motion::keyed::keyed;

    const TEXT: &str = "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], v_RS_R_x [m s^-1]\n\
        1403636580838555648,4.688319,-1.786938,0.783338,0.8,-0.6,0,0,-0.027876\n\
        1403636580843555328,4.688177,-1.78677,0.78735,0,0,0.6,0.8,-0.028\n";

    fn read(text: &str) -> Loaded {
        let loaded = read_euroc("t", text.as_bytes(), &ReadOptions::default());
        loaded.unwrap_or_else(|error| panic!("{error}"))
    }

    #[test]
    fn poses_are_read_and_come_back_word_for_word() {
        let loaded = read(TEXT);
        let clip = &loaded.clips[0];
        assert_eq!(loaded.warnings[0].code, Code::FurtherNumbers);
        assert_eq!(clip.time_offset, 1_403_636_580);
        assert_eq!(clip.set.track(0).times, [0.838_555_648, 0.843_555_328]);
        assert_eq!(
            clip.set.track(0).keys,
            [
                Quat::from_xyzw(-0.6, 0.0, 0.0, 0.8),
                Quat::from_xyzw(0.0, 0.6, 0.8, 0.0)
            ]
        );
        let moved = clip.set.vector_keys(Channel::Translation, 0).unwrap().keys;
        assert_eq!(moved[1], Vec3::new(4.688_177, -1.786_77, 0.787_35));
        let samples = keyed(clip).unwrap();
        let mut out = Vec::new();
        let sampled = [samples.of(clip, clip.rate, &[])];
        let written = FORMAT.write_clips(&sampled, &MotionOptions::default(), &mut out);
        assert_eq!(written.unwrap(), []);
        // The sign of the second quaternion continues that of the first.
        let expected = HEADING.to_owned()
            + "1403636580838555648,4.688319,-1.786938,0.783338,0.8,-0.6,0,0\n\
               1403636580843555328,4.688177,-1.78677,0.78735,0,0,0.6,0.8\n";
        assert_eq!(String::from_utf8(out).unwrap(), expected);
        assert_eq!(
            Format::detect(Path::new("data.csv"), TEXT.as_bytes()).name,
            "euroc"
        );
    }

    #[test]
    fn times_are_whole_nanoseconds_that_differ() {
        let clip = &read(TEXT).clips[0];
        let mut samples = keyed(clip).unwrap();
        let mut write = |times: [f64; 2]| {
            samples.times = times.to_vec();
            let mut out = Vec::new();
            let sampled = [samples.of(clip, None, &[])];
            let written = FORMAT.write_clips(&sampled, &MotionOptions::default(), &mut out);
            written.map(|_| String::from_utf8(out).unwrap())
        };
        let text = write([1.0 / 3.0, 2.0 / 3.0]).unwrap();
        let times: Vec<&str> = text.lines().skip(1).map(|line| &line[..19]).collect();
        assert_eq!(times, ["1403636580333333333", "1403636580666666667"]);
        let refused = write([0.5, 0.500_000_000_3]);
        assert!(matches!(refused, Err(WriteError::Refused(fault)) if fault.code == Code::TumWrite));
    }
}
