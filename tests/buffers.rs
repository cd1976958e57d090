//! Comparison of buffers word by word.

use std::collections::BTreeMap;

use tumble::verify::{Agreement, DifferenceKind, UNWRITTEN, WordBound, WordType, compare_buffers};

/// Each kind of difference, in both types of floats: the number of values with other bits, and the
/// number of steps between them.
#[test]
fn every_kind_of_difference_is_told_from_the_others() {
    use DifferenceKind::{
        Distant, Flushed, Infinite, Near, Neighbour, NotNumber, Sign, Subnormal, Unwritten,
        ZeroSign,
    };
    for (kind, f32s, f16s, steps) in [
        (Unwritten, [UNWRITTEN, 0x3f80_0000], [0x7fb5, 0x3c00], None),
        (
            NotNumber,
            [0x7fc0_0000, 0x3f80_0000],
            [0x7e00, 0x3c00],
            None,
        ),
        (
            NotNumber,
            [0x7fc0_0000, 0xffc0_0000],
            [0x7e00, 0xfe01],
            None,
        ),
        (Infinite, [0x7f80_0000, 0x7f7f_ffff], [0x7c00, 0x7bff], None),
        (Infinite, [0x7f80_0000, 0xff80_0000], [0xfc00, 0x7c00], None),
        (ZeroSign, [0x8000_0000, 0], [0x8000, 0], Some(0)),
        (Flushed, [0, 0x0000_0007], [0, 0x0007], Some(7)),
        (Flushed, [0x8000_0001, 0], [0x8001, 0], Some(1)),
        (Sign, [0x8000_0001, 0x0000_0001], [0x8001, 0x0001], Some(2)),
        (
            Subnormal,
            [0x007f_ffff, 0x0080_0000],
            [0x03ff, 0x0400],
            Some(1),
        ),
        (
            Neighbour,
            [0x3f7f_ffff, 0x3f80_0000],
            [0x3bff, 0x3c00],
            Some(1),
        ),
        (Near, [0x3f80_0010, 0x3f80_0000], [0x3c10, 0x3c00], Some(16)),
        (
            Distant,
            [0x3f80_0011, 0x3f80_0000],
            [0x3c11, 0x3c00],
            Some(17),
        ),
    ] {
        let f16s_in_memory = f16s.map(|bits| bits as u16);
        for (words, bits, found) in [
            (WordType::F32, f32s, {
                compare_buffers(WordType::F32, &f32s[..1], &f32s[1..])
            }),
            (WordType::F16, f16s, {
                let [theirs, expected] = f16s_in_memory;
                compare_buffers(WordType::F16, &[theirs], &[expected])
            }),
        ] {
            let found = found.unwrap();
            let worst = found.worst.unwrap();
            assert_eq!([worst.theirs, worst.expected], bits, "{words}");
            assert_eq!(worst.kind, kind, "{found}");
            assert_eq!(found.census, BTreeMap::from([(kind, 1)]));
            assert_eq!(found.max_steps, steps.unwrap_or(u64::MAX), "{found}");
            assert_eq!(found.max_distance.is_finite(), steps.is_some(), "{found}");
            let within = found.agreement_within(WordBound::Steps(u64::MAX));
            let expected = match (kind, steps) {
                (Unwritten, _) => Agreement::Nothing,
                (_, Some(_)) => Agreement::WithinBounds,
                (_, None) => Agreement::OutsideBounds,
            };
            assert_eq!(within, expected, "{found}");
        }
    }
    let integers = compare_buffers(WordType::U32, &[7u32, 9, 3], &[7u32, 8, 5]).unwrap();
    assert_eq!(integers.census, BTreeMap::from([(Distant, 2)]));
    assert_eq!((integers.max_distance, integers.max_steps), (2.0, 2));
    assert_eq!(integers.worst.unwrap().index, 2);
    assert_eq!(
        integers.to_string(),
        "u32: 3 words, 2 with other bits (2 distant); the first is word 1: 0x00000009 (9e0) in place of \
         0x00000008 (8e0), distant; the farthest is word 2: 0x00000003 (3e0) in place of 0x00000005 (5e0), distant"
    );
}

#[test]
fn nothing_written_and_nothing_to_compare_are_no_agreement() {
    let same = compare_buffers(WordType::F32, &[1.0f32, f32::NAN], &[1.0f32, f32::NAN]);
    assert_eq!(same.unwrap().agreement(), Agreement::SameBits);
    for (theirs, expected, agreement) in [
        (vec![], vec![], Agreement::Nothing),
        (vec![UNWRITTEN; 3], vec![1, 2, 3], Agreement::Nothing),
        // Also where the expected buffer was not filled.
        (vec![UNWRITTEN; 3], vec![UNWRITTEN; 3], Agreement::Nothing),
        (
            vec![1, UNWRITTEN, 3],
            vec![1, 2, 3],
            Agreement::OutsideBounds,
        ),
        (vec![1, 2, 3], vec![1, 2, 3], Agreement::SameBits),
    ] {
        let found = compare_buffers(WordType::F32, &theirs, &expected).unwrap();
        assert_eq!(found.agreement(), agreement, "{found}");
        for bound in [
            WordBound::Distance(f64::INFINITY),
            WordBound::Steps(u64::MAX),
        ] {
            assert_eq!(found.agreement_within(bound), agreement, "{found}");
        }
    }
    let near = compare_buffers(WordType::F32, &[1.5f32], &[1.25f32]).unwrap();
    for (bound, agreement) in [
        (0.25, Agreement::WithinBounds),
        (0.249, Agreement::OutsideBounds),
        (f64::NAN, Agreement::OutsideBounds),
    ] {
        assert_eq!(near.agreement_within(WordBound::Distance(bound)), agreement);
    }
    let refused = compare_buffers(WordType::F32, &[0u16; 3], &[0u16; 3]).unwrap_err();
    assert_eq!((refused.theirs, refused.expected, refused.word), (6, 6, 4));
    assert!(compare_buffers(WordType::F16, &[0u16; 3], &[0u16; 2]).is_err());
}
