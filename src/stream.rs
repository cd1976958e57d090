//! Results larger than memory: one chunk is used while the next one is evaluated.

use std::ops::Range;
use std::sync::mpsc::sync_channel;
use std::thread;

use glam::{Quat, Vec4};

use crate::curve::options::Quantity;
use crate::error::Error;
use crate::output::buffer::OutputBuffer;
use crate::output::window::Window;
use crate::threads::{self, OutOfThreadsError};

/// A contiguous part of a result. Chunks are in the order of the whole result in memory, without gaps.
#[derive(Debug)]
#[non_exhaustive]
pub struct Chunk<'a> {
    /// The index of the chunk's first value in the whole result.
    pub start: usize,
    /// The tracks of the chunk.
    pub tracks: Range<usize>,
    /// The samples of the chunk.
    pub samples: Range<usize>,
    /// The values of these tracks and samples, `[track][sample]` or `[sample][track]` depending on the layout: `x y z
    /// w` of rotations, `x y z 0` of velocities and accelerations. They are aligned to 16 bytes.
    pub rows: &'a [[f32; 4]],
    quantity: Quantity,
}

impl<'a> Chunk<'a> {
    fn new(window: Window, quats: &'a [Quat], quantity: Quantity) -> Self {
        Self {
            start: window.start,
            tracks: window.tracks,
            samples: window.samples,
            rows: bytemuck::cast_slice(quats),
            quantity,
        }
    }

    /// The rotations; `None` if these are velocities or accelerations.
    #[must_use]
    pub fn rotations(&self) -> Option<&'a [Quat]> {
        let quats = bytemuck::try_cast_slice(self.rows).ok();
        quats.filter(|_| self.quantity == Quantity::Rotation)
    }

    /// The velocities or accelerations, each followed by 0; `None` if these are rotations.
    #[must_use]
    pub fn rates(&self) -> Option<&'a [Vec4]> {
        let vectors = bytemuck::try_cast_slice(self.rows).ok();
        vectors.filter(|_| self.quantity != Quantity::Rotation)
    }
}

/// The number of buffers: one is filled, one is read, one waits.
const BUFFERS: usize = 3;

/// Fills windows on a separate thread, and calls `sink` with them on this one.
pub(crate) fn run<E: From<Error>>(
    mut windows: impl Iterator<Item = Window> + Send,
    quantity: Quantity,
    fill: impl Fn(&Window, &mut [Quat]) -> Result<(), Error> + Send,
    mut sink: impl FnMut(Chunk<'_>) -> Result<(), E>,
) -> Result<(), E> {
    let first = [windows.next(), windows.next()];
    let fill_one = move |window: Window, used: OutputBuffer| -> Result<_, Error> {
        let mut rotations = match used.len() < window.len() {
            true => OutputBuffer::new(window.len())?,
            false => used,
        };
        fill(&window, &mut rotations[..window.len()])?;
        Ok((window, rotations))
    };
    // With a single chunk, there is no work that could be done at the same time.
    if let [Some(window), None] = first {
        let none = OutputBuffer::new(0).map_err(Error::from)?;
        let (window, rotations) = fill_one(window, none)?;
        return sink(Chunk::new(window, &rotations, quantity));
    }
    let mut windows = first.into_iter().flatten().chain(windows);
    // One of the engine's threads must not wait for a thread that needs them: all of them may be here.
    if threads::is_worker() || !threads::HAS_THREADS {
        let mut used = OutputBuffer::new(0).map_err(Error::from)?;
        return windows.try_for_each(|window| {
            let none = OutputBuffer::new(0).map_err(Error::from)?;
            let (window, rotations) = fill_one(window, std::mem::replace(&mut used, none))?;
            let count = window.len();
            sink(Chunk::new(window, &rotations[..count], quantity))?;
            used = rotations;
            Ok(())
        });
    }
    thread::scope(|scope| {
        let (give_back, empty) = sync_channel::<OutputBuffer>(BUFFERS);
        let (hand_over, filled) = sync_channel(BUFFERS);
        for _ in 0..BUFFERS {
            let _ = give_back.send(OutputBuffer::new(0).map_err(Error::from)?); // it has room
        }
        // The loop ends after an error, or when the receiver was dropped.
        let fill_all = move || {
            windows.try_for_each(|window| {
                let filled = fill_one(window, empty.recv().ok()?);
                let is_filled = filled.is_ok();
                hand_over.send(filled).ok().filter(|()| is_filled)
            })
        };
        thread::Builder::new()
            .spawn_scoped(scope, fill_all)
            .map_err(|error| Error::Threads(OutOfThreadsError::of_one(&error)))?;
        for result in filled {
            let (window, rotations) = result?;
            let count = window.len();
            sink(Chunk::new(window, &rotations[..count], quantity))?;
            let _ = give_back.send(rotations); // fails after the last chunk
        }
        Ok(())
    })
}
