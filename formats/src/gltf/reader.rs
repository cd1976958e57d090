//! Finds, loads and decodes buffers and their views, each once and only if it is needed.

mod accessor;

use std::borrow::Cow;
use std::cell::{OnceCell, RefCell};
use std::path::Path;

use crate::budget::{Borrowed, Budget};
use crate::diagnostic::{Code, Diagnostic, Location};
use crate::gltf::compressed;
use crate::gltf::container::Container;
use crate::gltf::json::Json;
use crate::gltf::schema::{Accessor, Buffer, BufferView, MeshoptView};
use crate::gltf::uri;
use crate::limits::Limits;
use crate::source::Source;
use crate::warnings::Warnings;

/// The extensions that compress a buffer view.
pub(super) const MESHOPT: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// Bytes of memory of a node, with its name and its rest transform.
const NODE: usize = 640;

/// Number of bytes that may follow the buffer in a BIN chunk, as padding.
const PADDING: u64 = 3;

/// A file that is being read.
pub(super) struct GltfReader<'a> {
    pub(super) json: &'a Json<'a>,
    container: &'a Container,
    /// The folder of other files; `None` for standard input.
    folder: Option<&'a Path>,
    limits: Limits,
    /// The extensions that the file requires.
    required: Vec<String>,
    budget: Budget,
    buffers: Vec<OnceCell<Result<Cow<'a, [u8]>, Diagnostic>>>,
    /// The decoded bytes of compressed views.
    decoded: Vec<OnceCell<Result<Vec<u8>, Diagnostic>>>,
    pub(super) warnings: RefCell<Warnings>,
}

/// The bytes of a buffer view.
pub(super) struct View<'a> {
    pub(super) bytes: &'a [u8],
    /// Number of bytes from one element to the next; `None` if they are packed.
    pub(super) stride: Option<usize>,
}

impl<'a> GltfReader<'a> {
    /// # Errors
    /// When the list of required extensions is invalid.
    pub(super) fn new(
        json: &'a Json<'a>,
        container: &'a Container,
        folder: Option<&'a Path>,
        limits: Limits,
        warnings: Warnings,
    ) -> Result<Self, Diagnostic> {
        let budget = Budget::of(container.length(), limits);
        budget
            .take(json.entries("nodes").len(), NODE)
            .map_err(|error| json.refuse("/nodes", Code::Memory, error.to_string()))?;
        let required = json.member("extensionsRequired")?;
        let required = required.map(|raw| json.typed(raw, "/extensionsRequired"));
        let cells = |list| json.entries(list).len();
        Ok(Self {
            json,
            container,
            folder,
            limits,
            budget,
            required: required.transpose()?.unwrap_or_default(),
            buffers: (0..cells("buffers")).map(|_| OnceCell::new()).collect(),
            decoded: (0..cells("bufferViews")).map(|_| OnceCell::new()).collect(),
            warnings: RefCell::new(warnings),
        })
    }

    /// Takes memory for `count` elements of `bytes` each, which the part of the file at `pointer` needs.
    ///
    /// # Errors
    /// When the memory budget does not allow it.
    pub(super) fn take(&self, count: usize, bytes: usize, pointer: &str) -> Result<(), Diagnostic> {
        self.budget
            .take(count, bytes)
            .map_err(|error| self.json.refuse(pointer, Code::Memory, error.to_string()))
    }

    /// As [`GltfReader::take`]; the memory is returned when the value is dropped.
    ///
    /// # Errors
    /// As [`GltfReader::take`].
    pub(super) fn borrow(
        &self,
        count: usize,
        bytes: usize,
        pointer: &str,
    ) -> Result<Borrowed<'_>, Diagnostic> {
        self.budget
            .borrow(count, bytes)
            .map_err(|error| self.json.refuse(pointer, Code::Memory, error.to_string()))
    }

    pub(super) fn required(&self) -> &[String] {
        &self.required
    }

    pub(super) fn warn<M: Into<String>>(
        &self,
        code: Code,
        pointer: &str,
        message: impl FnOnce() -> M,
    ) {
        let location = || Some(Location::Inside(pointer.to_owned()));
        self.warnings
            .borrow_mut()
            .warn(code, || (location(), message()));
    }

    /// Whether the file has at least `count` bytes: an accessor without bytes may not have more elements.
    pub(super) fn fits(&self, count: u64) -> bool {
        let bin = self.container.bin().map_or(0, <[u8]>::len);
        count <= (self.json.text.len() + bin) as u64
    }

    /// The bytes of a buffer, as many as its entry contains; `from` is the JSON pointer of the value that names it.
    ///
    /// # Errors
    /// When they cannot be found, or are too few.
    pub(super) fn buffer(&self, index: usize, from: &str) -> Result<&[u8], Diagnostic> {
        let Some(cell) = self.buffers.get(index) else {
            let count = self.buffers.len();
            return Err(self.json.no_such("buffers", index, count, from));
        };
        let loaded = cell.get_or_init(|| self.load(index));
        loaded.as_deref().map_err(Clone::clone)
    }

    fn load(&self, index: usize) -> Result<Cow<'a, [u8]>, Diagnostic> {
        let pointer = format!("/buffers/{index}");
        let buffer: Buffer<'a> = self.json.entry("buffers", index, &pointer)?;
        let (bytes, spare) = match &buffer.uri {
            Some(uri) => (Cow::Owned(self.follow(uri, &pointer)?), 0),
            None => match self.bin(index, &buffer) {
                Some(bin) => (Cow::Borrowed(bin), PADDING),
                None => {
                    let message = "the buffer has no URI and is not the BIN chunk; export the file \
                                   again";
                    return Err(self.json.refuse(&pointer, Code::TooShort, message));
                }
            },
        };
        let (said, found) = (buffer.byte_length, bytes.len() as u64);
        if found < said {
            let message =
                format!("the buffer says {said} bytes, and there are {found}; is it truncated?");
            return Err(self.json.refuse(&pointer, Code::TooShort, message));
        }
        if found - said > spare {
            self.warn(Code::BufferLong, &pointer, || {
                format!("the buffer says {said} bytes, and there are {found}; the rest is not read")
            });
        }
        Ok(match bytes {
            Cow::Borrowed(bytes) => Cow::Borrowed(&bytes[..said as usize]),
            Cow::Owned(mut bytes) => {
                bytes.truncate(said as usize);
                Cow::Owned(bytes)
            }
        })
    }

    /// The BIN chunk, if it is this buffer.
    pub(super) fn bin(&self, index: usize, buffer: &Buffer<'_>) -> Option<&'a [u8]> {
        let is_bin = index == 0 && buffer.uri.is_none() && !buffer.extensions.is_fallback();
        self.container.bin().filter(|_| is_bin)
    }

    /// The data of a URI; `pointer` is the JSON pointer of the object with the URI.
    ///
    /// # Errors
    /// When the URI is refused, or its data cannot be read.
    pub(super) fn follow(&self, uri: &str, pointer: &str) -> Result<Vec<u8>, Diagnostic> {
        let pointer = format!("{pointer}/uri");
        let refuse = |message| self.json.refuse(&pointer, Code::Uri, message);
        if uri::is_data(uri) {
            return uri::data(uri).map_err(refuse);
        }
        let path = uri::relative(uri).map_err(refuse)?;
        let Some(folder) = self.folder else {
            let message = format!(
                "`{uri}` is a file of its own, which is not found from standard input or bytes in memory"
            );
            return Err(refuse(message));
        };
        let read =
            Source::open_beneath(folder, &path).and_then(|file| file.into_bytes(self.limits.file));
        let read = read.inspect(|bytes| self.budget.add_input(bytes.len()));
        read.map_err(|error| {
            let message = format!("{}: {}", path.display(), error.message);
            self.json.refuse(&pointer, error.code, message)
        })
    }

    /// The bytes of a buffer view, decoded if they are compressed; `from` is the JSON pointer of the value that names
    /// it.
    ///
    /// # Errors
    /// When the view or its buffer is invalid, or needs an unknown extension.
    pub(super) fn view(&self, index: usize, from: &str) -> Result<View<'_>, Diagnostic> {
        let view: BufferView<'a> = self.json.entry("bufferViews", index, from)?;
        let pointer = format!("/bufferViews/{index}");
        for (name, extension) in &view.extensions.0 {
            if MESHOPT.contains(&name.as_str()) {
                let pointer = format!("{pointer}/extensions/{name}");
                let compressed: MeshoptView = self.json.typed(extension, &pointer)?;
                let decoded =
                    self.decoded[index].get_or_init(|| self.decode(&compressed, &pointer));
                return Ok(View {
                    bytes: decoded.as_deref().map_err(Clone::clone)?,
                    stride: Some(compressed.byte_stride),
                });
            }
            if self.required.contains(name) {
                let message = format!("the data needs the extension {name}, which is not known");
                return Err(self.json.refuse(&pointer, Code::Extension, message));
            }
        }
        let bytes = self.part(view.buffer, view.byte_offset, view.byte_length, &pointer)?;
        Ok(View {
            bytes,
            stride: view.byte_stride,
        })
    }

    /// Warns of a stride in the view of an accessor that does not contain vertices.
    pub(super) fn warn_of_stride(&self, accessor: &Accessor) {
        let Some(index) = accessor.buffer_view else {
            return;
        };
        let pointer = format!("/bufferViews/{index}");
        let view = self
            .json
            .entry::<BufferView<'a>>("bufferViews", index, &pointer);
        let Ok(view) = view else {
            return;
        };
        let is_compressed = |(name, _): &(String, _)| MESHOPT.contains(&name.as_str());
        if let Some(stride) = view.byte_stride
            && !view.extensions.0.iter().any(is_compressed)
        {
            self.warn(Code::ByteStride, &format!("{pointer}/byteStride"), || {
                format!(
                    "a stride of {stride} bytes is allowed only for vertices; it is used anyway"
                )
            });
        }
    }

    fn decode(&self, view: &MeshoptView, pointer: &str) -> Result<Vec<u8>, Diagnostic> {
        let bytes = self.part(view.buffer, view.byte_offset, view.byte_length, pointer)?;
        self.take(view.count, view.byte_stride, pointer)?;
        compressed::decode(bytes, view, self.limits.file)
            .map_err(|message| self.json.refuse(pointer, Code::Meshopt, message))
    }

    /// A part of a buffer; `pointer` is the JSON pointer of the object that names it.
    fn part(
        &self,
        buffer: usize,
        offset: u64,
        length: u64,
        pointer: &str,
    ) -> Result<&[u8], Diagnostic> {
        let bytes = self.buffer(buffer, &format!("{pointer}/buffer"))?;
        let end = offset.checked_add(length);
        let part = end
            .and_then(|end| bytes.get(usize::try_from(offset).ok()?..usize::try_from(end).ok()?));
        part.ok_or_else(|| {
            let message = format!(
                "{length} bytes from byte {offset} on lie outside buffer {buffer}, which has {}",
                bytes.len()
            );
            self.json.refuse(pointer, Code::TooShort, message)
        })
    }
}
