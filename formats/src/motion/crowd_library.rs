//! Libraries of crowds from clips of files.

use tumble::crowd::{CrowdError, CrowdLibrary};
use tumble::{JointMatchError, SkeletonError};

use crate::motion::Motion;
use crate::motion::sample::ChannelMethods;
use crate::motion::skeleton::{ClipSkeleton, OffsetSource, SkeletonMatchError};

/// Why clips of files do not make a library. Clips are counted from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CrowdLibraryError {
    /// A clip has other joints than the clips before.
    #[error("{0}; make a library for each skeleton")]
    Joints(#[from] JointMatchError),
    /// The joints are not a skeleton.
    #[error(transparent)]
    Skeleton(#[from] SkeletonError),
    /// A clip has no poses in the parents' frames.
    #[error(transparent)]
    Match(#[from] SkeletonMatchError),
    /// The rotations of a clip have several methods.
    #[error(
        "clip {clip} has rotations by {} and by {}; choose one method for all", methods[0], methods[1]
    )]
    Rotations {
        /// The clip's index.
        clip: usize,
        /// The first two methods.
        methods: [&'static str; 2],
    },
    /// The translations and scales of a clip have several methods.
    #[error(
        "clip {clip} has translations and scales by several methods; choose one method for all"
    )]
    Vectors {
        /// The clip's index.
        clip: usize,
    },
    /// The library does not take a clip.
    #[error("clip {clip}: {error}")]
    Crowd {
        /// The clip's index.
        clip: usize,
        /// The reason.
        error: CrowdError,
    },
}

/// Prepares clips of files as a library of a crowd: the first clip is clip 0 of the library, and so on.
///
/// The library has the joints of all clips, matched by name, those of the first clip first. A joint that a clip does not
/// have stays at rest in it. `methods` decides how rotations, translations and scales are interpolated:
/// [`ChannelMethods::AUTHORED`] as the file says. Inverse bind matrices and masks are added afterwards
/// ([`CrowdLibrary::set_inverse_bind`], [`CrowdLibrary::push_mask`]).
///
/// # Errors
/// When there are no clips or no joints, joints of one name have different parents, a clip's rotations are relative to the
/// world, or its rotations, or its translations and scales, have several methods.
pub fn crowd_library(
    clips: &[Motion],
    methods: ChannelMethods,
) -> Result<CrowdLibrary, CrowdLibraryError> {
    let mut joints = ClipSkeleton::default();
    for (index, clip) in clips.iter().enumerate() {
        joints.extend(clip, ["the clips before", &name(index)])?;
    }
    let of_library = |error| CrowdLibraryError::Crowd { clip: 0, error };
    let mut library = CrowdLibrary::new(&joints.of_engine()?).map_err(of_library)?;
    for (clip, motion) in clips.iter().enumerate() {
        let name = name(clip);
        let pairs = joints.some_pairs(motion, ["the library", &name])?;
        let tracks = joints.tracks(motion, &pairs, OffsetSource::Clip, &name)?;
        let rotations = methods.moving_method_of(motion);
        let rotations =
            rotations.map_err(|methods| CrowdLibraryError::Rotations { clip, methods })?;
        let vectors = methods.vector_method_of(motion);
        let vectors = vectors.ok_or(CrowdLibraryError::Vectors { clip })?;
        let pushed = library.push(&tracks, rotations, vectors);
        pushed.map_err(|error| CrowdLibraryError::Crowd { clip, error })?;
    }
    Ok(library)
}

/// The name of a clip in messages.
fn name(clip: usize) -> String {
    format!("clip {clip}")
}

#[cfg(test)]
mod tests {
    use tumble::crowd::{CrowdLayer, CrowdValues};
    use tumble::{Device, Engine, SampleTimes};

    use super::*;
    use crate::{Format, ReadOptions};

    fn walk() -> Vec<Motion> {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../data/walk.bvh");
        let read = Format::open_detected(file.as_ref(), &ReadOptions::default());
        read.expect("data/walk.bvh can be read").clips
    }

    /// A crowd of a file's clip has the rotations that the clip has at the same time.
    #[test]
    fn clips_of_files_are_played_as_the_file_says() {
        let clips = walk();
        let library = crowd_library(&clips, ChannelMethods::AUTHORED).unwrap();
        assert_eq!(library.joint_names(), clips[0].joints().names());
        let engine = Engine::new(Device::Cpu).unwrap();
        let mut crowd = engine.crowd(&library, 1, 1).unwrap();
        let second = i64::from(library.ticks_per_second());
        crowd.set(0, 0, CrowdLayer::new(0).at(second / 2)).unwrap();
        let mut pose = vec![[0.0; 4]; crowd.output_len(CrowdValues::Rotations)];
        crowd
            .evaluate_into(CrowdValues::Rotations, &mut pose)
            .unwrap();
        let (start, _) = clips[0].set.time_span().unwrap();
        let at = SampleTimes::at(vec![start + 0.5]);
        let samples = ChannelMethods::AUTHORED.sample(&engine, &clips[0], &at);
        for (found, expected) in pose.iter().zip(samples.unwrap().rotations.iter()) {
            let expected = expected.to_array();
            let distance = expected.iter().zip(found).map(|(a, b)| (a - b).abs());
            assert!(
                distance.fold(0.0, f32::max) < 1e-6,
                "{found:?} {expected:?}"
            );
        }
    }

    #[test]
    fn clips_that_do_not_fit_are_refused() {
        let methods = ChannelMethods::AUTHORED;
        let none = crowd_library(&[], methods);
        assert!(
            matches!(none, Err(CrowdLibraryError::Crowd { .. })),
            "{none:?}"
        );
        let mut clips = walk();
        clips.extend(walk());
        clips[1].skeleton[1].parent = None;
        let other = crowd_library(&clips, methods).unwrap_err();
        assert!(matches!(other, CrowdLibraryError::Joints(_)));
        assert!(
            other
                .to_string()
                .ends_with("make a library for each skeleton"),
            "{other}"
        );
        clips[1] = walk().remove(0);
        clips[1].is_world = true;
        let world = crowd_library(&clips, methods).unwrap_err();
        assert!(
            world.to_string().starts_with("clip 1: its rotations are"),
            "{world}"
        );
    }
}
