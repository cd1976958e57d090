//! A picture of samples before and after smoothing: the angular velocity and the velocity of the joint that had the
//! most noise.

use glam::{Quat, Vec3};
use tumble_formats::sample::Samples;

use crate::batch::target::{Destination, WrittenFile};
use crate::commands::plot::draw;
use crate::commands::plot::figure::{
    Figure, LegendEntry, Mark, Panel, PanelAxes, PlotAxis, PlotCurve, range_of, thinned,
};
use crate::commands::travel::Travel;
use crate::messages::colours::{AXIS, BOXES, Colour};
use crate::messages::exit::Failure;

/// Before and after.
const COLOURS: [Colour; 2] = [AXIS, BOXES[0]];
const WIDTHS: [f64; 2] = [1.0, 2.2];
/// A curve is drawn with at most four points for each of this many columns.
const COLUMNS: usize = 2000;

/// The data of the picture: the rotations of one clip before and after smoothing.
pub(super) struct SmoothingSubject<'a> {
    pub(super) title: String,
    /// The kernel, and how often it is applied.
    pub(super) about: String,
    /// The names of the joints.
    pub(super) names: &'a [String],
    pub(super) before: &'a Samples,
    pub(super) after: &'a Samples,
}

/// Draws into a file, which ends in .svg or .png.
pub(super) fn draw(
    subject: &SmoothingSubject<'_>,
    destination: &Destination,
) -> Result<WrittenFile, Failure> {
    draw::prepare(&figure(subject), destination)
}

fn figure(subject: &SmoothingSubject<'_>) -> Figure {
    let tracks = subject.names.len();
    let samples = [subject.before, subject.after];
    let travels = samples.map(|source| Travel {
        name: String::new(),
        times: source.times.clone(),
        tracks,
        rotations: source.rotations.clone(),
        positions: source.translations.clone(),
    });
    let turning = |travel: &Travel, track: usize| -> Vec<f64> {
        let velocities = travel.velocities();
        let of_track = velocities.iter().skip(track).step_by(tracks);
        of_track
            .map(|velocity| f64::from(velocity.truncate().length()))
            .collect()
    };
    let moving = |travel: &Travel, track: usize| -> Vec<f64> {
        let positions: Vec<Vec3> = travel.line(track).collect();
        let steps = positions.windows(2).zip(travel.times.windows(2));
        steps
            .map(|(pair, times)| f64::from((pair[1] - pair[0]).length()) / (times[1] - times[0]))
            .collect()
    };
    let mut panels = Vec::new();
    let [before, after] = &samples;
    let angles = |a: &Quat, b: &Quat| f64::from(1.0 - a.dot(*b).abs());
    if let Some(track) = noisiest(&before.rotations, &after.rotations, tracks, angles) {
        let title = format!("{}: angular speed", subject.names[track]);
        panels.push(panel(title, "rad/s", &travels, |travel| {
            turning(travel, track)
        }));
    }
    let distances = |a: &Vec3, b: &Vec3| f64::from(a.distance_squared(*b));
    if let Some(track) = noisiest(&before.translations, &after.translations, tracks, distances) {
        let title = format!("{}: speed", subject.names[track]);
        panels.push(panel(title, "units/s", &travels, |travel| {
            moving(travel, track)
        }));
    }
    let entry = |(label, colour): (&str, Colour)| LegendEntry {
        label: label.to_owned(),
        colour,
        mark: Mark::Line,
    };
    Figure {
        title: format!("{}: before and after smoothing", subject.title),
        subtitle: subject.about.clone(),
        legend: ["before", "after"]
            .into_iter()
            .zip(COLOURS)
            .map(entry)
            .collect(),
        columns: 1,
        panels,
    }
}

/// The track whose samples smoothing has changed most; `None` if nothing changed.
fn noisiest<T>(
    before: &[T],
    after: &[T],
    tracks: usize,
    change: impl Fn(&T, &T) -> f64,
) -> Option<usize> {
    let mut changes = vec![0.0; tracks];
    for (index, (a, b)) in before.iter().zip(after).enumerate() {
        changes[index % tracks] += change(a, b);
    }
    let track = (0..tracks).max_by(|&a, &b| changes[a].total_cmp(&changes[b]))?;
    (changes[track] > 0.0).then_some(track)
}

fn panel(
    title: String,
    unit: &str,
    travels: &[Travel; 2],
    values: impl Fn(&Travel) -> Vec<f64>,
) -> Panel {
    let curves = travels
        .iter()
        .zip(COLOURS)
        .zip(WIDTHS)
        .map(|((travel, colour), width)| {
            let points = travel.times.iter().copied().zip(values(travel));
            PlotCurve {
                colour,
                width,
                opacity: 1.0,
                pieces: vec![thinned(&points.collect::<Vec<_>>(), COLUMNS)],
            }
        });
    let curves: Vec<PlotCurve> = curves.collect();
    let all = || {
        curves
            .iter()
            .flat_map(|curve| curve.pieces.iter().flatten())
    };
    let axis = |label: &str, range| PlotAxis {
        label: label.to_owned(),
        range,
        powers: false,
    };
    let (x, y) = (
        axis("time, s", range_of(all().map(|point| point.0))),
        axis(
            unit,
            0.0..range_of(all().map(|point| point.1).chain([0.0])).end,
        ),
    );
    Panel {
        title,
        axes: PanelAxes::Plane { x, y },
        curves,
        dots: Vec::new(),
        uprights: Vec::new(),
        level: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_track_that_changed_most_is_drawn() {
        let change = |a: &f64, b: &f64| (a - b).abs();
        let before = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0];
        let after = [0.0, 1.5, 2.1, 3.0, 4.5, 5.1];
        assert_eq!(noisiest(&before, &after, 3, change), Some(1));
        assert_eq!(noisiest(&before, &before, 3, change), None);
        assert_eq!(noisiest::<f64>(&[], &[], 0, change), None);
    }
}
