//! The numbers and texts of an array.

use std::borrow::Cow;
use std::ops::Range;

use half::f16;
use rayon::prelude::*;

use crate::array::{ArrayHeader, Element};

/// An array whose bytes are complete.
pub(crate) struct Array<'a> {
    pub(crate) header: &'a ArrayHeader,
    /// The bytes, with the header.
    pub(crate) bytes: Cow<'a, [u8]>,
}

/// The locations of the numbers of each track and frame, counted in numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Strides {
    /// The first component of the first frame of the first track.
    pub(crate) first: usize,
    pub(crate) track: usize,
    pub(crate) frame: usize,
    pub(crate) component: usize,
}

/// Makes a key of its numbers. This is a trait and not a closure, because only methods can be marked for inlining. It
/// is called for every key, and a call that is not inlined passes the numbers through memory, which takes longer than
/// the computation.
pub(crate) trait Make<const N: usize> {
    type Key;

    fn make(numbers: [f64; N]) -> Self::Key;
}

/// Returns the numbers themselves.
pub(crate) struct AsStored;

impl<const N: usize> Make<N> for AsStored {
    type Key = [f64; N];

    #[inline(always)]
    fn make(numbers: [f64; N]) -> [f64; N] {
        numbers
    }
}

/// Number of tracks that are read together, so that of rows of many tracks each cache line is used completely.
pub(crate) const TOGETHER: usize = 8;

/// Fewer keys than this are read faster by one thread.
pub(crate) const MIN_PARALLEL_KEYS: usize = 1 << 14;

/// Number of frames whose rows, some cache lines each, stay in the second cache from the first of these tracks to the
/// last.
const IN_CACHE: usize = 512;

impl Array<'_> {
    fn values(&self) -> &[u8] {
        &self.bytes[self.header.start..]
    }

    /// For each track, the result of `finish` for the list of keys that `M` makes of the numbers of every frame, on
    /// all threads if there are many. The numbers must lie within the array, and must be floats.
    pub(crate) fn tracks<M: Make<N>, const N: usize, U: Send>(
        &self,
        at: Strides,
        tracks: Range<usize>,
        frames: usize,
        finish: impl Fn(Vec<M::Key>) -> U + Sync,
    ) -> Vec<U> {
        // The type of the numbers is matched for each block, so that the threads' code is compiled once, not
        // for each type of number.
        let block = |&start: &usize| {
            let asked = (at, start..(start + TOGETHER).min(tracks.end), frames);
            let lists = match (&self.header.element, self.header.is_big_endian) {
                (Element::F16, false) => {
                    self.gather::<M, 2, N>(asked, |b| f16::from_le_bytes(b).to_f64())
                }
                (Element::F16, true) => {
                    self.gather::<M, 2, N>(asked, |b| f16::from_be_bytes(b).to_f64())
                }
                (Element::F32, false) => {
                    self.gather::<M, 4, N>(asked, |b| f32::from_le_bytes(b).into())
                }
                (Element::F32, true) => {
                    self.gather::<M, 4, N>(asked, |b| f32::from_be_bytes(b).into())
                }
                (Element::F64, false) => self.gather::<M, 8, N>(asked, f64::from_le_bytes),
                (Element::F64, true) => self.gather::<M, 8, N>(asked, f64::from_be_bytes),
                _ => Vec::new(),
            };
            lists.into_iter().map(&finish).collect::<Vec<U>>()
        };
        let starts: Vec<usize> = tracks.clone().step_by(TOGETHER).collect();
        let at_least = MIN_PARALLEL_KEYS.div_ceil(TOGETHER * frames.max(1));
        if starts.len() <= at_least {
            return starts.iter().flat_map(block).collect();
        }
        let together = tumble::on_threads(|| {
            let blocks = starts.par_iter().with_min_len(at_least);
            blocks.flat_map_iter(block).collect()
        });
        // If the system refuses to start threads, this thread does all the work.
        together.unwrap_or_else(|_| starts.iter().flat_map(block).collect())
    }

    /// The keys of some tracks, one list for each.
    fn gather<M: Make<N>, const SIZE: usize, const N: usize>(
        &self,
        (at, tracks, frames): (Strides, Range<usize>, usize),
        number: impl Fn([u8; SIZE]) -> f64,
    ) -> Vec<Vec<M::Key>> {
        let (numbers, _) = self.values().as_chunks::<SIZE>();
        let new = |_| Vec::with_capacity(frames);
        let mut lists: Vec<Vec<M::Key>> = tracks.clone().map(new).collect();
        for from in (0..frames).step_by(IN_CACHE) {
            for (track, list) in tracks.clone().zip(&mut lists) {
                let key = |frame: usize| {
                    let first = at.first + track * at.track + frame * at.frame;
                    let mut components = [0.0; N];
                    for (i, component) in components.iter_mut().enumerate() {
                        *component = number(numbers[first + i * at.component]);
                    }
                    M::make(components)
                };
                list.extend((from..(from + IN_CACHE).min(frames)).map(key));
            }
        }
        lists
    }

    /// Every number in C order; `None` if the elements are not numbers.
    pub(crate) fn numbers(&self) -> Option<Vec<f64>> {
        let values = self.values();
        let big = self.header.is_big_endian;
        let size = self.header.element.size().filter(|&size| size > 0)?;
        let word = |bytes: &[u8]| {
            let mut word = [0; 8];
            word[..size].copy_from_slice(bytes);
            if big {
                word[..size].reverse();
            }
            u64::from_le_bytes(word)
        };
        let unused = 64 - 8 * size.min(8) as u32;
        let number = |word: u64| match self.header.element {
            Element::F16 => f16::from_bits(word as u16).to_f64(),
            Element::F32 => f32::from_bits(word as u32).into(),
            Element::F64 => f64::from_bits(word),
            Element::Signed(_) => ((word << unused) as i64 >> unused) as f64,
            _ => word as f64,
        };
        if matches!(self.header.element, Element::Unicode(_) | Element::Bytes(_)) {
            return None;
        }
        let stored: Vec<f64> = values
            .chunks_exact(size)
            .map(|bytes| number(word(bytes)))
            .collect();
        Some(self.header.in_c_order(stored))
    }

    /// Every text in C order, without the zeros that pad it.
    ///
    /// # Errors
    /// Why an element is not a text, as text.
    pub(crate) fn texts(&self) -> Result<Vec<String>, String> {
        let big = self.header.is_big_endian;
        let size = self.header.element.size().unwrap_or(0);
        let text = |bytes: &[u8]| match self.header.element {
            Element::Unicode(_) => {
                let (words, _) = bytes.as_chunks::<4>();
                let character = |&word: &[u8; 4]| {
                    let code = match big {
                        true => u32::from_be_bytes(word),
                        false => u32::from_le_bytes(word),
                    };
                    char::from_u32(code).ok_or_else(|| format!("U+{code:X} is not a character"))
                };
                words.iter().map(character).collect::<Result<String, _>>()
            }
            Element::Bytes(_) => {
                String::from_utf8(bytes.to_vec()).map_err(|_| "a text is not UTF-8".to_owned())
            }
            _ => Err(format!("it is an array {}, no text", self.header)),
        };
        let whole = |text: String| text.trim_end_matches('\0').to_owned();
        if size == 0 {
            // Empty texts take no bytes, so their number cannot be checked against the file's length.
            let empty = text(&[])?;
            return Ok(vec![empty; usize::from(self.header.shape.is_empty())]);
        }
        let all = self
            .values()
            .chunks_exact(size)
            .map(|bytes| text(bytes).map(whole));
        Ok(self.header.in_c_order(all.collect::<Result<_, _>>()?))
    }
}
