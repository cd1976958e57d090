//! The page of a lab, for people: at most [`MAX_LINES`] lines. The JSON has everything.

use tumble_verify::lab::{
    HalfConversion, KernelVariant, LabReport, LabRow, RunList, StoreCaching, Timed,
};

use crate::commands::prove::text::grouped;

/// The lines of a page.
const MAX_LINES: usize = 60;

/// Rejected variants that are listed.
const MAX_REJECTED: usize = 5;

pub(super) fn page(device: &str, seconds: f64, lab: &LabReport) -> String {
    let mut lines = vec![format!(
        "{device}: {} variants of kernels for cards compared with the CPU, {} words, {} variants differ",
        lab.variants_compared,
        grouped(lab.words_compared),
        lab.rejected.len()
    )];
    for rejected in lab.rejected.iter().take(MAX_REJECTED) {
        lines.push(format!(
            "  DIFFERS  {}, {}: {} of {} words",
            rejected.kernel,
            described(rejected.variant),
            grouped(rejected.differing),
            grouped(rejected.words)
        ));
    }
    if !lab.ceilings.is_empty() {
        let samples = grouped(u64::from(lab.samples));
        lines.push(format!("ceilings, rows of {}, {samples} samples", lab.row));
    }
    for ceiling in &lab.ceilings {
        let time = ceiling.time.best();
        let rate = ceiling.bytes.map_or_else(String::new, |bytes| {
            format!("  {:6.2} TB/s", bytes as f64 / time.max(1e-9) / 1e6)
        });
        lines.push(format!(
            "  {:42} {}{rate}",
            ceiling.name,
            times(ceiling.time)
        ));
    }
    // List every kernel for typical runs. List other runs only if a variant is faster than the engine's.
    let is_typical = |row: &&LabRow| row.run == 48 && !row.has_keys;
    let is_changed = |row: &&LabRow| row.winner.variant != row.today.variant;
    let rows = lab.rows.iter();
    let shown = rows.clone().filter(is_typical);
    let others = rows
        .clone()
        .filter(|row| !is_typical(row) && is_changed(row));
    let decided: Vec<String> = (lab.decisions.iter())
        .map(|decision| {
            let applies = if decision.applies { "yes" } else { "no" };
            format!("  {applies:3}  {}: {}", decision.rule, decision.result)
        })
        .collect();
    let room = MAX_LINES.saturating_sub(lines.len() + decided.len() + 3);
    if !lab.rows.is_empty() {
        lines.push(
            "kernels: samples of a run, today's time, the best variant's, its share of filling"
                .to_owned(),
        );
    }
    lines.extend(shown.chain(others).take(room).map(kernel));
    let kept = rows.filter(|row| !is_changed(row)).count();
    if !lab.rows.is_empty() {
        let all = lab.rows.len();
        lines.push(format!(
            "  today's variant is the best in {kept} of {all} kernels and runs"
        ));
    }
    lines.extend(decided);
    let end = match lab.is_complete {
        true => "",
        false => "; the time was over before all was measured (--time-limit)",
    };
    lines.push(format!("{seconds:.0} s{end}"));
    lines.join("\n") + "\n"
}

fn times(time: Timed) -> String {
    let [shorter, longer] = time.microseconds;
    format!("{shorter:8.2} to {longer:8.2} µs")
}

fn kernel(row: &LabRow) -> String {
    let keys = if row.has_keys { " with keys" } else { "" };
    let order = if row.by_frames { " by frames" } else { "" };
    let winner = match row.winner.variant == row.today.variant {
        true => "today's".to_owned(),
        false => format!(
            "{:.2} µs: {}",
            row.winner.time.best(),
            described(row.winner.variant)
        ),
    };
    format!(
        "  {:38} {:3}{keys}{order}  {:8.2} µs  {winner}, {:.2}",
        row.kernel,
        row.run,
        row.today.time.best(),
        row.share_of_filling
    )
}

fn described(variant: KernelVariant) -> String {
    let KernelVariant {
        lanes,
        workgroup,
        stores,
        halves,
        list,
    } = variant;
    let stores = match stores {
        StoreCaching::Streamed => "",
        StoreCaching::Cached => ", stores cached",
    };
    let halves = match halves {
        None | Some(HalfConversion::Device) => "",
        Some(HalfConversion::Integers) => ", halves by integers",
    };
    let list = match list {
        RunList::EachTrack => "",
        RunList::Shared => ", one list for all tracks",
        RunList::Tracks => ", of neighbouring tracks",
    };
    format!("{lanes} lanes, workgroups of {workgroup}{stores}{halves}{list}")
}

#[cfg(test)]
mod tests {
    use tumble_verify::lab::{Ceiling, RejectedVariant, VariantTime};

    use super::*;

    /// A report of everything, with another winner in every row and many rejected variants, has a page of 60 lines.
    #[test]
    fn a_page_has_at_most_sixty_lines() {
        let time = Timed {
            microseconds: [20.0, 21.5],
        };
        let today = KernelVariant {
            lanes: 8,
            workgroup: 128,
            stores: StoreCaching::Streamed,
            halves: None,
            list: RunList::EachTrack,
        };
        let other = KernelVariant {
            lanes: 16,
            stores: StoreCaching::Cached,
            halves: Some(HalfConversion::Integers),
            ..today
        };
        let row = |run| LabRow {
            kernel: "arc_frames_spread_f32",
            run,
            has_keys: false,
            by_frames: true,
            bytes: 79_000_000,
            today: VariantTime {
                variant: today,
                time,
            },
            winner: VariantTime {
                variant: other,
                time,
            },
            share_of_filling: 0.9,
            finalists: Vec::new(),
        };
        let rejected = RejectedVariant {
            kernel: "arc_frames_spread_f32",
            variant: other,
            words: 1000,
            differing: 3,
        };
        let ceiling = Ceiling {
            name: "fill",
            time,
            bytes: Some(79_000_000),
        };
        let mut report = LabReport {
            variants_compared: 432,
            words_compared: 1_234_567,
            rejected: vec![rejected; 9],
            samples: 4_915_200,
            row: 32,
            ceilings: vec![ceiling; 14],
            rows: [48, 16]
                .into_iter()
                .flat_map(|run| vec![row(run); 56])
                .collect(),
            decisions: Vec::new(),
            run_lanes: None,
            is_complete: false,
        };
        let text = page("a card", 12.0, &report);
        assert_eq!(text.lines().count(), MAX_LINES, "{text}");
        assert!(text.contains(
            "DIFFERS  arc_frames_spread_f32, 16 lanes, workgroups of 128, stores cached, halves"
        ));
        assert!(
            text.contains("  fill  ") && text.contains("3.95 TB/s"),
            "{text}"
        );
        assert!(text.ends_with("12 s; the time was over before all was measured (--time-limit)\n"));
        assert!(text.contains(" 48 by frames  "), "{text}");
        (report.rows, report.ceilings, report.rejected) = Default::default();
        assert_eq!(page("a card", 1.0, &report).lines().count(), 2);
    }
}
