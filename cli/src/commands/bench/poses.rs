//! Compares requests and a sampler that evaluate one time for each call, as in a game or a controller, with a loop over
//! glam, on one thread.

use fastrand::Rng;
use glam::{Quat, Vec3};
use tumble::{Device, Engine, EngineOptions, Layout, Method, SampleTimes, method};

use crate::commands::bench::race::{Contestant, Repetitions, race};
use crate::commands::bench::report::Section;
use crate::commands::bench::workload::{MOTION_KEYS, RATE, motion};
use crate::commands::bench::{KEPT_FORMS, naive};

/// Calls of a measurement, each at a time of its own.
const CALLS: usize = 600;

/// A section for each method and number of tracks.
pub(crate) fn measure(
    shrink: usize,
    repetitions: Repetitions,
) -> Result<Vec<Section>, tumble::Error> {
    let mut sections = Vec::new();
    for method in [method::SLERP, method::BESSEL_OVERHAUSER] {
        for tracks in [1, 60, 1000] {
            let tracks = (tracks / shrink).max(1);
            sections.push(of_tracks(method, tracks, repetitions)?);
        }
    }
    Ok(sections)
}

fn of_tracks(
    method: Method,
    tracks: usize,
    repetitions: Repetitions,
) -> Result<Section, tumble::Error> {
    let set = &motion(tracks, MOTION_KEYS);
    let clip = &Engine::new(Device::Cpu)?.upload(set, method)?;
    let of_form = |kept_segments| {
        let mut options = EngineOptions::default();
        options.kept_segments = Some(kept_segments);
        Engine::with_options(Device::Cpu, &options)?.upload(set, method)
    };
    // Times between frames of the keys. At the keys, nothing would be evaluated.
    let played: &Vec<f64> = &(0..CALLS).map(|call| (call as f64 + 0.3) / RATE).collect();
    let mut shuffled = played.clone();
    Rng::with_seed(5).shuffle(&mut shuffled);
    let mut known = vec![(usize::MAX, [Vec3::ZERO; 3]); tracks];
    let mut contestants: Vec<Contestant<'_, tumble::Error>> = vec![
        Contestant::new("naive (glam), next times", |output: &mut [Quat]| {
            let mut cursors = naive::cursors(set);
            for &time in played {
                if method == method::SLERP {
                    naive::slerp_pose(&mut cursors, time, output);
                } else {
                    naive::cubic_pose(&mut cursors, time, &mut known, output);
                }
            }
            Ok(Vec::new())
        }),
        Contestant::new("evaluate_into, next times", |output: &mut [Quat]| {
            for &time in played {
                let frames = SampleTimes::at(vec![time]);
                clip.evaluate_into(&frames, Layout::TrackMajor, output)?;
            }
            Ok(Vec::new())
        }),
    ];
    for (form, kept_segments) in KEPT_FORMS {
        let clip = of_form(kept_segments)?;
        for (order, times) in [("next", played), ("any", &shuffled)] {
            let mut sampler = clip.sampler()?;
            let name = format!("sampler of {form}, {order} times");
            contestants.push(Contestant::new(name, move |output: &mut [Quat]| {
                for &time in times {
                    sampler.pose(time, output)?;
                }
                Ok(Vec::new())
            }));
        }
    }
    let mut output = vec![Quat::IDENTITY; tracks];
    let rows = race(contestants, &mut output, repetitions)?;
    Ok(Section::of_poses(method, tracks, tracks * CALLS, rows))
}
