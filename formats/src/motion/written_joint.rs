//! How a file wrote a joint, as far as its rotations and translations do not determine it.

use std::fmt;

use glam::Vec3;

/// The channels and End Sites of a joint, as BVH has them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WrittenJoint {
    /// The channels of the joint, in the order of their numbers in the row of a frame.
    pub channels: Vec<WrittenChannel>,
    /// The positions of its End Sites relative to the joint, in the file's units.
    pub end_sites: Vec<Vec3>,
}

/// A channel of a joint, one number of a row of BVH. Its axis is 0 for x, 1 for y, 2 for z.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum WrittenChannel {
    /// `Xposition`, a coordinate.
    Position(usize),
    /// `Xrotation`, an angle in degrees.
    Rotation(usize),
}

const AXES: [&str; 3] = ["X", "Y", "Z"];

impl WrittenChannel {
    /// The channel with this name; case is ignored.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let (letter, kind) = name.split_at_checked(1)?;
        let axis = AXES
            .iter()
            .position(|axis| axis.eq_ignore_ascii_case(letter))?;
        match kind.to_ascii_lowercase().as_str() {
            "position" => Some(Self::Position(axis)),
            "rotation" => Some(Self::Rotation(axis)),
            _ => None,
        }
    }

    /// The axes of the rotations among these channels, in their order.
    pub(crate) fn rotations(channels: &[Self]) -> Vec<usize> {
        let axis = |channel: &Self| match channel {
            Self::Rotation(axis) => Some(*axis),
            Self::Position(_) => None,
        };
        channels.iter().filter_map(axis).collect()
    }
}

impl fmt::Display for WrittenChannel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (axis, kind) = match self {
            Self::Position(axis) => (axis, "position"),
            Self::Rotation(axis) => (axis, "rotation"),
        };
        write!(f, "{}{kind}", AXES.get(*axis).unwrap_or(&"?"))
    }
}

impl WrittenJoint {
    /// The names of the channels in one text: `Zrotation Xrotation Yrotation`.
    pub(crate) fn channels_text(&self) -> String {
        let names: Vec<String> = self.channels.iter().map(ToString::to_string).collect();
        names.join(" ")
    }

    /// Parses the names of channels; `None` if a name is unknown or occurs twice.
    pub(crate) fn channels_of(text: &str) -> Option<Vec<WrittenChannel>> {
        let mut channels = Vec::new();
        for name in text.split_ascii_whitespace() {
            let channel = WrittenChannel::named(name)?;
            if channels.contains(&channel) {
                return None;
            }
            channels.push(channel);
        }
        Some(channels)
    }
}
