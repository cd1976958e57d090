//! Faces are wound alike: neighbours run through their common edge in opposite directions.

use crate::mesh::links::{Links, MANY, NONE, at};

/// What came of it.
pub(super) struct Turned {
    /// Triangles that were turned.
    pub(super) count: usize,
    /// There is no way to wind all alike: a Möbius strip.
    pub(super) is_one_sided: bool,
}

/// Turns triangles until neighbours agree, as few in each piece as will do. Edges of three faces
/// part the pieces.
pub(super) fn turn_alike(vertices: usize, faces: &mut [[u32; 3]]) -> Turned {
    let links = Links::new(vertices, faces);
    // Whether a face runs against the first of its piece; unknown at first.
    let mut against: Vec<Option<bool>> = vec![None; faces.len()];
    let mut turned = Turned {
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
            let own = against[face] == Some(true);
            for half_edge in 3 * face as u32..3 * face as u32 + 3 {
                let twin = links.twin(half_edge);
                if twin == NONE || twin == MANY {
                    continue;
                }
                let same_way = at(faces, twin) == at(faces, half_edge);
                let other = &mut against[twin as usize / 3];
                match *other {
                    None => {
                        *other = Some(own != same_way);
                        piece.push(twin as usize / 3);
                    }
                    Some(known) => turned.is_one_sided |= known != (own != same_way),
                }
            }
        }
        let count = piece
            .iter()
            .filter(|&&face| against[face] == Some(true))
            .count();
        let turn = 2 * count <= piece.len();
        turned.count += if turn { count } else { piece.len() - count };
        for face in piece {
            if (against[face] == Some(true)) == turn {
                faces[face].swap(1, 2);
            }
        }
    }
    turned
}
