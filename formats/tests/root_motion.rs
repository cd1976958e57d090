//! Root motion of clips: in place, and carried by a joint that changes nothing in the world.

use tumble::glam::{DVec3, Quat, Vec3};
use tumble::{Device, Engine};
use tumble_formats::format::MotionOptions;
use tumble_formats::learning::{Ground, HeadingSource};
use tumble_formats::motion::{ChannelInterpolation, Joint, Motion, Scalar, ScalarKind, Transform};
use tumble_formats::root_motion::{
    ROOT_MOTION, RootMotionError, RootMotionOptions, RootMotionRule, keys_with_root_motion,
    track_samples, with_root_motion,
};
use tumble_formats::sample::Samples;
use tumble_formats::world::world;
use tumble_formats::{Format, ReadOptions};

const FRAMES: usize = 31;

/// An armature in centimetres that lies on its back, a body in it that walks a curve, and a hand.
fn walker() -> Motion {
    let mut clip = Motion::default();
    let times: Vec<f64> = (0..FRAMES).map(|frame| frame as f64 / 30.0).collect();
    let upright = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
    clip.set.push("armature", &times[..1], &[upright]).unwrap();
    let rotation = |t: f32| {
        Quat::from_rotation_z(4.0 * t) * Quat::from_rotation_x(-1.4 + 0.1 * (9.0 * t).sin())
    };
    let keys: Vec<Quat> = times
        .iter()
        .map(|&t| rotation(t as f32).normalize())
        .collect();
    clip.set.push("hips", &times, &keys).unwrap();
    let position = |t: f32| {
        Vec3::new(
            150.0 * t,
            40.0 * (3.0 * t).sin(),
            -95.0 + 3.0 * (8.0 * t).cos(),
        )
    };
    let positions: Vec<Vec3> = times.iter().map(|&t| position(t as f32)).collect();
    clip.set
        .set_translations(1, &times, &positions, &[])
        .unwrap();
    let swings: Vec<Quat> = times
        .iter()
        .map(|&t| Quat::from_rotation_y((5.0 * t as f32).sin()))
        .collect();
    clip.set.push("hand", &times, &swings).unwrap();
    for (parent, rest) in [
        (
            None,
            Transform {
                rotation: upright,
                scale: Vec3::splat(0.01),
                ..Transform::default()
            },
        ),
        (Some(0), Transform::default()),
        (
            Some(1),
            Transform {
                translation: Vec3::new(40.0, 0.0, 30.0),
                ..Transform::default()
            },
        ),
    ] {
        clip.skeleton.push(Joint { parent, rest });
    }
    clip.rate = Some("30".parse().unwrap());
    let grip = Scalar {
        interpolation: Some(ChannelInterpolation::Linear),
        ..Scalar::of(ScalarKind::Plain)
    };
    clip.set
        .push_scalar("grip", &[0.0, 1.0], &[0.0, 1.0], &[])
        .unwrap();
    clip.scalars.push(grip);
    clip
}

fn options(heading: HeadingSource) -> RootMotionOptions {
    RootMotionOptions {
        ground: Ground::Y,
        heading,
        joint: None,
    }
}

fn samples_of(clip: &Motion) -> Samples {
    track_samples(clip, &Engine::new(Device::Cpu).unwrap()).unwrap()
}

/// The stated bound: 3e-7 rad, and 3e-7 of the farthest position.
fn assert_same_world(clip: &Motion, samples: &Samples, other: (&Motion, &Samples)) {
    let (tracks, more) = (clip.set.track_count(), other.0.set.track_count());
    let (before, after) = (
        world(clip, samples).unwrap(),
        world(other.0, other.1).unwrap(),
    );
    let size = before
        .iter()
        .map(|pose| pose.position.length())
        .fold(0.0, f64::max);
    let name = |clip: &Motion, track: usize| clip.set.track_name(track);
    for frame in 0..samples.times.len() {
        for track in 0..tracks {
            let same = (0..more)
                .find(|&it| name(other.0, it) == name(clip, track))
                .unwrap();
            let (a, b) = (before[frame * tracks + track], after[frame * more + same]);
            let off = (a.position - b.position).length();
            assert!(
                off <= 3e-7 * size,
                "{} at {frame}: {off:e}",
                name(clip, track)
            );
            let [p, q] = [a.rotation.as_dquat(), b.rotation.as_dquat()];
            let angle = 2.0 * (p - q).length().min((p + q).length());
            assert!(angle <= 3e-7, "{} at {frame}: {angle:e}", name(clip, track));
        }
    }
}

#[test]
fn extracted_motion_and_the_rest_are_the_motion() {
    let clip = walker();
    let samples = samples_of(&clip);
    for heading in [HeadingSource::Twist, HeadingSource::X, HeadingSource::Z] {
        let how = options(heading);
        let treated = |rule| with_root_motion(&clip, &samples, &how, rule).unwrap();
        let (still, in_place) = treated(RootMotionRule::InPlace);
        let (moved, extracted) = treated(RootMotionRule::Extract);
        assert_eq!(moved.set.track_name(0), ROOT_MOTION);
        let parents: Vec<_> = moved.skeleton.iter().map(|joint| joint.parent).collect();
        assert_eq!(parents, [Some(1), None, Some(0), Some(2)]);
        assert_same_world(&clip, &samples, (&moved, &extracted));
        // The body stays above the origin, at its height, and has heading 0.
        let (before, after) = (
            world(&clip, &samples).unwrap(),
            world(&still, &in_place).unwrap(),
        );
        for frame in 0..FRAMES {
            let [was, is] = [before[3 * frame + 1], after[3 * frame + 1]];
            let off = is.position - DVec3::Y * was.position.y;
            assert!(off.length() < 1e-6, "{heading}: {off}");
            let left = heading.heading(is.rotation.as_dquat(), Ground::Y);
            assert!(left.abs() < 1e-6, "{heading}: {left}");
            // If the joint carries the root, the root has the samples of the motion in place.
            assert_eq!(
                extracted.rotations[4 * frame + 2],
                in_place.rotations[3 * frame + 1]
            );
            let origins = [moved.origin(2), still.origin(1)];
            let points = [
                extracted.translations[4 * frame + 2],
                in_place.translations[3 * frame + 1],
            ];
            assert_eq!((origins[0], points[0]), (origins[1], points[1]));
        }
        assert_eq!(extracted.scalars, samples.scalars);
    }
    let kept = with_root_motion(
        &clip,
        &samples,
        &options(HeadingSource::Twist),
        RootMotionRule::Keep,
    );
    assert_eq!(kept.unwrap().1.rotations, samples.rotations);
}

/// From files again, too: formats with the joint as a root of a skeleton, and keys with their scalars.
#[test]
fn a_joint_with_root_motion_is_written_and_read() {
    let clip = walker();
    let samples = samples_of(&clip);
    let how = options(HeadingSource::Twist);
    let keyed = keys_with_root_motion(&clip, &samples, &how, RootMotionRule::Extract).unwrap();
    assert_eq!(keyed.set.scalar(0), clip.set.scalar(0));
    assert_eq!(keyed.rate, clip.rate);
    assert_same_world(&clip, &samples, (&keyed, &samples_of(&keyed)));
    let (moved, extracted) =
        with_root_motion(&clip, &samples, &how, RootMotionRule::Extract).unwrap();
    for name in ["npz", "glb"] {
        let format = Format::named(name).unwrap();
        let mut bytes = Vec::new();
        let sampled = [extracted.of(&moved, clip.rate, &[])];
        format
            .write_clips(&sampled, &MotionOptions::default(), &mut bytes)
            .unwrap();
        let again = (format.read_bytes)("a", bytes, &ReadOptions::default()).unwrap();
        let again = &again.clips[0];
        assert_same_world(&clip, &samples, (again, &samples_of(again)));
    }
}

#[test]
fn a_root_is_the_joint_that_moves_or_is_named() {
    let mut clip = walker();
    let how = options(HeadingSource::Twist);
    let refused = |clip: &Motion, how: &RootMotionOptions| {
        let samples = samples_of(clip);
        with_root_motion(clip, &samples, how, RootMotionRule::InPlace).unwrap_err()
    };
    let times = clip.set.track(1).times.to_vec();
    clip.set
        .push("prop", &times, &vec![Quat::IDENTITY; FRAMES])
        .unwrap();
    let positions: Vec<Vec3> = (0..FRAMES).map(|frame| Vec3::X * frame as f32).collect();
    clip.set
        .set_translations(3, &times, &positions, &[])
        .unwrap();
    let rest = Transform::default();
    clip.skeleton.push(Joint { parent: None, rest });
    let names = "`hips`, `prop`".to_owned();
    assert_eq!(
        refused(&clip, &how),
        RootMotionError::SeveralRoots { names }
    );
    let named = |name: &str| RootMotionOptions {
        joint: Some(name.to_owned()),
        ..how.clone()
    };
    let samples = samples_of(&clip);
    let found = with_root_motion(&clip, &samples, &named("prop"), RootMotionRule::InPlace).unwrap();
    assert_eq!(found.1.rotations[1], samples.rotations[1]);
    assert_eq!(found.1.translations[4 * 30 + 3], Vec3::ZERO);
    let name = "hand".to_owned();
    assert_eq!(
        refused(&clip, &named("head")),
        RootMotionError::NoJoint {
            name: "head".to_owned()
        }
    );
    assert_eq!(refused(&clip, &named(&name)), RootMotionError::NoRoot);
    clip.is_world = true;
    assert_eq!(
        refused(&clip, &named("prop")),
        RootMotionError::World { tracks: 4 }
    );
}
