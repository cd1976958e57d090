//! A motion that is written and read again is the same, from every format into every other: within 1e-6,
//! with all that both formats can hold, or with a warning that names the parts left out.

use std::collections::HashSet;

use glam::{Quat, Vec3};
use tumble::{Channel, FrameRate, TrackSet};
use tumble_formats::format::{FormatOption, MotionOptions, WriteError};
use tumble_formats::keyed::keyed;
use tumble_formats::motion::{ChannelInterpolation, Channels, Joint, Motion, Transform};
use tumble_formats::motion::{WrittenChannel, WrittenJoint};
use tumble_formats::sample::Samples;
use tumble_formats::world::world;
use tumble_formats::{Code, Diagnostic, FORMATS, Feature, Format, ReadOptions};

/// Numbers that look random, the same in every run.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> u64 {
        // Steele, Lea, Flood: SplitMix64.
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, end: usize) -> usize {
        (self.next() % end as u64) as usize
    }

    fn coin(&mut self) -> bool {
        self.next() & 1 == 0
    }

    /// From -1 to 1.
    fn part(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1 << 23) as f32 - 1.0
    }

    fn vector(&mut self, size: f32) -> Vec3 {
        Vec3::new(self.part(), self.part(), self.part()) * size
    }

    /// Any rotation, of either sign.
    fn rotation(&mut self) -> Quat {
        loop {
            let q = Quat::from_xyzw(self.part(), self.part(), self.part(), self.part());
            if q.length() > 0.1 {
                return q.normalize();
            }
        }
    }
}

/// A clip whose features are drawn, on frames of a rate or at other times.
fn clip(numbers: &mut Numbers) -> Motion {
    let names = [
        "Bip01 L Thigh",
        "hip",
        "räder",
        "a.b",
        "x",
        "left_foot",
        "tip: 1",
        "Hüfte",
    ];
    let tracks = if numbers.coin() {
        1
    } else {
        2 + numbers.below(6)
    };
    let has_skeleton = numbers.coin();
    let is_world = numbers.below(5) == 0;
    let is_even = numbers.below(4) > 0;
    let rate = FrameRate::new([24, 30, 120][numbers.below(3)], 1).unwrap();
    let frames = 1 + numbers.below(9);
    let mut time = 0.0;
    let times: Vec<f64> = (0..frames as u64)
        .map(|frame| {
            if is_even {
                rate.time_of(frame)
            } else {
                // Multiples of 2^-10, which are exact in f32.
                time += f64::from(1 + numbers.below(60) as u32) / 64.0 + 1.0 / 1024.0;
                time
            }
        })
        .collect();
    let (moves, scales, is_stepped) =
        (numbers.coin(), numbers.below(4) == 0, numbers.below(4) == 0);
    let mut motion = Motion {
        name: numbers.coin().then(|| "Walk, fast".to_owned()),
        rate: is_even.then_some(rate),
        is_world,
        ..Motion::default()
    };
    let from_bvh = has_skeleton && numbers.coin();
    let is_smooth = !from_bvh && !is_stepped && frames.is_multiple_of(2);
    for (track, name) in names.iter().enumerate().take(tracks) {
        let keys: Vec<Quat> = times.iter().map(|_| numbers.rotation()).collect();
        motion.set.push(*name, &times, &keys).unwrap();
        let is_moved = is_world || moves && numbers.coin();
        if is_moved {
            let keys: Vec<Vec3> = times.iter().map(|_| numbers.vector(50.0)).collect();
            motion
                .set
                .set_translations(track, &times, &keys, &[])
                .unwrap();
        }
        let is_scaled = scales && !is_world && !from_bvh;
        if is_scaled {
            let keys: Vec<Vec3> = times
                .iter()
                .map(|_| Vec3::ONE + numbers.vector(0.5))
                .collect();
            motion.set.set_scales(track, &times, &keys, &[]).unwrap();
        }
        let sampler = if is_stepped && !from_bvh {
            ChannelInterpolation::Step
        } else {
            ChannelInterpolation::Linear
        };
        if !is_smooth {
            motion.channels.push(Channels {
                rotation: Some(sampler),
                translation: is_moved.then_some(sampler),
                scale: is_scaled.then_some(sampler),
            });
        }
        if !has_skeleton {
            continue;
        }
        let is_rotated = numbers.coin() && !from_bvh;
        motion.skeleton.push(Joint {
            parent: (track > 0).then(|| numbers.below(track)),
            rest: Transform {
                translation: numbers.vector(2.0),
                rotation: if is_rotated {
                    numbers.rotation()
                } else {
                    Quat::IDENTITY
                },
                ..Transform::default()
            },
        });
        if from_bvh {
            let axes = [[2, 0, 1], [0, 1, 2], [1, 2, 0]][numbers.below(3)];
            let positions = (0..3).map(WrittenChannel::Position);
            let all = positions.filter(|_| is_moved || numbers.coin());
            motion.written_joints.push(WrittenJoint {
                channels: all.chain(axes.map(WrittenChannel::Rotation)).collect(),
                end_sites: (0..numbers.below(2)).map(|_| numbers.vector(3.0)).collect(),
            });
        }
    }
    // In BVH a joint has no positions, or all three.
    for joint in &mut motion.written_joints {
        let count = joint.channels.len();
        if count < 6 {
            joint.channels.drain(..count - 3);
        }
    }
    motion
}

/// The formats of clips, glTF as text too.
fn formats() -> impl Iterator<Item = (&'static Format, &'static str)> {
    let writable = FORMATS
        .iter()
        .copied()
        .filter(|format| format.writes_clips());
    let names = writable.map(|format| (format, format.name));
    names.chain(Format::named("gltf").map(|format| (format, "gltf")))
}

/// A clip written in a format and read again, and the warnings; nothing where it is refused.
fn through(
    motion: &Motion,
    (format, ending): (&'static Format, &str),
    folder: &std::path::Path,
) -> Result<(Motion, Vec<Diagnostic>), String> {
    let samples = keyed(motion).map_err(|error| error.to_string())?;
    let file = folder.join(format!("clip.{ending}"));
    let options = MotionOptions {
        name: "out".to_owned(),
        format: ending.to_owned(),
        ..MotionOptions::default()
    };
    let mut bytes = Vec::new();
    let rate = motion.rate.or_else(|| motion.rate_of_keys());
    let sampled = samples.of(motion, rate, &[]);
    let warnings = match format.write_clips(&[sampled], &options, &mut bytes) {
        Ok(warnings) => warnings,
        Err(WriteError::Refused(why)) => return Err(why.to_string()),
        Err(WriteError::Io(error)) => panic!("{error}"),
    };
    std::fs::write(&file, bytes).unwrap();
    // A format without times does not store the rate of such a clip.
    let source_rate = rate.filter(|_| format.takes(FormatOption::TimesApart));
    let options = ReadOptions {
        source_rate,
        ..ReadOptions::default()
    };
    let loaded = format.open(&file, &options);
    let mut loaded = loaded.unwrap_or_else(|error| panic!("{ending}: {error}"));
    assert_eq!(
        (loaded.clips.len(), loaded.refused.len()),
        (1, 0),
        "{ending}"
    );
    Ok((loaded.clips.remove(0), warnings))
}

/// The poses of a clip relative to the parents, or to the world.
fn poses(motion: &Motion, in_world: bool) -> (Vec<f64>, Vec<Quat>, Vec<Vec3>, Vec<Vec3>) {
    let samples: Samples = keyed(motion).unwrap();
    let times = samples
        .times
        .iter()
        .map(|time| time + motion.time_offset as f64);
    let times = times.collect();
    let count = samples.rotations.len();
    if in_world {
        let world = world(motion, &samples).unwrap();
        let rotations = world.iter().map(|pose| pose.rotation).collect();
        let positions = world.iter().map(|pose| pose.position.as_vec3()).collect();
        return (times, rotations, positions, vec![Vec3::ONE; count]);
    }
    let full = |list: &[Vec3], empty| {
        if list.is_empty() {
            vec![empty; count]
        } else {
            list.to_vec()
        }
    };
    let translations = full(&samples.translations, Vec3::ZERO);
    let scales = full(&samples.scales, Vec3::ONE);
    (times, samples.rotations, translations, scales)
}

/// The tracks of `found` in the order of `clip`: BVH has children behind their parents.
fn in_order(found: &Motion, clip: &Motion) -> Motion {
    if clip
        .set
        .tracks()
        .any(|track| track.name.is_none_or(str::is_empty))
    {
        return found.clone();
    }
    let name = |track: usize| clip.set.track_name(track);
    let track_named =
        |name: String| (0..found.set.track_count()).find(|&it| found.set.track_name(it) == name);
    let order: Option<Vec<usize>> = (0..clip.set.track_count())
        .map(|track| track_named(name(track)))
        .collect();
    let order = order.unwrap_or_else(|| panic!("names are lost: {:?}", found.set));
    found.select(&order).unwrap()
}

fn compare(clip: &Motion, found: &Motion, warnings: &[Diagnostic], format: &Format, case: &str) {
    let left_out = warnings.iter().find(|warning| warning.code == Code::NoRoom);
    let left_out = left_out.map_or("", |warning| &warning.message);
    let supports = |feature| format.supports(feature);
    let is_reported = |words: &str| left_out.contains(words);
    let found = if supports(Feature::TrackNames) {
        in_order(found, clip)
    } else {
        let has_names = clip.set.tracks().any(|track| {
            track
                .name
                .is_some_and(|name| !name.is_empty() && name != "body")
        });
        assert!(
            !has_names || is_reported("names of the tracks"),
            "{case}: {left_out}"
        );
        found.clone()
    };
    let in_world = clip.is_world != found.is_world;
    let ((times, rotations, positions, scales), other) =
        (poses(clip, in_world), poses(&found, in_world));
    assert_eq!(times.len(), other.0.len(), "{case}");
    for (time, other) in times.iter().zip(&other.0) {
        assert!(
            (time - other).abs() <= 1e-6 * time.abs().max(1.0),
            "{case}: {time} {other}"
        );
    }
    for (i, (before, after)) in rotations.iter().zip(&other.1).enumerate() {
        let (before, after) = (before.as_dquat().normalize(), after.as_dquat().normalize());
        let off = 2.0 * (before.conjugate() * after).xyz().length();
        assert!(off < 2e-6, "{case}: rotation {i}: {before} {after}");
    }
    let tracks = found.set.track_count();
    let continued = other.1.iter().zip(other.1.iter().skip(tracks));
    for (before, after) in continued.filter(|_| !in_world) {
        assert!(before.dot(*after) >= -1e-6, "{case}: signs jump");
    }
    let near = |before: &[Vec3], after: &[Vec3]| {
        let mut pairs = before.iter().zip(after);
        pairs
            .all(|(before, after)| (*before - *after).length() <= 1e-6 * before.length().max(100.0))
    };
    let has_translations = positions.iter().any(|position| *position != Vec3::ZERO);
    let same = near(&positions, &other.2);
    assert!(
        same && supports(Feature::Translations)
            || !has_translations
            || is_reported("the translations"),
        "{case}: {positions:?} {:?}",
        other.2
    );
    let has_scales = scales.iter().any(|scale| *scale != Vec3::ONE);
    let same = near(&scales, &other.3);
    assert!(
        same && supports(Feature::Scales) || !has_scales || is_reported("the scales"),
        "{case}: {left_out}"
    );
    let parents =
        |of: &Motion| -> Vec<_> { of.skeleton.iter().map(|joint| joint.parent).collect() };
    let hangs = clip.skeleton.iter().any(|joint| joint.parent.is_some());
    if supports(Feature::Skeleton) && !(clip.is_world && format.name == "bvh") {
        if hangs {
            assert_eq!(parents(&found), parents(clip), "{case}");
            let rests = clip.skeleton.iter().zip(&found.skeleton);
            for (track, (before, after)) in rests.enumerate() {
                let is_kept = before.rest.translation == after.rest.translation
                    // Without position channels, BVH stores the joint's position as its offset.
                    || format.name == "bvh" && clip.written_joints.is_empty();
                assert!(is_kept, "{case}: {track}: {before:?} {after:?}");
            }
        }
    } else {
        assert!(
            !hangs || is_reported("the skeleton") || clip.is_world,
            "{case}: {left_out}"
        );
    }
    if supports(Feature::RestRotations) {
        let rests = clip.skeleton.iter().zip(&found.skeleton);
        let mut rests =
            rests.map(|(before, after)| before.rest.rotation.dot(after.rest.rotation).abs());
        assert!(rests.all(|dot| dot > 1.0 - 1e-6), "{case}");
    } else {
        let is_rotated = clip
            .skeleton
            .iter()
            .any(|joint| joint.rest.rotation != Quat::IDENTITY);
        assert!(
            !is_rotated || is_reported("rotations in which joints rest"),
            "{case}: {left_out}"
        );
    }
    if supports(Feature::ClipName) {
        assert_eq!(found.name, clip.name, "{case}");
    } else {
        assert!(
            clip.name.is_none() || is_reported("name of the clip"),
            "{case}"
        );
    }
    let is_stepped = |of: &Motion| {
        of.channels
            .iter()
            .any(|channels| channels.has(ChannelInterpolation::Step))
    };
    if supports(Feature::Steps) {
        assert_eq!(is_stepped(&found), is_stepped(clip), "{case}");
    } else {
        assert!(
            !is_stepped(clip) || is_reported("the steps of channels"),
            "{case}: {left_out}"
        );
    }
    let is_linear = |of: &Motion| {
        of.channels
            .iter()
            .any(|channels| channels.rotation == Some(ChannelInterpolation::Linear))
    };
    let bends = clip.set.tracks().any(|track| track.keys.len() > 2);
    let says_so = is_linear(clip) && bends;
    if supports(Feature::Lines) {
        assert!(is_linear(&found) || !says_so, "{case}");
    } else {
        assert_eq!(is_reported("lines and arcs"), says_so, "{case}: {left_out}");
    }
    let is_smooth = clip.channels.is_empty() && bends;
    if supports(Feature::Curves) {
        assert!(!is_smooth || !is_linear(&found), "{case}");
    } else {
        assert_eq!(
            is_reported("smooth curves"),
            is_smooth,
            "{case}: {left_out}"
        );
    }
    if supports(Feature::Bvh) && !clip.is_world {
        if !clip.written_joints.is_empty() {
            assert_eq!(found.written_joints, clip.written_joints, "{case}");
        }
    } else {
        assert!(
            clip.written_joints.is_empty() || clip.is_world || is_reported("End Sites"),
            "{case}"
        );
    }
}

/// Whether a format may refuse a clip, because it cannot hold a part of it.
fn may_be_refused(clip: &Motion, format: &Format) -> bool {
    let tracks = clip.set.track_count();
    let times = clip.key_times();
    let is_frame = |rate: FrameRate| {
        let mut frames = times
            .iter()
            .map(|time| (time - times[0]) * rate.per_second());
        let mut next = 0.0;
        frames.all(|frame| {
            next += 1.0;
            (frame + 1.0 - next).abs() < 0.01
        })
    };
    let is_uneven = !clip
        .rate
        .or_else(|| clip.rate_of_keys())
        .is_some_and(is_frame)
        && !format.supports(Feature::UnevenTimes);
    is_uneven || tracks != 1 && !format.supports(Feature::SeveralTracks)
}

/// No format that stores skeletons writes a file that none of them could read.
#[test]
fn parents_in_a_circle_are_not_written() {
    let mut clip = Motion::default();
    for (name, parent) in [("hip", None), ("knee", Some(2)), ("foot", Some(1))] {
        clip.set
            .push(name, &[0.0, 1.0], &[Quat::IDENTITY; 2])
            .unwrap();
        clip.skeleton.push(Joint {
            parent,
            rest: Transform::default(),
        });
    }
    let samples = keyed(&clip).unwrap();
    let with_skeletons = formats().filter(|(format, _)| format.supports(Feature::Skeleton));
    for (format, name) in with_skeletons {
        let options = MotionOptions {
            format: name.to_owned(),
            ..MotionOptions::default()
        };
        let mut bytes = Vec::new();
        let written = format.write_clips(&[samples.of(&clip, None, &[])], &options, &mut bytes);
        let Err(WriteError::Refused(why)) = written else {
            panic!("{name}: {written:?}");
        };
        assert_eq!((why.code, bytes.len()), (Code::Parents, 0), "{name}");
        assert!(why.message.contains("is its own ancestor"), "{name}: {why}");
    }
}

#[test]
fn what_is_written_is_read_again_from_every_format_into_every_other() {
    let folder = tempfile::tempdir().unwrap();
    let mut numbers = Numbers(7);
    let mut pairs = HashSet::new();
    for case in 0..24 {
        let clip = clip(&mut numbers);
        for first in formats() {
            let case = format!("clip {case}, {}", first.1);
            let found = match through(&clip, first, folder.path()) {
                Err(why) => {
                    assert!(may_be_refused(&clip, first.0), "{case}: {why}");
                    continue;
                }
                Ok((found, warnings)) => {
                    compare(&clip, &found, &warnings, first.0, &case);
                    found
                }
            };
            for second in formats() {
                let case = format!("{case}, then {}", second.1);
                match through(&found, second, folder.path()) {
                    Err(why) => assert!(may_be_refused(&found, second.0), "{case}: {why}"),
                    Ok((again, warnings)) => {
                        pairs.insert((first.1, second.1));
                        compare(&found, &again, &warnings, second.0, &case);
                    }
                }
            }
        }
    }
    let count = formats().count();
    assert_eq!(pairs.len(), count * count, "{pairs:?}");
}

/// Two keys of BVH that differ by 2° and jump in sign.
#[test]
fn signs_continue_whatever_writes_them() {
    let folder = tempfile::tempdir().unwrap();
    let mut set = TrackSet::new();
    let keys = [-1.0f32, 1.0].map(|side| Quat::from_rotation_z((180.0 + side).to_radians()));
    set.push("a", &[0.0, 0.5], &[keys[0], -keys[1]]).unwrap();
    set.set_translations(0, &[0.0, 0.5], &[Vec3::X; 2], &[])
        .unwrap();
    let motion = Motion {
        set,
        rate: FrameRate::new(2, 1).ok(),
        ..Motion::default()
    };
    for format in formats() {
        let (found, _) = through(&motion, format, folder.path()).unwrap();
        let keys = found.set.track(0).keys;
        assert!(keys[0].dot(keys[1]) > 0.99, "{}: {keys:?}", format.1);
        let moved = found.set.vector_keys(Channel::Translation, 0);
        let moved = moved.map_or(0, |keys| keys.keys.len());
        assert_eq!(
            moved > 0,
            format.0.supports(Feature::Translations),
            "{}",
            format.1
        );
    }
}

/// A file that is written can be read, with any names of tracks.
#[test]
fn files_with_any_names_are_read_again() {
    let names = [
        "left\0arm",
        "a,b\"c\"",
        "=1+1",
        "line\nend",
        "{brace}",
        " ",
        "räder",
    ];
    let mut clip = Motion {
        rate: FrameRate::new(10, 1).ok(),
        ..Motion::default()
    };
    for name in names {
        clip.set
            .push(name, &[0.0, 0.1], &[Quat::IDENTITY; 2])
            .unwrap();
    }
    let keys = keyed(&clip).unwrap();
    for format in FORMATS.iter().filter(|format| format.writes_clips()) {
        if !format.supports(Feature::SeveralTracks) {
            continue;
        }
        let mut bytes = Vec::new();
        let sampled = [keys.of(&clip, clip.rate, &[])];
        let options = MotionOptions::default();
        let warnings = format.write_clips(&sampled, &options, &mut bytes).unwrap();
        let loaded = (format.read_bytes)("clip", bytes, &ReadOptions::default());
        let loaded = loaded.unwrap_or_else(|error| panic!("{}: {error}", format.name));
        let set = &loaded.clips[0].set;
        assert_eq!(set.track_count(), names.len(), "{}", format.name);
        let is_changed = set.track_name(0) != names[0] && format.supports(Feature::TrackNames);
        let has_warning = warnings
            .iter()
            .any(|warning| warning.code == Code::NameChanged);
        assert!(!is_changed || has_warning, "{}: {warnings:?}", format.name);
    }
}

/// Seconds that are as large as milliseconds since 1970 are not written where they would be read as such (E029).
#[test]
fn times_too_large_for_seconds_are_not_written_where_they_would_be_milliseconds() {
    let mut clip = Motion::default();
    let times = [1.7e12, 1.7e12 + 1.0];
    clip.set.push("", &times, &[Quat::IDENTITY; 2]).unwrap();
    let keys = keyed(&clip).unwrap();
    for format in FORMATS.iter().filter(|format| format.writes_clips()) {
        let sampled = [keys.of(&clip, None, &[])];
        for times_apart in [false, true] {
            let options = MotionOptions {
                times_apart,
                ..MotionOptions::default()
            };
            let mut bytes = Vec::new();
            let written = format.write_clips(&sampled, &options, &mut bytes);
            let refused = match &written {
                Err(WriteError::Refused(error)) => error.code == Code::LargeSeconds,
                _ => false,
            };
            let expected = match format.name {
                "csv" | "parquet" | "arrow" | "tum" => true,
                "kitti" => times_apart,
                _ => false,
            };
            assert_eq!(refused, expected, "{} {times_apart}", format.name);
            // These formats store whole nanoseconds or arrays of seconds, so large times are no
            // problem.
            if ["euroc", "npz"].contains(&format.name) {
                assert!(written.unwrap().is_empty());
                let read = (format.read_bytes)("clip", bytes, &ReadOptions::default()).unwrap();
                let again = &read.clips[0];
                let seconds = again.set.track(0).times.iter();
                let seconds = seconds.map(|time| time + again.time_offset as f64);
                assert_eq!(seconds.collect::<Vec<_>>(), times, "{}", format.name);
                assert_eq!(read.warnings, [], "{}", format.name);
            }
        }
    }
}
