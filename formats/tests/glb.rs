//! A GLB, parsed by code that shares nothing with the reader.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde_json::Value;
use serde_json::value::RawValue;

pub(crate) type Text = BTreeMap<String, Box<RawValue>>;

pub(crate) struct Glb {
    pub(crate) bytes: Vec<u8>,
    pub(crate) text: String,
    pub(crate) bin: Vec<u8>,
    /// Types and data.
    pub(crate) others: Vec<(Vec<u8>, Vec<u8>)>,
}

impl Glb {
    pub(crate) fn parse(bytes: &[u8]) -> Self {
        let word = |at: usize| u32::from_le_bytes(*bytes[at..].first_chunk().unwrap()) as usize;
        assert_eq!(
            (&bytes[..4], word(4), word(8)),
            (&b"glTF"[..], 2, bytes.len())
        );
        let mut chunks = Vec::new();
        let mut at = 12;
        while at < bytes.len() {
            let end = at + 8 + word(at);
            chunks.push((bytes[at + 4..at + 8].to_vec(), bytes[at + 8..end].to_vec()));
            at = end;
        }
        let mut glb = Self {
            bytes: bytes.to_vec(),
            text: String::from_utf8(chunks.remove(0).1).unwrap(),
            bin: Vec::new(),
            others: Vec::new(),
        };
        for (kind, data) in chunks {
            match &*kind {
                b"BIN\0" => glb.bin = data,
                _ => glb.others.push((kind, data)),
            }
        }
        glb
    }

    /// Without `asset`, because a fixture has numbers there that are not read.
    pub(crate) fn json(&self) -> Value {
        let read = members(&self.text)
            .into_iter()
            .filter(|(name, _)| name != "asset");
        read.map(|(name, raw)| (name, serde_json::from_str::<Value>(raw.get()).unwrap()))
            .collect()
    }
}

pub(crate) fn text_of(path: &Path) -> String {
    let bytes = fs::read(path).unwrap();
    if bytes.starts_with(b"glTF") {
        Glb::parse(&bytes).text
    } else {
        String::from_utf8(bytes).unwrap()
    }
}

pub(crate) fn members(text: &str) -> Text {
    serde_json::from_str(text).unwrap()
}
