//! Numbers as short text: differences, deflated, base64. `web/src/data.js` unpacks them.

use std::io::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;

/// Little-endian doubles.
pub(crate) fn doubles(values: &[f64]) -> String {
    deflated(
        &values
            .iter()
            .flat_map(|value| value.to_le_bytes())
            .collect::<Vec<_>>(),
    )
}

/// Little-endian words of 32 bits.
pub(crate) fn words(values: impl Iterator<Item = u32>) -> String {
    deflated(&values.flat_map(u32::to_le_bytes).collect::<Vec<_>>())
}

/// Bytes as they are.
pub(crate) fn bytes(bytes: &[u8]) -> String {
    deflated(bytes)
}

/// 16-bit integers as they are, little-endian.
pub(crate) fn shorts(values: impl Iterator<Item = u16>) -> String {
    deflated(&values.flat_map(u16::to_le_bytes).collect::<Vec<_>>())
}

/// Bytes that are packed already.
pub(crate) fn text(packed: &[u8]) -> String {
    STANDARD.encode(packed)
}

/// 16-bit integers, each as its difference from the integer `stride` places before it. Differences are small if these
/// two are the same component of neighbouring samples. All low bytes are first, then all high bytes, which are mostly
/// equal.
pub(crate) fn differences(values: &[u16], stride: usize) -> String {
    let difference = |(index, value): (usize, &u16)| match index.checked_sub(stride) {
        Some(before) => value.wrapping_sub(values[before]),
        None => *value,
    };
    let differences: Vec<u16> = values.iter().enumerate().map(difference).collect();
    let low = differences.iter().map(|value| *value as u8);
    let high = differences.iter().map(|value| (value >> 8) as u8);
    deflated(&low.chain(high).collect::<Vec<u8>>())
}

fn deflated(bytes: &[u8]) -> String {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    let packed = encoder.write_all(bytes).and_then(|()| encoder.finish());
    STANDARD.encode(packed.expect("memory takes what is written"))
}
