//! Reads the table of `docs/testing.md`, and finds the rate of each of its rows.

use super::*;

const PAGE: &str = include_str!("../../../docs/testing.md");

/// The rows of the table: a number as written, the number that is kept, and its rate.
fn rows() -> Vec<[&'static str; 3]> {
    let table = PAGE
        .split("| written | kept as | rate |\n|---|---|---|\n")
        .nth(1)
        .unwrap();
    let lines = table.lines().take_while(|line| line.starts_with('|'));
    let cells = lines.map(|line| {
        let mut cells = line.trim_matches('|').split('|').map(str::trim);
        let mut next = || cells.next().unwrap();
        [next().trim_matches('`'), next(), next()]
    });
    cells.collect()
}

fn shown(found: Option<FrameGrid>) -> String {
    let rate = found.and_then(FrameGrid::rate);
    rate.map_or("none".to_owned(), |rate| rate.to_string())
}

/// As a file keeps times that were computed so.
fn kept(times: impl Iterator<Item = f64>, kept_as: &str) -> (Vec<f64>, Precision) {
    match kept_as {
        "f32" => (
            times.map(|time| f64::from(time as f32)).collect(),
            Precision::F32,
        ),
        "f64" => (times.collect(), Precision::F64),
        _ => {
            let decimals: usize = kept_as.strip_suffix(" decimals").unwrap().parse().unwrap();
            let text = times.map(|time| format!("{time:.decimals$}").parse().unwrap());
            (text.collect(), Precision::Decimals(decimals as u32))
        }
    }
}

/// The times of keys by a formula such as `7.25 + k / 30` or `k * f32(1 / 30)`, at one of its rates.
fn keys(formula: &str, rate: FrameRate, kept_as: &str) -> (Vec<f64>, Precision) {
    let (start, formula) = formula.split_once(" + ").unwrap_or(("0", formula));
    let start: f64 = start.parse().unwrap();
    let frames = 0..100u32;
    let period = rate.time_of(1);
    if formula.starts_with("k * f32(") {
        let times = frames.map(|k| f64::from(k as f32 * period as f32));
        return kept(times, kept_as);
    } else if formula.starts_with("k sums of f32(") {
        let period = period as f32;
        let sums = std::iter::successors(Some(0.0f32), |sum| Some(sum + period));
        return kept(sums.take(1000).map(f64::from), kept_as);
    } else if formula.starts_with("k * f64(") {
        return kept(frames.map(|k| f64::from(k) * period), kept_as);
    }
    assert!(formula.starts_with("k / "), "{formula}");
    kept(frames.map(|k| start + rate.time_of(k.into())), kept_as)
}

#[test]
fn the_table_of_the_documents_holds() {
    let rows = rows();
    assert!(rows.len() >= 40, "{} rows", rows.len());
    let mut wrong = Vec::new();
    let mut check = |row: &[&str; 3], found: String, expected: &str| {
        if found != expected {
            wrong.push(format!("{row:?}: found {found}, not {expected}"));
        }
    };
    for row in &rows {
        let [written, kept_as, rate] = *row;
        if let Some(digits) = written.strip_prefix("Frame Time: ") {
            check(row, shown(of(&RateSource::FrameTime(digits))), rate);
        } else if let Some(number) = written.strip_prefix("fps = ") {
            check(
                row,
                shown(of(&RateSource::Number(number.parse().unwrap()))),
                rate,
            );
        } else if written.contains('k') {
            let (_, rates) = written.split_once(" / ").unwrap();
            let rates = rates.trim_end_matches(')');
            let all: Vec<FrameRate> = match rates.split_once("..") {
                Some((from, to)) => {
                    let all = from.parse().unwrap()..=to.parse().unwrap();
                    all.map(|rate| FrameRate::new(rate, 1).unwrap()).collect()
                }
                None => vec![rates.parse().unwrap()],
            };
            for meant in all {
                let (times, precision) = keys(written, meant, kept_as);
                let found = match written.starts_with("k sums") {
                    true => of_sums(&[times]).map_or("none".to_owned(), |rate| rate.to_string()),
                    false => shown(of(&RateSource::Times(&[times], precision))),
                };
                let meant = meant.to_string();
                check(row, found, if rate == "the same" { &meant } else { rate });
            }
        } else {
            let tokens = || written.split(' ');
            let times = tokens().map(|token| token.parse::<f64>().unwrap());
            let (times, precision) = match kept_as {
                "text" => {
                    let decimals =
                        tokens().map(|token| last_digit_power(token).min(0).unsigned_abs());
                    (
                        times.collect(),
                        Precision::Decimals(decimals.max().unwrap()),
                    )
                }
                _ => kept(times, kept_as),
            };
            check(
                row,
                shown(of(&RateSource::Times(&[times], precision))),
                rate,
            );
        }
    }
    assert!(
        wrong.is_empty(),
        "{} wrong:\n{}",
        wrong.len(),
        wrong[..wrong.len().min(30)].join("\n")
    );
}

/// Times that were rounded become frames, to the last bit of f64.
#[test]
fn rounded_times_become_the_frames_of_any_rate() {
    for number in 1..=1000 {
        let rate = FrameRate::new(number, 1).unwrap();
        for (formula, kept_as) in [
            ("k / r", "f32"),
            ("k * f32(1 / r)", "f32"),
            ("k / r", "7 decimals"),
        ] {
            let (times, precision) = keys(formula, rate, kept_as);
            let mut lists = [times];
            assert_eq!(
                crate::motion::grid::restore(&mut lists, precision),
                Some(rate),
                "{formula}, {kept_as}"
            );
            let frames: Vec<f64> = (0..100).map(|k| rate.time_of(k)).collect();
            assert_eq!(lists[0], frames, "{formula} at {rate}, {kept_as}");
        }
    }
}

#[test]
fn rates_come_back_from_the_shortest_digits_of_their_period() {
    let ratios = (1..400).flat_map(|frames| {
        [1, 3, 100, 1001, 99_991].map(|seconds| (frames * 7919 % 100_003, seconds))
    });
    for (frames, seconds) in ratios {
        let rate = FrameRate::new(frames, seconds).unwrap();
        let digits = (seconds as f64 / frames as f64).to_string();
        let found = of(&RateSource::FrameTime(&digits)).and_then(FrameGrid::rate);
        assert_eq!(found, Some(rate), "{rate}");
        if frames < 1000 && rate.per_second().fract() != 0.0 && seconds != 1001 {
            let number = of(&RateSource::Number(rate.per_second())).and_then(FrameGrid::rate);
            assert_eq!(number, Some(rate), "{rate}");
        }
    }
    // A BVH file's frame time of 0.133333 s, as the number of an NPZ file.
    let written = FrameRate::new(1_000_000, 133_333).unwrap();
    let found = of(&RateSource::Number(written.per_second())).and_then(FrameGrid::rate);
    assert_eq!(found, Some(written));
    for digits in ["1e10", "9e-10", "1e-30"] {
        assert_eq!(of(&RateSource::FrameTime(digits)), None, "{digits}");
    }
    for number in [0.0, -30.0, f64::NAN, f64::INFINITY, 1e300, 1e-12] {
        assert_eq!(of(&RateSource::Number(number)), None, "{number}");
    }
}

/// A few digits of the period would move a key after millions of frames.
#[test]
fn a_period_is_as_exact_as_its_last_frame_is_far() {
    let times = [0.125, 0.158_333_333_33, 100_000.191_666_666_67];
    let mut lists = [times.to_vec()];
    crate::motion::grid::restore(&mut lists, Precision::Decimals(11));
    for (found, written) in lists[0].iter().zip(times) {
        assert!((found - written).abs() < 1e-11, "{found} {written}");
    }
}

/// Whole seconds lie on the frames of every whole rate, and one more time on those of some.
#[test]
fn whole_seconds_show_no_rate() {
    let times = [0.0, 413.0, 1_699_999_830.191_7];
    let mut lists = [times.to_vec()];
    assert_eq!(
        crate::motion::grid::restore(&mut lists, Precision::Decimals(9)),
        None
    );
    assert_eq!(lists, [times]);
}

/// A tenth has no exact step: between two late times it is off by their rounding, and many such steps by a frame.
#[test]
fn tenths_in_one_decimal_are_at_ten_a_second_however_many() {
    for count in [2u32, 150, 199, 200, 1999, 36_000] {
        let times = (0..count).map(|frame| f64::from(frame) / 10.0);
        let (times, precision) = kept(times, "1 decimals");
        let found = of(&RateSource::Times(&[times], precision));
        assert_eq!(shown(found), "10", "{count}");
        assert_eq!(found.unwrap().phase, 0.0);
    }
}

/// Moves times that were written with some decimals to their frames, and asserts that none of them moved further than
/// its digits allow.
fn assert_moved_by_half_a_digit(units: &[u32], decimals: u32) {
    let unit = super::whole_power(10.0, -(decimals as i32));
    let times: Vec<f64> = units.iter().map(|&units| f64::from(units) * unit).collect();
    let mut lists = [times.clone()];
    crate::motion::grid::restore(&mut lists, Precision::Decimals(decimals));
    for (found, written) in lists[0].iter().zip(&times) {
        let off = (found - written).abs();
        assert!(off <= 0.500_01 * unit, "{times:?}: {:?}", lists[0]);
    }
}

/// Few keys with few digits: a first frame at its written time would leave the others a whole digit away.
#[test]
fn times_in_text_move_by_half_a_digit_at_most() {
    for (units, decimals) in [
        (&[0u32, 10, 20, 37][..], 2),
        (&[0, 10, 20, 37], 1),
        (&[0, 10, 20, 37], 0),
        (&[0, 10, 20, 26], 1),
        (&[4, 14, 25, 34, 40, 48], 1),
        (&[7, 18, 25, 36, 52, 57], 1),
        (&[11, 19, 31, 40], 3),
    ] {
        assert_moved_by_half_a_digit(units, decimals);
    }
    let steps = proptest::collection::vec(1u32..40, 2..9);
    proptest::proptest!(|(first in 0u32..30, steps in steps, decimals in 0u32..4)| {
        let mut units = vec![first];
        units.extend(steps.iter().scan(first, |time, step| {
            *time += step;
            Some(*time)
        }));
        assert_moved_by_half_a_digit(&units, decimals);
    });
}
