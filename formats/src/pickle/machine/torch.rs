//! Files of `torch.save`: a ZIP archive with a pickle, and a member with the bytes of each storage.

use std::collections::HashMap;
use std::ops::Range;

use half::bf16;

use crate::array::{Element, shape_text};
use crate::diagnostic::{Code, Diagnostic};
use crate::npz::archive::{Archive, Member};
use crate::pickle::globals::{Class, Global, StorageKind};
use crate::pickle::machine::arrays::Dtype;
use crate::pickle::machine::{Data, Machine, Node, NodeId};

/// How the name of the pickle in an archive ends.
const PICKLE: &str = "/data.pkl";

/// How a file of `PyTorch` that is no archive begins: with a pickle of a number.
const NO_ARCHIVE: &[u8] = b"\x80\x02\x8a\x0al\xfc\x9cF\xf9 j\xa8P\x19.";

/// Whether a file that begins with these bytes is an archive of `torch.save`, whose first member is its pickle.
pub(in crate::pickle) fn is_archive(start: &[u8]) -> bool {
    // The local header of a ZIP member (APPNOTE.TXT 4.3.7): the length of the name at byte 26, the name at byte 30.
    let name = || {
        let length = start.get(26..28)?.try_into().ok()?;
        start.get(30..30 + usize::from(u16::from_le_bytes(length)))
    };
    start.starts_with(b"PK\x03\x04") && name().is_some_and(|name| name.ends_with(PICKLE.as_bytes()))
}

/// Refuses a file of `PyTorch` that is no archive.
pub(in crate::pickle) fn refuse_other_files(file: &str, bytes: &[u8]) -> Result<(), Diagnostic> {
    if !bytes.starts_with(NO_ARCHIVE) {
        return Ok(());
    }
    let message = "the file has the form of PyTorch before 1.6 (now `_use_new_zipfile_serialization=False`); save it again \
                   as an archive: torch.save(torch.load(…), …)";
    Err(Diagnostic::new(file, Code::PickleForm, message))
}

/// The members of an archive that are storages, by their keys, as ranges of the file.
pub(in crate::pickle) struct Storages {
    members: HashMap<String, Range<usize>>,
}

impl Storages {
    /// The pickle and the storages of an archive.
    ///
    /// # Errors
    /// When there is not one pickle, or when a member is not stored as it is in this machine's byte order.
    pub(in crate::pickle) fn of(archive: &Archive) -> Result<(Range<usize>, Self), Diagnostic> {
        let refuse = |message: &str| Diagnostic::new(&archive.file, Code::PickleForm, message);
        let paths = archive.members.iter().map(|member| &*member.path);
        let mut pickles = paths.filter_map(|path| path.strip_suffix(PICKLE));
        let (Some(root), None) = (pickles.next(), pickles.next()) else {
            return Err(refuse(
                "it has no pickle, or several; save it with torch.save",
            ));
        };
        let stored = |member: &Member| {
            let range = member.stored();
            range.ok_or_else(|| refuse("a member is compressed; save it with torch.save"))
        };
        let mut pickle = None;
        let mut members = HashMap::new();
        for member in &archive.members {
            let Some(name) = member.path.strip_prefix(root) else {
                continue;
            };
            if name == PICKLE {
                pickle = Some(stored(member)?);
            } else if let Some(key) = name.strip_prefix("/data/") {
                members.insert(key.to_owned(), stored(member)?);
            } else if name == "/byteorder" && &archive.bytes()[stored(member)?] != b"little" {
                return Err(refuse("its numbers are big-endian, which is not read"));
            }
        }
        let pickle = pickle.ok_or_else(|| refuse("it has no pickle"))?;
        Ok((pickle, Self { members }))
    }
}

/// The numbers that tensors are views of.
#[derive(Debug)]
pub(in crate::pickle) struct Storage {
    kind: StorageKind,
    data: Range<usize>,
}

impl Machine<'_> {
    /// The storage with an id: ("storage", type, key, device, count).
    pub(in crate::pickle) fn storage(&mut self, id: NodeId) -> Result<(), Diagnostic> {
        let (kind, key, count) = match self.items(id) {
            Some(&[_, kind, key, _, count, ..]) => (kind, key, count),
            _ => return Err(self.damaged("the id of a storage has other parts")),
        };
        let kind = match self.value(kind) {
            Some(Node::Class(Class::Known(Global::Storage(kind)))) => *kind,
            _ => return Err(self.damaged("a storage has no type")),
        };
        let key = self.text(key).unwrap_or_default();
        let data = self
            .storages
            .and_then(|storages| storages.members.get(&*key));
        let data = data
            .cloned()
            .ok_or_else(|| self.damaged("a storage is not in the file"))?;
        let count = self
            .int(count)
            .and_then(|count| usize::try_from(count).ok());
        let bytes = count.and_then(|count| count.checked_mul(kind.size()));
        if bytes.is_none_or(|bytes| bytes > data.len()) {
            return Err(self.damaged("a storage has fewer bytes than it says"));
        }
        self.charge(1, size_of::<Storage>())?;
        self.add(Node::Storage(Box::new(Storage { kind, data })))
    }

    /// A tensor: a view of a storage, with the distance of neighbours along each axis.
    pub(in crate::pickle) fn tensor(
        &mut self,
        storage: NodeId,
        offset: NodeId,
        size: NodeId,
        stride: NodeId,
    ) -> Result<Node, Diagnostic> {
        let (kind, data) = match self.value(storage) {
            Some(Node::Storage(storage)) => (storage.kind, storage.data.clone()),
            _ => return Err(self.damaged("a tensor has no storage")),
        };
        let offset = self
            .int(offset)
            .and_then(|offset| usize::try_from(offset).ok());
        let (shape, strides) = (self.lengths(size)?, self.lengths(stride)?);
        let count = shape
            .iter()
            .try_fold(1usize, |n, &length| n.checked_mul(length));
        let outside = || {
            let shape = shape_text(&shape);
            self.damaged(format!(
                "a tensor of shape {shape} passes the end of its storage"
            ))
        };
        let (Some(offset), Some(count)) = (offset, count) else {
            return Err(outside());
        };
        if shape.len() != strides.len() {
            return Err(outside());
        }
        let reach = shape
            .iter()
            .zip(&strides)
            .try_fold(0usize, |reach, (&length, &stride)| {
                reach.checked_add(length.saturating_sub(1).checked_mul(stride)?)
            });
        let stored = data.len() / kind.size();
        let end = reach.and_then(|reach| offset.checked_add(reach)?.checked_add(1));
        if count > 0 && end.is_none_or(|end| end > stored) {
            return Err(outside());
        }
        let size = kind.size();
        let element = kind.element().unwrap_or(Element::F32);
        let written = element.size().unwrap_or(0);
        let dtype = Dtype::of(element);
        let axes = shape.iter().zip(&strides).rev();
        let is_contiguous = axes
            .filter(|(length, _)| **length != 1)
            .try_fold(1usize, |next, (&length, &stride)| {
                (stride == next).then(|| next.saturating_mul(length))
            })
            .is_some();
        if count == 0 || is_contiguous && kind != StorageKind::BFloat16 {
            let start = if count == 0 {
                data.start
            } else {
                data.start + offset * size
            };
            let range = start..start + count * size;
            return self.new_array(dtype, shape, false, Data::Input(range));
        }
        self.charge(count, written)?;
        let mut bytes = Vec::with_capacity(count.saturating_mul(written));
        for index in 0..count {
            let axes = shape.iter().zip(&strides).rev();
            let (_, at) = axes.fold((index, offset), |(rest, at), (&length, &stride)| {
                (rest / length, at + rest % length * stride)
            });
            let number = &self.input[data.start + at * size..][..size];
            match kind {
                StorageKind::BFloat16 => {
                    let number = bf16::from_le_bytes([number[0], number[1]]);
                    bytes.extend(number.to_f32().to_le_bytes());
                }
                _ => bytes.extend_from_slice(number),
            }
        }
        self.new_array(dtype, shape, false, Data::Decoded(bytes.into()))
    }
}
