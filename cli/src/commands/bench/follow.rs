//! Bodies on paths, prepared and evaluated in bulk, compared with the usual way: double reflection (Wang et al. 2008)
//! from frame to frame.

use glam::{Mat3, Quat, Vec3};
use rayon::prelude::*;
use tumble::paths::Follow;
use tumble::{Channel, Device, Engine, Layout, Method};

use crate::commands::bench::device::BenchDevice;
use crate::commands::bench::race::{Contestant, Repetitions, race};
use crate::commands::bench::report::Section;
use crate::commands::bench::workload::{Workload, WorkloadKind};

pub(crate) fn measure(
    workload: &Workload,
    method: Method,
    devices: &[BenchDevice],
    repetitions: Repetitions,
) -> Result<Section, tumble::Error> {
    let count = workload.set.track_count() * workload.times.len();
    let mut output = vec![Quat::IDENTITY; count];
    let mut contestants: Vec<Contestant<'_, tumble::Error>> = vec![
        Contestant::new("host memory write rate", |output: &mut [Quat]| {
            output.fill(std::hint::black_box(Quat::IDENTITY));
            Ok(Vec::new())
        }),
        Contestant::new(
            "naive (double reflection, rayon)",
            |output: &mut [Quat]| {
                let rows = output.par_chunks_mut(workload.times.len()).enumerate();
                rows.for_each(|(track, row)| double_reflection(workload, track, row));
                Ok(Vec::new())
            },
        ),
    ];
    let follow = Follow::default();
    let cpu = Engine::new(Device::Cpu)?;
    let others = devices.iter().map(|device| device.engine.clone());
    for engine in std::iter::once(cpu).chain(others) {
        let follow = &follow;
        let name = format!("{}, from points", engine.device_name());
        contestants.push(Contestant::new(name, move |_: &mut [Quat]| {
            let (set, frames) = (&workload.set, &workload.frames);
            std::hint::black_box(engine.follow(set, follow, frames, Layout::TrackMajor)?);
            Ok(Vec::new())
        }));
    }
    let rows = race(contestants, &mut output, repetitions)?;
    Ok(Section::new(WorkloadKind::Follow, method, count, rows))
}

/// Frames of one path, each from the one before by two reflections.
fn double_reflection(workload: &Workload, track: usize, row: &mut [Quat]) {
    let Some(path) = workload.set.vector_keys(Channel::Translation, track) else {
        return;
    };
    let keys = path.keys;
    let last = keys.len() - 1;
    // At even key times, Bessel-Overhauser's slopes are those of Catmull-Rom.
    let inner = |i: usize| (keys[i + 1] - keys[i - 1]) * 0.5;
    let slope = |i: usize| match i {
        0 => (keys[1] - keys[0]) * 2.0 - inner(1),
        i if i == last => (keys[last] - keys[last - 1]) * 2.0 - inner(last - 1),
        i => inner(i),
    };
    let mut before: Option<(Vec3, Vec3, Vec3)> = None;
    for (rotation, &time) in row.iter_mut().zip(&workload.times) {
        let i = (time as usize).min(last - 1);
        let t = (time - i as f64) as f32;
        let (p0, p1, m0, m1) = (keys[i], keys[i + 1], slope(i), slope(i + 1));
        let (t2, t3) = (t * t, t * t * t);
        let position = p0 * (2.0 * t3 - 3.0 * t2 + 1.0)
            + m0 * (t3 - 2.0 * t2 + t)
            + p1 * (3.0 * t2 - 2.0 * t3)
            + m1 * (t3 - t2);
        let velocity = (p1 - p0) * (6.0 * t - 6.0 * t2)
            + m0 * (3.0 * t2 - 4.0 * t + 1.0)
            + m1 * (3.0 * t2 - 2.0 * t);
        let tangent = velocity.normalize_or(Vec3::Z);
        let up = match before {
            None => tangent.cross(Vec3::Y.cross(tangent)).normalize_or(Vec3::X),
            Some((from, direction, up)) => {
                let chord = position - from;
                let square = chord.length_squared().max(f32::MIN_POSITIVE);
                let up = up - chord * (2.0 / square * chord.dot(up));
                let direction = direction - chord * (2.0 / square * chord.dot(direction));
                let second = tangent - direction;
                let square = second.length_squared().max(f32::MIN_POSITIVE);
                up - second * (2.0 / square * second.dot(up))
            }
        };
        *rotation = Quat::from_mat3(&Mat3::from_cols(up.cross(tangent), up, tangent));
        before = Some((position, tangent, up));
    }
}
