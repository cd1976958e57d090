//! Rotations of a block, component by component; loops over them without branches are compiled for the vector width.

use crate::simd::lanes::Lanes;

/// The number of rotations that are processed together, so that several vectors of each component are in flight.
pub(crate) const BLOCK: usize = 64;

/// A row for each of `x y z w`.
pub(crate) type Components = [[f32; BLOCK]; 4];

#[inline(always)]
pub(crate) fn at(components: &Components, lane: usize) -> [f32; 4] {
    let [x, y, z, w] = components;
    [x[lane], y[lane], z[lane], w[lane]]
}

#[inline(always)]
pub(crate) fn put(components: &mut Components, lane: usize, value: [f32; 4]) {
    for (row, component) in components.iter_mut().zip(value) {
        row[lane] = component;
    }
}

/// Separates the components of the first rotations, at most a block. The rest of the block does not change.
#[inline(always)]
pub(crate) fn take_apart<L: Lanes>(rotations: &[[f32; 4]], components: &mut Components) {
    let whole = rotations.len().min(BLOCK) / L::COUNT * L::COUNT;
    for lane in (0..whole).step_by(L::COUNT) {
        let loaded = L::load_rotations(&rotations[lane..]);
        for (row, vector) in components.iter_mut().zip(loaded) {
            vector.store(&mut row[lane..][..L::COUNT]);
        }
    }
    for (lane, &rotation) in rotations.iter().enumerate().take(BLOCK).skip(whole) {
        put(components, lane, rotation);
    }
}

/// Joins the components of the first rotations of a block, up to the length of `rotations`.
#[inline(always)]
pub(crate) fn put_together<L: Lanes>(components: &Components, rotations: &mut [[f32; 4]]) {
    let [x, y, z, w] = components;
    let whole = rotations.len().min(BLOCK) / L::COUNT * L::COUNT;
    for lane in (0..whole).step_by(L::COUNT) {
        let vectors = [
            L::load(&x[lane..]),
            L::load(&y[lane..]),
            L::load(&z[lane..]),
            L::load(&w[lane..]),
        ];
        L::store_rotations(vectors, &mut rotations[lane..][..L::COUNT]);
    }
    for (lane, rotation) in rotations.iter_mut().enumerate().take(BLOCK).skip(whole) {
        *rotation = at(components, lane);
    }
}
