use std::fs;
use std::path::Path;

use proptest::prelude::*;
use serde_json::Value;
use sha2::{Digest, Sha256};

use super::*;

#[path = "../../../tests/support.rs"]
mod support;

/// [`elements`] as meshoptimizer 1.3 encodes them at level 3: two blocks. Version 1 has byte, pair
/// and exclusive-or channels (turned by 4 bits), all four controls and all widths but 8, which
/// version 0 has.
const STREAMS: [&[u8]; 2] = [
    include_bytes!("../../../tests/fixtures/meshopt/version_0.bin"),
    include_bytes!("../../../tests/fixtures/meshopt/version_1.bin"),
];
const COUNT: usize = 300;
const STRIDE: usize = 16;

/// Streams are as short as meshoptimizer's own of version 0, and decode to the original numbers.
#[test]
fn streams_are_written() {
    let all = elements();
    let stream = encode_attributes(&all, STRIDE);
    assert_eq!(stream.len(), STREAMS[0].len());
    for count in [0, 1, 15, 16, 17, 255, 256, 257, COUNT] {
        for stride in [4, 8, 12, 16, 64] {
            let bytes: Vec<u8> = all.iter().cycle().take(count * stride).copied().collect();
            let stream = encode_attributes(&bytes, stride);
            let again = decode_attributes(&stream, count, stride, Filter::None);
            assert_eq!(again, Ok(bytes), "{count} of {stride}");
        }
    }
}

/// Bytes that stay, move slowly, and jump; pairs that climb and fall; four bytes of which the same
/// few bits change; four bytes that are mostly the same.
fn elements() -> Vec<u8> {
    let mut state = 1u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        state >> 24
    };
    let [mut slow, mut steps] = [0u8; 2];
    let [mut up, mut down] = [1000u16, 60_000];
    let mut bits = 0x3f80_0000u32;
    let mut all = Vec::new();
    for _ in 0..COUNT {
        slow += u8::from(next() < 40);
        steps = steps.wrapping_add((next() % 13) as u8).wrapping_sub(6);
        all.extend([0, slow, steps, next() as u8]);
        up = up.wrapping_add((next() % 40 * 20) as u16);
        down = down.wrapping_sub(300).wrapping_add((next() % 5) as u16);
        all.extend(up.to_le_bytes());
        all.extend(down.to_le_bytes());
        bits ^= next() << 12;
        all.extend(bits.to_le_bytes());
        let rare = if next() < 30 { next() * 0x10001 } else { 7 };
        all.extend(rare.to_le_bytes());
    }
    all
}

fn decode(bytes: &[u8]) -> Result<Vec<u8>, MeshoptError> {
    decode_attributes(bytes, COUNT, STRIDE, Filter::None)
}

#[test]
fn streams_of_both_versions_are_decoded() {
    for stream in STREAMS {
        assert!(decode(stream).unwrap() == elements());
    }
}

/// The example of the specification: sixteen differences in four bits, two of them bytes.
#[test]
fn the_example_of_the_specification_is_decoded() {
    let mut body = &[0x17, 0x5f, 0xf0, 0xbc, 0x77, 0xa9, 0x21, 0, 0x34, 0xb5][..];
    let mut list = [0; GROUP];
    decode_group(&mut body, 4, &mut list).unwrap();
    let signed = list.map(|v| apply([0; 4], [v, 0, 0, 0], 0)[0].cast_signed());
    let expected = [-1, -4, -3, 26, -91, 0, -6, 6, -4, -4, 5, -5, 1, -1, 0, 0];
    assert_eq!((signed, body.len()), (expected, 0));
}

#[test]
fn quaternions_of_any_precision_are_decoded() {
    let decoded = |input: [i16; 4]| {
        let mut bytes = *bytemuck::cast_ref::<_, [u8; 8]>(&input.map(i16::to_le));
        quaternion(&mut bytes);
        bytemuck::cast::<_, [i16; 4]>(bytes).map(i16::from_le)
    };
    // In 12 bits, 1.0 is 2047. The component that is left out is x, then w.
    assert_eq!(decoded([0, 0, 0, 2044]), [32767, 0, 0, 0]);
    assert_eq!(decoded([2047, 0, 0, 2047]), [23170, 0, 0, 23170]);
    assert_eq!(
        decoded([0, -2047, 0, 2046]),
        [-23170, 0, 23170, 0].map(|v: i16| v)
    );
}

#[test]
fn exponents_are_signed_and_exact() {
    let decoded = |input: u32| {
        let mut bytes = input.to_le_bytes();
        exponential(&mut bytes);
        f32::from_le_bytes(bytes)
    };
    assert_eq!(decoded(0x0000_0001), 1.0);
    assert_eq!(decoded(0xfeff_fffd), -0.75);
    assert_eq!(decoded(0x647f_ffff), 8_388_607.0 * 2f32.powi(100));
    assert_eq!(decoded(0x9c00_0001), 2f32.powi(-100));
}

/// Every attribute view of a real file, beside the hashes of meshoptimizer's own decoder.
#[test]
fn decoded_views_have_the_hashes_of_meshoptimizer() {
    let Some(folder) = support::shared_data() else {
        return;
    };
    let text = fs::read_to_string(folder.join("gltf/fox_meshopt.expected.json")).unwrap();
    let expected: Value = serde_json::from_str(&text).unwrap();
    let mut compared = 0;
    for (file, expected) in expected.as_object().unwrap() {
        let (json, chunk) = glb(&folder.join("gltf").join(file));
        let extension = expected["extension"].as_str().unwrap();
        for (view, expected) in expected["bufferViews"].as_object().unwrap() {
            let view = &json["bufferViews"][view.parse::<usize>().unwrap()];
            let object = &view["extensions"][extension];
            let number = |name: &str| object[name].as_u64().unwrap_or(0) as usize;
            let bytes = &chunk[number("byteOffset")..][..number("byteLength")];
            let mode = object["mode"].as_str().unwrap();
            let filter = Filter::named(mode, object["filter"].as_str()).unwrap();
            let (count, stride) = (number("count"), number("byteStride"));
            let decoded = decode_attributes(bytes, count, stride, filter).unwrap();
            let hash: String = Sha256::digest(&decoded)
                .iter()
                .map(|b| format!("{b:02x}"))
                .collect();
            assert_eq!(decoded.len() as u64, expected["bytes"]);
            assert_eq!(hash, expected["sha256"], "{file}: {object}");
            compared += 1;
        }
    }
    assert!(compared >= 6, "only {compared} views compared");
}

/// The JSON of a GLB, and its binary chunk.
fn glb(path: &Path) -> (Value, Vec<u8>) {
    let bytes = fs::read(path).unwrap();
    let length = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let json = serde_json::from_slice(&bytes[20..20 + length(12)]).unwrap();
    let at = 20 + length(12);
    (json, bytes[at + 8..at + 8 + length(at)].to_vec())
}

#[test]
fn what_is_not_for_animation_is_refused_by_name() {
    for (mode, filter) in [("TRIANGLES", None), ("INDICES", None), ("attributes", None)] {
        let error = Filter::named(mode, filter).unwrap_err();
        assert!(error.to_string().contains(mode), "{error}");
    }
    for filter in ["OCTAHEDRAL", "COLOR", ""] {
        let error = Filter::named("ATTRIBUTES", Some(filter)).unwrap_err();
        assert!(
            error.to_string().contains(&format!("`{filter}`")),
            "{error}"
        );
    }
    let named = |filter| Filter::named("ATTRIBUTES", filter).unwrap();
    assert_eq!(named(None), Filter::None);
    assert_eq!(named(Some("NONE")), Filter::None);
}

#[test]
fn what_is_no_such_stream_is_refused() {
    use MeshoptError::{Channel, Cut, LeftOver, Short, Stride, Version};
    let [_, stream] = STREAMS;
    for stride in [0, 2, 6, 260, usize::MAX] {
        let error = decode_attributes(stream, 1, stride, Filter::None);
        assert!(matches!(error, Err(Stride { .. })), "{error:?}");
    }
    let error = decode_attributes(stream, COUNT, STRIDE, Filter::Quaternion);
    assert!(matches!(error, Err(Stride { stride: 16, .. })));
    assert_eq!(decode(&[]), Err(Version(0)));
    assert_eq!(decode(&[0xa2; 100]), Err(Version(0xa2)));
    for (stream, per_byte) in STREAMS.into_iter().zip([64, 1024]) {
        // More elements than these bytes can encode, and more than fit into memory.
        for count in [per_byte * stream.len() / STRIDE + 1, usize::MAX] {
            let error = decode_attributes(stream, count, STRIDE, Filter::None);
            assert!(matches!(error, Err(Short { .. })), "{error:?}");
        }
        assert!(matches!(decode(&stream[..32]), Err(Short { .. })));
        let second = [&stream[..600], &stream[stream.len() - 36..]].concat();
        assert!(matches!(decode(&second), Err(Cut { element: 0, .. })));
        let cut = [&stream[..stream.len() - 40], &stream[stream.len() - 36..]].concat();
        assert!(
            matches!(decode(&cut), Err(Cut { element: 256, .. })),
            "{:?}",
            decode(&cut)
        );
        let fewer = decode_attributes(stream, COUNT - 64, STRIDE, Filter::None);
        assert!(
            matches!(fewer, Err(LeftOver { .. } | Cut { .. })),
            "{fewer:?}"
        );
    }
    let mut longer = stream.to_vec();
    longer.splice(1000..1000, [0; 3]);
    assert!(decode(&longer).is_err());
    for mode in [3, 4, 0x10, 0x21, 0x43] {
        let mut wrong = stream.to_vec();
        let at = wrong.len() - 2;
        wrong[at] = mode;
        assert_eq!(decode(&wrong), Err(Channel { channel: 2, mode }));
    }
}

/// A stream of zero differences is as short as can be: exactly so many bytes are enough.
#[test]
fn the_shortest_streams_are_accepted_and_no_byte_less() {
    for (header, tail, body) in [(0xa0, 32, 16 * 5), (0xa1, 24, 2 * 4)] {
        let mut stream = vec![0; 1 + body + tail];
        stream[0] = header;
        if header == 0xa1 {
            // Do not change the bytes of both blocks.
            stream[1..1 + body].fill(0b1010_1010);
        }
        assert_eq!(decode(&stream), Ok(vec![0; COUNT * STRIDE]));
        stream.remove(1);
        assert!(matches!(decode(&stream), Err(MeshoptError::Short { .. })));
    }
    let empty = [&[0xa0][..], &[0; 32]].concat();
    let none = |bytes: &[u8]| decode_attributes(bytes, 0, 4, Filter::Exponential);
    assert_eq!(none(&empty), Ok(Vec::new()));
    let longer = [&empty[..], &[0]].concat();
    assert_eq!(
        none(&longer),
        Err(MeshoptError::LeftOver { left: 1, count: 0 })
    );
}

proptest! {
    #[test]
    fn arbitrary_bytes_never_panic(
        version in 0u8..2,
        bytes in prop::collection::vec(any::<u8>(), 0..900),
        count in 0usize..2000,
        quarter in 0usize..66,
        filter in 0usize..3,
    ) {
        let stream = [&[0xa0 + version], &*bytes].concat();
        let filter = [Filter::None, Filter::Quaternion, Filter::Exponential][filter];
        if let Ok(decoded) = decode_attributes(&stream, count, 4 * quarter, filter) {
            prop_assert_eq!(decoded.len(), count * 4 * quarter);
        }
    }

    /// Damaged streams reach deeper than arbitrary bytes.
    #[test]
    fn damaged_streams_never_panic(
        version in 0usize..2,
        damage in prop::collection::vec((0usize..2500, any::<u8>()), 0..4),
        cut in 0usize..2500,
        filter in any::<bool>(),
    ) {
        let mut stream = STREAMS[version].to_vec();
        for (offset, byte) in damage {
            let offset = offset % stream.len();
            stream[offset] = byte;
        }
        let filter = if filter { Filter::Exponential } else { Filter::None };
        let whole = decode_attributes(&stream, COUNT, STRIDE, filter);
        prop_assert!(whole.is_err() || whole.unwrap().len() == COUNT * STRIDE);
        if cut < stream.len() {
            stream.remove(cut);
            let _ = decode_attributes(&stream, COUNT, STRIDE, filter);
            stream.truncate(cut);
            prop_assert!(decode_attributes(&stream, COUNT, STRIDE, filter).is_err());
        }
    }

    /// Quaternions of any bits stay finite numbers, and those of the format are unit.
    #[test]
    fn decoded_quaternions_are_unit(input in prop::array::uniform3(-2047i16..2048), largest in 0i16..4) {
        let kept = input.map(f32::from).iter().map(|v| v * v).sum::<f32>() <= 2.0 * 2047.0 * 2047.0;
        let mut bytes = [0; 8];
        for (i, v) in input.into_iter().chain([2044 | largest]).enumerate() {
            bytes[2 * i..][..2].copy_from_slice(&v.to_le_bytes());
        }
        quaternion(&mut bytes);
        let square: f64 = (0..4)
            .map(|i| f64::from(i16::from_le_bytes([bytes[2 * i], bytes[2 * i + 1]])) / 32767.0)
            .map(|v| v * v)
            .sum();
        prop_assert!(!kept || (square - 1.0).abs() < 1e-4, "{}", square);
    }
}
