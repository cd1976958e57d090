//! Paths are followed together.

use glam::{DVec3, Vec3};

use super::*;
use crate::path::options::PathSpeed;
use crate::simd::dispatch::tests::same_at_every_width;
use crate::time::spans::Part;

/// Of each span of each track when it starts, and the numbers that give its values.
type Values = Vec<Vec<(u64, Vec<[u32; 4]>)>>;

fn values(set: &TrackSet, tracks: Range<usize>, follow: &Follow) -> [Values; 2] {
    let interpolation = Interpolation {
        quantity: Quantity::Velocity(Axes::Parent),
        ..BESSEL_OVERHAUSER.into()
    };
    let (own, _) = prepared(set, tracks, follow, [&interpolation; 2]).unwrap();
    own.map(|own| {
        let span = |span: usize| {
            let numbers = match own.spans.sources[span] {
                Source::Segment(i) => own.segments.polynomials[i as usize].coefficients.to_vec(),
                Source::Constant(i) => vec![own.constants[i as usize]],
                Source::Exact(_) => Vec::new(),
            };
            let bits = numbers.iter().map(|power| power.map(f32::to_bits));
            (own.spans.starts[span].to_bits(), bits.collect())
        };
        let part = |part: &Part| part.spans.clone().map(span).collect();
        own.parts.iter().map(part).collect()
    })
}

/// Catches lanes that mix up paths or pieces of them, and a vector width with bits of its own.
#[test]
fn paths_are_followed_together_as_alone() {
    let mut set = TrackSet::new();
    for track in 0..23u8 {
        let far = f32::from(track % 5);
        let point = |i: u8| {
            let t = f32::from(i) * (0.3 + 0.1 * far);
            // One stands still, and one goes to and fro.
            match track {
                7 => Vec3::ONE,
                8 => Vec3::X * f32::from(i % 2),
                _ => Vec3::new((3.0 * t).sin() * far, t, (t * t).cos()),
            }
        };
        let points: Vec<Vec3> = (0..2 + track).map(point).collect();
        let times: Vec<f64> = (0..2 + track).map(|i| 0.5 * f64::from(i)).collect();
        set.push_path("", &times, &points, &[]).unwrap();
    }
    let own = Follow::default();
    let (frame, speed) = (Frame::Fixed, PathSpeed::Constant);
    let direction = Direction::Point(DVec3::new(0.0, 2.0, 9.0));
    let axes = ["x", "-z"].map(|axis| axis.parse().unwrap());
    for follow in [
        own.clone(),
        Follow {
            axes,
            ..own.clone()
        },
        Follow {
            speed,
            ..own.clone()
        },
        Follow {
            frame,
            direction,
            ..own.clone()
        },
        Follow {
            frame: Frame::Frenet,
            ..own
        },
    ] {
        let together = same_at_every_width(|| values(&set, 0..23, &follow));
        for track in 0..23 {
            let alone = values(&set, track..track + 1, &follow);
            for (together, alone) in together.iter().zip(alone) {
                assert!(alone == together[track..=track], "{track}, {follow:?}");
            }
        }
    }
}
