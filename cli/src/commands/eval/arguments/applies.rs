//! Refuses options that have no effect on a result: [`OPTIONS`] says which have.

use tumble_formats::format::Format;

use crate::arguments::options::{AppliesTo, OPTIONS, ResultKind, ResultRequest};
use crate::commands::eval::arguments::Arguments;
use crate::messages::exit::Failure;

impl Arguments {
    /// Refuses, before any work, options that have no effect on any kind that the results may have.
    pub(crate) fn check_before(&self, format: &'static Format) -> Result<(), Failure> {
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
    pub(crate) fn check(&self, kind: ResultKind, format: &'static Format) -> Result<(), Failure> {
        self.refusal(kind, format)
            .map_or(Ok(()), |message| Err(Failure::usage(message)))
    }

    fn refusal(&self, kind: ResultKind, format: &'static Format) -> Option<String> {
        if !kind.is_clip() && format.write.is_none() {
            let all = Format::writable().filter(|format| format.write.is_some());
            let names: Vec<&str> = all.map(|format| format.name).collect();
            return Some(format!(
                "{} stores whole clips; for --output {} write {}",
                format.name,
                self.output.name(),
                names.join(" or ")
            ));
        }
        let result = ResultRequest {
            kind,
            format,
            output: &self.output,
            layout: self.layout,
            encoding: self.encoding,
        };
        let set = OPTIONS
            .iter()
            .filter(|rule| self.command_line.has(rule.name));
        let mut refusals = set.filter_map(|rule| match rule.applies_to {
            AppliesTo::Results(refusal) => refusal(&result),
            AppliesTo::All | AppliesTo::Inputs(_) => None,
        });
        refusals.next()
    }
}
