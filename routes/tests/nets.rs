//! Bézier surfaces.

use glam::{DVec2, DVec3, dvec2, dvec3};
use tumble_routes::net::{Net, NetBy, NetError};

/// z = x y.
fn saddle() -> Net {
    let points = [(0, 0), (0, 1), (1, 0), (1, 1)];
    let point = |(x, y): (i32, i32)| dvec3(f64::from(x), f64::from(y), f64::from(x * y));
    Net::new(2, 2, points.map(point).to_vec()).unwrap()
}

/// Over the unit square, the four inner control points at height 1.
fn bump() -> Net {
    let point = |i: u32, j: u32| {
        let is_inner = (1..3).contains(&i) && (1..3).contains(&j);
        dvec3(
            f64::from(i) / 3.0,
            f64::from(j) / 3.0,
            f64::from(u8::from(is_inner)),
        )
    };
    let all = (0..4).flat_map(|i| (0..4).map(move |j| (i, j)));
    Net::new(4, 4, all.map(|(i, j)| point(i, j)).collect()).unwrap()
}

#[test]
fn a_line_and_the_shortest_way_over_a_saddle() {
    let net = saddle();
    let (from, to) = (DVec3::ZERO, dvec3(1.0, 0.5, 0.5));
    let line = net.route(from, to, NetBy::Line).unwrap();
    assert!(
        (line.length - 1.252_949_347_6).abs() < 1e-10,
        "{}",
        line.length
    );
    assert_eq!((line.points[0], *line.points.last().unwrap()), (from, to));
    let shortest = net.route(from, to, NetBy::Facets(200)).unwrap().length;
    assert!((shortest - 1.251_039).abs() < 1e-6, "{shortest}");
}

#[test]
fn ways_over_a_bump() {
    let net = bump();
    let top = net.at(dvec2(0.25, 0.75));
    assert!((top - dvec3(0.25, 0.75, 0.316_406_25)).length() < 1e-15);
    let (from, to) = (dvec3(0.0, 0.4, 0.0), dvec3(1.0, 0.4, 0.0));
    let line = net.route(from, to, NetBy::Line).unwrap();
    assert!(
        (line.length - 1.540_353_482_7).abs() < 1e-10,
        "{}",
        line.length
    );
    let facets = net.route(from, to, NetBy::Facets(20)).unwrap();
    assert!(
        (facets.length - 1.367_335_344_2).abs() < 1e-10,
        "{}",
        facets.length
    );
    // The error falls with the square of the number of facets.
    let errors = [20, 40, 80]
        .map(|count| 1.368_25 - net.route(from, to, NetBy::Facets(count)).unwrap().length);
    assert!(
        errors[0] > 3.0 * errors[1] && errors[2].abs() < 1e-4,
        "{errors:?}"
    );
}

#[test]
fn places_are_found_again() {
    let mut random = fastrand::Rng::with_seed(7);
    for net in [saddle(), bump()] {
        for _ in 0..100 {
            let uv = dvec2(random.f64(), random.f64());
            let found = net.nearest(net.at(uv));
            assert!((found.uv - uv).length() < 1e-10, "{uv} {found:?}");
            // From a point outside, along the normal.
            let found = net.nearest(net.at(uv) + 0.01 * net.normal(uv));
            assert!((found.uv - uv).length() < 1e-10, "{uv} {found:?}");
            assert!((found.distance - 0.01).abs() < 1e-12);
        }
        for corner in [DVec2::ZERO, DVec2::ONE, dvec2(0.0, 0.3), dvec2(0.6, 1.0)] {
            let found = net.nearest(net.at(corner));
            assert!((found.uv - corner).length() < 1e-10, "{corner} {found:?}");
        }
    }
}

/// A side of the surface is one point; facets there lose a corner and are dropped.
#[test]
fn a_collapsed_side() {
    let tip = DVec3::Z;
    let points = vec![
        tip,
        tip,
        tip,
        dvec3(-1.0, 0.0, 0.0),
        dvec3(0.0, 2.0, 0.0),
        DVec3::X,
    ];
    let net = Net::new(2, 3, points).unwrap();
    let found = net.nearest(tip);
    assert!(
        found.uv.x.abs() < 1e-10 && found.distance < 1e-15,
        "{found:?}"
    );
    assert!((net.normal(found.uv).length() - 1.0).abs() < 1e-12);
    let route = net.route(tip, DVec3::X, NetBy::Facets(12)).unwrap();
    assert!(
        (route.length - 2f64.sqrt()).abs() < 1e-12,
        "{}",
        route.length
    );
}

#[test]
fn what_is_no_net_is_refused() {
    let points = vec![DVec3::ZERO; 4];
    assert!(matches!(
        Net::new(1, 4, points.clone()),
        Err(NetError::Shape { .. })
    ));
    assert!(matches!(
        Net::new(2, 3, points.clone()),
        Err(NetError::Count { found: 4, .. })
    ));
    let mut bad = points;
    bad[2].y = f64::NAN;
    assert!(matches!(
        Net::new(2, 2, bad),
        Err(NetError::NotFinite {
            row: 1,
            column: 0,
            ..
        })
    ));
    let error = saddle()
        .route(DVec3::ZERO, DVec3::X, NetBy::Facets(0))
        .unwrap_err();
    assert_eq!(error, NetError::Facets { facets: 0 });
    assert!(saddle().route(DVec3::NAN, DVec3::X, NetBy::Line).is_err());
}
