//! Compares any buffer with an expected one, word by word: matrices, half floats, results frame by frame, poses of
//! crowds, lists of indices.

use std::collections::BTreeMap;
use std::fmt;

use bytemuck::NoUninit;

use crate::names::names;
use crate::output::component_type::ComponentType;
use crate::verify::comparison::Agreement;

/// A test fills a buffer with this word before its kernel runs, and so finds the words that the kernel did not write.
/// The word is a NaN, and each of its halves is a NaN of 16 bits. The engine never writes it.
pub const UNWRITTEN: u32 = 0x7fb5_7fb5;

/// The type of the words of a compared buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum WordType {
    /// IEEE 754 single precision.
    F32,
    /// IEEE 754 half precision.
    F16,
    /// An integer of 32 bits: an index, a counter, packed data.
    U32,
}

names! {
    WordType, "word type",
    F32 => "f32",
    F16 => "f16",
    U32 => "u32",
}

impl WordType {
    /// Bytes of one word.
    #[must_use]
    pub fn bytes(self) -> usize {
        match self {
            Self::F32 | Self::U32 => 4,
            Self::F16 => 2,
        }
    }

    /// The bits of one word in memory.
    fn bits(self, word: &[u8]) -> u32 {
        match self {
            Self::F32 | Self::U32 => bytemuck::pod_read_unaligned(word),
            Self::F16 => bytemuck::pod_read_unaligned::<u16>(word).into(),
        }
    }

    /// The number with these bits.
    fn number(self, bits: u32) -> f64 {
        match self {
            Self::F32 => f32::from_bits(bits).into(),
            Self::F16 if bits & 0x7c00 == 0x7c00 => match (bits & 0x03ff, bits & 0x8000) {
                (0, 0) => f64::INFINITY,
                (0, _) => f64::NEG_INFINITY,
                _ => f64::NAN,
            },
            Self::F16 => ComponentType::F16
                .decode(&(bits as u16).to_ne_bytes())
                .into(),
            Self::U32 => bits.into(),
        }
    }

    /// For floats: the sign's bit, and the bits of the smallest normal number.
    fn layout(self) -> Option<(u32, u32)> {
        match self {
            Self::F32 => Some((1 << 31, 1 << 23)),
            Self::F16 => Some((1 << 15, 1 << 10)),
            Self::U32 => None,
        }
    }

    /// The word's position among all numbers of the type, in order. Both zeros have the position 0.
    fn position(self, bits: u32) -> i64 {
        match self.layout() {
            Some((sign, _)) if bits & sign != 0 => -i64::from(bits & (sign - 1)),
            _ => bits.into(),
        }
    }

    /// The kind of a difference between two words whose bits differ.
    fn kind(self, theirs: u32, expected: u32) -> DifferenceKind {
        let fill = UNWRITTEN >> (32 - 8 * self.bytes());
        if theirs == fill {
            return DifferenceKind::Unwritten;
        }
        let Some((sign, normal)) = self.layout() else {
            return DifferenceKind::Distant;
        };
        let numbers = [theirs, expected].map(|bits| self.number(bits));
        let magnitudes = [theirs, expected].map(|bits| bits & (sign - 1));
        let any = |is: fn(&f64) -> bool| numbers.iter().any(is);
        let is_subnormal = |bits: u32| bits != 0 && bits < normal;
        match magnitudes {
            _ if any(|number| number.is_nan()) => DifferenceKind::NotNumber,
            _ if any(|number| number.is_infinite()) => DifferenceKind::Infinite,
            [0, 0] => DifferenceKind::ZeroSign,
            [0, other] | [other, 0] if is_subnormal(other) => DifferenceKind::Flushed,
            [a, b] if a == b => DifferenceKind::Sign,
            [a, b] if is_subnormal(a) || is_subnormal(b) => DifferenceKind::Subnormal,
            _ => match self.steps(theirs, expected) {
                1 => DifferenceKind::Neighbour,
                2..=16 => DifferenceKind::Near,
                _ => DifferenceKind::Distant,
            },
        }
    }

    /// How many steps, from number to next number, lead from one word to the other.
    fn steps(self, theirs: u32, expected: u32) -> u64 {
        self.position(theirs).abs_diff(self.position(expected))
    }
}

/// How a word differs from the expected one. If several kinds apply, the first of them is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum DifferenceKind {
    /// The word is [`UNWRITTEN`]: no invocation wrote it.
    Unwritten,
    /// One of the two is NaN, or both are NaN with different bits.
    NotNumber,
    /// One of the two is infinite.
    Infinite,
    /// One is +0, the other is -0.
    ZeroSign,
    /// One is 0, the other is subnormal: the device flushes small numbers.
    Flushed,
    /// The magnitudes are equal, the signs differ.
    Sign,
    /// One of the two is subnormal.
    Subnormal,
    /// One is the next number after the other: a difference in rounding.
    Neighbour,
    /// The two are 2 to 16 steps apart.
    Near,
    /// The two are farther apart, or are different integers.
    Distant,
}

names! {
    DifferenceKind, "kind of difference",
    Unwritten => "unwritten",
    NotNumber => "nan",
    Infinite => "infinite",
    ZeroSign => "zero-sign",
    Flushed => "flushed",
    Sign => "sign",
    Subnormal => "subnormal",
    Neighbour => "neighbour",
    Near => "near",
    Distant => "distant",
}

/// A word that differs from the expected one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct WordDifference {
    /// The index of the word in the buffer.
    pub index: usize,
    /// The type of the words.
    pub words: WordType,
    /// The bits in the compared buffer.
    pub theirs: u32,
    /// The bits in the expected buffer.
    pub expected: u32,
    /// How the bits differ.
    pub kind: DifferenceKind,
}

impl WordDifference {
    /// The number in the compared buffer, and the expected number.
    #[must_use]
    pub fn numbers(&self) -> [f64; 2] {
        [self.theirs, self.expected].map(|bits| self.words.number(bits))
    }

    /// The distance between the two numbers. It is infinite if it cannot be computed (NaN), or if the word was not
    /// written.
    #[must_use]
    pub fn distance(&self) -> f64 {
        let [theirs, expected] = self.numbers();
        let distance = (theirs - expected).abs();
        match self.kind {
            DifferenceKind::Unwritten => f64::INFINITY,
            _ if distance.is_nan() => f64::INFINITY,
            _ => distance,
        }
    }

    /// How many steps, from number to next number of the type, lead from one to the other. It is `u64::MAX` if the
    /// [distance](Self::distance) is infinite.
    #[must_use]
    pub fn steps(&self) -> u64 {
        match self.distance().is_finite() {
            true => self.words.steps(self.theirs, self.expected),
            false => u64::MAX,
        }
    }
}

impl fmt::Display for WordDifference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let digits = 2 + 2 * self.words.bytes();
        let [theirs, expected] = self.numbers();
        write!(
            f,
            "word {}: {:#0digits$x} ({theirs:e}) in place of {:#0digits$x} ({expected:e}), {}",
            self.index, self.theirs, self.expected, self.kind
        )
    }
}

/// The largest difference that [`BufferComparison::agreement_within`] accepts.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum WordBound {
    /// The largest distance between two numbers.
    Distance(f64),
    /// The largest number of [steps](WordDifference::steps) between two numbers: 1 for neighbours.
    Steps(u64),
}

/// The result of [`compare_buffers`].
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct BufferComparison {
    /// The type of the words.
    pub word_type: WordType,
    /// The number of compared words.
    pub words: u64,
    /// The number of words whose bits differ.
    pub differing: u64,
    /// The number of differing words of each kind.
    pub census: BTreeMap<DifferenceKind, u64>,
    /// The first word that differs.
    pub first_difference: Option<WordDifference>,
    /// The word with the largest distance from the expected number. If several have it, the first of them.
    pub worst: Option<WordDifference>,
    /// The largest [distance](WordDifference::distance).
    pub max_distance: f64,
    /// The largest number of [steps](WordDifference::steps).
    pub max_steps: u64,
    /// Whether every word is [`UNWRITTEN`]: the kernel did not run, or wrote to another buffer.
    pub is_unwritten: bool,
}

impl BufferComparison {
    /// The agreement without a bound: [`Agreement::Nothing`] if there are no words or none was written,
    /// [`Agreement::SameBits`] if no word differs, otherwise [`Agreement::OutsideBounds`].
    #[must_use]
    pub fn agreement(&self) -> Agreement {
        match self.differing {
            _ if self.words == 0 || self.is_unwritten => Agreement::Nothing,
            0 => Agreement::SameBits,
            _ => Agreement::OutsideBounds,
        }
    }

    /// The agreement with a bound of your choice. As [`BufferComparison::agreement`], but the result is
    /// [`Agreement::WithinBounds`] if no difference is larger than the bound. Differences to NaN, to infinities and to
    /// words that were not written are outside every bound.
    #[must_use]
    pub fn agreement_within(&self, bound: WordBound) -> Agreement {
        let is_within = self.max_distance.is_finite()
            && match bound {
                WordBound::Distance(bound) => self.max_distance <= bound,
                WordBound::Steps(bound) => self.max_steps <= bound,
            };
        match self.agreement() {
            Agreement::OutsideBounds if is_within => Agreement::WithinBounds,
            agreement => agreement,
        }
    }
}

/// The comparison in one line.
impl fmt::Display for BufferComparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (words, kind) = (self.words, self.word_type);
        if self.words == 0 {
            return write!(f, "{kind}: there was no word, nothing was compared");
        }
        if self.is_unwritten {
            return write!(
                f,
                "{kind}: none of the {words} words was written: the kernel did not run, or it wrote to another buffer"
            );
        }
        write!(
            f,
            "{kind}: {words} words, {} with other bits",
            self.differing
        )?;
        let (Some(first), Some(worst)) = (&self.first_difference, &self.worst) else {
            return Ok(());
        };
        let mut separator = " (";
        for (kind, count) in &self.census {
            write!(f, "{separator}{count} {kind}")?;
            separator = ", ";
        }
        write!(f, "); the first is {first}")?;
        match worst.index == first.index {
            true => Ok(()),
            false => write!(f, "; the farthest is {worst}"),
        }
    }
}

/// The two buffers have different lengths, or do not contain whole words.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "the buffers have {theirs} and {expected} bytes; give both the same length, a multiple of {word} bytes"
)]
#[non_exhaustive]
pub struct BufferLengthError {
    /// The number of bytes in the compared buffer.
    pub theirs: usize,
    /// The number of bytes in the expected buffer.
    pub expected: usize,
    /// The number of bytes in a word.
    pub word: usize,
}

/// Compares a buffer, for example the output of your kernel, with an expected buffer, word by word. The expected buffer
/// may come from the engine ([`Request::evaluate_bytes`](crate::Request::evaluate_bytes) in any layout and encoding,
/// [`Crowd::evaluate_into`](crate::crowd::Crowd::evaluate_into)), or from any other source. Numbers are in the byte
/// order of the machine.
///
/// Fill the buffer with [`UNWRITTEN`] before the kernel runs. Then a kernel that did not run does not pass, and words
/// that it did not write are counted.
///
/// ```
/// use tumble::verify::{Agreement, DifferenceKind, WordBound, WordType, compare_buffers};
/// let expected = [1.0f32, 0.0, 0.25, -3.0];
/// // In place of this: read the buffer of your shader.
/// let theirs = [1.0f32, -0.0, 0.25, f32::from_bits(0xc040_0001)];
/// let found = compare_buffers(WordType::F32, &theirs, &expected)?;
/// assert_eq!(found.agreement(), Agreement::OutsideBounds);
/// assert_eq!(found.agreement_within(WordBound::Steps(1)), Agreement::WithinBounds, "{found}");
/// assert_eq!(found.census[&DifferenceKind::ZeroSign], 1);
/// assert_eq!(found.first_difference.map(|word| (word.index, word.theirs)), Some((1, 0x8000_0000)));
/// # Ok::<(), tumble::verify::BufferLengthError>(())
/// ```
///
/// # Errors
/// When the buffers have different lengths, or do not contain whole words.
pub fn compare_buffers<T: NoUninit, U: NoUninit>(
    words: WordType,
    theirs: &[T],
    expected: &[U],
) -> Result<BufferComparison, BufferLengthError> {
    let size = words.bytes();
    let theirs: &[u8] = bytemuck::cast_slice(theirs);
    let expected: &[u8] = bytemuck::cast_slice(expected);
    if theirs.len() != expected.len() || !theirs.len().is_multiple_of(size) {
        return Err(BufferLengthError {
            theirs: theirs.len(),
            expected: expected.len(),
            word: size,
        });
    }
    let fill = UNWRITTEN.to_ne_bytes();
    let mut found = BufferComparison {
        word_type: words,
        words: (theirs.len() / size) as u64,
        differing: 0,
        census: BTreeMap::new(),
        first_difference: None,
        worst: None,
        max_distance: 0.0,
        max_steps: 0,
        is_unwritten: theirs.chunks(size).all(|word| word == &fill[..size]),
    };
    let pairs = theirs.chunks(size).zip(expected.chunks(size));
    for (index, (word, expected)) in pairs.enumerate() {
        if word == expected {
            continue;
        }
        let (theirs, expected) = (words.bits(word), words.bits(expected));
        let difference = WordDifference {
            index,
            words,
            theirs,
            expected,
            kind: words.kind(theirs, expected),
        };
        found.differing += 1;
        *found.census.entry(difference.kind).or_default() += 1;
        found.first_difference.get_or_insert(difference);
        let distance = difference.distance();
        if found.worst.is_none() || distance > found.max_distance {
            (found.worst, found.max_distance) = (Some(difference), distance);
        }
        found.max_steps = found.max_steps.max(difference.steps());
    }
    Ok(found)
}
