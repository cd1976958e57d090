//! Lengths that are known, by formulas or from independent computations.

use std::f64::consts::{PI, SQRT_2};

use glam::{DVec3, dvec3};
use tumble_routes::error::RouteError;
use tumble_routes::mesh::Mesh;
use tumble_routes::route::By;

use crate::shapes::{cuboid, deltahedron, of, on_terrain, squares, terrain};

#[track_caller]
fn assert_length(mesh: &Mesh, from: DVec3, to: DVec3, by: By, expected: f64, bound: f64) {
    for (from, to) in [(from, to), (to, from)] {
        let route = mesh.route(from, to, by).unwrap();
        let error = (route.length - expected).abs();
        assert!(
            error <= bound,
            "{from} to {to} by {by}: {} is off by {error:e}",
            route.length
        );
        assert!(route.points[0].distance(from) < 1e-9);
        assert!(route.points.last().unwrap().distance(to) < 1e-9);
        let sum: f64 = route
            .points
            .windows(2)
            .map(|pair| pair[0].distance(pair[1]))
            .sum();
        assert!((sum - route.length).abs() <= 1e-12 * expected);
        // In the other direction, the greedy search may find another route.
        if by == By::Greedy {
            break;
        }
    }
}

#[track_caller]
fn assert_exact(mesh: &Mesh, from: DVec3, to: DVec3, expected: f64) {
    assert_length(mesh, from, to, By::Exact, expected, 1e-12 * expected);
}

#[test]
fn cube_and_boxes() {
    let cube = cuboid(DVec3::ONE);
    assert_exact(&cube, DVec3::ZERO, DVec3::ONE, 5f64.sqrt());
    assert_length(
        &cube,
        DVec3::ZERO,
        DVec3::ONE,
        By::Edges,
        1.0 + SQRT_2,
        1e-12,
    );
    assert_eq!(
        cube.route(DVec3::ZERO, DVec3::ONE, By::Plane),
        Err(RouteError::NoPlane)
    );
    let room = cuboid(dvec3(30.0, 12.0, 12.0));
    assert_exact(&room, dvec3(0.0, 6.0, 11.0), dvec3(30.0, 6.0, 1.0), 40.0);
    let tower = cuboid(dvec3(1.0, 1.0, 2.0));
    assert_exact(&tower, DVec3::ZERO, dvec3(1.0, 1.0, 2.0), 8f64.sqrt());
    // The farthest point is not the opposite corner (Kotani's ant).
    assert_exact(
        &tower,
        DVec3::ZERO,
        dvec3(0.75, 0.75, 2.0),
        130f64.sqrt() / 4.0,
    );
}

#[test]
fn polyhedra_of_equal_triangles() {
    let golden = (1.0 + 5f64.sqrt()) / 2.0;
    let mut corners = Vec::new();
    for a in [-0.5, 0.5] {
        for b in [-golden / 2.0, golden / 2.0] {
            corners.extend([dvec3(0.0, a, b), dvec3(a, b, 0.0), dvec3(b, 0.0, a)]);
        }
    }
    let icosahedron = deltahedron(&corners);
    assert_eq!(icosahedron.triangles().len(), 20);
    let mut nearest = corners.clone();
    nearest.sort_by(|a, b| corners[0].distance(*a).total_cmp(&corners[0].distance(*b)));
    assert_exact(&icosahedron, nearest[0], nearest[1], 1.0);
    assert_exact(&icosahedron, nearest[0], nearest[6], 3f64.sqrt());
    assert_exact(&icosahedron, nearest[0], nearest[11], 7f64.sqrt());
    let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis / SQRT_2);
    let octahedron = deltahedron(&[axes, axes.map(|axis| -axis)].concat());
    assert_exact(&octahedron, axes[0], -axes[0], 3f64.sqrt());
    let corners = [(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)];
    let corners =
        corners.map(|(x, y, z)| dvec3(f64::from(x), f64::from(y), f64::from(z)) / 8f64.sqrt());
    let tetrahedron = deltahedron(&corners);
    let middle = |a: usize, b: usize| (corners[a] + corners[b]) / 2.0;
    assert_exact(&tetrahedron, middle(0, 1), middle(2, 3), 1.0);
}

/// Routes bend at the middle, about which there are 480°.
#[test]
fn saddle_of_eight_triangles() {
    let up = ((SQRT_2 - 1.0) / (2.0 + SQRT_2)).sqrt();
    let rim = |i: u32| {
        let (sin, cos) = (f64::from(i) * PI / 4.0).sin_cos();
        let out = (1.0 - up * up).sqrt();
        dvec3(
            out * cos,
            out * sin,
            if i.is_multiple_of(2) { up } else { -up },
        )
    };
    let corners: Vec<DVec3> = (0..8).map(rim).chain([DVec3::ZERO]).collect();
    let saddle = deltahedron(&corners);
    assert_eq!(saddle.triangles().len(), 8);
    for (apart, length) in [(1, 1.0), (2, 3f64.sqrt()), (3, 2.0), (4, 2.0)] {
        assert_exact(&saddle, corners[0], corners[apart], length);
    }
}

/// Routes bend at inner corners of boundaries.
#[test]
fn boundaries() {
    let l = squares([(0, 0), (1, 0), (0, 1)]);
    assert_exact(&l, dvec3(2.0, 0.5, 0.0), dvec3(0.5, 2.0, 0.0), 5f64.sqrt());
    let is_hole = |x: i32, y: i32| (-1..1).contains(&x) && (-1..1).contains(&y);
    let all = (-2..2).flat_map(|x| (-2..2).map(move |y| (x, y)));
    let frame = squares(all.filter(|&(x, y)| !is_hole(x, y)));
    assert_exact(
        &frame,
        dvec3(-2.0, 0.0, 0.0),
        dvec3(2.0, 0.0, 0.0),
        2.0 + 2.0 * SQRT_2,
    );
}

/// Computed by the exact algorithm of Mitchell, Mount and Papadimitriou.
#[test]
fn terrain_of_100_vertices() {
    let terrain = terrain();
    for ((ax, ay), (bx, by), length) in [
        ((0, 0), (3, 6), 7.986_460_126_6),
        ((0, 1), (8, 4), 9.753_576_605_3),
        ((0, 4), (7, 5), 8.171_233_610_6),
        ((0, 0), (1, 8), 10.678_902_851),
        ((0, 0), (9, 1), 11.112_608_644),
    ] {
        let (from, to) = (on_terrain(ax, ay), on_terrain(bx, by));
        assert_length(&terrain, from, to, By::Exact, length, 1e-9);
    }
    let (from, to) = (on_terrain(0, 0), on_terrain(3, 6));
    for (by, length) in [
        (By::Plane, 8.413_577_301_2),
        (By::Greedy, 8.891_446_896_6),
        (By::Edges, 8.415_952_011_6),
    ] {
        assert_length(&terrain, from, to, by, length, 1e-9);
    }
}

/// The greedy search would go to and fro forever if vertices could be visited twice.
#[test]
fn dead_ends() {
    let row = |range: std::ops::RangeInclusive<i32>, y| range.map(move |x| (x, y));
    let column = |x, range: std::ops::RangeInclusive<i32>| range.map(move |y| (x, y));
    let u: Vec<_> = column(0, 0..=2)
        .chain(row(1..=2, 0))
        .chain(column(3, 0..=2))
        .collect();
    let u = squares(u.into_iter().chain([(2, 2)]));
    let (from, to) = (dvec3(1.0, 3.0, 0.0), dvec3(2.0, 3.0, 0.0));
    assert_length(&u, from, to, By::Exact, 6.414_213_562_4, 1e-10);
    assert_length(&u, from, to, By::Greedy, 7.0, 1e-12);
    let alley = row(0..=2, 1).chain(column(0, -2..=0)).chain(row(1..=5, -2));
    let alley = squares(alley.chain(column(5, -1..=1)).collect::<Vec<_>>());
    let (from, to) = (dvec3(0.0, 1.0, 0.0), dvec3(5.0, 2.0, 0.0));
    assert_length(&alley, from, to, By::Exact, 9.236_067_977_5, 1e-10);
    assert_length(&alley, from, to, By::Greedy, 10.0, 1e-12);
}

/// A disc as a hole of 16 and of 64 corners: the route runs along the hole.
#[test]
fn way_round_a_disc() {
    for (count, length) in [(16, 4.505_554_582_7), (64, 4.510_893_429_8)] {
        let mut positions = Vec::new();
        for radius in [1.0, 4.0] {
            for i in 0..count {
                let (sin, cos) = (f64::from(i) * 2.0 * PI / f64::from(count)).sin_cos();
                positions.push(radius * dvec3(cos, sin, 0.0));
            }
        }
        let quads: Vec<[u32; 4]> = (0..count)
            .map(|i| [i, (i + 1) % count, count + (i + 1) % count, count + i])
            .collect();
        let quads: Vec<&[u32]> = quads.iter().map(<[u32; 4]>::as_slice).collect();
        let ring = of(&positions, &quads);
        let (from, to) = (dvec3(-2.0, 0.0, 0.0), dvec3(2.0, 0.0, 0.0));
        assert_length(&ring, from, to, By::Exact, length, 1e-10);
    }
}
