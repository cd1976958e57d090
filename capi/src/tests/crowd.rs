//! Crowds through the interface of C: the bits of the engine's own.

use std::ffi::{CStr, CString, c_char};
use std::ptr::{null, null_mut};

use glam::{Affine3A, Mat3A, Quat, Vec3};
use tumble::crowd::{
    Crowd, CrowdFade, CrowdLayer, CrowdLibrary, CrowdOutput, CrowdValues, LayerBlend,
};
use tumble::{Device, Engine, Skeleton, TrackSet, VectorMethod, WrapMode, method};

use super::{cpu, defaults, fails, words};
use crate::crowd::fade::*;
use crate::crowd::layer::*;
use crate::crowd::library::*;
use crate::crowd::output::*;
use crate::crowd::player::*;
use crate::crowd::visible::*;
use crate::engine::*;
use crate::handle;
use crate::result::*;
use crate::set::*;
use crate::set_vectors::*;

pub(super) const ALL: [CrowdValues; 4] = [
    CrowdValues::Rotations,
    CrowdValues::Local,
    CrowdValues::Model,
    CrowdValues::Skinning,
];

pub(super) const PARENTS: [i32; 4] = [1, -1, 1, -1];
const OFFSETS: [[f32; 3]; 4] = [
    [0.0, -0.5, 0.0],
    [0.0, 1.0, 0.0],
    [0.1, 0.4, 0.0],
    [2.0, 0.0, 0.0],
];
const MASK: [f32; 4] = [1.0, 0.5, 0.0, 1.0];

#[track_caller]
pub(super) fn done(result: TumbleResult) {
    assert_eq!(result, TumbleResult::Ok, "{}", words());
}

/// Keys of joints that all turn differently; one is moved, another one scaled.
fn set(number: u32) -> TrackSet {
    let mut set = TrackSet::new();
    for joint in 0..4u32 {
        let count = if joint == 3 { 2 } else { 9 };
        let times: Vec<f64> = (0..count).map(|key| 0.1 + f64::from(key) * 0.25).collect();
        let key = |key: u32| {
            let angle = (key * (number + 1) + joint) as f32 * 0.3;
            Quat::from_rotation_x(angle.sin()) * Quat::from_rotation_z(angle.cos() * 0.5)
        };
        let keys: Vec<Quat> = (0..count).map(key).collect();
        set.push("", &times, &keys).unwrap();
    }
    let vectors = [[0.0, 1.0, 0.0], [0.3, 1.1, 0.2], [0.0, 1.0, 0.5]];
    let tangents = vectors.map(|vector| [Vec3::from(vector), -Vec3::from(vector)]);
    let times = [0.0, 0.7, 2.0];
    set.set_translations(1, &times, &vectors, &tangents)
        .unwrap();
    set.set_scales(
        0,
        &times,
        &vectors.map(|vector| vector.map(|x| x + 1.0)),
        &[],
    )
    .unwrap();
    set
}

/// The same set, made by C's functions.
fn c_set(tracks: &TrackSet) -> *mut TumbleSet {
    let mut set = null_mut();
    // SAFETY: pointers to as many numbers as stated, and room for handles.
    unsafe {
        done(tumble_set_new(&raw mut set));
        for track in tracks.tracks() {
            let keys: Vec<[f32; 4]> = track.keys.iter().map(Quat::to_array).collect();
            let (times, keys) = (track.times.as_ptr(), keys.as_ptr().cast());
            let name = track.name.map(|name| CString::new(name).unwrap());
            let name = name.as_ref().map_or(null(), |name| name.as_ptr());
            done(tumble_set_push(set, name, times, keys, track.times.len()));
        }
        let channels: [(_, unsafe extern "C" fn(_, _, _, _, _, _) -> _); 2] = [
            (tumble::Channel::Translation, tumble_set_translations),
            (tumble::Channel::Scale, tumble_set_scales),
        ];
        let all = (0..tracks.track_count()).flat_map(|track| channels.map(|it| (track, it)));
        for (track, (channel, give)) in all {
            let Some(vectors) = tracks.vector_keys(channel, track) else {
                continue;
            };
            let keys: Vec<[f32; 3]> = vectors.keys.iter().map(Vec3::to_array).collect();
            let tangents: Vec<[[f32; 3]; 2]> =
                (vectors.tangents.iter().map(|both| both.map(Vec3::into))).collect();
            let tangents = if tangents.is_empty() {
                null()
            } else {
                tangents.as_ptr().cast::<f32>()
            };
            let (times, keys) = (vectors.times.as_ptr(), keys.as_ptr().cast::<f32>());
            let count = vectors.times.len();
            done(give(set, track, times, keys, tangents, count));
        }
    }
    set
}

fn bind(joint: usize) -> Affine3A {
    let rotation = Mat3A::from_rotation_y(0.3 * joint as f32);
    Affine3A::from_mat3_translation(rotation.into(), Vec3::new(0.5, -0.25, joint as f32))
}

pub(super) fn push(
    library: *mut TumbleCrowdLibrary,
    set: *const TumbleSet,
    vectors: Option<&CStr>,
) -> TumbleResult {
    let slerp = crate::interpolation::TumbleInterpolation {
        method: c"slerp".as_ptr(),
        ..defaults()
    };
    let vectors: *const c_char = vectors.map_or(null(), CStr::as_ptr);
    // SAFETY: a structure and text; the number is not asked for.
    unsafe { tumble_crowd_library_push(library, set, &raw const slerp, vectors, null_mut()) }
}

/// A library of three clips, a mask, a reference pose and inverse bind matrices, by C and by Rust.
pub(super) fn libraries() -> (*mut TumbleCrowdLibrary, CrowdLibrary) {
    let parents = PARENTS.map(|parent| usize::try_from(parent).ok());
    let skeleton = Skeleton::new(parents.to_vec(), OFFSETS.map(Vec3::from).to_vec()).unwrap();
    let mut rust_library = CrowdLibrary::new(&skeleton).unwrap();
    let mut library = null_mut();
    let (parents, offsets) = (PARENTS.as_ptr(), OFFSETS.as_ptr().cast());
    // SAFETY: pointers to as many numbers as stated, and room for the handle.
    done(unsafe { tumble_crowd_library_new(parents, offsets, 4, 0, &raw mut library) });
    for number in 0..3 {
        let set = set(number);
        let (name, vectors) = match number {
            0 => (None, VectorMethod::Linear),
            1 => (Some(c"gltf-cubic"), VectorMethod::GltfCubic),
            _ => (Some(c"step"), VectorMethod::Step),
        };
        rust_library.push(&set, method::SLERP, vectors).unwrap();
        let set = c_set(&set);
        done(push(library, set, name));
        done(tumble_set_free(set));
    }
    rust_library.push_mask(&MASK).unwrap();
    rust_library.set_reference(2, 1, 70_560).unwrap();
    let matrices = [0, 1, 2, 3].map(bind);
    rust_library.set_inverse_bind(&matrices).unwrap();
    let rows = matrices.map(|matrix| {
        let columns = matrix.to_cols_array_2d();
        [0, 1, 2].map(|row| columns.map(|column| column[row]))
    });
    let mut mask = 0;
    // SAFETY: as above.
    unsafe {
        let (weights, mask) = (MASK.as_ptr(), &raw mut mask);
        done(tumble_crowd_library_push_mask(library, weights, 4, mask));
        done(tumble_crowd_library_set_inverse_bind(
            library,
            rows.as_ptr().cast(),
            4,
        ));
    }
    assert_eq!(mask, 1);
    done(tumble_crowd_library_set_reference(library, 2, 1, 70_560));
    (library, rust_library)
}

pub(super) fn c_crowd(
    engine: *const TumbleEngine,
    library: *const TumbleCrowdLibrary,
    (instances, layers): (usize, usize),
) -> *mut TumbleCrowd {
    let mut crowd = null_mut();
    // SAFETY: room for the handle.
    done(unsafe { tumble_crowd_new(engine, library, instances, layers, &raw mut crowd) });
    crowd
}

/// All zeros, and the size.
pub(super) fn still() -> TumbleCrowdLayer {
    TumbleCrowdLayer {
        size: size_of::<TumbleCrowdLayer>(),
        instance: 0,
        layer: 0,
        clip: 0,
        time: 0,
        speed: 0.0,
        weight: 0.0,
        wrap: 0,
        additive: 0,
        mask: 0,
    }
}

pub(super) fn set_layers(crowd: *mut TumbleCrowd, layers: &[TumbleCrowdLayer]) -> TumbleResult {
    // SAFETY: as many structures as stated.
    unsafe { tumble_crowd_set(crowd, layers.as_ptr(), layers.len()) }
}

/// The layers that are set in a frame, as C's structure and as Rust's: all in the first frame, later a third.
fn plays(frame: usize, (instances, layers): (usize, usize)) -> Vec<(TumbleCrowdLayer, CrowdLayer)> {
    let mut all = Vec::new();
    for i in 0..instances * layers {
        if frame > 0 && !(i + frame).is_multiple_of(3) {
            continue;
        }
        let wraps = [WrapMode::Hold, WrapMode::Loop, WrapMode::Mirror];
        let rust_layer = CrowdLayer::new((i + frame) % 3)
            .at(i as i64 * 50_000 - 200_000)
            .with_speed(i as f32 * 0.125 - 1.0)
            .with_wrap(wraps[(i + frame) % 3])
            .with_weight((i % 5) as f32 * 0.25)
            .with_blend(if i % 4 == 1 {
                LayerBlend::Additive
            } else {
                LayerBlend::Over
            })
            .with_mask(i.is_multiple_of(2).then_some(0));
        let layer = TumbleCrowdLayer {
            instance: i / layers,
            layer: i % layers,
            clip: rust_layer.clip,
            time: rust_layer.time,
            speed: rust_layer.speed,
            weight: rust_layer.weight,
            wrap: ((i + frame) % 3) as u32,
            additive: u32::from(rust_layer.blend == LayerBlend::Additive),
            mask: rust_layer.mask.map_or(0, |mask| mask + 1),
            ..still()
        };
        all.push((layer, rust_layer));
    }
    all
}

pub(super) fn count(crowd: *const TumbleCrowd, values: CrowdValues) -> usize {
    let mut count = 0;
    // SAFETY: room for the number.
    done(unsafe { tumble_crowd_output_count(crowd, values as u32, &raw mut count) });
    count
}

/// The bits of a result, of 32 or of 16 each, evaluated at once or submitted.
pub(super) fn bits(crowd: *mut TumbleCrowd, output: CrowdOutput, submits: bool) -> Vec<u32> {
    let (values, half) = (output.values as u32, output.is_half);
    let count = count(crowd, output.values);
    let (mut floats, mut halves) = (vec![f32::NAN; count], vec![0xffff_u16; count]);
    let (into, half_into) = (floats.as_mut_ptr(), halves.as_mut_ptr());
    // SAFETY: memory of that size, and room for the truth value.
    unsafe {
        match (submits, half) {
            (false, false) => done(tumble_crowd_evaluate(crowd, values, into, count)),
            (false, true) => done(tumble_crowd_evaluate_half(crowd, values, half_into, count)),
            (true, _) => {
                done(tumble_crowd_submit(crowd, values, half.into()));
                let mut is_done = false;
                while !is_done {
                    done(tumble_crowd_poll(crowd, &raw mut is_done));
                }
                if half {
                    done(tumble_crowd_wait_half(crowd, half_into, count));
                } else {
                    done(tumble_crowd_wait(crowd, into, count));
                }
            }
        }
    }
    if half {
        halves.into_iter().map(u32::from).collect()
    } else {
        floats.into_iter().map(f32::to_bits).collect()
    }
}

/// The same by the engine.
pub(super) fn rust_bits(crowd: &mut Crowd, output: CrowdOutput) -> Vec<u32> {
    let len = crowd.output_len(output);
    if output.is_half {
        let mut found = vec![[0xffff; 4]; len];
        crowd.evaluate_half_into(output.values, &mut found).unwrap();
        found.as_flattened().iter().map(|&x| x.into()).collect()
    } else {
        let mut found = vec![[f32::NAN; 4]; len];
        crowd.evaluate_into(output.values, &mut found).unwrap();
        found.as_flattened().iter().map(|x| x.to_bits()).collect()
    }
}

/// The CPU, and the first Vulkan device where there is one.
pub(super) fn engines() -> Vec<*mut TumbleEngine> {
    let has_vulkan = Device::list().is_ok_and(|devices| !devices.is_empty());
    assert!(
        has_vulkan || std::env::var_os("CI").is_none(),
        "CI must have a Vulkan device"
    );
    let mut engines = vec![cpu()];
    if has_vulkan {
        let mut engine = null_mut();
        // SAFETY: text, null and room for the handle.
        done(unsafe { tumble_engine_open(c"vulkan".as_ptr(), null(), &raw mut engine) });
        engines.push(engine);
    } else {
        eprintln!("NO VULKAN DEVICE: the CPU alone was compared");
    }
    engines
}

#[test]
fn crowds_have_the_bits_of_the_engines() {
    let shape = (37, 3);
    let (library, rust_library) = libraries();
    assert_eq!(
        tumble_crowd_library_clip_count(library),
        rust_library.clip_count()
    );
    assert_eq!(
        tumble_crowd_library_clip_ticks(library, 1),
        rust_library.ticks(1).unwrap()
    );
    assert_eq!(tumble_crowd_library_ticks_per_second(library), 705_600);
    let outputs = ALL.map(|values| [CrowdOutput::from(values), CrowdOutput::half(values)]);
    for engine in engines() {
        let mut expected = rust_crowd(&rust_library, shape);
        let crowd = c_crowd(engine, library, shape);
        for frame in 0..3 {
            let both = plays(frame, shape);
            let layers: Vec<TumbleCrowdLayer> = both.iter().map(|pair| pair.0).collect();
            done(set_layers(crowd, &layers));
            for (layer, plays) in both {
                expected.set(layer.instance, layer.layer, plays).unwrap();
            }
            match frame {
                2 => {
                    done(tumble_crowd_set_clock(crowd, 1 << 40));
                    expected.set_clock(1 << 40).unwrap();
                }
                _ => {
                    done(tumble_crowd_advance(crowd, 0.1));
                    expected.advance(0.1).unwrap();
                }
            }
            for output in outputs.as_flattened() {
                let expected_bits = rust_bits(&mut expected, *output);
                for submits in [false, true] {
                    assert!(
                        bits(crowd, *output, submits) == expected_bits,
                        "{output:?}, frame {frame}"
                    );
                }
            }
        }
        let mut reported = TumbleCrowdLayer {
            instance: 5,
            layer: 1,
            ..still()
        };
        let (mut tick, mut clock) = (0, 0);
        // SAFETY: a structure, and room for the numbers.
        unsafe {
            done(tumble_crowd_get(crowd, &raw mut reported));
            done(tumble_crowd_tick(crowd, 5, 1, &raw mut tick));
            done(tumble_crowd_clock(crowd, &raw mut clock));
        }
        let plays = reported.change(0).unwrap();
        assert_eq!(plays, (5, 1, expected.get(5, 1).unwrap()));
        assert_eq!(tick, expected.tick(5, 1).unwrap());
        assert_eq!(clock, 1 << 40);
        // A crowd needs neither its engine nor its library.
        done(tumble_engine_free(engine));
        let output = CrowdOutput::from(CrowdValues::Model);
        assert!(bits(crowd, output, false) == rust_bits(&mut expected, output));
        done(tumble_crowd_free(crowd));
    }
    done(tumble_crowd_library_free(library));
}

pub(super) fn rust_crowd(library: &CrowdLibrary, (instances, layers): (usize, usize)) -> Crowd {
    let engine = Engine::new(Device::Cpu).unwrap();
    engine.crowd(library, instances, layers).unwrap()
}

/// Threads that set and evaluate one crowd at once are served one after another; a call goes on when another
/// thread frees the crowd.
#[test]
fn crowds_may_be_used_by_threads() {
    let shape = (64, 2);
    let (library, rust_library) = libraries();
    let both = plays(0, shape);
    let mut expected = rust_crowd(&rust_library, shape);
    for (layer, plays) in &both {
        expected.set(layer.instance, layer.layer, *plays).unwrap();
    }
    let output = CrowdOutput::from(CrowdValues::Skinning);
    let expected = rust_bits(&mut expected, output);
    for engine in engines() {
        let crowd = c_crowd(engine, library, shape);
        let all: Vec<TumbleCrowdLayer> = both.iter().map(|pair| pair.0).collect();
        let shared = crowd.addr();
        let crowd_of = move || std::ptr::without_provenance_mut::<TumbleCrowd>(shared);
        std::thread::scope(|scope| {
            for part in all.chunks(32) {
                scope.spawn(move || {
                    for layer in part {
                        done(set_layers(crowd_of(), &[*layer]));
                        assert_eq!(bits(crowd_of(), output, false).len(), 64 * 4 * 12);
                    }
                });
            }
        });
        assert!(bits(crowd, output, false) == expected);
        let count = count(crowd, output.values);
        std::thread::scope(|scope| {
            for _ in 0..3 {
                scope.spawn(move || {
                    let mut memory = vec![0.0; count];
                    loop {
                        let into = memory.as_mut_ptr();
                        // SAFETY: memory of that size.
                        match unsafe { tumble_crowd_evaluate(crowd_of(), 3, into, count) } {
                            TumbleResult::Ok => {}
                            TumbleResult::InvalidHandle => break,
                            other => panic!("{other:?}: {}", words()),
                        }
                    }
                });
            }
            scope.spawn(move || {
                std::thread::yield_now();
                done(tumble_crowd_free(crowd_of()));
            });
        });
        done(tumble_engine_free(engine));
    }
}

/// A call that ends in a panic leaves what its lock guards unknown: it is not used again.
#[test]
fn a_crowd_is_not_used_after_a_panic() {
    let (library, _) = libraries();
    let engine = cpu();
    let crowd = c_crowd(engine, library, (1, 1));
    let result = code(|| {
        let crowd = handle::get(crowd)?;
        let _state = crowd.lock()?;
        panic!("on purpose")
    });
    assert_eq!(result, TumbleResult::Internal);
    let result = tumble_crowd_advance(crowd, 0.1);
    super::fails(
        result,
        TumbleResult::Internal,
        "earlier call with this crowd",
    );
    done(tumble_crowd_free(crowd));
    done(tumble_crowd_library_free(library));
    done(tumble_engine_free(engine));
}

/// Weights and fades, and lists of visible instances: the bits and the numbers of the engine's.
#[test]
fn fades_and_lists_are_those_of_the_engine() {
    let shape = (37, 3);
    let (library, rust_library) = libraries();
    let both = plays(0, shape);
    let layers: Vec<TumbleCrowdLayer> = both.iter().map(|pair| pair.0).collect();
    for engine in engines() {
        let mut expected = rust_crowd(&rust_library, shape);
        let crowd = c_crowd(engine, library, shape);
        done(set_layers(crowd, &layers));
        for (layer, plays) in &both {
            expected.set(layer.instance, layer.layer, *plays).unwrap();
        }
        for instance in 0..37 {
            let ticks = instance as u64 * 10_000;
            done(tumble_crowd_fade(crowd, instance, 1, 1.0, ticks));
            expected.fade(instance, 1, 1.0, ticks).unwrap();
            let weight = instance as f32 / 36.0;
            done(tumble_crowd_set_weight(crowd, instance, 2, weight));
            expected.set_weight(instance, 2, weight).unwrap();
        }
        let mut fade = TumbleCrowdFade {
            size: size_of::<TumbleCrowdFade>(),
            instance: 5,
            layer: 2,
            start: 50_000,
            ticks: 100_000,
            from: 0.25,
            to: 0.75,
        };
        let rust_fade = CrowdFade::new(0.25, 0.75)
            .with_start(50_000)
            .with_ticks(100_000);
        let mut is_there = false;
        // SAFETY: structures, and room for the truth value.
        unsafe {
            done(tumble_crowd_set_fade(crowd, &raw const fade));
            fade.layer = 1;
            done(tumble_crowd_get_fade(
                crowd,
                &raw mut fade,
                &raw mut is_there,
            ));
        }
        expected.set_fade(5, 2, rust_fade).unwrap();
        let found = (fade.start, fade.ticks, fade.from, fade.to);
        let of_engine = expected.get_fade(5, 1).unwrap().unwrap();
        let CrowdFade {
            start,
            ticks,
            from,
            to,
            ..
        } = of_engine;
        assert!(is_there && found == (start, ticks, from, to));
        let output = CrowdOutput::from(CrowdValues::Model);
        for list in [&[30usize, 2, 5][..], &[5], &[]] {
            // SAFETY: as many numbers as stated, and room for one.
            unsafe {
                done(tumble_crowd_set_visible(crowd, list.as_ptr(), list.len()));
                let mut count = 99;
                done(tumble_crowd_visible_count(crowd, &raw mut count));
                assert_eq!(count, list.len());
            }
            expected.set_visible(list).unwrap();
            done(tumble_crowd_advance(crowd, 0.1));
            expected.advance(0.1).unwrap();
            for submits in [false, true] {
                let found = bits(crowd, output, submits);
                assert!(found == rust_bits(&mut expected, output), "{list:?}");
            }
        }
        done(tumble_crowd_set_all_visible(crowd));
        expected.set_all_visible();
        assert!(bits(crowd, output, true) == rust_bits(&mut expected, output));
        done(tumble_crowd_free(crowd));
        done(tumble_engine_free(engine));
    }
    done(tumble_crowd_library_free(library));
}

/// Tracks with other names than the library's joints, or in another order.
#[test]
fn sets_are_matched_to_the_joints_by_name() {
    const NAMES: [&str; 4] = ["knee", "hip", "arm", "crate"];
    let [first, second] = [0, 1].map(set);
    let named = |set: &TrackSet, names: [&str; 4]| {
        let mut set = set.clone();
        for (track, name) in names.into_iter().enumerate() {
            set.set_name(track, name).unwrap();
        }
        set
    };
    let order = [3, 1, 0, 2];
    let mut library = null_mut();
    let (parents, offsets) = (PARENTS.as_ptr(), OFFSETS.as_ptr().cast());
    // SAFETY: pointers to as many numbers as stated, and room for the handle.
    done(unsafe { tumble_crowd_library_new(parents, offsets, 4, 0, &raw mut library) });
    let name = |joint: usize| {
        let name = tumble_crowd_library_joint_name(library, joint);
        // SAFETY: the library is alive.
        unsafe { CStr::from_ptr(name) }.to_str().unwrap()
    };
    assert_eq!([0, 1, 2, 3].map(name), [""; 4]);
    // The first set determines the joints and their order; the second has its tracks in another order.
    let shuffled = named(&second, NAMES).select(order).unwrap();
    for tracks in [&named(&first, NAMES), &shuffled] {
        let set = c_set(tracks);
        done(push(library, set, None));
        done(tumble_set_free(set));
    }
    assert_eq!([0, 1, 2, 3].map(name), NAMES);
    let refused = |tracks: &TrackSet, says: &str| {
        let set = c_set(tracks);
        fails(push(library, set, None), TumbleResult::InvalidInput, says);
        done(tumble_set_free(set));
    };
    refused(
        &named(&second, NAMES).select(0..3).unwrap(),
        "the library has a joint `crate`, the clip has none of that name",
    );
    refused(
        &named(&second, ["knee", "Root", "arm", "crate"]),
        "the library has a joint `hip`, the clip has none of that name",
    );
    refused(
        &second,
        "the library has a joint `knee`, but the joints of the clip have no names",
    );
    assert_eq!(tumble_crowd_library_clip_count(library), 2);
    // The same clips with their tracks in the order of the joints.
    let parents = PARENTS.map(|parent| usize::try_from(parent).ok());
    let skeleton = Skeleton::new(parents.to_vec(), OFFSETS.map(Vec3::from).to_vec()).unwrap();
    let mut rust_library = CrowdLibrary::new(&skeleton).unwrap();
    for set in [&first, &second] {
        let pushed = rust_library.push(set, method::SLERP, VectorMethod::Linear);
        pushed.unwrap();
    }
    let engine = cpu();
    let crowd = c_crowd(engine, library, (2, 1));
    let mut rust_crowd = rust_crowd(&rust_library, (2, 1));
    let clips = [0, 1].map(|clip| TumbleCrowdLayer {
        instance: clip,
        clip,
        time: 500_000,
        ..still()
    });
    done(set_layers(crowd, &clips));
    for (instance, plays) in clips.iter().enumerate() {
        let layer = CrowdLayer::new(plays.clip)
            .at(plays.time)
            .with_speed(plays.speed);
        rust_crowd.set(instance, 0, layer).unwrap();
    }
    let output = CrowdOutput::from(CrowdValues::Model);
    assert_eq!(
        bits(crowd, output, false),
        rust_bits(&mut rust_crowd, output)
    );
    done(tumble_crowd_free(crowd));
    done(tumble_crowd_library_free(library));
    done(tumble_engine_free(engine));
}
