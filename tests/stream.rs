//! Results in chunks: the same bits as in one piece, in order, and nothing left out.

use crate::support::{first_difference, hostile_set, vulkan_devices};
use glam::Quat;
use tumble::{Device, Engine, Error, Frames, Layout, METHODS, method};

fn devices() -> Vec<Device> {
    [vec![Device::Cpu], vulkan_devices()].concat()
}

/// What a file of the chunks would hold.
#[derive(Default)]
struct Collected {
    rotations: Vec<Quat>,
    chunks: usize,
    largest: usize,
}

impl Collected {
    fn take(&mut self, chunk: &tumble::Chunk<'_>) {
        assert_eq!(chunk.start, self.rotations.len());
        assert_eq!(
            chunk.rotations.len(),
            chunk.tracks.len() * chunk.samples.len()
        );
        self.rotations.extend_from_slice(chunk.rotations);
        self.chunks += 1;
        self.largest = self.largest.max(chunk.rotations.len());
    }
}

#[test]
fn chunks_are_the_whole_in_order() {
    let set = hostile_set(5, 24);
    let explicit = (0..700).map(|i| 0.01 * f64::from((i * 37) % 700)).collect();
    let requests = [Frames::fps(60).between(-1.0, 20.0), Frames::at(explicit)];
    for device in devices() {
        let engine = Engine::new(device).unwrap();
        for method in METHODS {
            let clip = engine.upload(&set, method).unwrap();
            for frames in &requests {
                for layout in [Layout::TrackMajor, Layout::FrameMajor] {
                    let whole = clip.evaluate_as(frames, layout).unwrap();
                    for limit in [100, 1000, 5000, usize::MAX] {
                        let what = format!("{method}, {layout:?}, {limit}");
                        let mut of_clip = Collected::default();
                        clip.stream(frames, layout, limit, |chunk| {
                            of_clip.take(&chunk);
                            Ok::<(), Error>(())
                        })
                        .unwrap();
                        let mut of_set = Collected::default();
                        engine
                            .stream(&set, method, frames, layout, limit, |chunk| {
                                of_set.take(&chunk);
                                Ok::<(), Error>(())
                            })
                            .unwrap();
                        for found in [of_clip, of_set] {
                            assert!(found.largest <= limit, "{what}");
                            assert!(found.chunks > 1 || limit == usize::MAX, "{what}");
                            let difference = first_difference(whole.as_quats(), &found.rotations);
                            assert_eq!(difference, None, "{what}");
                        }
                    }
                }
            }
        }
    }
}

#[derive(Debug)]
enum Stop {
    Enough,
    Engine(Error),
}

impl From<Error> for Stop {
    fn from(error: Error) -> Self {
        Self::Engine(error)
    }
}

/// Catches a stream that goes on, or hangs, after its sink has failed.
#[test]
fn a_sink_that_fails_ends_the_stream() {
    let set = hostile_set(6, 16);
    for device in devices() {
        let engine = Engine::new(device).unwrap();
        let mut taken = 0;
        let frames = Frames::fps(120).between(0.0, 10.0);
        let result = engine.stream(
            &set,
            method::SLERP,
            &frames,
            Layout::TrackMajor,
            1500,
            |_| {
                taken += 1;
                if taken == 3 {
                    Err(Stop::Enough)
                } else {
                    Ok(())
                }
            },
        );
        assert!(matches!(result, Err(Stop::Enough)));
        assert_eq!(taken, 3);
    }
}

#[test]
fn what_cannot_be_evaluated_is_an_error_before_any_chunk() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let frames = Frames::at(vec![0.0, f64::NAN]);
    let result = engine.stream(
        &hostile_set(7, 4),
        method::SLERP,
        &frames,
        Layout::TrackMajor,
        10,
        |_| Err(Stop::Enough),
    );
    assert!(matches!(result, Err(Stop::Engine(Error::Frames(_)))));
}
