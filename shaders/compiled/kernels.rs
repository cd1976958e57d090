// Written by `cargo run -p tumble-shaders` from the shaders: change those.

pub(crate) const ANGULAR_VELOCITY: u32 = 4;
pub(crate) const ARC_0: f32 = -0.3333333;
pub(crate) const ARC_1: f32 = 0.1999974;
pub(crate) const ARC_2: f32 = -0.14278568;
pub(crate) const ARC_3: f32 = 0.110337645;
pub(crate) const ARC_4: f32 = -0.0865688;
pub(crate) const ARC_5: f32 = 0.06250169;
pub(crate) const ARC_6: f32 = -0.03587154;
pub(crate) const ARC_7: f32 = 0.013507771;
pub(crate) const ARC_8: f32 = -0.0023869972;
pub(crate) const ARC_SINE_1: f32 = 0.16666622;
pub(crate) const ARC_SINE_2: f32 = 0.075026825;
pub(crate) const ARC_SINE_3: f32 = 0.04408178;
pub(crate) const ARC_SINE_4: f32 = 0.035991196;
pub(crate) const ARC_SINE_5: f32 = -0.008057682;
pub(crate) const ARC_SINE_6: f32 = 0.11032987;
pub(crate) const ARC_SINE_7: f32 = -0.13996805;
pub(crate) const ARC_SINE_8: f32 = 0.12611471;
pub(crate) const BLOCK_SAMPLES: u32 = 32;
pub(crate) const B_111_1: f32 = -0.00268809;
pub(crate) const B_111_2: f32 = 0.0012817383;
pub(crate) const B_111_3: f32 = 0.01542155;
pub(crate) const B_111_4: f32 = 0.38085938;
pub(crate) const B_111_5: f32 = -1.8040365;
pub(crate) const B_111_6: f32 = 2.015625;
pub(crate) const B_122_1: f32 = 0.0010681152;
pub(crate) const B_122_2: f32 = 0.005126953;
pub(crate) const B_122_3: f32 = -0.88134766;
pub(crate) const B_122_4: f32 = 1.5234375;
pub(crate) const B_122_5: f32 = 1.5078125;
pub(crate) const B_122_6: f32 = -3.1875;
pub(crate) const B_123_1: f32 = 0.0036315918;
pub(crate) const B_123_3: f32 = 0.7241211;
pub(crate) const B_123_5: f32 = -1.2109375;
pub(crate) const B_133_1: f32 = -0.00037384033;
pub(crate) const B_133_2: f32 = -0.0012817383;
pub(crate) const B_133_3: f32 = -0.1998291;
pub(crate) const B_133_4: f32 = -0.38085938;
pub(crate) const B_133_5: f32 = -0.068359375;
pub(crate) const B_133_6: f32 = 0.234375;
pub(crate) const B_211_1: f32 = 0.005874634;
pub(crate) const B_211_2: f32 = -0.005126953;
pub(crate) const B_211_3: f32 = -0.6081543;
pub(crate) const B_211_4: f32 = 1.8515625;
pub(crate) const B_211_5: f32 = -0.80078125;
pub(crate) const B_211_6: f32 = -1.3125;
pub(crate) const B_222_1: f32 = -0.0041300454;
pub(crate) const B_222_3: f32 = -0.4280599;
pub(crate) const B_222_5: f32 = 1.1197916;
pub(crate) const CHANNELS: u32 = 3;
pub(crate) const COSINE_10: f32 = -2.620902e-7;
pub(crate) const COSINE_2: f32 = -0.5;
pub(crate) const COSINE_4: f32 = 0.041666657;
pub(crate) const COSINE_6: f32 = -0.0013888585;
pub(crate) const COSINE_8: f32 = 2.477018e-5;
pub(crate) const COSM1_1: f32 = -0.5;
pub(crate) const COSM1_2: f32 = 0.041666668;
pub(crate) const CROWD_WORKGROUP: u32 = 64;
pub(crate) const DEGREES: f32 = 57.29578;
pub(crate) const END_NEGATED: u32 = 2147483648;
pub(crate) const FLUSHED_BITS: u32 = 645922816;
pub(crate) const FORM_ARC: u32 = 1;
pub(crate) const FORM_ARC_KEYS: u32 = 19;
pub(crate) const FORM_CONSTANT: u32 = 0;
pub(crate) const FORM_CUBIC: u32 = 2;
pub(crate) const FORM_CUBIC_KEYS: u32 = 20;
pub(crate) const FORM_KEYS: u32 = 16;
pub(crate) const FORM_LINE: u32 = 18;
pub(crate) const FORM_PACKED: u32 = 17;
pub(crate) const FORM_POLYNOMIAL: u32 = 3;
pub(crate) const FRAME_BALL: u32 = 3;
pub(crate) const FRAME_FIXED: u32 = 0;
pub(crate) const FRAME_FREE: u32 = 4;
pub(crate) const FRAME_HINGE: u32 = 1;
pub(crate) const FRAME_ROOT: u32 = 5;
pub(crate) const FRAME_SLIDE: u32 = 2;
pub(crate) const FROM_KEYS_WORKGROUP: u32 = 64;
pub(crate) const FROM_ROOT: u32 = 0;
pub(crate) const GIMBAL: f32 = 2.5e-7;
pub(crate) const HALF_INFINITE: u32 = 31744;
pub(crate) const HALF_OVERFLOW: u32 = 1199566848;
pub(crate) const HALF_PI: f32 = 1.5707964;
pub(crate) const HALF_PI_LOW: f32 = -4.371139e-8;
pub(crate) const INTRINSIC: u32 = 256;
pub(crate) const IS_CONSTANT: u32 = 2147483648;
pub(crate) const IS_KEY: u32 = 2147483648;
pub(crate) const ITEM_SAMPLES: u32 = 16;
pub(crate) const KEY_AT_END: f32 = 1.0;
pub(crate) const KEY_INNER: f32 = 0.0;
pub(crate) const KEY_OF_INTERVAL: u32 = 1073741823;
pub(crate) const KEY_UNKNOWN: f32 = 2.0;
pub(crate) const LEAST_NORMAL: u32 = 947912704;
pub(crate) const LEAST_SQUARED_SUM: f32 = 9.094947e-13;
pub(crate) const LINE: u32 = 8;
pub(crate) const LINE_VECTORS: u32 = 8;
pub(crate) const LOCAL_ROTATION: u32 = 0;
pub(crate) const LOG_1: f32 = 0.16666667;
pub(crate) const LOG_2: f32 = 0.075;
pub(crate) const LOG_3: f32 = 0.04464286;
pub(crate) const LOG_4: f32 = 0.030381944;
pub(crate) const LONGEST_ANGLE_SQUARE: f32 = 2.4674;
pub(crate) const LONGEST_KEY: f32 = 4.0;
pub(crate) const LONGEST_STEP: f32 = 0.0034;
pub(crate) const LONGEST_TANGENT_PART: f32 = 0.01;
pub(crate) const MAX_SUBGROUP_JOINTS: u32 = 1024;
pub(crate) const MAX_SUBGROUP_POSITIONS: u32 = 4;
pub(crate) const MAX_WALKED: u32 = 128;
pub(crate) const MAX_WHOLE_JOINTS: u32 = 256;
pub(crate) const MAX_WHOLE_POSITIONS: u32 = 128;
pub(crate) const MAY_BE_TINY: u32 = 1073741824;
pub(crate) const MOTION_WORKGROUP: u32 = 64;
pub(crate) const NEEDS_CARE: u32 = 1073741824;
pub(crate) const NEGATIVE: u32 = 128;
pub(crate) const NO_FRAME: u32 = 4294967295;
pub(crate) const NO_KEY: u32 = 4294967295;
pub(crate) const ON_KEY: u32 = 2147483648;
pub(crate) const PACKED_STEP: f32 = 1.3487017e-6;
pub(crate) const PI: f32 = 3.1415927;
pub(crate) const PI_LOW: f32 = -8.742278e-8;
pub(crate) const POSE_WORKGROUP: u32 = 64;
pub(crate) const POSITION: u32 = 2;
pub(crate) const PREPARE_WORKGROUP: u32 = 64;
pub(crate) const QUARTERS_PER_RADIAN: f32 = 0.63661975;
pub(crate) const QUARTER_1: f32 = 1.5703125;
pub(crate) const QUARTER_2: f32 = 0.0004837513;
pub(crate) const QUARTER_3: f32 = 7.54979e-8;
pub(crate) const QUARTER_COSINE_2: f32 = -0.5;
pub(crate) const QUARTER_COSINE_4: f32 = 0.041666646;
pub(crate) const QUARTER_COSINE_6: f32 = -0.0013887301;
pub(crate) const QUARTER_COSINE_8: f32 = 2.4430661e-5;
pub(crate) const QUARTER_SINE_3: f32 = -0.16666651;
pub(crate) const QUARTER_SINE_5: f32 = 0.008331983;
pub(crate) const QUARTER_SINE_7: f32 = -0.00019496137;
pub(crate) const RECIPROCAL_SEED: u32 = 2129859015;
pub(crate) const ROOT: u32 = 4294967295;
pub(crate) const ROOT_SEED: u32 = 1597463007;
pub(crate) const ROTATION: u32 = 0;
pub(crate) const ROWS_PER_INVOCATION: u32 = 4;
pub(crate) const RUNS_BACKWARDS: u32 = 8388608;
pub(crate) const SAMPLES_EACH: u32 = 8;
pub(crate) const SCALE: u32 = 2;
pub(crate) const SECANT_1: f32 = 0.500002;
pub(crate) const SECANT_2: f32 = 0.37484172;
pub(crate) const SECANT_3: f32 = 0.316693;
pub(crate) const SECANT_4: f32 = 0.21955732;
pub(crate) const SECANT_5: f32 = 0.63175416;
pub(crate) const SECANT_6: f32 = -1.4024843;
pub(crate) const SECANT_7: f32 = 4.2773666;
pub(crate) const SECANT_8: f32 = -5.4673123;
pub(crate) const SECANT_9: f32 = 3.7398531;
pub(crate) const SERIES_10: f32 = -2.755732e-7;
pub(crate) const SERIES_2: f32 = -0.5;
pub(crate) const SERIES_3: f32 = -0.16666667;
pub(crate) const SERIES_4: f32 = 0.041666668;
pub(crate) const SERIES_5: f32 = 0.008333334;
pub(crate) const SERIES_6: f32 = -0.0013888889;
pub(crate) const SERIES_7: f32 = -0.0001984127;
pub(crate) const SERIES_8: f32 = 2.4801588e-5;
pub(crate) const SERIES_9: f32 = 2.7557319e-6;
pub(crate) const SIGN_NEGATED: u32 = 1073741824;
pub(crate) const SINC_1: f32 = -0.16666667;
pub(crate) const SINC_2: f32 = 0.008333334;
pub(crate) const SINE_3: f32 = -0.16666657;
pub(crate) const SINE_5: f32 = 0.008333009;
pub(crate) const SINE_7: f32 = -0.00019806049;
pub(crate) const SINE_9: f32 = 2.5989254e-6;
pub(crate) const SMALL_SQUARED_EXTENT: f32 = 0.001;
pub(crate) const SNORM_SHIFT: f32 = 12582912.0;
pub(crate) const SOURCE_BITS: u32 = 8388607;
pub(crate) const SPEED_MAGNITUDE: u32 = 8388607;
pub(crate) const SPREAD_WORKGROUP: u32 = 128;
pub(crate) const START_BIAS: u32 = 131072;
pub(crate) const START_NEGATED: u32 = 1073741824;
pub(crate) const STATE_VECTORS: u32 = 5;
pub(crate) const SYMMETRIC: u32 = 64;
pub(crate) const THIRD: f32 = 0.33333334;
pub(crate) const TICKS: u32 = 2147483647;
pub(crate) const TINY_BITS: u32 = 528482304;
pub(crate) const TRANSLATION: u32 = 1;
pub(crate) const TWO_THIRDS: f32 = 0.6666667;
pub(crate) const VECTOR_WORDS: u32 = 4;
pub(crate) const VELOCITY: u32 = 3;
pub(crate) const WEIGHT_UNIT: f32 = 3.0517578e-5;
pub(crate) const WHOLE_SHIFT: f32 = 12582912.0;
pub(crate) const WORKGROUP: u32 = 64;
pub(crate) const WORLD_ROTATION: u32 = 1;
pub(crate) const WRAP_HOLD: u32 = 0;
pub(crate) const WRAP_LOOP: u32 = 1;
pub(crate) const WRAP_MIRROR: u32 = 2;
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct ArcSegment {
/// The rotation half way along the arc.
    pub(crate) middle: [f32; 4],
/// Its derivative there: orthogonal to it in the plane of the arc, and as long as the arc's
/// angle in R⁴.
    pub(crate) tangent: [f32; 4],
}
const _: () = {
    assert!(size_of::<ArcSegment>() == 32);
    assert!(std::mem::offset_of!(ArcSegment, middle) == 0);
    assert!(std::mem::offset_of!(ArcSegment, tangent) == 16);
};
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct ArcsDispatch {
/// How many there are.
    pub(crate) count: u32,
}
const _: () = {
    assert!(size_of::<ArcsDispatch>() == 4);
    assert!(std::mem::offset_of!(ArcsDispatch, count) == 0);
};
/// Which items the samples of 32 neighbouring positions belong to.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Block {
/// The item of the first position.
    pub(crate) first: u32,
/// A bit for each position at which the next item begins, the lowest for the first.
    pub(crate) starts: u32,
}
const _: () = {
    assert!(size_of::<Block>() == 8);
    assert!(std::mem::offset_of!(Block, first) == 0);
    assert!(std::mem::offset_of!(Block, starts) == 4);
};
/// A time base: spans of time that some of a clip's channels share.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct CrowdBase {
/// The first span, and how many there are.
    pub(crate) first: u32,
/// The largest power of 2 below `count`, where the search starts; 0 for one span.
    pub(crate) count: u32,
    pub(crate) step: u32,
}
const _: () = {
    assert!(size_of::<CrowdBase>() == 12);
    assert!(std::mem::offset_of!(CrowdBase, first) == 0);
    assert!(std::mem::offset_of!(CrowdBase, count) == 4);
    assert!(std::mem::offset_of!(CrowdBase, step) == 8);
};
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct CrowdChange {
/// Its index among all, `[instance][layer]`.
    pub(crate) index: u32,
/// The words of the entry.
    pub(crate) clip_and_weight: u32,
    pub(crate) speed_and_modes: u32,
    pub(crate) start: u32,
    pub(crate) anchor: u32,
}
const _: () = {
    assert!(size_of::<CrowdChange>() == 20);
    assert!(std::mem::offset_of!(CrowdChange, index) == 0);
    assert!(std::mem::offset_of!(CrowdChange, clip_and_weight) == 4);
    assert!(std::mem::offset_of!(CrowdChange, speed_and_modes) == 8);
    assert!(std::mem::offset_of!(CrowdChange, start) == 12);
    assert!(std::mem::offset_of!(CrowdChange, anchor) == 16);
};
/// Where one channel (the rotation, the translation or the scale) of a joint lies in a clip.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct CrowdChannel {
/// The cell of its first constant in the first span.
    pub(crate) first: u32,
/// How many channels lie beside each other: the next constant is `count` cells on. 0 for a channel
/// that is constant.
    pub(crate) count: u32,
/// The form, 8 bits, above the index of its time base in the clip, 24 bits.
    pub(crate) form_and_base: u32,
/// The cell of its first key.
    pub(crate) keys: u32,
}
const _: () = {
    assert!(size_of::<CrowdChannel>() == 16);
    assert!(std::mem::offset_of!(CrowdChannel, first) == 0);
    assert!(std::mem::offset_of!(CrowdChannel, count) == 4);
    assert!(std::mem::offset_of!(CrowdChannel, form_and_base) == 8);
    assert!(std::mem::offset_of!(CrowdChannel, keys) == 12);
};
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct CrowdClip {
/// Its length in ticks, at least 1.
    pub(crate) period: u32,
/// Its first time base, and how many it has.
    pub(crate) first_base: u32,
    pub(crate) bases: u32,
}
const _: () = {
    assert!(size_of::<CrowdClip>() == 12);
    assert!(std::mem::offset_of!(CrowdClip, period) == 0);
    assert!(std::mem::offset_of!(CrowdClip, first_base) == 4);
    assert!(std::mem::offset_of!(CrowdClip, bases) == 8);
};
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct CrowdDispatch {
/// The number of invocations with work; of instances, where a workgroup takes one.
    pub(crate) count: u32,
/// The first instance of the window that is evaluated.
    pub(crate) first_instance: u32,
/// Joints of the skeleton; when a level is walked, joints of the level.
    pub(crate) joints: u32,
/// Layers of an instance; when all levels are walked, how many there are.
    pub(crate) layers: u32,
/// The most time bases of a clip.
    pub(crate) bases: u32,
/// The first link of the level; when all levels are walked, the first of the links that say where each
/// begins and ends.
    pub(crate) first_link: u32,
/// The clock, ticks: the lower 32 bits.
    pub(crate) clock_low: u32,
/// The clock's upper bits.
    pub(crate) clock_high: u32,
/// The cell of the first mask.
    pub(crate) masks: u32,
/// The cell of the first reference pose.
    pub(crate) references: u32,
}
const _: () = {
    assert!(size_of::<CrowdDispatch>() == 40);
    assert!(std::mem::offset_of!(CrowdDispatch, count) == 0);
    assert!(std::mem::offset_of!(CrowdDispatch, first_instance) == 4);
    assert!(std::mem::offset_of!(CrowdDispatch, joints) == 8);
    assert!(std::mem::offset_of!(CrowdDispatch, layers) == 12);
    assert!(std::mem::offset_of!(CrowdDispatch, bases) == 16);
    assert!(std::mem::offset_of!(CrowdDispatch, first_link) == 20);
    assert!(std::mem::offset_of!(CrowdDispatch, clock_low) == 24);
    assert!(std::mem::offset_of!(CrowdDispatch, clock_high) == 28);
    assert!(std::mem::offset_of!(CrowdDispatch, masks) == 32);
    assert!(std::mem::offset_of!(CrowdDispatch, references) == 36);
};
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct CrowdEntry {
/// The clip, 16 bits, and above it the weight in units of 2^-15; 0 leaves the layer out.
    pub(crate) clip_and_weight: u32,
/// The speed in units of 2^-16: its magnitude, 23 bits, and whether it runs backwards, 1 bit.
/// Above them the mask, 5 bits, the wrap mode, 2 bits, and whether the layer is additive, 1 bit.
    pub(crate) speed_and_modes: u32,
/// The clip's own time in ticks, plus `START_BIAS`, when the clock stood at the anchor.
    pub(crate) start: u32,
/// The anchor: ticks of the clock without the lowest 8 bits.
    pub(crate) anchor: u32,
}
const _: () = {
    assert!(size_of::<CrowdEntry>() == 16);
    assert!(std::mem::offset_of!(CrowdEntry, clip_and_weight) == 0);
    assert!(std::mem::offset_of!(CrowdEntry, speed_and_modes) == 4);
    assert!(std::mem::offset_of!(CrowdEntry, start) == 8);
    assert!(std::mem::offset_of!(CrowdEntry, anchor) == 12);
};
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct CrowdLink {
    pub(crate) joint: u32,
    pub(crate) parent: u32,
}
const _: () = {
    assert!(size_of::<CrowdLink>() == 8);
    assert!(std::mem::offset_of!(CrowdLink, joint) == 0);
    assert!(std::mem::offset_of!(CrowdLink, parent) == 4);
};
/// Where a layer stands in one time base of its clip.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct CrowdPosition {
/// The span; with the bit `ON_KEY` exactly at its first key.
    pub(crate) span: u32,
/// The parameter in the span, about -1/2 to 1/2.
    pub(crate) parameter: f32,
}
const _: () = {
    assert!(size_of::<CrowdPosition>() == 8);
    assert!(std::mem::offset_of!(CrowdPosition, span) == 0);
    assert!(std::mem::offset_of!(CrowdPosition, parameter) == 4);
};
/// A span of time.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct CrowdSpan {
/// The first tick in it, with `ON_KEY` where a key lies at exactly that tick.
    pub(crate) start: u32,
/// parameter = (tick - whole) × scale + offset
    pub(crate) whole: i32,
    pub(crate) scale: f32,
    pub(crate) offset: f32,
}
const _: () = {
    assert!(size_of::<CrowdSpan>() == 16);
    assert!(std::mem::offset_of!(CrowdSpan, start) == 0);
    assert!(std::mem::offset_of!(CrowdSpan, whole) == 4);
    assert!(std::mem::offset_of!(CrowdSpan, scale) == 8);
    assert!(std::mem::offset_of!(CrowdSpan, offset) == 12);
};
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct CrowdSubgroupDispatch {
/// How many instances are evaluated.
    pub(crate) count: u32,
/// The first one.
    pub(crate) first_instance: u32,
/// Joints of the skeleton.
    pub(crate) joints: u32,
/// The clock, ticks: the lower 32 bits.
    pub(crate) clock_low: u32,
/// The clock's upper bits.
    pub(crate) clock_high: u32,
/// Instances of a subgroup, as a power of two: they have `MAX_SUBGROUP_JOINTS` joints at most.
    pub(crate) instances_log2: u32,
/// Positions of its instances, `[time base][instance]`, as a power of two up to `MAX_SUBGROUP_POSITIONS`.
    pub(crate) positions_log2: u32,
/// A bit for each lane of the first position, of 32.
    pub(crate) position_lanes: u32,
/// 2^20 divided by the number of joints, rounded up: by it joints of a subgroup are divided among its instances.
    pub(crate) joint_share: u32,
/// 0: the store has no options.
    pub(crate) detail: u32,
}
const _: () = {
    assert!(size_of::<CrowdSubgroupDispatch>() == 40);
    assert!(std::mem::offset_of!(CrowdSubgroupDispatch, count) == 0);
    assert!(std::mem::offset_of!(CrowdSubgroupDispatch, first_instance) == 4);
    assert!(std::mem::offset_of!(CrowdSubgroupDispatch, joints) == 8);
    assert!(std::mem::offset_of!(CrowdSubgroupDispatch, clock_low) == 12);
    assert!(std::mem::offset_of!(CrowdSubgroupDispatch, clock_high) == 16);
    assert!(std::mem::offset_of!(CrowdSubgroupDispatch, instances_log2) == 20);
    assert!(std::mem::offset_of!(CrowdSubgroupDispatch, positions_log2) == 24);
    assert!(std::mem::offset_of!(CrowdSubgroupDispatch, position_lanes) == 28);
    assert!(std::mem::offset_of!(CrowdSubgroupDispatch, joint_share) == 32);
    assert!(std::mem::offset_of!(CrowdSubgroupDispatch, detail) == 36);
};
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct CrowdWholeDispatch {
/// How many instances are evaluated.
    pub(crate) count: u32,
/// The first one.
    pub(crate) first_instance: u32,
/// Joints of the skeleton.
    pub(crate) joints: u32,
/// Layers of an instance.
    pub(crate) layers: u32,
/// The most time bases of a clip.
    pub(crate) bases: u32,
/// The first of the links that say where each level begins and ends.
    pub(crate) first_link: u32,
/// The clock, ticks: the lower 32 bits.
    pub(crate) clock_low: u32,
/// The clock's upper bits.
    pub(crate) clock_high: u32,
/// The cell of the first mask.
    pub(crate) masks: u32,
/// The cell of the first reference pose.
    pub(crate) references: u32,
/// Instances of a workgroup. They have `MAX_WHOLE_POSITIONS` time bases and `MAX_WHOLE_JOINTS` joints at most.
    pub(crate) instances: u32,
/// 2^20 divided by the number of joints, rounded up: by it joints of a workgroup are divided among its instances.
    pub(crate) joint_share: u32,
/// How many levels are walked; 0 where matrices stay in their parents' frames.
    pub(crate) levels: u32,
/// 1 where matrices are multiplied by the inverse bind matrices, else 0.
    pub(crate) is_skinning: u32,
/// 1 where values are stored in half precision, else 0.
    pub(crate) is_half: u32,
}
const _: () = {
    assert!(size_of::<CrowdWholeDispatch>() == 60);
    assert!(std::mem::offset_of!(CrowdWholeDispatch, count) == 0);
    assert!(std::mem::offset_of!(CrowdWholeDispatch, first_instance) == 4);
    assert!(std::mem::offset_of!(CrowdWholeDispatch, joints) == 8);
    assert!(std::mem::offset_of!(CrowdWholeDispatch, layers) == 12);
    assert!(std::mem::offset_of!(CrowdWholeDispatch, bases) == 16);
    assert!(std::mem::offset_of!(CrowdWholeDispatch, first_link) == 20);
    assert!(std::mem::offset_of!(CrowdWholeDispatch, clock_low) == 24);
    assert!(std::mem::offset_of!(CrowdWholeDispatch, clock_high) == 28);
    assert!(std::mem::offset_of!(CrowdWholeDispatch, masks) == 32);
    assert!(std::mem::offset_of!(CrowdWholeDispatch, references) == 36);
    assert!(std::mem::offset_of!(CrowdWholeDispatch, instances) == 40);
    assert!(std::mem::offset_of!(CrowdWholeDispatch, joint_share) == 44);
    assert!(std::mem::offset_of!(CrowdWholeDispatch, levels) == 48);
    assert!(std::mem::offset_of!(CrowdWholeDispatch, is_skinning) == 52);
    assert!(std::mem::offset_of!(CrowdWholeDispatch, is_half) == 56);
};
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Dispatch {
/// The first work item, or listed sample, of this dispatch.
    pub(crate) first_item: u32,
/// How many of them it evaluates.
    pub(crate) item_count: u32,
/// Distance in the result between neighbouring samples of a track, in rotations.
    pub(crate) stride: u32,
/// The option of the store: the order of a matrix, the axes of angles.
    pub(crate) detail: u32,
/// Where the first listed sample is stored; the others follow. For items, what is added to their
/// `output`.
    pub(crate) first_output: u32,
/// Invocations before the first listed sample, which do nothing: so neighbours begin to store
/// where a line of memory begins. `first_item` and `first_output` count them too.
    pub(crate) idle: u32,
}
const _: () = {
    assert!(size_of::<Dispatch>() == 24);
    assert!(std::mem::offset_of!(Dispatch, first_item) == 0);
    assert!(std::mem::offset_of!(Dispatch, item_count) == 4);
    assert!(std::mem::offset_of!(Dispatch, stride) == 8);
    assert!(std::mem::offset_of!(Dispatch, detail) == 12);
    assert!(std::mem::offset_of!(Dispatch, first_output) == 16);
    assert!(std::mem::offset_of!(Dispatch, idle) == 20);
};
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Grid {
/// The option of the store: the order of a matrix, the axes of angles.
    pub(crate) detail: u32,
/// Distance in the result between neighbouring samples of a track, in rotations.
    pub(crate) stride: u32,
/// Number of positions of a row.
    pub(crate) samples: u32,
/// How many rows.
    pub(crate) rows: u32,
/// Where the first position of the first row is stored.
    pub(crate) first_output: u32,
/// The block of the first positions of the first row.
    pub(crate) first_block: u32,
}
const _: () = {
    assert!(size_of::<Grid>() == 24);
    assert!(std::mem::offset_of!(Grid, detail) == 0);
    assert!(std::mem::offset_of!(Grid, stride) == 4);
    assert!(std::mem::offset_of!(Grid, samples) == 8);
    assert!(std::mem::offset_of!(Grid, rows) == 12);
    assert!(std::mem::offset_of!(Grid, first_output) == 16);
    assert!(std::mem::offset_of!(Grid, first_block) == 20);
};
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Item {
/// The segment's index; the constant's, when `count` carries `IS_CONSTANT`.
    pub(crate) source: u32,
/// Where the first sample is stored, counted from where the dispatch's first is; in a grid, the
/// first sample's position.
    pub(crate) output: u32,
/// Number of samples, with the bit `IS_CONSTANT` if they are a constant. Where an invocation
/// evaluates an item they are at most `ITEM_SAMPLES`; in a grid there are as many as there are,
/// and the bit `MAY_BE_TINY` may be set.
    pub(crate) count: u32,
/// For frames, the first sample's distance from the segment's middle; for explicit times, the
/// index of its distance in the list of distances.
    pub(crate) first: i32,
/// parameter = distance * scale + offset
    pub(crate) scale: f32,
    pub(crate) offset: f32,
}
const _: () = {
    assert!(size_of::<Item>() == 24);
    assert!(std::mem::offset_of!(Item, source) == 0);
    assert!(std::mem::offset_of!(Item, output) == 4);
    assert!(std::mem::offset_of!(Item, count) == 8);
    assert!(std::mem::offset_of!(Item, first) == 12);
    assert!(std::mem::offset_of!(Item, scale) == 16);
    assert!(std::mem::offset_of!(Item, offset) == 20);
};
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct KeySample {
/// The index of the key before it; with `IS_KEY` that of the key which the sample is.
    pub(crate) key: u32,
/// From -1/2 at that key to 1/2 at the next.
    pub(crate) parameter: f32,
}
const _: () = {
    assert!(size_of::<KeySample>() == 8);
    assert!(std::mem::offset_of!(KeySample, key) == 0);
    assert!(std::mem::offset_of!(KeySample, parameter) == 4);
};
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Link {
/// Its offset in its parent's frame; that of a root in the world.
    pub(crate) offset: [f32; 3],
/// Its index among the tracks.
    pub(crate) track: u32,
/// Its parent's index, or ROOT.
    pub(crate) parent: u32,
    pub(crate) padding_3: [u32; 3],
}
const _: () = {
    assert!(size_of::<Link>() == 32);
    assert!(std::mem::offset_of!(Link, offset) == 0);
    assert!(std::mem::offset_of!(Link, track) == 12);
    assert!(std::mem::offset_of!(Link, parent) == 16);
};
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct ListedSample {
/// The segment's index; the constant's, with `IS_CONSTANT`.
    pub(crate) source: u32,
/// As the form's `evaluate` takes it.
    pub(crate) parameter: f32,
}
const _: () = {
    assert!(size_of::<ListedSample>() == 8);
    assert!(std::mem::offset_of!(ListedSample, source) == 0);
    assert!(std::mem::offset_of!(ListedSample, parameter) == 4);
};
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct MotionDispatch {
/// The number of invocations with work.
    pub(crate) count: u32,
/// The first sample of the window.
    pub(crate) first_sample: u32,
/// Joints of the skeleton.
    pub(crate) joints: u32,
/// Joints that have a parent.
    pub(crate) links: u32,
/// 1 where velocities are derivatives of the curves, else 0.
    pub(crate) moves: u32,
/// Ticks in a second.
    pub(crate) ticks_per_second: f32,
/// The vector of each joint's state that is stored.
    pub(crate) vector: u32,
/// How many numbers of it, or of its matrix, are stored.
    pub(crate) numbers: u32,
/// 1 where matrices are stored column by column, 0 where row by row.
    pub(crate) detail: u32,
}
const _: () = {
    assert!(size_of::<MotionDispatch>() == 36);
    assert!(std::mem::offset_of!(MotionDispatch, count) == 0);
    assert!(std::mem::offset_of!(MotionDispatch, first_sample) == 4);
    assert!(std::mem::offset_of!(MotionDispatch, joints) == 8);
    assert!(std::mem::offset_of!(MotionDispatch, links) == 12);
    assert!(std::mem::offset_of!(MotionDispatch, moves) == 16);
    assert!(std::mem::offset_of!(MotionDispatch, ticks_per_second) == 20);
    assert!(std::mem::offset_of!(MotionDispatch, vector) == 24);
    assert!(std::mem::offset_of!(MotionDispatch, numbers) == 28);
    assert!(std::mem::offset_of!(MotionDispatch, detail) == 32);
};
/// A clip and the tick at which it is sampled.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct MotionSample {
    pub(crate) clip: u32,
    pub(crate) tick: u32,
}
const _: () = {
    assert!(size_of::<MotionSample>() == 8);
    assert!(std::mem::offset_of!(MotionSample, clip) == 0);
    assert!(std::mem::offset_of!(MotionSample, tick) == 4);
};
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct PolynomialSegment {
/// The coefficients of 1, s, s², … s¹⁰.
    pub(crate) coefficients: [[f32; 4]; 11],
}
const _: () = {
    assert!(size_of::<PolynomialSegment>() == 176);
    assert!(std::mem::offset_of!(PolynomialSegment, coefficients) == 0);
};
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct PoseDispatch {
/// The number of values, each of which has an invocation.
    pub(crate) count: u32,
/// Another number that the kernel needs: that of the layers, or of the tracks.
    pub(crate) detail: u32,
}
const _: () = {
    assert!(size_of::<PoseDispatch>() == 8);
    assert!(std::mem::offset_of!(PoseDispatch, count) == 0);
    assert!(std::mem::offset_of!(PoseDispatch, detail) == 4);
};
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Probe {
    pub(crate) a: f32,
    pub(crate) b: f32,
    pub(crate) c: f32,
    pub(crate) n: i32,
}
const _: () = {
    assert!(size_of::<Probe>() == 16);
    assert!(std::mem::offset_of!(Probe, a) == 0);
    assert!(std::mem::offset_of!(Probe, b) == 4);
    assert!(std::mem::offset_of!(Probe, c) == 8);
    assert!(std::mem::offset_of!(Probe, n) == 12);
};
/// The results of the expressions.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
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
const _: () = {
    assert!(size_of::<Reply>() == 40);
    assert!(std::mem::offset_of!(Reply, contraction) == 0);
    assert!(std::mem::offset_of!(Reply, reassociation) == 4);
    assert!(std::mem::offset_of!(Reply, rounding) == 8);
    assert!(std::mem::offset_of!(Reply, association) == 12);
    assert!(std::mem::offset_of!(Reply, conversion) == 16);
    assert!(std::mem::offset_of!(Reply, cancellation) == 20);
    assert!(std::mem::offset_of!(Reply, sine) == 24);
    assert!(std::mem::offset_of!(Reply, cosine) == 28);
    assert!(std::mem::offset_of!(Reply, root) == 32);
    assert!(std::mem::offset_of!(Reply, arc_tangent) == 36);
};
/// The rows of a dispatch. Tracks with the same key times are a row each and share one list of
/// samples; other tracks together are one row.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct RowShape {
/// Samples of each row.
    pub(crate) samples: u32,
/// Keys of each row.
    pub(crate) keys: u32,
/// How many rows.
    pub(crate) count: u32,
/// Rows that an invocation takes: up to `ROWS_PER_INVOCATION`, or one where `line` is not 0.
    pub(crate) each: u32,
/// Rows begin anywhere in a line of the result's memory. Where that matters, the number of
/// rotations of a line, less one: the first of so many neighbours then stores where a line
/// begins.
    pub(crate) line: u32,
}
const _: () = {
    assert!(size_of::<RowShape>() == 20);
    assert!(std::mem::offset_of!(RowShape, samples) == 0);
    assert!(std::mem::offset_of!(RowShape, keys) == 4);
    assert!(std::mem::offset_of!(RowShape, count) == 8);
    assert!(std::mem::offset_of!(RowShape, each) == 12);
    assert!(std::mem::offset_of!(RowShape, line) == 16);
};
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Spread {
/// The option of the store: the order of a matrix, the axes of angles.
    pub(crate) detail: u32,
/// The first run of this dispatch.
    pub(crate) first_item: u32,
/// How many runs it evaluates.
    pub(crate) item_count: u32,
/// The number that is added to their `output`.
    pub(crate) first_output: u32,
/// The lanes of a run, as a power of two.
    pub(crate) lanes_log2: u32,
/// The lanes of a run less one, if they have neighbouring samples; 0 if they have neighbouring tracks.
    pub(crate) sample_mask: u32,
/// The lanes of a run less one, if they have neighbouring tracks; else 0.
    pub(crate) track_mask: u32,
/// From a sample of a lane to its next one.
    pub(crate) step: u32,
/// The same as a power of two.
    pub(crate) step_log2: u32,
/// The distance in the result between neighbouring samples of a track, in values.
    pub(crate) stride: u32,
/// The invocations that store one line of memory, less one.
    pub(crate) line_mask: u32,
/// How often the runs are evaluated, where tracks with the same times share them. A layer of workgroups, along z,
/// evaluates one repetition, or one for each lane of a run.
    pub(crate) repetitions: u32,
/// The repetitions of a layer of workgroups.
    pub(crate) layer_repetitions: u32,
/// How many segments the runs of the next repetition are further on.
    pub(crate) segments: u32,
/// How many constants they are further on.
    pub(crate) constants: u32,
/// How many values they are further on in the result.
    pub(crate) outputs: u32,
}
const _: () = {
    assert!(size_of::<Spread>() == 64);
    assert!(std::mem::offset_of!(Spread, detail) == 0);
    assert!(std::mem::offset_of!(Spread, first_item) == 4);
    assert!(std::mem::offset_of!(Spread, item_count) == 8);
    assert!(std::mem::offset_of!(Spread, first_output) == 12);
    assert!(std::mem::offset_of!(Spread, lanes_log2) == 16);
    assert!(std::mem::offset_of!(Spread, sample_mask) == 20);
    assert!(std::mem::offset_of!(Spread, track_mask) == 24);
    assert!(std::mem::offset_of!(Spread, step) == 28);
    assert!(std::mem::offset_of!(Spread, step_log2) == 32);
    assert!(std::mem::offset_of!(Spread, stride) == 36);
    assert!(std::mem::offset_of!(Spread, line_mask) == 40);
    assert!(std::mem::offset_of!(Spread, repetitions) == 44);
    assert!(std::mem::offset_of!(Spread, layer_repetitions) == 48);
    assert!(std::mem::offset_of!(Spread, segments) == 52);
    assert!(std::mem::offset_of!(Spread, constants) == 56);
    assert!(std::mem::offset_of!(Spread, outputs) == 60);
};
/// Consecutive samples of one track that lie in one segment, or hold one constant.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct SpreadRun {
/// The segment's index; the constant's, when `count` carries `IS_CONSTANT`.
    pub(crate) source: u32,
/// Where the first sample is stored, counted from where the dispatch's first is.
    pub(crate) output: u32,
/// Number of samples, with the bit `IS_CONSTANT` if they are a constant, and the bit `NEEDS_CARE` if a
/// component may pass near 0 or a distance is not exact in f32.
    pub(crate) count: u32,
/// For frames, the first sample's distance from the segment's middle; for explicit times, the
/// index of its distance in the list of distances.
    pub(crate) first: i32,
/// parameter = distance * scale + offset
    pub(crate) scale: f32,
/// The constant that is stored instead of the first sample; `NO_KEY` if there is none.
    pub(crate) offset: f32,
/// The most iterations that a run of the same workgroup takes.
    pub(crate) key: u32,
    pub(crate) iterations: u32,
}
const _: () = {
    assert!(size_of::<SpreadRun>() == 32);
    assert!(std::mem::offset_of!(SpreadRun, source) == 0);
    assert!(std::mem::offset_of!(SpreadRun, output) == 4);
    assert!(std::mem::offset_of!(SpreadRun, count) == 8);
    assert!(std::mem::offset_of!(SpreadRun, first) == 12);
    assert!(std::mem::offset_of!(SpreadRun, scale) == 16);
    assert!(std::mem::offset_of!(SpreadRun, offset) == 20);
    assert!(std::mem::offset_of!(SpreadRun, key) == 24);
    assert!(std::mem::offset_of!(SpreadRun, iterations) == 28);
};
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct TangentWeights {
/// The weight of the step before the key, and of the step after it.
    pub(crate) before: f32,
/// The handle after the key is the tangent times this; the handle before it is the tangent
/// times 1/3 minus this.
    pub(crate) after: f32,
/// `KEY_INNER`, `KEY_AT_END` or `KEY_UNKNOWN`.
    pub(crate) outgoing: f32,
    pub(crate) kind: f32,
}
const _: () = {
    assert!(size_of::<TangentWeights>() == 16);
    assert!(std::mem::offset_of!(TangentWeights, before) == 0);
    assert!(std::mem::offset_of!(TangentWeights, after) == 4);
    assert!(std::mem::offset_of!(TangentWeights, outgoing) == 8);
    assert!(std::mem::offset_of!(TangentWeights, kind) == 12);
};
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct TreeFrame {
/// The position in the frame above.
    pub(crate) offset: [f32; 3],
/// The index of the frame above, or `NO_FRAME`.
    pub(crate) above: u32,
/// The rotation in the frame above, before the joint moves it.
    pub(crate) rest: [f32; 4],
/// The unit axis of a hinge or a slide, after `rest`.
    pub(crate) axis: [f32; 3],
/// How it moves: a FRAME_….
    pub(crate) kind: u32,
/// Where the states of a sample's tracks have its motion, in words: the coordinate of a hinge or a slide, else the
/// first word of its track.
    pub(crate) source: u32,
/// The first word of the track whose position is added last, or `NO_FRAME`.
    pub(crate) root: u32,
/// A hinge turns by `multiplier * coordinate + shift`, a slide is moved so far.
    pub(crate) multiplier: f32,
    pub(crate) shift: f32,
}
const _: () = {
    assert!(size_of::<TreeFrame>() == 64);
    assert!(std::mem::offset_of!(TreeFrame, offset) == 0);
    assert!(std::mem::offset_of!(TreeFrame, above) == 12);
    assert!(std::mem::offset_of!(TreeFrame, rest) == 16);
    assert!(std::mem::offset_of!(TreeFrame, axis) == 32);
    assert!(std::mem::offset_of!(TreeFrame, kind) == 44);
    assert!(std::mem::offset_of!(TreeFrame, source) == 48);
    assert!(std::mem::offset_of!(TreeFrame, root) == 52);
    assert!(std::mem::offset_of!(TreeFrame, multiplier) == 56);
    assert!(std::mem::offset_of!(TreeFrame, shift) == 60);
};
/// A kernel, by its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kernel {
    SelfTest,
    ArcFramesAxisAngle,
    ArcFramesEuler,
    ArcFramesF16,
    ArcFramesF32,
    ArcFramesMatrix3x3,
    ArcFramesMatrix3x4,
    ArcFramesSixD,
    ArcFramesSnorm16,
    ArcFramesVector,
    ArcTimesAxisAngle,
    ArcTimesEuler,
    ArcTimesF16,
    ArcTimesF32,
    ArcTimesMatrix3x3,
    ArcTimesMatrix3x4,
    ArcTimesSixD,
    ArcTimesSnorm16,
    ArcTimesVector,
    ArcSamplesAxisAngle,
    ArcSamplesEuler,
    ArcSamplesF16,
    ArcSamplesF32,
    ArcSamplesMatrix3x3,
    ArcSamplesMatrix3x4,
    ArcSamplesSixD,
    ArcSamplesSnorm16,
    ArcSamplesVector,
    ArcFramesCoalescedAxisAngle,
    ArcFramesCoalescedEuler,
    ArcFramesCoalescedF16,
    ArcFramesCoalescedF32,
    ArcFramesCoalescedMatrix3x3,
    ArcFramesCoalescedMatrix3x4,
    ArcFramesCoalescedSixD,
    ArcFramesCoalescedSnorm16,
    ArcFramesCoalescedVector,
    ArcTimesCoalescedAxisAngle,
    ArcTimesCoalescedEuler,
    ArcTimesCoalescedF16,
    ArcTimesCoalescedF32,
    ArcTimesCoalescedMatrix3x3,
    ArcTimesCoalescedMatrix3x4,
    ArcTimesCoalescedSixD,
    ArcTimesCoalescedSnorm16,
    ArcTimesCoalescedVector,
    ArcFramesSpreadAxisAngle,
    ArcFramesSpreadEuler,
    ArcFramesSpreadF16,
    ArcFramesSpreadF32,
    ArcFramesSpreadMatrix3x3,
    ArcFramesSpreadMatrix3x4,
    ArcFramesSpreadSixD,
    ArcFramesSpreadSnorm16,
    ArcFramesSpreadVector,
    ArcTimesSpreadAxisAngle,
    ArcTimesSpreadEuler,
    ArcTimesSpreadF16,
    ArcTimesSpreadF32,
    ArcTimesSpreadMatrix3x3,
    ArcTimesSpreadMatrix3x4,
    ArcTimesSpreadSixD,
    ArcTimesSpreadSnorm16,
    ArcTimesSpreadVector,
    PolynomialFramesAxisAngle,
    PolynomialFramesEuler,
    PolynomialFramesF16,
    PolynomialFramesF32,
    PolynomialFramesMatrix3x3,
    PolynomialFramesMatrix3x4,
    PolynomialFramesSixD,
    PolynomialFramesSnorm16,
    PolynomialFramesVector,
    PolynomialTimesAxisAngle,
    PolynomialTimesEuler,
    PolynomialTimesF16,
    PolynomialTimesF32,
    PolynomialTimesMatrix3x3,
    PolynomialTimesMatrix3x4,
    PolynomialTimesSixD,
    PolynomialTimesSnorm16,
    PolynomialTimesVector,
    PolynomialSamplesAxisAngle,
    PolynomialSamplesEuler,
    PolynomialSamplesF16,
    PolynomialSamplesF32,
    PolynomialSamplesMatrix3x3,
    PolynomialSamplesMatrix3x4,
    PolynomialSamplesSixD,
    PolynomialSamplesSnorm16,
    PolynomialSamplesVector,
    PolynomialFramesCoalescedAxisAngle,
    PolynomialFramesCoalescedEuler,
    PolynomialFramesCoalescedF16,
    PolynomialFramesCoalescedF32,
    PolynomialFramesCoalescedMatrix3x3,
    PolynomialFramesCoalescedMatrix3x4,
    PolynomialFramesCoalescedSixD,
    PolynomialFramesCoalescedSnorm16,
    PolynomialFramesCoalescedVector,
    PolynomialTimesCoalescedAxisAngle,
    PolynomialTimesCoalescedEuler,
    PolynomialTimesCoalescedF16,
    PolynomialTimesCoalescedF32,
    PolynomialTimesCoalescedMatrix3x3,
    PolynomialTimesCoalescedMatrix3x4,
    PolynomialTimesCoalescedSixD,
    PolynomialTimesCoalescedSnorm16,
    PolynomialTimesCoalescedVector,
    PolynomialFramesSpreadAxisAngle,
    PolynomialFramesSpreadEuler,
    PolynomialFramesSpreadF16,
    PolynomialFramesSpreadF32,
    PolynomialFramesSpreadMatrix3x3,
    PolynomialFramesSpreadMatrix3x4,
    PolynomialFramesSpreadSixD,
    PolynomialFramesSpreadSnorm16,
    PolynomialFramesSpreadVector,
    PolynomialTimesSpreadAxisAngle,
    PolynomialTimesSpreadEuler,
    PolynomialTimesSpreadF16,
    PolynomialTimesSpreadF32,
    PolynomialTimesSpreadMatrix3x3,
    PolynomialTimesSpreadMatrix3x4,
    PolynomialTimesSpreadSixD,
    PolynomialTimesSpreadSnorm16,
    PolynomialTimesSpreadVector,
    FromKeysArcs,
    FromKeysTwoKeys,
    FromKeysCubics,
    PosesAdd,
    PosesBlend,
    PosesMix,
    PosesSmooth,
    PosesSteps,
    PosesWorld,
    CrowdRotations,
    CrowdPlainRotations,
    CrowdLocals,
    CrowdPlainLocals,
    CrowdCompactRotations,
    CrowdCompactLocals,
    CrowdGather,
    CrowdScatter,
    CrowdTimes,
    CrowdWalk,
    CrowdWalkAll,
    CrowdSkin,
    CrowdHalf,
    CrowdWholeRotations,
    CrowdPlainWholeRotations,
    CrowdWholeMatrices,
    CrowdPlainWholeMatrices,
    CrowdCompactWholeRotations,
    CrowdSubgroupRotations,
    CrowdSubgroupRotationsF16,
    MotionJoints,
    MotionWalk,
    MotionDifferences,
    MotionStore,
    MotionMatrices,
    MotionTree,
    MotionPick,
    PrepareArcs,
}
/// How the work over segments is listed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum List {
    Frames,
    Times,
    Samples,
    FramesCoalesced,
    TimesCoalesced,
    FramesSpread,
    TimesSpread,
}
/// The representation in which a kernel stores rotations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Store {
    AxisAngle,
    Euler,
    F16,
    F32,
    Matrix3x3,
    Matrix3x4,
    SixD,
    Snorm16,
    Vector,
}
impl Kernel {
    /// The kernel for a form of segments, a list and a store.
    pub(crate) fn over_segments(form: Form, list: List, store: Store) -> Self {
        match (form, list, store) {
            (Form::Arc, List::Frames, Store::AxisAngle) => Self::ArcFramesAxisAngle,
            (Form::Arc, List::Frames, Store::Euler) => Self::ArcFramesEuler,
            (Form::Arc, List::Frames, Store::F16) => Self::ArcFramesF16,
            (Form::Arc, List::Frames, Store::F32) => Self::ArcFramesF32,
            (Form::Arc, List::Frames, Store::Matrix3x3) => Self::ArcFramesMatrix3x3,
            (Form::Arc, List::Frames, Store::Matrix3x4) => Self::ArcFramesMatrix3x4,
            (Form::Arc, List::Frames, Store::SixD) => Self::ArcFramesSixD,
            (Form::Arc, List::Frames, Store::Snorm16) => Self::ArcFramesSnorm16,
            (Form::Arc, List::Frames, Store::Vector) => Self::ArcFramesVector,
            (Form::Arc, List::Times, Store::AxisAngle) => Self::ArcTimesAxisAngle,
            (Form::Arc, List::Times, Store::Euler) => Self::ArcTimesEuler,
            (Form::Arc, List::Times, Store::F16) => Self::ArcTimesF16,
            (Form::Arc, List::Times, Store::F32) => Self::ArcTimesF32,
            (Form::Arc, List::Times, Store::Matrix3x3) => Self::ArcTimesMatrix3x3,
            (Form::Arc, List::Times, Store::Matrix3x4) => Self::ArcTimesMatrix3x4,
            (Form::Arc, List::Times, Store::SixD) => Self::ArcTimesSixD,
            (Form::Arc, List::Times, Store::Snorm16) => Self::ArcTimesSnorm16,
            (Form::Arc, List::Times, Store::Vector) => Self::ArcTimesVector,
            (Form::Arc, List::Samples, Store::AxisAngle) => Self::ArcSamplesAxisAngle,
            (Form::Arc, List::Samples, Store::Euler) => Self::ArcSamplesEuler,
            (Form::Arc, List::Samples, Store::F16) => Self::ArcSamplesF16,
            (Form::Arc, List::Samples, Store::F32) => Self::ArcSamplesF32,
            (Form::Arc, List::Samples, Store::Matrix3x3) => Self::ArcSamplesMatrix3x3,
            (Form::Arc, List::Samples, Store::Matrix3x4) => Self::ArcSamplesMatrix3x4,
            (Form::Arc, List::Samples, Store::SixD) => Self::ArcSamplesSixD,
            (Form::Arc, List::Samples, Store::Snorm16) => Self::ArcSamplesSnorm16,
            (Form::Arc, List::Samples, Store::Vector) => Self::ArcSamplesVector,
            (Form::Arc, List::FramesCoalesced, Store::AxisAngle) => Self::ArcFramesCoalescedAxisAngle,
            (Form::Arc, List::FramesCoalesced, Store::Euler) => Self::ArcFramesCoalescedEuler,
            (Form::Arc, List::FramesCoalesced, Store::F16) => Self::ArcFramesCoalescedF16,
            (Form::Arc, List::FramesCoalesced, Store::F32) => Self::ArcFramesCoalescedF32,
            (Form::Arc, List::FramesCoalesced, Store::Matrix3x3) => Self::ArcFramesCoalescedMatrix3x3,
            (Form::Arc, List::FramesCoalesced, Store::Matrix3x4) => Self::ArcFramesCoalescedMatrix3x4,
            (Form::Arc, List::FramesCoalesced, Store::SixD) => Self::ArcFramesCoalescedSixD,
            (Form::Arc, List::FramesCoalesced, Store::Snorm16) => Self::ArcFramesCoalescedSnorm16,
            (Form::Arc, List::FramesCoalesced, Store::Vector) => Self::ArcFramesCoalescedVector,
            (Form::Arc, List::TimesCoalesced, Store::AxisAngle) => Self::ArcTimesCoalescedAxisAngle,
            (Form::Arc, List::TimesCoalesced, Store::Euler) => Self::ArcTimesCoalescedEuler,
            (Form::Arc, List::TimesCoalesced, Store::F16) => Self::ArcTimesCoalescedF16,
            (Form::Arc, List::TimesCoalesced, Store::F32) => Self::ArcTimesCoalescedF32,
            (Form::Arc, List::TimesCoalesced, Store::Matrix3x3) => Self::ArcTimesCoalescedMatrix3x3,
            (Form::Arc, List::TimesCoalesced, Store::Matrix3x4) => Self::ArcTimesCoalescedMatrix3x4,
            (Form::Arc, List::TimesCoalesced, Store::SixD) => Self::ArcTimesCoalescedSixD,
            (Form::Arc, List::TimesCoalesced, Store::Snorm16) => Self::ArcTimesCoalescedSnorm16,
            (Form::Arc, List::TimesCoalesced, Store::Vector) => Self::ArcTimesCoalescedVector,
            (Form::Arc, List::FramesSpread, Store::AxisAngle) => Self::ArcFramesSpreadAxisAngle,
            (Form::Arc, List::FramesSpread, Store::Euler) => Self::ArcFramesSpreadEuler,
            (Form::Arc, List::FramesSpread, Store::F16) => Self::ArcFramesSpreadF16,
            (Form::Arc, List::FramesSpread, Store::F32) => Self::ArcFramesSpreadF32,
            (Form::Arc, List::FramesSpread, Store::Matrix3x3) => Self::ArcFramesSpreadMatrix3x3,
            (Form::Arc, List::FramesSpread, Store::Matrix3x4) => Self::ArcFramesSpreadMatrix3x4,
            (Form::Arc, List::FramesSpread, Store::SixD) => Self::ArcFramesSpreadSixD,
            (Form::Arc, List::FramesSpread, Store::Snorm16) => Self::ArcFramesSpreadSnorm16,
            (Form::Arc, List::FramesSpread, Store::Vector) => Self::ArcFramesSpreadVector,
            (Form::Arc, List::TimesSpread, Store::AxisAngle) => Self::ArcTimesSpreadAxisAngle,
            (Form::Arc, List::TimesSpread, Store::Euler) => Self::ArcTimesSpreadEuler,
            (Form::Arc, List::TimesSpread, Store::F16) => Self::ArcTimesSpreadF16,
            (Form::Arc, List::TimesSpread, Store::F32) => Self::ArcTimesSpreadF32,
            (Form::Arc, List::TimesSpread, Store::Matrix3x3) => Self::ArcTimesSpreadMatrix3x3,
            (Form::Arc, List::TimesSpread, Store::Matrix3x4) => Self::ArcTimesSpreadMatrix3x4,
            (Form::Arc, List::TimesSpread, Store::SixD) => Self::ArcTimesSpreadSixD,
            (Form::Arc, List::TimesSpread, Store::Snorm16) => Self::ArcTimesSpreadSnorm16,
            (Form::Arc, List::TimesSpread, Store::Vector) => Self::ArcTimesSpreadVector,
            (Form::Polynomial, List::Frames, Store::AxisAngle) => Self::PolynomialFramesAxisAngle,
            (Form::Polynomial, List::Frames, Store::Euler) => Self::PolynomialFramesEuler,
            (Form::Polynomial, List::Frames, Store::F16) => Self::PolynomialFramesF16,
            (Form::Polynomial, List::Frames, Store::F32) => Self::PolynomialFramesF32,
            (Form::Polynomial, List::Frames, Store::Matrix3x3) => Self::PolynomialFramesMatrix3x3,
            (Form::Polynomial, List::Frames, Store::Matrix3x4) => Self::PolynomialFramesMatrix3x4,
            (Form::Polynomial, List::Frames, Store::SixD) => Self::PolynomialFramesSixD,
            (Form::Polynomial, List::Frames, Store::Snorm16) => Self::PolynomialFramesSnorm16,
            (Form::Polynomial, List::Frames, Store::Vector) => Self::PolynomialFramesVector,
            (Form::Polynomial, List::Times, Store::AxisAngle) => Self::PolynomialTimesAxisAngle,
            (Form::Polynomial, List::Times, Store::Euler) => Self::PolynomialTimesEuler,
            (Form::Polynomial, List::Times, Store::F16) => Self::PolynomialTimesF16,
            (Form::Polynomial, List::Times, Store::F32) => Self::PolynomialTimesF32,
            (Form::Polynomial, List::Times, Store::Matrix3x3) => Self::PolynomialTimesMatrix3x3,
            (Form::Polynomial, List::Times, Store::Matrix3x4) => Self::PolynomialTimesMatrix3x4,
            (Form::Polynomial, List::Times, Store::SixD) => Self::PolynomialTimesSixD,
            (Form::Polynomial, List::Times, Store::Snorm16) => Self::PolynomialTimesSnorm16,
            (Form::Polynomial, List::Times, Store::Vector) => Self::PolynomialTimesVector,
            (Form::Polynomial, List::Samples, Store::AxisAngle) => Self::PolynomialSamplesAxisAngle,
            (Form::Polynomial, List::Samples, Store::Euler) => Self::PolynomialSamplesEuler,
            (Form::Polynomial, List::Samples, Store::F16) => Self::PolynomialSamplesF16,
            (Form::Polynomial, List::Samples, Store::F32) => Self::PolynomialSamplesF32,
            (Form::Polynomial, List::Samples, Store::Matrix3x3) => Self::PolynomialSamplesMatrix3x3,
            (Form::Polynomial, List::Samples, Store::Matrix3x4) => Self::PolynomialSamplesMatrix3x4,
            (Form::Polynomial, List::Samples, Store::SixD) => Self::PolynomialSamplesSixD,
            (Form::Polynomial, List::Samples, Store::Snorm16) => Self::PolynomialSamplesSnorm16,
            (Form::Polynomial, List::Samples, Store::Vector) => Self::PolynomialSamplesVector,
            (Form::Polynomial, List::FramesCoalesced, Store::AxisAngle) => Self::PolynomialFramesCoalescedAxisAngle,
            (Form::Polynomial, List::FramesCoalesced, Store::Euler) => Self::PolynomialFramesCoalescedEuler,
            (Form::Polynomial, List::FramesCoalesced, Store::F16) => Self::PolynomialFramesCoalescedF16,
            (Form::Polynomial, List::FramesCoalesced, Store::F32) => Self::PolynomialFramesCoalescedF32,
            (Form::Polynomial, List::FramesCoalesced, Store::Matrix3x3) => Self::PolynomialFramesCoalescedMatrix3x3,
            (Form::Polynomial, List::FramesCoalesced, Store::Matrix3x4) => Self::PolynomialFramesCoalescedMatrix3x4,
            (Form::Polynomial, List::FramesCoalesced, Store::SixD) => Self::PolynomialFramesCoalescedSixD,
            (Form::Polynomial, List::FramesCoalesced, Store::Snorm16) => Self::PolynomialFramesCoalescedSnorm16,
            (Form::Polynomial, List::FramesCoalesced, Store::Vector) => Self::PolynomialFramesCoalescedVector,
            (Form::Polynomial, List::TimesCoalesced, Store::AxisAngle) => Self::PolynomialTimesCoalescedAxisAngle,
            (Form::Polynomial, List::TimesCoalesced, Store::Euler) => Self::PolynomialTimesCoalescedEuler,
            (Form::Polynomial, List::TimesCoalesced, Store::F16) => Self::PolynomialTimesCoalescedF16,
            (Form::Polynomial, List::TimesCoalesced, Store::F32) => Self::PolynomialTimesCoalescedF32,
            (Form::Polynomial, List::TimesCoalesced, Store::Matrix3x3) => Self::PolynomialTimesCoalescedMatrix3x3,
            (Form::Polynomial, List::TimesCoalesced, Store::Matrix3x4) => Self::PolynomialTimesCoalescedMatrix3x4,
            (Form::Polynomial, List::TimesCoalesced, Store::SixD) => Self::PolynomialTimesCoalescedSixD,
            (Form::Polynomial, List::TimesCoalesced, Store::Snorm16) => Self::PolynomialTimesCoalescedSnorm16,
            (Form::Polynomial, List::TimesCoalesced, Store::Vector) => Self::PolynomialTimesCoalescedVector,
            (Form::Polynomial, List::FramesSpread, Store::AxisAngle) => Self::PolynomialFramesSpreadAxisAngle,
            (Form::Polynomial, List::FramesSpread, Store::Euler) => Self::PolynomialFramesSpreadEuler,
            (Form::Polynomial, List::FramesSpread, Store::F16) => Self::PolynomialFramesSpreadF16,
            (Form::Polynomial, List::FramesSpread, Store::F32) => Self::PolynomialFramesSpreadF32,
            (Form::Polynomial, List::FramesSpread, Store::Matrix3x3) => Self::PolynomialFramesSpreadMatrix3x3,
            (Form::Polynomial, List::FramesSpread, Store::Matrix3x4) => Self::PolynomialFramesSpreadMatrix3x4,
            (Form::Polynomial, List::FramesSpread, Store::SixD) => Self::PolynomialFramesSpreadSixD,
            (Form::Polynomial, List::FramesSpread, Store::Snorm16) => Self::PolynomialFramesSpreadSnorm16,
            (Form::Polynomial, List::FramesSpread, Store::Vector) => Self::PolynomialFramesSpreadVector,
            (Form::Polynomial, List::TimesSpread, Store::AxisAngle) => Self::PolynomialTimesSpreadAxisAngle,
            (Form::Polynomial, List::TimesSpread, Store::Euler) => Self::PolynomialTimesSpreadEuler,
            (Form::Polynomial, List::TimesSpread, Store::F16) => Self::PolynomialTimesSpreadF16,
            (Form::Polynomial, List::TimesSpread, Store::F32) => Self::PolynomialTimesSpreadF32,
            (Form::Polynomial, List::TimesSpread, Store::Matrix3x3) => Self::PolynomialTimesSpreadMatrix3x3,
            (Form::Polynomial, List::TimesSpread, Store::Matrix3x4) => Self::PolynomialTimesSpreadMatrix3x4,
            (Form::Polynomial, List::TimesSpread, Store::SixD) => Self::PolynomialTimesSpreadSixD,
            (Form::Polynomial, List::TimesSpread, Store::Snorm16) => Self::PolynomialTimesSpreadSnorm16,
            (Form::Polynomial, List::TimesSpread, Store::Vector) => Self::PolynomialTimesSpreadVector,
        }
    }
}
pub(crate) static KERNELS: [KernelCode; 164] = [
    KernelCode { kernel: Kernel::SelfTest, storage: ("self_test", 1946), texels: None, converting: None, bindings: &[Read, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::ArcFramesAxisAngle, storage: ("arc_frames_axis_angle", 2963), texels: Some(("arc_frames_axis_angle_texels", 3089)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Arc, List::Frames, Store::AxisAngle)), subgroups: false },
    KernelCode { kernel: Kernel::ArcFramesEuler, storage: ("arc_frames_euler", 3619), texels: Some(("arc_frames_euler_texels", 3737)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Arc, List::Frames, Store::Euler)), subgroups: false },
    KernelCode { kernel: Kernel::ArcFramesF16, storage: ("arc_frames_f16", 2176), texels: Some(("arc_frames_f16_texels", 2294)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Arc, List::Frames, Store::F16)), subgroups: false },
    KernelCode { kernel: Kernel::ArcFramesF32, storage: ("arc_frames_f32", 1920), texels: Some(("arc_frames_f32_texels", 2151)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Arc, List::Frames, Store::F32)), subgroups: false },
    KernelCode { kernel: Kernel::ArcFramesMatrix3x3, storage: ("arc_frames_matrix3x3", 2604), texels: Some(("arc_frames_matrix3x3_texels", 2722)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Arc, List::Frames, Store::Matrix3x3)), subgroups: false },
    KernelCode { kernel: Kernel::ArcFramesMatrix3x4, storage: ("arc_frames_matrix3x4", 2638), texels: Some(("arc_frames_matrix3x4_texels", 2760)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Arc, List::Frames, Store::Matrix3x4)), subgroups: false },
    KernelCode { kernel: Kernel::ArcFramesSixD, storage: ("arc_frames_six_d", 2571), texels: Some(("arc_frames_six_d_texels", 2689)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Arc, List::Frames, Store::SixD)), subgroups: false },
    KernelCode { kernel: Kernel::ArcFramesSnorm16, storage: ("arc_frames_snorm16", 2057), texels: Some(("arc_frames_snorm16_texels", 2175)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Arc, List::Frames, Store::Snorm16)), subgroups: false },
    KernelCode { kernel: Kernel::ArcFramesVector, storage: ("arc_frames_vector", 2096), texels: Some(("arc_frames_vector_texels", 2214)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Arc, List::Frames, Store::Vector)), subgroups: false },
    KernelCode { kernel: Kernel::ArcTimesAxisAngle, storage: ("arc_times_axis_angle", 3028), texels: Some(("arc_times_axis_angle_texels", 3185)), converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::Times, Store::AxisAngle)), subgroups: false },
    KernelCode { kernel: Kernel::ArcTimesEuler, storage: ("arc_times_euler", 3680), texels: Some(("arc_times_euler_texels", 3833)), converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::Times, Store::Euler)), subgroups: false },
    KernelCode { kernel: Kernel::ArcTimesF16, storage: ("arc_times_f16", 2241), texels: Some(("arc_times_f16_texels", 2390)), converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::Times, Store::F16)), subgroups: false },
    KernelCode { kernel: Kernel::ArcTimesF32, storage: ("arc_times_f32", 1985), texels: Some(("arc_times_f32_texels", 2247)), converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::Times, Store::F32)), subgroups: false },
    KernelCode { kernel: Kernel::ArcTimesMatrix3x3, storage: ("arc_times_matrix3x3", 2665), texels: Some(("arc_times_matrix3x3_texels", 2818)), converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::Times, Store::Matrix3x3)), subgroups: false },
    KernelCode { kernel: Kernel::ArcTimesMatrix3x4, storage: ("arc_times_matrix3x4", 2703), texels: Some(("arc_times_matrix3x4_texels", 2856)), converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::Times, Store::Matrix3x4)), subgroups: false },
    KernelCode { kernel: Kernel::ArcTimesSixD, storage: ("arc_times_six_d", 2632), texels: Some(("arc_times_six_d_texels", 2785)), converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::Times, Store::SixD)), subgroups: false },
    KernelCode { kernel: Kernel::ArcTimesSnorm16, storage: ("arc_times_snorm16", 2122), texels: Some(("arc_times_snorm16_texels", 2271)), converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::Times, Store::Snorm16)), subgroups: false },
    KernelCode { kernel: Kernel::ArcTimesVector, storage: ("arc_times_vector", 2157), texels: Some(("arc_times_vector_texels", 2310)), converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::Times, Store::Vector)), subgroups: false },
    KernelCode { kernel: Kernel::ArcSamplesAxisAngle, storage: ("arc_samples_axis_angle", 2642), texels: Some(("arc_samples_axis_angle_texels", 2693)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Arc, List::Samples, Store::AxisAngle)), subgroups: false },
    KernelCode { kernel: Kernel::ArcSamplesEuler, storage: ("arc_samples_euler", 3306), texels: Some(("arc_samples_euler_texels", 3349)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Arc, List::Samples, Store::Euler)), subgroups: false },
    KernelCode { kernel: Kernel::ArcSamplesF16, storage: ("arc_samples_f16", 1859), texels: Some(("arc_samples_f16_texels", 1902)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Arc, List::Samples, Store::F16)), subgroups: false },
    KernelCode { kernel: Kernel::ArcSamplesF32, storage: ("arc_samples_f32", 1599), texels: Some(("arc_samples_f32_texels", 1755)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Arc, List::Samples, Store::F32)), subgroups: false },
    KernelCode { kernel: Kernel::ArcSamplesMatrix3x3, storage: ("arc_samples_matrix3x3", 2291), texels: Some(("arc_samples_matrix3x3_texels", 2334)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Arc, List::Samples, Store::Matrix3x3)), subgroups: false },
    KernelCode { kernel: Kernel::ArcSamplesMatrix3x4, storage: ("arc_samples_matrix3x4", 2325), texels: Some(("arc_samples_matrix3x4_texels", 2372)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Arc, List::Samples, Store::Matrix3x4)), subgroups: false },
    KernelCode { kernel: Kernel::ArcSamplesSixD, storage: ("arc_samples_six_d", 2258), texels: Some(("arc_samples_six_d_texels", 2301)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Arc, List::Samples, Store::SixD)), subgroups: false },
    KernelCode { kernel: Kernel::ArcSamplesSnorm16, storage: ("arc_samples_snorm16", 1740), texels: Some(("arc_samples_snorm16_texels", 1783)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Arc, List::Samples, Store::Snorm16)), subgroups: false },
    KernelCode { kernel: Kernel::ArcSamplesVector, storage: ("arc_samples_vector", 1779), texels: Some(("arc_samples_vector_texels", 1826)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Arc, List::Samples, Store::Vector)), subgroups: false },
    KernelCode { kernel: Kernel::ArcFramesCoalescedAxisAngle, storage: ("arc_frames_coalesced_axis_angle", 3748), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::FramesCoalesced, Store::AxisAngle)), subgroups: false },
    KernelCode { kernel: Kernel::ArcFramesCoalescedEuler, storage: ("arc_frames_coalesced_euler", 4645), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::FramesCoalesced, Store::Euler)), subgroups: false },
    KernelCode { kernel: Kernel::ArcFramesCoalescedF16, storage: ("arc_frames_coalesced_f16", 2965), texels: None, converting: Some(("arc_frames_coalesced_f16_converting", 2791)), bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::FramesCoalesced, Store::F16)), subgroups: false },
    KernelCode { kernel: Kernel::ArcFramesCoalescedF32, storage: ("arc_frames_coalesced_f32", 2705), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::FramesCoalesced, Store::F32)), subgroups: false },
    KernelCode { kernel: Kernel::ArcFramesCoalescedMatrix3x3, storage: ("arc_frames_coalesced_matrix3x3", 3630), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::FramesCoalesced, Store::Matrix3x3)), subgroups: false },
    KernelCode { kernel: Kernel::ArcFramesCoalescedMatrix3x4, storage: ("arc_frames_coalesced_matrix3x4", 3664), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::FramesCoalesced, Store::Matrix3x4)), subgroups: false },
    KernelCode { kernel: Kernel::ArcFramesCoalescedSixD, storage: ("arc_frames_coalesced_six_d", 3597), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::FramesCoalesced, Store::SixD)), subgroups: false },
    KernelCode { kernel: Kernel::ArcFramesCoalescedSnorm16, storage: ("arc_frames_coalesced_snorm16", 2846), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::FramesCoalesced, Store::Snorm16)), subgroups: false },
    KernelCode { kernel: Kernel::ArcFramesCoalescedVector, storage: ("arc_frames_coalesced_vector", 3117), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::FramesCoalesced, Store::Vector)), subgroups: false },
    KernelCode { kernel: Kernel::ArcTimesCoalescedAxisAngle, storage: ("arc_times_coalesced_axis_angle", 3813), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::TimesCoalesced, Store::AxisAngle)), subgroups: false },
    KernelCode { kernel: Kernel::ArcTimesCoalescedEuler, storage: ("arc_times_coalesced_euler", 4706), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::TimesCoalesced, Store::Euler)), subgroups: false },
    KernelCode { kernel: Kernel::ArcTimesCoalescedF16, storage: ("arc_times_coalesced_f16", 3030), texels: None, converting: Some(("arc_times_coalesced_f16_converting", 2856)), bindings: &[Read, Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::TimesCoalesced, Store::F16)), subgroups: false },
    KernelCode { kernel: Kernel::ArcTimesCoalescedF32, storage: ("arc_times_coalesced_f32", 2770), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::TimesCoalesced, Store::F32)), subgroups: false },
    KernelCode { kernel: Kernel::ArcTimesCoalescedMatrix3x3, storage: ("arc_times_coalesced_matrix3x3", 3691), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::TimesCoalesced, Store::Matrix3x3)), subgroups: false },
    KernelCode { kernel: Kernel::ArcTimesCoalescedMatrix3x4, storage: ("arc_times_coalesced_matrix3x4", 3729), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::TimesCoalesced, Store::Matrix3x4)), subgroups: false },
    KernelCode { kernel: Kernel::ArcTimesCoalescedSixD, storage: ("arc_times_coalesced_six_d", 3658), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::TimesCoalesced, Store::SixD)), subgroups: false },
    KernelCode { kernel: Kernel::ArcTimesCoalescedSnorm16, storage: ("arc_times_coalesced_snorm16", 2911), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::TimesCoalesced, Store::Snorm16)), subgroups: false },
    KernelCode { kernel: Kernel::ArcTimesCoalescedVector, storage: ("arc_times_coalesced_vector", 3178), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::TimesCoalesced, Store::Vector)), subgroups: false },
    KernelCode { kernel: Kernel::ArcFramesSpreadAxisAngle, storage: ("arc_frames_spread_axis_angle", 4342), texels: None, converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Arc, List::FramesSpread, Store::AxisAngle)), subgroups: false },
    KernelCode { kernel: Kernel::ArcFramesSpreadEuler, storage: ("arc_frames_spread_euler", 5189), texels: None, converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Arc, List::FramesSpread, Store::Euler)), subgroups: false },
    KernelCode { kernel: Kernel::ArcFramesSpreadF16, storage: ("arc_frames_spread_f16", 3555), texels: None, converting: Some(("arc_frames_spread_f16_converting", 3376)), bindings: &[Read, Read, Read, Write], segments: Some((Form::Arc, List::FramesSpread, Store::F16)), subgroups: false },
    KernelCode { kernel: Kernel::ArcFramesSpreadF32, storage: ("arc_frames_spread_f32", 3299), texels: None, converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Arc, List::FramesSpread, Store::F32)), subgroups: false },
    KernelCode { kernel: Kernel::ArcFramesSpreadMatrix3x3, storage: ("arc_frames_spread_matrix3x3", 4170), texels: None, converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Arc, List::FramesSpread, Store::Matrix3x3)), subgroups: false },
    KernelCode { kernel: Kernel::ArcFramesSpreadMatrix3x4, storage: ("arc_frames_spread_matrix3x4", 4204), texels: None, converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Arc, List::FramesSpread, Store::Matrix3x4)), subgroups: false },
    KernelCode { kernel: Kernel::ArcFramesSpreadSixD, storage: ("arc_frames_spread_six_d", 4133), texels: None, converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Arc, List::FramesSpread, Store::SixD)), subgroups: false },
    KernelCode { kernel: Kernel::ArcFramesSpreadSnorm16, storage: ("arc_frames_spread_snorm16", 3436), texels: None, converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Arc, List::FramesSpread, Store::Snorm16)), subgroups: false },
    KernelCode { kernel: Kernel::ArcFramesSpreadVector, storage: ("arc_frames_spread_vector", 3662), texels: None, converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Arc, List::FramesSpread, Store::Vector)), subgroups: false },
    KernelCode { kernel: Kernel::ArcTimesSpreadAxisAngle, storage: ("arc_times_spread_axis_angle", 4429), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::TimesSpread, Store::AxisAngle)), subgroups: false },
    KernelCode { kernel: Kernel::ArcTimesSpreadEuler, storage: ("arc_times_spread_euler", 5267), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::TimesSpread, Store::Euler)), subgroups: false },
    KernelCode { kernel: Kernel::ArcTimesSpreadF16, storage: ("arc_times_spread_f16", 3642), texels: None, converting: Some(("arc_times_spread_f16_converting", 3463)), bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::TimesSpread, Store::F16)), subgroups: false },
    KernelCode { kernel: Kernel::ArcTimesSpreadF32, storage: ("arc_times_spread_f32", 3386), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::TimesSpread, Store::F32)), subgroups: false },
    KernelCode { kernel: Kernel::ArcTimesSpreadMatrix3x3, storage: ("arc_times_spread_matrix3x3", 4248), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::TimesSpread, Store::Matrix3x3)), subgroups: false },
    KernelCode { kernel: Kernel::ArcTimesSpreadMatrix3x4, storage: ("arc_times_spread_matrix3x4", 4286), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::TimesSpread, Store::Matrix3x4)), subgroups: false },
    KernelCode { kernel: Kernel::ArcTimesSpreadSixD, storage: ("arc_times_spread_six_d", 4211), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::TimesSpread, Store::SixD)), subgroups: false },
    KernelCode { kernel: Kernel::ArcTimesSpreadSnorm16, storage: ("arc_times_spread_snorm16", 3523), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::TimesSpread, Store::Snorm16)), subgroups: false },
    KernelCode { kernel: Kernel::ArcTimesSpreadVector, storage: ("arc_times_spread_vector", 3740), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Arc, List::TimesSpread, Store::Vector)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialFramesAxisAngle, storage: ("polynomial_frames_axis_angle", 2583), texels: Some(("polynomial_frames_axis_angle_texels", 2872)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Polynomial, List::Frames, Store::AxisAngle)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialFramesEuler, storage: ("polynomial_frames_euler", 3239), texels: Some(("polynomial_frames_euler_texels", 3520)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Polynomial, List::Frames, Store::Euler)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialFramesF16, storage: ("polynomial_frames_f16", 1792), texels: Some(("polynomial_frames_f16_texels", 2073)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Polynomial, List::Frames, Store::F16)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialFramesF32, storage: ("polynomial_frames_f32", 1536), texels: Some(("polynomial_frames_f32_texels", 1930)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Polynomial, List::Frames, Store::F32)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialFramesMatrix3x3, storage: ("polynomial_frames_matrix3x3", 2224), texels: Some(("polynomial_frames_matrix3x3_texels", 2501)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Polynomial, List::Frames, Store::Matrix3x3)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialFramesMatrix3x4, storage: ("polynomial_frames_matrix3x4", 2262), texels: Some(("polynomial_frames_matrix3x4_texels", 2547)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Polynomial, List::Frames, Store::Matrix3x4)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialFramesSixD, storage: ("polynomial_frames_six_d", 2191), texels: Some(("polynomial_frames_six_d_texels", 2468)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Polynomial, List::Frames, Store::SixD)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialFramesSnorm16, storage: ("polynomial_frames_snorm16", 1673), texels: Some(("polynomial_frames_snorm16_texels", 1954)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Polynomial, List::Frames, Store::Snorm16)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialFramesVector, storage: ("polynomial_frames_vector", 1712), texels: Some(("polynomial_frames_vector_texels", 1993)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Polynomial, List::Frames, Store::Vector)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialTimesAxisAngle, storage: ("polynomial_times_axis_angle", 2648), texels: Some(("polynomial_times_axis_angle_texels", 2968)), converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::Times, Store::AxisAngle)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialTimesEuler, storage: ("polynomial_times_euler", 3300), texels: Some(("polynomial_times_euler_texels", 3616)), converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::Times, Store::Euler)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialTimesF16, storage: ("polynomial_times_f16", 1857), texels: Some(("polynomial_times_f16_texels", 2169)), converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::Times, Store::F16)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialTimesF32, storage: ("polynomial_times_f32", 1601), texels: Some(("polynomial_times_f32_texels", 2026)), converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::Times, Store::F32)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialTimesMatrix3x3, storage: ("polynomial_times_matrix3x3", 2285), texels: Some(("polynomial_times_matrix3x3_texels", 2597)), converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::Times, Store::Matrix3x3)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialTimesMatrix3x4, storage: ("polynomial_times_matrix3x4", 2327), texels: Some(("polynomial_times_matrix3x4_texels", 2643)), converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::Times, Store::Matrix3x4)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialTimesSixD, storage: ("polynomial_times_six_d", 2252), texels: Some(("polynomial_times_six_d_texels", 2564)), converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::Times, Store::SixD)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialTimesSnorm16, storage: ("polynomial_times_snorm16", 1738), texels: Some(("polynomial_times_snorm16_texels", 2050)), converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::Times, Store::Snorm16)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialTimesVector, storage: ("polynomial_times_vector", 1773), texels: Some(("polynomial_times_vector_texels", 2089)), converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::Times, Store::Vector)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialSamplesAxisAngle, storage: ("polynomial_samples_axis_angle", 2262), texels: Some(("polynomial_samples_axis_angle_texels", 2476)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Polynomial, List::Samples, Store::AxisAngle)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialSamplesEuler, storage: ("polynomial_samples_euler", 2926), texels: Some(("polynomial_samples_euler_texels", 3128)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Polynomial, List::Samples, Store::Euler)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialSamplesF16, storage: ("polynomial_samples_f16", 1475), texels: Some(("polynomial_samples_f16_texels", 1681)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Polynomial, List::Samples, Store::F16)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialSamplesF32, storage: ("polynomial_samples_f32", 1215), texels: Some(("polynomial_samples_f32_texels", 1534)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Polynomial, List::Samples, Store::F32)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialSamplesMatrix3x3, storage: ("polynomial_samples_matrix3x3", 1911), texels: Some(("polynomial_samples_matrix3x3_texels", 2109)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Polynomial, List::Samples, Store::Matrix3x3)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialSamplesMatrix3x4, storage: ("polynomial_samples_matrix3x4", 1949), texels: Some(("polynomial_samples_matrix3x4_texels", 2155)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Polynomial, List::Samples, Store::Matrix3x4)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialSamplesSixD, storage: ("polynomial_samples_six_d", 1878), texels: Some(("polynomial_samples_six_d_texels", 2076)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Polynomial, List::Samples, Store::SixD)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialSamplesSnorm16, storage: ("polynomial_samples_snorm16", 1356), texels: Some(("polynomial_samples_snorm16_texels", 1562)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Polynomial, List::Samples, Store::Snorm16)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialSamplesVector, storage: ("polynomial_samples_vector", 1395), texels: Some(("polynomial_samples_vector_texels", 1601)), converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Polynomial, List::Samples, Store::Vector)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialFramesCoalescedAxisAngle, storage: ("polynomial_frames_coalesced_axis_angle", 3368), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::FramesCoalesced, Store::AxisAngle)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialFramesCoalescedEuler, storage: ("polynomial_frames_coalesced_euler", 4265), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::FramesCoalesced, Store::Euler)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialFramesCoalescedF16, storage: ("polynomial_frames_coalesced_f16", 2581), texels: None, converting: Some(("polynomial_frames_coalesced_f16_converting", 2407)), bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::FramesCoalesced, Store::F16)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialFramesCoalescedF32, storage: ("polynomial_frames_coalesced_f32", 2321), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::FramesCoalesced, Store::F32)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialFramesCoalescedMatrix3x3, storage: ("polynomial_frames_coalesced_matrix3x3", 3250), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::FramesCoalesced, Store::Matrix3x3)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialFramesCoalescedMatrix3x4, storage: ("polynomial_frames_coalesced_matrix3x4", 3288), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::FramesCoalesced, Store::Matrix3x4)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialFramesCoalescedSixD, storage: ("polynomial_frames_coalesced_six_d", 3217), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::FramesCoalesced, Store::SixD)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialFramesCoalescedSnorm16, storage: ("polynomial_frames_coalesced_snorm16", 2462), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::FramesCoalesced, Store::Snorm16)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialFramesCoalescedVector, storage: ("polynomial_frames_coalesced_vector", 2733), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::FramesCoalesced, Store::Vector)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialTimesCoalescedAxisAngle, storage: ("polynomial_times_coalesced_axis_angle", 3433), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::TimesCoalesced, Store::AxisAngle)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialTimesCoalescedEuler, storage: ("polynomial_times_coalesced_euler", 4326), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::TimesCoalesced, Store::Euler)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialTimesCoalescedF16, storage: ("polynomial_times_coalesced_f16", 2646), texels: None, converting: Some(("polynomial_times_coalesced_f16_converting", 2472)), bindings: &[Read, Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::TimesCoalesced, Store::F16)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialTimesCoalescedF32, storage: ("polynomial_times_coalesced_f32", 2386), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::TimesCoalesced, Store::F32)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialTimesCoalescedMatrix3x3, storage: ("polynomial_times_coalesced_matrix3x3", 3311), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::TimesCoalesced, Store::Matrix3x3)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialTimesCoalescedMatrix3x4, storage: ("polynomial_times_coalesced_matrix3x4", 3353), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::TimesCoalesced, Store::Matrix3x4)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialTimesCoalescedSixD, storage: ("polynomial_times_coalesced_six_d", 3278), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::TimesCoalesced, Store::SixD)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialTimesCoalescedSnorm16, storage: ("polynomial_times_coalesced_snorm16", 2527), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::TimesCoalesced, Store::Snorm16)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialTimesCoalescedVector, storage: ("polynomial_times_coalesced_vector", 2794), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::TimesCoalesced, Store::Vector)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialFramesSpreadAxisAngle, storage: ("polynomial_frames_spread_axis_angle", 4213), texels: None, converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Polynomial, List::FramesSpread, Store::AxisAngle)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialFramesSpreadEuler, storage: ("polynomial_frames_spread_euler", 5052), texels: None, converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Polynomial, List::FramesSpread, Store::Euler)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialFramesSpreadF16, storage: ("polynomial_frames_spread_f16", 3422), texels: None, converting: Some(("polynomial_frames_spread_f16_converting", 3243)), bindings: &[Read, Read, Read, Write], segments: Some((Form::Polynomial, List::FramesSpread, Store::F16)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialFramesSpreadF32, storage: ("polynomial_frames_spread_f32", 3166), texels: None, converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Polynomial, List::FramesSpread, Store::F32)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialFramesSpreadMatrix3x3, storage: ("polynomial_frames_spread_matrix3x3", 4033), texels: None, converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Polynomial, List::FramesSpread, Store::Matrix3x3)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialFramesSpreadMatrix3x4, storage: ("polynomial_frames_spread_matrix3x4", 4075), texels: None, converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Polynomial, List::FramesSpread, Store::Matrix3x4)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialFramesSpreadSixD, storage: ("polynomial_frames_spread_six_d", 4000), texels: None, converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Polynomial, List::FramesSpread, Store::SixD)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialFramesSpreadSnorm16, storage: ("polynomial_frames_spread_snorm16", 3303), texels: None, converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Polynomial, List::FramesSpread, Store::Snorm16)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialFramesSpreadVector, storage: ("polynomial_frames_spread_vector", 3525), texels: None, converting: None, bindings: &[Read, Read, Read, Write], segments: Some((Form::Polynomial, List::FramesSpread, Store::Vector)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialTimesSpreadAxisAngle, storage: ("polynomial_times_spread_axis_angle", 4300), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::TimesSpread, Store::AxisAngle)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialTimesSpreadEuler, storage: ("polynomial_times_spread_euler", 5130), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::TimesSpread, Store::Euler)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialTimesSpreadF16, storage: ("polynomial_times_spread_f16", 3509), texels: None, converting: Some(("polynomial_times_spread_f16_converting", 3330)), bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::TimesSpread, Store::F16)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialTimesSpreadF32, storage: ("polynomial_times_spread_f32", 3253), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::TimesSpread, Store::F32)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialTimesSpreadMatrix3x3, storage: ("polynomial_times_spread_matrix3x3", 4111), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::TimesSpread, Store::Matrix3x3)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialTimesSpreadMatrix3x4, storage: ("polynomial_times_spread_matrix3x4", 4157), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::TimesSpread, Store::Matrix3x4)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialTimesSpreadSixD, storage: ("polynomial_times_spread_six_d", 4078), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::TimesSpread, Store::SixD)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialTimesSpreadSnorm16, storage: ("polynomial_times_spread_snorm16", 3390), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::TimesSpread, Store::Snorm16)), subgroups: false },
    KernelCode { kernel: Kernel::PolynomialTimesSpreadVector, storage: ("polynomial_times_spread_vector", 3603), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: Some((Form::Polynomial, List::TimesSpread, Store::Vector)), subgroups: false },
    KernelCode { kernel: Kernel::FromKeysArcs, storage: ("from_keys_arcs", 2423), texels: Some(("from_keys_arcs_texels", 2576)), converting: None, bindings: &[Read, Read, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::FromKeysTwoKeys, storage: ("from_keys_two_keys", 3183), texels: Some(("from_keys_two_keys_texels", 3336)), converting: None, bindings: &[Read, Read, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::FromKeysCubics, storage: ("from_keys_cubics", 5760), texels: Some(("from_keys_cubics_texels", 5904)), converting: None, bindings: &[Read, Read, Read, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::PosesAdd, storage: ("poses_add", 3227), texels: None, converting: None, bindings: &[Read, Read, Read, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::PosesBlend, storage: ("poses_blend", 3352), texels: None, converting: None, bindings: &[Read, Read, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::PosesMix, storage: ("poses_mix", 3142), texels: None, converting: None, bindings: &[Read, Read, Read, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::PosesSmooth, storage: ("poses_smooth", 3651), texels: None, converting: None, bindings: &[Read, Read, Read, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::PosesSteps, storage: ("poses_steps", 3372), texels: None, converting: None, bindings: &[Read, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::PosesWorld, storage: ("poses_world", 3404), texels: None, converting: None, bindings: &[Read, Read, ReadWrite], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::CrowdRotations, storage: ("crowd_rotations", 5795), texels: Some(("crowd_rotations_texels", 5881)), converting: None, bindings: &[Read, Read, Read, Read, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::CrowdPlainRotations, storage: ("crowd_plain_rotations", 2408), texels: Some(("crowd_plain_rotations_texels", 2500)), converting: None, bindings: &[Read, Read, Read, Read, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::CrowdLocals, storage: ("crowd_locals", 6392), texels: Some(("crowd_locals_texels", 6478)), converting: None, bindings: &[Read, Read, Read, Read, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::CrowdPlainLocals, storage: ("crowd_plain_locals", 3009), texels: Some(("crowd_plain_locals_texels", 3101)), converting: None, bindings: &[Read, Read, Read, Read, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::CrowdCompactRotations, storage: ("crowd_compact_rotations", 11720), texels: Some(("crowd_compact_rotations_texels", 11802)), converting: None, bindings: &[Read, Read, Read, Read, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::CrowdCompactLocals, storage: ("crowd_compact_locals", 12317), texels: Some(("crowd_compact_locals_texels", 12399)), converting: None, bindings: &[Read, Read, Read, Read, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::CrowdGather, storage: ("crowd_gather", 565), texels: None, converting: None, bindings: &[Read, Read, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::CrowdScatter, storage: ("crowd_scatter", 463), texels: None, converting: None, bindings: &[Read, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::CrowdTimes, storage: ("crowd_times", 2463), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::CrowdWalk, storage: ("crowd_walk", 940), texels: None, converting: None, bindings: &[Read, ReadWrite], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::CrowdWalkAll, storage: ("crowd_walk_all", 1260), texels: None, converting: None, bindings: &[Read, ReadWrite], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::CrowdSkin, storage: ("crowd_skin", 767), texels: None, converting: None, bindings: &[Read, ReadWrite], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::CrowdHalf, storage: ("crowd_half", 777), texels: None, converting: None, bindings: &[Read, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::CrowdWholeRotations, storage: ("crowd_whole_rotations", 8639), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Read, Read, Write, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::CrowdPlainWholeRotations, storage: ("crowd_plain_whole_rotations", 5294), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Read, Read, Write, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::CrowdWholeMatrices, storage: ("crowd_whole_matrices", 10662), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Read, Read, Read, Read, Write, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::CrowdPlainWholeMatrices, storage: ("crowd_plain_whole_matrices", 7321), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Read, Read, Read, Read, Write, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::CrowdCompactWholeRotations, storage: ("crowd_compact_whole_rotations", 14552), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Read, Read, Write, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::CrowdSubgroupRotations, storage: ("crowd_subgroup_rotations", 4538), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Read, Read, Write], segments: None, subgroups: true },
    KernelCode { kernel: Kernel::CrowdSubgroupRotationsF16, storage: ("crowd_subgroup_rotations_f16", 4786), texels: None, converting: Some(("crowd_subgroup_rotations_f16_converting", 4619)), bindings: &[Read, Read, Read, Read, Read, Read, Write], segments: None, subgroups: true },
    KernelCode { kernel: Kernel::MotionJoints, storage: ("motion_joints", 8606), texels: None, converting: None, bindings: &[Read, Read, Read, Read, Read, Read, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::MotionWalk, storage: ("motion_walk", 3918), texels: None, converting: None, bindings: &[Read, ReadWrite], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::MotionDifferences, storage: ("motion_differences", 3601), texels: None, converting: None, bindings: &[Read, ReadWrite], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::MotionStore, storage: ("motion_store", 631), texels: None, converting: None, bindings: &[Read, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::MotionMatrices, storage: ("motion_matrices", 1157), texels: None, converting: None, bindings: &[Read, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::MotionTree, storage: ("motion_tree", 5059), texels: None, converting: None, bindings: &[Read, Read, ReadWrite], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::MotionPick, storage: ("motion_pick", 689), texels: None, converting: None, bindings: &[Read, Read, Write], segments: None, subgroups: false },
    KernelCode { kernel: Kernel::PrepareArcs, storage: ("prepare_arcs", 1870), texels: None, converting: None, bindings: &[Read, Read, Write], segments: None, subgroups: false },
];
