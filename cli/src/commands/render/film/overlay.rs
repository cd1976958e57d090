//! Names under the boxes, the same on every frame.

use std::io;

use crate::commands::picture;
use crate::messages::colours::Colour;

/// Letters over a picture: the coverage of each pixel by letters.
pub(crate) struct Labels {
    cover: Vec<u8>,
    ink: Colour,
}

/// The height of letters in a picture of this height, in pixels.
fn letters(height: u32) -> f32 {
    (height as f32 / 26.0).clamp(9.0, 40.0)
}

impl Labels {
    /// The part of a picture's height, at its bottom, that names take.
    pub(crate) fn share(height: u32) -> f32 {
        // The letters end one height above the bottom.
        (2.2 * letters(height) / height as f32).min(0.5)
    }

    /// Names, each centred at a position from 0, the left edge, to 1.
    pub(crate) fn new<'a>(
        names: impl Iterator<Item = (&'a str, f32)>,
        (width, height): (u32, u32),
        ink: Colour,
    ) -> io::Result<Self> {
        let size = letters(height);
        let text = |(name, position): (&str, f32)| {
            let (x, y) = (position * width as f32, height as f32 - size);
            format!("<text x=\"{x}\" y=\"{y}\">{name}</text>")
        };
        let texts: String = names.map(text).collect();
        let svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\">\
             <g font-family=\"sans-serif\" font-size=\"{size}\" text-anchor=\"middle\">{texts}</g></svg>"
        );
        let canvas = picture::rasterise(&svg, 1.0)?;
        let cover = canvas
            .data()
            .chunks_exact(4)
            .map(|pixel| pixel[3])
            .collect();
        Ok(Self { cover, ink })
    }

    pub(crate) fn put(&self, pixels: &mut [u8]) {
        let covered = pixels.chunks_exact_mut(3).zip(&self.cover);
        for (pixel, &cover) in covered.filter(|(_, cover)| **cover > 0) {
            for (channel, ink) in pixel.iter_mut().zip(self.ink) {
                let (ground, letter) = (u16::from(*channel), u16::from(ink));
                let cover = u16::from(cover);
                *channel = ((ground * (255 - cover) + letter * cover) / 255) as u8;
            }
        }
    }
}
