//! Tests of the exactness pass, alone and with the SPIR-V validator.

use std::collections::BTreeMap;
use std::io::Write;
use std::process::{Command, Stdio};

use naga::back::spv;
use naga::valid::{Capabilities, ValidationFlags, Validator};
use proptest::prelude::*;
use tumble_exact::{
    FloatControls, PassError, SpirvError, exact, float_controls, inexact, no_contraction,
    no_contraction_with_f16, nontemporal_stores, splat_products, texel_buffers,
    without_decorations, workgroup_layouts,
};

/// All that a device may offer.
pub(crate) fn all_controls() -> FloatControls {
    FloatControls::default()
        .with_preserve_signed_zero_inf_nan(true)
        .with_round_to_nearest_even(true)
}

/// The name of the operation for which a module was refused.
fn refused(result: Result<Vec<u32>, PassError>) -> String {
    match result {
        Err(PassError::Inexact(found)) => found.name,
        other => panic!("{other:?}"),
    }
}

fn words(bytes: &[u8]) -> Vec<u32> {
    bytes
        .chunks_exact(4)
        .map(|c| u32::from_le_bytes([c[0], c[1], c[2], c[3]]))
        .collect()
}

/// (opcode, operands) of every instruction, read without the pass's own reader.
fn instructions(module: &[u32]) -> Vec<(u16, Vec<u32>)> {
    let mut rest = &module[5..];
    let mut found = Vec::new();
    while let Some(&first) = rest.first() {
        let (head, tail) = rest.split_at((first >> 16) as usize);
        found.push((first as u16, head[1..].to_vec()));
        rest = tail;
    }
    found
}

pub(crate) fn compile(wgsl: &str) -> Vec<u32> {
    let module = naga::front::wgsl::parse_str(wgsl).expect(wgsl);
    let info = Validator::new(ValidationFlags::all(), Capabilities::all())
        .validate(&module)
        .unwrap();
    let options = spv::Options {
        lang_version: (1, 3),
        ..spv::Options::default()
    };
    spv::write_vec(&module, &info, &options, None).unwrap()
}

fn kernel_of(expression: &str) -> Vec<u32> {
    compile(&format!(
        "@group(0) @binding(0) var<storage, read_write> values: array<f32>;
         @compute @workgroup_size(1) fn main() {{
             let a = values[0]; let b = values[1];
             values[2] = {expression};
         }}"
    ))
}

#[test]
fn every_float_operation_of_every_shader_is_decorated_once() {
    const FLOAT_ARITHMETIC: [u16; 4] = [127, 129, 131, 133];
    for (name, code) in tumble::vulkan::kernels() {
        let mut decorations = BTreeMap::<u32, u32>::new();
        let mut results = 0;
        let code = instructions(&words(code));
        for (opcode, operands) in &code {
            if *opcode == 71 && operands[1..] == [42] {
                *decorations.entry(operands[0]).or_default() += 1;
            }
        }
        for (opcode, operands) in &code {
            if FLOAT_ARITHMETIC.contains(opcode) {
                assert_eq!(
                    decorations.get(&operands[1]),
                    Some(&1),
                    "{name}: %{}",
                    operands[1]
                );
                results += 1;
            }
        }
        // Some kernels have fewer float operations: they copy words, work on integers, round to halves, or multiply
        // rows as vectors.
        let least = match name {
            "crowd_gather" | "crowd_scatter" | "motion_store" | "motion_pick" => 0,
            "crowd_half" => 1,
            "crowd_times" => 3,
            "crowd_skin" | "crowd_walk" | "crowd_walk_all" => 6,
            _ => 11,
        };
        assert!(
            results >= least,
            "{name} has only {results} float operations"
        );
        assert_eq!(
            results,
            decorations.len(),
            "{name}: something else is decorated"
        );
    }
}

/// `OpVectorTimesScalar`, `OpMatrixTimesScalar`, `OpVectorTimesMatrix`, `OpMatrixTimesVector`,
/// `OpMatrixTimesMatrix`, `OpOuterProduct` and `OpDot`: drivers and translators have other rules for
/// each, and tests of the expressions cover none of them.
#[test]
fn every_product_of_every_shader_is_one_of_components() {
    for (name, code) in tumble::vulkan::kernels() {
        let code = instructions(&words(code));
        let other = code.iter().find(|(opcode, _)| (142..=148).contains(opcode));
        assert_eq!(other, None, "{name}");
    }
}

#[test]
fn vectors_times_scalars_become_products_of_vectors() {
    let module = compile(
        "@group(0) @binding(0) var<storage, read_write> values: array<vec4f>;
         @compute @workgroup_size(1) fn main() {
             let own = values[0];
             values[1] = own * own.x;
             values[2] = vec4f(own.y * own.xyz, 0.0) + vec4f(own.xy * 3.0, own.zw);
         }",
    );
    let count = |module: &[u32], opcode| {
        let all = instructions(module);
        all.iter().filter(|(code, _)| *code == opcode).count()
    };
    let (times_scalar, multiply, construct) = (142, 133, 80);
    let found = count(&module, times_scalar);
    assert!(found >= 2, "naga wrote {found}");
    assert_eq!(refused(no_contraction(&module)), "OpVectorTimesScalar");
    let passed = splat_products(&module).unwrap();
    validate("splats", "vulkan1.1", &passed);
    assert_eq!(count(&passed, times_scalar), 0);
    assert_eq!(count(&passed, multiply), count(&module, multiply) + found);
    assert_eq!(count(&passed, construct), count(&module, construct) + found);
    assert_eq!(passed[3], module[3] + found as u32, "the bound of the ids");
    assert_eq!(splat_products(&passed).unwrap(), passed);
    assert!(no_contraction(&passed).is_ok());
    // A component of a type that is no vector.
    let header = [0x0723_0203, 0x1_0300, 0, 9, 0];
    let stray = [&header[..], &[5 << 16 | 142, 1, 2, 3, 4]].concat();
    assert_eq!(splat_products(&stray), Err(SpirvError::Incomplete));
}

#[test]
fn the_pass_changes_nothing_the_second_time_and_can_be_undone() {
    let kernels = tumble::vulkan::kernels();
    // Others have the modes of halves, too.
    for (name, code) in kernels.filter(|(name, _)| !name.ends_with("_converting")) {
        let passed = words(code);
        assert_eq!(no_contraction(&passed).unwrap(), passed, "{name}");
        let bare = without_decorations(&passed).unwrap();
        // These copy words.
        let has_floats = ![
            "crowd_gather",
            "crowd_scatter",
            "motion_store",
            "motion_pick",
        ]
        .contains(&name);
        assert_eq!(bare.len() < passed.len(), has_floats, "{name}");
        assert_eq!(no_contraction(&bare).unwrap(), passed, "{name}");
    }
}

#[test]
fn inexact_operations_are_refused() {
    let sum = kernel_of("a * b + a");
    assert!(no_contraction(&sum).is_ok());
    for expression in [
        "a / b",
        "a % b",
        "sin(a)",
        "sqrt(a)",
        "fma(a, b, a)",
        "min(a, b)",
        "mix(a, b, 0.5)",
        "dot(vec2f(a, b), vec2f(b, a))",
        "length(vec2f(a, b))",
        "f32(i32(a))",
        "subgroupAdd(a)",
        "subgroupMul(a)",
    ] {
        let error = no_contraction(&kernel_of(expression)).unwrap_err();
        assert!(
            matches!(error, PassError::Inexact(_)),
            "{expression}: {error}"
        );
    }
}

/// All operations are listed, each with its name and the line of the source. Integers, and sets of instructions that
/// compute nothing, are no fault.
#[test]
fn every_inexact_operation_is_listed() {
    let wgsl = "@group(0) @binding(0) var<storage, read_write> values: array<f32>;
@group(0) @binding(1) var<storage, read_write> indices: array<u32>;
@compute @workgroup_size(1) fn main() {
    values[0] = values[1] / values[2];
    indices[0] = min(indices[1], countTrailingZeros(indices[2]));
    values[3] = sqrt(values[4]) + 3.0 * values[5];
}";
    let module = naga::front::wgsl::parse_str(wgsl).unwrap();
    let info = Validator::new(ValidationFlags::all(), Capabilities::empty())
        .validate(&module)
        .unwrap();
    let options = spv::Options {
        debug_info: Some(spv::DebugInfo {
            source_code: wgsl,
            file_name: "kernel.wgsl",
            language: spv::SourceLanguage::WGSL,
        }),
        ..spv::Options::default()
    };
    let words = spv::write_vec(&module, &info, &options, None).unwrap();
    let found = inexact(&words).unwrap();
    let found: Vec<_> = found.iter().map(|one| (&*one.name, one.line)).collect();
    assert_eq!(found, [("OpFDiv", Some(4)), ("Sqrt", Some(6))]);
    let error = exact(&words).unwrap_err().to_string();
    assert!(error.starts_with("line 4: OpFDiv, at word "), "{error}");

    // A set of instructions of a debugger, and one that nobody knows.
    let imported = |set: &str| {
        let mut name: Vec<u8> = set.bytes().collect();
        name.resize(name.len() / 4 * 4 + 4, 0);
        let name = name
            .chunks_exact(4)
            .map(|c| u32::from_le_bytes([c[0], c[1], c[2], c[3]]));
        let mut words = vec![0x0723_0203, 0x1_0300, 0, 9, 0];
        words.push(((2 + set.len() as u32 / 4 + 1) << 16) | 11);
        words.push(1);
        words.extend(name);
        words.extend([5 << 16 | 12, 2, 3, 1, 1]);
        inexact(&words).unwrap().len()
    };
    assert_eq!(imported("NonSemantic.DebugPrintf"), 0);
    assert_eq!(imported("GLSL.std.999"), 1);
}

/// With every combination of controls that a device may report.
#[test]
fn the_validator_accepts_every_shader() {
    let environments = ["vulkan1.1", "vulkan1.2"];
    for (name, code) in tumble::vulkan::kernels() {
        for controls in 0..4 {
            let offered = FloatControls::default()
                .with_preserve_signed_zero_inf_nan(controls & 1 != 0)
                .with_round_to_nearest_even(controls & 2 != 0);
            let module = float_controls(&words(code), offered).unwrap();
            // Halves are in Vulkan from 1.2 on.
            let is_later = usize::from(name.ends_with("_converting"));
            for environment in &environments[is_later..] {
                validate(name, environment, &module);
            }
        }
    }
}

fn validate(name: &str, environment: &str, module: &[u32]) {
    let spawned = Command::new("spirv-val")
        .args(["--target-env", environment, "-"])
        .stdin(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    let mut validator = match spawned {
        Ok(validator) => validator,
        Err(error) => {
            assert!(
                std::env::var_os("CI").is_none(),
                "spirv-val (Debian: spirv-tools): {error}"
            );
            eprintln!("spirv-val is not installed: nothing was validated");
            return;
        }
    };
    let bytes: Vec<u8> = module.iter().flat_map(|word| word.to_le_bytes()).collect();
    validator.stdin.take().unwrap().write_all(&bytes).unwrap();
    let output = validator.wait_with_output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success(),
        "{name} for {environment}: {message}"
    );
}

#[test]
fn controls_reach_every_entry_point() {
    for (name, code) in tumble::vulkan::kernels() {
        let module = float_controls(&words(code), all_controls()).unwrap();
        let modes: Vec<_> = instructions(&module)
            .into_iter()
            .filter(|(opcode, operands)| *opcode == 16 && operands.len() == 3)
            .map(|(_, operands)| operands[1..].to_vec())
            .collect();
        assert!(
            modes.contains(&vec![4461, 32]) && modes.contains(&vec![4462, 32]),
            "{name}"
        );
        let none = FloatControls::default();
        assert_eq!(float_controls(&words(code), none).unwrap(), words(code));
    }
}

/// A texture of one dimension is at most as long as a picture is wide.
#[test]
fn textures_of_one_dimension_become_texel_buffers() {
    let module = compile(
        "@group(0) @binding(0) var texels: texture_1d<u32>;
         @group(0) @binding(1) var picture: texture_2d<u32>;
         @group(0) @binding(2) var<storage, read_write> values: array<vec4u>;
         @compute @workgroup_size(1) fn main(@builtin(global_invocation_id) at: vec3u) {
             values[at.x] = textureLoad(texels, at.x, 0) + textureLoad(picture, at.xy, 0);
         }",
    );
    let passed = texel_buffers(&module).unwrap();
    validate("texels", "vulkan1.1", &passed);
    // The dimension and whether it is an array; capabilities; the level of a fetch.
    let all = instructions(&passed);
    let of = |requested: u16| all.iter().filter(move |(opcode, _)| *opcode == requested);
    let mut dimensions: Vec<u32> = of(25).map(|(_, operands)| operands[2]).collect();
    dimensions.sort_unstable();
    assert_eq!(dimensions, [1, 5]);
    assert!(of(17).any(|(_, operands)| operands == &[46]));
    assert!(of(17).all(|(_, operands)| operands != &[43]));
    let fetches: Vec<usize> = of(95).map(|(_, operands)| operands.len()).collect();
    assert_eq!(fetches.iter().filter(|&&length| length == 4).count(), 1);
    assert_eq!(texel_buffers(&passed).unwrap(), passed);
}

/// Memory of a workgroup has no layout: a type in it is decorated only where a buffer needs it.
#[test]
fn types_in_workgroup_memory_lose_their_layout() {
    let kernel = |shared: &str| {
        compile(&format!(
            "struct Pair {{ row: vec4f, list: array<u32, 4> }}
             struct Other {{ row: vec4f, list: array<u32, 5> }}
             @group(0) @binding(0) var<storage, read_write> values: array<Pair>;
             var<workgroup> shared_values: array<{shared}, 8>;
             @compute @workgroup_size(8) fn main(@builtin(local_invocation_index) lane: u32) {{
                 shared_values[lane].list[1] = lane;
                 workgroupBarrier();
                 values[lane].list[2] = shared_values[7u - lane].list[1];
             }}"
        ))
    };
    let layouts = |module: &[u32]| {
        let of = |(opcode, operands): &(u16, Vec<u32>)| match opcode {
            71 => operands[1] == 6,  // ArrayStride
            72 => operands[2] == 35, // Offset
            _ => false,
        };
        instructions(module).iter().filter(|one| of(one)).count()
    };
    let module = kernel("Other");
    let before = layouts(&module);
    let passed = workgroup_layouts(&module).unwrap();
    validate("workgroup", "vulkan1.1", &passed);
    assert_eq!(
        before - layouts(&passed),
        4,
        "two strides and two offsets go"
    );
    assert_eq!(workgroup_layouts(&passed).unwrap(), passed);
    assert!(matches!(
        workgroup_layouts(&kernel("Pair")),
        Err(PassError::SharedLayout { .. })
    ));
    let mut with_workgroup_memory = 0;
    for (name, code) in tumble::vulkan::kernels() {
        let code = words(code);
        assert_eq!(workgroup_layouts(&code).unwrap(), code, "{name}");
        let all = instructions(&code);
        let shares = |(opcode, operands): &(u16, Vec<u32>)| *opcode == 32 && operands[1] == 4;
        with_workgroup_memory += usize::from(all.iter().any(shares));
    }
    assert!(with_workgroup_memory > 0);
}

/// A conversion to half precision is refused, except in kernels that ask for its rounding.
#[test]
fn conversions_to_halves_ask_for_their_rounding() {
    const CONVERSION: u16 = 115;
    const MODES: [[u32; 2]; 2] = [[4459, 16], [4462, 16]]; // DenormPreserve, RoundingModeRTE
    let module = compile(
        "enable f16;
         @group(0) @binding(0) var<storage, read_write> values: array<f32>;
         @group(0) @binding(1) var<storage, read_write> halves: array<f16>;
         @compute @workgroup_size(1) fn main() { halves[0] = f16(values[0] * values[1]); }",
    );
    assert_eq!(refused(no_contraction(&module)), "a float of 16 bits");
    let double = compile(
        "@group(0) @binding(0) var<storage, read_write> values: array<f64>;
         @compute @workgroup_size(1) fn main() { values[0] = f64(f32(values[1])); }",
    );
    let double = no_contraction_with_f16(&double);
    assert_eq!(refused(double), "a float of 64 bits");
    let found = |module: &[u32]| {
        let all = instructions(module);
        let conversions = all.iter().filter(|one| one.0 == CONVERSION).count();
        let modes = all.iter().filter(|one| one.0 == 16);
        let has = |mode: [u32; 2]| modes.clone().any(|one| one.1[1..] == mode);
        (conversions, MODES.map(has))
    };
    assert_eq!(
        found(&no_contraction_with_f16(&module).unwrap()),
        (1, [true; 2])
    );
    let mut converting = 0;
    for (name, code) in tumble::vulkan::kernels() {
        let (conversions, modes) = found(&words(code));
        let converts = name.ends_with("_converting");
        assert_eq!(
            (conversions, modes),
            (usize::from(converts), [converts; 2]),
            "{name}"
        );
        converting += usize::from(converts);
    }
    assert_eq!(converting, 9);
}

/// Stores of a kernel into buffers, and into other memory: how many, and how many have a mark.
fn stores(module: &[u32]) -> [[usize; 2]; 2] {
    const NONTEMPORAL: u32 = 4;
    let all = instructions(module);
    let buffers = all.iter().filter(|one| one.0 == 32 && one.1[1] == 12);
    let buffers: Vec<u32> = buffers.map(|(_, operands)| operands[0]).collect();
    let chains = (all.iter()).filter(|one| one.0 == 65 && buffers.contains(&one.1[0]));
    let chains: Vec<u32> = chains.map(|(_, operands)| operands[1]).collect();
    let mut counts = [[0; 2]; 2];
    for (_, operands) in all.iter().filter(|one| one.0 == 62) {
        let count = &mut counts[usize::from(!chains.contains(&operands[0]))];
        count[0] += 1;
        count[1] += usize::from(operands.get(2) == Some(&NONTEMPORAL));
    }
    counts
}

/// Results of kernels for cards go past the caches, and nothing else does.
#[test]
fn stores_into_buffers_are_marked_in_kernels_for_cards() {
    let module = compile(
        "@group(0) @binding(0) var<storage, read_write> values: array<vec4f>;
         var<workgroup> tile: array<vec4f, 4>;
         @compute @workgroup_size(4) fn main(@builtin(local_invocation_index) i: u32) {
             tile[i] = values[i];
             workgroupBarrier();
             values[i + 4u] = tile[3u - i];
             values[i + 8u].x = 1.0;
         }",
    );
    let [buffers, others] = stores(&module);
    assert_eq!(buffers, [2, 0]);
    let marked = nontemporal_stores(&module).unwrap();
    validate("stores", "vulkan1.1", &marked);
    assert_eq!(stores(&marked), [[2, 2], others]);
    assert_eq!(nontemporal_stores(&marked).unwrap(), marked);
    let mut for_cards = 0;
    for (name, code) in tumble::vulkan::kernels() {
        let is_for_cards = name.contains("_spread_") || name.contains("_coalesced_");
        let [buffers, others] = stores(&words(code));
        let marked = if is_for_cards { buffers[0] } else { 0 };
        assert!(buffers[0] > 0, "{name}");
        assert_eq!([buffers[1], others[1]], [marked, 0], "{name}");
        for_cards += usize::from(is_for_cards);
    }
    assert_eq!(for_cards, 72 + 8);
}

#[test]
fn what_is_no_module_is_refused() {
    assert_eq!(no_contraction(&[]), Err(SpirvError::NotSpirv.into()));
    assert_eq!(texel_buffers(&[]), Err(SpirvError::NotSpirv));
    assert_eq!(splat_products(&[]), Err(SpirvError::NotSpirv));
    assert_eq!(nontemporal_stores(&[]), Err(SpirvError::NotSpirv));
    assert_eq!(workgroup_layouts(&[]), Err(SpirvError::NotSpirv.into()));
    assert_eq!(no_contraction(&[0; 8]), Err(SpirvError::NotSpirv.into()));
    let header = [0x0723_0203, 0x1_0300, 0, 1, 0];
    assert_eq!(no_contraction(&header), Err(SpirvError::Incomplete.into()));
    assert_eq!(
        float_controls(&header, all_controls()),
        Err(SpirvError::Incomplete)
    );
    let cut = [&header[..], &[9 << 16 | 17]].concat();
    let truncated = SpirvError::Truncated { word: 5 };
    assert_eq!(no_contraction(&cut), Err(truncated.into()));
    let double = [&header[..], &[3 << 16 | 22, 1, 64]].concat();
    assert_eq!(refused(no_contraction(&double)), "a float of 64 bits");
}

proptest! {
    /// A driver's crash or ours must not follow from a damaged file.
    #[test]
    fn arbitrary_words_never_panic(
        mut module in prop::collection::vec(any::<u32>(), 0..64),
        short in any::<bool>(),
        headed in any::<bool>(),
    ) {
        if short {
            // Opcodes that the pass knows, with small lengths.
            for word in &mut module {
                *word = (*word >> 29) << 16 | (*word & 0x1ff);
            }
        }
        if headed && module.len() > 5 {
            module[0] = 0x0723_0203;
        }
        let _ = no_contraction(&module);
        let _ = float_controls(&module, all_controls());
        let _ = without_decorations(&module);
        let _ = texel_buffers(&module);
        let _ = texel_buffers(&module);
        let _ = splat_products(&module);
        let _ = nontemporal_stores(&module);
    }

    /// A damaged shader is refused or stays a list of whole instructions.
    #[test]
    fn damaged_shaders_never_panic(offset in 0usize..2000, value in any::<u32>()) {
        for (_, code) in tumble::vulkan::kernels() {
            let mut module = words(code);
            let offset = offset % module.len();
            module[offset] = value;
            let _ = no_contraction(&module);
            let _ = float_controls(&module, all_controls());
            let _ = texel_buffers(&module);
            let _ = texel_buffers(&module);
            let _ = splat_products(&module);
        }
    }
}
