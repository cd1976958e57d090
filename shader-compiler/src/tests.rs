use std::fs;
use std::path::Path;

use super::{Declared, Module, ROOT, compile, hashes, stale};

#[test]
fn what_is_checked_in_is_what_the_shaders_compile_to() {
    let stale = stale(Path::new(ROOT), &compile());
    assert!(
        stale.is_empty(),
        "{stale:?} are not what the shaders compile to; run `cargo run -p tumble-shaders`"
    );
}

/// The comparison can fail.
#[test]
fn a_changed_byte_and_a_missing_file_are_stale() {
    let root = tempfile::tempdir().unwrap();
    let files = vec![("code", vec![1, 2, 3]), ("list", vec![4])];
    assert_eq!(stale(root.path(), &files), ["code", "list"]);
    fs::write(root.path().join("code"), [1, 2, 3]).unwrap();
    fs::write(root.path().join("list"), [4]).unwrap();
    assert!(stale(root.path(), &files).is_empty());
    fs::write(root.path().join("code"), [1, 2, 4]).unwrap();
    assert_eq!(stale(root.path(), &files), ["code"]);
}

#[test]
fn the_list_says_which_files_are_changed_new_or_gone() {
    let root = tempfile::tempdir().unwrap();
    fs::create_dir_all(root.path().join("shaders/math")).unwrap();
    for (file, text) in [("same", "1"), ("math/changed", "2"), ("new", "3")] {
        fs::write(root.path().join(format!("shaders/{file}.wgsl")), text).unwrap();
    }
    fs::write(root.path().join("shaders/notes.txt"), "no shader").unwrap();
    let now = hashes::of_folder(root.path(), "shaders").unwrap();
    let list = format!(
        "{} shaders/same.wgsl\n{} shaders/math/changed.wgsl\n{} shaders/gone.wgsl\n",
        hashes::hash(b"1"),
        hashes::hash(b"1"),
        hashes::hash(b"4")
    );
    assert_eq!(
        hashes::changed(&list, &now),
        [
            "shaders/gone.wgsl",
            "shaders/math/changed.wgsl",
            "shaders/new.wgsl"
        ]
    );
    assert_eq!(hashes::hash(b"foobar"), "85944171f73967e8"); // of FNV's authors
}

fn parse(source: &str) -> Module {
    Module::parse("kernel".to_owned(), source.to_owned())
}

#[test]
#[should_panic(expected = "kernel: error: no definition in scope for identifier: `b`")]
fn a_broken_shader_is_an_error() {
    let _ = parse("const A: f32 = b;");
}

#[test]
#[should_panic(expected = "use only + - * and integers")]
fn an_inexact_shader_is_an_error() {
    let source = "@group(0) @binding(0) var<storage, read_write> values: array<f32>;
        @compute @workgroup_size(1) fn main() { values[0] = values[1] / values[2]; }";
    let _ = parse(source).spirv();
}

#[test]
#[should_panic(expected = "two structs `Item` differ")]
fn a_struct_of_two_layouts_is_an_error() {
    let mut declared = Declared::default();
    for member in ["f32", "u32"] {
        let source = format!("struct Item {{ first: {member} }}");
        declared.collect("kernel", &parse(&source).parsed);
    }
}
