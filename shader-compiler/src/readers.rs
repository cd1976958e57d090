//! The bindings of a kernel, and the functions that read one element of a buffer: from a storage
//! buffer directly, or from a texel buffer, whose texels of 16 bytes are put together to elements.

use std::fmt::Write;

use naga::{Module, Scalar, ScalarKind, TypeInner, VectorSize};

use crate::table::Read;

/// WGSL that declares what a kernel reads, as storage buffers, and what it stores into.
pub(crate) fn storage(reads: &[&Read]) -> String {
    let mut text = String::new();
    for (binding, read) in reads.iter().enumerate() {
        let Read {
            buffer,
            element,
            function,
        } = read;
        writeln!(
            text,
            "@group(0) @binding({binding}) var<storage, read> {buffer}: array<{element}>;
             fn {function}(index: u32) -> {element} {{ return {buffer}[index]; }}"
        )
        .unwrap();
    }
    text + &output(reads.len())
}

/// The same with texel buffers, which WGSL knows as textures of one dimension; `module` is the
/// kernel with storage buffers, whose types say where fields lie.
pub(crate) fn texels(reads: &[&Read], module: &Module) -> String {
    let mut text = String::new();
    for (binding, read) in reads.iter().enumerate() {
        let Read {
            buffer,
            element,
            function,
        } = read;
        let body = reader(read, module, |texel| {
            format!("textureLoad({buffer}, {texel}, 0)")
        });
        writeln!(
            text,
            "@group(0) @binding({binding}) var {buffer}: texture_1d<u32>;
             fn {function}(index: u32) -> {element} {{\n{body}}}"
        )
        .unwrap();
    }
    text + &output(reads.len())
}

/// The same with storage buffers of vectors: drivers do not always find that numbers side by side can be loaded as one.
pub(crate) fn vectors(reads: &[&Read], module: &Module) -> String {
    let mut text = String::new();
    for (binding, read) in reads.iter().enumerate() {
        let Read {
            buffer,
            element,
            function,
        } = read;
        let (stored, body) = match fields(read, module).1.is_multiple_of(16) {
            true => (
                "vec4u",
                reader(read, module, |vector| format!("{buffer}[{vector}]")),
            ),
            false => (*element, format!("return {buffer}[index];\n")),
        };
        writeln!(
            text,
            "@group(0) @binding({binding}) var<storage, read> {buffer}: array<{stored}>;
             fn {function}(index: u32) -> {element} {{\n{body}}}"
        )
        .unwrap();
    }
    text + &output(reads.len())
}

fn output(binding: usize) -> String {
    format!("@group(0) @binding({binding}) var<storage, read_write> rotations: array<Stored>;\n")
}

/// A field of an element.
#[derive(Clone, Copy)]
enum Field {
    Scalar(ScalarKind),
    Vector(ScalarKind),
    /// An array of this many vectors of four f32.
    Vectors(u32),
}

/// The function that puts an element together from the texels that it lies in.
fn reader(read: &Read, module: &Module, load: impl Fn(&str) -> String) -> String {
    let (fields, size) = fields(read, module);
    let value = |kind: ScalarKind, words: String| match kind {
        ScalarKind::Uint => words,
        ScalarKind::Sint => format!("bitcast<i32>({words})"),
        _ => format!("bitcast<f32>({words})"),
    };
    let vector = |kind: ScalarKind, words: String| match kind {
        ScalarKind::Uint => words,
        _ => format!("bitcast<vec4f>({words})"),
    };
    let scalars = |names: &[&str]| -> String {
        let all = fields.iter().zip(names).map(|(field, name)| match *field {
            Field::Scalar(kind) => value(kind, (*name).to_owned()),
            _ => panic!("{}: only scalars may lie across texels", read.element),
        });
        let all: Vec<String> = all.collect();
        match &*all {
            [one] if fields.len() == 1 => one.clone(),
            _ => format!("{}({})", read.element, all.join(", ")),
        }
    };
    let buffer = read.buffer;
    match size {
        4 => format!(
            "let four = {};
             let two = select(four.xy, four.zw, (index & 2u) == 2u);
             return {};\n",
            load("index / 4u"),
            scalars(&["select(two.x, two.y, (index & 1u) == 1u)"])
        ),
        8 => format!(
            "let two = {};
             let pair = select(two.xy, two.zw, (index & 1u) == 1u);
             return {};\n",
            load("index / 2u"),
            scalars(&["pair.x", "pair.y"])
        ),
        // A value of 24 bytes takes one and a half texels.
        24 => format!(
            "let texel = (3u * index) / 2u;
             let first = {};
             let second = {};
             let is_odd = (index & 1u) == 1u;
             let head = select(first, vec4u(first.zw, second.xy), is_odd);
             let tail = select(second.xy, second.zw, is_odd);
             return {};\n",
            load("texel"),
            load("texel + 1u"),
            scalars(&["head.x", "head.y", "head.z", "head.w", "tail.x", "tail.y"])
        ),
        16 if fields.len() == 4 => {
            let all = ["all.x", "all.y", "all.z", "all.w"];
            let kind_of = |field: &Field| match *field {
                Field::Scalar(kind) => kind,
                _ => panic!("{buffer}: four fields of four bytes are scalars"),
            };
            let kind = kind_of(&fields[0]);
            match fields.iter().all(|field| kind_of(field) == kind) {
                true => format!(
                    "let all = {};\nreturn {}({});\n",
                    vector(kind, load("index")),
                    read.element,
                    all.join(", ")
                ),
                false => format!("let all = {};\nreturn {};\n", load("index"), scalars(&all)),
            }
        }
        16 if fields.len() == 1 => match fields[0] {
            Field::Vector(kind) => format!("return {};\n", vector(kind, load("index"))),
            _ => panic!("{buffer}: no reader for one field of 16 bytes"),
        },
        32 if fields.len() == 8 => {
            let (first, second) = (load("2u * index"), load("2u * index + 1u"));
            let names =
                ["head", "tail"].map(|name| ["x", "y", "z", "w"].map(|at| format!("{name}.{at}")));
            let names = names.concat();
            format!(
                "let head = {first};\nlet tail = {second};\nreturn {};\n",
                scalars(&Vec::from_iter(names.iter().map(String::as_str)))
            )
        }
        _ if size.is_multiple_of(16) => {
            let texels = size / 16;
            let mut next = 0;
            let mut texel = || {
                let loaded = load(&match next {
                    0 => "first".to_owned(),
                    _ => format!("first + {next}u"),
                });
                next += 1;
                vector(ScalarKind::Float, loaded)
            };
            let all = fields.iter().map(|field| match *field {
                Field::Vector(_) => texel(),
                Field::Vectors(count) => {
                    let each: Vec<String> = (0..count).map(|_| texel()).collect();
                    format!("array({})", each.join(", "))
                }
                Field::Scalar(_) => panic!("{buffer}: scalars beside vectors have no reader"),
            });
            let all: Vec<String> = all.collect();
            assert_eq!(next, texels, "{buffer}: fields fill all texels");
            let element = read.element;
            format!(
                "let first = {texels}u * index;\nreturn {element}({});\n",
                all.join(", ")
            )
        }
        _ => panic!("{buffer}: no reader for elements of {size} bytes; write one"),
    }
}

/// The fields of an element, and its size in bytes.
fn fields(read: &Read, module: &Module) -> (Vec<Field>, u32) {
    let variable = module
        .global_variables
        .iter()
        .find(|(_, variable)| variable.name.as_deref() == Some(read.buffer))
        .map_or_else(
            || panic!("{}: no such buffer", read.buffer),
            |(_, variable)| variable.ty,
        );
    let TypeInner::Array { base, stride, .. } = module.types[variable].inner else {
        panic!("{}: not an array", read.buffer);
    };
    let field = |ty: naga::Handle<naga::Type>| match module.types[ty].inner {
        TypeInner::Scalar(Scalar { kind, .. }) => Field::Scalar(kind),
        TypeInner::Vector {
            size: VectorSize::Quad,
            scalar,
        } => Field::Vector(scalar.kind),
        TypeInner::Array {
            size: naga::ArraySize::Constant(count),
            stride: 16,
            ..
        } => Field::Vectors(count.get()),
        ref other => panic!("{}: no reader for {other:?}", read.element),
    };
    let fields = match &module.types[base].inner {
        TypeInner::Struct { members, .. } => members.iter().map(|m| field(m.ty)).collect(),
        _ => vec![field(base)],
    };
    (fields, stride)
}
