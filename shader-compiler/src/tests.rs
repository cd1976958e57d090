use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use super::{Declared, Functions, Module, ROOT, compile, hashes, stale};

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
#[should_panic(expected = "use only + - * on f32, comparisons and integers")]
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

/// The text of a function in a kernel that has only it.
fn function(name: &str, source: &str) -> String {
    let mut functions = Functions::new(BTreeSet::new());
    add(&mut functions, source);
    functions.text(name).to_owned()
}

fn add(functions: &mut Functions, source: &str) {
    let Module {
        name, parsed, info, ..
    } = &parse(source);
    functions.collect(name, source, parsed, info);
}

#[test]
fn functions_are_written_for_as_many_numbers_as_their_operations_allow() {
    for (name, source, expected) in [
        (
            "cubic",
            "fn cubic(a: vec4f, s: f32) -> vec4f { let z = s * s; return a - (a * z - a); }",
            "fn cubic<N: Number>(a: N, s: N, ) -> N {\nlet z = s * s;\na - (a * z - a)\n}",
        ),
        (
            "normalised",
            "fn normalised(q: vec3f) -> vec3f { return q * (q.x + 2.0); }",
            "fn normalised<N: Number>(q: [N; 3], ) -> [N; 3] {\nlet number_1 = q[0] + N::all(2.0);\n\
             [q[0] * number_1, q[1] * number_1, q[2] * number_1]\n}",
        ),
        (
            "wrapped",
            "fn wrapped(a: f32) -> f32 { return select(a, -a, a < 2.0); }",
            "fn wrapped(a: f32, ) -> f32 {\nif a < 2.0 { -a } else { a }\n}",
        ),
        (
            "to_half",
            "fn to_half(a: vec4f) -> vec4u { return bitcast<vec4u>(a) + vec4u(3u); }",
            "fn to_half(a: f32, ) -> u32 {\na.to_bits().wrapping_add(3)\n}",
        ),
        (
            "flushed",
            "const LIMIT: u32 = 9;
             fn flushed(x: f32) -> f32 { return select(x, 0.0, (bitcast<u32>(x) & 0x7fffffffu) < LIMIT); }",
            "fn flushed<N: Number>(x: N, ) -> N {\nx.zero_below(f32::from_bits(LIMIT))\n}",
        ),
        (
            "small_angle_cubic",
            "fn small_angle_cubic(a: vec3f, b: vec3f, c: vec4f) -> vec3f {
                 return select(a + b, b, (c.x + c.y <= 2.0) & (c.z != 1.0));
             }",
            "fn small_angle_cubic<N: Choice>(a: [N; 3], b: [N; 3], c: [N; 4], ) -> [N; 3] {\n\
             let number_1 = (c[0] + c[1]).at_most(N::all(2.0)) & !c[2].equals(N::all(1.0));\n\
             [N::choose(number_1, b[0], a[0] + b[0]), N::choose(number_1, b[1], a[1] + b[1]), \
             N::choose(number_1, b[2], a[2] + b[2])]\n}",
        ),
        (
            "rotation_about",
            "fn rotation_about(a: f32, b: f32) -> f32 {
                 let bits = bitcast<u32>(a + b);
                 return select(a, -b, (bits & 2u) == 2u);
             }",
            "fn rotation_about<N: Choice>(a: N, b: N, ) -> N {\n\
             N::choose((a + b).has_bits(2), -b, a)\n}",
        ),
    ] {
        let text = function(name, source);
        assert!(text.contains(expected), "{text}");
    }
}

/// Values that are computed before the cut are not computed again after it.
#[test]
fn functions_with_a_cut_are_written_in_two_parts() {
    let source = "fn polynomial(c: array<vec4f, 11>, s: f32) -> vec4f {
        let z = s * s;
        let low = c[1] * s + c[0];
        let zz = z * z;
        return c[2] * z + (c[3] * zz + low);
    }";
    let text = function("polynomial", source);
    for expected in [
        "fn polynomial_begin<N: Number>(s: N, ) -> PolynomialBegun<N> {\nlet z = s * s;\nlet zz = z * z;\n",
        "fn polynomial_end<N: Number>(c: [N; 11], begun: PolynomialBegun<N>, ) -> N {\n\
         let PolynomialBegun { s, z, zz } = begun;\nlet low = c[1] * s + c[0];\n\
         c[2] * z + (c[3] * zz + low)\n",
        "polynomial_end(c, polynomial_begin(s, ))\n",
    ] {
        assert!(text.contains(expected), "{text}");
    }
}

#[test]
#[should_panic(expected = "kernel: another function wrapped than elsewhere")]
fn two_functions_of_one_name_are_an_error() {
    let mut functions = Functions::new(BTreeSet::new());
    for sum in ["a + 1.0", "a + 2.0"] {
        add(
            &mut functions,
            &format!("fn wrapped(a: f32) -> f32 {{ return {sum}; }}"),
        );
    }
}

#[test]
#[should_panic(expected = "wrapped in Rust")]
fn a_function_that_cannot_be_written_is_an_error() {
    let _ = function("wrapped", "fn wrapped(a: f32) -> f32 { return sqrt(a); }");
}
