//! Unusual meshes, and inputs that are not meshes.

use std::f64::consts::PI;

use glam::{DVec3, dvec3};
use proptest::prelude::*;
use tumble_formats::surface::obj::read_obj;
use tumble_formats::surface::ply::read_ply;
use tumble_routes::error::{MeshError, MeshWarning, RouteError};
use tumble_routes::mesh::Mesh;
use tumble_routes::route::By;

use crate::shapes::{cuboid, of, squares, welded};

const CORNERS: [DVec3; 4] = [DVec3::ZERO, DVec3::X, dvec3(1.0, 1.0, 0.0), DVec3::Y];

#[test]
fn what_is_no_mesh_is_refused() {
    let refused = |positions: &[DVec3], polygons: &[&[u32]]| {
        Mesh::of_polygons(positions, polygons.iter().copied()).unwrap_err()
    };
    assert_eq!(refused(&[], &[]), MeshError::Empty);
    assert_eq!(refused(&CORNERS, &[]), MeshError::Empty);
    let (vertex, count) = (4, 4);
    assert_eq!(
        refused(&CORNERS, &[&[0, 1, 2], &[0, 1, 4]]),
        MeshError::Index {
            face: 1,
            vertex,
            count
        }
    );
    assert_eq!(
        refused(&CORNERS, &[&[0, 1]]),
        MeshError::Corners {
            face: 0,
            corners: 2
        }
    );
    for bad in [f64::NAN, f64::INFINITY, 1e80] {
        let mut corners = CORNERS;
        corners[3].z = bad;
        let error = refused(&corners, &[&[0, 1, 2]]);
        assert!(
            matches!(error, MeshError::NotFinite { vertex: 3, .. }),
            "{error}"
        );
    }
    let line = [DVec3::ZERO, DVec3::X, 2.0 * DVec3::X, DVec3::Y];
    assert_eq!(refused(&line, &[&[0, 1, 2]]), MeshError::Empty);
}

/// A sliver at a T-joint, as CAD programs write them, and one between two triangles of a square.
#[test]
fn faces_of_no_area_are_left_out() {
    let no_area = MeshWarning::NoArea { count: 1, face: 1 };
    let shortest =
        |mesh: &Mesh, from: DVec3, to: DVec3| mesh.route(from, to, By::Exact).unwrap().length;
    let below = dvec3(1.0, -1.0, 0.0);
    let joint = [DVec3::ZERO, DVec3::X, 2.0 * DVec3::X, CORNERS[2], below];
    let mesh = of(&joint, &[&[0, 2, 3], &[0, 1, 2], &[0, 4, 1], &[1, 4, 2]]);
    let divided = MeshWarning::SidesCut { count: 1 };
    assert_eq!(mesh.warnings(), [no_area.clone(), divided]);
    assert_eq!(mesh.pieces(), [4]);
    assert_eq!(shortest(&mesh, CORNERS[2], below), 2.0);
    let middle = dvec3(0.5, 0.5, 0.0);
    let square = [&CORNERS[..], &[middle]].concat();
    let mesh = of(&square, &[&[0, 1, 2], &[0, 2, 4], &[0, 2, 3], &[1, 1, 2]]);
    let equal = MeshWarning::Dropped { count: 1, face: 3 };
    assert_eq!(mesh.warnings(), [equal, no_area]);
    let length = shortest(&mesh, DVec3::X, DVec3::Y);
    assert!((length - 2.0_f64.sqrt()).abs() < 1e-15, "{length}");
}

#[test]
fn polygons_seams_and_what_is_unused() {
    // A quad whose positions occur twice, and an unused position.
    let positions = [CORNERS.as_slice(), &[DVec3::Z], &CORNERS].concat();
    let mesh = of(&positions, &[&[0, 1, 2, 3], &[1, 5, 6], &[6, 7, 8]]);
    assert_eq!(mesh.positions().len(), 4);
    assert_eq!(mesh.triangles().len(), 3);
    assert_eq!(
        mesh.warnings()[0],
        MeshWarning::Dropped { count: 1, face: 1 }
    );
    let bent = [CORNERS[0], CORNERS[1], CORNERS[2] + DVec3::Z, CORNERS[3]];
    let mesh = of(&bent, &[&[0, 1, 2, 3]]);
    assert_eq!(
        mesh.warnings(),
        [MeshWarning::NotFlat { count: 1, face: 0 }]
    );
    // A seam between 0 and -0 is not a boundary.
    let seam = [
        DVec3::ZERO,
        DVec3::X,
        DVec3::Y,
        dvec3(-0.0, 0.0, -0.0),
        DVec3::Y,
        -DVec3::X,
    ];
    let mesh = of(&seam, &[&[0, 1, 2], &[3, 4, 5]]);
    let route = mesh
        .route(dvec3(0.5, 0.2, 0.0), dvec3(-0.5, 0.2, 0.0), By::Exact)
        .unwrap();
    assert!((route.length - 1.0).abs() < 1e-12);
}

#[test]
fn windings_that_disagree_are_turned() {
    let cube = cuboid(DVec3::ONE);
    let mut triangles = cube.triangles().to_vec();
    for index in [1, 4, 5] {
        triangles[index].swap(0, 1);
    }
    let mesh = Mesh::new(cube.positions(), &triangles).unwrap();
    assert_eq!(mesh.warnings(), [MeshWarning::Rewound { count: 3 }]);
    let normals = mesh.normals().unwrap();
    for (position, normal) in mesh.positions().iter().zip(normals) {
        let outwards = (*position - DVec3::splat(0.5)).normalize();
        assert!((*normal - outwards).length() < 1e-12);
    }
}

/// A strip with a half turn.
fn moebius() -> Mesh {
    let count = 24;
    let at = |i: u32, side: f64| {
        let angle = 2.0 * PI * f64::from(i) / f64::from(count);
        let out = 2.0 + side * (angle / 2.0).cos();
        dvec3(
            out * angle.cos(),
            out * angle.sin(),
            side * (angle / 2.0).sin(),
        )
    };
    let mut positions: Vec<DVec3> = (0..count).flat_map(|i| [at(i, -0.5), at(i, 0.5)]).collect();
    let mut quads = Vec::new();
    for i in 0..count {
        let last = i + 1 == count;
        let (next, other) = if last { (1, 0) } else { (2 * i + 2, 2 * i + 3) };
        quads.push([2 * i, next, other, 2 * i + 1]);
    }
    positions.truncate(2 * count as usize);
    let polygons: Vec<&[u32]> = quads.iter().map(<[u32; 4]>::as_slice).collect();
    of(&positions, &polygons)
}

#[test]
fn a_moebius_strip_has_ways_and_no_normals() {
    let strip = moebius();
    assert!(
        strip.warnings().contains(&MeshWarning::OneSided),
        "{:?}",
        strip.warnings()
    );
    assert!(strip.normals().is_none());
    let middle = |i: usize| strip.positions()[i].midpoint(strip.positions()[i + 1]);
    let (from, to) = (middle(0), middle(22));
    let route = strip.route(from, to, By::Exact).unwrap();
    assert!(route.normals.is_none());
    let edges = strip.route(from, to, By::Edges).unwrap();
    assert!(route.length < edges.length && route.length >= from.distance(to));
    let back = strip.route(to, from, By::Exact).unwrap();
    assert!((route.length - back.length).abs() < 1e-12 * route.length);
    assert_eq!(strip.route(from, to, By::Plane), Err(RouteError::OneSided));
}

/// Three pages of a book: routes between two pages cross its spine.
#[test]
fn edges_of_three_faces_are_crossed() {
    let pages = [0.0, 2.0, 4.0].map(|angle: f64| dvec3(angle.cos(), 0.0, angle.sin()));
    let mut positions = vec![DVec3::ZERO, DVec3::Y];
    let mut quads = Vec::new();
    for page in pages {
        let first = positions.len() as u32;
        positions.extend([page + DVec3::Y, page]);
        quads.push([0, 1, first, first + 1]);
    }
    let polygons: Vec<&[u32]> = quads.iter().map(<[u32; 4]>::as_slice).collect();
    let book = of(&positions, &polygons);
    for one in 0..3 {
        for other in 0..one {
            let (from, to) = (pages[one], pages[other] + DVec3::Y);
            let route = book.route(from, to, By::Exact).unwrap();
            assert!(
                (route.length - 5f64.sqrt()).abs() < 1e-12,
                "{}",
                route.length
            );
            assert_eq!(
                book.route(from, to, By::Plane),
                Err(RouteError::PlaneBranches)
            );
        }
    }
}

#[test]
fn starts_and_goals() {
    let mesh = squares([(0, 0), (1, 0), (7, 0)]);
    let goal = dvec3(2.0, 1.0, 0.0);
    let route = mesh.route(dvec3(0.25, 0.5, 3.0), goal, By::Exact).unwrap();
    assert_eq!(route.off, [3.0, 0.0]);
    assert_eq!(route.points[0], dvec3(0.25, 0.5, 0.0));
    assert!((route.length - 1.75f64.hypot(0.5)).abs() < 1e-12);
    for by in By::ALL {
        let route = mesh.route(goal, goal, by).unwrap();
        assert_eq!((route.points.len(), route.length), (1, 0.0));
    }
    let error = mesh
        .route(goal, dvec3(7.5, 0.5, 0.0), By::Edges)
        .unwrap_err();
    assert_eq!(error, RouteError::OtherPiece { start: 4, goal: 2 });
    let error = mesh.route(DVec3::NAN, goal, By::Exact).unwrap_err();
    assert!(matches!(error, RouteError::NotFinite { .. }));
    // Points within a triangle, on its edge and at a corner.
    let inside = [
        dvec3(0.7, 0.2, 0.0),
        dvec3(0.9, 0.3, 0.0),
        dvec3(0.5, 0.5, 0.0),
        dvec3(1.0, 0.0, 0.0),
    ];
    for from in inside {
        for to in inside {
            for by in By::ALL {
                let route = mesh.route(from, to, by).unwrap();
                let error = (route.length - from.distance(to)).abs();
                assert!(
                    error < 1e-12 || by == By::Edges || by == By::Greedy,
                    "{from} {to} {by}"
                );
            }
        }
    }
}

const OBJ: &str = "# a roof\nmtllib none.mtl\no left\nv 0 0 0\nv 1 0 1e0\nv 1 1 1\nv 0 1 0\n\
                   usemtl red\nf 1 2 3 4\ng right\nv 2 0 0\nv 2 1 0\nvt 0 0\nf -5 -2 -1 -4\nl 1 2\n";

#[test]
fn obj_files() {
    let read = |text: &str| read_obj("a.obj", text.as_bytes());
    let mesh = welded(&read(OBJ).unwrap(), 0.0).unwrap();
    assert_eq!((mesh.positions().len(), mesh.triangles().len()), (6, 4));
    let route = mesh
        .route(DVec3::ZERO, dvec3(2.0, 0.0, 0.0), By::Exact)
        .unwrap();
    assert!((route.length - 8f64.sqrt()).abs() < 1e-15);
    for bad in [
        "v 0 0\n",
        "v 0 0 0\nf 1 2 3\n",
        "v a b c\n",
        "f 1 2\n",
        "\u{0}\u{ff}",
    ] {
        let mesh = read(bad)
            .ok()
            .and_then(|polygons| welded(&polygons, 0.0).ok());
        assert!(mesh.is_none(), "{bad}");
    }
    assert_eq!(
        welded(&read("v 0 0 0\n").unwrap(), 0.0).unwrap_err(),
        MeshError::Empty
    );
}

const PLY: &str = "ply\nformat ascii 1.0\ncomment roof\nelement vertex 4\nproperty float x\n\
                   property double y\nproperty short z\nproperty uchar red\nelement face 1\n\
                   property list uchar int vertex_indices\nend_header\n0 0 0 9\n1 0 0 9\n1 1 0 9\n\
                   0 1 0 9\n4 0 1 2 3\n";

fn binary_ply(big: bool) -> Vec<u8> {
    let order = if big { "big" } else { "little" };
    let mut bytes = format!(
        "ply\nformat binary_{order}_endian 1.0\nelement vertex 4\nproperty float x\n\
         property float y\nproperty float z\nelement face 1\n\
         property list uchar uint vertex_index\nend_header\n"
    )
    .into_bytes();
    for number in CORNERS.iter().flat_map(DVec3::to_array) {
        let number = number as f32;
        bytes.extend(if big {
            number.to_be_bytes()
        } else {
            number.to_le_bytes()
        });
    }
    bytes.push(4);
    for index in 0u32..4 {
        bytes.extend(if big {
            index.to_be_bytes()
        } else {
            index.to_le_bytes()
        });
    }
    bytes
}

#[test]
fn ply_files() {
    let read = |bytes: &[u8]| read_ply("a.ply", bytes);
    for bytes in [PLY.as_bytes(), &binary_ply(false), &binary_ply(true)] {
        let mesh = welded(&read(bytes).unwrap(), 0.0).unwrap();
        assert_eq!(mesh.positions(), CORNERS);
        assert_eq!(mesh.triangles().len(), 2);
        assert!(read(&bytes[..bytes.len() - 3]).is_err());
    }
    // Numbers that no file of this length can hold.
    for huge in ["99999999999", "18446744073709551615"] {
        let text = PLY.replace("vertex 4", &format!("vertex {huge}"));
        assert!(read(text.as_bytes()).is_err());
        let text = PLY.replace(
            "element face 1",
            &format!("element gap {huge}\nelement face 1"),
        );
        assert!(read(text.as_bytes()).is_err());
    }
    let negative = PLY.replace("4 0 1 2 3", "4 0 1 2 -3");
    let error = read(negative.as_bytes()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "a.ply: error[E610]: the PLY file cannot be read: face 0 (from 0) names a vertex below 0: \
         [0, 1, 2, -3]; export it again"
    );
}

proptest! {
    /// Files with some bytes changed are refused or read, without a panic.
    #[test]
    fn damaged_files_are_refused_or_read(
        kind in 0..3usize,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12),
        keep in any::<prop::sample::Index>(),
    ) {
        let files = [OBJ.as_bytes().to_vec(), PLY.as_bytes().to_vec(), binary_ply(true)];
        let mut bytes = files[kind].clone();
        for (index, byte) in changes {
            let offset = index.index(bytes.len());
            bytes[offset] = byte;
        }
        bytes.truncate(keep.index(2 * bytes.len()).max(1));
        let _ = (read_obj("a", &bytes), read_ply("a", &bytes));
    }
}
