//! Writes a sampled clip as CSV: a row for each sample, with rotations, then translations and scales.

use std::io::{self, Write};

use crate::csv::{ORDER, io_error};
use crate::diagnostic::{Code, Diagnostic};
use crate::format::{MotionOptions, WriteError, not_one_clip};
use crate::motion::SampledClip;
use crate::motion::poses::{TRANSFORM, WORLD};
use crate::names::distinct_names;
use crate::printable::printable;
use crate::quaternion::ComponentOrder;
use crate::text::cell::{text_cell, without_nul};

/// Writes one clip; its columns have the names that the reader knows.
///
/// # Errors
/// When writing fails, or there are several clips.
pub(crate) fn write_motion(
    clips: &[SampledClip<'_>],
    options: &MotionOptions,
    out: &mut dyn Write,
) -> Result<Vec<Diagnostic>, WriteError> {
    let [sampled] = clips else {
        let message = not_one_clip(clips.len(), "CSV") + ", or write a directory or Parquet";
        return Err(Diagnostic::new(&options.name, Code::SeveralClips, message).into());
    };
    let set = &sampled.clip.set;
    let tracks = set.track_count();
    let (moved, scaled) = (!sampled.translations.is_empty(), !sampled.scales.is_empty());
    let moves = if sampled.clip.is_world {
        &WORLD[..3]
    } else {
        &TRANSFORM[..3]
    };
    let is_w_first = options.order.unwrap_or(ORDER) == ComponentOrder::Wxyz;
    let mut components = match is_w_first {
        true => vec!["w", "x", "y", "z"],
        false => vec!["x", "y", "z", "w"],
    };
    components.extend(moves.iter().filter(|_| moved));
    components.extend(TRANSFORM[7..].iter().filter(|_| scaled));
    sampled.checked_len()?;
    let mut writer = ::csv::Writer::from_writer(out);
    let mut row = vec!["frame".to_owned(), "time".to_owned()];
    for name in distinct_names(set) {
        row.extend(
            components
                .iter()
                .map(|component| text_cell(&format!("{name}.{component}")).into_owned()),
        );
    }
    let clip = sampled.clip;
    let scalars = set.scalar_count();
    row.extend(
        clip.scalar_keys().enumerate().map(|(index, keys)| {
            text_cell(&clip.scalar(index).kind.column(keys.name)).into_owned()
        }),
    );
    writer.write_record(&row).map_err(io_error)?;
    for (frame, time) in sampled.times.iter().enumerate() {
        row.clear();
        row.push(frame.to_string());
        let Some(digits) = sampled.time_digits(frame) else {
            let message = format!("the time {time} s is out of range");
            return Err(io::Error::new(io::ErrorKind::InvalidInput, message).into());
        };
        row.push(digits);
        for index in frame * tracks..(frame + 1) * tracks {
            let q = sampled.rotations[index];
            let numbers = match is_w_first {
                true => [q.w, q.x, q.y, q.z],
                false => q.to_array(),
            };
            row.extend(numbers.map(|number| number.to_string()));
            if moved {
                row.extend(sampled.coordinates(frame, index % tracks));
            }
            if scaled {
                let scale = sampled.scales[index].to_array();
                row.extend(scale.map(|number| number.to_string()));
            }
        }
        row.extend((0..scalars).map(|index| sampled.scalar_text(frame, index)));
        writer.write_record(&row).map_err(io_error)?;
    }
    writer.flush()?;
    let mut names = (0..tracks).map(|track| set.track_name(track));
    let changed = names.find_map(|name| {
        let written = without_nul(&name);
        let message = format!("`{}` is written as `{written}`", printable(&name));
        let warning = || Diagnostic::new(&options.name, Code::NameChanged, message);
        (written != name).then(warning)
    });
    Ok(changed.into_iter().collect())
}
