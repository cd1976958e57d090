//! What is wrong with an input, where, and what to do: every message that a file
//! can cause, each with a code that is documented here.

use std::fmt;

/// Whether an input is refused, or read with a reservation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Severity {
    /// The input is refused.
    Error,
    /// The input is read; something about it is probably not meant.
    Warning,
}

/// Where in an input a fault is.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Place {
    /// In text: both count from 1, columns in characters.
    Text {
        /// The line.
        line: u64,
        /// The column.
        column: u64,
    },
    /// In what has no lines: a JSON pointer such as `/animations/0`, the name of an archive's
    /// member, or a table's column and row.
    Inside(String),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Text { line, column } => write!(f, "{line}:{column}"),
            Self::Inside(place) => f.write_str(place),
        }
    }
}

/// One thing to say about an input.
///
/// Displayed as `FILE:PLACE: error[CODE]: what is wrong, the value, the fix`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// The input's name, as it was given.
    pub file: String,
    /// Where the fault is, unless it is the input as a whole.
    pub place: Option<Place>,
    /// Which fault.
    pub code: Code,
    /// What is wrong, in words.
    pub message: String,
    /// How often it occurs; the place is that of the first time.
    pub count: u64,
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:", self.file)?;
        if let Some(place) = &self.place {
            write!(f, "{place}:")?;
        }
        let severity = match self.code.severity() {
            Severity::Error => "error",
            Severity::Warning => "warning",
        };
        write!(f, " {severity}[{}]: {}", self.code, self.message)?;
        if self.count > 1 {
            write!(f, " ({} times; this is the first)", self.count)?;
        }
        Ok(())
    }
}

impl std::error::Error for Diagnostic {}

impl Diagnostic {
    /// A fault of an input as a whole.
    pub fn new(file: impl Into<String>, code: Code, message: impl Into<String>) -> Self {
        Self {
            file: file.into(),
            place: None,
            code,
            message: message.into(),
            count: 1,
        }
    }

    /// The same fault, inside the input: at a JSON pointer, a member, a column.
    #[must_use]
    pub fn inside(mut self, place: impl Into<String>) -> Self {
        self.place = Some(Place::Inside(place.into()));
        self
    }
}

macro_rules! codes {
    ($($variant:ident = $code:literal, $title:literal, $explanation:literal;)+) => {
        /// Every fault of an input. Codes starting with `W` are warnings.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[non_exhaustive]
        pub enum Code {
            $(#[doc = concat!($title, ". ", $explanation)] $variant,)+
        }

        impl Code {
            /// Every code, in order.
            pub const ALL: &[Self] = &[$(Self::$variant),+];

            /// The code, such as `E012`.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $code,)+ }
            }

            /// What it stands for, in a few words.
            pub fn title(self) -> &'static str {
                match self { $(Self::$variant => $title,)+ }
            }

            /// Why it is refused or warned of, and what to do.
            pub fn explanation(self) -> &'static str {
                match self { $(Self::$variant => $explanation,)+ }
            }
        }
    };
}

codes! {
    Open = "E001", "the input cannot be read", "The system refused to open or read it; its reason is given.";
    NotAFile = "E002", "not a file", "Directories, sockets and devices hold no keyframes. A named pipe is read only when that is asked for; `-` reads standard input.";
    Changed = "E003", "the file changed while it was read", "Its length or time of change differ between start and end of reading; read it again when its writer is done.";
    OtherFormat = "E004", "another format", "The first bytes are those of another format than `.dat`.";
    Encoding = "E005", "not plain text", "A `.dat` file is ASCII or UTF-8 text; UTF-16, NUL bytes and invalid UTF-8 are refused.";
    Character = "E006", "a character that does not belong", "Only printable ASCII, blanks and tabs make up numbers; no-break spaces, form feeds and bare carriage returns are refused because editors hide them.";
    LineTooLong = "E007", "a line is too long", "No real set has lines this long; the file is probably not keyframe data.";
    FileTooLong = "E008", "the file is too long", "The limit guards against endless inputs; raise it if the file is meant.";
    Empty = "E010", "an empty file", "There is not even a header.";
    NoHeader = "E011", "no header", "The first line is `# <boxes> <box length>`, such as `# 4 3.0`.";
    HeaderShort = "E012", "the header lacks a number", "The header has the number of boxes and the length of a box.";
    Boxes = "E013", "not a number of boxes", "The number of boxes is a whole number from 1 to 65536, in plain digits.";
    BoxLength = "E014", "not a box length", "The length of a box is a finite number.";
    NoKeys = "E015", "no keys", "A set has at least one key line behind its header.";
    SecondHeader = "E016", "a second header", "Two sets in one file? Split it: one header, then keys.";
    Columns = "E020", "the wrong number of columns", "A key line has a time and four numbers for each box: `time w x y z w x y z …`.";
    Number = "E021", "not a number", "Numbers are decimal, with a point, and may have an exponent: `-1.25e-3`.";
    NotFinite = "E022", "not finite", "NaN and infinity are no rotation and no time.";
    TooLarge = "E023", "too large for f32", "Keys are kept in f32, whose largest value is 3.4e38.";
    TokenTooLong = "E024", "a number is too long", "No number needs more than 64 characters.";
    Norm = "E025", "not a unit quaternion", "A rotation is a quaternion of norm 1. Norms within 0.1 of it are normalised; others are more likely a mistake, such as a missing column.";
    TimeNotIncreasing = "E026", "times do not increase", "Key times increase strictly from line to line.";
    KeyNorm = "E027", "no rotation", "A key's quaternion has a norm under 1e-6; no rotation can be told from it.";
    EqualTimes = "E028", "two keys at one time", "The values differ, so one of the keys has to go: --duplicates first or last says which.";
    Time = "E030", "not a list of times", "A list of times has finite numbers of seconds, separated by blanks, commas or line ends.";
    Unrecognised = "E031", "an unknown format", "Neither the first bytes nor the ending of the name tell a format that can be read; --format names it.";
    // E1xx and W1xx: glTF.
    // E2xx and W2xx: BVH.
    BvhStart = "E200", "no HIERARCHY", "A BVH file begins with the word HIERARCHY, then its joints, then MOTION.";
    BvhWord = "E201", "a word that has no place", "Joints are ROOT or JOINT and a name, then in braces an OFFSET, CHANNELS, and further JOINTs or an End Site.";
    BvhBraces = "E202", "braces that do not match", "Each joint and End Site has its own pair of braces.";
    BvhOffset = "E203", "no OFFSET", "Each joint says in three numbers where it is in its parent.";
    BvhChannel = "E204", "no channel of this name", "A joint has Xposition, Yposition, Zposition, Xrotation, Yrotation and Zrotation, each at most once.";
    BvhChannelCount = "E205", "the wrong number of channels", "CHANNELS gives the number of the names behind it, on the same line.";
    BvhMotion = "E206", "no MOTION", "The file ends within its hierarchy; it is probably cut.";
    BvhFrames = "E207", "not a number of frames", "The line behind MOTION is `Frames: ` and a whole number.";
    BvhFrameTime = "E208", "not a frame time", "The line behind Frames is `Frame Time: ` and the seconds of a frame, from 1e-9 to 1e9.";
    BvhRow = "E209", "the wrong number of numbers", "Each frame is a line with a number for each channel, in the order of the hierarchy.";
    BvhCut = "E210", "fewer rows than frames", "The file ends before its last frame; it is probably cut.";
    BvhSecond = "E211", "a second HIERARCHY", "Two files in one? Split it.";
    BvhWrite = "E212", "not to be written as BVH", "A BVH file holds one clip, whose samples are frames of one rate, with angles about three different axes.";
    // E3xx and W3xx: NPY and NPZ.
    // E4xx and W4xx: tables (Parquet, Arrow, CSV).
    TableDamaged = "E401", "a table that cannot be read", "The file is cut or damaged, or written in a way that is not read here; the reason is given. Rows count from 0.";
    TableClaims = "E402", "more than the file can hold", "The file announces more rows or bytes than could be packed into its length; nothing was read.";
    Compression = "E403", "a compression that is not read", "Parquet is read uncompressed and with snappy, zstd and LZ4, Arrow uncompressed and with zstd and LZ4.";
    NoRotations = "E404", "no rotations among the columns", "Rotations are the columns `x y z w` (a row for each key), `knee.x knee.y knee.z knee.w` (a row for each time), or a part of a list that --map names.";
    NoTimes = "E405", "no times among the columns", "Times are a column `time`, `timestamp` or `t`, or `frame_index` with --source-fps; --map time=NAME names another.";
    ColumnMissing = "E406", "a column is missing", "A name that --map gives, or the others of a group of columns such as `tx ty tz`.";
    ColumnTwice = "E407", "two columns of one name", "It cannot be told which of them is meant; rename one.";
    ColumnType = "E408", "a column of another type", "Rotations, translations and scales are numbers, names are text or whole numbers, times are numbers or timestamps.";
    Null = "E409", "a null", "A key without a value is no key; fill it in or remove its row. Rows count from 0.";
    WholeTimes = "E410", "times that are whole numbers", "They may be seconds or nanoseconds: --time-unit s, ms, us or ns says which.";
    ListLength = "E411", "a list of another length", "A rotation takes four numbers of a list, a translation or a scale three; --map NAME=LIST[3:7] says which.";
    NoRows = "E412", "a table without rows", "It has columns but no keys.";
    Map = "E413", "not a mapping", "`--map` takes name=source, name=source[3:7] or name=source[3:7]:wxyz, separated by commas.";
    SeveralClips = "E414", "several clips for one table", "A wide table holds one clip; write them to files of their own, or as Parquet.";
    // E5xx and W5xx: trajectories.
    TumPose = "E501", "not a pose", "A line has eight numbers: `t x y z qx qy qz qw`.";
    TumTime = "E502", "a time out of range", "Times are seconds, up to 1e14 before or after 0.";
    TumEmpty = "E503", "no poses", "All lines are blank or comments.";
    TumWrite = "E504", "not to be written as a trajectory", "A trajectory is one clip of one track.";
    ByteOrderMark = "W001", "a byte-order mark", "It is skipped; save the file without one.";
    MixedLineEnds = "W002", "mixed line ends", "Some lines end in CR LF, others in LF.";
    HeaderWords = "W003", "words after the header's numbers", "They are ignored.";
    BoxLengthSign = "W004", "a box length that is not positive", "Rotations do not need it; drawing the boxes does.";
    BlankLine = "W005", "a blank line between keys", "It is skipped; is something missing there?";
    MaybeCut = "W006", "the last number may be cut", "The file ends without a line end, and its last number has fewer digits than all others.";
    Tiny = "W007", "a number too small for f32", "It becomes 0.";
    NormOff = "W008", "a quaternion far from unit length", "It is normalised.";
    Order = "W009", "components may be in the order x y z w", "Every fourth column is near 1 and the first near 0, as when small rotations are written with w last. This format has w first.";
    Gap = "W010", "an unusual gap between times", "Under 1e-9 s or over 1e9 s: are the times seconds?";
    OneKey = "W011", "only one key", "The set stands still.";
    HalfTurn = "W012", "neighbouring keys 180° apart", "Both ways round are equally short; the signs as stored decide.";
    EqualKeys = "W013", "a key given twice", "Two keys at one time with equal values; the second is dropped.";
    BvhMoreRows = "W201", "more rows than frames", "The rows behind the last frame are left out.";
    BvhNoFrames = "W202", "no frames", "The skeleton rests.";
    Scales = "W203", "scales are left out", "The format has rotations and translations only.";
    StartMoved = "W204", "the start is moved to 0", "BVH has no start time: its first frame is at 0.";
}

impl Code {
    /// The code with that name, in any case.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL
            .iter()
            .copied()
            .find(|code| code.name().eq_ignore_ascii_case(name))
    }

    /// Whether it refuses the input.
    #[must_use]
    pub fn severity(self) -> Severity {
        if self.name().starts_with('W') {
            Severity::Warning
        } else {
            Severity::Error
        }
    }
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}
