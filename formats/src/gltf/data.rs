//! Adds bytes to the buffers of a file.

use serde_json::value::RawValue;

use crate::diagnostic::Diagnostic;
use crate::gltf::container::padding;
use crate::gltf::edits::Edits;
use crate::gltf::json::{Json, JsonMembers};
use crate::gltf::reader::GltfReader;
use crate::gltf::schema::Buffer;
use crate::gltf::uri;

/// The new bytes of a file, and their buffer.
pub(super) struct BufferData<'a> {
    home: BufferHome<'a>,
    buffer: usize,
    bytes: Vec<u8>,
}

enum BufferHome<'a> {
    /// After the bytes of the BIN chunk; with the length of its buffer in the JSON, if it has one.
    Bin(&'a [u8], Option<&'a RawValue>),
    /// After the buffers that are gathered in a BIN chunk.
    Gathered(GatheredBuffers),
    /// In a separate buffer, as a data URI.
    Uri,
}

/// The buffers of a GLB: the BIN chunk, and those that could not be gathered in it.
pub(super) struct GatheredBuffers {
    /// The properties of the first gathered buffer, except its length and its URI.
    pub(super) members: String,
    pub(super) kept: Vec<String>,
}

impl GatheredBuffers {
    /// The list of buffers, with a BIN chunk of `length` bytes.
    fn buffers(&self, length: u64) -> String {
        let bin = format!("{{\"byteLength\":{length}{}}}", self.members);
        let all = std::iter::once(&bin).chain(&self.kept);
        let all: Vec<&str> = all.map(String::as_str).collect();
        format!("[{}]", all.join(","))
    }
}

impl<'a> BufferData<'a> {
    /// For bytes after the BIN chunk of a GLB, or in a separate buffer if that is not possible.
    ///
    /// # Errors
    /// When the first buffer is invalid.
    pub(super) fn of_file(
        json: &'a Json<'a>,
        reader: &GltfReader<'a>,
        bin: &'a [u8],
    ) -> Result<Self, Diagnostic> {
        let home = match json.entries("buffers").first() {
            None => BufferHome::Bin(bin, None),
            Some(raw) => {
                let buffer: Buffer<'a> = json.typed(raw, "/buffers/0")?;
                let members: JsonMembers<'a> = json.typed(raw, "/buffers/0")?;
                match reader.bin(0, &buffer) {
                    Some(bin) => BufferHome::Bin(bin, members.get("byteLength")),
                    None => return Ok(Self::in_uri(json)),
                }
            }
        };
        Ok(Self {
            home,
            buffer: 0,
            bytes: Vec::new(),
        })
    }

    /// For bytes in a separate buffer.
    pub(super) fn in_uri(json: &Json<'_>) -> Self {
        Self {
            home: BufferHome::Uri,
            buffer: json.entries("buffers").len(),
            bytes: Vec::new(),
        }
    }

    /// For bytes after gathered buffers.
    pub(super) fn gathered(gathered: GatheredBuffers, bytes: Vec<u8>) -> Self {
        Self {
            home: BufferHome::Gathered(gathered),
            buffer: 0,
            bytes,
        }
    }

    fn before(&self) -> &'a [u8] {
        match self.home {
            BufferHome::Bin(bin, _) => bin,
            _ => &[],
        }
    }

    /// Offset of the new bytes in their buffer.
    fn base(&self) -> usize {
        let before = self.before().len();
        before + padding(before, &[0; 3]).len()
    }

    /// The length of the buffer with `more` bytes.
    pub(super) fn length_with(&self, more: u64) -> u64 {
        (self.base() + self.bytes.len()) as u64 + more
    }

    /// Appends bytes, aligned to four; returns the index of their buffer view.
    pub(super) fn append(&mut self, edits: &mut Edits<'_>, bytes: &[u8]) -> usize {
        self.bytes
            .extend_from_slice(padding(self.bytes.len(), &[0; 3]));
        let view = format!(
            "{{\"buffer\":{},\"byteOffset\":{},\"byteLength\":{}}}",
            self.buffer,
            self.base() + self.bytes.len(),
            bytes.len()
        );
        self.bytes.extend_from_slice(bytes);
        edits.append_to("bufferViews", view)
    }

    /// Writes the entry of the buffer; returns the parts of the BIN chunk, if the file has one.
    pub(super) fn finish(&self, json: &Json<'_>, edits: &mut Edits<'_>) -> Option<Vec<&[u8]>> {
        let pad = |length: usize| padding(length, &[0; 3]);
        let length = self.length_with(0);
        match &self.home {
            BufferHome::Bin(bin, _) if self.bytes.is_empty() => {
                (!bin.is_empty()).then(|| vec![*bin])
            }
            BufferHome::Bin(bin, said) => {
                match said {
                    Some(said) => edits.replace(said, length),
                    None => {
                        edits.append_to("buffers", format!("{{\"byteLength\":{length}}}"));
                    }
                }
                Some(vec![
                    bin,
                    pad(bin.len()),
                    &self.bytes,
                    pad(self.bytes.len()),
                ])
            }
            BufferHome::Gathered(gathered) => {
                if let Some(buffers) = json.array("buffers") {
                    edits.replace(buffers, gathered.buffers(length));
                }
                Some(vec![&self.bytes, pad(self.bytes.len())])
            }
            BufferHome::Uri => {
                if !self.bytes.is_empty() {
                    let uri = uri::of_bytes(&self.bytes);
                    edits.append_to(
                        "buffers",
                        format!("{{\"byteLength\":{length},\"uri\":\"{uri}\"}}"),
                    );
                }
                None
            }
        }
    }
}
