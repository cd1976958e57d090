//! Interpolates numbers of unknown meaning for each frame linearly.

use std::io;

use crate::npz::array::Array;

/// Passes the numbers of an array at `new_times` to `put`, in C order. `axis` is the axis of the frames, whose times
/// are `times`. Before the first and after the last frame the numbers are constant.
pub(super) fn resample(
    array: &Array<'_>,
    axis: usize,
    times: &[f64],
    new_times: &[f64],
    put: &mut dyn FnMut(f64) -> io::Result<()>,
) -> io::Result<()> {
    let numbers = array.numbers().unwrap_or_default();
    let shape = &array.header.shape;
    let inner: usize = shape[axis + 1..].iter().product();
    let positions: Vec<(usize, f64)> = new_times
        .iter()
        .map(|&time| frame_at(times, time))
        .collect();
    for outer in numbers.chunks_exact((inner * times.len()).max(1)) {
        for &(frame, part) in &positions {
            for i in 0..inner {
                let from = outer[frame * inner + i];
                put(match part > 0.0 {
                    true => from + (outer[(frame + 1) * inner + i] - from) * part,
                    false => from,
                })?;
            }
        }
    }
    Ok(())
}

/// The frame at or before a time, and the fraction of the interval after it.
fn frame_at(times: &[f64], time: f64) -> (usize, f64) {
    let after = times.partition_point(|&other| other <= time);
    match (after.checked_sub(1), times.get(after)) {
        (None, _) => (0, 0.0),
        (Some(frame), None) => (frame, 0.0),
        (Some(frame), Some(&next)) => (frame, (time - times[frame]) / (next - times[frame])),
    }
}

#[cfg(test)]
mod tests {
    use super::frame_at;

    #[test]
    fn times_lie_between_frames_or_are_held() {
        let times = [0.0, 1.0, 3.0];
        for (time, expected) in [
            (-1.0, (0, 0.0)),
            (0.0, (0, 0.0)),
            (0.25, (0, 0.25)),
            (2.0, (1, 0.5)),
            (3.0, (2, 0.0)),
            (9.0, (2, 0.0)),
        ] {
            assert_eq!(frame_at(&times, time), expected);
        }
    }
}
