//! Samplers: the clip's bits, and wrong uses.

use super::*;
use crate::sampler::*;

#[test]
fn samplers_have_the_bits_of_the_clip() {
    let (engine, set) = (cpu(), one_track());
    assert_eq!(
        push(set, TIMES.as_ptr(), KEYS.as_ptr().cast(), 3),
        TumbleResult::Ok
    );
    let (mut clip, mut sampler, mut copy) = (null_mut(), null_mut(), null_mut());
    let times = [-1.0, 0.0, 0.3, 0.5, 1.9, 2.0, 7.0, 0.3];
    let samples = TumbleSamples {
        sampling: TumbleSampling::Times as u32,
        times: times.as_ptr(),
        time_count: times.len(),
        ..at_60_fps()
    };
    let mut expected = vec![[0.0_f32; 4]; 2 * times.len()];
    // SAFETY: handles, structures, and memory of those sizes.
    unsafe {
        assert_eq!(
            tumble_upload(engine, set, &defaults(), &raw mut clip),
            TumbleResult::Ok
        );
        let output = expected.as_mut_ptr().cast();
        let layout = TumbleLayout::FrameMajor as u32;
        let done = tumble_clip_evaluate(clip, &raw const samples, layout, output, 8 * times.len());
        assert_eq!(done, TumbleResult::Ok, "{}", words());
        assert_eq!(tumble_sampler_new(clip, &raw mut sampler), TumbleResult::Ok);
        let mut bytes = 0.0;
        assert_eq!(
            tumble_clip_bytes_per_key(clip, &raw mut bytes),
            TumbleResult::Ok
        );
        assert!(bytes > 64.0, "{bytes}");
        assert_eq!(tumble_clip_free(clip), TumbleResult::Ok);
        assert_eq!(
            tumble_sampler_copy(sampler, &raw mut copy),
            TumbleResult::Ok
        );
    }
    let bits = |values: &[[f32; 4]]| -> Vec<u32> {
        values
            .as_flattened()
            .iter()
            .map(|value| value.to_bits())
            .collect()
    };
    for (&time, expected) in times.iter().zip(expected.chunks(2)) {
        let (mut pose, mut swapped, mut one) = ([[9.0; 4]; 2], [[9.0; 4]; 2], [[9.0; 4]]);
        // SAFETY: handles, and memory of those sizes.
        unsafe {
            let done = tumble_sampler_pose(sampler, time, pose.as_mut_ptr().cast(), 8);
            assert_eq!(done, TumbleResult::Ok, "{}", words());
            let (order, output) = ([1, 0], swapped.as_mut_ptr().cast());
            let done = tumble_sampler_pose_of(copy, order.as_ptr(), 2, time, output, 8);
            assert_eq!(done, TumbleResult::Ok, "{}", words());
            let done = tumble_sampler_sample(copy, 1, time, one.as_mut_ptr().cast());
            assert_eq!(done, TumbleResult::Ok, "{}", words());
        }
        swapped.reverse();
        assert_eq!(bits(&pose), bits(expected), "{time}");
        assert_eq!(bits(&swapped), bits(expected), "{time}");
        assert_eq!(bits(&one), bits(&expected[1..]), "{time}");
    }
    let mut pose = [9.0; 8];
    let output = pose.as_mut_ptr();
    // SAFETY: handles, or such as are refused, and memory of at least those sizes.
    unsafe {
        let wrong = tumble_sampler_pose(sampler, 0.0, output, 7);
        fails(
            wrong,
            TumbleResult::WrongSize,
            "a pose of 2 tracks has 8 floats",
        );
        let wrong = tumble_sampler_pose_of(sampler, [0, 2].as_ptr(), 2, 0.0, output, 8);
        fails(wrong, TumbleResult::OutOfRange, "there is no track 2");
        let wrong = tumble_sampler_sample(sampler, 2, 0.0, output);
        fails(wrong, TumbleResult::OutOfRange, "there is no track 2");
        let wrong = tumble_sampler_sample(sampler, 0, f64::NAN, output);
        fails(wrong, TumbleResult::InvalidInput, "finite");
        let wrong = tumble_sampler_sample(sampler, 0, 0.0, null_mut());
        fails(wrong, TumbleResult::InvalidPointer, "`value` is null");
        let wrong = tumble_sampler_new(clip, &raw mut copy);
        fails(wrong, TumbleResult::InvalidHandle, "this clip was freed");
    }
    assert_eq!(pose, [9.0; 8]);
    assert_eq!(tumble_sampler_free(sampler), TumbleResult::Ok);
    let wrong = tumble_sampler_free(sampler);
    fails(wrong, TumbleResult::InvalidHandle, "this sampler was freed");
    assert_eq!(tumble_sampler_free(null_mut()), TumbleResult::Ok);
}
