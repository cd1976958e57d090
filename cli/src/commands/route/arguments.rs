//! The arguments of `tumble route`.

use std::path::PathBuf;

use clap::Args;
use glam::DVec3;
use tumble_routes::net::NetBy;
use tumble_routes::route::By;

use crate::commands::route::tables::{Party, read_pairs, read_walkers};
use crate::messages::exit::Failure;

/// Find ways over a mesh or a surface: the shortest one, or others
#[derive(Debug, Args)]
#[command(after_help = "\
The surface is a mesh (.obj, .ply, .glb, .gltf) or a net of Bézier control points (.npy of
shape m, n, 3). A way is written as CSV with the header x,y,z,ux,uy,uz: points and the normals
of the surface there, for `tumble follow`. A list of pairs has six numbers a line, separated by
commas or blanks. Walkers are CSV with the columns name, radius, speed, start, x, y, z, to_x,
to_y, to_z; a row whose column track names a CSV of t,x,y,z moves on that instead.

Examples:
  tumble route hill.obj --from 0,0,0 --to 9,5,0 -o way.csv
  tumble route hill.obj --pairs pairs.txt --by edges -o ways/
  tumble route hill.obj --from 0,0,0 --to 9,5,0 --avoid rocks.obj --clearance 0.3 \\
    --finest 0.05 --max-slope 40 -o way.csv --plot way.svg
  tumble route plaza.glb --walkers people.csv -o ways/
  tumble route hood.npy --by facets:40 --from 0,0,0 --to 1,0,1 -o way.csv")]
pub(crate) struct Arguments {
    /// A mesh, or a net of control points
    pub(crate) surface: PathBuf,
    /// Where the way begins
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true, requires = "to")]
    from: Option<DVec3>,
    /// Where it ends
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true, requires = "from")]
    to: Option<DVec3>,
    /// A file of pairs: from x y z, to x y z on each line
    #[arg(long, value_name = "FILE", conflicts_with_all = ["from", "walkers"])]
    pairs: Option<PathBuf>,
    /// Meshes: exact, plane, greedy or edges; nets: line or facets:N
    #[arg(long, value_name = "WAY", value_parser = manner)]
    by: Option<Manner>,
    /// Vertices of a mesh that are within this distance of each other are one, so that ways cross
    /// seams whose sides differ by rounding
    #[arg(long, value_name = "DISTANCE", value_parser = not_negative, allow_hyphen_values = true, default_value = "0", hide_default_value = true)]
    pub(crate) weld: f64,
    /// A mesh of obstacles that stand still
    #[arg(long, value_name = "FILE", requires = "clearance")]
    pub(crate) avoid: Option<PathBuf>,
    /// How far ways stay from obstacles
    #[arg(long, value_name = "R", value_parser = not_negative, allow_hyphen_values = true, requires = "avoid")]
    pub(crate) clearance: Option<f64>,
    /// The longest edge at the rim of what is closed [default: a hundredth of the mesh's size]
    #[arg(long, value_name = "E", value_parser = positive, allow_hyphen_values = true)]
    pub(crate) finest: Option<f64>,
    /// The steepest slope that is walked, in degrees
    #[arg(long, value_name = "DEG", value_parser = slope, allow_hyphen_values = true)]
    pub(crate) max_slope: Option<f64>,
    /// The direction upwards, for slopes and pictures
    #[arg(long, value_name = "X,Y,Z", default_value = "0,1,0", value_parser = direction, allow_hyphen_values = true)]
    pub(crate) up: DVec3,
    /// A file of walkers, who wait for each other on their ways
    #[arg(long, value_name = "FILE", conflicts_with = "from")]
    walkers: Option<PathBuf>,
    /// Where to write: a CSV (`-`: standard output), or a directory for pairs and walkers
    #[arg(short, long = "out", value_name = "OUT")]
    pub(crate) out: PathBuf,
    /// Also draw the mesh from above with its ways, as .svg or .png
    #[arg(long, value_name = "FILE")]
    pub(crate) plot: Option<PathBuf>,
    /// Replace existing files
    #[arg(long)]
    pub(crate) overwrite: bool,
    /// Print lengths and errors as JSON
    #[arg(long)]
    pub(crate) json: bool,
}

/// How ways are found.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Manner {
    Mesh(By),
    Net(NetBy),
}

impl Arguments {
    /// Who goes from where to where.
    pub(crate) fn party(&self) -> Result<Party, Failure> {
        if self.json && crate::arguments::input::is_standard(&self.out) {
            let message = "--json and -o - both write to standard output; give a file";
            return Err(Failure::usage(message));
        }
        match (self.from, self.to, &self.pairs, &self.walkers) {
            (Some(from), Some(to), None, None) => Ok(Party::of_pair([from, to])),
            (None, None, Some(file), None) => read_pairs(file),
            (None, None, None, Some(file)) => read_walkers(file),
            _ => Err(Failure::usage(
                "give --from and --to, --pairs, or --walkers",
            )),
        }
    }

    pub(crate) fn manner(&self) -> Result<Manner, Failure> {
        Ok(self.by.unwrap_or(Manner::Mesh(By::Exact)))
    }

    /// Whether ways keep to a part of the mesh.
    pub(crate) fn wants_ground(&self) -> bool {
        self.avoid.is_some() || self.max_slope.is_some()
    }
}

fn manner(text: &str) -> Result<Manner, String> {
    if let Ok(by) = text.parse() {
        return Ok(Manner::Mesh(by));
    }
    match (text, text.strip_prefix("facets:").map(str::parse)) {
        ("line", _) => Ok(Manner::Net(NetBy::Line)),
        (_, Some(Ok(facets))) => Ok(Manner::Net(NetBy::Facets(facets))),
        _ => {
            Err("give exact, plane, greedy or edges for a mesh, line or facets:N for a net".into())
        }
    }
}

/// `1,2.5,-3`.
pub(crate) fn point(text: &str) -> Result<DVec3, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[x, y, z]) if [x, y, z].iter().all(|own: &f64| own.is_finite()) => {
            Ok(DVec3::new(x, y, z))
        }
        _ => Err(format!(
            "`{text}` is no point; give three numbers, such as 1,2.5,-3"
        )),
    }
}

fn direction(text: &str) -> Result<DVec3, String> {
    let given = point(text)?;
    match given.try_normalize() {
        Some(unit) => Ok(unit),
        None => Err(format!("`{text}` is no direction; it has no length")),
    }
}

fn number(text: &str) -> Option<f64> {
    text.parse().ok().filter(|own: &f64| own.is_finite())
}

fn positive(text: &str) -> Result<f64, String> {
    let found = number(text).filter(|&own| own > 0.0);
    found.ok_or_else(|| format!("`{text}` is not a number over 0"))
}

fn not_negative(text: &str) -> Result<f64, String> {
    let found = number(text).filter(|&own| own >= 0.0);
    found.ok_or_else(|| format!("`{text}` is not a number of 0 or more"))
}

fn slope(text: &str) -> Result<f64, String> {
    let found = number(text).filter(|own| (0.0..=90.0).contains(own));
    found.ok_or_else(|| format!("`{text}` is no slope; give degrees from 0 to 90"))
}
