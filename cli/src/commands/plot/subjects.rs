//! Which boxes and dimensions of a set are drawn, and how they are shared out over pictures.

use std::str::FromStr;

use clap::ValueEnum;
use glam::{DVec3, Quat, Vec3};
use tumble::{Track, TrackSet};
use tumble_formats::motion::Motion;

use crate::commands::plot::source::curves::{PlotSubject, box_name, scalar_name};
use crate::messages::exit::Failure;
use crate::messages::words;

/// A picture with more panels than this cannot be read.
pub(super) const PANELS: usize = 64;

/// The quantity of a set that is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum PlotQuantity {
    /// w x y z over time
    Components,
    /// angular speed over time, rad/s
    Speed,
    /// the angle to the f64 reference over time, radians
    Error,
    /// the path of an axis of a box on the sphere
    Sphere,
    /// angles of joints, weights of morph targets, contacts and other numbers over time
    Scalars,
    /// of bodies on paths: speed, turning rate of the direction, and the turn about it
    Path,
}

/// An entry of `--components`: a component of the rotations of a track.
#[derive(Debug, Clone)]
pub(super) struct ComponentSelector {
    track: String,
    /// From 0, in the order of dimensions.
    component: usize,
}

/// The components of a rotation, in the order in which they are drawn.
const COMPONENTS: [&str; 4] = ["w", "x", "y", "z"];

impl FromStr for ComponentSelector {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.rsplit_once('.').and_then(|(track, component)| {
            let found = COMPONENTS.iter().position(|name| *name == component);
            Some((track, found?))
        });
        let (track, component) = parts.ok_or("expected a track and w, x, y or z, such as 0.x")?;
        let track = track.to_owned();
        Ok(Self { track, component })
    }
}

impl ComponentSelector {
    /// Its dimension in a set: four for each track.
    pub(super) fn dimension(&self, set: &TrackSet, name: &str) -> Result<usize, Failure> {
        let count = set.track_count();
        let named = (0..count).find(|&track| set.track_name(track) == self.track);
        let found = named.or_else(|| self.track.parse().ok().filter(|&track| track < count));
        let track = found.ok_or_else(|| {
            Failure::usage(format!(
                "{name}: --components: there is no track `{}`; it has {} (`tumble info --json` lists them)",
                self.track,
                words::count(count, "track")
            ))
        })?;
        Ok(COMPONENTS.len() * track + self.component)
    }
}

/// The tracks and the quantity that are drawn of one set, and how they are divided among several pictures.
pub(super) struct Subjects {
    /// Tracks; with [`PlotQuantity::Scalars`] scalars.
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
            PlotQuantity::Scalars => PlotSubject::Scalars(boxes),
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
        let label = |number: usize| match self.show {
            PlotQuantity::Scalars => format!("scalar-{number}"),
            _ => format!("{show}-box-{number}"),
        };
        let one = |&index: &usize| (label(index + 1), self.of(vec![index]));
        if self.dimensions.is_empty() {
            self.boxes.iter().map(one).collect()
        } else {
            self.dimensions.iter().map(dimension).collect()
        }
    }
}

/// Whether a track has the same rotation at all times.
fn is_still(track: &Track<'_>) -> bool {
    let first = track.keys.first().copied().unwrap_or_default();
    track.keys.iter().all(|&key| key == first || key == -first)
        && track.velocities.iter().all(|&v| v == DVec3::ZERO)
        && track.tangents.as_flattened().iter().all(|&t| t == ZERO)
}

const ZERO: Quat = Quat::from_xyzw(0.0, 0.0, 0.0, 0.0);

/// The boxes of a set that are drawn if none are chosen: those that move, or all if none does. A note names the others.
pub(super) fn moving_boxes(set: &TrackSet, name: &str) -> Vec<usize> {
    let all = 0..set.track_count();
    let (still, moving): (Vec<usize>, Vec<usize>) =
        all.clone().partition(|&index| is_still(&set.track(index)));
    if moving.is_empty() {
        return still;
    }
    if !still.is_empty() {
        let names = still.iter().map(|&index| box_name(set, index));
        let names: Vec<String> = names.collect();
        let object = if still.len() == 1 { "it" } else { "them" };
        words::note(&format!(
            "{name}: without rotation and not drawn: {}; --tracks draws {object}",
            names.join(", ")
        ));
    }
    moving
}

/// The scalars of a clip that are drawn if none are chosen: those that change, or all if none does. A note names the
/// others.
pub(super) fn changing_scalars(clip: &Motion, name: &str) -> Vec<usize> {
    let all = 0..clip.set.scalar_count();
    let (still, changing): (Vec<usize>, Vec<usize>) = all.partition(|&index| {
        let keys = clip.set.scalar(index);
        keys.is_none_or(|keys| {
            let is_flat = keys
                .tangents
                .as_flattened()
                .iter()
                .all(|&slope| slope == 0.0);
            keys.keys.iter().all(|&key| key == keys.keys[0]) && is_flat
        })
    });
    if changing.is_empty() {
        return still;
    }
    if !still.is_empty() {
        let names: Vec<String> = still
            .iter()
            .map(|&index| scalar_name(clip, index))
            .collect();
        let object = if still.len() == 1 { "it" } else { "them" };
        words::note(&format!(
            "{name}: without change and not drawn: {}; --scalars draws {object}",
            names.join(", ")
        ));
    }
    changing
}

/// Everything in one picture, if it stays readable.
pub(super) fn together(
    subjects: &Subjects,
    methods: usize,
    name: &str,
) -> Result<PlotSubject, Failure> {
    let panels = subjects.panels(methods);
    if panels > PANELS {
        return Err(Failure::usage(format!(
            "{name}: {panels} panels in one picture cannot be read, at most {PANELS}; choose \
             some (--tracks, --components, --scalars), or give a directory, for a picture each"
        )));
    }
    Ok(subjects.one())
}
