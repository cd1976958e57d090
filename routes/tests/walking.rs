//! Walkers that wait.

use glam::{DVec3, dvec3};
use tumble_routes::route::Route;
use tumble_routes::walkers::{Mover, Plan, Walker, WalkerError, plan};

fn straight(from: DVec3, to: DVec3) -> Walker {
    Walker {
        route: Route {
            points: vec![from, to],
            normals: None,
            length: from.distance(to),
            off: [0.0; 2],
        },
        radius: 0.5,
        speed: 1.0,
        start: 0.0,
    }
}

fn along_x() -> Walker {
    straight(DVec3::ZERO, dvec3(10.0, 0.0, 0.0))
}

/// Closes the part of the path from 4 to 6 for some time.
fn gate(from: f64, to: f64) -> Mover {
    let middle = dvec3(5.0, 0.0, 0.0);
    Mover {
        track: vec![(from, middle), (to, middle)],
        radius: 0.5,
    }
}

fn position_at(track: &[(f64, DVec3)], time: f64) -> DVec3 {
    let next = track
        .partition_point(|key| key.0 <= time)
        .clamp(1, track.len() - 1);
    let ((from, one), (to, other)) = (track[next - 1], track[next]);
    if to <= from {
        other
    } else {
        one.lerp(other, ((time - from) / (to - from)).clamp(0.0, 1.0))
    }
}

fn track(plan: &Plan) -> Vec<(f64, DVec3)> {
    plan.times
        .iter()
        .map(|&(time, _, position)| (time, position))
        .collect()
}

#[track_caller]
fn assert_arrives(found: &Result<Plan, WalkerError>, expected: f64) {
    let arrival = found.as_ref().unwrap().arrival;
    assert!(
        (arrival - expected).abs() <= 1e-9,
        "{arrival} instead of {expected}"
    );
}

#[test]
fn a_gate_is_waited_for() {
    assert_arrives(&plan(&[along_x()], &[gate(3.0, 7.0)])[0], 13.0);
    assert_arrives(&plan(&[along_x()], &[gate(0.0, 2.0)])[0], 10.0);
    assert_arrives(&plan(&[along_x()], &[])[0], 10.0);
    // There may be enough time between two gates: the walker needs 2 s from 4 to 6.
    assert_arrives(
        &plan(&[along_x()], &[gate(3.0, 7.0), gate(9.1, 12.0)])[0],
        13.0,
    );
    assert_arrives(
        &plan(&[along_x()], &[gate(3.0, 7.0), gate(8.9, 12.0)])[0],
        18.0,
    );
}

#[test]
fn who_comes_second_lets_the_first_pass() {
    let crossing = straight(dvec3(5.0, -5.0, 0.0), dvec3(5.0, 5.0, 0.0));
    let plans = plan(&[along_x(), crossing], &[]);
    assert_arrives(&plans[0], 10.0);
    assert_arrives(&plans[1], 10.0 + 2f64.sqrt());
    let [one, other] = [0, 1].map(|i| track(plans[i].as_ref().unwrap()));
    for step in 0..=1200 {
        let time = f64::from(step) / 100.0;
        let apart = position_at(&one, time).distance(position_at(&other, time));
        assert!(apart >= 1.0 - 1e-9, "{apart} at {time}");
    }
}

/// One mover stands on the line forever; another one comes towards the walker.
#[test]
fn who_cannot_pass_is_told() {
    let ends = straight(dvec3(5.0, 5.0, 0.0), dvec3(5.0, 0.0, 0.0));
    let plans = plan(
        &[
            ends,
            along_x(),
            straight(dvec3(8.0, 3.0, 0.0), dvec3(8.0, 9.0, 0.0)),
        ],
        &[],
    );
    assert_arrives(&plans[0], 5.0);
    // Before the first is there, the second has passed.
    assert!(plans[1].is_ok() || plans[1] == Err(WalkerError::Blocked));
    assert_arrives(&plans[2], 6.0);
    let back = straight(dvec3(10.0, 0.0, 0.0), DVec3::ZERO);
    let plans = plan(&[along_x(), back.clone()], &[]);
    assert_arrives(&plans[0], 10.0);
    assert_eq!(plans[1], Err(WalkerError::Blocked));
    // This mover does not block the other, because it starts after the other has passed.
    let aside = straight(dvec3(3.0, 0.0, 0.0), dvec3(3.0, 9.0, 0.0));
    let plans = plan(&[aside, along_x()], &[]);
    assert_arrives(&plans[1], 10.0);
}

#[test]
fn a_start_is_waited_for_where_one_stands() {
    let late = Walker {
        start: 2.0,
        ..along_x()
    };
    let plans = plan(std::slice::from_ref(&late), &[]);
    assert_arrives(&plans[0], 12.0);
    let times = &plans[0].as_ref().unwrap().times;
    assert_eq!((times[0].0, times[1].0, times[1].1), (0.0, 2.0, 0.0));
    // While it waits, another mover passes through its position.
    let runs = Mover {
        track: vec![(0.0, dvec3(0.0, -5.0, 0.0)), (2.0, dvec3(0.0, 5.0, 0.0))],
        radius: 0.5,
    };
    assert_eq!(plan(&[late], &[runs])[0], Err(WalkerError::Blocked));
    let nowhere = Walker {
        speed: 0.0,
        ..along_x()
    };
    assert!(matches!(
        plan(&[nowhere], &[])[0],
        Err(WalkerError::Numbers { .. })
    ));
    let point = Walker {
        route: Route {
            points: vec![DVec3::ZERO],
            normals: None,
            length: 0.0,
            off: [0.0; 2],
        },
        ..along_x()
    };
    assert_arrives(&plan(&[point], &[])[0], 0.0);
}

/// Many random walkers: no two are ever nearer to each other than the sum of their radii.
#[test]
fn crowds_keep_apart() {
    let mut random = fastrand::Rng::with_seed(3);
    let mut at = || dvec3(20.0 * random.f64(), 20.0 * random.f64(), 0.0);
    let walkers: Vec<Walker> = (0..12)
        .map(|_| {
            let points = vec![at(), at(), at()];
            let length = points
                .windows(2)
                .map(|pair| pair[0].distance(pair[1]))
                .sum();
            let route = Route {
                points,
                normals: None,
                length,
                off: [0.0; 2],
            };
            Walker {
                route,
                radius: 0.4,
                speed: 1.5,
                start: 0.0,
            }
        })
        .collect();
    let plans = plan(&walkers, &[]);
    let tracks: Vec<Vec<(f64, DVec3)>> = plans.iter().flatten().map(track).collect();
    assert!(tracks.len() > 6, "{} of 12 pass", tracks.len());
    for (index, one) in tracks.iter().enumerate() {
        for other in &tracks[..index] {
            for step in 0..6000 {
                let time = f64::from(step) / 100.0;
                let apart = position_at(one, time).distance(position_at(other, time));
                assert!(apart >= 0.8 - 1e-6, "{apart} at {time}");
            }
        }
    }
}
