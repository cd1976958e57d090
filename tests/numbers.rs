//! Every number that a caller gives: one that is not finite is refused by a typed error that names the option
//! and the value, and every accepted one gives finite results.

use glam::{Affine3A, DQuat, DVec3, Quat, Vec3};
use tumble::crowd::{Crowd, CrowdError, CrowdLayer, CrowdLibrary, CrowdValues};
use tumble::paths::{Direction, Follow, PathSpeed};
use tumble::reduce::{ReducedCurve, reduce_rotations, reduce_vectors};
use tumble::{
    Device, Ends, Engine, Error, Interpolation, Layout, METHODS, PoseError, SampleTimes, Skeleton,
    Smoothing, SmoothingKernel, Tcb, TrackSet, VectorMethod, method,
};

type Computed = Result<Vec<f64>, Box<dyn std::error::Error>>;

/// A number of an interface: its name, the word that its error must have, and the call that takes it.
struct Number {
    name: &'static str,
    word: &'static str,
    try_with: fn(f64) -> Computed,
}

const TIMES: [f64; 5] = [0.0, 0.4, 0.5, 1.7, 2.0];

fn keys() -> Vec<Quat> {
    [0.0, 0.9, 1.3, 0.2, 0.7]
        .map(Quat::from_rotation_y)
        .to_vec()
}

fn set() -> TrackSet {
    let mut set = TrackSet::new();
    set.push("arm", &TIMES, &keys()).unwrap();
    set
}

fn cpu() -> Engine {
    Engine::new(Device::Cpu).unwrap()
}

fn numbers(quats: &[Quat]) -> Vec<f64> {
    quats
        .iter()
        .flat_map(glam::Quat::to_array)
        .map(f64::from)
        .collect()
}

/// Evaluates at a rate, sparse samples from keys, explicit times and as a clip: every route checks.
fn evaluated(set: &TrackSet, interpolation: Interpolation) -> Computed {
    let engine = cpu();
    let mut all = Vec::new();
    for frames in [
        SampleTimes::fps(30),
        SampleTimes::fps(1),
        SampleTimes::at(vec![0.45, 0.1, 1.9]),
    ] {
        let found = engine.evaluate(set, interpolation, &frames)?;
        all.extend(numbers(found.as_quats()));
    }
    let clip = engine.upload(set, interpolation)?;
    all.extend(numbers(clip.evaluate(&SampleTimes::fps(30))?.as_quats()));
    Ok(all)
}

fn with_tcb(tcb: Tcb) -> Computed {
    let mut all = Vec::new();
    for method in METHODS {
        let interpolation = Interpolation::from(method).with_tcb(tcb);
        all.extend(evaluated(&set(), interpolation)?);
    }
    Ok(all)
}

fn with_ends(start: DVec3, end: DVec3) -> Computed {
    let mut all = Vec::new();
    for method in METHODS {
        let interpolation = Interpolation::from(method).with_ends(Ends::Clamped { start, end });
        all.extend(evaluated(&set(), interpolation)?);
    }
    Ok(all)
}

fn with_set(
    method: tumble::Method,
    change: impl Fn(&mut TrackSet) -> Result<(), tumble::TrackError>,
) -> Computed {
    let mut set = set();
    change(&mut set)?;
    evaluated(&set, method.into())
}

fn vectors(set: &TrackSet, method: VectorMethod) -> Computed {
    let found = cpu().vectors(
        set,
        tumble::Channel::Translation,
        method,
        method::SLERP,
        &SampleTimes::fps(20),
        Layout::TrackMajor,
    )?;
    Ok(found
        .as_slice()
        .iter()
        .flat_map(glam::Vec4::to_array)
        .map(f64::from)
        .collect())
}

fn with_translations(key: f32, tangent: f32) -> Computed {
    let mut set = set();
    let keys = [Vec3::ZERO, Vec3::ONE, Vec3::new(0.0, key, 0.0)];
    let tangents = [[Vec3::ZERO; 2], [Vec3::splat(tangent); 2], [Vec3::ZERO; 2]];
    set.set_translations(0, &[0.0, 1.0, 2.0], &keys, &tangents)?;
    let mut all = Vec::new();
    for method in [VectorMethod::Linear, VectorMethod::GltfCubic] {
        all.extend(vectors(&set, method)?);
    }
    Ok(all)
}

fn followed(follow: &Follow) -> Computed {
    let mut set = TrackSet::new();
    let road = [[0.0, 0.0, 0.0], [4.0, 0.0, 1.0], [8.0, 1.0, 0.0]];
    set.push_path("car", &[0.0, 1.0, 3.0], &road, &[])?;
    let found = cpu().follow(&set, follow, &SampleTimes::fps(10), Layout::TrackMajor)?;
    let positions = found
        .positions
        .as_slice()
        .iter()
        .flat_map(glam::Vec4::to_array);
    let mut all: Vec<f64> = positions.map(f64::from).collect();
    all.extend(numbers(found.rotations.as_quats()));
    Ok(all)
}

fn smoothed(kernel: SmoothingKernel) -> Computed {
    let engine = cpu();
    let samples = engine.evaluate(&set(), method::SLERP, &SampleTimes::fps(30))?;
    let found = engine.smooth(&samples, &Smoothing::new(kernel))?;
    Ok(numbers(found.as_quats()))
}

fn layers() -> [tumble::Rotations; 2] {
    let of = |method: tumble::Method| {
        cpu()
            .evaluate(&set(), method, &SampleTimes::fps(9))
            .unwrap()
    };
    [of(method::SLERP), of(method::STEP)]
}

fn crowd() -> Result<(Crowd, CrowdLibrary), CrowdError> {
    let skeleton = Skeleton::new(vec![None], vec![Vec3::ZERO]).unwrap();
    let mut library = CrowdLibrary::new(&skeleton)?;
    library.push(&set(), method::SLERP, VectorMethod::Linear)?;
    Ok((cpu().crowd(&library, 2, 2)?, library))
}

fn crowded(layer: usize, plays: CrowdLayer) -> Computed {
    let (mut crowd, _) = crowd()?;
    crowd.set(1, layer, plays)?;
    crowd.advance(0.3)?;
    let mut output = vec![[0.0; 4]; crowd.output_len(CrowdValues::Model)];
    crowd.evaluate_into(CrowdValues::Model, &mut output)?;
    Ok(output
        .as_flattened()
        .iter()
        .map(|&c| f64::from(c))
        .collect())
}

const NUMBERS: &[Number] = &[
    Number {
        name: "Interpolation.tcb.tension",
        word: "tension",
        try_with: |value| {
            with_tcb(Tcb {
                tension: value,
                ..Tcb::default()
            })
        },
    },
    Number {
        name: "Interpolation.tcb.continuity",
        word: "continuity",
        try_with: |value| {
            with_tcb(Tcb {
                continuity: value,
                ..Tcb::default()
            })
        },
    },
    Number {
        name: "Interpolation.tcb.bias",
        word: "bias",
        try_with: |value| {
            with_tcb(Tcb {
                bias: value,
                ..Tcb::default()
            })
        },
    },
    Number {
        name: "Ends::Clamped.start",
        word: "end velocity",
        try_with: |value| with_ends(DVec3::new(0.0, value, 0.0), DVec3::ZERO),
    },
    Number {
        name: "Ends::Clamped.end",
        word: "end velocity",
        try_with: |value| with_ends(DVec3::ZERO, DVec3::new(value, 0.0, 0.0)),
    },
    Number {
        name: "TrackSet::set_tcb",
        word: "tension",
        try_with: |value| {
            with_set(method::KOCHANEK_BARTELS, |set| {
                let tension = value;
                let tcb = Tcb {
                    tension,
                    ..Tcb::default()
                };
                set.set_tcb(0, &[tcb; 5])
            })
        },
    },
    Number {
        name: "TrackSet::set_velocities",
        word: "velocity",
        try_with: |value| {
            with_set(method::HERMITE, |set| {
                set.set_velocities(0, &[DVec3::new(value, 0.0, 1.0); 5])
            })
        },
    },
    Number {
        name: "TrackSet::set_tangents",
        word: "tangent",
        try_with: |value| {
            with_set(method::GLTF_CUBIC, |set| {
                let tangent = Quat::from_xyzw(value as f32, 0.0, 0.3, 0.0);
                set.set_tangents(0, &[[tangent; 2]; 5])
            })
        },
    },
    Number {
        name: "TrackSet::set_translations",
        word: "vector",
        try_with: |value| with_translations(value as f32, 0.0),
    },
    Number {
        name: "TrackSet::set_translations' tangents",
        word: "tangent",
        try_with: |value| with_translations(1.0, value as f32),
    },
    Number {
        name: "TrackSet::push",
        word: "time",
        try_with: |value| {
            let mut set = TrackSet::new();
            set.push("", &[value, value + 1.0], &keys()[..2])?;
            Ok(Vec::new())
        },
    },
    Number {
        name: "Frames::at",
        word: "time",
        try_with: |value| {
            let found = cpu().evaluate(&set(), method::C2, &SampleTimes::at(vec![0.1, value]))?;
            Ok(numbers(found.as_quats()))
        },
    },
    Number {
        name: "Follow.up",
        word: "upward",
        try_with: |value| followed(&Follow::default().with_up(DVec3::new(0.0, value, 0.0))),
    },
    Number {
        name: "Direction::Ahead",
        word: "ahead",
        try_with: |value| followed(&Follow::default().with_direction(Direction::Ahead(value))),
    },
    Number {
        name: "Direction::Point",
        word: "look at",
        try_with: |value| {
            followed(
                &Follow::default().with_direction(Direction::Point(DVec3::new(1.0, value, 0.0))),
            )
        },
    },
    Number {
        name: "PathSpeed::Eased.start",
        word: "grow",
        try_with: |value| {
            followed(&Follow::default().with_speed(PathSpeed::Eased {
                start: value,
                end: 0.2,
            }))
        },
    },
    Number {
        name: "SmoothingKernel::Box",
        word: "wide",
        try_with: |value| smoothed(SmoothingKernel::Box(value)),
    },
    Number {
        name: "SmoothingKernel::Tent",
        word: "wide",
        try_with: |value| smoothed(SmoothingKernel::Tent(value)),
    },
    Number {
        name: "SmoothingKernel::Gaussian",
        word: "wide",
        try_with: |value| smoothed(SmoothingKernel::Gaussian(value)),
    },
    Number {
        name: "Engine::blend",
        word: "weight",
        try_with: |value| {
            let [a, b] = layers();
            let found = cpu().blend(&[(&a, 1.0), (&b, value as f32)])?;
            Ok(numbers(found.as_quats()))
        },
    },
    Number {
        name: "Engine::mix",
        word: "weight",
        try_with: |value| {
            let [a, b] = layers();
            Ok(numbers(cpu().mix(&a, &b, value as f32)?.as_quats()))
        },
    },
    Number {
        name: "Engine::add",
        word: "weight",
        try_with: |value| {
            let [a, b] = layers();
            let found = cpu().add(&a, &b, &[Quat::IDENTITY], value as f32)?;
            Ok(numbers(found.as_quats()))
        },
    },
    Number {
        name: "Skeleton::new",
        word: "the offset of track",
        try_with: |value| {
            Skeleton::new(vec![None], vec![Vec3::new(value as f32, 0.0, 0.0)])?;
            Ok(Vec::new())
        },
    },
    Number {
        name: "Skeleton::chain",
        word: "the offset of track",
        try_with: |value| {
            Skeleton::chain(3, value)?;
            Ok(Vec::new())
        },
    },
    Number {
        name: "CrowdLayer.weight",
        word: "weight",
        try_with: |value| {
            let weight = value as f32;
            crowded(1, CrowdLayer::new(0).with_weight(weight))
        },
    },
    Number {
        name: "CrowdLayer.speed",
        word: "speed",
        try_with: |value| {
            let speed = value as f32;
            crowded(0, CrowdLayer::new(0).with_speed(speed))
        },
    },
    Number {
        name: "CrowdLibrary::push_mask",
        word: "weight",
        try_with: |value| {
            crowd()?.1.push_mask(&[value as f32])?;
            Ok(Vec::new())
        },
    },
    Number {
        name: "CrowdLibrary::set_inverse_bind",
        word: "inverse bind matrix",
        try_with: |value| {
            let matrix = Affine3A::from_translation(Vec3::new(value as f32, 0.0, 0.0));
            crowd()?.1.set_inverse_bind(&[matrix])?;
            Ok(Vec::new())
        },
    },
    Number {
        name: "Crowd::advance",
        word: " s;",
        try_with: |value| {
            crowd()?.0.advance(value)?;
            Ok(Vec::new())
        },
    },
    Number {
        name: "Crowd::ticks_of",
        word: " s;",
        try_with: |value| Ok(vec![crowd()?.0.ticks_of(value)? as f64]),
    },
    Number {
        name: "reduce_rotations",
        word: "tolerance",
        try_with: |value| {
            let times = [0.0, 1.0, 2.0];
            let found =
                reduce_rotations(&times, &[DQuat::IDENTITY; 3], value, ReducedCurve::Linear)?;
            Ok(vec![found.error])
        },
    },
    Number {
        name: "reduce_vectors",
        word: "tolerance",
        try_with: |value| {
            let samples = [DVec3::ZERO, DVec3::ONE, DVec3::X];
            let found = reduce_vectors(&[0.0, 1.0, 2.0], &samples, value, ReducedCurve::GltfCubic)?;
            Ok(vec![found.error])
        },
    },
];

#[test]
fn no_number_gives_a_result_that_is_none() {
    let mut wrong = Vec::new();
    for &Number {
        name,
        word,
        try_with,
    } in NUMBERS
    {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            match try_with(value) {
                Ok(_) => wrong.push(format!("{name}: {value} is accepted")),
                Err(error) => {
                    let text = error.to_string();
                    if !text.contains(word) {
                        wrong.push(format!("{name}: {value} is refused with: {text}"));
                    }
                }
            }
        }
        let tiny = [f64::MIN_POSITIVE / 4.0, 1e-40, -1e-40, -0.0];
        let large = [1e6, 1e9, -1e12, 1e30, 1e38, -3e38, 1e300, -f64::MAX];
        for value in tiny.into_iter().chain(large).chain([0.3, -1.0]) {
            let Ok(found) = try_with(value) else { continue };
            if let Some(index) = found.iter().position(|number| !number.is_finite()) {
                wrong.push(format!(
                    "{name}: {value:e} gives {} at {index}",
                    found[index]
                ));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn errors_name_the_option_and_the_value() {
    let tcb = Tcb {
        bias: f64::NAN,
        ..Tcb::default()
    };
    let interpolation = Interpolation::from(method::KOCHANEK_BARTELS).with_tcb(tcb);
    let error = interpolation.check().unwrap_err();
    assert_eq!(
        error.to_string(),
        "the bias NaN is out of range; give a number between -1e6 and 1e6, mostly within -1 and 1"
    );
    // It is refused for an empty set, too.
    let empty = TrackSet::new();
    assert!(
        cpu()
            .evaluate(&empty, interpolation, &SampleTimes::at(vec![0.0]))
            .is_err()
    );
    let [a, b] = layers();
    let error = cpu().blend(&[(&a, 1.0), (&b, f32::INFINITY)]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the weight of layer 1 is inf; weights are finite, and within ±1e9"
    );
    assert!(matches!(
        error,
        Error::Pose(PoseError::WeightNotFinite { layer: 1, .. })
    ));
    let smoothing = Smoothing::new(SmoothingKernel::Linear).with_passes(u32::MAX);
    assert_eq!(
        smoothing.check().unwrap_err().to_string(),
        "4294967295 passes are too many; give at most 10000, or a wider kernel"
    );
}

/// `?` takes a crowd's error into the engine's.
#[test]
fn a_crowd_fails_as_an_engine_does() {
    fn make() -> Result<Crowd, Error> {
        let (_, library) = crowd()?;
        Ok(cpu().crowd(&library, 0, 1)?)
    }
    let Err(Error::Crowd(error)) = make() else {
        panic!("no instances");
    };
    assert_eq!(error, CrowdError::Instances { requested: 0 });
}

/// At weights 0 and 1 a mix has the bits of its inputs, and so has a layer of a crowd at weight 1.
#[test]
fn ends_of_a_mix_are_the_inputs() {
    let bits = |quats: &[Quat]| -> Vec<[u32; 4]> {
        quats
            .iter()
            .map(|q| q.to_array().map(f32::to_bits))
            .collect()
    };
    let [a, b] = layers();
    let mut engines = crate::support::vulkan_engines(|_| ());
    engines.push(cpu());
    for engine in &engines {
        for (weight, expected) in [(0.0, &a), (1.0, &b)] {
            let found = engine.mix(&a, &b, weight).unwrap();
            assert_eq!(
                bits(found.as_quats()),
                bits(expected.as_quats()),
                "{weight}"
            );
        }
    }
    let skeleton = Skeleton::new(vec![None], vec![Vec3::ZERO]).unwrap();
    let mut library = CrowdLibrary::new(&skeleton).unwrap();
    let mut other = TrackSet::new();
    other
        .push("arm", &[0.0, 2.0], &[keys()[1], keys()[3]])
        .unwrap();
    let road = [Vec3::new(0.1, 0.2, 0.3), Vec3::new(7.7, -1.3, 1e-3)];
    other.set_translations(0, &[0.0, 2.0], &road, &[]).unwrap();
    for clip in [&set(), &other] {
        library
            .push(clip, method::SLERP, VectorMethod::Linear)
            .unwrap();
    }
    let at = |engine: &Engine, below: usize, above: Option<usize>| {
        let mut crowd = engine.crowd(&library, 1, 2).unwrap();
        crowd.set(0, 0, CrowdLayer::new(below).at(500_000)).unwrap();
        if let Some(clip) = above {
            crowd.set(0, 1, CrowdLayer::new(clip).at(500_000)).unwrap();
        }
        let mut output = [[0.0f32; 4]; 3];
        crowd
            .evaluate_into(CrowdValues::Model, &mut output)
            .unwrap();
        output.map(|row| row.map(f32::to_bits))
    };
    // After `set` of another layer, the second layer still has the first clip at weight 1, so it hides
    // the layers below.
    let expected = at(&cpu(), 1, Some(1));
    for engine in &engines {
        assert_eq!(at(engine, 0, Some(1)), expected, "{engine:?}");
    }
}
