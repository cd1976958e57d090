//! Pictures as pixels: red, green and blue in a byte each, row by row from the top.

use std::io::{self, Write};

use resvg::usvg;

/// Writes a PNG file.
pub(crate) fn png(out: impl Write, width: u32, height: u32, pixels: &[u8]) -> io::Result<()> {
    let mut encoder = png::Encoder::new(out, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().map_err(io::Error::other)?;
    writer.write_image_data(pixels).map_err(io::Error::other)?;
    writer.finish().map_err(io::Error::other)
}

/// How SVG becomes pixels: its letters are `DejaVu` Sans.
pub(crate) fn svg_options() -> usvg::Options<'static> {
    let mut options = usvg::Options::default();
    let fonts = options.fontdb_mut();
    fonts.load_font_data(dejavu::sans::regular().to_vec());
    fonts.load_font_data(dejavu::sans::bold().to_vec());
    fonts.set_sans_serif_family("DejaVu Sans");
    options
}

/// A picture of half the width and height: each pixel is the mean of four. The width and
/// the height are even.
pub(crate) fn halved(pixels: &[u8], width: usize) -> Vec<u8> {
    let mut half = Vec::with_capacity(pixels.len() / 4);
    for rows in pixels.chunks_exact(2 * width * 3) {
        let (upper, lower) = rows.split_at(width * 3);
        for (above, below) in upper.chunks_exact(6).zip(lower.chunks_exact(6)) {
            half.extend((0..3).map(|channel| {
                let of = |pair: &[u8]| u16::from(pair[channel]) + u16::from(pair[channel + 3]);
                ((of(above) + of(below) + 2) / 4) as u8
            }));
        }
    }
    half
}

#[cfg(test)]
mod tests {
    #[test]
    fn halving_takes_the_mean_of_four() {
        let rows = [[0, 10, 20, 4, 10, 22], [8, 10, 20, 12, 10, 22]].concat();
        assert_eq!(super::halved(&rows, 2), [6, 10, 21]);
    }
}
