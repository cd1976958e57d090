//! Tables whose rotations are no quaternions, and those with gaps.

use glam::{DVec3, Quat, Vec3};
use tumble::Channel;
use tumble_formats::csv::read::read_csv;
use tumble_formats::format::Space;
use tumble_formats::{Code, Diagnostic, Loaded, ReadOptions};

use crate::support::shared_data;

fn read(text: &str, map: Option<&str>, bridge_gaps: bool) -> Result<Loaded, Diagnostic> {
    let options = ReadOptions {
        map: map.map(str::to_owned),
        bridge_gaps,
        ..ReadOptions::default()
    };
    read_csv("a.csv", text.into(), &options)
}

#[test]
fn columns_hold_rotation_vectors_angles_and_matrices() {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let quarter = Quat::from_xyzw(0.0, 0.0, half, half);
    let text = "time,rx,ry,rz,e1,e2,e3,m11,m12,m13,m21,m22,m23,m31,m32,m33\n\
                0,0,0,0,0,0,0,1,0,0,0,1,0,0,0,1\n\
                1,0,0,1.5707963267948966,90,0,0,0,-1,0,1,0,0,0,0,1\n";
    for map in [
        "hand=rx..rz:rotvec",
        "hand=e1..e3:ZXY:deg",
        "hand=m11..m33:matrix",
    ] {
        let loaded = read(text, Some(map), false).unwrap();
        let clip = &loaded.clips[0];
        assert_eq!(clip.set.track_name(0), "hand", "{map}");
        let keys = clip.set.track(0).keys;
        assert_eq!(keys[0], Quat::IDENTITY, "{map}");
        assert!(keys[1].abs_diff_eq(quarter, 1e-7), "{map}: {}", keys[1]);
    }
    let several = "hand=rx..rz:rotvec,foot=e1..e3:zxy";
    let loaded = read(text, Some(several), false).unwrap();
    assert_eq!(loaded.clips[0].set.track_count(), 2);
    let refused = |text: &str, map| read(text, Some(map), false).unwrap_err();
    let short = refused(text, "hand=rx..ry:rotvec");
    assert_eq!(short.code, Code::ListLength, "{short}");
    let mirror = text.replace("0,-1,0,1,0,0", "0,1,0,1,0,0");
    let found = refused(&mirror, "hand=m11..m33:matrix");
    assert_eq!(found.code, Code::NoRotation, "{found}");
    assert!(found.to_string().starts_with("a.csv:3:"), "{found}");
}

/// A `--map` cannot help there.
#[test]
fn headings_without_names_are_told_apart_from_other_names() {
    for (text, words) in [
        (
            "t;x;y;z;w\n0;0;0;0;1\n",
            "columns must be separated by commas",
        ),
        (
            "t\tx\ty\tz\tw\n0\t0\t0\t0\t1\n",
            "columns must be separated by commas",
        ),
        (
            "0,0,0,0,1\n1,0,0,0,1\n",
            "begin the file with the names of the columns",
        ),
        (
            "# pose\nt,x,y,z,w\n0,0,0,0,1\n",
            "begin the file with the names of the columns",
        ),
        ("T,X,Y,Z,W\n0,0,0,0,1\n", "--map time=NAME"),
    ] {
        let refused = read(text, None, false).unwrap_err();
        assert_eq!(refused.code, Code::NoTimes, "{refused}");
        assert!(refused.message.contains(words), "{refused}");
    }
}

#[test]
fn a_track_without_a_name_is_called_as_in_results() {
    let text = "t,x,y,z,w\n0,0,0,0,1\n1,0,0,nan,1\n2,0,0,1,0\n";
    let loaded = read(text, None, true).unwrap();
    let said = &loaded.warnings[0];
    assert_eq!(said.code, Code::Bridged);
    assert!(
        said.message
            .contains("1 key of the track `box1` without a value left out"),
        "{said}"
    );
}

#[test]
fn gaps_are_refused_or_bridged() {
    let text = "time,knee.x,knee.y,knee.z,knee.w,hip.x,hip.y,hip.z,hip.w,hip.tx,hip.ty,hip.tz\n\
                0,0,0,0,1,0,0,0,1,1,2,3\n\
                0.1,,,,,0,0,0,1,2,2,3\n\
                0.2,0,0,0.6,0.8,0,0,0,1,nan,2,3\n\
                0.3,0,0,0.8,0.6,0,0,0,1,4,2,3\n";
    let refused = read(text, None, false).unwrap_err();
    assert!(refused.to_string().contains("--bridge-gaps"), "{refused}");
    let loaded = read(text, None, true).unwrap();
    let set = &loaded.clips[0].set;
    assert_eq!(set.track(0).times, [0.0, 0.2, 0.3]);
    assert_eq!(set.track(0).keys[1], Quat::from_xyzw(0.0, 0.0, 0.6, 0.8));
    assert_eq!(set.track(1).times, [0.0, 0.1, 0.3]);
    let moved = set.vector_keys(tumble::Channel::Translation, 1).unwrap();
    assert_eq!(moved.keys, [1.0, 2.0, 4.0].map(|x| Vec3::new(x, 2.0, 3.0)));
    let codes: Vec<(Code, u64)> = loaded
        .warnings
        .iter()
        .map(|said| (said.code, said.count))
        .collect();
    assert_eq!(codes, [(Code::Bridged, 2)]);
    // This works for long tables, too. A track without any key and missing times are still refused.
    let long = "time,track,x,y,z,w\n0,a,0,0,0,1\n0.1,a,,,,\n0.2,a,0,0,0.6,0.8\n0.1,b,0,0,0,1\n";
    let loaded = read(long, None, true).unwrap();
    let set = &loaded.clips[0].set;
    assert_eq!(set.track(0).times, [0.0, 0.2]);
    assert_eq!(set.track(1).times, [0.1]);
    for bad in [
        "time,track,x,y,z,w\n0,a,0,0,0,1\n0.1,b,,,,\n",
        "time,x,y,z,w\n0,0,0,0,1\n,0,0,0.6,0.8\n",
    ] {
        assert_eq!(read(bad, None, true).unwrap_err().code, Code::Null, "{bad}");
    }
    let infinite = text.replace("nan", "inf");
    assert!(read(&infinite, None, true).is_err());
}

fn rows(text: &str, map: Option<&str>) -> Result<Loaded, Diagnostic> {
    let options = ReadOptions {
        map: map.map(str::to_owned),
        source_rate: tumble::FrameRate::new(10, 1).ok(),
        ..ReadOptions::default()
    };
    read_csv("a.csv", text.into(), &options)
}

/// The positions of the first track, as they are in the file.
fn positions(loaded: &Loaded) -> Vec<Vec3> {
    let keys = loaded.clips[0].set.vector_keys(Channel::Translation, 0);
    keys.map_or(Vec::new(), |keys| keys.keys.to_vec())
}

#[test]
fn columns_that_a_map_names_are_never_left_out() {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let quarter = Quat::from_xyzw(0.0, 0.0, half, half);
    let robot = "frame,root_x,root_y,root_z,rot_w,rot_x,rot_y,rot_z,knee(rad)\n\
                 0,0,0,0,1,0,0,0,0.1\n\
                 1,1,2,3,0.70710678,0,0,0.70710678,0.1\n";
    let named = robot.replace("root_x,root_y,root_z", "root.tx,root.ty,root.tz");
    let angles = "time,x,y,z,roll,pitch,yaw\n0,0,0,0,0,0,0\n0.1,1,2,3,0,0,90\n";
    for (text, map, left_out) in [
        (
            robot,
            "tx=root_x,ty=root_y,tz=root_z,root=rot_w..rot_z:wxyz",
            1,
        ),
        (
            robot,
            "root.tx=root_x,root.ty=root_y,root.tz=root_z,root=rot_w..rot_z:wxyz",
            1,
        ),
        (&named, "root=rot_w..rot_z:wxyz", 1),
        (
            robot,
            "root=rot_w..rot_z:wxyz,root.translation=root_x..root_z",
            1,
        ),
        (angles, "tx=x,ty=y,tz=z,body=roll..yaw:xyz:deg", 0),
    ] {
        let loaded = match text.starts_with("frame") {
            true => rows(text, Some(map)),
            false => read(text, Some(map), false),
        };
        let loaded = loaded.unwrap_or_else(|error| panic!("{map}: {error}"));
        assert_eq!(
            positions(&loaded),
            [Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0)],
            "{map}"
        );
        let track = loaded.clips[0].set.track(0);
        assert_eq!(track.times, [0.0, 0.1], "{map}");
        assert!(
            track.keys[1].abs_diff_eq(quarter, 1e-7),
            "{map}: {}",
            track.keys[1]
        );
        assert_eq!(
            loaded.warnings.len(),
            left_out,
            "{map}: {:?}",
            loaded.warnings
        );
    }
    // The position may be that of any track, or no position.
    for map in [
        "tx=x,ty=y,tz=z,a=roll..yaw:xyz,b=roll..yaw:rotvec",
        "qw=x,body=roll..yaw:xyz",
    ] {
        let refused = read(angles, Some(map), false).unwrap_err();
        assert_eq!(refused.code, Code::Map, "{refused}");
        assert!(
            refused.message.contains("of --map has no effect"),
            "{refused}"
        );
    }
    let both = "time,a.x,a.y,a.z,a.w,r,p,q\n0,0,0,0,1,0,0,0\n";
    let loaded = read(both, Some("b=r..q:xyz"), false).unwrap();
    assert_eq!(loaded.clips[0].set.track_count(), 2);
    let refused = read(both, Some("a=r..q:xyz"), false).unwrap_err();
    assert_eq!(refused.code, Code::ColumnTwice, "{refused}");
    // The rows of several bodies become several tracks.
    let bodies = "time,body,r,p,q\n0,a,0,0,0\n0,b,0,0,1\n1,a,0,0,2\n1,b,0,0,3\n";
    let loaded = read(bodies, Some("rotation=r..q:xyz"), false).unwrap();
    let set = &loaded.clips[0].set;
    assert_eq!(
        (set.track_name(0), set.track_name(1)),
        ("a".to_owned(), "b".to_owned())
    );
    assert_eq!(set.track(1).times, [0.0, 1.0]);
}

#[test]
fn a_position_is_not_taken_for_a_quaternion() {
    for (x, y, z) in [
        ("x_1", "y_1", "z_1"),
        ("x.1", "y.1", "z.1"),
        ("qx", "qy", "qz"),
    ] {
        let text =
            format!("time,x,y,z,{x},{y},{z},w\n0,0,0,0.01,0,0,0,1\n1,0.05,0.02,0.01,0,0,0.6,0.8\n");
        let refused = read(&text, None, false).unwrap_err();
        assert_eq!(refused.code, Code::ColumnsAmbiguous, "{refused}");
        // The `--map` of the message works.
        let (_, map) = refused.message.split_once("--map '").unwrap();
        let loaded = read(&text, map.strip_suffix('\''), false).unwrap();
        assert_eq!(loaded.warnings, []);
        assert_eq!(positions(&loaded)[1], Vec3::new(0.05, 0.02, 0.01));
        assert_eq!(
            loaded.clips[0].set.track(0).keys[1],
            Quat::from_xyzw(0.0, 0.0, 0.6, 0.8)
        );
    }
    // Columns of one name get numbers.
    let text = "time,X,Y,Z,W,X,Y,Z,\n0,0,0,0,1,1,2,3,\n1,0,0,0.6,0.8,4,5,6,\n";
    let loaded = read(text, Some("body=X..W,body.translation=X.1..Z.1"), false).unwrap();
    assert_eq!(positions(&loaded)[1], Vec3::new(4.0, 5.0, 6.0));
    let refused = read(&text.to_lowercase(), None, false).unwrap_err();
    assert!(refused.message.contains("the second is `x.1`"), "{refused}");
}

#[test]
fn rows_are_frames_where_nothing_else_says_their_times() {
    let text = "x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0,1\n1,2,3,0,0,0.6,0.8\n";
    let loaded = rows(text, None).unwrap();
    assert_eq!(loaded.clips[0].set.track(0).times, [0.0, 0.1]);
    assert_eq!(loaded.clips[0].rate, tumble::FrameRate::new(10, 1).ok());
    assert_eq!(positions(&loaded)[1], Vec3::new(1.0, 2.0, 3.0));
    // Each clip and each track begins anew.
    let long = "clip,track,x,y,z,w\na,hip,0,0,0,1\na,knee,0,0,0,1\na,hip,0,0,0,1\nb,hip,0,0,0,1\n";
    let loaded = rows(long, None).unwrap();
    let times = |clip: usize, track| loaded.clips[clip].set.track(track).times.to_vec();
    assert_eq!(
        (times(0, 0), times(0, 1), times(1, 0)),
        (vec![0.0, 0.1], vec![0.0], vec![0.0])
    );
    assert_eq!(read(text, None, false).unwrap_err().code, Code::NoTimes);
    assert_eq!(
        rows("0,0,0,1\n0,0,0,1\n", None).unwrap_err().code,
        Code::NoTimes
    );
}

#[test]
fn rows_are_sorted_with_a_warning_in_all_tables() {
    for text in [
        "time,a.x,a.y,a.z,a.w\n0,0,0,0,1\n2,0,0,0,1\n1,0,0,0.6,0.8\n",
        "time,x,y,z,w\n0,0,0,0,1\n2,0,0,0,1\n1,0,0,0.6,0.8\n",
        "time,track,x,y,z,w\n0,a,0,0,0,1\n2,a,0,0,0,1\n1,a,0,0,0.6,0.8\n",
    ] {
        let loaded = read(text, None, false).unwrap();
        let warning = &loaded.warnings[0];
        assert!(
            warning.to_string().starts_with("a.csv:4:1: warning[W403]"),
            "{warning}"
        );
        let track = loaded.clips[0].set.track(0);
        assert_eq!(track.times, [0.0, 1.0, 2.0]);
        assert_eq!(track.keys[1], Quat::from_xyzw(0.0, 0.0, 0.6, 0.8));
    }
    let rows = [0.0, 1.0, 2.0, 0.5, 1.5, 2.5].map(|time| format!("{time},0,0,0,1\n"));
    for names in ["time,x,y,z,w", "time,a.x,a.y,a.z,a.w"] {
        let refused = read(&format!("{names}\n{}", rows.concat()), None, false).unwrap_err();
        assert_eq!(refused.code, Code::TimeNotIncreasing);
        assert!(refused.to_string().starts_with("a.csv:5:1: "), "{refused}");
        assert!(
            refused.message.contains("set back from 2 s to 0.5 s"),
            "{refused}"
        );
    }
}

#[test]
fn times_too_large_for_seconds_have_their_unit() {
    for (factor, decimals) in [("", ""), ("125", ""), ("125000", ".5"), ("125000000", "")] {
        let row = |second: u32, z: f32, w: f32| format!("{second}{factor}{decimals},0,0,{z},{w}\n");
        let text = format!(
            "time,x,y,z,w\n{}{}",
            row(1_700_000_000, 0.0, 1.0),
            row(1_700_000_001, 0.6, 0.8)
        );
        let loaded = read(&text, None, false).unwrap();
        let clip = &loaded.clips[0];
        assert_eq!(clip.time_offset, 1_700_000_000, "{text}");
        let times = clip.set.track(0).times;
        assert!((times[1] - times[0] - 1.0).abs() < 1e-9, "{times:?}");
        let codes: Vec<Code> = loaded.warnings.iter().map(|it| it.code).collect();
        let expected: &[Code] = if factor.is_empty() {
            &[]
        } else {
            &[Code::TimeUnit]
        };
        assert_eq!(codes, expected, "{text}");
    }
}

/// A row for each of many tracks is read in a time that grows with their number, which a search for each column among
/// all would not: 60 000 tracks took 40 s.
#[test]
fn tables_of_many_tracks_are_read() {
    let tracks = 30_000;
    let names = (0..tracks).map(|track| format!(",t{track}.x,t{track}.y,t{track}.z,t{track}.w"));
    let text = format!(
        "time{}\n0{}\n",
        names.collect::<String>(),
        ",0,0,0,1".repeat(tracks)
    );
    assert_eq!(
        read(&text, None, false).unwrap().clips[0].set.track_count(),
        tracks
    );
}

/// The tables of others, with values by SciPy.
#[test]
fn tables_of_others_have_their_values() {
    let Some(folder) = shared_data().map(|folder| folder.join("meaning")) else {
        return;
    };
    let text = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let last = |loaded: &Loaded| {
        let track = loaded.clips[0].set.track(0);
        let key = *track.keys.last().unwrap();
        (
            *track.times.last().unwrap(),
            *positions(loaded).last().unwrap(),
            key,
        )
    };
    let options = |map: &str| ReadOptions {
        map: Some(map.to_owned()),
        source_rate: tumble::FrameRate::new(50, 1).ok(),
        ..ReadOptions::default()
    };
    let map = "tx=root_pos_x,ty=root_pos_y,tz=root_pos_z,root=root_rot_w..root_rot_z:wxyz";
    let loaded = read_csv(
        "md.csv",
        text("csv-map-entry-ignored/md.csv").into(),
        &options(map),
    )
    .unwrap();
    let (time, position, key) = last(&loaded);
    assert_eq!((time, position), (0.6, Vec3::new(1.0, 2.0, 0.0)));
    assert!(
        key.abs_diff_eq(Quat::from_xyzw(0.0, 0.0, 0.258_819_04, 0.965_925_8), 2e-7),
        "{key}"
    );
    let map = "tx=x,ty=y,tz=z,body=roll..yaw:xyz:deg";
    let loaded = read(&text("csv-map-entry-ignored/rpy.csv"), Some(map), false).unwrap();
    let (time, position, key) = last(&loaded);
    assert_eq!((time, position), (1.0, Vec3::new(10.0, 20.0, 30.0)));
    assert!(
        key.abs_diff_eq(Quat::from_xyzw(0.0, 0.0, 0.766_044_44, 0.642_787_64), 2e-7),
        "{key}"
    );
    let x1 = text("csv-position-as-quaternion/x1.csv");
    assert_eq!(
        read(&x1, None, false).unwrap_err().code,
        Code::ColumnsAmbiguous
    );
    // Files of Unitree's robots, without names.
    let robot = read(&text("csv-messages/g1.csv"), None, false).unwrap();
    assert_eq!(positions(&robot)[1], Vec3::new(0.033_333, 0.066_667, 0.0));
    assert_eq!(robot.clips[0].set.scalar_count(), 29);
    let loaded = rows(&text("csv-messages/g1h.csv"), None).unwrap();
    assert_eq!(positions(&loaded)[1], Vec3::new(0.033_333, 0.066_667, 0.0));
    let refused = read(&text("csv-messages/vins.csv"), None, false).unwrap_err();
    assert_eq!(refused.code, Code::NoTimes, "{refused}");
    assert!(refused.message.contains("--from euroc"), "{refused}");
    // Tables of Motive and Vicon are read, with their rates and units; the drone turns by 1° a frame.
    for (name, rate, keys, metres, up, second) in [
        (
            "motive.csv",
            120,
            31,
            1.0,
            DVec3::Y,
            Vec3::new(0.033_333, 0.066_667, 0.0),
        ),
        (
            "vicon.csv",
            100,
            30,
            0.001,
            DVec3::Z,
            Vec3::new(0.067, 0.133, 0.0),
        ),
    ] {
        let loaded = read(&text(&format!("csv-messages/{name}")), None, false).unwrap();
        assert_eq!(loaded.space, Some(Space { up, metres }), "{name}");
        let clip = &loaded.clips[0];
        let track = clip.set.track(0);
        assert_eq!((clip.set.track_count(), track.name), (1, Some("drone")));
        assert_eq!(track.keys.len(), keys, "{name}");
        let found = clip.rate.or_else(|| clip.rate_of_keys());
        assert_eq!(found, tumble::FrameRate::new(rate, 1).ok(), "{name}");
        assert_eq!(positions(&loaded)[1], second, "{name}");
        let degrees = track.keys[0].angle_between(track.keys[1]).to_degrees();
        assert!((degrees - 1.0).abs() < 0.05, "{name}: {degrees}");
    }
}

/// Tables of motion capture systems, and what is said of those that cannot be read: each message has all that mends it.
#[test]
fn tables_of_motion_capture_are_read_or_told_the_export_that_is() {
    let motive = |turning: &str, kind: &str| {
        format!(
            "Format Version,1.23,Take Name,T,Rotation Type,{turning},Length Units,Centimeters\n\n\
             ,Type,{kind},{kind},{kind},{kind},{kind},{kind},{kind},Marker\n,Name,a,a,a,a,a,a,a,m\n\
             ,,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Position\n\
             Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,X\n\
             0,0.0,0,0,0,1,1,2,3,9\n1,0.5,0,0,0.6,0.8,4,5,6,9\n"
        )
    };
    let loaded = read(&motive("Quaternion", "Rigid Body"), None, false).unwrap();
    let clip = &loaded.clips[0];
    assert!(clip.is_world, "{clip:?}");
    assert_eq!(
        positions(&loaded),
        [Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 5.0, 6.0)]
    );
    assert_eq!(
        clip.set.track(0).keys[1],
        Quat::from_xyzw(0.0, 0.0, 0.6, 0.8)
    );
    assert_eq!(loaded.space.map(|space| space.metres), Some(0.01));
    assert!(
        loaded.warnings[0].message.contains("`m.Position X`"),
        "{:?}",
        loaded.warnings
    );

    let vicon = |columns: &str, cells: &str| {
        format!(
            "Objects,,,,,,,,\n50,,,,,,,,\n,,a:b,,,,,,\nFrame,Sub Frame,{columns}\n,,,,,,m,m,m\n{cells}"
        )
    };
    let quaternions = "RX,RY,RZ,RW,TX,TY,TZ";
    let cells = "3,0,0,0,0,1,1,2,3\n4,0,0,0,0.6,0.8,4,5,6\n";
    let two_tables = format!("{cells}\n,,,,,,,,\nTrajectories\n100\n");
    let loaded = read(&vicon(quaternions, &two_tables), None, false).unwrap();
    let track = loaded.clips[0].set.track(0);
    assert_eq!((track.name, track.keys.len()), (Some("a:b"), 2));
    assert!(
        (track.times[1] - track.times[0] - 0.02).abs() < 1e-12,
        "{:?}",
        track.times
    );
    assert!(
        loaded.warnings[0].message.contains("another table"),
        "{:?}",
        loaded.warnings
    );

    for (text, code, remedy) in [
        (
            motive("XYZ", "Rigid Body"),
            Code::NoRotations,
            "with the rotation type Quaternion",
        ),
        (
            motive("Quaternion", "Marker"),
            Code::NoRotations,
            "with rigid bodies or bones",
        ),
        (
            vicon("RX,RY,RZ,TX,TY,TZ,", cells),
            Code::NoRotations,
            "quaternions, RX RY RZ RW",
        ),
        (
            vicon("X,Y,Z,X,Y,Z,", cells),
            Code::NoRotations,
            "export objects or segments",
        ),
        (
            "Segments\n50\n,,a\n1,2,3\n".to_owned(),
            Code::NoTimes,
            "no row begins with `Frame`",
        ),
    ] {
        let refused = read(&text, None, false).unwrap_err();
        assert_eq!(refused.code, code, "{refused}");
        assert!(refused.message.contains(remedy), "{refused}");
    }
}

/// Names below other lines: after what the message says, the table is read.
#[test]
fn names_below_other_lines_are_read_when_these_are_deleted() {
    let lines = [
        "Recording,walk",
        "Time,hand.x,hand.y,hand.z,hand.w",
        "s,1,1,1,1",
        "0,0,0,0,1",
    ];
    let with_units = lines.map(|line| line.replace("s,1,1,1,1", "s,,,,"));
    for (lines, units) in [(lines.map(str::to_owned), false), (with_units, true)] {
        let lines: Vec<String> = match units {
            true => lines.to_vec(),
            false => lines
                .iter()
                .filter(|line| !line.starts_with('s'))
                .cloned()
                .collect(),
        };
        let refused = read(&lines.join("\n"), None, false).unwrap_err();
        assert_eq!(refused.code, Code::NoTimes, "{refused}");
        let asked = refused.message.contains("and the one of units after it");
        assert_eq!(asked, units, "{refused}");
        let map = refused.message.split('\'').nth(1).unwrap();
        let left = lines.iter().skip(1).filter(|line| !line.starts_with("s,"));
        let mended: Vec<&str> = left.map(String::as_str).collect();
        let loaded = read(&mended.join("\n"), Some(map), false).unwrap();
        assert_eq!(loaded.clips[0].set.track(0).name, Some("hand"));
    }
}
