//! `tumble route`: routes over meshes and surfaces, around obstacles.

mod arguments;
mod picture;
mod results;
pub(crate) mod surface;
mod tables;

use std::io::Write as _;
use std::time::Instant;

use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;
use tumble_routes::ground::{Clear, Ground};
use tumble_routes::mesh::Mesh;
use tumble_routes::route::Route;
use tumble_routes::walkers::{self, Walker};

pub(crate) use crate::commands::route::arguments::Arguments;
use crate::commands::route::arguments::RouteMethod;
use crate::commands::route::results::{RouteOutcome, RoutePoint, RouteResults};
use crate::commands::route::surface::Surface;
use crate::commands::route::tables::Participants;
use crate::messages::exit::{ALL_INPUTS, Failure, SOME_INPUTS};
use crate::messages::listing;
use crate::messages::progress::busy;
use crate::messages::warnings::{self, RecordedWarning};
use crate::messages::words;
use crate::threads::on_threads;

/// A line of `--json`.
#[derive(Serialize)]
struct RouteReport<'a> {
    name: &'a str,
    from: [f64; 3],
    to: [f64; 3],
    length: Option<f64>,
    points: Option<usize>,
    /// Seconds.
    arrival: Option<f64>,
    /// The distances of the requested ends from the surface.
    off: Option<[f64; 2]>,
    error: Option<&'a str>,
    warnings: &'a [RecordedWarning],
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let started = Instant::now();
    let participants = arguments.participants()?;
    let results = RouteResults::new(arguments, &participants)?;
    let surface = Surface::read(&arguments.surface, arguments.weld)?;
    arguments.check_effects(&surface)?;
    let avoided = match &arguments.avoid {
        Some(path) => match Surface::read(path, arguments.weld)? {
            Surface::Mesh(mesh) => Some(mesh),
            Surface::Net(_) => {
                let message = format!("{}: obstacles must be a mesh", path.display());
                return Err(Failure::usage(message));
            }
        },
        None => None,
    };
    let found = busy("finding routes", || {
        find(arguments, &surface, avoided.as_deref(), &participants)
    })?;
    let mut outcomes = scheduled(found, &participants);
    for outcome in &mut outcomes {
        let mark = warnings::mark();
        warn_of_moved_ends(outcome, surface.size());
        outcome.warnings = warnings::recorded_since(mark);
    }
    // Drawn before any file is written, so that no file is left if drawing fails.
    let picture = match results.plot() {
        None => None,
        Some(destination) => {
            let picture = picture::draw(
                arguments,
                destination,
                &surface,
                avoided.as_deref(),
                &outcomes,
            )?;
            Some((destination, picture))
        }
    };
    results.write(&outcomes)?;
    if let Some((destination, picture)) = picture {
        destination.write(None, |out| out.write_all(&picture))?;
    }
    report(arguments, &outcomes, &results, started)
}

/// The routes of all pairs, apart from time.
fn find(
    arguments: &Arguments,
    surface: &Surface,
    avoided: Option<&Mesh>,
    participants: &Participants,
) -> Result<Vec<Result<Route, String>>, Failure> {
    let words = |error: &dyn std::fmt::Display| error.to_string();
    let name = arguments.surface.display();
    Ok(match (surface, arguments.method()?) {
        (Surface::Mesh(mesh), RouteMethod::Mesh(by)) if arguments.wants_ground() => {
            let clear = Clear {
                obstacles: avoided,
                clearance: arguments.clearance.unwrap_or(0.0),
                finest: arguments.finest.unwrap_or(mesh.size() / 100.0),
                max_slope: arguments.max_slope.map(f64::to_radians),
                up: arguments.up,
            };
            let ground = Ground::new(mesh, clear);
            let ground =
                ground.map_err(|error| Failure::new(ALL_INPUTS, format!("{name}: {error}")))?;
            let routes = ground.routes(&participants.pairs, by).into_iter();
            routes
                .map(|result| result.map_err(|error| words(&error)))
                .collect()
        }
        (Surface::Mesh(mesh), RouteMethod::Mesh(by)) => {
            let routes = mesh.routes(&participants.pairs, by).into_iter();
            routes
                .map(|result| result.map_err(|error| words(&error)))
                .collect()
        }
        (Surface::Net(_), _) if arguments.wants_ground() => {
            return Err(Failure::usage(format!(
                "{name}: --avoid and --max-slope are for meshes, and this is a net of control points"
            )));
        }
        (Surface::Net(net), RouteMethod::Net(by)) => {
            let route = |&[from, to]: &[DVec3; 2]| net.route(from, to, by);
            let routes: Vec<_> = on_threads(
                || participants.pairs.par_iter().map(route).collect(),
                || participants.pairs.iter().map(route).collect(),
            );
            let routes = routes.into_iter();
            routes
                .map(|result| result.map_err(|error| words(&error)))
                .collect()
        }
        (Surface::Mesh(_), RouteMethod::Net(_)) => {
            return Err(Failure::usage(format!(
                "{name}: is a mesh; --by line and --by facets:N are for nets (.npy)"
            )));
        }
        (Surface::Net(_), RouteMethod::Mesh(_)) => {
            return Err(Failure::usage(format!(
                "{name}: is a net of control points; give --by line or --by facets:N"
            )));
        }
    })
}

/// The routes with the times at which they are walked, if they are.
fn scheduled(found: Vec<Result<Route, String>>, participants: &Participants) -> Vec<RouteOutcome> {
    let mut outcomes: Vec<RouteOutcome> = (found
        .into_iter()
        .zip(&participants.pairs)
        .zip(&participants.names))
    .map(|((route, &ends), name)| RouteOutcome {
        name: name.clone(),
        ends,
        warnings: Vec::new(),
        found: route.map(|route| {
            let rows = RoutePoint::of_route(&route);
            (route, rows)
        }),
    })
    .collect();
    let Some(paces) = &participants.paces else {
        return outcomes;
    };
    let walking: Vec<(usize, Walker)> = (outcomes.iter().zip(paces).enumerate())
        .filter_map(|(index, (outcome, pace))| {
            let (route, _) = outcome.found.as_ref().ok()?;
            let walker = Walker {
                route: route.clone(),
                radius: pace.radius,
                speed: pace.speed,
                start: pace.start,
            };
            Some((index, walker))
        })
        .collect();
    let (indices, walking): (Vec<usize>, Vec<Walker>) = walking.into_iter().unzip();
    let plans = walkers::plan(&walking, &participants.movers);
    for (index, plan) in indices.into_iter().zip(plans) {
        let outcome = &mut outcomes[index];
        match plan {
            Ok(plan) => {
                if let Ok((route, rows)) = &mut outcome.found {
                    *rows = RoutePoint::of_plan(route, &plan);
                }
            }
            Err(error) => outcome.found = Err(error.to_string()),
        }
    }
    outcomes
}

/// Warns of ends that were moved onto the surface.
fn warn_of_moved_ends(outcome: &RouteOutcome, size: f64) {
    let Ok((route, _)) = &outcome.found else {
        return;
    };
    for (end, off) in ["start", "end"].into_iter().zip(route.off) {
        if off > 1e-6 * size {
            // Four digits: the distance only shows how wrong the point is.
            let digits = format!("{off:.3e}");
            let off = digits.parse().unwrap_or(off);
            words::warning(&format!(
                "{}: the {end} point is {off} away from the surface; the nearest point of the surface is used",
                outcome.name
            ));
        }
    }
    if route.normals.is_none() {
        words::warning(&format!(
            "{}: the surface is one-sided, so the route has no normals",
            outcome.name
        ));
    }
}

/// Prints the results, and the failures.
fn report(
    arguments: &Arguments,
    outcomes: &[RouteOutcome],
    results: &RouteResults,
    started: Instant,
) -> Result<(), Failure> {
    let mut failed = 0;
    for outcome in outcomes {
        if let Err(error) = &outcome.found {
            failed += 1;
            words::error(&format!("{}: {error}", outcome.name));
        }
    }
    if arguments.json {
        let lines: Vec<RouteReport<'_>> = outcomes.iter().map(line).collect();
        listing::records(&lines, &[])?;
    }
    let name = arguments.surface.display();
    if let [outcome] = outcomes
        && let Ok((route, rows)) = &outcome.found
    {
        words::note(&format!(
            "{name}: length {}, {} in {} → {results}",
            route.length,
            words::count(rows.len(), "point"),
            words::duration(started.elapsed()),
        ));
        return Ok(());
    }
    match failed {
        0 => {
            words::note(&format!(
                "{name}: {} in {} → {results}",
                words::count(outcomes.len(), "route"),
                words::duration(started.elapsed()),
            ));
            Ok(())
        }
        _ if failed == outcomes.len() => Err(Failure::quiet(ALL_INPUTS)),
        _ => {
            let message = format!(
                "{failed} of {} routes failed; the others are done",
                outcomes.len()
            );
            Err(Failure::new(SOME_INPUTS, message))
        }
    }
}

fn line(outcome: &RouteOutcome) -> RouteReport<'_> {
    let found = outcome.found.as_ref().ok();
    RouteReport {
        name: &outcome.name,
        from: outcome.ends[0].to_array(),
        to: outcome.ends[1].to_array(),
        length: found.map(|(route, _)| route.length),
        points: found.map(|(_, rows)| rows.len()),
        arrival: found.and_then(|(_, rows)| rows.last()?.time),
        off: found.map(|(route, _)| route.off),
        error: outcome.found.as_ref().err().map(String::as_str),
        warnings: &outcome.warnings,
    }
}
