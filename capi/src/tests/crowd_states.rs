//! Layers, fades and lists that a crowd refuses, calls that it refuses in its present state, and an application's
//! handles.

use std::ptr::{dangling, null, null_mut};

use tumble::crowd::{CrowdOutput, CrowdValues};

use super::crowd::*;
use super::crowd_refusals::{evaluate, small};
use super::{cpu, fails, one_track};
use crate::crowd::events::*;
use crate::crowd::fade::*;
use crate::crowd::layer::*;
use crate::crowd::library::*;
use crate::crowd::output::*;
use crate::crowd::player::*;
use crate::crowd::target::*;
use crate::crowd::visible::*;
use crate::engine::*;
use crate::result::*;
use crate::set::*;
use crate::vulkan::*;

#[test]
fn layers_are_all_set_or_none() {
    let crowd = small();
    let output = CrowdOutput::from(CrowdValues::Local);
    let before = bits(crowd, output, false);
    let good = TumbleCrowdLayer {
        time: 300_000,
        ..still()
    };
    let (range, argument) = (TumbleResult::OutOfRange, TumbleResult::InvalidArgument);
    for (wrong, code, says) in [
        (
            TumbleCrowdLayer { size: 0, ..good },
            argument,
            "layers[1].size` is 0",
        ),
        (
            TumbleCrowdLayer { wrap: 4, ..good },
            argument,
            "`layers[1].wrap` is 4",
        ),
        (
            TumbleCrowdLayer { wrap: 3, ..good },
            argument,
            "change 1: instances of a crowd hold",
        ),
        (
            TumbleCrowdLayer {
                additive: 2,
                ..good
            },
            argument,
            "`layers[1].additive` is 2",
        ),
        (
            TumbleCrowdLayer {
                instance: 2,
                ..good
            },
            range,
            "change 1: there is no instance 2",
        ),
        (TumbleCrowdLayer { layer: 2, ..good }, range, "no layer 2"),
        (TumbleCrowdLayer { clip: 3, ..good }, range, "no clip 3"),
        (
            TumbleCrowdLayer {
                clip: usize::MAX,
                ..good
            },
            range,
            "no clip",
        ),
        (
            TumbleCrowdLayer { mask: 2, ..good },
            range,
            "no mask 2; there are 1, which count from 1",
        ),
        (
            TumbleCrowdLayer {
                mask: usize::MAX,
                ..good
            },
            range,
            "no mask",
        ),
        (
            TumbleCrowdLayer {
                speed: f32::NAN,
                ..good
            },
            argument,
            "speed is NaN",
        ),
        (
            TumbleCrowdLayer {
                speed: -128.0,
                ..good
            },
            argument,
            "speed is -128",
        ),
        (
            TumbleCrowdLayer {
                layer: 1,
                weight: 1.5,
                ..good
            },
            argument,
            "weight is 1.5",
        ),
    ] {
        fails(set_layers(crowd, &[good, wrong]), code, says);
    }
    // SAFETY: the calls refuse wrong arguments and do nothing with null.
    unsafe {
        let pointer = TumbleResult::InvalidPointer;
        fails(
            tumble_crowd_set(crowd, null(), 1),
            pointer,
            "`layers` is null",
        );
        let odd = std::ptr::without_provenance(4);
        fails(
            tumble_crowd_set(crowd, odd, 1),
            pointer,
            "`layers` is not aligned",
        );
        fails(
            tumble_crowd_set(crowd, dangling(), usize::MAX),
            argument,
            "no memory holds",
        );
        done(tumble_crowd_set(crowd, null(), 0));
        fails(
            tumble_crowd_get(crowd, null_mut()),
            pointer,
            "`layer` is null",
        );
        let mut of_size = TumbleCrowdLayer { size: 8, ..good };
        fails(
            tumble_crowd_get(crowd, &raw mut of_size),
            argument,
            "`layer->size` is 8",
        );
        let mut nobody = TumbleCrowdLayer {
            instance: 2,
            ..good
        };
        fails(
            tumble_crowd_get(crowd, &raw mut nobody),
            range,
            "no instance 2",
        );
        let mut tick = 7;
        fails(
            tumble_crowd_tick(crowd, 0, 2, &raw mut tick),
            range,
            "no layer 2",
        );
        fails(
            tumble_crowd_tick(crowd, 0, 0, null_mut()),
            pointer,
            "`tick` is null",
        );
        assert_eq!(tick, 7);
    }
    for (seconds, words) in [
        (f64::NAN, "times and steps"),
        (-1.0, "-1 s is negative"),
        (1e300, "times and steps"),
    ] {
        fails(tumble_crowd_advance(crowd, seconds), argument, words);
    }
    fails(tumble_crowd_set_clock(crowd, u64::MAX), argument, "2^52");
    assert!(
        bits(crowd, output, false) == before,
        "what is refused changes nothing"
    );
    done(set_layers(crowd, &[good]));
    assert!(bits(crowd, output, false) != before);
    done(tumble_crowd_free(crowd));
}

#[test]
fn results_and_states_are_checked() {
    let crowd = small();
    let (size, argument) = (TumbleResult::WrongSize, TumbleResult::InvalidArgument);
    let state = TumbleResult::WrongState;
    let count = count(crowd, CrowdValues::Model);
    assert_eq!(count, 2 * 4 * 12);
    let mut memory = vec![7.0; count + 1];
    for wrong in [0, 1, count - 1, count - 4, count + 1] {
        fails(
            evaluate(crowd, 2, &mut memory[..wrong]),
            size,
            "2 instances × 4 joints × 12",
        );
    }
    fails(
        evaluate(crowd, 4, &mut memory[..count]),
        argument,
        "`values` is 4",
    );
    let mut halves = vec![0u16; count];
    let (into, half_into) = (memory.as_mut_ptr(), halves.as_mut_ptr());
    let mut is_done = false;
    // SAFETY: memory of that size, or what is refused.
    unsafe {
        let null_output = tumble_crowd_evaluate(crowd, 2, null_mut(), count);
        fails(
            null_output,
            TumbleResult::InvalidPointer,
            "`output` is null",
        );
        let odd = into.cast::<u8>().wrapping_add(1).cast();
        let unaligned = tumble_crowd_evaluate(crowd, 2, odd, count);
        fails(unaligned, TumbleResult::InvalidPointer, "not aligned to 4");
        fails(
            tumble_crowd_evaluate_half(crowd, 2, half_into, count - 1),
            size,
            "× 12",
        );
        fails(
            tumble_crowd_wait(crowd, into, count),
            state,
            "nothing is in flight",
        );
        fails(
            tumble_crowd_wait_half(crowd, half_into, count),
            state,
            "nothing is in flight",
        );
        fails(
            tumble_crowd_poll(crowd, &raw mut is_done),
            state,
            "nothing is in flight",
        );
        fails(
            tumble_crowd_poll(crowd, null_mut()),
            TumbleResult::InvalidPointer,
            "`done` is null",
        );
        fails(tumble_crowd_submit(crowd, 2, 2), argument, "`half` is 2");
        done(tumble_crowd_submit(crowd, 2, 0));
        fails(tumble_crowd_submit(crowd, 2, 0), state, "was not taken");
        fails(
            evaluate(crowd, 2, &mut memory[..count]),
            state,
            "was not taken",
        );
        fails(
            tumble_crowd_wait_half(crowd, half_into, count),
            state,
            "the result is in 32 bits; take it with tumble_crowd_wait",
        );
        fails(tumble_crowd_wait(crowd, into, count - 1), size, "× 12");
        assert!(memory.iter().all(|&number| number == 7.0));
        done(tumble_crowd_wait(crowd, into, count));
        assert!(memory[..count].iter().all(|&number| number != 7.0));
        fails(
            tumble_crowd_wait(crowd, into, count),
            state,
            "nothing is in flight",
        );
        // Freed with a result that was not read.
        done(tumble_crowd_submit(crowd, 0, 1));
    }
    done(tumble_crowd_free(crowd));

    // Skinning matrices need inverse bind matrices.
    let (mut library, engine, set) = (null_mut(), cpu(), one_track());
    // SAFETY: one number, and room for the handle.
    done(unsafe { tumble_crowd_library_new([-1].as_ptr(), null(), 1, 0, &raw mut library) });
    done(push(library, set, None));
    let crowd = c_crowd(engine, library, (1, 1));
    fails(
        evaluate(crowd, 3, &mut [0.0; 12]),
        state,
        "no inverse bind matrices",
    );
    fails(
        tumble_crowd_submit(crowd, 3, 1),
        state,
        "no inverse bind matrices",
    );
    done(evaluate(crowd, 2, &mut [0.0; 12]));
    done(tumble_crowd_free(crowd));
    done(tumble_crowd_library_free(library));
    done(tumble_set_free(set));
    done(tumble_engine_free(engine));
}

#[test]
fn targets_need_the_applications_device() {
    let (library, _) = libraries();
    for engine in engines() {
        let crowd = c_crowd(engine, library, (1, 1));
        let mut target = null_mut();
        // SAFETY: room for the handle; the buffer is refused.
        let refused = unsafe {
            [
                tumble_crowd_target_new(crowd, 2, 0, 1, 0, 1 << 20, &raw mut target),
                tumble_crowd_stage_target_new(crowd, 0, 1, 0, 1 << 20, &raw mut target),
            ]
        };
        for made in refused {
            fails(
                made,
                TumbleResult::InvalidArgument,
                "tumble_engine_from_vulkan",
            );
        }
        done(tumble_crowd_free(crowd));
        done(tumble_engine_free(engine));
    }
    done(tumble_crowd_library_free(library));
}

#[test]
fn handles_of_vulkan_are_looked_at() {
    let nothing = TumbleVulkan {
        size: size_of::<TumbleVulkan>(),
        get_instance_proc_addr: None,
        instance: null_mut(),
        physical_device: null_mut(),
        device: null_mut(),
        queue: null_mut(),
        queue_family: 0,
        api_version: 0,
        shader_float_controls: 0,
        shader_int64: 0,
        copy_queue: null_mut(),
        copy_queue_family: 0,
        lock_queue: None,
        unlock_queue: None,
        queue_user: null_mut(),
        pipeline_cache: 0,
    };
    let mut engine = null_mut();
    // SAFETY: a structure and room for the handle; null and wrong values are refused.
    let mut open = |vulkan: *const TumbleVulkan| unsafe {
        tumble_engine_from_vulkan(vulkan, null(), &raw mut engine)
    };
    let pointer = TumbleResult::InvalidPointer;
    fails(open(null()), pointer, "`vulkan` is null");
    let of_size = TumbleVulkan { size: 1, ..nothing };
    fails(
        open(&raw const of_size),
        TumbleResult::InvalidArgument,
        "set it to `sizeof`",
    );
    fails(
        open(&raw const nothing),
        pointer,
        "get_instance_proc_addr` is null",
    );
    unsafe extern "C" fn never() {}
    let without = TumbleVulkan {
        get_instance_proc_addr: Some(never),
        ..nothing
    };
    fails(
        open(&raw const without),
        pointer,
        "`vulkan->instance` is null",
    );
}

#[test]
fn weights_fades_and_lists_are_checked() {
    let crowd = small();
    let (range, argument) = (TumbleResult::OutOfRange, TumbleResult::InvalidArgument);
    let pointer = TumbleResult::InvalidPointer;
    let output = CrowdOutput::from(CrowdValues::Model);
    done(tumble_crowd_fade(crowd, 1, 1, 0.5, 0));
    let before = bits(crowd, output, false);
    for (instance, layer, weight, code, says) in [
        (2, 1, 0.5, range, "no instance 2"),
        (1, 2, 0.5, range, "no layer 2"),
        (1, 0, 0.5, argument, "the first layer has no weight"),
        (1, 1, -0.5, argument, "weight is -0.5"),
        (1, 1, f32::NAN, argument, "weight is NaN"),
    ] {
        fails(
            tumble_crowd_set_weight(crowd, instance, layer, weight),
            code,
            says,
        );
        fails(
            tumble_crowd_fade(crowd, instance, layer, weight, 9),
            code,
            says,
        );
    }
    let mut fade = TumbleCrowdFade {
        size: 8,
        instance: 1,
        layer: 1,
        start: 0,
        ticks: 9,
        from: 2.0,
        to: 0.0,
    };
    let mut is_there = true;
    // SAFETY: arguments that are refused, structures, and room for the truth value.
    unsafe {
        fails(
            tumble_crowd_set_fade(crowd, null()),
            pointer,
            "`fade` is null",
        );
        fails(
            tumble_crowd_set_fade(crowd, &raw const fade),
            argument,
            "`fade->size` is 8",
        );
        let found = tumble_crowd_get_fade(crowd, &raw mut fade, &raw mut is_there);
        fails(found, argument, "`fade->size` is 8");
        fade.size = size_of::<TumbleCrowdFade>();
        fails(
            tumble_crowd_set_fade(crowd, &raw const fade),
            argument,
            "weight is 2",
        );
        let found = tumble_crowd_get_fade(crowd, &raw mut fade, null_mut());
        fails(found, pointer, "`fades` is null");
        fade.instance = 0;
        done(tumble_crowd_get_fade(
            crowd,
            &raw mut fade,
            &raw mut is_there,
        ));
        assert!(!is_there && fade.from == 2.0);
        fails(
            tumble_crowd_set_visible(crowd, null(), 1),
            pointer,
            "`instances` is null",
        );
        let list = [1, 0, 1, 2];
        fails(
            tumble_crowd_set_visible(crowd, list.as_ptr(), 3),
            argument,
            "instance 1 is in the list twice, again at 2",
        );
        fails(
            tumble_crowd_set_visible(crowd, list[3..].as_ptr(), 1),
            range,
            "no instance 2",
        );
        fails(
            tumble_crowd_visible_count(crowd, null_mut()),
            pointer,
            "`count` is null",
        );
    }
    assert!(
        bits(crowd, output, false) == before,
        "what is refused changes nothing"
    );
    done(tumble_crowd_free(crowd));
}

#[test]
fn passed_events_are_those_of_rust() {
    let (library, mut rust_library) = libraries();
    let name = c"step";
    let event = |clip, tick, event| {
        // SAFETY: text, and null or room for the number.
        unsafe { tumble_crowd_library_push_event(library, clip, tick, name.as_ptr(), event) }
    };
    let ticks = tumble_crowd_library_clip_ticks(library, 1);
    for (number, tick) in [ticks / 3, ticks].into_iter().enumerate() {
        let mut index = 9;
        done(event(1, tick, &raw mut index));
        let expected = rust_library.push_event(1, tick, "step");
        assert_eq!(expected, Ok(index));
        assert_eq!(index, number);
    }
    let argument = TumbleResult::InvalidArgument;
    fails(event(1, ticks + 1, null_mut()), argument, "after the clip");
    fails(event(3, 0, null_mut()), TumbleResult::OutOfRange, "clip 3");

    let engine = cpu();
    let crowd = c_crowd(engine, library, (3, 1));
    let rust_engine = tumble::Engine::new(tumble::Device::Cpu).unwrap();
    let mut rust_crowd = rust_engine.crowd(&rust_library, 3, 1).unwrap();
    let layer = TumbleCrowdLayer {
        instance: 2,
        clip: 1,
        speed: -1.5,
        wrap: 1,
        ..still()
    };
    // SAFETY: one structure.
    done(unsafe { tumble_crowd_set(crowd, &raw const layer, 1) });
    let played = tumble::crowd::CrowdLayer::new(1)
        .with_speed(-1.5)
        .with_wrap(tumble::WrapMode::Loop);
    rust_crowd.set(2, 0, played).unwrap();
    done(tumble_crowd_advance(crowd, 7.0));
    rust_crowd.advance(7.0).unwrap();
    let expected: Vec<TumblePassedEvent> = (rust_crowd.passed_events(0).unwrap())
        .into_iter()
        .map(TumblePassedEvent::from)
        .collect();
    assert!(expected.len() > 4, "{expected:?}");

    let passed = |since, events: &mut [TumblePassedEvent], count: *mut usize| {
        let (memory, capacity) = (events.as_mut_ptr(), events.len());
        // SAFETY: room for as many events, and null or room for the number.
        unsafe { tumble_crowd_passed_events(crowd, since, memory, capacity, count) }
    };
    let mut count = 0;
    let none = passed(0, &mut [], &raw mut count);
    fails(none, TumbleResult::WrongSize, "`capacity` is 0");
    assert_eq!(count, expected.len());
    let mut events = vec![expected[1]; count];
    done(passed(0, &mut events, &raw mut count));
    assert_eq!(events, expected);
    let later = passed(u64::MAX, &mut events, &raw mut count);
    fails(later, argument, "the clock is at");
    let nowhere = passed(0, &mut events, null_mut());
    fails(nowhere, TumbleResult::InvalidPointer, "`count` is null");
    done(tumble_crowd_free(crowd));
    done(tumble_engine_free(engine));
    done(tumble_crowd_library_free(library));
}
