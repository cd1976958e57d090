//! The meaning of a file's arrays or columns, as a user specifies it for files that do not:
//! `rotations=keys:wxyz,time=t`.
//!
//! Entries are separated by commas. Each is `name=source`, followed by any of these:
//!
//! - the range of the source's last axis: `[3:7]` for indices 3 to 6, `[0]` for index 0;
//! - the form of a rotation: `:xyzw` or `:wxyz` for a quaternion, `:rotvec` for a rotation vector, `:matrix` for the
//!   rows of a matrix, or the axes of Euler angles, `:ZXY` (rotating axes) or `:zxy` (fixed axes); `:deg` makes
//!   rotation vectors and angles degrees;
//! - the first axis of the array: `:track` or `:frame`;
//! - `:scalar`, that the source has one number for each key, or several scalars: of which kind, `:angle` (`:deg` if in
//!   degrees), `:length`, `:contact` or, by default, `:plain`.
//!
//! A bracket after a blank belongs to the name of the source: `time=#timestamp [ns]`.

use std::ops::Range;
use std::str::FromStr;

use tumble::Layout;

use crate::motion::ScalarKind;
use crate::quaternion::ComponentOrder;
use crate::rotation_form::RotationForm;

/// The meaning of arrays or columns: an entry for each name.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Map {
    /// The entries in the order of the text; no name occurs twice.
    pub entries: Vec<Entry>,
}

/// One entry of a map, such as `name=source[3:7]:order`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// The meaning of the source: `rotations`, `time`, or the name of a track.
    pub name: String,
    /// The array or column in the file.
    pub source: String,
    /// The range of the source's last axis; `None` for all of it.
    pub columns: Option<Range<usize>>,
    /// The order of a quaternion's components, if it is specified.
    pub order: Option<ComponentOrder>,
    /// The form of a rotation, if it is specified and not a quaternion.
    pub form: Option<RotationForm>,
    /// Whether tracks or frames are the first axis, if it is specified.
    pub layout: Option<Layout>,
    /// The kind of scalar, if the source has scalars.
    pub scalar: Option<ScalarKind>,
    /// Whether the angles of scalars are in degrees.
    pub is_scalar_in_degrees: bool,
}

/// Why a text is not a map.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MapError {
    /// An entry lacks its name or its source.
    #[error("`{entry}` is not `name=source`; give entries such as `rotations=keys:wxyz`")]
    Entry {
        /// Text of the entry.
        entry: String,
    },
    /// The range of columns is invalid.
    #[error(
        "`{columns}` in `{entry}` is not a range of columns; give one such as `[3:7]` or `[0]`"
    )]
    Columns {
        /// Text of the entry.
        entry: String,
        /// Text of the range.
        columns: String,
    },
    /// A word after the source is neither a form of rotations nor a layout.
    #[error(
        "`{word}` in `{entry}` is neither a form of rotations (xyzw, wxyz, rotvec, matrix, axes such as ZXY, of \
         which rotvec and axes take deg) nor a layout (track, frame), nor scalar (scalar:angle, which takes deg, \
         scalar:length, scalar:contact)"
    )]
    Word {
        /// Text of the entry.
        entry: String,
        /// The word.
        word: String,
    },
    /// Two entries have the same name.
    #[error("`{name}` is given twice; give each name once")]
    Twice {
        /// The name.
        name: String,
    },
}

impl Map {
    /// The map of a source that contains rotations.
    pub(crate) fn of_rotations(source: &str) -> Self {
        let entry = Entry {
            name: "rotations".to_owned(),
            source: source.to_owned(),
            columns: None,
            order: None,
            form: None,
            layout: None,
            scalar: None,
            is_scalar_in_degrees: false,
        };
        Self {
            entries: vec![entry],
        }
    }

    /// The entry with this name.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.name == name)
    }
}

impl FromStr for Map {
    type Err = MapError;

    fn from_str(text: &str) -> Result<Self, MapError> {
        let mut map = Self::default();
        for entry in text.split(',') {
            let entry: Entry = entry.trim().parse()?;
            if map.get(&entry.name).is_some() {
                return Err(MapError::Twice { name: entry.name });
            }
            map.entries.push(entry);
        }
        Ok(map)
    }
}

impl FromStr for Entry {
    type Err = MapError;

    fn from_str(text: &str) -> Result<Self, MapError> {
        let entry = || text.to_owned();
        let wrong = || MapError::Entry { entry: entry() };
        let (name, rest) = text.split_once('=').ok_or_else(wrong)?;
        let is_name = |at: usize| rest.as_bytes()[at] == b'[' && rest[..at].ends_with(' ');
        let mut ends = rest.match_indices(['[', ':']).map(|(at, _)| at);
        let end = ends.find(|&at| !is_name(at)).unwrap_or(rest.len());
        let (source, rest) = rest.split_at(end);
        let (name, source) = (name.trim(), source.trim());
        if name.is_empty() || source.is_empty() {
            return Err(wrong());
        }
        let (bracketed, words) = match rest.find(']') {
            Some(end) if rest.starts_with('[') => rest.split_at(end + 1),
            _ => rest.split_at(if rest.starts_with('[') { rest.len() } else { 0 }),
        };
        let columns = (!bracketed.is_empty()).then(|| {
            columns(bracketed).ok_or_else(|| MapError::Columns {
                entry: entry(),
                columns: bracketed.to_owned(),
            })
        });
        let mut parsed = Self {
            name: name.to_owned(),
            source: source.to_owned(),
            columns: columns.transpose()?,
            order: None,
            form: None,
            layout: None,
            scalar: None,
            is_scalar_in_degrees: false,
        };
        let mut degrees = false;
        let mut words = words.split(':');
        // Text between the bracket and the first colon is a mistake.
        let glued = words.next().filter(|glued| !glued.is_empty());
        let unknown = |word: &str| MapError::Word {
            entry: entry(),
            word: word.to_owned(),
        };
        if let Some(glued) = glued {
            return Err(unknown(glued));
        }
        for word in words {
            let word = word.trim();
            if parsed.scalar == Some(ScalarKind::Plain)
                && let Ok(kind) = word.parse()
            {
                parsed.scalar = Some(kind);
                continue;
            }
            let has_form = parsed.order.is_some() || parsed.form.is_some();
            let is_free = !has_form && parsed.scalar.is_none();
            match (word, is_free, parsed.layout) {
                ("scalar", true, _) => parsed.scalar = Some(ScalarKind::Plain),
                ("xyzw", true, _) => parsed.order = Some(ComponentOrder::Xyzw),
                ("wxyz", true, _) => parsed.order = Some(ComponentOrder::Wxyz),
                ("rotvec", true, _) => parsed.form = Some(RotationForm::Vector { degrees }),
                ("matrix", true, _) => parsed.form = Some(RotationForm::Matrix),
                ("deg", _, _) if !degrees => degrees = true,
                ("track", _, None) => parsed.layout = Some(Layout::TrackMajor),
                ("frame", _, None) => parsed.layout = Some(Layout::FrameMajor),
                (axes, true, _) => {
                    let sequence = axes.parse().map_err(|_| unknown(word))?;
                    parsed.form = Some(RotationForm::Euler { sequence, degrees });
                }
                _ => return Err(unknown(word)),
            }
        }
        match &mut parsed.form {
            Some(
                RotationForm::Vector { degrees: unit } | RotationForm::Euler { degrees: unit, .. },
            ) => {
                *unit = degrees;
            }
            None if degrees && parsed.scalar == Some(ScalarKind::Angle) => {
                parsed.is_scalar_in_degrees = true;
            }
            _ if degrees => return Err(unknown("deg")),
            _ => {}
        }
        Ok(parsed)
    }
}

impl Entry {
    /// The names of the scalars that the source has: that of the entry, or, of several, `name_0`, `name_1` ….
    pub(crate) fn scalar_names(&self, count: usize) -> impl Iterator<Item = String> + '_ {
        (0..count).map(move |index| match count {
            1 => self.name.clone(),
            _ => format!("{}_{index}", self.name),
        })
    }

    /// The form of a rotation; a quaternion unless another form is specified.
    #[must_use]
    pub fn form(&self) -> RotationForm {
        let quaternion = || RotationForm::Quaternion(self.order.unwrap_or_default());
        self.form.unwrap_or_else(quaternion)
    }
}

/// Parses `[3:7]` or `[0]`.
fn columns(bracketed: &str) -> Option<Range<usize>> {
    let inner = bracketed.strip_prefix('[')?.strip_suffix(']')?;
    let number = |text: &str| text.trim().parse::<usize>().ok();
    let range = match inner.split_once(':') {
        Some((start, end)) => number(start)?..number(end)?,
        None => {
            let column = number(inner)?;
            column..column.checked_add(1)?
        }
    };
    (!range.is_empty()).then_some(range)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_say_source_columns_order_and_layout() {
        let map: Map =
            "rotations=keys:wxyz:frame, time = t ,hand=observation.state[3:7]:xyzw,z=a[0]"
                .parse()
                .unwrap();
        let names: Vec<&str> = map.entries.iter().map(|e| e.name.as_str()).collect();
        assert_eq!(names, ["rotations", "time", "hand", "z"]);
        let keys = map.get("rotations").unwrap();
        assert_eq!(keys.source, "keys");
        assert_eq!(keys.order, Some(ComponentOrder::Wxyz));
        assert_eq!(keys.layout, Some(Layout::FrameMajor));
        assert_eq!(map.get("time").unwrap().source, "t");
        let hand = map.get("hand").unwrap();
        assert_eq!(
            (hand.source.as_str(), &hand.columns),
            ("observation.state", &Some(3..7))
        );
        assert_eq!(hand.order, Some(ComponentOrder::Xyzw));
        assert_eq!(map.get("z").unwrap().columns, Some(0..1));
    }

    #[test]
    fn rotations_may_be_vectors_matrices_and_angles() {
        let map: Map = "a=v:rotvec,b=m:matrix:track,c=e[0:3]:ZXY:deg,d=e:zyx,rotations=q"
            .parse()
            .unwrap();
        let euler = |name: &str, degrees| RotationForm::Euler {
            sequence: name.parse().unwrap(),
            degrees,
        };
        let forms: Vec<_> = map.entries.iter().map(Entry::form).collect();
        let expected = [
            RotationForm::Vector { degrees: false },
            RotationForm::Matrix,
            euler("ZXY", true),
            euler("zyx", false),
            RotationForm::Quaternion(ComponentOrder::Xyzw),
        ];
        assert_eq!(forms, expected);
        for wrong in [
            "a=b:deg",
            "a=b:matrix:deg",
            "a=b:ZXY:xyzw",
            "a=b:rotvec:deg:deg",
            "a=b:XX",
        ] {
            let found = wrong.parse::<Map>().unwrap_err();
            assert!(matches!(found, MapError::Word { .. }), "{wrong}: {found}");
        }
    }

    #[test]
    fn brackets_behind_a_blank_belong_to_the_name() {
        let map: Map = "time=#timestamp [ns],w=q_RS_w []".parse().unwrap();
        assert_eq!(map.get("time").unwrap().source, "#timestamp [ns]");
        assert_eq!(map.get("w").unwrap().source, "q_RS_w []");
    }

    #[test]
    fn errors_name_the_piece() {
        let error = |text: &str| text.parse::<Map>().unwrap_err();
        for text in ["", "keys", "=keys", "rotations=", "a=b,", "a=:xyzw"] {
            assert!(matches!(error(text), MapError::Entry { .. }), "{text}");
        }
        for columns in [
            "[7:3]",
            "[3:3]",
            "[]",
            "[a]",
            "[3:7",
            "[-1]",
            "[99999999999999999999]",
        ] {
            let found = error(&format!("a=b{columns}"));
            let MapError::Columns { columns: piece, .. } = found else {
                panic!("{columns}: {found}");
            };
            assert_eq!(piece, columns);
        }
        for word in ["zyxw", "xyzw:wxyz", "track:frame", ""] {
            let found = error(&format!("a=b:{word}"));
            let last = word.rsplit(':').next().unwrap();
            assert!(
                matches!(&found, MapError::Word { word, .. } if word == last),
                "{found}"
            );
        }
        assert!(matches!(error("a=b[0]xyzw"), MapError::Word { .. }));
        let twice = MapError::Twice {
            name: "a".to_owned(),
        };
        assert_eq!(error("a=b,a=c"), twice);
    }
}
