//! GIF: 255 colours for the whole film, and a transparent one, through which the frame before is
//! visible.

use std::io::{self, Write};

use color_quant::NeuQuant;
use gif::{DisposalMethod, Encoder, Frame, Repeat};

use crate::commands::render::film::{Patch, Picture, delays};

/// The index of the palette for pixels that have not changed.
const UNCHANGED: u8 = 255;
/// The number of upper bits of each channel by which the palette's colour for a pixel is looked up.
const BITS: u32 = 6;

/// A GIF being written.
pub(crate) struct Gif<W: Write> {
    encoder: Encoder<W>,
    width: usize,
    size: (u32, u32),
    delays: std::vec::IntoIter<u16>,
    /// For the upper bits of a colour ([`BITS`] of each channel), the index of the palette's nearest colour.
    nearest: Vec<u8>,
    before: Option<Vec<u8>>,
}

impl<W: Write> Gif<W> {
    /// A film of frames of this size, which are shown at these times. The palette suits the pixels of `sample`. No
    /// frame is shown for less than a fiftieth of a second, because browsers would show it longer.
    pub(crate) fn new(
        out: W,
        size: (u32, u32),
        times: &[f64],
        sample: Vec<u8>,
    ) -> io::Result<Self> {
        let with_alpha = |pixel: &[u8]| [pixel[0], pixel[1], pixel[2], 255];
        let sample: Vec<u8> = sample.chunks_exact(3).flat_map(with_alpha).collect();
        let palette = NeuQuant::new(10, UNCHANGED.into(), &sample);
        let channel = |cell: u32, shift: u32| {
            let value = (cell >> shift) & ((1 << BITS) - 1);
            ((value * 255) / ((1 << BITS) - 1)) as u8
        };
        let nearest = (0..1 << (3 * BITS)).map(|cell| {
            let colour = [2 * BITS, BITS, 0].map(|shift| channel(cell, shift));
            palette.index_of(&with_alpha(&colour)) as u8
        });
        let (width, height) = (size.0 as u16, size.1 as u16);
        let mut encoder =
            Encoder::new(out, width, height, &palette.color_map_rgb()).map_err(io::Error::other)?;
        encoder
            .set_repeat(Repeat::Infinite)
            .map_err(io::Error::other)?;
        Ok(Self {
            encoder,
            width: size.0 as usize,
            size,
            delays: delays(times, 100.0, 2).into_iter(),
            nearest: nearest.collect(),
            before: None,
        })
    }

    fn index(&self, pixel: &[u8]) -> u8 {
        let cell = pixel.iter().fold(0usize, |cell, &channel| {
            (cell << BITS) | usize::from(channel >> (8 - BITS))
        });
        self.nearest[cell]
    }
}

impl<W: Write> Picture for Gif<W> {
    fn frame(&mut self, pixels: &[u8]) -> io::Result<()> {
        let patch = match &self.before {
            Some(before) => Patch::of(before, pixels, self.width),
            None => Patch::whole(self.size),
        };
        let now = patch
            .rows(pixels, self.width)
            .flat_map(|row| row.chunks_exact(3));
        let indices: Vec<u8> = match &self.before {
            None => now.map(|pixel| self.index(pixel)).collect(),
            Some(before) => {
                let old = patch
                    .rows(before, self.width)
                    .flat_map(|row| row.chunks_exact(3));
                now.zip(old)
                    .map(|(now, old)| {
                        if now == old {
                            UNCHANGED
                        } else {
                            self.index(now)
                        }
                    })
                    .collect()
            }
        };
        let frame = Frame {
            delay: self.delays.next().unwrap_or(2),
            dispose: DisposalMethod::Keep,
            transparent: Some(UNCHANGED),
            left: patch.left as u16,
            top: patch.top as u16,
            width: patch.width as u16,
            height: patch.height as u16,
            buffer: indices.into(),
            ..Frame::default()
        };
        self.encoder.write_frame(&frame).map_err(io::Error::other)?;
        self.before = Some(pixels.to_vec());
        Ok(())
    }
}
