//! What each option says to each kind of result: an option that says nothing to it is refused, with
//! what to do, and never ignored.

use tumble::{Encoding, Layout};
use tumble_formats::format::{Format, FormatOption};

use crate::commands::eval::{Arguments, LayoutArgument};
use crate::messages::exit::Failure;

/// What a result is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// The numbers of rotations as they come.
    Rotations,
    /// Whole poses.
    Poses,
    /// A clip with all its channels.
    Motion,
    /// The input's own file with other keys.
    Baked,
}

impl Arguments {
    /// Refuses, before any work, options that say nothing to whatever kind the results may be of.
    pub(super) fn check_before(&self, format: &Format) -> Result<(), Failure> {
        let mut kinds = Vec::new();
        if self.what.is_rotations() {
            if format.write.is_some() {
                kinds.push(Kind::Rotations);
            }
            if format.writes_clips() {
                kinds.extend([Kind::Motion, Kind::Baked]);
            }
        } else {
            kinds.push(match self.what.poses() {
                Some(_) => Kind::Poses,
                None => Kind::Rotations,
            });
        }
        let mut refusals = kinds.into_iter().map(|kind| self.refusal(kind, format));
        let first = refusals.next().flatten();
        match first {
            Some(first) if refusals.all(|other| other.is_some()) => Err(Failure::usage(first)),
            _ => Ok(()),
        }
    }

    /// Refuses options that say nothing to a result of this kind.
    pub(super) fn check(&self, kind: Kind, format: &Format) -> Result<(), Failure> {
        self.refusal(kind, format)
            .map_or(Ok(()), |message| Err(Failure::usage(message)))
    }

    fn refusal(&self, kind: Kind, format: &Format) -> Option<String> {
        let is_clip = matches!(kind, Kind::Motion | Kind::Baked);
        let is_angles = is_clip && format.takes(FormatOption::Sequence);
        let (what, name) = (self.what.name(), format.name);
        if !is_clip && format.write.is_none() {
            let all = Format::writable().filter(|format| format.write.is_some());
            let names: Vec<&str> = all.map(|format| format.name).collect();
            return Some(format!(
                "{name} holds whole clips; for --output {what} write {}",
                names.join(" or ")
            ));
        }
        if let Err(message) = self.what.check(&self.given, is_angles) {
            return Some(message);
        }
        self.order_refusal(kind, format)
            .or_else(|| self.layout_refusal(kind, format))
            .or_else(|| self.encoding_refusal(kind, format))
            .or_else(|| {
                let takes = kind == Kind::Baked && format.takes(FormatOption::Linear);
                (self.given.has("linear") && !takes).then(|| {
                    "--linear is for NPZ that is written again as NPZ; leave it out".to_owned()
                })
            })
            .or_else(|| {
                let given = ["scale", "offsets"]
                    .into_iter()
                    .find(|it| self.given.has(it))?;
                (kind == Kind::Rotations).then(|| {
                    format!(
                        "--{given} says nothing to rotations alone; leave it out, or write \
                         --output world or transform, or a clip (-o OUT.glb)"
                    )
                })
            })
    }

    fn order_refusal(&self, kind: Kind, format: &Format) -> Option<String> {
        self.order?;
        let (what, name) = (self.what.name(), format.name);
        match kind {
            Kind::Rotations if !self.what.is_rotations() => Some(format!(
                "--order is for quaternions, and --output {what} holds none; leave it out"
            )),
            Kind::Motion if format.takes(FormatOption::Order) => None,
            Kind::Motion | Kind::Baked => Some(format!(
                "{name} has an order of its own for the components of quaternions; leave out \
                 --order"
            )),
            Kind::Rotations | Kind::Poses => None,
        }
    }

    fn layout_refusal(&self, kind: Kind, format: &Format) -> Option<String> {
        if !self.given.has("layout") {
            return None;
        }
        let name = format.name;
        let only = match kind {
            Kind::Rotations => format.write.as_ref()?.layout,
            Kind::Poses => Some(Layout::FrameMajor),
            Kind::Motion | Kind::Baked => {
                return Some(format!(
                    "{name} has a layout of its own for clips; leave out --layout"
                ));
            }
        };
        match (only, self.layout) {
            (Some(Layout::FrameMajor), LayoutArgument::Track) => Some(format!(
                "{} come frame by frame; leave out --layout track",
                match kind {
                    Kind::Poses => "poses".to_owned(),
                    _ => format!("rows of {name}"),
                }
            )),
            _ => None,
        }
    }

    fn encoding_refusal(&self, kind: Kind, format: &Format) -> Option<String> {
        if self.encoding == Encoding::F32 {
            return None;
        }
        let is_text = format.write.as_ref().is_some_and(|write| write.is_text);
        match kind {
            Kind::Rotations if is_text => {
                Some("--encoding is for binary results (NPY); text holds every digit".to_owned())
            }
            Kind::Rotations if self.what.is_rotations() => None,
            Kind::Rotations | Kind::Poses => Some(format!(
                "--encoding is for quaternions, and --output {} is written as f32; leave it out",
                self.what.name()
            )),
            Kind::Motion | Kind::Baked => Some(format!(
                "--encoding is for rotations as they come (NPY); {} has its own; leave it out",
                format.name
            )),
        }
    }
}
