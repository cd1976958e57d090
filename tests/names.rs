//! Tests of the names of options, and a comparison of requests of sets with requests of clips.

use std::fmt::{Debug, Display};
use std::str::FromStr;

use tumble::crowd::{CrowdValues, LayerBlend};
use tumble::glam::Quat;
use tumble::paths::{BodyAxis, PathFrame, Twist};
use tumble::reduce::ReducedCurve;
use tumble::verify::{DifferenceKind, WordType};
use tumble::{
    Axes, Channel, ComponentType, Device, Encoding, Ends, Engine, Error, EulerSequence, FrameRate,
    KeySigns, Layout, METHODS, MatrixOrder, Method, Quantity, SampleTimes, SmoothingEnds,
    SmoothingKernel, Speed, TrackSet, UnknownNameError, VectorMethod, VectorWidth, WrapMode,
    method,
};

#[track_caller]
fn assert_named<T>(all: &[T])
where
    T: Copy + Debug + Display + PartialEq + FromStr<Err = UnknownNameError>,
{
    let names: Vec<String> = all.iter().map(ToString::to_string).collect();
    for (value, name) in all.iter().zip(&names) {
        assert_eq!(name.parse::<T>().as_ref(), Ok(value));
    }
    let error = "none of them".parse::<T>().unwrap_err();
    assert_eq!(error.known, names);
    assert!(error.to_string().starts_with("there is no "), "{error}");
}

#[test]
fn values_of_options_are_found_by_their_names() {
    assert_named(&Axes::ALL);
    assert_named(&Channel::ALL);
    assert_named(&ComponentType::ALL);
    #[cfg(feature = "vulkan")]
    assert_named(&tumble::crowd::CrowdStage::ALL);
    assert_named(&CrowdValues::ALL);
    assert_named(&DifferenceKind::ALL);
    assert_named(&Ends::ALL);
    assert_named(&KeySigns::ALL);
    assert_named(&LayerBlend::ALL);
    assert_named(&Layout::ALL);
    assert_named(&MatrixOrder::ALL);
    assert_named(&PathFrame::ALL);
    assert_named(&Quantity::ALL);
    assert_named(&ReducedCurve::ALL);
    assert_named(&SmoothingEnds::ALL);
    assert_named(&Speed::ALL);
    assert_named(&Twist::ALL);
    assert_named(&VectorMethod::ALL);
    assert_named(&VectorWidth::ALL);
    assert_named(&WordType::ALL);
    assert_named(&WrapMode::ALL);
    assert_named::<Method>(&METHODS);
    for encoding in Encoding::ALL {
        let found: Encoding = encoding.name().parse().unwrap();
        assert_eq!(found.name(), encoding.name());
    }
}

/// The message has the text that is not a value, whatever type it was parsed as.
#[test]
fn messages_say_what_was_parsed() {
    fn message<T: FromStr<Err: Display>>(text: &str) -> String {
        text.parse::<T>()
            .map_or_else(|error| error.to_string(), |_| String::new())
    }
    for message in [
        message::<BodyAxis>,
        message::<Encoding>,
        message::<EulerSequence>,
        message::<FrameRate>,
        message::<LayerBlend>,
        message::<Method>,
        message::<Quantity>,
        message::<SmoothingKernel>,
        message::<VectorWidth>,
        message::<WordType>,
    ] {
        let found = message("sideways");
        assert!(found.contains("`sideways`"), "{found}");
    }
}

/// A name of other programs counts only where an option has the value.
#[test]
fn names_of_other_programs_are_understood_in_hints() {
    for (name, meant) in [
        ("linear", "slerp"),
        ("LERP", "slerp"),
        ("cubic", "bessel-overhauser"),
        ("CUBICSPLINE", "gltf-cubic"),
        ("cubic_spline", "gltf-cubic"),
        ("constant", "step"),
        ("tcb", "kochanek-bartels"),
    ] {
        let message = name.parse::<Method>().unwrap_err().to_string();
        let hint = format!("; did you mean `{meant}`?");
        assert!(message.ends_with(&hint), "{message}");
    }
    let message = "slerp".parse::<VectorMethod>().unwrap_err().to_string();
    assert!(message.ends_with("did you mean `linear`?"), "{message}");
    let message = "ping pong".parse::<WrapMode>().unwrap_err().to_string();
    assert!(message.ends_with("did you mean `mirror`?"), "{message}");
    let message = "tcb".parse::<WrapMode>().unwrap_err().to_string();
    assert!(!message.contains("did you mean"), "{message}");
}

#[test]
fn a_set_is_asked_for_what_its_clip_is_asked_for() {
    let mut set = TrackSet::new();
    for track in 0..3_u8 {
        let keys = [0.0, 0.7, 2.0, 1.1].map(|x| Quat::from_rotation_z(x + f32::from(track)));
        set.push("", &[0.0, 0.5, 1.25, 2.0], &keys).unwrap();
    }
    let engine = Engine::new(Device::Cpu).unwrap();
    let how = method::BESSEL_OVERHAUSER;
    let clip = engine.upload(&set, how).unwrap();
    let frames = SampleTimes::fps(60);
    for layout in Layout::ALL {
        for samples in [0..121, 17..40, 5..5] {
            for tracks in [0..3, 1..2] {
                let of_set = (engine.request(&set, how, &frames).layout(layout))
                    .tracks(tracks.clone())
                    .samples(samples.clone());
                let of_clip = (clip.request(&frames).layout(layout))
                    .tracks(tracks.clone())
                    .samples(samples.clone());
                let found = of_set.evaluate().unwrap();
                assert_eq!(found.as_quats(), of_clip.evaluate().unwrap().as_quats());
                assert_eq!(found.track_count(), tracks.len());
                assert_eq!(found.sample_count(), samples.len());
                for encoding in Encoding::ALL {
                    let found = of_set.clone().encoding(encoding).evaluate_bytes().unwrap();
                    let expected = of_clip.clone().encoding(encoding).evaluate_bytes();
                    assert_eq!(found, expected.unwrap(), "{encoding}");
                }
                for request in [&of_set, &of_clip] {
                    let mut streamed = Vec::new();
                    request
                        .stream(10, |chunk| {
                            assert_eq!(chunk.start, streamed.len());
                            streamed.extend_from_slice(chunk.rows);
                            Ok::<(), Error>(())
                        })
                        .unwrap();
                    assert_eq!(streamed, found.as_arrays());
                }
            }
        }
    }
    let refused = clip.request(&frames).encoding(Encoding::F16).evaluate();
    let encoding = Encoding::F16;
    assert!(matches!(refused, Err(Error::ResultOfF32 { encoding: found }) if found == encoding));
    assert!(
        engine
            .request(&set, how, &frames)
            .tracks(2..4)
            .evaluate()
            .is_err()
    );
}
