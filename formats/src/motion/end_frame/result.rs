//! Chooses the rule for the end of a result: the requested one, if the result can store it, otherwise the default.

use crate::feature::Feature;
use crate::format::{Document, Format, FormatOption};
use crate::motion::end_frame::EndFrame;

/// A new result of samples.
#[derive(Debug, Clone, Copy)]
pub struct SampledResult<'a> {
    /// Its format.
    pub format: &'a Format,
    /// Whether the times are written to a separate file ([`FormatOption::TimesApart`]).
    pub times_apart: bool,
    /// Its kind.
    pub kind: SampledKind,
}

/// The kind of numbers in a result of samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SampledKind {
    /// Clips with all their channels.
    Clips,
    /// Rotations alone.
    Rotations,
    /// Other numbers, such as velocities or poses in the world.
    Numbers,
}

/// Why a rule for the end does not suit a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EndFrameError {
    /// A key at the end needs a time, and the format has frames of a rate.
    #[error("{format} stores frames of a rate and no times")]
    FormatOfFrames {
        /// The name of the format.
        format: &'static str,
    },
    /// The format has times in a separate file, which is not written.
    #[error("{format} stores the times of frames only in a separate file, and none is written")]
    NoFileOfTimes {
        /// The name of the format.
        format: &'static str,
    },
    /// The file that is written again has frames of a rate.
    #[error("its arrays are frames of a rate, without times")]
    DocumentOfFrames,
}

impl EndFrame {
    /// The rule for a new result: `asked`, or else the default. Clips end as [`where_times_are`](Self::where_times_are)
    /// says. Rotations with times have a key at the end, since they are read again as a clip. Other results are frames.
    ///
    /// # Errors
    /// When a key at the end is asked for, and the result has no times.
    pub fn for_result(
        asked: Option<Self>,
        result: SampledResult<'_>,
    ) -> Result<Self, EndFrameError> {
        let format = result.format;
        let has_times = format.supports(Feature::UnevenTimes) || result.times_apart;
        match (asked, result.kind) {
            (Some(Self::Key), _) if !has_times => {
                let format_name = format.name;
                Err(match format.takes(FormatOption::TimesApart) {
                    true => EndFrameError::NoFileOfTimes {
                        format: format_name,
                    },
                    false => EndFrameError::FormatOfFrames {
                        format: format_name,
                    },
                })
            }
            (Some(asked), _) => Ok(asked),
            (None, SampledKind::Clips) => Ok(Self::where_times_are(has_times)),
            (None, SampledKind::Rotations) if has_times => Ok(Self::Key),
            (None, SampledKind::Rotations | SampledKind::Numbers) => Ok(Self::LeaveOut),
        }
    }

    /// The rule for a file that is written again with samples: `asked`, or else that of the file.
    ///
    /// # Errors
    /// When a key at the end is asked for, and the file has no times.
    pub fn for_document(
        asked: Option<Self>,
        document: &dyn Document,
    ) -> Result<Self, EndFrameError> {
        match (document.end_frame(), asked) {
            (Self::Hold, Some(Self::Key)) => Err(EndFrameError::DocumentOfFrames),
            (of_document, asked) => Ok(asked.unwrap_or(of_document)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_without_times_have_no_key_at_the_end() {
        let format = |name: &str| Format::named(name).unwrap();
        let of = |asked, name, times_apart, kind| {
            let format = format(name);
            let result = SampledResult {
                format,
                times_apart,
                kind,
            };
            EndFrame::for_result(asked, result)
        };
        use SampledKind::{Clips, Numbers, Rotations};
        let key = Some(EndFrame::Key);
        for (asked, name, times_apart, kind, expected) in [
            (None, "glb", false, Clips, Ok(EndFrame::Key)),
            (None, "bvh", false, Clips, Ok(EndFrame::Hold)),
            (None, "kitti", false, Clips, Ok(EndFrame::Hold)),
            (None, "kitti", true, Clips, Ok(EndFrame::Key)),
            (None, "csv", false, Rotations, Ok(EndFrame::Key)),
            (None, "csv", false, Numbers, Ok(EndFrame::LeaveOut)),
            (None, "npy", false, Rotations, Ok(EndFrame::LeaveOut)),
            (key, "csv", false, Numbers, Ok(EndFrame::Key)),
            (key, "kitti", true, Clips, Ok(EndFrame::Key)),
            (
                key,
                "kitti",
                false,
                Clips,
                Err(EndFrameError::NoFileOfTimes { format: "kitti" }),
            ),
            (
                key,
                "npy",
                false,
                Rotations,
                Err(EndFrameError::FormatOfFrames { format: "npy" }),
            ),
        ] {
            assert_eq!(of(asked, name, times_apart, kind), expected, "{name}");
        }
    }
}
