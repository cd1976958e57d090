//! Compares smoothing long tracks with copying them.

use glam::{Quat, Vec3};
use rayon::prelude::*;
use tumble::{
    Device, Engine, Error, Layout, OutputBuffer, Rotations, Smoothing, SmoothingKernel, Vectors,
};

use crate::arguments::device::refused;
use crate::commands::bench::race::{Contestant, Repetitions, race};
use crate::commands::bench::report::Section;
use crate::commands::bench::workload::walk;
use crate::messages::exit::{self, Failure};

/// How many tracks.
const TRACKS: usize = 64;

/// Samples of each track: noise about a motion.
const SAMPLES: usize = 1_000_000;

pub(crate) fn measure(shrink: usize, repetitions: Repetitions) -> Result<Vec<Section>, Failure> {
    let samples = (SAMPLES / shrink).max(2);
    let count = TRACKS * samples;
    // All tracks have the same motion, because the duration of smoothing does not depend on the values.
    let motion = walk(&mut fastrand::Rng::with_seed(5), samples, 0.1);
    let mut rotations = OutputBuffer::new(count).map_err(no_memory)?;
    for track in rotations.chunks_exact_mut(samples) {
        track.copy_from_slice(&motion);
    }
    let rotations = Rotations::of(&rotations, TRACKS, Layout::TrackMajor).map_err(no_memory)?;
    let positions: Vec<Vec3> = rotations.as_quats().iter().map(|q| q.xyz()).collect();
    let vectors = Vectors::of(&positions, TRACKS, Layout::TrackMajor).map_err(no_memory)?;
    drop(positions);

    let engine = Engine::new(Device::Cpu).map_err(|error| refused(&error))?;
    let kernels = [SmoothingKernel::Linear, SmoothingKernel::Gaussian(2.0)];
    let one = |kernel| {
        let smoothing = Smoothing::new(kernel);
        let contestants: Vec<Contestant<'_, Error>> = vec![
            Contestant::new("copy into fresh memory (rayon)", |_: &mut [Quat]| {
                let mut copy = OutputBuffer::new(count)?;
                let pairs = copy
                    .par_chunks_mut(1 << 16)
                    .zip(rotations.as_quats().par_chunks(1 << 16));
                pairs.for_each(|(to, from)| to.copy_from_slice(from));
                std::hint::black_box(&copy);
                Ok(Vec::new())
            }),
            Contestant::new("vectors", |_: &mut [Quat]| {
                std::hint::black_box(engine.smooth_vectors(&vectors, &smoothing)?);
                Ok(Vec::new())
            }),
            Contestant::new("rotations", |_: &mut [Quat]| {
                std::hint::black_box(engine.smooth(&rotations, &smoothing)?);
                Ok(Vec::new())
            }),
        ];
        let rows = race(contestants, &mut [], repetitions).map_err(|error| refused(&error))?;
        Ok(Section::of_smoothing(kernel.to_string(), count, rows))
    };
    kernels.into_iter().map(one).collect()
}

fn no_memory(error: impl std::fmt::Display) -> Failure {
    Failure::new(exit::ALL_INPUTS, error.to_string())
}
