//! `tumble route`: ways over meshes and surfaces, between obstacles.

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
use crate::commands::route::arguments::Manner;
use crate::commands::route::results::{Results, Row};
use crate::commands::route::surface::Surface;
use crate::commands::route::tables::Party;
use crate::messages::exit::{ALL_INPUTS, Failure, SOME_INPUTS};
use crate::messages::progress::busy;
use crate::messages::words;
use crate::together::on_threads;

/// What becomes of one route.
struct Outcome {
    name: String,
    ends: [DVec3; 2],
    found: Result<(Route, Vec<Row>), String>,
}

/// A line of `--json`.
#[derive(Serialize)]
struct Line<'a> {
    name: &'a str,
    from: [f64; 3],
    to: [f64; 3],
    length: Option<f64>,
    points: Option<usize>,
    /// Seconds.
    arrival: Option<f64>,
    /// From the surface to what was asked for.
    off: Option<[f64; 2]>,
    error: Option<&'a str>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let started = Instant::now();
    let party = arguments.party()?;
    let results = Results::new(arguments, &party)?;
    let surface = Surface::read(&arguments.surface, arguments.weld)?;
    let avoided = match &arguments.avoid {
        Some(path) => match Surface::read(path, arguments.weld)? {
            Surface::Mesh(mesh) => Some(mesh),
            Surface::Net(_) => {
                let message = format!("{}: obstacles are a mesh", path.display());
                return Err(Failure::usage(message));
            }
        },
        None => None,
    };
    let found = busy("finding ways", || {
        find(arguments, &surface, avoided.as_deref(), &party)
    })?;
    let outcomes = scheduled(found, &party);
    for outcome in &outcomes {
        warn_off(outcome, surface.size());
    }
    // Drawn before anything is written: what cannot be drawn leaves nothing.
    let picture = match results.plot() {
        None => None,
        Some(place) => {
            let picture = picture::draw(arguments, place, &surface, avoided.as_deref(), &outcomes)?;
            Some((place, picture))
        }
    };
    results.write(&outcomes)?;
    if let Some((place, picture)) = picture {
        place.write(None, |out| out.write_all(&picture))?;
    }
    told(arguments, &outcomes, &results, started)
}

/// The routes of all pairs, apart from time.
fn find(
    arguments: &Arguments,
    surface: &Surface,
    avoided: Option<&Mesh>,
    party: &Party,
) -> Result<Vec<Result<Route, String>>, Failure> {
    let words = |error: &dyn std::fmt::Display| error.to_string();
    let name = arguments.surface.display();
    Ok(match (surface, arguments.manner()?) {
        (Surface::Mesh(mesh), Manner::Mesh(by)) if arguments.wants_ground() => {
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
            let routes = ground.routes(&party.pairs, by).into_iter();
            routes
                .map(|own| own.map_err(|error| words(&error)))
                .collect()
        }
        (Surface::Mesh(mesh), Manner::Mesh(by)) => {
            let routes = mesh.routes(&party.pairs, by).into_iter();
            routes
                .map(|own| own.map_err(|error| words(&error)))
                .collect()
        }
        (Surface::Net(_), _) if arguments.wants_ground() => {
            return Err(Failure::usage(format!(
                "{name}: --avoid and --max-slope are for meshes, and this is a net of control points"
            )));
        }
        (Surface::Net(net), Manner::Net(by)) => {
            let route = |&[from, to]: &[DVec3; 2]| net.route(from, to, by);
            let routes: Vec<_> = on_threads(
                || party.pairs.par_iter().map(route).collect(),
                || party.pairs.iter().map(route).collect(),
            );
            let routes = routes.into_iter();
            routes
                .map(|own| own.map_err(|error| words(&error)))
                .collect()
        }
        (Surface::Mesh(_), Manner::Net(_)) => {
            return Err(Failure::usage(format!(
                "{name}: is a mesh; --by line and --by facets:N are for nets (.npy)"
            )));
        }
        (Surface::Net(_), Manner::Mesh(_)) => {
            return Err(Failure::usage(format!(
                "{name}: is a net of control points; give --by line or --by facets:N"
            )));
        }
    })
}

/// The routes with the times at which they are walked, if they are.
fn scheduled(found: Vec<Result<Route, String>>, party: &Party) -> Vec<Outcome> {
    let mut outcomes: Vec<Outcome> = (found.into_iter().zip(&party.pairs).zip(&party.names))
        .map(|((route, &ends), name)| Outcome {
            name: name.clone(),
            ends,
            found: route.map(|route| {
                let rows = Row::of_route(&route);
                (route, rows)
            }),
        })
        .collect();
    let Some(paces) = &party.paces else {
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
    let plans = walkers::plan(&walking, &party.movers);
    for (index, plan) in indices.into_iter().zip(plans) {
        let outcome = &mut outcomes[index];
        match plan {
            Ok(plan) => {
                if let Ok((route, rows)) = &mut outcome.found {
                    *rows = Row::of_plan(route, &plan);
                }
            }
            Err(error) => outcome.found = Err(error.to_string()),
        }
    }
    outcomes
}

/// Points that were not on the surface are moved onto it, with a word.
fn warn_off(outcome: &Outcome, size: f64) {
    let Ok((route, _)) = &outcome.found else {
        return;
    };
    for (what, off) in ["start", "goal"].into_iter().zip(route.off) {
        if off > 1e-6 * size {
            words::warning(&format!(
                "{}: the {what} is {off} off the surface; its nearest point is taken",
                outcome.name
            ));
        }
    }
    if route.normals.is_none() {
        words::warning(&format!(
            "{}: the surface has one side only, so the way has no normals",
            outcome.name
        ));
    }
}

/// Says what was found, and what was not.
fn told(
    arguments: &Arguments,
    outcomes: &[Outcome],
    results: &Results,
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
        let lines: Vec<Line<'_>> = outcomes.iter().map(line).collect();
        words::json(&lines)?;
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

fn line(outcome: &Outcome) -> Line<'_> {
    let found = outcome.found.as_ref().ok();
    Line {
        name: &outcome.name,
        from: outcome.ends[0].to_array(),
        to: outcome.ends[1].to_array(),
        length: found.map(|(route, _)| route.length),
        points: found.map(|(_, rows)| rows.len()),
        arrival: found.and_then(|(_, rows)| rows.last()?.time),
        off: found.map(|(route, _)| route.off),
        error: outcome.found.as_ref().err().map(String::as_str),
    }
}
