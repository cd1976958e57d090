//! CSV with options about tables: units of times, names, parts, twice the same time.

use proptest::prelude::*;
use tumble::{Channel, FrameRate};
use tumble_formats::csv::read::read_csv;
use tumble_formats::format::TimeUnit;
use tumble_formats::keys::Duplicates;
use tumble_formats::surface::obj::read_obj;
use tumble_formats::{Code, Diagnostic, Loaded, Location, ReadOptions};

fn read(text: &str, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    read_csv("t", text.as_bytes().to_vec(), options)
}

fn mapped(map: &str) -> ReadOptions {
    ReadOptions {
        map: Some(map.to_owned()),
        ..ReadOptions::default()
    }
}

const FOUR: &str = "time,x,y,z,w\n0,0,0,0,1\n1,0.5,0.5,0.5,0.5\n2,1,0,0,0\n3,0,1,0,0\n";

#[test]
fn euroc_is_read_by_names_and_nanoseconds() {
    let text = "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z []\n\
                1403636580838555648,4.688319,-1.786938,0.783338,0.534108,-0.153029,-0.827383,-0.082152\n\
                1403636580843555328,4.688177,-1.786770,0.787350,0.534640,-0.152990,-0.826976,-0.082863\n";
    let map = "time=#timestamp,tx=p_RS_R_x [m],ty=p_RS_R_y [m],tz=p_RS_R_z [m],\
               w=q_RS_w [],x=q_RS_x [],y=q_RS_y [],z=q_RS_z []";
    let options = ReadOptions {
        time_unit: Some(TimeUnit::Nanoseconds),
        ..mapped(map)
    };
    let loaded = read(text, &options).unwrap();
    let clip = &loaded.clips[0];
    assert_eq!(clip.time_offset, 1_403_636_580);
    assert_eq!(clip.set.track(0).times, [0.838_555_648, 0.843_555_328]);
    assert_eq!(
        clip.set.vector_keys(Channel::Translation, 0).unwrap().keys[1].to_array(),
        [4.688_177, -1.786_77, 0.787_35]
    );
    let key = clip.set.track(0).keys[0];
    assert!(
        (key.w - 0.534_108).abs() < 1e-6 && (key.y + 0.827_383).abs() < 1e-6,
        "{key}"
    );
}

#[test]
fn units_of_times_are_obeyed() {
    let times = |text: &str, unit| {
        let options = ReadOptions {
            time_unit: unit,
            raw_times: true,
            ..ReadOptions::default()
        };
        let loaded = read(text, &options).unwrap();
        (
            loaded.clips[0].set.track(0).times.to_vec(),
            loaded.clips[0].time_offset,
        )
    };
    assert_eq!(times(FOUR, None), (vec![0.0, 1.0, 2.0, 3.0], 0));
    let milliseconds = Some(TimeUnit::Milliseconds);
    assert_eq!(times(FOUR, milliseconds).0, [0.0, 0.001, 0.002, 0.003]);
    let halves = FOUR.replace("\n3,", "\n3.5,");
    assert_eq!(times(&halves, Some(TimeUnit::Microseconds)).0[3], 3.5 / 1e6);
    // Before 1970, and so far from 0 that an f64 would lose the last digits.
    let early = "t,x,y,z,w\n-3000000000000001,0,0,0,1\n-3000000000000000,0,0,0,1\n";
    let (seconds, epoch) = times(early, Some(TimeUnit::Nanoseconds));
    assert_eq!((seconds, epoch), (vec![0.999_999_999, 1.0], -3_000_001));
    let wide = "t,x,y,z,w\n-9223372036854775808,0,0,0,1\n9223372036854775807,0,0,0,1\n";
    assert_eq!(times(wide, Some(TimeUnit::Seconds)).0[0], 0.0);
}

/// Text keeps digits that f64 has not.
#[test]
fn decimals_of_unix_time_keep_their_digits() {
    let text = "time,x,y,z,w\n1403636579.763555584,0,0,0,1\n1403636579.768555584,0,0,0,1\n";
    let clip = &read(text, &ReadOptions::default()).unwrap().clips[0];
    assert_eq!(clip.time_offset, 1_403_636_579);
    assert_eq!(clip.set.track(0).times, [0.763_555_584, 0.768_555_584]);
    assert_eq!(clip.rate, FrameRate::new(200, 1).ok());
    let options = ReadOptions {
        time_unit: Some(TimeUnit::Nanoseconds),
        ..ReadOptions::default()
    };
    let text = text
        .replace("1403636579.", "1403636579")
        .replace("84,", "84.0,");
    let same = &read(&text, &options).unwrap().clips[0];
    assert_eq!(
        (same.time_offset, same.set.track(0).times),
        (clip.time_offset, clip.set.track(0).times)
    );
    let found = read(&text, &ReadOptions::default()).unwrap();
    assert_eq!(found.warnings[0].code, Code::TimeUnit);
    assert_eq!(found.clips[0].set.track(0).times, clip.set.track(0).times);
}

/// A rate beside times would be another, and one of them would be ignored.
#[test]
fn a_rate_beside_times_is_refused() {
    let options = ReadOptions {
        source_rate: FrameRate::new(30, 1).ok(),
        ..ReadOptions::default()
    };
    assert_eq!(
        read(FOUR, &options).unwrap_err().code,
        Code::RateBesideTimes
    );
}

#[test]
fn frames_are_times_at_the_rate_that_is_given() {
    let text = FOUR.replace("time", "frame_index");
    let rate = FrameRate::new(30_000, 1001).unwrap();
    let options = ReadOptions {
        source_rate: Some(rate),
        ..ReadOptions::default()
    };
    let clip = &read(&text, &options).unwrap().clips[0];
    assert_eq!(clip.set.track(0).times[3], 3.0 * 1001.0 / 30_000.0);
    assert_eq!(clip.rate, Some(rate));
    let error = read(&text.replace("\n1,", "\n-1,"), &options).unwrap_err();
    let location = Location::Text { line: 3, column: 1 };
    assert_eq!((error.code, error.location), (Code::Time, Some(location)));
}

#[test]
fn times_of_a_grid_are_frames_again_unless_they_are_wanted_raw() {
    let third = (1.0f64 / 3.0).next_down();
    let text = FOUR.replace("\n1,", &format!("\n{third},"));
    let read = |raw_times| {
        let options = ReadOptions {
            raw_times,
            ..ReadOptions::default()
        };
        let clip = read(&text, &options).unwrap().clips.remove(0);
        (clip.set.track(0).times[1], clip.rate)
    };
    assert_eq!(read(false), (1.0 / 3.0, FrameRate::new(3, 1).ok()));
    assert_eq!(read(true), (third, None));
}

#[test]
fn one_of_two_keys_at_one_time_stays() {
    let text = FOUR.replace("\n2,", "\n1,");
    for (duplicates, x) in [(Duplicates::First, 0.5), (Duplicates::Last, 1.0)] {
        let options = ReadOptions {
            duplicates,
            ..ReadOptions::default()
        };
        let loaded = read(&text, &options).unwrap();
        let track = loaded.clips[0].set.track(0);
        assert_eq!((track.times, track.keys[1].x), (&[0.0, 1.0, 3.0][..], x));
    }
}

#[test]
fn names_that_do_not_fit_are_refused() {
    for (map, code, hint) in [
        ("time", Code::Map, "is not `name=source`"),
        ("time=seconds", Code::ColumnMissing, "`seconds`"),
        ("hand=x[0:4]", Code::ColumnType, "no lists"),
        ("hand=x[0:3]", Code::ListLength, "needs 4"),
        ("hand.scale=x[0:3]", Code::NoRotations, "`hand`"),
        ("hand.scale=x[0:4]", Code::ListLength, "needs 3"),
    ] {
        let error = read(FOUR, &mapped(map)).unwrap_err();
        assert_eq!(error.code, code, "{map}: {error}");
        assert!(error.message.contains(hint), "{map}: {error}");
    }
    // A name that is given hides the column that had it.
    let loaded = read(FOUR, &mapped("w=x,x=w")).unwrap();
    assert_eq!(
        loaded.clips[0].set.track(0).keys[0].to_array(),
        [1.0, 0.0, 0.0, 0.0]
    );
}

/// One rule for all formats of lines: a carriage return alone is refused, but within the quotes of a cell and at the end.
#[test]
fn a_carriage_return_alone_ends_no_line() {
    let code = |refusal: Option<Diagnostic>| refusal.map(|refusal| refusal.code);
    let obj = |text: &str| code(read_obj("a.obj", text.as_bytes()).err());
    let points = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    assert_eq!(obj(points), None);
    assert_eq!(obj(&points.replace('\n', "\r\n")), None);
    assert_eq!(obj(&points.replace('\n', "\r")), Some(Code::Character));
    let csv = |text: &str| code(read(text, &ReadOptions::default()).err());
    assert_eq!(csv("time,x,y,z,w\n0,0,0,0,1\n1,0,0,0,1\r"), None);
    assert_eq!(csv("time,x,y,z,w,note\n0,0,0,0,1,\"a\rb\"\n"), None);
    assert_eq!(csv("time,x,y,z,w\r0,0,0,0,1\r"), Some(Code::Character));
}

proptest! {
    #[test]
    fn arbitrary_text_never_panics(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let _ = read_csv("t", bytes.clone(), &ReadOptions::default());
        let _ = read_csv("t", [FOUR.as_bytes(), &bytes].concat(), &ReadOptions::default());
    }

    /// Every refusal names a position within the text.
    #[test]
    fn damaged_text_is_refused_within_it(offset in 0usize..70, piece in "[0-9,.\"\nx é-]{0,4}", cut in 0usize..80) {
        let mut text = FOUR.to_owned();
        text.insert_str(offset.min(text.len()), &piece);
        let cut = (0..=cut.min(text.len())).rev().find(|&cut| text.is_char_boundary(cut));
        text.truncate(cut.unwrap());
        let error = read(&text, &ReadOptions::default()).err();
        if let Some(Location::Text { line, column }) = error.and_then(|error| error.location) {
            let lines = text.matches('\n').count() as u64 + 1;
            prop_assert!((1..=lines).contains(&line), "line {} of {:?}", line, text);
            prop_assert!(column <= text.len() as u64 + 1, "column {} of {:?}", column, text);
        }
    }
}
