//! Boxes on a floor, drawn by a small rasteriser with a depth buffer.

use std::io;

use euc::Pipeline;
use euc::buffer::Buffer2d;
use euc::rasterizer::{BackfaceCullingEnabled, Lines, Triangles};
use glam::camera::rh::proj::directx;
use glam::camera::rh::view::look_at_mat4;
use glam::{EulerRot, Mat4, Quat, Vec2, Vec3, Vec4};
use rayon::prelude::*;
use tumble::{Method, WorldPoses};

use crate::commands::picture::halved;
use crate::commands::render::film::overlay;
use crate::messages::colours::{BOXES, Colour};

/// How many times finer a picture is drawn than it becomes, to be smooth.
const FINER: u32 = 2;
/// Height of the picture's cone of sight, degrees.
const SIGHT: f32 = 38.0;
/// Of a box that is 1 long.
const BREADTH: f32 = 0.28;
/// Twice the area of the smallest triangle that is drawn, the picture being 2 × 2.
const SEEN: f32 = 1e-9;
/// Frames drawn at once, by all threads.
const AT_ONCE: usize = 32;

/// From where to look, degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct View {
    pub(crate) around: f32,
    pub(crate) above: f32,
}

/// The colours of ground and floor.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Theme {
    ground: Colour,
    floor: Colour,
    ink: Colour,
}

impl Theme {
    pub(crate) const LIGHT: Self = Self {
        ground: [0xff, 0xff, 0xff],
        floor: [0xc8, 0xce, 0xd6],
        ink: [0x22, 0x26, 0x2b],
    };
    pub(crate) const DARK: Self = Self {
        ground: [0x1d, 0x21, 0x27],
        floor: [0x45, 0x4d, 0x57],
        ink: [0xe8, 0xea, 0xed],
    };
}

/// A chain, and the method that moves it.
pub(crate) struct Actor {
    pub(crate) method: Method,
    pub(crate) poses: WorldPoses,
}

/// Everything that is drawn, and the camera that sees all of it.
pub(crate) struct Scene {
    actors: Vec<Actor>,
    /// How far each is moved aside.
    shifts: Vec<Vec3>,
    size: (u32, u32),
    camera: Mat4,
    /// Ground and floor, which every frame begins with.
    colour: Buffer2d<Colour>,
    depth: Buffer2d<f32>,
    labels: overlay::Labels,
}

/// Draws flat colours at places that the camera has seen already.
struct Flat;

impl Pipeline for Flat {
    type Vertex = (Vec4, Colour);
    type VsOut = Shade;
    type Pixel = Colour;

    fn vert(&self, (place, colour): &Self::Vertex) -> ([f32; 4], Shade) {
        (place.to_array(), Shade(*colour))
    }

    fn frag(&self, shade: &Shade) -> Colour {
        shade.0
    }
}

/// A colour that is the same at all corners of a triangle.
#[derive(Clone)]
struct Shade(Colour);

impl euc::Interpolate for Shade {
    fn lerp2(a: Self, _: Self, _: f32, _: f32) -> Self {
        a
    }

    fn lerp3(a: Self, _: Self, _: Self, _: f32, _: f32, _: f32) -> Self {
        a
    }
}

/// Corners of the sides of a box, each counterclockwise seen from outside, and its normal.
const SIDES: [([Vec3; 4], Vec3); 6] = {
    const fn corner(x: f32, y: f32, z: f32) -> Vec3 {
        Vec3::new(x, y, z)
    }
    let [a, b, c, d] = [
        corner(-0.5, -1.0, -0.5),
        corner(0.5, -1.0, -0.5),
        corner(0.5, -1.0, 0.5),
        corner(-0.5, -1.0, 0.5),
    ];
    let [e, f, g, h] = [
        corner(-0.5, 0.0, -0.5),
        corner(0.5, 0.0, -0.5),
        corner(0.5, 0.0, 0.5),
        corner(-0.5, 0.0, 0.5),
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

impl Scene {
    /// The poses of all actors have the same boxes, 1 long, and samples, at least one of each.
    pub(crate) fn new(
        actors: Vec<Actor>,
        size: (u32, u32),
        view: View,
        theme: Theme,
    ) -> io::Result<Self> {
        let ends = ends(&actors);
        let (low, high) = ends
            .iter()
            .fold((Vec3::MAX, Vec3::MIN), |(low, high), end| {
                (low.min(*end), high.max(*end))
            });
        let (around, above) = (view.around.to_radians(), view.above.to_radians());
        let turn = Quat::from_euler(EulerRot::YXZ, around, -above, 0.0);
        // Chains stand beside each other as they are seen.
        let right = turn * Vec3::X;
        let sides = ends.iter().map(|end| end.dot(right));
        let (left_end, right_end) = sides.fold((f32::MAX, f32::MIN), |(left, right), side| {
            (left.min(side), right.max(side))
        });
        let apart = right_end - left_end + 0.8;
        let middle = (actors.len() - 1) as f32 / 2.0;
        let shifts: Vec<Vec3> = (0..actors.len())
            .map(|i| right * (i as f32 - middle) * apart)
            .collect();
        let centre = (low + high) / 2.0;
        let aspect = size.0 as f32 / size.1 as f32;
        let upright = (SIGHT.to_radians() / 2.0).tan() * 0.92;
        let mut distance = 1.0f32;
        for end in &ends {
            for shift in &shifts {
                let seen = turn.inverse() * (*end - centre + *shift);
                let breadth = BREADTH * 0.7;
                let across = Vec2::new((seen.x.abs() + breadth) / aspect, seen.y.abs() + breadth);
                let across = across / upright;
                distance = distance.max(seen.z + across.max_element());
            }
        }
        let radius = (high - low).length() / 2.0 + shifts[0].length();
        let eye = centre + turn * Vec3::Z * distance;
        let near = distance / 50.0;
        let camera =
            directx::perspective(SIGHT.to_radians(), aspect, near, distance + radius * 40.0)
                * look_at_mat4(eye, centre, Vec3::Y);
        let fine = [(size.0 * FINER) as usize, (size.1 * FINER) as usize];
        let mut colour = Buffer2d::new(fine, theme.ground);
        let mut depth = Buffer2d::new(fine, 1.0);
        let floor = Vec3::new(centre.x, low.y - 0.15, centre.z);
        for line in grid(camera, floor, radius) {
            let ends = line.map(|end| (camera * end.extend(1.0), theme.floor));
            Flat.draw::<Lines<_>, _>(&ends, &mut colour, Some(&mut depth));
        }
        let place = |shift: &Vec3| {
            let at = camera * (centre + *shift).extend(1.0);
            (at.x / at.w + 1.0) / 2.0
        };
        let names = actors.iter().map(|actor| actor.method.name);
        let labels = overlay::Labels::new(names.zip(shifts.iter().map(place)), size, theme.ink)?;
        Ok(Self {
            actors,
            shifts,
            size,
            camera,
            colour,
            depth,
            labels,
        })
    }

    fn frames(&self) -> usize {
        self.actors.first().map_or(0, |actor| actor.poses.samples())
    }

    /// Draws every frame, several at once, and hands them over in order.
    pub(crate) fn each_frame<E: Send>(
        &self,
        mut take: impl FnMut(usize, &[u8]) -> Result<(), E>,
    ) -> Result<(), E> {
        let frames: Vec<usize> = (0..self.frames()).collect();
        for some in frames.chunks(AT_ONCE) {
            let drawn: Vec<Vec<u8>> = some.par_iter().map(|&frame| self.pixels(frame)).collect();
            for (&frame, pixels) in some.iter().zip(&drawn) {
                take(frame, pixels)?;
            }
        }
        Ok(())
    }

    /// Pixels of some frames, for a palette.
    pub(crate) fn sample_colours(&self) -> Vec<u8> {
        let each = self.frames().div_ceil(8).max(1);
        let some: Vec<usize> = (0..self.frames()).step_by(each).collect();
        some.par_iter()
            .flat_map(|&frame| self.pixels(frame))
            .collect()
    }

    /// One frame: red, green, blue.
    fn pixels(&self, frame: usize) -> Vec<u8> {
        let mut colour = self.colour.clone();
        let mut depth = self.depth.clone();
        let mut corners = Vec::new();
        for (actor, &shift) in self.actors.iter().zip(&self.shifts) {
            for track in 0..actor.poses.tracks() {
                let (Some(turn), Some(hung)) = (
                    actor.poses.rotation(track, frame),
                    actor.poses.position(track, frame),
                ) else {
                    continue;
                };
                let at = hung + shift;
                let colour = BOXES[track % BOXES.len()];
                block(&mut corners, self.camera, turn, at, colour);
            }
        }
        type Solid<'a> = Triangles<'a, Buffer2d<f32>, BackfaceCullingEnabled>;
        Flat.draw::<Solid<'_>, _>(&corners, &mut colour, Some(&mut depth));
        let fine: &[u8] = bytemuck::cast_slice(colour.as_ref());
        let mut pixels = halved(fine, (self.size.0 * FINER) as usize);
        self.labels.put(&mut pixels);
        pixels
    }
}

/// Every end of a box at some samples.
fn ends(actors: &[Actor]) -> Vec<Vec3> {
    let mut ends = Vec::new();
    for actor in actors {
        let poses = &actor.poses;
        for sample in (0..poses.samples()).step_by(poses.samples().div_ceil(200).max(1)) {
            for track in 0..poses.tracks() {
                let (turn, hung) = (poses.rotation(track, sample), poses.position(track, sample));
                if let (Some(turn), Some(hung)) = (turn, hung) {
                    ends.extend([hung, hung + turn * Vec3::NEG_Y]);
                }
            }
        }
    }
    ends
}

/// The triangles of a box that hangs at a place, but not those that show their back or
/// nothing of themselves.
fn block(corners: &mut Vec<(Vec4, Colour)>, camera: Mat4, turn: Quat, at: Vec3, colour: Colour) {
    let extent = Vec3::new(BREADTH, 0.96, BREADTH);
    let sun = Vec3::new(2.0, 4.0, 3.0).normalize();
    for (side, normal) in SIDES {
        let normal = turn * normal;
        // The sky from above, its light thrown back from below, and the sun.
        let light = 0.5 + 0.14 * normal.y + 0.5 * normal.dot(sun).max(0.0);
        let shade = colour.map(|channel| (f32::from(channel) * light).min(255.0) as u8);
        let [a, b, c, d] = side.map(|corner| camera * (at + turn * (corner * extent)).extend(1.0));
        for triangle in [[a, b, c], [a, c, d]] {
            let [p, q, r] = triangle.map(|corner| Vec2::new(corner.x, corner.y) / corner.w);
            if (q - p).perp_dot(r - p) > SEEN {
                corners.extend(triangle.map(|corner| (corner, shade)));
            }
        }
    }
}

/// Lines of the floor, cut off before they reach the eye.
fn grid(camera: Mat4, middle: Vec3, radius: f32) -> Vec<[Vec3; 2]> {
    let step = (radius * 4.0 / 24.0).max(1.0).ceil();
    let half = (radius * 3.0 / step).ceil().clamp(4.0, 64.0) as i32;
    let reach = half as f32 * step;
    let mut lines = Vec::new();
    for place in -half..=half {
        let aside = place as f32 * step;
        for (along, across) in [(Vec3::X, Vec3::Z), (Vec3::Z, Vec3::X)] {
            let through = middle + across * aside;
            lines.extend(visible(
                camera,
                through - along * reach,
                through + along * reach,
            ));
        }
    }
    lines
}

/// The part of a line that lies before the eye.
fn visible(camera: Mat4, start: Vec3, end: Vec3) -> Option<[Vec3; 2]> {
    let depth = |point: Vec3| -> f32 {
        let seen: Vec4 = camera * point.extend(1.0);
        seen.z
    };
    let (first, second) = (depth(start), depth(end));
    let cut = || start + (end - start) * (first / (first - second));
    match (first > 0.0, second > 0.0) {
        (true, true) => Some([start, end]),
        (true, false) => Some([start, start + (cut() - start) * 0.999]),
        (false, true) => Some([end + (cut() - end) * 0.999, end]),
        (false, false) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A side seen from inside would be missing from the picture.
    #[test]
    fn sides_turn_counterclockwise_about_their_normals() {
        for ([a, b, c, d], normal) in SIDES {
            for (from, over, to) in [(a, b, c), (a, c, d)] {
                let turned = (over - from).cross(to - over);
                assert!(turned.dot(normal) > 0.0, "{normal}");
            }
            let outward = (a + b + c + d) / 4.0 - Vec3::new(0.0, -0.5, 0.0);
            assert!(outward.dot(normal) > 0.0, "{normal}");
        }
    }
}
