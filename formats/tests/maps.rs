//! Tables whose rotations are no quaternions, and those with gaps.

use glam::{Quat, Vec3};
use tumble_formats::csv::read::read_csv;
use tumble_formats::{Code, Diagnostic, Loaded, ReadOptions};

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
        ("t;x;y;z;w\n0;0;0;0;1\n", "columns are separated by commas"),
        (
            "t\tx\ty\tz\tw\n0\t0\t0\t0\t1\n",
            "columns are separated by commas",
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
            .contains("the track `box1` lacks 1 of its keys"),
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
    // Long tables too; a track without any key, and times that are missing, stay refused.
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
