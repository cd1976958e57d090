//! Bodies on a floor or on the ground, drawn by a small rasteriser with a depth buffer.

use std::io;

use euc::Pipeline;
use euc::buffer::Buffer2d;
use euc::rasterizer::{BackfaceCullingEnabled, Lines, Triangles};
use glam::camera::rh::proj::directx;
use glam::camera::rh::view::look_at_mat4;
use glam::{EulerRot, Mat4, Quat, Vec2, Vec3, Vec4};
use rayon::prelude::*;

use crate::commands::picture::halved;
use crate::commands::render::bones::{Bones, Skin};
use crate::commands::render::film::overlay;
use crate::commands::render::solids::{Body, Face};
use crate::messages::colours::Colour;
use crate::threads::on_threads;

/// The supersampling factor along each side, for smooth edges.
const FINER: u32 = 2;
/// Height of the picture's cone of sight, degrees.
const SIGHT: f32 = 38.0;
/// Twice the area of the smallest triangle that is drawn, the picture being 2 × 2.
const SEEN: f32 = 1e-9;
/// Frames drawn at once, by all threads.
const AT_ONCE: usize = 32;

/// From where to look, degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CameraView {
    pub(crate) around: f32,
    pub(crate) above: f32,
}

/// The colours of background and floor.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Theme {
    ground: Colour,
    floor: Colour,
    shadow: Colour,
    pub(crate) ink: Colour,
}

impl Theme {
    pub(crate) const LIGHT: Self = Self {
        ground: [0xff, 0xff, 0xff],
        floor: [0xc8, 0xce, 0xd6],
        shadow: [0xdb, 0xdf, 0xe4],
        ink: [0x22, 0x26, 0x2b],
    };
    pub(crate) const DARK: Self = Self {
        ground: [0x1d, 0x21, 0x27],
        floor: [0x45, 0x4d, 0x57],
        shadow: [0x12, 0x15, 0x19],
        ink: [0xe8, 0xea, 0xed],
    };
}

/// Bodies, with the curves that are drawn in every frame.
pub(crate) struct Actor {
    pub(crate) name: String,
    pub(crate) tracks: usize,
    /// `[frame][track]`.
    pub(crate) rotations: Vec<Quat>,
    /// `[frame][track]`.
    pub(crate) positions: Vec<Vec3>,
    pub(crate) shape: Shape,
    /// The curves that bodies follow, which cast shadows on the floor.
    pub(crate) trails: Vec<Face>,
    /// The points that must be visible; the camera looks at their middle.
    pub(crate) reach: Vec<Vec3>,
}

/// The shape by which the tracks of an actor are drawn.
pub(crate) enum Shape {
    /// A box for each.
    Boxes(Body),
    /// The bones of a skeleton.
    Bones(Bones),
    /// A mesh that follows the joints.
    Skin(Skin),
}

impl Actor {
    /// All that moves, at a frame.
    fn faces(&self, frame: usize) -> Vec<Face> {
        let tracks = frame * self.tracks..(frame + 1) * self.tracks;
        let (rotations, positions) = (&self.rotations[tracks.clone()], &self.positions[tracks]);
        match &self.shape {
            Shape::Boxes(body) => {
                let each = rotations.iter().zip(positions).enumerate();
                each.flat_map(|(track, (&rotation, &at))| body.faces(rotation, at, track))
                    .collect()
            }
            Shape::Bones(bones) => bones.faces(rotations, positions),
            Shape::Skin(skin) => skin.faces(frame),
        }
    }
}

/// Everything in a scene besides the actors.
pub(crate) struct Surroundings {
    /// The ground, instead of a floor.
    pub(crate) ground: Vec<Face>,
    /// The length of a body.
    pub(crate) length: f32,
    /// How far bodies extend beyond the positions in `reach`.
    pub(crate) margin: f32,
    /// Whether bodies cast shadows on the floor.
    pub(crate) shadows: bool,
}

/// The options of a picture that do not depend on its scene.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Style {
    pub(crate) size: (u32, u32),
    pub(crate) view: CameraView,
    pub(crate) theme: Theme,
}

/// Everything that is drawn, and the camera that sees all of it.
pub(crate) struct Scene {
    actors: Vec<Actor>,
    /// How far each actor is moved aside.
    shifts: Vec<Vec3>,
    style: Style,
    camera: Camera,
    /// The height of the floor that shadows fall on.
    shadowed: Option<f32>,
    /// The picture of the ground, the floor and everything that never moves, with which every frame begins.
    colour: Buffer2d<Colour>,
    depth: Buffer2d<f32>,
    labels: overlay::Labels,
}

#[derive(Debug, Clone, Copy)]
struct Camera {
    matrix: Mat4,
    eye: Vec3,
}

type Solid<'a> = Triangles<'a, Buffer2d<f32>, BackfaceCullingEnabled>;

/// Draws flat colours at positions that are projected already.
struct Flat;

impl Pipeline for Flat {
    type Vertex = (Vec4, Colour);
    type VsOut = Shade;
    type Pixel = Colour;

    fn vert(&self, (position, colour): &Self::Vertex) -> ([f32; 4], Shade) {
        (position.to_array(), Shade(*colour))
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

impl Scene {
    /// The actors have the same samples, at least one.
    pub(crate) fn new(
        actors: Vec<Actor>,
        surroundings: &Surroundings,
        style: Style,
    ) -> io::Result<Self> {
        let reach = || actors.iter().flat_map(|actor| &actor.reach).copied();
        let ground = || surroundings.ground.iter().flat_map(|face| face.corners);
        let (low, high) = reach()
            .chain(ground())
            .fold((Vec3::MAX, Vec3::MIN), |(low, high), end| {
                (low.min(end), high.max(end))
            });
        let (around, above) = (
            style.view.around.to_radians(),
            style.view.above.to_radians(),
        );
        let orientation = Quat::from_euler(EulerRot::YXZ, around, -above, 0.0);
        // Actors stand side by side as the camera sees them.
        let right = orientation * Vec3::X;
        let sides = reach().chain(ground()).map(|end| end.dot(right));
        let (left_end, right_end) = sides.fold((f32::MAX, f32::MIN), |(left, right), side| {
            (left.min(side), right.max(side))
        });
        let length = surroundings.length;
        let apart = right_end - left_end + 0.8 * length;
        let middle = (actors.len() - 1) as f32 / 2.0;
        let shifts: Vec<Vec3> = (0..actors.len())
            .map(|i| right * (i as f32 - middle) * apart)
            .collect();
        let centre = (low + high) / 2.0;
        let aspect = style.size.0 as f32 / style.size.1 as f32;
        // Names are drawn below the actors, so the actors move up by half of the names' height.
        let below = match actors.iter().any(|actor| !actor.name.is_empty()) {
            true => overlay::Labels::share(style.size.1),
            false => 0.0,
        };
        let upright = (SIGHT.to_radians() / 2.0).tan() * 0.92 * (1.0 - below);
        let mut distance = length;
        for end in reach().chain(ground()) {
            for shift in &shifts {
                let seen = orientation.inverse() * (end - centre + *shift);
                let margin = surroundings.margin;
                let across = Vec2::new((seen.x.abs() + margin) / aspect, seen.y.abs() + margin);
                let across = across / upright;
                distance = distance.max(seen.z + across.max_element());
            }
        }
        let radius = (high - low).length() / 2.0 + shifts[0].length();
        let eye = centre + orientation * Vec3::Z * distance;
        let near = distance / 50.0;
        let matrix = Mat4::from_translation(below * Vec3::Y)
            * directx::perspective(SIGHT.to_radians(), aspect, near, distance + radius * 40.0)
            * look_at_mat4(eye, centre, Vec3::Y);
        let camera = Camera { matrix, eye };
        let theme = style.theme;
        let fine = [
            (style.size.0 * FINER) as usize,
            (style.size.1 * FINER) as usize,
        ];
        let mut colour = Buffer2d::new(fine, theme.ground);
        let mut depth = Buffer2d::new(fine, 1.0);
        let floor = Vec3::new(centre.x, low.y - 0.15 * length, centre.z);
        let has_floor = surroundings.ground.is_empty();
        if has_floor {
            for line in grid(matrix, floor, radius, length) {
                let ends = line.map(|end| (matrix * end.extend(1.0), theme.floor));
                Flat.draw::<Lines<_>, _>(&ends, &mut colour, Some(&mut depth));
            }
        }
        let shadowed = (has_floor && surroundings.shadows).then_some(floor.y);
        let mut corners = Vec::new();
        for (actor, &shift) in actors.iter().zip(&shifts) {
            for face in &surroundings.ground {
                camera.add(&mut corners, face, shift, 0.0);
            }
            for face in &actor.trails {
                if let Some(floor) = shadowed {
                    camera.add(&mut corners, &face.shadow(floor, theme.shadow), shift, 0.0);
                }
                // A curve on the ground would be half hidden in it, so it is drawn slightly nearer to the camera.
                camera.add(&mut corners, face, shift, 0.06 * length);
            }
        }
        Flat.draw::<Solid<'_>, _>(&corners, &mut colour, Some(&mut depth));
        let label_position = |shift: &Vec3| {
            let at = matrix * (centre + *shift).extend(1.0);
            (at.x / at.w + 1.0) / 2.0
        };
        let names = actors.iter().map(|actor| &*actor.name);
        let label_positions = shifts.iter().map(label_position);
        let labels = overlay::Labels::new(names.zip(label_positions), style.size, theme.ink)?;
        Ok(Self {
            actors,
            shifts,
            style,
            camera,
            shadowed,
            colour,
            depth,
            labels,
        })
    }

    fn frames(&self) -> usize {
        let first = self.actors.first();
        first.map_or(0, |actor| actor.positions.len() / actor.tracks.max(1))
    }

    /// Draws every frame, several at once, and hands them over in order.
    pub(crate) fn each_frame<E: Send>(
        &self,
        mut emit: impl FnMut(usize, &[u8]) -> Result<(), E>,
    ) -> Result<(), E> {
        let frames: Vec<usize> = (0..self.frames()).collect();
        for some in frames.chunks(AT_ONCE) {
            let pixels = |&frame: &usize| self.pixels(frame);
            let drawn: Vec<Vec<u8>> = on_threads(
                || some.par_iter().map(pixels).collect(),
                || some.iter().map(pixels).collect(),
            );
            for (&frame, pixels) in some.iter().zip(&drawn) {
                emit(frame, pixels)?;
            }
        }
        Ok(())
    }

    /// Pixels of some frames, for a palette.
    pub(crate) fn sample_colours(&self) -> Vec<u8> {
        let each = self.frames().div_ceil(8).max(1);
        let some: Vec<usize> = (0..self.frames()).step_by(each).collect();
        let pixels = |&frame: &usize| self.pixels(frame);
        on_threads(
            || some.par_iter().flat_map(pixels).collect(),
            || some.iter().flat_map(pixels).collect(),
        )
    }

    /// One frame: red, green, blue.
    fn pixels(&self, frame: usize) -> Vec<u8> {
        let mut colour = self.colour.clone();
        let mut depth = self.depth.clone();
        let mut corners = Vec::new();
        for (actor, &shift) in self.actors.iter().zip(&self.shifts) {
            for face in actor.faces(frame) {
                self.camera.add(&mut corners, &face, shift, 0.0);
                if let Some(floor) = self.shadowed {
                    let shadow = face.shadow(floor, self.style.theme.shadow);
                    self.camera.add(&mut corners, &shadow, shift, 0.0);
                }
            }
        }
        Flat.draw::<Solid<'_>, _>(&corners, &mut colour, Some(&mut depth));
        let fine: &[u8] = bytemuck::cast_slice(colour.as_ref());
        let mut pixels = halved(fine, (self.style.size.0 * FINER) as usize);
        self.labels.put(&mut pixels);
        pixels
    }
}

impl Camera {
    /// Adds a triangle as the camera sees it, after moving it by `shift` and by `nearer` towards the eye. Adds nothing
    /// if its back is turned to the camera or if it is not visible.
    fn add(&self, corners: &mut Vec<(Vec4, Colour)>, face: &Face, shift: Vec3, nearer: f32) {
        let seen = face.corners.map(|corner| {
            let corner = corner + shift;
            let nearer = (self.eye - corner).normalize_or_zero() * nearer;
            self.matrix * (corner + nearer).extend(1.0)
        });
        let [p, q, r] = seen.map(|corner| Vec2::new(corner.x, corner.y) / corner.w);
        let area = (q - p).perp_dot(r - p);
        if area > SEEN {
            let shade = face.shade();
            corners.extend(seen.map(|corner| (corner, shade)));
        } else if face.two_sided && area < -SEEN {
            let shade = Face {
                normal: face.normal.map(|normal| -normal),
                ..*face
            };
            let [p, q, r] = seen;
            corners.extend([p, r, q].map(|corner| (corner, shade.shade())));
        }
    }
}

/// Lines of the floor, cut off before they reach the eye.
fn grid(camera: Mat4, middle: Vec3, radius: f32, unit: f32) -> Vec<[Vec3; 2]> {
    let step = (radius / unit * 4.0 / 24.0).max(1.0).ceil() * unit;
    let half = (radius * 3.0 / step).ceil().clamp(4.0, 64.0) as i32;
    let reach = half as f32 * step;
    let mut lines = Vec::new();
    for offset in -half..=half {
        let aside = offset as f32 * step;
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
