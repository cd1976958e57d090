//! The text of a proof for people: which claims were proved and which were not.

use std::fmt::Write;

use crate::commands::prove::report::{Proof, Verdict};
use crate::messages::words;

/// `1 234 567`.
pub(crate) fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

fn rate(bytes_per_second: f64) -> String {
    format!("{}/s", words::bytes(bytes_per_second))
}

fn time(seconds: f64) -> String {
    words::duration(std::time::Duration::from_secs_f64(seconds.clamp(0.0, 1e9)))
}

/// The page.
pub(crate) fn page(proof: &Proof) -> String {
    let mut text = String::new();
    who(proof, &mut text);
    bits(proof, &mut text);
    speed(proof, &mut text);
    verdict(proof, &mut text);
    text
}

fn who(proof: &Proof, text: &mut String) {
    let (program, device, host) = (&proof.program, &proof.device, &proof.host);
    let short = |hash: &str| hash.chars().take(16).collect::<String>();
    let _ = writeln!(
        text,
        "tumble {}, commit {}, kernels {}; {}",
        program.version,
        program.commit,
        short(&program.kernels),
        proof.date
    );
    let _ = writeln!(
        text,
        "on {}, {}, {} threads, {}",
        host.system, host.processor, host.threads, host.vector_width
    );
    let info = &device.info;
    let _ = writeln!(text, "\n{}", info.name);
    let _ = writeln!(text, "  driver     {}", info.driver);
    let _ = writeln!(text, "  uuid       {}", info.uuid);
    if let Some(details) = &device.details {
        let _ = writeln!(
            text,
            "  Vulkan     {} on a loader of {}",
            info.api_version, details.loader
        );
        let heaps = details.heaps.iter().map(|heap| {
            let whose = if heap.is_device_local {
                "the device's"
            } else {
                "the host's"
            };
            format!("{} {whose}", words::bytes(heap.bytes as f64))
        });
        let _ = writeln!(
            text,
            "  memory     {}",
            heaps.collect::<Vec<_>>().join(", ")
        );
        let families = details.queue_families.iter().map(|family| {
            let abilities = family.abilities.join("+");
            format!("{} × {abilities}", family.queues)
        });
        let _ = writeln!(
            text,
            "  queues     {}",
            families.collect::<Vec<_>>().join(", ")
        );
    }
    if let Some(choices) = &device.choices {
        let arcs = match choices.arcs_prepared_from {
            Some(0) => "there".to_owned(),
            Some(keys) => format!("there from {keys} keys on"),
            None => "by the host".to_owned(),
        };
        let _ = writeln!(
            text,
            "  chosen     neighbours take {}, kernels read {}, results {}, copied by {}, uploads {}, \
             arcs prepared {arcs}",
            choices.mapping, choices.reads, choices.transfer, choices.read_back, choices.uploads
        );
    }
    if let Some(bus) = &device.bus {
        let known = |value: &Option<String>| value.clone().unwrap_or_else(|| "unknown".to_owned());
        let _ = writeln!(
            text,
            "  bus        {} × {} of at most {} × {}",
            known(&bus.link_width),
            known(&bus.link_speed),
            known(&bus.largest_link_width),
            known(&bus.largest_link_speed)
        );
    }
    let [first, second] = device.opened_in;
    let _ = writeln!(
        text,
        "  opened in  {first:.0} ms, then {second:.0} ms, self-test included"
    );
}

fn bits(proof: &Proof, text: &mut String) {
    let values: u64 = proof.self_tests.iter().map(|test| test.total as u64).sum();
    let differing: u64 = (proof.self_tests.iter().map(|test| test.differing as u64)).sum();
    let _ = writeln!(
        text,
        "\nbits\n  self-tests        {} of them, {} values, {differing} differ",
        proof.self_tests.len(),
        grouped(values)
    );
    let kernels = &proof.kernels;
    let _ = writeln!(
        text,
        "  kernels           {} of {} ran beside their twins, {} values, {} kernels differ",
        kernels.ran,
        kernels.count,
        grouped(kernels.values),
        kernels.differing.len()
    );
    for replaced in &kernels.replaced {
        let _ = writeln!(
            text,
            "                    {} differs in {} of {} values: other kernels are used instead",
            replaced.name, replaced.differing, replaced.values
        );
    }
    let control = &proof.negative_control;
    let _ = match (control.has_run, control.differing) {
        (false, _) => writeln!(text, "  negative control  did not run"),
        (true, 0) => writeln!(
            text,
            "  negative control  no difference without the exactness pass: this driver does not show one"
        ),
        (true, differing) => writeln!(
            text,
            "  negative control  without the exactness pass {} of {} values differ, as they should",
            grouped(differing),
            grouped(control.values)
        ),
    };
    let golden = &proof.golden;
    let compared: usize = golden.by_setting.iter().map(|setting| setting.cases).sum();
    let _ = writeln!(
        text,
        "  recorded results  {} of {} compared, {compared} times in {} of {} settings, {}, {} differ",
        golden.cases_compared,
        golden.cases,
        golden.by_setting.len(),
        golden.settings,
        words::bytes(golden.bytes as f64),
        golden.differing.len()
    );
    let random = &proof.random;
    let _ = writeln!(
        text,
        "  random            {} rounds of seed {}, {} of them crowds: {} values, {} differ",
        random.rounds,
        random.seed,
        random.crowds,
        grouped(random.values),
        random.values_differing
    );
    let scalars = &proof.scalars;
    let _ = writeln!(
        text,
        "  scalars           {} values by every method, {} differ",
        grouped(scalars.values),
        scalars.values_differing
    );
    match &proof.renderer {
        None => text.push_str("  renderer          did not run\n"),
        Some(renderer) => {
            let values: u64 = renderer.checks.iter().map(|check| check.values).sum();
            let differing: u64 = renderer.checks.iter().map(|check| check.differing).sum();
            let _ = writeln!(
                text,
                "  renderer          {} values on a device as an application makes it, {differing} \
                 differ; {} frames in flight, {}, {}",
                grouped(values),
                renderer.frames_in_flight,
                match renderer.memory_is_hidden {
                    true => "memory that the host cannot see",
                    false => "no memory that the host cannot see",
                },
                match renderer.copy_queue_family {
                    Some(family) => format!("copied on queue family {family}"),
                    None => "no transfer queue".to_owned(),
                }
            );
        }
    }
    match &proof.validation {
        None => text.push_str("  validation        not asked for (--validate)\n"),
        Some(validation) if !validation.has_run => {
            text.push_str("  validation        did not run\n");
        }
        Some(validation) => {
            let _ = writeln!(
                text,
                "  validation        {} recorded results, {} random rounds, {} values of a renderer: \
                 {} messages",
                validation.golden_cases,
                validation.random_rounds,
                grouped(validation.renderer_values),
                validation.message_count
            );
        }
    }
}

fn speed(proof: &Proof, text: &mut String) {
    let compile = &proof.compile_times;
    if !compile.kernels.is_empty() {
        let slowest = (compile.kernels.iter())
            .max_by(|a, b| a.milliseconds.total_cmp(&b.milliseconds))
            .map(|kernel| format!("{} {:.1} ms", kernel.kernel, kernel.milliseconds))
            .unwrap_or_default();
        let _ = writeln!(
            text,
            "\nkernels compiled without a cache: {} in {:.0} ms{}, the slowest {slowest}",
            compile.kernels.len(),
            compile.milliseconds_total,
            if compile.is_complete {
                ""
            } else {
                " (not all of them: the time was over)"
            }
        );
    }
    let Some(figures) = &proof.figures else {
        text.push_str("\nspeed was not measured\n");
        return;
    };
    let _ = writeln!(text, "\nspeed, by the {}'s clock", figures.clock);
    let _ = writeln!(
        text,
        "  memory of the device: filled at {}, copied at {}",
        rate(figures.fill_rate),
        rate(figures.device_copy_rate)
    );
    let _ = writeln!(
        text,
        "  bus: up {}, down {}; from an empty submission to its fence {}",
        rate(figures.upload_rate),
        rate(figures.download_rate),
        time(figures.submit_and_fence)
    );
    let width = (figures.cases.iter())
        .map(|case| case.name.chars().count())
        .max()
        .unwrap_or(0);
    for case in &figures.cases {
        let _ = writeln!(
            text,
            "  {:9}  {:width$}  first {:>8}  then {:>8}  {:>10}  {:>4.0} % of {}{}",
            case.case,
            case.name,
            time(case.first_call),
            time(case.seconds),
            rate(case.rate),
            100.0 * case.share,
            match case.limit {
                "download" => "the bus",
                _ => "filling",
            },
            case.row_seconds.map_or_else(String::new, |seconds| format!(
                ", in a row {}",
                time(seconds)
            )) + &case
                .record_seconds
                .map_or_else(String::new, |seconds| format!(
                    ", recorded in {}",
                    time(seconds)
                ))
        );
    }
}

fn verdict(proof: &Proof, text: &mut String) {
    let (seconds, allowed) = (proof.seconds, proof.seconds_allowed);
    let _ = writeln!(text, "\n{seconds:.0} s of {allowed} s");
    let checks = proof.renderer.iter().flat_map(|renderer| &renderer.checks);
    let on_renderer: u64 = checks.map(|check| check.values).sum();
    let values = proof.random.values + proof.scalars.values + proof.kernels.values + on_renderer;
    let _ = match proof.verdict {
        Verdict::Proved => writeln!(
            text,
            "PROVED: this device gives the CPU's bits in all {} values that were compared, and in all \
             recorded results",
            grouped(values)
        ),
        Verdict::BitsDiffer => writeln!(text, "BITS DIFFER:"),
        Verdict::NotProved => writeln!(
            text,
            "NOT PROVED: no bit differs of what was compared, but:"
        ),
    };
    for reason in &proof.reasons {
        let _ = writeln!(text, "  {reason}");
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn digits_are_grouped_by_three() {
        for (number, text) in [
            (0, "0"),
            (999, "999"),
            (1000, "1 000"),
            (1_234_567, "1 234 567"),
        ] {
            assert_eq!(super::grouped(number), text);
        }
    }
}
