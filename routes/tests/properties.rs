//! Properties of all routes, whatever the mesh.

use glam::{DQuat, DVec3, dvec3};
use proptest::prelude::*;
use tumble_routes::mesh::Mesh;
use tumble_routes::route::{By, Route};

use crate::shapes::heights;

/// A rough terrain and three points on it.
fn terrains() -> impl Strategy<Value = (Mesh, [DVec3; 3])> {
    let height = prop_oneof![Just(0.0), -2.0..2.0];
    let width = 4..9u32;
    let coordinates = prop::array::uniform3(prop::array::uniform2(0.0..1.0));
    (
        width,
        prop::collection::vec(height, 81),
        coordinates,
        any::<bool>(),
    )
        .prop_map(|(width, all, coordinates, rounded)| {
            let (positions, triangles) = heights(width, |x, y| all[(y * 9 + x) as usize]);
            let mesh = Mesh::new(&positions, &triangles).unwrap();
            let side = f64::from(width - 1);
            let points = coordinates.map(|[x, y]| {
                let point = dvec3(x * side, y * side, 0.0);
                mesh.nearest(if rounded { point.round() } else { point })
            });
            (mesh, points)
        })
}

fn exact(mesh: &Mesh, from: DVec3, to: DVec3) -> Route {
    mesh.route(from, to, By::Exact).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    #[test]
    fn lengths_are_a_metric((mesh, [a, b, c]) in terrains()) {
        let [ab, ba, bc, ac] = [(a, b), (b, a), (b, c), (a, c)].map(|(from, to)| exact(&mesh, from, to).length);
        prop_assert!((ab - ba).abs() <= 1e-12 * (1.0 + ab), "{ab} {ba}");
        prop_assert!(ac <= ab + bc + 1e-12 * (1.0 + ac), "{ac} {ab} {bc}");
        prop_assert!(ab >= a.distance(b) - 1e-12);
    }

    #[test]
    fn no_other_way_is_shorter((mesh, [a, b, _]) in terrains()) {
        let shortest = exact(&mesh, a, b).length;
        for by in [By::Plane, By::Greedy, By::Edges] {
            if let Ok(route) = mesh.route(a, b, by) {
                prop_assert!(route.length >= shortest - 1e-12 * (1.0 + shortest), "{by}: {} {shortest}", route.length);
            } else {
                prop_assert!(by == By::Plane);
            }
        }
        let edges = mesh.route(a, b, By::Edges).unwrap().length;
        let greedy = mesh.route(a, b, By::Greedy).unwrap().length;
        prop_assert!(greedy >= edges - 1e-12 * (1.0 + edges));
    }

    #[test]
    fn all_points_lie_on_the_surface((mesh, [a, b, _]) in terrains()) {
        for by in By::ALL {
            let Ok(route) = mesh.route(a, b, by) else { continue };
            for pair in route.points.windows(2) {
                for step in 0..=4 {
                    let point = pair[0].lerp(pair[1], f64::from(step) / 4.0);
                    let off = mesh.nearest(point).distance(point);
                    prop_assert!(off < 1e-11, "{by}: {point} is {off} off");
                }
            }
            prop_assert!(route.points[0].distance(a) < 1e-11);
            prop_assert!(route.points.last().unwrap().distance(b) < 1e-11);
            for normal in route.normals.unwrap() {
                prop_assert!((normal.length() - 1.0).abs() < 1e-12);
                prop_assert!(normal.z.abs() > 0.0);
            }
        }
    }

    /// Rotating, moving and scaling the mesh, or renumbering its vertices, does not change the
    /// routes.
    #[test]
    fn the_frame_does_not_matter(
        (mesh, [a, b, _]) in terrains(),
        rotation in prop::array::uniform4(-1.0..1.0),
        scale in 0.01..100.0,
        first in any::<prop::sample::Index>(),
    ) {
        prop_assume!(DQuat::from_array(rotation).length() > 0.1);
        let rotation = DQuat::from_array(rotation).normalize();
        let moved = |point: DVec3| scale * (rotation * point + dvec3(1.0, -2.0, 3.0));
        let positions: Vec<DVec3> = mesh.positions().iter().map(|&position| moved(position)).collect();
        let mut triangles = mesh.triangles().to_vec();
        let middle = first.index(triangles.len());
        triangles.rotate_left(middle);
        for triangle in &mut triangles {
            triangle.rotate_left(middle % 3);
        }
        let other = Mesh::new(&positions, &triangles).unwrap();
        let (one, two): (f64, f64) = (exact(&mesh, a, b).length, exact(&other, moved(a), moved(b)).length);
        prop_assert!(f64::abs(scale * one - two) <= 1e-11 * (1.0 + one) * scale, "{one} {two}");
    }
}

/// Many routes at once are equal to single ones.
#[test]
fn many_pairs_are_those_alone() {
    let mesh = crate::shapes::terrain();
    let mut random = fastrand::Rng::with_seed(5);
    let mut at = || mesh.nearest(dvec3(9.0 * random.f64(), 9.0 * random.f64(), 1.0));
    let pairs: Vec<[DVec3; 2]> = (0..20).map(|_| [at(), at()]).collect();
    for by in By::ALL {
        let all = mesh.routes(&pairs, by);
        for (pair, route) in pairs.iter().zip(all) {
            assert_eq!(route, mesh.route(pair[0], pair[1], by));
        }
    }
}
