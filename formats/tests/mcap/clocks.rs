//! Times and names of the bodies of a log: stamps of 0, static transforms, robots with the same frames, clocks
//! that differ.

use std::fs;

use glam::Quat;
use tumble::{Channel, FrameRate};
use tumble_formats::mcap::read_mcap;
use tumble_formats::motion::{ChannelInterpolation, Motion};
use tumble_formats::path::{Pace, read_paths};
use tumble_formats::{Code, Diagnostic, Limits, Loaded, ReadOptions};

use crate::mcap::log::{LogBuilder, Message, transform};
use crate::support::shared_data;

const SECOND: u64 = 1_000_000_000;
/// When the logs are written: seconds since 1970.
const NOW: u64 = 1_700_000_000 * SECOND;
const TF: &str = "tf2_msgs/msg/TFMessage";
const POSE: &str = "geometry_msgs/msg/PoseStamped";

fn try_read(bytes: &[u8]) -> Result<Loaded, Diagnostic> {
    read_mcap("t", bytes, &ReadOptions::default())
}

fn read(bytes: &[u8]) -> Motion {
    let mut loaded = try_read(bytes).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((&*loaded.refused, &*loaded.warnings), (&[][..], &[][..]));
    loaded.clips.remove(0)
}

/// The times of a track, and its positions along x.
fn keys(clip: &Motion, name: &str) -> (Vec<f64>, Vec<f32>) {
    let index = clip.set.tracks().position(|track| track.name == Some(name));
    let index = index.unwrap_or_else(|| panic!("{name}"));
    let keys = clip.set.vector_keys(Channel::Translation, index).unwrap();
    assert_eq!(keys.times, clip.set.track(index).times);
    let x = keys.keys.iter().map(|at| at.x).collect();
    (keys.times.to_vec(), x)
}

fn names(clip: &Motion) -> Vec<String> {
    let tracks = 0..clip.set.track_count();
    tracks.map(|track| clip.set.track_name(track)).collect()
}

fn pose(stamp: u64, x: f64) -> Vec<u8> {
    Message::stamped(stamp, "map").pose(x, 0.1 * x).data()
}

#[test]
fn a_stamp_of_zero_is_a_time_where_others_have_stamps() {
    // The stamps are those of a simulation that begins at 0, not of the log's clock.
    let mut log = LogBuilder::new();
    let topic = log.topic("/sim", POSE, "cdr");
    for k in 0..4u32 {
        let at = u64::from(k) * SECOND / 10;
        log.message(topic, NOW + at, &pose(at, f64::from(k)));
    }
    let clip = read(&log.finish());
    assert_eq!(
        keys(&clip, "/sim"),
        (vec![0.0, 0.1, 0.2, 0.3], vec![0.0, 1.0, 2.0, 3.0])
    );
    assert_eq!(
        (clip.time_offset, clip.rate),
        (0, FrameRate::new(10, 1).ok())
    );
    // One topic has stamps of the log's clock, one of which is missing; the other topic has no
    // stamps.
    let mut log = LogBuilder::new();
    let (some, none) = (
        log.topic("/some", POSE, "cdr"),
        log.topic("/none", POSE, "cdr"),
    );
    for k in 0..4u32 {
        let at = NOW + u64::from(k) * SECOND / 10;
        log.message(some, at, &pose(if k == 2 { 0 } else { at }, f64::from(k)));
        log.message(none, at, &pose(0, f64::from(k)));
    }
    let clip = read(&log.finish());
    let expected = (vec![0.0, 0.1, 0.2, 0.3], vec![0.0, 1.0, 2.0, 3.0]);
    assert_eq!(keys(&clip, "/some"), expected);
    assert_eq!(keys(&clip, "/none"), expected);
    assert_eq!(clip.time_offset, 1_700_000_000);
}

/// Stamps of static transforms neither lengthen the clip nor say its rate.
#[test]
fn static_transforms_have_no_time() {
    let sim = 928 * SECOND;
    for (topic_name, stamp) in [
        ("/tf_static", 0),
        ("/tf_static", NOW - 7200 * SECOND + 5),
        ("/tf", 0),
    ] {
        let mut log = LogBuilder::new();
        let moving = log.topic("/tf", TF, "cdr");
        let fixed = log.topic(topic_name, TF, "cdr");
        log.message(fixed, NOW + 5, &transform(stamp, ["base", "lidar"], 2.0));
        for k in 0..10u32 {
            let at = u64::from(k) * SECOND / 10;
            log.message(
                moving,
                NOW + at,
                &transform(sim + at, ["odom", "base"], f64::from(k)),
            );
        }
        log.message(
            fixed,
            NOW + SECOND,
            &transform(stamp, ["base", "lidar"], 2.0),
        );
        let clip = read(&log.finish());
        assert_eq!(
            clip.set.time_span(),
            Some((928.0, 928.9)),
            "{topic_name} {stamp}"
        );
        assert_eq!(keys(&clip, "base/lidar"), (vec![928.0], vec![2.0]));
        assert_eq!(clip.rate, FrameRate::new(10, 1).ok());
        assert_eq!(clip.channels, []);
    }
    // Without other topics, static transforms have the time at which they were logged.
    let mut log = LogBuilder::new();
    let fixed = log.topic("/tf_static", TF, "cdr");
    log.message(fixed, NOW, &transform(0, ["a", "b"], 2.0));
    let clip = read(&log.finish());
    assert_eq!((keys(&clip, "a/b").0, clip.rate), (vec![0.0], None));
}

#[test]
fn a_static_transform_with_another_value_is_a_step() {
    for start in [NOW, 928 * SECOND] {
        let mut log = LogBuilder::new();
        let moving = log.topic("/tf", TF, "cdr");
        let fixed = log.topic("/tf_static", TF, "cdr");
        log.message(fixed, NOW - SECOND, &transform(0, ["base", "lidar"], 1.0));
        for k in 0..10u32 {
            let at = u64::from(k) * SECOND;
            log.message(
                moving,
                NOW + at,
                &transform(start + at, ["odom", "base"], f64::from(k)),
            );
            if k == 5 {
                log.message(fixed, NOW + at, &transform(0, ["base", "lidar"], 3.0));
            }
        }
        let clip = read(&log.finish());
        let first = clip.set.time_span().unwrap().0;
        let (times, x) = keys(&clip, "base/lidar");
        assert_eq!(
            (times, x),
            (vec![first, first + 5.0], vec![1.0, 3.0]),
            "{start}"
        );
        let step = Some(ChannelInterpolation::Step);
        let of = |name: &str| names(&clip).iter().position(|known| known == name).unwrap();
        let channels = clip.channel(of("base/lidar"));
        assert_eq!((channels.rotation, channels.translation), (step, step));
        assert_eq!(clip.channel(of("odom/base")).rotation, None);
    }
}

#[test]
fn the_topic_tells_robots_apart() {
    let mut log = LogBuilder::new();
    let robots = ["/robot1/tf", "/robot2/tf"].map(|name| log.topic(name, TF, "cdr"));
    let map = log.topic("/tf", TF, "cdr");
    for k in 0..4u64 {
        let at = NOW + k * SECOND;
        for (robot, sign) in robots.into_iter().zip([1.0, -1.0]) {
            log.message(
                robot,
                at,
                &transform(at, ["odom", "base_link"], sign * k as f64),
            );
        }
        log.message(map, at, &transform(at, ["map", "odom"], 7.0));
    }
    let clip = read(&log.finish());
    assert_eq!(
        names(&clip),
        [
            "/robot1/tf/odom/base_link",
            "/robot2/tf/odom/base_link",
            "map/odom"
        ]
    );
    let times = vec![0.0, 1.0, 2.0, 3.0];
    assert_eq!(
        keys(&clip, "/robot1/tf/odom/base_link"),
        (times.clone(), vec![0.0, 1.0, 2.0, 3.0])
    );
    assert_eq!(
        keys(&clip, "/robot2/tf/odom/base_link"),
        (times, vec![0.0, -1.0, -2.0, -3.0])
    );
}

#[test]
fn clocks_that_differ_are_told_and_one_that_was_set_back_is_refused() {
    let mut log = LogBuilder::new();
    let (sim, wall) = (
        log.topic("/sim", POSE, "cdr"),
        log.topic("/wall", POSE, "cdr"),
    );
    for k in 0..8u64 {
        log.message(sim, NOW + k, &pose((k + 1) * SECOND, 0.0));
        log.message(wall, NOW + k, &pose(NOW + k * SECOND, 0.0));
    }
    let loaded = try_read(&log.finish()).unwrap();
    let [warning] = &*loaded.warnings else {
        panic!("{:?}", loaded.warnings);
    };
    assert_eq!(warning.code, Code::McapClocks);
    assert!(
        warning
            .message
            .contains("`/sim` come from another clock than those of `/wall`")
    );
    let mut log = LogBuilder::new();
    let topic = log.topic("/sim", POSE, "cdr");
    for k in 0..8u64 {
        log.message(topic, NOW + k, &pose((k % 4 + 1) * SECOND + k, k as f64));
    }
    let fault = try_read(&log.finish()).unwrap_err();
    assert_eq!(fault.code, Code::TimeNotIncreasing);
    assert!(
        fault
            .message
            .contains("set back from 4.000000003 s to 1.000000004 s"),
        "{fault}"
    );
}

#[test]
fn poses_with_nan_are_left_out_if_asked() {
    let mut log = LogBuilder::new();
    let topic = log.topic("/loc", POSE, "cdr");
    for k in 0..5u64 {
        let at = NOW + k * SECOND;
        log.message(
            topic,
            at,
            &pose(at, if k == 2 { f64::NAN } else { k as f64 }),
        );
    }
    let bytes = log.finish();
    let fault = try_read(&bytes).unwrap_err();
    assert_eq!(fault.code, Code::NotFinite);
    assert!(
        fault
            .message
            .ends_with("or leave it out with --bridge-gaps"),
        "{fault}"
    );
    let options = ReadOptions {
        bridge_gaps: true,
        ..ReadOptions::default()
    };
    let loaded = read_mcap("t", &bytes, &options).unwrap();
    assert_eq!(keys(&loaded.clips[0], "/loc").0, [0.0, 1.0, 3.0, 4.0]);
    assert_eq!(loaded.warnings[0].code, Code::Bridged);
}

#[test]
fn orientations_are_tracks_without_positions() {
    let mut log = LogBuilder::new();
    let imu = log.topic("/imu", "sensor_msgs/msg/Imu", "cdr");
    let raw = log.topic("/raw", "sensor_msgs/msg/Imu", "cdr");
    let heading = log.topic("/heading", "geometry_msgs/msg/QuaternionStamped", "cdr");
    for k in 0..3u64 {
        let at = NOW + k * SECOND;
        let rotation = Message::stamped(at, "imu").numbers(&[0.0, 0.0, 0.6, 0.8]);
        log.message(
            heading,
            at,
            &Message::stamped(at, "imu")
                .numbers(&[0.6, 0.0, 0.0, 0.8])
                .data(),
        );
        log.message(
            imu,
            at,
            &rotation.numbers(&[0.01; 9 + 3 + 9 + 3 + 9]).data(),
        );
        let unknown = Message::stamped(at, "imu").numbers(&[0.0, 0.0, 0.0, 0.0, -1.0]);
        log.message(raw, at, &unknown.numbers(&[0.0; 8 + 24]).data());
    }
    let loaded = try_read(&log.finish()).unwrap();
    let clip = &loaded.clips[0];
    assert_eq!(names(clip), ["/heading", "/imu"]);
    assert_eq!(
        clip.set.track(0).keys[1],
        Quat::from_xyzw(0.6, 0.0, 0.0, 0.8)
    );
    assert_eq!(
        clip.set.track(1).keys[2],
        Quat::from_xyzw(0.0, 0.0, 0.6, 0.8)
    );
    assert!(clip.set.vector_keys(Channel::Translation, 1).is_none());
    let message = &loaded.warnings[0].message;
    assert!(
        message.contains("`/raw` (sensor_msgs/msg/Imu, whose covariance says: no orientation)"),
        "{message}"
    );
}

#[test]
fn what_a_log_has_is_told() {
    let mut log = LogBuilder::new();
    for (name, schema, encoding) in [
        ("/log", "std_msgs/msg/String", "cdr"),
        ("/old", "geometry_msgs/PoseStamped", "ros1"),
        ("/bare", "", "cdr"),
    ] {
        let topic = log.topic(name, schema, encoding);
        log.message(topic, NOW, b"");
    }
    let fault = try_read(&log.finish()).unwrap_err();
    assert_eq!(fault.code, Code::McapEmpty);
    let topics = "`/log` (std_msgs/msg/String), `/old` (geometry_msgs/PoseStamped, encoded as `ros1`), `/bare` (no type)";
    assert!(fault.message.contains(topics), "{fault}");
    assert!(
        fault.message.contains("convert messages of ROS 1"),
        "{fault}"
    );
    let mut log = LogBuilder::new();
    let topic = log.topic("/pose", POSE, "cdr");
    log.message(topic, NOW, b"\x28\xb5\x2f\xfd\x20");
    let fault = try_read(&log.finish()).unwrap_err();
    assert!(fault.message.contains("is compressed by zstd"), "{fault}");
    let mut log = LogBuilder::new();
    let topic = log.topic("/pose", POSE, "cdr");
    log.message(topic, NOW, &pose(NOW, 1.0));
    let loaded = try_read(&log.unfinished()).unwrap();
    assert_eq!(loaded.warnings[0].code, Code::McapCut);
}

fn path(stamps: impl Iterator<Item = u64>) -> Vec<u8> {
    let stamps: Vec<u64> = stamps.collect();
    let list = Message::stamped(NOW, "map").whole(stamps.len() as u32);
    let poses = stamps
        .into_iter()
        .enumerate()
        .fold(list, |list, (index, stamp)| {
            list.header(stamp, "map").pose(index as f64, 0.0)
        });
    poses.data()
}

#[test]
fn a_route_of_a_planner_has_no_times() {
    for stamp in [0, NOW] {
        let mut log = LogBuilder::new();
        let topic = log.topic("/plan", "nav_msgs/msg/Path", "cdr");
        log.message(topic, NOW, &path([stamp; 6].into_iter()));
        let bytes = log.finish();
        let fault = try_read(&bytes).unwrap_err();
        assert_eq!(fault.code, Code::McapRoute);
        assert!(fault.message.contains("6 poses has no times"), "{fault}");
        // The message can be read as a path for `follow`.
        let route = read_paths("t", "route", &bytes, Some(Pace::Seconds(10.0))).unwrap();
        let route = route.set.vector_keys(Channel::Translation, 0).unwrap();
        assert_eq!(route.times, [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
        assert_eq!(route.keys[5].x, 5.0);
    }
}

/// A path that grows is sent anew each time: only the last one takes memory.
#[test]
fn a_path_that_replaces_another_gives_its_memory_back() {
    let mut log = LogBuilder::new();
    let topic = log.topic("/path", "nav_msgs/msg/Path", "cdr");
    for count in 1..=100u64 {
        log.message(
            topic,
            NOW + count,
            &path((0..count).map(|k| NOW + k * SECOND)),
        );
    }
    // All of them together take 5050 poses of more than 200 bytes.
    let options = ReadOptions {
        limits: Limits {
            memory: Some(100_000),
            ..Limits::default()
        },
        ..ReadOptions::default()
    };
    let loaded = read_mcap("t", &log.finish(), &options).unwrap();
    assert_eq!(loaded.clips[0].set.track(0).keys.len(), 100);
}

/// Each chunk fits the budget; the work of all together has a limit too.
#[test]
fn the_sizes_of_all_chunks_have_a_limit() {
    let packed = chunk_of_zeros();
    let mut log = LogBuilder::new();
    for _ in 0..40 {
        log.record(6, &packed);
    }
    let options = ReadOptions {
        limits: Limits {
            memory: Some(1 << 20),
            ..Limits::default()
        },
        ..ReadOptions::default()
    };
    let fault = read_mcap("t", &log.finish(), &options).unwrap_err();
    assert_eq!(fault.code, Code::Memory);
    assert!(
        fault
            .message
            .starts_with("its chunks have more than 16777216 bytes"),
        "{fault}"
    );
}

/// A chunk of 512 KiB: one record of an unknown kind, in stored form, which claims nothing that is not there.
fn chunk_of_zeros() -> Vec<u8> {
    let length = 1usize << 19;
    let mut records = vec![0x80];
    records.extend(((length - 9) as u64).to_le_bytes());
    records.resize(length, 0);
    let mut chunk = [0; 16].to_vec();
    chunk.extend((length as u64).to_le_bytes());
    chunk.extend([0; 4]); // no checksum
    chunk.extend([0; 4]); // no compression
    chunk.extend((length as u64).to_le_bytes());
    chunk.extend(records);
    chunk
}

/// The logs of others, with the values of the project of MCAP and of evo.
#[test]
fn logs_of_others_have_their_values() {
    let Some(folder) = shared_data().map(|folder| folder.join("meaning")) else {
        return;
    };
    let file = |name: &str| fs::read(folder.join(name)).unwrap();
    let clip = read(&file("mcap-sim-time-zero/sim0.mcap"));
    let (times, x) = keys(&clip, "/odom");
    assert_eq!(
        (times.len(), times[0], times[19], x[0]),
        (20, 0.0, 1.9, 0.0)
    );
    let clip = read(&file("mcap-sim-static-tf/sim.mcap"));
    assert_eq!(clip.set.time_span(), Some((928.0, 928.9)));
    let clip = read(&file("mcap-static-tf-rate/tf.mcap"));
    assert_eq!(clip.rate, FrameRate::new(1, 1).ok());
    let clip = read(&file("mcap-namespaced-tf/two_robots.mcap"));
    for (robot, first, last, at) in [(1, 0.0, 1.9, 0.0), (2, 50.0, 48.1, 0.5)] {
        let (times, x) = keys(&clip, &format!("/robot{robot}/tf/odom/base_link"));
        assert_eq!((times.len(), times[0], x[0], x[19]), (20, at, first, last));
    }
    let clip = read(&file("mcap-messages/tf_static_changed.mcap"));
    let stepped = clip
        .channels
        .iter()
        .filter(|it| it.has(ChannelInterpolation::Step));
    assert!(stepped.count() > 0);
    let loaded = try_read(&file("mcap-messages/unfinished.mcap")).unwrap();
    assert_eq!(loaded.warnings[0].code, Code::McapCut);
    for (name, code) in [
        ("msgzstd", Code::McapMessage),
        ("noschema", Code::McapEmpty),
        ("ros1", Code::McapEmpty),
        ("path_nostamp", Code::McapRoute),
    ] {
        let fault = try_read(&file(&format!("mcap-messages/{name}.mcap"))).unwrap_err();
        assert_eq!(fault.code, code, "{name}");
    }
}
