//! A `.gltf` and its files become one GLB, or stay beside each other.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};
use tumble_formats::format::MotionOptions;
use tumble_formats::{Code, Diagnostic, Loaded, ReadOptions};

use crate::gltf::{fixture, json_of, open};
use crate::gltf_bake::{document, refused};
use crate::support::shared_data;

const PNG: &[u8] = b"\x89PNG\r\n\x1a\nnot much of a picture";

fn written(loaded: &Loaded, to: &Path) -> (Vec<u8>, Vec<Diagnostic>) {
    let mut bytes = Vec::new();
    let warnings = document(loaded)
        .write(&[], &MotionOptions::default(), to, &mut bytes)
        .unwrap();
    (bytes, warnings)
}

fn json_and_bin(glb: &[u8]) -> (Value, Vec<u8>) {
    let length = u32::from_le_bytes(*glb[12..].first_chunk().unwrap()) as usize;
    let json = serde_json::from_slice(&glb[20..20 + length]).unwrap();
    (json, glb[28 + length..].to_vec())
}

/// Buffers keep their order in the BIN chunk, each view its bytes; images that are files become views,
/// and files that are not found keep their URI.
#[test]
fn buffers_and_images_are_taken_in() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = json_of(&fixture("uri_beside.gltf"));
    let keys = fs::read(fixture("keys beside.bin")).unwrap();
    fs::write(folder.path().join("keys.bin"), &keys).unwrap();
    fs::write(folder.path().join("skin.png"), PNG).unwrap();
    fs::write(folder.path().join("photo.jpg"), b"\xff\xd8\xff and so on").unwrap();
    fs::write(folder.path().join("notes.txt"), b"no picture").unwrap();
    file["buffers"] = json!([
        {"byteLength": 3, "uri": "data:,abc", "name": "first"},
        {"byteLength": 4, "extensions": {"EXT_meshopt_compression": {"fallback": true}}},
        {"byteLength": 40, "uri": "keys.bin"},
        {"byteLength": 9, "uri": "lost.bin"},
    ]);
    file["bufferViews"] = json!([
        {"buffer": 2, "byteLength": 8},
        {"buffer": 2, "byteLength": 32, "byteOffset": 8},
        {"buffer": 0, "byteLength": 3},
        {"buffer": 1, "byteLength": 4, "extensions": {"EXT_meshopt_compression": {
            "buffer": 2, "byteLength": 5, "byteStride": 4, "count": 1, "mode": "ATTRIBUTES"}}},
        {"buffer": 3, "byteLength": 9},
    ]);
    file["images"] = json!([
        {"uri": "skin.png", "name": "skin"},
        {"name": "photo", "uri": "photo.jpg", "mimeType": "image/jpeg"},
        {"uri": "gone.png"},
        {"uri": "../secret.png"},
        {"uri": "notes.txt"},
        {"uri": "data:image/png;base64,AA=="},
    ]);
    let path = folder.path().join("walk.gltf");
    fs::write(&path, serde_json::to_string_pretty(&file).unwrap()).unwrap();
    let loaded = open(&path);
    let (glb, warnings) = written(&loaded, Path::new("/elsewhere/walk.glb"));
    let (found, bin) = json_and_bin(&glb);
    assert_eq!(bin[..44], [b"abc\0", &*keys].concat());
    assert_eq!(bin[44..44 + PNG.len()], *PNG);
    let buffers = json!([
        {"byteLength": bin.len() - 3, "name": "first"},
        {"byteLength": 4, "extensions": {"EXT_meshopt_compression": {"fallback": true}}},
        {"byteLength": 9, "uri": "lost.bin"},
    ]);
    assert_eq!(found["buffers"], buffers);
    let views = json!([
        {"buffer": 0, "byteLength": 8, "byteOffset": 4},
        {"buffer": 0, "byteLength": 32, "byteOffset": 12},
        {"buffer": 0, "byteLength": 3},
        {"buffer": 1, "byteLength": 4, "extensions": {"EXT_meshopt_compression": {
            "buffer": 0, "byteLength": 5, "byteOffset": 4, "byteStride": 4, "count": 1,
            "mode": "ATTRIBUTES"}}},
        {"buffer": 2, "byteLength": 9},
        {"buffer": 0, "byteLength": PNG.len(), "byteOffset": 44},
        {"buffer": 0, "byteLength": 13, "byteOffset": 44 + PNG.len().next_multiple_of(4)},
    ]);
    assert_eq!(found["bufferViews"], views);
    let images = json!([
        {"bufferView": 5, "mimeType": "image/png", "name": "skin"},
        {"name": "photo", "bufferView": 6, "mimeType": "image/jpeg"},
        {"uri": "gone.png"},
        {"uri": "../secret.png"},
        {"uri": "notes.txt"},
        {"uri": "data:image/png;base64,AA=="},
    ]);
    assert_eq!(found["images"], images);
    assert_eq!(
        (warnings.len(), warnings[0].code, warnings[0].count),
        (1, Code::StaysOutside, 4)
    );
    let said = warnings[0].to_string();
    assert!(
        said.contains("/buffers/3/uri: warning[W110]: lost.bin: cannot be read"),
        "{said}"
    );
    let again = tumble_formats::gltf::read_gltf("t", glb, None, &ReadOptions::default()).unwrap();
    assert_eq!(again.clips[0].set, loaded.clips[0].set);
}

/// A compressed file whose parts lie beside each other: it stays compressed.
#[test]
fn compressed_views_are_gathered_too() {
    let Some(data) = shared_data() else { return };
    let folder = tempfile::tempdir().unwrap();
    for name in ["fox_meshopt_ext.glb", "fox_meshopt_khr.glb"] {
        let original = fs::read(data.join("gltf").join(name)).unwrap();
        let (mut file, bin) = json_and_bin(&original);
        fs::write(folder.path().join("fox.bin"), &bin).unwrap();
        file["buffers"][0]["uri"] = "fox.bin".into();
        let path = folder.path().join("fox.gltf");
        fs::write(&path, file.to_string()).unwrap();
        let loaded = open(&path);
        let (glb, warnings) = written(&loaded, Path::new("/fox.glb"));
        assert_eq!(warnings, []);
        let (found, gathered) = json_and_bin(&glb);
        let length = file["buffers"][0]["byteLength"].as_u64().unwrap() as usize;
        assert!(gathered[..length] == bin[..length], "{name}");
        file["buffers"][0].as_object_mut().unwrap().remove("uri");
        assert_eq!(found, file, "{name}");
    }
}

#[test]
fn text_is_written_beside_its_files_alone() {
    let folder = tempfile::tempdir().unwrap();
    let beside = folder.path().join("walk.gltf");
    fs::copy(fixture("uri_beside.gltf"), &beside).unwrap();
    fs::copy(
        fixture("keys beside.bin"),
        folder.path().join("keys beside.bin"),
    )
    .unwrap();
    let loaded = open(&beside);
    let (text, _) = written(&loaded, &folder.path().join("walk60.gltf"));
    assert!(text == fs::read(&beside).unwrap());
    let other = tempfile::tempdir().unwrap();
    let mut out = Vec::new();
    let elsewhere = document(&loaded).write(
        &[],
        &MotionOptions::default(),
        &other.path().join("walk.gltf"),
        &mut out,
    );
    let why = refused(elsewhere.unwrap_err());
    assert_eq!((why.code, out.len()), (Code::GltfFolder, 0));
    assert!(
        why.to_string()
            .contains("/buffers/0/uri: error[E116]: `keys%20beside.bin`"),
        "{why}"
    );
    // A file that refers to no other files may be written into any folder.
    written(
        &open(&fixture("cubic.gltf")),
        &other.path().join("cubic.gltf"),
    );
    let glb = open(&fixture("whole.glb"));
    let as_text = document(&glb).write(
        &[],
        &MotionOptions::default(),
        &folder.path().join("whole.gltf"),
        &mut out,
    );
    assert_eq!(refused(as_text.unwrap_err()).code, Code::GltfFolder);
}

/// A GLB may refer to files as well; if it is written into another folder, a message says so.
#[test]
fn a_glb_away_from_its_files_has_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let (mut file, bin) = json_and_bin(&fs::read(fixture("whole.glb")).unwrap());
    file["images"] = json!([{"uri": "skin.png"}]);
    let mut text = file.to_string();
    text += &" ".repeat(text.len().wrapping_neg() % 4);
    let word = |number: usize| (number as u32).to_le_bytes();
    let mut glb = [&b"glTF"[..], &word(2), &word(28 + text.len() + bin.len())].concat();
    glb.extend([&word(text.len())[..], b"JSON", text.as_bytes()].concat());
    glb.extend([&word(bin.len())[..], b"BIN\0", &bin].concat());
    let path = folder.path().join("a.glb");
    fs::write(&path, &glb).unwrap();
    let loaded = open(&path);
    assert_eq!(
        written(&loaded, &folder.path().join("b.glb")),
        (glb.clone(), vec![])
    );
    let (bytes, warnings) = written(&loaded, Path::new("/b.glb"));
    assert!(bytes == glb);
    assert_eq!(warnings[0].code, Code::StaysOutside);
    assert_eq!(
        warnings[0].location.as_ref().unwrap().to_string(),
        "/images/0/uri"
    );
}

/// A buffer without a URI is the BIN chunk of a GLB if it is the first, and no other may be.
#[test]
fn buffers_without_a_uri_stay_such() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = json_of(&fixture("one_key.gltf"));
    let with_data = file["buffers"][0].clone();
    let unnamed = json!({"byteLength": 4});
    file["buffers"] = json!([unnamed, with_data]);
    for view in file["bufferViews"].as_array_mut().unwrap() {
        view["buffer"] = json!(1);
    }
    let mut none = file.clone();
    none["buffers"] = json!([unnamed]);
    none["bufferViews"] = json!([]);
    // Accessors without a buffer view are zeros; here they are one key.
    none["accessors"] = json!([
        {"componentType": 5126, "count": 1, "type": "SCALAR", "min": [0], "max": [0]},
        {"componentType": 5126, "count": 1, "type": "VEC3"},
    ]);
    none["animations"][0]["channels"][0]["target"]["path"] = json!("translation");
    let mut made = Vec::new();
    for (name, file, buffers) in [("second", &file, 2), ("alone", &none, 2)] {
        let path = folder.path().join(format!("{name}.gltf"));
        fs::write(&path, file.to_string()).unwrap();
        let loaded = tumble_formats::gltf::open_gltf(&path, &ReadOptions::default()).unwrap();
        let (glb, _) = written(&loaded, Path::new("/elsewhere/walk.glb"));
        let (found, bin) = json_and_bin(&glb);
        let list = found["buffers"].as_array().unwrap();
        assert_eq!(list.len(), buffers, "{name}: {found}");
        assert!(
            list.iter().all(|entry| entry.get("uri").is_none()),
            "{found}"
        );
        assert_eq!(list[1], unnamed, "{found}");
        assert_eq!(list[0]["byteLength"], json!(bin.len()), "{found}");
        let path = folder.path().join(format!("{name}.glb"));
        fs::write(&path, glb).unwrap();
        made.push(path);
    }
    let missing = "BUFFER_MISSING_GLB_DATA";
    for report in crate::validator::validate(&made).unwrap_or_default() {
        assert!(
            !report.errors.iter().any(|error| error.contains(missing)),
            "{report:?}"
        );
    }
}

/// glTF itself has PNG and JPEG: another kind of image is embedded where an extension's texture has it.
#[test]
fn images_of_extensions_are_embedded_for_them_alone() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = json_of(&fixture("one_key.gltf"));
    fs::write(folder.path().join("a.ktx2"), b"\xabKTX 20\xbb and so on").unwrap();
    file["images"] = json!([{"uri": "a.ktx2"}, {"uri": "a.ktx2"}]);
    file["textures"] = json!([
        {"source": 0},
        {"extensions": {"KHR_texture_basisu": {"source": 1}}},
    ]);
    let path = folder.path().join("walk.gltf");
    fs::write(&path, file.to_string()).unwrap();
    let (glb, warnings) = written(&open(&path), Path::new("/elsewhere/walk.glb"));
    let (found, _) = json_and_bin(&glb);
    assert_eq!(found["images"][0], json!({"uri": "a.ktx2"}));
    assert_eq!(found["images"][1]["mimeType"], json!("image/ktx2"));
    let codes: Vec<Code> = warnings.iter().map(|warning| warning.code).collect();
    assert!(codes.contains(&Code::StaysOutside), "{warnings:?}");
}
