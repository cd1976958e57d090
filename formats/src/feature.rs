//! The data that clips may contain in addition to rotations at times. Each format lists the features that it can
//! store; the documentation has a table of them. [`Format::write_clips`](crate::format::Format::write_clips) warns of
//! features that a format cannot store.

/// Data that a clip may contain in addition to rotations at times.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Feature {
    /// More than one track. A format without this feature refuses them.
    SeveralTracks,
    /// Rotations as quaternions with all bits of f32. A format without this feature stores angles or matrices.
    Quaternions,
    /// Names of the tracks.
    TrackNames,
    /// The name of the clip.
    ClipName,
    /// The parents of joints, and the position at which each rests.
    Skeleton,
    /// The rotations of joints at rest. In a format without this feature, joints rest without rotation.
    RestRotations,
    /// Positions, constant or animated.
    Translations,
    /// Scales.
    Scales,
    /// Scalars: numbers over time in addition to the tracks, such as the angles of a robot's joints.
    Scalars,
    /// The smallest and the largest value of scalars that joints allow.
    Limits,
    /// Channels that keep the value of each key until the next one.
    Steps,
    /// Channels that join their keys by straight lines and the shorter arcs. The keys of a file without this feature
    /// are interpolated by the method that the user chooses, by default a smooth one.
    Lines,
    /// Keys without a stated interpolation, which are joined by the method that the user chooses, by default a smooth
    /// one. The keys of a file without this feature are joined by straight lines and the shorter arcs.
    Curves,
    /// The order of channels and the End Sites of BVH.
    Bvh,
    /// Poses relative to the world. For a format without this feature they are converted to poses relative to the
    /// parents.
    World,
    /// The length of the boxes of a chain.
    BoxLength,
    /// Several clips in one file. For a format without this feature, each clip is written to a separate file.
    SeveralClips,
    /// Separate key times for each track. A format without this feature refuses such keys.
    TimesPerTrack,
    /// Separate key times for each channel of a track. A format without this feature refuses such keys.
    TimesPerChannel,
    /// Times that are not frames of a rate. A format without this feature refuses them.
    UnevenTimes,
    /// Times that start elsewhere than at 0, for example times since 1970.
    Start,
    /// The nanoseconds of times since 1970, which f64 rounds to 0.24 µs.
    Nanoseconds,
}

impl Feature {
    /// All features.
    pub const ALL: [Self; 22] = [
        Self::SeveralTracks,
        Self::Quaternions,
        Self::TrackNames,
        Self::ClipName,
        Self::Skeleton,
        Self::RestRotations,
        Self::Translations,
        Self::Scales,
        Self::Scalars,
        Self::Limits,
        Self::Steps,
        Self::Lines,
        Self::Curves,
        Self::Bvh,
        Self::World,
        Self::BoxLength,
        Self::SeveralClips,
        Self::TimesPerTrack,
        Self::TimesPerChannel,
        Self::UnevenTimes,
        Self::Start,
        Self::Nanoseconds,
    ];

    /// The features that tables of many clips store.
    #[cfg(feature = "parquet")]
    pub(crate) const OF_TABLES: [Self; 16] = [
        Self::SeveralTracks,
        Self::Quaternions,
        Self::TrackNames,
        Self::ClipName,
        Self::Skeleton,
        Self::Translations,
        Self::Scales,
        Self::Scalars,
        Self::Limits,
        Self::Curves,
        Self::World,
        Self::SeveralClips,
        Self::TimesPerTrack,
        Self::UnevenTimes,
        Self::Start,
        Self::Nanoseconds,
    ];

    /// A short description.
    #[must_use]
    pub fn summary(self) -> &'static str {
        match self {
            Self::SeveralTracks => "several tracks",
            Self::Quaternions => "quaternions to the last bit",
            Self::TrackNames => "names of tracks",
            Self::ClipName => "name of the clip",
            Self::Skeleton => "skeleton",
            Self::RestRotations => "rotations at rest",
            Self::Translations => "translations",
            Self::Scales => "scales",
            Self::Scalars => "scalars",
            Self::Limits => "limits of joints",
            Self::Steps => "steps",
            Self::Lines => "linear interpolation",
            Self::Curves => "smooth interpolation",
            Self::Bvh => "channel order and End Sites",
            Self::World => "poses in the world",
            Self::BoxLength => "length of boxes",
            Self::SeveralClips => "several clips",
            Self::TimesPerTrack => "separate key times for each track",
            Self::TimesPerChannel => "separate key times for each channel",
            Self::UnevenTimes => "uneven times",
            Self::Start => "start",
            Self::Nanoseconds => "nanoseconds of times since 1970",
        }
    }
}
