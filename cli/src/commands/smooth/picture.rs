//! Samples before and after smoothing: how fast the joint turns and moves that had the most noise.

use glam::{Quat, Vec3};
use tumble_formats::sample::Samples;

use crate::batch::place::Place;
use crate::commands::plot::draw;
use crate::commands::plot::figure::{
    Axes, Axis, Curve, Entry, Figure, Mark, Panel, range_of, thinned,
};
use crate::commands::travel::Travel;
use crate::messages::colours::{AXIS, BOXES, Colour};
use crate::messages::exit::Failure;

/// Before and after.
const COLOURS: [Colour; 2] = [AXIS, BOXES[0]];
const WIDTHS: [f64; 2] = [1.0, 2.2];
/// Points that a curve is drawn of are at most four for each of so many columns.
const COLUMNS: usize = 2000;

/// What the picture is of.
pub(super) struct Subject<'a> {
    pub(super) title: String,
    /// The kernel and how often.
    pub(super) about: String,
    /// The names of the joints.
    pub(super) names: &'a [String],
    pub(super) before: &'a Samples,
    pub(super) after: &'a Samples,
}

/// Draws into a file, which ends in .svg or .png.
pub(super) fn draw(subject: &Subject<'_>, place: &Place) -> Result<(), Failure> {
    draw::write(&figure(subject), place)
}

fn figure(subject: &Subject<'_>) -> Figure {
    let tracks = subject.names.len();
    let samples = [subject.before, subject.after];
    let travels = samples.map(|own| Travel {
        name: String::new(),
        times: own.times.clone(),
        tracks,
        rotations: own.rotations.clone(),
        places: own.translations.clone(),
    });
    let turning = |travel: &Travel, track: usize| -> Vec<f64> {
        let velocities = travel.velocities();
        let own = velocities.iter().skip(track).step_by(tracks);
        own.map(|velocity| f64::from(velocity.truncate().length()))
            .collect()
    };
    let moving = |travel: &Travel, track: usize| -> Vec<f64> {
        let places: Vec<Vec3> = travel.line(track).collect();
        let steps = places.windows(2).zip(travel.times.windows(2));
        steps
            .map(|(pair, times)| f64::from((pair[1] - pair[0]).length()) / (times[1] - times[0]))
            .collect()
    };
    let mut panels = Vec::new();
    let [before, after] = &samples;
    let angles = |a: &Quat, b: &Quat| f64::from(1.0 - a.dot(*b).abs());
    if let Some(track) = noisiest(&before.rotations, &after.rotations, tracks, angles) {
        let title = format!("{}: angular speed", subject.names[track]);
        panels.push(panel(title, "rad/s", &travels, |own| turning(own, track)));
    }
    let distances = |a: &Vec3, b: &Vec3| f64::from(a.distance_squared(*b));
    if let Some(track) = noisiest(&before.translations, &after.translations, tracks, distances) {
        let title = format!("{}: speed", subject.names[track]);
        panels.push(panel(title, "units/s", &travels, |own| moving(own, track)));
    }
    let entry = |(label, colour): (&str, Colour)| Entry {
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

/// The track whose samples smoothing has changed most; none where it has changed nothing.
fn noisiest<T>(
    before: &[T],
    after: &[T],
    tracks: usize,
    change: impl Fn(&T, &T) -> f64,
) -> Option<usize> {
    let mut changes = vec![0.0; tracks];
    for (place, (a, b)) in before.iter().zip(after).enumerate() {
        changes[place % tracks] += change(a, b);
    }
    let most = (0..tracks).max_by(|&a, &b| changes[a].total_cmp(&changes[b]))?;
    (changes[most] > 0.0).then_some(most)
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
            Curve {
                colour,
                width,
                opacity: 1.0,
                pieces: vec![thinned(&points.collect::<Vec<_>>(), COLUMNS)],
            }
        });
    let curves: Vec<Curve> = curves.collect();
    let all = || {
        curves
            .iter()
            .flat_map(|curve| curve.pieces.iter().flatten())
    };
    let axis = |label: &str, range| Axis {
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
        axes: Axes::Plane { x, y },
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
