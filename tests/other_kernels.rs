//! Kernels that somebody wrote plainly in WGSL, with the device's own sine, judged by the oracle: rotations with a bound
//! of the caller's choice, and matrices and half floats word by word. docs/your-tests.md shows it.

use naga::back::spv;
use naga::valid::{Capabilities, ValidationFlags, Validator};
use tumble::glam::Quat;
use tumble::verify::{
    Agreement, BufferComparison, DifferenceKind, UNWRITTEN, WordBound, WordType, compare,
    compare_buffers,
};
use tumble::{Clip, Device, Encoding, Engine, Layout, SampleTimes, TrackSet, method};

use crate::application::{Application, ApplicationBuffer};

const KERNELS: &str = include_str!("support/other_kernels.wgsl");

/// The rotations of an invocation.
const WORKGROUP: usize = 64;

fn spirv() -> Vec<u32> {
    let module = naga::front::wgsl::parse_str(KERNELS).unwrap();
    let mut validator = Validator::new(
        ValidationFlags::all(),
        Capabilities::SHADER_FLOAT16_IN_FLOAT32,
    );
    let info = validator.validate(&module).unwrap();
    spv::write_vec(&module, &info, &spv::Options::default(), None).unwrap()
}

fn set() -> TrackSet {
    let mut set = TrackSet::new();
    let axis = |x, y, z| Quat::from_xyzw(x, y, z, 0.0).normalize();
    for (name, end) in [
        ("door", Quat::from_rotation_x(1.0)),
        ("wheel", Quat::from_rotation_z(-3.0)),
        ("still", Quat::IDENTITY),
        ("half", axis(0.3, -0.5, 0.8)),
    ] {
        set.push(name, &[0.0, 1.0], &[Quat::IDENTITY, end]).unwrap();
    }
    set
}

/// The content that a kernel leaves in a buffer of `words` words that was filled with [`UNWRITTEN`].
fn left_by<T: bytemuck::Pod>(
    application: &Application,
    entry: &std::ffi::CStr,
    input: &[T],
    words: usize,
    workgroups: usize,
) -> Vec<u8> {
    let input = ApplicationBuffer::of(application, bytemuck::cast_slice(input));
    let output = vec![UNWRITTEN; words];
    let output = ApplicationBuffer::of(application, bytemuck::cast_slice(&output));
    application.run_kernel(&spirv(), entry, &[&input, &output], workgroups as u32);
    output.bytes()
}

/// The engine's own result, frame by frame.
fn expected(clip: &Clip, frames: &SampleTimes, encoding: &str) -> Vec<u8> {
    let encoding: Encoding = encoding.parse().unwrap();
    let request = clip.request(frames).encoding(encoding);
    request.layout(Layout::FrameMajor).evaluate_bytes().unwrap()
}

#[test]
fn a_plain_slerp_is_within_a_bound_of_the_caller_s_choice_and_not_within_the_engine_s() {
    let (set, frames) = (set(), SampleTimes::fps(200));
    let samples = 201;
    let ends: Vec<[f32; 4]> = set.tracks().map(|track| track.keys[1].to_array()).collect();
    for application in Application::all() {
        let words = 4 * ends.len() * samples;
        let rotations = left_by(
            &application,
            c"slerp",
            &ends,
            words,
            words.div_ceil(4 * WORKGROUP),
        );
        let rotations: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&rotations);
        let found = compare(&set, method::SLERP.into(), &frames, &rotations).unwrap();
        println!("{found}");
        assert_eq!(
            found.agreement_within(1e-3),
            Agreement::WithinBounds,
            "{found}"
        );
        assert_eq!(
            found.agreement_within(1e-9),
            Agreement::OutsideBounds,
            "{found}"
        );
        assert_eq!(
            found.agreement_within(f64::NAN),
            Agreement::OutsideBounds,
            "{found}"
        );
        assert!(found.engine_error < 6e-7 && found.differing > 0, "{found}");
    }
}

#[test]
fn matrices_and_halves_of_a_plain_kernel_are_compared_word_by_word() {
    let (set, frames) = (set(), SampleTimes::fps(200));
    let engine = Engine::new(Device::Cpu).unwrap();
    let clip = engine.upload(&set, method::SLERP).unwrap();
    let rotations: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&expected(&clip, &frames, "f32"));
    let workgroups = rotations.len().div_ceil(WORKGROUP);
    let matrices = expected(&clip, &frames, "matrix-3x4");
    let halves = expected(&clip, &frames, "f16");
    for application in Application::all() {
        let judged = |workgroups: usize| -> BufferComparison {
            let words = matrices.len() / 4;
            let theirs = left_by(&application, c"matrices", &rotations, words, workgroups);
            compare_buffers(WordType::F32, &theirs, &matrices).unwrap()
        };
        let found = judged(workgroups);
        println!("{found}");
        let within = found.agreement_within(WordBound::Distance(1e-6));
        assert!(within <= Agreement::WithinBounds, "{found}");
        assert!(
            !found.census.contains_key(&DifferenceKind::Unwritten),
            "{found}"
        );

        // A kernel that did not run does not pass. One with too few workgroups leaves words unwritten.
        let nowhere = judged(0);
        assert_eq!(nowhere.agreement(), Agreement::Nothing, "{nowhere}");
        assert!(nowhere.to_string().contains("did not run"), "{nowhere}");
        let short = judged(workgroups - 1);
        let left_out = 12 * (rotations.len() - WORKGROUP * (workgroups - 1));
        assert_eq!(
            short.census[&DifferenceKind::Unwritten],
            left_out as u64,
            "{short}"
        );
        let within = short.agreement_within(WordBound::Distance(1e-6));
        assert_eq!(within, Agreement::OutsideBounds, "{short}");

        let words = halves.len() / 4;
        let theirs = left_by(&application, c"halves", &rotations, words, workgroups);
        let found = compare_buffers(WordType::F16, &theirs, &halves).unwrap();
        println!("{found}");
        let within = found.agreement_within(WordBound::Steps(1));
        assert!(within <= Agreement::WithinBounds, "{found}");
    }
}
