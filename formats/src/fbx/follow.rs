//! Converts one channel of a node to keys that follow the curve of the file.
//!
//! FBX has curves of Euler angles, weighted cubics and layers, which no interpolation of a clip can represent.
//! Between two key times the curve is evaluated at thirds, where a cubic of glTF has the same values. If both differ
//! by more than a bound elsewhere, the interval is divided in two, on a frame if there is one.

use glam::DVec4;
use tumble::FrameRate;

use crate::motion::keys::{just_after, just_before};
use crate::rate::frame_time;

/// The largest distance between a curve and the keys that follow it: in radians for rotations, otherwise relative to
/// the largest number of the channel.
pub(super) const BOUND: f64 = 1e-6;

/// The parameters in an interval at which the curve and the keys are compared. They are not simple fractions, because
/// at those a whole turn within the interval could be overlooked.
const COMPARED: [f64; 3] = [0.839, 0.487, 0.171];

/// If a rotation is the same at the ends and the thirds of an interval, it is also checked at this parameter.
const BETWEEN: f64 = 0.414_213_56;

/// How often an interval is divided in two.
const MAX_CUTS: u32 = 12;

/// The largest angle in radians between neighbouring keys that replace the curve, so that the shorter arc is the
/// curve's.
const LONGEST_ARC: f64 = 2.1;

/// The kind of a channel's values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ChannelKind {
    Rotation,
    Vector,
}

/// A unit quaternion x y z w, or x y z and 0.
pub(super) type ChannelValue = DVec4;

/// A key time of the file, and the values of the channel at it and on either side of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct KeyStop {
    /// Seconds in the file, and in the clip.
    pub(super) file: f64,
    pub(super) clip: f64,
    pub(super) before: ChannelValue,
    pub(super) at: ChannelValue,
    pub(super) after: ChannelValue,
}

/// The keys of a channel.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum FollowedKeys {
    /// A constant value.
    Rest(ChannelValue),
    /// Each key is constant until the next one.
    Step(Vec<(f64, ChannelValue)>),
    /// Straight lines and arcs.
    Linear(Vec<(f64, ChannelValue)>),
    /// Keys with arriving and leaving tangents, per second.
    Cubic(Vec<(f64, ChannelValue, [ChannelValue; 2])>),
}

/// Why a node cannot be followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Unfollowed {
    /// Its transform at this time has a number that is not finite.
    NotFinite { time: f64 },
    /// Its curves would be evaluated more often than a file of its length allows.
    TooMuchWork,
    /// A channel takes more than [`max_keys`](ChannelFollower::max_keys).
    TooManyKeys,
}

/// Follows one channel.
pub(super) struct ChannelFollower<'a> {
    pub(super) kind: ChannelKind,
    /// The value of the channel at a time of the file.
    pub(super) value: &'a dyn Fn(f64) -> Result<ChannelValue, Unfollowed>,
    /// The rate of the file; intervals are divided on its frames.
    pub(super) rate: Option<FrameRate>,
    /// Whether keys are added only where rotations need them.
    pub(super) keyframes: bool,
    /// The limit on the number of keys of the channel, by the memory that is left.
    pub(super) max_keys: usize,
}

/// An interval in which the channel does not jump.
#[derive(Debug, Clone, Copy)]
struct FollowedInterval {
    file: [f64; 2],
    clip: [f64; 2],
    ends: [ChannelValue; 2],
    thirds: [ChannelValue; 2],
    cuts: u32,
}

/// A cubic from one end of an interval to the other.
struct Cubic {
    ends: [ChannelValue; 2],
    /// Derivatives by the parameter of the interval, not by seconds.
    tangents: [ChannelValue; 2],
}

impl Cubic {
    /// The cubic that has the values of a curve at its thirds.
    fn through(ends: [ChannelValue; 2], thirds: [ChannelValue; 2]) -> Self {
        let ([p, q], [a, b]) = (ends, thirds);
        Self {
            ends,
            tangents: [
                -5.5 * p + 9.0 * a - 4.5 * b + q,
                5.5 * q - 9.0 * b + 4.5 * a - p,
            ],
        }
    }

    fn at(&self, u: f64) -> ChannelValue {
        let ([p, q], [m, n]) = (self.ends, self.tangents);
        let (u2, v) = (u * u, 1.0 - u);
        p * (v * v * (1.0 + 2.0 * u)) + q * (u2 * (3.0 - 2.0 * u)) + m * (u * v * v) - n * (u2 * v)
    }
}

impl ChannelFollower<'_> {
    /// The keys for a channel with these stops, whose values at the thirds between them are known, and whether the
    /// keys follow the channel everywhere.
    ///
    /// # Errors
    /// When the channel cannot be evaluated, or when it takes more keys than [`max_keys`](Self::max_keys).
    pub(super) fn keys(
        &self,
        stops: &[KeyStop],
        thirds: &[[ChannelValue; 2]],
    ) -> Result<(FollowedKeys, bool), Unfollowed> {
        let first = stops[0].at;
        let each = stops
            .iter()
            .flat_map(|stop| [stop.before, stop.at, stop.after]);
        let largest = each
            .clone()
            .map(|value| value.abs().max_element())
            .fold(0.0, f64::max);
        let all = each.chain(thirds.iter().flatten().copied());
        let still = 1e-9 * largest.max(1e-9);
        let is_still = |value: ChannelValue| (value - first).abs().max_element() <= still;
        if stops.len() == 1 || all.clone().all(is_still) && self.stays_between(stops)? {
            return Ok((FollowedKeys::Rest(first), true));
        }
        if let Some(steps) = steps(stops, thirds)
            && self.stays_between(stops)?
        {
            return Ok((FollowedKeys::Step(steps), true));
        }
        let bound = match self.kind {
            ChannelKind::Rotation => BOUND,
            ChannelKind::Vector => BOUND * largest,
        };
        let (stops, pieces) = self.pieces(stops, thirds);
        if self.keyframes {
            return Ok((
                FollowedKeys::Linear(self.linear_keys(&stops, &pieces)?),
                true,
            ));
        }
        let mut are_lines = true;
        for piece in pieces.iter().flatten() {
            are_lines = are_lines && self.is_line(piece, bound)?;
        }
        match are_lines {
            true => Ok((FollowedKeys::Linear(stops), true)),
            false => self.cubics(&stops, &pieces, bound),
        }
    }

    /// Whether a rotation that is the same at the ends and the thirds of each interval is also the same between them.
    fn stays_between(&self, stops: &[KeyStop]) -> Result<bool, Unfollowed> {
        if self.kind == ChannelKind::Vector {
            return Ok(true);
        }
        for pair in stops.windows(2) {
            let [from, to] = [pair[0].file, pair[1].file];
            let middle = (self.value)(from + BETWEEN * (to - from))?;
            if self.off(pair[0].after, middle) > BOUND {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// The stops as keys with continued signs, a stop at a jump as two keys; and the intervals between them, `None`
    /// where the channel jumps.
    fn pieces(
        &self,
        stops: &[KeyStop],
        thirds: &[[ChannelValue; 2]],
    ) -> (Vec<(f64, ChannelValue)>, Vec<Option<FollowedInterval>>) {
        let mut keys: Vec<(f64, ChannelValue)> = vec![(stops[0].clip, stops[0].at)];
        let mut pieces = Vec::with_capacity(thirds.len());
        let leave = |keys: &mut Vec<(f64, ChannelValue)>,
                     stop: &KeyStop,
                     next: f64,
                     pieces: &mut Vec<_>| {
            let after = self.near(stop.after, keys[keys.len() - 1].1);
            let late = just_after(stop.clip);
            if stop.after != stop.at && late < next {
                keys.push((late, after));
                pieces.push(None);
            }
        };
        for (pair, thirds) in stops.windows(2).zip(thirds) {
            let [stop, next] = [&pair[0], &pair[1]];
            leave(&mut keys, stop, next.clip, &mut pieces);
            let (start, p) = keys[keys.len() - 1];
            let a = self.near(thirds[0], p);
            let b = self.near(thirds[1], a);
            let q = self.near(next.before, b);
            let jumps = next.before != next.at;
            let early = jumps.then(|| just_before(next.clip, Some(start))).flatten();
            let end = early.unwrap_or(next.clip);
            pieces.push(Some(FollowedInterval {
                file: [stop.file, next.file],
                clip: [start, end],
                ends: [p, q],
                thirds: [a, b],
                cuts: 0,
            }));
            keys.push((end, q));
            if early.is_some() {
                keys.push((next.clip, self.near(next.at, q)));
                pieces.push(None);
            }
        }
        (keys, pieces)
    }

    /// The one of q and -q that is nearer to `to`.
    fn near(&self, value: ChannelValue, to: ChannelValue) -> ChannelValue {
        match self.kind {
            ChannelKind::Rotation if value.dot(to) < 0.0 => -value,
            _ => value,
        }
    }

    /// The distance of a value from the channel's.
    fn off(&self, ours: ChannelValue, exact: ChannelValue) -> f64 {
        match self.kind {
            ChannelKind::Vector => (ours - exact).abs().max_element(),
            ChannelKind::Rotation => {
                let ours = ours.normalize_or_zero();
                2.0 * (ours - self.near(exact, ours)).length()
            }
        }
    }

    fn is_line(&self, piece: &FollowedInterval, bound: f64) -> Result<bool, Unfollowed> {
        let [p, q] = piece.ends;
        // Near half a turn, the direction of the arc is not determined, so the channel is not treated as a line.
        if self.kind == ChannelKind::Rotation && p.dot(q) < 0.1 {
            return Ok(false);
        }
        let at = |u: f64| match self.kind {
            ChannelKind::Vector => p.lerp(q, u),
            ChannelKind::Rotation => {
                // The unit quaternions are less than half a turn apart; libm's sine is the same on every system.
                let half = libm::atan2((q - p).length(), (q + p).length());
                let weight = |u: f64| match half < 1e-9 {
                    true => u,
                    false => libm::sin(2.0 * half * u) / libm::sin(2.0 * half),
                };
                p * weight(1.0 - u) + q * weight(u)
            }
        };
        let thirds = [1.0 / 3.0, 2.0 / 3.0].into_iter().zip(piece.thirds);
        if thirds
            .into_iter()
            .any(|(u, exact)| self.off(at(u), exact) > bound)
        {
            return Ok(false);
        }
        let middle = BETWEEN;
        Ok(self.off(at(middle), (self.value)(piece.time(middle))?) <= bound)
    }

    /// Keys with tangents that follow all intervals.
    fn cubics(
        &self,
        stops: &[(f64, ChannelValue)],
        pieces: &[Option<FollowedInterval>],
        bound: f64,
    ) -> Result<(FollowedKeys, bool), Unfollowed> {
        let mut keys = vec![(stops[0].0, stops[0].1, [ChannelValue::ZERO; 2])];
        let mut is_whole = true;
        let mut open: Vec<FollowedInterval> = Vec::new();
        for (piece, &(end, value)) in pieces.iter().zip(&stops[1..]) {
            let Some(piece) = piece else {
                keys.push((end, value, [ChannelValue::ZERO; 2]));
                continue;
            };
            open.push(*piece);
            while let Some(mut piece) = open.pop() {
                // The two halves of a divided interval may have the opposite sign of the curve before, so the sign is
                // continued from the last key.
                let last = keys.len() - 1;
                piece = self.after(piece, keys[last].1);
                let cubic = Cubic::through(piece.ends, piece.thirds);
                let mut fits = true;
                for u in COMPARED {
                    fits = fits && self.off(cubic.at(u), (self.value)(piece.time(u))?) <= bound;
                }
                if !fits && let Some(halves) = self.cut(&piece)? {
                    open.extend(halves);
                    continue;
                }
                is_whole &= fits;
                let seconds = piece.clip[1] - piece.clip[0];
                let [leaves, arrives] = cubic.tangents.map(|tangent| tangent / seconds);
                keys[last].2[1] = leaves;
                if keys.len() >= self.max_keys {
                    return Err(Unfollowed::TooManyKeys);
                }
                keys.push((piece.clip[1], piece.ends[1], [arrives, ChannelValue::ZERO]));
            }
        }
        Ok((FollowedKeys::Cubic(keys), is_whole))
    }

    /// The stops, and as many keys between them as are needed for arcs that follow the channel.
    fn linear_keys(
        &self,
        stops: &[(f64, ChannelValue)],
        pieces: &[Option<FollowedInterval>],
    ) -> Result<Vec<(f64, ChannelValue)>, Unfollowed> {
        let mut keys = vec![stops[0]];
        let mut open: Vec<FollowedInterval> = Vec::new();
        for (piece, &stop) in pieces.iter().zip(&stops[1..]) {
            let Some(piece) = piece.filter(|_| self.kind == ChannelKind::Rotation) else {
                keys.push((stop.0, self.near(stop.1, keys[keys.len() - 1].1)));
                continue;
            };
            open.push(piece);
            while let Some(piece) = open.pop() {
                let piece = self.after(piece, keys[keys.len() - 1].1);
                let ([p, q], [a, b]) = (piece.ends, piece.thirds);
                let middle = (self.value)(piece.time(BETWEEN))?;
                let steps = [(p, a), (a, middle), (middle, b), (b, q)];
                let arc = |(from, to)| self.off(from, to);
                let arc_length: f64 = steps.into_iter().map(arc).sum();
                if arc_length > LONGEST_ARC
                    && let Some(halves) = self.cut(&piece)?
                {
                    open.extend(halves);
                    continue;
                }
                if keys.len() >= self.max_keys {
                    return Err(Unfollowed::TooManyKeys);
                }
                keys.push((piece.clip[1], q));
            }
        }
        Ok(keys)
    }

    /// An interval whose signs continue those of the key before it.
    fn after(&self, piece: FollowedInterval, last: ChannelValue) -> FollowedInterval {
        let a = self.near(piece.thirds[0], last);
        let b = self.near(piece.thirds[1], a);
        FollowedInterval {
            ends: [last, self.near(piece.ends[1], b)],
            thirds: [a, b],
            ..piece
        }
    }

    /// Divides an interval in two, the later one first; `None` if it cannot be divided any more.
    fn cut(&self, piece: &FollowedInterval) -> Result<Option<[FollowedInterval; 2]>, Unfollowed> {
        let [from, to] = piece.file;
        let length = to - from;
        if piece.cuts >= MAX_CUTS || length < 1e-7 {
            return Ok(None);
        }
        let middle = f64::midpoint(from, to);
        let frame = self.rate.map(|rate| frame_time(rate, 0.0, middle));
        let is_inside = |time: &f64| *time - from > 0.05 * length && to - *time > 0.05 * length;
        let time = frame.filter(is_inside).unwrap_or(middle);
        let u = (time - from) / length;
        let clip = match piece.clip == piece.file {
            true => time,
            false => piece.clip[0] + u * (piece.clip[1] - piece.clip[0]),
        };
        let value = (self.value)(time)?;
        let half = |file: [f64; 2], clip, ends| {
            let third = |u: f64| (self.value)(file[0] + u * (file[1] - file[0]));
            Ok(FollowedInterval {
                file,
                clip,
                ends,
                thirds: [third(1.0 / 3.0)?, third(2.0 / 3.0)?],
                cuts: piece.cuts + 1,
            })
        };
        Ok(Some([
            half([time, to], [clip, piece.clip[1]], [value, piece.ends[1]])?,
            half([from, time], [piece.clip[0], clip], [piece.ends[0], value])?,
        ]))
    }
}

impl FollowedInterval {
    /// The time of the file at a parameter of the interval.
    fn time(&self, u: f64) -> f64 {
        self.file[0] + u * (self.file[1] - self.file[0])
    }
}

/// The keys of a channel that only jumps.
fn steps(stops: &[KeyStop], thirds: &[[ChannelValue; 2]]) -> Option<Vec<(f64, ChannelValue)>> {
    let intervals = stops.windows(2).zip(thirds);
    let mut are_constant = intervals.map(|(pair, [a, b])| {
        let from = pair[0].after;
        from == *a && from == *b && from == pair[1].before
    });
    if !are_constant.all(|is_constant| is_constant) {
        return None;
    }
    let mut keys = Vec::with_capacity(stops.len());
    for (index, stop) in stops.iter().enumerate() {
        keys.push((stop.clip, stop.at));
        let late = just_after(stop.clip);
        let next = stops.get(index + 1);
        if stop.after != stop.at && next.is_some_and(|next| late < next.clip) {
            keys.push((late, stop.after));
        }
    }
    Some(keys)
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;

    fn rotation(angle: f64) -> ChannelValue {
        DVec4::from(DQuat::from_rotation_x(angle))
    }

    /// The keys of a curve without jumps through some times.
    fn followed(
        kind: ChannelKind,
        times: &[f64],
        keyframes: bool,
        curve: &dyn Fn(f64) -> ChannelValue,
    ) -> (FollowedKeys, bool) {
        let stop = |&time: &f64| KeyStop {
            file: time,
            clip: time,
            before: curve(time),
            at: curve(time),
            after: curve(time),
        };
        let stops: Vec<KeyStop> = times.iter().map(stop).collect();
        let third = |pair: &[f64]| {
            let length = pair[1] - pair[0];
            [pair[0] + length / 3.0, pair[0] + 2.0 * length / 3.0].map(curve)
        };
        let thirds: Vec<_> = times.windows(2).map(third).collect();
        let follow = ChannelFollower {
            kind,
            value: &|time| Ok(curve(time)),
            rate: FrameRate::new(24, 1).ok(),
            keyframes,
            max_keys: usize::MAX,
        };
        follow.keys(&stops, &thirds).unwrap()
    }

    #[test]
    fn what_rests_and_what_goes_straight_has_no_more_keys_than_its_file() {
        let still = followed(ChannelKind::Vector, &[0.0, 1.0, 2.0], false, &|_| {
            ChannelValue::X
        });
        assert_eq!(still, (FollowedKeys::Rest(ChannelValue::X), true));
        let line = followed(ChannelKind::Vector, &[0.0, 2.0], false, &|time| {
            ChannelValue::X * time
        });
        assert_eq!(
            line.0,
            FollowedKeys::Linear(vec![
                (0.0, ChannelValue::ZERO),
                (2.0, ChannelValue::X * 2.0)
            ])
        );
        let arc = followed(ChannelKind::Rotation, &[0.0, 2.0], false, &rotation);
        assert!(matches!(arc.0, FollowedKeys::Linear(keys) if keys.len() == 2));
    }

    /// Turns of 360° hide between keys, at thirds and at halves.
    #[test]
    fn whole_turns_are_followed() {
        let full_circle = std::f64::consts::TAU;
        for circles in [1.0, 3.0, 6.0] {
            let curve = |time: f64| rotation(full_circle * circles * time);
            let (keys, is_whole) = followed(ChannelKind::Rotation, &[0.0, 1.0], false, &curve);
            let FollowedKeys::Cubic(keys) = keys else {
                panic!("{circles}: {keys:?}");
            };
            assert!(is_whole && keys.len() as f64 > 6.0 * circles, "{circles}");
            let (keys, _) = followed(ChannelKind::Rotation, &[0.0, 1.0], true, &curve);
            let FollowedKeys::Linear(linear) = keys else {
                panic!("{circles}: {keys:?}");
            };
            let arcs = linear.windows(2).map(|pair| {
                assert!(pair[0].1.dot(pair[1].1) > 0.0);
                let [p, q] = [pair[0].1, pair[1].1].map(DQuat::from_vec4);
                p.angle_between(q)
            });
            assert!(
                (arcs.sum::<f64>() - full_circle * circles).abs() < 1e-6,
                "{circles}"
            );
        }
    }

    #[test]
    fn intervals_are_cut_on_frames() {
        let curve = |time: f64| rotation((3.0 * time).sin());
        let (keys, is_whole) = followed(ChannelKind::Rotation, &[0.0, 1.0], false, &curve);
        let FollowedKeys::Cubic(keys) = keys else {
            panic!("{keys:?}");
        };
        assert!(is_whole && (5..=25).contains(&keys.len()), "{}", keys.len());
        for &(time, value, _) in &keys {
            assert_eq!(time * 24.0, (time * 24.0).round());
            assert!((value.dot(curve(time)).abs() - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn steps_hold_and_jumps_have_two_keys() {
        let stop = |time: f64, before: f64, at: f64, after: f64| KeyStop {
            file: time,
            clip: time,
            before: ChannelValue::X * before,
            at: ChannelValue::X * at,
            after: ChannelValue::X * after,
        };
        let held = |time: f64| Ok(ChannelValue::X * if time < 1.0 { 1.0 } else { 2.0 });
        let mut follow = ChannelFollower {
            kind: ChannelKind::Vector,
            value: &held,
            rate: None,
            keyframes: false,
            max_keys: usize::MAX,
        };
        let stops = [
            stop(0.0, 1.0, 1.0, 1.0),
            stop(1.0, 1.0, 2.0, 2.0),
            stop(2.0, 2.0, 2.0, 2.0),
        ];
        let thirds = [[ChannelValue::X; 2], [ChannelValue::X * 2.0; 2]];
        let keys =
            [(0.0, 1.0), (1.0, 2.0), (2.0, 2.0)].map(|(time, x)| (time, ChannelValue::X * x));
        let found = follow.keys(&stops, &thirds).unwrap();
        assert_eq!(found, (FollowedKeys::Step(keys.to_vec()), true));
        // X until time 1, then 0.
        let saw = |time: f64| Ok(ChannelValue::X * if time < 1.0 { time } else { 0.0 });
        follow.value = &saw;
        let stops = [
            stop(0.0, 0.0, 0.0, 0.0),
            stop(1.0, 1.0, 0.0, 0.0),
            stop(2.0, 0.0, 0.0, 0.0),
        ];
        let thirds = [
            [ChannelValue::X / 3.0, ChannelValue::X * (2.0 / 3.0)],
            [ChannelValue::ZERO; 2],
        ];
        let before = f64::from(1f32.next_down());
        let keys = [(0.0, 0.0), (before, 1.0), (1.0, 0.0), (2.0, 0.0)];
        let keys = keys.map(|(time, x)| (time, ChannelValue::X * x));
        let found = follow.keys(&stops, &thirds).unwrap();
        assert_eq!(found, (FollowedKeys::Linear(keys.to_vec()), true));
    }
}
