//! The container of a file: JSON alone (`.gltf`), or JSON, a BIN chunk and perhaps others (GLB).

use std::io::{self, Read, Write};
use std::ops::Range;

use crate::diagnostic::{Code, Diagnostic};
use crate::foreign;
use crate::gltf::json::Json;
use crate::warnings::Warnings;

/// The first bytes of a GLB.
pub(super) const MAGIC: &[u8] = b"glTF";

const JSON: u32 = u32::from_le_bytes(*b"JSON");
const BIN: u32 = u32::from_le_bytes(*b"BIN\0");
const VERSION: u32 = 2;
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// A file in memory.
#[derive(Debug)]
pub(super) struct Container {
    /// The JSON, without a byte-order mark.
    pub(super) text: String,
    /// The other chunks of a GLB; `None` for JSON alone.
    glb: Option<Chunks>,
}

#[derive(Debug)]
struct Chunks {
    bytes: Vec<u8>,
    /// Type and byte range of each chunk, in the order of the file.
    list: Vec<(u32, Range<usize>)>,
}

impl Container {
    /// Splits a file into its chunks; `name` is the file's name in messages.
    ///
    /// # Errors
    /// When a GLB is not complete, or when the JSON is not UTF-8.
    pub(super) fn parse(
        name: &str,
        bytes: Vec<u8>,
        warnings: &mut Warnings,
    ) -> Result<Self, Diagnostic> {
        let refuse = |code, message: String| Diagnostic::new(name, code, message);
        let is_glb = bytes.starts_with(MAGIC);
        let chunks = match is_glb {
            true => chunks(&bytes).map_err(|(code, message)| refuse(code, message))?,
            false => Vec::new(),
        };
        let json = chunks
            .first()
            .map_or(0..bytes.len(), |(_, range)| range.clone());
        let mut json = &bytes[json];
        if let Some(rest) = json.strip_prefix(BYTE_ORDER_MARK) {
            json = rest;
            warnings.warn(Code::ByteOrderMark, || {
                (None, "a byte-order mark before the JSON; it is ignored")
            });
        }
        let is_other = !is_glb && !json.trim_ascii_start().starts_with(b"{");
        if let Some(description) = foreign::description("", json).filter(|_| is_other) {
            let message = format!("this looks like {description}");
            return Err(refuse(Code::OtherFormat, message));
        }
        let text = std::str::from_utf8(json).map_err(|error| {
            let offset = error.valid_up_to();
            let message = format!("byte {offset} of the JSON is not UTF-8; save the file as UTF-8");
            refuse(Code::Encoding, message)
        })?;
        let text = text.to_owned();
        let glb = is_glb.then(|| Chunks {
            bytes,
            list: chunks.into_iter().skip(1).collect(),
        });
        Ok(Self { text, glb })
    }

    /// Number of bytes of the file.
    pub(super) fn length(&self) -> usize {
        self.glb
            .as_ref()
            .map_or(self.text.len(), |glb| glb.bytes.len())
    }

    pub(super) fn is_glb(&self) -> bool {
        self.glb.is_some()
    }

    /// The data of the BIN chunk.
    pub(super) fn bin(&self) -> Option<&[u8]> {
        let glb = self.glb.as_ref()?;
        let (_, range) = glb.list.iter().find(|(kind, _)| *kind == BIN)?;
        Some(&glb.bytes[range.clone()])
    }

    /// Writes a GLB with this JSON, these parts of a BIN chunk, and the other chunks of the file.
    ///
    /// # Errors
    /// When writing fails, or (`FileTooLarge`) when the GLB would be too long.
    pub(super) fn write_glb(
        &self,
        text: &str,
        bin: Option<&[&[u8]]>,
        out: &mut dyn Write,
    ) -> io::Result<()> {
        let text = text.trim_end();
        let json = vec![text.as_bytes(), padding(text.len(), b"   ")];
        let mut chunks: Vec<(u32, Vec<&[u8]>)> = vec![(JSON, json)];
        let mut bin = bin.map(<[_]>::to_vec);
        if let Some(glb) = &self.glb {
            if self.bin().is_none() {
                chunks.extend(bin.take().map(|parts| (BIN, parts)));
            }
            for (kind, range) in &glb.list {
                let replaced = bin.take_if(|_| *kind == BIN);
                chunks.push((
                    *kind,
                    replaced.unwrap_or_else(|| vec![&glb.bytes[range.clone()]]),
                ));
            }
        }
        chunks.extend(bin.map(|parts| (BIN, parts)));
        let length = |parts: &[&[u8]]| parts.iter().map(|part| part.len() as u64).sum::<u64>();
        let total = 12
            + chunks
                .iter()
                .map(|(_, parts)| 8 + length(parts))
                .sum::<u64>();
        let word = |value: u64| u32::try_from(value).map_err(|_| io::ErrorKind::FileTooLarge);
        let total = word(total)?;
        out.write_all(MAGIC)?;
        out.write_all(&VERSION.to_le_bytes())?;
        out.write_all(&total.to_le_bytes())?;
        for (kind, parts) in chunks {
            out.write_all(&word(length(&parts))?.to_le_bytes())?;
            out.write_all(&kind.to_le_bytes())?;
            for part in parts {
                out.write_all(part)?;
            }
        }
        Ok(())
    }
}

/// The JSON of a file, read without the other chunks of a GLB; `None` if the file is invalid, or if the JSON is longer
/// than `limit`.
pub(super) fn json_alone(mut file: impl Read, limit: u64) -> Option<String> {
    let mut bytes = Vec::new();
    file.by_ref().take(20).read_to_end(&mut bytes).ok()?;
    let is_glb = bytes.starts_with(MAGIC);
    let length = match is_glb {
        true => {
            let length = u32::from_le_bytes(*bytes.get(12..)?.first_chunk()?);
            bytes.clear();
            Some(u64::from(length)).filter(|&length| length <= limit)?
        }
        false => limit.saturating_add(1),
    };
    let rest = length.saturating_sub(bytes.len() as u64);
    file.take(rest).read_to_end(&mut bytes).ok()?;
    if (bytes.len() as u64 == length) != is_glb {
        return None;
    }
    let text = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(&bytes);
    String::from_utf8(text.to_vec()).ok()
}

/// The bytes that make a length a multiple of four.
pub(super) fn padding(length: usize, with: &[u8; 3]) -> &[u8] {
    &with[..length.wrapping_neg() % 4]
}

type ContainerFault = (Code, String);

/// The chunks of a GLB; the first is the JSON.
fn chunks(bytes: &[u8]) -> Result<Vec<(u32, Range<usize>)>, ContainerFault> {
    let broken = |message: String| (Code::Glb, message);
    let word = |at: usize| -> Option<u32> {
        let four = bytes.get(at..)?.first_chunk()?;
        Some(u32::from_le_bytes(*four))
    };
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        let message = format!("{} bytes; the header of a GLB alone has 12", bytes.len());
        return Err(broken(message));
    };
    if version != VERSION {
        let message = format!("a GLB of version {version}; export it as glTF 2.0");
        return Err((Code::GltfVersion, message));
    }
    if length as usize != bytes.len() {
        let found = bytes.len();
        let message =
            format!("the header says {length} bytes, and the file has {found}; copy it again");
        return Err(broken(message));
    }
    let mut chunks = Vec::new();
    let mut offset = 12;
    while offset < bytes.len() {
        let header = word(offset).zip(word(offset + 4));
        let data = header.and_then(|(length, kind)| {
            let data = offset + 8..(offset + 8).checked_add(length as usize)?;
            (data.end <= bytes.len()).then_some((kind, data))
        });
        let Some((kind, data)) = data else {
            return Err(broken(format!(
                "the chunk at byte {offset} is truncated; copy the file again"
            )));
        };
        match (chunks.is_empty(), kind == JSON) {
            (true, false) => {
                return Err(broken(
                    "the first chunk is not the JSON; export the file again".into(),
                ));
            }
            (false, true) => {
                return Err(broken(format!(
                    "a second JSON chunk at byte {offset}; export the file again"
                )));
            }
            _ => {}
        }
        offset = data.end;
        chunks.push((kind, data));
    }
    match chunks.is_empty() {
        true => Err(broken(
            "there is no JSON chunk; export the file again".into(),
        )),
        false => Ok(chunks),
    }
}

/// # Errors
/// When a GLB would be too long.
pub(super) fn check_length(json: &Json<'_>, length: u64) -> Result<(), Diagnostic> {
    if length <= u64::from(u32::MAX) {
        return Ok(());
    }
    let message = format!(
        "the GLB would have {length} bytes and more, and can have {}; sample at a lower rate",
        u32::MAX
    );
    Err(Diagnostic::new(json.name, Code::GlbTooLong, message))
}
