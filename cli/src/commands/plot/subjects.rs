//! Which boxes and dimensions of a set are drawn, and how they are shared out over pictures.

use clap::ValueEnum;
use glam::Vec3;

use crate::commands::plot::source::curves::PlotSubject;
use crate::messages::exit::Failure;

/// A picture with more panels than this cannot be read.
pub(super) const PANELS: usize = 64;

/// What is drawn of a set over time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum PlotQuantity {
    /// w x y z over frames
    Components,
    /// angular speed over frames, rad/s
    Speed,
    /// the angle to the f64 reference over frames, radians
    Error,
    /// the path of an axis of a box on the sphere
    Sphere,
    /// of bodies on paths: speed, turning rate of the direction, and the turn about it
    Path,
}

/// What is drawn of one set, and how it is shared out where there are several pictures.
pub(super) struct Subjects {
    pub(super) boxes: Vec<usize>,
    pub(super) dimensions: Vec<usize>,
    pub(super) show: PlotQuantity,
    pub(super) axis: Vec3,
}

impl Subjects {
    pub(super) fn of(&self, boxes: Vec<usize>) -> PlotSubject {
        match self.show {
            PlotQuantity::Components => PlotSubject::Components(boxes),
            PlotQuantity::Speed => PlotSubject::Speed(boxes),
            PlotQuantity::Error => PlotSubject::Error(boxes),
            PlotQuantity::Sphere | PlotQuantity::Path => PlotSubject::Sphere(boxes, self.axis),
        }
    }

    pub(super) fn panels(&self, methods: usize) -> usize {
        match (self.dimensions.len(), self.show) {
            (0, PlotQuantity::Components) if methods > 1 => 4 * self.boxes.len(),
            (0, _) => self.boxes.len(),
            (dimensions, _) => dimensions,
        }
    }

    pub(super) fn one(&self) -> PlotSubject {
        if self.dimensions.is_empty() {
            self.of(self.boxes.clone())
        } else {
            PlotSubject::Dimensions(self.dimensions.clone())
        }
    }

    /// A picture for each dimension, or for each box, with the name of its file.
    pub(super) fn each(&self) -> Vec<(String, PlotSubject)> {
        let dimension = |&index: &usize| {
            let name = format!("dimension-{}", index + 1);
            (name, PlotSubject::Dimensions(vec![index]))
        };
        let show = self.show.to_possible_value();
        let show = show.as_ref().map_or("", |value| value.get_name());
        let one = |&index: &usize| (format!("{show}-box-{}", index + 1), self.of(vec![index]));
        if self.dimensions.is_empty() {
            self.boxes.iter().map(one).collect()
        } else {
            self.dimensions.iter().map(dimension).collect()
        }
    }
}

/// Everything in one picture, if that can be read.
pub(super) fn together(
    subjects: &Subjects,
    methods: usize,
    name: &str,
) -> Result<PlotSubject, Failure> {
    let panels = subjects.panels(methods);
    if panels > PANELS {
        return Err(Failure::usage(format!(
            "{name}: {panels} panels in one picture cannot be read, at most {PANELS}; choose \
             some (--box, --dimension), or give a directory, for a picture each"
        )));
    }
    Ok(subjects.one())
}
