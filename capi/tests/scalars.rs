//! Scalars of sets.

#![allow(unsafe_code)] // functions of C

use std::ptr::{null, null_mut};

use tumble::{Device, Engine, Layout, SampleTimes, ScalarQuantity, TrackSet, method};
use tumble_capi::engine::{tumble_engine_free, tumble_engine_open};
use tumble_capi::result::TumbleResult;
use tumble_capi::samples::{TumbleSamples, TumbleSampling};
use tumble_capi::scalars::{
    tumble_scalars_evaluate, tumble_set_push_scalar, tumble_set_scalar_count,
};
use tumble_capi::set::{tumble_set_free, tumble_set_new};

/// Scalars have the engine's bits, of values and of how fast they change.
#[test]
fn scalars_have_the_engines_bits() {
    let (times, keys) = ([0.0, 0.5, 1.5], [[0.25f32, 1.0, -0.5], [1.0, 3.0, 2.0]]);
    let mut expected = TrackSet::new();
    let frames = SampleTimes::fps(30);
    // SAFETY: every pointer is to a value that is alive, with as many elements as is said.
    unsafe {
        let (mut engine, mut set) = (null_mut(), null_mut());
        assert_eq!(
            tumble_engine_open(c"cpu".as_ptr(), null(), &raw mut engine),
            TumbleResult::Ok
        );
        assert_eq!(tumble_set_new(&raw mut set), TumbleResult::Ok);
        for (name, keys) in [c"hip", c"knee"].into_iter().zip(&keys) {
            expected
                .push_scalar(name.to_str().unwrap(), &times, keys, &[])
                .unwrap();
            let push = |name: *const _, times: &[f64]| {
                tumble_set_push_scalar(set, name, times.as_ptr(), keys.as_ptr(), null(), 3)
            };
            assert_eq!(push(name.as_ptr(), &times), TumbleResult::Ok);
            // Times that do not increase are refused, and so is a missing name.
            assert_eq!(push(name.as_ptr(), &[0.0; 3]), TumbleResult::InvalidInput);
            assert_eq!(push(null(), &times), TumbleResult::InvalidArgument);
        }
        assert_eq!(tumble_set_scalar_count(set), 2);
        let samples = TumbleSamples {
            size: size_of::<TumbleSamples>(),
            sampling: TumbleSampling::Keys as u32,
            rate_frames: 30,
            rate_seconds: 1,
            start: 0.0,
            end: 0.0,
            times: null(),
            time_count: 0,
        };
        let of_rust = Engine::new(Device::Cpu).unwrap();
        for quantity in ScalarQuantity::ALL {
            let method = method::BESSEL_OVERHAUSER;
            let vector_method = method.vector_method;
            let layout = Layout::FrameMajor;
            let expected = of_rust
                .scalars(&expected, quantity, vector_method, method, &frames, layout)
                .unwrap();
            let mut found = vec![0f32; expected.as_slice().len()];
            let mut evaluate = |count: usize| {
                let (quantity, layout, output) = (quantity as u32, 1, found.as_mut_ptr());
                let samples = &raw const samples;
                tumble_scalars_evaluate(
                    engine,
                    set,
                    null(),
                    samples,
                    quantity,
                    layout,
                    output,
                    count,
                )
            };
            assert_eq!(evaluate(3), TumbleResult::WrongSize);
            assert_eq!(evaluate(92), TumbleResult::Ok);
            assert_eq!(found, expected.as_slice());
        }
        assert_eq!(tumble_set_free(set), TumbleResult::Ok);
        assert_eq!(tumble_engine_free(engine), TumbleResult::Ok);
    }
}
