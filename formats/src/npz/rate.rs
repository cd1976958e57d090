//! Frame rates as files have them: numbers that were rounded, perhaps more than once.

use tumble::FrameRate;

use crate::diagnostic::{Code, Diagnostic};
use crate::format::ReadOptions;
use crate::grid::{self, Precision};
use crate::npz::archive::Archive;
use crate::npz::header::Element;
use crate::npz::plan::{Plan, read_numbers};

/// A number this near to a usual rate, as a part of it, is that rate: AMASS has 120.00004577, and
/// 29.97 is short for 30000/1001.
const NEAR: f64 = 2e-6;

/// The rate that a number stands for: a whole number, 24, 30, 60 or 120 by 1.001, or the number
/// itself to nine decimals. `None` for what is no rate.
pub(crate) fn rate_of(number: f64) -> Option<FrameRate> {
    let is_near = |rate: f64| (number - rate).abs() <= NEAR * rate;
    let whole = number.round();
    if whole >= 1.0 && whole <= f64::from(u32::MAX) && is_near(whole) {
        return FrameRate::new(whole as u64, 1).ok();
    }
    for frames in [24_000, 30_000, 60_000, 120_000] {
        let rate = FrameRate::new(frames, 1_001).ok()?;
        if is_near(rate.per_second()) {
            return Some(rate);
        }
    }
    format!("{number:.9}").parse().ok()
}

impl Plan {
    /// The rate in the first of these arrays that there is.
    ///
    /// # Errors
    /// When it is no one number, or no rate.
    pub(crate) fn read_rate(
        &mut self,
        archive: &Archive,
        names: &[&str],
    ) -> Result<(), Diagnostic> {
        let Some(member) = names.iter().find_map(|name| archive.find(name)) else {
            return Ok(());
        };
        let numbers = read_numbers(archive, member)?;
        let rate = match *numbers {
            [number] => rate_of(number).ok_or_else(|| number.to_string()),
            _ => Err(format!("{} numbers", numbers.len())),
        };
        self.rate = Some(rate.map_err(|found| {
            let message = format!("{found} is no frame rate; it is one number over 0");
            archive.refuse(member, Code::FrameRate, message)
        })?);
        self.rate_member = Some(member);
        Ok(())
    }

    /// The times of all frames, in seconds; the plan's rate becomes that on whose frames they lie.
    ///
    /// # Errors
    /// When neither times nor a rate are known, or there are not as many times as frames.
    pub(crate) fn read_times(
        &mut self,
        archive: &Archive,
        options: &ReadOptions,
    ) -> Result<Vec<f64>, Diagnostic> {
        let Some(list) = self.times else {
            let rate = self.rate.or(options.source_rate).ok_or_else(|| {
                let message =
                    "the file says neither times nor a frame rate; --source-fps gives one";
                Diagnostic::new(&archive.file, Code::NoRate, message)
            })?;
            self.rate = Some(rate);
            return Ok((0..self.frames as u64)
                .map(|frame| rate.time_of(frame))
                .collect());
        };
        let array = archive.array(list.member)?;
        let columns = match array.header.shape[..] {
            [_, columns] => columns,
            _ => 1,
        };
        let numbers = read_numbers(archive, list.member)?;
        let own = numbers
            .into_iter()
            .skip(list.column)
            .step_by(columns.max(1));
        let mut times: Vec<f64> = own.collect();
        if times.len() != self.frames {
            let message = format!("{} times for {} frames", times.len(), self.frames);
            return Err(archive.refuse(list.member, Code::Shape, message));
        }
        if !array.header.element.is_float() && options.time_unit.is_none() {
            let message = "the times are whole numbers; --time-unit says of what (s, ms, us, ns)";
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
        let said = self
            .rate
            .filter(|&rate| grid::fits(times.iter().copied(), rate, precision));
        // Times in f64, as we write them, were not rounded, and are read back as they are.
        let found = if is_f32 && !options.raw_times {
            grid::restore(std::slice::from_mut(&mut times), precision)
        } else {
            grid::rate_of(times.iter().copied(), precision)
        };
        self.rate = said.or(found);
        Ok(times)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounded_rates_are_those_that_were_meant() {
        for (number, rate) in [
            (120.000_045_77, "120"),
            (30.0, "30"),
            (29.97, "30000/1001"),
            (f64::from(59.94f32), "60000/1001"),
            (23.976, "24000/1001"),
            (12.5, "25/2"),
            (119.9, "1199/10"),
            (0.5, "1/2"),
        ] {
            assert_eq!(
                rate_of(number).map(|r| r.to_string()).as_deref(),
                Some(rate)
            );
        }
        for number in [0.0, -30.0, f64::NAN, f64::INFINITY, 1e300, 1e-12] {
            assert_eq!(rate_of(number), None, "{number}");
        }
    }
}
