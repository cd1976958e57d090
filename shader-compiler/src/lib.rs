//! The compiler of the shaders: WGSL to SPIR-V. Each kernel of the table is joined from its files,
//! parsed, validated, emitted, and passed through the exactness pass, so that a broken or inexact
//! shader is an error. Rust gets the constants and structs that the shaders declare, and their arithmetic, so that
//! none is written twice.
//!
//! Its output is checked in, in `shaders/compiled/`: builds of the engine need no naga, and have
//! the SPIR-V that was tested. `cargo run -p tumble-shaders` writes it anew.

mod entries;
mod functions;
// The engine's build script uses the same file, but another part of it.
#[allow(dead_code)]
#[path = "../../build/hashes.rs"]
mod hashes;
mod readers;
mod rust;
mod table;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use naga::back::spv;
use naga::front::wgsl::{Frontend, Options};
use naga::valid::{Capabilities, GlobalUse, ModuleInfo, ValidationFlags, Validator};
use naga::{Binding, BuiltIn};
use tumble_exact::{
    PassError, no_contraction, no_contraction_with_f16, nontemporal_stores, splat_products,
    texel_buffers, workgroup_layouts,
};

use entries::Source;
use functions::Functions;
use rust::{Compiled, Declared};
use table::{CONVERTING_STORE, Kernel, WIDE_STORE};

/// The engine's package.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// Compiles the shaders, writes the files whose content differs (each completely or not at all), and prints their
/// names.
///
/// # Panics
/// With a message about the shader that cannot be read, is broken or inexact, or declares what
/// another one declares differently, or about the file that cannot be written.
pub fn write() {
    let files = compile();
    let stale = stale(Path::new(ROOT), &files);
    for (path, bytes) in files.iter().filter(|(path, _)| stale.contains(path)) {
        let partial = Path::new(ROOT).join("shaders/compiled/partial");
        fs::write(&partial, bytes)
            .and_then(|()| fs::rename(&partial, Path::new(ROOT).join(path)))
            .unwrap_or_else(|error| panic!("{path}: {error}"));
        println!("wrote {path}");
    }
    if stale.is_empty() {
        println!("the compiled kernels are those of the shaders");
    }
}

/// The files that are checked in: their paths from the engine's root, and their content.
type Files = Vec<(&'static str, Vec<u8>)>;

/// Compiles the shaders.
fn compile() -> Files {
    let mut declared = Declared::default();
    let (mut compiled, mut code) = (Vec::new(), Vec::new());
    let (mut parsed, mut of_texels) = (Vec::new(), Vec::new());
    for kernel in table::kernels() {
        let Variants {
            storage,
            texels,
            converting,
        } = modules(&kernel);
        declared.collect(
            &storage.name,
            storage.layouts.as_ref().unwrap_or(&storage.parsed),
        );
        let mut emit = |module: &Module| {
            let words = module.spirv();
            code.extend(words.iter().flat_map(|word| word.to_le_bytes()));
            words.len()
        };
        compiled.push(Compiled {
            bindings: storage.bindings(),
            subgroups: storage.asks_subgroups(),
            words: emit(&storage),
            texel_words: texels.as_ref().map(&mut emit),
            converting_words: converting.as_ref().map(emit),
            name: kernel.name,
        });
        let files = kernel.files.iter().chain(&WIDE_STORE);
        let files = Vec::from_iter(files.map(|&file| (file, read_shader(file))));
        of_texels.extend(texels.map(|texels| (texels, files.clone())));
        parsed.push((storage, files));
    }
    let mut functions = Functions::new(declared.in_buffers());
    for (module, _) in &parsed {
        functions.collect(&module.name, &module.source, &module.parsed, &module.info);
    }
    let sources: Vec<Source<'_>> = parsed
        .iter()
        .chain(&of_texels)
        .map(|(module, files)| Source {
            name: &module.name,
            text: &module.source,
            files,
            module: &module.parsed,
            info: &module.info,
        })
        .collect();
    let rust = declared.rust() + &rust::kernels(&compiled);
    let mut files = vec![
        (
            "shaders/compiled/entries.rs",
            entries::rust(&sources).into_bytes(),
        ),
        (
            "shaders/compiled/functions.rs",
            functions.rust().into_bytes(),
        ),
        ("shaders/compiled/kernels.rs", rust.into_bytes()),
        ("shaders/compiled/kernels.spv", code),
        (
            "exact/src/generated.rs",
            functions.exact_rust(&declared).into_bytes(),
        ),
        (
            "exact/functions.wgsl",
            functions::exact_wgsl(&functions::EXACT_FILES.map(read_shader)).into_bytes(),
        ),
    ];
    let mut hashes = hashes::of_folder(Path::new(ROOT), "shaders").expect("the shaders lie there");
    hashes.retain(|path, _| path.ends_with(".wgsl"));
    // The engine's build script checks only the files in `shaders/`.
    let made = (files.iter())
        .filter(|(path, _)| path.starts_with("shaders/"))
        .map(|(path, bytes)| ((*path).to_owned(), hashes::hash(bytes)));
    hashes.extend(made);
    let list: String = hashes
        .iter()
        .map(|(path, hash)| format!("{hash} {path}\n"))
        .collect();
    // Written last, so that the list does not fit a mixture of files of two runs.
    files.push((hashes::LIST, list.into_bytes()));
    files
}

/// The paths of the files that are missing under `root` or have other bytes there.
fn stale(root: &Path, files: &Files) -> Vec<&'static str> {
    let stale = files
        .iter()
        .filter(|(path, bytes)| fs::read(root.join(path)).map_or(true, |found| found != *bytes));
    stale.map(|(path, _)| *path).collect()
}

/// The WGSL of each kernel as it is compiled, by the kernel's name.
///
/// # Panics
/// With a message about the shader that cannot be read or parsed.
#[must_use]
pub fn sources() -> BTreeMap<String, String> {
    let kernels = table::kernels();
    let modules = kernels
        .iter()
        .map(modules)
        .flat_map(|all| [Some(all.storage), all.texels, all.converting]);
    modules
        .flatten()
        .map(|module| (module.name, module.source))
        .collect()
}

/// A kernel, or its variant for texel buffers.
struct Module {
    name: String,
    source: String,
    parsed: naga::Module,
    info: ModuleInfo,
    /// Whether its results go past the caches.
    streams_results: bool,
    /// Whether it converts to half precision.
    converts: bool,
    /// The same with the structs that its buffers hold, if it loads them by vectors.
    layouts: Option<naga::Module>,
}

/// A kernel and its variants.
struct Variants {
    storage: Module,
    /// The one that reads texel buffers.
    texels: Option<Module>,
    /// The one that converts to half precision.
    converting: Option<Module>,
}

fn modules(kernel: &Kernel) -> Variants {
    let Kernel {
        name,
        files,
        reads,
        has_texels,
        loads_vectors,
        streams_results,
        converts,
    } = kernel;
    let joined: String = files.iter().map(|file| read_shader(file)).collect();
    let source = match reads.is_empty() {
        true => joined.clone(),
        false => readers::storage(reads) + &joined,
    };
    let mut storage = Module::parse(name.clone(), source);
    if *loads_vectors {
        let source = readers::vectors(reads, &storage.parsed) + &joined;
        let by_vectors = Module::parse(name.clone(), source);
        let layouts = Some(std::mem::replace(&mut storage, by_vectors).parsed);
        storage.layouts = layouts;
    }
    storage.streams_results = *streams_results;
    let converting = converts.then(|| {
        let files = files.iter().filter(|file| **file != "math/half");
        let files = files.map(|&file| match file {
            "stores/f16" => CONVERTING_STORE,
            other => other,
        });
        let joined: String = files.map(read_shader).collect();
        let layouts = storage.layouts.as_ref().unwrap_or(&storage.parsed);
        let readers = match loads_vectors {
            true => readers::vectors(reads, layouts),
            false => readers::storage(reads),
        };
        let source = format!("enable f16;\n{readers}{joined}");
        let mut module = Module::parse(format!("{name}_converting"), source);
        (module.streams_results, module.converts) = (*streams_results, true);
        module
    });
    let texels = has_texels.then(|| {
        let wide = files.iter().flat_map(|&file| match file {
            "stores/f32" => WIDE_STORE.to_vec(),
            other => vec![other],
        });
        let joined: String = wide.map(read_shader).collect();
        let source = readers::texels(reads, &storage.parsed) + &joined;
        Module::parse(format!("{name}_texels"), source)
    });
    Variants {
        storage,
        texels,
        converting,
    }
}

fn read_shader(file: &str) -> String {
    let file = format!("shaders/{file}.wgsl");
    fs::read_to_string(Path::new(ROOT).join(&file))
        .unwrap_or_else(|error| panic!("{file}: {error}"))
        + "\n"
}

impl Module {
    fn parse(name: String, source: String) -> Self {
        let mut options = Options::new();
        options.parse_doc_comments = true;
        let parsed = Frontend::new_with_options(options)
            .parse(&source)
            .unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(&source)));
        let capabilities = Capabilities::IMMEDIATES
            | Capabilities::SHADER_INT64
            | Capabilities::SHADER_FLOAT16
            | Capabilities::SUBGROUP;
        let info = Validator::new(ValidationFlags::all(), capabilities)
            .validate(&parsed)
            .unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(&source)));
        Self {
            name,
            source,
            parsed,
            info,
            streams_results: false,
            converts: false,
            layouts: None,
        }
    }

    /// How it uses the buffer of each binding, in the order of the bindings.
    fn bindings(&self) -> Vec<&'static str> {
        let uses = self.info.get_entry_point(0);
        let variables = self.parsed.global_variables.iter();
        let bound = variables.filter_map(|(handle, variable)| {
            let access = match uses[handle] {
                all if all.contains(GlobalUse::READ | GlobalUse::WRITE) => "ReadWrite",
                all if all.contains(GlobalUse::WRITE) => "Write",
                _ => "Read",
            };
            Some((variable.binding.as_ref()?.binding, access))
        });
        let bound: BTreeMap<_, _> = bound.collect();
        bound.into_values().collect()
    }

    /// Whether the lanes of its subgroups ask each other.
    fn asks_subgroups(&self) -> bool {
        let mut arguments = self.parsed.entry_points[0].function.arguments.iter();
        let lane = Some(Binding::BuiltIn(BuiltIn::SubgroupInvocationId));
        arguments.any(|argument| argument.binding == lane)
    }

    /// Its SPIR-V after the exactness pass.
    fn spirv(&self) -> Vec<u32> {
        let Self {
            name,
            parsed,
            info,
            streams_results,
            converts,
            ..
        } = self;
        let options = spv::Options {
            lang_version: (1, 3), // what Vulkan 1.1 takes
            // All loops of the shaders end: the host has written their bounds.
            force_loop_bounding: false,
            flags: spv::WriterFlags::empty(),
            // Memory that a workgroup shares is always written before it is read.
            use_storage_input_output_16: false,
            zero_initialize_workgroup_memory: spv::ZeroInitializeWorkgroupMemoryMode::None,
            ..spv::Options::default()
        };
        let words = spv::write_vec(parsed, info, &options, None)
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        let pass = || {
            let words = texel_buffers(&words)?;
            let words = workgroup_layouts(&words)?;
            let words = splat_products(&words)?;
            let words = match converts {
                true => no_contraction_with_f16(&words)?,
                false => no_contraction(&words)?,
            };
            match streams_results {
                true => Ok(nontemporal_stores(&words)?),
                false => Ok(words),
            }
        };
        pass().unwrap_or_else(|error: PassError| panic!("{name}: {error}"))
    }
}
