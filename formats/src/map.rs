//! What a person says about a file's own names: `hand=observation.state[3:7]:xyzw,time=t`.
//!
//! Entries are separated by commas. Each gives what is meant its source in the file, perhaps a part
//! of it and the order of a quaternion's components.

use std::ops::Range;

use crate::npy::ComponentOrder;

/// One entry: what is meant, and where the file has it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mapping {
    /// What is meant: `time`, or the name of a track.
    pub target: String,
    /// What the file calls it.
    pub source: String,
    /// The part of it, counted from 0; the end is not in it.
    pub range: Option<Range<usize>>,
    /// The order of a quaternion's components.
    pub order: Option<ComponentOrder>,
}

/// Why a text is no list of mappings.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{entry}`: {reason}; an entry is name=source, name=source[3:7] or name=source[3:7]:xyzw")]
pub struct MapError {
    /// The entry that cannot be read.
    pub entry: String,
    /// What is wrong with it.
    pub reason: &'static str,
}

/// Reads a list of mappings. Brackets and colons that are no part and no order belong to the
/// source's name, as in `time=#timestamp [ns]`.
///
/// # Errors
/// When an entry has no name or no source, or its part or order cannot be.
pub fn parse(text: &str) -> Result<Vec<Mapping>, MapError> {
    text.split(',').map(entry).collect()
}

fn entry(text: &str) -> Result<Mapping, MapError> {
    let refuse = |reason| MapError {
        entry: text.trim().to_owned(),
        reason,
    };
    let Some((target, source)) = text.split_once('=') else {
        return Err(refuse("there is no `=`"));
    };
    let (source, order) = match source.rsplit_once(':') {
        Some((source, order)) if is_order(order.trim()) => {
            let order = match order.trim() {
                "xyzw" => ComponentOrder::Xyzw,
                "wxyz" => ComponentOrder::Wxyz,
                _ => return Err(refuse("the order is neither xyzw nor wxyz")),
            };
            (source, Some(order))
        }
        _ => (source, None),
    };
    let (source, range) = match part(source.trim()) {
        Some((source, start, end)) => {
            let number = |text: &str| text.trim().parse::<usize>().ok();
            let range = number(start).zip(number(end));
            let Some((start, end)) = range.filter(|(start, end)| start < end) else {
                return Err(refuse("the part is not two increasing whole numbers"));
            };
            (source, Some(start..end))
        }
        None => (source, None),
    };
    let (target, source) = (target.trim(), source.trim());
    if target.is_empty() || source.is_empty() {
        return Err(refuse("the name or the source is empty"));
    }
    Ok(Mapping {
        target: target.to_owned(),
        source: source.to_owned(),
        range,
        order,
    })
}

/// Four letters of a quaternion's components, in an order that may be wrong.
fn is_order(text: &str) -> bool {
    text.len() == 4 && text.bytes().all(|letter| b"wxyz".contains(&letter))
}

/// A source that ends in `[start:end]`, taken apart.
fn part(source: &str) -> Option<(&str, &str, &str)> {
    let (name, inside) = source.strip_suffix(']')?.rsplit_once('[')?;
    let (start, end) = inside.split_once(':')?;
    Some((name, start, end))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_have_names_parts_and_orders() {
        let found = parse("hand=observation.state[3:7]:wxyz, time = t").unwrap();
        let hand = Mapping {
            target: "hand".to_owned(),
            source: "observation.state".to_owned(),
            range: Some(3..7),
            order: Some(ComponentOrder::Wxyz),
        };
        let time = Mapping {
            target: "time".to_owned(),
            source: "t".to_owned(),
            range: None,
            order: None,
        };
        assert_eq!(found, [hand, time]);
    }

    #[test]
    fn brackets_and_colons_of_names_stay() {
        let found = parse("time=#timestamp [ns],w=q_RS_w [],x=robot:arm").unwrap();
        let sources: Vec<&str> = found.iter().map(|one| one.source.as_str()).collect();
        assert_eq!(sources, ["#timestamp [ns]", "q_RS_w []", "robot:arm"]);
        assert!(
            found
                .iter()
                .all(|one| one.range.is_none() && one.order.is_none())
        );
    }

    #[test]
    fn what_is_no_entry_is_refused_with_its_words() {
        for (text, reason) in [
            ("hand", "no `=`"),
            ("=a", "empty"),
            ("a= ", "empty"),
            ("", "no `=`"),
            ("a=b[7:3]", "increasing"),
            ("a=b[-1:3]", "increasing"),
            ("a=b[0:99999999999999999999]", "increasing"),
            ("a=b:zyxw", "xyzw"),
        ] {
            let error = parse(text).unwrap_err().to_string();
            assert!(error.contains(reason), "{text}: {error}");
        }
    }
}
