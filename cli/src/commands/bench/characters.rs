//! A crowd as games have it: characters that play few clips, each at a time of its own, beside a loop over glam.

use std::error::Error;

use fastrand::Rng;
use glam::{Quat, Vec3};
use rayon::prelude::*;
use tumble::crowd::{Crowd, CrowdLayer, CrowdLibrary, CrowdValues};
use tumble::{Device, Engine, Skeleton, TrackSet, VectorMethod, method};

use crate::commands::bench::device::BenchDevice;
use crate::commands::bench::race::{Contestant, Repetitions, race};
use crate::commands::bench::report::Section;
use crate::commands::bench::workload::{RATE, motion};

const CHARACTERS: usize = 10_000;
const JOINTS: usize = 60;
const CLIPS: usize = 8;
/// Keys of a track: two seconds at 30 Hz.
const KEYS: usize = 61;
/// The number of vectors of four numbers for a joint, if it is a matrix.
const ROWS: usize = 3;

/// Rotations and model matrices of all characters, at the next frame in each call.
pub(crate) fn measure(
    shrink: usize,
    devices: &[BenchDevice],
    repetitions: Repetitions,
) -> Result<Section, Box<dyn Error>> {
    let characters = (CHARACTERS / shrink).max(1);
    // One set has the tracks of all clips, clip by clip.
    let tracks = &motion(CLIPS * JOINTS, KEYS);
    let library = library(tracks)?;
    let starts = &starts(&library, characters);
    let mut contestants = vec![naive(tracks, starts, library.ticks_per_second())];
    let host = Engine::new(Device::Cpu)?;
    let engines = devices.iter().map(|device| &device.engine);
    for engine in std::iter::once(&host).chain(engines) {
        for (label, values) in [
            ("rotations", CrowdValues::Rotations),
            ("model matrices", CrowdValues::Model),
        ] {
            let mut crowd = crowd(engine, &library, starts)?;
            let name = format!("{}, {label}", engine.device_name());
            contestants.push(Contestant::new(name, move |output: &mut [Quat]| {
                crowd.advance(1.0 / RATE)?;
                let length = crowd.output_len(values);
                let output: &mut [[f32; 4]] = bytemuck::cast_slice_mut(&mut output[..length]);
                crowd.evaluate_into(values, output)?;
                Ok(Vec::new())
            }));
        }
    }
    let mut output = vec![Quat::IDENTITY; characters * JOINTS * ROWS];
    let rows = race(contestants, &mut output, repetitions)?;
    Ok(Section::of_characters(characters * JOINTS, rows))
}

/// A skeleton whose joints have up to two children, and the clips.
fn library(tracks: &TrackSet) -> Result<CrowdLibrary, Box<dyn Error>> {
    let parents = (0..JOINTS).map(|joint| joint.checked_sub(1).map(|before| before / 2));
    let skeleton = Skeleton::new(parents.collect(), vec![Vec3::new(0.0, 0.1, 0.0); JOINTS])?;
    let mut library = CrowdLibrary::new(&skeleton)?;
    for clip in 0..CLIPS {
        let mut set = TrackSet::new();
        for joint in 0..JOINTS {
            let track = tracks.track(clip * JOINTS + joint);
            set.push(format!("joint{joint}"), track.times, track.keys)?;
        }
        library.push(&set, method::SLERP, VectorMethod::Linear)?;
    }
    Ok(library)
}

/// The clip of each character, and the tick at which it begins.
fn starts(library: &CrowdLibrary, characters: usize) -> Vec<(usize, u32)> {
    let mut random = Rng::with_seed(7);
    let ticks = library.ticks(0).unwrap_or(1);
    (0..characters)
        .map(|_| (random.usize(..CLIPS), random.u32(..ticks)))
        .collect()
}

fn crowd(
    engine: &Engine,
    library: &CrowdLibrary,
    starts: &[(usize, u32)],
) -> Result<Crowd, Box<dyn Error>> {
    let mut crowd = engine.crowd(library, starts.len(), 1)?;
    for (instance, &(clip, tick)) in starts.iter().enumerate() {
        crowd.set(instance, 0, CrowdLayer::new(clip).at(tick.into()))?;
    }
    Ok(crowd)
}

/// Rotations by [`Quat::slerp`]. The keys are evenly spaced, so no interval is searched for.
fn naive<'a>(
    tracks: &'a TrackSet,
    starts: &'a [(usize, u32)],
    ticks_per_second: u32,
) -> Contestant<'a, Box<dyn Error>> {
    let keys: Vec<&[Quat]> = tracks.tracks().map(|track| track.keys).collect();
    let spans = KEYS - 1;
    let duration = tracks.track(0).times[spans];
    let mut call = 0u32;
    Contestant::new(
        "naive (glam, rayon), rotations",
        move |output: &mut [Quat]| {
            call += 1;
            let clock = f64::from(call) / RATE;
            let poses = output.par_chunks_exact_mut(JOINTS);
            poses.zip(starts).for_each(|(pose, &(clip, tick))| {
                let time = (f64::from(tick) / f64::from(ticks_per_second) + clock) % duration;
                let key = time / duration * spans as f64;
                let before = (key as usize).min(spans - 1);
                let t = (key - before as f64) as f32;
                for (rotation, keys) in pose.iter_mut().zip(&keys[clip * JOINTS..]) {
                    *rotation = keys[before].slerp(keys[before + 1], t);
                }
            });
            Ok(Vec::new())
        },
    )
}
