//! Winds faces alike: neighbours run through their common edge in opposite directions.

use crate::mesh::links::{Links, MANY, NONE, at};

/// The result of [`wind_alike`].
pub(super) struct Rewinding {
    /// Number of triangles that were reversed.
    pub(super) count: usize,
    /// Whether faces cannot be wound alike, as in a Möbius strip.
    pub(super) is_one_sided: bool,
}

/// Reverses triangles until neighbours agree, and as few in each piece as possible. Edges of three faces separate
/// pieces.
pub(super) fn wind_alike(vertices: usize, faces: &mut [[u32; 3]]) -> Rewinding {
    let links = Links::new(vertices, faces);
    // Whether a face has the opposite orientation of the first face of its piece; unknown at first.
    let mut against: Vec<Option<bool>> = vec![None; faces.len()];
    let mut rewinding = Rewinding {
        count: 0,
        is_one_sided: false,
    };
    for first in 0..faces.len() {
        if against[first].is_some() {
            continue;
        }
        against[first] = Some(false);
        let mut piece = vec![first];
        let mut done = 0;
        while let Some(&face) = piece.get(done) {
            done += 1;
            let is_against = against[face] == Some(true);
            for half_edge in 3 * face as u32..3 * face as u32 + 3 {
                let twin = links.twin(half_edge);
                if twin == NONE || twin == MANY {
                    continue;
                }
                let same_direction = at(faces, twin) == at(faces, half_edge);
                let other = &mut against[twin as usize / 3];
                match *other {
                    None => {
                        *other = Some(is_against != same_direction);
                        piece.push(twin as usize / 3);
                    }
                    Some(known) => {
                        rewinding.is_one_sided |= known != (is_against != same_direction);
                    }
                }
            }
        }
        let count = piece
            .iter()
            .filter(|&&face| against[face] == Some(true))
            .count();
        let reverses_against = 2 * count <= piece.len();
        rewinding.count += if reverses_against {
            count
        } else {
            piece.len() - count
        };
        for face in piece {
            if (against[face] == Some(true)) == reverses_against {
                faces[face].swap(1, 2);
            }
        }
    }
    rewinding
}
