//! The page: what `web/` was built into, and the results in it.

use glam::Quat;
use serde::Serialize;
use tumble::{Encoding, METHODS, Method, TrackSet};

use crate::commands::view::pack::{differences, doubles};
use crate::messages::colours::{self, BOXES, Colour};

/// Built from `web/src` by `npm run build` there.
const HTML: &str = include_str!("../../../../web/dist/view.html");
const PLACE: &str = "/* DATA */";

/// What the page's scripts read.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Page<'a> {
    version: &'static str,
    device: &'a str,
    /// The method that is shown first.
    first: &'static str,
    box_colours: Vec<String>,
    methods: Vec<StoredMethod>,
    sets: Vec<StoredSet>,
}

#[derive(Serialize)]
struct StoredMethod {
    name: &'static str,
    summary: &'static str,
    colour: String,
}

/// One input.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct StoredSet {
    name: String,
    boxes: usize,
    length: f64,
    times: String,
    /// Whether all boxes have the same key times, which are stored once then.
    shared_keys: bool,
    key_counts: Vec<usize>,
    key_times: String,
    keys: String,
    results: Vec<StoredResult>,
}

/// What one method makes of it.
#[derive(Serialize)]
pub(crate) struct StoredResult {
    method: &'static str,
    /// `[sample][box][xyzw]`, to be divided by 32767.
    rotations: String,
    /// `[sample][box]`, to be divided by 65535 and multiplied with `fastest`, rad/s.
    speeds: String,
    fastest: f32,
}

impl StoredResult {
    /// Rotations and angular velocities, `[sample][box]`.
    pub(crate) fn new(
        method: Method,
        boxes: usize,
        rotations: &[Quat],
        velocities: &[Quat],
    ) -> Self {
        let speeds = || velocities.iter().map(|velocity| velocity.xyz().length());
        let fastest = speeds().fold(0.0, f32::max);
        let share = |speed: f32| match fastest {
            0.0 => 0,
            _ => (speed / fastest * 65535.0).round() as u16,
        };
        Self {
            method: method.name,
            rotations: differences(&short(rotations), 4 * boxes),
            speeds: differences(&speeds().map(share).collect::<Vec<u16>>(), boxes),
            fastest,
        }
    }
}

/// Components in 16 bits, as the engine stores them.
fn short(rotations: &[Quat]) -> Vec<u16> {
    let rotations: Vec<[f32; 4]> = rotations.iter().map(Quat::to_array).collect();
    let mut bytes = vec![0; rotations.len() * Encoding::Snorm16.bytes()];
    Encoding::Snorm16.encode(&rotations, &mut bytes);
    let pairs = bytes.chunks_exact(2);
    pairs
        .map(|pair| u16::from_le_bytes([pair[0], pair[1]]))
        .collect()
}

impl StoredSet {
    pub(crate) fn new(
        name: &str,
        (set, box_length): (&TrackSet, f64),
        times: &[f64],
        results: Vec<StoredResult>,
    ) -> Self {
        let first = set.track(0).times;
        let shared_keys = set.tracks().all(|track| track.times == first);
        let key_times: Vec<f64> = if shared_keys {
            first.to_vec()
        } else {
            set.tracks()
                .flat_map(|track| track.times.iter().copied())
                .collect()
        };
        let keys: Vec<Quat> = set
            .tracks()
            .flat_map(|track| track.keys.iter().copied())
            .collect();
        Self {
            name: name.to_owned(),
            boxes: set.track_count(),
            length: box_length,
            times: doubles(times),
            shared_keys,
            key_counts: if shared_keys {
                Vec::new()
            } else {
                set.tracks().map(|track| track.keys.len()).collect()
            },
            key_times: doubles(&key_times),
            keys: differences(&short(&keys), 4),
            results,
        }
    }
}

impl<'a> Page<'a> {
    /// The first of the methods is shown first.
    pub(crate) fn new(methods: &[Method], sets: Vec<StoredSet>, device: &'a str) -> Self {
        let stored = |method: &Method| StoredMethod {
            name: method.name,
            summary: method.summary,
            colour: css(colours::of_method(*method)),
        };
        Self {
            version: env!("CARGO_PKG_VERSION"),
            device,
            first: methods.first().map_or("", |method| method.name),
            box_colours: BOXES.map(css).to_vec(),
            methods: METHODS
                .iter()
                .filter(|method| methods.contains(method))
                .map(stored)
                .collect(),
            sets,
        }
    }

    pub(crate) fn html(&self) -> String {
        let data = serde_json::to_string(self).expect("names are strings and numbers are numbers");
        // Nothing in it may end the element that holds it.
        HTML.replacen(PLACE, &data.replace('<', "\\u003c"), 1)
    }
}

fn css([r, g, b]: Colour) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}
