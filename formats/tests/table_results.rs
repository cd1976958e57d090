//! Results in Parquet, Arrow and CSV, read back: sampled clips, and results that are written in pieces.

use std::io::{self, Write};

use arrow_array::RecordBatch;
use arrow_array::cast::AsArray;
use arrow_array::types::{Float16Type, Float32Type, Float64Type, Int16Type, Int64Type};
use arrow_ipc::reader::FileReader;
use bytes::Bytes;
use glam::{Quat, Vec3};
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use tumble::{
    Channel, ComponentType, Encoding, FrameRate, Layout, MatrixOrder, SampleTimes, Timeline,
    TrackSet,
};
use tumble_formats::arrow::read_arrow;
use tumble_formats::csv::read::read_csv;
use tumble_formats::format::{MotionOptions, ResultShape, WriteError};
use tumble_formats::keyed::{keyed, keys_for};
use tumble_formats::motion::{Motion, SampledClip};
use tumble_formats::parquet::read_parquet;
use tumble_formats::poses::{Poses, TRANSFORM};
use tumble_formats::quaternion::ComponentOrder;
use tumble_formats::{Code, Diagnostic, Format, Loaded, ReadOptions};

fn read(format: &str, bytes: &[u8]) -> Result<Loaded, Diagnostic> {
    let options = ReadOptions::default();
    match format {
        "parquet" => read_parquet("t", bytes.to_vec(), &options),
        "arrow" => read_arrow("t", bytes.to_vec(), &options),
        _ => read_csv("t", bytes.to_vec(), &options),
    }
}

/// Rotations that differ, [frame][track].
fn rotations(count: usize) -> Vec<Quat> {
    let rotation = |i: usize| {
        let angles = [0.3, 0.17, 0.71].map(|step| (i as f32 * step).sin());
        Quat::from_scaled_axis(Vec3::from_array(angles))
    };
    (0..count).map(rotation).collect()
}

fn clip(name: Option<&str>, tracks: &[&str]) -> Motion {
    let mut set = TrackSet::new();
    for track in tracks {
        set.push(*track, &[0.0], &[Quat::IDENTITY]).unwrap();
    }
    Motion {
        name: name.map(str::to_owned),
        set,
        ..Motion::default()
    }
}

fn written(format: &str, clips: &[SampledClip<'_>]) -> Result<Vec<u8>, WriteError> {
    let mut bytes = Vec::new();
    let options = MotionOptions::default();
    let format = Format::named(format).unwrap();
    let warnings = format.write_clips(clips, &options, &mut bytes)?;
    let is_reported = |warning: &Diagnostic| warning.code == Code::NameChanged;
    assert!(warnings.iter().all(is_reported), "{warnings:?}");
    Ok(bytes)
}

#[test]
fn sampled_clips_come_back_bit_for_bit() {
    let motion = clip(None, &["hip", "knee", "hip"]);
    let times: Vec<f64> = (0..50).map(|frame| f64::from(frame) / 30.0).collect();
    let quats = rotations(150);
    let moved: Vec<Vec3> = (0..150).map(|i| Vec3::new(i as f32, -0.1, 1e-7)).collect();
    let scaled: Vec<Vec3> = (0..150).map(|i| Vec3::splat(1.0 + i as f32)).collect();
    let sampled = SampledClip {
        clip: &motion,
        times: &times,
        rate: FrameRate::new(30, 1).ok(),
        rotations: &quats,
        translations: &moved,
        scales: &scaled,
        scalars: &[],
        notes: &[("method", "slerp".to_owned())],
        is_at_keys: false,
    };
    for format in ["parquet", "arrow", "csv"] {
        let bytes = written(format, std::slice::from_ref(&sampled)).unwrap();
        let loaded = read(format, &bytes).unwrap();
        assert!(loaded.warnings.is_empty() && loaded.clips.len() == 1);
        let found = &loaded.clips[0];
        assert_eq!(
            (found.name.as_deref(), found.rate),
            (None, sampled.rate),
            "{format}"
        );
        let names: Vec<String> = (0..3).map(|track| found.set.track_name(track)).collect();
        assert_eq!(names, ["hip", "knee", "hip#2"]);
        for track in 0..3 {
            let keys = found.set.track(track);
            assert_eq!(keys.times, times);
            let vectors = |channel| found.set.vector_keys(channel, track).unwrap().keys;
            for frame in 0..50 {
                let index = frame * 3 + track;
                assert_eq!(keys.keys[frame], quats[index], "{format}: {index}");
                assert_eq!(vectors(Channel::Translation)[frame], moved[index]);
                assert_eq!(vectors(Channel::Scale)[frame], scaled[index]);
            }
        }
    }
}

#[test]
fn several_clips_are_told_apart_and_have_row_groups_of_their_own() {
    let motions = [clip(Some("walk"), &["hip", "knee"]), clip(None, &["knee"])];
    let (times, quats) = ([0.0, 0.5, 0.75], rotations(6));
    let sampled = |motion, tracks: usize, method: &'static str| SampledClip {
        clip: motion,
        times: &times,
        rate: None,
        rotations: &quats[..3 * tracks],
        translations: &[],
        scales: &[],
        scalars: &[],
        notes: match method {
            "slerp" => &NOTES[..1],
            _ => &NOTES[1..],
        },
        is_at_keys: false,
    };
    let clips = [
        sampled(&motions[0], 2, "slerp"),
        sampled(&motions[1], 1, "cubic"),
    ];
    for format in ["parquet", "arrow"] {
        let bytes = written(format, &clips).unwrap();
        let loaded = read(format, &bytes).unwrap();
        let shape = |clip: &Motion| {
            (
                clip.name.clone().unwrap(),
                clip.set.track_count(),
                clip.index,
            )
        };
        let shapes: Vec<_> = loaded.clips.iter().map(shape).collect();
        assert_eq!(
            shapes,
            [("walk".to_owned(), 2, 0), ("clip1".to_owned(), 1, 1)]
        );
        assert_eq!(loaded.clips[1].set.track(0).keys, &quats[..3]);
        assert_eq!(loaded.clips[1].set.track_name(0), "knee");
    }
    let bytes = Bytes::from(written("parquet", &clips).unwrap());
    let reader = ParquetRecordBatchReaderBuilder::try_new(bytes).unwrap();
    assert_eq!(reader.metadata().num_row_groups(), 2);
    let notes = reader
        .metadata()
        .file_metadata()
        .key_value_metadata()
        .unwrap();
    let note = |key: &str| {
        let found = notes.iter().find(|note| note.key == key);
        found.and_then(|note| note.value.as_deref())
    };
    assert_eq!(
        (note("method"), note("method.1")),
        (Some("slerp"), Some("cubic"))
    );
    let Err(WriteError::Refused(error)) = written("csv", &clips) else {
        panic!()
    };
    assert_eq!(error.code, Code::SeveralClips);
}

static NOTES: std::sync::LazyLock<[(&str, String); 2]> = std::sync::LazyLock::new(|| {
    [
        ("method", "slerp".to_owned()),
        ("method", "cubic".to_owned()),
    ]
});

/// Times that count from 1970 are written as they are, and a clip without samples is refused.
#[test]
fn offsets_of_times_are_written_and_lists_of_other_lengths_are_not() {
    let motion = Motion {
        time_offset: 1_403_636_579,
        ..clip(None, &["hip"])
    };
    let sampled = SampledClip {
        clip: &motion,
        times: &[0.5, 1.25],
        rate: None,
        rotations: &rotations(2),
        translations: &[],
        scales: &[],
        scalars: &[],
        notes: &[],
        is_at_keys: false,
    };
    for format in ["parquet", "arrow", "csv"] {
        let bytes = written(format, std::slice::from_ref(&sampled)).unwrap();
        let loaded = read(format, &bytes).unwrap();
        let clip = &loaded.clips[0];
        let times = (clip.time_offset, clip.set.track(0).times);
        assert_eq!(times, (1_403_636_579, &[0.5, 1.25][..]), "{format}");
        let short = SampledClip {
            times: &[0.5],
            ..sampled.clone()
        };
        assert!(
            matches!(written(format, &[short]), Err(WriteError::Io(_))),
            "{format}"
        );
    }
}

fn batches(format: &str, bytes: &[u8]) -> Vec<RecordBatch> {
    match format {
        "parquet" => {
            let bytes = Bytes::from(bytes.to_vec());
            let reader = ParquetRecordBatchReaderBuilder::try_new(bytes).unwrap();
            reader.build().unwrap().map(Result::unwrap).collect()
        }
        _ => {
            let reader = FileReader::try_new(io::Cursor::new(bytes), None).unwrap();
            reader.map(Result::unwrap).collect()
        }
    }
}

struct Shape {
    set: TrackSet,
    timeline: Timeline,
}

impl Shape {
    fn new(tracks: usize, frames: usize) -> Self {
        let mut set = TrackSet::new();
        for track in 0..tracks {
            set.push(format!("t{track}"), &[0.0], &[Quat::IDENTITY])
                .unwrap();
        }
        let times: Vec<f64> = (0..frames).map(|frame| frame as f64 / 60.0).collect();
        let timeline = SampleTimes::at(times).resolve(tracks, None).unwrap();
        Self { set, timeline }
    }

    fn result(&self, layout: Layout, encoding: Encoding) -> ResultShape<'_> {
        ResultShape {
            name: "t",
            set: &self.set,
            timeline: &self.timeline,
            time_offset: 0,
            layout,
            order: Some(ComponentOrder::Xyzw),
            encoding,
            notes: &NOTES[..1],
        }
    }
}

fn write(
    format: &str,
    result: &ResultShape<'_>,
    rotations: &[Quat],
    window: usize,
) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let write = Format::named(format).unwrap().write.as_ref().unwrap();
    let mut writer = write.begin(&mut bytes, result)?;
    for part in rotations.chunks(window) {
        writer.write(part)?;
    }
    writer.finish()?;
    Ok(bytes)
}

#[test]
fn results_do_not_depend_on_the_windows_in_which_they_come() {
    let shape = Shape::new(7, 31);
    let all = rotations(7 * 31);
    for format in ["parquet", "arrow"] {
        for layout in [Layout::TrackMajor, Layout::FrameMajor] {
            let result = shape.result(layout, Encoding::F32);
            let whole = write(format, &result, &all, all.len()).unwrap();
            assert_eq!(write(format, &result, &all, 5).unwrap(), whole);
            let clip = &read(format, &whole).unwrap().clips[0];
            assert_eq!(clip.rate, FrameRate::new(60, 1).ok());
            for (i, &q) in all.iter().enumerate() {
                let (track, frame) = match layout {
                    Layout::TrackMajor => (i / 31, i % 31),
                    Layout::FrameMajor => (i % 7, i / 7),
                };
                assert_eq!(clip.set.track(track).keys[frame], q, "{format}: {i}");
            }
            assert!(write(format, &result, &all[1..], 5).is_err());
            let more = rotations(7 * 31 + 1);
            assert!(write(format, &result, &more, 5).is_err());
        }
    }
}

#[test]
fn every_representation_has_its_columns() {
    let shape = Shape::new(2, 3);
    let all = rotations(6);
    for format in ["parquet", "arrow"] {
        for encoding in Encoding::ALL {
            let result = shape.result(Layout::FrameMajor, encoding);
            let bytes = write(format, &result, &all, 6).unwrap();
            let batch = batches(format, &bytes).remove(0);
            let schema = batch.schema();
            let names: Vec<&str> = schema.fields().iter().map(|f| f.name().as_str()).collect();
            assert_eq!(names[..3], ["frame", "time", "track"]);
            assert_eq!(names[3..], *encoding.components());
            assert_eq!(
                batch.column(0).as_primitive::<Int64Type>().values(),
                &[0, 0, 1, 1, 2, 2]
            );
            assert_eq!(
                batch.column(1).as_primitive::<Float64Type>().value(5),
                2.0 / 60.0
            );
            let mut expected = vec![0; encoding.bytes()];
            encoding
                .encode(&[all[4].to_array()], &mut expected)
                .unwrap();
            let found: Vec<u8> = (3..names.len())
                .flat_map(|column| {
                    let column = batch.column(column);
                    match encoding.component_type() {
                        ComponentType::F16 => {
                            let half = column.as_primitive::<Float16Type>().value(4);
                            half.to_bits().to_ne_bytes().to_vec()
                        }
                        ComponentType::Snorm16 => column
                            .as_primitive::<Int16Type>()
                            .value(4)
                            .to_ne_bytes()
                            .to_vec(),
                        ComponentType::F32 => column
                            .as_primitive::<Float32Type>()
                            .value(4)
                            .to_ne_bytes()
                            .to_vec(),
                    }
                })
                .collect();
            assert_eq!(found, expected, "{format}: {encoding:?}");
        }
        let first = ResultShape {
            order: Some(ComponentOrder::Wxyz),
            ..shape.result(Layout::FrameMajor, Encoding::F32)
        };
        let batch = batches(format, &write(format, &first, &all, 6).unwrap()).remove(0);
        assert_eq!(batch.schema().field(3).name(), "w");
        assert_eq!(
            batch.column(3).as_primitive::<Float32Type>().value(4),
            all[4].w
        );
        let clip = &read(format, &write(format, &first, &all, 6).unwrap())
            .unwrap()
            .clips[0];
        assert_eq!(clip.set.track(0).keys[2], all[4]);
        let matrices = shape.result(
            Layout::FrameMajor,
            Encoding::Matrix3x3(MatrixOrder::RowMajor),
        );
        let bytes = write(format, &matrices, &all, 6).unwrap();
        assert_eq!(read(format, &bytes).unwrap_err().code, Code::NoRotations);
    }
}

#[test]
fn poses_are_written_as_transforms_that_are_read() {
    let shape = Shape::new(2, 3);
    let numbers: Vec<f32> = rotations(6)
        .iter()
        .enumerate()
        .flat_map(|(i, q)| [i as f32, 2.0, 3.0, q.x, q.y, q.z, q.w, 1.0, 1.0, 4.0])
        .collect();
    let poses = Poses {
        set: &shape.set,
        timeline: &shape.timeline,
        time_offset: 0,
        components: &TRANSFORM,
        numbers: &numbers,
        origins: &[],
    };
    for format in ["parquet", "arrow", "csv"] {
        let mut bytes = Vec::new();
        (Format::named(format).unwrap().write.as_ref().unwrap().poses)(&poses, &mut bytes).unwrap();
        let clip = &read(format, &bytes).unwrap().clips[0];
        let moved = clip.set.vector_keys(Channel::Translation, 1).unwrap().keys;
        assert_eq!(moved[2], Vec3::new(5.0, 2.0, 3.0), "{format}");
        assert_eq!(
            clip.set.vector_keys(Channel::Scale, 0).unwrap().keys[0].z,
            4.0
        );
        assert_eq!(clip.set.track(0).keys[1], rotations(6)[2]);
    }
}

/// A long result is written as it is computed: only a small part of it is in memory.
#[test]
fn rows_are_handed_on_before_the_end() {
    struct Count<'a>(&'a std::cell::Cell<usize>);
    impl Write for Count<'_> {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.set(self.0.get() + bytes.len());
            Ok(bytes.len())
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }
    let shape = Shape::new(4, 300_000);
    let result = shape.result(Layout::FrameMajor, Encoding::F32);
    let window = rotations(1 << 16);
    for (format, waiting) in [("arrow", 1 << 16), ("parquet", 1 << 20)] {
        let written = std::cell::Cell::new(0);
        let mut out = Count(&written);
        let write = Format::named(format).unwrap().write.as_ref().unwrap();
        let mut writer = write.begin(&mut out, &result).unwrap();
        let mut rows = 0;
        for _ in 0..18 {
            writer.write(&window).unwrap();
            rows += window.len();
            let handed = rows.saturating_sub(waiting);
            assert!(
                written.get() >= handed * 8,
                "{format}: {} of {rows} rows",
                written.get()
            );
        }
    }
}

/// Times since 1970 are timestamps of nanoseconds, which f64 would round to 0.24 µs.
#[test]
fn nanoseconds_of_a_clock_come_back() {
    let times = [0.763_555_584, 0.813_555_585, 2.000_000_001];
    let mut clip = Motion {
        time_offset: 1_403_636_579,
        ..Motion::default()
    };
    clip.set.push("a", &times, &rotations(3)).unwrap();
    let samples = keyed(&clip).unwrap();
    let sampled = [samples.of(&clip, None, &[])];
    for (format, left_out) in [
        ("parquet", 0),
        ("arrow", 0),
        ("csv", 0),
        ("npz", 1),
        ("dat", 1),
    ] {
        let mut bytes = Vec::new();
        let written = Format::named(format).unwrap();
        let warnings = written
            .write_clips(&sampled, &MotionOptions::default(), &mut bytes)
            .unwrap();
        let names_the_loss =
            |it: &&Diagnostic| it.message.contains("nanoseconds of times since 1970");
        assert_eq!(
            warnings.iter().filter(names_the_loss).count(),
            left_out,
            "{format}: {warnings:?}"
        );
        if left_out == 0 {
            let again = &read(format, &bytes).unwrap().clips[0];
            assert_eq!(
                (again.time_offset, again.set.track(0).times),
                (1_403_636_579, &times[..])
            );
        }
    }
    let shape = Shape::new(2, 31);
    let mut result = shape.result(Layout::TrackMajor, Encoding::F32);
    result.time_offset = 1_700_000_000;
    let bytes = write("arrow", &result, &rotations(62), 62).unwrap();
    let clip = &read("arrow", &bytes).unwrap().clips[0];
    assert_eq!(
        (clip.time_offset, clip.rate),
        (1_700_000_000, FrameRate::new(60, 1).ok())
    );
    assert_eq!(clip.set.track(1).times[30], 0.5);
}

/// Topics of different rates go into one table as they are.
#[test]
fn tracks_keep_their_own_times() {
    let mut clip = Motion::default();
    let lists: [(&str, &[f64]); 3] = [
        ("slow", &[0.0, 1.0]),
        ("fast", &[0.0, 0.3, 0.7, 1.1]),
        ("still", &[0.0]),
    ];
    for (name, times) in lists {
        clip.set.push(name, times, &rotations(times.len())).unwrap();
    }
    let points = [1.0, 2.0, 3.0, 4.0].map(|x| Vec3::new(x, 0.0, 0.0));
    clip.set
        .set_translations(1, lists[1].1, &points, &[])
        .unwrap();
    for format in ["parquet", "arrow"] {
        let written = Format::named(format).unwrap();
        let (samples, is_at_keys) = keys_for(&clip, written, false).unwrap();
        assert!(is_at_keys);
        let sampled = [SampledClip {
            is_at_keys,
            ..samples.of(&clip, None, &[])
        }];
        let mut bytes = Vec::new();
        written
            .write_clips(&sampled, &MotionOptions::default(), &mut bytes)
            .unwrap();
        let again = &read(format, &bytes).unwrap().clips[0];
        for (track, (name, times)) in lists.into_iter().enumerate() {
            assert_eq!(
                (again.set.track(track).name, again.set.track(track).times),
                (Some(name), times)
            );
            assert_eq!(again.set.track(track).keys, clip.set.track(track).keys);
        }
        let moved = again.set.vector_keys(Channel::Translation, 1).unwrap();
        assert_eq!(moved.keys, points);
    }
    let refused = keys_for(&clip, Format::named("csv").unwrap(), false).unwrap_err();
    assert!(
        refused.to_string().contains("write Parquet or Arrow"),
        "{refused}"
    );
}
