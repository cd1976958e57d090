// Written by `cargo run -p tumble-shaders` from the engine's shaders: change those.

// Sine and cosine for |angle| <= pi/2, from operations that every driver rounds
// alike. Minimax polynomials in z = angle², their leading terms exact; the
// approximation is within 5.0e-9 (sine) and 4.4e-10 (cosine).

const SINE_3: f32 = -0.16666656732559204;
const SINE_5: f32 = 0.008333008736371994;
const SINE_7: f32 = -0.00019806048658210784;
const SINE_9: f32 = 2.598925448182854e-6;

const COSINE_2: f32 = -0.5;
const COSINE_4: f32 = 0.041666656732559204;
const COSINE_6: f32 = -0.001388858538120985;
const COSINE_8: f32 = 2.4770179152255878e-5;
const COSINE_10: f32 = -2.620901966565725e-7;

// Sine (x) and cosine (y).
fn sine_cosine(angle: f32) -> vec2f {
    let sines = sine_cosm1(angle, angle * angle);
    return vec2f(sines.x, sines.y + 1.0);
}

// x sin(a)/a and cos(a) - 1, for an angle |a| <= pi/2 that is given by its square z.
fn sine_cosm1(x: f32, z: f32) -> vec2f {
    let sine_tail = ((SINE_9 * z + SINE_7) * z + SINE_5) * z + SINE_3;
    let sine = sine_tail * (z * x) + x;
    let cosine_tail = (((COSINE_10 * z + COSINE_8) * z + COSINE_6) * z + COSINE_4) * z + COSINE_2;
    let cosm1 = cosine_tail * z;
    return vec2f(sine, cosm1);
}

// The same for |angle| <= pi/4, where one term less is enough: within 1.9e-9 and 1.1e-10.
const QUARTER_SINE_3: f32 = -0.16666650772094727;
const QUARTER_SINE_5: f32 = 0.008331983350217342;
const QUARTER_SINE_7: f32 = -0.00019496136519592255;

const QUARTER_COSINE_2: f32 = -0.5;
const QUARTER_COSINE_4: f32 = 0.04166664555668831;
const QUARTER_COSINE_6: f32 = -0.00138873013202101;
const QUARTER_COSINE_8: f32 = 2.4430661142105237e-5;

fn sine_cosm1_quarter(x: f32, z: f32) -> vec2f {
    let zz = z * z;
    let sine_low = QUARTER_SINE_5 * z + QUARTER_SINE_3;
    let sine_tail = QUARTER_SINE_7 * zz + sine_low;
    let zx = z * x;
    let sine = sine_tail * zx + x;
    let cosine_low = QUARTER_COSINE_4 * z + QUARTER_COSINE_2;
    let cosine_high = QUARTER_COSINE_8 * z + QUARTER_COSINE_6;
    let cosine_tail = cosine_high * zz + cosine_low;
    let cosm1 = cosine_tail * z;
    return vec2f(sine, cosm1);
}

// Reciprocal, square root and arc tangent, from operations that every driver rounds alike: a
// first guess by integer arithmetic on the bits, and Newton's steps. Arguments are 0 or at least
// 2^-50 in magnitude, so that no square is subnormal, nor what rounding takes from one; `flushed`
// makes them so.

const RECIPROCAL_SEED: u32 = 0x7ef311c7;
const ROOT_SEED: u32 = 0x5f3759df;
// 2^-50.
const FLUSHED_BITS: u32 = 0x26800000;

// (atan(t)/t - 1)/t² in powers of t², for 0 <= t <= 1; within 6e-8.
const ARC_0: f32 = -0.3333333134651184;
const ARC_1: f32 = 0.19999739527702332;
const ARC_2: f32 = -0.1427856832742691;
const ARC_3: f32 = 0.11033764481544495;
const ARC_4: f32 = -0.08656880259513855;
const ARC_5: f32 = 0.0625016912817955;
const ARC_6: f32 = -0.035871539264917374;
const ARC_7: f32 = 0.01350777130573988;
const ARC_8: f32 = -0.0023869972210377455;

// pi/2 and pi, each as the sum of two f32.
const HALF_PI: f32 = 1.5707963705062866;
const HALF_PI_LOW: f32 = -4.371138828673793e-8;
const PI: f32 = 3.1415927410125732;
const PI_LOW: f32 = -8.742277657347586e-8;
const DEGREES: f32 = 57.295780181884766;

// 0 where the magnitude is below 2^-50.
fn flushed(x: f32) -> f32 {
    return select(x, 0.0, (bitcast<u32>(x) & 0x7fffffffu) < FLUSHED_BITS);
}

fn magnitude(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) & 0x7fffffffu);
}

// 1/x for x > 0.
fn reciprocal(x: f32) -> f32 {
    let seed = bitcast<f32>(RECIPROCAL_SEED - bitcast<u32>(x));
    let first = seed * (2.0 - x * seed);
    let second = first * (2.0 - x * first);
    let third = second * (2.0 - x * second);
    return third * (2.0 - x * third);
}

// 1/√x for x > 0; large at 0.
fn reciprocal_root(x: f32) -> f32 {
    let seed = bitcast<f32>(ROOT_SEED - (bitcast<u32>(x) >> 1u));
    let half = 0.5 * x;
    let first = seed * (1.5 - half * seed * seed);
    let second = first * (1.5 - half * first * first);
    return second * (1.5 - half * second * second);
}

fn root(x: f32) -> f32 {
    let near = x * reciprocal_root(x);
    // One more Newton step, on the root itself.
    return near + (x - near * near) * (0.5 * reciprocal_root(x));
}

// The angle of the point (along, up), neither of which is negative, from 0 to pi/2; 0 for (0, 0).
fn acute_arc_tangent(up: f32, along: f32) -> f32 {
    let steep = up > along;
    let large = select(along, up, steep);
    let small = select(up, along, steep);
    let divisor = select(large, 1.0, large == 0.0);
    let inverse = reciprocal(divisor);
    let near = small * inverse;
    let t = near + (small - near * divisor) * inverse;
    let z = t * t;
    let high = (((ARC_8 * z + ARC_7) * z + ARC_6) * z + ARC_5) * z + ARC_4;
    let tail = (((high * z + ARC_3) * z + ARC_2) * z + ARC_1) * z + ARC_0;
    let flat = tail * (z * t) + t;
    return select(flat, (HALF_PI - flat) + HALF_PI_LOW, steep);
}

// The angle of the point (x, y), from -pi to pi; 0 for (0, 0).
fn arc_tangent(y: f32, x: f32) -> f32 {
    let acute = acute_arc_tangent(magnitude(y), magnitude(x));
    let obtuse = select(acute, (PI - acute) + PI_LOW, x < 0.0);
    return select(obtuse, -obtuse, y < 0.0);
}
