//! Which boxes and dimensions of a set are drawn, and how they are shared out over pictures.

use clap::ValueEnum;
use glam::Vec3;

use crate::commands::plot::Show;
use crate::commands::plot::curves::Subject;
use crate::messages::exit::Failure;

/// A picture with more panels than this cannot be read.
pub(super) const PANELS: usize = 64;

/// What is drawn of one set, and how it is shared out where there are several pictures.
pub(super) struct Subjects {
    pub(super) boxes: Vec<usize>,
    pub(super) dimensions: Vec<usize>,
    pub(super) show: Show,
    pub(super) axis: Vec3,
}

impl Subjects {
    pub(super) fn of(&self, boxes: Vec<usize>) -> Subject {
        match self.show {
            Show::Components => Subject::Components(boxes),
            Show::Speed => Subject::Speed(boxes),
            Show::Error => Subject::Error(boxes),
            Show::Sphere | Show::Path => Subject::Sphere(boxes, self.axis),
        }
    }

    pub(super) fn panels(&self, methods: usize) -> usize {
        match (self.dimensions.len(), self.show) {
            (0, Show::Components) if methods > 1 => 4 * self.boxes.len(),
            (0, _) => self.boxes.len(),
            (dimensions, _) => dimensions,
        }
    }

    pub(super) fn one(&self) -> Subject {
        if self.dimensions.is_empty() {
            self.of(self.boxes.clone())
        } else {
            Subject::Dimensions(self.dimensions.clone())
        }
    }

    /// A picture for each dimension, or for each box; and what its file is called.
    pub(super) fn each(&self) -> Vec<(String, Subject)> {
        let dimension = |&place: &usize| {
            let name = format!("dimension-{}", place + 1);
            (name, Subject::Dimensions(vec![place]))
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
) -> Result<Subject, Failure> {
    let panels = subjects.panels(methods);
    if panels > PANELS {
        return Err(Failure::usage(format!(
            "{name}: {panels} panels in one picture cannot be read, at most {PANELS}; choose \
             some (--box, --dimension), or give a directory, for a picture each"
        )));
    }
    Ok(subjects.one())
}
