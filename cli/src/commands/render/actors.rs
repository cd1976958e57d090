//! What stands in a picture: chains of boxes, or bodies on paths.

use glam::Vec3;
use tumble::{Interpolation, Layout, SampleTimes, Skeleton, TrackSet};
use tumble_routes::mesh::Mesh;

use crate::arguments::device::OpenedDevice;
use crate::commands::render::scene::{Actor, Surroundings};
use crate::commands::render::solids::{Body, meshes, trails};
use crate::commands::travel::{Maker, Scenery, TravelSource};
use crate::messages::colours::Colour;
use crate::messages::exit::Failure;

/// Of a box that is 1 long.
const BREADTH: f32 = 0.28;
/// How many samples determine the extent of a chain.
const REACHES: usize = 200;

/// The boxes of a set as a chain, by one method.
pub(super) fn chain(
    device: &mut OpenedDevice,
    name: &str,
    set: &TrackSet,
    interpolation: Interpolation,
    frames: &SampleTimes,
) -> Result<Actor, Failure> {
    // A picture has no scale: boxes are 1 long, however long they are.
    let timeline = frames
        .resolve(set.track_count(), set.time_span())
        .map_err(|error| Failure::evaluating(name, &error.into()))?;
    let poses = device
        .choose(set.track_count() * timeline.len())
        .and_then(|()| {
            let engine = &device.engine;
            let local = engine
                .request(set, interpolation, frames)
                .layout(Layout::FrameMajor)
                .evaluate()?;
            engine.world(&local, &Skeleton::chain(set.track_count(), 1.0)?)
        })
        .map_err(|error| Failure::evaluating(name, &error))?;
    let (tracks, samples) = (poses.track_count(), poses.sample_count());
    let all = || (0..samples).flat_map(move |sample| (0..tracks).map(move |track| (track, sample)));
    let mut actor = Actor {
        name: interpolation.method.name.to_owned(),
        tracks,
        rotations: all()
            .filter_map(|(track, sample)| poses.rotation(track, sample))
            .collect(),
        positions: all()
            .filter_map(|(track, sample)| poses.position(track, sample))
            .collect(),
        body: Body::hanging(BREADTH),
        trails: Vec::new(),
        reach: Vec::new(),
    };
    for sample in (0..samples).step_by(samples.div_ceil(REACHES).max(1)) {
        for index in sample * tracks..(sample + 1) * tracks {
            let (rotation, hung) = (actor.rotations[index], actor.positions[index]);
            actor.reach.extend([hung, hung + rotation * Vec3::NEG_Y]);
        }
    }
    Ok(actor)
}

/// What is around chains.
pub(super) fn around_chains() -> Surroundings {
    Surroundings {
        ground: Vec::new(),
        length: 1.0,
        margin: BREADTH * 0.7,
        shadows: false,
    }
}

/// The bodies of a source, an actor for each maker, with their curves in the colour of ink, and what
/// is around them.
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
            name: bodies.name,
            tracks: bodies.tracks,
            rotations: bodies.rotations,
            positions: bodies.positions,
            body,
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
