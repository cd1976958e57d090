//! WGSL to SPIR-V at build time: parse, validate, emit, and run the exactness
//! pass, so that a broken or inexact shader is a build error. The shaders own
//! every constant and layout that they share with Rust; this writes them out as
//! Rust constants.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs};

use naga::back::spv;
use naga::valid::{Capabilities, ValidationFlags, Validator};

#[allow(dead_code, unreachable_pub)]
#[path = "src/spirv.rs"]
mod spirv;

/// How a kernel reads: storage buffers, or texel buffers. The name of the latter says so;
/// those also store two words of 64 bits, not four of 32.
const READS: [&str; 2] = ["storage", "texels"];

/// What the kernel is joined with: one of each, and its name is that of all three. Each with
/// the file that it needs beside its own.
const FORMS: [(&str, &str); 2] = [("arc", "sine_cosine"), ("polynomial", "polynomial")];
/// How work is listed, with the files for that.
const LISTINGS: [(&str, &[&str], &str); 3] = [
    ("frames", &["kernel", "distance_in_frames"], "items"),
    ("times", &["kernel", "distance_in_seconds"], "items"),
    ("singles", &["kernel_singles"], "singles"),
];
/// Each with the files that it needs beside its own.
const ENCODINGS: [(&str, &[&str]); 8] = [
    ("f32", &[]),
    ("f16", &[]),
    ("snorm16", &[]),
    ("axis_angle", &["arc_tangent"]),
    ("matrix3x3", &["matrix"]),
    ("matrix3x4", &["matrix"]),
    ("euler", &["arc_tangent"]),
    ("vector", &[]),
];

/// Kernels over poses that are already there.
const POSES: [&str; 4] = ["pose_blend", "pose_mix", "pose_add", "pose_world"];

/// Kernels from keys to samples, each with the files that it needs beside its own, and with
/// those that read.
const SAMPLED: [(&str, &[&str], &[&str]); 3] = [
    (
        "sampled_arcs",
        &["sine_cosine", "evaluate_arc", "arc"],
        &["sampled"],
    ),
    (
        "sampled_pairs",
        &["sine_cosine", "evaluate_arc", "arc", "steady", "polynomial"],
        &["sampled"],
    ),
    ("sampled_cubics", &["gentle"], &["sampled", "joints"]),
];

/// Every pipeline: its name, and the files that are joined into it.
fn pipelines() -> Vec<(String, Vec<String>)> {
    let mut pipelines = vec![(
        "canary".to_owned(),
        ["sine_cosine", "arc_tangent", "canary"]
            .map(str::to_owned)
            .to_vec(),
    )];
    for reads in READS {
        for (form, formula) in FORMS {
            for (listing, entry, listed) in LISTINGS {
                for (encoding, needed) in ENCODINGS {
                    let own = [
                        "canonical",
                        "launch",
                        formula,
                        &format!("evaluate_{form}"),
                        &format!("store_{encoding}"),
                    ];
                    let own = own.iter().chain(entry).chain(needed);
                    let mut files: Vec<_> = own.map(|&file| file.to_owned()).collect();
                    files.extend(["kernel", listed].map(|read| format!("{read}_{reads}")));
                    if reads == "texels" {
                        files.push(format!("{form}_texels"));
                        if encoding == "f32" {
                            files.retain(|file| file != "store_f32");
                            files.extend(["wide", "store_f32_wide"].map(str::to_owned));
                        }
                    }
                    pipelines.push((named(&format!("{form}_{listing}_{encoding}"), reads), files));
                }
            }
        }
    }
    for pose in POSES {
        let shared = [
            "canonical",
            "sine_cosine",
            "arc_tangent",
            "quaternion",
            "pass",
        ];
        let files = shared.into_iter().chain([pose]).map(str::to_owned);
        pipelines.push((pose.to_owned(), files.collect()));
    }
    for reads in READS {
        for (sampled, needed, read) in SAMPLED {
            let shared = ["canonical", "sampled", sampled];
            let own = shared.iter().chain(needed).map(|&file| file.to_owned());
            let mut files: Vec<_> = own.collect();
            files.extend(read.iter().map(|read| format!("{read}_{reads}")));
            if reads == "texels" {
                files.push("wide".to_owned());
            }
            pipelines.push((named(sampled, reads), files));
        }
    }
    pipelines
}

fn named(kernel: &str, reads: &str) -> String {
    match reads {
        "texels" => format!("{kernel}_texels"),
        _ => kernel.to_owned(),
    }
}

fn main() {
    println!("cargo::rerun-if-changed=shaders");
    println!("cargo::rerun-if-changed=src/spirv.rs");
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    let mut constants = BTreeMap::new();
    let mut layouts = BTreeMap::new();
    let mut list = String::new();
    for (name, files) in pipelines() {
        let name = name.as_str();
        let source: String = files.iter().map(|file| read_shader(file)).collect();
        let module = naga::front::wgsl::parse_str(&source)
            .unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(&source)));
        let words = compile(name, &source, &module);
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        fs::write(out.join(format!("{name}.spv")), bytes).expect("OUT_DIR is writable");
        let file = format!("concat!(env!(\"OUT_DIR\"), \"/{name}.spv\")");
        writeln!(list, "({name:?}, include_bytes!({file}) as &[u8]),").unwrap();
        collect_constants(&module, &mut constants);
        collect_layouts(name, &module, &mut layouts);
    }
    let mut rust = String::new();
    for (name, value) in constants {
        writeln!(rust, "pub(crate) const {name}: {value};").unwrap();
    }
    for (name, value) in layouts {
        writeln!(rust, "pub(crate) const {name}: usize = {value};").unwrap();
    }
    fs::write(out.join("shader_constants.rs"), rust).expect("OUT_DIR is writable");
    fs::write(out.join("shaders.rs"), format!("&[{list}]")).expect("OUT_DIR is writable");
}

fn read_shader(file: &str) -> String {
    let path = Path::new("shaders").join(file).with_extension("wgsl");
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display())) + "\n"
}

fn compile(name: &str, source: &str, module: &naga::Module) -> Vec<u32> {
    let capabilities = Capabilities::IMMEDIATES | Capabilities::SHADER_INT64;
    let info = Validator::new(ValidationFlags::all(), capabilities)
        .validate(module)
        .unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(source)));
    let options = spv::Options {
        lang_version: (1, 3), // what Vulkan 1.1 takes
        // Loops here end: their bounds are data that the host wrote.
        force_loop_bounding: false,
        flags: spv::WriterFlags::empty(),
        ..spv::Options::default()
    };
    let words = spv::write_vec(module, &info, &options, None)
        .unwrap_or_else(|error| panic!("{name}: {error}"));
    let words = spirv::texel_buffers(&words).unwrap_or_else(|error| panic!("{name}: {error}"));
    spirv::no_contraction(&words).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// `const` declarations become Rust constants of the same name.
fn collect_constants(module: &naga::Module, constants: &mut BTreeMap<String, String>) {
    for (_, constant) in module.constants.iter() {
        let Some(name) = &constant.name else { continue };
        let naga::Expression::Literal(literal) = module.global_expressions[constant.init] else {
            continue;
        };
        let typed = match literal {
            naga::Literal::F32(value) => format!("f32 = {value:?}"),
            naga::Literal::U32(value) => format!("u32 = {value}"),
            naga::Literal::I32(value) => format!("i32 = {value}"),
            _ => continue,
        };
        let other = constants.insert(name.clone(), typed.clone());
        assert!(
            other.is_none_or(|other| other == typed),
            "two shaders have a constant {name}, with different values"
        );
    }
}

/// Offsets and sizes of the structs in buffers, for assertions beside their Rust
/// counterparts: `ARC_SEGMENT_MIDDLE`, `ITEM_SIZE`.
fn collect_layouts(pipeline: &str, module: &naga::Module, layouts: &mut BTreeMap<String, u32>) {
    for (_, ty) in module.types.iter() {
        let (Some(name), naga::TypeInner::Struct { members, span }) = (&ty.name, &ty.inner) else {
            continue;
        };
        let form = pipeline
            .split('_')
            .next()
            .unwrap_or_default()
            .to_uppercase();
        let name = match name.as_str() {
            "Segment" => format!("{form}_SEGMENT"),
            other => other.to_uppercase(),
        };
        layouts.insert(format!("{name}_SIZE"), *span);
        for member in members {
            let field = member.name.as_deref().unwrap_or_default().to_uppercase();
            layouts.insert(format!("{name}_{field}"), member.offset);
        }
    }
}
