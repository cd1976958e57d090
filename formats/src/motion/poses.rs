//! Writes poses to files: several numbers for each track at each frame, in the order `[frame][track]`.

use std::io::{self, Write};

use glam::DVec3;
use tumble::{Timeline, TrackSet};

use crate::array::{ArrayHeader, Element};
use crate::decimal::time_text;
use crate::motion::origin::coordinate;
use crate::text::cell::text_cell;

/// Names of the components of a local transform: translation, rotation, scale.
pub const TRANSFORM: [&str; 10] = ["tx", "ty", "tz", "x", "y", "z", "w", "sx", "sy", "sz"];

/// Names of the components of a pose in the world: position, rotation.
pub const WORLD: [&str; 7] = ["px", "py", "pz", "x", "y", "z", "w"];

/// Name of the component of a scalar. Its array has no axis of components, and its column in CSV is called after the
/// scalar alone.
pub const SCALAR: [&str; 1] = ["value"];

/// The numbers of all tracks at all frames, with the names of their components.
#[derive(Debug, Clone, Copy)]
pub struct Poses<'a> {
    /// The set of the tracks.
    pub set: &'a TrackSet,
    /// The times of the frames.
    pub timeline: &'a Timeline,
    /// The seconds to add to them to get the times in the file: the clip's
    /// [`time_offset`](crate::motion::Motion::time_offset).
    pub time_offset: i64,
    /// The names of the components of one track at one frame.
    pub components: &'a [&'a str],
    /// The numbers, in the order `[frame][track][component]`.
    pub numbers: &'a [f32],
    /// The vector to add to the first three components of each track, which are its position; empty if all are 0.
    pub origins: &'a [DVec3],
}

impl Poses<'_> {
    /// Whether any track has an origin other than 0.
    #[must_use]
    pub fn has_origins(&self) -> bool {
        self.origins.iter().any(|&origin| origin != DVec3::ZERO)
    }

    /// The vector to add to the positions of a track.
    #[must_use]
    pub fn origin(&self, track: usize) -> DVec3 {
        self.origins.get(track).copied().unwrap_or_default()
    }

    /// Each number, with its track and its component of the pose.
    fn each(&self) -> impl Iterator<Item = (usize, usize, f32)> {
        let (width, tracks) = (self.components.len().max(1), self.set.track_count().max(1));
        let numbers = self.numbers.iter().enumerate();
        numbers.map(move |(index, &number)| (index / width % tracks, index % width, number))
    }

    /// Whether the tracks are scalars.
    fn are_scalars(&self) -> bool {
        self.components == SCALAR
    }

    /// Writes an NPY array of shape (frames, tracks, components), of scalars (frames, scalars). It is float32; with origins it is float64, and they
    /// are added to the positions.
    ///
    /// # Errors
    /// When writing fails, or (`InvalidInput`) when the number of values does not fit the frames, tracks and
    /// components.
    pub fn write_npy(&self, writer: &mut impl Write) -> io::Result<()> {
        self.check()?;
        let all = [
            self.timeline.len(),
            self.set.track_count(),
            self.components.len(),
        ];
        let shape = if self.are_scalars() { &all[..2] } else { &all };
        if self.has_origins() {
            writer.write_all(&ArrayHeader::write(&Element::F64, shape))?;
            return self.each().try_for_each(|(track, component, number)| {
                let moved = if component < 3 {
                    self.origin(track)[component]
                } else {
                    0.0
                };
                writer.write_all(&(f64::from(number) + moved).to_le_bytes())
            });
        }
        writer.write_all(&ArrayHeader::write(&Element::F32, shape))?;
        if cfg!(target_endian = "little") {
            return writer.write_all(bytemuck::cast_slice(self.numbers));
        }
        let mut numbers = self.numbers.iter();
        numbers.try_for_each(|number| writer.write_all(&number.to_le_bytes()))
    }

    /// Writes CSV with the columns `frame,time,<track>.<component>,…`, one line for each frame. Origins are added to
    /// the positions.
    ///
    /// # Errors
    /// As [`Poses::write_npy`].
    pub fn write_csv(&self, writer: &mut impl Write) -> io::Result<()> {
        self.check()?;
        let mut csv = ::csv::Writer::from_writer(writer);
        let tracks = self.set.track_count();
        let mut row = vec!["frame".to_owned(), "time".to_owned()];
        for track in 0..tracks {
            let name = self.set.track_name(track);
            let component = |component| match self.are_scalars() {
                true => text_cell(&name).into_owned(),
                false => text_cell(&format!("{name}.{component}")).into_owned(),
            };
            row.extend(self.components.iter().map(component));
        }
        csv.write_record(&row)?;
        let mut numbers = self.each();
        let each = tracks * self.components.len();
        for (frame, time) in self.timeline.times(0).enumerate() {
            row.clear();
            row.push(frame.to_string());
            row.push(time_text(self.time_offset, time));
            let of_frame = numbers.by_ref().take(each);
            row.extend(of_frame.map(|(track, component, number)| match component {
                0..3 => coordinate(self.origin(track)[component], number),
                _ => number.to_string(),
            }));
            csv.write_record(&row)?;
        }
        csv.flush()
    }

    pub(crate) fn check(&self) -> io::Result<()> {
        let needed = self.timeline.len() * self.set.track_count() * self.components.len();
        if self.numbers.len() == needed {
            return Ok(());
        }
        let message = format!("{} numbers where there are {needed}", self.numbers.len());
        Err(io::Error::new(io::ErrorKind::InvalidInput, message))
    }
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;
    use tumble::SampleTimes;

    #[test]
    fn poses_are_written_frame_by_frame() {
        let mut set = TrackSet::new();
        set.push("hip", &[0.0], &[Quat::IDENTITY]).unwrap();
        let timeline = SampleTimes::at(vec![0.0, 0.5]).resolve(1, None).unwrap();
        let numbers: Vec<f32> = (0..14u8).map(|i| f32::from(i) * 0.5).collect();
        let poses = Poses {
            set: &set,
            timeline: &timeline,
            time_offset: 0,
            components: &WORLD,
            numbers: &numbers,
            origins: &[],
        };
        let mut csv = Vec::new();
        poses.write_csv(&mut csv).unwrap();
        let text = String::from_utf8(csv).unwrap();
        assert_eq!(
            text,
            "frame,time,hip.px,hip.py,hip.pz,hip.x,hip.y,hip.z,hip.w\n\
             0,0,0,0.5,1,1.5,2,2.5,3\n1,0.5,3.5,4,4.5,5,5.5,6,6.5\n"
        );
        let mut npy = Vec::new();
        poses.write_npy(&mut npy).unwrap();
        let read = npyz::NpyFile::new(&npy[..]).unwrap();
        assert_eq!(read.shape(), [2, 1, 7]);
        assert_eq!(read.into_vec::<f32>().unwrap(), numbers);
        let short = Poses {
            numbers: &numbers[1..],
            ..poses
        };
        assert!(short.write_npy(&mut Vec::new()).is_err());
    }
}
