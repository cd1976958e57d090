//! Data sets of robots by `LeRobot`: `data/chunk-000/….parquet`, and `meta/info.json` beside `data`, which names the numbers of
//! the lists in the columns `observation.state` and `action`.

use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde_json::{Map, Value};

use crate::limits::Limits;
use crate::source::Source;
use crate::table::plan::TablePlan;

/// Where the description of a data set is, from the folder of one of its tables.
pub(crate) const INFO: &str = "../../meta/info.json";

/// The metadata of a data set.
#[derive(Deserialize)]
pub(super) struct Info {
    /// Shows that the file is one of `LeRobot`, because it is required.
    #[serde(rename = "codebase_version")]
    _version: String,
    features: Map<String, Value>,
}

/// The description of the data set that a table belongs to, if there is one.
pub(crate) fn info_of(table: &Path) -> Option<PathBuf> {
    let info = table.parent()?.join(INFO);
    info.is_file().then_some(info)
}

impl Info {
    /// The description of the data set that a table belongs to; `None` for other tables.
    pub(super) fn beside(table: &Path, limits: Limits) -> Option<Self> {
        let bytes = Source::open(&info_of(table)?, false)
            .ok()?
            .into_bytes(limits.file)
            .ok()?;
        serde_json::from_slice(&bytes).ok()
    }

    /// Names the scalars of lists.
    pub(super) fn name(&self, plan: &mut TablePlan) {
        for scalars in &mut plan.scalars {
            if let Some(feature) = self
                .features
                .get(&scalars.name)
                .filter(|_| scalars.names.is_empty())
            {
                let mut names = Vec::new();
                collect(feature.get("names").unwrap_or(&Value::Null), &mut names);
                // The names are used only if there are as many as values. Those of images name axes, so their number
                // differs.
                if Some(names.len())
                    == feature
                        .pointer("/shape/0")
                        .and_then(Value::as_u64)
                        .map(|it| it as usize)
                {
                    let prefix = &scalars.name;
                    scalars.names = names
                        .iter()
                        .map(|name| format!("{prefix}.{name}"))
                        .collect();
                }
            }
        }
    }
}

/// The texts of a list, of a list in a list, or of the lists of an object.
fn collect(value: &Value, names: &mut Vec<String>) {
    match value {
        Value::String(name) => names.push(name.clone()),
        Value::Array(list) => list.iter().for_each(|value| collect(value, names)),
        Value::Object(lists) => lists.values().for_each(|value| collect(value, names)),
        _ => {}
    }
}
