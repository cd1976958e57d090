//! Trajectories as the KITTI odometry benchmark has them: twelve numbers a line, the rows of a
//! rotation matrix with a translation, `r11 r12 r13 tx r21 r22 r23 ty r31 r32 r33 tz`, one line a frame.

use std::io::BufRead;
use std::path::Path;

use glam::DVec3;
use tumble::{TrackError, TrackSet};

use crate::diagnostic::{Code, Diagnostic};
use crate::feature::Feature;
use crate::format::{Format, FormatOption, Loaded, ReadOptions};
use crate::motion::{Joint, Motion, Transform};
use crate::quaternion::rounded;
use crate::rotation_matrix::of_matrix;
use crate::signs::continue_signs;
use crate::source::Source;
use crate::text::lines::{Lines, tokens};
use crate::text::number;
use crate::tum::BODY;

/// A path of one body, without times.
pub static FORMAT: Format = Format {
    name: "kitti",
    summary: "a trajectory, the rows of a matrix a line, without times",
    extensions: &[],
    probe: |_| false,
    read: open_kitti,
    read_bytes: |name, bytes, options| read_kitti(name, &bytes[..], options),
    write: None,
    write_motion: None,
    features: &[Feature::Translations],
    options: &[FormatOption::SourceRate],
};

fn open_kitti(path: &Path, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    let mut source = Source::open(path, options.pipes)?;
    let name = source.name.clone();
    let loaded = read_kitti(&name, &mut source.reader, options)?;
    source.check_unchanged()?;
    Ok(loaded)
}

/// Reads poses, one a frame of the rate that the options say; the one track is named `body`.
///
/// # Errors
/// The first fault that refuses the input; options without a rate are one.
pub fn read_kitti(
    name: &str,
    reader: impl BufRead,
    options: &ReadOptions,
) -> Result<Loaded, Diagnostic> {
    let mut lines = Lines::with_names(name, reader, options.limits)?;
    let Some(rate) = options.source_rate else {
        let message =
            "KITTI's poses have no times; give --source-fps, their rate (in Python source_fps)";
        return Err(Diagnostic::new(name, Code::NoRate, message));
    };
    let (mut rotations, mut positions) = (Vec::new(), Vec::new());
    while let Some(line) = lines.next()? {
        let text = line.split('#').next().unwrap_or_default().replace(',', " ");
        if !text.trim().is_empty() {
            let [a, b, c] = read_rows(&lines, &text)?;
            let rotation = of_matrix([a, b, c].map(|[x, y, z, _]| [x, y, z]));
            let Some(rotation) = rotation else {
                let message = "the first three columns of the matrix are no rotation".to_owned();
                return Err(lines.refuse(1, Code::NoRotation, message));
            };
            rotations.push(rounded(rotation));
            positions.push(DVec3::new(a[3], b[3], c[3]));
        }
        lines.reuse(line);
    }
    if rotations.is_empty() {
        let message = "no poses; a line is the three rows of a matrix".to_owned();
        return Err(lines.refuse_end(Code::TumEmpty, message));
    }
    continue_signs(&mut rotations, 1);
    let times: Vec<f64> = (0..rotations.len() as u64)
        .map(|frame| rate.time_of(frame))
        .collect();
    let mut set = TrackSet::new();
    let refuse = |error: TrackError| Diagnostic::new(name, Code::KittiPose, error.to_string());
    set.push(BODY, &times, &rotations).map_err(refuse)?;
    let mut clip = Motion {
        set,
        skeleton: vec![Joint {
            parent: None,
            rest: Transform::default(),
        }],
        rate: Some(rate),
        ..Motion::default()
    };
    clip.set_positions(0, &times, &positions).map_err(refuse)?;
    Ok(Loaded::of(clip, lines.warnings))
}

fn read_rows<R: BufRead>(lines: &Lines<R>, line: &str) -> Result<[[f64; 4]; 3], Diagnostic> {
    let mut rows = [[0.0; 4]; 3];
    let found = tokens(line).count();
    if found != 12 {
        let column = tokens(line)
            .nth(12)
            .map_or(line.trim_end().len() as u64 + 1, |(at, _)| at);
        let message = format!("{found} numbers where 12 are expected: three rows of a matrix");
        return Err(lines.refuse(column, Code::KittiPose, message));
    }
    for (number, (column, token)) in rows.as_flattened_mut().iter_mut().zip(tokens(line)) {
        let read = number::parse(token);
        let read = read.map_err(|(code, message)| lines.refuse(column, code, message))?;
        *number = read.value;
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn rows_of_matrices_are_poses_at_a_rate() {
        let text = "1 0 0 1.5 0 1 0 -2 0 0 1 3\n0 -1 0 2 1 0 0 0 0 0 1 0\n";
        let options = ReadOptions {
            source_rate: tumble::FrameRate::new(10, 1).ok(),
            ..ReadOptions::default()
        };
        let clip = &read_kitti("k.txt", text.as_bytes(), &options)
            .unwrap()
            .clips[0];
        let track = clip.set.track(0);
        assert_eq!(track.times, [0.0, 0.1]);
        let quarter = glam::Quat::from_rotation_z(std::f32::consts::FRAC_PI_2);
        assert!(track.keys[1].dot(quarter).abs() > 1.0 - 1e-6);
        let moved = clip
            .set
            .vector_keys(tumble::Channel::Translation, 0)
            .unwrap();
        assert_eq!(moved.keys, [Vec3::new(1.5, -2.0, 3.0), Vec3::X * 2.0]);
        let refused = |text: &str, options: &ReadOptions| {
            read_kitti("k.txt", text.as_bytes(), options)
                .unwrap_err()
                .code
        };
        assert_eq!(refused(text, &ReadOptions::default()), Code::NoRate);
        assert_eq!(refused("1 0 0 0\n", &options), Code::KittiPose);
        let mirrored = "1 0 0 0 0 1 0 0 0 0 -1 0\n";
        assert_eq!(refused(mirrored, &options), Code::NoRotation);
        assert_eq!(refused("\n", &options), Code::TumEmpty);
    }
}
