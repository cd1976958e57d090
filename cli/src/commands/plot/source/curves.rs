//! The figures of a set: components, speeds, errors, paths on the sphere.

use glam::{DVec3, Quat, Vec3};
use tumble::reference::{ReferenceCurve, angle_between};
use tumble::verify::error_bound;
use tumble::{Axes, Quantity, TrackSet};
use tumble_formats::motion::{Motion, ScalarKind};
use tumble_formats::printable::printable;

use crate::arguments::device::OpenedDevice;
use crate::arguments::interpolation::CurveChoice;
use crate::commands::plot::figure::{
    Dots, Figure, LegendEntry, Mark, Panel, PanelAxes, PlotAxis, PlotCurve, range_of, thinned,
};
use crate::commands::plot::source::PlotSource;
use crate::commands::plot::sphere::{graticule, seen, side};
use crate::messages::colours::{self, COMPONENTS, INK};
use crate::messages::exit::Failure;

/// Components of a quaternion in the order of dimensions.
pub(crate) const NAMES: [&str; 4] = ["w", "x", "y", "z"];

/// Smaller errors are drawn as none: the sample is exact.
const EXACT: f64 = 1e-12;

/// The subject of a figure. Boxes and dimensions count from 0 here.
#[derive(Debug, Clone)]
pub(crate) enum PlotSubject {
    /// All four components of boxes.
    Components(Vec<usize>),
    /// Single components: w x y z of the first box, then of the second …
    Dimensions(Vec<usize>),
    /// Angular speeds of boxes.
    Speed(Vec<usize>),
    /// Errors against the f64 reference.
    Error(Vec<usize>),
    /// Where an axis of a box points, seen from its parent.
    Sphere(Vec<usize>, Vec3),
    /// Scalars of the clip.
    Scalars(Vec<usize>),
}

impl PlotSource<'_> {
    pub(crate) fn figure(
        &self,
        device: &mut OpenedDevice,
        subject: &PlotSubject,
    ) -> Result<Figure, Failure> {
        let (quantity, panels): (_, Result<Vec<Panel>, Failure>) = match subject {
            PlotSubject::Components(boxes) if self.choices.len() == 1 => {
                let panel = |&index: &usize| self.components(device, index, &[0, 1, 2, 3]);
                ("components", boxes.iter().map(panel).collect())
            }
            PlotSubject::Components(boxes) => {
                let dimensions = boxes.iter().flat_map(|index| index * 4..index * 4 + 4);
                let panel = |dimension| self.components(device, dimension / 4, &[dimension % 4]);
                ("components", dimensions.map(panel).collect())
            }
            PlotSubject::Dimensions(dimensions) => {
                let panel = |dimension| self.components(device, dimension / 4, &[dimension % 4]);
                (
                    "components",
                    dimensions.iter().copied().map(panel).collect(),
                )
            }
            PlotSubject::Speed(boxes) => {
                let panel = |&index| self.speed(device, index);
                ("angular speed", boxes.iter().map(panel).collect())
            }
            PlotSubject::Error(boxes) => {
                let panel = |&index| self.error(device, index);
                let panels = boxes.iter().map(panel).collect();
                ("error against the f64 reference", panels)
            }
            PlotSubject::Sphere(boxes, axis) => {
                let panel = |&index| self.sphere(device, index, *axis);
                let panels = boxes.iter().map(panel).collect();
                let quantity = match self.clip.skeleton.is_empty() {
                    true => "where an axis of each box points, seen from its parent",
                    false => "where an axis of each joint points, seen from its parent",
                };
                (quantity, panels)
            }
            PlotSubject::Scalars(scalars) => {
                let panel = |&index| self.scalar(device, index);
                ("scalars", scalars.iter().map(panel).collect())
            }
        };
        let panels = panels?;
        let columns = match (subject, panels.len()) {
            (PlotSubject::Components(_), _) if self.choices.len() > 1 => 4,
            (PlotSubject::Sphere(..), 2) => 2,
            // Panels of spheres are square, so there are as many columns as rows.
            (PlotSubject::Sphere(..), panels @ 9..) => (panels - 1).isqrt() + 1,
            (_, 0..3) => 1,
            (_, 3..9) => 2,
            (_, 9..19) => 3,
            _ => 4,
        };
        let by_component = match (subject, self.choices) {
            (PlotSubject::Components(_), [one]) => Some(one.method),
            _ => None,
        };
        let method = by_component.map_or(String::new(), |method| format!("{method}; "));
        Ok(Figure {
            title: format!("{}: {quantity}", self.name),
            subtitle: format!("{method}{}; evaluated on {}", self.about, device.label),
            legend: self.legend(subject, by_component.is_some(), &panels),
            columns,
            panels,
        })
    }

    fn legend(
        &self,
        subject: &PlotSubject,
        by_component: bool,
        panels: &[Panel],
    ) -> Vec<LegendEntry> {
        let line = |label: String, colour| LegendEntry {
            label,
            colour,
            mark: Mark::Line,
        };
        let mut legend: Vec<LegendEntry> = if by_component {
            let of = |(name, colour): (&str, colours::Colour)| line(name.to_owned(), colour);
            NAMES.into_iter().zip(COMPONENTS).map(of).collect()
        } else {
            let of = |(index, one): (usize, &CurveChoice)| {
                let (name, colour) = (one.method.name(), colours::of_choice(one.method));
                // Only later curves can hide a curve, because they are drawn over it.
                let mut over = self.choices[index + 1..].iter().rev();
                let hidden_by = over.find(|other| {
                    let other = colours::of_choice(other.method);
                    panels.iter().all(|panel| panel.coincide([colour, other]))
                });
                let label = match hidden_by {
                    Some(other) => format!("{name} (below {})", other.method.name()),
                    None => name.to_owned(),
                };
                line(label, colour)
            };
            self.choices.iter().enumerate().map(of).collect()
        };
        let drawn = match subject {
            PlotSubject::Speed(_) => None,
            PlotSubject::Error(_) => Some(("bound", Mark::Dashes)),
            _ => Some(("key", Mark::Dot)),
        };
        legend.extend(drawn.map(|(label, mark)| LegendEntry {
            label: label.to_owned(),
            colour: INK,
            mark,
        }));
        legend.extend(LegendEntry::of_uprights(panels));
        legend
    }

    /// The name of a box.
    fn box_name(&self, index: usize) -> String {
        Self::title(box_name(self.set, index))
    }

    /// A name, of which a panel has room for the end alone if it is long: the end tells joints apart.
    fn title(name: String) -> String {
        /// Characters for which a panel has room.
        const LONGEST: usize = 44;
        match name.chars().count().checked_sub(LONGEST) {
            Some(over @ 1..) => format!("…{}", name.chars().skip(over + 1).collect::<String>()),
            _ => name,
        }
    }

    /// The components of one box. In a shared panel each component has a colour; otherwise each
    /// method has one.
    fn components(
        &self,
        device: &mut OpenedDevice,
        index: usize,
        components: &[usize],
    ) -> Result<Panel, Failure> {
        let mut curves = Vec::new();
        let mut dots = Vec::new();
        let together = components.len() > 1;
        for (order, &choice) in self.choices.iter().enumerate() {
            let interpolation = self.interpolation(choice, index);
            let rotations = self.rotations(device, index, interpolation)?;
            let keys = self.keys(index, &rotations);
            for &component in components {
                let (colour, ink) = match together {
                    true => (COMPONENTS[component], COMPONENTS[component]),
                    false => (colours::of_choice(choice.method), INK),
                };
                let values = rotations.iter().map(|q| value(q, component));
                curves.push(PlotCurve {
                    colour,
                    width: self.width(order),
                    opacity: 1.0,
                    pieces: vec![thinned(&self.points(values), 2000)],
                });
                if order == 0 {
                    let of = |&(x, key): &(f64, Quat)| (x, value(&key, component));
                    dots.push(Dots {
                        colour: ink,
                        opacity: 1.0,
                        points: keys.iter().map(of).collect(),
                    });
                }
            }
        }
        let shown = curves
            .iter()
            .flat_map(|curve| curve.pieces.iter().flatten());
        let shown = shown.chain(dots.iter().flat_map(|dots| &dots.points));
        let range = range_of(shown.map(|point| point.1));
        // The title has the name of the track. If boxes have no names, the title has the number of the dimension
        // instead, which counts the components of all boxes.
        let (name, is_named) = (self.box_name(index), has_name(self.set, index));
        let (title, label) = match components {
            [one] if is_named => (format!("{} of {name}", NAMES[*one]), NAMES[*one]),
            [one] => {
                let (dimension, component) = (index * 4 + one + 1, NAMES[*one]);
                (
                    format!("dimension {dimension}: {component} of {name}"),
                    component,
                )
            }
            _ if is_named => (name, "component"),
            _ => {
                let (first, last) = (index * 4 + 1, index * 4 + 4);
                (format!("{name}: dimensions {first} to {last}"), "component")
            }
        };
        Ok(self.panel(title, label, range, curves, dots))
    }

    /// A scalar over time, with its unit where that is known.
    fn scalar(&self, device: &mut OpenedDevice, index: usize) -> Result<Panel, Failure> {
        let scalar = self.clip.scalar(index);
        let mut curves = Vec::new();
        for (order, &choice) in self.choices.iter().enumerate() {
            let samples = self.scalar_samples(device, index, choice)?;
            let values = samples.into_iter().map(|value| value + scalar.origin);
            curves.push(PlotCurve {
                colour: colours::of_choice(choice.method),
                width: self.width(order),
                opacity: 1.0,
                pieces: vec![thinned(&self.points(values), 2000)],
            });
        }
        let (keys, range) = (self.clip.set.scalar(index), &self.x.axis.range);
        let placed = keys
            .into_iter()
            .flat_map(|keys| keys.times.iter().zip(keys.keys));
        let placed =
            placed.map(|(&time, &key)| (time - self.x.origin, f64::from(key) + scalar.origin));
        let dots = Dots {
            colour: INK,
            opacity: 1.0,
            points: placed.filter(|(x, _)| range.contains(x)).collect(),
        };
        let shown = curves
            .iter()
            .flat_map(|curve| curve.pieces.iter().flatten());
        let range = range_of(shown.chain(&dots.points).map(|point| point.1));
        let label = match scalar.kind {
            ScalarKind::Angle => "angle, rad",
            ScalarKind::Length => "length",
            ScalarKind::Contact => "contact",
            ScalarKind::Plain => "value",
        };
        let title = Self::title(scalar_name(self.clip, index));
        Ok(self.panel(title, label, range, curves, vec![dots]))
    }

    /// The width of the `order`th curve. Curves that are drawn earlier are wider, so that they are visible where curves
    /// cover each other.
    fn width(&self, order: usize) -> f64 {
        let above = self.choices.len() - 1 - order;
        1.6 + 1.8 * above.min(3) as f64
    }

    fn panel(
        &self,
        title: String,
        label: &str,
        range: std::ops::Range<f64>,
        curves: Vec<PlotCurve>,
        dots: Vec<Dots>,
    ) -> Panel {
        Panel {
            title,
            axes: PanelAxes::Plane {
                x: self.x.axis.clone(),
                y: PlotAxis {
                    label: label.to_owned(),
                    range,
                    powers: false,
                },
            },
            curves,
            dots,
            uprights: Vec::new(),
            level: None,
        }
    }

    /// Angular speed in rad/s; keys as upright lines.
    fn speed(&self, device: &mut OpenedDevice, index: usize) -> Result<Panel, Failure> {
        let mut curves = Vec::new();
        for (order, &choice) in self.choices.iter().enumerate() {
            let interpolation = self.interpolation(choice, index);
            let velocity = interpolation.with_quantity(Quantity::Velocity(Axes::Body));
            let velocities = self.rates(device, index, velocity)?;
            let velocities = velocities.as_slice().iter();
            let speeds = velocities.map(|v| f64::from(v.truncate().length()));
            curves.push(PlotCurve {
                colour: colours::of_choice(choice.method),
                width: self.width(order).min(2.5),
                opacity: 1.0,
                pieces: vec![thinned(&self.points(speeds), 2000)],
            });
        }
        let all = curves
            .iter()
            .flat_map(|curve| curve.pieces.iter().flatten());
        let high = range_of(all.map(|point| point.1).chain([0.0])).end;
        let title = self.box_name(index);
        let mut panel = self.panel(title, "angular speed, rad/s", 0.0..high, curves, vec![]);
        panel.uprights = self.key_positions(index);
        Ok(panel)
    }

    /// Angle to the reference, radians, as powers of ten; if there is none, a gap.
    fn error(&self, device: &mut OpenedDevice, index: usize) -> Result<Panel, Failure> {
        let mut curves = Vec::new();
        let mut level = f64::NEG_INFINITY;
        for &choice in self.choices {
            let interpolation = self.interpolation(choice, index);
            let rotations = self.evaluate(device, index, interpolation)?;
            let reference = ReferenceCurve::of(&interpolation, self.set.track(index));
            let errors = rotations
                .iter()
                .zip(self.timeline.times(0))
                .map(|(rotation, time)| {
                    angle_between(rotation.as_dquat(), reference.rotation(time))
                });
            let points = self.points(errors);
            let pieces = points
                .split(|point| point.1 < EXACT)
                .filter(|piece| !piece.is_empty())
                .map(|piece| {
                    let powers = piece.iter().map(|&(x, error)| (x, error.log10()));
                    thinned(&powers.collect::<Vec<_>>(), 2000)
                });
            curves.push(PlotCurve {
                colour: colours::of_choice(choice.method),
                width: 1.2,
                opacity: 1.0,
                pieces: pieces.collect(),
            });
            level = level.max(error_bound(interpolation.form()).log10());
        }
        let all = curves
            .iter()
            .flat_map(|curve| curve.pieces.iter().flatten());
        let range = range_of(all.map(|point| point.1).chain([level, level - 3.0]));
        let title = self.box_name(index);
        let mut panel = self.panel(title, "error, rad", range, curves, vec![]);
        if let PanelAxes::Plane { y, .. } = &mut panel.axes {
            y.range = y.range.start.floor()..(y.range.end + 0.3);
            y.powers = true;
        }
        panel.uprights = self.key_positions(index);
        panel.level = Some(level);
        Ok(panel)
    }

    /// The path of the end of an axis on the unit sphere; the far side is faint.
    fn sphere(
        &self,
        device: &mut OpenedDevice,
        index: usize,
        axis: Vec3,
    ) -> Result<Panel, Failure> {
        let mut curves = graticule();
        let mut dots = Vec::new();
        for (order, &choice) in self.choices.iter().enumerate() {
            let interpolation = self.interpolation(choice, index);
            let rotations = self.evaluate(device, index, interpolation)?;
            let path: Vec<DVec3> = rotations.iter().map(|&q| seen(q, axis)).collect();
            let colour = colours::of_choice(choice.method);
            for (front, opacity) in [(false, 0.3), (true, 1.0)] {
                curves.push(PlotCurve {
                    colour,
                    width: self.width(order).min(3.0),
                    opacity,
                    pieces: side(&path, front),
                });
            }
        }
        let track = self.set.track(index);
        let keys: Vec<DVec3> = track.keys.iter().map(|&key| seen(key, axis)).collect();
        for (front, opacity) in [(false, 0.3), (true, 1.0)] {
            let points = keys.iter().filter(|key| (key.z >= 0.0) == front);
            dots.push(Dots {
                colour: INK,
                opacity,
                points: points.map(|key| (key.x, key.y)).collect(),
            });
        }
        Ok(Panel {
            title: self.box_name(index),
            axes: PanelAxes::Sphere,
            curves,
            dots,
            uprights: Vec::new(),
            level: None,
        })
    }
}

/// The name of the track at `index`, such as a joint's; `box 1` if it has none.
pub(crate) fn box_name(set: &TrackSet, index: usize) -> String {
    match set.track(index).name.filter(|name| !name.is_empty()) {
        Some(name) => printable(name).into_owned(),
        None => format!("box {}", index + 1),
    }
}

fn has_name(set: &TrackSet, index: usize) -> bool {
    set.track(index).name.is_some_and(|name| !name.is_empty())
}

/// The name of a scalar; `scalar 1` if it has none.
pub(crate) fn scalar_name(clip: &Motion, index: usize) -> String {
    match clip.set.scalar(index).map_or("", |keys| keys.name) {
        "" => format!("scalar {}", index + 1),
        name => printable(name).into_owned(),
    }
}

fn value(rotation: &Quat, component: usize) -> f64 {
    let [x, y, z, w] = rotation.to_array();
    [w, x, y, z][component].into()
}
