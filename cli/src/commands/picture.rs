//! Pictures as pixels: red, green and blue in a byte each, row by row from the top.

use std::fmt::Write as _;
use std::io::{self, Write};

use ab_glyph::{Font as _, FontRef, GlyphId, OutlineCurve, Point};
use resvg::{tiny_skia, usvg};

/// Writes a PNG file.
pub(crate) fn png(out: impl Write, width: u32, height: u32, pixels: &[u8]) -> io::Result<()> {
    let mut encoder = png::Encoder::new(out, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().map_err(io::Error::other)?;
    writer.write_image_data(pixels).map_err(io::Error::other)?;
    writer.finish().map_err(io::Error::other)
}

/// An SVG as pixels, `scale` for one of its units. Its letters are `DejaVu` Sans.
pub(crate) fn rasterise(svg: &str, scale: f32) -> io::Result<tiny_skia::Pixmap> {
    let svg = with_letters_as_outlines(svg)?;
    let tree = usvg::Tree::from_str(&svg, &usvg::Options::default()).map_err(io::Error::other)?;
    let [width, height] =
        [tree.size().width(), tree.size().height()].map(|side| (side * scale).round() as u32);
    let mut pixels = tiny_skia::Pixmap::new(width, height)
        .ok_or_else(|| io::Error::other(format!("a picture of {width} × {height} pixels")))?;
    let transform = tiny_skia::Transform::from_scale(scale, scale);
    resvg::render(&tree, transform, &mut pixels.as_mut());
    Ok(pixels)
}

/// Red, green and blue of an opaque picture.
pub(crate) fn opaque(pixels: &tiny_skia::Pixmap) -> Vec<u8> {
    let pixels = pixels.data().chunks_exact(4);
    pixels.flat_map(|pixel| &pixel[..3]).copied().collect()
}

/// Replaces each `<text>` by the outlines of its letters. The pictures drawn here have one line of text an
/// element, from left to right: a library that shapes text takes a tenth of the time in which the
/// whole program is compiled.
fn with_letters_as_outlines(svg: &str) -> io::Result<String> {
    let document = roxmltree::Document::parse(svg).map_err(io::Error::other)?;
    let mut result = String::with_capacity(svg.len());
    let mut copied = 0;
    for node in document.descendants().filter(|n| n.has_tag_name("text")) {
        let range = node.range();
        result += &svg[copied..range.start];
        copied = range.end;
        let attribute = |name| node.ancestors().find_map(|element| element.attribute(name));
        let number = |name| attribute(name).and_then(|text| text.parse::<f32>().ok());
        let size = number("font-size").unwrap_or(12.0);
        let font = match attribute("font-weight") {
            Some("bold") => dejavu::sans::bold(),
            _ => dejavu::sans::regular(),
        };
        let font = FontRef::try_from_slice(font).map_err(io::Error::other)?;
        let scale = size / font.units_per_em().unwrap_or(2048.0);
        let down = match attribute("dy") {
            Some(dy) if dy.ends_with("em") => dy[..dy.len() - 2].parse().unwrap_or(0.0) * size,
            Some(dy) if dy.ends_with("ex") => {
                dy[..dy.len() - 2].parse().unwrap_or(0.0) * size * X_HEIGHT
            }
            Some(dy) => dy.parse().unwrap_or(0.0),
            None => 0.0,
        };
        let text = node.text().unwrap_or_default().trim();
        let width = advance(&font, text) * scale;
        let start = match attribute("text-anchor") {
            Some("middle") => -width / 2.0,
            Some("end") => -width,
            _ => 0.0,
        };
        let [x, y] = ["x", "y"].map(|name| number(name).unwrap_or(0.0));
        let path = outlines(&font, text, scale, [x + start, y + down]);
        result += "<path";
        for name in ["fill", "opacity", "transform"] {
            // Attributes of the parent element are inherited unchanged.
            if let Some(value) = node.attribute(name) {
                let _ = write!(result, " {name}=\"{value}\"");
            }
        }
        let _ = write!(result, " d=\"{path}\"/>");
    }
    result += &svg[copied..];
    Ok(result)
}

/// The height of a small x in `DejaVu` Sans, for a letter height of 1.
const X_HEIGHT: f32 = 1120.0 / 2048.0;

/// Each letter of a text with where it begins, in the font's units, and where the text ends.
fn letters(font: &FontRef<'_>, text: &str) -> (Vec<(GlyphId, f32)>, f32) {
    let mut end = 0.0;
    let mut before = None;
    let letters = text.chars().map(|letter| {
        let glyph = font.glyph_id(letter);
        end += before.map_or(0.0, |before| font.kern_unscaled(before, glyph));
        before = Some(glyph);
        let start = end;
        end += font.h_advance_unscaled(glyph);
        (glyph, start)
    });
    (letters.collect(), end)
}

fn advance(font: &FontRef<'_>, text: &str) -> f32 {
    letters(font, text).1
}

/// The outlines of a text that begins at a point of its base line, as an SVG path.
fn outlines(font: &FontRef<'_>, text: &str, scale: f32, [x, y]: [f32; 2]) -> String {
    let mut path = String::new();
    for (glyph, start) in letters(font, text).0 {
        let at = |point: Point| {
            let x = x + (start + point.x) * scale;
            format!("{x:.3} {:.3}", y - point.y * scale)
        };
        let mut end = None;
        for curve in font
            .outline(glyph)
            .map(|outline| outline.curves)
            .unwrap_or_default()
        {
            let (OutlineCurve::Line(first, last)
            | OutlineCurve::Quad(first, _, last)
            | OutlineCurve::Cubic(first, _, _, last)) = curve;
            if end != Some(first) {
                let _ = write!(path, "M{}", at(first));
            }
            end = Some(last);
            let _ = match curve {
                OutlineCurve::Line(..) => write!(path, "L{}", at(last)),
                OutlineCurve::Quad(_, by, _) => write!(path, "Q{} {}", at(by), at(last)),
                OutlineCurve::Cubic(_, by, then, _) => {
                    write!(path, "C{} {} {}", at(by), at(then), at(last))
                }
            };
        }
    }
    path
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
    /// Letters lie where the text says: as wide as the font says, about an anchor, and turned with it.
    #[test]
    fn letters_are_drawn_where_their_text_is() {
        let drawn = |attributes: &str| {
            let svg = format!(
                "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"200\" height=\"200\">\
                 <g font-size=\"40\"><text {attributes}>HH</text></g></svg>"
            );
            let pixels = super::rasterise(&svg, 1.0).unwrap();
            let inked = |i: &usize| pixels.data()[4 * i + 3] > 128;
            let all: Vec<usize> = (0..200 * 200).filter(inked).collect();
            let range = |of: fn(usize) -> usize| {
                let all = all.iter().map(|&i| of(i));
                (all.clone().min().unwrap(), all.max().unwrap())
            };
            (range(|i| i % 200), range(|i| i / 200))
        };
        // In a font of height 40, the letter H takes a width of 30.1. Its stems reach from 3.9 to 26.2, and it is 29.2
        // high.
        assert_eq!(drawn("x=\"100\" y=\"100\""), ((104, 155), (71, 99)));
        let middle = drawn("x=\"100\" y=\"100\" text-anchor=\"middle\"");
        assert_eq!(middle, ((74, 125), (71, 99)));
        let (_, lower) = drawn("x=\"100\" y=\"100\" dy=\"0.5em\"");
        assert_eq!(lower, (91, 119));
        let upright = drawn("x=\"100\" y=\"100\" transform=\"rotate(270, 100, 100)\"");
        assert_eq!(upright, ((71, 99), (44, 95)));
    }

    #[test]
    fn halving_takes_the_mean_of_four() {
        let rows = [[0, 10, 20, 4, 10, 22], [8, 10, 20, 12, 10, 22]].concat();
        assert_eq!(super::halved(&rows, 2), [6, 10, 21]);
    }
}
