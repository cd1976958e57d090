//! Draws a figure as SVG or PNG.

use std::io::{self, Write};
use std::ops::Range;

use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::batch::target::{Destination, WrittenFile};
use crate::commands::picture;
use crate::commands::plot::figure::{Dots, Figure, LegendEntry, Mark, Panel, PanelAxes, PlotAxis};
use crate::messages::colours::{AXIS, Colour, GRID, INK, PALE};
use crate::messages::exit::Failure;

type Area<'a, DB> = DrawingArea<DB, Shift>;
type Chart<'a, DB> = ChartContext<'a, DB, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// The font in SVG, which selects a font of the reader's system; in PNG it is `DejaVu` Sans.
const FONT: &str = "sans-serif";
/// Pixels of PNG for one of SVG.
const PIXELS: u32 = 2;
/// Units of an SVG's drawing for one of its pixels: plotters knows whole ones only.
const FINER: u32 = 10;
const MARGIN: f64 = 16.0;

/// Draws into a file, which ends in .svg or .png and gets its name by [`WrittenFile::commit`].
pub(crate) fn prepare(figure: &Figure, destination: &Destination) -> Result<WrittenFile, Failure> {
    let name = destination.to_string();
    let extension = destination.path().extension().unwrap_or_default();
    let drawn = match extension.to_string_lossy().to_lowercase().as_str() {
        "svg" => svg(figure).map(String::into_bytes),
        "png" => png(figure),
        _ => {
            let message = format!("{name}: end the picture in .svg or .png");
            return Err(Failure::usage(message));
        }
    };
    let bytes = drawn.map_err(|error| Failure::writing(&name, &error))?;
    destination.prepare(None, |out| out.write_all(&bytes))
}

/// A figure as the text of an SVG file.
pub(crate) fn svg(figure: &Figure) -> io::Result<String> {
    let styles = [
        (FontStyle::Normal, dejavu::sans::regular()),
        (FontStyle::Bold, dejavu::sans::bold()),
    ];
    // Registering the fonts again for each plot does no harm.
    for (style, font) in styles {
        plotters::style::register_font(FONT, style, font)
            .map_err(|_| io::Error::other("the font built in cannot be read"))?;
    }
    let (width, height) = size(figure);
    let (fine_width, fine_height) = (width * FINER, height * FINER);
    let mut text = String::new();
    let canvas = SVGBackend::with_string(&mut text, (fine_width, fine_height)).into_drawing_area();
    let brush = Brush {
        scale: FINER.into(),
    };
    brush
        .figure(&canvas, figure)
        .and_then(|()| canvas.present())
        .map_err(|error| io::Error::other(error.to_string()))?;
    drop(canvas);
    let fine = format!("<svg width=\"{fine_width}\" height=\"{fine_height}\"");
    Ok(text.replacen(
        &fine,
        // Mitred joins would extend beyond the corners of curves.
        &format!("<svg width=\"{width}\" height=\"{height}\" stroke-linejoin=\"round\""),
        1,
    ))
}

/// A figure as the bytes of a PNG file.
pub(crate) fn png(figure: &Figure) -> io::Result<Vec<u8>> {
    let canvas = picture::rasterise(&svg(figure)?, PIXELS as f32)?;
    let mut bytes = Vec::new();
    // The background is white, so that no pixel is transparent.
    let pixels = picture::opaque(&canvas);
    picture::png(&mut bytes, canvas.width(), canvas.height(), &pixels)?;
    Ok(bytes)
}

/// Width and height in the pixels of SVG.
fn size(figure: &Figure) -> (u32, u32) {
    let (columns, rows) = grid(figure);
    let sphere = figure
        .panels
        .iter()
        .any(|panel| matches!(panel.axes, PanelAxes::Sphere));
    let (width, height) = match (columns, sphere) {
        (1, false) => (800, if rows == 1 { 380 } else { 240 }),
        (1, true) => (640, 600),
        (_, true) => (400, 400),
        (2, false) => (560, 260),
        _ => (400, 220),
    };
    let width = columns * width;
    let lines = legend_lines(figure, width as f64);
    (
        width as u32,
        (header(lines) as usize + rows * height + 8) as u32,
    )
}

fn grid(figure: &Figure) -> (usize, usize) {
    let columns = figure.columns.max(1);
    (columns, figure.panels.len().div_ceil(columns).max(1))
}

/// Height of title, subtitle and legend.
fn header(legend_lines: usize) -> f64 {
    62.0 + 22.0 * legend_lines as f64
}

/// The height of the letters of a panel's title, where it has room for them.
const PANEL_TITLE: f64 = 13.0;
const LEGEND_MARK: f64 = 26.0;
const LEGEND_TEXT: f64 = 13.0;
const LEGEND_GAP: f64 = 22.0;

/// How wide an entry of the legend is, with the gap after it.
fn entry_width(entry: &LegendEntry) -> f64 {
    LEGEND_MARK + 6.0 + text_width(&entry.label, FontStyle::Normal) * LEGEND_TEXT + LEGEND_GAP
}

/// How wide a text is, for a letter height of 1.
fn text_width(text: &str, style: FontStyle) -> f64 {
    let font = FontDesc::new(FontFamily::SansSerif, 100.0, style);
    let size = font.box_size(text);
    size.map_or(0.0, |(width, _)| f64::from(width) / 100.0)
}

/// A text that is no wider than `width`, in the pixels of SVG, and the height of its letters: up to `largest`, and no
/// less than can be read. The beginning of a text that is too long for that is left out, because the end tells similar
/// names apart.
fn fitted(text: &str, style: FontStyle, largest: f64, width: f64) -> (String, f64) {
    /// Smaller letters cannot be read.
    const SMALLEST: f64 = 8.0;
    let height = |text: &str| largest.min(width / text_width(text, style).max(1.0));
    let count = text.chars().count();
    // No font has letters that are narrower on average than a fifth of their height.
    let mut dropped = count.saturating_sub((5.0 * width / SMALLEST) as usize);
    loop {
        let kept = match dropped {
            0 => text.to_owned(),
            _ => format!("…{}", text.chars().skip(dropped).collect::<String>()),
        };
        let height = height(&kept);
        if height >= SMALLEST || dropped == count {
            return (kept, height);
        }
        dropped += 1;
    }
}

fn legend_lines(figure: &Figure, width: f64) -> usize {
    legend_positions(figure, width)
        .last()
        .map_or(0, |&(_, line)| line + 1)
}

/// The position of each entry of the legend: its distance from the left, and its line.
fn legend_positions(figure: &Figure, width: f64) -> Vec<(f64, usize)> {
    let (mut left, mut line) = (MARGIN, 0);
    let position_of = |entry: &LegendEntry| {
        let needed = entry_width(entry);
        if left + needed > width && left > MARGIN {
            (left, line) = (MARGIN, line + 1);
        }
        let position = (left, line);
        left += needed;
        position
    };
    figure.legend.iter().map(position_of).collect()
}

fn rgb([r, g, b]: Colour) -> RGBColor {
    RGBColor(r, g, b)
}

/// Draws at a scale: lines and letters grow with the picture.
struct Brush {
    scale: f64,
}

impl Brush {
    fn px(&self, length: f64) -> i32 {
        (length * self.scale).round() as i32
    }

    fn line(&self, colour: Colour, width: f64) -> ShapeStyle {
        ShapeStyle {
            color: rgb(colour).to_rgba(),
            filled: false,
            stroke_width: self.px(width).max(1) as u32,
        }
    }

    fn text(&self, size: f64, style: FontStyle, colour: Colour) -> TextStyle<'static> {
        let font = FontDesc::new(FontFamily::SansSerif, size * self.scale, style);
        font.color(&rgb(colour))
    }

    /// A panel's title, and its letters: no wider than the panel.
    fn title<DB: DrawingBackend>(
        &self,
        title: &str,
        area: &Area<'_, DB>,
    ) -> (String, TextStyle<'static>) {
        let (width, _) = area.dim_in_pixel();
        let room = f64::from(width) / self.scale - MARGIN;
        let (title, height) = fitted(title, FontStyle::Bold, PANEL_TITLE, room);
        (title, self.text(height, FontStyle::Bold, INK))
    }

    fn figure<DB: DrawingBackend>(
        &self,
        canvas: &Area<'_, DB>,
        figure: &Figure,
    ) -> Result<(), DrawingAreaErrorKind<DB::ErrorType>> {
        canvas.fill(&WHITE)?;
        let left = self.px(MARGIN);
        let (width, height) = canvas.dim_in_pixel();
        let nominal = f64::from(width) / self.scale;
        for (text, style, largest, colour, top) in [
            (&figure.title, FontStyle::Bold, 18.0, INK, 12.0),
            (&figure.subtitle, FontStyle::Normal, 12.0, PALE, 34.0),
        ] {
            let (text, size) = fitted(text, style, largest, nominal - 2.0 * MARGIN);
            let style = self.text(size, style, colour);
            canvas.draw_text(&text, &style, (left, self.px(top)))?;
        }
        for (entry, (left, line)) in figure.legend.iter().zip(legend_positions(figure, nominal)) {
            self.entry(canvas, entry, left, 70.0 + 22.0 * line as f64)?;
        }
        let top = self.px(header(legend_lines(figure, nominal)));
        let body = canvas
            .clone()
            .shrink((0, top), (width as i32, height as i32 - top - self.px(8.0)));
        let (columns, rows) = grid(figure);
        let areas = body.split_evenly((rows, columns));
        for (panel, area) in figure.panels.iter().zip(&areas) {
            match &panel.axes {
                PanelAxes::Plane { x, y } => self.plane(area, panel, x, y)?,
                PanelAxes::Sphere => self.sphere(area, panel)?,
            }
        }
        Ok(())
    }

    /// One entry of the legend, its middle at that height.
    fn entry<DB: DrawingBackend>(
        &self,
        canvas: &Area<'_, DB>,
        entry: &LegendEntry,
        left: f64,
        height: f64,
    ) -> Result<(), DrawingAreaErrorKind<DB::ErrorType>> {
        let at = |x: f64| (self.px(left + x), self.px(height));
        match entry.mark {
            Mark::Line => {
                let line = vec![at(0.0), at(LEGEND_MARK)];
                canvas.draw(&PathElement::new(line, self.line(entry.colour, 2.5)))?;
            }
            Mark::Dashes => {
                for start in [0.0, 10.0, 20.0] {
                    let dash = vec![at(start), at(start + 6.0)];
                    canvas.draw(&PathElement::new(dash, self.line(entry.colour, 1.5)))?;
                }
            }
            Mark::Upright => {
                let ends =
                    [-7.0, 7.0].map(|y| (self.px(left + LEGEND_MARK / 2.0), self.px(height + y)));
                canvas.draw(&PathElement::new(
                    ends.to_vec(),
                    self.line(entry.colour, 1.0),
                ))?;
            }
            Mark::Dot => {
                let dot = rgb(entry.colour).filled();
                canvas.draw(&Circle::new(at(LEGEND_MARK / 2.0), self.px(3.5), dot))?;
            }
        }
        let style = self
            .text(LEGEND_TEXT, FontStyle::Normal, INK)
            .pos(Pos::new(HPos::Left, VPos::Center));
        canvas.draw_text(&entry.label, &style, at(LEGEND_MARK + 6.0))
    }

    fn plane<DB: DrawingBackend>(
        &self,
        area: &Area<'_, DB>,
        panel: &Panel,
        x: &PlotAxis,
        y: &PlotAxis,
    ) -> Result<(), DrawingAreaErrorKind<DB::ErrorType>> {
        let (title, style) = self.title(&panel.title, area);
        let mut chart = ChartBuilder::on(area)
            .caption(title, style)
            .margin(self.px(6.0))
            .margin_right(self.px(14.0))
            .x_label_area_size(self.px(34.0))
            .y_label_area_size(self.px(52.0))
            .build_cartesian_2d(x.range.clone(), y.range.clone())?;
        let (width, height) = chart.plotting_area().dim_in_pixel();
        let ticks = match y.powers {
            true => (y.range.end - y.range.start) as usize + 1,
            false => 0,
        };
        let fitting = |pixels: u32, each: f64| (f64::from(pixels) / self.scale / each) as usize;
        chart
            .configure_mesh()
            .axis_style(self.line(AXIS, 1.0))
            .bold_line_style(self.line(GRID, 1.0))
            .light_line_style(TRANSPARENT)
            .label_style(self.text(11.0, FontStyle::Normal, PALE))
            .axis_desc_style(self.text(12.0, FontStyle::Normal, PALE))
            .x_labels(fitting(width, 60.0).max(2))
            .y_labels(ticks.max(fitting(height, 28.0).max(3)))
            .x_label_formatter(&|value| label(x, *value))
            .y_label_formatter(&|value| label(y, *value))
            .x_desc(&*x.label)
            .y_desc(&*y.label)
            .draw()?;
        for &position in &panel.uprights {
            let line = vec![(position, y.range.start), (position, y.range.end)];
            chart.draw_series([PathElement::new(line, self.line(AXIS, 0.5))])?;
        }
        if let Some(level) = panel.level {
            let line = [(x.range.start, level), (x.range.end, level)];
            let dashes = (self.px(6.0), self.px(4.0));
            let style = self.line(INK, 1.5);
            chart.draw_series(DashedLineSeries::new(line, dashes.0, dashes.1, style))?;
        }
        self.contents(&mut chart, panel)
    }

    /// Curves, and dots over them; smaller ones below them where dots would cover the curves.
    fn contents<DB: DrawingBackend>(
        &self,
        chart: &mut Chart<'_, DB>,
        panel: &Panel,
    ) -> Result<(), DrawingAreaErrorKind<DB::ErrorType>> {
        let width = f64::from(chart.plotting_area().dim_in_pixel().0) / self.scale;
        let (close, apart): (Vec<_>, Vec<_>) = panel
            .dots
            .iter()
            .partition(|dots| width / (dots.points.len() as f64) < CLOSE_DOTS);
        self.dots(chart, &close, 1.5)?;
        for curve in &panel.curves {
            let mut style = self.line(curve.colour, curve.width);
            style.color = style.color.mix(curve.opacity);
            for piece in &curve.pieces {
                chart.draw_series([PathElement::new(piece.clone(), style)])?;
            }
        }
        self.dots(chart, &apart, 3.0)
    }

    fn dots<DB: DrawingBackend>(
        &self,
        chart: &mut Chart<'_, DB>,
        all: &[&Dots],
        radius: f64,
    ) -> Result<(), DrawingAreaErrorKind<DB::ErrorType>> {
        for dots in all {
            let style = rgb(dots.colour).mix(dots.opacity).filled();
            let dot = |&point: &(f64, f64)| Circle::new(point, self.px(radius), style);
            chart.draw_series(dots.points.iter().map(dot))?;
        }
        Ok(())
    }

    fn sphere<DB: DrawingBackend>(
        &self,
        area: &Area<'_, DB>,
        panel: &Panel,
    ) -> Result<(), DrawingAreaErrorKind<DB::ErrorType>> {
        let (width, height) = area.dim_in_pixel();
        // Reserve some of the height for the title.
        let room = f64::from(self.px(24.0));
        let aspect = f64::from(width) / (f64::from(height) - room).max(1.0);
        let (x, y) = (1.1 * aspect.max(1.0), 1.1 * (1.0 / aspect).max(1.0));
        let (title, style) = self.title(&panel.title, area);
        let mut chart = ChartBuilder::on(area)
            .caption(title, style)
            .build_cartesian_2d(-x..x, -y..y)?;
        self.contents(&mut chart, panel)
    }
}

/// The label of a tick, without unnecessary digits. On an axis of powers of ten only whole powers have labels. If all
/// values are small, labels have an exponent.
fn label(axis: &PlotAxis, value: f64) -> String {
    if axis.powers {
        let whole = (value - value.round()).abs() < 1e-6;
        return if whole {
            format!("1e{value:.0}")
        } else {
            String::new()
        };
    }
    let trimmed = |text: &str| text.trim_end_matches('0').trim_end_matches('.').to_owned();
    let Range { start, end } = axis.range;
    let (largest, width) = (start.abs().max(end.abs()), end - start);
    if value.abs() < 1e-6 * width {
        return "0".to_owned();
    }
    if largest < SMALL {
        let text = format!("{value:.2e}");
        let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
        return format!("{}e{power}", trimmed(digits));
    }
    // Enough decimals to distinguish neighbouring ticks.
    let decimals = (2.0 - width.log10()).clamp(4.0, 15.0) as usize;
    trimmed(&format!("{value:.decimals$}"))
}

/// If dots are nearer to each other than this, in pixels, they would cover the whole curve.
const CLOSE_DOTS: f64 = 10.0;

/// An axis whose values are all smaller has labels with exponents.
const SMALL: f64 = 0.005;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_tell_neighbours_apart_in_few_letters() {
        for (range, values, expected) in [
            (-1.0..1.0, [-0.5, -1e-17, 0.5], ["-0.5", "0", "0.5"]),
            (0.0..20.0, [0.0, 10.0, 12.5], ["0", "10", "12.5"]),
            (
                0.0..1e-6,
                [0.0, 2e-7, 0.3e-6 + 1e-22],
                ["0", "2e-7", "3e-7"],
            ),
            (-1e-3..1e-3, [-5e-4, 0.0, 2.5e-4], ["-5e-4", "0", "2.5e-4"]),
            (
                0.49995..0.50005,
                [0.49996, 0.5, 0.50004],
                ["0.49996", "0.5", "0.50004"],
            ),
            (
                1e4..1.0001e4,
                [10_000.0, 10_000.2, 10_000.4],
                ["10000", "10000.2", "10000.4"],
            ),
        ] {
            let axis = PlotAxis {
                label: String::new(),
                range: range.clone(),
                powers: false,
            };
            assert_eq!(
                values.map(|value| label(&axis, value)),
                expected,
                "{range:?}"
            );
        }
    }

    /// Catches a title that reaches into the next panel, or out of the picture.
    #[test]
    fn a_long_title_is_written_smaller_and_then_without_its_beginning() {
        plotters::style::register_font(FONT, FontStyle::Bold, dejavu::sans::bold())
            .map_err(|_| "the font is refused")
            .unwrap();
        let fitted = |title: &str| fitted(title, FontStyle::Bold, PANEL_TITLE, 384.0);
        let short = "hips: dimensions 1 to 4";
        assert_eq!(fitted(short), (short.to_owned(), PANEL_TITLE));
        for (letters, is_whole) in [(28, true), (60, false), (100_000, false)] {
            let long = format!("{}: dimensions 121 to 124", "M".repeat(letters));
            let (shown, height) = fitted(&long);
            assert!((8.0..PANEL_TITLE).contains(&height), "{height}");
            assert!(height * text_width(&shown, FontStyle::Bold) <= 384.0 + 1e-9);
            assert_eq!(shown == long, is_whole, "{shown}");
            assert_eq!(shown.starts_with("…M"), !is_whole, "{shown}");
            assert!(shown.ends_with("M: dimensions 121 to 124"), "{shown}");
        }
    }
}
