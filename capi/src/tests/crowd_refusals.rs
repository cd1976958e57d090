//! Wrong uses of crowds from C, and the errors that they get.

use std::ptr::{dangling, dangling_mut, null, null_mut};

use super::crowd::*;
use super::{cpu, defaults, fails, one_track, words};
use crate::crowd::library::*;
use crate::crowd::output::*;
use crate::crowd::player::*;
use crate::crowd::target::*;
use crate::engine::*;
use crate::interpolation::*;
use crate::result::*;
use crate::set::*;
use crate::set_vectors::*;

/// A crowd of two instances with two layers each, on the CPU.
pub(super) fn small() -> *mut TumbleCrowd {
    let (library, _) = libraries();
    let engine = cpu();
    let crowd = c_crowd(engine, library, (2, 2));
    done(tumble_engine_free(engine));
    done(tumble_crowd_library_free(library));
    crowd
}

fn new_library(parents: &[i32], offsets: *const f32, ticks: u32) -> TumbleResult {
    let (mut library, count) = (null_mut(), parents.len());
    // SAFETY: pointers to as many numbers as stated, and room for the handle.
    let made = unsafe {
        tumble_crowd_library_new(parents.as_ptr(), offsets, count, ticks, &raw mut library)
    };
    done(tumble_crowd_library_free(library));
    made
}

pub(super) fn evaluate(crowd: *mut TumbleCrowd, values: u32, output: &mut [f32]) -> TumbleResult {
    // SAFETY: memory of that size.
    unsafe { tumble_crowd_evaluate(crowd, values, output.as_mut_ptr(), output.len()) }
}

#[test]
fn handles_of_crowds_are_checked() {
    let crowd = small();
    let invalid = TumbleResult::InvalidHandle;
    let mut memory = [0.0; 2 * 4 * 4];
    fails(
        evaluate(null_mut(), 0, &mut memory),
        invalid,
        "the crowd is null",
    );
    fails(
        evaluate(dangling_mut(), 0, &mut memory),
        invalid,
        "never existed",
    );
    let set = one_track();
    fails(
        evaluate(set.cast(), 0, &mut memory),
        invalid,
        "kind `crowd`",
    );
    fails(set_layers(set.cast(), &[still()]), invalid, "kind `crowd`");
    fails(
        push(crowd.cast(), set, None),
        invalid,
        "kind `crowd library`",
    );
    fails(
        tumble_crowd_library_free(crowd.cast()),
        invalid,
        "kind `crowd library`",
    );
    // SAFETY: the calls refuse the arguments before they use them.
    unsafe {
        let target = dangling_mut::<TumbleCrowdTarget>();
        fails(
            tumble_crowd_target_free(target),
            invalid,
            "this crowd target was freed",
        );
        let recorded = tumble_crowd_record(crowd, target, dangling_mut());
        fails(recorded, invalid, "this crowd target was freed");
        let engine = dangling::<TumbleEngine>();
        let mut made = null_mut();
        let made = tumble_crowd_new(engine, dangling(), 1, 1, &raw mut made);
        fails(made, invalid, "this engine was freed");
        let made = tumble_crowd_new(engine, dangling(), 1, 1, null_mut());
        fails(made, TumbleResult::InvalidPointer, "`crowd` is null");
    }
    done(tumble_crowd_free(crowd));
    fails(evaluate(crowd, 0, &mut memory), invalid, "was freed");
    fails(tumble_crowd_free(crowd), invalid, "was freed");
    fails(tumble_crowd_advance(crowd, 0.1), invalid, "was freed");
    fails(tumble_crowd_submit(crowd, 0, 0), invalid, "was freed");
    fails(tumble_crowd_forget_recorded(crowd), invalid, "was freed");
    done(tumble_crowd_free(null_mut()));
    done(tumble_set_free(set));
    let library = crowd.cast::<TumbleCrowdLibrary>();
    assert_eq!(tumble_crowd_library_joint_count(library), 0);
    assert_eq!(tumble_crowd_library_clip_count(null()), 0);
    assert_eq!(tumble_crowd_library_clip_ticks(library, 0), 0);
    assert!(tumble_crowd_library_joint_name(library, 0).is_null());
}

#[test]
fn libraries_refuse_what_does_not_fit() {
    let (argument, input) = (TumbleResult::InvalidArgument, TumbleResult::InvalidInput);
    fails(
        new_library(&[-2], null(), 0),
        argument,
        "`parents[0]` is -2",
    );
    fails(
        new_library(&[1, 0], null(), 0),
        input,
        "is its own ancestor",
    );
    fails(
        new_library(&[7], null(), 0),
        input,
        "track 7, but there are 1 tracks",
    );
    fails(new_library(&[], null(), 0), input, "no joints");
    fails(
        new_library(&[-1], [0.0, f32::NAN, 0.0].as_ptr(), 0),
        input,
        "not finite",
    );
    fails(
        new_library(&[-1], null(), u32::MAX),
        argument,
        "ticks a second",
    );
    let mut library = null_mut();
    // SAFETY: the calls refuse the arguments before they read memory.
    let made = unsafe { tumble_crowd_library_new(null(), null(), 3, 0, &raw mut library) };
    fails(made, TumbleResult::InvalidPointer, "`parents` is null");
    let parents = PARENTS.as_ptr();
    for count in [usize::MAX, usize::MAX / 8] {
        // SAFETY: as above.
        let made =
            unsafe { tumble_crowd_library_new(parents, dangling(), count, 0, &raw mut library) };
        fails(made, argument, "no memory holds");
    }

    let (library, rust_library) = libraries();
    let set = one_track();
    fails(
        push(library, set, None),
        input,
        "1 tracks, the skeleton has 4 joints",
    );
    fails(
        push(library, set, Some(c"no such")),
        argument,
        "there is no vector method `no such`",
    );
    let velocity = TumbleInterpolation {
        quantity: TumbleQuantity::VelocityInBody as u32,
        ..defaults()
    };
    let (mut parent, mut single) = ([0; 4], null_mut());
    // SAFETY: structures, room for handles, and pointers that are refused.
    unsafe {
        done(tumble_crowd_library_new(
            [-1].as_ptr(),
            null(),
            1,
            0,
            &raw mut single,
        ));
        let pushed =
            tumble_crowd_library_push(single, set, &raw const velocity, null(), null_mut());
        fails(pushed, input, "a crowd needs rotations");
        let clip = std::ptr::without_provenance_mut(3);
        let pushed = tumble_crowd_library_push(single, set, null(), null(), clip);
        fails(
            pushed,
            TumbleResult::InvalidPointer,
            "`clip` is not aligned",
        );
        let weights = [1.0, 2.0, 0.0, 0.0];
        let masked = tumble_crowd_library_push_mask(library, weights.as_ptr(), 4, null_mut());
        fails(masked, input, "joint 1 has the weight 2");
        let masked = tumble_crowd_library_push_mask(library, weights.as_ptr(), 3, null_mut());
        fails(masked, input, "3 weights for 4 joints");
        let bound = tumble_crowd_library_set_inverse_bind(library, dangling(), usize::MAX / 12);
        fails(bound, TumbleResult::InvalidArgument, "no memory holds");
        let bound = tumble_crowd_library_set_inverse_bind(library, null(), 4);
        fails(bound, TumbleResult::InvalidPointer, "`matrices` is null");
        let bound = tumble_crowd_library_set_inverse_bind(single, [f32::NAN; 12].as_ptr(), 1);
        fails(bound, input, "not finite");
        let result = tumble_crowd_library_parents(library, parent.as_mut_ptr(), 3);
        fails(result, TumbleResult::WrongSize, "the library has 4 joints");
        done(tumble_crowd_library_parents(
            library,
            parent.as_mut_ptr(),
            4,
        ));
    }
    assert_eq!(parent, PARENTS);
    let referred = tumble_crowd_library_set_reference(library, 0, 9, 0);
    fails(referred, TumbleResult::OutOfRange, "no clip 9");
    assert_eq!(
        tumble_crowd_library_clip_count(library),
        rust_library.clip_count()
    );
    assert_eq!(tumble_crowd_library_clip_ticks(library, 3), 0);
    assert!(words().contains("no clip 3"), "{}", words());
    assert!(tumble_crowd_library_joint_name(library, 4).is_null());
    let engine = cpu();
    let mut crowd = null_mut();
    for (library, instances, layers, code, says) in [
        (single, 1, 1, TumbleResult::WrongState, "no clips"),
        (library, 0, 1, argument, "0 instances"),
        (library, 1_000_001, 1, argument, "1000001 instances"),
        (library, 1, 0, argument, "0 layers"),
        (library, 1, 5, argument, "5 layers"),
    ] {
        // SAFETY: room for the handle.
        let made = unsafe { tumble_crowd_new(engine, library, instances, layers, &raw mut crowd) };
        fails(made, code, says);
    }
    // Wrong vectors of a set are refused, and change nothing.
    let (times, keys) = ([0.0, 1.0], [0.0_f32; 12]);
    // SAFETY: pointers to as many numbers as stated, or that are refused.
    unsafe {
        let (times, keys) = (times.as_ptr(), keys.as_ptr());
        let give = tumble_set_translations;
        fails(
            give(set, 1, times, keys, null(), 2),
            TumbleResult::OutOfRange,
            "track 1",
        );
        fails(give(set, 0, times, keys, null(), 0), input, "no keys");
        let huge = usize::MAX / 4;
        fails(
            give(set, 0, times, keys, null(), huge),
            argument,
            "no memory holds",
        );
        let pointer = TumbleResult::InvalidPointer;
        fails(
            give(set, 0, times, null(), null(), 2),
            pointer,
            "`keys` is null",
        );
        fails(
            tumble_set_scales(set, 0, null(), keys, keys, 2),
            pointer,
            "`times` is null",
        );
        done(tumble_set_scales(set, 0, times, keys, keys, 2));
    }
    for library in [single, library] {
        done(tumble_crowd_library_free(library));
    }
    done(tumble_set_free(set));
    done(tumble_engine_free(engine));
}
