//! The reader and the writer of glTF.

use std::path::Path;

use tumble::{Device, Engine, FrameRate, Interpolation, SampleTimes};
use tumble_formats::format::{MotionOptions, WriteError};
use tumble_formats::gltf::read_gltf;
use tumble_formats::sample::{ChannelMethods, Samples};
use tumble_formats::{Limits, ReadOptions};

use super::{location_is_inside, signature};

/// What is read is a valid set over a tree; sampled and written again it has as many clips.
pub(crate) fn gltf(bytes: &[u8]) -> u64 {
    let options = ReadOptions {
        limits: Limits {
            line: 4096,
            file: 65_536,
            memory: None,
        },
        ..ReadOptions::default()
    };
    let loaded = match read_gltf("fuzz", bytes.to_vec(), None, &options) {
        Ok(loaded) => loaded,
        Err(error) => {
            location_is_inside(bytes, &error);
            let hint: String = error.message.chars().rev().take(12).collect();
            return signature((error.code, hint));
        }
    };
    let engine = Engine::new(Device::Cpu).expect("the CPU");
    let methods = ChannelMethods {
        method: None,
        with: &|method| Interpolation::from(method),
    };
    let document = loaded.document.as_ref().expect("the file is kept");
    let rate = FrameRate::new(7, 1).expect("a rate");
    let mut sampled: Vec<Option<Samples>> = Vec::new();
    for clip in &loaded.clips {
        let tracks = clip.set.track_count();
        assert_eq!((clip.skeleton.len(), clip.channels.len()), (tracks, tracks));
        for track in clip.set.tracks() {
            assert!(track.times.windows(2).all(|pair| pair[0] < pair[1]));
            for key in track.keys {
                assert!((key.as_dquat().length() - 1.0).abs() < 1e-6, "{key}");
            }
        }
        let times = document.times(clip.index, rate).unwrap_or_default();
        let is_short = (1..500).contains(&times.len());
        sampled.push(is_short.then(|| {
            assert!(times.windows(2).all(|pair| pair[0] < pair[1]), "{times:?}");
            methods
                .sample(&engine, clip, &SampleTimes::at(times))
                .expect("unit keys in order")
        }));
    }
    let clips = loaded.clips.iter().zip(&sampled);
    let clips = clips.filter_map(|(clip, samples)| Some((clip, samples.as_ref()?)));
    let clips: Vec<_> = clips
        .map(|(clip, samples)| (clip.index, samples.of(clip, Some(rate), &[])))
        .collect();
    let mut outcomes = Vec::new();
    for name in ["/fuzz.glb", "/fuzz.gltf"] {
        let mut out = Vec::new();
        match document.write(&clips, &MotionOptions::default(), Path::new(name), &mut out) {
            Ok(warnings) => {
                let again = read_gltf("fuzz", out, None, &ReadOptions::default())
                    .expect("a written file is read again");
                assert_eq!(again.clips.len(), loaded.clips.len(), "{:?}", again.refused);
                outcomes.push(warnings.first().map(|warning| warning.code));
            }
            Err(WriteError::Refused(error)) => outcomes.push(Some(error.code)),
            Err(WriteError::Io(error)) => panic!("{error}"),
        }
    }
    let said = loaded.refused.iter().chain(&loaded.warnings);
    let codes: Vec<_> = said.map(|said| said.code).collect();
    signature((codes, outcomes, loaded.clips.len().min(3)))
}
