//! What is written and read again is the same motion, from every format into every other: within
//! 1e-6, with all that both can say, or with a warning that names what is left out.

use std::collections::HashSet;

use glam::{Quat, Vec3};
use tumble::{Channel, FrameRate, TrackSet};
use tumble_formats::bvh::{BvhChannel, BvhJoint};
use tumble_formats::format::{MotionOptions, WriteError};
use tumble_formats::keyed::keyed;
use tumble_formats::motion::{Channels, Joint, Motion, Sampler, Transform};
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
        .map(|frame| match is_even {
            true => rate.time_of(frame),
            // f32 holds these exactly.
            false => {
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
        let sampler = match is_stepped {
            true => Sampler::Step,
            false => Sampler::Linear,
        };
        if !from_bvh {
            motion.channels.push(Channels {
                rotation: Some(sampler),
                translation: is_moved.then_some(sampler),
                scale: is_scaled.then_some(sampler),
            });
        }
        if !has_skeleton {
            continue;
        }
        let turned = numbers.coin() && !from_bvh;
        motion.skeleton.push(Joint {
            parent: (track > 0).then(|| numbers.below(track)),
            rest: Transform {
                translation: numbers.vector(2.0),
                rotation: if turned {
                    numbers.rotation()
                } else {
                    Quat::IDENTITY
                },
                ..Transform::default()
            },
        });
        if from_bvh {
            let turns = [[2, 0, 1], [0, 1, 2], [1, 2, 0]][numbers.below(3)];
            let positions = (0..3).map(BvhChannel::Position);
            let all = positions.filter(|_| is_moved || numbers.coin());
            motion.bvh.push(BvhJoint {
                channels: all.chain(turns.map(BvhChannel::Rotation)).collect(),
                end_sites: (0..numbers.below(2)).map(|_| numbers.vector(3.0)).collect(),
            });
        }
    }
    // In BVH a joint has no positions, or all three.
    for joint in &mut motion.bvh {
        let count = joint.channels.len();
        if count < 6 {
            joint.channels.drain(..count - 3);
        }
    }
    motion
}

/// The formats of clips, glTF as text too.
fn formats() -> impl Iterator<Item = (&'static Format, &'static str)> {
    let own = FORMATS.into_iter().filter(|format| format.writes_clips());
    let names = own.map(|format| (format, format.name));
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
    // The rate is all that KITTI does not hold of such a clip.
    let source_rate = rate.filter(|_| format.name == "kitti");
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
    let full = |list: &[Vec3], empty| match list.is_empty() {
        true => vec![empty; count],
        false => list.to_vec(),
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
    let place =
        |name: String| (0..found.set.track_count()).find(|&it| found.set.track_name(it) == name);
    let order: Option<Vec<usize>> = (0..clip.set.track_count())
        .map(|track| place(name(track)))
        .collect();
    let order = order.unwrap_or_else(|| panic!("names are lost: {:?}", found.set));
    found.select(&order).unwrap()
}

fn compare(clip: &Motion, found: &Motion, warnings: &[Diagnostic], format: &Format, case: &str) {
    let left_out = warnings.iter().find(|own| own.code == Code::NoRoom);
    let left_out = left_out.map_or("", |own| &own.message);
    let holds = |feature| format.holds(feature);
    let is_told = |words: &str| left_out.contains(words);
    let found = match holds(Feature::TrackNames) {
        true => in_order(found, clip),
        false => {
            let has_names = clip.set.tracks().any(|track| {
                track
                    .name
                    .is_some_and(|name| !name.is_empty() && name != "body")
            });
            assert!(
                !has_names || is_told("names of the tracks"),
                "{case}: {left_out}"
            );
            found.clone()
        }
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
    for (place, (own, other)) in rotations.iter().zip(&other.1).enumerate() {
        let (own, other) = (own.as_dquat().normalize(), other.as_dquat().normalize());
        let off = 2.0 * (own.conjugate() * other).xyz().length();
        assert!(off < 2e-6, "{case}: rotation {place}: {own} {other}");
    }
    let tracks = found.set.track_count();
    let continued = other.1.iter().zip(other.1.iter().skip(tracks));
    for (before, after) in continued.filter(|_| !in_world) {
        assert!(before.dot(*after) >= -1e-6, "{case}: signs jump");
    }
    let near = |own: &[Vec3], other: &[Vec3]| {
        let mut pairs = own.iter().zip(other);
        pairs.all(|(own, other)| (*own - *other).length() <= 1e-6 * own.length().max(100.0))
    };
    let has_translations = positions.iter().any(|own| *own != Vec3::ZERO);
    let same = near(&positions, &other.2);
    assert!(
        same && holds(Feature::Translations) || !has_translations || is_told("the translations"),
        "{case}: {positions:?} {:?}",
        other.2
    );
    let has_scales = scales.iter().any(|own| *own != Vec3::ONE);
    let same = near(&scales, &other.3);
    assert!(
        same && holds(Feature::Scales) || !has_scales || is_told("the scales"),
        "{case}: {left_out}"
    );
    let parents =
        |of: &Motion| -> Vec<_> { of.skeleton.iter().map(|joint| joint.parent).collect() };
    let hangs = clip.skeleton.iter().any(|joint| joint.parent.is_some());
    match holds(Feature::Skeleton) && !(clip.is_world && format.name == "bvh") {
        true if hangs => {
            assert_eq!(parents(&found), parents(clip), "{case}");
            let rests = clip.skeleton.iter().zip(&found.skeleton);
            for (track, (own, other)) in rests.enumerate() {
                let is_kept = own.rest.translation == other.rest.translation
                    // BVH without positions has the place of the joint there.
                    || format.name == "bvh" && clip.bvh.is_empty();
                assert!(is_kept, "{case}: {track}: {own:?} {other:?}");
            }
        }
        true => {}
        false => assert!(
            !hangs || is_told("the skeleton") || clip.is_world,
            "{case}: {left_out}"
        ),
    }
    if holds(Feature::RestRotations) {
        let rests = clip.skeleton.iter().zip(&found.skeleton);
        let mut rests = rests.map(|(own, other)| own.rest.rotation.dot(other.rest.rotation).abs());
        assert!(rests.all(|dot| dot > 1.0 - 1e-6), "{case}");
    } else {
        let turned = clip
            .skeleton
            .iter()
            .any(|joint| joint.rest.rotation != Quat::IDENTITY);
        assert!(
            !turned || is_told("rotations in which joints rest"),
            "{case}: {left_out}"
        );
    }
    match holds(Feature::ClipName) {
        true => assert_eq!(found.name, clip.name, "{case}"),
        false => assert!(clip.name.is_none() || is_told("name of the clip"), "{case}"),
    }
    let is_stepped = |of: &Motion| of.channels.iter().any(|own| own.has(Sampler::Step));
    match holds(Feature::Steps) {
        true => assert_eq!(is_stepped(&found), is_stepped(clip), "{case}"),
        false => assert!(
            !is_stepped(clip) || is_told("hold each key"),
            "{case}: {left_out}"
        ),
    }
    match holds(Feature::Bvh) && !clip.is_world {
        true if !clip.bvh.is_empty() => assert_eq!(found.bvh, clip.bvh, "{case}"),
        true => {}
        false => assert!(
            clip.bvh.is_empty() || clip.is_world || is_told("End Sites"),
            "{case}"
        ),
    }
}

/// Why a format may refuse a clip: what it has no room for.
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
        && !format.holds(Feature::UnevenTimes);
    is_uneven || ["tum", "euroc", "kitti"].contains(&format.name) && tracks != 1
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
            format.0.holds(Feature::Translations),
            "{}",
            format.1
        );
    }
}
