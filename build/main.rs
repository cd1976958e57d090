//! WGSL to SPIR-V at build time: each kernel of the table is joined from its files, parsed,
//! validated, emitted, and passed through the exactness pass, so that a broken or inexact shader
//! is a build error. Rust gets the constants and structs that the shaders declare, so that
//! neither is written twice.

mod readers;
mod rust;
#[allow(dead_code, unreachable_pub)]
#[path = "../src/shader/spirv.rs"]
mod spirv;
mod table;

use std::path::{Path, PathBuf};
use std::{env, fs};

use naga::back::spv;
use naga::front::wgsl::{Frontend, Options};
use naga::valid::{Capabilities, ValidationFlags, Validator};

use rust::{Compiled, Declared};
use table::{Kernel, WIDE_STORE};

fn main() {
    for path in ["shaders", "build", "src/shader/spirv.rs"] {
        println!("cargo::rerun-if-changed={path}");
    }
    // Vectors wider than the baseline's: see src/simd/dispatch.rs.
    println!("cargo::rustc-check-cfg=cfg(wide_vectors)");
    let optimises = env::var("OPT_LEVEL").is_ok_and(|level| level != "0");
    if optimises && env::var("CARGO_CFG_TARGET_ARCH").is_ok_and(|arch| arch == "x86_64") {
        println!("cargo::rustc-cfg=wide_vectors");
    }
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    let mut declared = Declared::default();
    let mut compiled = Vec::new();
    for kernel in table::kernels() {
        let Kernel {
            name,
            files,
            reads,
            has_texels,
        } = kernel;
        let joined: String = files.iter().map(|file| read_shader(file)).collect();
        let source = match reads.is_empty() {
            true => joined,
            false => readers::storage(&reads) + &joined,
        };
        let module = parse(&name, &source);
        declared.collect(&name, &module);
        write(&out, &name, &source, &compile(&name, &source, &module));
        if has_texels {
            let name = format!("{name}_texels");
            let wide = files.iter().flat_map(|&file| match file {
                "stores/f32" => WIDE_STORE.to_vec(),
                other => vec![other],
            });
            let joined: String = wide.map(read_shader).collect();
            let source = readers::texels(&reads, &module) + &joined;
            let module = parse(&name, &source);
            write(&out, &name, &source, &compile(&name, &source, &module));
        }
        let bindings = module.global_variables.iter();
        compiled.push(Compiled {
            bindings: bindings.filter(|(_, own)| own.binding.is_some()).count(),
            name,
            has_texels,
        });
    }
    let rust = declared.rust() + &rust::kernels(&compiled);
    fs::write(out.join("shaders.rs"), rust).expect("OUT_DIR is writable");
}

fn read_shader(file: &str) -> String {
    let path = Path::new("shaders").join(file).with_extension("wgsl");
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display())) + "\n"
}

fn parse(name: &str, source: &str) -> naga::Module {
    let mut options = Options::new();
    options.parse_doc_comments = true;
    Frontend::new_with_options(options)
        .parse(source)
        .unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(source)))
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

/// Writes a kernel, and the text that it is made of: `tests/twins` evaluates its functions.
fn write(out: &Path, name: &str, source: &str, words: &[u32]) {
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    fs::write(out.join(format!("{name}.spv")), bytes).expect("OUT_DIR is writable");
    fs::write(out.join(format!("{name}.wgsl")), source).expect("OUT_DIR is writable");
}
