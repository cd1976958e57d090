//! Weights that are set and weights that fade: functions of the clock, with the same bits on every device.

use tumble::WrapMode;
use tumble::crowd::{Crowd, CrowdError, CrowdFade, CrowdLayer, CrowdValues};

use super::{SOME, bits, cpu, crowds, evaluated, layer, library};
use crate::support::Random;

/// The clips of each instance, in three layers, and the fades of its upper layers.
const LAYERS: usize = 3;
const INSTANCES: usize = 41;

/// A tenth of a second.
const TENTH: u64 = 70_560;

fn set_up(crowd: &mut Crowd, plays: &[CrowdLayer]) {
    for (slot, &plays) in plays.iter().enumerate() {
        crowd.set(slot / LAYERS, slot % LAYERS, plays).unwrap();
    }
    for instance in 0..INSTANCES {
        let (ticks, to) = (instance as u64 * 9_973, [1.0, 0.0, 0.37][instance % 3]);
        crowd.fade(instance, 1, to, ticks).unwrap();
        // This fade has begun already, or will begin.
        let fade = CrowdFade::new(0.25, 1.0)
            .with_start(crowd.clock() + TENTH * (instance as u64 % 7) - 2 * TENTH)
            .with_ticks(3 * TENTH + 1);
        if !instance.is_multiple_of(5) {
            crowd.set_fade(instance, 2, fade).unwrap();
        }
    }
}

/// A jump, steps of all sizes and steps back give the same bits at the same time, on every device.
#[test]
fn a_jump_and_many_steps_fade_alike() {
    let mut random = Random(41);
    let library = library(&mut random, 17, &SOME[..2]);
    let plays: Vec<CrowdLayer> = (0..INSTANCES * LAYERS)
        .map(|_| layer(&mut random, &library))
        .collect();
    let began = 10 * TENTH;
    let ends = [
        began,
        began + 1,
        began + TENTH,
        began + 4 * TENTH,
        began + 30 * TENTH,
    ];
    // Expected: a new crowd for each time, whose clock jumps there.
    let expected = ends.map(|end| {
        let mut crowd = cpu().crowd(&library, INSTANCES, LAYERS).unwrap();
        crowd.set_clock(began).unwrap();
        set_up(&mut crowd, &plays);
        crowd.set_clock(end).unwrap();
        bits(&evaluated(&mut crowd, CrowdValues::Local))
    });
    for pair in expected.windows(2) {
        assert_ne!(pair[0], pair[1]);
    }
    for (name, mut crowd) in crowds(&library, INSTANCES, LAYERS) {
        crowd.set_clock(began).unwrap();
        set_up(&mut crowd, &plays);
        for (end, expected) in ends.iter().zip(&expected) {
            let left = end - crowd.clock();
            for step in 1..=1000 {
                crowd.set_clock(end - left + left * step / 1000).unwrap();
            }
            let found = bits(&evaluated(&mut crowd, CrowdValues::Local));
            assert!(found == *expected, "{name}, forwards to {end}");
        }
        for (end, expected) in ends.iter().zip(&expected).rev() {
            crowd.set_clock(*end).unwrap();
            let found = bits(&evaluated(&mut crowd, CrowdValues::Local));
            assert!(found == *expected, "{name}, back to {end}");
        }
    }
}

/// At its end, a fade has exactly its target: with 1, only the layer's clip is visible; with 0, the layer
/// has no effect.
#[test]
fn both_ends_of_a_fade_are_exact() {
    let mut random = Random(43);
    let library = library(&mut random, 9, &SOME[..2]);
    let play = |clip| CrowdLayer::new(clip).at(100_000).with_wrap(WrapMode::Hold);
    for (name, mut crowd) in crowds(&library, 2, 2) {
        // The second instance plays each clip alone.
        let alone = |crowd: &mut Crowd, clip| {
            crowd.set(1, 0, play(clip)).unwrap();
            crowd.set_weight(1, 1, 0.0).unwrap();
            evaluated(crowd, CrowdValues::Rotations)[9..].to_vec()
        };
        crowd.set(0, 0, play(0)).unwrap();
        crowd.set(0, 1, play(1).with_weight(0.0)).unwrap();
        crowd.fade(0, 1, 1.0, 1000).unwrap();
        let lower = alone(&mut crowd, 0);
        let started = evaluated(&mut crowd, CrowdValues::Rotations)[..9].to_vec();
        assert_eq!(bits(&started), bits(&lower), "{name}");
        for (ticks, weight) in [
            (1, 33.0 / 32768.0),
            (499, 0.5),
            (499, 32735.0 / 32768.0),
            (1, 1.0),
        ] {
            crowd.advance_ticks(ticks).unwrap();
            assert_eq!(crowd.get(0, 1).unwrap().weight, weight);
        }
        for (clip, instance) in [(0, 0), (1, 1)] {
            crowd
                .set(instance, 0, play(clip).at(100_000 + 1000))
                .unwrap();
        }
        crowd.set_weight(1, 1, 0.0).unwrap();
        let found = evaluated(&mut crowd, CrowdValues::Rotations);
        assert_eq!(
            bits(&found[..9]),
            bits(&found[9..]),
            "{name}: the upper clip"
        );
        // Days later the weight is the same; a fade of 0 ticks takes effect at once.
        crowd.advance_ticks(1 << 45).unwrap();
        assert_eq!(crowd.get(0, 1).unwrap().weight, 1.0);
        crowd.fade(0, 1, 0.25, 0).unwrap();
        assert_eq!(crowd.get(0, 1).unwrap().weight, 0.25);
        crowd.advance_ticks(1).unwrap();
        assert_eq!(crowd.get(0, 1).unwrap().weight, 0.25);
    }
}

/// A fade that is set while another one runs continues from the current weight; setting the layer ends the fade.
#[test]
fn fades_take_over_from_each_other() {
    let mut random = Random(47);
    let library = library(&mut random, 3, &SOME[..1]);
    let mut crowd = cpu().crowd(&library, 4, 2).unwrap();
    let weight = |crowd: &Crowd, instance| crowd.get(instance, 1).unwrap().weight;
    for instance in 0..4 {
        crowd.fade(instance, 1, 1.0, 800).unwrap();
    }
    crowd.advance_ticks(400).unwrap();
    crowd.fade(0, 1, 0.0, 200).unwrap();
    crowd.set_weight(1, 1, 0.125).unwrap();
    let plays = CrowdLayer::new(0).with_weight(0.75);
    crowd.set_all(&[(2, 1, plays)]).unwrap();
    let weights = |crowd: &Crowd| [0, 1, 2, 3].map(|instance| weight(crowd, instance));
    assert_eq!(weights(&crowd), [0.5, 0.125, 0.75, 0.5]);
    crowd.advance_ticks(100).unwrap();
    assert_eq!(weights(&crowd), [0.25, 0.125, 0.75, 0.625]);
    crowd.advance_ticks(300).unwrap();
    assert_eq!(weights(&crowd), [0.0, 0.125, 0.75, 1.0]);
    // Before its start, a running fade has the weight from which it began.
    crowd.set_clock(0).unwrap();
    assert_eq!(weights(&crowd), [0.5, 0.125, 0.75, 0.0]);
    assert_eq!(crowd.get_fade(1, 1).unwrap(), None);
    let expected = CrowdFade::new(0.5, 0.0).with_start(400).with_ticks(200);
    assert_eq!(crowd.get_fade(0, 1).unwrap(), Some(expected));
}

/// Layers and fades that are read from a crowd, and set in another one at the same time of the
/// clock, continue in the same way.
#[test]
fn a_saved_crowd_fades_on_as_before() {
    let mut random = Random(53);
    let library = library(&mut random, 8, &SOME[..2]);
    let mut crowd = cpu().crowd(&library, INSTANCES, LAYERS).unwrap();
    crowd.set_clock(5 * TENTH).unwrap();
    let plays: Vec<CrowdLayer> = (0..INSTANCES * LAYERS)
        .map(|_| layer(&mut random, &library).with_speed(1.0))
        .collect();
    set_up(&mut crowd, &plays);
    crowd.advance(0.123).unwrap();
    for (name, mut replayed) in crowds(&library, INSTANCES, LAYERS) {
        replayed.set_clock(crowd.clock()).unwrap();
        for slot in 0..INSTANCES * LAYERS {
            let (instance, layer) = (slot / LAYERS, slot % LAYERS);
            replayed
                .set(instance, layer, crowd.get(instance, layer).unwrap())
                .unwrap();
            if let Some(fade) = crowd.get_fade(instance, layer).unwrap() {
                replayed.set_fade(instance, layer, fade).unwrap();
            }
        }
        let clock = crowd.clock();
        for _ in 0..4 {
            for crowd in [&mut crowd, &mut replayed] {
                crowd.advance(0.077).unwrap();
            }
            let found = bits(&evaluated(&mut replayed, CrowdValues::Model));
            assert!(
                found == bits(&evaluated(&mut crowd, CrowdValues::Model)),
                "{name}"
            );
        }
        crowd.set_clock(clock).unwrap();
    }
}

#[test]
fn weights_that_cannot_be_are_refused() {
    let mut random = Random(59);
    let library = library(&mut random, 2, &SOME[..1]);
    let mut crowd = cpu().crowd(&library, 2, 2).unwrap();
    crowd.fade(1, 1, 0.5, 100).unwrap();
    let before = (crowd.get(1, 1).unwrap(), crowd.get_fade(1, 1).unwrap());
    for weight in [f32::NAN, f32::INFINITY, -0.1, 1.1] {
        let is_weight = |refused: Result<(), CrowdError>| matches!(refused, Err(CrowdError::Weight { weight: found }) if found.to_bits() == weight.to_bits());
        assert!(is_weight(crowd.set_weight(1, 1, weight)));
        assert!(is_weight(crowd.fade(1, 1, weight, 5)));
        let fade = CrowdFade::new(weight, 1.0).with_start(0).with_ticks(9);
        assert!(is_weight(crowd.set_fade(1, 1, fade)));
    }
    let missing = |subject, index| CrowdError::Missing {
        subject,
        index,
        count: 2,
    };
    for (instance, layer, expected) in [
        (2, 1, missing("instance", 2)),
        (1, 2, missing("layer", 2)),
        (1, 0, CrowdError::FirstLayer),
    ] {
        assert_eq!(
            crowd.set_weight(instance, layer, 0.5),
            Err(expected.clone())
        );
        assert_eq!(crowd.fade(instance, layer, 0.5, 5), Err(expected));
    }
    assert!(crowd.get_fade(2, 1).is_err());
    assert_eq!(
        (crowd.get(1, 1).unwrap(), crowd.get_fade(1, 1).unwrap()),
        before
    );
}
