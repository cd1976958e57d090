//! Finds the staircase with the least delay.

use glam::DVec2;

use crate::walkers::region::{Region, StraightMotion};
use crate::walkers::{Mover, Plan, Walker, WalkerError};

/// Whether a mover exists after its last time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stay {
    Leaves,
    Remains,
}

/// The number of steps into which the route is divided between distances where the obstacles change. Walkers wait
/// only at the ends of steps.
const STEPS: usize = 16;
/// Delays that differ by less than this, relatively, are equal: regions that touch leave no gap.
const SAME: f64 = 1e-10;

/// A closed interval of delays.
type Interval = (f64, f64);

pub(super) fn plan(walker: &Walker, others: &[(Mover, Stay)]) -> Result<Plan, WalkerError> {
    let points = &walker.route.points;
    let mut length = 0.0;
    let mut stops = vec![0.0];
    for pair in points.windows(2) {
        length += pair[0].distance(pair[1]);
        stops.push(length);
    }
    let regions = regions(walker, &stops, others);
    let wait_points = wait_points(&stops, &regions);
    // The delays with which the walker can reach each wait point.
    let mut reached: Vec<Vec<Interval>> = vec![vec![(0.0, 0.0)]];
    for (index, &distance) in wait_points.iter().enumerate() {
        let mut from = raised(&reached[index], &blocked(&regions, distance, distance));
        if index == 0 {
            // Until the walker starts, it stands at its start.
            from.retain_mut(|interval| {
                interval.0 = interval.0.max(walker.start);
                interval.0 <= interval.1
            });
        }
        let Some(&next) = wait_points.get(index + 1) else {
            reached.push(from);
            break;
        };
        let on = without(&from, &blocked(&regions, distance, next));
        if on.is_empty() {
            return Err(WalkerError::Blocked);
        }
        reached.push(on);
    }
    let delay = |index: usize, limit: f64| {
        let gaps = raised(
            &reached[index],
            &blocked(&regions, wait_points[index], wait_points[index]),
        );
        let gap = gaps
            .into_iter()
            .rev()
            .find(|interval| interval.0 <= limit + same(limit));
        gap.map_or(limit, |found| found.0.min(limit))
    };
    let last = wait_points.len() - 1;
    let arriving = reached[last].first().map(|first| first.0);
    let Some(arriving) = arriving.filter(|_| !reached[last + 1].is_empty()) else {
        return Err(WalkerError::Blocked);
    };
    // A route of one point needs no plan.
    let arriving = if last == 0 { walker.start } else { arriving };
    // From the goal backwards: at each wait point, the walker arrives with the smallest delay of the gap (the interval
    // that is not blocked) that contains the delay with which it leaves.
    let mut delays = vec![(arriving, arriving); wait_points.len()];
    let mut current = arriving;
    for index in (0..=last).rev() {
        let before = if index == 0 {
            0.0
        } else {
            delay(index, current).min(current)
        };
        let before = if index == last { current } else { before };
        delays[index] = (before, current);
        current = before;
    }
    if last == 0 {
        delays[0] = (0.0, arriving);
    }
    Ok(timed(walker, &stops, &wait_points, &delays))
}

fn same(delay: f64) -> f64 {
    SAME * (1.0 + delay.abs())
}

fn regions(
    walker: &Walker,
    stops: &[f64],
    others: &[(Mover, Stay)],
) -> Vec<(DVec2, DVec2, Region)> {
    let points = &walker.route.points;
    let stretch =
        |k: usize| StraightMotion::between((stops[k], points[k]), (stops[k + 1], points[k + 1]));
    let mut segments: Vec<StraightMotion> = (0..points.len() - 1).map(stretch).collect();
    if segments.is_empty() {
        segments.push(StraightMotion::standing(0.0, 0.0, points[0]));
    }
    let mut regions = Vec::new();
    for (other, stay) in others {
        let pairs = other.track.windows(2);
        let mut lines: Vec<StraightMotion> = pairs
            .map(|pair| StraightMotion::between(pair[0], pair[1]))
            .collect();
        if let (Some(&(time, position)), Stay::Remains) = (other.track.last(), stay) {
            lines.push(StraightMotion::standing(time, f64::INFINITY, position));
        }
        for &line in &lines {
            for &segment in &segments {
                let region = Region::new(
                    segment,
                    line,
                    1.0 / walker.speed,
                    walker.radius + other.radius,
                );
                if let Some((low, high)) = region.extent(segment.from, segment.to)
                    && high.y >= 0.0
                {
                    regions.push((low, high, region));
                }
            }
        }
    }
    regions
}

/// The distances at which the walker may wait: at the points of the route, where obstacles begin and end, and
/// between.
fn wait_points(stops: &[f64], regions: &[(DVec2, DVec2, Region)]) -> Vec<f64> {
    let end = stops[stops.len() - 1];
    let ends = regions.iter().flat_map(|(low, high, _)| [low.x, high.x]);
    let mut marks: Vec<f64> = stops.iter().copied().chain(ends).collect();
    marks.sort_by(f64::total_cmp);
    let mut distances = vec![0.0];
    for mark in marks {
        let mark = mark.clamp(0.0, end);
        let before = distances[distances.len() - 1];
        if mark - before <= 1e-12 * end {
            continue;
        }
        let touches = |(low, high, _): &(DVec2, DVec2, Region)| low.x < mark && high.x > before;
        let steps = if regions.iter().any(touches) {
            STEPS
        } else {
            1
        };
        let part = (mark - before) / steps as f64;
        distances.extend((1..steps).map(|step| before + step as f64 * part));
        distances.push(mark);
    }
    if let Some(last) = distances.last_mut().filter(|_| end > 0.0) {
        *last = end;
    }
    distances
}

/// The open intervals of delays that regions block between two distances, disjoint and in order.
fn blocked(regions: &[(DVec2, DVec2, Region)], from: f64, to: f64) -> Vec<Interval> {
    let near = regions
        .iter()
        .filter(|(low, high, _)| low.x <= to && high.x >= from);
    let extents = near.filter_map(|(_, _, region)| region.extent(from, to));
    let mut all: Vec<Interval> = extents.map(|(low, high)| (low.y, high.y)).collect();
    all.retain(|interval| interval.1 - interval.0 > same(interval.0));
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut apart: Vec<Interval> = Vec::with_capacity(all.len());
    for interval in all {
        match apart.last_mut() {
            Some(last) if interval.0 <= last.1 + same(last.1) => last.1 = last.1.max(interval.1),
            _ => apart.push(interval),
        }
    }
    apart
}

/// The intervals between blocked ones, from 0 on.
fn gaps(blocked: &[Interval]) -> Vec<Interval> {
    let mut gaps = Vec::with_capacity(blocked.len() + 1);
    let mut from = 0.0;
    for &(low, high) in blocked {
        if low >= from {
            gaps.push((from, low));
        }
        from = f64::max(from, high);
    }
    if from < f64::INFINITY {
        gaps.push((from, f64::INFINITY));
    }
    gaps
}

/// The delays that are reached by waiting: in each gap, all from the least reached one.
fn raised(reached: &[Interval], blocked: &[Interval]) -> Vec<Interval> {
    let raise = |(low, high): Interval| {
        let within =
            |interval: &&Interval| interval.1 >= low - same(low) && interval.0 <= high + same(high);
        let least = reached.iter().find(within)?.0;
        Some((least.clamp(low, high), high))
    };
    gaps(blocked).into_iter().filter_map(raise).collect()
}

/// The delays that are reached by walking: the reached ones that are not blocked.
fn without(reached: &[Interval], blocked: &[Interval]) -> Vec<Interval> {
    let gaps = gaps(blocked);
    let mut left = Vec::new();
    for &(low, high) in reached {
        for gap in &gaps {
            // Rounding may leave the end of a region a little inside it.
            let from = if low < gap.0 && gap.0 - low <= same(low) {
                gap.0
            } else {
                low.max(gap.0)
            };
            let to = high.min(gap.1);
            if from <= to {
                left.push((from, to));
            }
        }
    }
    left
}

/// The times at which the walker is at each point.
fn timed(walker: &Walker, stops: &[f64], wait_points: &[f64], delays: &[(f64, f64)]) -> Plan {
    let points = &walker.route.points;
    let at = |distance: f64| {
        let next = stops
            .partition_point(|&stop| stop < distance)
            .clamp(1, stops.len().max(2) - 1);
        match (points.get(next - 1), points.get(next)) {
            (Some(&one), Some(&other)) => {
                let part = (distance - stops[next - 1]) / (stops[next] - stops[next - 1]);
                one.lerp(other, part.clamp(0.0, 1.0))
            }
            _ => points[0],
        }
    };
    let mut times: Vec<(f64, f64, glam::DVec3)> = Vec::new();
    for (index, (&distance, &(before, behind))) in wait_points.iter().zip(delays).enumerate() {
        let walked = distance / walker.speed;
        let waits = behind - before > same(before);
        let is_stop = stops
            .binary_search_by(|stop| stop.total_cmp(&distance))
            .is_ok();
        if waits || is_stop || index == 0 || index + 1 == wait_points.len() {
            times.push((before + walked, distance, at(distance)));
        }
        if waits {
            times.push((behind + walked, distance, at(distance)));
        }
    }
    let arrival = times.last().map_or(0.0, |last| last.0);
    Plan { times, arrival }
}
