//! Plans walkers that wait for each other, and for bodies that move on known tracks.
//!
//! Walkers avoid moving obstacles by their speed, not by their route (Kant and Zucker, 1986): each walker keeps its
//! route and waits on it. The *delay* is w = t - s/v, where s is the distance walked and v the speed. Walking keeps w
//! constant, and waiting increases it. In the plane (s, w), a moving obstacle is a convex region for each pair of a
//! straight stretch of the route and a straight stretch of the obstacle's track. A walker's plan is a staircase
//! between these regions with the least delay at its end. Walkers are planned one after another; each is an obstacle
//! for the next.

mod plan;
mod region;

use glam::DVec3;
use thiserror::Error;

use crate::route::Route;
use crate::walkers::plan::Stay;

/// A body that moves on a known track, straight from each position to the next.
#[derive(Debug, Clone, PartialEq)]
pub struct Mover {
    /// Times in seconds, increasing, and positions. The body does not exist before the first and after the last time.
    pub track: Vec<(f64, DVec3)>,
    /// Radius of the ball that the body occupies.
    pub radius: f64,
}

/// A walker on a route, which waits on it where necessary.
#[derive(Debug, Clone, PartialEq)]
pub struct Walker {
    /// The route that it walks.
    pub route: Route,
    /// Radius of the ball that the walker occupies.
    pub radius: f64,
    /// Speed, in units of the mesh per second.
    pub speed: f64,
    /// Time at which it starts to walk, in seconds. From time 0 until then it stands at the start of its route.
    pub start: f64,
}

/// The positions of a walker over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// For each point: the time in seconds, the distance walked until then in the unit of the mesh, and the position.
    /// Between two entries with the same position the walker waits.
    pub times: Vec<(f64, f64, DVec3)>,
    /// Time of arrival, in seconds. The walker then stays at its goal.
    pub arrival: f64,
}

/// Why a walker has no plan.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum WalkerError {
    /// The speed is not a positive finite number, or the radius or the start is not a finite number of 0 or more.
    #[error(
        "speed {speed}, radius {radius}, start {start}: give a speed over 0, and others of 0 or more"
    )]
    Numbers {
        /// Speed, in units of the mesh per second.
        speed: f64,
        /// Radius, in units of the mesh.
        radius: f64,
        /// Start, in seconds.
        start: f64,
    },
    /// No sequence of waits on the route avoids the other bodies.
    #[error(
        "cannot pass: wherever it waits on its route, something comes too near; give it another route, or plan it before others"
    )]
    Blocked,
    /// The route and the tracks of the others have too many stretches.
    #[error(
        "{stretches} stretches of the route and {others} of other tracks are too many; simplify the tracks"
    )]
    TooMany {
        /// Number of points of the route.
        stretches: usize,
        /// Number of stretches of all other tracks.
        others: usize,
    },
}

/// The largest number of stretches of a route times stretches of others.
const MAX_PAIRS: usize = 100_000_000;

/// Plans one walker after another. Each keeps away from all movers and from all walkers before it. A walker without a
/// plan is not an obstacle for others.
///
/// The search is not complete: with another order of the walkers, or other routes, there may be plans where this
/// finds none.
#[must_use]
pub fn plan(walkers: &[Walker], movers: &[Mover]) -> Vec<Result<Plan, WalkerError>> {
    let mut others: Vec<(Mover, Stay)> = movers
        .iter()
        .map(|mover| (mover.clone(), Stay::Leaves))
        .collect();
    let mut plans = Vec::with_capacity(walkers.len());
    for walker in walkers {
        let planned = plan_one(walker, &others);
        if let Ok(plan) = &planned {
            let track = plan
                .times
                .iter()
                .map(|&(time, _, position)| (time, position));
            let radius = walker.radius;
            let track = track.collect();
            others.push((Mover { track, radius }, Stay::Remains));
        }
        plans.push(planned);
    }
    plans
}

fn plan_one(walker: &Walker, others: &[(Mover, Stay)]) -> Result<Plan, WalkerError> {
    let &Walker {
        radius,
        speed,
        start,
        ..
    } = walker;
    let is_good = speed > 0.0 && speed.is_finite() && radius >= 0.0 && radius.is_finite();
    if !(is_good && start >= 0.0 && start.is_finite()) {
        return Err(WalkerError::Numbers {
            speed,
            radius,
            start,
        });
    }
    let stretches = walker.route.points.len();
    let stretches_of_others = others
        .iter()
        .map(|(mover, _)| mover.track.len() + 1)
        .sum::<usize>();
    if stretches.saturating_mul(stretches_of_others) > MAX_PAIRS {
        return Err(WalkerError::TooMany {
            stretches,
            others: stretches_of_others,
        });
    }
    plan::plan(walker, others)
}
