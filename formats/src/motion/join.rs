//! Joins clips into one, one after another in time.

use std::array;

use glam::{Quat, Vec3};
use tumble::{Channel, FrameRate, JointMatchError, TrackError, TrackSet};

use crate::motion::{ChannelInterpolation, Channels, Joint, Motion};
use crate::rate::frame_time;

/// Why clips cannot be joined.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum JoinError {
    /// There are no clips.
    #[error("there are no clips to join")]
    Nothing,
    /// The seconds between two clips are not stated, and the clips have no common rate.
    #[error(
        "the clips have no common rate, so that the time between them is not known; state it in seconds"
    )]
    NoGap,
    /// The seconds between two clips are negative or not finite.
    #[error("{gap} is no number of seconds from 0 on")]
    Gap {
        /// The seconds.
        gap: f64,
    },
    /// The clips have different joints.
    #[error(transparent)]
    Joints(#[from] JointMatchError),
    /// A clip differs from the first one in something that all keys of a clip have in common.
    #[error("clip {clip} and clip 0 differ in {property}")]
    Differ {
        /// The index of the clip.
        clip: usize,
        /// The property in which they differ.
        property: String,
    },
    /// Without time between two clips, the end of one is not the start of the next.
    #[error(
        "{channel} differs between the end of clip {clip} and the start of the next clip, and there is no time between the \
         two; state a number of seconds greater than 0"
    )]
    Apart {
        /// The index of the clip.
        clip: usize,
        /// The track or the scalar, and its channel.
        channel: String,
    },
    /// A key that is needed where a channel is constant, or that only some clips have tangents, velocities or tensions.
    #[error(
        "{channel} has tangents, velocities or tensions at its keys, but not at all keys that it needs; sample the clips \
         first"
    )]
    KeyData {
        /// The track or the scalar, and its channel.
        channel: String,
    },
    /// The keys are not valid.
    #[error(transparent)]
    Track(#[from] TrackError),
}

/// Joins clips of one skeleton in this order. Joints are matched by name and have the order of the first clip. The keys
/// of the first clip keep their times. The first key of each other clip follows `gap` seconds after the end of the clip
/// before it, or, without `gap`, one frame of the clips' common rate. The values of keys do not change. With a gap of
/// 0, the two poses at which clips meet must be equal; they become one key. A channel that is constant in one clip, or
/// ends before it, gets keys where the clip begins and ends, so that it stays constant there. Curves change in the
/// intervals next to the places where clips meet.
///
/// # Errors
/// * When there is no clip.
/// * When the clips differ in their joints, offsets, units or interpolation.
/// * When the gap is not known, or is 0 and the two poses differ.
/// * When a new key would need tangents, velocities or tensions.
pub fn join(clips: &[&Motion], gap: Option<f64>) -> Result<Motion, JoinError> {
    let first = *clips.first().ok_or(JoinError::Nothing)?;
    let rate_of = |clip: &Motion| clip.rate.or_else(|| clip.rate_of_keys());
    let rate = rate_of(first).filter(|&rate| clips.iter().all(|clip| rate_of(clip) == Some(rate)));
    let gap = match (gap, rate) {
        (Some(gap), _) => gap,
        (None, Some(rate)) => 1.0 / rate.per_second(),
        (None, None) if clips.len() == 1 => 0.0,
        (None, None) => return Err(JoinError::NoGap),
    };
    if !(gap >= 0.0 && gap.is_finite()) {
        return Err(JoinError::Gap { gap });
    }
    let rate = rate.filter(|rate| {
        let frames = gap * rate.per_second();
        (frames - frames.round()).abs() < 1e-6
    });
    let mut ordered = Vec::with_capacity(clips.len());
    for (index, &clip) in clips.iter().enumerate() {
        let names = ["clip 0".to_owned(), format!("clip {index}")];
        let order = (first.joints()).order_of(&clip.joints(), [&names[0], &names[1]])?;
        let clip = clip.select(&order)?;
        check(first, &clip, index)?;
        ordered.push(clip);
    }
    let parts = ClipPart::all(&ordered, gap, rate);
    let mut set = TrackSet::new();
    let mut channels = Vec::new();
    for track in 0..first.set.track_count() {
        channels.push(push_track(&mut set, &parts, track)?);
    }
    let has_channels = ordered.iter().any(|clip| !clip.channels.is_empty());
    let mut joined = Motion {
        set,
        channels: if has_channels { channels } else { Vec::new() },
        rate: None,
        ..first.without_tracks()
    };
    if let Some(robot) = joined.robot.as_mut().filter(|_| clips.len() > 1) {
        // The recorded poses of bodies belong to the keys of one clip, so the joined clip has none.
        robot.bodies = None;
    }
    for scalar in 0..first.set.scalar_count() {
        push_scalar(&mut joined, &parts, scalar)?;
    }
    if clips.iter().all(|clip| clip.rate.is_some()) {
        joined.rate = rate.or_else(|| joined.rate_of_keys());
    }
    Ok(joined)
}

/// Refuses a clip that differs from the first one; its joints are in the order of the first.
fn check(first: &Motion, clip: &Motion, index: usize) -> Result<(), JoinError> {
    let differ = |property: &str| {
        let property = property.to_owned();
        Err(JoinError::Differ {
            clip: index,
            property,
        })
    };
    if first.is_world != clip.is_world {
        return differ("whether poses are relative to the world");
    }
    if first.skeleton.len() != clip.skeleton.len() {
        return differ("their skeletons: one has none");
    }
    let rest = |joint: &Joint| joint.rest;
    if let Some(joint) = (0..first.skeleton.len())
        .find(|&joint| rest(&first.skeleton[joint]) != rest(&clip.skeleton[joint]))
    {
        let name = first.set.track_name(joint);
        return differ(&format!("where `{name}` rests (its offset)"));
    }
    let tracks = first.set.track_count();
    if let Some(track) = (0..tracks).find(|&track| first.origin(track) != clip.origin(track)) {
        let name = first.set.track_name(track);
        return differ(&format!(
            "the origin from which the positions of `{name}` count"
        ));
    }
    let names = |motion: &Motion| -> Vec<String> {
        motion
            .scalar_keys()
            .map(|keys| keys.name.to_owned())
            .collect()
    };
    if names(first) != names(clip) {
        return differ("the names or the order of their scalars");
    }
    let mut scalars = 0..first.set.scalar_count();
    let is_other = |&scalar: &usize| {
        let [a, b] = [first, clip].map(|motion| motion.scalar(scalar));
        (a.kind, a.origin, a.interpolation) != (b.kind, b.origin, b.interpolation)
    };
    if let Some(scalar) = scalars.find(is_other) {
        let name = &names(first)[scalar];
        return differ(&format!(
            "the kind, the origin or the interpolation of the scalar `{name}`"
        ));
    }
    Ok(())
}

/// A clip, and its span of time in the joined clip.
struct ClipPart<'a> {
    clip: &'a Motion,
    /// Its first and its last key in its times.
    span: (f64, f64),
    /// Its start in the joined clip in seconds.
    start: f64,
    /// The rate of all keys.
    rate: Option<FrameRate>,
    /// The seconds from its ends to the next keys of channels that are constant there.
    step: f64,
}

impl<'a> ClipPart<'a> {
    fn all(clips: &'a [Motion], gap: f64, rate: Option<FrameRate>) -> Vec<Self> {
        let mut parts: Vec<Self> = Vec::with_capacity(clips.len());
        for clip in clips {
            let span = clip.set.time_span().unwrap_or_default();
            let times = clip.key_times();
            let steps = times.windows(2).map(|pair| pair[1] - pair[0]);
            let mut part = Self {
                clip,
                span,
                start: span.0,
                rate: None,
                step: steps.fold(f64::INFINITY, f64::min),
            };
            if let Some(before) = parts.last() {
                part.start = before.moved(before.span.1) + gap;
                part.rate = rate;
            }
            parts.push(part);
        }
        parts
    }

    /// A time of the clip in the joined one.
    fn moved(&self, time: f64) -> f64 {
        if self.start == self.span.0 {
            return time;
        }
        let time = time - self.span.0 + self.start;
        match self.rate {
            Some(rate) => frame_time(rate, 0.0, time),
            None => time,
        }
    }
}

/// A key of a clip that a key of the joined clip is: the index of the clip, and that of the key.
type KeySource = (usize, usize);

/// The keys of a channel of the joined clip.
struct JoinedKeys<T> {
    times: Vec<f64>,
    keys: Vec<T>,
    /// For each key, the two keys of clips that it is: seen from the interval before it and from the interval after it.
    /// They differ where two clips meet. `None` for a key that was added to keep a channel constant.
    sources: Vec<Option<[KeySource; 2]>>,
}

impl<T: Copy> JoinedKeys<T> {
    /// Joins the keys of a channel; `lists` has the times and keys of each part. `same` compares two values. The error
    /// is the index of a clip whose last value differs from the first value of the next clip.
    fn new(
        parts: &[ClipPart<'_>],
        lists: &[(&[f64], &[T])],
        same: impl Fn(T, T) -> bool,
    ) -> Result<Self, usize> {
        let mut found = Self {
            times: Vec::new(),
            keys: Vec::new(),
            sources: Vec::new(),
        };
        let constant = lists.iter().all(|(_, keys)| keys.len() == 1);
        if constant
            && lists
                .windows(2)
                .all(|pair| same(pair[0].1[0], pair[1].1[0]))
        {
            found.push(lists[0].0[0], lists[0].1[0], Some([(0, 0); 2]));
            return Ok(found);
        }
        for (index, (part, &(times, keys))) in parts.iter().zip(lists).enumerate() {
            let start = part.moved(part.span.0);
            let mut of_part = Self::held(part, (times, keys), [index > 0, index + 1 < parts.len()]);
            for source in of_part.sources.iter_mut().flatten().flatten() {
                source.0 = index;
            }
            let meets = found.times.last().is_some_and(|&last| last >= start);
            if meets && !of_part.times.is_empty() {
                let last = found.keys.len() - 1;
                if !same(found.keys[last], of_part.keys[0]) {
                    return Err(index - 1);
                }
                if let (Some(before), Some(after)) = (&mut found.sources[last], of_part.sources[0])
                {
                    before[1] = after[1];
                }
                of_part.times.remove(0);
                of_part.keys.remove(0);
                of_part.sources.remove(0);
            }
            found.times.append(&mut of_part.times);
            found.keys.append(&mut of_part.keys);
            found.sources.append(&mut of_part.sources);
        }
        Ok(found)
    }

    /// The keys of one part. If other clips come before or after it, keys are added that keep the channel constant from
    /// the start of the part to its first key, and from its last key to the end of the part.
    fn held(part: &ClipPart<'_>, (times, keys): (&[f64], &[T]), joins: [bool; 2]) -> Self {
        let mut found = Self {
            times: Vec::new(),
            keys: Vec::new(),
            sources: Vec::new(),
        };
        let (Some(&first), Some(&last)) = (times.first(), times.last()) else {
            return found;
        };
        let (start, end) = part.span;
        if times.len() == 1 {
            // A single key is a constant, so its time does not matter.
            let times = [start, start + part.step, end - part.step, end];
            for (time, is_needed) in times.into_iter().zip([true, joins[0], joins[1], true]) {
                if is_needed && found.ends_before(part, time) && (start..=end).contains(&time) {
                    let source = found.times.is_empty().then_some([(0, 0); 2]);
                    found.push(part.moved(time), keys[0], source);
                }
            }
            return found;
        }
        if joins[0] {
            for time in [start, start + part.step]
                .into_iter()
                .filter(|&time| time < first)
            {
                if found.ends_before(part, time) {
                    found.push(part.moved(time), keys[0], None);
                }
            }
        }
        for (index, (&time, &key)) in times.iter().zip(keys).enumerate() {
            found.push(part.moved(time), key, Some([(0, index); 2]));
        }
        if joins[1] {
            for time in [end - part.step, end]
                .into_iter()
                .filter(|&time| time > last)
            {
                if found.ends_before(part, time) {
                    found.push(part.moved(time), keys[keys.len() - 1], None);
                }
            }
        }
        found
    }

    /// Whether all keys are before a time of a part.
    fn ends_before(&self, part: &ClipPart<'_>, time: f64) -> bool {
        self.times
            .last()
            .is_none_or(|&last| last < part.moved(time))
    }

    fn push(&mut self, time: f64, key: T, source: Option<[KeySource; 2]>) {
        self.times.push(time);
        self.keys.push(key);
        self.sources.push(source);
    }

    /// The data of the keys, of the lists of each part; `None` if some keys have none and others have some. `of`
    /// joins those before and after a key.
    fn data<D>(&self, lists: &[&[D]], of: impl Fn(&D, &D) -> D) -> Option<Vec<D>> {
        if lists.iter().all(|list| list.is_empty()) {
            return Some(Vec::new());
        }
        let one = |source: &Option<[KeySource; 2]>| {
            let [before, after] = (*source)?.map(|(part, key)| lists[part].get(key));
            Some(of(before?, after?))
        };
        self.sources.iter().map(one).collect()
    }
}

/// Adds a track to the joined set; returns how its channels are interpolated.
fn push_track(
    set: &mut TrackSet,
    parts: &[ClipPart<'_>],
    track: usize,
) -> Result<Channels, JoinError> {
    let name = parts[0].clip.set.track_name(track);
    let tracks: Vec<_> = parts
        .iter()
        .map(|part| part.clip.set.track(track))
        .collect();
    let channel = || format!("the rotation of `{name}`");
    let no_data = || JoinError::KeyData { channel: channel() };
    let lists: Vec<(&[f64], &[Quat])> = tracks.iter().map(|it| (it.times, it.keys)).collect();
    let is_same = |a: Quat, b: Quat| a == b || a == -b;
    let joined = JoinedKeys::new(parts, &lists, is_same).map_err(|clip| JoinError::Apart {
        clip,
        channel: channel(),
    })?;
    set.push(
        tracks[0].name.unwrap_or_default(),
        &joined.times,
        &joined.keys,
    )?;
    let index = set.track_count() - 1;
    let each: Vec<_> = tracks.iter().map(|it| it.tangents).collect();
    let tangents = joined.data(&each, |before, after| [before[0], after[1]]);
    let tangents = tangents.ok_or_else(no_data)?;
    if !tangents.is_empty() {
        set.set_tangents(index, &tangents)?;
    }
    let each: Vec<_> = tracks.iter().map(|it| it.velocities).collect();
    let velocities = joined
        .data(&each, |before, _| *before)
        .ok_or_else(no_data)?;
    if !velocities.is_empty() {
        set.set_velocities(index, &velocities)?;
    }
    let each: Vec<_> = tracks.iter().map(|it| it.tcb).collect();
    let tcb = joined
        .data(&each, |before, _| *before)
        .ok_or_else(no_data)?;
    if !tcb.is_empty() {
        set.set_tcb(index, &tcb)?;
    }
    let mut channels = Channels {
        rotation: sampler(parts, (track, "rotation"), &lists, |it| it.rotation)?,
        ..Channels::default()
    };
    for of in [Channel::Translation, Channel::Scale] {
        let keyed = |part: &ClipPart<'_>| part.clip.set.vector_keys(of, track).is_some();
        if !parts.iter().any(keyed) {
            continue;
        }
        let word = match of {
            Channel::Translation => "translation",
            Channel::Scale => "scale",
        };
        let channel = format!("the {word} of `{name}`");
        // In a clip without keys for this joint, the joint is in its rest pose.
        let rests: Vec<(f64, Vec3)> = (parts.iter())
            .map(|part| (part.span.0, part.clip.rest(of, track)))
            .collect();
        let mut lists: Vec<(&[f64], &[Vec3])> = Vec::new();
        let mut each: Vec<&[[Vec3; 2]]> = Vec::new();
        for (part, rest) in parts.iter().zip(&rests) {
            let keys = part.clip.set.vector_keys(of, track);
            lists.push(keys.map_or(
                (array::from_ref(&rest.0), array::from_ref(&rest.1)),
                |keys| (keys.times, keys.keys),
            ));
            each.push(keys.map_or(&[], |keys| keys.tangents));
        }
        let joined = JoinedKeys::new(parts, &lists, |a, b| a == b);
        let joined = joined.map_err(|clip| JoinError::Apart {
            clip,
            channel: channel.clone(),
        })?;
        let tangents = joined.data(&each, |before, after| [before[0], after[1]]);
        let tangents = tangents.ok_or(JoinError::KeyData { channel })?;
        let found = sampler(parts, (track, word), &lists, |it| it.of(of))?;
        match of {
            Channel::Translation => {
                channels.translation = found;
                set.set_translations(index, &joined.times, &joined.keys, &tangents)?;
            }
            Channel::Scale => {
                channels.scale = found;
                set.set_scales(index, &joined.times, &joined.keys, &tangents)?;
            }
        }
    }
    Ok(channels)
}

/// The interpolation of a channel; all clips in which the channel moves have the same one.
fn sampler<T>(
    parts: &[ClipPart<'_>],
    (track, word): (usize, &str),
    lists: &[(&[f64], &[T])],
    of: impl Fn(Channels) -> Option<ChannelInterpolation>,
) -> Result<Option<ChannelInterpolation>, JoinError> {
    let each = parts.iter().map(|part| of(part.clip.channel(track)));
    let moving = each.clone().zip(lists).enumerate();
    let mut moving = moving.filter(|(_, (_, (times, _)))| times.len() > 1);
    let Some((_, (first, _))) = moving.next() else {
        return Ok(each.flatten().next());
    };
    match moving.find(|(_, (sampler, _))| *sampler != first) {
        None => Ok(first),
        Some((clip, _)) => {
            let name = parts[0].clip.set.track_name(track);
            let property = format!("the interpolation of the {word} of `{name}`");
            Err(JoinError::Differ { clip, property })
        }
    }
}

/// Adds a scalar to the joined clip.
fn push_scalar(
    joined: &mut Motion,
    parts: &[ClipPart<'_>],
    scalar: usize,
) -> Result<(), JoinError> {
    let all = parts.iter().filter_map(|part| part.clip.set.scalar(scalar));
    let all: Vec<_> = all.collect();
    let lists: Vec<(&[f64], &[f32])> = all.iter().map(|it| (it.times, it.keys)).collect();
    let channel = || format!("the scalar `{}`", all[0].name);
    let found = JoinedKeys::new(parts, &lists, |a, b| a == b).map_err(|clip| JoinError::Apart {
        clip,
        channel: channel(),
    })?;
    let each: Vec<_> = all.iter().map(|it| it.tangents).collect();
    let tangents = found.data(&each, |before, after| [before[0], after[1]]);
    let tangents = tangents.ok_or_else(|| JoinError::KeyData { channel: channel() })?;
    let kind = parts[0].clip.scalar(scalar);
    joined.add_scalar(kind, all[0].name, &found.times, &found.keys, &tangents)?;
    Ok(())
}
