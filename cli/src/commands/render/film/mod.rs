//! Films: frames written one after another, each only where it differs from the one
//! before it.

pub(crate) mod apng;
pub(crate) mod gif;
pub(crate) mod overlay;

use std::io;

/// Takes frames in order, red, green and blue for each pixel.
pub(crate) trait Picture {
    fn frame(&mut self, pixels: &[u8]) -> io::Result<()>;
}

/// A part of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Patch {
    left: usize,
    top: usize,
    width: usize,
    height: usize,
}

impl Patch {
    /// The smallest rectangle with all pixels that differ; one pixel if none differs.
    fn of(before: &[u8], now: &[u8], width: usize) -> Self {
        let row = width * 3;
        let differs = |offset: usize| before[offset..offset + 3] != now[offset..offset + 3];
        let rows = now.len() / row;
        let changed = |y: &usize| before[y * row..(y + 1) * row] != now[y * row..(y + 1) * row];
        let Some(top) = (0..rows).find(changed) else {
            return Self {
                left: 0,
                top: 0,
                width: 1,
                height: 1,
            };
        };
        let bottom = (top..rows).rev().find(changed).unwrap_or(top);
        let (mut left, mut right) = (width, 0);
        for y in top..=bottom {
            let first = (0..left).find(|x| differs(y * row + x * 3));
            left = first.unwrap_or(left);
            let last = (right..width).rev().find(|x| differs(y * row + x * 3));
            right = last.unwrap_or(right);
        }
        Self {
            left,
            top,
            width: right + 1 - left,
            height: bottom + 1 - top,
        }
    }

    /// The whole of a picture.
    fn whole((width, height): (u32, u32)) -> Self {
        Self {
            left: 0,
            top: 0,
            width: width as usize,
            height: height as usize,
        }
    }

    /// The rows of this rectangle in a picture of this width.
    fn rows(self, pixels: &[u8], width: usize) -> impl Iterator<Item = &[u8]> {
        (self.top..self.top + self.height).map(move |y| {
            let start = (y * width + self.left) * 3;
            &pixels[start..start + self.width * 3]
        })
    }
}

/// How long each frame is shown, in parts of a second; rounding errors are carried to the next frame.
/// The last is shown as long as the one before it.
fn delays(times: &[f64], parts: f64, shortest: u16) -> Vec<u16> {
    let tick = |time: f64| ((time - times[0]) * parts).round();
    let mut delays: Vec<u16> = times
        .windows(2)
        .map(|pair| (tick(pair[1]) - tick(pair[0])).clamp(shortest.into(), u16::MAX.into()) as u16)
        .collect();
    delays.push(delays.last().copied().unwrap_or(shortest));
    delays
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patches_hold_what_differs_and_no_more() {
        let before = vec![0; 5 * 4 * 3];
        let mut now = before.clone();
        now[(5 + 3) * 3] = 1;
        now[(2 * 5 + 1) * 3 + 2] = 1;
        let patch = Patch::of(&before, &now, 5);
        let expected = Patch {
            left: 1,
            top: 1,
            width: 3,
            height: 2,
        };
        assert_eq!(patch, expected);
        let rows: Vec<u8> = patch.rows(&now, 5).flatten().copied().collect();
        assert_eq!(rows.len(), 18);
        assert_eq!((rows[6], rows[9 + 2]), (1, 1));
        assert_eq!(Patch::of(&now, &now, 5).width, 1);
    }

    #[test]
    fn rounding_does_not_add_up() {
        let times: Vec<f64> = (0..3001).map(|frame| f64::from(frame) / 30.0).collect();
        let delays = delays(&times, 100.0, 2);
        let total: u32 = delays[..3000].iter().map(|&delay| u32::from(delay)).sum();
        assert_eq!(total, 10_000);
        assert!(delays.iter().all(|delay| [3, 4].contains(delay)));
        assert_eq!(super::delays(&[5.0], 100.0, 2), [2]);
    }
}
