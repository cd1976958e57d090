//! Reads the records of an MCAP file: messages, and the channels and schemas that describe them.

use std::collections::HashMap;
use std::io::Read;
use std::sync::Arc;

use crate::budget::{Borrowed, Budget, OverBudget};
use crate::diagnostic::{Code, Diagnostic, Location};
use crate::warnings::Warnings;

/// The first and the last bytes of a file.
pub(super) const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// The kinds of records that are read.
const SCHEMA: u8 = 3;
const CHANNEL: u8 = 4;
const MESSAGE: u8 = 5;
const CHUNK: u8 = 6;
const DATA_END: u8 = 15;

/// The largest size of all unpacked chunks together, as a multiple of the memory budget. It limits the time of reading,
/// because only one chunk is in memory at a time.
const UNPACKED: u64 = 16;

/// The channel of a topic: the type and encoding of its messages.
#[derive(Debug, Clone)]
pub(super) struct McapChannel {
    pub(super) topic: String,
    /// The encoding of the messages.
    pub(super) encoding: String,
    /// The name of the messages' type.
    pub(super) schema: Arc<str>,
}

/// A message.
pub(super) struct Record<'a> {
    pub(super) channel: &'a McapChannel,
    /// Time at which it was logged, in nanoseconds.
    pub(super) log_time: u64,
    pub(super) data: &'a [u8],
    /// Offset of the message, or of its chunk, in the file.
    pub(super) offset: u64,
}

/// A file whose records are read in order.
pub(super) struct Records<'a> {
    name: &'a str,
    budget: &'a Budget,
    bytes: &'a [u8],
    at: usize,
    schemas: HashMap<u16, Arc<str>>,
    channels: HashMap<u16, McapChannel>,
    /// The records of the current chunk, the chunk's offset in the file, and the offset of the next record in it.
    chunk: Vec<u8>,
    chunk_offset: u64,
    chunk_at: usize,
    /// The budget's memory of the chunk.
    borrowed: Option<Borrowed<'a>>,
    /// Bytes of all chunks so far, unpacked.
    unpacked: u64,
    /// Whether the record that ends the data was read.
    is_complete: bool,
}

/// The fields of a record, which are not parsed yet.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (bytes, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(bytes)
    }

    fn number<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (bytes, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*bytes)
    }

    fn u16(&mut self) -> Option<u16> {
        self.number().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Option<u32> {
        self.number().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Option<u64> {
        self.number().map(u64::from_le_bytes)
    }

    fn text(&mut self) -> Option<&'a str> {
        let length = self.u32()? as usize;
        std::str::from_utf8(self.take(length)?).ok()
    }
}

/// The next record: its kind, its content, and its length with both.
fn record(bytes: &[u8]) -> Option<(u8, &[u8], usize)> {
    let mut fields = Fields(bytes);
    let [kind] = fields.number()?;
    let length = usize::try_from(fields.u64()?).ok()?;
    Some((kind, fields.take(length)?, length + 9))
}

impl<'a> Records<'a> {
    pub(super) fn new(
        name: &'a str,
        bytes: &'a [u8],
        budget: &'a Budget,
    ) -> Result<Self, Diagnostic> {
        if !bytes.starts_with(MAGIC) {
            let message = "the file does not begin like an MCAP file; is it a bag of ROS 1, or SQLite? convert it first";
            return Err(Diagnostic::new(name, Code::McapDamaged, message));
        }
        Ok(Self {
            name,
            budget,
            bytes,
            at: MAGIC.len(),
            schemas: HashMap::new(),
            channels: HashMap::new(),
            chunk: Vec::new(),
            chunk_offset: 0,
            chunk_at: 0,
            borrowed: None,
            unpacked: 0,
            is_complete: false,
        })
    }

    fn damaged(&self, offset: u64, message: String) -> Diagnostic {
        let mut fault = Diagnostic::new(self.name, Code::McapDamaged, message);
        fault.location = Some(Location::Inside(format!("byte {offset}")));
        fault
    }

    fn warn_cut(warnings: &mut Warnings, offset: u64, message: &str) {
        warnings.warn(Code::McapCut, || {
            (Some(Location::Inside(format!("byte {offset}"))), message)
        });
    }

    /// The next message; `None` at the end. A truncated file ends with a warning.
    ///
    /// # Errors
    /// When the file is damaged, or claims to contain more than its memory budget allows.
    pub(super) fn next(
        &mut self,
        warnings: &mut Warnings,
    ) -> Result<Option<Record<'_>>, Diagnostic> {
        loop {
            let in_chunk = self.chunk_at < self.chunk.len();
            let offset = if in_chunk {
                self.chunk_offset
            } else {
                self.at as u64
            };
            let (bytes, at) = match in_chunk {
                true => (&self.chunk[..], self.chunk_at),
                false => (self.bytes, self.at),
            };
            if at >= bytes.len() || !in_chunk && &bytes[at..] == MAGIC {
                if !self.is_complete || !self.bytes.ends_with(MAGIC) {
                    Self::warn_cut(
                        warnings,
                        self.bytes.len() as u64,
                        "the end of the log is missing, for example because the recording was interrupted; everything \
                         before is read",
                    );
                }
                return Ok(None);
            }
            let Some((kind, content, length)) = record(&bytes[at..]) else {
                if in_chunk {
                    return Err(
                        self.damaged(offset, "a record runs over the end of its chunk".to_owned())
                    );
                }
                Self::warn_cut(
                    warnings,
                    offset,
                    "the file ends within a record; what is before it is read",
                );
                self.at = self.bytes.len();
                return Ok(None);
            };
            match in_chunk {
                true => self.chunk_at += length,
                false => self.at += length,
            }
            let broken = |record: &str| {
                format!("a record of a {record} is too short, or its texts are not UTF-8")
            };
            match kind {
                SCHEMA => {
                    let mut fields = Fields(content);
                    let found = fields.u16().zip(fields.text());
                    let found = found.map(|(id, name)| (id, Arc::from(name)));
                    let (id, name): (u16, Arc<str>) =
                        found.ok_or_else(|| self.damaged(offset, broken("schema")))?;
                    self.keep(name.len())?;
                    self.schemas.insert(id, name);
                }
                CHANNEL => {
                    let mut fields = Fields(content);
                    let found = (|| {
                        let (id, schema) = (fields.u16()?, fields.u16()?);
                        Some((
                            id,
                            schema,
                            fields.text()?.to_owned(),
                            fields.text()?.to_owned(),
                        ))
                    })();
                    let (id, schema, topic, encoding) =
                        found.ok_or_else(|| self.damaged(offset, broken("channel")))?;
                    self.keep(topic.len() + encoding.len())?;
                    let schema = self.schemas.get(&schema).cloned().unwrap_or_default();
                    let channel = McapChannel {
                        topic,
                        encoding,
                        schema,
                    };
                    self.channels.insert(id, channel);
                }
                MESSAGE => {
                    let mut fields = Fields(content);
                    let head = (|| {
                        let (id, _, log_time, _) =
                            (fields.u16()?, fields.u32()?, fields.u64()?, fields.u64()?);
                        Some((id, log_time))
                    })();
                    let Some((id, log_time)) = head else {
                        return Err(self.damaged(offset, broken("message")));
                    };
                    if !self.channels.contains_key(&id) {
                        return Err(self.damaged(
                            offset,
                            format!("a message of channel {id}, which is not there"),
                        ));
                    }
                    // The function returns a reference to these bytes, so they are borrowed again, outside the loop's
                    // borrow.
                    let bytes = if in_chunk {
                        &self.chunk[..]
                    } else {
                        self.bytes
                    };
                    let data = &bytes[at + 9 + 22..at + length];
                    return Ok(Some(Record {
                        channel: &self.channels[&id],
                        log_time,
                        data,
                        offset,
                    }));
                }
                CHUNK if in_chunk => {
                    return Err(self.damaged(offset, "a chunk within a chunk".to_owned()));
                }
                CHUNK => {
                    let content = &self.bytes[at + 9..at + length];
                    (self.chunk, self.borrowed) = (Vec::new(), None);
                    let (chunk, borrowed) = self.unpack(content, offset)?;
                    (self.chunk, self.chunk_offset, self.chunk_at) = (chunk, offset, 0);
                    self.borrowed = Some(borrowed);
                }
                // The rest of the file is an index and a summary, which only repeat the channels.
                DATA_END if !in_chunk => {
                    self.at = self.bytes.len();
                    self.is_complete = true;
                }
                _ => {}
            }
        }
    }

    /// Takes memory from the budget for an entry with texts of `length` bytes.
    fn keep(&self, length: usize) -> Result<(), Diagnostic> {
        let charged = self.budget.take(length + 200, 1);
        charged.map_err(|error| Diagnostic::new(self.name, Code::Memory, error.to_string()))
    }

    /// The unpacked records of a chunk.
    fn unpack(
        &mut self,
        content: &[u8],
        offset: u64,
    ) -> Result<(Vec<u8>, Borrowed<'a>), Diagnostic> {
        let mut fields = Fields(content);
        let head = (|| {
            let (_, _, size, sum) = (fields.u64()?, fields.u64()?, fields.u64()?, fields.u32()?);
            let compression = fields.text()?;
            let length = usize::try_from(fields.u64()?).ok()?;
            Some((size, sum, compression, fields.take(length)?))
        })();
        let Some((size, sum, compression, packed)) = head else {
            return Err(self.damaged(offset, "a chunk is shorter than its header says".to_owned()));
        };
        let size = usize::try_from(size).unwrap_or(usize::MAX);
        let over = |error: OverBudget| Diagnostic::new(self.name, Code::Memory, error.to_string());
        let borrowed = self.budget.borrow(size, 1).map_err(over)?;
        // Chunks are unpacked one after another, so that memory does not limit how many there are.
        self.unpacked = self.unpacked.saturating_add(size as u64);
        let limit = UNPACKED.saturating_mul(self.budget.limit());
        if self.unpacked > limit {
            let message = format!(
                "its chunks have more than {limit} bytes when they are unpacked, the limit for an input of this \
                 length; \
                 it states more than a recording contains"
            );
            return Err(Diagnostic::new(self.name, Code::Memory, message));
        }
        let unpacked = match compression {
            "" => Ok(packed.to_vec()),
            "zstd" => {
                let unpacked = zstd::bulk::decompress(packed, size);
                unpacked.map_err(|error| error.to_string())
            }
            "lz4" => {
                let mut unpacked = Vec::new();
                let decoder = lz4_flex::frame::FrameDecoder::new(packed);
                let read = decoder.take(size as u64 + 1).read_to_end(&mut unpacked);
                read.map(|_| unpacked).map_err(|error| error.to_string())
            }
            other => {
                let message = format!("a chunk is compressed by `{other}`; zstd and lz4 are read");
                return Err(self.damaged(offset, message));
            }
        };
        let unpacked = unpacked.map_err(|reason| {
            self.damaged(offset, format!("a chunk cannot be unpacked: {reason}"))
        })?;
        if unpacked.len() != size {
            let message = format!(
                "a chunk has {} bytes, but its header says {size}",
                unpacked.len()
            );
            return Err(self.damaged(offset, message));
        }
        let mut crc = flate2::Crc::new();
        crc.update(&unpacked);
        if sum != 0 && crc.sum() != sum {
            let message = format!(
                "the checksum of a chunk is {:#010x}, but its header says {sum:#010x}",
                crc.sum()
            );
            return Err(self.damaged(offset, message));
        }
        Ok((unpacked, borrowed))
    }
}
