//! Reads the messages of an Arrow file or stream. Each is checked against the length of the file before it is
//! decoded, because the crate `arrow` trusts the offsets and counts in it.

use arrow_buffer::Buffer;
use arrow_ipc::{
    CompressionType, DictionaryBatch, Message, MessageHeader, MetadataVersion, RecordBatch, Schema,
    root_as_footer, root_as_message,
};

use crate::budget::Budget;
use crate::diagnostic::{Code, Diagnostic};
use crate::limits::Limits;

/// The first and the last bytes of a file.
pub(crate) const MAGIC: &[u8] = b"ARROW1";

/// The bytes before each message of a stream.
const CONTINUATION: [u8; 4] = [0xff; 4];

/// Length of the prefix of a compressed buffer, which is its uncompressed length.
const PREFIX: usize = 8;

/// The largest number of bytes that each byte of a compressed file may unpack to, on average. Equal numbers may
/// compress further, but the times in the same file differ.
const MAX_EXPANSION: u64 = 1024;

/// Bytes of memory for each row of a column and for each unpacked byte. The memory is that of decoding, of the table's
/// columns and of the keys.
const DECODED: usize = 8;

/// Whether the first bytes are those of a stream: a message of a plausible length.
pub(crate) fn is_stream(start: &[u8]) -> bool {
    let length = start
        .strip_prefix(&CONTINUATION)
        .and_then(<[u8]>::first_chunk);
    length.is_some_and(|length| (1..1 << 24).contains(&i32::from_le_bytes(*length)))
}

/// A message that contains rows or a dictionary.
pub(crate) struct DataMessage<'a> {
    pub(crate) version: MetadataVersion,
    pub(crate) body: MessageBody<'a>,
    /// The bytes from which the message's offsets count.
    pub(crate) data: Buffer,
}

pub(crate) enum MessageBody<'a> {
    Dictionary(DictionaryBatch<'a>),
    Rows(RecordBatch<'a>),
}

/// The messages of a file, in the order in which they are read.
pub(crate) struct Messages<'a> {
    name: &'a str,
    bytes: &'a Buffer,
    /// Locations of the blocks of a file; `None` for a stream.
    blocks: Option<std::vec::IntoIter<(u64, u64, u64)>>,
    schema: Option<Schema<'a>>,
    /// Offset of the next message of a stream.
    at: usize,
    /// How many bytes may still be unpacked, or numbers be read.
    left: u64,
    budget: Budget,
}

impl<'a> Messages<'a> {
    /// Looks for the footer of a file; without one the bytes are a stream.
    pub(crate) fn of(name: &'a str, bytes: &'a Buffer, limits: Limits) -> Result<Self, Diagnostic> {
        let mut messages = Self {
            budget: Budget::of(bytes.len(), limits),
            name,
            bytes,
            blocks: None,
            schema: None,
            at: 0,
            left: (bytes.len() as u64).saturating_mul(MAX_EXPANSION),
        };
        if bytes.starts_with(MAGIC) {
            messages.read_footer()?;
        } else if !is_stream(bytes) {
            let reason =
                "the file begins neither with ARROW1 nor as a stream does; it is not Arrow IPC";
            return Err(messages.damaged(reason));
        }
        Ok(messages)
    }

    fn damaged(&self, reason: &str) -> Diagnostic {
        Diagnostic::new(self.name, Code::TableDamaged, reason)
    }

    fn claims(&self) -> Diagnostic {
        let message = format!(
            "the file has {} bytes and states more data than could be compressed into them; it is damaged",
            self.bytes.len()
        );
        Diagnostic::new(self.name, Code::TableClaims, message)
    }

    fn read_footer(&mut self) -> Result<(), Diagnostic> {
        let bytes = self.bytes.as_slice();
        let cut =
            || self.damaged("the file does not end with ARROW1; it is truncated, copy it again");
        let rest = bytes.strip_suffix(MAGIC).ok_or_else(cut)?;
        let (rest, length) = rest.split_last_chunk::<4>().ok_or_else(cut)?;
        let footer = usize::try_from(i32::from_le_bytes(*length)).ok();
        let footer = footer.and_then(|length| rest.len().checked_sub(length));
        let wrong = || self.damaged("its footer cannot be read; the file is damaged");
        let footer = root_as_footer(&rest[footer.ok_or_else(wrong)?..]).map_err(|_| wrong())?;
        let lists = [footer.dictionaries(), footer.recordBatches()];
        let blocks: Option<Vec<(u64, u64, u64)>> = lists
            .into_iter()
            .flatten()
            .flatten()
            .map(|block| {
                let number = |number: i64| u64::try_from(number).ok();
                let head = number(i64::from(block.metaDataLength()))?;
                Some((number(block.offset())?, head, number(block.bodyLength())?))
            })
            .collect();
        let blocks = blocks.ok_or_else(wrong)?;
        // If blocks overlap, a small file could describe much more data than it contains.
        let total: u64 = blocks.iter().fold(0, |total, &(_, head, body)| {
            total.saturating_add(head).saturating_add(body)
        });
        if total > bytes.len() as u64 {
            return Err(self.claims());
        }
        self.schema = Some(footer.schema().ok_or_else(wrong)?);
        self.blocks = Some(blocks.into_iter());
        Ok(())
    }

    /// The columns.
    pub(crate) fn schema(&mut self) -> Result<Schema<'a>, Diagnostic> {
        let schema = match self.schema {
            Some(schema) => schema,
            None => {
                let found = self.next_of_stream()?;
                let schema = found.and_then(|(message, _)| message.header_as_schema());
                let missing = "it does not begin with a schema; it is not Arrow IPC, or it is cut";
                schema.ok_or_else(|| self.damaged(missing))?
            }
        };
        self.schema = Some(schema);
        if !schema.endianness().equals_to_target_endianness() {
            return Err(self.damaged("its numbers are big-endian; write it little-endian"));
        }
        Ok(schema)
    }

    /// The next message with rows or a dictionary.
    pub(crate) fn next(&mut self) -> Result<Option<DataMessage<'a>>, Diagnostic> {
        let next = match &mut self.blocks {
            None => self.next_of_stream()?,
            Some(blocks) => match blocks.next() {
                None => None,
                Some((offset, head, body)) => Some(self.block(offset, head, body)?),
            },
        };
        let Some((message, data)) = next else {
            return Ok(None);
        };
        let reason = "a message is neither a batch of rows nor a dictionary; the file is damaged";
        let body = match message.header_type() {
            MessageHeader::DictionaryBatch => {
                let batch = message.header_as_dictionary_batch();
                let batch = batch.ok_or_else(|| self.damaged(reason))?;
                let words = batch.data().ok_or_else(|| self.damaged(reason))?;
                self.check(&words, &data)?;
                MessageBody::Dictionary(batch)
            }
            MessageHeader::RecordBatch => {
                let batch = message.header_as_record_batch();
                let batch = batch.ok_or_else(|| self.damaged(reason))?;
                self.check(&batch, &data)?;
                MessageBody::Rows(batch)
            }
            _ => return Err(self.damaged(reason)),
        };
        Ok(Some(DataMessage {
            version: message.version(),
            body,
            data,
        }))
    }

    /// The message of a file at the location that its footer contains.
    fn block(
        &self,
        offset: u64,
        head: u64,
        body: u64,
    ) -> Result<(Message<'a>, Buffer), Diagnostic> {
        let outside = || self.damaged("a block lies outside the file; it is damaged or cut");
        let to_usize = |number: u64| usize::try_from(number).map_err(|_| outside());
        let (start, head, body) = (to_usize(offset)?, to_usize(head)?, to_usize(body)?);
        let rest = self.bytes.as_slice().get(start..).ok_or_else(outside)?;
        let metadata = rest.get(..head).ok_or_else(outside)?;
        if body > rest.len() - head {
            return Err(outside());
        }
        // Four bytes that mark a continuation (old files do not have them), then the length.
        let before = if metadata.starts_with(&CONTINUATION) {
            8
        } else {
            4
        };
        let message = metadata
            .get(before..)
            .and_then(|bytes| root_as_message(bytes).ok());
        let message = message.ok_or_else(|| self.damaged("a message cannot be read"))?;
        Ok((message, self.bytes.slice_with_length(start + head, body)))
    }

    fn next_of_stream(&mut self) -> Result<Option<(Message<'a>, Buffer)>, Diagnostic> {
        let cut =
            || self.damaged("the stream ends within a message; it is truncated, copy it again");
        let bytes = self.bytes.as_slice();
        let mut rest = &bytes[self.at..];
        if rest.is_empty() {
            return Ok(None);
        }
        rest = rest.strip_prefix(&CONTINUATION).unwrap_or(rest);
        let (length, rest) = rest.split_first_chunk::<4>().ok_or_else(cut)?;
        let length = usize::try_from(i32::from_le_bytes(*length)).map_err(|_| cut())?;
        if length == 0 {
            return Ok(None);
        }
        let metadata = rest.get(..length).ok_or_else(cut)?;
        let message = root_as_message(metadata);
        let message = message.map_err(|_| self.damaged("a message cannot be read"))?;
        let body = usize::try_from(message.bodyLength()).map_err(|_| cut())?;
        let start = bytes.len() - rest.len() + length;
        if body > bytes.len() - start {
            return Err(cut());
        }
        self.at = start + body;
        Ok(Some((message, self.bytes.slice_with_length(start, body))))
    }

    /// Checks that every count and every offset lies within the data, before the crate uses them.
    fn check(&mut self, batch: &RecordBatch<'_>, data: &Buffer) -> Result<(), Diagnostic> {
        let wrong = || self.damaged("a message has impossible counts; the file is damaged");
        let mut counts = vec![batch.length()];
        for node in batch.nodes().into_iter().flatten() {
            let (length, nulls) = (node.length(), node.null_count());
            if !(0..=length).contains(&nulls) {
                return Err(wrong());
            }
            counts.push(length);
        }
        let mut claimed = 0u64;
        for count in counts {
            claimed = claimed.saturating_add(u64::try_from(count).map_err(|_| wrong())?);
        }
        let compression = batch.compression();
        if let Some(compression) = compression {
            let codec = compression.codec();
            if codec != CompressionType::ZSTD && codec != CompressionType::LZ4_FRAME {
                let codec = codec.variant_name().unwrap_or("an unknown method");
                let message = format!("it is compressed by {codec}; write it with zstd or LZ4");
                return Err(Diagnostic::new(self.name, Code::Compression, message));
            }
        }
        let mut used = 0u64;
        for buffer in batch.buffers().into_iter().flatten() {
            let to_usize = |number: i64| usize::try_from(number).ok();
            let (start, length) = to_usize(buffer.offset())
                .zip(to_usize(buffer.length()))
                .ok_or_else(wrong)?;
            let bytes = data
                .as_slice()
                .get(start..)
                .and_then(|rest| rest.get(..length));
            let bytes = bytes.ok_or_else(wrong)?;
            used = used.saturating_add(length as u64);
            if compression.is_some() && !bytes.is_empty() {
                let prefix = bytes.first_chunk::<PREFIX>().ok_or_else(wrong)?;
                // The length -1 marks a buffer that is not compressed.
                let unpacked = u64::try_from(i64::from_le_bytes(*prefix)).unwrap_or(0);
                claimed = claimed.saturating_add(unpacked);
            }
        }
        if used > data.len() as u64 || claimed > self.left {
            return Err(self.claims());
        }
        self.left -= claimed;
        let claimed = usize::try_from(claimed).unwrap_or(usize::MAX);
        self.budget
            .take(claimed, DECODED)
            .map_err(|error| Diagnostic::new(self.name, Code::Memory, error.to_string()))
    }
}
