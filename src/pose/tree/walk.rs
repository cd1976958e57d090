//! The walk along a tree's frames in f64: of one configuration, or of as many as a vector has lanes. Each lane does the
//! same sums, products, quotients and roots in the same order, so that every vector width has the same bits.

use glam::{DQuat, DVec3};

use crate::math::quaternion::{Arithmetic, cross3, dot, product, scaled, sine_cosine, sum};
use crate::pose::tree::joint_frames::{FrameMotion, JointFrame, ScalarMotion};
use crate::pose::tree::{
    BodyMotion, BodyPose, BodyVelocity, Configuration, ConfigurationRates, JointCounts,
};
use crate::simd::doubles::Doubles;

/// A frame with constants whose form tells what can be left out.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct WalkFrame {
    /// The frame above; none above those that move in the world.
    above: usize,
    /// `None` at the origin.
    offset: Option<[f64; 3]>,
    /// `None` if it is not rotated.
    rest: Option<[f64; 4]>,
    motion: WalkMotion,
}

#[derive(Debug, Clone, PartialEq)]
enum WalkMotion {
    Fixed,
    Hinge(WalkScalar),
    Slide(WalkScalar),
    Ball(usize),
    /// By a pose.
    Free(usize),
    /// By a pose in the world.
    Root(usize),
}

/// By `multiplier * scalars[index] + shift` about or along an axis.
#[derive(Debug, Clone, PartialEq)]
struct WalkScalar {
    axis: WalkAxis,
    index: usize,
    multiplier: f64,
    shift: f64,
}

#[derive(Debug, Clone, PartialEq)]
enum WalkAxis {
    X,
    Y,
    Z,
    Other([f64; 3]),
}

impl WalkFrame {
    pub(super) fn new(frame: &JointFrame) -> Self {
        let at_origin = frame.offset == DVec3::ZERO;
        let at_rest = frame.rest == DQuat::IDENTITY;
        Self {
            above: frame.above.unwrap_or_default(),
            offset: (!at_origin).then(|| frame.offset.to_array()),
            rest: (!at_rest).then(|| frame.rest.to_array()),
            motion: match frame.motion {
                FrameMotion::Fixed => WalkMotion::Fixed,
                FrameMotion::Hinge(scalar) => WalkMotion::Hinge(WalkScalar::new(scalar)),
                FrameMotion::Slide(scalar) => WalkMotion::Slide(WalkScalar::new(scalar)),
                FrameMotion::Ball(index) => WalkMotion::Ball(index),
                FrameMotion::Free(index) => WalkMotion::Free(index + 1),
                FrameMotion::Root(index) => WalkMotion::Root(index + 1),
                FrameMotion::Base => WalkMotion::Root(0),
            },
        }
    }
}

impl WalkScalar {
    fn new(scalar: ScalarMotion) -> Self {
        let ScalarMotion {
            axis,
            index,
            multiplier,
            shift,
        } = scalar;
        let along = [
            (DVec3::X, WalkAxis::X),
            (DVec3::Y, WalkAxis::Y),
            (DVec3::Z, WalkAxis::Z),
        ];
        for (coordinate, found) in along {
            // A rotation about the opposite axis is a rotation about this axis by the opposite angle.
            let sign = axis.dot(coordinate);
            if axis == coordinate * sign && sign.abs() == 1.0 {
                return Self {
                    axis: found,
                    index,
                    multiplier: sign * multiplier,
                    shift: sign * shift,
                };
            }
        }
        Self {
            axis: WalkAxis::Other(axis.to_array()),
            index,
            multiplier,
            shift,
        }
    }
}

/// The numbers of a pose with its velocities, of a ball, and of a scalar.
const POSE: usize = 13;
const BALL: usize = 7;
const SCALAR: usize = 2;

/// The values of the joints of some configurations, `[number][configuration]`: poses (the base and free joints), balls,
/// scalars, each with its rates.
#[derive(Debug, Clone)]
pub(super) struct JointNumbers {
    pub(super) counts: JointCounts,
    /// The number of configurations.
    lanes: usize,
    numbers: Vec<f64>,
    balls: usize,
    scalars: usize,
}

impl JointNumbers {
    pub(super) fn new(counts: JointCounts, lanes: usize) -> Self {
        let balls = (1 + counts.free) * POSE;
        let scalars = balls + counts.balls * BALL;
        Self {
            counts,
            lanes,
            numbers: vec![0.0; (scalars + counts.scalars * SCALAR) * lanes],
            balls,
            scalars,
        }
    }

    /// Sets the values of a configuration, which fits the tree, and with `rates` how fast they change.
    pub(super) fn set(
        &mut self,
        lane: usize,
        configuration: &Configuration,
        rates: Option<&ConfigurationRates>,
    ) {
        let Self {
            lanes,
            ref mut numbers,
            balls,
            scalars,
            ..
        } = *self;
        let mut put = |first: usize, step: usize, values: &[f64]| {
            let numbers = numbers[first * lanes + lane..].iter_mut();
            for (number, &value) in numbers.step_by(step * lanes).zip(values) {
                *number = value;
            }
        };
        let poses = [&configuration.base].into_iter().chain(&configuration.free);
        for (index, pose) in poses.enumerate() {
            put(index * POSE, 1, &pose.position.to_array());
            put(index * POSE + 3, 1, &pose.rotation.to_array());
        }
        for (index, ball) in configuration.balls.iter().enumerate() {
            put(balls + index * BALL, 1, &ball.to_array());
        }
        if !configuration.scalars.is_empty() {
            put(scalars, SCALAR, &configuration.scalars);
        }
        let Some(rates) = rates else { return };
        for (index, rate) in [&rates.base].into_iter().chain(&rates.free).enumerate() {
            put(index * POSE + 7, 1, &rate.linear.to_array());
            put(index * POSE + 10, 1, &rate.angular.to_array());
        }
        for (index, rate) in rates.balls.iter().enumerate() {
            put(balls + index * BALL + 4, 1, &rate.to_array());
        }
        if !rates.scalars.is_empty() {
            put(scalars + 1, SCALAR, &rates.scalars);
        }
    }

    /// From the first of some configurations on.
    #[inline(always)]
    fn after(&self, lane: usize) -> LaneNumbers<'_> {
        LaneNumbers {
            lanes: self.lanes,
            numbers: &self.numbers[lane..],
            balls: self.balls,
            scalars: self.scalars,
        }
    }
}

/// The values of the joints of as many configurations as a vector has lanes.
#[derive(Clone, Copy)]
struct LaneNumbers<'a> {
    lanes: usize,
    numbers: &'a [f64],
    balls: usize,
    scalars: usize,
}

impl LaneNumbers<'_> {
    #[inline(always)]
    fn number<D: Doubles>(self, index: usize) -> D {
        D::load(&self.numbers[index * self.lanes..])
    }

    #[inline(always)]
    fn vector<D: Doubles>(self, first: usize) -> [D; 3] {
        [
            self.number(first),
            self.number(first + 1),
            self.number(first + 2),
        ]
    }

    #[inline(always)]
    fn rotation<D: Doubles>(self, first: usize) -> [D; 4] {
        let [x, y, z] = self.vector(first);
        unit([x, y, z, self.number(first + 3)])
    }

    /// The value of a hinge or slide.
    #[inline(always)]
    fn scalar<D: Doubles>(self, of: &WalkScalar) -> D {
        let value: D = self.number(self.scalars + of.index * SCALAR);
        D::all(of.multiplier) * value + D::all(of.shift)
    }

    #[inline(always)]
    fn rate<D: Doubles>(self, of: &WalkScalar) -> D {
        D::all(of.multiplier) * self.number(self.scalars + of.index * SCALAR + 1)
    }
}

/// A quaternion of any length but 0, normalised.
#[inline(always)]
fn unit<D: Doubles>(q: [D; 4]) -> [D; 4] {
    let inverse = D::all(1.0) / dot(q, q).root();
    let [x, y, z, w] = q;
    [x * inverse, y * inverse, z * inverse, w * inverse]
}

/// A product of unit quaternions, normalised by a step of Newton's method, so that rounding errors do not add up along
/// the tree.
#[inline(always)]
fn renewed<D: Doubles>(q: [D; 4]) -> [D; 4] {
    let scale = D::all(1.5) - D::all(0.5) * dot(q, q);
    let [x, y, z, w] = q;
    [x * scale, y * scale, z * scale, w * scale]
}

/// The columns of a rotation's matrix: its axes.
#[inline(always)]
fn axes_of<D: Doubles>([x, y, z, w]: [D; 4]) -> [[D; 3]; 3] {
    let one = D::all(1.0);
    let (dx, dy, dz) = (x + x, y + y, z + z);
    let (xx, yy, zz) = (x * dx, y * dy, z * dz);
    let (xy, xz, yz) = (x * dy, x * dz, y * dz);
    let (wx, wy, wz) = (w * dx, w * dy, w * dz);
    [
        [one - (yy + zz), xy + wz, xz - wy],
        [xy - wz, one - (xx + zz), yz + wx],
        [xz + wy, yz - wx, one - (xx + yy)],
    ]
}

/// A vector along axes.
#[inline(always)]
fn along<D: Doubles>(axes: &[[D; 3]; 3], v: [D; 3]) -> [D; 3] {
    sum(
        sum(scaled(axes[0], v[0]), scaled(axes[1], v[1])),
        scaled(axes[2], v[2]),
    )
}

#[inline(always)]
fn all3<D: Doubles>([x, y, z]: [f64; 3]) -> [D; 3] {
    [D::all(x), D::all(y), D::all(z)]
}

/// The product of a rotation and one about a coordinate axis.
#[inline(always)]
fn about<D: Arithmetic, const AXIS: usize>(q: [D; 4], (sine, cosine): (D, D)) -> [D; 4] {
    let (i, j, k) = ((AXIS + 1) % 3, (AXIS + 2) % 3, AXIS);
    let mut found = q;
    found[i] = q[i] * cosine + q[j] * sine;
    found[j] = q[j] * cosine - q[i] * sine;
    found[k] = q[k] * cosine + q[3] * sine;
    found[3] = q[3] * cosine - q[k] * sine;
    found
}

/// The numbers of a frame in the world: rotation, position, axes, velocity, angular velocity.
pub(super) const FRAME: usize = 22;
const ROTATION: usize = 0;
const POSITION: usize = 4;
const AXES: usize = 7;
const VELOCITY: usize = 16;
const ANGULAR_VELOCITY: usize = 19;

/// A frame in the world.
struct Walked<D> {
    rotation: [D; 4],
    position: [D; 3],
    axes: [[D; 3]; 3],
    velocity: [D; 3],
    angular: [D; 3],
}

impl<D: Doubles> Walked<D> {
    #[inline(always)]
    fn load(numbers: &[f64], moves: bool) -> Self {
        #[inline(always)]
        fn three<D: Doubles>(numbers: &[f64], first: usize) -> [D; 3] {
            [
                D::load(&numbers[first * D::COUNT..]),
                D::load(&numbers[(first + 1) * D::COUNT..]),
                D::load(&numbers[(first + 2) * D::COUNT..]),
            ]
        }
        let [x, y, z] = three(numbers, ROTATION);
        let w = D::load(&numbers[(ROTATION + 3) * D::COUNT..]);
        let mut found = Self {
            rotation: [x, y, z, w],
            position: three(numbers, POSITION),
            axes: [
                three(numbers, AXES),
                three(numbers, AXES + 3),
                three(numbers, AXES + 6),
            ],
            velocity: [D::all(0.0); 3],
            angular: [D::all(0.0); 3],
        };
        if moves {
            found.velocity = three(numbers, VELOCITY);
            found.angular = three(numbers, ANGULAR_VELOCITY);
        }
        found
    }

    #[inline(always)]
    fn store(&self, numbers: &mut [f64], moves: bool) {
        #[inline(always)]
        fn put<D: Doubles>(numbers: &mut [f64], first: usize, values: &[D]) {
            let lanes = numbers[first * D::COUNT..].chunks_exact_mut(D::COUNT);
            for (lanes, &value) in lanes.zip(values) {
                value.store(lanes);
            }
        }
        put(numbers, ROTATION, &self.rotation);
        put(numbers, POSITION, &self.position);
        for (index, axis) in self.axes.iter().enumerate() {
            put(numbers, AXES + 3 * index, axis);
        }
        if moves {
            put(numbers, VELOCITY, &self.velocity);
            put(numbers, ANGULAR_VELOCITY, &self.angular);
        }
    }

    /// Shifts the origin by a vector in the world's axes, which moves along.
    #[inline(always)]
    fn shift(&mut self, arm: [D; 3], moves: bool) {
        self.position = sum(self.position, arm);
        if moves {
            self.velocity = sum(self.velocity, cross3(self.angular, arm));
        }
    }

    #[inline(always)]
    fn rotate(&mut self, rotation: [D; 4]) {
        self.rotation = rotation;
        self.axes = axes_of(rotation);
    }

    /// After the joint of a frame, whose frame above this was.
    #[inline(always)]
    fn step(&mut self, frame: &WalkFrame, joints: LaneNumbers<'_>, moves: bool) {
        if let Some(offset) = frame.offset {
            self.shift(along(&self.axes, all3(offset)), moves);
        }
        if let Some([x, y, z, w]) = frame.rest {
            let rest = [D::all(x), D::all(y), D::all(z), D::all(w)];
            let rotation = product(self.rotation, rest);
            match frame.motion {
                // Not normalised here: below, the joint rotates it further, and then it is normalised.
                WalkMotion::Hinge(_) | WalkMotion::Ball(_) => self.rotation = rotation,
                _ => self.rotate(renewed(rotation)),
            }
        }
        match &frame.motion {
            WalkMotion::Fixed | WalkMotion::Root(_) => {}
            WalkMotion::Hinge(hinge) => {
                let half: D = joints.scalar::<D>(hinge) * D::all(0.5);
                let waves = half.each(sine_cosine);
                let rotation = match hinge.axis {
                    WalkAxis::X => about::<D, 0>(self.rotation, waves),
                    WalkAxis::Y => about::<D, 1>(self.rotation, waves),
                    WalkAxis::Z => about::<D, 2>(self.rotation, waves),
                    WalkAxis::Other(axis) => {
                        let [x, y, z] = scaled(all3(axis), waves.0);
                        product(self.rotation, [x, y, z, waves.1])
                    }
                };
                self.rotate(renewed(rotation));
                if moves {
                    let rate = self.axis(&hinge.axis, joints.rate(hinge));
                    self.angular = sum(self.angular, rate);
                }
            }
            WalkMotion::Slide(slide) => {
                self.shift(self.axis(&slide.axis, joints.scalar(slide)), moves);
                if moves {
                    let rate = self.axis(&slide.axis, joints.rate(slide));
                    self.velocity = sum(self.velocity, rate);
                }
            }
            WalkMotion::Ball(ball) => {
                let first = joints.balls + ball * BALL;
                self.rotate(renewed(product(self.rotation, joints.rotation(first))));
                if moves {
                    let rate = along(&self.axes, joints.vector(first + 4));
                    self.angular = sum(self.angular, rate);
                }
            }
            WalkMotion::Free(pose) => {
                let first = pose * POSE;
                self.shift(along(&self.axes, joints.vector(first)), moves);
                if moves {
                    let rate = along(&self.axes, joints.vector(first + 7));
                    self.velocity = sum(self.velocity, rate);
                    let rate = along(&self.axes, joints.vector(first + 10));
                    self.angular = sum(self.angular, rate);
                }
                let rotation = joints.rotation(first + 3);
                self.rotate(renewed(product(self.rotation, rotation)));
            }
        }
    }

    /// An axis of this frame in the world's axes, so many times.
    #[inline(always)]
    fn axis(&self, axis: &WalkAxis, factor: D) -> [D; 3] {
        match *axis {
            WalkAxis::X => scaled(self.axes[0], factor),
            WalkAxis::Y => scaled(self.axes[1], factor),
            WalkAxis::Z => scaled(self.axes[2], factor),
            WalkAxis::Other(axis) => scaled(along(&self.axes, all3(axis)), factor),
        }
    }
}

/// Computes the frames of as many configurations as a vector has lanes, from the first of them on, to `walked`, which
/// has [`FRAME`] vectors for each.
#[inline(always)]
pub(super) fn walk<D: Doubles>(
    frames: &[WalkFrame],
    joints: &JointNumbers,
    first: usize,
    moves: bool,
    walked: &mut [f64],
) {
    let (joints, each) = (joints.after(first), FRAME * D::COUNT);
    for (index, frame) in frames.iter().enumerate() {
        let (before, here) = walked.split_at_mut(index * each);
        let state = match frame.motion {
            WalkMotion::Root(pose) => {
                let first = pose * POSE;
                let rotation = joints.rotation(first + 3);
                Walked {
                    position: joints.vector(first),
                    rotation,
                    axes: axes_of(rotation),
                    velocity: joints.vector(first + 7),
                    angular: joints.vector(first + 10),
                }
            }
            _ => {
                let mut state = Walked::<D>::load(&before[frame.above * each..][..each], moves);
                state.step(frame, joints, moves);
                state
            }
        };
        state.store(&mut here[..each], moves);
    }
}

/// The numbers of a frame among those of all.
#[inline(always)]
pub(super) fn numbers_of<D: Doubles>(walked: &[f64], frame: usize) -> &[f64] {
    let each = FRAME * D::COUNT;
    &walked[frame * each..][..each]
}

#[inline(always)]
fn three<D: Doubles>(numbers: &[f64], first: usize, lane: usize) -> [f64; 3] {
    [
        numbers[first * D::COUNT + lane],
        numbers[(first + 1) * D::COUNT + lane],
        numbers[(first + 2) * D::COUNT + lane],
    ]
}

#[inline(always)]
pub(super) fn position<D: Doubles>(numbers: &[f64], lane: usize) -> [f64; 3] {
    three::<D>(numbers, POSITION, lane)
}

#[inline(always)]
pub(super) fn rotation<D: Doubles>(numbers: &[f64], lane: usize) -> [f64; 4] {
    let [x, y, z] = three::<D>(numbers, ROTATION, lane);
    [x, y, z, numbers[(ROTATION + 3) * D::COUNT + lane]]
}

#[inline(always)]
pub(super) fn velocity<D: Doubles>(numbers: &[f64], lane: usize) -> [f64; 3] {
    three::<D>(numbers, VELOCITY, lane)
}

#[inline(always)]
pub(super) fn angular_velocity<D: Doubles>(numbers: &[f64], lane: usize) -> [f64; 3] {
    three::<D>(numbers, ANGULAR_VELOCITY, lane)
}

/// A body by the numbers of its frame, with the velocity of a point of it by those of the point's.
#[inline(always)]
pub(super) fn motion_of<D: Doubles>([body, point]: [&[f64]; 2], lane: usize) -> BodyMotion {
    BodyMotion {
        pose: BodyPose {
            position: position::<D>(body, lane).into(),
            rotation: DQuat::from_array(rotation::<D>(body, lane)),
        },
        velocity: BodyVelocity {
            linear: velocity::<D>(point, lane).into(),
            angular: angular_velocity::<D>(point, lane).into(),
        },
    }
}
