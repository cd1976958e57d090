//! `.dat` files beyond those in `tests/fixtures/dat.cases`: endless, unreadable, arbitrary, the widest.

use std::io;
use std::io::{BufReader, Read};
use std::path::Path;

use glam::Quat;
use proptest::prelude::*;
use tumble::TrackSet;
use tumble_formats::Limits;
use tumble_formats::ReadOptions;
use tumble_formats::dat::write::write_dat;
use tumble_formats::dat::{open_dat, read_dat};
use tumble_formats::times::read_times;
use tumble_formats::{Code, Diagnostic};

fn refusal(path: &Path) -> Diagnostic {
    open_dat(path, &ReadOptions::default()).unwrap_err()
}

#[test]
fn what_is_no_file_is_refused_with_a_reason() {
    let directory = tempfile::tempdir().unwrap();
    assert_eq!(refusal(directory.path()).code, Code::NotAFile);
    let missing = refusal(&directory.path().join("missing.dat"));
    assert_eq!(missing.code, Code::Open);
    let not_found = io::Error::from_raw_os_error(2); // on Linux, macOS and Windows
    assert_eq!(missing.message, format!("cannot be read: {not_found}"));
    #[cfg(unix)]
    {
        use std::os::unix::fs::symlink;
        let (a, b) = (directory.path().join("a"), directory.path().join("b"));
        symlink(&a, &b).unwrap();
        symlink(&b, &a).unwrap();
        assert_eq!(refusal(&a).code, Code::Open);
        assert_eq!(refusal(Path::new("/dev/null")).code, Code::NotAFile);
        let socket = directory.path().join("socket");
        let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
        assert_eq!(refusal(&socket).code, Code::NotAFile);
        let pipe = directory.path().join("pipe");
        let made = std::process::Command::new("mkfifo")
            .arg(&pipe)
            .status()
            .unwrap();
        assert!(made.success());
        assert_eq!(refusal(&pipe).code, Code::NotAFile);
    }
}

#[test]
fn limits_refuse_before_memory_runs_out() {
    let endless = || BufReader::new(io::repeat(b'7'));
    let limits = Limits {
        line: 1000,
        file: 5000,
        memory: None,
    };
    let options = ReadOptions {
        limits,
        ..ReadOptions::default()
    };
    assert_eq!(
        read_dat("t", endless(), &options).unwrap_err().code,
        Code::LineTooLong
    );
    let lines =
        BufReader::new(io::Cursor::new("# 1 1\n").chain(io::Cursor::new("# c\n".repeat(2000))));
    assert_eq!(
        read_dat("t", lines, &options).unwrap_err().code,
        Code::FileTooLong
    );
}

/// A disk that fails, at once or while it is read, is a refusal with the system's reason.
#[test]
fn what_cannot_be_read_on_is_refused() {
    struct Failing;
    impl Read for Failing {
        fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
            Err(io::Error::other("the disk is on fire"))
        }
    }
    for start in ["", "# 1 1\n", "# 1 1\n0 1 0 0 0\n1 1 0"] {
        let reader = BufReader::new(io::Cursor::new(start).chain(Failing));
        let error = read_dat("t", reader, &ReadOptions::default()).unwrap_err();
        assert_eq!(error.code, Code::Open);
        assert!(error.message.contains("the disk is on fire"), "{error}");
        assert_eq!(
            read_times("t", BufReader::new(Failing)).unwrap_err().code,
            Code::Open
        );
    }
}

/// 65 536 boxes are allowed; a header alone must not cost what they would.
#[test]
fn the_largest_header_costs_nothing() {
    let error = read_dat("t", &b"# 65536 1\n0 1 0 0 0\n"[..], &ReadOptions::default());
    assert_eq!(error.unwrap_err().code, Code::Columns);
}

/// As many boxes as there may be: a row is read once, not once for each box.
#[test]
fn the_widest_file_is_read() {
    let row = " 0 1 0 0".repeat(65_536);
    let text = format!("# 65536 3\n0{row}\n1{row}\n");
    let loaded = read_dat("t", text.as_bytes(), &ReadOptions::default()).unwrap();
    assert_eq!(
        (
            loaded.clips[0].set.track_count(),
            loaded.clips[0].set.key_count()
        ),
        (65_536, 131_072)
    );
}

proptest! {
    #[test]
    fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = read_dat("t", &*bytes, &ReadOptions::default());
    }

    /// Nearly valid files get further in the reader than arbitrary bytes.
    #[test]
    fn damaged_files_never_panic(offset in 0usize..60, byte in any::<u8>(), cut in 0usize..70) {
        let mut bytes = b"# 2 3.0\n0.5 1 0 0 0 0.6 0.8 0 0\n1.25 0 1 0 0 0 0 1e0 -0.0\n".to_vec();
        let offset = offset % bytes.len();
        bytes[offset] = byte;
        bytes.truncate(cut);
        let _ = read_dat("t", &*bytes, &ReadOptions::default());
    }

    #[test]
    fn what_is_written_reads_back_bit_for_bit(
        keys in prop::collection::vec(prop::array::uniform3(-4.0f32..4.0), 1..20),
        start in -1e6f64..1e6,
    ) {
        let quats: Vec<Quat> =
            keys.iter().map(|&[x, y, z]| Quat::from_scaled_axis([x, y, z].into())).collect();
        let times: Vec<f64> = (0..quats.len()).map(|i| start + i as f64 / 3.0).collect();
        let set = TrackSet::with_shared_times(&times, &quats).unwrap();
        let mut file = Vec::new();
        write_dat(&mut file, &set, 0.1).unwrap();
        let loaded = read_dat("t", &*file, &ReadOptions::default()).unwrap();
        let read = loaded.clips[0].set.clone();
        prop_assert_eq!(read.track(0).times, set.track(0).times);
        let bits = |set: &TrackSet| -> Vec<[u32; 4]> {
            set.track(0).keys.iter().map(|q| q.to_array().map(f32::to_bits)).collect()
        };
        prop_assert_eq!(bits(&read), bits(&set));
        prop_assert_eq!(loaded.box_length, Some(0.1));
    }
}
