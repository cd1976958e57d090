//! Fades: weights of layers that change with the clock.

use crate::crowd_error::CrowdError;
use crate::memory::{OutOfMemoryError, zeroed};
use crate::names::fields::with_fields;
use crate::shader::WEIGHT_UNIT;

/// A weight that changes linearly with the clock.
///
/// The weight is `from` until the fade starts, goes from `from` to `to` in equal steps for equal ticks while the fade
/// runs, and is `to` afterwards. It is computed in whole numbers from the clock alone: one large step of the clock
/// leads to the same weight as many small ones, and the clock may go back.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct CrowdFade {
    /// The weight before the fade, 0 to 1, rounded to a multiple of 2^-15.
    pub from: f32,
    /// The weight after the fade, 0 to 1, rounded to a multiple of 2^-15.
    pub to: f32,
    /// The clock's time in ticks at which the fade starts; in the past or in the future.
    pub start: u64,
    /// The duration of the fade in ticks; with 0 the weight changes at once.
    pub ticks: u64,
}

with_fields! {
    CrowdFade:
    with_start(start: u64),
    with_ticks(ticks: u64),
}

impl CrowdFade {
    /// A weight that changes at once, at the start of the clock.
    #[must_use]
    pub fn new(from: f32, to: f32) -> Self {
        Self {
            from,
            to,
            start: 0,
            ticks: 0,
        }
    }
}

/// A weight in units of 2^-15.
pub(crate) fn weight_units(weight: f32) -> Result<u32, CrowdError> {
    match (0.0..=1.0).contains(&weight) {
        true => Ok((weight / WEIGHT_UNIT).round() as u32),
        false => Err(CrowdError::Weight { weight }),
    }
}

/// The fade of an entry.
#[derive(Debug, Clone, Copy)]
struct EntryFade {
    entry: usize,
    /// In units of 2^-15.
    from: u32,
    to: u32,
    start: u64,
    ticks: u64,
}

impl EntryFade {
    /// Whether the weight stays as it is from a time of the clock on.
    fn has_ended(&self, clock: u64) -> bool {
        clock >= self.start && clock - self.start >= self.ticks
    }

    /// The weight at a time of the clock, the nearest unit of 2^-15.
    fn units(&self, clock: u64) -> u32 {
        if clock < self.start {
            return self.from;
        }
        if self.has_ended(clock) {
            return self.to;
        }
        let (from, to) = (i128::from(self.from), i128::from(self.to));
        let (passed, ticks) = (i128::from(clock - self.start), i128::from(self.ticks));
        let moved = (2 * (to - from) * passed + ticks).div_euclid(2 * ticks);
        (from + moved) as u32
    }
}

/// The fades of a crowd's entries, at most one for each. Fades that have ended are kept, because the clock may go
/// back.
#[derive(Debug, Default)]
pub(crate) struct Fades {
    /// The fades that have not ended, then the others.
    all: Vec<EntryFade>,
    running: usize,
    /// For each entry the index of its fade among all, counted from 1; 0 if it has none. Empty before the first fade.
    of_entry: Vec<u32>,
}

impl Fades {
    fn index(&self, entry: usize) -> Option<usize> {
        let index = *self.of_entry.get(entry)?;
        (index as usize).checked_sub(1)
    }

    pub(crate) fn get(&self, entry: usize) -> Option<CrowdFade> {
        let fade = &self.all[self.index(entry)?];
        Some(CrowdFade {
            from: fade.from as f32 * WEIGHT_UNIT,
            to: fade.to as f32 * WEIGHT_UNIT,
            start: fade.start,
            ticks: fade.ticks,
        })
    }

    fn swap(&mut self, a: usize, b: usize) {
        self.all.swap(a, b);
        for index in [a, b] {
            self.of_entry[self.all[index].entry] = index as u32 + 1;
        }
    }

    /// Forgets the fade of an entry, if it has one.
    pub(crate) fn remove(&mut self, entry: usize) {
        let Some(mut index) = self.index(entry) else {
            return;
        };
        if index < self.running {
            self.running -= 1;
            self.swap(index, self.running);
            index = self.running;
        }
        let last = self.all.len() - 1;
        self.swap(index, last);
        self.all.truncate(last);
        self.of_entry[entry] = 0;
    }

    /// Sets the fade of an entry and returns its weight at `clock`, in units of 2^-15. `entries` is the number of
    /// entries.
    pub(crate) fn insert(
        &mut self,
        (entry, entries): (usize, usize),
        fade: &CrowdFade,
        clock: u64,
    ) -> Result<u32, CrowdError> {
        let (from, to) = (weight_units(fade.from)?, weight_units(fade.to)?);
        let no_room = |_| OutOfMemoryError::new::<EntryFade>("a crowd's fades", 1);
        self.all.try_reserve(1).map_err(no_room)?;
        if self.of_entry.is_empty() {
            self.of_entry = zeroed(entries, "a crowd's fades")?;
        }
        self.remove(entry);
        let fade = EntryFade {
            entry,
            from,
            to,
            start: fade.start,
            ticks: fade.ticks,
        };
        self.all.push(fade);
        let last = self.all.len() - 1;
        self.of_entry[entry] = last as u32 + 1;
        if !fade.has_ended(clock) {
            self.swap(self.running, last);
            self.running += 1;
        }
        Ok(fade.units(clock))
    }

    /// Sets the clock, forwards or backwards, and reports each entry whose weight may have changed, with its weight
    /// in units of 2^-15.
    pub(crate) fn set_clock(
        &mut self,
        clock: u64,
        goes_back: bool,
        mut each: impl FnMut(usize, u32),
    ) {
        if goes_back {
            self.running = self.all.len();
        }
        for index in (0..self.running).rev() {
            let fade = self.all[index];
            each(fade.entry, fade.units(clock));
            if fade.has_ended(clock) {
                self.running -= 1;
                self.swap(index, self.running);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    /// Fades that are set, removed and passed in any order, beside a table that works all of them out anew.
    #[test]
    fn weights_are_functions_of_the_clock() {
        const ENTRIES: usize = 40;
        let mut random = fastrand::Rng::with_seed(5);
        let mut fades = Fades::default();
        let mut expected = BTreeMap::new();
        let mut weights = [u32::MAX; ENTRIES];
        let mut clock = 1_000u64;
        for _ in 0..20_000 {
            let entry = random.usize(..ENTRIES);
            match random.u32(..8) {
                0 => {
                    fades.remove(entry);
                    expected.remove(&entry);
                }
                1 | 2 => {
                    let fade = CrowdFade {
                        from: random.u32(..=1 << 15) as f32 * WEIGHT_UNIT,
                        to: [0.0, 1.0, random.f32()][random.usize(..3)],
                        start: clock.saturating_add_signed(random.i64(-50..50)),
                        ticks: random.u64(..300) * random.u64(..2),
                    };
                    weights[entry] = fades.insert((entry, ENTRIES), &fade, clock).unwrap();
                    let found = fades.get(entry).unwrap();
                    assert!((found.to - fade.to).abs() <= WEIGHT_UNIT / 2.0);
                    expected.insert(
                        entry,
                        CrowdFade {
                            to: found.to,
                            ..fade
                        },
                    );
                    assert_eq!(expected.get(&entry), Some(&found));
                }
                step => {
                    let back = step == 7;
                    let by = random.u64(..100);
                    clock = if back {
                        clock.saturating_sub(by)
                    } else {
                        clock + by
                    };
                    fades.set_clock(clock, back, |entry, weight| weights[entry] = weight);
                }
            }
            for (&entry, fade) in &expected {
                let passed = clock.saturating_sub(fade.start) as f64 / fade.ticks as f64;
                let passed = if clock < fade.start { 0.0 } else { passed };
                let part = if passed < 1.0 { passed } else { 1.0 };
                let weight = f64::from(fade.from) + f64::from(fade.to - fade.from) * part;
                let off = weight * 32768.0 - f64::from(weights[entry]);
                let is_end = part == 0.0 || part == 1.0;
                assert!(
                    off.abs() <= if is_end { 0.0 } else { 0.5 },
                    "{fade:?}, {clock}"
                );
            }
            assert_eq!(fades.all.len(), expected.len());
        }
        let (from, to, ticks) = (0.0, 1.0, u64::MAX);
        let long = CrowdFade {
            from,
            to,
            start: 0,
            ticks,
        };
        assert_eq!(
            fades.insert((3, ENTRIES), &long, ticks / 2).unwrap(),
            1 << 14
        );
    }
}
