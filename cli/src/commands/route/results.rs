//! Ways as files: CSV that `tumble follow` reads.

use std::fmt;
use std::io::{self, Write};
use std::path::Path;

use glam::DVec3;
use tumble_routes::route::Route;
use tumble_routes::walkers::Plan;

use crate::batch::place::{self, Place};
use crate::commands::route::Outcome;
use crate::commands::route::arguments::Arguments;
use crate::commands::route::tables::Party;
use crate::messages::exit::Failure;

/// A point of a way.
pub(super) struct Row {
    /// Seconds, where time counts.
    pub(super) time: Option<f64>,
    pub(super) place: DVec3,
    /// Of the surface; none where that has one side, or its normals cancel out.
    pub(super) normal: Option<DVec3>,
}

impl Row {
    pub(super) fn of_route(route: &Route) -> Vec<Self> {
        let row = |(index, &place): (usize, &DVec3)| Self {
            time: None,
            place,
            normal: (route.normals.as_ref().map(|all| all[index]))
                .filter(|own| *own != DVec3::ZERO),
        };
        route.points.iter().enumerate().map(row).collect()
    }

    pub(super) fn of_plan(route: &Route, plan: &Plan) -> Vec<Self> {
        let row = |&(time, gone, place): &(f64, f64, DVec3)| Self {
            time: Some(time),
            place,
            normal: route.at(gone).1.filter(|own| *own != DVec3::ZERO),
        };
        plan.times.iter().map(row).collect()
    }
}

/// Where ways go: checked before any work.
pub(super) struct Results {
    place: String,
    places: Vec<Place>,
    /// Of the picture.
    plot: Option<Place>,
}

impl Results {
    pub(super) fn new(arguments: &Arguments, party: &Party) -> Result<Self, Failure> {
        let mut inputs = vec![arguments.surface.clone()];
        inputs.extend(arguments.avoid.clone());
        let out = &arguments.out;
        let new = |path: &Path| Place::new(path, arguments.overwrite, &inputs);
        let places = if party.is_single {
            vec![new(out)?]
        } else {
            place::folder(out)?;
            let path = |name: &String| out.join(format!("{name}.csv"));
            party
                .names
                .iter()
                .map(|name| new(&path(name)))
                .collect::<Result<_, _>>()?
        };
        let plot = match &arguments.plot {
            None => None,
            Some(plot) => {
                let plot = Place::of_picture(plot, arguments.overwrite, &inputs)?;
                for place in &places {
                    plot.refuse_same(place.path())?;
                }
                plot.try_out()?;
                Some(plot)
            }
        };
        let place = match &places[..] {
            [place] if party.is_single => place.to_string(),
            _ => out.display().to_string(),
        };
        Ok(Self {
            place,
            places,
            plot,
        })
    }

    /// Where the picture goes, if one is drawn.
    pub(super) fn plot(&self) -> Option<&Place> {
        self.plot.as_ref()
    }

    /// Writes what was found, each file whole or not at all.
    pub(super) fn write(&self, outcomes: &[Outcome]) -> Result<(), Failure> {
        for (outcome, place) in outcomes.iter().zip(&self.places) {
            if let Ok((_, rows)) = &outcome.found {
                place.write(None, |out| write(rows, out))?;
            }
        }
        Ok(())
    }
}

impl fmt::Display for Results {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.place)
    }
}

fn write(rows: &[Row], out: &mut impl Write) -> io::Result<()> {
    let has_times = rows.iter().any(|row| row.time.is_some());
    let has_normals = rows.iter().any(|row| row.normal.is_some());
    let times = if has_times { "t," } else { "" };
    let normals = if has_normals { ",ux,uy,uz" } else { "" };
    writeln!(out, "{times}x,y,z{normals}")?;
    for row in rows {
        if let Some(time) = row.time {
            write!(out, "{time},")?;
        }
        let DVec3 { x, y, z } = row.place;
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
