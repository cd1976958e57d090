//! Animated PNG: every colour, shown by every browser.

use std::io::{self, Write};

use crate::commands::render::film::{Patch, Picture, delays};

/// An animated PNG being written.
pub(crate) struct Apng<W: Write> {
    writer: png::Writer<W>,
    size: (u32, u32),
    delays: std::vec::IntoIter<u16>,
    before: Option<Vec<u8>>,
}

impl<W: Write> Apng<W> {
    /// Frames of that size, shown at those times.
    pub(crate) fn new(out: W, size: (u32, u32), times: &[f64]) -> io::Result<Self> {
        let mut encoder = png::Encoder::new(out, size.0, size.1);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder
            .set_animated(times.len() as u32, 0)
            .map_err(io::Error::other)?;
        let writer = encoder.write_header().map_err(io::Error::other)?;
        Ok(Self {
            writer,
            size,
            delays: delays(times, 1000.0, 1).into_iter(),
            before: None,
        })
    }

    pub(crate) fn finish(self) -> io::Result<()> {
        self.writer.finish().map_err(io::Error::other)
    }

    fn write(&mut self, patch: Patch, pixels: &[u8]) -> Result<(), png::EncodingError> {
        let writer = &mut self.writer;
        writer.set_frame_delay(self.delays.next().unwrap_or(1), 1000)?;
        if self.before.is_some() {
            // The first frame is always complete and needs no position. The position is reset first, because the
            // writer checks a new size at the position of the previous frame.
            writer.reset_frame_position()?;
            writer.set_frame_dimension(patch.width as u32, patch.height as u32)?;
            writer.set_frame_position(patch.left as u32, patch.top as u32)?;
        }
        let rows: Vec<u8> = patch
            .rows(pixels, self.size.0 as usize)
            .flatten()
            .copied()
            .collect();
        writer.write_image_data(&rows)
    }
}

impl<W: Write> Picture for Apng<W> {
    fn frame(&mut self, pixels: &[u8]) -> io::Result<()> {
        let patch = match &self.before {
            Some(before) => Patch::of(before, pixels, self.size.0 as usize),
            None => Patch::whole(self.size),
        };
        self.write(patch, pixels).map_err(io::Error::other)?;
        self.before = Some(pixels.to_vec());
        Ok(())
    }
}
