//! NPZ and NPY: each layout is read, and written again.

mod damage;
mod layouts;
mod maps;
mod peers;
mod write;

use std::path::{Path, PathBuf};

use glam::{Quat, Vec3};
use tumble_formats::motion::{Motion, SampledClip};
use tumble_formats::npz::read_npz;
use tumble_formats::{Diagnostic, Loaded, ReadOptions};

/// A fixture's bytes.
fn fixture(name: &str) -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures");
    std::fs::read(folder.join(name)).unwrap()
}

/// A sample file's path, if the samples are there.
fn sample(name: &str) -> Option<PathBuf> {
    Some(crate::support::shared_data()?.join("npz").join(name))
}

fn read(bytes: Vec<u8>) -> Result<Loaded, Diagnostic> {
    read_npz("t.npz", bytes, &ReadOptions::default())
}

/// Options with a map.
fn mapped(map: &str) -> ReadOptions {
    ReadOptions {
        map: Some(map.to_owned()),
        ..ReadOptions::default()
    }
}

/// Keys of a clip at some of its frames, as samples.
struct Picked {
    times: Vec<f64>,
    rotations: Vec<Quat>,
    translations: Vec<Vec3>,
    scalars: Vec<f32>,
}

impl Picked {
    /// Each `step`th frame; each track is moved by another vector.
    fn of(clip: &Motion, step: usize) -> Self {
        let all = clip.set.track(0).times;
        let frames: Vec<usize> = (0..all.len()).step_by(step).collect();
        let tracks = 0..clip.set.track_count();
        let keys = |&frame: &usize| {
            let keys = tracks
                .clone()
                .map(move |track| clip.set.track(track).keys[frame]);
            keys.collect::<Vec<Quat>>()
        };
        let vectors = |&frame: &usize| {
            let vectors = tracks.clone();
            let vector = move |track: usize| Vec3::new(frame as f32, track as f32, 0.1);
            vectors.map(vector).collect::<Vec<Vec3>>()
        };
        Self {
            times: frames.iter().map(|&frame| all[frame]).collect(),
            rotations: frames.iter().flat_map(keys).collect(),
            translations: frames.iter().flat_map(vectors).collect(),
            scalars: (frames.iter())
                .flat_map(|&frame| {
                    let scalars = 0..clip.set.scalar_count();
                    scalars.map(move |index| clip.set.scalar(index).unwrap().keys[frame])
                })
                .collect(),
        }
    }

    fn sampled<'a>(&'a self, clip: &'a Motion) -> SampledClip<'a> {
        SampledClip {
            clip,
            times: &self.times,
            rate: None,
            rotations: &self.rotations,
            translations: &self.translations,
            scales: &[],
            scalars: &self.scalars,
            notes: &[],
            is_at_keys: false,
        }
    }
}
