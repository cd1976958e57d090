// Sine and cosine for |angle| <= pi/2, from operations that every driver rounds
// alike. Minimax polynomials in z = angle², their leading terms exact; the
// approximation is within 5.0e-9 (sine) and 4.4e-10 (cosine).
// Twin: src/twin/sine_cosine.rs.

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
