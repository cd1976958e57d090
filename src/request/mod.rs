//! A request: which samples of a clip, how they are stored, and where they go.

#[cfg(feature = "vulkan")]
mod application_device;

use std::ops::Range;

use bytemuck::Pod;

use crate::clip::Clip;
use crate::engine::check_encoding;
use crate::error::Error;
use crate::output::encoding::Encoding;
use crate::output::rotations::Layout;
use crate::output::window::Window;
use crate::time::frames::{SampleTimes, Timeline};

/// What is asked of a clip beside the plain [`Clip::evaluate`]: a layout, an encoding, some of the tracks,
/// some of the samples, and a destination for the result.
///
/// ```
/// use tumble::{Device, Encoding, Engine, SampleTimes, Layout, TrackSet, method};
/// use glam::Quat;
///
/// let mut set = TrackSet::new();
/// let keys = [0.0, 0.7, 2.0].map(Quat::from_rotation_z);
/// set.push("elbow", &[0.0, 0.5, 1.0], &keys)?;
/// set.push("wrist", &[0.0, 0.5, 1.0], &keys)?;
/// let clip = Engine::new(Device::Cpu)?.upload(&set, method::SLERP)?;
///
/// // The second half of a second at 60 frames a second, of the wrist alone, as bits of f16.
/// let frames = SampleTimes::fps(60);
/// let request = clip.request(&frames).encoding(Encoding::F16).tracks(1..2).samples(30..61);
/// let mut halves = vec![[0_u16; 4]; 31];
/// request.evaluate_into(&mut halves)?;
/// # assert_eq!(halves[0][3], 0x3b84);
/// # Ok::<(), tumble::Error>(())
/// ```
#[derive(Debug, Clone)]
#[must_use = "a request does nothing until its result is sent somewhere"]
pub struct Request<'a> {
    pub(crate) clip: &'a Clip,
    frames: &'a SampleTimes,
    layout: Layout,
    pub(crate) encoding: Encoding,
    tracks: Option<Range<usize>>,
    samples: Option<Range<usize>>,
}

impl<'a> Request<'a> {
    /// All tracks, track by track, as rotations of four f32.
    pub(crate) fn new(clip: &'a Clip, frames: &'a SampleTimes) -> Self {
        Self {
            clip,
            frames,
            layout: Layout::TrackMajor,
            encoding: Encoding::F32,
            tracks: None,
            samples: None,
        }
    }
}

impl Request<'_> {
    /// The order of the result: `[track][sample]`, unless another is asked for.
    pub fn layout(mut self, layout: Layout) -> Self {
        self.layout = layout;
        self
    }

    /// How each value is stored.
    pub fn encoding(mut self, encoding: Encoding) -> Self {
        self.encoding = encoding;
        self
    }

    /// Only these tracks, from 0: the result has no others.
    pub fn tracks(mut self, tracks: Range<usize>) -> Self {
        self.tracks = Some(tracks);
        self
    }

    /// Only these of the samples that the frames mean, from 0: the result has no others.
    pub fn samples(mut self, samples: Range<usize>) -> Self {
        self.samples = Some(samples);
        self
    }

    /// Values of the result, and bytes of each.
    ///
    /// # Errors
    /// When the frames do not fit the clip, there are no such tracks or samples, or the encoding is for
    /// rotations and the clip has none.
    pub fn size(&self) -> Result<(usize, usize), Error> {
        let (_, window) = self.window()?;
        Ok((window.len(), self.encoding.bytes()))
    }

    /// Evaluates into the caller's memory, of whatever type: its bytes are those of
    /// [`Encoding::encode`], in the order of the layout.
    ///
    /// # Errors
    /// As [`Request::size`]; also when `output` has not exactly the bytes of the result, or the device fails.
    pub fn evaluate_into<T: Pod>(&self, output: &mut [T]) -> Result<(), Error> {
        let (timeline, window) = self.window()?;
        let output = bytemuck::cast_slice_mut(output);
        (self.clip).encode_window_into(&timeline, &window, self.encoding, output)
    }

    /// The samples that are meant, and which part of them the result is.
    pub(crate) fn window(&self) -> Result<(Timeline, Window), Error> {
        check_encoding(self.encoding, self.clip.quantity())?;
        let timeline = self.clip.timeline(self.frames)?;
        let (tracks, samples) = (self.clip.track_count(), timeline.len());
        let part = |asked: &Option<Range<usize>>, all| asked.clone().unwrap_or(0..all);
        let (window_tracks, window_samples) =
            (part(&self.tracks, tracks), part(&self.samples, samples));
        let window = Window::of(window_tracks, window_samples, self.layout);
        check_within(&window, tracks, samples)?;
        Ok((timeline, window))
    }
}

/// Refuses a window that a result has not, and memory of another size than the window's.
pub(crate) fn check_window(
    window: &Window,
    tracks: usize,
    samples: usize,
    encoding: Encoding,
    output: &[u8],
) -> Result<(), Error> {
    check_within(window, tracks, samples)?;
    match (output.len(), window.len().saturating_mul(encoding.bytes())) {
        (length, needed) if length == needed => Ok(()),
        (length, needed) => Err(Error::OutputBytes { length, needed }),
    }
}

/// Refuses a window that a result of so many tracks and samples has not.
pub(crate) fn check_within(window: &Window, tracks: usize, samples: usize) -> Result<(), Error> {
    let lies_in = |part: &Range<usize>, whole| part.start <= part.end && part.end <= whole;
    if !lies_in(&window.tracks, tracks) || !lies_in(&window.samples, samples) {
        return Err(Error::NoSuchPart {
            part: (window.tracks.clone(), window.samples.clone()),
            whole: (tracks, samples),
        });
    }
    Ok(())
}
