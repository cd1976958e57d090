//! Faces as files have them: concave ones, sheets with a back, seams and corners on sides. Every length was
//! computed apart.

use glam::{DVec3, dvec3};
use tumble_formats::surface::obj::read_obj;
use tumble_routes::error::{MeshError, MeshWarning};
use tumble_routes::mesh::Mesh;
use tumble_routes::route::By;

use crate::shapes::welded;

fn length(mesh: &Mesh, from: [f64; 3], to: [f64; 3]) -> f64 {
    mesh.route(from.into(), to.into(), By::Exact)
        .unwrap()
        .length
}

fn near(found: f64, expected: f64) {
    assert!((found - expected).abs() < 1e-9, "{found}, not {expected}");
}

fn of_obj(text: &str) -> Mesh {
    welded(&read_obj("a.obj", text.as_bytes()).unwrap(), 0.0).unwrap()
}

/// An L whose face begins at any corner, in any plane: the route bends at the inner corner.
#[test]
fn ways_stay_on_a_concave_face() {
    let corners = [[0, 0], [5, 0], [5, 2], [2, 2], [2, 5], [0, 5]];
    let tilted = |[x, y]: [i32; 2]| {
        let (x, y) = (f64::from(x), f64::from(y));
        x * dvec3(0.6, 0.0, 0.8) + y * DVec3::Y
    };
    // From (4.5, 1.5) to (1.5, 4.5) by (2, 2).
    let expected = 2.0 * 2.5f64.hypot(0.5);
    for first in 0..6 {
        for backwards in [false, true] {
            let mut order: Vec<u32> = (0..6).map(|k| (first + k) % 6).collect();
            if backwards {
                order.reverse();
            }
            let positions = corners.map(tilted);
            let mesh = Mesh::of_polygons(&positions, [order.as_slice()]).unwrap();
            assert_eq!(mesh.triangles().len(), 4);
            assert_eq!(mesh.warnings(), []);
            let to = |x: f64, y: f64| (x * dvec3(0.6, 0.0, 0.8) + y * DVec3::Y).to_array();
            near(length(&mesh, to(4.5, 1.5), to(1.5, 4.5)), expected);
        }
    }
}

/// A comb of many teeth, a spiral and a face with a slit to its hole: the areas of the triangles add up to
/// the face's, and none is outside.
#[test]
fn concave_faces_are_covered_once() {
    let comb: Vec<[f64; 2]> = (0..40)
        .map(|i| [f64::from(i), f64::from(i % 2) * 5.0 + 1.0])
        .chain([[39.0, 0.0], [0.0, 0.0]])
        .collect();
    let slit = [
        [0.0, 0.0],
        [4.0, 0.0],
        [4.0, 4.0],
        [0.0, 4.0],
        [0.0, 0.0],
        [1.0, 1.0],
        [1.0, 3.0],
        [3.0, 3.0],
        [3.0, 1.0],
        [1.0, 1.0],
    ];
    let spiral = [
        [0.0, 0.0],
        [6.0, 0.0],
        [6.0, 6.0],
        [1.0, 6.0],
        [1.0, 2.0],
        [4.0, 2.0],
        [4.0, 4.0],
        [3.0, 4.0],
        [3.0, 3.0],
        [2.0, 3.0],
        [2.0, 5.0],
        [5.0, 5.0],
        [5.0, 1.0],
        [0.0, 1.0],
    ];
    for outline in [comb, slit.to_vec(), spiral.to_vec()] {
        let positions: Vec<DVec3> = outline.iter().map(|&[x, y]| dvec3(x, y, 2.0)).collect();
        let polygon: Vec<u32> = (0..positions.len() as u32).collect();
        let mesh = Mesh::of_polygons(&positions, [polygon.as_slice()]).unwrap();
        let all = mesh.positions();
        let areas = mesh.triangles().iter().map(|triangle| {
            let [a, b, c] = triangle.map(|vertex| all[vertex as usize]);
            0.5 * (b - a).cross(c - a).length()
        });
        let count = outline.len();
        let double = |i: usize| {
            let ([x, y], [next_x, next_y]) = (outline[i], outline[(i + 1) % count]);
            x * next_y - next_x * y
        };
        let area = 0.5 * (0..count).map(double).sum::<f64>().abs();
        near(areas.sum(), area);
        assert_eq!(mesh.triangles().len(), count - 2);
    }
}

#[test]
fn a_sheet_with_a_back_is_one_sheet() {
    let text = "v 0 0 0\nv 2 0 0\nv 0 2 0\nf 1 2 3\nf 3 2 1\nf 2 3 1\n";
    let mesh = of_obj(text);
    assert_eq!(
        mesh.warnings(),
        [MeshWarning::Doubled { count: 2, face: 1 }]
    );
    near(length(&mesh, [0.5, 0.25, 0.0], [1.25, 0.25, 0.0]), 0.75);
    // Two equal polygons of opposite winding, which begin at different corners, are merged.
    let text = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nf 1 2 3 4\nf 3 2 1 4\n";
    let mesh = of_obj(text);
    assert_eq!(mesh.triangles().len(), 2);
    near(length(&mesh, [0.1, 0.2, 0.0], [1.9, 0.2, 0.0]), 1.8);
}

#[test]
fn seams_are_welded_within_a_distance() {
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1.000001 0 0\nv 2 0 0\nv 2 1 0\nv 1.000001 1 0\n\
                f 1 2 3 4\nf 5 6 7 8\n";
    let apart = of_obj(text);
    assert!(
        matches!(apart.warnings(), [MeshWarning::Seam { count: 4, .. }]),
        "{:?}",
        apart.warnings()
    );
    let error = apart
        .route(DVec3::ZERO, dvec3(2.0, 1.0, 0.0), By::Exact)
        .unwrap_err();
    assert!(error.to_string().contains("--weld"), "{error}");
    let polygons = read_obj("a.obj", text.as_bytes()).unwrap();
    let mended = welded(&polygons, 1e-5).unwrap();
    assert_eq!(mended.warnings(), []);
    assert_eq!(mended.positions().len(), 6);
    near(length(&mended, [0.0; 3], [2.0, 1.0, 0.0]), 5f64.sqrt());
    for tolerance in [-1.0, f64::NAN, f64::INFINITY] {
        let refused = welded(&polygons, tolerance).unwrap_err();
        assert!(matches!(refused, MeshError::Weld { .. }), "{refused}");
    }
}

/// One large square next to two small ones: the corner between the two is on the side of the large
/// one.
#[test]
fn a_corner_on_a_side_joins_the_faces() {
    let text = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 2 0.7 0\nv 3 0 0\nv 3 0.7 0\nv 3 2 0\n\
                f 1 2 3 4\nf 2 6 7 5\nf 5 7 8 3\n";
    let mesh = of_obj(text);
    assert_eq!(mesh.warnings(), [MeshWarning::SidesCut { count: 1 }]);
    near(length(&mesh, [0.0, 1.0, 0.0], [3.0, 1.0, 0.0]), 3.0);
    near(
        length(&mesh, [0.0, 0.1, 0.0], [3.0, 1.9, 0.0]),
        3f64.hypot(1.8),
    );
}

#[test]
fn valid_obj_is_read() {
    let unnamed =
        of_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl \nmtllib\nf 1/1/1 2//2 3/3 # a comment\n");
    assert_eq!(unnamed.triangles().len(), 1);
    let continued = of_obj("v 0 0 0\nv 1 -3 0\nv 2 \\\n0 0\nv 1 3 0\nf 1 2 \\\r\n 3\nf 1 3 4");
    assert_eq!(continued.triangles().len(), 2);
    near(length(&continued, [1.0, -2.0, 0.0], [1.0, 2.0, 0.0]), 4.0);
    // A corner may be in the middle of a side, at any corner with which the face begins.
    for face in ["1 2 3 4", "2 3 4 1", "3 4 1 2", "4 1 2 3"] {
        let mesh = of_obj(&format!("v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 2 0\nf {face}\n"));
        assert_eq!(mesh.triangles().len(), 2);
        near(
            length(&mesh, [1.9, 0.0, 0.0], [0.0, 1.9, 0.0]),
            1.9 * 2f64.sqrt(),
        );
    }
    // Relative numbers count from the vertices so far.
    assert_eq!(
        of_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\n")
            .triangles()
            .len(),
        1
    );
}

#[test]
fn crossing_sides_are_refused() {
    let bow = "v 0 0 0\nv 2 2 0\nv 2 0 0\nv 0 1 0\nf 1 2 3 4\n";
    let bow = read_obj("a.obj", bow.as_bytes()).unwrap();
    let error = welded(&bow, 0.0).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("face 0 (from 0) cross each other; cut it into triangles"),
        "{error}"
    );
}
