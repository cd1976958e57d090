//! Wrong uses from C, and the errors that they get.

mod crowd;
mod crowd_files;
mod crowd_refusals;
mod crowd_states;
mod sampler;

use std::ffi::{CStr, c_char};
use std::ptr::{dangling, dangling_mut, null, null_mut};

use tumble::{Device, Engine, SampleTimes, TrackSet, method};

use crate::clip::*;
use crate::engine::*;
use crate::file::*;
use crate::handle;
use crate::interpolation::*;
use crate::request::TumbleMatrixOrder;
use crate::result::*;
use crate::samples::*;
use crate::set::*;
use crate::version::*;

/// Constants of C count the values of the engine's options.
#[test]
fn constants_count_the_options_of_the_engine() {
    use tumble::crowd::{CrowdStage, CrowdValues};
    use tumble::{Ends, KeySigns, Quantity, Speed, WrapMode};

    #[track_caller]
    fn same<C: std::fmt::Debug, T: std::fmt::Debug>(constants: &[C], options: &[T]) {
        let plain = |text: String| {
            text.replace(['(', ')'], "")
                .split(" {")
                .next()
                .unwrap()
                .replace("In", "")
        };
        let constants: Vec<String> = (constants.iter())
            .map(|constant| plain(format!("{constant:?}")))
            .collect();
        let options: Vec<String> = (options.iter())
            .map(|option| plain(format!("{option:?}")))
            .collect();
        assert_eq!(constants, options);
    }

    use TumbleQuantity as Q;
    same(
        &[TumbleKeySigns::Shortest, TumbleKeySigns::AsAuthored],
        &KeySigns::ALL,
    );
    same(&[TumbleSpeed::AsKeyed, TumbleSpeed::Constant], &Speed::ALL);
    same(
        &[
            TumbleWrap::Hold,
            TumbleWrap::Loop,
            TumbleWrap::Mirror,
            TumbleWrap::Extrapolate,
        ],
        &WrapMode::ALL,
    );
    let ends = [
        TumbleEnds::Parabolic,
        TumbleEnds::Natural,
        TumbleEnds::Clamped,
        TumbleEnds::Secant,
        TumbleEnds::Loop,
        TumbleEnds::Frozen,
    ];
    assert!((ends.iter().zip(1..)).all(|(ends, number)| *ends as u32 == number));
    same(&ends, &Ends::ALL);
    same(
        &[
            Q::Rotation,
            Q::VelocityInBody,
            Q::VelocityInParent,
            Q::AccelerationInBody,
            Q::AccelerationInParent,
        ],
        &Quantity::ALL,
    );
    same(
        &[TumbleLayout::TrackMajor, TumbleLayout::FrameMajor],
        &tumble::Layout::ALL,
    );
    same(
        &[TumbleMatrixOrder::RowMajor, TumbleMatrixOrder::ColumnMajor],
        &tumble::MatrixOrder::ALL,
    );
    use crate::crowd::output::TumbleCrowdValues as V;
    same(
        &[V::Rotations, V::Local, V::Model, V::Skinning],
        &CrowdValues::ALL,
    );
    use crate::crowd::target::TumbleCrowdStage as S;
    same(
        &[S::LocalToModel, S::ModelToSkinning, S::LocalToSkinning],
        &CrowdStage::ALL,
    );
}

fn words() -> &'static str {
    // SAFETY: text that ends with a zero, which the tests read before another call fails.
    unsafe { CStr::from_ptr(tumble_last_error()) }
        .to_str()
        .unwrap()
}

/// The call failed like that, and its words say so.
#[track_caller]
fn fails(result: TumbleResult, code: TumbleResult, says: &str) {
    assert_eq!(result, code, "{}", words());
    assert!(words().contains(says), "{}", words());
}

fn cpu() -> *mut TumbleEngine {
    let mut engine = null_mut();
    // SAFETY: text, null and room for the handle.
    let opened = unsafe { tumble_engine_open(c"cpu".as_ptr(), null(), &raw mut engine) };
    assert_eq!(opened, TumbleResult::Ok, "{}", words());
    engine
}

const TIMES: [f64; 3] = [0.0, 0.5, 2.0];
const KEYS: [[f32; 4]; 3] = [
    [0.0, 0.0, 0.0, 1.0],
    [0.6, 0.0, 0.0, 0.8],
    [0.0, 0.8, 0.6, 0.0],
];

fn push(set: *mut TumbleSet, times: *const f64, keys: *const f32, count: usize) -> TumbleResult {
    // SAFETY: the tests pass pointers to as many numbers as stated, or pointers that are refused.
    unsafe { tumble_set_push(set, c"joint".as_ptr(), times, keys, count) }
}

fn one_track() -> *mut TumbleSet {
    let mut set = null_mut();
    // SAFETY: room for the handle.
    assert_eq!(unsafe { tumble_set_new(&raw mut set) }, TumbleResult::Ok);
    let pushed = push(set, TIMES.as_ptr(), KEYS.as_ptr().cast(), 3);
    assert_eq!(pushed, TumbleResult::Ok, "{}", words());
    set
}

fn at_60_fps() -> TumbleSamples {
    TumbleSamples {
        size: size_of::<TumbleSamples>(),
        sampling: TumbleSampling::Keys as u32,
        rate_frames: 60,
        rate_seconds: 0,
        start: 0.0,
        end: 0.0,
        times: null(),
        time_count: 0,
    }
}

fn defaults() -> TumbleInterpolation {
    TumbleInterpolation {
        size: size_of::<TumbleInterpolation>(),
        method: null(),
        signs: 0,
        ends: 0,
        quantity: 0,
        speed: 0,
        before: 0,
        after: 0,
        start_velocity: [0.0; 3],
        end_velocity: [0.0; 3],
        tension: 0.0,
        continuity: 0.0,
        bias: 0.0,
    }
}

fn evaluate(
    engine: *const TumbleEngine,
    set: *const TumbleSet,
    how: &TumbleInterpolation,
    samples: &TumbleSamples,
    output: &mut [f32],
) -> TumbleResult {
    let (count, output) = (output.len(), output.as_mut_ptr());
    // SAFETY: structures, and memory of that size.
    unsafe { tumble_evaluate(engine, set, how, samples, 0, output, count) }
}

#[test]
fn zeros_are_the_engines_defaults() {
    let (engine, set) = (cpu(), one_track());
    let mut tracks = TrackSet::new();
    tracks.push("joint", &TIMES, &KEYS).unwrap();
    let expected = Engine::new(Device::Cpu).unwrap();
    let expected = expected.evaluate(&tracks, method::BESSEL_OVERHAUSER, &SampleTimes::fps(60));
    let expected = expected.unwrap();
    let expected: Vec<u32> = (expected.as_quats().iter())
        .flat_map(|rotation| rotation.to_array().map(f32::to_bits))
        .collect();
    let mut output = vec![0.0; expected.len()];
    let done = evaluate(engine, set, &defaults(), &at_60_fps(), &mut output);
    assert_eq!(done, TumbleResult::Ok, "{}", words());
    let found: Vec<u32> = output.iter().map(|number| number.to_bits()).collect();
    assert_eq!(found, expected);
    // Memory that is aligned for f32, but not for rotations of 16 bytes.
    let mut all = vec![0.0; expected.len() + 1];
    let done = evaluate(engine, set, &defaults(), &at_60_fps(), &mut all[1..]);
    assert_eq!(done, TumbleResult::Ok);
    let found: Vec<u32> = all[1..].iter().map(|number| number.to_bits()).collect();
    assert_eq!(found, expected);
    let name = tumble_engine_device_name(engine);
    // SAFETY: text of an engine that is not freed yet.
    assert_eq!(unsafe { CStr::from_ptr(name) }, c"CPU");
}

#[test]
fn a_handle_that_was_freed_or_is_another_is_refused() {
    let (engine, set) = (cpu(), one_track());
    let mut output = vec![0.0; 4 * 121];
    let (how, samples) = (defaults(), at_60_fps());
    let invalid = TumbleResult::InvalidHandle;
    let mut try_with = |engine, set| evaluate(engine, set, &how, &samples, &mut output);
    fails(try_with(null(), set), invalid, "the engine is null");
    fails(try_with(engine, null()), invalid, "the set is null");
    fails(try_with(set.cast(), set), invalid, "kind `engine`");
    fails(try_with(engine, dangling()), invalid, "never existed");
    assert_eq!(tumble_set_free(set), TumbleResult::Ok);
    fails(try_with(engine, set), invalid, "was freed");
    fails(tumble_set_free(set), invalid, "was freed");
    fails(tumble_set_free(engine.cast()), invalid, "kind `set`");
    assert_eq!(tumble_set_track_count(set), 0);
    assert!(tumble_engine_device_name(null()).is_null());
    assert_eq!(tumble_engine_free(null_mut()), TumbleResult::Ok);
    // A clip works after its engine and its set were freed.
    let (set, mut clip) = (one_track(), null_mut());
    // SAFETY: handles, and room for one.
    let uploaded = unsafe { tumble_upload(engine, set, null(), &raw mut clip) };
    assert_eq!(uploaded, TumbleResult::Ok, "{}", words());
    assert_eq!(tumble_engine_free(engine), TumbleResult::Ok);
    assert_eq!(tumble_set_free(set), TumbleResult::Ok);
    let samples = at_60_fps();
    let count = output.len();
    // SAFETY: a structure, and memory of that size.
    let done =
        unsafe { tumble_clip_evaluate(clip, &raw const samples, 1, output.as_mut_ptr(), count) };
    assert_eq!(done, TumbleResult::Ok, "{}", words());
    assert_eq!(tumble_clip_free(clip), TumbleResult::Ok);
}

#[test]
fn pointers_and_sizes_are_checked() {
    let set = one_track();
    let (times, keys) = (TIMES.as_ptr(), KEYS.as_ptr().cast::<f32>());
    let pointer = TumbleResult::InvalidPointer;
    fails(push(set, null(), keys, 3), pointer, "`times` is null");
    fails(push(set, times, null(), 3), pointer, "`keys` is null");
    let odd = keys.cast::<u8>().wrapping_add(1).cast();
    fails(
        push(set, times, odd, 3),
        pointer,
        "`keys` is not aligned to 4",
    );
    let argument = TumbleResult::InvalidArgument;
    for count in [usize::MAX, usize::MAX / 4, isize::MAX as usize / 8] {
        fails(push(set, times, keys, count), argument, "no memory holds");
    }
    fails(
        push(set, times, keys, 0),
        TumbleResult::InvalidInput,
        "no keys",
    );
    let mut other = null_mut();
    // SAFETY: the call refuses the arguments before it reads memory.
    let shared = |key_count, track_count, out: *mut *mut TumbleSet| unsafe {
        tumble_set_with_shared_times(times, key_count, keys, track_count, out)
    };
    fails(
        shared(3, usize::MAX / 2, &raw mut other),
        argument,
        "no memory holds",
    );
    fails(
        shared(1 << 40, 1 << 40, &raw mut other),
        argument,
        "no memory holds",
    );
    fails(shared(3, 1, null_mut()), pointer, "`set` is null");
    assert_eq!(shared(3, 1, &raw mut other), TumbleResult::Ok);
    assert_eq!(tumble_set_key_count(other), 3);
    // SAFETY: the null pointer is refused.
    fails(
        unsafe { tumble_set_new(null_mut()) },
        pointer,
        "`set` is null",
    );
    assert_eq!(tumble_set_track_count(set), 1, "nothing refused was pushed");
}

#[test]
fn results_are_as_large_as_their_memory() {
    let (engine, set) = (cpu(), one_track());
    let (how, samples) = (defaults(), at_60_fps());
    let mut count = 0;
    // SAFETY: a structure, and room for the number.
    let counted = unsafe { tumble_set_sample_count(set, &raw const samples, &raw mut count) };
    assert_eq!((counted, count), (TumbleResult::Ok, 121), "{}", words());
    let mut output = vec![7.0; 4 * count + 1];
    for wrong in [0, 4 * count - 1, 4 * count + 1] {
        let done = evaluate(engine, set, &how, &samples, &mut output[..wrong]);
        fails(done, TumbleResult::WrongSize, "1 tracks × 121 samples × 4");
    }
    assert!(output.iter().all(|&number| number == 7.0));
    let sized = 4 * count;
    // SAFETY: memory that is refused.
    let done = unsafe {
        tumble_evaluate(
            engine,
            set,
            &raw const how,
            &raw const samples,
            0,
            null_mut(),
            sized,
        )
    };
    fails(done, TumbleResult::InvalidPointer, "`output` is null");
    let out_of_range = TumbleSamples {
        sampling: TumbleSampling::Range as u32,
        end: 1e30,
        ..samples
    };
    let done = evaluate(engine, set, &how, &out_of_range, &mut output);
    fails(done, TumbleResult::InvalidInput, "at most");
}

#[test]
fn constants_names_and_versions_are_checked() {
    let (engine, set) = (cpu(), one_track());
    let mut output = vec![0.0; 4 * 121];
    let mut with = |how: TumbleInterpolation, samples: TumbleSamples| {
        evaluate(engine, set, &how, &samples, &mut output)
    };
    let (how, samples) = (defaults(), at_60_fps());
    let argument = TumbleResult::InvalidArgument;
    for (wrong, says) in [
        (TumbleInterpolation { signs: 2, ..how }, "signs` is 2"),
        (TumbleInterpolation { ends: 7, ..how }, "ends` is 7"),
        (TumbleInterpolation { quantity: 5, ..how }, "quantity` is 5"),
        (TumbleInterpolation { speed: 2, ..how }, "speed` is 2"),
        (TumbleInterpolation { before: 4, ..how }, "before` is 4"),
        (
            TumbleInterpolation {
                after: u32::MAX,
                ..how
            },
            "after` is 4294967295",
        ),
        (TumbleInterpolation { size: 8, ..how }, "set it to `sizeof`"),
    ] {
        fails(with(wrong, samples), argument, says);
    }
    let named = |name: &CStr| TumbleInterpolation {
        method: name.as_ptr(),
        ..how
    };
    fails(
        with(named(c"sleep"), samples),
        argument,
        "there is no method `sleep`",
    );
    fails(with(named(c"\xff"), samples), argument, "not UTF-8");
    let of_size = TumbleSamples { size: 0, ..samples };
    fails(with(how, of_size), argument, "set it to `sizeof`");
    let sampling = TumbleSamples {
        sampling: 4,
        ..samples
    };
    fails(with(how, sampling), argument, "sampling` is 4");
    let times = TumbleSamples {
        sampling: TumbleSampling::Times as u32,
        time_count: 3,
        ..samples
    };
    fails(
        with(how, times),
        TumbleResult::InvalidPointer,
        "times` is null",
    );
    let rate = TumbleSamples {
        rate_frames: 0,
        ..samples
    };
    fails(
        with(how, rate),
        TumbleResult::InvalidInput,
        "not a frame rate",
    );
    let velocity = TumbleInterpolation {
        quantity: TumbleQuantity::VelocityInBody as u32,
        ..how
    };
    assert_eq!(with(velocity, samples), TumbleResult::Ok, "{}", words());
    let version = env!("CARGO_PKG_VERSION").split('.');
    let version: Vec<u32> = version.map(|part| part.parse().unwrap()).collect();
    assert_eq!(tumble_version(), TUMBLE_VERSION);
    let reported = [
        TUMBLE_VERSION_MAJOR,
        TUMBLE_VERSION_MINOR,
        TUMBLE_VERSION_PATCH,
    ];
    assert_eq!(version, reported);
}

/// Programs that were compiled with an older header: what their structures have not is neither read nor written, and
/// counts as 0. Sizes of no version are refused, and those of newer headers.
#[test]
fn structures_of_older_versions_are_taken() {
    let first = std::mem::offset_of!(TumbleEngineOptions, cache_directory);
    let opened = |size: usize| {
        let options = TumbleEngineOptions {
            size,
            memory: 1 << 30,
            threads: 1,
            allow_inexact: 0,
            // The memory after an older structure may contain anything.
            cache_directory: std::ptr::without_provenance(1),
        };
        let mut engine = null_mut();
        // SAFETY: text, room for the handle, and a structure of that size or a refused one.
        let result =
            unsafe { tumble_engine_open(c"cpu".as_ptr(), &raw const options, &raw mut engine) };
        if result == TumbleResult::Ok {
            assert_eq!(tumble_engine_free(engine), TumbleResult::Ok);
        }
        result
    };
    assert_eq!(opened(first), TumbleResult::Ok, "{}", words());
    let newest = size_of::<TumbleEngineOptions>();
    for size in [
        0,
        8,
        first - 8,
        first + 1,
        first + 4,
        newest + 8,
        usize::MAX,
    ] {
        fails(opened(size), TumbleResult::InvalidArgument, "options->size");
        assert!(
            words().contains(&format!("{first} to {newest} bytes")),
            "{}",
            words()
        );
    }
}

#[test]
fn devices_files_and_methods_are_found_or_named() {
    let mut engine = null_mut();
    // SAFETY: text, null and room for the handle.
    let opened = unsafe { tumble_engine_open(c"no such".as_ptr(), null(), &raw mut engine) };
    assert_eq!(opened, TumbleResult::Device, "{}", words());
    let options = TumbleEngineOptions {
        size: size_of::<TumbleEngineOptions>(),
        memory: 0,
        threads: 100_000,
        allow_inexact: 0,
        cache_directory: null(),
    };
    // SAFETY: as above, with a structure.
    let opened =
        unsafe { tumble_engine_open(c"cpu".as_ptr(), &raw const options, &raw mut engine) };
    fails(
        opened,
        TumbleResult::InvalidArgument,
        "100000 worker threads",
    );
    let mut file = null_mut();
    // SAFETY: the path is a text that ends in NUL, and `file` has room for the handle.
    let loaded = unsafe { tumble_file_load(c"no such.glb".as_ptr(), &raw mut file) };
    fails(loaded, TumbleResult::InvalidInput, "no such.glb");
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../data/pendulum.dat\0");
    // SAFETY: as above.
    let loaded = unsafe { tumble_file_load(path.as_ptr().cast(), &raw mut file) };
    assert_eq!(loaded, TumbleResult::Ok, "{}", words());
    assert_eq!(tumble_file_clip_count(file), 1);
    assert!(tumble_file_clip_name(file, 1).is_null());
    // SAFETY: text of a file that is not freed yet.
    let method = unsafe { CStr::from_ptr(tumble_file_track_method(file, 0, 3)) };
    assert_eq!(method, c"bessel-overhauser");
    assert!(tumble_file_track_method(file, 0, 4).is_null());
    let mut set = null_mut();
    // SAFETY: room for the handle.
    let done = unsafe { tumble_file_clip_set(file, 0, &raw mut set) };
    assert_eq!((done, tumble_set_track_count(set)), (TumbleResult::Ok, 4));
    let (mut times, mut keys, mut count) = (null(), null(), 0);
    // SAFETY: room for the three results.
    let done = unsafe { tumble_set_track(set, 3, &raw mut times, &raw mut keys, &raw mut count) };
    assert_eq!(done, TumbleResult::Ok);
    // SAFETY: keys of a set that is not freed yet.
    let keys = unsafe { std::slice::from_raw_parts(keys.cast::<[f32; 4]>(), count) };
    let object = handle::get(set).unwrap();
    assert_eq!(keys[1], object.read().track(3).keys[1].to_array());
    // SAFETY: the pointers are dangling, but nothing is written, because the track does not exist.
    let done = unsafe { tumble_set_track(set, 4, dangling_mut(), dangling_mut(), dangling_mut()) };
    fails(done, TumbleResult::OutOfRange, "no track 4");
    let mut name = [1 as c_char; 5];
    let mut length = 0;
    // SAFETY: memory of that size, and room for the number.
    let mut named = |size| unsafe {
        let done = tumble_set_track_name(set, 3, name.as_mut_ptr(), size, &raw mut length);
        (done, length)
    };
    assert_eq!(named(4), (TumbleResult::WrongSize, 4));
    assert_eq!(named(5), (TumbleResult::Ok, 4));
    assert_eq!(name.map(|byte| byte as u8), *b"box4\0");
    for index in 0..tumble_method_count() {
        assert!(!tumble_method_name(index).is_null());
    }
    assert!(tumble_method_name(tumble_method_count()).is_null());
}

#[test]
fn a_map_s_origin_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("map.tum");
    std::fs::write(
        &file,
        "0 458074.5 5429380.25 162.5 0 0 0 1\n1 458075 5429381 163 0 0 0 1\n",
    )
    .unwrap();
    let path = std::ffi::CString::new(file.to_str().unwrap()).unwrap();
    let mut file = null_mut();
    // SAFETY: the path is a text that ends in NUL, and `file` has room for the handle.
    let loaded = unsafe { tumble_file_load(path.as_ptr(), &raw mut file) };
    assert_eq!(loaded, TumbleResult::Ok, "{}", words());
    let mut origin = [1.0; 3];
    // SAFETY: room for three numbers.
    let done = unsafe { tumble_file_clip_origin(file, 0, 0, origin.as_mut_ptr()) };
    assert_eq!(
        (done, origin),
        (TumbleResult::Ok, [458_075.0, 5_429_381.0, 163.0])
    );
    // SAFETY: as above.
    let done = unsafe { tumble_file_clip_origin(file, 0, 1, origin.as_mut_ptr()) };
    fails(done, TumbleResult::OutOfRange, "no track 1");
    assert_eq!(tumble_file_free(file), TumbleResult::Ok);
}

#[test]
fn a_panic_ends_as_a_code() {
    let result = code(|| panic!("on purpose"));
    fails(result, TumbleResult::Internal, "internal error: on purpose");
    assert_eq!(code(|| Ok(())), TumbleResult::Ok);
    assert!(
        words().contains("on purpose"),
        "it stays until another call fails"
    );
    let other = std::thread::spawn(|| words().len()).join().unwrap();
    assert_eq!(other, 0, "each thread has its own");
}

/// Threads that open, use and free handles do not meet each other's.
#[test]
fn handles_may_be_used_by_threads() {
    let engine = cpu().addr();
    let work = move || {
        for _ in 0..50 {
            let set = one_track();
            let mut output = vec![0.0; 4 * 121];
            let engine = std::ptr::without_provenance::<TumbleEngine>(engine);
            let done = evaluate(engine, set, &defaults(), &at_60_fps(), &mut output);
            assert_eq!(done, TumbleResult::Ok, "{}", words());
            assert_eq!(tumble_set_free(set), TumbleResult::Ok);
        }
    };
    let threads: Vec<_> = (0..4).map(|_| std::thread::spawn(work)).collect();
    for thread in threads {
        thread.join().unwrap();
    }
}
