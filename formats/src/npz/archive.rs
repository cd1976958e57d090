//! The arrays of a file: the members of a ZIP archive, or the only array of an NPY file.
//!
//! An archive is read into memory, and its directory is checked before anything is unpacked: names, encryption, and
//! sizes that its bytes cannot contain. Members are unpacked one at a time, when they are requested.

use std::borrow::Cow;
use std::collections::HashSet;
use std::io::{Cursor, Read};
use std::ops::Range;

use flate2::Crc;
use flate2::read::DeflateDecoder;
use zip::result::ZipError;
use zip::{CompressionMethod, ZipArchive};

use crate::array::{ArrayHeader, Element, LONGEST_START};
use crate::budget::Budget;
use crate::diagnostic::{Code, Diagnostic};
use crate::limits::Limits;
use crate::npz::array::Array;
use crate::warnings::listed;

/// An open archive in memory.
pub(crate) struct Archive {
    /// The file's name in messages.
    pub(crate) file: String,
    bytes: Vec<u8>,
    pub(crate) members: Vec<Member>,
    budget: Budget,
}

/// One file in the archive.
pub(crate) struct Member {
    /// Its path in the archive.
    pub(crate) path: String,
    /// The name of its array: the path without `.npy`.
    pub(crate) name: String,
    /// Whether it is called as an array is: `x.npy` in an archive.
    is_array: bool,
    /// The header of the array, or why there is none.
    pub(crate) header: Result<ArrayHeader, String>,
    pub(crate) is_deflated: bool,
    data: Range<usize>,
    size: u64,
    checksum: Option<u32>,
}

/// The name of the only array of an NPY file: `numpy.savez` uses it for arrays without a name.
pub(crate) const ONLY_ARRAY: &str = "arr_0";

/// The largest number of bytes for each deflated byte: 258 bytes for two bits.
const LARGEST_RATIO: u64 = 1032;

impl Archive {
    /// Reads the directory of an NPZ file. All members together may be as long as a file.
    pub(crate) fn open(file: &str, bytes: Vec<u8>, limits: Limits) -> Result<Self, Diagnostic> {
        let limit = limits.file;
        let refuse = |code, message: String| Diagnostic::new(file, code, message);
        let broken = |error: ZipError| {
            let message = match (bytes.starts_with(b"PK"), has_directory(&bytes)) {
                (false, false) => "is no ZIP archive, as NPZ files are; save it by numpy.savez".to_owned(),
                (true, false) => {
                    "the directory at the end of the ZIP archive is missing: the file is cut; copy it again"
                        .to_owned()
                }
                _ => format!("the ZIP archive cannot be read: {error}; save the file again"),
            };
            refuse(Code::Archive, message)
        };
        let mut zip = ZipArchive::new(Cursor::new(&*bytes)).map_err(broken)?;
        if zip.has_duplicate_names() {
            let name = repeated_name(&bytes, zip.central_directory_start());
            let message = "two members have this name; save the file again with one";
            return Err(refuse(Code::RepeatedMember, message.to_owned()).inside(name));
        }
        let mut members = Vec::new();
        let mut total = 0u64;
        for index in 0..zip.len() {
            let entry = zip.by_index_data(index).map_err(broken)?;
            let path = entry.name().map_err(broken)?.into_owned();
            let is_encrypted = entry.encrypted();
            let refuse = |code, message: String| refuse(code, message).inside(&path);
            if is_encrypted {
                let message = "the member is encrypted; save the file without a password";
                return Err(refuse(Code::Encrypted, message.to_owned()));
            }
            let entry = zip.by_index_raw(index).map_err(broken)?;
            let is_deflated = match entry.compression() {
                CompressionMethod::Stored => false,
                CompressionMethod::Deflated => true,
                other => {
                    let message = format!(
                        "the member is packed by {other}; only stored and deflated members are supported"
                    );
                    return Err(refuse(Code::Archive, message));
                }
            };
            let (held, size) = (entry.compressed_size(), entry.size());
            let max_size = match is_deflated {
                true => held.saturating_mul(LARGEST_RATIO),
                false => held,
            };
            if size > max_size || !is_deflated && size != held {
                let message = format!("the member has {held} bytes, which do not unpack to {size}");
                return Err(refuse(Code::MemberSize, message));
            }
            total = total.saturating_add(size);
            if total > limit {
                let message = format!(
                    "unpacked, the input is longer than {limit} bytes: this member has {size}"
                );
                return Err(refuse(Code::FileTooLong, message));
            }
            let start = entry.data_start().unwrap_or(u64::MAX) as usize;
            let end = start.saturating_add(usize::try_from(held).unwrap_or(usize::MAX));
            if end > bytes.len() {
                let message =
                    format!("the member's {held} bytes pass the end of the file; it is cut");
                return Err(refuse(Code::MemberSize, message));
            }
            let array = path.strip_suffix(".npy");
            let mut member = Member {
                name: array.unwrap_or(&path).to_owned(),
                is_array: array.is_some(),
                header: Err("it is no NPY array".to_owned()),
                is_deflated,
                data: start..end,
                size,
                checksum: Some(entry.crc32()),
                path,
            };
            if member.is_array {
                member.header = ArrayHeader::parse(&member.start(&bytes));
            }
            members.push(member);
        }
        drop(zip);
        refuse_overlaps(file, &members)?;
        Ok(Self {
            file: file.to_owned(),
            budget: Budget::of(bytes.len(), limits),
            bytes,
            members,
        })
    }

    /// An NPY file.
    pub(crate) fn single(file: &str, bytes: Vec<u8>, limits: Limits) -> Self {
        let member = Member {
            path: String::new(),
            name: ONLY_ARRAY.to_owned(),
            is_array: true,
            header: ArrayHeader::parse(&bytes),
            is_deflated: false,
            data: 0..bytes.len(),
            size: bytes.len() as u64,
            checksum: None,
        };
        Self {
            file: file.to_owned(),
            budget: Budget::of(bytes.len(), limits),
            bytes,
            members: vec![member],
        }
    }

    /// An archive of values in some bytes.
    pub(crate) fn of_values(
        file: &str,
        bytes: Vec<u8>,
        budget: Budget,
        members: Vec<Member>,
    ) -> Self {
        Self {
            file: file.to_owned(),
            bytes,
            members,
            budget,
        }
    }

    /// Whether there is an array of objects.
    pub(crate) fn has_objects(&self) -> bool {
        self.members.iter().any(|member| member.objects().is_some())
    }

    /// Replaces a member with values, which are in other bytes.
    pub(crate) fn replace(&mut self, member: usize, values: Self) -> Result<(), Diagnostic> {
        self.take(1, values.bytes.len())?;
        let before = self.bytes.len();
        self.bytes.extend_from_slice(&values.bytes);
        let values = values.members.into_iter().map(|mut value| {
            value.data = value.data.start + before..value.data.end + before;
            value
        });
        self.members.splice(member..=member, values);
        Ok(())
    }

    /// The bytes of the file, and the rest of its budget.
    pub(crate) fn into_parts(self) -> (Vec<u8>, Budget) {
        (self.bytes, self.budget)
    }

    /// The bytes of the file.
    pub(crate) fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Takes memory for `count` elements of `bytes` each from the file's budget.
    pub(crate) fn take(&self, count: usize, bytes: usize) -> Result<(), Diagnostic> {
        self.budget
            .take(count, bytes)
            .map_err(|error| Diagnostic::new(&self.file, Code::Memory, error.to_string()))
    }

    /// The index of the member with this array name.
    pub(crate) fn find(&self, name: &str) -> Option<usize> {
        let mut members = self.members.iter();
        members.position(|member| member.name == name && member.is_array)
    }

    /// The shape of the array with this name.
    pub(crate) fn shape(&self, name: &str) -> Option<&[usize]> {
        let header = self.members[self.find(name)?].header.as_ref();
        Some(&header.ok()?.shape)
    }

    /// An error about a member.
    pub(crate) fn refuse(&self, member: usize, code: Code, message: String) -> Diagnostic {
        let refusal = Diagnostic::new(&self.file, code, message);
        match &*self.members[member].path {
            "" => refusal,
            path => refusal.inside(path),
        }
    }

    /// The header of a member, which must be an array of plain values with as many bytes as its shape requires.
    pub(crate) fn header(&self, member: usize) -> Result<&ArrayHeader, Diagnostic> {
        let header = self.members[member].header.as_ref().map_err(|why| {
            let message = format!("the array's header cannot be read: {why}");
            self.refuse(member, Code::ArrayHeader, message)
        })?;
        if header.element == Element::Object {
            let message = "the array holds pickled Python objects; save numbers (dtype=float)";
            return Err(self.refuse(member, Code::Pickled, message.to_owned()));
        }
        if let Element::Class(class) = &header.element {
            let message = format!(
                "the value is an object of {class}, which is not read; save it as numbers or a text"
            );
            return Err(self.refuse(member, Code::ObjectForValue, message));
        }
        let held = self.members[member].size.checked_sub(header.start as u64);
        let said = header.byte_count();
        if header.element.size().is_none() || said.is_some() && said.map(|n| n as u64) == held {
            return Ok(header);
        }
        // The sizes in the archive's directory may be wrong, so they are not trusted.
        let held = self.unpack(member)?.len().saturating_sub(header.start);
        let said = match said {
            Some(said) => format!("{said} bytes"),
            None => "more than any file has".to_owned(),
        };
        let message =
            format!("an array {header} takes {said}; there are {held} bytes after the header");
        Err(self.refuse(member, Code::ArraySize, message))
    }

    /// The array of a member, unpacked.
    pub(crate) fn array(&self, member: usize) -> Result<Array<'_>, Diagnostic> {
        let header = self.header(member)?;
        let bytes = self.unpack(member)?;
        Ok(Array { header, bytes })
    }

    /// The array with this name, if there is one.
    pub(crate) fn array_named(&self, name: &str) -> Result<Option<Array<'_>>, Diagnostic> {
        self.find(name).map(|member| self.array(member)).transpose()
    }

    /// The texts of the array with this name, if there is one.
    ///
    /// # Errors
    /// When it holds anything else: names that cannot be read are not passed over.
    pub(crate) fn texts(&self, name: &str) -> Result<Option<Vec<String>>, Diagnostic> {
        let Some(member) = self.find(name) else {
            // If the array is a pickled list whose values are not texts, each value is a separate member.
            let is_part = |member: &&Member| {
                let rest = member.name.strip_prefix(name);
                member.is_array && rest.is_some_and(|rest| rest.starts_with('.'))
            };
            return match self.members.iter().position(|member| is_part(&member)) {
                Some(part) => {
                    let message = format!(
                        "`{name}` has values that are no text; save its texts as such (dtype=str), or leave it out"
                    );
                    Err(self.refuse(part, Code::ElementType, message))
                }
                None => Ok(None),
            };
        };
        let texts = self.array(member)?.texts();
        texts.map(Some).map_err(|why| {
            let message = format!("{why}; save its texts as such (dtype=str), or leave it out");
            self.refuse(member, Code::ElementType, message)
        })
    }

    /// The bytes of a member.
    pub(crate) fn unpack(&self, member: usize) -> Result<Cow<'_, [u8]>, Diagnostic> {
        let Member { size, checksum, .. } = self.members[member];
        let refuse = |message: String| self.refuse(member, Code::MemberSize, message);
        let packed = &self.bytes[self.members[member].data.clone()];
        let bytes = if self.members[member].is_deflated {
            let mut bytes = Vec::new();
            self.budget
                .take(1, usize::try_from(size).unwrap_or(usize::MAX))
                .map_err(|error| self.refuse(member, Code::Memory, error.to_string()))?;
            // The size was checked: the compressed bytes can contain this many.
            let reserved = bytes.try_reserve_exact(size as usize);
            let unpacked = reserved.map_err(std::io::Error::from).and_then(|()| {
                DeflateDecoder::new(packed)
                    .take(size + 1)
                    .read_to_end(&mut bytes)
            });
            unpacked.map_err(|error| refuse(format!("the member cannot be unpacked: {error}")))?;
            Cow::Owned(bytes)
        } else {
            Cow::Borrowed(packed)
        };
        if bytes.len() as u64 != size {
            let more = if bytes.len() as u64 > size {
                "more than "
            } else {
                ""
            };
            let count = size.min(bytes.len() as u64);
            return Err(refuse(format!(
                "the member unpacks to {more}{count} bytes; the archive's directory says {size}"
            )));
        }
        if let Some(said) = checksum {
            let mut crc = Crc::new();
            crc.update(&bytes);
            if crc.sum() != said {
                let message = "the member's checksum is wrong: the file is damaged; copy it again";
                return Err(refuse(message.to_owned()));
            }
        }
        Ok(bytes)
    }

    /// The arrays whose headers cannot be read, each with the reason, for messages.
    pub(crate) fn unreadable(&self) -> Option<String> {
        let unreadable = self.members.iter().filter(|member| member.is_unreadable());
        let unreadable = unreadable.filter_map(|member| {
            let why = member.header.as_ref().err()?;
            Some(format!("`{}` ({why})", member.name))
        });
        listed(unreadable.collect())
    }

    /// All arrays with their shapes, for messages.
    pub(crate) fn listing(&self) -> String {
        const MAX_LISTED: usize = 24;
        let arrays = self.members.iter().filter_map(|member| {
            let header = member.header.as_ref().ok()?;
            Some(format!("`{}` {header}", member.name))
        });
        let mut list: Vec<String> = arrays.take(MAX_LISTED + 1).collect();
        match list.len() {
            0 => "none".to_owned(),
            length => {
                list.truncate(MAX_LISTED);
                let rest = if length > MAX_LISTED { " …" } else { "" };
                format!("{}{rest}", list.join(", "))
            }
        }
    }
}

impl Member {
    /// A value in some bytes. `location` says in messages where it is.
    pub(crate) fn of_value(
        name: String,
        location: String,
        header: ArrayHeader,
        data: Range<usize>,
    ) -> Self {
        Self {
            path: location,
            name,
            is_array: true,
            header: Ok(header),
            is_deflated: false,
            size: data.len() as u64,
            data,
            checksum: None,
        }
    }

    /// Where the bytes are in the file; `None` if they are packed.
    pub(crate) fn stored(&self) -> Option<Range<usize>> {
        (!self.is_deflated).then(|| self.data.clone())
    }

    /// Whether it is called as an array is, but has no header of one.
    pub(crate) fn is_unreadable(&self) -> bool {
        self.is_array && self.header.is_err()
    }

    /// Where the pickle of an array of objects begins in the member; `None` for others.
    pub(crate) fn objects(&self) -> Option<usize> {
        let header = self.header.as_ref().ok();
        let header = header.filter(|header| header.element == Element::Object)?;
        Some(header.start)
    }

    /// The first bytes, as many as the longest header has.
    fn start<'a>(&self, bytes: &'a [u8]) -> Cow<'a, [u8]> {
        let packed = &bytes[self.data.clone()];
        if !self.is_deflated {
            return Cow::Borrowed(packed);
        }
        let mut start = Vec::new();
        let mut unpacked = DeflateDecoder::new(packed).take(LONGEST_START as u64);
        // A member that cannot be unpacked ends early, and its header is cut.
        let _ = unpacked.read_to_end(&mut start);
        Cow::Owned(start)
    }
}

/// Whether an archive has the record that ends its directory; a comment of up to 65 535 bytes may follow it.
fn has_directory(bytes: &[u8]) -> bool {
    const SIGNATURE: &[u8] = b"PK\x05\x06";
    const LONGEST: usize = 22 + u16::MAX as usize;
    let end = &bytes[bytes.len().saturating_sub(LONGEST)..];
    end.windows(SIGNATURE.len()).any(|part| part == SIGNATURE)
}

/// Refuses members that share bytes: a few bytes could otherwise unpack to any number.
fn refuse_overlaps(file: &str, members: &[Member]) -> Result<(), Diagnostic> {
    let mut ranges: Vec<(&Range<usize>, &str)> = members
        .iter()
        .filter(|member| !member.data.is_empty())
        .map(|member| (&member.data, &*member.path))
        .collect();
    ranges.sort_unstable_by_key(|(data, _)| data.start);
    match ranges
        .windows(2)
        .find(|pair| pair[1].0.start < pair[0].0.end)
    {
        None => Ok(()),
        Some(pair) => {
            let message = format!(
                "the bytes of this member are those of `{}` too; save the file again",
                pair[0].1
            );
            Err(Diagnostic::new(file, Code::Archive, message).inside(pair[1].1))
        }
    }
}

/// A name that two entries of the central directory share. From APPNOTE.TXT 4.3.12: a signature, and at 28, 30 and 32
/// the lengths of the name, the extra field and the comment, which follow 46 bytes.
fn repeated_name(bytes: &[u8], directory: u64) -> String {
    let mut names = HashSet::new();
    let mut at = usize::try_from(directory).unwrap_or(usize::MAX);
    while let Some(entry) = bytes
        .get(at..)
        .filter(|rest| rest.starts_with(b"PK\x01\x02"))
    {
        let Some(fixed) = entry.get(..46) else { break };
        let length = |at: usize| usize::from(u16::from_le_bytes([fixed[at], fixed[at + 1]]));
        let Some(name) = entry.get(46..46 + length(28)) else {
            break;
        };
        if !names.insert(name) {
            return String::from_utf8_lossy(name).into_owned();
        }
        at += 46 + length(28) + length(30) + length(32);
    }
    "the directory".to_owned()
}
