//! The attribute streams of meshopt, versions 0 and 1, as the appendices of `KHR_meshopt_compression` specify them.
//! `EXT_meshopt_compression` has version 0, which is the version that is written.
//!
//! A stream is a header byte, blocks of up to 256 elements, and a tail with the element before the first one. An
//! element has `stride` bytes. A block stores the first bytes of its elements, then their second bytes and so on,
//! each such list in groups of 16. The stored values are differences from the element before, in 0, 1, 2, 4 or 8
//! bits. Four bytes of an element that begin at a multiple of four are a channel; in version 1 the tail contains how
//! the differences of each channel are applied.

#![forbid(unsafe_code)]

use std::array;
use std::f32::consts::FRAC_1_SQRT_2;

/// Elements of a group.
const GROUP: usize = 16;
/// Elements of a block, at most.
const BLOCK: usize = 256;
/// Bytes that a block decodes to, at most.
const BLOCK_BYTES: usize = 8192;

/// The filter that is applied to decoded elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Filter {
    /// No filter.
    None,
    /// Three components and the index of the largest become four normalised i16, `x y z w`.
    Quaternion,
    /// A mantissa of 24 bits and an exponent of 8 become an f32.
    Exponential,
}

/// Why a view cannot be decoded.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum MeshoptError {
    /// The mode is that of triangles or indices, or unknown.
    #[error("the meshopt mode is `{0}`; animations must use the mode ATTRIBUTES")]
    Mode(String),
    /// The filter is that of normals or colours, or unknown.
    #[error(
        "the meshopt filter is `{0}`; animations are stored with NONE, QUATERNION or EXPONENTIAL"
    )]
    Filter(String),
    /// The format does not have elements of this length.
    #[error("the meshopt stride is {stride} bytes; {allowed}")]
    Stride {
        /// Bytes of an element.
        stride: usize,
        /// The lengths that it has.
        allowed: &'static str,
    },
    /// The header byte is unknown.
    #[error("the meshopt stream begins with {0:#04x}; 0xa0 and 0xa1 (versions 0 and 1) are read")]
    Version(u8),
    /// There are fewer bytes than in the shortest stream of this number of elements.
    #[error(
        "{count} elements of {stride} bytes need a meshopt stream of {needed} bytes or more, and \
         this one has {found}; export the file again"
    )]
    Short {
        /// Number of elements in the file.
        count: usize,
        /// Bytes of an element.
        stride: usize,
        /// The length of the shortest such stream.
        needed: u128,
        /// Number of bytes that were passed.
        found: usize,
    },
    /// The blocks overlap the tail.
    #[error(
        "the meshopt stream of {found} bytes ends within the block that begins with element \
         {element}; it is cut or damaged: export the file again"
    )]
    Cut {
        /// Number of bytes that were passed.
        found: usize,
        /// The first element of the block, counted from 0.
        element: usize,
    },
    /// There are bytes between the last block and the tail.
    #[error(
        "{left} bytes of the meshopt stream are left after its {count} elements; it is damaged: \
         export the file again"
    )]
    LeftOver {
        /// Number of these bytes.
        left: usize,
        /// Number of decoded elements.
        count: usize,
    },
    /// The mode of a channel is unknown.
    #[error(
        "channel {channel} of the meshopt stream has the unknown mode {mode:#04x}; export the \
         file again, with version 0 or 1 of the codec"
    )]
    Channel {
        /// Index of the channel: of the group of four bytes of an element, from 0.
        channel: usize,
        /// The mode's byte.
        mode: u8,
    },
}

impl Filter {
    /// The filter of a view, from the properties `mode` and `filter` of its extension object.
    pub(crate) fn named(mode: &str, filter: Option<&str>) -> Result<Self, MeshoptError> {
        if mode != "ATTRIBUTES" {
            return Err(MeshoptError::Mode(mode.to_owned()));
        }
        match filter {
            None | Some("NONE") => Ok(Self::None),
            Some("QUATERNION") => Ok(Self::Quaternion),
            Some("EXPONENTIAL") => Ok(Self::Exponential),
            Some(other) => Err(MeshoptError::Filter(other.to_owned())),
        }
    }
}

/// Decodes `count` elements of `stride` bytes each. The caller has compared the product of both with its limits; the
/// shortest streams decode to 1024 times their length.
///
/// # Errors
/// When `bytes` are not exactly a stream of this number of elements.
pub(crate) fn decode_attributes(
    bytes: &[u8],
    count: usize,
    stride: usize,
    filter: Filter,
) -> Result<Vec<u8>, MeshoptError> {
    let not = |allowed| Err(MeshoptError::Stride { stride, allowed });
    if !(4..=256).contains(&stride) || !stride.is_multiple_of(4) {
        return not("it is a multiple of 4, from 4 to 256");
    }
    if filter == Filter::Quaternion && stride != 8 {
        return not("the filter QUATERNION has 8");
    }
    let has_channels = match bytes.first() {
        Some(0xa0) => false,
        Some(0xa1) => true,
        other => return Err(MeshoptError::Version(other.copied().unwrap_or(0))),
    };
    // The tail ends with the element from which the first element's differences count and, in version 1, with the modes
    // of the channels. It is padded at its front, so that decoders may read past the end of a group.
    let channels = if has_channels { stride / 4 } else { 0 };
    let tail = (stride + channels).max(if has_channels { 24 } else { 32 });
    let block = (BLOCK_BYTES / stride / GROUP * GROUP).min(BLOCK);
    let needed = 1 + tail as u128 + least_body(count, stride, block, has_channels);
    let size = count
        .checked_mul(stride)
        .filter(|_| needed <= bytes.len() as u128);
    let Some(size) = size else {
        return Err(MeshoptError::Short {
            count,
            stride,
            needed,
            found: bytes.len(),
        });
    };
    let (before, modes) = bytes[bytes.len() - stride - channels..].split_at(stride);
    for (channel, &mode) in modes.iter().enumerate() {
        if !matches!(mode, 0 | 1) && mode & 15 != 2 {
            return Err(MeshoptError::Channel { channel, mode });
        }
    }
    let mut body = &bytes[1..bytes.len() - tail];
    let mut output = vec![0; size];
    let mut before = before.to_vec();
    for (index, block_output) in output.chunks_mut(block * stride).enumerate() {
        if decode_block(&mut body, modes, &mut before, block_output).is_none() {
            return Err(MeshoptError::Cut {
                found: bytes.len(),
                element: index * block,
            });
        }
    }
    if !body.is_empty() {
        let left = body.len();
        return Err(MeshoptError::LeftOver { left, count });
    }
    match filter {
        Filter::None => {}
        Filter::Quaternion => output.as_chunks_mut().0.iter_mut().for_each(quaternion),
        Filter::Exponential => output.as_chunks_mut().0.iter_mut().for_each(exponential),
    }
    Ok(output)
}

/// Encodes elements of `stride` bytes each as a stream of version 0. Each group of 16 differences has the width in
/// which it is shortest.
pub(crate) fn encode_attributes(bytes: &[u8], stride: usize) -> Vec<u8> {
    let block = (BLOCK_BYTES / stride / GROUP * GROUP).min(BLOCK);
    let none = vec![0; stride];
    let first = bytes.get(..stride).unwrap_or(&none);
    let mut before = first.to_vec();
    let mut stream = vec![0xa0];
    for elements in bytes.chunks(block * stride) {
        for byte in 0..stride {
            let mut list = Vec::with_capacity(BLOCK);
            for element in elements.chunks_exact(stride) {
                let difference = element[byte].wrapping_sub(before[byte]);
                let sign = if difference & 0x80 == 0 { 0 } else { 0xff };
                list.push((difference << 1) ^ sign);
                before[byte] = element[byte];
            }
            encode_list(list, &mut stream);
        }
    }
    stream.resize(stream.len() + 32usize.saturating_sub(stride), 0);
    stream.extend_from_slice(first);
    stream
}

/// Encodes the differences of one byte of all elements of a block.
fn encode_list(mut list: Vec<u8>, stream: &mut Vec<u8>) {
    const WIDTHS: [usize; 4] = [0, 2, 4, 8];
    list.resize(list.len().next_multiple_of(GROUP), 0);
    let groups = list.as_chunks::<GROUP>().0;
    let header = stream.len();
    stream.resize(header + groups.len().div_ceil(4), 0);
    for (i, group) in groups.iter().enumerate() {
        // Values that do not fit take an additional byte after the others. A width of 0 bits can store only zeros.
        let length = |width: usize| match width {
            0 if group.iter().any(|&byte| byte != 0) => usize::MAX,
            0 => 0,
            8 => GROUP,
            _ => {
                2 * width
                    + group
                        .iter()
                        .filter(|&&byte| byte >= (1 << width) - 1)
                        .count()
            }
        };
        let shortest = (0..WIDTHS.len()).min_by_key(|&index| length(WIDTHS[index]));
        let index = shortest.unwrap_or(3);
        stream[header + i / 4] |= (index as u8) << (2 * (i % 4));
        match WIDTHS[index] {
            0 => {}
            8 => stream.extend_from_slice(group),
            width => {
                let all_set = (1u8 << width) - 1;
                for packed in group.chunks_exact(8 / width) {
                    let bits = packed.iter().map(|&byte| byte.min(all_set));
                    stream.push(bits.fold(0, |bits, byte| bits << width | byte));
                }
                stream.extend(group.iter().filter(|&&byte| byte >= all_set));
            }
        }
    }
}

/// The smallest number of bytes between the header and the tail of a stream. For every byte of an element, version 0
/// has at least two bits for each group, and version 1 has at least two bits for each block.
fn least_body(count: usize, stride: usize, block: usize, has_channels: bool) -> u128 {
    let stride = stride as u128;
    if has_channels {
        return count.div_ceil(block) as u128 * (stride / 4);
    }
    let headers = |elements: usize| elements.div_ceil(GROUP).div_ceil(4) as u128;
    ((count / block) as u128 * headers(block) + headers(count % block)) * stride
}

/// The next `count` bytes; `None` if there are fewer.
fn take<'a>(body: &mut &'a [u8], count: usize) -> Option<&'a [u8]> {
    let (head, rest) = body.split_at_checked(count)?;
    *body = rest;
    Some(head)
}

/// Decodes the elements of one block. `before` is the element before the block, and then the last one of the block;
/// `modes` are those of the channels, empty in version 0.
fn decode_block(
    body: &mut &[u8],
    modes: &[u8],
    before: &mut [u8],
    output: &mut [u8],
) -> Option<()> {
    let stride = before.len();
    let elements = output.len() / stride;
    let controls = take(body, modes.len())?;
    let mut lists = [[0; BLOCK]; 4];
    for (channel, before) in before.as_chunks_mut::<4>().0.iter_mut().enumerate() {
        for (byte, list) in lists.iter_mut().enumerate() {
            let control = controls.get(channel).map(|bits| bits >> (2 * byte) & 3);
            decode_list(body, control, elements, list)?;
        }
        let mode = modes.get(channel).copied().unwrap_or(0);
        for (index, element) in output.chunks_exact_mut(stride).enumerate() {
            let difference = lists.each_ref().map(|list| list[index]);
            *before = apply(*before, difference, mode);
            element[4 * channel..][..4].copy_from_slice(before);
        }
    }
    Some(())
}

/// Decodes the differences of one byte of all elements of a block. `control` are its two bits in the header of the
/// block, which version 0 does not have.
fn decode_list(
    body: &mut &[u8],
    control: Option<u8>,
    elements: usize,
    list: &mut [u8; BLOCK],
) -> Option<()> {
    let widths = match control {
        None => [0, 2, 4, 8],
        Some(0) => [0, 1, 2, 4],
        Some(1) => [1, 2, 4, 8],
        Some(2) => {
            list.fill(0);
            return Some(());
        }
        Some(_) => {
            list[..elements].copy_from_slice(take(body, elements)?);
            return Some(());
        }
    };
    let groups = elements.div_ceil(GROUP);
    let header = take(body, groups.div_ceil(4))?;
    for (group, list) in list.as_chunks_mut().0.iter_mut().take(groups).enumerate() {
        let width_index = header[group / 4] >> (2 * (group % 4)) & 3;
        decode_group(body, widths[usize::from(width_index)], list)?;
    }
    Some(())
}

/// Decodes 16 differences of `width` bits. If all bits of one are set, its value is a byte after the others.
/// Differences of one bit begin at the lowest bit of a byte, wider ones at the highest.
fn decode_group(body: &mut &[u8], width: usize, list: &mut [u8; GROUP]) -> Option<()> {
    let packed = take(body, 2 * width)?;
    match width {
        0 => list.fill(0),
        8 => list.copy_from_slice(packed),
        _ => {
            let all_set = (1 << width) - 1;
            let in_byte = 8 / width;
            for (i, difference) in list.iter_mut().enumerate() {
                let low = i % in_byte * width;
                let shift = if width == 1 { low } else { 8 - width - low };
                *difference = packed[i / in_byte] >> shift & all_set;
                if *difference == all_set {
                    *difference = take(body, 1)?[0];
                }
            }
        }
    }
    Some(())
}

/// Four bytes of an element, from those of the element before and a difference. In mode 0 it is a difference of
/// bytes, in mode 1 of pairs of bytes; its lowest bit inverts the others. In other modes the difference, rotated
/// right by the upper bits of the mode, is combined with the bytes by exclusive or.
fn apply(before: [u8; 4], difference: [u8; 4], mode: u8) -> [u8; 4] {
    match mode & 15 {
        0 => array::from_fn(|byte| {
            let v = difference[byte];
            before[byte].wrapping_add((v >> 1) ^ (v & 1).wrapping_neg())
        }),
        1 => {
            let [before, difference] = [before, difference]
                .map(|[a, b, c, d]| [u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d])]);
            let [[a, b], [c, d]] = array::from_fn(|pair| {
                let v = difference[pair];
                let sum = before[pair].wrapping_add((v >> 1) ^ (v & 1).wrapping_neg());
                sum.to_le_bytes()
            });
            [a, b, c, d]
        }
        _ => {
            let difference = u32::from_le_bytes(difference).rotate_right((mode >> 4).into());
            (u32::from_le_bytes(before) ^ difference).to_le_bytes()
        }
    }
}

/// Converts three components, in units of `one` and times the root of 2, to `x y z w` as normalised i16. The fourth
/// input is `one`, except its two lowest bits: these are the index of the omitted component, which is the largest and
/// positive. Nothing is rounded before the root if `one` has up to 12 bits. The order of operations is that of
/// meshoptimizer, so that the results are equal.
pub(super) fn quaternion(element: &mut [u8; 8]) {
    let input: [i16; 4] =
        array::from_fn(|i| i16::from_le_bytes([element[2 * i], element[2 * i + 1]]));
    let [x, y, z, one] = [input[0], input[1], input[2], input[3] | 3].map(f32::from);
    let largest = (2.0 * (one * one) - (x * x + (y * y + z * z))).max(0.0);
    let scale = 32767.0 * FRAC_1_SQRT_2 / one;
    let largest_index = usize::from(element[6] & 3);
    for (i, component) in [largest.sqrt(), x, y, z].into_iter().enumerate() {
        // Conversions of floats to integers saturate.
        let rounded = (component * scale).round_ties_even() as i16;
        element[(largest_index + i) % 4 * 2..][..2].copy_from_slice(&rounded.to_le_bytes());
    }
}

/// A mantissa in the 24 lower bits, times 2 to the power of the 8 upper bits; both are signed.
fn exponential(element: &mut [u8; 4]) {
    let bits = i32::from_le_bytes(*element);
    let (mantissa, exponent) = (bits << 8 >> 8, bits >> 24);
    let power = f64::from_bits(((1023 + exponent) as u64) << 52);
    *element = ((f64::from(mantissa) * power) as f32).to_le_bytes();
}

#[cfg(test)]
mod tests;
