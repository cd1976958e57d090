//! Pickles: those of Python, NumPy, joblib and `PyTorch` are read as data, and whatever else a file may be is refused
//! within its memory.

use std::collections::BTreeMap;
use std::fs;
use std::io::{Read, Write};
use std::path::Path;

use proptest::prelude::*;
use serde_json::Value;
use tumble::glam::Quat;
use tumble_formats::motion::{Body, Motion};
use tumble_formats::npz::{body_offsets, read_npy, read_npz};
use tumble_formats::pickle::Contents;
use tumble_formats::pickle::format::read_pickle;
use tumble_formats::{Code, Diagnostic, Limits, ReadOptions};

use crate::support::shared_data;

fn open(path: &Path) -> Result<Contents, Diagnostic> {
    Contents::open(path, &ReadOptions::default())
}

/// The numbers of a value of JSON, and the lengths of its lists.
fn numbers(value: &Value) -> (Vec<usize>, Vec<f64>) {
    match value {
        Value::Array(items) => {
            let parts: Vec<_> = items.iter().map(numbers).collect();
            let inner = parts.first().map_or(Vec::new(), |(shape, _)| shape.clone());
            let shape = [&[items.len()][..], &inner].concat();
            let all = parts.into_iter().flat_map(|(_, numbers)| numbers).collect();
            (shape, all)
        }
        Value::Bool(truth) => (Vec::new(), vec![f64::from(u8::from(*truth))]),
        number => (Vec::new(), vec![number.as_f64().unwrap()]),
    }
}

fn check(contents: &Contents, name: &str, expected: &Value) {
    match expected {
        Value::Null => assert!(contents.numbers(name).is_none(), "{name}"),
        Value::String(text) => {
            let found = contents.texts(name);
            // Python stores the bytes of `raw` as such.
            let bytes = || {
                let bytes = contents
                    .entries()
                    .into_iter()
                    .find(|entry| entry.name == name);
                bytes.is_some_and(|entry| entry.kind == "() S2")
            };
            assert!(
                found == Some(vec![text.clone()]) || name == "raw" && bytes(),
                "{name}: {found:?}"
            );
        }
        Value::Object(entries) => {
            for (key, value) in entries {
                check(contents, &format!("{name}.{key}"), value);
            }
        }
        Value::Array(items) if items.iter().all(Value::is_string) && !items.is_empty() => {
            let texts = items.iter().map(|item| item.as_str().unwrap().to_owned());
            assert_eq!(contents.texts(name), Some(texts.collect()), "{name}");
        }
        Value::Array(items) if items.iter().any(Value::is_object) => {
            for (index, item) in items.iter().enumerate() {
                check(contents, &format!("{name}.{index}"), item);
            }
        }
        _ => {
            let (shape, values) = numbers(expected);
            let found = contents
                .numbers(name)
                .unwrap_or_else(|| panic!("no {name}"));
            assert_eq!(found.values, values, "{name}");
            // JSON does not tell (0, 3) from (0,).
            if name != "empty" {
                assert_eq!(found.shape, shape, "{name}");
            }
        }
    }
}

/// The pickles of Python, NumPy 1 and 2, joblib, SciPy and chumpy, with the values that Python has, and those that must
/// be refused.
#[test]
fn pickles_are_read_or_refused_as_python_would_have_them() {
    let Some(folder) = shared_data().map(|data| data.join("robots/pickle")) else {
        return;
    };
    let text = fs::read_to_string(folder.join("expected.json")).unwrap();
    let expected: Value = serde_json::from_str(&text).unwrap();
    let codes: BTreeMap<&str, Code> = [
        ("structured", Code::PickleType),
        ("joblib_bz2", Code::PickleForm),
        ("joblib_lzma", Code::PickleForm),
        ("joblib_xz", Code::PickleForm),
        ("evil_system", Code::PickleCalls),
        ("evil_eval", Code::PickleCalls),
        ("evil_getattr", Code::PickleCalls),
        ("evil_numpy", Code::PickleCalls),
        // Its name is longer than the stated length, so it is not a valid pickle.
        ("evil_dotted", Code::PickleDamaged),
        ("evil_build", Code::PickleDamaged),
        ("next_buffer", Code::PickleForm),
        ("inst", Code::PickleCalls),
        ("ext", Code::PickleCalls),
        ("persid", Code::PickleForm),
        ("deep_lists", Code::PickleLimits),
        ("memo_bomb", Code::PickleLimits),
        ("self_reference", Code::PickleLimits),
        ("huge_length", Code::PickleDamaged),
        ("huge_shape", Code::PickleDamaged),
        ("no_stop", Code::PickleDamaged),
        ("empty_stack", Code::PickleDamaged),
        ("protocol6", Code::PickleForm),
    ]
    .into();
    let files = expected["files"].as_object().unwrap();
    let (mut read, mut refused) = (0, 0);
    for (file, verdict) in files {
        let path = folder.join(file);
        let name = file.strip_suffix(".pkl").unwrap();
        let contents = match open(&path) {
            Ok(contents) => contents,
            Err(error) => {
                assert_eq!(verdict["verdict"], "refuse", "{error}");
                assert_eq!(Some(&error.code), codes.get(name), "{error}");
                refused += 1;
                continue;
            }
        };
        assert_eq!(verdict["verdict"], "read", "{file}");
        read += 1;
        let warned: Vec<Code> = contents.warnings.iter().map(|it| it.code).collect();
        let arrays = &expected["arrays"];
        let is_warned = match name {
            "inert_enum" => vec![Code::InertObjects],
            "trailing" => vec![Code::TrailingBytes],
            _ => Vec::new(),
        };
        assert_eq!(warned, is_warned, "{file}");
        if verdict["values"] == "arrays" {
            for (key, value) in arrays.as_object().unwrap() {
                check(&contents, key, value);
            }
        }
        match name {
            "csc" => check(&contents, "J_regressor", &verdict["dense"]),
            "chumpy" => ["shapedirs", "v_template"]
                .map(|key| check(&contents, key, &arrays["f8"]))
                .into_iter()
                .collect(),
            "python2" => check(&contents, "poses", &verdict["poses"]),
            "inert_enum" => check(&contents, "dof_pos", &arrays["f8"]),
            "joblib_plain" => ["a", "f"]
                .iter()
                .for_each(|key| check(&contents, key, &arrays["f4"])),
            "joblib_shared" => ["0", "1"]
                .iter()
                .for_each(|key| check(&contents, key, &arrays["f4"])),
            "joblib_zlib" | "joblib_gzip" | "joblib_lz4" => {
                ["a", "f"]
                    .iter()
                    .for_each(|key| check(&contents, key, &arrays["f4"]));
            }
            "objects" => {
                check(&contents, "0", &Value::from(1));
                check(&contents, "1", &Value::from("two"));
            }
            _ => {}
        }
    }
    assert_eq!((read, refused), (21, 22));
}

/// A dict of two entries, by the opcodes of protocol 2.
fn dict(key: &str, value: &[u8]) -> Vec<u8> {
    let key = [&b"X"[..], &(key.len() as u32).to_le_bytes(), key.as_bytes()].concat();
    [&b"\x80\x02}"[..], &key, value, b"s."].concat()
}

/// Catches a machine that follows a file into an endless loop, more memory than the file's budget, or a panic.
#[test]
fn any_bytes_end_within_the_budget() {
    let opcodes = b"().012FGIJKLMNRSTUVXabcdefghijlpqrstuBC]}\x80\x81\x82\x85\x86\x87\x88\x89\x8a\x8b\x8c\x8d\x8e\
                    \x8f\x90\x91\x92\x93\x94\x95\x96\x97\0\x01\x02\x04\n1a";
    let some = prop::collection::vec(prop::sample::select(opcodes.to_vec()), 0..200);
    let words: [&[u8]; 9] = [
        b"cnumpy.core.multiarray\n_reconstruct\n",
        b"cnumpy\nndarray\n",
        b"cnumpy\ndtype\n",
        b"X\x02\0\0\0f4",
        b"cjoblib.numpy_pickle\nNumpyArrayWrapper\n",
        b"ccollections\nOrderedDict\n",
        b"cscipy.sparse.csc\ncsc_matrix\n",
        b"ca\nb\n",
        b"q\0h\0",
    ];
    let word = prop::sample::select(words.map(<[u8]>::to_vec).to_vec());
    let pieces = prop::collection::vec(prop_oneof![some, word], 0..12);
    proptest!(ProptestConfig::with_cases(512), |(pieces in pieces)| {
        let bytes = [&b"\x80\x02"[..], &pieces.concat(), b"."].concat();
        let limits = Limits { memory: Some(1 << 16), ..Limits::default() };
        let options = ReadOptions { limits, ..ReadOptions::default() };
        if let Err(error) = read_pickle("any", bytes, &options) {
            prop_assert!(!error.message.is_empty());
        }
    });
}

/// A value that is referred to a million times takes memory once; references that expand to too much are refused.
#[test]
fn references_are_shared_and_their_expansion_is_refused() {
    // Each list contains the list before it twice.
    let doubled = |times: usize| {
        let mut bytes = b"\x80\x02]\x94".to_vec();
        for index in 0..times {
            bytes.extend(b"](");
            bytes.extend([b'h', index as u8, b'h', index as u8]);
            bytes.extend(b"e\x94");
        }
        bytes.push(b'.');
        bytes
    };
    let read = |times| Contents::read("doubled", doubled(times), Limits::default());
    assert!(read(8).is_ok());
    let refused = read(40).err().unwrap();
    assert_eq!(refused.code, Code::PickleLimits);
    assert!(
        refused.message.contains("2199023255551 values"),
        "{refused}"
    );
}

/// No more than 60 characters of a text of the file are in a message.
#[test]
fn messages_show_little_of_a_file() {
    let long = "x".repeat(500);
    let call = format!("cos\n{long}\n.");
    let error = Contents::read("a", call.into_bytes(), Limits::default()).err();
    let error = error.unwrap();
    assert_eq!(error.code, Code::PickleCalls);
    assert!(
        error.message.contains("os.xxx") && !error.message.contains(&long[..61]),
        "{error}"
    );
}

/// In Python, dots in a name lead to members of a class; nothing is read from modules of attacks.
#[test]
fn names_that_python_would_run_are_refused() {
    for class in [
        "a\nb.c",
        "numpy\nload",
        "torch.serialization\nload",
        "os.path\njoin",
        "code\ninteract",
    ] {
        let file = format!("c{class}\n.").into_bytes();
        let error = Contents::read("a", file, Limits::default()).err().unwrap();
        assert_eq!(error.code, Code::PickleCalls, "{class}");
    }
    let file = b"cosx\nsystem\n(S'a'\ntR.".to_vec();
    let contents = Contents::read("a", file, Limits::default()).unwrap();
    assert_eq!(contents.entries()[0].kind, "object of osx.system");
}

/// A dict with a class for missing values is a dict, and a class of a long module is named in full. Truth values, also
/// those of `PyTorch`, have their type.
#[test]
fn dicts_with_defaults_are_dicts_and_classes_have_their_names() {
    for class in ["list", "int", "long", "unicode"] {
        let call = format!("ccollections\ndefaultdict\n(c__builtin__\n{class}\ntRX\x01\0\0\0kG");
        let file = [call.as_bytes(), &2.5f64.to_be_bytes(), b"s."].concat();
        let contents = Contents::read("a", file, Limits::default()).unwrap();
        let entries: Vec<(String, String)> = (contents.entries().into_iter())
            .map(|entry| (entry.name, entry.kind))
            .collect();
        assert_eq!(entries, [("k".to_owned(), "() f8".to_owned())], "{class}");
        assert_eq!(contents.numbers("k").unwrap().values, [2.5]);
    }
    let called = Contents::read(
        "a",
        b"c__builtin__\nint\n(S'1'\ntR.".to_vec(),
        Limits::default(),
    );
    assert_eq!(called.err().unwrap().code, Code::PickleDamaged);
    let class = "protomotions.simulator.base_simulator.simulator_state\nStateConversion";
    let file = dict("state", format!("c{class}\n(S'common'\ntR").as_bytes());
    let contents = Contents::read("a", file, Limits::default()).unwrap();
    let named = "`state` of protomotions.simulator.base_simulator.simulator_state.StateConversion";
    let warning = &contents.warnings[0];
    assert!(warning.message.contains(named), "{warning}");
    let contents = Contents::read("a", dict("on", b"\x88"), Limits::default()).unwrap();
    assert_eq!(contents.entries()[0].kind, "() bool");
    assert_eq!(contents.numbers("on").unwrap().values, [1.0]);
}

/// A value of a dict in a dict is named with a point, in `--map` too.
#[test]
fn nested_values_have_names_with_points() {
    let pose = |x: &str| format!("((F{x}\nF0.0\nF0.0\nF1.0\nll");
    let keys = format!("({}{}l", pose("0.0"), pose("0.0"));
    let inner = [&b"}X\x01\0\0\0k"[..], keys.as_bytes(), b"s"].concat();
    let file = dict("a", &inner);
    let contents = Contents::read("nested", file.clone(), Limits::default()).unwrap();
    assert_eq!(contents.numbers("a.k").unwrap().shape, [2, 1, 4]);
    let options = ReadOptions {
        map: Some("rotations=a.k:xyzw:frame".to_owned()),
        source_rate: Some("30".parse().unwrap()),
        ..ReadOptions::default()
    };
    let loaded = read_pickle("nested", file, &options).unwrap();
    let set = &loaded.clips[0].set;
    assert_eq!((set.track_count(), set.key_count()), (1, 2));
}

/// The bytes of an array of objects with this shape.
fn objects(shape: &str, items: &str) -> Vec<u8> {
    let header = format!("{{'descr': '|O', 'fortran_order': False, 'shape': {shape}, }}");
    let lengths = shape
        .split(|c: char| !c.is_ascii_digit())
        .filter(|part| !part.is_empty());
    let lengths: String = lengths.map(|length| format!("I{length}\n")).collect();
    let pickle = format!(
        "cnumpy.core.multiarray\n_reconstruct\n(cnumpy\nndarray\n(I0\ntS'b'\ntR(I1\n({lengths}tcnumpy\ndtype\n(S'O8'\nI0\nI1\n\
         tR(I3\nS'|'\nNNNI-1\nI-1\nI63\ntbI00\n{items}tb."
    );
    let start = &b"\x93NUMPY\x01\0\x76\0"[..];
    [
        start,
        format!("{header:117}\n").as_bytes(),
        pickle.as_bytes(),
    ]
    .concat()
}

/// A ZIP archive of arrays.
fn archive(arrays: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, bytes) in arrays {
        let stored = zip::write::SimpleFileOptions::default()
            .compression_method(zip::CompressionMethod::Stored);
        zip.start_file(format!("{name}.npy"), stored).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

/// Keys in a dict in an array of objects are read. Where only numbers can be meant, such arrays are refused (E306).
#[test]
fn arrays_of_objects_are_read_where_they_may_be() {
    let pose = "((F0.0\nF0.0\nF0.0\nF1.0\nll";
    let dict = format!("(l(dS'rotations'\n({pose}lsS'times'\n(F0.5\nlsa");
    let bytes = archive(&[("data", objects("()", &dict))]);
    let options = ReadOptions {
        map: Some("rotations=data.rotations:track,time=data.times".to_owned()),
        ..ReadOptions::default()
    };
    let loaded = read_npz("nested.npz", bytes.clone(), &options).unwrap();
    let track = loaded.clips[0].set.track(0);
    assert_eq!(
        (track.times, track.keys),
        (&[0.5][..], &[Quat::IDENTITY][..])
    );
    // An array of objects keeps its shape: two keys of four numbers.
    let poses = objects(
        "(2, 4)",
        "(F0.0\nF0.0\nF0.0\nF1.0\nF0.0\nF0.0\nF0.0\nF1.0\nl",
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("poses.pkl");
    fs::write(&path, &poses[128..]).unwrap();
    let entries = open(&path).unwrap().entries();
    let kinds: Vec<&str> = entries.iter().map(|entry| &*entry.kind).collect();
    assert_eq!(kinds, ["(2, 4) f8"]);
    let single = read_npy("nested.npy", objects("()", &dict), &ReadOptions::default()).unwrap();
    assert_eq!(single.clips[0].set.track_count(), 1);

    let none = |shape: &str, count: usize| objects(shape, &format!("({}l", "N".repeat(count)));
    let model = archive(&[
        ("v_template", none("(1, 3)", 3)),
        ("shapedirs", none("(1, 3, 1)", 3)),
        ("J_regressor", none("(1, 1)", 1)),
        ("kintree_table", none("(2, 1)", 2)),
    ]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.npz");
    fs::write(&path, model).unwrap();
    let clip = Motion {
        body: Some(Body::default()),
        ..Motion::default()
    };
    let refused = body_offsets(&path, &clip, Limits::default()).unwrap_err();
    assert_eq!(refused.code, Code::Pickled, "E306, not {refused}");
}

/// A model of SMPL in a pickle: the joints are those of the same model as NPZ.
#[test]
fn a_model_of_a_body_may_be_a_pickle() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/body");
    let bytes = fs::read(folder.join("male.npz")).unwrap();
    let options = ReadOptions {
        has_body_model: true,
        ..ReadOptions::default()
    };
    let clip = read_npz("male.npz", bytes, &options)
        .unwrap()
        .clips
        .remove(0);
    let model = folder.join("models/SMPL_MALE.npz");
    let expected = body_offsets(&model, &clip, Limits::default()).unwrap();
    let mut zip = zip::ZipArchive::new(fs::File::open(&model).unwrap()).unwrap();
    // A dict of lists, by the opcodes of protocol 0 and BINFLOAT.
    let mut pickle = b"}".to_vec();
    for name in ["v_template", "shapedirs", "J_regressor", "kintree_table"] {
        let mut bytes = Vec::new();
        zip.by_name(&format!("{name}.npy"))
            .unwrap()
            .read_to_end(&mut bytes)
            .unwrap();
        let file = npyz::NpyFile::new(&bytes[..]).unwrap();
        let shape: Vec<usize> = file.shape().iter().map(|&length| length as usize).collect();
        let numbers: Vec<f64> = match name {
            "kintree_table" => {
                let numbers = file.into_vec::<u32>().unwrap();
                numbers.into_iter().map(f64::from).collect()
            }
            _ => {
                let numbers = file.into_vec::<f32>().unwrap();
                numbers.into_iter().map(f64::from).collect()
            }
        };
        pickle.extend(format!("S'{name}'\n").into_bytes());
        pickle.extend(list(&shape, &numbers));
        pickle.push(b's');
    }
    pickle.push(b'.');
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("SMPL_MALE.pkl"), pickle).unwrap();
    let found = body_offsets(folder.path(), &clip, Limits::default()).unwrap();
    assert_eq!(found, expected);
}

/// An array as lists in lists.
fn list(shape: &[usize], numbers: &[f64]) -> Vec<u8> {
    let Some((&length, inner)) = shape.split_first() else {
        return [&b"G"[..], &numbers[0].to_be_bytes()].concat();
    };
    let each = numbers.len() / length;
    let items = numbers.chunks(each).flat_map(|part| list(inner, part));
    [b'('].into_iter().chain(items).chain(*b"l").collect()
}

/// An array of floats.
fn floats(shape: &str, values: &[f64]) -> Vec<u8> {
    let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}");
    let numbers = values.iter().flat_map(|value| value.to_le_bytes());
    let start = &b"\x93NUMPY\x01\0\x76\0"[..];
    let header = format!("{header:117}\n");
    [start, header.as_bytes(), &numbers.collect::<Vec<u8>>()].concat()
}

/// Names in arrays of objects, as `np.array(names, dtype=object)` stores them, name the joints; where an array of names
/// has no texts, and where an array cannot be read, this is said.
#[test]
fn names_of_joints_are_never_lost_silently() {
    let file = |names: Vec<u8>, more: Option<(&str, Vec<u8>)>| {
        let mut arrays = vec![
            ("fps", floats("()", &[30.0])),
            ("body_positions", floats("(2, 1, 3)", &[0.0; 6])),
            (
                "body_rotations",
                floats("(2, 1, 4)", &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]),
            ),
            ("dof_positions", floats("(2, 2)", &[0.1, 0.2, 0.3, 0.4])),
            ("dof_names", names),
        ];
        arrays.extend(more);
        read_npz("motion.npz", archive(&arrays), &ReadOptions::default())
    };
    let names = || objects("(2,)", "(S'knee'\nS'hip'\nl");
    let loaded = file(names(), None).unwrap();
    let set = &loaded.clips[0].set;
    assert_eq!(set.scalar_named("knee"), Some(0));
    assert_eq!(set.scalar(1).unwrap().keys, [0.2, 0.4]);
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);

    let refused = file(objects("(2,)", "(I1\nI2\nl"), None).unwrap_err();
    assert_eq!(refused.code, Code::ElementType);
    assert!(
        refused.message.contains("no text; save its texts as such"),
        "{refused}"
    );

    // Elements of the type `numpy.str_`, as in `numpy.array(list(names), dtype=object)` if `names` is an array of
    // texts.
    let numpy_text = |text: &str| {
        let words: String = text
            .chars()
            .map(|c| format!("{c}\\x00\\x00\\x00"))
            .collect();
        let (length, bytes) = (text.len(), 4 * text.len());
        format!(
            "cnumpy.core.multiarray\nscalar\n(cnumpy\ndtype\n(S'U{length}'\nI0\nI1\ntR(I3\nS'<'\nNNNI{bytes}\nI4\nI8\ntb\
             S'{words}'\ntR"
        )
    };
    let items = format!("({}{}l", numpy_text("knee"), numpy_text("hip"));
    let loaded = file(objects("(2,)", &items), None).unwrap();
    let set = &loaded.clips[0].set;
    assert_eq!(
        (set.scalar_named("knee"), set.scalar_named("hip")),
        (Some(0), Some(1))
    );
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);

    let refused = file(objects("(2,)", "(S'knee'\nNl"), None).unwrap_err();
    assert_eq!(refused.code, Code::ElementType);
    assert!(
        refused
            .message
            .contains("`dof_names` has values that are no text"),
        "{refused}"
    );

    let damaged = floats("(-5, 2)", &[0.0; 4]);
    let loaded = file(names(), Some(("joint_vel", damaged.clone()))).unwrap();
    let warning = loaded.warnings[0].to_string();
    let expected = "the headers of these arrays cannot be read: `joint_vel` (";
    assert!(warning.contains(expected), "{warning}");
    let only = archive(&[("joint_pos", damaged)]);
    let refused = read_npz("cut.npz", only, &ReadOptions::default()).unwrap_err();
    let expected = "the headers of these cannot be read: `joint_pos` (";
    assert!(refused.message.contains(expected), "{refused}");
}
