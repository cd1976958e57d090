//! Clips of any format as new glTF files, read back by a few lines of their own.

mod content;
mod refusals;

use glam::{Quat, Vec3};
use serde_json::{Value, json};
use tumble::TrackSet;
use tumble_formats::format::MotionOptions;
use tumble_formats::gltf::write_new::write_new;
use tumble_formats::motion::{
    ChannelInterpolation, Channels, Joint, Motion, SampledClip, Transform,
};

/// A clip that owns its lists.
#[derive(Clone, Default)]
struct Clip {
    motion: Motion,
    times: Vec<f64>,
    rotations: Vec<Quat>,
    translations: Vec<Vec3>,
    scales: Vec<Vec3>,
}

impl Clip {
    fn sampled(&self) -> SampledClip<'_> {
        SampledClip {
            clip: &self.motion,
            times: &self.times,
            rate: None,
            rotations: &self.rotations,
            translations: &self.translations,
            scales: &self.scales,
            scalars: &[],
            notes: &[],
            is_at_keys: false,
        }
    }
}

fn rest(translation: [f32; 3], rotation: Quat, scale: f32) -> Transform {
    Transform {
        translation: translation.into(),
        rotation,
        scale: Vec3::splat(scale),
    }
}

/// Tracks whose keys do not matter: only the samples are written.
fn set(names: &[&str]) -> TrackSet {
    let mut set = TrackSet::new();
    for name in names {
        set.push(*name, &[0.0], &[Quat::IDENTITY]).unwrap();
    }
    set
}

/// A leg that is turned at rest and whose parents come after their children: the knee's scale and
/// the hip's translation move, the foot rests. One rotation has the other sign.
fn leg() -> Clip {
    let joint = |parent, rest| Joint { parent, rest };
    let rotation = Quat::from_rotation_z(0.5);
    let hip = rest([0.0, 1.0, 0.25], rotation, 1.0);
    let knee = rest([0.1, -0.5, 0.0], Quat::from_rotation_x(-0.25), 2.0);
    let foot = rest([0.0, -0.4, 0.0], Quat::IDENTITY, 1.0);
    let skeleton = vec![joint(Some(1), knee), joint(None, hip), joint(Some(0), foot)];
    let all = Some(ChannelInterpolation::Linear);
    let moved = Channels {
        rotation: all,
        translation: all,
        scale: all,
    };
    let motion = Motion {
        name: Some("Kick".to_owned()),
        set: set(&["knee", "hip", "foot"]),
        skeleton,
        channels: vec![moved, moved, Channels::default()],
        ..Motion::default()
    };
    let mut clip = Clip {
        motion,
        times: vec![0.25, 0.7, 1.1],
        ..Clip::default()
    };
    for sample in 0..3 {
        let angle = 0.3 * sample as f32;
        let sign = if sample == 1 { -1.0 } else { 1.0 };
        clip.rotations.extend([
            Quat::from_rotation_x(angle),
            Quat::from_rotation_y(angle) * sign,
            foot.rotation,
        ]);
        let down = Vec3::new(0.0, 0.01 * sample as f32, 0.0);
        clip.translations
            .extend([knee.translation, hip.translation - down, foot.translation]);
        clip.scales
            .extend([knee.scale + down, hip.scale, foot.scale]);
    }
    clip
}

/// Three cameras that have nothing to do with each other, two of one name; the second only turns.
fn cameras() -> Clip {
    let mut clip = Clip {
        motion: Motion {
            set: set(&["camera", "lens", "camera"]),
            ..Motion::default()
        },
        times: vec![0.0, 0.5],
        ..Clip::default()
    };
    for sample in 0..2 {
        clip.rotations.extend([Quat::from_rotation_z(0.1); 3]);
        let moved = Vec3::X * sample as f32;
        clip.translations.extend([moved, Vec3::ZERO, Vec3::ONE]);
    }
    clip
}

fn options(format: &str) -> MotionOptions {
    MotionOptions {
        name: "out".to_owned(),
        format: format.to_owned(),
        ..MotionOptions::default()
    }
}

fn written(clips: &[SampledClip<'_>], format: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    let warnings = write_new(clips, &options(format), &mut bytes).unwrap();
    assert_eq!(warnings, []);
    bytes
}

/// The JSON and the binary data of a GLB, with its stated lengths checked.
fn glb(bytes: &[u8]) -> (Value, Vec<u8>) {
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    assert_eq!(&bytes[..8], b"glTF\x02\0\0\0");
    assert_eq!(
        (word(8) as usize, &bytes[16..20]),
        (bytes.len(), &b"JSON"[..])
    );
    let end = 20 + word(12) as usize;
    assert_eq!((end % 4, &bytes[end + 4..end + 8]), (0, &b"BIN\0"[..]));
    assert_eq!(word(end) as usize, bytes.len() - end - 8);
    let json = serde_json::from_slice(&bytes[20..end]).unwrap();
    (json, bytes[end + 8..].to_vec())
}

fn integer(value: &Value) -> usize {
    value.as_u64().unwrap() as usize
}

/// The numbers of an accessor, which is f32, in a view without stride and without target.
fn numbers(json: &Value, binary: &[u8], accessor: &Value) -> Vec<f32> {
    let accessor = &json["accessors"][integer(accessor)];
    let view = &json["bufferViews"][integer(&accessor["bufferView"])];
    assert!(view.get("byteStride").is_none() && view.get("target").is_none());
    assert_eq!(
        (&accessor["componentType"], &view["buffer"]),
        (&json!(5126), &json!(0))
    );
    let width = match accessor["type"].as_str().unwrap() {
        "SCALAR" => 1,
        "VEC3" => 3,
        "VEC4" => 4,
        "MAT4" => 16,
        other => panic!("{other}"),
    };
    let [view_start, start] = [view, accessor].map(|of| of.get("byteOffset").map_or(0, integer));
    let length = 4 * width * integer(&accessor["count"]);
    assert_eq!((view_start % 4, start % 4), (0, 0));
    assert!(start + length <= integer(&view["byteLength"]));
    let bytes = &binary[view_start + start..][..length];
    let words = bytes.chunks_exact(4);
    words
        .map(|word| f32::from_le_bytes(word.try_into().unwrap()))
        .collect()
}

/// A channel of an animation.
struct Channel<'a> {
    node: usize,
    path: &'a str,
    interpolation: &'a str,
    times: Vec<f32>,
    values: Vec<f32>,
}

fn channels<'a>(json: &'a Value, binary: &[u8], animation: usize) -> Vec<Channel<'a>> {
    let animation = &json["animations"][animation];
    let channels = animation["channels"].as_array().unwrap().iter();
    let read = channels.map(|channel| {
        let sampler = &animation["samplers"][integer(&channel["sampler"])];
        Channel {
            node: integer(&channel["target"]["node"]),
            path: channel["target"]["path"].as_str().unwrap(),
            interpolation: sampler["interpolation"].as_str().unwrap_or("LINEAR"),
            times: numbers(json, binary, &sampler["input"]),
            values: numbers(json, binary, &sampler["output"]),
        }
    });
    read.collect()
}
