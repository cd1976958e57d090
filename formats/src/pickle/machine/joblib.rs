//! Files of joblib: compressed as a whole, or with the bytes of arrays between the opcodes.

use std::io::{self, Read};

use flate2::read::{GzDecoder, ZlibDecoder};
use lz4_flex::frame::FrameDecoder;

use crate::budget::Budget;
use crate::diagnostic::{Code, Diagnostic};
use crate::limits::Limits;
use crate::pickle::machine::{Data, Machine, NodeId};

/// The compressions of joblib by their first bytes, and whether they are read.
const COMPRESSIONS: [(&[u8], &str, bool); 6] = [
    (b"\x78", "zlib", true),
    (b"\x1f\x8b", "gzip", true),
    (b"\x04\x22\x4d\x18", "lz4", true),
    (b"BZ", "bz2", false),
    (b"\xfd7zXZ", "xz", false),
    (b"\x5d\x00", "lzma", false),
];

/// The bytes of a pickle, unpacked if it is compressed.
///
/// # Errors
/// When the compression is not read, the bytes are damaged, or they are more than the limits and the budget allow.
pub(in crate::pickle) fn unpacked(
    file: &str,
    bytes: Vec<u8>,
    limits: Limits,
    budget: &Budget,
) -> Result<Vec<u8>, Diagnostic> {
    let mut known = COMPRESSIONS.iter();
    let Some(&(_, name, is_read)) = known.find(|(start, ..)| bytes.starts_with(start)) else {
        return Ok(bytes);
    };
    let refuse = |code, message: String| Diagnostic::new(file, code, message);
    if !is_read {
        let message = format!(
            "the file is compressed by {name}; save it again with joblib.dump(…, \
             compress=('zlib', 3)), or without compress"
        );
        return Err(refuse(Code::PickleForm, message));
    }
    let mut reader: Box<dyn Read + '_> = match name {
        "zlib" => Box::new(ZlibDecoder::new(&*bytes)),
        "gzip" => Box::new(GzDecoder::new(&*bytes)),
        _ => Box::new(FrameDecoder::new(&*bytes)),
    };
    let mut unpacked = Vec::new();
    loop {
        const PIECE: u64 = 1 << 20;
        let before = unpacked.len();
        let read = (&mut reader).take(PIECE).read_to_end(&mut unpacked);
        let damaged = |error: io::Error| {
            let message = format!("the file cannot be unpacked ({name}): {error}");
            refuse(Code::PickleDamaged, message)
        };
        if read.map_err(damaged)? == 0 {
            return Ok(unpacked);
        }
        if unpacked.len() as u64 > limits.file {
            let message = format!("unpacked, the input is longer than {} bytes", limits.file);
            return Err(refuse(Code::FileTooLong, message));
        }
        budget
            .take(1, unpacked.len() - before)
            .map_err(|error| refuse(Code::Memory, error.to_string()))?;
    }
}

impl Machine<'_> {
    /// An array whose bytes follow in the file, or, if it holds objects, a pickle of it.
    pub(in crate::pickle) fn build_joblib_array(
        &mut self,
        target: NodeId,
        state: NodeId,
    ) -> Result<(), Diagnostic> {
        let field = |name: &str| {
            let field = self.get(state, name);
            field.ok_or_else(|| self.damaged(format!("an array of joblib has no `{name}`")))
        };
        let dtype = self.dtype(field("dtype")?)?;
        if dtype.is_object() {
            return self.enter(target);
        }
        let shape = self.lengths(field("shape")?)?;
        let is_fortran = self.text(field("order")?).as_deref() == Some("F");
        let alignment = self.get(state, "numpy_array_alignment_bytes");
        let is_aligned = alignment.is_some_and(|bytes| self.int(bytes).is_some());
        let header = self.array_header(dtype.clone(), shape.clone(), is_fortran)?;
        if is_aligned {
            let [padding] = self.array()?;
            self.range(padding.into())?;
        }
        let length = header.byte_count().unwrap_or(usize::MAX);
        let data = self.range(length as u64)?;
        let array = self.new_array(dtype, shape, is_fortran, Data::Input(data))?;
        self.set(target, array);
        Ok(())
    }
}
