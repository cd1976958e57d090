//! Signs of keys for the shortest path. `q` and `-q` are the same rotation, and on the shortest path each key has the
//! sign that is nearer to the key before it. The signs are computed once, when keys are added to a set, and stored as
//! one bit for each key.

use std::ops::Range;

use crate::math::quaternion::{dot, unit};

/// If the dot product of two keys is within this of zero, they may be exactly 180° apart, and its sign may be due to
/// the rounding of f32. Such keys keep their signs.
const DOT_NOISE: f64 = 1.0 / (1u64 << 21) as f64;

/// A dot product in f32 is within 1e-6 of the exact one. Its sign is certain if its magnitude exceeds this.
const IN_DOUBT: f32 = 1e-5;

const BITS: usize = u64::BITS as usize;

/// For each key of a set, whether its sign is changed; a track's first key keeps its sign. Nothing is stored until a
/// sign changes, which is rare.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct SignBits {
    bits: Vec<u64>,
    /// Whether any two neighbouring keys, with their original signs, are about 180° apart or more. If not,
    /// [`KeySigns::Shortest`](crate::KeySigns::Shortest) and [`KeySigns::AsAuthored`](crate::KeySigns::AsAuthored)
    /// are the same.
    pub(crate) any_long: bool,
}

impl SignBits {
    /// Adds a track whose first key has the index `first` among all keys of the set.
    pub(crate) fn push_track(&mut self, first: usize, keys: &[[f32; 4]]) {
        let mut is_negated = false;
        for (key, pair) in (first + 1..).zip(keys.windows(2)) {
            let inner = dot(pair[0], pair[1]);
            if inner <= IN_DOUBT {
                self.any_long = true;
                let exact = || dot(unit(pair[0]), unit(pair[1]));
                is_negated ^= inner < -IN_DOUBT || exact() < -DOT_NOISE;
            }
            if is_negated {
                let words = self.bits.len().max(key / BITS + 1);
                self.bits.resize(words, 0);
                self.bits[key / BITS] |= 1 << (key % BITS);
            }
        }
    }

    /// Whether certainly no sign is changed between these keys.
    pub(crate) fn are_kept(keys: &[[f32; 4]]) -> bool {
        keys.windows(2).all(|pair| dot(pair[0], pair[1]) > IN_DOUBT)
    }

    /// Bytes of the bits; 0 if no sign is changed.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.bits[..])
    }

    /// The signs of consecutive keys, by their indices in the set.
    #[inline]
    pub(crate) fn of(&self, keys: Range<usize>) -> Signs<'_> {
        Signs {
            bits: &self.bits,
            first: keys.start,
            count: keys.len(),
        }
    }
}

/// The signs of consecutive keys.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Signs<'a> {
    bits: &'a [u64],
    first: usize,
    count: usize,
}

impl Signs<'_> {
    /// All keys keep their signs.
    pub(crate) const AS_AUTHORED: Self = Self {
        bits: &[],
        first: 0,
        count: usize::MAX,
    };

    /// The signs of some of these keys.
    #[inline]
    pub(crate) fn between(self, keys: Range<usize>) -> Self {
        Self {
            first: self.first.saturating_add(keys.start),
            count: keys.len(),
            ..self
        }
    }

    /// Whether the sign of the `i`th key is changed.
    #[inline]
    pub(crate) fn is_negated(self, i: usize) -> bool {
        let key = self.first + i;
        (self.bits.get(key / BITS)).is_some_and(|word| word >> (key % BITS) & 1 == 1)
    }

    /// -1 if the sign of the `i`th key is changed, otherwise 1.
    #[inline]
    pub(crate) fn sign(self, i: usize) -> f32 {
        if self.is_negated(i) { -1.0 } else { 1.0 }
    }

    /// Whether the sign of any key is changed.
    #[inline]
    pub(crate) fn any(self) -> bool {
        !self.bits.is_empty() && self.words().any(|(word, mask)| word & mask != 0)
    }

    /// The stored words that contain bits of these keys, each with a mask of these bits.
    #[inline]
    fn words(self) -> impl Iterator<Item = (u64, u64)> {
        let end = (self.first.saturating_add(self.count)).min(self.bits.len() * BITS);
        let start = self.first.min(end);
        let words = start / BITS..end.div_ceil(BITS);
        words.map(move |index| {
            let from = start.saturating_sub(index * BITS);
            let to = (end - index * BITS).min(BITS);
            let mask = (u64::MAX << from) & (u64::MAX >> (BITS - to));
            (self.bits[index], mask)
        })
    }

    /// Copies some of the keys, each multiplied by its sign.
    #[inline]
    pub(crate) fn copy(self, keys: &[[f32; 4]], range: Range<usize>, to: &mut [[f32; 4]]) {
        let (signs, keys) = (self.between(range.clone()), &keys[range]);
        if !signs.any() {
            to.copy_from_slice(keys);
            return;
        }
        for (i, (to, key)) in to.iter_mut().zip(keys).enumerate() {
            let sign = signs.sign(i);
            *to = key.map(|component| component * sign);
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;

    fn continued(keys: &[[f32; 4]]) -> Vec<f32> {
        let mut bits = SignBits::default();
        bits.push_track(100, keys);
        let signs = bits.of(100..100 + keys.len());
        let each: Vec<f32> = (0..keys.len()).map(|i| signs.sign(i)).collect();
        let is_negated = |sign: &f32| *sign < 0.0;
        assert_eq!(signs.any(), each.iter().any(is_negated));
        for from in 0..keys.len() {
            for to in from..=keys.len() {
                let part = signs.between(from..to);
                assert_eq!(
                    part.any(),
                    each[from..to].iter().any(is_negated),
                    "{from}..{to}"
                );
            }
        }
        each
    }

    #[test]
    fn a_key_turns_where_the_other_sign_is_nearer() {
        let rotation = |degrees: f32, sign: f32| {
            (Quat::from_rotation_x(degrees.to_radians()) * sign).to_array()
        };
        let keys = [
            rotation(0.0, 1.0),
            rotation(90.0, -1.0),
            rotation(150.0, -1.0),
            rotation(200.0, 1.0),
            rotation(250.0, -1.0),
        ];
        assert_eq!(continued(&keys), [1.0, -1.0, -1.0, 1.0, -1.0]);
        // At exactly half a turn, the stored sign is used.
        let half = [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
        assert_eq!(continued(&half), [1.0, 1.0]);
        assert_eq!(continued(&[half[0], half[1].map(|c| -c)]), [1.0, 1.0]);
        assert_eq!(continued(&keys[..1]), [1.0]);
    }

    #[test]
    fn bits_are_those_of_their_keys_across_words() {
        let key = Quat::IDENTITY.to_array();
        let keys: Vec<[f32; 4]> = (0..200)
            .map(|i| key.map(|c| if i % 7 < 3 || i > 150 { -c } else { c }))
            .collect();
        let each = continued(&keys);
        let first = keys[0][3];
        for (i, sign) in each.iter().enumerate() {
            assert_eq!(keys[i][3] * sign, first, "{i}");
        }
        let mut copied = vec![[9.0; 4]; 200];
        let mut bits = SignBits::default();
        bits.push_track(0, &keys);
        bits.of(0..200).copy(&keys, 0..200, &mut copied);
        assert!(copied.iter().all(|key| key[3] == first));
        assert!(!Signs::AS_AUTHORED.between(3..90).any());
    }
}
