//! Calls that a crowd refuses: the error names the cause, and nothing is changed.

use glam::{Affine3A, Quat, Vec3};
use tumble::crowd::{CrowdError, CrowdLayer, CrowdLibrary, CrowdOutput, CrowdValues};
use tumble::{Axes, Interpolation, Quantity, Skeleton, TrackSet, VectorMethod, WrapMode, method};

use super::{bits, clip, cpu, evaluated, library};
use crate::support::Random;

fn one(seconds: f64) -> TrackSet {
    let mut set = TrackSet::new();
    let keys = [Quat::IDENTITY, Quat::from_rotation_x(1.0)];
    set.push("", &[0.0, seconds], &keys).unwrap();
    set
}

#[test]
fn libraries_refuse_what_does_not_fit() {
    let linear = VectorMethod::Linear;
    let none = Skeleton::new(vec![], vec![]).unwrap();
    assert_eq!(CrowdLibrary::new(&none).unwrap_err(), CrowdError::NoJoints);
    let single = Skeleton::chain(1, 1.0).unwrap();
    for ticks_per_second in [0, u32::MAX] {
        let refused = CrowdLibrary::with_ticks(&single, ticks_per_second).unwrap_err();
        assert_eq!(refused, CrowdError::TicksPerSecond { ticks_per_second });
    }
    let mut library = CrowdLibrary::new(&single).unwrap();
    assert_eq!(
        cpu().crowd(&library, 1, 1).unwrap_err(),
        CrowdError::NoClips
    );
    let empty = TrackSet::new();
    let refused = library.push(&empty, method::SLERP, linear).unwrap_err();
    assert_eq!(
        refused,
        CrowdError::Tracks {
            tracks: 0,
            joints: 1
        }
    );
    // Joints without names are counted, also once a clip has determined them.
    let mut unnamed = CrowdLibrary::new(&single).unwrap();
    unnamed.push(&one(1.0), method::SLERP, linear).unwrap();
    let mut two = one(1.0);
    let keys = two.track(0).keys.to_vec();
    let times = two.track(0).times.to_vec();
    two.push("", &times, &keys).unwrap();
    assert_eq!(
        unnamed.push(&two, method::SLERP, linear).unwrap_err(),
        CrowdError::Tracks {
            tracks: 2,
            joints: 1
        }
    );
    let refused = library.push(&one(1e6), method::SLERP, linear).unwrap_err();
    assert!(matches!(refused, CrowdError::TooLong { .. }), "{refused}");
    let velocity =
        Interpolation::from(method::SLERP).with_quantity(Quantity::Velocity(Axes::Parent));
    let refused = library.push(&one(1.0), velocity, linear).unwrap_err();
    assert_eq!(refused, CrowdError::NotRotations);
    let mut wild = TrackSet::new();
    let keys = [0.0, 3.0, 0.5, 2.5, 1.0].map(Quat::from_rotation_x);
    wild.push("", &[0.0, 0.001, 2.0, 2.001, 5.0], &keys)
        .unwrap();
    let refused = library.push(&wild, method::CATMULL_ROM, linear);
    let bessel = library.push(&wild, method::BESSEL_OVERHAUSER, linear);
    let is_wild = |result: &Result<usize, CrowdError>| {
        matches!(result, Err(CrowdError::TooWild { track: 0, .. }))
    };
    assert!(
        is_wild(&refused) || is_wild(&bessel),
        "{refused:?} {bessel:?}"
    );
    // A refused call leaves nothing behind.
    let before = library.clip_count();
    let clip = library.push(&one(1.0), method::SLERP, linear).unwrap();
    assert_eq!((clip, library.clip_count()), (before, before + 1));
    assert!(library.push_mask(&[]).is_err());
    for weight in [f32::NAN, -0.5, 2.0] {
        let refused = library.push_mask(&[weight]).unwrap_err();
        assert!(matches!(refused, CrowdError::MaskWeight { joint: 0, .. }));
    }
    for _ in 0..31 {
        library.push_mask(&[0.5]).unwrap();
    }
    assert_eq!(
        library.push_mask(&[0.5]).unwrap_err(),
        CrowdError::TooManyMasks
    );
    let nowhere = Affine3A::from_translation(Vec3::NAN);
    let refused = library.set_inverse_bind(&[nowhere]).unwrap_err();
    assert_eq!(refused, CrowdError::BindNotFinite { joint: 0 });
    assert!(library.set_inverse_bind::<[[f32; 4]; 3]>(&[]).is_err());
    assert!(library.set_reference(0, 99, 0).is_err());
}

#[test]
fn crowds_refuse_what_is_not_there_and_stay_as_they_were() {
    let mut random = Random(23);
    let library = library(&mut random, 4, &[method::SLERP]);
    let engine = cpu();
    for (instances, layers) in [(0, 1), (1_000_001, 1), (1, 0), (1, 5)] {
        assert!(engine.crowd(&library, instances, layers).is_err());
    }
    let mut crowd = engine.crowd(&library, 3, 2).unwrap();
    crowd.set(1, 1, CrowdLayer::new(0)).unwrap();
    let before = bits(&evaluated(&mut crowd, CrowdValues::Skinning));
    let plays = CrowdLayer::new(0);
    let at_speed = |speed| plays.with_speed(speed);
    let weighing = |weight| plays.with_weight(weight);
    let mask = Some(7);
    let wrap = WrapMode::Extrapolate;
    let hostile = [
        ("clip", CrowdLayer::new(1)),
        ("speed", at_speed(f32::NAN)),
        ("speed", at_speed(f32::INFINITY)),
        ("speed", at_speed(-128.0)),
        ("weight", weighing(f32::NAN)),
        ("weight", weighing(-0.1)),
        ("weight", weighing(1.1)),
        ("mask", plays.with_mask(mask)),
        ("wrap", plays.with_wrap(wrap)),
    ];
    for (expected, plays) in hostile {
        let reason = crowd.set(1, 1, plays).unwrap_err();
        let found = match reason {
            CrowdError::Missing { subject, .. } => subject,
            CrowdError::Speed { .. } => "speed",
            CrowdError::Weight { .. } => "weight",
            CrowdError::Wrap { .. } => "wrap",
            _ => "something else",
        };
        assert_eq!(found, expected, "{reason}");
        let good = CrowdLayer::new(0).at(5_555);
        let refused = crowd.set_all(&[(0, 0, good), (1, 1, plays), (9, 9, good)]);
        let refused = refused.unwrap_err().to_string();
        assert_eq!(refused, format!("change 1: {reason}"));
    }
    assert!(crowd.set(3, 0, plays).is_err() && crowd.set(0, 2, plays).is_err());
    assert!(crowd.get(3, 0).is_err() && crowd.tick(0, 2).is_err());
    for seconds in [f64::NAN, f64::INFINITY, 1e300] {
        let refused = crowd.advance(seconds).unwrap_err();
        assert!(matches!(refused, CrowdError::Seconds { .. }));
    }
    let seconds = -1.0;
    let negative = CrowdError::NegativeSeconds { seconds };
    assert_eq!(crowd.advance(seconds).unwrap_err(), negative);
    assert_eq!(crowd.clock_ticks(seconds).unwrap_err(), negative);
    assert_eq!(crowd.ticks_of(seconds).unwrap(), -705_600);
    assert_eq!(crowd.clock_ticks(0.5).unwrap(), 352_800);
    assert!(crowd.ticks_of(f64::NAN).is_err() && crowd.set_clock(u64::MAX).is_err());
    let needed = crowd.output_len(CrowdValues::Model);
    assert_eq!(crowd.output_bytes(CrowdValues::Model), 16 * needed as u64);
    let half = CrowdOutput::half(CrowdValues::Model);
    assert_eq!(crowd.output_bytes(half), 8 * needed as u64);
    let mut short = vec![[0.0; 4]; needed - 1];
    let refused = crowd.evaluate_into(CrowdValues::Model, &mut short);
    let length = needed - 1;
    assert_eq!(
        refused.unwrap_err(),
        CrowdError::OutputLength { length, needed }
    );
    assert_eq!(bits(&evaluated(&mut crowd, CrowdValues::Skinning)), before);
    let changes = [(0, 0, plays.at(9)), (2, 1, plays), (0, 0, plays.at(7_777))];
    crowd.set_all(&changes).unwrap();
    assert_eq!(crowd.get(0, 0).unwrap(), plays.at(7_777));
    assert_eq!(crowd.get(2, 1).unwrap(), plays);
    // Times far outside are folded, not refused.
    for time in [i64::MIN, i64::MAX] {
        crowd.set(0, 0, plays.at(time)).unwrap();
        let found = evaluated(&mut crowd, CrowdValues::Rotations);
        assert!(found.as_flattened().iter().all(|number| number.is_finite()));
    }

    let skeleton = super::skeleton(&mut random, 4);
    let mut plain = CrowdLibrary::new(&skeleton).unwrap();
    let set = clip(&mut random, 4, 5);
    plain.push(&set, method::SLERP, VectorMethod::Step).unwrap();
    let mut crowd = engine.crowd(&plain, 1, 1).unwrap();
    let mut output = vec![[0.0; 4]; crowd.output_len(CrowdValues::Skinning)];
    let refused = crowd.evaluate_into(CrowdValues::Skinning, &mut output);
    assert_eq!(refused.unwrap_err(), CrowdError::NoInverseBind);
}
