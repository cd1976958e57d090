// An arc as a polynomial, into which smooth methods turn a track of two keys: the Taylor series of
// cosine and sine about the middle.
// Twin: src/fit/constant_velocity.rs.

// 1/2!, 1/3!, 1/4! …, with the signs that they have in the series.
const SERIES_2: f32 = -0.5;
const SERIES_3: f32 = -0.16666667;
const SERIES_4: f32 = 0.041666668;
const SERIES_5: f32 = 0.008333334;
const SERIES_6: f32 = -0.0013888889;
const SERIES_7: f32 = -0.0001984127;
const SERIES_8: f32 = 0.000024801588;
const SERIES_9: f32 = 0.0000027557319;
const SERIES_10: f32 = -0.00000027557319;

// The coefficients of 1, s, s², … s¹⁰.
fn constant_velocity(arc: ArcSegment) -> array<vec4f, 11> {
    let square = norm_squared(arc.tangent);
    let even_2 = arc.middle * square;
    let odd_3 = arc.tangent * square;
    let even_4 = even_2 * square;
    let odd_5 = odd_3 * square;
    let even_6 = even_4 * square;
    let odd_7 = odd_5 * square;
    let even_8 = even_6 * square;
    let odd_9 = odd_7 * square;
    return array(
        arc.middle,
        canonical(arc.tangent),
        canonical(even_2 * SERIES_2),
        canonical(odd_3 * SERIES_3),
        canonical(even_4 * SERIES_4),
        canonical(odd_5 * SERIES_5),
        canonical(even_6 * SERIES_6),
        canonical(odd_7 * SERIES_7),
        canonical(even_8 * SERIES_8),
        canonical(odd_9 * SERIES_9),
        canonical(even_8 * square * SERIES_10),
    );
}
