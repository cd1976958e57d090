//! Errors and warnings about inputs: where the problem is, what it is and how to solve it. Every message that a file
//! can cause has a code, which is documented here.

use std::fmt;

use crate::printable::printable;

/// Whether an input is refused, or read with a warning.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Severity {
    /// The input is refused.
    Error,
    /// The input is read, but something in it is probably not intended.
    Warning,
}

/// The location of a problem in an input.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Location {
    /// In text: line and column, both from 1.
    Text {
        /// Number of the line.
        line: u64,
        /// Number of the column, in characters.
        column: u64,
    },
    /// In a file without lines: a JSON pointer such as `/animations/0`, the name of an archive's member, or a table's
    /// column and row.
    Inside(String),
}

impl Location {
    /// The index of the animation in which it is, in a file of glTF's form.
    #[must_use]
    pub fn animation(&self) -> Option<usize> {
        let Self::Inside(pointer) = self else {
            return None;
        };
        let rest = pointer.strip_prefix("/animations/")?;
        rest.split('/').next()?.parse().ok()
    }
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Text { line, column } => write!(f, "{line}:{column}"),
            Self::Inside(pointer) => f.write_str(pointer),
        }
    }
}

/// One error or warning about an input.
///
/// It is displayed on one line as `FILE:LOCATION: error[CODE]: what is wrong, the value, the fix`. Characters that a
/// terminal would execute are escaped ([`printable`]).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// The input's name, as the caller passed it.
    pub file: String,
    /// The location of the problem; `None` for the input as a whole.
    pub location: Option<Location>,
    /// The code of the problem.
    pub code: Code,
    /// The message, without code and location.
    pub message: String,
    /// How often the problem occurs; the location is that of the first time.
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
    /// A diagnostic about an input as a whole.
    pub fn new(file: impl Into<String>, code: Code, message: impl Into<String>) -> Self {
        Self {
            file: file.into(),
            location: None,
            code,
            message: message.into(),
            count: 1,
        }
    }

    /// The error of an input without bytes.
    pub(crate) fn empty(file: impl Into<String>) -> Self {
        Self::new(file, Code::Empty, "the file is empty")
    }

    /// The same diagnostic with a location in a file without lines: a JSON pointer, a member, a column.
    #[must_use]
    pub fn inside(mut self, pointer: impl Into<String>) -> Self {
        self.location = Some(Location::Inside(pointer.into()));
        self
    }
}

/// The codes: `Name = "CODE", "title", "explanation";`. After a code, `elsewhere` means that no file in the tables of
/// cases causes it, because the cause is an error of the system, an option, a size or the writing of a file; another
/// test does.
macro_rules! codes {
    (@has_case) => { true };
    (@has_case elsewhere) => { false };
    ($($variant:ident = $code:literal $($elsewhere:ident)?, $title:literal, $explanation:literal;)+) => {
        /// The codes of all errors and warnings about inputs. Codes of warnings start with `W`.
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

            /// A short title.
            pub fn title(self) -> &'static str {
                match self { $(Self::$variant => $title,)+ }
            }

            /// Whether a file alone can cause it, so that the tests have a case of it. Otherwise the cause is an
            /// error of the system, an option, a size or the writing of a file.
            pub fn has_case(self) -> bool {
                match self { $(Self::$variant => codes!(@has_case $($elsewhere)?),)+ }
            }

            /// Why the input is refused or the warning is issued, and what to do.
            pub fn explanation(self) -> &'static str {
                match self { $(Self::$variant => $explanation,)+ }
            }
        }
    };
}

codes! {
    Open = "E001" elsewhere, "the input cannot be read", "The system could not open or read it; the message contains the system's reason.";
    NotAFile = "E002" elsewhere, "not a file", "Directories, sockets and devices cannot be read as files. A named pipe is read only with `--pipes`; `-` reads standard input.";
    Changed = "E003" elsewhere, "the file changed while it was read", "The file's length or its modification time changed during reading. Try again when the other program has finished writing.";
    OtherFormat = "E004", "another format", "The first bytes or the name show that the file is of another kind than expected, or of a kind that Tumble does not read. The message names the kind and says how to read or convert the file.";
    Encoding = "E005", "not plain text", "A `.dat` file is ASCII or UTF-8 text; UTF-16, NUL bytes and invalid UTF-8 are refused.";
    Character = "E006", "a character that does not belong", "Lines of numbers contain only printable ASCII, blanks and tabs. No-break spaces and form feeds are refused because editors hide them. All text formats, also CSV and OBJ, refuse a carriage return without a line feed, because most programs would read the whole file as one line. (Old Macintoshes ended lines in this way.) Save the file with LF or CR LF.";
    LineTooLong = "E007" elsewhere, "a line is too long", "Lines of keyframe data are never this long; the file is probably of another kind.";
    FileTooLong = "E008" elsewhere, "the file is too long", "The limit protects against endless inputs; raise it by `--max-size` if the file is correct.";
    Empty = "E010", "an empty file", "The file has no bytes, or no line: the program that wrote it may have been stopped, or its disk was full.";
    NoHeader = "E011", "no header", "The first line is `# <boxes> <box length>`, such as `# 4 3.0`.";
    HeaderShort = "E012", "the header lacks a number", "The header has the number of boxes and the length of a box.";
    Boxes = "E013", "not a number of boxes", "The number of boxes is a whole number from 1 to 65536, in plain digits.";
    BoxLength = "E014", "not a box length", "The length of a box is a finite number.";
    NoKeys = "E015", "no keys", "After the header there must be at least one line of keys.";
    SecondHeader = "E016", "a second header", "A file has one header, then keys. If the file contains several recordings, split it.";
    Columns = "E020", "the wrong number of columns", "A key line has a time and four numbers for each box: `time w x y z w x y z …`.";
    Number = "E021", "not a number", "Numbers are decimal, with a point, and may have an exponent: `-1.25e-3`.";
    NotFinite = "E022", "not finite", "NaN and infinity are neither rotations nor times. Repair the key, or remove it.";
    TooLarge = "E023", "too large for f32", "Keys are kept in f32, whose largest value is 3.4e38.";
    TokenTooLong = "E024", "a number is too long", "No number needs more than 64 characters.";
    Norm = "E025", "not a unit quaternion", "A rotation is a quaternion of norm 1. Norms within 0.1 of 1 are normalised. Other norms are probably a mistake, such as a missing column.";
    TimeNotIncreasing = "E026", "times do not increase", "Key times must increase strictly from line to line. If the lines are only out of order, sort them by time: `sort -g -k 1,1 FILE`, or `sort -g -t , -k 1,1 FILE` for columns with commas. If the clock was set back, the file has two recordings. The times of samples (`--times`) must increase too if a clip is written.";
    KeyNorm = "E027", "no rotation", "The norm of a key's quaternion is below 1e-6, so it does not determine a rotation.";
    EqualTimes = "E028", "two keys at one time", "Two keys at the same time have different values. `--duplicates first` or `last` keeps one of them, `both` makes a jump.";
    LargeSeconds = "E029" elsewhere, "times too large for seconds", "In CSV, Parquet, Arrow and TUM files and in KITTI's files of times, times of 1e11 and more are read as milliseconds, microseconds or nanoseconds since 1970 (W305). So such times cannot be written to these formats in seconds. If the times of the input have another unit, state it by `--time-unit`.";
    Time = "E030" elsewhere, "not a list of times", "A list of times has finite numbers of seconds, separated by blanks, commas or line ends.";
    Map = "E032" elsewhere, "not a map of arrays or columns", "`--map` defines the meaning of arrays or columns: entries `name=source[3:7]:representation`, separated by commas, such as `hand=state[3:7]:wxyz`. Each source must be in the file, and each entry must have an effect.";
    Memory = "E034", "more memory than is allowed for its length", "By default, reading an input may take at most 64 times its length plus 64 MiB of memory (`--max-memory`). This input would take more. Possible causes are a wrong count, compressed data, or parts that refer to the same part many times.";
    // E1xx and W1xx: glTF.
    Glb = "E100", "not a whole GLB", "A GLB has a header with its length, a JSON chunk, and complete chunks after it.";
    GltfVersion = "E101", "not glTF 2.0", "Only version 2.0 is supported; all current exporters write it.";
    Json = "E102", "not valid JSON", "A glTF file is a JSON object with a member `asset`. The JSON text has an error at this location.";
    Property = "E103", "an invalid property", "A property is missing, is given twice, or does not have the type that glTF 2.0 requires.";
    NoAnimations = "E104", "no animations", "The file contains no animation.";
    IndexRange = "E105", "an index out of range", "Parts of a glTF file refer to each other by index; this index does not exist.";
    NodeTree = "E106", "nodes that are not a tree", "A node must have at most one parent, and must not be its own ancestor.";
    Uri = "E107", "a URI that is not followed", "Data is read from the file itself and from files in its folder and below, named by relative URIs; nothing is fetched from a network.";
    TooShort = "E108", "fewer bytes than needed", "A buffer, a buffer view or an accessor needs more bytes than there are; the file may be truncated.";
    AccessorType = "E109", "an accessor of the wrong type", "Times are floats. Rotations are four floats or normalized integers, translations and scales three, weights of morph targets one.";
    Sparse = "E110", "a sparse accessor that does not fit", "Its indices must be unsigned integers that increase and are less than the number of elements.";
    OutputCount = "E111", "not as many values as times", "LINEAR and STEP have a value for each time, CUBICSPLINE three: tangent, value, tangent.";
    Interpolation = "E112", "an unknown interpolation", "glTF 2.0 has LINEAR, STEP and CUBICSPLINE.";
    TwoChannels = "E113", "two channels for one target", "Both channels set the same property of the node, so it is not clear which one applies.";
    Extension = "E114", "data that needs an unknown extension", "These bytes can be read only with an extension that is not supported.";
    Meshopt = "E115", "compressed data that cannot be read", "The meshopt compression of a buffer view is damaged or not supported.";
    GltfFolder = "E116" elsewhere, "a .gltf in another folder than its files", "A .gltf file refers to other files relative to its folder, so the result can only be written into the folder of the input. Write a .glb, which contains everything.";
    NothingToAnimate = "E180" elsewhere, "nothing to animate", "An animation in glTF needs at least one time and one channel. Clips without tracks or samples cannot be written.";
    NotTrees = "E181" elsewhere, "joints that are not trees", "glTF requires that nodes are trees with finite transforms. The joints of the clip are not.";
    TimesInF32 = "E182" elsewhere, "times that f32 cannot tell apart", "glTF stores times in f32, whose steps are 7.8 ms after a day, so some frames would have equal times. Give a lower rate (`--fps`); the message says which fits. NPZ, CSV and Parquet have times in f64.";
    TimesBelowZero = "E183" elsewhere, "times below 0", "glTF has no negative times. `tumble convert --start 0` removes them.";
    GlbTooLong = "E184" elsewhere, "too long for GLB", "A GLB has at most 4 GiB. Write fewer samples, or write the clips to several files.";
    // E2xx and W2xx: BVH.
    BvhStart = "E200", "no HIERARCHY", "A BVH file begins with the word HIERARCHY, then its joints, then MOTION.";
    BvhWord = "E201", "an unexpected word", "Joints are ROOT or JOINT and a name, then in braces an OFFSET, CHANNELS, and further JOINTs or an End Site.";
    BvhBraces = "E202", "braces that do not match", "Each joint and each End Site has a pair of braces.";
    BvhOffset = "E203", "no OFFSET", "Each joint has three numbers, its position relative to its parent.";
    BvhChannel = "E204", "no channel of this name", "A joint has Xposition, Yposition, Zposition, Xrotation, Yrotation and Zrotation, each at most once.";
    BvhChannelCount = "E205", "the wrong number of channels", "After CHANNELS, there is a number, and then as many names, on the same line.";
    BvhMotion = "E206", "no MOTION", "The file ends within its hierarchy; it is probably truncated.";
    BvhFrames = "E207", "not a number of frames", "The line after MOTION is `Frames: ` and a whole number.";
    BvhFrameTime = "E208", "not a frame time", "The line after Frames is `Frame Time: ` and the seconds of a frame, from 1e-9 to 1e9.";
    BvhRow = "E209", "the wrong number of values", "Each frame is a line with one number for each channel, in the order of the hierarchy.";
    BvhCut = "E210", "fewer rows than frames", "The file ends before its last frame; it is probably truncated.";
    BvhSecond = "E211", "a second HIERARCHY", "A file has one hierarchy. If the file contains several, split it.";
    BvhWrite = "E212" elsewhere, "a clip that BVH cannot store", "A BVH file has one clip, with frames at a constant rate and Euler angles about three different axes.";
    // E3xx and W3xx: NPY and NPZ.
    Archive = "E301", "not a ZIP archive that can be read", "An NPZ file is a ZIP archive of NPY arrays, stored or deflated. In an incomplete copy, the directory at the end of the file is missing.";
    Encrypted = "E302", "an encrypted member", "Encrypted archives are not supported; save the file without a password.";
    RepeatedMember = "E303", "two members of one name", "It is not clear which of them to read.";
    MemberSize = "E304", "a member of the wrong size", "The size or the checksum of a member differs from what the archive's directory says; the file is damaged.";
    ArrayHeader = "E305", "not an NPY array", "An array begins with `\\x93NUMPY`, a version, and a header with its type, order and shape.";
    Pickled = "E306" elsewhere, "pickled Python objects", "An array of numbers or texts is needed here, but this one holds Python objects. Save numbers and texts as arrays of plain types.";
    ArraySize = "E307", "an array of the wrong size", "The number of bytes after the header differs from the number that the shape and the type in the header require.";
    ElementType = "E308", "an array of the wrong type", "Keys and vectors must be floats (float16, float32 or float64, which NumPy's headers call f2, f4 and f8), rates and parents numbers, names text.";
    Shape = "E309", "an array of the wrong shape", "All arrays of a clip must have the same number of frames and of tracks, at least one of each.";
    UnknownArrays = "E310", "arrays of unknown names", "Layouts are recognised by the names of their arrays: motion of SMPL bodies (`poses`), body poses in world space (`body_rotations`), Tumble's layout (`rotations`), and those of programs for robots (docs/robots.md). For other files, define the arrays with `--map`.";
    NoRate = "E311", "no times", "The file has neither times nor a frame rate, or the unit of its times is not known. Give the rate by `--source-fps` or the unit by `--time-unit`.";
    FrameRate = "E312", "not a frame rate", "A rate is one number of frames per second, greater than 0.";
    Ambiguous = "E313", "tracks and frames cannot be distinguished", "Two axes of the array may be the frames. `--map` selects one.";
    Parents = "E314", "parents that are not a hierarchy", "The parent of each track is another track, or -1 for a root.";
    OneClip = "E315" elsewhere, "not one clip", "An NPZ file holds one clip.";
    Layout = "E316" elsewhere, "samples that do not fit the layout", "If the layout of a file is kept, the number of tracks must not change, and a file without a list of times needs frames at a constant rate.";
    NotPerFrame = "E317" elsewhere, "an array that cannot be interpolated", "`--linear NAME`, in Python `linear=[NAME]`, accepts names of numeric arrays that have an entry for each frame and are not keys.";
    RateBesideTimes = "E318" elsewhere, "a rate in addition to times", "`--source-fps` and `--override-fps` are only for files without times. This file has the time of every key.";
    BodyModel = "E319" elsewhere, "not a model of the body", "`--body-model` accepts a model of SMPL, SMPL-H or SMPL-X as NPZ or pickle, or a folder with one for each gender. It must belong to the kind of body in the motion.";
    BodyAlone = "E320" elsewhere, "the shape of a body without a motion", "In addition to motions, AMASS contains the shape of each subject, `shape.npz`, and the first stage of fitting markers, `*_stagei.npz`. These files contain no clips; leave them out. In Python, `MotionLibrary.load(…, on_error=\"skip\")` leaves them out and lists them.";
    // E4xx and W4xx: tables (Parquet, Arrow, CSV).
    TableDamaged = "E401", "a table that cannot be read", "The file is truncated or damaged, or uses a feature that is not supported; the message gives the reason. Rows are counted from 0.";
    TableClaims = "E402", "more than the file can contain", "The file states more rows or bytes than its length can contain; nothing was read.";
    Compression = "E403", "a compression that is not read", "Parquet is read uncompressed and with snappy, zstd and LZ4, Arrow uncompressed and with zstd and LZ4.";
    NoRotations = "E404", "no rotations among the columns", "Rotations are the columns `x y z w` (a row for each key), `knee.x knee.y knee.z knee.w` (a row for each time), or a part of a list that --map names. A table of numbers without rotations, such as the angles of joints, is read by `--map knee=COLUMN:scalar:angle` (radians; `:deg` for degrees), or `:scalar` for other numbers.";
    NoTimes = "E405", "no times among the columns", "Times are a column `time`, `timestamp` or `t`, or `frame_index` with --source-fps; --map time=NAME names another. In CSV, commas must separate the columns, and the first line must name them; a file with semicolons or tabs, or without names, has no such column.";
    ColumnMissing = "E406", "a column is missing", "A column that `--map` names does not exist, or a group of columns such as `tx ty tz` is not complete.";
    ColumnTwice = "E407", "two columns of one name", "It is not clear which of them is meant; rename one.";
    ColumnType = "E408", "a column of another type", "Rotations, translations and scales are numbers, names are text or whole numbers, times are numbers or timestamps.";
    Null = "E409", "a null", "A value is missing. Fill it in or remove the row. Rows are counted from 0.";
    WholeTimes = "E410", "times that are whole numbers", "The unit is not known; give it by `--time-unit s`, `ms`, `us` or `ns`.";
    ListLength = "E411" elsewhere, "a list of another length", "A rotation needs four numbers of a list, a translation or a scale three; `--map NAME=LIST[3:7]` selects them.";
    NoRows = "E412", "a table without rows", "It has columns but no keys.";
    SeveralClips = "E413" elsewhere, "several clips for one table", "A table with a row for each time contains one clip. Write the clips to separate files, or as Parquet.";
    ColumnsAmbiguous = "E414", "columns of two meanings", "The columns `x y z` may belong to a quaternion `x y z w`, or to a position if the quaternion's columns have numbers after their names (`x_1`, `x.1`). Select one with `--map`.";
    // E5xx and W5xx: trajectories.
    TumPose = "E501", "not a pose with a time", "A line has eight numbers: `t x y z qx qy qz qw`. Further numbers are ignored if every line has as many of them.";
    TumTime = "E502", "a time out of range", "Times in seconds are at most 1e14 in magnitude. A first time from 1e11 on is taken for another unit (W305).";
    TumEmpty = "E503", "no poses", "All lines are blank or comments.";
    TumWrite = "E504" elsewhere, "a clip that a trajectory cannot store", "A trajectory has one clip with one track, whose times must differ after rounding to the format's precision. KITTI does not store times; poses that are not at frames of a rate need a separate file of times, `--times-out`, in Python `times_out`.";
    KittiPose = "E505" elsewhere, "not a pose of KITTI", "A line has twelve numbers: the three rows of a matrix, a rotation and a translation. A fourth row `0 0 0 1` and further numbers after them are allowed if every line has as many of them.";
    NoRotation = "E506" elsewhere, "a matrix that is not a rotation", "The rows of a rotation matrix have length 1 and are orthogonal, and its determinant is 1. In files of KITTI-360, a frame number before the matrix causes this error: remove it, and give the times of the frames by `--source-times`, in Python `source_times`.";
    FrameTimes = "E507" elsewhere, "not a time for each pose", "A file of times has one number on each line, the time of a pose in seconds, in the order of the poses.";
    // E6xx: paths.
    Path = "E601" elsewhere, "not a path", "A path is CSV with the header `t,x,y,z,ux,uy,uz`, where `t` and `ux,uy,uz` are optional, or NPY of shape (tracks, points, 3). An upward direction must not be 0; its cells may be blank.";
    PathTimes = "E602" elsewhere, "no times, or too many", "A path without times needs `--seconds` or `--pace`. A path with times must have neither.";
    // E61x: surfaces, routes over them, and walkers.
    Mesh = "E610" elsewhere, "not a mesh", "A mesh is OBJ, PLY, GLB or glTF. Its faces have at least three corners, which are existing vertices with finite coordinates.";
    Net = "E611" elsewhere, "not a net", "A net of control points is NPY of floats and of shape (m, n, 3), each side 2 to 32.";
    Pairs = "E612" elsewhere, "not a pair", "Each line has six numbers: x y z of the start, then of the goal.";
    Walkers = "E613" elsewhere, "not a walker", "A walker needs radius, speed, x, y, z, to_x, to_y and to_z. A moving obstacle needs radius and track, a file with rows t, x, y, z at increasing times. The name is optional and must not contain folders.";
    Offsets = "E614" elsewhere, "offsets that do not fit", "Offsets are three numbers for each joint, its position relative to its parent, in the order of the joints.";
    // E7xx and W7xx: FBX.
    FbxDamaged = "E701", "an FBX file that cannot be read", "It is truncated, damaged, or not an FBX file, or has decimal commas. The message is that of the library that reads FBX, which gives no location.";
    FbxVersion = "E702", "an unknown version of FBX", "Versions 3.0 to 7.7 are supported, as text and as binary.";
    FbxDepth = "E703" elsewhere, "a hierarchy that is too deep", "The hierarchy has more than a thousand levels; no skeleton has so many.";
    FbxWork = "E704" elsewhere, "curves that take too much work", "The number of evaluations of curves is limited in proportion to the length of the file. A file that needs more is damaged or malicious.";
    // E8xx and W8xx: MCAP.
    McapDamaged = "E801", "an MCAP file that cannot be read", "It is damaged, or not an MCAP file. The location is the position of the record in the file.";
    McapMessage = "E802", "a message that cannot be read", "The message does not agree with its type. Its topic is refused; the other topics are read.";
    McapEmpty = "E803", "no poses in the log", "Tumble reads topics of these types, encoded in CDR: PoseStamped, PoseWithCovarianceStamped, Odometry, QuaternionStamped, Imu, TransformStamped, TFMessage and Path. The message lists the topics of the log.";
    McapRoute = "E804" elsewhere, "a path without times", "All poses of the path have the same stamp, so they have no times. Planners write routes in this way. `tumble follow` moves a body along such a route.";
    // E9xx and W9xx: robots.
    RobotXml = "E900" elsewhere, "an XML file that cannot be read", "A robot's file is well-formed XML in UTF-8 without a document type definition, at most 4 MiB with the files that it includes.";
    RobotTree = "E901" elsewhere, "a robot that is no tree", "The bodies of a robot must form trees, each body and each joint needs its own name, and each element needs its required attributes. Of the two limits of a joint, the smaller one must come first.";
    RobotInclude = "E902" elsewhere, "an include that is not followed", "An MJCF file may include each file only once, and only files in its folder and below.";
    RobotElement = "E903" elsewhere, "an element that is not read", "The element would create or move bodies by rules that are not supported; the message names an alternative.";
    JointsDoNotFit = "E904" elsewhere, "joints that are not the robot's", "There are three possible causes. The file names joints that the robot of `--robot` does not have. Or the file does not name its joints, and has more or fewer than the robot. Or it has no joint angles at all, such as the motion of a human skeleton. Robots with the same name may exist in versions with different joints.";
    NoMassCentre = "E905" elsewhere, "a body without a centre of mass", "Velocities of centres of mass (`--velocity-at mass`, BeyondMimic) need the centre of mass of each body, and the robot's file has no `inertial` for this body. MuJoCo derives it from shapes, which Tumble does not read. Add it, or use velocities of origins. Fixed links of a URDF need none.";
    OrderContradicts = "E907" elsewhere, "an order that the bodies contradict", "The poses of bodies in the file are compared with those that follow from its joints and the robot of `--robot`. They agree only in an order that differs from the stated one. Programs list joints and bodies depth first (MuJoCo, mjlab) or breadth first (PhysX, IsaacLab), and quaternions as w x y z or x y z w.";
    TwoDialects = "E908", "arrays of two dialects", "Layouts of robots' motion are recognised by the names and the shapes of their arrays, and this file has the arrays of two layouts. Save the arrays of one of them, or name the arrays with `--map`.";
    PickleDamaged = "E910", "a pickle that cannot be read", "It is truncated or damaged, or not a pickle. The location is a position in the file, or in its unpacked content.";
    PickleCalls = "E911", "a pickle that would run code", "It names a function or a class that Python would call when it reads the file. Such files may do anything to the computer of those who open them with Python. Only numbers, texts, lists, dicts and arrays are read.";
    ObjectForValue = "E912", "an object where a value is needed", "The value is an object of a class that Tumble does not know. Save it as numbers, text or an array.";
    PickleType = "E913", "an array of a type that is not read", "Arrays of numbers (floats, integers, truth values) and of texts are read. Records, dates and complex numbers are not; save each part as an array.";
    PickleForm = "E914", "a form of pickle that is not read", "Its compression, its protocol or the location of its data is not supported. The message says how to save the file again.";
    PickleLimits = "E915", "a pickle beyond the limits", "Its values are nested more than 1000 deep, there are more than 2^24 of them, or a value contains itself. Or the values would need more memory than is allowed; a value counts once for each reference to it.";
    Mirror = "E916" elsewhere, "a clip that cannot be mirrored", "Each joint is exchanged with its partner of the same name on the other side, and the parents of the two must be partners, too. The sign of an angle depends on the axis of the joint, so `--robot` is needed for the joints of a robot; the axes of both sides must be mirror images at the plane of `--mirror`.";
    NotRecognised = "E917" elsewhere, "a skeleton that is not recognised", "Joints of two skeletons are paired by the parts of the body. The parts are found by the names and parents of joints, as in known kinds of skeletons; this skeleton is of another kind. Pair its joints with `--bones`.";
    Dialect = "E918" elsewhere, "a motion that a dialect cannot store", "The layout of the other program has a number for each hinge and slide, one root, and frames of one rate. The message names the part of the motion that it cannot store. `--fps` of `tumble eval` samples a motion at another rate; NPZ, CSV and GLB (without `--dialect`) store all of it.";
    OutsideLimits = "E919" elsewhere, "a joint outside its limits", "`--limits refuse` makes this an error. `--limits clamp` keeps joints inside, `--limits report` warns and keeps their values.";
    ByteOrderMark = "W001", "a byte-order mark", "It is ignored. Save the file without a byte-order mark.";
    MixedLineEnds = "W002", "mixed line ends", "Some lines end in CR LF, others in LF.";
    HeaderWords = "W003", "words after the header's numbers", "They are ignored.";
    BoxLengthSign = "W004", "a box length that is not positive", "The length is needed only to draw the boxes, not for rotations.";
    BlankLine = "W005", "a blank line between keys", "It is ignored. Check whether a key is missing there.";
    MaybeCut = "W006", "the last number may be cut", "The file does not end with a line end, and its last number has fewer decimals than the last numbers of the lines above it. If the file was cut while it was copied, the rest of the number is missing; copy the file again.";
    Tiny = "W007", "a number too small for f32", "It becomes 0.";
    NormOff = "W008", "a quaternion far from unit length", "It is normalised.";
    Order = "W009", "components may be in the order x y z w", "Every fourth column is near 1 and the first near 0, as when small rotations are written with w last. This format has w first.";
    Gap = "W010", "an unusual gap between times", "The gap is shorter than 1e-9 s or longer than 1e9 s. Perhaps the times are not in seconds.";
    OneKey = "W011", "only one key", "Nothing moves.";
    HalfTurn = "W012", "neighbouring keys 180° apart", "Both directions of rotation are equally long, so the stored signs of the quaternions decide which one is used.";
    EqualKeys = "W013", "a key given twice", "Two keys at the same time have equal values; the second is left out.";
    AccelerationJumps = "W014" elsewhere, "an angular acceleration that jumps", "With the method `c2` the angular acceleration is continuous, except at these keys: no such curve was found, or it would rotate many times between two keys. There only the velocity is continuous. The usual cause is a very short interval next to a very long one. Add keys in the long interval, or use `-m bessel-overhauser`.";
    OutsideKeys = "W015" elsewhere, "times outside the keys", "Some sample times are before the first key or after the last one. They get the value of this key, unless `--before` or `--after` selects another behaviour, such as `loop`.";
    InGaps = "W016" elsewhere, "times in gaps between keys", "Some times lie between two keys that are further apart than `--max-gap`. `--in-gaps` selects whether such times are left out, held at the key before, or refused.";
    EndLeftOut = "W017" elsewhere, "an end that is left out", "A smoothing kernel needs evenly spaced samples, and the last of them is before the end of the clip. To keep the end, choose a rate (`--fps`) that has a frame there.";
    OpenLoop = "W018" elsewhere, "a loop whose ends differ", "With `--edges loop` the last sample repeats the first. Here the rotations of the two differ by more than rounding or the noise of a recording could explain, so the clip is not a loop, or not a whole one.";
    RequiredExtension = "W100", "an unknown required extension", "The animations are read without it; data that needs it is refused.";
    CubicOfOne = "W101", "a cubic of one key", "There is nothing to interpolate; the value is constant.";
    EmptySampler = "W102", "a sampler without keys", "Its target is not animated.";
    NothingMoved = "W103", "an animation that moves no node", "It has no channels, or only those of properties that are not read, such as materials; it is kept as it is.";
    NodeMatrix = "W104", "an animated node with a matrix", "glTF requires translation, rotation and scale for animated nodes. The matrix is decomposed into these.";
    Shear = "W105", "a matrix that shears", "It cannot be decomposed exactly into translation, rotation and scale. They approximate it, and world poses are refused.";
    NegativeTime = "W106", "a negative time", "glTF has no negative times; players may not show this part.";
    ByteStride = "W107", "a stride in animation data", "glTF allows a stride only for vertices. It is used anyway.";
    BufferLong = "W108", "a buffer longer than it says", "Bytes after the stated length are not read.";
    TargetPath = "W109", "an unknown target", "The channel animates a property that glTF 2.0 does not define. It is copied unchanged.";
    StaysOutside = "W110" elsewhere, "a file that stays outside", "The file could not be included in the GLB, or the output is in another folder than the input. The URI is kept.";
    StaysWhole = "W111" elsewhere, "channels that are not cut", "Channels of properties that are not read, such as materials, are copied unchanged and not cut. Therefore the animation does not end before they do.";
    NoMorphTargets = "W112", "weights without morph targets", "The channel moves the weights of a node whose mesh has no morph targets, or that has no mesh. It is copied unchanged.";
    BvhMoreRows = "W201", "more rows than frames", "The rows after the last frame are left out.";
    BvhNoFrames = "W202", "no frames", "The skeleton does not move.";
    EndSiteRounded = "W203", "an End Site that f32 rounds", "An End Site is the end point of the last bone of a chain, relative to its joint. End Sites are stored in f32, with about 7 digits. Offsets of joints and positions keep all digits.";
    StartMoved = "W204" elsewhere, "times are shifted", "BVH and SMPL files have no start time, so the first frame is at 0 s. glTF stores times in f32, which cannot distinguish frames in seconds since 1970, so times are counted from the first whole second.";
    SameName = "W206", "two joints of one name", "A number is appended to the second name, so that names are unique. Braces and control characters in names are replaced by `_`.";
    NameChanged = "W207" elsewhere, "a name is changed", "The format does not allow line ends, braces or control characters in names, nor two equal names.";
    NoRoom = "W208" elsewhere, "data that the format cannot store", "It is left out. The table in docs/formats.md shows what each format can store.";
    NoOffsets = "W209" elsewhere, "joints without offsets", "The input contains the parents of joints, but not the positions of joints relative to them. Motion of SMPL bodies is an example: the positions of joints depend on the shape of the body. In BVH and glTF such joints are at their parents. `--body-model` or `--offsets` places them.";
    EndHeld = "W210" elsewhere, "a clip that ends between two frames", "The format stores frames of one rate and no times. One more frame, after the end, has the value of the end, so that nothing is missing and loops continue. With `--end-frame leave-out`, the result ends with the last frame before the end. Formats with times get a key at the end instead.";
    FrameTimeRounded = "W211", "a frame time of few digits", "A frame time such as 0.033 is probably that of a usual rate, 30 frames a second, rounded to few digits. With this rate the clip is longer or shorter by more than 0.5 %. `--raw-times` keeps the frame time as written, `--override-fps` replaces it.";
    OffsetsReplaced = "W212" elsewhere, "offsets in the file are replaced", "The file has offsets of its joints, and `--offsets` or `--body-model` gives others. Leave the option out to keep those of the file.";
    OtherSpace = "W213" elsewhere, "another unit or up axis than the format's", "glTF is in metres with y up. The input states another unit or up axis, and the clip was not converted. So it lies on its side, or is too large or too small. `--up-axis y --scale metres` converts it.";
    NoPositions = "W214" elsewhere, "a trajectory without positions", "The clip has only rotations, but a trajectory has a position for each of them. 0 0 0 is written for all poses.";
    UnknownBody = "W301", "a body of an unknown number of joints", "SMPL has 24 joints, SMPL-H 52, SMPL-X 55; 22 of the joints are common to all. Bodies with another number are read without names and parents.";
    LeftOut = "W302" elsewhere, "arrays that are left out", "These arrays have an entry for each frame of the input, but Tumble does not know how to interpolate them. `--linear NAME`, in Python `linear=[NAME]`, interpolates them linearly.";
    ObjectsBeside = "W303", "pickled Python objects in addition to the keys", "The keys are in other arrays, so these objects are not read. If the file is written in the same layout, they are copied, unless they have an entry for each frame.";
    TwoRates = "W304", "two rates that differ", "The file states two different rates, or a rate that contradicts its times, its duration, or the rate of an option. `--override-fps` replaces the rate of a file, or a number that is no rate; `--source-fps` is for files that state none.";
    TimeUnit = "W305", "times in another unit than seconds", "Seconds since 1970 have ten digits, milliseconds thirteen, microseconds sixteen, nanoseconds nineteen (ORB-SLAM writes them). A first time from 1e11 on is taken for milliseconds, from 1e14 on for microseconds, from 1e17 on for nanoseconds. `--time-unit` states the unit and avoids this warning.";
    ArraysNotRead = "W306", "arrays that are not read", "This is not an error: the rotations were found in other arrays, and the names of these arrays are not known. Usually there is nothing to do. If one of them contains translations or times, name all arrays of the motion, as in `--map rotations=quat:frame,translations=root_pos:frame,time=t`. Arrays that files of a layout usually contain, such as `betas` and `gender` of AMASS, cause no warning. A result in the same layout keeps constant arrays.";
    Bridged = "W401" elsewhere, "keys that are missing", "Cells are blank or NaN. Because of `--bridge-gaps`, the track is interpolated between its other keys there.";
    ColumnsLeftOut = "W402", "columns that are left out", "Their names are not known, or a list has more numbers than `--map` uses. `--map` defines the meaning of columns.";
    RowsSorted = "W403", "rows that are not in the order of their times", "The rows of a track are sorted by time. If the clock was set back instead, so that sorting would mix two recordings, they are refused (E026).";
    FurtherNumbers = "W501", "further numbers after a pose", "A line of a trajectory has a time, a position and a quaternion, or the twelve numbers of a matrix in KITTI. Numbers after these, such as a covariance or velocities, are not read.";
    BodyDirection = "W601" elsewhere, "a body without a clear direction", "A body on a path faces the direction of its motion. One that stands still on the whole path has none, and faces +z. If the roll that is left over at the end of a closed path is 180°, it can be removed in two directions.";
    FbxBeside = "W701", "content that is not motion", "Only nodes and their animation are read from FBX. Meshes, skins, materials and other content are not.";
    FbxProperties = "W702", "curves of other properties", "They animate something other than a transform, such as blend shapes, visibility or a lens.";
    FbxOutside = "W703", "keys outside the take", "An animation stack has a start and an end. Some curves have keys outside, which a player does not show.";
    FbxScaleNodes = "W704", "nodes that carry scales", "In FBX, a node can be set not to pass its scale to its children. If this changes the result, Tumble adds a node that has the scale.";
    FbxWild = "W705", "a curve that is not followed", "Between two keys of the file, it would need more than 4096 keys, or it changes within less than 1e-7 s. Between these keys it is only approximated.";
    FbxRests = "W706", "a stack that moves nothing", "It has no curves of nodes, or is a pose: each curve has one key. Nothing moves.";
    FbxOdd = "W707", "a problem that was corrected", "The library that reads FBX found a problem and corrected it.";
    FbxSpheric = "W708", "the spheric rotation order", "A node has the rotation order 6 (eSphericXYZ). Its angles are read as those of the order XYZ, as Autodesk's SDK does.";
    FbxSolo = "W709", "a layer that plays alone", "In the program that wrote the file, this layer was set to play alone (Solo), for example to look at it. Layers that are muted are left out, all others are read. Mute the others to read this layer alone.";
    McapCut = "W801", "a truncated log", "It ends within a record or without the record that ends a log, for example because recording was interrupted. Everything before is read.";
    McapOthers = "W802", "topics of other types", "They contain no poses, or their messages are not encoded in CDR.";
    McapClocks = "W803" elsewhere, "topics of different clocks", "The stamps of some topics are near the times at which the messages were logged, and those of others are not. The others may be the times of a simulation, or of a computer whose clock was not set. Poses of both kinds do not belong together at equal times.";
    AssumedRate = "W903", "a rate that is assumed", "The file has neither times nor a rate, and all files of its kind have the same rate. `--source-fps` sets another rate.";
    JointLimits = "W904" elsewhere, "joints outside their limits", "The robot's file has limits of the joint, and the motion exceeds them. No value is changed; `--limits clamp` keeps joints inside, `--limits refuse` makes this an error.";
    RobotMerged = "W905" elsewhere, "bodies that MuJoCo merges", "If `fusestatic` is set, MuJoCo merges bodies without joints into their parents. Its bodies then have other numbers than Tumble's; the names are the same. `--fixed-bodies merge` writes the bodies that MuJoCo has.";
    UnnamedJoints = "W906", "joints without names", "The file has a number for each joint and does not name them. They are numbered in the order of the file, which depends on the program that wrote it. `--robot FILE`, in Python `robot=`, gives them the names of the joints in a robot's file. The numbers of a list in a table, such as `action` of LeRobot, get names by `--map`, as in `left_knee=action[3]:scalar:angle`.";
    QuaternionOrder = "W907", "a quaternion whose order is doubtful", "The first component is large and the last one small. This would be normal for an upright robot if w were first. The columns have no names; state the order with `--source-order`.";
    NotSymmetric = "W908" elsewhere, "a rest pose that is not its mirror image", "Mirroring exchanges the motion of both sides, but the skeleton stays as it is. So positions are exact mirror images only if the rest pose is its own mirror image. If the difference is large, the axis of `--mirror` is probably not the one from left to right.";
    TranslationsDropped = "W910" elsewhere, "translations of joints that are lost", "On the target skeleton, only the hips have translations. Other joints of the source also move relative to their parents; the message has the largest distance.";
    InertObjects = "W911", "objects of classes that are not read", "Only the names of their classes are kept; no code is run. If the motion needs the value of such an object, this is an error (E912).";
    TrailingBytes = "W912", "bytes after the end of a pickle", "They are not read. Perhaps the file contains several pickles, one after another; save them as one list.";
    RestingJoints = "W913" elsewhere, "joints without keys", "The robot of `--robot` has joints for which the file has no values. These joints stay in the rest position of the robot's file.";
    OtherRobot = "W914" elsewhere, "bodies that are not where their joints put them", "The poses of bodies in the file differ from those that follow from its joints and the robot of `--robot`. The file may belong to another version of the robot. Bodies are computed from the joints. Files that do not name their joints, and whose order is not stated, are refused instead (E904).";
    AngleJumps = "W915" elsewhere, "angles that jump by more than half a turn", "Between two keys an angle changes by more than half a turn. Perhaps the program that wrote the file wrapped angles to one turn. The angle is interpolated as stored, the long way around. `--robot` unwraps hinges without limits; otherwise unwrap the angles first (numpy.unwrap).";
    FollowingJoints = "W916" elsewhere, "joints that follow others", "In the robot's file, the joint follows another joint (`mimic`): its value is that of the other joint times a factor, plus an offset. This value is computed and used instead of the values in the file; the message has the largest difference between the two.";
    RotationsDropped = "W917" elsewhere, "rotations of joints that are lost", "Joints of the input move, but no joint of the target follows them. `tumble retarget` pairs the parts of the body, and other joints with the same name and the same joints above them. `--bones` pairs further joints by name.";
    CoarseAngles = "W918" elsewhere, "angles in coarse steps", "Keys are f32, whose steps grow with the number: 6e-5 rad at 512 rad, 5e-4 rad at 5 000 rad. Unwrapped angles are stored relative to a whole number of turns near the middle of their range, so an angle that grows to 10 000 rad has the steps of 5 000 rad. Where this matters, cut the file into shorter ones: each counts from its own middle. Velocities of such angles have errors of about one step per interval between keys.";
    OtherScalars = "W919" elsewhere, "scalars that are no joints of the robot", "The scalars of the file are in groups, such as `observation.state.` and `action.` of LeRobot, and the names of one group are those of the robot's joints. The others are left out. If a joint is in two groups, one of states and one of actions, the states are used, because they were measured and the actions were only commanded.";
    SetRate = "W930" elsewhere, "another rate than that of a set of features", "HumanML3D has 20 frames per second, and its numbers are steps from frame to frame. Models that were trained on it would misread the numbers at another rate. Use `--fps 20`.";
    SetUnit = "W931" elsewhere, "a body that is not in metres", "The numbers of this set of features are metres, and the body is much smaller or larger than a person. The file is probably in another unit, such as centimetres. `--scale 0.01` converts centimetres.";
    LostPartner = "W932" elsewhere, "joints of a side without a partner", "Mirroring exchanges joints whose names differ only in the side. The names of these joints contain a side, but no joint has the same name with the other side. So these joints are mirrored in place.";
}

impl Code {
    /// The code with this name; case is ignored.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL
            .iter()
            .copied()
            .find(|code| code.name().eq_ignore_ascii_case(name))
    }

    /// Whether the code is that of an error or of a warning.
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
