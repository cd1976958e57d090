//! Rules of the house that a compiler does not know.

use std::fs;
use std::path::{Path, PathBuf};

use tumble::METHODS;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn files(directory: &str, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut pending = vec![root().join(directory)];
    while let Some(directory) = pending.pop() {
        for entry in fs::read_dir(directory).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                pending.push(path);
            } else if path.extension().is_some_and(|own| own == extension) {
                found.push(path);
            }
        }
    }
    found
}

fn read(path: impl AsRef<Path>) -> String {
    fs::read_to_string(root().join(path)).unwrap()
}

#[test]
fn unsafe_code_stays_in_its_homes() {
    let sources = [
        "src",
        "formats/src",
        "routes/src",
        "cli/src",
        "npm/src",
        "python/src",
        "shader-compiler/src",
    ]
    .map(|folder| files(folder, "rs"));
    for path in sources.concat() {
        let relative = path.strip_prefix(root()).unwrap();
        let home = relative.starts_with("src/gpu")
            || relative.starts_with("src/simd")
            || relative.ends_with("src/own_device.rs")
            // C interfaces: CUDA's driver, and the exchange of arrays.
            || relative.ends_with("python/src/cuda.rs")
            || relative.ends_with("python/src/dlpack.rs")
            || relative.ends_with("src/crowd/own_device.rs")
            || relative.ends_with("src/verify/renderer.rs");
        let blocks = read(&path)
            .lines()
            .filter(|line| !line.trim_start().starts_with("//"))
            .filter(|line| line.contains("unsafe {") || line.contains("unsafe fn"))
            .count();
        assert!(
            home || blocks == 0,
            "{}: {blocks} unsafe",
            relative.display()
        );
    }
}

/// How many lines before unsafe code its reason may be.
const REASON_WITHIN: usize = 6;

/// Clippy finds both, and more (`scripts/lint.sh`); in CI it has the time for the engine's library alone.
#[test]
fn no_multiply_add_is_fused_and_unsafe_code_has_its_reason() {
    let folders = ["src", "formats/src", "routes/src", "cli/src", "capi/src"];
    let folders = (folders.into_iter()).chain(["npm/src", "python/src", "shader-compiler/src"]);
    let mut unsafe_lines = 0;
    for path in folders.flat_map(|folder| files(folder, "rs")) {
        let text = read(&path);
        let lines: Vec<&str> = text.lines().collect();
        for (i, line) in lines.iter().enumerate() {
            if line.trim_start().starts_with("//") {
                continue;
            }
            let place = format!("{}:{}", path.display(), i + 1);
            // A fused one rounds once where the kernels round twice.
            assert!(
                !line.contains("mul_add") && !line.contains("fmadd"),
                "{place}"
            );
            if line.contains("unsafe {") || line.contains("unsafe impl") {
                unsafe_lines += 1;
                let before = &lines[i.saturating_sub(REASON_WITHIN)..=i];
                let has_reason = before.iter().any(|line| line.contains("SAFETY: "));
                assert!(
                    has_reason,
                    "{place}: say why it is sound, after `// SAFETY: `"
                );
            }
        }
    }
    assert!(unsafe_lines > 200, "only {unsafe_lines} were found");
}

/// Of the system's library, the compiler's (`powi`), or glam's that call them: their last bit is another on
/// another system, or with another compiler. `libm`'s are the same everywhere, and so are those of
/// `math::quaternion`.
const DIFFERS_BY_SYSTEM: [&str; 36] = [
    ".sin()",
    ".cos()",
    ".tan()",
    ".sin_cos()",
    ".asin()",
    ".acos()",
    ".atan()",
    ".atan2(",
    ".sinh()",
    ".cosh()",
    ".tanh()",
    ".exp()",
    ".exp2()",
    ".exp_m1()",
    ".ln()",
    ".ln_1p()",
    ".log2()",
    ".log10()",
    ".powf(",
    ".powi(",
    ".cbrt()",
    ".hypot(",
    "from_axis_angle(",
    "from_scaled_axis(",
    "from_rotation_x(",
    "from_rotation_y(",
    "from_rotation_z(",
    "from_euler(",
    ".to_euler(",
    ".to_axis_angle(",
    ".to_scaled_axis(",
    ".angle_between(",
    ".angle_to(",
    ".rotate_towards(",
    "f64::sin",
    "f64::cos",
];

/// Where no result depends on it.
const SEEN_ALONE: [&str; 5] = [
    "src/auto.rs", // a probe to time
    "cli/src/commands/bench",
    "cli/src/commands/travel.rs", // bodies for pictures
    "cli/src/commands/plot",
    "cli/src/commands/render",
];

/// Clippy finds them by their types (`clippy.toml`); in CI it has the time for the engine's library alone.
#[test]
fn results_take_no_function_that_differs_from_system_to_system() {
    let folders = [
        "src",
        "formats/src",
        "routes/src",
        "cli/src",
        "capi/src",
        "npm/src",
        "python/src",
    ];
    let (mut lines, mut exceptions) = (0, 0);
    for path in folders.iter().flat_map(|folder| files(folder, "rs")) {
        let relative = path.strip_prefix(root()).unwrap();
        let is_test = relative
            .iter()
            .any(|part| part == "tests" || part == "tests.rs");
        let text = read(&path);
        let code = text.split("#[cfg(test)]\nmod tests").next().unwrap();
        for (i, line) in code.lines().enumerate() {
            let line = line.split("//").next().unwrap();
            lines += 1;
            let Some(name) = DIFFERS_BY_SYSTEM.iter().find(|name| line.contains(**name)) else {
                continue;
            };
            let is_exception = SEEN_ALONE.iter().any(|path| relative.starts_with(path));
            exceptions += usize::from(is_exception);
            assert!(
                is_test || is_exception,
                "{}:{}: `{name}` differs from system to system: take `libm`'s",
                relative.display(),
                i + 1
            );
        }
    }
    assert!(lines > 50_000, "only {lines} lines were read");
    assert!(exceptions > 4, "only {exceptions} exceptions were found");
}

/// A form, a helper or a check of the self-test in WGSL without its twin would go unchecked.
#[test]
fn every_shader_function_has_its_twin() {
    for shader in files("shaders", "wgsl") {
        let text = read(&shader);
        let name = shader.file_stem().unwrap().to_str().unwrap();
        let Some(twin) = text.lines().find_map(|line| line.split("Twin: ").nth(1)) else {
            let glue = [
                // Entry points and what leads samples through them.
                "from_keys",
                "poses",
                "runs",
                "samples",
                "coalesced",
                "alone",
                "together",
                "crowd",
                "link",
                "dispatch",
                "grid",
                "item",
                "frame_distance",
                "time_distance",
                // Stores that move bits alone.
                "f32",
                "f32_wide",
                "wide",
                "vector",
            ];
            assert!(glue.contains(&name), "{name}.wgsl names no twin");
            continue;
        };
        let twin = twin.trim_end_matches('.');
        assert!(
            read(twin).contains(&format!("{name}.wgsl")),
            "{twin} does not name {name}.wgsl"
        );
    }
    for path in files("src", "rs") {
        for named in read(&path).split("`shaders/").skip(1) {
            let named = format!("shaders/{}", named.split('`').next().unwrap());
            assert!(root().join(&named).exists(), "{}: {named}", path.display());
        }
    }
}

/// Two that share a mistake agree: the reference may use no line of the engine but the tracks
/// and the names of the options.
#[test]
fn the_reference_shares_nothing_with_the_engine() {
    let allowed = [
        "crate::reference::",
        "crate::tracks::",
        "crate::curve::options::",
    ];
    for path in files("src/reference", "rs") {
        for line in read(&path).lines().filter(|line| line.contains("crate::")) {
            let is_allowed = allowed.iter().any(|prefix| line.contains(prefix));
            assert!(is_allowed, "{}: {line}", path.display());
        }
    }
}

/// The folders of `src/`, from the bottom to the top, as ARCHITECTURE.md draws them: code may
/// use what lies below it. The files directly in `src/` are the engine's public face.
const LAYERS: [&str; 25] = [
    "memory",
    "threads",
    "shader",
    "math",
    "simd",
    "twin",
    "tracks",
    "time",
    "curve",
    "reference",
    "fit",
    "method",
    "prepare",
    "path",
    "smooth",
    "reduce",
    "output",
    "from_keys",
    "cpu",
    "gpu",
    "evaluate",
    FACE,
    "pose",
    "crowd",
    "verify",
];

const FACE: &str = "face";

/// The layer of a file or of a module, by the first part of its path within `src/`.
fn layer(first: &str) -> &str {
    let name = first.strip_suffix(".rs").unwrap_or(first);
    match root().join("src").join(name).is_dir() {
        true => name,
        false => FACE,
    }
}

/// Why `line` of a file of the layer `own` may not stand there.
fn refused(own: &str, line: &str) -> Option<String> {
    let place = |layer: &str| {
        let found = LAYERS.iter().position(|name| *name == layer);
        found.unwrap_or_else(|| panic!("the table of layers has no `{layer}`"))
    };
    let code = line.split("//").next().unwrap();
    code.split("crate::").skip(1).find_map(|path| {
        let first: &str = path.split([':', ',', ';', ' ', '}']).next().unwrap();
        let other = layer(first);
        (place(other) > place(own)).then(|| format!("{own} uses {other}, which lies above it"))
    })
}

/// A folder that can be read without what is built on it, and no circle. Unit tests may look
/// up: they drive what they test through the engine.
#[test]
fn imports_go_down_the_layers() {
    let mut checked = 0;
    for path in files("src", "rs") {
        let relative = path.strip_prefix(root().join("src")).unwrap();
        if relative == Path::new("lib.rs") {
            continue;
        }
        let own = layer(relative.iter().next().unwrap().to_str().unwrap());
        let text = read(&path);
        if path.ends_with("tests.rs") {
            continue;
        }
        let code = text.split("#[cfg(test)]\nmod tests").next().unwrap();
        let code = code
            .split("#[cfg(test)]\npub(crate) mod tests")
            .next()
            .unwrap();
        for (number, line) in code.lines().enumerate() {
            checked += usize::from(line.contains("crate::"));
            if let Some(why) = refused(own, line) {
                panic!("{}:{}: {why}: {line}", path.display(), number + 1);
            }
        }
    }
    assert!(checked > 500, "only {checked} imports were found");
}

/// The test of the layers can fail.
#[test]
fn an_import_upwards_is_refused() {
    assert!(refused("time", "use crate::engine::Engine;").is_some());
    assert!(refused("simd", "    use crate::cpu::evaluate::frames;").is_some());
    assert!(refused("prepare", "fn f(set: &crate::gpu::engine::VulkanEngine) {}").is_some());
    assert!(refused("gpu", "use crate::cpu::evaluate::FEW;").is_none());
    assert!(refused("tracks", "/// See [`Engine`](crate::engine::Engine).").is_none());
}

#[test]
fn every_method_is_in_the_guide() {
    let guide = read("docs/methods.md");
    for method in METHODS {
        assert!(
            guide.contains(&format!("| `{}` |", method.name)),
            "{method}"
        );
        let file = format!("src/method/{}.rs", method.name.replace('-', "_"));
        assert!(root().join(&file).exists(), "{file}");
    }
}

/// A visitor reads one page; all else is in `docs/`.
#[test]
fn the_readme_is_one_page() {
    let lines = read("README.md").lines().count();
    assert!(lines <= 150, "README.md has {lines} lines");
}

/// Every page of the guide is in its table of contents, and no link between pages is dead.
#[test]
fn every_page_is_listed_and_no_link_is_dead() {
    let contents = read("docs/SUMMARY.md");
    let pages = files("docs", "md").into_iter().chain(
        [
            "README.md",
            "ARCHITECTURE.md",
            "CONTRIBUTING.md",
            "SECURITY.md",
        ]
        .map(|f| root().join(f)),
    );
    let mut links = 0;
    for page in pages {
        let name = page.file_name().unwrap().to_str().unwrap();
        if page.parent() == Some(&root().join("docs")) && name != "SUMMARY.md" {
            assert!(contents.contains(&format!("({name})")), "{name}");
        }
        let text = read(&page);
        // Code is not text: `a[i](b)` links nowhere.
        let prose = (text.split("```").step_by(2)).flat_map(|part| part.split('`').step_by(2));
        for link in prose.flat_map(|part| part.split("](").skip(1)) {
            let target = link.split([')', '#']).next().unwrap();
            if target.is_empty() || target.contains("://") {
                continue;
            }
            links += 1;
            let path = page.parent().unwrap().join(target);
            assert!(path.exists(), "{}: {target} is not there", page.display());
        }
    }
    assert!(links > 100, "only {links} links were found");
}

/// A crate that nobody can say the use of is one to leave out.
#[test]
fn every_dependency_is_justified() {
    let manifest = read("Cargo.toml");
    let reasons = read("docs/dependencies.md");
    let mut section = "";
    let mut count = 0;
    for line in manifest.lines() {
        if line.starts_with('[') {
            section = line;
        } else if section == "[workspace.dependencies]"
            && let Some((name, _)) = line.split_once(" = ")
            && !name.starts_with("tumble")
        {
            count += 1;
            assert!(
                reasons.contains(&format!("`{name}`")),
                "docs/dependencies.md does not say what {name} is for"
            );
        }
    }
    assert!(count > 30, "only {count} dependencies were found");
}

/// The oldest Rust that works is the one that the tests run with; a newer one may be used,
/// and is not asked for.
#[test]
fn the_oldest_rust_is_declared_once() {
    let declared = read("Cargo.toml")
        .lines()
        .find_map(|line| line.strip_prefix("rust-version = ").map(str::to_owned))
        .unwrap();
    let version = declared.trim_matches('"');
    let readme = read("README.md");
    assert!(
        readme.contains(&format!("Rust {version}")),
        "README.md names Rust {version}"
    );
    let script = read("scripts/lint.sh");
    assert!(
        script.contains("rust-version"),
        "scripts/lint.sh checks with the oldest Rust where it is installed"
    );
}

/// Cargo packs the files of a package alone: a file that the sources include from elsewhere would be missing.
#[test]
fn packages_have_all_that_they_include() {
    let mut found = 0;
    for package in ["", "formats/", "routes/", "cli/"] {
        let home = root().join(package);
        for path in files(&format!("{package}src"), "rs") {
            // Tests are run in the repository.
            if path.ends_with("tests.rs") {
                continue;
            }
            let text = read(&path);
            for call in ["include_str!(\"", "include_bytes!(\""] {
                for part in text.split(call).skip(1) {
                    let file = part.split('"').next().unwrap();
                    let file = path.parent().unwrap().join(file).canonicalize().unwrap();
                    let inside = file.strip_prefix(home.canonicalize().unwrap());
                    let packed = inside.is_ok_and(|inside| {
                        [
                            "src",
                            "shaders",
                            "docs/library.md",
                            "docs/your-tests.md",
                            "README.md",
                        ]
                        .iter()
                        .any(|start| inside.starts_with(start))
                    });
                    assert!(
                        packed,
                        "{}: {} is not packed",
                        path.display(),
                        file.display()
                    );
                    found += 1;
                }
            }
        }
    }
    assert!(found >= 4, "only {found} files are included");
}
