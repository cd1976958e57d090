//! The layouts that shaders and Rust share, each field checked against the shader.

use std::mem::offset_of;

use bytemuck::{Pod, Zeroable};

use crate::method::Form;
use crate::numeric::canonical;

/// Constants and layouts read from the shaders at build time.
// The parts of pi are written out where shaders need them.
#[allow(dead_code, clippy::approx_constant)]
pub(crate) mod shader {
    include!(concat!(env!("OUT_DIR"), "/shader_constants.rs"));
}

/// `Segment` of `evaluate_arc.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct ArcSegment {
    pub(crate) middle: [f32; 4],
    pub(crate) tangent: [f32; 4],
}

/// Powers of a segment, with the constant.
pub(crate) const POWERS: usize = 11;

/// `Segment` of `evaluate_polynomial.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct PolynomialSegment {
    pub(crate) coefficients: [[f32; 4]; POWERS],
}

/// `Item` of `kernel.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Item {
    pub(crate) source: u32,
    pub(crate) output: u32,
    pub(crate) count: u32,
    pub(crate) first: i32,
    pub(crate) scale: f32,
    pub(crate) offset: f32,
}

/// `Single` of `kernel_singles.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Single {
    pub(crate) source: u32,
    pub(crate) parameter: f32,
}

/// `Launch` of `launch.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Launch {
    pub(crate) first_item: u32,
    pub(crate) item_count: u32,
    pub(crate) stride: u32,
    pub(crate) detail: u32,
    pub(crate) first_output: u32,
}

/// `Pass` of `pass.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Pass {
    pub(crate) count: u32,
    pub(crate) detail: u32,
}

/// `Sample` of `sampled_arcs.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Sample {
    pub(crate) key: u32,
    pub(crate) parameter: f32,
}

/// `Joint` of `gentle.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Joint {
    pub(crate) before: f32,
    pub(crate) after: f32,
    pub(crate) outgoing: f32,
    pub(crate) kind: f32,
}

/// `Rows` of `sampled_arcs.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Rows {
    pub(crate) samples: u32,
    pub(crate) keys: u32,
    pub(crate) count: u32,
}

/// `Link` of `pose_world.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Link {
    pub(crate) offset: [f32; 3],
    pub(crate) track: u32,
    pub(crate) parent: u32,
    pub(crate) padding: [u32; 3],
}

/// `Probe` of `canary.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Probe {
    pub(crate) a: f32,
    pub(crate) b: f32,
    pub(crate) c: f32,
    pub(crate) n: i32,
}

/// `Reply` of `canary.wgsl`.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Reply {
    pub(crate) contraction: f32,
    pub(crate) reassociation: f32,
    pub(crate) rounding: f32,
    pub(crate) association: f32,
    pub(crate) conversion: f32,
    pub(crate) cancellation: f32,
    pub(crate) sine: f32,
    pub(crate) cosine: f32,
    pub(crate) root: f32,
    pub(crate) arc_tangent: f32,
}

macro_rules! assert_layout {
    ($type:ty, $size:ident, $($field:ident = $offset:ident),+) => {
        const _: () = {
            assert!(size_of::<$type>() == shader::$size);
            $(assert!(offset_of!($type, $field) == shader::$offset);)+
        };
    };
}

assert_layout!(
    ArcSegment,
    ARC_SEGMENT_SIZE,
    middle = ARC_SEGMENT_MIDDLE,
    tangent = ARC_SEGMENT_TANGENT
);
assert_layout!(
    PolynomialSegment,
    POLYNOMIAL_SEGMENT_SIZE,
    coefficients = POLYNOMIAL_SEGMENT_COEFFICIENTS
);
assert_layout!(
    Item,
    ITEM_SIZE,
    source = ITEM_SOURCE,
    output = ITEM_OUTPUT,
    count = ITEM_COUNT,
    first = ITEM_FIRST,
    scale = ITEM_SCALE,
    offset = ITEM_OFFSET
);
assert_layout!(
    Launch,
    LAUNCH_SIZE,
    first_item = LAUNCH_FIRST_ITEM,
    item_count = LAUNCH_ITEM_COUNT,
    stride = LAUNCH_STRIDE,
    detail = LAUNCH_DETAIL,
    first_output = LAUNCH_FIRST_OUTPUT
);
assert_layout!(
    Single,
    SINGLE_SIZE,
    source = SINGLE_SOURCE,
    parameter = SINGLE_PARAMETER
);
assert_layout!(Pass, PASS_SIZE, count = PASS_COUNT, detail = PASS_DETAIL);
assert_layout!(
    Sample,
    SAMPLE_SIZE,
    key = SAMPLE_KEY,
    parameter = SAMPLE_PARAMETER
);
assert_layout!(
    Joint,
    JOINT_SIZE,
    before = JOINT_BEFORE,
    after = JOINT_AFTER,
    outgoing = JOINT_OUTGOING,
    kind = JOINT_KIND
);
assert_layout!(
    Rows,
    ROWS_SIZE,
    samples = ROWS_SAMPLES,
    keys = ROWS_KEYS,
    count = ROWS_COUNT
);
assert_layout!(
    Link,
    LINK_SIZE,
    offset = LINK_OFFSET,
    track = LINK_TRACK,
    parent = LINK_PARENT
);
assert_layout!(
    Probe,
    PROBE_SIZE,
    a = PROBE_A,
    b = PROBE_B,
    c = PROBE_C,
    n = PROBE_N
);
assert_layout!(
    Reply,
    REPLY_SIZE,
    contraction = REPLY_CONTRACTION,
    reassociation = REPLY_REASSOCIATION,
    rounding = REPLY_ROUNDING,
    association = REPLY_ASSOCIATION,
    conversion = REPLY_CONVERSION,
    cancellation = REPLY_CANCELLATION,
    sine = REPLY_SINE,
    cosine = REPLY_COSINE,
    root = REPLY_ROOT,
    arc_tangent = REPLY_ARC_TANGENT
);

/// The segments of one clip, all of one form.
#[derive(Debug, Clone)]
pub(crate) enum Segments {
    Arc(Vec<ArcSegment>),
    Polynomial(Vec<PolynomialSegment>),
}

impl Segments {
    pub(crate) fn new(form: Form) -> Self {
        match form {
            Form::Arc => Self::Arc(Vec::new()),
            Form::Polynomial => Self::Polynomial(Vec::new()),
        }
    }

    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Arc(segments) => segments.len(),
            Self::Polynomial(segments) => segments.len(),
        }
    }

    pub(crate) fn reserve(&mut self, count: usize) {
        match self {
            Self::Arc(segments) => segments.reserve(count),
            Self::Polynomial(segments) => segments.reserve(count),
        }
    }

    pub(crate) fn clear(&mut self) {
        match self {
            Self::Arc(segments) => segments.clear(),
            Self::Polynomial(segments) => segments.clear(),
        }
    }

    pub(crate) fn as_bytes(&self) -> &[u8] {
        match self {
            Self::Arc(segments) => bytemuck::cast_slice(segments),
            Self::Polynomial(segments) => bytemuck::cast_slice(segments),
        }
    }

    /// The same rotations with the other sign.
    pub(crate) fn negate(&mut self) {
        let components: &mut [f32] = match self {
            Self::Arc(segments) => bytemuck::cast_slice_mut(segments),
            Self::Polynomial(segments) => bytemuck::cast_slice_mut(segments),
        };
        for component in components {
            *component = canonical(-*component);
        }
    }

    /// Moves all of `other` behind its own.
    pub(crate) fn append(&mut self, other: Self) {
        match (self, other) {
            (Self::Arc(own), Self::Arc(other)) => own.extend(other),
            (Self::Polynomial(own), Self::Polynomial(other)) => own.extend(other),
            _ => unreachable!("segments of one clip have one form"),
        }
    }
}

/// Bytes of one segment of a form.
pub(crate) fn segment_size(form: Form) -> usize {
    match form {
        Form::Arc => size_of::<ArcSegment>(),
        Form::Polynomial => size_of::<PolynomialSegment>(),
    }
}
