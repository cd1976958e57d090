//! The actors of a picture: chains of boxes, skeletons and their meshes, or bodies on paths.

use std::sync::Arc;

use glam::{Quat, Vec3};
use tumble::{Error, SampleTimes};
use tumble_formats::carried_mesh::CarriedMesh;
use tumble_formats::motion::{Joint, Motion, Transform};
use tumble_formats::sample::MethodChoice;
use tumble_formats::world::{HierarchyError, world, world_matrices};
use tumble_routes::mesh::Mesh;

use crate::arguments::device::OpenedDevice;
use crate::arguments::interpolation::CurveChoice;
use crate::batch::room;
use crate::commands::render::bones::{Bones, Skin};
use crate::commands::render::scene::{Actor, Shape, Surroundings};
use crate::commands::render::solids::{Body, meshes, trails};
use crate::commands::render::typical_body::set_typical_offsets;
use crate::commands::travel::{Maker, Scenery, TravelSource, positions_of, scene_origin};
use crate::messages::colours::Colour;
use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::words;

/// The breadth of a box that is 1 long.
const BREADTH: f32 = 0.28;
/// How many samples determine the extent of a motion.
const REACHES: usize = 200;

/// A clip, as its skeleton, its mesh, or a chain of boxes.
pub(super) struct Subject {
    /// The clip; if it has no positions, with the joints of a chain.
    clip: Motion,
    is_chain: bool,
    mesh: Option<Arc<CarriedMesh>>,
}

impl Subject {
    /// How a clip is drawn: tracks without positions are the boxes of a chain.
    ///
    /// # Errors
    /// When the file says why its joints have no positions.
    pub(super) fn new(
        mut clip: Motion,
        mesh: Option<CarriedMesh>,
        name: &str,
    ) -> Result<Self, Failure> {
        if clip.no_world.is_some() && clip.body.is_some() && set_typical_offsets(&mut clip).is_ok()
        {
            words::warning(&format!(
                "{name}: does not contain the positions of the body's joints, so a typical body is drawn; give \
                 its model with --body-model, or the offsets of its joints with --offsets"
            ));
        }
        if let Some(reason) = &clip.no_world {
            return Err(Failure::new(ALL_INPUTS, format!("{name}: {reason}")));
        }
        let is_chain = clip.is_chain();
        Ok(Self {
            clip: if is_chain { chain(clip) } else { clip },
            is_chain,
            mesh: mesh.map(Arc::new),
        })
    }

    /// `4 boxes`, `22 joints`.
    pub(super) fn tracks(&self) -> String {
        let tracks = self.clip.set.track_count();
        match self.is_chain {
            true => words::boxes(tracks),
            false => words::count(tracks, "joint"),
        }
    }

    /// The clip by one method.
    pub(super) fn actor(
        &self,
        device: &mut OpenedDevice,
        name: &str,
        choice: CurveChoice,
        frames: &SampleTimes,
    ) -> Result<Actor, Failure> {
        let clip = &self.clip;
        let tracks = clip.set.track_count();
        let timeline = room::in_memory(name, &clip.set, frames, 7)?;
        let samples = device
            .choose(tracks * timeline.len())
            .and_then(|()| device.work(|engine| choice.sample(engine, clip, frames)))
            .map_err(|error: Error| Failure::evaluating(name, &error))?;
        let refused = |error: HierarchyError| Failure::new(ALL_INPUTS, format!("{name}: {error}"));
        let poses = world(clip, &samples).map_err(refused)?;
        let rotations: Vec<Quat> = poses.iter().map(|pose| pose.rotation).collect();
        let positions = positions_of(clip, &poses);
        let is_finite = positions.iter().all(|position| position.is_finite());
        if !is_finite {
            let message = "a position is too large for f32; scale the translations down";
            return Err(Failure::new(ALL_INPUTS, format!("{name}: {message}")));
        }
        let count = timeline.len();
        // Every n-th frame, to find the visible extent that determines the position of the camera.
        let seen = || (0..count).step_by(count.div_ceil(REACHES).max(1));
        let at = |frame: usize| frame * tracks..(frame + 1) * tracks;
        let (shape, reach) = match &self.mesh {
            _ if self.is_chain => {
                let ends = seen().flat_map(at).flat_map(|index| {
                    let hung = positions[index];
                    [hung, hung + rotations[index] * Vec3::NEG_Y]
                });
                (Shape::Boxes(Body::hanging(BREADTH)), ends.collect())
            }
            Some(mesh) => {
                let origin = scene_origin(clip);
                let matrices = world_matrices(clip, &samples).map_err(refused)?;
                let matrices = matrices.into_iter().map(|mut matrix| {
                    matrix.translation -= origin;
                    matrix
                });
                let skin = Skin::new(Arc::clone(mesh), matrices.collect(), tracks);
                let reach = seen().flat_map(|frame| skin.vertices(frame)).collect();
                (Shape::Skin(skin), reach)
            }
            None => {
                let bones = Bones::new(clip, &rotations, &positions);
                let ends = |frame| bones.ends(&rotations[at(frame)], &positions[at(frame)]);
                let reach: Vec<Vec3> = seen().flat_map(ends).collect();
                (Shape::Bones(bones), reach)
            }
        };
        Ok(Actor {
            name: caption(choice.method),
            tracks,
            rotations,
            positions,
            shape,
            trails: Vec::new(),
            reach,
        })
    }

    /// The box around the actors of this clip.
    pub(super) fn surroundings(&self, actors: &[Actor]) -> Surroundings {
        if self.is_chain {
            return Surroundings {
                ground: Vec::new(),
                length: 1.0,
                margin: BREADTH * 0.7,
                shadows: false,
            };
        }
        let length = actors.first().map_or(1.0, |actor| match &actor.shape {
            Shape::Bones(bones) => bones.length,
            // A part of the visible extent, as for bones.
            Shape::Boxes(_) | Shape::Skin(_) => {
                let low = actor.reach.iter().copied().fold(Vec3::MAX, Vec3::min);
                let high = actor.reach.iter().copied().fold(Vec3::MIN, Vec3::max);
                Some((high - low).max_element() / 10.0)
                    .filter(|it| *it > 0.0)
                    .unwrap_or(1.0)
            }
        });
        Surroundings {
            ground: Vec::new(),
            length,
            margin: 0.1 * length,
            shadows: true,
        }
    }
}

/// The clip with the joints of a chain of boxes. A picture has no scale: boxes are 1 long, however long they
/// are.
fn chain(clip: Motion) -> Motion {
    let joint = |track: usize| Joint {
        parent: track.checked_sub(1),
        rest: Transform {
            translation: if track == 0 { Vec3::ZERO } else { Vec3::NEG_Y },
            ..Transform::default()
        },
    };
    Motion {
        skeleton: (0..clip.set.track_count()).map(joint).collect(),
        ..clip
    }
}

/// The words under a body of a clip: how it is interpolated.
fn caption(method: MethodChoice) -> String {
    match method.0 {
        None => "interpolated as in the file".to_owned(),
        Some(method) => method.name.to_owned(),
    }
}

/// The bodies of a source, with an actor for each maker; their curves have the colour of ink. The scenery is added.
pub(super) fn travellers(
    device: &mut OpenedDevice,
    name: &str,
    (source, makers): (&TravelSource, &[Maker]),
    scenery: &Scenery,
    frames: &SampleTimes,
    ink: Colour,
) -> Result<(Vec<Actor>, Surroundings), Failure> {
    let ground: Vec<Mesh> = scenery.read()?;
    let mut actors = Vec::new();
    let mut length = None;
    for &maker in makers {
        let trail = source.trail(device, name, maker)?;
        let length = *length.get_or_insert_with(|| scenery.length(&trail.positions));
        let body = Body::going(length, !ground.is_empty(), source.body_rotation());
        let bodies = source.sample(device, name, maker, frames)?;
        let poses = trail.positions.iter().zip(&trail.rotations);
        let corners =
            poses.flat_map(|(&at, &rotation)| body.corners(rotation).map(|corner| at + corner));
        actors.push(Actor {
            name: match maker {
                Maker::Frame(frame) => format!("{} frame", frame.name()),
                Maker::Method(choice) => caption(choice.method),
            },
            tracks: bodies.tracks,
            rotations: bodies.rotations,
            positions: bodies.positions,
            shape: Shape::Boxes(body),
            trails: trails(&trail, scenery.drawn_frames, length, ink),
            reach: corners.collect(),
        });
    }
    let surroundings = Surroundings {
        ground: meshes(&ground, source.origin()),
        length: length.unwrap_or(1.0),
        margin: 0.0,
        shadows: true,
    };
    Ok((actors, surroundings))
}
