//! The members of an archive that no plan reads, and the warnings about them.

use crate::array::{ArrayHeader, Element};
use crate::diagnostic::Code;
use crate::format::ReadOptions;
use crate::npz::archive::{Archive, Member};
use crate::npz::body_model::SHAPE;
use crate::npz::plan::ArchivePlan;
use crate::npz::tumble_layout::CONSTANTS;
use crate::warnings::{Warnings, listed};

impl ArchivePlan {
    /// The members that are not read, except pickled objects, which have another warning.
    pub(crate) fn not_read(&self, archive: &Archive, options: &ReadOptions) -> Vec<usize> {
        let is_read = |index: usize, member: &Member| {
            let header = member.header.as_ref();
            let is_shape = self.is_body && options.has_body_model;
            self.parts.iter().any(|part| part.member == index)
                || self.scalars.iter().any(|part| part.member == index)
                || self.times.is_some_and(|list| list.member == index)
                || self.rate_member == Some(index)
                || self.compared.contains(&index)
                || self.constants.contains(&index)
                || self.is_tumble_layout && CONSTANTS.contains(&&*member.name)
                || is_shape && SHAPE.contains(&&*member.name)
                || self.is_note(member)
                || header.is_ok_and(|it| matches!(it.element, Element::Object | Element::Class(_)))
        };
        let members = archive.members.iter().enumerate();
        let others = members.filter(|&(index, member)| !is_read(index, member));
        others.map(|(index, _)| index).collect()
    }

    /// Whether a member is a note on how Tumble's samples were made: a text beside them.
    pub(crate) fn is_note(&self, member: &Member) -> bool {
        let header = member.header.as_ref();
        self.is_tumble_layout && header.is_ok_and(|it| it.shape.is_empty() && it.element.is_text())
    }

    /// Warns of members that are not read, and of pickled objects.
    pub(crate) fn warn_of_others(
        &self,
        archive: &Archive,
        options: &ReadOptions,
        warnings: &mut Warnings,
    ) {
        if let Some(arrays) = archive.unreadable() {
            let message =
                format!("the headers of these arrays cannot be read: {arrays}; save them again");
            warnings.warn(Code::ArraysNotRead, || (None, message));
        }
        let name = |index: usize| &*archive.members[index].name;
        let others = self.not_read(archive, options).into_iter();
        let others = others.filter(|&index| !archive.members[index].is_unreadable());
        let unusual = others.filter(|&index| !self.companions.contains(&name(index)));
        let quoted = unusual.map(|index| format!("`{}`", name(index)));
        if let Some(names) = listed(quoted.collect()) {
            let message = format!(
                "not read: {names}; this is no error, the rotations are in other arrays; to read \
                 these too, name all arrays of the motion with --map"
            );
            warnings.warn(Code::ArraysNotRead, || (None, message));
        }
        for member in &archive.members {
            let is_object = |header: &ArrayHeader| header.element == Element::Object;
            if member.header.as_ref().is_ok_and(is_object) {
                let message = format!(
                    "`{}` holds pickled objects, which are not read",
                    member.name
                );
                warnings.warn(Code::ObjectsBeside, || (None, message));
            }
        }
    }
}
