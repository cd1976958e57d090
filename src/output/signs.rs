//! The one rule of signs. `q` and `-q` are one rotation, but a player that joins samples without a
//! test goes the long way round where neighbours differ in sign: of the two, whatever is written has
//! the one that is nearer to the sample of the track before it.

use glam::Quat;

/// Of half the angle between two rotations; negative where their signs differ.
#[inline]
fn cosine(a: Quat, b: Quat) -> f32 {
    (a.x * b.x + a.y * b.y) + (a.z * b.z + a.w * b.w)
}

/// Gives each rotation, in the order `[sample][track]`, the sign that is nearer to the sample before.
pub fn continue_signs(rotations: &mut [Quat], tracks: usize) {
    for next in tracks..rotations.len() {
        if cosine(rotations[next - tracks], rotations[next]) < 0.0 {
            rotations[next] = -rotations[next];
        }
    }
}

/// Whether [`continue_signs`] would change any of them.
#[must_use]
pub fn signs_jump(rotations: &[Quat], tracks: usize) -> bool {
    let after = rotations.get(tracks..).unwrap_or_default();
    // Without a branch for each: lists are long, and seldom jump.
    let (before, rest) = (rotations.chunks(BLOCK), after.chunks(BLOCK));
    before.zip(rest).any(|(before, after)| {
        let least = before.iter().zip(after).fold(0.0f32, |least, (a, b)| {
            let cosine = cosine(*a, *b);
            if cosine < least { cosine } else { least }
        });
        least < 0.0
    })
}

/// Rotations that are compared before it is asked whether any sign jumps.
const BLOCK: usize = 64;
