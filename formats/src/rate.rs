//! Finds the rate of a file's keys from its times as they are written: [`of`]. Times are seldom whole frames: they
//! were rounded to f32 or to some decimals, are multiples of a rounded period, or were added up in f32. The largest
//! error of each rounding is known, and a sum can be computed again, bit for bit. Therefore all rates are tested. A list
//! of usual rates only decides if times with few digits agree with several.
//!
//! The table in `docs/testing.md` is the test of this module.

use tumble::FrameRate;

/// How a number was stored, which determines its largest rounding error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Precision {
    /// IEEE 754 single precision.
    F32,
    /// IEEE 754 double precision.
    F64,
    /// Text with this many decimals.
    Decimals(u32),
}

/// A power with an integer exponent, by squaring. It has the same bits everywhere, which `f64::powi` does not
/// promise; these bits determine the rate that is found.
pub(crate) fn whole_power(base: f64, exponent: i32) -> f64 {
    let (mut rest, mut square, mut power) = (exponent.unsigned_abs(), base, 1.0);
    while rest > 0 {
        if rest & 1 == 1 {
            power *= square;
        }
        square *= square;
        rest >>= 1;
    }
    if exponent < 0 { 1.0 / power } else { power }
}

impl Precision {
    /// The distance from the number to the next one of this type, away from 0.
    pub(crate) fn ulp(self, number: f64) -> f64 {
        match self {
            Self::F32 => {
                let near = (number as f32).abs();
                f64::from(near.next_up()) - f64::from(near)
            }
            Self::F64 => number.abs().next_up() - number.abs(),
            Self::Decimals(count) => whole_power(10.0, -(count.min(400) as i32)),
        }
    }

    /// The largest error of a time: it was rounded, and may be a multiple of a period that was rounded.
    pub(crate) fn rounding(self, time: f64) -> f64 {
        match self {
            Self::F32 => 0.5 * self.ulp(time) + time.abs() * f64::from(f32::EPSILON) * 0.500_1,
            Self::F64 => 0.5 * self.ulp(time) + time.abs() * f64::EPSILON,
            Self::Decimals(_) => 0.500_001 * self.ulp(time) + Self::F64.rounding(time),
        }
    }
}

/// The information about its rate in a file.
pub(crate) enum RateSource<'a> {
    /// The times of its keys in seconds: a list for each track or channel.
    Times(&'a [Vec<f64>], Precision),
    /// The digits of a frame's time in seconds.
    FrameTime(&'a str),
    /// The frames of a second.
    Number(f64),
}

/// The result: the frames on which keys lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FrameGrid {
    /// The rate of the frames of all keys.
    pub(crate) grid: FrameRate,
    /// The time of one of these frames in seconds.
    pub(crate) phase: f64,
    /// Whether some keys are on neighbouring frames, so that this is also the rate of the keys.
    pub(crate) is_rate: bool,
}

impl FrameGrid {
    fn at_zero(grid: FrameRate) -> Self {
        Self {
            grid,
            phase: 0.0,
            is_rate: true,
        }
    }

    /// The rate of the keys.
    pub(crate) fn rate(self) -> Option<FrameRate> {
        self.is_rate.then_some(self.grid)
    }
}

/// Finds the rate that was intended.
pub(crate) fn of(written: &RateSource<'_>) -> Option<FrameGrid> {
    match *written {
        RateSource::Times(lists, precision) => of_times(lists, precision),
        RateSource::FrameTime(digits) => of_period(digits).map(FrameGrid::at_zero),
        RateSource::Number(number) => of_number(number).map(FrameGrid::at_zero),
    }
}

/// The rate whose frame time, added up in f32 from the first time on, gives exactly these times. Some exporters compute
/// times in this way; after some seconds the sums are further from the frames than rounding explains.
pub(crate) fn of_sums(lists: &[Vec<f64>]) -> Option<FrameRate> {
    let mut times: Vec<f64> = lists.iter().flatten().copied().collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    let (&first, &last) = (times.first()?, times.last()?);
    let mean = (times.len() - 1) as f64 / (last - first);
    let (whole, ntsc) = (mean.round(), (mean * 1.001).round());
    let rates = [(whole, 1, 1), (ntsc, 1000, 1001)].map(|(number, frames, seconds)| {
        let is_searched = (1.0..=MAX_RATE).contains(&number);
        is_searched.then(|| FrameRate::new(number as u64 * frames, seconds).ok())?
    });
    let gives_times = |rate: &FrameRate| {
        let period = rate.time_of(1) as f32;
        let sums = std::iter::successors(Some(first as f32), |sum| Some(sum + period));
        let is_near = |(frame, &time): (usize, &f64)| {
            let exact = first + rate.time_of(frame as u64);
            (time - exact).abs() < 0.25 * rate.time_of(1)
        };
        let are_sums = times
            .iter()
            .zip(sums)
            .all(|(&time, sum)| time == f64::from(sum));
        are_sums && times.iter().enumerate().all(is_near)
    };
    rates.into_iter().flatten().find(gives_times)
}

/// Common rates, one of which is chosen if few digits leave several rates open.
const COMMON_RATES: [u64; 32] = [
    10, 12, 15, 16, 20, 24, 25, 30, 48, 50, 60, 72, 75, 90, 96, 100, 120, 125, 144, 150, 165, 180,
    200, 240, 250, 300, 360, 400, 480, 500, 600, 1000,
];

/// The largest integer rate, and the largest integer rate divided by 1.001, that are searched.
const MAX_RATE: f64 = 1000.0;

/// The largest numerator and denominator of a rate: those that f64 holds exactly.
const LARGEST: u128 = 1 << f64::MANTISSA_DIGITS;

/// One of the rates from `low` to `high` for which `fits` is true: the only integer, or the only common rate of
/// several integers; otherwise likewise for integers divided by 1.001 (NTSC).
fn choose(low: f64, high: f64, fits: impl Fn(FrameRate) -> bool) -> Option<FrameRate> {
    for (frames, seconds) in [(1, 1), (1000, 1001)] {
        let scale = seconds as f64 / frames as f64;
        let from = (low * scale * (1.0 - 1e-9)).ceil().max(1.0);
        let to = (high * scale * (1.0 + 1e-9)).floor().min(MAX_RATE);
        let rate = |number: u64| FrameRate::new(number * frames, seconds).ok();
        let fitting = || {
            let all = (from as u64..=to as u64).filter(|_| from <= to);
            all.filter(|&number| rate(number).is_some_and(&fits))
        };
        let mut first = fitting();
        match (first.next(), first.next()) {
            (Some(only), None) => return rate(only),
            (Some(_), Some(_)) => {
                let mut common = fitting().filter(|number| COMMON_RATES.contains(number));
                return match (common.next(), common.next()) {
                    (Some(only), None) => rate(only),
                    _ => None,
                };
            }
            (None, _) => {}
        }
    }
    None
}

/// The rate of times that increase by equal steps as they are written.
fn as_written(seconds: f64) -> Option<FrameRate> {
    let whole = (1.0 / seconds).round();
    let is_whole =
        (1.0..1e9).contains(&whole) && ((1.0 / whole) - seconds).abs() <= 1e-15 * seconds;
    match is_whole {
        true => FrameRate::new(whole as u64, 1).ok(),
        false => itself(seconds),
    }
}

fn is_whole(rate: FrameRate) -> bool {
    rate.per_second().fract() == 0.0
}

// ---- a number of frames a second

/// A number within this of a common rate, relatively, is that rate: AMASS has 120.00004577, and 29.97 stands for
/// 30000/1001.
const NEAR: f64 = 2e-6;

/// The rate of a number: an integer, an integer divided by 1.001, or the simplest fraction that is this number in
/// f64. `None` if the number is not a rate.
fn of_number(number: f64) -> Option<FrameRate> {
    let is_near = |rate: f64| (number - rate).abs() <= NEAR * rate;
    let whole = number.round();
    if whole >= 1.0 && whole <= f64::from(u32::MAX) && is_near(whole) {
        return FrameRate::new(whole as u64, 1).ok();
    }
    for frames in [24_000, 30_000, 48_000, 60_000, 120_000] {
        let rate = FrameRate::new(frames, 1_001).ok()?;
        if is_near(rate.per_second()) {
            return Some(rate);
        }
    }
    let (frames, seconds) = ratio(number)?;
    FrameRate::new(frames, seconds).ok()
}

// ---- a frame's time

/// The largest change of a duration, as a part of it, that is made without a warning.
const UNNOTICED: f64 = 5e-3;

/// The largest change of a duration that few digits may cause.
const MAX_CHANGE: f64 = 0.025;

/// The fraction by which a clip becomes longer if its frame time is read as that of a rate; `None` if it is hardly noticed.
pub(crate) fn noticed_change(period: f64, rate: FrameRate) -> Option<f64> {
    let change = rate.time_of(1) / period - 1.0;
    (change.abs() > UNNOTICED).then_some(change)
}

/// The warning that a file's rate is replaced.
pub(crate) fn overridden(rate: FrameRate, other: FrameRate) -> String {
    format!(
        "the file states {}; because of --override-fps it is read at {other}",
        rate.in_words()
    )
}

/// The rate of a frame time with these digits. Candidates are the whole rates whose frame time is written with these
/// digits, such rates times 1000/1001, and last the number itself. Digits may have been rounded, as in 0.017, or cut
/// off, as in 0.0166. If several rates are possible and exactly one of them is a usual rate, that one is chosen. A rate
/// is not considered if it would change the duration by more than [`MAX_CHANGE`], or, for digits that were cut off, by
/// more than [`UNNOTICED`]. Some programs print the digits of an f32, so that the time may also have been rounded to
/// f32. `None` for times outside 1e-9 s to 1e9 s.
fn of_period(digits: &str) -> Option<FrameRate> {
    let period: f64 = digits.parse().ok()?;
    if !(1e-9..=1e9).contains(&period) {
        return None;
    }
    let written = as_written(period);
    if written.is_some_and(is_whole) {
        return written;
    }
    let digit = whole_power(10.0, last_digit_power(digits));
    let half = 0.5 * digit;
    let was_rounded = |rate: FrameRate| {
        let exact = rate.time_of(1);
        let near = |time: f64| (time - period).abs() <= half;
        near(exact) || near(f64::from(exact as f32))
    };
    let margin = half + period * f64::from(f32::EPSILON);
    let high = if margin < period {
        1.0 / (period - margin)
    } else {
        MAX_RATE
    };
    let change = |rate: &FrameRate| (rate.time_of(1) / period - 1.0).abs();
    let rounded = choose(1.0 / (period + margin), high, was_rounded);
    let rounded = rounded.filter(|rate| change(rate) <= MAX_CHANGE);
    let cut = || {
        let was_cut = |rate: FrameRate| (0.0..digit).contains(&(rate.time_of(1) - period));
        let cut = choose(1.0 / (period + digit), 1.0 / period, was_cut)?;
        (is_common(cut) && change(&cut) <= UNNOTICED).then_some(cut)
    };
    rounded.or_else(cut).or(written)
}

/// Whether a rate, or 1.001 times it, is one of the common ones.
fn is_common(rate: FrameRate) -> bool {
    let common = COMMON_RATES.iter().copied();
    let mut both = common.flat_map(|number| [(number, 1), (number * 1000, 1001)]);
    both.any(|(frames, seconds)| FrameRate::new(frames, seconds).ok() == Some(rate))
}

/// The power of ten of a number's last digit.
pub(crate) fn last_digit_power(token: &str) -> i32 {
    let (mantissa, exponent) = token.split_once(['e', 'E']).unwrap_or((token, "0"));
    let decimals = mantissa
        .split_once('.')
        .map_or(0, |(_, decimals)| decimals.len());
    let exponent: i32 = exponent.parse().unwrap_or(0); // of at most 62 digits; it has been a number
    exponent.saturating_sub(decimals as i32)
}

/// The rate whose period is the simplest fraction that is this number in f64, so that a rate is found again from the
/// shortest digits of its period.
pub(crate) fn itself(period: f64) -> Option<FrameRate> {
    let (seconds, frames) = ratio(period)?;
    FrameRate::new(frames, seconds).ok()
}

/// The simplest fraction that is this number in f64: the first convergent of its continued fraction that is rounded
/// to it. `None` for numbers outside 1e-9 to 1e9.
fn ratio(number: f64) -> Option<(u64, u64)> {
    if !(1e-9..=1e9).contains(&number) {
        return None;
    }
    // The number as a ratio of whole numbers; it has at most 82 binary digits.
    let exponent = (number.to_bits() >> 52) as i32 - 1023;
    let binary_digits = 52 - exponent;
    let mut rest = (
        (number * whole_power(2.0, binary_digits)) as u128,
        1u128 << binary_digits,
    );
    let (mut before, mut last) = ((0u128, 1u128), (1u128, 0u128));
    while rest.1 > 0 {
        let whole = rest.0 / rest.1;
        rest = (rest.1, rest.0 % rest.1);
        let next = |last: u128, before: u128| whole.saturating_mul(last).saturating_add(before);
        let next = (next(last.0, before.0), next(last.1, before.1));
        (before, last) = (last, next);
        if last.0.max(last.1) > LARGEST {
            return None;
        }
        if last.0 as f64 / last.1 as f64 == number {
            return Some((last.0 as u64, last.1 as u64));
        }
    }
    None
}

// ---- the times of keys

/// The interval of time in which a frame can be, from the rounding errors of some times.
#[derive(Debug, Clone, Copy)]
struct TimeWindow {
    from: f64,
    to: f64,
}

impl TimeWindow {
    fn middle(self) -> f64 {
        0.5 * (self.from + self.to)
    }
}

fn of_times(lists: &[Vec<f64>], precision: Precision) -> Option<FrameGrid> {
    let mut times: Vec<f64> = lists.iter().flatten().copied().collect();
    if times.iter().any(|time| !time.is_finite()) {
        return None;
    }
    times.sort_by(f64::total_cmp);
    times.dedup();
    if let [time] = times[..] {
        // A single time does not determine a rate, but it may be at a frame of a usual rate.
        let off = precision.rounding(time);
        let (from, to) = (time - off, time + off);
        let grid = on_common_grid(&[TimeWindow { from, to }]).filter(|_| time != 0.0)?;
        return Some(FrameGrid {
            is_rate: false,
            ..FrameGrid::at_zero(grid)
        });
    }
    if times.is_empty() {
        return None;
    }
    let found = of_distinct(&times, precision);
    let Precision::Decimals(_) = precision else {
        return found;
    };
    // A number with many digits may have been an f32.
    let half = 0.5 * precision.ulp(1.0);
    let are_f32 = || {
        let digits = |time: &f64| (f64::from(*time as f32) - time).abs() <= half;
        half <= 1e-7 && times.iter().all(digits)
    };
    found.or_else(|| are_f32().then(|| of_distinct(&times, Precision::F32))?)
}

/// The rate of increasing times.
fn of_distinct(times: &[f64], precision: Precision) -> Option<FrameGrid> {
    let steps = || times.windows(2).map(|pair| pair[1] - pair[0]);
    let step = steps().fold(f64::INFINITY, f64::min);
    let (first, last) = (times[0], times[times.len() - 1]);
    // The rate as written may be the intended one.
    let exact = Precision::F64.rounding(first.abs().max(last.abs()));
    // A program may have computed each time by adding the period to the time before.
    let added = |keys: usize| exact * (2.0 + keys as f64 / 8.0);
    let count = ((last - first) / step).round();
    // The difference of two late times has a larger error than the mean of all.
    let mean = (last - first) / count;
    let even = |(key, &time): (usize, &f64)| {
        let count = ((time - first) / mean).round();
        (time - first - count * mean).abs() <= added(key) + count * exact / 8.0
    };
    let as_written = times
        .iter()
        .enumerate()
        .all(even)
        .then(|| shortest(mean, added(times.len()) / count))
        .filter(|&period| is_short(period))
        .and_then(as_written);
    if let Some(rate) = as_written.filter(|&rate| is_whole(rate)) {
        let on_frames = on_frames(times.iter().copied(), rate, 0.0, precision);
        let phase = if on_frames { 0.0 } else { first };
        if on_frames || precision != Precision::F32 {
            return Some(FrameGrid {
                grid: rate,
                phase,
                is_rate: true,
            });
        }
    }
    let windows = windows(times, precision)?;
    let steps = StepRates::of(&windows);
    let at_zero = steps.as_ref().and_then(|steps| steps.on_zero(&windows));
    let found = |grid, phase| FrameGrid {
        grid,
        phase,
        is_rate: true,
    };
    let chosen = || Some(found(at_zero.as_ref()?.choose(|_| true)?, 0.0));
    let written = || {
        let grid = as_written.filter(|_| precision != Precision::F32)?;
        let is_at_zero = on_frames(times.iter().copied(), grid, 0.0, precision);
        Some(found(grid, if is_at_zero { 0.0 } else { first }))
    };
    // The first time may be rounded too. The other times determine where its frame is, within the rounding.
    let on_first = |steps: &StepRates, grid| {
        let frame = steps.first_frame(&windows, grid)?;
        Some(found(grid, first.clamp(frame.from, frame.to)))
    };
    let from_first = || {
        let steps = steps.as_ref()?;
        let grid = steps.choose(|rate| steps.first_frame(&windows, rate).is_some())?;
        on_first(steps, grid)
    };
    let simple = || {
        let grid = at_zero.as_ref().and_then(StepRates::simple);
        let grid = grid.map(|grid| found(grid, 0.0));
        grid.or_else(|| {
            let steps = steps.as_ref()?;
            on_first(steps, steps.simple()?)
        })
    };
    let some_grid = || {
        let grid = on_some_grid(&windows)?;
        Some(FrameGrid {
            is_rate: false,
            ..FrameGrid::at_zero(grid)
        })
    };
    chosen()
        .or_else(written)
        .or_else(from_first)
        .or_else(simple)
        .or_else(some_grid)
}

/// Whether a period has so few digits that a program may have used it: 0.03333333333333333 is a quotient.
fn is_short(period: f64) -> bool {
    period.to_string().len() <= 14
}

/// The number with the fewest decimals within `near` of another.
fn shortest(number: f64, near: f64) -> f64 {
    let decimals = (0..17).map(|digits| {
        let text = format!("{number:.digits$}");
        text.parse().unwrap_or(number)
    });
    let is_near = |short: &f64| *short > 0.0 && (short - number).abs() <= near;
    decimals.into_iter().find(is_near).unwrap_or(number)
}

/// The windows of time in which the frames can be; times whose windows overlap count as one time. `None` if fewer than
/// two windows remain.
fn windows(times: &[f64], precision: Precision) -> Option<Vec<TimeWindow>> {
    let mut all: Vec<TimeWindow> = Vec::new();
    for &time in times {
        let off = precision.rounding(time);
        let (from, to) = (time - off, time + off);
        match all.last_mut() {
            Some(last) if from <= last.to => {
                // Two rounded values of the same time: the true time is in both windows.
                (last.from, last.to) = (last.from.max(from), last.to.min(to));
            }
            _ => all.push(TimeWindow { from, to }),
        }
    }
    (all.len() > 1).then_some(all)
}

/// The rates at which the smallest step between times is one frame and all others are whole numbers of frames: those
/// from `low` to `high`.
struct StepRates {
    low: f64,
    high: f64,
    /// The frame number of each window.
    counts: Vec<f64>,
}

impl StepRates {
    /// With frames that count from the first window.
    fn of(windows: &[TimeWindow]) -> Option<Self> {
        let widest = windows
            .iter()
            .map(|window| window.to - window.from)
            .fold(0.0, f64::max);
        let steps = windows
            .windows(2)
            .map(|pair| pair[1].middle() - pair[0].middle());
        let step = steps.fold(f64::INFINITY, f64::min);
        if widest > 0.5 * step {
            return None;
        }
        // Each step narrows the rates that the step before it leaves.
        let mut all = Self {
            low: 1.0 / (step + widest),
            high: 1.0 / (step - widest),
            counts: vec![0.0],
        };
        let first = windows[0];
        for window in &windows[1..] {
            let (least, longest) = (window.from - first.to, window.to - first.from);
            let count = all.count(0.5 * (least + longest))?;
            let is_next = all.counts.last().is_none_or(|&before| before < count);
            all.narrow(count, least, longest).filter(|()| is_next)?;
            all.counts.push(count);
        }
        Some(all)
    }

    /// The same with frames that count from time 0.
    fn on_zero(&self, windows: &[TimeWindow]) -> Option<Self> {
        let mut all = Self {
            counts: Vec::with_capacity(windows.len()),
            ..*self
        };
        // Times near 0 are assigned to frames first, because they determine how the others are counted.
        let mut order: Vec<usize> = (0..windows.len()).collect();
        let near = |index: usize| windows[index].middle().abs();
        order.sort_by(|&a, &b| near(a).total_cmp(&near(b)));
        let mut numbered = vec![0.0; windows.len()];
        for index in order {
            let TimeWindow { from, to } = windows[index];
            let count = all.count(windows[index].middle())?;
            match count {
                0.0 if from <= 0.0 && 0.0 <= to => {}
                1.0.. => all.narrow(count, from, to)?,
                ..=-1.0 => all.narrow(-count, -to, -from)?,
                _ => return None,
            }
            numbered[index] = count;
        }
        all.counts = numbered;
        let increase = all.counts.windows(2).all(|pair| pair[0] < pair[1]);
        increase.then_some(all)
    }

    /// The number of frames in some seconds, if it is the same for all of the rates.
    fn count(&self, seconds: f64) -> Option<f64> {
        let is_sure = (self.high - self.low) * seconds.abs() <= 1.0;
        is_sure.then(|| (0.5 * (self.low + self.high) * seconds).round())
    }

    /// Keeps the rates with `count` frames in a time from `least` to `longest`.
    fn narrow(&mut self, count: f64, least: f64, longest: f64) -> Option<()> {
        if count < 1.0 || least <= 0.0 {
            return None;
        }
        (self.low, self.high) = (self.low.max(count / longest), self.high.min(count / least));
        (self.low <= self.high).then_some(())
    }

    /// Where the first frame of the rate can be so that each window contains one; `None` if it can be nowhere.
    fn first_frame(&self, windows: &[TimeWindow], rate: FrameRate) -> Option<TimeWindow> {
        let (mut from, mut to) = (f64::NEG_INFINITY, f64::INFINITY);
        for (window, count) in windows.iter().zip(&self.counts) {
            let behind = count / rate.per_second();
            (from, to) = (from.max(window.from - behind), to.min(window.to - behind));
        }
        (from <= to).then_some(TimeWindow { from, to })
    }

    fn choose(&self, fits: impl Fn(FrameRate) -> bool) -> Option<FrameRate> {
        let (low, high) = (self.low, self.high);
        let is_sure = high - low < 0.05 * high;
        let is_within = |rate: FrameRate| {
            let (rate, slack) = (rate.per_second(), high * f64::EPSILON);
            low - slack <= rate && rate <= high + slack
        };
        choose(low, high, |rate| is_within(rate) && fits(rate)).filter(|_| is_sure)
    }

    /// A rate that is much simpler than those between two random numbers.
    fn simple(&self) -> Option<FrameRate> {
        let (frames, seconds) = simplest(self.low, self.high)?;
        let width = (self.high - self.low).max(self.high * f64::EPSILON);
        let is_simple = self.counts.len() > 3 && (seconds as f64 * seconds as f64) * width < 0.01;
        is_simple.then(|| FrameRate::new(frames, seconds).ok())?
    }
}

/// The fraction with the smallest numbers from `low` to `high`.
fn simplest(low: f64, high: f64) -> Option<(u64, u64)> {
    // Searches the Stern-Brocot tree; each step of the loop takes a run of equal steps.
    let (mut low, mut high) = (low, high);
    let (mut before, mut last) = ((0u128, 1u128), (1u128, 0u128));
    for _ in 0..64 {
        let whole = low.floor();
        let is_last = low == whole || whole + 1.0 <= high;
        let part = if low == whole {
            whole
        } else if is_last {
            whole + 1.0
        } else {
            whole
        };
        let part = part as u128;
        let next = |last: u128, before: u128| part.saturating_mul(last).saturating_add(before);
        let next = (next(last.0, before.0), next(last.1, before.1));
        if next.0.max(next.1) > LARGEST {
            return None;
        }
        if is_last {
            return Some((next.0 as u64, next.1 as u64));
        }
        (before, last) = (last, next);
        (low, high) = (1.0 / (high - whole), 1.0 / (low - whole));
    }
    None
}

/// The probability below which it is not an accident that all times are frames of a rate.
const ACCIDENT: f64 = 1e-3;

/// The lowest common rate such that all times are frames of it, counted from 0, though none are neighbours; otherwise
/// the lowest such rate.
fn on_some_grid(windows: &[TimeWindow]) -> Option<FrameRate> {
    let whole = || (1..=MAX_RATE as u64).map(|rate| (rate, 1));
    let ntsc = || {
        [24, 30, 48, 60, 120]
            .map(|rate| (rate * 1000, 1001))
            .into_iter()
    };
    on_common_grid(windows).or_else(|| on_one_of(windows, whole().chain(ntsc())))
}

/// The lowest common rate such that all times are frames of it.
fn on_common_grid(windows: &[TimeWindow]) -> Option<FrameRate> {
    let common = COMMON_RATES.iter().filter(|&&rate| rate >= 24);
    on_one_of(windows, common.map(|&rate| (rate, 1)))
}

/// The first of some rates at whose frames all times are, unless this may be a coincidence.
fn on_one_of(
    windows: &[TimeWindow],
    rates: impl Iterator<Item = (u64, u64)> + Clone,
) -> Option<FrameRate> {
    let tried = rates.clone().count() as f64;
    let widths = windows.iter().map(|window| window.to - window.from);
    let widest = widths.fold(0.0, f64::max);
    // Whole seconds are frames of every whole rate, and 0 is a frame of every rate, so they give no information.
    let is_whole_second = |window: &TimeWindow| window.from.ceil() <= window.to;
    let at_zero = |window: &TimeWindow| window.from <= 0.0 && 0.0 <= window.to;
    let count = |shows_nothing: &dyn Fn(&TimeWindow) -> bool| {
        let all = windows.iter().filter(|window| !shows_nothing(window));
        all.count() as i32
    };
    let (of_whole, of_others) = (count(&is_whole_second), count(&at_zero));
    let fits = |rate: &FrameRate| {
        let per_second = rate.per_second();
        let evidence = if is_whole(*rate) { of_whole } else { of_others };
        let chance = whole_power(widest * per_second, evidence) * tried;
        if widest * per_second > 0.25 || chance > ACCIDENT {
            return false;
        }
        let mut before = f64::NEG_INFINITY;
        windows.iter().all(|window| {
            let frame = (window.middle() * per_second).round();
            let time = frame / per_second;
            let is_next = frame > before;
            before = frame;
            is_next && window.from <= time && time <= window.to
        })
    };
    let mut all = rates.filter_map(|(frames, seconds)| FrameRate::new(frames, seconds).ok());
    all.find(fits)
}

/// Whether all times are frames of the rate, of which one is at `phase`, up to rounding.
pub(crate) fn on_frames(
    mut times: impl Iterator<Item = f64>,
    rate: FrameRate,
    phase: f64,
    precision: Precision,
) -> bool {
    times.all(|time| {
        let exact = frame_time(rate, phase, time);
        (time - exact).abs() <= precision.rounding(time)
    })
}

/// The time of the frame nearest to a time.
pub(crate) fn frame_time(rate: FrameRate, phase: f64, time: f64) -> f64 {
    let frame = ((time - phase) * rate.per_second()).round();
    let behind = rate.time_of(frame.abs() as u64).copysign(frame);
    if phase == 0.0 { behind } else { phase + behind }
}

#[cfg(test)]
mod tests;
