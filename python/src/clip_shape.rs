//! The work of a motion library on each clip that it reads: it chooses joints, and samples them at a rate.

use std::fmt;

use pyo3::prelude::*;
use pyo3::types::PyString;
use tumble::{Device, Engine, FrameRate, SampleTimes};
use tumble_formats::motion::Motion;
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
    joints: Option<Vec<JointName>>,
    method: MethodChoice,
}

/// A joint, by its name or its index.
#[derive(Debug, Clone, PartialEq)]
enum JointName {
    Name(String),
    Index(usize),
}

impl fmt::Display for JointName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Name(name) => write!(f, "`{name}`"),
            Self::Index(index) => write!(f, "{index}"),
        }
    }
}

impl ClipShape {
    /// Reads the keywords; without any, clips are not changed.
    pub(crate) fn new(
        fps: Option<&Bound<'_, PyAny>>,
        tracks: Option<&Bound<'_, PyAny>>,
        method: &str,
    ) -> PyResult<Self> {
        let rate = fps.map(frame_rate).transpose()?;
        Ok(Self {
            rate,
            joints: tracks.map(joint_names).transpose()?,
            method: match rate {
                Some(_) => method_named(method)?,
                None => MethodChoice::default(),
            },
        })
    }

    /// The clip in this shape.
    ///
    /// # Errors
    /// The fault, to follow the name of the clip.
    pub(crate) fn applied(&self, clip: Motion) -> Result<Motion, String> {
        let clip = match &self.joints {
            Some(joints) => selected(&clip, joints)?,
            None => clip,
        };
        match self.rate {
            Some(rate) if clip.rate != Some(rate) => self.at_rate(&clip, rate),
            _ => Ok(clip),
        }
    }

    /// The clip with its samples at the frames of a rate as keys. The end of a clip is its last frame: what follows is
    /// shorter than a frame.
    fn at_rate(&self, clip: &Motion, rate: FrameRate) -> Result<Motion, String> {
        let methods = ChannelMethods {
            method: self.method,
            ..ChannelMethods::AUTHORED
        };
        let engine = Engine::new(Device::Cpu).map_err(|error| error.to_string())?;
        let samples = methods.sample(&engine, clip, &SampleTimes::rate(rate));
        let samples = samples.map_err(|error| error.to_string())?;
        let keyed = clip.with_keys(&samples);
        Ok(Motion {
            rate: Some(rate),
            ..keyed.map_err(|error| error.to_string())?
        })
    }
}

fn joint_names(tracks: &Bound<'_, PyAny>) -> PyResult<Vec<JointName>> {
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
            Ok(name) => Ok(JointName::Name(name.to_cow()?.into_owned())),
            Err(_) => joint.extract().map(JointName::Index),
        }
    };
    let names: PyResult<Vec<JointName>> = tracks.try_iter().map_err(explained)?.map(one).collect();
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

/// Some joints of a clip, in this order.
fn selected(clip: &Motion, joints: &[JointName]) -> Result<Motion, String> {
    let names: Vec<String> = (0..clip.set.track_count())
        .map(|it| clip.set.track_name(it))
        .collect();
    let find = |joint: &JointName| match joint {
        JointName::Name(name) => names.iter().position(|known| known == name).ok_or_else(|| {
            let known: Vec<&str> = names.iter().map(String::as_str).collect();
            unknown_name(&format!("tracks: there is no joint `{name}`"), name, &known)
        }),
        &JointName::Index(index) if index < names.len() => Ok(index),
        JointName::Index(index) => {
            let count = names.len();
            Err(format!(
                "tracks: there is no joint {index}; there are {count}, from 0"
            ))
        }
    };
    let tracks: Vec<usize> = joints.iter().map(find).collect::<Result<_, _>>()?;
    let parent = |track: usize| clip.skeleton.get(track).and_then(|joint| joint.parent);
    for &track in &tracks {
        // Without the parent, the position relative to it would be lost.
        if let Some(parent) = parent(track).filter(|parent| !tracks.contains(parent)) {
            return Err(format!(
                "tracks: `{}` is a child of `{}`, which is left out; name that joint, too",
                names[track], names[parent]
            ));
        }
    }
    clip.select(&tracks).map_err(|error| error.to_string())
}

/// The clip with some of its joints, `tracks`, by their names or indices, in this order, and with keys at a rate of
/// `fps`, sampled by `method`.
#[pyfunction]
#[pyo3(signature = (clip, *, fps=None, tracks=None, method="slerp"))]
pub(crate) fn shaped(
    clip: &Bound<'_, Clip>,
    fps: Option<&Bound<'_, PyAny>>,
    tracks: Option<&Bound<'_, PyAny>>,
    method: &str,
) -> PyResult<Clip> {
    let shape = ClipShape::new(fps, tracks, method)?;
    let (py, clip) = (clip.py(), clip.get());
    let motion = py.detach(|| guarded(|| shape.applied((*clip.motion).clone()).map_err(input)));
    Ok(clip.with_keys(motion?))
}
