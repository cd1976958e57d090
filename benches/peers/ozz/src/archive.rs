//! An animation in the format of ozz-animation 0.16 (version 7), as its builder makes it from keys at equal distances
//! without its optimizer.
//!
//! Keys of all joints are in the order in which a job needs them: by the time of the key before, then by the joint. Each
//! has the index of its time, and the distance to its joint's key before. At intervals of about a second, the format
//! has the newest key of every joint, so that a job can start there instead of at the first key.

use glam::Quat;

use crate::Motion;

const VERSION: u32 = 7;
/// The largest whole number of a component, which has 15 bits.
const LARGEST: f32 = 32_767.0;

/// The newest keys of all joints at some times.
struct Entries {
    bytes: Vec<u8>,
    /// For each of the times: where its bytes begin, and the index of the newest key of all.
    starts: Vec<u32>,
    /// The distance of the times, as a part of the duration.
    distance: f32,
}

pub fn of_motion(motion: &Motion) -> Vec<u8> {
    let (tracks, keys) = (motion.tracks, motion.keys_per_track);
    assert!(tracks % 4 == 0, "joints in whole vectors");
    assert!((256..65_536).contains(&keys), "indices of times in 16 bits");
    let rotations = Entries::of_keys(tracks, keys, motion.duration());
    // A translation and a scale at the start and at the end are enough.
    let constants = 2 * tracks;

    let mut bytes = vec![1]; // Little-endian.
    bytes.extend_from_slice(b"ozz-animation\0");
    let mut words = |words: &[u32]| {
        words
            .iter()
            .for_each(|word| bytes.extend(word.to_le_bytes()))
    };
    words(&[VERSION, (motion.duration() as f32).to_bits(), tracks as u32]);
    let name = 0;
    words(&[name, keys as u32]);
    words(&[constants, tracks * keys, constants].map(|count| count as u32));
    words(&[0, 0]);
    words(&[rotations.bytes.len(), rotations.starts.len()].map(|count| count as u32));
    words(&[0, 0]);

    let times = (0..keys).map(|key| key as f32 / (keys - 1) as f32);
    times.for_each(|time| bytes.extend(time.to_le_bytes()));
    let none = Entries {
        bytes: Vec::new(),
        starts: Vec::new(),
        distance: 1.0,
    };
    let both_ends = [0, keys - 1];
    let half_precision = |value: u16| [value; 3].map(u16::to_le_bytes).concat();
    put_control(&mut bytes, tracks, &both_ends, &none);
    bytes.extend(half_precision(0).repeat(constants));
    put_control(&mut bytes, tracks, &Vec::from_iter(0..keys), &rotations);
    // The signs of each track, so that neighbours are less than half a turn apart.
    let mut before: Vec<Quat> = vec![Quat::IDENTITY; tracks];
    for key in 0..keys {
        for (track, before) in before.iter_mut().enumerate() {
            let value = motion.keys[track * keys + key];
            *before = if before.dot(value) < 0.0 {
                -value
            } else {
                value
            };
            bytes.extend(packed(*before));
        }
    }
    put_control(&mut bytes, tracks, &both_ends, &none);
    let one = 0x3c00;
    bytes.extend(half_precision(one).repeat(constants));
    bytes
}

/// The indices of the times of all keys, and how far each is from its joint's key before.
fn put_control(bytes: &mut Vec<u8>, tracks: usize, times: &[usize], entries: &Entries) {
    for &time in times {
        bytes.extend((time as u16).to_le_bytes().repeat(tracks));
    }
    for index in 0..times.len() {
        let distance = if index == 0 { 0 } else { tracks as u16 };
        bytes.extend(distance.to_le_bytes().repeat(tracks));
    }
    bytes.extend_from_slice(&entries.bytes);
    let starts = entries.starts.iter().flat_map(|start| start.to_le_bytes());
    bytes.extend(starts);
    bytes.extend(entries.distance.to_le_bytes());
}

impl Entries {
    fn of_keys(tracks: usize, keys: usize, duration: f64) -> Self {
        let count = (duration as usize).max(1);
        let (mut bytes, mut starts) = (Vec::new(), Vec::new());
        for part in 1..=count {
            // The key that ends the interval at this time.
            let newest = ((keys - 1) * part / count + 1).min(keys - 1);
            starts.push(bytes.len() as u32);
            starts.push((tracks * (newest + 1) - 1) as u32);
            let of_tracks: Vec<u32> = (0..tracks)
                .map(|track| (tracks * newest + track) as u32)
                .collect();
            of_tracks
                .chunks_exact(4)
                .for_each(|four| put_four(four, &mut bytes));
        }
        Self {
            bytes,
            starts,
            distance: 1.0 / count as f32,
        }
    }
}

/// Four numbers, each in as many bytes as it needs; two bits for each say how many.
fn put_four(four: &[u32], bytes: &mut Vec<u8>) {
    let sizes = [0, 1, 2, 3].map(|i| (4 - four[i].leading_zeros() as usize / 8).max(1));
    let tag = (0..4).fold(0, |tag, i| tag | ((sizes[i] - 1) << (2 * i)));
    bytes.push(tag as u8);
    for (number, size) in four.iter().zip(sizes) {
        bytes.extend_from_slice(&number.to_le_bytes()[..size]);
    }
}

/// The three smaller components in 15 bits each, which one is missing, and its sign.
fn packed(key: Quat) -> [u8; 6] {
    let components = key.to_array();
    let missing = (0..4)
        .max_by(|&a, &b| components[a].abs().total_cmp(&components[b].abs()))
        .expect("four components");
    let mut word = missing as u64 | u64::from(components[missing] < 0.0) << 2;
    let others = (0..4).filter(|&component| component != missing);
    for (index, component) in others.enumerate() {
        let half = std::f32::consts::FRAC_1_SQRT_2;
        let whole = (components[component] + half) * (LARGEST / std::f32::consts::SQRT_2) + 0.5;
        word |= u64::from(whole.min(LARGEST) as u16) << (3 + 15 * index);
    }
    word.to_le_bytes()[..6].try_into().expect("six bytes")
}
