//! The content of a picture (panels, axes, curves, marks), before anything is drawn.

use std::ops::Range;

use crate::messages::colours::{AXIS, Colour};

/// A grid of panels under a title and one legend.
#[derive(Debug, Clone)]
pub(crate) struct Figure {
    pub(crate) title: String,
    pub(crate) subtitle: String,
    pub(crate) legend: Vec<LegendEntry>,
    pub(crate) columns: usize,
    pub(crate) panels: Vec<Panel>,
}

/// A line of the legend.
#[derive(Debug, Clone)]
pub(crate) struct LegendEntry {
    pub(crate) label: String,
    pub(crate) colour: Colour,
    pub(crate) mark: Mark,
}

impl LegendEntry {
    /// The entry of the upright lines at keys, if panels have any.
    pub(crate) fn of_uprights(panels: &[Panel]) -> Option<Self> {
        let has_uprights = panels.iter().any(|panel| !panel.uprights.is_empty());
        has_uprights.then(|| Self {
            label: "key".to_owned(),
            colour: AXIS,
            mark: Mark::Upright,
        })
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Mark {
    Line,
    Dot,
    Dashes,
    /// An upright line, as those of [`Panel::uprights`].
    Upright,
}

/// One pair of axes, with the curves and marks between them.
#[derive(Debug, Clone)]
pub(crate) struct Panel {
    pub(crate) title: String,
    pub(crate) axes: PanelAxes,
    pub(crate) curves: Vec<PlotCurve>,
    pub(crate) dots: Vec<Dots>,
    /// The positions of the upright lines: the times of keys.
    pub(crate) uprights: Vec<f64>,
    /// The height of a dashed level line: a bound.
    pub(crate) level: Option<f64>,
}

impl Panel {
    /// Whether the curves of two colours cover each other: no two points of the same place in them are further apart than a
    /// line is wide. Only curves of as many points are compared.
    pub(crate) fn coincide(&self, colours: [Colour; 2]) -> bool {
        /// A line's width as a part of a panel's height, or of the radius of a ball.
        const LINE: f64 = 0.006;
        let height = match &self.axes {
            PanelAxes::Plane { y, .. } => y.range.end - y.range.start,
            PanelAxes::Sphere => 1.0,
        };
        let points = |colour: Colour| {
            let of_colour = self
                .curves
                .iter()
                .filter(move |curve| curve.colour == colour);
            of_colour.flat_map(|curve| curve.pieces.iter().flatten())
        };
        let [first, second] = colours.map(points);
        let is_near = |(one, other): (&(f64, f64), &(f64, f64))| {
            one.0 == other.0 && (one.1 - other.1).abs() <= LINE * height
        };
        first.clone().count() == second.clone().count() && first.zip(second).all(is_near)
    }
}

#[derive(Debug, Clone)]
pub(crate) enum PanelAxes {
    Plane {
        x: PlotAxis,
        y: PlotAxis,
    },
    /// A ball seen from afar, of radius 1 about the origin; depth is left out.
    Sphere,
}

#[derive(Debug, Clone)]
pub(crate) struct PlotAxis {
    pub(crate) label: String,
    pub(crate) range: Range<f64>,
    /// The values are powers of ten.
    pub(crate) powers: bool,
}

/// A line through points, in pieces where it is interrupted.
#[derive(Debug, Clone)]
pub(crate) struct PlotCurve {
    pub(crate) colour: Colour,
    pub(crate) width: f64,
    /// From 0, not there, to 1.
    pub(crate) opacity: f64,
    pub(crate) pieces: Vec<Vec<(f64, f64)>>,
}

#[derive(Debug, Clone)]
pub(crate) struct Dots {
    pub(crate) colour: Colour,
    pub(crate) opacity: f64,
    pub(crate) points: Vec<(f64, f64)>,
}

/// The range of an axis that shows all values, with a little room.
pub(crate) fn range_of(values: impl IntoIterator<Item = f64>) -> Range<f64> {
    let (low, high) = values
        .into_iter()
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        });
    if low > high {
        return 0.0..1.0;
    }
    if low == 0.0 && high == 0.0 {
        return -1.0..1.0;
    }
    // A constant curve gets a small range around its value, because the range must not be empty.
    let room = ((high - low) * 0.05).max(high.abs().max(1e-3) * 1e-3);
    low - room..high + room
}

/// An axis of times, and the time at which it shows 0 [s].
pub(crate) struct TimeAxis {
    pub(crate) axis: PlotAxis,
    pub(crate) origin: f64,
}

impl TimeAxis {
    /// Larger times, such as those since 1970, are drawn relative to a whole second, because their labels would
    /// overlap.
    const LONGEST: f64 = 1e5;

    /// The axis of the times from the first to the last, which count from the second `offset`, with a little room.
    pub(crate) fn of(first: f64, last: f64, offset: i64) -> Self {
        let is_long = first.abs().max(last.abs()) >= Self::LONGEST;
        let origin = if is_long { first.floor() } else { 0.0 };
        let from = offset as f64 + origin;
        let label = match from == 0.0 {
            true => "time, s".to_owned(),
            false => format!("time, s after {from:.0} s"),
        };
        let (low, high) = (first - origin, last - origin);
        let room = match high - low {
            span if span > 0.0 => span * 0.05,
            _ => 0.5,
        };
        Self {
            axis: PlotAxis {
                label,
                range: low - room..high + room,
                powers: false,
            },
            origin,
        }
    }
}

/// At most four points for each of `columns` columns, which look the same: the first, the
/// lowest, the highest and the last of each column.
pub(crate) fn thinned(points: &[(f64, f64)], columns: usize) -> Vec<(f64, f64)> {
    if points.len() <= 4 * columns {
        return points.to_vec();
    }
    let mut kept = Vec::with_capacity(4 * columns);
    for column in points.chunks(points.len().div_ceil(columns)) {
        let lowest = (0..column.len()).min_by(|&a, &b| column[a].1.total_cmp(&column[b].1));
        let highest = (0..column.len()).max_by(|&a, &b| column[a].1.total_cmp(&column[b].1));
        let mut indices = vec![
            0,
            lowest.unwrap_or(0),
            highest.unwrap_or(0),
            column.len() - 1,
        ];
        indices.sort_unstable();
        indices.dedup();
        kept.extend(indices.into_iter().map(|index| column[index]));
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_ends_and_extremes() {
        let mut points: Vec<(f64, f64)> = (0..10_000).map(|i| (f64::from(i), 0.0)).collect();
        points[1234].1 = 5.0;
        points[8765].1 = -5.0;
        let kept = thinned(&points, 100);
        assert!(kept.len() <= 400);
        assert!(
            [points[0], points[1234], points[8765], points[9999]]
                .iter()
                .all(|point| kept.contains(point))
        );
        assert!(kept.windows(2).all(|pair| pair[0].0 < pair[1].0));
        assert_eq!(thinned(&points[..50], 100), points[..50]);
    }

    #[test]
    fn a_range_shows_every_value_and_is_never_empty() {
        for values in [vec![], vec![0.0], vec![3.0, 3.0], vec![f64::NAN, -1.0, 2.0]] {
            let range = range_of(values.iter().copied());
            assert!(range.start < range.end, "{values:?}: {range:?}");
            let finite = values.iter().filter(|value| value.is_finite());
            assert!(finite.into_iter().all(|value| range.contains(value)));
        }
        assert_eq!(range_of([0.0, 0.0, -0.0]), -1.0..1.0);
    }

    /// Catches times that fill only a part of the axis, and labels of ten digits.
    #[test]
    fn times_fill_their_axis_whatever_they_count_from() {
        for (first, last, offset, label, origin, range) in [
            (0.0, 20.0, 0, "time, s", 0.0, -1.0..21.0),
            (-2.0, 8.0, 0, "time, s", 0.0, -2.5..8.5),
            (9000.0, 9002.0, 0, "time, s", 0.0, 8999.9..9002.1),
            (3.0, 3.0, 0, "time, s", 0.0, 2.5..3.5),
            (
                0.5,
                2.5,
                1_700_000_000,
                "time, s after 1700000000 s",
                0.0,
                0.4..2.6,
            ),
            (
                1_700_000_000.5,
                1_700_000_002.5,
                0,
                "time, s after 1700000000 s",
                1_700_000_000.0,
                0.4..2.6,
            ),
        ] {
            let TimeAxis { axis, origin: from } = TimeAxis::of(first, last, offset);
            assert_eq!((&*axis.label, from), (label, origin));
            let off = (axis.range.start - range.start).abs() + (axis.range.end - range.end).abs();
            assert!(off < 1e-6, "{first} to {last}: {:?}", axis.range);
        }
    }
}
