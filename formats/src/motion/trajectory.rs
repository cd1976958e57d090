//! Errors of an estimated path of one body against a reference, as benchmarks of odometry and SLAM define them. They
//! are computed after an alignment, for each pose (absolute) or for steps of some seconds or metres (relative). The
//! results are those of `evo`.

use std::fmt;

use glam::{DMat3, DQuat, DVec3};

/// The position and rotation of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// The position in the world.
    pub position: DVec3,
    /// The rotation, a unit quaternion.
    pub rotation: DQuat,
}

/// The degrees of freedom of an alignment. An estimate is aligned to its reference by least squares of the positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Align {
    /// No alignment: both paths have the same frame.
    #[default]
    None,
    /// Translation.
    Position,
    /// Translation, and rotation about z.
    Yaw,
    /// Translation and rotation (Horn 1987, the rotation of Umeyama 1991).
    Se3,
    /// Translation, rotation and scale (Umeyama 1991), for estimates of a single camera.
    Sim3,
}

tumble::names! {
    Align, "alignment",
    None => "none",
    Position => "position",
    Yaw => "yaw",
    Se3 => "se3",
    Sim3 => "sim3",
}

/// How the poses of a reference and of an estimate are associated. Both are compared at the times of the path that has
/// fewer poses.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Associate {
    /// The denser path is interpolated by lines and arcs.
    #[default]
    Interpolated,
    /// The nearest pose of the denser path in time, if it is at most this many seconds away. So does `evo`.
    Nearest(f64),
}

/// A text is not a kind of association.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("neither `interpolated` nor `nearest:0.01`, the longest time between two poses in seconds")]
pub struct AssociateError;

/// Parses `interpolated` or `nearest:0.01`.
impl std::str::FromStr for Associate {
    type Err = AssociateError;

    fn from_str(text: &str) -> Result<Self, AssociateError> {
        if text == "interpolated" {
            return Ok(Self::Interpolated);
        }
        let limit = text.strip_prefix("nearest:").ok_or(AssociateError)?;
        match limit.parse::<f64>() {
            Ok(limit) if limit.is_finite() && limit >= 0.0 => Ok(Self::Nearest(limit)),
            _ => Err(AssociateError),
        }
    }
}

/// Why positions do not determine the rotation of an alignment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Undetermined {
    /// The positions of a path are all the same.
    Still,
    /// The positions of a path lie on a straight line, and any rotation about it fits as well.
    Line,
    /// The positions of the paths are not correlated, and every rotation fits as well.
    Uncorrelated,
}

impl Undetermined {
    /// A name: `still`, `line` or `uncorrelated`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Still => "still",
            Self::Line => "line",
            Self::Uncorrelated => "uncorrelated",
        }
    }
}

impl fmt::Display for Undetermined {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Still => "the positions of a path are all the same",
            Self::Line => "the positions of a path lie on a straight line",
            Self::Uncorrelated => "the positions of the paths are not correlated",
        })
    }
}

/// The transform that aligns an estimate to its reference: first `scale`, then `rotation`, then `translation`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alignment {
    /// Scale; 1 except for [`Align::Sim3`].
    pub scale: f64,
    /// Rotation of the whole path.
    pub rotation: DQuat,
    /// Translation of the whole path.
    pub translation: DVec3,
    /// Why the positions do not determine the rotation, if they do not.
    pub undetermined: Option<Undetermined>,
}

/// The length of a step for relative errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Step {
    /// Duration, in seconds.
    Seconds(f64),
    /// Distance along the estimate, in metres.
    Metres(f64),
}

/// A text is not a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("not a step over 0, such as 1s or 0.5m")]
pub struct StepError;

/// Parses `1s` or `0.5m`.
impl std::str::FromStr for Step {
    type Err = StepError;

    fn from_str(text: &str) -> Result<Self, StepError> {
        let unit = text.chars().last().map_or(0, char::len_utf8);
        let (number, unit) = text.split_at(text.len() - unit);
        let number = number.trim().parse::<f64>().map_err(|_| StepError)?;
        let is_length = number.is_finite() && number > 0.0;
        match unit {
            "s" if is_length => Ok(Self::Seconds(number)),
            "m" if is_length => Ok(Self::Metres(number)),
            _ => Err(StepError),
        }
    }
}

/// The errors of poses, or of steps between poses.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Errors {
    /// Distances, in the unit of the positions.
    pub distances: Vec<f64>,
    /// Angles, in radians.
    pub angles: Vec<f64>,
}

/// Statistics of errors.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Statistics {
    /// Root mean square.
    pub rmse: f64,
    /// Mean.
    pub mean: f64,
    /// Median: the middle error, or the mean of the middle two.
    pub median: f64,
    /// Standard deviation of these errors (not an estimate from a sample).
    pub deviation: f64,
    /// Smallest error.
    pub smallest: f64,
    /// Largest error.
    pub largest: f64,
}

impl Alignment {
    /// The best alignment of two paths with the same poses. If the positions do not determine the rotation, as on a
    /// straight line, it is the smallest of the best, and `undetermined` says why.
    #[must_use]
    pub fn of(reference: &[Pose], estimate: &[Pose], align: Align) -> Self {
        let nothing = Self {
            scale: 1.0,
            rotation: DQuat::IDENTITY,
            translation: DVec3::ZERO,
            undetermined: None,
        };
        let count = reference.len().min(estimate.len());
        if align == Align::None || count == 0 {
            return nothing;
        }
        let mean = |poses: &[Pose]| {
            let sum: DVec3 = poses[..count].iter().map(|pose| pose.position).sum();
            sum / count as f64
        };
        let (to, from) = (mean(reference), mean(estimate));
        let pairs = || {
            let both = reference.iter().zip(estimate);
            both.map(|(a, b)| (a.position - to, b.position - from))
        };
        let level = |v: DVec3| match align {
            Align::Yaw => v.with_z(0.0),
            _ => v,
        };
        // The computed mean of equal numbers may differ from them by rounding.
        let extent = |poses: &[Pose], mean: DVec3| {
            let apart = poses[..count]
                .iter()
                .map(|it| level(it.position - mean).length());
            apart.fold(0.0, f64::max) / (1.0 + mean.length())
        };
        let is_still = extent(reference, to) < STILL || extent(estimate, from) < STILL;
        // Relative to the largest covariance that paths of these extents can have.
        let is_zero = |covariance: f64| {
            let squares = pairs().map(|(a, b)| [level(a), level(b)].map(DVec3::length_squared));
            let [a, b] = squares.fold([0.0, 0.0], |sum, one| [sum[0] + one[0], sum[1] + one[1]]);
            covariance < UNCORRELATED * (a * b).sqrt()
        };
        let uncorrelated = (DQuat::IDENTITY, Some(Undetermined::Uncorrelated));
        let (rotation, undetermined) = match align {
            Align::None | Align::Position => (DQuat::IDENTITY, None),
            Align::Yaw | Align::Se3 | Align::Sim3 if is_still => {
                (DQuat::IDENTITY, Some(Undetermined::Still))
            }
            Align::Yaw => {
                let (sine, cosine) = pairs().fold((0.0, 0.0), |(sine, cosine), (a, b)| {
                    (sine + b.x * a.y - b.y * a.x, cosine + b.x * a.x + b.y * a.y)
                });
                if is_zero(libm::hypot(sine, cosine)) {
                    uncorrelated
                } else {
                    let (sine, cosine) = libm::sincos(0.5 * libm::atan2(sine, cosine));
                    (DQuat::from_xyzw(0.0, 0.0, sine, cosine), None)
                }
            }
            Align::Se3 | Align::Sim3 => {
                let outer = |(a, b): (DVec3, DVec3)| DMat3::from_cols(a * b.x, a * b.y, a * b.z);
                let covariance: DMat3 = pairs().map(outer).sum();
                match rotation_of_lines(covariance) {
                    _ if is_zero(size(covariance)) => uncorrelated,
                    Some(rotation) => (rotation, Some(Undetermined::Line)),
                    None => (best_rotation(pairs()), None),
                }
            }
        };
        let scale = match align {
            Align::Sim3 => {
                let along: f64 = pairs().map(|(a, b)| a.dot(rotation * b)).sum();
                let size: f64 = pairs().map(|(_, b)| b.length_squared()).sum();
                // If the estimate does not move, no scale can be determined, so it stays 1.
                if size > 0.0 && along > 0.0 {
                    along / size
                } else {
                    1.0
                }
            }
            _ => 1.0,
        };
        Self {
            scale,
            rotation,
            translation: to - rotation * (from * scale),
            undetermined,
        }
    }

    /// The angle of the rotation, in radians.
    #[must_use]
    pub fn angle(&self) -> f64 {
        angle(self.rotation)
    }

    /// The aligned pose of a pose of the estimate.
    #[must_use]
    pub fn apply(&self, pose: Pose) -> Pose {
        Pose {
            position: self.rotation * (pose.position * self.scale) + self.translation,
            rotation: self.rotation * pose.rotation,
        }
    }
}

/// The angle of a rotation, in radians.
fn angle(rotation: DQuat) -> f64 {
    2.0 * libm::atan2(rotation.xyz().length(), rotation.w.abs())
}

/// Positions whose distances from their mean are a smaller part of its size are all the same.
const STILL: f64 = 1e-9;

/// If the second singular value of the covariance is at most this part of the first, the positions count as a line.
/// This corresponds to distances from the line of a hundred thousandth of its length; the rounding of f32 is a
/// hundredth of this.
const LINE: f64 = 1e-10;

/// A covariance counts as 0 if it is a smaller part than this of the largest covariance that such paths can have: it is
/// then due to rounding.
const UNCORRELATED: f64 = 1e-12;

/// The root of the sum of the squares of a matrix's numbers.
fn size(matrix: DMat3) -> f64 {
    let squares = matrix.to_cols_array().map(|it| it * it);
    squares.iter().sum::<f64>().sqrt()
}

/// The smallest rotation of the best from the second positions to the first, if many are the best because one of both
/// paths is a line. The covariance is not 0.
fn rotation_of_lines(covariance: DMat3) -> Option<DQuat> {
    let square = covariance.transpose() * covariance;
    let mut matrix = [[0.0; 4]; 4];
    for (row, from) in matrix.iter_mut().zip(square.transpose().to_cols_array_2d()) {
        row[..3].copy_from_slice(&from);
    }
    let [x, y, z, _] = largest_eigenvector(matrix);
    let from = DVec3::new(x, y, z).try_normalize()?;
    let to = covariance * from;
    let rest = covariance - DMat3::from_cols(to * from.x, to * from.y, to * from.z);
    let is_line = size(rest) <= LINE * to.length();
    let direction = to.try_normalize().filter(|_| is_line)?;
    Some(DQuat::from_rotation_arc(from, direction))
}

/// The rotation from the second vectors to the first by least squares: the eigenvector of the largest eigenvalue of
/// Horn's matrix.
fn best_rotation(pairs: impl Iterator<Item = (DVec3, DVec3)>) -> DQuat {
    let mut s = [[0.0; 3]; 3];
    for (a, b) in pairs {
        for (row, b) in s.iter_mut().zip(b.to_array()) {
            for (sum, a) in row.iter_mut().zip(a.to_array()) {
                *sum += b * a;
            }
        }
    }
    let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = s;
    let matrix = [
        [xx + yy + zz, yz - zy, zx - xz, xy - yx],
        [yz - zy, xx - yy - zz, xy + yx, zx + xz],
        [zx - xz, xy + yx, yy - xx - zz, yz + zy],
        [xy - yx, zx + xz, yz + zy, zz - xx - yy],
    ];
    let [w, x, y, z] = largest_eigenvector(matrix);
    let rotation = DQuat::from_xyzw(x, y, z, w);
    match rotation.length_squared() > 0.5 && rotation.is_finite() {
        true => rotation.normalize(),
        false => DQuat::IDENTITY,
    }
}

/// The eigenvector of the largest eigenvalue of a symmetric matrix, by Jacobi rotations.
fn largest_eigenvector(mut a: [[f64; 4]; 4]) -> [f64; 4] {
    let mut vectors = [[0.0; 4]; 4];
    for (index, row) in vectors.iter_mut().enumerate() {
        row[index] = 1.0;
    }
    // Each round squares the elements off the diagonal; six rounds are enough for f64.
    for _ in 0..16 {
        for p in 0..3 {
            for q in p + 1..4 {
                if a[p][q] == 0.0 {
                    continue;
                }
                let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
                let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let cosine = 1.0 / (t * t + 1.0).sqrt();
                let sine = t * cosine;
                for row in &mut a {
                    (row[p], row[q]) = (
                        cosine * row[p] - sine * row[q],
                        sine * row[p] + cosine * row[q],
                    );
                }
                let (row_p, row_q) = (a[p], a[q]);
                a[p] = std::array::from_fn(|c| cosine * row_p[c] - sine * row_q[c]);
                a[q] = std::array::from_fn(|c| sine * row_p[c] + cosine * row_q[c]);
                for row in &mut vectors {
                    (row[p], row[q]) = (
                        cosine * row[p] - sine * row[q],
                        sine * row[p] + cosine * row[q],
                    );
                }
            }
        }
    }
    // If several eigenvalues are equally large, use the first: it is the identity.
    let mut largest = 0;
    for index in 1..4 {
        if a[index][index] > a[largest][largest] {
            largest = index;
        }
    }
    vectors.map(|row| row[largest])
}

impl Errors {
    fn add(&mut self, distance: f64, between: DQuat) {
        self.distances.push(distance);
        self.angles.push(angle(between));
    }

    /// The absolute errors of an aligned estimate, for each pose.
    #[must_use]
    pub fn absolute(reference: &[Pose], estimate: &[Pose]) -> Self {
        let mut errors = Self::default();
        for (a, b) in reference.iter().zip(estimate) {
            errors.add(
                a.position.distance(b.position),
                a.rotation.conjugate() * b.rotation,
            );
        }
        errors
    }

    /// The relative errors of an estimate, for consecutive steps. A step is from one pose to the first later pose at
    /// a distance or duration of `step` or more. `times` are the times of the poses, in seconds.
    #[must_use]
    pub fn relative(reference: &[Pose], estimate: &[Pose], times: &[f64], step: Step) -> Self {
        let mut errors = Self::default();
        let count = reference.len().min(estimate.len()).min(times.len());
        let (mut start, mut path) = (0, 0.0);
        for end in 1..count {
            path += estimate[end].position.distance(estimate[end - 1].position);
            let is_end = match step {
                // Times with decimals: in f64, 0.3 - 0.2 is less than 0.1.
                Step::Seconds(seconds) => {
                    times[end] - times[start] >= seconds * (1.0 - 1e-9) - 1e-9
                }
                Step::Metres(metres) => path >= metres,
            };
            if !is_end {
                continue;
            }
            let between = |poses: &[Pose]| {
                let (a, b) = (poses[start], poses[end]);
                let back = a.rotation.conjugate();
                (back * (b.position - a.position), back * b.rotation)
            };
            let (q, p) = (between(reference), between(estimate));
            errors.add(q.0.distance(p.0), q.1.conjugate() * p.1);
            (start, path) = (end, 0.0);
        }
        errors
    }
}

impl Statistics {
    /// The statistics of `errors`; `None` if there are none.
    #[must_use]
    pub fn of(errors: &[f64]) -> Option<Self> {
        let mut sorted = errors.to_vec();
        sorted.sort_by(f64::total_cmp);
        let (&smallest, &largest) = (sorted.first()?, sorted.last()?);
        let count = sorted.len();
        let mean = sorted.iter().sum::<f64>() / count as f64;
        let squares = |from: f64| {
            let each = sorted.iter().map(|error| (error - from) * (error - from));
            (each.sum::<f64>() / count as f64).sqrt()
        };
        Some(Self {
            rmse: squares(0.0),
            mean,
            median: f64::midpoint(sorted[(count - 1) / 2], sorted[count / 2]),
            deviation: squares(mean),
            smallest,
            largest,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_of_seconds_or_metres() {
        assert_eq!("1s".parse(), Ok(Step::Seconds(1.0)));
        assert_eq!("0.5 m".parse(), Ok(Step::Metres(0.5)));
        for bad in ["", "s", "1", "0m", "-1s", "infs", "1km", "1\u{e4}"] {
            assert_eq!(bad.parse::<Step>(), Err(StepError), "{bad}");
        }
    }

    fn pose(x: f64, y: f64, z: f64, rotation: DQuat) -> Pose {
        Pose {
            position: DVec3::new(x, y, z),
            rotation,
        }
    }

    fn euler(z: f64, y: f64, x: f64) -> DQuat {
        DQuat::from_rotation_z(z) * DQuat::from_rotation_y(y) * DQuat::from_rotation_x(x)
    }

    /// Two paths by the formulas from which `evo` had them, as text of nine decimals.
    fn paths() -> (Vec<f64>, Vec<Pose>, Vec<Pose>) {
        let times: Vec<f64> = (0..120).map(|index| f64::from(index) * 0.1).collect();
        let off = euler(0.7, 0.1, -0.2);
        let reference = |&t: &f64| {
            pose(
                3.0 * (0.4 * t).sin(),
                2.0 * (0.3 * t).cos() - 1.0,
                0.5 * (0.9 * t).sin(),
                euler(0.5 * t, 0.3 * t.sin(), 0.2 * (0.7 * t).cos()),
            )
        };
        let estimate = |t: &f64| {
            let exact = reference(t);
            let noise = DVec3::new(
                0.05 * (7.0 * t).sin(),
                0.04 * (5.0 * t).cos(),
                0.03 * (11.0 * t + 1.0).sin(),
            );
            let noise_rotation =
                0.05 * DVec3::new((3.0 * t).sin(), (4.0 * t).cos(), (5.0 * t).sin());
            Pose {
                position: 1.25 * (off * exact.position) + DVec3::new(4.0, -2.0, 1.0) + noise,
                rotation: off * exact.rotation * DQuat::from_scaled_axis(noise_rotation),
            }
        };
        let poses = (
            times.iter().map(reference).collect(),
            times.iter().map(estimate).collect(),
        );
        (times, poses.0, poses.1)
    }

    #[track_caller]
    fn check(
        errors: &[f64],
        factor: f64,
        [rmse, mean, median, deviation, smallest, largest]: [f64; 6],
    ) {
        let found = Statistics::of(errors).unwrap();
        for (found, expected) in [
            (found.rmse, rmse),
            (found.mean, mean),
            (found.median, median),
            (found.deviation, deviation),
            (found.smallest, smallest),
            (found.largest, largest),
        ] {
            assert!(
                (found * factor - expected).abs() < 1e-6,
                "{found} {expected}"
            );
        }
    }

    /// Literal numbers of `evo` 1.38.1: rmse, mean, median, std, min, max.
    #[test]
    fn errors_are_those_of_evo() {
        let (times, reference, estimate) = paths();
        let degrees = 1f64.to_degrees();
        let aligned = |align| {
            let alignment = Alignment::of(&reference, &estimate, align);
            let all = estimate.iter().map(|&pose| alignment.apply(pose));
            (alignment.scale, all.collect::<Vec<_>>())
        };
        let none = Errors::absolute(&reference, &aligned(Align::None).1);
        check(
            &none.distances,
            1.0,
            [
                5.70475805, 5.45271117, 5.15185502, 1.67696312, 3.31084375, 8.06736306,
            ],
        );
        check(
            &none.angles,
            degrees,
            [
                42.7809509, 42.7261062, 42.689417, 2.16555186, 38.9251173, 47.1649698,
            ],
        );
        let position = Errors::absolute(&reference, &aligned(Align::Position).1);
        check(
            &position.distances,
            1.0,
            [
                2.08598359,
                1.95953544,
                1.95948477,
                0.715226114,
                0.679865527,
                3.38582153,
            ],
        );
        let se3 = Errors::absolute(&reference, &aligned(Align::Se3).1);
        check(
            &se3.distances,
            1.0,
            [
                0.638505822,
                0.603669464,
                0.597885181,
                0.208021306,
                0.198268225,
                1.00501381,
            ],
        );
        check(
            &se3.angles,
            degrees,
            [
                3.50706813,
                3.41344266,
                3.59005662,
                0.804944776,
                1.53257007,
                4.96704601,
            ],
        );
        let (scale, poses) = aligned(Align::Sim3);
        assert!((scale - 0.799_940_846_216_258_6).abs() < 1e-8, "{scale}");
        let sim3 = Errors::absolute(&reference, &poses);
        check(
            &sim3.distances,
            1.0,
            [
                0.0400288007,
                0.0388615379,
                0.0406924848,
                0.00959613238,
                0.00982890054,
                0.0549403507,
            ],
        );
        let second = Errors::relative(&reference, &poses, &times, Step::Seconds(1.0));
        assert_eq!(second.distances.len(), 11);
        check(
            &second.distances,
            1.0,
            [
                0.060853912,
                0.0564546076,
                0.0512817392,
                0.0227173038,
                0.0232432218,
                0.0986007447,
            ],
        );
        check(
            &second.angles,
            degrees,
            [
                5.73713238, 5.54525287, 5.69377606, 1.47134583, 1.86443607, 7.65201317,
            ],
        );
        let metre = Errors::relative(&reference, &poses, &times, Step::Metres(1.0));
        assert_eq!(metre.distances.len(), 11);
        check(
            &metre.distances,
            1.0,
            [
                0.0519096417,
                0.0488516065,
                0.0482844605,
                0.0175536732,
                0.0220203884,
                0.0795260893,
            ],
        );
        check(
            &metre.angles,
            degrees,
            [
                4.72658892, 4.32203473, 4.68539992, 1.91328479, 1.44900056, 7.03341964,
            ],
        );
        let metre = Errors::relative(&reference, &estimate, &times, Step::Metres(1.0));
        check(
            &metre.distances,
            1.0,
            [
                0.214158861,
                0.210378619,
                0.211151169,
                0.0400606301,
                0.14974747,
                0.274945469,
            ],
        );
    }

    /// A turn about z and a shift are found, and nothing of another turn.
    #[test]
    fn yaw_turns_about_z_alone() {
        let (_, reference, _) = paths();
        let heading = DQuat::from_rotation_z(-2.5);
        let moved = |rotation: DQuat| -> Vec<Pose> {
            let all = reference.iter().map(|pose| Pose {
                position: rotation * pose.position + DVec3::new(1.0, 2.0, 3.0),
                rotation: rotation * pose.rotation,
            });
            all.collect()
        };
        let found = Alignment::of(&reference, &moved(heading), Align::Yaw);
        assert!(found.rotation.angle_between(heading.conjugate()) < 1e-7);
        let errors = Errors::absolute(
            &reference,
            &moved(heading)
                .into_iter()
                .map(|pose| found.apply(pose))
                .collect::<Vec<_>>(),
        );
        assert!(Statistics::of(&errors.distances).unwrap().largest < 1e-12);
        let tilted = Alignment::of(&reference, &moved(euler(0.4, 0.3, 0.0)), Align::Yaw);
        assert!(tilted.rotation.xyz().truncate().length() < 1e-15);
    }

    /// On a line, any turn about it fits as well: the smallest rotation is that between the directions.
    #[test]
    fn a_line_is_turned_by_the_smallest_rotation() {
        let along = |direction: DVec3| -> Vec<Pose> {
            let at = (0..20).map(|i| direction * f64::from(i * i) + DVec3::new(5.0, -2.0, 1.0));
            at.map(|position| pose(position.x, position.y, position.z, DQuat::IDENTITY))
                .collect()
        };
        let direction = DVec3::new(0.6, 0.0, 0.8);
        let rotated = DQuat::from_rotation_y(0.4) * direction;
        for align in [Align::Se3, Align::Sim3] {
            let found = Alignment::of(&along(rotated), &along(direction), align);
            assert_eq!(found.undetermined, Some(Undetermined::Line));
            assert!((found.angle() - 0.4).abs() < 1e-9, "{}", found.angle());
            let same = Alignment::of(&along(direction), &along(direction), align);
            assert!(same.angle() < 1e-9, "{}", same.angle());
        }
        // A turn about z alone is determined, and so is the turn of a path with a bend.
        let found = Alignment::of(&along(rotated), &along(direction), Align::Yaw);
        assert_eq!(found.undetermined, None);
        let mut bent = along(direction);
        bent[3].position.y += 0.1;
        assert_eq!(Alignment::of(&bent, &bent, Align::Se3).undetermined, None);
    }

    /// Two lines along x whose covariance is 0: no rotation fits better than another.
    #[test]
    fn paths_that_are_not_correlated_are_not_turned() {
        let along = |all: [f64; 3], direction: DVec3| -> Vec<Pose> {
            let at = all.map(|x| direction * x);
            at.map(|position| pose(position.x, position.y, position.z, DQuat::IDENTITY))
                .to_vec()
        };
        let direction = DVec3::new(0.3, 0.1, 0.7).normalize();
        for direction in [DVec3::X, direction] {
            let reference = along([-1.0, 0.0, 1.0], direction);
            let estimate = along([1.0, -2.0, 1.0], direction);
            for align in [Align::Yaw, Align::Se3, Align::Sim3] {
                let found = Alignment::of(&reference, &estimate, align);
                assert_eq!(found.rotation, DQuat::IDENTITY, "{align}");
                assert_eq!(found.undetermined, Some(Undetermined::Uncorrelated));
                assert_eq!(found.scale, 1.0);
            }
        }
    }

    #[test]
    fn associations_are_by_interpolation_or_the_nearest() {
        assert_eq!("interpolated".parse(), Ok(Associate::Interpolated));
        assert_eq!("nearest:0.02".parse(), Ok(Associate::Nearest(0.02)));
        for bad in [
            "",
            "nearest",
            "nearest:",
            "nearest:-1",
            "nearest:nan",
            "0.01",
        ] {
            assert_eq!(bad.parse::<Associate>(), Err(AssociateError), "{bad}");
        }
    }

    #[test]
    fn paths_without_a_direction_stay_as_they_are() {
        let still = vec![pose(1.0, 2.0, 3.0, DQuat::IDENTITY); 3];
        let found = Alignment::of(&still, &still, Align::Sim3);
        assert_eq!(found.apply(still[0]), still[0]);
        assert_eq!(found.undetermined, Some(Undetermined::Still));
        assert_eq!(Alignment::of(&[], &[], Align::Se3).scale, 1.0);
        assert_eq!(Statistics::of(&[]), None);
    }
}
