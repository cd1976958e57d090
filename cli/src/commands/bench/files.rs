//! Motion files: the time to read clips, compared with the time to read only their bytes, and the time to sample them.

use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::sync::mpsc::sync_channel;
use std::thread;

use fastrand::Rng;
use glam::{Quat, Vec3};
use tumble::{Device, Engine, FrameRate, SampleTimes, TrackSet};
use tumble_formats::format::{MotionOptions, ReadOptions, WriteError};
use tumble_formats::motion::{ChannelInterpolation, Channels, Joint, Motion, Transform};
use tumble_formats::sample::{ChannelMethods, Samples};
use tumble_formats::{FORMATS, Format, Loaded};

use crate::commands::bench::race::{Contestant, Repetitions, TimeShare, race};
use crate::commands::bench::report::Section;
use crate::commands::bench::workload::{RATE, walk};
use crate::messages::exit::{ALL_INPUTS, Failure};

/// Clips of the library, joints of its skeleton, and frames of a clip: a small human's walk of
/// eight seconds.
const CLIPS: usize = 3000;
const JOINTS: usize = 22;
const FRAMES: usize = 240;

/// Frames a second that the clips are keyed at: half of those that they are resampled to.
const SOURCE_RATE: u32 = 30;

/// One section for each format that holds clips of several joints, of the same clips.
pub(crate) fn measure(shrink: usize, repetitions: Repetitions) -> Result<Vec<Section>, Failure> {
    let clips = (CLIPS / shrink).max(1);
    let mut random = Rng::with_seed(4);
    let keys = || walk(&mut random, FRAMES + clips - 1, 0.05);
    let joints: Vec<Vec<Quat>> = std::iter::repeat_with(keys).take(JOINTS).collect();
    let section = |format: &'static Format| {
        let folder = tempfile::tempdir().map_err(|error| Failure::writing("a folder", &error))?;
        let paths = library(format, &joints, clips, folder.path())?;
        paths
            .map(|paths| of_format(format, &paths, repetitions))
            .transpose()
    };
    let sections = FORMATS.iter().map(|&format| section(format));
    sections.filter_map(Result::transpose).collect()
}

/// Writes the clips: each begins a frame later in the walk than the one before. Nothing if the
/// format holds one joint.
fn library(
    format: &Format,
    walk: &[Vec<Quat>],
    clips: usize,
    folder: &Path,
) -> Result<Option<Vec<PathBuf>>, Failure> {
    let clip = skeleton(walk);
    let rate = Some(FrameRate::new(SOURCE_RATE.into(), 1).expect("a rate"));
    let times: Vec<f64> = (0..FRAMES)
        .map(|frame| frame as f64 / f64::from(SOURCE_RATE))
        .collect();
    let write = |first: usize| {
        let path = folder.join(format!("clip{first}.{}", format.name));
        let options = MotionOptions {
            name: path.display().to_string(),
            format: format.name.to_owned(),
            ..MotionOptions::default()
        };
        let frames = first..first + FRAMES;
        let joints = |frame: usize| walk.iter().map(move |keys| keys[frame]);
        let positions = |frame: usize| (0..JOINTS).map(move |joint| joint_position(joint, frame));
        let samples = Samples {
            times: times.clone(),
            rotations: frames.clone().flat_map(joints).collect(),
            translations: frames.flat_map(positions).collect(),
            scales: Vec::new(),
            scalars: Vec::new(),
        };
        let mut bytes = Vec::new();
        let written = format
            .writes_clips()
            .then(|| format.write_clips(&[samples.of(&clip, rate, &[])], &options, &mut bytes));
        let written = match written {
            None | Some(Err(WriteError::Refused(_))) => return Ok(None),
            Some(Err(WriteError::Io(error))) => Err(error),
            Some(Ok(_)) => std::fs::write(&path, bytes),
        };
        written.map_err(|error| Failure::writing(&options.name, &error))?;
        Ok(Some(path))
    };
    (0..clips).map(write).collect()
}

/// A chain of joints half a unit long, whose root walks.
fn skeleton(walk: &[Vec<Quat>]) -> Motion {
    let mut set = TrackSet::new();
    let keys = walk[0].len();
    let times: Vec<f64> = (0..keys)
        .map(|key| key as f64 / f64::from(SOURCE_RATE))
        .collect();
    for (joint, rotations) in walk.iter().enumerate() {
        let name = format!("joint{joint}");
        set.push(&name, &times, rotations)
            .expect("unit keys in order");
    }
    let positions: Vec<Vec3> = (0..keys).map(|frame| joint_position(0, frame)).collect();
    set.set_translations(0, &times, &positions, &[])
        .expect("a key for each time");
    let joint = |joint: usize| Joint {
        parent: joint.checked_sub(1),
        rest: Transform {
            translation: joint_position(joint, 0),
            ..Transform::default()
        },
    };
    let channels = Channels {
        rotation: Some(ChannelInterpolation::Linear),
        ..Channels::default()
    };
    let mut channels = vec![channels; walk.len()];
    channels[0].translation = Some(ChannelInterpolation::Linear);
    Motion {
        skeleton: (0..walk.len()).map(joint).collect(),
        channels,
        set,
        ..Motion::default()
    }
}

/// Where a joint is, relative to its parent.
fn joint_position(joint: usize, frame: usize) -> Vec3 {
    match joint {
        0 => Vec3::new((frame as f32 * 0.07).sin(), 1.0, frame as f32 * 0.03),
        _ => Vec3::new(0.0, 0.5, 0.0),
    }
}

fn of_format(
    format: &'static Format,
    paths: &[PathBuf],
    repetitions: Repetitions,
) -> Result<Section, Failure> {
    let options = ReadOptions::default();
    let engine = Engine::new(Device::Cpu).map_err(|error| refused(&error))?;
    let methods = ChannelMethods::AUTHORED;
    let read = |path: &Path| -> Result<Loaded, Failure> {
        format
            .open(path, &options)
            .map_err(|diagnostic| Failure::input(&diagnostic, ""))
    };
    let sample = |loaded: &Loaded| -> Result<(), Failure> {
        for clip in &loaded.clips {
            let samples = methods.sample(&engine, clip, &SampleTimes::fps(RATE as u32));
            black_box(samples.map_err(|error| refused(&error))?);
        }
        Ok(())
    };
    let mut contestants = vec![
        Contestant::new("reading the bytes", |_: &mut [Quat]| read_bytes(paths)),
        Contestant::new("reading the clips", |_: &mut [Quat]| {
            for path in paths {
                black_box(read(path)?);
            }
            Ok(Vec::new())
        }),
        Contestant::new("reading and resampling", |_: &mut [Quat]| {
            for path in paths {
                sample(&read(path)?)?;
            }
            Ok(Vec::new())
        }),
        // As in batches, a second thread reads the next file while the current one is resampled.
        Contestant::new("resampling while the next is read", |_: &mut [Quat]| {
            thread::scope(|scope| {
                let (hand_over, clips) = sync_channel(0);
                scope.spawn(move || {
                    paths.iter().all(|path| hand_over.send(read(path)).is_ok());
                });
                clips.iter().try_for_each(|loaded| sample(&loaded?))
            })?;
            Ok(Vec::new())
        }),
    ];
    if cfg!(target_os = "linux") {
        contestants.push(Contestant::new(
            "the bytes, from the disk",
            |_: &mut [Quat]| {
                forget(paths);
                read_bytes(paths)
            },
        ));
        contestants.push(Contestant::new(
            "the clips, from the disk",
            |_: &mut [Quat]| {
                forget(paths);
                for path in paths {
                    black_box(read(path)?);
                }
                Ok(Vec::new())
            },
        ));
    }
    let rows = race(contestants, &mut [], repetitions)?;
    let bytes = paths.iter().filter_map(|path| path.metadata().ok());
    let frames = (FRAMES - 1) * RATE as usize / SOURCE_RATE as usize + 1;
    let rotations = paths.len() * JOINTS * frames;
    let bytes = bytes.map(|file| file.len()).sum();
    Ok(Section::of_files(format.name, rotations, bytes, rows))
}

fn read_bytes(paths: &[PathBuf]) -> Result<Vec<TimeShare>, Failure> {
    for path in paths {
        let bytes = std::fs::read(path);
        let failure = |error| Failure::new(ALL_INPUTS, format!("{}: {error}", path.display()));
        black_box(bytes.map_err(failure)?);
    }
    Ok(Vec::new())
}

/// Asks the system to drop the cached pages of the files.
#[cfg(target_os = "linux")]
fn forget(paths: &[PathBuf]) {
    use rustix::fs::{Advice, fadvise};
    for file in paths
        .iter()
        .filter_map(|path| std::fs::File::open(path).ok())
    {
        // The system can only drop pages from its cache after they are written to the disk.
        let _ = file.sync_data();
        let _ = fadvise(&file, 0, None, Advice::DontNeed);
    }
}

#[cfg(not(target_os = "linux"))]
fn forget(_: &[PathBuf]) {}

fn refused(error: &tumble::Error) -> Failure {
    crate::arguments::device::refused(error)
}
