//! What is wrong with an input, where, and what to do: every message that a file
//! can cause, each with a code that is documented here.

use std::fmt;

use crate::printable::printable;

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
pub enum Location {
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

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Text { line, column } => write!(f, "{line}:{column}"),
            Self::Inside(pointer) => f.write_str(pointer),
        }
    }
}

/// One thing to say about an input.
///
/// Displayed as `FILE:PLACE: error[CODE]: what is wrong, the value, the fix`, on one line, without what a
/// terminal would obey ([`printable`]).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// The input's name, as it was given.
    pub file: String,
    /// Where the fault is, unless it is the input as a whole.
    pub location: Option<Location>,
    /// Which fault.
    pub code: Code,
    /// What is wrong, in words.
    pub message: String,
    /// How often it occurs; the location is that of the first time.
    pub count: u64,
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:", printable(&self.file))?;
        if let Some(location) = &self.location {
            write!(f, "{}:", printable(&location.to_string()))?;
        }
        let severity = match self.code.severity() {
            Severity::Error => "error",
            Severity::Warning => "warning",
        };
        write!(
            f,
            " {severity}[{}]: {}",
            self.code,
            printable(&self.message)
        )?;
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
            location: None,
            code,
            message: message.into(),
            count: 1,
        }
    }

    /// The same fault, inside the input: at a JSON pointer, a member, a column.
    #[must_use]
    pub fn inside(mut self, pointer: impl Into<String>) -> Self {
        self.location = Some(Location::Inside(pointer.into()));
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
    NoKeys = "E015", "no keys", "A set has at least one key line after its header.";
    SecondHeader = "E016", "a second header", "Two sets in one file? Split it: one header, then keys.";
    Columns = "E020", "the wrong number of columns", "A key line has a time and four numbers for each box: `time w x y z w x y z …`.";
    Number = "E021", "not a number", "Numbers are decimal, with a point, and may have an exponent: `-1.25e-3`.";
    NotFinite = "E022", "not finite", "NaN and infinity are neither rotations nor times.";
    TooLarge = "E023", "too large for f32", "Keys are kept in f32, whose largest value is 3.4e38.";
    TokenTooLong = "E024", "a number is too long", "No number needs more than 64 characters.";
    Norm = "E025", "not a unit quaternion", "A rotation is a quaternion of norm 1. Norms within 0.1 of it are normalised; others are more likely a mistake, such as a missing column.";
    TimeNotIncreasing = "E026", "times do not increase", "Key times increase strictly from line to line.";
    KeyNorm = "E027", "no rotation", "A key's quaternion has a norm under 1e-6; it gives no rotation.";
    EqualTimes = "E028", "two keys at one time", "The values differ: --duplicates first or last keeps one of the keys, both keeps a jump.";
    Time = "E030", "not a list of times", "A list of times has finite numbers of seconds, separated by blanks, commas or line ends.";
    Map = "E032", "not a map of arrays or columns", "`--map` says what a file's arrays or columns are: entries `name=source[3:7]:order`, separated by commas, whose sources are in the file.";
    Memory = "E034", "more memory than an input of its length may take", "An input gets 64 times its length and 64 MiB (`--max-memory`); this one claims to hold more, by counts, by data that is packed or by parts that name one part many times.";
    // E1xx and W1xx: glTF.
    Glb = "E100", "not a whole GLB", "A GLB has a header that says its length, a JSON chunk, and whole chunks after it.";
    GltfVersion = "E101", "not glTF 2.0", "Only version 2.0 is read; every exporter of today writes it.";
    Json = "E102", "not valid JSON", "A glTF file is a JSON object with `asset`; its text has a fault at this place.";
    Property = "E103", "a property that is not as glTF has it", "It is missing, given twice, or of another type than glTF 2.0 says.";
    NoAnimations = "E104", "no animations", "The file has nothing that moves.";
    IndexRange = "E105", "an index of nothing", "Parts of a glTF file name each other by number; there is nothing of this number.";
    NodeTree = "E106", "nodes that make no tree", "A node has one parent at most, and is never its own ancestor.";
    Uri = "E107", "a URI that is not followed", "Data is read from the file itself and from files in its folder and below, named by relative URIs; nothing is fetched from a network.";
    TooShort = "E108", "fewer bytes than needed", "A buffer, a view of it or an accessor claims more bytes than there are; the file may be cut.";
    AccessorType = "E109", "an accessor of the wrong type", "Times are floats; rotations are four, translations and scales three floats or normalized integers.";
    Sparse = "E110", "a sparse accessor that does not fit", "Its indices are unsigned integers, increase, and lie within the accessor.";
    OutputCount = "E111", "not as many values as times", "LINEAR and STEP have a value for each time, CUBICSPLINE three: tangent, value, tangent.";
    Interpolation = "E112", "an unknown interpolation", "glTF 2.0 has LINEAR, STEP and CUBICSPLINE.";
    TwoChannels = "E113", "two channels for one target", "It is not clear which of them moves the node.";
    Extension = "E114", "data behind an unknown extension", "The file requires an extension to read these bytes, and that is not known here.";
    Meshopt = "E115", "compressed data that cannot be read", "A buffer view is compressed by meshopt in a way that is broken or not known.";
    GltfFolder = "E116", "a .gltf away from its files", "It names files relative to its own folder, and is written beside them alone; a .glb takes everything in.";
    NothingToAnimate = "E180", "nothing to animate", "An animation in glTF has at least one time and one channel; clips without tracks or samples cannot be written.";
    NotTrees = "E181", "joints that are not trees", "Nodes of glTF have one parent, are not their own ancestors, and have finite transforms relative to it; the clip's joints are not such.";
    TimesInF32 = "E182", "times that f32 cannot tell apart", "Times in glTF are f32, which has 24 bits: after a day, times are 7.8 ms from each other. Use a lower rate, or times nearer to 0.";
    TimesBelowZero = "E183", "times below 0", "Times in glTF begin at 0 or later: `tumble convert --start 0` cuts what is before.";
    GlbTooLong = "E184", "too long for GLB", "A GLB has lengths of 32 bits, at most 4 GiB. Write fewer samples, or the clips to several files.";
    // E2xx and W2xx: BVH.
    BvhStart = "E200", "no HIERARCHY", "A BVH file begins with the word HIERARCHY, then its joints, then MOTION.";
    BvhWord = "E201", "a word that has no place", "Joints are ROOT or JOINT and a name, then in braces an OFFSET, CHANNELS, and further JOINTs or an End Site.";
    BvhBraces = "E202", "braces that do not match", "Each joint and End Site has its own pair of braces.";
    BvhOffset = "E203", "no OFFSET", "Each joint says in three numbers where it is in its parent.";
    BvhChannel = "E204", "no channel of this name", "A joint has Xposition, Yposition, Zposition, Xrotation, Yrotation and Zrotation, each at most once.";
    BvhChannelCount = "E205", "the wrong number of channels", "CHANNELS gives the number of the names after it, on the same line.";
    BvhMotion = "E206", "no MOTION", "The file ends within its hierarchy; it is probably cut.";
    BvhFrames = "E207", "not a number of frames", "The line after MOTION is `Frames: ` and a whole number.";
    BvhFrameTime = "E208", "not a frame time", "The line after Frames is `Frame Time: ` and the seconds of a frame, from 1e-9 to 1e9.";
    BvhRow = "E209", "the wrong number of numbers", "Each frame is a line with a number for each channel, in the order of the hierarchy.";
    BvhCut = "E210", "fewer rows than frames", "The file ends before its last frame; it is probably cut.";
    BvhSecond = "E211", "a second HIERARCHY", "Two files in one? Split it.";
    BvhWrite = "E212", "not to be written as BVH", "A BVH file holds one clip, whose samples are frames of one rate, with angles about three different axes.";
    // E3xx and W3xx: NPY and NPZ.
    Archive = "E301", "not a ZIP archive that can be read", "An NPZ file is a ZIP archive of NPY arrays, stored or deflated. A copy that ended early lacks the directory at its end.";
    Encrypted = "E302", "an encrypted member", "Passwords are not asked for; save the file without one.";
    RepeatedMember = "E303", "two members of one name", "Programs differ in which of them they read.";
    MemberSize = "E304", "a member of the wrong size", "The archive's directory says how long a member is, packed and unpacked, and what its checksum is. What its bytes cannot hold is refused before it is unpacked.";
    ArrayHeader = "E305", "not an NPY array", "An array begins with `\\x93NUMPY`, a version and a header that says the type, the order and the shape.";
    Pickled = "E306", "pickled Python objects", "To read a pickle is to run what it says. None is ever looked into; save numbers and texts as arrays of their own types.";
    ArraySize = "E307", "an array of the wrong size", "The header's shape and type tell how many bytes follow it.";
    ElementType = "E308", "an array of the wrong type", "Keys and vectors are floats (f2, f4, f8), rates and parents numbers, names text.";
    Shape = "E309", "an array of the wrong shape", "Arrays of one clip have as many frames and tracks as each other, at least one of each.";
    UnknownArrays = "E310", "arrays of unknown names", "Motion of SMPL bodies (`poses`), of bodies in the world (`body_rotations`) and our own layout (`rotations`) are known by the names of their arrays; of others `--map` says what they are.";
    NoRate = "E311", "no times", "Neither a list of times nor a frame rate is there, or the unit of the times is not known: `--source-fps` and `--time-unit` say them.";
    FrameRate = "E312", "not a frame rate", "A rate is one number of frames per second over 0.";
    Ambiguous = "E313", "tracks and frames cannot be distinguished", "Each of the two axes may be that of the frames; `--map` says which comes first.";
    Parents = "E314", "parents that make no hierarchy", "The parent of each track is another track, or -1 for a root.";
    OneClip = "E315", "not one clip", "An NPZ file holds one clip.";
    Layout = "E316", "samples that do not fit the layout", "A file whose layout is kept has as many tracks as before, and frames at a rate if it has no list of times.";
    NotPerFrame = "E317", "an array that cannot be interpolated", "`--linear NAME`, in Python `linear=[NAME]`, names arrays of numbers with an entry for each frame, which are not keys.";
    RateBesideTimes = "E318", "a rate beside times", "`--source-fps` is for files that say no times: where a file has the time of every key, these times are its rate.";
    BodyModel = "E319", "not a model of the body", "`--body-model` takes a model of SMPL, SMPL-H or SMPL-X as NPZ, or a folder with one for each gender, for motion of such bodies. It says where the joints of a shape are.";
    // E4xx and W4xx: tables (Parquet, Arrow, CSV).
    TableDamaged = "E401", "a table that cannot be read", "The file is cut or damaged, or written in a way that is not read here; the reason is given. Rows count from 0.";
    TableClaims = "E402", "more than the file can hold", "The file announces more rows or bytes than could be packed into its length; nothing was read.";
    Compression = "E403", "a compression that is not read", "Parquet is read uncompressed and with snappy, zstd and LZ4, Arrow uncompressed and with zstd and LZ4.";
    NoRotations = "E404", "no rotations among the columns", "Rotations are the columns `x y z w` (a row for each key), `knee.x knee.y knee.z knee.w` (a row for each time), or a part of a list that --map names.";
    NoTimes = "E405", "no times among the columns", "Times are a column `time`, `timestamp` or `t`, or `frame_index` with --source-fps; --map time=NAME names another.";
    ColumnMissing = "E406", "a column is missing", "A name that --map gives, or the others of a group of columns such as `tx ty tz`.";
    ColumnTwice = "E407", "two columns of one name", "It is not clear which of them is meant; rename one.";
    ColumnType = "E408", "a column of another type", "Rotations, translations and scales are numbers, names are text or whole numbers, times are numbers or timestamps.";
    Null = "E409", "a null", "A key without a value is not a key; fill it in or remove its row. Rows count from 0.";
    WholeTimes = "E410", "times that are whole numbers", "They may be seconds or nanoseconds: --time-unit s, ms, us or ns says which.";
    ListLength = "E411", "a list of another length", "A rotation takes four numbers of a list, a translation or a scale three; `--map NAME=LIST[3:7]` says which.";
    NoRows = "E412", "a table without rows", "It has columns but no keys.";
    SeveralClips = "E413", "several clips for one table", "A wide table holds one clip; write them to files of their own, or as Parquet.";
    // E5xx and W5xx: trajectories.
    TumPose = "E501", "not a pose", "A line has eight numbers: `t x y z qx qy qz qw`.";
    TumTime = "E502", "a time out of range", "Times are seconds, up to 1e14 before or after 0.";
    TumEmpty = "E503", "no poses", "All lines are blank or comments.";
    TumWrite = "E504", "not to be written as a trajectory", "A trajectory is one clip of one track, at times that the format tells apart. KITTI has no times: poses that are not frames of a rate need a file of them, `--times-out`, in Python `times_out`.";
    KittiPose = "E505", "not a pose", "A line has twelve numbers: the three rows of a matrix, a rotation and a translation. A fourth row `0 0 0 1` is read too. A number of the frame before them, as KITTI-360 has it, is not: remove it and give the times of the frames by `--source-times`, in Python `source_times`.";
    FrameTimes = "E507", "not a time for each pose", "A file of times has the seconds of each pose, a number a line, in the order of the poses.";
    NoRotation = "E506", "a matrix that is not a rotation", "The rows of a rotation have length 1, stand at right angles, and do not mirror.";
    // E6xx: paths.
    Path = "E601", "not a path", "A path is CSV with the header `t,x,y,z,ux,uy,uz`, of which `t` and `ux,uy,uz` may be missing, or NPY of shape (tracks, points, 3). An upward direction has a length; its cells may be blank.";
    PathTimes = "E602", "no times, or too many", "A path whose file has no times needs --seconds or --rate; one that has times takes neither.";
    // E61x: what ways lead over, and who goes.
    Mesh = "E610", "not a mesh", "A mesh is OBJ, PLY, GLB or glTF with faces of three corners or more, whose corners are there and are numbers.";
    Net = "E611", "not a net", "A net of control points is NPY of floats and of shape (m, n, 3), each side 2 to 32.";
    Pairs = "E612", "not a pair", "Each line has six numbers: x y z of the start, then of the goal.";
    Walkers = "E613", "not a walker", "A walker has radius, speed, x, y, z, to_x, to_y and to_z, and a plain name; what moves on a track of its own has radius and track, whose rows are t, x, y, z with increasing times.";
    Offsets = "E614", "offsets that do not fit", "There are three numbers for each joint: where it is in its parent, in the order of the joints.";
    // E7xx and W7xx: FBX.
    FbxDamaged = "E701", "an FBX file that cannot be read", "It is cut, damaged, or not an FBX file; the reason is that of the library that reads it, which gives no location.";
    FbxVersion = "E702", "an unknown version of FBX", "Versions 3.0 to 7.7 are read, as text and as binary.";
    FbxDepth = "E703", "nodes too deep below each other", "No skeleton is a thousand joints deep.";
    FbxWork = "E704", "curves that take too much work", "Curves are evaluated as often as following them takes, and a file gets a number of evaluations by its length; one that takes more is damaged, or made to.";
    // E8xx and W8xx: MCAP.
    McapDamaged = "E801", "an MCAP file that cannot be read", "It is damaged, or not an MCAP file; the location is that of the record in the file.";
    McapMessage = "E802", "a message that cannot be read", "It is not as its type says; the topic is refused, and the others are read.";
    McapEmpty = "E803", "no poses in the log", "Topics of the types PoseStamped, PoseWithCovarianceStamped, Odometry, TransformStamped, TFMessage and Path, encoded in CDR, are read.";
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
    AccelerationJumps = "W014", "an angular acceleration that jumps", "The method `c2` promises one that is continuous. At these keys no such curve was found, or they are passed so fast that it would whirl around; there only the velocity is continuous. Mostly a very short interval beside a very long one: add keys in the long one, or choose `-m bessel-overhauser`.";
    RequiredExtension = "W100", "an unknown required extension", "The animations are read without it; data that needs it is refused.";
    CubicOfOne = "W101", "a cubic of one key", "There is nothing to interpolate; the value is constant.";
    EmptySampler = "W102", "a sampler without keys", "Its target stays at rest.";
    NothingMoved = "W103", "an animation that moves no node", "It has no channels, or only those of weights and other properties; it is kept as it is.";
    NodeMatrix = "W104", "a moved node with a matrix", "glTF has moved nodes give translation, rotation and scale; the matrix is split into these.";
    Shear = "W105", "a matrix that shears", "No translation, rotation and scale are equal to it; the nearest are taken, and poses in the world are refused.";
    NegativeTime = "W106", "a negative time", "glTF has times from 0 on; players may not show what comes before.";
    ByteStride = "W107", "a stride in animation data", "glTF has strides for vertices alone; it is honoured.";
    BufferLong = "W108", "a buffer longer than it says", "What is after the length that it says is not read.";
    TargetPath = "W109", "an unknown target", "The channel moves something that glTF 2.0 does not name; it is kept as it is.";
    StaysOutside = "W110", "a file that stays outside", "It could not be taken into the GLB, or the output is in another folder than its input; the URI is kept.";
    StaysWhole = "W111", "channels that are not cut", "Channels of weights and other properties are kept as they are: the animation stays as long as they are.";
    BvhMoreRows = "W201", "more rows than frames", "The rows after the last frame are left out.";
    BvhNoFrames = "W202", "no frames", "The skeleton rests.";
    EndSiteRounded = "W203", "an End Site that f32 rounds", "End Sites mark where a last bone ends, relative to its joint, and are kept in f32: about 7 digits. Offsets of joints and positions keep all of theirs.";
    StartMoved = "W204", "the start is moved to 0", "BVH and bodies of SMPL have no start time: their first frame is at 0. glTF keeps times in f32, which cannot tell frames apart in seconds since 1970: they count from the first whole second.";
    SameName = "W206", "two joints of one name", "The second one gets its number after its name, so that names are unique; braces and control characters in names become `_`.";
    NameChanged = "W207", "a name is changed", "The format has no line ends, braces or control characters in names, and no name twice.";
    NoRoom = "W208", "what the format has no room for", "It is left out. A table in the documents says what each format holds.";
    UnknownBody = "W301", "a body of an unknown number of joints", "SMPL has 24 joints, SMPL-H 52, SMPL-X 55, and 22 are common to them; others are read without names and parents.";
    LeftOut = "W302", "arrays that are left out", "They have an entry for each frame of the input, and it is not known how to sample them: `--linear NAME`, in Python `linear=[NAME]`, interpolates them linearly.";
    ObjectsBeside = "W303", "pickled Python objects beside the keys", "They are not looked into. Where the file is written again, they are copied as they are if they are no lists of frames.";
    TwoRates = "W304", "two rates that differ", "A file says its rate twice, or a rate and times or a length of another; `--source-fps` overrules rates.";
    Nanoseconds = "W305", "times that are nanoseconds", "Seconds since 1970 have ten digits, nanoseconds nineteen, as ORB-SLAM writes them: `--time-unit ns` says it without this warning.";
    ArraysNotRead = "W306", "arrays that are not read", "They are no part of a motion as far as their names tell; `--map` says what arrays are. The shape of a body (`betas`, `gender`) is used where `--body-model` brings its model. A result in the file's own layout keeps what is the same in all frames.";
    Bridged = "W401", "keys that are missing", "Cells are blank or NaN, and `--bridge-gaps` asks for the track to be interpolated from its other keys there.";
    ColumnsLeftOut = "W402", "columns that are left out", "Their names are none of those that keys have, or a list has more numbers than `--map` takes. `--map` gives columns the names of keys.";
    FurtherNumbers = "W501", "further numbers after a pose", "A line of a trajectory is a time, a position and a quaternion, of KITTI the twelve numbers of a matrix; what follows, such as a covariance or velocities, is not read.";
    FbxBeside = "W701", "what is not motion", "Meshes, skins, materials and the like are not read from FBX; nodes, and what moves them, are.";
    FbxProperties = "W702", "curves of other properties", "They move something other than a transform, such as blend shapes, visibility or a lens.";
    FbxOutside = "W703", "keys outside the take", "An animation stack says when it begins and ends. Curves have keys before or after, which a player does not show.";
    FbxScaleNodes = "W704", "nodes that carry scales", "In FBX a node may keep its scale from its children. Where that changes something, the scale gets a node of its own beside them.";
    FbxWild = "W705", "a curve that is not followed", "Between two keys it changes so fast that a thousand times as many keys do not follow it within the bound.";
    FbxRests = "W706", "a stack that moves nothing", "It has no curves of nodes; each node rests at its one key.";
    McapCut = "W801", "a log that is cut", "It ends within a record, as when its writer lost power. What is before is read.";
    McapOthers = "W802", "topics of other types", "They hold no poses, or messages that are not in CDR.";
    FbxOdd = "W707", "an oddity that was mended", "The library that reads FBX found something that is not as it should be, and goes on.";
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
