//! How long slerp takes into memory that exists already: `into_memory [TRACKS KEYS FRAMES]`.
//! Prints the seconds of the shortest of twenty runs; `python/bench.py` compares itself with it.

#![allow(clippy::disallowed_methods)] // poses to look at

use std::time::Instant;

use glam::Quat;
use tumble::{Device, Engine, FrameRate, Layout, OutputBuffer, SampleTimes, TrackSet, method};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let sizes: Result<Vec<u32>, _> = std::env::args().skip(1).map(|it| it.parse()).collect();
    let (tracks, keys, frames) = match sizes?[..] {
        [] => (4096, 26, 1200),
        [tracks, keys, frames] if keys > 1 && frames > 1 => (tracks, keys, frames),
        _ => return Err("give the numbers of tracks, keys and frames, or nothing".into()),
    };
    let times: Vec<f64> = (0..keys)
        .map(|key| 20.0 * f64::from(key) / f64::from(keys - 1))
        .collect();
    let key = |number: u32| {
        let number = number as f32;
        let axis = glam::Vec3::new((number * 0.7).sin(), (number * 1.3).cos(), 1.0).normalize();
        Quat::from_axis_angle(axis, number * 1.1)
    };
    let keys: Vec<Quat> = (0..tracks * keys).map(key).collect();
    let set = TrackSet::with_shared_times(&times, &keys)?;
    let engine = Engine::new(Device::Cpu)?;
    let frames_asked = SampleTimes::rate(FrameRate::new(u64::from(frames - 1), 20)?);
    let mut output = OutputBuffer::new((tracks * frames) as usize)?;
    let mut shortest = f64::INFINITY;
    for _ in 0..21 {
        let started = Instant::now();
        let layout = Layout::TrackMajor;
        engine.evaluate_into(&set, method::SLERP, &frames_asked, layout, &mut output)?;
        shortest = shortest.min(started.elapsed().as_secs_f64());
    }
    println!("{shortest}");
    Ok(())
}
