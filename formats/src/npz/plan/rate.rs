//! Frame rates in files: numbers that were rounded, perhaps several times.

use tumble::FrameRate;
use tumble::names::counted;

use crate::array::Element;
use crate::diagnostic::{Code, Diagnostic};
use crate::format::ReadOptions;
use crate::motion::grid;
use crate::npz::archive::Archive;
use crate::npz::plan::{ArchivePlan, read_numbers};
use crate::rate::{Precision, RateSource, of, on_frames, overridden};
use crate::times::clock_text;

impl ArchivePlan {
    /// Reads the rate in the first of these arrays that exists. Of one that is not a rate, the error is kept.
    ///
    /// # Errors
    /// When they are not numbers.
    pub(crate) fn read_rate(
        &mut self,
        archive: &Archive,
        names: &[&str],
    ) -> Result<(), Diagnostic> {
        let mut before = "";
        for (name, member) in names
            .iter()
            .filter_map(|&name| Some((name, archive.find(name)?)))
        {
            let numbers = read_numbers(archive, member)?;
            self.compared.push(member);
            let rate = match *numbers {
                [number] => {
                    let found = of(&RateSource::Number(number)).map(|found| found.grid);
                    found.ok_or_else(|| number.to_string())
                }
                _ => Err(format!("an array of {} numbers", numbers.len())),
            };
            let rate = match rate {
                Ok(rate) => rate,
                Err(found) => {
                    let message =
                        format!("{found} is not a frame rate; expected one number greater than 0");
                    let refusal = archive.refuse(member, Code::FrameRate, message);
                    self.bad_rate.get_or_insert(refusal);
                    self.rate_member.get_or_insert(member);
                    continue;
                }
            };
            match self.rate {
                None => (self.rate, self.rate_member, before) = (Some(rate), Some(member), name),
                Some(first) if first != rate => {
                    self.two_rates = Some(format!(
                        "`{before}` says {}, `{name}` {rate}; the first is used, --override-fps replaces it",
                        first.in_words()
                    ));
                }
                Some(_) => {}
            }
        }
        Ok(())
    }

    /// Warns if the duration of a file contradicts its rate: a rate that is twice or half of that of the recording.
    /// A duration may or may not include the last frame, and a part may have been cut off.
    pub(crate) fn compare_length(&mut self, archive: &Archive, name: &str) {
        const LEAST_FACTOR: f64 = 1.5;
        let Some(rate) = self.rate else {
            return;
        };
        // An array that is not a length is ignored.
        let member = archive.find(name);
        self.compared.extend(member);
        let numbers = member.and_then(|member| read_numbers(archive, member).ok());
        let Some(&[seconds]) = numbers.as_deref() else {
            return;
        };
        let by_length = self.frames as f64 / seconds;
        let factor = by_length / rate.per_second();
        let is_alike = factor < LEAST_FACTOR && factor > 1.0 / LEAST_FACTOR;
        if self.frames < 8 || !by_length.is_finite() || by_length <= 0.0 || is_alike {
            return;
        }
        self.two_rates.get_or_insert_with(|| {
            format!(
                "the file states {}, but by `{name}` {} last {} s, which is {by_length:.3} a second; the first is \
                 used, --override-fps replaces it",
                rate.in_words(),
                counted(self.frames, "frame"),
                clock_text(0, seconds)
            )
        });
    }

    /// The number of each frame of the rate: from 0, unless the file has them.
    fn numbers_of_frames(&self, archive: &Archive) -> Result<Vec<u64>, Diagnostic> {
        let Some(member) = self.frame_numbers else {
            return Ok((0..self.frames as u64).collect());
        };
        let numbers = read_numbers(archive, member)?;
        if numbers.len() != self.frames {
            let [found, frames] = [(numbers.len(), "number"), (self.frames, "frame")]
                .map(|(count, noun)| counted(count, noun));
            let message = format!("{found} for {frames}");
            return Err(archive.refuse(member, Code::Shape, message));
        }
        // Up to this limit, f64 represents every whole number exactly.
        let is_number = |&number: &f64| (0.0..9e15).contains(&number) && number.fract() == 0.0;
        match numbers.iter().find(|number| !is_number(number)) {
            None => Ok(numbers.into_iter().map(|number| number as u64).collect()),
            Some(number) => {
                let message = format!("{number} is not the number of a frame, from 0");
                Err(archive.refuse(member, Code::Time, message))
            }
        }
    }

    /// The times of all frames in seconds. The rate of the plan becomes that of these times.
    ///
    /// # Errors
    /// When neither times nor a rate are known, when a rate is none and is not replaced, or when the number of times is
    /// not that of the frames.
    pub(crate) fn read_times(
        &mut self,
        archive: &Archive,
        options: &ReadOptions,
    ) -> Result<Vec<f64>, Diagnostic> {
        let replaced = options.override_rate.filter(|_| self.times.is_none());
        let bad_rate = self.bad_rate.take();
        if let (Some(mut error), None) = (bad_rate.clone(), replaced) {
            if self.times.is_none() {
                error.message += "; --override-fps replaces it";
            }
            return Err(error);
        }
        let Some(list) = self.times else {
            let rates = [options.override_rate, self.rate, options.source_rate];
            let rate = rates.into_iter().flatten().next().ok_or_else(|| {
                let message =
                    "the file has neither times nor a frame rate; give the rate with --source-fps";
                Diagnostic::new(&archive.file, Code::NoRate, message)
            })?;
            let is_other = |other: &FrameRate| self.rate.is_some_and(|stated| stated != *other);
            if let Some(other) = options.override_rate {
                let stated = self.rate.filter(|_| is_other(&other));
                self.two_rates = match (stated, bad_rate) {
                    (None, Some(bad)) => Some(format!(
                        "{}; because of --override-fps it is read at {}",
                        bad.message,
                        other.in_words()
                    )),
                    (stated, _) => stated.map(|stated| overridden(stated, other)),
                };
            } else if let Some(other) = options.source_rate.filter(is_other) {
                self.two_rates = Some(format!(
                    "the file states {}, which is used; --source-fps {other} is for files that state none, \
                     --override-fps replaces a rate",
                    rate.in_words()
                ));
            }
            self.rate = Some(rate);
            let numbers = self.numbers_of_frames(archive)?;
            return Ok(numbers
                .into_iter()
                .map(|frame| rate.time_of(frame))
                .collect());
        };
        if let Some(rate) = options.override_rate.or(options.source_rate) {
            let option = match options.override_rate {
                Some(_) => "--override-fps",
                None => "--source-fps",
            };
            let message =
                format!("the file has the time of every frame; leave out {option} {rate}");
            return Err(archive.refuse(list.member, Code::RateBesideTimes, message));
        }
        let array = archive.array(list.member)?;
        let columns = match array.header.shape[..] {
            [_, columns] => columns,
            _ => 1,
        };
        let numbers = read_numbers(archive, list.member)?;
        let column = numbers
            .into_iter()
            .skip(list.column)
            .step_by(columns.max(1));
        let mut times: Vec<f64> = column.collect();
        if times.len() != self.frames {
            let [found, frames] = [(times.len(), "time"), (self.frames, "frame")]
                .map(|(count, noun)| counted(count, noun));
            let message = format!("{found} for {frames}");
            return Err(archive.refuse(list.member, Code::Shape, message));
        }
        if !array.header.element.is_float() && options.time_unit.is_none() {
            let message =
                "the times are whole numbers; give their unit with --time-unit (s, ms, us, ns)";
            return Err(archive.refuse(list.member, Code::NoRate, message.to_owned()));
        }
        if let Some(unit) = options.time_unit {
            times
                .iter_mut()
                .for_each(|time| *time /= unit.per_second() as f64);
        }
        let is_f32 = array.header.element == Element::F32;
        let precision = if is_f32 {
            Precision::F32
        } else {
            Precision::F64
        };
        let are_frames =
            |times: &[f64], rate| on_frames(times.iter().copied(), rate, 0.0, precision);
        let said = self.rate.filter(|&rate| are_frames(&times, rate));
        // A clip may end between two frames of its rate.
        let ends_between = self.rate.is_some_and(|rate| {
            let frames = times.split_last().map_or(&[][..], |(_, frames)| frames);
            frames.len() > 1 && are_frames(frames, rate)
        });
        // Times in f64 were not rounded, so they are used as they are.
        let found = if is_f32 && !options.raw_times {
            grid::restore(std::slice::from_mut(&mut times), precision)
        } else {
            let lists = std::slice::from_ref(&times);
            let before_end = grid::frames_before_end(lists, precision);
            let found = before_end.or_else(|| of(&RateSource::Times(lists, precision)));
            found.and_then(crate::rate::FrameGrid::rate)
        };
        if let (Some(first), None, Some(found), false) = (self.rate, said, found, ends_between) {
            self.two_rates = Some(format!(
                "the file states {}, but its times have {found}; the times are used",
                first.in_words()
            ));
        }
        let between = self.rate.filter(|_| ends_between);
        self.rate = said.or(between).or(found);
        Ok(times)
    }
}
