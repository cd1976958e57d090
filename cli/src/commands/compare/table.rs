//! The joints of two motions, worst first: as text and as CSV.

use std::io;

use clap::{Args, ValueEnum};
use tumble_formats::compare::{
    ClipDifference, JointDifference, ScalarDifference, Spread, TimedSpread,
};
use tumble_formats::printable::printable;

use crate::messages::words;

/// How many joints the text lists if `--top` does not say.
const LISTED: usize = 10;

/// Which joints are listed, and in which order.
#[derive(Debug, Clone, Copy, Args)]
pub(super) struct TableArguments {
    /// How many joints to list, the worst first [default: 10; in CSV and JSON all]
    #[arg(long, value_name = "N")]
    top: Option<usize>,
    /// Which difference makes a joint the worst [default: angle]
    #[arg(long, value_enum, value_name = "DIFFERENCE")]
    worst_by: Option<Rank>,
}

/// The difference by which joints are ordered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
enum Rank {
    /// the largest angle; where it is the same, the largest distance
    #[default]
    Angle,
    /// the largest distance; where it is the same, the largest angle
    Distance,
}

impl TableArguments {
    /// An option of these that is set.
    pub(super) fn set_option(self) -> Option<&'static str> {
        let top = self.top.map(|_| "--top");
        top.or(self.worst_by.map(|_| "--worst-by"))
    }

    /// Whether an option chooses how joints are ranked.
    pub(super) fn ranks(self) -> bool {
        self.worst_by.is_some()
    }

    /// Whether an option limits how many are listed.
    pub(super) fn limits(self) -> bool {
        self.top.is_some()
    }

    /// The joints of a comparison, worst first, as many as `--top` says.
    pub(super) fn listed(self, joints: &[JointDifference]) -> Vec<JointDifference> {
        let mut joints = self.ordered(joints);
        joints.truncate(self.top.unwrap_or(joints.len()));
        joints
    }

    /// The scalars of a comparison, worst first, as many as `--top` says.
    pub(super) fn listed_scalars(self, scalars: &[ScalarDifference]) -> Vec<ScalarDifference> {
        let mut scalars = scalars.to_vec();
        let largest = |scalar: &ScalarDifference| scalar.difference.spread.largest;
        scalars.sort_by(|a, b| largest(b).total_cmp(&largest(a)));
        scalars.truncate(self.top.unwrap_or(scalars.len()));
        scalars
    }

    /// All joints of a comparison, worst first.
    fn ordered(self, joints: &[JointDifference]) -> Vec<JointDifference> {
        let key = |joint: &JointDifference| {
            let angle = joint.rotation.spread.largest;
            let distance = joint.translation.map_or(0.0, |it| it.spread.largest);
            match self.worst_by.unwrap_or_default() {
                Rank::Angle => [angle, distance],
                Rank::Distance => [distance, angle],
            }
        };
        let mut joints = joints.to_vec();
        joints.sort_by(|a, b| {
            let [a, b] = [key(a), key(b)];
            b[0].total_cmp(&a[0]).then(b[1].total_cmp(&a[1]))
        });
        joints
    }
}

/// A table of the joints that differ; nothing for a single track.
pub(super) fn joints_text(difference: &ClipDifference, arguments: TableArguments) -> String {
    let differs = |joint: &JointDifference| {
        let channels = [Some(joint.rotation), joint.translation, joint.scale];
        channels
            .into_iter()
            .flatten()
            .any(|it| it.spread.largest > 0.0)
    };
    let mut joints = arguments.ordered(&difference.joints);
    joints.retain(differs);
    let differing = joints.len();
    joints.truncate(arguments.top.unwrap_or(LISTED));
    if joints.is_empty() || difference.tracks == 1 {
        return String::new();
    }
    let has_distance = difference.translation.is_some();
    let mut rows = vec![row_of("joint", "angle", has_distance.then_some("distance"))];
    for joint in &joints {
        let mut row = vec![printable(&joint.track).into_owned()];
        row.extend(cells(&joint.rotation, "°"));
        if let Some(distance) = joint.translation.filter(|_| has_distance) {
            row.extend(cells(&distance, ""));
        }
        rows.push(row);
    }
    let table = aligned(&rows, 1);
    match differing - joints.len() {
        0 => table,
        rest => format!(
            "{table}  and {} (--top {differing})\n",
            words::count(rest, "more joint"),
        ),
    }
}

/// The lines of a table, each indented: texts in the first `texts` columns, numbers in the others.
pub(super) fn aligned(rows: &[Vec<String>], texts: usize) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        let cells = rows.iter().filter_map(|row| row.get(column));
        cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let line = |row: &Vec<String>| {
        let cells = row.iter().zip(&widths).enumerate();
        let cells = cells.map(|(column, (cell, &width))| match column < texts {
            true => format!("{cell:<width$}"),
            false => format!("{cell:>width$}"),
        });
        format!("  {}\n", cells.collect::<Vec<_>>().join("  "))
    };
    rows.iter().map(line).collect()
}

fn row_of(joint: &str, angle: &str, distance: Option<&str>) -> Vec<String> {
    let columns = |name: &str| {
        [
            format!("mean {name}"),
            "largest".to_owned(),
            "at".to_owned(),
        ]
    };
    let mut row = vec![joint.to_owned()];
    row.extend(columns(angle));
    row.extend(distance.map(columns).into_iter().flatten());
    row
}

/// The mean, the largest, and where it is: the frame, or the time where there are no frames.
fn cells(found: &TimedSpread, unit: &str) -> [String; 3] {
    let [mean, largest] = [found.spread.mean, found.spread.largest]
        .map(|it| format!("{}{unit}", words::decimals(it)));
    let at = match (found.spread.largest > 0.0, found.frame) {
        (false, _) => String::new(),
        (true, Some(frame)) => format!("frame {frame}"),
        (true, None) => format!("{} s", words::seconds(found.time)),
    };
    [mean, largest, at]
}

/// The joints of all pairs of clips as CSV, then their scalars: angles in degrees, times in seconds, frames of the first
/// clip. A scalar has its name in the column of joints, and its kind.
pub(super) fn csv_table(differences: &[ClipDifference]) -> io::Result<String> {
    /// Columns of a quantity.
    const NUMBERS: usize = 5;
    let mut writer = csv::Writer::from_writer(Vec::new());
    let columns = |name: &str| {
        ["mean", "rms", "largest", "time", "frame"].map(|column| format!("{name}_{column}"))
    };
    let mut header = ["first", "second", "joint"].map(str::to_owned).to_vec();
    header.extend(
        ["rotation", "translation", "scale"]
            .iter()
            .flat_map(|it| columns(it)),
    );
    header.push("scalar_kind".to_owned());
    header.extend(columns("scalar"));
    writer.write_record(&header)?;
    let numbers = |spread: &Spread, time: f64, frame: Option<f64>| {
        let of_spread = [spread.mean, spread.rms, spread.largest, time].map(Some);
        let all = of_spread.into_iter().chain([frame]);
        all.map(|number| number.map_or_else(String::new, |it| it.to_string()))
            .collect::<Vec<String>>()
    };
    let blank = |count: usize| std::iter::repeat_n(String::new(), count);
    for difference in differences {
        for joint in &difference.joints {
            let mut record: Vec<String> = difference.inputs.to_vec();
            record.push(joint.track.clone());
            for found in [Some(joint.rotation), joint.translation, joint.scale] {
                match found {
                    Some(found) => record.extend(numbers(&found.spread, found.time, found.frame)),
                    None => record.extend(blank(NUMBERS)),
                }
            }
            record.extend(blank(1 + NUMBERS));
            writer.write_record(&record)?;
        }
        for ScalarDifference {
            kind,
            difference: found,
            ..
        } in &difference.each_scalar
        {
            let mut record: Vec<String> = difference.inputs.to_vec();
            record.push(found.track.clone());
            record.extend(blank(3 * NUMBERS));
            record.push((*kind).to_owned());
            record.extend(numbers(&found.spread, found.time, found.frame));
            writer.write_record(&record)?;
        }
    }
    let bytes = writer
        .into_inner()
        .map_err(csv::IntoInnerError::into_error)?;
    String::from_utf8(bytes).map_err(io::Error::other)
}
