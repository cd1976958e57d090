//! The readers and writers of motion files.

use glam::{Quat, Vec3};
use tumble::FrameRate;
use tumble_formats::bvh::{self, read_bvh};
use tumble_formats::euroc::{self, read_euroc};
use tumble_formats::fbx::read_fbx;
use tumble_formats::format::{Format, Loaded, MotionOptions};
use tumble_formats::keyed::keyed;
use tumble_formats::kitti::{self, read_kitti};
use tumble_formats::mcap::read_mcap;
use tumble_formats::motion::Motion;
use tumble_formats::tum::{self, read_tum};
use tumble_formats::{Diagnostic, Limits, ReadOptions};

use super::{location_is_inside, signature};

fn options() -> ReadOptions {
    ReadOptions {
        limits: Limits {
            line: 4096,
            file: 65_536,
            memory: None,
        },
        ..ReadOptions::default()
    }
}

/// The one clip of a file, its keys written again. An error has a location within the input.
fn written(
    bytes: &[u8],
    read: Result<Loaded, Diagnostic>,
    format: &Format,
) -> Result<(Motion, Vec<u8>, u64), u64> {
    let loaded = read.map_err(|error| {
        location_is_inside(bytes, &error);
        assert!(!error.message.is_empty());
        let hint: String = error.message.chars().rev().take(12).collect();
        signature((error.code, hint))
    })?;
    for warning in &loaded.warnings {
        location_is_inside(bytes, warning);
    }
    let codes: Vec<_> = loaded.warnings.iter().map(|warning| warning.code).collect();
    let clip = loaded.clips.into_iter().next().expect("one clip");
    for track in clip.set.tracks() {
        assert!(track.times.windows(2).all(|pair| pair[0] < pair[1]));
        for key in track.keys {
            assert!((key.as_dquat().length() - 1.0).abs() < 1e-6, "{key}");
        }
    }
    let samples = keyed(&clip).expect("one list of times");
    let mut out = Vec::new();
    let sampled = samples.of(&clip, clip.rate, &[]);
    let written = format.write_clips(&[sampled], &MotionOptions::default(), &mut out);
    written.expect("what was read");
    let of = signature((
        codes,
        clip.set.track_count().min(5),
        samples.times.len().min(3),
    ));
    Ok((clip, out, of))
}

/// The same tracks below the same parents, with the same times and translations.
fn are_alike(again: &Motion, clip: &Motion) {
    let [found, expected] = [again, clip].map(|clip| {
        let names = (0..clip.set.track_count()).map(|track| clip.set.track_name(track));
        let parents = clip.skeleton.iter().map(|joint| joint.parent);
        let mut samples = keyed(clip).expect("one list of times");
        // A list of zeros, and none, are the same.
        samples.translations.retain(|&at| at != Vec3::ZERO);
        let times = (clip.rate, clip.time_offset, samples.times);
        (
            names.collect::<Vec<_>>(),
            parents.collect::<Vec<_>>(),
            times,
            samples.translations,
        )
    });
    assert_eq!(found, expected);
}

/// The BVH parser: what it takes reads back within a millionth of a radian when it is written.
pub(crate) fn bvh(bytes: &[u8]) -> u64 {
    let read = read_bvh("fuzz", bytes, &options());
    let (clip, out, of) = match written(bytes, read, &bvh::FORMAT) {
        Ok(found) => found,
        Err(refused) => return refused,
    };
    let again =
        read_bvh("fuzz", &*out, &ReadOptions::default()).expect("a written file is read again");
    are_alike(&again.clips[0], &clip);
    let rotations = |clip: &Motion| keyed(clip).expect("one list of times").rotations;
    for (found, expected) in rotations(&again.clips[0]).into_iter().zip(rotations(&clip)) {
        let [found, expected] = [found, expected].map(|q: Quat| q.as_dquat().normalize());
        let off = 2.0 * (found * expected.conjugate()).xyz().length();
        assert!(off < 1e-6, "{expected} {off:e}");
    }
    of
}

/// The reader of FBX: clips of unit rotations at increasing times, over trees.
pub(crate) fn fbx(bytes: &[u8]) -> u64 {
    let loaded = match read_fbx("fuzz", bytes, &options()) {
        Ok(loaded) => loaded,
        Err(error) => {
            assert!(!error.message.is_empty());
            return signature(error.code);
        }
    };
    for clip in &loaded.clips {
        for (index, track) in clip.set.tracks().enumerate() {
            assert!(track.times.windows(2).all(|pair| pair[0] < pair[1]));
            for key in track.keys {
                assert!((key.as_dquat().length() - 1.0).abs() < 1e-6, "{key}");
            }
            let parent = clip.skeleton[index].parent;
            assert!(parent.is_none_or(|parent| parent < index), "{parent:?}");
        }
    }
    let codes: Vec<_> = loaded.warnings.iter().map(|warning| warning.code).collect();
    let tracks = loaded.clips.first().map(|clip| clip.set.track_count());
    signature((
        codes,
        loaded.refused.len().min(2),
        tracks.map(|count| count.min(4)),
    ))
}

/// The reader of matrices: poses of unit rotations, one for each frame, which read back nearly the same when they
/// are written.
pub(crate) fn kitti(bytes: &[u8]) -> u64 {
    let options = ReadOptions {
        source_rate: FrameRate::new(10, 1).ok(),
        ..options()
    };
    let read = read_kitti("fuzz", bytes, &options);
    let (clip, out, of) = match written(bytes, read, &kitti::FORMAT) {
        Ok(found) => found,
        Err(refused) => return refused,
    };
    let again = read_kitti("fuzz", &*out, &options).expect("a written file is read again");
    are_alike(&again.clips[0], &clip);
    let rotations = |clip: &Motion| keyed(clip).expect("one list of times").rotations;
    for (found, expected) in rotations(&again.clips[0]).into_iter().zip(rotations(&clip)) {
        let off = 1.0 - found.as_dquat().dot(expected.as_dquat()).abs();
        assert!(off < 1e-6, "{expected} {off:e}");
    }
    of
}

/// The parser of `EuRoC`'s trajectories: what it takes is written again, at the nearest nanoseconds.
pub(crate) fn euroc(bytes: &[u8]) -> u64 {
    let read = read_euroc("fuzz", bytes, &options());
    let loaded = match read {
        Ok(loaded) => loaded,
        Err(error) => {
            location_is_inside(bytes, &error);
            assert!(!error.message.is_empty());
            let hint: String = error.message.chars().rev().take(12).collect();
            return signature((error.code, hint));
        }
    };
    let clip = &loaded.clips[0];
    let samples = keyed(clip).expect("one list of times");
    let mut out = Vec::new();
    let sampled = [samples.of(clip, clip.rate, &[])];
    let written = euroc::FORMAT.write_clips(&sampled, &MotionOptions::default(), &mut out);
    // Text may have more digits than nanoseconds.
    let Ok(_) = written else {
        return signature("times in one nanosecond");
    };
    let again =
        read_euroc("fuzz", &*out, &ReadOptions::default()).expect("a written file is read again");
    let found = keyed(&again.clips[0]).expect("one list of times");
    assert_eq!(found.rotations, samples.rotations);
    assert_eq!(found.translations.len(), samples.translations.len());
    let codes: Vec<_> = loaded.warnings.iter().map(|warning| warning.code).collect();
    signature((codes, samples.times.len().min(5)))
}

/// The reader of logs: unit rotations at increasing times.
pub(crate) fn mcap(bytes: &[u8]) -> u64 {
    let loaded = match read_mcap("fuzz", bytes, &options()) {
        Ok(loaded) => loaded,
        Err(error) => {
            assert!(!error.message.is_empty());
            return signature(error.code);
        }
    };
    let clip = &loaded.clips[0];
    for track in clip.set.tracks() {
        assert!(track.times.windows(2).all(|pair| pair[0] < pair[1]));
        for key in track.keys {
            assert!((key.as_dquat().length() - 1.0).abs() < 1e-6, "{key}");
        }
    }
    let codes: Vec<_> = loaded.warnings.iter().map(|warning| warning.code).collect();
    let refused: Vec<_> = loaded.refused.iter().map(|warning| warning.code).collect();
    signature((codes, refused, clip.set.track_count().min(5)))
}

/// The trajectory parser: what it takes reads back bit for bit when it is written, with signs that
/// continue.
pub(crate) fn tum(bytes: &[u8]) -> u64 {
    let read = read_tum("fuzz", bytes, &options());
    let (clip, out, of) = match written(bytes, read, &tum::FORMAT) {
        Ok(found) => found,
        Err(refused) => return refused,
    };
    let again =
        read_tum("fuzz", &*out, &ReadOptions::default()).expect("a written file is read again");
    are_alike(&again.clips[0], &clip);
    let rotations = |clip: &Motion| keyed(clip).expect("one list of times").rotations;
    assert_eq!(rotations(&again.clips[0]), rotations(&clip));
    of
}
