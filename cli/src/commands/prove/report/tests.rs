//! A proof that cannot fail proves nothing: each thing that it must have is taken away, and it is no proof.

use tumble::Device;
use tumble::vulkan::SelfTestReport;
use tumble_verify::renderer::{RendererCheck, RendererReport};

use super::*;
use crate::commands::prove::text;

/// A complete proof. `None` if no device reports its limits.
fn whole() -> Option<Proof> {
    let devices = Device::list().unwrap_or_default();
    assert!(
        !devices.is_empty() || std::env::var_os("CI").is_none(),
        "CI has a Vulkan device"
    );
    let Device::Vulkan(device) = devices.into_iter().next()? else {
        return None;
    };
    let mut info = device.info().clone();
    info.name = "llvmpipe of a test".to_owned();
    let mut proof = Proof {
        warnings: Vec::new(),
        format: FORMAT,
        format_version: FORMAT_VERSION,
        verdict: Verdict::NotProved,
        reasons: Vec::new(),
        program: crate::commands::prove::device::program(),
        date: String::new(),
        seconds: 1.0,
        seconds_allowed: 2,
        host: crate::commands::prove::device::host(),
        device: DeviceSection {
            info,
            details: None,
            choices: None,
            bus: None,
            opened_in: [0.0; 2],
        },
        self_tests: vec![SelfTestReport {
            name: "sine",
            total: 10,
            differing: 0,
        }],
        kernels: KernelSection {
            count: 3,
            ran: 3,
            values: 30,
            ..KernelSection::default()
        },
        negative_control: NegativeControl {
            has_run: true,
            must_differ: true,
            values: 10,
            differing: 4,
            expressions: Vec::new(),
        },
        golden: GoldenSection {
            cases: 5,
            cases_compared: 5,
            bytes: 80,
            ..GoldenSection::default()
        },
        random: RandomSection {
            rounds: 8,
            crowds: 2,
            values: 100,
            ..RandomSection::default()
        },
        scalars: ScalarSection {
            values: 1 << 20,
            ..ScalarSection::default()
        },
        renderer: Some(RendererReport {
            checks: vec![RendererCheck {
                name: "buffer to buffer".to_owned(),
                values: 7,
                differing: 0,
            }],
            memory_is_hidden: false,
            frames_in_flight: 3,
            copy_queue_family: None,
            validation_messages: Vec::new(),
        }),
        validation: Some(ValidationSection {
            has_run: true,
            golden_cases: 3,
            renderer_values: 4,
            ..ValidationSection::default()
        }),
        compile_times: CompileTimes::default(),
        figures: None,
        failures: Vec::new(),
    };
    proof.judge();
    Some(proof)
}

type Change = (&'static str, fn(&mut Proof));

/// The verdict after each change, and its reason on the page.
fn expect(verdict: Verdict, changes: &[Change]) {
    for (reason, change) in changes {
        let Some(mut proof) = whole() else { return };
        assert_eq!(proof.verdict, Verdict::Proved, "{:?}", proof.reasons);
        assert!(text::page(&proof).contains("PROVED: this device gives the CPU's bits"));
        change(&mut proof);
        proof.judge();
        assert_eq!(proof.verdict, verdict, "{reason}: {:?}", proof.reasons);
        let is_reported = proof.reasons.iter().any(|text| text.contains(reason));
        assert!(is_reported, "{reason}: {:?}", proof.reasons);
        let page = text::page(&proof);
        assert!(
            page.contains(reason) && !page.contains("\nPROVED"),
            "{page}"
        );
    }
}

#[test]
fn what_did_not_run_or_was_not_compared_is_not_proved() {
    expect(
        Verdict::NotProved,
        &[
            ("2 of 3 kernels ran; missing: poses_mix", |proof| {
                proof.kernels.ran = 2;
                proof.kernels.missing.push("poses_mix".to_owned());
            }),
            ("0 of 0 kernels ran", |proof| {
                proof.kernels = KernelSection::default();
            }),
            ("no value of a kernel", |proof| proof.kernels.values = 0),
            ("no expression", |proof| proof.self_tests.clear()),
            ("control did not run", |proof| {
                proof.negative_control = NegativeControl::default();
            }),
            ("control found no difference", |proof| {
                proof.negative_control.differing = 0;
            }),
            ("4 of 5 recorded results", |proof| {
                proof.golden.cases_compared = 4;
            }),
            ("0 of 0 recorded results", |proof| {
                proof.golden = GoldenSection::default();
            }),
            ("no random set", |proof| proof.random.values = 0),
            ("no random crowd", |proof| proof.random.crowds = 0),
            ("7 scalars were compared, not 2^20", |proof| {
                proof.scalars.values = 7;
            }),
            ("on a renderer's device", |proof| proof.renderer = None),
            ("under the validation layer", |proof| {
                proof.validation = Some(ValidationSection::default());
            }),
            ("has 1 messages, the first: VUID", |proof| {
                let validation = proof.validation.as_mut().unwrap();
                validation.message_count = 1;
                validation.messages.push("VUID".to_owned());
            }),
            ("speed: it hangs", |proof| {
                proof.failures.push("speed: it hangs".to_owned());
            }),
        ],
    );
}

#[test]
fn a_bit_that_differs_anywhere_is_told_before_all_else() {
    expect(
        Verdict::BitsDiffer,
        &[
            ("self-test `sine`: 1 of 10", |proof| {
                proof.self_tests[0].differing = 1;
            }),
            ("kernel `arc`: 2 of 9", |proof| {
                proof.kernels.ran = 0;
                proof.kernels.differing.push(DifferingValues {
                    name: "arc".to_owned(),
                    values: 9,
                    differing: 2,
                });
            }),
            ("1 recorded results differ, the first: slerp", |proof| {
                proof.golden.differing.push("slerp".to_owned());
            }),
            ("2 of 1048576 scalars differ, the first at 9", |proof| {
                proof.scalars.values_differing = 2;
                proof.scalars.first_difference = Some(9);
            }),
            ("3 of 100 random values differ", |proof| {
                proof.random.values_differing = 3;
            }),
            ("renderer's device, buffer to buffer", |proof| {
                proof.renderer.as_mut().unwrap().checks[0].differing = 1;
            }),
            ("2 values differ under", |proof| {
                proof.validation.as_mut().unwrap().differing = 2;
            }),
        ],
    );
}

/// Drivers that show no difference where they are left free have not failed.
#[test]
fn the_control_may_see_nothing_on_other_devices() {
    let Some(mut proof) = whole() else { return };
    proof.negative_control.must_differ = false;
    proof.negative_control.differing = 0;
    proof.judge();
    assert_eq!(proof.verdict, Verdict::Proved, "{:?}", proof.reasons);
}

#[test]
fn a_file_is_written_whole_and_one_that_is_there_is_kept() {
    let Some(proof) = whole() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("proof.json");
    assert!(check_output(&path, false).is_ok());
    write(&proof, &path).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let value: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(value["verdict"], "proved");
    assert!(check_output(&path, false).is_err() && check_output(&path, true).is_ok());
    assert!(check_output(&folder.path().join("no/proof.json"), false).is_err());
}
