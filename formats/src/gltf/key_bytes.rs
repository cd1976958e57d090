//! The bytes of new keys, which become one buffer view of a file, and the accessors that name them.

use std::collections::HashMap;

use crate::gltf::edits::Edits;
use crate::gltf::schema::TargetPath;
use crate::gltf::write_new::FLOAT;
use crate::gltf::written_keys::WrittenKeys;

/// The bytes of numbers in a file.
pub(super) fn bytes_of(numbers: &[f32]) -> Vec<u8> {
    let each = numbers.iter().flat_map(|number| number.to_le_bytes());
    each.collect()
}

/// The bytes of the next buffer view.
pub(super) struct KeyBytes {
    view: usize,
    bytes: Vec<u8>,
    /// The accessors of times, by their bits.
    inputs: HashMap<Vec<u32>, usize>,
}

impl KeyBytes {
    /// For the buffer view after those of `edits`.
    pub(super) fn new(edits: &Edits<'_>) -> Self {
        Self {
            view: edits.count("bufferViews"),
            bytes: Vec::new(),
            inputs: HashMap::new(),
        }
    }

    pub(super) fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    pub(super) fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }

    /// Adds values and their accessor; `more` are further members of it. Returns the accessor.
    pub(super) fn push(
        &mut self,
        values: &[u8],
        (count, component, kind): (usize, u32, &str),
        more: &str,
        edits: &mut Edits<'_>,
    ) -> usize {
        let offset = self.bytes.len();
        self.bytes.extend_from_slice(values);
        let view = self.view;
        edits.append_to(
            "accessors",
            format!(
                "{{\"bufferView\":{view},\"byteOffset\":{offset},\"componentType\":{component},\
                 \"count\":{count},\"type\":\"{kind}\"{more}}}"
            ),
        )
    }

    /// The accessor of times, of which there is one at least; equal lists of times share one.
    pub(super) fn input(&mut self, times: &[f32], edits: &mut Edits<'_>) -> usize {
        let bits: Vec<u32> = times.iter().map(|time| time.to_bits()).collect();
        if let Some(&input) = self.inputs.get(&bits) {
            return input;
        }
        let [first, last] = [times[0], times[times.len() - 1]].map(f64::from);
        let range = format!(",\"min\":[{first:?}],\"max\":[{last:?}]");
        let input = self.push(
            &bytes_of(times),
            (times.len(), FLOAT, "SCALAR"),
            &range,
            edits,
        );
        self.inputs.insert(bits, input);
        input
    }

    /// The accessor of the values of a channel's keys in f32.
    pub(super) fn output(
        &mut self,
        keys: &WrittenKeys,
        path: TargetPath,
        edits: &mut Edits<'_>,
    ) -> usize {
        let count = keys.values.len() / path.width();
        let accessor = (count, FLOAT, path.kind());
        self.push(&bytes_of(&keys.values), accessor, "", edits)
    }
}
