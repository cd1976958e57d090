//! `tumble prove --compare`: two proofs, of two devices or two builds. Comparisons that both made must have the
//! same bits; figures stand side by side.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::Value;

use crate::commands::prove::report::{FORMAT, FORMAT_VERSION, read_report};
use crate::messages::exit::{DIFFERENCE, Failure};
use crate::messages::listing;

/// The result of comparing two proofs, as printed and as JSON.
#[derive(Debug, Serialize)]
pub(crate) struct ProofComparison {
    /// Whether both prove their device.
    pub(crate) both_proved: bool,
    /// Whether both evaluated by the same kernels, and compared with the same recorded results.
    pub(crate) same_kernels: bool,
    pub(crate) same_golden_table: bool,
    /// Rounds of random sets that both evaluated from the same seed; `None` if seeds differ.
    pub(crate) rounds_in_common: Option<u64>,
    /// Whether the CPUs of both computed the same bits for these rounds.
    pub(crate) same_random_bits: Option<bool>,
    pub(crate) figures: Vec<FigurePair>,
}

/// A figure of both.
#[derive(Debug, Serialize)]
pub(crate) struct FigurePair {
    pub(crate) name: String,
    pub(crate) unit: &'static str,
    pub(crate) values: [f64; 2],
    /// The second divided by the first.
    pub(crate) ratio: f64,
}

/// A proof that was read.
struct SavedProof {
    name: String,
    value: Value,
}

impl SavedProof {
    fn new(path: &Path) -> Result<Self, Failure> {
        let name = path.display().to_string();
        let value = read_report(path, [FORMAT, "a proof", "tumble prove"], FORMAT_VERSION)?;
        Ok(Self { name, value })
    }

    fn text(&self, pointer: &str) -> &str {
        let found = self.value.pointer(pointer).and_then(Value::as_str);
        found.unwrap_or("unknown")
    }

    fn number(&self, pointer: &str) -> Option<f64> {
        self.value.pointer(pointer).and_then(Value::as_f64)
    }

    /// The hash of the first rounds, for each number of rounds that has one.
    fn digests(&self) -> impl Iterator<Item = (u64, &str)> {
        let all = self.value.pointer("/random/digests");
        let all = all.and_then(Value::as_array).into_iter().flatten();
        all.filter_map(|digest| Some((digest["rounds"].as_u64()?, digest["hash"].as_str()?)))
    }

    /// Rates and the cases by their names.
    fn figures(&self) -> Vec<(String, &'static str, f64)> {
        let mut all = Vec::new();
        for (name, unit, pointer) in [
            ("filling", "B/s", "/figures/fill_rate"),
            ("copying", "B/s", "/figures/device_copy_rate"),
            ("bus up", "B/s", "/figures/upload_rate"),
            ("bus down", "B/s", "/figures/download_rate"),
            ("submit and fence", "s", "/figures/submit_and_fence"),
            (
                "kernels compiled",
                "ms",
                "/compile_times/milliseconds_total",
            ),
        ] {
            all.extend((self.number(pointer)).map(|value| (name.to_owned(), unit, value)));
        }
        let cases = self
            .value
            .pointer("/figures/cases")
            .and_then(Value::as_array);
        for case in cases.into_iter().flatten() {
            let name =
                [&case["case"], &case["name"]].map(|field| field.as_str().unwrap_or_default());
            let seconds = case["seconds"].as_f64();
            all.extend(seconds.map(|seconds| (name.join(" "), "s", seconds)));
        }
        all
    }
}

fn compared(one: &SavedProof, two: &SavedProof) -> ProofComparison {
    let same = |pointer| one.text(pointer) == two.text(pointer);
    let seed = |proof: &SavedProof| proof.value.pointer("/random/seed").and_then(Value::as_u64);
    let in_common = (seed(one).is_some() && seed(one) == seed(two))
        .then(|| {
            let pairs = (one.digests()).filter_map(|(rounds, hash)| {
                let (_, other) = two.digests().find(|(number, _)| *number == rounds)?;
                Some((rounds, hash == other))
            });
            pairs.max_by_key(|(rounds, _)| *rounds)
        })
        .flatten();
    let others = two.figures();
    let figures = one.figures().into_iter().filter_map(|(name, unit, value)| {
        let (_, _, other) = others
            .iter()
            .find(|(other_name, _, _)| *other_name == name)?;
        Some(FigurePair {
            ratio: if value > 0.0 { other / value } else { 0.0 },
            values: [value, *other],
            name,
            unit,
        })
    });
    ProofComparison {
        both_proved: [one, two]
            .iter()
            .all(|proof| proof.text("/verdict") == "proved"),
        same_kernels: same("/program/kernels"),
        same_golden_table: same("/program/golden_table"),
        rounds_in_common: in_common.map(|(rounds, _)| rounds),
        same_random_bits: in_common.map(|(_, same)| same),
        figures: figures.collect(),
    }
}

fn page(one: &SavedProof, two: &SavedProof, found: &ProofComparison) -> String {
    let mut text = String::new();
    for proof in [one, two] {
        let _ = writeln!(
            text,
            "{}: {}, {}; tumble {}, commit {}; {}",
            proof.name,
            proof.text("/device/name"),
            proof.text("/device/driver"),
            proof.text("/program/version"),
            proof.text("/program/commit"),
            proof.text("/verdict").replace('_', " ")
        );
    }
    let same = |is_same| if is_same { "the same" } else { "DIFFERENT" };
    let _ = writeln!(text, "\nkernels            {}", same(found.same_kernels));
    let _ = writeln!(text, "recorded results   {}", same(found.same_golden_table));
    let _ = match (found.rounds_in_common, found.same_random_bits) {
        (Some(rounds), Some(is_same)) => {
            writeln!(
                text,
                "random             {} bits in the {rounds} rounds of both",
                same(is_same)
            )
        }
        _ => writeln!(
            text,
            "random             not comparable: other seeds, or no round"
        ),
    };
    let width = (found.figures.iter())
        .map(|pair| pair.name.chars().count())
        .max()
        .unwrap_or(0);
    text.push('\n');
    for FigurePair {
        name,
        unit,
        values: [one, two],
        ratio,
    } in &found.figures
    {
        let _ = writeln!(
            text,
            "{name:width$}  {one:>10.3e} {two:>10.3e} {unit:3}  × {ratio:.2}"
        );
    }
    text
}

pub(crate) fn run([one, two]: [&PathBuf; 2], json: bool) -> Result<(), Failure> {
    let (one, two) = (SavedProof::new(one)?, SavedProof::new(two)?);
    let found = compared(&one, &two);
    if json {
        listing::json(&found)?;
    } else {
        listing::text(&page(&one, &two, &found))?;
    }
    let mut reasons = Vec::new();
    if found.same_random_bits == Some(false) {
        reasons.push("for the same random sets, the CPUs of both reports gave different bits");
    }
    if !found.same_golden_table {
        reasons.push("they compared with other recorded results");
    }
    if !found.both_proved {
        reasons.push("not both of them prove their device");
    }
    match reasons.is_empty() {
        true => Ok(()),
        false => Err(Failure::new(DIFFERENCE, reasons.join("; "))),
    }
}
