//! Contestants that do the same work, measured in turn.

use std::time::{Duration, Instant};

use glam::Quat;

use crate::commands::bench::report::BenchRow;

/// The work of a contestant; returns the times of its parts.
type Action<'a, E> = Box<dyn FnMut(&mut [Quat]) -> Result<Vec<TimeShare>, E> + 'a>;

/// How often each contestant is measured, and how many calls one measurement has.
#[derive(Clone, Copy)]
pub(crate) struct Repetitions {
    pub(super) rounds: u32,
    pub(super) calls: u32,
}

/// A named part of an action's time.
pub(super) struct TimeShare {
    pub(super) name: &'static str,
    pub(super) time: Duration,
}

pub(super) struct Contestant<'a, E> {
    name: String,
    action: Action<'a, E>,
    /// For a result that stays on a device: the bytes that the device writes, and the bytes a second that it can write.
    /// The time of the first part then counts, instead of the host's time from call to return.
    pub(super) on_device: Option<(u64, f64)>,
}

impl<'a, E> Contestant<'a, E> {
    pub(super) fn new(
        name: impl Into<String>,
        action: impl FnMut(&mut [Quat]) -> Result<Vec<TimeShare>, E> + 'a,
    ) -> Self {
        Self {
            name: name.into(),
            action: Box::new(action),
            on_device: None,
        }
    }
}

/// Measures every contestant in turn, round after round; the first round does not count.
pub(super) fn race<E>(
    mut contestants: Vec<Contestant<'_, E>>,
    output: &mut [Quat],
    Repetitions { rounds, calls }: Repetitions,
) -> Result<Vec<BenchRow>, E> {
    let mut times = vec![Vec::new(); contestants.len()];
    let mut parts: Vec<Vec<(&str, Vec<Duration>)>> = vec![Vec::new(); contestants.len()];
    for round in 0..=rounds {
        for (i, contestant) in contestants.iter_mut().enumerate() {
            let mut shares = Vec::new();
            let started = Instant::now();
            for _ in 0..calls {
                shares = (contestant.action)(output)?;
            }
            let mut time = started.elapsed() / calls;
            if let (Some(_), Some(device)) = (contestant.on_device, shares.first()) {
                time = device.time;
            }
            std::hint::black_box(&mut *output);
            if round == 0 {
                parts[i] = shares.iter().map(|part| (part.name, Vec::new())).collect();
                continue;
            }
            times[i].push(time);
            for (of_part, part) in parts[i].iter_mut().zip(shares) {
                of_part.1.push(part.time);
            }
        }
    }
    let rows = contestants.into_iter().zip(times).zip(parts);
    Ok(rows
        .map(|((contestant, times), parts)| {
            let parts = parts.into_iter().map(|(name, times)| (name, median(times)));
            let mut row = BenchRow::new(contestant.name, median(times), parts.collect());
            row.share_of_device(contestant.on_device);
            row
        })
        .collect())
}

fn median(mut times: Vec<Duration>) -> Duration {
    times.sort();
    times[times.len() / 2]
}
