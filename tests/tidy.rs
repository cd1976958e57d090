//! Rules of this project that the compiler does not check.

use std::fs;
use std::path::{Path, PathBuf};

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
            } else if path.extension().is_some_and(|name| name == extension) {
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
        "exact/src",
        "verify/src",
    ]
    .map(|folder| files(folder, "rs"));
    for path in sources.concat() {
        let relative = path.strip_prefix(root()).unwrap();
        let home = relative.starts_with("src/gpu")
            || relative.starts_with("src/simd")
            || relative.ends_with("src/engine/application_device.rs")
            || relative.ends_with("src/engine/clip/request/on_device/application_device.rs")
            // C interfaces: CUDA's driver, and the exchange of arrays.
            || relative.ends_with("python/src/cuda.rs")
            || relative.ends_with("python/src/dlpack.rs")
            || relative.ends_with("src/crowd/player/application_device.rs")
            || relative.ends_with("src/pose/pass/application_device.rs")
            // An application's device, and what an application guarantees.
            || relative.ends_with("verify/src/application.rs")
            || relative.ends_with("verify/src/instance.rs")
            || relative.ends_with("verify/src/renderer.rs");
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
    let folders = folders.into_iter().chain([
        "exact/src",
        "npm/src",
        "python/src",
        "shader-compiler/src",
        "verify/src",
    ]);
    let mut unsafe_lines = 0;
    for path in folders.flat_map(|folder| files(folder, "rs")) {
        let text = read(&path);
        let lines: Vec<&str> = text.lines().collect();
        for (i, line) in lines.iter().enumerate() {
            if line.trim_start().starts_with("//") {
                continue;
            }
            let location = format!("{}:{}", path.display(), i + 1);
            // A fused multiply-add rounds once, but the kernels round twice.
            assert!(
                !line.contains("mul_add") && !line.contains("fmadd"),
                "{location}"
            );
            if line.contains("unsafe {") || line.contains("unsafe impl") {
                unsafe_lines += 1;
                let before = &lines[i.saturating_sub(REASON_WITHIN)..=i];
                let has_reason = before.iter().any(|line| line.contains("SAFETY: "));
                assert!(
                    has_reason,
                    "{location}: say why it is sound, after `// SAFETY: `"
                );
            }
        }
    }
    assert!(unsafe_lines > 200, "only {unsafe_lines} were found");
}

/// Functions of the system's library, the compiler's (`powi`), or glam's that call them: their last bit is another on
/// another system, or with another compiler. Those of `libm` and of `math::quaternion` are the same everywhere.
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
    "src/engine/auto.rs", // a probe to time
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
        "exact/src",
        "verify/src",
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
                // Entry points, and the functions that lead samples through them.
                "from_keys",
                "poses",
                "runs",
                "samples",
                "coalesced",
                "alone",
                "together",
                "crowd",
                "motion",
                "whole",
                "whole_rotations",
                "whole_matrices",
                "subgroup_rotations",
                "self_test",
                "link",
                "workgroup",
                "dispatch",
                "time_tables",
                "time_buffers",
                "link_buffers",
                "half_buffers",
                "grid",
                "spread",
                "item",
                "frame_distance",
                "time_distance",
                "near_frame",
                "near_time",
                // Stores that only move bits.
                "f32",
                "f32_wide",
                "wide",
                "vector",
                "store",
                "pick",
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
const LAYERS: [&str; 29] = [
    "names",
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
    "machine",
    "cpu",
    "work",
    "gpu",
    "evaluate",
    FACE,
    "pose",
    "crowd",
    "verify",
    "lab",
];

const FACE: &str = "face";

/// Folders of the face: types whose methods fill several files.
const FACE_FOLDERS: [&str; 1] = ["engine"];

/// The layer of a file or of a module, by the first part of its path within `src/`.
fn layer(first: &str) -> &str {
    let name = first.strip_suffix(".rs").unwrap_or(first);
    let is_folder = root().join("src").join(name).is_dir();
    match is_folder && !FACE_FOLDERS.contains(&name) {
        true => name,
        false => FACE,
    }
}

/// Why `line` of a file of the layer `layer_name` may not stand there.
fn refused(layer_name: &str, line: &str) -> Option<String> {
    let rank = |layer: &str| {
        let found = LAYERS.iter().position(|name| *name == layer);
        found.unwrap_or_else(|| panic!("the table of layers has no `{layer}`"))
    };
    let code = line.split("//").next().unwrap();
    code.split("crate::").skip(1).find_map(|path| {
        let first: &str = path.split([':', ',', ';', ' ', '}', '!']).next().unwrap();
        let other = layer(first);
        (rank(other) > rank(layer_name))
            .then(|| format!("{layer_name} uses {other}, which lies above it"))
    })
}

/// Each folder can be read without the folders that are built on it, and there is no circle. Unit
/// tests may look up: they drive what they test through the engine.
#[test]
fn imports_go_down_the_layers() {
    let mut checked = 0;
    for path in files("src", "rs") {
        let relative = path.strip_prefix(root().join("src")).unwrap();
        if relative == Path::new("lib.rs") {
            continue;
        }
        let home = layer(relative.iter().next().unwrap().to_str().unwrap());
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
            if let Some(why) = refused(home, line) {
                panic!("{}:{}: {why}: {line}", path.display(), number + 1);
            }
        }
    }
    assert!(checked > 500, "only {checked} imports were found");
}

/// A plan is made from numbers; machines carry it out.
#[test]
fn the_plan_knows_no_machine() {
    let text = read("src/machine/plan.rs");
    let code = text.split("#[cfg(test)]").next().unwrap();
    for machine in ["crate::cpu", "crate::gpu", "dyn Machine"] {
        assert!(
            !code.contains(machine),
            "src/machine/plan.rs uses {machine}"
        );
    }
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

/// The README is one page; everything else is in `docs/`.
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

/// A dependency without a stated use can be left out.
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

/// Catches a program with its symbols, a fifth of its size: a profile's entry for a package takes the profile's
/// `strip` away.
#[test]
fn the_program_is_stripped() {
    let manifest = read("Cargo.toml");
    let (_, release) = manifest.split_once("[profile.release]").unwrap();
    assert!(release.contains("\nstrip = true"));
    let entry = release
        .lines()
        .find(|line| line.starts_with("tumble-cli = "));
    assert!(
        entry.is_none_or(|entry| entry.contains("strip = true")),
        "{entry:?}"
    );
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
    for package in ["", "exact/", "verify/", "formats/", "routes/", "cli/"] {
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
                            "functions.wgsl",
                            "docs/crowd.md",
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

/// A word or a mark of a source text, and its line.
struct Token<'a> {
    text: &'a str,
    line: usize,
}

/// Where the literal ends that starts with a quotation mark at `start`; `hashes` of a raw one.
fn after_string(text: &str, start: usize, hashes: Option<usize>) -> usize {
    let body = &text[start + 1..];
    let length = match hashes {
        Some(count) => {
            let end = format!("\"{}", "#".repeat(count));
            body.find(&end).map(|at| at + end.len())
        }
        None => {
            let mut is_escaped = false;
            let end = body.bytes().position(|byte| {
                let is_end = byte == b'"' && !is_escaped;
                is_escaped = byte == b'\\' && !is_escaped;
                is_end
            });
            end.map(|at| at + 1)
        }
    };
    length.map_or(text.len(), |length| start + 1 + length)
}

/// Where the comment ends that starts at `start`: such comments lie within each other.
fn after_block_comment(text: &str, start: usize) -> usize {
    let (mut at, mut depth) = (start + 2, 1);
    while depth > 0 && at < text.len() {
        let rest = &text.as_bytes()[at..];
        let (step, change) = match rest {
            [b'/', b'*', ..] => (2, 1),
            [b'*', b'/', ..] => (2, -1),
            _ => (1, 0),
        };
        at += step;
        depth += change;
    }
    at.min(text.len())
}

/// Where the character, or the lifetime, ends whose quotation mark is at `start`.
fn after_quote(text: &str, start: usize) -> usize {
    let body = &text[start + 1..];
    if let Some(escaped) = body.strip_prefix('\\') {
        let skipped = escaped.chars().next().map_or(0, char::len_utf8);
        let end = escaped[skipped..].find('\'');
        return end.map_or(text.len(), |at| start + 2 + skipped + at + 1);
    }
    let first = body.chars().next().map_or(0, char::len_utf8);
    match body[first..].starts_with('\'') {
        true => start + 1 + first + 1,
        false => start + 1 + length_of_word(body),
    }
}

fn length_of_word(text: &str) -> usize {
    let is_part = |letter: char| letter.is_alphanumeric() || letter == '_';
    text.find(|letter| !is_part(letter)).unwrap_or(text.len())
}

/// The words and marks of a Rust source, without its comments and literals.
fn tokens(text: &str) -> Vec<Token<'_>> {
    let (mut all, mut at, mut line) = (Vec::new(), 0, 1);
    while let Some(first) = text[at..].chars().next() {
        let (start, rest) = (at, &text[at..]);
        let mut token = None;
        if rest.starts_with("//") {
            at += rest.find('\n').unwrap_or(rest.len());
        } else if rest.starts_with("/*") {
            at = after_block_comment(text, at);
        } else if first == '"' {
            at = after_string(text, at, None);
        } else if first == '\'' {
            at = after_quote(text, at);
        } else if first.is_ascii_digit() {
            at += length_of_word(rest);
        } else if first.is_alphabetic() || first == '_' {
            let word = &rest[..length_of_word(rest)];
            let behind = &rest[word.len()..];
            let hashes = behind.len() - behind.trim_start_matches('#').len();
            let is_raw = ["r", "br", "cr"].contains(&word);
            at += word.len();
            if is_raw && behind[hashes..].starts_with('"') {
                at = after_string(text, at + hashes, Some(hashes));
            } else if ["b", "c"].contains(&word) && behind.starts_with('"') {
                at = after_string(text, at, None);
            } else if word == "b" && behind.starts_with('\'') {
                at = after_quote(text, at);
            } else if word == "r" && hashes == 1 {
                at += 1; // a raw identifier follows
            } else {
                token = Some(word);
            }
        } else {
            at += first.len_utf8();
            token = (!first.is_whitespace()).then(|| &rest[..first.len_utf8()]);
        }
        all.extend(token.map(|text| Token { text, line }));
        line += text[start..at].matches('\n').count();
    }
    all
}

/// The words of an identifier, in lower case: `own_keys`, `OwnKeys` and `OWN_KEYS` have the same.
fn words(identifier: &str) -> Vec<String> {
    let mut all = Vec::new();
    for part in identifier.split('_').filter(|part| !part.is_empty()) {
        let is_camel = part.contains(char::is_lowercase);
        for (i, letter) in part.char_indices() {
            if i == 0 || is_camel && letter.is_uppercase() {
                all.push(String::new());
            }
            let word: &mut String = all.last_mut().unwrap();
            word.extend(letter.to_lowercase());
        }
    }
    all
}

/// Words that named many things each (`docs/words.md`): a name says which one it is.
const RETIRED: [&str; 35] = [
    "own", "place", "places", "given", "wanted", "what", "told", "way", "ways", "turn", "turns",
    "turned", "hold", "holds", "far", "fate", "fates", "beyond", "party", "parties", "wish",
    "wishes", "manner", "manners", "fly", "bring", "brought", "gone", "few", "studio", "studios",
    "usual", "taken", "most", "look",
];

/// Phrases in which a retired word is the field's or ordinary English, and why.
const ALLOWED: [(&str, &str); 9] = [
    ("at_most", "a bound"),
    ("half_turn", "an angle"),
    ("half_turns", "rotations by this angle"),
    (
        "in_place",
        "without a copy, as in Rust's standard library; of motion, as animation tools call it",
    ),
    ("look_at", "of a camera, as in glam and OpenGL"),
    ("most_common", "what statistics call the mode"),
    ("quarter_turn", "an angle"),
    ("too_few", "below a minimum"),
    ("wrap_hold", "the wrap mode, in the shaders' constants"),
];

/// Whole identifiers, as they stand.
const ALLOWED_WHOLE: [(&str, &str); 1] = [(
    "Hold",
    "the wrap mode that keeps the last key, as animation tools call it",
)];

/// The retired word in an identifier.
fn retired_word(identifier: &str) -> Option<&'static str> {
    if ALLOWED_WHOLE.iter().any(|(whole, _)| *whole == identifier) {
        return None;
    }
    let mut all = format!("_{}_", words(identifier).join("_"));
    for (phrase, _) in ALLOWED {
        all = all.replace(&format!("_{phrase}_"), "_");
    }
    let found = all
        .split('_')
        .find_map(|word| RETIRED.iter().find(|retired| **retired == word));
    found.copied()
}

/// The identifiers that have a retired word, with their lines. Names of tests are sentences, and may.
fn retired_identifiers(text: &str) -> Vec<(usize, &str)> {
    let tokens = tokens(text);
    let (mut found, mut is_test) = (Vec::new(), false);
    for (i, token) in tokens.iter().enumerate() {
        let before = |count: usize| i.checked_sub(count).map_or("", |i| tokens[i].text);
        is_test |= token.text == "test" && before(1) == "[" && before(2) == "#";
        let is_name_of_test = is_test && before(1) == "fn";
        if is_name_of_test {
            is_test = false;
        } else if retired_word(token.text).is_some() {
            found.push((token.line, token.text));
        }
    }
    found
}

/// Every folder with Rust sources.
const SOURCES: [&str; 15] = [
    "exact",
    "verify",
    "src",
    "tests",
    "examples",
    "benches",
    "fuzz",
    "shaders",
    "formats",
    "routes",
    "cli",
    "python",
    "capi",
    "npm",
    "shader-compiler",
];

/// How often folders may still use retired words. The numbers only fall; a folder without one has none.
const UNFINISHED: [(&str, usize); 0] = [];

#[test]
fn retired_words_do_not_come_back() {
    let mut counts = UNFINISHED.map(|_| 0);
    let (mut wrong, mut identifiers) = (Vec::new(), 0);
    for path in SOURCES.iter().flat_map(|folder| files(folder, "rs")) {
        let relative = path.strip_prefix(root()).unwrap();
        if relative.iter().any(|part| part == "target") {
            continue;
        }
        let text = read(&path);
        identifiers += tokens(&text).len();
        let unfinished = UNFINISHED
            .iter()
            .position(|(folder, _)| relative.starts_with(folder));
        let found = retired_identifiers(&text);
        if let Some(i) = unfinished {
            counts[i] += found.len();
            continue;
        }
        let named = |(line, name)| format!("{}:{line}: {name}", relative.display());
        wrong.extend(found.into_iter().map(named));
    }
    for ((folder, limit), count) in UNFINISHED.iter().zip(counts) {
        if count > *limit {
            wrong.push(format!("{folder}: {count} retired words, {limit} at most"));
        }
    }
    assert!(
        wrong.is_empty(),
        "{} names have a word that says too little (docs/words.md):\n{}",
        wrong.len(),
        wrong.join("\n")
    );
    assert!(
        identifiers > 1_000_000,
        "only {identifiers} words were read"
    );
}

/// The test of the words can fail.
#[test]
fn a_retired_word_is_found() {
    let text = r##"
        // own place
        fn follow<'own>(own_times: &OwnKeys) -> usize {
            let said = ("what", 'w', r#"a "turn" of its own"#, b"told", '\'', "\"given");
            /* far /* few */ beyond */ at_most(Transfer::InPlace, WrapMode::Hold)
                + MOST_BYTES + r#place + in_turn(HALF_TURN) + owner.placement.lookup()
        }
        #[test]
        #[should_panic]
        fn what_is_told_is_taken() {}
        fn what() {}
    "##;
    let expected = [
        (3, "own_times"),
        (3, "OwnKeys"),
        (6, "MOST_BYTES"),
        (6, "place"),
        (6, "in_turn"),
        (11, "what"),
    ];
    assert_eq!(retired_identifiers(text), expected);
}

/// Folders with other sources than Rust, and the endings of these.
const OTHER_SOURCES: [(&str, &str); 7] = [
    ("shaders", "wgsl"),
    ("web/src", "js"),
    ("npm/package", "js"),
    ("npm/package", "ts"),
    ("npm/tests", "js"),
    ("npm/tests", "mts"),
    ("formats/tests/validator", "mjs"),
];

/// Beginnings of comments whose subject is a clause.
const CLAUSES: [&str; 4] = ["What", "Whoever", "Who", "Of several"];

/// The text of a line that is a comment.
fn comment(line: &str) -> Option<&str> {
    let text = line.trim_start().strip_prefix("//")?;
    Some(text.strip_prefix(['/', '!']).unwrap_or(text).trim_start())
}

/// Whether a comment begins with a clause. The help of an option may: "What to draw".
fn begins_with_clause(comment: &str) -> bool {
    CLAUSES.iter().any(|clause| {
        comment.strip_prefix(clause).is_some_and(|rest| {
            let next = rest.trim_start();
            length_of_word(rest) == 0 && &next[..length_of_word(next)] != "to"
        })
    })
}

/// A reader of "What is done with X" must find the verb before the subject; "The treatment of X" says it at once.
#[test]
fn comments_name_their_subject_first() {
    let rust = SOURCES.iter().flat_map(|folder| files(folder, "rs"));
    let others = OTHER_SOURCES
        .iter()
        .flat_map(|(folder, extension)| files(folder, extension));
    let (mut wrong, mut comments) = (Vec::new(), 0);
    for path in rust.chain(others) {
        let relative = path.strip_prefix(root()).unwrap();
        if relative.iter().any(|part| part == "target") {
            continue;
        }
        for (i, line) in read(&path).lines().enumerate() {
            let Some(text) = comment(line) else { continue };
            comments += 1;
            if begins_with_clause(text) {
                wrong.push(format!("{}:{}: {text}", relative.display(), i + 1));
            }
        }
    }
    assert!(
        wrong.is_empty(),
        "{} comments begin with a clause; name the thing instead (\"The result of …\", \"Files that …\"), or say how \
         or why (\"How …\", \"… because …\"):\n{}",
        wrong.len(),
        wrong.join("\n")
    );
    assert!(comments > 10_000, "only {comments} comments were read");
}

/// The test of the comments can fail.
#[test]
fn a_comment_that_begins_with_a_clause_is_found() {
    let refused = [
        "What is drawn",
        "Who asks",
        "Whoever asks",
        "Of several errors, the first",
    ];
    assert!(refused.into_iter().all(begins_with_clause));
    let accepted = [
        "What to draw",
        "Whole numbers",
        "Whatever it is",
        "The result",
        "Of a set",
    ];
    assert!(!accepted.into_iter().any(begins_with_clause));
    for line in ["// a", "    /// a", "//! a"] {
        assert_eq!(comment(line), Some("a"));
    }
    assert_eq!(comment("a / b // c"), None);
}

/// The type that the inherent `impl` at a token is of; none for those of traits and for types (`impl Iterator`).
fn type_of_impl<'a>(tokens: &[Token<'a>], at: usize) -> Option<&'a str> {
    let before = at.checked_sub(1).map_or(";", |i| tokens[i].text);
    if tokens[at].text != "impl" || ![";", "{", "}", "]", "unsafe"].contains(&before) {
        return None;
    }
    let (mut depth, mut name) = (0, None);
    for pair in tokens[at..].windows(2) {
        let (before, text) = (pair[0].text, pair[1].text);
        match text {
            "<" => depth += 1,
            ">" if before != "-" => depth -= 1,
            "for" | "$" if depth == 0 => return None,
            "{" | "where" if depth == 0 => return name,
            _ if depth == 0 && text.starts_with(char::is_alphabetic) => name = Some(text),
            _ => {}
        }
    }
    None
}

/// The inherent `impl`s of a package that stand neither in the file of their type nor in one of its child modules:
/// file, line and type.
fn away_from_home(files: &[(String, String)]) -> Vec<(&str, usize, &str)> {
    let lexed = files
        .iter()
        .map(|(path, text)| (path.as_str(), tokens(text)));
    let lexed: Vec<(&str, Vec<Token>)> = lexed.collect();
    let mut homes = Vec::new();
    for (path, tokens) in &lexed {
        let defined = tokens
            .windows(2)
            .filter(|pair| ["struct", "enum", "union", "type"].contains(&pair[0].text));
        let folder = ["/mod.rs", "/lib.rs", ".rs"]
            .iter()
            .find_map(|end| path.strip_suffix(end));
        homes.extend(defined.map(|pair| (pair[1].text, *path, folder.unwrap_or(path))));
    }
    let mut away = Vec::new();
    for (path, tokens) in &lexed {
        for at in 0..tokens.len() {
            let Some(name) = type_of_impl(tokens, at) else {
                continue;
            };
            let is_home = homes.iter().any(|(of, file, folder)| {
                let is_child = Path::new(path).starts_with(folder);
                *of == name && (file == path || is_child)
            });
            if !is_home {
                away.push((*path, tokens[at].line, name));
            }
        }
    }
    away
}

/// Files with methods of types that live elsewhere, and why.
const AWAY: [(&str, &[&str], &str); 13] = [
    (
        "routes/src/route.rs",
        &["Mesh"],
        "a mesh knows nothing of the routes over it",
    ),
    (
        "src/crowd/layer.rs",
        &["CrowdEntry"],
        "the type is generated in shaders/compiled/kernels.rs",
    ),
    ("src/crowd/player/mod.rs", &["Engine"], ABOVE_THE_ENGINE),
    ("src/pose/follow.rs", &["Engine"], ABOVE_THE_ENGINE),
    ("src/pose/local_to_model.rs", &["Engine"], ABOVE_THE_ENGINE),
    ("src/pose/pass/mod.rs", &["Engine"], ABOVE_THE_ENGINE),
    ("src/pose/poses.rs", &["Engine"], ABOVE_THE_ENGINE),
    ("src/pose/smooth.rs", &["Engine"], ABOVE_THE_ENGINE),
    ("src/pose/scalars.rs", &["Engine"], ABOVE_THE_ENGINE),
    ("src/pose/transforms.rs", &["Engine"], ABOVE_THE_ENGINE),
    ("src/lab/resident.rs", &["Clip", "Engine"], ABOVE_THE_ENGINE),
    (
        "src/method/interpolation.rs",
        &["ReferenceCurve"],
        "the reference knows neither methods nor their options",
    ),
    (
        "src/shader/mod.rs",
        &["Kernel"],
        "the type is generated in shaders/compiled/kernels.rs",
    ),
];

const ABOVE_THE_ENGINE: &str = "a layer above the engine's face, which does not know it";

/// So many of a folder may still be away; the numbers only fall.
const AWAY_UNFINISHED: [(&str, usize); 0] = [];

/// A reader finds all that a type does in one file and in the folder of its name.
#[test]
fn an_impl_stands_at_home() {
    let packages = SOURCES.iter().filter_map(|package| match *package {
        "src" => Some("src".to_owned()),
        "tests" | "examples" | "benches" | "shaders" => None,
        package => Some(format!("{package}/src")),
    });
    let (mut wrong, mut counts, mut is_used) =
        (Vec::new(), AWAY_UNFINISHED.map(|_| 0), [false; AWAY.len()]);
    let mut read_files = 0;
    for package in packages {
        let texts = files(&package, "rs").into_iter().map(|path| {
            let relative = path.strip_prefix(root()).unwrap();
            (relative.to_str().unwrap().replace('\\', "/"), read(&path))
        });
        let texts: Vec<(String, String)> = texts.collect();
        read_files += texts.len();
        for (path, line, name) in away_from_home(&texts) {
            let is_in = |folder: &str| Path::new(path).starts_with(folder);
            let is_listed =
                |(file, of, _): &(&str, &[&str], &str)| *file == path && of.contains(&name);
            if let Some(i) = AWAY_UNFINISHED.iter().position(|(folder, _)| is_in(folder)) {
                counts[i] += 1;
            } else if let Some(i) = AWAY.iter().position(is_listed) {
                is_used[i] = true;
            } else {
                wrong.push(format!("{path}:{line}: {name}"));
            }
        }
    }
    for ((file, of, _), is_used) in AWAY.iter().zip(is_used) {
        if !is_used {
            wrong.push(format!("{file}: {of:?} is listed, and at home: remove it"));
        }
    }
    for ((folder, limit), count) in AWAY_UNFINISHED.iter().zip(counts) {
        if count > *limit {
            wrong.push(format!("{folder}: {count}, {limit} at most"));
        }
    }
    assert!(
        wrong.is_empty(),
        "{} `impl`s stand neither in the file of their type nor in a child module of it:\n{}",
        wrong.len(),
        wrong.join("\n")
    );
    assert!(read_files > 500, "only {read_files} files were read");
}

/// The test of the homes can fail.
#[test]
fn an_impl_away_from_home_is_found() {
    let files = [
        (
            "src/engine.rs",
            "pub struct Engine; impl Engine {} fn all() -> impl Iterator<Item = u8> {}",
        ),
        ("src/engine/run.rs", "impl super::Engine {}"),
        (
            "src/clip.rs",
            "\nimpl Engine {} impl Drop for Engine {} impl<T: Fn() -> u8> Lane<T> where T: Copy {}",
        ),
        ("src/time/mod.rs", "pub(crate) struct Lane<T>(T);"),
        ("src/time/runs.rs", "impl<T> Lane<T> {}"),
    ];
    let files = files.map(|(path, text)| (path.to_owned(), text.to_owned()));
    let expected = [("src/clip.rs", 2, "Engine"), ("src/clip.rs", 2, "Lane")];
    assert_eq!(away_from_home(&files), expected);
}

/// A file beside `all.rs` that it does not name is not compiled: its tests would never run.
#[test]
fn every_file_of_tests_is_compiled() {
    for package in ["", "cli/", "formats/", "capi/", "routes/"] {
        let folder = format!("{package}tests");
        let all = read(format!("{folder}/all.rs"));
        let manifest = read(format!("{package}Cargo.toml"));
        for entry in fs::read_dir(root().join(&folder)).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            let Some(module) = name.strip_suffix(".rs") else {
                continue;
            };
            let is_named = all.contains(&format!("mod {module};"))
                || manifest.contains(&format!("[[test]]\nname = \"{module}\"\n"));
            assert!(is_named, "{folder}/{name}: name it in all.rs");
        }
    }
}
