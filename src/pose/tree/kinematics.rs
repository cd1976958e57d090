//! Forward kinematics: bodies from the values of joints.

use glam::DVec3;

use crate::pose::tree::configuration::check_counts;
use crate::pose::tree::joint_frames::JointFrames;
use crate::pose::tree::walk::{
    FRAME, JointNumbers, WalkFrame, angular_velocity, motion_of, numbers_of, position, rotation,
    velocity, walk,
};
use crate::pose::tree::{
    BodyMotion, BodyPose, Configuration, ConfigurationRates, JointCounts, Tree, TreeError,
};
use crate::simd::dispatch::{InLanes, VectorWidth, in_lanes_of};
use crate::simd::doubles::Doubles;
use crate::simd::lanes::{Lanes, MAX_LANES};

/// The bodies of a tree in some order, prepared for computing them from many configurations, several at a time. Made by
/// [`Tree::walk`].
///
/// ```
/// use tumble::glam::{DQuat, DVec3};
/// use tumble::trees::{BodyArrays, BodyRows, JointKind, Tree, TreeBody, TreeJoint};
/// let tree = Tree::new(vec![TreeBody {
///     name: "slider".to_owned(),
///     parent: None,
///     position: DVec3::X,
///     rotation: DQuat::IDENTITY,
///     joints: vec![TreeJoint::new("rail", JointKind::Slide)],
///     mass_centre: None,
/// }])?;
/// let walk = tree.walk(&[0], &[])?;
/// let mut positions = [[0.0; 3]; 3];
/// let arrays = BodyArrays { positions: &mut positions, ..BodyArrays::default() };
/// let at = |sample: usize, state: &mut _| {
///     let (configuration, _): &mut (tumble::trees::Configuration, _) = state;
///     configuration.scalars[0] = sample as f64;
/// };
/// walk.bodies_into(&mut tree.walk_memory(), 3, at, BodyRows::Arrays(arrays))?;
/// assert_eq!(positions, [[1.0, 0.0, 0.0], [1.0, 0.0, 1.0], [1.0, 0.0, 2.0]]);
/// # Ok::<(), tumble::trees::TreeError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TreeWalk {
    counts: JointCounts,
    frames: Vec<WalkFrame>,
    /// The frame of each body, and the one at whose origin its velocity is.
    bodies: Vec<[usize; 2]>,
}

/// Memory for [`TreeWalk::bodies_into`], which serves one call after another.
#[derive(Debug, Clone)]
pub struct WalkMemory {
    state: (Configuration, ConfigurationRates),
    joints: JointNumbers,
    frames: Vec<f64>,
}

/// Where bodies are written, `[configuration][body]`.
#[derive(Debug)]
pub enum BodyRows<'a> {
    /// All numbers of a body together.
    Motions(&'a mut [BodyMotion]),
    /// Each quantity in an array of its own.
    Arrays(BodyArrays<'a>),
}

/// Arrays of the bodies' quantities, in metres and seconds. Arrays that are empty are not computed.
#[derive(Debug, Default)]
pub struct BodyArrays<'a> {
    /// The positions of the bodies' origins in the world.
    pub positions: &'a mut [[f64; 3]],
    /// The rotations in the world.
    pub rotations: &'a mut [[f64; 4]],
    /// The velocities of the bodies' points in the world.
    pub velocities: &'a mut [[f64; 3]],
    /// The angular velocities about the world's axes.
    pub angular_velocities: &'a mut [[f64; 3]],
    /// Whether rotations are `w x y z`, not `x y z w`.
    pub is_w_first: bool,
}

impl BodyArrays<'_> {
    /// Splits off the arrays of the first bodies.
    #[must_use]
    pub fn split_off(&mut self, bodies: usize) -> Self {
        fn first<'a, T>(of: &mut &'a mut [T], count: usize) -> &'a mut [T] {
            of.split_off_mut(..count.min(of.len())).unwrap_or_default()
        }
        Self {
            positions: first(&mut self.positions, bodies),
            rotations: first(&mut self.rotations, bodies),
            velocities: first(&mut self.velocities, bodies),
            angular_velocities: first(&mut self.angular_velocities, bodies),
            is_w_first: self.is_w_first,
        }
    }
}

impl BodyRows<'_> {
    fn check(&self, bodies: usize) -> Result<(), TreeError> {
        let count = |found: usize, other: usize| ("rows of bodies", found, other);
        match self {
            Self::Motions(rows) => check_counts([count(rows.len(), bodies)]),
            Self::Arrays(arrays) => {
                let lengths = [
                    arrays.positions.len(),
                    arrays.rotations.len(),
                    arrays.velocities.len(),
                    arrays.angular_velocities.len(),
                ];
                check_counts(lengths.map(|length| match length {
                    0 => count(0, 0),
                    length => count(length, bodies),
                }))
            }
        }
    }

    fn have_velocities(&self) -> bool {
        match self {
            Self::Motions(_) => true,
            Self::Arrays(arrays) => {
                !(arrays.velocities.is_empty() && arrays.angular_velocities.is_empty())
            }
        }
    }
}

impl Tree {
    /// Prepares computing these bodies (indices of [`Tree::bodies`]) from many configurations. If `points` is empty,
    /// velocities are those of the bodies' origins. Otherwise it has a point for each body of the tree, in the body's
    /// frame, such as the centre of mass, and velocities are those of these points.
    ///
    /// # Errors
    /// When a body does not exist, or there is not a point for each body.
    pub fn walk(&self, bodies: &[usize], points: &[DVec3]) -> Result<TreeWalk, TreeError> {
        self.check_bodies(bodies, points)?;
        let found = JointFrames::new(self, true, points);
        let frame = |&body: &usize| [found.bodies[body], found.points[body]];
        Ok(TreeWalk {
            counts: self.counts,
            frames: found.frames.iter().map(WalkFrame::new).collect(),
            bodies: bodies.iter().map(frame).collect(),
        })
    }

    /// Memory for walks along this tree.
    #[must_use]
    pub fn walk_memory(&self) -> WalkMemory {
        WalkMemory {
            state: (self.rest(), self.no_rates()),
            joints: JointNumbers::new(self.counts, MAX_LANES),
            frames: Vec::new(),
        }
    }

    /// The pose of each body in the world, in the order of [`Tree::bodies`].
    ///
    /// # Errors
    /// When the configuration has not one finite value for each joint.
    pub fn poses(&self, configuration: &Configuration) -> Result<Vec<BodyPose>, TreeError> {
        configuration.check(self.counts)?;
        let motions = self.walk.of_one(configuration, None);
        Ok(motions.into_iter().map(|motion| motion.pose).collect())
    }

    /// The pose of each body in the world, and its velocities in the world's axes, in the order of [`Tree::bodies`]. For
    /// many configurations, [`Tree::walk`] is faster.
    ///
    /// # Errors
    /// When the configuration or the rates have not one finite value for each joint.
    pub fn motions(
        &self,
        configuration: &Configuration,
        rates: &ConfigurationRates,
    ) -> Result<Vec<BodyMotion>, TreeError> {
        configuration.check(self.counts)?;
        rates.check(self.counts)?;
        Ok(self.walk.of_one(configuration, Some(rates)))
    }
}

impl TreeWalk {
    /// The bodies of one configuration, which fits the tree.
    fn of_one(
        &self,
        configuration: &Configuration,
        rates: Option<&ConfigurationRates>,
    ) -> Vec<BodyMotion> {
        let mut joints = JointNumbers::new(self.counts, 1);
        joints.set(0, configuration, rates);
        let mut walked = vec![0.0; self.frames.len() * FRAME];
        walk::<f64>(&self.frames, &joints, 0, rates.is_some(), &mut walked);
        let motion =
            |body: &[usize; 2]| motion_of::<f64>(body.map(|it| numbers_of::<f64>(&walked, it)), 0);
        self.bodies.iter().map(motion).collect()
    }

    /// Computes the bodies of `count` configurations. For each one, `at` is called with its index and with a state, in
    /// which it stores the values and the rates of this configuration. The state is first that of [`Tree::rest`], then
    /// what the call before left in it; so set all values that change. `memory` comes from [`Tree::walk_memory`] of the
    /// same tree.
    ///
    /// The bits are those of [`Tree::motions`].
    ///
    /// # Errors
    /// * When a configuration or its rates have not one finite value for each joint.
    /// * When an array is not as long as the configurations times the bodies.
    pub fn bodies_into(
        &self,
        memory: &mut WalkMemory,
        count: usize,
        mut at: impl FnMut(usize, &mut (Configuration, ConfigurationRates)),
        mut rows: BodyRows<'_>,
    ) -> Result<(), TreeError> {
        rows.check(count.saturating_mul(self.bodies.len()))?;
        let moves = rows.have_velocities();
        let WalkMemory {
            state,
            joints,
            frames,
        } = memory;
        if joints.counts != self.counts {
            *joints = JointNumbers::new(self.counts, MAX_LANES);
        }
        frames.resize(self.frames.len() * FRAME * MAX_LANES, 0.0);
        let width = VectorWidth::widest();
        for first in (0..count).step_by(MAX_LANES) {
            let lanes = MAX_LANES.min(count - first);
            for lane in 0..lanes {
                at(first + lane, state);
                let (configuration, rates) = &*state;
                configuration.check(self.counts)?;
                if moves {
                    rates.check(self.counts)?;
                }
                joints.set(lane, configuration, moves.then_some(rates));
            }
            let mut block = WalkBlock {
                walk: self,
                joints,
                moves,
                frames,
                rows: &mut rows,
                first,
                lanes,
            };
            in_lanes_of(width, &mut block);
        }
        Ok(())
    }
}

/// Up to [`MAX_LANES`] configurations.
struct WalkBlock<'a, 'b> {
    walk: &'a TreeWalk,
    joints: &'a JointNumbers,
    moves: bool,
    frames: &'a mut [f64],
    rows: &'a mut BodyRows<'b>,
    /// The index of the first configuration, and how many there are.
    first: usize,
    lanes: usize,
}

impl InLanes for WalkBlock<'_, '_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        for lane in (0..self.lanes).step_by(L::COUNT) {
            let frames = &self.walk.frames;
            walk::<L::Doubles>(frames, self.joints, lane, self.moves, self.frames);
            self.put::<L::Doubles>(lane);
        }
    }
}

impl WalkBlock<'_, '_> {
    /// Writes the configurations from `lane` on, which were walked.
    #[inline(always)]
    fn put<D: Doubles>(&mut self, lane: usize) {
        let count = D::COUNT.min(self.lanes - lane);
        let bodies = self.walk.bodies.len();
        for (index, &[body, point]) in self.walk.bodies.iter().enumerate() {
            let body = numbers_of::<D>(self.frames, body);
            let point = numbers_of::<D>(self.frames, point);
            let at = ((self.first + lane) * bodies + index, bodies);
            match &mut *self.rows {
                BodyRows::Motions(rows) => {
                    put(rows, at, count, |lane| motion_of::<D>([body, point], lane));
                }
                BodyRows::Arrays(arrays) => {
                    put(arrays.positions, at, count, |lane| {
                        position::<D>(body, lane)
                    });
                    match arrays.is_w_first {
                        true => put(arrays.rotations, at, count, |lane| {
                            let [x, y, z, w] = rotation::<D>(body, lane);
                            [w, x, y, z]
                        }),
                        false => put(arrays.rotations, at, count, |lane| {
                            rotation::<D>(body, lane)
                        }),
                    }
                    put(arrays.velocities, at, count, |lane| {
                        velocity::<D>(point, lane)
                    });
                    put(arrays.angular_velocities, at, count, |lane| {
                        angular_velocity::<D>(point, lane)
                    });
                }
            }
        }
    }
}

/// Stores the values of some lanes, each so many elements after the one before, in an array that is not left out.
#[inline(always)]
fn put<T>(array: &mut [T], (first, step): (usize, usize), count: usize, of: impl Fn(usize) -> T) {
    let output = array.get_mut(first..).unwrap_or_default();
    for (lane, value) in output.iter_mut().step_by(step).take(count).enumerate() {
        *value = of(lane);
    }
}
