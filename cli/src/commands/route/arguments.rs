//! The arguments of `tumble route`.

use std::path::PathBuf;

use clap::Args;
use glam::DVec3;
use tumble_routes::net::NetBy;
use tumble_routes::route::By;

use crate::arguments::options::CommandLine;
use crate::batch::target;
use crate::commands::route::surface::{Surface, kinds};
use crate::commands::route::tables::{Participants, read_pairs, read_walkers};
use crate::messages::exit::Failure;

/// The help's notes on files.
const NOTES: &str = "\
A route is written as CSV with the header x,y,z,ux,uy,uz: points and the normals \
of the surface there, for `tumble follow`. A list of pairs has six numbers a line, separated by \
commas or blanks. Walkers are CSV with the columns name, radius, speed, start, x, y, z, to_x, \
to_y, to_z; a row whose column track names a CSV of t,x,y,z moves on that instead.

Examples:
  tumble route hill.obj --start-point 0,0,0 --end-point 9,5,0 -o way.csv
  tumble route hill.obj --pairs pairs.txt --by edges -o ways/
  tumble route hill.obj --start-point 0,0,0 --end-point 9,5,0 --avoid rocks.obj --clearance 0.3 \\
    --finest 0.05 --max-slope 40 -o way.csv --plot way.svg
  tumble route plaza.glb --walkers people.csv -o ways/
  tumble route hood.npy --by facets:40 --start-point 0,0,0 --end-point 1,0,1 -o way.csv";

/// Find shortest routes over a mesh or a surface, exactly or approximately
#[derive(Debug, Args)]
#[command(after_help = format!("The surface is {}.\n{NOTES}", kinds()))]
pub(crate) struct Arguments {
    #[command(flatten)]
    command_line: CommandLine,
    /// A mesh, or a net of control points
    pub(crate) surface: PathBuf,
    /// The start of the route
    #[arg(long, alias = "from", value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true, requires = "end_point")]
    start_point: Option<DVec3>,
    /// The end of the route
    #[arg(long, alias = "to", value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true, requires = "start_point")]
    end_point: Option<DVec3>,
    /// A file of pairs: from x y z, to x y z on each line
    #[arg(long, value_name = "FILE", conflicts_with_all = ["start_point", "walkers"])]
    pairs: Option<PathBuf>,
    /// Meshes: exact, plane, greedy or edges; nets: line or facets:N
    #[arg(long, value_name = "METHOD", value_parser = parse_method)]
    by: Option<RouteMethod>,
    /// Vertices of a mesh that are within this distance of each other are merged, so that routes can
    /// cross seams whose sides differ by rounding
    #[arg(long, value_name = "DISTANCE", value_parser = not_negative, allow_hyphen_values = true, default_value = "0", hide_default_value = true)]
    pub(crate) weld: f64,
    /// A mesh of obstacles that stand still
    #[arg(long, value_name = "FILE", requires = "clearance")]
    pub(crate) avoid: Option<PathBuf>,
    /// The distance that routes keep from obstacles
    #[arg(long, value_name = "R", value_parser = not_negative, allow_hyphen_values = true, requires = "avoid")]
    pub(crate) clearance: Option<f64>,
    /// The longest edge along the boundary of closed areas [default: a hundredth of the mesh's size]
    #[arg(long, value_name = "E", value_parser = positive, allow_hyphen_values = true)]
    pub(crate) finest: Option<f64>,
    /// The steepest slope that is walked, in degrees
    #[arg(long, value_name = "DEG", value_parser = slope, allow_hyphen_values = true)]
    pub(crate) max_slope: Option<f64>,
    /// The upward direction: for slopes and pictures
    #[arg(long, value_name = "X,Y,Z", default_value = "0,1,0", value_parser = direction, allow_hyphen_values = true)]
    pub(crate) up: DVec3,
    /// A file of walkers, who wait for each other on their routes
    #[arg(long, value_name = "FILE", conflicts_with = "start_point")]
    walkers: Option<PathBuf>,
    /// Where to write: a CSV (`-`: standard output), or a directory for pairs and walkers
    #[arg(short, long = "output", alias = "out", value_name = "OUT")]
    pub(crate) out: PathBuf,
    /// Also draw a picture, as .svg or .png: the mesh from above with the routes
    #[arg(long, value_name = "FILE")]
    pub(crate) plot: Option<PathBuf>,
    /// Replace existing files
    #[arg(long)]
    pub(crate) overwrite: bool,
    /// Print JSON: lengths and errors
    #[arg(long)]
    pub(crate) json: bool,
}

/// `--by`: how routes are found.
#[derive(Debug, Clone, Copy)]
pub(crate) enum RouteMethod {
    Mesh(By),
    Net(NetBy),
}

impl Arguments {
    /// The start and the goal of each route.
    pub(crate) fn participants(&self) -> Result<Participants, Failure> {
        target::refuse_both_on_standard(self.json, &self.out)?;
        match (self.start_point, self.end_point, &self.pairs, &self.walkers) {
            (Some(start), Some(end), None, None) => Ok(Participants::of_pair([start, end])),
            (None, None, Some(file), None) => read_pairs(file),
            (None, None, None, Some(file)) => read_walkers(file),
            _ => Err(Failure::usage(
                "give --start-point and --end-point, --pairs, or --walkers",
            )),
        }
    }

    /// Refuses options that have no effect on routes over this surface.
    pub(crate) fn check_effects(&self, surface: &Surface) -> Result<(), Failure> {
        let line = &self.command_line;
        if let Surface::Net(_) = surface {
            let remedy = "it is for meshes; leave it out";
            line.refuse(&[("weld", "--weld")], "a net of control points", remedy)?;
        }
        if !self.wants_ground() {
            let remedy = "it is for areas closed by --avoid and --max-slope; leave it out";
            line.refuse(
                &[("finest", "--finest")],
                "routes over a whole mesh",
                remedy,
            )?;
        }
        if self.max_slope.is_none() && self.plot.is_none() {
            let remedy = "it is for --max-slope and --plot; leave it out";
            line.refuse(&[("up", "--up")], "these routes", remedy)?;
        }
        Ok(())
    }

    pub(crate) fn method(&self) -> Result<RouteMethod, Failure> {
        Ok(self.by.unwrap_or(RouteMethod::Mesh(By::Exact)))
    }

    /// Whether routes are restricted to a part of the mesh.
    pub(crate) fn wants_ground(&self) -> bool {
        self.avoid.is_some() || self.max_slope.is_some()
    }
}

fn parse_method(text: &str) -> Result<RouteMethod, String> {
    if let Ok(by) = text.parse() {
        return Ok(RouteMethod::Mesh(by));
    }
    match (text, text.strip_prefix("facets:").map(str::parse)) {
        ("line", _) => Ok(RouteMethod::Net(NetBy::Line)),
        (_, Some(Ok(facets))) => Ok(RouteMethod::Net(NetBy::Facets(facets))),
        _ => {
            Err("give exact, plane, greedy or edges for a mesh, line or facets:N for a net".into())
        }
    }
}

/// `1,2.5,-3`.
pub(crate) fn point(text: &str) -> Result<DVec3, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[x, y, z])
            if [x, y, z]
                .iter()
                .all(|component: &f64| component.is_finite()) =>
        {
            Ok(DVec3::new(x, y, z))
        }
        _ => Err(format!(
            "invalid point `{text}`: expected three numbers, such as 1,2.5,-3"
        )),
    }
}

fn direction(text: &str) -> Result<DVec3, String> {
    let vector = point(text)?;
    match vector.try_normalize() {
        Some(unit) => Ok(unit),
        None => Err(format!("invalid direction `{text}`: its length is 0")),
    }
}

fn number(text: &str) -> Option<f64> {
    text.parse().ok().filter(|value: &f64| value.is_finite())
}

fn positive(text: &str) -> Result<f64, String> {
    let found = number(text).filter(|&value| value > 0.0);
    found.ok_or_else(|| "expected a number above 0".to_owned())
}

fn not_negative(text: &str) -> Result<f64, String> {
    let found = number(text).filter(|&value| value >= 0.0);
    found.ok_or_else(|| "expected a number of 0 or more".to_owned())
}

fn slope(text: &str) -> Result<f64, String> {
    let found = number(text).filter(|value| (0.0..=90.0).contains(value));
    found.ok_or_else(|| format!("invalid slope `{text}`: expected degrees from 0 to 90"))
}
