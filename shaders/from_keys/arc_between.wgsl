// The arc between two unit quaternions that are at most pi/2 apart in R⁴, about its middle.
//
// Let x = sin²(theta/2), a quarter of the squared length of their difference. Half of their sum is
// cos(theta/2) times the middle, and the difference is sin(theta/2)/(theta/2) times the tangent.
// The factors that lengthen both are polynomials of x up to 1/2: no root, no arc function, and
// nothing that is 0/0 where the keys are equal. They are within 8.3e-9 and 2.2e-9 of the exact
// factors.
// Twin: src/twin/arc_between.rs.

const SECANT_1: f32 = 0.5000020265579224;
const SECANT_2: f32 = 0.37484171986579895;
const SECANT_3: f32 = 0.3166930079460144;
const SECANT_4: f32 = 0.21955731511116028;
const SECANT_5: f32 = 0.6317541599273682;
const SECANT_6: f32 = -1.4024842977523804;
const SECANT_7: f32 = 4.277366638183594;
const SECANT_8: f32 = -5.467312335968018;
const SECANT_9: f32 = 3.7398531436920166;

const ARC_SINE_1: f32 = 0.16666622459888458;
const ARC_SINE_2: f32 = 0.07502682507038116;
const ARC_SINE_3: f32 = 0.044081781059503555;
const ARC_SINE_4: f32 = 0.03599119558930397;
const ARC_SINE_5: f32 = -0.00805768184363842;
const ARC_SINE_6: f32 = 0.11032986640930176;
const ARC_SINE_7: f32 = -0.13996805250644684;
const ARC_SINE_8: f32 = 0.12611471116542816;

fn arc_between(start: vec4f, end: vec4f) -> ArcSegment {
    let half = (start + end) * 0.5;
    let difference = end - start;
    let x = norm_squared(difference) * 0.25;
    // Neighbouring powers are added in pairs (Estrin's scheme), which halves the chains of
    // operations.
    let xx = x * x;
    let secant_7 = SECANT_8 * x + SECANT_7;
    let secant_5 = SECANT_6 * x + SECANT_5;
    let secant_3 = SECANT_4 * x + SECANT_3;
    let secant_1 = SECANT_2 * x + SECANT_1;
    let secant_high = (SECANT_9 * xx + secant_7) * xx + secant_5;
    let secant = ((secant_high * xx + secant_3) * xx + secant_1) * x;
    let sine_7 = ARC_SINE_8 * x + ARC_SINE_7;
    let sine_5 = ARC_SINE_6 * x + ARC_SINE_5;
    let sine_3 = ARC_SINE_4 * x + ARC_SINE_3;
    let sine_1 = ARC_SINE_2 * x + ARC_SINE_1;
    let arc_sine = (((sine_7 * xx + sine_5) * xx + sine_3) * xx + sine_1) * x;
    return ArcSegment(
        canonical(half * secant + half),
        canonical(difference * arc_sine + difference),
    );
}
