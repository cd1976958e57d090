//! Where the bytes go that a file gets.

use serde_json::value::RawValue;

use crate::diagnostic::Diagnostic;
use crate::gltf::container::padding;
use crate::gltf::edits::Edits;
use crate::gltf::json::{Json, JsonMembers};
use crate::gltf::reader::GltfReader;
use crate::gltf::schema::Buffer;
use crate::gltf::uri;

/// The bytes that a file gets, and the buffer that they are in.
pub(super) struct BufferData<'a> {
    home: BufferHome<'a>,
    buffer: usize,
    bytes: Vec<u8>,
}

enum BufferHome<'a> {
    /// Behind what the BIN chunk has; the length that its buffer says, if it has one.
    Bin(&'a [u8], Option<&'a RawValue>),
    /// Behind the buffers that are gathered into a BIN chunk.
    Gathered(GatheredBuffers),
    /// A buffer of its own, as a data URI.
    Uri,
}

/// The buffers of a GLB: the BIN chunk, and those that could not be gathered.
pub(super) struct GatheredBuffers {
    /// What the first gathered buffer says of itself beside its length and URI.
    pub(super) members: String,
    pub(super) kept: Vec<String>,
}

impl GatheredBuffers {
    /// The list of buffers, for a BIN chunk of so many bytes.
    fn buffers(&self, length: u64) -> String {
        let bin = format!("{{\"byteLength\":{length}{}}}", self.members);
        let all = std::iter::once(&bin).chain(&self.kept);
        let all: Vec<&str> = all.map(String::as_str).collect();
        format!("[{}]", all.join(","))
    }
}

impl<'a> BufferData<'a> {
    /// Behind the BIN chunk of a GLB, or in a buffer of their own where that cannot be.
    ///
    /// # Errors
    /// When the first buffer is broken.
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

    /// In a buffer of their own.
    pub(super) fn in_uri(json: &Json<'_>) -> Self {
        Self {
            home: BufferHome::Uri,
            buffer: json.entries("buffers").len(),
            bytes: Vec::new(),
        }
    }

    /// Behind gathered buffers.
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

    /// Where the new bytes begin in their buffer.
    fn base(&self) -> usize {
        let before = self.before().len();
        before + padding(before, &[0; 3]).len()
    }

    /// The length of the buffer with so many more bytes.
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

    /// Writes the entry of the buffer; gives what the BIN chunk is made of, if the file has one.
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
