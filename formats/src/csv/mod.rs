//! CSV with a line for each frame: `frame,time,<track>.w,<track>.x,<track>.y,<track>.z,…`. The column `w` comes last
//! in the order x y z w. Other encodings have their numbers as columns.

mod capture;
mod motion;
pub mod read;

use std::fmt::Write as _;
use std::io::{self, Write};

use glam::Quat;

use tumble::{Encoding, Layout, Timeline, TrackSet};

use crate::decimal::time_text;
use crate::feature::Feature;
use crate::format::{Format, FormatOption, ResultWriter, WriteResults};
use crate::quaternion::ComponentOrder;
use crate::text::cell::text_cell;

/// The order of `.dat` files.
pub(crate) const ORDER: ComponentOrder = ComponentOrder::Wxyz;

/// The CSV format.
pub static FORMAT: Format = Format {
    name: "csv",
    summary: "text, a row for each frame or key",
    extensions: &[],
    probe: |_| false,
    numbers_in_line: None,
    is_text: true,
    numbers_repeated_names: true,
    guesses_time_unit: true,
    read: read::open_csv,
    read_bytes: read::read_csv,
    write: Some(WriteResults {
        order: ORDER,
        // A row holds one frame.
        layout: Some(Layout::FrameMajor),
        rotation_bytes: |_| 8.0, // four times a digit and a comma
        rotations: |out, result| {
            let order = result.order.unwrap_or(ORDER);
            Ok(Box::new(CsvWriter::new(
                out,
                result.set,
                (result.timeline, result.time_offset),
                order,
                result.encoding,
            )?))
        },
        poses: |poses, mut out| poses.write_csv(&mut out),
    }),
    write_motion: Some(|clips, options, out| motion::write_motion(clips, options, out)),
    features: &[
        Feature::SeveralTracks,
        Feature::Quaternions,
        Feature::TrackNames,
        Feature::Translations,
        Feature::Scales,
        Feature::Scalars,
        Feature::Curves,
        Feature::World,
        Feature::UnevenTimes,
        Feature::Start,
        Feature::Nanoseconds,
    ],
    options: &[
        FormatOption::RawTimes,
        FormatOption::Duplicates,
        FormatOption::SourceRate,
        FormatOption::Map,
        FormatOption::TimeUnit,
        FormatOption::BridgeGaps,
        FormatOption::Order,
        // For robots' files without names of columns.
        FormatOption::SourceOrder,
    ],
};

impl<W: Write> ResultWriter for CsvWriter<'_, W> {
    fn write(&mut self, rotations: &[Quat]) -> io::Result<()> {
        self.write(rotations)
    }

    fn finish(self: Box<Self>) -> io::Result<()> {
        (*self).finish()
    }
}

/// Writes a result as CSV, frame by frame. Numbers have as many digits as are needed to read back the same bits;
/// times are in seconds.
pub struct CsvWriter<'a, W: Write> {
    csv: ::csv::Writer<W>,
    timeline: &'a Timeline,
    time_offset: i64,
    order: ComponentOrder,
    encoding: Encoding,
    tracks: usize,
    /// The next frame to be written.
    frame: usize,
    /// Memory for a number.
    text: String,
}

impl<'a, W: Write> CsvWriter<'a, W> {
    /// Writes the header of a result: the rotations of `set` at the samples of a timeline, whose times are written with
    /// these whole seconds added (a clip's [`time_offset`](crate::motion::Motion::time_offset)). `order` is that of
    /// quaternions; other encodings have only one. The encodings F16 and Snorm16 are written as F32, because rounded
    /// numbers would not be shorter.
    ///
    /// # Errors
    /// When writing fails.
    pub fn new(
        writer: W,
        set: &TrackSet,
        (timeline, time_offset): (&'a Timeline, i64),
        order: ComponentOrder,
        encoding: Encoding,
    ) -> io::Result<Self> {
        let mut writer = Self {
            csv: ::csv::Writer::from_writer(writer),
            timeline,
            time_offset,
            order,
            encoding,
            tracks: set.track_count(),
            frame: 0,
            text: String::new(),
        };
        writer.header(set).map_err(io_error)?;
        Ok(writer)
    }

    /// Writes the next frames; `rotations` is in the order `[frame][track]`.
    ///
    /// # Errors
    /// When writing fails, or (`InvalidInput`) when a frame is not complete or there are more frames than in the
    /// timeline.
    pub fn write(&mut self, rotations: &[Quat]) -> io::Result<()> {
        let frames = rotations.chunks_exact(self.tracks.max(1));
        if !frames.remainder().is_empty() || self.frame + frames.len() > self.timeline.len() {
            let message = "not whole frames, or more than there are";
            return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
        }
        for frame in frames {
            self.row(frame).map_err(io_error)?;
        }
        Ok(())
    }

    /// Flushes the output.
    ///
    /// # Errors
    /// When flushing fails, or (`InvalidInput`) when frames are missing.
    pub fn finish(mut self) -> io::Result<()> {
        self.csv.flush()?;
        if self.frame < self.timeline.len() {
            let message = "there are fewer frames than the timeline has";
            return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
        }
        Ok(())
    }

    /// Whether w is the first component.
    fn is_w_first(&self) -> bool {
        self.encoding.is_quaternion() && self.order == ComponentOrder::Wxyz
    }

    fn header(&mut self, set: &TrackSet) -> ::csv::Result<()> {
        self.csv.write_field("frame")?;
        self.csv.write_field("time")?;
        for track in 0..set.track_count() {
            let name = set.track_name(track);
            let mut components = self.encoding.components().to_vec();
            if self.is_w_first() {
                components.rotate_right(1);
            }
            for component in components {
                self.csv
                    .write_field(&*text_cell(&format!("{name}.{component}")))?;
            }
        }
        self.csv.write_record(None::<&[u8]>)
    }

    fn row(&mut self, frame: &[Quat]) -> ::csv::Result<()> {
        self.csv.write_field(self.frame.to_string())?;
        let time = self.timeline.time(0, self.frame).unwrap_or(f64::NAN);
        self.csv.write_field(time_text(self.time_offset, time))?;
        let mut bytes = vec![0; self.encoding.bytes()];
        for q in frame {
            let mut numbers = q.to_array().to_vec();
            if self.is_w_first() {
                numbers.rotate_right(1);
            }
            // Quaternions are written without rounding; other encodings are rounded to f32.
            if !self.encoding.is_quaternion() {
                let encoded = self.encoding.encode(&[q.to_array()], &mut bytes);
                encoded.map_err(std::io::Error::other)?;
                numbers = bytemuck::pod_collect_to_vec(&bytes);
            }
            for component in numbers {
                self.text.clear();
                let _ = write!(self.text, "{component}"); // a String takes everything
                self.csv.write_field(&self.text)?;
            }
        }
        self.frame += 1;
        self.csv.write_record(None::<&[u8]>)
    }
}

/// Converts an error and keeps its kind, for example that of a broken pipe; the crate's conversion loses it.
pub(crate) fn io_error(error: ::csv::Error) -> io::Error {
    let message = error.to_string();
    match error.into_kind() {
        ::csv::ErrorKind::Io(error) => error,
        _ => io::Error::other(message),
    }
}
