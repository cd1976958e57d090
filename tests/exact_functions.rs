//! A shader of a user of the crate `tumble-exact`: its functions, and sums that drivers tend to simplify, are
//! compiled by naga and made exact. They have the bits of Rust on every device. Without the pass they do not.

use std::process::Command;

use tumble_exact::{exact, functions};

use crate::application::{Application, ApplicationBuffer};
use crate::examples::program;
use crate::spirv::compile;

/// Per argument: sine, cosine, reciprocal, its root, root, arc tangent, a fusible product, and a cancellation.
const KERNEL: &str = "
    @group(0) @binding(0) var<storage, read_write> arguments: array<vec2f>;
    @group(0) @binding(1) var<storage, read_write> values: array<f32>;
    @compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3u) {
        if id.x >= arrayLength(&arguments) { return; }
        let x = arguments[id.x].x;
        let angle = arguments[id.x].y;
        let first = 8u * id.x;
        let sines = sine_cosine(angle);
        values[first] = sines.x;
        values[first + 1u] = sines.y;
        values[first + 2u] = reciprocal(x);
        values[first + 3u] = reciprocal_root(x);
        values[first + 4u] = root(x);
        values[first + 5u] = arc_tangent(flushed(angle), x);
        values[first + 6u] = x * x - angle * angle;
        values[first + 7u] = (x + angle) - x;
    }";

const WORKGROUP: usize = 64;

fn spirv() -> Vec<u32> {
    compile(&[KERNEL, functions::WGSL].concat())
}

/// x from 2^-50 to 2^50 and angles up to pi/2, many of each size.
fn arguments() -> Vec<[f32; 2]> {
    let mut random = fastrand::Rng::with_seed(7);
    let mut all: Vec<[f32; 2]> = (0..100_000)
        .map(|_| {
            let exponent = random.u32(127 - 50..127 + 50);
            let x = f32::from_bits(exponent << 23 | random.u32(..1 << 23));
            let angle = (random.f64() * 2.0 - 1.0) * std::f64::consts::FRAC_PI_2;
            let small = 0.5f64.powi(random.i32(0..20));
            [x, (angle * small) as f32]
        })
        .collect();
    let right = std::f32::consts::FRAC_PI_2;
    all.extend([[1.0, 0.0], [1.0, right], [4.0, -right], [2.0, 1.0]]);
    all
}

fn expected([x, angle]: [f32; 2]) -> [f32; 8] {
    let (sine, cosine) = functions::sine_cosine(angle);
    [
        sine,
        cosine,
        functions::reciprocal(x),
        functions::reciprocal_root(x),
        functions::root(x),
        functions::arc_tangent(functions::flushed(angle), x),
        x * x - angle * angle,
        (x + angle) - x,
    ]
}

fn on_device(application: &Application, spirv: &[u32], arguments: &[[f32; 2]]) -> Vec<[u32; 8]> {
    let input = ApplicationBuffer::of(application, bytemuck::cast_slice(arguments));
    let output = vec![[0u32; 8]; arguments.len()];
    let output = ApplicationBuffer::of(application, bytemuck::cast_slice(&output));
    let workgroups = arguments.len().div_ceil(WORKGROUP) as u32;
    application.run_kernel(spirv, c"main", &[&input, &output], workgroups);
    bytemuck::pod_collect_to_vec(&output.bytes())
}

#[test]
fn functions_have_the_same_bits_in_rust_and_on_every_device() {
    let arguments = arguments();
    let expected: Vec<[u32; 8]> = (arguments.iter())
        .map(|&pair| expected(pair).map(f32::to_bits))
        .collect();
    let plain = spirv();
    let exact = exact(&plain).unwrap();
    let mut without = 0;
    let applications = Application::all();
    for application in &applications {
        let found = on_device(application, &exact, &arguments);
        let differing = found.iter().zip(&expected).filter(|(a, b)| a != b).count();
        assert_eq!(differing, 0);
        let found = on_device(application, &plain, &arguments);
        without += found.iter().zip(&expected).filter(|(a, b)| a != b).count();
    }
    assert!(without > 1000, "without the pass {without} differ");
}

/// The bounds that the documentation of the functions states.
#[test]
fn functions_are_within_their_bounds() {
    let mut worst = [0.0f64; 6];
    for [x, angle] in arguments() {
        let found = expected([x, angle]).map(f64::from);
        let (x, angle) = (f64::from(x), f64::from(angle));
        let angle_or_zero = f64::from(functions::flushed(angle as f32));
        let exact = [
            angle.sin(),
            angle.cos(),
            1.0 / x,
            1.0 / x.sqrt(),
            x.sqrt(),
            angle_or_zero.atan2(x),
        ];
        // Errors are in units in the last place, relative to the value, or absolute.
        let step = |value: f64| {
            let value = value as f32;
            f64::from(f32::from_bits(value.to_bits() + 1)) - f64::from(value)
        };
        let scales = [1.0, 1.0, step(exact[2]), exact[3], step(exact[4]), 1.0];
        for (i, worst) in worst.iter_mut().enumerate() {
            *worst = worst.max(((found[i] - exact[i]) / scales[i]).abs());
        }
    }
    println!("{worst:?}");
    let bounds = [1.2e-7, 1.2e-7, 2.0, 2e-7, 1.0, 2e-7];
    assert!((0..6).all(|i| worst[i] <= bounds[i]), "{worst:?}");
    // Also require that the bounds are not much wider than the errors; such bounds would say little.
    assert!((0..6).all(|i| worst[i] > bounds[i] / 5.0), "{worst:?}");
    assert_eq!(functions::root(0.0).to_bits(), 0);
    assert_eq!(functions::arc_tangent(0.0, 0.0).to_bits(), 0);
}

/// The example makes a shader exact as the library does, and lists what cannot be made exact without writing a file.
#[test]
fn the_example_writes_exact_shaders_alone() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    let run = |words: &[u32]| {
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        std::fs::write(file("shader.spv"), bytes).unwrap();
        let _ = std::fs::remove_file(file("exact.spv"));
        let run = Command::new(program("exact"))
            .args([file("shader.spv"), file("exact.spv")])
            .output()
            .unwrap();
        let written = std::fs::read(file("exact.spv")).ok();
        (
            run.status.success(),
            written,
            String::from_utf8(run.stderr).unwrap(),
        )
    };
    let plain = spirv();
    let (is_done, written, words) = run(&plain);
    assert!(is_done, "{words}");
    assert_eq!(
        bytemuck::pod_collect_to_vec::<u8, u32>(&written.unwrap()),
        exact(&plain).unwrap()
    );
    let inexact = KERNEL
        .replace("= reciprocal(x)", "= 1.0 / x")
        .replace("= root(x)", "= sqrt(x)");
    let (is_done, written, words) = run(&compile(&[&inexact, functions::WGSL].concat()));
    assert!(!is_done && written.is_none());
    assert!(
        words.contains("OpFDiv") && words.contains("Sqrt"),
        "{words}"
    );
}
