//! The mesh from above, with the routes.

use std::collections::HashSet;
use std::fmt::Write as _;

use glam::{DVec2, DVec3};
use tumble_routes::mesh::Mesh;

use crate::batch::target::Destination;
use crate::commands::picture;
use crate::commands::route::arguments::Arguments;
use crate::commands::route::results::RouteOutcome;
use crate::commands::route::surface::Surface;
use crate::messages::exit::Failure;

/// The longer side, in pixels, and the margin.
const SIZE: f64 = 800.0;
const MARGIN: f64 = 20.0;
/// How many facets along a side a net is drawn with.
const FACETS: usize = 24;
/// The most edges that are drawn.
const MAX_EDGES: usize = 60_000;
/// The colours of the routes, one after another: blue, orange, green, red, purple (after Okabe and Ito).
const COLOURS: [&str; 5] = ["#0072b2", "#e69f00", "#009e73", "#d55e00", "#cc79a7"];

/// The picture as its file has it.
pub(super) fn draw(
    arguments: &Arguments,
    destination: &Destination,
    surface: &Surface,
    avoided: Option<&Mesh>,
    outcomes: &[RouteOutcome],
) -> Result<Vec<u8>, Failure> {
    let name = destination.to_string();
    let faceted;
    let mesh = match surface {
        Surface::Mesh(mesh) => mesh,
        Surface::Net(net) => {
            faceted = net
                .facets(FACETS)
                .map_err(|error| Failure::usage(format!("{name}: cannot be drawn: {error}")))?;
            &faceted
        }
    };
    let svg = svg(arguments.up, mesh, avoided, outcomes);
    let extension = destination.path().extension().unwrap_or_default();
    match extension.eq_ignore_ascii_case("png") {
        true => png(&svg).map_err(|error| Failure::writing(&name, &error)),
        false => Ok(svg.into_bytes()),
    }
}

/// The projection from above.
struct TopView {
    right: DVec3,
    down: DVec3,
    corner: DVec2,
    scale: f64,
}

impl TopView {
    fn new(up: DVec3, mesh: &Mesh) -> Self {
        // If z points up, x points to the right and y away from the viewer. If y points up, z points towards the
        // viewer.
        let other = if up.x.abs() < 0.9 { DVec3::X } else { DVec3::Y };
        let right = (other - other.dot(up) * up).normalize_or(DVec3::X);
        let down = right.cross(up);
        let flat = |position: &DVec3| DVec2::new(position.dot(right), position.dot(down));
        let all = mesh.positions().iter().map(flat);
        let low = all.clone().fold(DVec2::INFINITY, DVec2::min);
        let high = all.fold(DVec2::NEG_INFINITY, DVec2::max);
        let size = (high - low).max_element().max(f64::MIN_POSITIVE);
        Self {
            right,
            down,
            corner: low,
            scale: (SIZE - 2.0 * MARGIN) / size,
        }
    }

    fn at(&self, position: DVec3) -> DVec2 {
        let flat = DVec2::new(position.dot(self.right), position.dot(self.down));
        (flat - self.corner) * self.scale + MARGIN
    }
}

fn svg(up: DVec3, mesh: &Mesh, avoided: Option<&Mesh>, outcomes: &[RouteOutcome]) -> String {
    let view = TopView::new(up, mesh);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{SIZE}\" height=\"{SIZE}\" \
         viewBox=\"0 0 {SIZE} {SIZE}\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    let edges = edges(&view, mesh);
    let _ = writeln!(
        svg,
        "<path d=\"{edges}\" stroke=\"#b0b0b0\" stroke-width=\"0.6\" fill=\"none\"/>"
    );
    if let Some(rocks) = avoided {
        let mut filled = String::new();
        for triangle in rocks.triangles() {
            let [a, mut b, mut c] =
                triangle.map(|vertex| view.at(rocks.positions()[vertex as usize]));
            // All triangles get the same orientation. Otherwise areas where the upper and the lower side of a rock
            // overlap would not be filled.
            if (b - a).perp_dot(c - a) < 0.0 {
                (b, c) = (c, b);
            }
            let _ = write!(
                filled,
                "M{:.2} {:.2}L{:.2} {:.2}L{:.2} {:.2}Z",
                a.x, a.y, b.x, b.y, c.x, c.y
            );
        }
        let _ = writeln!(
            svg,
            "<path d=\"{filled}\" fill=\"#606060\" fill-rule=\"nonzero\"/>"
        );
    }
    for (outcome, colour) in outcomes.iter().zip(COLOURS.iter().cycle()) {
        let Ok((route, _)) = &outcome.found else {
            continue;
        };
        let points = route.points.iter().map(|&point| view.at(point));
        let mut line = String::new();
        for point in points.clone() {
            let step = if line.is_empty() { 'M' } else { 'L' };
            let _ = write!(line, "{step}{:.2} {:.2}", point.x, point.y);
        }
        let _ = writeln!(
            svg,
            "<path d=\"{line}\" stroke=\"{colour}\" stroke-width=\"3\" fill=\"none\" \
             stroke-linejoin=\"round\"/>"
        );
        for end in points.clone().take(1).chain(points.clone().next_back()) {
            let (x, y) = (end.x, end.y);
            let _ = writeln!(
                svg,
                "<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"5\" fill=\"{colour}\"/>"
            );
        }
    }
    svg.push_str("</svg>\n");
    svg
}

/// Every edge once; of large meshes, only every n-th edge.
fn edges(view: &TopView, mesh: &Mesh) -> String {
    let mut known = HashSet::new();
    let mut path = String::new();
    let every = (3 * mesh.triangles().len() / 2).div_ceil(MAX_EDGES).max(1);
    for triangle in mesh.triangles() {
        for k in 0..3 {
            let (one, other) = (triangle[k], triangle[(k + 1) % 3]);
            if known.insert((one.min(other), one.max(other))) && known.len().is_multiple_of(every) {
                let [a, b] = [one, other].map(|vertex| view.at(mesh.positions()[vertex as usize]));
                let _ = write!(path, "M{:.2} {:.2}L{:.2} {:.2}", a.x, a.y, b.x, b.y);
            }
        }
    }
    path
}

fn png(svg: &str) -> std::io::Result<Vec<u8>> {
    let canvas = picture::rasterise(svg, 2.0)?;
    let mut bytes = Vec::new();
    let pixels = picture::opaque(&canvas);
    picture::png(&mut bytes, canvas.width(), canvas.height(), &pixels)?;
    Ok(bytes)
}
