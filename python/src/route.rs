//! `tumble.Surface`: routes over meshes and Bézier surfaces, and walkers on them.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;

use glam::DVec3;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyTuple, PyType};
use tumble::{Error, Stop, StoppedError};
use tumble_routes::ground::{Clear, Ground};
use tumble_routes::mesh::Mesh;
use tumble_routes::net::{Net, NetBy};
use tumble_routes::route::By;
use tumble_routes::walkers::{self, Mover, Walker};

use crate::arrays::{ArrayValues, ListArgument, doubles, parts, vectors};
use crate::errors::{in_python, input, of_engine, warn_of};
use crate::names::unknown_name;
use crate::run::interruptible;
use crate::values::{Pickled, Value, broken, chunks, list as list_of, pickled, rows};

/// A surface, on which routes are found: a mesh, or a net of Bézier control points.
///
/// `Surface(vertices, faces, *, weld=0.0)`
///
/// `vertices`: (n, 3). `faces`: the indices of triangles (m, 3), of polygons (m, k), or a list of lists of any
/// lengths. Vertices within the distance `weld` are merged, so that routes can cross seams. Oddities of a mesh are
/// reported as `InputWarning`.
///
/// >>> import numpy as np, tumble
/// >>> corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
/// >>> plane = tumble.Surface(corners, [[0, 1, 2, 3]])
/// >>> plane.route([0.1, 0.2, 0.0], [0.9, 0.8, 0.0]).length
/// 1.0
#[pyclass(frozen, eq, weakref, module = "tumble")]
#[derive(PartialEq)]
pub(crate) struct Surface {
    shape: Shape,
}

#[derive(Clone)]
enum Shape {
    Mesh(Arc<Mesh>),
    Net(Arc<ControlNet>),
}

/// A net of control points, with the array from which it was made.
struct ControlNet {
    net: Net,
    rows: usize,
    columns: usize,
    points: Vec<DVec3>,
}

impl ControlNet {
    fn new(rows: usize, columns: usize, points: Vec<DVec3>) -> PyResult<Self> {
        let net = Net::new(rows, columns, points.clone()).map_err(|error| refused(&error))?;
        Ok(Self {
            net,
            rows,
            columns,
            points,
        })
    }
}

impl PartialEq for Shape {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Mesh(one), Self::Mesh(other)) => {
                one.positions() == other.positions() && one.triangles() == other.triangles()
            }
            (Self::Net(one), Self::Net(other)) => {
                (one.rows, one.columns, &one.points) == (other.rows, other.columns, &other.points)
            }
            _ => false,
        }
    }
}

fn points_of(state: &Bound<'_, PyAny>) -> PyResult<Vec<DVec3>> {
    let points: Vec<[f64; 3]> = chunks(state)?;
    Ok(points.into_iter().map(DVec3::from_array).collect())
}

impl Value for Surface {
    /// The triangles, or the size of the net, and the points.
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        match &self.shape {
            Shape::Mesh(mesh) => {
                let triangles = rows(py, mesh.triangles().as_flattened().to_vec(), 3)?;
                (triangles, array(py, mesh.positions())?).into_pyobject(py)
            }
            Shape::Net(net) => ((net.rows, net.columns), array(py, &net.points)?).into_pyobject(py),
        }
    }

    fn of_state(state: &Bound<'_, PyTuple>) -> PyResult<Self> {
        let (first, points): (Bound<'_, PyAny>, Bound<'_, PyAny>) = state.extract()?;
        let points = points_of(&points)?;
        let shape = match first.is_instance_of::<PyTuple>() {
            true => {
                let (rows, columns) = first.extract()?;
                Shape::Net(Arc::new(ControlNet::new(rows, columns, points)?))
            }
            false => {
                let triangles: Vec<[u32; 3]> = chunks(&first)?;
                let mesh = Mesh::new(&points, &triangles).map_err(|error| refused(&error))?;
                Shape::Mesh(Arc::new(mesh))
            }
        };
        Ok(Self { shape })
    }
}

/// A route over a surface: straight from each point to the next.
#[pyclass(frozen, eq, weakref, module = "tumble", from_py_object)]
#[derive(Clone, PartialEq)]
pub(crate) struct Route {
    found: Arc<tumble_routes::route::Route>,
}

/// The positions of a walker at times: straight from each point to the next.
#[pyclass(frozen, eq, weakref, module = "tumble")]
#[derive(PartialEq)]
pub(crate) struct Walk {
    times: Vec<f64>,
    points: Vec<DVec3>,
    ups: Option<Vec<DVec3>>,
}

impl Value for Route {
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let found = &self.found;
        let normals = found.normals.as_ref();
        let normals = normals.map(|normals| array(py, normals)).transpose()?;
        (array(py, &found.points)?, normals, found.length, found.off).into_pyobject(py)
    }

    fn of_state(state: &Bound<'_, PyTuple>) -> PyResult<Self> {
        type State<'py> = (Bound<'py, PyAny>, Option<Bound<'py, PyAny>>, f64, [f64; 2]);
        let (points, normals, length, off): State<'_> = state.extract()?;
        let points = points_of(&points)?;
        let normals = normals.map(|normals| points_of(&normals)).transpose()?;
        let is_broken = |normals: &Vec<DVec3>| normals.len() != points.len();
        if points.is_empty() || normals.as_ref().is_some_and(is_broken) {
            return Err(broken());
        }
        let found = tumble_routes::route::Route {
            points,
            normals,
            length,
            off,
        };
        Ok(Self {
            found: Arc::new(found),
        })
    }
}

impl Value for Walk {
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let ups = self.ups.as_ref().map(|ups| array(py, ups)).transpose()?;
        let times = PyArray1::from_slice(py, &self.times);
        (times, array(py, &self.points)?, ups).into_pyobject(py)
    }

    fn of_state(state: &Bound<'_, PyTuple>) -> PyResult<Self> {
        type State<'py> = (
            Bound<'py, PyAny>,
            Bound<'py, PyAny>,
            Option<Bound<'py, PyAny>>,
        );
        let (times, points, ups): State<'_> = state.extract()?;
        Ok(Self {
            times: list_of(&times)?,
            points: points_of(&points)?,
            ups: ups.map(|ups| points_of(&ups)).transpose()?,
        })
    }
}

fn point(value: &Bound<'_, PyAny>, name: &str) -> PyResult<DVec3> {
    match vectors(value, name)? {
        (shape, points) if shape.is_empty() => Ok(points[0]),
        _ => Err(input(format!("{name}: give one point, 3 numbers"))),
    }
}

fn list(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<DVec3>> {
    match vectors(value, name)? {
        (shape, points) if shape.len() == 1 => Ok(points),
        (shape, _) => Err(input(format!(
            "{name}: the shape is {:?}; give (n, 3)",
            [&shape[..], &[3]].concat()
        ))),
    }
}

/// Points as an array (n, 3).
fn array<'py>(py: Python<'py>, points: &[DVec3]) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let numbers: Vec<f64> = points.iter().flat_map(DVec3::to_array).collect();
    PyArray1::from_vec(py, numbers).reshape([points.len(), 3])
}

fn refused(error: &dyn std::fmt::Display) -> PyErr {
    input(in_python(&error.to_string()))
}

/// The corners of each face.
fn faces(value: &Bound<'_, PyAny>) -> PyResult<Vec<Vec<u32>>> {
    let index =
        |number: &f64| match number.fract() == 0.0 && (0.0..4_294_967_295.0).contains(number) {
            true => Ok(*number as u32),
            false => Err(input(format!(
                "faces: {number} is not an index of a vertex"
            ))),
        };
    let face = |numbers: &[f64]| numbers.iter().map(index).collect::<PyResult<Vec<u32>>>();
    if let Some(parts) = parts(value)? {
        let one = |part: &Bound<'_, PyAny>| match doubles(part, "faces")? {
            ArrayValues { shape, values } if shape.len() == 1 => face(&values),
            ArrayValues { shape, .. } => Err(input(format!(
                "faces: one has the shape {shape:?}; give a list of indices for each"
            ))),
        };
        return parts.iter().map(one).collect();
    }
    match doubles(value, "faces")? {
        ArrayValues { shape, values } if shape.len() == 2 && shape[1] > 0 => {
            values.chunks(shape[1]).map(face).collect()
        }
        ArrayValues { shape, .. } => Err(input(format!(
            "faces: the shape is {shape:?}; give (m, 3), (m, k), or a list of lists"
        ))),
    }
}

/// The options of a search for routes.
#[derive(Clone)]
struct RouteOptions {
    shape: Shape,
    by: Option<String>,
    avoid: Option<Arc<Mesh>>,
    clearance: f64,
    finest: Option<f64>,
    max_slope: Option<f64>,
    up: DVec3,
}

type RouteResults = Vec<Result<tumble_routes::route::Route, String>>;

impl RouteOptions {
    fn routes(&self, pairs: &[[DVec3; 2]]) -> PyResult<RouteResults> {
        let by = self.by.as_deref();
        let is_ground = self.avoid.is_some() || self.max_slope.is_some();
        match &self.shape {
            Shape::Mesh(mesh) => {
                let by = by.map_or(Ok(By::Exact), str::parse).map_err(|_| {
                    let name = by.unwrap_or_default();
                    let refusal = format!("by: there is no `{name}` for meshes");
                    input(unknown_name(&refusal, name, &By::ALL.map(By::name)))
                })?;
                if !is_ground {
                    return in_pieces(pairs, |pairs| in_words(mesh.routes(pairs, by)));
                }
                let clear = Clear {
                    obstacles: self.avoid.as_deref(),
                    clearance: self.clearance,
                    finest: self.finest.unwrap_or(mesh.size() / 100.0),
                    max_slope: self.max_slope.map(f64::to_radians),
                    up: self.up,
                };
                let ground = Ground::new(mesh, clear).map_err(|error| refused(&error))?;
                in_pieces(pairs, |pairs| in_words(ground.routes(pairs, by)))
            }
            Shape::Net(net) => {
                if is_ground {
                    return Err(input(
                        "avoid, max_slope: they are for meshes, and this is a net of control points",
                    ));
                }
                let facets = by.and_then(|by| by.strip_prefix("facets:")?.parse().ok());
                let by = match (by, facets) {
                    (None | Some("line"), _) => NetBy::Line,
                    (_, Some(facets)) => NetBy::Facets(facets),
                    (Some(by), None) => {
                        let refusal = format!("by: there is no `{by}` for nets");
                        let known = ["line", "facets:N"];
                        return Err(input(unknown_name(&refusal, by, &known)));
                    }
                };
                in_pieces(pairs, |pairs| {
                    let routes = pairs.iter().map(|&[from, to]| net.net.route(from, to, by));
                    in_words(routes.collect())
                })
            }
        }
    }
}

/// The number of pairs that are computed together. Ctrl-C can end the work after each of these groups.
const TOGETHER: usize = 8;

fn in_pieces(
    pairs: &[[DVec3; 2]],
    routes: impl Fn(&[[DVec3; 2]]) -> RouteResults,
) -> PyResult<RouteResults> {
    let stop = Stop::of_this_work();
    let mut found = Vec::with_capacity(pairs.len());
    for pairs in pairs.chunks(TOGETHER) {
        if stop.is_stopped() {
            return Err(of_engine(&Error::Stopped(StoppedError)));
        }
        found.extend(routes(pairs));
    }
    Ok(found)
}

fn in_words<E: std::fmt::Display>(
    found: Vec<Result<tumble_routes::route::Route, E>>,
) -> RouteResults {
    let found = found.into_iter();
    found
        .map(|route| route.map_err(|error| error.to_string()))
        .collect()
}

impl Surface {
    fn size(&self) -> f64 {
        match &self.shape {
            Shape::Mesh(mesh) => mesh.size(),
            Shape::Net(net) => net.net.size(),
        }
    }

    fn options(
        &self,
        by: Option<String>,
        avoid: Option<&Bound<'_, Self>>,
        (clearance, finest, max_slope): (f64, Option<f64>, Option<f64>),
        up: [f64; 3],
    ) -> PyResult<RouteOptions> {
        let avoid = match avoid.map(|surface| &surface.get().shape) {
            None => None,
            Some(Shape::Mesh(mesh)) => Some(Arc::clone(mesh)),
            Some(Shape::Net(_)) => return Err(input("avoid: obstacles must be a mesh")),
        };
        if avoid.is_none() && clearance != 0.0 {
            return Err(input(
                "clearance: it is the distance from `avoid`; give it too",
            ));
        }
        Ok(RouteOptions {
            shape: self.shape.clone(),
            by,
            avoid,
            clearance,
            finest,
            max_slope,
            up: DVec3::from_array(up),
        })
    }

    /// A route, with messages where its ends were moved onto the surface.
    fn route_of(
        &self,
        name: &str,
        found: tumble_routes::route::Route,
        messages: &mut Vec<String>,
    ) -> Route {
        for (end, off) in ["start", "goal"].into_iter().zip(found.off) {
            if off > 1e-6 * self.size() {
                // Four digits: the distance only shows how wrong the point is.
                let digits = format!("{off:.3e}");
                let off = digits.parse().unwrap_or(off);
                messages.push(format!(
                    "{name}{end}: it is {off} away from the surface; the nearest point of the surface is used"
                ));
            }
        }
        Route {
            found: Arc::new(found),
        }
    }
}

#[pymethods]
impl Surface {
    #[new]
    #[pyo3(signature = (vertices, faces, *, weld=0.0))]
    fn new(
        py: Python<'_>,
        vertices: &Bound<'_, PyAny>,
        faces: &Bound<'_, PyAny>,
        weld: f64,
    ) -> PyResult<Self> {
        let positions = list(vertices, "vertices")?;
        let polygons = self::faces(faces)?;
        let mesh = interruptible(py, move || {
            let polygons = polygons.iter().map(Vec::as_slice);
            let mesh = Mesh::welded(&positions, polygons, weld);
            mesh.map_err(|error| refused(&error))
        })?;
        let warnings = mesh.warnings().iter().map(ToString::to_string);
        warn_of(py, &warnings.collect::<Vec<_>>())?;
        Ok(Self {
            shape: Shape::Mesh(Arc::new(mesh)),
        })
    }

    /// A Bézier surface of control points (m, n, 3).
    ///
    /// >>> import numpy as np, tumble
    /// >>> u, v = np.meshgrid([0.0, 0.5, 1.0], [0.0, 0.5, 1.0], indexing="ij")
    /// >>> net = tumble.Surface.net(np.stack([u, 0 * u, v], axis=-1))
    /// >>> round(net.route([0, 0, 0], [1, 0, 1], by="line").length, 6)
    /// 1.414214
    #[classmethod]
    fn net(
        _class: &Bound<'_, PyType>,
        py: Python<'_>,
        points: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let (shape, points) = vectors(points, "points")?;
        let [rows, columns] = shape[..] else {
            return Err(input(format!(
                "points: the shape is {:?}; a net has (m, n, 3)",
                [&shape[..], &[3]].concat()
            )));
        };
        let net = interruptible(py, move || ControlNet::new(rows, columns, points))?;
        Ok(Self {
            shape: Shape::Net(Arc::new(net)),
        })
    }

    /// The route between the points of the surface that are nearest to `start` and `goal`.
    ///
    /// `by`: of meshes "exact", the shortest one (the default), "plane", "greedy" or "edges"; of nets "line" (the default)
    /// or "facets:N". `avoid`: a mesh of obstacles, from which routes stay `clearance` away; `finest`: the longest edge
    /// along the boundary of the area that obstacles close (default: a hundredth of the mesh's size). `max_slope`: the
    /// steepest slope that is walked, degrees against `up`.
    ///
    /// >>> import numpy as np, tumble
    /// >>> roof = tumble.Surface([[0, 0, 0], [2, 0, 0], [0, 1, 1], [2, 1, 1], [0, 0, 2], [2, 0, 2]],
    /// ...                       [[0, 1, 3, 2], [2, 3, 5, 4]])
    /// >>> round(roof.route([0, 0, 0], [0, 0, 2]).length, 6)
    /// 2.828427
    #[pyo3(signature = (
        start, goal, *, by=None, avoid=None, clearance=0.0, finest=None, max_slope=None, up=[0.0, 1.0, 0.0]
    ), text_signature = "($self, start, goal, *, by=None, avoid=None, clearance=0.0, finest=None, max_slope=None, up=(0.0, 1.0, 0.0))")]
    #[allow(clippy::too_many_arguments, reason = "keywords")]
    fn route(
        &self,
        py: Python<'_>,
        start: &Bound<'_, PyAny>,
        goal: &Bound<'_, PyAny>,
        by: Option<String>,
        avoid: Option<&Bound<'_, Self>>,
        clearance: f64,
        finest: Option<f64>,
        max_slope: Option<f64>,
        up: [f64; 3],
    ) -> PyResult<Route> {
        let pair = [[point(start, "start")?, point(goal, "goal")?]];
        let options = self.options(by, avoid, (clearance, finest, max_slope), up)?;
        let found = interruptible(py, move || {
            let found = options.routes(&pair)?.pop();
            found
                .unwrap_or_else(|| Err("no route was computed".to_owned()))
                .map_err(|error| input(in_python(&error)))
        })?;
        let mut moved = Vec::new();
        let route = self.route_of("", found, &mut moved);
        warn_of(py, &moved)?;
        Ok(route)
    }

    /// The routes of many pairs, `starts` and `goals` (n, 3), on all cores: a list with a `Route` for each, and
    /// None where there is none, of which an `InputWarning` says why. Otherwise as `route`.
    ///
    /// >>> import tumble
    /// >>> plane = tumble.Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    /// >>> [route.length for route in plane.routes([[0, 0, 0], [0, 0, 0]], [[1, 0, 0], [0, 0.5, 0]])]
    /// [1.0, 0.5]
    #[pyo3(signature = (
        starts, goals, *, by=None, avoid=None, clearance=0.0, finest=None, max_slope=None, up=[0.0, 1.0, 0.0]
    ), text_signature = "($self, starts, goals, *, by=None, avoid=None, clearance=0.0, finest=None, max_slope=None, up=(0.0, 1.0, 0.0))")]
    #[allow(clippy::too_many_arguments, reason = "keywords")]
    fn routes(
        &self,
        py: Python<'_>,
        starts: &Bound<'_, PyAny>,
        goals: &Bound<'_, PyAny>,
        by: Option<String>,
        avoid: Option<&Bound<'_, Self>>,
        clearance: f64,
        finest: Option<f64>,
        max_slope: Option<f64>,
        up: [f64; 3],
    ) -> PyResult<Vec<Option<Route>>> {
        let (starts, goals) = (list(starts, "starts")?, list(goals, "goals")?);
        if starts.len() != goals.len() {
            return Err(input(format!(
                "goals: there are {} for {} starts",
                goals.len(),
                starts.len()
            )));
        }
        let pairs = starts.into_iter().zip(goals);
        let pairs: Vec<[DVec3; 2]> = pairs.map(|(start, goal)| [start, goal]).collect();
        let options = self.options(by, avoid, (clearance, finest, max_slope), up)?;
        let found = interruptible(py, move || options.routes(&pairs))?;
        let mut routes = Vec::with_capacity(found.len());
        let (mut moved, mut missing) = (Vec::new(), Vec::new());
        for (index, route) in found.into_iter().enumerate() {
            routes.push(match route {
                Ok(route) => Some(self.route_of(&format!("route {index}: "), route, &mut moved)),
                Err(error) => {
                    missing.push(format!("route {index}: {error}"));
                    None
                }
            });
        }
        warn_of(py, &moved)?;
        warn_of(py, &missing)?;
        Ok(routes)
    }

    /// A hash; surfaces that are equal (`==`) have the same.
    fn __hash__(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        let size = match &self.shape {
            Shape::Mesh(mesh) => (mesh.positions().len(), mesh.triangles().len()),
            Shape::Net(net) => (net.rows, net.columns),
        };
        size.hash(&mut hasher);
        hasher.finish()
    }

    /// Pickles the fields.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Pickled<'py>> {
        pickled(slf)
    }

    fn __repr__(&self) -> String {
        match &self.shape {
            Shape::Mesh(mesh) => format!(
                "Surface({} vertices, {} triangles)",
                mesh.positions().len(),
                mesh.triangles().len()
            ),
            Shape::Net(_) => "Surface.net(…)".to_owned(),
        }
    }
}

#[pymethods]
impl Route {
    /// The points from the start to the goal, (n, 3), float64, connected by straight lines; a single point if start and
    /// goal are the same.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        array(py, &self.found.points)
    }

    /// The unit normal of the surface at each point, (n, 3), 0 where those of its faces cancel out; None
    /// where the surface has one side.
    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let normals = self.found.normals.as_ref();
        normals.map(|normals| array(py, normals)).transpose()
    }

    /// The length over the surface.
    #[getter]
    fn length(&self) -> f64 {
        self.found.length
    }

    /// How far start and goal were from the surface.
    #[getter]
    fn off(&self) -> (f64, f64) {
        let [start, goal] = self.found.off;
        (start, goal)
    }

    /// Pickles the fields.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Pickled<'py>> {
        pickled(slf)
    }

    fn __repr__(&self) -> String {
        format!(
            "Route({} points, length {})",
            self.found.points.len(),
            self.found.length
        )
    }
}

#[pymethods]
impl Walk {
    /// When it is at each point in seconds, (n,). Two with the same point are a wait between them.
    #[getter]
    fn times<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.times)
    }

    /// Where it is, (n, 3), float64.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        array(py, &self.points)
    }

    /// The unit normal of the surface at each point, (n, 3); None where it has one side.
    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let normals = self.ups.as_ref();
        normals.map(|normals| array(py, normals)).transpose()
    }

    /// Pickles the fields.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Pickled<'py>> {
        pickled(slf)
    }

    fn __repr__(&self) -> String {
        let arrival = self.times.last().copied().unwrap_or(0.0);
        format!("Walk({} points, arrives at {arrival} s)", self.times.len())
    }
}

/// Plans walkers on routes, one after another. Each waits on its route where this is necessary, for moving obstacles
/// and for the walkers before it. Returns a list with a `Walk` for each, or None for a walker that cannot pass, with
/// an `InputWarning` that says why.
///
/// `speed` (units of length per second), `radius` (of the ball around a walker) and `start` (seconds) are one number
/// for all or (n,). `movers`: moving obstacles, each (times, points, radius).
///
/// >>> import tumble
/// >>> plane = tumble.Surface([[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]], [[0, 1, 2, 3]])
/// >>> routes = plane.routes([[0, 2, 0], [2, 0, 0]], [[4, 2, 0], [2, 4, 0]])
/// >>> [float(walk.times[-1]) > 4.1 for walk in tumble.walk(routes, speed=1.0, radius=0.3)]
/// [False, True]
#[pyfunction]
#[pyo3(signature = (routes, *, speed, radius, start=None, movers=None), text_signature = "(routes, *, speed, radius, start=0.0, movers=())")]
pub(crate) fn walk(
    py: Python<'_>,
    routes: ListArgument<Route>,
    speed: &Bound<'_, PyAny>,
    radius: &Bound<'_, PyAny>,
    start: Option<&Bound<'_, PyAny>>,
    movers: Option<ListArgument<Bound<'_, PyAny>>>,
) -> PyResult<Vec<Option<Walk>>> {
    let routes = routes.0;
    let count = routes.len();
    let numbers = |value: &Bound<'_, PyAny>, name: &str| match doubles(value, name)? {
        ArrayValues { shape, values } if shape.is_empty() => Ok(vec![values[0]; count]),
        ArrayValues { shape, values } if *shape == [count] => Ok(values),
        ArrayValues { shape, .. } => Err(input(format!(
            "{name}: the shape is {shape:?}; give one for all, or ({count},)"
        ))),
    };
    let (speeds, radii) = (numbers(speed, "speed")?, numbers(radius, "radius")?);
    let starts = match start {
        Some(start) => numbers(start, "start")?,
        None => vec![0.0; count],
    };
    let walkers = routes.iter().enumerate().map(|(index, route)| Walker {
        route: (*route.found).clone(),
        radius: radii[index],
        speed: speeds[index],
        start: starts[index],
    });
    let walkers: Vec<Walker> = walkers.collect();
    let mover = |(index, mover): (usize, &Bound<'_, PyAny>)| {
        let name = format!("movers[{index}]");
        let parts: (Bound<'_, PyAny>, Bound<'_, PyAny>, f64) = mover.extract()?;
        let times = doubles(&parts.0, &name)?.values;
        let points = list(&parts.1, &name)?;
        let increase = times.windows(2).all(|pair| pair[0] < pair[1]);
        let finite = times.iter().all(|time| time.is_finite())
            && points.iter().all(|point| point.is_finite());
        if times.len() != points.len() || times.is_empty() || !increase || !finite {
            return Err(input(format!(
                "{name}: give increasing times (n,), points (n, 3) and a radius, finite numbers"
            )));
        }
        if !(parts.2 >= 0.0 && parts.2.is_finite()) {
            return Err(input(format!(
                "{name}: a radius must be a number of 0 or more"
            )));
        }
        Ok(Mover {
            track: times.into_iter().zip(points).collect(),
            radius: parts.2,
        })
    };
    let movers: Vec<Mover> = movers
        .iter()
        .flat_map(|movers| &movers.0)
        .enumerate()
        .map(mover)
        .collect::<PyResult<_>>()?;
    let plans = interruptible(py, move || Ok(walkers::plan(&walkers, &movers)))?;
    let mut found = Vec::with_capacity(count);
    let mut missing = Vec::new();
    for (index, (plan, route)) in plans.into_iter().zip(&routes).enumerate() {
        found.push(match plan {
            Ok(plan) => {
                let normals = plan.times.iter().map(|step| route.found.at(step.1).1);
                Some(Walk {
                    times: plan.times.iter().map(|step| step.0).collect(),
                    points: plan.times.iter().map(|step| step.2).collect(),
                    ups: normals.collect(),
                })
            }
            Err(error) => {
                missing.push(format!("routes[{index}]: {error}"));
                None
            }
        });
    }
    warn_of(py, &missing)?;
    Ok(found)
}
