//! Walkers that wait for each other, and for bodies that move on known tracks.
//!
//! Moving obstacles are avoided by speed, not by the route (Kant and Zucker, 1986): each walker keeps its
//! route, and waits on it. With the *delay* w = t - s/v (s the distance walked, v the speed) walking keeps w
//! and waiting raises it, and the obstacle of a moving thing in (s, w) is a convex region for each
//! straight stretch of both. A walker's plan is a staircase between those regions with the least
//! delay at its end. One walker is planned after another; each is an obstacle for the next.

mod plan;
mod region;

use glam::DVec3;
use thiserror::Error;

use crate::route::Route;
use crate::walkers::plan::Stay;

/// Something that moves on a known track: straight from each position to the next.
#[derive(Debug, Clone, PartialEq)]
pub struct Mover {
    /// Seconds and positions, times increasing. It is not there before the first and after the last.
    pub track: Vec<(f64, DVec3)>,
    /// Of the ball that it fills.
    pub radius: f64,
}

/// Somebody who walks a route, and waits on it where that is needed.
#[derive(Debug, Clone, PartialEq)]
pub struct Walker {
    /// The route that it walks.
    pub route: Route,
    /// Of the ball that it fills.
    pub radius: f64,
    /// In units of the mesh a second.
    pub speed: f64,
    /// When it sets out, in seconds. Before that it stands at its start, from time 0 on.
    pub start: f64,
}

/// When a walker is where.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Seconds, the distance walked until then, in the unit of the mesh, and the position. Two with the same
    /// position are a wait between them.
    pub times: Vec<(f64, f64, DVec3)>,
    /// When it arrives, in seconds. It stays at its goal.
    pub arrival: f64,
}

/// Why a walker has no plan.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum WalkerError {
    /// Its speed is not a number over 0, its radius or its start not one of 0 or more.
    #[error(
        "speed {speed}, radius {radius}, start {start}: give a speed over 0, and others of 0 or more"
    )]
    Numbers {
        /// In units a second.
        speed: f64,
        /// In units.
        radius: f64,
        /// In seconds.
        start: f64,
    },
    /// No waiting on the route leads past the others.
    #[error(
        "cannot pass: wherever it waits on its route, something comes too near; give it another route, or plan it before others"
    )]
    Blocked,
    /// Its route is too long or too many others come near.
    #[error(
        "{stretches} stretches of the route and {others} of other tracks are too many; simplify the tracks"
    )]
    TooMany {
        /// Of the route.
        stretches: usize,
        /// Of all others.
        others: usize,
    },
}

/// Stretches of a route times stretches of others that are looked at.
const MAX_PAIRS: usize = 100_000_000;

/// Plans one walker after another; each keeps away from all movers and from all walkers before it.
/// A walker that cannot pass has no plan, and is no obstacle for others.
///
/// Not complete: another order, or other routes, may lead where this does not.
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
