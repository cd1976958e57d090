//! Which options apply to which kind of result. An option that has no effect is refused, with a remedy,
//! and never ignored.

use tumble::{Encoding, Layout};
use tumble_formats::format::{Format, FormatOption};

use crate::commands::eval::{Arguments, LayoutArgument};
use crate::messages::exit::Failure;

/// The kind of a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ResultKind {
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
    /// Refuses, before any work, options that have no effect on any kind that the results may have.
    pub(super) fn check_before(&self, format: &Format) -> Result<(), Failure> {
        let mut kinds = Vec::new();
        if self.output.is_rotations() {
            if format.write.is_some() {
                kinds.push(ResultKind::Rotations);
            }
            if format.writes_clips() {
                kinds.extend([ResultKind::Motion, ResultKind::Baked]);
            }
        } else {
            kinds.push(match self.output.poses() {
                Some(_) => ResultKind::Poses,
                None => ResultKind::Rotations,
            });
        }
        let mut refusals = kinds.into_iter().map(|kind| self.refusal(kind, format));
        let first = refusals.next().flatten();
        match first {
            Some(first) if refusals.all(|other| other.is_some()) => Err(Failure::usage(first)),
            _ => Ok(()),
        }
    }

    /// Refuses options that have no effect on a result of this kind.
    pub(super) fn check(&self, kind: ResultKind, format: &Format) -> Result<(), Failure> {
        self.refusal(kind, format)
            .map_or(Ok(()), |message| Err(Failure::usage(message)))
    }

    fn refusal(&self, kind: ResultKind, format: &Format) -> Option<String> {
        let is_clip = matches!(kind, ResultKind::Motion | ResultKind::Baked);
        let is_angles = is_clip && format.takes(FormatOption::Sequence);
        let (output, name) = (self.output.name(), format.name);
        if !is_clip && format.write.is_none() {
            let all = Format::writable().filter(|format| format.write.is_some());
            let names: Vec<&str> = all.map(|format| format.name).collect();
            return Some(format!(
                "{name} stores whole clips; for --output {output} write {}",
                names.join(" or ")
            ));
        }
        if let Err(message) = self.output.check(&self.command_line, is_angles) {
            return Some(message);
        }
        self.order_refusal(kind, format)
            .or_else(|| self.layout_refusal(kind, format))
            .or_else(|| self.encoding_refusal(kind, format))
            .or_else(|| {
                let takes = kind == ResultKind::Baked && format.takes(FormatOption::Linear);
                (self.command_line.has("linear") && !takes).then(|| {
                    "--linear is for NPZ that is written again as NPZ; leave it out".to_owned()
                })
            })
            .or_else(|| {
                let option = ["scale", "offsets"]
                    .into_iter()
                    .find(|it| self.command_line.has(it))?;
                (kind == ResultKind::Rotations).then(|| {
                    format!(
                        "--{option} has no effect on rotations alone; leave it out, or write \
                         --output world or transform, or a clip (-o OUT.glb)"
                    )
                })
            })
    }

    fn order_refusal(&self, kind: ResultKind, format: &Format) -> Option<String> {
        self.order?;
        let (output, name) = (self.output.name(), format.name);
        match kind {
            ResultKind::Rotations if !self.output.is_rotations() => Some(format!(
                "--order is for quaternions, and --output {output} has none; leave it out"
            )),
            ResultKind::Motion if format.takes(FormatOption::Order) => None,
            ResultKind::Motion | ResultKind::Baked => Some(format!(
                "{name} has a fixed order of quaternion components; leave out --order"
            )),
            ResultKind::Rotations | ResultKind::Poses => None,
        }
    }

    fn layout_refusal(&self, kind: ResultKind, format: &Format) -> Option<String> {
        if !self.command_line.has("layout") {
            return None;
        }
        let name = format.name;
        let only = match kind {
            ResultKind::Rotations => format.write.as_ref()?.layout,
            ResultKind::Poses => Some(Layout::FrameMajor),
            ResultKind::Motion | ResultKind::Baked => {
                return Some(format!(
                    "{name} has a fixed layout for clips; leave out --layout"
                ));
            }
        };
        match (only, self.layout) {
            (Some(Layout::FrameMajor), LayoutArgument::Track) => Some(format!(
                "{} come frame by frame; leave out --layout track",
                match kind {
                    ResultKind::Poses => "poses".to_owned(),
                    _ => format!("rows of {name}"),
                }
            )),
            _ => None,
        }
    }

    fn encoding_refusal(&self, kind: ResultKind, format: &Format) -> Option<String> {
        if self.encoding == Encoding::F32 {
            return None;
        }
        let is_text = format.write.as_ref().is_some_and(|write| write.is_text);
        match kind {
            ResultKind::Rotations if is_text => {
                Some("--encoding is for binary results (NPY); text holds every digit".to_owned())
            }
            ResultKind::Rotations if self.output.is_rotations() => None,
            ResultKind::Rotations | ResultKind::Poses => Some(format!(
                "--encoding is for quaternions, and --output {} is written as f32; leave it out",
                self.output.name()
            )),
            ResultKind::Motion | ResultKind::Baked => Some(format!(
                "--encoding is for rotations as they come (NPY); {} has its own; leave it out",
                format.name
            )),
        }
    }
}
