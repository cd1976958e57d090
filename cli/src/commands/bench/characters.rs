//! Compares a crowd as in games (characters that play few clips, each at a different time) with a loop over glam.

use std::error::Error;

use fastrand::Rng;
use glam::{Affine3A, Quat, Vec3};
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
/// Of each joint, from its parent.
const OFFSET: Vec3 = Vec3::new(0.0, 0.1, 0.0);
/// The number of vectors of four numbers for a joint, if it is a matrix.
const ROWS: usize = 3;

/// The outputs, each of which all contestants of a race compute.
const OUTPUTS: [(&str, CrowdValues); 2] = [
    ("rotations", CrowdValues::Rotations),
    ("model matrices", CrowdValues::Model),
];

/// Rotations, and then model matrices, of all characters, at the next frame in each call.
pub(crate) fn measure(
    shrink: usize,
    devices: &[BenchDevice],
    repetitions: Repetitions,
) -> Result<Vec<Section>, Box<dyn Error>> {
    let characters = (CHARACTERS / shrink).max(1);
    // One set has the tracks of all clips, clip by clip.
    let tracks = &motion(CLIPS * JOINTS, KEYS);
    let library = library(tracks)?;
    let starts = &starts(&library, characters);
    let clips = &NaiveClips::new(tracks, library.ticks_per_second());
    let host = Engine::new(Device::Cpu)?;
    let mut output = vec![Quat::IDENTITY; characters * JOINTS * ROWS];
    let mut sections = Vec::new();
    for (label, values) in OUTPUTS {
        let mut call = 0u32;
        let naive = Contestant::<'_, Box<dyn Error>>::new(
            "naive (glam, rayon)",
            move |output: &mut [Quat]| {
                call += 1;
                let clock = f64::from(call) / RATE;
                match values {
                    CrowdValues::Rotations => clips.rotations(starts, clock, output),
                    _ => clips.model_matrices(starts, clock, output),
                }
                Ok(Vec::new())
            },
        );
        let mut contestants = vec![naive];
        let engines = devices.iter().map(|device| &device.engine);
        for engine in std::iter::once(&host).chain(engines) {
            let mut crowd = crowd(engine, &library, starts)?;
            contestants.push(Contestant::new(
                engine.device_name(),
                move |output: &mut [Quat]| {
                    crowd.advance(1.0 / RATE)?;
                    evaluate(&mut crowd, values, output)?;
                    Ok(Vec::new())
                },
            ));
        }
        let rows = race(contestants, &mut output, repetitions)?;
        let count = characters * JOINTS;
        sections.push(Section::of_characters(label, count, rows));
    }
    Ok(sections)
}

/// The output of a crowd at its clock's time.
fn evaluate(
    crowd: &mut Crowd,
    values: CrowdValues,
    output: &mut [Quat],
) -> Result<(), Box<dyn Error>> {
    let length = crowd.output_len(values);
    crowd.evaluate_into(values, bytemuck::cast_slice_mut(&mut output[..length]))?;
    Ok(())
}

/// The parent of a joint, which has up to two children.
fn parent(joint: usize) -> Option<usize> {
    joint.checked_sub(1).map(|before| before / 2)
}

/// A skeleton whose joints have up to two children, and the clips.
fn library(tracks: &TrackSet) -> Result<CrowdLibrary, Box<dyn Error>> {
    let parents = (0..JOINTS).map(parent);
    let skeleton = Skeleton::new(parents.collect(), vec![OFFSET; JOINTS])?;
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

/// The loop that a user would write: the keys of all clips, which are evenly spaced, so that no interval is searched for.
struct NaiveClips<'a> {
    /// Of the joints of all clips, clip by clip.
    keys: Vec<&'a [Quat]>,
    ticks_per_second: f64,
    /// Seconds.
    duration: f64,
}

impl<'a> NaiveClips<'a> {
    fn new(tracks: &'a TrackSet, ticks_per_second: u32) -> Self {
        Self {
            keys: tracks.tracks().map(|track| track.keys).collect(),
            ticks_per_second: f64::from(ticks_per_second),
            duration: tracks.track(0).times[KEYS - 1],
        }
    }

    /// The rotations of the joints of a character by [`Quat::slerp`], at a time after the start of the crowd.
    fn pose(&self, (clip, tick): (usize, u32), clock: f64) -> impl Iterator<Item = Quat> {
        let spans = KEYS - 1;
        let time = (f64::from(tick) / self.ticks_per_second + clock) % self.duration;
        let key = time / self.duration * spans as f64;
        let before = (key as usize).min(spans - 1);
        let t = (key - before as f64) as f32;
        let joints = self.keys[clip * JOINTS..][..JOINTS].iter();
        joints.map(move |keys| keys[before].slerp(keys[before + 1], t))
    }

    /// `[character][joint]`.
    fn rotations(&self, starts: &[(usize, u32)], clock: f64, output: &mut [Quat]) {
        let poses = output.par_chunks_exact_mut(JOINTS).zip(starts);
        poses.for_each(|(pose, &start)| {
            for (rotation, found) in pose.iter_mut().zip(self.pose(start, clock)) {
                *rotation = found;
            }
        });
    }

    /// `[character][joint][row]`.
    fn model_matrices(&self, starts: &[(usize, u32)], clock: f64, output: &mut [Quat]) {
        let poses = output.par_chunks_exact_mut(JOINTS * ROWS).zip(starts);
        poses.for_each(|(pose, &start)| {
            let mut model = [Affine3A::IDENTITY; JOINTS];
            for (joint, rotation) in self.pose(start, clock).enumerate() {
                let local = Affine3A::from_rotation_translation(rotation, OFFSET);
                model[joint] = parent(joint).map_or(local, |parent| model[parent] * local);
            }
            for (rows, matrix) in pose.chunks_exact_mut(ROWS).zip(&model) {
                let columns = matrix.to_cols_array();
                for (row, vector) in rows.iter_mut().enumerate() {
                    *vector = Quat::from_array([0, 3, 6, 9].map(|column| columns[column + row]));
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The ratios mean something only if the loop computes what the crowd computes.
    #[test]
    fn the_loop_and_the_crowd_compute_the_same() {
        let tracks = motion(CLIPS * JOINTS, KEYS);
        let library = library(&tracks).unwrap();
        let starts = starts(&library, 3);
        let clips = NaiveClips::new(&tracks, library.ticks_per_second());
        let engine = Engine::new(Device::Cpu).unwrap();
        let mut crowd = crowd(&engine, &library, &starts).unwrap();
        crowd.advance(1.0 / RATE).unwrap();
        let count = starts.len() * JOINTS;
        let mut found = vec![Quat::IDENTITY; count];
        let mut expected = found.clone();
        evaluate(&mut crowd, CrowdValues::Rotations, &mut found).unwrap();
        clips.rotations(&starts, 1.0 / RATE, &mut expected);
        for (found, expected) in found.iter().zip(&expected) {
            assert!(found.dot(*expected).abs() > 0.9999, "{found} {expected}");
        }
        let mut found = vec![Quat::IDENTITY; count * ROWS];
        let mut expected = found.clone();
        evaluate(&mut crowd, CrowdValues::Model, &mut found).unwrap();
        clips.model_matrices(&starts, 1.0 / RATE, &mut expected);
        for (found, expected) in found.iter().zip(&expected) {
            let apart = (*found - *expected).to_array();
            let apart = apart
                .into_iter()
                .fold(0.0, |largest: f32, it| largest.max(it.abs()));
            assert!(apart < 0.01, "{found} {expected}");
        }
    }
}
