//! Routes as files: CSV that `tumble follow` reads.

use std::fmt;
use std::io::{self, Write};
use std::path::Path;

use glam::DVec3;
use tumble_routes::route::Route;
use tumble_routes::walkers::Plan;

use crate::batch::target::{self, Destination};
use crate::commands::route::arguments::Arguments;
use crate::commands::route::tables::Participants;
use crate::messages::exit::Failure;
use crate::messages::warnings::RecordedWarning;

/// A point of a route.
pub(super) struct RoutePoint {
    /// Seconds, where time counts.
    pub(super) time: Option<f64>,
    pub(super) position: DVec3,
    /// The normal of the surface; `None` if the surface has one side, or its normals cancel out.
    pub(super) normal: Option<DVec3>,
}

impl RoutePoint {
    pub(super) fn of_route(route: &Route) -> Vec<Self> {
        let row = |(index, &position): (usize, &DVec3)| Self {
            time: None,
            position,
            normal: (route.normals.as_ref().map(|all| all[index]))
                .filter(|normal| *normal != DVec3::ZERO),
        };
        route.points.iter().enumerate().map(row).collect()
    }

    pub(super) fn of_plan(route: &Route, plan: &Plan) -> Vec<Self> {
        let row = |&(time, distance, position): &(f64, f64, DVec3)| Self {
            time: Some(time),
            position,
            normal: route.at(distance).1.filter(|normal| *normal != DVec3::ZERO),
        };
        plan.times.iter().map(row).collect()
    }
}

/// The outcome of one route.
pub(super) struct RouteOutcome {
    pub(super) name: String,
    pub(super) ends: [DVec3; 2],
    pub(super) found: Result<(Route, Vec<RoutePoint>), String>,
    pub(super) warnings: Vec<RecordedWarning>,
}

/// The destinations of routes, checked before any work.
pub(super) struct RouteResults {
    label: String,
    destinations: Vec<Destination>,
    /// The file of the picture, if one is drawn.
    plot: Option<Destination>,
}

impl RouteResults {
    pub(super) fn new(arguments: &Arguments, participants: &Participants) -> Result<Self, Failure> {
        let mut inputs = vec![arguments.surface.clone()];
        inputs.extend(arguments.avoid.clone());
        let out = &arguments.out;
        let new = |path: &Path| Destination::new(path, arguments.overwrite, &inputs);
        let destinations = if participants.is_single {
            vec![new(out)?]
        } else {
            let folder = target::open_folder(out)?;
            let below = |name: &String| {
                let name = format!("{name}.csv");
                Destination::below(&folder, Path::new(&name), arguments.overwrite, &inputs)
            };
            let names = participants.names.iter();
            names.map(below).collect::<Result<_, _>>()?
        };
        let plot = match &arguments.plot {
            None => None,
            Some(plot) => {
                let plot = Destination::of_picture(plot, arguments.overwrite, &inputs)?;
                for destination in &destinations {
                    plot.refuse_same(destination.path())?;
                }
                plot.check_writable()?;
                Some(plot)
            }
        };
        let label = match &destinations[..] {
            [destination] if participants.is_single => destination.to_string(),
            _ => out.display().to_string(),
        };
        Ok(Self {
            label,
            destinations,
            plot,
        })
    }

    /// Where the picture goes, if one is drawn.
    pub(super) fn plot(&self) -> Option<&Destination> {
        self.plot.as_ref()
    }

    /// Writes the routes, each file whole or not at all.
    pub(super) fn write(&self, outcomes: &[RouteOutcome]) -> Result<(), Failure> {
        for (outcome, destination) in outcomes.iter().zip(&self.destinations) {
            if let Ok((_, rows)) = &outcome.found {
                destination.write(None, |out| write(rows, out))?;
            }
        }
        Ok(())
    }
}

impl fmt::Display for RouteResults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.label)
    }
}

fn write(rows: &[RoutePoint], out: &mut impl Write) -> io::Result<()> {
    let has_times = rows.iter().any(|row| row.time.is_some());
    let has_normals = rows.iter().any(|row| row.normal.is_some());
    let times = if has_times { "t," } else { "" };
    let normals = if has_normals { ",ux,uy,uz" } else { "" };
    writeln!(out, "{times}x,y,z{normals}")?;
    for row in rows {
        if let Some(time) = row.time {
            write!(out, "{time},")?;
        }
        let DVec3 { x, y, z } = row.position;
        write!(out, "{x},{y},{z}")?;
        match row.normal {
            Some(DVec3 { x, y, z }) => write!(out, ",{x},{y},{z}")?,
            None if has_normals => write!(out, ",,,")?,
            None => {}
        }
        writeln!(out)?;
    }
    Ok(())
}
