//! The text that `tumble compare` prints of differences.

use tumble_formats::compare::{
    AlignmentSummary, ArrayDifference, ChannelDifference, ClipDifference, PathDifference,
    PathStatistics, ScalarDifference, Spread,
};
use tumble_formats::motion::ScalarKind;
use tumble_formats::printable::printable;

use crate::commands::compare::table::{TableArguments, joints_text};
use crate::messages::words;

/// Lines that say how far two clips are apart, with a table of the joints that are furthest apart.
pub(super) fn of_clips(difference: &ClipDifference, table: TableArguments) -> String {
    let compared = match difference.rotation {
        Some(_) => words::count(difference.tracks, "track"),
        None => words::count(difference.scalar_count, "scalar"),
    };
    let mut text = format!(
        "{} and {}: {compared} × {} from {} to {} s\n",
        printable(&difference.inputs[0]),
        printable(&difference.inputs[1]),
        words::count(difference.samples, "sample"),
        words::seconds(difference.span[0]),
        words::seconds(difference.span[1])
    );
    let mut line = |label: &str, unit: &str, found: &ChannelDifference| {
        let position = match found.spread.largest > 0.0 {
            true => {
                let frame = found.frame.map(|frame| format!(" (frame {frame})"));
                let time = words::seconds(found.time);
                let frame = frame.unwrap_or_default();
                format!(" at {}, {time} s{frame}", printable(&found.track))
            }
            false => String::new(),
        };
        text += &format!("  {label:<12} {}{position}\n", spread(&found.spread, unit));
    };
    for (label, unit, found) in [
        ("rotation", "°", &difference.rotation),
        ("translation", "", &difference.translation),
        ("scale", "", &difference.scale),
    ] {
        if let Some(found) = found {
            line(label, unit, found);
        }
    }
    for ScalarDifference {
        kind, difference, ..
    } in &difference.scalars
    {
        let unit = if *kind == ScalarKind::Angle.name() {
            "°"
        } else {
            ""
        };
        line(&format!("scalar {kind}"), unit, difference);
    }
    if difference.tracks > 0 {
        let all = difference.tracks * difference.samples;
        text += &format!(
            "  {} of {} {} the same, bit for bit\n",
            difference.identical,
            words::count(all, "rotation"),
            if all == 1 { "is" } else { "are" }
        );
    }
    let lone = difference.missing.iter().zip(&difference.missing_scalars);
    for (side, (tracks, scalars)) in lone.enumerate() {
        let missing: Vec<&str> = tracks.iter().chain(scalars).map(String::as_str).collect();
        if !missing.is_empty() {
            text += &format!(
                "  only in {}: {}\n",
                printable(&difference.inputs[side]),
                printable(&missing.join(", "))
            );
        }
    }
    text + &joints_text(difference, table)
}

/// `mean 0.0166°, rms 0.08211°, largest 17.04°`.
fn spread(Spread { mean, rms, largest }: &Spread, unit: &str) -> String {
    let [mean, rms, largest] = [mean, rms, largest].map(|number| words::decimals(*number));
    format!("mean {mean}{unit}, rms {rms}{unit}, largest {largest}{unit}")
}

/// `2 numbers are NaN or infinite in only one`.
pub(super) fn not_finite(count: usize) -> String {
    let are = if count == 1 { "is" } else { "are" };
    let numbers = words::count(count, "number");
    format!("{numbers} {are} NaN or infinite in only one")
}

/// Lines that say how far two arrays are apart.
pub(super) fn of_arrays(found: &ArrayDifference) -> String {
    let mut text = format!(
        "array of shape {:?}: {} of {} numbers differ\n  difference   {} at {:?}\n",
        found.shape,
        found.differing,
        found.numbers,
        spread(&found.difference, ""),
        found.largest_at
    );
    if found.not_finite > 0 {
        text += &format!(
            "  {}, not in the difference\n",
            not_finite(found.not_finite)
        );
    }
    if let (Some(angles), Some(at)) = (&found.rotation, &found.largest_rotation_at) {
        text += &format!("  angle        {} at {at:?}\n", spread(angles, "°"));
    }
    text
}

/// Lines that say how far two paths are apart.
pub(super) fn of_paths(found: &PathDifference) -> String {
    let [first, second] = found.inputs.each_ref().map(|name| printable(name));
    let mut text = format!(
        "{first} and {second}: {} of the {} from {} to {} s",
        words::count(found.poses, "pose"),
        ["first", "second"][found.times_of],
        words::seconds(found.span[0]),
        words::seconds(found.span[1])
    );
    for (count, why) in [
        (found.outside, "without one of the other"),
        (found.in_gaps, "in its gaps"),
    ] {
        if count > 0 {
            text += &format!(", {count} {why}");
        }
    }
    let AlignmentSummary {
        by,
        scale,
        degrees,
        translation: [x, y, z],
        ..
    } = &found.alignment;
    if *by != "none" {
        text += &format!(
            "\n  aligned      by {by}: scale {scale:.6}, turned {degrees:.4}°, moved {x:.6} {y:.6} {z:.6}"
        );
    }
    for (label, found) in [("absolute", &found.ape), ("relative", &found.rpe)] {
        let Some(found) = found else { continue };
        for (of, unit, numbers) in [
            ("translation", "", &found.translation),
            ("rotation", "°", &found.rotation),
        ] {
            let PathStatistics {
                rmse,
                mean,
                median,
                std,
                min,
                max,
                ..
            } = numbers;
            text += &format!(
                "\n  {label:<8} {of:<11} rmse {rmse:.6}{unit}, mean {mean:.6}{unit}, median {median:.6}{unit}, \
                     std {std:.6}{unit}, min {min:.6}{unit}, max {max:.6}{unit} ({})",
                found.count
            );
        }
    }
    text.push('\n');
    text
}
