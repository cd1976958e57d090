//! The work of a motion library on each clip that it reads: it chooses joints, and samples them at a rate.

use pyo3::prelude::*;
use pyo3::types::PyString;
use tumble::{Device, Engine, FrameRate, SampleTimes};
use tumble_formats::adjust::JointOffsets;
use tumble_formats::motion::{Motion, TrackName, TrackSelection};
use tumble_formats::sample::{ChannelMethods, MethodChoice};

use crate::clip::Clip;
use crate::errors::{expected, guarded, input};
use crate::names::unknown_name;
use crate::options::{frame_rate, method_named};

/// How clips are changed when a library reads them: which joints, and at which rate.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct ClipShape {
    /// The rate at which clips are sampled; `None` keeps the keys of the file.
    rate: Option<FrameRate>,
    /// The joints, in this order; `None`: all.
    joints: Option<Vec<TrackName>>,
    /// Whether the motion of joints that are left out is added to that of their kept children.
    collapse: bool,
    method: MethodChoice,
}

impl ClipShape {
    /// Reads the keywords; without any, clips are not changed.
    pub(crate) fn new(
        fps: Option<&Bound<'_, PyAny>>,
        tracks: Option<&Bound<'_, PyAny>>,
        collapse: bool,
        method: &str,
    ) -> PyResult<Self> {
        let rate = fps.map(frame_rate).transpose()?;
        if collapse && tracks.is_none() {
            return Err(input(
                "collapse: without `tracks` no joint is left out; give the joints to keep as `tracks`",
            ));
        }
        Ok(Self {
            rate,
            joints: tracks.map(joint_names).transpose()?,
            collapse,
            method: match rate.is_some() || collapse {
                true => method_named(method)?,
                false => MethodChoice::default(),
            },
        })
    }

    /// The tracks that are needed of a file; `None`: all.
    pub(crate) fn selection(&self) -> Option<TrackSelection> {
        Some(TrackSelection {
            tracks: self.joints.clone()?,
            with_ancestors: self.collapse,
        })
    }

    /// Whether offsets are those of the selected joints, not of all joints of a file. Those with names are found by them.
    ///
    /// # Errors
    /// They may be of either, or are of neither.
    pub(crate) fn selects_offsets(
        &self,
        offsets: &JointOffsets,
        clip: &Motion,
    ) -> Result<bool, String> {
        let Some(joints) = &self.joints else {
            return Ok(false);
        };
        if !offsets.names().is_empty() {
            let names: Vec<String> = (0..clip.set.track_count())
                .map(|track| clip.set.track_name(track))
                .collect();
            let unknown = offsets.names().iter().find(|name| !names.contains(name));
            return unknown.map_or(Ok(true), |name| {
                let known: Vec<&str> = names.iter().map(String::as_str).collect();
                Err(unknown_name(
                    &format!("there is no joint `{name}`"),
                    name,
                    &known,
                ))
            });
        }
        let (count, all) = (offsets.joint_count(), clip.set.track_count());
        if self.collapse {
            return match count == all {
                true => Ok(false),
                false => Err(format!(
                    "{count} offsets for {all} joints; with `collapse` give one for each joint of the file, in its order, or a \
                     dict of x, y, z by the names of joints: those of joints that are left out are needed, too"
                )),
            };
        }
        match (count == joints.len(), count == all) {
            (true, false) => Ok(true),
            (false, true) => Ok(false),
            (true, true) if tracks(clip, joints)?.into_iter().eq(0..all) => Ok(false),
            (true, true) => Err(format!(
                "`tracks` has all {all} joints in another order than the file, so that these offsets may be in either order; \
                 give a dict of x, y, z by the names of joints"
            )),
            (false, false) => Err(format!(
                "{count} offsets for {} of {all} joints; give one for each of `tracks`, in their order, or one for each joint \
                 of the file, in its order, or a dict of x, y, z by the names of joints",
                joints.len()
            )),
        }
    }

    /// The clip with the selected joints. If the others collapse, those that are needed for it follow.
    ///
    /// # Errors
    /// The fault, to follow the name of the clip.
    pub(crate) fn selected(&self, clip: Motion) -> Result<Motion, String> {
        match &self.joints {
            Some(joints) if self.collapse => with_ancestors(&clip, joints),
            Some(joints) => selected(&clip, joints),
            None => Ok(clip),
        }
    }

    /// A clip of [`Self::selected`] at the rate, without the joints that collapse.
    ///
    /// # Errors
    /// As [`Self::selected`].
    pub(crate) fn sampled(&self, clip: Motion) -> Result<Motion, String> {
        let sampled = match self.rate {
            Some(rate) if clip.rate != Some(rate) => self.at_rate(&clip, rate)?,
            _ => clip,
        };
        match &self.joints {
            Some(joints) if joints.len() < sampled.set.track_count() => {
                self.collapsed(&sampled, joints.len())
            }
            _ => Ok(sampled),
        }
    }

    fn methods(&self) -> ChannelMethods {
        ChannelMethods {
            method: self.method,
            ..ChannelMethods::AUTHORED
        }
    }

    /// The clip with its first `kept` joints, to which the motion of the others is added.
    fn collapsed(&self, clip: &Motion, kept: usize) -> Result<Motion, String> {
        let engine = Engine::new(Device::Cpu).map_err(|error| error.to_string())?;
        let kept: Vec<usize> = (0..kept).collect();
        let collapsed = clip.collapsed(&kept, &engine, &self.methods());
        collapsed.map_err(|error| format!("collapse: {error}"))
    }

    /// The clip with its samples at the frames of a rate as keys. The end of a clip is its last frame: what follows is
    /// shorter than a frame.
    fn at_rate(&self, clip: &Motion, rate: FrameRate) -> Result<Motion, String> {
        let engine = Engine::new(Device::Cpu).map_err(|error| error.to_string())?;
        let samples = (self.methods()).sample(&engine, clip, &SampleTimes::rate(rate));
        let samples = samples.map_err(|error| error.to_string())?;
        let keyed = clip.with_keys(&samples);
        Ok(Motion {
            rate: Some(rate),
            ..keyed.map_err(|error| error.to_string())?
        })
    }
}

fn joint_names(tracks: &Bound<'_, PyAny>) -> PyResult<Vec<TrackName>> {
    let explained = |error| {
        expected(tracks.py(), error, || {
            "tracks: give a list of the names or the indices of joints".to_owned()
        })
    };
    if tracks.is_instance_of::<PyString>() {
        return Err(input(
            "tracks: give a list of the names or the indices of joints",
        ));
    }
    let one = |joint: PyResult<Bound<'_, PyAny>>| {
        let joint = joint?;
        match joint.cast::<PyString>() {
            Ok(name) => Ok(TrackName::Name(name.to_cow()?.into_owned())),
            Err(_) => joint.extract().map(TrackName::Index),
        }
    };
    let names: PyResult<Vec<TrackName>> = tracks.try_iter().map_err(explained)?.map(one).collect();
    let names = names.map_err(explained)?;
    match names
        .iter()
        .enumerate()
        .find(|(index, name)| names[..*index].contains(name))
    {
        Some((_, name)) => Err(input(format!("tracks: the joint {name} stands twice"))),
        None if names.is_empty() => Err(input("tracks: give at least one joint")),
        None => Ok(names),
    }
}

/// The tracks of some joints of a clip.
fn tracks(clip: &Motion, joints: &[TrackName]) -> Result<Vec<usize>, String> {
    let names: Vec<String> = (0..clip.set.track_count())
        .map(|it| clip.set.track_name(it))
        .collect();
    let find = |joint: &TrackName| match joint {
        TrackName::Name(name) => names.iter().position(|known| known == name).ok_or_else(|| {
            let known: Vec<&str> = names.iter().map(String::as_str).collect();
            unknown_name(&format!("tracks: there is no joint `{name}`"), name, &known)
        }),
        &TrackName::Index(index) if index < names.len() => Ok(index),
        TrackName::Index(index) => {
            let count = names.len();
            Err(format!(
                "tracks: there is no joint {index}; there are {count}, from 0"
            ))
        }
    };
    joints.iter().map(find).collect()
}

/// Some joints of a clip, in this order.
fn selected(clip: &Motion, joints: &[TrackName]) -> Result<Motion, String> {
    let tracks = tracks(clip, joints)?;
    let name = |track: usize| clip.set.track_name(track);
    let parent = |track: usize| clip.skeleton.get(track).and_then(|joint| joint.parent);
    for &track in &tracks {
        // Without the parent, the position relative to it would be lost.
        if let Some(parent) = parent(track).filter(|parent| !tracks.contains(parent)) {
            return Err(format!(
                "tracks: `{}` is a child of `{}`, which is left out; name that joint, too, or give collapse=True",
                name(track),
                name(parent)
            ));
        }
    }
    clip.select(&tracks).map_err(|error| error.to_string())
}

/// Some joints of a clip, in this order, and then their other ancestors.
fn with_ancestors(clip: &Motion, joints: &[TrackName]) -> Result<Motion, String> {
    let mut tracks = tracks(clip, joints)?;
    let all = clip.with_ancestors(&tracks);
    let others: Vec<usize> = all.into_iter().filter(|it| !tracks.contains(it)).collect();
    tracks.extend(others);
    clip.select(&tracks).map_err(|error| error.to_string())
}

/// The clip with some of its joints, `tracks`, by their names or indices, in this order, and with keys at a rate of
/// `fps`, sampled by `method`. `collapse`: the motion of joints that are left out is added to that of their children.
#[pyfunction]
#[pyo3(signature = (clip, *, fps=None, tracks=None, collapse=false, method="slerp"))]
pub(crate) fn shaped(
    clip: &Bound<'_, Clip>,
    fps: Option<&Bound<'_, PyAny>>,
    tracks: Option<&Bound<'_, PyAny>>,
    collapse: bool,
    method: &str,
) -> PyResult<Clip> {
    let shape = ClipShape::new(fps, tracks, collapse, method)?;
    let (py, clip) = (clip.py(), clip.get());
    let applied = |motion: Motion| shape.sampled(shape.selected(motion)?);
    let motion = py.detach(|| guarded(|| applied((*clip.motion).clone()).map_err(input)));
    Ok(clip.with_keys(motion?))
}
