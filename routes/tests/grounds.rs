//! Routes between obstacles.

use std::f64::consts::PI;

use glam::{DVec3, dvec3};
use tumble_routes::error::RouteError;
use tumble_routes::ground::{Clear, Ground, GroundError};
use tumble_routes::mesh::Mesh;
use tumble_routes::route::By;

use crate::shapes::squares;

/// A square from -3 to 3, two triangles for each unit.
fn plain() -> Mesh {
    squares((-3..3).flat_map(|x| (-3..3).map(move |y| (x, y))))
}

/// A rock that is so small that the area within its clearance is a disc.
fn pebble() -> Mesh {
    let corner = |i: u32| 1e-3 * DVec3::from_array([0, 1, 2].map(|k| f64::from(u8::from(i == k))));
    let corners: Vec<DVec3> = (0..4).map(corner).collect();
    Mesh::new(&corners, &[[0, 1, 2], [0, 1, 3], [1, 2, 3], [0, 2, 3]]).unwrap()
}

fn clear(obstacles: &Mesh, finest: f64) -> Clear<'_> {
    Clear {
        obstacles: Some(obstacles),
        clearance: 1.0,
        finest,
        max_slope: None,
        up: DVec3::Z,
    }
}

#[test]
fn ways_round_a_disc_are_free_and_nearly_shortest() {
    let (plain, rock) = (plain(), pebble());
    let (from, to) = (dvec3(-2.0, 0.0, 0.0), dvec3(2.0, 0.0, 0.0));
    let shortest = 2.0 * 3f64.sqrt() + PI / 3.0;
    let mut before = f64::INFINITY;
    for finest in [0.2, 0.05, 0.0125] {
        let ground = Ground::new(&plain, clear(&rock, finest)).unwrap();
        let route = ground.mesh.route(from, to, By::Exact).unwrap();
        let over = route.length - shortest;
        // Going around the hole adds about the length of the finest edge.
        assert!(
            over > 0.0 && over < 3.0 * finest && over < before,
            "{finest}: {over}"
        );
        before = over;
        for pair in route.points.windows(2) {
            for step in 0..=10 {
                let point = pair[0].lerp(pair[1], f64::from(step) / 10.0);
                assert!(
                    rock.nearest(point).distance(point) >= 1.0 - 1e-12,
                    "{point}"
                );
            }
        }
    }
}

/// Every inner edge has two triangles, so no vertex is in the middle of an edge.
#[test]
fn halving_leaves_no_gaps() {
    let (plain, rock) = (plain(), pebble());
    let options = Clear {
        clearance: 0.0,
        ..clear(&rock, 0.01)
    };
    let ground = Ground::new(&plain, options).unwrap();
    let mut edges = std::collections::HashMap::new();
    for triangle in ground.mesh.triangles() {
        for k in 0..3 {
            let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
            *edges.entry((a.min(b), a.max(b))).or_insert(0) += 1;
        }
    }
    let positions = ground.mesh.positions();
    let on_rim = |vertex: u32| positions[vertex as usize].abs().max_element() >= 3.0;
    let near = |vertex: u32| positions[vertex as usize].length() < 0.1;
    for ((a, b), count) in edges {
        let is_boundary = on_rim(a) && on_rim(b) || near(a) && near(b);
        assert!(
            count == 2 || is_boundary,
            "{} {}",
            positions[a as usize],
            positions[b as usize]
        );
    }
}

#[test]
fn steep_ground_is_closed() {
    // A roof: 45° on both sides of its ridge, and a flat yard.
    let positions = [
        (0, 0, 0),
        (2, 0, 0),
        (2, 2, 2),
        (0, 2, 2),
        (0, -2, 0),
        (2, -2, 0),
    ];
    let positions = positions.map(|(x, y, z)| dvec3(f64::from(x), f64::from(y), f64::from(z)));
    let triangles = [[0, 1, 2], [0, 2, 3], [4, 5, 1], [4, 1, 0]];
    let hill = Mesh::new(&positions, &triangles).unwrap();
    let slope = |degrees: f64| Clear {
        obstacles: None,
        clearance: 0.0,
        finest: 1.0,
        max_slope: Some(degrees.to_radians()),
        up: 2.0 * DVec3::Z,
    };
    assert_eq!(
        Ground::new(&hill, slope(45.0))
            .unwrap()
            .mesh
            .triangles()
            .len(),
        4
    );
    assert_eq!(
        Ground::new(&hill, slope(44.9))
            .unwrap()
            .mesh
            .triangles()
            .len(),
        2
    );
    assert_eq!(
        Ground::new(&hill, slope(91.0)).unwrap_err(),
        GroundError::Slope
    );
}

#[test]
fn what_cannot_be_is_refused() {
    let (plain, rock) = (plain(), pebble());
    let with = |clearance: f64, finest: f64| {
        let options = Clear {
            clearance,
            finest,
            ..clear(&rock, 1.0)
        };
        Ground::new(&plain, options).unwrap_err()
    };
    assert_eq!(with(-1.0, 1.0), GroundError::Clearance { clearance: -1.0 });
    assert!(matches!(with(f64::NAN, 1.0), GroundError::Clearance { .. }));
    assert_eq!(with(1.0, 0.0), GroundError::Finest { finest: 0.0 });
    assert_eq!(with(9.0, 1.0), GroundError::Nothing);
    // A start within the clearance is refused; a start next to the ground is moved onto it.
    let ground = Ground::new(&plain, clear(&rock, 0.1)).unwrap();
    let goal = dvec3(2.0, 0.0, 0.0);
    let error = ground
        .route(dvec3(0.0, 0.9, 0.0), goal, By::Exact)
        .unwrap_err();
    assert!(matches!(error, RouteError::NotFree { .. }), "{error}");
    assert!(ground.route(goal, dvec3(0.0, 0.9, 5.0), By::Exact).is_err());
    let route = ground
        .route(dvec3(-2.0, 0.0, 5.0), goal, By::Exact)
        .unwrap();
    assert_eq!(route.off, [5.0, 0.0]);
    // A clearance as wide as the ground divides the ground.
    let corners = [
        dvec3(0.0, -4.0, 0.0),
        dvec3(0.0, 4.0, 0.0),
        dvec3(0.0, 0.0, 1.0),
    ];
    let wall = Mesh::new(&corners, &[[0, 1, 2]]).unwrap();
    let ground = Ground::new(
        &plain,
        Clear {
            clearance: 0.9,
            ..clear(&wall, 0.2)
        },
    );
    let error = ground.map(|ground| {
        let route = ground.route(dvec3(-3.0, 0.0, 0.0), dvec3(3.0, 0.0, 0.0), By::Exact);
        route.unwrap_err()
    });
    assert!(
        matches!(
            error,
            Ok(RouteError::OtherPiece {
                start: 1..,
                goal: 1..
            })
        ),
        "{error:?}"
    );
}
