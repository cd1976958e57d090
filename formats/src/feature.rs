//! What clips may hold beside rotations at times. Each format lists what it has room for; the documents
//! show that table, and [`Format::write_clips`](crate::format::Format::write_clips) warns of the rest.

/// What a clip may hold beside rotations at times.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Feature {
    /// More than one track; a format without room refuses them.
    SeveralTracks,
    /// Rotations as quaternions, all bits of f32; a format without room has angles or matrices.
    Quaternions,
    /// Names of the tracks.
    TrackNames,
    /// A name of the clip.
    ClipName,
    /// The parents of joints, and where each rests.
    Skeleton,
    /// Rotations in which joints rest: without them joints rest unturned.
    RestRotations,
    /// Positions, at rest or moving.
    Translations,
    /// Scales.
    Scales,
    /// Channels that hold each key until the next one.
    Steps,
    /// The order of channels and the End Sites that BVH has.
    Bvh,
    /// Poses are relative to the world, not to the parents; a format without room for that gets them
    /// relative to the parents.
    World,
    /// The length of the boxes of a chain.
    BoxLength,
    /// Several clips in one file; a format without room gets a file for each.
    SeveralClips,
    /// Keys of each channel at times of its own; a format without room refuses such keys.
    TimesPerChannel,
    /// Times that are not frames of a rate; a format without room refuses them.
    UnevenTimes,
    /// Times since 1970, or any other start than 0.
    Start,
}

impl Feature {
    /// All of them.
    pub const ALL: [Self; 16] = [
        Self::SeveralTracks,
        Self::Quaternions,
        Self::TrackNames,
        Self::ClipName,
        Self::Skeleton,
        Self::RestRotations,
        Self::Translations,
        Self::Scales,
        Self::Steps,
        Self::Bvh,
        Self::World,
        Self::BoxLength,
        Self::SeveralClips,
        Self::TimesPerChannel,
        Self::UnevenTimes,
        Self::Start,
    ];

    /// What tables of many clips hold.
    #[cfg(feature = "parquet")]
    pub(crate) const OF_TABLES: [Self; 11] = [
        Self::SeveralTracks,
        Self::Quaternions,
        Self::TrackNames,
        Self::ClipName,
        Self::Skeleton,
        Self::Translations,
        Self::Scales,
        Self::World,
        Self::SeveralClips,
        Self::UnevenTimes,
        Self::Start,
    ];

    /// What it is, in a few words.
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
            Self::Steps => "steps",
            Self::Bvh => "channel order and End Sites",
            Self::World => "poses in the world",
            Self::BoxLength => "length of boxes",
            Self::SeveralClips => "several clips",
            Self::TimesPerChannel => "separate key times for each channel",
            Self::UnevenTimes => "uneven times",
            Self::Start => "start",
        }
    }
}
