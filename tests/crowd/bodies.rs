//! Bodies of robots: those that f64 computes from the same joints, and the CPU's bits on devices.

use glam::{DQuat, DVec3, Quat, Vec3};
use tumble::crowd::{
    BodyArray, BodyStates, BodyTables, CrowdError, DeviceBodies, FrameStep, KeyPrecision,
    MotionBuilder, MotionTables,
};
use tumble::trees::{
    BodyArrays, BodyMotion, BodyOrder, BodyPose, BodyRows, BodyVelocity, Configuration,
    ConfigurationRates, FrameWords, JointKind, JointTracks, Mimic, Siblings, Tree, TreeBody,
    TreeError, TreeFrames, TreeJoint,
};
use tumble::{Device, Engine, Skeleton, TrackSet, VectorMethod, method};

use super::states::TICKS;
use crate::support::{Random, vulkan_devices};

/// Tracks of the free joint, of the ball, and of three scalars.
const TRACKS: usize = 3;

/// A robot with joints of every kind, of which some have anchors and one mimics another.
fn robot(random: &mut Random) -> Tree {
    let mut body = |name: &str, parent, kinds: &[(&str, JointKind)]| {
        let joint = |&(name, kind): &(&str, JointKind)| TreeJoint {
            axis: random.direction(),
            anchor: match random.next() % 2 {
                0 => DVec3::ZERO,
                _ => random.direction() * 0.1,
            },
            reference: random.between(-0.5, 0.5),
            mimic: name.starts_with("mimic").then(|| Mimic {
                joint: "knee".to_owned(),
                multiplier: -1.5,
                offset: 0.25,
            }),
            ..TreeJoint::new(name, kind)
        };
        TreeBody {
            name: name.to_owned(),
            parent,
            joints: kinds.iter().map(joint).collect(),
            position: random.direction() * random.between(0.1, 0.4),
            rotation: DQuat::from_axis_angle(random.direction(), random.between(-3.0, 3.0)),
            mass_centre: Some(random.direction() * 0.1),
        }
    };
    use JointKind::{Ball, Free, Hinge, Slide};
    let bodies = vec![
        body("pelvis", None, &[("root", Free)]),
        body("leg", Some(0), &[("hip", Hinge), ("knee", Hinge)]),
        body("foot", Some(1), &[("mimic", Hinge)]),
        body("arm", Some(0), &[("shoulder", Ball), ("rail", Slide)]),
        body("hand", Some(3), &[]),
        body("table", None, &[]),
        body("lid", Some(5), &[("mimic_lid", Hinge)]),
    ];
    Tree::new(bodies).unwrap()
}

fn joint_tracks() -> JointTracks {
    JointTracks {
        base: None,
        free: vec![0],
        balls: vec![1],
        scalars: vec![[2, 0], [2, 1], [2, 2]],
    }
}

/// The bodies in breadth-first order. Velocities are those of `points`, one for each body; without points, of the origins.
fn frames(tree: &Tree, points: &[DVec3]) -> TreeFrames {
    let order = tree.order(BodyOrder::BreadthFirst, Siblings::File);
    tree.frames(&joint_tracks(), &order, points).unwrap()
}

fn mass_centres(tree: &Tree) -> Vec<DVec3> {
    let bodies = tree.bodies().iter();
    bodies.filter_map(|body| body.mass_centre).collect()
}

/// Two clips: the joints move at even times, in the second one far from the origin and by many turns.
fn clips(random: &mut Random) -> (MotionTables, Vec<[u32; 4]>, Vec<[f32; 4]>) {
    let skeleton = Skeleton::new(vec![None; TRACKS], vec![Vec3::ZERO; TRACKS]).unwrap();
    let mut builder = MotionBuilder::new(&skeleton, TICKS, KeyPrecision::Exact).unwrap();
    for (size, angles) in [(1.0, 2.0), (30.0, 400.0)] {
        let mut set = TrackSet::new();
        let times: Vec<f64> = (0..40).map(|key| f64::from(key) * 0.1).collect();
        for track in 0..TRACKS {
            let mut rotation = Quat::IDENTITY;
            let mut keys = Vec::new();
            for _ in &times {
                let step = Quat::from_axis_angle(random.direction().as_vec3(), 0.3);
                rotation = if track == 2 {
                    rotation
                } else {
                    (step * rotation).normalize()
                };
                keys.push(rotation);
            }
            set.push("", &times, &keys).unwrap();
        }
        let mut points = |size: f64| -> Vec<Vec3> {
            let point = |_| (random.direction() * random.between(0.0, size)).as_vec3();
            times.iter().map(point).collect()
        };
        let (root, scalars) = (points(size), points(angles));
        set.set_translations(0, &times, &root, &[]).unwrap();
        set.set_translations(2, &times, &scalars, &[]).unwrap();
        builder
            .push(
                &set,
                method::BESSEL_OVERHAUSER,
                VectorMethod::BesselOverhauser,
            )
            .unwrap();
    }
    builder.finish()
}

#[derive(Clone)]
struct Found {
    joint_values: Vec<f32>,
    joint_rates: Vec<f32>,
    positions: Vec<[f32; 3]>,
    rotations: Vec<[f32; 4]>,
    velocities: Vec<[f32; 3]>,
    angular_velocities: Vec<[f32; 3]>,
}

impl Found {
    fn new(
        engine: &Engine,
        tables: &BodyTables,
        parts: (&[[u32; 4]], &[[f32; 4]]),
        at: &[(u32, u32)],
        steps: Option<&[FrameStep]>,
    ) -> Self {
        let scalars = at.len() * tables.frames().scalar_count();
        let bodies = at.len() * tables.frames().body_count();
        let mut found = Self {
            joint_values: vec![0.0; scalars],
            joint_rates: vec![0.0; scalars],
            positions: vec![[0.0; 3]; bodies],
            rotations: vec![[0.0; 4]; bodies],
            velocities: vec![[0.0; 3]; bodies],
            angular_velocities: vec![[0.0; 3]; bodies],
        };
        let states = BodyStates {
            joint_values: &mut found.joint_values,
            joint_rates: &mut found.joint_rates,
            positions: &mut found.positions,
            rotations: &mut found.rotations,
            velocities: &mut found.velocities,
            angular_velocities: &mut found.angular_velocities,
        };
        tables
            .sample_into(engine, parts, at, steps, states)
            .unwrap();
        found
    }

    fn bits(&self, array: BodyArray) -> &[u8] {
        match array {
            BodyArray::JointValues => bytemuck::cast_slice(&self.joint_values),
            BodyArray::JointRates => bytemuck::cast_slice(&self.joint_rates),
            BodyArray::Positions => bytemuck::cast_slice(&self.positions),
            BodyArray::Rotations => bytemuck::cast_slice(&self.rotations),
            BodyArray::Velocities => bytemuck::cast_slice(&self.velocities),
            BodyArray::AngularVelocities => bytemuck::cast_slice(&self.angular_velocities),
            _ => unreachable!("an array that this test does not know: {array:?}"),
        }
    }
}

fn instances(random: &mut Random, tables: &BodyTables, count: usize) -> Vec<(u32, u32)> {
    super::states::instances(random, tables.tables(), count)
}

/// The bodies in f64 at the joints that tables have.
fn expected(
    tree: &Tree,
    tables: &MotionTables,
    parts: (&[[u32; 4]], &[[f32; 4]]),
    at: &[(u32, u32)],
) -> Vec<BodyMotion> {
    let engine = Engine::new(Device::Cpu).unwrap();
    let tracks = super::states::states(&engine, tables, parts, at);
    let vector = |v: [f32; 3]| Vec3::from_array(v).as_dvec3();
    let of_sample = |sample: usize| {
        let track = |track: usize| {
            let index = sample * TRACKS + track;
            let pose = BodyPose {
                position: vector(tracks.positions[index]),
                rotation: Quat::from_array(tracks.rotations[index]).as_dquat(),
            };
            let velocity = BodyVelocity {
                linear: vector(tracks.velocities[index]),
                angular: vector(tracks.angular_velocities[index]),
            };
            (pose, velocity)
        };
        let (mut configuration, mut rates) = (tree.rest(), tree.no_rates());
        (configuration.free[0], rates.free[0]) = track(0);
        let (ball, rate) = track(1);
        configuration.balls[0] = ball.rotation;
        rates.balls[0] = ball.rotation.inverse() * rate.angular;
        let (values, changes) = track(2);
        configuration.scalars = values.position.to_array().to_vec();
        rates.scalars = changes.linear.to_array().to_vec();
        tree.motions(&configuration, &rates).unwrap()
    };
    (0..at.len()).flat_map(of_sample).collect()
}

/// A robot that is up to 3 m large, with a slide of 2 m; the second clip has slides of 400 m, and angles of 600 rad, which
/// are rounded to 6e-5 rad. `formats/tests/robots.rs` has the bounds of robots.
#[test]
fn bodies_are_those_of_f64() {
    let mut random = Random(31);
    let tree = robot(&mut random);
    let (tables, spans, cells) = clips(&mut random);
    let parts = (&spans[..], &cells[..]);
    let engine = Engine::new(Device::Cpu).unwrap();
    let mut largest = [[0f64; 4]; 2];
    for points in [Vec::new(), mass_centres(&tree)] {
        let bodies = frames(&tree, &points).with_w_first();
        let bodies = BodyTables::new(tables.clone(), bodies).unwrap();
        let at = instances(&mut random, &bodies, 500);
        let motions = expected(&tree, &tables, parts, &at);
        let found = Found::new(&engine, &bodies, parts, &at, None);
        let order = tree.order(BodyOrder::BreadthFirst, Siblings::File);
        for (index, _) in found.positions.iter().enumerate() {
            let (sample, column) = (index / order.len(), index % order.len());
            let motion = &motions[sample * order.len() + order[column]];
            let vector = |v: &[[f32; 3]]| Vec3::from_array(v[index]).as_dvec3();
            let position = motion.pose.position;
            let half_step = f64::from(f32::EPSILON) / 2.0 * position.abs().max_element();
            let apart = vector(&found.positions).distance(position) - 2.0 * half_step;
            let [w, x, y, z] = found.rotations[index].map(f64::from);
            let rotation = DQuat::from_xyzw(x, y, z, w);
            let angle = (rotation - motion.pose.rotation).length() * 2.0;
            let linear = match points.get(order[column]) {
                Some(&point) => motion.velocity_at(point),
                None => motion.velocity.linear,
            };
            let of_linear = (vector(&found.velocities) - linear).length();
            let of_angular = vector(&found.angular_velocities) - motion.velocity.angular;
            let sizes = [
                1.0,
                1.0,
                1.0 + linear.length(),
                1.0 + motion.velocity.angular.length(),
            ];
            let errors = [apart, angle, of_linear, of_angular.length()];
            let of_clip = &mut largest[at[sample].0 as usize];
            for ((largest, error), size) in of_clip.iter_mut().zip(errors).zip(sizes) {
                *largest = largest.max(error / size);
            }
        }
        // The values are those of the tracks.
        let track = super::states::states(&engine, &tables, parts, &at);
        let scalars = track.positions.chunks(TRACKS).flat_map(|joints| joints[2]);
        assert!(scalars.eq(found.joint_values.iter().copied()));
        let rates = track.velocities.chunks(TRACKS).flat_map(|joints| joints[2]);
        assert!(rates.eq(found.joint_rates.iter().copied()));
    }
    println!("{largest:?}");
    for (errors, bounds) in largest.iter().zip([[1e-6, 1e-6, 1e-6, 5e-6], [1e-4; 4]]) {
        let mut pairs = errors.iter().zip(bounds);
        assert!(pairs.all(|(&error, bound)| error <= bound), "{largest:?}");
    }
}

#[test]
fn bodies_have_the_bits_of_the_cpu_on_every_device() {
    let mut random = Random(32);
    let tree = robot(&mut random);
    let (tables, spans, cells) = clips(&mut random);
    let parts = (&spans[..], &cells[..]);
    let cpu = Engine::new(Device::Cpu).unwrap();
    let devices = vulkan_devices().into_iter();
    let engines: Vec<Engine> = devices.map(|device| Engine::new(device).unwrap()).collect();
    for bodies in [
        frames(&tree, &[]),
        frames(&tree, &mass_centres(&tree)).with_w_first(),
    ] {
        assert_eq!(TreeFrames::of_words(&bodies.words()), bodies);
        let bodies = BodyTables::new(tables.clone(), bodies).unwrap();
        let at = instances(&mut random, &bodies, 200);
        let frame = TICKS / 30;
        let step = |&(_, tick): &(u32, u32)| FrameStep {
            ticks: [tick / frame * frame, (tick / frame + 1) * frame],
            per_second: 30.0,
        };
        let steps: Vec<FrameStep> = at.iter().map(step).collect();
        for steps in [None, Some(&steps[..])] {
            let expected = Found::new(&cpu, &bodies, parts, &at, steps);
            for engine in &engines {
                let robot = DeviceBodies::new(engine, &bodies, parts).unwrap();
                // All arrays in one call, and each array in a separate call, which skips steps that the array does not
                // need.
                let each = BodyArray::ALL.map(|array| vec![array]);
                for arrays in each.iter().chain([&BodyArray::ALL.to_vec()]) {
                    let (found, ranges) = robot.sample(&at, steps, arrays).unwrap();
                    for (&array, range) in arrays.iter().zip(ranges) {
                        let found = &found.bytes()[range];
                        assert!(found == expected.bits(array), "{array} {robot:?}");
                    }
                }
            }
        }
    }
}

/// More configurations than a vector has lanes, and fewer at the end.
#[test]
fn bodies_of_many_configurations_have_the_bits_of_one() {
    let mut random = Random(34);
    let tree = robot(&mut random);
    let order = tree.order(BodyOrder::BreadthFirst, Siblings::File);
    let mut state = || {
        let (mut at, mut rates) = (tree.rest(), tree.no_rates());
        let mut rotation = || {
            // Of any length.
            let angle = random.between(-3.0, 3.0);
            DQuat::from_axis_angle(random.direction(), angle) * random.between(0.5, 2.0)
        };
        at.balls[0] = rotation();
        for pose in [&mut at.base, &mut at.free[0]] {
            pose.rotation = rotation();
        }
        for velocity in [&mut rates.base, &mut rates.free[0]] {
            (velocity.linear, velocity.angular) = (random.direction(), random.direction() * 2.0);
        }
        (at.base.position, at.free[0].position) = (random.direction(), random.direction() * 3.0);
        rates.balls[0] = random.direction();
        for value in at.scalars.iter_mut().chain(&mut rates.scalars) {
            *value = random.between(-9.0, 9.0);
        }
        (at, rates)
    };
    let states: Vec<(Configuration, ConfigurationRates)> = (0..37).map(|_| state()).collect();
    let expected = states.iter().flat_map(|(at, rates)| {
        let all = tree.motions(at, rates).unwrap();
        order.iter().map(|&body| all[body]).collect::<Vec<_>>()
    });
    let expected: Vec<BodyMotion> = expected.collect();
    let at = |sample: usize, state: &mut _| *state = states[sample].clone();
    let mut memory = tree.walk_memory();
    let walk = tree.walk(&order, &[]).unwrap();
    let mut found = vec![BodyMotion::default(); expected.len()];
    let rows = BodyRows::Motions(&mut found);
    walk.bodies_into(&mut memory, 37, at, rows).unwrap();
    assert_eq!(found, expected);
    // To arrays, with the velocities of other points.
    let centres = mass_centres(&tree);
    let walk = tree.walk(&order, &centres).unwrap();
    let mut rotations = vec![[0.0; 4]; expected.len()];
    let mut velocities = vec![[0.0; 3]; expected.len()];
    let arrays = BodyArrays {
        rotations: &mut rotations,
        velocities: &mut velocities,
        is_w_first: true,
        ..BodyArrays::default()
    };
    walk.bodies_into(&mut memory, 37, at, BodyRows::Arrays(arrays))
        .unwrap();
    for (index, motion) in expected.iter().enumerate() {
        let [w, x, y, z] = rotations[index];
        assert_eq!([x, y, z, w], motion.pose.rotation.to_array());
        let velocity = motion.velocity_at(centres[order[index % order.len()]]);
        assert!(velocity.distance(velocities[index].into()) < 1e-13);
    }
    let refused = walk.bodies_into(&mut memory, 36, at, BodyRows::Motions(&mut found));
    assert!(matches!(refused, Err(TreeError::Count { .. })));
}

#[test]
fn frames_that_do_not_fit_are_refused() {
    let mut random = Random(33);
    let tree = robot(&mut random);
    let (tables, spans, cells) = clips(&mut random);
    let sound = frames(&tree, &mass_centres(&tree)).words();
    let broken: [fn(&mut FrameWords); 6] = [
        |words| words.frames[3][3] = 3,           // above itself
        |words| words.frames[1][11] = 6,          // of no kind
        |words| words.frames[1][12] = 3 * 20 + 8, // a track that is not there
        |words| words.frames[1][13] = 1,          // in the middle of a track
        |words| words.scalars[0] = 11,            // no coordinate
        |words| words.bodies[2][1] = 400,
    ];
    for break_words in broken {
        let mut words = sound.clone();
        break_words(&mut words);
        let refused = BodyTables::new(tables.clone(), TreeFrames::of_words(&words)).unwrap_err();
        assert_eq!(refused, CrowdError::BrokenTables);
    }
    let mut tracks = joint_tracks();
    tracks.balls.clear();
    let refused = tree.frames(&tracks, &[0], &[]).unwrap_err();
    assert!(
        matches!(refused, TreeError::Count { expected: 1, .. }),
        "{refused}"
    );
    let refused = tree.frames(&joint_tracks(), &[7], &[]).unwrap_err();
    assert!(
        matches!(refused, TreeError::MissingBody { body: 7, .. }),
        "{refused}"
    );
    let bodies = BodyTables::new(tables, TreeFrames::of_words(&sound)).unwrap();
    let (cpu, parts) = (Engine::new(Device::Cpu).unwrap(), (&spans[..], &cells[..]));
    let mut joint_values = [0.0; 4];
    let states = BodyStates {
        joint_values: &mut joint_values,
        ..BodyStates::default()
    };
    let refused = bodies
        .sample_into(&cpu, parts, &[(0, 0)], None, states)
        .unwrap_err();
    assert!(
        matches!(
            refused,
            CrowdError::OutputLength {
                length: 4,
                needed: 3
            }
        ),
        "{refused}"
    );
}
