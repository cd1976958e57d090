use super::*;

#[test]
fn a_refused_track_leaves_the_set_unchanged() {
    let mut set = TrackSet::new();
    set.push("a", &[0.0], &[Quat::IDENTITY]).unwrap();
    let before = set.clone();
    let keys = [Quat::IDENTITY, Quat::from_xyzw(0.0, 0.0, 0.0, 2.0)];
    let error = set.push("b", &[0.0, 1.0], &keys).unwrap_err();
    assert_eq!(
        error,
        TrackError::NotUnit {
            track: 1,
            key: 1,
            norm: 2.0
        }
    );
    assert_eq!(set, before);
}

#[test]
fn equal_times_are_kept_once_and_names_stay_with_their_tracks() {
    let times = [0.0, 1.0];
    let keys = [Quat::IDENTITY; 2];
    let mut set = TrackSet::new();
    set.push("", &times, &keys).unwrap();
    set.push("hip", &times, &keys).unwrap();
    set.push("", &[0.0, 2.0], &keys).unwrap();
    assert_eq!(set.times.len(), 4);
    assert_eq!(set.track_name(0), "box1");
    assert_eq!(set.track_name(1), "hip");
    assert_eq!(set.track_name(2), "box3");
    assert_eq!(set.select(1..3).unwrap().track_name(0), "hip");
    assert_eq!(set.time_span(), Some((0.0, 2.0)));
}

#[test]
fn a_nearly_unit_key_is_normalised_and_a_unit_key_is_kept() {
    let unit = Quat::from_rotation_y(0.3);
    let long = Quat::from_array(unit.to_array().map(|c| c * 1.01));
    let mut set = TrackSet::new();
    set.push("", &[0.0, 1.0], &[unit, long]).unwrap();
    let keys = set.track(0).keys;
    assert_eq!(keys[0].to_array(), unit.to_array());
    assert!(keys[1].angle_between(unit) < 1e-6);
    assert!((f64::from(keys[1].length()) - 1.0).abs() < 1e-6);
}

#[test]
fn a_set_knows_which_keys_the_one_before_turns() {
    let [near, distant] = [1.0, 3.0].map(Quat::from_rotation_x);
    let tracks = |second: Quat| [Quat::IDENTITY, near, near, second];
    for (second, is_negated) in [(distant, false), (-distant, true), (-near, true)] {
        let times = [0.0, 1.0];
        let shared = TrackSet::with_shared_times(&times, &tracks(second)).unwrap();
        let mut pushed = TrackSet::new();
        // A refused track must not leave signs in the set.
        let refused = [
            Quat::IDENTITY,
            -Quat::IDENTITY,
            Quat::from_xyzw(0.0, 0.0, 0.0, 2.0),
        ];
        pushed.push("", &[0.0, 1.0, 2.0], &refused).unwrap_err();
        for keys in tracks(second).chunks(2) {
            pushed.push("", &times, keys).unwrap();
        }
        for set in [&shared, &pushed, &pushed.select(0..2).unwrap()] {
            assert_eq!(set.signs(1).is_negated(1), is_negated, "{second}");
            assert_eq!(set.arcs_are_short(), !is_negated);
            assert!(!set.signs(0).any());
        }
        assert_eq!(
            pushed.select(1..2).unwrap().signs(0).is_negated(1),
            is_negated
        );
    }
    // Signs are not continued from one track to the next.
    let apart = [Quat::IDENTITY, near, -near, -distant];
    let set = TrackSet::with_shared_times(&[0.0, 1.0], &apart).unwrap();
    assert!(set.arcs_are_short());
}

/// A clip whose translations begin before its rotations began later when its tracks were put in another order.
#[test]
fn selected_tracks_keep_the_times_of_their_vectors() {
    let mut set = TrackSet::new();
    for _ in 0..2 {
        set.push("", &[0.5, 1.0], &[Quat::IDENTITY; 2]).unwrap();
    }
    let (times, points) = ([0.0, 2.0], [[1.0, 0.0, 0.0]; 2]);
    set.set_translations(1, &times, &points, &[]).unwrap();
    set.set_scales(0, &[0.25, 1.5], &points, &[]).unwrap();
    for (tracks, span) in [
        (&[0, 1][..], (0.0, 2.0)),
        (&[1][..], (0.0, 2.0)),
        (&[0][..], (0.25, 1.5)),
    ] {
        let selected = set.select(tracks.iter().copied()).unwrap();
        assert_eq!(selected.time_span(), Some(span), "{tracks:?}");
    }
}

#[test]
fn times_are_refused_wherever_they_do_not_increase() {
    let good: Vec<f64> = (0..9).map(f64::from).collect();
    assert!(check_times(0, &good, 9).is_ok());
    assert_eq!(
        check_times(1, &good, 8).unwrap_err().to_string(),
        "track 1 has 8 keys but 9 times; give one time for each key"
    );
    assert_eq!(check_times(1, &[], 0), Err(TrackError::Empty { track: 1 }));
    assert!(check_times(0, &[-LATEST, LATEST], 2).is_ok());
    for index in 0..9 {
        for bad in [
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            2.0 * LATEST,
            -2.0 * LATEST,
        ] {
            let mut times = good.clone();
            times[index] = bad;
            let error = check_times(0, &times, 9).unwrap_err();
            let is_named = match error {
                TrackError::TimeNotFinite { key, .. } => !bad.is_finite() && key == index,
                _ => bad.is_finite(),
            };
            assert!(is_named, "{bad} at {index}: {error}");
        }
        if index > 0 {
            let mut times = good.clone();
            times[index] = times[index - 1];
            let error = check_times(0, &times, 9).unwrap_err();
            assert!(matches!(error, TrackError::TimeNotIncreasing { key, .. } if key == index));
        }
    }
}
