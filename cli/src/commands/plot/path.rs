//! Plots of bodies on paths: how fast they go, how fast they turn, and how far they have rolled.

use glam::Vec3;
use tumble::SampleTimes;

use crate::arguments::device::OpenedDevice;
use crate::commands::plot::figure::{
    Figure, LegendEntry, Mark, Panel, PanelAxes, PlotAxis, PlotCurve, TimeAxis, range_of,
};
use crate::commands::travel::{Maker, Travel, TravelSource};
use crate::messages::colours::Colour;
use crate::messages::exit::Failure;
use crate::messages::words;

/// Steps from the first key to the last. Speeds are differences between them: with more, the rounding of
/// positions to f32 would be seen.
const STEPS: usize = 1000;
/// More keys than this stand too close for upright lines.
const UPRIGHTS: usize = 200;

/// The quantity of a body that a panel shows, computed from two neighbouring samples.
#[derive(Clone, Copy)]
enum PathQuantity {
    /// The speed, units a second.
    Speed,
    /// The angular speed of its direction, rad/s.
    Turning,
    /// The angle about its direction since the start, degrees.
    Roll,
}

const ALL: [(PathQuantity, &str, &str); 3] = [
    (PathQuantity::Speed, "speed along the path", "units/s"),
    (
        PathQuantity::Turning,
        "turning rate of the direction",
        "rad/s",
    ),
    (PathQuantity::Roll, "turned about the direction", "degrees"),
];

/// Three panels for each path, with a curve for each frame or method.
pub(super) fn figure(
    device: &mut OpenedDevice,
    (name, title): (&str, String),
    source: &TravelSource,
    makers: &[Maker],
) -> Result<Figure, Failure> {
    let set = source.set();
    let (first, last) = set.time_span().unwrap_or((0.0, 0.0));
    let at = |i: usize| first + (last - first) * i as f64 / STEPS as f64;
    let frames = match first < last {
        true => SampleTimes::at((0..=STEPS).map(at).collect()),
        false => return Err(Failure::usage(format!("{name}: has no time to plot"))),
    };
    let travels: Vec<Travel> = makers
        .iter()
        .map(|&maker| source.sample(device, name, maker, &frames))
        .collect::<Result<_, _>>()?;
    let colours: Vec<Colour> = makers.iter().map(|maker| maker.colour()).collect();
    let forward = source.body_rotation() * Vec3::Z;
    let keys = source.key_times();
    let time = TimeAxis::of(first, last, source.clip().time_offset);
    let uprights = match keys.len() {
        0..=UPRIGHTS => keys.iter().map(|key| key - time.origin).collect(),
        _ => vec![],
    };
    let tracks = set.track_count();
    let panels = (0..tracks).flat_map(|track| ALL.map(|show| (track, show)));
    let panels = panels.map(|(track, (show, caption, unit))| {
        let curve = |(order, (travel, &colour)): (usize, (&Travel, &Colour))| PlotCurve {
            colour,
            width: 1.6 + 1.4 * (travels.len() - 1 - order).min(3) as f64,
            opacity: 1.0,
            pieces: vec![points(travel, track, show, forward, time.origin)],
        };
        let curves: Vec<PlotCurve> = travels
            .iter()
            .zip(&colours)
            .enumerate()
            .map(curve)
            .collect();
        let all = || {
            curves
                .iter()
                .flat_map(|curve| curve.pieces.iter().flatten())
        };
        // The smallest range of the axis, degrees: without it, the rounding of a constant roll would fill the panel.
        let least = if matches!(show, PathQuantity::Roll) {
            [-1.0, 1.0]
        } else {
            [0.0, 0.0]
        };
        let range = range_of(all().map(|point| point.1).chain(least));
        Panel {
            title: match tracks {
                1 => caption.to_owned(),
                _ => format!("{}: {caption}", set.track_name(track)),
            },
            axes: PanelAxes::Plane {
                x: time.axis.clone(),
                y: PlotAxis {
                    label: unit.to_owned(),
                    range,
                    powers: false,
                },
            },
            curves,
            dots: Vec::new(),
            uprights: uprights.clone(),
            level: None,
        }
    });
    let panels: Vec<Panel> = panels.collect();
    let entry = |(travel, &colour): (&Travel, &Colour)| LegendEntry {
        label: travel.name.clone(),
        colour,
        mark: Mark::Line,
    };
    Ok(Figure {
        title: format!("{title}: along the path"),
        subtitle: format!(
            "{}, differences of {STEPS} steps; evaluated on {}",
            words::count(tracks, "path"),
            device.label
        ),
        legend: (travels.iter().zip(&colours).map(entry))
            .chain(LegendEntry::of_uprights(&panels))
            .collect(),
        columns: if tracks == 1 { 1 } else { 3 },
        panels,
    })
}

/// The curve of one body, a point in the middle of each step. Times count from `origin`.
fn points(
    travel: &Travel,
    track: usize,
    show: PathQuantity,
    forward: Vec3,
    origin: f64,
) -> Vec<(f64, f64)> {
    let velocities = travel.velocities();
    let positions: Vec<Vec3> = travel.line(track).collect();
    let mut rolled = 0.0;
    let steps = travel.times.windows(2).enumerate();
    let point = |(sample, pair): (usize, &[f64])| {
        let seconds = pair[1] - pair[0];
        let turning = velocities[sample * travel.tracks + track].truncate();
        let roll = turning.dot(forward);
        rolled += f64::from(roll) * seconds;
        let value = match show {
            PathQuantity::Speed => {
                f64::from((positions[sample + 1] - positions[sample]).length()) / seconds
            }
            PathQuantity::Turning => f64::from((turning - forward * roll).length()),
            PathQuantity::Roll => rolled.to_degrees(),
        };
        ((pair[0] + pair[1]) / 2.0 - origin, value)
    };
    steps.map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Quat;

    /// A body that goes round a circle in the plane, and rolls twice while it does.
    #[test]
    fn speed_turning_and_roll_are_those_of_a_circle() {
        let times: Vec<f64> = (0..=1000).map(|i| f64::from(i) / 500.0).collect();
        let angle = |time: &f64| (time * 0.75) as f32;
        let travel = Travel {
            name: String::new(),
            tracks: 1,
            rotations: (times.iter())
                .map(|time| {
                    let roll = Quat::from_rotation_z((time * std::f64::consts::TAU) as f32);
                    Quat::from_rotation_y(angle(time)) * roll
                })
                .collect(),
            // The body first faces along z, then goes around y.
            positions: (times.iter())
                .map(|time| Vec3::new(-angle(time).cos(), 0.0, angle(time).sin()) * 4.0)
                .collect(),
            times,
        };
        let last = |show| *points(&travel, 0, show, Vec3::Z, 0.0).last().unwrap();
        for (show, value, bound) in [
            (PathQuantity::Speed, 3.0, 2e-3),
            (PathQuantity::Turning, 0.75, 1e-3),
            (PathQuantity::Roll, 720.0, 0.1),
        ] {
            let (at, found) = last(show);
            assert!(
                (at - 1.999).abs() < 1e-9 && (found - value).abs() < bound,
                "{found}, {value}"
            );
        }
    }
}
