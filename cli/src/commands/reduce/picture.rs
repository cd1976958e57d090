//! How far a reduced motion is from its samples, over time.

use tumble_formats::reduce::Reduced;

use crate::batch::target::{Destination, WrittenFile};
use crate::commands::plot::draw;
use crate::commands::plot::figure::{
    Figure, Panel, PanelAxes, PlotAxis, PlotCurve, range_of, thinned,
};
use crate::messages::colours::BOXES;
use crate::messages::exit::Failure;

/// A curve is drawn with at most four points for each of this many columns.
const COLUMNS: usize = 2000;

/// Draws into a file, which ends in .svg or .png.
pub(super) fn draw(
    title: &str,
    reduced: &Reduced,
    destination: &Destination,
) -> Result<WrittenFile, Failure> {
    let panels = [
        ("largest angle of all joints", "degrees", 1f64.to_degrees()),
        ("largest distance of all joints", "units", 1.0),
    ];
    let panels = panels.into_iter().enumerate();
    let panels = panels.map(|(kind, (title, unit, factor))| {
        let values = reduced.errors.iter().map(|error| error[kind] * factor);
        let points: Vec<(f64, f64)> = reduced.times.iter().copied().zip(values).collect();
        let bound = reduced.bounds[kind] * factor;
        let axis = |label: &str, range| PlotAxis {
            label: label.to_owned(),
            range,
            powers: false,
        };
        let heights = points.iter().map(|point| point.1).chain([0.0, bound]);
        Panel {
            title: title.to_owned(),
            axes: PanelAxes::Plane {
                x: axis("time, s", range_of(points.iter().map(|point| point.0))),
                y: axis(unit, 0.0..range_of(heights).end),
            },
            curves: vec![PlotCurve {
                colour: BOXES[0],
                width: 1.6,
                opacity: 1.0,
                pieces: vec![thinned(&points, COLUMNS)],
            }],
            dots: Vec::new(),
            uprights: Vec::new(),
            level: Some(bound),
        }
    });
    let [before, after] = reduced.keys;
    let figure = Figure {
        title: format!("{title}: {before} → {after} keys"),
        subtitle: "how far the joints are from the samples, and the bounds".to_owned(),
        legend: Vec::new(),
        columns: 1,
        panels: panels.collect(),
    };
    draw::prepare(&figure, destination)
}
