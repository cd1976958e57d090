//! The triangles of boxes, curves, axes and the ground.

use glam::{DVec3, Quat, Vec3};
use tumble_routes::mesh::Mesh;

use crate::commands::travel::Travel;
use crate::messages::colours::{AXES, BOXES, Colour};

/// The direction of the sun.
pub(crate) const SUN: Vec3 = Vec3::new(0.371_390_68, 0.742_781_35, 0.557_086);

/// A triangle, counterclockwise seen from the side that its normal shows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Face {
    pub(crate) corners: [Vec3; 3],
    /// The normal for lighting; `None` if the colour is used unchanged.
    pub(crate) normal: Option<Vec3>,
    pub(crate) colour: Colour,
    /// Whether it is seen from behind too.
    pub(crate) two_sided: bool,
}

impl Face {
    /// Its colour in the light of the sky from above, the light reflected from below, and the sun.
    pub(crate) fn shade(&self) -> Colour {
        let Some(normal) = self.normal else {
            return self.colour;
        };
        let light = 0.5 + 0.14 * normal.y + 0.5 * normal.dot(SUN).max(0.0);
        self.colour
            .map(|channel| (f32::from(channel) * light).min(255.0) as u8)
    }

    /// Its shadow on a level floor.
    pub(crate) fn shadow(&self, floor: f32, colour: Colour) -> Self {
        Self {
            corners: self
                .corners
                .map(|corner| corner - SUN * ((corner.y - floor) / SUN.y)),
            normal: None,
            colour,
            two_sided: true,
        }
    }
}

/// Corners of the sides of a box, each counterclockwise seen from outside, and its normal: the corners'
/// signs tell which end of each axis they are at.
pub(crate) const SIDES: [([Vec3; 4], Vec3); 6] = {
    const fn corner(x: f32, y: f32, z: f32) -> Vec3 {
        Vec3::new(x, y, z)
    }
    let [a, b, c, d] = [
        corner(-1.0, -1.0, -1.0),
        corner(1.0, -1.0, -1.0),
        corner(1.0, -1.0, 1.0),
        corner(-1.0, -1.0, 1.0),
    ];
    let [e, f, g, h] = [
        corner(-1.0, 1.0, -1.0),
        corner(1.0, 1.0, -1.0),
        corner(1.0, 1.0, 1.0),
        corner(-1.0, 1.0, 1.0),
    ];
    [
        ([a, b, c, d], Vec3::NEG_Y),
        ([h, g, f, e], Vec3::Y),
        ([d, c, g, h], Vec3::Z),
        ([b, a, e, f], Vec3::NEG_Z),
        ([c, b, f, g], Vec3::X),
        ([a, d, h, e], Vec3::NEG_X),
    ]
};

/// A box, relative to the position that it moves with.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Body {
    centre: Vec3,
    half: Vec3,
    /// The rotation from the box's axes to the axes that rotations apply to.
    rotation: Quat,
    /// Whether its top and bottom are distinguished: a light roof, a dark floor.
    is_marked: bool,
}

impl Body {
    /// A box of a chain, of length 1, that hangs from its position.
    pub(crate) fn hanging(breadth: f32) -> Self {
        Self {
            centre: Vec3::new(0.0, -0.48, 0.0),
            half: Vec3::new(breadth, 0.96, breadth) / 2.0,
            rotation: Quat::IDENTITY,
            is_marked: false,
        }
    }

    /// A box that moves along z with y up, before `rotation`.
    pub(crate) fn going(length: f32, stands: bool, rotation: Quat) -> Self {
        let half = Vec3::new(0.3, 0.2, 0.5) * length;
        Self {
            centre: if stands { Vec3::Y * half.y } else { Vec3::ZERO },
            half,
            rotation,
            is_marked: true,
        }
    }

    /// Its corners relative to its position.
    pub(crate) fn corners(&self, rotation: Quat) -> [Vec3; 8] {
        let signs =
            |i: usize| Vec3::from_array([4, 2, 1].map(|bit| if i & bit == 0 { -1.0 } else { 1.0 }));
        std::array::from_fn(|i| rotation * (self.rotation * (self.centre + self.half * signs(i))))
    }

    /// Its sides at a position, in the colour of a track.
    pub(crate) fn faces(
        &self,
        rotation: Quat,
        at: Vec3,
        track: usize,
    ) -> impl Iterator<Item = Face> {
        let (body, orientation) = (*self, rotation * self.rotation);
        let colour = BOXES[track % BOXES.len()];
        SIDES.into_iter().flat_map(move |(side, normal)| {
            let [a, b, c, d] = side.map(|sign| at + orientation * (body.centre + body.half * sign));
            let colour = match body.is_marked {
                true if normal == Vec3::Y => mixed(colour, [255; 3], 0.62),
                true if normal == Vec3::NEG_Y => mixed(colour, [0; 3], 0.6),
                _ => colour,
            };
            let normal = Some(orientation * normal);
            [[a, b, c], [a, c, d]].map(|corners| Face {
                corners,
                normal,
                colour,
                two_sided: false,
            })
        })
    }
}

/// A mix of two colours; `part` 0 is the first.
fn mixed(from: Colour, to: Colour, part: f32) -> Colour {
    let mix = |(a, b): (u8, u8)| f32::from(a) + (f32::from(b) - f32::from(a)) * part;
    std::array::from_fn(|channel| mix((from[channel], to[channel])) as u8)
}

/// A straight bar between two points, with four sides and no ends.
fn bar(from: Vec3, to: Vec3, radius: f32, colour: Colour) -> impl Iterator<Item = Face> {
    let along = (to - from).normalize_or(Vec3::Z);
    let aside = along.any_orthonormal_vector() * radius;
    let over = along.cross(aside);
    let round = [aside, over, -aside, -over];
    // The bar is made slightly longer, so that a row of bars has no gaps at its bends.
    let (from, to) = (from - along * radius * 0.4, to + along * radius * 0.4);
    (0..4).flat_map(move |i| {
        let (one, next) = (round[i], round[(i + 1) % 4]);
        let normal = Some((one + next).normalize_or_zero());
        let [a, b, c, d] = [from + one, from + next, to + next, to + one];
        [[a, b, c], [a, c, d]].map(|corners| Face {
            corners,
            normal,
            colour,
            two_sided: true,
        })
    })
}

/// The curves that bodies of this length move along, with `axes` frames as small axes on each.
pub(crate) fn trails(travel: &Travel, axes: usize, length: f32, ink: Colour) -> Vec<Face> {
    let mut faces = Vec::new();
    for track in 0..travel.tracks.min(MAX_TRAILS) {
        let positions: Vec<Vec3> = travel.line(track).collect();
        for pair in positions.windows(2).filter(|pair| pair[0] != pair[1]) {
            faces.extend(bar(pair[0], pair[1], length * 0.03, ink));
        }
        for sample in travel.evenly(track, axes) {
            let rotation = travel.rotations[sample * travel.tracks + track];
            for (axis, colour) in Vec3::AXES.into_iter().zip(AXES) {
                let end = positions[sample] + rotation * axis * length * 0.55;
                faces.extend(bar(positions[sample], end, length * 0.022, colour));
            }
        }
    }
    faces
}

/// Curves of more bodies than this hide each other.
const MAX_TRAILS: usize = 256;

/// The colours of the first mesh, which is the ground, and of the meshes that stand on it.
const GROUND: Colour = [0xa9, 0xc2, 0x8f];
const OTHERS: Colour = [0x9c, 0x96, 0x90];

/// The triangles of meshes relative to an origin: the ground, and the objects on it.
pub(crate) fn meshes(meshes: &[Mesh], origin: DVec3) -> Vec<Face> {
    let mut faces = Vec::new();
    for (index, mesh) in meshes.iter().enumerate() {
        let colour = if index == 0 { GROUND } else { OTHERS };
        for triangle in mesh.triangles() {
            let corners = triangle.map(|vertex| {
                let corner = mesh.positions()[vertex as usize];
                (corner - origin).as_vec3()
            });
            let [a, b, c] = corners;
            faces.push(Face {
                corners,
                normal: Some((b - a).cross(c - a).normalize_or_zero()),
                colour,
                two_sided: true,
            });
        }
    }
    faces
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A side seen from inside would be missing from the picture.
    #[test]
    fn sides_turn_counterclockwise_about_their_normals() {
        for ([a, b, c, d], normal) in SIDES {
            for (from, over, to) in [(a, b, c), (a, c, d)] {
                let winding = (over - from).cross(to - over);
                assert!(winding.dot(normal) > 0.0, "{normal}");
            }
            assert!(((a + b + c + d) / 4.0).dot(normal) > 0.0, "{normal}");
        }
    }

    /// The position of a box in the picture, and its upward direction.
    #[test]
    fn a_body_goes_along_z_and_stands_on_its_path() {
        let body = Body::going(2.0, true, Quat::IDENTITY);
        let corners = body.corners(Quat::IDENTITY);
        let low = corners.into_iter().reduce(Vec3::min).unwrap();
        let high = corners.into_iter().reduce(Vec3::max).unwrap();
        assert!(low.abs_diff_eq(Vec3::new(-0.6, 0.0, -1.0), 1e-6), "{low}");
        assert!(high.abs_diff_eq(Vec3::new(0.6, 0.8, 1.0), 1e-6), "{high}");
        let drawn = body
            .faces(Quat::IDENTITY, Vec3::X, 0)
            .flat_map(|face| face.corners);
        let (lowest, highest) = drawn.fold((Vec3::MAX, Vec3::MIN), |(lowest, highest), corner| {
            (lowest.min(corner), highest.max(corner))
        });
        assert!(
            lowest.abs_diff_eq(low + Vec3::X, 1e-6) && highest.abs_diff_eq(high + Vec3::X, 1e-6)
        );
    }
}
